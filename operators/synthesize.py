"""Synthesize: a take for every chosen player, shown on its armature as a preview."""

from __future__ import annotations

import bpy

from .turns import TurnsVerb


class BEYOND_MOCAP_OT_synthesize(TurnsVerb, bpy.types.Operator):
    """Find clips for every ticked player's track and words, and join them into one motion.
It is shown as a preview, until it is accepted or discarded. Players queue; ESC cancels"""

    bl_idname = "beyond_mocap.synthesize"
    bl_label = "Synthesize"
