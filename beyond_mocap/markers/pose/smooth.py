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
from .chain import CONJUGATE, Chain, Poses, logarithm, marker_derivative, moved, multiply
from .descent import State, Task, carried_to_turns, crosswise, distance, state_of, wishes

ARM = 0.1  # metres: a rotation costs as much as the movement of a marker at this distance from the joint
# Frames of a window, of the look-ahead that is discarded, and of the solved window before that stay fixed.
_KEPT, _AHEAD, _GIVEN = 240, 60, 2
_MOST_STEPS = 8
_STILL = 1e-4  # radians and metres; a smaller step has converged


def smooth(task: Task, start: Poses, seconds: float, fps: float, watch=lambda part: None) -> tuple[Poses, np.ndarray]:
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
    at, total = start.copy(), start.root.shape[-1]
    held = np.zeros((len(task.chain.skeleton), total), dtype=bool)
    strength = (seconds * fps) ** 2
    for first in range(0, total, _KEPT):
        watch(first / total)
        given = min(first, _GIVEN)
        window = np.arange(first - given, min(first + _KEPT + _AHEAD, total))
        solved, stopped = _window(task.frames(window), at.frames(window), strength, given)
        at.put(window, solved)
        # the look-ahead is overwritten by the next window
        held[:, window[given:]] = stopped[:, given:]
    return at, held


def _window(task: Task, at: Poses, strength: float, given: int) -> tuple[Poses, np.ndarray]:
    """Smooth one window, of which the first `fixed` frames stay unchanged."""
    stops = limits.limited(task.chain)
    best, damping = state_of(task, at), 1e-6
    cost = _cost(best, strength, task.chain, given)
    held = np.zeros((len(task.chain.skeleton), at.root.shape[-1]), dtype=bool)
    for _ in range(_MOST_STEPS):
        shift, turns, stopped = _step(task, best, stops, strength=strength, given=given, damping=damping)
        further = limits.held_back(task.chain, stops, moved(task.chain, best.poses, shift, turns))[0]
        trial = state_of(task, further)
        trial_cost = _cost(trial, strength, task.chain, given)
        if trial_cost > cost:
            damping = max(10.0 * damping, 1e-4)
            continue
        best, held, gain = trial, stopped, cost - trial_cost
        cost, damping = trial_cost, 0.1 * damping
        if max(np.abs(turns).max(), np.abs(shift).max()) < _STILL or gain < 1e-6 * cost:
            break
    return best.poses, held


def _rates(chain: Chain, at: Poses) -> np.ndarray:
    """Compute the change from frame to frame, (1 + J, 3, F - 1): of the root (row 0, metres) and of joints
    (radians).
    """
    turns = logarithm(multiply(at.local[..., 1:], at.local[..., :-1] * CONJUGATE))
    for joint in chain.hinges:
        turns[joint] = np.diff(at.angles[joint], axis=-1)
    return np.concatenate([np.diff(at.root, axis=-1)[None], turns])


def _scales(chain: Chain, strength: float) -> np.ndarray:
    """Compute the factor of each row of the rates, (1 + J, 1, 1), which makes them metres."""
    return 0.5 * strength * np.concatenate([[1.0], np.full(len(chain.skeleton), ARM)])[:, None, None]


def _cost(state: State, strength: float, chain: Chain, given: int) -> float:
    """Compute half the weighted squares of the frames that are solved, and of all second differences."""
    bent = _scales(chain, strength) * np.diff(_rates(chain, state.poses), axis=-1)
    return float(state.cost[given:].sum() + 0.5 * np.sum(bent**2))


def _unsteady(chain: Chain, at: Poses, strength: float) -> np.ndarray:
    """Compute the derivative of the second differences' cost by shift (row 0) and rotations, (1 + J, 3, F)."""
    rates = _rates(chain, at)
    scale = _scales(chain, strength) ** 2
    pull = np.zeros((*rates.shape[:2], rates.shape[2] + 1))
    forces = np.zeros_like(rates)  # by each rate
    bent = scale * np.diff(rates, axis=-1)
    forces[..., 1:] += bent
    forces[..., :-1] -= bent
    # each rate depends on the later and the earlier frame; rotations need the conversion to small rotations
    later, earlier = forces.copy(), forces.copy()
    for joint in range(len(chain.skeleton)):
        if chain.turning[joint]:
            later[1 + joint] = carried_to_turns(rates[1 + joint], forces[1 + joint])
            earlier[1 + joint] = carried_to_turns(-rates[1 + joint], forces[1 + joint])
    pull[..., 1:] += later
    pull[..., :-1] -= earlier
    return pull


def _step(task: Task, best: State, stops: dict, strength: float, given: int, damping: float):
    """Solve one step: shift (3, F), rotations (J, 3, F), and the joints that limits hold (J, F)."""
    chain, own = task.chain, wishes(task, best)
    columns, away, weight = _columns(task, best)
    own.curvature[~chain.free[:, :, None] & np.eye(3, dtype=bool)] = 1.0  # fixed angles: a solvable equation
    unsteady = _unsteady(chain, best.poses, strength)
    slope = np.einsum("fra,fr->af", columns, weight * away)
    slope[3:] += own.pull.reshape(-1, own.pull.shape[-1])
    slope += unsteady.reshape(slope.shape)
    pull_before = own.pull.copy()
    held = limits.hold(chain, stops, best.poses, slope[3:].reshape(own.pull.shape), own)
    slope[3:] += (own.pull - pull_before).reshape(-1, own.pull.shape[-1])
    slope[3:][~chain.free.ravel()] = 0.0
    blocks = np.matmul(columns.transpose(0, 2, 1), weight[..., None] * columns)
    for joint in range(len(chain.skeleton)):
        rows = slice(3 + 3 * joint, 6 + 3 * joint)
        blocks[:, rows, rows] += np.moveaxis(own.curvature[joint], -1, 0)
    blocks[:, np.arange(blocks.shape[1]), np.arange(blocks.shape[1])] += damping + 1e-9
    change = _banded(blocks, -slope.T, np.repeat(_scales(chain, strength).ravel() ** 2, 3), given)
    return change[:, :3].T, np.moveaxis(change[:, 3:].reshape(len(change), -1, 3), 0, -1), held


def _columns(task: Task, best: State) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Build the derivative of all distances (F, R, columns), the distances (F, R) metres and their weights (F, R).

    Three rows for each marker; with a held point one row along its distance and three across it.
    """
    chain, at = task.chain, best.poses
    point = task.point
    if point is not None:
        joint, places = np.append(chain.joint, point.joint), np.append(chain.places, point.place[None], axis=0)
        chain = replace(chain, joint=joint, places=places)
    # each frame's own numbers side by side, for the products to come
    exact = np.ascontiguousarray(marker_derivative(chain, at)) * np.concatenate([np.ones(3), chain.free.ravel()])
    frames, count = len(exact), len(task.chain.joint)
    columns = exact[:, :count].reshape(frames, 3 * count, -1)
    away, weight = np.moveaxis(best.away, -1, 0).reshape(frames, -1), np.repeat(task.weights.T, 3, axis=1)
    if point is None:
        return columns, away, weight
    _, along, far = distance(point, best.placed)
    across = point.weight * crosswise(far, point.radius)
    row = np.einsum("af,fac->fc", along, exact[:, count])
    rest = exact[:, count] - along.T[:, :, None] * row[:, None]
    return (np.concatenate([columns, row[:, None], rest], axis=1),
            np.concatenate([away, far[:, None], np.zeros((frames, 3))], axis=1),
            np.concatenate([weight, point.weight[:, None], np.repeat(across[:, None], 3, axis=1)], axis=1))


def _banded(blocks: np.ndarray, right: np.ndarray, strength: np.ndarray, given: int) -> np.ndarray:
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
    kept = band[:, given:].reshape(2 * size + 1, -1)
    out = np.zeros((frames, size))
    out[given:] = solveh_banded(kept, right[given:].ravel(), lower=True, check_finite=False).reshape(-1, size)
    return out
