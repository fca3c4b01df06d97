"""Throws and kicks at a target."""

from __future__ import annotations

import bpy

from ..beyond_mocap.base.errors import InputError
from ..scene.throws import made, order, shown
from ..scene.throws.settings import thrower
from .verb import BackgroundVerb, Verb


class AtTarget(BackgroundVerb):
    """What throwing and kicking share."""

    act = ""
    needs = "Select the armature that throws or kicks", lambda context: thrower(context) is not None

    def order(self, context):
        """Who, from where, at what, when."""
        return order.order_of(context.scene, thrower(context), self.act)

    work = staticmethod(made.work)

    def apply(self, scene, result):
        body = scene.objects.get(result.order.body)
        if body is None or body.type != "ARMATURE":
            raise InputError(f"armature {result.order.body}", "it is gone meanwhile", "the same armature",
                             "press again")
        shown.show(scene, body, result)
        for line in body.beyond_mocap_throw.told.splitlines():
            self.report({"WARNING"}, f"{body.name}: {line}")
        self.report({"INFO"}, f"{body.name}: {'; '.join(shown.figures(result))}")


class BEYOND_MOCAP_OT_throw_at_target(AtTarget, bpy.types.Operator):
    """Let the selected armature throw a ball that hits the target: a network makes the throw, and wrist and release are
changed as little as it takes. Without a target the 3D cursor is aimed at. Press it again for another target"""

    bl_idname = "beyond_mocap.throw_at_target"
    bl_label = "Throw at Target"
    kind = "throw"
    act = "throw"


class ThrownVerb(Verb):
    """A verb about the throw or kick that is shown."""

    needs = ("Select an armature that throws or kicks",
             lambda context: (body := thrower(context)) is not None and bool(body.beyond_mocap_throw.made))


class BEYOND_MOCAP_OT_leave_throw(ThrownVerb, bpy.types.Operator):
    """Take the throw or kick away: armature and ball play what they did before"""

    bl_idname = "beyond_mocap.leave_throw"
    bl_label = "Leave Throw"

    def do(self, context):
        """Bring back what was there."""
        shown.leave(context.scene, thrower(context))


class BEYOND_MOCAP_OT_keep_throw(ThrownVerb, bpy.types.Operator):
    """Keep the throw or kick: it is the armature's own motion from now on, and the next one begins from it"""

    bl_idname = "beyond_mocap.keep_throw"
    bl_label = "Keep Throw"

    def do(self, context):
        """Nothing of before is kept."""
        shown.keep(thrower(context))


class BEYOND_MOCAP_OT_kick_at_target(AtTarget, bpy.types.Operator):
    """Let the selected armature kick a ball that hits the target: where it lies, if one is chosen, else in front of the
foot. Without a target the 3D cursor is aimed at. Press it again for another target"""

    bl_idname = "beyond_mocap.kick_at_target"
    bl_label = "Kick at Target"
    kind = "kick"
    act = "kick"
