"""Which frames of two link stretches are most alike, so that one clip can be left for another there (Ball handling §4
eq. 1, Fig. 4).

Poses are compared as each body sees itself: the root stands over the origin and faces X. Position and velocity of the
main bones are worked out once for all link stretches; a transition lasts some given time, and its cost is the mean of
eq. 1 over that time. For all pairs at once, where to begin is found on a grid of tenths of a second by the sum of
squares of what eq. 1 adds up (one product of matrices); between the grid's points, by eq. 1 itself, where it is asked
for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass, field

import numpy as np

from ..errors import InputError
from ..library.library import Library
from ..motion import quaternion
from ..motion.humanoid import heading_from_positions, identify
from ..motion.motion import Motion, at_frames, pose_kinematics
from . import kept
from .hit_library import HitLibrary

BONES = ("root", "head", "left hand", "right hand", "left foot", "right foot")
_GRID = 10.0
_FINE = 60.0
_AT_ONCE = 8


@dataclass(frozen=True)
class BoneWeights:
    """The weights of eq. 1: of each of BONES' positions (without unit) and velocities (s). The feet count double,
    because feet that slide over the ground are what eyes notice."""

    position: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0, 2.0, 2.0)
    velocity: tuple[float, ...] = field(default=(0.1, 0.1, 0.1, 0.1, 0.2, 0.2))

    def __post_init__(self):
        for name in ("position", "velocity"):
            values = getattr(self, name)
            if len(values) != len(BONES) or not all(0.0 <= value < np.inf for value in values):
                expected = f"{len(BONES)} numbers from 0 up: {', '.join(BONES)}"
                raise InputError(f"weights of {name}", f"{values}", expected)


@dataclass(frozen=True)
class Link:
    """A link stretch: the clip's index, first and last frame (both included) in the clip's own rate."""

    clip: int
    first: int
    last: int


def links_of(library: Library, hits: HitLibrary, reach: float = 1.0, shortest: float = 0.2) -> tuple[Link, ...]:
    """The link stretches beside all hit motions, of either side: between them, before the first and after the last, in
    each clip that has any. reach: at most so many seconds from a hit motion. shortest: no shorter ones, s."""
    found = []
    for clip in sorted({one.clip for one in hits.hits}):
        motion = library.clips[clip].recording
        spans = sorted((one.hit.first, one.hit.last) for one in hits.hits if one.clip == clip)
        edges = [(-1, -1), *spans, (len(motion), len(motion))]
        most, least = int(reach * motion.fps), max(int(shortest * motion.fps), 1)
        for number, ((_, end), (begin, _)) in enumerate(zip(edges, edges[1:])):
            first, last = end + 1, begin - 1
            parts = [(first, min(last, first + most))] if number else []
            parts += [(max(first, last - most), last)] if number < len(edges) - 2 else []
            if len(parts) == 2 and parts[0][1] >= parts[1][0]:
                parts = [(first, last)]
            found += [Link(clip, *part) for part in parts if part[1] - part[0] >= least]
    return tuple(found)


def aligned(motion: Motion, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities (N, 6, 3), m and m/s, of BONES at fractional `frames` (N,), seen from the body: the root
    over the origin, facing X. Hands and head that a skeleton lacks are its chest."""
    step = motion.fps / _FINE
    before, here, after = (_bones(motion, frames + offset) for offset in (-step, 0.0, step))
    taken = np.clip(frames + step, 0, len(motion) - 1) - np.clip(frames - step, 0, len(motion) - 1)
    velocity = (after[0] - before[0]) * (motion.fps / np.maximum(taken, 1e-9))[:, None, None]
    places, facing = here
    turn = quaternion.about_up(-facing)[:, None]
    return quaternion.rotate(turn, places - places[:, :1] * [1.0, 1.0, 0.0]), quaternion.rotate(turn, velocity)


def _bones(motion: Motion, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """World positions (N, 6, 3) m of BONES, and the heading (N,) rad."""
    root, local = at_frames(motion, frames)
    places, _ = pose_kinematics(motion.skeleton, root, local)
    body = identify(motion.skeleton)
    chest = body.chest
    joints = [
        body.hips, chest if body.head is None else body.head,
        *(chest if limb.hand is None else limb.hand for limb in (body.left, body.right)),
        body.left.toe_or_foot, body.right.toe_or_foot,
    ]
    return places[:, joints], heading_from_positions(motion.skeleton, places)


def pose_distance(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Eq. 1 between weighted poses (N, 12, 3) and (M, 12, 3): (N, M)."""
    total = np.zeros((len(a), len(b)), a.dtype)
    for bone in range(a.shape[1]):
        x, y = a[:, bone], b[:, bone]
        square = (x**2).sum(axis=1)[:, None] + (y**2).sum(axis=1) - 2.0 * (x @ y.T)
        total += np.sqrt(np.maximum(square, 0.0, out=square), out=square)
    return total


@dataclass(frozen=True, eq=False)
class Transitions:
    """The best transition (S_T) from each of n link stretches into each other one.

    seconds: how long a transition lasts. leave, enter (n, n): frames, in each clip's own rate, at which the one is left
    and the other entered when transitions begin, on the grid. cost (n, n): mean of eq. 1 over the transition.
    """

    library: Library
    links: tuple[Link, ...]
    seconds: float
    weights: BoneWeights
    leave: np.ndarray
    enter: np.ndarray
    cost: np.ndarray

    @staticmethod
    def of(
        library: Library, links: Sequence[Link], seconds: float = 0.3, weights: BoneWeights = BoneWeights()
    ) -> "Transitions":
        """Transitions of `seconds` between all pairs of `links`; kept beside the library's cache."""
        if not 0.0 <= seconds <= 5.0:
            raise InputError("transition", f"{seconds:g} seconds", "0 to 5")
        links = tuple(links)
        asked = np.array([seconds, *weights.position, *weights.velocity])
        stretches = np.array([astuple(link) for link in links]).reshape(-1, 3)
        arrays = kept.load(library, "transitions")
        known = arrays is not None and np.array_equal(arrays["asked"], asked)
        if not known or not np.array_equal(arrays["links"], stretches):
            leave, enter, cost = _best(library, links, seconds, weights)
            arrays = {"asked": asked, "links": stretches, "leave": leave, "enter": enter, "cost": cost}
            kept.save(library, "transitions", arrays)
        return Transitions(library, links, seconds, weights, arrays["leave"], arrays["enter"], arrays["cost"])

    def best(self, a: int, b: int) -> tuple[float, float, float]:
        """The best transition from link a into link b: frame at which a is left and frame at which b is entered when it
        begins, in each clip's own rate, found between the grid's points, and its cost."""
        frames, poses = zip(*(self._around(number, at[a, b]) for number, at in ((a, self.leave), (b, self.enter))))
        lengths = [len(one) for one in frames]
        steps = max(int(round(self.seconds * _FINE)), 1)
        distance = pose_distance(*poses)
        count_a, count_b = (max(length - steps, 1) for length in lengths)
        total = np.zeros((count_a, count_b))
        for step in range(steps + 1):
            rows = np.minimum(np.arange(count_a) + step, lengths[0] - 1)
            columns = np.minimum(np.arange(count_b) + step, lengths[1] - 1)
            total += distance[np.ix_(rows, columns)]
        total /= steps + 1
        i, j = np.unravel_index(int(np.argmin(total)), total.shape)
        return float(frames[0][i]), float(frames[1][j]), float(total[i, j])

    def _around(self, number: int, frame: float) -> tuple[np.ndarray, np.ndarray]:
        """Fine frames (K,) from a grid step before `frame` to one after the transition's end, within the link, and
        their weighted poses (K, 12, 3)."""
        link = self.links[number]
        motion = self.library.clips[link.clip].recording
        step = motion.fps / _FINE
        back = min(motion.fps / _GRID, frame - link.first)
        on = min(self.seconds * motion.fps + motion.fps / _GRID, link.last - frame)
        frames = frame - back + step * np.arange(int((back + on) / step + 1e-6) + 1)
        return frames, _weighted(aligned(motion, frames), self.weights)


def _weighted(poses: tuple[np.ndarray, np.ndarray], weights: BoneWeights) -> np.ndarray:
    """(N, 12, 3): positions and velocities times their weights, whose norms eq. 1 adds up."""
    position, velocity = poses
    return np.concatenate(
        [position * np.array(weights.position)[:, None], velocity * np.array(weights.velocity)[:, None]], axis=1
    )


def _best(library: Library, links: tuple[Link, ...], seconds: float, weights: BoneWeights):
    """leave, enter and cost (n, n) of `Transitions`. Links are padded to one length by repeating their last grid point,
    so that all pairs are one array."""
    count = len(links)
    if not count:
        return np.zeros((0, 0)), np.zeros((0, 0)), np.zeros((0, 0))
    frames = [_grid(link, library) for link in links]
    longest = max(len(one) for one in frames)
    frames = np.stack([np.pad(one, (0, longest - len(one)), mode="edge") for one in frames])
    poses = _poses(library, links, frames, weights)
    later = np.minimum(np.arange(longest)[:, None] + np.arange(int(round(seconds * _GRID)) + 1), longest - 1)
    windows = poses[:, later].reshape(count, longest, -1)
    a, b, cost = (np.empty((count, count), kind) for kind in (int, int, float))
    for start in range(0, count, _AT_ONCE):
        rows = slice(start, start + _AT_ONCE)
        a[rows], b[rows] = _nearest(windows[rows], windows)
        here = poses[np.arange(count)[rows, None, None], later[a[rows]]]
        there = poses[np.arange(count)[None, :, None], later[b[rows]]]
        cost[rows] = np.linalg.norm(here - there, axis=-1).sum(axis=-1).mean(axis=-1)
    numbers = np.arange(count)
    return frames[numbers[:, None], a], frames[numbers[None, :], b], cost


def _nearest(rows: np.ndarray, every: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which of S windows (r, S, D) and which of S windows (n, S, D) are nearest to each other, for all pairs: two (r,
    n) arrays of indices into S."""
    count, longest, width = every.shape
    mine, others = rows.reshape(-1, width), every.reshape(-1, width)
    square = mine @ others.T
    square *= -2.0
    square += (mine**2).sum(axis=1)[:, None]
    square += (others**2).sum(axis=1)
    by_row = square.reshape(-1, count, longest)
    column = by_row.argmin(axis=2)
    least = np.take_along_axis(by_row, column[:, :, None], axis=2)[:, :, 0].reshape(len(rows), longest, count)
    row = least.argmin(axis=1)
    return row, np.take_along_axis(column.reshape(len(rows), longest, count), row[:, None], axis=1)[:, 0]


def _grid(link: Link, library: Library) -> np.ndarray:
    fps = library.clips[link.clip].motion.fps
    return link.first + (fps / _GRID) * np.arange(int((link.last - link.first) * _GRID / fps + 1e-6) + 1)


def _poses(library: Library, links: tuple[Link, ...], frames: np.ndarray, weights: BoneWeights) -> np.ndarray:
    """(n, S, 12, 3) weighted poses at `frames` (n, S), in single precision."""
    found = [
        _weighted(aligned(library.clips[link.clip].recording, row), weights) for link, row in zip(links, frames)
    ]
    return np.stack(found).astype(np.float32)
