"""Export BVH: the active armature's motion as a file that every tool reads."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty
from bpy_extras.io_utils import ExportHelper

from ..beyond_mocap.errors import InputError
from ..beyond_mocap.files import bvh
from ..scene import action
from .verb import Verb


class BEYOND_MOCAP_OT_export_bvh(Verb, bpy.types.Operator, ExportHelper):
    """Write the active armature's motion as BVH: centimetres, Y up, at the scene's frame rate"""

    bl_idname = "beyond_mocap.export_bvh"
    bl_label = "Export BVH"
    bl_options = {"REGISTER"}
    filename_ext = ".bvh"

    filter_glob: StringProperty(default="*.bvh", options={"HIDDEN"})

    @classmethod
    def poll(cls, context):
        """An armature."""
        cls.poll_message_set("Select an armature first")
        return context.object is not None and context.object.type == "ARMATURE"

    def do(self, context):
        """Read the action, write the file."""
        if not self.filepath:
            raise InputError("export", "no file given", "a .bvh file", "choose where to write it")
        motion = action.read(context.object, context.scene)
        for note in bvh.write(bpy.path.abspath(self.filepath), motion):
            self.report({"INFO"}, note)
        self.report({"INFO"}, f"{len(motion)} frames written to {self.filepath}")
