"""Add Stage: a pitch, daylight and a camera that follows."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty

from ..scene import stage
from .verb import Verb


class BEYOND_MOCAP_OT_add_stage(Verb, bpy.types.Operator):
    """Add a pitch with its lines, a sun and a camera that follows the players once they move"""

    bl_idname = "beyond_mocap.add_stage"
    bl_label = "Add Pitch, Light and Camera"

    camera: BoolProperty(name="Camera", default=True, description="Add a camera and look through it when rendering")

    def do(self, context):
        """Make it."""
        stage.create(context, self.camera)
