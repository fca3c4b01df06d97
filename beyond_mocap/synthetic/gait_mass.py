"""The centre of mass of a runner: in the air it flies, on the ground it is pushed.

A body cannot push while no foot is on the ground, so its centre of mass flies on a parabola from the last contact to
the next one. Between two flights, half a sine of force carries it, plus a whole sine that brakes first and pushes then
(source: Morin, Dalleau, Kyrolainen, Jeannin and Belli 2005, J Appl Biomech 21, sine-wave model). These two
parts are what joins two given parabolas. The pelvis follows from the pose: it goes where the centre of mass is right,
upward, forward and sideways, while legs and arms swing against it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.time_series import hann_smooth, interpolate_columns
from ..motion.humanoid import identify_joints
from ..motion.mass import compute_centre_of_mass
from ..motion.motion import forward_kinematics
from ..motion.retargeting.neutral import NeutralStance
from ..motion.retargeting.posture import Posture, to_motion
from ..motion.supports import GRAVITY
from . import gait_tables as tables
from .footsteps import Footsteps
from .gait_legs import Legs
from .gait_plan import GaitPlan

# m/s by which a runner slows down on landing and speeds up until the foot leaves (V)
_BRAKING = 0.25
# passes in which hips follow the centre of mass, in those that are marked it is lowered where legs lack reach; and by
# how much more than it is off they follow: legs on the ground stay
_PASSES, _GAIN = (False, True, True, False, False), 1.1

# steps over which a body that a leg's reach lowers is lowered evenly
_SPREAD = 3
# s before and after in which hips come to follow the centre of mass
_ONSET = 0.8
# first and last flights of a plan, whose strides it does not know in full
_EDGE = 2


@dataclass(frozen=True, eq=False, kw_only=True)
class Flights:
    """The F flights between the contacts of a run, in order of time.

    Attributes:
        start: (F,) s at which the last foot leaves the ground.
        end: (F,) s at which the next foot lands.
    """

    start: np.ndarray
    end: np.ndarray

    @property
    def middle(self) -> np.ndarray:
        """(F,) s, the middle of each flight."""
        return 0.5 * (self.start + self.end)


def find_flights(steps: tuple[Footsteps, ...]) -> Flights:
    """Find the flights between the stances of both feet; where stances overlap, a flight of no length between them."""
    on, off = (np.concatenate(times) for times in zip(*((foot.on, foot.off) for foot in steps)))
    order = np.argsort(on, kind="stable")
    start, end = off[order][:-1], on[order][1:]
    middle = 0.5 * (start + end)
    return Flights(start=np.minimum(start, middle), end=np.maximum(end, middle))


def follow_mass(posture: Posture, plan: GaitPlan, steps: tuple[Footsteps, ...], neutral: NeutralStance) -> Posture:
    """Move the hips of a runner so that the centre of mass flies between contacts.

    Args:
        posture: N moments; its feet are not read.
        plan: the plan.
        steps: stances of the left and the right foot.
        neutral: neutral stance of the body.
    Returns:
        The posture, feet planted.
    """
    flights = find_flights(steps)
    # a runner who gains speed comes to it over some steps
    rate = 1.0 / (plan.times[1] - plan.times[0])
    share = hann_smooth(tables.compute_flight_share(plan.adult_speed), int(_ONSET * rate))
    share = share * ((plan.times > flights.middle[_EDGE]) & (plan.times < flights.middle[-1 - _EDGE]))
    legs = Legs(plan.times, steps, posture.heading, neutral)
    posture = legs.plant_feet(posture)
    base = _compute_base(measure_mass(posture, neutral), plan, flights)
    for reach in _PASSES:
        wanted = plan_mass_path(plan, flights, base)
        hips = posture.hips + _GAIN * share[:, None] * (wanted - measure_mass(posture, neutral))
        posture = posture.replace_arrays(hips=hips)
        if reach:
            drop = legs.compute_hip_drop(posture) * share
            base = base - _spread_drop(drop, plan, flights)[:, None] * [0.0, 0.0, 1.0]
        posture = legs.plant_feet(posture)
    return posture


def measure_mass(posture: Posture, neutral: NeutralStance) -> np.ndarray:
    """Measure the centre of mass (N, 3) m of a posture, world frame."""
    motion = to_motion(posture, neutral)
    return compute_centre_of_mass(identify_joints(motion.skeleton), forward_kinematics(motion)[0])


def _compute_base(mass: np.ndarray, plan: GaitPlan, flights: Flights) -> np.ndarray:
    """Compute where the centre of mass is (F, 3) m in the middle of each flight: on the path, apart from its mean
    distance from it over a stride, and as high as a bounce of these contacts lifts it.
    """
    level = np.column_stack([plan.path, np.zeros(len(plan.times))])
    base = interpolate_columns(flights.middle, plan.times, level)
    return base + _average_strides(mass - level, plan.times, flights.middle) + [0.0, 0.0, 1.0] * _compute_rise(flights)


def _average_strides(values: np.ndarray, times: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """Average values (N, C) over the stride around each moment of `middle` (F,): from the one before to the next."""
    total = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(0.5 * (values[1:] + values[:-1]), axis=0)])
    at = interpolate_columns(middle, times, total * (times[1] - times[0]))
    before, after = (np.clip(np.arange(len(middle)) + k, 0, len(middle) - 1) for k in (-1, 1))
    return (at[after] - at[before]) / (middle[after] - middle[before])[:, None]


def _compute_rise(flights: Flights) -> np.ndarray:
    """Compute how far (F, 1) m the middle of a flight is above the mean height of its steps."""
    step = np.gradient(flights.middle)
    contact = np.clip(1.0 - (flights.end - flights.start) / step, 0.4, 1.0)
    return tables.compute_bounce(0.5 * (1.0 + contact), contact, step)[:, None]


def _spread_drop(drop: np.ndarray, plan: GaitPlan, flights: Flights) -> np.ndarray:
    """Compute how far (F,) m flights are lowered so that no leg lacks reach: evenly over the strides around each."""
    most = np.zeros(len(flights.middle) + 1)
    np.maximum.at(most, np.searchsorted(flights.middle, plan.times), drop)
    around = np.lib.stride_tricks.sliding_window_view(np.pad(most, _SPREAD, mode="edge"), 2 * _SPREAD + 1).max(axis=1)
    return hann_smooth(np.maximum(around[1:], around[:-1]), _SPREAD)


def plan_mass_path(plan: GaitPlan, flights: Flights, base: np.ndarray) -> np.ndarray:
    """Plan the path of the centre of mass: parabolas in flight, sine waves of force in contact.

    Args:
        plan: the plan.
        flights: F flights.
        base: (F, 3) m, places in the middle of each flight.
    Returns:
        (N, 3) m, world frame; beyond the first and the last flight the parabola goes on.
    """
    speed = _compute_flight_speed(plan, flights, base)
    number = np.clip(np.searchsorted(flights.middle, plan.times) - 1, 0, len(base) - 2)
    begin, end = flights.end[:-1], flights.start[1:]
    leave, leave_speed = _fly(base[:-1], speed[:-1], begin - flights.middle[:-1])
    land, land_speed = _fly(base[1:], speed[1:], end - flights.middle[1:])
    half, whole = _solve_forces(leave, leave_speed, land, land_speed, (end - begin)[:, None])
    in_contact = np.clip((plan.times - begin[number]) / (end - begin)[number], 0.0, 1.0)[:, None]
    length = (end - begin)[number][:, None]
    pushed, _ = _fly(leave[number], leave_speed[number], length[:, 0] * in_contact[:, 0])
    pushed = pushed + length**2 * (half[number] * (in_contact / np.pi - np.sin(np.pi * in_contact) / np.pi**2)
                                   + whole[number] * (in_contact / (2.0 * np.pi)
                                                      - np.sin(2.0 * np.pi * in_contact) / (2.0 * np.pi) ** 2))
    before, _ = _fly(base[number], speed[number], plan.times - flights.middle[number])
    after, _ = _fly(base[number + 1], speed[number + 1], plan.times - flights.middle[number + 1])
    is_before, is_after = (plan.times < begin[number])[:, None], (plan.times > end[number])[:, None]
    return np.where(is_before, before, np.where(is_after, after, pushed))


def _compute_flight_speed(plan: GaitPlan, flights: Flights, base: np.ndarray) -> np.ndarray:
    """Compute the velocity (F, 3) m/s in the middle of each flight: that of the path over a stride, and what braking
    in contact takes off.
    """
    speed = np.gradient(base, flights.middle, axis=0)
    contact = 1.0 - (flights.end - flights.start) / np.gradient(flights.middle)
    level = np.linalg.norm(speed[:, :2], axis=1)
    speed[:, :2] *= 1.0 + (0.5 * _BRAKING * contact / np.maximum(level, 1.0))[:, None]
    return speed


def _fly(place: np.ndarray, speed: np.ndarray, seconds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute place (K, 3) m and velocity (K, 3) m/s of a body that has flown for `seconds` (K,)."""
    fall = np.array([0.0, 0.0, -GRAVITY])
    seconds = seconds[:, None]
    return place + speed * seconds + 0.5 * fall * seconds**2, speed + fall * seconds


def _solve_forces(leave, leave_speed, land, land_speed, length) -> tuple[np.ndarray, np.ndarray]:
    """Solve the forces per mass (K, 3) m/s^2, half a sine and a whole sine, that join two parabolas in `length` (K, 1)
    s.
    """
    free, free_speed = _fly(leave, leave_speed, length[:, 0])
    half = 0.5 * np.pi * (land_speed - free_speed) / length
    whole = 2.0 * np.pi * ((land - free) / length**2 - half / np.pi)
    return half, whole
