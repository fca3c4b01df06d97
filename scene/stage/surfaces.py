"""Materials of the stage by shader nodes: grass that holds near and far, paint on it, a crowd, boards and lamps."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.material import get_material
from .shader_tree import ShaderTree

STRIPES = {"Pitch grass": ((0.026, 0.086, 0.013), (0.062, 0.165, 0.027)),
           "Pitch grass mown": ((0.042, 0.122, 0.018), (0.095, 0.225, 0.038))}  # linear RGB, dark and light blades
PAINTS = {"white": ("Pitch line", ((0.42, 0.50, 0.38), (0.86, 0.86, 0.83))),
          "red": ("Red pitch line", ((0.22, 0.06, 0.01), (0.5, 0.01, 0.015))),
          "blue": ("Blue pitch line", ((0.02, 0.09, 0.14), (0.01, 0.03, 0.35)))}
"""Paint -> material, and linear RGB on grass: between the blades, and on them, which is the paint's own."""
FLOORS = {"wood": ("Wooden floor", (0.36, 0.2, 0.085), 0.35), "blue floor": ("Blue floor", (0.02, 0.09, 0.26), 0.5),
          "ice": ("Ice", (0.78, 0.86, 0.92), 0.12), "turf": ("Artificial turf", (0.03, 0.11, 0.2), 0.85)}
GRAIN = ((0.09, 0.32), (1.3, 0.23), (30.0, 0.45))  # per metre, weight: patches, tufts, blades
CROWD, SEAT = "Stand crowd", (0.5, 0.8)  # metres of a seat, along the row and up the rows
SHADE = 0.10  # strength of the crowd's own light: below a roof few bounces of light arrive
SHIRTS = ((0.015, 0.018, 0.03), (0.17, 0.025, 0.028), (0.30, 0.30, 0.29), (0.03, 0.045, 0.12), (0.06, 0.06, 0.07),
          (0.20, 0.15, 0.06), (0.13, 0.03, 0.03), (0.02, 0.02, 0.024))  # linear RGB of what the crowd wears
BOARDS = ((0.01, 0.03, 0.16), (0.62, 0.62, 0.60), (0.30, 0.01, 0.02), (0.01, 0.01, 0.012), (0.02, 0.18, 0.10))


def get_pitch_materials(ground: str, paints: list[str], units: float) -> list[bpy.types.Material]:
    """Return the materials of both stripes of a ground and of its paints; `units` are Blender units in a metre."""
    chosen = [PAINTS[paint] for paint in paints]
    if ground == "grass":
        stripes = [_get_grass(name, blades, tuple(np.mean(blades, axis=0)), units) for name, blades in STRIPES.items()]
        return [*stripes, *(_get_grass(name, blades, blades[1], units) for name, blades in chosen)]
    floor = get_material(*FLOORS[ground])
    return [floor, floor, *(get_material(f"{name} on a floor", blades[1], 0.4) for name, blades in chosen)]


def _get_grass(name: str, blades, plain: tuple[float, float, float], units: float) -> bpy.types.Material:
    """Return the material of a stripe, or of the paint on it, from its two colours and that of the solid view."""
    return _get_material(name, plain, lambda tree: _paint_grass(tree, blades, units))


def get_crowd_material() -> bpy.types.Material:
    """Return the material of seats with people on most of them; its UV map is in metres along and up the rows."""
    return _get_material(CROWD, (0.12, 0.12, 0.14), _paint_crowd)


def get_board_material() -> bpy.types.Material:
    """Return the material of the boards around the pitch, in coloured fields; its UV map is in metres."""
    return _get_material("Stand boards", (0.03, 0.05, 0.2), _paint_boards)


def get_lamp_material() -> bpy.types.Material:
    """Return the material of burning floodlights."""
    return _get_material("Floodlight lamps", (0.97, 0.99, 1.0), _paint_lamps)


def _get_material(name: str, rgb: tuple[float, float, float], paint) -> bpy.types.Material:
    """Return the material of a name; create it with the nodes of `paint(tree)` if the file has none of its own."""
    if bpy.data.materials.get((name, None)) is None:
        paint(ShaderTree(get_material(name, rgb, 0.9)))
    return bpy.data.materials[name, None]


def _paint_grass(tree: ShaderTree, colours, units: float) -> None:
    """Vary a colour from blade to blade, tuft to tuft and patch to patch."""
    place = tree.add("TexCoord").outputs["Object"]
    grains = [(tree.add("TexNoise", place, scale / units, 2.0).outputs[0], weight) for scale, weight in GRAIN]
    total = 0.0
    for grain, weight in grains:
        total = tree.compute("MULTIPLY_ADD", grain, weight, total)
    contrast = tree.add("MapRange", total, 0.34, 0.66).outputs[0]
    tree.bump(grains[-1][0], 0.55, 0.02 * units)
    tree.colour(tree.pick_colour(contrast, colours))
    tree.shade(Roughness=0.75, Specular_IOR_Level=0.15)


def _paint_crowd(tree: ShaderTree) -> None:
    """Draw heads and shoulders in rows of seats, each person with colours of their own, some seats empty."""
    place = tree.map_vector("DIVIDE", tree.add("TexCoord").outputs["UV"], (*SEAT, 1.0))
    seat = tree.map_vector("FLOOR", place)
    chance = tree.add("TexWhiteNoise", seat, noise_dimensions="3D")
    person = tree.add("SeparateColor", chance.outputs["Color"])
    inside = tree.add("SeparateXYZ", tree.map_vector("FRACTION", place))
    aside = tree.compute("SUBTRACT", inside.outputs["X"], tree.compute("MULTIPLY_ADD", person.outputs["Green"], 0.24,
                                                                       0.38))
    sitting = tree.compute("LESS_THAN", person.outputs["Blue"], 0.9)
    height = tree.compute("MULTIPLY_ADD", person.outputs["Red"], -0.1, inside.outputs["Y"])
    head, chest = (tree.compute("MULTIPLY", sitting, _draw_ellipse(tree, aside, height, *shape))
                   for shape in ((0.72, 0.15, 0.14), (0.22, 0.33, 0.42)))
    shirt = tree.pick_colour(chance.outputs["Value"], SHIRTS, "CONSTANT")
    skin = tree.pick_colour(person.outputs["Green"], ((0.05, 0.025, 0.015), (0.42, 0.24, 0.16)))
    seen = tree.mix(chest, (0.012, 0.014, 0.02), shirt)
    person_seen = tree.mix(head, seen, skin)
    tree.colour(person_seen)
    tree.shade(Roughness=0.95, Specular_IOR_Level=0.05, Emission_Color=person_seen, Emission_Strength=SHADE)


def _draw_ellipse(tree: ShaderTree, x, y, middle: float, width: float, height: float):
    """Return 1 inside an ellipse at (0, middle), else 0."""
    sides = [tree.compute("DIVIDE", x, width), tree.compute("DIVIDE", tree.compute("SUBTRACT", y, middle), height)]
    squares = [tree.compute("MULTIPLY", side, side) for side in sides]
    return tree.compute("LESS_THAN", tree.compute("ADD", *squares), 1.0)


def _paint_boards(tree: ShaderTree) -> None:
    """Paint fields of 6 m in a few colours, a little luminous."""
    along = tree.add("SeparateXYZ", tree.add("TexCoord").outputs["UV"]).outputs["X"]
    field = tree.compute("FLOOR", tree.compute("DIVIDE", along, 6.0))
    chance = tree.add("TexWhiteNoise", field, noise_dimensions="1D").outputs["Value"]
    colour = tree.pick_colour(chance, BOARDS, "CONSTANT")
    tree.colour(colour)
    tree.shade(Emission_Color=colour, Emission_Strength=0.35, Roughness=0.4)


def _paint_lamps(tree: ShaderTree) -> None:
    """Let the surface glow."""
    tree.shade(Emission_Color=(0.95, 0.98, 1.0, 1.0), Emission_Strength=60.0)
