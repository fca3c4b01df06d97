"""Seams faded over: both sides of a seam agree at its ends, and nothing but the fade is touched."""

import numpy as np
import pytest

from beyond_mocap.motion import quaternion
from beyond_mocap.synthesis.construct.transitions import blend_rotations, blend_values, compute_blend_share

SEAM, REACH, COUNT = 30, 6, 60
AT = np.arange(SEAM - REACH, SEAM + REACH)
THROUGH = np.arange(1, 2 * REACH + 1) / (2.0 * REACH + 1.0)
WEIGHT = compute_blend_share(THROUGH, AT >= SEAM)


def two_pieces():
    """Two curves (T,) that go on beyond the seam, far apart in place and speed."""
    time = np.arange(COUNT) / 30.0
    return np.sin(2.0 * time), 0.3 + 1.5 * time


def test_the_share_grows_to_half_at_the_seam_and_falls_again():
    assert np.all(WEIGHT >= 0.0) and np.all(WEIGHT <= 0.55) and WEIGHT[0] < 0.01 and WEIGHT[-1] < 0.01
    assert np.all(np.diff(WEIGHT[:REACH]) > 0) and np.all(np.diff(WEIGHT[REACH:]) < 0)
    through = np.linspace(0.0, 1.0, 1001)
    rising = compute_blend_share(through, np.zeros(1001, bool))
    assert np.allclose(rising + compute_blend_share(through, np.ones(1001, bool)), 1.0)
    for times in (1, 2):  # slope and curvature start and end at 0
        bent = np.diff(rising, times) * 1000.0**times
        assert np.allclose(bent[[0, -1]], 0.0, atol=0.1)


def test_a_fade_of_two_curves_has_neither_jump_nor_kink():
    before, after = two_pieces()
    cut = np.where(np.arange(COUNT) < SEAM, before, after)
    out = blend_values(cut, AT, np.where(AT < SEAM, after[AT], before[AT]), WEIGHT)
    begun = np.zeros(COUNT)
    begun[AT], begun[AT[-1] + 1 :] = np.where(AT < SEAM, WEIGHT, 1.0 - WEIGHT), 1.0
    assert np.allclose(out, (1.0 - begun) * before + begun * after, atol=1e-12)
    assert np.abs(np.diff(out, 3)).max() < 0.1 * np.abs(np.diff(cut, 3)).max()
    untouched = np.setdiff1d(np.arange(COUNT), AT)
    assert np.array_equal(out[untouched], cut[untouched])


def test_rotations_take_the_short_way_whatever_their_signs():
    angles = 0.8 * np.stack(two_pieces(), axis=1)
    axis = np.tile([0.0, 0.6, 0.8], (COUNT, 1))
    before, after = (quaternion.from_axis_angle(axis, a)[:, None] for a in angles.T)
    cut = np.where(np.arange(COUNT)[:, None, None] < SEAM, before, after)
    other = np.where(AT[:, None, None] < SEAM, after[AT], before[AT])
    for sign in (1.0, -1.0):
        out = blend_rotations(cut, AT, sign * other, THROUGH, AT >= SEAM)
        turned = np.linalg.norm(quaternion.to_rotation_vector(out[:, 0]), axis=1)
        shown, beyond = np.where(np.arange(COUNT) < SEAM, *angles.T), np.where(AT < SEAM, *angles[AT, ::-1].T)
        wanted = blend_values(shown, AT, beyond, WEIGHT)
        assert np.allclose(turned, np.abs(wanted), atol=1e-9)


def angle_between(a, b):
    return 2.0 * np.arccos(np.clip(np.abs(np.sum(a * b, axis=-1)), 0.0, 1.0))


@pytest.mark.parametrize("before_seam", [REACH, 0])
def test_arms_half_a_turn_apart_are_faded_over_without_a_jump(before_seam):
    """Two arms about one axis whose distance passes 180 degrees within the fade, and a fade beside it that does not."""
    time = np.arange(COUNT) - SEAM
    swings = np.radians([180.0, 140.0])[:, None] + 0.05 * time
    tilt = quaternion.from_axis_angle(np.array([1.0, 0.0, 0.0]), 0.01 * time)
    before = np.stack([tilt, tilt], axis=1)
    after = np.stack([quaternion.from_axis_angle(np.array([0.0, 0.6, 0.8]), a) for a in swings], axis=1)
    at = AT[REACH - before_seam :]
    cut = np.where((time < 0)[:, None, None], before, after)
    other = np.where((at < SEAM)[:, None, None], after[at], before[at])
    through = np.arange(1, len(at) + 1) / (len(at) + 1.0)
    two = np.concatenate([cut, cut[:, ::-1]])
    out = blend_rotations(
        two, np.concatenate([at, COUNT + at]), np.concatenate([other, other[:, ::-1]]), np.tile(through, 2),
        np.tile(at >= SEAM, 2),
    )
    assert np.allclose(angle_between(out[:COUNT], out[COUNT:, ::-1]), 0.0, atol=1e-6)
    step = angle_between(out[at[0] : at[-1] + 1], out[at[0] + 1 : at[-1] + 2])
    most = np.pi if before_seam else 2.0 * np.pi  # a quintic is at most 1.9 times as fast as a straight line
    assert step.max() < 2.0 * most / len(at)


def test_no_seam_nothing_happens():
    values, nothing = np.arange(5.0), np.zeros(0)
    assert np.array_equal(blend_values(values, nothing.astype(int), nothing, nothing), values)
    still = quaternion.identity(5, 2)
    none = nothing.astype(int), np.zeros((0, 2, 4)), nothing, nothing.astype(bool)
    assert np.array_equal(blend_rotations(still, *none), still)
