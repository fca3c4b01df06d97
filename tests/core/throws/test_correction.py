"""A throw that is aimed at one target and corrected to another: the ball hits, and little is changed."""

import numpy as np
import pytest

from beyond_mocap.ball.flight import Launch, find_crossing, simulate_flight
from beyond_mocap.ball.physics import BASEBALL
from beyond_mocap.base.errors import InputError
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthetic.throws import build_throw
from beyond_mocap.throws.ball_release import InHand, sample_points
from beyond_mocap.throws.corrected_motion import Freedom
from beyond_mocap.throws.correction import correct_motion
from beyond_mocap.throws.limb_shift import solve_shifts

ANCHORED = Freedom(rotation=0.0, pace=0.0, start_position=False)  # position, heading and frames stay


def impact(found, target):
    flight = simulate_flight(Launch(0.0, found.position, found.velocity, found.spin), BASEBALL, 3.0)
    return float(np.linalg.norm(find_crossing(flight, target) - target))


@pytest.mark.parametrize("freedom", [Freedom(), ANCHORED])
@pytest.mark.parametrize("speed, arm, aside", [(15.0, "right", (0.2, -0.6, 0.3)), (24.0, "left", (0.5, 0.5, -0.4))])
def test_hits_another_target(freedom, speed, arm, aside):
    made = build_throw((0.8 * speed, 0.0, 1.2), speed, arm, fps=30.0)
    target = np.array([0.8 * speed, 0.0, 1.2]) + aside
    found = correct_motion(made.motion, InHand(arm, made.grip), made.release * 30.0, target, BASEBALL, freedom)
    assert impact(found, target) < 0.02
    assert found.displacement < 0.05
    if not freedom.rotation:
        assert found.rotation == 0.0 and found.pace == 1.0 and len(found.motion) == len(made.motion)


def test_the_ball_is_where_the_hand_is_and_as_fast():
    made = build_throw((16.0, 0.0, 1.2), 20.0, fps=30.0)
    part = InHand("right", made.grip)
    found = correct_motion(made.motion, part, made.release * 30.0, np.array([16.0, 0.8, 1.0]), BASEBALL, ANCHORED)
    near = found.frame + np.array([-1e-3, 0.0, 1e-3])
    ball = sample_points(found.motion, part, near)[:, 0]
    assert np.allclose(ball[1], found.position, atol=1e-9)
    assert np.allclose((ball[2] - ball[0]) * 30.0 / 2e-3, found.velocity, atol=1e-3)


def test_only_the_arm_near_the_release_is_changed():
    made = build_throw((16.0, 0.0, 1.2), 20.0, fps=30.0)
    found = correct_motion(
        made.motion, InHand("right", made.grip), made.release * 30.0, np.array([16.0, 0.8, 1.0]), BASEBALL,
        ANCHORED,
    )  # fmt: skip
    changed = np.argwhere(np.any(found.motion.rotations != made.motion.rotations, axis=2))
    arm = identify_joints(made.motion.skeleton).right
    assert set(changed[:, 1]) <= {arm.upper_arm, arm.lower_arm, arm.hand}
    assert np.abs(changed[:, 0] - found.frame).max() <= 0.4 * 30.0 + 1.0
    assert np.array_equal(found.motion.root_positions, made.motion.root_positions)
    places, old = forward_kinematics(found.motion)[0], forward_kinematics(made.motion)[0]
    bones = np.linalg.norm(places[:, arm.hand] - places[:, arm.lower_arm], axis=-1)
    assert np.ptp(bones) < 1e-9
    assert np.isclose(np.linalg.norm(places[:, arm.hand] - old[:, arm.hand], axis=-1).max(), found.displacement)


def test_a_throw_that_hits_stays_as_it_is():
    made = build_throw((12.0, 0.0, 1.2), 15.0, fps=60.0)
    part = InHand("right", made.grip)
    first = correct_motion(made.motion, part, made.release * 60.0, np.array([12.0, 0.3, 1.0]), BASEBALL)
    again = correct_motion(first.motion, part, first.frame, np.array([12.0, 0.3, 1.0]), BASEBALL)
    assert again.displacement < 0.004 and abs(again.rotation) < np.radians(0.3)


def test_the_shift_has_the_place_and_velocity_asked():
    shifts = solve_shifts(20.3, 5, 35, 60.0)
    moves = shifts.compute_shift(np.array([0.03, 0.0, -0.01]), np.array([0.0, 1.0, 0.5]))
    from scipy.interpolate import CubicSpline

    curve = CubicSpline(np.arange(3, 38), np.pad(moves, ((2, 2), (0, 0))))
    assert np.allclose(curve(20.3), [0.03, 0.0, -0.01], atol=1e-9)
    assert np.allclose(60.0 * curve(20.3, 1), [0.0, 1.0, 0.5], atol=1e-9)
    assert np.abs(moves[[0, -1]]).max() < 0.002


def test_refuses_what_cannot_be():
    made = build_throw((12.0, 0.0, 1.2), 15.0, fps=30.0)
    part, frame = InHand("right", made.grip), made.release * 30.0
    with pytest.raises(InputError, match="frames before and after"):
        correct_motion(made.motion, part, 1.0, np.array([12.0, 0.0, 1.0]), BASEBALL)
    with pytest.raises(InputError, match="some distance away"):
        correct_motion(made.motion, part, frame, sample_points(made.motion, part, np.array([frame]))[0, 0], BASEBALL)


def test_a_joint_that_may_not_turn_further_does_not_and_the_ball_hits_all_the_same():
    made = build_throw((16.0, 0.0, 1.2), 20.0, fps=30.0)
    part, target = InHand("right", made.grip), np.array([16.3, -0.6, 1.5])
    arm = identify_joints(made.motion.skeleton).right

    def stiff(rotations, given):
        """The wrist stays as it was."""
        return np.concatenate([rotations[:, :2], given[:, 2:]], axis=1)

    free, held = (
        correct_motion(made.motion, part, made.release * 30.0, target, BASEBALL, ANCHORED, None, hold)
        for hold in (None, stiff)
    )
    assert np.any(free.motion.rotations[:, arm.hand] != made.motion.rotations[:, arm.hand])
    assert np.array_equal(held.motion.rotations[:, arm.hand], made.motion.rotations[:, arm.hand])
    assert impact(held, target) < 0.02 and held.displacement < 0.05
