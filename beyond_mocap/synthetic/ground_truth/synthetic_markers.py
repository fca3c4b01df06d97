"""Synthetic markers on a known motion: a trial with ground truth, for tests, benchmarks and the samples.

    clip = bvh.read_bvh("walk.bvh").motion
    known = build_trial(clip, "plug_in_gait", seed=1, occlusion=0.05)
    known.trial, known.static             what a laboratory delivers
    known.motion, known.centres           what a reconstruction has to find
    measure_trial_error(known, found)     how far a reconstruction is from it

`Faults` are errors of recordings: hidden markers, exchanged labels, stray samples, lost labels. Errors of a
reconstruction are measured per frame. Of centres: the distance of the joints that anatomy defines (hips, knees, ankles,
shoulders, elbows, wrists) in the world. Of angles, each segment against the one above it: `raw` compares the segments'
axes as they are; `angles` first removes from each segment the constant rotation between found and true axes that fits
the whole clip best, because the axes of a model's segment are a convention and its movement is not. Errors are the
whole angle between found and true joint rotation, all three axes at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ...base.errors import InputError
from ...markers.rigid_fit import compute_mean_rotation
from ...markers.trial import MarkerTrial
from ...motion import quaternion
from ...motion.motion import Motion, forward_kinematics
from .marker_places import SETS, STATIC_ONLY, MarkerPlacement, compute_skin_markers, place_markers
from .synthetic_ball import BallRequest, BallTruth, build_ball
from .synthetic_body import build_calibration_pose, to_marker_axes

_STATIC_SECONDS, _STATIC_FPS = 3.0, 100.0
_LEAST_HIDDEN, _MEDIAN_HIDDEN, _MOST_HIDDEN = 0.03, 0.15, 1.0  # s that a marker stays hidden: least, median, most
_SWAP_SECONDS = (0.15, 0.7)  # s that two labels stay exchanged: least, most
_STRAY_DISTANCE = (0.02, 0.12)  # m by which a stray sample is off: least, most
_TRIES = 400  # attempts to find a free stretch for a fault
_PARTS = ("UpLeg", "Leg", "Foot", "Arm", "ForeArm", "Hand")
CENTRES = tuple(side + part for side in ("Left", "Right") for part in _PARTS)
ABOVE = {
    "Chest": "Hips", "Head": "Chest",
    **{side + part: above if above in ("Hips", "Chest") else side + above
       for side in ("Left", "Right")
       for part, above in (("UpLeg", "Hips"), ("Leg", "UpLeg"), ("Foot", "Leg"), ("Arm", "Chest"), ("ForeArm", "Arm"),
                           ("Hand", "ForeArm"))},
}  # fmt: skip
"""Joint -> the segment against which its angle is measured: the trunk as one, from pelvis to chest."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SyntheticTrial:
    """A trial and its ground truth.

    Attributes:
        trial: the trial as recorded.
        static: static trial of the same body with the same markers.
        motion: the true motion, joints named and oriented as in marker models.
        centres: (T, J, 3) m, its joints, world.
        markers: places of the markers on the bones.
        clean: (T, M, 3) m, true places of the trial's markers: with skin and noise, without faults.
        faults: the faults of the trial.
        ball: the ball in the hand and in flight, if requested; its marker is the last of the trial's named ones.
    """

    trial: MarkerTrial
    static: MarkerTrial
    motion: Motion
    centres: np.ndarray
    markers: MarkerPlacement
    clean: np.ndarray
    faults: tuple[Fault, ...]
    ball: BallTruth | None = None

    def centre(self, joint: str) -> np.ndarray:
        """True place (T, 3) m of a joint."""
        return self.centres[:, self.motion.skeleton.index(joint)]

    @property
    def segments(self) -> dict[str, str]:
        """Joint that carries each marker, by label."""
        names = self.motion.skeleton.names
        return {label: names[joint] for label, joint in zip(self.markers.labels, self.markers.joint)}


def build_trial(
    motion: Motion, marker_set: str | tuple[str, ...] = "plug_in_gait", seed: int = 0, *, noise: float = 0.0005,
    softness: float = 1.0, occlusion: float = 0.0, swaps: int = 0, jumps: int = 0, unlabeled: int = 0,
    ball: BallRequest | None = None,
) -> SyntheticTrial:
    """Build markers on any humanoid motion, and a static trial of the same body.

    Args:
        motion: the motion.
        marker_set: one of `SETS`, or labels.
        seed: of places, skin, noise and faults.
        noise: m, standard deviation of the cameras' noise in each coordinate.
        softness: factor on the skin's movement (1: 10 to 15 mm on a moving thigh, 0: markers on bone).
        occlusion: share of the samples that are hidden.
        swaps, jumps, unlabeled: number of each fault.
        ball: a ball in a hand, thrown.
    Returns:
        The trial and its ground truth.
    Raises:
        InputError: for an unknown set, or a body without legs.
    """
    truth = to_marker_axes(motion)
    labels = _find_labels(marker_set)
    markers = place_markers(truth.skeleton, labels, seed)
    pose = build_calibration_pose(truth.skeleton, _STATIC_SECONDS, _STATIC_FPS, seed + 1)
    neutral = pose.rotations[0]
    rng = np.random.default_rng(seed + 2)
    positions = compute_skin_markers(truth, markers, neutral, seed + 3, softness)
    positions = positions + rng.normal(0.0, noise, positions.shape)
    static_positions = compute_skin_markers(pose, markers, neutral, seed + 3, softness)
    static_positions = static_positions + rng.normal(0.0, noise, static_positions.shape)
    static_only = STATIC_ONLY.get(marker_set, ()) if isinstance(marker_set, str) else ()
    recorded = [i for i, label in enumerate(markers.labels) if label not in static_only]
    labels, clean = tuple(markers.labels[i] for i in recorded), positions[:, recorded]
    ball_truth = build_ball(truth, ball) if ball else None
    if ball_truth:
        labels, clean = (*labels, ball.label), np.concatenate([clean, _observe_ball(ball_truth, truth, noise, rng)],
                                                              axis=1)
    trial = MarkerTrial(labels=labels, positions=clean, fps=motion.fps, name="planted")
    faults = Faults(trial, seed + 4)
    faults.swap_labels(_list_pairs(markers, trial.labels), swaps)
    faults.remove_labels(unlabeled)
    faults.move_samples(jumps)
    faults.hide_samples(occlusion)
    faulty_trial, faults_added = faults.build_trial()
    static = MarkerTrial(labels=markers.labels, positions=static_positions, fps=pose.fps, name="planted static")
    return SyntheticTrial(trial=faulty_trial, static=static, motion=truth, centres=forward_kinematics(truth)[0],
                          markers=markers, clean=clean, faults=faults_added, ball=ball_truth)


def _observe_ball(ball: BallTruth, truth: Motion, noise: float, rng: np.random.Generator) -> np.ndarray:
    """Build the ball's marker as cameras see it: (T, 1, 3) m, NaN once it is out of sight."""
    seen = ball.marker + rng.normal(0.0, noise, ball.marker.shape)
    is_out_of_sight = np.arange(len(truth)) / truth.fps > ball.request.release + ball.request.seconds_seen
    return np.where(is_out_of_sight[:, None], np.nan, seen)[:, None]


def _find_labels(marker_set: str | tuple[str, ...]) -> tuple[str, ...]:
    if not isinstance(marker_set, str):
        return tuple(marker_set)
    if marker_set not in SETS:
        raise InputError("synthetic markers", f"marker set {marker_set!r}", f"one of {', '.join(SETS)}, or labels")
    return SETS[marker_set]


def _list_pairs(markers: MarkerPlacement, labels: tuple[str, ...]) -> list[tuple[str, str]]:
    """List pairs that recordings confuse: two markers of one segment, or the same marker on the left and on the right.
    """
    joint = dict(zip(markers.labels, markers.joint))
    labels = tuple(label for label in labels if label in joint)
    pairs = [two for two in combinations(labels, 2) if joint[two[0]] == joint[two[1]]]
    mirrored_pairs = [(label, "R" + label[1:]) for label in labels if label[0] == "L" and "R" + label[1:] in labels]
    return sorted({*pairs, *mirrored_pairs})


@dataclass(frozen=True)
class Fault:
    """One fault of a trial.

    Attributes:
        kind: "gap", "swap", "jump" or "unlabeled".
        labels: the marker, the two that are exchanged, or the marker and the label under which it continues.
        start: first frame.
        stop: frame after the last one.
    """

    kind: str
    labels: tuple[str, ...]
    start: int
    stop: int


class Faults:
    """A trial to which faults are added, never two on one sample."""

    def __init__(self, trial: MarkerTrial, seed: int):
        self.trial = trial
        self.labels = list(trial.labels)
        self.positions = trial.positions.copy()
        self.is_free = trial.visibility.copy()
        self.rng = np.random.default_rng(seed)
        self.added: list[Fault] = []

    def hide_samples(self, share: float) -> None:
        """Hide markers for stretches until `share` of all samples is hidden; never more than half of the markers at
        once.
        """
        if not 0.0 <= share < 0.5:
            raise InputError("synthetic markers", f"{share:g} of the samples hidden", "0 or more, below 0.5")
        missing = int(share * self.is_free.size)
        for _ in range(_TRIES * self.is_free.shape[1]):
            if missing <= 0:
                return
            seconds = np.clip(self.rng.lognormal(np.log(_MEDIAN_HIDDEN), 0.7), _LEAST_HIDDEN, _MOST_HIDDEN)
            marker = int(self.rng.integers(len(self.trial.labels)))
            start, stop = self._choose_stretch(seconds)
            is_hidden = ~np.isfinite(self.positions[start:stop, :, 0])
            if self.is_free[start:stop, marker].all() and (is_hidden.mean(axis=1) < 0.5).all():
                self.positions[start:stop, marker] = np.nan
                missing -= stop - start
                self._add_fault("gap", (marker,), start, stop)

    def swap_labels(self, pairs: list[tuple[str, str]], count: int) -> None:
        """Exchange the labels of `count` pairs for a stretch each."""
        for _ in range(_TRIES):
            if count <= 0 or not pairs:
                return
            two = [self.labels.index(label) for label in pairs[int(self.rng.integers(len(pairs)))]]
            start, stop = self._choose_stretch(self.rng.uniform(*_SWAP_SECONDS))
            if self.is_free[start:stop, two].all():
                self.positions[start:stop, two] = self.positions[start:stop, two[::-1]]
                count -= 1
                self._add_fault("swap", two, start, stop)

    def move_samples(self, count: int) -> None:
        """Move `count` single samples by some centimetres."""
        for _ in range(_TRIES):
            if count <= 0:
                return
            marker, frame = (int(self.rng.integers(size)) for size in self.is_free.shape[::-1])
            if self.is_free[frame, marker]:
                direction = self.rng.normal(size=3)
                self.positions[frame, marker] += direction / np.linalg.norm(direction) * self.rng.uniform(
                    *_STRAY_DISTANCE)
                count -= 1
                self._add_fault("jump", (marker,), frame, frame + 1)

    def remove_labels(self, count: int) -> None:
        """Continue `count` stretches as `*1`, `*2` ... while the marker's own label is empty."""
        number = 0
        for _ in range(_TRIES):
            if number >= count:
                return
            marker = int(self.rng.integers(len(self.trial.labels)))
            start, stop = self._choose_stretch(self.rng.uniform(*_SWAP_SECONDS))
            if self.is_free[start:stop, marker].all():
                number += 1
                column = np.full((len(self.positions), 1, 3), np.nan)
                column[start:stop, 0] = self.positions[start:stop, marker]
                self.positions[start:stop, marker] = np.nan
                self.positions = np.concatenate([self.positions, column], axis=1)
                self.labels.append(f"*{number}")
                self._add_fault("unlabeled", (marker, len(self.labels) - 1), start, stop)

    def build_trial(self) -> tuple[MarkerTrial, tuple[Fault, ...]]:
        """Return the trial with its faults, and the faults in order of time."""
        trial = MarkerTrial(labels=tuple(self.labels), positions=self.positions, fps=self.trial.fps,
                            start=self.trial.start, name=self.trial.name, subject=self.trial.subject)
        return trial, tuple(sorted(self.added, key=lambda fault: (fault.start, fault.labels)))

    def _choose_stretch(self, seconds: float) -> tuple[int, int]:
        """Choose the frames of a stretch in the trial, not at its very ends."""
        length = min(max(int(round(seconds * self.trial.fps)), 1), max(len(self.positions) // 3, 1))
        start = int(self.rng.integers(1, max(len(self.positions) - length, 2)))
        return start, min(start + length, len(self.positions))

    def _add_fault(self, kind: str, markers, start: int, stop: int) -> None:
        """Store a fault, and exclude its stretch and some frames around it from further faults."""
        around = max(int(0.05 * self.trial.fps), 2)
        own = [marker for marker in markers if marker < self.is_free.shape[1]]
        self.is_free[max(start - around, 0) : stop + around, own] = False
        self.added.append(Fault(kind, tuple(self.labels[marker] for marker in markers), start, stop))


def mirror_trial(trial: MarkerTrial) -> MarkerTrial:
    """Mirror a trial as a left-handed system writes it: left and right of the room exchanged, labels unchanged."""
    return trial.with_positions(trial.positions * [1.0, -1.0, 1.0])


@dataclass(frozen=True)
class TrialError:
    """Error of a reconstruction.

    Attributes:
        centres: joint -> root mean square distance, m.
        angles: joint -> root mean square angle, rad, each segment's constant offset removed.
        raw: joint -> root mean square angle, rad, offsets included.
        worst_centre: m, 95th percentile over joints and frames.
    """

    centres: dict[str, float]
    angles: dict[str, float]
    raw: dict[str, float]
    worst_centre: float

    @property
    def centre(self) -> float:
        """Root mean square distance over all joints, m."""
        return _compute_rms(self.centres.values())

    @property
    def angle(self) -> float:
        """Root mean square angle over all joints, rad, offsets removed."""
        return _compute_rms(self.angles.values())

    @property
    def raw_angle(self) -> float:
        """Root mean square angle over all joints, rad, offsets included."""
        return _compute_rms(self.raw.values())


def measure_trial_error(known: SyntheticTrial, found: Motion) -> TrialError:
    """Measure how far a reconstruction is from the ground truth, frame by frame.

    Args:
        known: the trial and its ground truth.
        found: the reconstruction, on any skeleton whose joints have the template's names.
    Returns:
        The error.
    """
    true_places, true_turns = _index_by_name(known.motion)
    places, turns = _index_by_name(found)
    count = min(len(known.motion), len(found))
    distances = {
        joint: np.linalg.norm(places[joint][:count] - true_places[joint][:count], axis=1)
        for joint in CENTRES
        if joint in places and joint in true_places
    }
    known_joints = [joint for joint in ("Hips", *ABOVE) if joint in turns and joint in true_turns]
    aligned = {joint: _align_axes(turns[joint][:count], true_turns[joint][:count]) for joint in known_joints}
    pairs = [(joint, above) for joint, above in ABOVE.items() if joint in known_joints and above in known_joints]
    return TrialError(
        {joint: _compute_rms(distance) for joint, distance in distances.items()},
        {joint: _angle_error(aligned[joint], aligned[above], true_turns[joint][:count], true_turns[above][:count])
         for joint, above in pairs}, {joint: _angle_error(turns[joint][:count], turns[above][:count],
                                                          true_turns[joint][:count], true_turns[above][:count])
                                      for joint, above in pairs},
        float(np.percentile(np.stack(list(distances.values())), 95)) if distances else float("nan"),
    )


def _index_by_name(motion: Motion) -> tuple[dict, dict]:
    """Compute joint -> places (T, 3) and rotations (T, 4) in the world."""
    places, turns = forward_kinematics(motion)
    names = motion.skeleton.names
    return {n: places[:, i] for i, n in enumerate(names)}, {n: turns[:, i] for i, n in enumerate(names)}


def _align_axes(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Align the rotations (T, 4) of a segment with the true ones by the best constant offset."""
    offset = compute_mean_rotation(quaternion.to_matrix(quaternion.multiply(quaternion.inverse(true), found)))
    return quaternion.multiply(found, quaternion.inverse(quaternion.from_matrix(offset)))


def _angle_error(found, found_above, true, true_above) -> float:
    """Compute the root mean square angle between found and true joint rotations."""
    bend = quaternion.multiply(quaternion.inverse(found_above), found)
    true_bend = quaternion.multiply(quaternion.inverse(true_above), true)
    angle = quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(true_bend), bend))
    return _compute_rms(np.linalg.norm(angle, axis=1))


def _compute_rms(values) -> float:
    values = np.asarray(list(values), dtype=float)
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")
