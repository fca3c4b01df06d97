"""A rider that keeps clear of bodies that are already moving: it waits a little or goes round, as little as it
takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..files.bvh import bvh
from ..path_editing.apart import Limits, resolved
from ..path_editing.collisions import collisions
from ..path_editing.detour import Change, Follower
from ..path_editing.ride import Ridden, RideSettings, RideSource, ride

_ROUNDS = 3
_HIPS = 0.9  # metres that hips are above the ground, about: only whether bodies are on one floor depends on it


def read_others(paths: Sequence[Path]) -> list[Follower]:
    """The bodies of other recordings, which stay where they are; second 0 is their first frame."""
    motions = [(path.name, bvh.read(path).motion) for path in paths]
    return [
        Follower(name=name, times=np.arange(len(motion)) / motion.fps, places=motion.root_positions - (0.0, 0.0, _HIPS))
        for name, motion in motions
    ]


def clear_of(
    others: list[Follower], distance: float, source: RideSource, path, settings: RideSettings, ground, name: str
) -> tuple[RideSettings, tuple[str, ...]]:
    """`settings` with the delay and the detours that keep the rider `distance` metres from `others`; what was asked of
    it and what could not be mended, one line each. name: of the rider, for the lines."""
    bare, limits = ride(source, path, replace(settings, plant=False), ground), Limits(distance)
    me = replace(_follower(name, bare), path=path, arc=bare.arc, by_arc=settings.by_arc_length)
    for _ in range(_ROUNDS):
        change = resolved([me, *others], limits).changes[0]
        asked = _with(settings, change, bare.motion.fps)
        left = _met([_follower(name, ride(source, path, replace(asked, plant=False), ground)), *others], distance)
        if not left:
            break
        limits = replace(limits, distance=limits.distance + distance - min(hit.gap for hit in left) + 0.01)
    still = (f"still comes within {hit.gap:.2f} m of {others[hit.second - 1].name} at {hit.time:.1f} s" for hit in left)
    return asked, tuple(f"{name} {line}" for line in (*_lines(asked, settings), *still))


def _follower(name: str, ridden: Ridden) -> Follower:
    times = np.arange(len(ridden.motion)) / ridden.motion.fps
    return Follower(name=name, times=times,
                    places=np.column_stack([ridden.motion.root_positions[:, :2], ridden.origin[:, 2]]))


def _with(settings: RideSettings, change: Change, fps: float) -> RideSettings:
    """The settings with a change; riders wait for whole frames."""
    waits = float(np.ceil(round(change.delay * fps, 3)) / fps)
    return replace(settings, delay=settings.delay + waits, detours=change.detours)


def _met(followers: list[Follower], distance: float) -> list:
    """The collisions of the first body with the others."""
    times = np.unique(np.concatenate([follower.times for follower in followers]))
    places = np.stack([follower.at(times) for follower in followers])
    return [hit for hit in collisions(times, places, distance) if hit.first == 0]


def _lines(asked: RideSettings, settings: RideSettings) -> list[str]:
    waits = asked.delay - settings.delay
    return [
        *([f"waits {waits:.2f} s"] if waits else []),
        *(
            f"goes {abs(offset):.2f} m to the {'left' if offset > 0 else 'right'} {arc:.1f} m along the path"
            for arc, _, offset in asked.detours
        ),
    ]
