"""Deliver players, a match or the whole scene as files for game engines and other programs."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty

from ..beyond_mocap.base.errors import InputError
from ..scene.characters.player_character import find_shown_body
from ..scene.core.settings import find_active_player
from ..scene.match import match_objects
from ..scene.rigs import engine_files, export
from .operator_base import BaseOperator

WHO = (("ACTIVE", "Active Player", "The active player; without players the active armature"),
       ("PLAYERS", "Selected Players", "Every selected player of the list, one file for each"),
       ("MATCH", "Match", "Every player of the displayed match, one file for each"),
       ("SCENE", "Whole Scene", "Everything visible, in one file of USD, Alembic or glTF"))


class BEYOND_MOCAP_OT_deliver(BaseOperator, bpy.types.Operator):
    """Write files for an engine or another program into a folder, one for each player or one of the whole scene; the
scene stays unchanged"""

    bl_idname = "beyond_mocap.deliver"
    bl_label = "Deliver"
    bl_options = {"REGISTER", "PRESET"}
    directory: StringProperty(name="Folder", subtype="DIR_PATH", options={"SKIP_SAVE"},
                              description="Folder for the files; those of the same names are replaced")
    filter_folder: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    preset: EnumProperty(name="For", items=engine_files.PRESET_ITEMS, default="UNREAL",
                         description="Program to deliver to")
    who: EnumProperty(name="Deliver", items=WHO, default="ACTIVE", description="What is delivered")
    root: EnumProperty(name="Root Motion", items=engine_files.ROOT_ITEMS, default="SMOOTH",
                       description="Motion of the root bone")
    meshes: BoolProperty(name="Meshes", default=True, description="Also deliver the meshes that armatures move")

    def invoke(self, context, _event):
        """Choose the folder."""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def draw(self, _context):
        """Draw the settings beside the file browser."""
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.prop(self, "preset")
        layout.prop(self, "who")
        column = layout.column()
        column.active = self.who != "SCENE"
        column.prop(self, "root")
        column.prop(self, "meshes")

    def do(self, context):
        """Write the files and report them."""
        if not self.directory:
            raise InputError("export", "no folder given", "a folder to write to", "choose a folder")
        folder = Path(bpy.path.abspath(self.directory))
        if self.who == "SCENE":
            suffix = export.SUFFIXES[engine_files.PRESETS[self.preset].format]
            name = Path(bpy.data.filepath).stem or "scene"
            lines = engine_files.deliver_scene(context, folder / f"{name}{suffix}", self.preset)
        else:
            lines = engine_files.deliver_players(context, self.list_rigs(context), folder, self.preset, self.root,
                                                 meshes=self.meshes)
        for line in lines:
            self.report({"INFO"}, line)

    def list_rigs(self, context) -> list[bpy.types.Object]:
        """List the armatures to deliver."""
        settings = context.scene.beyond_mocap
        if self.who == "MATCH":
            found = match_objects.find_armatures(context.scene)
            if not found:
                raise InputError("export", "no match is shown", "a displayed match", "press Show Match first")
            return [body for body in found if body.name in context.view_layer.objects]
        if self.who == "PLAYERS":
            return [body for player in settings.players if player.use and (body := find_shown_body(player)) is not None]
        player = find_active_player(settings)
        if player is not None and find_shown_body(player) is not None:
            return [find_shown_body(player)]
        active = context.object
        return [active] if active is not None and active.type == "ARMATURE" else []
