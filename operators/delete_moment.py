"""Delete Key Moment: the picked one."""

from __future__ import annotations

import bpy

from ..scene import lay_strips
from ..scene.subject import subject
from .timeline_verb import MomentVerb, picked


class BEYOND_MOCAP_OT_delete_moment(MomentVerb, bpy.types.Operator):
    """Take the picked key moment away"""

    bl_idname = "beyond_mocap.delete_moment"
    bl_label = "Delete Key Moment"

    def do(self, context):
        """Remove its marker."""
        target = subject(context)
        moment = picked(target)
        lay_strips.remove_moment(target, moment.strip, moment.index)
