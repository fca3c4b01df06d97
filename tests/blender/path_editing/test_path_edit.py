"""Riders: a motion on a curve in Blender, the original given back to the bit, live as by hand, and told what is
wrong."""

import importlib
import pathlib

import bpy
import numpy as np
import pytest
import worlds
from undo import assert_one_step

SAMPLE = pathlib.Path(__file__).resolve().parents[3] / "sample_blend" / "library"


@pytest.fixture
def part(extension):
    return lambda name: importlib.import_module(f"{extension.__name__}.scene.{name}")


@pytest.fixture
def scene():
    bpy.context.scene.render.fps = 30
    return bpy.context.scene


def walker(name="walking_1_2"):
    """A recording as an armature, active."""
    bpy.ops.beyond_mocap.import_clips(filepath=str(SAMPLE / f"{name}.bvh"))
    return bpy.context.object


def choose(*things):
    for thing in bpy.context.view_layer.objects:
        thing.select_set(thing in things)
    bpy.context.view_layer.objects.active = things[0]


def bits(part, body):
    """All keys that an armature plays, to the bit, and how it stands."""
    channels = part("core.channels")
    action, slot = channels.find_playing_action(body)
    keys = {place: [values.tobytes() for values in channels.read_keys(curve).values()]
            for place, curve in channels.collect_curves(action, slot).items()}
    stands = [(bone.rotation_mode, *bone.location, *bone.rotation_quaternion, *bone.rotation_euler)
              for bone in body.pose.bones]
    return action.name, slot.identifier, keys, stands, tuple(body.location), tuple(body.rotation_euler)


def pelvis(body, frame):
    """Where the first bone is on a frame, in the world."""
    bpy.context.scene.frame_set(frame)
    shown = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return np.array(shown.matrix_world @ shown.pose.bones[0].head)


def to_path(riders, body, frame):
    """Metres over the ground from the first bone to the new path."""
    line = riders.find_computed_edit(body).line[:, :2]
    return np.linalg.norm(line - pelvis(body, frame)[:2], axis=1).min()


def circle(radius=4.0, name="Round", kind="BEZIER"):
    data = bpy.data.curves.new(name, "CURVE")
    data.dimensions = "3D"
    spline = data.splines.new(kind)
    angles = np.arange(8) * np.pi / 4
    points = spline.bezier_points if kind == "BEZIER" else spline.points
    points.add(7)
    for point, angle in zip(points, angles):
        place = (radius * np.cos(angle), radius * np.sin(angle), 0.0)
        point.co = place if kind == "BEZIER" else (*place, 1.0)
        if kind == "BEZIER":
            point.handle_left_type = point.handle_right_type = "AUTO"
    spline.use_cyclic_u = True
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    bpy.context.view_layer.update()
    return thing


def test_on_its_own_curve_the_motion_is_nearly_its_own_and_leave_gives_back_every_bit(scene, part):
    body = walker()
    before, was = bits(part, body), [pelvis(body, frame) for frame in (1, 20, 40)]
    assert bpy.ops.beyond_mocap.edit_path() == {"FINISHED"}
    drawn = bpy.context.object
    assert (
        drawn.type == "CURVE" and drawn == body.beyond_mocap_ride.curve and len(drawn.data.splines[0].bezier_points) > 3
    )
    assert body.animation_data.action.name != before[0] and body.beyond_mocap_ride.messages == ""
    np.testing.assert_allclose([pelvis(body, frame) for frame in (1, 20, 40)], was, atol=0.06)
    scene.frame_set(1)
    assert bpy.ops.beyond_mocap.leave_path() == {"FINISHED"}
    assert bits(part, body) == before
    assert [action.name for action in bpy.data.actions] == [before[0]]


def test_each_button_is_one_step(scene):
    walker()
    assert_one_step(bpy.ops.beyond_mocap.edit_path)
    bpy.context.object.data.splines[0].bezier_points[1].co.y += 1.0
    assert_one_step(bpy.ops.beyond_mocap.update_path)
    assert_one_step(bpy.ops.beyond_mocap.path_curve, shape="STRAIGHT", kind="NURBS")
    assert_one_step(bpy.ops.beyond_mocap.bake_path)
    assert_one_step(bpy.ops.beyond_mocap.edit_path)
    assert_one_step(bpy.ops.beyond_mocap.leave_path)


def test_the_body_goes_where_the_curve_is(scene, part):
    riders, live = part("path_editing.edited_bodies"), part("path_editing.live")
    body = walker()
    bpy.ops.beyond_mocap.edit_path()
    drawn = bpy.context.object
    assert live.update_all(scene) == 0
    for edit in ("point", "object", "edit mode"):
        if edit == "point":
            drawn.data.splines[0].bezier_points[2].co.y += 0.5
        elif edit == "object":
            drawn.location.z, drawn.rotation_euler[2], drawn.scale = 1.0, 0.7, (1.5, 1.5, 1.5)
        else:
            bpy.ops.object.mode_set(mode="EDIT")
            drawn.data.splines[0].bezier_points[1].co.x += 0.3
        bpy.context.view_layer.update()
        assert live.update_all(scene) == 1 and live.update_all(scene) == 0
        assert body.beyond_mocap_ride.messages.startswith("the motion ends") is (edit != "point")  # the path is longer
        assert max(to_path(riders, body, frame) for frame in (1, 15, 30)) < 0.12
    assert pelvis(body, 10)[2] > 1.5


def test_keys_are_plain_and_only_of_what_moves_otherwise(scene, part):
    """A hand is not touched by the path: its few keys stay."""
    channels, riders = part("core.channels"), part("path_editing.edited_bodies")
    body = walker()
    bone = next(bone for bone in body.pose.bones if "hand" in bone.name.lower())
    action, slot = channels.find_playing_action(body)
    curve = channels.collect_curves(action, slot)[f'pose.bones["{bone.name}"].rotation_quaternion', 1]
    while len(curve.keyframe_points) > 3:
        curve.keyframe_points.remove(curve.keyframe_points[1], fast=True)
    curve.update()
    before = channels.read_keys(curve)
    bpy.ops.beyond_mocap.edit_path()
    bpy.context.object.location.y = 2.0
    bpy.context.view_layer.update()
    riders.update_motion(scene, body)
    mine = channels.collect_curves(*channels.find_playing_action(body))
    now = channels.read_keys(mine[f'pose.bones["{bone.name}"].rotation_quaternion', 1])
    assert all(np.array_equal(before[name], now[name]) for name in before)
    keys = channels.read_keys(mine[f'pose.bones["{body.pose.bones[0].name}"].location', 1])
    assert np.all(keys["interpolation"] == channels.LINEAR) and np.all(np.diff(keys["co"][:, 0]) == 1)
    assert np.all(np.isfinite(keys["handle_left"])) and np.abs(keys["handle_left"] - keys["co"]).max() < 2.0


def test_other_channels_are_shown_at_the_frames_that_are_shown(scene, part):
    """A switch, a slider, and a bone that is not of the body, at twice the speed; and as they were at the old speed."""
    channels, live = part("core.channels"), part("path_editing.live")
    body = walker()
    body["switch"], body["slider"] = 0, 0.0
    for frame, switch, slider in ((1, 0, 0.0), (21, 1, 2.0), (41, 0, 4.0)):
        body["switch"], body["slider"] = switch, slider
        body.keyframe_insert('["switch"]', frame=frame)
        body.keyframe_insert('["slider"]', frame=frame)
    slot = channels.find_playing_action(body)[1]
    was = channels.collect_curves(channels.find_playing_action(body)[0], slot)
    slider, steps = (channels.sample_curve(was[f'["{name}"]', 0], np.arange(1.0, 42.0))
                     for name in ("slider", "switch"))
    before = {place: channels.read_keys(curve)["co"].tobytes() for place, curve in was.items()}
    bpy.ops.beyond_mocap.edit_path()
    ride = body.beyond_mocap_ride
    last = lambda: channels.find_key_range({k: c for k, c in mine().items() if "pose" in k[0]})[1]
    mine = lambda: channels.collect_curves(*channels.find_playing_action(body))
    whole = last()
    ride.speed = 2.0
    live.update_all(scene)
    assert last() == pytest.approx(whole / 2, abs=1) and ride.messages == ""
    found = channels.sample_curve(mine()['["slider"]', 0], np.arange(1.0, 20.0))
    np.testing.assert_allclose(found, slider[0:37:2], atol=1e-4)
    switch = channels.sample_curve(mine()['["switch"]', 0], np.arange(1.0, 20.0))
    assert set(switch) == {0.0, 1.0} and np.array_equal(switch, steps[0:37:2])
    ride.speed = 1.0
    live.update_all(scene)
    now = {place: channels.read_keys(curve)["co"].tobytes() for place, curve in mine().items()}
    same = [place for place in now if now[place] == before.get(place)]
    assert ('["slider"]', 0) in same and ('["switch"]', 0) in same and len(same) > 0.5 * len(now)
    assert last() == whole


@pytest.mark.parametrize("mode", ["NATIVE", "XYZ", "ZYX", "QUATERNION"])
def test_the_rotation_mode_stays(scene, part, mode):
    """Blender's own import, Euler angles of any order; no channel jumps, none is no number."""
    channels, riders = part("core.channels"), part("path_editing.edited_bodies")
    bpy.ops.import_anim.bvh(filepath=str(SAMPLE / "walking_1_2.bvh"), global_scale=0.01, rotate_mode=mode,
                            axis_forward="-Z", axis_up="Y", use_fps_scale=False)
    body = bpy.context.object
    modes = [bone.rotation_mode for bone in body.pose.bones]
    scene.frame_set(1)
    before = bits(part, body)
    round_about = circle()
    choose(body, round_about)
    assert bpy.ops.beyond_mocap.edit_path() == {"FINISHED"}
    assert body.beyond_mocap_ride.curve == round_about and body.beyond_mocap_ride.messages == ""
    assert [bone.rotation_mode for bone in body.pose.bones] == modes
    steps = [np.abs(np.diff(channels.read_keys(curve)["co"][:, 1])).max() for (path, _),
             curve in channels.collect_curves(*channels.find_playing_action(body)).items() if "rotation" in path]
    assert max(steps) < 1.0
    assert max(to_path(riders, body, frame) for frame in (40, 20, 1)) < 0.12
    choose(body)
    bpy.ops.beyond_mocap.leave_path()
    assert bits(part, body) == before


def test_metres_and_seconds_are_the_scene_s(scene, part):
    """A film's frame rate, centimetres, an armature that is turned, scaled and far away: the body is on the curve."""
    riders = part("path_editing.edited_bodies")
    scene.render.fps, scene.render.fps_base = 24, 1.001
    scene.unit_settings.system, scene.unit_settings.scale_length = "METRIC", 0.01
    body = walker()
    body.location, body.rotation_euler, body.scale = (500.0, -200.0, 30.0), (0.0, 0.0, 2.0), (1.0, 1.0, 1.0)
    bpy.context.view_layer.update()
    place = pelvis(body, 10)
    assert bpy.ops.beyond_mocap.edit_path() == {"FINISHED"}
    np.testing.assert_allclose(pelvis(body, 10), place, atol=6.0)
    drawn = bpy.context.object
    drawn.matrix_world = drawn.matrix_world.copy()
    drawn.location.y += 300.0
    drawn.rotation_euler[2] = 1.0
    assert bpy.ops.beyond_mocap.update_path() == {"FINISHED"}
    line = riders.find_computed_edit(body).line
    assert np.linalg.norm(line[:, :2] - pelvis(body, 10)[:2] / 100, axis=1).min() < 0.12
    figures = riders.find_computed_edit(body).edited
    assert figures.motion.fps == pytest.approx(24 / 1.001)


def test_two_riders_each_on_his_own_or_both_on_one(scene, part):
    live, riders = part("path_editing.live"), part("path_editing.edited_bodies")
    first, second = walker(), walker("jogging_2_9")
    choose(first, second)
    assert bpy.ops.beyond_mocap.edit_path() == {"FINISHED"}
    curves = [body.beyond_mocap_ride.curve for body in (first, second)]
    assert curves[0] != curves[1] and bpy.context.object == curves[0]
    curves[1].location.y += 1.0
    bpy.context.view_layer.update()
    assert live.update_all(scene) == 1
    choose(first, second)
    assert bpy.ops.beyond_mocap.leave_path() == {"FINISHED"}
    shared = circle()
    choose(first, second, shared)
    assert bpy.ops.beyond_mocap.edit_path() == {"FINISHED"}
    assert first.beyond_mocap_ride.curve == second.beyond_mocap_ride.curve == shared
    shared.location.x += 1.0
    bpy.context.view_layer.update()
    assert live.update_all(scene) == 2
    second.beyond_mocap_ride.delay = 2.0
    assert live.update_all(scene) == 1
    assert max(to_path(riders, body, frame) for body in (first, second) for frame in (1, 30)) < 0.15
    choose(shared)
    assert bpy.ops.beyond_mocap.bake_path() == {"FINISHED"}
    assert not first.beyond_mocap_ride.on and not second.beyond_mocap_ride.on and bpy.context.object in (first, second)


BAD = {"one point": ([(0, 0, 0)], "no line"), "repeated": ([(1, 1, 0)] * 4, "all points are equal"),
       "short": ([(0, 0, 0), (0.01, 0, 0)], "0.01 m long")}
ODD = {"repeated points": [(0, 0, 0), (0, 0, 0), (2, 0, 0), (2, 0, 0), (4, 1, 0)],
       "cusp": [(0, 0, 0), (4, 0, 0), (0, 0.0, 0)],
       "tiny loop": [(0, 0, 0), (2, 0, 0), (2.1, 0.1, 0), (2, 0.2, 0), (1.9, 0.1, 0), (2, 0, 0), (4, 0, 0)],
       "vertical": [(0, 0, 0), (0, 0, 2), (0, 0, 5)],
       "wall in the way": [(0, 0, 0), (2, 0, 0), (2, 0, 3), (4, 0, 3)]}


def drawn(points, kind="POLY"):
    data = bpy.data.curves.new("Odd", "CURVE")
    data.dimensions = "3D"
    spline = data.splines.new(kind)
    spline.points.add(len(points) - 1)
    for point, place in zip(spline.points, points):
        point.co = (*place, 1.0)
    thing = bpy.data.objects.new("Odd", data)
    bpy.context.scene.collection.objects.link(thing)
    bpy.context.view_layer.update()
    return thing


@pytest.mark.parametrize("name", BAD)
def test_a_curve_that_is_no_path_is_told_and_the_last_good_motion_stays(scene, part, name):
    live = part("path_editing.live")
    points, line = BAD[name]
    body = walker()
    before, odd = bits(part, body), drawn(points)
    choose(body, odd)
    with pytest.raises(RuntimeError, match=line):
        bpy.ops.beyond_mocap.edit_path()
    assert bits(part, body) == before and not body.beyond_mocap_ride.on and body.beyond_mocap_ride.curve is None
    choose(body)
    bpy.ops.beyond_mocap.edit_path()
    before = bits(part, body)
    body.beyond_mocap_ride.curve = odd
    bpy.context.view_layer.update()
    assert live.update_all(scene) == 0
    assert line in body.beyond_mocap_ride.messages and "\n" not in body.beyond_mocap_ride.messages
    assert bits(part, body) == before
    bpy.data.objects.remove(odd)
    assert live.update_all(scene) == 0 and "its curve is not in the scene" in body.beyond_mocap_ride.messages
    assert bits(part, body) == before


@pytest.mark.parametrize("kind", ["POLY", "NURBS"])
@pytest.mark.parametrize("name", ODD)
def test_an_odd_curve_gives_numbers(scene, part, name, kind):
    channels = part("core.channels")
    body = walker()
    choose(body, drawn(ODD[name], kind))
    assert bpy.ops.beyond_mocap.edit_path() == {"FINISHED"}
    for curve in channels.collect_curves(*channels.find_playing_action(body)).values():
        assert np.isfinite(channels.read_keys(curve)["co"]).all()


def test_saved_riders_are_alive_again(scene, part, tmp_path):
    live, riders = part("path_editing.live"), part("path_editing.edited_bodies")
    body = walker()
    before = bits(part, body)
    bpy.ops.beyond_mocap.edit_path()
    bpy.context.object.location.y += 1.0
    bpy.ops.beyond_mocap.update_path()
    name, after = body.name, bits(part, body)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "ridden.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "ridden.blend"))
    scene, body = bpy.context.scene, bpy.data.objects[name]
    assert riders.find_computed_edit(body) is None
    assert live.update_all(scene) == 1 and bits(part, body) == after and riders.find_computed_edit(body) is not None
    body.beyond_mocap_ride.curve.location.y += 1.0
    bpy.context.view_layer.update()
    assert live.update_all(scene) == 1 and bits(part, body) != after
    choose(body)
    bpy.ops.beyond_mocap.leave_path()
    assert bits(part, body) == before


def test_a_rider_appended_to_another_file_rides_there(scene, part, tmp_path):
    live = part("path_editing.live")
    body = walker()
    before = bits(part, body)
    bpy.ops.beyond_mocap.edit_path()
    name = body.name
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "ridden.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.context.scene.render.fps = 30
    with bpy.data.libraries.load(str(tmp_path / "ridden.blend")) as (_, wanted):
        wanted.objects = [name, f"{name} path"]
    for thing in wanted.objects:
        bpy.context.scene.collection.objects.link(thing)
    body, drawn = wanted.objects
    drawn.location.y += 1.0
    bpy.context.view_layer.update()
    assert live.update_all(bpy.context.scene) == 1 and body.beyond_mocap_ride.messages == ""
    choose(body)
    bpy.ops.beyond_mocap.leave_path()
    assert bits(part, body) == before


def test_undo_brings_curve_and_motion_back_together(scene, part):
    """A point pulled, followed by hand as the timer does, then a step: undo, redo, and the rider is up to date each
    time."""
    live = part("path_editing.live")
    body = walker()
    bpy.ops.beyond_mocap.edit_path()
    name = body.name
    states = []
    bpy.ops.ed.undo_push(message="begun")
    for move in (1.0, 2.0):
        bpy.data.objects[name].beyond_mocap_ride.curve.data.splines[0].bezier_points[1].co.y += move
        bpy.context.view_layer.update()
        assert live.update_all(bpy.context.scene) == 1
        bpy.ops.ed.undo_push(message=f"moved {move}")
        states.append(bits(part, bpy.data.objects[name])[:3])
    bpy.ops.ed.undo()
    live.update_all(bpy.context.scene)
    assert bits(part, bpy.data.objects[name])[:3] == states[0]
    bpy.ops.ed.redo()
    live.update_all(bpy.context.scene)
    assert bits(part, bpy.data.objects[name])[:3] == states[1]
    bpy.ops.ed.undo()
    bpy.data.objects[name].beyond_mocap_ride.curve.data.splines[0].bezier_points[1].co.y += 2.0
    bpy.context.view_layer.update()
    live.update_all(bpy.context.scene)
    assert bits(part, bpy.data.objects[name])[:3] == states[1]


def test_kept_is_an_ordinary_action_and_the_original_stays_in_the_file(scene, part, tmp_path):
    body = walker()
    original = body.animation_data.action.name
    bpy.ops.beyond_mocap.edit_path()
    bpy.context.object.location.y += 2.0
    bpy.ops.beyond_mocap.update_path()
    bpy.ops.beyond_mocap.bake_path()
    kept = body.animation_data.action
    assert not body.beyond_mocap_ride.on and not [name for name in kept.keys() if "ride" in name]
    assert bpy.data.actions[original].use_fake_user and bpy.context.object == body
    name, after = body.name, bits(part, body)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "kept.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "kept.blend"))
    assert bits(part, bpy.data.objects[name]) == after and original in bpy.data.actions


def test_what_was_ridden_last_can_be_kept_when_its_curve_is_gone(scene, part):
    body = walker()
    bpy.ops.beyond_mocap.edit_path()
    before = bits(part, body)[2]
    bpy.data.objects.remove(bpy.context.object)
    bpy.context.view_layer.update()
    choose(body)
    assert bpy.ops.beyond_mocap.bake_path() == {"FINISHED"}
    assert bits(part, body)[2] == before and not body.beyond_mocap_ride.on


def test_two_are_kept_together_or_neither(scene):
    first, other = walker(), walker()
    choose(first, other)
    bpy.ops.beyond_mocap.edit_path()
    other.animation_data.action = bpy.data.actions.new("Chosen by hand")
    choose(first, other)
    with pytest.raises(RuntimeError, match="another action"):
        bpy.ops.beyond_mocap.bake_path()
    assert first.beyond_mocap_ride.on and other.beyond_mocap_ride.on


def test_a_deleted_curve_and_ground_are_not_kept_for_who_rode_them(scene, part):
    """While they might come back by undo they are told to be gone; who leaves lets go of them."""
    live = part("path_editing.live")
    body = walker()
    bpy.ops.beyond_mocap.edit_path()
    drawn = bpy.context.object
    bpy.ops.mesh.primitive_plane_add(size=100.0, location=(0.0, 0.0, 0.3))
    body.beyond_mocap_ride.ground = bpy.context.object
    assert live.update_all(scene) == 1
    was = bits(part, body)[:3]
    bpy.ops.object.delete()
    assert (live.update_all(scene) == 0 and "Plane is not in the scene" in body.beyond_mocap_ride.messages
            and bits(part, body)[:3] == was)
    choose(drawn)
    bpy.ops.object.delete()
    assert (live.update_all(scene) == 0 and "its curve is not in the scene" in body.beyond_mocap_ride.messages
            and bits(part, body)[:3] == was)
    choose(body)
    assert bpy.ops.beyond_mocap.leave_path() == {"FINISHED"}
    assert body.beyond_mocap_ride.curve is None and body.beyond_mocap_ride.ground is None


def test_another_curve_takes_the_place_of_one_that_was_made_here(scene, part, extension):
    body = walker()
    bpy.ops.beyond_mocap.edit_path()
    name = bpy.context.object.name
    for arguments, points in (({"shape": "STRAIGHT", "count": 2}, 2),
                              ({"shape": "PRESENT", "kind": "NURBS", "count": 9}, 9),
                              ({"shape": "FITTED", "count": 1}, 2), ({"kind": "NURBS", "degree": 5}, 6)):
        assert bpy.ops.beyond_mocap.path_curve(**arguments) == {"FINISHED"}
        spline = bpy.context.object.data.splines[0]
        assert len(spline.bezier_points or spline.points) >= points and body.beyond_mocap_ride.messages == ""
        assert [curve.name for curve in bpy.data.curves] == [name] == [bpy.context.object.name]
    assert bpy.ops.beyond_mocap.path_curve(kind="NURBS", degree=9, count=14) == {"FINISHED"}
    drawn = part("path_editing.curve").read_curve(bpy.context.scene, bpy.context.object)
    assert drawn.order == 10 and "follows degree 9" in drawn.notes[0] and len(drawn.points) == 14
    spline = bpy.context.object.data.splines[0]
    assert spline.order_u == 6 and "follows degree 9" in body.beyond_mocap_ride.messages
    core = importlib.import_module(f"{extension.__name__}.beyond_mocap.path_editing.path_line")
    exact = core.build_b_spline(drawn.points[:, :3], 9).at(np.linspace(0.0, 1.0, 200))
    line = drawn.sample_line()
    assert max(np.linalg.norm(line - place, axis=1).min() for place in exact) < 0.02
    spline.order_u = 4
    assert part("path_editing.curve").read_curve(bpy.context.scene, bpy.context.object).order == 4
    with pytest.raises(RuntimeError, match="control points"):
        bpy.ops.beyond_mocap.path_curve(kind="NURBS", degree=5, count=4)
    assert [curve.name for curve in bpy.data.curves] == [name] == [body.beyond_mocap_ride.curve.name]
    original = part("path_editing.edited_bodies").find_computed_edit(body).source.arc.length
    bpy.ops.beyond_mocap.path_curve(shape="STRAIGHT")
    assert np.ptp(part("path_editing.edited_bodies").find_computed_edit(body).line,
                  axis=0).max() == pytest.approx(original, abs=0.02)
    own = circle()
    body.beyond_mocap_ride.curve = own
    bpy.context.view_layer.update()
    choose(body)
    bpy.ops.beyond_mocap.path_curve()
    assert own.name in bpy.data.objects


@pytest.mark.parametrize("closed", (False, True))
def test_a_new_curve_goes_round_every_corner_of_the_path(scene, part, extension, closed):
    """A corner that the curve cut would make whoever rides it run ahead of the original from there on."""
    core = importlib.import_module(f"{extension.__name__}.beyond_mocap.path_editing.path_line")
    length = importlib.import_module(f"{extension.__name__}.beyond_mocap.motion.path.arc_length").ArcLength
    turn = np.linspace(-np.pi / 2, np.pi / 2, 20)
    bow = np.stack([15.0 + 0.3 * np.cos(turn), 0.3 + 0.3 * np.sin(turn), 0 * turn], axis=1)
    path = core.fit_line(np.concatenate([[[0.0, 0.0, 0.0]], bow, [[0.0, 0.6, 0.0]]]), "hairpin", closed=closed)
    curves = part("path_editing.curve")
    drawn = curves.read_curve(scene, curves.create_curve(bpy.context, "Hairpin", path)).to_path()
    assert drawn.closed == closed
    own, made = length(path), length(drawn)
    s = np.linspace(0.0, min(own.length, made.length), 200)
    apart = np.linalg.norm(path.at(own.parameter_at(s)) - drawn.at(made.parameter_at(s)), axis=1)
    assert apart[:-1].max() < 0.06


def test_a_picked_curve_is_active_where_the_one_before_was(scene, part):
    body = walker()
    bpy.ops.beyond_mocap.edit_path()
    ring = circle()
    body.beyond_mocap_ride.curve = ring
    assert bpy.context.object == ring and bpy.ops.beyond_mocap.update_path() == {"FINISHED"}
    choose(body)
    body.beyond_mocap_ride.curve = circle(name="Another")
    assert bpy.context.object == body


def test_who_rides_already_takes_the_selected_curve(scene, part):
    riders = part("path_editing.edited_bodies")
    first, second = walker(), walker("jogging_2_9")
    choose(first)
    bpy.ops.beyond_mocap.edit_path()
    own = first.beyond_mocap_ride.curve
    choose(first)
    with pytest.raises(RuntimeError, match="already follows a path"):
        bpy.ops.beyond_mocap.edit_path()
    ring, point = circle(), drawn([(0, 0, 0)])
    before = bits(part, first), bits(part, second)
    choose(first, second, point)
    with pytest.raises(RuntimeError, match="no line"):
        bpy.ops.beyond_mocap.edit_path()
    assert (bits(part, first), bits(part, second)) == before and first.beyond_mocap_ride.curve == own
    choose(first, second, ring)
    assert bpy.ops.beyond_mocap.edit_path() == {"FINISHED"}
    assert first.beyond_mocap_ride.curve == second.beyond_mocap_ride.curve == ring == bpy.context.object
    assert max(to_path(riders, body, frame) for body in (first, second) for frame in (1, 40)) < 0.15


def test_button_and_function_give_the_same(scene, part, core):
    """What is written is what the core says, for the motion and the curve as they are read."""
    action, curve = part("core.action"), part("path_editing.curve")
    body, round_about = walker(), circle()
    motion = action.read_motion(body, scene)
    settings = core("path_editing.path_edit_settings").PathEditSettings(speed=1.25, lean=False, cycle=True)
    source = core("path_editing.path_edit_source").prepare_source(motion, settings)
    path = curve.read_curve(scene, round_about).to_path()
    wanted = core("path_editing.path_edit").edit_path(source, path, settings).motion
    body.beyond_mocap_ride.speed, body.beyond_mocap_ride.lean, body.beyond_mocap_ride.cycle = 1.25, False, True
    choose(body, round_about)
    bpy.ops.beyond_mocap.edit_path()
    found = action.read_motion(body, scene)
    assert len(found) == len(wanted)
    np.testing.assert_allclose(found.root_positions, wanted.root_positions, atol=1e-5)
    dots = np.abs(np.sum(found.rotations * wanted.rotations, axis=2))
    assert dots.min() > 1 - 1e-9


def test_feet_follow_a_mesh(scene, part):
    """A ramp as the ground: the body climbs it, though the curve lies flat."""
    live = part("path_editing.live")
    body = walker()
    bpy.ops.beyond_mocap.edit_path()
    mesh = bpy.data.meshes.new("Ramp")
    mesh.from_pydata([(-50, -50, -10), (50, -50, 10), (50, 50, 10), (-50, 50, -10)], [], [(0, 1, 2, 3)])
    ramp = bpy.data.objects.new("Ramp", mesh)
    scene.collection.objects.link(ramp)
    bpy.context.view_layer.update()
    body.beyond_mocap_ride.ground = ramp
    was = pelvis(body, 1), pelvis(body, 40)
    assert live.update_all(scene) == 1 and live.update_all(scene) == 0
    now = pelvis(body, 1), pelvis(body, 40)
    climb = 0.2 * (now[1][0] - now[0][0])
    assert (now[1][2] - now[0][2]) - (was[1][2] - was[0][2]) == pytest.approx(climb, abs=0.06)
    mesh.vertices[1].co.z += 1.0
    mesh.update()
    bpy.context.view_layer.update()
    assert live.update_all(scene) == 1


def test_a_copy_that_shares_the_action_gets_its_own(scene, part):
    """Alt-D: two riders on two curves, and no write of one is undone by the other."""
    live, riders = part("path_editing.live"), part("path_editing.edited_bodies")
    body = walker()
    bpy.ops.beyond_mocap.edit_path()
    twin = body.copy()
    scene.collection.objects.link(twin)
    twin.beyond_mocap_ride.curve = circle()
    bpy.context.view_layer.update()
    assert twin.animation_data.action == body.animation_data.action
    live.update_all(scene)
    assert twin.animation_data.action != body.animation_data.action and live.update_all(scene) == 0
    assert to_path(riders, twin, 20) < 0.12 and to_path(riders, body, 20) < 0.12


def test_a_curve_that_moves_with_time_is_ridden_as_it_lay_when_edited(scene, part):
    live = part("path_editing.live")
    body = walker()
    bpy.ops.beyond_mocap.edit_path()
    drawn = bpy.context.object
    for frame, x in ((1, 0.0), (100, 9.0)):
        drawn.location.x = x
        drawn.keyframe_insert("location", frame=frame)
    scene.frame_set(50)
    live.update_all(scene)
    assert "its animation is ignored" in body.beyond_mocap_ride.messages
    before = bits(part, body)[:3]
    scene.frame_set(90)
    assert live.update_all(scene) == 0 and bits(part, body)[:3] == before
    drawn.data.splines[0].bezier_points[1].co.y += 1.0
    assert live.update_all(scene) == 1


def test_a_curve_that_hangs_on_something_goes_with_it(scene, part):
    """On a parent, and on a constraint's target, both moved by hand."""
    live, riders = part("path_editing.live"), part("path_editing.edited_bodies")
    body = walker()
    bpy.ops.beyond_mocap.edit_path()
    path = bpy.context.object
    hook, target = bpy.data.objects.new("Hook", None), bpy.data.objects.new("Target", None)
    for thing in (hook, target):
        scene.collection.objects.link(thing)
    path.parent = hook
    path.constraints.new("COPY_LOCATION").target = target
    for thing, place in ((target, (3.0, 4.0, 0.0)), (target, (3.0, 4.0, 1.0))):
        thing.location = place
        bpy.context.view_layer.update()
        scene.frame_set(20)
        assert live.update_all(scene) == 1 and body.beyond_mocap_ride.messages == ""
        np.testing.assert_allclose(riders.find_computed_edit(body).line[0], place, atol=1e-3)
    hook.rotation_euler[2] = 1.0
    bpy.context.view_layer.update()
    assert live.update_all(scene) == 1


def test_nobody_cycles_for_hours(scene, part):
    live = part("path_editing.live")
    body = walker()
    bpy.ops.beyond_mocap.edit_path()
    bpy.context.object.scale = (1000.0, 1000.0, 1000.0)
    body.beyond_mocap_ride.cycle = True
    before = bits(part, body)[:3]
    bpy.context.view_layer.update()
    assert live.update_all(scene) == 0 and "22 minutes or less" in body.beyond_mocap_ride.messages
    assert bits(part, body)[:3] == before
    body.beyond_mocap_ride.cycle = False
    assert live.update_all(scene) == 1


def test_a_path_that_ends_early_is_repeated_cycled_or_stops(scene, part):
    """A short closed ring is gone round; an open line of 2 m ends, or is begun again; a long one is filled by
    cycling."""
    live, channels = part("path_editing.live"), part("core.channels")
    body = walker()
    line = drawn([(0, 0, 0), (2.5, 0, 0)])
    choose(body, line)
    bpy.ops.beyond_mocap.edit_path()
    ride = body.beyond_mocap_ride
    frames = {}
    for name, change in (("stop", {}), ("repeat", {"end": "repeat"}), ("cycle", {"cycle": True, "end": "stop"})):
        for key, value in change.items():
            setattr(ride, key, value)
        if name == "cycle":
            line.scale = (8.0, 1.0, 1.0)
        bpy.context.view_layer.update()
        live.update_all(scene)
        curves = {
            place: curve for place, curve in channels.collect_curves(*channels.find_playing_action(body)).items()
            if "location" in place[0]
        }
        frames[name] = channels.find_key_range(curves)[1]
        assert all(np.isfinite(channels.read_keys(curve)["co"]).all() for curve in curves.values())
    assert frames["stop"] < frames["repeat"] < frames["cycle"]
    ring = circle(1.5)
    ride.curve, ride.cycle = ring, False
    bpy.context.view_layer.update()
    assert live.update_all(scene) == 1 and ride.messages == ""
    ring.data.splines[0].use_cyclic_u = False
    bpy.context.view_layer.update()
    assert live.update_all(scene) == 1


def test_the_ground_counts_while_it_is_edited(scene, part):
    live = part("path_editing.live")
    body = walker()
    bpy.ops.beyond_mocap.edit_path()
    mesh = bpy.data.meshes.new("Floor")
    mesh.from_pydata([(-50, -50, 0), (50, -50, 0), (50, 50, 0), (-50, 50, 0)], [], [(0, 1, 2, 3)])
    floor = bpy.data.objects.new("Floor", mesh)
    scene.collection.objects.link(floor)
    body.beyond_mocap_ride.ground = floor
    bpy.context.view_layer.update()
    assert live.update_all(scene) == 1
    choose(floor)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.context.view_layer.update()
    assert live.update_all(scene) == 0 and "without faces" not in body.beyond_mocap_ride.messages
    bpy.ops.object.mode_set(mode="OBJECT")
    mesh.clear_geometry()
    bpy.context.view_layer.update()
    before = bits(part, body)[:3]
    assert live.update_all(scene) == 0 and "without faces" in body.beyond_mocap_ride.messages
    assert bits(part, body)[:3] == before
    body.beyond_mocap_ride.ground = None
    assert live.update_all(scene) == 1 and body.beyond_mocap_ride.messages == ""


def test_what_was_wrong_is_told_no_more_once_all_is_as_before(scene, part):
    live = part("path_editing.live")
    body = walker()
    bpy.ops.beyond_mocap.edit_path()
    empty = bpy.data.objects.new("Empty", bpy.data.meshes.new("Empty"))
    scene.collection.objects.link(empty)
    for ground, told in ((empty, "without faces"), (None, "")):
        body.beyond_mocap_ride.ground = ground
        bpy.context.view_layer.update()
        assert live.update_all(scene) == 0 and (
            told in body.beyond_mocap_ride.messages if told else not body.beyond_mocap_ride.messages
        )


def test_a_ground_that_moves_with_time_does_not_change_the_motion_with_the_frame(scene, part):
    live = part("path_editing.live")
    body = walker()
    bpy.ops.beyond_mocap.edit_path()
    bpy.ops.mesh.primitive_plane_add(size=100.0)
    floor = bpy.context.object
    for frame, height in ((1, 0.0), (40, 1.0)):
        floor.location.z = height
        floor.keyframe_insert("location", frame=frame)
    scene.frame_set(1)
    body.beyond_mocap_ride.ground = floor
    assert live.update_all(scene) == 1 and "ground Plane: its animation is ignored" in body.beyond_mocap_ride.messages
    was = bits(part, body)[:3]
    scene.frame_set(30)
    assert live.update_all(scene) == 0 and bits(part, body)[:3] == was


def test_what_cannot_be_read_is_not_looked_at_again_and_again(scene, part, monkeypatch):
    """A rig is looked at by changing frames, and each change is seen: it must not begin anew by itself."""
    live, carrier = part("path_editing.live"), part("path_editing.armature_adapter")
    body = walker()
    bpy.ops.beyond_mocap.edit_path()
    looks = []

    def fails(*_):
        looks.append(1)
        raise carrier.InputError("motion", "unreadable")

    monkeypatch.setattr(carrier.PlainAdapter, "read_motion", fails)
    body.beyond_mocap_ride.fit = "polynomial"
    for _ in range(3):
        assert live.update_all(scene) == 0 and body.beyond_mocap_ride.messages == "motion: unreadable"
    assert len(looks) == 1
    monkeypatch.undo()
    choose(body)
    assert bpy.ops.beyond_mocap.update_path() == {"FINISHED"} and body.beyond_mocap_ride.messages == ""


def test_a_motion_longer_than_the_scene_is_told_as_long_as_it_is(scene, part):
    body, drawn = walker(), circle()
    scene.frame_end = 250
    choose(body, drawn)
    bpy.ops.beyond_mocap.edit_path()
    ride, follow = body.beyond_mocap_ride, part("path_editing.live").update_all
    assert "goes on" not in ride.messages
    ride.cycle = True
    follow(scene)
    last = int(body.animation_data.action.frame_range[1])
    assert last > 250 and ride.messages.endswith(f"ends at frame {last}, after the end of the scene at 250")
    assert scene.frame_end == 250
    scene.frame_end = last
    follow(scene)
    assert "goes on" not in ride.messages


def test_a_new_curve_takes_back_the_line_about_the_one_before(scene, part):
    body = walker()
    bpy.ops.beyond_mocap.edit_path()
    ride, follow = body.beyond_mocap_ride, part("path_editing.live").update_all
    for point in ride.curve.data.splines[0].bezier_points:
        point.co = point.handle_left = point.handle_right = (0, 0, 0)
    bpy.context.view_layer.update()
    follow(scene)
    assert "all points are equal" in ride.messages
    bpy.ops.beyond_mocap.path_curve(shape="FITTED")
    follow(scene)
    assert ride.messages == ""


def test_a_bent_path_reports_its_rest_and_touches_that_no_longer_meet_the_ball(scene, tmp_path, library_folder):
    places = worlds.make_places(tmp_path)
    worlds.import_tracking(places)
    scene.beyond_mocap.library_folder = str(library_folder)
    bpy.ops.beyond_mocap.synthesize(player="player1")
    body = scene.beyond_mocap.players[0].body
    choose(body)
    bpy.ops.beyond_mocap.edit_path()
    edit = body.beyond_mocap_ride
    assert edit.messages == ""
    points = edit.curve.data.splines[0].bezier_points
    points[-1].co.y += 2.0  # after the kick
    bpy.ops.beyond_mocap.update_path()
    assert "before the end of the path: shorten the path" in edit.messages and "ball" not in edit.messages
    points[0].co.y -= 2.0
    bpy.ops.beyond_mocap.update_path()
    assert "no longer meets the ball at 1 of 1 touch, first at frame 73;" in edit.messages


def test_a_body_that_stands_and_touches_that_were_cut_off_before_are_no_faults_of_a_path(scene, part, tmp_path,
                                                                                        library_folder):
    places = worlds.make_places(tmp_path)
    worlds.import_tracking(places)
    scene.beyond_mocap.library_folder = str(library_folder)
    bpy.ops.beyond_mocap.synthesize(player="player1")
    bpy.ops.beyond_mocap.accept()
    body = scene.beyond_mocap.players[0].body
    channels = part("core.channels")
    for keys in channels.collect_curves(*channels.find_playing_action(body)).values():
        for key in reversed(keys.keyframe_points):
            if key.co.x > 40.0:  # the kick is at frame 73
                keys.keyframe_points.remove(key)
    for one in (body, walker("standing_1")):
        choose(one)
        bpy.ops.beyond_mocap.edit_path()
        one.beyond_mocap_ride.curve.data.splines[0].bezier_points[0].co.y -= 2.0
        bpy.ops.beyond_mocap.update_path()
        assert "ball" not in one.beyond_mocap_ride.messages
    assert "before the end of the path" not in one.beyond_mocap_ride.messages


@pytest.mark.parametrize(("name", "kind"),
                         [("walking_back", "BEZIER"), ("getting_up", "BEZIER"), ("throw_in", "NURBS")])
def test_a_body_that_sways_back_where_it_stops_is_not_cut_off_on_its_own_path(scene, name, kind):
    body = walker(name)
    choose(body)
    bpy.ops.beyond_mocap.edit_path(kind=kind)
    assert body.beyond_mocap_ride.messages == ""
