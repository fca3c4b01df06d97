"""Motions as files of Blender's own exporters: the displayed motion of a rig becomes one action on a plain copy, and
that is exported.

The copy is in a temporary scene and removed afterwards; the user's scene is unchanged. The copy has no constraints,
drivers or NLA strips that an exporter could evaluate differently from Blender.
"""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np
from mathutils import Matrix

from ...beyond_mocap.base.errors import InputError, format_count
from ...beyond_mocap.motion import quaternion
from ..core import channels
from ..core.measure import frames_per_second
from ..core.saved_state import use_temporary_scene
from . import exporters
from .armature import add_bones_above
from .bone_curves import ROOT_BONE, compute_root_motion, name_root_bone
from .fit import find_common_extent, sample_motion

if TYPE_CHECKING:
    from ...beyond_mocap.files.bvh.bvh_write import JointAboveHips

_SCALE_TOLERANCE = 1e-4  # deviation of a scale from 1 that is ignored
VISIBILITY_CHANNELS = {
    "hide_viewport", "hide_render"}  # keyed channels of a mesh that is visible for a part of the time only


@dataclass(frozen=True)
class ExportOptions:
    """What to export.

    Attributes:
        path: of the file.
        format, engine: see `rig.FORMATS` and `rig.ENGINES`.
        rate: frames per second, None for the scene's.
        root: one of `rig.ROOTS`.
        deform_only: leave out controls and helper bones.
        meshes: export meshes too.
        applies_transforms: objects are at the origin, unscaled and not rotated; bones and meshes have it instead.
        units: of the file for each of the scene's; needs applied transforms where it is not 1.
        armature_name: of the armature in the file; None for its own.
        above: joints to add above the hips, from the root down.
    """

    path: Path
    format: str = "FBX"
    engine: str = "BLENDER"
    rate: float | None = None
    root: str = "KEEP"
    deform_only: bool = True
    meshes: bool = True
    applies_transforms: bool = False
    units: float = 1.0
    armature_name: str | None = None
    above: "tuple[JointAboveHips, ...]" = ()


@dataclass(frozen=True, eq=False)
class _SampledPoses:
    """The displayed motion: bones' poses (F, B, 4, 4) in the armature's space, the object's (F, 4, 4) in the world."""

    bones: list[str]
    poses: np.ndarray
    object_matrices: np.ndarray


def export_motion(
    context: bpy.types.Context, rigs: list[bpy.types.Object], options: ExportOptions,
    things: list[bpy.types.Object] = ()
) -> list[str]:
    """Export the rigs' motions.

    Args:
        context: of Blender.
        rigs: armatures that move.
        options: the options.
        things: meshes that no rig moves, such as a ball and a pitch, which are exported beside them (not as BVH).
    Returns:
        Messages for the user.
    Raises:
        InputError: if an armature does not move or the file cannot be written.
    """
    check_place(options, rigs)
    things = [] if options.format == "BVH" else list(things)
    sampled = sample_rigs(context.scene, rigs, options.rate, things)
    return export_sampled(context, rigs, sampled, options, things)


def check_place(options: ExportOptions, rigs: list[bpy.types.Object]) -> None:
    """Check that there is an exporter, an armature and a writable folder (InputError)."""
    exporters.check_exporter(options.format)
    if not rigs:
        raise InputError("export", "no armature", "an armature that moves", "select one or choose players")
    exporters.check_folder(options.path)


def sample_rigs(scene: bpy.types.Scene, rigs: list[bpy.types.Object], rate: float | None,
                things: list[bpy.types.Object] = ()) -> dict[str, _SampledPoses]:
    """Sample the displayed motion of armatures, and of objects without bones, from its first frame to its last.

    Args:
        scene: the scene.
        rigs: armatures that move.
        rate: frames per second, None for the scene's.
        things: other objects.
    Returns:
        Name -> the sampled motion.
    Raises:
        InputError: if an armature does not move.
    """
    first, last = find_common_extent(rigs)
    fps = frames_per_second(scene)
    rate = rate or fps
    times = first + np.arange(int(np.floor((last - first) * rate / fps + 1e-6)) + 1) * (fps / rate)
    return _sample_poses(scene, rigs, times, list(things))


def export_sampled(
    context: bpy.types.Context, rigs: list[bpy.types.Object], sampled: dict[str, _SampledPoses],
    options: ExportOptions, things: list[bpy.types.Object] = ()
) -> list[str]:
    """Export the sampled motion of armatures (`sample_rigs`) and of other objects to one file; returns messages."""
    scene, rate = context.scene, options.rate or frames_per_second(context.scene)
    count = len(sampled[rigs[0].name].object_matrices)
    meshes_by_rig = {rig.name: list_meshes(scene, rig)
                     for rig in rigs} if options.meshes and options.format != "BVH" else {}
    lies = {mesh: _find_rest_placement(rig, mesh) for rig in rigs for mesh in meshes_by_rig.get(rig.name, ())}
    if options.format == "ABC" and not (things or any(meshes_by_rig.values())):
        raise InputError("export", "no visible mesh", "a mesh, which is all that Alembic stores",
                         "show the meshes, or choose another format")
    messages = []
    with _export_scene(context, rate, count, options.units) as stage:
        copies = [_copy_armature(stage, rig, sampled[rig.name], options, messages) for rig in rigs]
        meshes = [_copy_mesh(stage, thing, rig, copy) if not options.applies_transforms
                  else _copy_applied_mesh(stage, thing, rig, copy, Matrix.Scale(options.units, 4) @ lies[thing])
                  for rig, copy in zip(rigs, copies) for thing in meshes_by_rig.get(rig.name, ())]
        free_meshes = [_copy_free_mesh(stage, thing, sampled[thing.name].object_matrices) for thing in things]
        if options.format == "GLB" and not meshes:
            messages.append("no mesh on the armature: glTF then stores its bones as plain nodes")
        dressed = [thing for rig in rigs for thing in meshes_by_rig.get(rig.name, ())]
        named = [options.armature_name or rig.name for rig in rigs]
        with _original_names([*rigs, *dressed, *things], [*copies, *meshes, *free_meshes], named):
            _save_file(stage, copies, options)
    messages.insert(0, f"{count} frames at {rate:g} per second, {format_count(len(rigs), 'armature')}, "
                    f"{format_count(len(meshes), 'mesh', 'meshes')}"
                    + (f", {format_count(len(things), 'object')} beside them" if things else ""))
    return messages


def _sample_poses(
    scene: bpy.types.Scene, rigs: list[bpy.types.Object], times: np.ndarray, things: list[bpy.types.Object]
) -> dict[str, _SampledPoses]:
    """Sample armatures and objects without bones at scene frames (F,), which may be fractional."""
    now, subframe = scene.frame_current, scene.frame_subframe
    names = {rig.name: [bone.name for bone in rig.data.bones] for rig in rigs}
    poses = {rig.name: np.empty((len(times), len(names[rig.name]), 4, 4), np.float32) for rig in rigs}
    lies = {one.name: np.empty((len(times), 4, 4)) for one in (*rigs, *things)}
    try:
        for number, time in enumerate(times):
            whole = int(np.floor(time + 1e-6))
            scene.frame_set(whole, subframe=float(np.clip(time - whole, 0.0, 0.999999)))
            for rig in rigs:
                poses[rig.name][number] = [bone.matrix for bone in rig.pose.bones]
            for one in (*rigs, *things):
                lies[one.name][number] = one.matrix_world
    finally:
        scene.frame_set(now, subframe=subframe)
    ordered = {rig.name: [bone.name for bone in rig.pose.bones] for rig in rigs}
    none = np.empty((len(times), 0, 4, 4), np.float32)
    return {name: _SampledPoses(ordered.get(name, []), poses.get(name, none).astype(float), lies[name])
            for name in lies}


@contextmanager
def _export_scene(context: bpy.types.Context, rate: float, frames: int, per_unit: float = 1.0):
    """Create a temporary scene at this rate, `per_unit` of its units for each of the open scene's; afterwards selection
    and mode are restored.
    """
    units = context.scene.unit_settings
    with keep_mode(context), use_temporary_scene("Beyond Mocap export") as stage:
        stage.unit_settings.system, stage.unit_settings.scale_length = units.system, units.scale_length / per_unit
        stage.render.fps = max(1, round(rate))
        stage.render.fps_base = stage.render.fps / rate
        stage.frame_start, stage.frame_end = 0, max(frames - 1, 0)
        yield stage


@contextmanager
def keep_mode(context: bpy.types.Context):
    """Restore selection, active object and its mode at the end of a `with`: exporters may change them."""
    chosen, active = list(context.selected_objects), context.view_layer.objects.active
    mode = active.mode if active is not None else "OBJECT"
    try:
        yield
    finally:
        for one in context.view_layer.objects:
            if one.select_get() != (one in chosen):
                one.select_set(one in chosen)
        context.view_layer.objects.active = active
        if active is not None and active.mode != mode:
            bpy.ops.object.mode_set(mode=mode)


def _copy_armature(stage: bpy.types.Scene, rig: bpy.types.Object, shown: _SampledPoses, wanted: ExportOptions,
                   messages: list[str]):
    """Copy a rig to a plain armature that plays its displayed motion."""
    data = rig.data.copy()
    copy = bpy.data.objects.new(rig.name, data)
    stage.collection.objects.link(copy)
    data.pose_position = "POSE"
    if wanted.applies_transforms:
        shown = _apply_transforms(copy, rig, shown)
    hips, root, line, in_place = compute_root_motion(copy if wanted.applies_transforms else rig, shown, wanted,
                                                     messages)
    bones = _select_bones(rig, wanted, root)
    poses = {name: shown.poses[:, number] for number, name in enumerate(shown.bones) if name in bones}
    if in_place is not None:
        poses = {name: in_place @ pose for name, pose in poses.items()}
    if line is not None:
        poses[root or name_root_bone(rig)] = line
    parents = _simplify_bones(stage, copy, rig, kept=bones, hips=hips if line is not None and root is None else None)
    if wanted.units != 1.0:
        copy.data.transform(Matrix.Scale(wanted.units, 4))
        poses = {name: _scale_places(pose, wanted.units) for name, pose in poses.items()}
    _create_action(copy, poses, parents, shown.object_matrices)
    if wanted.above and wanted.format != "BVH":
        with bpy.context.temp_override(scene=stage, view_layer=stage.view_layers[0], active_object=copy, object=copy,
                                       selected_objects=[copy]):
            add_bones_above(copy, wanted.above)
    return copy


def _apply_transforms(copy: bpy.types.Object, rig: bpy.types.Object, shown: _SampledPoses) -> _SampledPoses:
    """Give a copy's bones the placement of its object, which stays at the origin; returns their poses in the world."""
    copy.data.transform(_find_even_matrix(rig))
    poses = shown.object_matrices[:, None] @ shown.poses
    size = np.cbrt(np.abs(np.linalg.det(shown.object_matrices[:, :3, :3])))
    poses[..., :3, :3] /= size[:, None, None, None]
    return _SampledPoses(shown.bones, poses, np.tile(np.eye(4), (len(poses), 1, 1)))


def _find_even_matrix(rig: bpy.types.Object) -> Matrix:
    """Find an armature's placement in the world; InputError for a mirrored or uneven one, which bones cannot have."""
    scale = rig.matrix_world.to_scale()
    if rig.matrix_world.determinant() <= 0.0 or max(scale) > 1.001 * min(scale):
        raise InputError(f"armature {rig.name}", f"is scaled {', '.join(f'{one:g}' for one in scale)}",
                         "one positive scale", "apply it with Ctrl-A, Scale")
    return rig.matrix_world.copy()


def _scale_places(matrices: np.ndarray, factor: float) -> np.ndarray:
    """Scale the places of matrices (F, 4, 4), not their axes."""
    out = matrices.copy()
    out[:, :3, 3] *= factor
    return out


def _select_bones(rig: bpy.types.Object, wanted: ExportOptions, root: str | None) -> set[str]:
    """Select the bones that are exported."""
    every = {bone.name for bone in rig.data.bones}
    deform = {bone.name for bone in rig.data.bones if bone.use_deform}
    if not wanted.deform_only or len(deform) < 8:
        return every
    named = root or next((b.name for b in rig.data.bones if b.parent is None and b.name.lower() == ROOT_BONE), None)
    return deform | ({named} if named else set())


def _simplify_bones(stage, copy, rig, kept: set[str], hips: str | None) -> dict[str, str | None]:
    """Simplify the copy's bones: only the selected ones, each below the nearest selected one, with plain inheritance.

    With `hips` a root bone is added above all. Returns bone -> parent.
    """
    parents = {name: _find_parent(rig, name, kept) for name in kept}
    layer = stage.view_layers[0]
    layer.update()
    layer.objects.active = copy
    with bpy.context.temp_override(scene=stage, view_layer=layer, active_object=copy, object=copy,
                                   selected_objects=[copy]):
        bpy.ops.object.mode_set(mode="EDIT")
        bones = copy.data.edit_bones
        for bone in bones:
            bone.use_connect = False
        for name, parent in parents.items():
            bones[name].parent = bones[parent] if parent else None
        for bone in list(bones):
            if bone.name not in kept:
                bones.remove(bone)
            else:
                bone.use_inherit_rotation, bone.use_local_location, bone.inherit_scale = True, True, "FULL"
        if hips is not None:
            name_of_root = name_root_bone(rig)
            root = bones.new(name_of_root)
            root.head, root.tail = (0, 0, 0), (0, bones[hips].length or 1.0, 0)
            for name, parent in parents.items():
                if parent is None:
                    bones[name].parent, parents[name] = root, name_of_root
            parents[name_of_root] = None
        bpy.ops.object.mode_set(mode="OBJECT")
    return parents


def _find_parent(rig: bpy.types.Object, name: str, kept: set[str]) -> str | None:
    """Find the nearest selected bone above; Rigify's deform bones hang on bones "ORG-x", which correspond to "DEF-x".
    """
    bone = rig.data.bones[name].parent
    while bone is not None:
        for other in (bone.name, f"DEF-{bone.name[4:]}" if bone.name.startswith("ORG-") else ""):
            if other in kept and other != name:
                return other
        bone = bone.parent
    return None


def _create_action(copy, poses: dict[str, np.ndarray], parents: dict[str, str | None], lies: np.ndarray) -> None:
    """Create one action of the copy: its bones as `poses` (F, 4, 4) in its space, the object as `lies` (F, 4, 4)."""
    rest = {name: np.array(copy.data.bones[name].matrix_local) for name in parents}
    curves: dict[str, tuple[str, np.ndarray]] = {}
    for name, parent in parents.items():
        pose = poses[name]
        local = np.linalg.inv(rest[name]) @ pose if parent is None else (
            np.linalg.inv(rest[name]) @ rest[parent] @ np.linalg.inv(poses[parent]) @ pose)
        path = f'pose.bones["{bpy.utils.escape_identifier(name)}"]'
        copy.pose.bones[name].rotation_mode = "QUATERNION"
        curves |= {f"{path}.{channel}": (name, values) for channel, values in _compute_channels(local).items()}
    channels.create_action(copy, copy.name, np.arange(len(lies)), curves | _place_object(copy, lies))


def _place_object(copy: bpy.types.Object, lies: np.ndarray) -> dict[str, tuple[str, np.ndarray]]:
    """Place an object at its first matrix (F, 4, 4); returns curves of its movement, none where it stays there."""
    copy.rotation_mode = "QUATERNION"
    moves = _compute_channels(lies)
    for channel, values in moves.items():
        setattr(copy, channel, values[0])
    if "scale" not in moves:
        copy.scale = (1, 1, 1)
    if np.ptp(lies, axis=0).max() <= 1e-6:
        return {}
    return {channel: ("Object", values) for channel, values in moves.items()}


def _copy_free_mesh(stage: bpy.types.Scene, thing: bpy.types.Object, lies: np.ndarray) -> bpy.types.Object:
    """Copy a mesh without a parent, moving (F, 4, 4) in the world as the original does."""
    copy = thing.copy()
    copy.animation_data_clear()
    stage.collection.objects.link(copy)
    copy.parent = None
    copy.matrix_parent_inverse.identity()
    copy.delta_location, copy.delta_scale = (0, 0, 0), (1, 1, 1)
    copy.constraints.clear()
    copy.hide_viewport = copy.hide_render = copy.hide_select = False
    curves = _place_object(copy, lies)
    if curves:
        channels.create_action(copy, copy.name, np.arange(len(lies)), curves)
    return copy


def _compute_channels(matrices: np.ndarray) -> dict[str, np.ndarray]:
    """Compute location, rotation and, where it is not 1, scale of matrices (F, 4, 4)."""
    size = np.linalg.norm(matrices[:, :3, :3], axis=1)
    turn = matrices[:, :3, :3] / np.maximum(size, 1e-12)[:, None, :]
    found = {"location": matrices[:, :3, 3],
             "rotation_quaternion": quaternion.unify_signs(quaternion.from_matrix(turn))}
    return found | ({"scale": size} if np.abs(size - 1.0).max() > _SCALE_TOLERANCE else {})


def list_meshes(scene: bpy.types.Scene, rig: bpy.types.Object) -> list[bpy.types.Object]:
    """List the meshes that an armature moves, visible now or at some other time by their keys."""
    moved = [thing for thing in scene.objects if thing.type == "MESH" and (
        thing.parent == rig or any(m.type == "ARMATURE" and m.object == rig for m in thing.modifiers))]
    return [thing for thing in moved if thing.visible_get() or _has_only_keys_on(thing, VISIBILITY_CHANNELS)]


def list_hidden_now(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """List the meshes that are hidden at the current frame and visible at another one by their keys."""
    return [thing for thing in scene.objects if thing.type == "MESH" and not thing.visible_get()
            and _has_only_keys_on(thing, VISIBILITY_CHANNELS)]


def _has_only_keys_on(thing: bpy.types.Object, paths: set[str]) -> bool:
    """Whether an object has keys on all of these properties and on no other."""
    playing, slot = channels.find_playing_action(thing)
    return playing is not None and {path for path, _ in channels.collect_curves(playing, slot)} == paths


def _copy_mesh(stage: bpy.types.Scene, thing: bpy.types.Object, rig: bpy.types.Object, copy: bpy.types.Object):
    """Copy a mesh so that the rig's copy moves it."""
    place = thing.matrix_world.copy()
    copied = thing.copy()
    stage.collection.objects.link(copied)
    if thing.parent == rig and (thing.parent_type != "BONE" or thing.parent_bone in copy.data.bones):
        inverse = thing.matrix_parent_inverse.copy()
        copied.parent, copied.matrix_parent_inverse = copy, inverse
    else:
        copied.parent, copied.matrix_world = None, place
    for modifier in copied.modifiers:
        if modifier.type == "ARMATURE" and modifier.object == rig:
            modifier.object = copy
    if _has_only_keys_on(thing, VISIBILITY_CHANNELS):  # the formats cannot store it
        copied.animation_data_clear()
        copied.hide_viewport = copied.hide_render = False
    return copied


def _find_rest_placement(rig: bpy.types.Object, thing: bpy.types.Object) -> Matrix:
    """Find where a mesh is in the world while its armature rests where it is; one on a bone moves with that bone."""
    if thing.parent != rig or thing.parent_type != "BONE":
        return thing.matrix_world.copy()
    bone = rig.pose.bones[thing.parent_bone]
    return rig.matrix_world @ bone.bone.matrix_local @ bone.matrix.inverted() @ rig.matrix_world.inverted() \
        @ thing.matrix_world


def _copy_applied_mesh(stage: bpy.types.Scene, thing: bpy.types.Object, rig: bpy.types.Object, copy: bpy.types.Object,
                       placement: Matrix) -> bpy.types.Object:
    """Copy a mesh with its placement (while the armature rests) applied to its vertices."""
    copied = _copy_mesh(stage, thing, rig, copy)
    copied.data = thing.data.copy()
    copied.data.transform(placement, shape_keys=True)
    if placement.determinant() < 0.0:  # a mirrored mesh would be inside out
        copied.data.flip_normals()
    if thing.parent == rig and thing.parent_type == "BONE":
        copied.vertex_groups.clear()
        copied.vertex_groups.new(name=thing.parent_bone).add(range(len(copied.data.vertices)), 1.0, "REPLACE")
        copied.modifiers.new("Armature", "ARMATURE").object = copy
    copied.parent, copied.parent_type = copy, "OBJECT"
    copied.matrix_parent_inverse, copied.matrix_basis = Matrix.Identity(4), Matrix.Identity(4)
    return copied


@contextmanager
def _original_names(originals, copies, armature_names):
    """Give the copies the originals' names, the armatures these names, and their bones' data too, while they are
    exported.
    """
    wanted = [*armature_names, *(one.name for one in originals[len(armature_names):])]
    local = [(one, copy, one.name) for one, copy in zip(originals, copies) if one.library is None]
    others = [(one, one.name) for one in bpy.data.objects if one.name in wanted and one not in copies
              and one not in originals and one.library is None]
    for one, name in others:
        one.name = f"{name} (other)"
    for one, _, name in local:
        one.name = f"{name} (original)"
    for name, copy in zip(wanted, copies):
        copy.name = name
        if copy.type == "ARMATURE" and name not in bpy.data.armatures:  # USD's bones; many may share one
            copy.data.name = name
        if copy.animation_data and copy.animation_data.action:
            copy.animation_data.action.name = f"{name} motion"
    try:
        yield
    finally:
        for copy in copies:
            copy.name = f"{copy.name} (copy)"
        for one, name in [*others, *((one, name) for one, _, name in local)]:
            one.name = name


def _save_file(stage, copies, wanted: ExportOptions) -> None:
    """Select the scene's objects and export them."""
    layer = stage.view_layers[0]
    layer.update()
    for thing in layer.objects:
        thing.select_set(True)
    layer.objects.active = copies[0]
    if wanted.format == "BVH":
        _write_bvh(stage, copies, wanted)
        return
    write = exporters.EXPORTERS[wanted.format]
    exporters.write_whole_file(wanted.path, lambda path: write(path, wanted.engine, "SELECTED"))


def _write_bvh(stage: bpy.types.Scene, copies, wanted: ExportOptions) -> None:
    from ...beyond_mocap.files.bvh import bvh
    from ...beyond_mocap.files.bvh.bvh_write import BvhForm

    frames, path = np.arange(stage.frame_end + 1), wanted.path
    for copy in copies:
        own = path if len(copies) == 1 else path.with_name(f"{path.stem} {copy.name}{path.suffix}")
        bvh.write_bvh(own, sample_motion(copy, stage, frames), BvhForm(above=wanted.above))
