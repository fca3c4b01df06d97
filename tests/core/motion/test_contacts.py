"""Contacts against gaits whose steps are known, and what a foot in the air must never be taken for."""

import pathlib
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.files.bvh import bvh
from beyond_mocap.motion import contacts, quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.mirror import mirror
from beyond_mocap.motion.motion import Motion, forward_kinematics
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.motion.retargeting.neutral import build_neutral_stance
from beyond_mocap.synthetic.gait import GaitStyle, build_gait, plan_footsteps, plan_gait

MOCAP = pathlib.Path(__file__).parents[3] / "../shared/data/mocap"


def planted(speed: float, fps: float, seconds: float = 5.0) -> np.ndarray:
    """When the made gait's feet stand: (T, 2)."""
    neutral = build_neutral_stance(build_adult_skeleton())
    course = plan_gait(speed, seconds, fps, neutral)
    times = course.times[course.requested_slice]
    return np.stack([plan_footsteps(course, neutral, GaitStyle(), side).is_in_contact(times) for side in (0, 1)],
                    axis=1)


def stances(motion: Motion) -> np.ndarray:
    """Where a foot stands by its heel or its toe: (T, 2)."""
    return contacts.detect_heel_toe_contacts(motion).any(axis=2)


def moved(motion: Motion, velocity) -> Motion:
    """The whole motion drifting at `velocity` (3,) m/s."""
    seconds = np.arange(len(motion))[:, None] / motion.fps
    return replace(motion, root_positions=motion.root_positions + seconds * np.asarray(velocity))


def standing(seconds: float = 4.0, fps: float = 60.0) -> Motion:
    return build_gait(0.0, seconds, fps)


@pytest.mark.parametrize("fps", [30.0, 60.0, 250.0])
@pytest.mark.parametrize("speed", [0.6, 1.4, 2.5, 3.5, 5.0, 7.0, 9.0])
def test_planted_steps_are_found_at_any_speed_and_rate(speed, fps):
    truth, found = planted(speed, fps), stances(build_gait(speed, 5.0, fps))
    assert np.mean(truth == found) > 0.93
    begins = [np.count_nonzero(np.diff(c.astype(int), axis=0) == 1) for c in (truth, found)]
    assert abs(begins[0] - begins[1]) <= 1  # one may begin within the first frames


def test_a_flat_foot_stands_and_does_not_travel():
    motion = build_gait(1.4, 5.0, 60.0)
    flat, body = contacts.detect_contacts(motion), identify_joints(motion.skeleton)
    assert not np.any(flat & ~stances(motion)) and np.all((0.3 < flat.mean(axis=0)) & (flat.mean(axis=0) < 0.6))
    positions, _ = forward_kinematics(motion)
    for side, limb in enumerate((body.left, body.right)):
        for joint in (limb.foot, limb.toe):
            speed = 60.0 * np.linalg.norm(np.diff(positions[:, joint, :2], axis=0), axis=1)
            assert speed[flat[1:, side] & flat[:-1, side]].mean() < 0.12


def test_a_suit_that_slides_and_floats_still_shows_its_steps():
    truth, motion = planted(1.4, 60.0), build_gait(1.4, 5.0, 60.0)
    found = stances(moved(motion, (0.3, 0.25, 0.05)))
    assert np.mean(truth == found) > 0.9


def test_standing_is_contact_throughout():
    assert np.all(contacts.detect_contacts(standing()))


def test_no_contact_in_the_flight_of_a_jump():
    motion = standing(3.0)
    rise = np.zeros(len(motion))
    rise[60:91] = 0.3 * (1.0 - np.linspace(-1, 1, 31) ** 2)
    found = contacts.detect_contacts(replace(motion, root_positions=motion.root_positions + rise[:, None]
                                             * (0.0, 0.0, 1.0)))
    assert not found[65:86].any() and found[:60].all() and found[92:].all()


def test_a_foot_held_up_for_long_does_not_stand():
    motion = standing(5.0)
    body, rotations = identify_joints(motion.skeleton), motion.rotations.copy()
    swing = quaternion.from_axis_angle(np.array([0.0, 1.0, 0.0]), np.radians(-80.0))
    rotations[:, body.left.upper_leg] = quaternion.multiply(rotations[:, body.left.upper_leg], swing)
    rotations[:, body.left.lower_leg] = quaternion.multiply(
        rotations[:, body.left.lower_leg], quaternion.inverse(swing)
    )
    found = contacts.detect_contacts(replace(motion, rotations=rotations))
    assert not found[:, 0].any() and found[:, 1].all()
    assert not contacts.detect_heel_toe_contacts(replace(motion, rotations=rotations))[:, 0].any()


def test_raised_feet_of_a_lying_body_do_not_stand():
    upright, half = standing(4.0), 120
    back = quaternion.from_axis_angle(np.array([0.0, 1.0, 0.0]), np.radians(-90.0))
    rotations, root = upright.rotations.copy(), upright.root_positions.copy()
    rotations[half:, 0] = quaternion.multiply(back, rotations[half:, 0])
    root[half:, 2] = 0.25
    found = contacts.detect_contacts(replace(upright, rotations=rotations, root_positions=root))
    assert found[: half - 5].all() and not found[half + 5 :].any()


def test_a_mirrored_body_has_its_contacts_mirrored():
    motion = build_gait(1.6, 4.0, 60.0, turn_rate=0.5)
    assert np.mean(contacts.detect_contacts(mirror(motion)) == contacts.detect_contacts(motion)[:, ::-1]) > 0.999


def test_short_clips_have_an_answer():
    motion = standing(1.0)
    for frames in (1, 2, 3):
        assert contacts.detect_contacts(motion.frames(0, frames)).shape == (frames, 2)


def test_the_floor_is_where_the_toes_are_lowest():
    motion = build_gait(1.4, 4.0)
    floor = contacts.measure_floor_height(motion)
    raised = replace(motion, root_positions=motion.root_positions + (0.0, 0.0, 0.7))
    assert contacts.measure_floor_height(raised) == pytest.approx(floor + 0.7)
    assert 0.0 <= floor < 0.06


@pytest.mark.skipif(not MOCAP.is_dir(), reason="recordings: no ../shared/data/mocap beside the clone")
@pytest.mark.parametrize(
    "pattern, low, high, in_the_air",
    [
        ("cmu10/train_walking_*.bvh", 0.4, 0.7, 0.0),
        ("lafan1/walk2_*.bvh", 0.55, 0.8, 0.0),
        ("cmu10/train_running_*.bvh", 0.18, 0.4, 0.25),
        ("runs15/*forward0[2468].bvh", 0.18, 0.4, 0.25),
        ("sprinter/run0900cms.bvh", 0.05, 0.22, 0.6),
        ("cmu10/train_jumping_*.bvh", 0.35, 0.9, 0.1),
    ],
)
def test_shares_of_contact_in_recordings(pattern, low, high, in_the_air):
    for path in sorted(MOCAP.glob(pattern)):
        found = stances(bvh.read_bvh(path).motion)
        assert np.all((low < found.mean(axis=0)) & (found.mean(axis=0) < high)), path.name
        assert in_the_air <= np.mean(~found.any(axis=1)), path.name
