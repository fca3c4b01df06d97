"""Solve the pose of every frame: the whole chain is fitted to all markers at once (Fredriksson sections 3.5.1 and 5.3).

Every frame starts from a solved neighbour (section 5.3.3). Some frames are solved first, from their own markers and
again from their solved neighbours, and the better solution is kept; then those between, from both neighbours.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError, UserCancelledError
from ...motion import quaternion
from ...motion.motion import Motion
from ..rigid_fit import fit_rigid
from ..rigid_fit import place_points as carried
from .chain import Chain, Poses, build_chain, build_poses, compute_world_poses
from .descent import HeldPoint, PoseTask, descend
from .residuals import collect_markers, compute_marker_weights
from .smooth import smooth_poses
from .start import estimate_initial_poses

_CHUNK = 512  # frames solved together
_COARSE_SECONDS = 1.0 / 60.0  # spacing of the frames that are solved first
_MIN_MARKER_SHARE = 0.3  # share of the markers that a frame must show to be solved
_MIN_MARKERS = 4  # markers that it must show at least
_DOUBTFUL_COST, _DOUBTFUL_ROTATION = 1.5, np.radians(
    40.0)  # a solution is doubtful at so many times its neighbour's cost, or rotation
_FLIP, _FLIP_SECONDS = np.radians(45.0), 0.1  # rotation of a jump in one frame; longest stretch between two jumps
_RUN_STIFFNESS = 0.05  # metres per radian: how strongly joints without a marker between them should turn alike
_TARGET_STRENGTH = 0.02  # metres per radian: pull of a joint with occluded markers to its poses before and after
_MIN_STIFFNESS = 1e-3  # metres per radian: keeps angles that no marker determines at rest
_JOINTS_BELOW = 2  # a joint is determined by its own markers and by those of so many joints below it


def find_occluded_joints(chain: Chain, visible: np.ndarray) -> np.ndarray:
    """Find the joints with occluded markers that the recording shows elsewhere.

    These joints follow the poses before and after, not the rest pose.

    Args:
        chain: the chain.
        visible: (T, M) bool, visible markers.
    Returns:
        (T, J) bool.
    """
    ever_visible = visible.any(axis=0)
    out = np.zeros((len(visible), len(chain.skeleton)), dtype=bool)
    for marker, joint in enumerate(chain.joint):
        hidden = ever_visible[marker] & ~visible[:, marker]
        for _ in range(_JOINTS_BELOW + 1):
            if joint <= 0:
                break
            out[:, joint] |= hidden
            joint = chain.skeleton.parents[joint]
    return out


def interpolate_poses(chain: Chain, solved: Poses, known: np.ndarray, determined: np.ndarray,
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
    places, (before, after, share) = solved.root[:, known].T, _find_neighbours(known, frames)
    root = places[before] + share[:, None] * (places[after] - places[before])
    local = np.empty((len(frames), len(chain.skeleton), 4))
    is_determined = determined.any(axis=0)
    for joint in range(len(chain.skeleton)):
        use = known[determined[:, joint]] if is_determined[joint] else known
        rotations, (before, after, share) = solved.local[joint][:, use].T, _find_neighbours(use, frames)
        local[:, joint] = quaternion.slerp(rotations[before], rotations[after], share)
    return build_poses(chain, root, local), is_determined


def _find_neighbours(known: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
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
class PoseSolution:
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


def solve_poses(model, trial, settings: PoseSettings = PoseSettings(), progress=None, cancelled=None) -> PoseSolution:
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
        UserCancelledError: if the user stops the job.
    """
    began = time.perf_counter()
    seen = _collect_positions(model, trial)
    solver = _PoseSolver(_build_chain(model, settings.limits), seen, settings, fps=trial.fps, usual=model.edge_sigma,
                         progress=progress, cancelled=cancelled)
    solver.solve_frames()
    return solver.build_solution(time.perf_counter() - began)


def _build_chain(model, has_limits: bool) -> Chain:
    """Build the chain of a model, with or without joint limits."""
    freedom = model.freedom
    limited_chain = build_chain(model.skeleton, model.joint, model.places, order=freedom.order, free=freedom.free,
                                low=freedom.low, high=freedom.high, stiffness=model.stiffness)
    return limited_chain if has_limits else limited_chain.remove_limits()


def _collect_positions(model, trial) -> np.ndarray:
    """Return the model's markers as recorded, (T, M, 3) metres; raise InputError if there are fewer than four."""
    out = collect_markers(model, trial)
    seen = int(np.isfinite(out).any(axis=(0, 2)).sum())
    if seen < _MIN_MARKERS:
        raise InputError(trial.name, f"{seen} of the model's {len(model.markers)} markers", f"at least {_MIN_MARKERS}",
                         "choose the model or marker set of this recording")
    return out


class _PoseSolver:
    """One run of the solver: the arrays (frames last) and the solutions so far."""

    def __init__(self, chain, seen, settings, fps, usual, progress, cancelled):
        self.chain, self.settings, self.fps = chain, settings, fps
        self.positions = seen
        self.visible = np.isfinite(seen).all(axis=-1)
        self.weights = self.visible.astype(float)
        if settings.weights:
            self.weights = compute_marker_weights(chain.joint, chain.places, seen, usual)
        self.seen = np.ascontiguousarray(np.where(self.visible[..., None], seen, 0.0).transpose(1, 2, 0))
        self.progress, self.cancelled = progress or (lambda part, text: None), cancelled or (lambda: False)
        count = len(chain.skeleton)
        self.poses = Poses(np.zeros((3, len(seen))), np.zeros((count, 4, len(seen))), np.zeros((count, 3, len(seen))))
        self.poses.local[:, 0] = 1.0
        self.cost, self.steps = np.full(len(seen), np.inf), np.zeros(len(seen), dtype=int)
        self.held = np.zeros((count, len(seen)), dtype=bool)
        self.stiffness = np.maximum(chain.stiffness, _MIN_STIFFNESS)
        self.stiffness[0] = 0.0
        self.occluded = find_occluded_joints(chain, self.visible)
        self.notes: list[str] = []
        self.work_done, self.total_work = 0, 1
        # share of the progress before all frames are smoothed
        self.frame_share = 0.5 if settings.smoothness > 0.0 else 1.0

    def solve_frames(self) -> None:
        """Solve the frames that show enough markers, and interpolate the others."""
        marker_count = self.visible.any(axis=0).sum()
        known = np.flatnonzero(self.visible.sum(axis=1)
                               >= max(_MIN_MARKERS, int(np.ceil(_MIN_MARKER_SHARE * marker_count))))
        if not len(known):
            raise InputError("trial", "no frame shows enough markers", f"{_MIN_MARKER_SHARE:.0%} of {marker_count}",
                             "clean it first")
        # frames solved first: every sixtieth of a second, and the last one
        spacing = max(1, int(round(self.fps * _COARSE_SECONDS)))
        coarse = np.unique(np.append(known[::spacing], known[-1]))
        self.total_work = len(known)
        start = estimate_initial_poses(self.chain, self.seen[..., coarse], self.weights[coarse].T)
        for part in self._iter_chunks(coarse):
            self._store_result(coarse[part], descend(self._build_task(coarse[part]), start.select_frames(part)))
        # retry doubtful frames from the neighbour before, then from the neighbour after
        for source, frames in ((coarse[:-1], coarse[1:]), (coarse[1:], coarse[:-1])):
            doubtful = self._find_doubtful(frames, source)
            self._retry_from(source[doubtful], frames[doubtful])
        occluded_frames = np.flatnonzero(self.occluded[coarse].any(axis=1))
        if len(occluded_frames):
            self._solve_between(coarse[occluded_frames], coarse)
        # then all frames between, from both solved neighbours
        others = np.setdiff1d(known, coarse)
        if len(others):
            self._solve_between(others, coarse)
        self._resolve_flips(known)
        self._fill_blind_frames(known)
        if self.settings.smoothness > 0.0:
            self._smooth_all()

    def _resolve_flips(self, known: np.ndarray) -> None:
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
        start = interpolate_poses(self.chain, self.poses, around, every, frames)[0]
        strength = np.full((len(self.chain.skeleton), len(frames)), _TARGET_STRENGTH)
        strength[0] = 0.0
        for part in self._iter_chunks(frames):
            here = frames[part]
            task = self._build_task(here, start.select_frames(part), strength[:, part])
            self._accept_better(here, descend(task, start.select_frames(part)), 1.5, 1e-5)

    def _smooth_all(self) -> None:
        """Smooth all frames together."""
        def watch(part):
            if self.cancelled():
                raise UserCancelledError("reconstruction cancelled")
            self.progress(self.frame_share + (1.0 - self.frame_share) * part, "smoothing poses")

        everything = np.arange(len(self.cost))
        at, self.held = smooth_poses(self._build_task(everything), self.poses, self.settings.smoothness, self.fps,
                                     watch)
        self.poses.overwrite_frames(everything, at)

    def _solve_between(self, frames: np.ndarray, known: np.ndarray) -> None:
        """Solve frames from interpolated neighbours; joints with occluded markers are pulled to the interpolation."""
        start, is_determined = interpolate_poses(self.chain, self.poses, known, ~self.occluded[known], frames)
        strength = np.where(self.occluded[frames].T & is_determined[:, None], _TARGET_STRENGTH, 0.0)
        for part in self._iter_chunks(frames):
            here = frames[part]
            target = start.select_frames(part) if strength[:, part].any() else None
            self._store_result(here, descend(self._build_task(here, target, strength[:, part]),
                                             start.select_frames(part)))

    def _build_task(self, frames: np.ndarray, target: Poses | None = None, strength: np.ndarray
                    | None = None) -> PoseTask:
        """Build the task of these frames."""
        point, ball = None, self.settings.ball
        if ball is not None:
            visible = np.isfinite(ball.seen).all(axis=-1) & ball.held
            point = HeldPoint(joint=self.chain.skeleton.index(ball.joint), place=np.asarray(ball.centre, dtype=float),
                              radius=ball.radius, seen=np.where(visible[:, None], ball.seen, 0.0)[frames].T,
                              weight=ball.weight * visible[frames])
        return PoseTask(chain=self.chain, seen=self.seen[..., frames], weights=self.weights[frames].T,
                        stiffness=self.stiffness, target_poses=target, target_strength=strength, point=point,
                        run_stiffness=_RUN_STIFFNESS)

    def _iter_chunks(self, frames: np.ndarray):
        """Iterate over slices of a list of frames; report progress and check for cancellation between them."""
        for first in range(0, len(frames), _CHUNK):
            if self.cancelled():
                raise UserCancelledError("reconstruction cancelled")
            self.progress(self.frame_share * min(self.work_done / self.total_work, 1.0), "solving poses")
            yield slice(first, first + _CHUNK)
            self.work_done += min(_CHUNK, len(frames) - first)

    def _store_result(self, frames: np.ndarray, result) -> None:
        self.poses.overwrite_frames(frames, result.poses)
        self.cost[frames], self.steps[frames] = result.cost, result.steps
        self.held[:, frames] = result.held

    def _find_doubtful(self, frames: np.ndarray, source: np.ndarray) -> np.ndarray:
        """Find frames that may have reached another local minimum than their neighbours: higher cost, or large
        rotations.
        """
        cosine = np.abs(np.einsum("jaf,jaf->jf", self.poses.local[..., frames], self.poses.local[..., source]))
        is_costly = self.cost[frames] > _DOUBTFUL_COST * self.cost[source] + 1e-6
        return np.flatnonzero(is_costly | np.any(cosine < np.cos(0.5 * _DOUBTFUL_ROTATION), axis=0))

    def _retry_from(self, source: np.ndarray, frames: np.ndarray) -> None:
        """Solve frames again from other frames' solutions, and keep those that cost clearly less."""
        for part in self._iter_chunks(frames):
            result = descend(self._build_task(frames[part]), self.poses.select_frames(source[part]))
            self._accept_better(frames[part], result, 0.999, -1e-9)

    def _accept_better(self, frames: np.ndarray, result, share: float, margin: float) -> None:
        """Store solutions that cost less than this share of the present cost, plus `margin`."""
        better = result.cost < share * self.cost[frames] + margin
        if better.any():
            chosen = frames[better]
            self.poses.overwrite_frames(chosen, result.poses.select_frames(better))
            self.cost[chosen], self.held[:, chosen] = result.cost[better], result.held[:, better]
        self.steps[frames] += result.steps

    def _fill_blind_frames(self, known: np.ndarray) -> None:
        """Interpolate the frames with too few markers."""
        blind = np.setdiff1d(np.arange(len(self.cost)), known)
        if len(blind):
            determined = np.ones((len(known), len(self.chain.skeleton)), dtype=bool)
            self.poses.overwrite_frames(blind, interpolate_poses(self.chain, self.poses, known, determined, blind)[0])
            self.notes.append(f"too few markers in {len(blind)} of {len(self.cost)} frames, which are interpolated")

    def build_solution(self, seconds: float) -> PoseSolution:
        """Return the solution of all frames."""
        motion = Motion(self.chain.skeleton, self.poses.root.T, np.moveaxis(self.poses.local, -1, 0), self.fps)
        world_poses = compute_world_poses(self.chain, self.poses)
        away = (world_poses.markers + world_poses.origin).transpose(2, 0, 1) - self.positions
        residual = np.sqrt(np.sum(away**2, axis=-1))
        return PoseSolution(motion=motion, residual=residual, weights=self.weights,
                            single=measure_single_residuals(self.chain, self.positions), iterations=self.steps,
                            at_limit=self.held.T.copy(), seconds=seconds, notes=tuple(self.notes))


def measure_single_residuals(chain: Chain, seen: np.ndarray) -> np.ndarray:
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
            fit = fit_rigid(chain.places[own], seen[np.ix_(enough, own)])
            away = carried(fit, chain.places[own]) - seen[np.ix_(enough, own)]
            out[np.ix_(enough, own)] = np.sqrt(np.sum(away**2, axis=-1))
    return out
