"""Bodies of all people of a skeletal feed: repaired, smoothed, fitted, with planted feet, and measured."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from itertools import takewhile

import numpy as np

from ..base.errors import InputError, UserCancelledError, format_count
from ..base.time_series import find_runs
from ..files.joints.joint_feed import JointFeed, PlayerJoints
from ..files.joints.landmarks import LANDMARKS
from ..library.repair import plant_contacts
from ..motion.contacts import detect_heel_toe_contacts
from ..motion.motion import Motion
from ..motion.retargeting.neutral import NeutralStance, build_neutral_stance
from ..motion.toe_roll import roll_toes
from .body_figures import measure_body
from .bridge_gaps import SHORTEST_GAP, bridge_gaps
from .fit_body import NEEDED, collect_joints, fit_body
from .joint_examples import COMPARED, JointExamples
from .measured_skeleton import build_measured_skeleton
from .repair_joints import repair_identities, repair_sides, spread_landmarks
from .smooth_joints import find_stretches, smooth_joints

SHORTEST = 0.5
"""Seconds; what is seen for a shorter time is no body."""
PLANTED_RATE = 25.0
"""Frames per second from which contacts are detected."""

_MIN_SHARE = 0.1  # of a stretch's frames in which a landmark has to be seen to count
_MOST_FRAMES = 2_000_000  # of one person


@dataclass(frozen=True, eq=False, kw_only=True)
class Body:
    """A stretch of one person.

    Attributes:
        id: of the person, as the feed spells it.
        team: "home", "away" or "".
        start: seconds of the first frame on the feed's clock.
        motion: world, Z up, at the feed's rate.
        joints: (T, 3) m by name, smoothed and without gaps, to which it is fitted (`fit_body`).
        landmarks: L names of the joints that were seen.
        seen: (T, L, 3) m, these joints, repaired and not smoothed; NaN where not seen.
    """

    id: str
    team: str
    start: float
    motion: Motion
    joints: dict[str, np.ndarray]
    landmarks: tuple[str, ...]
    seen: np.ndarray

    def measure(self) -> dict:
        """Measure how near the body is to the joints (`measure_body`)."""
        return measure_body(self.landmarks, self.seen, self.motion)


@dataclass(frozen=True, eq=False, kw_only=True)
class KnownElsewhere:
    """What is known of people where none of their joints is seen.

    Attributes:
        examples: how people move (`read_examples`); None: only as the person does beside the gap.
        path_of: tells where another tracking has a person, by id, at times (T,) s: (T, 2) m, NaN where it does not.
    """

    examples: JointExamples | None = None
    path_of: Callable[[str, np.ndarray], np.ndarray] | None = None


def reconstruct_bodies(feed: JointFeed, progress: Callable[[float, str], None] | None = None,
                       cancelled: Callable[[], bool] | None = None, ids: Collection[str] | None = None,
                       known: KnownElsewhere = KnownElsewhere()) -> tuple[list[Body], list[str]]:
    """Reconstruct the bodies of all people of a feed.

    Args:
        feed: the joints.
        progress: called with the share that is done and a text.
        cancelled: returns True when the user stops the job.
        ids: people whose bodies are wanted; None: all. All count where two are exchanged.
        known: what is known of people where no joint is seen.
    Returns:
        The bodies, a stretch without a gap over a second each, and notes on what was repaired or left out.
    Raises:
        InputError: if a person's times span too many frames.
        UserCancelledError: if the user stops the job.
    """
    begin, people, notes = _repair_feed(feed)
    bodies: list[Body] = []
    for number, (person, (first, positions)) in enumerate(zip(feed.people, people)):
        if ids is not None and person.id not in ids:
            continue
        if cancelled is not None and cancelled():
            raise UserCancelledError("bodies: cancelled")
        if progress is not None:
            progress(number / len(people), f"Fitting {person.id}")
        found, lines = _reconstruct_person(person, begin + first / feed.fps, positions, feed.fps, known)
        bodies += found
        notes += lines
    return bodies, notes


def _repair_feed(feed: JointFeed) -> tuple[float, list[tuple[int, np.ndarray]], list[str]]:
    """Return the feed's first second, for each person the first frame from there on and repaired positions
    (T, LANDMARKS, 3), and notes.
    """
    begin = min(person.times[0] for person in feed.people)
    grids = [_lay_on_clock(person, begin, feed.fps) for person in feed.people]
    first, last = min(one for one, _ in grids), max(one + len(positions) for one, positions in grids)
    together = np.full((len(grids), last - first, len(LANDMARKS), 3), np.nan)
    for number, (one, positions) in enumerate(grids):
        together[number, one - first : one - first + len(positions)] = positions
    together, swaps = repair_identities(together)
    notes = [f"{(frame + first) / feed.fps + begin:.2f} s: {feed.people[one].id} and {feed.people[other].id} exchanged "
             "from here on, each leaps to where the other was" for frame, one, other in swaps]
    out = []
    for person, positions in zip(feed.people, together):
        positions, exchanged = repair_sides(LANDMARKS, positions)
        if exchanged:
            notes.append(f"{person.id}: left and right exchanged in {format_count(exchanged, 'frame')}")
        out.append((first, positions))
    return begin, out, notes


def _lay_on_clock(person: PlayerJoints, begin: float, fps: float) -> tuple[int, np.ndarray]:
    """Lay a person's samples on the feed's frames; return the first of them and positions (T, LANDMARKS, 3)."""
    frames = np.round((person.times - begin) * fps).astype(int)
    count = int(frames[-1] - frames[0] + 1)
    if count > _MOST_FRAMES:
        raise InputError(f"joints of {person.id}", f"{count:,} frames", f"{_MOST_FRAMES:,} at most",
                         "divide the file, or check its times")
    positions = np.full((count, len(LANDMARKS), 3), np.nan)
    positions[frames - frames[0]] = spread_landmarks(person.landmarks, person.positions)
    return int(frames[0]), positions


def _reconstruct_person(person: PlayerJoints, first: float, positions: np.ndarray, fps: float,
                        known: KnownElsewhere) -> tuple[list[Body], list[str]]:
    """Reconstruct the stretches of one person, and tell which were left out."""
    shown = np.flatnonzero(_find_shown(positions))
    bodies, notes = [], []
    for start, end in find_stretches(shown / fps, fps):
        begin, stop = int(shown[start]), int(shown[end - 1]) + 1
        part = positions[begin:stop]
        seconds = first + begin / fps
        missing = [name for name in NEEDED if _measure_share(part, LANDMARKS.index(name)) < _MIN_SHARE]
        if missing or len(part) < SHORTEST * fps:
            why = f"{missing[0].replace('_', ' ')} is hardly seen" if missing else f"only {len(part) / fps:.2f} s"
            notes.append(f"{person.id}: from {seconds:.2f} s left out, {why}")
            continue
        bodies.append(_reconstruct_stretch(person, seconds, part, fps, known))
    return bodies, notes


def _find_shown(positions: np.ndarray) -> np.ndarray:
    """Find the frames (T,) bool that show enough of a body."""
    return np.isfinite(positions).all(axis=2).sum(axis=1) >= len(NEEDED) // 2


def fit_planted_body(joints: dict[str, np.ndarray], fps: float, stance: NeutralStance) -> Motion:
    """Fit a body whose feet are planted where they are in contact, and whose toes bend where they would dig in.

    Args:
        joints: as for `fit_body`.
        fps: frames per second; below PLANTED_RATE contacts cannot be found, and feet are not planted.
        stance: of the skeleton.
    Returns:
        The motion.
    """
    motion = fit_body(joints, fps, stance)
    if fps >= PLANTED_RATE:
        motion = plant_contacts(motion, detect_heel_toe_contacts(motion))
    return replace(motion, rotations=roll_toes(stance, motion.root_positions, motion.rotations))


def _measure_share(positions: np.ndarray, landmark: int) -> float:
    """Measure the share of frames in which a landmark is seen."""
    return float(np.isfinite(positions[:, landmark]).all(axis=1).mean())


def _reconstruct_stretch(person: PlayerJoints, seconds: float, seen: np.ndarray, fps: float,
                         known: KnownElsewhere) -> Body:
    """Fit and plant one stretch (T, LANDMARKS, 3)."""
    used = [number for number in range(len(LANDMARKS)) if _measure_share(seen, number) >= _MIN_SHARE]
    names = tuple(LANDMARKS[number] for number in used)
    path = None if known.path_of is None else known.path_of(person.id, seconds + np.arange(len(seen)) / fps)
    joints = collect_joints(names, _smooth_and_bridge(names, seen[:, used], fps, known.examples, path))
    motion = fit_planted_body(joints, fps, build_neutral_stance(build_measured_skeleton(joints)))
    return Body(id=person.id, team=person.team, start=seconds, motion=motion, joints=joints, landmarks=names,
                seen=seen[:, used])


def _smooth_and_bridge(names: tuple[str, ...], seen: np.ndarray, fps: float, examples: JointExamples | None,
                       path: np.ndarray | None) -> np.ndarray:
    """Smooth joints (T, L, 3) m, and bridge the gaps in which nothing is seen."""
    smooth, hidden = smooth_joints(names, seen), ~_find_shown(seen)
    if not any(end - first >= SHORTEST_GAP * fps for first, end in find_runs(hidden)):
        return smooth
    columns = [names.index(name) for name in takewhile(names.__contains__, COMPARED)]
    columns = columns[: len(columns) // 2 * 2]  # of both sides
    bridged = seen.copy()
    bridged[np.ix_(hidden, np.array(columns))] = bridge_gaps(smooth[:, columns], hidden, fps, examples, path)[hidden]
    return smooth_joints(names, bridged)
