"""Mirror Motion: left becomes right, in the world, whatever the bones' rolls are."""

from __future__ import annotations

import bpy
import numpy as np

from ..beyond_mocap.motion import humanoid
from ..beyond_mocap.motion.mirror import mirror
from ..beyond_mocap.motion.motion import Motion, place
from ..beyond_mocap.motion.quaternion import about_up, rotate
from ..scene import action, channels
from .verb import Verb


class BEYOND_MOCAP_OT_mirror(Verb, bpy.types.Operator):
    """Exchange left and right in the active armature's motion: it begins at the same place and looks the same way, but
turns and kicks to the other side. The motion before is kept as an action"""

    bl_idname = "beyond_mocap.mirror"
    bl_label = "Mirror Motion"

    @classmethod
    def poll(cls, context):
        """An armature that moves."""
        body = context.object
        if body is None or body.type != "ARMATURE":
            cls.poll_message_set("Select an armature first")
            return False
        cls.poll_message_set("The active armature plays no action")
        return channels.playing(body)[0] is not None

    def do(self, context):
        """Read, mirror, write."""
        body = context.object
        motion = action.read(body, context.scene)
        start, name = action.first_frame(body), channels.playing(body)[0].name
        action.write(body, mirrored_in_place(motion), context.scene, start, f"{name} mirrored")


def mirrored_in_place(motion: Motion) -> Motion:
    """The mirrored motion, put where the motion began and facing as it did."""
    twin = mirror(motion)
    turn = humanoid.heading(motion)[0] - humanoid.heading(twin)[0]
    begun = rotate(about_up(turn), twin.root_positions[0])
    offset = np.append((motion.root_positions[0] - begun)[:2], 0.0)
    return place(twin, turn, offset)
