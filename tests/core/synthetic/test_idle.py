"""Waiting for a ball: bent knees, weight that shifts, and small steps in place."""

import numpy as np
import pytest

from beyond_mocap.motion.humanoid import compute_heading, identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthetic.idle import build_idle, build_ready_steps


def measure(motion):
    """Knees (T, 2) degrees of flexion, hips (T, 3) m, and toes (T, 2, 3) m."""
    places, _ = forward_kinematics(motion)
    body, knees = identify_joints(motion.skeleton), []
    for leg in (body.left, body.right):
        up, down = places[:, leg.upper_leg] - places[:, leg.lower_leg], places[:, leg.foot] - places[:, leg.lower_leg]
        cosine = np.sum(up * down, axis=1) / np.linalg.norm(up, axis=1) / np.linalg.norm(down, axis=1)
        knees.append(180.0 - np.degrees(np.arccos(cosine)))
    return np.array(knees).T, places[:, body.hips], places[:, [body.left.toe_or_foot, body.right.toe_or_foot]]


@pytest.mark.parametrize("seed", [61, 62, 63])
def test_the_weight_shifts_and_the_feet_step_and_come_back(seed):
    knees, hips, toes = measure(build_idle(9.0, seed=seed))
    assert 20.0 < knees.mean() < 50.0
    assert 0.08 < np.ptp(hips[:, 1]) < 0.25 and np.abs(hips[:, :2]).max() < 0.25
    lifted = toes[..., 2] > toes[..., 2].min(axis=0) + 0.03
    assert (np.diff(lifted.astype(int), axis=0) == 1).sum(axis=0).min() >= 1  # each foot
    assert lifted.mean() < 0.25 and not lifted.all(axis=1).any()
    slide = np.linalg.norm(np.diff(toes[..., :2], axis=0), axis=2) * 30.0
    assert np.median(slide[~lifted[1:] & ~lifted[:-1]]) < 0.01


def test_steps_turn_the_body_and_move_it():
    turned = build_ready_steps((0.0, 0.0), np.radians(100.0))
    assert np.degrees(compute_heading(turned)[-1]) == pytest.approx(100.0, abs=3.0)
    moved = build_ready_steps((0.25, 0.0), 0.0)
    knees, hips, _ = measure(moved)
    assert hips[-1, 0] - hips[0, 0] == pytest.approx(0.25, abs=0.02) and knees.min() > 15.0
