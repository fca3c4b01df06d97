"""Words by keys: the button, beside the key that does the same."""

from __future__ import annotations

import bpy

from .tab import Step


class BEYOND_MOCAP_PT_annotate(Step, bpy.types.Panel):
    """Where annotating begins."""

    bl_label = "Annotate"
    bl_parent_id = "BEYOND_MOCAP_PT_players"

    def draw(self, context):
        """The button, and one for the editor of strips."""
        row = self.layout.row(align=True)
        row.scale_y = 1.3
        row.operator("beyond_mocap.annotate", icon="SYNTAX_ON", text="Annotate by Keys")
        row.operator("beyond_mocap.show_timeline", icon="NLA", text="")
