"""How near each pose is to some recorded pose, and how smooth the motion is.

A pose is its joints' places and 0.12 s of their velocity, in the frame of the body's heading with its origin on the
ground below the hips (as the search sees it); distances are root mean squares over joints, in metres.
"""

from __future__ import annotations

import numpy as np

from ..base.time_series import time_derivative
from ..library.features import feature_joints, raw_features
from ..motion import quaternion
from ..motion.humanoid import Humanoid, heading_from_positions
from ..motion.skeleton import Skeleton
from ..synthesis.quality import movement
from ..synthesis.quality.movement import speed_class

VELOCITY_SECONDS = 0.12  # weighs m/s against metres, as `library.features.HORIZON`
_ROWS_AT_ONCE = 512  # of distances, which bounds the memory


def local_positions(skeleton: Skeleton, positions: np.ndarray, hips: int) -> np.ndarray:
    """World positions (T, J, 3) m seen from the body: X ahead, Y left, Z up, origin below the hips on the ground;
    float32."""
    return turned(positions - ground_point(positions, hips), -heading_from_positions(skeleton, positions))


def ground_point(positions: np.ndarray, joint: int) -> np.ndarray:
    """The point on the ground below a joint: positions (T, J, 3) m -> (T, 1, 3) m."""
    return positions[:, joint, None] * np.array([1.0, 1.0, 0.0])


def turned(vectors: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Vectors (T, J, 3) turned about Z by one angle per frame (T,) radians; float32."""
    return quaternion.turned_about_up(vectors, angle[:, None]).astype(np.float32)


def pose_features(skeleton: Skeleton, positions: np.ndarray, fps: float, hips: int) -> np.ndarray:
    """Features (T, 6 J) float32 in metres of world positions (T, J, 3): places, then 0.12 s of velocity, both per
    sqrt(J).

    Velocities are the world's, turned into the heading frame, so travel counts. The Euclidean distance of two rows is
    then the root mean square over joints."""
    places = local_positions(skeleton, positions, hips)
    moves = turned(time_derivative(positions, fps), -heading_from_positions(skeleton, positions)) * VELOCITY_SECONDS
    both = np.concatenate([places, moves], axis=1).reshape(len(positions), -1)
    return both / np.float32(np.sqrt(len(skeleton)))


def mirrored_features(features: np.ndarray, body: Humanoid) -> np.ndarray:
    """The features (T, 6 J) of the mirrored poses: sides exchanged, left of the body becomes right."""
    parts = features.reshape(len(features), 2, -1, 3)[:, :, list(body.mirror)]
    return (parts * np.array([1.0, -1.0, 1.0], dtype=np.float32)).reshape(len(features), -1)


def nearest_distance(
    features: np.ndarray, library: np.ndarray, left_out: np.ndarray | None = None, owner: np.ndarray | None = None
) -> np.ndarray:
    """Distance (T,) m from each row of features (T, D) to the nearest row of library (N, D).

    left_out (T,), owner (N,): where given, library rows whose owner equals a feature row's left_out do not count;
    infinite where none is left. Exhaustive, in chunks; |a-b|^2 = |a|^2 - 2ab + |b|^2 loses about 1e-3 m in float32 near
    zero."""
    squares = np.einsum("nd,nd->n", library, library)
    out = np.empty(len(features))
    for start in range(0, len(features), _ROWS_AT_ONCE):
        rows = features[start : start + _ROWS_AT_ONCE]
        gap = squares - 2.0 * (rows @ library.T)
        if left_out is not None:
            gap[left_out[start : start + _ROWS_AT_ONCE, None] == owner] = np.inf
        out[start : start + len(rows)] = gap.min(axis=1) + np.einsum("td,td->t", rows, rows)
    return np.sqrt(np.maximum(out, 0.0))


def real_p95(values: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """95th percentile (5,) m, by `movement.real_p95`, in each speed class of speed (M,) m/s: of leave-one-clip-out
    distances (M,), infinite where a library has one clip only, or of uncut recordings' smoothness (M,), NaN between
    clips."""
    known = np.isfinite(values)
    return movement.real_p95(values[known], speed[known])


def unreal(distance: np.ndarray, speed: np.ndarray, real: np.ndarray) -> np.ndarray:
    """Frames (T,) bool whose nearest library pose is farther (T,) m than the real p95 (5,) m at their speed (T,)
    m/s."""
    return distance > real[speed_class(speed)]


def smoothness(skeleton: Skeleton, positions: np.ndarray, fps: float) -> np.ndarray:
    """Distance (T-1,) m between the feature vectors of consecutive frames of world positions (T, J, 3) m: the curves of
    Faustino's App. D (§5.2.1), whose peaks are what counts.

    The features are those of his §3.2: position, velocity and acceleration of all joints seen from the root, in the
    scale of `library.features`. He reduces them by PCA to 98 % of their energy, which leaves the curve as it is
    (on a take from five folders of recordings 96 % of its height, correlation 0.999); here nothing is reduced, so that
    a motion has one curve, whatever library it comes from."""
    joints = feature_joints(skeleton)
    facing = np.unwrap(heading_from_positions(skeleton, positions))
    return np.linalg.norm(np.diff(raw_features(positions[:, joints], facing, fps), axis=0), axis=-1)
