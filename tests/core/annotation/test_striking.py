"""A ball at a known distance from the striking part."""

import numpy as np
import pytest

from beyond_mocap.annotation.ball_contact import find_contact_window, find_striking_part, measure_contact_gap
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import compute_pose
from beyond_mocap.motion.quaternion import identity
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton

SKELETON = build_adult_skeleton()
BODY = identify_joints(SKELETON)
JOINTS, TURNS = compute_pose(SKELETON, np.array([0.0, 0.0, 0.95]), identity(len(SKELETON)))
TIPS = JOINTS[list(SKELETON.end_parents)] + SKELETON.end_offsets


def gap(words, ball):
    return measure_contact_gap(SKELETON, JOINTS, TURNS, words.split(), np.asarray(ball))


@pytest.mark.parametrize(
    "words, part",
    [
        ("kick right low inside", "foot"),
        ("running receive foot", "foot"),
        ("receive body high", "chest"),
        ("header standing", "head"),
        ("throwb high", "hand"),
        ("catchb slide", "hand"),
        ("walking front", None),
    ],
)
def test_words_name_the_part(words, part):
    assert find_striking_part(words.split()) == part


@pytest.mark.parametrize("distance", [-0.02, 0.0, 0.005, 0.3])
def test_gap_of_the_foot_that_is_asked_for(distance):
    foot, toe = JOINTS[BODY.right.foot], JOINTS[BODY.right.toe]
    ball = 0.5 * (foot + toe) + [0.0, -(0.05 + 0.11 + distance), 0.0]
    assert gap("kick right", ball) == pytest.approx(distance, abs=1e-9)
    assert gap("kick left", ball) > distance + 0.1
    assert gap("kick", ball) == pytest.approx(distance, abs=1e-9)


def test_the_foot_ends_at_its_toe():
    toe = JOINTS[BODY.left.toe]
    ahead = np.array([1.0, 0.0, 0.0])
    assert gap("kick left", toe + 0.5 * ahead) == pytest.approx(0.5 - 0.16, abs=1e-6)


def test_head_chest_and_hands():
    head = 0.5 * (JOINTS[BODY.head] + TIPS[list(SKELETON.end_parents).index(BODY.head)])
    assert gap("header", head + [0.31, 0, 0]) == pytest.approx(0.10)
    assert gap("receive body", JOINTS[BODY.chest] + [0.33, 0, 0]) == pytest.approx(0.10)
    assert gap("throwb right", JOINTS[BODY.right.hand] + [0.26, 0, 0]) == pytest.approx(0.10)
    assert np.isnan(gap("walking", [0, 0, 0]))


def test_either_hand_serves_a_dive_whose_side_is_where_it_goes():
    wrist = JOINTS[BODY.left.hand]
    ball = wrist + [0.3, 0.0, 0.0]
    assert gap("dive left", ball) == pytest.approx(gap("dive right", ball)) == pytest.approx(0.3 - 0.05 - 0.11)
    assert gap("catchb left", ball) < gap("catchb right", ball)


@pytest.mark.parametrize(
    "words, later", [("jump left high dive", True), ("catchb dive", True), ("catchb high", False),
                     ("kick slide", False)]
)
def test_only_a_dive_by_hand_may_meet_the_ball_after_its_key(words, later):
    assert (find_contact_window(words.split()) > 0.0) == later
