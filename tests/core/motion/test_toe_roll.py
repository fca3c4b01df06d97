"""Toes bend up where the tip of a boot would dig into the ground, and nowhere else."""

import numpy as np
import pytest

from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import compute_local_rotations, compute_pose
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.motion.retargeting.neutral import build_neutral_stance
from beyond_mocap.motion.skeleton import Skeleton
from beyond_mocap.motion.toe_roll import DEEPEST, MOST_BEND, MOST_FOOT_TURN, roll_toes

THICKNESS = 0.008  # share of the leg's length, of the sole at the tip below its middle
ADULT = build_adult_skeleton()
PITCHES = np.radians([0.0, 10.0, 25.0, 40.0, 55.0])


def drop_toes():
    keep = [joint for joint, name in enumerate(ADULT.names) if "Toe" not in name]
    parents = [keep.index(ADULT.parents[joint]) if ADULT.parents[joint] >= 0 else -1 for joint in keep]
    return Skeleton([ADULT.names[joint] for joint in keep], parents, np.asarray(ADULT.offsets)[keep])


def stand(neutral, pitches, yaw=0.0, lift=0.0):
    """Root (T, 3) m and local rotations (T, J, 4) of a neutral stance whose left foot has its heel up by `pitches` (T,)
    rad about a toe joint (ankle, without one) that stays `lift` m above where it stands."""
    skeleton, foot = neutral.skeleton, identify_joints(neutral.skeleton).left
    rotations = np.repeat(compute_local_rotations(skeleton, neutral.rotations)[None], len(pitches), axis=0)
    turn = quaternion.from_up_angle(np.full(len(pitches), yaw))
    rotations[:, 0] = quaternion.multiply(turn, rotations[:, 0])
    world = compute_pose(skeleton, np.zeros((len(pitches), 3)), rotations)[1]
    left = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    down = quaternion.multiply(quaternion.from_axis_angle(np.tile(left, (len(pitches), 1)), pitches),
                               world[:, foot.foot])
    moved = quaternion.multiply(quaternion.inverse(world[:, skeleton.parents[foot.foot]]), down)
    rotations[:, foot.foot] = np.where(pitches[:, None] == 0.0, rotations[:, foot.foot], moved)
    joint = foot.toe_or_foot
    places = compute_pose(skeleton, np.zeros((len(pitches), 3)), rotations)[0]
    return np.outer(neutral.positions[joint, 2] + lift - places[:, joint, 2], [0.0, 0.0, 1.0]), rotations


def measure_tip(neutral, root, rotations):
    """Heights (T,) m of the middle of the left boot's tip."""
    limb = identify_joints(neutral.skeleton).left
    joint, ahead = limb.toe_or_foot, neutral.tip if limb.toe is not None else neutral.ball[0][0] + neutral.tip
    places, world = compute_pose(neutral.skeleton, root, rotations)
    turn = quaternion.multiply(world[:, joint], quaternion.inverse(neutral.rotations[joint]))
    tip = np.array([ahead, 0.0, THICKNESS * neutral.leg - neutral.positions[joint, 2]])
    return (places[:, joint] + quaternion.rotate(turn, tip))[:, 2]


def measure_turn(before, after):
    """Angles (T, J) rad between two sets of rotations."""
    return 2.0 * np.arccos(np.clip(np.abs(np.sum(before * after, axis=-1)), 0.0, 1.0))


@pytest.fixture(scope="module")
def neutral():
    return build_neutral_stance(ADULT)


@pytest.fixture(scope="module")
def toeless():
    return build_neutral_stance(drop_toes())


@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_tips_end_at_the_ground_under_a_heel_that_rises(neutral, yaw):
    root, rotations = stand(neutral, PITCHES, yaw)
    before, after = (measure_tip(neutral, root, pose) for pose in (rotations, roll_toes(neutral, root, rotations)))
    assert before.min() < -0.03
    assert after == pytest.approx(np.maximum(before, -DEEPEST), abs=1e-6)


def test_only_the_toe_of_that_foot_bends_and_stays_a_rotation(neutral):
    root, rotations = stand(neutral, PITCHES)
    rolled, toe = roll_toes(neutral, root, rotations), identify_joints(ADULT).left.toe
    others = np.arange(len(ADULT)) != toe
    assert np.array_equal(rolled[:, others], rotations[:, others])
    assert np.linalg.norm(rolled, axis=-1) == pytest.approx(1.0, abs=1e-12)
    assert measure_turn(rotations, rolled)[-1, toe] > np.radians(20.0)


def test_a_flat_foot_and_a_body_in_the_air_stay_bit_for_bit(neutral):
    for pitches, lift in ((np.zeros(4), 0.0), (PITCHES, 0.3)):
        root, rotations = stand(neutral, pitches, lift=lift)
        rotations = rotations * np.where(np.arange(len(pitches)) % 2, -1.0, 1.0)[:, None, None]  # q and -q rotate alike
        assert np.array_equal(roll_toes(neutral, root, rotations), rotations)


def test_toes_bend_no_farther_than_they_can(neutral):
    root, rotations = stand(neutral, np.radians([88.0]))
    turn = measure_turn(rotations, roll_toes(neutral, root, rotations))
    assert turn.max() == pytest.approx(MOST_BEND, abs=1e-6)


def test_a_foot_without_a_toe_joint_turns_by_little(toeless):
    root, rotations = stand(toeless, np.radians([0.0, 15.0, 30.0, 60.0]))
    rolled = roll_toes(toeless, root, rotations)
    turn, foot = measure_turn(rotations, rolled), identify_joints(toeless.skeleton).left.foot
    assert turn[0].max() == 0.0 and turn[-1, foot] == pytest.approx(MOST_FOOT_TURN, abs=1e-6)
    assert np.all(np.delete(turn, foot, axis=1) < 1e-6) and np.all(turn <= MOST_FOOT_TURN + 1e-6)
    before, after = (measure_tip(toeless, root, pose) for pose in (rotations, rolled))
    assert after[1] == pytest.approx(-DEEPEST, abs=1e-6) and after[-1] > before[-1] + 0.02
