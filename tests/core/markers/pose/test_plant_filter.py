"""The foot-plant filter: floating feet stand still, and bones stay as long as they are."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.markers.pose.plant_filter import (
    compute_hold_shift,
    detect_contacts,
    detect_stances,
    filter_foot_plants,
)
from beyond_mocap.motion.contacts import detect_heel_toe_contacts
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import Motion, compute_pose
from beyond_mocap.synthetic.gait import build_gait

FPS = 200.0


@pytest.fixture(scope="module")
def standing():
    """Three seconds of one pose."""
    pose = build_gait(1.4, 1.0, FPS)
    frames = np.full(600, 40)
    return Motion(pose.skeleton, pose.root_positions[frames], pose.rotations[frames], FPS)


def feet(motion):
    """Ankles and toes (T, 2, 2, 3)."""
    body = identify_joints(motion.skeleton)
    places, _ = compute_pose(motion.skeleton, motion.root_positions, motion.rotations)
    return np.stack([places[:, [limb.foot, limb.toe_or_foot]] for limb in (body.left, body.right)], axis=1)


def floating(motion, reach=0.002, hertz=0.4):
    """The motion with its whole body floating to and fro."""
    wave = reach * np.sin(2.0 * np.pi * hertz * np.arange(len(motion)) / motion.fps)
    return replace(motion, root_positions=motion.root_positions + wave[:, None] * [1.0, 0.5, 0.0])


def test_floating_feet_stand_still(standing):
    out = filter_foot_plants(floating(standing))
    travel = [np.ptp(feet(m)[..., :2], axis=0).max() for m in (floating(standing), out.motion)]
    assert out.held.all() and travel[0] > 0.003 and travel[1] < 2e-4
    assert np.array_equal(out.motion.root_positions, floating(standing).root_positions)


def test_bones_keep_their_length_and_the_rest_of_the_body_its_pose(standing):
    before = floating(standing)
    out = filter_foot_plants(before).motion
    body = identify_joints(out.skeleton)
    legs = [j for limb in (body.left, body.right) for j in (limb.upper_leg, limb.lower_leg, limb.foot)]
    others = [j for j in range(len(out.skeleton)) if j not in legs]
    assert np.array_equal(out.rotations[:, others], before.rotations[:, others])
    assert not np.array_equal(out.rotations[:, legs], before.rotations[:, legs])


@pytest.mark.parametrize("speed", [1.4, 7.0])
def test_short_stances_of_a_gait_are_held(speed):
    """A sprinter's stance lasts 0.1 s, a fifth of the source's window."""
    gait = floating(build_gait(speed, 3.0, FPS), 0.01, 2.0)
    out = filter_foot_plants(gait)
    toes = detect_heel_toe_contacts(gait)[..., 1]
    before, after = (np.median(np.linalg.norm(np.gradient(feet(m)[:, :, 1, :2], axis=0), axis=-1)[toes])
                     for m in (gait, out.motion))
    assert toes.mean() > 0.15 and after < 0.4 * before
    assert np.percentile(out.ankle_shift, 95) < 0.02 and out.miss.max() < 0.01


def test_a_heel_that_rises_over_standing_toes_is_not_held():
    rising = np.zeros((60, 3))
    rising[:, 0] = 1.0 * np.arange(60) / FPS  # a sprinter's ankle moves at 1 m/s while the toes stand
    low = np.ones(60, bool)
    assert detect_stances(rising, low, FPS, 0.3, 0.012) == []
    assert detect_stances(0.1 * rising, low, FPS, 0.3, 0.025) == [(0, 60)]


@pytest.mark.parametrize("swing, held", [(8.0, 0.065), (18.0, 0.1)])
def test_toes_of_a_sprint_stand_as_long_as_the_leg_carries_load(swing, held):
    """Filtered toes come to rest and leave within a fifth of a stance of 0.11 s each, at up to 1 m/s."""
    fps, stance = 250.0, 28
    speed = np.concatenate([np.full(60, swing), np.abs(np.linspace(-1.0, 1.0, stance)), np.full(60, swing)])
    place = np.outer(np.cumsum(speed) / fps, [1.0, 0.0, 0.0])
    low = (np.arange(len(place)) >= 60) & (np.arange(len(place)) < 60 + stance)
    spans = detect_stances(place, low, fps, 0.6, 0.025, swing_share=0.05)
    assert sum(end - first for first, end in spans) / fps == pytest.approx(held, abs=0.02)


def test_a_foot_in_flight_is_not_pulled_to_where_it_will_stand():
    place = np.zeros((100, 3))
    place[:50, 0] = -9.0 * np.arange(50, 0, -1) / FPS  # flies in at 9 m/s, then stands 4 mm off its mean
    place[50:75, 0] = 0.004
    shift, _ = compute_hold_shift(place, [(50, 100)], 20)
    assert np.abs(shift).max() < 0.004


def test_it_comes_and_goes_without_a_jump():
    walk = floating(build_gait(0.8, 4.0, FPS), 0.004, 1.0)
    out = filter_foot_plants(walk, window=0.3, max_drift=0.004)
    assert 0 < out.held.mean() < 1
    steps = [np.linalg.norm(np.diff(feet(m), n=2, axis=0), axis=-1).max() for m in (walk, out.motion)]
    assert steps[1] < steps[0] + 3e-4 and out.miss.max() < 0.008


def test_a_foot_that_swings_to_and_fro_does_not_stand():
    place = np.zeros((400, 3))
    place[:, 0] = 0.3 * np.cos(2.0 * np.pi * np.arange(400) / 50.0)  # both halves of a window have the same mean
    assert detect_contacts(place, 50, 0.0015, 0.01) == []


def test_what_drifts_slowly_for_long_is_held_in_pieces():
    place = np.zeros((4000, 3))
    place[:, 0] = np.arange(4000) * 5e-3 / FPS  # 5 mm a second, 10 cm in all
    spans = detect_contacts(place, 50, 0.0015, 0.01)
    assert len(spans) > 4 and spans[0][0] == 0 and spans[-1][1] == 4000
    assert all(np.abs(place[a:b] - place[a:b].mean(axis=0)).max() <= 0.01 for a, b in spans)


def test_numbers_that_are_none_are_refused(standing):
    with pytest.raises(InputError, match="positive"):
        filter_foot_plants(standing, window=0.0)
