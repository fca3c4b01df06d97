"""Which bone of a rig moves which part of the body: found by names and structure, stored by skeleton, as JSON files.

A map is a dict part -> bone name, with the parts of PARTS. Control rigs (Rigify's and others that name their bones
"..._fk") are driven by their controls; rigs without controls by their own bones.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import bpy
import numpy as np

from ...beyond_mocap.base.digest import hex_digest
from ...beyond_mocap.base.errors import InputError, build_read_error
from ...beyond_mocap.files.atomic import atomic_write
from ...beyond_mocap.motion.humanoid import Humanoid, identify_joints, list_roles, split_joint_name
from ...beyond_mocap.motion.skeleton import Skeleton
from ..core.preferences import EXTENSION

SPINES, NECKS = 6, 3
_LIMB = {"shoulder": "Shoulder", "upper_arm": "Arm", "lower_arm": "ForeArm", "hand": "Hand", "upper_leg": "UpLeg",
         "lower_leg": "Leg", "foot": "Foot", "toe": "ToeBase"}
JOINTS = {"hips": "Hips", **{f"spine {i}": f"Spine{i}" for i in range(1, SPINES + 1)}, "neck": "Neck",
          **{f"neck {i}": f"NeckTop{i}" for i in range(2, NECKS + 1)}, "head": "Head",
          **{f"{side} {part}": side.capitalize() + name for side in ("left", "right") for part, name in _LIMB.items()}}
"""Part -> the name of its joint, whose meaning the core knows."""
PARTS = ("root", *JOINTS)
LEGS = tuple(f"{side} {part}" for side in ("left", "right") for part in ("upper_leg", "lower_leg", "foot"))
REQUIRED_PARTS = ("hips", *LEGS)

_FK = re.compile(r"(?i)(?<![a-z])fk(?![a-z])")
_NOT_CONTROL = re.compile(
    r"(?i)^(mch|org|def|wgt|vis)[-_]|(?<![a-z])(ik|pole|tweak|target|twist|roll|corrective\w*|helper)(?![a-z])"
)
_NOT_JOINT = re.compile(r"(?i)^(mch|wgt|vis)[-_]|(?<![a-z])(ik|pole|tweak|target|twist|corrective\w*|helper)(?![a-z])")
_ARM = re.compile(r"arm|hand|wrist|elbow|shoulder|clavicle|finger")
_ROOT = re.compile(r"(?i)^(.*:)?(root|master|root_?bone|ctrl_?root|c_pos)$")


def find_bone_map(rig: bpy.types.Object) -> dict[str, str]:
    """Find the bones of an armature's parts by names and structure; InputError where no legs can be found."""
    skeleton, bones = _build_named_tree(rig)
    try:
        body = identify_joints(skeleton)
    except InputError as error:
        found = str(error).partition(": ")[2].partition(";")[0]
        raise InputError(f"armature {rig.name}", f"no legs: {found}", "a humanoid with two legs",
                         "choose its bones in the bone map") from None
    parts = _list_parts(skeleton, body)
    armed = [bones[parts[leg]] for leg in LEGS if _ARM.search(split_joint_name(skeleton.names[parts[leg]])[1])]
    if armed:  # structure found arms instead of legs
        raise InputError(f"armature {rig.name}", f"no legs (only bones such as {armed[0]})", "a humanoid with two legs",
                         "choose its bones in the bone map")
    found = {part: bones[joint] for part, joint in parts.items()}
    root = _find_root_bone(rig, found["hips"])
    return ({"root": root} if root else {}) | found


def _list_parts(skeleton: Skeleton, body: Humanoid) -> dict[str, int]:
    found = {role: joint for role, joint in list_roles(body).items()}
    found |= {f"spine {i}": joint for i, joint in enumerate(_thin(body.spine, SPINES), 1)}
    if body.neck is not None and body.head is not None:
        between, joint = [], skeleton.parents[body.head]
        while joint >= 0 and joint != body.neck:
            between.append(joint)
            joint = skeleton.parents[joint]
        if joint == body.neck:
            found |= {f"neck {i}": joint for i, joint in enumerate(_thin(between[::-1], NECKS - 1), 2)}
    return {part: found[part] for part in JOINTS if part in found}


def _thin(joints, max_count: int) -> list[int]:
    """Thin joints to at most `max_count`, with the first and last."""
    joints = list(joints)
    if len(joints) <= max_count:
        return joints
    return [joints[i] for i in np.round(np.linspace(0, len(joints) - 1, max_count)).astype(int)]


def _build_named_tree(rig: bpy.types.Object) -> tuple[Skeleton, list[str]]:
    """Build a skeleton of the bones that may be parts, under plain names; and their own names, one per joint."""
    bones = list(rig.data.bones)
    has_controls = sum(bool(_FK.search(bone.name)) for bone in bones) >= 6
    barred = _NOT_CONTROL if has_controls else _NOT_JOINT
    plain = {bone.name: _build_joint_name(bone, rig) for bone in bones if not barred.search(bone.name)}
    if has_controls:
        controlled = {name for bone, name in plain.items() if _FK.search(bone)}
        plain = {bone: name for bone, name in plain.items() if _FK.search(bone) or name not in controlled}
    above = {name: _find_parent_among(rig.data.bones[name], plain) for name in plain}
    roots = [name for name in plain if above[name] is None]
    if not roots:
        raise InputError(f"armature {rig.name}", "no bones", "a humanoid rig", "choose another armature")
    below: dict[str, list[str]] = {name: [] for name in plain}
    for name, parent in above.items():
        if parent is not None:
            below[parent].append(name)
    order = max((_list_tree(below, root) for root in roots), key=len)
    parents = [-1] + [order.index(above[name]) for name in order[1:]]
    heads = np.array([rig.data.bones[name].head_local for name in order])
    tails = np.array([rig.data.bones[name].tail_local for name in order])
    tips = [i for i, name in enumerate(order) if not below[name]]
    offsets = heads - heads[np.maximum(parents, 0)]
    names = _make_unique([plain[name] for name in order])
    return Skeleton(names, tuple(parents), offsets, tuple(tips), (tails - heads)[tips]), order


def _build_joint_name(bone: bpy.types.Bone, rig: bpy.types.Object) -> str:
    """Build the core's name of a bone; Rigify's hips are its torso, which carries a control named hips."""
    if "torso" in rig.data.bones:
        if bone.name == "torso":
            return "hips"
        if bone.name in ("hips", "chest"):
            return f"{bone.name} control"
    return re.sub(r"[_\-. ]{2,}", "_", _FK.sub("", bone.name)).strip("_-. ")


def _find_parent_among(bone: bpy.types.Bone, among) -> str | None:
    while (bone := bone.parent) is not None:
        if bone.name in among:
            return bone.name
    return None


def _list_tree(below: dict[str, list[str]], root: str) -> list[str]:
    """List a bone and all below it, parents first."""
    found = [root]
    for name in found:  # grows during the loop
        found.extend(below[name])
    return found


def _make_unique(names: list[str]) -> tuple[str, ...]:
    taken: dict[str, int] = {}
    out = []
    for name in names:
        taken[name] = taken.get(name, 0) + 1
        out.append(name if taken[name] == 1 else f"{name} again {taken[name]}")
    return tuple(out)


def _find_root_bone(rig: bpy.types.Object, hips: str) -> str | None:
    """Find the bone that carries the whole rig; None where the hips do."""
    named = [bone.name for bone in rig.data.bones if bone.parent is None and _ROOT.match(bone.name)]
    if named and named[0] != hips:
        return named[0]
    above = rig.data.bones[hips].parent_recursive
    return above[-1].name if above and not _NOT_CONTROL.search(above[-1].name) else None


def check_bone_map(rig: bpy.types.Object, table: dict[str, str]) -> None:
    """Check that a map can be used on this armature (InputError)."""
    where = f"bone map of {rig.name}"
    missing = [part for part in REQUIRED_PARTS if part not in table]
    if missing:
        raise InputError(where, f"no bone for {', '.join(missing)}", "hips and two legs",
                         "choose them in the list, or press Map Bones")
    unknown = [bone for bone in table.values() if bone not in rig.data.bones]
    if unknown:
        raise InputError(where, f"no bone {', '.join(unknown[:3])}", "bones of this armature",
                         "choose them in the list")
    seen: dict[str, str] = {}
    for part, bone in table.items():
        if bone in seen:
            raise InputError(where, f"bone {bone} is both {seen[bone]} and {part}", "one part for each bone",
                             "clear one of them in the list")
        seen[bone] = part


def compute_rig_fingerprint(rig: bpy.types.Object) -> str:
    """Compute a short hash of all bones' names and parents: the same for every copy of a skeleton."""
    lines = sorted(f"{bone.name}<{bone.parent.name if bone.parent else ''}" for bone in rig.data.bones)
    return hex_digest("\n".join(lines))


def find_map_folder(create: bool = False) -> Path | None:
    """Find the folder of stored maps in the user's folder of this extension; None where Blender has none."""
    try:
        return Path(bpy.utils.extension_path_user(EXTENSION, path="bone_maps", create=create))
    except (ValueError, OSError):  # not installed as an extension
        return None


def store_bone_map(rig: bpy.types.Object, table: dict[str, str]) -> Path | None:
    """Store a map for all armatures with these bones; returns the file, None where there is no folder for it."""
    folder = find_map_folder(create=True)
    if folder is None:
        return None
    path = folder / f"{compute_rig_fingerprint(rig)}.json"
    write_bone_map(path, rig, table)
    return path


def load_stored_map(rig: bpy.types.Object) -> dict[str, str] | None:
    """Load the map stored for these bones; None where there is none, or an unreadable one."""
    folder = find_map_folder()
    path = folder / f"{compute_rig_fingerprint(rig)}.json" if folder else None
    if path is None or not path.is_file():
        return None
    try:
        return read_bone_map(path)
    except InputError:
        return None


def write_bone_map(path: Path, rig: bpy.types.Object, table: dict[str, str]) -> None:
    """Write a map as a JSON file, completely or not at all; InputError where that fails."""
    text = json.dumps({"skeleton": compute_rig_fingerprint(rig), "rig": rig.name, "bones": table}, indent=1,
                      ensure_ascii=False)
    atomic_write(path, text + "\n")


def read_bone_map(path: Path) -> dict[str, str]:
    """Read a map from a JSON file; InputError where it is missing or invalid."""
    form = '{"bones": {"hips": "bone name", ...}}'
    try:
        found = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise build_read_error(path, "a bone map (.json)", error) from None
    except (ValueError, RecursionError):
        raise InputError(path, "not JSON", form, "correct the file") from None
    table = found.get("bones") if isinstance(found, dict) else None
    if not isinstance(table, dict) or not all(isinstance(bone, str) for bone in table.values()):
        raise InputError(path, "no object of bone names", form, "correct the file")
    unknown = [part for part in table if part not in PARTS]
    if unknown:
        raise InputError(path, f"unknown part {unknown[0]!r}", f"one of {', '.join(PARTS)}", "correct the name")
    return {part: table[part] for part in PARTS if table.get(part)}
