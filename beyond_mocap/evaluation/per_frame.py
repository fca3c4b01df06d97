"""A take's figures frame by frame and its footprints, for overlays and curves.

They are the report's figures; `movement` defines them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..annotation.ball_contact import build_surfaces
from ..annotation.striking import find_nearest_point, trace_fastest_surface
from ..synthesis.quality import movement
from ..synthesis.quality.moments import KeyMomentResult, find_written_ball, measure_contact
from .view import View


@dataclass(frozen=True, eq=False, kw_only=True)
class PerFrame:
    """Figures of T output frames, NaN where unknown.

    Attributes:
        times: (T,) seconds on the track's clock.
        track: (T, 2) m, the measured track.
        root_error, pelvis_error: (T,) m.
        slide: (T, 2) m/s, ground speed of each foot (left, right) while it is in contact.
        correction: (T, 2) m by which foot correction moved each foot.
        jerk: (T,) largest jerk within +-8 frames, divided by the 95th percentile of recordings at that speed.
        speed, requested_speed: (T,) m/s of the body and of the track, smoothed with a 1 s window.
    """

    times: np.ndarray
    track: np.ndarray
    root_error: np.ndarray
    pelvis_error: np.ndarray
    slide: np.ndarray
    correction: np.ndarray
    jerk: np.ndarray
    speed: np.ndarray
    requested_speed: np.ndarray

    @property
    def speed_gap(self) -> np.ndarray:
        """(T,) m/s by which the body is faster than the track."""
        return self.speed - self.requested_speed


@dataclass(frozen=True, kw_only=True)
class Footprint:
    """One stance.

    Attributes:
        side: 0 left, 1 right.
        start, end: its first and last second on the track's clock.
        heel, toe: mean positions (2,) m of the foot's joints on the ground; equal if the foot has no toe joint.
        direction: radians of the foot, from +x.
        slide: metres that its toe travelled (`movement.measure_stance_travel`).
    """

    side: int
    start: float
    end: float
    heel: tuple[float, float]
    toe: tuple[float, float]
    direction: float
    slide: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Strike:
    """One key moment in space.

    Attributes:
        time: seconds on the track's clock.
        words: the requested labels.
        part: (3,) m, the point of the striking surface nearest to the ball's centre; without a ball the pelvis.
        ball: (3,) m, the ball's centre, or None.
        gap: metres between both surfaces, NaN without a ball.
    """

    time: float
    words: tuple[str, ...]
    part: np.ndarray
    ball: np.ndarray | None
    gap: float


def measure_per_frame(view: View) -> PerFrame:
    """Measure every frame of a take.

    Args:
        view: the take beside its library and track.
    Returns:
        The figures.
    """
    played, count = view.played, view.count
    unknown = np.full(count, np.nan)
    wanted = np.full((count, 2), np.nan) if view.target is None else view.target
    known = view.target is not None
    slides = np.full((count, 2), np.nan)
    slides[1:] = movement.measure_contact_speeds(played.feet, played.contacts, view.fps)
    corrected = np.full((count, 2), np.nan) if played.correction is None else np.asarray(played.correction, float)
    jerk = unknown.copy()
    if view.reference is not None and count > movement.TRANSITION_TO_JERK + 1:
        values = view.jerk
        jerk[movement.TRANSITION_TO_JERK :][: len(values)] = movement.compute_jerk_ratios(values, view.speed,
                view.reference.jerk_p95)
    return PerFrame(
        times=played.times, track=wanted, slide=slides, correction=corrected, jerk=jerk, speed=view.speed,
        root_error=view.root_error if known else unknown,
        pelvis_error=view.pelvis_error if known else unknown,
        requested_speed=movement.measure_travel_speed(wanted, view.fps) if known else unknown,
    )  # fmt: skip


def find_footprints(view: View) -> tuple[Footprint, ...]:
    """Find every stance.

    Args:
        view: the take beside its library and track.
    Returns:
        The footprints, ordered by time.
    """
    played = view.played
    spans = movement.list_stances(played.contacts)
    travel = movement.measure_stance_travel(played.feet[:, :, 1], spans)
    prints = [_build_footprint(view, span, slide) for span, slide in zip(spans.tolist(), travel.tolist())]
    return tuple(sorted(prints, key=lambda print_: (print_.start, print_.side)))


def _build_footprint(view: View, span: Sequence[int], slide: float) -> Footprint:
    played, (first, end, side) = view.played, span
    heel, toe = played.feet[first:end, side, :, :2].mean(axis=0)
    along = toe - heel
    if np.hypot(*along) < 1e-3:  # no toe joint: the foot points in the body's direction of travel
        along = played.pelvis[min(end, view.count - 1)] - played.pelvis[max(first - 1, 0)]
    direction = float(np.arctan2(along[1], along[0]))
    return Footprint(side=side, start=float(played.times[first]), end=float(played.times[end - 1]),
                     heel=tuple(heel.tolist()), toe=tuple(toe.tolist()), direction=direction, slide=slide)  # fmt: skip


def find_strikes(view: View) -> tuple[Strike, ...]:
    """Find every key moment in space.

    Args:
        view: the take beside its library and track.
    Returns:
        The strikes, in the order of the timeline.
    """
    return tuple(_find_strike(view, moment) for moment in view.moments)


def _find_strike(view: View, moment: KeyMomentResult) -> Strike:
    """Find the nearest points of body and ball at one key moment."""
    played, words = view.played, moment.contact_labels
    contact_time, gap = measure_contact(played, moment)
    surfaces = build_surfaces(played.motion.skeleton, words)
    if not np.isfinite(gap) or not surfaces:
        part = played.positions[moment.frame, played.body.hips]
        if surfaces:
            part = trace_fastest_surface(surfaces, *_list_recent_poses(view, moment.frame))[-1]
        return Strike(time=moment.requested.resolved_time, words=moment.requested.words, part=part, ball=None,
                      gap=np.nan)
    frame = int(np.clip(round((contact_time - played.start_time) * view.fps), 0, view.count - 1))
    ball = find_written_ball(played, frame)
    lines = [surface.compute_line(played.positions[frame], played.rotations[frame]) for surface in surfaces]
    points = [_find_surface_point(find_nearest_point(line, ball), ball, surface.radius) for line,
              surface in zip(lines, surfaces)]
    part = min(points, key=lambda point: float(np.linalg.norm(point - ball)))
    return Strike(time=contact_time, words=moment.requested.words, part=part, ball=ball, gap=gap)


def _find_surface_point(inside: np.ndarray, ball: np.ndarray, radius: float) -> np.ndarray:
    """Find the point (3,) m of a surface towards the ball (3,), `radius` m away from the point `inside` (3,) on its
    line."""
    away = ball - inside
    return inside + away * min(1.0, radius / max(float(np.linalg.norm(away)), 1e-9))


def _list_recent_poses(view: View, frame: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the joints' positions and rotations of the last frames up to `frame`."""
    frames = slice(max(frame - 3, 0), frame + 1)
    return view.played.positions[frames], view.played.rotations[frames]
