"""Descend from an initial pose to the nearest one whose markers fit best: many frames at once, each independent.

Levenberg-Marquardt on the weighted squares of eq. 5.1 (Fredriksson section 5.3.2), with the exact derivative of all
markers (`chain`), steps solved from the tips to the root (`elimination`) and exact joint limits (`limits`). The paper
used a general solver (SLSQP, section 5.3.4), which needed seconds per frame.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from . import elimination, limits
from .chain import (
    CONJUGATE,
    Chain,
    Poses,
    WorldPoses,
    apply_step,
    compute_step_axes,
    compute_world_poses,
    cross,
    multiply,
    to_rotation_vectors,
)

_MAX_STEPS = 24  # steps at most
_CURVED_GAIN = 0.1  # a step that gains a smaller share of the cost is near enough for second derivatives to help
_CONVERGED_STEP = 1e-5  # radians (and metres): a frame with a smaller step has converged
_NO_GAIN = 1e-7  # as has one whose cost falls by a smaller share
_MAX_TRUSTED_DAMPING = 1e-3  # m2: with more damping a small step is no sign of convergence
_INITIAL_DAMPING, _MIN_DAMPING, _MAX_DAMPING = 1e-5, 1e-9, 1e3  # m2


@dataclass(frozen=True, eq=False, kw_only=True)
class HeldPoint:
    """A point of a joint's body that keeps a given distance from a recorded point.

    An example is a ball's centre in the hand, at its radius from a marker on the ball.

    Attributes:
        joint: index of the joint.
        place: (3,) metres in its frame.
        radius: metres.
        seen: (3, F) metres, the recorded point.
        weight: (F,), 0 where it has no effect.
    """

    joint: int
    place: np.ndarray
    radius: float
    seen: np.ndarray
    weight: np.ndarray

    def select_frames(self, chosen) -> "HeldPoint":
        """Return the point for these frames only."""
        return replace(self, seen=self.seen[:, chosen], weight=self.weight[chosen])


@dataclass(frozen=True, eq=False, kw_only=True)
class PoseTask:
    """What F poses should fit.

    Attributes:
        chain: the chain.
        seen: (M, 3, F) metres, any numbers where the weight is 0.
        weights: (M, F).
        stiffness: (J, 3) metres per radian, pull of each joint to its rest pose (replaces the chain's stiffness).
        target_poses: poses to which joints are pulled in addition, or None.
        target_strength: (J, F) metres per radian, strength of that pull.
        point: a held point, or None.
        run_stiffness: metres per radian, how strongly the joints of a run (`Chain.runs`) should turn alike.
    """

    chain: Chain
    seen: np.ndarray
    weights: np.ndarray
    stiffness: np.ndarray
    target_poses: Poses | None = None
    target_strength: np.ndarray | None = None
    point: HeldPoint | None = None
    run_stiffness: float = 0.0

    def select_frames(self, chosen) -> "PoseTask":
        """Return the task for these frames only."""
        return replace(self, seen=self.seen[..., chosen], weights=self.weights[:, chosen],
                       target_poses=self.target_poses and self.target_poses.select_frames(chosen), point=self.point
                       and self.point.select_frames(chosen), target_strength=None if self.target_strength is None
                       else self.target_strength[:, chosen])


@dataclass(frozen=True, eq=False)
class DescentResult:
    """The result of a descent.

    Attributes:
        poses: F poses.
        cost: (F,) m2, half the weighted squares.
        steps: (F,) number of steps.
        held: (J, F) bool, joints that are at a limit against the markers.
    """

    poses: Poses
    cost: np.ndarray
    steps: np.ndarray
    held: np.ndarray


@dataclass(eq=False)
class State:
    """The best known poses with everything computed from them.

    Attributes:
        poses: F poses.
        placed: joints and markers in the world.
        away: (M, 3, F) metres, model minus recorded markers.
        bend: (J, 3, F) radians from rest.
        uneven: (joints of runs, 2, 3, F) radians, see `_measure_unevenness`.
        from_target: (J, 3, F) radians from the target poses; empty without them.
        cost: (F,) m2.
    """

    poses: Poses
    placed: WorldPoses
    away: np.ndarray
    bend: np.ndarray
    uneven: np.ndarray
    from_target: np.ndarray
    cost: np.ndarray

    def take_frames(self, other: "State", where: np.ndarray) -> None:
        """Take the other state's frames where (F,) is true, in place."""
        for own, others in zip(self._list_arrays(), other._list_arrays()):
            np.copyto(own, others, where=where)

    def select_frames(self, chosen) -> "State":
        """Return the state for these frames only."""
        at, put = self.poses.select_frames(chosen), self.placed
        placed = WorldPoses(at.root, *(a[..., chosen] for a in (put.world, put.joints, put.markers)))
        more = (a[..., chosen] for a in (self.away, self.bend, self.uneven, self.from_target, self.cost))
        return State(at, placed, *more)

    def _list_arrays(self):
        at, put = self.poses, self.placed
        placed = at.root, at.local, at.angles, put.world, put.joints, put.markers
        return *placed, self.away, self.bend, self.uneven, self.from_target, self.cost


def descend(task: PoseTask, start: Poses) -> DescentResult:
    """Find the poses nearest to the recorded markers, downhill from the initial poses.

    Args:
        task: what to fit, F frames.
        start: F initial poses.
    Returns:
        Poses, costs, steps and held joints.
    """
    total = start.root.shape[-1]
    limited_joints = limits.find_limited_joints(task.chain)
    best = compute_state(task, limits.apply_limits(task.chain, limited_joints, start)[0])
    none = np.zeros((len(task.chain.skeleton), total), dtype=bool)
    out = DescentResult(best.poses.copy_arrays(), best.cost.copy(), np.zeros(total, dtype=int), none)
    active, done = np.arange(total), np.zeros(total, dtype=bool)
    damping, curved = np.full(total, _INITIAL_DAMPING), np.zeros(total, dtype=bool)
    for _ in range(_MAX_STEPS):
        size, held, trial = _take_step(task, best, limited_joints, damping, curved)
        better = trial.cost <= best.cost * (1.0 + 1e-12) + 1e-18
        gain = best.cost - trial.cost
        arrived = (size < _CONVERGED_STEP) | (gain <= _NO_GAIN * best.cost)
        done |= better & arrived & (damping < _MAX_TRUSTED_DAMPING) | (damping > _MAX_DAMPING)
        best.take_frames(trial, better)
        # a rejected step is repeated with ten times the damping; after a curved one first without second derivatives
        raised_damping = np.where(curved, damping, np.maximum(10.0 * damping, _INITIAL_DAMPING))
        damping = np.where(better, np.maximum(0.1 * damping, _MIN_DAMPING), raised_damping)
        curved = better & (gain < _CURVED_GAIN * (best.cost + gain))
        out.steps[active] += 1
        # drop converged frames once they are a fifth, so that copies stay rare
        if done.any() and (done.all() or done.mean() > 0.2):
            _store_frames(out, active[done], best.select_frames(done), held[:, done])
            if done.all():
                return out
            task, best = task.select_frames(~done), best.select_frames(~done)
            active, damping, held, curved = active[~done], damping[~done], held[:, ~done], curved[~done]
            done = done[~done]
    _store_frames(out, active, best, held)
    return out


def _store_frames(out: DescentResult, frames: np.ndarray, state: State, held: np.ndarray) -> None:
    """Store finished frames in the result."""
    out.poses.overwrite_frames(frames, state.poses)
    out.cost[frames], out.held[:, frames] = state.cost, held


def compute_state(task: PoseTask, poses: Poses) -> State:
    """Compute everything that follows from poses, and their cost."""
    placed = compute_world_poses(task.chain, poses)
    away = placed.markers + (poses.root - task.seen)
    bend, uneven, from_target = _measure_bend(task.chain, poses), _measure_unevenness(task,
            poses), _measure_from_target(task, poses)
    cost = np.einsum("mf,maf,maf->f", task.weights, away, away)
    cost += np.einsum("ja,jaf,jaf->f", task.stiffness**2, bend, bend)
    cost += task.run_stiffness**2 * np.einsum("jaf,jaf->f", uneven[:, 0], uneven[:, 0])
    if task.target_poses is not None:
        cost += np.einsum("jf,jaf,jaf->f", task.target_strength**2, from_target, from_target)
    if task.point:
        cost += task.point.weight * measure_distance(task.point, placed)[2] ** 2
    return State(poses, placed, away, bend=bend, uneven=uneven, from_target=from_target, cost=0.5 * cost)


def _measure_bend(chain: Chain, poses: Poses) -> np.ndarray:
    """Measure how far (J, 3, F) radians each joint is rotated from rest: as a rotation vector, a hinge as angles."""
    bend = to_rotation_vectors(poses.local)
    for joint in chain.hinges:
        bend[joint] = poses.angles[joint]
    return bend


def _measure_from_target(task: PoseTask, poses: Poses) -> np.ndarray:
    """Measure how far (J, 3, F) radians each joint is rotated from its target pose, in the same form; empty without
    one.
    """
    if task.target_poses is None:
        return np.zeros((0, 3, poses.root.shape[-1]))
    from_target = to_rotation_vectors(multiply(poses.local, task.target_poses.local * CONJUGATE))
    for joint in task.chain.hinges:
        from_target[joint] = poses.angles[joint] - task.target_poses.angles[joint]
    return from_target


def _measure_unevenness(task: PoseTask, poses: Poses) -> np.ndarray:
    """Measure how far the joints of runs deviate from their run's mean rotation.

    For each joint: the difference of its rotation vector from the run's mean, and the derivative of half its square by
    the joint's rotations, (joints, 2, 3, F) radians. The derivative of the mean adds nothing, since the differences sum
    to zero.
    """
    out = []
    for run in task.chain.runs:
        vectors = to_rotation_vectors(poses.local[list(run)])
        for vector, gap in zip(vectors, vectors - vectors.mean(axis=0)):
            out.append(np.stack([gap, to_rotation_slope(vector, gap)]))
    return np.array(out) if out else np.zeros((0, 2, 3, poses.root.shape[-1]))


def to_rotation_slope(vector: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Convert a slope by a rotation vector to a slope by small rotations applied after it.

    Args:
        vector: (3, F) radians, the joint's rotation vector.
        slope: (3, F), derivative by it.
    Returns:
        (3, F), the derivative by small rotations.
    """
    angle = np.sqrt(np.einsum("af,af->f", vector, vector))
    near = np.maximum(angle, 1e-3)
    # coefficient of the inverse left Jacobian of SO(3), by its limit 1/12 near 0
    factor = np.where(angle > 1e-3, 1.0 / near**2 - 0.5 / (near * np.tan(0.5 * near)), 1.0 / 12.0)
    once = cross(vector, slope)
    return slope + 0.5 * once + factor * cross(vector, once)


def measure_distance(point: HeldPoint, placed: WorldPoses) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Measure the distance of the held point from the recorded point.

    Args:
        point: the held point.
        placed: joints in the world.
    Returns:
        The held point (3, F) relative to the root, the unit direction (3, F) from the recorded point to it, and by how
        much it is too far (F,) metres.
    """
    x = placed.joints[point.joint] + np.einsum("abf,b->af", placed.world[point.joint], point.place)
    gap = x + placed.origin - point.seen
    length = np.sqrt(np.einsum("af,af->f", gap, gap))
    return x, gap / np.maximum(length, 1e-9), length - point.radius


def compute_cross_weight(away: np.ndarray, radius: float) -> np.ndarray:
    """Compute the weight across a distance, as a share of the weight along it (like a rope under tension).

    Args:
        away: (F,) metres by which the distance is too long.
        radius: metres.
    Returns:
        (F,) shares, 0 to 1.
    """
    return np.maximum(away, 0.0) / np.maximum(away + radius, 1e-9)


def _take_step(task: PoseTask, best: State, limited_joints: dict, damping: np.ndarray,
               curved: np.ndarray) -> tuple[np.ndarray, np.ndarray, State]:
    """Take one damped step, with second derivatives where `curved` (F,).

    Returns its size (F,), the joints held by limits (J, F), and the new state.
    """
    shift, turns, held = _solve_step(task, best, limited_joints, damping, curved)
    next_poses = limits.move_along_limits(task.chain, held, best.poses, turns,
                                          apply_step(task.chain, best.poses, shift, turns))
    next_poses, ahead = limits.apply_limits(task.chain, limited_joints, next_poses)
    for joint in task.chain.hinges:
        ahead[joint] = best.poses.angles[joint] + turns[joint]
    outside = (ahead > task.chain.high[..., None]) | (ahead < task.chain.low[..., None])
    # frames whose step exceeds a limit are solved again so that the step ends at the limit
    exceeding = np.flatnonzero(outside.any(axis=(0, 1)))
    if len(exceeding):
        part = best.select_frames(exceeding)
        solution = _solve_step(task.select_frames(exceeding), part, limited_joints, damping=damping[exceeding],
                               curved=curved[exceeding], ahead=ahead[..., exceeding])
        shift[:, exceeding], turns[..., exceeding], held[:, exceeding] = solution
        corrected = limits.move_along_limits(task.chain, solution[2], part.poses, solution[1],
                                             apply_step(task.chain, part.poses, *solution[:2]))
        next_poses.overwrite_frames(exceeding, limits.apply_limits(task.chain, limited_joints, corrected)[0])
    size = np.maximum(np.abs(turns).max(axis=(0, 1)), np.abs(shift).max(axis=0))
    return size, held, compute_state(task, next_poses)


def _solve_step(task: PoseTask, best: State, limited_joints: dict, damping: np.ndarray, curved: np.ndarray, ahead=None):
    """Solve a step: the root's shift (3, F), all rotations (J, 3, F), and the joints held by limits (J, F).

    `ahead` is as in `limits.hold_at_limits`.
    """
    step_axes = compute_step_axes(task.chain, best.poses, best.placed)
    body_terms = elimination.build_body_terms(task.chain, best.placed, best.away, task.weights)
    if task.point:
        x, along, far = measure_distance(task.point, best.placed)
        across = task.point.weight * compute_cross_weight(far, task.point.radius)
        elimination.add_distance_terms(body_terms, task.point.joint, x, along=along, weight=task.point.weight, away=far,
                                       across=across)
    joint_terms = build_joint_terms(task, best)
    slope = elimination.compute_gradient(task.chain, best.placed, step_axes, body_terms, joint_terms)
    held = limits.hold_at_limits(task.chain, limited_joints, best.poses, slope=slope, joint_terms=joint_terms,
                                 next_angles=ahead)
    second_derivatives = None
    if curved.any():
        second_derivatives = elimination.compute_second_derivatives(task.chain, best.placed, step_axes, away=best.away,
                                                                    weights=task.weights, share=curved)
    return *elimination.solve_step(task.chain, best.placed, step_axes, body_terms=body_terms, joint_terms=joint_terms,
                                   damping=damping, second_derivatives=second_derivatives), held


def build_joint_terms(task: PoseTask, best: State) -> elimination.JointTerms:
    """Build the terms of each joint's own rotations: pulls to rest, to even runs and to target poses.

    The derivative of half the squared length of a rotation vector by a small rotation is the vector itself.
    """
    strength = task.stiffness**2
    curvature = np.zeros((len(strength), 3, 3, best.cost.shape[-1]))
    pull = strength[..., None] * best.bend
    fixed = ~task.chain.free
    run_joints = [joint for run in task.chain.runs for joint in run]
    pull[run_joints] += task.run_stiffness**2 * best.uneven[:, 1]
    if task.target_poses is not None:
        pull += task.target_strength[:, None] ** 2 * best.from_target
    for axis in range(3):
        curvature[:, axis, axis] = strength[:, axis, None] + (0.0 if task.target_poses is None
                                                              else task.target_strength**2)
        curvature[run_joints, axis, axis] += task.run_stiffness**2
    pull[fixed] = 0.0
    return elimination.JointTerms(curvature, pull)
