"""A kit's colours on a character: the chosen materials are copied for each kit and get its colour; a texture keeps its
light and dark, as cloth in a team's colour does.

The copies hang on the objects' material slots, so meshes stay shared by all teams.
"""

from __future__ import annotations

import re

import bpy

from .copies import COPY_OF, list_meshes

PARTS = ("shirt", "shorts", "socks")
DYED = "beyond_mocap_kit"
"""Custom property of a material in a kit's colour: the material it is a copy of."""

KIT = "beyond_mocap_kit_name"
"""Custom property of such a material: the kit's name."""

WORN = "beyond_mocap_worn"
"""Custom property of a character's copy: the name of the kit that it wears, and part -> colour, linear RGB."""

_TINT = "Kit Colour"  # name of the node that colours a texture
_NAMES = {"shirt": re.compile(r"(?i)shirt|jersey|top|torso|tunic|kit$"),
          "shorts": re.compile(r"(?i)short|pants|trouser"), "socks": re.compile(r"(?i)sock|stocking")}


def find_kit_materials(original: bpy.types.Object) -> dict[str, bpy.types.Material]:
    """Find the materials of a character's kit: those chosen, else by name; part -> material."""
    chosen, worn = original.beyond_mocap_character, _list_materials(original)
    found = {part: getattr(chosen, part) for part in PARTS if getattr(chosen, part) is not None}
    for part in PARTS:
        named = next((one for one in worn if _NAMES[part].search(one.name) and one not in found.values()), None)
        if part not in found and named is not None:
            found[part] = named
    return found


def _list_materials(original: bpy.types.Object) -> list[bpy.types.Material]:
    """List the materials on a character's meshes, by mesh and slot."""
    slots = [slot for mesh in list_meshes(original) for slot in mesh.material_slots]
    return list(dict.fromkeys(slot.material for slot in slots if slot.material is not None))


def dress(body: bpy.types.Object, kit: str, colours: dict[str, tuple[float, float, float]]) -> None:
    """Dress a copy of a character in a kit; a kit of the same name gets these colours everywhere.

    Args:
        body: the copy's armature.
        kit: name of the kit.
        colours: part -> linear RGB; other parts keep their material.
    """
    body[WORN] = {"kit": kit, **{part: [float(one) for one in rgb] for part, rgb in colours.items()}}
    original = body.get(COPY_OF)
    if original is None:
        return
    parts = {material: part for part, material in find_kit_materials(original).items() if part in colours}
    for mesh in list_meshes(body):
        for slot in mesh.material_slots:
            plain = slot.material.get(DYED, slot.material) if slot.material is not None else None
            wanted = _find_dyed(plain, kit, colours[parts[plain]]) if plain in parts else plain
            if wanted is not None and wanted != slot.material:
                slot.link = "OBJECT"
                slot.material = wanted


def dress_copies(original: bpy.types.Object) -> None:
    """Dress all copies of a character again, each in the kit that it wears."""
    for body in [thing for thing in bpy.data.objects if thing.type == "ARMATURE" and thing.get(COPY_OF) == original]:
        if WORN in body:
            worn = body[WORN].to_dict()
            dress(body, worn.pop("kit"), {part: tuple(rgb) for part, rgb in worn.items()})


def _find_dyed(plain: bpy.types.Material, kit: str, rgb: tuple[float, float, float]) -> bpy.types.Material:
    """Find the copy of a material for a kit, or create it; it gets the kit's colour."""
    same = (one for one in bpy.data.materials if one.get(DYED) == plain and one.get(KIT) == kit)
    found = next(same, None)
    if found is None:
        found = plain.copy()
        found[DYED], found[KIT], found.name = plain, kit, f"{plain.name} {kit}"
    _dye(found, (*rgb, 1.0))
    return found


def _dye(material: bpy.types.Material, rgba: tuple[float, ...]) -> None:
    """Give a material a colour: its shader's, multiplied with the lightness of the texture if it has one."""
    material.diffuse_color = (*(channel**0.6 for channel in rgba[:3]), 1.0)  # brighter for the solid view
    tree = material.node_tree
    shader = next((one for one in tree.nodes if one.type == "BSDF_PRINCIPLED"), None) if tree is not None else None
    if shader is None:
        return
    colour = shader.inputs["Base Color"]
    colour.default_value = rgba
    if colour.is_linked:
        tint = tree.nodes.get(_TINT) or _add_tint(tree, colour)
        _list_colours(tint.inputs)[1].default_value = rgba


def _add_tint(tree: bpy.types.NodeTree, colour: bpy.types.NodeSocket) -> bpy.types.Node:
    """Add a node between a texture and a shader that multiplies the texture's lightness with a colour."""
    source = colour.links[0].from_socket
    lightness, tint = tree.nodes.new("ShaderNodeRGBToBW"), tree.nodes.new("ShaderNodeMix")
    tint.name, tint.data_type, tint.blend_type = _TINT, "RGBA", "MULTIPLY"
    tint.inputs[0].default_value = 1.0
    tree.links.new(source, lightness.inputs[0])
    tree.links.new(lightness.outputs[0], _list_colours(tint.inputs)[0])
    tree.links.new(_list_colours(tint.outputs)[0], colour)
    return tint


def _list_colours(sockets) -> list[bpy.types.NodeSocket]:
    """List the sockets of a mix node that are colours."""
    return [one for one in sockets if one.type == "RGBA"]
