"""Costs of a cut from one library frame to another: the change of pose, feet that jump, and what the clips do there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .candidate_index import CandidateIndex
from .cost_weights import Term, Weights

YOUNG_SLOTS = 7  # slots after a cut before which another one costs more: 1.9 s, since a person keeps a gait for longer


@dataclass(frozen=True, eq=False)
class BoneDistance:
    """Another distance of poses: the sum of the distances of weighted bones, averaged over frames around the cut.

    Attributes:
        bones: (N, P, 3), weighted, of the library's frames.
        offsets: frames from the cut that are compared, so that what follows and went before counts too.
    """

    bones: np.ndarray
    offsets: tuple[int, ...] = (0,)


class CutCosts:
    """The costs of cuts between N library frames."""

    def __init__(self, index: CandidateIndex, weights: Weights, bone_distance: BoneDistance | None = None):
        """Prepare the costs.

        Args:
            index: of the library's frames.
            weights: cost of each misfit.
            bone_distance: another distance of poses than that of the features.
        """
        self.index, self.frames, self.weights, self.bone_distance = index, index.frames, weights, bone_distance

    def iter_cut_terms(self, ends: np.ndarray, start: np.ndarray) -> Iterator[Term]:
        """Generate the terms of cuts between library frames, by name, each (B, K) or broadcast to it.

        "pose" is the distance of the poses (and comes first); "left" and "cut" grow with the jerk that is left or
        entered, since a transition cannot blend out of the middle of a kick.

        Args:
            ends: (B,) last frame before the cut.
            start: (K,) first frame after it.
        """
        ends, start = self.index.round_frame(ends), self.index.round_frame(start)
        yield "pose", self.compute_pose_cost(ends, start)
        yield "feet", np.float32(self.weights.feet) * self.measure_foot_jump(ends[:, None], start)
        left, entered = self.compute_cut_ends(ends, start)
        yield "left", left[:, None]
        yield "cut", entered + self.compute_recording_change(ends[:, None], start)

    def compute_recording_change(self, ends: np.ndarray, start: np.ndarray) -> np.ndarray:
        """Compute the cost of cuts between library frames, broadcast together, for changing the recording."""
        recording = self.index.recording
        return np.float32(self.weights.other) * (recording.take(ends) != recording.take(start))

    def compute_young_cut_cost(self, age: np.ndarray) -> np.ndarray:
        """Compute what a cut costs (B,) for coming soon after the last one, age (B,) slots ago."""
        return self.weights.young * np.clip((YOUNG_SLOTS - age) / 2.0, 0.0, 1.0)

    def compute_cut_ends(self, ends: np.ndarray, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute the cost (B,) of leaving library frames ends (B,), and (K,) of cutting to start (K,)."""
        left = self.weights.wild * self.index.wild_before[ends]
        entered = self.weights.switch + self.weights.wild * self.index.wild_after[start]
        return left.astype(np.float32), entered.astype(np.float32)

    def compute_pose_cost(self, ends: np.ndarray, start: np.ndarray) -> np.ndarray:
        """Compute the cost (B, K) of the change of pose between library frames ends (B,) and start (K,)."""
        weight = np.float32(self.weights.pose)
        if self.bone_distance is None:
            features = self.frames.features
            return compute_distances(weight * features.take(ends, axis=0), weight * features.take(start, axis=0))
        total = np.zeros((len(ends), len(start)), np.float32)
        for offset in self.bone_distance.offsets:
            a, b = (weight * self.bone_distance.bones[self._offset_frames(frames, offset)] for frames in (ends, start))
            for bone in range(a.shape[1]):
                total += compute_distances(a[:, bone], b[:, bone])
        return total / np.float32(len(self.bone_distance.offsets))

    def _offset_frames(self, frames: np.ndarray, offset: int) -> np.ndarray:
        """Return the library frames (K,) an offset away from others (K,), held at the ends of their clips."""
        clip = self.frames.clip[frames]
        first = self.frames.first[clip]
        return np.clip(frames + offset, first, first + self.frames.count[clip] - 1)

    def measure_foot_jump(self, ends: np.ndarray, start: np.ndarray) -> np.ndarray:
        """Measure how far feet in contact before and after cuts would jump.

        Args:
            ends: library frames before the cuts, any shape.
            start: library frames after them, of a shape that broadcasts with it.
        Returns:
            m, summed over both feet.
        """
        feet, in_contact = self.frames.feet, self.index.is_in_contact  # `take`: rows by index cost ten times as much
        moved = feet.take(ends, axis=0) - feet.take(start, axis=0)
        stay = in_contact.take(ends, axis=0) & in_contact.take(start, axis=0)
        moved *= moved
        apart = np.zeros(moved.shape[:-1], np.float32)
        for foot in (0, 1):
            apart += np.sqrt(moved[..., 2 * foot] + moved[..., 2 * foot + 1]) * stay[..., foot]
        return apart


def compute_distances(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Compute the distances (B, K) between points (B, D) and (K, D)."""
    square = _append_square(a, -2.0, 1) @ _append_square(b, 1.0, 0).T
    return np.sqrt(np.maximum(square, 0.0, out=square), out=square)


def _append_square(points: np.ndarray, scale: float, place: int) -> np.ndarray:
    """Append squared lengths and ones to scaled points, so that one product is |a|^2 + |b|^2 - 2 a b.

    Args:
        points: (K, D).
        scale: of the points, a power of two.
        place: which of the two last columns holds the squares.
    Returns:
        (K, D + 2).
    """
    out = np.empty((len(points), points.shape[1] + 2), points.dtype)
    np.multiply(points, scale, out=out[:, :-2])
    np.einsum("kd,kd->k", points, points, out=out[:, -2 + place])
    out[:, -1 - place] = 1.0
    return out
