"""Throws and kicks in Blender: the ball hits, is in the hand before, and all can be taken back."""

import importlib
import json
import pathlib
import re

import bpy
import numpy as np
import path_edit_rigs
import pytest
import sample_rigs as rigs
import worlds
from conftest import EXTENSION
from throw_models import write_model_file
from undo import assert_one_step, collect_state, press_operator

SAMPLE = pathlib.Path(__file__).resolve().parents[3] / "sample_blend" / "library"
TARGET = (18.0, 1.0, 1.2)


@pytest.fixture(autouse=True)
def usual_model(monkeypatch):
    """Bodies throw by that model."""
    files = importlib.import_module(f"{EXTENSION}.beyond_mocap.throws.network_npz")
    shipped = files.read_shipped_model
    monkeypatch.setattr(files, "read_shipped_model", lambda name: files.read_model(write_model_file(name))
                        if name in ("throw", "kick") else shipped(name))


@pytest.fixture
def room():
    return lambda name: importlib.import_module(f"{EXTENSION}.scene.{name}")


@pytest.fixture(scope="module")
def clips(tmp_path_factory):
    return worlds.make_places(tmp_path_factory.mktemp("throws")).clips


def a_body(clip="standing_1", target=TARGET, frame=60, fps=(30, 1.0)):
    """An armature that plays a clip, and an Empty that it is to hit."""
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = fps
    bpy.ops.beyond_mocap.import_clips(filepath=str(SAMPLE / f"{clip}.bvh"))
    body = bpy.context.object
    wish = body.beyond_mocap_throw
    wish.target = an_empty(target)
    wish.frame = frame
    return body


def an_empty(place):
    empty = bpy.data.objects.new("Target", None)
    empty.location = place
    bpy.context.scene.collection.objects.link(empty)
    bpy.context.view_layer.update()
    return empty


def ball_at(ball, frame):
    whole = int(np.floor(frame))
    bpy.context.scene.frame_set(whole, subframe=frame - whole)
    return np.array(ball.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world.translation)


def closest(ball, target, first, last):
    """How near the ball comes to a place, between frames too: its way is straight from each to the next."""
    places = np.array([ball_at(ball, frame) for frame in range(first, last)])
    step = places[1:] - places[:-1]
    share = np.clip(np.sum((target - places[:-1]) * step, axis=1) / np.maximum(np.sum(step**2, axis=1), 1e-12), 0, 1)
    return np.linalg.norm(places[:-1] + share[:, None] * step - target, axis=1).min()


@pytest.mark.parametrize("fps", [(30, 1.0), (24, 1.001)])
def test_the_ball_leaves_the_hand_and_hits(room, fps):
    body = a_body(fps=fps)
    assert press_operator(bpy.ops.beyond_mocap.throw_at_target) == {"FINISHED"}
    wish = body.beyond_mocap_throw
    assert wish.made == "throw" and abs(wish.release - 60.0) <= 0.51
    ball, first = wish.flown, int(np.floor(wish.release))
    assert closest(ball, np.array(TARGET), first + 1, first + 60) < 0.10
    # in the hand up to the release, rigid with its bone, and the flight goes on from there
    bone = body.pose.bones[ball.constraints[0].subtarget]
    away = []
    for frame in range(first - 20, first):
        place = ball_at(ball, frame)
        away.append(np.array((body.matrix_world @ bone.matrix).inverted() @ bpy_vector(place)))
    assert np.ptp(away, axis=0).max() < 2e-3 and 0.02 < np.linalg.norm(away[0]) < 0.3
    steps = [np.linalg.norm(ball_at(ball, f + 1) - ball_at(ball, f)) for f in range(first - 2, first + 4)]
    assert max(steps) < 1.5 * min(steps[-2:])


def bpy_vector(values):
    from mathutils import Vector

    return Vector(values)


@pytest.mark.parametrize("act", ["throw", "kick"])
def test_the_models_that_come_with_it(act, monkeypatch):
    monkeypatch.undo()  # the extension's own
    body = a_body()
    assert press_operator(getattr(bpy.ops.beyond_mocap, f"{act}_at_target")) == {"FINISHED"}
    wish, first = body.beyond_mocap_throw, int(np.floor(body.beyond_mocap_throw.release))
    assert closest(wish.flown, np.array(TARGET), first + 1, first + 60) < 0.10
    moved = next(line for line in wish.figures.splitlines() if "correction" in line)
    assert float(moved.split(":")[1].split()[0]) <= 5.0


def test_a_library_joins_it(room, clips):
    bpy.context.scene.beyond_mocap.library_folder = str(clips)
    body = a_body("walking_1_2", frame=70)
    own = room("core.action").read_motion(body, bpy.context.scene)
    assert press_operator(bpy.ops.beyond_mocap.throw_at_target) == {"FINISHED"}
    wish = body.beyond_mocap_throw
    shares = [line for line in wish.figures.splitlines() if line.startswith("Transition jerk")]
    assert float(shares[0].split(":")[1].rstrip(" %")) <= 80.0
    now = room("core.action").read_motion(body, bpy.context.scene)
    assert len(now) >= len(own)


def test_a_ball_that_lies_is_kicked_into_the_target(room, capfd):
    goal = (16.0, 3.0, 0.8)
    body = a_body(target=goal)
    ball = importlib.import_module(f"{EXTENSION}.scene.stage.ball").create_ball(
        bpy.context, "Ball of mine", bpy.context.scene.collection
    )
    ball.location = (1.5, 0.5, 0.11)
    wish = body.beyond_mocap_throw
    wish.ball = ball
    assert press_operator(bpy.ops.beyond_mocap.kick_at_target) == {"FINISHED"}
    assert re.search(r": the ball leaves at [\d.]+ m/s and passes [\d.]+ cm from the target", capfd.readouterr().out)
    assert wish.made == "kick" and wish.flown == ball and not ball.constraints
    first = int(np.floor(wish.release))
    assert closest(ball, np.array(goal), first + 1, first + 60) < 0.10
    for frame in (1, first - 10, first):
        assert ball_at(ball, frame) == pytest.approx((1.5, 0.5, 0.11), abs=1e-4)
    # the foot is at the ball when it leaves
    toe = room("passes.possession").find_bone(bpy.context.scene, body, "foot", "right")
    bpy.context.scene.frame_set(first)
    away = np.array(body.matrix_world @ body.pose.bones[toe].head) - (1.5, 0.5, 0.11)
    assert np.linalg.norm(away) < 0.5
    press_operator(bpy.ops.beyond_mocap.leave_throw)
    assert tuple(ball.location) == pytest.approx((1.5, 0.5, 0.11)) and ball.animation_data is None


def test_again_with_another_target_begins_from_the_same_motion(room):
    body = a_body()
    before = room("core.action").read_motion(body, bpy.context.scene)
    press_operator(bpy.ops.beyond_mocap.throw_at_target)
    wish = body.beyond_mocap_throw
    wish.target.location.y += 2.0
    bpy.context.view_layer.update()
    count = len(bpy.data.actions), len(bpy.data.objects)
    press_operator(bpy.ops.beyond_mocap.throw_at_target)
    assert (len(bpy.data.actions), len(bpy.data.objects)) == count
    first = int(np.floor(wish.release))
    assert closest(wish.flown, np.array(TARGET) + [0.0, 2.0, 0.0], first + 1, first + 60) < 0.10
    press_operator(bpy.ops.beyond_mocap.leave_throw)
    after = room("core.action").read_motion(body, bpy.context.scene)
    assert np.array_equal(after.rotations, before.rotations) and len(bpy.data.objects) == 2 + 0


def test_all_is_as_before_when_it_is_left():
    body = a_body()
    wish = body.beyond_mocap_throw
    ball = bpy.data.objects.new("Ball of mine", bpy.data.meshes.new("Ball of mine"))
    ball.location = (0.3, 0.2, 0.5)
    bpy.context.scene.collection.objects.link(ball)
    wish.ball = ball
    bpy.context.scene.frame_end = 250
    before = collect_state()
    press_operator(bpy.ops.beyond_mocap.throw_at_target)
    assert wish.flown == ball and len(ball.constraints) == 1
    press_operator(bpy.ops.beyond_mocap.leave_throw)
    after = collect_state()
    assert {key for key in before if before[key] != after[key]} <= {"materials", "collections", "frames"}
    assert tuple(ball.location) == pytest.approx((0.3, 0.2, 0.5))


def test_kept_it_is_the_own_motion(room):
    body = a_body()
    press_operator(bpy.ops.beyond_mocap.throw_at_target)
    wish = body.beyond_mocap_throw
    ball, shown = wish.flown, room("core.action").read_motion(body, bpy.context.scene)
    press_operator(bpy.ops.beyond_mocap.keep_throw)
    assert not wish.made and wish.flown is None and ball.name in bpy.context.scene.objects
    assert np.array_equal(room("core.action").read_motion(body, bpy.context.scene).rotations, shown.rotations)
    wish.frame = 200  # the next one begins from it
    press_operator(bpy.ops.beyond_mocap.throw_at_target)
    assert wish.flown != ball
    now = room("core.action").read_motion(body, bpy.context.scene)
    assert np.allclose(now.rotations[:60], shown.rotations[:60], atol=1e-6)


def test_an_armature_that_plays_nothing_stands(core):
    armature = importlib.import_module(f"{EXTENSION}.scene.rigs.armature")
    skeleton = core("motion.retargeting.adult").build_adult_skeleton()
    body = armature.create_armature(bpy.context, skeleton, "Thrower", bpy.context.scene.collection)
    body.location, body.rotation_euler = (2.0, -1.0, 0.0), (0.0, 0.0, 0.4)
    worlds.select_objects(body)
    bpy.context.scene.cursor.location = (12.0, 3.0, 1.0)
    bpy.context.scene.frame_set(80)
    assert press_operator(bpy.ops.beyond_mocap.throw_at_target) == {"FINISHED"}
    wish = body.beyond_mocap_throw
    first = int(np.floor(wish.release))
    assert abs(wish.release - 80.0) <= 0.51
    assert closest(wish.flown, np.array((12.0, 3.0, 1.0)), first + 1, first + 60) < 0.10
    bpy.context.scene.frame_set(1)
    hips = body.matrix_world @ body.pose.bones[skeleton.names[0]].head
    assert np.linalg.norm(np.array(hips)[:2] - [2.0, -1.0]) < 0.05


def test_one_step_of_undo():
    a_body()
    assert_one_step(bpy.ops.beyond_mocap.throw_at_target)
    assert_one_step(bpy.ops.beyond_mocap.leave_throw)


def test_unit_scale(room):
    scene = bpy.context.scene
    scene.unit_settings.scale_length = 0.01
    body = a_body(target=[100.0 * value for value in TARGET])
    assert press_operator(bpy.ops.beyond_mocap.throw_at_target) == {"FINISHED"}
    wish = body.beyond_mocap_throw
    first = int(np.floor(wish.release))
    assert closest(wish.flown, 100.0 * np.array(TARGET), first + 1, first + 60) < 10.0


def refused(match, operator=bpy.ops.beyond_mocap.throw_at_target):
    before = collect_state()
    with pytest.raises(RuntimeError, match=match) as caught:
        operator()
    assert "Traceback" not in str(caught.value)
    assert collect_state() == before


def test_what_is_refused(tmp_path):
    body = a_body()
    wish = body.beyond_mocap_throw
    wish.throw_model = str(tmp_path / "none.npz")
    refused("none.npz")
    (tmp_path / "bad.npz").write_bytes(b"PK\x03\x04 truncated")
    wish.throw_model = str(tmp_path / "bad.npz")
    refused("bad.npz")
    wish.throw_model = write_model_file("kick")
    refused("trained for")
    wish.throw_model = "recorded"  # the extension has recorded kicks alone
    refused("throw_recorded.npz")
    wish.throw_model = ""
    wish.target.location = (400.0, 0.0, 0.0)
    bpy.context.view_layer.update()
    refused("m/s")
    wish.target.location = (18.0, 0.0, -1.0)
    bpy.context.view_layer.update()
    refused("1.00 m below the ground")
    wish.target.location = TARGET
    wish.ball = body.beyond_mocap_throw.target
    bpy.ops.object.select_all(action="DESELECT")
    bpy.context.view_layer.objects.active = None
    refused("Select the armature")


def test_a_body_without_hands_is_refused(core):
    skeleton = core("motion.retargeting.adult").build_adult_skeleton()
    legs = [j for j, name in enumerate(skeleton.names) if "Arm" not in name and "Hand" not in name]
    table = {"names": [skeleton.names[j] for j in legs],
             "parents": [legs.index(skeleton.parents[j]) if j else -1 for j in legs]}
    assert json.dumps(table)
    small = core("motion.skeleton").Skeleton(
        tuple(table["names"]), tuple(table["parents"]), skeleton.offsets[legs], (), np.zeros((0, 3))
    )
    armature = importlib.import_module(f"{EXTENSION}.scene.rigs.armature")
    worlds.select_objects(armature.create_armature(bpy.context, small, "Legs", bpy.context.scene.collection))
    bpy.context.scene.cursor.location = (12.0, 0.0, 1.0)
    refused("hand|arm")


@pytest.mark.parametrize("kind", ["mixamo", "walk_ik"])
def test_rigs(kind, room):
    body = rigs.create_mixamo() if kind == "mixamo" else path_edit_rigs.create_ik_rig()
    worlds.select_objects(body)
    wish = body.beyond_mocap_throw
    wish.target, wish.frame = an_empty(TARGET), 60
    before = collect_state()
    assert press_operator(bpy.ops.beyond_mocap.throw_at_target) == {"FINISHED"}
    assert wish.rigged == (kind == "walk_ik")
    ball, first = wish.flown, int(np.floor(wish.release))
    assert closest(ball, np.array(TARGET), first + 1, first + 60) < 0.10
    steps = [np.linalg.norm(ball_at(ball, f + 1) - ball_at(ball, f)) for f in range(first - 2, first + 4)]
    assert max(steps) < 1.5 * min(steps[-2:])  # no jump from the hand into the flight
    wish.target.location.y += 1.0
    bpy.context.view_layer.update()
    press_operator(bpy.ops.beyond_mocap.throw_at_target)
    assert closest(wish.flown, np.array(TARGET) + [0.0, 1.0, 0.0], first - 2, first + 60) < 0.10
    wish.target.location.y -= 1.0
    press_operator(bpy.ops.beyond_mocap.leave_throw)
    bpy.context.scene.frame_set(1)
    after = collect_state()
    assert {key for key in before if before[key] != after[key]} <= {"materials", "collections", "frames"}


def test_a_kicked_ball_that_was_kept_is_not_lost_by_the_next_kick():
    body = a_body()
    wish = body.beyond_mocap_throw
    press_operator(bpy.ops.beyond_mocap.kick_at_target)
    ball = wish.flown
    name, action, scale = ball.name, ball.animation_data.action.name, tuple(ball.scale)
    press_operator(bpy.ops.beyond_mocap.keep_throw)
    wish.ball, wish.frame, wish.kind = ball, 150, "handball"
    press_operator(bpy.ops.beyond_mocap.kick_at_target)
    assert wish.flown.name == name and tuple(ball.scale) == scale
    press_operator(bpy.ops.beyond_mocap.leave_throw)
    assert bpy.data.objects[name].animation_data.action.name == action


def test_a_kept_throw_of_a_rig_and_a_bake_are_not_lost_by_the_next_throw():
    body = path_edit_rigs.create_ik_rig()
    worlds.select_objects(body)
    wish = body.beyond_mocap_throw
    wish.target, wish.frame = an_empty(TARGET), 60
    press_operator(bpy.ops.beyond_mocap.throw_at_target)
    press_operator(bpy.ops.beyond_mocap.keep_throw)
    kept = body.animation_data.action
    kept["beyond_mocap_rig"], kept["beyond_mocap_before"], name = True, "{}", kept.name  # as one that was baked
    wish.frame = 100
    press_operator(bpy.ops.beyond_mocap.throw_at_target)
    assert body.animation_data.action.name != name
    press_operator(bpy.ops.beyond_mocap.leave_throw)
    kept = body.animation_data.action
    assert kept.name == name and kept["beyond_mocap_rig"]


def a_ball(place, name="Ball of mine"):
    balls = importlib.import_module(f"{EXTENSION}.scene.stage.ball")
    ball = balls.create_ball(bpy.context, name, bpy.context.scene.collection)
    ball.location = place
    return ball


def test_a_ball_in_the_air_is_kicked_where_it_is_or_refused_with_its_height():
    body = a_body(target=(16.0, 3.0, 0.8))
    wish = body.beyond_mocap_throw
    wish.ball = a_ball((1.5, 0.5, 0.25))
    press_operator(bpy.ops.beyond_mocap.kick_at_target)
    first = int(np.floor(wish.release))
    assert ball_at(wish.ball, first) == pytest.approx((1.5, 0.5, 0.25), abs=1e-4)
    assert closest(wish.ball, np.array((16.0, 3.0, 0.8)), first + 1, first + 60) < 0.10
    press_operator(bpy.ops.beyond_mocap.leave_throw)
    wish.ball.location.z = 5.0
    bpy.context.view_layer.update()
    refused("5.00 m above the ground", bpy.ops.beyond_mocap.kick_at_target)


@pytest.mark.parametrize("deleted", ["of the file", "of the scene"])
def test_nothing_is_left_of_a_shown_ball_that_was_deleted(deleted):
    body = a_body()
    bpy.context.scene.frame_end = 250
    actions, things = {one.name for one in bpy.data.actions}, {one.name for one in bpy.data.objects}
    press_operator(bpy.ops.beyond_mocap.throw_at_target)
    ball = body.beyond_mocap_throw.flown
    if deleted == "of the file":
        bpy.data.objects.remove(ball)
    else:
        with bpy.context.temp_override(selected_objects=[ball], active_object=ball):
            bpy.ops.object.delete()
    press_operator(bpy.ops.beyond_mocap.leave_throw)
    assert {one.name for one in bpy.data.actions} == actions
    assert {one.name for one in bpy.data.objects} == things
    press_operator(bpy.ops.beyond_mocap.throw_at_target)  # and a new one is made
    assert body.beyond_mocap_throw.flown.name in bpy.context.scene.objects


def test_a_throw_that_begins_before_the_scene_is_told_or_waits():
    body = a_body(frame=1)
    wish = body.beyond_mocap_throw
    press_operator(bpy.ops.beyond_mocap.throw_at_target)
    assert "before the scene's first frame 1: set Release Frame to" in wish.messages
    frame = int(wish.messages.split("Release Frame to ")[1].split()[0])
    wish.frame = frame
    press_operator(bpy.ops.beyond_mocap.throw_at_target)
    assert "first frame" not in wish.messages and wish.release == pytest.approx(frame, abs=0.51)
    wish.frame = 0  # now, or as soon as it fits in
    bpy.context.scene.frame_set(1)
    press_operator(bpy.ops.beyond_mocap.throw_at_target)
    assert wish.release == pytest.approx(frame, abs=1.51) and "the ball leaves on frame" in wish.messages


@pytest.mark.parametrize("first", ["throw", "kick"])
def test_a_kept_ball_is_thrown_again(first):
    body = a_body("walking_1_2")
    wish = body.beyond_mocap_throw
    press_operator(getattr(bpy.ops.beyond_mocap, f"{first}_at_target"))
    ball, release = wish.flown, wish.release
    press_operator(bpy.ops.beyond_mocap.keep_throw)
    frames = [*range(40, int(release) + 50, 3)]
    way = np.array([ball_at(ball, frame) for frame in frames])
    names = {one.name for one in bpy.data.actions}
    wish.ball, wish.frame = ball, 260
    press_operator(bpy.ops.beyond_mocap.throw_at_target)
    again = int(np.floor(wish.release))
    assert np.abs([ball_at(ball, frame) - place for frame, place in zip(frames, way)]).max() < 2e-3
    assert closest(ball, np.array(TARGET), again + 1, again + 60) < 0.10
    hand = body.pose.bones[ball.constraints[-1].subtarget]
    for frame in (again - 20, again):
        assert np.linalg.norm(ball_at(ball, frame) - np.array(body.matrix_world @ hand.head)) < 0.3
    wish.target.location.y -= 1.0
    bpy.context.view_layer.update()
    press_operator(bpy.ops.beyond_mocap.throw_at_target)  # again, with the same ball
    assert closest(ball, np.array(TARGET) - [0.0, 1.0, 0.0], again - 1, again + 60) < 0.10
    assert np.abs([ball_at(ball, frame) - place for frame, place in zip(frames, way)]).max() < 2e-3
    press_operator(bpy.ops.beyond_mocap.leave_throw)
    assert np.abs([ball_at(ball, frame) - place for frame, place in zip(frames, way)]).max() < 2e-3
    assert {one.name for one in bpy.data.actions} == names


def test_a_ball_that_rolls_or_was_put_down_is_kicked_where_it_is_by_then(room):
    body = a_body(target=(16.0, 3.0, 0.8))
    wish, ball = body.beyond_mocap_throw, a_ball((1.0, 0.5, 0.11))
    ball.keyframe_insert("location", frame=1)
    ball.location.x = 2.0
    ball.keyframe_insert("location", frame=101)
    wish.ball = ball
    rolls = [ball_at(ball, frame) for frame in (10, 30, 59, 60)]
    press_operator(bpy.ops.beyond_mocap.kick_at_target)
    assert 59.5 <= wish.release <= 60.5  # it rolls up to its contact, and is there in the frame before
    for frame, place in zip((10, 30, 59), rolls):
        assert ball_at(ball, frame) == pytest.approx(place, abs=0.02 if frame == 59 else 1e-3)
    first = int(np.floor(wish.release))
    assert closest(ball, np.array((16.0, 3.0, 0.8)), first + 1, first + 60) < 0.10
    press_operator(bpy.ops.beyond_mocap.leave_throw)
    assert np.allclose([ball_at(ball, frame) for frame in (10, 30, 59, 60)], rolls, atol=1e-6)


def test_whose_throw_a_ball_shows_keeps_it_from_others():
    one = a_body(target=(16.0, 3.0, 0.8))
    ball = a_ball((1.5, 0.5, 0.11))
    one.beyond_mocap_throw.ball = ball
    press_operator(bpy.ops.beyond_mocap.kick_at_target)
    shown = ball_at(ball, 90)
    bpy.ops.beyond_mocap.import_clips(filepath=str(SAMPLE / "standing_1.bvh"))
    other = bpy.context.object
    other.beyond_mocap_throw.ball, other.beyond_mocap_throw.target = ball, one.beyond_mocap_throw.target
    other.beyond_mocap_throw.frame = 200
    refused(f"Apply or Revert for {one.name} first", bpy.ops.beyond_mocap.kick_at_target)
    assert ball_at(ball, 90) == pytest.approx(shown)
    worlds.select_objects(one)
    press_operator(bpy.ops.beyond_mocap.keep_throw)
    worlds.select_objects(other)
    other.beyond_mocap_throw.target = an_empty(ball_at(ball, 260) + [-12.0, 4.0, 1.0])
    press_operator(bpy.ops.beyond_mocap.kick_at_target)  # where it has come to rest
    assert ball_at(ball, 90) == pytest.approx(shown, abs=1e-3)
    press_operator(bpy.ops.beyond_mocap.leave_throw)
    assert ball_at(ball, 90) == pytest.approx(shown, abs=1e-3)


def test_a_duplicate_of_a_thrower_leaves_the_ball_to_him():
    body = a_body()
    press_operator(bpy.ops.beyond_mocap.throw_at_target)
    ball = body.beyond_mocap_throw.flown
    twin = body.copy()
    bpy.context.scene.collection.objects.link(twin)
    worlds.select_objects(twin)
    press_operator(bpy.ops.beyond_mocap.leave_throw)
    assert ball.name in bpy.context.scene.objects and body.beyond_mocap_throw.flown == ball
    first = int(np.floor(body.beyond_mocap_throw.release))
    assert closest(ball, np.array(TARGET), first + 1, first + 60) < 0.10


def test_a_target_that_moves_is_met_where_it_is_by_then():
    body = a_body()
    wish, carrier = body.beyond_mocap_throw, an_empty((0.0, 0.0, 0.0))
    wish.target.parent = carrier
    for frame, y in ((60, -2.0), (120, 4.0)):
        carrier.location.y = y
        carrier.keyframe_insert("location", frame=frame)
    for curve in curves_of(carrier):
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    press_operator(bpy.ops.beyond_mocap.throw_at_target)
    first, away = int(np.floor(wish.release)), []
    for frame in np.arange(first + 1, first + 60, 0.1):
        place = ball_at(wish.flown, frame)
        target = wish.target.evaluated_get(bpy.context.evaluated_depsgraph_get())
        away.append(np.linalg.norm(place - np.array(target.matrix_world.translation)))
    assert min(away) < 0.15
    assert len(bpy.data.scenes) == 1


def curves_of(thing):
    channels = importlib.import_module(f"{EXTENSION}.scene.core.channels")
    return channels.collect_curves(*channels.find_playing_action(thing)).values()


def test_keeping_and_the_second_throw_are_one_step_of_undo_each():
    body = a_body()
    press_operator(bpy.ops.beyond_mocap.throw_at_target)
    assert_one_step(bpy.ops.beyond_mocap.keep_throw)
    body = bpy.context.object
    wish = body.beyond_mocap_throw
    wish.ball = next(thing for thing in bpy.data.objects if "Ball" in thing.name)
    wish.frame = 260
    assert_one_step(bpy.ops.beyond_mocap.throw_at_target)
    assert_one_step(bpy.ops.beyond_mocap.leave_throw)


def test_an_armature_that_is_scaled_and_hangs_on_something():
    body = a_body(target=(20.0, 6.0, 1.2))
    hangs = an_empty((2.0, 3.0, 0.0))
    hangs.rotation_euler.z, hangs.scale = 0.8, (1.1, 1.1, 1.1)
    body.parent, body.scale = hangs, tuple(value * 0.9 for value in body.scale)
    bpy.context.view_layer.update()
    press_operator(bpy.ops.beyond_mocap.throw_at_target)
    wish = body.beyond_mocap_throw
    first = int(np.floor(wish.release))
    assert closest(wish.flown, np.array((20.0, 6.0, 1.2)), first + 1, first + 60) < 0.10
    steps = [np.linalg.norm(ball_at(wish.flown, f + 1) - ball_at(wish.flown, f)) for f in range(first - 2, first + 4)]
    assert max(steps) < 1.5 * min(steps[-2:])


@pytest.mark.parametrize("how", ["hide_viewport", "hide_set", "hide_render"])
def test_a_hidden_ball_flies_too(how):
    body = a_body()
    ball = body.beyond_mocap_throw.ball = a_ball((0.3, 0.2, 0.11))
    if how == "hide_set":
        ball.hide_set(True)
    else:
        setattr(ball, how, True)
    press_operator(bpy.ops.beyond_mocap.throw_at_target)
    ball.hide_viewport = False
    ball.hide_set(False)
    first = int(np.floor(body.beyond_mocap_throw.release))
    assert closest(ball, np.array(TARGET), first + 1, first + 60) < 0.10


def test_an_armature_of_another_file_throws_as_an_override_only(tmp_path):
    body = a_body()
    path = str(tmp_path / "body.blend")
    bpy.data.libraries.write(path, {body})
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (there, here):
        here.objects = [name for name in there.objects if name == "standing_1"]
    linked = here.objects[0]
    bpy.context.scene.collection.objects.link(linked)
    worlds.select_objects(linked)
    refused("linked from")
    own = linked.override_create(remap_local_usages=True)
    own.override_library.is_system_override = False
    worlds.select_objects(own)
    wish = own.beyond_mocap_throw
    wish.target, wish.frame = an_empty(TARGET), 60
    press_operator(bpy.ops.beyond_mocap.throw_at_target)
    first = int(np.floor(wish.release))
    assert closest(wish.flown, np.array(TARGET), first + 1, first + 60) < 0.10
    press_operator(bpy.ops.beyond_mocap.leave_throw)
    assert not wish.made


def test_a_ball_that_a_hand_has_put_down_is_kicked_there(room):
    body = a_body(target=(16.0, 3.0, 0.8), frame=90)
    wish, ball = body.beyond_mocap_throw, a_ball((0.3, 0.3, 0.9))
    bone = room("passes.possession").find_bone(bpy.context.scene, body, "hand", "right")
    room("passes.possession").add_hold(bpy.context.scene, ball, body, bone, 5, 30)
    wish.ball = ball
    refused("m above the ground", bpy.ops.beyond_mocap.kick_at_target)  # he stands: it is let go beside the hip
    wish.frame = 20
    refused("carries it on frame 20", bpy.ops.beyond_mocap.kick_at_target)


def test_what_is_shown_follows_its_target(room):
    live, scene = room("throws.preview"), bpy.context.scene
    body = a_body()
    assert live.find_outdated(scene) is None
    press_operator(bpy.ops.beyond_mocap.throw_at_target)
    wish = body.beyond_mocap_throw
    assert live.find_outdated(scene) is None
    wish.target.location.y += 2.0
    bpy.context.view_layer.update()
    wish.live = False
    assert live.find_outdated(scene) is None
    wish.live = True
    assert live.find_outdated(scene) == body and live.find_outdated(scene) is None  # once
    job = live.start_update(scene, body)
    while not job.poll():
        pass
    live.finish_update(scene, job)
    first = int(np.floor(wish.release))
    assert closest(wish.flown, np.array(TARGET) + [0.0, 2.0, 0.0], first + 1, first + 60) < 0.10
    assert live.find_outdated(scene) is None
    wish.target.location.y += 1.0
    bpy.context.view_layer.update()
    late = live.start_update(scene, body)
    while not late.poll():
        pass
    wish.target.location.y -= 1.0  # and back before it was there
    bpy.context.view_layer.update()
    live.finish_update(scene, late)
    assert closest(wish.flown, np.array(TARGET) + [0.0, 2.0, 0.0], first + 1, first + 60) < 0.10
    wish.speed = 2.0
    refused_job = live.start_update(scene, body)
    while not refused_job.poll():
        pass
    with pytest.raises(Exception, match="at least .* m/s"):
        live.finish_update(scene, refused_job)
    press_operator(bpy.ops.beyond_mocap.leave_throw)
    assert live.find_outdated(scene) is None


def followed(live, scene):
    """What the timer does until there is nothing left to do."""
    while live.process_updates(scene):
        pass


@pytest.mark.parametrize("act", ["throw", "kick"])
def test_undo_after_a_throw_has_followed(act, room):
    live, scene = room("throws.preview"), bpy.context.scene
    a_body()
    press_operator(getattr(bpy.ops.beyond_mocap, f"{act}_at_target"))
    for message in ("deselected", "target selected"):  # nothing of the armature changes between two steps
        bpy.context.view_layer.update()
        bpy.ops.ed.undo_push(message=message)
    thrown = collect_state()
    bpy.data.objects["Target"].location.y += 2.0
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="dragged")
    dragged = collect_state()
    followed(live, scene)
    after = collect_state()
    assert after["keys"] != dragged["keys"]
    for expected in (dragged, thrown):
        bpy.ops.ed.undo()
        assert collect_state() == expected
        followed(live, bpy.context.scene)  # what undo has brought back stays
        assert collect_state() == expected
    for expected in (dragged, after):
        bpy.ops.ed.redo()
        followed(live, bpy.context.scene)
        assert collect_state() == expected


@pytest.mark.parametrize("hidden", ["hide_viewport", "excluded"])
def test_a_hidden_target_stays_where_it_is_over_undo(hidden, room):
    targets, scene, hangs = room("throws.throw_task"), bpy.context.scene, an_empty((1.0, 0.0, 0.5))
    hangs.rotation_euler.z = 0.5
    target = an_empty((4.0, 2.0, 0.3))
    target.parent = hangs
    bpy.context.view_layer.update()
    place = tuple(target.matrix_world.translation)
    if hidden == "excluded":
        away = bpy.data.collections.new("Away")
        scene.collection.children.link(away)
        for thing in (hangs, target):
            away.objects.link(thing)
            scene.collection.objects.unlink(thing)
        bpy.context.view_layer.layer_collection.children["Away"].exclude = True
    else:
        hangs.hide_viewport = target.hide_viewport = True
    other = an_empty((0.0, 0.0, 0.0))
    hangs.beyond_mocap_throw.target = target
    bpy.ops.ed.undo_push(message="hidden")
    told = targets.build_target_key(scene, hangs.beyond_mocap_throw)
    other.location.x = 1.0
    bpy.ops.ed.undo_push(message="moved another")
    bpy.ops.ed.undo()
    scene = bpy.context.scene
    wish = next(thing.beyond_mocap_throw for thing in bpy.data.objects if thing.beyond_mocap_throw.target)
    assert targets.read_target_positions(scene, wish, 1)[0] == pytest.approx(place, abs=1e-5)
    assert targets.build_target_key(scene, wish) == told


def test_a_deleted_thrower_does_not_keep_the_ball(room):
    body, other, ball = a_body(), a_body(), a_ball((0.3, 0.2, 0.11))
    wish, earlier = body.beyond_mocap_throw, room("throws.throw_task")
    wish.made, wish.flown = "throw", ball
    bone = room("passes.possession").find_bone(bpy.context.scene, body, "hand", "right")
    room("passes.possession").add_hold(bpy.context.scene, ball, body, bone, 5, 30)
    assert earlier.find_other_thrower(ball, other) == body
    with bpy.context.temp_override(selected_objects=[body], active_object=body):
        bpy.ops.object.delete()
    assert earlier.find_other_thrower(ball, other) is None
    ball.animation_data_clear()  # and by hand; its stretch is still there
    assert earlier.compute_transforms_before(ball, other.beyond_mocap_throw, np.array([40]))[0].to_translation().z < 2.0
