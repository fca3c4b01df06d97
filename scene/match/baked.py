"""What a match does, as keys: poses on every frame in which somebody is there, and hidden while he is not."""

from __future__ import annotations

import bpy
import numpy as np

from ...beyond_mocap.motion.track.ball_path import BallPath
from ..core import action, channels
from ..core.measure import frames_per_second, units_per_metre
from ..stage import ball
from . import ours
from .people import Person

POSES, SHOWN = "Poses", "Shown"  # groups of curves


def frame_of(scene: bpy.types.Scene, start: float, first: int, seconds: float) -> float:
    """The scene frame (fractional) of a second on the match's clock, where `start` s is frame `first`."""
    return first + (seconds - start) * frames_per_second(scene)


def bake(
    scene: bpy.types.Scene, person: Person, worn: list[bpy.types.Object], start: float, first: int, last: int
) -> None:
    """Let a person's armature (the first of `worn`) move as he does, and everything he wears be hidden outside his
    stretches; `start` s is scene frame `first`, and `last` the last frame that is shown."""
    who = worn[0]
    parts = [
        action.keyed(who, motion, scene, frame_of(scene, start, first, begins)) for begins, motion in person.motions
    ]
    frames = np.concatenate([frames for frames, _ in parts])
    kept = np.concatenate([[True], np.diff(frames) > 0])  # stretches may share a frame
    curves = {
        path: (group, np.concatenate([curves[path][1] for _, curves in parts])[kept])
        for path, (group, _) in parts[0][1].items()
    }
    done = channels.animate(who, f"{who.name} match", frames[kept], curves)
    done[action.PLACED] = [number for row in who.matrix_world for number in row]
    ours.mark(done)
    there = np.zeros(last - first + 1, bool)
    there[np.clip(frames.astype(int) - first, 0, last - first)] = True
    if not there.all():
        hide(worn, there, first)


def hide(worn: list[bpy.types.Object], there: np.ndarray, first: int) -> None:
    """Hide objects, in views and renders, on the frames from `first` on where `there` (F,) is false."""
    turns = np.flatnonzero(np.diff(there.astype(int)))
    at = np.unique(np.concatenate([[0], turns, turns + 1]))
    hidden = np.where(there[at], 0.0, 1.0)[:, None]
    curves = {name: (SHOWN, hidden) for name in ("hide_viewport", "hide_render")}
    for thing in worn[1:]:  # an armature has keys of its own, and no surface
        ours.mark(channels.animate(thing, f"{thing.name} shown", first + at, curves))


def bake_ball(context: bpy.types.Context, path: BallPath, start: float, first: int, last: int) -> bpy.types.Object:
    """The ball with its way and roll, hidden where the path does not reach, and its course as a curve."""
    scene, home = context.scene, ours.part(context.scene, "ball")
    thing = ours.mark(ball.create(context, "Match ball", home))
    ours.mark(ball.write(thing, path, scene, frame_of(scene, start, first, float(path.times[0]))))
    home.objects.link(ours.mark(_course(scene, path)))
    return thing


def _course(scene: bpy.types.Scene, path: BallPath) -> bpy.types.Object:
    """The ball's way as a thin line for the views, hidden at first: a minute of it is a tangle."""
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
