"""A ball that is carried: where it is taken and let go it does not jump, and its own action comes back to the bit."""

import importlib

import bpy
import numpy as np
import pytest
import synthetic_motion
import worlds
from conftest import EXTENSION
from undo import assert_one_step, press_operator

FPS = 30


@pytest.fixture
def room():
    return lambda name: importlib.import_module(f"{EXTENSION}.scene.{name}")


@pytest.fixture
def body(core, room):
    """An armature that waves about, thrice as large as its motion, turned and put aside."""
    scene = bpy.context.scene
    scene.render.fps = FPS
    motion = synthetic_motion.build_motion(core, 91, 30.0)
    body = room("rigs.armature").create_armature(bpy.context, motion.skeleton, "Waver")
    room("core.action").write_motion(body, motion, scene, 1.0)
    body.scale, body.location, body.rotation_euler.z = (0.7, 0.7, 0.7), (1.0, 2.0, 0.5), 0.4
    bpy.context.view_layer.update()
    return body


@pytest.fixture(params=("QUATERNION", "XYZ", "ZYX"))
def ball(request):
    """A ball on a curved way over frames 1 to 90 that spins, in any rotation mode."""
    ball = bpy.data.objects.new("Ball", bpy.data.meshes.new("Ball"))
    bpy.context.scene.collection.objects.link(ball)
    ball.rotation_mode = request.param
    for frame in range(1, 91, 3):
        ball.location = 0.05 * frame, np.sin(0.1 * frame), 1.0 + 0.3 * np.cos(0.2 * frame)
        if request.param == "QUATERNION":
            ball.rotation_quaternion = np.cos(0.03 * frame), 0.0, np.sin(0.03 * frame), 0.0
            ball.keyframe_insert("rotation_quaternion", frame=frame)
        else:
            ball.rotation_euler = 0.06 * frame, 0.1, 0.02 * frame
            ball.keyframe_insert("rotation_euler", frame=frame)
        ball.keyframe_insert("location", frame=frame)
    choose(ball, None)
    return ball


def choose(ball, body):
    for thing in bpy.context.view_layer.objects:
        thing.select_set(thing in (ball, body))
    bpy.context.view_layer.objects.active = body or ball


def seen(thing, frame):
    """A ball's matrix in the world, as drawn."""
    whole = int(np.floor(frame))
    bpy.context.scene.frame_set(whole, subframe=frame - whole)
    return np.array(thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world)


def bone_sees(body, ball, bone, frame):
    """A ball as the bone sees it, without scale."""
    place = seen(ball, frame)
    shown = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
    bones = np.array(shown.matrix_world @ shown.pose.bones[bone].matrix)
    bones[:3, :3] /= np.linalg.norm(bones[:3, :3], axis=0)
    return np.linalg.inv(bones) @ place


def test_it_is_rigid_with_the_bone_and_jumps_at_neither_end(ball, body):
    free = {frame: seen(ball, frame) for frame in (10, 30, 30.2, 59.99, 60, 61, 80)}
    choose(ball, body)
    bpy.ops.beyond_mocap.take_ball(bone="RightForeArm", first=30, last=60, settle=5)
    for frame in (10, 30, 60, 61, 80):
        assert np.allclose(seen(ball, frame), free[frame], atol=2e-4), frame
    held = [bone_sees(body, ball, "RightForeArm", frame) for frame in (30, 37, 42.5, 45)]
    for other in held[1:]:
        assert np.allclose(other[:3, 3], held[0][:3, 3], atol=6e-3)
    whole = [bone_sees(body, ball, "RightForeArm", frame) for frame in (30, 37, 45)]
    assert np.allclose(whole[0], whole[1], atol=1e-3) and np.allclose(whole[0], whole[2], atol=1e-3)
    for end in (30, 60):
        before, at, after = (seen(ball, frame)[:3, 3] for frame in (end - 0.02, end, end + 0.02))
        assert np.linalg.norm(at - before) < 0.02 and np.linalg.norm(after - at) < 0.02


def test_a_ball_that_does_not_move_stays_where_it_is_let_go(ball, body):
    ball.animation_data_clear()
    ball.location = (1.0, 1.0, 1.0)
    choose(ball, body)
    bpy.ops.beyond_mocap.take_ball(bone="RightForeArm", first=30, last=60)
    start, end = seen(ball, 20), seen(ball, 60)
    assert np.allclose(start[:3, 3], 1.0, atol=1e-5)
    assert np.linalg.norm(end[:3, 3] - start[:3, 3]) > 0.1
    assert np.allclose(seen(ball, 59.995), end, atol=3e-3)  # the bone goes 0.2 m in a frame
    for frame in (60.5, 61, 90):
        assert np.allclose(seen(ball, frame), end, atol=1e-5), frame
    bpy.ops.beyond_mocap.take_ball(bone="LeftForeArm", first=70, last=80)
    assert np.allclose(seen(ball, 65), end, atol=1e-3) and np.allclose(seen(ball, 70), end, atol=1e-3)


def test_a_touching_ball_comes_to_the_bone(ball, body):
    choose(ball, body)
    bpy.ops.beyond_mocap.take_ball(bone="RightForeArm", first=30, last=60, how="TOUCH", settle=5)
    assert np.linalg.norm(bone_sees(body, ball, "RightForeArm", 45)[:3, 3]) < 0.5


def test_what_is_freed_plays_its_own_action_again(ball, body):
    before = ball.animation_data.action
    choose(ball, body)
    bpy.ops.beyond_mocap.take_ball(bone="RightForeArm", first=30, last=40)
    bpy.ops.beyond_mocap.take_ball(bone="LeftForeArm", first=50, last=60)
    assert len(ball.constraints) == 2 and ball.animation_data.action is not before
    bpy.ops.beyond_mocap.free_ball(number=0)
    assert [hold.first for hold in ball.beyond_mocap_ball.holds] == [50] and len(ball.constraints) == 1
    bpy.ops.beyond_mocap.free_ball()
    assert ball.animation_data.action is before and not len(ball.constraints)
    assert len(bpy.data.actions) == 2


def test_what_is_gone_of_who_carries_it_does_not_stop_the_others(ball, body, room):
    choose(ball, body)
    for first in (10, 40):
        press_operator(bpy.ops.beyond_mocap.take_ball, bone=body.data.bones[-1].name, first=first, last=first + 10)
    own = ball.beyond_mocap_ball.before.action
    ball.constraints.remove(ball.constraints[0])
    press_operator(bpy.ops.beyond_mocap.take_ball, bone=body.data.bones[-1].name, first=60, last=70)
    ball.constraints.remove(ball.constraints[0])
    press_operator(bpy.ops.beyond_mocap.free_ball, number=2)
    assert ball.animation_data.action == own


def test_an_aimed_ball_is_not_carried(ball, body):
    ball.beyond_mocap_aim.on = True
    choose(ball, body)
    with pytest.raises(RuntimeError, match="it is aimed"):
        press_operator(bpy.ops.beyond_mocap.take_ball, bone=body.data.bones[-1].name, first=10, last=20)
    assert not len(ball.constraints)


def test_each_is_one_step_of_undo(body):
    ball = bpy.data.objects.new("Ball", bpy.data.meshes.new("Ball"))
    bpy.context.scene.collection.objects.link(ball)
    choose(ball, body)
    assert_one_step(bpy.ops.beyond_mocap.take_ball, bone="RightForeArm", first=5, last=9)
    assert_one_step(bpy.ops.beyond_mocap.free_ball)


@pytest.mark.parametrize("arguments, said", [
    ({"first": 9, "last": 9}, "a last frame after the first one"), ({"bone": "Tail"}, "no bone 'Tail'"),
    ({"part": "chest", "first": 35}, "already carried by Waver on frames 30 to 40"),
])
def test_what_makes_no_sense_is_told_and_changes_nothing(ball, body, arguments, said):
    choose(ball, body)
    bpy.ops.beyond_mocap.take_ball(bone="RightForeArm", first=30, last=40)
    with pytest.raises(RuntimeError, match=said):
        press_operator(bpy.ops.beyond_mocap.take_ball, **{"bone": "RightForeArm", "first": 50, "last": 60, **arguments})
    assert len(ball.constraints) == 1 == len(ball.beyond_mocap_ball.holds)


def test_the_ball_of_takes_is_carried_on_its_new_way_and_comes_back(tmp_path):
    places = worlds.make_places(tmp_path)
    for go_on in (worlds.import_tracking, worlds.synthesize_players):
        go_on(places)
    bpy.ops.beyond_mocap.accept()
    ball, player = bpy.data.objects["Ball"], bpy.context.scene.beyond_mocap.players[0]
    free = ball.animation_data.action.name
    choose(ball, player.body)
    bpy.ops.beyond_mocap.take_ball(first=10, last=20)
    for make in (bpy.ops.beyond_mocap.synthesize, bpy.ops.beyond_mocap.discard, bpy.ops.beyond_mocap.synthesize,
                 bpy.ops.beyond_mocap.accept):
        assert make() == {"FINISHED"}
        ball = bpy.data.objects["Ball"]
        assert ball.animation_data.action.name.startswith("Ball carried") and len(ball.constraints) == 1
        steps = [seen(ball, frame)[:3, 3] for frame in (19.99, 20.0, 20.01)]
        assert np.linalg.norm(np.diff(steps, axis=0), axis=1).max() < 0.01
    bpy.ops.beyond_mocap.free_ball()
    assert ball.animation_data.action.name.startswith(free) and not len(ball.constraints)
