"""The ball of a reception: it stays with the part that gives, then rolls on along its course."""

import numpy as np
import pytest

from beyond_mocap.annotation.ball_contact import build_surfaces, measure_contact_gap
from beyond_mocap.annotation.striking import BALL_RADIUS
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthesis.construct.ball_touch.touch_frames import Touch
from beyond_mocap.synthesis.construct.give import ROLL_SECONDS, give_with_ball
from beyond_mocap.synthesis.construct.strike import strike_ball
from beyond_mocap.synthetic.actions.receptions import RECEPTIONS, build_reception

FPS = 60.0


def arrive(kind, speed=0.0, leaving=2.0):
    """A reception, and a ball that comes at 8 m/s, meets the part at the key frame and leaves slowly ahead."""
    move = build_reception(kind, fps=FPS, speed=speed)
    words = (*RECEPTIONS[kind].labels, "right")
    places, rotations = forward_kinematics(move.motion)
    surface = build_surfaces(move.motion.skeleton, words)[0]
    key = int(round(move.key * FPS))
    middle = np.mean(surface.compute_line(places[key], rotations[key]), axis=0)
    met = middle + [surface.radius + BALL_RADIUS, 0.0, 0.0]
    seconds = (np.arange(len(places)) - key) / FPS
    along = np.where(seconds < 0.0, -8.0, leaving) * seconds
    ball = np.tile([met[0], met[1], max(met[2], BALL_RADIUS)], (len(along), 1))
    ball[:, 0] += along
    return move.motion, words, key, ball


def give(motion, ball, key, words, until):
    return give_with_ball(motion.skeleton, motion.root_positions, motion.rotations, ball, held=(key, key), words=words,
                          until=until, fps=FPS)


@pytest.mark.parametrize("kind", ["inside", "thigh", "chest"])
def test_a_taken_ball_loses_its_speed_on_the_part_and_is_back_on_its_course(kind):
    motion, words, key, ball = arrive(kind)
    led = give(motion, ball, key, words, len(ball))
    back = key + int(ROLL_SECONDS * FPS)
    np.testing.assert_array_equal(led[: key + 1], ball[: key + 1])
    np.testing.assert_array_equal(led[back:], ball[back:])
    speed = np.linalg.norm(np.diff(led, axis=0), axis=1) * FPS
    assert speed[key - 2] == pytest.approx(8.0, abs=0.01) and speed[key : key + 3].max() < 2.0
    assert speed[key:].max() < 4.5
    places, rotations = forward_kinematics(motion)
    gaps = measure_contact_gap(motion.skeleton, places, rotations, words, led)
    assert np.abs(gaps[key : key + 4]).max() < 0.05


def test_a_kicked_ball_and_one_that_is_missed_are_left_alone():
    motion, words, key, ball = arrive("inside")
    assert give(motion, ball, key, ("kick", "right"), len(ball)) is ball
    missed = ball + [0.0, 0.5, 0.0]
    assert give(motion, missed, key, words, len(ball)) is missed


def test_the_next_touch_ends_it():
    motion, words, key, ball = arrive("inside")
    led = give(motion, ball, key, words, key + 6)
    np.testing.assert_array_equal(led[key + 6 :], ball[key + 6 :])
    assert not np.array_equal(led[key + 3], ball[key + 3])


@pytest.mark.parametrize("off", [(0.0, 0.0, 0.0), (0.05, 0.0, 0.03), (-0.04, 0.03, -0.03)])
def test_a_thigh_reaches_a_ball_that_is_a_little_off(off):
    motion, words, key, ball = arrive("thigh")
    ball = ball + np.array([-0.09, 0.0, 0.15]) + off
    touch = Touch(key, words, 30.0, 30.0)
    met = strike_ball(motion.skeleton, motion.root_positions, motion.rotations, np.ones((len(ball), 2), bool), ball,
                      [touch], FPS)
    assert met.gap[0] < 0.005
    far = np.r_[0 : key - 40, key + 40 : len(ball)]
    np.testing.assert_array_equal(met.rotations[far], motion.rotations[far])
    np.testing.assert_array_equal(met.root[far], motion.root_positions[far])
