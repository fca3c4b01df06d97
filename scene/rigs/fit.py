"""The motion that an armature plays, from its action or its NLA strips; and the same on a rig's driven skeleton, feet
planted with its legs.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError, format_count
from ...beyond_mocap.base.vectors import find_nearest_axis
from ...beyond_mocap.motion import quaternion
from ...beyond_mocap.motion.motion import Motion, forward_kinematics
from ...beyond_mocap.motion.skeleton import Skeleton
from ..core import action, channels, take_record
from ..core.measure import frames_per_second, units_per_metre
from . import armature
from .driven import DrivenRig

SIMILAR_LEGS = (0.8, 1.25)
_ZERO_FLOOR_RANGE = (-0.01, 0.05)  # heights of toe joints in contact, metres, whose soles are on the scene's ground
_MAX_LEAN = np.radians(30.0)
_REPORTED_MISS = 0.005  # metres from which a miss is reported


@dataclass(frozen=True)
class BakeOptions:
    """How to bake.

    Attributes:
        root: one of `rig.ROOTS`.
        keeps_travel: footprints stay where they are (None: where the legs are similar).
        bakes_ik: IK targets follow instead of being switched off.
        plants_feet: plant the feet again.
        exact: the motion is on the driven skeleton already and is used unchanged.
    """

    root: str = "KEEP"
    keeps_travel: bool | None = None
    bakes_ik: bool = False
    plants_feet: bool = True
    exact: bool = False


@dataclass(frozen=True, eq=False)
class Slide:
    """How far feet in contact slide.

    Attributes:
        cm_s: mean speed in contact, cm/s.
        worst_mm: travel of the worst stance, mm.
    """

    cm_s: float
    worst_mm: float


class FittedMotion:
    """A source's motion on the driven skeleton, feet planted."""

    def __init__(self, driven: DrivenRig, source: SourceMotion, options: BakeOptions):
        from ...beyond_mocap.motion import contacts  # these import scipy, which is slow
        from ...beyond_mocap.motion.foot_plant import plant_feet
        from ...beyond_mocap.motion.retargeting.retarget import Retargeter

        if options.exact:
            self.scale, self.slides, self.motion, self.messages = 1.0, 3 * (Slide(0.0, 0.0),), source.motion, []
            return
        motion, skeleton = source.motion, add_head_tip(driven.skeleton, source.motion.skeleton)
        heel_toe_contacts = contacts.detect_heel_toe_contacts(motion)
        if source.foot_contacts is not None:
            heel_toe_contacts = heel_toe_contacts | source.foot_contacts[:, :, None]
        foot_contacts = heel_toe_contacts.all(axis=2)
        ground = 0.0 if source.foot_contacts is not None else contacts.measure_ground_height(motion)
        floor = 0.0 if _ZERO_FLOOR_RANGE[0] <= ground <= _ZERO_FLOOR_RANGE[1] else ground
        motion = _raise_motion(motion, -ground)
        retargeter = Retargeter(motion, skeleton, standing=foot_contacts)
        self.scale = retargeter.target.leg / retargeter.source.leg
        keeps_travel = SIMILAR_LEGS[0] <= self.scale <= SIMILAR_LEGS[
            1] if options.keeps_travel is None else options.keeps_travel
        retargeter.keeps_travel = keeps_travel
        retargeted = retargeter.retarget(motion)
        is_level = _measure_height_spread(motion, heel_toe_contacts) < 0.05
        planted = plant_feet(skeleton, retargeted.root_positions, retargeted.rotations, heel_toe_contacts, motion.fps,
                             level_feet=is_level)
        fitted = Motion(skeleton, planted.root, planted.rotations, motion.fps) if options.plants_feet else retargeted
        self.slides = tuple(measure_slide(m, foot_contacts) for m in (source.motion, retargeted, fitted))
        self.lift = driven.sole - contacts.measure_sole_height(skeleton)
        self.motion = _raise_motion(fitted, floor + self.lift)
        self.messages = self._build_messages(driven, planted.miss if options.plants_feet else None, heel_toe_contacts,
                                             keeps_travel)

    def _build_messages(self, driven: DrivenRig, miss: np.ndarray | None, points: np.ndarray, keeps: bool) -> list[str]:
        """Build messages about size, sliding feet, floor, and legs that are too short."""
        lines = [
            f"legs {self.scale:.2f} of the source's; {'footprints kept' if keeps else 'steps scaled with the legs'}"
        ]
        before, bare, after = self.slides
        lines.append(
            f"feet in contact slide {after.cm_s:.1f} cm/s, worst stance {after.worst_mm:.0f} mm "
            f"(source {before.cm_s:.1f} and {before.worst_mm:.0f}; before planting {bare.cm_s:.1f} and "
            f"{bare.worst_mm:.0f})"
        )
        lines.append(f"floor: the front of the foot is {100 * driven.sole:.1f} cm high, as in the rig's rest pose")
        short = np.where(points.any(axis=2), miss, 0.0) if miss is not None else np.zeros((1, 2))
        for side, name in enumerate(("left", "right")):
            if short[:, side].max(initial=0.0) > _REPORTED_MISS:
                lines.append(f"the {name} leg is up to {1000 * short[:, side].max():.0f} mm short of its target in "
                             f"{format_count(int(np.sum(short[:, side] > _REPORTED_MISS)), 'frame')}")
        return lines


def add_head_tip(skeleton: Skeleton, source: Skeleton) -> Skeleton:
    """Add a tip to the driven skeleton's head, as far off the vertical as the source's in its rest pose.

    Heads that look straight ahead at rest then match. Unchanged where the source's rest pose shows nothing.
    """
    from ...beyond_mocap.motion.humanoid import identify_joints

    body = identify_joints(source)
    if body.head is None or body.head not in source.end_parents or "Head" not in skeleton.names:
        return skeleton
    rest = source.rest_positions
    crown = source.end_offsets[source.end_parents.index(body.head)]
    across = rest[body.left.upper_leg] - rest[body.right.upper_leg]
    trunk = rest[body.head] - 0.5 * (rest[body.left.upper_leg] + rest[body.right.upper_leg])
    if min(np.linalg.norm(v) for v in (crown, across, trunk)) < 1e-3:
        return skeleton
    up = find_nearest_axis(trunk)
    ahead = np.cross(across - (across @ up) * up, up)
    lean = np.arctan2(crown @ ahead / np.linalg.norm(ahead), crown @ up)
    if trunk @ up < 0.9 * np.linalg.norm(trunk) or abs(lean) > _MAX_LEAN:
        return skeleton
    tip = 0.2 * np.array([np.sin(lean), 0.0, np.cos(lean)])
    return Skeleton(skeleton.names, skeleton.parents, skeleton.offsets,
                    (*skeleton.end_parents, skeleton.names.index("Head")), np.vstack([skeleton.end_offsets, tip]))


def _measure_height_spread(motion: Motion, points: np.ndarray) -> float:
    """Measure how uneven the heights of toes in contact are, metres: 5 % to 95 %."""
    from ...beyond_mocap.motion.humanoid import identify_joints

    body = identify_joints(motion.skeleton)
    places, _ = forward_kinematics(motion)
    heights = places[:, [body.left.toe_or_foot, body.right.toe_or_foot], 2][points[:, :, 1]]
    return float(np.ptp(np.percentile(heights, (5, 95)))) if len(heights) else 0.0


def measure_slide(motion: Motion, foot_contacts: np.ndarray) -> Slide:
    """Measure how far the feet of a motion slide while in contact, `foot_contacts` (T, 2) bool."""
    from ...beyond_mocap.synthesis.quality import movement

    joints = movement.list_foot_joints(motion.skeleton)
    places = forward_kinematics(motion)[0][:, joints]
    speeds = movement.measure_contact_speeds(places, foot_contacts, motion.fps)
    travel = movement.measure_stance_travel(places[:, :, 1], movement.list_stances(foot_contacts))
    mean = float(np.nanmean(speeds)) if np.isfinite(speeds).any() else 0.0
    return Slide(100.0 * mean, 1000.0 * float(travel.max(initial=0.0)))


def _raise_motion(motion: Motion, height: float) -> Motion:
    return Motion(motion.skeleton, motion.root_positions + [0.0, 0.0, height], motion.rotations, motion.fps)


@dataclass(frozen=True, eq=False)
class SourceMotion:
    """The motion that a body plays, in metres at the scene's rate.

    Attributes:
        motion: F frames.
        start: scene frame of the first.
        name: of the action or strip.
        foot_contacts: (F, 2) bool, feet in contact as stored in the take; None where only the motion shows it.
    """

    motion: Motion
    start: int
    name: str
    foot_contacts: np.ndarray | None = None


def read_source(body: bpy.types.Object | None, scene: bpy.types.Scene) -> SourceMotion:
    """Read the motion that an armature plays, with the contacts stored on it: its action, or its NLA strips' result.

    Args:
        body: the armature.
        scene: of the armature.
    Returns:
        The motion.
    Raises:
        InputError: if it plays nothing.
    """
    if body is None or body.type != "ARMATURE":
        raise InputError("bake to rig", "no motion", "a player with a result or an armature with an action",
                         "synthesize and press Apply first")
    strips = take_record.list_strips(body)
    playing, _ = channels.find_playing_action(body)
    if playing is None and not strips:
        raise InputError(f"armature {body.name}", "plays no action", "an armature that moves",
                         "synthesize and press Apply first, or choose another source")
    if strips:
        first, last = _find_extent(body, strips)
        motion, start, name = sample_motion(body, scene, np.arange(first, last + 1)), first, strips[0].name
    else:
        motion, start, name = action.read_motion(body, scene), action.find_first_frame(body), playing.name
    frames = start + np.arange(len(motion))
    return SourceMotion(motion, start, name, take_record.read_body_contacts(body, frames))


def _find_extent(body: bpy.types.Object, strips) -> tuple[int, int]:
    ends = [(strip.frame_start, strip.frame_end) for strip in strips]
    if action.find_first_frame(body) is not None:
        playing, slot = channels.find_playing_action(body)
        ends.append(channels.find_key_range(channels.collect_curves(playing, slot)))
    return int(np.ceil(min(a for a, _ in ends))), int(np.floor(max(b for _, b in ends)))


def find_common_extent(rigs: list[bpy.types.Object]) -> tuple[float, float]:
    """Find the first and last scene frame of the armatures' motions; InputError where one plays nothing."""
    ends = []
    for rig in rigs:
        data = rig.animation_data
        own = []
        playing, slot = channels.find_playing_action(rig)
        if playing is not None:
            found = channels.find_key_range(channels.collect_curves(playing, slot))
            own += [found] if found else []
        own += [(s.frame_start, s.frame_end) for t in (data.nla_tracks if data and data.use_nla else ())
                if not t.mute for s in t.strips if not s.mute]
        if not own:
            raise InputError(f"armature {rig.name}", "does not move", "an action or NLA strips",
                             "bake or apply a motion first")
        ends += own
    return min(a for a, _ in ends), max(b for _, b in ends)


def sample_motion(body: bpy.types.Object, scene: bpy.types.Scene, frames: np.ndarray) -> Motion:
    """Sample the motion that Blender displays on an armature at these frames, with NLA and constraints."""
    skeleton = armature.build_skeleton(body, scene)
    rest = armature.compute_rest_rotations(body, skeleton.names)
    now, subframe, rows = scene.frame_current, scene.frame_subframe, []
    for frame in frames:
        scene.frame_set(int(frame))
        rows.append([np.array(body.matrix_world @ body.pose.bones[name].matrix) for name in skeleton.names])
    scene.frame_set(now, subframe=subframe)
    poses = np.array(rows)
    turn = poses[:, :, :3, :3] / np.linalg.norm(poses[:, :, :3, :3], axis=2, keepdims=True)
    world = quaternion.multiply(quaternion.from_matrix(turn), quaternion.inverse(rest))
    local = world.copy()
    parents = list(skeleton.parents[1:])
    local[:, 1:] = quaternion.multiply(quaternion.inverse(world[:, parents]), world[:, 1:])
    return Motion(skeleton, poses[:, 0, :3, 3] / units_per_metre(scene), local, frames_per_second(scene))
