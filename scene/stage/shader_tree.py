"""A material's shader nodes, added one after the other by code."""

from __future__ import annotations

import bpy


class ShaderTree:
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
        self.tint(self.map_vector("DIVIDE", output, plain))

    def tint(self, ratio) -> None:
        """Multiply the shader's plain colour by an output."""
        plain = tuple(self.shader.inputs["Base Color"].default_value[:3])
        self.shade(Base_Color=self.mix(1.0, plain, ratio, "MULTIPLY"))

    def mix(self, share, first, second, blend: str = "MIX"):
        """Return a colour between two; each a linear RGB or an output."""
        node = self.add("Mix", data_type="RGBA", blend_type=blend)
        sockets = [socket for socket in node.inputs if socket.enabled]
        for socket, value in zip(sockets, (share, first, second)):
            self.set(socket, (*value, 1.0) if isinstance(value, tuple) else value)
        return next(socket for socket in node.outputs if socket.enabled)

    def bump(self, height, strength: float, distance: float) -> None:
        """Let the surface rise by an output times `distance`, in Blender units."""
        node = self.add("Bump", strength, distance)
        self.set(node.inputs["Height"], height)
        self.shade(Normal=node.outputs[0])

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
