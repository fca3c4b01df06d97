"""Edits of a take in the window: a footprint is dragged and the take follows; own keys are a layer with a slider."""

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from tab import (
    PICTURES,
    TAB,
    assert_no_errors_since,
    copy_sample,
    get_settings,
    import_module,
    output,
    report_time,
    run_operator,
    wait_until,
    wait_until_settled,
    window,
)
from window import draw_unfolded


def open_take():
    """The sample with a take of the first player, seen from above; other players are off."""
    bpy.ops.wm.open_mainfile(filepath=str(copy_sample() / "quickstart.blend"))
    yield 1.0
    yield from window.open_tab(window.find_area("VIEW_3D"), TAB)
    for number, player in enumerate(get_settings().players):
        player.use = number == 0
    get_settings().active_player = 0
    run_operator("beyond_mocap.synthesize")
    yield from wait_until_settled()


def look_down(place, distance=5.0):
    """Look at a place (x, y) from above."""
    space = window.find_area("VIEW_3D").spaces.active
    space.region_3d.view_perspective = "ORTHO"
    space.region_3d.view_rotation = (1.0, 0.0, 0.0, 0.0)
    space.region_3d.view_location, space.region_3d.view_distance = (*place, 0.0), distance
    yield 0.5


def find_pixel(place):
    """Where a place on the ground (x, y) is in the window."""
    area = window.find_area("VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    x, y = location_3d_to_region_2d(region, area.spaces.active.region_3d, (*place, 0.0))
    return region.x + x, region.y + y


def list_contacts():
    """The contacts of the first player's newest take."""
    edits = import_module("scene.player.contact_edits")
    return edits.list_contacts(edits.find_take(get_settings().players[0]))


def has_no_work():
    """No take is computed."""
    return not bpy.context.window_manager.beyond_mocap_work.kind


def find_middle(contact):
    """Middle (2,) m of a footprint."""
    return 0.5 * (contact.heel + contact.toe)


def check_a_footprint_is_dragged_and_the_take_follows():
    yield from open_take()
    mark, player = len(output.text()), get_settings().players[0]
    chosen = next(contact for contact in list_contacts() if contact.foot == "left" and contact.start > 3.0)
    clock = import_module("scene.core.measure").build_scene_clock(bpy.context.scene)
    bpy.context.scene.frame_set(clock.to_whole_frame(chosen.middle))
    yield from look_down(find_middle(chosen))
    run_operator("beyond_mocap.fix_foot")
    yield from window.move_pointer(*find_pixel(find_middle(chosen)))
    yield 0.5
    window.save_picture(PICTURES / "edits-footprints.png")
    take = player.take
    window.send_event("LEFTMOUSE", "PRESS")
    yield 0.2
    goal = find_middle(chosen) + [0.12, 0.15]
    for share in (0.3, 0.7, 1.0):
        yield from window.move_pointer(*find_pixel(find_middle(chosen) + share * np.array([0.12, 0.15])))
        yield 0.2
    window.save_picture(PICTURES / "edits-dragged.png")
    window.send_event("LEFTMOUSE", "RELEASE")
    seconds = yield from wait_until(lambda: get_settings().players[0].take != take)
    report_time("a dragged footprint, until the take follows", seconds, 3.0)
    yield from wait_until(has_no_work)  # Fix Foot itself still runs
    now = next(contact for contact in list_contacts() if contact.foot == "left"
               and contact.start <= chosen.middle <= contact.end)
    assert np.linalg.norm(find_middle(now) - goal) < 0.02, (find_middle(now), goal)
    yield from window.press_key("NUMPAD_PLUS")
    yield 0.5
    yield from wait_until(has_no_work)
    yield 1.0
    window.save_picture(PICTURES / "edits-follows.png")
    assert len(get_settings().players[0].contact_edits) == 1 and get_settings().players[0].contact_edits[0].end > 0.0
    yield from window.press_key("ESC")
    yield from wait_until_settled()
    assert not import_module("scene.overlays.contact_handles").list_items(bpy.context.scene)
    assert get_settings().players[0].quality  # the figures are back
    assert_no_errors_since(mark)


def check_own_keys_are_a_layer_with_a_slider():
    yield from open_take()
    mark, body = len(output.text()), get_settings().players[0].body
    bpy.context.scene.frame_set(100)
    arm = body.pose.bones["LeftArm"]
    arm.rotation_quaternion = (0.5, -0.5, 0.5, 0.5)
    arm.keyframe_insert("rotation_quaternion", frame=100)
    run_operator("beyond_mocap.keep_as_layer", "EXEC_DEFAULT")
    panel = next(p for p in bpy.types.Panel.__subclasses__() if p.__name__ == "BEYOND_MOCAP_PT_result")
    fold_again = draw_unfolded(panel)
    area = window.find_area("VIEW_3D")
    yield from window.scroll_region(area, window.find_sidebar(area), 3.0)
    yield 1.0
    window.save_picture(PICTURES / "edits-layer.png")
    fold_again()
    assert_no_errors_since(mark)
