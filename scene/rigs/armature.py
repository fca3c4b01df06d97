"""Skeletons as armatures, and armatures as skeletons; an armature copied with its children.

A joint becomes a bone of the same name whose head is the joint. The core's joints have no rotation at rest, Blender's
bones have a direction: `compute_rest_rotations` is the difference, and all that `action` needs to convert poses.
"""

from __future__ import annotations

import json
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import bpy
import numpy as np
from mathutils import Vector

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.motion import quaternion
from ...beyond_mocap.motion.humanoid import identify_joints, split_joint_name
from ...beyond_mocap.motion.skeleton import Skeleton
from ..core.measure import units_per_metre

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...beyond_mocap.files.bvh.bvh_write import JointAboveHips

SKELETON_PROPERTY = "beyond_mocap_skeleton"
FINGERS = "Fingers"  # name of the bone collection with the bones beyond the wrists
STUB_LENGTH = 0.04  # metres: length of a bone without children


@dataclass(frozen=True, eq=False)
class Placement:
    """The placement of an armature's own space in the scene's metres.

    Attributes:
        rotation: (4,) unit quaternion.
        origin: (3,) metres.
        scale: metres per unit of the armature's space.
    """

    rotation: np.ndarray
    origin: np.ndarray
    scale: float

    def to_world(self, points: np.ndarray) -> np.ndarray:
        """Convert points (..., 3) of the armature's space to metres in the scene's world."""
        return quaternion.rotate(self.rotation, np.asarray(points) * self.scale) + self.origin

    def to_armature(self, points: np.ndarray) -> np.ndarray:
        """Convert metres in the scene's world (..., 3) to points of the armature's space."""
        return quaternion.rotate(quaternion.inverse(self.rotation), np.asarray(points) - self.origin) / self.scale


def create_armature(context: bpy.types.Context, skeleton: Skeleton, name: str, collection=None) -> bpy.types.Object:
    """Create an armature object with one bone per joint, its lowest joint on the floor; fingers are not displayed.

    The exact offsets in metres, the order of the joints and the tips are stored as a custom property of the armature.

    Args:
        context: of Blender.
        skeleton: J joints.
        name: of the object.
        collection: to link it to; None for the scene's own.
    Returns:
        The object.
    """
    scene = context.scene
    units = units_per_metre(scene)
    data = bpy.data.armatures.new(name)
    data.display_type = "WIRE"
    body = bpy.data.objects.new(name, data)
    scene.collection.objects.link(body)
    places, tails = skeleton.rest_positions, _compute_tails(skeleton)
    places = places - [0.0, 0.0, min(places[:, 2].min(), (places + tails)[:, 2].min())]
    with _edit_mode(context, body):
        for joint, joint_name in enumerate(skeleton.names):
            bone = data.edit_bones.new(joint_name)
            bone.head = places[joint] * units
            bone.tail = (places[joint] + tails[joint]) * units
            bone.align_roll(_choose_roll_target(tails[joint]))
            if joint:
                bone.parent = data.edit_bones[skeleton.names[skeleton.parents[joint]]]
    for bone in body.pose.bones:
        bone.rotation_mode = "QUATERNION"
    _hide_fingers(data, skeleton)
    data[SKELETON_PROPERTY] = json.dumps({
        "names": skeleton.names, "parents": skeleton.parents, "offsets": skeleton.offsets.tolist(),
        "end_parents": skeleton.end_parents, "end_offsets": skeleton.end_offsets.tolist(), "units_per_metre": units,
    })
    if collection is not None and collection != scene.collection:
        collection.objects.link(body)
        scene.collection.objects.unlink(body)
    context.view_layer.update()
    return body


def add_bones_above(body: bpy.types.Object, joints: "Sequence[JointAboveHips]") -> None:
    """Add bones that stand still above the root of an armature; its keys stay as they are.

    Args:
        body: the armature, at the origin.
        joints: from the uppermost down, each where it stands in the world if those above stand at rest.
    """
    units, place, turn, parent = units_per_metre(bpy.context.scene), np.zeros(3), quaternion.identity(), None
    root = next((bone.name for bone in body.data.bones if bone.parent is None), None)
    with _edit_mode(bpy.context, body):
        for joint in joints:
            if not joint.is_moving:
                place, turn = place + quaternion.rotate(turn, joint.position), quaternion.multiply(turn, joint.rotation)
            bone = body.data.edit_bones.new(joint.name)
            bone.head, bone.tail = place * units, (place + [0.0, 0.1, 0.0]) * units
            bone.parent = parent
            parent = bone
        if parent is not None:
            body.data.edit_bones[root].parent = parent


def _hide_fingers(data: bpy.types.Armature, skeleton: Skeleton) -> None:
    """Put the bones beyond the wrists into a bone collection that is not displayed: they would stick out of the body's
    closed hands.
    """
    try:
        humanoid = identify_joints(skeleton)
    except InputError:
        return
    wrists = {humanoid.left.hand, humanoid.right.hand} - {None}
    beyond: list[int] = []
    for joint, parent in enumerate(skeleton.parents):
        if parent in wrists or parent in beyond:
            beyond.append(joint)
    if beyond:
        fingers = data.collections.new(FINGERS)
        fingers.is_visible = False
        for joint in beyond:
            fingers.assign(data.bones[skeleton.names[joint]])


def build_skeleton(body: bpy.types.Object, scene: bpy.types.Scene) -> Skeleton:
    """Build the skeleton of an armature object, in metres, at rest in the armature's own space.

    An armature from `create_armature` returns exactly its original skeleton while its bones are unedited. Any other is
    read from its rest pose: one joint per bone of the largest tree, a tip on every bone without children.

    Raises:
        InputError: if the object is no armature with bones.
    """
    if body is None or body.type != "ARMATURE" or not len(body.data.bones):
        raise InputError("armature", "no bones", "an armature object", "select one in the 3D view")
    derived = _build_from_bones(body, scene)
    stored = _read_stored_skeleton(body, scene)
    if stored is None or set(stored.names) != set(derived.names):
        return derived
    order = [derived.names.index(name) for name in stored.names]
    same_parents = all(
        parent < 0 or derived.names[derived.parents[at]] == stored.names[parent]
        for at, parent in zip(order, stored.parents, strict=True)
    )
    size = max(1.0, float(np.abs(stored.offsets).max()))
    same = same_parents and np.allclose(derived.offsets[order], stored.offsets, atol=1e-5 * size)
    return stored if same else derived


def find_placement(body: bpy.types.Object, scene: bpy.types.Scene) -> Placement:
    """Find the placement of the armature's space in the scene; InputError for an uneven scale, which skews bones."""
    bpy.context.view_layer.update()  # a script may have moved it just before
    return find_current_placement(body, scene)


def find_current_placement(body: bpy.types.Object, scene: bpy.types.Scene) -> Placement:
    """Find the placement as Blender computed it last, which is quick."""
    origin, rotation, scale = body.matrix_world.decompose()
    if min(scale) <= 0.0 or max(scale) > 1.001 * min(scale):
        raise InputError(f"object {body.name}", f"scale {tuple(round(s, 4) for s in scale)}", "one positive scale",
                         "apply it with Ctrl-A, Scale")
    metres = 1.0 / units_per_metre(scene)
    return Placement(np.array(rotation), np.array(origin) * metres, float(np.mean(scale)) * metres)


def compute_rest_rotations(body: bpy.types.Object, names: tuple[str, ...]) -> np.ndarray:
    """Compute the rotations (J, 4) of the named bones at rest, in the armature's space."""
    return quaternion.from_matrix(np.array([body.data.bones[name].matrix_local.to_3x3() for name in names]))


@contextmanager
def _edit_mode(context: bpy.types.Context, body: bpy.types.Object):
    """Edit one armature in a `with`; the active object and its mode are restored afterwards."""
    before = context.view_layer.objects.active
    mode = before.mode if before is not None else "OBJECT"
    if mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    context.view_layer.objects.active = body
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        yield
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")
        context.view_layer.objects.active = before
        if mode != "OBJECT":
            bpy.ops.object.mode_set(mode=mode)


def _compute_tails(skeleton: Skeleton) -> np.ndarray:
    """Compute the vectors (J, 3) m from each joint to its bone's tail: toward the joints or tips that continue the
    limb.
    """
    tails = np.zeros((len(skeleton), 3))
    for joint in range(len(skeleton)):
        onward = _collect_child_offsets(skeleton, joint)
        mean = onward.mean(axis=0) if len(onward) else np.zeros(3)
        if np.linalg.norm(mean) < 0.25 * STUB_LENGTH and len(onward):
            mean = max(onward, key=np.linalg.norm)
        tails[joint] = mean if np.linalg.norm(mean) >= 1e-4 else STUB_LENGTH * _find_incoming_direction(skeleton, joint)
    return tails


def _collect_child_offsets(skeleton: Skeleton, joint: int) -> np.ndarray:
    """Collect the offsets (n, 3) of the children on the joint's side (the neck, not the shoulders), else of all, else
    tips.
    """
    children = skeleton.children(joint)
    side = split_joint_name(skeleton.names[joint])[0]
    along = [c for c in children if split_joint_name(skeleton.names[c])[0] == side] or children
    if along:
        return skeleton.offsets[list(along)]
    return skeleton.end_offsets[[i for i, parent in enumerate(skeleton.end_parents) if parent == joint]]


def _find_incoming_direction(skeleton: Skeleton, joint: int) -> np.ndarray:
    """Find the unit direction (3,) of the limb at this joint; up where there is none."""
    while joint > 0:
        length = np.linalg.norm(skeleton.offsets[joint])
        if length > 1e-4:
            return skeleton.offsets[joint] / length
        joint = skeleton.parents[joint]
    return np.array([0.0, 0.0, 1.0])


def _choose_roll_target(tail: np.ndarray) -> Vector:
    """Choose the direction of a bone's Z axis: forward along X, or up for bones that point forward, as feet do."""
    forward = abs(tail[0]) > 0.7 * np.linalg.norm(tail)
    return Vector((0.0, 0.0, 1.0)) if forward else Vector((1.0, 0.0, 0.0))


def _read_stored_skeleton(body: bpy.types.Object, scene: bpy.types.Scene) -> Skeleton | None:
    """Read the skeleton stored by `create_armature`, at the object's current size; None where it is missing or damaged.
    """
    try:
        table = json.loads(body.data[SKELETON_PROPERTY])
        factor = find_placement(body, scene).scale * table.pop("units_per_metre")
        skeleton = Skeleton(**table)
    except (KeyError, TypeError, ValueError, InputError):
        return None
    if abs(factor - 1.0) < 1e-6:
        return skeleton
    return replace(skeleton, offsets=skeleton.offsets * factor, end_offsets=skeleton.end_offsets * factor)


def _build_from_bones(body: bpy.types.Object, scene: bpy.types.Scene) -> Skeleton:
    """Build the skeleton from the bones' rest pose."""
    roots = [bone for bone in body.data.bones if bone.parent is None]
    root = max(roots, key=lambda bone: len(bone.children_recursive))
    bones = [root]
    for bone in bones:  # grows during the loop: breadth first, so parents come before children
        bones.extend(bone.children)
    names = [bone.name for bone in bones]
    parents = [-1] + [names.index(bone.parent.name) for bone in bones[1:]]
    scale = find_placement(body, scene).scale
    heads = np.array([bone.head_local for bone in bones]) * scale
    tails = np.array([bone.tail_local for bone in bones]) * scale
    tips = [i for i, bone in enumerate(bones) if not bone.children]
    offsets = heads - heads[np.maximum(parents, 0)]
    return Skeleton(tuple(names), tuple(parents), offsets, tuple(tips), (tails - heads)[tips])


def copy_rig(rig: bpy.types.Object, name: str) -> bpy.types.Object:
    """Copy an armature object with its children, which share their data with the original.

    The copy is in the original's collections, or in the scene's own where these are linked. Pointers within the family
    point to the copies; the copy plays nothing.
    """
    return copy_objects([rig, *rig.children_recursive], name)[rig]


def copy_objects(family: list[bpy.types.Object], name: str,
                 home: bpy.types.Collection | None = None) -> dict[bpy.types.Object, bpy.types.Object]:
    """Copy an armature object and others of its family, which share their data with the originals.

    Args:
        family: the armature, then the others.
        name: of the armature's copy.
        home: where the copies go; None for the originals' collections.
    Returns:
        Original -> copy. Pointers within the family point to the copies; the armature's copy plays nothing.
    """
    rig = family[0]
    copies = {original: original.copy() for original in family}
    for original, copied in copies.items():
        copied.name = name if original == rig else f"{name} {original.name}"
        for collection in [home] if home is not None else _list_editable_collections(original):
            collection.objects.link(copied)
        if original.parent in copies:
            inverse = original.matrix_parent_inverse.copy()
            copied.parent, copied.matrix_parent_inverse = copies[original.parent], inverse
        _update_pointers(copied, copies)
    data = copies[rig].animation_data
    if data is not None:
        data.action = None
        for track in list(data.nla_tracks):
            data.nla_tracks.remove(track)
    return copies


def _list_editable_collections(thing: bpy.types.Object) -> list[bpy.types.Collection]:
    """List the editable collections of an object: not linked ones, nor those of a library override."""
    found = [one for one in thing.users_collection if one.library is None and one.override_library is None]
    return found or [bpy.context.scene.collection]


def _update_pointers(thing: bpy.types.Object, copies: dict) -> None:
    """Update the pointers of constraints, modifiers and drivers to the copies."""
    holders = [*thing.constraints, *thing.modifiers]
    if thing.pose is not None:
        holders += [constraint for bone in thing.pose.bones for constraint in bone.constraints]
    for holder in holders:
        targets = list(getattr(holder, "targets", ())) or []
        for one in (holder, *targets):
            for pointer in ("target", "pole_target", "object", "space_object"):
                if getattr(one, pointer, None) in copies:
                    setattr(one, pointer, copies[getattr(one, pointer)])
    for driver in thing.animation_data.drivers if thing.animation_data else ():
        for variable in driver.driver.variables:
            for target in variable.targets:
                if target.id in copies:
                    target.id = copies[target.id]
