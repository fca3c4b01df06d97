"""Riders keep apart: found, resolved, told, taken back, and worked out anew from what the user drew."""

import importlib
import json

import bpy
import numpy as np
import pytest
from test_path_edit import choose, circle, part, pelvis, scene, walker  # noqa: F401
from undo import assert_one_step


def straight(start, end, name="Line"):
    """A curve of two points with handles along it."""
    data = bpy.data.curves.new(name, "CURVE")
    data.dimensions = "3D"
    spline = data.splines.new("BEZIER")
    spline.bezier_points.add(1)
    for point, place in zip(spline.bezier_points, (start, end)):
        point.co = place
        point.handle_left_type = point.handle_right_type = "VECTOR"
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    bpy.context.view_layer.update()
    return thing


def rider(start, end, **wishes):
    """A walker on a straight line."""
    body, drawn = walker(), straight(start, end)
    choose(body, drawn)
    for name, value in wishes.items():
        setattr(body.beyond_mocap_ride, name, value)
    assert bpy.ops.beyond_mocap.edit_path() == {"FINISHED"}
    return body


def two(distance=3.0):
    """Two who walk into each other, head on."""
    return rider((0, 0, 0), (distance, 0, 0)), rider((distance, 0, 0), (0, 0, 0))


def nearest(first, second):
    """Metres between two pelvises over the ground, at the least."""
    frames = range(bpy.context.scene.frame_start, 120)
    return min(np.linalg.norm((pelvis(first, frame) - pelvis(second, frame))[:2]) for frame in frames)


def asked(body):
    ride = body.beyond_mocap_ride
    return round(ride.delay, 4), json.loads(ride.detours)


@pytest.fixture
def said(extension, monkeypatch):
    """What the operator reports."""
    lines = []
    kind = importlib.import_module(f"{extension.__name__}.operators.path_editing").BEYOND_MOCAP_OT_path_apart
    monkeypatch.setattr(kind, "report_result", lambda self, kept, tell=kind.report_result: (lines.append(kept),
            tell(self, kept)))
    return lines


def test_head_on_they_pass_each_other_and_clear_takes_it_back(scene, said):  # noqa: F811
    bodies = two()
    assert nearest(*bodies) < 0.3
    assert bpy.ops.beyond_mocap.path_apart() == {"FINISHED"}
    assert said[0].before == 1 and said[0].unresolved == ()
    assert nearest(*bodies) > 0.59
    sides = [offset for body in bodies for _, _, offset in asked(body)[1]]
    assert sides and all(offset < 0 for offset in sides)
    assert bpy.ops.beyond_mocap.path_apart(clear=True) == {"FINISHED"}
    assert [asked(body) for body in bodies] == [(0.0, [])] * 2
    assert nearest(*bodies) < 0.3


def test_it_is_one_step_of_undo(scene):  # noqa: F811
    two()
    assert_one_step(bpy.ops.beyond_mocap.path_apart)
    assert_one_step(bpy.ops.beyond_mocap.path_apart, clear=True)


def test_pressed_again_it_asks_for_the_same_and_after_an_edit_for_nothing(scene):  # noqa: F811
    bodies = two()
    bpy.ops.beyond_mocap.path_apart()
    once = [asked(body) for body in bodies]
    bpy.ops.beyond_mocap.path_apart()
    assert [asked(body) for body in bodies] == once
    bodies[1].beyond_mocap_ride.curve.location.y += 3.0
    bpy.context.view_layer.update()
    bpy.ops.beyond_mocap.path_apart()
    assert [asked(body) for body in bodies] == [(0.0, [])] * 2


def test_a_delay_of_the_users_stays(scene):  # noqa: F811
    across = rider((0, 0, 0), (4, 0, 0)), rider((1.5, -1.5, 0), (1.5, 3, 0), delay=0.5)
    limits = {"detour": 0.0, "delay": 3.0}
    bpy.ops.beyond_mocap.path_apart(**limits)
    waits = [body.beyond_mocap_ride.delay for body in across]
    assert waits[1] >= 0.5 - 1e-6 and sum(waits) > 0.6
    bpy.ops.beyond_mocap.path_apart(**limits)
    assert [body.beyond_mocap_ride.delay for body in across] == pytest.approx(waits)
    assert nearest(*across) > 0.59
    bpy.ops.beyond_mocap.path_apart(clear=True)
    assert [body.beyond_mocap_ride.delay for body in across] == pytest.approx([0.0, 0.5], abs=1e-6)


def test_of_three_the_two_selected_give_way(scene):  # noqa: F811
    bodies = two()
    third = rider((0, 0.1, 0), (3, 0.1, 0))
    choose(*bodies)
    bpy.ops.beyond_mocap.path_apart()
    assert asked(third) == (0.0, [])
    assert any(asked(body) != (0.0, []) for body in bodies)


def test_what_cannot_be_resolved_is_told_with_names_and_time(scene, said):  # noqa: F811
    bodies = two()
    bpy.ops.beyond_mocap.path_apart(detour=0.1, delay=0.2)
    [line] = said[0].unresolved
    assert all(body.name in line for body in bodies) and "frames" in line and " s " in line


def test_without_a_rider_it_says_what_is_missing(scene):  # noqa: F811
    walker()
    with pytest.raises(RuntimeError, match="Edit Path"):
        bpy.ops.beyond_mocap.path_apart()


def test_a_curve_that_is_gone_is_one_line_and_nothing_changes(scene):  # noqa: F811
    bodies = two()
    before = [asked(body) for body in bodies]
    bpy.data.objects.remove(bodies[0].beyond_mocap_ride.curve)
    with pytest.raises(RuntimeError, match="curve"):
        bpy.ops.beyond_mocap.path_apart()
    assert [asked(body) for body in bodies] == before


def test_at_a_broken_rate_and_in_centimetres(scene, said):  # noqa: F811
    scene.render.fps, scene.render.fps_base = 24, 1.001
    scene.unit_settings.scale_length = 0.01
    bodies = rider((0, 0, 0), (300, 0, 0)), rider((300, 0, 0), (0, 0, 0))
    assert nearest(*bodies) < 30.0
    bpy.ops.beyond_mocap.path_apart()
    assert said[0].before == 1 and said[0].unresolved == ()
    assert nearest(*bodies) > 59.0


def test_round_a_closed_curve_again_and_again(scene, said):  # noqa: F811
    bodies = []
    for side in (1.0, -1.0):
        drawn = circle(2.0)
        drawn.scale.y = side
        body = walker()
        choose(body, drawn)
        body.beyond_mocap_ride.cycle = True
        bpy.ops.beyond_mocap.edit_path()
        bodies.append(body)
    bpy.ops.beyond_mocap.path_apart()
    assert said[0].before >= 1 and said[0].unresolved == ()
    assert nearest(*bodies) > 0.59


def test_a_path_that_begins_again_meets_nobody_on_its_way_back(scene, said):  # noqa: F811
    again, beside = rider((0, 0, 0), (2, 0, 0)), rider((1, 3, 0), (1, 8, 0))
    again.beyond_mocap_ride.end = "repeat"
    bpy.ops.beyond_mocap.path_apart()
    assert said[0].before == 0 and [asked(body) for body in (again, beside)] == [(0.0, [])] * 2


def crossing(gone):
    """Two whose ways cross; gone: what is done to the first, that rides no more then."""
    first, second = rider((-3.5, 0, 0), (4, 0, 0)), rider((0, -3.5, 0), (0, 4, 0))
    choose(first)
    gone(first)
    choose(second)
    return first, second


def keep(_body):
    assert bpy.ops.beyond_mocap.bake_path() == {"FINISHED"}


def as_strip(body):
    """Kept, and then played by a strip: no plain armature."""
    keep(body)
    action = body.animation_data.action
    slot = body.animation_data.action_slot
    body.animation_data.action = None
    strip = body.animation_data.nla_tracks.new().strips.new("kept", int(action.frame_range[0]), action)
    strip.action_slot = slot


@pytest.mark.parametrize("gone", [keep, as_strip])
def test_who_was_kept_is_not_run_into(scene, said, gone):  # noqa: F811
    bodies = crossing(gone)
    assert nearest(*bodies) < 0.5
    scene.frame_set(7)
    bpy.ops.beyond_mocap.path_apart()
    assert scene.frame_current == 7 and len(bpy.data.scenes) == 1
    assert said[0].before == 1 and said[0].unresolved == ()
    assert not bodies[0].beyond_mocap_ride.on and asked(bodies[1]) != (0.0, [])
    assert nearest(*bodies) > 0.59


def test_who_is_hidden_or_shows_a_rider_is_not_counted(scene, said):  # noqa: F811
    hidden, body = crossing(keep)
    hidden.hide_set(True)
    excluded = walker()
    aside = bpy.data.collections.new("Aside")
    scene.collection.children.link(aside)
    for place in list(excluded.users_collection):
        place.objects.unlink(excluded)
    aside.objects.link(excluded)
    bpy.context.view_layer.layer_collection.children["Aside"].exclude = True
    shadow = walker()
    for bone in shadow.pose.bones:
        same = bone.constraints.new("COPY_TRANSFORMS")
        same.target, same.subtarget = body, bone.name
    choose(body)
    bpy.ops.beyond_mocap.path_apart()
    assert said[0].before == 0 and said[0].unresolved == ()


def test_who_cannot_be_looked_at_in_time_is_told(scene, said, part, monkeypatch):  # noqa: F811
    first, _ = crossing(as_strip)
    module = part("path_editing.collision_avoidance")
    monkeypatch.setattr(module.compute_bystanders, "__defaults__", (0.0,))
    bpy.ops.beyond_mocap.path_apart()
    [line] = said[0].unresolved
    assert line.startswith(f"{first.name} is left out") and "too long" in line


def test_a_statue_is_gone_round(scene, said):  # noqa: F811
    statue = walker()
    for curve in statue.animation_data.action.layers[0].strips[0].channelbags[0].fcurves:
        while len(curve.keyframe_points) > 1:
            curve.keyframe_points.remove(curve.keyframe_points[-1], fast=True)
        curve.update()
    statue.location = (0, 0, 0)
    bpy.context.view_layer.update()
    here = pelvis(statue, 1)
    body = rider((here[0] - 2, here[1], 0), (here[0] + 2, here[1], 0))
    assert nearest(statue, body) < 0.3
    choose(body)
    bpy.ops.beyond_mocap.path_apart()
    assert said[0].before == 1 and nearest(statue, body) > 0.55


def test_a_rider_that_is_changed_afterwards_says_so_until_it_is_pressed_again(scene, part):  # noqa: F811
    first, second = two()
    bpy.ops.beyond_mocap.path_apart()
    follow = part("path_editing.live").update_all
    told = [first.beyond_mocap_ride, second.beyond_mocap_ride]
    follow(scene)
    assert not any("Avoid Collisions" in ride.messages for ride in told)
    first.beyond_mocap_ride.curve.location.y += 0.2
    bpy.context.view_layer.update()
    follow(scene)
    assert ["changed since Avoid Collisions" in ride.messages for ride in told] == [True, False]
    bpy.ops.beyond_mocap.path_apart()
    assert not any("Avoid Collisions" in ride.messages for ride in told)
    first.beyond_mocap_ride.curve.location.y += 0.2
    bpy.context.view_layer.update()
    follow(scene)
    bpy.ops.beyond_mocap.path_apart(clear=True)
    follow(scene)
    assert not any("Avoid Collisions" in ride.messages for ride in told)
