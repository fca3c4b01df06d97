"""How a sprinter's body looks over a stride: knees, heels, trunk, and the bounce of the centre of mass.

Strides between 6 and 8 m/s count (`sprint_form` of docs/reference/report-figures.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.time_series import interpolate_columns
from ..base.vectors import arctan2, unit_vectors
from ..library.posture import LEG_LENGTH
from ..motion.humanoid import Humanoid, Limb, identify_joints, measure_leg_length
from ..motion.skeleton import Skeleton
from .naturalness import FPS, STRIDE_SECONDS, BodyCourse, resample_positions
from .physics import Events, MassCourse, compute_bounce

SPRINT_SPEEDS = (6.0, 8.0)  # m/s of the strides that count


@dataclass(frozen=True, eq=False)
class SprintStrides(Events):
    """Strides of a sprint, each from one touchdown of a foot to its next.

    Attributes:
        knee: (N,) rad, largest flexion of that leg's knee.
        lift: (N,) m, largest height of its ankle above the ground, for a leg of 0.86 m.
        trunk: (N,) rad, mean forward lean of the trunk.
        bounce: (N,) m by which the centre of mass goes up and down.
        bounce_curve: (N,) m, the same of a mass on such stances and flights.
    """

    knee: np.ndarray
    lift: np.ndarray
    trunk: np.ndarray
    bounce: np.ndarray
    bounce_curve: np.ndarray


def measure_sprint_strides(skeleton: Skeleton, positions: np.ndarray, fps: float, course: BodyCourse,
                           mass: MassCourse) -> SprintStrides:
    """Measure the form of each stride between 6 and 8 m/s.

    Args:
        skeleton: J joints.
        positions: (N, J, 3) m, world.
        fps: frames per second of the positions.
        course, mass: of the same positions.
    """
    spans, side, contact = _list_strides(mass)
    if not len(spans):
        return SprintStrides(np.zeros(0, int), *np.zeros((6, 0)))
    positions, body = resample_positions(positions, fps), identify_joints(skeleton)
    limbs, seconds = (body.left, body.right), np.diff(spans, axis=1)[:, 0] / FPS
    scale = LEG_LENGTH / measure_leg_length(skeleton)
    curves = np.stack([
        *(measure_knee_flexion(positions, limb) for limb in limbs),
        *(scale * positions[:, limb.foot, 2] for limb in limbs),
        measure_trunk_lean(positions, body, course.heading), mass.centre[:, 2],
    ], axis=1)  # fmt: skip
    parts = [curves[int(np.ceil(first)) : int(last) + 1] for first, last in spans]
    most, mean = np.array([part.max(axis=0) for part in parts]), np.array([part.mean(axis=0) for part in parts])
    middle, row = np.rint(spans.mean(axis=1)).astype(int), np.arange(len(spans))
    return SprintStrides(
        middle, mass.speed[middle], knee=most[row, side], lift=most[row, 2 + side], trunk=mean[:, 4],
        bounce=np.array([np.ptp(part[:, 5]) for part in parts]), bounce_curve=compute_bounce(0.5 * seconds, contact),
    )


def _list_strides(mass: MassCourse) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """List the sprint strides: first and last frame (N, 2), side (N,) and mean contact time (N,) s of their stances."""
    stances = mass.stances
    first = np.arange(max(len(stances) - 2, 0))
    spans = np.stack([stances.start[first], stances.start[first + 2]], axis=1)
    seconds, contact = np.diff(spans, axis=1)[:, 0] / FPS, (stances.stop - stances.start) / FPS
    speed = interpolate_columns(spans.mean(axis=1), np.arange(len(mass.speed)), mass.speed[:, None])[:, 0]
    is_sprint = (stances.side[first] != stances.side[first + 1]) & (stances.side[first] == stances.side[first + 2])
    is_sprint &= (speed >= SPRINT_SPEEDS[0]) & (speed <= SPRINT_SPEEDS[1])
    is_sprint &= (seconds >= STRIDE_SECONDS[0]) & (seconds <= STRIDE_SECONDS[1])
    return spans[is_sprint], stances.side[first][is_sprint], 0.5 * (contact[first] + contact[first + 1])[is_sprint]


def measure_knee_flexion(positions: np.ndarray, limb: Limb) -> np.ndarray:
    """Measure the angle (T,) rad between thigh and shank of a leg, 0 for a straight one.

    Args:
        positions: (T, J, 3) m, world.
        limb: the joints of its side.
    """
    hip, knee, ankle = (positions[:, joint] for joint in (limb.upper_leg, limb.lower_leg, limb.foot))
    return np.arccos(np.clip(np.sum(unit_vectors(knee - hip) * unit_vectors(ankle - knee), axis=1), -1.0, 1.0))


def measure_trunk_lean(positions: np.ndarray, body: Humanoid, heading: np.ndarray) -> np.ndarray:
    """Measure how far the line from the middle of the hip joints to that of the shoulder joints leans forward.

    Args:
        positions: (T, J, 3) m, world.
        body: which joint is what; the neck stands for the shoulders of bodies without arms.
        heading: (T,) rad.
    Returns:
        (T,) rad, negative backward.
    """
    hips = 0.5 * (positions[:, body.left.upper_leg] + positions[:, body.right.upper_leg])
    arms = [limb.upper_arm for limb in (body.left, body.right) if limb.upper_arm is not None]
    trunk = positions[:, arms or [body.neck_or_chest]].mean(axis=1) - hips
    ahead = trunk[:, 0] * np.cos(heading) + trunk[:, 1] * np.sin(heading)
    return arctan2(ahead, trunk[:, 2])
