"""Bodies of a match: one armature, one mesh a kit and one a number, shared by all whose bones agree. Numbers are
Blender's own digits, cut fine enough to lie on the cloth, big on the back, small in front."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bmesh
import bpy
import numpy as np

from ...beyond_mocap.motion.motion import Motion
from ...beyond_mocap.motion.skeleton import Skeleton
from ..core.measure import units_per_metre
from ..rigs import armature
from . import ours
from .kits import Kit, cloth, kit_of
from .load import Person

if TYPE_CHECKING:
    from ...beyond_mocap.appearance.body import BodyMesh

SIZES = {"back": 0.235, "chest": 0.095}  # metres that digits are tall
WIDEST = {"back": 0.26, "chest": 0.13}  # metres that two digits may take
FINE = 0.018  # metres between cuts


class Wardrobe:
    """Dresses people; what has been made for one serves all others that it fits."""

    def __init__(self, context: bpy.types.Context, colours: dict[str, str]):
        self.context, self.colours = context, colours
        self.bones: dict[tuple, bpy.types.Armature] = {}
        self.shapes: dict[tuple, object] = {}
        self.meshes: dict[tuple, bpy.types.Mesh] = {}
        self.cloths: dict[tuple, bpy.types.Material] = {}

    def dress(self, person: Person, collection) -> list[bpy.types.Object]:
        """An armature, and the meshes on it: body, and shirt number where he has one."""
        example = person.motions[0][1]
        fits = _fits(example.skeleton)
        who = ours.mark(self._armature(example, label(person), collection, fits))
        who[ours.PLAYER] = person.id
        kit = kit_of(person, self.colours)
        made = [self._on(who, "body", self._body(example, fits, kit), collection)]
        if person.number >= 0:
            made.append(self._on(who, "number", self._number(example, fits, kit, person.number), collection))
        return [who, *made]

    def _armature(self, example: Motion, name: str, collection, fits: tuple) -> bpy.types.Object:
        if fits not in self.bones:
            first = armature.create(self.context, example.skeleton, name, collection)
            first.data.name = "Match bones"
            self.bones[fits] = first.data
            return first
        thing = bpy.data.objects.new(name, self.bones[fits])
        collection.objects.link(thing)
        return thing

    def _on(self, who: bpy.types.Object, part: str, mesh: bpy.types.Mesh, collection) -> bpy.types.Object:
        thing = bpy.data.objects.new(f"{who.name} {part}", mesh)
        collection.objects.link(thing)
        thing.parent = who
        thing.modifiers.new("Armature", "ARMATURE").object = who
        if not thing.vertex_groups:
            self._weigh(thing, mesh, who)
        return ours.mark(thing)

    def _shape(self, example: Motion, fits: tuple):
        """The low-poly body on those bones."""
        from ...beyond_mocap.appearance.body import low_poly_body  # brings scipy, which is slow to import

        if fits not in self.shapes:
            self.shapes[fits] = low_poly_body(example.skeleton, example=example)
        return self.shapes[fits]

    def _body(self, example: Motion, fits: tuple, kit: Kit) -> bpy.types.Mesh:
        from ...beyond_mocap.appearance.body import MATERIALS

        key = (fits, kit.name)
        if key not in self.meshes:
            body = self._shape(example, fits)
            mesh = self._mesh(f"Match {kit.name}", fits, body.vertices, body.faces)
            mesh.polygons.foreach_set("material_index", np.asarray(body.material, np.int32))
            mesh.polygons.foreach_set("use_smooth", np.ones(len(body.faces), bool))
            for part in MATERIALS:
                mesh.materials.append(self._cloth(kit, part))
            self.shapes[mesh] = example.skeleton.names, body.joints, body.weights
            self.meshes[key] = mesh
        return self.meshes[key]

    def _number(self, example: Motion, fits: tuple, kit: Kit, number: int) -> bpy.types.Mesh:
        key = (fits, number, kit.name)
        if key not in self.meshes:
            drawn = (fits, number)
            if drawn not in self.shapes:
                self.shapes[drawn] = number_shapes(number, self._shape(example, fits), example.skeleton, example)
            vertices, faces, joints, weights = self.shapes[drawn]
            mesh = self._mesh(f"Match {kit.name} {number}", fits, vertices, faces)
            mesh.materials.append(self._cloth(kit, "number"))
            self.shapes[mesh] = example.skeleton.names, joints, weights
            self.meshes[key] = mesh
        return self.meshes[key]

    def _cloth(self, kit: Kit, part: str) -> bpy.types.Material:
        """The one material that all of a kit wear."""
        key = (kit.name, part)
        if key not in self.cloths:
            self.cloths[key] = cloth(kit, part)
        return self.cloths[key]

    def _mesh(self, name: str, fits: tuple, vertices: np.ndarray, faces) -> bpy.types.Mesh:
        """A mesh in the armature's own space from vertices (V, 3) m around the resting root."""
        root = np.array(self.bones[fits].bones[0].head_local)
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata((vertices * units_per_metre(self.context.scene) + root).tolist(), [], faces)
        return mesh

    def _weigh(self, thing: bpy.types.Object, mesh: bpy.types.Mesh, who: bpy.types.Object) -> None:
        """A vertex group per bone, filled in runs of equal weight; the mesh keeps them for all who wear it."""
        names, joints, weights = self.shapes[mesh]
        for joint, name in enumerate(names):
            share = np.sum(np.where(joints == joint, weights, 0.0), axis=1)
            if not np.any(share > 1e-6):
                continue
            group = thing.vertex_groups.new(name=name)
            for weight in np.unique(share[share > 1e-6].round(4)):
                near = np.abs(share - weight) < 5.1e-5
                group.add(np.flatnonzero(near).tolist(), float(weight), "REPLACE")


def label(person: Person) -> str:
    """What an object of his is called: team, number, name."""
    number = f" {person.number}" if person.number >= 0 else ""
    known = person.name if person.name and person.name != person.id else ""
    return " ".join(part for part in (f"{person.team.capitalize()}{number}", known) if part)


def number_shapes(number: int, body: "BodyMesh", skeleton: Skeleton,
                  example: Motion) -> tuple[np.ndarray, list[tuple[int, ...]], np.ndarray, np.ndarray]:
    """Vertices (V, 3) m in the rest pose, faces, joints (V, 6) and weights (V, 6) of `number` on back and chest."""
    from ...beyond_mocap.appearance.shirt_number import on_shirt  # brings scipy, which is slow to import

    scale = float(np.ptp(body.vertices, axis=0).max()) / 1.8
    vertices, faces, joints, weights = [], [], [], []
    for side in SIZES:
        points, polygons = _digits(str(number), SIZES[side] * scale, WIDEST[side] * scale)
        laid = on_shirt(body, skeleton, points, side, example)
        first = sum(len(rows) for rows in vertices)
        vertices.append(laid.vertices)
        joints.append(laid.joints)
        weights.append(laid.weights)
        faces += [tuple(first + corner for corner in polygon) for polygon in polygons]
    return np.concatenate(vertices), faces, np.concatenate(joints), np.concatenate(weights)


def _fits(skeleton) -> tuple:
    """Equal for skeletons on which the same armature and meshes serve."""
    return skeleton.names, skeleton.parents, np.round(skeleton.offsets, 6).tobytes()


def _digits(text: str, tall: float, widest: float) -> tuple[np.ndarray, list[tuple[int, ...]]]:
    """Points (N, 2) m around the text's middle, to the right and up, and polygons that look at the reader."""
    mesh = _filled(text)
    shape = bmesh.new()
    shape.from_mesh(mesh)
    bpy.data.meshes.remove(mesh)
    bmesh.ops.remove_doubles(shape, verts=shape.verts, dist=1e-5)
    points = np.array([vertex.co[:2] for vertex in shape.verts])
    low, high = points.min(axis=0), points.max(axis=0)
    middle, scale = (low + high) / 2.0, tall / (high[1] - low[1])
    scale = np.array([min(scale, widest / (high[0] - low[0])), scale])
    for axis in (0, 1):
        for at in np.arange(low[axis], high[axis], FINE / scale[axis])[1:]:
            place, normal = np.zeros(3), np.zeros(3)
            place[axis], normal[axis] = at, 1.0
            whole = shape.verts[:] + shape.edges[:] + shape.faces[:]
            bmesh.ops.bisect_plane(shape, geom=whole, plane_co=place, plane_no=normal, dist=1e-6)
    shape.verts.index_update()
    points = np.array([vertex.co[:2] for vertex in shape.verts])
    facing = np.sign(sum(face.normal.z * face.calc_area() for face in shape.faces))
    polygons = [tuple(vertex.index for vertex in face.verts)[:: 1 if facing > 0 else -1] for face in shape.faces]
    shape.free()
    return (points - middle) * scale, polygons


def _filled(text: str) -> bpy.types.Mesh:
    """The text as a flat mesh, in Blender's built-in font."""
    curve = bpy.data.curves.new("Number", "FONT")
    curve.body, curve.resolution_u = text, 4
    thing = bpy.data.objects.new("Number", curve)
    mesh = bpy.data.meshes.new_from_object(thing)
    bpy.data.objects.remove(thing)
    bpy.data.curves.remove(curve)
    return mesh
