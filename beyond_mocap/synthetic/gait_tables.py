"""Published figures of walking and running, from standing to 9.5 m/s, for an adult with a leg of 0.87 m.

Leg: thigh plus shank. Sources, by the letters used below; where authors differ or a speed lies between theirs, the
value is a smooth line through them. Checked against recordings: cadence, bounce, thigh and knee angles over the cycle.
  G  Grieve and Gear 1966, Ergonomics 9: relation of cadence and stride length to walking speed
  W  Winter 1991, "The biomechanics and motor control of human gait": joint angles over the cycle, natural cadence
  M  Murray, Drought and Kory 1964, J Bone Joint Surg 46-A; Murray 1967: sway, pelvis, arms, foot angles of walking men
  N  Nilsson and Thorstensson 1987, Acta Physiol Scand 129; Nilsson, Thorstensson and Halbertsma 1985, ibid 123:
     support and swing phases, leg movements from 1 to 9 m/s
  V  Novacheck 1998, Gait and Posture 7: "The biomechanics of running" (joint angles of walking, running, sprinting)
  D  Dorn, Schache and Pandy 2012, J Exp Biol 215: stride length and frequency, contact times from 3.5 to 9 m/s
  Y  Weyand, Sternlight, Bellizzi and Wright 2000, J Appl Physiol 89: contact, aerial and swing times up to top speed
  H  Hinrichs 1987, Int J Sport Biomech 3: the arms in running
  T  Thorstensson 1986, Exp Brain Res 61: backward walking is forward walking run backwards
  L  Morin, Dalleau, Kyrolainen, Jeannin and Belli 2005, J Appl Biomech 21: sine-wave model of the ground reaction
  R  a recorded sprinter at 3.5 and 9.4 m/s, by phase of the stride: legs, trunk and arms

Angles in degrees here, radians outside. Speeds in m/s.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from ..base.easing import quintic_step
from ..motion.retargeting import adult
from ..motion.supports import GRAVITY

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline, PchipInterpolator

LEG = adult.ADULT_LEG
FASTEST = 9.5  # m/s, the tables' last speed
# m/s between which walking changes into running (N: spontaneous change at 1.9 to 2.3 m/s)
_WALK_TO_RUN = (1.95, 2.35)

_SPEEDS: dict[str, list[tuple[float, float]]] = {
    # strides per second: G below 2 (cadence grows as the root of speed), N and D above
    "frequency": [
        (0, 0.55), (0.3, 0.58), (0.7, 0.72), (1.0, 0.83), (1.4, 0.96), (1.8, 1.08), (2.1, 1.22), (2.5, 1.30),
        (3.5, 1.38), (5.2, 1.53), (7.0, 1.76), (8.0, 1.96), (9.0, 2.17), (9.5, 2.28),
    ],
    # share of the stride that a foot is on the ground: N, W below the change; contact times of D, Y times frequency
    # above
    "duty": [
        (0, 0.78), (0.4, 0.72), (0.8, 0.665), (1.4, 0.62), (1.9, 0.585), (2.15, 0.47), (2.5, 0.37), (3.0, 0.32),
        (3.5, 0.288), (4.2, 0.262), (5.2, 0.242), (7.0, 0.23), (8.0, 0.226), (9.0, 0.222), (9.5, 0.222),
    ],
    # knee flexion in the middle of stance: W, V, N
    "knee_mid": [
        (0, 5), (0.5, 7), (1.4, 12), (1.9, 18), (2.3, 38), (2.8, 47), (3.5, 52), (5.2, 54), (7, 56), (9, 59), (9.5, 59),
    ],
    # forward lean of the trunk (pelvis and spine together): V, and sprinters on video
    "lean": [(0, 0), (1.4, 5.5), (2.3, 8), (3.5, 10), (5.2, 10.5), (7, 10), (9.5, 10)],
    # anterior tilt of the pelvis, part of that lean: V
    "tilt": [(0, 0), (1.4, 2), (2.3, 5), (3.5, 7), (5.2, 9), (7, 10), (9.5, 11)],
    # turn of the pelvis about the vertical to either side: M (4 to 5), V and N above
    "pelvis_turn": [(0, 0), (0.5, 2), (1.4, 5), (2.0, 6), (2.5, 4.5), (3.5, 4.5), (5.2, 5.5), (7, 6.5), (9.5, 7.5)],
    # turn of the shoulders against it
    "chest_turn": [(0, 0), (0.5, 2), (1.4, 4), (2.0, 5), (2.5, 6), (3.5, 6.5), (5.2, 8), (7, 9), (9.5, 10)],
    # list: the swing side's hip drops: M 4 to 5 each way, V 5 to 6
    "list": [(0, 0), (0.5, 1.5), (1.4, 3.6), (2.0, 4), (3.5, 4.5), (5.2, 5), (9.5, 5)],
    # sideways sway of the pelvis to either side, metres: M
    "sway": [(0, 0), (0.4, 0.030), (1.4, 0.019), (2.0, 0.014), (2.5, 0.008), (9.5, 0.004)],
    # vertical travel of the pelvis up and down from its middle, metres, walking only (running: L)
    "bob": [(0, 0), (0.5, 0.005), (1.0, 0.012), (1.4, 0.019), (1.9, 0.025), (2.3, 0.028), (9.5, 0.028)],
    # distance between the feet's lines, metres: M (8 cm between heels), less in running
    "width": [
        (0, 0.20), (0.3, 0.16), (0.8, 0.12), (1.4, 0.095), (2.0, 0.085), (2.5, 0.075), (3.5, 0.06), (5.2, 0.045),
        (9.5, 0.03),
    ],
    # outward turn of the feet: M (7), nearly straight in running
    "toe_out": [(0, 14), (0.4, 10), (1.4, 7), (2.5, 6), (3.5, 5), (9.5, 2)],
    # where the flat foot's ankle lies relative to the hips in the middle of stance, metres: from the angles of W, V, N
    "ahead": [
        (0, -0.02), (0.7, -0.08), (1.4, -0.135), (2.0, -0.16), (2.5, -0.165), (3.5, -0.18), (5.2, -0.17), (7, -0.155),
        (9.5, -0.145),
    ],
    # arms: swing of the upper arm (half range) and its middle, forward positive: M (walking), H (running)
    "arm_swing": [(0, 0), (0.5, 7), (1.4, 17), (2.0, 23), (2.5, 21), (3.5, 26), (5.2, 34), (7, 44), (9.5, 54)],
    "arm_middle": [(0, 1), (1.4, -3), (2.0, -3), (2.5, -9), (3.5, -12), (5.2, -11), (7, -10), (9.5, -8)],
    # elbow flexion, middle and half range: M (20 to 40 in walking), H
    "elbow": [(0, 14), (1.4, 23), (1.9, 33), (2.4, 76), (3.5, 90), (5.2, 94), (9.5, 86)],
    "elbow_swing": [(0, 0), (0.7, 4), (1.4, 9), (2.0, 12), (2.5, 8), (3.5, 11), (5.2, 18), (7, 27), (9.5, 36)],
    "abduct": [(0, 9), (1.4, 8.5), (2.5, 14), (3.5, 16), (9.5, 17)],
    "inward": [(0, 12), (1.4, 14), (2.0, 16), (2.5, 26), (3.5, 25), (7, 18), (9.5, 14)],
}


# a sprinter's figures, which replace those above from _SPRINT on; walking and jogging do not depend on them
_SPRINT_SPEEDS: dict[str, list[tuple[float, float]]] = {
    # contact times of D and Y times frequency: .20 s at 4.5, .16 at 6, .143 at 7, .125 at 8, .112 at 9 m/s
    "duty": [(4.1, 0.29), (4.5, 0.285), (5.2, 0.269), (6.0, 0.253), (7.0, 0.246), (8.0, 0.239), (9.5, 0.236)],
    # R: 43 and 41 at 3.5 and 9.4 m/s
    "knee_mid": [(4.1, 52), (5.2, 48), (7.0, 46), (9.5, 46)],
    "ahead": [(4.1, -0.175), (9.5, -0.175)],
    # forward lean of the line from hips to neck, and how far it nods either way in each step (V, R)
    "trunk": [(4.1, 8.0), (5.2, 6.0), (6.0, 4.0), (7.0, 3.0), (8.0, 3.0), (9.5, 4.0)],
    "nod": [(4.1, 2.2), (9.5, 3.3)],
    "arm_swing": [(4.1, 29), (5.2, 34), (7.0, 45), (9.5, 59)],
    "arm_middle": [(4.1, -13), (7.0, -15), (9.5, -13)],
    # second wave of the upper arm, twice a stride (R)
    "arm_second": [(4.1, 6), (9.5, 12)],
    "elbow": [(4.1, 86), (5.2, 81), (9.5, 78)],
    "elbow_swing": [(4.1, 24), (5.2, 34), (7.0, 38), (9.5, 39)],
}
# m/s of an adult between which a runner takes a sprinter's form; the trunk comes up more slowly, and the centre of mass
# flies from the lowest speed on that leaves walking and jogging as they are
_SPRINT, _UPRIGHT, _FLYING = (4.1, 5.2), (4.1, 6.5), (4.1, 4.5)
# degrees: farthest that elbows bend and stretch in a sprint
ELBOW_RANGE = (40.0, 135.0)


@lru_cache(maxsize=None)
def _build_curve(name: str) -> PchipInterpolator:
    from scipy.interpolate import PchipInterpolator

    x, y = zip(*_SPEEDS[name])
    return PchipInterpolator(x, y, extrapolate=False)


@lru_cache(maxsize=None)
def _build_sprint_curve(name: str) -> PchipInterpolator:
    from scipy.interpolate import PchipInterpolator

    x, y = zip(*_SPRINT_SPEEDS[name])
    return PchipInterpolator(x, y, extrapolate=False)


def compute_sprint_share(speed: float | np.ndarray) -> np.ndarray:
    """Compute how far a runner has taken a sprinter's form, 0 to 1, at `speed` (...,) m/s."""
    return _ease_between(speed, _SPRINT)


def compute_upright_share(speed: float | np.ndarray) -> np.ndarray:
    """Compute how far a sprinter's trunk has come up, 0 to 1, at `speed` (...,) m/s."""
    return _ease_between(speed, _UPRIGHT)


def compute_flight_share(speed: float | np.ndarray) -> np.ndarray:
    """Compute how far hips follow the centre of mass, 0 to 1, at `speed` (...,) m/s."""
    return _ease_between(speed, _FLYING)


def _ease_between(speed: float | np.ndarray, ends: tuple[float, float]) -> np.ndarray:
    return quintic_step((np.asarray(speed) - ends[0]) / (ends[1] - ends[0]))


def interpolate_figure(name: str, speed: float | np.ndarray) -> np.ndarray:
    """Interpolate a figure of the table.

    Args:
        name: name of the figure.
        speed: (...,) m/s, clamped to 0 .. 9.5.
    Returns:
        (...,) degrees, metres or Hz, as the table says.
    """
    value = _build_curve(name)(np.clip(speed, 0.0, FASTEST))
    if name not in _SPRINT_SPEEDS:
        return value
    return value + compute_sprint_share(speed) * (interpolate_sprint_figure(name, speed) - value)


def interpolate_sprint_figure(name: str, speed: float | np.ndarray) -> np.ndarray:
    """Interpolate a figure of sprinters at `speed` (...,) m/s, clamped to 4.1 .. 9.5, as `interpolate_figure`."""
    return _build_sprint_curve(name)(np.clip(speed, _SPRINT[0], FASTEST))


def compute_run_share(speed: np.ndarray) -> np.ndarray:
    """Compute how far running has replaced walking, 0 to 1, at `speed` (...,) m/s."""
    return quintic_step((np.asarray(speed) - _WALK_TO_RUN[0]) / (_WALK_TO_RUN[1] - _WALK_TO_RUN[0]))


# The swinging leg: thigh against the vertical (forward positive), knee flexion, ankle (dorsiflexion positive), in
# degrees, at shares of the swing. Thigh = hip flexion less pelvic tilt. Walking W at 60 .. 100 % of the cycle; running
# (3.2 m/s) and sprinting (9 m/s) V at 39 .. 100 and 22 .. 100 %, with N for the height of the heel; jogging between.
_SWING_AT = (0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0)
_SWING = {
    # speed: thigh, knee, ankle
    1.4: (
        (-14, -5, 7, 17, 23.5, 26, 25.5, 23, 20), (42, 58, 66, 62, 49, 31, 15, 5, 6), (-17, -12, -5, 0, 2, 2, 1, 0, 0),
    ),
    2.6: (
        (-20, -16, -7, 6, 19, 28, 31, 28, 23), (30, 50, 71, 84, 85, 73, 48, 22, 15), (-22, -17, -9, -2, 2, 4, 5, 5, 4),
    ),
    3.6: (
        (-24, -20, -9, 7, 25, 37, 41, 36, 28), (26, 50, 79, 101, 108, 98, 71, 42, 30),
        (-25, -20, -11, -4, 1, 4, 5, 5, 3),
    ),
    9.0: (
        (-30, -42, -35, -11, 23, 56, 68, 56, 42), (28, 30, 74, 117, 133, 113, 74, 40, 37),
        (-28, -23, -13, -5, 1, 4, 3, -2, -6),
    ),
}


# the same of a sprinter: heels rise to the seat while the thigh is still behind (R at 3.5 and 9.4 m/s, between them V)
_SPRINT_SWING = {
    5.2: (
        (-27, -39, -22, -3, 17, 32, 44, 39, 27), (3, 28, 68, 107, 125, 105, 74, 27, 23),
        (-26, -21, -12, -4, 1, 4, 4, 2, -1),
    ),
    7.0: (
        (-27, -45, -30, -8, 25, 37, 52, 46, 37), (9, 36, 86, 135, 143, 111, 80, 30, 40),
        (-27, -22, -12, -4, 1, 4, 4, 0, -3),
    ),
    9.4: (
        (-32, -49, -37, -13, 14, 42, 59, 51, 35), (9, 36, 76, 129, 143, 121, 86, 30, 30),
        (-28, -23, -13, -5, 1, 4, 3, -2, -6),
    ),
}


@lru_cache(maxsize=None)
def _build_swing_curves(sprints: bool) -> tuple[np.ndarray, CubicSpline]:
    from scipy.interpolate import CubicSpline

    rows = _SPRINT_SWING if sprints else _SWING
    table = np.array([rows[v] for v in sorted(rows)], dtype=float)
    return np.array(sorted(rows)), CubicSpline(_SWING_AT, table.transpose(2, 0, 1), axis=0)


def interpolate_swing(share: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Interpolate the angles of a swinging leg.

    Args:
        share: (...,) share of the swing.
        speed: (...,) m/s.
    Returns:
        (..., 3) rad: thigh, knee and ankle.
    """
    share, speed = np.broadcast_arrays(share, speed)
    running, sprinting = (_interpolate_swing_rows(share, speed, sprints) for sprints in (False, True))
    return running + compute_sprint_share(speed)[..., None] * (sprinting - running)


def _interpolate_swing_rows(share: np.ndarray, speed: np.ndarray, sprints: bool) -> np.ndarray:
    """Interpolate the angles (..., 3) rad of one table, of runners or of sprinters."""
    speeds, spline = _build_swing_curves(sprints)
    values = spline(np.clip(share, 0.0, 1.0))
    position = np.interp(speed, speeds, np.arange(len(speeds)))
    weights = np.maximum(0.0, 1.0 - np.abs(position[..., None] - np.arange(len(speeds))))
    return np.radians(np.einsum("...s,...sa->...a", weights, values))


# The foot in stance: pitch of the sole (toes down positive) in degrees at shares of the stance. W and M (heel strike at
# 20, toe-off beyond 60), V (rearfoot runners), N and sprinters on video (forefoot: the heel never quite comes down).
_STANCE_AT = (0, 0.06, 0.14, 0.25, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
_STANCE = {
    1.4: (-19, -11, -2, 0, 0, 0.5, 3, 9, 20, 38, 62),
    2.6: (-8, -4, -0.5, 0, 0.5, 4, 11, 22, 36, 51, 66),
    3.6: (-6, -2, 0, 0, 2, 7, 16, 29, 43, 57, 70),
    9.0: (8, 7, 6, 8, 15, 23, 33, 44, 55, 65, 74),
}


@lru_cache(maxsize=None)
def _build_stance_curves() -> tuple[np.ndarray, PchipInterpolator]:
    from scipy.interpolate import PchipInterpolator

    table = np.array([_STANCE[v] for v in sorted(_STANCE)], dtype=float)
    return np.array(sorted(_STANCE)), PchipInterpolator(_STANCE_AT, table.T, axis=0)


def interpolate_stance_pitch(share: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Interpolate the pitch of the sole in stance.

    Args:
        share: (...,) share of the stance.
        speed: (...,) m/s.
    Returns:
        (...,) rad, toes down positive.
    """
    speeds, curve = _build_stance_curves()
    values = curve(np.clip(share, 0.0, 1.0))
    position = np.interp(speed, speeds, np.arange(len(speeds)))
    weights = np.maximum(0.0, 1.0 - np.abs(position[..., None] - np.arange(len(speeds))))
    return np.radians(np.sum(weights * values, axis=-1))


@lru_cache(maxsize=None)
def _build_bounce_table() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute the height of a mass over one step for duty factors (share of the step), by integrating source L's
    sine-wave model twice.
    """
    duties = np.linspace(0.40, 1.0, 25)
    phase = np.linspace(0.0, 1.0, 241)
    heights = np.empty((len(duties), len(phase)))
    for row, duty in enumerate(duties):
        force = np.where(phase < duty, 0.5 * np.pi / duty * np.sin(np.pi * phase / duty), 0.0) - 1.0
        speed = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]))]) / (len(phase) - 1)
        speed -= np.mean(0.5 * (speed[1:] + speed[:-1]))
        height = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))]) / (len(phase) - 1)
        height -= height[-1] * phase
        heights[row] = height - np.mean(0.5 * (height[1:] + height[:-1]))
    return duties, phase, heights


def compute_bounce(step_phase: np.ndarray, contact_share: np.ndarray, step_time: np.ndarray) -> np.ndarray:
    """Compute the height of the body over its mean in running (source L).

    The foot is in contact from step phase 0 to `contact_share`, then the body flies.

    Args:
        step_phase: (...,) 0 to 1 from a foot's contact.
        contact_share: (...,) share of the step in contact.
        step_time: (...,) s.
    Returns:
        (...,) m.
    """
    duties, phase, heights = _build_bounce_table()
    # fractional row and column of the table, then bilinear interpolation
    row = np.interp(contact_share, duties, np.arange(len(duties)))
    column = (np.asarray(step_phase) % 1.0) * (len(phase) - 1)
    low_row, low_column = np.minimum(row.astype(int), len(duties) - 2), np.minimum(column.astype(int), len(phase) - 2)
    a, b = row - low_row, column - low_column
    value = (1 - a) * ((1 - b) * heights[low_row, low_column] + b * heights[low_row, low_column + 1])
    value = value + a * ((1 - b) * heights[low_row + 1, low_column] + b * heights[low_row + 1, low_column + 1])
    return value * GRAVITY * step_time**2
