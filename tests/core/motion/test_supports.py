"""Stances are where a foot is low, to a third of a frame, and phases of support end where a body flies."""

import numpy as np
import pytest

from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.motion.retargeting.neutral import build_neutral_stance
from beyond_mocap.motion.supports import (
    GRAVITY,
    Stances,
    find_lying_stretches,
    find_stances,
    find_support_phases,
    interpolate_contact_seconds,
    list_flights,
    measure_speed,
)  # fmt: skip

LIFT_SPEED = 3.0  # m/s at which the feet of these bodies leave the ground


@pytest.fixture(scope="module")
def skeleton():
    return build_adult_skeleton()


def pose_feet(skeleton, contacts, seconds, fps, speed=0.0):
    """(T, J, 3) m of a stiff body at a speed, whose left and right foot are on the ground from and to the given s."""
    body, times = identify_joints(skeleton), np.arange(int(round(seconds * fps)) + 1) / fps
    places = build_neutral_stance(skeleton).positions + times[:, None, None] * [speed, 0.0, 0.0]
    for limb, own in zip((body.left, body.right), contacts):
        away = np.min([np.maximum(np.maximum(on - times, times - off), 0.0) for on, off in own], axis=0)
        places[:, [limb.foot, limb.toe_or_foot], 2] += np.minimum(LIFT_SPEED * away, 0.3)[:, None]
    return places


def stances_of(*spans):
    start, stop = np.array(spans, float).reshape(-1, 2).T
    return Stances(np.arange(len(spans)) % 2, start, stop)


def level_centre(count, fps, speed=0.0):
    return np.column_stack([speed * np.arange(count) / fps, np.zeros(count), np.ones(count)])


@pytest.mark.parametrize("fps", [25.0, 30.0, 60.0])
def test_stances_are_found_to_a_third_of_a_frame(skeleton, fps):
    contacts = [(0.513, 0.741), (1.322, 1.604)], [(0.905, 1.137), (1.71, 1.958)]
    found = find_stances(skeleton, pose_feet(skeleton, contacts, 2.5, fps), fps)
    wanted = sorted((on, off, side) for side, own in enumerate(contacts) for on, off in own)
    late = fps * 0.03 / LIFT_SPEED  # frames until a foot that leaves is 3 cm high
    assert found.side.tolist() == [side for *_, side in wanted]
    assert found.start == pytest.approx([on * fps for on, *_ in wanted], abs=late + 0.05)
    assert found.stop == pytest.approx([off * fps for _, off, _ in wanted], abs=late + 0.05)
    assert late <= 0.3 * fps / 30.0


@pytest.mark.parametrize("speed, grows", [(1.0, False), (8.0, True)])
def test_only_runners_stances_grow_and_by_half_a_frame_of_a_take_at_most(skeleton, speed, grows):
    contacts = [(0.5, 0.55), (1.1, 1.15)], [(0.8, 0.85), (1.4, 1.45)]
    places = pose_feet(skeleton, contacts, 2.0, 60.0, speed)
    found, slow = find_stances(skeleton, places, 60.0), find_stances(skeleton, places * [0.0, 1.0, 1.0], 60.0)
    longer = (found.stop - found.start) - (slow.stop - slow.start)
    assert interpolate_contact_seconds(speed) > 0.1  # both are shorter than a runner's at that speed
    assert longer == pytest.approx(2.0 if grows else 0.0)


def test_a_stance_at_an_end_of_the_motion_ends_there(skeleton):
    found = find_stances(skeleton, pose_feet(skeleton, ([(-1.0, 0.1)], [(1.9, 3.0)]), 2.0, 30.0, 8.0), 30.0)
    assert found.start[0] == 0.0 and found.stop[-1] == 60.0


def test_a_gap_of_one_frame_is_no_flight(skeleton):
    contacts = [(0.5, 0.76), (0.81, 1.2)], [(1.5, 1.8)]
    assert len(find_stances(skeleton, pose_feet(skeleton, contacts, 2.0, 30.0), 30.0)) == 2


def test_the_share_of_a_stance_fades_beside_it():
    share = stances_of((10.0, 20.0)).compute_share(0, 40, 4.0)
    assert share[10:21] == pytest.approx(1.0) and share[22] == pytest.approx(0.5) and share[8] == pytest.approx(0.5)
    assert not share[:7].any() and not share[24:].any() and not stances_of((10.0, 20.0)).compute_share(1, 40, 4.0).any()


def test_a_runners_short_flights_are_flights_and_phases_cover_every_stance():
    spans = [(9.3 * k, 9.3 * k + 5.1) for k in range(12)]
    phases = find_support_phases(stances_of(*spans), level_centre(110, 30.0, 6.0), 30.0)
    assert phases == pytest.approx(np.array(spans)) and np.all(np.diff(phases.ravel()) > 0.0)


def test_overlapping_stances_are_one_phase_and_what_lies_before_and_behind_belongs_to_it():
    phases = find_support_phases(stances_of((5.0, 20.0), (15.0, 40.0), (38.0, 55.0)), level_centre(61, 30.0, 1.4), 30.0)
    assert phases.tolist() == [[0.0, 60.0]]


@pytest.mark.parametrize("seconds", [0.2, 1.0])
def test_a_body_that_hands_or_the_ground_carry_does_not_fly(seconds):
    gap = 30.0 * seconds
    phases = find_support_phases(stances_of((0.0, 20.0), (20.0 + gap, 60.0 + gap)), level_centre(91, 30.0), 30.0)
    assert len(phases) == 1


def test_a_jump_is_a_flight():
    times = np.arange(91) / 30.0
    height = 1.0 + np.where((times > 1.0) & (times < 1.5), 0.5 * GRAVITY * (times - 1.0) * (1.5 - times), 0.0)
    centre = np.column_stack([0.0 * times, 0.0 * times, height])
    phases = find_support_phases(stances_of((0.0, 30.0), (45.0, 90.0)), centre, 30.0)
    assert phases.tolist() == [[0.0, 30.0], [45.0, 90.0]]


def test_a_motion_without_stances_is_one_phase():
    none = Stances(np.zeros(0, int), np.zeros(0), np.zeros(0))
    assert find_support_phases(none, level_centre(20, 30.0, 6.0), 30.0).tolist() == [[0.0, 19.0]]


@pytest.mark.parametrize("count", [1, 2, 3])
def test_the_shortest_motions_have_stances_of_some_length(skeleton, count):
    places = pose_feet(skeleton, ([(0.0, 1.0)], [(0.0, 1.0)]), 1.0, 30.0)[:count]
    found = find_stances(skeleton, places, 30.0)
    assert len(found) == (0 if count == 1 else 2) and np.all(found.stop > found.start)
    assert find_support_phases(found, level_centre(count, 30.0), 30.0).tolist() == [[0.0, count - 1.0]]


def test_speed_is_level_and_without_steps():
    times = np.arange(120) / 30.0
    points = np.column_stack([6.0 * times + 0.01 * np.sin(20.0 * times), 0.0 * times, 3.0 * times])
    assert measure_speed(points, 30.0) == pytest.approx(6.0, abs=0.1)
    assert measure_speed(points[:1], 30.0).tolist() == [0.0]


def test_who_lies_for_one_frame_lies_half_a_frame_to_either_side(skeleton):
    places = np.repeat(build_neutral_stance(skeleton).positions[None], 20, axis=0)
    assert find_lying_stretches(skeleton, places).shape == (0, 2)
    places[[7, 19], identify_joints(skeleton).left.hand, 2] = 0.05
    places[10:14, identify_joints(skeleton).hips, 2] = 0.2
    assert find_lying_stretches(skeleton, places) == pytest.approx(np.array([[6.5, 7.5], [9.5, 13.5], [18.5, 19.0]]))


def test_a_hand_that_touches_the_ground_for_a_frame_ends_one_flight_and_begins_another():
    times = np.arange(41) / 30.0
    centre = np.column_stack([3.0 * times, 0.0 * times, 2.0 + 3.0 * times - 0.5 * GRAVITY * times**2])
    no_feet, lying = Stances(np.zeros(0, int), np.zeros(0), np.zeros(0)), np.array([[19.5, 20.5]])
    phases = find_support_phases(no_feet, centre, 30.0, lying)
    assert np.array_equal(phases, lying)
    assert np.array_equal(list_flights(phases, 41), [[0.0, 19.5], [20.5, 40.0]])
