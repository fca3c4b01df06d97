"""Bridge gaps in which nothing of a person is seen, as people move: those of a library, and the person themselves.

What people do between two poses in less than a second is much alike. Stretches of examples that begin and end most like
a gap are found, faster and slower ones too. How they move between is regressed on how they begin and end: a local
linear model of nearest neighbours (Chai and Hodgins 2005, "Performance animation from low-dimensional control
signals"). What it lacks at the ends, a body's build and noise among it, is soon forgotten between them (a Gaussian
process: Rasmussen and Williams 2006, "Gaussian processes for machine learning", eq. 2.25). Poses are compared in the
heading frame of their own end; place and turn between both ends count less.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base.time_series import find_runs
from ..motion import quaternion
from .joint_examples import (
    CONTEXT,
    RATE,
    JointExamples,
    build_examples,
    describe_end,
    find_root,
    measure_heading,
    measure_size,
    mirror_joints,
)

SHORTEST_GAP = 0.15
"""Seconds; shorter gaps are only smoothed over."""

_OWN = 30.0  # s on either side in which the person's own motion counts
_SHORTEST_OWN = 1.0  # s
_RATES = (0.8, 0.9, 1.0, 1.1, 1.25)  # at which examples are played
_NEIGHBOURS = 60
_FEWEST = 10  # neighbours of which a model can be made
_NOISE = 0.05  # m in what is compared that the regression expects
_REST_STAYS, _REST_SECONDS, _REST_NOISE = 0.3, 0.15, 0.3  # of what the model lacks at an end: shares and s
_GROWTH, _PATH_NOISE = 0.1, 0.06  # m, usual errors: of a bridge's place, for each second; of a path's shape
_WAVES = 3  # half waves within a gap, up to which a path is followed: faster ones are its noise
_PLACE, _TURN = 0.3, 0.3  # weights of m between the ends, and of rad of turning


@dataclass(frozen=True, eq=False)
class _Gap:
    """What is known of a gap.

    Attributes:
        seconds: from the last seen frame before to the first one after it.
        share: (T,) of its frames, from 0 at the first of these to 1 at the other.
        ends: (D,) how it begins and ends (`describe_end`), the place and the turn between both, weighted.
    """

    seconds: float
    share: np.ndarray
    ends: np.ndarray


@dataclass(frozen=True, eq=False)
class _Neighbours:
    """Stretches of examples: their costs (K,), `ends` (K, D), and motion between (K, T, J, 3)."""

    cost: np.ndarray
    ends: np.ndarray
    motion: np.ndarray


def bridge_gaps(joints: np.ndarray, hidden: np.ndarray, fps: float, library: JointExamples | None,
                path: np.ndarray | None = None) -> np.ndarray:
    """Bridge the gaps of one person.

    Args:
        joints: (T, K, 3) m, the first K of COMPARED, smooth, anything in the gaps.
        hidden: (T,) bool, the frames of gaps; the first and the last are seen.
        fps: frames per second.
        library: examples of other people; None: the person's own motion alone.
        path: (T, 2) m, where other tracking has the person, NaN where it does not; None for none.
    Returns:
        (T, K, 3); gaps for which too few examples are known stay as they are.
    """
    size = measure_size(joints[~hidden])
    others = None if library is None else library.select(joints.shape[1])
    out = joints * size
    runs = find_runs(hidden)
    seen_to = [first for first, _ in runs[1:]] + [len(joints)]
    for (first, end), last in zip(runs, seen_to):
        if (end - first) / fps >= SHORTEST_GAP:
            banks = [bank for bank in (others, _collect_own(out, hidden, (first, end), fps)) if bank is not None]
            out[first:end] = _bridge(out, (first, end), last, banks, fps)
            if path is not None:
                _follow_path(out, (first, end), size * path, fps)
    return out / size


def _follow_path(joints: np.ndarray, gap: tuple[int, int], path: np.ndarray, fps: float) -> None:
    """Move the joints (T, J, 3) of a gap, in place, towards where the path (T, 2) goes between its ends, as far as that
    is likely to be nearer.
    """
    first, end = gap
    reach = int(round(CONTEXT * fps))
    away = path - find_root(joints)
    known = np.isfinite(away[:, 0])
    sides = [slice(max(first - reach, 0), first), slice(end, end + reach)]
    if not all(known[side].any() for side in sides) or not known[first:end].all():
        return
    offset = [np.nanmean(away[side], axis=0) for side in sides]
    share = ((np.arange(first, end) - first + 1) / (end - first + 1))[:, None]
    waves = np.sin(np.pi * share * np.arange(1, _WAVES + 1))  # none moves the ends
    rest = away[first:end] - offset[0] - share * (offset[1] - offset[0])
    own, other = (_GROWTH * (end - first) / fps) ** 2, _PATH_NOISE**2
    joints[first:end, :, :2] += own / (own + other) * (waves @ np.linalg.lstsq(waves, rest, rcond=None)[0])[:, None]


def _collect_own(joints: np.ndarray, hidden: np.ndarray, gap: tuple[int, int],
                 fps: float) -> JointExamples | None:
    """Collect what is seen of the person around a gap, and its mirror image; None where that is too short."""
    low, high = max(gap[0] - int(_OWN * fps), 0), gap[1] + int(_OWN * fps)
    runs = [(low + first, low + end) for first, end in find_runs(~hidden[low:high])]
    parts = [_sample(joints[first:end], np.arange(0.0, end - first - 1, fps / RATE)) for first, end in runs
             if end - first > _SHORTEST_OWN * fps]
    return build_examples([*parts, *map(mirror_joints, parts)]) if parts else None


def _sample(values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Sample values (T, ...) at fractional frames, linearly."""
    low = np.floor(at).astype(int)
    weight = (at - low).reshape(*at.shape, *[1] * (values.ndim - 1)).astype(values.dtype)
    return values[low] * (1.0 - weight) + values[np.minimum(low + 1, len(values) - 1)] * weight


def _bridge(joints: np.ndarray, gap: tuple[int, int], last: int, banks: Sequence[JointExamples],
            fps: float) -> np.ndarray:
    """Bridge one gap, behind which joints are seen up to the frame `last`: (T, J, 3)."""
    first, end = gap
    reach = int(round(CONTEXT * fps))
    sides = [np.arange(max(first - 1 - reach, 0), first), np.arange(end, min(end + reach + 1, last))]
    before, after = joints[sides[0]], joints[sides[1]]
    if not banks or min(len(before), len(after)) < 2:
        return joints[first:end]
    frames = np.arange(first, end) - first + 1
    known = _describe_gap(before, after, (end - first + 1) / fps, frames / (end - first + 1), fps)
    found = _join([_find_neighbours(bank, known) for bank in banks])
    if len(found.cost) < _FEWEST:
        return joints[first:end]
    motion, ends = _regress(found, known.ends)
    line = _interpolate_frames(before[-1], after[0], known.share)
    return _place(motion + _predict_rest(known, ends), *line)


def _describe_gap(before: np.ndarray, after: np.ndarray, seconds: float, share: np.ndarray, fps: float) -> _Gap:
    """Describe a gap by the joints that are seen before and after it (T, J, 3)."""
    ends, roots, headings = [], [], []
    for joints, at in ((before, -1), (after, 0)):
        heading, root = measure_heading(joints[at][None])[0], find_root(joints[at][None])[0]
        velocity = (joints[-1] - joints[0]) / ((len(joints) - 1) / fps)
        pose = quaternion.rotate_about_up(joints[at] - [*root, 0.0], -heading)
        ends.append(describe_end(pose[None], quaternion.rotate_about_up(velocity, -heading)[None])[0])
        roots.append(root)
        headings.append(heading)
    place = quaternion.rotate_level(roots[1] - roots[0], -headings[0])
    turn = quaternion.wrap_angle(headings[1] - headings[0])
    return _Gap(seconds, share, np.concatenate([*ends, _PLACE * place, [_TURN * turn]]))


def _find_neighbours(bank: JointExamples, gap: _Gap) -> _Neighbours:
    """Find the stretches of examples that begin and end most like a gap."""
    half = (len(gap.ends) - 3) // 2
    before, after = bank.ends
    begins = np.sum((before - gap.ends[:half]) ** 2, axis=1)
    closes = np.sum((after - gap.ends[half : 2 * half]) ** 2, axis=1)
    reach, at = int(round(CONTEXT * RATE)), np.arange(len(begins))
    rows = []
    for count in sorted({max(int(round(gap.seconds * rate * RATE)), 1) for rate in _RATES}):
        first = at[(at - reach >= bank.first) & (at + count + reach <= bank.last)]
        place = quaternion.rotate_level(bank.root[first + count] - bank.root[first], -bank.heading[first])
        turn = quaternion.wrap_angle(bank.heading[first + count] - bank.heading[first])
        between = np.column_stack([_PLACE * place, _TURN * turn])
        cost = begins[first] + closes[first + count] + np.sum((between - gap.ends[2 * half :]) ** 2, axis=1)
        rows.append(np.column_stack([cost, first, first + count, between]))
    rows = np.concatenate(rows)
    rows = rows[np.argsort(rows[:, 0], kind="stable")[:_NEIGHBOURS]]
    first, end = rows[:, 1].astype(int), rows[:, 2].astype(int)
    return _Neighbours(rows[:, 0], np.concatenate([before[first], after[end], rows[:, 3:]], axis=1),
                       _cut_motion(bank, first, end, gap.share))


def _cut_motion(bank: JointExamples, first: np.ndarray, end: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Cut the motion (K, T, J, 3) of examples between the frames `first` and `end` (K,), relative to a frame that goes
    evenly from the root and heading of the one to those of the other.
    """
    joints = _sample(bank.joints, first[:, None] + share * (end - first)[:, None])
    root = bank.root[first][:, None] + share[:, None] * (bank.root[end] - bank.root[first])[:, None]
    turn = quaternion.wrap_angle(bank.heading[end] - bank.heading[first])
    heading = bank.heading[first][:, None] + share * turn[:, None]
    level = joints[..., :2] - root[:, :, None]
    return quaternion.rotate_about_up(np.concatenate([level, joints[..., 2:]], axis=3), -heading[..., None])


def _join(found: Sequence[_Neighbours]) -> _Neighbours:
    """Join the neighbours of several examples to the nearest of all."""
    cost, ends, motion = (np.concatenate([getattr(one, name) for one in found]) for name in ("cost", "ends", "motion"))
    best = np.argsort(cost, kind="stable")[:_NEIGHBOURS]
    return _Neighbours(cost[best], ends[best].astype(float), motion[best].astype(float))


def _regress(found: _Neighbours, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Regress the motion on the ends: the motion (T, J, 3) between `ends` (D,), and the ends (D,) that it has."""
    near = max(found.cost[len(found.cost) // 4], 1e-12)
    weight = np.exp(-0.5 * found.cost / near)
    weight /= weight.sum()
    values = np.concatenate([found.motion.reshape(len(weight), -1), found.ends], axis=1)
    mean, middle = weight @ values, weight @ found.ends
    root = np.sqrt(weight)[:, None]
    apart = root * (found.ends - middle)
    shares = np.linalg.solve(apart @ apart.T + _NOISE**2 * np.eye(len(weight)), apart @ (ends - middle))
    out = mean + shares @ (root * (values - mean))
    return out[: found.motion[0].size].reshape(found.motion.shape[1:]), out[found.motion[0].size :]


def _predict_rest(gap: _Gap, ends: np.ndarray) -> np.ndarray:
    """Predict what a motion that has `ends` (D,) lacks of the gap's own (T, J, 3), from what its poses lack at either
    end: Gaussian process regression.
    """
    half = (len(ends) - 3) // 2
    lacks = (gap.ends - ends)[: 2 * half].reshape(2, -1, 6)[..., :3] * np.sqrt(half // 6)
    at = gap.seconds * np.stack([gap.share, 1.0 - gap.share], axis=1)
    known = _compute_covariance(gap.seconds * np.eye(2)[::-1]) + _REST_NOISE * np.eye(2)
    return np.einsum("te,ejc->tjc", _compute_covariance(at) @ np.linalg.inv(known), lacks)


def _compute_covariance(seconds: np.ndarray) -> np.ndarray:
    """Compute how alike what a motion lacks is after some time, 1 at once: its build stays, the rest is forgotten."""
    return _REST_STAYS + (1.0 - _REST_STAYS) * np.exp(-0.5 * (seconds / _REST_SECONDS) ** 2)


def _interpolate_frames(before: np.ndarray, after: np.ndarray, share: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Interpolate root (T, 2) m and heading (T,) rad between two frames (J, 3)."""
    both = np.stack([before, after])
    root, heading = find_root(both), measure_heading(both)
    turn = quaternion.wrap_angle(heading[1] - heading[0])
    return root[0] + share[:, None] * (root[1] - root[0]), heading[0] + share * turn


def _place(motion: np.ndarray, root: np.ndarray, heading: np.ndarray) -> np.ndarray:
    """Place a motion (T, J, 3) at root (T, 2) m and heading (T,) rad."""
    out = quaternion.rotate_about_up(motion, heading[:, None])
    out[..., :2] += root[:, None]
    return out
