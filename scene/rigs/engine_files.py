"""Files for game engines and other programs by presets: one file for each player, or one of the whole scene.

A player's file has objects without rotation and scale, and a root bone that follows on the ground, as engines expect.
The scene's file has everything as Blender shows it, with meshes that move point by point (Alembic) or by bones (USD).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import bpy

from ...beyond_mocap.base.errors import InputError, format_count
from ..characters import player_character
from ..core.settings import find_active_player
from ..match import match_objects
from . import export, exporters


@dataclass(frozen=True)
class EnginePreset:
    """What a program expects.

    Attributes:
        format: of `exporters.SUFFIXES`.
        engine: of `rig.ENGINES`.
        units: of the file for each metre.
        armature_name: of the armature object; None for the player's own.
    """

    format: str
    engine: str
    units: float = 1.0
    armature_name: str | None = None


PRESETS = {
    # Unreal drops a node of this name, so that the root bone is the skeleton's root
    "UNREAL": EnginePreset("FBX", "UNREAL", 100.0, "Armature"),
    "UNITY": EnginePreset("FBX", "UNITY"),
    "GODOT": EnginePreset("GLB", "GODOT"),
    "USD": EnginePreset("USD", "BLENDER"),
    "ALEMBIC": EnginePreset("ABC", "BLENDER"),
}
SCENE_FORMATS = ("USD", "ABC", "GLB")


def list_delivered_rigs(context: bpy.types.Context, who: str) -> list[bpy.types.Object]:
    """List the armatures to deliver, "ACTIVE", "PLAYERS" or "MATCH"; InputError where no match is shown."""
    settings = context.scene.beyond_mocap
    if who == "MATCH":
        found = match_objects.find_armatures(context.scene)
        if not found:
            raise InputError("export", "no match is shown", "a displayed match", "press Show Match first")
        return [body for body in found if body.name in context.view_layer.objects]
    if who == "PLAYERS":
        return [body for player in settings.players
                if player.use and (body := player_character.find_shown_body(player)) is not None]
    player = find_active_player(settings)
    if player is not None and player_character.find_shown_body(player) is not None:
        return [player_character.find_shown_body(player)]
    active = context.object
    return [active] if active is not None and active.type == "ARMATURE" else []


def deliver_players(
    context: bpy.types.Context, rigs: list[bpy.types.Object], folder: Path, preset: str, root: str, meshes: bool = True
) -> list[str]:
    """Write a file for each armature into a folder; files of the same names are replaced.

    Args:
        context: of Blender.
        rigs: armatures that move.
        folder: where the files go.
        preset: of PRESETS.
        root: "SMOOTH" (a root bone follows on the ground), "IN_PLACE" or "KEEP".
        meshes: with the meshes that the armatures move.
    Returns:
        Messages for the user.
    Raises:
        InputError: if an armature does not move or a file cannot be written; none of the files is then half written.
    """
    wanted = PRESETS[preset]
    paths = [folder / f"{name}{exporters.SUFFIXES[wanted.format]}" for name in name_files([rig.name for rig in rigs])]
    options = [export.ExportOptions(path, wanted.format, wanted.engine, root=root, meshes=meshes,
                                    applies_transforms=True, units=wanted.units, armature_name=wanted.armature_name)
               for path in paths]
    for one in options or [export.ExportOptions(folder / "player", wanted.format)]:
        export.check_place(one, rigs)
        if one.path.is_dir():
            raise InputError(one.path, "is a folder", "a name that is free", "choose another folder")
    sampled, messages, manager = export.sample_rigs(context.scene, rigs, None), [], context.window_manager
    manager.progress_begin(0, len(rigs))
    try:
        for number, (rig, one) in enumerate(zip(rigs, options)):
            messages += export.export_sampled(context, [rig], sampled, one)
            manager.progress_update(number + 1)
    finally:
        manager.progress_end()
    return [f"{format_count(len(rigs), 'file')} in {folder}", *dict.fromkeys(messages)]


def deliver_scene(context: bpy.types.Context, path: Path, preset: str) -> list[str]:
    """Write everything visible in the scene to one file, over the scene's frames.

    Args:
        context: of Blender.
        path: the file.
        preset: of PRESETS, one with a format of SCENE_FORMATS.
    Returns:
        Messages for the user.
    Raises:
        InputError: if the preset is for single players only, or the file cannot be written.
    """
    wanted, scene = PRESETS[preset], context.scene
    if wanted.format not in SCENE_FORMATS:
        raise InputError("export", f"{preset.capitalize()} has a file for each player", "USD, Alembic or Godot",
                         "choose one of these, or players")
    exporters.check_exporter(wanted.format)
    exporters.check_folder(path)
    if path.is_dir():
        raise InputError(path, "is a folder", "a name that is free", "choose another folder")
    shown = [thing for thing in scene.objects if thing.type in {"MESH", "ARMATURE"} and thing.visible_get()]
    if not any(thing.type == "MESH" or wanted.format != "ABC" for thing in shown):
        raise InputError("export", "nothing to deliver is visible", "visible meshes", "synthesize, or show some")
    with export.keep_mode(context):
        exporters.write_whole_file(path, lambda part: exporters.EXPORTERS[wanted.format](part, wanted.engine,
                                                                                         "VISIBLE"))
    hidden = export.list_hidden_now(scene)
    return [f"{scene.frame_end - scene.frame_start + 1} frames of the whole scene", f"Written: {path}",
            *([f"{format_count(len(hidden), 'mesh', 'meshes')} left out: hidden at this frame"] if hidden else [])]


def name_files(names: list[str]) -> list[str]:
    """Name files after objects: only characters that every system allows, and no name twice."""
    found: list[str] = []
    for name in names:
        plain = re.sub(r"[^\w\- .]", "_", name).strip(" .") or "player"
        number = 1 + sum(one.lower() == plain.lower() or one.lower().startswith(f"{plain.lower()} (") for one in found)
        found.append(plain if number == 1 else f"{plain} ({number})")
    return found
