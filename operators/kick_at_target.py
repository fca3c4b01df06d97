"""Kick at Target: the armature kicks a ball so that it hits."""

from __future__ import annotations

import bpy

from .throw_at_target import AtTarget


class BEYOND_MOCAP_OT_kick_at_target(AtTarget, bpy.types.Operator):
    """Let the selected armature kick a ball that hits the target: where it lies, if one is chosen, else in front of the
foot. Without a target the 3D cursor is aimed at. Press it again for another target"""

    bl_idname = "beyond_mocap.kick_at_target"
    bl_label = "Kick at Target"
    kind = "kick"
    act = "kick"
