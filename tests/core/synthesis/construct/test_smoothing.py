"""Jumps at seams spread over the frames around them, and nothing else touched."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.motion import quaternion
from beyond_mocap.synthesis.construct.transitions import (
    LONGEST_SPREAD,
    compute_spread_reaches,
    compute_spread_share,
    spread_rotations,
    spread_values,
)


def eq25(f, d, s):
    """Eq. 25 as printed."""
    if f < d - s or f > d + s:
        return 0.0
    x = (f - d + s) / s
    return 0.5 * x**2 if f < d else -0.5 * x**2 + 2 * x - 2


@pytest.mark.parametrize("reach", [1.0, 4.0, 7.5, 12.0])
def test_it_is_eq_25(reach):
    offset = np.arange(-15, 16)
    assert np.allclose(compute_spread_share(offset, reach), [eq25(f, 0, reach) for f in offset])
    assert compute_spread_share(np.array([0]), reach)[0] == -0.5
    assert compute_spread_share(np.array([-1e-9]), reach)[0] == pytest.approx(0.5)


def test_the_bump_is_smooth_but_for_its_jump():
    offset = np.linspace(-14, 14, 2801)
    slope = np.diff(compute_spread_share(offset, 12.0)) / np.diff(offset)
    away = np.abs(offset[:-1]) > 0.02
    assert np.max(np.abs(np.diff(slope)[away[1:] & away[:-1]])) < 1e-3
    assert np.max(np.abs(compute_spread_share(offset, 12.0))) <= 0.5


def test_reaches_never_overlap():
    assert compute_spread_reaches(np.array([10, 16, 60]), 100).tolist() == [3.0, 3.0, LONGEST_SPREAD]
    assert compute_spread_reaches(np.array([1]), 100).tolist() == [0.5]
    assert compute_spread_reaches(np.zeros(0, int), 50).tolist() == []


def stepped(count=80, seams=(30, 50), size=((1.0, -2.0), (0.5, 3.0))):
    """A smooth curve (T, 2) with planted jumps, and what each frame at a seam would have been."""
    time = np.arange(count)[:, None]
    smooth = np.sin(time * [0.05, 0.03]) + [0.0, 2.0]
    steps = np.zeros((count, 2))
    for seam, jump in zip(seams, size):
        steps[seam:] += jump
    values = smooth + steps
    ahead = np.array([values[seam] - jump for seam, jump in zip(seams, size)])
    return smooth, values, np.array(seams), ahead


def test_no_jump_is_left():
    smooth, values, seams, ahead = stepped()
    out = spread_values(values, seams, ahead)
    before = np.abs(np.diff(values, axis=0)).max()
    assert before > 1.9 and np.abs(np.diff(out - smooth, axis=0)).max() < 3.0 / 10.0 + 0.05
    for seam, jump in zip(seams, (3.0, 3.0)):
        # the difference across the seam is the curve's own; eq. 25 gives back all of the jump
        assert np.allclose((out[seam] - out[seam - 1]) - (smooth[seam] - smooth[seam - 1]), 0.0, atol=3.5 / 10.0)


def test_the_second_difference_of_a_single_jump_is_spread():
    """A step of 1 becomes a curve that bends by no more than 1/s^2 per frame, and by 1/s^2 everywhere in its window."""
    values = np.zeros((60, 1))
    values[30:] = 1.0
    out = spread_values(values, np.array([30]), np.zeros((1, 1)))[:, 0]
    assert np.abs(np.diff(out, 2)).max() <= 1.0 / 12.0**2 + 1e-9
    assert out[18] == pytest.approx(0.0) and out[42] == pytest.approx(1.0) and out[30] == pytest.approx(0.5)
    assert np.all(np.diff(out) >= -1e-12)


def test_nothing_outside_the_windows_is_touched():
    _, values, seams, ahead = stepped()
    out = spread_values(values, seams, ahead)
    reach = compute_spread_reaches(seams, len(values))
    outside = np.all(np.abs(np.arange(len(values))[:, None] - seams) > reach, axis=1)
    assert outside.any() and np.array_equal(out[outside], values[outside])


def test_one_value_per_frame():
    """Heights have no second axis."""
    out = spread_values(np.r_[np.zeros(20), np.ones(20)], np.array([20]), np.zeros(1))
    assert out.shape == (40,) and np.abs(np.diff(out)).max() < 0.1


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 40), st.integers(0, 5))
def test_any_seams_at_all(seed, count, number):
    random = np.random.default_rng(seed)
    seams = (
        np.sort(random.choice(np.arange(1, count), min(number, count - 1), replace=False))
        if count > 1
        else np.zeros(0, int)
    )
    values = np.cumsum(random.normal(size=(count, 3)), axis=0)
    kept = values.copy()
    out = spread_values(values, seams, random.normal(size=(len(seams), 3)))
    assert out.shape == values.shape and np.all(np.isfinite(out)) and np.array_equal(values, kept)
    if not len(seams):
        assert np.array_equal(out, values)


def turning(count, rate, axis=(0.2, 0.1, 1.0)):
    axis = np.asarray(axis) / np.linalg.norm(axis)
    return quaternion.from_rotation_vector(rate * np.arange(count)[:, None, None] * axis)


def angles(a, b):
    return np.linalg.norm(quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(a), b)), axis=-1)


@pytest.mark.parametrize("jump", [0.1, 1.0, 2.9])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rotations_lose_their_jump(jump, sign):
    smooth = turning(60, 0.02)
    rotations = smooth.copy()
    rotations[30:] = quaternion.multiply(rotations[30:], quaternion.from_rotation_vector(np.array([jump, 0.0, 0.0])))
    out = spread_rotations(sign * rotations, np.array([30]), smooth[30:31])
    assert np.allclose(np.linalg.norm(out, axis=-1), 1.0)
    steps = angles(out[:-1], out[1:])[:, 0]
    assert angles(rotations[29:30], rotations[30:31])[0, 0] > 0.9 * jump
    assert steps.max() < 0.02 + 1.2 * jump / 12
    inside = np.abs(np.arange(60) - 30) <= 12
    assert np.array_equal(out[~inside], sign * rotations[~inside])


def test_seams_without_a_jump_change_nothing():
    rotations = turning(40, 0.05)
    assert np.allclose(angles(spread_rotations(rotations, np.array([20]), rotations[20:21]), rotations), 0.0, atol=1e-7)
