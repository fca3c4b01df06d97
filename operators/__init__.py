"""What a user can do: one verb per file, each from settings to the core to the scene.

The classes are registered in the order of CLASSES.
"""

import bpy

CLASSES = ()


def register():
    """Register the operators, in order."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    """Unregister the operators, the last one first."""
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
