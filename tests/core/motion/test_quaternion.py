"""Rotations against scipy's, and the properties that everything else leans on."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from beyond_mocap.base.vectors import cross_product
from beyond_mocap.motion import quaternion

ORDERS = ["".join(order) for order in itertools.permutations("XYZ")]


def random_rotations(*shape, seed=0) -> np.ndarray:
    return quaternion.normalize(np.random.default_rng(seed).normal(size=(*shape, 4)))


def theirs(q) -> Rotation:
    return Rotation.from_quat(np.roll(np.asarray(q), -1, axis=-1))


def same_rotation(a, b) -> np.ndarray:
    """The angle in radians between rotations, whatever their sign."""
    difference = quaternion.multiply(quaternion.inverse(a), b)
    return np.linalg.norm(quaternion.to_rotation_vector(difference), axis=-1)


A, B = random_rotations(50, seed=1), random_rotations(50, seed=2)
V = np.random.default_rng(3).normal(size=(50, 3))


def test_products_inverses_and_turned_vectors_agree_with_scipy():
    assert np.allclose(quaternion.to_matrix(quaternion.multiply(A, B)), (theirs(A) * theirs(B)).as_matrix())
    assert np.allclose(quaternion.rotate(A, V), theirs(A).apply(V))
    assert np.allclose(quaternion.rotate(quaternion.inverse(A), quaternion.rotate(A, V)), V)
    assert np.allclose(cross_product(V, V[::-1]), np.cross(V, V[::-1]))


def test_leading_axes_are_free():
    grid = A.reshape(5, 10, 4)
    assert np.array_equal(quaternion.multiply(grid, B.reshape(5, 10, 4)).reshape(50, 4), quaternion.multiply(A, B))
    assert quaternion.rotate(grid, V[0]).shape == (5, 10, 3)
    assert quaternion.identity(2, 3).shape == (2, 3, 4)


def test_matrices_rotation_vectors_and_yaw():
    assert np.allclose(quaternion.to_matrix(A), theirs(A).as_matrix())
    assert same_rotation(quaternion.from_matrix(quaternion.to_matrix(A)), A).max() < 1e-12
    assert same_rotation(quaternion.from_rotation_vector(quaternion.to_rotation_vector(A)), A).max() < 1e-12
    assert np.allclose(quaternion.to_rotation_vector(A), theirs(A).as_rotvec())
    small = np.array([[1e-12, 0, 0], [0, 0, 0], [0, 3e-6, 0]])
    assert np.allclose(quaternion.to_rotation_vector(quaternion.from_rotation_vector(small)), small, rtol=1e-9, atol=0)
    assert quaternion.to_yaw(quaternion.from_up_angle(0.7)) == pytest.approx(0.7)
    assert np.allclose(quaternion.from_up_angle(0.7), quaternion.from_axis_angle(np.array([0.0, 0.0, 1.0]), 0.7))


def test_matrices_of_half_turns_come_back():
    for axis in np.eye(3):
        half = quaternion.from_axis_angle(axis, np.pi)
        assert same_rotation(quaternion.from_matrix(quaternion.to_matrix(half)), half) < 1e-12


def test_between_turns_one_vector_onto_another_even_the_opposite():
    turned = quaternion.rotate(quaternion.rotation_between(V, V[::-1]), V)
    assert np.allclose(cross_product(turned, V[::-1]), 0.0, atol=1e-9) and np.all(
        np.sum(turned * V[::-1], axis=-1) > 0
    )
    assert np.allclose(quaternion.rotate(quaternion.rotation_between(V, -V), V), -V)


@pytest.mark.parametrize("order", ORDERS)
def test_euler_angles_are_intrinsic_in_the_order_of_their_letters(order):
    angles = np.random.default_rng(4).uniform(-np.pi, np.pi, (200, 3))
    assert (
        same_rotation(
            quaternion.from_euler(angles, order), np.roll(Rotation.from_euler(order, angles).as_quat(), 1, -1)
        ).max()
        < 1e-12
    )


@pytest.mark.parametrize("order", ORDERS)
def test_euler_angles_come_back_up_to_a_hundredth_degree_from_the_pole(order):
    random = np.random.default_rng(5)
    angles = random.uniform(-np.pi, np.pi, (400, 3))
    angles[:, 1] = np.concatenate([random.uniform(-1.5, 1.5, 396), np.radians([89.99, -89.99, 89.9899, -89.9899])])
    back = quaternion.to_euler(quaternion.from_euler(angles, order), order)
    difference = (back - angles + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(difference).max() < 1e-9


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("away", [0.0, 1e-12, 1e-9, 1e-8, 1e-6, 1e-4])
def test_the_rotation_comes_back_at_the_pole_too(order, away):
    angles = np.random.default_rng(6).uniform(-np.pi, np.pi, (100, 3))
    angles[:, 1] = np.where(np.arange(100) % 2, 1, -1) * (np.pi / 2 - away)
    q = quaternion.from_euler(angles, order)
    assert same_rotation(quaternion.from_euler(quaternion.to_euler(q, order), order), q).max() < 3e-9


@given(st.lists(st.tuples(*[st.floats(-1, 1)] * 4), min_size=1, max_size=20))
def test_continuous_changes_signs_only_and_keeps_neighbours_close(values):
    q = quaternion.normalize(np.array(values))
    out = quaternion.unify_signs(q)
    assert np.array_equal(np.abs(out), np.abs(q)) and np.array_equal(out[0], q[0])
    assert np.all(np.sum(out[1:] * out[:-1], axis=-1) >= 0)


def test_wrapped_angles_lie_within_half_a_turn_and_mean_the_same():
    angles = np.linspace(-20.0, 20.0, 401)
    wrapped = quaternion.wrap_angle(angles)
    assert np.all((wrapped >= -np.pi) & (wrapped < np.pi))
    assert np.allclose(np.exp(1j * wrapped), np.exp(1j * angles))


def test_a_sign_is_taken_from_what_a_rotation_comes_from():
    q = quaternion.from_up_angle(np.array([0.3, 0.3]))
    like = quaternion.from_up_angle(np.array([0.4, 0.4])) * [[1.0], [-1.0]]
    assert np.array_equal(quaternion.match_signs(q, like), q * [[1.0], [-1.0]])


def test_slerp_goes_the_short_way_at_constant_speed():
    weights = np.linspace(0, 1, 11)
    path = quaternion.slerp(A[:, None], -B[:, None], weights)
    whole = same_rotation(A, B)
    assert np.allclose(same_rotation(path[:, :-1], path[:, 1:]), whole[:, None] / 10, atol=1e-9)
    assert same_rotation(path[:, 0], A).max() < 1e-9 and same_rotation(path[:, -1], B).max() < 1e-9
    assert np.allclose(quaternion.slerp(A, A, 0.3), A)


def test_zero_becomes_the_identity():
    assert np.array_equal(quaternion.normalize(np.zeros((2, 4))), quaternion.identity(2))
