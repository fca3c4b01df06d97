"""Motions that were made each by itself, brought out of each other."""

import numpy as np
import pytest

from beyond_mocap.match.crowd.collision_avoidance import measure_overlap_depths, resolve_collisions
from beyond_mocap.match.crowd.correction import apply_correction
from beyond_mocap.match.crowd.spacing import compute_firmness
from beyond_mocap.motion.contacts import detect_contacts
from beyond_mocap.motion.motion import forward_kinematics, place_motion
from beyond_mocap.synthesis.quality.movement import compute_jerk, list_foot_joints, measure_contact_speeds
from beyond_mocap.synthetic.gait import build_gait

FPS = 30.0


@pytest.fixture(scope="module")
def passing():
    """Two who walk past each other shoulder to shoulder, and one who walks alone; all begin on frame 300."""
    walk, other = build_gait(1.4, 5.0, FPS, seed=1), build_gait(1.4, 5.0, FPS, seed=2)
    motions = [walk, place_motion(other, np.pi, (7.0, 0.47, 0.0)), place_motion(walk, 0.3, (0.0, 9.0, 0.0))]
    return motions, [detect_contacts(motion) for motion in motions], [300, 300, 300]


@pytest.fixture(scope="module")
def corrections(passing):
    return resolve_collisions(*passing, FPS)


def after(passing, corrections):
    return [apply_correction(motion, own, first) for motion, own, first in zip(passing[0], corrections, passing[2])]


def test_they_are_in_each_other_before_and_not_after(passing, corrections):
    before = measure_overlap_depths(passing[0], passing[2])
    assert before[0].max() > 0.04 and before[0].max() == before[1].max() and not before[2].any()
    assert max(own.max() for own in measure_overlap_depths(after(passing, corrections), passing[2])) < 0.02


def test_who_is_alone_is_left_alone(passing, corrections):
    assert not len(corrections[2].knots)
    assert after(passing, corrections)[2] is passing[0][2]


def test_feet_and_joints_move_as_smoothly_as_before(passing, corrections):
    for old, new, stands in zip(passing[0], after(passing, corrections), passing[1]):
        speeds, jerks = [], []
        for motion in (old, new):
            joints, _ = forward_kinematics(motion)
            speeds.append(np.nanmean(measure_contact_speeds(joints[:, list_foot_joints(motion.skeleton)], stands, FPS)))
            jerks.append(compute_jerk(joints, FPS).max())
        assert speeds[1] < speeds[0] + 0.004 and jerks[1] < 1.1 * jerks[0]


def test_the_same_input_gives_the_same_bits(passing, corrections):
    again = resolve_collisions(*passing, FPS)
    for one, other in zip(again, corrections):
        assert np.array_equal(one.values, other.values) and np.array_equal(one.knots, other.knots)


def test_who_touches_the_ball_gives_way_less(passing):
    firm = [np.ones(len(motion)) for motion in passing[0]]
    deepest = measure_overlap_depths(passing[0], passing[2])[0].argmax()
    firm[0] = compute_firmness(len(passing[0][0]), np.array([deepest]), FPS)
    found = resolve_collisions(*passing, FPS, firm)
    moved = [np.abs(own.build_curves(300, 150)[deepest - 5 : deepest + 6, :6]).max() for own in found]
    assert moved[0] < 0.5 * moved[1]


def test_two_who_both_touch_the_ball_as_they_meet_come_apart_too(passing):
    """A duel: neither wants to give way, and yet they are not to be in each other."""
    deepest = measure_overlap_depths(passing[0], passing[2])[0].argmax()
    firm = [compute_firmness(len(motion), np.array([deepest]), FPS) for motion in passing[0]]
    found = resolve_collisions(*passing, FPS, firm)
    assert max(own.max() for own in measure_overlap_depths(after(passing, found), passing[2])) < 0.02


def test_nobody_and_nothing():
    assert resolve_collisions([], [], [], FPS) == () and measure_overlap_depths([], []) == []


def test_who_comes_later_lies_on_the_same_clock(passing):
    late = passing[0][1].frames(40, 150)
    found = resolve_collisions([passing[0][0], late], [passing[1][0], passing[1][1][40:150]], [300, 340], FPS)
    moved = [apply_correction(motion, own, first) for motion, own,
             first in zip([passing[0][0], late], found, [300, 340])]
    assert max(own.max() for own in measure_overlap_depths(moved, [300, 340])) < 0.02
