"""Drawn tracks and pins: read as they lie in the world, made and taken away in one step, and told what is wrong."""

import importlib
import json

import bpy
import numpy as np
import pytest
from undo import assert_one_step


@pytest.fixture
def drawn(extension):
    return importlib.import_module(f"{extension.__name__}.scene.player.drawn_track")


@pytest.fixture
def scene():
    return bpy.context.scene


def curve(points, kind="BEZIER", speeds=None, name="Way"):
    data = bpy.data.curves.new(name, "CURVE")
    data.dimensions = "3D"
    spline = data.splines.new(kind)
    chosen = spline.bezier_points if kind == "BEZIER" else spline.points
    chosen.add(len(points) - 1)
    for point, place, speed in zip(chosen, points, speeds or [2.0] * len(points)):
        point.co = place if kind == "BEZIER" else (*place, 1.0)
        point.radius = speed
        if kind == "BEZIER":
            point.handle_left_type = point.handle_right_type = "VECTOR"
    spline.use_endpoint_u = True
    found = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(found)
    bpy.context.view_layer.objects.active = found
    found.select_set(True)
    bpy.context.view_layer.update()
    return found


LINE = [(0, 0, 0), (4, 0, 0), (10, 0, 0)]


@pytest.mark.parametrize("kind", ["BEZIER", "POLY", "NURBS"])
def test_a_curve_is_gone_along_in_the_world(scene, drawn, kind):
    way = curve(LINE, kind)
    way.location, way.rotation_euler[2], way.scale = (1, 2, 5), np.pi / 2, (2, 2, 2)
    scene.unit_settings.system, scene.unit_settings.scale_length = "METRIC", 0.5
    bpy.context.view_layer.update()
    track = drawn.read_drawn_track(scene, way, 3.0)
    assert track.times[0] == 3.0 and track.times[-1] == pytest.approx(3.0 + 10.0 / 2.0, abs=1e-3)
    np.testing.assert_allclose(track.positions[[0, -1]], [[0.5, 1.0], [0.5, 11.0]], atol=1e-5)


def test_speeds_are_those_of_the_points(scene, drawn):
    way = curve(LINE, speeds=[0.0, 4.0, 2.0])
    track = drawn.read_drawn_track(scene, way)
    assert track.times[-1] == pytest.approx(2 * 4 / 4 + 2 * 6 / 6)
    assert np.interp(2.0, track.times, track.positions[:, 0]) == pytest.approx(4.0, abs=0.01)


def test_set_speed_sets_the_chosen_points_in_one_step(scene, drawn):
    way = curve(LINE)
    assert bpy.ops.beyond_mocap.set_speed(speed=0.0, wait=2.5) == {"FINISHED"}
    points = way.data.splines[0].bezier_points
    assert [point.radius for point in points] == [0, 0, 0] and points[1].weight_softbody == 2.5
    bpy.ops.object.mode_set(mode="EDIT")
    for number, point in enumerate(way.data.splines[0].bezier_points):
        point.select_control_point = number == 1
    assert bpy.ops.beyond_mocap.set_speed(speed=5.0) == {"FINISHED"}
    assert list(drawn.build_line(scene, way).speeds) == [0, 5, 0]  # also while it is edited
    bpy.ops.object.mode_set(mode="OBJECT")
    assert [point.radius for point in way.data.splines[0].bezier_points] == [0, 5, 0]


def test_what_cannot_be_gone_along_is_told(scene, drawn, core):
    trouble = core("base.errors").InputError
    for points, speeds, change, part in (
        (LINE[:1], None, None, "fewer than two points"),
        ([(0, 0, 0), (0.1, 0, 0)], None, None, "0.10 m long"),
        (LINE, [0.0, 0.0, 1.0], None, "speed 0 at both points 1 and 2"),
        (LINE, [1.0, 13.0, 1.0], None, "13.0 m/s"),
        (LINE, None, "use_cyclic_u", "a closed curve"),
    ):
        way = curve(points, speeds=speeds)
        if change:
            setattr(way.data.splines[0], change, True)
        with pytest.raises(trouble, match=part):
            drawn.read_drawn_track(scene, way)
        before = len(bpy.data.objects), len(scene.beyond_mocap.players)
        with pytest.raises(RuntimeError, match=part):
            bpy.ops.beyond_mocap.track_object()
        assert before == (len(bpy.data.objects), len(scene.beyond_mocap.players))


def moving(kind):
    """An Empty that goes 3 m/s along X from frame 10 on, by itself or by what it hangs on; and what is to be read."""
    empty = bpy.data.objects.new("Runner", None)
    bpy.context.scene.collection.objects.link(empty)
    for frame, x in ((10, 1.0), (58, 7.0)):
        empty.location = (x, 2.0, 0.0)
        empty.keyframe_insert("location", frame=frame)
    for curve in _curves(empty):
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
    if kind == "keys":
        return empty
    other = bpy.data.objects.new("Follower", None)
    if kind == "armature":
        other = bpy.data.objects.new("Follower", bpy.data.armatures.new("Follower"))
    bpy.context.scene.collection.objects.link(other)
    if kind == "armature":
        bpy.context.view_layer.objects.active = other
        bpy.ops.object.mode_set(mode="EDIT")
        bone = other.data.edit_bones.new("root")
        bone.tail = (0, 0, 1)
        bpy.ops.object.mode_set(mode="OBJECT")
    other.constraints.new("COPY_LOCATION").target = empty
    return other


def _curves(target):
    data = target.animation_data
    return [c for layer in data.action.layers for s in layer.strips for c in s.channelbag(data.action_slot).fcurves]


@pytest.mark.parametrize("kind", ["keys", "constraint", "armature"])
def test_what_moves_is_a_track_in_its_own_frames(scene, drawn, kind):
    scene.render.fps, scene.frame_start, scene.frame_end = 24, 10, 58
    scene.beyond_mocap.start_frame, scene.beyond_mocap.start_time = 10, 5.0
    chosen = moving(kind)
    scene.frame_set(20)
    track = drawn.read_drawn_track(scene, chosen)
    assert scene.frame_current == 20
    assert track.times[0] == pytest.approx(5.0) and track.times[-1] == pytest.approx(7.0)
    np.testing.assert_allclose(
        track.positions, np.column_stack([1 + 3 * (track.times - 5), 0 * track.times + 2]), atol=1e-4
    )


def test_what_has_to_be_played_is_left_alone_where_the_scene_must_stand_still(scene, drawn, core):
    chosen = moving("armature")
    scene.frame_start, scene.frame_end = 10, 30
    scene.frame_set(20)
    seen = []
    bpy.app.handlers.frame_change_post.append(lambda *_: seen.append(1))
    try:
        with pytest.raises(core("base.errors").InputError, match="press Update to play it"):
            drawn.read_drawn_track(scene, chosen, still=True)
        assert not seen
        played = drawn.read_drawn_track(scene, chosen)
        assert seen
        seen.clear()
        np.testing.assert_array_equal(drawn.read_drawn_track(scene, chosen, still=True).positions, played.positions)
        scene.frame_end = 40
        with pytest.raises(core("base.errors").InputError, match="press Update"):
            drawn.read_drawn_track(scene, chosen, still=True)
        assert not seen
    finally:
        bpy.app.handlers.frame_change_post.pop()


def test_live_begins_the_same_wish_once(extension, scene):
    plans = importlib.import_module(f"{extension.__name__}.scene.result.plans")
    freshness = importlib.import_module(f"{extension.__name__}.scene.result.freshness")
    bpy.ops.beyond_mocap.draw_track()
    player = scene.beyond_mocap.players[0]
    parts = freshness.compute_plan_parts(plans.build_plan(scene.beyond_mocap, player)[0])
    player.take, player.result.made_of = "take", json.dumps(parts)
    player.height = 1.9
    freshness.LIVE.mark_dirty()
    now = freshness.LIVE.changed_at
    try:
        assert freshness.find_due_update(scene, now + 0.2) == ("Drawn", "quick")
        # it failed, or was cancelled
        assert [freshness.find_due_update(scene, now + later) for later in (0.3, 0.5, 2.0, 3.0)] == [None] * 4
        player.height = 1.8
        freshness.LIVE.mark_dirty()
        assert freshness.find_due_update(scene, freshness.LIVE.changed_at + 0.2) == ("Drawn", "quick")
    finally:
        freshness.clear_edits()


def test_a_drawn_player_has_a_dot_and_is_one_step(scene):
    assert_one_step(bpy.ops.beyond_mocap.draw_track)
    player = bpy.context.scene.beyond_mocap.players[0]
    assert player.drawn_track.type == "CURVE" and player.dot is not None and player.dot.animation_data.action
    assert_one_step(bpy.ops.beyond_mocap.remove_player)
    assert [o.name for o in bpy.data.objects] == ["Drawn curve"]


def test_the_dot_goes_where_the_curve_is_bent_to(extension, scene):
    dots = importlib.import_module(f"{extension.__name__}.scene.player.dots")
    bpy.ops.beyond_mocap.draw_track()
    player = scene.beyond_mocap.players[0]
    player.drawn_track.location.y = 3.0
    bpy.context.view_layer.update()
    actions = len(bpy.data.actions)
    dots.update_dot_track(bpy.context, player)
    scene.frame_set(1)
    assert player.dot.matrix_world.translation.y == pytest.approx(3.0) and len(bpy.data.actions) == actions


def test_pins_are_made_listed_and_taken_away_in_one_step_each(extension, scene, core):
    plans = importlib.import_module(f"{extension.__name__}.scene.result.plans")
    bpy.ops.beyond_mocap.draw_track()
    scene.render.fps, scene.cursor.location = 25, (3, 1, 1.4)
    scene.frame_set(51)
    assert_one_step(bpy.ops.beyond_mocap.add_pin, part="left_hand", at="CURSOR", hold=0.5)
    scene = bpy.context.scene  # undo has replaced what was there before
    player = scene.beyond_mocap.players[0]
    pin, = plans.build_plan(scene.beyond_mocap, player)[0].pins
    assert pin == core("synthesis.plan").Pin(2.0, "left_hand", (3, 1, 1.4), 0.5)
    assert bpy.context.object == player.pins[0].target
    with pytest.raises(RuntimeError, match="one position at a time"):
        bpy.ops.beyond_mocap.add_pin(part="left_hand", at="CURSOR")
    with pytest.raises(RuntimeError, match="no body"):
        bpy.ops.beyond_mocap.add_pin(part="gaze", at="BODY")
    bpy.ops.beyond_mocap.add_pin(part="gaze", at="CURSOR")
    bpy.data.objects.remove(player.pins[1].target)
    assert len(plans.build_plan(scene.beyond_mocap, player)[0].pins) == 1
    assert_one_step(bpy.ops.beyond_mocap.remove_pin)


def test_what_is_a_players_own_is_in_his_plan(extension, scene):
    plans = importlib.import_module(f"{extension.__name__}.scene.result.plans")
    bpy.ops.beyond_mocap.draw_track()
    player = scene.beyond_mocap.players[0]
    plain = plans.build_plan(scene.beyond_mocap, player)[0]
    assert (plain.height, plain.strong_foot, plain.style, plain.pins) == (0.0, "", (), ())
    player.height, player.strong_foot, player.style, player.style_weight = 1.9, "left", " lmd/* ; running", 2.0
    player.strength, player.masses, player.fatigue = 4.0, "women", 0.5
    plan = plans.build_plan(scene.beyond_mocap, player)[0]
    assert plan.height == pytest.approx(1.9) and plan.style == ("lmd/*", "running")
    assert (plan.strong_foot, plan.style_weight) == ("left", 2.0)
    assert (plain.strength, plain.masses, plain.fatigue) == (4.5, "men", 0.0)
    assert (plan.strength, plan.masses, plan.fatigue) == (4.0, "women", 0.5)


def test_a_drawn_player_is_synthesized_updated_and_pinned(extension, scene, core, library_folder):
    freshness = importlib.import_module(f"{extension.__name__}.scene.result.freshness")
    session = importlib.import_module(f"{extension.__name__}.scene.core.session")
    settings = scene.beyond_mocap
    settings.library_folder = str(library_folder)
    bpy.ops.beyond_mocap.draw_track()
    player = settings.players[0]
    assert not freshness.compute_edited_parts(scene, player)  # nothing made yet
    assert bpy.ops.beyond_mocap.synthesize() == {"FINISHED"}
    take = session.find_take(player.take).take
    assert not freshness.compute_edited_parts(scene, player)
    player.drawn_track.data.splines[0].bezier_points[1].co.y += 1.0
    freshness.LIVE.mark_dirty()
    assert freshness.compute_edited_parts(scene, player)
    now = freshness.LIVE.changed_at
    assert freshness.find_due_update(scene, now + 0.2) == ("Drawn", "quick")
    assert bpy.ops.beyond_mocap.update_live(player="Drawn", kind="quick") == {"FINISHED"}
    quick = session.find_take(player.take).take
    assert len(quick.motion) != len(take.motion) and any("cut short" in line for line in quick.warnings)
    assert freshness.find_due_update(scene, now + 0.4) is None
    assert freshness.find_due_update(scene, now + 2.0) == ("Drawn", "whole")
    assert bpy.ops.beyond_mocap.update_live(player="Drawn", kind="whole") == {"FINISHED"}
    assert not any("cut short" in line for line in session.find_take(player.take).take.warnings)
    scene.frame_set(60)
    assert bpy.ops.beyond_mocap.add_pin(part="right_hand", at="BODY") == {"FINISHED"}
    target = player.pins[0].target
    target.location.z += 0.2
    bpy.context.view_layer.update()
    assert freshness.compute_edited_parts(scene, player)
    assert bpy.ops.beyond_mocap.update() == {"FINISHED"}
    made = session.find_take(player.take).take
    assert made.pins[0].miss < 0.005
    skeleton = made.motion.skeleton
    wrist = skeleton.names[core("motion.humanoid").identify_joints(skeleton).right.hand]
    place = player.body.matrix_world @ player.body.pose.bones[wrist].head
    assert (place - target.location).length < 0.01
    with pytest.raises(RuntimeError, match="no player 'Nobody'"):
        bpy.ops.beyond_mocap.update_live(player="Nobody")
    session.clear_session()
