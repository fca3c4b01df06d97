"""A static trial as one frame: its markers averaged after the segments were laid on each other (Fredriksson §5.2.1).

Somebody who stands still breathes and sways. Averaging places would shrink what turns; so each cluster is averaged in
its own technical frame, and the frames against those of the segments they hang on, from the root outwards.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...base.errors import InputError
from ..cleaning.cluster_shape import mean_shape
from ..cleaning.robust import medians, quantile
from ..frames import RigidFit, mean_rotation, placed, rigid_fit, taken_back
from ..trial import MarkerTrial
from .template import PARENTS

# nobody who stands still moves faster than this, m/s (median of the markers over a second)
_STILL = 0.1


def static_frame(
    trial: MarkerTrial, clusters: Mapping[str, Sequence[str]], seconds: float = 2.0
) -> dict[str, np.ndarray]:
    """The markers of a static trial as one frame: label -> (3,) m, NaN for what is never seen in its stillest
    `seconds`.

    clusters: segment (of `template.JOINTS`, others hang on the root) -> labels. Markers of segments with too few for a
    frame of their own are averaged in the frame of the segment they hang on, and markers of no segment by their places.
    Raises InputError where nobody stands still.
    """
    first, end = stillest(trial, seconds)
    part = trial.positions[first:end]
    index = {label: i for i, label in enumerate(trial.labels)}
    groups = {name: [index[label] for label in labels if label in index] for name, labels in clusters.items()}
    out = medians(part) + np.where(np.isfinite(part).any(axis=0), 0.0, np.nan)
    frames, means = _technical_frames(part, groups), {}
    order = [name for name in PARENTS if name in groups] + [name for name in groups if name not in PARENTS]
    for name in order:
        above = _above(name, means)
        if name in frames:
            own = _mean_frame(frames[name], frames.get(above), means.get(above))
            means[name], above = own, name
        if above is None:
            continue
        local = taken_back(frames[above], part[:, groups[name]])
        places = medians(local) + np.where(np.isfinite(local).any(axis=0), 0.0, np.nan)
        laid = placed(means[above], places)
        out[groups[name]] = np.where(np.isfinite(laid), laid, out[groups[name]])
    return {label: out[i] for label, i in index.items()}


def stillest(trial: MarkerTrial, seconds: float = 2.0) -> tuple[int, int]:
    """The frames, first and the one after the last, of the `seconds` in which the most is seen and moves the least.

    Raises InputError where somebody walks even there.
    """
    length = max(1, min(len(trial), int(round(seconds * trial.fps))))
    positions = trial.positions
    step = max(1, int(round(0.1 * trial.fps)))
    moved = np.full(len(trial), np.nan)
    if len(trial) > step:
        speed = np.linalg.norm(positions[step:] - positions[:-step], axis=-1) * trial.fps / step
        moved[: len(speed)] = quantile(speed, 0.5, axis=1)
    seen = trial.seen.sum(axis=1)
    starts = np.unique(np.linspace(0, len(trial) - length, 24).astype(int))
    unrest = [(-round(float(seen[a : a + length].mean())), float(medians(moved[a : a + length]))) for a in starts]
    best = min(range(len(starts)), key=lambda i: unrest[i])
    if unrest[best][1] > _STILL:
        raise InputError(
            trial.name, f"its stillest {length / trial.fps:.1f} s still move at {unrest[best][1]:.2f} m/s",
            "a static trial, in which somebody stands", "choose another, or go without",
        )
    return int(starts[best]), int(starts[best]) + length


def _technical_frames(part, groups):
    """{segment: its frames in the world} of the clusters that determine one in nearly every frame."""
    frames = {}
    for name, group in groups.items():
        if len(group) < 3:
            continue
        shape = mean_shape(part[:, group])
        fit = rigid_fit(shape.places, part[:, group], 1.0 / (shape.sigma**2 + 0.001**2))
        if fit.sound.mean() > 0.5:
            frames[name] = RigidFit(*(np.where(_wide(fit.sound, each), each, np.nan) for each in fit[:3]), fit.sound)
    return frames


def _wide(flags, like):
    """Flags (T,) with as many axes as `like` (T, ...)."""
    return flags.reshape(-1, *[1] * (like.ndim - 1))


def _above(name, means):
    """The nearest segment above with a frame that is averaged already; the first of all where there is none."""
    parent = PARENTS.get(name)
    while parent is not None and parent not in means:
        parent = PARENTS.get(parent)
    return parent if parent is not None else next(iter(means), None)


def _mean_frame(own, above, mean_above):
    """The mean of frames `own`, against the segment `above` and its mean, or in the world where there is none."""
    if above is None:
        return RigidFit(mean_rotation(own.rotation), medians(own.shift), np.zeros(()), np.ones((), dtype=bool))
    turn = np.einsum("tji,tjk->tik", above.rotation, own.rotation)
    shift = taken_back(above, own.shift[:, None])[:, 0]
    rotation = mean_above.rotation @ mean_rotation(turn)
    return RigidFit(rotation, placed(mean_above, medians(shift)[None])[0], np.zeros(()), np.ones((), dtype=bool))
