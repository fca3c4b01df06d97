"""Values that are chosen automatically: stored as 0, shown as "Automatic" in the panels."""

import bpy
from bpy.props import FloatProperty, StringProperty

from ..beyond_mocap.base.errors import InputError
from .operator_base import BaseOperator


class BEYOND_MOCAP_OT_set_automatic(BaseOperator, bpy.types.Operator):
    """Set a value of your own, or let it be chosen automatically"""

    bl_idname = "beyond_mocap.set_automatic"
    bl_label = "Automatic"
    bl_options = {"UNDO", "INTERNAL"}
    object: StringProperty(name="Object", options={"SKIP_SAVE"}, description="Object that has the value; empty: the "
                           "scene")
    path: StringProperty(name="Path", options={"SKIP_SAVE"}, description="Data path of the value")
    value: FloatProperty(name="Value", options={"SKIP_SAVE"}, description="Value to set; 0 chooses it automatically")

    @classmethod
    def description(cls, _context, properties):
        return ("Set a value of your own instead of the automatic one" if properties.value
                else "Choose the value automatically again")

    def do(self, context):
        """Set the value."""
        thing = bpy.data.objects.get(self.object) if self.object else context.scene
        place, _, name = self.path.rpartition(".")
        try:
            owner = thing.path_resolve(place)
            value = type(getattr(owner, name))(self.value)
        except (AttributeError, ValueError, TypeError):
            raise InputError("automatic value", self.path or "no path", "the path of a number") from None
        setattr(owner, name, value)
