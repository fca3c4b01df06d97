"""Synthetic clips that complete the recordings: speeds between and above them, stands, steps and kicks on the run.

Tracked players move at any speed up to 9 m/s; recordings leave gaps (../shared/data/README.md). A clip played at 0.875
to 1.125 of its rate covers some speeds around its own; a speed that too few seconds reach that way is in a gap.

Between two recordings a gap is filled by blending both in phase (`motion.phase_blend`, Faustino §6.2). This holds
between a walk and a run, too: judged by eye and figures, such a mixture at 1.7 to 2.3 m/s is a brisk walk with a
spring, then a shuffling jog, with flight coming in gradually (7 % at 1.7 m/s, 32 % at 2.3 m/s), in the actors' own
style, and closer to their poses than a synthetic walk or jog.

Above the recordings `synthetic.gait` generates running at any speed from published figures, with the skeleton's own
upright stance and the recorded runners' elbows and lean: long runs that slowly gain and lose speed, so that few cuts
are needed, quick ones, and weaving ones. The fastest recording played faster with stretched strides would keep the
figures and lose the look: knees pop, the body floats.

Where all recordings run, or all walk slower, it generates walking the same way, and where no clip stands calmly a
stand: a run that is shortened to a walk's steps hops on the spot.

Recorded kicks are seldom faster than a jog; moved along at 8 m/s the kicker's plant foot slides by metres.
`synthetic.recorded_kicks` generates them on the run at the missing speeds; they substitute for recorded ones that
answer by the same labels. What only some takes ask for, receptions among it, is built when they do (`missing_actions`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..annotation import LOCOMOTION, ClipAnnotation, compute_gait_thresholds
from ..annotation.gaits import STANDING, TURNING
from ..base.time_series import find_equal_runs
from ..base.vectors import arctan2, cross_product
from ..motion import contacts, quaternion
from ..motion.foot_plant import plant_feet
from ..motion.humanoid import compute_heading_from_positions, identify_joints
from ..motion.motion import Motion, forward_kinematics, sample_frames
from ..motion.phase_blend import Strides, blend_strides, find_strides
from ..synthetic.gait import build_gait
from ..synthetic.gait_plan import GaitStyle
from ..synthetic.recorded_kicks import RunningKick, iter_running_kicks
from .clip import (
    BACK_PREFIX,
    BLEND_PREFIX,
    KICK_PREFIX,
    LOOP_PREFIX,
    STAND_PREFIX,
    STEP_PREFIX,
    STILL_PREFIX,
    SYNTHETIC_FOLDER,
    SYNTHETIC_FPS,
    TURN_PREFIX,
    WALK_PREFIX,
)
from .coverage import MAX_SPEED, MIN_SPEED_SECONDS, Coverage, select_locomotion
from .features import Frames
from .keys import KICK_STEP, measure_kick_speed
from .loops.run_loops import LOOP_SECONDS, iter_run_loops
from .loops.standing_loops import LOOP_SECONDS as STAND_SECONDS
from .loops.standing_loops import iter_standing_loops
from .missing_steps import iter_missing_steps

_MIN_RUN_SPEED = 2.4  # m/s, lowest speed of synthetic running; blends cover slower speeds
# ratios of neighbouring speeds of blends, and of runs at an even speed
_BLEND_STEP, _EVEN_STEP = 1.06, 1.1
_PAIRS = 3  # pairs of recordings blended into each gap, at most
_MAX_SPEED_SPREAD = 0.15  # standard deviation of a steady stretch's speed, share of its mean
_GAITS = LOCOMOTION[1:]
# m/s of gaits without a recording, faster and slower than the recorded ones
_FASTER_SPEEDS = {"running": 4.6, "sprinting": 7.3}
_SLOWER_SPEEDS = {"walking": 1.2, "jogging": 2.7}
_WALK_STEP, _WALK_SECONDS = 1.25, 5.0  # ratio of neighbouring speeds of walks, and their length
# radians by which a runner's elbow and lean differ from the default, at most
_MAX_STYLE = np.array([0.35, 0.10])
# m/s below which a point of a foot is still
_STILL_SPEED = 0.18


@dataclass(frozen=True, eq=False)
class SyntheticClip:
    """A synthetic clip.

    Attributes:
        name: its path below the library's folder.
        motion: T frames.
        rows: its annotations.
        heel_toe_contacts: (T, 2, 2) bool, left and right, heel and toe in contact.
    """

    name: str
    motion: Motion
    rows: tuple[ClipAnnotation, ...]
    heel_toe_contacts: np.ndarray


class GaitBands(NamedTuple):
    """Which gait a speed has.

    Attributes:
        words: of G gaits, from slow to fast.
        thresholds: (G-1,) m/s from each to the next faster one.
    """

    words: tuple[str, ...]
    thresholds: np.ndarray


def complete_gaits(speeds: dict[str, float], thresholds: np.ndarray) -> GaitBands:
    """Complete the recorded gaits by slower and faster ones.

    Between recorded gaits stand the recordings' own thresholds: clips that walk where recordings walk must not be
    called jogs, or they would draw the speed from which tracks are annotated as jogs down to theirs.

    Args:
        speeds: m/s of the G recorded gaits, from slow to fast.
        thresholds: (G-1,) m/s between them, see `annotation.estimate_gait_thresholds`.
    """
    slowest, fastest = min(speeds.values()), max(speeds.values())
    slower = {word: speed for word, speed in _SLOWER_SPEEDS.items() if word not in speeds and speed < slowest}
    faster = {word: speed for word, speed in _FASTER_SPEEDS.items() if word not in speeds and speed > fastest}
    known = {**slower, **speeds, **faster}
    completed = compute_gait_thresholds(np.array(list(known.values())))
    completed[len(slower) : len(slower) + len(thresholds)] = thresholds
    return GaitBands(tuple(known), completed)


def iter_synthetic_clips(
    clips: Sequence, frames: Frames, fps: float, gaits: GaitBands, keys: Sequence, strangeness: np.ndarray,
    coverage: Coverage,
) -> Iterator[SyntheticClip]:
    """Iterate over all synthetic clips of a library.

    Args:
        clips: its recordings.
        frames: their description.
        fps: of the frames.
        gaits: which gait a speed has, see `complete_gaits`.
        keys: the recordings' key moments.
        strangeness: (N,) how far each frame lies from normal locomotion (`posture`).
        coverage: what the recordings lack.
    Yields:
        Clips whose names begin with SYNTHETIC_FOLDER: they are stored beside the cache.
    """
    example = sample_upright_example(clips)
    style = estimate_runner_style(clips, frames, example)
    for low, high in coverage.speed_gaps:
        blends = list(_iter_blends(clips, frames, fps, low=low, high=high, gaits=gaits))
        yield from blends or _iter_walks(low, min(high, _MIN_RUN_SPEED), example, gaits)
        yield from _iter_runs(max(0.93 * low, _MIN_RUN_SPEED), min(1.05 * high, MAX_SPEED), example, style, gaits)
    fastest = measure_kick_speed(frames, clips, keys)
    for kick in iter_running_kicks(clips, keys, KICK_STEP * fastest, example, style):
        yield _build_kick_clip(kick, gaits)
    stands = [(STAND_PREFIX, motion)
              for _, motion in iter_standing_loops(clips, frames, fps, strangeness, SYNTHETIC_FPS)]
    if not coverage.has_stand:
        stands = [(STILL_PREFIX, build_gait(0.0, STAND_SECONDS, SYNTHETIC_FPS, example.skeleton, example=example))]
    for number, (prefix, motion) in enumerate(stands):
        row = ClipAnnotation(0, len(motion) - 1, None, (STANDING,))
        contacts = np.ones((len(motion), 2, 2), bool)
        yield SyntheticClip(f"{SYNTHETIC_FOLDER}{prefix}{number + 1}.bvh", motion, (row,), contacts)
    is_run = select_locomotion(frames, clips) & (strangeness <= 1.0)
    for speed, motion, contacts in iter_run_loops(clips, frames, fps, is_run, SYNTHETIC_FPS):
        rows = _build_gait_rows(np.full(len(motion), speed), gaits)
        yield _ground_clip(f"{SYNTHETIC_FOLDER}{LOOP_PREFIX}{speed:.2f}.bvh", motion, contacts, rows, plants_feet=True)
    for name, motion, heel_toe_contacts, speed in iter_missing_steps(
        clips, frames, fps, strangeness, coverage=coverage, example=example, rate=SYNTHETIC_FPS
    ):
        rows = _build_step_rows(name, len(motion), speed, gaits)
        yield _ground_clip(f"{SYNTHETIC_FOLDER}{name}.bvh", motion, heel_toe_contacts, rows)


def sample_upright_example(clips: Sequence) -> Motion:
    """Sample all recordings, one frame a second, as an example of how this skeleton stands.

    `motion.retargeting.neutral` uses the most upright of them. A single recording of a run leans, and synthetic running
    would lean twice.
    """
    return sample_each_second(clip.motion for clip in clips
                              if not clip.mirrored and not clip.is_t_pose)


def sample_each_second(motions: Iterable[Motion]) -> Motion:
    """Sample motions of one skeleton, a frame each second, as one motion."""
    parts = []
    for motion in motions:
        parts.append(sample_frames(motion, np.arange(0.0, len(motion), motion.fps)))
        skeleton = motion.skeleton
    root, rotations = (np.concatenate(column) for column in zip(*parts))
    return Motion(skeleton, root, rotations, 1.0)


def estimate_runner_style(clips: Sequence, frames: Frames, example: Motion) -> GaitStyle:
    """Estimate how far the recorded runners bend their elbows and lean, compared with a synthetic one at their mean
    speed.

    Returns:
        The style; the default one where no clip runs.
    """
    rows = np.flatnonzero(select_locomotion(frames, clips) & (frames.speed > _MIN_RUN_SPEED))
    if len(rows) < MIN_SPEED_SECONDS * 30.0:
        return GaitStyle()
    rows = rows[np.linspace(0, len(rows) - 1, 60).astype(int)]
    samples = [sample_frames(clips[frames.clip[row]].motion, frames.source[row : row + 1]) for row in rows]
    root, rotations = (np.concatenate(column) for column in zip(*samples))
    recorded = Motion(example.skeleton, root, rotations, 30.0)
    synthetic = build_gait(min(float(frames.speed[rows].mean()), MAX_SPEED), 1.5, 30.0, example.skeleton,
                           example=example)
    elbow, lean = np.clip(_measure_elbow_and_lean(recorded) - _measure_elbow_and_lean(synthetic), -_MAX_STYLE,
                          _MAX_STYLE)
    return GaitStyle(elbow=float(elbow), lean=float(lean))


def _measure_elbow_and_lean(motion: Motion) -> np.ndarray:
    """Measure (2,) radians, means over all frames: flexion of both elbows, and the trunk's forward lean."""
    body = identify_joints(motion.skeleton)
    places, _ = forward_kinematics(motion)
    bends = [
        _measure_angles(places[:, arm.lower_arm] - places[:, arm.upper_arm], places[:, arm.hand]
                        - places[:, arm.lower_arm]) for arm in (body.left, body.right)
        if None not in (arm.upper_arm, arm.lower_arm, arm.hand)
    ]
    facing = compute_heading_from_positions(motion.skeleton, places)
    trunk = places[:, body.neck_or_chest] - places[:, body.hips]
    lean = arctan2(quaternion.rotate_level(trunk[:, :2], -facing)[:, 0], trunk[:, 2])
    return np.array([np.mean(bends) if bends else 0.0, np.mean(lean)])


def _measure_angles(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Measure the angles (T,) in radians between vectors (T, 3)."""
    return arctan2(np.linalg.norm(cross_product(a, b), axis=1), np.sum(a * b, axis=1))


def _iter_blends(clips, frames: Frames, fps: float, low: float, high: float,
                 gaits: GaitBands) -> Iterator[SyntheticClip]:
    """Iterate over blends of the nearest steady recordings below and above a gap; none where one side is missing."""
    slow, fast = _find_neighbours(clips, frames, fps, low, high)
    if not slow or not fast:
        return
    top = min(high, max(one.speed for one in fast))
    count = max(1, int(np.ceil(np.log(top / low) / np.log(_BLEND_STEP))))
    for number, speed in enumerate(low * (top / low) ** ((np.arange(count) + 0.5) / count)):
        pair = slow[number % len(slow)], fast[number % len(fast)]
        motion, contacts = blend_strides(*pair, float(speed), SYNTHETIC_FPS)
        rows = _build_gait_rows(np.full(len(motion), speed), gaits)
        yield _ground_clip(f"{SYNTHETIC_FOLDER}{BLEND_PREFIX}{speed:.2f}.bvh", motion, contacts, rows, plants_feet=True)


def _find_neighbours(clips, frames: Frames, fps: float, low: float, high: float) -> tuple[list[Strides], list[Strides]]:
    """Find steady straight stretches of forward locomotion below and above a gap, nearest in speed first."""
    slow: list[tuple[float, int, ClipAnnotation]] = []
    fast: list[tuple[float, int, ClipAnnotation]] = []
    for index, clip in enumerate(clips):
        for row in () if clip.mirrored or clip.is_synthetic else clip.annotations:
            if row.key is not None or not set(row.words) & set(_GAITS) or _has_action(clip, row):
                continue
            rate = fps / clip.motion.fps
            last = min(int(row.end * rate) + 1, frames.count[index])
            part = frames.first[index] + np.arange(int(np.ceil(row.start * rate)), last)
            if len(part) < 0.9 * fps or not _is_straight(frames, part, fps):
                continue
            mean = float(frames.speed[part].mean())
            if 0.6 * low < mean < 1.1 * low:
                slow.append((abs(mean - low), index, row))
            elif mean > 1.15 * low and mean < 1.45 * high:
                fast.append((abs(mean - high), index, row))
    return _find_stretches(clips, slow), _find_stretches(clips, fast)


def _is_straight(frames: Frames, part: np.ndarray, fps: float) -> bool:
    """Whether frames `part` (K,) have one speed, move forward, and hardly turn."""
    speed, off = frames.speed[part], arctan2(frames.velocity[part, 1], frames.velocity[part, 0])
    steady = speed.std() < _MAX_SPEED_SPREAD * speed.mean() and np.mean(np.abs(off)) < 0.35
    return steady and np.ptp(frames.heading[part]) < 0.5 + 0.3 * len(part) / fps


def _has_action(clip, row: ClipAnnotation) -> bool:
    """Whether a key moment's row overlaps the row."""
    return any(other.key is not None and other.start < row.end and other.end > row.start for other in clip.annotations)


def _find_stretches(clips, found) -> list[Strides]:
    """Find the strides of the best stretches."""
    out = []
    for _, index, row in sorted(found, key=lambda one: one[:2])[: 2 * _PAIRS]:
        clip, span = clips[index], slice(int(row.start), int(row.end) + 1)
        steps = find_strides(clip.motion.frames(span.start, span.stop), clip.heel_toe_contacts[span])
        if steps is not None:
            out.append(steps)
    return out[:_PAIRS]


def _iter_walks(low: float, high: float, example: Motion, gaits: GaitBands) -> Iterator[SyntheticClip]:
    """Iterate over walks from `low` to `high` m/s, where recordings on one side are missing for blends."""
    for speed in low * _WALK_STEP ** np.arange(max(0.0, np.ceil(np.log(high / low) / np.log(_WALK_STEP)))):
        motion = build_gait(float(speed), _WALK_SECONDS, SYNTHETIC_FPS, example.skeleton, example=example)
        rows = _build_gait_rows(np.full(len(motion), speed), gaits)
        yield _ground_clip(f"{SYNTHETIC_FOLDER}{WALK_PREFIX}{speed:.2f}.bvh", motion, None, rows)


def _iter_runs(low: float, high: float, example: Motion, style: GaitStyle,
               gaits: GaitBands) -> Iterator[SyntheticClip]:
    """Iterate over runs at even speeds, and from `low` to `high` m/s and back: slow changes, as quick as players
    change, and weaving.
    """
    if high < 1.1 * low:
        return
    for speed in np.exp(np.arange(np.log(low), np.log(high), np.log(_EVEN_STEP))):
        even = np.full(int(LOOP_SECONDS * SYNTHETIC_FPS), speed)
        motion = build_gait(even, None, SYNTHETIC_FPS, example.skeleton, style=style, example=example)
        yield _ground_clip(f"{SYNTHETIC_FOLDER}even_{speed:.2f}.bvh", motion, None, _build_gait_rows(even, gaits))
    for name, pace, weaves in (("slow", 0.8, False), ("quick", 2.5, False), ("weave", 1.0, True)):
        ramp = np.linspace(low, high, max(int((high - low) / pace * SYNTHETIC_FPS), int(1.5 * SYNTHETIC_FPS)))
        speed = np.concatenate([ramp, ramp[::-1]])
        # as much sideways acceleration as players show at speed, about 4 m/s^2, alternating left and right
        sway = np.sin(2.0 * np.pi * np.arange(len(speed)) / (3.0 * SYNTHETIC_FPS))
        turn = sway * np.minimum(1.2, 4.0 / speed) * weaves
        motion = build_gait(speed, None, SYNTHETIC_FPS, example.skeleton, turn_rate=turn, style=style, example=example)
        yield _ground_clip(f"{SYNTHETIC_FOLDER}{name}_{low:.1f}.bvh", motion, None, _build_gait_rows(speed, gaits))


def _build_kick_clip(kick: RunningKick, gaits: GaitBands) -> SyntheticClip:
    """Build the clip of a kick on the run."""
    gesture = kick.gesture
    first, last, key = (SYNTHETIC_FPS * time for time in (gesture.start, gesture.end, gesture.key))
    row = ClipAnnotation(np.ceil(first), np.floor(last), key, kick.words)
    gait_row = _build_gait_rows(np.full(len(gesture.motion), kick.speed), gaits)
    return _ground_clip(f"{SYNTHETIC_FOLDER}{KICK_PREFIX}{kick.name}.bvh", gesture.motion, None, (row, *gait_row))


def _build_gait_rows(speed: np.ndarray, gaits: GaitBands) -> tuple[ClipAnnotation, ...]:
    """Build rows with the gait of every frame by its speed (T,)."""
    band = np.searchsorted(gaits.thresholds, speed, side="right")
    return tuple(ClipAnnotation(a, b - 1, None, (gaits.words[band[a]], "front")) for a, b in find_equal_runs(band))


def _build_step_rows(name: str, count: int, speed: float, gaits: GaitBands) -> tuple[ClipAnnotation, ...]:
    """Build the row of a step that recordings lack (`missing_steps`): the gait of its speed, and its direction."""
    words = (STANDING, TURNING) if name.startswith(TURN_PREFIX) else (STANDING,)
    if not name.startswith((TURN_PREFIX, STEP_PREFIX)):
        gait = _build_gait_rows(np.full(1, speed), gaits)[0].words[0]
        words = (gait, "back" if name.startswith(BACK_PREFIX) else "left")
    return (ClipAnnotation(0, count - 1, None, words),)


def _ground_clip(name: str, motion: Motion, heel_toe_contacts: np.ndarray | None, rows,
                 plants_feet: bool = False) -> SyntheticClip:
    """Put a clip's soles on the ground, height 0, as in recordings.

    Args:
        name: of the clip.
        motion: T frames.
        heel_toe_contacts: (T, 2, 2) bool contacts; None detects them.
        rows: its annotations.
        plants_feet: plant the feet.
    Returns:
        The clip; points that still move are not in contact.
    """
    heel_toe_contacts = contacts.detect_heel_toe_contacts(motion) if heel_toe_contacts is None else heel_toe_contacts
    motion = replace(motion, root_positions=motion.root_positions - [0.0, 0.0, contacts.measure_ground_height(motion)])
    if plants_feet:
        planted = plant_feet(motion.skeleton, motion.root_positions, motion.rotations, heel_toe_contacts, motion.fps)
        motion = replace(motion, root_positions=planted.root, rotations=planted.rotations)
    return SyntheticClip(name, motion, rows, heel_toe_contacts & detect_still_points(motion))


def detect_still_points(motion: Motion) -> np.ndarray:
    """Detect which of left and right, heel and toe move over the ground by less than a stance's creep: (T, 2, 2) bool.
    """
    body = identify_joints(motion.skeleton)
    places, _ = forward_kinematics(motion)
    points = np.stack([places[:, [limb.foot, limb.toe_or_foot], :2] for limb in (body.left, body.right)], axis=1)
    return np.linalg.norm(np.gradient(points, axis=0), axis=-1) * motion.fps < _STILL_SPEED
