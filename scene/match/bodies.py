"""Bodies of a match: one armature, one mesh a kit and one a number, shared by all whose bones agree."""

from __future__ import annotations

import bpy
import numpy as np

from ...beyond_mocap.motion.motion import Motion
from ..core.measure import units_per_metre
from ..rigs import armature
from . import ours
from .kits import Kit, cloth, kit_of
from .people import Person


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
        from .numbers import shapes

        key = (fits, number, kit.name)
        if key not in self.meshes:
            drawn = (fits, number)
            if drawn not in self.shapes:
                self.shapes[drawn] = shapes(number, self._shape(example, fits), example.skeleton, example)
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


def _fits(skeleton) -> tuple:
    """Equal for skeletons on which the same armature and meshes serve."""
    return skeleton.names, skeleton.parents, np.round(skeleton.offsets, 6).tobytes()
