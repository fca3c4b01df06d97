"""Whether a body moves as its mass has to: in the air, over its feet, and in bends.

The figures are those of docs/reference/report-figures.md, *How the mass moves*.

A body that no foot supports flies on a parabola: its centre of mass falls at 9.81 m/s^2 and keeps its speed. What it
needs to stay up, and to turn, start and stop, its feet have to push while they are on the ground, so it leans as it is
accelerated. The same code measures takes and recordings, both at 30 frames per second. Speeds are those of the pelvis
for a leg of 0.86 m (`naturalness`); accelerations are of the body as it is, since all bodies have the same gravity.

Sources: Reitsma and Pollard 2003, "Perceptual metrics for character animation"; Weyand, Sternlight, Bellizzi and Wright
2000, J Appl Physiol 89; Morin, Dalleau, Kyrolainen, Jeannin and Belli 2005, J Appl Biomech 21.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import TypeVar

import numpy as np

from ..base.time_series import find_runs, time_derivative
from ..base.vectors import cross_on_ground, dot_products, measure_lengths
from ..motion.humanoid import identify_joints
from ..motion.lean import Lean, measure_lean
from ..motion.mass import compute_centre_of_mass
from ..motion.skeleton import Skeleton
from ..motion.supports import GRAVITY, LOW, Stances, find_stances, interpolate_contact_seconds, measure_foot_height
from ..motion.track import smooth_zero_phase_hann
from ..synthetic.gait_tables import interpolate_figure
from .naturalness import FPS, SLOW_SPEED, BodyCourse, resample_positions

FLIGHT_FRAMES = 5  # frames of the shortest flight that is measured
PATH_SECONDS = 1.0  # of the window through which the path of the centre of mass accelerates in flight
HARD = 3.0  # m/s^2 of a stance from which on a body is pushed hard: turns and stops that make it crouch
UPRIGHT = 80.0  # percentile of a body's pelvis heights from which its crouch is measured
STEP_SECONDS = (0.15, 0.6)  # shortest and longest step of a run; others are missed or counted twice

E = TypeVar("E", bound="Events")


@dataclass(frozen=True, eq=False)
class Events:
    """Events of a body, N of them, one value each.

    Attributes:
        middle: (N,) int, frame in the middle of each.
        speed: (N,) m/s.
    """

    middle: np.ndarray
    speed: np.ndarray

    def __len__(self) -> int:
        return len(self.middle)

    def select(self: E, flags: np.ndarray) -> E:
        """Select events by flags (N,) bool."""
        return replace(self, **{field.name: getattr(self, field.name)[flags] for field in fields(self)})


@dataclass(frozen=True, eq=False)
class Flights(Events):
    """Stretches without a foot near the ground.

    Attributes:
        vertical: (N,) m/s^2 of the centre of mass; a falling body has -9.81.
        level: (N,) m/s^2, size of its level acceleration; a falling body has 0.
        path: (N,) m/s^2, the same of its path, smoothed over a second.
    """

    vertical: np.ndarray
    level: np.ndarray
    path: np.ndarray


@dataclass(frozen=True, eq=False)
class Steps(Events):
    """Running steps, each from one foot's touchdown to that of the other.

    Attributes:
        force: (N,) body weights, mean vertical force of the stance, from step time over contact time.
        usual: (N,) body weights, the same of runners at that speed.
    """

    force: np.ndarray
    usual: np.ndarray


@dataclass(frozen=True, eq=False)
class Leans(Events):
    """Stances of a run, each averaged with its neighbours.

    Attributes:
        angle: (N, 2) rad from the vertical of the line from the standing foot to the centre of mass: sideways (left is
            positive) and forward, relative to the travel.
        wanted: (N, 2) rad, the same by which the acceleration has to lean: atan(a / g).
    """

    angle: np.ndarray
    wanted: np.ndarray


@dataclass(frozen=True, eq=False)
class Pushes(Events):
    """Stances of bodies that are pushed hard, at any speed.

    Attributes:
        missing: (N,) rad by which the body leans less along its acceleration than atan(a / g).
        crouch: (N,) m by which the pelvis is below its own usual height at its lowest, for a leg of 0.86 m.
    """

    missing: np.ndarray
    crouch: np.ndarray


@dataclass(frozen=True, eq=False)
class MassCourse:
    """Where a body's mass and feet are, T frames at 30 per second.

    Attributes:
        centre: (T, 3) m, the centre of mass.
        foot_height: (T, 2) m, lower one of ankle and toe over its own usual lowest height.
        speed: (T,) m/s of the pelvis.
        crouch: (T,) m by which the pelvis is below its own usual height, for a leg of 0.86 m.
        stances: when feet carry weight.
        lean: how far each stance leans.
    """

    centre: np.ndarray
    foot_height: np.ndarray
    speed: np.ndarray
    crouch: np.ndarray
    stances: Stances
    lean: Lean


def measure_mass_course(skeleton: Skeleton, positions: np.ndarray, fps: float, course: BodyCourse) -> MassCourse:
    """Measure where a body's mass and feet are.

    Args:
        skeleton: J joints.
        positions: (N, J, 3) m, world.
        fps: frames per second of the positions.
        course: of the same positions.
    """
    positions, body = resample_positions(positions, fps), identify_joints(skeleton)
    centre, stances = compute_centre_of_mass(body, positions), find_stances(skeleton, positions, FPS)
    heights = [measure_foot_height(positions, limb) for limb in (body.left, body.right)]
    return MassCourse(centre=centre, foot_height=np.stack(heights, axis=1), speed=course.speed,
                      crouch=np.percentile(course.pelvis_height, UPRIGHT) - course.pelvis_height, stances=stances,
                      lean=measure_lean(body, positions, centre, stances, FPS))


def join_events(parts: Sequence[E]) -> E:
    """Join the events of several bodies, one at least; their frames are those of each body."""
    names = [field.name for field in fields(parts[0])]
    return replace(parts[0], **{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})


def measure_flights(body: MassCourse) -> Flights:
    """Measure the acceleration of the centre of mass in each flight, by a parabola.

    A flight is a stretch of FLIGHT_FRAMES or more in which ankles and toes are more than 3 cm above their own 5th
    percentile.
    """
    runs = [run for run in find_runs((body.foot_height > LOW).all(axis=1)) if run[1] - run[0] >= FLIGHT_FRAMES]
    found = np.array([_fit_acceleration(body.centre[first:end]) for first, end in runs]).reshape(-1, 3)
    middle = np.array([(first + end - 1) // 2 for first, end in runs], dtype=int)
    return Flights(middle, body.speed[middle], vertical=found[:, 2], level=np.linalg.norm(found[:, :2], axis=1),
                   path=np.linalg.norm(_compute_path_acceleration(body.centre)[middle], axis=1))


def _fit_acceleration(points: np.ndarray) -> np.ndarray:
    """Fit the acceleration (3,) m/s^2 of points (T, 3) m by a parabola."""
    times = (np.arange(len(points)) - 0.5 * (len(points) - 1)) / FPS
    square = times**2 - np.mean(times**2)  # has nothing in common with a constant, nor with a line
    return 2.0 * (square @ points) / (square @ square)


def _compute_path_acceleration(centre: np.ndarray) -> np.ndarray:
    """Compute the level acceleration (T, 2) m/s^2 of the path of a centre of mass (T, 3) m, without the steps in it."""
    path = smooth_zero_phase_hann(centre[:, :2], FPS, PATH_SECONDS)
    return time_derivative(time_derivative(path, FPS), FPS)


def measure_steps(body: MassCourse) -> Steps:
    """Measure the mean vertical force of each stance of a run faster than 2 m/s.

    The ground carries the body's weight over the whole step, but only while the foot is on it: the mean force in
    contact is g times step time over contact time. That of runners comes from their contact times (`supports`) and step
    times (`gait_tables`).
    """
    stances, last = body.stances, len(body.centre) - 1
    seconds = np.diff(stances.start) / FPS
    contact = ((stances.stop - stances.start) / FPS)[:-1]
    middle = np.rint(stances.middle[:-1]).astype(int)
    speed = body.speed[middle]
    is_step = _flag_steps(stances) & (speed > SLOW_SPEED) & (stances.start[:-1] > 0.0) & (stances.stop[:-1] < last)
    middle, speed, seconds, contact = (values[is_step] for values in (middle, speed, seconds, contact))
    usual = 0.5 / interpolate_figure("frequency", speed) / interpolate_contact_seconds(speed)
    return Steps(middle, speed, force=seconds / contact, usual=usual)


def _flag_steps(stances: Stances) -> np.ndarray:
    """Flag the stances (S - 1,) bool that are followed by one of the other foot, a step of a run later."""
    seconds = np.diff(stances.start) / FPS
    return (np.diff(stances.side) != 0) & (seconds >= STEP_SECONDS[0]) & (seconds <= STEP_SECONDS[1])


def measure_leans(body: MassCourse) -> Leans:
    """Measure how far each stance of a run faster than 2 m/s leans, and how far its acceleration asks it to."""
    lean = body.lean
    is_run = np.append(_flag_steps(body.stances), False)[: len(body.stances)]
    middle = np.rint(body.stances.middle).astype(int)
    is_run &= body.speed[middle] > SLOW_SPEED
    angle, wanted = np.arctan(lean.offset / lean.height[:, None]), np.arctan(lean.acceleration / GRAVITY)
    found = Leans(middle, body.speed[middle], *(
        np.stack([cross_on_ground(lean.travel, part), np.sum(lean.travel * part, axis=1)], axis=1)
        for part in (angle, wanted)))
    return found.select(is_run)


def measure_pushes(body: MassCourse) -> Pushes:
    """Measure how far each stance of a body that is pushed by more than HARD lacks lean, and how deep it crouches.

    Args:
        body: the body's motion with its stances.
    Returns:
        The stances that are pushed so hard.
    """
    lean, stances = body.lean, body.stances
    size = measure_lengths(lean.acceleration)
    slope = dot_products(lean.offset, lean.acceleration) / np.maximum(size * lean.lever, 1e-9)
    spans = zip(stances.start.astype(int), np.ceil(stances.stop).astype(int) + 1)
    crouch = np.array([body.crouch[first:end].max() for first, end in spans])
    middle = np.rint(stances.middle).astype(int)
    found = Pushes(middle, body.speed[middle], np.arctan(size / GRAVITY) - np.arctan(slope), crouch)
    return found.select((size > HARD) & (lean.height >= lean.lever))


def compute_bounce(step_seconds: np.ndarray, contact_seconds: np.ndarray) -> np.ndarray:
    """Compute how far a runner's centre of mass goes up and down, if the force of a stance is half a sine.

    Args:
        step_seconds: (N,) s from touchdown to touchdown.
        contact_seconds: (N,) s, no longer than the step.
    Returns:
        (N,) m.
    Source: Morin 2005.
    """
    flight = step_seconds - contact_seconds
    drop = step_seconds * contact_seconds / (2.0 * math.pi) - contact_seconds**2 / 8.0
    return GRAVITY * (drop + flight**2 / 8.0)
