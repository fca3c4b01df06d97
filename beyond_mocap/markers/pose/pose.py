"""Solve the pose of every frame: the whole chain is fitted to all markers at once (Fredriksson sections 3.5.1 and 5.3).

Every frame starts from a solved neighbour (section 5.3.3). Some frames are solved first, from their own markers and
again from their solved neighbours, and the better solution is kept; then those between, from both neighbours.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from ...base.errors import Cancelled, InputError
from ...motion import quaternion
from ...motion.motion import Motion
from ..frames import placed as carried
from ..frames import rigid_fit
from .chain import Chain, Poses, chain, place, poses
from .descent import HeldPoint, Task, descend
from .residuals import marker_weights, seen_markers
from .smooth import smooth
from .start import first_poses

_CHUNK = 512  # frames solved together
_COARSE_SECONDS = 1.0 / 60.0  # spacing of the frames that are solved first
_ENOUGH = 0.3  # share of the markers that a frame must show to be solved
_FEWEST = 4  # markers that it must show at least
_DEAR, _FAR = 1.5, np.radians(40.0)  # a solution is doubtful at so many times its neighbour's cost, or rotation
_FLIP, _FLIP_SECONDS = np.radians(45.0), 0.1  # rotation of a jump in one frame; longest stretch between two jumps
_EVEN = 0.05  # metres per radian: how strongly joints without a marker between them should turn alike
_LEANING = 0.02  # metres per radian: pull of a joint with occluded markers to its poses before and after
_LEAST_STIFFNESS = 1e-3  # metres per radian: keeps angles that no marker determines at rest
_NEAR = 2  # a joint is determined by its own markers and by those of so many joints below it


def missing(chain: Chain, there: np.ndarray) -> np.ndarray:
    """Find the joints with occluded markers that the recording shows elsewhere.

    These joints follow the poses before and after, not the rest pose.

    Args:
        chain: the chain.
        visible: (T, M) bool, visible markers.
    Returns:
        (T, J) bool.
    """
    usual = there.any(axis=0)
    out = np.zeros((len(there), len(chain.skeleton)), dtype=bool)
    for marker, joint in enumerate(chain.joint):
        hidden = usual[marker] & ~there[:, marker]
        for _ in range(_NEAR + 1):
            if joint <= 0:
                break
            out[:, joint] |= hidden
            joint = chain.skeleton.parents[joint]
    return out


def between(chain: Chain, solved: Poses, known: np.ndarray, told: np.ndarray,
            frames: np.ndarray) -> tuple[Poses, np.ndarray]:
    """Interpolate poses between solved frames, each joint between the frames that determine it.

    Before the first and after the last such frame, a joint stays as it is there.

    Args:
        chain: the chain.
        solved: poses of all T frames.
        known: (K,) the frames that are solved.
        determined: (K, J) bool, joints that are determined in them.
        frames: (N,) the frames to interpolate.
    Returns:
        N poses, and (J,) bool, joints that any frame determines.
    """
    places, (before, after, part) = solved.root[:, known].T, _around(known, frames)
    root = places[before] + part[:, None] * (places[after] - places[before])
    local = np.empty((len(frames), len(chain.skeleton), 4))
    some = told.any(axis=0)
    for joint in range(len(chain.skeleton)):
        use = known[told[:, joint]] if some[joint] else known
        turns, (before, after, part) = solved.local[joint][:, use].T, _around(use, frames)
        local[:, joint] = quaternion.slerp(turns[before], turns[after], part)
    return poses(chain, root, local), some


def _around(known: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find the known frames before and after each frame (indices), and its relative position between them (0 to 1)."""
    after = np.clip(np.searchsorted(known, frames), min(1, len(known) - 1), len(known) - 1)
    before = np.maximum(after - 1, 0)
    span = np.maximum(known[after] - known[before], 1)
    return before, after, np.clip((frames - known[before]) / span, 0.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class HeldBall:
    """A ball in the hand: its centre is fixed in the hand, and a recorded marker lies on its surface.

    Attributes:
        joint: name of the hand.
        centre: (3,) metres in its frame.
        radius: metres.
        seen: (T, 3) metres, the marker, NaN where not visible.
        held: (T,) bool, frames in which the ball is held.
        weight: relative to a body marker.
    """

    joint: str
    centre: np.ndarray
    radius: float
    seen: np.ndarray
    held: np.ndarray
    weight: float = 1.0


@dataclass(frozen=True)
class PoseSettings:
    """Options of the pose solver.

    Attributes:
        weights: give markers of deformed clusters less weight (eq. 5.2).
        limits: keep joints within their limits.
        smoothness: seconds, see `smooth_poses`; 0 solves each frame separately.
        ball: a held ball that takes part, or None.
    """

    weights: bool = True
    limits: bool = True
    smoothness: float = 0.0
    ball: HeldBall | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class Solved:
    """The solved poses of T frames, for the model's M markers and J joints.

    Attributes:
        motion: the moving skeleton.
        residual: (T, M) metres between the model's marker and the recorded one, NaN where not visible.
        weights: (T, M).
        single: (T, M) metres, the same with each segment fitted to its own markers alone, NaN with fewer than three.
        iterations: (T,) number of steps, 0 where a frame was not solved.
        at_limit: (T, J) bool.
        seconds: computing time.
        notes: messages for people.
    """

    motion: Motion
    residual: np.ndarray
    weights: np.ndarray
    single: np.ndarray
    iterations: np.ndarray
    at_limit: np.ndarray
    seconds: float
    notes: tuple[str, ...] = ()


def solve(model, trial, settings: PoseSettings = PoseSettings(), progress=None, cancelled=None) -> Solved:
    """Solve the model's poses for a trial's markers.

    Args:
        model: a `MarkerModel`.
        trial: a `MarkerTrial` with its labels.
        settings: the options.
        progress: called with the share that is done and a text.
        cancelled: returns True when the user stops the job.
    Returns:
        The motion with residuals and weights.
    Raises:
        InputError: if the trial contains hardly any of the model's markers.
        Cancelled: if the user stops the job.
    """
    began = time.perf_counter()
    seen = _positions(model, trial)
    solving = _Solving(_chain(model, settings.limits), seen, settings, fps=trial.fps, usual=model.edge_sigma,
                       progress=progress, cancelled=cancelled)
    solving.run()
    return solving.result(time.perf_counter() - began)


def _chain(model, limited: bool) -> Chain:
    """Build the chain of a model, with or without joint limits."""
    freedom = model.freedom
    made = chain(model.skeleton, model.joint, model.places, order=freedom.order, free=freedom.free, low=freedom.low,
                 high=freedom.high, stiffness=model.stiffness)
    return made if limited else made.without_limits()


def _positions(model, trial) -> np.ndarray:
    """Return the model's markers as recorded, (T, M, 3) metres; raise InputError if there are fewer than four."""
    out = seen_markers(model, trial)
    seen = int(np.isfinite(out).any(axis=(0, 2)).sum())
    if seen < _FEWEST:
        raise InputError(trial.name, f"{seen} of the model's {len(model.markers)} markers", f"at least {_FEWEST}",
                         "choose the model or marker set of this recording")
    return out


class _Solving:
    """One run of the solver: the arrays (frames last) and the solutions so far."""

    def __init__(self, chain, seen, settings, fps, usual, progress, cancelled):
        self.chain, self.settings, self.fps = chain, settings, fps
        self.positions = seen
        self.there = np.isfinite(seen).all(axis=-1)
        self.weights = self.there.astype(float)
        if settings.weights:
            self.weights = marker_weights(chain.joint, chain.places, seen, usual)
        self.seen = np.ascontiguousarray(np.where(self.there[..., None], seen, 0.0).transpose(1, 2, 0))
        self.progress, self.cancelled = progress or (lambda part, text: None), cancelled or (lambda: False)
        count = len(chain.skeleton)
        self.poses = Poses(np.zeros((3, len(seen))), np.zeros((count, 4, len(seen))), np.zeros((count, 3, len(seen))))
        self.poses.local[:, 0] = 1.0
        self.cost, self.steps = np.full(len(seen), np.inf), np.zeros(len(seen), dtype=int)
        self.held = np.zeros((count, len(seen)), dtype=bool)
        self.drawn = np.maximum(chain.stiffness, _LEAST_STIFFNESS)
        self.drawn[0] = 0.0
        self.missing = missing(chain, self.there)
        self.notes: list[str] = []
        self.work_done, self.work = 0, 1
        self.alone = 0.5 if settings.smoothness > 0.0 else 1.0  # share of the progress before all frames are smoothed

    def run(self) -> None:
        """Solve the frames that show enough markers, and interpolate the others."""
        ever = self.there.any(axis=0).sum()
        known = np.flatnonzero(self.there.sum(axis=1) >= max(_FEWEST, int(np.ceil(_ENOUGH * ever))))
        if not len(known):
            raise InputError("trial", "no frame shows enough markers", f"{_ENOUGH:.0%} of {ever}", "clean it first")
        # frames solved first: every sixtieth of a second, and the last one
        spacing = max(1, int(round(self.fps * _COARSE_SECONDS)))
        coarse = np.unique(np.append(known[::spacing], known[-1]))
        self.work = len(known)
        start = first_poses(self.chain, self.seen[..., coarse], self.weights[coarse].T)
        for part in self._chunks(coarse):
            self._keep(coarse[part], descend(self._task(coarse[part]), start.frames(part)))
        # retry doubtful frames from the neighbour before, then from the neighbour after
        for source, frames in ((coarse[:-1], coarse[1:]), (coarse[1:], coarse[:-1])):
            doubtful = self._doubtful(frames, source)
            self._better_from(source[doubtful], frames[doubtful])
        unsure = np.flatnonzero(self.missing[coarse].any(axis=1))
        if len(unsure):
            self._solve_between(coarse[unsure], coarse)
        # then all frames between, from both solved neighbours
        others = np.setdiff1d(known, coarse)
        if len(others):
            self._solve_between(others, coarse)
        self._unflip(known)
        self._fill(known)
        if self.settings.smoothness > 0.0:
            self._smooth()

    def _unflip(self, known: np.ndarray) -> None:
        """Solve short stretches again that jump away and back, from the frames around them.

        A straight elbow, for example, can be rotated in two ways. The new solution is kept if it costs about as little.
        """
        local = self.poses.local[..., known]
        near = np.abs(np.einsum("jaf,jaf->jf", local[..., 1:], local[..., :-1]))
        # |dot product| of quaternions is the cosine of half the rotation between two frames
        jumps = np.flatnonzero(np.any(near < np.cos(0.5 * _FLIP), axis=0))
        suspect = np.zeros(len(known), dtype=bool)
        for first, last in zip(jumps[:-1], jumps[1:]):
            if known[last] - known[first] <= _FLIP_SECONDS * self.fps:
                suspect[first + 1 : last + 1] = True
        if not suspect.any() or suspect.all():
            return
        frames, around = known[suspect], known[~suspect]
        every = np.ones((len(around), len(self.chain.skeleton)), dtype=bool)
        start = between(self.chain, self.poses, around, every, frames)[0]
        leaning = np.full((len(self.chain.skeleton), len(frames)), _LEANING)
        leaning[0] = 0.0
        for part in self._chunks(frames):
            here = frames[part]
            task = self._task(here, start.frames(part), leaning[:, part])
            self._accept(here, descend(task, start.frames(part)), 1.5, 1e-5)

    def _smooth(self) -> None:
        """Smooth all frames together."""
        def watch(part):
            if self.cancelled():
                raise Cancelled("reconstruction cancelled")
            self.progress(self.alone + (1.0 - self.alone) * part, "smoothing poses")

        everything = np.arange(len(self.cost))
        at, self.held = smooth(self._task(everything), self.poses, self.settings.smoothness, self.fps, watch)
        self.poses.put(everything, at)

    def _solve_between(self, frames: np.ndarray, known: np.ndarray) -> None:
        """Solve frames from interpolated neighbours; joints with occluded markers are pulled to the interpolation."""
        start, some = between(self.chain, self.poses, known, ~self.missing[known], frames)
        leaning = np.where(self.missing[frames].T & some[:, None], _LEANING, 0.0)
        for part in self._chunks(frames):
            here = frames[part]
            lean = start.frames(part) if leaning[:, part].any() else None
            self._keep(here, descend(self._task(here, lean, leaning[:, part]), start.frames(part)))

    def _task(self, frames: np.ndarray, lean: Poses | None = None, leaning: np.ndarray | None = None) -> Task:
        """Build the task of these frames."""
        point, ball = None, self.settings.ball
        if ball is not None:
            there = np.isfinite(ball.seen).all(axis=-1) & ball.held
            point = HeldPoint(joint=self.chain.skeleton.index(ball.joint), place=np.asarray(ball.centre, dtype=float),
                              radius=ball.radius, seen=np.where(there[:, None], ball.seen, 0.0)[frames].T,
                              weight=ball.weight * there[frames])
        return Task(chain=self.chain, seen=self.seen[..., frames], weights=self.weights[frames].T, drawn=self.drawn,
                    lean=lean, leaning=leaning, point=point, even=_EVEN)

    def _chunks(self, frames: np.ndarray):
        """Iterate over slices of a list of frames; report progress and check for cancellation between them."""
        for first in range(0, len(frames), _CHUNK):
            if self.cancelled():
                raise Cancelled("reconstruction cancelled")
            self.progress(self.alone * min(self.work_done / self.work, 1.0), "solving poses")
            yield slice(first, first + _CHUNK)
            self.work_done += min(_CHUNK, len(frames) - first)

    def _keep(self, frames: np.ndarray, arrived) -> None:
        self.poses.put(frames, arrived.poses)
        self.cost[frames], self.steps[frames] = arrived.cost, arrived.steps
        self.held[:, frames] = arrived.held

    def _doubtful(self, frames: np.ndarray, source: np.ndarray) -> np.ndarray:
        """Find frames that may have reached another local minimum than their neighbours: higher cost, or large
        rotations.
        """
        turned = np.abs(np.einsum("jaf,jaf->jf", self.poses.local[..., frames], self.poses.local[..., source]))
        dear = self.cost[frames] > _DEAR * self.cost[source] + 1e-6
        return np.flatnonzero(dear | np.any(turned < np.cos(0.5 * _FAR), axis=0))

    def _better_from(self, source: np.ndarray, frames: np.ndarray) -> None:
        """Solve frames again from other frames' solutions, and keep those that cost clearly less."""
        for part in self._chunks(frames):
            arrived = descend(self._task(frames[part]), self.poses.frames(source[part]))
            self._accept(frames[part], arrived, 0.999, -1e-9)

    def _accept(self, frames: np.ndarray, arrived, share: float, more: float) -> None:
        """Store solutions that cost less than this share of the present cost, plus `margin`."""
        better = arrived.cost < share * self.cost[frames] + more
        if better.any():
            chosen = frames[better]
            self.poses.put(chosen, arrived.poses.frames(better))
            self.cost[chosen], self.held[:, chosen] = arrived.cost[better], arrived.held[:, better]
        self.steps[frames] += arrived.steps

    def _fill(self, known: np.ndarray) -> None:
        """Interpolate the frames with too few markers."""
        blind = np.setdiff1d(np.arange(len(self.cost)), known)
        if len(blind):
            told = np.ones((len(known), len(self.chain.skeleton)), dtype=bool)
            self.poses.put(blind, between(self.chain, self.poses, known, told, blind)[0])
            self.notes.append(f"{len(blind)} of {len(self.cost)} frames show too few markers and are interpolated")

    def result(self, seconds: float) -> Solved:
        """Return the solution of all frames."""
        motion = Motion(self.chain.skeleton, self.poses.root.T, np.moveaxis(self.poses.local, -1, 0), self.fps)
        put = place(self.chain, self.poses)
        away = (put.markers + put.origin).transpose(2, 0, 1) - self.positions
        residual = np.sqrt(np.sum(away**2, axis=-1))
        return Solved(motion=motion, residual=residual, weights=self.weights,
                      single=single_residual(self.chain, self.positions), iterations=self.steps,
                      at_limit=self.held.T.copy(), seconds=seconds, notes=tuple(self.notes))


def single_residual(chain: Chain, seen: np.ndarray) -> np.ndarray:
    """Measure residuals when every segment is fitted to its own markers alone (section 3.4.2).

    Args:
        chain: the chain.
        seen: (T, M, 3) metres, NaN where not visible.
    Returns:
        (T, M) metres; NaN where the segment has fewer than three visible markers.
    """
    out = np.full(seen.shape[:2], np.nan)
    for joint in np.unique(chain.joint):
        own = np.flatnonzero(chain.joint == joint)
        enough = np.isfinite(seen[:, own]).all(axis=-1).sum(axis=1) > 2
        if enough.any():
            fit = rigid_fit(chain.places[own], seen[np.ix_(enough, own)])
            away = carried(fit, chain.places[own]) - seen[np.ix_(enough, own)]
            out[np.ix_(enough, own)] = np.sqrt(np.sum(away**2, axis=-1))
    return out
