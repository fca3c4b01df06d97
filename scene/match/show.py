"""Show a section of a match in the scene: pitch, players in kits, ball and cameras. Showing it again replaces it.

Characters have poses on every frame of their stretches, and are hidden outside them.
"""

from __future__ import annotations

from contextlib import contextmanager
from time import perf_counter

import bpy
import numpy as np

from ...beyond_mocap.base.time_series import interpolate
from ...beyond_mocap.motion.track.ball_path import BallPath
from ..core import action, channels
from ..core.measure import frames_per_second, units_per_metre
from ..result import bake
from ..stage import ball, stage
from . import cameras, ours
from .bodies import Wardrobe
from .load import Person, Scenery

SHOWN = "Shown"  # group of curves


def show(context: bpy.types.Context, scenery: Scenery, first: int) -> dict[str, float]:
    """Show a section of a match; what was displayed before is removed.

    Args:
        context: Blender's context.
        section: what to show.
        first: scene frame of its start.
    Returns:
        Seconds that pitch, bodies, keys and cameras took.
    """
    scene, took = context.scene, {}
    ours.clear(scene)
    ours.include(context.view_layer)
    last = int(np.floor(frame_of(scene, scenery.start, first, scenery.end) + 1e-4))
    with _clock(took, "pitch"):
        _pitch(scene, scenery)
    with _clock(took, "bodies"):
        dressed = _dressed(context, scenery)
    with _clock(took, "keys"):
        for person, worn in dressed:
            bake_person(scene, person, worn, start=scenery.start, first=first, last=last)
        if scenery.ball is not None:
            bake_ball(context, scenery.ball, scenery.start, first, last)
    with _clock(took, "cameras"):
        frames, size = np.arange(first, last + 1), (scenery.length, scenery.width)
        camera = cameras.broadcast(scene, size, frames, _followed(scene, scenery, frames, first))
    if scene.camera is None:  # none, or one that has just been removed
        scene.camera = camera
    bake.lengthen(scene, last)
    return took


def ball_shown(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Find the ball of the displayed match; None if there is none."""
    return next(iter(ours.meshes(scene, "ball")), None)


def frame_of(scene: bpy.types.Scene, start: float, first: int, seconds: float) -> float:
    """Compute the scene frame (fractional) of a second on the match's clock, where `start` s is frame `first`."""
    return first + (seconds - start) * frames_per_second(scene)


def bake_person(scene: bpy.types.Scene, person: Person, worn: list[bpy.types.Object], start: float, first: int,
                last: int) -> None:
    """Bake a character's motion to its armature, and hide its objects outside its stretches.

    Args:
        scene: the scene.
        character: who.
        objects: the armature, then its meshes.
        start: s on the match's clock.
        first: scene frame of that time.
        last: last displayed frame.
    """
    who = worn[0]
    parts = [action.keyed(who, motion, scene, frame_of(scene, start, first, begins)) for begins,
             motion in person.motions]
    frames = np.concatenate([frames for frames, _ in parts])
    kept = np.concatenate([[True], np.diff(frames) > 0])  # consecutive stretches may share a frame
    curves = {path: (group, np.concatenate([curves[path][1] for _, curves in parts])[kept]) for path,
              (group, _) in parts[0][1].items()}
    done = channels.animate(who, f"{who.name} match", frames[kept], curves)
    done[action.PLACED] = [number for row in who.matrix_world for number in row]
    ours.mark(done)
    there = np.zeros(last - first + 1, bool)
    there[np.clip(frames.astype(int) - first, 0, last - first)] = True
    if not there.all():
        hide_outside(worn, there, first)


def hide_outside(worn: list[bpy.types.Object], there: np.ndarray, first: int) -> None:
    """Hide objects, in views and renders, on the frames from `first` where `is_present` (F,) is False."""
    turns = np.flatnonzero(np.diff(there.astype(int)))
    at = np.unique(np.concatenate([[0], turns, turns + 1]))
    hidden = np.where(there[at], 0.0, 1.0)[:, None]
    curves = {name: (SHOWN, hidden) for name in ("hide_viewport", "hide_render")}
    for thing in worn[1:]:  # an armature has its own keys, and no surface
        ours.mark(channels.animate(thing, f"{thing.name} shown", first + at, curves))


def bake_ball(context: bpy.types.Context, path: BallPath, start: float, first: int, last: int) -> bpy.types.Object:
    """Bake the ball with its roll, hidden where its trajectory is unknown, and its trajectory as a curve.

    Args:
        context: Blender's context.
        path: the ball path.
        start: s on the match's clock.
        first: scene frame of that time.
        last: last displayed frame.
    Returns:
        The ball.
    """
    scene, home = context.scene, ours.part(context.scene, "ball")
    thing = ours.mark(ball.create(context, "Match ball", home))
    ours.mark(ball.write(thing, path, scene, frame_of(scene, start, first, float(path.times[0]))))
    home.objects.link(ours.mark(_course(scene, path)))
    return thing


@contextmanager
def _clock(took: dict[str, float], name: str):
    """Measure the seconds of a step."""
    began = perf_counter()
    yield
    took[name] = perf_counter() - began


def _pitch(scene: bpy.types.Scene, scenery: Scenery) -> None:
    """Create grass, lines, goals and daylight; the "Stage" of single players is removed while a match is displayed."""
    stage.remove(scene)
    home, units, size = ours.part(scene, "pitch"), units_per_metre(scene), (scenery.length, scenery.width)
    surface = stage.lay_grass(home, units, size), stage.lay_lines(home, units, size)
    for thing in (*surface, *stage.set_goals(home, units, size[0]), stage.sun(home)):
        ours.mark(thing)
    if scene.world is None:
        scene.world = stage.sky()


def _dressed(context: bpy.types.Context, scenery: Scenery):
    """Create all characters with their objects."""
    wardrobe = Wardrobe(context, scenery.colours)
    return [(person, wardrobe.dress(person, ours.part(context.scene, person.team))) for person in scenery.people]


def _followed(scene: bpy.types.Scene, scenery: Scenery, frames: np.ndarray, first: int) -> np.ndarray:
    """Compute what the stand's camera follows, (F, 2) m: the ball, or the mean position of all players."""
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


def _course(scene: bpy.types.Scene, path: BallPath) -> bpy.types.Object:
    """Create the ball's trajectory as a thin curve for the views, hidden at first: a minute of it is hard to read."""
    data = bpy.data.curves.new("Match ball course", "CURVE")
    data.dimensions = "3D"
    line = data.splines.new("POLY")
    line.points.add(len(path.positions) - 1)
    placed = np.ones((len(path.positions), 4), np.float32)
    placed[:, :3] = path.positions * units_per_metre(scene)
    line.points.foreach_set("co", placed.ravel())
    thing = bpy.data.objects.new("Match ball course", data)
    thing.hide_render = thing.hide_select = thing.hide_viewport = True
    return thing
