"""A passing scene made in Blender: bodies and ball do what the core's recipe says, and all of it can be taken away."""

import importlib
import pathlib

import bpy
import numpy as np
import pytest
from conftest import EXTENSION
from undo import assert_one_step, collect_state, press_operator

LIBRARY = pathlib.Path(__file__).resolve().parents[3] / "sample_blend" / "passes" / "library"
FPS = 24 / 1.001


@pytest.fixture
def room():
    return lambda name: importlib.import_module(f"{EXTENSION}.scene.{name}")


@pytest.fixture(scope="module")
def clips(tmp_path_factory):
    """A library of few clips, so that it is built in a moment."""
    import shutil

    folder = tmp_path_factory.mktemp("clips")
    for path in LIBRARY.iterdir():
        if path.stem.startswith(("volley_pass", "volley_toss", "volley_receive", "volley_racquet", "ready",
                                 "walking_1_2", "standing_turn", "walking_0")):  # fmt: skip
            shutil.copy(path, folder)
    return folder


@pytest.fixture
def two(clips):
    """Two players and two passes, at a film's rate and in centimetres, from frame 11 on."""
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base, scene.unit_settings.scale_length = 24, 1.001, 0.01
    settings = scene.beyond_mocap_passes
    press_operator(bpy.ops.beyond_mocap.passes_sample, sample="three")
    settings.library_folder, settings.repeat, settings.start_frame = str(clips), 1, 11
    settings.active_player = 2
    press_operator(bpy.ops.beyond_mocap.passes_list, rows="players", what="REMOVE")
    press_operator(bpy.ops.beyond_mocap.passes_list, rows="passes", what="ADD")
    return scene


def settings():
    return bpy.context.scene.beyond_mocap_passes


def seen(thing, frame):
    bpy.context.scene.frame_set(frame)
    return np.array(thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world)


def test_bodies_and_ball_do_what_the_recipe_says(two, room, core):
    assert press_operator(bpy.ops.beyond_mocap.passes_make) == {"FINISHED"}
    wanted = room("passes.scene_lists").build_scene(two)
    assert wanted.fps == pytest.approx(FPS)
    library = room("core.session").find_library(settings().library_folder, None)
    found = core("passes.passes").synthesize_passes(library, wanted)
    assert len(found.plan.strikes) == 3 == len(settings().strikes.splitlines())
    ball = settings().rally
    for one in found.plan.strikes:
        frame = 11 + one.order.time * FPS
        assert abs(frame - round(frame)) < 1e-3, "a strike between two frames"
        assert np.allclose(seen(ball, round(frame))[:3, 3] / 100.0, one.order.ball, atol=2e-3)
        body = next(row.body for row in settings().players if row.name == one.player)
        hips = body.pose.bones[0]
        shown = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
        take = next(player.take for player in found.players if player.name == one.player)
        row = round((one.order.time - take.start_time) * FPS)
        place = np.array(shown.matrix_world @ shown.pose.bones[hips.name].head) / 100.0
        assert np.allclose(place, take.motion.root_positions[row], atol=2e-3)
    assert two.frame_end >= int(11 + found.plan.seconds * FPS)
    assert ball.dimensions.x / 100.0 == pytest.approx(2 * found.kind.radius, rel=0.02)


def test_what_is_drawn_is_what_is_played(two, room):
    press_operator(bpy.ops.beyond_mocap.passes_make)
    rally, overlay = room("passes.generate"), room("overlays.ball_paths")
    shown = rally.find_trajectories(two)
    ball, lines = settings().rally, settings().strikes.splitlines()
    for line, place in zip(lines, shown.strikes, strict=True):
        assert np.allclose(seen(ball, int(line.partition("\t")[0]))[:3, 3] / 100.0, place, atol=2e-3)
    assert len(shown.flight_paths) == len(lines) + 1 and len(shown.bounces) >= 2 and np.allclose(shown.bounces[:, 2],
            0.0)
    frame = int(lines[0].partition("\t")[0]) + 3
    two.frame_set(frame)
    meshes = [mesh for item in overlay.list_items(two) for mesh in item.meshes()]
    assert len(meshes) == 5 and all(
        np.isfinite(mesh.points).all() and len(mesh.points) == len(mesh.colours) for mesh in meshes
    )
    start = next(way[0] for way in shown.flight_paths[1:])
    assert np.allclose(start, shown.strikes[0], atol=1e-3)
    press_operator(bpy.ops.beyond_mocap.passes_clear)
    assert not overlay.list_items(two)


def test_an_edit_is_seen_and_its_own_making_is_not(two, room):
    live = room("passes.live")
    assert not live.find_edit(two), "nothing is shown yet"
    press_operator(bpy.ops.beyond_mocap.passes_make)
    assert not live.find_edit(two)
    two.frame_set(40)
    assert not live.find_edit(two)
    bpy.data.objects["Ann place"].location.x += 30.0
    bpy.context.view_layer.update()
    assert live.find_edit(two)
    order = room("passes.generate").build_order(two)
    assert room("passes.generate").plan_flights(order, lambda: False).strikes.shape == (3, 3)
    settings().live = False
    assert not live.find_edit(two)
    settings().live = True
    settings().passes[0].to = settings().passes[0].who
    assert not live.find_edit(two) and "both passer and receiver" in settings().messages


def test_each_is_one_step_of_undo_and_clear_leaves_the_lists(two):
    before = collect_state()
    assert_one_step(bpy.ops.beyond_mocap.passes_make)
    assert_one_step(bpy.ops.beyond_mocap.passes_clear)
    after = collect_state()
    for kind in ("objects", "armatures", "actions", "meshes"):
        assert after[kind] == before[kind], kind
    assert len(settings().players) == 2 and not settings().strikes


def test_again_leaves_nothing_behind(two):
    press_operator(bpy.ops.beyond_mocap.passes_make)
    before = {
        kind: sorted(item.name for item in getattr(bpy.data, kind))
        for kind in ("objects", "armatures", "actions", "meshes")
    }
    settings().passes[0].bounces = 2
    press_operator(bpy.ops.beyond_mocap.passes_make)
    after = {kind: sorted(item.name for item in getattr(bpy.data, kind)) for kind in before}
    assert after == before


def test_a_body_of_the_user_s_plays_its_own_motion_again(two, room, core, clips):
    clip = core("files.bvh.bvh").read_bvh(clips / "ready_1.bvh", 0.01)
    press_operator(bpy.ops.beyond_mocap.passes_make)
    made = settings().players[0].body
    own = room("rigs.armature").create_armature(bpy.context, room("rigs.armature").build_skeleton(made, two), "Mine")
    action = room("core.action").write_motion(own, clip.motion.frames(0, 20), two)
    settings().players[0].body = own
    press_operator(bpy.ops.beyond_mocap.passes_make)
    assert settings().players[0].body == own and own.animation_data.action != action
    press_operator(bpy.ops.beyond_mocap.passes_clear)
    assert own.animation_data.action == action and "Mine" in bpy.data.objects


def own_body(two, room, core, clips):
    """A body of the user's that shows the first player's motion, and the action it had."""
    clip = core("files.bvh.bvh").read_bvh(clips / "ready_1.bvh", 0.01)
    press_operator(bpy.ops.beyond_mocap.passes_make)
    armatures = room("rigs.armature")
    own = armatures.create_armature(bpy.context, armatures.build_skeleton(settings().players[0].body, two), "Mine")
    action = room("core.action").write_motion(own, clip.motion.frames(0, 20), two)
    settings().players[0].body = own
    press_operator(bpy.ops.beyond_mocap.passes_make)
    return own, action


def another_body(_own):
    settings().players[0].body = None
    press_operator(bpy.ops.beyond_mocap.passes_make)


def taken_out(_own):
    settings().active_player = 0
    press_operator(bpy.ops.beyond_mocap.passes_list, rows="players", what="REMOVE")


def replaced(own):
    settings().players[0].name = "Somebody"
    press_operator(bpy.ops.beyond_mocap.passes_sample, sample="three")


@pytest.mark.parametrize("change", [another_body, taken_out, replaced])
def test_who_is_out_of_the_scene_plays_his_own_motion_again(two, room, core, clips, change):
    own, action = own_body(two, room, core, clips)
    assert own.animation_data.action != action
    change(own)
    assert own.animation_data.action == action


def test_a_sample_of_the_same_names_keeps_what_bodies_did_before(two, room, core, clips):
    own, action = own_body(two, room, core, clips)
    press_operator(bpy.ops.beyond_mocap.passes_sample, sample="three")
    assert settings().players[0].body == own and [row.name for row in settings().players] == ["Ann", "Ben", "Cho"]
    press_operator(bpy.ops.beyond_mocap.passes_clear)
    assert own.animation_data.action == action


def test_an_aimed_ball_is_left_alone(two):
    press_operator(bpy.ops.beyond_mocap.passes_make)
    settings().rally.beyond_mocap_aim.on = True
    before = collect_state()
    for verb in (bpy.ops.beyond_mocap.passes_make, bpy.ops.beyond_mocap.passes_clear):
        with pytest.raises(RuntimeError, match="it is aimed"):
            press_operator(verb)
    assert collect_state() == before


def test_who_carries_the_ball_carries_it_on_its_new_way(two):
    press_operator(bpy.ops.beyond_mocap.passes_make)
    last = int(settings().strikes.splitlines()[-1].partition("\t")[0])
    for thing in bpy.context.view_layer.objects:
        thing.select_set(thing in (settings().rally, settings().players[1].body))
    bpy.context.view_layer.objects.active = settings().players[1].body
    press_operator(bpy.ops.beyond_mocap.take_ball, first=last + 4, last=last + 12)
    settings().passes[0].bounces = 2
    press_operator(bpy.ops.beyond_mocap.passes_make)
    ball = settings().rally
    assert len(ball.constraints) == 1 and ball.animation_data.action.name.endswith("carried")
    press_operator(bpy.ops.beyond_mocap.free_ball)
    assert not len(ball.constraints) and "carried" not in ball.animation_data.action.name


def test_a_racquet_is_where_it_meets_the_ball(two, room):
    for player in settings().players:
        player.part, player.side = "tool", "right"
    settings().players[0].height = 1.5
    press_operator(bpy.ops.beyond_mocap.passes_make)
    ball, line = settings().rally, settings().strikes.splitlines()[1]
    assert "right tool" in line
    name, frame = line.partition("\t")[2].partition(":")[0], int(line.partition("\t")[0])
    centre = seen(ball, frame)[:3, 3] / 100.0
    tool = bpy.data.objects[f"{name} tool"]
    shown = tool.evaluated_get(bpy.context.evaluated_depsgraph_get())
    points = np.array([shown.matrix_world @ vertex.co for vertex in tool.data.vertices]) / 100.0
    axis = [points[np.linalg.norm(points - end, axis=1) < 0.05].mean(axis=0) for end in (points[-1], points[24])]
    along = axis[0] - axis[1]
    share = np.clip(np.dot(centre - axis[1], along) / np.dot(along, along), 0.0, 1.0)
    gap = np.linalg.norm(centre - axis[1] - share * along) - 0.015 - ball.dimensions.x / 200.0
    assert abs(gap) < 0.01, gap
    for player in settings().players:
        player.part = "foot"
    press_operator(bpy.ops.beyond_mocap.passes_make)
    assert not [thing for thing in bpy.data.objects if thing.name.endswith("tool")]


def test_a_net_comes_and_goes(two):
    settings().net, settings().net_height = True, 1.2
    settings().net_from, settings().net_to = (-9.0, 3.0), (-9.0, 4.0)
    press_operator(bpy.ops.beyond_mocap.passes_make)
    net = bpy.data.objects["Net"]
    net.name = "Mesh of Ropes"
    settings().net_height = 1.0
    press_operator(bpy.ops.beyond_mocap.passes_make)
    assert "Net" not in bpy.data.objects, "a renamed net is found again"
    settings().net_height, net.name = 1.2, "Net"
    press_operator(bpy.ops.beyond_mocap.passes_make)
    assert max(corner[2] for corner in net.bound_box) == pytest.approx(120.0, rel=1e-3)
    settings().net = False
    press_operator(bpy.ops.beyond_mocap.passes_make)
    assert "Net" not in bpy.data.objects


@pytest.mark.parametrize("wrong, said", [
    (lambda: setattr(settings(), "library_folder", ""), "no folder chosen"),
    (lambda: setattr(settings().passes[0], "to", settings().passes[0].who), "both passer and receiver"),
    (lambda: setattr(bpy.data.objects["Ben place"], "location", (0.0, 325.0, 0.0)), "Ann .*m apart"),
    (lambda: setattr(settings().players[0], "bone", "Tail"), "Tail"),
    (lambda: setattr(settings().players[1].place, "location", (0.0, -9000.0, 0.0)), "human|away"),
])
def test_what_cannot_be_is_told_and_changes_nothing(two, wrong, said):
    wrong()
    bpy.context.view_layer.update()
    before = collect_state()
    with pytest.raises(RuntimeError, match=said):
        press_operator(bpy.ops.beyond_mocap.passes_make)
    assert collect_state() == before
