"""Repairs recordings on entry: T-poses, single-frame pops, a floor that drifts or tilts, feet that slide in contact.

Inertial suits dead-reckon the pelvis, so their travel and their floor drift and planted feet slide (0.35 to 0.7 m/s in
real data); optical recordings have pops where a marker was swapped and a floor that is centimetres off. A library that
is cut and joined from such clips would carry all of it into every result. Repairs are reported, one line per kind.

The travel is corrected before the feet: wherever a foot is in contact, the *pelvis* is moved smoothly by the opposite
of its slide, because there the suit's dead reckoning is wrong, not the leg; only the remainder is removed by bending
the legs. Feet keep their heights meanwhile: pressed onto one plane, the runs of four libraries got 1.5 to 1.7 times the
jerk (95th percentile of a clip, median), with their own heights 1.0 to 1.1 times, and they slide less.

No foot in contact is completely still: the faster the run, the faster its ball rolls and creeps. A clip counts as
sliding where it slides by more than recordings of its speed from good capture volumes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.ndimage import minimum_filter1d

from ..annotation import CONTINUOUS, DISCRETE, LOCOMOTION, ClipAnnotation
from ..annotation.gaits import TURNING
from ..base.banded_least_squares import BandedLeastSquares
from ..base.errors import InputError, format_count
from ..base.time_series import find_runs
from ..motion import contacts, quaternion
from ..motion.foot_plant import plant_feet
from ..motion.humanoid import identify_joints
from ..motion.motion import Motion, forward_kinematics
from ..motion.t_poses import find_t_poses
from ..motion.track import smooth_zero_phase_hann
from .clip import T_POSE_MARGIN

_ACTS = (DISCRETE | CONTINUOUS) - {*LOCOMOTION, TURNING}  # labels that a T-pose may show

# a rotation that jumps by more than this (radians) and by so many times what its neighbours move, and returns
_POP = np.radians(12.0)
_POP_SHARE = 4.0
_POP_SECONDS = 0.04  # longer than a pop
# limit of the slide of the balls of the feet in the middle of stances, sqrt(a^2 + (b v)^2) (m/s, mean over a clip at
# mean speed v): optical recordings have 0.01 to 0.1 standing or walking and up to 0.067 v in runs, suits 0.12 to 0.25
# at any speed
_SLIDE_LIMIT, _SLIDE_SPEED_SHARE = 0.13, 0.065
_LOW_SECONDS, _DRIFT = 1.5, 0.13  # window of the lowest joint, longer than a flight; metres of drift that are levelled
# stiffness of the floor's drift and of the corrected travel: about the seconds over which they can change
_FLOOR_SECONDS, _TRAVEL_SECONDS = 1.5, 0.2
_MAX_FLOOR_DRIFT = 0.02  # metres of drift that are ignored: floors are uneven, and soles lie a little differently
_SPEED_WEIGHT = 0.005  # weight of an unchanged speed against a foot in contact
_MAX_PELVIS_DROP = 0.10  # metres that a suit's pelvis may be too high above its feet
_BALL_SHARE = 0.7  # share of the distance from ankle to the foot's tip


@dataclass(frozen=True, kw_only=True)
class Repair:
    """What a repair changed.

    Attributes:
        drift: metres between the lowest and the highest floor.
        travel: metres by which the last frame was moved relative to the first.
        slide: m/s before and after, mean over heels and toes in contact.
        was_sliding: whether the clip was sliding, so that travel and feet were corrected.
    """

    drift: float
    travel: float
    slide: tuple[float, float]
    was_sliding: bool


@dataclass(frozen=True, kw_only=True)
class RepairedClip(Repair):
    """A repaired clip and what was changed.

    Attributes:
        motion: the repaired motion.
        heel_toe_contacts: (T, 2, 2) bool, left and right, heel and toe, on the ground.
    """

    motion: Motion
    heel_toe_contacts: np.ndarray


def remove_pops(motion: Motion) -> tuple[Motion, int]:
    """Remove rotations that jump for one or two frames and return.

    A joint pops where it is more than 12 degrees off the slerp of the frames around the gap, and more than four times
    as far as these are apart from each other or from their own outer neighbours (a fast swing moves on, a pop returns).

    Args:
        motion: T frames.
    Returns:
        The motion, and the number of rotations replaced.
    """
    rotations, count = np.array(motion.rotations), 0
    for width in range(1, 1 + min(2, int(_POP_SECONDS * motion.fps))):
        here = _detect_pops(rotations, width)
        for frame, joint in np.argwhere(here):
            before, after = rotations[frame - 1, joint], rotations[frame + width, joint]
            for step in range(width):
                rotations[frame + step, joint] = quaternion.slerp(before, after, (step + 1.0) / (width + 1.0))
        count += int(here.sum()) * width
    return (replace(motion, rotations=rotations), count) if count else (motion, 0)


def remove_drift(motion: Motion) -> tuple[Motion, float]:
    """Remove a floor drift of more than _DRIFT metres.

    The floor is the lowest joint within _LOW_SECONDS (longer than a flight), smoothed. An inertial suit's floor can
    rise by half a metre in five seconds, and `_level_floor` knows only feet detected as in contact.

    Args:
        motion: T frames.
    Returns:
        The motion, and the metres between lowest and highest floor, 0 where nothing was changed.
    """
    low = forward_kinematics(motion)[0][..., 2].min(axis=1)
    width = max(1, int(round(_LOW_SECONDS * motion.fps)))
    floor = np.zeros((len(low), 1))
    for _ in range(3):  # on a slope the lowest point of a window lies at its end: the remainder is smaller each time
        floor += smooth_zero_phase_hann(minimum_filter1d(low[:, None] - floor, width, axis=0), motion.fps, _LOW_SECONDS)
    drift = float(np.ptp(floor))
    if drift < _DRIFT:
        return motion, 0.0
    return replace(motion, root_positions=motion.root_positions - floor * [0.0, 0.0, 1.0]), drift


def _detect_pops(rotations: np.ndarray, width: int) -> np.ndarray:
    """Detect first frames of runs of `width` frames that jump and return: (T, J) bool; rotations (T, J, 4)."""
    out = np.zeros(rotations.shape[:2], bool)
    count = len(rotations) - width - 3
    if count < 1:
        return out
    # with the run starting at frame f: outer f - 2, before f - 1, after f + width, beyond f + width + 1
    outer, before = rotations[:count], rotations[1 : count + 1]
    after, beyond = rotations[width + 2 : width + 2 + count], rotations[width + 3 : width + 3 + count]
    still = np.max([_measure_angles(outer, before), _measure_angles(before, after), _measure_angles(after, beyond)],
                   axis=0)
    deviation = np.full(still.shape, np.inf)
    for step in range(width):
        here = rotations[2 + step : 2 + step + count]
        deviation = np.minimum(deviation, np.minimum(_measure_angles(here, before), _measure_angles(here, after)))
    out[2 : 2 + count] = (deviation > _POP) & (deviation > _POP_SHARE * still)
    return out


def _measure_angles(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Measure the angles (...,) in radians between rotations (..., 4)."""
    return 2.0 * np.arccos(np.clip(np.abs(np.sum(a * b, axis=-1)), 0.0, 1.0))


def repair_floor_and_feet(motion: Motion, heel_toe_contacts: np.ndarray | None = None,
                          always_plant: bool = False) -> RepairedClip:
    """Repair floor and feet: a level floor at height 0 under the soles (`contacts.measure_ground_height`), and planted
    feet.

    Bones and rate stay.

    Args:
        motion: T frames.
        heel_toe_contacts: (T, 2, 2) bool, left and right, heel and toe in contact; None detects it.
        always_plant: plant the feet also in clips that do not slide (a body that got other feet). Clips that slide
            (`is_sliding`) get planted feet and a corrected path anyway.
    Returns:
        The repaired clip.
    """
    heel_toe_contacts = contacts.detect_heel_toe_contacts(motion) if heel_toe_contacts is None else heel_toe_contacts
    motion, drift = _level_floor(motion, heel_toe_contacts)
    before, travel = measure_slide(motion, heel_toe_contacts), 0.0
    was_sliding = is_sliding(motion, heel_toe_contacts)
    if was_sliding:
        motion, travel = _correct_travel(motion, heel_toe_contacts)
    if was_sliding or always_plant:
        motion = plant_contacts(motion, heel_toe_contacts)
    level = motion.root_positions - [0.0, 0.0, contacts.measure_ground_height(motion)]
    return RepairedClip(motion=replace(motion, root_positions=level), heel_toe_contacts=heel_toe_contacts, drift=drift,
                        travel=travel, slide=(before, measure_slide(motion, heel_toe_contacts)),
                        was_sliding=was_sliding)


def is_sliding(motion: Motion, heel_toe_contacts: np.ndarray) -> bool:
    """Whether feet in contact, by `heel_toe_contacts` (T, 2, 2), slide faster than in good recordings of that speed."""
    distances = np.linalg.norm(np.diff(motion.root_positions[:, :2], axis=0), axis=1)
    speed = distances.mean() * motion.fps if len(distances) else 0.0
    return _measure_ball_slide(motion, heel_toe_contacts) > np.hypot(_SLIDE_LIMIT, _SLIDE_SPEED_SHARE * speed)


def plant_contacts(motion: Motion, heel_toe_contacts: np.ndarray) -> Motion:
    """Plant the feet where `heel_toe_contacts` (T, 2, 2) marks heels and toes in contact, at their own heights."""
    planted = plant_feet(motion.skeleton, motion.root_positions, motion.rotations, heel_toe_contacts=heel_toe_contacts,
                         fps=motion.fps, max_drop=_MAX_PELVIS_DROP, level_feet=False)
    return replace(motion, root_positions=planted.root, rotations=planted.rotations)


def measure_slide(motion: Motion, heel_toe_contacts: np.ndarray) -> float:
    """Measure the mean horizontal speed in m/s of heels and toes in contact, `heel_toe_contacts` (T, 2, 2); 0 without
    contact.
    """
    body = identify_joints(motion.skeleton)
    places, _ = forward_kinematics(motion)
    points = np.stack([places[:, [limb.foot, limb.toe_or_foot], :2] for limb in (body.left, body.right)], axis=1)
    in_contact = heel_toe_contacts[1:] & heel_toe_contacts[:-1]
    return float(np.linalg.norm(np.diff(points, axis=0), axis=-1)[in_contact].mean()
                 * motion.fps) if in_contact.any() else 0.0


def _measure_ball_slide(motion: Motion, heel_toe_contacts: np.ndarray) -> float:
    """Measure the mean speed in m/s of the balls of the feet in the middle of their stances; 0 without stances."""
    speed = np.linalg.norm(np.diff(_compute_ball_positions(motion)[..., :2], axis=0), axis=-1) * motion.fps
    weight = _weight_stance_middles(heel_toe_contacts[..., 1])
    weights = np.minimum(weight[1:], weight[:-1])
    return float((speed * weights).sum() / max(weights.sum(), 1e-9))


def _compute_ball_positions(motion: Motion) -> np.ndarray:
    """Compute the positions of the balls of both feet, (T, 2, 3) metres: toe joints, else between ankle and the foot's
    tip.

    They are in contact from the foot's landing to its push off; a heel rises meanwhile and shows little of floor and
    travel.
    """
    skeleton, body = motion.skeleton, identify_joints(motion.skeleton)
    places, world = forward_kinematics(motion)
    balls = []
    for limb in (body.left, body.right):
        ball = places[:, limb.toe_or_foot]
        if limb.toe is None:
            ball = ball + quaternion.rotate(world[:, limb.foot], _BALL_SHARE * skeleton.tip_offset(limb.foot))
        balls.append(ball)
    return np.stack(balls, axis=1)


def _level_floor(motion: Motion, heel_toe_contacts: np.ndarray) -> tuple[Motion, float]:
    """Level the slow rise and fall of the floor under feet in contact; returns the motion and its range in metres."""
    weight = _weight_stance_middles(heel_toe_contacts[..., 1])
    frames_in_contact = np.flatnonzero(weight.any(axis=1))
    if len(frames_in_contact) < 2:
        return motion, 0.0
    heights = _compute_ball_positions(motion)[..., 2]
    usual = [np.median(heights[:, side][weight[:, side] > 0.0]) if weight[:, side].any() else 0.0 for side in (0, 1)]
    floor = _fit_smooth_curve((heights - usual) * weight, weight, _FLOOR_SECONDS, motion.fps, 1e-6)
    floor = floor[np.clip(np.arange(len(floor)), frames_in_contact[0], frames_in_contact[-1])]
    drift = float(np.ptp(floor))
    if drift < _MAX_FLOOR_DRIFT:
        return motion, 0.0
    return replace(motion, root_positions=motion.root_positions - floor[:, None] * [0.0, 0.0, 1.0]), drift


def _correct_travel(motion: Motion, heel_toe_contacts: np.ndarray) -> tuple[Motion, float]:
    """Correct the pelvis's travel so that feet in contact stay; returns the motion and the last frame's shift in
    metres.

    Only the middle of a stance counts: a foot that lands or leaves moves. On recordings without sliding the path comes
    out unchanged, to half a per cent.
    """
    velocity = np.diff(_compute_ball_positions(motion)[..., :2], axis=0) * motion.fps
    weight = _weight_stance_middles(heel_toe_contacts[..., 1])
    weights = np.minimum(weight[1:], weight[:-1])
    change = [-_fit_smooth_curve(velocity[..., axis] * weights, weights, _TRAVEL_SECONDS, motion.fps, _SPEED_WEIGHT)
              for axis in (0, 1)]
    moved = np.zeros((len(motion), 3))
    moved[1:, :2] = np.cumsum(np.stack(change, axis=1), axis=0) / motion.fps
    return replace(motion, root_positions=motion.root_positions + moved), float(np.linalg.norm(moved[-1]))


def _weight_stance_middles(contacts: np.ndarray) -> np.ndarray:
    """Weight stances (T, 2): 1 in the middle third of every stance and 0 in its outer sixths, from `contacts` (T, 2)
    bool.
    """
    weight = np.zeros(contacts.shape)
    for side, one in enumerate(contacts.T):
        for start, stop in find_runs(one):
            share = (np.arange(stop - start) + 0.5) / (stop - start)
            weight[start:stop, side] = np.clip(3.0 * np.minimum(share, 1.0 - share) - 0.5, 0.0, 1.0)
    return weight


def _fit_smooth_curve(weighted_values: np.ndarray, weight: np.ndarray, seconds: float, fps: float,
                      pull: float) -> np.ndarray:
    """Fit the curve f (T,) of least sum w (f - v)^2 + pull f^2 + stiffness |f''|^2.

    Args:
        weighted_values: (T, P) w v.
        weight: (T, P) w.
        seconds: how slowly f can change; the stiffness is its fourth power.
        fps: frames per second.
        pull: weight of f itself.
    Returns:
        (T,).
    """
    squares = BandedLeastSquares(len(weighted_values), reach=2)
    squares.add_value(weight.sum(axis=1) + pull)
    squares.add_difference(2, (seconds * fps) ** 4)
    squares.right += weighted_values.sum(axis=1)
    return squares.solve()[:, 0]


def describe_repairs(repaired: Sequence[tuple[Repair, int]]) -> list[str]:
    """Describe the repairs of a library's clips, one line per kind. repaired: each clip's repair and its number of
    pops.
    """
    lines = []
    pops = [count for _, count in repaired if count]
    if pops:
        lines.append(f"{format_count(sum(pops), 'single-frame jump')} of joints removed from "
                     f"{format_count(len(pops), 'clip')}")
    drifts = [one.drift for one, _ in repaired if one.drift > 0.0]
    if drifts:
        lines.append(f"floor levelled in {format_count(len(drifts), 'clip')}, by {np.median(drifts) * 100:.0f} cm "
                     "(median)")
    sliding = [one for one, _ in repaired if one.was_sliding]
    if sliding:
        before, after = (np.mean([one.slide[i] for one in sliding]) * 100 for i in (0, 1))
        lines.append(
            f"feet planted in {format_count(len(sliding), 'clip')}: mean slide {before:.0f} cm/s before, "
            f"{after:.0f} cm/s after; "
            f"path corrected by {np.median([one.travel for one in sliding]):.2f} m (median)"
        )
    return lines


class TPoses:
    """The T-poses of a library's recordings, which are added in their order.

    Their frames stay, so that the times of labels and source frames are those of the file, but they repeat the pose
    beside them, carry no labels, and nothing plays them or learns from them.

    Attributes:
        frames: number of frames at the start and at the end of each recording, as of `find_t_poses`.
    """

    def __init__(self):
        self.frames: list[tuple[int, int]] = []
        self._lengths: list[tuple[int, float]] = []  # frames and frames per second of each recording

    def add_recording(self, path: Path, motion: Motion, read_rows: Callable[[], Sequence[ClipAnnotation]]) -> Motion:
        """Find the T-poses of a recording and replace them by the first and the last pose that is none.

        Args:
            path: its file, for messages.
            motion: T frames.
            read_rows: reads a person's annotations of it. Where one names an act that such a stretch shows, such as a
                celebration, it is kept.
        Returns:
            The motion; itself where it has no T-pose, or nothing else.
        Raises:
            InputError: naming the file, if its skeleton has no legs.
        """
        try:
            found = find_t_poses(motion)
        except InputError as error:
            raise InputError(path, str(error)) from None
        if any(found):
            found = _drop_acts(found, read_rows(), len(motion))
        self.frames.append(found)
        self._lengths.append((len(motion), motion.fps))
        first, end = found[0], len(motion) - found[1]
        if first >= end or not any(found):
            return motion
        shown = np.clip(np.arange(len(motion)), first, end - 1)
        return replace(motion, root_positions=motion.root_positions[shown], rotations=motion.rotations[shown])

    @property
    def is_shown(self) -> list[bool]:
        """Whether each recording shows more than a T-pose."""
        return [found[0] < count for found, (count, _) in zip(self.frames, self._lengths)]

    def check(self, folder: Path) -> None:
        """Check the recordings of a folder; InputError where none shows more than a T-pose."""
        if not any(self.is_shown):
            raise InputError(folder, "nothing but T-poses", "recordings of motion",
                             "add recordings of people who walk and stand")

    def cut_rows(self, rows: Sequence[tuple[ClipAnnotation, ...]]) -> list[tuple[ClipAnnotation, ...]]:
        """Cut the annotations of all recordings to what is left of them, but not their key moments."""
        out = []
        for own, found, (count, fps) in zip(rows, self.frames, self._lengths):
            if any(found):
                start, end = (round(frames + T_POSE_MARGIN * fps) if frames else 0 for frames in found)
                own = _cut_rows(own, start, count - 1 - end)
            out.append(own)
        return out

    def describe(self) -> list[str]:
        """Describe what is left out: a line for starts, for ends, and for recordings with nothing else."""
        lines = []
        for side, place in enumerate(("start", "end")):
            seconds = [found[side] / fps for found, (_, fps), is_shown in zip(self.frames, self._lengths, self.is_shown)
                       if found[side] and is_shown]
            if seconds:
                lines.append(f"{format_count(len(seconds), 'clip')}: T-pose at the {place} left out, "
                             f"{np.median(seconds):.1f} s{' (median)' if len(seconds) > 1 else ''}")
        if not all(self.is_shown):
            lines.append(f"{format_count(self.is_shown.count(False), 'clip')} left out: nothing but a T-pose")
        return lines


def _drop_acts(found: tuple[int, int], rows: Sequence[ClipAnnotation], count: int) -> tuple[int, int]:
    """Drop the T-poses (number of frames at the start and the end of a clip of `count` frames) in which the key moment
    or the middle of a row lies that names an act.
    """
    start, end = found
    for row in rows:
        if _ACTS & {*row.words}:
            middle = 0.5 * (row.start + row.end) if row.key is None else row.key
            start, end = start if middle >= start else 0, end if middle < count - end else 0
    return start, end


def _cut_rows(rows: Sequence[ClipAnnotation], first: int, last: int) -> tuple[ClipAnnotation, ...]:
    """Cut rows to the frames `first` to `last`, but not their key moments."""
    found = []
    for row in rows:
        low, high = (first, last) if row.key is None else (min(first, row.key), max(last, row.key))
        row = replace(row, start=max(row.start, low), end=min(row.end, high))
        found += [row] if row.start <= row.end else []
    return tuple(found)
