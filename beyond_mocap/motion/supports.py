"""When each foot carries weight, between frames: stances, and the phases of support that they form.

Labels of contact (`contacts`) say where a foot lies still, for planting. A foot that carries weight need not lie
still: in a sprint it rolls all the time, and labels that ask for stillness find .03 s of the .15 s of such a stance.
Here only its height counts, and edges lie between frames, since a tenth of a frame of flight is 1 % of a step.

Sources of contact times: Weyand, Sternlight, Bellizzi and Wright 2000, J Appl Physiol 89; Morin, Dalleau, Kyrolainen,
Jeannin and Belli 2005, J Appl Biomech 21.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.time_series import find_runs, time_derivative
from ..base.vectors import measure_lengths
from .humanoid import Limb, identify_joints
from .skeleton import Skeleton
from .track import smooth_zero_phase_hann

GRAVITY = 9.81  # m/s^2
LOW = 0.03  # m above its own usual lowest height below which a foot carries weight (docs/reference/report-figures.md)
LOWEST = 5.0  # percentile of a joint's heights that is its usual lowest one
_SHORTEST_GAP = 2.0 / 30.0  # s; shorter gaps within a stance are noise
_RUNNING = 2.0  # m/s from which stances are lengthened
_CONTACT_SHARE = 0.95  # of the norm towards which they are lengthened: recordings spread by 5 % about it
_LONGEST_STRETCH = 1.0 / 60.0  # s by which either end of a stance is lengthened at most: half a frame of a take
_FALLING = 0.85  # of a free fall's height that a longer flight has, at least; else clips hold both feet too high
_STRIDE_FLIGHT = 0.2  # s that a runner's flight lasts at most, beyond doubt
_LYING_TRUNK, _LYING_ARM = 0.3, 0.1  # m of hips or neck, and of elbows or hands, that lie on the ground
_SPEED_SECONDS = 0.25  # s to either side over which the speed is smoothed
_CONTACT_SPEEDS = (2.0, 3.0, 4.5, 6.0, 7.0, 8.0, 9.0, 10.0)  # m/s
_CONTACT_SECONDS = (0.31, 0.25, 0.20, 0.16, 0.143, 0.125, 0.112, 0.104)  # s: Weyand 2000, Morin 2005


@dataclass(frozen=True, eq=False)
class Stances:
    """When feet carry weight, S stances in order of their start.

    Attributes:
        side: (S,) int, 0 left, 1 right.
        start, stop: (S,) frames, between which the foot carries weight.
    """

    side: np.ndarray
    start: np.ndarray
    stop: np.ndarray

    def __len__(self) -> int:
        return len(self.side)

    @property
    def middle(self) -> np.ndarray:
        """(S,) frames half-way."""
        return 0.5 * (self.start + self.stop)

    def compute_share(self, side: int, count: int, fade: float) -> np.ndarray:
        """Compute how far a foot stands: 1 in its stances, falling to 0 within `fade` frames outside of them.

        Args:
            side: 0 left, 1 right.
            count: T frames.
            fade: frames.
        Returns:
            (T,) from 0 to 1.
        """
        at, share = np.arange(count), np.zeros(count)
        for start, stop in zip(self.start[self.side == side], self.stop[self.side == side]):
            first, end = max(int(start - fade), 0), min(int(stop + fade) + 2, count)
            away = np.maximum(np.maximum(start - at[first:end], at[first:end] - stop), 0.0) / fade
            share[first:end] = np.maximum(share[first:end], np.clip(1.0 - away, 0.0, 1.0))
        return share


def interpolate_contact_seconds(speed: np.ndarray | float) -> np.ndarray:
    """Interpolate how long a runner's foot is on the ground.

    Args:
        speed: (...,) m/s.
    Returns:
        (...,) s.
    Source: Weyand 2000, Morin 2005.
    """
    return np.interp(speed, _CONTACT_SPEEDS, _CONTACT_SECONDS)


def find_stances(skeleton: Skeleton, positions: np.ndarray, fps: float) -> Stances:
    """Find the stances of both feet: where ankle or toe is less than 3 cm above its own usual lowest height.

    Stances of runners are lengthened a little towards the usual time of contact at their speed: the foot carries
    weight before and after its joints are at their lowest.

    Args:
        skeleton: J joints.
        positions: (T, J, 3) m, world.
        fps: frames per second.
    Returns:
        The stances.
    Raises:
        InputError: if the skeleton has no legs.
    """
    body = identify_joints(skeleton)
    speed = measure_speed(positions[:, body.hips], fps)
    found = [(start, stop, side) for side, limb in enumerate((body.left, body.right))
             for start, stop in _find_low_stretches(measure_foot_height(positions, limb), fps)]
    if not found:
        return Stances(np.zeros(0, int), np.zeros(0), np.zeros(0))
    start, stop, side = (np.array(values) for values in zip(*sorted(found)))
    start, stop = _lengthen_stances(start, stop, speed, fps)
    order = np.argsort(start, kind="stable")
    return Stances(side[order].astype(int), start[order], stop[order])


def find_lying_stretches(skeleton: Skeleton, positions: np.ndarray) -> np.ndarray:
    """Find the stretches in which the trunk or an arm lies on the ground: after dives, falls and slides.

    Args:
        skeleton: J joints.
        positions: (T, J, 3) m, world.
    Returns:
        (L, 2) frames between which it lies: half a frame to either side, so that one that lies for a frame is pushed.
    """
    body = identify_joints(skeleton)
    arms = [joint for limb in (body.left, body.right) for joint in (limb.hand, limb.lower_arm) if joint is not None]
    is_lying = positions[:, [body.hips, body.neck_or_chest], 2].min(axis=1) < _LYING_TRUNK
    if arms:
        is_lying |= positions[:, arms, 2].min(axis=1) < _LYING_ARM
    edges = np.array(find_runs(is_lying), float).reshape(-1, 2) - 0.5
    return np.clip(edges, 0.0, len(positions) - 1.0)


def find_support_phases(stances: Stances, centre: np.ndarray, fps: float, lying: np.ndarray | None = None
                        ) -> np.ndarray:
    """Find the phases in which a foot, or a body that lies, carries weight.

    A long stretch between them, or one of a slow body, in which the body hardly falls is no flight: something else
    carries it (hands, a lying body, a foot that the threshold missed), and the phases around it are joined. So is what
    lies before the first and behind the last stance.

    Args:
        stances: the stances.
        centre: (T, 3) m, the centre of mass, world.
        fps: frames per second.
        lying: (L, 2) frames of `find_lying_stretches`; None for none.
    Returns:
        (P, 2) frames, first and last of each phase, ascending.
    """
    end, speed = float(len(centre) - 1), measure_speed(centre, fps)

    def is_flight(first: float, last: float) -> bool:
        seconds, at = (last - first) / fps, np.arange(len(centre))
        if 0.0 < seconds < _STRIDE_FLIGHT and np.interp(0.5 * (first + last), at, speed) > _RUNNING:
            return True
        # a body in free fall is g T^2 / 8 above the line between its ends, half-way
        start, middle, stop = np.interp([first, 0.5 * (first + last), last], at, centre[:, 2])
        return seconds > 0.0 and middle - 0.5 * (start + stop) > _FALLING * GRAVITY * seconds**2 / 8.0

    phases: list[list[float]] = []
    spans = np.stack([stances.start, stances.stop], axis=1)
    spans = spans if lying is None else np.concatenate([spans, lying])
    for start, stop in spans[np.argsort(spans[:, 0], kind="stable")].tolist():
        if phases and (start <= phases[-1][1] or not is_flight(phases[-1][1], start)):
            phases[-1][1] = max(phases[-1][1], stop)
        else:
            phases.append([start, stop])
    if not phases:
        return np.array([[0.0, end]])
    for edge, near, far in ((0, 0.0, phases[0][0]), (1, phases[-1][1], end)):
        if not is_flight(near, far):
            phases[-edge][edge] = (near, far)[edge]
    return np.array(phases)


def list_flights(phases: np.ndarray, count: int) -> np.ndarray:
    """List the flights: what lies between phases of support, before the first and behind the last one.

    Args:
        phases: (P, 2) frames of `find_support_phases`.
        count: T frames.
    Returns:
        (F, 2) frames, first and last of each, ascending.
    """
    edges = np.concatenate([[0.0], phases.ravel(), [count - 1.0]]).reshape(-1, 2)
    return edges[edges[:, 0] < edges[:, 1]]


def measure_speed(points: np.ndarray, fps: float) -> np.ndarray:
    """Measure the level speed of a point, smoothed over half a second.

    Args:
        points: (T, 3) m, world.
        fps: frames per second.
    Returns:
        (T,) m/s.
    """
    return measure_lengths(time_derivative(smooth_level(points, _SPEED_SECONDS, fps), fps))


def smooth_level(points: np.ndarray, reach: float, fps: float) -> np.ndarray:
    """Smooth the level path of a point; it goes on beyond the ends as it came.

    Args:
        points: (T, 3) m, world.
        reach: s of the window to either side.
        fps: frames per second.
    Returns:
        (T, 2) m, world.
    """
    frames = max(int(round(reach * fps)), 1) + 1
    return smooth_zero_phase_hann(points[:, :2], fps, 2.0 * frames / fps)


def measure_foot_height(positions: np.ndarray, limb: Limb) -> np.ndarray:
    """Measure how high a foot is above the ground: the lower one of ankle and toe, over its own usual lowest height.

    Args:
        positions: (T, J, 3) m, world.
        limb: the joints of its side.
    Returns:
        (T,) m.
    """
    heights = positions[:, [limb.foot, limb.toe_or_foot], 2]
    return (heights - np.percentile(heights, LOWEST, axis=0)).min(axis=1)


def _find_low_stretches(height: np.ndarray, fps: float) -> list[tuple[float, float]]:
    """Find (first, last) of the stretches below LOW of a curve (T,) m, in frames, by linear interpolation."""
    found: list[tuple[float, float]] = []
    for first, end in find_runs(height < LOW):
        start, stop = float(first), float(end - 1)
        if first > 0:
            start -= (LOW - height[first]) / (height[first - 1] - height[first])
        if end < len(height):
            stop += (LOW - height[end - 1]) / (height[end] - height[end - 1])
        if found and start - found[-1][1] < _SHORTEST_GAP * fps:
            start = found.pop()[0]
        found.append((start, stop))
    return [(start, stop) for start, stop in found if stop > start]


def _lengthen_stances(start: np.ndarray, stop: np.ndarray, speed: np.ndarray, fps: float
                      ) -> tuple[np.ndarray, np.ndarray]:
    """Lengthen stances (S,) frames of a runner (T,) m/s at both ends; ends of the motion stay."""
    last = len(speed) - 1
    pace = np.interp(0.5 * (start + stop), np.arange(len(speed)), speed)
    lacks = 0.5 * np.clip(_CONTACT_SHARE * interpolate_contact_seconds(pace) * fps - (stop - start), 0.0, None)
    lacks = np.where(pace > _RUNNING, np.minimum(lacks, _LONGEST_STRETCH * fps), 0.0)
    return np.maximum(start - lacks, 0.0), np.minimum(stop + lacks, last)

