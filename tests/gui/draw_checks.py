"""A track drawn in the window: its points dragged, the preview follows by itself; pins and the player's own choices."""

import time

import bpy
from tab import (
    PICTURES,
    TAB,
    assert_no_errors_since,
    copy_sample,
    get_settings,
    import_module,
    output,
    run_operator,
    wait_until,
    wait_until_settled,
    window,
)


def get_player():
    """The drawn player."""
    return get_settings().players["Drawn"]


def get_take():
    """The player's newest take."""
    return import_module("scene.core.session").find_take(get_player().take)


def measure_hips(frame):
    """Where the body's hips are in the world on a frame."""
    window.window.scene.frame_set(frame)
    body = get_player().body
    return (body.matrix_world @ body.pose.bones[0].head).copy()


def look_down(area, distance=30.0):
    """The view from above, on the middle of the curve."""
    view = area.spaces.active.region_3d
    view.view_perspective, view.view_rotation, view.view_distance = "ORTHO", (1, 0, 0, 0), distance
    view.view_location = (9.0, 0.0, 0.0)


def draw_and_synthesize():
    """An empty file with a drawn player who has been synthesized."""
    bpy.ops.wm.read_homefile(use_empty=True)
    yield 1.0
    get_settings().library_folder = str(copy_sample() / "library")
    assert run_operator("beyond_mocap.draw_track") == {"FINISHED"}
    area = window.find_area("VIEW_3D")
    yield from window.open_tab(area, TAB)
    run_operator("beyond_mocap.synthesize")
    yield from wait_until_settled()
    yield from wait_until(lambda: get_player().take)
    look_down(area)  # synthesis has moved the view to the body


def check_the_preview_follows_a_dragged_point():
    mark = len(output.text())
    yield from draw_and_synthesize()
    area = window.find_area("VIEW_3D")
    get_settings().live = True
    yield 1.0
    yield from wait_until_settled()
    first, before = get_take(), measure_hips(60)
    bpy.context.view_layer.objects.active = get_player().drawn_track
    run_operator("object.mode_set", "EXEC_DEFAULT", mode="EDIT")
    points = get_player().drawn_track.data.splines[0].bezier_points
    for number, point in enumerate(points):
        point.select_control_point = point.select_left_handle = point.select_right_handle = number == 1
    place = tuple(points[1].co)
    yield 0.5
    yield from window.move_pointer(area.x + area.width // 3, area.y + area.height // 2)
    yield from window.press_key("G")
    for _ in range(6):
        yield from window.move_pointer(window.pointer[0], window.pointer[1] + 12)
        yield 0.03
    yield from window.press_key("LEFTMOUSE")
    start = time.monotonic()
    moved = get_player().drawn_track.data.splines[0].bezier_points[1].co
    assert (moved - type(moved)(place)).length > 0.3, "the point was not dragged"
    yield from wait_until(lambda: get_take() is not first)
    output.write_line(f"     the preview followed {time.monotonic() - start:.2f} s after the hand had let go")
    yield from wait_until_settled()  # on a slow machine there may be several quick ones before the whole one
    assert not any(
        "cut short" in line for line in get_take().take.warnings
    ), "the whole take did not take the quick one's place"
    assert (measure_hips(60) - before).length > 0.1, "the body is where it was"
    window.save_picture(PICTURES / "draw_live.png")
    last = get_take()
    yield 2.0
    yield from wait_until_settled()
    assert get_take() is last, "Live goes on by itself"
    run_operator("object.mode_set", "EXEC_DEFAULT", mode="OBJECT")
    assert_no_errors_since(mark)


def check_a_pin_is_created_moved_and_followed():
    mark = len(output.text())
    window.window.scene.frame_set(80)
    yield 0.3
    assert run_operator("beyond_mocap.add_pin", "EXEC_DEFAULT", part="right_hand", at="BODY") == {"FINISHED"}
    run_operator("beyond_mocap.add_pin", "EXEC_DEFAULT", part="gaze", at="BODY")
    yield 1.0
    yield from wait_until_settled()
    before, target = get_take(), get_player().pins[0].target
    target.location.z += 0.3
    yield from wait_until(lambda: get_take() is not before)
    yield from wait_until_settled()
    assert get_take().take.pins[0].miss < 0.02, get_take().take.pins
    area = window.find_area("VIEW_3D")
    view = area.spaces.active.region_3d
    view.view_perspective, view.view_location, view.view_distance = "PERSP", target.location, 4.0
    view.view_rotation = (0.75, 0.55, 0.22, 0.3)
    get_player().height, get_player().strong_foot = 1.9, "left"
    yield 1.0
    yield from wait_until_settled()
    window.save_picture(PICTURES / "draw_pins.png")
    get_settings().live = False
    assert_no_errors_since(mark)


def check_a_heading_key_is_faced_and_drawn():
    mark, scene = len(output.text()), window.window.scene
    player, view = get_player(), get_settings().view
    flag = bpy.data.objects.new("Flag", None)
    scene.collection.objects.link(flag)
    flag.location = (9.0, 20.0, 0.0)
    window.window.view_layer.objects.active = flag
    flag.select_set(True)
    scene.frame_set(1)
    view.heading, get_settings().live = True, True
    yield 1.0
    yield from wait_until_settled()
    before = get_take()
    assert run_operator("beyond_mocap.add_heading_key", "EXEC_DEFAULT", faces="OBJECT", hold=60.0) == {"FINISHED"}
    yield from wait_until(lambda: get_take() is not before)
    yield from wait_until_settled()
    store, draw = import_module("scene.overlays.store"), import_module("scene.overlays.draw")
    yield from wait_until(lambda: store.find_prepared(player.take))
    look_down(window.find_area("VIEW_3D"), 18.0)
    yield from wait_until(lambda: (player.take, "heading") in draw._batches, what="arrows are drawn")
    window.save_picture(PICTURES / "draw_heading.png")
    (_, arrows) = store.find_prepared(player.take).meshes["heading"]
    assert (arrows.points[:, 1].reshape(-1, 6)[:, 1] > arrows.points[:, 1].reshape(-1, 6)[:, 0]).mean() > 0.8
    get_settings().live = False
    assert_no_errors_since(mark)
