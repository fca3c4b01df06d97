"""Hand-made keys are recognised whatever was done, and stay exactly when a take is made anew."""

import importlib

import bpy
import numpy as np
import pytest
from test_players import match, ready, refused, session  # noqa: F401  (fixtures)
from test_result import one, poses  # noqa: F401  (fixture)


@pytest.fixture
def room(extension):
    return lambda name: importlib.import_module(f"{extension.__name__}.scene.{name}")


@pytest.fixture
def accepted(one):  # noqa: F811
    """One player with an accepted action; the body."""
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept()
    return one.body


def curves(room, body):
    action, slot = room("core.channels").find_playing_action(body)
    return room("core.channels").collect_curves(action, slot)


def keys(room, body):
    return {place: room("core.channels").read_keys(curve) for place, curve in curves(room, body).items()}


def at(table, frame):
    """The key of a table on a frame."""
    return {name: values[np.abs(table["co"][:, 0] - frame) < 1e-3] for name, values in table.items()}


def found(room, body):
    return room("result.manual_keys").find_manual_keys(*room("core.channels").find_playing_action(body))


def test_nothing_is_found_on_what_was_made(room, accepted):
    assert len(found(room, accepted)) == 0
    bpy.ops.wm.save_as_mainfile(filepath=bpy.app.tempdir + "kept.blend")
    bpy.ops.wm.open_mainfile(filepath=bpy.app.tempdir + "kept.blend")
    assert len(found(room, bpy.context.scene.beyond_mocap.players[0].body)) == 0


def by_hand(room, body):
    """Everything a user may do; returns what has to be there afterwards: (place, frame) -> keys, and frames gone."""
    arm, spine = body.pose.bones["LeftArm"], body.pose.bones["Spine"]
    bpy.context.scene.frame_set(50)
    arm.rotation_quaternion = (0.5, 0.5, 0.5, 0.5)
    arm.keyframe_insert("rotation_quaternion", frame=50)  # over a generated key
    arm.keyframe_insert("rotation_quaternion", frame=60.5)  # between two
    spine.location = (0.1, 0.2, 0.3)
    spine.keyframe_insert("location", frame=70)  # a channel that had none
    by_place = curves(room, body)
    hips = by_place['pose.bones["Hips"].location', 2]
    moved = next(key for key in hips.keyframe_points if abs(key.co[0] - 80) < 1e-3)
    moved.co = (80.25, moved.co[1] + 0.1)
    moved.interpolation = "BEZIER"
    hips.update()
    head = by_place['pose.bones["Head"].rotation_quaternion', 1]
    for frame in (90, 91, 92):
        key = next(key for key in head.keyframe_points if abs(key.co[0] - frame) < 1e-3)
        head.keyframe_points.remove(key)
    knee = by_place['pose.bones["LeftLeg"].rotation_quaternion', 0]
    pinned = next(key for key in knee.keyframe_points if abs(key.co[0] - 95) < 1e-3)
    pinned.type = "EXTREME"
    table = keys(room, body)
    asked = {}
    for index in range(4):
        asked['pose.bones["LeftArm"].rotation_quaternion', index] = (50, 60.5)
        asked['pose.bones["LeftLeg"].rotation_quaternion', index] = (95,)
    for index in range(3):
        asked['pose.bones["Spine"].location', index] = (70,)
    asked['pose.bones["Hips"].location', 2] = (80.25,)
    expected = {(place, frame): at(table[place], frame) for place, frames in asked.items() for frame in frames}
    return expected, (('pose.bones["Head"].rotation_quaternion', 1), (90, 91, 92))


def assert_there(room, body, expected, gone):
    table = keys(room, body)
    for (place, frame), before in expected.items():
        now = at(table[place], frame)
        for name, values in before.items():
            if name in ("handle_left", "handle_right") and before["interpolation"][0] == 1:
                continue  # Blender works out handles of straight lines anew
            np.testing.assert_array_equal(now[name], values, err_msg=f"{place} {frame} {name}")
    place, frames = gone
    assert not any(len(at(table[place], frame)["co"]) for frame in frames)
    assert len(at(table['pose.bones["Hips"].location', 2], 80)["co"]) == 0


def test_all_that_a_user_may_do_is_recognised_and_stays(room, accepted, one):  # noqa: F811
    expected, gone = by_hand(room, accepted)
    assert len(found(room, accepted)) == 1 + 1 + 1 + 2 + 3 + 1  # a moved key is a new one, and one that is gone
    one.annotation_file = ""
    bpy.context.scene.beyond_mocap.alpha = 0.35
    bpy.ops.beyond_mocap.synthesize()
    assert one.result.hand_keys == 9
    assert_there(room, accepted, expected, gone)
    bpy.ops.beyond_mocap.accept()
    assert_there(room, accepted, expected, gone)
    bpy.ops.beyond_mocap.synthesize()
    assert one.result.hand_keys == 9  # and again
    assert_there(room, accepted, expected, gone)
    bpy.context.scene.beyond_mocap.keep_hand_keys = False
    bpy.ops.beyond_mocap.synthesize()
    assert one.result.hand_keys == 0 and len(found(room, accepted)) == 0


def test_on_strips_too(room, accepted, one):  # noqa: F811
    expected, gone = by_hand(room, accepted)
    frames = np.arange(40, 110, 0.37)
    before = poses(accepted, frames)
    bpy.ops.beyond_mocap.accept(form="STRIPS")
    np.testing.assert_allclose(poses(accepted, frames), before, atol=1e-5)
    bpy.ops.beyond_mocap.synthesize()
    assert one.result.hand_keys == 9
    assert_there(room, accepted, expected, gone)
    bpy.ops.beyond_mocap.accept(form="STRIPS")
    bpy.ops.beyond_mocap.accept(form="ACTION")
    assert_there(room, accepted, expected, gone)
    assert len(found(room, accepted)) == 9


def test_a_locked_channel_stays_as_a_whole(room, accepted, one):  # noqa: F811
    place = ('pose.bones["Hips"].location', 2)
    curves(room, accepted)[place].lock = True
    before = keys(room, accepted)[place]["co"]
    bpy.context.scene.beyond_mocap.alpha = 0.5
    one.annotation_file = ""
    bpy.ops.beyond_mocap.synthesize()
    np.testing.assert_array_equal(keys(room, accepted)[place]["co"], before)
    assert curves(room, accepted)[place].lock


def test_keys_move_with_the_start_frame(room, accepted, one):  # noqa: F811
    accepted.pose.bones["LeftArm"].keyframe_insert("rotation_quaternion", frame=50.5)
    bpy.context.scene.beyond_mocap.start_frame = 101
    bpy.ops.beyond_mocap.synthesize()
    table = keys(room, accepted)['pose.bones["LeftArm"].rotation_quaternion', 0]
    assert len(at(table, 150.5)["co"]) == 1 and len(at(table, 50.5)["co"]) == 0


def test_an_update_keeps_them_and_tells(room, accepted, one):  # noqa: F811
    expected, gone = by_hand(room, accepted)
    bpy.ops.beyond_mocap.update()
    assert_there(room, accepted, expected, gone)


def test_an_action_of_the_user_s_own_is_no_concern(room, accepted):
    own = bpy.data.actions.new("own")
    own.slots.new("OBJECT", "own")
    assert len(room("result.manual_keys").find_manual_keys(own, own.slots[0])) == 0
