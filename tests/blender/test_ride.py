"""Riders: a motion on a curve in Blender, the original given back to the bit, live as by hand, and told what is wrong."""

import importlib
import pathlib

import bpy
import numpy as np
import pytest
from undo import assert_one_step

SAMPLE = pathlib.Path(__file__).resolve().parents[2] / "sample_blend" / "library"


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
    channels = part("channels")
    action, slot = channels.playing(body)
    keys = {place: [values.tobytes() for values in channels.keys_of(curve).values()]
            for place, curve in channels.curves(action, slot).items()}
    stands = [(bone.rotation_mode, *bone.location, *bone.rotation_quaternion, *bone.rotation_euler) for bone in body.pose.bones]
    return action.name, slot.identifier, keys, stands, tuple(body.location), tuple(body.rotation_euler)


def pelvis(body, frame):
    """Where the first bone is on a frame, in the world."""
    bpy.context.scene.frame_set(frame)
    shown = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return np.array(shown.matrix_world @ shown.pose.bones[0].head)


def to_path(riders, body, frame):
    """Metres over the ground from the first bone to the new path."""
    line = riders.shown(body).line[:, :2]
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
    assert drawn.type == "CURVE" and drawn == body.beyond_mocap_ride.curve and len(drawn.data.splines[0].bezier_points) > 3
    assert body.animation_data.action.name != before[0] and body.beyond_mocap_ride.told == ""
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
    riders, live = part("ride.riders"), part("ride.live")
    body = walker()
    bpy.ops.beyond_mocap.edit_path()
    drawn = bpy.context.object
    assert live.follow(scene) == 0
    for edit in ("point", "object", "edit mode"):
        if edit == "point":
            drawn.data.splines[0].bezier_points[2].co.y += 0.5
        elif edit == "object":
            drawn.location.z, drawn.rotation_euler[2], drawn.scale = 1.0, 0.7, (1.5, 1.5, 1.5)
        else:
            bpy.ops.object.mode_set(mode="EDIT")
            drawn.data.splines[0].bezier_points[1].co.x += 0.3
        bpy.context.view_layer.update()
        assert live.follow(scene) == 1 and live.follow(scene) == 0
        assert body.beyond_mocap_ride.told == ""
        assert max(to_path(riders, body, frame) for frame in (1, 15, 30)) < 0.12
    assert pelvis(body, 10)[2] > 1.5
