"""What is one player's own: pins, height, strong foot and style, in the whole recipe and in edits."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.evaluation.report import evaluate
from beyond_mocap.library.build import build_library
from beyond_mocap.motion.humanoid import estimate_stature, identify_joints
from beyond_mocap.motion.mass import compute_centre_of_mass
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.supports import GRAVITY, find_stances, find_support_phases
from beyond_mocap.synthesis.plan import METHODS, Pin, Plan
from beyond_mocap.synthesis.resynthesize import resynthesize
from beyond_mocap.synthesis.search.preferences import matches_pattern
from beyond_mocap.synthesis.synthesize import synthesize


@pytest.fixture(scope="module")
def track(track_of):
    return track_of(2.0, seconds=12.0, turn=lambda t: 0.5 * np.sin(0.4 * t), ball=True)


@pytest.fixture(scope="module")
def take(library, track, timeline_of):
    return synthesize(library, Plan(track=track, timeline=timeline_of((5.0, "kick right"))))


def same(a, b):
    motions = a.motion, b.motion
    return all(np.array_equal(*(getattr(m, name) for m in motions)) for name in ("root_positions", "rotations"))


def pin_near(take, seconds, away=(0.1, 0.0, 0.25)):
    hand = identify_joints(take.motion.skeleton).left.hand
    place = forward_kinematics(take.motion)[0][round((seconds - take.start_time) * take.motion.fps), hand]
    return Pin(seconds, "left_hand", tuple(place + away))


@pytest.mark.parametrize("height", [0.0, 1.6])
def test_pins_come_and_go_and_are_the_same_by_every_way(library, track, take, timeline_of, height):
    plan = replace(take.plan, height=height)
    plain = take if not height else synthesize(library, plan)
    pinned = resynthesize(library, replace(plan, pins=(pin_near(plain, 9.0),)), plain)
    assert pinned.pins[0].miss < 0.005 and not same(pinned, plain)
    assert same(pinned, synthesize(library, pinned.plan))
    assert same(resynthesize(library, plan, pinned), plain)
    later = replace(pinned.plan, timeline=timeline_of((4.6, "kick right")))
    edited = resynthesize(library, later, pinned)
    assert same(
        resynthesize(library, replace(later, pins=()), edited), resynthesize(library, replace(later, pins=()), plain)
    )
    assert np.array_equal(edited.motion.rotations[-60:], pinned.motion.rotations[-60:])
    assert np.array_equal(edited.motion.root_positions[-60:], pinned.motion.root_positions[-60:])


def test_a_pin_out_of_reach_is_told_and_reported(library, track, take):
    found = resynthesize(
        library, replace(take.plan, pins=(pin_near(take, 9.0, (0.0, 0.0, 2.0)), Pin(99, "gaze", (0, 0, 1)))), take
    )
    assert any("9 s: the pin of left_hand is out of reach by" in line for line in found.warnings)
    assert any("99 s: the pin of gaze is outside the track" in line for line in found.warnings)
    report = evaluate(found, track, library)
    assert report["pins"][0]["miss"] > 0.5 and report["pins"][1]["miss"] is None and "pins" not in evaluate(take, track,
                                                                                                            library)


def test_small_players_fall_as_fast_as_tall_ones(library, track_of):
    plan = Plan(track=track_of(5.0, seconds=6.0))
    for height in (0.0, 1.45):
        motion = synthesize(library, replace(plan, height=height)).motion
        body, (places, _) = identify_joints(motion.skeleton), forward_kinematics(motion)
        centre, stances = compute_centre_of_mass(body, places), find_stances(motion.skeleton, places, motion.fps)
        phases, at = find_support_phases(stances, centre, motion.fps), np.arange(1, len(motion) - 1)
        flies = np.all([(at <= start - 1.0) | (at >= stop + 1.0) for start, stop in phases], axis=0)
        fall = np.diff(centre[:, 2], 2)[flies] * motion.fps**2
        assert len(fall) > 3 and np.median(fall) == pytest.approx(-GRAVITY, abs=0.4)


@pytest.mark.parametrize("method", ("path", "distance", "blocks"))
@pytest.mark.parametrize("height", [1.6, 2.0])
def test_a_player_is_as_tall_as_asked_and_on_the_track(library, track, timeline_of, method, height):
    plan = Plan(track=track, timeline=timeline_of((5.0, "kick right")), method=method, height=height)
    tall = synthesize(library, plan)
    assert estimate_stature(tall.motion.skeleton) == pytest.approx(height) and tall.plan is plan
    report = evaluate(tall, track, library)
    if method == "path":
        assert report["root_error_m"]["p95"] < 0.01 and report["skate"]["contact_cm_s"] < 8.0
        assert abs(report["keys"][0]["contact_gap_m"]) < 0.01
    assert -0.05 < report["ground_mm"]["min"] / 1000.0 < 0.03
    rest = tall.ball.positions[-1, 2]
    assert rest == pytest.approx(0.11, abs=1e-6)


def test_an_edit_of_a_tall_player_leaves_the_rest_bit_for_bit(library, take, timeline_of):
    before = synthesize(library, replace(take.plan, height=1.95))
    after = resynthesize(library, replace(before.plan, timeline=timeline_of((4.6, "kick right"))), before)
    assert not same(before, after)
    assert np.array_equal(before.motion.root_positions[-60:], after.motion.root_positions[-60:])
    assert np.array_equal(before.motion.rotations[-60:], after.motion.rotations[-60:])


@pytest.mark.parametrize("method", ("path", "distance", "blocks"))
@pytest.mark.parametrize("foot", ["left", "right"])
def test_a_key_moment_without_a_side_takes_the_strong_foot(library, track, timeline_of, method, foot):
    for words, expected in (("kick", foot), ("kick right", "right")):
        plan = Plan(track=track, timeline=timeline_of((5.0, words)), strong_foot=foot, method=method)
        assert expected in synthesize(library, plan).keys[0].words


@pytest.mark.parametrize("method", METHODS)
def test_clips_of_a_style_are_taken_rather_than_others(clip_file, track_of, tmp_path, method):
    clip_file(tmp_path / "a" / "walk.bvh", seconds=6.0, seed=1)
    clip_file(tmp_path / "b" / "walk.bvh", seconds=6.0, seed=2)
    library, track = build_library(tmp_path), track_of(1.4)
    for folder in "ab":
        take = synthesize(library, Plan(track=track, style=(folder,), method=method))
        shown = np.array(take.clips)[take.clip]
        assert np.mean(np.char.startswith(shown, folder)) > 0.9
    with pytest.raises(InputError, match="style: 'c'; expected .+; nearest: a, b, walk"):
        synthesize(library, Plan(track=track, style=("a", "c"), method=method))


def test_folders_clips_and_patterns_name_clips():
    path = "lmd/Player1/P1_kick.bvh"
    assert all(
        matches_pattern(path, name) for name in ("lmd", "LMD/player1", "Player1/", "lmd/*", "P1_kick", "*kick.bvh",
                                                 "p1_*")
    )
    assert not any(matches_pattern(path, name) for name in ("kick", "player", "1", "."))


@pytest.mark.parametrize("wrong", [
    {"height": 0.2}, {"height": 9.0}, {"strong_foot": "both"}, {"style_weight": -1.0},
    {"strength": 1.0}, {"strength": float("nan")}, {"masses": "children"},
])
def test_what_makes_no_sense_is_refused(track, wrong):
    with pytest.raises(InputError):
        Plan(track=track, **wrong)
