"""The sample: what ships is what the script makes, its words are known, and its passage could be played."""

import importlib.util
import pathlib

import numpy as np
import pytest

from beyond_mocap.annotation import list_vocabulary, read_clip_annotations, read_timeline
from beyond_mocap.files.bvh import bvh
from beyond_mocap.files.tracking.tracking import read_track_csv

SAMPLE = pathlib.Path(__file__).parents[3] / "sample_blend"


@pytest.fixture(scope="module")
def maker():
    spec = importlib.util.spec_from_file_location("make_sample", SAMPLE / "make_sample.py")
    module = importlib.util.module_from_spec(spec)
    import sys

    sys.modules["make_sample"] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


def annotations():
    for path in sorted((SAMPLE / "library").glob("*.bvh")):
        motion = bvh.read_bvh(path).motion
        yield path, motion, read_clip_annotations(path.with_suffix(".txt"), motion.fps)


def test_every_kind_of_movement_is_there():
    found = {word for _, _, rows in annotations() for row in rows for word in row.words}
    assert found >= {
        "standing", "walking", "jogging", "running", "sprinting", "turning", "left", "right", "back", "dribble",
        "receive", "kick", "header", "throwb", "getting_up", "celebration",
    }  # fmt: skip
    assert found <= list_vocabulary()


def test_words_lie_within_their_clips_and_keys_within_their_words():
    for path, motion, rows in annotations():
        assert rows, path.name
        for row in rows:
            assert 0 <= row.start < row.end <= len(motion) - 1, path.name
            assert row.key is None or row.start < row.key < row.end, path.name
    with_keys = {row.words for _, _, rows in annotations() for row in rows if row.key is not None}
    assert len(with_keys) == 7


def test_one_skeleton_and_at_most_six_megabytes():
    motions = [bvh.read_bvh(path).motion for path in sorted((SAMPLE / "library").glob("*.bvh"))]
    assert all(m.skeleton.has_same_bones(motions[0].skeleton) for m in motions)
    assert sum(path.stat().st_size for folder in ("library", "match") for path in (SAMPLE / folder).glob("*.*")) < 6.3e6


def test_what_ships_is_what_the_script_makes(maker, tmp_path):
    maker.write_match(tmp_path)
    for made in tmp_path.iterdir():
        assert made.read_bytes() == (SAMPLE / "match" / made.name).read_bytes()
    clip = next(c for c in maker.build_clips() if c.name == "kick_low_top")
    shipped = bvh.read_bvh(SAMPLE / "library" / "kick_low_top.bvh").motion
    assert np.allclose(shipped.root_positions, clip.motion.root_positions, atol=1e-4)


def test_the_passage_could_be_played(maker):
    times, players, ball = maker.compute_true_paths()
    for path in players.values():
        velocity = np.gradient(path, times, axis=0)
        assert np.linalg.norm(velocity, axis=1).max() < 8.2
        assert np.linalg.norm(np.gradient(velocity, times, axis=0), axis=1).max() < 5.0
    assert np.all(np.isfinite(ball)) and ball[:, 2].min() > 0.1
    for moment, who, _ in maker.TOUCHES:
        at = int(round(moment * 100))
        assert 0.3 < np.linalg.norm(ball[at, :2] - players[who][at]) < 0.65
    assert max(np.linalg.norm(p, axis=1).max() for p in players.values()) < 60.0


def test_the_passage_reads_and_asks_for_what_the_library_has(maker):
    words = [set(row.words) for _, _, rows in annotations() for row in rows if row.key is not None]
    for name in ("player1", "player2"):
        track = read_track_csv(SAMPLE / "match" / f"{name}.csv")
        assert len(track.times) == 401 and np.all(np.isfinite(track.ball))
        timeline = read_timeline(SAMPLE / "match" / f"{name}.txt")
        assert timeline.keys
        for key in timeline.keys:
            assert any(set(key.words) <= have for have in words), key
        true = maker.compute_true_paths()[1][name][::10]
        error = np.linalg.norm(track.positions - true, axis=1)
        assert 0.03 < np.sqrt(np.mean(error**2)) < 0.14  # a tracking system's noise


def test_the_passing_library_is_what_its_script_makes(maker, monkeypatch):
    """Its clips are of the same skeleton, its strikes begin and end standing, and one of them is made again."""
    monkeypatch.syspath_prepend(str(SAMPLE))
    import make_passes

    folder = SAMPLE / "passes" / "library"
    clips = {clip.name: clip for clip in make_passes.build_passes_clips()}
    assert {path.stem for path in folder.glob("*.bvh")} == set(clips) == {path.stem for path in folder.glob("*.txt")}
    for name in ("volley_attack", "ready_2", "start_stop_walking"):
        shipped = bvh.read_bvh(folder / f"{name}.bvh").motion
        assert np.allclose(shipped.root_positions, clips[name].motion.root_positions, atol=1e-4)
    assert shipped.skeleton.has_same_bones(bvh.read_bvh(SAMPLE / "library" / "standing_1.bvh").motion.skeleton)
    keyed = {
        row.words
        for path in folder.glob("volley_*.bvh")
        for row in read_clip_annotations(path.with_suffix(".txt"), 30.0)
    }
    assert ("standing", "ready") in keyed and len(keyed) == 9
