"""A track drawn in the window: its points dragged, the preview follows by itself; pins and the player's own choices."""

import time

import bpy
from tab import PICTURES, TAB, assert_no_trouble_since, output, room, run, sample, settings, settled, until, window


def player():
    """The drawn player."""
    return settings().players["Drawn"]


def made():
    """The player's newest take."""
    return room("scene.core.session").made(player().take)


def hips(frame):
    """Where the body's hips are in the world on a frame."""
    window.window.scene.frame_set(frame)
    body = player().body
    return (body.matrix_world @ body.pose.bones[0].head).copy()


def look_down(area, distance=30.0):
    """The view from above, on the middle of the curve."""
    view = area.spaces.active.region_3d
    view.view_perspective, view.view_rotation, view.view_distance = "ORTHO", (1, 0, 0, 0), distance
    view.view_location = (9.0, 0.0, 0.0)


def drawn():
    """An empty file with a drawn player who has been synthesized."""
    bpy.ops.wm.read_homefile(use_empty=True)
    yield 1.0
    settings().library_folder = str(sample() / "library")
    assert run("beyond_mocap.draw_track") == {"FINISHED"}
    area = window.area("VIEW_3D")
    yield from window.open_tab(area, TAB)
    look_down(area)
    run("beyond_mocap.synthesize")
    yield from settled()
    yield from until(lambda: player().take)


def check_the_preview_follows_a_dragged_point():
    mark = len(output.text())
    yield from drawn()
    area = window.area("VIEW_3D")
    settings().live = True
    yield 1.0
    yield from settled()
    first, before = made(), hips(60)
    bpy.context.view_layer.objects.active = player().drawn_track
    run("object.mode_set", "EXEC_DEFAULT", mode="EDIT")
    points = player().drawn_track.data.splines[0].bezier_points
    for number, point in enumerate(points):
        point.select_control_point = point.select_left_handle = point.select_right_handle = number == 1
    place = tuple(points[1].co)
    yield 0.5
    yield from window.move(area.x + area.width // 3, area.y + area.height // 2)
    yield from window.press("G")
    for _ in range(6):
        yield from window.move(window.pointer[0], window.pointer[1] + 12)
        yield 0.03
    yield from window.press("LEFTMOUSE")
    start = time.monotonic()
    moved = player().drawn_track.data.splines[0].bezier_points[1].co
    assert (moved - type(moved)(place)).length > 0.3, "the point was not dragged"
    yield from until(lambda: made() is not first)
    output.say(f"     the preview followed {time.monotonic() - start:.2f} s after the hand had let go")
    yield from settled()  # on a slow machine there may be several quick ones before the whole one
    assert not any(
        "cut short" in line for line in made().take.warnings
    ), "the whole take did not take the quick one's place"
    assert (hips(60) - before).length > 0.1, "the body is where it was"
    window.picture(PICTURES / "draw_live.png")
    last = made()
    yield 2.0
    yield from settled()
    assert made() is last, "Live goes on by itself"
    run("object.mode_set", "EXEC_DEFAULT", mode="OBJECT")
    assert_no_trouble_since(mark)


def check_a_pin_is_made_moved_and_followed():
    mark = len(output.text())
    window.window.scene.frame_set(80)
    yield 0.3
    assert run("beyond_mocap.add_pin", "EXEC_DEFAULT", part="right_hand", at="BODY") == {"FINISHED"}
    run("beyond_mocap.add_pin", "EXEC_DEFAULT", part="gaze", at="BODY")
    yield 1.0
    yield from settled()
    before, target = made(), player().pins[0].target
    target.location.z += 0.3
    yield from until(lambda: made() is not before)
    yield from settled()
    assert made().take.pins[0].miss < 0.02, made().take.pins
    area = window.area("VIEW_3D")
    view = area.spaces.active.region_3d
    view.view_perspective, view.view_location, view.view_distance = "PERSP", target.location, 4.0
    view.view_rotation = (0.75, 0.55, 0.22, 0.3)
    player().height, player().strong_foot = 1.9, "left"
    yield 1.0
    yield from settled()
    window.picture(PICTURES / "draw_pins.png")
    settings().live = False
    assert_no_trouble_since(mark)
