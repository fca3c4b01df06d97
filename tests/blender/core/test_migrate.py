"""A file that the version before the editor has saved (tests/data/before_the_editor.blend) opens with all it had."""

import importlib
import pathlib
import shutil

import bpy
import pytest
from undo import assert_one_step, collect_state
from worlds import CLIPS, SAMPLE

OLD = pathlib.Path(__file__).resolve().parents[2] / "data" / "before_the_editor.blend"


@pytest.fixture
def old(tmp_path):
    """A copy of the old file with its two tracks, the words of one and the clips beside it; the other has a text."""
    for number, (speed, side) in enumerate(((2.0, 0.3), (1.3, 0.6)), 1):
        lines = [f"{t / 10:.1f},{speed * t / 10:.3f},{side * t / 40:.3f}" for t in range(41)]
        (tmp_path / f"player{number}.csv").write_text("\n".join(["time_s,x_m,y_m", *lines]) + "\n")
    (tmp_path / "player1.txt").write_text("0.5 1.5 walking\n2.4 kick right running low inside\n")
    (tmp_path / "library").mkdir()
    for name in CLIPS:
        for suffix in (".bvh", ".txt"):
            shutil.copy(SAMPLE / f"{name}{suffix}", tmp_path / "library")
    shutil.copy(OLD, tmp_path / "old.blend")
    return tmp_path / "old.blend"


@pytest.fixture
def rooms(extension):
    return {name: importlib.import_module(f"{extension.__name__}.scene.{name}")
            for name in ("core.migrate", "result.plans", "core.session", "timeline.strips", "player.tracks")}


def opened(path):
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return bpy.context.scene.beyond_mocap


def test_settings_players_and_bodies_are_as_they_were(old, rooms):
    settings = opened(old)
    assert settings.version == rooms["core.migrate"].VERSION
    assert (settings.library_folder, settings.nearest, settings.start_frame) == ("//library", True, 5)
    assert (settings.alpha, settings.rate) == (pytest.approx(0.3), 25.0)
    first, second = settings.players
    assert (first.name, first.tracking_file, first.annotation_file) == ("player1", "//player1.csv", "//player1.txt")
    assert (second.name, second.annotation_text.name) == ("Ten", "Words of two")
    for player in settings.players:
        assert player.body.type == "ARMATURE" and player.result.state == "ACCEPTED"
        assert player.body.animation_data.action.name == f"{player.name} take"
        assert "Feet slide" in player.quality
    assert {"Ball", "player1 body", "player1 track", "Ten track"} <= set(bpy.data.objects.keys())


def test_the_words_count_before_and_after_they_are_on_the_timeline(old, rooms):
    settings = opened(old)

    def words():
        settings = bpy.context.scene.beyond_mocap
        return [rooms["result.plans"].read_timeline(player, 30.0, rooms["player.tracks"].read_track(settings, player))
                for player in settings.players]

    before = words()
    assert [(len(timeline.spans), len(timeline.keys)) for timeline in before] == [(1, 1), (1, 0)]
    assert not any(player.dot for player in settings.players)
    assert_one_step(bpy.ops.beyond_mocap.place_players)
    settings = bpy.context.scene.beyond_mocap
    for player in settings.players:
        assert player.dot is not None and rooms["timeline.strips"].read_player_timeline(player,
                bpy.context.scene) is not None
    assert words() == before
    assert settings.players[1].annotation_text.as_string() == "1.0 3.0 walking\n"
    assert not bpy.ops.beyond_mocap.place_players.poll()


def test_a_player_whose_track_is_gone_is_reported_and_the_other_is_placed(old):
    (old.parent / "player1.csv").unlink()
    first, second = opened(old).players
    assert bpy.ops.beyond_mocap.place_players() == {"FINISHED"}
    assert first.dot is None and second.dot is not None
    (old.parent / "player2.csv").unlink()
    opened(old)
    before = collect_state()
    with pytest.raises(RuntimeError, match="player1.csv"):
        bpy.ops.beyond_mocap.place_players()
    assert collect_state() == before


def test_one_goes_on_where_one_had_stopped(old, rooms):
    """A new synthesis replaces the old bake on the same bodies, and Discard brings the old one back."""
    settings = opened(old)
    bodies = [player.body.name for player in settings.players]
    before = {name: value for name, value in collect_state().items() if name in ("keys", "animated")}
    bpy.ops.beyond_mocap.place_players()
    assert bpy.ops.beyond_mocap.synthesize() == {"FINISHED"}
    settings = bpy.context.scene.beyond_mocap
    assert [player.body.name for player in settings.players] == bodies
    assert bpy.ops.beyond_mocap.discard() == {"FINISHED"}
    after = collect_state()
    assert set(before["animated"]) <= set(after["animated"])
    assert before["keys"].items() <= after["keys"].items()
    bpy.ops.beyond_mocap.synthesize()
    assert bpy.ops.beyond_mocap.accept() == {"FINISHED"}
    rooms["core.session"].clear_session()


def test_what_this_version_saves_is_left_alone(old, rooms, tmp_path):
    opened(old)
    bpy.ops.beyond_mocap.place_players()
    new = bpy.data.scenes.new("Second")
    assert new.beyond_mocap.version == 0
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "new.blend"))
    saved = collect_state()
    opened(tmp_path / "new.blend")
    assert collect_state() == saved
    assert {scene.beyond_mocap.version for scene in bpy.data.scenes} == {rooms["core.migrate"].VERSION}


def test_takes_of_another_session_are_never_mistaken_for_this_one_s(old, rooms):
    """Names of takes are kept in files; a file from elsewhere must not find a take of this session under one."""
    rooms["core.session"].clear_session()
    name = rooms["core.session"].store_take(None, None)
    assert [rooms["core.session"].find_take(player.take) for player in opened(old).players] == [None, None]
    assert not name.removeprefix("take-").isdigit()
    rooms["core.session"].clear_session()
