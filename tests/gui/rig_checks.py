"""A motion baked to a control rig that Rigify generates in this Blender, by the panel's own buttons, and undone
again."""

import importlib

import addon_utils
import bpy
from mathutils import Euler
from tab import (
    EXTENSION,
    PICTURES,
    TAB,
    copy_sample,
    is_moving,
    output,
    press_button,
    wait_until,
    wait_until_settled,
    window,
)


def import_module(name):
    """A module of the extension."""
    return importlib.import_module(f"{EXTENSION}.scene.{name}")


def create_rigify_rig():
    """A control rig as Rigify makes it."""
    assert addon_utils.enable("rigify", default_set=True)
    bpy.ops.object.armature_basic_human_metarig_add()
    meta = bpy.context.object
    bpy.ops.pose.rigify_generate()
    rig = meta.data.rigify_target_rig
    bpy.data.objects.remove(meta)
    return rig


def check_bake_to_a_rigify_rig():
    bpy.ops.wm.read_homefile(use_empty=False)
    yield 1
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    scene = bpy.context.scene
    bpy.ops.beyond_mocap.import_clips(filepath=str(copy_sample() / "library" / "kick_low_inside.bvh"))
    body = next(thing for thing in scene.objects if thing.type == "ARMATURE")
    rig = create_rigify_rig()
    name = rig.name
    settings = scene.beyond_mocap.rig
    settings.source, settings.target = body, rig
    assert len(import_module("rigs.rig").read_bone_list(settings)) >= 22, settings.messages
    bpy.ops.ed.undo_push(message="before the bake")
    yield from press_button("bake_to_rig(targets='CHOSEN'")  # one press is one undo step
    yield from wait_until(lambda: bpy.data.objects[name].animation_data
                          and bpy.data.objects[name].animation_data.action)
    yield from wait_until_settled()
    rig = bpy.data.objects[name]
    output.write_line(f"     {bpy.context.scene.beyond_mocap.rig.messages.splitlines()[-2:]}")
    assert is_moving(rig), "the rig does not move"
    assert rig.pose.bones["thigh_parent.L"]["IK_FK"] == 1.0
    yield from save_picture(rig, bpy.context.scene.beyond_mocap.rig.source)
    with bpy.context.temp_override(window=window.window):
        bpy.ops.ed.undo()
    yield from wait_until_settled()
    rig = bpy.data.objects[name]
    assert rig.animation_data.action is None and rig.pose.bones["thigh_parent.L"]["IK_FK"] == 0.0
    with bpy.context.temp_override(window=window.window):
        bpy.ops.ed.redo()
    yield from wait_until_settled()
    assert bpy.data.objects[name].animation_data.action is not None


def save_picture(rig, body):
    """A picture: the rig beside the body it has the motion from."""
    for collection in rig.data.collections_all:
        collection.is_visible = collection.name == "DEF"
    rig.show_in_front = True
    rig.location.x = -1.5
    scene = bpy.context.scene
    scene.frame_set(round(sum(rig.animation_data.action.frame_range) / 2))
    view = window.find_area("VIEW_3D").spaces.active.region_3d
    view.view_perspective = "ORTHO"
    view.view_rotation = Euler((1.4, 0, 0)).to_quaternion()
    bone = body.pose.bones[0]
    view.view_location = (body.matrix_world @ bone.matrix).translation
    view.view_location.x -= 0.5
    view.view_distance = 5
    yield 1
    window.save_picture(PICTURES / "rig.png")
    rig.location.x = 0


def check_the_map_and_the_export_draw():
    """Every part of the panel unfolded, with a map in it, draws without complaint."""
    from window import draw_unfolded

    panel = next(p for p in bpy.types.Panel.__subclasses__() if p.__name__ == "BEYOND_MOCAP_PT_rig")
    fold_again = draw_unfolded(panel)
    bpy.context.scene.beyond_mocap.rig.reduces = True
    area = window.find_area("VIEW_3D")
    yield from window.open_tab(area, TAB)
    yield from window.scroll_region(area, window.find_sidebar(area), 20.0)
    yield 0.5
    window.save_picture(PICTURES / "rig_panel.png")
    fold_again()


def check_export_from_the_window():
    """FBX and glTF are written from a window and leave it as it was."""
    name = bpy.context.scene.beyond_mocap.rig.target.name
    scene, shown = bpy.context.scene.name, [thing.name for thing in bpy.data.objects]
    for format, suffix in (("FBX", ".fbx"), ("GLB", ".glb"), ("BVH", ".bvh")):
        path = (PICTURES / f"rig{suffix}").resolve()
        with bpy.context.temp_override(window=window.window):
            bpy.ops.beyond_mocap.export_motion(filepath=str(path), format=format)
        assert path.stat().st_size > 1000
        yield 0.5
        assert bpy.context.scene.name == scene and [thing.name for thing in bpy.data.objects] == shown
        assert len(bpy.data.scenes) == 1 and bpy.data.objects[name].animation_data.action is not None
