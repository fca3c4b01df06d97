"""How alike every two frames of a library are (Ball handling §4 eq. 1), in the form in which the path search asks for
it.

`links` finds the best transition between two given stretches; a player of a passing scene may leave any clip for any
other between his strikes, and weighs how alike the poses are against where he has to go. So the search gets eq. 1's
poses of all frames: positions and velocities of the main bones, the root over the origin and facing X, times their
weights.
"""

from __future__ import annotations

import weakref

import numpy as np

from ..library.library import Library
from . import kept
from .links import BoneWeights, aligned

_known: weakref.WeakKeyDictionary[Library, np.ndarray] = weakref.WeakKeyDictionary()


def alike(library: Library, weights: BoneWeights = BoneWeights()) -> np.ndarray:
    """(N, 12, 3) float32 of the library's N frames: the sum of the distances of two frames' rows is eq. 1, over the sum
    of the usual weights of positions, so that it is about the distance in m of one bone. Kept beside the library's
    cache."""
    scale = sum(BoneWeights().position)
    measure = np.array([*weights.position, *weights.velocity]) / scale
    return bones(library) * measure.astype(np.float32)[:, None]


def bones(library: Library) -> np.ndarray:
    """(N, 12, 3) float32: positions m, then velocities m/s, of `links.BONES` at every frame of the library."""
    if library not in _known:
        arrays = kept.load(library, "bones")
        if arrays is None or len(arrays["bones"]) != len(library.frames):
            arrays = {"bones": _measured(library)}
            kept.save(library, "bones", arrays)
        _known[library] = arrays["bones"]
    return _known[library]


def _measured(library: Library) -> np.ndarray:
    frames = library.frames
    parts = []
    for clip, first, count in zip(library.clips, frames.first, frames.count):
        parts.append(np.concatenate(aligned(clip.motion, frames.source[first : first + count]), axis=1))
    return np.concatenate(parts).astype(np.float32)
