"""Constructed motion on disk: a file for each window of a player. It is constructed once, read by the collision
avoidance of every minute, by the player's figures and by the page, and removed when these are done.

Numbers keep every bit. `list_blocks` cuts a player into pieces of work, `pack_part` and `load_part` store one window,
and `MotionSpan` says which windows show a span.
"""

from __future__ import annotations

import io
import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...annotation import KeyMoment, Span, Timeline
from ...base.errors import TimedMessage, line_spans
from ...files.plain_npz import HEADER, read_own_arrays
from ...library.library import Library
from ...motion.motion import Motion
from ...motion.skeleton import Skeleton
from ...motion.track.ball_path import BallPath
from ...synthesis.plan import Plan
from ...synthesis.resolve_plan import measure_size
from ...synthesis.take import DribbleTouch, KeyResult, Take
from ..player_edit import PlayerEdit, Stretch
from ..player_motion import StretchConstructor, StretchWindows, cut_take, join_takes

BLOCK_WINDOWS = 24
"""Windows that one piece of work constructs: the one before them is constructed too, so fewer cost more."""

_ARRAYS = ("clip", "clip_frame", "mirrored", "contacts", "seams", "correction", "ik_miss", "stepped", "planned_heading")
_PLAIN = ("start_time", "clips", "method", "seed", "seconds")
_BALL = ("times", "positions", "measured", "rotations")

Content = Path | bytes
"""A stored window: its file, or what is in it, for workers that do not see this machine's files."""


@dataclass(frozen=True, eq=False)
class MotionBlock:
    """Some windows of a player that are constructed together.

    Attributes:
        stretch: the stretch, whole, since times are counted from its start.
        window: s of the windows.
        first: number of the first window.
        end: number after the last one.
    """

    stretch: Stretch
    window: float
    first: int
    end: int

    def construct(self, library: Library) -> tuple[bytes, ...]:
        """Construct the windows, each as `pack_part` packs it."""
        grid = StretchWindows(self.stretch, self.window)
        low, high = grid.edges[self.first], grid.edges[self.end]
        return tuple(map(pack_part, StretchConstructor(library, grid).iter_parts(low, high, lambda share: None)))


def list_blocks(edit: PlayerEdit) -> list[tuple[int, MotionBlock]]:
    """List (index of the stretch, block) of a player."""
    blocks = []
    for index, stretch in enumerate(edit.stretches):
        count = len(StretchWindows(stretch, edit.window).edges) - 1
        blocks += [(index, MotionBlock(stretch, edit.window, first, min(first + BLOCK_WINDOWS, count)))
                   for first in range(0, count, BLOCK_WINDOWS)]
    return blocks


@dataclass(frozen=True, eq=False)
class MotionSpan:
    """A span of a stretch, and the stored windows that show it.

    Attributes:
        plan: of the span.
        parts: (content, first, end) of each window, the frames of it that are shown.
    """

    plan: Plan
    parts: tuple[tuple[Content, int, int], ...]

    def load_take(self, skeleton: Skeleton) -> Take:
        """Load what `player_motion.construct_player` constructs for the span; InputError or ValueError if a file is
        damaged.
        """
        size = measure_size(self.plan, skeleton)
        own = skeleton if size == 1.0 else skeleton.scale(size)
        parts = (cut_take(load_part(content, own), first, end) for content, first, end in self.parts)
        return join_takes(list(parts), self.plan)


def pack_part(take: Take) -> bytes:
    """Pack the take of a window (`player_motion.cut_take`): all that figures need. A match requests no pins.

    All arrays are stored as one, those with the longest numbers first: to open an array of a file takes longer than to
    read it.
    """
    table = {words: number for number, words in enumerate(dict.fromkeys(take.words))}
    arrays = {name: getattr(take, name) for name in _ARRAYS}
    arrays |= {"root": take.motion.root_positions, "rotations": take.motion.rotations,
               "words": np.array([table[words] for words in take.words], np.int32)}
    header = {name: getattr(take, name) for name in _PLAIN}
    header |= {"fps": take.motion.fps, "words": list(table), "timeline": asdict(take.timeline),
               "keys": [asdict(key) for key in take.keys], "touches": [asdict(one) for one in take.dribble_touches],
               "warnings": [[str(line), line_spans(line)] for line in take.warnings]}
    if take.ball is not None:
        arrays |= {f"ball.{name}": getattr(take.ball, name) for name in _BALL}
    there = sorted(((name, values) for name, values in arrays.items() if values is not None),
                   key=lambda row: -row[1].itemsize)
    header["arrays"] = [[name, values.dtype.str, values.shape] for name, values in there]
    numbers = np.concatenate([np.ascontiguousarray(values).ravel().view(np.uint8) for _, values in there])
    out = io.BytesIO()
    np.savez(out, allow_pickle=False, header=np.frombuffer(json.dumps(header).encode(), np.uint8), numbers=numbers)
    return out.getvalue()


def load_part(content: Content, skeleton: Skeleton) -> Take:
    """Load what `pack_part` packed.

    Args:
        content: the file, or what is in it.
        skeleton: the player's.
    Returns:
        The take, without a plan.
    """
    stored = read_own_arrays(content, "the motion of a window")
    header = json.loads(stored[HEADER].tobytes())
    arrays = _split_arrays(header["arrays"], stored["numbers"])
    words = [tuple(one) for one in header["words"]]
    ball = [arrays.get(f"ball.{name}") for name in _BALL]
    return Take(
        motion=Motion.from_stored(skeleton, arrays["root"], arrays["rotations"], header["fps"]),
        words=tuple(map(words.__getitem__, arrays["words"].tolist())), timeline=_parse_timeline(header["timeline"]),
        keys=tuple(_parse_key(key) for key in header["keys"]), ball=None if ball[0] is None else BallPath(*ball),
        warnings=tuple(TimedMessage(text, *spans) for text, spans in header["warnings"]),
        dribble_touches=tuple(DribbleTouch(**one) for one in header["touches"]),
        **{name: arrays.get(name) for name in _ARRAYS},
        **{**{name: header[name] for name in _PLAIN}, "clips": tuple(header["clips"])},
    )  # fmt: skip


def _split_arrays(rows: list, numbers: np.ndarray) -> dict[str, Any]:
    """Split the bytes of all arrays, one behind the other, into read-only arrays by name; rows: (name, type, shape)."""
    arrays: dict[str, Any] = {}
    place = 0
    for name, kind, shape in rows:
        size = math.prod(shape) * np.dtype(kind).itemsize
        arrays[name] = numbers[place : place + size].view(kind).reshape(shape)
        place += size
    return arrays


def _parse_timeline(value: dict) -> Timeline:
    return Timeline(tuple(Span(**span) for span in value["spans"]), tuple(KeyMoment(**key) for key in value["keys"]))


def _parse_key(value: dict) -> KeyResult:
    used = value["used_instead"]
    return KeyResult(**{**value, "requested": KeyMoment(**value["requested"]), "words": tuple(value["words"]),
                        "used_instead": None if used is None else tuple(used)})
