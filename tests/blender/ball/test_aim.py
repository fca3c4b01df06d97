"""A ball aimed in Blender: it arrives, follows its target, and can be given back; so that physics may take it."""

import importlib
import pathlib

import bpy
import numpy as np
import pytest
from conftest import EXTENSION
from undo import assert_one_step, press_operator

CLIP = pathlib.Path(__file__).resolve().parents[3] / "sample_blend" / "library" / "kick_low_top.bvh"


@pytest.fixture
def room():
    return lambda name: importlib.import_module(f"{EXTENSION}.scene.{name}")


@pytest.fixture
def body():
    """The sample's kick, at a film's rate, beginning on frame 11."""
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base, scene.frame_start = 24, 1.001, 11
    bpy.ops.beyond_mocap.import_clips(filepath=str(CLIP))
    return bpy.context.object


@pytest.fixture
def aimed(body):
    """A ball that it kicks to a target."""
    assert press_operator(bpy.ops.beyond_mocap.aim_ball, bounces=1) == {"FINISHED"}
    return next(thing for thing in bpy.data.objects if thing.beyond_mocap_aim.on)


def place(ball, frame):
    whole = int(np.floor(frame))
    bpy.context.scene.frame_set(whole, subframe=frame - whole)
    return np.array(ball.matrix_world.translation)


def test_it_leaves_the_foot_and_arrives(aimed, room):
    aim = aimed.beyond_mocap_aim
    assert aim.first <= aim.strike <= aim.last and aim.body.type == "ARMATURE"
    assert np.linalg.norm(place(aimed, aim.arrived) - np.array(aim.target.matrix_world.translation)) < 0.02
    solved = room("ball.shots").find_solved(aimed)
    assert place(aimed, aim.strike) == pytest.approx(solved.shot.start, abs=1e-4)
    heights = [place(aimed, frame)[2] for frame in range(aim.strike, int(aim.arrived) + 1)]
    assert min(heights) > 0.10
    assert np.sum(solved.flight.bounces < solved.shot.seconds) == 1


def test_it_does_what_the_function_says(aimed, room, core):
    solved = room("ball.shots").find_solved(aimed)
    ball = core("ball.physics").FOOTBALL
    launch = core("ball.flight").Launch(0.0, solved.shot.start, solved.shot.velocity)
    there = core("ball.flight").simulate_flight(launch, ball, solved.shot.seconds).at([solved.shot.seconds])[0]
    assert there == pytest.approx(aimed.beyond_mocap_aim.target.matrix_world.translation, abs=0.02)


def test_a_dragged_target_is_followed_in_the_same_action(aimed, room):
    aim, live = aimed.beyond_mocap_aim, room("ball.live")
    before = aimed.animation_data.action
    assert live.update_balls(bpy.context.scene) == 0
    aim.target.location.y += 1.0
    bpy.context.view_layer.update()
    assert live.update_balls(bpy.context.scene) == 1 and live.update_balls(bpy.context.scene) == 0
    assert aimed.animation_data.action == before and len(bpy.data.curves) == 1
    assert np.linalg.norm(place(aimed, aim.arrived) - np.array(aim.target.matrix_world.translation)) < 0.02
    aim.bounces = 0
    assert live.update_balls(bpy.context.scene) == 1


def test_the_way_does_not_hang_on_how_the_target_came_there(aimed, room):
    aim, live = aimed.beyond_mocap_aim, room("ball.live")
    before = aim.arrived
    for step in (2.5, 3.0, -5.5):
        aim.target.location.y += step
        bpy.context.view_layer.update()
        live.update_balls(bpy.context.scene)
    assert aim.arrived == pytest.approx(before, abs=0.05)


def test_a_ball_without_its_body_is_told_and_stays(aimed, room):
    before = [place(aimed, frame) for frame in (60, 100)]
    aimed.beyond_mocap_aim.body = None
    room("ball.live").update_balls(bpy.context.scene)
    assert "no body strikes it" in aimed.beyond_mocap_aim.messages
    assert np.array_equal([place(aimed, frame) for frame in (60, 100)], before)


def test_what_is_out_of_reach_is_told_and_the_way_stays(aimed, room):
    aim, live = aimed.beyond_mocap_aim, room("ball.live")
    kept = place(aimed, aim.arrived)
    aim.target.location.x += 150.0
    bpy.context.view_layer.update()
    assert live.update_balls(bpy.context.scene) == 1 and live.update_balls(bpy.context.scene) == 0
    assert "m away" in aim.messages and place(aimed, aim.arrived) == pytest.approx(kept, abs=1e-5)
    aim.target.location.x -= 150.0
    bpy.context.view_layer.update()
    live.update_balls(bpy.context.scene)
    assert not aim.messages


@pytest.mark.parametrize("wanted", [
    {"way": "GROUND"}, {"timing": "SECONDS", "seconds": 1.3}, {"ball": "paper", "bounces": 2},
])
def test_other_ways_arrive_too(body, wanted):
    assert press_operator(bpy.ops.beyond_mocap.aim_ball, **wanted) == {"FINISHED"}
    ball = next(thing for thing in bpy.data.objects if thing.beyond_mocap_aim.on)
    aim = ball.beyond_mocap_aim
    assert np.linalg.norm(place(ball, aim.arrived) - np.array(aim.target.matrix_world.translation))  < 0.02
    if "seconds" in wanted:
        assert aim.arrived - aim.strike == pytest.approx(1.3 * 24 / 1.001, abs=1e-3)


def test_it_arrives_on_a_frame(aimed, room):
    aim = aimed.beyond_mocap_aim
    aim.timing, aim.arrival = "FRAME", aim.last + 40
    room("ball.live").update_balls(bpy.context.scene)
    assert aim.arrived == pytest.approx(aim.last + 40, abs=1e-3)


def test_a_ball_alone_leaves_from_where_it_lies(room):
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.11, location=(1.0, 2.0, 0.11))
    ball = bpy.context.object
    ball.name = "My Ball"
    assert press_operator(bpy.ops.beyond_mocap.aim_ball, timing="SECONDS", seconds=1.0) == {"FINISHED"}
    aim = ball.beyond_mocap_aim
    assert aim.on and place(ball, aim.strike) == pytest.approx([1.0, 2.0, 0.11], abs=1e-4)
    assert place(ball, aim.arrived) == pytest.approx(aim.target.matrix_world.translation, abs=0.02)


def test_the_ball_of_takes_is_another_one(aimed, room):
    assert aimed.name != room("result.bake").BALL


def test_units_are_the_scenes(body):
    bpy.context.scene.unit_settings.scale_length = 0.01
    assert press_operator(bpy.ops.beyond_mocap.aim_ball) == {"FINISHED"}
    ball = next(thing for thing in bpy.data.objects if thing.beyond_mocap_aim.on)
    assert ball.dimensions.z == pytest.approx(22.0, rel=0.02)
    aim = ball.beyond_mocap_aim
    assert np.linalg.norm(place(ball, aim.arrived) - np.array(aim.target.matrix_world.translation)) < 2.0


def test_leaving_brings_back_what_it_did(aimed):
    curve = aimed.beyond_mocap_aim.curve.name
    bpy.ops.object.select_all(action="DESELECT")
    aimed.select_set(True)
    bpy.context.view_layer.objects.active = aimed
    assert press_operator(bpy.ops.beyond_mocap.leave_aim) == {"FINISHED"}
    assert aimed.animation_data is None and curve not in bpy.data.objects and not aimed.beyond_mocap_aim.on


def test_each_is_one_step_of_undo(body):
    assert_one_step(bpy.ops.beyond_mocap.aim_ball)
    ball = next(thing for thing in bpy.data.objects if thing.beyond_mocap_aim.on)
    bpy.ops.object.select_all(action="DESELECT")
    ball.select_set(True)
    bpy.context.view_layer.objects.active = ball
    frame = ball.beyond_mocap_aim.strike + 10
    assert_one_step(bpy.ops.beyond_mocap.ball_to_physics, frame=frame)
    assert_one_step(bpy.ops.beyond_mocap.ball_from_physics)
    assert_one_step(bpy.ops.beyond_mocap.leave_aim)


def test_physics_goes_on_as_fast_and_gives_back(aimed, room):
    scene, aim = bpy.context.scene, aimed.beyond_mocap_aim
    solved = room("ball.shots").find_solved(aimed)
    frame, fps = aim.strike + 6, 24 / 1.001
    before = [place(aimed, frame + k) for k in range(-2, 5)]
    bpy.ops.object.select_all(action="DESELECT")
    aimed.select_set(True)
    bpy.context.view_layer.objects.active = aimed
    assert press_operator(bpy.ops.beyond_mocap.ball_to_physics, frame=frame) == {"FINISHED"}
    assert aimed.rigid_body.collision_shape == "SPHERE" and aimed.beyond_mocap_aim.handed
    shown = []
    for at in range(1, frame + 120):
        scene.frame_set(at)
        shown.append(np.array(aimed.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world.translation))
    velocity = (shown[frame] - shown[frame - 1]) * fps  # one frame behind the handover
    wanted = solved.flight.velocity([6.5 / fps])[0]
    assert np.linalg.norm(velocity - wanted) < 0.02 * np.linalg.norm(wanted) + 0.1
    assert min(place[2] for place in shown) > 0.06
    assert press_operator(bpy.ops.beyond_mocap.ball_from_physics) == {"FINISHED"}
    assert [place(aimed, frame + k) for k in range(-2, 5)] == pytest.approx(np.array(before), abs=1e-5)
    assert scene.rigidbody_world is None and "Ball Ground" not in bpy.data.objects and aimed.rigid_body is None


def test_physics_falls_as_fast_in_centimetres(body, room):
    scene = bpy.context.scene
    scene.unit_settings.scale_length = 0.01
    assert press_operator(bpy.ops.beyond_mocap.aim_ball) == {"FINISHED"}
    ball = next(thing for thing in bpy.data.objects if thing.beyond_mocap_aim.on)
    bpy.ops.object.select_all(action="DESELECT")
    ball.select_set(True)
    bpy.context.view_layer.objects.active = ball
    frame = ball.beyond_mocap_aim.strike + 6
    wanted = room("ball.shots").find_solved(ball).flight.at([14 / (24 / 1.001)])[0]
    bpy.ops.rigidbody.world_add()
    world = scene.rigidbody_world
    before = (
        world.effector_weights.gravity, world.point_cache.frame_start, world.point_cache.frame_end,
        world.substeps_per_frame,
    )  # fmt: skip
    assert press_operator(bpy.ops.beyond_mocap.ball_to_physics, frame=frame) == {"FINISHED"}
    for at in range(1, frame + 9):
        scene.frame_set(at)
    shown = np.array(ball.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world.translation)
    assert shown / 100.0 == pytest.approx(wanted, abs=0.05)
    assert press_operator(bpy.ops.beyond_mocap.ball_from_physics) == {"FINISHED"}
    world = scene.rigidbody_world
    assert before == (
        world.effector_weights.gravity, world.point_cache.frame_start, world.point_cache.frame_end,
        world.substeps_per_frame,
    )  # fmt: skip


def test_two_balls_are_taken_back_in_any_order(aimed, room):
    scene, handover = bpy.context.scene, room("ball.handover")
    other = aimed.copy()
    other.animation_data.action = aimed.animation_data.action.copy()
    scene.collection.objects.link(other)
    bpy.context.view_layer.update()
    for ball in (aimed, other):
        handover.start_physics(scene, ball, aimed.beyond_mocap_aim.strike + 6, "football", [])
    for ball in (aimed, other):
        handover.stop_physics(scene, ball)
    assert scene.rigidbody_world is None and "Ball Ground" not in bpy.data.objects and other.rigid_body is None


def test_physics_wants_a_ball_that_is_keyed_in_place(aimed):
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.11)
    for frame in (1, 40):
        bpy.context.object.keyframe_insert("rotation_euler", frame=frame)
    with pytest.raises(RuntimeError, match="a coordinate without keys"):
        bpy.ops.beyond_mocap.ball_to_physics(frame=20)


@pytest.mark.parametrize("frame", [1, 5000])
def test_physics_wants_keys_around_the_frame(aimed, frame):
    bpy.ops.object.select_all(action="DESELECT")
    aimed.select_set(True)
    bpy.context.view_layer.objects.active = aimed
    with pytest.raises(RuntimeError, match="keys on frames"):
        bpy.ops.beyond_mocap.ball_to_physics(frame=frame)
    assert bpy.context.scene.rigidbody_world is None


def test_a_path_with_rotations_is_baked_with_them(core, room):
    scene = bpy.context.scene
    times = np.arange(11) / frames(scene)
    turns = core("motion.quaternion").from_up_angle(np.linspace(0.0, 2.0, 11))
    path = core("synthesis.take").BallPath(times, np.full((11, 3), 0.11), np.ones(11, bool), turns)
    ball = room("stage.ball").create_ball(bpy.context, "Ball", scene.collection)
    room("stage.ball").write_trajectory(ball, path, scene, 5.0)
    scene.frame_set(10)
    assert np.array(ball.rotation_quaternion) == pytest.approx(turns[5], abs=1e-6)


def frames(scene):
    return scene.render.fps / scene.render.fps_base
