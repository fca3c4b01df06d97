"""A planted dive: a body that leaves the ground on a known parabola, leaning more and more; what is made behind it."""

import numpy as np
import pytest

from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.mirror import mirror
from beyond_mocap.motion.motion import Motion, compute_pose, forward_kinematics
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.motion.retargeting.neutral import build_neutral_stance
from beyond_mocap.motion.spring import Offset
from beyond_mocap.synthetic.landing import add_landing, ends_in_flight
from beyond_mocap.synthetic.lying import build_lying_pose, compute_lowest_root, compute_thickness
from beyond_mocap.synthetic.moves import build_get_up

FPS = 100.0
SKELETON = build_adult_skeleton()
BODY = identify_joints(SKELETON)


def middles(motion: Motion) -> np.ndarray:
    """(T, 3) m of the body's middle."""
    places, _ = forward_kinematics(motion)
    return places[:, BODY.hips] + 0.25 * (places[:, BODY.neck] - places[:, BODY.hips])


@pytest.fixture(scope="module")
def dive(flight) -> Motion:
    return flight.motion


@pytest.fixture(scope="module")
def whole(dive):
    return add_landing(dive, [build_get_up(SKELETON, 60.0).motion])


def test_a_spring_starts_where_it_is_told_and_fades():
    start = Offset(np.array([0.3]), np.array([-2.0]), np.array([5.0]))
    seconds = np.linspace(0.0, 2.0, 4001)
    found = start.evaluate_decay(seconds, 9.0)
    assert (found.place[0], found.speed[0], found.acceleration[0]) == pytest.approx((0.3, -2.0, 5.0))
    assert np.gradient(found.place[:, 0], seconds) == pytest.approx(found.speed[:, 0], abs=0.01)
    assert np.gradient(found.speed[:, 0], seconds) == pytest.approx(found.acceleration[:, 0], abs=0.05)
    third = np.gradient(found.acceleration[:, 0], seconds)
    balance = third + 27.0 * found.acceleration[:, 0] + 243.0 * found.speed[:, 0] + 729.0 * found.place[:, 0]
    assert np.abs(balance[5:-5]).max() < 0.5
    assert abs(found.place[-1, 0]) < 1e-4


@pytest.mark.parametrize("settled", [False, True])
def test_lying_on_the_side_is_low_and_the_same_on_both(settled):
    neutral = build_neutral_stance(SKELETON)
    poses = np.array([build_lying_pose(neutral, left, settled) for left in (True, False)])
    root = np.zeros((2, 3))
    root[:, 2] = compute_lowest_root(SKELETON, poses)
    places, _ = compute_pose(SKELETON, root, poses)
    assert (places[..., 2] > 0.0).all() and (places[..., 2] - compute_thickness(SKELETON)).min() == pytest.approx(0.0,
            abs=0.02)
    assert places[:, BODY.hips, 2].max() < 0.25 and places[:, BODY.neck, 2].max() < 0.35
    across = places[:, BODY.left.upper_leg] - places[:, BODY.right.upper_leg]
    assert across[0, 2] < -0.1 and across[1, 2] > 0.1
    other = places[1][list(BODY.mirror)] * [1.0, -1.0, 1.0]
    assert other - other[BODY.hips] == pytest.approx(places[0] - places[0][BODY.hips], abs=0.02)


def test_only_a_leaning_body_in_the_air_ends_in_flight(dive):
    up = build_get_up(SKELETON, FPS).motion
    assert ends_in_flight(dive)
    assert not ends_in_flight(up) and not ends_in_flight(up.frames(0, 40))  # standing, lying
    low = np.array(dive.root_positions)
    low[:, 2] -= low[-1, 2] - compute_lowest_root(SKELETON, dive.rotations[-1:])[0] - 0.1
    assert not ends_in_flight(Motion(SKELETON, low, dive.rotations, FPS))
    upright = np.array(dive.rotations)
    upright[:, 0] = up.rotations[-1, 0]
    assert not ends_in_flight(Motion(SKELETON, dive.root_positions, upright, FPS))


def test_the_recording_stays_and_its_speeds_go_on(dive, whole):
    assert whole.recorded_count == len(dive)
    assert np.array_equal(whole.motion.root_positions[: len(dive)], dive.root_positions)
    assert np.array_equal(whole.motion.rotations[: len(dive)], dive.rotations)
    places, _ = forward_kinematics(whole.motion)
    speed = np.diff(places, axis=0) * FPS
    jump = np.linalg.norm(np.diff(speed, axis=0), axis=-1)[len(dive) - 4 : len(dive) + 4]
    assert jump.max() < 0.35  # a tenth of a second of gravity is 0.1 m/s


def test_the_middle_falls_as_a_stone_until_it_is_down(flight, whole):
    found = middles(whole.motion)[whole.recorded_count : whole.touch_frame]
    wanted = flight.compute_middle(np.arange(1, len(found) + 1) / FPS)
    assert len(found) > 20
    assert found[:, :2] == pytest.approx(wanted[:, :2], abs=0.01)
    assert found[:-8, 2] == pytest.approx(wanted[:-8, 2], abs=0.02)  # the ground takes it up over the last centimetres


def test_the_ground_stops_it_and_nothing_goes_below(whole):
    after = whole.motion.frames(whole.recorded_count, len(whole.motion))
    places, _ = forward_kinematics(after)
    assert places[..., 2].min() > 0.0
    height = places[: whole.rise_frame - whole.recorded_count, BODY.hips, 2]
    down = whole.touch_frame - whole.recorded_count + int(0.15 * FPS)
    assert height[down : down + 40].max() < 0.3 and np.ptp(height[down : down + 40]) < 0.12  # no bounce
    lies = slice(down + 15, whole.rise_frame - whole.recorded_count - 12)
    assert np.linalg.norm(np.diff(places[lies, BODY.hips, :2], axis=0), axis=1).max() * FPS < 0.5


def test_it_lies_on_the_side_it_dived_to_and_stands_up(dive, whole):
    places, _ = forward_kinematics(whole.motion)
    across = places[:, BODY.left.upper_leg] - places[:, BODY.right.upper_leg]
    settled = whole.touch_frame + int(0.3 * FPS)
    assert across[settled, 2] < -0.08
    assert places[settled, BODY.neck, 1] > places[settled, BODY.hips, 1]  # the head lies where it dived to
    assert places[-1, BODY.hips, 2] > 0.85 and places[-1, BODY.neck, 2] > 1.3


def test_a_mirrored_dive_comes_down_mirrored(dive, whole):
    twin = add_landing(mirror(dive), [mirror(build_get_up(SKELETON, 60.0).motion)])
    expected, _ = forward_kinematics(mirror(whole.motion))
    found, _ = forward_kinematics(twin.motion)
    assert len(found) == len(expected)
    assert np.abs(found - expected).max() < 0.02


def test_the_way_up_that_needs_less_turning_is_taken(dive):
    back = build_get_up(SKELETON, 60.0).motion
    lying = add_landing(dive, [back])
    turn = quaternion.multiply(lying.motion.rotations[lying.rise_frame - 30, 0],
                               quaternion.inverse(back.rotations[0, 0]))
    rotations = np.array(back.rotations)
    rotations[:, 0] = quaternion.multiply(turn, rotations[:, 0])
    from_the_side = Motion(SKELETON, back.root_positions, rotations, 60.0)
    assert add_landing(dive, [back, from_the_side]).get_up_index == 1 and add_landing(dive,
            [from_the_side, back]).get_up_index == 0


def test_frames_behind_a_jump_of_markers_near_the_end_are_made_too(dive):
    broken = np.array(dive.rotations)
    elbow = BODY.left.lower_arm
    broken[-5:, elbow] = quaternion.multiply(
        broken[-5:, elbow], quaternion.from_rotation_vector(np.array([0.0, 1.2, 0.0]))
    )
    found = add_landing(Motion(SKELETON, dive.root_positions, broken, FPS), [build_get_up(SKELETON, 60.0).motion])
    assert found.recorded_count == len(dive) - 5
