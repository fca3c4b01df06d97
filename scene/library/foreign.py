"""Motions in files that Blender's own importers read: FBX, glTF, USD.

A file is imported into a temporary scene, its armature is sampled at the rate of its keys, and everything imported is
removed again. The result has joints at the bones' heads, from the hips on, in metres, Z up, whatever the file's axes,
units, rest pose and bone directions are. Bones above the hips, and a ball, are kept beside it.
"""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.files.bvh.bvh_write import STILL_ROTATION, build_form
from ...beyond_mocap.motion import quaternion
from ...beyond_mocap.motion.ball_names import choose_ball, is_ball_name
from ...beyond_mocap.motion.humanoid import identify_joints
from ...beyond_mocap.motion.motion import Motion
from ...beyond_mocap.motion.retargeting.structure import list_descendants
from ...beyond_mocap.motion.skeleton import Skeleton
from ..core import channels
from ..core.saved_state import use_temporary_scene

if TYPE_CHECKING:
    from ...beyond_mocap.files.bvh.bvh import BvhClip
    from ...beyond_mocap.files.bvh.bvh_write import BvhForm

MIN_FPS, MAX_FPS = 24.0, 240.0  # limits of the frames per second at which keys are sampled
_USD = (".usd", ".usda", ".usdc", ".usdz")


class ImportedTake(NamedTuple):
    """One animation of a file."""

    name: str
    motion: Motion
    form: "BvhForm"  # the bones above the hips
    ball: np.ndarray | None  # (T, 3) m in the motion's world, None without one
    notes: tuple[str, ...]


def read_takes(path: str | Path) -> list[ImportedTake]:
    """Read all animations of the file's largest armature, the longest first; InputError where it has none or is broken.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(path, "no such file", "a file with an animated armature", "check the path")
    with use_temporary_scene("Import") as scene:
        scene.render.fps_base = 1.0
        scene.render.fps = 30 if path.suffix.lower() not in _USD else _read_usd_rate(path)
        before = {action.name for action in bpy.data.actions}
        _import_file(path)
        rig = _find_largest_rig(path, scene)
        balls = _keep_balls(scene, rig)
        actions = _collect_actions(rig)
        actions += [one for one in _find_loose_actions(rig, before) if one not in actions]
        if not actions:
            raise InputError(path, f"armature {rig.name} is not animated", "an animation",
                             "export it with its animation")
        takes = [_sample_action(path, scene, rig, action, slot, balls=balls) for action, slot in actions]
    takes = [take for take in takes if len(take.motion) > 1 and _has_moving_joints(take.motion)]
    if not takes:
        raise InputError(path, "an armature that does not move", "an animation of at least two frames")
    return sorted(takes, key=lambda take: -take.motion.duration)


def to_bvh_clip(motion: Motion) -> "BvhClip":
    """Convert a motion to a clip as a library reads it from BVH: joints above the hips merged, size checked and noted.
    """
    from ...beyond_mocap.files.bvh import bvh

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "clip.bvh")
        bvh.write_bvh(file, motion)
        return bvh.read_bvh(file)


class ConversionQueue:
    """The recordings of a library that need a conversion, one at a time, so that a window stays responsive.

    Attributes:
        remaining: those that remain.
        total: number at the start.
        notes: results, one line for each that needs attention.
    """

    def __init__(self, folder: str | Path, cache_dir: str | None):
        """Find the recordings below `folder` that need a conversion; InputError where there is no folder."""
        from ...beyond_mocap.library import cache
        from ...beyond_mocap.library.folder.conversions import Conversions
        from ...beyond_mocap.library.folder.recordings import list_own_recordings

        folder = Path(folder)
        self.conversions = Conversions(folder, cache.find_cache_folder(folder, cache_dir)[0])
        self.remaining = self.conversions.list_outdated(list_own_recordings(folder))
        self.total, self.notes = len(self.remaining), []

    def convert_next(self) -> None:
        """Convert the next one; one that cannot be converted is noted and skipped."""
        from ...beyond_mocap.library.folder.conversions import read_stamp

        path = self.remaining.pop(0)
        stamp = read_stamp(path)  # before it is read: a file that changes meanwhile is converted again
        try:
            self._write_conversion(path, read_takes(path), stamp)
        except InputError as error:
            self.notes.append(f"skipped: {error}")

    def _write_conversion(self, path: Path, takes: list[ImportedTake], stamp: list[int]) -> None:
        from ...beyond_mocap.files.bvh import bvh

        file, take = self.conversions.prepare_file(path), takes[0]
        bvh.write_bvh(file, take.motion, take.form)
        _write_ball(file, take)
        self.notes += [f"{path.name}: {note}" for note in take.notes]
        self.conversions.record_conversion(path, stamp)
        if len(takes) > 1:
            others = ", ".join(take.name for take in takes[1:4])
            self.notes.append(f"{path.name}: only the longest of {len(takes)} animations is used; skipped: {others}")


def _write_ball(file: Path, take: ImportedTake) -> None:
    """Write the ball of a take beside its conversion, or remove that of an earlier one."""
    from ...beyond_mocap.files.tables import write_ball
    from ...beyond_mocap.library.recorded_ball.ball_table import ENDING
    from ...beyond_mocap.motion.track.ball_path import BallPath

    table = file.with_suffix(ENDING)
    if take.ball is None:
        table.unlink(missing_ok=True)
    else:
        count = len(take.ball)
        write_ball(table, BallPath(np.arange(count) / take.motion.fps, take.ball, np.ones(count, bool)))


def _import_file(path: Path) -> None:
    """Import by the first of Blender's importers for this ending that exists and reads the file."""
    importers = [operator for operator in _list_importers(path.suffix.lower()) if _has_operator(operator)]
    if not importers:
        raise InputError(path, "this Blender has no importer for it", "FBX, glTF or USD with an enabled importer",
                         "enable it in the preferences under Add-ons")
    reason = "nothing was imported"
    for operator in importers:
        try:
            if operator(filepath=str(path)) == {"FINISHED"} and bpy.context.scene.objects:
                return
        except Exception as error:  # an importer may fail in any way on a broken file
            reason = (str(error).strip().splitlines() or [type(error).__name__])[-1]
    raise InputError(path, f"cannot be read ({reason})", "an intact file", "export it again")


def _list_importers(ending: str) -> list:
    if ending == ".fbx":
        newer, older = bpy.ops.wm.fbx_import, bpy.ops.import_scene.fbx
        return [newer, older] if bpy.app.version >= (5, 0, 0) else [older, newer]
    if ending in (".glb", ".gltf"):
        return [bpy.ops.import_scene.gltf]
    return [bpy.ops.wm.usd_import] if ending in _USD else []


def _read_usd_rate(path: Path) -> int:
    """Read the time codes per second of a USD file, which its importer takes as frames.

    24, USD's own default, where Blender has no module that reads them.
    """
    try:
        bpy.utils.expose_bundled_modules()
        from pxr import Usd

        return max(1, round(Usd.Stage.Open(str(path)).GetTimeCodesPerSecond()))
    except Exception:  # no such module, or a broken file, which the importer will report
        return 24


def _has_operator(operator) -> bool:
    try:
        operator.get_rna_type()
    except (KeyError, AttributeError):
        return False
    return True


def _find_largest_rig(path: Path, scene: bpy.types.Scene) -> bpy.types.Object:
    """Find the armature with most bones."""
    rigs = [item for item in scene.objects if item.type == "ARMATURE" and len(item.data.bones)]
    if not rigs:
        raise InputError(path, "no armature", "a body with bones", "export the skeleton with its animation")
    return max(rigs, key=lambda item: len(item.data.bones))


def _keep_balls(scene: bpy.types.Scene, rig: bpy.types.Object) -> list[bpy.types.Object]:
    """Remove the objects that carry neither the armature nor a ball, so that frames are quick; returns the balls."""
    balls = [item for item in scene.objects if _is_named_ball(item) and item.type != "ARMATURE"
             and not any(one.type == "ARMATURE" for one in item.modifiers)]
    balls = [item for item in balls if not set(_list_carriers(item)[1:]) & set(balls)]
    carriers = {one.name for item in (rig, *balls) for one in _list_carriers(item)}
    for other in [item for item in scene.objects if item.name not in carriers]:
        bpy.data.objects.remove(other)
    return balls


def _is_named_ball(item: bpy.types.Object) -> bool:
    """Whether an object is named as a ball, or in USD the transform that moves it: Blender then names it by its mesh.
    """
    movers = [one.object_path.rpartition("/")[2] for one in item.constraints if one.type == "TRANSFORM_CACHE"]
    return any(map(is_ball_name, (item.name, *movers)))


def _list_carriers(item: bpy.types.Object | None) -> list[bpy.types.Object]:
    """List an object and its parents upward."""
    found = []
    while item is not None:
        found.append(item)
        item = item.parent
    return found


def _collect_actions(item: bpy.types.Object) -> list[tuple[bpy.types.Action, object]]:
    """Collect the actions that an object plays or has on its NLA tracks, each once with its matching slot."""
    data = item.animation_data
    found: dict = {}
    if data is not None:
        if data.action is not None:
            found[data.action.name] = (data.action, data.action_slot)
        for track in data.nla_tracks:
            for strip in track.strips:
                if strip.action is not None:
                    found.setdefault(strip.action.name, (strip.action, strip.action_slot))
            track.mute = True
    return list(found.values())


def _find_loose_actions(rig: bpy.types.Object, before: set[str]) -> list[tuple[bpy.types.Action, object]]:
    """Find the imported actions of an armature that nothing plays, with their slots: of several in an FBX file Blender
    assigns one.

    before: names of the actions before the import.
    """
    names = {rig.name, re.sub(r"\.\d{3}$", "", rig.name)}  # a number is added where the name is taken
    found = []
    for action in bpy.data.actions:
        slots = [slot for slot in action.slots if slot.identifier[2:] in names
                 or any(action.name.startswith(f"{name}|") for name in names)] if action.name not in before else []
        found += [(action, slot) for slot in slots[:1]
                  if any(path.startswith("pose.bones") for path, _ in channels.collect_curves(action, slot))]
    return found


def _has_moving_joints(motion: Motion) -> bool:
    """Whether any joint turns: exporters also write each object's animation onto all others."""
    return bool(np.abs(np.sum(motion.rotations * motion.rotations[:1], axis=-1)).min() < STILL_ROTATION)


def _sample_action(path: Path, scene: bpy.types.Scene, rig: bpy.types.Object, action, slot, *,
                   balls: list[bpy.types.Object]) -> ImportedTake:
    """Sample one action, frame by frame, and the balls beside it."""
    channels.assign_action(rig, action, slot)
    for ball in balls:
        _play_beside(ball, action)
    fps, times = _list_times(action, rig.animation_data.action_slot, scene.render.fps / scene.render.fps_base)
    posed = np.empty((len(times), len(rig.pose.bones), 4, 4), np.float32)
    world, placed = np.empty((len(times), 4, 4)), np.empty((len(balls), len(times), 4, 4))
    for number, time in enumerate(times):
        scene.frame_set(int(np.floor(time)), subframe=float(time - np.floor(time)))
        rig.pose.bones.foreach_get("matrix", posed[number].reshape(-1))
        world[number] = np.array(rig.matrix_world)
        for row, ball in zip(placed, balls):
            row[number] = np.array(ball.matrix_world)
    every = world[:, None] @ posed.transpose(0, 1, 3, 2).astype(float)  # Blender stores columns
    above, bones = _list_body_bones(rig)
    matrices = every[:, [rig.pose.bones.find(bone.name) for bone in (*above, *bones)]]
    if not np.all(np.isfinite(matrices)):
        raise InputError(path, f"NaN or infinite values in action {action.name}", "an intact file", "export it again")
    motion = _build_motion(path, bones, matrices=matrices[:, len(above) :], world=world[0], fps=fps)
    turns = _compute_turns(path, above, matrices[:, : len(above)], world[0])
    form = build_form([_name_joint(bone) for bone in above], matrices[:, : len(above), :3, 3], turns, motion)
    found = {ball.name: row[:, :3, :3] @ _find_centre(ball) + row[:, :3, 3] for ball, row in zip(balls, placed)}
    found |= {bone.name: every[:, rig.pose.bones.find(bone.name), :3, 3] for bone in rig.data.bones if _is_ball(bone)}
    return ImportedTake(action.name, motion, form, *_choose_ball(found, motion))


def _play_beside(ball: bpy.types.Object, action) -> None:
    """Let a ball play its part of an armature's action; one that has an action of its own plays that."""
    own = _collect_actions(ball)
    if own:
        channels.assign_action(ball, *next((one for one in own if one[0] == action), own[0]))


def _find_centre(ball: bpy.types.Object) -> np.ndarray:
    """Find the centre (3,) of an object in its own space: that of its mesh, else its origin."""
    return np.mean([list(corner) for corner in ball.bound_box], axis=0) if ball.type == "MESH" else np.zeros(3)


def _is_ball(bone: bpy.types.Bone) -> bool:
    """Whether a bone stands for a ball."""
    return is_ball_name(bone.name) and not bone.children


def _choose_ball(found: dict[str, np.ndarray], motion: Motion) -> tuple[np.ndarray | None, tuple[str, ...]]:
    """Choose the ball (T, 3) m among those that a file has, by name; also notes for the user."""
    if not found:
        return None, ()
    chosen, notes = choose_ball(list(found), list(found.values()), motion.root_positions)
    return list(found.values())[chosen], notes


def _list_times(action, slot, rate: float) -> tuple[float, np.ndarray]:
    """List the frames per second of the keys, within MIN_FPS and MAX_FPS, and the scene frames (T,) to sample."""
    keys = set()
    for (path, _), curve in channels.collect_curves(action, slot).items():
        if path.startswith("pose.bones"):
            points = np.empty(2 * len(curve.keyframe_points), np.float32)
            curve.keyframe_points.foreach_get("co", points)
            keys.update(np.round(points[::2].astype(float), 3).tolist())
    if not keys:
        return rate, np.array([0.0])
    keys = np.array(sorted(keys))
    step = float(np.median(np.diff(keys))) if len(keys) > 1 else 1.0
    fps = rate / step
    fps = float(np.clip(round(fps, 2) if abs(fps - round(fps)) > 0.02 else round(fps), MIN_FPS, MAX_FPS))
    count = int(np.floor((keys[-1] - keys[0]) / rate * fps + 1e-2)) + 1
    return fps, keys[0] + np.arange(count) * (rate / fps)


def _list_body_bones(rig: bpy.types.Object) -> tuple[list[bpy.types.Bone], list[bpy.types.Bone]]:
    """List the bones of the largest tree: those above the hips from the root down, and those from the hips on, parents
    first. Where no hips are found, the tree's root stands for them.
    """
    bones = _list_tree(max((bone for bone in rig.data.bones if bone.parent is None),
                           key=lambda bone: len(bone.children_recursive)))
    hips = bones[_find_hips(bones)]
    above = [bone for bone in bones if bone in hips.parent_recursive]
    return above, _list_tree(hips)


def _list_tree(root: bpy.types.Bone) -> list[bpy.types.Bone]:
    """List a bone and those below it, parents first, without balls."""
    bones = [root]
    for bone in bones:  # grows during the loop
        bones.extend(child for child in bone.children if not _is_ball(child))
    return bones


def _find_hips(bones: list[bpy.types.Bone]) -> int:
    """Find the hips among the bones of a tree: 0 where both legs do not hang below one."""
    names = [_name_joint(bone) for bone in bones]
    parents = [-1, *(bones.index(bone.parent) for bone in bones[1:])]
    heads = np.array([list(bone.head_local) for bone in bones])
    try:
        body = identify_joints(Skeleton(tuple(names), tuple(parents), heads - heads[np.maximum(parents, 0)]))
    except InputError:
        return 0
    below = set(list_descendants(parents, body.hips))
    return body.hips if {body.left.upper_leg, body.right.upper_leg} <= below else 0


def _name_joint(bone: bpy.types.Bone) -> str:
    return "_".join(bone.name.split())


def _compute_turns(path: Path, bones, matrices: np.ndarray, world: np.ndarray) -> np.ndarray:
    """Compute how bones are turned from their rest: (T, B, 4), in the world; arguments as of `_build_motion`."""
    scales = np.linalg.norm(matrices[..., :3, :3], axis=-2)
    if scales.size and scales.min() < 1e-6:
        raise InputError(path, "a bone of size zero", "bones with a size", "apply the scale before exporting")
    rotations = quaternion.from_matrix(matrices[..., :3, :3] / scales[..., None, :])
    return quaternion.normalize(quaternion.multiply(rotations, quaternion.inverse(_compute_rest(bones, world))))


def _compute_rest(bones, world: np.ndarray) -> np.ndarray:
    """Compute the rotations (B, 4) of bones at rest, in the world; world: (4, 4) the armature."""
    rest = np.array([world @ np.array(bone.matrix_local) for bone in bones]).reshape(-1, 4, 4)
    return quaternion.from_matrix(rest[:, :3, :3] / np.linalg.norm(rest[:, :3, :3], axis=-2)[:, None, :])


def _build_motion(path: Path, bones, matrices: np.ndarray, world: np.ndarray, fps: float) -> Motion:
    """Build a motion from bones.

    Args:
        path: for messages.
        bones: of one tree, its first as root, parents first.
        matrices: (T, B, 4, 4) the bones in the world, metres.
        world: (4, 4) the armature in the world.
        fps: frames per second.
    Returns:
        The motion.
    """
    names = [bone.name for bone in bones]
    parents = [-1] + [names.index(bone.parent.name) for bone in bones[1:]]
    rotations, rest = _compute_turns(path, bones, matrices, world), _compute_rest(bones, world)
    places = matrices[..., :3, 3]
    local, offsets = rotations.copy(), np.zeros((len(names), 3))
    for joint, parent in enumerate(parents):
        if parent >= 0:
            back = quaternion.inverse(rotations[:, parent])
            local[:, joint] = quaternion.multiply(back, rotations[:, joint])
            offsets[joint] = np.median(quaternion.rotate(back, places[:, joint] - places[:, parent]), axis=0)
    tips = [number for number, bone in enumerate(bones) if not bone.children]
    size = float(np.cbrt(abs(np.linalg.det(world[:3, :3]))))
    ends = [quaternion.rotate(rest[number], [0.0, bones[number].length * size, 0.0]) for number in tips]
    skeleton = Skeleton(tuple(map(_name_joint, bones)), tuple(parents), offsets, tuple(tips), np.array(ends))
    return Motion(skeleton, places[:, 0], quaternion.unify_signs(local), fps)
