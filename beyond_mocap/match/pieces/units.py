"""A player's plan cut into windows of work, each of which any process can search by itself.

Windows lie on a fixed grid of the match's clock, so that the same second falls into the same window for everybody, and
overlap, so that neighbours can be joined where both have found the same (`windows`). They begin and end with whole
slots of the search, counted from the stretch's first frame: in the overlap both are offered the same source frames.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...annotation import Timeline
from ...base.errors import InputError
from ...library.features import FPS
from ...motion.track import Track
from ...synthesis.plan import Plan, SolvedCourse
from ...synthesis.search.offer import SLOT
from ..player_edit import kept

WINDOW = 300.0
"""Seconds of a window's own part."""

OVERLAP = 12.0
"""Seconds that two neighbours share: two thirds before the edge between them, which the later one needs to find onto
the way of who comes from further back, and one third behind it."""

RUN_IN = 2.0 / 3.0
"""Share of the overlap that lies before the edge."""

_SHORTEST = 0.25
"""Share of a window below which the last or the first one goes to its neighbour."""

_BEYOND = 0.5
"""Seconds of the ball's course that are kept beyond both ends."""

_SAME = 1e-9


@dataclass(frozen=True, eq=False, kw_only=True)
class Unit:
    """One player's window of work, with all that is needed to search it.

    player: his id. stretch: which of his stretches on the pitch. number: of the window within the stretch. start, end:
    s on the match's clock of the part that is its own. plan: his order of that and of the overlaps around it, as
    `kept`. first: frame of the plan's first time, at the library's rate from the stretch's first time on. own: (first,
    end) frames of its own part, counted in the same way."""

    player: str
    number: int
    start: float
    end: float
    plan: Plan
    stretch: int = 0
    first: int = 0
    own: tuple[int, int] = (0, 0)


def units_of(plan: Plan, stretch: int = 0, window: float = WINDOW, overlap: float = OVERLAP) -> tuple[Unit, ...]:
    """The windows of one stretch of a player: `plan`, whose track's name is his id.

    window: seconds; their edges are at multiples of it on the match's clock, to the nearest slot. overlap: seconds that
    two neighbours share. Key moments are moved to the touches they mean before the plan is cut. InputError
    for a window or an overlap that leaves no sense."""
    if not 5.0 <= window <= 3600.0:
        raise InputError("--window", f"{window:g} s", "5 to 3600 s")
    if not 1.0 <= overlap <= window / 2.0:
        raise InputError("--overlap", f"{overlap:g} s", f"1 s to half of the window, {window / 2.0:g} s")
    plan = kept(plan)
    begin, count = float(plan.track.times[0]), frame_count(plan)
    edges = window_edges(begin, count, window)
    before, behind = (SLOT * max(1, round(share * overlap * FPS / SLOT)) for share in (RUN_IN, 1.0 - RUN_IN))
    units = []
    for number, (low, high) in enumerate(zip(edges, edges[1:])):
        first, end = max(0, low - before), min(count, high + behind)
        part = cut_plan(plan, begin + first / FPS, begin + (end - 1) / FPS)
        start, until = begin + low / FPS, begin + high / FPS
        units.append(Unit(player=plan.track.name, number=number, start=start, end=until, plan=part, stretch=stretch,
                          first=first, own=(low, high)))
    return tuple(units)


def frame_count(plan: Plan, fps: float = FPS) -> int:
    """Frames of the plan's track at `fps`, as `motion.track.sample` counts them."""
    return int(np.floor((plan.track.times[-1] - plan.track.times[0]) * fps + 1e-6)) + 1


def window_edges(begin: float, count: int, window: float, fps: float = FPS, step: int = SLOT) -> list[int]:
    """Frames, at `fps`, between which the windows of a stretch lie, which begins at `begin` s and has `count` frames:
    0, the multiples of `step` frames nearest to multiples of `window` s on the match's clock, and count. A first or
    last window that would be short goes to its neighbour. With a step of 1 a part of a stretch has the same ones."""
    end = begin + count / fps
    numbers = range(int(np.floor(begin / window)) + 1, int(np.ceil(end / window)))
    inner = [step * round((number * window - begin) * fps / step) for number in numbers]
    least = _SHORTEST * window * fps
    return [0, *(edge for edge in inner if least <= edge <= count - least), count]


def cut_plan(plan: Plan, start: float, end: float) -> Plan:
    """The plan from `start` to `end` seconds, both within its track.

    The track's first sample is at `start` and its last at `end`; where the feed has none then, it lies on the line
    between its neighbours. Key moments and pins outside are left out; spans are kept whole where they reach into it."""
    inside = [key for key in plan.timeline.keys if start <= key.in_force <= end]
    spans = [span for span in plan.timeline.spans if span.start < end and span.end > start]
    return replace(
        plan,
        track=cut_track(plan.track, start, end),
        timeline=Timeline(tuple(spans), tuple(inside)),
        pins=tuple(pin for pin in plan.pins if pin.time <= end and pin.end >= start),
        solved=None if plan.solved is None else _cut_course(plan.solved, start - _BEYOND, end + _BEYOND),
    )


def cut_track(track: Track, start: float, end: float) -> Track:
    """The samples from `start` to `end` seconds, with one at each of them."""
    inside = track.times[(track.times > start + _SAME) & (track.times < end - _SAME)]
    times = np.concatenate([[start], inside, [end]])
    before = np.clip(np.searchsorted(track.times, times + _SAME, side="right") - 1, 0, len(track) - 1)
    after = np.clip(np.searchsorted(track.times, times - _SAME), 0, len(track) - 1)
    return Track(
        times,
        _between(track.times, track.positions, times, before, after),
        _between(track.times, track.ball, times, before, after),
        ball_height_known=track.ball_height_known[before] & track.ball_height_known[after],
        filled=track.filled[before] | track.filled[after],
        outlier=track.outlier[before] | track.outlier[after],
        name=track.name,
    )


def _between(known: np.ndarray, values: np.ndarray, times: np.ndarray, before: np.ndarray, after: np.ndarray):
    """(K, n): values (N, n) at known times (N,) on the line between the samples `before` (K,) and `after` (K,); the
    very values where there is a sample."""
    step = known[after] - known[before]
    share = np.where(step > 0.0, (times - known[before]) / np.where(step > 0.0, step, 1.0), 0.0)[:, None]
    return np.where(share == 0.0, values[before], values[before] * (1.0 - share) + values[after] * share)


def _cut_course(course: SolvedCourse, start: float, end: float) -> SolvedCourse:
    low = max(int(np.searchsorted(course.times, start)) - 1, 0)
    part = slice(low, int(np.searchsorted(course.times, end)) + 1)
    touches = tuple(touch for touch in course.touches if start <= touch.time <= end)
    return SolvedCourse(course.times[part], course.ball[part], course.filled[part], touches)
