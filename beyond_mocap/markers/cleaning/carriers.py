"""Which markers determine where another one is: for each marker its carriers, and its place in their frame.

The clusters of a marker set are often too small for that (Plug-in Gait has two markers on a thigh), so the carriers are
chosen by what the trial shows: pairs whose distance hardly varies, near ones of the same segment before others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from ..frames import RigidFit, rigid_fit, taken_back
from .cluster_shape import Shape, distance_spread, mean_shape, median

_MOST_HELPERS = 5  # carriers of a marker at most
# metres by which distances between carriers may vary; where too few do, the next value is used
_TOLERANCES = (0.012, 0.025, 0.05, 0.1)
_SKIN = 0.01  # metres by which markers of one segment move against each other at most
_FAR = 0.02  # added softness of a pair for its distance, metres per metre
# a frame whose carriers deviate more than this is not trusted: metres, or multiples of the usual deviation
_DEFORMED, _TIMES_USUAL = 0.012, 3.0


@dataclass(frozen=True, eq=False, kw_only=True)
class Carried:
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

    helpers: tuple[int, ...]
    shape: Shape | None
    fit: RigidFit | None
    trusted: np.ndarray
    local: np.ndarray
    place: np.ndarray
    sigma: float

    @property
    def away(self) -> np.ndarray:
        """Distance (T,) metres of the marker from where its carriers predict it; NaN where they cannot."""
        return np.linalg.norm(self.local - self.place, axis=-1)

    @property
    def tolerance(self) -> float:
        """Metres within which the marker may lie from where its carriers predict it."""
        return max(0.025, 4.0 * self.sigma)

    def predicted(self) -> np.ndarray:
        """Predict the marker's place from its carriers, (T, 3) metres, world; NaN where they cannot."""
        if not self.helpers:
            return np.full_like(self.local, np.nan)
        world = np.einsum("tij,j->ti", self.fit.rotation, self.place) + self.fit.shift
        return np.where(self.trusted[:, None], world, np.nan)

    def brought(self, points: np.ndarray) -> np.ndarray:
        """Convert points (T, 3) metres of the world to the carriers' frame; NaN where it is not trusted."""
        if not self.helpers:
            return np.full_like(points, np.nan)
        local = taken_back(self.fit, points[:, None])[:, 0]
        return np.where(self.trusted[:, None], local, np.nan)


def softness(positions: np.ndarray, clusters: Iterable[Sequence[int]] = ()) -> np.ndarray:
    """Measure how much the distance of each pair of markers varies.

    Distant pairs get a little more, since their distance may be constant by chance. Within one of the clusters it
    counts half, and no more than skin moves: the rest is a labelling error.

    Args:
        positions: (T, M, 3) metres.
        clusters: index lists of markers on one segment.
    Returns:
        (M, M) metres.
    """
    distance, soft = distance_spread(positions)
    soft = soft + _FAR * distance
    for cluster in clusters:
        inside = np.ix_(cluster, cluster)
        soft[inside] = np.minimum(0.5 * soft[inside], _SKIN)
    return soft


def carriers(positions: np.ndarray, soft: np.ndarray, wanted: Iterable[int],
             known: Mapping[int, Carried] = MappingProxyType({}), changed: Iterable[int] = (),
             ask: Callable[[], None] = lambda: None) -> dict[int, Carried]:
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
    for marker in wanted:
        ask()
        helpers = helpers_of(marker, soft, positions)
        held = known.get(marker)
        holds = held is not None and held.helpers == helpers
        if holds and not changed & {marker, *helpers}:
            found[marker] = held
        else:
            found[marker] = carried(positions, marker, helpers, held.shape if holds else None)
    return found


def carried(positions: np.ndarray, marker: int, helpers: Sequence[int], shape: Shape | None = None) -> Carried:
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
    alone = Carried(helpers=(), shape=None, fit=None, trusted=np.zeros(frames, dtype=bool), local=nothing,
                    place=np.full(3, np.nan), sigma=np.inf)
    if len(helpers) < 3:
        return alone
    seen = positions[:, list(helpers)]
    shape = shape or mean_shape(seen)
    fit = rigid_fit(shape.places, seen, 1.0 / (shape.sigma**2 + 0.002**2))
    trusted = fit.sound & (np.nan_to_num(fit.rms, nan=np.inf) <= max(_DEFORMED, _TIMES_USUAL * shape.usual))
    local = np.where(trusted[:, None], taken_back(fit, positions[:, marker, None])[:, 0], np.nan)
    there = np.isfinite(local[:, 0])
    if not there.any():
        return alone
    place = np.median(local[there], axis=0)
    sigma = 1.4826 * median(np.linalg.norm(local - place, axis=-1))
    return Carried(helpers=tuple(helpers), shape=shape, fit=fit, trusted=trusted, local=local, place=place, sigma=sigma)


def helpers_of(marker: int, soft: np.ndarray, positions: np.ndarray, most: int = _MOST_HELPERS) -> tuple[int, ...]:
    """Choose markers that keep their distances from a marker and from each other, and are not on one line.

    Args:
        marker: index of the marker.
        softness: (M, M) metres.
        positions: (T, M, 3) metres.
        max_count: maximum number.
    Returns:
        Indices of the carriers; () where fewer than three qualify.
    """
    order = [other for other in np.argsort(soft[marker], kind="stable").tolist() if other != marker]
    for tolerance in _TOLERANCES:
        chosen: list[int] = []
        for other in order:
            if soft[marker, other] > 2.0 * tolerance or len(chosen) == most:
                break
            if len(chosen) >= 3 and soft[marker, other] > 2.0 * soft[marker, chosen[2]] + 0.002:
                break  # a much softer one would rotate the frame more than it stabilises it
            if all(soft[other, one] <= tolerance for one in chosen):
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
