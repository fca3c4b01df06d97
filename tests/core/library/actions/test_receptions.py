"""Receptions that are cut out of dribbles: a foot that is held out and drawn back, not one that steps or swings."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import find_peaks

from beyond_mocap.annotation import KeyMoment, Timeline
from beyond_mocap.files.bvh import bvh
from beyond_mocap.library import receptions
from beyond_mocap.library.build import build_library
from beyond_mocap.library.missing_actions import ActionMoment, find_missing_actions
from beyond_mocap.motion.track import Track
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.synthesize import synthesize
from beyond_mocap.synthetic.actions.receptions import build_reception


def build(folder, clip_file, row: str):
    """A library of a walk, a run, and a stand in which the right foot gives with a ball, labelled with `row`."""
    for name, speed, words in (("stand", 0.0, "standing"), ("walk", 1.4, "walking"), ("run", 4.8, "running")):
        clip_file(folder / f"{name}.bvh", speed, 4.0, words)
    taken = build_reception("inside", speed=0.0)
    bvh.write_bvh(folder / "take.bvh", taken.motion)
    (folder / "take.txt").write_text(row.format(start=0.0, end=taken.motion.duration, key=taken.key))
    return build_library(folder), taken.key


@pytest.fixture(scope="module")
def dribbles(tmp_path_factory, clip_file):
    return build(tmp_path_factory.mktemp("dribbles"), clip_file, "{start:.3f} {end:.3f} dribble standing\n")


def test_a_foot_that_gives_in_a_dribble_is_a_reception(dribbles):
    library, key = dribbles
    cut = library.cut_receptions
    right = [one for one in cut if not library.clips[one.clip].mirrored]
    assert len(cut) == 2 * len(right) == 2
    (found,) = right
    assert library.clips[found.clip].path == "take.bvh" and found.frame / 60.0 == pytest.approx(key, abs=0.12)
    assert found.labels == {"receive", "foot", "low", "right", "standing"} and found.start < found.frame < found.end


def test_a_step_is_none(tmp_path, clip_file):
    clip_file(tmp_path / "walk.bvh", 1.4, 4.0, "walking dribble")
    clip_file(tmp_path / "run.bvh", 4.8, 4.0, "running dribble")
    assert build_library(tmp_path).cut_receptions == ()


def test_without_a_dribble_or_with_a_labelled_reception_nothing_is_cut_out(tmp_path, clip_file):
    for name, row in (("plain", "{start:.3f} {end:.3f} standing\n"), ("labelled",
                      "{start:.3f} {end:.3f} receive foot low dribble\n{key:.3f} receive foot low dribble\n")):
        (tmp_path / name).mkdir()
        assert build(tmp_path / name, clip_file, row)[0].cut_receptions == ()


def test_a_cut_out_serves_a_reception_and_is_reported(dribbles):
    library, _ = dribbles
    times = np.arange(0.0, 6.0, 0.1)
    timeline = Timeline(keys=(KeyMoment(3.0, ("receive", "foot", "low")),))
    plan = Plan(track=Track(times, np.zeros((len(times), 2))), timeline=timeline, made=False)
    take = synthesize(library, plan)
    (key,) = take.keys
    assert key.clip == "take.bvh" and key.used_instead is None and "receive" in key.words
    assert any("cut out of a dribble" in line for line in take.warnings)


def test_a_reception_may_be_the_last_frame_of_the_last_clip(tmp_path, clip_file):
    """Where the library's rate has no frame as late."""
    clip_file(tmp_path / "walk.bvh", 1.4, 4.0, "walking")
    taken = build_reception("inside", speed=0.0).motion.frames(0, 60)
    bvh.write_bvh(tmp_path / "z.bvh", taken)
    (tmp_path / "z.txt").write_text(f"{taken.duration:.6f} receive foot low\n")
    library = build_library(tmp_path)
    assert (library.keys[-1].clip, library.keys[-1].frame) == (len(library.clips) - 1, 59)
    for speed, is_missing in ((0.0, False), (3.0, True)):  # it suits who stands
        asked = ActionMoment(labels=frozenset({"receive", "foot"}), speed=speed)
        assert bool(find_missing_actions(library, [asked])) == is_missing


@pytest.mark.parametrize("count", [0, 1, 2, 3, 50, 2000])
def test_peaks_are_those_of_scipy_also_flat_ones(count):
    values = np.round(np.random.default_rng(count).normal(0.3, 0.03, count), 2)
    assert np.array_equal(receptions._find_peaks(values, 0.28), find_peaks(values, height=0.28)[0])
