"""The motion of an armature of any kind, sampled once, and how it is transferred to its rig."""

from __future__ import annotations

import re

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.motion import quaternion
from ...beyond_mocap.motion.motion import Motion
from ..core import channels
from ..core.measure import frames_per_second, units_per_metre
from ..rigs import control_study
from ..rigs.control_study import CHANNELS
from . import rig_parts
from . import rig_sampling as rig_look
from .armature_adapter import build_no_motion_error
from .keys import split_channels
from .rig_sampling import find_rotation_channel
from .rig_transfer import OBJECT, RigTransfer, SourceRows, to_channel_values

_OBJECT = {*CHANNELS, *(f"delta_{name}" for name in CHANNELS)}
BONE = re.compile(r'^pose\.bones\["((?:[^"\\]|\\.)*)"\]\.(\w+)$')
_MOST = 20000  # frames


class RigSource:
    """A rig and the motion it shows.

    Attributes:
        motion: metres, world frame, at the scene's rate.
        start: scene frame of its first frame.
        messages: lines for the user.
    """

    def __init__(self, rig: bpy.types.Object, scene: bpy.types.Scene):
        """Sample every frame of the rig's animation. Raises InputError if it plays nothing, or cannot be
        transferred.
        """
        played = PlayedAnimation(rig, scene)
        self.rig, self.start, self.played, self.messages = rig.name, int(played.frames[0]), played, list(
            played.messages)
        self.units = units_per_metre(scene)
        with rig_look.create_private_scene(rig, scene) as side:
            samples = rig_look.sample_rig(rig, side, played.frames, sorted(played.others))
            parts, self.motion = _build_visible_motion(rig, scene, samples)
            controls = _list_controls(rig, side, parts, played)
            dependencies = control_study.find_carriers(rig, side, controls, list(parts.visible_bones.values()))
        self._rows: SourceRows | None = None
        self._parent_matrices = samples.world_matrices @ np.linalg.inv(samples.basis)
        self._has_moving_parent = bool(np.ptp(self._parent_matrices, axis=0).max() > 1e-6)
        self.samples, self.transfer = samples, RigTransfer(rig, parts, samples, dependencies=dependencies,
                                                           object_keyed=played.object_keyed, motion=self.motion,
                                                           units=self.units)

    def compute_channels(self, edited, rig: bpy.types.Object) -> dict[tuple[str, int], np.ndarray]:
        """Compute the channel values that show an edited motion.

        Args:
            edited: the `EditedMotion` of the core.
            rig: the armature.
        Returns:
            (data path, index) -> (N,) values from `start` on: all that differ from the source, and all animated
            channels where other frames than the source's own are displayed.
        """
        rows, above = self.build_rows(edited), self._compute_parent_matrices(len(edited.motion), rig)
        moves = self.transfer.compute_group_motions(edited.motion, edited.rigid, rows,
                                                    above @ rows.sample_numbers("basis", self.samples.basis))
        found = {} if rows.same and not self.played.is_layered else {p: self.sample_channel(*p, rows)
                                                                     for p in self.played.places}
        for (bone, what), values in self.transfer.compute_changes(moves, rows).items():
            number = self.samples.find_bone(bone)
            mode = self.samples.modes[number]
            channel = find_rotation_channel(mode) if what == "turn" else what
            if what == "turn":
                values = to_channel_values(mode, values, self.samples.channels[channel][rows.low[0], number])
            found |= split_channels(f'pose.bones["{bpy.utils.escape_identifier(bone)}"].{channel}', values)
        if self.transfer.object_travels:
            found |= self._compute_object_channels(moves, rows, above, rig)
        return found

    def build_rows(self, edited) -> SourceRows:
        """Build the source rows of the displayed frames; the same object while these stay the same."""
        at = np.asarray(edited.frames, float)
        if self._rows is None or not np.array_equal(at, self._rows.frames):
            self._rows = SourceRows(at, len(self.motion))
        return self._rows

    def sample_channel(self, path: str, index: int, rows: SourceRows) -> np.ndarray | None:
        """Sample a channel of the source (N,) at the displayed frames; None if it was not sampled."""
        return rows.find_cached((path, index), lambda: self._sample_own(path, index, rows))

    def _sample_own(self, path: str, index: int, rows: SourceRows) -> np.ndarray | None:
        """Sample a channel of the source from the tables."""
        if (table := self.samples.others.get(path)) is not None:
            table = table[:, min(index, table.shape[1] - 1)]
            steps = np.array_equal(table, np.round(table))
            return table[rows.low] if steps else rows.sample_numbers((path, index, "is"), table)
        bone, channel = find_posed_bone(path), path.rpartition(".")[2]
        if bone not in self.samples.bones:
            return None
        table = self.samples.channels[channel][:, self.samples.find_bone(bone)]
        if channel == "rotation_quaternion":
            table = quaternion.unify_signs(table)
        return rows.sample_numbers((path, index, "is"), table[:, index])

    def _compute_parent_matrices(self, count: int, rig: bpy.types.Object) -> np.ndarray:
        """Compute the matrices (count, 4, 4) of the object's parents and constraints, from `start` on."""
        if not self._has_moving_parent:
            return np.broadcast_to(self._parent_matrices[0], (count, 4, 4))
        if count > len(self._parent_matrices):
            with rig_look.create_private_scene(rig, bpy.context.scene) as side:
                more = rig_look.sample_rig(rig, side, self.start + np.arange(len(self._parent_matrices), count))
            self._parent_matrices = np.concatenate([self._parent_matrices, more.world_matrices
                                                    @ np.linalg.inv(more.basis)])
        return self._parent_matrices[:count]

    def _compute_object_channels(self, moves, rows: SourceRows, above: np.ndarray,
                                 rig: bpy.types.Object) -> dict[tuple[str, int], np.ndarray]:
        """Compute the object's own location and rotation channels where the object itself travels."""
        now = rows.sample_numbers("lies", self.samples.world_matrices).copy()
        now[:, :3, :3] = quaternion.to_matrix(moves.rotation[OBJECT]) @ now[:, :3, :3]
        now[:, :3, 3] = moves.transform_point(OBJECT, now[:, :3, 3] / self.units) * self.units
        basis = np.linalg.inv(above) @ now
        mode = rig.rotation_mode
        delta = quaternion.from_matrix(np.array(
            rig.delta_rotation_quaternion.to_matrix() if mode == "QUATERNION"
            else rig.delta_rotation_euler.to_matrix()))
        rotations = quaternion.unify_signs(quaternion.multiply(quaternion.inverse(delta),
                                                               rig_parts.to_rotations(basis)))
        table = self.samples.others.get(find_rotation_channel(mode),
                                        np.array([list(getattr(rig, find_rotation_channel(mode)))]))
        location = basis[:, :3, 3] - np.array(rig.delta_location)
        return split_channels("location", location) | split_channels(find_rotation_channel(mode),
                                                                     to_channel_values(mode, rotations, table[0]))


def sample_visible_motion(rig: bpy.types.Object, scene: bpy.types.Scene) -> tuple[Motion, int]:
    """Sample the motion that an armature of any kind shows.

    Args:
        rig: the armature.
        scene: says frame rate and unit scale.
    Returns:
        The motion, metres, world, and the scene frame of its first frame.
    Raises:
        InputError: if it plays nothing.
    """
    frames = PlayedAnimation(rig, scene).frames
    with rig_look.create_private_scene(rig, scene) as side:
        samples = rig_look.sample_rig(rig, side, frames)
        return _build_visible_motion(rig, scene, samples)[1], int(frames[0])


def _build_visible_motion(rig: bpy.types.Object, scene: bpy.types.Scene, samples):
    """Build the parts of a rig's body, and the motion of these, from its samples."""
    units = units_per_metre(scene)
    parts = rig_parts.identify_parts(rig) or rig_parts.build_single_part(rig, samples, units)
    return parts, rig_parts.build_motion(rig, parts, samples, units, frames_per_second(scene))


class PlayedAnimation:
    """The animation of an armature.

    Attributes:
        frames: (F,) scene frames.
        places: (data path, index) of all animated channels of object and bones.
        others: data paths other than a bone's place or rotation.
        bones: the animated bones.
        switches: whether further settings are animated.
        is_layered: see `is_layered`.
        object_keyed: whether the object itself is animated.
        messages: lines for the user.
    """

    def __init__(self, rig: bpy.types.Object, scene: bpy.types.Scene):
        """Collect the animation. Raises InputError if the armature plays nothing."""
        self.messages: list[str] = []
        found, ends, strips = {}, [], list_playing_strips(rig)
        for action, slot, extent in [(*channels.find_playing_action(rig), None)] + [
                (strip.action, strip.action_slot, (strip.frame_start, strip.frame_end)) for strip in strips]:
            own = {place: curve for place, curve in (channels.collect_curves(action, slot) if slot else {}).items()
                   if not curve.mute and len(curve.keyframe_points)}
            if not own:
                continue
            found |= own
            ends.append(extent or channels.find_key_range(own))
        if not found:
            raise build_no_motion_error(rig)
        first = int(np.ceil(min(a for a, _ in ends) - 1e-4))
        last = int(np.floor(max(b for _, b in ends) + 1e-4))
        if any(_has_cycles(curve) for curve in found.values()):
            first, last = min(first, scene.frame_start), max(last, scene.frame_end)
            self.messages.append(f"its animation curves repeat: the motion is that of frames {first} to {last}")
        if not 1 <= last - first < _MOST:
            raise InputError(f"armature {rig.name}", f"has a motion of {last - first + 1} frame{'s' * (last > first)}",
                             f"2 to {_MOST} frames", "key more than one frame")
        self.frames = np.arange(first, last + 1)
        self.is_layered = is_layered(rig)
        paths = {path for path, _ in found}
        self.others = {path for path in paths if find_posed_bone(path) is None and _can_resolve(rig, path)}
        self.places = {place for place in found if find_posed_bone(place[0]) is not None or place[0] in self.others}
        self.switches = any(path not in _OBJECT for path in self.others)
        self.bones = {bone for path in paths if (bone := find_posed_bone(path)) is not None}
        self.object_keyed = bool(_OBJECT & paths)


def list_playing_strips(rig: bpy.types.Object, include_muted: bool = False) -> list:
    """List the NLA strips that play; include_muted: also while all of them are muted."""
    data = rig.animation_data
    if data is None or not data.use_nla and not include_muted:
        return []
    solo = [track for track in data.nla_tracks if track.is_solo]
    return [strip for track in (solo or data.nla_tracks) if not track.mute or track.is_solo
            for strip in track.strips if not strip.mute and strip.action is not None]


def is_layered(rig: bpy.types.Object) -> bool:
    """Return whether an armature plays more than its action: strips below it, or only a share of it."""
    data = rig.animation_data
    part = data.action is not None and (data.action_influence != 1.0 or data.action_blend_type != "REPLACE")
    return part or bool(list_playing_strips(rig))


def _has_cycles(curve: bpy.types.FCurve) -> bool:
    return any(one.type == "CYCLES" and not one.mute for one in curve.modifiers)


def find_posed_bone(path: str) -> str | None:
    """Find the bone whose place, rotation or scale a data path is; None for other paths."""
    match = BONE.match(path)
    return bpy.utils.unescape_identifier(match[1]) if match and match[2] in CHANNELS else None


def _can_resolve(rig: bpy.types.Object, path: str) -> bool:
    try:
        rig_look.to_numbers(rig.path_resolve(path))
    except (ValueError, TypeError):
        return False
    return True


def _list_controls(rig: bpy.types.Object, side: bpy.types.Scene, parts, played: PlayedAnimation) -> list[str]:
    """List the bones that may have to be written: keyed bones, controls and followers of the body, and free top bones.

    Bones that move nothing visible are left out.
    """
    driven = _list_driven_bones(rig)
    top = {bone.name for bone in rig.data.bones if bone.parent is None}
    above = {parts.root, *(b.name for b in rig.data.bones[parts.root].parent_recursive)} if parts.root else set()
    free = [bone.name for bone in rig.data.bones
            if (bone.name in top or bone.parent is not None and bone.parent.name in above)
            and not len(rig.pose.bones[bone.name].constraints)]
    own = [*parts.controls.values(), *parts.follows, *([parts.root] if parts.root else [])]
    names = [*sorted(played.bones), *own, *free]
    names = [name for name in dict.fromkeys(names) if name in rig.data.bones and name not in driven]
    side.frame_set(int(played.frames[0]))
    if not played.switches:
        shown = [bone.name for bone in rig.data.bones if bone.use_deform] or list(rig.data.bones.keys())
        unkeyed = [name for name in names if name not in played.bones]
        still_bones = {name for name, moves in zip(unkeyed, control_study.list_moving(rig, side, unkeyed, shown))
                       if not moves}
        names = [name for name in names if name not in still_bones]
    return sorted(names, key=lambda name: len(rig.data.bones[name].parent_recursive))


def _list_driven_bones(rig: bpy.types.Object) -> set[str]:
    """List the bones whose place or rotation a driver sets."""
    drivers = rig.animation_data.drivers if rig.animation_data is not None else ()
    return {bone for one in drivers if not one.mute and (bone := find_posed_bone(one.data_path)) is not None}
