"""Feet that slide by a known amount, and feet that stand still."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.synthesis.quality import movement

FPS = 30.0
STANCE, SWING = 12, 8


def walk(steps=12, slide=0.0):
    """A walk of alternating stances: feet (T, 2, 2, 3) m and contacts (T, 2). Planted feet slide `slide` m/s along
    +X."""
    cycle = STANCE + SWING
    count = steps * cycle
    frames = np.arange(count)
    planted, contacts = np.zeros((count, 2, 2, 3)), np.zeros((count, 2), bool)
    for side in (0, 1):
        phase = (frames + side * cycle // 2) % cycle
        stride = (frames + side * cycle // 2) // cycle
        contacts[:, side] = phase < STANCE
        swing = np.clip((phase - STANCE + 1) / (SWING + 1), 0, 1)
        # where a stance ends its slide, the swing takes over and brings the foot to the next place
        start = 1.2 * stride
        end = start + slide * (STANCE - 1) / FPS
        x = np.where(phase < STANCE, start + slide * phase / FPS, end + (1.2 * (stride + 1) - end) * swing)
        planted[:, side, :, 0] = x[:, None] + [0.0, 0.15]
        planted[:, side, :, 1] = 0.1 if side == 0 else -0.1
        lift = np.where(phase < STANCE, 0.0, 0.12 * np.sin(np.pi * swing))
        planted[:, side, :, 2] = lift[:, None] + [0.08, 0.0]
    return planted, contacts


@pytest.mark.parametrize("slide", [0.0, 0.02, 0.1])
def test_a_known_slide_is_found(slide):
    planted, contacts = walk(slide=slide)
    speeds = movement.measure_contact_speeds(planted, contacts, FPS)
    assert np.nanmean(speeds) == pytest.approx(slide, abs=1e-9)
    travel = movement.measure_stance_travel(planted[:, :, 1], movement.list_stances(contacts))
    assert np.median(travel) == pytest.approx(slide * (STANCE - 1) / FPS, rel=2e-3, abs=1e-9)


def test_only_steps_with_both_ends_in_contact_count():
    planted, contacts = walk()
    speeds = movement.measure_contact_speeds(planted, contacts, FPS)
    assert np.isfinite(speeds).sum() == (contacts[1:] & contacts[:-1]).sum()


def test_travel_is_the_widest_distance_in_any_direction_and_not_the_path():
    angle = np.linspace(0, 2 * np.pi, 40)
    toes = np.zeros((40, 2, 3))
    toes[:, 1, :2] = 0.03 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    contacts = np.ones((40, 2), bool)
    assert movement.measure_stance_travel(toes, movement.list_stances(contacts)) == pytest.approx([0.0, 0.06], rel=3e-3)


def test_stances_reach_both_ends_and_drop_single_frames():
    contacts = np.array([[1, 1, 0, 0, 1, 0, 1, 1, 1], [0] * 9], bool).T
    np.testing.assert_array_equal(movement.list_stances(contacts), [[0, 2, 0], [6, 9, 0]])
    assert movement.list_stances(np.zeros((5, 2), bool)).shape == (0, 3)
    assert len(movement.measure_stance_travel(np.zeros((5, 2, 3)), movement.list_stances(np.zeros((5, 2), bool)))) == 0


def test_gmd_counts_low_and_fast_and_lasting():
    toes = np.zeros((60, 2, 3))
    toes[:, 1, 2] = 1.0
    toes[20:40, 0, 0] = np.arange(20) * 0.6 / FPS
    toes[40:, 0, 0] = toes[39, 0, 0]
    skating = movement.find_skating_steps(toes, 0.0, FPS)
    assert skating[23:36].all() and not skating[:17].any() and not skating[43:].any()
    assert not movement.find_skating_steps(toes, -0.06, FPS).any()
    assert not movement.find_skating_steps(toes * [0.7, 1, 1], 0.0, FPS).any()


def test_a_still_body_does_not_skate():
    planted, contacts = walk()
    planted = np.repeat(planted[:1], 50, axis=0)
    assert np.nanmax(movement.measure_contact_speeds(planted, np.ones((50, 2), bool), FPS)) == 0.0
    assert not movement.find_skating_steps(planted[:, :, 1], 0.0, FPS).any()


def test_support_height_takes_the_part_of_the_foot_that_is_down():
    planted = np.zeros((3, 2, 2, 3))
    planted[:, 0, :, 2] = [[0.08, 0.0], [0.08, 0.06], [0.15, 0.01]]
    planted[:, 1, :, 2] = 0.5
    contacts = np.array([[1, 0]] * 3, bool)
    np.testing.assert_allclose(movement.measure_support_height(planted, contacts, 0.08)[:, 0], [0.0, 0.0, 0.01],
                               atol=1e-12)
    assert np.isnan(movement.measure_support_height(planted, contacts, 0.08)[:, 1]).all()


def test_foot_joints_are_ankle_and_toe():
    skeleton = build_adult_skeleton()
    names = [[skeleton.names[joint] for joint in side] for side in movement.list_foot_joints(skeleton)]
    assert names == [["LeftFoot", "LeftToeBase"], ["RightFoot", "RightToeBase"]]


def test_the_boots_tip_is_seen_where_there_is_no_toe_joint():
    skeleton = build_adult_skeleton()
    body = identify_joints(skeleton)
    foot = body.left.toe_or_foot
    skeleton = replace(skeleton, end_parents=(foot,), end_offsets=np.array([[0.2, 0.0, -0.1]]))
    positions, rotations = np.zeros((2, len(skeleton), 3)), np.tile([1.0, 0, 0, 0], (2, len(skeleton), 1))
    positions[1, foot, 2] = 0.25
    np.testing.assert_allclose(movement.measure_tip_height(skeleton, positions, rotations), [-0.1, 0.15])
    bare = replace(skeleton, end_parents=(), end_offsets=np.zeros((0, 3)))
    assert np.isnan(movement.measure_tip_height(bare, positions, rotations)).all()
