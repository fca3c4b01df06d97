"""Gaps of joints under a second, bridged by `bodies` and in matches: how far bodies are from the true joints.

Recordings of LAFAN1, and players whom LAFAN1 shows along the dots of a match, become fifteen joints at RATE with NOISE.
Nothing of them is seen in gaps. The examples are the sample library, which has none of these people.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from benchmarks.places import DATA, SAMPLE
from beyond_mocap.files.bvh.bvh import read_bvh
from beyond_mocap.files.joints.joint_feed import JointFeed, PlayerJoints
from beyond_mocap.files.tracking.tracking import Match, read_match
from beyond_mocap.library.build import build_library
from beyond_mocap.library.library import Library
from beyond_mocap.match.known_bodies import build_known_bodies
from beyond_mocap.match.request import MatchRequest
from beyond_mocap.motion.humanoid import estimate_stature, identify_joints
from beyond_mocap.motion.motion import Motion, compute_pose, forward_kinematics
from beyond_mocap.motion.retargeting.neutral import scale_stance
from beyond_mocap.motion.skeleton import Skeleton
from beyond_mocap.motion.track import clean_track
from beyond_mocap.skeletal.joint_examples import COMPARED, read_examples
from beyond_mocap.skeletal.reconstruct_bodies import KnownElsewhere, reconstruct_bodies
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.synthesize import synthesize

RATE, NOISE = 50.0, 0.05  # frames per second; m, the root mean square distance in 3D
GAPS = (0.2, 0.4, 0.6, 0.8, 0.96)  # s
SHORTEST, LONGEST = 4.4, 7.0  # s of a recording, whose gap is in its middle
START, END, EVERY = 20.0, 60.0, 4.0  # s of the match, and from one gap to the next
_PARTS = {"hip": "upper_leg", "shoulder": "upper_arm", "knee": "lower_leg", "ankle": "foot", "elbow": "lower_arm",
          "wrist": "hand", "big_toe": "toe"}
NAMES = (*COMPARED, "left_big_toe", "right_big_toe", "nose")


def find_joints(places: np.ndarray, skeleton: Skeleton) -> np.ndarray:
    """Find the joints (T, 15, 3) m called NAMES among places (T, J, 3)."""
    body = identify_joints(skeleton)
    joints = places[:, [getattr(limb, role) for role in _PARTS.values() for limb in (body.left, body.right)]]
    across = np.cross(joints[:, 2] - joints[:, 3], (0.0, 0.0, 1.0))
    nose = places[:, body.head] + 0.1 * across / np.linalg.norm(across, axis=1, keepdims=True)
    return np.concatenate([joints, nose[:, None]], axis=1)


def sample_joints(motion: Motion) -> np.ndarray:
    """Sample the joints (T, 15, 3) m of a motion at RATE."""
    joints = find_joints(forward_kinematics(motion)[0], motion.skeleton)
    return CubicSpline(np.arange(len(joints)), joints)(np.arange(0.0, len(joints) - 1, motion.fps / RATE))


def read_recordings() -> dict[str, np.ndarray]:
    """Read the joints of recordings, LONGEST s of each at most."""
    found = {path.stem: sample_joints(read_bvh(path).motion)[: int(LONGEST * RATE)]
             for path in sorted((DATA / "mocap" / "lafan1").glob("*.bvh"))}
    return {name: joints for name, joints in found.items() if len(joints) >= SHORTEST * RATE}


def build_players(match: Match, place: Path) -> dict[str, np.ndarray]:
    """Build the joints of every third player from START to END s, who moves as LAFAN1 does."""
    library = build_library(DATA / "mocap" / "lafan1", cache_dir=place)
    tracks = {player.id: clean_track(match.track(player.id, START, END))[0] for player in match.players[::3]}
    return {name: sample_joints(synthesize(library, Plan(track=track, nearest=True)).motion)
            for name, track in tracks.items()}


def hide_joints(people: Mapping[str, np.ndarray], gap: float, every: float) -> tuple[JointFeed, dict[str, np.ndarray]]:
    """Hide joints (T, 15, 3) in the middle of every so many s: a feed with noise, and the hidden frames of each."""
    rng, seen, hidden = np.random.default_rng(5), [], {}
    for name, joints in people.items():
        times = np.arange(len(joints)) / RATE
        hidden[name] = np.abs(times % every - 0.5 * min(every, times[-1])) < 0.5 * gap - 1e-6
        noisy = joints + rng.normal(0.0, NOISE / np.sqrt(3.0), joints.shape)
        seen.append(PlayerJoints(id=name, team="", landmarks=NAMES, positions=noisy[~hidden[name]],
                                 times=START + times[~hidden[name]]))
    return JointFeed(tuple(seen), RATE, ()), hidden


def fit_alone(feed: JointFeed, library: Library) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Fit bodies as `bodies` does: id, times (T,) s and joints (T, 15, 3) of each."""
    for body in reconstruct_bodies(feed, known=KnownElsewhere(examples=read_examples(library)))[0]:
        places, _ = forward_kinematics(body.motion)
        yield (body.id, body.start + np.arange(len(places)) / body.motion.fps,
               find_joints(places, body.motion.skeleton))


def fit_in_match(feed: JointFeed, library: Library, match: Match) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Fit bodies as `match` does: id, times (T,) s and joints (T, 15, 3) of each."""
    request = MatchRequest(tracking=Path("dots"), library=library.folder, out=Path("out"))
    for name, player in build_known_bodies(feed, match, request, library, (START, END)).players.items():
        skeleton = scale_stance(library.neutral_stance, player.height / estimate_stature(library.skeleton)).skeleton
        for body in player.bodies:
            places, _ = compute_pose(skeleton, *body.pose)
            yield name, body.start + np.arange(len(body)) / body.fps, find_joints(places, skeleton)


def measure_distances(found: Iterator[tuple[str, np.ndarray, np.ndarray]], people: Mapping[str, np.ndarray],
                      hidden: Mapping[str, np.ndarray]) -> tuple[float, float]:
    """Measure the mean distance, cm, of twelve joints from the true ones: in gaps, and where they are seen."""
    inside, outside = [], []
    for name, times, joints in found:
        at, truth = (times - START) * RATE, people[name]
        true = CubicSpline(np.arange(len(truth)), truth)(np.clip(at, 0, len(truth) - 1))
        away = np.linalg.norm(joints - true, axis=2)[:, : len(COMPARED)].mean(axis=1)
        is_hidden = hidden[name][np.clip(np.rint(at).astype(int), 0, len(truth) - 1)]
        inside.append(away[is_hidden])
        outside.append(away[~is_hidden])
    return 100.0 * float(np.concatenate(inside).mean()), 100.0 * float(np.concatenate(outside).mean())


def section() -> list[str]:
    """Build the lines for results.md."""
    tracking = DATA / "tracking" / "match" / "dutch_6min.dat"
    if not tracking.is_file():
        return [f"{tracking} is missing; skipped"]
    with tempfile.TemporaryDirectory() as place:
        library = build_library(SAMPLE / "library", cache_dir=Path(place) / "sample")
        match = read_match(tracking, tracking.with_name("dutch_6min_meta.xml"))
        recordings, players = read_recordings(), build_players(match, Path(place) / "lafan1")
    roads = ((f"{len(recordings)} recordings, `bodies --library`", recordings, np.inf, fit_alone, ()),
             (f"{len(players)} players, `bodies --library`", players, EVERY, fit_alone, ()),
             (f"{len(players)} players, `match --joints`", players, EVERY, fit_in_match, (match,)))
    lines = [f"Joints hidden for so many seconds, {100 * NOISE:g} cm of noise at {RATE:g} Hz; mean distance of twelve "
             "joints from the true ones, cm.", "",
             f"| motion of LAFAN1 | {' | '.join(f'{gap:g} s' for gap in GAPS)} | seen |",
             f"|{'---|' * (len(GAPS) + 2)}"]
    for name, people, every, fit, others in roads:
        rows = []
        for gap in GAPS:
            feed, hidden = hide_joints(people, gap, every)
            rows.append(measure_distances(fit(feed, library, *others), people, hidden))
        lines.append(f"| {name} | {' | '.join(f'{row[0]:.1f}' for row in rows)} | {rows[-1][1]:.1f} |")
    return lines
