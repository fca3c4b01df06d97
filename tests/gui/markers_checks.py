"""Optical Markers in the window: a dropped recording becomes a cloud, the cloud a body, the body throws a ball."""

import time

import bpy
import mathutils
from ball_checks import find_object, select_objects
from tab import (
    PICTURES,
    assert_no_errors_since,
    click_operator,
    copy_sample,
    import_module,
    open_task,
    output,
    run_operator,
    wait_for_work,
    wait_until,
    wait_until_settled,
    window,
)

MARKERS = "BEYOND_MOCAP_PT_markers"


def isolate_panel():
    """The panel alone in a tab of its own, so that its buttons are found quickly; returns what puts it back."""
    kind = next(panel for panel in bpy.types.Panel.__subclasses__() if panel.__name__ == MARKERS)
    was = kind.bl_category, getattr(kind, "bl_options", set())

    def place_panel(category, options):
        bpy.utils.unregister_class(kind)
        kind.bl_category, kind.bl_options = category, options
        bpy.utils.register_class(kind)

    yield from open_task("MARKERS")
    place_panel("Markers Check", set())
    yield from window.open_tab(window.find_area("VIEW_3D"), "Markers Check")
    return lambda: place_panel(*was)


def find_cloud():
    """What the dropped recording has become; looked up each time, since undo replaces it."""
    return find_object("throw").beyond_mocap_cloud


def set_view(frame):
    """The thrower from the side."""
    view = window.find_area("VIEW_3D").spaces.active.region_3d
    view.view_perspective, view.view_distance, view.view_location = "PERSP", 4.5, (0.9, 0.0, 1.0)
    view.view_rotation = mathutils.Euler((1.45, 0.0, 0.3)).to_quaternion()
    window.window.scene.frame_set(frame)


def check_a_dropped_recording_becomes_a_cloud_that_plays():
    mark = len(output.text())
    bpy.ops.wm.read_homefile(use_empty=True)
    yield 1.0
    run_operator("wm.drop_import_file", directory=f"{copy_sample() / 'markers'}/", files=[{"name": "throw.c3d"}])
    yield from wait_until(lambda: "throw" in bpy.data.objects)
    yield from wait_until_settled()
    set_view(16)
    assert len(find_cloud().labels) == 46 and find_cloud().set_name == "driveline"
    graph = bpy.context.evaluated_depsgraph_get()
    spheres = [one.matrix_world.translation.copy() for one in graph.object_instances if one.is_instance]
    assert len(spheres) >= 40
    back = yield from isolate_panel()
    window.window.scene.frame_set(22)
    yield 1.0
    window.save_picture(PICTURES / "markers_cloud.png")
    back()
    assert_no_errors_since(mark)


def check_vertices_are_assigned_in_edit_mode():
    mark = len(output.text())
    with bpy.context.temp_override(window=window.window):
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
    run_operator("beyond_mocap.assign_markers", "EXEC_DEFAULT", segment="Hips")
    assert {row.segment for row in find_cloud().labels} == {"Hips"}
    yield 0.7
    window.save_picture(PICTURES / "markers_edit.png")
    with bpy.context.temp_override(window=window.window):
        bpy.ops.object.mode_set(mode="OBJECT")
    run_operator("beyond_mocap.use_marker_set", "EXEC_DEFAULT", which="AUTO")
    assert len({row.segment for row in find_cloud().labels}) > 12
    assert_no_errors_since(mark)


def check_escape_leaves_everything_as_it_was():
    mark, before = len(output.text()), len(bpy.data.objects)
    back = yield from isolate_panel()
    yield from click_operator("reconstruct_markers")
    yield from wait_until(lambda: bpy.context.window_manager.beyond_mocap_work.kind == "reconstruct markers")
    yield from window.press_key("ESC")
    yield from wait_for_work()
    assert len(bpy.data.objects) == before and not find_cloud().figures
    back()
    assert_no_errors_since(mark)


def check_a_body_is_reconstructed_by_its_button():
    mark = len(output.text())
    back = yield from isolate_panel()
    start = time.monotonic()
    yield from click_operator("reconstruct_markers")
    yield from wait_until(lambda: find_cloud().figures)
    yield from wait_until_settled()
    output.write_line(f"     {time.monotonic() - start:.1f} s; {' ; '.join(find_cloud().figures.splitlines())}")
    body = find_cloud().body
    set_view(10)
    yield 0.5
    hand = body.matrix_world @ body.pose.bones["RightHand"].head
    yield from window.move_pointer(300, 300)
    set_view(22)
    yield 1.0
    window.save_picture(PICTURES / "markers_body.png")
    assert (body.matrix_world @ body.pose.bones["RightHand"].head - hand).length > 0.1, "it does not move"
    places = dict(import_module("scene.markers.cloud").sample_places(find_object("throw"), 22))
    names = [row.name for row in find_cloud().labels]
    wrist = (places[names.index("RWRA")] + places[names.index("RWRB")]) / 2.0
    away = (body.matrix_world @ body.pose.bones["RightHand"].head - wrist).length
    output.write_line(f"     the wrist's joint and the middle of its markers: {1000.0 * away:.0f} mm")
    assert away < 0.06
    back()
    assert_no_errors_since(mark)


def check_the_ball_leaves_the_hand():
    mark = len(output.text())
    select_objects("throw")
    run_operator("beyond_mocap.find_release", "EXEC_DEFAULT")
    speed = float(find_cloud().release.split("Speed: ")[1].split()[0])
    output.write_line(f"     {speed:.1f} m/s, planted 28.15")
    assert abs(speed - 28.15) < 0.6
    for frame in (22, 25):
        set_view(frame)
        yield 1.0
        window.save_picture(PICTURES / f"markers_ball_{frame}.png")
    assert_no_errors_since(mark)
