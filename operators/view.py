"""Overlays of single armatures in the 3D view."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty

from ..beyond_mocap.base.errors import InputError
from ..scene.core import channels
from ..scene.overlays import momentum_traces
from .operator_base import NEEDS_NO_EDITING, BaseOperator


class BEYOND_MOCAP_OT_show_momentum(BaseOperator, bpy.types.Operator):
    """Draw centre of mass, flights, support polygon and ground force of the selected armatures over the 3D view"""

    bl_idname = "beyond_mocap.show_momentum"
    bl_label = "Show Momentum"
    remove: BoolProperty(name="Remove", options={"SKIP_SAVE"}, description="Hide them instead")
    needs = (*NEEDS_NO_EDITING, "Select an armature with a motion",
             lambda context: bool(_list_selected_armatures(context)))

    def do(self, context):
        """Show or hide the momentum of all selected armatures."""
        chosen = _list_selected_armatures(context)
        channels.check_local(*chosen)
        if not self.remove:
            momentum_traces.show_momentum(context.scene, chosen)
            return
        showing = [body for body in chosen if body.beyond_mocap_momentum.show]
        if not showing:
            raise InputError(f"armature {chosen[0].name}", "does not show its momentum", "an armature that shows it",
                             "press Show Momentum")
        momentum_traces.hide_momentum(showing)


def _list_selected_armatures(context) -> list[bpy.types.Object]:
    """List the selected armatures and those of selected characters."""
    chosen = [thing.find_armature() or thing for thing in context.selected_objects]
    return list(dict.fromkeys(thing for thing in chosen if thing.type == "ARMATURE"))
