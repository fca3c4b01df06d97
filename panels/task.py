"""The switch at the top of the tab: what the user is doing, which decides which panels are shown."""

from __future__ import annotations

import bpy

from .notices import draw_task_notices
from .tab import TabPanel

ROWS = (("PLAYER", "MATCH", "PATH", "BALL"), ("MARKERS", "LIBRARY"))
WIDE = 0.57  # share of the second row that its longer name needs


class BEYOND_MOCAP_PT_task(TabPanel, bpy.types.Panel):
    """The tasks, one of them chosen."""

    bl_label = "Task"
    bl_order = -1
    bl_options = {"HIDE_HEADER"}

    def draw(self, context):
        """Draw a button for each task, always in the same place."""
        settings, column = context.scene.beyond_mocap, self.layout.column(align=True)
        first, second = ROWS
        for row, tasks in ((column.row(align=True), first), (column.split(factor=WIDE, align=True), second)):
            for task in tasks:
                row.prop_enum(settings, "task", task)
        draw_task_notices(self.layout, context)
