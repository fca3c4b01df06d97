"""A match by its buttons: read, made by a process beside Blender, shown, looked at, and one step of undo each."""

import importlib
import json
import pathlib
import re
import shutil

import bpy
import numpy as np
import pytest
from conftest import EXTENSION
from undo import assert_one_step, press_operator

SAMPLE = pathlib.Path(__file__).resolve().parents[3] / "sample_blend"
TRACKING = SAMPLE / "match" / "small" / "small.dat"


@pytest.fixture(scope="module")
def place(sample_cache, tmp_path_factory):
    """The sample's library with its cache beside it, and a folder for matches."""
    top = tmp_path_factory.mktemp("match")
    shutil.copytree(SAMPLE / "library", top / "library", ignore=shutil.ignore_patterns(".beyond_mocap"))
    shutil.copytree(sample_cache, top / "library" / ".beyond_mocap")
    return top


@pytest.fixture(scope="module")
def made(place, extension):
    """A folder in which two players of the small match are made, six seconds of it."""
    bpy.ops.wm.read_homefile(use_empty=True)
    folder = place / "made"
    match = a_match(place, folder)
    for player in match.players:
        player.use = player.feed_id in ("home_7", "home_4")
    match.start, match.end = 2.0, 8.0
    assert press_operator(bpy.ops.beyond_mocap.make_match) == {"FINISHED"}
    shown = {thing.name for thing in room("match_objects").find_armatures(bpy.context.scene)}
    assert shown == {"Home 4 Ben Back", "Home 7 Cora Wing"}
    return folder


def room(name):
    return importlib.import_module(f"{EXTENSION}.scene.match.{name}")


def a_match(place, folder):
    """The settings after the small match has been read."""
    scene = bpy.context.scene
    scene.render.fps = 30
    scene.beyond_mocap.library_folder = str(place / "library")
    assert press_operator(bpy.ops.beyond_mocap.read_match, filepath=str(TRACKING)) == {"FINISHED"}
    match = scene.beyond_mocap_match
    match.folder, match.workers = str(folder), 1
    return match


def shown_again(place, made, start=2.0, end=8.0):
    match = a_match(place, made)
    match.start, match.end = start, end
    assert press_operator(bpy.ops.beyond_mocap.show_match) == {"FINISHED"}
    return match


def test_a_match_is_read_into_the_list(place):
    match = a_match(place, place / "nowhere")
    rows = [(player.name, player.number, player.team, player.use) for player in match.players]
    assert rows[0] == ("Ada Keeper", 1, "home", True) and rows[-1] == ("Ivo Fresh", 14, "away", True)
    assert len(rows) == 9 and (match.start, match.end) == (0.0, 24.0)
    assert "away_9: present for 9 s (0.0-9.0 s)" in match.report
    assert match.read_of.endswith("small.dat")


def test_read_again_the_ticks_and_colours_stay(place):
    match = a_match(place, place / "nowhere")
    match.players[2].use, match.home_colour, match.end = False, (0.1, 0.2, 0.3), 5.0
    assert press_operator(bpy.ops.beyond_mocap.read_match) == {"FINISHED"}
    assert [player.use for player in match.players].count(False) == 1 and not match.players[2].use
    assert np.allclose(match.home_colour, (0.1, 0.2, 0.3)) and match.end == 5.0


def test_ticks_by_team_and_alone(place):
    match = a_match(place, place / "nowhere")
    counts = {}
    for whom in ("NONE", "home", "away", "ALL"):
        bpy.ops.beyond_mocap.tick_match(whom=whom)
        counts[whom] = sum(player.use for player in match.players)
    match.active = 3
    bpy.ops.beyond_mocap.tick_match(whom="ONE")
    assert counts == {"NONE": 0, "home": 4, "away": 5, "ALL": 9}
    assert [player.use for player in match.players] == [number == 3 for number in range(9)]


def test_the_command_that_makes_it(place):
    match = a_match(place, place / "out")
    match.start, match.end, match.workers, match.solve_touches = 3.0, 9.5, 3, False
    match.strength, match.masses, match.fatigue = 4.0, "women", 0.5
    match.players[0].use = False
    arguments = room("request").build_command(bpy.context.scene)
    text = " ".join(arguments)
    assert text.startswith(f"match --tracking {TRACKING} --library {place / 'library'}")
    assert f"--out {place / 'out'}" in text
    assert "--from 3 --to 9.5" in text and "--workers 3" in text and "--no-solve-touches" in text
    assert "--strength 4 --masses women --fatigue 0.5" in text
    players = arguments[arguments.index("--players") + 1 :][:8]
    assert "home_1" not in players and set(players) == {player.feed_id for player in match.players if player.use}
    match.scheduler = "tcp://here:8786"
    assert "--workers" not in room("request").build_command(bpy.context.scene)


def test_what_goes_with_the_events_is_asked_for_where_there_are_events(place):
    match = a_match(place, "")
    match.events_metadata_file, match.events_provider = str(place / "f7.xml"), "opta"
    assert "--events-meta" not in room("request").build_command(bpy.context.scene)
    match.events_file = str(place / "f24.xml")
    text = " ".join(room("request").build_command(bpy.context.scene))
    assert f"--events-meta {place / 'f7.xml'} --events-provider opta" in text


def test_joints_are_read_as_a_match_and_requested_beside_one(place):
    joints, body = place / "joints.csv", {"hip": 0.9, "knee": 0.48, "ankle": 0.08, "shoulder": 1.42}
    joints.write_text("time_s,player,joint,x,y,z\n" + "".join(
        f"{frame / 25:.2f},A,{side}_{name},{0.04 * frame:.2f},{y},{z}\n" for frame in range(50)
        for side, y in (("left", 0.1), ("right", -0.1)) for name, z in body.items()))
    match = a_match(place, "")
    match.joints_file = str(joints)
    arguments = room("request").build_command(bpy.context.scene)
    assert arguments[arguments.index("--joints") + 1] == str(joints)
    assert bpy.ops.beyond_mocap.read_match(filepath=str(joints)) == {"FINISHED"}
    assert [player.feed_id for player in match.players] == ["A"] and match.joints_file == ""
    assert match.tracking_file == str(joints) and "one team" in match.report


def test_no_digit_of_a_late_time_is_lost(place, core):
    match = a_match(place, "")
    match.start, match.end = 1234.567, 2700.04
    bpy.context.scene.beyond_mocap.rate = 30000 / 1001
    order = room("request")
    text = " ".join(order.build_command(bpy.context.scene))
    assert "--from 1234.567 --to 2700.04" in text and "--fps 29.97003" in text
    assert " 1234.567-2700.04 s " in order.choose_output_folder(bpy.context.scene)
    wanted = order.build_display_request(bpy.context.scene, "folder")
    assert (wanted.start, wanted.end) == (1234.567, 2700.04)
    match.start, match.end = 2700.04, 1234.567
    with pytest.raises(core("base.errors").InputError, match=r"To \(1234.567 s\) is not after From \(2700.04 s\)"):
        order.build_command(bpy.context.scene)


def test_what_is_made_is_shown_where_the_ball_is(place, made):
    """Ball and players of the made match are where the planted truth has them: at every touch of the two players."""
    match = shown_again(place, made)
    scene = bpy.context.scene
    ball, bodies = room("show").find_ball(scene), room("match_objects").find_armatures(scene)
    touches = [line.split(",") for line in (TRACKING.with_name("small_touches.csv")).read_text().splitlines()[1:]]
    looked = 0
    for time, who, *_, x, y, z in touches:
        if who in ("home_4", "home_7") and match.start < float(time) < match.end:
            frame = match.shown_first + (float(time) - match.shown_start) * 30.0
            scene.frame_set(int(frame), subframe=frame % 1.0)
            away = (ball.matrix_world.translation - _vector(x, y, z)).length
            assert away < 0.5, time  # it is led to where his foot is
            body = next(thing for thing in bodies if thing[room("match_objects").PLAYER_PROPERTY] == who)
            hips = body.matrix_world @ body.pose.bones[0].head
            assert (hips.xy - _vector(x, y, z).xy).length < 1.0, time
            looked += 1
    assert looked >= 5


def _vector(*cells):
    from mathutils import Vector

    return Vector([float(cell) for cell in cells])


def test_shown_it_is_one_step_of_undo(place, made):
    match = a_match(place, made)
    match.start, match.end = 2.0, 6.0
    assert_one_step(bpy.ops.beyond_mocap.show_match)
    bpy.context.scene.beyond_mocap_match.end = 5.0
    assert_one_step(bpy.ops.beyond_mocap.show_match)  # in the place of the first


def test_without_a_folder_each_choice_has_its_own(place):
    match = a_match(place, "")
    shutil.copy(TRACKING, place / TRACKING.name)  # what comes with the extension has its results elsewhere
    match.tracking_file = str(place / TRACKING.name)
    folder = room("request").choose_output_folder
    scene, seen = bpy.context.scene, set()
    for change in ({}, {"end": 12.0}, {"solve_touches": False}, {"workers": 7}):
        for name, value in change.items():
            setattr(match, name, value)
        seen.add(folder(scene))
    assert len(seen) == 3  # the number of processes changes nothing
    assert all(pathlib.Path(one).parent == place and "small 0-" in one for one in seen)
    match.folder = str(place)
    assert folder(scene) == room("request").choose_display_folder(scene) == str(place)


def test_a_match_made_while_another_scene_is_shown_is_not_lost(place, made):
    """It is not put into the other scene; Show Match finds it."""
    match = a_match(place, "")
    match.start, match.end = 2.0, 8.0
    scene, other = bpy.context.scene, bpy.data.scenes.new("Other")
    wanted = room("request").build_display_request(scene, str(made))
    seen = room("load").load_section(wanted, None, lambda done, text: None, lambda: False)
    verb = importlib.import_module(f"{EXTENSION}.operators.match").MatchVerb
    bpy.context.window.scene = other
    with pytest.raises(Exception, match="press Show Match"):
        verb.apply(None, scene, (wanted, seen, ()))
    assert not other.objects and not scene.objects
    bpy.context.window.scene = scene
    assert bpy.ops.beyond_mocap.show_match() == {"FINISHED"} and room("match_objects").find_armatures(scene)
    count = len(seen[1].characters)
    assert re.match(rf"\d+ % of the targets met by {count} players; fewest by .* \(\d+ %\)$", match.quality)


def test_a_match_with_damaged_reports_is_shown_with_what_is_known(place, made, tmp_path):
    """Two players of one name are two, and nothing is said where no player has figures."""
    match = a_match(place, "")
    match.start, match.end = 2.0, 8.0
    folder = shutil.copytree(made, tmp_path / "damaged")
    load = room("load")
    wanted = room("request").build_display_request(bpy.context.scene, str(folder))

    def read_quality():
        return load.load_section(wanted, None, lambda done, text: None, lambda: False)[1].quality

    state = json.loads((folder / "match.json").read_text())
    for player in state["players"]:
        player["name"], player["number"] = "Silva", 7
    (folder / "match.json").write_text(json.dumps(state))
    reports = sorted(folder.glob("*.report.json"))
    first = json.loads(reports[0].read_text())
    assert "by 2 players; fewest by 7 Silva" in read_quality()
    for damage in ({"fps": "fast"}, {"unknown": [1]}, {"notes": 3}):
        reports[0].write_text(json.dumps({**first, **damage}))
        assert read_quality().endswith("by 1 of 2 players, the others have no figures")
    for path in reports:
        path.unlink()
    assert read_quality() == ""


def test_an_end_before_the_start_is_told_before_anything_is_made(place, tmp_path):
    match = a_match(place, tmp_path / "out")
    match.start, match.end = 6.0, 3.0
    with pytest.raises(RuntimeError, match="To .3 s. is not after From .6 s."):
        bpy.ops.beyond_mocap.make_match()
    assert not (tmp_path / "out").exists()
    match.end = 0.0
    assert "--to" not in room("request").build_command(bpy.context.scene)


def test_what_was_chosen_before_the_first_reading_stays(place):
    """Of the next file it is forgotten."""
    scene, events = bpy.context.scene, str(TRACKING.with_name("small_events.csv"))
    match = scene.beyond_mocap_match
    match.tracking_file, match.events_file, match.folder = str(TRACKING), events, str(place / "mine")
    bpy.ops.beyond_mocap.read_match()
    assert (match.events_file, match.folder) == (events, str(place / "mine"))
    match.made = str(place / "made")
    bpy.ops.beyond_mocap.read_match(filepath=str(TRACKING.with_name("small_Home.csv")))
    assert (match.events_file, match.folder, match.made) == ("", "", "")


def test_ticks_of_another_file_are_not_asked_for(place):
    match = a_match(place, place / "nowhere")
    match.players[0].use, match.tracking_file = False, str(TRACKING.with_name("small_Home.csv"))
    with pytest.raises(RuntimeError, match="the list belongs to small.dat.*press Read Match"):
        bpy.ops.beyond_mocap.make_match()


def test_of_files_dropped_together_the_tracking_is_read():
    names = ["small_meta.xml", "small_events.csv", "small.dat"]
    bpy.ops.beyond_mocap.read_match(directory=str(TRACKING.parent), files=[{"name": name} for name in names])
    assert bpy.context.scene.beyond_mocap_match.read_of.endswith("small.dat")


def test_one_whose_file_is_gone_leaves_the_others(place, made, tmp_path):
    shutil.copytree(made, tmp_path / "copy")
    (tmp_path / "copy" / "home_4.take.npz").unlink()
    match = shown_again(place, tmp_path / "copy")
    assert {thing[room("match_objects").PLAYER_PROPERTY]
            for thing in room("match_objects").find_armatures(bpy.context.scene)} == {"home_7"}
    assert "home_4 cannot be shown" in match.messages and "no such file" in match.messages
    (tmp_path / "copy" / "home_7.take.npz").write_bytes(b"no take")
    with pytest.raises(RuntimeError, match="take.npz"):
        bpy.ops.beyond_mocap.show_match()


@pytest.mark.parametrize("missing", ["pitch_m", "from_s", "file"])
def test_a_damaged_state_is_told(place, made, tmp_path, missing):
    state = json.loads((made / "match.json").read_text())
    for table in (state, *state["players"]):
        table.pop(missing, None)
    (tmp_path / "match.json").write_text(json.dumps(state))
    match = a_match(place, tmp_path)
    match.start, match.end = 2.0, 8.0
    with pytest.raises(RuntimeError, match="match.json: times, pitch or a player") as caught:
        bpy.ops.beyond_mocap.show_match()
    assert "Traceback" not in str(caught.value)


def test_cameras_by_their_buttons(place, made):
    shown_again(place, made)
    scene = bpy.context.scene
    assert press_operator(bpy.ops.beyond_mocap.match_camera, which="EYES", player="home_7") == {"FINISHED"}
    eyes = scene.camera
    scene.frame_set(60)
    seven = next(thing for thing in room("match_objects").find_armatures(scene)
                 if thing[room("match_objects").PLAYER_PROPERTY] == "home_7")
    head = next(bone for bone in seven.pose.bones if bone.name.lower() == "head")
    assert (eyes.matrix_world.translation - seven.matrix_world @ head.head).length < 0.25
    assert press_operator(bpy.ops.beyond_mocap.match_camera, which="STAND") == {"FINISHED"}
    stand = importlib.import_module(f"{EXTENSION}.scene.stage.cameras").find_camera(scene, "BROADCAST")
    assert scene.camera == stand != eyes
    with pytest.raises(RuntimeError, match="away_1 is not shown"):
        bpy.ops.beyond_mocap.match_camera(which="EYES", player="away_1")


def test_a_new_colour_is_worn_at_once(place, made):
    match = shown_again(place, made)
    match.home_colour = (0.0, 0.5, 0.1)
    shirt = bpy.data.materials["Match Home shirt"]
    shader = next(node for node in shirt.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    assert np.allclose(shader.inputs["Base Color"].default_value[:3], (0.0, 0.5, 0.1), atol=0.01)
    shirt.node_tree.nodes.clear()  # made another material by the user: nothing to paint, and no trouble
    match.home_colour = (0.9, 0.0, 0.1)
    assert press_operator(bpy.ops.beyond_mocap.show_match) == {"FINISHED"}
    assert not len(shirt.node_tree.nodes)


def test_a_saved_file_shows_it_without_its_folder(place, made, tmp_path):
    """What is shown is in the file: the eyes of a player are found from his action alone."""
    shown_again(place, made)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "match.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "match.blend"))
    assert len(room("match_objects").find_armatures(bpy.context.scene)) == 2
    assert press_operator(bpy.ops.beyond_mocap.match_camera, which="EYES", player="home_4") == {"FINISHED"}


@pytest.mark.parametrize("trouble, told", [
    ("plain", "one player's track"), ("nobody", "no players selected"), ("time", "a time within"),
    ("folder", "no such file"), ("gone", "no such file"),
])  # fmt: skip
def test_trouble_is_one_line_and_nothing_changes(place, made, tmp_path, trouble, told):
    match = a_match(place, made)
    verb, arguments = bpy.ops.beyond_mocap.show_match, {}
    if trouble == "plain":
        verb, arguments = bpy.ops.beyond_mocap.read_match, {"filepath": str(SAMPLE / "match" / "player1.csv")}
    elif trouble == "nobody":
        bpy.ops.beyond_mocap.tick_match(whom="NONE")
        verb = bpy.ops.beyond_mocap.make_match
    elif trouble == "time":
        match.start, match.end = 12.0, 20.0
    elif trouble == "folder":
        match.folder = str(tmp_path)
    elif trouble == "gone":
        match.tracking_file, match.folder = str(tmp_path / "gone.dat"), str(tmp_path / "out")
        verb = bpy.ops.beyond_mocap.make_match
    objects = len(bpy.data.objects)
    with pytest.raises(RuntimeError, match=told) as caught:
        verb(**arguments)
    assert len(str(caught.value).strip().splitlines()) == 1
    assert len(bpy.data.objects) == objects
