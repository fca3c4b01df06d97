"""Which markers determine where another one is: for each marker its carriers, and its place in their frame.

The clusters of a marker set are often too small for that (Plug-in Gait has two markers on a thigh), so the carriers are
chosen by what the trial shows: pairs whose distance hardly varies, near ones of the same segment before others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from ..rigid_fit import RigidFit, fit_rigid, to_model_frame
from .cluster_shape import ClusterShape, compute_mean_shape, compute_median, measure_distance_spread

_MAX_CARRIERS = 5  # carriers of a marker at most
# metres by which distances between carriers may vary; where too few do, the next value is used
_TOLERANCES = (0.012, 0.025, 0.05, 0.1)
_MAX_SKIN_MOVEMENT = 0.01  # metres by which markers of one segment move against each other at most
_DISTANCE_SOFTNESS = 0.02  # added softness of a pair for its distance, metres per metre
# a frame whose carriers deviate more than this is not trusted: metres, or multiples of the usual deviation
_MAX_DEFORMATION, _MAX_DEFORMATION_RATIO = 0.012, 3.0


@dataclass(frozen=True, eq=False, kw_only=True)
class CarriedMarker:
    """One marker relative to its carriers, over T frames.

    Attributes:
        carriers: indices of the markers that carry it, () without.
        shape: the carriers' shape.
        fit: the carriers' frame in the world.
        is_trusted: (T,) bool, where that frame is determined and its carriers lie as usual.
        local: (T, 3) metres, the marker in that frame, NaN where not visible or the frame is not trusted.
        place: (3,) metres, its median.
        sigma: metres by which it usually deviates from there.
    """

    carriers: tuple[int, ...]
    shape: ClusterShape | None
    fit: RigidFit | None
    is_trusted: np.ndarray
    local: np.ndarray
    place: np.ndarray
    sigma: float

    @property
    def deviation(self) -> np.ndarray:
        """Distance (T,) metres of the marker from where its carriers predict it; NaN where they cannot."""
        return np.linalg.norm(self.local - self.place, axis=-1)

    @property
    def tolerance(self) -> float:
        """Metres within which the marker may lie from where its carriers predict it."""
        return max(0.025, 4.0 * self.sigma)

    def predict_places(self) -> np.ndarray:
        """Predict the marker's place from its carriers, (T, 3) metres, world; NaN where they cannot."""
        if not self.carriers:
            return np.full_like(self.local, np.nan)
        world = np.einsum("tij,j->ti", self.fit.rotation, self.place) + self.fit.shift
        return np.where(self.is_trusted[:, None], world, np.nan)

    def to_local(self, points: np.ndarray) -> np.ndarray:
        """Convert points (T, 3) metres of the world to the carriers' frame; NaN where it is not trusted."""
        if not self.carriers:
            return np.full_like(points, np.nan)
        local = to_model_frame(self.fit, points[:, None])[:, 0]
        return np.where(self.is_trusted[:, None], local, np.nan)


def measure_softness(positions: np.ndarray, clusters: Iterable[Sequence[int]] = ()) -> np.ndarray:
    """Measure how much the distance of each pair of markers varies.

    Distant pairs get a little more, since their distance may be constant by chance. Within one of the clusters it
    counts half, and no more than skin moves: the rest is a labelling error.

    Args:
        positions: (T, M, 3) metres.
        clusters: index lists of markers on one segment.
    Returns:
        (M, M) metres.
    """
    distance, softness = measure_distance_spread(positions)
    softness = softness + _DISTANCE_SOFTNESS * distance
    for cluster in clusters:
        inside = np.ix_(cluster, cluster)
        softness[inside] = np.minimum(0.5 * softness[inside], _MAX_SKIN_MOVEMENT)
    return softness


def find_carriers(positions: np.ndarray, softness: np.ndarray, markers: Iterable[int],
                  known: Mapping[int, CarriedMarker] = MappingProxyType({}), changed: Iterable[int] = (),
                  check_cancelled: Callable[[], None] = lambda: None) -> dict[int, CarriedMarker]:
    """Find how markers are carried.

    Args:
        positions: (T, M, 3) metres.
        softness: (M, M) metres of `measure_softness`.
        markers: the markers.
        known: an earlier result; its shapes stay valid.
        changed: markers of which some samples changed since.
        check_cancelled: called for each marker; it may raise.
    Returns:
        Marker -> how it is carried.
    """
    found, changed = {}, set(changed)
    for marker in markers:
        check_cancelled()
        helpers = choose_carriers(marker, softness, positions)
        earlier = known.get(marker)
        is_unchanged = earlier is not None and earlier.carriers == helpers
        if is_unchanged and not changed & {marker, *helpers}:
            found[marker] = earlier
        else:
            found[marker] = measure_carried_marker(positions, marker, helpers, earlier.shape if is_unchanged else None)
    return found


def measure_carried_marker(positions: np.ndarray, marker: int, carriers: Sequence[int], shape: ClusterShape
                           | None = None) -> CarriedMarker:
    """Measure how given carriers carry a marker.

    Args:
        positions: (T, M, 3) metres.
        marker: index of the marker.
        carriers: indices of its carriers.
        shape: their shape, where known.
    Returns:
        The marker relative to its carriers; without carriers if there are fewer than three, or they never see it.
    """
    frames = len(positions)
    nothing = np.full((frames, 3), np.nan)
    alone = CarriedMarker(carriers=(), shape=None, fit=None, is_trusted=np.zeros(frames, dtype=bool), local=nothing,
                          place=np.full(3, np.nan), sigma=np.inf)
    if len(carriers) < 3:
        return alone
    seen = positions[:, list(carriers)]
    shape = shape or compute_mean_shape(seen)
    fit = fit_rigid(shape.places, seen, 1.0 / (shape.sigma**2 + 0.002**2))
    trusted = fit.is_determined & (np.nan_to_num(fit.rms, nan=np.inf) <= max(_MAX_DEFORMATION, _MAX_DEFORMATION_RATIO
                                                                             * shape.usual_deformation))
    local = np.where(trusted[:, None], to_model_frame(fit, positions[:, marker, None])[:, 0], np.nan)
    is_known = np.isfinite(local[:, 0])
    if not is_known.any():
        return alone
    place = np.median(local[is_known], axis=0)
    sigma = 1.4826 * compute_median(np.linalg.norm(local - place, axis=-1))
    return CarriedMarker(carriers=tuple(carriers), shape=shape, fit=fit, is_trusted=trusted, local=local, place=place,
                         sigma=sigma)


def choose_carriers(marker: int, softness: np.ndarray, positions: np.ndarray) -> tuple[int, ...]:
    """Choose markers that keep their distances from a marker and from each other, and are not on one line.

    Args:
        marker: index of the marker.
        softness: (M, M) metres.
        positions: (T, M, 3) metres.
    Returns:
        Indices of the carriers; () where fewer than three qualify.
    """
    order = [other for other in np.argsort(softness[marker], kind="stable").tolist() if other != marker]
    for tolerance in _TOLERANCES:
        chosen: list[int] = []
        for other in order:
            if softness[marker, other] > 2.0 * tolerance or len(chosen) == _MAX_CARRIERS:
                break
            if len(chosen) >= 3 and softness[marker, other] > 2.0 * softness[marker, chosen[2]] + 0.002:
                break  # a much softer one would rotate the frame more than it stabilises it
            if all(softness[other, one] <= tolerance for one in chosen):
                chosen.append(other)
        if len(chosen) >= 3 and _spans_a_plane(positions[:, chosen]):
            return tuple(chosen)
    return ()


def _spans_a_plane(positions):
    """Return whether the cluster (T, N, 3) is wider than a tenth of its length, in the middle frame that shows all
    of it.
    """
    whole = np.flatnonzero(np.isfinite(positions[..., 0]).all(axis=1))
    if not len(whole):
        return False
    one = positions[whole[len(whole) // 2]]
    size = np.linalg.svd(one - one.mean(axis=0), compute_uv=False)
    return size[1] > 0.1 * size[0]
