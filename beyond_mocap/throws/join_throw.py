"""Join a generated throw or kick to the motion around it.

    joined = join_throw(run_up.motion, run_up.start, thrown.motion, thrown.release, at=12.4)

Around its release the throw stays bit for bit as generated, since the ball flies as it left that hand; only its
first and last parts are blended with the surrounding motion. It begins on a frame of the motion it is joined to, so
the release is up to half a frame earlier or later than requested.
"""

from __future__ import annotations

import weakref
from dataclasses import dataclass

import numpy as np

from ..base.errors import InputError, TimedMessage
from ..library.library import Library
from ..motion import contacts, quaternion
from ..motion.humanoid import compute_heading_from_positions, identify_joints
from ..motion.motion import (
    Motion,
    compute_pose,
    compute_world_rotation,
    forward_kinematics,
    place_motion,
    resample,
    sample_frames,
)
from ..motion.retargeting.neutral import build_neutral_stance
from ..motion.skeleton import Skeleton
from ..synthesis.construct.contact_geometry import ease_in_out
from ..synthesis.construct.edit_blending import step_over
from ..synthesis.construct.move_body_part import Body, LimbReference, move_limb
from ..synthesis.quality.movement import collect_uncut_windows, compute_jerk, compute_window_maxima

FADE = 0.5
"""Seconds of the blend between a throw and the surrounding motion, at either end."""

MIN_UNBLENDED = 0.25
"""Seconds before and after the release that are never blended."""

FADE_WITHOUT_LIBRARY = {"throw": 0.8, "kick": FADE}
"""Seconds of the blend without a library: time for a step of each foot, where the throw allows it."""

TURNING_SPEED = 2.0
"""Radians per second at which a body may rotate towards the heading of the throw; larger angles take longer."""

_WAITING_SPEED = 0.5  # m/s; all joints of a waiting body are slower
_PERCENT = 99.0
_jerk_cache: weakref.WeakKeyDictionary[Library, dict] = weakref.WeakKeyDictionary()
_MAX_STEPPING_SPEED = 2.0  # m/s; faster bodies run and take no small steps
# rad and m above which a warning is reported; a throw begins sideways, so large angles are normal
_WARN_HEADING, _WARN_ROTATION, _WARN_OFFSET = np.radians(100.0), np.radians(60.0), 0.05


@dataclass(frozen=True, eq=False, kw_only=True)
class JoinedThrow:
    """A longer motion with the throw in it.

    Attributes:
        motion: the whole motion.
        start: s of its first frame on the caller's clock.
        release: s on that clock at which the ball leaves.
        first: frame with the first frame of the throw.
        end: frame after the last of the throw.
        unblended: (2,) frames between which it is exactly as generated.
        offset: (3,) m by which the following motion was moved to continue from the throw.
        rotation: rad by which it was rotated about the vertical.
        warnings: warnings for people.
    """

    motion: Motion
    start: float
    release: float
    first: int
    end: int
    unblended: tuple[int, int]
    offset: np.ndarray
    rotation: float
    warnings: tuple[str, ...] = ()

    @property
    def release_frame(self) -> float:
        """Fractional frame of the motion at which the ball leaves."""
        return (self.release - self.start) * self.motion.fps


def join_throw(
    motion_around: Motion, start: float, throw: Motion, release: float, *, at: float, continues: bool = False,
    fade: float = FADE
) -> JoinedThrow:
    """Join a throw to the motion around it.

    Args:
        motion_around: the motion; if it ends before the throw, its ends are held.
        start: s of its first frame.
        throw: the throw on the same skeleton, at its final position.
        release: s in the throw at which the ball leaves.
        at: requested s of the release on the clock of `motion_around`.
        continues: move and rotate the following motion so that it continues where the throw ends.
        fade: s of the blend at either end.
    Raises:
        InputError: if the skeletons differ, or the throw is too short.
    """
    if throw.skeleton.names != motion_around.skeleton.names:
        raise InputError("throw", "a motion of a different skeleton", "a motion of the armature's own skeleton")
    throw = resample(throw, motion_around.fps)
    lead, follow = release, throw.duration - release
    if min(lead, follow) < MIN_UNBLENDED:
        raise InputError(
            "throw", f"{lead:.2f} s before and {follow:.2f} s after the release",
            f"at least {MIN_UNBLENDED:g} s of both"
        )
    fps = motion_around.fps
    first = int(round((at - release - start) * fps))
    end = first + len(throw)
    motion_around, start, first, end = hold_ends(motion_around, start, first, end)
    before = _measure_heading_difference(motion_around, first, throw, 0)
    fade_in = float(np.clip(max(fade, abs(before) / TURNING_SPEED), 1.0 / fps, max(lead - MIN_UNBLENDED, 1.0 / fps)))
    fade_out = min(fade, follow - MIN_UNBLENDED)
    unblended = first + int(np.ceil(fade_in * fps)), end - int(np.ceil(fade_out * fps))
    rotation, offset = _compute_continuation(motion_around, throw, unblended[1] - first, unblended[1],
                                             end) if continues else (0.0, np.zeros(3))
    old = _move_rest(motion_around, unblended[1], rotation, offset)
    new = motion_around.root_positions.copy(), motion_around.rotations.copy()
    new[0][first:end], new[1][first:end] = throw.root_positions, throw.rotations
    share = _compute_share(len(motion_around), first, unblended, end)
    pose = blend_bodies(motion_around.skeleton, new, old, share)
    if continues:
        ground_contacts = contacts.detect_heel_toe_contacts(motion_around)
        inside = np.flatnonzero(share[first:end] < 0.5) + first
        ground_contacts[inside] = contacts.detect_heel_toe_contacts(throw)[inside - first]
        for stretch in ((first, unblended[0]), (unblended[1], end)):
            if _mean_speed(old[0], stretch, fps) <= _MAX_STEPPING_SPEED:
                pose, _ = step_over(motion_around.skeleton, pose, ground_contacts, stretch, fps)
    motion = Motion(motion_around.skeleton, *pose, fps)
    total_offset = old[0][unblended[1]] - motion_around.root_positions[unblended[1]]
    warnings = _describe_turning(before, start + first / fps, rotation, total_offset, start + end / fps)
    return JoinedThrow(
        motion=motion, start=start, release=start + first / fps + release, first=first, end=end, unblended=unblended,
        offset=total_offset, rotation=rotation, warnings=warnings,
    )


def hold_ends(own: Motion, start: float, first: int, end: int) -> tuple[Motion, float, int, int]:
    """Extend a motion to the length that the throw requires by holding its ends.

    Returns:
        The motion, s of its first frame, and first and end frame of the throw in it.
    """
    if first >= 0 and end <= len(own):
        return own, start, first, end
    added = max(-first, 0)
    at = np.arange(-added, max(end, len(own)))
    root, rotations = sample_frames(own, at)
    return Motion(own.skeleton, root, rotations, own.fps), start - added / own.fps, first + added, end + added


def blend_bodies(skeleton: Skeleton, new, old, share: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Blend two motions of a body; feet move straight between their two positions.

    Args:
        skeleton: the skeleton.
        new: root (T, 3) m and rotations (T, J, 4) of the result where `share` is 0, bit for bit.
        old: root and rotations of the result where `share` is 1, bit for bit.
        share: (T,) weight of `old`.
    Returns:
        Root (T, 3) m and rotations (T, J, 4).
    """
    root = new[0] + share[:, None] * (old[0] - new[0])
    rotations = quaternion.slerp(new[1], quaternion.match_signs(old[1], new[1]), share[:, None])
    body, legs = Body.from_pose(skeleton, root, rotations), identify_joints(skeleton)
    new_transforms, old_transforms = compute_pose(skeleton, *new), compute_pose(skeleton, *old)
    for limb in (legs.left, legs.right):
        place, there = new_transforms[0][:, limb.foot], old_transforms[0][:, limb.foot]
        displacement = place + share[:, None] * (there - place) - body.places[:, limb.foot]
        rotations = move_limb(body, LimbReference.from_body(body, limb.leg), displacement, rotations=rotations)
        turned = quaternion.slerp(new_transforms[1][:, limb.foot], old_transforms[1][:, limb.foot], share)
        above = quaternion.inverse(compute_world_rotation(skeleton, rotations, skeleton.parents[limb.foot]))
        rotations[:, limb.foot] = quaternion.multiply(above, turned)
    for end, (places, turns) in ((0.0, new), (1.0, old)):
        same = share == end
        root[same], rotations[same] = places[same], turns[same]
    return root, rotations


def _measure_heading_difference(own: Motion, frame: int, throw: Motion, throw_frame: int) -> float:
    """Measure the angle (rad) from the heading of `own` at its frame to that of the throw at its frame."""
    angles = []
    for motion, at in ((own, frame), (throw, throw_frame)):
        places, _ = compute_pose(motion.skeleton, motion.root_positions[at], motion.rotations[at])
        angles.append(float(compute_heading_from_positions(motion.skeleton, places)))
    return float(quaternion.wrap_angle(angles[1] - angles[0]))


def _compute_continuation(own: Motion, throw: Motion, throw_frame: int, frame: int, end: int) -> tuple[float,
        np.ndarray]:
    """Compute rotation (rad) and offset (3,) m that move `own` to the throw in the middle of the blend."""
    middle = (end - frame) // 2
    at, there = min(frame + middle, len(own) - 1), min(throw_frame + middle, len(throw) - 1)
    turn = _measure_heading_difference(own, at, throw, there)
    moved = quaternion.rotate(quaternion.from_up_angle(np.array(turn)), own.root_positions[at])
    away = throw.root_positions[there] - moved
    return turn, np.array([away[0], away[1], 0.0])


def _move_rest(own: Motion, frame: int, turn: float, offset: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotate and move everything of `own` from `frame` on; return root and rotations."""
    moved = place_motion(own, turn, offset)
    behind = np.arange(len(own)) >= frame
    return (
        np.where(behind[:, None], moved.root_positions, own.root_positions),
        np.where(behind[:, None, None], moved.rotations, own.rotations),
    )


def _mean_speed(root: np.ndarray, stretch: tuple[int, int], fps: float) -> float:
    """Measure the mean speed (m/s) over the ground of root (T, 3) m within a stretch of frames."""
    part = root[stretch[0] : stretch[1], :2]
    return float(np.linalg.norm(np.diff(part, axis=0), axis=1).mean() * fps) if len(part) > 1 else 0.0


def _compute_share(count: int, first: int, kept: tuple[int, int], end: int) -> np.ndarray:
    """Compute the weight (count,) of the surrounding motion.

    It is 0 within `kept`, 1 before the throw's first frame and from its end.
    """
    at = np.arange(count)
    before, behind = (kept[0] - at) / (kept[0] - first + 1.0), (at - kept[1] + 1) / (end - kept[1] + 1.0)
    return ease_in_out(np.maximum(before, behind), np.ones(count))


def _describe_turning(before: float, begin: float, rotation: float, offset: np.ndarray, end: float) -> tuple[str, ...]:
    """Describe large rotations and displacements of the body."""
    warnings = []
    if abs(before) > _WARN_HEADING:
        warnings.append(TimedMessage(
            f"{begin:.1f} s: the body turns {abs(np.degrees(before)):.0f} degrees to the start of the throw or kick; "
            "let it face the target before, or choose a library for the run-up", (begin, begin),
        ))  # fmt: skip
    if np.linalg.norm(offset[:2]) > _WARN_OFFSET or abs(rotation) > _WARN_ROTATION:
        warnings.append(TimedMessage(
            f"{end:.1f} s: the following motion continues from the end of the throw or kick, "
            f"rotated by {np.degrees(rotation):.0f} degrees",
            (end, end),
        ))  # fmt: skip
    return tuple(warnings)


def build_standing_motion(skeleton: Skeleton, seconds: float, fps: float, spot=(0.0, 0.0),
                          facing: float = 0.0) -> Motion:
    """Build a motion of a body that stands upright at `spot` (2,) m with heading `facing` rad for `seconds` s."""
    stance = build_neutral_stance(skeleton)
    local = stance.rotations.copy()
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0:
            above = quaternion.inverse(stance.rotations[parent])
            local[joint] = quaternion.multiply(above, stance.rotations[joint])
    count = max(int(round(seconds * fps)) + 1, 2)
    root = np.tile(stance.positions[0], (count, 1))
    motion = Motion(skeleton, root, np.tile(local, (count, 1, 1)), fps)
    return place_motion(motion, facing, (spot[0], spot[1], 0.0))


def trim_waiting(throw: Motion, release: float, margin_s: float = FADE) -> tuple[Motion, float]:
    """Cut the time in which the body only stands from both ends of a throw.

    Args:
        throw: the throw; what is left stays bit for bit.
        release: s of its release.
        margin_s: s of standing to keep at either end.
    Returns:
        The throw, and s from its first frame to its release.
    """
    fps = throw.fps
    speed = np.linalg.norm(np.diff(forward_kinematics(throw)[0], axis=0), axis=-1).max(axis=1) * fps
    moves = np.flatnonzero(speed > _WAITING_SPEED)
    if not len(moves):
        return throw, release
    least, margin = int(np.ceil(2.0 * MIN_UNBLENDED * fps)), int(round(margin_s * fps))
    at = release * fps
    first = int(np.clip(moves[0] - margin, 0, max(at - least, 0)))
    end = int(np.clip(moves[-1] + 2 + margin, min(at + least + 1, len(throw)), len(throw)))
    return throw.frames(first, end), release - first / fps


def measure_transition_jerk(joined: JoinedThrow) -> np.ndarray:
    """Measure the jerk (2,) m/s^3 of the transitions into and out of the throw.

    The largest third difference of any joint within 8 frames of the middle of each blend.
    """
    values = compute_window_maxima(compute_jerk(forward_kinematics(joined.motion)[0], joined.motion.fps))
    at = 0.5 * np.array([joined.first + joined.unblended[0], joined.unblended[1] + joined.end])
    return values[np.clip(np.round(at).astype(int) - 2, 0, len(values) - 1)]


def measure_library_jerk(library: Library, fps: float, percent: float = _PERCENT) -> float:
    """Measure the jerk (m/s^3) that a share of the library's recordings does not exceed.

    `percent` of all windows of 17 frames of uncut recordings, at `fps`; computed once per library.
    """
    cached = _jerk_cache.setdefault(library, {})
    if (fps, percent) not in cached:
        recorded = [clip.recording for clip in library.clips if not clip.mirrored and not clip.is_synthetic]
        places = [forward_kinematics(resample(motion, fps))[0] for motion in recorded]
        found = [collect_uncut_windows(compute_jerk(one, fps), np.zeros(len(one)))[0] for one in places]
        values = np.concatenate(found) if found else np.zeros(0)
        cached[fps, percent] = float(np.percentile(values, percent)) if len(values) else np.nan
    return cached[fps, percent]
