"""Everybody of a made match together: who is in whom, what keeping them apart costs, and who is in step with whom.

Overlaps, skate and jerk stand without and with the corrections; the share in step is that of the time of all players.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from benchmarks.effort import seconds
from benchmarks.places import CMU_UNIT, DATA
from beyond_mocap.library.build import build
from beyond_mocap.library.library import Library
from beyond_mocap.match.crowd.correction import ARMS, ROOT, Correction, applied
from beyond_mocap.match.crowd.crowd import kept_apart, overlap_depths
from beyond_mocap.match.crowd.variety import share_in_step
from beyond_mocap.match.expand import expanded
from beyond_mocap.match.make import make_match
from beyond_mocap.match.order import MatchOrder
from beyond_mocap.match.take_npz import read_player
from beyond_mocap.motion.motion import Motion, forward_kinematics
from beyond_mocap.synthesis.quality.movement import contact_speeds, foot_joints, jerk
from beyond_mocap.synthesis.take import Take

SECONDS = (1480.0, 1500.0)
"""Of the recorded half: players stand close together, so that there is something to keep apart."""


def step_share(library: Library, takes: list[Take], firsts: list[int]) -> float:
    """Share of the time of all players in which they are in step with a neighbour."""
    start, fps = min(firsts), takes[0].motion.fps
    count = max(first + len(take.motion) for first, take in zip(firsts, takes)) - start
    rates = {clip.path: clip.motion.fps for clip in library.extended.clips}
    names: dict[tuple[str, bool], int] = {}
    shown, ages = np.full((len(takes), count), -1), np.zeros((len(takes), count))
    places = np.zeros((len(takes), count, 2))
    for row, (take, first) in enumerate(zip(takes, firsts)):
        here = slice(first - start, first - start + len(take.motion))
        what = [(take.clips[clip], bool(mirrored)) for clip, mirrored in zip(take.clip, take.mirrored)]
        shown[row, here] = [names.setdefault(each, len(names)) for each in what]
        ages[row, here] = take.clip_frame / np.array([rates.get(path, fps) for path, _ in what])
        places[row, here] = take.motion.root_positions[:, :2]
    return share_in_step(shown, ages, places)


def figures(motions: list[Motion], contacts: list[np.ndarray], firsts: list[int]) -> str:
    """One line on overlaps, skate and jerk."""
    depth, fps = np.concatenate(overlap_depths(motions, firsts)), motions[0].fps
    joints = [forward_kinematics(motion)[0] for motion in motions]
    skate = np.concatenate([
        contact_speeds(places[:, foot_joints(motion.skeleton)], stands, fps).ravel()
        for motion, places, stands in zip(motions, joints, contacts)
    ])
    hard = np.concatenate([jerk(places, fps) for places in joints])
    return (
        f"deepest {100 * depth.max():.1f} cm, {np.sum(depth > 0.02) / fps:.1f} player seconds deeper than 2 cm of "
        f"{len(depth) / fps:.0f}; skate {100 * np.nanmean(skate):.2f} cm/s; jerk p95 {np.percentile(hard, 95):.0f}, "
        f"max {hard.max():.0f} m/s^3"
    )


def what_is_changed(corrections: list[Correction], takes: list[Take], firsts: list[int]) -> str:
    """One line on how far roots and arms are moved, and how often."""
    curves = np.concatenate([own.curves(at, len(take.motion)) for own, take, at in zip(corrections, takes, firsts)])
    root, arms = np.linalg.norm(curves[:, ROOT], axis=1), np.linalg.norm(curves[:, ARMS].reshape(-1, 2, 3), axis=2)
    knots = sum(len(own.knots) for own in corrections)
    return (
        f"changed {100 * curves.any(axis=1).mean():.1f}% of the time: roots by {100 * root.max():.1f} cm at most, arms "
        f"by {np.degrees(arms.max()):.0f} degrees; {knots} knots, {knots * 32 / 1024:.0f} KiB"
    )


def section() -> list[str]:
    """Lines for results.md: SECONDS of a recorded half, made and measured."""
    with tempfile.TemporaryDirectory() as place:
        folder, cache, recordings = Path(place) / "match", Path(place) / "cache", DATA / "mocap" / "cmu10"
        order = MatchOrder(
            DATA / "tracking" / "match" / "nl2019_half1.dat", recordings, folder, cache=cache, unit=CMU_UNIT,
            start=SECONDS[0], end=SECONDS[1], figures=False,
        )  # fmt: skip
        took, result = seconds(lambda: make_match(order), 1)
        library = build(recordings, unit=CMU_UNIT, cache_dir=cache)
        made = f"- {len(result.done)} players made in {took:.1f} s of processor time, {len(result.failed)} failed"
        return [made, *(f"- {line}" for line in crowd_lines(folder, library))]


def crowd_lines(folder: Path, library: Library) -> list[str]:
    """What a made folder shows of everybody together, without and with its corrections."""
    edits = [read_player(path) for path in sorted(folder.glob("*.take.npz"))]
    pairs = [(take, edit) for edit in edits for take in expanded(library, edit, *SECONDS)]
    takes, fps = [take for take, _ in pairs], pairs[0][0].motion.fps
    firsts, contacts = [round(take.start_time * fps) for take in takes], [take.contacts for take in takes]
    motions = [take.motion for take in takes]
    kept = [edit.correction or Correction.none(fps) for _, edit in pairs]
    corrected = [applied(*each) for each in zip(motions, kept, firsts)]
    took, _ = seconds(lambda: kept_apart(motions, contacts, firsts, fps), 1)
    return [
        f"{len(takes)} takes; in step {100 * step_share(library, takes, firsts):.2f}%",
        f"without corrections: {figures(motions, contacts, firsts)}",
        f"with them: {figures(corrected, contacts, firsts)}",
        what_is_changed(kept, takes, firsts), f"kept apart anew in {took:.1f} s of processor time",
    ]
