"""A rider's original motion relative to its own path, worked out once and kept as long as nothing of it changes; and
the ground that its feet follow."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ...beyond_mocap.base.digest import byte_digest
from ...beyond_mocap.base.errors import BeyondMocapError, InputError
from ..core.measure import units_per_metre
from . import curve, keys
from .carrier import Carrier, Read

MADE_OF = ("fit", "degree", "frame")  # settings that the original's own path and the offsets from it depend on


@dataclass(frozen=True, eq=False)
class Source:
    """read: the original motion; core: it relative to its own path; digest: of what both were made of."""

    read: Read
    core: object
    digest: bytes


_sources: dict[int, Source] = {}  # by session_uid of the armature
# likewise: the original action and its keys' digest, until they may have changed
_keys: dict[int, tuple[int, bytes]] = {}
_refused: dict[int, tuple[bytes, str]] = {}  # likewise: digest of what could not be read, and why
_grounds: dict[int, tuple[bytes, object]] = {}  # by session_uid of the mesh object


def forget() -> None:
    """Nothing is remembered any more: another file is open."""
    _sources.clear()
    unsure()
    _grounds.clear()


def unsure() -> None:
    """Keys of any original may be others: they are looked at again, those too that could not be read."""
    _keys.clear()
    _refused.clear()


def of(carrier: Carrier, scene: bpy.types.Scene, settings) -> Source:
    """An armature's original motion for these settings of the core. InputError where there is none."""
    from ...beyond_mocap.path_editing.ride import prepare

    uid, wishes = carrier.body.session_uid, tuple(getattr(settings, name) for name in MADE_OF)
    original = carrier.source()[0]
    number = original.session_uid if original is not None else 0
    if uid not in _keys or _keys[uid][0] != number:
        _keys[uid] = number, carrier.keys_digest()
    digest = byte_digest(_keys[uid][1], carrier.stamp(scene), repr(wishes))
    known = _sources.get(uid)
    if known is not None and known.digest == digest:
        return known
    if _refused.get(uid, (b"", ""))[0] == digest:
        raise BeyondMocapError(_refused[uid][1])
    keys.refresh()
    try:
        read = carrier.read(scene)
        found = Source(read, prepare(read.motion, settings, read.standing), digest)
    except BeyondMocapError as error:  # to look at a rig is a change of frame: it would be looked at again and again
        _refused[uid] = digest, str(error)
        raise
    _sources[uid] = found
    return found


def ground_digest(scene: bpy.types.Scene, ground: bpy.types.Object | None) -> bytes:
    """Another where the ground's mesh, as it is shown, is another; not where its object is animated: it counts where it
    lay when something was edited. InputError where it was deleted."""
    if ground is None:
        return b""
    if ground.name not in scene.objects:
        raise InputError("ground", f"{ground.name} is gone from the scene", "a mesh object", "choose another, or none")
    shown = ground.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = shown.to_mesh()  # also while it is being edited
    parts = [_vertices(mesh)]
    if corners := mesh.attributes.get(".corner_vert"):  # at once; triangles take Blender ten times as long
        found = np.empty(len(corners.data), np.int32)
        corners.data.foreach_get("value", found)
        parts += [found, len(mesh.polygons).to_bytes(8, "little")]
    shown.to_mesh_clear()
    if not curve.is_animated(ground):
        parts.append(np.array(shown.matrix_world))
    return byte_digest(*parts)


def ground_notes(ground: bpy.types.Object | None) -> tuple[str, ...]:
    """Lines for the user."""
    moves = ground is not None and curve.is_animated(ground)
    return (f"ground {ground.name}: it moves; feet follow it as it lay when it was chosen or edited last",
            ) if moves else ()


def ground_of(scene: bpy.types.Scene, ground: bpy.types.Object | None, digest: bytes):
    """The `Terrain` of a mesh object in metres; None without one. digest: of `ground_digest`."""
    from ...beyond_mocap.motion.path.terrain import Terrain

    if ground is None:
        return None
    units = units_per_metre(scene)
    digest += repr(units).encode()
    if _grounds.get(ground.session_uid, (b"", None))[0] != digest:
        places, corners = _mesh(ground)
        if not len(corners):
            raise InputError(f"ground {ground.name}", "a mesh without faces", "a surface", "choose another")
        _grounds[ground.session_uid] = digest, Terrain(places / units, corners)
    return _grounds[ground.session_uid][1]


def _mesh(ground: bpy.types.Object) -> tuple[np.ndarray, np.ndarray]:
    """A mesh object as it is shown: vertices (V, 3) in the world, in Blender's units, and triangles (F, 3)."""
    shown = ground.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = shown.to_mesh()
    places, corners = _vertices(mesh), np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("vertices", corners)
    shown.to_mesh_clear()
    world = np.array(shown.matrix_world)
    return places @ world[:3, :3].T + world[:3, 3], corners.reshape(-1, 3)


def _vertices(mesh: bpy.types.Mesh) -> np.ndarray:
    """Places (V, 3) of a mesh, in its own space."""
    places = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", places)
    return places.reshape(-1, 3)
