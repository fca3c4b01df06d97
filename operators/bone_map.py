"""Bone maps: found, kept for the skeleton, written to and read from a file."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper

from ..beyond_mocap.errors import InputError
from ..scene import bone_maps, rig
from ..scene.rigs.driven import check
from .verb import Verb


class MapVerb(Verb):
    """A verb about the chosen rig's map."""

    @classmethod
    def poll(cls, context):
        """A rig is chosen."""
        cls.poll_message_set("Choose a rig first")
        return context.scene.beyond_mocap.rig.target is not None


class BEYOND_MOCAP_OT_map_bones(MapVerb, bpy.types.Operator):
    """Find the rig's bones by their names, and where these say nothing by their structure"""

    bl_idname = "beyond_mocap.map_bones"
    bl_label = "Map Bones"

    def do(self, context):
        """Fill the list anew."""
        settings = context.scene.beyond_mocap.rig
        settings.told = f"Bones mapped {rig.fill(settings, again=True)}"


class BEYOND_MOCAP_OT_keep_bone_map(MapVerb, bpy.types.Operator):
    """Keep this map for all armatures with these bones: it is used whenever one of them is chosen"""

    bl_idname = "beyond_mocap.keep_bone_map"
    bl_label = "Keep for This Skeleton"
    bl_options = {"REGISTER"}

    def do(self, context):
        """Check and write it to the user's folder."""
        settings = context.scene.beyond_mocap.rig
        table = rig.table_of(settings)
        bone_maps.check(settings.target, table)
        if bone_maps.keep(settings.target, table) is None:
            raise InputError("bone map", "this Blender has no folder for the extension", "an installed extension",
                             "save it as a file")
        self.report({"INFO"}, f"Map kept for skeletons like {settings.target.name}")


class BEYOND_MOCAP_OT_save_bone_map(MapVerb, bpy.types.Operator, ExportHelper):
    """Write the map to a JSON file"""

    bl_idname = "beyond_mocap.save_bone_map"
    bl_label = "Save Bone Map"
    bl_options = {"REGISTER"}
    filename_ext = ".json"

    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def do(self, context):
        """Write it."""
        if not self.filepath:
            raise InputError("bone map", "no file given", "a .json file", "choose where to write it")
        settings = context.scene.beyond_mocap.rig
        bone_maps.save(Path(bpy.path.abspath(self.filepath)), settings.target, rig.table_of(settings))


class BEYOND_MOCAP_OT_load_bone_map(MapVerb, bpy.types.Operator, ImportHelper):
    """Read a map from a JSON file"""

    bl_idname = "beyond_mocap.load_bone_map"
    bl_label = "Load Bone Map"
    filename_ext = ".json"

    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def do(self, context):
        """Read, check, show."""
        if not self.filepath:
            raise InputError("bone map", "no file given", "a .json file", "choose one")
        settings = context.scene.beyond_mocap.rig
        table = bone_maps.load(Path(bpy.path.abspath(self.filepath)))
        bone_maps.check(settings.target, table)
        rig.show(settings, table)


class BEYOND_MOCAP_OT_use_selected_rig(Verb, bpy.types.Operator):
    """Take the active armature as the rig"""

    bl_idname = "beyond_mocap.use_selected_rig"
    bl_label = "Use Active Armature"

    @classmethod
    def poll(cls, context):
        """An armature is active."""
        cls.poll_message_set("Select the rig first")
        return context.object is not None and context.object.type == "ARMATURE"

    def do(self, context):
        """Choose it; its bones are mapped at once."""
        check(context.object)
        context.scene.beyond_mocap.rig.target = context.object
