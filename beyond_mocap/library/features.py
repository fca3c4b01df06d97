"""Every frame of the library as a few numbers: joint positions, velocities and accelerations, reduced by PCA.

Faustino §3.2 takes position, velocity and acceleration of all joints relative to the root, and §3.2.1 reduces them to
the principal components that hold 98 % of the energy. It says neither in which frame nor in which scale. Here they are
in the root's heading frame (a walk north equals a walk east), velocity weighted by 0.12 s and acceleration by half of
0.12 s squared: a distance between features is then in metres, about how far the joints will be apart an eighth of a
second later. Faustino drops each motion's first two frames, which lack derivatives; central differences lose none.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from ..base.time_series import time_derivative
from ..motion import quaternion
from ..motion.humanoid import compute_heading_from_positions, identify_joints
from ..motion.lean import compute_lean_slopes
from ..motion.motion import compute_pose, sample_frames
from ..motion.skeleton import Skeleton
from ..motion.track import smooth_zero_phase_hann
from .posture import compute_postures

FPS = 30.0  # frames per second of every library
HORIZON = 0.12  # seconds: weighs m/s and m/s^2 against metres
ENERGY = 0.98  # share of the variance that the principal components keep
SMOOTH_SECONDS = 0.7  # Hann window that removes the sway from the root's path


@dataclass(frozen=True, eq=False)
class Frames:
    """All clips of a library, one after the other, at the library's rate: N frames.

    Attributes:
        clip: (N,) clip index.
        source: (N,) fractional frame in the clip's own rate.
        first, count: (C,) each clip's first frame and number of frames.
        root: (N, 3) metres.
        heading: (N,) radians, unwrapped within a clip.
        path: (N, 2) metres, the root on the ground without its sway (zero-phase Hann of 0.7 s).
        velocity: (N, 2) of that path, m/s, in the heading frame (x forward, y left).
        feet: (N, 4) metres from the path to the left and the right toe (ankle where there is none), heading frame.
        jerk: (N,) m/s^3 of the joint that has most, from the third difference around each frame.
        lean: (N, 2) how far the body leans ahead and to the left of its travel, as a slope, over the stances around.
        features: (N, D) float32, metres.
        posture: (N, K) float32, see `posture.compute_postures`.
        mean, basis: (K,) and (K, D), which convert raw features.
        words: (N, V) bool, one column per label of `vocabulary`.
        vocabulary: V labels.
    """

    clip: np.ndarray
    source: np.ndarray
    first: np.ndarray
    count: np.ndarray
    root: np.ndarray
    heading: np.ndarray
    path: np.ndarray
    velocity: np.ndarray
    feet: np.ndarray
    jerk: np.ndarray
    lean: np.ndarray
    features: np.ndarray
    posture: np.ndarray
    mean: np.ndarray
    basis: np.ndarray
    words: np.ndarray
    vocabulary: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.clip)

    @property
    def remaining_in_clip(self) -> np.ndarray:
        """(N,) frames that follow in the same clip."""
        return (self.first + self.count)[self.clip] - 1 - np.arange(len(self))

    @cached_property
    def speed(self) -> np.ndarray:
        """(N,) speed of the path without sway, m/s."""
        return np.linalg.norm(self.velocity, axis=1)

    def find_nearest(self, clip: int, frame: float, fps: float) -> int:
        """Find the frame nearest to a place in a clip, its last one at most.

        Args:
            clip: index of the clip.
            frame: fractional frame of the clip at its own rate.
            fps: that rate, frames per second.
        Returns:
            Index of the library's frame.
        """
        return int(self.first[clip]) + min(int(frame / fps * FPS + 0.5), int(self.count[clip]) - 1)


def select_feature_joints(skeleton: Skeleton) -> np.ndarray:
    """Select the joints of the features: all but those that coincide with their parent and the fingers beyond the
    hands.
    """
    body = identify_joints(skeleton)
    hands = {limb.hand for limb in (body.left, body.right) if limb.hand is not None}
    fingers: set[int] = set()
    for joint, parent in enumerate(skeleton.parents):
        if parent in hands or parent in fingers:
            fingers.add(joint)
    lengths = np.linalg.norm(skeleton.offsets, axis=1)
    return np.array([j for j in range(len(skeleton)) if j not in fingers and (j == 0 or lengths[j] > 1e-4)])


def compute_raw_features(positions: np.ndarray, heading: np.ndarray, fps: float) -> np.ndarray:
    """Compute one clip's features before PCA.

    The root's own position is left out except for its height (Faustino: "the position being the world center"). Divided
    by the square root of K, so that a distance is the root mean square over joints.

    Args:
        positions: (T, K, 3) joint positions, metres, world, the root first.
        heading: (T,) radians.
        fps: frames per second.
    Returns:
        (T, 9 K - 2), metres.
    """
    velocity = time_derivative(positions, fps)
    acceleration = time_derivative(velocity, fps)
    relative = positions.copy()
    relative[:, :, :2] -= positions[:, :1, :2]
    rotation = quaternion.from_up_angle(-heading)[:, None]
    parts = [
        quaternion.rotate(rotation, relative),
        quaternion.rotate(rotation, velocity) * HORIZON,
        quaternion.rotate(rotation, acceleration) * (0.5 * HORIZON**2),
    ]
    flat = np.concatenate([part.reshape(len(part), -1) for part in parts], axis=1)
    return flat[:, 2:] / np.sqrt(positions.shape[1])


def reduce_to_principal_components(
    values: np.ndarray, energy: float = ENERGY
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Reduce values to the fewest principal components that hold a share of the variance.

    The largest arrays of a library go through here, so `values` are overwritten: a copy would double the memory.

    Args:
        values: (N, K); their mean is subtracted in place.
        energy: the share.
    Returns:
        Mean (K,), basis (K, D), and the reduced values (N, D).
    """
    mean = values.mean(axis=0)
    values -= mean
    covariance = values.T @ values
    variance, vectors = np.linalg.eigh(covariance.astype(float))
    variance, vectors = np.maximum(variance[::-1], 0.0), vectors[:, ::-1]
    count = int(np.searchsorted(np.cumsum(variance), energy * variance.sum())) + 1
    basis = vectors[:, :count].astype(values.dtype)
    return mean, basis, values @ basis


def build_frames(clips, reference: Frames | None = None, on_clip: Callable[[int], None] | None = None,
                 keeps_columns: bool = False) -> Frames:
    """Build the frames of clips at FPS with all labels that they carry.

    Args:
        clips: of one skeleton (`library.clip`).
        reference: frames whose components are used, so that features of both can be compared; None uses the clips' own.
        on_clip: called with the index of each clip before its frames are built.
        keeps_columns: whether what is built of a clip is kept while it is in use, for the next library that has it.
    Returns:
        The frames.
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1):  # with more threads, sums of products have another order and other bits
        return _build_frames(clips, reference, on_clip or (lambda index: None),
                             _find_columns if keeps_columns else _build_columns)


def _build_frames(clips, reference: Frames | None, on_clip: Callable[[int], None],
                  build_columns: Callable[..., tuple[np.ndarray, ...]]) -> Frames:
    """Build the columns of all clips, each in one array from the start, and reduce their features."""
    skeleton = clips[0].motion.skeleton
    vocabulary = tuple(sorted({word for clip in clips for row in clip.annotations for word in row.words}))
    joints, body = select_feature_joints(skeleton), identify_joints(skeleton)
    count = np.array([count_frames(clip.motion, FPS) for clip in clips])
    first = np.cumsum(count) - count
    merged: dict[str, np.ndarray] = {}
    for index, clip in enumerate(clips):
        on_clip(index)
        rows = slice(first[index], first[index] + count[index])
        columns = build_columns(clip, joints, body)
        columns = (np.full(count[index], index), *columns, build_label_matrix(clip, columns[0], vocabulary))
        for name, column in zip(_COLUMNS, columns):
            if not index:
                merged[name] = np.empty((count.sum(), *column.shape[1:]), column.dtype)
            merged[name][rows] = column
    if reference is not None:
        mean, basis = reference.mean, reference.basis
        merged["features"] = (merged["features"] - mean) @ basis
    else:
        mean, basis, merged["features"] = reduce_to_principal_components(merged["features"])
    return Frames(first=first, count=count, mean=mean, basis=basis, vocabulary=vocabulary, **merged)


_built_columns: WeakKeyDictionary[Any, tuple[np.ndarray, ...]] = WeakKeyDictionary()


def _find_columns(clip, joints: np.ndarray, body) -> tuple[np.ndarray, ...]:
    """Find the columns of a clip that is appended to many libraries: they are built once."""
    if clip not in _built_columns:
        _built_columns[clip] = _build_columns(clip, joints, body)
    return _built_columns[clip]


def _build_columns(clip, joints: np.ndarray, body) -> tuple[np.ndarray, ...]:
    """Build the columns of one clip, in the order of `_COLUMNS` without `clip` and `words`; features before PCA."""
    skeleton, toes = clip.motion.skeleton, [body.left.toe_or_foot, body.right.toe_or_foot]
    source, positions = sample_positions(clip.motion, FPS)
    facing = np.unwrap(compute_heading_from_positions(skeleton, positions))
    path = smooth_zero_phase_hann(positions[:, 0, :2], FPS, SMOOTH_SECONDS)
    return (
        source, positions[:, 0], facing, path,
        quaternion.rotate_level(time_derivative(path, FPS), -facing),
        _compute_feet(positions, toes, path, facing),
        compute_max_jerk(positions, FPS),
        compute_lean_slopes(skeleton, positions, FPS).astype(np.float32),
        compute_raw_features(positions[:, joints], facing, FPS).astype(np.float32),
        compute_postures(positions, facing, FPS, body),
    )  # fmt: skip


def build_label_matrix(clip, source: np.ndarray, vocabulary: tuple[str, ...]) -> np.ndarray:
    """Mark which labels of `vocabulary` a clip carries: (T, V) bool, at fractional frames `source` (T,) of its own
    rate.
    """
    column = {word: i for i, word in enumerate(vocabulary)}
    out = np.zeros((len(source), len(vocabulary)), bool)
    for row in clip.annotations:
        inside = (source >= row.start) & (source <= row.end)
        for word in row.words:
            out[inside, column[word]] = True
    return out


def join_frames(a: Frames, b: Frames) -> Frames:
    """Join the frames of `a` and `b`, which has the components of `a`; clip numbers of `b` continue those of `a`."""
    vocabulary = join_vocabularies(a, b)
    words = np.zeros((len(a) + len(b), len(vocabulary)), bool)
    for frames, rows in ((a, slice(0, len(a))), (b, slice(len(a), None))):
        words[rows, [vocabulary.index(word) for word in frames.vocabulary]] = frames.words
    parts = {
        name: np.concatenate([getattr(a, name), getattr(b, name)])
        for name in ("count", *(column for column in _COLUMNS if column not in ("clip", "words")))
    }
    clip, first = np.append(a.clip, b.clip + len(a.first)), np.append(a.first, b.first + len(a))
    return Frames(clip=clip, first=first, mean=a.mean, basis=a.basis, words=words, vocabulary=vocabulary, **parts)


def join_vocabularies(a: Frames, b: Frames) -> tuple[str, ...]:
    """Join the labels of two libraries' frames, in the order of the columns of `join_frames`."""
    return tuple(sorted({*a.vocabulary, *b.vocabulary}))


def list_frame_arrays(frames: Frames) -> dict[str, np.ndarray]:
    """List the arrays of frames by name: all but their vocabulary."""
    return {field.name: getattr(frames, field.name) for field in fields(frames) if field.name != "vocabulary"}


_COLUMNS = ("clip", "source", "root", "heading", "path", "velocity", "feet", "jerk", "lean", "features", "posture",
            "words")


def _compute_feet(positions: np.ndarray, toes: list[int], path: np.ndarray, facing: np.ndarray) -> np.ndarray:
    """Compute `Frames.feet` (T, 4) m from positions (T, J, 3) m, path (T, 2) m and facing (T,) radians."""
    away = (quaternion.rotate_level(positions[:, toe, :2] - path, -facing) for toe in toes)
    return np.concatenate(list(away), axis=1).astype(np.float32)


def compute_max_jerk(positions: np.ndarray, fps: float) -> np.ndarray:
    """Compute the jerk (T,) m/s^3 of the joint that jerks most.

    It is the third difference from one frame before to two after, constant at the ends.

    Args:
        positions: (T, J, 3) metres, world.
        fps: frames per second.
    Returns:
        (T,).
    """
    if len(positions) < 4:
        return np.zeros(len(positions))
    third = np.diff(positions, 3, axis=0)
    return np.pad(np.sqrt((third**2).sum(axis=-1).max(axis=-1)) * fps**3, (1, 2), mode="edge")


def count_frames(motion, fps: float) -> int:
    """Count the frames of a motion at `fps`."""
    return int(np.floor(motion.duration * fps + 1e-6)) + 1


def sample_positions(motion, fps: float) -> tuple[np.ndarray, np.ndarray]:
    """Sample a motion at `fps`: fractional frames (T,) of its own rate, and joint positions (T, J, 3) m, world."""
    source = np.arange(count_frames(motion, fps)) * (motion.fps / fps)
    root, rotations = sample_frames(motion, source)
    return source, compute_pose(motion.skeleton, root, rotations)[0]
