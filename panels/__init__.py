"""The "Beyond Mocap" tab in the 3D viewport's sidebar: the steps from top to bottom.

The panels are registered in the order of CLASSES, which is the order on the screen.
"""

import bpy


class BEYOND_MOCAP_PT_tab(bpy.types.Panel):
    """The tab itself, named with the extension's version."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Beyond Mocap"
    bl_label = "Beyond Mocap"

    def draw(self, context):
        """Say in one line what the tab is for."""
        self.layout.label(text="From tracked dots to moving bodies", icon="ARMATURE_DATA")


CLASSES = (BEYOND_MOCAP_PT_tab,)


def register():
    """Register the panels, in order."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    """Unregister the panels, the last one first."""
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
