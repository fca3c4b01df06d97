"""A motion onto somebody's own rig: retargeted, feet planted on its legs, and laid down on its controls as one action.

The rig's driven bones become a skeleton of the core (`Driven`), upright and facing +X whatever way the rig lies; the
core carries the motion over (`retarget`) and plants the feet (`foot_plant`); `Controls` turns the pose that comes out
into channels. With S the turn and size from the armature's space to that skeleton, O the object's turn in the scene,
W_j the core's world rotation of a joint and R_j its bone's rotation at rest, the bone has to be at O^-1 W_j S R_j.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field

import bpy
import numpy as np

from ..beyond_mocap.base.digest import hex_digest
from ..beyond_mocap.base.vectors import nearest_axis
from ..beyond_mocap.errors import InputError
from ..beyond_mocap.motion import quaternion
from ..beyond_mocap.motion.motion import Motion, forward_kinematics, local_rotations
from ..beyond_mocap.motion.skeleton import Skeleton
from . import action, armature, bone_maps, channels
from .measure import units_per_metre
from .rig_controls import CHANNELS, Controls, overriding

MARK = "beyond_mocap_rig"
BEFORE = "beyond_mocap_before"
KEYS = "beyond_mocap_keys"  # digest of the keys that were baked: with others somebody has worked on them
LEGS_ALIKE = (0.8, 1.25)
_FLOOR = (-0.01, 0.05)  # heights of standing toe joints, metres, whose soles are on the scene's own ground
_MOST_LEAN = np.radians(30.0)
_MISS, _OFF = 0.005, 1e-3  # metres that are told
IK_FOLLOWERS = (
    (re.compile(r"(?i)^(.*:)?(ik_foot|foot_ik)(?=[_\-. ]?[lr]$|[_\-. ](left|right)$)"), "foot"),
    (re.compile(r"(?i)^(.*:)?(ik_hand|hand_ik)(?=[_\-. ]?[lr]$|[_\-. ](left|right)$)"), "hand"),
    (re.compile(r"(?i)^(.*:)?toe_ik(?=[_\-. ]?[lr]$|[_\-. ](left|right)$)"), "toe"),
    (re.compile(r"(?i)^(.*:)?thigh_ik_target(?=[_\-. ]?[lr]$)"), "upper_leg"),
    (re.compile(r"(?i)^(.*:)?upper_arm_ik_target(?=[_\-. ]?[lr]$)"), "upper_arm"),
)


@dataclass(frozen=True)
class Wishes:
    """How to bake. root: one of `rig.ROOTS`. keeps_travel: footprints stay where they are (None: where the legs are
    alike). bakes_ik: IK targets follow instead of being switched off. plants: feet are planted again. exact: the motion
    is on the driven skeleton already and is played as it is."""

    root: str = "KEEP"
    keeps_travel: bool | None = None
    bakes_ik: bool = False
    plants: bool = True
    exact: bool = False


@dataclass(frozen=True, eq=False)
class Source:
    """A motion that a body plays, in metres at the scene's rate from scene frame `start`.

    standing (T, 2) bool: feet on the ground as the take carries it; None where only the motion itself can tell.
    """

    motion: Motion
    start: int
    name: str
    standing: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Slide:
    """How far standing feet slide: mean cm/s while they stand, worst mm of a stance."""

    cm_s: float
    worst_mm: float


@dataclass
class Baked:
    """What came of it. slides: of the source, of the rig before and after planting; told: lines for the user."""

    action: bpy.types.Action
    frames: np.ndarray
    scale: float
    slides: tuple[Slide, Slide, Slide]
    told: list[str] = field(default_factory=list)


def check(rig: bpy.types.Object | None, source: bpy.types.Object | None = None) -> None:
    """InputError, with what to do, where an object cannot be baked onto."""
    if rig is None or rig.type != "ARMATURE":
        raise InputError("rig", "no armature is chosen", "the rig to bake to", "choose it in the panel or select it")
    where = f"rig {rig.name}"
    if rig == source:
        raise InputError(where, "it is the source itself", "another armature", "choose the rig to bake to")
    if rig.library is not None:
        raise InputError(where, f"it is linked from {rig.library.filepath}", "a rig of this file",
                         "make a library override (Object, Library Override, Make) or append it")
    if rig.override_library is not None and rig.override_library.is_system_override:
        raise InputError(where, "its library override is not editable", "an editable override",
                         "make it editable in the outliner (Library Override, Make Editable)")
    if rig.name not in bpy.context.view_layer.objects or not rig.visible_get():
        raise InputError(where, "it is hidden or excluded", "a visible rig, which Blender poses",
                         "show it in the outliner")
    if rig.mode == "EDIT":
        raise InputError(where, "its bones are being edited", "object or pose mode", "leave edit mode with Tab")
    channels.check_free(rig)


class Driven:
    """A rig's driven bones as a skeleton of the core."""

    def __init__(self, rig: bpy.types.Object, table: dict[str, str], scene: bpy.types.Scene, bakes_ik: bool = False):
        """table: part -> bone name. Raises InputError where the map does not fit."""
        bone_maps.check(rig, table)
        self.rig, self.scene = rig, scene
        self.table = {part: table[part] for part in bone_maps.PARTS if part in table}
        self.placement = armature.placement(rig, scene)
        self.overrides = overriding(rig, list(self.table.values()))
        self.followers = self._followers() if bakes_ik else {}
        bones = [*self.table.values(), *self.followers]
        movers = [self.table["hips"], *([self.table["root"]] if "root" in self.table else []), *self.followers]
        self.controls = Controls(rig, bones, movers, self.overrides)
        self.parts = [part for part in self.table if part != "root"]
        self.rest_turn = dict(zip(bones, self.controls.rest_turn))
        self.rest_place = dict(zip(bones, self.controls.rest_place))
        self.upright = self._upright()
        self.skeleton = self._skeleton()
        self.sole = self._sole()

    def bone(self, part: str) -> str:
        """The bone of a part."""
        return self.table[part]

    def _followers(self) -> dict[str, str]:
        """IK targets -> the part they follow: those of the overriding constraints, and those known by their names."""
        part_of, found = {bone: part for part, bone in self.table.items()}, {}
        for override in self.overrides:
            constraint = self.rig.pose.bones[override.bone].constraints[override.constraint]
            if constraint.type != "IK" or constraint.target != self.rig:
                continue
            part = part_of.get(override.bone, "")
            end = {"lower_leg": "foot", "lower_arm": "hand"}.get(part.partition(" ")[2])
            if end is None:
                continue
            side, upper = part.partition(" ")[0], "upper_leg" if end == "foot" else "upper_arm"
            found[constraint.subtarget] = f"{side} {end}"
            if constraint.pole_target == self.rig and constraint.pole_subtarget:
                found[constraint.pole_subtarget] = f"{side} {upper}"
        for bone in self.rig.data.bones:
            for pattern, part in IK_FOLLOWERS:
                if pattern.match(bone.name):
                    side = "left" if re.search(r"(?i)(l|left)$", bone.name) else "right"
                    found.setdefault(bone.name, f"{side} {part}")
        depth = {name: len(self.rig.data.bones[name].parent_recursive) for name in found if name in self.rig.data.bones}
        usable = [n for n in sorted(depth, key=lambda n: (depth[n], n)) if found[n] in self.table and n not in part_of]
        return {name: found[name] for name in usable}

    def _heads(self, *parts: str) -> np.ndarray:
        return np.array([self.rest_place[self.bone(part)] for part in parts])

    def _upright(self) -> np.ndarray:
        """S without its size (4,): the armature's space turned, by quarter turns, so that the rig stands along Z and
        faces +X."""
        legs = self._heads("left upper_leg", "right upper_leg")
        feet = self._heads("left foot", "right foot")
        up = nearest_axis(legs.mean(axis=0) - feet.mean(axis=0))
        across = legs[0] - legs[1]
        left = nearest_axis(across - (across @ up) * up)
        return quaternion.from_matrix(np.stack([np.cross(left, up), left, up]))

    def _metres(self, vectors: np.ndarray) -> np.ndarray:
        """Vectors of the armature's space in the core's upright metres."""
        return quaternion.rotate(self.upright, vectors) * self.placement.scale

    def _skeleton(self) -> Skeleton:
        names = [bone_maps.JOINTS[part] for part in self.parts]
        parents, bones = [], list(self.table.values())
        for part in self.parts:
            ride = self.controls.rides[bones.index(self.bone(part))]
            carrier = bones[ride.place_of] if ride.place_of >= 0 else None
            above = [p for p in self.parts if self.bone(p) == carrier]
            parents.append(-1 if part == "hips" else self.parts.index(above[0]) if above else 0)
        heads = self._metres(self._heads(*self.parts))
        offsets = heads - heads[np.maximum(parents, 0)]
        tips = {part: tip for part in self.parts if (tip := self._tip(part, parents)) is not None}
        ends = tuple(self.parts.index(part) for part in tips)
        return Skeleton(tuple(names), tuple(parents), offsets, ends, np.array(list(tips.values())).reshape(-1, 3))

    def _tip(self, part: str, parents: list[int]) -> np.ndarray | None:
        """Where a hand's fingers begin and a foot ends, metres from its joint; None where the rig does not show it."""
        kind = part.partition(" ")[2]
        if kind not in ("hand", "foot", "toe") or self.parts.index(part) in parents:
            return None
        bone = self.rig.data.bones[self.bone(part)]
        fingers = [np.array(child.head_local) for child in bone.children if not re.search(r"(?i)twist|ik", child.name)]
        at = np.array(bone.head_local)
        tip = self._metres((np.mean(fingers, axis=0) if fingers and kind == "hand" else np.array(bone.tail_local)) - at)
        if kind == "hand":
            toward = self._metres(np.subtract(*self._heads(part, f"{part.partition(' ')[0]} lower_arm"))) \
                if f"{part.partition(' ')[0]} lower_arm" in self.table else tip
        else:
            toward = np.array([1.0, 0.0, 0.0])
        length = np.linalg.norm(tip) * np.linalg.norm(toward)
        return tip if length > 1e-9 and tip @ toward > 0.5 * length else None

    def _sole(self) -> float:
        """How high the foremost joint of a foot stands over the floor that the rig stands on at rest, metres."""
        ends = [part for part in ("left toe", "right toe") if part in self.table] or ["left foot", "right foot"]
        level = float(self._metres(self._heads(*ends))[:, 2].min())
        leg = float(np.linalg.norm(self._metres(np.subtract(*self._heads("left upper_leg", "left foot")))))
        if -0.02 * leg <= level <= 0.16 * leg:
            return max(level, 0.0)  # the armature's origin lies on the floor
        tails = [self._metres(np.array(self.rig.data.bones[self.bone(part)].tail_local))[2] for part in ends]
        return float(np.clip(level - min(tails), 0.0, 0.16 * leg))


@dataclass(frozen=True, eq=False)
class Fitted:
    """A motion worked out for a rig, which is still as it was: frames (F,) of the scene; curves as `channels.animate`
    takes them; heads (F, B, 3) of the driven bones, in the armature's space; told: lines for the user."""

    name: str
    driven: Driven
    fit: "_Fit"
    frames: np.ndarray
    curves: dict
    heads: np.ndarray
    told: list[str]


def bake(rig: bpy.types.Object, table: dict[str, str], source: Source, scene: bpy.types.Scene, wishes: Wishes) -> Baked:
    """Lay `source` onto the rig as a new action, which the rig plays from then on."""
    return lay(fitted(rig, table, source, scene, wishes))


def fitted(
    rig: bpy.types.Object, table: dict[str, str], source: Source, scene: bpy.types.Scene, wishes: Wishes
) -> Fitted:
    """`source` on the rig's bones. InputError where the map or the rig does not serve."""
    driven = Driven(rig, table, scene, wishes.bakes_ik)
    fit = _Fit(driven, source, wishes)
    frames = source.start + np.arange(len(source.motion))
    turns, places, told = _wanted(driven, fit.motion, frames, wishes.root)
    basis, heads = driven.controls.basis(turns, places)
    curves = _curves(rig, basis) | _settings(driven, wishes)
    return Fitted(source.name, driven, fit, frames, curves, heads, [*_told(driven, wishes), *told, *fit.told])


def lay(one: Fitted) -> Baked:
    """Let the rig play what was worked out for it, as a new action."""
    from .ride import riders  # which build on what is here

    rig, driven = one.driven.rig, one.driven
    left = riders.leave(rig)
    before, kept = _remembered(rig, driven), _keep_own(rig)
    channels.discard(rig, MARK)
    made = channels.animate(rig, f"{one.name} on {rig.name}", one.frames, one.curves)
    made[MARK], made[BEFORE] = True, json.dumps(before)
    note(rig)
    for switch in driven.controls.switches:
        rig.pose.bones[switch.bone][switch.name] = switch.value
    told = [*left, *one.told, *kept, *_off(driven, one.frames, one.heads, driven.scene)]
    return Baked(made, one.frames, one.fit.scale, one.fit.slides, told)


class _Fit:
    """A source's motion on the driven skeleton, feet planted."""

    def __init__(self, driven: Driven, source: Source, wishes: Wishes):
        from ..beyond_mocap.motion import contacts  # these bring scipy, which is slow to import
        from ..beyond_mocap.motion.retarget import Retargeter
        from ..beyond_mocap.polish.foot_plant import plant

        if wishes.exact:
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
        keeps = LEGS_ALIKE[0] <= self.scale <= LEGS_ALIKE[1] if wishes.keeps_travel is None else wishes.keeps_travel
        carrier.keeps_travel = keeps
        carried = carrier.carry(motion)
        level = _stand_spread(motion, points) < 0.05
        planted = plant(skeleton, carried.root_positions, carried.rotations, points, motion.fps, levels=level)
        fitted = Motion(skeleton, planted.root, planted.rotations, motion.fps) if wishes.plants else carried
        self.slides = tuple(slide(m, flat) for m in (source.motion, carried, fitted))
        self.lift = driven.sole - contacts.sole_height(skeleton)
        self.motion = _raised(fitted, floor + self.lift)
        self.told = self._lines(driven, planted.miss if wishes.plants else None, points, keeps)

    def _lines(self, driven: Driven, miss: np.ndarray | None, points: np.ndarray, keeps: bool) -> list[str]:
        lines = [
            f"legs {self.scale:.2f} of the source's; {'footprints kept' if keeps else 'steps scaled with the legs'}"
        ]
        before, bare, after = self.slides
        lines.append(
            f"standing feet slide {after.cm_s:.1f} cm/s, worst stance {after.worst_mm:.0f} mm "
            f"(source {before.cm_s:.1f} and {before.worst_mm:.0f}; before planting {bare.cm_s:.1f} and "
            f"{bare.worst_mm:.0f})"
        )
        lines.append(f"floor: the front of the foot stands {100 * driven.sole:.1f} cm high, as in the rig's rest pose")
        short = np.where(points.any(axis=2), miss, 0.0) if miss is not None else np.zeros((1, 2))
        for side, name in enumerate(("left", "right")):
            if short[:, side].max(initial=0.0) > _MISS:
                lines.append(f"the {name} leg is up to {1000 * short[:, side].max():.0f} mm too short for its place in "
                             f"{int(np.sum(short[:, side] > _MISS))} frames")
        return lines


def _looking_ahead(skeleton: Skeleton, source: Skeleton) -> Skeleton:
    """The driven skeleton with a crown on its head, as far off the vertical as the source's crown is in its rest pose,
    so that heads which look straight ahead at rest do so together. Unchanged where the source's rest pose says nothing.
    """
    from ..beyond_mocap.motion.humanoid import identify

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
    """How unevenly high the toes stand, metres: 5 % to 95 %."""
    from ..beyond_mocap.motion.humanoid import identify

    body = identify(motion.skeleton)
    places, _ = forward_kinematics(motion)
    heights = places[:, [body.left.toe_or_foot, body.right.toe_or_foot], 2][points[:, :, 1]]
    return float(np.ptp(np.percentile(heights, (5, 95)))) if len(heights) else 0.0


def slide(motion: Motion, standing: np.ndarray) -> Slide:
    """How far the feet of a motion slide while `standing` (T, 2) says that they stand."""
    from ..beyond_mocap.evaluation import feet

    joints = feet.foot_joints(motion.skeleton)
    places = forward_kinematics(motion)[0][:, joints]
    speeds = feet.contact_speeds(places, standing, motion.fps)
    travel = feet.stance_travel(places[:, :, 1], feet.stances(standing))
    mean = float(np.nanmean(speeds)) if np.isfinite(speeds).any() else 0.0
    return Slide(100.0 * mean, 1000.0 * float(travel.max(initial=0.0)))


def _raised(motion: Motion, by: float) -> Motion:
    return Motion(motion.skeleton, motion.root_positions + [0.0, 0.0, by], motion.rotations, motion.fps)


def _wanted(driven: Driven, motion: Motion, frames: np.ndarray, root: str):
    """Rotations (F, 3, 3) and heads (F, 3) in the armature's space that the driven bones are to have, and lines
    told."""
    heads, world = forward_kinematics(motion)
    hips = heads[:, driven.parts.index("hips")]
    told = []
    if root != "KEEP":
        root_turn, root_place = _root_line(driven, motion, heads, "straight" if root == "STRAIGHT" else "smooth")
    if root == "IN_PLACE":  # what the line does is taken off everything: what is left begins where it began
        back = quaternion.multiply(root_turn[:1], quaternion.inverse(root_turn))
        world = quaternion.multiply(back[:, None], world)
        hips = quaternion.rotate(back, hips - root_place) + root_place[:1]
        root_turn, root_place = np.repeat(root_turn[:1], len(hips), axis=0), np.repeat(
            root_place[:1], len(hips), axis=0
        )
    if root in ("SMOOTH", "STRAIGHT") and "root" not in driven.table:
        told.append("no root bone: the hips carry all of the motion; Export Motion can add one to a copy")
    lie_turn, lie_origin = placements(driven.rig, driven.scene, frames)
    scale = driven.placement.scale

    def turned(turn: np.ndarray, bone: str) -> np.ndarray:
        to_rest = quaternion.multiply(turn, driven.upright)
        return quaternion.to_matrix(quaternion.multiply(quaternion.inverse(lie_turn), to_rest)) @ driven.rest_turn[bone]

    def placed(points: np.ndarray) -> np.ndarray:
        return quaternion.rotate(quaternion.inverse(lie_turn), points - lie_origin) / scale

    turns = {driven.bone(part): turned(world[:, i], driven.bone(part)) for i, part in enumerate(driven.parts)}
    places = {driven.bone("hips"): placed(hips)}
    if "root" in driven.table:
        bone = driven.bone("root")
        if root == "KEEP":  # it stays at rest
            turns[bone] = np.repeat(driven.rest_turn[bone][None], len(frames), axis=0)
            places[bone] = np.repeat(driven.rest_place[bone][None], len(frames), axis=0)
        else:
            turns[bone] = turned(root_turn, bone)
            places[bone] = placed(root_place)
    _follow(driven, turns, places, hips, world, motion, placed)
    return turns, places, told


def _root_line(driven: Driven, motion: Motion, heads: np.ndarray, way: str):
    """The root's turn (F, 4) and place (F, 3) in the world: on the ground under the pelvis, as it rests below it."""
    from ..beyond_mocap.motion.humanoid import heading_from_positions
    from ..beyond_mocap.motion.root_path import ground_path

    middle = heads[:, [driven.parts.index(f"{side} upper_leg") for side in ("left", "right")]].mean(axis=1)
    facing = np.unwrap(heading_from_positions(motion.skeleton, heads))
    line, yaw = ground_path(middle[:, :2], facing, motion.fps, way)
    turn = quaternion.about_up(yaw)
    rest = driven._metres(driven._heads("left upper_leg", "right upper_leg").mean(axis=0))
    own = driven._metres(driven._heads("root")[0]) - rest if "root" in driven.table else np.zeros(3)
    own = np.array([own[0], own[1], 0.0])
    return turn, np.column_stack([line, np.zeros(len(line))]) + quaternion.rotate(turn, own)


def _follow(driven: Driven, turns: dict, places: dict, hips, world, motion: Motion, placed) -> None:
    """IK targets go rigidly with the bone that they belong to."""
    if not driven.followers:
        return
    heads = _shifted_heads(motion, world, hips)
    for bone, part in driven.followers.items():
        carrier = driven.bone(part)
        own = driven.rest_turn[carrier].T @ driven.rest_turn[bone]
        offset = driven.rest_turn[carrier].T @ (driven.rest_place[bone] - driven.rest_place[carrier])
        turns[bone] = turns[carrier] @ own
        places[bone] = placed(heads[:, driven.parts.index(part)]) + turns[carrier] @ offset


def _shifted_heads(motion: Motion, world: np.ndarray, hips: np.ndarray) -> np.ndarray:
    """All joints' places (F, J, 3) from world rotations and the hips' places."""
    skeleton, heads = motion.skeleton, np.zeros((*world.shape[:2], 3))
    for joint, parent in enumerate(skeleton.parents):
        heads[:, joint] = hips if parent < 0 else heads[:, parent] + quaternion.rotate(
            world[:, parent], skeleton.offsets[joint])
    return heads


def placements(rig: bpy.types.Object, scene: bpy.types.Scene, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How the armature object lies in the scene at each frame: turns (F, 4) and origins (F, 3) metres."""
    still = armature.placement(rig, scene)
    if not is_carried(rig):
        return np.repeat(still.rotation[None], len(frames), axis=0), np.repeat(still.origin[None], len(frames), axis=0)
    now, subframe, rows = scene.frame_current, scene.frame_subframe, []
    for frame in frames:
        scene.frame_set(int(frame))
        origin, turn, _ = rig.matrix_world.decompose()
        rows.append((*turn, *origin))
    scene.frame_set(now, subframe=subframe)
    table = np.array(rows)
    return quaternion.continuous(table[:, :4]), table[:, 4:] / units_per_metre(scene)


def is_carried(rig: bpy.types.Object) -> bool:
    """Whether something moves the object: its own constraints, or anything about one of its parents."""
    if len(rig.constraints):
        return True
    parent = rig.parent
    while parent is not None:
        if parent.animation_data is not None or len(parent.constraints):
            return True
        parent = parent.parent
    return False


def _curves(rig: bpy.types.Object, basis: dict) -> dict[str, tuple[str, np.ndarray]]:
    """Curves for the driven bones' channels, each bone in its own rotation mode."""
    found = {}
    for name, (rotation, location) in basis.items():
        path = f'pose.bones["{bpy.utils.escape_identifier(name)}"]'
        mode = rig.pose.bones[name].rotation_mode
        if location is not None:
            found[f"{path}.location"] = (name, location)
        if mode == "QUATERNION":
            if rotation[0, 0] < 0:
                rotation = -rotation
            found[f"{path}.rotation_quaternion"] = (name, rotation)
        elif mode == "AXIS_ANGLE":
            found[f"{path}.rotation_axis_angle"] = (name, _axis_angles(rotation))
        else:
            found[f"{path}.rotation_euler"] = (name, euler_curves(rotation, mode))
    return found


def _axis_angles(rotation: np.ndarray) -> np.ndarray:
    """Angle and axis (F, 4) of sign-continuous rotations (F, 4)."""
    length = np.linalg.norm(rotation[:, 1:], axis=1)
    axis = np.where(length[:, None] > 1e-9, rotation[:, 1:] / np.maximum(length, 1e-9)[:, None], [0.0, 1.0, 0.0])
    return np.column_stack([2.0 * np.arctan2(length, rotation[:, 0]), axis])


def euler_curves(rotation: np.ndarray, mode: str) -> np.ndarray:
    """Blender's Euler angles (F, 3), X Y Z, of rotations (F, 4), without jumps: of the two ways to write a rotation the
    one nearer to the frame before, full turns added."""
    order = mode[::-1]  # Blender names the axes in the order in which they are applied to a point
    angles = quaternion.to_euler(rotation, order)
    out = np.empty_like(angles)
    last = np.zeros(3)
    for frame, first in enumerate(angles):
        other = np.array([first[0] + np.pi, np.pi - first[1], first[2] + np.pi])
        choices = [a - 2.0 * np.pi * np.round((a - last) / (2.0 * np.pi)) for a in (first, other)]
        last = min(choices, key=lambda a: np.abs(a - last).sum())
        out[frame] = last
    found = np.empty_like(out)
    for column, letter in enumerate(order):
        found[:, "XYZ".index(letter)] = out[:, column]
    return found


def _settings(driven: Driven, wishes: Wishes) -> dict[str, tuple[str, np.ndarray]]:
    """Curves of one key each: IK/FK switches, and constraints that are switched off."""
    found = {}
    for switch in driven.controls.switches:
        path = f'pose.bones["{bpy.utils.escape_identifier(switch.bone)}"]["{bpy.utils.escape_identifier(switch.name)}"]'
        found[path] = (switch.bone, np.array([[float(switch.value)]]))
    if not wishes.bakes_ik:
        for one in driven.overrides:
            path = (f'pose.bones["{bpy.utils.escape_identifier(one.bone)}"]'
                    f'.constraints["{bpy.utils.escape_identifier(one.constraint)}"].influence')
            found[path] = (one.bone, np.array([[0.0]]))
    return found


def _told(driven: Driven, wishes: Wishes) -> list[str]:
    """What the user has to know about this rig."""
    lines = []
    if driven.controls.switches:
        names = sorted({switch.name for switch in driven.controls.switches})
        lines.append(f"set to FK on {len(driven.controls.switches)} bones: {', '.join(names)}")
    if driven.overrides and not wishes.bakes_ik:
        names = ", ".join(f"{one.bone} ({one.kind})" for one in driven.overrides[:4])
        lines.append(f"{len(driven.overrides)} constraints switched off (influence 0): {names}")
    if driven.followers:
        lines.append(f"IK targets baked too: {', '.join(driven.followers)}")
    bones = driven.rig.pose.bones
    locked = [bone for part, bone in driven.table.items()
              if any(bones[bone].lock_rotation) or part in ("hips", "root") and any(bones[bone].lock_location)]
    if locked:
        lines.append(f"locked channels were keyed all the same on {', '.join(locked[:4])}")
    if driven.controls.loose:
        lines.append(f"{', '.join(driven.controls.loose[:4])}: carried by more than one bone, may be off")
    return lines


def _remembered(rig: bpy.types.Object, driven: Driven) -> dict:
    """How the rig was before, for `remove`; what an earlier bake remembered where it is still on."""
    playing, slot = channels.playing(rig)
    if playing is not None and playing.get(MARK) and BEFORE in playing:
        return json.loads(playing[BEFORE])
    bones = rig.pose.bones
    return {
        "action": playing.name if playing else "", "slot": slot.identifier if slot else "",
        "bones": {name: {c: list(getattr(bones[name], c)) for c in CHANNELS} for name in driven.controls.bones},
        "switches": [[s.bone, s.name, s.before] for s in driven.controls.switches],
        "constraints": [[o.bone, o.constraint, bones[o.bone].constraints[o.constraint].influence]
                        for o in driven.overrides],
    }


def note(rig: bpy.types.Object) -> None:
    """Remember the keys of the action that the rig plays as those that were baked."""
    channels.playing(rig)[0][KEYS] = _digest(rig)


def is_as_baked(rig: bpy.types.Object) -> bool:
    """Whether nobody has changed the keys of the baked action that the rig plays."""
    return channels.playing(rig)[0].get(KEYS) == _digest(rig)


def _digest(rig: bpy.types.Object) -> str:
    parts = []
    for place, curve in sorted(channels.curves(*channels.playing(rig)).items()):
        points = np.empty(2 * len(curve.keyframe_points), np.float32)
        curve.keyframe_points.foreach_get("co", points)
        parts += [repr(place), points]
    return hex_digest(*parts, digits=64)


def _keep_own(rig: bpy.types.Object) -> list[str]:
    """A baked action on which somebody has worked is the user's own from now on; a line about it."""
    playing, _ = channels.playing(rig)
    if playing is None or not playing.get(MARK) or is_as_baked(rig):
        return []
    for name in (MARK, BEFORE, KEYS):
        if name in playing:
            del playing[name]
    return [f"keys of the bake before were changed by hand: it is kept as the action {playing.name}"]


def remove(rig: bpy.types.Object) -> None:
    """Take a baked action off a rig and out of the file; the rig is as before. InputError where it plays none."""
    playing, _ = channels.playing(rig) if rig is not None else (None, None)
    if playing is None or not playing.get(MARK):
        raise InputError(f"rig {rig.name if rig else ''}", "it plays no action that was baked here", "a baked rig",
                         "Bake to Rig first")
    channels.check_free(rig)
    before = json.loads(playing.get(BEFORE, "{}"))
    rig.animation_data.action = None
    if playing.users - playing.use_fake_user == 0:
        bpy.data.actions.remove(playing)
    for name, values in before.get("bones", {}).items():
        for channel, value in values.items():
            if name in rig.pose.bones:
                setattr(rig.pose.bones[name], channel, value)
    for bone, name, value in before.get("switches", []):
        if bone in rig.pose.bones:
            rig.pose.bones[bone][name] = value
    for bone, name, value in before.get("constraints", []):
        if bone in rig.pose.bones and name in rig.pose.bones[bone].constraints:
            rig.pose.bones[bone].constraints[name].influence = value
    found = bpy.data.actions.get(before.get("action", ""))
    if found is not None:
        slot = next((slot for slot in found.slots if slot.identifier == before.get("slot")), None)
        channels.assign(rig, found, slot)


def _off(driven: Driven, frames: np.ndarray, heads: np.ndarray, scene: bpy.types.Scene) -> list[str]:
    """A line where Blender poses the rig elsewhere than it was worked out, looked at in a few frames."""
    now, subframe, worst, where = scene.frame_current, scene.frame_subframe, 0.0, ""
    for i in np.unique(np.linspace(0, len(frames) - 1, 4).astype(int)):
        scene.frame_set(int(frames[i]))
        for number, bone in enumerate(driven.controls.bones):
            matrix = np.array(driven.rig.pose.bones[bone].matrix)
            off = float(np.linalg.norm(matrix[:3, 3] - heads[i, number])) * driven.placement.scale
            if off > worst:
                worst, where = off, bone
    scene.frame_set(now, subframe=subframe)
    if worst > _OFF:
        return [f"the rig itself holds {where} up to {1000 * worst:.0f} mm from where it should be (constraints?)"]
    return []


def source_of(body: bpy.types.Object | None, scene: bpy.types.Scene, standing=None) -> Source:
    """The motion that an armature plays: its action, or, with NLA strips, what these come to.

    standing: function (frames) -> (F, 2) bool of a take, None where there is none.
    """
    if body is None or body.type != "ARMATURE":
        raise InputError("bake to rig", "no motion", "a player with a result or an armature with an action",
                         "synthesize and accept first")
    data = body.animation_data
    strips = [strip for track in (data.nla_tracks if data and data.use_nla else ()) if not track.mute
              for strip in track.strips if not strip.mute]
    playing, _ = channels.playing(body)
    if playing is None and not strips:
        raise InputError(f"armature {body.name}", "it plays no action", "an armature that moves",
                         "synthesize and accept first, or choose another source")
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


def evaluated(body: bpy.types.Object, scene: bpy.types.Scene, frames: np.ndarray) -> Motion:
    """The motion that Blender shows on an armature at these frames: NLA, constraints and all."""
    from .measure import frames_per_second

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
    local = local_rotations(skeleton, world)
    return Motion(skeleton, poses[:, 0, :3, 3] / units_per_metre(scene), local, frames_per_second(scene))
