"""How people of a library stand, walk, jog and run, learned from the library itself, and which frames do not belong.

Folders of motion capture hold fights, pushes, dances and stumbles beside walks, often labelled *walking* by their
speed, and there may be more of them than of walks. But people do not fight while they travel straight on at one speed:
such steady travel is the seed of each class of speed. Of the seed a Gaussian is fitted to the nearest 60 % again and
again, from the median on, until it rests (the steps of the minimum covariance determinant, Rousseeuw and Van Driessen
1999); then it grows over what is near. Standing has none: there the seed is what has arms and trunk as walking has.
Frames far outside of it show boxing, not walking.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..annotation import DISCRETE
from ..base.time_series import compute_running_maximum, time_derivative
from ..motion import quaternion
from ..motion.humanoid import Humanoid
from ..motion.track import smooth_zero_phase_hann

SPEED_EDGES = (0.4, 1.2, 2.0, 3.0, 4.5)  # m/s between the classes in which postures are compared
BELONGING = 3.0
"""How far outside of the core's radius a frame belongs, as Mahalanobis distance: a sum, since the spread of distances
in a Gaussian is the same for any number of dimensions. On a library of five folders, 2 % of the frames of calm walks
lie outside, and 70 to 85 % of those of celebrations, juggling, volleys and close dribbles."""

_CORE_SHARE = 0.6
_ROUNDS = 20  # of concentration; it rests after some ten
# rounds of growing within the seed and over all frames, and how far outside of the radius a frame joins: more of them
# creep into fights
_SEED_ROUNDS, _GROWING_ROUNDS, _JOINING = 5, 3, 2.2
_SAMPLED = 4000  # frames of a class that are fitted
_FEWEST = 200  # frames with which a class has a region of its own
_PATH_SECONDS, _STEP_SECONDS = 0.7, 0.5  # Hann window of the path; a step
_HAND_SPEED = 0.2  # m/s, added to the hands' speed before its logarithm
_LEAST_VARIANCE = 2e-3
_VARIANCE_OF_FEW = 2.0  # over the number of frames: few frames of one person know little of their spread
# steady travel: seconds, least m/s, range of the speed as a share of it, radians of turn, share of the speed forward
_STEADY_SECONDS, _STEADY_SPEED, _STEADY_RANGE, _STEADY_TURN, _FORWARD = 1.5, 0.8, 0.35, np.radians(75.0), 0.7
_WALKING_CLASS = 2  # the fastest class of walking, whose arms and trunk show how people stand
FALL_HEIGHT, FALL_SECONDS, LEG_LENGTH = 0.15, 0.2, 0.86
"""m by which hips fall in s, of a body with a leg of LEG_LENGTH m, that people who walk and run do not show."""

_FALLING = 2.0  # strangeness of a frame in such a fall, as that of a body one radius off: hops over obstacles, stumbles
PARTS = {"hips": slice(0, 1), "feet": slice(1, 2), "arms": slice(2, 14), "trunk": slice(14, 17), "hands": slice(17, 18)}
"""The columns of a posture by what they describe; a skeleton without two arms has fewer."""

_ARMS_AND_TRUNK = slice(PARTS["arms"].start, PARTS["trunk"].stop)
# of calm standing and walking: hips in leg lengths, and the vertical component of trunk, upper arms and forearms; on a
# library of five folders 98 % of what belongs below 1.2 m/s is so, and 20 % of the rest
_CALM_HIPS, _CALM_TRUNK, _CALM_UPPER_ARM, _CALM_FOREARM = 0.85, 0.85, -0.7, -0.3


def compute_postures(positions: np.ndarray, facing: np.ndarray, fps: float, body: Humanoid) -> np.ndarray:
    """Compute the posture of every frame: directions of arms and trunk, how fast the hands move, hips and step width.

    Args:
        positions: (T, J, 3) m, world.
        facing: (T,) rad.
        fps: frames per second.
        body: the skeleton's joints.
    Returns:
        (T, K) float32; directions are unit vectors in the body's frame, lengths in leg lengths.
    """
    hips = positions[:, body.hips]
    local = quaternion.rotate_about_up(positions - hips[:, None] * np.array([1.0, 1.0, 0.0]), -facing[:, None])
    limbs = (body.left, body.right)
    leg = np.mean([np.linalg.norm(local[:1, limb.foot] - local[:1, limb.upper_leg], axis=-1)[0] for limb in limbs])
    leg = max(leg, 1e-3)
    columns = [local[:, body.hips, 2:] / leg, _compute_step_width(positions, local, facing, fps, body)[:, None] / leg]
    arms = [limb for limb in limbs if None not in (limb.upper_arm, limb.lower_arm, limb.hand)]
    for limb in arms:
        columns += [_compute_direction(local, limb.upper_arm, limb.lower_arm),
                    _compute_direction(local, limb.lower_arm, limb.hand)]
    if len(arms) == 2:
        shoulders = 0.5 * (local[:, body.left.upper_arm] + local[:, body.right.upper_arm])
        trunk = shoulders - local[:, body.hips]
        speed = np.mean([np.linalg.norm(time_derivative(local[:, limb.hand], fps), axis=1) for limb in arms], axis=0)
        columns += [trunk / np.maximum(np.linalg.norm(trunk, axis=1, keepdims=True), 1e-9),
                    np.log(speed + _HAND_SPEED)[:, None]]
    return np.concatenate(columns, axis=1).astype(np.float32)


def _compute_step_width(positions: np.ndarray, local: np.ndarray, facing: np.ndarray, fps: float,
                        body: Humanoid) -> np.ndarray:
    """Compute how far (T,) m the feet are apart sideways, less what side steps at that speed need.

    Towards the width of the hips, which is left as it is: feet part and cross by as much as the body travels sideways
    in a step. positions and local: (T, J, 3) m in the world and in the body's frame.
    """
    path = smooth_zero_phase_hann(positions[:, body.hips, :2], fps, _PATH_SECONDS)
    sideways = np.abs(quaternion.rotate_level(time_derivative(path, fps), -facing)[:, 1])
    legs = local[:, body.left.upper_leg] - local[:, body.right.upper_leg]
    hips = float(np.linalg.norm(legs, axis=1).mean())
    beyond = local[:, body.left.foot, 1] - local[:, body.right.foot, 1] - hips
    return hips + np.sign(beyond) * np.maximum(np.abs(beyond) - _STEP_SECONDS * sideways, 0.0)


def _compute_direction(local: np.ndarray, start: int, end: int) -> np.ndarray:
    """Compute the unit vectors (T, 3) from one joint to another."""
    bone = local[:, end] - local[:, start]
    return bone / np.maximum(np.linalg.norm(bone, axis=1, keepdims=True), 1e-9)


@dataclass(frozen=True, eq=False)
class NormalPostures:
    """The regions of normal locomotion of a library, one for each class of SPEED_EDGES.

    Attributes:
        regions: class -> (middle (K,), inverse covariance (K, K), radius), only where it has frames enough.
    """

    regions: Mapping[int, tuple[np.ndarray, np.ndarray, float]]

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> "NormalPostures":
        """Build from what `to_arrays` returned."""
        rows = zip(*(arrays[name] for name in ("kinds", "middles", "inverses", "radii")))
        return cls({int(kind): (middle, inverse, float(radius)) for kind, middle, inverse, radius in rows})

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Convert to arrays by name."""
        middles, inverses, radii = ([one[column] for one in self.regions.values()] for column in range(3))
        return {"kinds": np.array(list(self.regions), int), "middles": np.array(middles),
                "inverses": np.array(inverses), "radii": np.array(radii)}

    def measure_strangeness(self, posture: np.ndarray, speed: np.ndarray) -> np.ndarray:
        """Measure how far postures lie from normal locomotion at their speed.

        Args:
            posture: (T, K) of `compute_postures`.
            speed: (T,) m/s.
        Returns:
            (T,) float32: 1 at the end of the region, up to which a frame belongs; 0 where no region
            holds for that speed.
        """
        kind, out = np.digitize(speed, SPEED_EDGES), np.zeros(len(posture), np.float32)
        for k in np.unique(kind):
            reference = self._find_reference(int(k))
            if reference is None:
                continue
            middle, inverse, radius = self.regions[reference]
            away = posture[kind == k] - middle
            squared = np.maximum(np.einsum("ij,ij->i", away @ inverse, away), 0.0)
            out[kind == k] = np.sqrt(squared) / (radius + BELONGING)
        return out

    def select_known(self, speed: np.ndarray) -> np.ndarray:
        """Select those of speeds (T,) m/s, as (T,) bool, at which the library knows how people move."""
        known = [self._find_reference(k) is not None for k in range(len(SPEED_EDGES) + 1)]
        return np.array(known)[np.digitize(speed, SPEED_EDGES)]

    def measure_parts(self, posture: np.ndarray, speed: np.ndarray) -> dict[str, tuple[float, np.ndarray]]:
        """Measure how unlike normal locomotion each part of the body is in postures of about one speed.

        Args:
            posture: (T, K) of `compute_postures`.
            speed: (T,) m/s.
        Returns:
            Part of PARTS -> how far its mean squared Mahalanobis distance lies above what is expected, in standard
            deviations, and its mean offset (k,) from the region's middle; empty where no region holds for any of them.
        """
        kinds = np.digitize((np.mean(speed), *speed), SPEED_EDGES)  # where the mean has no reference, a part may have
        reference = next((one for k in kinds if (one := self._find_reference(int(k))) is not None), None)
        if reference is None:
            return {}
        middle, inverse, _ = self.regions[reference]
        away, covariance, found = posture - middle, np.linalg.inv(inverse), {}
        for part, columns in PARTS.items():
            own = away[:, columns]
            count = own.shape[1]
            if count:
                squared = np.einsum("ij,ij->i", own @ np.linalg.inv(covariance[columns, columns]), own)
                found[part] = (float(squared.mean() - count) / np.sqrt(2.0 * count), own.mean(axis=0))
        return found

    def _find_reference(self, kind: int) -> int | None:
        """Find the class with whose region a class is compared: itself, or else the next faster one of the same gait;
        None without one.

        A walk's region calls all runs strange, a stand's all walks, and a jog's two thirds of the frames of sprints.
        """
        fastest = _WALKING_CLASS if kind <= _WALKING_CLASS else len(SPEED_EDGES)
        return min((other for other in self.regions if kind <= other <= fastest), default=None)


def select_calm_postures(posture: np.ndarray) -> np.ndarray:
    """Select the postures (T, K) that are calm standing or walking for anybody: upright, with arms hanging.

    Returns:
        (T,) bool; arms and trunk count only where the skeleton has both arms.
    """
    calm = posture[:, 0] > _CALM_HIPS
    if posture.shape[1] < PARTS["hands"].stop:
        return calm
    up = posture[:, PARTS["arms"]].reshape(-1, 2, 2, 3)[..., 2].max(axis=1)
    trunk = posture[:, PARTS["trunk"].stop - 1]
    return calm & (trunk > _CALM_TRUNK) & (up[:, 0] < _CALM_UPPER_ARM) & (up[:, 1] < _CALM_FOREARM)


def find_falls(height: np.ndarray, fps: float, least: float) -> np.ndarray:
    """Find the frames (T,) bool from which on the hips fall by more than `least` within FALL_SECONDS.

    Args:
        height: (T,) of the hips, in the unit of `least`.
        fps: frames per second.
        least: the greatest fall that is usual.
    """
    falling = np.zeros(len(height), dtype=bool)
    for step in range(1, min(int(round(FALL_SECONDS * fps)), len(height) - 1) + 1):
        falling[:-step] |= height[:-step] - height[step:] > least
    return falling


def measure_falls(frames, fps: float) -> np.ndarray:
    """Measure the strangeness (N,) float32 of hips that fall: that of the whole fall, 0 elsewhere.

    To leave out the rise before it too makes takes no better: on two slices of a match the pelvis drops 0.75 and 0.51
    times a minute instead of 0.75 and 0.45.

    Args:
        frames: the library's frames, N of them.
        fps: of the frames.
    """
    out, reach = np.zeros(len(frames.posture), np.float32), int(round(FALL_SECONDS * fps))
    for first, count in zip(frames.first, frames.count):
        part = slice(first, first + count)
        falling = find_falls(frames.posture[part, 0], fps, FALL_HEIGHT / LEG_LENGTH)
        out[part] = _FALLING * compute_running_maximum(falling, reach, 0)
    return out


def fit_normal_postures(frames, is_recorded: np.ndarray, fps: float) -> NormalPostures:
    """Learn the regions of normal locomotion from a library's frames without an action's label.

    Args:
        frames: the library's frames, N of them.
        is_recorded: (N,) bool, frames of recordings.
        fps: of the frames.
    """
    actions = [i for i, word in enumerate(frames.vocabulary) if word in DISCRETE]
    is_learned = is_recorded & ~frames.words[:, actions].any(axis=1)
    kind, is_steady = np.digitize(frames.speed, SPEED_EDGES), find_steady_travel(frames, fps)
    regions: dict[int, _Region] = {}
    for k in reversed(range(len(SPEED_EDGES) + 1)):
        postures = frames.posture[is_learned & (kind == k)]
        seed = frames.posture[is_learned & is_steady & (kind == k)]
        faster = regions.get(k + 1) if k < _WALKING_CLASS else None
        region = _fit_region(_sample(postures), _sample(seed), faster)
        if region is not None:
            regions[k] = region
    return NormalPostures({k: (one.middle, one.inverse, one.radius) for k, one in regions.items()})


def find_steady_travel(frames, fps: float) -> np.ndarray:
    """Find the frames (N,) bool in which a body travels forward at one speed and nearly straight for a while."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    found, count = np.zeros(len(frames.speed), bool), int(_STEADY_SECONDS * fps)
    forward = frames.velocity[:, 0] / np.maximum(frames.speed, 1e-6)
    for first, length in zip(frames.first, frames.count):
        if length >= count:
            part = slice(first, first + length)
            speed, heading = frames.speed[part], frames.heading[part]
            low, high = minimum_filter1d(speed, count), maximum_filter1d(speed, count)
            turn = maximum_filter1d(heading, count) - minimum_filter1d(heading, count)
            is_middle = (low > _STEADY_SPEED) & (high - low < _STEADY_RANGE * high) & (turn < _STEADY_TURN)
            found[part] = maximum_filter1d(is_middle & (minimum_filter1d(forward[part], count) > _FORWARD), count)
    return found


@dataclass(frozen=True, eq=False)
class _Region:
    """A Gaussian of postures: middle (K,), inverse covariance (K, K), radius, and the postures (M, K) of its core."""

    middle: np.ndarray
    inverse: np.ndarray
    radius: float
    core: np.ndarray

    @classmethod
    def from_core(cls, core: np.ndarray) -> "_Region":
        """Fit the Gaussian of a core; its radius is that of its nearest 60 %."""
        middle = core.mean(axis=0)
        least = _LEAST_VARIANCE + _VARIANCE_OF_FEW / len(core)
        inverse = np.linalg.inv(np.cov(core.T) + least * np.eye(core.shape[1]))
        region = cls(middle, inverse, 0.0, core)
        return cls(middle, inverse, float(np.sqrt(np.quantile(region.measure_squared(core), _CORE_SHARE))), core)

    def measure_squared(self, postures: np.ndarray) -> np.ndarray:
        """Measure the squared Mahalanobis distances (M,) of postures (M, K)."""
        away = postures - self.middle
        return np.maximum(np.einsum("ij,ij->i", away @ self.inverse, away), 0.0)


def _sample(postures: np.ndarray) -> np.ndarray:
    """Sample at most _SAMPLED of the postures (M, K), evenly."""
    chosen = np.unique(np.linspace(0, len(postures) - 1, _SAMPLED).astype(int)) if len(postures) else slice(0)
    return postures[chosen].astype(float)


def _fit_region(postures: np.ndarray, seed: np.ndarray, faster: _Region | None) -> _Region | None:
    """Fit the region of a class: its postures (M, K), those of steady travel, and the next faster class's region.

    None for too few postures.
    """
    if len(postures) < _FEWEST:
        return None
    has_arms = postures.shape[1] > _ARMS_AND_TRUNK.start
    if len(seed) < _FEWEST and faster is not None and has_arms:
        region = _Region.from_core(_select_similar_arms(postures, faster))
    else:
        region = _concentrate(seed if len(seed) >= _FEWEST else postures)
    for _ in range(_GROWING_ROUNDS):
        near = region.measure_squared(postures) <= (region.radius + _JOINING) ** 2
        if near.sum() < _FEWEST / 2:
            break
        region = _Region.from_core(postures[near])
    return region


def _select_similar_arms(postures: np.ndarray, faster: _Region) -> np.ndarray:
    """Select the postures with arms and trunk as 95 % of another class have them, or the nearest few."""
    arms = _Region.from_core(faster.core[:, _ARMS_AND_TRUNK])
    squared = arms.measure_squared(postures[:, _ARMS_AND_TRUNK])
    limit = np.quantile(arms.measure_squared(arms.core), 0.95)
    return postures[squared <= max(limit, np.sort(squared)[_FEWEST - 1])]


def _concentrate(postures: np.ndarray) -> _Region:
    """Fit the core of postures (M, K) by concentration; its radius is that of the nearest 60 % of all of them."""
    middle = np.median(postures, axis=0)
    spread = np.median(np.abs(postures - middle), axis=0) + np.sqrt(_LEAST_VARIANCE)
    squared = np.sum(((postures - middle) / spread) ** 2, axis=1)
    for number in range(_ROUNDS + _SEED_ROUNDS):
        ordered = np.argsort(squared, kind="stable")[:int(_CORE_SHARE * len(postures))]
        # the ends of a swing are rare: what is not far from the core belongs to it
        is_core = squared <= (np.sqrt(squared[ordered[-1]]) + _JOINING) ** 2 if number >= _ROUNDS else ordered
        region = _Region.from_core(postures[is_core])
        squared = region.measure_squared(postures)
    return replace(region, radius=float(np.sqrt(np.quantile(squared, _CORE_SHARE))))
