"""Create the characters of a match: one armature, one light body per kit and look, one number and name per player,
shared by all with the same bones. Skin and hair have their colours on each player's own object.

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
from ..stage import body as stage_body
from . import match_objects as ours
from .kits import KIT_PARTS, Kit, choose_kit, create_kit_material
from .load import Character

if TYPE_CHECKING:
    from ...beyond_mocap.appearance.look import Look
    from ...beyond_mocap.appearance.mesh import BodyMesh

DIGIT_HEIGHTS = {"back": 0.235, "chest": 0.095}  # m, height of digits
MAX_WIDTHS = {"back": 0.26, "chest": 0.13}  # m, largest width of a number
NAME_HEIGHT, NAME_ABOVE = 0.048, 0.165  # m, height of the name, and how far above the middle of the number
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
        from ...beyond_mocap.appearance.look import choose_look  # the core loads when it is first used

        example = person.motions[0][1]
        fit_key = _build_fit_key(example.skeleton)
        armature_object = ours.mark_object(self._create_armature(example, build_label(person), collection, fit_key))
        armature_object[ours.PLAYER_PROPERTY] = person.id
        kit, look = choose_kit(person, self.colours), choose_look(person.id, gloves=person.keeper)
        mesh_objects = [self._add_mesh_object(armature_object, "body", self._create_body(example, kit, look),
                                              collection)]
        _colour_skin(mesh_objects[0], look)
        if person.number >= 0:
            mesh_objects.append(self._add_mesh_object(armature_object, "number",
                                                      self._create_number(example, kit, (person, look)), collection))
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
        stage_body.attach(mesh_object, armature_object)
        if not mesh_object.vertex_groups:  # the mesh keeps them for all its users
            stage_body.write_weights(mesh_object, *self.shapes[mesh])
        return ours.mark_object(mesh_object)

    def _build_body_shape(self, example: Motion, look: Look) -> BodyMesh:
        """Build the light body for these bones."""
        from ...beyond_mocap.appearance.body import build_body  # imports scipy, which is slow

        key = (_build_fit_key(example.skeleton), look.build, look.hair, look.gloves)
        if key not in self.shapes:
            self.shapes[key] = build_body(example.skeleton, example=example, look=look, light=True)
        return self.shapes[key]

    def _create_body(self, example: Motion, kit: Kit, look: Look) -> bpy.types.Mesh:
        """Create the body mesh of a kit and look, or return the existing one."""
        fits = _build_fit_key(example.skeleton)
        key = (fits, kit.name, look.build, look.hair, look.gloves)
        if key not in self.meshes:
            body = self._build_body_shape(example, look)
            mesh = stage_body.create_body_mesh(f"Match {kit.name}", body, self._place_vertices(fits, body.vertices),
                                               lambda part: self._find_material(kit, part, look))
            self.shapes[mesh] = example.skeleton.names, body.joints, body.weights
            self.meshes[key] = mesh
        return self.meshes[key]

    def _create_number(self, example: Motion, kit: Kit, player: tuple[Character, Look]) -> bpy.types.Mesh:
        """Create the mesh of a shirt's number and name in a kit's colours, or return the existing one."""
        person, look = player
        fits, name = _build_fit_key(example.skeleton), build_shirt_name(person)
        key = (fits, person.number, name, kit.name, look.build)
        if key not in self.meshes:
            body = self._build_body_shape(example, look)
            shape_key = (fits, person.number, name, look.build)
            if shape_key not in self.shapes:
                self.shapes[shape_key] = build_number_shapes((person.number, name), body, example.skeleton, example)
            vertices, faces, joints, weights = self.shapes[shape_key]
            mesh = bpy.data.meshes.new(f"Match {kit.name} {person.number}")
            mesh.from_pydata(self._place_vertices(fits, vertices).tolist(), [], faces)
            mesh.materials.append(self._find_material(kit, "number", look))
            self.shapes[mesh] = example.skeleton.names, joints, weights
            self.meshes[key] = mesh
        return self.meshes[key]

    def _find_material(self, kit: Kit, part: str, look: Look) -> bpy.types.Material:
        """Find or create the material that all of a kit share, or all with a look."""
        if part not in KIT_PARTS:
            return stage_body.get_part_material(part, look)
        key = (kit.name, part)
        if key not in self.materials:
            self.materials[key] = create_kit_material(kit, part)
        return self.materials[key]

    def _place_vertices(self, fits: tuple, vertices: np.ndarray) -> np.ndarray:
        """Place vertices (V, 3) m around the resting root in the armature's own space."""
        root = np.array(self.bones[fits].bones[0].head_local)
        return vertices * units_per_metre(self.context.scene) + root


def _colour_skin(body: bpy.types.Object, look: Look) -> None:
    """Give a body's object its own skin and hair; its mesh may be another's as well."""
    from ...beyond_mocap.appearance.mesh import HAIR, MATERIALS, SKIN

    for index in (SKIN, HAIR):
        body.material_slots[index].link = "OBJECT"
        body.material_slots[index].material = stage_body.get_part_material(MATERIALS[index], look)


def build_label(person: Character) -> str:
    """Build the name of a character's objects: team, number, name."""
    number = f" {person.number}" if person.number >= 0 else ""
    known = person.name if person.name and person.name != person.id else ""
    return " ".join(part for part in (f"{person.team.capitalize()}{number}", known) if part)


def build_shirt_name(person: Character) -> str:
    """Build the name on a shirt: the last word of the player's name in capitals, "" where none is known."""
    known = person.name if person.name and person.name != person.id else ""
    return known.split()[-1].upper() if known.split() else ""


def build_number_shapes(texts: tuple[int, str], body: BodyMesh, skeleton: Skeleton,
                        example: Motion) -> tuple[np.ndarray, list[tuple[int, ...]], np.ndarray, np.ndarray]:
    """Build the shapes of a shirt number on back and chest, and of the name above the one on the back.

    Args:
        texts: number of the shirt, and the name, "" for none.
        body: the body they lie on.
        skeleton: of the body.
        example: a motion of the player.
    Returns:
        Vertices (V, 3) m in the rest pose, faces, joints (V, K) and weights (V, K).
    """
    from ...beyond_mocap.appearance.shirt_number import place_on_shirt  # imports scipy, which is slow

    scale = float(np.ptp(body.vertices, axis=0).max()) / 1.8
    number, name = texts
    drawings = [("back", str(number), (0.0, DIGIT_HEIGHTS["back"], MAX_WIDTHS["back"])),
                ("chest", str(number), (0.0, DIGIT_HEIGHTS["chest"], MAX_WIDTHS["chest"]))]
    if name:
        drawings.append(("back", name, (NAME_ABOVE, NAME_HEIGHT, MAX_WIDTHS["back"])))
    vertices, faces, joints, weights = [], [], [], []
    for side, text, (above, height, width) in drawings:
        points, polygons = _build_digits(text, height * scale, width * scale)
        placed = place_on_shirt(body, skeleton, points + [0.0, above * scale], side, example)
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
    points = np.array([vertex.co[:2] for vertex in shape.verts]).reshape(-1, 2)
    if not len(points):  # letters that Blender's font does not have
        shape.free()
        return points, []
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
