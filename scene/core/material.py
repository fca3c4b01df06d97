"""Plain colours as materials."""

from __future__ import annotations

import bpy


def colour(name: str, rgb: tuple[float, float, float], roughness: float = 0.7) -> bpy.types.Material:
    """The material `name`, made with this colour (linear RGB) where the file has none of that name of its own yet."""
    found = bpy.data.materials.get((name, None))  # a linked one cannot be changed
    return found if found is not None else made(name, rgb, roughness)


def made(name: str, rgb: tuple[float, float, float], roughness: float = 0.7) -> bpy.types.Material:
    """A new material of this colour (linear RGB), `name` or with a number behind it where that is taken."""
    material = bpy.data.materials.new(name)
    material["beyond_mocap_take"] = True  # ours: may go when nothing wears it any more
    if material.node_tree is None:  # Blender before 5.0 makes it on request
        material.use_nodes = True
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (*rgb, 1.0)
    shader.inputs["Roughness"].default_value = roughness
    material.diffuse_color = (*(channel**0.6 for channel in rgb), 1.0)  # brighter: the solid view has its own light
    return material
