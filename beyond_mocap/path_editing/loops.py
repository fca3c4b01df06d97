"""Find where a motion can be repeated: pairs of frames with the same pose and movement, a stride or more apart.

The comparison uses places and velocities of the main joints in the path's moving frame, which travels with the body, in
a window around both frames; the soles in contact; and the offset of the body from its path. A motion graph (Kovar et
al. 2002) finds its transitions in the same way. The search is bounded: coarse over at most two and a half million
pairs, then exact around the best two dozen.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from ..base.errors import InputError
from ..motion.humanoid import identify_joints
from ..motion.motion import compute_pose
from ..motion.skeleton import Skeleton
from .path_frame import Residuals

WINDOW_SECONDS = 0.12
"""Pairs are compared over this time before and after."""
_VELOCITY_SECONDS = 0.1  # metres per second count as metres moved in this time
# coarse rate; limits of pairs, rows, candidates
_COARSE_FPS, _PAIRS, _COLUMNS, _MOST_CANDIDATES = 30.0, 2_500_000, 9000, 24
_STRIDE_SHARE = 0.85  # shortest loop, as a share of the stride's time: strides differ
_SLOWEST, _SLOW_SHARE = 0.2, 0.5  # m/s, and share of the usual speed, below which no loop starts: a stop is no gait
_CONTACT_COST = 0.06  # cost in metres of a sole whose contact differs
_FOOT_COST = 0.5  # cost of each metre between the places of feet in contact at both ends: the fade would move them
_NO_FADE_COST = 0.05  # cost in metres of having no frames to fade over
_LENGTH_BONUS = 0.3  # by how much a second stride improves a loop of one stride
_MOST_DISTANCE = 0.6  # largest relative distance of a loop's ends
# least share of a loop with each foot alone in contact: jumps with both feet are no strides
_LEAST_SINGLE_CONTACT = 0.08
_JOINTS = 16  # compared at most, for a body without known joints
_SHORTEST_STRIDE, _LONGEST_STRIDE = 0.35, 2.5  # seconds


@dataclass(frozen=True, kw_only=True)
class Loop:
    """Frames `start` .. `end` - 1 to be repeated: at `end` the pose and movement are those at `start`.

    Attributes:
        start: first frame.
        end: first frame after the loop.
        distance: metres between both ends (root mean square over joints, places and velocities, in a window).
        relative_distance: the same as a share of the usual distance of two moments of the motion.
        cost: metres, the distance with all that counts against the loop.
        metres: arc length of one lap.
        strides: of one lap, about.
        end_distance: distance of the motion's last moment from the nearest in the loop, as `relative_distance`.
    """

    start: int
    end: int
    distance: float
    relative_distance: float
    cost: float
    metres: float
    strides: float
    end_distance: float

    def __len__(self) -> int:
        return self.end - self.start


def find_loops(residuals: Residuals) -> tuple[Loop, ...]:
    """Find the best loop for each number of strides.

    Args:
        residuals: the motion relative to its own path.
    Returns:
        Loops, lowest cost first; () for a motion that stays in place, or moves for less than a stride.
    """
    pace = smooth_speed(residuals)
    moving = pace > _SLOWEST
    if not moving.any():
        return ()
    features = _compute_features(residuals)
    stride = measure_stride(residuals, features)
    least = int(np.ceil(_STRIDE_SHARE * stride)) if stride else 0
    if not 0 < least < len(features) - 1:
        return ()
    free = pace >= max(_SLOWEST, _SLOW_SHARE * float(np.median(pace[moving])))
    tried = _search_coarse(features, residuals, free, least, stride)
    usual = float(np.sqrt(2.0 * features[moving].var(axis=0).sum()))
    feet = _locate_feet(residuals.skeleton, features)
    found = [_refine_loop(features, residuals, pair, free=free, least=least, stride=stride, usual=usual,
                          feet=feet) for pair in tried]
    found = [loop for loop in found if loop and loop.relative_distance <= _MOST_DISTANCE
             and _has_strides(residuals.standing, loop)]
    best: dict[int, Loop] = {}
    for loop in sorted(found, key=lambda loop: (loop.cost, loop.start, loop.end)):
        best.setdefault(max(int(round(loop.strides)), 1), loop)
    return tuple(best.values())


def smooth_speed(residuals: Residuals) -> np.ndarray:
    """Compute the speed along the path, averaged over half a second.

    Args:
        residuals: the motion.
    Returns:
        (T,) metres per second.
    """
    speed = residuals.step * residuals.fps
    if len(speed) > 1:
        speed = np.concatenate([speed[1:2], speed[1:]])
    return uniform_filter1d(speed, 2 * int(0.25 * residuals.fps) + 1, mode="nearest")


def measure_stride(residuals: Residuals, features: np.ndarray | None = None) -> float | None:
    """Measure the duration of a stride, from one landing of a foot to its next: the median while the motion moves.

    From the contacts; without contacts from the lag after which poses repeat; for a single stride from its two steps.

    Args:
        residuals: the motion.
        features: (T, D) metres as of `find_loops`; None to compute them.
    Returns:
        Frames, fractional; None without any stride.
    """
    moving = smooth_speed(residuals) > _SLOWEST
    edges = np.diff(residuals.standing.any(axis=2).astype(np.int8), axis=0)
    at = [[np.flatnonzero((edges[:, side] == kind) & moving[1:]) for side in (0, 1)] for kind in (1, -1)]
    whole = _compute_typical_stride(np.concatenate([np.diff(sides) for pair in at for sides in pair]), residuals.fps)
    if whole is not None:
        return whole
    again = _find_period(_compute_features(residuals) if features is None else features, moving, residuals.fps)
    if again is not None:
        return again
    return _compute_typical_stride(np.concatenate([2.0 * np.abs(pair[0][:, None] - pair[1]).ravel() for pair in at]),
                                   residuals.fps)


def _compute_typical_stride(frames: np.ndarray, fps: float) -> float | None:
    """Compute the median of those durations that can be a stride's; None without any."""
    possible = frames[(frames > _SHORTEST_STRIDE * fps) & (frames < _LONGEST_STRIDE * fps)]
    return float(np.median(possible)) if len(possible) else None


def _find_period(features: np.ndarray, moving: np.ndarray, fps: float) -> float | None:
    """Find the first lag, in frames, after which poses repeat at half their usual distance or less; None without
    one.
    """
    shown = features[moving]
    lags = np.arange(int(_SHORTEST_STRIDE * fps), min(int(_LONGEST_STRIDE * fps), len(shown) - 1) + 1)
    if len(lags) < 3:
        return None
    apart = np.array([np.mean(np.sum((shown[lag:] - shown[:-lag]) ** 2, axis=1)) for lag in lags])
    inner, usual = apart[1:-1], 2.0 * shown.var(axis=0).sum()
    lowest = (inner <= apart[:-2]) & (inner < apart[2:]) & (inner < 0.25 * usual)
    return float(lags[1:-1][lowest][0]) if lowest.any() else None


def _compute_features(residuals: Residuals) -> np.ndarray:
    """Compute the features (T, D) metres that loops compare.

    Places of the main joints across and above the path, along it from the pelvis, and their movement over the ground in
    _VELOCITY_SECONDS; scaled so that a distance is the root mean square over joints.
    """
    joints = _choose_joints(residuals.skeleton)
    root = residuals.place * [0.0, 1.0, 1.0]
    places = compute_pose(residuals.skeleton, root, residuals.rotations)[0][:, joints]
    along = np.cumsum(residuals.step) + residuals.place[:, 0]
    ground = places + along[:, None, None] * [1.0, 0.0, 0.0]
    velocity = _compute_velocity(ground, max(1, int(round(residuals.fps / 60.0)))) * residuals.fps
    both = np.concatenate([places, _VELOCITY_SECONDS * velocity], axis=1)
    return both.reshape(len(both), -1) / np.sqrt(len(joints))


def _locate_feet(skeleton: Skeleton, features: np.ndarray) -> np.ndarray | None:
    """Locate the left and right foot relative to the pelvis: (T, 2, 2) metres along and across the path; None
    without feet.
    """
    try:
        body = identify_joints(skeleton)
    except InputError:
        return None
    joints = _choose_joints(skeleton)
    at = [3 * joints.index(limb.toe_or_foot) for limb in (body.left, body.right)]
    return np.sqrt(len(joints)) * np.stack([features[:, k : k + 2] for k in at], axis=1)


def _compute_velocity(values: np.ndarray, reach: int) -> np.ndarray:
    """Compute the change per frame (T, ...) of values (T, ...), by differences over `reach` frames to either side."""
    at = np.arange(len(values))
    after, before = np.minimum(at + reach, len(values) - 1), np.maximum(at - reach, 0)
    return (values[after] - values[before]) / np.maximum(after - before, 1).reshape(-1, *[1] * (values.ndim - 1))


def _choose_joints(skeleton: Skeleton) -> list[int]:
    """Choose the joints that define a pose: hips, chest, head, knees, feet, hands; of an unknown body, a spread over
    it.
    """
    try:
        body = identify_joints(skeleton)
    except InputError:
        return np.unique(np.linspace(0, len(skeleton) - 1, min(_JOINTS, len(skeleton))).round().astype(int)).tolist()
    limbs = [(limb.lower_leg, limb.foot, limb.toe, limb.lower_arm, limb.hand) for limb in (body.left, body.right)]
    joints = (body.hips, body.chest, body.head, *limbs[0], *limbs[1])
    return sorted({joint for joint in joints if joint is not None})


def _has_strides(standing: np.ndarray, loop: Loop) -> bool:
    """Return whether the feet carry the body alternately in a loop, or no contacts are known."""
    left, right = np.moveaxis(standing[loop.start : loop.end].any(axis=2), 1, 0)
    alone = min(np.mean(left & ~right), np.mean(right & ~left))
    return bool(alone >= _LEAST_SINGLE_CONTACT or not standing.any())


def _search_coarse(features: np.ndarray, residuals: Residuals, free: np.ndarray, least: int,
                   stride: float) -> list[tuple[int, int]]:
    """Search pairs (start, end) of similar frames at a low rate: up to _MOST_CANDIDATES, all well separated."""
    count, fps = len(features), residuals.fps
    every = max(int(round(fps / _COARSE_FPS)), -(-count // _COLUMNS), 1)
    ends = np.arange(0, count, every)
    starts = ends[:: max(-(-(len(ends) ** 2) // _PAIRS), 1)]
    starts, ends = starts[free[starts]], ends[free[ends]]
    if not len(starts) or not len(ends):
        return []
    a, b = (features[at].astype(np.float32) for at in (starts, ends))
    # Squared distances of all starts (rows) and ends (columns) as |a|^2 + |b|^2 - 2 a b, by one matrix product.
    square = (a * a).sum(1)[:, None] + (b * b).sum(1)[None] - 2.0 * (a @ b.T)
    score = np.sqrt(np.maximum(square, 0.0))
    length = (ends[None] - starts[:, None]).astype(np.float32)
    paused = np.cumsum(~free, dtype=np.float32)
    score *= _compute_length_factor(length, paused[ends][None] - paused[starts][:, None], stride)
    score[length < least] = np.inf
    order = np.argpartition(score, min(2000, score.size - 1), axis=None)[:2000]
    order = order[np.argsort(score.flat[order], kind="stable")]
    row, column = np.unravel_index(order[np.isfinite(score.flat[order])], score.shape)
    return _select_separated(np.stack([starts[row], ends[column]], axis=1), 0.25 * stride)


def _compute_length_factor(length: np.ndarray, paused: np.ndarray, stride: float) -> np.ndarray:
    """Compute the factor on distances: lower for long loops, higher for loops that pause in between."""
    return (1.0 + _LENGTH_BONUS * stride / np.maximum(length, 1.0)) * (1.0 + 2.0 * paused / np.maximum(length, 1.0))


def _select_separated(pairs: np.ndarray, reach: float) -> list[tuple[int, int]]:
    """Select the first _MOST_CANDIDATES pairs (K, 2), best first, of which no two are within `reach` frames in both
    start and end.
    """
    selected: list[tuple[int, int]] = []
    while len(pairs) and len(selected) < _MOST_CANDIDATES:
        selected.append((int(pairs[0, 0]), int(pairs[0, 1])))
        pairs = pairs[np.abs(pairs - pairs[0]).max(axis=1) > reach]
    return selected


def _refine_loop(features: np.ndarray, residuals: Residuals, pair: tuple[int, int], free: np.ndarray, least: int,
                 stride: float, usual: float, feet: np.ndarray | None) -> Loop | None:
    """Refine a coarse pair to the best loop around it, compared over windows at the full rate.

    usual: metres between any two moments; feet (T, 2, 2) m: as of `_locate_feet`.
    """
    count, fps = len(features), residuals.fps
    reach, window = int(np.ceil(fps / 12.0)), int(round(WINDOW_SECONDS * fps))
    start, end = (at + np.arange(-reach - window, reach + window + 1) for at in pair)
    inside = [(at >= 0) & (at < count) for at in (start, end)]
    # All (start, end) within `reach` of the pair, with `window` more on either side; frames beyond the motion are
    # unknown.
    known = inside[0][:, None] & inside[1][None]
    start, end = (np.clip(at, 0, count - 1) for at in (start, end))
    a, b = features[start], features[end]
    square = np.maximum((a * a).sum(1)[:, None] + (b * b).sum(1)[None] - 2.0 * (a @ b.T), 0.0)
    wrong, moved = _compare_contacts(residuals, feet, start, end)
    total, wrong, moved, seen = (
        _sum_diagonals(np.where(known, v, 0.0), window) for v in (square, wrong, moved, 1.0 * known)
    )
    # A sum along a diagonal compares the windows around start + k and end + k; `seen` counts the known ones.
    seen = np.maximum(seen, 1e-9)
    middle = slice(window, len(a) - window)
    start, end = start[middle][:, None], end[middle][None]
    length = end - start
    paused = np.cumsum(~free)
    apart = np.sqrt(total / seen)
    cost = apart + (_CONTACT_COST * wrong + _FOOT_COST * moved) / seen + _NO_FADE_COST * (1.0 - seen / (2 * window + 1))
    cost = cost * _compute_length_factor(length, paused[end] - paused[start], stride)
    cost[~(known[middle, middle] & (length >= least) & free[start] & free[end])] = np.inf
    at = np.unravel_index(np.argmin(cost), cost.shape)
    if not np.isfinite(cost[at]):
        return None
    first, last = int(start[at[0], 0]), int(end[0, at[1]])
    metres = float(residuals.step[first + 1 : last + 1].sum())
    off = float(apart[at])
    ending = float(np.linalg.norm(features[first:last] - features[-1], axis=1).min())
    usual = max(usual, 1e-9)
    return Loop(start=first, end=last, distance=off, relative_distance=off / usual, cost=float(cost[at]), metres=metres,
                strides=(last - first) / stride, end_distance=ending / usual)


def _compare_contacts(residuals: Residuals, feet: np.ndarray | None, start: np.ndarray,
                      end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compare contacts of frames `start` (N,) and `end` (M,).

    Returns (N, M) the share of soles in contact at one alone, and the metres by which feet in contact at both differ
    under the body.
    """
    soles = residuals.standing.reshape(len(residuals), 4)
    wrong = (soles[start][:, None] != soles[end][None]).mean(axis=2)
    if feet is None:
        return wrong, np.zeros_like(wrong)
    stands = residuals.standing.any(axis=2)
    off = np.linalg.norm(feet[start][:, None] - feet[end][None], axis=-1)
    return wrong, np.max(np.where(stands[start][:, None] & stands[end][None], off, 0.0), axis=2)


def _sum_diagonals(values: np.ndarray, window: int) -> np.ndarray:
    """Sum a square array over 2 * window + 1 places along its diagonals, where they lie inside."""
    size = len(values) - 2 * window
    return sum((values[k : k + size, k : k + size] for k in range(2 * window + 1)), np.zeros(()))
