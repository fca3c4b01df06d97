"""What a user can do: one verb per file, each from settings to the core to the scene.

The classes are registered in the order of CLASSES.
"""

import bpy

from . import (
    accept,
    add_moment,
    add_preset,
    add_span,
    add_stage,
    annotate,
    annotate_clip,
    bake_to_rig,
    bone_map,
    build_library,
    cancel,
    choose_player,
    command,
    delete_moment,
    discard,
    edit_words,
    error_curves,
    export_bvh,
    export_words,
    go_to_moment,
    export_motion,
    import_clip,
    import_clips,
    import_tracking,
    import_words,
    join_spans,
    jump_to,
    keymap,
    list_clips,
    load_video,
    make_assets,
    mirror,
    mirror_side,
    move_moment,
    move_video,
    pick_moment,
    place_players,
    player_from_dot,
    propose_words,
    read_words,
    relink_library,
    remove_clip,
    preview,
    remove_player,
    resynthesize_stretch,
    remove_video,
    save_words,
    show_timeline,
    show_video,
    split_span,
    synthesize,
    update,
    variants,
    words_to_text,
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
    words_to_text.BEYOND_MOCAP_OT_words_to_text,
    export_words.BEYOND_MOCAP_OT_export_words,
    add_span.BEYOND_MOCAP_OT_add_span,
    split_span.BEYOND_MOCAP_OT_split_span,
    join_spans.BEYOND_MOCAP_OT_join_spans,
    add_moment.BEYOND_MOCAP_OT_add_moment,
    move_moment.BEYOND_MOCAP_OT_move_moment,
    delete_moment.BEYOND_MOCAP_OT_delete_moment,
    mirror_side.BEYOND_MOCAP_OT_mirror_side,
    edit_words.BEYOND_MOCAP_OT_edit_words,
    go_to_moment.BEYOND_MOCAP_OT_go_to_moment,
    pick_moment.BEYOND_MOCAP_OT_pick_moment,
    choose_player.BEYOND_MOCAP_OT_choose_player,
    player_from_dot.BEYOND_MOCAP_OT_player_from_dot,
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
    resynthesize_stretch.BEYOND_MOCAP_OT_resynthesize_stretch,
    variants.BEYOND_MOCAP_OT_variants,
    preview.BEYOND_MOCAP_OT_preview,
    discard.BEYOND_MOCAP_OT_discard,
    add_stage.BEYOND_MOCAP_OT_add_stage,
    annotate.BEYOND_MOCAP_OT_annotate,
    load_video.BEYOND_MOCAP_OT_load_video,
    show_timeline.BEYOND_MOCAP_OT_show_timeline,
    show_video.BEYOND_MOCAP_OT_show_video,
    move_video.BEYOND_MOCAP_OT_move_video,
    remove_video.BEYOND_MOCAP_OT_remove_video,
    jump_to.BEYOND_MOCAP_OT_jump_to,
    error_curves.BEYOND_MOCAP_OT_error_curves,
    bone_map.BEYOND_MOCAP_OT_map_bones,
    bone_map.BEYOND_MOCAP_OT_keep_bone_map,
    bone_map.BEYOND_MOCAP_OT_save_bone_map,
    bone_map.BEYOND_MOCAP_OT_load_bone_map,
    bone_map.BEYOND_MOCAP_OT_use_selected_rig,
    bake_to_rig.BEYOND_MOCAP_OT_bake_to_rig,
    bake_to_rig.BEYOND_MOCAP_OT_unbake,
    bake_to_rig.BEYOND_MOCAP_OT_reduce_keys,
    export_motion.BEYOND_MOCAP_OT_export_motion,
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
