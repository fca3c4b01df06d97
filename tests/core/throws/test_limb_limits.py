"""The limits of a model's limb on other bones: on joints whose axes lie elsewhere, and of the other side."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.mirror import mirror
from beyond_mocap.motion.motion import Motion
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.synthetic.throws import build_throw
from beyond_mocap.throws.networks.limits import JointLimits, LimbLimits, estimate_joint_limits

SKELETON = build_adult_skeleton()
BODY = identify_joints(SKELETON)
RIGHT, LEFT = ((side.upper_arm, side.lower_arm, side.hand) for side in (BODY.right, BODY.left))


@pytest.fixture(scope="module")
def thrown():
    """A throw, limits that its swing leaves, and how far."""
    begun = build_throw((9.0, 0.0, 1.0), 10.0, skeleton=SKELETON, fps=30.0).motion.rotations[:10]
    fast = build_throw((24.0, 2.0, 3.0), 30.0, skeleton=SKELETON, fps=30.0).motion
    limits = JointLimits(SKELETON, estimate_joint_limits(begun))
    beyond = limits.measure_excess(quaternion.to_matrix(fast.rotations))[:, RIGHT]
    assert beyond.max() > np.radians(5.0)
    return fast, limits, beyond


def other_axes(motion):
    """The same motion on joints whose axes are turned at random, and the turns."""
    turns = quaternion.from_rotation_vector(np.random.default_rng(3).normal(size=(len(SKELETON), 3)))
    turns[0] = [1.0, 0.0, 0.0, 0.0]
    above = turns[[max(parent, 0) for parent in SKELETON.parents]]
    offsets = quaternion.rotate(quaternion.inverse(above), SKELETON.offsets)
    local = quaternion.multiply(quaternion.multiply(quaternion.inverse(above), motion.rotations), turns)
    return Motion(replace(SKELETON, offsets=offsets), motion.root_positions, local, motion.fps)


def test_on_other_axes_joints_are_as_far_beyond(thrown):
    fast, limits, beyond = thrown
    shown = other_axes(fast)
    assert np.allclose(LimbLimits.from_motions(limits, fast, RIGHT, shown, RIGHT).measure_excess(shown), beyond,
                       atol=1e-6)


def test_the_mirror_image_is_as_far_beyond(thrown):
    fast, limits, beyond = thrown
    shown = mirror(fast)
    found = LimbLimits.from_motions(limits, fast, RIGHT, shown, LEFT, mirrored=True)
    assert np.allclose(found.measure_excess(shown), beyond, atol=1e-6)


@pytest.mark.parametrize("bones, limb, mirrored", [(other_axes, RIGHT, False), (mirror, LEFT, True)])
def test_what_is_held_is_within_or_as_it_was_given(thrown, bones, limb, mirrored):
    fast, limits, beyond = thrown
    shown = bones(fast)
    found = LimbLimits.from_motions(limits, fast, RIGHT, shown, limb, mirrored)
    asked = shown.rotations[:, list(limb)]
    still = np.repeat(asked[:1], len(asked), axis=0)
    held = found.limit_rotations(asked, still)
    rotations = shown.rotations.copy()
    rotations[:, list(limb)] = held
    assert np.all(found.measure_excess(replace(shown, rotations=rotations)) <= found.measure_excess(shown)[:1] + 1e-5)
    inside = beyond == 0.0
    assert np.allclose(held[inside], asked[inside], atol=1e-9) and np.array_equal(found.limit_rotations(asked, asked),
                                                                                  asked)
