"""Remove Clip: a clip of the library that was brought in goes again, with its body, strips and actions."""

from __future__ import annotations

import bpy

from ..beyond_mocap.errors import InputError
from ..scene import clip_annotation
from .verb import Verb


class BEYOND_MOCAP_OT_remove_clip(Verb, bpy.types.Operator):
    """Take the active clip out of this file again: armature, body, strips and actions. The library keeps it; words that
were not saved are lost"""

    bl_idname = "beyond_mocap.remove_clip"
    bl_label = "Remove Clip"

    @classmethod
    def poll(cls, context):
        """An armature that shows a clip."""
        cls.poll_message_set("Select the armature of a clip that came from the library's list")
        return bool(clip_annotation.shown(context.object))

    def do(self, context):
        """Remove it."""
        rig = context.object
        if rig.library is not None or rig.override_library is not None:
            raise InputError(rig.name, "it belongs to another file", "an object of this file")
        if rig.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        clip_annotation.remove(rig)
