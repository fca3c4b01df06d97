"""Feet of which only the ankle is seen: how far their pitch and direction are off in recordings of LAFAN1."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.joint_gaps import NAMES, RATE, find_joints, hide_joints, read_recordings
from benchmarks.places import DATA
from beyond_mocap.base.vectors import arctan2
from beyond_mocap.files.joints.joint_feed import JointFeed, PlayerJoints
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.skeletal.reconstruct_bodies import reconstruct_bodies

ANKLES, TOES = [6, 7], [12, 13]  # columns of NAMES
LEAST_SPEED = 0.5  # m/s of a hip, on average, of recordings that count
SUNK = -0.01  # m, height of a toe joint that is in the ground


def fit_without_toes(person: PlayerJoints) -> np.ndarray:
    """Fit a body to joints whose toes are hidden: its joints (T, 15, 3) m."""
    kept = [number for number, name in enumerate(NAMES) if "toe" not in name]
    without = replace(person, landmarks=tuple(NAMES[number] for number in kept), positions=person.positions[:, kept])
    (body,), _ = reconstruct_bodies(JointFeed((without,), RATE, ()))
    return find_joints(forward_kinematics(body.motion)[0], body.motion.skeleton)


def find_feet(joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find pitch and direction (T, 2) rad of feet of joints (T, 15, 3)."""
    ahead = joints[:, TOES] - joints[:, ANKLES]
    return arctan2(ahead[..., 2], np.hypot(ahead[..., 0], ahead[..., 1])), arctan2(ahead[..., 1], ahead[..., 0])


def compare_feet(joints: np.ndarray, truth: np.ndarray) -> tuple[float, float, float]:
    """Compare feet with the true ones, steady differences of the skeletons aside: how far their pitch is off, their
    direction where the true foot is no steeper than 45 degrees, both in degrees; and the share of toe joints that are
    in the ground.
    """
    (pitch, way), (true, true_way) = find_feet(joints), find_feet(truth)
    off, turn = (one - np.median(one, axis=0) for one in (pitch - true, quaternion.wrap_angle(way - true_way)))
    level = np.abs(true) < np.radians(45.0)
    return (float(np.degrees(np.abs(off).mean())), float(np.degrees(np.abs(turn[level]).mean())),
            float((joints[:, TOES, 2] < SUNK).mean()))


def section() -> list[str]:
    """Build the lines for results.md."""
    if not (DATA / "mocap" / "lafan1").is_dir():
        return [f"{DATA / 'mocap' / 'lafan1'} is missing; skipped"]
    people = {name: joints for name, joints in read_recordings().items()
              if np.linalg.norm(np.diff(joints[:, 0, :2], axis=0), axis=1).mean() * RATE > LEAST_SPEED}
    feed, _ = hide_joints(people, 0.0, np.inf)
    rows = np.array([compare_feet(fit_without_toes(person), people[person.id]) for person in feed.people])
    pitch, direction, sunk = rows.mean(axis=0)
    return [f"{len(people)} recordings of LAFAN1 that move on, as joints without toes.", "",
            "| pitch off, degrees | direction off | toe joints more than 1 cm in the ground |", "|---|---|---|",
            f"| {pitch:.1f} | {direction:.1f} | {100 * sunk:.1f} % |"]
