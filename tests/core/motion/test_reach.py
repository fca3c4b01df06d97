"""Limbs that reach: targets met, bones kept, knees on their side, nothing torn when it cannot be done."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.limb import MIN_BEND, place_limb, solve_posed_limb, solve_two_bone
from beyond_mocap.motion.motion import compute_pose
from beyond_mocap.synthetic.gait import build_gait


@pytest.fixture(scope="module")
def running():
    return build_gait(3.5, 2.0, 60.0)


def leg(motion):
    limb = identify_joints(motion.skeleton).left
    return limb.upper_leg, limb.lower_leg, limb.foot


def kinematics(motion, rotations):
    return compute_pose(motion.skeleton, motion.root_positions, rotations)


def reach(motion, target, **options):
    return solve_two_bone(motion.skeleton, motion.root_positions, motion.rotations, leg(motion), target, **options)


def test_meets_its_target_without_stretching(running):
    places, world = kinematics(running, running.rotations)
    upper, middle, end = leg(running)
    towards = places[:, upper] - places[:, end]
    target = places[:, end] + 0.15 * towards + np.array([0.0, 0.03, 0.0])
    moved = reach(running, target)
    after, turned = kinematics(running, moved.rotations)
    assert np.linalg.norm(after[:, end] - target, axis=1).max() < 1e-6 and moved.miss.max() < 1e-6
    for a, b in ((upper, middle), (middle, end)):
        assert np.allclose(
            np.linalg.norm(after[:, b] - after[:, a], axis=1), np.linalg.norm(places[0, b] - places[0, a])
        )
    assert np.allclose(np.abs(np.sum(turned[:, end] * world[:, end], axis=1)), 1.0)  # the foot keeps its turn
    others = [j for j in range(len(running.skeleton)) if j not in (upper, middle, end)]
    assert np.allclose(moved.rotations[:, others], running.rotations[:, others])


def test_the_own_place_changes_nothing(running):
    places, _ = kinematics(running, running.rotations)
    moved = reach(running, places[:, leg(running)[2]], soft=1e-6)
    after, _ = kinematics(running, moved.rotations)
    assert np.allclose(after, places, atol=2e-3)


def test_out_of_reach_is_neared_and_told(running):
    places, _ = kinematics(running, running.rotations)
    upper, middle, end = leg(running)
    target = places[:, upper] + np.array([0.3, 0.0, -2.0])
    moved = reach(running, target)
    after, _ = kinematics(running, moved.rotations)
    length = np.linalg.norm(places[0, middle] - places[0, upper]) + np.linalg.norm(places[0, end] - places[0, middle])
    distance = np.linalg.norm(target - places[:, upper], axis=1)
    assert np.allclose(moved.miss, distance - length, atol=0.005)
    assert np.allclose(moved.miss, np.linalg.norm(after[:, end] - target, axis=1), atol=1e-9)
    line = (target - places[:, upper]) / distance[:, None]
    assert np.allclose(np.cross(after[:, end] - after[:, upper], line), 0.0, atol=1e-6)


def test_soft_reach_misses_by_less_than_four_millimetres_and_does_not_snap(running):
    still = running.frames(0, 1)
    places, _ = kinematics(still, still.rotations)
    upper, middle, end = leg(still)
    length = np.linalg.norm(places[0, middle] - places[0, upper]) + np.linalg.norm(places[0, end] - places[0, middle])
    count = 400
    root, rotations = np.repeat(still.root_positions, count, axis=0), np.repeat(still.rotations, count, axis=0)
    down = np.linspace(0.94, 1.02, count) * length
    target = places[0, upper] + down[:, None] * np.array([0.0, 0.0, -1.0])
    moved = solve_two_bone(still.skeleton, root, rotations, (upper, middle, end), target)
    inside = down <= length
    assert moved.miss[inside].max() < 0.004 and moved.miss[down < length - 0.011].max() < 1e-9
    after, _ = compute_pose(still.skeleton, root, moved.rotations)
    knee = after[:, middle]
    assert np.abs(np.diff(knee, n=2, axis=0)).max() < 1e-3  # metres per step squared: smooth up to full stretch


def test_knees_never_flip(running):
    places, _ = kinematics(running, running.rotations)
    body = identify_joints(running.skeleton)
    upper, middle, end = leg(running)
    rng = np.random.default_rng(0)
    wander = np.cumsum(rng.normal(size=(len(running), 3)) * 0.004, axis=0)
    moved = reach(running, places[:, end] + wander)
    after, _ = kinematics(running, moved.rotations)
    across = after[:, body.left.upper_leg] - after[:, body.right.upper_leg]
    hinge = np.cross(after[:, middle] - after[:, upper], after[:, end] - after[:, middle])
    assert np.all(np.sum(hinge * across, axis=1) > -1e-4)
    assert np.all(np.isfinite(moved.rotations))


def test_a_straight_leg_bends_forward_and_targets_at_the_hip_are_survived(running):
    skeleton = running.skeleton
    count = 3
    root, rotations = np.tile([0.0, 0.0, 1.0], (count, 1)), quaternion.identity(count, len(skeleton))
    places, _ = compute_pose(skeleton, root, rotations)
    upper, middle, end = leg(running)
    target = np.stack([places[0, end] + [0.0, 0.0, 0.2], places[0, upper], places[0, upper] + [0.5, 0.0, 0.0]])
    moved = solve_two_bone(skeleton, root, rotations, (upper, middle, end), target)
    after, _ = compute_pose(skeleton, root, moved.rotations)
    assert np.all(np.isfinite(moved.rotations))
    assert after[0, middle, 0] > 0.1
    assert np.linalg.norm(after[2, end] - target[2]) < 1e-6


def test_end_rotation_and_pole_are_obeyed(running):
    places, world = kinematics(running, running.rotations)
    upper, middle, end = leg(running)
    target = places[:, end] + 0.2 * (places[:, upper] - places[:, end])
    wanted = quaternion.from_up_angle(np.full(len(running), 0.4))
    pole = np.tile([0.0, 1.0, 0.0], (len(running), 1))
    moved = reach(running, target, end_rotation=wanted, pole=pole)
    after, turned = kinematics(running, moved.rotations)
    assert np.allclose(np.abs(np.sum(turned[:, end] * wanted, axis=1)), 1.0)
    line = target - after[:, upper]
    off = after[:, middle] - after[:, upper]
    off -= np.sum(off * line, axis=1, keepdims=True) / np.sum(line * line, axis=1, keepdims=True) * line
    assert np.all(off[:, 1] > 0.9 * np.linalg.norm(off, axis=1))
    rigid = reach(running, target, keep_end_rotation=False)
    assert np.allclose(rigid.rotations[:, end], running.rotations[:, end], atol=1e-9)


def test_wrong_joints_are_refused(running):
    upper, middle, end = leg(running)
    with pytest.raises(InputError):
        solve_two_bone(
            running.skeleton, running.root_positions, running.rotations, (upper, end, middle), running.root_positions
        )


def test_a_knee_that_bends_backwards_in_one_frame_does_not_flip():
    """Blended poses may overstretch a knee for a frame; the plane it bends in comes from the frames before and
    after."""
    motion = build_gait(2.0, 2.0, 30.0)
    limb = identify_joints(motion.skeleton).left
    rotations = np.array(motion.rotations)
    places, _ = kinematics(motion, motion.rotations)
    straightest = int(np.argmin(np.abs(2.0 * np.arccos(np.clip(rotations[:, limb.lower_leg, 0], -1.0, 1.0)))))
    back = quaternion.from_axis_angle(np.array([0.0, 1.0, 0.0]), np.array(-0.5))
    rotations[straightest, limb.lower_leg] = back
    chain = (limb.upper_leg, limb.lower_leg, limb.foot)
    out = solve_two_bone(motion.skeleton, motion.root_positions, rotations, chain, places[:, limb.foot]).rotations
    knees = compute_pose(motion.skeleton, motion.root_positions, out)[0][:, limb.lower_leg]
    assert np.abs(knees - places[:, limb.lower_leg]).max() < 0.08


def test_a_leg_that_bends_more_than_it_did_keeps_its_knee_steady():
    """A leg a centimetre short of straight whose knee trembles by 20 degrees, bent by ten more."""
    motion = build_gait(1.4, 2.0, 60.0)
    places, world = (values.copy() for values in kinematics(motion, motion.rotations))
    upper, middle, end = leg(motion)
    lengths = [np.linalg.norm(places[0, b] - places[0, a]) for a, b in ((upper, middle), (middle, end))]
    count = len(places)
    trembles = np.radians(20.0) * (-1.0) ** np.arange(count)
    off = 0.05 * np.stack([np.cos(trembles), np.sin(trembles), np.zeros(count)], axis=1)
    down = np.array([0.0, 0.0, -1.0])
    places[:, upper], world[:, upper] = 0.0, quaternion.identity(count)
    places[:, middle] = off + np.sqrt(lengths[0] ** 2 - 0.05**2) * down
    places[:, end] = places[:, middle] - off + np.sqrt(lengths[1] ** 2 - 0.05**2) * down
    target = places[:, end] - 0.1 * down
    swings = []
    for clear in (MIN_BEND, np.full(count, 0.2)):
        local, miss = solve_posed_limb(motion.skeleton, places, world, (upper, middle, end), target, soft=1e-4,
                                       min_bend=clear)
        bone = motion.skeleton.offsets[middle]
        thigh = quaternion.multiply(world[:, motion.skeleton.parents[upper]], local[upper])
        swings.append(np.ptp(quaternion.rotate(thigh, np.tile(bone, (count, 1)))[:, 1]))
        assert miss.max() < 1e-3
    assert swings[1] < 0.5 * swings[0]


def test_a_limb_is_placed_where_its_rotations_bring_it():
    motion = build_gait(3.0, 2.0, 60.0)
    places, world = kinematics(motion, motion.rotations)
    chain, target = leg(motion), places[:, leg(motion)[2]] + [0.05, 0.02, 0.04]
    solved = solve_two_bone(motion.skeleton, motion.root_positions, motion.rotations, chain, target)
    there = kinematics(motion, solved.rotations)[0]
    for place, joint in zip(place_limb(places, world, chain, target), chain[1:]):
        assert np.abs(place - there[:, joint]).max() < 1e-9
