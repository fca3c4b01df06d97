"""The numbers of a BVH file as positions and rotations of joints, in the core's axes."""

from __future__ import annotations

import numpy as np

from .bvh_text import POSITIONS, ROTATIONS, BvhText

# file axis -> core axis and sign of a rotation about it; Y up becomes Z up by a quarter turn about X
AXES = {"Y": {"X": (0, 1.0), "Y": (2, 1.0), "Z": (1, -1.0)}, "Z": {"X": (0, 1.0), "Y": (1, 1.0), "Z": (2, 1.0)}}


class BvhChannels:
    """A file's numbers joint by joint, in core axes and metres.

    Attributes:
        text: the file's content.
        unit: metres per file unit.
        up: the file's up axis, "Y" or "Z".
    """

    def __init__(self, text: BvhText, unit: float, up: str):
        self.text, self.unit, self.up = text, unit, up
        self.first = np.concatenate([[0], np.cumsum([len(c) for c in text.channels])])

    def find_columns(self, joint: int, kind: tuple[str, ...]) -> list[tuple[str, int]]:
        """Find axis letters and columns of a joint's channels of one kind, in their order."""
        return [(c[0], self.first[joint] + i) for i, c in enumerate(self.text.channels[joint]) if c in kind]

    def compute_position(self, joint: int) -> np.ndarray:
        """Compute the joint's position relative to its parent: (T, 3) m with position channels, else (1, 3)."""
        positions = self.text.offsets[joint][None]
        columns = self.find_columns(joint, POSITIONS)
        if columns:
            positions = np.repeat(positions, len(self.text.values), axis=0)
            for letter, column in columns:
                positions[:, "XYZ".index(letter)] = self.text.values[:, column]
        return from_file_axes(positions, self.up) * self.unit

    def compute_rotation(self, joint: int) -> np.ndarray:
        """Compute the joint's rotation relative to its parent, components first: (4, T)."""
        return compute_rotations(self.text.values, self.find_columns(joint, ROTATIONS), self.up)


def from_file_axes(vectors: np.ndarray, up: str) -> np.ndarray:
    """Convert vectors from a file's axes to the core's.

    Args:
        vectors: (..., 3) in the file's axes.
        up: the file's up axis, "Y" or "Z".
    Returns:
        (..., 3), Z up.
    """
    return vectors[..., (0, 2, 1)] * (1.0, -1.0, 1.0) if up == "Y" else vectors


def compute_rotations(values: np.ndarray, columns: list[tuple[str, int]], up: str) -> np.ndarray:
    """Compute a joint's rotations in core axes from its rotation channels.

    Intrinsic, in the channels' order, degrees. The rotations are multiplied in closed form: each has two non-zero
    components only.

    Args:
        values: (T, C) the file's numbers.
        columns: axis letter and column of each rotation channel.
        up: the file's up axis, "Y" or "Z".
    Returns:
        (4, T), components first.
    Source: Faustino 2016, section 4.2.1, equations (30) and (31).
    """
    out = np.zeros((4, len(values)))
    out[0] = 1.0
    columns = [(letter, column) for letter, column in columns if values[:, column].any()]  # many channels are all zero
    if not columns:
        return out
    numbers = [column for _, column in columns]
    neighbours = values[:, min(numbers) : max(numbers) + 1].T  # a slice: selecting single columns is much slower
    half = neighbours[np.array(numbers) - min(numbers)] * (np.pi / 360.0)
    cosines, sines = np.cos(half), np.sin(half)
    for (letter, _), c, s in zip(columns, cosines, sines):
        axis, sign = AXES[up][letter]
        # Quaternion product with (c, s on axis k): the axes i, j follow k cyclically.
        s = s * sign
        k, i, j = 1 + axis, 1 + (axis + 1) % 3, 1 + (axis + 2) % 3
        w, vk, vi, vj = out[0], out[k], out[i], out[j]
        out[[0, k, i, j]] = w * c - vk * s, vk * c + w * s, vi * c + vj * s, vj * c - vi * s
    return out
