"""Riders among the rest: players' bodies in every state, other verbs about a body that rides, duplicates, other
files."""

import importlib
import re

import bpy
import numpy as np
import pytest
import sample_rigs as rigs
from test_path_edit import choose, walker
from test_players import match, ready, refused, session  # noqa: F401  (fixtures)
from test_result import look, one, poses  # noqa: F401
from undo import assert_one_step

FRAMES = (20, 100.5, 200)


@pytest.fixture
def part(extension):
    return lambda name: importlib.import_module(f"{extension.__name__}.scene.{name}")


def ride(body, part, scale=1.3):
    """Edit Path on a body, its curve then made larger, so that the body goes elsewhere."""
    choose(body)
    assert bpy.ops.beyond_mocap.edit_path() == {"FINISHED"}
    body.beyond_mocap_ride.curve.scale = (scale, scale, 1.0)
    bpy.context.view_layer.update()
    assert part("path_editing.live").update_all(bpy.context.scene) == 1
    assert "Error" not in body.beyond_mocap_ride.messages


@pytest.mark.parametrize("form", ["PREVIEW", "ACTION", "STRIPS"])
def test_a_result_rides_and_leaves_as_it_was(one, part, form):  # noqa: F811
    bpy.ops.beyond_mocap.synthesize()
    if form != "PREVIEW":
        bpy.ops.beyond_mocap.accept(form=form)
    body = one.body
    bpy.context.scene.frame_set(10)
    before, was, notes = look(one), poses(body, FRAMES), part("result.freshness").check_player(bpy.context.scene, one)
    bpy.context.scene.frame_set(10)
    ride(body, part)
    assert np.abs(poses(body, FRAMES) - was).max() > 0.3
    assert part("result.freshness").check_player(bpy.context.scene, one) == notes
    assert len(part("result.manual_keys").find_in_body(body)[0]) == 0
    choose(body)
    assert bpy.ops.beyond_mocap.leave_path() == {"FINISHED"}
    np.testing.assert_array_equal(poses(body, FRAMES), was)
    bpy.context.scene.frame_set(10)
    assert look(one) == before


def test_hand_made_keys_are_known_while_the_body_rides(one, part):  # noqa: F811
    bpy.ops.beyond_mocap.synthesize()
    action, slot = part("core.channels").find_playing_action(one.body)
    curve = next(iter(part("core.channels").collect_curves(action, slot).values()))
    curve.keyframe_points[50].co.y += 0.1
    curve.keyframe_points[50].type = "KEYFRAME"
    notes = part("result.freshness").check_player(bpy.context.scene, one)[1]
    assert len(notes) == 1
    ride(one.body, part)
    assert part("result.freshness").check_player(bpy.context.scene, one)[1] == notes
    assert bpy.ops.beyond_mocap.update(player=one.name) == {"FINISHED"}
    assert one.result.hand_keys == 1 and not one.body.beyond_mocap_ride.on


@pytest.mark.parametrize("verb", ["accept", "discard", "synthesize", "remove_player"])
def test_who_makes_another_result_leaves_the_path_first(one, part, verb):  # noqa: F811
    bpy.ops.beyond_mocap.synthesize()
    body = one.body
    was = poses(body, FRAMES)
    ride(body, part)
    curve = body.beyond_mocap_ride.curve
    settings = bpy.context.scene.beyond_mocap
    settings.active_player = settings.players.find(one.name)
    assert getattr(bpy.ops.beyond_mocap, verb)() == {"FINISHED"}
    assert curve.name in bpy.context.scene.objects
    assert not [action.name for action in bpy.data.actions if action.get("beyond_mocap_ride")]
    if verb == "discard":
        assert body is None or one.body is None
        return
    assert not body.beyond_mocap_ride.on
    np.testing.assert_array_equal(poses(body, FRAMES), was)
    if verb == "synthesize":
        assert "path edit reverted" in one.warnings


def test_a_motion_that_was_kept_is_the_users_own(one, part):  # noqa: F811
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept(form="STRIPS")
    body = one.body
    ride(body, part)
    seen = poses(body, FRAMES)
    choose(body)
    assert_one_step(bpy.ops.beyond_mocap.bake_path)
    body = bpy.context.scene.beyond_mocap.players[0].body
    np.testing.assert_allclose(poses(body, FRAMES), seen, atol=1e-6)
    made = part("core.channels").find_playing_action(body)[0]
    assert not [name for name in made.keys() if name.startswith("beyond_mocap_ride")]
    assert bpy.ops.beyond_mocap.synthesize() == {"FINISHED"}
    assert bpy.ops.beyond_mocap.discard() == {"FINISHED"}
    np.testing.assert_allclose(poses(body, FRAMES), seen, atol=1e-6)


def test_bake_to_rig_and_export_take_what_is_seen(part, tmp_path):
    bpy.context.scene.render.fps = 30
    body = walker()
    ride(body, part)
    rig = rigs.create_unreal()
    settings = bpy.context.scene.beyond_mocap.rig
    settings.source, settings.target = body, rig
    bpy.ops.beyond_mocap.map_bones()
    assert bpy.ops.beyond_mocap.bake_to_rig() == {"FINISHED"}
    frames = (1, 20, 35)
    seen, onto = rigs.read_heads(body, ["Hips"], frames), rigs.read_heads(rig, ["pelvis"], frames)
    assert np.linalg.norm((seen - onto)[..., :2], axis=-1).max() < 0.1
    choose(body)
    assert bpy.ops.beyond_mocap.export_motion(filepath=str(tmp_path / "out.bvh"), format="BVH") == {"FINISHED"}
    assert body.beyond_mocap_ride.on


def test_baking_onto_a_rig_that_rides_takes_it_off_its_path(part):
    bpy.context.scene.render.fps = 30
    body, rig = walker(), rigs.create_unreal()
    settings = bpy.context.scene.beyond_mocap.rig
    settings.source, settings.target = body, rig
    bpy.ops.beyond_mocap.map_bones()
    bpy.ops.beyond_mocap.bake_to_rig()
    ride(rig, part)
    assert bpy.ops.beyond_mocap.bake_to_rig() == {"FINISHED"}
    assert not rig.beyond_mocap_ride.on and "path edit reverted" in settings.messages
    assert bpy.ops.beyond_mocap.unbake() == {"FINISHED"} and rig.animation_data.action is None


def test_verbs_that_write_a_motion_ask_to_keep_or_leave_first(part):
    body = walker()
    ride(body, part)
    choose(body)
    refused(bpy.ops.beyond_mocap.mirror, "press Apply or Revert")
    assert body.beyond_mocap_ride.on and body.animation_data.action.get("beyond_mocap_ride")


@pytest.mark.parametrize("how", ["duplicate", "linked duplicate", "copy"])
def test_a_duplicate_is_a_rider_of_its_own(part, how):
    body, scene = walker(), bpy.context.scene
    ride(body, part)
    choose(body)
    if how == "copy":
        other = body.copy()
        scene.collection.objects.link(other)
    else:
        bpy.ops.object.duplicate(linked=how == "linked duplicate")
        other = bpy.context.object
    bpy.context.view_layer.update()
    assert other != body and other.beyond_mocap_ride.on
    part("path_editing.live").update_all(scene)
    assert other.animation_data.action != body.animation_data.action
    was = poses(body, (20,))
    other.beyond_mocap_ride.speed = 1.7
    bpy.context.view_layer.update()
    assert part("path_editing.live").update_all(scene) == 1
    np.testing.assert_array_equal(poses(body, (20,)), was)
    assert np.abs(poses(other, (20,)) - was).max() > 0.05
    choose(other)
    bpy.ops.beyond_mocap.leave_path()
    assert body.beyond_mocap_ride.on and part("path_editing.live").update_all(scene) == 0
    np.testing.assert_array_equal(poses(body, (20,)), was)
    choose(body)
    bpy.ops.beyond_mocap.leave_path()
    np.testing.assert_array_equal(poses(body, (20,)), poses(other, (20,)))


def test_names_may_change_and_armature_or_curve_may_go(part):
    body, scene = walker(), bpy.context.scene
    ride(body, part)
    body.name, body.data.name, body.beyond_mocap_ride.curve.name = "Walker", "Bones", "Way"
    body.beyond_mocap_ride.curve.location.x += 1.0
    bpy.context.view_layer.update()
    assert part("path_editing.live").update_all(scene) == 1
    assert re.fullmatch("the motion ends .* m before the end of the path: .*", body.beyond_mocap_ride.messages)
    was = poses(body, (20,))
    bpy.data.objects.remove(bpy.data.objects["Way"])
    bpy.context.view_layer.update()
    assert part("path_editing.live").update_all(scene) == 0 and "curve" in body.beyond_mocap_ride.messages
    np.testing.assert_array_equal(poses(body, (20,)), was)
    choose(body)
    assert bpy.ops.beyond_mocap.leave_path() == {"FINISHED"}
    bpy.ops.beyond_mocap.edit_path()
    bpy.data.objects.remove(body)
    bpy.context.view_layer.update()
    assert part("path_editing.live").update_all(scene) == 0


def test_a_rider_is_saved_opened_and_appended(part, tmp_path):
    bpy.context.scene.render.fps = 30
    body = walker()
    ride(body, part)
    was, file = poses(body, (20,)), str(tmp_path / "rider.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.ops.wm.open_mainfile(filepath=file)
    body = next(thing for thing in bpy.context.scene.objects if thing.type == "ARMATURE")
    part("path_editing.live").update_all(bpy.context.scene)
    np.testing.assert_allclose(poses(body, (20,)), was, atol=1e-6)
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.context.scene.render.fps = 30
    bpy.ops.wm.append(directory=f"{file}/Object/", filename=body_name(file))
    body = next(thing for thing in bpy.context.scene.objects if thing.type == "ARMATURE")
    bpy.context.view_layer.update()
    part("path_editing.live").update_all(bpy.context.scene)
    np.testing.assert_allclose(poses(body, (20,)), was, atol=1e-6)
    choose(body)
    assert bpy.ops.beyond_mocap.leave_path() == {"FINISHED"}
    assert np.abs(poses(body, (20,)) - was).max() > 0.02


def body_name(file):
    with bpy.data.libraries.load(file) as (theirs, _):
        return next(name for name in theirs.objects if "path" not in name)
