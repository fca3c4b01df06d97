"""What recordings lack is made: speeds between and above them, kicks and taken balls on the run; offered only where
asked for, and told."""

from __future__ import annotations

import shutil
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.annotation import KeyMoment, Timeline
from beyond_mocap.files.bvh import bvh
from beyond_mocap.library import features, synthetic_clips
from beyond_mocap.library.build import build_library
from beyond_mocap.library.clip import BLEND_PREFIX, KICK_PREFIX, SYNTHETIC_FOLDER
from beyond_mocap.library.coverage import MAX_SPEED, find_speed_gaps
from beyond_mocap.library.features import list_frame_arrays
from beyond_mocap.library.keys import Key, select_substitutes
from beyond_mocap.library.missing_actions import describe_action
from beyond_mocap.library.synthetic_clips import complete_gaits
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.track import Track
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.quality.movement import list_stances, measure_stance_travel
from beyond_mocap.synthesis.synthesize import synthesize
from beyond_mocap.synthetic.actions.receptions import build_reception


def straight(speed: float, seconds: float = 6.0) -> Track:
    times = np.arange(0.0, seconds, 0.1)
    return Track(times, np.stack([speed * times, 0.0 * times], axis=1))


@pytest.fixture(scope="module")
def more(library):
    return library.with_synthetic_clips


def made(library, begins: str = ""):
    return [clip for clip in library.clips if clip.path.startswith(SYNTHETIC_FOLDER + begins) and not clip.mirrored]


def test_gaps_are_what_the_warp_does_not_reach():
    speed = np.repeat([1.2, 1.4, 4.0], 100)
    (low, high), (above, top) = find_speed_gaps(speed, 30.0)
    assert low == pytest.approx(1.4 * 1.125, rel=0.04) and high == pytest.approx(4.0 * 0.875, rel=0.04)
    assert above == pytest.approx(4.0 * 1.125, rel=0.04) and top == MAX_SPEED


def test_a_second_of_recording_is_not_enough_to_fill_a_gap():
    assert len(find_speed_gaps(np.r_[np.full(300, 1.5), np.full(30, 2.2), np.full(300, 3.0)], 30.0)) == 2


@pytest.mark.parametrize("speed", [np.zeros(100), np.linspace(7.0, 9.0, 30)])
def test_where_too_little_is_recorded_at_any_speed_all_is_one_gap(speed):
    (low, high), = find_speed_gaps(speed, 30.0)
    assert low < 0.7 and high == MAX_SPEED


def test_made_clips_fill_the_gaps_up_to_a_sprint(library, more):
    speed = np.concatenate([more.frames.speed[more.frames.clip == i] for i, c in enumerate(more.clips)
                            if c.is_synthetic])
    for low, high in library.coverage.speed_gaps:
        for wanted in np.linspace(low, min(high, 9.0), 9):
            assert np.sum(np.abs(np.log(speed / wanted)) < 0.12) > 10
    assert made(more, BLEND_PREFIX) and made(more, KICK_PREFIX)


def test_made_clips_stand_on_the_ground_and_do_not_slide(more):
    body = identify_joints(more.skeleton)
    for clip in made(more):
        toes = forward_kinematics(clip.motion)[0][:, [body.left.toe, body.right.toe]]
        stands = clip.heel_toe_contacts[1:, :, 1] & clip.heel_toe_contacts[:-1, :, 1]
        slide = np.linalg.norm(np.diff(toes[..., :2], axis=0), axis=-1)[stands] * clip.motion.fps
        assert slide.mean() < 0.08, clip.path
        assert abs(np.percentile(toes[..., 2], 2)) < 0.003 and toes[..., 2].min() > -0.02, clip.path


def test_gaits_change_where_the_recordings_change_them(library, more):
    assert [gait.label for gait in library.gaits] == [gait.label for gait in more.gaits[: len(library.gaits)]]
    changes = more.gait_thresholds[: len(library.gait_thresholds)]
    assert changes == pytest.approx(library.gait_thresholds, abs=0.25)


def test_gaits_without_a_recording_are_completed_on_both_sides():
    words, changes = complete_gaits({"jogging": 2.6, "running": 4.4}, np.array([3.7]))
    assert words == ("walking", "jogging", "running", "sprinting")
    assert 1.2 < changes[0] < 2.6 and changes[1] == 3.7 and 4.4 < changes[2] < 7.3


def test_the_recordings_come_first_and_unchanged(library, more):
    count = len(library.frames)
    assert more.clips[: len(library.clips)] == library.clips
    assert np.array_equal(more.frames.features[:count], library.frames.features)
    for column, word in enumerate(library.frames.vocabulary):
        there = more.frames.vocabulary.index(word)
        assert np.array_equal(more.frames.words[:count, there], library.frames.words[:, column])


def test_kept_beside_the_cache_and_read_back_the_same(library, more):
    place = library.cache_location[0]
    assert (place / "made.json").is_file() and list((place / "made-gait").glob("*.bvh"))
    again = build_library(library.folder, cache_dir=place).with_synthetic_clips
    here = list_frame_arrays(more.frames)
    for name, values in list_frame_arrays(again.frames).items():
        assert np.array_equal(values, here[name]) and values.dtype == here[name].dtype, name
        assert isinstance(values, np.memmap) or isinstance(values.base, np.memmap), "read where they are used"
    assert again.frames.vocabulary == more.frames.vocabulary
    assert all(np.array_equal(a.heel_toe_contacts, b.heel_toe_contacts) for a, b in zip(again.clips, more.clips))


def test_what_was_computed_from_a_library_goes_when_it_is_built_from_scratch(library, more, tmp_path, monkeypatch):
    """Under the same key: the cache seemed wrong. Without synthetic runs, half of the work of completing a library."""
    monkeypatch.setattr(synthetic_clips, "MAX_SPEED", 2.4)
    place = shutil.copytree(library.cache_location[0], tmp_path / "cache")
    (place / "notes.json").write_text("[1]", "utf-8")
    jerk = features.compute_max_jerk
    monkeypatch.setattr(features, "compute_max_jerk", lambda *order: 2.0 * jerk(*order))
    again = build_library(library.folder, cache_dir=place, rebuild=True)
    assert np.array_equal(again.frames.jerk, 2.0 * library.frames.jerk)
    assert np.array_equal(again.with_synthetic_clips.frames.jerk[: len(again.frames)], again.frames.jerk)
    assert (place / "notes.json").is_file()


def test_made_files_that_were_tidied_away_are_written_again(library, more, tmp_path):
    """In a copy: other processes use the cache."""
    place = shutil.copytree(library.cache_location[0], tmp_path / "cache")
    before = {file.name: file.read_bytes() for file in (place / "made-gait").glob("*.bvh")}
    next((place / "made-gait").glob("*.bvh")).unlink()
    assert len(build_library(library.folder, cache_dir=place).with_synthetic_clips.clips) == len(more.clips)
    assert {file.name: file.read_bytes() for file in (place / "made-gait").glob("*.bvh")} == before


def test_a_track_at_a_recorded_speed_uses_recordings_only(library):
    take = synthesize(library, Plan(track=straight(1.4)))
    assert not any(name.startswith(SYNTHETIC_FOLDER) for name in take.clips)


def test_a_track_between_two_recordings_is_played_by_a_blend(library):
    (low, high), *_ = library.coverage.speed_gaps
    plan = Plan(track=straight(np.sqrt(low * high)))
    take = synthesize(library, plan)
    assert any(name.startswith(SYNTHETIC_FOLDER + BLEND_PREFIX) for name in take.clips)
    without = synthesize(library, replace(plan, made=False))
    assert not any(name.startswith(SYNTHETIC_FOLDER) for name in without.clips)


def test_a_track_beyond_the_recordings_is_played_by_made_running_and_told(library):
    take = synthesize(library, Plan(track=straight(min(1.5 * library.max_speed, 9.0))))
    assert any(name.startswith(SYNTHETIC_FOLDER) for name in take.clips)
    assert any("synthetic" in warning for warning in take.warnings)


def test_a_kick_in_a_sprint_is_made(library):
    timeline = Timeline(keys=(KeyMoment(3.0, ("kick", "right")),))
    take = synthesize(library, Plan(track=straight(7.0), timeline=timeline))
    (key,) = take.keys
    assert key.clip.startswith(SYNTHETIC_FOLDER + KICK_PREFIX)
    assert {"kick", "right", "inside"} <= set(key.words) and key.used_instead is None
    assert key.frame == pytest.approx(3.0 * take.motion.fps, abs=0.51)


@pytest.fixture(scope="module")
def with_a_receive(tmp_path_factory, clip_file):
    """Walking, running, and one ball that is taken with the right foot, nearly standing."""
    folder = tmp_path_factory.mktemp("receive")
    for name, speed, words in (("stand", 0.0, "standing"), ("walk", 1.4, "walking"), ("run", 4.8, "running")):
        clip_file(folder / f"{name}.bvh", speed, 4.0, words)
    taken = build_reception("inside", speed=1.2)
    bvh.write_bvh(folder / "take.bvh", taken.motion)
    words = "receive right foot low inside"
    (folder / "take.txt").write_text(f"{taken.start:.3f} {taken.end:.3f} {words}\n{taken.key:.3f} {words}\n")
    return build_library(folder)


@pytest.mark.parametrize("speed, is_made", [(1.0, False), (3.5, True), (7.0, True)])
def test_a_ball_taken_on_the_run_is_made_and_no_foot_slides(with_a_receive, speed, is_made):
    timeline = Timeline(keys=(KeyMoment(3.0, ("receive", "foot", "low")),))
    take = synthesize(with_a_receive, Plan(track=straight(speed), timeline=timeline))
    (key,) = take.keys
    assert (describe_action(key.clip) is not None) == is_made and key.used_instead is None
    assert key.frame == pytest.approx(3.0 * take.motion.fps, abs=0.51)
    assert any("synthetic reception" in line for line in take.warnings) == is_made
    body, places = identify_joints(take.motion.skeleton), forward_kinematics(take.motion)[0]
    toes = places[:, [body.left.toe, body.right.toe]]
    assert measure_stance_travel(toes, list_stances(take.contacts)).max(initial=0.0) < 0.15


@pytest.mark.parametrize("height, side, part", [(0.11, 0.5, None), (0.6, 0.2, "instep"), (0.9, 0.2, "thigh")])
def test_the_ball_decides_between_a_recorded_reception_and_synthetic_ones(with_a_receive, height, side, part):
    track = straight(1.2)
    ball = np.column_stack([track.positions + [0.5, side], np.full(len(track.times), height)])
    track = replace(track, ball=ball, ball_height_known=np.ones(len(ball), bool))
    timeline = Timeline(keys=(KeyMoment(3.0, ("receive",)),))
    take = synthesize(with_a_receive, Plan(track=track, timeline=timeline))
    (key,) = take.keys
    assert part in (describe_action(key.clip) or "") if part else describe_action(key.clip) is None
    assert ("left" if side > 0.3 else "receive") in key.words


def test_made_kicks_stand_in_for_the_same_foot_only():
    left, right = (Key(0, 1.0, 0.0, 2.0, frozenset({"kick", side, "standing", "low"})) for side in ("left", "right"))
    running = Key(1, 1.0, 0.0, 2.0, frozenset({"kick", "right", "low", "running"}))
    assert select_substitutes((left,), (running,), ("kick",)) == ()
    assert select_substitutes((left, right), (running,), ("kick", "low")) == (running,)


def test_made_kicks_do_not_stand_in_for_words_that_only_recorded_ones_have():
    high = Key(0, 1.0, 0.0, 2.0, frozenset({"kick", "right", "high"}))
    running = Key(1, 1.0, 0.0, 2.0, frozenset({"kick", "right", "low", "running"}))
    assert select_substitutes((high,), (running,), ("kick", "high")) == ()
    assert select_substitutes((high,), (running,), ("kick", "volley")) == (running,)
