"""Blender's own data: what the core's motions, tracks and clips become in a file. No buttons here.

- `measure`     metres and seconds against the scene's units and frames
- `armature`, `action`   skeletons and motions, both ways
- `channels`    curves in bulk; alone knows slots and channelbags
- `body`, `ball`, `curve`, `stage`, `material`   what is seen
- `settings`    what the panels show, per scene; `session` what lives as long as Blender runs
- `preferences` what the user sets once for all files
- `tracks`, `plans`   the settings as tracks and plans of the core
- `bake`        a take becomes all of that
- `result`, `preview`, `set_aside`, `blocks`   a take is shown, kept or put away again; as one action or as NLA strips
- `background`  long work in a thread
- `clips`, `watch`   the library's clips as a list; whether its folder has changed

The classes are registered in the order of CLASSES: what others point to comes first.
"""

import bpy

from . import background, clips, result, session, settings, watch

CLASSES = (
    *result.CLASSES,
    settings.BeyondMocapPlayer,
    settings.BeyondMocapSettings,
    settings.BeyondMocapWork,
    *clips.CLASSES,
)


def register():
    """Register the data classes, in order, and hang the settings on every scene."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.beyond_mocap = bpy.props.PointerProperty(type=settings.BeyondMocapSettings)
    bpy.types.WindowManager.beyond_mocap_work = bpy.props.PointerProperty(type=settings.BeyondMocapWork)
    bpy.types.WindowManager.beyond_mocap_clips = bpy.props.PointerProperty(type=clips.BeyondMocapClips)
    watch.register()


def unregister():
    """Stop what runs and forget what was made; unregister the data classes, the last one first."""
    background.stop()
    watch.unregister()
    session.clear()
    del bpy.types.WindowManager.beyond_mocap_clips
    del bpy.types.WindowManager.beyond_mocap_work
    del bpy.types.Scene.beyond_mocap
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
