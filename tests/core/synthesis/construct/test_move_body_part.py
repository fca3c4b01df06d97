"""A leg swung to planted places: exact where its joints allow, at their limits where not, and never past them
between."""

import numpy as np
import pytest

from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.synthesis.construct.move_body_part import (
    MAX_ANGLE,
    MIN_ANGLE,
    Body,
    LimbReference,
    compute_swing_shift,
    move_limb,
    solve_swing,
)
from beyond_mocap.synthetic.gait import build_gait

MOST = np.radians(35.0)
AT = 12


@pytest.fixture(scope="module")
def body():
    motion = build_gait(1.4, 1.0, 30.0)
    return Body.from_pose(motion.skeleton, motion.root_positions, motion.rotations)


def carried(body, place, share):
    chain = identify_joints(body.skeleton).right.leg
    moves = compute_swing_shift(body, chain, solve_swing(body, chain, AT, place, MOST), share)
    rotations = move_limb(body, LimbReference.from_body(body, chain), moves)
    return Body.from_pose(body.skeleton, body.root, rotations), chain


def angle(body, chain):
    """(W,) rad inside the knee."""
    up, down = (body.places[:, joint] - body.places[:, chain[1]] for joint in (chain[0], chain[2]))
    return np.arccos(np.sum(up * down, axis=1) / np.linalg.norm(up, axis=1) / np.linalg.norm(down, axis=1))


@pytest.mark.parametrize("move", [(0.1, 0.1, 0.1), (-0.15, 0.0, 0.1), (0.0, -0.2, 0.15)])
def test_a_place_in_reach_is_met(body, move):
    chain = identify_joints(body.skeleton).right.leg
    place = body.places[AT, chain[2]] + move
    after, _ = carried(body, place, (np.arange(len(body.root)) == AT).astype(float))
    assert after.places[AT, chain[2]] == pytest.approx(place, abs=0.002)
    others = np.arange(len(body.root)) != AT
    assert after.places[others] == pytest.approx(body.places[others], abs=1e-9)


@pytest.mark.parametrize("move", [(1.5, 0.0, 0.0), (0.0, 0.0, -0.5), (0.2, 0.0, 0.7)])
def test_no_knee_passes_its_limits_at_any_frame(body, move):
    chain = identify_joints(body.skeleton).right.leg
    after, _ = carried(body, body.places[AT, chain[2]] + move, np.ones(len(body.root)))
    own, made = angle(body, chain), angle(after, chain)
    slack = np.radians(1.5)
    assert np.all(made <= np.maximum(own, MAX_ANGLE) + slack) and np.all(made >= np.minimum(own, MIN_ANGLE) - slack)
    before, now = (b.places[AT, chain[2]] - b.places[AT, chain[0]] for b in (body, after))
    turn = np.arccos(before @ now / np.linalg.norm(before) / np.linalg.norm(now))
    assert turn <= MOST + 0.01
