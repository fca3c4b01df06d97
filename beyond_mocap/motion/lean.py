"""How far a body leans into what it is about to do: bends, starts and stops.

While a foot pushes a body sideways or ahead with an acceleration a, its force passes through the centre of mass only if
that lies off the foot by a / g of its height, over a stride on average. `measure_lean` tells how far it does;
`compute_footprint_shifts`, `tilt_body` and `lower_root` give what is missing: the footprints move outward below a
centre of mass that stays, the body tilts by a share of the angle, and sinks as legs that keep their length would lower
it. So do recorded bodies: trunks tilt by half the angle in bends, most of it in starts and little in stops; pelvises
sink by 12 to 26 cm where the acceleration is 3 to 7 m/s^2.

Source: Measured on recordings (docs/explanation/momentum.md, *Lean*); Greene 1985, J Biomech Eng 107: the lean of
runners in bends is atan(v^2 / (r g)).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.easing import quintic_step, smoothstep
from ..base.time_series import find_runs, hann_smooth, interpolate_columns, time_derivative
from ..base.vectors import cross_on_ground, dot_products, measure_lengths, unit_vectors
from . import quaternion
from .humanoid import Humanoid, identify_joints
from .mass import compute_centre_of_mass
from .skeleton import Skeleton
from .supports import GRAVITY, Stances, find_stances, smooth_level

MOST_ACCELERATION = 0.5 * GRAVITY  # m/s^2 that a lean answers; recordings' 99th percentile is .33 to .57 g
_ACCELERATION_SECONDS = 0.35  # s to either side over which the acceleration of the centre of mass is smoothed
_NEIGHBOUR_SECONDS = 0.8  # s within which stances are one run
_DEAD_ZONE = (0.01, 0.01)  # m ahead and aside that are no error: a stance tells no more
_MOST_SHIFT = (0.23, 0.20)  # m ahead and aside that footprints move at most
_CROUCH_SHARE, _MOST_CROUCH = 1.4, 0.18  # m that a body sinks at most as its feet move outward
_LEAST_HEIGHT = 0.5  # m of a centre of mass over the foot for which shifts are turned into angles: bodies lie and slide
_SPEEDS = (1.5, 2.5)  # m/s between which the lean of a step begins to count
_EFFORT_SECONDS = 0.4  # s of an acceleration that count as speed: a turn on the spot passes through rest
_CLEAR_SPEED = 1.0  # m/s from which on a velocity says which way a body goes
_TURN_SHARE, _BRAKE_SHARE = (0.8, 0.5), 0.3
"""Shares of the missing angle by which the body turns: ahead, aside, and back against a braking foot."""
_TILT_SECONDS, _CROUCH_SECONDS = 0.12, 0.33  # s to either side over which that turn, and the crouch, are smoothed


@dataclass(frozen=True, eq=False)
class Lean:
    """How each of S stances leans, averaged over the stance as its force is, and over its neighbours.

    Attributes:
        offset: (S, 2) m from the middle of the standing foot to the centre of mass, level.
        height: (S,) m from the middle of the standing foot up to the centre of mass.
        acceleration: (S, 2) m/s^2 of the centre of mass, level, without its steps.
        velocity: (S, 2) m/s of the centre of mass.
    """

    offset: np.ndarray
    height: np.ndarray
    acceleration: np.ndarray
    velocity: np.ndarray

    @property
    def missing(self) -> np.ndarray:
        """(S, 2) m by which the centre of mass should lie farther from the foot."""
        size = measure_lengths(self.acceleration)[..., None]
        asked = self.acceleration * np.minimum(1.0, MOST_ACCELERATION / np.maximum(size, 1e-9))
        return self.height[:, None] * asked / GRAVITY - self.offset

    @property
    def lever(self) -> np.ndarray:
        """(S,) m of that height, as of a body on its feet: those of bodies that lie tell nothing."""
        return np.maximum(self.height, _LEAST_HEIGHT)

    @property
    def travel(self) -> np.ndarray:
        """(S, 2) unit direction of travel."""
        return unit_vectors(self.velocity, np.array([1.0, 0.0]))

    @property
    def course(self) -> np.ndarray:
        """(S, 2) unit direction of travel, and of a body that hardly moves, of its acceleration, to the same side."""
        slowness = 1.0 - smoothstep(measure_lengths(self.velocity), 0.0, _CLEAR_SPEED)
        side = np.where(dot_products(self.velocity, self.acceleration) < 0.0, -1.0, 1.0)
        ahead = self.velocity + (_EFFORT_SECONDS * slowness * side)[:, None] * self.acceleration
        return unit_vectors(ahead, np.array([1.0, 0.0]))


def measure_lean(body: Humanoid, positions: np.ndarray, centre: np.ndarray, stances: Stances, fps: float) -> Lean:
    """Measure the lean of each stance.

    Args:
        body: which joint is what.
        positions: (T, J, 3) m, world.
        centre: (T, 3) m, the centre of mass, world.
        stances: the stances.
        fps: frames per second.
    Returns:
        The lean of each stance.
    """
    velocity = time_derivative(smooth_level(centre, _ACCELERATION_SECONDS, fps), fps)
    curves = np.concatenate([centre, time_derivative(velocity, fps), velocity], axis=1)
    feet = [0.5 * (positions[:, limb.foot] + positions[:, limb.toe_or_foot]) for limb in (body.left, body.right)]
    columns = [np.concatenate([curves, foot], axis=1) for foot in feet]
    rows = [_average_stance(columns[side], start, stop)
            for side, start, stop in zip(stances.side, stances.start, stances.stop)]
    means = _average_neighbours(np.array(rows).reshape(-1, 10), stances.middle / fps)
    return Lean(means[:, 0:2] - means[:, 7:9], means[:, 2] - means[:, 9], means[:, 3:5], means[:, 5:7])


def compute_lean_slopes(skeleton: Skeleton, positions: np.ndarray, fps: float) -> np.ndarray:
    """Compute how far a body leans in every frame: the lean of its stances, interpolated.

    Args:
        skeleton: J joints.
        positions: (T, J, 3) m, world.
        fps: frames per second.
    Returns:
        (T, 2) slope ahead and to the left of its travel; 0 without stances.
    """
    body, stances = identify_joints(skeleton), find_stances(skeleton, positions, fps)
    if not len(stances):
        return np.zeros((len(positions), 2))
    lean = measure_lean(body, positions, compute_centre_of_mass(body, positions), stances, fps)
    slope, ahead = lean.offset / lean.lever[:, None], lean.travel
    own = np.stack([dot_products(slope, ahead), cross_on_ground(ahead, slope)], axis=1)
    return interpolate_columns(np.arange(len(positions)), stances.middle, own)


def choose_shifts(lean: Lean, share: np.ndarray) -> np.ndarray:
    """Choose by how much each stance leans more.

    Args:
        lean: the S stances.
        share: (S,) from 0, nothing, to 1.
    Returns:
        (S, 2) m by which the centre of mass comes to lie farther from the foot, world.
    """
    ahead = lean.course
    aside = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    effort = measure_lengths(lean.velocity) + _EFFORT_SECONDS * measure_lengths(lean.acceleration)
    counts = share * smoothstep(effort, *_SPEEDS)
    shift = np.zeros_like(lean.offset)
    for direction, dead, most in zip((ahead, aside), _DEAD_ZONE, _MOST_SHIFT):
        lacks = dot_products(lean.missing, direction)
        wanted = most * np.tanh(np.maximum(np.abs(lacks) - dead, 0.0) / most)
        shift += (counts * np.sign(lacks) * wanted)[:, None] * direction
    return shift


def choose_angles(lean: Lean, shifts: np.ndarray) -> np.ndarray:
    """Choose by how much the body turns with the shifts of its stances.

    Args:
        lean: the S stances.
        shifts: (S, 2) m of `choose_shifts`.
    Returns:
        (S, 2) rad by which the body tilts towards x and y, world.
    """
    slope, ahead = shifts / lean.lever[:, None], lean.course
    forward = dot_products(slope, ahead)
    braking = (forward < 0.0) * smoothstep(measure_lengths(lean.velocity), 0.0, _CLEAR_SPEED)
    turned = _TURN_SHARE[0] + braking * (_BRAKE_SHARE - _TURN_SHARE[0])
    along = (turned * forward)[:, None] * ahead
    return along + _TURN_SHARE[1] * (slope - forward[:, None] * ahead)


def choose_crouch(lean: Lean, shifts: np.ndarray) -> np.ndarray:
    """Choose by how much the body sinks with the shifts of its stances: as far as a leg that keeps its length tilts.

    Args:
        lean: the S stances.
        shifts: (S, 2) m of `choose_shifts`.
    Returns:
        (S,) m.
    """
    spread = np.sum((lean.offset + shifts) ** 2 - lean.offset**2, axis=1)
    left = np.sqrt(np.maximum(lean.lever**2 - spread, 0.25 * lean.lever**2))
    return np.minimum(_CROUCH_SHARE * np.maximum(lean.lever - left, 0.0), _MOST_CROUCH)


def compute_footprint_shifts(stances: Stances, shifts: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Compute how both feet move so that their stances lean more: constant in a stance, eased while the foot swings.

    A foot that swings through frames without a share is where it was in them.

    Args:
        stances: S stances.
        shifts: (S, 2) m of `choose_shifts`, zero for stances that touch frames without a share.
        share: (T,) from 0 to 1.
    Returns:
        (T, 2, 2) m, left and right foot, world.
    """
    out, at = np.zeros((len(share), 2, 2)), np.arange(len(share))
    rests = np.array(find_runs(share <= 0.0)).reshape(-1, 2) - [0, 1]
    for side in (0, 1):
        own = stances.side == side
        if own.any():
            spans = np.concatenate([np.stack([stances.start[own], stances.stop[own]], axis=1), rests])
            values = np.repeat(np.concatenate([-shifts[own], np.zeros(rests.shape)]), 2, axis=0)
            order = np.argsort(spans.ravel(), kind="stable")
            times, values = spans.ravel()[order], values[order]
            place = np.interp(at, times, np.arange(len(times)))
            segment = np.minimum(place.astype(int), len(times) - 2)
            eased = quintic_step(place - segment)[:, None]
            out[:, side] = values[segment] + eased * (values[segment + 1] - values[segment])
    return out


def tilt_body(rotations: np.ndarray, stances: Stances, angles: np.ndarray, share: np.ndarray, fps: float
              ) -> np.ndarray:
    """Tilt a body about its root, which stays on its track, smoothly over its stances.

    Args:
        rotations: (T, J, 4) local rotations.
        stances: S stances.
        angles: (S, 2) rad of `choose_angles`.
        share: (T,) from 0, where the body does not tilt, to 1.
        fps: frames per second.
    Returns:
        (T, J, 4) local rotations.
    """
    curve = share[:, None] * _hold_over_stances(angles, stances, len(rotations), _TILT_SECONDS * fps)
    # leaning towards (x, y) is a turn about (-y, x)
    turn = quaternion.from_rotation_vector(np.column_stack([-curve[:, 1], curve[:, 0], np.zeros(len(curve))]))
    out = rotations.copy()
    out[:, 0] = quaternion.multiply(turn, rotations[:, 0])
    return out


def lower_root(root: np.ndarray, stances: Stances, crouch: np.ndarray, share: np.ndarray, fps: float) -> np.ndarray:
    """Lower a root smoothly over the stances of its body.

    Args:
        root: (T, 3) m, world.
        stances: S stances.
        crouch: (S,) m of `choose_crouch`.
        share: (T,) from 0, where the root stays, to 1.
        fps: frames per second.
    Returns:
        (T, 3) m, world.
    """
    out = root.copy()
    out[:, 2] -= share * _hold_over_stances(crouch[:, None], stances, len(root), _CROUCH_SECONDS * fps)[:, 0]
    return out


def _hold_over_stances(values: np.ndarray, stances: Stances, count: int, reach: float) -> np.ndarray:
    """Hold values (S, K) over their stances, and smooth them over some frames to either side: (T, K)."""
    at, reach = np.arange(count), max(int(round(reach)), 1)
    # a long stance keeps its value: a body that comes to stand straightens as it puts its feet down
    half = np.minimum(0.5 * (stances.stop - stances.start), reach)
    times = np.concatenate([stances.start + half, stances.stop - half])
    order = np.argsort(times, kind="stable")
    held = interpolate_columns(at, times[order], np.tile(values, (2, 1))[order])
    return np.stack([hann_smooth(column, reach) for column in held.T], axis=1)


def _average_stance(values: np.ndarray, start: float, stop: float) -> np.ndarray:
    """Average curves (T, K) over a stance in frames, weighted by the half sine of its force."""
    first, end = int(np.ceil(start)), int(np.floor(stop)) + 1
    if end - first < 2:
        return values[min(int(round(0.5 * (start + stop))), len(values) - 1)]
    weight = np.sin(np.pi * (np.arange(first, end) - start + 0.5) / (stop - start + 1.0))
    return weight @ values[first:end] / weight.sum()


def _average_neighbours(values: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Average each of (S, K) rows with those before and after, 1-2-1, where they are of one run; times (S,) s."""
    if len(values) < 2:
        return values
    near = (np.diff(times) < _NEIGHBOUR_SECONDS)[:, None]
    step = np.where(near, np.diff(values, axis=0), 0.0)
    out = values.copy()
    out[:-1] += 0.25 * step
    out[1:] -= 0.25 * step
    return out
