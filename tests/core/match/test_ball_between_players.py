"""The one ball goes from a player's touch to the next one's, and round everybody in between."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.annotation.body_solid import BodySolid, build_solid_surfaces
from beyond_mocap.library.build import build_library
from beyond_mocap.match.displayed_motion import construct_displayed_player
from beyond_mocap.match.match_ball import apply_led_ball, find_led_ball, lead_ball_between_players, sample_ball
from beyond_mocap.match.player_file import read_player
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthesis.construct.ball_touch.touch_frames import compute_contact_frames
from beyond_mocap.synthesis.construct.contact_geometry import BALL_SECONDS
from tests.core.match.small_match import LIBRARY, SECONDS


@pytest.fixture(scope="module")
def kicker(made, sample_cache):
    """A take with a kick that leads the ball, and the last frame at which the ball is at the foot."""
    edit = replace(read_player(made[0] / "home_7.take.npz"), correction=None)
    (take,) = construct_displayed_player(build_library(LIBRARY, cache_dir=sample_cache), edit, None, *SECONDS)
    key = next(key for key in take.keys if "kick" in key.words)
    return take, compute_contact_frames(key.frame, len(take.motion))[1]


def stand_at(take, place, frame):
    """Another player, who stands with the joint nearest in height at a place (3,) m and never meets the ball."""
    root, rotations = (np.repeat(values[frame : frame + 1], len(take.motion), axis=0)
                       for values in (take.motion.root_positions, take.motion.rotations))
    joints = forward_kinematics(take.motion)[0][frame]
    root[:, :2] += (place - joints[np.argmin(np.abs(joints[:, 2] - place[2]))])[:2]
    ball = sample_ball(take.plan, take.ball.times)
    return replace(take, motion=replace(take.motion, root_positions=root, rotations=rotations), keys=(),
                   dribble_touches=(), ball=ball)


def list_led(take):
    return find_led_ball(take, sample_ball(take.plan, take.ball.times))


def lead(takes, led):
    first = round(takes[0].start_time * takes[0].motion.fps)
    balls = [sample_ball(take.plan, take.ball.times) for take in takes]
    out = lead_ball_between_players(takes, [take.motion for take in takes], [first] * len(takes), led, balls)
    return [apply_led_ball(balls[0], first, each).positions for each in (led, out)], out, first


def test_a_ball_goes_round_a_player_who_stands_in_its_way(kicker):
    take, kicked = kicker
    other = stand_at(take, take.ball.positions[kicked + 4], kicked)
    (before, after), *_ = lead([take, other], [list_led(take), list_led(other)])
    solid = BodySolid.from_pose(build_solid_surfaces(other.motion.skeleton), *forward_kinematics(other.motion))
    known = np.flatnonzero(np.isfinite(before).all(axis=1))
    assert solid.measure_gaps(before[known], known).min() < -0.05
    assert solid.measure_gaps(after[known], known).min() > -0.005
    assert np.array_equal(after[kicked], before[kicked])


def test_nobody_moves_the_ball_where_another_player_meets_it(kicker):
    take, kicked = kicker
    other, count = stand_at(take, take.ball.positions[kicked] + [20.0, 0.0, 0.0], kicked), len(take.motion)
    first = round(take.start_time * take.motion.fps)
    led = [list_led(take), (first + np.arange(count), np.tile([0.0, 0.2, 0.0], (count, 1)))]
    _, out, _ = lead([take, other], led)
    moved = out[1][1][:count, 1]
    alone = np.abs(moved - 0.2) < 1e-12
    assert moved[kicked] == 0.0 and 0.0 < moved[kicked + 3] < 0.2
    assert alone.any() and not alone[kicked : kicked + int(BALL_SECONDS * take.motion.fps) - 1].any()
    assert np.array_equal(out[0][1][: len(led[0][1])], led[0][1])
