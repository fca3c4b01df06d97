"""Heading keys: added to directions and objects in one step, read into the plan as the core knows them, and told what
is wrong."""

import dataclasses
import importlib
import pathlib

import bpy
import numpy as np
import pytest
from undo import assert_one_step

SAMPLE = pathlib.Path(__file__).resolve().parents[3] / "sample_blend"


@pytest.fixture
def plans(extension):
    return importlib.import_module(f"{extension.__name__}.scene.result.plans")


@pytest.fixture
def key(core):
    return core("synthesis.heading_request").HeadingKey


@pytest.fixture
def drawn():
    """A drawn player, no object selected, at second 2 of 25 frames each; the scene's settings."""
    bpy.ops.beyond_mocap.draw_track()
    scene = bpy.context.scene
    scene.render.fps = 25
    scene.frame_set(51)
    select()
    return scene.beyond_mocap


def select(*chosen):
    """Select these objects alone, the first one active."""
    for other in bpy.context.view_layer.objects:
        other.select_set(other in chosen)
    bpy.context.view_layer.objects.active = chosen[0] if chosen else None
    bpy.context.view_layer.update()


def add_empty(name="Flag", place=(0.0, 0.0, 0.0), turn=0.0):
    found = bpy.data.objects.new(name, None)
    found.location, found.rotation_euler = place, (0.0, 0.0, turn)
    bpy.context.scene.collection.objects.link(found)
    select(found)
    return found


def add_key(**arguments):
    return bpy.ops.beyond_mocap.add_heading_key(**arguments)


def read_keys(plans, settings, **more):
    return plans.build_plan(settings, settings.players[0], **more)[0].heading_keys


def test_the_dots_rotation_becomes_a_key_in_one_step(plans, drawn, key):
    drawn.players[0].dot.rotation_euler.z = np.pi / 2
    bpy.context.view_layer.update()
    assert_one_step(bpy.ops.beyond_mocap.add_heading_key, hold=0.5)
    settings = bpy.context.scene.beyond_mocap  # undo has replaced what was there before
    assert read_keys(plans, settings) == (key(2.0, heading=round(np.pi / 2, 6), hold=0.5),)
    assert_one_step(bpy.ops.beyond_mocap.remove_heading_key)
    settings = bpy.context.scene.beyond_mocap
    assert not settings.players[0].heading_keys and read_keys(plans, settings) == ()


def test_a_selected_empty_or_a_number_is_the_direction(plans, drawn, key):
    add_empty(turn=-2.0)
    add_key()
    bpy.context.scene.frame_set(101)
    add_key(heading=1.25, hold=0.0)
    assert [(k.time, k.heading, k.hold) for k in read_keys(plans, drawn)] == [
        (2.0, pytest.approx(-2.0, abs=1e-5), 1.0), (4.0, 1.25, 0.0)]
    assert [k.faces for k in drawn.players[0].heading_keys] == ["DIRECTION"] * 2


def test_an_object_at_rest_is_one_target_in_metres(plans, drawn, key):
    settings = bpy.context.scene.unit_settings
    settings.system, settings.scale_length = "METRIC", 0.5
    add_empty(place=(6.0, -8.0, 1.0))
    assert_one_step(bpy.ops.beyond_mocap.add_heading_key, faces="OBJECT", hold=3.0)
    drawn = bpy.context.scene.beyond_mocap
    assert read_keys(plans, drawn) == (key(2.0, target=(3.0, -4.0), hold=3.0),)
    assert bpy.ops.beyond_mocap.remove_heading_key() == {"FINISHED"}
    assert "Flag" in bpy.context.scene.objects  # it is the user's


def test_a_moving_object_is_faced_where_it_is_at_each_moment(plans, drawn):
    flag = add_empty()
    for frame, x in ((1, 0.0), (101, 100.0)):
        flag.location = (x, 7.0, 0.0)
        flag.keyframe_insert("location", frame=frame)
    for curve in importlib.import_module(plans.__name__.replace("result.plans", "core.channels")).collect_curves(
            flag.animation_data.action, flag.animation_data.action_slot).values():
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
    add_key(faces="OBJECT", hold=1.0)
    found = read_keys(plans, drawn, still=True)
    times = np.array([one.time for one in found])
    assert times[0] == 2.0 and times[-1] == 3.0 and np.diff(times).max() < 1.0 / 6.0 and np.diff(times).min() > 0.0
    wanted = np.stack([25.0 * times, np.full(len(times), 7.0)], axis=1)
    np.testing.assert_allclose([one.target for one in found], wanted, atol=1e-4)
    bpy.context.scene.frame_set(7)
    assert read_keys(plans, drawn) == found  # whatever frame is shown


def test_an_object_that_others_move_is_played_before_it_is_faced(plans, drawn, core):
    mover, flag = add_empty("Mover"), add_empty(place=(0.0, 5.0, 0.0))
    for frame, x in ((1, 0.0), (101, 10.0)):
        mover.location.x = x
        mover.keyframe_insert("location", frame=frame)
    flag.parent = mover
    select(flag)
    add_key(faces="OBJECT", hold=0.0)
    with pytest.raises(core("base.errors").InputError, match="Flag: not played"):
        read_keys(plans, drawn, still=True)
    found, = read_keys(plans, drawn)
    assert found.target == pytest.approx((mover.matrix_world.translation.x, 5.0), abs=0.05)
    assert bpy.context.scene.frame_current == 51 and read_keys(plans, drawn, still=True) == (found,)


def test_another_player_is_where_their_track_is(plans, drawn):
    """Their dot has strips of labels, which would have to be played."""
    player = drawn.players[0].name
    bpy.ops.beyond_mocap.import_tracking(filepath=str(SAMPLE / "match" / "player1.csv"))
    other = drawn.players[1]
    assert other.dot.animation_data.nla_tracks
    track = plans.read_track(drawn, other)
    drawn.active_player = 0
    select(other.dot)
    assert add_key(faces="OBJECT", hold=1.0) == {"FINISHED"} and drawn.players[0].name == player
    found = read_keys(plans, drawn, still=True)
    wanted = [[np.interp(k.time, track.times, track.positions[:, axis]) for axis in (0, 1)] for k in found]
    assert len(found) > 6
    np.testing.assert_allclose([k.target for k in found], wanted, atol=1e-5)


def test_live_hears_of_added_and_removed_keys(extension, drawn):
    live = importlib.import_module(f"{extension.__name__}.scene.result.freshness").LIVE
    heard = []

    def hear(_scene, graph):
        heard.extend(update.id for update in graph.updates if isinstance(update.id, live.watched_types))

    bpy.context.view_layer.update()
    bpy.app.handlers.depsgraph_update_post.append(hear)
    try:
        for operator in (bpy.ops.beyond_mocap.add_heading_key, bpy.ops.beyond_mocap.remove_heading_key):
            heard.clear()
            assert operator() == {"FINISHED"}
            bpy.context.view_layer.update()
            assert heard
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(hear)


def test_what_cannot_be_faced_is_told(plans, drawn, core):
    trouble, player = core("base.errors").InputError, drawn.players[0]
    with pytest.raises(RuntimeError, match="no object selected; expected the object to face"):
        add_key(faces="OBJECT")
    select(player.dot)
    with pytest.raises(RuntimeError, match="their own"):
        add_key(faces="OBJECT")
    flag = add_empty()
    add_key(faces="OBJECT")
    bpy.context.scene.frame_set(60)
    with pytest.raises(RuntimeError, match="a heading key at 2.00 s; expected one heading at a time"):
        add_key()
    assert len(player.heading_keys) == 1
    player.heading_keys[0].target = player.dot
    with pytest.raises(trouble, match="heading key at 2.00 s: Drawn dot, the player's own"):
        read_keys(plans, drawn)
    player.heading_keys[0].target = flag
    bpy.context.scene.collection.objects.unlink(flag)  # as when deleted in the view: the key still refers to it
    with pytest.raises(trouble, match="heading key at 2.00 s: its object is missing"):
        read_keys(plans, drawn)
    bpy.data.objects.remove(flag)
    drawn.library_folder = str(SAMPLE / "library")
    with pytest.raises(RuntimeError, match="its object is missing; expected an object of the scene; choose one"):
        bpy.ops.beyond_mocap.synthesize()
    player.dot = None
    bpy.ops.beyond_mocap.remove_heading_key()
    select()
    with pytest.raises(RuntimeError, match="no dot and no Empty selected"):
        add_key()


def test_without_a_player_or_a_key_the_buttons_say_so():
    with pytest.raises(RuntimeError, match="Import tracking or draw a track"):
        add_key()
    with pytest.raises(RuntimeError, match="has no heading keys"):
        bpy.ops.beyond_mocap.remove_heading_key()


def test_keys_are_saved_with_the_file(plans, drawn, tmp_path):
    add_empty(place=(3.0, 1.0, 0.0))
    add_key(faces="OBJECT", hold=0.5)
    bpy.context.scene.frame_set(101)
    add_key(heading=0.5)
    before = read_keys(plans, drawn)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "kept.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "kept.blend"))
    assert len(before) == 2 and read_keys(plans, bpy.context.scene.beyond_mocap) == before


def test_labels_at_faced_objects_say_when(extension, drawn):
    labels = importlib.import_module(f"{extension.__name__}.scene.player.drawn_track").build_speed_labels
    flag = add_empty(place=(3.0, 1.0, 0.0))
    add_key(faces="OBJECT", hold=0.5)
    assert [text for place, text, _ in labels(bpy.context.scene) if place == (3.0, 1.0, 0.0)] == ["faced 2.0 + 0.5 s"]
    bpy.data.objects.remove(flag)
    assert not [text for _, text, _ in labels(bpy.context.scene) if "faced" in text]


def test_the_take_faces_the_key_and_is_the_cores(extension, plans, drawn, core, key, library_folder):
    session = importlib.import_module(f"{extension.__name__}.scene.core.session")
    freshness = importlib.import_module(f"{extension.__name__}.scene.result.freshness")
    scene, player = bpy.context.scene, drawn.players[0]
    drawn.library_folder = str(library_folder)
    last = plans.read_track(drawn, player).times[-1]
    player.drawn_track.data.splines[0].bezier_points[-1].weight_softbody = 6.0  # waits at the end
    assert bpy.ops.beyond_mocap.synthesize() == {"FINISHED"} and not freshness.compute_edited_parts(scene, player)
    plain, asked = session.find_take(player.take).take, session.find_take(player.take).plan
    scene.frame_set(round(1 + 25 * (last + 2.0)))
    add_key(heading=2.5, hold=2.0)
    assert freshness.compute_edited_parts(scene, player)
    given = read_keys(plans, drawn)[0]
    assert bpy.ops.beyond_mocap.update() == {"FINISHED"}
    updated = session.find_take(player.take)
    assert bpy.ops.beyond_mocap.synthesize() == {"FINISHED"}
    made, library = session.find_take(player.take), session.find_library(str(library_folder), None)
    assert asked.heading_keys == ()
    plan = dataclasses.replace(asked, heading_keys=(key(given.time, heading=2.5, hold=2.0),))
    take = core("synthesis.synthesize").synthesize(library, plan)
    np.testing.assert_array_equal(take.motion.rotations, made.take.motion.rotations)
    at = round((given.time + 1.5 - plain.start_time) * plain.motion.fps)
    off = [abs(core("motion.quaternion").wrap_angle(measure_body_heading(core, one.motion)[at] - 2.5))
           for one in (plain, updated.take, made.take)]
    assert off[0] > 2.0 and max(off[1:]) < 0.5 * off[0]  # few recordings turn so far


def measure_body_heading(core, motion):
    """Heading (T,) rad of the line through the hips' joints, turned a quarter."""
    positions, _ = core("motion.motion").compute_pose(motion.skeleton, motion.root_positions, motion.rotations)
    body = core("motion.humanoid").identify_joints(motion.skeleton)
    across = positions[:, body.right.upper_leg, :2] - positions[:, body.left.upper_leg, :2]
    return np.arctan2(across[:, 0], -across[:, 1])
