"""Objects that show a passing scene: those created for it are removed, the user's own play their own motion again.

A tool such as a racquet is an object parented to the hand, placed where the core computes contacts.
"""

from __future__ import annotations

import bmesh
import bpy
from mathutils import Matrix, Vector

from ...beyond_mocap.base.vectors import unit_vector
from ...beyond_mocap.motion.humanoid import identify
from ..core import channels
from ..core.material import colour
from ..core.set_aside import bring_back, drop
from ..rigs import armature
from .settings import KEPT, BeyondMocapPasser

HANDLE = 0.6  # of the thickness of the part that strikes
TOOL = "tool"  # distinguishes it from balls that the user has parented to a hand
_SIDES = 12


def check(*rows: BeyondMocapPasser) -> None:
    """Check that the characters of players can be released.

    Raises:
        InputError: if one cannot.
    """
    for row in rows:
        if row.shown is not None:
            channels.check_local(row.shown)
            channels.check_free(row.shown)


def let_go(row: BeyondMocapPasser) -> None:
    """Stop showing the scene on a player's character. Call `check_characters` first."""
    body, row.shown = row.shown, None
    if body is not None:
        remove_tool(body)
        if body.get(KEPT):
            remove(body)
        elif row.before.kept:
            bring_back(row.before, body, KEPT)
    drop(row.before, KEPT)


def remove(thing: bpy.types.Object) -> None:
    """Remove an object created here from the file, with its children created here, its data and its action."""
    for child in [child for child in thing.children if child.get(KEPT)]:
        remove(child)
    if thing.children or thing.library is not None:  # the user has parented objects to it
        return
    channels.discard(thing, KEPT)
    data = thing.data
    bpy.data.objects.remove(thing)
    if data is not None and not data.users:
        bpy.data.batch_remove([data])


def show_tool(scene: bpy.types.Scene, body: bpy.types.Object, tool, side: str, collection) -> bpy.types.Object:
    """Create the tool (`ball.contact.Tool`) in a character's hand; the previous one is removed."""
    remove_tool(body)
    skeleton = armature.skeleton_of(body, scene)
    hand = getattr(identify(skeleton), side or "right").hand
    bone = body.data.bones[skeleton.names[hand]]
    metres = armature.placement(body, scene).scale
    along = Vector(unit_vector(skeleton.offsets[hand]))
    name = f"{body.name} tool"
    mesh, shape = bpy.data.meshes.new(name), bmesh.new()
    near = tool.length - tool.reach
    for start, end, radius in ((0.0, near, HANDLE * tool.radius), (near, tool.length, tool.radius)):
        if end > start:
            made = bmesh.ops.create_cone(shape, cap_ends=True, segments=_SIDES, radius1=radius, radius2=radius,
                                         depth=end - start)
            bmesh.ops.translate(shape, verts=made["verts"], vec=(0.0, 0.0, 0.5 * (start + end)))
    turn = Vector((0.0, 0.0, 1.0)).rotation_difference(along).to_matrix().to_4x4()
    shape.transform(Matrix.Translation(bone.head_local) @ turn @ Matrix.Scale(1.0 / metres, 4))
    shape.to_mesh(mesh)
    shape.free()
    mesh.materials.append(colour("Tool", (0.05, 0.05, 0.06)))
    made = bpy.data.objects.new(name, mesh)
    made[KEPT] = TOOL
    collection.objects.link(made)
    made.parent, made.parent_type, made.parent_bone = body, "BONE", bone.name
    made.matrix_parent_inverse = (bone.matrix_local @ Matrix.Translation((0.0, bone.length, 0.0))).inverted()
    return made


def remove_tool(body: bpy.types.Object) -> None:
    """Remove the tool from a character's hand."""
    for child in [child for child in body.children if child.get(KEPT) == TOOL]:
        mesh = child.data
        bpy.data.objects.remove(child)
        if not mesh.users:
            bpy.data.meshes.remove(mesh)
