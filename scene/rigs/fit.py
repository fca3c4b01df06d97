"""The motion that an armature plays, from its action or its NLA strips; and the same on a rig's driven skeleton, feet
planted with its legs.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.base.vectors import nearest_axis
from ...beyond_mocap.motion import quaternion
from ...beyond_mocap.motion.motion import Motion, forward_kinematics
from ...beyond_mocap.motion.skeleton import Skeleton
from ..core import action, channels
from ..core.measure import frames_per_second, units_per_metre
from . import armature
from .driven import Driven

LEGS_ALIKE = (0.8, 1.25)
_FLOOR = (-0.01, 0.05)  # heights of toe joints in contact, metres, whose soles are on the scene's ground
_MOST_LEAN = np.radians(30.0)
_MISS = 0.005  # metres from which a miss is reported


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
    plants: bool = True
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


class Fit:
    """A source's motion on the driven skeleton, feet planted."""

    def __init__(self, driven: Driven, source: Source, options: BakeOptions):
        from ...beyond_mocap.motion import contacts  # these import scipy, which is slow
        from ...beyond_mocap.motion.foot_plant import plant
        from ...beyond_mocap.motion.retargeting.retarget import Retargeter

        if options.exact:
            self.scale, self.slides, self.motion, self.told = 1.0, 3 * (Slide(0.0, 0.0),), source.motion, []
            return
        motion, skeleton = source.motion, _looking_ahead(driven.skeleton, source.motion.skeleton)
        points = contacts.points(motion)
        if source.standing is not None:
            points = points | source.standing[:, :, None]
        flat = points.all(axis=2)
        ground = 0.0 if source.standing is not None else contacts.ground_height(motion)
        floor = 0.0 if _FLOOR[0] <= ground <= _FLOOR[1] else ground
        motion = _raised(motion, -ground)
        carrier = Retargeter(motion, skeleton, standing=flat)
        self.scale = carrier.target.leg / carrier.source.leg
        keeps = LEGS_ALIKE[0] <= self.scale <= LEGS_ALIKE[1] if options.keeps_travel is None else options.keeps_travel
        carrier.keeps_travel = keeps
        carried = carrier.carry(motion)
        level = _stand_spread(motion, points) < 0.05
        planted = plant(skeleton, carried.root_positions, carried.rotations, points, motion.fps, levels=level)
        fitted = Motion(skeleton, planted.root, planted.rotations, motion.fps) if options.plants else carried
        self.slides = tuple(slide(m, flat) for m in (source.motion, carried, fitted))
        self.lift = driven.sole - contacts.sole_height(skeleton)
        self.motion = _raised(fitted, floor + self.lift)
        self.told = self._lines(driven, planted.miss if options.plants else None, points, keeps)

    def _lines(self, driven: Driven, miss: np.ndarray | None, points: np.ndarray, keeps: bool) -> list[str]:
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
            if short[:, side].max(initial=0.0) > _MISS:
                lines.append(f"the {name} leg is up to {1000 * short[:, side].max():.0f} mm short of its target in "
                             f"{int(np.sum(short[:, side] > _MISS))} frames")
        return lines


def _looking_ahead(skeleton: Skeleton, source: Skeleton) -> Skeleton:
    """Add a tip to the driven skeleton's head, as far off the vertical as the source's in its rest pose.

    Heads that look straight ahead at rest then match. Unchanged where the source's rest pose shows nothing.
    """
    from ...beyond_mocap.motion.humanoid import identify

    body = identify(source)
    if body.head is None or body.head not in source.end_parents or "Head" not in skeleton.names:
        return skeleton
    rest = source.rest_positions
    crown = source.end_offsets[source.end_parents.index(body.head)]
    across = rest[body.left.upper_leg] - rest[body.right.upper_leg]
    trunk = rest[body.head] - 0.5 * (rest[body.left.upper_leg] + rest[body.right.upper_leg])
    if min(np.linalg.norm(v) for v in (crown, across, trunk)) < 1e-3:
        return skeleton
    up = nearest_axis(trunk)
    ahead = np.cross(across - (across @ up) * up, up)
    lean = np.arctan2(crown @ ahead / np.linalg.norm(ahead), crown @ up)
    if trunk @ up < 0.9 * np.linalg.norm(trunk) or abs(lean) > _MOST_LEAN:
        return skeleton
    tip = 0.2 * np.array([np.sin(lean), 0.0, np.cos(lean)])
    return Skeleton(skeleton.names, skeleton.parents, skeleton.offsets,
                    (*skeleton.end_parents, skeleton.names.index("Head")), np.vstack([skeleton.end_offsets, tip]))


def _stand_spread(motion: Motion, points: np.ndarray) -> float:
    """Measure how uneven the heights of toes in contact are, metres: 5 % to 95 %."""
    from ...beyond_mocap.motion.humanoid import identify

    body = identify(motion.skeleton)
    places, _ = forward_kinematics(motion)
    heights = places[:, [body.left.toe_or_foot, body.right.toe_or_foot], 2][points[:, :, 1]]
    return float(np.ptp(np.percentile(heights, (5, 95)))) if len(heights) else 0.0


def slide(motion: Motion, standing: np.ndarray) -> Slide:
    """Measure how far the feet of a motion slide while in contact, `foot_contacts` (T, 2) bool."""
    from ...beyond_mocap.synthesis.quality import movement

    joints = movement.foot_joints(motion.skeleton)
    places = forward_kinematics(motion)[0][:, joints]
    speeds = movement.contact_speeds(places, standing, motion.fps)
    travel = movement.stance_travel(places[:, :, 1], movement.stances(standing))
    mean = float(np.nanmean(speeds)) if np.isfinite(speeds).any() else 0.0
    return Slide(100.0 * mean, 1000.0 * float(travel.max(initial=0.0)))


def _raised(motion: Motion, by: float) -> Motion:
    return Motion(motion.skeleton, motion.root_positions + [0.0, 0.0, by], motion.rotations, motion.fps)


@dataclass(frozen=True, eq=False)
class Source:
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
    standing: np.ndarray | None = None


def source_of(body: bpy.types.Object | None, scene: bpy.types.Scene, standing=None) -> Source:
    """Read the motion that an armature plays: its action, or the result of its NLA strips.

    Args:
        body: the armature.
        scene: of the armature.
        find_contacts: function (frames) -> (F, 2) bool of a take; None where there is none.
    Returns:
        The motion.
    Raises:
        InputError: if it plays nothing.
    """
    if body is None or body.type != "ARMATURE":
        raise InputError("bake to rig", "no motion", "a player with a result or an armature with an action",
                         "synthesize and press Apply first")
    data = body.animation_data
    strips = [strip for track in (data.nla_tracks if data and data.use_nla else ()) if not track.mute
              for strip in track.strips if not strip.mute]
    playing, _ = channels.playing(body)
    if playing is None and not strips:
        raise InputError(f"armature {body.name}", "plays no action", "an armature that moves",
                         "synthesize and press Apply first, or choose another source")
    if strips:
        first, last = _extent(body, strips)
        motion, start, name = evaluated(body, scene, np.arange(first, last + 1)), first, strips[0].name
    else:
        motion, start, name = action.read(body, scene), action.first_frame(body), playing.name
    frames = start + np.arange(len(motion))
    return Source(motion, start, name, None if standing is None else standing(frames))


def _extent(body: bpy.types.Object, strips) -> tuple[int, int]:
    ends = [(strip.frame_start, strip.frame_end) for strip in strips]
    if action.first_frame(body) is not None:
        playing, slot = channels.playing(body)
        ends.append(channels.keyed_range(channels.curves(playing, slot)))
    return int(np.ceil(min(a for a, _ in ends))), int(np.floor(max(b for _, b in ends)))


def extent(rigs: list[bpy.types.Object]) -> tuple[float, float]:
    """Find the first and last scene frame of the armatures' motions; InputError where one plays nothing."""
    ends = []
    for rig in rigs:
        data = rig.animation_data
        own = []
        playing, slot = channels.playing(rig)
        if playing is not None:
            found = channels.keyed_range(channels.curves(playing, slot))
            own += [found] if found else []
        own += [(s.frame_start, s.frame_end) for t in (data.nla_tracks if data and data.use_nla else ())
                if not t.mute for s in t.strips if not s.mute]
        if not own:
            raise InputError(f"armature {rig.name}", "does not move", "an action or NLA strips",
                             "bake or apply a motion first")
        ends += own
    return min(a for a, _ in ends), max(b for _, b in ends)


def evaluated(body: bpy.types.Object, scene: bpy.types.Scene, frames: np.ndarray) -> Motion:
    """Sample the motion that Blender displays on an armature at these frames, with NLA and constraints."""
    skeleton = armature.skeleton_of(body, scene)
    rest = armature.rest_rotations(body, skeleton.names)
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
