"""Joints whose markers are hidden for a while follow what is solved before and after, not the rest pose."""

from __future__ import annotations

import numpy as np

from ..motion import quaternion
from .chain import Chain, Poses, poses

_NEAR = 2  # a joint is told by its own markers and by those of so many joints below it


def missing(chain: Chain, there: np.ndarray) -> np.ndarray:
    """Of which joints markers are hidden that the recording shows elsewhere: (T, J) bool. there: (T, M) bool."""
    usual = there.any(axis=0)
    out = np.zeros((len(there), len(chain.skeleton)), dtype=bool)
    for marker, joint in enumerate(chain.joint):
        hidden = usual[marker] & ~there[:, marker]
        for _ in range(_NEAR + 1):
            if joint <= 0:
                break
            out[:, joint] |= hidden
            joint = chain.skeleton.parents[joint]
    return out


def between(
    chain: Chain, solved: Poses, known: np.ndarray, told: np.ndarray, frames: np.ndarray
) -> tuple[Poses, np.ndarray]:
    """The poses of `frames` (N,) that lie between solved ones, each joint between those that tell it, and of which
    joints any do: (J,) bool.

    solved: poses of all T frames, of which `known` (K,) count. told: (K, J) bool. Before the first and after the last
    telling frame a joint stays as it is there.
    """
    root = _slid(solved.root[:, known].T, known, frames)
    local = np.empty((len(frames), len(chain.skeleton), 4))
    some = told.any(axis=0)
    for joint in range(len(chain.skeleton)):
        use = known[told[:, joint]] if some[joint] else known
        local[:, joint] = _turned(solved.local[joint][:, use].T, use, frames)
    return poses(chain, root, local), some


def _around(known: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which known frames lie before and after each frame (indices), and how far between."""
    after = np.clip(np.searchsorted(known, frames), min(1, len(known) - 1), len(known) - 1)
    before = np.maximum(after - 1, 0)
    span = np.maximum(known[after] - known[before], 1)
    return before, after, np.clip((frames - known[before]) / span, 0.0, 1.0)


def _slid(places: np.ndarray, known: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Places (K, 3) between those of the known frames: (N, 3)."""
    before, after, part = _around(known, frames)
    return places[before] + part[:, None] * (places[after] - places[before])


def _turned(turns: np.ndarray, known: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Rotations (K, 4) between those of the known frames: (N, 4)."""
    before, after, part = _around(known, frames)
    return quaternion.slerp(turns[before], turns[after], part)
