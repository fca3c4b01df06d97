"""Markers planted on a known motion: a trial whose answer is known, for tests, benchmarks and the samples.

    clip = bvh.read("walk.bvh").motion
    known = planted(clip, "plug_in_gait", seed=1, occlusion=0.05)
    known.trial, known.static      what a laboratory would hand over
    known.motion, known.centres    what is to be found again
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ...base.errors import InputError
from ...markers.trial import MarkerTrial
from ...motion.motion import Motion, forward_kinematics
from .planted_ball import BallTruth, PlantedBall, planted_ball
from .planted_body import calibration_pose, in_marker_axes
from .planted_faults import Fault, Faults
from .planted_places import SETS, STATIC_ONLY, Placed, placed
from .planted_skin import on_skin

_STATIC_SECONDS, _STATIC_FPS = 3.0, 100.0


@dataclass(frozen=True, eq=False)
class Planted:
    """A trial and its truth.

    trial, static: as recorded, the static one of the same body with the same markers. motion: the true motion, joints
    named and turned as in marker models (`planted_body`). centres: (T, J, 3) metres, its joints. pose: the true motion
    of the static trial. markers: where they lie on the bones. clean: (T, M, 3) metres, where the trial's markers truly
    were, skin and noise in them but no faults. faults: what was done to the trial. ball: where one was asked for, the
    ball in the hand and in flight; its marker stands last among the trial's named ones.
    """

    trial: MarkerTrial
    static: MarkerTrial
    motion: Motion
    centres: np.ndarray
    pose: Motion
    markers: Placed
    clean: np.ndarray
    faults: tuple[Fault, ...]
    ball: BallTruth | None = None

    def centre(self, joint: str) -> np.ndarray:
        """Where a joint truly is: (T, 3) metres."""
        return self.centres[:, self.motion.skeleton.index(joint)]

    @property
    def segments(self) -> dict[str, str]:
        """Which joint carries each marker."""
        names = self.motion.skeleton.names
        return {label: names[joint] for label, joint in zip(self.markers.labels, self.markers.joint)}


def planted(
    motion: Motion,
    marker_set: str | tuple[str, ...] = "plug_in_gait",
    seed: int = 0,
    *,
    noise: float = 0.0005,
    softness: float = 1.0,
    occlusion: float = 0.0,
    swaps: int = 0,
    jumps: int = 0,
    unlabeled: int = 0,
    ball: PlantedBall | None = None,
) -> Planted:
    """Markers on any humanoid `motion`, and a static trial of the same body.

    marker_set: one of `planted_places.SETS`, or labels. noise: metres of the cameras' scatter in each coordinate (sd).
    softness: factor on what skin does (1: 10 to 15 mm on a moving thigh, 0: markers on bone). occlusion: share of the
    samples that are hidden. swaps, jumps, unlabeled: how many of each. ball: one in a hand, thrown. InputError for an
    unknown set, or a body without legs.
    """
    truth = in_marker_axes(motion)
    labels = _labels(marker_set)
    markers = placed(truth.skeleton, labels, seed)
    pose = calibration_pose(truth.skeleton, _STATIC_SECONDS, _STATIC_FPS, seed + 1)
    neutral = pose.rotations[0]
    rng = np.random.default_rng(seed + 2)
    seen = on_skin(truth, markers, neutral, seed + 3, softness)
    seen = seen + rng.normal(0.0, noise, seen.shape)
    stood = on_skin(pose, markers, neutral, seed + 3, softness)
    stood = stood + rng.normal(0.0, noise, stood.shape)
    gone = STATIC_ONLY.get(marker_set, ()) if isinstance(marker_set, str) else ()
    kept = [i for i, label in enumerate(markers.labels) if label not in gone]
    labels, clean = tuple(markers.labels[i] for i in kept), seen[:, kept]
    thrown = planted_ball(truth, ball) if ball else None
    if thrown:
        labels, clean = (*labels, ball.label), np.concatenate([clean, _seen_ball(thrown, truth, noise, rng)], axis=1)
    trial = MarkerTrial(labels, clean, motion.fps, name="planted")
    faults = Faults(trial, seed + 4)
    faults.swap(_exchangeable(markers, trial.labels), swaps)
    faults.unlabel(unlabeled)
    faults.stray(jumps)
    faults.occlude(occlusion)
    spoiled, done = faults.faulty()
    static = MarkerTrial(markers.labels, stood, pose.fps, name="planted static")
    return Planted(spoiled, static, truth, forward_kinematics(truth)[0], pose, markers, clean, done, thrown)


def _seen_ball(ball: BallTruth, truth: Motion, noise: float, rng: np.random.Generator) -> np.ndarray:
    """The ball's marker as cameras see it: (T, 1, 3) metres, NaN once it is out of their sight."""
    seen = ball.marker + rng.normal(0.0, noise, ball.marker.shape)
    gone = np.arange(len(truth)) / truth.fps > ball.asked.release + ball.asked.seen
    return np.where(gone[:, None], np.nan, seen)[:, None]


def _labels(marker_set: str | tuple[str, ...]) -> tuple[str, ...]:
    if not isinstance(marker_set, str):
        return tuple(marker_set)
    if marker_set not in SETS:
        raise InputError("planted markers", f"marker set {marker_set!r}", f"one of {', '.join(SETS)}, or labels")
    return SETS[marker_set]


def _exchangeable(markers: Placed, labels: tuple[str, ...]) -> list[tuple[str, str]]:
    """Pairs that recordings confuse: two of one segment, or the same marker on the left and on the right."""
    joint = dict(zip(markers.labels, markers.joint))
    labels = tuple(label for label in labels if label in joint)
    pairs = [two for two in combinations(labels, 2) if joint[two[0]] == joint[two[1]]]
    twins = [(label, "R" + label[1:]) for label in labels if label[0] == "L" and "R" + label[1:] in labels]
    return sorted({*pairs, *twins})
