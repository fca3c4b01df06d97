"""Blender's own exporters: what each file format and program gets, and files that are complete or absent."""

from __future__ import annotations

import contextlib
import ctypes
import errno
import os
import re
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.files.atomic import atomic_path, check_disk

SUFFIXES = {"FBX": ".fbx", "GLB": ".glb", "USD": ".usdc", "ABC": ".abc", "BVH": ".bvh"}
_OPERATORS = {"FBX": ("export_scene", "fbx"), "GLB": ("export_scene", "gltf"), "USD": ("wm", "usd_export"),
              "ABC": ("wm", "alembic_export")}
_FBX_AXES = {"BLENDER": ("-Z", "Y"), "UNITY": ("-Z", "Y"), "GODOT": ("-Z", "Y"), "UNREAL": ("Y", "Z")}
_USD_AXES = {"UNITY": ("NEGATIVE_Z", "Y"), "GODOT": ("NEGATIVE_Z", "Y")}
_VECTOR_BYTES, _CORNER_BYTES = 12, 40  # of Alembic: a position or normal on each frame; all else of a corner, once
_MEGABYTE = 1e6


@contextlib.contextmanager
def silence_blender() -> Iterator[None]:
    """Context manager: what Blender prints itself is left out, such as the name of a temporary file."""
    if sys.stdout is None:  # nothing can be printed
        yield
        return
    library = ctypes.CDLL("ucrtbase" if os.name == "nt" else None)  # lines of Blender wait in the buffer of C
    library.fflush(None)
    kept = os.dup(1)
    try:
        with open(os.devnull, "w", encoding="utf-8") as nowhere, contextlib.redirect_stdout(nowhere):
            os.dup2(nowhere.fileno(), 1)
            yield
    finally:
        library.fflush(None)
        os.dup2(kept, 1)
        os.close(kept)


def check_exporter(format: str) -> None:
    """Check that this Blender has the exporter (InputError)."""
    if format not in _OPERATORS:
        return
    group, name = _OPERATORS[format]
    try:
        getattr(getattr(bpy.ops, group), name).get_rna_type()
    except (AttributeError, KeyError):
        others = ", ".join(f for f in SUFFIXES if f != format)
        raise InputError("export", f"this Blender has no {format} exporter", f"an available format ({others})",
                         "choose another format or enable the exporter's add-on") from None


def check_folder(path: Path) -> None:
    """Check that a file's folder can be written (InputError)."""
    if not path.parent.is_dir() or not os.access(path.parent, os.W_OK):
        raise InputError(path, "the folder cannot be written", "a folder that you can write to",
                         "choose another folder")


def replace_ending(path: Path, ending: str) -> Path:
    """Return a path with this ending: replacing another format's, else appended ("walk.v2" keeps its ".v2")."""
    if path.suffix.lower() in {ending, *SUFFIXES.values()}:
        return path.with_suffix(ending)
    return path.with_name(path.name + ending)


def write_whole_file(out: Path, write_to) -> None:
    """Let `write_to(path)` write a temporary file, then rename it to `out`; InputError for exporters' exceptions."""
    try:
        with atomic_path(out, out.suffix) as part:
            write_to(str(part))
            if not part.is_file():
                raise RuntimeError("nothing was written")
            check_disk(part)
    except (RuntimeError, AttributeError) as error:  # what operators raise: errors while writing; a disabled exporter
        found = f"Blender could not write it ({describe_failure(error)})"
        raise InputError(out, found, "an available exporter and a writable folder",
                         "choose another format or folder") from None


def describe_failure(error: Exception) -> str:
    """Describe what an operator of Blender raised: the last line, where it is the text of a traceback."""
    lines = [line for line in str(error).splitlines() if line.strip() and not line.startswith("Location:")]
    return re.sub(r"^(Error: )?(\w+Error: )?(\[Errno \d+\] )?", "", lines[-1].strip()) if lines else "no reason given"


def _export_fbx(path: str, engine: str, which: str) -> None:
    forward, up = _FBX_AXES[engine]
    bpy.ops.export_scene.fbx(filepath=path, check_existing=False, use_selection=which == "SELECTED",
                             use_visible=which == "VISIBLE",
                             object_types={"ARMATURE", "MESH", "EMPTY"}, axis_forward=forward, axis_up=up,
                             apply_scale_options="FBX_SCALE_UNITS" if engine == "UNITY" else "FBX_SCALE_NONE",
                             add_leaf_bones=False, bake_anim=True, bake_anim_use_all_bones=True,
                             bake_anim_use_nla_strips=False, bake_anim_use_all_actions=False,
                             bake_anim_force_startend_keying=True, bake_anim_simplify_factor=0.0)


def _export_glb(path: str, _engine: str, which: str) -> None:
    bpy.ops.export_scene.gltf(filepath=path, check_existing=False, export_format="GLB",
                              use_selection=which == "SELECTED", use_visible=which == "VISIBLE", use_active_scene=True,
                              export_yup=True, export_animations=True,
                              export_animation_mode="ACTIVE_ACTIONS", export_frame_range=True,
                              export_force_sampling=True, export_optimize_animation_size=False)


def _export_usd(path: str, engine: str, which: str) -> None:
    turned = {}
    if engine in _USD_AXES:
        forward, up = _USD_AXES[engine]
        turned = {"convert_orientation": True, "export_global_forward_selection": forward,
                  "export_global_up_selection": up}
    bpy.ops.wm.usd_export(filepath=path, check_existing=False, selected_objects_only=which == "SELECTED",
                          export_animation=True, export_armatures=True, **turned)


def _export_alembic(path: str, _engine: str, which: str) -> None:
    scene, chosen = bpy.context.scene, bpy.context.view_layer.objects
    if which != "ALL":
        chosen = [one for one in chosen if (one.select_get() if which == "SELECTED" else one.visible_get())]
    _check_alembic_space(Path(path).parent, [one for one in chosen if one.type == "MESH"])
    bpy.ops.wm.alembic_export(filepath=path, check_existing=False, selected=which == "SELECTED",
                              start=scene.frame_start, end=scene.frame_end, as_background_job=False)


def _check_alembic_space(folder: Path, meshes: list[bpy.types.Object]) -> None:
    """Check that the Alembic file of meshes fits on the disk, since a full one ends Blender; OSError otherwise."""
    scene, depsgraph, needed = bpy.context.scene, bpy.context.evaluated_depsgraph_get(), 0
    for thing in meshes:
        mesh = thing.evaluated_get(depsgraph).data
        is_moving = len(thing.modifiers) or thing.data.shape_keys is not None
        frames = scene.frame_end - scene.frame_start + 1 if is_moving else 1
        needed += frames * _VECTOR_BYTES * (len(mesh.vertices) + len(mesh.loops)) + _CORNER_BYTES * len(mesh.loops)
    free = shutil.disk_usage(folder).free
    if free < needed:
        raise OSError(errno.ENOSPC, f"up to {needed / _MEGABYTE:.1f} MB needed, {free / _MEGABYTE:.1f} MB free")


EXPORTERS = {"FBX": _export_fbx, "GLB": _export_glb, "USD": _export_usd, "ABC": _export_alembic}
"""Format -> function (path, engine, which) that exports the scene in the window: "SELECTED", "VISIBLE" or "ALL"."""
