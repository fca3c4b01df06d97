"""How near each pose is to a recorded pose, and how smooth the motion is.

A pose is its joints' positions and 0.12 s of their velocity, in the frame of the body's heading with its origin on the
ground below the hips (as in the search); distances are root mean squares over joints, in metres.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..base.time_series import time_derivative
from ..library.features import HORIZON, compute_raw_features, select_feature_joints
from ..motion import quaternion
from ..motion.humanoid import Humanoid, compute_heading_from_positions, identify_joints
from ..motion.motion import Motion
from ..motion.skeleton import Skeleton
from ..synthesis.quality import movement
from ..synthesis.quality.movement import classify_speed

FEWEST_RECORDINGS = 3
"""Recordings that a speed class needs, so that with one's own left out two others show how far apart people are."""
_ROWS_AT_ONCE = 512  # rows of distances at once, to limit memory
_FRAMES_AT_ONCE = 1024  # frames of a motion at once, to limit memory: what is computed of them stays in the cache
_PARTS, _ROUNDING = 32, 2e-3  # of a library that are searched in turn; m that a distance in float32 may be off


def compute_local_positions(skeleton: Skeleton, positions: np.ndarray, hips: int) -> np.ndarray:
    """Transform positions to the body's frame: X ahead, Y left, Z up, origin on the ground below the hips.

    Args:
        skeleton: the skeleton, J joints.
        positions: (T, J, 3) m, world frame.
        hips: index of the hips.
    Returns:
        (T, J, 3) m, float32.
    """
    return rotate_about_up(positions - find_ground_point(positions, hips),
                           -compute_heading_from_positions(skeleton, positions))


def find_ground_point(positions: np.ndarray, joint: int) -> np.ndarray:
    """Find the point on the ground below a joint.

    Args:
        positions: (T, J, 3) m, world frame.
        joint: its index.
    Returns:
        (T, 1, 3) m.
    """
    return positions[:, joint, None] * np.array([1.0, 1.0, 0.0])


def rotate_about_up(vectors: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Rotate vectors about Z by one angle per frame.

    Args:
        vectors: (T, J, 3).
        angle: (T,) radians.
    Returns:
        (T, J, 3), float32.
    """
    return quaternion.rotate_about_up(vectors, angle[:, None]).astype(np.float32)


def build_pose_features(skeleton: Skeleton, positions: np.ndarray, fps: float, hips: int) -> np.ndarray:
    """Build features of poses: positions, then 0.12 s of velocity, both divided by sqrt(J).

    Velocities are world velocities rotated into the heading frame, so travel counts. The Euclidean distance of two rows
    is the root mean square over joints.

    Args:
        skeleton: the skeleton, J joints.
        positions: (T, J, 3) m, world frame.
        fps: frames per second.
        hips: index of the hips.
    Returns:
        (T, 6 J) m, float32.
    """
    local = compute_local_positions(skeleton, positions, hips)
    velocities = rotate_about_up(time_derivative(positions, fps),
                                 -compute_heading_from_positions(skeleton, positions)) * HORIZON
    both = np.concatenate([local, velocities], axis=1).reshape(len(positions), -1)
    return both / np.float32(np.sqrt(len(skeleton)))


def mirror_features(features: np.ndarray, body: Humanoid) -> np.ndarray:
    """Compute the features of the mirrored poses: sides exchanged, left and right of the body swapped.

    Args:
        features: (T, 6 J) m.
        body: the skeleton's humanoid joints.
    Returns:
        (T, 6 J) m.
    """
    parts = features.reshape(len(features), 2, -1, 3)[:, :, list(body.mirror)]
    return (parts * np.array([1.0, -1.0, 1.0], dtype=np.float32)).reshape(len(features), -1)


def measure_nearest_distance(
    features: np.ndarray, library: np.ndarray, left_out: np.ndarray | None = None, owner: np.ndarray | None = None
) -> np.ndarray:
    """Measure the distance from each row of features to the nearest row of a library.

    The search is exhaustive, in chunks; |a-b|^2 = |a|^2 - 2ab + |b|^2 loses about 1e-3 m in float32 near zero.

    Args:
        features: (T, D) m.
        library: (N, D) m.
        left_out, owner: (T,), (N,) or None; library rows whose owner equals a row's left_out do not count.
    Returns:
        (T,) m, infinite if no library row counts.
    """
    squares = np.einsum("nd,nd->n", library, library)
    out = np.empty(len(features))
    for start in range(0, len(features), _ROWS_AT_ONCE):
        rows = features[start : start + _ROWS_AT_ONCE]
        squared_distance = rows @ library.T
        squared_distance *= -2.0
        squared_distance += squares
        if left_out is not None:
            squared_distance[left_out[start : start + _ROWS_AT_ONCE, None] == owner] = np.inf
        out[start : start + len(rows)] = squared_distance.min(axis=1) + np.einsum("td,td->t", rows, rows)
    return np.sqrt(np.maximum(out, 0.0))


def split_library(library: np.ndarray) -> list[np.ndarray]:
    """Split a library (N, D) m into parts that are searched in turn, each with every _PARTS-th pose of it."""
    return [np.ascontiguousarray(library[part::_PARTS]) for part in range(min(_PARTS, len(library)))]


def bound_nearest_distance(features: np.ndarray, parts: Sequence[np.ndarray], enough: np.ndarray) -> np.ndarray:
    """Measure the distance from each row of features to the nearest row of a library, as far as it matters.

    A row that is near enough to a pose of one part is not compared with the others.

    Args:
        features: (T, D) m.
        parts: of a library, from `split_library`.
        enough: (T,) m, a distance of which nothing is known but that the nearest row is no farther.
    Returns:
        (T,) m, that of `measure_nearest_distance` or less than `enough`.
    """
    out, left = np.full(len(features), np.inf), np.arange(len(features))
    for part in parts:
        left = left[out[left] >= enough[left] - _ROUNDING]
        if len(left):
            out[left] = np.minimum(out[left], measure_nearest_distance(features[left], part))
    return out


def bound_pose_distance(motion: Motion, positions: np.ndarray, library: np.ndarray, enough: np.ndarray,
                        scale: float) -> np.ndarray:
    """Measure the distance from each pose of a motion to the nearest one of a library, as far as it matters.

    Args:
        motion: T frames on a skeleton of J joints.
        positions: (T, J, 3) m, its joints, world frame.
        library: (N, 6 J) m.
        enough: (T,) m, as for `bound_nearest_distance`.
        scale: stature relative to the library's skeleton.
    Returns:
        (T,) m.
    """
    parts, out, hips = split_library(library), np.empty(len(positions)), identify_joints(motion.skeleton).hips
    for first, end in _iter_spans(len(positions)):
        low, high = max(first - 1, 0), min(end + 1, len(positions))  # velocities need the frames beside
        features = build_pose_features(motion.skeleton, positions[low:high], motion.fps, hips)
        rows = features[first - low : end - low] / scale
        out[first:end] = bound_nearest_distance(rows, parts, enough[first:end])
    return out


def _iter_spans(count: int) -> Iterator[tuple[int, int]]:
    """Iterate over spans (first, end) of _FRAMES_AT_ONCE of so many frames."""
    return ((first, min(first + _FRAMES_AT_ONCE, count)) for first in range(0, count, _FRAMES_AT_ONCE))


def compute_class_p95(values: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Compute the 95th percentile of values in each speed class, with `movement.compute_real_p95`.

    Args:
        values: (M,) m: smoothness of uncut recordings (NaN between clips).
        speed: (M,) m/s.
    Returns:
        (5,) m.
    """
    known = np.isfinite(values)
    return movement.compute_real_p95(values[known], speed[known])


def count_recordings(owner: np.ndarray, speed: np.ndarray, least: int) -> np.ndarray:
    """Count the recordings in each speed class.

    Args:
        owner: (M,) int, recording of each pose.
        speed: (M,) m/s.
        least: poses that a recording needs in a class.
    Returns:
        (5,) int.
    """
    counts = np.zeros((5, owner.max(initial=-1) + 1), dtype=int)
    np.add.at(counts, (classify_speed(speed), owner), 1)
    return np.sum(counts >= least, axis=1)


def compute_pose_limits(distance: np.ndarray, speed: np.ndarray, recordings: np.ndarray) -> np.ndarray:
    """Compute the 95th percentile of leave-one-clip-out distances in each speed class.

    Args:
        distance: (M,) m.
        speed: (M,) m/s.
        recordings: (5,) int, of `count_recordings`.
    Returns:
        (5,) m, NaN in classes with fewer than FEWEST_RECORDINGS: the only recording of a speed is far from all others,
        and a limit that comes from it would let anything pass.
    """
    classes, out = classify_speed(speed), np.full(5, np.nan)
    for k in np.flatnonzero(recordings >= FEWEST_RECORDINGS):
        known = distance[(classes == k) & np.isfinite(distance)]
        out[k] = np.percentile(known, 95) if len(known) else np.nan
    return out


def find_unreal_frames(distance: np.ndarray, speed: np.ndarray, real: np.ndarray) -> np.ndarray:
    """Find the frames whose nearest library pose is farther than the recordings' 95th percentile.

    Args:
        distance: (T,) m to the nearest pose.
        speed: (T,) m/s.
        real: (5,) m, the percentile of each speed class, NaN where it is not known.
    Returns:
        (T,) 1 or 0, NaN where the percentile is not known.
    """
    limit = real[classify_speed(speed)]
    return np.where(np.isfinite(limit), distance > limit, np.nan)


def measure_smoothness(skeleton: Skeleton, positions: np.ndarray, fps: float) -> np.ndarray:
    """Measure the distance between the features of consecutive frames, the curves of Faustino's App. D (§5.2.1).

    Peaks of the curve are what counts. The features are those of Faustino's §3.2: position, velocity and acceleration
    of all joints relative to the root, in the scale of `library.features`. Faustino reduces them by PCA to 98 % of
    their energy, which hardly changes the curve (on a take from five folders of recordings 96 % of its height,
    correlation 0.999). Without that reduction a motion has one curve, whatever library it comes from.

    Args:
        skeleton: the skeleton, J joints.
        positions: (T, J, 3) m, world frame.
        fps: frames per second.
    Returns:
        (T-1,) m.
    """
    joints = select_feature_joints(skeleton)
    heading = np.unwrap(compute_heading_from_positions(skeleton, positions))
    out = np.empty(max(len(positions) - 1, 0))
    for first, end in _iter_spans(len(out)):
        low, high = max(first - 2, 0), min(end + 3, len(positions))  # accelerations need two frames beside
        features = compute_raw_features(positions[low:high, joints], heading[low:high], fps)
        out[first:end] = np.linalg.norm(np.diff(features[first - low : end + 1 - low], axis=0), axis=-1)
    return out
