"""Blender's own data: what the core's motions, tracks and clips become in a file.

No buttons here. The classes are registered in the order of CLASSES: what others
point to comes first.
"""

import bpy

CLASSES = ()


def register():
    """Register the data classes, in order."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    """Unregister the data classes, the last one first."""
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
