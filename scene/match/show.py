"""A stretch of a match in the scene: pitch, everybody in kit, ball and cameras. Shown again, it takes its own place."""

from __future__ import annotations

from contextlib import contextmanager
from time import perf_counter

import bpy
import numpy as np

from ...beyond_mocap.base.time_series import interpolate
from ..core.measure import frames_per_second, units_per_metre
from ..result import bake
from ..stage import pitch, stage
from . import baked, cameras, ours
from .bodies import Wardrobe
from .people import Scenery


def show(context: bpy.types.Context, scenery: Scenery, first: int) -> dict[str, float]:
    """Put a stretch of a match into the scene, its start on scene frame `first`; what was shown before goes.

    Returns how many seconds pitch, bodies, keys and cameras took.
    """
    scene, took = context.scene, {}
    ours.clear(scene)
    ours.include(context.view_layer)
    last = int(np.floor(baked.frame_of(scene, scenery.start, first, scenery.end) + 1e-4))
    with _clock(took, "pitch"):
        _pitch(scene, scenery)
    with _clock(took, "bodies"):
        dressed = _dressed(context, scenery)
    with _clock(took, "keys"):
        for person, worn in dressed:
            baked.bake(scene, person, worn, scenery.start, first, last)
        if scenery.ball is not None:
            baked.bake_ball(context, scenery.ball, scenery.start, first, last)
    with _clock(took, "cameras"):
        frames, size = np.arange(first, last + 1), (scenery.length, scenery.width)
        camera = cameras.broadcast(scene, size, frames, _followed(scene, scenery, frames, first))
    if scene.camera is None:  # nobody's, or one of those that have just gone
        scene.camera = camera
    bake.lengthen(scene, last)
    return took


@contextmanager
def _clock(took: dict[str, float], name: str):
    """Write down how many seconds a step takes."""
    began = perf_counter()
    yield
    took[name] = perf_counter() - began


def ball_shown(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """The ball of the match that is shown; None where there is none."""
    return next(iter(ours.meshes(scene, "ball")), None)


def _pitch(scene: bpy.types.Scene, scenery: Scenery) -> None:
    """Grass, lines, goals and daylight; the "Stage" of single players stands aside while a match is shown."""
    stage.remove(scene)
    home, units, size = ours.part(scene, "pitch"), units_per_metre(scene), (scenery.length, scenery.width)
    for thing in (pitch.grass(home, units, size), pitch.lines(home, units, size), *pitch.goals(home, units, size[0])):
        ours.mark(thing)
    ours.mark(stage.sun(home))
    if scene.world is None:
        scene.world = stage.sky()


def _dressed(context: bpy.types.Context, scenery: Scenery):
    """Everybody with what he wears."""
    wardrobe = Wardrobe(context, scenery.colours)
    return [(person, wardrobe.dress(person, ours.part(context.scene, person.team))) for person in scenery.people]


def _followed(scene: bpy.types.Scene, scenery: Scenery, frames: np.ndarray, first: int) -> np.ndarray:
    """(F, 2) m of what the stand's camera follows: the ball, or else the middle of everybody."""
    seconds = scenery.start + (frames - first) / frames_per_second(scene)
    if scenery.ball is not None:
        path = scenery.ball
        return interpolate(seconds, path.times, path.positions[:, :2])
    total, count = np.zeros((len(frames), 2)), np.zeros(len(frames))
    for person in scenery.people:
        for begins, motion in person.motions:
            times = begins + np.arange(len(motion)) / motion.fps
            there = (seconds >= times[0]) & (seconds <= times[-1])
            for axis in range(2):
                total[there, axis] += np.interp(seconds[there], times, motion.root_positions[:, axis])
            count += there
    return total / np.maximum(count, 1.0)[:, None]
