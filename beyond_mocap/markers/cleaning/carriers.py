"""Which markers tell where another one is: for each marker, some that move with it, and its place in their frame.

The clusters of a marker set are often too small for that (Plug-in Gait has two markers on a thigh), so the helpers are
chosen by what the trial shows: pairs whose distance hardly varies, near ones of the same segment before others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from ..frames import RigidFit, rigid_fit, taken_back
from .cluster_shape import Shape, distance_spread, mean_shape, median

_MOST_HELPERS = 5
# helpers must keep their distances from each other to this, m; where too few do, to the next
_TOLERANCES = (0.012, 0.025, 0.05, 0.1)
_SKIN = 0.01  # the most that markers of one segment move against each other, m
_FAR = 0.02  # what distance adds to how soft a pair is held to be, metres a metre
# a frame made of helpers that deviate more than this is not trusted, m, or than this many times the usual
_DEFORMED, _TIMES_USUAL = 0.012, 3.0


@dataclass(frozen=True, eq=False, kw_only=True)
class Carried:
    """One marker seen from its helpers, over T frames.

    helpers: indices of the markers that carry it, () where none do. shape: theirs. fit: their frame in the world.
    trusted: (T,) bool, where that frame is sound and its helpers lie as usual. local: (T, 3) m, the marker in that
    frame, NaN where it is not seen or the frame not trusted. place: (3,) m, its median. sigma: m, how far it usually is
    from there."""

    helpers: tuple[int, ...]
    shape: Shape | None
    fit: RigidFit | None
    trusted: np.ndarray
    local: np.ndarray
    place: np.ndarray
    sigma: float

    @property
    def away(self) -> np.ndarray:
        """(T,) m: how far the marker is from where its helpers say; NaN where they cannot."""
        return np.linalg.norm(self.local - self.place, axis=-1)

    @property
    def tolerance(self) -> float:
        """Metres within which the marker may lie from where its helpers say."""
        return max(0.025, 4.0 * self.sigma)

    def predicted(self) -> np.ndarray:
        """(T, 3) m: where the helpers say that the marker is; NaN where they cannot."""
        if not self.helpers:
            return np.full_like(self.local, np.nan)
        world = np.einsum("tij,j->ti", self.fit.rotation, self.place) + self.fit.shift
        return np.where(self.trusted[:, None], world, np.nan)

    def brought(self, points: np.ndarray) -> np.ndarray:
        """Points (T, 3) m of the world in the helpers' frame; NaN where it is not trusted."""
        if not self.helpers:
            return np.full_like(points, np.nan)
        local = taken_back(self.fit, points[:, None])[:, 0]
        return np.where(self.trusted[:, None], local, np.nan)


def softness(positions: np.ndarray, clusters: Iterable[Sequence[int]] = ()) -> np.ndarray:
    """(M, M) m: how much each pair's distance varies, a little more for those far apart, which may do so by chance;
    within one of the `clusters` it counts half, and no more than skin moves: the rest is a fault of the labels."""
    distance, soft = distance_spread(positions)
    soft = soft + _FAR * distance
    for cluster in clusters:
        inside = np.ix_(cluster, cluster)
        soft[inside] = np.minimum(0.5 * soft[inside], _SKIN)
    return soft


def carriers(positions: np.ndarray, soft: np.ndarray, wanted: Iterable[int],
             known: Mapping[int, Carried] = MappingProxyType({}), changed: Iterable[int] = (),
             ask: Callable[[], None] = lambda: None) -> dict[int, Carried]:
    """Marker -> how it is carried, for `wanted` markers of positions (T, M, 3) m.

    soft: (M, M) m from `softness`. known: an earlier look, of whose markers a few samples have `changed`: their shapes
    still hold. ask: called for each marker; it may raise."""
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
    """How these helpers carry this marker over the frames of positions (T, M, 3) m; `shape`: theirs, where known."""
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
    """Up to `most` markers that keep their distances from this one and from each other; () where fewer than three do.

    They are not on one line. soft: (M, M) m."""
    order = [other for other in np.argsort(soft[marker], kind="stable").tolist() if other != marker]
    for tolerance in _TOLERANCES:
        chosen: list[int] = []
        for other in order:
            if soft[marker, other] > 2.0 * tolerance or len(chosen) == most:
                break
            if len(chosen) >= 3 and soft[marker, other] > 2.0 * soft[marker, chosen[2]] + 0.002:
                break  # a far softer one would turn the frame more than it steadies it
            if all(soft[other, one] <= tolerance for one in chosen):
                chosen.append(other)
        if len(chosen) >= 3 and _spans_a_plane(positions[:, chosen]):
            return tuple(chosen)
    return ()


def _spans_a_plane(positions):
    """Whether the cluster (T, N, 3) is wider than a tenth of its length, in its middle frame that sees all of it."""
    whole = np.flatnonzero(np.isfinite(positions[..., 0]).all(axis=1))
    if not len(whole):
        return False
    one = positions[whole[len(whole) // 2]]
    size = np.linalg.svd(one - one.mean(axis=0), compute_uv=False)
    return size[1] > 0.1 * size[0]
