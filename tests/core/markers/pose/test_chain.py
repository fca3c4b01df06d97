"""The chain: its forward kinematics, its derivative, its steps."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.markers.pose import elimination
from beyond_mocap.markers.pose.chain import (
    WorldPoses,
    apply_step,
    build_chain,
    build_poses,
    compute_marker_derivative,
    compute_step_axes,
    compute_world_poses,
)
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.motion import compute_pose
from tests.core.markers.small_chain import HINGE, SADDLE, SKELETON, build_small_chain, sample_poses


def markers_at(made, at):
    placed = compute_world_poses(made, at)
    return placed.markers + placed.origin


def test_markers_stand_where_the_skeleton_carries_them():
    made = build_small_chain()
    at = sample_poses(made, 4)
    joints, turns = compute_pose(SKELETON, at.root.T, np.moveaxis(at.local, -1, 0))
    wanted = joints[:, made.joint] + quaternion.rotate(turns[:, made.joint], made.places)
    assert np.abs(np.moveaxis(markers_at(made, at), -1, 0) - wanted).max() < 1e-12


@pytest.mark.parametrize("size", [0.7, 3.0])
def test_the_derivative_is_that_of_finite_steps(size):
    made = build_small_chain()
    at = sample_poses(made, 5, size=size)
    exact = compute_marker_derivative(made, at)
    for column in range(exact.shape[-1]):
        differences = []
        for step in (1e-6, -1e-6):
            shift, turns = np.zeros((3, 5)), np.zeros((len(SKELETON), 3, 5))
            if column < 3:
                shift[column] = step
            else:
                turns[(column - 3) // 3, (column - 3) % 3] = step
            differences.append(np.moveaxis(markers_at(made, apply_step(made, at, shift, turns)), -1, 0))
        assert np.abs((differences[0] - differences[1]) / 2e-6 - exact[..., column]).max() < 1e-8


def test_no_pole_takes_a_direction_from_a_joint():
    made = build_small_chain()
    turns = quaternion.identity(1, len(SKELETON))
    turns[0, 2] = quaternion.from_euler(np.array([0.3, np.pi / 2, 0.2]), made.order[2])
    arm = compute_marker_derivative(made, build_poses(made, np.zeros((1, 3)), turns))[0, made.joint == 2].reshape(-1,
            3 + 21)
    assert np.linalg.svd(arm[:, 9:12])[1].min() > 0.02


def test_hinges_keep_to_their_axes_through_steps():
    made = build_small_chain()
    at = sample_poses(made, 3)
    rng = np.random.default_rng(3)
    for _ in range(3):
        at = apply_step(made, at, np.zeros((3, 3)), rng.normal(0.0, 0.4, (len(SKELETON), 3, 3)))
    again = build_poses(made, at.root.T, np.moveaxis(at.local, -1, 0))
    for joint, kept in ((HINGE, 1), (SADDLE, 2)):
        assert np.all(at.angles[joint, kept:] == 0.0)
        assert np.abs(quaternion.wrap_angle(again.angles[joint] - at.angles[joint])).max() < 1e-9


def test_a_step_solves_the_whole_system():
    made = build_small_chain(stiffness=0.05)
    at = sample_poses(made, 4)
    placed, rng = compute_world_poses(made, at), np.random.default_rng(5)
    away, weights = rng.normal(0.0, 0.01, placed.markers.shape), rng.uniform(0.2, 1.0, (len(made.joint), 4))
    about = compute_step_axes(made, at, placed)
    own = elimination.JointTerms(np.zeros_like(placed.world), rng.normal(0.0, 1e-3, placed.joints.shape))
    own.pull[~made.free] = 0.0
    for axis in range(3):
        own.curvature[:, axis, axis] = 0.05**2
    damping = np.full(4, 1e-3)
    shift, turns = elimination.solve_step(made, placed, about, elimination.build_body_terms(made, placed, away,
            weights), own, damping)
    slope = elimination.compute_gradient(made, placed, about, elimination.build_body_terms(made, placed, away, weights),
                                         own)
    columns = compute_marker_derivative(made, at)
    used = np.concatenate([np.ones(3, dtype=bool), made.free.ravel()])
    for frame in range(4):
        flat = columns[frame].reshape(-1, columns.shape[-1])[:, used]
        scale = np.repeat(weights[:, frame], 3)
        stiff = np.concatenate([np.zeros(3), np.full(21, 0.05**2)])[used] + 1e-3
        pull = np.concatenate([np.zeros(3), own.pull[..., frame].ravel()])[used]
        right = flat.T @ (scale * away[..., frame].ravel()) + pull
        wanted = np.linalg.solve(flat.T * scale @ flat + np.diag(stiff), -right)
        found = np.concatenate([shift[:, frame], turns[..., frame].ravel()])
        assert np.abs(found[used] - wanted).max() < 1e-9
        assert np.all(found[~used] == 0.0)
        assert np.abs(slope[..., frame].ravel()[used[3:]] - right[3:]).max() < 1e-12


def test_with_second_derivatives_a_step_is_newtons():
    made = build_small_chain()
    at = sample_poses(made, 1)
    placed, rng = compute_world_poses(made, at), np.random.default_rng(6)
    seen = placed.markers + placed.origin + rng.normal(0.0, 0.01, placed.markers.shape)
    weights = rng.uniform(0.5, 1.0, (len(made.joint), 1))
    used = np.flatnonzero(np.concatenate([np.ones(3, dtype=bool), made.free.ravel()]))

    def half_cost(steps):
        """At steps (N, columns) from there."""
        shift, turns = steps[:, :3].T, np.moveaxis(steps[:, 3:].reshape(len(steps), -1, 3), 0, -1)
        start = at.select_frames(np.zeros(len(steps), dtype=int))
        away = markers_at(made, apply_step(made, start, shift, turns)) - seen
        return 0.5 * np.einsum("mf,maf,maf->f", np.repeat(weights, len(steps), axis=1), away, away)

    unit = 1e-3 * np.eye(3 + 3 * len(SKELETON))[used]
    slope = (half_cost(unit) - half_cost(-unit)) / 2e-3
    pairs = np.concatenate([a * unit[:, None] + b * unit for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1))])
    both = half_cost(pairs.reshape(-1, unit.shape[1])).reshape(4, len(used), len(used))
    curvature = (both[0] - both[1] - both[2] + both[3]) / 4e-6
    about, none = compute_step_axes(made, at, placed), np.zeros(1)
    away = markers_at(made, at) - seen
    own = elimination.JointTerms(np.zeros_like(placed.world), np.zeros_like(placed.joints))
    bent = elimination.compute_second_derivatives(made, placed, about, away, weights, np.ones(1))
    asked = elimination.build_body_terms(made, placed, away, weights)
    shift, turns = elimination.solve_step(made, placed, about, asked, own, none, bent)
    found = np.concatenate([shift[:, 0], turns[..., 0].ravel()])[used]
    wanted = np.linalg.solve(curvature, -slope)
    plain = np.concatenate([x.reshape(-1) for x in elimination.solve_step(
        made, placed, about, elimination.build_body_terms(made, placed, away, weights), own, none)])[used]
    assert np.abs(found - wanted).max() < 1e-3 * np.abs(wanted).max() < 0.1 * np.abs(plain - wanted).max()


def test_a_distance_pulls_along_its_line_only():
    made = build_small_chain()
    at = sample_poses(made, 2)
    placed = compute_world_poses(made, at)
    nothing = np.zeros((len(made.joint), 3, 2)), np.zeros((len(made.joint), 2))
    asked = elimination.build_body_terms(made, placed, *nothing)
    along = np.array([[1.0, 0.0], [0.0, 0.6], [0.0, 0.8]])
    elimination.add_distance_terms(asked, 4, placed.joints[4], along, np.array([2.0, 1.0]), np.array([0.1, 0.2]),
                                   np.zeros(2))
    assert np.linalg.matrix_rank(asked.curvature[4][..., 0]) == 1
    assert asked.pull[4][3:, 1] == pytest.approx([0.0, 0.12, 0.16])


@pytest.mark.parametrize("wrong", [
    {"joint": [0, 9]}, {"places": np.zeros((3, 3))}, {"order": ("XYZ",)}, {"order": ("XYX",) * 7},
])
def test_what_does_not_fit_is_refused(wrong):
    given = {"joint": [0, 1], "places": np.zeros((2, 3)), **wrong}
    with pytest.raises(InputError):
        build_chain(SKELETON, **given)


def test_places_are_relative_to_the_root_so_that_far_away_is_as_exact():
    made = build_small_chain()
    at = sample_poses(made, 1)
    far = build_poses(made, at.root.T + 1e4, np.moveaxis(at.local, -1, 0))
    assert isinstance(compute_world_poses(made, far), WorldPoses)
    assert np.array_equal(compute_world_poses(made, far).markers, compute_world_poses(made, at).markers)
