"""Planted courses of the ball: key moments go where it is touched, the body meets it there, and it keeps its course."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.annotation import KeyMoment, Timeline
from beyond_mocap.evaluation.report import evaluate
from beyond_mocap.motion.track import BALL_RADIUS, Track, sample_track
from beyond_mocap.synthesis.plan import Plan, PlayerTouch, SolvedTrajectory
from beyond_mocap.synthesis.resolved_touches import MAX_TOUCH_OFFSET, resolve_touches
from beyond_mocap.synthesis.resynthesize import resynthesize
from beyond_mocap.synthesis.synthesize import synthesize

KICKED = 5.062
KICK = "kick low inside right"


def course_of(track, at=KICKED, side=0.0) -> SolvedTrajectory:
    """A ball that comes to meet the player, is kicked on 0.45 m before him at second `at`, and rolls from 12 m/s."""
    times = np.union1d(np.linspace(track.times[0], track.times[-1], 2001), [at])
    place = [np.interp(at, track.times, track.positions[:, axis]) for axis in (0, 1)]
    since = (times - at)[:, None]
    way = np.where(since < 0, since * [-3.0, 0.5], since * [12.0, 2.0] * (1.0 - 0.02 * since))
    ball = np.column_stack([place + np.array([0.45, side]) + way, np.full(len(times), BALL_RADIUS)])
    return SolvedTrajectory(times, ball, np.zeros(len(times), bool), (PlayerTouch(at, True, "foot", "kick"),))


@pytest.fixture(scope="module")
def planted(track_of):
    """planted(*lines, course=None, **plan) -> Plan with the course as its solution, and as the track's samples."""

    def make(timeline, course=None, **more):
        bare = track_of(2.8, seconds=10.0)
        course = course or course_of(bare)
        ball, _ = course.interpolate(bare.times)
        return Plan(Track(bare.times, bare.positions, ball), timeline, solved=course, **more)

    return make


@pytest.fixture(scope="module")
def kicked(library, planted, timeline_of):
    return synthesize(library, planted(timeline_of((5.3, KICK))))


def test_a_key_moment_is_played_at_the_solved_touch(kicked, library):
    report = evaluate(kicked, kicked.plan.track, library)
    key = report["keys"][0]
    assert key["time_s"] == 5.3 and key["solved_time_s"] == pytest.approx(KICKED)
    assert abs(key["time_error_s"]) < 0.5 / 30.0 and key["contact_gap_m"] < 0.005
    assert kicked.keys[0].frame == pytest.approx(KICKED * 30.0, abs=0.5)
    assert kicked.plan.timeline.keys[0].solved is None  # what was asked stays as it was asked


def test_the_ball_keeps_its_course_but_for_an_even_change_of_velocity(kicked):
    course, _ = kicked.solved.interpolate(kicked.ball.times)
    off = (kicked.ball.positions - course)[:, :2]
    frame = int(np.floor(kicked.keys[0].frame))
    before, after = off[: frame + 1], off[frame + 1 :]
    assert np.linalg.norm(off, axis=1).max() <= 0.45
    assert np.abs(np.diff(before, 2, axis=0)[frame - 29 : -1]).max(initial=0.0) < 1e-9
    assert np.abs(np.diff(after, 2, axis=0)[1:28]).max(initial=0.0) < 1e-9
    assert np.allclose(kicked.ball.positions[:, 2], BALL_RADIUS)


def test_takes_without_solved_touches_know_nothing_of_it(library, planted, timeline_of):
    plan = planted(timeline_of((5.3, KICK)))
    plain = synthesize(library, replace(plan, solve_touches=False, solved=None))
    assert plain.keys[0].frame == pytest.approx(5.3 * 30.0, abs=0.5)
    assert plain.solved is None and not plain.dribble_touches and "dribbles" not in evaluate(plain, plan.track, library)


@pytest.mark.parametrize(
    "asked, touches, times",
    [
        ([(5.0, KICK)], [(5.1, True, "foot", "kick")], [5.1]),
        ([(5.0, KICK)], [(5.0 + MAX_TOUCH_OFFSET + 0.01, True, "foot", "kick")], [None]),
        ([(5.0, KICK)], [(4.9, True, "foot", "receive"), (5.15, True, "foot", "kick")], [5.15]),
        ([(5.0, "header")], [(5.0, True, "foot", "kick"), (5.1, True, "head", "header")], [5.1]),
        ([(5.0, KICK)], [(5.0, False, "foot", "kick"), (5.3, True, "foot", "kick")], [5.3]),
        ([(5.0, KICK)], [(5.0, None, "foot", "kick")], [5.0]),
        ([(5.0, "receive foot"), (5.2, KICK)], [(5.05, True, "foot", "kick")], [None, 5.05]),
        (
            [(5.0, "receive foot"), (5.4, KICK)],
            [(5.1, True, "foot", "receive"), (5.3, True, "foot", "kick")],
            [5.1, 5.3],
        ),
        ([(5.0, "header")], [(5.2, True, "", "kick")], [5.2]),
        ([(5.0, "celebration")], [(5.0, True, "foot", "kick")], [None]),
        ([(5.0, KICK), (5.0, KICK)], [(5.1, True, "foot", "kick")], [None, None]),
        ([], [(5.0, True, "foot", "kick")], []),
    ],
)
def test_touches_go_to_the_key_moments_that_they_suit(planted, asked, touches, times):
    keys = tuple(KeyMoment(time, tuple(words.split())) for time, words in asked)
    plan = planted(Timeline((), keys))
    course = replace(plan.solved, touches=tuple(PlayerTouch(*touch) for touch in touches))
    assert [key.solved for key in resolve_touches(replace(plan, solved=course)).timeline.keys] == times


def test_a_key_moment_without_a_touch_stays_and_is_told(library, planted, timeline_of):
    take = synthesize(library, planted(timeline_of((3.0, KICK))))
    assert take.keys[0].frame == pytest.approx(90.0, abs=0.5)
    assert any("3 s" in line and "no touch" in line for line in take.warnings)


@pytest.mark.parametrize("seen", [0, 1, 5])
def test_a_track_without_a_ball_is_told(library, track_of, timeline_of, seen):
    bare = track_of()
    ball = np.full((len(bare), 3), np.nan)
    ball[:: len(bare) // max(seen, 1)][:seen] = [1.0, 0.0, BALL_RADIUS]  # too far apart, if several
    track = Track(bare.times, bare.positions, ball)
    take = synthesize(library, Plan(track, timeline_of((3.0, KICK))))
    assert any("no ball" in line for line in take.warnings) and take.solved is None


def test_a_course_is_left_alone_where_touches_are_not_to_be_solved(planted, timeline_of):
    plan = replace(planted(timeline_of((5.3, KICK))), solve_touches=False)
    assert resolve_touches(plan).solved is None and resolve_touches(plan).timeline == plan.timeline


def test_solved_from_the_samples_of_a_track(library, planted, timeline_of):
    take = synthesize(library, replace(planted(timeline_of((5.2, KICK))), solved=None))
    assert take.keys[0].requested.solved == pytest.approx(KICKED, abs=0.03)
    assert evaluate(take, take.plan.track, library)["keys"][0]["contact_gap_m"] < 0.005


def test_in_a_dribble_the_ball_is_touched_step_by_step(library, planted, timeline_of, track_of):
    bare = track_of(2.8, seconds=10.0)
    swaying = bare.positions + 0.25 * np.sin(4.0 * bare.times)[:, None]
    lying = np.column_stack([swaying, np.full(len(bare), BALL_RADIUS)])
    course = SolvedTrajectory(bare.times, lying, np.zeros(len(bare), bool))
    plan = planted(timeline_of((2.0, 8.0, "dribble")), course=course)
    take = synthesize(library, plan)
    told = evaluate(take, plan.track, library)["dribbles"]
    assert len(told) >= 5 and max(one["contact_gap_m"] for one in told) < 0.005
    assert 2.0 <= told[0]["time_s"] < 3.0 and 7.0 < told[-1]["time_s"] <= 8.0
    ahead = take.ball.positions[:, 0] - sample_track(plan.track, 30.0).raw[:, 0]
    assert ahead[75:220].min() > 0.1
    assert not any("no foot touches" in line for line in take.warnings)


def test_a_dribble_without_a_touch_is_told(library, planted, timeline_of):
    take = synthesize(library, planted(timeline_of((5.0, 5.15, "dribble"))))
    assert not take.dribble_touches
    assert any(line.startswith("5-5.15 s: no foot touches the ball") for line in take.warnings)


def test_players_of_another_height_meet_it_too(library, planted, timeline_of):
    take = synthesize(library, planted(timeline_of((5.3, KICK)), height=1.95))
    key = evaluate(take, take.plan.track, library)["keys"][0]
    assert key["contact_gap_m"] < 0.005 and key["solved_time_s"] == pytest.approx(KICKED)


def changed(before, after):
    return np.any(before.motion.rotations != after.motion.rotations, axis=(1, 2))


def test_an_edit_makes_anew_what_it_touches(library, kicked, timeline_of):
    same = resynthesize(library, kicked.plan, kicked)
    assert not changed(kicked, same).any() and np.array_equal(same.ball.positions, kicked.ball.positions)
    assert same.keys == kicked.keys
    # asked a little earlier, the same touch is meant: nothing moves
    earlier = resynthesize(library, replace(kicked.plan, timeline=timeline_of((5.2, KICK))), kicked)
    assert not changed(kicked, earlier).any() and earlier.keys[0].requested.time == 5.2
    # other words later on
    words = timeline_of((5.3, KICK), (8.5, 9.5, "walking"))
    walks = resynthesize(library, replace(kicked.plan, timeline=words), kicked)
    assert changed(kicked, walks).any() and not changed(kicked, walks)[:190].any()
    assert np.array_equal(walks.ball.positions, kicked.ball.positions)
    # another touch
    old = kicked.plan.track
    course = course_of(old, at=5.5)
    track = Track(old.times, old.positions, course.interpolate(old.times)[0])
    later = resynthesize(library, replace(kicked.plan, track=track, solved=course), kicked)
    assert later.keys[0].frame == pytest.approx(165.0, abs=0.5) and changed(kicked, later).any()
    assert evaluate(later, track, library)["keys"][0]["contact_gap_m"] < 0.005


def test_a_ball_at_the_player_s_own_place_is_dribbled_and_told(library, track_of, timeline_of):
    bare = track_of(2.8, seconds=10.0)
    since = np.maximum(bare.times - 8.0, 0.0)
    away = (since * (9.0 - since) + 0.03 * np.sin(40.0 * since))[:, None] * [1.0, 0.2]
    ball = np.column_stack([bare.positions + away, np.full(len(bare), np.nan)])
    plan = Plan(Track(bare.times, bare.positions, ball), timeline_of((8.0, KICK)))
    take = synthesize(library, plan)
    line, = (line for line in take.warnings if "own place" in line)
    (first, last), = line.spans
    assert first == pytest.approx(0.0, abs=0.1) and last == pytest.approx(8.0, abs=0.1)
    during = (take.ball.times > 1.0) & (take.ball.times < 7.0)
    assert not take.ball.measured[during].any() and take.ball.measured[take.ball.times > 8.5].any()
    told = evaluate(take, plan.track, library)["dribbles"]
    assert len(told) >= 6 and max(one["contact_gap_m"] for one in told) < 0.005
    ahead = take.ball.positions[:, 0] - sample_track(plan.track, 30.0).raw[:, 0]
    assert ahead[during].min() > 0.1 and ahead[during].max() < 2.0
    plain = synthesize(library, replace(plan, solve_touches=False))
    assert not any("own place" in line for line in plain.warnings) and plain.ball.measured[during].all()


@pytest.mark.parametrize("place", [None, (0.0, 0.0, BALL_RADIUS), (40.0, 5.0, np.nan)])
def test_a_ball_that_is_unknown_or_never_moves_does_no_harm(library, track_of, timeline_of, place):
    bare = track_of()
    ball = None if place is None else np.tile(place, (len(bare), 1))
    track, words = Track(bare.times, bare.positions, ball), timeline_of((3.0, KICK))
    take = synthesize(library, Plan(track, words))
    plain = synthesize(library, Plan(track, words, solve_touches=False))
    assert np.isfinite(take.motion.rotations).all()
    assert len([line for line in take.warnings if "touch" in line]) - len(
        [line for line in plain.warnings if "touch" in line]) == 1
    if place is None:
        assert np.array_equal(take.motion.rotations, plain.motion.rotations)


def test_without_a_ball_and_without_labels_nothing_is_told(library, track_of, timeline_of):
    assert not any("touches" in line for line in synthesize(library, Plan(track_of(), timeline_of())).warnings)
