"""What is drawn and told of a take: prepared once, where the body is; curves and jumps are one step and come and go."""

import importlib
import pathlib

import bpy
import numpy as np
import pytest
from mathutils import Vector
from undo import assert_one_step, collect_state

SAMPLE = pathlib.Path(__file__).resolve().parents[3] / "sample_blend"
WORDS = "5.0 kick right low inside\n"


@pytest.fixture
def room(extension):
    """room("core.session") -> that module of the scene room; what was made is forgotten afterwards."""
    names = extension.__name__
    yield lambda name: importlib.import_module(f"{names}.scene.{name}")
    importlib.import_module(f"{names}.scene.overlays.store").clear_store()
    importlib.import_module(f"{names}.scene.core.session").clear_session()


@pytest.fixture
def shown(tmp_path, library_folder, room):
    """A player with a ball whose take is shown; the settings."""
    time = np.arange(0.0, 10.01, 0.1)
    lines = ["time_s,x_m,y_m,ball_x_m,ball_y_m,ball_z_m"]
    lines += [
        f"{t:.1f},{2.9 * t:.3f},{np.sin(0.3 * t):.3f},{2.9 * t + 0.5:.3f},{np.sin(0.3 * t):.3f},0.11" for t in time
    ]
    (tmp_path / "runner.csv").write_text("\n".join(lines) + "\n")
    (tmp_path / "runner.txt").write_text(WORDS)
    bpy.context.scene.beyond_mocap.library_folder = str(library_folder)
    bpy.ops.beyond_mocap.import_tracking(filepath=str(tmp_path / "runner.csv"))
    assert bpy.ops.beyond_mocap.synthesize() == {"FINISHED"}
    return bpy.context.scene.beyond_mocap


def prepare_now(store):
    """All that is missing, at once instead of by timer and thread."""
    store._prepared.update(store._prepare_takes(store._list_missing(bpy.context.scene), None, lambda: False, None))


@pytest.fixture
def prepared(shown, room):
    prepare_now(room("overlays.store"))
    return room("overlays.store").find_prepared(shown.players[0].take)


def test_every_overlay_has_what_it_draws(prepared, shown, room):
    take = room("core.session").find_take(shown.players[0].take).take
    assert set(prepared.meshes) == {"track", "footprints", "seams", "moments", "speed", "heading"}
    for meshes in prepared.meshes.values():
        for mesh in meshes:
            assert mesh.points.dtype == mesh.colours.dtype == np.float32
            assert len(mesh.points) == len(mesh.colours) and len(mesh.points) % {"TRIS": 3, "LINES": 2}[mesh.kind] == 0
            assert np.isfinite(mesh.points).all() and mesh.colours.min() >= 0.0 and mesh.colours.max() <= 1.0
    assert len(prepared.meshes["seams"][0].points) == 2 * len(take.seams)
    assert prepared.pieces[0].start == pytest.approx(take.start_time) and len(prepared.pieces) == len(take.seams) + 1
    assert [label.text for label in prepared.labels][0].startswith("5.00 s  kick right low inside")


def test_soles_stand_where_feet_stand(prepared):
    soles = prepared.meshes["footprints"][0].points.reshape(-1, 17 * 3, 3)[:, :, :2].mean(axis=1)
    standing = prepared.toes[prepared.contacts][:, :2]
    assert np.linalg.norm(soles[:, None] - standing, axis=-1).min(axis=1).max() < 0.2


def read_arrows(mesh):
    """Places (N, 2) and headings (N,) of arrows."""
    corners = mesh.points.reshape(-1, 6, 3)
    along = (corners[:, 1] - corners[:, 0])[:, :2]
    return corners[:, 0, :2], np.arctan2(along[:, 1], along[:, 0])


@pytest.mark.parametrize("size", [1.0, 1.25])
def test_arrows_lie_on_the_track_and_point_along_the_planned_heading(room, core, size):
    """A player who runs along Y; then turned by two keys while standing at the end.

    In the library's size they are smaller.
    """
    times = np.arange(0.0, 8.01, 0.1)
    y = 4.0 * np.minimum(times, 4.0)
    track = core("motion.track").Track(times, np.stack([np.full(len(times), 2.0), y], axis=1) / size)
    key = core("synthesis.heading_request").HeadingKey
    keys = key(5.6, heading=np.pi, hold=0.7), key(7.5, target=(2.0, 99.0), hold=99.0)
    plan_module = core("synthesis.plan")
    asked = plan_module.Plan(track=track, heading_keys=keys, fps=30.0)
    resolved = plan_module.ResolvedPlan(requested=asked, timeline=asked.timeline, track=track, trajectory=None,
                                        size=size)
    edge, arrows = room("overlays.prepare").build_heading_arrows(resolved)
    places, headings = read_arrows(arrows)
    assert len(places) == 17 + 2 and len(edge.points) == len(arrows.points) == 6 * len(places)
    seconds = np.sort(np.concatenate([np.arange(0.0, 8.01, 0.5), [5.6, 6.3]]))
    np.testing.assert_allclose(places[:, 0], 2.0, atol=0.05)
    np.testing.assert_allclose(places[:, 1], np.interp(seconds, times, y), atol=0.25)  # smoothed at the stop
    running = seconds < 3.5
    np.testing.assert_allclose(headings[running], np.pi / 2, atol=0.1)
    held = (seconds >= 5.59) & (seconds <= 6.31)
    np.testing.assert_allclose(np.cos(headings[held] - np.pi), 1.0, atol=0.03)
    colours = room("overlays.colours")
    is_key = (arrows.colours.reshape(-1, 6, 4)[:, 0, :3] == np.float32(colours.HEADING_KEY)).all(axis=1)
    assert is_key.tolist() == (held | (seconds >= 7.49)).tolist()
    np.testing.assert_allclose(np.linalg.norm(np.diff(arrows.points.reshape(-1, 6, 3)[:, :2], axis=1)[:, 0], axis=1),
                               0.45, atol=1e-5)


def test_the_arrows_of_a_take_are_its_plans(prepared, shown, room, core):
    """What is drawn is what the construction was given."""
    taken = room("core.session").find_take(shown.players[0].take)
    library = room("core.session").find_library(taken.plan.library, None)
    resolved = core("synthesis.resolve_plan").resolve_plan(taken.plan, library, trajectory=taken.take.solved)
    planned = resolved.sample_track(taken.take.motion.fps)
    step = round(0.5 * taken.take.motion.fps)
    places, headings = read_arrows(prepared.meshes["heading"][1])
    np.testing.assert_allclose(places, planned.positions[::step], atol=1e-5)
    np.testing.assert_allclose(np.cos(headings - planned.heading[::step]), 1.0, atol=1e-6)


def test_left_and_right_soles_are_mirrored(room):
    shapes = room("overlays.shapes")
    heel, toe = np.zeros((2, 2)), np.tile([0.15, 0.0], (2, 1))
    fill, edge = shapes.build_soles(heel, toe, np.zeros(2), np.array([0, 1]), 0.02)
    left, right = edge.reshape(2, -1, 3)
    assert np.allclose(left * [1, -1, 1], right) and np.allclose(edge[:, 2], 0.02)
    assert 0.2 < np.ptp(left[:, 0]) < 0.33 and left[:, 1].max() > -left[:, 1].min()


def test_rails_run_beside_the_track(room):
    path = np.stack([np.linspace(0, 5, 40), np.zeros(40)], axis=1)
    points, owner = room("overlays.shapes").build_rails(path, 0.1, 0.2, 0.0)
    assert len(points) == len(owner) and np.allclose(points[:, 0], path[owner][:, 0])
    assert np.allclose(np.unique(np.round(np.abs(points[:, 1]), 4)), [0.1, 0.2])
    still = np.zeros((5, 2))
    assert np.isfinite(room("overlays.shapes").build_rails(still, 0.1, 0.2, 0.0)[0]).all()


def test_colours_grow_from_good_to_bad(room):
    colours = room("overlays.colours")
    found = colours.map_to_colours(np.array([0.0, 0.015, 9.0, np.nan]), colours.ROOT_STOPS)
    assert np.allclose(found[:3, :3], [colours.BLUE, colours.YELLOW, colours.VERMILION], atol=1e-6)
    assert np.allclose(found[3, :3], colours.GREY)


def test_why_is_told_for_the_piece_at_the_playhead(prepared, shown, room):
    store, scene = room("overlays.store"), bpy.context.scene
    for piece in prepared.pieces[:3]:
        scene.frame_set(int(np.ceil(1 + piece.start * scene.render.fps)) + 1)
        store.update_reasons(scene)
        assert bpy.context.window_manager.beyond_mocap_playhead.why.splitlines()[0] == piece.name
    assert any(line.startswith("cost ") for line in prepared.pieces[0].lines)
    scene.frame_set(-500)
    store.update_reasons(scene)
    assert bpy.context.window_manager.beyond_mocap_playhead.why == ""


@pytest.mark.parametrize("method", ["distance", "blocks"])
def test_takes_of_the_other_methods_are_told_too(shown, room, method):
    shown.method = method
    assert bpy.ops.beyond_mocap.synthesize() == {"FINISHED"}
    prepare_now(room("overlays.store"))
    found = room("overlays.store").find_prepared(bpy.context.scene.beyond_mocap.players[0].take)
    assert found.pieces and all(len(piece.lines) >= 3 for piece in found.pieces)
    assert "track" in found.meshes and "footprints" in found.meshes and "heading" not in found.meshes


def test_what_no_player_shows_is_forgotten(prepared, shown, room):
    store = room("overlays.store")
    take = shown.players[0].take
    store.update_store(bpy.context.scene)
    assert store.find_prepared(take) is prepared
    bpy.ops.beyond_mocap.discard()
    store.update_store(bpy.context.scene)
    assert store.find_prepared(take) is None


@pytest.mark.parametrize("scale", [1.0, 0.01])
def test_what_is_drawn_follows_the_body(shown, room, scale):
    scene, body = bpy.context.scene, shown.players[0].body
    scene.unit_settings.scale_length = scale
    bpy.ops.beyond_mocap.discard()
    bpy.ops.beyond_mocap.synthesize()
    body = scene.beyond_mocap.players[0].body
    take = room("core.session").find_take(scene.beyond_mocap.players[0].take).take
    body.location, body.rotation_euler, body.scale = (3.0 / scale, -2.0, 0.0), (0.0, 0.0, 1.1), (1.5, 1.5, 1.5)
    scene.frame_set(31)
    world = room("overlays.store").take_to_world(scene, body)
    at = room("overlays.store").seconds_at(scene) - take.start_time
    bone = body.evaluated_get(bpy.context.evaluated_depsgraph_get()).pose.bones[take.motion.skeleton.names[0]]
    root = [
        np.interp(at * take.motion.fps, np.arange(len(take.motion)), take.motion.root_positions[:, i]) for i in range(3)
    ]
    assert np.allclose(world @ Vector(root), body.matrix_world @ bone.head, atol=2e-3 / scale)


@pytest.mark.parametrize("form", ["ACTION", "STRIPS"])
def test_accepted_results_still_know_where_they_lay(shown, room, form):
    bpy.ops.beyond_mocap.accept(form=form)
    body = bpy.context.scene.beyond_mocap.players[0].body
    body.location.x += 2.0
    bpy.context.view_layer.update()
    assert room("overlays.store").take_to_world(bpy.context.scene, body).translation.x == pytest.approx(2.0, abs=1e-5)


def test_lines_of_the_report_keep_their_seconds(shown):
    player = shown.players[0]
    names = [line.split(":")[0] for line in player.quality.splitlines()]
    assert "Foot slide" in names and all(len(line.split("\t")) in (3, 4) for line in player.quality.splitlines())
    root = next(line for line in player.quality.splitlines() if line.startswith("Distance to track:"))
    assert root.split("\t")[1:] == ["≤ 0.50", "met"]
    text, second, status = player.moments.splitlines()[0].split("\t")
    assert text.startswith("5.0 s  kick") and float(second) == 5.0 and status in {"met", "missed"}
    for line in player.warnings.splitlines():
        text, seconds = line.split("\t")
        first = float(text.split("-")[0].split(" ")[0].rstrip(",")) if text[0].isdigit() else None
        assert first is None or float(seconds.split()[0]) == pytest.approx(first, abs=0.06)


def test_words_met_is_at_least_what_is_wanted(room):
    report = {"fps": 30.0, "annotation_similarity": {"all": -0.95}, "warp_rate": {"min": 0.8, "max": 1.0}}
    lines = room("result.quality").describe_quality(report).splitlines()
    assert lines == ["Labels matched: 97.5 %\t≥ 95.0\tmet", "Slowest playback: 0.80 x\t≥ 0.85\tmissed",
                     "Fastest playback: 1.00 x\t≤ 1.15\tmet"]


def test_jump_goes_to_the_second_and_selects_the_body(shown):
    assert_one_step(bpy.ops.beyond_mocap.jump_to, seconds=5.0, player="runner")
    scene = bpy.context.scene
    assert scene.frame_current == 1 + 5 * scene.render.fps
    body = scene.beyond_mocap.players[0].body
    assert bpy.context.view_layer.objects.active == body and body.select_get()
    with pytest.raises(RuntimeError, match="nobody; expected a name in the list"):
        bpy.ops.beyond_mocap.jump_to(seconds=1.0, player="nobody")


def test_a_line_about_several_stretches_goes_from_one_to_the_next(shown):
    scene, seen = bpy.context.scene, []
    scene.frame_set(1)
    for _ in range(4):
        bpy.ops.beyond_mocap.jump_to(stops="4.000 1.000 2.500")
        seen.append((scene.frame_current - 1) / scene.render.fps)
    assert seen == pytest.approx([1.0, 2.5, 4.0, 1.0], abs=0.03)
    with pytest.raises(RuntimeError, match="stops: 'soon'; expected seconds"):
        bpy.ops.beyond_mocap.jump_to(stops="soon")


def test_events_are_lines_that_go_to_their_second(shown, room):
    """A spin at 3.5 s and two snap turns at 1.2 and 4.0 s, in a report as `evaluate` writes it."""
    report = {
        "fps": 30.0, "warnings": ["1.2, 4.0 s: the body turns by more than 75 degrees within 0.3 s",
                                  "3.5 s: the body turns by more than 200 degrees within 2 s"],
        "warning_seconds": [[[1.2, 1.2], [4.0, 4.0]], [[3.5, 3.5]]],
        "naturalness": {"snap_turns_per_min": 2.0, "spins_per_min": 0.2, "standing": {"both_down": 0.9}},
        "touches": {"reception": {"speed_m_s_median": 7.5}, "ball_inside": {"inside_frames": 0}},
    }  # fmt: skip
    quality, scene = room("result.quality"), bpy.context.scene
    player = scene.beyond_mocap.players[0]
    player.warnings = quality.describe_warnings(report)
    stops = [line.partition("\t")[2] for line in player.warnings.splitlines()]
    seen = []
    for stop in (stops[0], stops[0], stops[1]):
        bpy.ops.beyond_mocap.jump_to(stops=stop, player=player.name)
        seen.append((scene.frame_current - 1) / scene.render.fps)
    assert seen == pytest.approx([1.2, 4.0, 3.5], abs=0.03)
    assert quality.describe_quality(report).splitlines() == [
        "Snap turns: 2.0 /min\t≤ 0.6\tmissed", "Spins: 0.2 /min\t≤ 0.3\tmet",
        "Both feet down standing: 90 %\t≥ 80\tmet", "Foot speed at receptions: 7.5 m/s\t≤ 3.0\tmissed",
        "Ball inside the body: 0 frames\t≤ 0\tmet"]
    assert quality.describe_quality({**report, "duration_s": 30.0}).splitlines()[:2] == [  # and how many there are
        "Snap turns: 2.0 /min\t≤ 0.6\tmissed\t1", "Spins: 0.2 /min\t≤ 0.3\tmet\t0"]


def test_jump_at_another_frame_rate(shown):
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = 24, 1.001
    bpy.ops.beyond_mocap.jump_to(seconds=4.0)
    assert scene.frame_current == round(1 + 4.0 * 24 / 1.001)


def test_error_curves_are_one_step_and_say_what_the_report_says(shown, room):
    assert_one_step(bpy.ops.beyond_mocap.error_curves)
    player = bpy.context.scene.beyond_mocap.players[0]
    data, report = player.body.data, room("core.session").find_take(player.take).report
    action = data.animation_data.action
    curves = room("core.channels").collect_curves(action, data.animation_data.action_slot)
    values = np.array([curves['["Root Error (cm)"]', 0].evaluate(f) for f in range(1, 241)])
    assert values.mean() == pytest.approx(100 * report["root_error_m"]["mean"], rel=0.05)
    pieces = np.array([curves['["Piece (0 or 1)"]', 0].evaluate(f) for f in range(1, 301)])
    assert np.sum(np.diff(pieces) != 0.0) == len(room("core.session").find_take(player.take).take.seams)
    bpy.context.scene.frame_set(120)
    assert data["Root Error (cm)"] == pytest.approx(values[119], abs=1e-4)


def test_error_curves_go_again_and_leave_nothing(shown):
    before = collect_state()
    bpy.ops.beyond_mocap.error_curves()
    assert collect_state() != before
    bpy.ops.beyond_mocap.error_curves(remove=True)
    assert collect_state() == before
    data = bpy.context.scene.beyond_mocap.players[0].body.data
    assert not any(name for name in data.keys() if name.startswith(("Root", "Slide", "Piece")))


def test_error_curves_go_with_the_take(shown, room):
    before = {action.name for action in bpy.data.actions}
    bpy.ops.beyond_mocap.accept()
    bpy.ops.beyond_mocap.error_curves()
    first = bpy.context.scene.beyond_mocap.players[0].body.data.animation_data.action.name
    bpy.ops.beyond_mocap.synthesize()  # a preview: the curves are those of the new take
    player = bpy.context.scene.beyond_mocap.players[0]
    assert room("result.quality").has_error_curves(player.body) and player.body.data.animation_data.action.name == first
    bpy.ops.beyond_mocap.discard()
    assert room("result.quality").has_error_curves(bpy.context.scene.beyond_mocap.players[0].body)
    bpy.ops.beyond_mocap.error_curves(remove=True)
    assert {action.name for action in bpy.data.actions} == before


def test_error_curves_go_with_a_preview_that_made_the_body(shown):
    bpy.ops.beyond_mocap.error_curves()
    bpy.ops.beyond_mocap.discard()
    assert not [action.name for action in bpy.data.actions if "error" in action.name] and not len(bpy.data.armatures)


def test_without_a_take_buttons_say_what_to_do():
    with pytest.raises(RuntimeError, match="Synthesize first"):
        bpy.ops.beyond_mocap.error_curves()
    scene = bpy.context.scene
    scene.frame_set(7)
    assert bpy.ops.beyond_mocap.jump_to(seconds=2.0) == {"FINISHED"}  # no player: the frame alone
    assert scene.frame_current == 1 + 2 * scene.render.fps
