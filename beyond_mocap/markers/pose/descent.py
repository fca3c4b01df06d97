"""From a pose near by to the one whose markers lie nearest to the seen ones: many frames at once, each by itself.

Levenberg and Marquardt's method on the weighted squares of eq. 5.1 (Fredriksson §5.3.2), with the exact derivative of
all markers (`chain`), steps solved from the tips to the root (`elimination`) and limits held exactly (`limits`). The
paper gave the sum to a general solver (SLSQP, §5.3.4), which needed seconds a frame.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from . import elimination, limits
from .chain import CONJUGATE, Chain, Placed, Poses, axes, cross, logarithm, moved, multiply, place

MOST_STEPS = 24
_NEAR = 0.1  # a step that gains a smaller part of the cost is near enough for second derivatives to help
_STILL = 1e-5  # radians (and metres): a frame whose step is smaller has arrived
_NO_GAIN = 1e-7  # as has one whose cost falls by a smaller part
_TRUSTED = 1e-3  # m2: with more damping a small step says nothing
_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-5, 1e-9, 1e3  # m2


@dataclass(frozen=True, eq=False, kw_only=True)
class HeldPoint:
    """A point of a joint's body that stands at a given distance from a seen point: a ball's centre in the hand, from a
    marker on the ball.

    joint: which body. place: (3,) m in its frame. radius: m. seen: (3, F) m. weight: (F,), 0 where it does not count.
    """

    joint: int
    place: np.ndarray
    radius: float
    seen: np.ndarray
    weight: np.ndarray

    def frames(self, chosen) -> "HeldPoint":
        """These frames only."""
        return replace(self, seen=self.seen[:, chosen], weight=self.weight[chosen])


@dataclass(frozen=True, eq=False, kw_only=True)
class Task:
    """What F poses are to come near to.

    seen: (M, 3, F) m, any numbers where the weight (M, F) is 0. drawn: (J, 3) m per radian, how strongly a joint is
    drawn to its rest pose (in place of the chain's stiffness). lean: poses to be drawn to besides, or None; leaning:
    (J, F) m per radian, how strongly. point: a held point, or None.
    even: m per radian, how strongly the joints of a run (`Chain.runs`) are held to turn alike."""

    chain: Chain
    seen: np.ndarray
    weights: np.ndarray
    drawn: np.ndarray
    lean: Poses | None = None
    leaning: np.ndarray | None = None
    point: HeldPoint | None = None
    even: float = 0.0

    def frames(self, chosen) -> "Task":
        """These frames only."""
        return replace(self, seen=self.seen[..., chosen], weights=self.weights[:, chosen],
                       lean=self.lean and self.lean.frames(chosen), point=self.point and self.point.frames(chosen),
                       leaning=None if self.leaning is None else self.leaning[:, chosen])


@dataclass(frozen=True, eq=False)
class Arrived:
    """Poses; cost: (F,) m2, half the weighted squares; steps: (F,) how many were taken; held: (J, F) whether a joint
    stands at a limit against the markers."""

    poses: Poses
    cost: np.ndarray
    steps: np.ndarray
    held: np.ndarray


@dataclass(eq=False)
class State:
    """Poses with what follows from them, kept while they are the best known."""

    poses: Poses
    placed: Placed
    away: np.ndarray
    bend: np.ndarray
    uneven: np.ndarray
    gone: np.ndarray
    cost: np.ndarray

    def take(self, other: "State", where: np.ndarray) -> None:
        """Take the other's frames where (F,) is true, in place."""
        for mine, its in zip(self._arrays(), other._arrays()):
            np.copyto(mine, its, where=where)

    def frames(self, chosen) -> "State":
        """These frames only."""
        at, put = self.poses.frames(chosen), self.placed
        placed = Placed(at.root, *(a[..., chosen] for a in (put.world, put.joints, put.markers)))
        more = (a[..., chosen] for a in (self.away, self.bend, self.uneven, self.gone, self.cost))
        return State(at, placed, *more)

    def _arrays(self):
        at, put = self.poses, self.placed
        placed = at.root, at.local, at.angles, put.world, put.joints, put.markers
        return *placed, self.away, self.bend, self.uneven, self.gone, self.cost


def descend(task: Task, start: Poses, most_steps: int = MOST_STEPS) -> Arrived:
    """The poses nearest to the seen markers that lie downhill of `start`."""
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
        harder = np.where(curved, damping, np.maximum(10.0 * damping, _FIRST_DAMPING))
        damping = np.where(better, np.maximum(0.1 * damping, _LEAST_DAMPING), harder)
        curved = better & (gain < _NEAR * (best.cost + gain))
        out.steps[live] += 1
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
    """Put finished frames into the result."""
    out.poses.put(frames, state.poses)
    out.cost[frames], out.held[:, frames] = state.cost, held


def state_of(task: Task, at: Poses) -> State:
    """Poses and what follows from them."""
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
    """How far (J, 3, F) rad each joint is turned from rest: as a rotation vector, a hinge as angles."""
    bend = logarithm(at.local)
    for joint in chain.hinges:
        bend[joint] = at.angles[joint]
    return bend


def _gone(task: Task, at: Poses) -> np.ndarray:
    """How far (J, 3, F) rad each joint is turned from where it leans to, in the same form; nothing without."""
    if task.lean is None:
        return np.zeros((0, 3, at.root.shape[-1]))
    gone = logarithm(multiply(at.local, task.lean.local * CONJUGATE))
    for joint in task.chain.hinges:
        gone[joint] = at.angles[joint] - task.lean.angles[joint]
    return gone


def _uneven(task: Task, at: Poses) -> np.ndarray:
    """Of every joint of a run how far its rotation vector is from the run's mean, and the derivative of half its square
    by the joint's turns: (joints, 2, 3, F) rad.

    The mean's own derivative adds nothing, since the distances from it cancel out."""
    out = []
    for run in task.chain.runs:
        vectors = logarithm(at.local[list(run)])
        for vector, gap in zip(vectors, vectors - vectors.mean(axis=0)):
            out.append(np.stack([gap, carried_to_turns(vector, gap)]))
    return np.array(out) if out else np.zeros((0, 2, 3, at.root.shape[-1]))


def carried_to_turns(vector: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """A slope (3, F) by a joint's rotation vector (3, F) as one by small turns put before it."""
    angle = np.sqrt(np.einsum("af,af->f", vector, vector))
    near = np.maximum(angle, 1e-3)
    factor = np.where(angle > 1e-3, 1.0 / near**2 - 0.5 / (near * np.tan(0.5 * near)), 1.0 / 12.0)
    once = cross(vector, slope)
    return slope + 0.5 * once + factor * cross(vector, once)


def distance(point: HeldPoint, placed: Placed) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where the held point is (3, F), the unit direction (3, F) from the seen point to it, how much too far it is (F,).
    """
    x = placed.joints[point.joint] + np.einsum("abf,b->af", placed.world[point.joint], point.place)
    gap = x + placed.origin - point.seen
    length = np.sqrt(np.einsum("af,af->f", gap, gap))
    return x, gap / np.maximum(length, 1e-9), length - point.radius


def crosswise(away: np.ndarray, radius: float) -> np.ndarray:
    """What a distance that is `away` (F,) m too long weighs crosswise, as a part of what it weighs along: as a rope
    does that is pulled."""
    return np.maximum(away, 0.0) / np.maximum(away + radius, 1e-9)


def _step(task: Task, best: State, stops: dict, damping: np.ndarray,
          curved: np.ndarray) -> tuple[np.ndarray, np.ndarray, State]:
    """One damped step, with second derivatives where `curved` (F,): its size (F,), what limits held still (J, F), and
    the state it leads to."""
    shift, turns, held = _solved(task, best, stops, damping, curved)
    further = limits.along(task.chain, held, best.poses, turns, moved(task.chain, best.poses, shift, turns))
    further, ahead = limits.held_back(task.chain, stops, further)
    for joint in task.chain.hinges:
        ahead[joint] = best.poses.angles[joint] + turns[joint]
    outside = (ahead > task.chain.high[..., None]) | (ahead < task.chain.low[..., None])
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
    """The root's shift (3, F), all turns (J, 3, F), and what limits held still (J, F); `ahead` as in `limits.hold`."""
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
    """What the pull to the rest pose, and that to even runs, asks of each joint's turns.

    The derivative of half the squared length of a rotation vector by a small turn is the vector itself."""
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
