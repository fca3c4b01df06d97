"""Two motions that differ a little joined: each where it counts, no jump between, and no foot that slides."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.motion import contacts, quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import compute_pose
from beyond_mocap.synthesis.construct.edit_blending import blend_with_old, compute_old_share
from beyond_mocap.synthetic.gait import build_gait

STRETCH, HAND = (40, 80), 12


@pytest.fixture(scope="module")
def walk():
    motion = build_gait(1.4, 4.0, 30.0)
    return replace(motion, root_positions=motion.root_positions - [0.0, 0.0, contacts.measure_floor_height(motion)])


def ankles(motion, pose):
    body = identify_joints(motion.skeleton)
    places, _ = compute_pose(motion.skeleton, *pose)
    return places[:, [body.left.foot, body.right.foot]]


def test_the_old_share_grows_from_the_stretch_on():
    share = compute_old_share(120, STRETCH, HAND)
    assert not share[40:80].any() and np.all(share[:28] == 1.0) and np.all(share[92:] == 1.0)
    assert np.all(np.diff(share[27:41]) < 0) and np.all(np.diff(share[79:93]) > 0)


def test_the_same_motion_comes_back(walk):
    pose = walk.root_positions, walk.rotations
    share, stands = compute_old_share(len(walk), STRETCH, HAND), contacts.detect_heel_toe_contacts(walk)
    root, rotations = blend_with_old(walk.skeleton, pose, pose, share, stands, 30.0)
    assert np.allclose(root, walk.root_positions)
    assert np.abs(np.sum(rotations * walk.rotations, axis=-1)).min() > 1.0 - 1e-9


def test_a_motion_beside_the_old_one_joins_it(walk):
    """All of it 2 cm aside, turned by 3 degrees at the shoulders, and with the other sign of its quaternions."""
    old = walk.root_positions, walk.rotations
    turned = walk.rotations.copy()
    turned[:, 5] = quaternion.multiply(turned[:, 5], quaternion.from_up_angle(np.full(len(walk), 0.05)))
    new = walk.root_positions + [0.0, 0.02, 0.0], -turned
    share, stands = compute_old_share(len(walk), STRETCH, HAND), contacts.detect_heel_toe_contacts(walk)
    root, rotations = blend_with_old(walk.skeleton, new, old, share, stands, 30.0)
    far = share >= 1.0
    assert np.allclose(root[far], old[0][far]) and np.allclose(rotations[far], old[1][far], atol=1e-9)
    assert np.allclose(root[50:70], new[0][50:70]) and np.sum(rotations[1:] * rotations[:-1], axis=-1).min() > 0.9
    feet, apart = ankles(walk, (root, rotations)), ankles(walk, old)
    assert np.abs(feet - apart)[share > 0].max() < 2e-3
    speed = np.linalg.norm(np.diff(feet[..., :2], axis=0), axis=-1) * 30.0
    own = np.linalg.norm(np.diff(apart[..., :2], axis=0), axis=-1) * 30.0
    still = stands.all(axis=2)
    assert (speed - own)[still[1:] & still[:-1]].max() < 0.02


def test_a_foot_that_fades_in_the_old_motion_stands_where_that_has_it_alone(walk):
    """The old motion drifts by 6 cm while it fades; feet slide with it only where they have to be in it."""
    share, stands = compute_old_share(len(walk), STRETCH, HAND), contacts.detect_heel_toe_contacts(walk)
    drift = np.zeros((len(walk), 3))
    drift[:, 1] = 0.06 * (1.0 - share)
    new, old = (walk.root_positions, walk.rotations), (walk.root_positions + drift, walk.rotations)
    still = stands.all(axis=2)
    still = still[1:] & still[:-1] & ((share > 0.0) & (share < 1.0))[1:, None]

    def slide(least):
        feet = ankles(walk, blend_with_old(walk.skeleton, new, old, share, stands, 30.0, least=least))
        speed = np.linalg.norm(np.diff(feet - ankles(walk, new), axis=0)[..., :2], axis=-1) * 30.0
        return speed[still].max()

    assert slide(0.999) < 0.02 < 0.08 < slide(0.0)


def test_no_foot_goes_below_the_ground_for_what_the_old_one_had(walk):
    """The old motion's toes point down, into the ground; where the new one alone counts they are above it."""
    body, old = identify_joints(walk.skeleton), walk.rotations.copy()
    for limb in (body.left, body.right):
        down = quaternion.from_rotation_vector(np.tile([0.0, 0.2, 0.0], (len(walk), 1)))
        old[:, limb.foot] = quaternion.multiply(old[:, limb.foot], down)
    joints = [body.left.foot, body.left.toe, body.right.foot, body.right.toe]

    def lowest(pose):
        return compute_pose(walk.skeleton, *pose)[0][:, joints, 2].reshape(-1, 2, 2).min(axis=2)

    new = walk.root_positions, walk.rotations
    share, stands = compute_old_share(len(walk), STRETCH, HAND), contacts.detect_heel_toe_contacts(walk)
    assert lowest((walk.root_positions, old))[share > 0.0].min() < -0.01
    after = lowest(blend_with_old(walk.skeleton, new, (walk.root_positions, old), share, stands, 30.0))[share == 0.0]
    own = np.minimum(lowest(new)[share == 0.0], 0.0)
    assert (after - own).min() > -1e-3
