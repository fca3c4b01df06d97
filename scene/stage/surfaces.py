"""Materials of the stage by shader nodes: grass that holds near and far, paint on it, a crowd, boards and lamps."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.material import get_material

STRIPES = {"Pitch grass": ((0.026, 0.086, 0.013), (0.062, 0.165, 0.027)),
           "Pitch grass mown": ((0.042, 0.122, 0.018), (0.095, 0.225, 0.038))}  # linear RGB, dark and light blades
PAINT, WHITE = "Pitch line", ((0.42, 0.50, 0.38), (0.86, 0.86, 0.83))
GRAIN = ((0.09, 0.32), (1.3, 0.23), (30.0, 0.45))  # per metre, weight: patches, tufts, blades
CROWD, SEAT = "Stand crowd", (0.5, 0.8)  # metres of a seat, along the row and up the rows
SHIRTS = ((0.015, 0.018, 0.03), (0.17, 0.025, 0.028), (0.30, 0.30, 0.29), (0.03, 0.045, 0.12), (0.06, 0.06, 0.07),
          (0.20, 0.15, 0.06), (0.13, 0.03, 0.03), (0.02, 0.02, 0.024))  # linear RGB of what the crowd wears
BOARDS = ((0.01, 0.03, 0.16), (0.62, 0.62, 0.60), (0.30, 0.01, 0.02), (0.01, 0.01, 0.012), (0.02, 0.18, 0.10))


def get_pitch_materials(units: float) -> list[bpy.types.Material]:
    """Return the materials of both stripes and of the lines; `units` are Blender units in a metre."""
    blades = {**STRIPES, PAINT: WHITE}
    plain = {**{name: tuple(np.mean(pair, axis=0)) for name, pair in STRIPES.items()}, PAINT: WHITE[1]}
    return [_get_material(name, plain[name], lambda tree, pair=pair: _paint_grass(tree, pair, units))
            for name, pair in blades.items()]


def get_crowd_material() -> bpy.types.Material:
    """Return the material of seats with people on most of them; its UV map is in metres along and up the rows."""
    return _get_material(CROWD, (0.12, 0.12, 0.14), _paint_crowd)


def get_board_material() -> bpy.types.Material:
    """Return the material of the boards around the pitch, in coloured fields; its UV map is in metres."""
    return _get_material("Stand boards", (0.03, 0.05, 0.2), _paint_boards)


def get_lamp_material() -> bpy.types.Material:
    """Return the material of burning floodlights."""
    return _get_material("Floodlight lamps", (1.0, 1.0, 0.95), _paint_lamps)


def _get_material(name: str, rgb: tuple[float, float, float], paint) -> bpy.types.Material:
    """Return the material of a name; create it with the nodes of `paint(tree)` if the file has none of its own."""
    if bpy.data.materials.get((name, None)) is None:
        paint(_Tree(get_material(name, rgb, 0.9)))
    return bpy.data.materials[name, None]


class _Tree:
    """Adds nodes to a material, each with its inputs; an input is a number or vector, or another node's output."""

    def __init__(self, material: bpy.types.Material):
        self.tree = material.node_tree
        self.shader = next(node for node in self.tree.nodes if node.type == "BSDF_PRINCIPLED")

    def add(self, kind: str, *inputs, **settings):
        """Add a node with settings and its first inputs; None leaves one as it is. Return the node."""
        node = self.tree.nodes.new(f"ShaderNode{kind}")
        for name, value in settings.items():
            setattr(node, name, value)
        for socket, value in zip([socket for socket in node.inputs if socket.enabled], inputs):
            if value is not None:
                self.set(socket, value)
        return node

    def set(self, socket, value) -> None:
        """Link a node's output to a socket, or set its value."""
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        else:
            socket.default_value = value

    def shade(self, **inputs) -> None:
        """Set inputs of the Principled shader; underscores are spaces."""
        for name, value in inputs.items():
            self.set(self.shader.inputs[name.replace("_", " ")], value)

    def colour(self, output) -> None:
        """Colour the shader by an output, written as a multiple of the plain colour: exporters keep that one."""
        plain = tuple(self.shader.inputs["Base Color"].default_value[:3])
        ratio = self.map_vector("DIVIDE", output, plain)
        self.shade(Base_Color=_mix(self, 1.0, plain, ratio, "MULTIPLY"))

    def compute(self, operation: str, *inputs):
        """Add a math node; return its output."""
        return self.add("Math", *inputs, operation=operation).outputs[0]

    def map_vector(self, operation: str, *inputs):
        """Add a vector math node; return its vector."""
        return self.add("VectorMath", *inputs, operation=operation).outputs["Vector"]

    def pick_colour(self, share, colours, interpolation: str = "LINEAR"):
        """Add a colour ramp over colours (linear RGB) at equal distances; return its colour."""
        ramp = self.add("ValToRGB", share)
        elements = ramp.color_ramp.elements
        ramp.color_ramp.interpolation = interpolation
        step = len(colours) if interpolation == "CONSTANT" else len(colours) - 1
        for number, colour in enumerate(colours):
            element = elements[number] if number < 2 else elements.new(1.0)
            element.position, element.color = number / step, (*colour, 1.0)
        return ramp.outputs["Color"]


def _paint_grass(tree: _Tree, colours, units: float) -> None:
    """Vary a colour from blade to blade, tuft to tuft and patch to patch."""
    place = tree.add("TexCoord").outputs["Object"]
    grains = [(tree.add("TexNoise", place, scale / units, 2.0).outputs[0], weight) for scale, weight in GRAIN]
    total = 0.0
    for grain, weight in grains:
        total = tree.compute("MULTIPLY_ADD", grain, weight, total)
    contrast = tree.add("MapRange", total, 0.34, 0.66).outputs[0]
    bump = tree.add("Bump", 0.55, 0.02 * units)
    tree.set(bump.inputs["Height"], grains[-1][0])
    tree.colour(tree.pick_colour(contrast, colours))
    tree.shade(Normal=bump.outputs[0], Roughness=0.75, Specular_IOR_Level=0.15)


def _paint_crowd(tree: _Tree) -> None:
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
    seen = _mix(tree, chest, (0.012, 0.014, 0.02), shirt)
    tree.colour(_mix(tree, head, seen, skin))
    tree.shade(Roughness=0.95, Specular_IOR_Level=0.05)


def _draw_ellipse(tree: _Tree, x, y, middle: float, width: float, height: float):
    """Return 1 inside an ellipse at (0, middle), else 0."""
    sides = [tree.compute("DIVIDE", x, width), tree.compute("DIVIDE", tree.compute("SUBTRACT", y, middle), height)]
    squares = [tree.compute("MULTIPLY", side, side) for side in sides]
    return tree.compute("LESS_THAN", tree.compute("ADD", *squares), 1.0)


def _mix(tree: _Tree, share, first, second, blend: str = "MIX"):
    """Return a colour between two; each a linear RGB or an output."""
    node = tree.add("Mix", data_type="RGBA", blend_type=blend)
    sockets = [socket for socket in node.inputs if socket.enabled]
    for socket, value in zip(sockets, (share, first, second)):
        tree.set(socket, (*value, 1.0) if isinstance(value, tuple) else value)
    return next(socket for socket in node.outputs if socket.enabled)


def _paint_boards(tree: _Tree) -> None:
    """Paint fields of 6 m in a few colours, a little luminous."""
    along = tree.add("SeparateXYZ", tree.add("TexCoord").outputs["UV"]).outputs["X"]
    field = tree.compute("FLOOR", tree.compute("DIVIDE", along, 6.0))
    chance = tree.add("TexWhiteNoise", field, noise_dimensions="1D").outputs["Value"]
    colour = tree.pick_colour(chance, BOARDS, "CONSTANT")
    tree.colour(colour)
    tree.shade(Emission_Color=colour, Emission_Strength=0.35, Roughness=0.4)


def _paint_lamps(tree: _Tree) -> None:
    """Let the surface glow."""
    tree.shade(Emission_Color=(1.0, 0.97, 0.9, 1.0), Emission_Strength=60.0)
