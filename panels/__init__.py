"""The "Beyond Mocap" tab in the 3D viewport's sidebar: the steps from top to bottom.

The panels are registered in the order of CLASSES, which is the order on the screen.
"""

import bpy

from . import (
    annotate, ball, library, markers, match, menus, path, players, preferences, presets, quality, result, rig,
    synthesis,
    throws, timeline, video, view,
)

CLASSES = (
    library.BEYOND_MOCAP_UL_clips,
    library.BEYOND_MOCAP_UL_proposals,
    library.BEYOND_MOCAP_PT_library,
    players.BEYOND_MOCAP_UL_players,
    players.BEYOND_MOCAP_UL_pins,
    players.BEYOND_MOCAP_PT_players,
    annotate.BEYOND_MOCAP_PT_annotate,
    video.BEYOND_MOCAP_PT_video,
    presets.BEYOND_MOCAP_MT_presets,
    presets.BEYOND_MOCAP_PT_presets,
    synthesis.BEYOND_MOCAP_PT_synthesis,
    result.BEYOND_MOCAP_PT_result,
    quality.BEYOND_MOCAP_PT_quality,
    path.BEYOND_MOCAP_PT_path,
    ball.BEYOND_MOCAP_UL_passers,
    ball.BEYOND_MOCAP_UL_passes,
    ball.BEYOND_MOCAP_UL_touches,
    ball.BEYOND_MOCAP_PT_ball,
    throws.BEYOND_MOCAP_PT_throws,
    match.BEYOND_MOCAP_UL_match,
    match.BEYOND_MOCAP_PT_match,
    markers.BEYOND_MOCAP_UL_markers,
    markers.BEYOND_MOCAP_PT_markers,
    view.BEYOND_MOCAP_PT_view,
    timeline.BEYOND_MOCAP_MT_choose_player,
    timeline.BEYOND_MOCAP_PT_timeline,
    timeline.BEYOND_MOCAP_PT_timeline_dope_sheet,
    rig.BEYOND_MOCAP_UL_bones,
    rig.BEYOND_MOCAP_PT_rig,
    preferences.BeyondMocapPreferences,
)


def register():
    """Register the panels, in order, and the entries of the File menu."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    menus.register()


def unregister():
    """Take the menu entries away and unregister the panels, the last one first."""
    menus.unregister()
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
