"""Single recordings of the library in the scene: read as they were recorded, on an armature of their own."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import bpy

from ...beyond_mocap.base.errors import InputError
from ..core import action, preferences
from ..core.settings import absolute
from ..rigs import armature
from ..stage import body

if TYPE_CHECKING:
    from ...beyond_mocap.motion.motion import Motion

PATH, FOLDER = "beyond_mocap_clip", "beyond_mocap_library"  # custom properties of an armature that shows a clip
SHIRT = (0.75, 0.05, 0.06)


def folder_of(settings) -> Path:
    """The library's folder."""
    return Path(absolute(settings.library_folder))


def file_of(settings, path: str, folder: str = "") -> tuple[Path, float | None]:
    """The BVH file to read for a clip, and the metres per unit to read it with (None: guessed). path: below the
    library's folder; folder: as a setting spells it, the scene's own where empty. InputError where it is missing, or
    waits to be converted."""
    from ...beyond_mocap.library import cache
    from ...beyond_mocap.library.scan import Conversions, is_foreign

    where = Path(absolute(folder)) if folder else folder_of(settings)
    file = where / path
    conversions = Conversions(where, cache.place(where, preferences.cache_folder(str(where)))[0])
    if not file.is_file():
        raise InputError(file, "no such file", "a clip of the library", "press Build Library to list its clips anew")
    if not conversions.stands(file):
        raise InputError(file, "not converted yet", "a clip that was converted", "press Build Library")
    return conversions.readable(file), None if is_foreign(file) else settings.library_unit or None


def read(settings, path: str, folder: str = "") -> tuple["Motion", tuple[str, ...]]:
    """The motion of a clip and what its reader decided; arguments and errors as `file_of`."""
    from ...beyond_mocap.files.bvh import bvh

    clip = bvh.read(*file_of(settings, path, folder))
    return clip.motion, clip.notes


def show(context: bpy.types.Context, motion: "Motion", path: str, dressed: bool) -> bpy.types.Object:
    """A new armature that plays a clip from the scene's first frame, chosen and active; returns it."""
    scene, name = context.scene, Path(path).stem
    rig = armature.create(context, motion.skeleton, name, context.collection)
    rig[PATH], rig[FOLDER] = path, scene.beyond_mocap.library_folder
    action.write(rig, motion, scene, name=name)
    if dressed:
        body.create(rig, name, SHIRT, collection=context.collection, scene=scene, example=motion)
    for other in context.selected_objects:
        other.select_set(False)
    rig.select_set(True)
    context.view_layer.objects.active = rig
    return rig
