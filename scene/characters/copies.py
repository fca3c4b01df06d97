"""Copies of a character: armature and meshes as new objects that share their data with the original.

The original is hidden while copies of it play, so that it does not stand on the pitch, and shown again afterwards.
"""

from __future__ import annotations

import bpy
from mathutils import Matrix

from ...beyond_mocap.base.errors import InputError
from ..rigs import armature

COPY_OF = "beyond_mocap_copy_of"
"""Custom property of a copy: the original."""

SHOWN = "beyond_mocap_shown"
"""Custom property of a hidden original: whether it was hidden in views and in renders before."""


def check_character(original: bpy.types.Object | None) -> None:
    """Check that an armature can be a body (InputError with the next step)."""
    if original is None or original.type != "ARMATURE":
        raise InputError("character", "no armature", "an armature of this file", "choose one, or the built-in body")
    where = f"character {original.name}"
    if original.mode == "EDIT":
        raise InputError(where, "its bones are being edited", "object or pose mode", "leave edit mode with Tab")
    if not len(original.data.bones):
        raise InputError(where, "has no bones", "a humanoid armature", "choose another armature")
    if original.data.pose_position == "REST":
        raise InputError(where, "its armature is set to its rest position, in which nothing moves", "pose position",
                         "press Pose Position in the armature's properties")
    owner = find_player(original)
    if owner is not None:
        raise InputError(where, f"shows the motion of {owner}", "an armature that no player has",
                         "choose another armature")
    matrix = find_world_matrix(original)
    if matrix.determinant() <= 0.0 or max(matrix.to_scale()) > 1.001 * min(matrix.to_scale()):
        raise InputError(where, f"is scaled {', '.join(f'{one:g}' for one in matrix.to_scale())}",
                         "one positive scale", "apply it with Ctrl-A, Scale")
    if not list_meshes(original):
        raise InputError(where, "has no mesh", "meshes with an armature modifier, or parented to it",
                         "choose the armature that moves the character's mesh")


def find_player(original: bpy.types.Object) -> str | None:
    """Find the player whose body or rig an armature is; None where no player has it."""
    players = (player for scene in bpy.data.scenes for player in scene.beyond_mocap.players)
    return next((player.name for player in players if original in (player.body, player.rig)), None)


def list_meshes(original: bpy.types.Object) -> list[bpy.types.Object]:
    """List the meshes that an armature moves, by name."""
    children = set(original.children_recursive)
    moved = [thing for thing in bpy.data.objects if thing.type == "MESH" and (
        thing in children or any(one.type == "ARMATURE" and one.object == original for one in thing.modifiers))]
    return sorted(moved, key=lambda thing: thing.name)


def describe_differences(original: bpy.types.Object) -> list[str]:
    """Describe how copies of a character differ from it: a line for each kind of difference."""
    lines, loose = [], [thing.name for thing in list_meshes(original) if not _follows_bones(thing, original)]
    if loose:
        lines.append(f"{', '.join(loose[:3])}: no vertex group of a bone, does not follow the body")
    scaled = [bone.name for bone in original.pose.bones if max(abs(one - 1.0) for one in bone.scale) > 1e-3]
    if scaled:
        lines.append(f"{', '.join(scaled[:3])}: scaled in the pose, which the copies do not have; in pose mode, press "
                     "Apply Pose as Rest Pose to keep it")
    driven = [thing.name for thing in list_meshes(original) if thing.data.shape_keys is not None
              and thing.data.shape_keys.animation_data is not None
              and len(thing.data.shape_keys.animation_data.drivers)]
    if driven:
        lines.append(f"{', '.join(driven[:3])}: its shape keys follow the original, since all copies share them")
    return lines


def _follows_bones(thing: bpy.types.Object, original: bpy.types.Object) -> bool:
    """Whether a mesh has a vertex group of a bone, or hangs on one, itself or by what it is parented to."""
    if not set(original.data.bones.keys()).isdisjoint(thing.vertex_groups.keys()):
        return True
    above: bpy.types.Object | None = thing
    while above is not None and above != original:
        if above.parent == original and above.parent_type == "BONE":
            return True
        above = above.parent
    return False


def _list_family(original: bpy.types.Object) -> list[bpy.types.Object]:
    """List an armature, the objects between it and its meshes, such as sockets on bones, and the meshes."""
    meshes = list_meshes(original)
    between = [thing for thing in original.children_recursive
               if thing not in meshes and not set(meshes).isdisjoint(thing.children_recursive)]
    return [original, *between, *meshes]


def create_copy(original: bpy.types.Object, name: str, collection: bpy.types.Collection) -> list[bpy.types.Object]:
    """Create a copy of a character at the world's origin, with the original's rotation and size, in its rest pose.

    Args:
        original: the armature.
        name: of the copy.
        collection: where the copies go.
    Returns:
        The armature, then its meshes and what these hang on.
    """
    matrix, family = find_world_matrix(original), _list_family(original)
    lies = {thing: matrix.inverted() @ find_world_matrix(thing) for thing in family}
    copies = armature.copy_objects(family, name, collection)
    body = copies[original]
    _, turn, scale = matrix.decompose()
    body.parent = None
    body.constraints.clear()
    body.matrix_parent_inverse.identity()
    body.delta_location, body.delta_scale = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
    body.delta_rotation_euler, body.delta_rotation_quaternion = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)
    body.matrix_basis = Matrix.LocRotScale((0.0, 0.0, 0.0), turn, scale)
    reset_pose(body)
    for thing in family[1:]:
        if thing.parent not in copies:
            copies[thing].parent, copies[thing].matrix_parent_inverse = body, Matrix.Identity(4)
            copies[thing].matrix_basis = lies[thing]
    for thing in family:
        _show_copy(thing, copies[thing])
        copies[thing][COPY_OF] = original
    return [copies[thing] for thing in family]


def reset_pose(body: bpy.types.Object) -> None:
    """Put a copy into its rest pose, playing nothing."""
    if body.animation_data is not None:
        body.animation_data.action = None
    for bone in body.pose.bones:
        bone.matrix_basis = Matrix.Identity(4)


def find_world_matrix(thing: bpy.types.Object) -> Matrix:
    """Find an object's placement in the world from its own channels and its parents', which a hidden object has too."""
    own = thing.matrix_parent_inverse @ thing.matrix_basis if thing.parent is not None else thing.matrix_basis
    return find_world_matrix(thing.parent) @ own if thing.parent is not None else own.copy()


def _show_copy(original: bpy.types.Object, copy: bpy.types.Object) -> None:
    """Show a copy as the original was shown before it was hidden."""
    copy.hide_viewport, copy.hide_render = original.get(SHOWN, (original.hide_viewport, original.hide_render))
    if SHOWN in copy:
        del copy[SHOWN]


def find_original(body: bpy.types.Object | None) -> bpy.types.Object | None:
    """Find the original of a copy; None where it is no copy, or the original was deleted."""
    return body.get(COPY_OF) if body is not None else None


def remove_copy(body: bpy.types.Object) -> None:
    """Remove a copy with its meshes and actions; shared data stays with the original."""
    original = find_original(body)
    things = [body, *(thing for thing in body.children_recursive if COPY_OF in thing)]
    actions = [thing.animation_data.action for thing in things if thing.animation_data is not None]
    bpy.data.batch_remove(things)
    bpy.data.batch_remove([one for one in {*actions} - {None} if not one.users])
    if original is not None:
        update_original(original)


def update_original(original: bpy.types.Object) -> None:
    """Hide a character while a copy of it plays, and show it again when there is none; linked ones stay as they are."""
    is_used = any(thing.get(COPY_OF) == original for thing in bpy.data.objects)
    for thing in (original, *list_meshes(original)):
        if thing.library is not None or thing.get(COPY_OF) is not None:
            continue
        if is_used and SHOWN not in thing:
            thing[SHOWN] = [thing.hide_viewport, thing.hide_render]
            thing.hide_viewport = thing.hide_render = True
        elif not is_used and SHOWN in thing:
            thing.hide_viewport, thing.hide_render = (bool(one) for one in thing[SHOWN])
            del thing[SHOWN]
