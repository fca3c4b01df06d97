"""The road from tracking to moving players: operators give what the functions give, undo works, trouble is told."""

import importlib
import os
import pathlib

import bpy
import numpy as np
import pytest
from undo import assert_one_step, collect_state, press_operator
from worlds import CLIPS

SAMPLE = pathlib.Path(__file__).resolve().parents[3] / "sample_blend"
WORDS = "6.0 kick right running low inside\n"


@pytest.fixture
def match(tmp_path):
    """Twelve seconds of two players, one with words and a ball."""
    time = np.arange(0.0, 12.01, 0.1)
    for number, (speed, ball) in enumerate(((3.0, True), (1.3, False)), 1):
        angle = 0.08 * time * (-1) ** number
        x, y = speed * time * np.cos(angle), speed * time * np.sin(angle)
        lines = ["time_s,x_m,y_m" + ",ball_x_m,ball_y_m,ball_z_m" * ball]
        lines += [f"{t:.1f},{a:.3f},{b:.3f}" + f",{a + 0.6:.3f},{b:.3f},0.11" * ball for t, a, b in zip(time, x, y)]
        (tmp_path / f"player{number}.csv").write_text("\n".join(lines) + "\n")
    (tmp_path / "player1.txt").write_text(WORDS)
    return tmp_path


@pytest.fixture
def ready(match, library_folder):
    """Settings as an animator fills them in; no library read yet."""
    settings = bpy.context.scene.beyond_mocap
    settings.library_folder = str(library_folder)
    bpy.ops.beyond_mocap.import_tracking(directory=str(match), files=[{"name": "player1.csv"}, {"name": "player2.csv"}])
    return settings


@pytest.fixture
def session(extension):
    module = importlib.import_module(f"{extension.__name__}.scene.core.session")
    yield module
    module.clear_session()


def test_tracking_becomes_players(match, core):
    bpy.context.scene.render.fps = 25
    assert_one_step(bpy.ops.beyond_mocap.import_tracking, filepath=str(match / "player1.csv"))
    settings = bpy.context.scene.beyond_mocap
    assert [player.name for player in settings.players] == ["player1"]
    assert settings.players[0].annotation_file == str(match / "player1.txt")
    assert_one_step(bpy.ops.beyond_mocap.import_tracking, filepath=str(match / "player1.csv"))
    players = bpy.context.scene.beyond_mocap.players  # undo has replaced what was there before
    assert [player.name for player in players] == ["player1", "player1 2"]
    assert_one_step(bpy.ops.beyond_mocap.remove_player)
    assert bpy.context.scene.render.fps == 25


def test_words_chosen_together_with_their_track_are_no_track(match):
    names = [{"name": "player1.txt"}, {"name": "player1.csv"}]
    assert bpy.ops.beyond_mocap.import_tracking(directory=str(match), files=names) == {"FINISHED"}
    only, = bpy.context.scene.beyond_mocap.players
    assert only.tracking_file.endswith("player1.csv") and only.annotation_file.endswith("player1.txt")


def test_paths_are_kept_relative_where_the_user_wants_that(match):
    bpy.ops.wm.save_as_mainfile(filepath=str(match / "scene.blend"))
    bpy.context.preferences.filepaths.use_relative_paths = True
    bpy.ops.beyond_mocap.import_tracking(filepath=str(match / "player1.csv"))
    player = bpy.context.scene.beyond_mocap.players[0]
    assert player.tracking_file == "//player1.csv" and player.annotation_file == "//player1.txt"


def test_words_of_a_text_count_more_than_those_on_disk(extension, ready, core):
    plans = importlib.import_module(f"{extension.__name__}.scene.result.plans")
    text = bpy.data.texts.new("Words")
    text.write("3.0 kick right running low inside\n")
    ready.players[0].annotation_text = text
    assert plans.build_plan(ready, ready.players[0])[0].timeline.keys[0].time == 6.0  # strips count more than either
    bpy.ops.beyond_mocap.read_words()
    assert plans.build_plan(ready, ready.players[0])[0].timeline.keys[0].time == 3.0
    text.clear()
    text.write("3.0 kik right\n")
    bpy.ops.beyond_mocap.read_words()
    with pytest.raises(RuntimeError, match="strips of player1: the label 'kik'"):
        bpy.ops.beyond_mocap.synthesize()
    bpy.data.objects.remove(ready.players[0].dot)  # without strips the text itself counts
    with pytest.raises(RuntimeError, match="text Words:1: the label 'kik'"):
        bpy.ops.beyond_mocap.synthesize()


def test_what_the_panel_lets_one_set_is_what_the_plan_asks(extension, ready, core):
    plans = importlib.import_module(f"{extension.__name__}.scene.result.plans")
    player = ready.players[0]
    plain, planned = plans.build_plan(ready, player)[0], core("synthesis.plan").Plan
    numbers = {"alpha": 0.5, "delta": 0.25, "omega": 3.0, "seam_window": 0.5, "track_window": 1.5, "root_window": 1.0}
    for name, value in numbers.items():
        assert getattr(plain, name) == pytest.approx(getattr(planned, name))
        setattr(ready, name, value)
    ready.made, ready.gaits = False, "walking = walk.bvh; jogging=jog.bvh;"
    assert plain.solve_touches
    ready.solve_touches = False
    plan = plans.build_plan(ready, player)[0]
    assert {name: getattr(plan, name) for name in numbers} == pytest.approx(numbers)
    assert (
        plain.made and not plan.made and not plan.solve_touches
        and plan.gaits == (("walking", "walk.bvh"), ("jogging", "jog.bvh"))
    )  # fmt: skip
    ready.gaits = "walking"
    with pytest.raises(RuntimeError, match="LABEL=CLIP"):
        bpy.ops.beyond_mocap.synthesize()


def test_a_library_built_by_a_failed_synthesize_is_shown(ready, session):
    """It was only shown after a success, so that step 1 looked as if nothing had been built."""
    text = bpy.data.texts.new("Words")
    text.write("3.0 kik right\n")
    ready.players[0].annotation_text = text
    bpy.ops.beyond_mocap.read_words()
    with pytest.raises(RuntimeError, match="the label 'kik'"):
        bpy.ops.beyond_mocap.synthesize()
    assert f"{len(CLIPS)} clips" in bpy.context.scene.beyond_mocap.library_holds
    assert session.find_library(ready.library_folder, None) is not None


def test_the_whole_road(extension, ready, core, session):
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = 24, 1.001
    rate = 24 / 1.001
    bpy.ops.beyond_mocap.add_stage()
    bpy.ops.ed.undo_push(message="before")
    assert press_operator(bpy.ops.beyond_mocap.build_library) == {"FINISHED"}
    settings = bpy.context.scene.beyond_mocap
    assert f"{len(CLIPS)} clips" in settings.library_holds
    assert press_operator(bpy.ops.beyond_mocap.synthesize) == {"FINISHED"}
    settings = bpy.context.scene.beyond_mocap
    built = session.find_library(settings.library_folder, None)
    for player in settings.players:
        made = session.find_take(player.take)
        again = core("synthesis.synthesize").synthesize(built, made.plan)
        assert np.array_equal(made.take.motion.rotations, again.motion.rotations)
        assert np.array_equal(made.take.motion.root_positions, again.motion.root_positions)
        assert "Foot slide" in player.quality
    synthesized = collect_state()
    assert press_operator(bpy.ops.beyond_mocap.accept) == {"FINISHED"}
    accepted = collect_state()
    action = importlib.import_module(f"{extension.__name__}.scene.core.action")
    resample = core("motion.motion").resample
    for player in bpy.context.scene.beyond_mocap.players:
        take = session.find_take(player.take).take
        read, expected = action.read_motion(player.body, bpy.context.scene), resample(take.motion, rate)
        assert abs(len(read) - len(expected)) <= 1
        count = min(len(read), len(expected))
        np.testing.assert_allclose(read.root_positions[:count], expected.root_positions[:count], atol=1e-5)
        assert np.abs(np.sum(read.rotations[:count] * expected.rotations[:count], axis=-1)).min() > 1 - 1e-6
    assert "Ball" in bpy.data.objects and bpy.context.scene.frame_end >= int(12 * rate)
    assert (scene.render.fps, scene.render.fps_base) == (24, pytest.approx(1.001))
    bpy.ops.ed.undo()
    assert collect_state() == synthesized
    bpy.ops.ed.undo()
    assert [player.take for player in bpy.context.scene.beyond_mocap.players] == ["", ""]
    bpy.ops.ed.undo()
    assert bpy.context.scene.beyond_mocap.library_holds == ""
    for _ in range(3):
        bpy.ops.ed.redo()
    assert collect_state() == accepted


def test_dots_are_small_while_a_take_is_shown_in_their_place(ready, session):
    dots = [ready.players[0].dot, bpy.data.objects["Ball dot"]]
    before = [(dot.empty_display_type, dot.empty_display_size) for dot in dots]
    bpy.ops.beyond_mocap.synthesize(player="player1")
    assert {(dot.empty_display_type, round(dot.empty_display_size, 3)) for dot in dots} == {("PLAIN_AXES", 0.05)}
    assert ready.players[1].dot.empty_display_type == "SPHERE"
    bpy.ops.beyond_mocap.discard()
    assert [(dot.empty_display_type, dot.empty_display_size) for dot in dots] == before


def test_update_makes_anew_what_a_changed_word_touches(extension, ready, match, core, session):
    bpy.ops.beyond_mocap.build_library()
    refused(bpy.ops.beyond_mocap.update, "Synthesize first")
    bpy.ops.beyond_mocap.synthesize()
    before = [session.find_take(player.take) for player in ready.players]
    (match / "player1.txt").write_text(WORDS.replace("6.0", "6.2"))
    bpy.ops.beyond_mocap.read_words()
    assert_one_step(bpy.ops.beyond_mocap.update)
    settings = bpy.context.scene.beyond_mocap
    after = [session.find_take(player.take) for player in settings.players]
    assert after[0].plan.timeline.keys[0].time == 6.2
    built = session.find_library(settings.library_folder, None)
    for old, new in zip(before, after):
        again = core("synthesis.resynthesize").resynthesize(built, new.plan, old.take)
        assert np.array_equal(new.take.motion.rotations, again.motion.rotations)
        assert np.array_equal(new.take.motion.root_positions, again.motion.root_positions)
    same = np.all(before[0].take.motion.rotations == after[0].take.motion.rotations, axis=(1, 2))
    assert same[: 2 * 30].all() and same[10 * 30 :].all() and not same.all()
    assert np.array_equal(before[1].take.motion.rotations, after[1].take.motion.rotations)


def test_solved_touches_come_out_as_the_core_has_them(extension, ready, match, core, session):
    """A ball that is kicked at 6.13 s, asked for at 6.0 s: played, shown in the quality's line,
    and made anew by Update."""
    rows = [line.split(",") for line in (match / "player1.csv").read_text().splitlines()[1:]]
    since = np.array([float(row[0]) for row in rows]) - 6.13
    place = [np.interp(0.0, since, [float(row[axis]) for row in rows]) for axis in (1, 2)]
    ball = np.array(place) + [0.5, 0.0] + np.where(since < 0, -3.0, 12.0)[:, None] * since[:, None] * [1.0, 0.1]
    lines = [",".join((*row[:3], f"{x:.3f}", f"{y:.3f}", "0.11")) for row, (x, y) in zip(rows, ball)]
    text = "\n".join(["time_s,x_m,y_m,ball_x_m,ball_y_m,ball_z_m", *lines])
    (match / "player1.csv").write_text(text + "\n")
    ready.players[1].use = False
    assert_one_step(bpy.ops.beyond_mocap.synthesize)
    player = bpy.context.scene.beyond_mocap.players[0]
    made = session.find_take(player.take)
    key, = made.report["keys"]
    assert key["time_s"] == 6.0 and key["solved_time_s"] == pytest.approx(6.13, abs=0.03)
    assert key["contact_gap_m"] < 0.005 and f"touch at {key['solved_time_s']:.2f} s" in player.moments
    built = session.find_library(bpy.context.scene.beyond_mocap.library_folder, None)
    again = core("synthesis.synthesize").synthesize(built, made.plan)
    assert np.array_equal(made.take.motion.rotations, again.motion.rotations)
    assert np.array_equal(made.take.ball.positions, again.ball.positions)
    bpy.context.scene.beyond_mocap.solve_touches = False
    bpy.ops.beyond_mocap.update()
    plain = session.find_take(bpy.context.scene.beyond_mocap.players[0].take)
    assert plain.report["keys"][0]["solved_time_s"] is None


def test_accepting_again_replaces_the_take_only(extension, ready, session):
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept()
    once = collect_state()
    ready.seed = 1
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept()
    assert {kind: collect_state()[kind] for kind in ("objects", "actions", "meshes", "curves", "armatures")} == {
        kind: once[kind] for kind in ("objects", "actions", "meshes", "curves", "armatures")}
    bpy.data.objects.remove(ready.players[0].body)
    bpy.ops.beyond_mocap.accept()
    assert ready.players[0].body is not None


def test_the_ball_lies_where_the_file_says_and_rolls(extension, ready, session):
    bpy.context.scene.render.fps = 10
    ready.solve_touches = False
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept()
    ball = bpy.data.objects["Ball"]
    bpy.context.scene.frame_set(1 + 50)
    at, angle = 3.0 * 5.0, -0.08 * 5.0
    np.testing.assert_allclose(ball.location, [at * np.cos(angle) + 0.6, at * np.sin(angle), 0.11], atol=0.05)
    turned = ball.rotation_quaternion.copy()
    bpy.context.scene.frame_set(1 + 51)
    moved = turned.rotation_difference(ball.rotation_quaternion).angle
    assert moved == pytest.approx(0.3 / 0.11, rel=0.1)


def test_another_unit_scale(ready, session):
    bpy.context.scene.unit_settings.scale_length = 0.01
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept()
    bpy.context.scene.frame_set(1 + 24 * 6)
    body = ready.players[0].body
    hips = body.matrix_world @ body.pose.bones[0].matrix
    assert hips.translation.xy.length == pytest.approx(100 * 18, rel=0.05)
    assert 70 < hips.translation.z < 120


@pytest.mark.parametrize("operator, message", [
    ("build_library", "Choose the library's folder first"),
    ("synthesize", "Choose the library's folder"),
    ("accept", "Synthesize first"),
    ("import_tracking", "no file given"),
])
def test_nothing_filled_in(operator, message):
    before = collect_state()
    with pytest.raises(RuntimeError, match=message):
        getattr(bpy.ops.beyond_mocap, operator)()
    assert collect_state() == before


def refused(operator, message, **arguments):
    """The operator reports `message` and the scene is as before, but that a library built meanwhile is shown."""
    before = collect_state()
    with pytest.raises(RuntimeError, match=message):
        operator(**arguments)
    after = collect_state()
    for name in ("library_holds", "library_gaps"):
        assert after["settings"].pop(name).startswith(before["settings"].pop(name))
    assert after == before


def test_centimetres_are_refused_at_import(tmp_path):
    rows = [f"{0.1 * n:.1f},{30 * n},0" for n in range(50)]
    (tmp_path / "cm.csv").write_text("\n".join(["time_s,x_m,y_m", *rows]))
    refused(bpy.ops.beyond_mocap.import_tracking, "look like centimetres .* divide x and y by 100",
            filepath=str(tmp_path / "cm.csv"))


def read_last_report(capfd):
    return capfd.readouterr().out.strip().splitlines()[-1]


def test_missed_moments_and_other_balls_are_reported(match, library_folder, session, capfd):
    """The second player's ball lies far away, and their kick with it."""
    time = np.arange(0.0, 12.01, 0.1)
    rows = [f"{t:.1f},{1.3 * t:.3f},0,{1.3 * t + 20:.3f},9,0.11" for t in time]
    (match / "player2.csv").write_text("\n".join(["time_s,x_m,y_m,ball_x_m,ball_y_m,ball_z_m", *rows]))
    (match / "player2.txt").write_text("5.0 kick right\n")
    bpy.context.scene.beyond_mocap.library_folder = str(library_folder)
    bpy.ops.beyond_mocap.import_tracking(directory=str(match), files=[{"name": "player1.csv"}, {"name": "player2.csv"}])
    bpy.ops.beyond_mocap.synthesize(player="player1")
    assert not bpy.context.window_manager.beyond_mocap_notices.rows
    bpy.ops.beyond_mocap.synthesize()
    assert "Generated: player1, player2, 1 of 2 moments missed; press Apply or Revert" in read_last_report(capfd)
    notice, = bpy.context.window_manager.beyond_mocap_notices.rows
    assert notice.found.startswith("ball of player2: up to ") and notice.room == "synthesis"
    bpy.ops.beyond_mocap.discard(player="player2")
    assert not bpy.context.window_manager.beyond_mocap_notices.rows


def test_missing_files_are_named(ready, match, tmp_path):
    ready.library_folder = str(tmp_path / "nowhere")
    refused(bpy.ops.beyond_mocap.build_library, "nowhere: no such folder")
    refused(bpy.ops.beyond_mocap.synthesize, "nowhere: no such folder")
    refused(bpy.ops.beyond_mocap.import_tracking, "missing.csv", filepath=str(tmp_path / "missing.csv"))
    (match / "player1.csv").unlink()
    refused(bpy.ops.beyond_mocap.synthesize, "player1.csv")


@pytest.mark.parametrize("content, found", [
    ("", "empty|form|time_s|expected"),
    ("time_s,x_m\n0,1\n", "y_m"),
    ("time_s,x_m,y_m\n0,a,1\n", "csv:2"),
    ("a,b,c\n1,2,3\n", "expected"),
])
def test_bad_tracking(tmp_path, content, found):
    path = tmp_path / "bad.csv"
    path.write_text(content)
    refused(bpy.ops.beyond_mocap.import_tracking, found, filepath=str(path))


def test_words_that_the_library_lacks(ready, match):
    (match / "player1.txt").write_text("6.0 header subtle\n")
    bpy.ops.beyond_mocap.read_words()
    refused(bpy.ops.beyond_mocap.synthesize, "strips of player1: .*6 s: .*header subtle")
    ready.nearest = True
    assert bpy.ops.beyond_mocap.synthesize() == {"FINISHED"}
    assert ready.players[0].moments.startswith("6.0 s  header subtle, replaced by ")


def test_a_take_of_another_session(ready, session):
    bpy.ops.beyond_mocap.synthesize()
    session.clear_session()
    for player in ready.players:
        bpy.data.objects.remove(player.body)
    refused(bpy.ops.beyond_mocap.accept, "synthesize again")


def test_a_library_that_cannot_be_written(ready, tmp_path):
    locked = tmp_path / "locked"
    locked.mkdir()
    for name in CLIPS[:4]:
        for suffix in (".bvh", ".txt"):
            (locked / f"{name}{suffix}").symlink_to(SAMPLE / "library" / f"{name}{suffix}")
    locked.chmod(0o500)
    ready.library_folder = str(locked)
    assert bpy.ops.beyond_mocap.build_library() == {"FINISHED"}
    locked.chmod(0o700)
    if os.geteuid():
        assert not (locked / ".beyond_mocap").exists()
