"""Throws & Kicks in the window: a throw by its button, seen, undone, cancelled; the panel's time."""

import importlib
import time

import bpy
import numpy as np
from tab import (
    EXTENSION,
    PICTURES,
    assert_no_errors_since,
    click_operator,
    copy_sample,
    open_task,
    output,
    report_time,
    wait_until,
    wait_until_settled,
    window,
)


def find_body():
    """The armature; looked up each time, since undo replaces it."""
    return bpy.data.objects["Thrower"]


def create_scene():
    """A sample clip's armature, an Empty to hit, and the sample's library."""
    bpy.ops.wm.read_homefile(use_empty=True)
    yield 1
    scene = window.window.scene
    scene.render.fps = 30
    scene.beyond_mocap.library_folder = str(copy_sample() / "library")
    bpy.ops.beyond_mocap.import_clips(filepath=str(copy_sample() / "library" / "walking_1_2.bvh"))
    one = next(thing for thing in bpy.data.objects if thing.type == "ARMATURE")
    one.name = "Thrower"
    target = bpy.data.objects.new("Target", None)
    target.location, target.empty_display_type, target.empty_display_size = (16.0, 2.0, 1.2), "SPHERE", 0.3
    scene.collection.objects.link(target)
    one.beyond_mocap_throw.target, one.beyond_mocap_throw.frame = target, 70
    window.window.view_layer.objects.active = one
    bpy.ops.ed.undo_push(message="scene")
    kind = next(panel for panel in bpy.types.Panel.__subclasses__() if panel.__name__ == "BEYOND_MOCAP_PT_throws")
    if kind.bl_category != "Throw Check":
        bpy.utils.unregister_class(kind)
        kind.bl_category, kind.bl_options = "Throw Check", set()
        bpy.utils.register_class(kind)
    yield from open_task("BALL")
    yield from window.open_tab(window.find_area("VIEW_3D"), "Throw Check")
    yield 1


def save_picture(frame, name):
    """The body from the side on a frame, as a picture."""
    window.window.scene.frame_set(frame)
    one = find_body()
    hips = one.matrix_world @ one.pose.bones[0].head
    view = window.find_area("VIEW_3D").spaces.active.region_3d
    view.view_location, view.view_distance = (hips.x + 1.0, hips.y, 0.9), 6.0
    yield 0.5
    window.save_picture(PICTURES / f"throw-{name}.png")


def check_throw():
    """The button throws in the background; the picture shows ball and curve; one undo takes all away, one redo brings
    it back."""
    yield from create_scene()
    began = len(output.text())
    before = len(bpy.data.objects)
    yield from click_operator("throw_at_target")
    yield from wait_until(lambda: find_body().beyond_mocap_throw.made, what="a throw comes")
    yield from wait_until_settled()
    wish = find_body().beyond_mocap_throw
    assert abs(wish.release - 70.0) <= 0.51 and wish.flown is not None, wish.figures
    for frame, name in ((62, "windup"), (70, "release"), (76, "after")):
        yield from save_picture(frame, name)
    there, most = np.array(wish.target.location), 1e9
    for frame in range(71, 120):
        window.window.scene.frame_set(frame)
        most = min(most, float(np.linalg.norm(np.array(wish.flown.matrix_world.translation) - there)))
    assert most < 0.5, f"the ball passes the target by {most:.2f} m"  # whole frames only: 0.7 m apart at 20 m/s
    bpy.ops.ed.undo()
    yield from wait_until_settled()
    assert not find_body().beyond_mocap_throw.made and len(bpy.data.objects) == before
    bpy.ops.ed.redo()
    yield from wait_until_settled()
    assert find_body().beyond_mocap_throw.made == "throw"
    assert_no_errors_since(began)


def check_cancel():
    """ESC while it works changes nothing."""
    yield from create_scene()
    before = len(bpy.data.objects), len(bpy.data.actions)
    yield from click_operator("throw_at_target")
    yield from window.press_key("ESC")
    yield from wait_until_settled()
    yield 1
    assert not find_body().beyond_mocap_throw.made and (len(bpy.data.objects), len(bpy.data.actions)) == before


def check_panel_is_quick():
    """Drawing the panel takes no time to speak of."""
    yield from create_scene()
    panel = importlib.import_module(f"{EXTENSION}.panels.throws").BEYOND_MOCAP_PT_throws
    drawn, took = panel.draw, []

    def timed(self, context):
        start = time.perf_counter()
        drawn(self, context)
        took.append(time.perf_counter() - start)

    panel.draw = timed
    for _ in range(20):
        window.find_sidebar(window.find_area("VIEW_3D")).tag_redraw()
        yield 0.1
    panel.draw = drawn
    report_time("ms to draw Throws & Kicks", 1000.0 * float(np.median(took)), 2.0)


def throw_and_wait():
    """Throw, and wait until it is there."""
    yield from click_operator("throw_at_target")
    yield from wait_until(lambda: find_body().beyond_mocap_throw.made, what="a throw comes")
    yield from wait_until_settled()


def check_it_follows_its_target():
    """Moved, the target has the throw made again; one undo takes that back, and one more the drag."""
    yield from create_scene()
    began = len(output.text())
    yield from throw_and_wait()
    first, area = find_body().beyond_mocap_throw.figures, window.find_area("VIEW_3D")
    for thing in window.window.view_layer.objects:
        thing.select_set(thing.name == "Target")
    window.window.view_layer.objects.active = bpy.data.objects["Target"]
    with bpy.context.temp_override(window=window.window, area=area, region=area.regions[-1]):
        bpy.ops.transform.translate("EXEC_DEFAULT", True, value=(2.0, 3.0, 0.5))
    took = yield from wait_until(lambda: find_body().beyond_mocap_throw.figures != first, what="it follows")
    output.write_line(f"     followed after {took:.1f} s")
    window.save_picture(PICTURES / "throw-followed.png")
    there, most = np.array(bpy.data.objects["Target"].location), 1e9
    for frame in range(71, 130):
        window.window.scene.frame_set(frame)
        ball = find_body().beyond_mocap_throw.flown
        most = min(most, float(np.linalg.norm(np.array(ball.matrix_world.translation) - there)))
    assert most < 0.5, f"the ball passes the target by {most:.2f} m"
    for _ in range(2):
        bpy.ops.ed.undo()
        yield from wait_until_settled()
    assert np.allclose(bpy.data.objects["Target"].location, (16.0, 2.0, 1.2), atol=1e-4)
    assert find_body().beyond_mocap_throw.figures == first
    assert_no_errors_since(began)
