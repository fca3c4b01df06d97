"""Objects that show a passing scene: those created for it are removed, the user's own play their own motion again.

A tool such as a racquet is an object parented to the hand, placed where the core computes contacts.
"""

from __future__ import annotations

import bmesh
import bpy
from mathutils import Matrix, Vector

from ...beyond_mocap.base.vectors import unit_vector
from ...beyond_mocap.motion.humanoid import identify_joints
from ..core import channels
from ..core.material import get_material
from ..core.saved_state import discard_saved_state, restore_playback
from ..rigs import armature
from .settings import KEPT, BeyondMocapPasser

HANDLE = 0.6  # of the thickness of the part that strikes
TOOL = "tool"  # distinguishes it from balls that the user has parented to a hand
_SIDES = 12


def check_characters(*rows: BeyondMocapPasser) -> None:
    """Check that the characters of players can be released.

    Raises:
        InputError: if one cannot.
    """
    for row in rows:
        if row.shown is not None:
            channels.check_local(row.shown)
            channels.check_editable(row.shown)


def release_character(row: BeyondMocapPasser) -> None:
    """Stop showing the scene on a player's character. Call `check_characters` first."""
    body, row.shown = row.shown, None
    if body is not None:
        remove_tool(body)
        if body.get(KEPT):
            remove_object(body)
        elif row.before.kept:
            restore_playback(row.before, body, KEPT)
    discard_saved_state(row.before, KEPT)


def remove_object(thing: bpy.types.Object) -> None:
    """Remove an object created here from the file, with its children created here, its data and its action."""
    for child in [child for child in thing.children if child.get(KEPT)]:
        remove_object(child)
    if thing.children or thing.library is not None:  # the user has parented objects to it
        return
    channels.remove_marked_action(thing, KEPT)
    data = thing.data
    bpy.data.objects.remove(thing)
    if data is not None and not data.users:
        bpy.data.batch_remove([data])


def create_tool(scene: bpy.types.Scene, body: bpy.types.Object, tool, side: str, collection) -> bpy.types.Object:
    """Create the tool (`ball.contact.Tool`) in a character's hand; the previous one is removed."""
    remove_tool(body)
    skeleton = armature.build_skeleton(body, scene)
    hand = getattr(identify_joints(skeleton), side or "right").hand
    bone = body.data.bones[skeleton.names[hand]]
    metres = armature.find_placement(body, scene).scale
    along = Vector(unit_vector(skeleton.offsets[hand]))
    name = f"{body.name} tool"
    mesh, shape = bpy.data.meshes.new(name), bmesh.new()
    near = tool.length - tool.reach
    for start, end, radius in ((0.0, near, HANDLE * tool.radius), (near, tool.length, tool.radius)):
        if end > start:
            tool_object = bmesh.ops.create_cone(shape, cap_ends=True, segments=_SIDES, radius1=radius, radius2=radius,
                                                depth=end - start)
            bmesh.ops.translate(shape, verts=tool_object["verts"], vec=(0.0, 0.0, 0.5 * (start + end)))
    turn = Vector((0.0, 0.0, 1.0)).rotation_difference(along).to_matrix().to_4x4()
    shape.transform(Matrix.Translation(bone.head_local) @ turn @ Matrix.Scale(1.0 / metres, 4))
    shape.to_mesh(mesh)
    shape.free()
    mesh.materials.append(get_material("Tool", (0.05, 0.05, 0.06)))
    tool_object = bpy.data.objects.new(name, mesh)
    tool_object[KEPT] = TOOL
    collection.objects.link(tool_object)
    tool_object.parent, tool_object.parent_type, tool_object.parent_bone = body, "BONE", bone.name
    tool_object.matrix_parent_inverse = (bone.matrix_local @ Matrix.Translation((0.0, bone.length, 0.0))).inverted()
    return tool_object


def remove_tool(body: bpy.types.Object) -> None:
    """Remove the tool from a character's hand."""
    for child in [child for child in body.children if child.get(KEPT) == TOOL]:
        mesh = child.data
        bpy.data.objects.remove(child)
        if not mesh.users:
            bpy.data.meshes.remove(mesh)
