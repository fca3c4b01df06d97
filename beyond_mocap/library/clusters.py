"""Blocks of frames grouped into clusters, so that a search first compares a hundred representatives (Faustino §3.2).

A block of B frames starts at every frame of a clip that has B frames left. Its position is the augmented feature
vector: the frames' features, one after the other. Eight frames of each block (every fourth of 32, every second of 16,
all of 8) and the principal components with 98 % of the blocks' variance go into k-means: neighbouring frames carry the
same information, and the clusters come out within a percent of those in all dimensions in a tenth of the time.
"""

from __future__ import annotations

import io
import warnings
from collections.abc import Mapping
from contextlib import redirect_stderr
from dataclasses import dataclass

import numpy as np

from ..base.optional_packages import import_optional
from .features import Frames, reduce_to_principal_components

BLOCK_LENGTHS = (32, 16, 8)
CLUSTERS = 100
SAMPLES_PER_BLOCK = 8
MAX_FITTED = 20000  # blocks that k-means is fitted to; the others are only assigned
_ARRAYS = ("start", "label", "medoid")


@dataclass(frozen=True, eq=False)
class Clusters:
    """Clusters of the blocks of one length.

    Attributes:
        length: frames of a block.
        start: (M,) first frame of each block.
        label: (M,) its cluster.
        medoid: (K,) the block (index into `start`) nearest to each cluster's centre, which represents the cluster (the
            paper's representative frame block).
    """

    length: int
    start: np.ndarray
    label: np.ndarray
    medoid: np.ndarray

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Return the arrays by name, which `from_arrays` takes."""
        return {f"{name}_{self.length}": getattr(self, name) for name in _ARRAYS}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray], length: int) -> Clusters:
        """Build the clusters of one length from what `to_arrays` returned."""
        return cls(length, *(arrays[f"{name}_{length}"] for name in _ARRAYS))

    def label_at(self, frame: int) -> int:
        """Return the cluster of the block that starts at `frame`, or -1 where none starts."""
        place = int(np.searchsorted(self.start, frame))
        return int(self.label[place]) if place < len(self.start) and self.start[place] == frame else -1


def find_block_starts(frames: Frames, length: int) -> np.ndarray:
    """Find the first frames of all blocks of `length` frames that lie within one clip."""
    return np.flatnonzero(frames.remaining_in_clip >= length - 1)


def cluster_blocks(frames: Frames, length: int, seed: int = 0) -> Clusters:
    """Cluster all blocks of one length by k-means.

    Args:
        frames: of the library.
        length: frames of a block.
        seed: of k-means.
    Returns:
        100 clusters (fewer of fewer blocks); empty where no block fits.
    Raises:
        InputError: if scikit-learn cannot be imported.
    Source: Faustino 2016, section 3.2.
    """
    import_optional("sklearn.cluster", "block search")
    start = find_block_starts(frames, length)
    if not len(start):
        nothing = np.zeros(0, int)
        return Clusters(length, nothing, nothing, nothing)
    step = max(1, length // SAMPLES_PER_BLOCK)
    offsets = np.arange(0, length, step)
    blocks = frames.features[start[:, None] + offsets].reshape(len(start), -1)
    points = reduce_to_principal_components(blocks)[2]
    del blocks  # the largest array of a build
    label, medoid = _run_kmeans(points, min(CLUSTERS, len(start)), seed)
    return Clusters(length, start, label, medoid)


def _count_cores_quietly() -> None:
    """Have joblib count the cores, for scikit-learn; where it finds none, it prints a warning with stack lines, once.

    LOKY_MAX_CPU_COUNT would only silence it with fewer than all cores.
    """
    from joblib import cpu_count

    with warnings.catch_warnings(), redirect_stderr(io.StringIO()):
        warnings.simplefilter("ignore")
        cpu_count(only_physical_cores=True)


def _run_kmeans(points: np.ndarray, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Run k-means: labels (M,) and the point nearest to each centre (count,); empty clusters are dropped.

    One thread only: with more, scikit-learn adds partial sums in the order threads finish, and the bits differ.
    """
    from sklearn.cluster import KMeans
    from sklearn.exceptions import ConvergenceWarning
    from threadpoolctl import threadpool_limits

    _count_cores_quietly()
    step = -(-len(points) // MAX_FITTED)
    with threadpool_limits(limits=1), warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # fewer different blocks than clusters give fewer clusters
        fit = KMeans(min(count, len(points[::step])), n_init=1, max_iter=60, tol=1e-3, random_state=seed)
        fit.fit(points[::step])
        label = fit.labels_ if step == 1 else fit.predict(points)
    parts = (slice(low, low + MAX_FITTED) for low in range(0, len(points), MAX_FITTED))
    distance = np.concatenate([np.sum((points[part] - fit.cluster_centers_[label[part]]) ** 2, axis=1)
                               for part in parts])
    # sorted by label, then distance: the first of each label is its medoid
    order = np.lexsort((distance, label))
    used, first = np.unique(label[order], return_index=True)
    return np.searchsorted(used, label), order[first]
