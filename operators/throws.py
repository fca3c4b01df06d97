"""Throws and kicks at a target."""

from __future__ import annotations

import bpy

from ..beyond_mocap.base.errors import InputError
from ..scene.throws import generation as made
from ..scene.throws import preview as shown
from ..scene.throws import throw_task as order
from ..scene.throws.settings import find_thrower
from .operator_base import BackgroundOperator, BaseOperator


class TargetOperator(BackgroundOperator):
    """Base of throwing and kicking."""

    act = ""
    presents = True
    needs = "Select the armature that throws or kicks", lambda context: find_thrower(context) is not None

    def order(self, context):
        """Build the request from the scene."""
        return order.build_request(context.scene, find_thrower(context), self.act)

    @staticmethod
    def run_job(asked, progress, cancelled, hurry):
        """Generate the throw or kick."""
        return made.generate_throw(asked, progress, cancelled, hurry)

    def apply(self, scene, result):
        body = scene.objects.get(result.order.body)
        if body is None or body.type != "ARMATURE":
            raise InputError(f"armature {result.order.body}", "it was removed meanwhile", "the same armature",
                             "select an armature and try again")
        shown.show_throw(scene, body, result)
        for line in body.beyond_mocap_throw.messages.splitlines():
            self.report({"WARNING"}, f"{body.name}: {line}")
        self.report({"INFO"}, f"{body.name}: {shown.describe_throw(result)}")


class BEYOND_MOCAP_OT_throw_at_target(TargetOperator, bpy.types.Operator):
    """Throw a ball at the target, or at the 3D cursor without one, with the selected armature: networks generate the
throw, and wrist and release are changed only as much as needed"""

    bl_idname = "beyond_mocap.throw_at_target"
    bl_label = "Throw at Target"
    kind = "throw"
    act = "throw"


class ThrowPreviewOperator(BaseOperator):
    """Base of operators on the throw or kick in preview."""

    needs = ("Select an armature with a throw or kick in preview",
             lambda context: (body := find_thrower(context)) is not None and bool(body.beyond_mocap_throw.made))


class BEYOND_MOCAP_OT_leave_throw(ThrowPreviewOperator, bpy.types.Operator):
    """Revert the throw or kick: armature and ball play what they did before"""

    bl_idname = "beyond_mocap.leave_throw"
    bl_label = "Revert Throw"

    def do(self, context):
        """Restore the earlier animation."""
        shown.revert_throw(context.scene, find_thrower(context))


class BEYOND_MOCAP_OT_keep_throw(ThrowPreviewOperator, bpy.types.Operator):
    """Apply the throw or kick: it becomes the armature's own motion, and the next one begins from it"""

    bl_idname = "beyond_mocap.keep_throw"
    bl_label = "Apply Throw"

    def do(self, context):
        """Apply the preview."""
        shown.apply_throw(find_thrower(context))


class BEYOND_MOCAP_OT_kick_at_target(TargetOperator, bpy.types.Operator):
    """Kick a ball at the target, or at the 3D cursor without one, with the selected armature: from where the ball is if
one is chosen, else in front of the foot"""

    bl_idname = "beyond_mocap.kick_at_target"
    bl_label = "Kick at Target"
    kind = "kick"
    act = "kick"
