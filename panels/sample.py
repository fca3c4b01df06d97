"""What a task shows at its top while it has nothing yet: buttons that load its sample."""

from __future__ import annotations

import bpy

from ..scene.markers.settings import list_clouds
from .tab import TabPanel, draw_paragraph

SAMPLES = {"PLAYER": ("PLAYER",), "MATCH": ("MATCH",), "PATH": ("PATH",), "BALL": ("PASSES", "THROW"),
           "MARKERS": ("MARKERS",)}
"""The samples of each task."""

EMPTY = {"PLAYER": lambda scene: not scene.beyond_mocap.players,
         "MATCH": lambda scene: not scene.beyond_mocap_match.tracking_file,
         "PATH": lambda scene: not any(thing.type == "ARMATURE" for thing in scene.objects),
         "BALL": lambda scene: not scene.beyond_mocap_passes.players
         and not any(thing.beyond_mocap_throw.made for thing in scene.objects),
         "MARKERS": lambda scene: not list_clouds(scene)}
"""Whether a scene has nothing of a task."""


class BEYOND_MOCAP_PT_sample(TabPanel, bpy.types.Panel):
    """The samples of the chosen task, while the scene has nothing of it."""

    bl_label = "Sample"
    bl_order = 0
    bl_options = {"HIDE_HEADER"}

    @classmethod
    def poll(cls, context):
        """Return whether the scene has nothing of the chosen task."""
        is_empty = EMPTY.get(context.scene.beyond_mocap.task)
        return is_empty is not None and is_empty(context.scene)

    def draw(self, context):
        """Draw a button for each sample."""
        draw_paragraph(self.layout, "See it move first, or begin with your own data below", "INFO")
        row = self.layout.row(align=True)
        row.scale_y = 1.5
        names = SAMPLES[context.scene.beyond_mocap.task]
        for name in names:
            text = "Load Sample" if len(names) == 1 else f"{name.title()} Sample"
            row.operator("beyond_mocap.load_sample", text=text, icon="PLAY").which = name
