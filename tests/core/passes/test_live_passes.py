"""A rally that is played live: the holder does what the user did, and everything goes on without a jump."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.files.bvh import bvh
from beyond_mocap.motion.humanoid import compute_heading
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.quaternion import wrap_angle
from beyond_mocap.passes.answers_ahead import MOST_ANSWERS, AnswersAhead
from beyond_mocap.passes.hits import detect_hit_under_way, detect_hits
from beyond_mocap.passes.live_passes import BLEND_SECONDS, build_answer, collect_means, start_rally
from beyond_mocap.passes.live_watchers import add_watchers, build_watchers
from beyond_mocap.passes.scene_json import SAMPLES, parse_scene

CLIPS = Path(__file__).resolve().parents[3] / "sample_blend" / "passes" / "library"


@pytest.fixture(scope="module")
def library(strikes_library):
    return strikes_library


@pytest.fixture(scope="module")
def rally(library):
    return start_rally(library, parse_scene(SAMPLES["three"]), "Ann")


def hit_of(name, side="right"):
    return detect_hits(bvh.read_bvh(CLIPS / f"{name}.bvh").motion, "foot", side).strongest


@pytest.fixture(scope="module")
def passed(library, rally):
    """A pass to Cho at 2 s, then a toss to Ben."""
    first = build_answer(library, rally, hit_of("volley_pass"), "Cho")
    after = rally.add_pass(first, 2.0)
    second = build_answer(library, after, hit_of("volley_toss"), "Ben", bounces=1)
    return first, after, second, after.add_pass(second, after.ready_time + 0.5)


def test_they_stand_where_the_scene_says_and_the_ball_lies(rally):
    for player in rally.scene.players:
        played = rally.players[player.name]
        np.testing.assert_allclose(played.stance_at(0.0).place, player.place, atol=0.1)
        assert len(played.motion) / played.motion.fps > 60.0
        moved = np.linalg.norm(played.motion.root_positions[:, :2] - player.place, axis=1)
        assert moved.max() < 0.25
        x, y = rally.ball.positions[0, :2] - player.place
        off = wrap_angle(compute_heading(played.motion)[90:] - np.arctan2(y, x))
        assert np.abs(off).max() < 0.2, "they face the ball, also the one at whose feet it lies"
    assert np.ptp(rally.ball.positions, axis=0).max() == 0.0


def test_the_holder_does_the_most_alike_motion(passed):
    first, _, second, _ = passed
    assert (first.giver, first.receiver, first.clip) == ("Ann", "Cho", "volley_pass.bvh")
    assert (second.giver, second.receiver, second.clip) == ("Cho", "Ben", "volley_toss.bvh")


def test_the_ball_comes_to_the_target_and_stays_there(passed):
    _, after, _, end = passed
    for rally, name in ((after, "Cho"), (end, "Ben")):
        assert rally.holder == name
        place = rally.ball.positions[int(np.searchsorted(rally.ball.times, rally.ready_time + 1.0))]
        stands = rally.players[name].stance_at(rally.ready_time + 1.0).place
        assert np.linalg.norm(place[:2] - stands) < 1.5 and place[2] < 0.2
    assert end.passes == 2


def test_nothing_jumps(passed):
    """No joint and no ball between two frames faster than a strike is."""
    _, after, _, end = passed
    for rally in (after, end):
        speeds = np.linalg.norm(np.diff(rally.ball.positions, axis=0), axis=1) / np.diff(rally.ball.times)
        assert speeds.max() < 20.0 and np.diff(rally.ball.times).min() > 0.01
        for played in rally.players.values():
            places, _ = forward_kinematics(played.motion)
            assert np.linalg.norm(np.diff(places, axis=0), axis=2).max() * played.motion.fps < 14.0


def test_players_of_a_long_rally_keep_their_places(library, rally):
    """Each strike carries its player on by most of a metre: without a way back they would meet."""
    for number in range(8):
        receiver = ("Ben", "Ann")[number % 2]
        rally = rally.add_pass(build_answer(library, rally, hit_of("volley_pass"), receiver), rally.ready_time + 0.3)
        stance = rally.stances[receiver]
        assert np.linalg.norm(np.subtract(stance.place, rally.scene.find_player(receiver).place)) < 0.8
    assert (rally.passes, rally.holder) == (8, "Ann")


def test_what_was_done_goes_over_into_the_pass(rally, passed):
    first, after, _, _ = passed
    old, new = rally.players["Ann"].motion, after.players["Ann"].motion
    np.testing.assert_allclose(new.root_positions[:61], old.root_positions[:61], atol=1e-9)
    later = int(BLEND_SECONDS * new.fps) + 1
    piece = first.motions["Ann"]
    np.testing.assert_allclose(new.root_positions[60 + later : 60 + len(piece)], piece.root_positions[later:])
    assert after.players["Ben"] is rally.players["Ben"]


def test_who_has_no_part_watches_the_ball(library, rally):
    """They turn to where it goes without a jump, later where they are planned late; who receives next faces it then."""
    first = build_answer(library, rally, hit_of("volley_pass"), "Ben")
    motions, after = build_watchers(library, rally, first), rally.add_pass(first, 2.0)
    assert motions.keys() == {"Cho"}
    turns = []
    for at in (2.5, 5.0):
        played = add_watchers(after, motions, first, 2.0, at).players["Cho"]
        begin, old = round(at * rally.rate), after.players["Cho"].motion
        np.testing.assert_allclose(played.motion.rotations[:begin], old.rotations[:begin], atol=1e-9)
        heading = np.unwrap(compute_heading(played.motion))
        x, y = after.ball.positions[-1, :2] - played.motion.root_positions[-1, :2]
        assert abs(wrap_angle(heading[-1] - np.arctan2(y, x))) < np.radians(12.0) < abs(heading[-1] - heading[0])
        assert np.abs(np.diff(heading)).max() * rally.rate < np.radians(180.0)
        turns.append(np.flatnonzero(np.abs(heading - heading[0]) > np.radians(20.0))[0] / rally.rate)
    assert turns[0] < turns[1] > 5.0


def test_who_waits_goes_on_standing(passed):
    """Also when the user lets them wait for minutes: they go on to sway, without a jump, where they stand."""
    _, _, _, end = passed
    longer = end.keep_standing().keep_standing()
    assert longer.end > end.end + 119.0 and longer.ball.times[-1] > end.ball.times[-1] + 119.0
    for name, played in longer.players.items():
        old, motion = end.players[name].motion, played.motion
        assert motion.rotations[: len(old)].tobytes() == old.rotations.tobytes()
        steps = np.linalg.norm(np.diff(forward_kinematics(motion)[0], axis=0), axis=2)
        waits = steps[len(old) - 30 :]
        assert 0.0 < waits.max() * motion.fps < 0.6 and np.ptp(motion.root_positions[len(old) :, 0]) < 0.1


def test_what_is_planned_ahead_is_what_is_planned_after_the_strike(library, rally):
    """The same bits, for the user's whole strike and for the little of it that is known as it is done."""
    ahead = AnswersAhead(collect_means(library, rally.scene), rally)
    planned = []
    while (request := ahead.choose_next("foot", "right", ("Ben", "Cho"), 0)) is not None:
        planned.append(request)
        ahead.add(request, request)
    assert 8 <= len(planned) <= MOST_ANSWERS and {one.target for one in planned} == {"Ben", "Cho"}
    clip, whole = bvh.read_bvh(CLIPS / "volley_pass.bvh").motion, hit_of("volley_pass")
    request = next(one for one in planned if one.key == ahead.request_for(whole, "Ben", 0).key)
    ahead.add(request, build_answer(library, rally, request.strike.hit, "Ben"))
    begun = next(hit for now in range(whole.key, len(clip))
                 if (hit := detect_hit_under_way(clip.frames(0, now), "foot", "right")) is not None)
    assert np.isnan(begun.times).any() and (begun.last - whole.key) / clip.fps <= 0.2
    answer = build_answer(library, rally, whole, "Ben")
    for hit in (whole, begun):
        found = ahead.find(ahead.request_for(hit, "Ben", 0))
        assert found.ball.positions.tobytes() == answer.ball.positions.tobytes()
        for name, motion in answer.motions.items():
            assert found.motions[name].rotations.tobytes() == motion.rotations.tobytes()
    assert ahead.find(ahead.request_for(whole, "Ben", 2)) is None


def test_the_left_foot_is_answered_with_the_left(library, rally):
    hit = hit_of("volley_pass")
    left = replace(hit, side="left", vectors=hit.vectors * [1.0, -1.0, 1.0], velocity=hit.velocity * [1.0, -1.0, 1.0])
    piece = build_answer(library, rally, left, "Ben")
    places, _ = forward_kinematics(piece.motions["Ann"])
    feet = [piece.motions["Ann"].skeleton.names.index(name) for name in ("LeftFoot", "RightFoot")]
    frame = round(piece.strike * piece.motions["Ann"].fps)
    heights = places[frame, feet, 2]
    assert heights[0] > heights[1] + 0.05


@pytest.mark.parametrize("target, said", [("Ann", "both passer and receiver"), ("Zoe", "one of Ann")])
def test_a_target_that_is_none(library, rally, target, said):
    with pytest.raises(InputError, match=said):
        build_answer(library, rally, hit_of("volley_pass"), target)


def test_an_unknown_holder(library, rally):
    with pytest.raises(InputError, match="holder"):
        start_rally(library, rally.scene, "Zoe")
