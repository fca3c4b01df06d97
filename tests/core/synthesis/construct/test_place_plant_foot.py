"""The plant foot of a kick steps to where plant feet usually stand, without sliding there."""

import numpy as np
import pytest

from beyond_mocap.motion.contacts import detect_contacts
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.mirror import mirror
from beyond_mocap.motion.plant_place import PLANT_AHEAD, PLANT_BESIDE, compute_plant_shift, measure_plant_place
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.motion.retargeting.neutral import build_neutral_stance
from beyond_mocap.synthesis.construct.move_body_part import Body
from beyond_mocap.synthesis.construct.place_plant_foot import MAX_PLANT_SHIFT, compute_step_shift, place_plant_foot
from beyond_mocap.synthetic.running_kicks import build_running_kick, build_swing

FPS = 60.0
NEUTRAL = build_neutral_stance(build_adult_skeleton())
HUMAN = identify_joints(NEUTRAL.skeleton)


@pytest.fixture(scope="module", params=["right", "left"])
def kick(request):
    """Side, body, frame of the contact, and where the plant foot stands."""
    gesture = build_running_kick(build_swing("instep", NEUTRAL), 3.5, NEUTRAL, fps=FPS)
    motion = gesture.motion if request.param == "right" else mirror(gesture.motion)
    at, plant = int(round(gesture.key * FPS)), 0 if request.param == "right" else 1
    body = Body.from_pose(motion.skeleton, motion.root_positions, motion.rotations)
    return request.param, body, at, detect_contacts(motion)[:, plant]


def plant_ankle(body: Body, side: str) -> np.ndarray:
    return body.places[:, (HUMAN.left if side == "right" else HUMAN.right).foot]


def test_the_foot_stands_elsewhere_and_the_body_stays(kick):
    side, body, at, standing = kick
    shift = np.array([-0.08, 0.05, 0.0])
    moved = place_plant_foot(body, shift, side, at, standing, FPS)
    steps = plant_ankle(moved, side) - plant_ankle(body, side)
    stance = [first for first in np.flatnonzero(standing) if abs(first - at) < 0.1 * FPS]
    np.testing.assert_allclose(steps[stance], np.tile(shift, (len(stance), 1)), atol=0.005)
    np.testing.assert_allclose(steps[[0, -1]], 0.0, atol=1e-9)
    assert np.linalg.norm(np.diff(steps, axis=0), axis=1).max() * FPS < 2.0
    np.testing.assert_array_equal(moved.root, body.root)
    kicking = (HUMAN.right if side == "right" else HUMAN.left).foot
    np.testing.assert_allclose(moved.places[:, kicking], body.places[:, kicking], atol=1e-9)


def test_a_foot_out_of_range_comes_nearer_by_no_more_than_a_step_allows(kick):
    side, body, at, standing = kick
    away = np.array([0.0, 0.2 if side == "right" else -0.2, 0.0])  # further to the plant foot's own side
    wide = place_plant_foot(body, 0.5 * away, side, at, standing, FPS)
    before = measure_plant_place(body.skeleton, wide.places[at], side)
    assert before[1] > PLANT_BESIDE[1]
    shift = compute_step_shift(wide, side, at)
    back = place_plant_foot(wide, shift, side, at, standing, FPS)
    after = measure_plant_place(body.skeleton, back.places[at], side)
    assert PLANT_BESIDE[0] < after[1] < PLANT_BESIDE[1] and PLANT_AHEAD[0] < after[0] < PLANT_AHEAD[1]
    assert np.linalg.norm(shift) <= MAX_PLANT_SHIFT + 1e-9


def test_a_foot_without_time_for_a_step_stays(kick):
    side, body, at, standing = kick
    shift = np.array([0.1, 0.0, 0.0])
    for never in (np.ones(len(standing), bool), np.zeros(len(standing), bool)):
        assert place_plant_foot(body, shift, side, at, never, FPS) is body
    assert place_plant_foot(body, np.zeros(3), side, at, standing, FPS) is body


def test_within_the_range_nothing_is_lacking():
    middle = np.array([np.mean(PLANT_AHEAD), np.mean(PLANT_BESIDE)])
    assert not compute_plant_shift(NEUTRAL.skeleton, middle).any()
    assert compute_plant_shift(NEUTRAL.skeleton, middle + [0.0, 0.3])[1] < -0.15
