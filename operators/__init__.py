"""What a user can do: one verb per file, each from settings to the core to the scene.

The classes are registered in the order of CLASSES.
"""

import bpy

from . import add_stage, cancel, export_bvh, import_clips, remove_player

CLASSES = (
    import_clips.BEYOND_MOCAP_OT_import_clips,
    import_clips.BEYOND_MOCAP_FH_clips,
    export_bvh.BEYOND_MOCAP_OT_export_bvh,
    remove_player.BEYOND_MOCAP_OT_remove_player,
    add_stage.BEYOND_MOCAP_OT_add_stage,
    cancel.BEYOND_MOCAP_OT_cancel,
)


def register():
    """Register the operators, in order."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    """Unregister the operators, the last one first."""
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
