"""A take as a file of Blender's or of its exporters: .blend, .fbx, .glb, .usdc; for the command line.

The take is put into an empty file of its own, at the take's rate, with its armature, body and ball; nothing that is
open is asked for, since a command has nothing open that it could lose.
"""

from __future__ import annotations

from pathlib import Path

import bpy

from ..beyond_mocap.take import Take
from . import action, armature, bake, ball, body, export

NAME = "Player"
SHIRT = (0.75, 0.05, 0.06)


def write(take: Take, out: Path) -> None:
    """Write a take to `out` in the form that its suffix names; beside it first, then renamed."""
    stage(take)
    export.saved(out, EXPORTERS[out.suffix.lower()])


def stage(take: Take) -> None:
    """An empty file with the take in it, first frame 0."""
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    rate = take.motion.fps
    scene.render.fps = max(1, round(rate))
    scene.render.fps_base = scene.render.fps / rate
    scene.frame_start, scene.frame_end = 0, len(take.motion) - 1
    room = bake.collection(scene)
    player = armature.create(bpy.context, take.motion.skeleton, NAME, room)
    body.create(player, NAME, SHIRT, room, scene, take.motion)
    action.write(player, take.motion, scene, 0.0, f"{NAME} take")
    if take.ball is not None:
        first = (float(take.ball.times[0]) - take.start_time) * rate
        ball.write(ball.create(bpy.context, bake.BALL, room), take.ball, scene, first)


def _blend(path: str) -> None:
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True, check_existing=False)


def _by(format: str):
    """The exporter of a format for all that is in the file, axes as Blender's exporters have them."""
    return lambda path: export.EXPORTERS[format](path, "BLENDER", False)


EXPORTERS = {".blend": _blend, ".fbx": _by("FBX"), ".glb": _by("GLB"), ".usdc": _by("USD")}
WRITERS = dict.fromkeys(EXPORTERS, write)
