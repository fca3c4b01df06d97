"""A model and its poses in many frames, adjusted together: all markers of all frames tell joint centres, bone lengths
and the markers' places, weighed against what was known before.

This is how surveyors and photographs' cameras are adjusted. The unknowns of one frame (its pose) touch that frame
alone, so they are eliminated frame by frame (Schur's complement), and what is left is one small system for the body.
Where the motion turns a joint far, its centre follows from the motion, as in functional methods; where it does not, the
predicted centre stays: each counts by its uncertainty.

Pose unknowns are small turns about the world's axes and a shift of the root; a marker x below a joint at p moves by
turn x (x - p).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.vectors import skew_matrix
from ...motion import quaternion
from ...motion.motion import Motion

_HUBER = 2.5  # sigmas beyond which a marker counts less
_HINGES = {"Leg": (1, 2, 0), "ForeArm": (2, 1, None)}  # axis of the bend, axis that must stay square to it, its twist
_LARGEST_TURN = 0.3  # radians in one step: further off the equations are no longer straight
_CARRY, _TWIST = np.radians(4.0), np.radians(15.0)
"""How far a hinge's axis strays (radians): to the side, and about the limb (knees)."""


@dataclass(eq=False, kw_only=True)
class Body:
    """What is adjusted, J joints and M markers.

    names, parents: of the skeleton. offsets: (J, 3) m. joint: (M,). places: (M, 3) m. held: (J,) bool, joints that do
    not turn. limb: (J,) axis (0, 1, 2) along which the bone to this joint lies exactly, -1 where it may lie anyhow."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: np.ndarray
    joint: np.ndarray
    places: np.ndarray
    held: np.ndarray
    limb: np.ndarray


@dataclass(eq=False, kw_only=True)
class Prior:
    """What was known before: offsets (J, 3) m with sigma (J,), places (M, 3) m with sigma (M,), and by how much the
    bones of both sides may differ (m)."""

    offsets: np.ndarray
    offset_sigma: np.ndarray
    places: np.ndarray
    place_sigma: np.ndarray
    sides: float = 0.005


@dataclass(eq=False)
class Pull:
    """Turns that are drawn to the rest pose: joint -> (3,) radians of play about its own X, Y, Z (inf: none).

    runs: joints between which no marker stands; they turn alike up to `uneven` radians."""

    play: dict[int, np.ndarray]
    runs: tuple[tuple[int, ...], ...] = ()
    uneven: float = 0.12


class Adjustment:
    """The running adjustment of one body over F frames."""

    def __init__(self, body: Body, prior: Prior, pull: Pull, seen: np.ndarray, sigma: np.ndarray, worth: float):
        """seen: (F, M, 3) m, NaN where not seen. sigma: (M,) m. worth: how many independent frames they are worth."""
        self.body, self.prior, self.pull = body, prior, pull
        self.there = np.isfinite(seen).all(axis=-1)
        self.seen = np.where(self.there[..., None], seen, 0.0)
        self.sigma = sigma
        self.share = min(worth / max(len(seen), 1), 1.0)
        self.columns = _Columns(body)

    def start(self, motion: Motion) -> None:
        """Begin from these poses of F frames."""
        self.root = motion.root_positions.copy()
        self.local = quaternion.to_matrix(motion.rotations)

    def run(self, steps: int = 14) -> None:
        """Adjust until nothing moves by more than a tenth of a millimetre, at most so many steps."""
        damping = 1e-4
        cost = self.cost()
        for _ in range(steps):
            kept = self._state()
            largest = self._step(damping)
            now = self.cost()
            if now > cost * (1.0 + 1e-9):
                self._restore(kept)
                damping *= 20.0
                if damping > 1e4:
                    return
                continue
            damping, cost, gain = max(damping * 0.1, 1e-7), now, cost - now
            if largest < 1e-4 or gain < 1e-3 * cost:
                return

    def _state(self):
        return self.root.copy(), self.local.copy(), self.body.offsets.copy(), self.body.places.copy()

    def _restore(self, kept) -> None:
        self.root, self.local, self.body.offsets, self.body.places = kept

    def placed(self):
        """World rotations (F, J, 3, 3), joints (F, J, 3), markers (F, M, 3)."""
        body = self.body
        world, joints = np.empty_like(self.local), np.empty((len(self.root), len(body.names), 3))
        for joint, parent in enumerate(body.parents):
            if parent < 0:
                world[:, joint], joints[:, joint] = self.local[:, joint], self.root
                continue
            world[:, joint] = np.einsum("fab,fbc->fac", world[:, parent], self.local[:, joint])
            joints[:, joint] = joints[:, parent] + np.einsum("fab,b->fa", world[:, parent], body.offsets[joint])
        markers = joints[:, body.joint] + np.einsum("fmab,mb->fma", world[:, body.joint], body.places)
        return world, joints, markers

    def residuals(self) -> np.ndarray:
        """(F, M, 3) m, model minus seen, NaN where not seen."""
        return np.where(self.there[..., None], self.placed()[2] - self.seen, np.nan)

    def cost(self) -> float:
        """The robust sum that is made small."""
        world, _, markers = self.placed()
        away = np.linalg.norm(markers - self.seen, axis=-1) / self.sigma
        near = np.where(away < _HUBER, away**2, 2.0 * _HUBER * away - _HUBER**2)
        total = self.share * float(np.sum(near[self.there]))
        total += sum(float(np.sum(error**2)) for error, _ in self._pulls(world)) * self.share
        error, _ = self._priors()
        return total + float(np.sum(error**2))

    def _pulls(self, world: np.ndarray):
        """Weighted errors (F,) of hinges and of turns drawn to rest, with [(joint, derivative (F, 3) by its turn)]."""
        out = self._uneven(world)
        for joint, name in enumerate(self.body.names):
            part = name.removeprefix("Left").removeprefix("Right")
            parent = self.body.parents[joint]
            if part in _HINGES and not self.body.held[joint]:
                bend, square, twist = _HINGES[part]
                above = world[:, parent, :, bend]
                for axis, play in ((square, _CARRY), (twist, _TWIST)):
                    if axis is not None:
                        own = world[:, joint, :, axis]
                        out.append((np.einsum("fa,fa->f", above, own) / play, [(joint, np.cross(own, above) / play)]))
            if joint in self.pull.play:
                turn = self._turn(joint)
                for axis, play in enumerate(self.pull.play[joint]):
                    if np.isfinite(play):
                        out.append((turn[:, axis] / play, [(joint, world[:, parent, :, axis] / play)]))
        return out

    def _turn(self, joint: int) -> np.ndarray:
        """How far a joint is turned from rest, (F, 3) rotation vectors in radians."""
        return quaternion.to_rotation_vector(quaternion.from_matrix(self.local[:, joint]))

    def _uneven(self, world: np.ndarray):
        """By how much the joints of runs turn otherwise than the run's mean, in the form of `_pulls`."""
        out = []
        for run in self.pull.runs:
            turns = {joint: self._turn(joint) for joint in run}
            mean = np.mean(list(turns.values()), axis=0)
            for joint in run:
                for axis in range(3):
                    error = (turns[joint][:, axis] - mean[:, axis]) / self.pull.uneven
                    slopes = [
                        (other, world[:, self.body.parents[other], :, axis] / self.pull.uneven
                         * ((other == joint) - 1.0 / len(run)))
                        for other in run
                    ]
                    out.append((error, slopes))
        return out

    def _priors(self):
        """Errors (N,) of what was known before, and their derivative (N, columns)."""
        body, prior = self.body, self.prior
        known: list[tuple[float, list[tuple[int, float]]]] = []
        for joint, axis in zip(*np.nonzero(self.columns.offset >= 0)):
            weight = 1.0 / prior.offset_sigma[joint]
            gap = body.offsets[joint, axis] - prior.offsets[joint, axis]
            known.append((weight * gap, [(self.columns.offset[joint, axis], weight)]))
        known += self._alike()
        for marker, sigma in enumerate(prior.place_sigma):
            for axis in range(3):
                gap = body.places[marker, axis] - prior.places[marker, axis]
                known.append((gap / sigma, [(self.columns.place[marker, axis], 1.0 / sigma)]))
        rows = np.zeros((len(known), self.columns.count))
        for row, (_, entries) in enumerate(known):
            for column, value in entries:
                rows[row, column] = value
        return np.array([error for error, _ in known]), rows

    def _alike(self) -> list[tuple[float, list[tuple[int, float]]]]:
        """By how much the bones of both sides differ, with the derivative by their columns."""
        body, out = self.body, []
        for joint, name in enumerate(body.names):
            twin = name.replace("Left", "Right")
            if twin == name or twin not in body.names:
                continue
            other, weight = body.names.index(twin), 1.0 / self.prior.sides
            for axis, sign in enumerate((1.0, -1.0, 1.0)):
                ends = self.columns.offset[joint, axis], self.columns.offset[other, axis]
                if min(ends) >= 0:
                    gap = body.offsets[joint, axis] - sign * body.offsets[other, axis]
                    out.append((weight * gap, [(ends[0], weight), (ends[1], -sign * weight)]))
        return out

    def _step(self, damping: float) -> float:
        """One Gauss-Newton step; the largest move of an offset or place, m."""
        world, joints, markers = self.placed()
        error, rows = self._priors()
        normal, right = rows.T @ rows, rows.T @ error
        pose, shape, miss = self._equations(world, joints, markers)
        across = pose.transpose(0, 2, 1)
        own, mixed = across @ pose, across @ shape
        diagonal = range(own.shape[-1])
        own[:, diagonal, diagonal] += 1e-3 + damping * own[:, diagonal, diagonal]
        slope = np.einsum("fra,fr->fa", pose, miss)
        solved = np.linalg.solve(own, np.concatenate([mixed, slope[..., None]], axis=-1))
        flat = _joined(shape)
        normal = normal + flat.T @ flat - _joined(mixed).T @ _joined(solved[..., :-1])
        right = right + flat.T @ miss.reshape(-1) - np.einsum("fap,fa->p", mixed, solved[..., -1])
        self.normal = normal.copy()
        diagonal = range(self.columns.count)
        normal[diagonal, diagonal] *= 1.0 + damping
        change = -np.linalg.solve(normal, right)
        self._move(world, change, -solved[..., -1] - np.einsum("fap,p->fa", solved[..., :-1], change))
        return float(np.abs(change).max())

    def _equations(self, world, joints, markers):
        """Weighted derivatives of all frames' errors by the pose (F, R, 3 + 3 J) and by the body (F, R, columns), and
        the errors (F, R): three rows a marker, then one a pull."""
        body, columns, frames = self.body, self.columns, len(self.root)
        away = markers - self.seen
        far = np.linalg.norm(away, axis=-1) / self.sigma
        root = np.sqrt(self.share * self.there * np.minimum(1.0, _HUBER / np.maximum(far, 1e-9))) / self.sigma
        pulls = self._pulls(world)
        count = 3 * len(body.joint) + len(pulls)
        pose = np.zeros((frames, count, 3 + 3 * len(body.names)))
        shape, miss = np.zeros((frames, count, columns.count)), np.zeros((frames, count))
        for marker, carrier in enumerate(body.joint):
            at, weight = slice(3 * marker, 3 * marker + 3), root[:, marker, None, None]
            miss[:, at] = weight[..., 0] * away[:, marker]
            pose[:, at, :3] = weight * np.eye(3)
            shape[:, at, columns.place[marker]] = weight * world[:, carrier]
            joint = int(carrier)
            while joint >= 0:
                if not body.held[joint]:
                    arm = markers[:, marker] - joints[:, joint]
                    pose[:, at, 3 + 3 * joint : 6 + 3 * joint] = weight * skew_matrix(-arm)
                parent = body.parents[joint]
                for axis in np.flatnonzero(columns.offset[joint] >= 0):
                    shape[:, at, columns.offset[joint, axis]] = weight[..., 0] * world[:, parent, :, axis]
                joint = parent
        for row, (value, slopes) in enumerate(pulls, start=3 * len(body.joint)):
            miss[:, row] = np.sqrt(self.share) * value
            for joint, slope in slopes:
                pose[:, row, 3 + 3 * joint : 6 + 3 * joint] = np.sqrt(self.share) * slope
        return pose, shape, miss

    def _move(self, world, change, pose_change) -> None:
        body, columns = self.body, self.columns
        body.offsets = body.offsets + np.where(columns.offset >= 0, change[columns.offset], 0.0)
        body.places = body.places + change[columns.place]
        self.root = self.root + pose_change[:, :3]
        turns = pose_change[:, 3:].reshape(len(self.root), -1, 3)
        size = np.linalg.norm(turns, axis=-1, keepdims=True)
        turns = turns * np.minimum(1.0, _LARGEST_TURN / np.maximum(size, 1e-9))
        local = self.local.copy()
        for joint, parent in enumerate(body.parents):
            if body.held[joint]:
                continue
            turn = quaternion.to_matrix(quaternion.from_rotation_vector(turns[:, joint]))
            # a turn of this joint alone, about the world's axes as they stood
            above = world[:, parent] if parent >= 0 else np.broadcast_to(np.eye(3), turn.shape)
            inside = np.einsum("fba,fbc,fcd->fad", above, turn, above)
            local[:, joint] = np.einsum("fab,fbc->fac", inside, self.local[:, joint])
        self.local = local

    def uncertainty(self) -> np.ndarray:
        """(J,) m, how uncertain each offset is left (its largest axis)."""
        spread = np.sqrt(np.maximum(np.diag(np.linalg.inv(self.normal)), 0.0))
        return np.where(self.columns.offset >= 0, spread[self.columns.offset], 0.0).max(axis=1)


class _Columns:
    """Which column of the body's system is which: offset (J, 3), place (M, 3); -1 where nothing is to be found."""

    def __init__(self, body: Body):
        count = 0
        self.offset = np.full((len(body.names), 3), -1)
        for joint in range(1, len(body.names)):
            axes = range(3) if body.limb[joint] < 0 else [int(body.limb[joint])]
            for axis in axes:
                self.offset[joint, axis] = count
                count += 1
        self.place = count + np.arange(3 * len(body.joint)).reshape(-1, 3)
        self.count = count + 3 * len(body.joint)


def _joined(blocks: np.ndarray) -> np.ndarray:
    """(F, A, B) as (F A, B)."""
    return blocks.reshape(-1, blocks.shape[-1])
