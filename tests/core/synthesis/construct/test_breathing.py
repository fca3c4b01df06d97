"""Bodies that breathe after sprints: rate, depth, what moves and what stays."""

import numpy as np
import pytest

from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.track import Track
from beyond_mocap.synthesis.construct.breathing import RATES, SLUMP_ANGLE, breathe, compute_breath, compute_breath_depth
from beyond_mocap.synthesis.exertion import RECOVERY_SECONDS, compute_exertion, measure_exertion
from beyond_mocap.synthetic.gait import build_gait

FPS = 30.0
SPRINT = np.concatenate([np.full(60, 7.5), np.linspace(7.5, 1.2, 30)])
"""m/s: two seconds of a sprint, and a second in which it ends."""


@pytest.fixture(scope="module")
def standing():
    return build_gait(0.0, 20.0, FPS, seed=4)


@pytest.fixture(scope="module")
def panting(standing):
    return breathe(standing, np.ones(len(standing)), times_of(standing), seed=3)


def times_of(motion):
    return 100.0 + np.arange(len(motion)) / motion.fps


def depth_after(sprints, seconds=60.0):
    """Depth of the breath from the end of the last sprint on, walking."""
    speed = np.concatenate([*[SPRINT] * sprints, np.full(int(seconds * FPS), 1.2)])
    return compute_breath_depth(compute_exertion(speed, FPS), speed, FPS)[sprints * len(SPRINT) + 20 :]


@pytest.mark.parametrize("seed", range(8))
def test_the_rate_is_within_its_range_and_players_differ(seed):
    times = np.arange(0.0, 120.0, 0.01)
    full, other = compute_breath(times, seed), compute_breath(times, seed + 1)
    tops = times[1:-1][(full[1:-1] > full[:-2]) & (full[1:-1] >= full[2:])]
    assert len(tops) > 55
    assert np.all((1.0 / np.diff(tops) > RATES[0] - 0.02) & (1.0 / np.diff(tops) < RATES[1] + 0.02))
    assert full.min() < 0.01 and full.max() > 0.99 and np.abs(full - other).max() > 0.5


def test_the_breath_goes_with_the_clock():
    """A part of a take, and another frame rate, breathe alike."""
    times = np.arange(0.0, 60.0, 1.0 / 25.0)
    assert np.array_equal(compute_breath(times, 5)[500:600], compute_breath(times[500:600], 5))


def test_more_sprints_are_a_deeper_breath_that_fades_within_minutes():
    one, two, four = (depth_after(count) for count in (1, 2, 4))
    assert 0.2 < one.max() < two.max() < four.max() < 1.0
    assert np.all(np.diff(two[60:]) < 0.0) and two[-1] < 0.6 * two.max()


def test_the_breath_does_not_show_in_a_run_nor_without_sprints():
    running, walking = np.full(900, 5.0), np.full(900, 1.5)
    assert not compute_breath_depth(np.full(900, 20.0), running, FPS).any()
    assert not compute_breath_depth(compute_exertion(walking, FPS), walking, FPS).any()


def test_the_depth_has_no_jumps():
    assert np.abs(np.diff(depth_after(3))).max() < 0.1


def test_exertion_recovers_exponentially():
    found = compute_exertion(np.zeros(1801), FPS, before=12.0)
    assert found[0] == 12.0 and found[-1] == pytest.approx(12.0 * np.exp(-60.0 / RECOVERY_SECONDS))


def test_a_part_of_a_track_goes_on_from_the_exertion_at_its_start():
    speed = np.concatenate([np.full(100, 1.0), np.linspace(1.0, 8.0, 50), np.full(100, 8.0), np.full(500, 1.0)])
    times = np.arange(len(speed)) / 25.0
    track = Track(times, np.column_stack([np.cumsum(speed) / 25.0, 0.0 * times]), np.full((len(times), 3), np.nan))
    whole = compute_exertion(speed, 25.0)
    for frame in (120, 300, 600):
        assert measure_exertion(track, times[frame]) == pytest.approx(whole[frame], rel=0.05, abs=0.1)
    assert measure_exertion(track, times[0], 7.0) == 7.0


def test_frames_without_depth_keep_their_bits(standing, panting):
    depth = np.zeros(len(standing))
    assert breathe(standing, depth, times_of(standing)) is standing
    depth[200:300] = 1.0
    found = breathe(standing, depth, times_of(standing), seed=3)
    assert np.array_equal(found.rotations[depth == 0.0], standing.rotations[depth == 0.0])
    assert np.array_equal(found.rotations[200:300], panting.rotations[200:300])


def test_chest_and_shoulders_rise_and_fall_by_centimetres(standing, panting):
    body, full = identify_joints(standing.skeleton), compute_breath(times_of(standing), 3)
    places = forward_kinematics(panting)[0] - forward_kinematics(standing)[0]
    for limb in (body.left, body.right):
        up = places[:, limb.upper_arm, 2]
        assert 0.008 < np.ptp(up) < 0.03 and np.corrcoef(up, full)[0, 1] > 0.95
    neck = places[:, body.neck_or_chest]
    assert 0.0 < neck[:, 0].min() < neck[:, 0].max() < 0.6 * np.sin(SLUMP_ANGLE)


def test_hips_legs_and_feet_stay_and_head_and_arms_keep_their_direction(standing, panting):
    body = identify_joints(standing.skeleton)
    assert np.array_equal(panting.root_positions, standing.root_positions)
    turned = set(np.flatnonzero(np.any(panting.rotations != standing.rotations, axis=(0, 2))))
    limbs = (body.left, body.right)
    assert turned == {*body.spine, body.neck, *(limb.shoulder for limb in limbs), *(limb.upper_arm for limb in limbs)}
    before, after = (forward_kinematics(motion)[1] for motion in (standing, panting))
    kept = [body.neck, body.head, *(joint for limb in limbs for joint in (limb.upper_arm, limb.hand))]
    assert np.abs(np.abs(np.sum(before[:, kept] * after[:, kept], axis=-1)) - 1.0).max() < 1e-9
