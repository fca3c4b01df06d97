"""Optical Markers in the window: a dropped recording becomes a cloud, the cloud a body, the body throws a ball."""

import time

import bpy
import mathutils
from ball_checks import choose, thing
from tab import (
    PICTURES,
    assert_no_trouble_since,
    output,
    press,
    room,
    run,
    sample,
    settled,
    until,
    wait_for_work,
    window,
)

MARKERS = "BEYOND_MOCAP_PT_markers"


def own_tab():
    """The panel alone in a tab of its own, so that its buttons are found quickly; returns what puts it back."""
    kind = next(panel for panel in bpy.types.Panel.__subclasses__() if panel.__name__ == MARKERS)
    was = kind.bl_category, kind.bl_options

    def place(category, options):
        bpy.utils.unregister_class(kind)
        kind.bl_category, kind.bl_options = category, options
        bpy.utils.register_class(kind)

    place("Markers Check", set())
    yield from window.open_tab(window.area("VIEW_3D"), "Markers Check")
    return lambda: place(*was)


def cloud():
    """What the dropped recording has become; looked up each time, since undo replaces it."""
    return thing("throw").beyond_mocap_cloud


def look(frame):
    """The thrower from the side."""
    view = window.area("VIEW_3D").spaces.active.region_3d
    view.view_perspective, view.view_distance, view.view_location = "PERSP", 4.5, (0.9, 0.0, 1.0)
    view.view_rotation = mathutils.Euler((1.45, 0.0, 0.3)).to_quaternion()
    window.window.scene.frame_set(frame)


def check_a_dropped_recording_becomes_a_cloud_that_plays():
    mark = len(output.text())
    bpy.ops.wm.read_homefile(use_empty=True)
    yield 1.0
    run("wm.drop_import_file", directory=f"{sample() / 'markers'}/", files=[{"name": "throw.c3d"}])
    yield from until(lambda: "throw" in bpy.data.objects)
    yield from settled()
    look(16)
    assert len(cloud().labels) == 46 and cloud().set_name == "driveline"
    graph = bpy.context.evaluated_depsgraph_get()
    spheres = [one.matrix_world.translation.copy() for one in graph.object_instances if one.is_instance]
    assert len(spheres) >= 40
    back = yield from own_tab()
    window.window.scene.frame_set(22)
    yield 1.0
    window.picture(PICTURES / "markers_cloud.png")
    back()
    assert_no_trouble_since(mark)


def check_vertices_are_assigned_in_edit_mode():
    mark = len(output.text())
    with bpy.context.temp_override(window=window.window):
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
    run("beyond_mocap.assign_markers", "EXEC_DEFAULT", segment="Hips")
    assert {row.segment for row in cloud().labels} == {"Hips"}
    yield 0.7
    window.picture(PICTURES / "markers_edit.png")
    with bpy.context.temp_override(window=window.window):
        bpy.ops.object.mode_set(mode="OBJECT")
    run("beyond_mocap.use_marker_set", "EXEC_DEFAULT", which="AUTO")
    assert len({row.segment for row in cloud().labels}) > 12
    assert_no_trouble_since(mark)


def check_escape_leaves_everything_as_it_was():
    mark, before = len(output.text()), len(bpy.data.objects)
    back = yield from own_tab()
    yield from press("reconstruct_markers")
    yield from until(lambda: bpy.context.window_manager.beyond_mocap_work.kind == "reconstruct markers")
    yield from window.press("ESC")
    yield from wait_for_work()
    assert len(bpy.data.objects) == before and not cloud().figures
    back()
    assert_no_trouble_since(mark)


def check_a_body_is_reconstructed_by_its_button():
    mark = len(output.text())
    back = yield from own_tab()
    start = time.monotonic()
    yield from press("reconstruct_markers")
    yield from until(lambda: cloud().figures)
    yield from settled()
    output.say(f"     {time.monotonic() - start:.1f} s; {' ; '.join(cloud().figures.splitlines())}")
    body = cloud().body
    look(10)
    yield 0.5
    hand = body.matrix_world @ body.pose.bones["RightHand"].head
    yield from window.move(300, 300)
    look(22)
    yield 1.0
    window.picture(PICTURES / "markers_body.png")
    assert (body.matrix_world @ body.pose.bones["RightHand"].head - hand).length > 0.1, "it does not move"
    places = dict(room("scene.markers.cloud").places_at(thing("throw"), 22))
    names = [row.name for row in cloud().labels]
    wrist = (places[names.index("RWRA")] + places[names.index("RWRB")]) / 2.0
    away = (body.matrix_world @ body.pose.bones["RightHand"].head - wrist).length
    output.say(f"     the wrist's joint and the middle of its markers: {1000.0 * away:.0f} mm")
    assert away < 0.06
    back()
    assert_no_trouble_since(mark)


def check_the_ball_leaves_the_hand():
    mark = len(output.text())
    choose("throw")
    run("beyond_mocap.find_release", "EXEC_DEFAULT")
    speed = float(cloud().release.split("Speed: ")[1].split()[0])
    output.say(f"     {speed:.1f} m/s, planted 28.15")
    assert abs(speed - 28.15) < 0.6
    for frame in (22, 25):
        look(frame)
        yield 1.0
        window.picture(PICTURES / f"markers_ball_{frame}.png")
    assert_no_trouble_since(mark)
