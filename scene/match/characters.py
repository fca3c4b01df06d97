"""Create the characters of a match: one armature, one mesh per kit and one per number, shared by all with the same
bones.

Numbers use Blender's own digits, subdivided finely enough to follow the shirt, large on the back and small in front.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import bmesh
import bpy
import numpy as np

from ...beyond_mocap.motion.motion import Motion
from ...beyond_mocap.motion.skeleton import Skeleton
from ..core.measure import units_per_metre
from ..rigs import armature
from . import match_objects as ours
from .kits import Kit, choose_kit, create_kit_material
from .load import Character

if TYPE_CHECKING:
    from ...beyond_mocap.appearance.body import BodyMesh

DIGIT_HEIGHTS = {"back": 0.235, "chest": 0.095}  # m, height of digits
MAX_WIDTHS = {"back": 0.26, "chest": 0.13}  # m, largest width of a number
CUT_DISTANCE = 0.018  # m between cuts of the digits


class CharacterBuilder:
    """Create characters; datablocks created for one are shared with all others they fit.

    Attributes:
        context: Blender's context.
        colours: "#RRGGBB" of shirts by team.
        bones: armature data by fit key.
        shapes: built shapes by key, and by mesh what its weights are built from.
        meshes: meshes by key.
        materials: by kit and part.
    """

    def __init__(self, context: bpy.types.Context, colours: dict[str, str]):
        self.context, self.colours = context, colours
        self.bones: dict[tuple, bpy.types.Armature] = {}
        self.shapes: dict[tuple, object] = {}
        self.meshes: dict[tuple, bpy.types.Mesh] = {}
        self.materials: dict[tuple, bpy.types.Material] = {}

    def create_character(self, person: Character, collection) -> list[bpy.types.Object]:
        """Create an armature and the meshes on it: body, and shirt number if there is one.

        Args:
            person: the player or referee.
            collection: where the objects go.
        Returns:
            The armature, then its meshes.
        """
        example = person.motions[0][1]
        fit_key = _build_fit_key(example.skeleton)
        armature_object = ours.mark_object(self._create_armature(example, build_label(person), collection, fit_key))
        armature_object[ours.PLAYER_PROPERTY] = person.id
        kit = choose_kit(person, self.colours)
        mesh_objects = [self._add_mesh_object(armature_object, "body", self._create_body(example, fit_key, kit),
                                              collection)]
        if person.number >= 0:
            mesh_objects.append(self._add_mesh_object(armature_object, "number",
                                                      self._create_number(example, fit_key, kit, person.number),
                                                      collection))
        return [armature_object, *mesh_objects]

    def _create_armature(self, example: Motion, name: str, collection, fits: tuple) -> bpy.types.Object:
        if fits not in self.bones:
            first = armature.create_armature(self.context, example.skeleton, name, collection)
            first.data.name = "Match bones"
            self.bones[fits] = first.data
            return first
        armature_object = bpy.data.objects.new(name, self.bones[fits])
        collection.objects.link(armature_object)
        return armature_object

    def _add_mesh_object(self, armature_object: bpy.types.Object, part: str, mesh: bpy.types.Mesh,
                         collection) -> bpy.types.Object:
        mesh_object = bpy.data.objects.new(f"{armature_object.name} {part}", mesh)
        collection.objects.link(mesh_object)
        mesh_object.parent = armature_object
        mesh_object.modifiers.new("Armature", "ARMATURE").object = armature_object
        if not mesh_object.vertex_groups:
            self._assign_weights(mesh_object, mesh, armature_object)
        return ours.mark_object(mesh_object)

    def _build_body_shape(self, example: Motion, fits: tuple):
        """Build the low-poly body for these bones."""
        from ...beyond_mocap.appearance.body import build_body  # imports scipy, which is slow

        if fits not in self.shapes:
            self.shapes[fits] = build_body(example.skeleton, example=example)
        return self.shapes[fits]

    def _create_body(self, example: Motion, fits: tuple, kit: Kit) -> bpy.types.Mesh:
        """Create the body mesh of a kit, or return the existing one."""
        from ...beyond_mocap.appearance.body import MATERIALS

        key = (fits, kit.name)
        if key not in self.meshes:
            body = self._build_body_shape(example, fits)
            mesh = self._create_mesh(f"Match {kit.name}", fits, body.vertices, body.faces)
            mesh.polygons.foreach_set("material_index", np.asarray(body.material, np.int32))
            mesh.polygons.foreach_set("use_smooth", np.ones(len(body.faces), bool))
            for part in MATERIALS:
                mesh.materials.append(self._find_material(kit, part))
            self.shapes[mesh] = example.skeleton.names, body.joints, body.weights
            self.meshes[key] = mesh
        return self.meshes[key]

    def _create_number(self, example: Motion, fits: tuple, kit: Kit, number: int) -> bpy.types.Mesh:
        """Create the mesh of a shirt number in a kit's colours, or return the existing one."""
        key = (fits, number, kit.name)
        if key not in self.meshes:
            number_key = (fits, number)
            if number_key not in self.shapes:
                self.shapes[number_key] = build_number_shapes(number, self._build_body_shape(example, fits),
                                                              example.skeleton, example)
            vertices, faces, joints, weights = self.shapes[number_key]
            mesh = self._create_mesh(f"Match {kit.name} {number}", fits, vertices, faces)
            mesh.materials.append(self._find_material(kit, "number"))
            self.shapes[mesh] = example.skeleton.names, joints, weights
            self.meshes[key] = mesh
        return self.meshes[key]

    def _find_material(self, kit: Kit, part: str) -> bpy.types.Material:
        """Find or create the material that all of a kit share."""
        key = (kit.name, part)
        if key not in self.materials:
            self.materials[key] = create_kit_material(kit, part)
        return self.materials[key]

    def _create_mesh(self, name: str, fits: tuple, vertices: np.ndarray, faces) -> bpy.types.Mesh:
        """Create a mesh in the armature's own space from vertices (V, 3) m around the resting root."""
        root = np.array(self.bones[fits].bones[0].head_local)
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata((vertices * units_per_metre(self.context.scene) + root).tolist(), [], faces)
        return mesh

    def _assign_weights(self, thing: bpy.types.Object, mesh: bpy.types.Mesh, who: bpy.types.Object) -> None:
        """Assign a vertex group per bone, in runs of equal weight; the mesh keeps them for all its users."""
        names, joints, weights = self.shapes[mesh]
        for joint, name in enumerate(names):
            share = np.sum(np.where(joints == joint, weights, 0.0), axis=1)
            if not np.any(share > 1e-6):
                continue
            group = thing.vertex_groups.new(name=name)
            for weight in np.unique(share[share > 1e-6].round(4)):
                near = np.abs(share - weight) < 5.1e-5
                group.add(np.flatnonzero(near).tolist(), float(weight), "REPLACE")


def build_label(person: Character) -> str:
    """Build the name of a character's objects: team, number, name."""
    number = f" {person.number}" if person.number >= 0 else ""
    known = person.name if person.name and person.name != person.id else ""
    return " ".join(part for part in (f"{person.team.capitalize()}{number}", known) if part)


def build_number_shapes(number: int, body: "BodyMesh", skeleton: Skeleton,
                        example: Motion) -> tuple[np.ndarray, list[tuple[int, ...]], np.ndarray, np.ndarray]:
    """Build the shapes of a shirt number on back and chest.

    Args:
        number: of the shirt.
        body: the body it lies on.
        skeleton: of the body.
        example: a motion of the player.
    Returns:
        Vertices (V, 3) m in the rest pose, faces, joints (V, 6) and weights (V, 6).
    """
    from ...beyond_mocap.appearance.shirt_number import place_on_shirt  # imports scipy, which is slow

    scale = float(np.ptp(body.vertices, axis=0).max()) / 1.8
    vertices, faces, joints, weights = [], [], [], []
    for side in DIGIT_HEIGHTS:
        points, polygons = _build_digits(str(number), DIGIT_HEIGHTS[side] * scale, MAX_WIDTHS[side] * scale)
        placed = place_on_shirt(body, skeleton, points, side, example)
        first = sum(len(rows) for rows in vertices)
        vertices.append(placed.vertices)
        joints.append(placed.joints)
        weights.append(placed.weights)
        faces += [tuple(first + corner for corner in polygon) for polygon in polygons]
    return np.concatenate(vertices), faces, np.concatenate(joints), np.concatenate(weights)


def _build_fit_key(skeleton) -> tuple:
    """Build a key that is equal for skeletons that can share armature and meshes."""
    return skeleton.names, skeleton.parents, np.round(skeleton.offsets, 6).tobytes()


def _build_digits(text: str, height: float, max_width: float) -> tuple[np.ndarray, list[tuple[int, ...]]]:
    """Build points (N, 2) m around the text's middle, right and up, and polygons that face the reader."""
    mesh = _create_text_mesh(text)
    shape = bmesh.new()
    shape.from_mesh(mesh)
    bpy.data.meshes.remove(mesh)
    bmesh.ops.remove_doubles(shape, verts=shape.verts, dist=1e-5)
    points = np.array([vertex.co[:2] for vertex in shape.verts])
    low, high = points.min(axis=0), points.max(axis=0)
    middle, scale = (low + high) / 2.0, height / (high[1] - low[1])
    scale = np.array([min(scale, max_width / (high[0] - low[0])), scale])
    # Cut the flat digits into cells of CUT_DISTANCE, so that they can follow the shirt.
    for axis in (0, 1):
        for at in np.arange(low[axis], high[axis], CUT_DISTANCE / scale[axis])[1:]:
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


def _create_text_mesh(text: str) -> bpy.types.Mesh:
    """Create a flat mesh of the text, in Blender's built-in font."""
    curve = bpy.data.curves.new("Number", "FONT")
    curve.body, curve.resolution_u = text, 4
    thing = bpy.data.objects.new("Number", curve)
    mesh = bpy.data.meshes.new_from_object(thing)
    bpy.data.objects.remove(thing)
    bpy.data.curves.remove(curve)
    return mesh
