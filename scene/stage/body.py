"""A low-poly character on an armature: one mesh, a vertex group for each bone, the shirt in the player's colour."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.material import colour
from ..rigs import armature

LOOKS = {  # linear RGB of the parts that all players share
    "skin": (0.46, 0.24, 0.15),
    "hair": (0.035, 0.02, 0.012),
    "shorts": (0.70, 0.70, 0.72),
    "socks": (0.70, 0.70, 0.72),
    "boots": (0.015, 0.015, 0.018),
}


def create(player, name: str, shirt, collection, scene: bpy.types.Scene, example) -> bpy.types.Object:
    """Create a character mesh on an armature, as its child.

    Args:
        player: the armature.
        name: of the mesh.
        shirt: linear RGB.
        collection: for the mesh.
        scene: says the unit scale.
        example: a `Motion` on the armature's skeleton; it shows how the body hangs on bones whose rest pose is
            ambiguous.
    Returns:
        The mesh object.
    """
    from ...beyond_mocap.appearance.body import MATERIALS, low_poly_body  # imports scipy, which is slow

    skeleton = armature.skeleton_of(player, scene)
    body = low_poly_body(skeleton, example=example)
    scale = armature.placement(player, scene).scale
    root = np.array(player.data.bones[skeleton.names[0]].head_local)
    mesh = bpy.data.meshes.new(f"{name} body")
    mesh.from_pydata((body.vertices / scale + root).tolist(), [], body.faces)
    mesh.polygons.foreach_set("material_index", np.asarray(body.material, np.int32))
    mesh.polygons.foreach_set("use_smooth", np.ones(len(body.faces), bool))
    for part in MATERIALS:
        material = f"{name} {part}" if part == "shirt" else part.capitalize()
        mesh.materials.append(colour(material, LOOKS.get(part, shirt)))
    person = bpy.data.objects.new(f"{name} body", mesh)
    collection.objects.link(person)
    person.parent = player
    person.modifiers.new("Armature", "ARMATURE").object = player
    _weigh(person, skeleton.names, body)
    return person


def _weigh(person: bpy.types.Object, names: tuple[str, ...], body) -> None:
    """Write a vertex group for each bone, in runs of equal weight: few calls, and no operator."""
    for joint, name in enumerate(names):
        group = person.vertex_groups.new(name=name)
        weights = np.sum(np.where(body.joints == joint, body.weights, 0.0), axis=1)
        for weight in np.unique(weights[weights > 1e-6]):
            group.add(np.flatnonzero(weights == weight).tolist(), float(weight), "REPLACE")
