"""Preferences: libraries are cached where the user says, threads change no bit, and nothing needs them."""

import importlib
import pathlib

import bpy
import numpy as np
import pytest

SAMPLE = pathlib.Path(__file__).resolve().parents[3] / "sample_blend" / "library"
CLIPS = ("standing_1", "walking_1_2", "jogging_2_9", "kick_low_inside")


@pytest.fixture
def rooms(extension):
    """scene.core.preferences and scene.core.session, both as they were afterwards."""
    found = [importlib.import_module(f"{extension.__name__}.scene.core.{name}") for name in ("preferences", "session")]
    yield found
    chosen = found[0].find_preferences()
    chosen.property_unset("cache_folder")
    chosen.property_unset("threads")
    found[1].clear_session()


@pytest.fixture
def clips(tmp_path):
    folder = tmp_path / "clips"
    folder.mkdir()
    for name in CLIPS:
        for suffix in (".bvh", ".txt"):
            (folder / f"{name}{suffix}").symlink_to(SAMPLE / f"{name}{suffix}")
    bpy.context.scene.beyond_mocap.library_folder = str(folder)
    return folder


def test_a_library_is_kept_where_the_preferences_say(rooms, clips, tmp_path):
    preferences, session = rooms
    chosen, place = preferences.find_preferences(), tmp_path / "caches"
    assert (chosen.cache_folder, chosen.threads) == ("", 0)
    chosen.cache_folder = str(place)
    assert bpy.ops.beyond_mocap.build_library() == {"FINISHED"}
    assert not (clips / ".beyond_mocap").exists()
    own, = place.iterdir()
    assert (own / "library.json").is_file() and preferences.find_cache_folder(str(clips)) == str(own)
    assert preferences.find_cache_folder(str(tmp_path)) != str(own)
    session.clear_session()
    chosen.cache_folder = ""
    assert bpy.ops.beyond_mocap.build_library() == {"FINISHED"}
    assert (clips / ".beyond_mocap" / "library.json").is_file()


def test_threads_change_no_bit(rooms, clips):
    preferences, session = rooms
    built = []
    for threads in (1, 3):
        preferences.find_preferences().threads = threads
        assert preferences.count_threads() == threads
        assert bpy.ops.beyond_mocap.build_library(rebuild=True) == {"FINISHED"}
        built.append(session.find_library(str(clips), None))
    assert built[0] is not built[1]
    for one, other in zip(built[0].clips, built[1].clips, strict=True):
        assert one.path == other.path and one.mirrored == other.mirrored
        assert np.array_equal(one.motion.rotations, other.motion.rotations)
    assert np.array_equal(built[0].frames.features, built[1].frames.features) and built[0].notes == built[1].notes


def test_it_works_without_preferences(rooms, clips, monkeypatch):
    preferences, _ = rooms
    monkeypatch.setattr(preferences, "find_preferences", lambda: None)
    assert preferences.count_threads() >= 1 and preferences.find_cache_folder(str(clips)) is None
    assert bpy.ops.beyond_mocap.build_library() == {"FINISHED"}


def test_a_cache_folder_that_cannot_be_made_is_reported_and_does_no_harm(rooms, clips, tmp_path):
    preferences, session = rooms
    (tmp_path / "file").write_text("")
    preferences.find_preferences().cache_folder = str(tmp_path / "file" / "caches")
    assert bpy.ops.beyond_mocap.build_library() == {"FINISHED"}
    assert any("cannot be written" in note for note in session.find_library(str(clips), None).notes)
