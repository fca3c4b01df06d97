"""Who loses a duel reaches for the ball, comes near it and does not touch it; the ball rolls on unmoved."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.annotation import KeyMoment, Timeline, check_timeline, format_timeline, parse_timeline
from beyond_mocap.base.errors import InputError
from beyond_mocap.evaluation.report import evaluate
from beyond_mocap.motion.track import BALL_RADIUS, Track
from beyond_mocap.synthesis.construct.near_miss import CLEARANCE, FARTHEST, measure_clearance, miss_ball
from beyond_mocap.synthesis.plan import Plan, PlayerTouch, SolvedTrajectory
from beyond_mocap.synthesis.synthesize import synthesize

TIME, KICK = 5.0, ("kick", "low", "inside", "right")


def course_of(track, side) -> SolvedTrajectory:
    """A ball that an opponent strikes across the player's way at TIME, 0.45 m before them and `side` m to the left."""
    times = np.union1d(np.linspace(track.times[0], track.times[-1], 2001), [TIME])
    place = [np.interp(TIME, track.times, track.positions[:, axis]) for axis in (0, 1)]
    since = (times - TIME)[:, None]
    way = np.where(since < 0, since * [0.5, -3.0], since * [1.0, 9.0])
    ball = np.column_stack([place + np.array([0.45, side]) + way, np.full(len(times), BALL_RADIUS)])
    return SolvedTrajectory(times, ball, np.zeros(len(times), bool), (PlayerTouch(TIME, False, "foot", "kick"),))


@pytest.fixture(scope="module")
def reach(library, track_of):
    """reach(side, avoid=...) -> the take of a player who reaches for such a ball, and its course."""
    def make(side, avoid=("touch",), words=KICK):
        bare = track_of(2.8, seconds=10.0)
        course = course_of(bare, side)
        track = Track(bare.times, bare.positions, course.interpolate(bare.times)[0])
        timeline = Timeline((), (KeyMoment(TIME, words, avoid=avoid),))
        return synthesize(library, Plan(track, timeline, solve_touches=True, solved=course)), course

    return make


@pytest.mark.parametrize("side", [0.0, 0.25])
def test_the_foot_comes_near_and_keeps_clear(reach, side):
    take, _ = reach(side)
    at = round(take.keys[0].frame)
    feet = measure_clearance(take.motion, take.ball.positions, KICK, np.arange(at - 6, at + 7))
    assert feet.min() >= CLEARANCE - 0.002
    assert feet[0, 6] <= FARTHEST + 0.1  # the right foot, at the key moment


def test_the_ball_is_not_moved(reach):
    (take, course), (met, _) = reach(0.1), reach(0.1, avoid=())
    moved, led = (np.abs(one.ball.positions - course.interpolate(one.ball.times)[0]).max(axis=1) for one in (take, met))
    assert moved.max() < 0.002 and led.max() > 0.02


@pytest.mark.parametrize("words", [("letgo",), ("turning", "letgo")])
def test_a_ball_that_is_let_run_is_not_touched_and_not_moved(reach, words):
    take, course = reach(0.1, avoid=(), words=words)
    at = round(take.keys[0].frame)
    clear = measure_clearance(take.motion, take.ball.positions, ("foot",), np.arange(at - 6, at + 7))
    assert clear.min() >= CLEARANCE - 0.002 and take.keys[0].requested.misses_ball
    assert np.abs(take.ball.positions - course.interpolate(take.ball.times)[0]).max() < 0.3
    assert not [line for line in take.warnings if "the ball's trajectory has no touch" in line]


def test_a_miss_is_no_poor_contact_and_no_missing_touch(reach, library):
    take, _ = reach(0.1)
    report = evaluate(take, take.plan.track, library)
    (key,) = report["keys"]
    assert not np.isfinite(key["contact_gap_m"] or np.nan) and key["labels"] == list(KICK)
    assert CLEARANCE - 0.002 <= key["missed_by_m"] <= FARTHEST + 0.1
    assert report["touches"]["fit"]["touches"] == 0
    assert not [line for line in take.warnings if "no touch" in line]


def test_frames_away_from_the_miss_keep_their_bits(reach):
    take, _ = reach(0.1)
    at = round(take.keys[0].frame)
    ball = np.array(take.ball.positions)
    places = take.motion.root_positions[at]
    ball[at - 10 : at + 11] = places * [1.0, 1.0, 0.0] + [0.0, 0.0, BALL_RADIUS]  # under the hips
    moved = miss_ball(take.motion, take.contacts, ball, take.keys)
    far = np.abs(np.arange(len(take.motion)) - at) > 20
    assert np.array_equal(moved.rotations[far], take.motion.rotations[far])
    assert not np.array_equal(moved.rotations, take.motion.rotations)
    plain = tuple(replace(key, requested=replace(key.requested, avoid=())) for key in take.keys)
    assert miss_ball(take.motion, take.contacts, ball, plain) is take.motion


def test_the_text_of_a_miss():
    timeline = parse_timeline("5 tackle right -touch\n")
    assert timeline.keys[0].misses_ball and format_timeline(timeline) == "5 tackle right -touch\n"
    check_timeline(timeline)
    for wrong in ("5 touch\n", "4 6 walking -touch\n"):
        with pytest.raises(InputError, match="'touch' is of recordings only"):
            check_timeline(parse_timeline(wrong))
