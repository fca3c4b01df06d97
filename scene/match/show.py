"""A stretch of a match in the scene: pitch, everybody in kit, ball and cameras. Shown again, it takes its own place."""

from __future__ import annotations

from time import perf_counter

import bpy
import numpy as np

from .. import bake, pitch, stage
from ..measure import frames_per_second, units_per_metre
from . import baked, cameras, ours
from .bodies import Wardrobe
from .people import Scenery


def show(context: bpy.types.Context, scenery: Scenery, first: int) -> dict[str, float]:
    """Put a stretch of a match into the scene, its start on scene frame `first`; what was shown before goes.

    Returns how many seconds pitch, bodies, keys and cameras took.
    """
    scene, took = context.scene, {}
    looked = scene.camera is None or bool(scene.camera.get(ours.MARK))
    ours.clear(scene)
    last = int(np.floor(baked.frame_of(scene, scenery.start, first, scenery.end) + 1e-4))
    steps = (
        ("pitch", lambda: _pitch(scene, scenery)),
        ("bodies", lambda: _dressed(context, scenery)),
    )
    made = {}
    for name, step in steps:
        began = perf_counter()
        made[name] = step()
        took[name] = perf_counter() - began
    began = perf_counter()
    context.view_layer.update()
    for person, worn in made["bodies"]:
        baked.bake(scene, person, worn, scenery.start, first, last)
    ball = scenery.ball
    thing = baked.bake_ball(context, ball, scenery.start, first, last) if ball is not None else None
    took["keys"] = perf_counter() - began
    began = perf_counter()
    frames = np.arange(first, last + 1)
    camera = cameras.broadcast(scene, (scenery.length, scenery.width), frames, _followed(scene, scenery, frames, first))
    took["cameras"] = perf_counter() - began
    if looked:
        scene.camera = camera
    bake.lengthen(scene, last)
    return took


def ball_shown(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """The ball of the match that is shown; None where there is none."""
    home = ours.part(scene, "ball") if ours.root(scene) is not None else None
    return next((thing for thing in home.objects if thing.type == "MESH" and thing.get(ours.MARK)), None) if home else None


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
        return np.stack([np.interp(seconds, path.times, path.positions[:, axis]) for axis in range(2)], axis=1)
    total, count = np.zeros((len(frames), 2)), np.zeros(len(frames))
    for person in scenery.people:
        for begins, motion in person.motions:
            times = begins + np.arange(len(motion)) / motion.fps
            there = (seconds >= times[0]) & (seconds <= times[-1])
            for axis in range(2):
                total[there, axis] += np.interp(seconds[there], times, motion.root_positions[:, axis])
            count += there
    return total / np.maximum(count, 1.0)[:, None]
