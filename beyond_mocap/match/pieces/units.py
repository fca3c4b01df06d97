"""Cut a player's plan into windows of work, each of which any process can search by itself.

Windows are on a fixed grid of the match's clock, so that the same second is in the same window for every player. They
overlap, so that neighbours can be joined where both have found the same (`windows`). They start and end with whole
slots of the search, counted from the stretch's first frame: in the overlap both have the same candidate frames.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...annotation import Timeline
from ...base.errors import InputError
from ...base.settings.match import OVERLAP, WINDOW
from ...library.features import FPS
from ...motion.track import Track
from ...synthesis.exertion import measure_exertion
from ...synthesis.heading_plan import HOLD_FADE
from ...synthesis.known_body import cut_bodies
from ...synthesis.plan import Plan, SolvedTrajectory
from ...synthesis.search.candidate_index import SLOT
from ..player_edit import to_stored_plan

OVERLAP_BEFORE = 2.0 / 3.0
"""Share of the overlap before the edge."""

_MIN_WINDOW_SHARE = 0.25
"""A first or last window shorter than this share is merged with its neighbour."""

_BALL_MARGIN = 0.5
"""s of the ball's trajectory that are kept beyond both ends."""

_SAME = 1e-9


@dataclass(frozen=True, eq=False, kw_only=True)
class Unit:
    """One player's window of work, with everything needed to search it.

    Attributes:
        player: id.
        number: index of the window within the stretch.
        start: s on the match's clock, of its own part.
        end: s on the match's clock, of its own part.
        plan: of its own part and the overlaps around it, as stored in files.
        stretch: index of the player's stretch on the pitch.
        first: frame of the plan's first time, at the library's rate from the stretch's first time.
        own: (first, end) frames of its own part, counted in the same way.
    """

    player: str
    number: int
    start: float
    end: float
    plan: Plan
    stretch: int = 0
    first: int = 0
    own: tuple[int, int] = (0, 0)


def build_units(plan: Plan, stretch: int = 0, window: float = WINDOW, overlap: float = OVERLAP) -> tuple[Unit, ...]:
    """Build the windows of one stretch of a player. Key moments move to the touches they mean before the plan is cut.

    Args:
        plan: of the stretch; the name of its track is the player's id.
        stretch: index of the stretch.
        window: s; edges are at multiples of it on the match's clock, rounded to the nearest slot.
        overlap: s that two neighbours share.
    Returns:
        The windows in order.
    Raises:
        InputError: for a window or an overlap outside its limits.
    """
    if not 5.0 <= window <= 3600.0:
        raise InputError("window", f"{window:g} s", "5 to 3600 s")
    if not 1.0 <= overlap <= window / 2.0:
        raise InputError("overlap", f"{overlap:g} s", f"1 s to half of the window, {window / 2.0:g} s")
    plan = to_stored_plan(plan)
    begin, count = float(plan.track.times[0]), count_frames(plan)
    edges = build_window_edges(begin, count, window)
    before, behind = (SLOT * max(1, round(share * overlap * FPS / SLOT))
                      for share in (OVERLAP_BEFORE, 1.0 - OVERLAP_BEFORE))
    units = []
    for number, (low, high) in enumerate(zip(edges, edges[1:])):
        first, end = max(0, low - before), min(count, high + behind)
        part = cut_plan(plan, begin + first / FPS, begin + (end - 1) / FPS)
        start, until = begin + low / FPS, begin + high / FPS
        units.append(Unit(player=plan.track.name, number=number, start=start, end=until, plan=part, stretch=stretch,
                          first=first, own=(low, high)))
    return tuple(units)


def count_frames(plan: Plan, fps: float = FPS) -> int:
    """Count the frames of the plan's track at `fps`, as `motion.track.sample_track` does."""
    return int(np.floor((plan.track.times[-1] - plan.track.times[0]) * fps + 1e-6)) + 1


def build_window_edges(start: float, count: int, window: float, fps: float = FPS, step: int = SLOT) -> list[int]:
    """Build the frames between which the windows of a stretch lie.

    Args:
        start: s, the start of the stretch.
        count: its number of frames.
        window: s; edges are close to multiples of it on the match's clock.
        fps: frames per second.
        step: edges are multiples of so many frames; with 1, a part of a stretch has the same edges.
    Returns:
        0, the edges, and count. A short first or last window is merged with its neighbour.
    """
    end = start + count / fps
    numbers = range(int(np.floor(start / window)) + 1, int(np.ceil(end / window)))
    inner = [step * round((number * window - start) * fps / step) for number in numbers]
    least = _MIN_WINDOW_SHARE * window * fps
    return [0, *(edge for edge in inner if least <= edge <= count - least), count]


def cut_plan(plan: Plan, start: float, end: float) -> Plan:
    """Cut a plan to a span within its track.

    The track's first sample is at `start` and its last at `end`, interpolated where the feed has none. Key moments,
    pins, contact edits and headings outside are left out, but for headings that fade in or out inside; spans that reach
    into the time stay whole.

    Args:
        plan: the plan.
        start: s.
        end: s.
    Returns:
        The cut plan.
    """
    inside = [key for key in plan.timeline.keys if start <= key.resolved_time <= end]
    spans = [span for span in plan.timeline.spans if span.start < end and span.end > start]
    return replace(
        plan,
        track=cut_track(plan.track, start, end),
        timeline=Timeline(tuple(spans), tuple(inside)),
        exertion=measure_exertion(plan.track, start, plan.exertion) if plan.fatigue else plan.exertion,
        pins=tuple(pin for pin in plan.pins if pin.time <= end and pin.end >= start),
        contact_edits=tuple(edit for edit in plan.contact_edits if start <= edit.time <= end),
        heading_keys=tuple(key for key in plan.heading_keys if key.is_within(start - HOLD_FADE, end + HOLD_FADE)),
        heading_path=None if plan.heading_path is None else plan.heading_path.cut_span(start - HOLD_FADE,
                                                                                       end + HOLD_FADE),
        bodies=cut_bodies(plan.bodies, start, end),
        solved=None if plan.solved is None else _cut_trajectory(plan.solved, start - _BALL_MARGIN, end + _BALL_MARGIN),
    )


def cut_track(track: Track, start: float, end: float) -> Track:
    """Cut a track to the samples from `start` to `end` s, with one sample at each of both."""
    inside = track.times[(track.times > start + _SAME) & (track.times < end - _SAME)]
    times = np.concatenate([[start], inside, [end]])
    before = np.clip(np.searchsorted(track.times, times + _SAME, side="right") - 1, 0, len(track) - 1)
    after = np.clip(np.searchsorted(track.times, times - _SAME), 0, len(track) - 1)
    return Track(
        times,
        _interpolate_samples(track.times, track.positions, times, before, after),
        _interpolate_samples(track.times, track.ball, times, before, after),
        ball_height_known=track.ball_height_known[before] & track.ball_height_known[after],
        filled=track.filled[before] | track.filled[after],
        outlier=track.outlier[before] | track.outlier[after],
        name=track.name,
    )


def _interpolate_samples(known: np.ndarray, values: np.ndarray, times: np.ndarray, before: np.ndarray,
                         after: np.ndarray):
    """Interpolate (K, n) values between the samples `before` (K,) and `after` (K,); exact values at samples.

    known: (N,) s; values: (N, n).
    """
    step = known[after] - known[before]
    share = np.where(step > 0.0, (times - known[before]) / np.where(step > 0.0, step, 1.0), 0.0)[:, None]
    return np.where(share == 0.0, values[before], values[before] * (1.0 - share) + values[after] * share)


def _cut_trajectory(course: SolvedTrajectory, start: float, end: float) -> SolvedTrajectory:
    low = max(int(np.searchsorted(course.times, start)) - 1, 0)
    part = slice(low, int(np.searchsorted(course.times, end)) + 1)
    touches = tuple(touch for touch in course.touches if start <= touch.time <= end)
    return SolvedTrajectory(course.times[part], course.ball[part], course.filled[part], touches)
