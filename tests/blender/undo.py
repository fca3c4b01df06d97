"""What undo has to bring back: a list of all that a file holds, to be compared before and after."""

import bpy

KINDS = ("objects", "armatures", "actions", "meshes", "curves", "materials", "cameras", "lights", "collections", "worlds")


def state():
    """All names of data, the settings of the scene and its players, as plain values."""
    settings = bpy.context.scene.beyond_mocap
    return {
        **{kind: sorted(item.name for item in getattr(bpy.data, kind)) for kind in KINDS},
        "animated": sorted((o.name, o.animation_data.action.name) for o in bpy.data.objects
                           if o.animation_data and o.animation_data.action),
        "frames": (bpy.context.scene.frame_start, bpy.context.scene.frame_end, bpy.context.scene.render.fps),
        "settings": {p.identifier: getattr(settings, p.identifier) for p in settings.bl_rna.properties
                     if p.type in {"STRING", "INT", "FLOAT", "BOOLEAN", "ENUM"}},
        "players": [(p.name, p.tracking_file, p.annotation_file, p.take, p.quality, p.body.name if p.body else None)
                    for p in settings.players],
    }


def press(operator, **arguments):
    """Run an operator as its button does, with a step for undo."""
    return operator("EXEC_DEFAULT", True, **arguments)


def assert_one_step(operator, **arguments):
    """Pressing the button changes the file, one undo brings it back, one redo does it again."""
    bpy.ops.ed.undo_push(message="before")
    before = state()
    assert press(operator, **arguments) == {"FINISHED"}
    after = state()
    assert after != before
    bpy.ops.ed.undo()
    assert state() == before
    bpy.ops.ed.redo()
    assert state() == after
