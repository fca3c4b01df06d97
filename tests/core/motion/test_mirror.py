"""Mirroring: the body's mirror image on any skeleton, whichever way its axes lie."""

import pathlib
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.files.bvh import bvh
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.mirror import mirror
from beyond_mocap.motion.motion import Motion, compute_end_positions, forward_kinematics
from beyond_mocap.motion.skeleton import Skeleton
from beyond_mocap.synthetic.gait import build_gait

MOCAP = pathlib.Path(__file__).parents[3] / "../shared/data/mocap"
# a turn of the axes that lets bones which hang down lie along X, as LAFAN1's and Bandai-Namco's do
DOWN_TO_X = quaternion.from_matrix(np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]))
MIRROR = np.diag([1.0, -1.0, 1.0])


def with_axes(motion: Motion, axes: np.ndarray) -> Motion:
    """The same movement on a skeleton with other axes: axes (J, 4), each joint's new ones seen from the old."""
    old, back = motion.skeleton, quaternion.inverse(axes)
    parents = np.array(old.parents)
    offsets = old.offsets.copy()
    offsets[1:] = quaternion.rotate(back[parents[1:]], old.offsets[1:])
    tips = quaternion.rotate(back[list(old.end_parents)], old.end_offsets)
    rotations = quaternion.multiply(motion.rotations, axes)
    rotations[:, 1:] = quaternion.multiply(back[parents[1:]], rotations[:, 1:])
    return Motion(
        Skeleton(old.names, old.parents, offsets, old.end_parents, tips), motion.root_positions, rotations, motion.fps
    )


def alike(skeleton: Skeleton) -> np.ndarray:
    """All joints' axes turned alike."""
    return np.tile(DOWN_TO_X, (len(skeleton), 1))


def mirrored_behaviour(skeleton: Skeleton) -> np.ndarray:
    """Right limbs' axes are the mirrored left ones, all inverted: bones along +X on the left, along -X on the right."""
    axes = alike(skeleton)
    for joint in range(len(skeleton)):
        if skeleton.names[joint].startswith("Right"):
            axes[joint] = quaternion.from_matrix(-MIRROR @ quaternion.to_matrix(DOWN_TO_X))
    return axes


def image(motion: Motion, positions: np.ndarray) -> np.ndarray:
    """Positions (T, J, 3) reflected at y = 0, left and right exchanged."""
    return positions[:, list(identify_joints(motion.skeleton).mirror)] * (1.0, -1.0, 1.0)


def tips_image(motion: Motion) -> np.ndarray:
    """The reflected tips (T, E, 3) in the order of their partners."""
    skeleton, partner = motion.skeleton, identify_joints(motion.skeleton).mirror
    own, order = [], []
    for joint in dict.fromkeys(skeleton.end_parents):
        own += [i for i, p in enumerate(skeleton.end_parents) if p == joint]
        order += [i for i, p in enumerate(skeleton.end_parents) if p == partner[joint]]
    out = np.empty((len(motion), len(order), 3))
    out[:, own] = compute_end_positions(motion)[:, order] * (1.0, -1.0, 1.0)
    return out


@pytest.fixture(scope="module")
def walk() -> Motion:
    """A curve to the left at a jog, seen from somewhere."""
    motion = build_gait(2.5, 2.0, turn_rate=0.8)
    return replace(motion, root_positions=motion.root_positions + (3.0, -2.0, 0.5))


@pytest.mark.parametrize("axes", [None, alike, mirrored_behaviour], ids=["as made", "along X", "mirrored behaviour"])
def test_every_joint_and_tip_stands_where_its_partner_is_reflected(walk, axes):
    motion = with_axes(walk, axes(walk.skeleton)) if axes else walk
    assert np.abs(forward_kinematics(motion)[0] - forward_kinematics(walk)[0]).max() < 1e-12
    mirrored = mirror(motion)
    assert mirrored.skeleton is motion.skeleton
    assert np.abs(forward_kinematics(mirrored)[0] - image(motion, forward_kinematics(motion)[0])).max() < 1e-9
    assert np.abs(compute_end_positions(mirrored) - tips_image(motion)).max() < 1e-9


def lopsided(skeleton: Skeleton) -> Skeleton:
    """Left bones 4 % longer and a little askew, as measured bodies are."""
    offsets = skeleton.offsets.copy()
    left = [name.startswith("Left") for name in skeleton.names]
    tilt = quaternion.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.radians(3.0))
    offsets[left] = 1.04 * quaternion.rotate(tilt, offsets[left])
    return replace(skeleton, offsets=offsets)


@pytest.mark.parametrize("axes", [None, alike, mirrored_behaviour], ids=["as made", "along X", "mirrored behaviour"])
def test_twice_is_the_same_on_any_skeleton(walk, axes):
    motion = replace(walk, skeleton=lopsided(walk.skeleton))
    motion = with_axes(motion, axes(motion.skeleton)) if axes else motion
    again = mirror(mirror(motion))
    assert np.abs(forward_kinematics(again)[0] - forward_kinematics(motion)[0]).max() < 1e-9
    assert np.allclose(np.abs(np.sum(again.rotations * motion.rotations, axis=-1)), 1.0, atol=1e-12)


def test_uneven_bones_point_where_the_partner_reflected_points(walk):
    motion = replace(walk, skeleton=lopsided(walk.skeleton))
    mirrored, body = mirror(motion), identify_joints(motion.skeleton)
    before, after = forward_kinematics(motion)[0], forward_kinematics(mirrored)[0]
    for limb, other in ((body.left, body.right), (body.right, body.left)):
        for upper, lower in (
            ("upper_leg", "lower_leg"),
            ("lower_leg", "foot"),
            ("upper_arm", "lower_arm"),
            ("lower_arm", "hand"),
        ):
            bone = after[:, getattr(limb, lower)] - after[:, getattr(limb, upper)]
            wanted = (before[:, getattr(other, lower)] - before[:, getattr(other, upper)]) * (1.0, -1.0, 1.0)
            cosine = np.sum(bone * wanted, axis=-1) / np.linalg.norm(bone, axis=-1) / np.linalg.norm(wanted, axis=-1)
            assert np.degrees(np.arccos(np.minimum(cosine, 1.0))).max() < 0.05
    assert np.abs(after[..., 2] - image(motion, before)[..., 2]).max() < 0.06


def test_the_left_foot_kicks_what_the_right_one_kicked(walk):
    body = identify_joints(walk.skeleton)
    rotations, hip = walk.rotations.copy(), body.right.upper_leg
    forward = quaternion.from_axis_angle(np.array([0.0, 1.0, 0.0]), -1.0)
    rotations[20:30, hip] = quaternion.multiply(rotations[20:30, hip], forward)
    kick = replace(walk, rotations=rotations)
    (before, _), (after, _) = forward_kinematics(kick), forward_kinematics(mirror(kick))
    assert np.allclose(after[:, body.left.foot, 2], before[:, body.right.foot, 2])
    assert after[:, body.left.foot, 2].max() > after[:, body.right.foot, 2].max() + 0.1


def test_one_frame_is_enough_and_nothing_given_changes(walk):
    one = with_axes(walk, mirrored_behaviour(walk.skeleton)).frames(5, 6)
    root, rotations = one.root_positions.copy(), one.rotations.copy()
    assert np.abs(forward_kinematics(mirror(one))[0] - image(one, forward_kinematics(one)[0])).max() < 1e-9
    assert np.array_equal(one.root_positions, root) and np.array_equal(one.rotations, rotations)


@pytest.mark.skipif(not MOCAP.is_dir(), reason="recordings: no ../shared/data/mocap beside the clone")
@pytest.mark.parametrize(
    "pattern, centimetres",
    [
        ("bandai/*_001.bvh", 0.01),
        ("lafan1/*_subject1_*.bvh", 0.01),
        ("getup/*.bvh", 0.01),
        ("runs15/*1.bvh", 0.01),
        ("lmd/*/*1_*.bvh", 0.3),
        ("sprinter/*.bvh", 0.8),
        ("cmu_jumps/*1.bvh", 2.5),
        ("cmu10/10_0*.bvh", 5.5),
        ("keeper/*1_*.bvh", 5.0),
    ],
)
def test_recordings_are_off_their_image_by_their_bodies_asymmetry_only(pattern, centimetres):
    for path in sorted(MOCAP.glob(pattern))[:12]:
        motion = bvh.read_bvh(path).motion
        mirrored = mirror(motion)
        off = np.linalg.norm(forward_kinematics(mirrored)[0] - image(motion, forward_kinematics(motion)[0]), axis=-1)
        assert 100 * off.max() < centimetres, path.name
        assert np.abs(forward_kinematics(mirror(mirrored))[0] - forward_kinematics(motion)[0]).max() < 1e-9
