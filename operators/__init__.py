"""What a user can do: one verb per file, each from settings to the core to the scene.

The classes are registered in the order of CLASSES.
"""

import bpy

from . import (
    accept,
    add_preset,
    add_stage,
    annotate,
    annotate_clip,
    build_library,
    cancel,
    command,
    discard,
    error_curves,
    export_bvh,
    import_clip,
    import_clips,
    import_tracking,
    import_words,
    jump_to,
    keymap,
    list_clips,
    load_video,
    make_assets,
    mirror,
    move_video,
    place_players,
    propose_words,
    read_words,
    relink_library,
    remove_clip,
    remove_player,
    remove_video,
    save_words,
    show_video,
    synthesize,
    update,
)

CLASSES = (
    import_clips.BEYOND_MOCAP_OT_import_clips,
    import_clips.BEYOND_MOCAP_FH_clips,
    import_clips.BEYOND_MOCAP_FH_foreign_clips,
    mirror.BEYOND_MOCAP_OT_mirror,
    export_bvh.BEYOND_MOCAP_OT_export_bvh,
    import_tracking.BEYOND_MOCAP_OT_import_tracking,
    import_tracking.BEYOND_MOCAP_FH_tracking,
    remove_player.BEYOND_MOCAP_OT_remove_player,
    place_players.BEYOND_MOCAP_OT_place_players,
    read_words.BEYOND_MOCAP_OT_read_words,
    build_library.BEYOND_MOCAP_OT_build_library,
    list_clips.BEYOND_MOCAP_OT_list_clips,
    import_clip.BEYOND_MOCAP_OT_import_clip,
    relink_library.BEYOND_MOCAP_OT_relink_library,
    annotate_clip.BEYOND_MOCAP_OT_annotate_clip,
    propose_words.BEYOND_MOCAP_OT_propose_words,
    save_words.BEYOND_MOCAP_OT_save_words,
    remove_clip.BEYOND_MOCAP_OT_remove_clip,
    make_assets.BEYOND_MOCAP_OT_make_assets,
    add_preset.BEYOND_MOCAP_OT_add_preset,
    import_words.BEYOND_MOCAP_OT_import_words,
    import_words.BEYOND_MOCAP_FH_words,
    synthesize.BEYOND_MOCAP_OT_synthesize,
    update.BEYOND_MOCAP_OT_update,
    cancel.BEYOND_MOCAP_OT_cancel,
    accept.BEYOND_MOCAP_OT_accept,
    discard.BEYOND_MOCAP_OT_discard,
    add_stage.BEYOND_MOCAP_OT_add_stage,
    annotate.BEYOND_MOCAP_OT_annotate,
    load_video.BEYOND_MOCAP_OT_load_video,
    show_video.BEYOND_MOCAP_OT_show_video,
    move_video.BEYOND_MOCAP_OT_move_video,
    remove_video.BEYOND_MOCAP_OT_remove_video,
    jump_to.BEYOND_MOCAP_OT_jump_to,
    error_curves.BEYOND_MOCAP_OT_error_curves,
)


def register():
    """Register the operators, in order, the command, and the keys."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    command.register()
    keymap.register()


def unregister():
    """Take keys and command away and unregister the operators, the last one first."""
    keymap.unregister()
    annotate.unwatch()
    command.unregister()
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
