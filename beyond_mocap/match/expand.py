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
from ..base.errors import InputError, spans_of
from ..library.automatic import with_chosen_gaits
from ..library.features import FPS
from ..library.library import Library
from ..library.made import MADE_FOLDER
from ..motion.motion import concatenate
from ..motion.track.ball_path import BallPath
from ..synthesis.construct.hand_over import handed_over
from ..synthesis.construct.meeting import eased
from ..synthesis.plan import Plan
from ..synthesis.resolve_plan import resolve_plan
from ..synthesis.search.edit_list import EditList, at_times
from ..synthesis.search.footage import shown
from ..synthesis.synthesize import constructed
from ..synthesis.take import DribbleTouch, Take
from .pieces.named_edit import bound, part
from .pieces.units import cut_plan, frame_count, window_edges
from .player_edit import PlayerEdit, Stretch

AROUND = 4.0
"""s on either side of a window that are constructed too."""

HAND_OVER = 0.5
"""s after an edge in which the motion of the window before blends into the next one's."""

SETTLED = 2.0
"""s after an edge within which a foot in contact reaches its position in the next window."""

_PINNED = 1e-9
"""A share that counts as zero but fixes a frame at its own position."""

Progress = Callable[[float, str], None]

_SAME_TIME = 1e-6


def expanded(
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
        def tell(fraction: float, number=number):
            report((number + fraction) / len(edit.stretches), "Constructing")

        take = _Layout(library, edit.window, stretch).take(start, end, tell)
        takes += [] if take is None else [take]
    report(1.0, "Done")
    return tuple(takes)


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
    standing: np.ndarray


class _Layout:
    """A stretch and the grid of windows in which it is constructed."""

    def __init__(self, library: Library, window: float, stretch: Stretch):
        self.plan, self.edit = stretch.plan, stretch.edit
        made = any(path.startswith(MADE_FOLDER) for path, _ in self.edit.clips)
        self.library = with_chosen_gaits(library.extended if made else library, dict(self.plan.gaits))
        self.fps, self.begin = self.plan.fps, float(self.plan.track.times[0])
        self.count = frame_count(self.plan, self.fps)
        self.edges = window_edges(self.begin, self.count, window, self.fps, step=1)

    def take(self, start: float, end: float, tell: Callable[[float], None]) -> Take | None:
        """Construct the frames from `start` to `end` s; None if there are fewer than two."""
        low = max(0, int(np.ceil((start - self.begin) * self.fps - 1e-6)))
        high = min(self.count, int(np.floor((end - self.begin) * self.fps + 1e-6)) + 1)
        if high - low < 2:
            return None
        parts = list(self._parts(low, high, tell))
        return one_take(parts, cut_plan(self.plan, self._time(low), self._time(high - 1)))

    def _parts(self, low: int, high: int, tell: Callable[[float], None]) -> Iterator[Take]:
        """Iterate over the frames low .. high, window by window."""
        settled = int(round(SETTLED * self.fps))
        numbers = [n for n, (a, b) in enumerate(zip(self.edges, self.edges[1:])) if a < high and b > low]
        before = None
        for done, number in enumerate(numbers):
            tell(done / len(numbers))
            window, handed = self._window(number), None
            first, end = max(low, window.low), min(high, window.high)
            if number and first < window.low + settled:
                handed = _handed_over(before or self._window(number - 1), window, settled)
            yield own_part(handed or window.take, first - window.first, end - window.first)
            before = window

    def _window(self, number: int) -> _Window:
        """Construct a window with its margins; only key moments within its plan count."""
        low, high = self.edges[number : number + 2]
        around = int(round(AROUND * self.fps))
        first, end = max(0, low - around), min(self.count, high + around)
        plan = cut_plan(self.plan, self._time(first), self._time(end - 1))
        shown_here = self._shown(plan, first * FPS / self.fps)
        resolved = resolve_plan(plan, self.library, touches_solved=True)
        take = constructed(self.library, resolved, shown_here)
        return _Window(low=low, high=high, first=first, take=take, standing=self._standing(shown_here, take))

    def _shown(self, plan: Plan, at: float) -> EditList:
        """Select the edit list of a plan that starts at frame `at` (fractional) of the stretch, at the library's
        rate.
        """
        count, whole = frame_count(plan), int(at)
        edit = part(self.edit, whole, min(whole + count + 1, len(self.edit)))
        edit = bound(self.library, edit, plan.timeline.keys)
        clip, frame, piece = at_times(edit, np.minimum(np.arange(count) + (at - whole), len(edit) - 1))
        return EditList(clip, frame, np.flatnonzero(np.diff(piece)) + 1, edit.keys)

    def _standing(self, edit: EditList, take: Take) -> np.ndarray:
        """Find the feet (T, 2) bool whose heel or toe is in contact."""
        index = np.minimum(np.arange(len(take.motion)) * (FPS / self.fps), len(edit) - 1)
        what = shown(self.library, edit, index)
        frame, clips = np.round(what.clip_frame).astype(int), self.library.clips
        stands = np.array([clips[clip].standing[at].any(axis=1) for clip, at in zip(what.clip, frame)])
        return stands & ~take.stepped

    def _time(self, frame: int) -> float:
        return self.begin + frame / self.fps


def _handed_over(before: _Window, window: _Window, settled: int) -> Take:
    """Blend the first `settle_frames` own frames of a window's take from where the window before ends."""
    take, old, fps = window.take, before.take, window.take.motion.fps
    hand = int(round(HAND_OVER * fps))
    settled = min(settled, len(take.motion) - (window.low - window.first) - 1)
    at = slice(window.low - window.first, window.low - window.first + settled + 1)
    then = slice(window.low - before.first, window.low - before.first + hand)
    ahead = np.arange(settled + 1)
    share = eased(1.0 - (ahead + 1.0) / (hand + 1.0), np.ones(len(ahead)))
    # Over BLEND_SECONDS the old pose fades out; feet in contact may take until the settle time.
    share[-1] = _PINNED
    places, turns = take.motion.root_positions[at].copy(), take.motion.rotations[at].copy()
    new = places.copy(), turns.copy()
    places[:hand], turns[:hand] = old.motion.root_positions[then], old.motion.rotations[then]
    standing = np.repeat(window.standing[at][:, :, None], 2, axis=2)
    root, rotations = take.motion.root_positions.copy(), take.motion.rotations.copy()
    root[at], rotations[at] = handed_over(take.motion.skeleton, new, (places, turns), share=share, standing=standing,
                                          fps=fps)
    motion = replace(take.motion, root_positions=root, rotations=rotations)
    return replace(take, motion=motion, ball=_ball_handed(old.ball, take.ball, then, at.start, share[:hand]))


def _ball_handed(
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


def own_part(take: Take, first: int, end: int) -> Take:
    """Cut frames first .. end out of a take, with the key moments, pins, touches and warnings of that time.

    Args:
        take: the take.
        first: first frame.
        end: end frame.
    Returns:
        The take, without edit list and without what editing needs.
    """
    inside = slice(first, end)
    begin, fps = take.start_time + first / take.motion.fps, take.motion.fps
    until = begin + (end - first) / fps
    seams = take.seams[(take.seams >= first) & (take.seams < end)] - first
    ball = take.ball
    if ball is not None:
        turns = None if ball.rotations is None else ball.rotations[inside]
        ball = BallPath(ball.times[inside], ball.positions[inside], ball.measured[inside], turns)
    values = {name: getattr(take, name) for name in ("correction", "ik_miss", "stepped")}
    return replace(
        take, motion=take.motion.frames(first, end), start_time=begin, clip=take.clip[inside],
        clip_frame=take.clip_frame[inside], mirrored=take.mirrored[inside], words=take.words[inside],
        contacts=take.contacts[inside], seams=seams, ball=ball,
        **{name: None if each is None else each[inside] for name, each in values.items()},
        timeline=_between(take.timeline, begin, until),
        keys=tuple(
            replace(key, frame=key.frame - first) for key in take.keys if _within(key.asked.in_force, begin, until)
        ),
        pins=tuple(pin for pin in take.pins if _within(pin.pin.time, begin, until)),
        dribbled=tuple(
            DribbleTouch(max(one.first - first, 0), min(one.last, end - 1) - first, one.side)
            for one in take.dribbled if one.first < end and one.last >= first
        ),
        warnings=tuple(line for line in take.warnings if _told_in(line, begin, until)),
        unpinned=None, met_ball=None, plan=None, edit=None,
    )  # fmt: skip


def _within(time: float, begin: float, until: float) -> bool:
    return begin - _SAME_TIME <= time < until - _SAME_TIME


def _told_in(line: str, begin: float, until: float) -> bool:
    """Say whether a warning is about no time, or about a time that starts here."""
    spans = spans_of(line)
    return not spans or _within(spans[0][0], begin, until)


def _between(timeline: Timeline, begin: float, until: float) -> Timeline:
    """Cut spans to a time, and select the key moments in it."""
    spans = [span for span in timeline.spans if span.start < until - _SAME_TIME and span.end > begin + _SAME_TIME]
    cut = [replace(span, start=max(span.start, begin), end=min(span.end, until)) for span in spans]
    return Timeline(tuple(cut), tuple(key for key in timeline.keys if _within(key.in_force, begin, until)))


def one_take(takes: Sequence[Take], plan: Plan) -> Take:
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
    arrays = ("clip_frame", "mirrored", "contacts", "correction", "ik_miss", "stepped")
    begin, fps = takes[0].start_time, takes[0].motion.fps
    return replace(
        takes[0], motion=concatenate([take.motion for take in takes]), clips=clips,
        clip=np.concatenate([np.array([number[path] for path in take.clips], int)[take.clip] for take in takes]),
        **{name: np.concatenate([getattr(take, name) for take in takes]) for name in arrays},
        words=tuple(words for take in takes for words in take.words), seams=seams[seams > 0],
        timeline=_one_timeline([take.timeline for take in takes]),
        keys=tuple(
            replace(key, frame=key.frame + first) for take, first in zip(takes, firsts) for key in take.keys
        ),
        pins=tuple(pin for take in takes for pin in take.pins),
        dribbled=tuple(
            DribbleTouch(one.first + int(first), one.last + int(first), one.side)
            for take, first in zip(takes, firsts) for one in take.dribbled
        ),
        ball=_one_ball(takes, begin + np.arange(firsts[-1]) / fps),
        warnings=tuple(dict.fromkeys(line for take in takes for line in take.warnings)),
        seconds={name: sum(take.seconds.get(name, 0.0) for take in takes) for name in takes[0].seconds},
        plan=plan, solved=plan.solved,
    )  # fmt: skip


def _one_timeline(timelines: Sequence[Timeline]) -> Timeline:
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


def _one_ball(takes: Sequence[Take], times: np.ndarray) -> BallPath | None:
    """Join the balls of all takes at times (T,) s; unknown where a take has none, None if no take has one."""
    if all(take.ball is None for take in takes):
        return None
    empty = [(np.full((len(take.motion), 3), np.nan), np.zeros(len(take.motion), bool)) for take in takes]
    pairs = [none if take.ball is None else (take.ball.positions, take.ball.measured)
             for take, none in zip(takes, empty)]  # fmt: skip
    places, measured = (np.concatenate(column) for column in zip(*pairs))
    return BallPath(times, places, measured)
