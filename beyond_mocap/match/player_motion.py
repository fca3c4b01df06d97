"""Construct the motion of any span of a player from their edit list; join takes of a player, and cut them.

A player is constructed in windows of a fixed grid, each with some seconds around it, and one window blends into the
next at their edge. So a frame is constructed in the same way whatever span is requested, and is the same bit for bit;
only the signs of quaternions, which are continuous within a motion, may differ. No more than two windows are in memory
besides the result.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..annotation import Span, Timeline
from ..base.errors import InputError, line_spans
from ..library.automatic_locomotion import apply_chosen_gaits
from ..library.clip import SYNTHETIC_FOLDER
from ..library.features import FPS
from ..library.library import Library
from ..library.missing_actions import add_actions
from ..motion.motion import concatenate_motions
from ..motion.track.ball_path import BallPath
from ..synthesis.construct.contact_geometry import ease_in_out
from ..synthesis.construct.edit_blending import blend_with_old
from ..synthesis.plan import Plan
from ..synthesis.resolve_plan import resolve_plan
from ..synthesis.search.edit_list import EditList, sample_edit
from ..synthesis.search.source_frames import look_up_contacts, look_up_frames
from ..synthesis.synthesize import construct_take
from ..synthesis.take import DribbleTouch, Take
from .pieces.named_edit import cut_named_edit, to_library_edit
from .pieces.units import build_window_edges, count_frames, cut_plan
from .player_edit import PlayerEdit, Stretch

MARGIN_SECONDS = 4.0
"""s on either side of a window that are constructed too."""

BLEND_SECONDS = 0.5
"""s after an edge in which the motion of the window before blends into the next one's."""

SETTLE_SECONDS = 2.0
"""s after an edge within which a foot in contact reaches its position in the next window."""

_MIN_SHARE = 1e-9
"""A share that counts as zero but fixes a frame at its own position."""

Progress = Callable[[float, str], None]

_SAME_TIME = 1e-6


def construct_player(
    library: Library, edit: PlayerEdit, start: float, end: float, progress: Progress | None = None
) -> tuple[Take, ...]:
    """Construct what a player does in a span of the match: one take for each stretch on the pitch that reaches into it.

    Args:
        library: the clips.
        edit: the player's edit list.
        start: s on the match's clock.
        end: s on the match's clock.
        progress: receives the share done and a text.
    Returns:
        Takes; the first frame of each is the stretch's first one at or after `start`. Its plan is that of its time; it
        has no edit list.
    Raises:
        InputError: if the library lacks a clip that is used, or `end` is not after `start`.
    """
    if not end > start:
        raise InputError("times", f"{start:g} to {end:g} s", "an end after the start")
    report = progress or (lambda fraction, text: None)
    takes = []
    for number, stretch in enumerate(edit.stretches):
        def report_stretch(fraction: float, number=number):
            report((number + fraction) / len(edit.stretches), "Constructing")

        grid = StretchWindows(stretch, edit.window)
        if (frames := grid.find_frames(start, end)) is not None:
            parts = StretchConstructor(library, grid).iter_parts(*frames, report_stretch)
            takes.append(join_takes(list(parts), grid.cut_plan(*frames)))
    report(1.0, "Done")
    return tuple(takes)


class StretchWindows:
    """A stretch and the grid of windows in which it is constructed.

    Attributes:
        plan: of the stretch.
        edit: its edit list.
        fps: frames per second of the output.
        begin: s of its first frame.
        count: its number of frames.
        edges: frames between which its windows lie.
    """

    def __init__(self, stretch: Stretch, window: float):
        self.plan, self.edit = stretch.plan, stretch.edit
        self.fps, self.begin = self.plan.fps, float(self.plan.track.times[0])
        self.count = count_frames(self.plan, self.fps)
        self.edges = build_window_edges(self.begin, self.count, window, self.fps, step=1)

    def find_frames(self, start: float, end: float) -> tuple[int, int] | None:
        """Find the (first, end) frames from `start` to `end` s; None if there are fewer than two."""
        low = int(max(0, np.ceil((start - self.begin) * self.fps - 1e-6)))
        high = int(min(self.count, np.floor((end - self.begin) * self.fps + 1e-6) + 1))
        return None if high - low < 2 else (low, high)

    def list_windows(self, low: int, high: int) -> list[int]:
        """List the windows with frames of low .. high."""
        return [n for n, (a, b) in enumerate(zip(self.edges, self.edges[1:])) if a < high and b > low]

    def cut_plan(self, low: int, high: int) -> Plan:
        """Cut the plan of frames low .. high."""
        return cut_plan(self.plan, self.compute_time(low), self.compute_time(high - 1))

    def compute_time(self, frame: int) -> float:
        """Compute the second of a frame on the match's clock."""
        return self.begin + frame / self.fps


@dataclass(frozen=True, eq=False, kw_only=True)
class _Window:
    """One constructed window.

    Attributes:
        low: first frame of the window in the stretch, at the output's rate.
        high: end frame of the window.
        first: frame of the stretch of the take's first frame.
        take: the window with the frames around it.
        foot_contacts: (T, 2) bool, heel or toe of each foot in contact.
    """

    low: int
    high: int
    first: int
    take: Take
    foot_contacts: np.ndarray


class StretchConstructor:
    """What constructs a stretch, window by window."""

    def __init__(self, library: Library, grid: StretchWindows):
        """Prepare the library of the stretch.

        Args:
            library: the clips.
            grid: the stretch.
        Raises:
            InputError: if bodies of the stretch have other joints than the library.
        """
        joints = len(library.skeleton)
        for body in grid.plan.bodies:
            if body.rotations.shape[1] != joints:
                raise InputError(library.folder, f"a skeleton of {joints} joints", f"{body.rotations.shape[1]}, as the "
                                 "player's bodies have", "run the match again")
        paths = [path for path, _ in grid.edit.clips]
        if any(path.startswith(SYNTHETIC_FOLDER) for path in paths):
            library = add_actions(library.with_synthetic_clips, paths)
        self.library, self.grid = apply_chosen_gaits(library, dict(grid.plan.gaits)), grid

    def iter_parts(self, low: int, high: int, report_progress: Callable[[float], None]) -> Iterator[Take]:
        """Construct the frames low .. high: iterate over one take for each window.

        Args:
            low: first frame of the stretch.
            high: end frame.
            report_progress: receives the share done.
        """
        settle_frames = int(round(SETTLE_SECONDS * self.grid.fps))
        numbers, before = self.grid.list_windows(low, high), None
        for done, number in enumerate(numbers):
            report_progress(done / len(numbers))
            window, blended = self._construct_window(number), None
            first, end = max(low, window.low), min(high, window.high)
            if number and first < window.low + settle_frames:
                blended = _blend_window_start(before or self._construct_window(number - 1), window, settle_frames)
            yield cut_take(blended or window.take, first - window.first, end - window.first)
            before = window

    def _construct_window(self, number: int) -> _Window:
        """Construct a window with its margins; only key moments within its plan count."""
        grid = self.grid
        low, high = grid.edges[number : number + 2]
        around = int(round(MARGIN_SECONDS * grid.fps))
        first, end = max(0, low - around), min(grid.count, high + around)
        plan = grid.cut_plan(first, end)
        shown_here = self._select_edit(plan, first * FPS / grid.fps)
        resolved = resolve_plan(plan, self.library, are_touches_resolved=True)
        take = construct_take(self.library, resolved, shown_here)
        return _Window(low=low, high=high, first=first, take=take, foot_contacts=self._find_foot_contacts(shown_here,
                take))

    def _select_edit(self, plan: Plan, at: float) -> EditList:
        """Select the edit list of a plan that starts at frame `at` (fractional) of the stretch, at the library's
        rate.
        """
        count, whole = count_frames(plan), int(at)
        edit = cut_named_edit(self.grid.edit, whole, min(whole + count + 1, len(self.grid.edit)))
        edit = to_library_edit(self.library, edit, plan.timeline.keys)
        clip, frame, piece = sample_edit(edit, np.minimum(np.arange(count) + (at - whole), len(edit) - 1))
        return EditList(clip, frame, np.flatnonzero(np.diff(piece)) + 1, edit.keys)

    def _find_foot_contacts(self, edit: EditList, take: Take) -> np.ndarray:
        """Find the feet (T, 2) bool whose heel or toe is in contact."""
        index = np.minimum(np.arange(len(take.motion)) * (FPS / self.grid.fps), len(edit) - 1)
        contacts = look_up_contacts(self.library, look_up_frames(self.library, edit, index))
        return contacts.any(axis=2) & ~take.stepped


def _blend_window_start(before: _Window, window: _Window, settle_frames: int) -> Take:
    """Blend the first `settle_frames` own frames of a window's take from where the window before ends."""
    take, old, fps = window.take, before.take, window.take.motion.fps
    hand = int(round(BLEND_SECONDS * fps))
    settle_frames = min(settle_frames, len(take.motion) - (window.low - window.first) - 1)
    at = slice(window.low - window.first, window.low - window.first + settle_frames + 1)
    then = slice(window.low - before.first, window.low - before.first + hand)
    ahead = np.arange(settle_frames + 1)
    share = ease_in_out(1.0 - (ahead + 1.0) / (hand + 1.0), np.ones(len(ahead)))
    # Over BLEND_SECONDS the old pose fades out; feet in contact may take until the settle time.
    share[-1] = _MIN_SHARE
    places, rotations_before = take.motion.root_positions[at].copy(), take.motion.rotations[at].copy()
    new = places.copy(), rotations_before.copy()
    places[:hand], rotations_before[:hand] = old.motion.root_positions[then], old.motion.rotations[then]
    foot_contacts = np.repeat(window.foot_contacts[at][:, :, None], 2, axis=2)
    root, rotations = take.motion.root_positions.copy(), take.motion.rotations.copy()
    root[at], rotations[at] = blend_with_old(take.motion.skeleton, new, (places, rotations_before), share=share,
                                             heel_toe_contacts=foot_contacts, fps=fps)
    motion = replace(take.motion, root_positions=root, rotations=rotations)
    return replace(take, motion=motion, ball=_blend_ball(old.ball, take.ball, then, at.start, share[:hand]))


def _blend_ball(
    old: BallPath | None, new: BallPath | None, then: slice, first: int, share: np.ndarray
) -> BallPath | None:
    """Blend the start of the new ball path from the old one: its share (H,) at frames first ... of the new."""
    if old is None or new is None:
        return new
    places, before = new.positions.copy(), old.positions[then]
    here = places[first : first + len(share)]
    both = np.isfinite(before) & np.isfinite(here)
    places[first : first + len(share)] = np.where(both, here + share[:, None] * (before - here), here)
    return replace(new, positions=places)


def cut_take(take: Take, first: int, end: int) -> Take:
    """Cut frames first .. end out of a take, with the key moments, pins, touches and warnings of that time.

    Args:
        take: the take.
        first: first frame.
        end: end frame.
    Returns:
        The take, without edit list and without what editing needs.
    """
    inside = slice(first, end)
    start, fps = take.start_time + first / take.motion.fps, take.motion.fps
    stop = start + (end - first) / fps
    seams = take.seams[(take.seams >= first) & (take.seams < end)] - first
    ball = take.ball
    if ball is not None:
        turns = None if ball.rotations is None else ball.rotations[inside]
        ball = BallPath(ball.times[inside], ball.positions[inside], ball.measured[inside], turns)
    values = {name: getattr(take, name) for name in ("correction", "ik_miss", "stepped", "planned_heading")}
    return replace(
        take, motion=take.motion.frames(first, end), start_time=start, clip=take.clip[inside],
        clip_frame=take.clip_frame[inside], mirrored=take.mirrored[inside], words=take.words[inside],
        contacts=take.contacts[inside], seams=seams, ball=ball,
        **{name: None if each is None else each[inside] for name, each in values.items()},
        timeline=_cut_timeline(take.timeline, start, stop),
        keys=tuple(replace(key, frame=key.frame - first) for key in take.keys if _is_within(key.requested.resolved_time,
                                                                                            start, stop)),
        pins=tuple(pin for pin in take.pins if _is_within(pin.pin.time, start, stop)),
        dribble_touches=tuple(DribbleTouch(max(one.first - first, 0), min(one.last, end - 1) - first, one.side)
                              for one in take.dribble_touches if one.first < end and one.last >= first),
        warnings=tuple(line for line in take.warnings if _is_warning_within(line, start, stop)), unpinned=None,
        contact_ball=None, plan=None, edit=None,
    )  # fmt: skip


def _is_within(time: float, begin: float, until: float) -> bool:
    return begin - _SAME_TIME <= time < until - _SAME_TIME


def _is_warning_within(line: str, begin: float, until: float) -> bool:
    """Say whether a warning is about no time, or about a time that starts here."""
    spans = line_spans(line)
    return not spans or _is_within(spans[0][0], begin, until)


def _cut_timeline(timeline: Timeline, begin: float, until: float) -> Timeline:
    """Cut spans to a time, and select the key moments in it."""
    spans = [span for span in timeline.spans if span.start < until - _SAME_TIME and span.end > begin + _SAME_TIME]
    cut = [replace(span, start=max(span.start, begin), end=min(span.end, until)) for span in spans]
    return Timeline(tuple(cut), tuple(key for key in timeline.keys if _is_within(key.resolved_time, begin, until)))


def join_takes(takes: Sequence[Take], plan: Plan) -> Take:
    """Join takes that follow each other without a gap.

    Args:
        takes: in order of time.
        plan: the plan of their whole time.
    Returns:
        One take.
    """
    clips = tuple(dict.fromkeys(path for take in takes for path in take.clips))
    number = {path: index for index, path in enumerate(clips)}
    firsts = np.cumsum([0, *(len(take.motion) for take in takes)])
    seams = np.concatenate([take.seams + first for take, first in zip(takes, firsts)])
    arrays = ("clip_frame", "mirrored", "contacts", "correction", "ik_miss", "stepped", "planned_heading")
    begin, fps = takes[0].start_time, takes[0].motion.fps
    return replace(
        takes[0], motion=concatenate_motions([take.motion for take in takes]), clips=clips,
        clip=np.concatenate([np.array([number[path] for path in take.clips], int)[take.clip] for take in takes]),
        **{name: np.concatenate([getattr(take, name) for take in takes]) for name in arrays},
        words=tuple(words for take in takes for words in take.words), seams=seams[seams > 0],
        timeline=_join_timelines([take.timeline for take in takes]),
        keys=tuple(
            replace(key, frame=key.frame + first) for take, first in zip(takes, firsts) for key in take.keys
        ),
        pins=tuple(pin for take in takes for pin in take.pins),
        dribble_touches=tuple(
            DribbleTouch(one.first + int(first), one.last + int(first), one.side)
            for take, first in zip(takes, firsts) for one in take.dribble_touches
        ),
        ball=join_balls([take.ball for take in takes], [len(take.motion) for take in takes],
                        begin + np.arange(firsts[-1]) / fps),
        warnings=tuple(dict.fromkeys(line for take in takes for line in take.warnings)),
        seconds={name: sum(take.seconds.get(name, 0.0) for take in takes) for name in takes[0].seconds},
        plan=plan, solved=plan.solved,
    )  # fmt: skip


def _join_timelines(timelines: Sequence[Timeline]) -> Timeline:
    """Join timelines; a span that continues in the next one becomes one span."""
    spans: list[Span] = []
    for span in sorted((s for each in timelines for s in each.spans), key=lambda span: (span.words, span.start)):
        last = spans[-1] if spans else None
        same = last is not None and (last.words, last.avoid) == (span.words, span.avoid)
        if same and span.start <= last.end + _SAME_TIME:
            spans[-1] = replace(last, end=max(last.end, span.end))
        else:
            spans.append(span)
    return Timeline(tuple(spans), tuple(key for each in timelines for key in each.keys))


def join_balls(balls: Sequence[BallPath | None], counts: Sequence[int], times: np.ndarray) -> BallPath | None:
    """Join the balls of takes that follow each other.

    Args:
        balls: of each take.
        counts: frames of each take.
        times: (T,) s of all frames.
    Returns:
        The ball, unknown where a take has none; None if no take has one.
    """
    if all(ball is None for ball in balls):
        return None
    pairs = [(np.full((count, 3), np.nan), np.zeros(count, bool)) if ball is None else (ball.positions, ball.measured)
             for ball, count in zip(balls, counts, strict=True)]
    places, measured = (np.concatenate(column) for column in zip(*pairs))
    return BallPath(times, places, measured)
