"""Adjust a model and its poses in many frames together (bundle adjustment).

All markers of all frames determine joint centres, bone lengths and the markers' places, weighted against prior
knowledge. The unknowns of one frame (its pose) affect that frame alone, so they are eliminated frame by frame (Schur
complement), which leaves one small system for the body. Where the motion rotates a joint far, its centre follows from
the motion, as in functional methods; where it does not, the predicted centre stays: each is weighted by its
uncertainty.

Pose unknowns are small rotations about the world's axes and a shift of the root; a marker x below a joint at p moves by
rotation x (x - p).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.vectors import skew_matrix
from ...motion import quaternion
from ...motion.motion import Motion

_HUBER = 2.5  # sigmas beyond which a marker has less weight
_HINGES = {"Leg": (1, 2, 0), "ForeArm": (2, 1, None)}  # bend axis, axis at right angles to it, twist axis
_MAX_ROTATION_STEP = 0.3  # radians in one step; beyond, the equations are no longer linear
_CARRY, _TWIST = np.radians(4.0), np.radians(15.0)
"""Tolerance in radians of a hinge's axis: to the side, and about the limb (knees)."""


@dataclass(eq=False, kw_only=True)
class Body:
    """The unknowns of the body: J joints and M markers.

    Attributes:
        names: joint names.
        parents: index of each joint's parent, -1 for the root.
        offsets: (J, 3) metres, each joint in its parent's frame.
        joint: (M,) index of the joint that carries each marker.
        places: (M, 3) metres in that joint's frame.
        is_fixed: (J,) bool, joints that do not turn.
        limb: (J,) axis (0, 1, 2) along which the bone to this joint lies exactly, -1 where it may have any direction.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: np.ndarray
    joint: np.ndarray
    places: np.ndarray
    is_fixed: np.ndarray
    limb: np.ndarray


@dataclass(eq=False, kw_only=True)
class Prior:
    """What is known before the adjustment.

    Attributes:
        offsets: (J, 3) metres.
        offset_sigma: (J,) metres.
        places: (M, 3) metres.
        place_sigma: (M,) metres.
        side_sigma: metres by which left and right bones may differ.
    """

    offsets: np.ndarray
    offset_sigma: np.ndarray
    places: np.ndarray
    place_sigma: np.ndarray
    side_sigma: float = 0.005


@dataclass(eq=False)
class Pull:
    """Rotations that are pulled to the rest pose.

    Attributes:
        tolerance: joint -> (3,) radians about its own X, Y and Z axes, inf for none.
        runs: joints between which no marker lies; they turn alike.
        run_tolerance: radians by which the joints of a run may differ.
    """

    tolerance: dict[int, np.ndarray]
    runs: tuple[tuple[int, ...], ...] = ()
    run_tolerance: float = 0.12


class Adjustment:
    """The adjustment of one body over F frames: damped Gauss-Newton with robust weights."""

    def __init__(self, body: Body, prior: Prior, pull: Pull, seen: np.ndarray, sigma: np.ndarray,
                 effective_frames: float):
        """Set up the adjustment.

        Args:
            body: the unknowns; changed in place.
            prior: what is known before.
            pull: the pull to the rest pose.
            seen: (F, M, 3) metres, NaN where not visible.
            sigma: (M,) metres, deviation of each marker.
            effective_frames: effective number of independent frames.
        """
        self.body, self.prior, self.pull = body, prior, pull
        self.visible = np.isfinite(seen).all(axis=-1)
        self.seen = np.where(self.visible[..., None], seen, 0.0)
        self.sigma = sigma
        self.share = min(effective_frames / max(len(seen), 1), 1.0)
        self.columns = _Columns(body)

    def start_from(self, motion: Motion) -> None:
        """Start from a motion's poses of F frames."""
        self.root = motion.root_positions.copy()
        self.local = quaternion.to_matrix(motion.rotations)

    def run_steps(self, steps: int = 14) -> None:
        """Adjust until no unknown moves by more than a tenth of a millimetre.

        Args:
            steps: maximum number of steps.
        """
        damping = 1e-4
        cost = self.compute_cost()
        for _ in range(steps):
            saved = self._copy_state()
            largest = self._take_step(damping)
            new_cost = self.compute_cost()
            # a step that raises the cost is undone and repeated with more damping
            if new_cost > cost * (1.0 + 1e-9):
                self._restore_state(saved)
                damping *= 20.0
                if damping > 1e4:
                    return
                continue
            damping, cost, gain = max(damping * 0.1, 1e-7), new_cost, cost - new_cost
            if largest < 1e-4 or gain < 1e-3 * cost:
                return

    def _copy_state(self):
        return self.root.copy(), self.local.copy(), self.body.offsets.copy(), self.body.places.copy()

    def _restore_state(self, saved) -> None:
        self.root, self.local, self.body.offsets, self.body.places = saved

    def compute_places(self):
        """Compute world rotations (F, J, 3, 3), joints (F, J, 3) and markers (F, M, 3) in metres."""
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

    def compute_residuals(self) -> np.ndarray:
        """Compute model minus recorded markers, (F, M, 3) metres, NaN where not visible."""
        return np.where(self.visible[..., None], self.compute_places()[2] - self.seen, np.nan)

    def compute_cost(self) -> float:
        """Compute the robust sum of squares that is minimised."""
        world, _, markers = self.compute_places()
        away = np.linalg.norm(markers - self.seen, axis=-1) / self.sigma
        near = np.where(away < _HUBER, away**2, 2.0 * _HUBER * away - _HUBER**2)  # Huber: linear beyond the threshold
        total = self.share * float(np.sum(near[self.visible]))
        total += sum(float(np.sum(error**2)) for error, _ in self._build_pull_errors(world)) * self.share
        error, _ = self._build_prior_errors()
        return total + float(np.sum(error**2))

    def _build_pull_errors(self, world: np.ndarray):
        """Build the weighted errors (F,) of hinges and of rotations pulled to rest.

        Each comes with [(joint, derivative (F, 3) by its rotation)].
        """
        out = self._build_run_errors(world)
        for joint, name in enumerate(self.body.names):
            part = name.removeprefix("Left").removeprefix("Right")
            parent = self.body.parents[joint]
            if part in _HINGES and not self.body.is_fixed[joint]:
                bend, square, twist = _HINGES[part]
                above = world[:, parent, :, bend]
                for axis, tolerance in ((square, _CARRY), (twist, _TWIST)):
                    if axis is not None:
                        own = world[:, joint, :, axis]
                        out.append((np.einsum("fa,fa->f", above, own) / tolerance,
                                    [(joint, np.cross(own, above) / tolerance)]))
            if joint in self.pull.tolerance:
                turn = self._compute_rotation(joint)
                for axis, tolerance in enumerate(self.pull.tolerance[joint]):
                    if np.isfinite(tolerance):
                        out.append((turn[:, axis] / tolerance, [(joint, world[:, parent, :, axis] / tolerance)]))
        return out

    def _compute_rotation(self, joint: int) -> np.ndarray:
        """Compute how far a joint is rotated from rest, (F, 3) rotation vectors in radians."""
        return quaternion.to_rotation_vector(quaternion.from_matrix(self.local[:, joint]))

    def _build_run_errors(self, world: np.ndarray):
        """Build the errors of runs, whose joints should turn like the run's mean, in the form of
        `_build_pull_errors`.
        """
        out = []
        for run in self.pull.runs:
            rotations = {joint: self._compute_rotation(joint) for joint in run}
            mean = np.mean(list(rotations.values()), axis=0)
            for joint in run:
                for axis in range(3):
                    error = (rotations[joint][:, axis] - mean[:, axis]) / self.pull.run_tolerance
                    slopes = [
                        (other, world[:, self.body.parents[other], :, axis] / self.pull.run_tolerance
                         * ((other == joint) - 1.0 / len(run)))
                        for other in run
                    ]
                    out.append((error, slopes))
        return out

    def _build_prior_errors(self):
        """Build the errors (N,) against the prior, and their derivative (N, columns)."""
        body, prior = self.body, self.prior
        known: list[tuple[float, list[tuple[int, float]]]] = []
        for joint, axis in zip(*np.nonzero(self.columns.offset >= 0)):
            weight = 1.0 / prior.offset_sigma[joint]
            gap = body.offsets[joint, axis] - prior.offsets[joint, axis]
            known.append((weight * gap, [(self.columns.offset[joint, axis], weight)]))
        known += self._build_symmetry_errors()
        for marker, sigma in enumerate(prior.place_sigma):
            for axis in range(3):
                gap = body.places[marker, axis] - prior.places[marker, axis]
                known.append((gap / sigma, [(self.columns.place[marker, axis], 1.0 / sigma)]))
        rows = np.zeros((len(known), self.columns.count))
        for row, (_, entries) in enumerate(known):
            for column, value in entries:
                rows[row, column] = value
        return np.array([error for error, _ in known]), rows

    def _build_symmetry_errors(self) -> list[tuple[float, list[tuple[int, float]]]]:
        """Build the errors of left against right bones, with the derivative by their columns."""
        body, out = self.body, []
        for joint, name in enumerate(body.names):
            twin = name.replace("Left", "Right")
            if twin == name or twin not in body.names:
                continue
            other, weight = body.names.index(twin), 1.0 / self.prior.side_sigma
            for axis, sign in enumerate((1.0, -1.0, 1.0)):
                columns = self.columns.offset[joint, axis], self.columns.offset[other, axis]
                if min(columns) >= 0:
                    gap = body.offsets[joint, axis] - sign * body.offsets[other, axis]
                    out.append((weight * gap, [(columns[0], weight), (columns[1], -sign * weight)]))
        return out

    def _take_step(self, damping: float) -> float:
        """Take one Gauss-Newton step; return the largest change of an offset or place in metres."""
        world, joints, markers = self.compute_places()
        error, rows = self._build_prior_errors()
        normal, right = rows.T @ rows, rows.T @ error
        pose, shape, miss = self._build_equations(world, joints, markers)
        across = pose.transpose(0, 2, 1)
        own, mixed = across @ pose, across @ shape
        diagonal = range(own.shape[-1])
        own[:, diagonal, diagonal] += 1e-3 + damping * own[:, diagonal, diagonal]
        slope = np.einsum("fra,fr->fa", pose, miss)
        # Schur complement: eliminate each frame's pose (`own`), which leaves `normal` for the body's unknowns
        solved = np.linalg.solve(own, np.concatenate([mixed, slope[..., None]], axis=-1))
        flat = _flatten_frames(shape)
        normal = normal + flat.T @ flat - _flatten_frames(mixed).T @ _flatten_frames(solved[..., :-1])
        right = right + flat.T @ miss.reshape(-1) - np.einsum("fap,fa->p", mixed, solved[..., -1])
        # kept undamped for `compute_uncertainty`
        self.normal = normal.copy()
        diagonal = range(self.columns.count)
        normal[diagonal, diagonal] *= 1.0 + damping
        change = -np.linalg.solve(normal, right)
        self._apply_change(world, change, -solved[..., -1] - np.einsum("fap,p->fa", solved[..., :-1], change))
        return float(np.abs(change).max())

    def _build_equations(self, world, joints, markers):
        """Build the weighted derivatives and errors of all frames.

        Rows are three for each marker, then one for each pull.

        Returns:
            Derivatives by the pose (F, R, 3 + 3 J) and by the body (F, R, columns), and the errors (F, R).
        """
        body, columns, frames = self.body, self.columns, len(self.root)
        away = markers - self.seen
        far = np.linalg.norm(away, axis=-1) / self.sigma
        root = np.sqrt(self.share * self.visible * np.minimum(1.0, _HUBER / np.maximum(far, 1e-9))) / self.sigma
        pulls = self._build_pull_errors(world)
        count = 3 * len(body.joint) + len(pulls)
        pose = np.zeros((frames, count, 3 + 3 * len(body.names)))
        shape, miss = np.zeros((frames, count, columns.count)), np.zeros((frames, count))
        for marker, carrier in enumerate(body.joint):
            at, weight = slice(3 * marker, 3 * marker + 3), root[:, marker, None, None]
            miss[:, at] = weight[..., 0] * away[:, marker]
            pose[:, at, :3] = weight * np.eye(3)
            shape[:, at, columns.place[marker]] = weight * world[:, carrier]
            joint = int(carrier)
            # walk from the carrier to the root: every joint above moves the marker
            while joint >= 0:
                if not body.is_fixed[joint]:
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

    def _apply_change(self, world, change, pose_change) -> None:
        """Apply a step to the body and the poses; rotations are limited to `_MAX_ROTATION_STEP`."""
        body, columns = self.body, self.columns
        body.offsets = body.offsets + np.where(columns.offset >= 0, change[columns.offset], 0.0)
        body.places = body.places + change[columns.place]
        self.root = self.root + pose_change[:, :3]
        turns = pose_change[:, 3:].reshape(len(self.root), -1, 3)
        size = np.linalg.norm(turns, axis=-1, keepdims=True)
        turns = turns * np.minimum(1.0, _MAX_ROTATION_STEP / np.maximum(size, 1e-9))
        local = self.local.copy()
        for joint, parent in enumerate(body.parents):
            if body.is_fixed[joint]:
                continue
            # limited rotation about the world's axes
            turn = quaternion.to_matrix(quaternion.from_rotation_vector(turns[:, joint]))
            # the rotation of this joint alone, converted from world axes to the parent's frame
            above = world[:, parent] if parent >= 0 else np.broadcast_to(np.eye(3), turn.shape)
            inside = np.einsum("fba,fbc,fcd->fad", above, turn, above)
            local[:, joint] = np.einsum("fab,fbc->fac", inside, self.local[:, joint])
        self.local = local

    def compute_uncertainty(self) -> np.ndarray:
        """Compute the remaining uncertainty of each offset, (J,) metres (its largest axis)."""
        spread = np.sqrt(np.maximum(np.diag(np.linalg.inv(self.normal)), 0.0))
        return np.where(self.columns.offset >= 0, spread[self.columns.offset], 0.0).max(axis=1)


class _Columns:
    """The columns of the body's system: offset (J, 3), place (M, 3); -1 where a value is fixed."""

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


def _flatten_frames(blocks: np.ndarray) -> np.ndarray:
    """Reshape (F, A, B) to (F A, B)."""
    return blocks.reshape(-1, blocks.shape[-1])
