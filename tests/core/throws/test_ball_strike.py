"""What a foot gives a ball that lies, and kicks made to hit."""

import numpy as np
import pytest

from beyond_mocap.annotation.striking import FOOT_RADIUS, measure_ball_gap
from beyond_mocap.ball.flight import Launch, find_crossing, simulate_flight
from beyond_mocap.ball.physics import FOOTBALL
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthetic.gestures import build_strike
from beyond_mocap.throws.ball_release import (
    SPEED_RATIO,
    AtFoot,
    compute_launch,
    find_rest_positions,
    sample_points,
    strike_ball,
)
from beyond_mocap.throws.corrected_motion import Freedom
from beyond_mocap.throws.correction import correct_motion
from beyond_mocap.throws.foot_tilt import point_foot

R = FOOTBALL.radius
ANCHORED = Freedom(rotation=0.0, pace=0.0, start_position=False)  # position, heading and frames stay


def one(ends, velocity, centre):
    found = strike_ball(np.array([ends], float), np.array([[velocity, velocity]], float), FOOT_RADIUS,
                        np.array([centre], float), FOOTBALL)  # fmt: skip
    return found.velocity[0], found.spin[0], found.gap[0]


def test_met_square_it_leaves_a_fifth_faster_without_spin():
    foot = [[-FOOT_RADIUS - R, 0.1, R], [-FOOT_RADIUS - R, -0.1, R]]
    velocity, spin, gap = one(foot, [20.0, 0.0, 0.0], [0.0, 0.0, R])
    assert np.allclose(velocity, [20.0 * SPEED_RATIO, 0.0, 0.0]) and np.allclose(spin, 0.0) and abs(gap) < 1e-12


def test_met_below_its_middle_it_rises_and_spins_backward():
    low = np.array([-np.sqrt((FOOT_RADIUS + R) ** 2 - 0.06**2), 0.0, R - 0.06])
    velocity, spin, _ = one([low + [0.0, 0.1, 0.0], low - [0.0, 0.1, 0.0]], [20.0, 0.0, 0.0], [0.0, 0.0, R])
    assert 5.0 < np.degrees(np.arctan2(velocity[2], velocity[0])) < 22.0
    assert spin[1] < -5.0 and np.allclose(spin[[0, 2]], 0.0)


def test_friction_has_its_end():
    # a foot that brushes along the ball hardly moves it
    foot = [[-FOOT_RADIUS - R, 0.1, R], [-FOOT_RADIUS - R, -0.1, R]]
    velocity, _, _ = one(foot, [1.0, 20.0, 0.0], [0.0, 0.0, R])
    assert np.allclose(velocity[0], SPEED_RATIO) and 0.0 < velocity[1] < 0.5 * SPEED_RATIO


@pytest.mark.parametrize("lies", [True, False])
def test_a_kick_hits_another_target(lies):
    made = build_strike("kick low top", fps=30.0)
    frame, target = made.key * 30.0, np.array([15.0, 0.0, 0.8])
    start = compute_launch(made.motion, AtFoot("right"), frame, target, FOOTBALL)[0]
    target = start + [9.0, 0.6, 0.5]
    part = AtFoot("right", start if lies else None)
    found = correct_motion(made.motion, part, frame, target, FOOTBALL, ANCHORED)
    flight = simulate_flight(Launch(0.0, found.position, found.velocity, found.spin), FOOTBALL, 3.0)
    assert np.linalg.norm(find_crossing(flight, target) - target) < 0.02 and found.displacement < 0.10
    if lies:
        assert np.allclose(found.position, start)
    # the foot touches the ball then, and was not in it a frame before
    assert found.gap < 1e-3
    places, turns = forward_kinematics(found.motion)
    gaps = measure_ball_gap(part.find_surface(found.motion).compute_line(places, turns), FOOT_RADIUS, found.position, R)
    assert gaps[: int(found.frame)].min() > -0.01
    legs = identify_joints(found.motion.skeleton).right
    changed = set(np.argwhere(np.any(found.motion.rotations != made.motion.rotations, axis=2))[:, 1])
    assert changed <= {legs.upper_leg, legs.lower_leg, legs.foot, legs.toe}
    assert places[:, legs.toe, 2].min() > -0.02


def test_a_pointed_foot_lowers_its_toe_alone_and_only_in_the_swing():
    made = build_strike("kick low top", fps=30.0)
    part, frame = AtFoot("right"), made.key * 30.0
    pointed = point_foot(made.motion, part, frame, np.radians(20.0))
    before, after = (sample_points(motion, part, np.array([frame]))[0] for motion in (made.motion, pointed))
    assert np.allclose(before[0], after[0])
    # about a level axis: the toe stays in the vertical plane of the foot, and the angle is the one asked for
    lines = np.array([before[1] - before[0], after[1] - after[0]])
    dips = np.degrees(np.arctan2(-lines[:, 2], np.hypot(*lines[:, :2].T)))
    assert abs(dips[1] - dips[0] - 20.0) < 1.0 and abs(np.cross(*lines[:, :2])) < 1e-3
    first, last = part.find_frame_range(made.motion, frame)
    changed = np.flatnonzero(np.any(pointed.rotations != made.motion.rotations, axis=(1, 2)))
    assert first <= changed[0] and changed[-1] <= last and np.ptp(changed) <= 0.4 * 30.0


@pytest.mark.parametrize("height", [0.0, 0.06, 0.11])
def test_a_ball_on_the_ground_is_found_that_the_foot_sends_to_the_target(height):
    foot = np.array([[[0.3, 0.2 + side, R + height] for side in (0.1, -0.1)]])
    velocity = np.tile([18.0, 2.0, 0.0], (1, 2, 1))
    target = np.array([12.0, 1.0, 0.5])
    centre = find_rest_positions(foot, velocity, target, FOOTBALL)
    struck = strike_ball(foot, velocity, FOOT_RADIUS, centre, FOOTBALL)
    assert centre[0, 2] == R and abs(struck.gap[0]) < 1e-4
    aside = np.arctan2(*struck.velocity[0, 1::-1]) - np.arctan2(*(target - centre[0])[1::-1])
    assert abs(aside) < np.radians(2.0)


def test_a_foot_above_every_ball_on_the_ground_leaves_a_gap():
    foot = np.array([[[0.0, 0.1, 0.7], [0.0, -0.1, 0.7]]])
    centre = find_rest_positions(foot, np.tile([18.0, 0.0, 0.0], (1, 2, 1)), np.array([9.0, 0.0, 0.0]), FOOTBALL)
    gap = strike_ball(foot, np.tile([18.0, 0.0, 0.0], (1, 2, 1)), FOOT_RADIUS, centre, FOOTBALL).gap[0]
    assert 0.7 - 2.0 * R - FOOT_RADIUS - 1e-9 <= gap < 0.7
