"""All that the report's group `physics` measures of one body, and the figures of one or several of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..appearance.mesh import BodyMesh
from ..motion.motion import Motion
from .boots import DEEP, measure_boot_heights
from .naturalness import SLOW_SPEED, BodyCourse
from .physics import (
    E,
    Flights,
    Leans,
    Pushes,
    Steps,
    join_events,
    measure_flights,
    measure_leans,
    measure_mass_course,
    measure_pushes,
    measure_steps,
)
from .sprint_form import SprintStrides, measure_sprint_strides

SPEED_CLASSES = {"2-4": (SLOW_SPEED, 4.0), "4-6": (4.0, 6.0), "6+": (6.0, math.inf)}  # m/s
ACCELERATING = 2.0  # m/s^2 of a path from which flights are measured apart
FORCE_RANGE = 0.15  # share by which the force of a step may differ from that of runners
LEANING, LEANING_LITTLE = np.radians(6.0), np.radians(3.0)
"""Leans asked for, from which on their error is measured, and from which on a slope says how far they are followed."""

FEWEST = 3  # flights, steps or strides of a figure


@dataclass(frozen=True, eq=False, kw_only=True)
class BodyPhysics:
    """What is measured of one body, T frames at 30 per second.

    Attributes:
        flights, steps, leans, pushes, sprint: its events.
        boots: (T,) m, height of the lowest point of its boots.
    """

    flights: Flights
    steps: Steps
    leans: Leans
    pushes: Pushes
    sprint: SprintStrides
    boots: np.ndarray


def measure_body_physics(motion: Motion, positions: np.ndarray, rotations: np.ndarray,
                         course: BodyCourse, boots: BodyMesh) -> BodyPhysics:
    """Measure one body.

    Args:
        motion: N frames on a skeleton of J joints.
        positions: (N, J, 3) m, its joints, world.
        rotations: (N, J, 4), the same.
        course: of the same motion.
        boots: of its body.
    """
    mass = measure_mass_course(motion.skeleton, positions, motion.fps, course)
    return BodyPhysics(
        flights=measure_flights(mass), steps=measure_steps(mass), leans=measure_leans(mass),
        pushes=measure_pushes(mass),
        sprint=measure_sprint_strides(motion.skeleton, positions, motion.fps, course, mass),
        boots=measure_boot_heights(boots, motion, positions, rotations),
    )


def summarize_physics(bodies: Sequence[BodyPhysics], used: Sequence[np.ndarray]) -> dict:
    """Summarize the figures that takes and recordings share.

    Args:
        bodies: one take, or recordings; one at least.
        used: (T,) bool for each: frames that count; an event counts by its middle.
    Returns:
        Figures by group, NaN where fewer than FEWEST events are known, and what they rest on.
    """
    def collect(read: Callable[[BodyPhysics], E]) -> E:
        found = map(read, bodies)
        return join_events([events.select(mask[events.middle]) for events, mask in zip(found, used)])

    boots = np.concatenate([body.boots[mask] for body, mask in zip(bodies, used)])
    return {"flight": _summarize_flights(collect(lambda body: body.flights)),
            "step_force": _summarize_steps(collect(lambda body: body.steps)),
            "lean": {**_summarize_leans(collect(lambda body: body.leans)),
                     "hard": _summarize_pushes(collect(lambda body: body.pushes))},
            "sprint_form": _summarize_sprint(collect(lambda body: body.sprint)),
            "boots": {"frames": len(boots), "below_share": float(np.mean(boots < -DEEP)) if len(boots) else math.nan}}


def _split_by_speed(events: E) -> dict[str, E]:
    """Split events by the speed classes of the group."""
    return {name: events.select((events.speed >= least) & (events.speed < most))
            for name, (least, most) in SPEED_CLASSES.items()}


def _summarize_flights(flights: Flights) -> dict:
    """Summarize the acceleration in flight by speed, and that of flights whose path accelerates."""
    accelerating = flights.select((flights.speed >= SLOW_SPEED) & (flights.path > ACCELERATING))
    by_speed = {name: {"flights": len(part), "vertical_m_s2_median": _median(part.vertical),
                       "level_m_s2_median": _median(part.level)} for name, part in _split_by_speed(flights).items()}
    by_path = {"flights": len(accelerating), "level_m_s2_median": _median(accelerating.level)}
    return {**by_speed, "accelerating": by_path}


def _summarize_steps(steps: Steps) -> dict:
    """Summarize the force of steps over that of runners, by speed."""
    out = {}
    for name, part in _split_by_speed(steps).items():
        ratio = part.force / part.usual
        in_range = np.abs(ratio - 1.0) <= FORCE_RANGE
        out[name] = {"steps": len(part), "force_ratio_median": _median(ratio),
                     "force_in_range_share": float(in_range.mean()) if len(part) >= FEWEST else math.nan}
    return out


def _summarize_leans(leans: Leans) -> dict:
    """Summarize leans, sideways and fore and aft, where the acceleration asks for some."""
    out = {}
    for column, name in enumerate(("side", "fore")):
        angle, wanted = leans.angle[:, column], leans.wanted[:, column]
        large, some = np.abs(wanted) > LEANING, np.abs(wanted) > LEANING_LITTLE
        is_enough = np.count_nonzero(some) >= FEWEST
        out[name] = {
            "stances": int(np.count_nonzero(large)),
            "lean_error_deg_median": _median(np.degrees(np.abs(angle - wanted)[large])),
            "slope_stances": int(np.count_nonzero(some)),
            "lean_slope": float(angle[some] @ wanted[some] / (wanted[some] @ wanted[some])) if is_enough else math.nan,
        }
    return out


def _summarize_pushes(pushes: Pushes) -> dict:
    """Summarize how far bodies that are pushed hard lack lean, and how deep they crouch."""
    return {"pushes": len(pushes), "lean_missing_deg_median": _median(np.degrees(pushes.missing)),
            "crouch_m_median": _median(pushes.crouch)}


def _summarize_sprint(sprint: SprintStrides) -> dict:
    """Summarize the form of sprint strides."""
    return {
        "strides": len(sprint), "knee_flexion_deg_median": _median(np.degrees(sprint.knee)),
        "ankle_lift_m_median": _median(sprint.lift), "trunk_lean_deg_median": _median(np.degrees(sprint.trunk)),
        "bounce_m_median": _median(sprint.bounce), "bounce_ratio_median": _median(sprint.bounce / sprint.bounce_curve),
    }


def _median(values: np.ndarray) -> float:
    """Compute the median of FEWEST values or more, else NaN."""
    return float(np.median(values)) if len(values) >= FEWEST else math.nan
