"""A character on an armature: the sculpted body as one mesh, a vertex group for each bone, the shirt in the player's
colour, skin and hair by the player's look.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ..core import channels
from ..core.action import read_motion
from ..core.material import create_material
from ..rigs import armature
from .body_surfaces import ATTRIBUTE, paint_part

if TYPE_CHECKING:
    from ...beyond_mocap.appearance.look import Look
    from ...beyond_mocap.appearance.mesh import BodyMesh

COLOURS = {  # linear RGB of the parts that all players share
    "shorts": (0.70, 0.70, 0.72),
    "socks": (0.70, 0.70, 0.72),
    "trim": (0.70, 0.70, 0.72),
    "boots": (0.015, 0.015, 0.018),
    "soles": (0.35, 0.42, 0.03),
    "eyes": (0.72, 0.72, 0.70),
    "pupils": (0.020, 0.011, 0.007),
    "gloves": (0.62, 0.66, 0.10),
}
ROUGHNESS = {"skin": 0.5, "hair": 0.6, "boots": 0.35, "eyes": 0.15, "pupils": 0.1}
"""Roughness of parts that are not cloth."""

CLOTH = 0.85  # roughness
TIP, TIP_SHARE = "Beyond Mocap Tip", 0.55  # the shape of bones at a limb's end, and how much of the bone it shows
CHARACTER_MARK = "beyond_mocap_character"
"""Custom property of the mesh objects made here."""


def create_character(player, name: str, shirt, collection, scene: bpy.types.Scene, example) -> bpy.types.Object:
    """Create a character mesh on an armature, as its child.

    Args:
        player: the armature.
        name: of the mesh; the look is chosen by it.
        shirt: linear RGB.
        collection: for the mesh.
        scene: says the unit scale.
        example: a `Motion` on the armature's skeleton; it shows how the body hangs on bones whose rest pose is
            ambiguous.
    Returns:
        The mesh object.
    """
    from ...beyond_mocap.appearance.body import build_body  # imports scipy, which is slow
    from ...beyond_mocap.appearance.look import choose_look

    skeleton, look = armature.build_skeleton(player, scene), choose_look(name)
    body = build_body(skeleton, example=example, look=look)
    scale = armature.find_placement(player, scene).scale
    root = np.array(player.data.bones[skeleton.names[0]].head_local)

    def find_material(part: str) -> bpy.types.Material:
        return (_get_painted(f"{name} shirt", part, tuple(shirt)) if part == "shirt"
                else get_part_material(part, look))

    mesh = create_body_mesh(f"{name} body", body, body.vertices / scale + root, find_material)
    character = bpy.data.objects.new(f"{name} body", mesh)
    collection.objects.link(character)
    attach(character, player)
    for bone in player.pose.bones:
        if not bone.children and bone.custom_shape is None:
            bone.custom_shape = get_tip()
    character[CHARACTER_MARK] = True
    write_weights(character, skeleton.names, body.joints, body.weights)
    return character


def list_characters(context: bpy.types.Context) -> list[bpy.types.Object]:
    """List the characters that are selected, themselves or their armatures, and can be changed."""
    found = [thing for picked in context.selected_objects for thing in (picked, *picked.children)]
    return [thing for thing in dict.fromkeys(found)
            if thing.get(CHARACTER_MARK) and thing.parent is not None and thing.library is None
            and thing.override_library is None]


def change_look(character: bpy.types.Object, scene: bpy.types.Scene, look: Look, light: bool) -> None:
    """Give a character another look; its kit's materials stay.

    Args:
        character: one of `list_characters`.
        scene: says the unit scale.
        look: the new look.
        light: whether it gets the light body.
    """
    from ...beyond_mocap.appearance.body import build_body
    from ...beyond_mocap.appearance.mesh import MATERIALS

    player, before = character.parent, character.data
    skeleton = armature.build_skeleton(player, scene)
    has_action = channels.find_playing_action(player)[0] is not None
    body = build_body(skeleton, example=read_motion(player, scene) if has_action else None, look=look, light=light)
    root = np.array(player.data.bones[skeleton.names[0]].head_local)
    kit = dict(zip(MATERIALS, before.materials))

    def find_material(part: str) -> bpy.types.Material:
        kept = None if part in ("skin", "hair") else kit.get(part)
        return kept or get_part_material(part, look)

    vertices = body.vertices / armature.find_placement(player, scene).scale + root
    mesh = create_body_mesh(before.name, body, vertices, find_material)
    character.data = mesh  # whose groups are its own: others may share the mesh before, with its groups
    for slot in character.material_slots:
        slot.link = "DATA"
    write_weights(character, skeleton.names, body.joints, body.weights)
    if not before.users:
        name = before.name
        bpy.data.meshes.remove(before)
        mesh.name = name


def get_part_material(part: str, look: Look) -> bpy.types.Material:
    """Return the material that all players with this look share for a part other than the kit's own."""
    from ...beyond_mocap.appearance.look import HAIR_COLOURS, SKIN_TONES

    tones = {"skin": (look.skin, SKIN_TONES), "hair": (look.colour, HAIR_COLOURS)}
    if part not in tones:
        return _get_painted(part.capitalize(), part, COLOURS[part])
    index, table = tones[part]
    return _get_painted(f"{part.capitalize()} {index + 1}", part, table[index])


def _get_painted(name: str, part: str, rgb: tuple[float, float, float]) -> bpy.types.Material:
    """Return the material of a name; create and paint it if the file has none of its own."""
    found = bpy.data.materials.get((name, None))
    return found or paint_part(create_material(name, rgb, ROUGHNESS.get(part, CLOTH)), part)


def create_body_mesh(name: str, body: BodyMesh, vertices: np.ndarray,
                     find_material: Callable[[str], bpy.types.Material]) -> bpy.types.Mesh:
    """Create the mesh of a body, smooth but for the edges between its parts.

    Args:
        name: of the mesh.
        body: faces and materials.
        vertices: (V, 3) in the armature's space.
        find_material: gives the material of a part.
    Returns:
        The mesh.
    """
    from ...beyond_mocap.appearance.mesh import MATERIALS

    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices.tolist(), [], body.faces)
    mesh.polygons.foreach_set("material_index", np.asarray(body.material, np.int32))
    mesh.polygons.foreach_set("use_smooth", np.ones(len(body.faces), bool))
    painted = mesh.attributes.new(ATTRIBUTE, "FLOAT_VECTOR", "POINT")
    painted.data.foreach_set("vector", np.asarray(body.sculpted, np.float32).ravel())
    _mark_edges(mesh, body)
    for part in MATERIALS:
        mesh.materials.append(find_material(part))
    return mesh


def _mark_edges(mesh: bpy.types.Mesh, body: BodyMesh) -> None:
    """Mark the edges between materials as sharp."""
    edge_of_corner = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("edge_index", edge_of_corner)
    material = np.repeat(body.material, [len(face) for face in body.faces])
    low, high = np.full(len(mesh.edges), len(body.material)), np.full(len(mesh.edges), -1)
    np.minimum.at(low, edge_of_corner, material)
    np.maximum.at(high, edge_of_corner, material)
    mesh.edges.foreach_set("use_edge_sharp", low != high)


def attach(character: bpy.types.Object, player: bpy.types.Object) -> None:
    """Make a mesh the child of an armature that bends it and keeps its volume."""
    character.parent = player
    modifier = character.modifiers.new("Armature", "ARMATURE")
    modifier.object, modifier.use_deform_preserve_volume = player, True


def get_tip() -> bpy.types.Object:
    """Return the shape of bones at a limb's end: a shorter line, since head and hands are shorter than the recorded
    bones, which would stick out of them.
    """
    tip = bpy.data.objects.get(TIP)
    if tip is None or tip.type != "MESH":
        mesh = bpy.data.meshes.new(TIP)
        mesh.from_pydata([(0.0, 0.0, 0.0), (0.0, TIP_SHARE, 0.0)], [(0, 1)], [])
        tip = bpy.data.objects.new(TIP, mesh)
    return tip


def write_weights(character: bpy.types.Object, names: tuple[str, ...], joints: np.ndarray,
                  weights: np.ndarray) -> None:
    """Write a vertex group for each bone that moves something, in runs of equal weight: few calls, and no operator.

    Args:
        character: the mesh object.
        names: of the bones.
        joints, weights: (V, K) as in `BodyMesh`.
    """
    for joint, name in enumerate(names):
        share = np.sum(np.where(joints == joint, weights, 0.0), axis=1).round(3)
        used = np.flatnonzero(share)
        if not len(used):
            continue
        group = character.vertex_groups.new(name=name)
        order = used[np.argsort(share[used], kind="stable")]
        for run in np.split(order, np.flatnonzero(np.diff(share[order])) + 1):
            group.add(run.tolist(), float(share[run[0]]), "REPLACE")
