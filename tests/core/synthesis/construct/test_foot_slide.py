"""The body gives where its feet would slide, a little, and only there."""

import numpy as np
import pytest

from beyond_mocap.motion import contacts, quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import compute_pose, place_motion
from beyond_mocap.synthesis.construct.track_following import absorb_foot_slide
from beyond_mocap.synthetic.gait import build_gait


@pytest.fixture(scope="module")
def walk():
    motion = build_gait(1.4, 4.0, 30.0)
    return motion, contacts.detect_heel_toe_contacts(motion)


def slide(motion, root, rotations, stands):
    """Mean speed in m/s of toes that stand."""
    body = identify_joints(motion.skeleton)
    places, _ = compute_pose(motion.skeleton, root, rotations)
    toes = places[:, [body.left.toe_or_foot, body.right.toe_or_foot], :2]
    firm = stands[1:, :, 1] & stands[:-1, :, 1]
    return np.linalg.norm(np.diff(toes, axis=0), axis=-1)[firm].mean() * motion.fps


def given(motion, root, rotations, stands):
    move, turn = absorb_foot_slide(motion.skeleton, root, rotations, stands, motion.fps)
    turned = rotations.copy()
    turned[:, 0] = quaternion.multiply(quaternion.from_up_angle(turn), rotations[:, 0])
    return move, turn, root + np.column_stack([move, np.zeros(len(root))]), turned


def test_a_surging_root_gives_way_to_the_feet(walk):
    motion, stands = walk
    surge = 0.05 * np.sin(np.arange(len(motion)) * 2 * np.pi / 20.0)
    root = motion.root_positions + np.outer(surge, [1.0, 0.0, 0.0])
    move, turn, there, turned = given(motion, root, motion.rotations, stands)
    assert slide(motion, there, turned, stands) < 0.8 * slide(motion, root, motion.rotations, stands)
    assert np.corrcoef(move[:, 0], surge)[0, 1] < -0.8 and np.abs(move[:, 0]).max() < 0.05


def test_a_body_that_swings_on_its_feet_turns_less(walk):
    motion, stands = walk
    swing = 0.2 * np.sin(np.arange(len(motion)) * 2 * np.pi / 40.0)
    turned = motion.rotations.copy()
    turned[:, 0] = quaternion.multiply(quaternion.from_up_angle(swing), turned[:, 0])
    _, turn, root, out = given(motion, motion.root_positions, turned, stands)
    assert np.corrcoef(turn, swing)[0, 1] < -0.5
    assert slide(motion, root, out, stands) < slide(motion, motion.root_positions, turned, stands)


def test_nothing_gives_where_nothing_slides(walk):
    motion, stands = walk
    move, turn = absorb_foot_slide(motion.skeleton, motion.root_positions, motion.rotations, stands, 30.0)
    assert np.abs(move).max() < 0.01 and np.abs(turn).max() < 0.03
    slid = motion.root_positions + np.outer(np.arange(len(motion)) / 30.0, [0.4, 0.0, 0.0])
    move, turn = absorb_foot_slide(motion.skeleton, slid, motion.rotations, np.zeros_like(stands), 30.0)
    assert np.allclose(move, 0.0) and np.allclose(turn, 0.0)


def test_it_does_not_ask_which_way_one_goes(walk):
    motion, stands = walk
    surge = np.outer(0.05 * np.sin(np.arange(len(motion)) / 3.0), [1.0, 0.0, 0.0])
    there = place_motion(motion, 2.0)
    turned = quaternion.rotate(quaternion.from_up_angle(np.full(len(motion), 2.0)), surge)
    one = absorb_foot_slide(motion.skeleton, motion.root_positions + surge, motion.rotations, stands, 30.0)
    other = absorb_foot_slide(motion.skeleton, there.root_positions + turned, there.rotations, stands, 30.0)
    assert np.allclose(quaternion.rotate_level(one[0], np.full(len(motion), 2.0)), other[0], atol=1e-9)
    assert np.allclose(one[1], other[1], atol=1e-9)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 40])
def test_few_frames(walk, count):
    motion = walk[0].frames(0, count)
    stands = np.ones((count, 2, 2), bool)
    move, turn = absorb_foot_slide(motion.skeleton, motion.root_positions, motion.rotations, stands, 30.0)
    assert move.shape == (count, 2) and turn.shape == (count,) and np.isfinite(move).all() and np.isfinite(turn).all()


@pytest.mark.parametrize("fps", [24.0, 60.0, 120.0])
def test_at_any_rate(fps):
    motion = build_gait(1.4, 4.0, fps)
    stands = contacts.detect_heel_toe_contacts(motion)
    root = motion.root_positions + np.outer(0.05 * np.sin(np.arange(len(motion)) / fps * 3.0 * np.pi), [1.0, 0.0, 0.0])
    _, _, there, turned = given(motion, root, motion.rotations, stands)
    assert slide(motion, there, turned, stands) < 0.85 * slide(motion, root, motion.rotations, stands)
