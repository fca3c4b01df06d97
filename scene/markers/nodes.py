"""The node group that plays markers, and the edges between the markers of a segment.

The trajectories are a mesh, sample after sample, each with as many vertices as the cloud has. Blender itself samples
them at the scene's time, so a saved file plays without the extension. A marker that is not visible has neither sphere
nor edges.
"""

from __future__ import annotations

from contextlib import contextmanager

import bmesh
import bpy
import numpy as np

from ..core.material import get_material

NAME = "Marker Cloud"
SEEN, SIDE, MARKER = "seen", "side", "marker"
"""Attributes: of the trajectories, whether a sample is visible; of a cloud's vertices, an index into COLOURS, and the
index of the marker."""
COLOURS = (("Marker", (0.80, 0.80, 0.80)), ("Marker left", (0.80, 0.05, 0.03)), ("Marker right", (0.03, 0.50, 0.08)),
           ("Marker without segment", (0.95, 0.55, 0.02)))
INPUTS = (("Trajectories", "NodeSocketObject", None, "The mesh of all samples"),
          ("Markers", "NodeSocketInt", 1, "Vertices per sample"),
          ("Samples", "NodeSocketInt", 1, "Number of samples"),
          ("Start", "NodeSocketFloat", 1.0, "Scene frame of the first sample"),
          ("Step", "NodeSocketFloat", 1.0, "Samples per scene frame"),
          ("Radius", "NodeSocketFloat", 0.007, "Radius of the spheres in Blender units"),
          ("Lines", "NodeSocketBool", True, "Draw lines between the markers of a segment"))

NEIGHBOURS = 3  # nearest markers to which each one gets an edge

_deferred: list[bool] = []


def get_node_group() -> bpy.types.NodeTree:
    """Return the node group; create it if the file does not have it yet."""
    found = bpy.data.node_groups.get(NAME)
    if found is not None and all(name in found.interface.items_tree for name, *_ in INPUTS):
        return found
    tree = bpy.data.node_groups.new(NAME, "GeometryNodeTree")
    tree.is_modifier = True
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    for name, kind, value, description in INPUTS:
        socket = tree.interface.new_socket(name, in_out="INPUT", socket_type=kind, description=description)
        if value is not None:
            socket.default_value = value
    _Builder(tree).build_group()
    return tree


def add_modifier(cloud: bpy.types.Object, values: dict) -> bpy.types.Modifier:
    """Add the modifier that plays a cloud, with inputs by name."""
    modifier = cloud.modifiers.new(NAME, "NODES")
    modifier.node_group = get_node_group()
    modifier.show_on_cage = True
    for name, value in values.items():
        set_input(modifier, name, value)
    return modifier


def find_modifier(cloud: bpy.types.Object) -> bpy.types.Modifier | None:
    """Find the modifier that plays a cloud; None where there is none."""
    nodes = (found for found in cloud.modifiers if found.type == "NODES" and found.node_group is not None)
    return next((found for found in nodes if "Trajectories" in found.node_group.interface.items_tree), None)


def set_input(modifier: bpy.types.Modifier, name: str, value) -> None:
    """Set an input by its name."""
    identifier = modifier.node_group.interface.items_tree[name].identifier
    if hasattr(modifier, "properties"):  # Blender 5.2
        getattr(modifier.properties.inputs, identifier).value = value
    else:
        modifier[identifier] = value
    modifier.id_data.update_tag()


def get_input(modifier: bpy.types.Modifier, name: str):
    """Return an input by its name."""
    identifier = modifier.node_group.interface.items_tree[name].identifier
    if hasattr(modifier, "properties"):
        return getattr(modifier.properties.inputs, identifier).value
    return modifier[identifier]


class _Builder:
    """Builds the nodes of the group."""

    def __init__(self, tree: bpy.types.NodeTree):
        """Start with an empty tree that has its inputs and outputs."""
        self.tree = tree
        self.inputs = self.add_node("NodeGroupInput").outputs

    def add_node(self, kind: str, *sources, **settings):
        """Add a node; its first sockets are fed from `sources` (sockets or values; None leaves one as it is)."""
        node = self.tree.nodes.new(kind)
        node.location = (220 * (len(self.tree.nodes) % 12), -220 * (len(self.tree.nodes) // 12))
        for name, value in settings.items():
            setattr(node, name, value)
        feeds = [socket for socket in node.inputs if socket.enabled]
        for socket, source in zip(feeds, sources):
            if isinstance(source, bpy.types.NodeSocket):
                self.tree.links.new(source, socket)
            elif source is not None:
                socket.default_value = source
        return node

    def add_output(self, kind: str, *sources, **settings):
        """Add a node and return its first output."""
        return next(socket for socket in self.add_node(kind, *sources, **settings).outputs if socket.enabled)

    def add_math(self, operation: str, *sources):
        """Add arithmetic."""
        return self.add_output("ShaderNodeMath", *sources, operation=operation)

    def add_integer_math(self, operation: str, *sources):
        """Add integer arithmetic, exact for any number of samples."""
        return self.add_output("FunctionNodeIntegerMath", *sources, operation=operation)

    def add_boolean_math(self, operation: str, *sources):
        """Add and, or, not."""
        return self.add_output("FunctionNodeBooleanMath", *sources, operation=operation)

    def build_group(self) -> None:
        """Build the whole group."""
        points, seen = self.build_sampling()
        moved = self.add_output("GeometryNodeSetPosition", self.inputs["Geometry"], None, points)
        stored = self.add_output("GeometryNodeStoreNamedAttribute", moved, None, SEEN, seen, data_type="BOOLEAN",
                                 domain="POINT")
        visible = self.add_output("GeometryNodeInputNamedAttribute", SEEN, data_type="BOOLEAN")
        hidden = self.add_boolean_math("NOT", self.add_boolean_math("AND", visible, self.inputs["Lines"]))
        lines = self.add_output("GeometryNodeDeleteGeometry", stored, hidden, domain="EDGE", mode="EDGE_FACE")
        joined = self.add_node("GeometryNodeJoinGeometry")
        for source in (*reversed([self.build_spheres(stored, visible, number) for number in range(len(COLOURS))]),
                       lines):
            self.tree.links.new(source, joined.inputs[0])
        self.add_node("NodeGroupOutput", joined.outputs[0])

    def build_sampling(self):
        """Return where each vertex is now, and whether it is visible: interpolated where both samples are visible."""
        frame = self.add_node("GeometryNodeInputSceneTime").outputs["Frame"]
        row = self.add_math("MULTIPLY", self.add_math("SUBTRACT", frame, self.inputs["Start"]), self.inputs["Step"])
        end = self.add_integer_math("SUBTRACT", self.inputs["Samples"], 1)
        row = self.add_math("MAXIMUM", self.add_math("MINIMUM", row, end), 0.0)
        before = self.add_output("FunctionNodeFloatToInt", row, rounding_mode="FLOOR")
        share = self.add_math("SUBTRACT", row, before)
        after = self.add_integer_math("MINIMUM", self.add_integer_math("ADD", before, 1), end)
        (place, saw), (then, sees) = self.build_sample(before), self.build_sample(after)
        late = self.add_math("GREATER_THAN", share, 0.5)
        share = self.add_output("GeometryNodeSwitch", self.add_boolean_math("AND", saw, sees), sees, share,
                                input_type="FLOAT")
        points = self.add_output("ShaderNodeMix", share, place, then, data_type="VECTOR", clamp_factor=True)
        return points, self.add_output("GeometryNodeSwitch", late, saw, sees, input_type="BOOLEAN")

    def build_sample(self, row):
        """Return place and visibility of each vertex in one sample."""
        about = self.add_node("GeometryNodeObjectInfo", self.inputs["Trajectories"], transform_space="ORIGINAL")
        marker = self.add_output("GeometryNodeInputNamedAttribute", MARKER, data_type="INT")
        at = self.add_integer_math("ADD", self.add_integer_math("MULTIPLY", row, self.inputs["Markers"]), marker)
        position = self.add_output("GeometryNodeInputPosition")
        sight = self.add_output("GeometryNodeInputNamedAttribute", SEEN, data_type="BOOLEAN")
        geometry = about.outputs["Geometry"]
        place = self.add_output("GeometryNodeSampleIndex", geometry, position, at, data_type="FLOAT_VECTOR",
                                domain="POINT")
        return place, self.add_output("GeometryNodeSampleIndex", geometry, sight, at, data_type="BOOLEAN",
                                      domain="POINT")

    def build_spheres(self, points, visible, number: int):
        """Return spheres on the visible markers of one colour."""
        side = self.add_output("GeometryNodeInputNamedAttribute", SIDE, data_type="INT")
        is_own_colour = self.add_output("FunctionNodeCompare", side, number, data_type="INT", operation="EQUAL")
        ball = self.add_output("GeometryNodeMeshIcoSphere", self.inputs["Radius"], 2)
        name, rgb = COLOURS[number]
        ball = self.add_output("GeometryNodeSetMaterial", ball, None, get_material(name, rgb))
        return self.add_output("GeometryNodeInstanceOnPoints", points,
                               self.add_boolean_math("AND", visible, is_own_colour), ball)


@contextmanager
def defer_lines():
    """Defer drawing of edges while many labels change."""
    _deferred.append(True)
    try:
        yield
    finally:
        _deferred.pop()


def draw_lines(cloud: bpy.types.Object) -> None:
    """Write edges and colours by the segments of the labels, in Edit Mode too; the selection stays."""
    mesh, labels = cloud.data, cloud.beyond_mocap_cloud.labels
    if _deferred or cloud.library is not None or mesh.library is not None:
        return
    if not mesh.is_editmode and MARKER not in mesh.attributes:
        return
    shape = bmesh.from_edit_mesh(mesh) if mesh.is_editmode else bmesh.new()
    if not mesh.is_editmode:
        shape.from_mesh(mesh)
    colours = shape.verts.layers.int.get(SIDE) or shape.verts.layers.int.new(SIDE)
    marker_layer = shape.verts.layers.int[MARKER]
    shape.verts.ensure_lookup_table()
    segments = [labels[vertex[marker_layer]].segment if vertex[marker_layer] < len(labels) else ""
                for vertex in shape.verts]
    for vertex, segment in zip(shape.verts, segments):
        thing = vertex[marker_layer] < len(labels) and labels[vertex[marker_layer]].role in ("BALL", "OTHER")
        vertex[colours] = 0 if thing else find_colour_index(segment)
    for edge in list(shape.edges):
        shape.edges.remove(edge)
    for one, other in find_edges(np.array([vertex.co for vertex in shape.verts]), segments):
        shape.edges.new((shape.verts[one], shape.verts[other]))
    if mesh.is_editmode:
        bmesh.update_edit_mesh(mesh)
    else:
        shape.to_mesh(mesh)
        shape.free()


def find_edges(places: np.ndarray, segments: list[str]) -> list[tuple[int, int]]:
    """Find pairs of markers: each with its nearest ones of the same segment.

    Args:
        places: (M, 3).
        segments: name for each marker, "" for none.
    Returns:
        Index pairs, sorted.
    """
    found = set()
    for segment in sorted({name for name in segments if name}):
        own = np.flatnonzero([name == segment for name in segments])
        distances = np.linalg.norm(places[own, None] - places[None, own], axis=-1)
        for row, order in zip(own, np.argsort(distances, axis=1, kind="stable")):
            near = [own[other] for other in order[: NEIGHBOURS + 1] if own[other] != row]
            found |= {(int(min(row, other)), int(max(row, other))) for other in near}
    return sorted(found)


def find_colour_index(segment: str) -> int:
    """Return the index into COLOURS for the markers of a segment."""
    if not segment:
        return 3
    return 1 if segment.startswith("Left") else 2 if segment.startswith("Right") else 0
