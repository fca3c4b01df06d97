"""Smooth the whole sequence at once: poses near the recorded markers whose joints accelerate little.

In addition to the cost of each frame (`descent`), every second difference over time of the root's place and of each
joint's rotation has a cost. Each frame is then coupled with the two before and after it: one banded system for each
step, with the frames' own matrices as blocks (Gauss-Newton, with limits as there). Long recordings are solved window by
window; each starts from the last two frames of the one before and looks ahead, so that no transition is visible.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from . import limits
from .chain import CONJUGATE, Chain, Poses, apply_step, compute_marker_derivative, multiply, to_rotation_vectors
from .descent import (
    PoseTask,
    State,
    build_joint_terms,
    compute_cross_weight,
    compute_state,
    measure_distance,
    to_rotation_slope,
)

ARM = 0.1  # metres: a rotation costs as much as the movement of a marker at this distance from the joint
# Frames of a window, of the look-ahead that is discarded, and of the solved window before that stay fixed.
_WINDOW_FRAMES, _LOOK_AHEAD_FRAMES, _FIXED_FRAMES = 240, 60, 2
_MAX_STEPS = 8
_CONVERGED_STEP = 1e-4  # radians and metres; a smaller step has converged


def smooth_poses(task: PoseTask, start: Poses, seconds: float, fps: float, watch=lambda part: None) -> tuple[Poses,
        np.ndarray]:
    """Smooth poses of all T frames.

    Args:
        task: what the poses should fit.
        start: T solved poses.
        seconds: strength: an acceleration costs as much as a marker that is off by what the acceleration covers in half
            of the square of that time.
        fps: frames per second.
        watch: called with the share that is done before each window; it may raise.
    Returns:
        T smooth poses, and (J, T) bool, joints that limits hold.
    """
    poses, total = start.copy_arrays(), start.root.shape[-1]
    held = np.zeros((len(task.chain.skeleton), total), dtype=bool)
    strength = (seconds * fps) ** 2
    for first in range(0, total, _WINDOW_FRAMES):
        watch(first / total)
        fixed = min(first, _FIXED_FRAMES)
        window = np.arange(first - fixed, min(first + _WINDOW_FRAMES + _LOOK_AHEAD_FRAMES, total))
        solved, window_held = _smooth_window(task.select_frames(window), poses.select_frames(window), strength, fixed)
        poses.overwrite_frames(window, solved)
        # the look-ahead is overwritten by the next window
        held[:, window[fixed:]] = window_held[:, fixed:]
    return poses, held


def _smooth_window(task: PoseTask, poses: Poses, strength: float, fixed: int) -> tuple[Poses, np.ndarray]:
    """Smooth one window, of which the first `fixed` frames stay unchanged."""
    limited_joints = limits.find_limited_joints(task.chain)
    best, damping = compute_state(task, poses), 1e-6
    cost = _compute_cost(best, strength, task.chain, fixed)
    held = np.zeros((len(task.chain.skeleton), poses.root.shape[-1]), dtype=bool)
    for _ in range(_MAX_STEPS):
        shift, turns, step_held = _solve_step(task, best, limited_joints, strength=strength, fixed=fixed,
                                              damping=damping)
        next_poses = limits.apply_limits(task.chain, limited_joints,
                                         apply_step(task.chain, best.poses, shift, turns))[0]
        trial = compute_state(task, next_poses)
        trial_cost = _compute_cost(trial, strength, task.chain, fixed)
        if trial_cost > cost:
            damping = max(10.0 * damping, 1e-4)
            continue
        best, held, gain = trial, step_held, cost - trial_cost
        cost, damping = trial_cost, 0.1 * damping
        if max(np.abs(turns).max(), np.abs(shift).max()) < _CONVERGED_STEP or gain < 1e-6 * cost:
            break
    return best.poses, held


def _compute_rates(chain: Chain, poses: Poses) -> np.ndarray:
    """Compute the change from frame to frame, (1 + J, 3, F - 1): of the root (row 0, metres) and of joints
    (radians).
    """
    rotations = to_rotation_vectors(multiply(poses.local[..., 1:], poses.local[..., :-1] * CONJUGATE))
    for joint in chain.hinges:
        rotations[joint] = np.diff(poses.angles[joint], axis=-1)
    return np.concatenate([np.diff(poses.root, axis=-1)[None], rotations])


def _compute_scales(chain: Chain, strength: float) -> np.ndarray:
    """Compute the factor of each row of the rates, (1 + J, 1, 1), which makes them metres."""
    return 0.5 * strength * np.concatenate([[1.0], np.full(len(chain.skeleton), ARM)])[:, None, None]


def _compute_cost(state: State, strength: float, chain: Chain, fixed: int) -> float:
    """Compute half the weighted squares of the frames that are solved, and of all second differences."""
    second_differences = _compute_scales(chain, strength) * np.diff(_compute_rates(chain, state.poses), axis=-1)
    return float(state.cost[fixed:].sum() + 0.5 * np.sum(second_differences**2))


def _compute_smoothness_slope(chain: Chain, poses: Poses, strength: float) -> np.ndarray:
    """Compute the derivative of the second differences' cost by shift (row 0) and rotations, (1 + J, 3, F)."""
    rates = _compute_rates(chain, poses)
    scale = _compute_scales(chain, strength) ** 2
    slope = np.zeros((*rates.shape[:2], rates.shape[2] + 1))
    forces = np.zeros_like(rates)  # by each rate
    second_differences = scale * np.diff(rates, axis=-1)
    forces[..., 1:] += second_differences
    forces[..., :-1] -= second_differences
    # each rate depends on the later and the earlier frame; rotations need the conversion to small rotations
    later, earlier = forces.copy(), forces.copy()
    for joint in range(len(chain.skeleton)):
        if chain.is_fully_free[joint]:
            later[1 + joint] = to_rotation_slope(rates[1 + joint], forces[1 + joint])
            earlier[1 + joint] = to_rotation_slope(-rates[1 + joint], forces[1 + joint])
    slope[..., 1:] += later
    slope[..., :-1] -= earlier
    return slope


def _solve_step(task: PoseTask, best: State, limited_joints: dict, strength: float, fixed: int, damping: float):
    """Solve one step: shift (3, F), rotations (J, 3, F), and the joints that limits hold (J, F)."""
    chain, joint_terms = task.chain, build_joint_terms(task, best)
    columns, away, weight = _build_columns(task, best)
    joint_terms.curvature[~chain.free[:, :, None] & np.eye(3, dtype=bool)] = 1.0  # fixed angles: a solvable equation
    smoothness_slope = _compute_smoothness_slope(chain, best.poses, strength)
    slope = np.einsum("fra,fr->af", columns, weight * away)
    slope[3:] += joint_terms.pull.reshape(-1, joint_terms.pull.shape[-1])
    slope += smoothness_slope.reshape(slope.shape)
    pull_before = joint_terms.pull.copy()
    held = limits.hold_at_limits(chain, limited_joints, best.poses, slope[3:].reshape(joint_terms.pull.shape),
                                 joint_terms)
    slope[3:] += (joint_terms.pull - pull_before).reshape(-1, joint_terms.pull.shape[-1])
    slope[3:][~chain.free.ravel()] = 0.0
    blocks = np.matmul(columns.transpose(0, 2, 1), weight[..., None] * columns)
    for joint in range(len(chain.skeleton)):
        rows = slice(3 + 3 * joint, 6 + 3 * joint)
        blocks[:, rows, rows] += np.moveaxis(joint_terms.curvature[joint], -1, 0)
    blocks[:, np.arange(blocks.shape[1]), np.arange(blocks.shape[1])] += damping + 1e-9
    change = _solve_banded(blocks, -slope.T, np.repeat(_compute_scales(chain, strength).ravel() ** 2, 3), fixed)
    return change[:, :3].T, np.moveaxis(change[:, 3:].reshape(len(change), -1, 3), 0, -1), held


def _build_columns(task: PoseTask, best: State) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Build the derivative of all distances (F, R, columns), the distances (F, R) metres and their weights (F, R).

    Three rows for each marker; with a held point one row along its distance and three across it.
    """
    chain, at = task.chain, best.poses
    point = task.point
    if point is not None:
        joint, places = np.append(chain.joint, point.joint), np.append(chain.places, point.place[None], axis=0)
        chain = replace(chain, joint=joint, places=places)
    # each frame's own numbers side by side, for the products to come
    exact = np.ascontiguousarray(compute_marker_derivative(chain, at)) * np.concatenate([np.ones(3),
            chain.free.ravel()])
    frames, count = len(exact), len(task.chain.joint)
    columns = exact[:, :count].reshape(frames, 3 * count, -1)
    away, weight = np.moveaxis(best.away, -1, 0).reshape(frames, -1), np.repeat(task.weights.T, 3, axis=1)
    if point is None:
        return columns, away, weight
    _, along, far = measure_distance(point, best.placed)
    across = point.weight * compute_cross_weight(far, point.radius)
    row = np.einsum("af,fac->fc", along, exact[:, count])
    rest = exact[:, count] - along.T[:, :, None] * row[:, None]
    return (np.concatenate([columns, row[:, None], rest], axis=1),
            np.concatenate([away, far[:, None], np.zeros((frames, 3))], axis=1),
            np.concatenate([weight, point.weight[:, None], np.repeat(across[:, None], 3, axis=1)], axis=1))


def _solve_banded(blocks: np.ndarray, right: np.ndarray, strength: np.ndarray, fixed: int) -> np.ndarray:
    """Solve the frames' blocks together with the second differences of each of the N coordinates.

    Args:
        blocks: (F, N, N), one for each frame.
        right: (F, N), the right-hand side.
        strength: (N,) weight of the second differences.
        fixed: number of first frames that stay unchanged.
    Returns:
        (F, N), zero for the first `fixed` frames.
    """
    from scipy.linalg import solveh_banded

    frames, size = right.shape
    band = np.zeros((frames, 2 * size + 1, size))
    # lower band storage: row k of a column holds the entry k below the diagonal, so one block is `size` rows
    for off in range(size):
        band[:, off, : size - off] = np.diagonal(blocks, offset=-off, axis1=1, axis2=2)
    # squares of the coefficients 1, -2, 1 of all differences that contain a frame: 1, 5, 6, 6, ..., 5, 1
    inside = np.convolve(np.ones(frames - 2), [1.0, 4.0, 1.0]) if frames > 2 else np.zeros(frames)
    band[:, 0] += inside[:, None] * strength
    if frames > 2:
        # products of the coefficients 1, -2, 1 for neighbouring frames, and for frames two apart
        band[:-1, size] += np.convolve(np.ones(frames - 2), [-2.0, -2.0])[:, None] * strength
        band[:-2, 2 * size] += strength
    band = band.transpose(1, 0, 2)
    free_band = band[:, fixed:].reshape(2 * size + 1, -1)
    out = np.zeros((frames, size))
    out[fixed:] = solveh_banded(free_band, right[fixed:].ravel(), lower=True, check_finite=False).reshape(-1, size)
    return out
