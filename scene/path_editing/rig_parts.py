"""The body that a rig shows: the bones that show its parts, the controls of each part, and its motion.

The bone that moves a part (`bone_maps`) need not show it: with inverse kinematics on, Rigify's FK controls stay behind.
A part is shown by the bone that deforms the mesh at the control's rest place.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.motion import quaternion
from ...beyond_mocap.motion.motion import Motion, compute_pose
from ...beyond_mocap.motion.skeleton import Skeleton
from ..rigs import bone_maps
from ..rigs.driven import compute_upright_rotation, list_followers
from .rig_sampling import RigSamples

_SAME, _ALONG = 0.01, 0.94  # of the rig's size; cosine
_STRETCH, _OFF = 1e-3, 3e-4  # metres
_UPRIGHT = 0.64  # least cosine of the angle between the trunk and the legs of an upright body
_FK_LIKE = re.compile(r"(?i)(?<![a-z])(fk|ctrl|control)(?![a-z])")
_CARRIERS = {"neck": ("spine",), "head": ("neck", "spine"), "shoulder": ("spine",), "upper_arm": ("shoulder", "spine"),
             "lower_arm": ("upper_arm",), "hand": ("lower_arm",), "lower_leg": ("upper_leg",), "foot": ("lower_leg",),
             "toe": ("foot",)}


@dataclass(frozen=True, eq=False)
class RigParts:
    """The identified parts of a rig.

    A rig that is no upright body has one part, "body", and no controls.

    Attributes:
        controls: part -> the bone that moves it.
        visible_bones: part -> the bone that shows it, in the order of joints.
        follows: bones that a part follows, or that move with it -> the part.
        trunk: likewise animated controls that bend the spine beside its own ones (Rigify's chest).
        root: the bone that carries everything, "" without one.
        humanoid: whether it is an upright body.
    """

    controls: dict[str, str]
    visible_bones: dict[str, str]
    follows: dict[str, str]
    trunk: dict[str, str]
    root: str
    humanoid: bool


def identify_parts(rig: bpy.types.Object) -> RigParts | None:
    """Identify the parts of an upright body; None for another armature."""
    try:
        table = bone_maps.load_stored_map(rig) or bone_maps.find_bone_map(rig)
        bone_maps.check_bone_map(rig, table)
    except InputError:
        return None
    controls = {part: bone for part, bone in table.items() if part != "root"}
    visible_bones = {part: _find_visible_bone(rig, bone) for part, bone in controls.items()}
    visible_bones["hips"] = _find_pelvis(rig, visible_bones) or visible_bones["hips"]
    if not _is_upright(rig, visible_bones):
        return None
    spine = [part for part in visible_bones if part.startswith("spine")]
    trunk = {"chest": spine[-1]} if spine and {"torso", "chest"} <= set(rig.data.bones.keys()) else {}
    follows = list_followers(rig, controls, visible_bones, _SAME * _measure_size(rig))
    return RigParts(controls, visible_bones, follows, trunk=trunk, root=table.get("root", ""), humanoid=True)


def _find_visible_bone(rig: bpy.types.Object, control: str) -> str:
    """Find the bone that deforms the mesh at a control's rest place; the control itself without another."""
    bones = rig.data.bones
    own = bones[control]
    if own.use_deform and not _FK_LIKE.search(control):
        return control
    near = _SAME * _measure_size(rig)
    fits = [bone for bone in bones if (bone.head_local - own.head_local).length < near and bone.name != control
            and bone.vector.length and _compute_direction(bone).dot(_compute_direction(own)) > _ALONG
            and (bone.use_deform or bone.name.startswith("ORG-"))]
    fits.sort(key=lambda bone: (not bone.name.startswith("ORG-"), len(bone.parent_recursive)))
    return fits[0].name if fits else control


def _compute_direction(bone: bpy.types.Bone):
    return (bone.tail_local - bone.head_local).normalized()


def _measure_size(rig: bpy.types.Object) -> float:
    heads = np.empty(3 * len(rig.data.bones), np.float32)
    rig.data.bones.foreach_get("head_local", heads)
    return float(np.ptp(heads.reshape(-1, 3), axis=0).max()) or 1.0


def _find_pelvis(rig: bpy.types.Object, visible_bones: dict[str, str]) -> str | None:
    """Find the bone from which both thighs hang, if it is near them; a control that turns the hips may be above it."""
    left, right = (rig.data.bones[visible_bones[f"{side} upper_leg"]] for side in ("left", "right"))
    above = [bone.name for bone in left.parent_recursive]
    bone = next((bone for bone in right.parent_recursive if bone.name in above), None)
    own = rig.data.bones[visible_bones["hips"]]
    if bone is None or bone.name == own.name or bone.name in [b.name for b in own.parent_recursive]:
        return None
    return bone.name


def _is_upright(rig: bpy.types.Object, visible_bones: dict[str, str]) -> bool:
    """Return whether the trunk is above the legs at rest: a quadruped's is in front of them."""
    bones = rig.data.bones
    top = next((part for part in ("head", "neck", *(f"spine {i}" for i in range(bone_maps.SPINES, 0, -1)))
                if part in visible_bones), None)
    if top is None:
        return True
    hips = np.mean([bones[visible_bones[f"{side} upper_leg"]].head_local for side in ("left", "right")], axis=0)
    feet = np.mean([bones[visible_bones[f"{side} foot"]].head_local for side in ("left", "right")], axis=0)
    trunk, leg = np.array(bones[visible_bones[top]].head_local) - hips, hips - feet
    length = np.linalg.norm(trunk) * np.linalg.norm(leg)
    return bool(length < 1e-9 or trunk @ leg > _UPRIGHT * length)


def compute_rig_upright(rig: bpy.types.Object, visible_bones: dict[str, str]) -> np.ndarray:
    """Compute the rotation (4,), by quarter turns, that makes the armature's space upright along Z and facing +X."""
    return compute_upright_rotation({part: np.array(rig.data.bones[bone].head_local) for part,
                                     bone in visible_bones.items()})


def build_motion(rig: bpy.types.Object, parts: RigParts, samples: RigSamples, units: float, fps: float) -> Motion:
    """Build the motion that the parts' bones show.

    Args:
        rig: the armature.
        parts: its parts.
        samples: its samples.
        units: Blender units in a metre.
        fps: frames per second.
    Returns:
        The motion in metres, world frame, with the core's joint names.
    """
    places, rotations_now = compute_world_places(samples,
                                                 [samples.find_bone(bone) for bone in parts.visible_bones.values()],
                                                 units)
    rest = np.array([rig.data.bones[bone].matrix_local.to_3x3() for bone in parts.visible_bones.values()])
    upright_rotation = compute_rig_upright(rig, parts.visible_bones) if parts.humanoid else quaternion.identity()
    rest = quaternion.multiply(upright_rotation, quaternion.from_matrix(rest))
    world = quaternion.multiply(rotations_now, quaternion.inverse(rest))
    names, parents = list(parts.visible_bones), _find_parents(list(parts.visible_bones))
    local, offsets = world.copy(), np.zeros((len(names), 3))
    for joint, parent in enumerate(parents):
        if parent >= 0:
            back = quaternion.inverse(world[:, parent])
            local[:, joint] = quaternion.multiply(back, world[:, joint])
            offsets[joint] = _compute_constant_offset(quaternion.rotate(back, places[:, joint] - places[:, parent]))
    ends, tips = (), np.zeros((0, 3))
    if parts.humanoid:
        ends, tips = _find_tips(rig, parts, parents, rest=rest, samples=samples, units=units)
    joints = tuple(bone_maps.JOINTS.get(name, f"Bone {name}") for name in names)
    skeleton, local = Skeleton(joints, tuple(parents), offsets, ends, tips), quaternion.unify_signs(local)
    if parts.humanoid:
        local = _solve_feet(skeleton, names, places, local)
    return Motion(skeleton, places[:, 0], local, fps)


def _compute_constant_offset(offsets: np.ndarray) -> np.ndarray:
    """Compute one offset (3,) for those of all frames (F, 3): their median, with the length of a stretched bone."""
    length, middle = np.linalg.norm(offsets, axis=1), np.median(offsets, axis=0)
    longest = np.percentile(length, 99.5)
    return middle * longest / np.linalg.norm(middle) if longest - np.median(length) > _STRETCH else middle


def _solve_feet(skeleton: Skeleton, names: list[str], places: np.ndarray, local: np.ndarray) -> np.ndarray:
    """Solve local rotations (F, J, 4) that place the ankles at (F, J, 3) without stretch, so that contacts of the
    rig hold.
    """
    from ...beyond_mocap.motion.limb import solve_two_bone  # this brings scipy, which is slow to import

    shown, _ = compute_pose(skeleton, places[:, 0], local)
    for side in ("left", "right"):
        leg = tuple(names.index(f"{side} {part}") for part in ("upper_leg", "lower_leg", "foot"))
        if np.linalg.norm(shown[:, leg[2]] - places[:, leg[2]], axis=1).max() > _OFF:
            local = solve_two_bone(skeleton, places[:, 0], local, leg, places[:, leg[2]], soft=1e-4).rotations
    return local


def compute_world_places(samples: RigSamples, bones: list[int], units: float) -> tuple[np.ndarray, np.ndarray]:
    """Compute places (F, n, 3) metres and rotations (F, n, 4) of bones in the world."""
    matrices = samples.world_matrices[:, None] @ samples.poses[:, bones]
    return matrices[..., :3, 3] / units, to_rotations(matrices)


def to_rotations(matrices: np.ndarray) -> np.ndarray:
    """Compute rotations (..., 4) of matrices (..., 4, 4) of any scale."""
    turn = matrices[..., :3, :3]
    return quaternion.from_matrix(turn / np.maximum(np.linalg.norm(turn, axis=-2, keepdims=True), 1e-12))


def _find_parents(names: list[str]) -> list[int]:
    """Compute the parent joint of each part; the first is the root, and unknown parts hang on it."""
    found = []
    for number, name in enumerate(names):
        side, kind = name.partition(" ")[::2] if name.startswith(("left", "right")) else ("", name.partition(" ")[0])
        above = [other for other in names[:number] if other.partition(" ")[0] == kind] if not side else []
        for carrier in _CARRIERS.get(kind, ()) if not above else ():
            above = [o for o in names[:number] if o == f"{side} {carrier}" or o.partition(" ")[0] == carrier]
            if above:
                break
        found.append(-1 if not number else names.index(above[-1]) if above else 0)
    return found


def _find_tips(rig, parts: RigParts, parents: list[int], rest: np.ndarray, samples: RigSamples, units: float):
    """Compute the joints that end a limb, and their tips in metres where the bones' tails show them."""
    names, ends, tips = list(parts.visible_bones), [], []
    size = float(np.cbrt(abs(np.linalg.det(samples.world_matrices[0][:3, :3])))) / units
    for joint, (name, bone) in enumerate(parts.visible_bones.items()):
        kind = name.rpartition(" ")[2]
        if joint in parents or kind not in ("hand", "foot", "toe", "head"):
            continue
        tip = quaternion.rotate(rest[joint], [0.0, rig.data.bones[bone].length * size, 0.0])
        toward = np.array([0.0, 0.0, 1.0]) if kind == "head" else np.array([1.0, 0.0, 0.0])
        if kind == "hand":
            heads = [np.array(rig.data.bones[parts.visible_bones[names[i]]].head_local)
                     for i in (joint, parents[joint])]
            toward = quaternion.rotate(compute_rig_upright(rig, parts.visible_bones), heads[0] - heads[1])
        if tip @ toward > 0.5 * np.linalg.norm(tip) * np.linalg.norm(toward) > 0.0:
            ends.append(joint)
            tips.append(tip)
    return tuple(ends), np.array(tips).reshape(-1, 3)


def build_single_part(rig: bpy.types.Object, samples: RigSamples, units: float) -> RigParts:
    """Build the parts of an armature that is no upright body: one part, the topmost bone that moves with most bones."""
    bones = [bone.name for bone in rig.data.bones if bone.use_deform] or samples.bones
    places, _ = compute_world_places(samples, [samples.find_bone(name) for name in bones], units)
    middle = places.mean(axis=1)
    travel = np.ptp(middle, axis=0).max()
    order = sorted(samples.bones, key=lambda name: len(rig.data.bones[name].parent_recursive))
    sizes = {name: len(rig.data.bones[name].children_recursive) for name in samples.bones}
    trees = [name for name in order if rig.data.bones[name].parent is None]
    main = max(trees, key=sizes.get)
    order = [name for name in order if name == main or main in (b.name for b in rig.data.bones[name].parent_recursive)]
    for name in order:
        own, _ = compute_world_places(samples, [samples.find_bone(name)], units)
        if np.ptp(own[:, 0] - middle, axis=0).max() <= max(0.3 * travel, 0.05):
            main = name
            break
    lowest = min(bones, key=lambda name: float(places[0, bones.index(name), 2]))
    visible_bones = {"body": main} | ({"lowest": lowest} if lowest != main else {})
    return RigParts({}, visible_bones, {}, trunk={}, root="", humanoid=False)

