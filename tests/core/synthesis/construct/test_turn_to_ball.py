"""A body turns, no more than it must, so that its foot points at the ball."""

import numpy as np
import pytest

from beyond_mocap.annotation.ball_contact import build_surfaces
from beyond_mocap.motion.motion import compute_pose
from beyond_mocap.synthesis.construct.ball_touch.touch_frames import Touch
from beyond_mocap.synthesis.construct.construction import apply_heading
from beyond_mocap.synthesis.construct.turn_to_ball import MAX_TURN_TO_BALL, compute_turn_to_ball
from beyond_mocap.synthetic.gestures import build_strike as made_strike

KICK = made_strike("kick low inside", fps=60.0)
WORDS = frozenset({"kick", "low", "inside", "right"})


def foot_at(rotations, frame):
    places, world = compute_pose(KICK.motion.skeleton, KICK.motion.root_positions, rotations)
    line = build_surfaces(KICK.motion.skeleton, WORDS)[0].compute_line(places[frame], world[frame])
    return np.mean(line, axis=0)


def turn_for(degrees, distance=1.0):
    """The turn for a ball that lies where the foot strikes, but `degrees` further round the hips."""
    frame = int(round(KICK.key * 60.0))
    root = KICK.motion.root_positions
    arm = foot_at(KICK.motion.rotations, frame)[:2] - root[frame, :2]
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    ball = np.tile(
        [*(root[frame, :2] + distance * np.array([c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]])), 0.11],
        (len(root), 1),
    )
    touch = Touch(float(frame), tuple(WORDS), 20.0, 20.0)
    return compute_turn_to_ball(KICK.motion.skeleton, root, KICK.motion.rotations, ball, [touch],
                                60.0), ball[frame], frame


@pytest.mark.parametrize("degrees", [50.0, -50.0, 75.0])
def test_the_foot_comes_near_the_ball(degrees):
    turn, ball, frame = turn_for(degrees)
    before = np.linalg.norm(foot_at(KICK.motion.rotations, frame)[:2] - ball[:2])
    after = np.linalg.norm(foot_at(apply_heading(KICK.motion.rotations, turn), frame)[:2] - ball[:2])
    assert np.sign(turn[frame]) == np.sign(degrees) and after < 0.26 < before
    assert np.argmax(np.abs(turn)) == frame and abs(turn[0]) < 1e-6
    assert np.abs(np.diff(turn, 2)).max() < 0.02


def test_a_ball_near_enough_turns_nobody_and_one_behind_only_so_far():
    assert not np.any(turn_for(5.0)[0])
    assert np.abs(turn_for(170.0)[0]).max() == pytest.approx(MAX_TURN_TO_BALL)


def test_without_a_ball_or_a_foot_nothing_turns():
    frame = int(round(KICK.key * 60.0))
    root, rotations, skeleton = KICK.motion.root_positions, KICK.motion.rotations, KICK.motion.skeleton
    ball = np.full((len(root), 3), 1.0)
    for words, path in ((tuple(WORDS), np.full((len(root), 3), np.nan)), (("header",), ball)):
        assert not np.any(
            compute_turn_to_ball(skeleton, root, rotations, path, [Touch(float(frame), words, 20.0, 20.0)], 60.0)
        )


def hands_at(frame):
    places, world = compute_pose(KICK.motion.skeleton, KICK.motion.root_positions, KICK.motion.rotations)
    hands = build_surfaces(KICK.motion.skeleton, ("catchb",))
    return np.mean([hand.compute_line(places[frame], world[frame])[0] for hand in hands], axis=0)


@pytest.mark.parametrize("words, degrees, turns", [
    (("catchb",), 50.0, 50.0), (("throwb",), -40.0, -40.0), (("catchb",), 3.0, 0.0), (("catchb", "dive"), 50.0, 0.0),
])
def test_the_middle_of_both_hands_points_at_the_ball_but_not_in_a_dive(words, degrees, turns):
    frame, root = int(round(KICK.key * 60.0)), KICK.motion.root_positions
    arm = hands_at(frame)[:2] - root[frame, :2]
    aside, scale = np.radians(degrees), 1.0 / np.linalg.norm(arm)  # a ball 1 m away, farther than hands reach
    turned = [np.cos(aside) * arm[0] - np.sin(aside) * arm[1], np.sin(aside) * arm[0] + np.cos(aside) * arm[1]]
    ball = np.tile([*(root[frame, :2] + scale * np.array(turned)), 1.2], (len(root), 1))
    turn = compute_turn_to_ball(KICK.motion.skeleton, root, KICK.motion.rotations, ball,
                                [Touch(float(frame), words, 20.0, 20.0)], 60.0)
    share = np.clip((np.linalg.norm(arm) - 0.1) / 0.25, 0.0, 1.0)
    assert np.degrees(turn[frame]) == pytest.approx(share * turns, abs=3.5)
