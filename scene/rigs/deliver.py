"""A take, or a whole match, as a file of Blender's or of its exporters (.blend, .fbx, .glb, .usdc), for the command
line.

It is put into an empty file at its own rate: a take with its armature, body and ball, a match as shown in the scene.
The open file is discarded without asking, since a command has nothing open that it could lose.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import bpy

from ...beyond_mocap.synthesis.take import Take
from ..core import action
from ..match import load, show
from ..result import bake
from ..stage import ball, body
from . import armature, exporters

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...beyond_mocap.files.bvh.bvh_write import JointAboveHips
    from ...beyond_mocap.match.synthesize_match import MatchResult

NAME = "Player"
SHIRT = (0.75, 0.05, 0.06)


def write_result(result: "Take | MatchResult", out: Path,
                 above: "Sequence[JointAboveHips]" = ()) -> tuple[str, ...]:
    """Write a take or a match to `out` in the format of its suffix, completely or not at all.

    Args:
        result: the take or match.
        out: the file.
        above: joints above a take's hips, from the root down.
    Returns:
        Messages about players of a match that could not be shown.
    """
    from ...beyond_mocap.match.synthesize_match import MatchResult  # imports scipy, which is slow

    lines = create_match_scene(result) if isinstance(result, MatchResult) else create_take_scene(result, above)
    with exporters.silence_blender():
        exporters.write_whole_file(out, EXPORTERS[out.suffix.lower()])
    return lines


def create_take_scene(take: Take, above: "Sequence[JointAboveHips]" = ()) -> tuple[str, ...]:
    """Create an empty file with the take in it, first frame 0, and bones above its hips; returns messages."""
    scene = _create_empty_scene(take.motion.fps)
    scene.frame_start, scene.frame_end = 0, len(take.motion) - 1
    collection = bake.find_or_create_collection(scene)
    player = armature.create_armature(bpy.context, take.motion.skeleton, NAME, collection)
    body.create_character(player, NAME, SHIRT, collection=collection, scene=scene, example=take.motion)
    action.write_motion(player, take.motion, scene, 0.0, f"{NAME} take")
    if take.ball is not None:
        first = (float(take.ball.times[0]) - take.start_time) * take.motion.fps
        ball.write_trajectory(ball.create_ball(bpy.context, bake.BALL, collection), take.ball, scene, first)
    armature.add_bones_above(player, above)
    return tuple(f"{joint.name} stands still: only BVH files have its motion" for joint in above if joint.is_moving)


def create_match_scene(result: "MatchResult") -> tuple[str, ...]:
    """Create an empty file with the whole match in it, first frame 0."""
    from ...beyond_mocap.match.folder import read_state

    order, state = result.request, read_state(result.request.out)
    scene = _create_empty_scene(order.fps)
    colours = {team["ground"]: team["colour"] for team in state["teams"]}
    build = {"cache_dir": order.cache, "skeleton": order.skeleton, "seed": order.seed}
    options = load.DisplayRequest(str(order.out), *result.span, (), colours, str(order.library), order.unit, build)
    _, scenery, lines = load.load_section(options, None, lambda fraction, text: None, lambda: False)
    scene.frame_start = scene.frame_end = 0
    show.show_match(bpy.context, scenery, 0)
    return lines


def _create_empty_scene(rate: float) -> bpy.types.Scene:
    """Create an empty file with a frame rate; returns its scene."""
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps = max(1, round(rate))
    scene.render.fps_base = scene.render.fps / rate
    return scene


def _write_blend(path: str) -> None:
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True, check_existing=False)


def _build_exporter(format: str):
    """Build the exporter of a format for everything in the file, axes as in Blender's exporters."""
    return lambda path: exporters.EXPORTERS[format](path, "BLENDER", "ALL")


EXPORTERS = {".blend": _write_blend, ".fbx": _build_exporter("FBX"), ".glb": _build_exporter("GLB"),
             ".usdc": _build_exporter("USD")}
WRITERS = dict.fromkeys(EXPORTERS, write_result)
