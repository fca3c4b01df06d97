"""Plain colours as materials."""

from __future__ import annotations

import bpy


def colour(name: str, rgb: tuple[float, float, float], roughness: float = 0.7) -> bpy.types.Material:
    """Return the material `name`; create it with this colour (linear RGB) if the file has none of its own."""
    found = bpy.data.materials.get((name, None))  # a linked material cannot be changed
    return found if found is not None else made(name, rgb, roughness)


def made(name: str, rgb: tuple[float, float, float], roughness: float = 0.7) -> bpy.types.Material:
    """Create a material of this colour (linear RGB); Blender appends a number where the name is taken."""
    material = bpy.data.materials.new(name)
    material["beyond_mocap_take"] = True  # created here: may be removed when unused
    if material.node_tree is None:  # Blender before 5.0 creates it on request
        material.use_nodes = True
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (*rgb, 1.0)
    shader.inputs["Roughness"].default_value = roughness
    material.diffuse_color = (*(channel**0.6 for channel in rgb), 1.0)  # brighter for the solid view
    return material
