"""Paint on a body by where each point is on the sculpted athlete: lips, eyes, hair, laces, cloth with folds.

The shader paints each pixel, so a light body has the same face and kit as the full one.
"""

from __future__ import annotations

import bpy

from ...beyond_mocap.appearance.landmarks import HEAD
from ..core.measure import units_per_metre
from .shader_tree import ShaderTree

ATTRIBUTE = "sculpted"
"""Attribute of a body's mesh: `BodyMesh.sculpted`."""

FACE = (  # middle from HEAD and radii m of an ellipsoid, mirrored to the right; share of it that fades; its tint
    ((0.085, 0.0315, 0.037), (0.030, 0.026, 0.019), 0.9, (0.84, 0.72, 0.72)),  # sockets
    ((0.090, 0.0310, 0.0400), (0.025, 0.0135, 0.0088), 0.4, (0.38, 0.28, 0.25)),  # edges of the lids
    ((0.088, 0.0310, 0.0585), (0.030, 0.0230, 0.0055), 0.7, (0.42, 0.36, 0.33)),  # below the brows
    ((0.072, 0.0420, 0.002), (0.032, 0.030, 0.026), 1.0, (1.00, 0.80, 0.78)),  # cheeks
    ((0.110, 0.0000, 0.002), (0.020, 0.018, 0.016), 0.9, (1.00, 0.82, 0.80)),  # nose
    ((-0.002, 0.0800, 0.030), (0.024, 0.022, 0.038), 0.8, (1.00, 0.80, 0.78)),  # ears
    ((0.100, 0.0000, -0.0325), (0.032, 0.0265, 0.0125), 0.35, (0.80, 0.48, 0.47)),  # lips
    ((0.100, 0.0000, -0.0313), (0.032, 0.0245, 0.0026), 0.8, (0.42, 0.28, 0.27)),  # between the lips
)
EYE, IRIS = (0.0315, 0.040), 0.0070  # m to the left of HEAD and above it; radius of the iris
IRIS_RINGS = ((0.004, 0.003, 0.003), (0.010, 0.006, 0.004), (0.105, 0.052, 0.022), (0.080, 0.038, 0.016),
              (0.020, 0.012, 0.008))  # linear RGB from the pupil out
LACES = ((0.088, 0.090, 0.075), (0.040, 0.013, 0.060), 0.2), 0.013  # as in FACE, from the ground; m between laces
STRANDS = 34.0, 26.0  # of hair: waves per radian around the head, and per metre down
CLOTHS = ("shirt", "shorts", "socks", "trim", "gloves")
FOLDS, WEAVE = (11.0, 11.0, 6.0), 800.0  # waves per metre of cloth
FOLD_NOISE = (1.0, 2.5, 0.5, None, 1.1)  # scale, detail, roughness, lacunarity (as it is), distortion


def paint_part(material: bpy.types.Material, part: str) -> bpy.types.Material:
    """Paint the new material of a part of the body, such as "skin", and return it; eyes and numbers stay plain."""
    tree, units = ShaderTree(material), units_per_metre(bpy.context.scene)
    place = tree.add("Attribute", attribute_name=ATTRIBUTE).outputs["Vector"]
    painter = {"skin": _paint_skin, "hair": _paint_hair, "pupils": _paint_iris, "boots": _paint_boots}.get(part)
    if painter is not None:
        painter(tree, place, units)
    elif part in CLOTHS:
        _paint_cloth(tree, place, units)
    return material


def _paint_skin(tree: ShaderTree, place, units: float) -> None:
    mottle = tree.add("TexNoise", place, 70.0, 3.0).outputs[0]
    colour = tree.mix(mottle, (0.92, 0.90, 0.90), (1.08, 1.08, 1.06))
    near = _mirror(tree, tree.map_vector("SUBTRACT", place, tuple(HEAD)))
    for middle, radii, fade, tint in FACE:
        colour = tree.mix(_draw_spot(tree, near, middle, radii, fade), colour, tint, "MULTIPLY")
    tree.tint(colour)
    tree.bump(mottle, 0.3, 0.002 * units)


def _paint_iris(tree: ShaderTree, place, _units: float) -> None:
    near = _mirror(tree, tree.map_vector("SUBTRACT", place, tuple(HEAD)))
    aside = tree.map_vector("MULTIPLY", tree.map_vector("SUBTRACT", near, (0.0, *EYE)), (0.0, 1.0, 1.0))
    share = tree.compute("DIVIDE", _measure(tree, aside), IRIS)
    tree.colour(tree.pick_colour(share, IRIS_RINGS))


def _paint_hair(tree: ShaderTree, place, units: float) -> None:
    """Draw strands that fall from the crown to all sides."""
    near = tree.map_vector("SUBTRACT", place, tuple(HEAD + [-0.02, 0.0, 0.0]))
    flat = tree.map_vector("NORMALIZE", tree.map_vector("MULTIPLY", near, (1.0, 1.0, 0.0)))
    around = tree.map_vector("SCALE", flat)
    around.node.inputs["Scale"].default_value = STRANDS[0]
    down = tree.map_vector("MULTIPLY", near, (0.0, 0.0, STRANDS[1]))
    strand = tree.add("TexNoise", tree.map_vector("ADD", around, down), 1.0, 4.0, 0.65).outputs[0]
    light = tree.add("MapRange", strand, 0.32, 0.68).outputs[0]
    tree.tint(tree.mix(light, (0.45, 0.45, 0.45), (1.8, 1.7, 1.6)))
    tree.bump(strand, 0.8, 0.008 * units)


def _paint_boots(tree: ShaderTree, place, _units: float) -> None:
    near = _mirror(tree, place)
    (spot, step), ahead = LACES, tree.add("SeparateXYZ", near).outputs["X"]
    stripe = tree.compute("LESS_THAN", tree.compute("FRACT", tree.compute("DIVIDE", ahead, step)), 0.42)
    laces = tree.compute("MULTIPLY", stripe, _draw_spot(tree, near, *spot))
    tree.tint(tree.mix(laces, (1.0, 1.0, 1.0), (38.0, 38.0, 34.0)))


def _paint_cloth(tree: ShaderTree, place, units: float) -> None:
    """Raise folds that fall downwards, and the weave."""
    folds = tree.add("TexNoise", tree.map_vector("MULTIPLY", place, FOLDS), *FOLD_NOISE).outputs[0]
    weave = tree.add("TexNoise", place, WEAVE, 1.0).outputs[0]
    tree.bump(tree.compute("MULTIPLY_ADD", weave, 0.03, folds), 0.7, 0.028 * units)
    tree.shade(Sheen_Weight=0.12)


def _mirror(tree: ShaderTree, place):
    """Mirror places of the right side to the left."""
    split = tree.add("SeparateXYZ", place)
    aside = tree.compute("ABSOLUTE", split.outputs["Y"])
    return tree.add("CombineXYZ", split.outputs["X"], aside, split.outputs["Z"]).outputs[0]


def _draw_spot(tree: ShaderTree, place, middle, radii, fade: float):
    """Return 1 inside an ellipsoid (middle and radii in m) that falls to 0 over the share `fade` within its edge."""
    scaled = tree.map_vector("DIVIDE", tree.map_vector("SUBTRACT", place, middle), radii)
    return tree.add("MapRange", _measure(tree, scaled), 1.0, 1.0 - fade).outputs[0]


def _measure(tree: ShaderTree, vector):
    """Return the length of a vector."""
    return tree.add("VectorMath", vector, operation="LENGTH").outputs["Value"]
