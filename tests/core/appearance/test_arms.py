"""Arms and the trunk: planted depths are measured, arms inside come out smoothly, and others keep their bits."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.appearance.arm_clearance import CLEARANCE, clear_arms, list_arm_points, measure_arm_depth
from beyond_mocap.appearance.body import build_body
from beyond_mocap.appearance.mesh import deform_body
from beyond_mocap.appearance.trunk import SECTIONS, build_trunk, measure_depth, pose_trunk
from beyond_mocap.evaluation.naturalness_figures import summarize_arms
from beyond_mocap.evaluation.report import evaluate_played
from beyond_mocap.files.bvh.bvh import write_bvh
from beyond_mocap.library.build import build_library
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.mirror import mirror
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.motion.retargeting.neutral import build_neutral_stance
from beyond_mocap.synthesis.quality.playback import playback_from_tables
from beyond_mocap.synthetic.gait import build_gait

FPS = 60.0


@pytest.fixture(scope="module")
def walk():
    return build_gait(1.4, 4.0, FPS)


@pytest.fixture(scope="module")
def trunk(walk):
    return build_trunk(build_neutral_stance(walk.skeleton, walk))


@pytest.fixture(scope="module")
def folded(walk):
    """The walk, but half a second around 2 s the left arm swings into the belly and out again."""
    arm = identify_joints(walk.skeleton).left
    swing = 0.5 + 0.5 * np.cos(np.clip((np.arange(len(walk)) / FPS - 2.0) / 0.3, -1.0, 1.0) * np.pi)
    rotations = np.array(walk.rotations)
    for joint, axis, angle in ((arm.upper_arm, (1.0, 0.0, 0.0), -0.35), (arm.lower_arm, (0.0, 0.0, 1.0), -0.9),
                               (arm.lower_arm, (0.0, 1.0, 0.0), -0.9)):
        turn = quaternion.from_axis_angle(np.array(axis), angle * swing)
        rotations[:, joint] = quaternion.multiply(turn, rotations[:, joint])
    return replace(walk, rotations=rotations)


def measure(motion, trunk):
    return measure_arm_depth(motion.skeleton, *forward_kinematics(motion), trunk)


def test_the_sections_lie_in_the_skin_of_the_drawn_body():
    skeleton = build_adult_skeleton()
    body, stance = build_body(skeleton), build_neutral_stance(skeleton)
    pose = stance.positions[None], stance.rotations[None]
    skin = deform_body(body, skeleton, *(one[0] for one in pose))
    joints = identify_joints(skeleton)
    hips, shoulders = (0.5 * (stance.positions[a] + stance.positions[b]) for a, b in (
        (joints.left.upper_leg, joints.right.upper_leg), (joints.left.upper_arm, joints.right.upper_arm)))
    of_trunk = np.isin(body.joints, [joints.hips, *joints.spine]) * body.weights
    share = (skin[:, 2] - hips[2]) / (shoulders[2] - hips[2])
    chosen = skin[(of_trunk.sum(axis=1) > 0.6) & (share > 0.1) & (share < 0.8)]
    depth, _ = measure_depth(pose_trunk(build_trunk(stance), *pose), chosen[:, None])
    assert len(chosen) > 500 and abs(np.median(depth)) < 0.006 and np.percentile(np.abs(depth), 95) < 0.025


def test_a_planted_depth_is_measured_in_any_pose(walk, trunk):
    posed = pose_trunk(trunk, *forward_kinematics(walk))
    for number, (_, breadth, deep) in enumerate(SECTIONS[1:-1], 1):
        middle, axes = posed.middles[number], posed.axes[:, number]
        lengths = np.linalg.norm(axes, axis=-1)
        assert lengths == pytest.approx(trunk.scale * np.array([[breadth], [deep]]) * np.ones(len(walk)), rel=0.03)
        for axis, length in zip(axes, lengths):
            points = np.stack([middle + axis * (1.0 + off / length)[:, None] for off in (-0.04, 0.03)])
            depth, way = measure_depth(posed, points)
            assert depth == pytest.approx(np.array([[0.04], [-0.03]]) * np.ones(len(walk)), abs=0.012)
            assert np.all(np.sum(way * (axis / length[:, None]), axis=-1) > 0.9)


def test_arms_inside_come_out_smoothly(walk, folded, trunk):
    before, cleared = measure(folded, trunk), clear_arms(folded, trunk)
    after = measure(cleared, trunk)
    assert before.max() > 0.03 and after.max() < -0.8 * CLEARANCE * trunk.scale
    arm = identify_joints(walk.skeleton).left
    others = [joint for joint in range(len(walk.skeleton)) if joint != arm.upper_arm]
    assert np.array_equal(cleared.rotations[:, others], folded.rotations[:, others])
    same = np.all(cleared.rotations == folded.rotations, axis=(1, 2))
    assert same.sum() > 0.6 * len(walk) and not same[np.argmax(before)]

    def accelerate(motion):
        places = forward_kinematics(motion)[0][:, [arm.lower_arm, arm.hand]]
        return np.linalg.norm(np.diff(places, 2, axis=0), axis=-1).max() * FPS**2

    assert accelerate(cleared) < accelerate(folded) + 15.0
    turned = 2.0 * np.arccos(np.clip(np.abs(np.sum(cleared.rotations * folded.rotations, axis=-1)), 0.0, 1.0))
    assert turned.max() < np.radians(40.0)


def test_arms_outside_keep_their_bits(walk, trunk):
    assert measure(walk, trunk).max() < -CLEARANCE * trunk.scale
    assert clear_arms(walk, trunk) is walk


def test_left_and_right_are_cleared_alike(folded, trunk):
    there = forward_kinematics(clear_arms(mirror(folded), trunk))[0]
    back = forward_kinematics(mirror(clear_arms(folded, trunk)))[0]
    assert np.abs(there - back).max() < 2e-3


def test_points_of_an_arm_reach_from_elbow_to_knuckles(walk):
    places, limb = forward_kinematics(walk)[0], identify_joints(walk.skeleton).right
    points = list_arm_points(limb, places, 1.0)
    assert np.array_equal(points[0], places[:, limb.lower_arm]) and points[-2] == pytest.approx(places[:, limb.hand])
    assert np.linalg.norm(points[-1] - points[-2], axis=-1) == pytest.approx(0.09)


def test_a_library_clears_its_clips_once_and_says_so(folded, walk, tmp_path):
    write_bvh(tmp_path / "folded.bvh", folded)
    write_bvh(tmp_path / "walk.bvh", walk)
    for name in ("folded", "walk"):
        (tmp_path / f"{name}.txt").write_text("0 4 walking\n")
    library = build_library(tmp_path, cache_dir=tmp_path / "cache")
    assert [note for note in library.notes if note.startswith("arms moved out of the trunk in 1 clip, where they")]
    trunk = build_trunk(library.neutral_stance)
    assert len(library.clips) == 4 and all(measure(clip.motion, trunk).max() < -0.015 for clip in library.clips)


def test_the_report_says_how_long_and_how_deep(folded, trunk):
    depth = measure(folded, trunk)
    arms = evaluate_played(playback_from_tables(folded))["naturalness"]["arms"]
    assert arms["inside_share"] == pytest.approx(np.mean(depth > 0.0), abs=0.02)
    assert arms["depth_m_max"] == pytest.approx(depth.max(), abs=0.01)
    assert summarize_arms(np.array([-0.1, -np.inf])) == {"inside_share": 0.0, "depth_m_max": 0.0}
    assert np.isnan(summarize_arms(np.zeros(0))["inside_share"])
