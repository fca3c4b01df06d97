"""Descend from an initial pose to the nearest one whose markers fit best: many frames at once, each independent.

Levenberg-Marquardt on the weighted squares of eq. 5.1 (Fredriksson section 5.3.2), with the exact derivative of all
markers (`chain`), steps solved from the tips to the root (`elimination`) and exact joint limits (`limits`). The paper
used a general solver (SLSQP, section 5.3.4), which needed seconds per frame.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from . import elimination, limits
from .chain import CONJUGATE, Chain, Placed, Poses, axes, cross, logarithm, moved, multiply, place

MOST_STEPS = 24  # steps at most
_NEAR = 0.1  # a step that gains a smaller share of the cost is near enough for second derivatives to help
_STILL = 1e-5  # radians (and metres): a frame with a smaller step has converged
_NO_GAIN = 1e-7  # as has one whose cost falls by a smaller share
_TRUSTED = 1e-3  # m2: with more damping a small step is no sign of convergence
_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-5, 1e-9, 1e3  # m2


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

    def frames(self, chosen) -> "HeldPoint":
        """Return the point for these frames only."""
        return replace(self, seen=self.seen[:, chosen], weight=self.weight[chosen])


@dataclass(frozen=True, eq=False, kw_only=True)
class Task:
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
    drawn: np.ndarray
    lean: Poses | None = None
    leaning: np.ndarray | None = None
    point: HeldPoint | None = None
    even: float = 0.0

    def frames(self, chosen) -> "Task":
        """Return the task for these frames only."""
        return replace(self, seen=self.seen[..., chosen], weights=self.weights[:, chosen],
                       lean=self.lean and self.lean.frames(chosen), point=self.point and self.point.frames(chosen),
                       leaning=None if self.leaning is None else self.leaning[:, chosen])


@dataclass(frozen=True, eq=False)
class Arrived:
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
    placed: Placed
    away: np.ndarray
    bend: np.ndarray
    uneven: np.ndarray
    gone: np.ndarray
    cost: np.ndarray

    def take(self, other: "State", where: np.ndarray) -> None:
        """Take the other state's frames where (F,) is true, in place."""
        for mine, its in zip(self._arrays(), other._arrays()):
            np.copyto(mine, its, where=where)

    def frames(self, chosen) -> "State":
        """Return the state for these frames only."""
        at, put = self.poses.frames(chosen), self.placed
        placed = Placed(at.root, *(a[..., chosen] for a in (put.world, put.joints, put.markers)))
        more = (a[..., chosen] for a in (self.away, self.bend, self.uneven, self.gone, self.cost))
        return State(at, placed, *more)

    def _arrays(self):
        at, put = self.poses, self.placed
        placed = at.root, at.local, at.angles, put.world, put.joints, put.markers
        return *placed, self.away, self.bend, self.uneven, self.gone, self.cost


def descend(task: Task, start: Poses, most_steps: int = MOST_STEPS) -> Arrived:
    """Find the poses nearest to the recorded markers, downhill from the initial poses.

    Args:
        task: what to fit, F frames.
        start: F initial poses.
        max_steps: steps at most.
    Returns:
        Poses, costs, steps and held joints.
    """
    total = start.root.shape[-1]
    stops = limits.limited(task.chain)
    best = state_of(task, limits.held_back(task.chain, stops, start)[0])
    none = np.zeros((len(task.chain.skeleton), total), dtype=bool)
    out = Arrived(best.poses.copy(), best.cost.copy(), np.zeros(total, dtype=int), none)
    live, done = np.arange(total), np.zeros(total, dtype=bool)
    damping, curved = np.full(total, _FIRST_DAMPING), np.zeros(total, dtype=bool)
    for _ in range(most_steps):
        size, held, trial = _step(task, best, stops, damping, curved)
        better = trial.cost <= best.cost * (1.0 + 1e-12) + 1e-18
        gain = best.cost - trial.cost
        arrived = (size < _STILL) | (gain <= _NO_GAIN * best.cost)
        done |= better & arrived & (damping < _TRUSTED) | (damping > _MOST_DAMPING)
        best.take(trial, better)
        # a rejected step is repeated with ten times the damping; after a curved one first without second derivatives
        harder = np.where(curved, damping, np.maximum(10.0 * damping, _FIRST_DAMPING))
        damping = np.where(better, np.maximum(0.1 * damping, _LEAST_DAMPING), harder)
        curved = better & (gain < _NEAR * (best.cost + gain))
        out.steps[live] += 1
        # drop converged frames once they are a fifth, so that copies stay rare
        if done.any() and (done.all() or done.mean() > 0.2):
            _write(out, live[done], best.frames(done), held[:, done])
            if done.all():
                return out
            task, best = task.frames(~done), best.frames(~done)
            live, damping, held, curved = live[~done], damping[~done], held[:, ~done], curved[~done]
            done = done[~done]
    _write(out, live, best, held)
    return out


def _write(out: Arrived, frames: np.ndarray, state: State, held: np.ndarray) -> None:
    """Store finished frames in the result."""
    out.poses.put(frames, state.poses)
    out.cost[frames], out.held[:, frames] = state.cost, held


def state_of(task: Task, at: Poses) -> State:
    """Compute everything that follows from poses, and their cost."""
    placed = place(task.chain, at)
    away = placed.markers + (at.root - task.seen)
    bend, uneven, gone = _bend(task.chain, at), _uneven(task, at), _gone(task, at)
    cost = np.einsum("mf,maf,maf->f", task.weights, away, away)
    cost += np.einsum("ja,jaf,jaf->f", task.drawn**2, bend, bend)
    cost += task.even**2 * np.einsum("jaf,jaf->f", uneven[:, 0], uneven[:, 0])
    if task.lean is not None:
        cost += np.einsum("jf,jaf,jaf->f", task.leaning**2, gone, gone)
    if task.point:
        cost += task.point.weight * distance(task.point, placed)[2] ** 2
    return State(at, placed, away, bend=bend, uneven=uneven, gone=gone, cost=0.5 * cost)


def _bend(chain: Chain, at: Poses) -> np.ndarray:
    """Measure how far (J, 3, F) radians each joint is rotated from rest: as a rotation vector, a hinge as angles."""
    bend = logarithm(at.local)
    for joint in chain.hinges:
        bend[joint] = at.angles[joint]
    return bend


def _gone(task: Task, at: Poses) -> np.ndarray:
    """Measure how far (J, 3, F) radians each joint is rotated from its target pose, in the same form; empty without
    one.
    """
    if task.lean is None:
        return np.zeros((0, 3, at.root.shape[-1]))
    gone = logarithm(multiply(at.local, task.lean.local * CONJUGATE))
    for joint in task.chain.hinges:
        gone[joint] = at.angles[joint] - task.lean.angles[joint]
    return gone


def _uneven(task: Task, at: Poses) -> np.ndarray:
    """Measure how far the joints of runs deviate from their run's mean rotation.

    For each joint: the difference of its rotation vector from the run's mean, and the derivative of half its square by
    the joint's rotations, (joints, 2, 3, F) radians. The derivative of the mean adds nothing, since the differences sum
    to zero.
    """
    out = []
    for run in task.chain.runs:
        vectors = logarithm(at.local[list(run)])
        for vector, gap in zip(vectors, vectors - vectors.mean(axis=0)):
            out.append(np.stack([gap, carried_to_turns(vector, gap)]))
    return np.array(out) if out else np.zeros((0, 2, 3, at.root.shape[-1]))


def carried_to_turns(vector: np.ndarray, slope: np.ndarray) -> np.ndarray:
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


def distance(point: HeldPoint, placed: Placed) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
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


def crosswise(away: np.ndarray, radius: float) -> np.ndarray:
    """Compute the weight across a distance, as a share of the weight along it (like a rope under tension).

    Args:
        away: (F,) metres by which the distance is too long.
        radius: metres.
    Returns:
        (F,) shares, 0 to 1.
    """
    return np.maximum(away, 0.0) / np.maximum(away + radius, 1e-9)


def _step(task: Task, best: State, stops: dict, damping: np.ndarray,
          curved: np.ndarray) -> tuple[np.ndarray, np.ndarray, State]:
    """Take one damped step, with second derivatives where `curved` (F,).

    Returns its size (F,), the joints held by limits (J, F), and the new state.
    """
    shift, turns, held = _solved(task, best, stops, damping, curved)
    further = limits.along(task.chain, held, best.poses, turns, moved(task.chain, best.poses, shift, turns))
    further, ahead = limits.held_back(task.chain, stops, further)
    for joint in task.chain.hinges:
        ahead[joint] = best.poses.angles[joint] + turns[joint]
    outside = (ahead > task.chain.high[..., None]) | (ahead < task.chain.low[..., None])
    # frames whose step exceeds a limit are solved again so that the step ends at the limit
    over = np.flatnonzero(outside.any(axis=(0, 1)))
    if len(over):
        part = best.frames(over)
        again = _solved(task.frames(over), part, stops, damping=damping[over], curved=curved[over],
                        ahead=ahead[..., over])
        shift[:, over], turns[..., over], held[:, over] = again
        onto = limits.along(task.chain, again[2], part.poses, again[1], moved(task.chain, part.poses, *again[:2]))
        further.put(over, limits.held_back(task.chain, stops, onto)[0])
    size = np.maximum(np.abs(turns).max(axis=(0, 1)), np.abs(shift).max(axis=0))
    return size, held, state_of(task, further)


def _solved(task: Task, best: State, stops: dict, damping: np.ndarray, curved: np.ndarray, ahead=None):
    """Solve a step: the root's shift (3, F), all rotations (J, 3, F), and the joints held by limits (J, F).

    `ahead` is as in `limits.hold_at_limits`.
    """
    about = axes(task.chain, best.poses, best.placed)
    asked = elimination.bodies(task.chain, best.placed, best.away, task.weights)
    if task.point:
        x, along, far = distance(task.point, best.placed)
        across = task.point.weight * crosswise(far, task.point.radius)
        elimination.add_distance(asked, task.point.joint, x, along=along, weight=task.point.weight, away=far,
                                 across=across)
    own = wishes(task, best)
    slope = elimination.gradient(task.chain, best.placed, about, asked, own)
    held = limits.hold(task.chain, stops, best.poses, slope=slope, own=own, ahead=ahead)
    bent = None
    if curved.any():
        bent = elimination.bends(task.chain, best.placed, about, away=best.away, weights=task.weights, share=curved)
    return *elimination.step(task.chain, best.placed, about, asked=asked, own=own, damping=damping, bent=bent), held


def wishes(task: Task, best: State) -> elimination.Own:
    """Build the terms of each joint's own rotations: pulls to rest, to even runs and to target poses.

    The derivative of half the squared length of a rotation vector by a small rotation is the vector itself.
    """
    strength = task.drawn**2
    curvature = np.zeros((len(strength), 3, 3, best.cost.shape[-1]))
    pull = strength[..., None] * best.bend
    fixed = ~task.chain.free
    spread = [joint for run in task.chain.runs for joint in run]
    pull[spread] += task.even**2 * best.uneven[:, 1]
    if task.lean is not None:
        pull += task.leaning[:, None] ** 2 * best.gone
    for axis in range(3):
        curvature[:, axis, axis] = strength[:, axis, None] + (0.0 if task.lean is None else task.leaning**2)
        curvature[spread, axis, axis] += task.even**2
    pull[fixed] = 0.0
    return elimination.Own(curvature, pull)
