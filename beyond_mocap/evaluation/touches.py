"""How a body touches the ball: feet at receptions and kicks, and swings like a kick's.

The figures are those of docs/reference/report-figures.md, *At the ball*.

The same code measures takes and recordings, both at 30 frames per second. The heading is that of the line through hips
and shoulders; speeds and lengths of the body are brought to a leg of 0.86 m. Speeds are differences over two frames.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from ..annotation.ball_contact import SENDING, TAKING, find_striking_part
from ..annotation.vocabulary import SIDES
from ..base.time_series import find_runs, time_derivative
from ..library.posture import LEG_LENGTH
from ..motion.humanoid import identify_joints, measure_leg_length
from ..motion.plant_place import PLANT_AHEAD, PLANT_BESIDE
from ..motion.skeleton import Skeleton
from .naturalness import FPS, BodyCourse, resample_positions

RECEPTION_SECONDS = 0.13  # s to either side of a reception in which its foot is measured
STRIKE_SPEED = 6.0  # m/s of an ankle relative to the pelvis, least of a strike
STRIKE_FACTOR, STRIKE_MARGIN = 1.3, 4.0
"""A strike is faster than STRIKE_FACTOR times the body's speed plus STRIKE_MARGIN m/s.

A runner's leg swings forward at up to 1.3 times their speed. So measured all 24 recorded kicks of lmd's Player1 and
cmu10 are strikes, and none of 276 other swings forward by more than 4 m/s of lmd, lafan1, runs15, cmu10 and a sprinter.
"""
_STRIKE_APART = 0.2  # s between two strikes of a foot
_RUN_UP_SECONDS = 0.5  # s before a kick over which its run-up is measured
_STEP_SECONDS = 2.0  # s before a kick in which its last three landings lie
_LIFTED_SECONDS = 0.1  # s before a kick up to which its plant foot may have left the ground
_STRIDE_LEAST = 0.05  # m of the stride before the last; shorter ones are steps on the spot

_RECEPTIONS = frozenset(("receive", "trap"))  # a foot that blocks takes the ball too, but does not give with it
_BODY_PARTS = ("thigh", "chest", "head")


@dataclass(frozen=True, eq=False)
class LegCourse:
    """Where pelvis and feet are, T frames at 30 per second.

    Attributes:
        pelvis: (T, 3) m.
        ankles: (T, 2, 3) m, left and right.
        toes: (T, 2, 3) m.
        heading: (T,) rad.
        speed: (T,) m/s of the pelvis.
        planted: (T, 2) bool.
        scale: factor by which lengths were brought to a leg of 0.86 m.
    """

    pelvis: np.ndarray
    ankles: np.ndarray
    toes: np.ndarray
    heading: np.ndarray
    speed: np.ndarray
    planted: np.ndarray
    scale: float

    @cached_property
    def relative_velocity(self) -> np.ndarray:
        """(T, 2, 3) m/s of the ankles relative to the pelvis."""
        return time_derivative(self.ankles - self.pelvis[:, None], FPS)

    @cached_property
    def relative_speed(self) -> np.ndarray:
        """(T, 2) m/s, size of `relative_velocity`."""
        return np.linalg.norm(self.relative_velocity, axis=-1)

    @cached_property
    def toe_speed(self) -> np.ndarray:
        """(T, 2) m/s of the toes over the ground, of the body as it is."""
        return np.linalg.norm(time_derivative(self.toes, FPS), axis=-1) / self.scale

    @cached_property
    def stances(self) -> tuple[list[tuple[int, int]], ...]:
        """(first frame, end) of each foot's stances."""
        return tuple(find_runs(self.planted[:, side]) for side in (0, 1))

    @cached_property
    def ahead(self) -> np.ndarray:
        """(T, 2) unit vectors in which the body faces."""
        return np.stack([np.cos(self.heading), np.sin(self.heading)], axis=-1)


@dataclass(frozen=True, kw_only=True)
class Kick:
    """One kick, NaN where something is not known.

    Attributes:
        ankle_speed: m/s of the kicking ankle relative to the pelvis at the moment of the kick.
        foot_speed: m/s of the kicking foot's toe joint over the ground then, of the body as it is.
        plant_beside: m by which the plant foot's ankle is beside the kicking one, towards its own side.
        plant_ahead: m by which it is ahead, along the heading.
        stride_ratio: length of the last stride, onto the plant foot, over that of the one before.
        run_up: m/s of the pelvis, mean of the last half second.
        ball_speed: m/s of the ball just after it.
    """

    ankle_speed: float
    foot_speed: float
    plant_beside: float
    plant_ahead: float
    stride_ratio: float
    run_up: float
    ball_speed: float = math.nan


def is_foot_reception(words: Iterable[str]) -> bool:
    """Return whether labels ask for a ball that a foot receives."""
    words = set(words)
    return bool(_RECEPTIONS & words) and find_striking_part(words) == "foot"


def is_body_reception(words: Iterable[str]) -> bool:
    """Return whether labels ask for a ball that thigh, chest or head take."""
    words = set(words)
    return bool(TAKING & words) and find_striking_part(words) in _BODY_PARTS


def is_kick(words: Iterable[str]) -> bool:
    """Return whether labels ask for a ball that a foot sends."""
    words = set(words)
    return bool(SENDING & words) and find_striking_part(words) == "foot"


def find_side(words: Iterable[str]) -> int | None:
    """Find the side that labels name: 0 left, 1 right, None for neither or both."""
    named = [number for number, side in enumerate(SIDES) if side in words]
    return named[0] if len(named) == 1 else None


def measure_legs(skeleton: Skeleton, positions: np.ndarray, fps: float, planted: np.ndarray,
                 course: BodyCourse) -> LegCourse:
    """Measure where pelvis and feet are.

    Args:
        skeleton: J joints.
        positions: (N, J, 3) m, world.
        fps: frames per second of the positions.
        planted: (N, 2) bool, left and right foot on the ground.
        course: of the same positions.
    """
    body, scale = identify_joints(skeleton), LEG_LENGTH / measure_leg_length(skeleton)
    joints = [body.hips, body.left.foot, body.right.foot, body.left.toe_or_foot, body.right.toe_or_foot]
    places = scale * resample_positions(positions[:, joints], fps)
    rows = np.minimum(np.rint(np.arange(len(places)) * fps / FPS).astype(int), len(planted) - 1)
    return LegCourse(pelvis=places[:, 0], ankles=places[:, 1:3], toes=places[:, 3:5], heading=course.heading,
                     speed=course.speed, planted=planted[rows], scale=scale)


def measure_reception(legs: LegCourse, second: float, side: int | None) -> float:
    """Measure the largest speed of an ankle relative to the pelvis about a reception.

    Args:
        legs: the body.
        second: s from its first frame.
        side: of the foot, 0 left, 1 right; None takes the faster one.
    Returns:
        m/s, NaN beyond the body's ends.
    """
    return _find_fastest(legs.relative_velocity[:, [0, 1] if side is None else [side]], second)


def measure_body_reception(skeleton: Skeleton, positions: np.ndarray, fps: float, part: str, second: float) -> float:
    """Measure the largest speed of a knee, the chest or the head relative to the pelvis about a reception.

    Args:
        skeleton: J joints.
        positions: (N, J, 3) m, world.
        fps: frames per second of the positions.
        part: "thigh" (the faster knee), "chest" or "head".
        second: s from the first frame.
    Returns:
        m/s, NaN beyond the ends.
    """
    body = identify_joints(skeleton)
    joints = {"thigh": [body.left.lower_leg, body.right.lower_leg], "chest": [body.chest],
              "head": [body.head_or_neck]}[part]  # fmt: skip
    away = resample_positions(positions[:, joints] - positions[:, [body.hips]], fps)
    return _find_fastest(time_derivative(away * (LEG_LENGTH / measure_leg_length(skeleton)), FPS), second)


def _find_fastest(velocities: np.ndarray, second: float) -> float:
    """Find the largest speed of velocities (T, P, 3) m/s within RECEPTION_SECONDS of a second; NaN beyond them."""
    reach = RECEPTION_SECONDS * FPS
    first, last = math.ceil(second * FPS - reach - 1e-6), math.floor(second * FPS + reach + 1e-6)
    speeds = np.linalg.norm(velocities[max(first, 0) : last + 1], axis=-1)
    return float(speeds.max()) if speeds.size else math.nan


def measure_kick(legs: LegCourse, second: float, side: int | None, ball_speed: float = math.nan) -> Kick:
    """Measure a kick.

    Args:
        legs: the body.
        second: s from its first frame.
        side: of the kicking foot, 0 left, 1 right; None takes the faster one.
        ball_speed: m/s just after it.
    """
    speeds = legs.relative_speed
    frame = int(np.clip(np.rint(second * FPS), 0, len(speeds) - 1))
    side = int(np.argmax(speeds[frame])) if side is None else side
    times = np.arange(len(speeds)) / FPS
    beside, ahead = _measure_plant(legs, frame, side)
    run_up = legs.speed[max(frame - int(_RUN_UP_SECONDS * FPS), 0) : frame + 1]
    return Kick(ankle_speed=float(np.interp(second, times, speeds[:, side])),
                foot_speed=float(np.interp(second, times, legs.toe_speed[:, side])), plant_beside=beside,
                plant_ahead=ahead, stride_ratio=_measure_stride_ratio(legs, frame, side), run_up=float(run_up.mean()),
                ball_speed=ball_speed)  # fmt: skip


def _measure_plant(legs: LegCourse, frame: int, side: int) -> tuple[float, float]:
    """Measure how far (m) the plant foot is beside the kicking ankle, towards its own side, and ahead of it."""
    away = (legs.ankles[frame, 1 - side] - legs.ankles[frame, side])[:2]
    ahead = legs.ahead[frame]
    left = np.array([-ahead[1], ahead[0]])
    return float(away @ left) * (1.0 if side else -1.0), float(away @ ahead)


def _measure_stride_ratio(legs: LegCourse, frame: int, side: int) -> float:
    """Measure the length of the last stride over that of the one before; NaN without three landings before a kick."""
    plant = _find_stance(legs, 1 - side, frame + 1)
    if plant is None or plant[1] < frame - _LIFTED_SECONDS * FPS:
        return math.nan
    push = _find_stance(legs, side, plant[0])
    first = None if push is None else _find_stance(legs, 1 - side, push[0])
    if push is None or first is None or first[1] < frame - _STEP_SECONDS * FPS:
        return math.nan
    feet = [legs.ankles[slice(*stance), foot, :2].mean(axis=0)
            for stance, foot in ((first, 1 - side), (push, side), (plant, 1 - side))]
    before, last = (float(np.linalg.norm(b - a)) for a, b in zip(feet, feet[1:]))
    return last / before if before > _STRIDE_LEAST else math.nan


def _find_stance(legs: LegCourse, side: int, before: int) -> tuple[int, int] | None:
    """Find the last stance (first frame, end) of a foot that begins before a frame."""
    count = bisect_left(legs.stances[side], (before, 0))
    return legs.stances[side][count - 1] if count else None


def find_strikes(legs: LegCourse) -> list[tuple[float, int]]:
    """Find where a foot swings like a kick: second from the first frame and side of each, in order.

    The ankle whips forward at its fastest, faster than STRIKE_SPEED relative to the pelvis and than a runner's at that
    speed.
    """
    speeds, forward = legs.relative_speed, np.einsum("tsk,tk->ts", legs.relative_velocity[..., :2], legs.ahead)
    least = np.maximum(STRIKE_SPEED, STRIKE_FACTOR * legs.speed + STRIKE_MARGIN)[:, None]
    is_strike = (speeds > least) & (forward > 0.0)
    found = [(frame / FPS, side) for side in (0, 1) for frame in _list_peaks(speeds[:, side], is_strike[:, side])]
    return sorted(found)


def _list_peaks(values: np.ndarray, flags: np.ndarray) -> list[int]:
    """List the frame of the largest value of each stretch of flags; stretches close together are one."""
    peaks: list[int] = []
    for first, end in find_runs(flags):
        peak = first + int(np.argmax(values[first:end]))
        if peaks and peak - peaks[-1] < _STRIKE_APART * FPS:
            peaks[-1] = max(peaks[-1], peak, key=lambda frame: values[frame])
        else:
            peaks.append(peak)
    return peaks


def summarize_receptions(speeds: Sequence[float]) -> dict:
    """Summarize receptions by the speed (m/s) of their feet or other parts."""
    known = np.array([speed for speed in speeds if math.isfinite(speed)])
    return {"receptions": len(known), "speed_m_s_median": float(np.median(known)) if len(known) else math.nan,
            "speed_m_s_max": float(known.max()) if len(known) else math.nan,
            "strike_count": int(np.sum(known > STRIKE_SPEED))}


def summarize_kicks(kicks: Sequence[Kick]) -> dict:
    """Summarize kicks: medians, and the share whose plant foot is where that of recorded kicks is."""
    columns = {field.name: np.array([getattr(kick, field.name) for kick in kicks]) for field in fields(Kick)}
    beside, ahead = columns["plant_beside"], columns["plant_ahead"]
    is_beside = (beside >= PLANT_BESIDE[0]) & (beside <= PLANT_BESIDE[1])
    is_planted = is_beside & (ahead >= PLANT_AHEAD[0]) & (ahead <= PLANT_AHEAD[1])
    return {
        "kicks": len(kicks), "ankle_speed_m_s_median": _median(columns["ankle_speed"]),
        "plant_beside_m_median": _median(beside), "plant_ahead_m_median": _median(ahead),
        "plant_in_range_share": float(is_planted.mean()) if len(kicks) else math.nan,
        "stride_ratio_median": _median(columns["stride_ratio"]), "run_up_m_s_median": _median(columns["run_up"]),
    }


def _median(values: np.ndarray) -> float:
    """Compute the median of the finite values."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else math.nan
