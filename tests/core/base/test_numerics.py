"""Vectors, easing, values over time and digests: what every room relies on, edge cases included."""

import hashlib

import numpy as np
import pytest
from scipy.ndimage import maximum_filter1d

from beyond_mocap.base.digest import byte_digest, hex_digest
from beyond_mocap.base.easing import hermite, quintic_step, quintic_step_by_powers, smoothstep
from beyond_mocap.base.time_series import (
    compute_running_maximum,
    gaussian_smooth,
    hann_smooth,
    interpolate_columns,
    time_derivative,
)
from beyond_mocap.base.vectors import (
    cross_on_ground,
    distances_along,
    dot_products,
    find_nearest_axis,
    measure_lengths,
    skew_matrix,
    unit_vector,
    unit_vectors,
)


def test_zero_vectors_stay_zero_or_become_what_is_asked():
    vectors = np.array([[3.0, 0.0, 4.0], [0.0, 0.0, 0.0]])
    assert np.array_equal(unit_vectors(vectors), [[0.6, 0.0, 0.8], [0.0, 0.0, 0.0]])
    assert np.array_equal(unit_vectors(vectors, [0.0, 0.0, 1.0]), [[0.6, 0.0, 0.8], [0.0, 0.0, 1.0]])
    assert np.isnan(unit_vectors(vectors, np.nan, 1e-300)[1]).all()
    assert np.array_equal(unit_vector(vectors[1]), np.zeros(3))
    assert np.array_equal(unit_vector(vectors[1], np.array([0.0, 1.0, 0.0])), [0.0, 1.0, 0.0])
    assert unit_vector(vectors[0], np.ones(3)) == pytest.approx([0.6, 0.0, 0.8])


def test_products_agree_with_numpy():
    a, b = np.random.default_rng(0).normal(size=(2, 5, 3))
    assert np.allclose((skew_matrix(a) @ b[..., None])[..., 0], np.cross(a, b))
    assert np.allclose(cross_on_ground(a, b), np.cross(a, b * [1, 1, 0])[:, 2])
    assert np.array_equal(find_nearest_axis(np.array([0.2, -0.9, 0.3])), [0.0, -1.0, 0.0])


@pytest.mark.parametrize("step", [smoothstep, quintic_step, quintic_step_by_powers])
def test_steps_run_from_0_to_1_level_at_their_ends(step):
    x = np.linspace(-1.0, 2.0, 301)
    y = step(x)
    assert y[:101].max() == 0.0 and y[200:].min() == 1.0 and np.all(np.diff(y) >= 0.0)
    assert y + y[::-1] == pytest.approx(np.ones(301))
    assert step(np.array([1e-4, 1.0 - 1e-4])) == pytest.approx([0.0, 1.0], abs=1e-7)


def test_a_step_between_edges_may_fall():
    assert smoothstep(np.array([0.5, 2.0, 3.5]), 3.0, 1.0) == pytest.approx([1.0, 0.5, 0.0])


def test_hermite_is_the_cubic_itself():
    share = np.linspace(0.0, 1.0, 11)
    assert hermite(share, 1.0, 2.0, 1.0 + 2.0 - 3.0 + 4.0, 2.0 - 6.0 + 12.0) == pytest.approx(
        1.0 + 2.0 * share - 3.0 * share**2 + 4.0 * share**3
    )


@pytest.mark.parametrize("size", [2, 3, 4])
def test_dot_products_and_lengths_are_numpys_to_the_bit(size):
    random = np.random.default_rng(0)
    for shape in ((size,), (1, size), (500, size), (40, 7, size)):
        a, b = random.normal(size=shape) * 10.0 ** random.uniform(-9, 9, shape), random.normal(size=shape)
        a[..., 0], b[:1] = np.where(random.random(shape[:-1]) < 0.1, -0.0, a[..., 0]), 0.0  # zeros of both signs
        for one in (a, np.asfortranarray(a), -0.0 * np.abs(a)):
            assert np.asarray(dot_products(one, b)).tobytes() == np.sum(one * b, axis=-1).tobytes()
            assert np.asarray(measure_lengths(one)).tobytes() == np.linalg.norm(one, axis=-1).tobytes()


def test_values_over_time():
    line = np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 5.0]])
    assert np.array_equal(distances_along(line), [0.0, 5.0, 6.0])
    assert np.array_equal(time_derivative(line, 2.0)[1], [3.0, 5.0]) and not time_derivative(line[:1], 2.0).any()
    held = interpolate_columns(np.array([-1.0, 0.5]), np.arange(3.0), line)
    assert np.array_equal(held, [[0.0, 0.0], [1.5, 2.0]])
    assert np.isnan(interpolate_columns(np.array([-1.0, 0.5]), np.arange(3.0), line, np.nan)[:, 0]).tolist() == [True,
            False]
    flat = np.full((9, 2), 7.0)
    assert gaussian_smooth(flat, 2.0) == pytest.approx(flat) and hann_smooth(flat[:, 0], 3) == pytest.approx(flat[:, 0])


def test_digests_are_those_of_the_joined_bytes():
    table = np.arange(24.0).reshape(2, 3, 4)[:, :, ::2]
    joined = "\u00e9".encode() + table.tobytes() + b"x"
    assert hex_digest("\u00e9", table, b"x", digits=8) == hashlib.sha256(joined).hexdigest()[:8]
    assert byte_digest("\u00e9", table, np.zeros((0, 3)), b"x") == hashlib.blake2b(joined, digest_size=16).digest()


@pytest.mark.parametrize("kind", [float, np.float32, bool])
def test_the_running_maximum_is_scipys_to_the_bit(kind):
    random = np.random.default_rng(0)
    for count in (1, 2, 7, 40):
        values = (random.normal(size=count) > 1.0) if kind is bool else random.normal(size=count).astype(kind)
        for size in range(1, 20):
            around = maximum_filter1d(values, 2 * size + 1, mode="nearest")
            ahead = maximum_filter1d(values, size + 1, origin=-((size + 1) // 2), mode="nearest")
            for expected, window in ((around, (size, size)), (ahead, (0, size))):
                found = compute_running_maximum(values, *window)
                assert found.dtype == expected.dtype and found.tobytes() == expected.tobytes()
