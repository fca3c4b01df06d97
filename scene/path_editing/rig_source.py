"""The motion of an armature of any kind, sampled once, and how it is transferred to its rig."""

from __future__ import annotations

import re

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.motion import quaternion
from ..core import channels
from ..core.measure import frames_per_second, units_per_metre
from ..rigs import control_study
from ..rigs.control_study import CHANNELS
from . import rig_look, rig_parts
from .carrier import no_motion
from .keys import columns
from .rig_look import channel_of
from .rig_ride import OBJECT, Carried, Rows, channel_values

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
        played = Played(rig, scene)
        self.rig, self.start, self.played, self.told = rig.name, int(played.frames[0]), played, list(played.told)
        self.units = units_per_metre(scene)
        with rig_look.alone(rig, scene) as side:
            seen = rig_look.look(rig, side, played.frames, sorted(played.others))
            parts = rig_parts.of_rig(rig) or rig_parts.whole(rig, seen, played.object_keyed, self.units)
            self.motion = rig_parts.motion_of(rig, parts, seen, self.units, frames_per_second(scene))
            controls = _controls(rig, side, parts, played)
            rides = control_study.study_rides(rig, side, controls, list(parts.shown.values()))
        self._rows: Rows | None = None
        self._ways = seen.lies @ np.linalg.inv(seen.basis)
        self._hangs = bool(np.ptp(self._ways, axis=0).max() > 1e-6)
        self.seen, self.carried = seen, Carried(rig, parts, seen, rides=rides, object_keyed=played.object_keyed,
                                                motion=self.motion, units=self.units)

    def values(self, ridden, rig: bpy.types.Object) -> dict[tuple[str, int], np.ndarray]:
        """Compute the channel values that show an edited motion.

        Args:
            edited: the `EditedMotion` of the core.
            rig: the armature.
        Returns:
            (data path, index) -> (N,) values from `start` on: all that differ from the source, and all animated
            channels where
            other frames than the source's own are displayed.
        """
        rows, above = self.rows(ridden), self._above(len(ridden.motion), rig)
        moves = self.carried.moves(ridden.motion, ridden.rigid, rows, above @ rows.numbers("basis", self.seen.basis))
        found = {} if rows.same and not self.played.layered else {p: self.own(*p, rows) for p in self.played.places}
        for (bone, what), values in self.carried.changed(moves, rows).items():
            number = self.seen.number(bone)
            mode = self.seen.modes[number]
            channel = channel_of(mode) if what == "turn" else what
            if what == "turn":
                values = channel_values(mode, values, self.seen.channels[channel][rows.low[0], number])
            found |= columns(f'pose.bones["{bpy.utils.escape_identifier(bone)}"].{channel}', values)
        if self.carried.object_goes:
            found |= self._object(moves, rows, above, rig)
        return found

    def rows(self, ridden) -> Rows:
        """Build the source rows of the displayed frames; the same object while these stay the same."""
        at = np.asarray(ridden.frames, float)
        if self._rows is None or not np.array_equal(at, self._rows.frames):
            self._rows = Rows(at, len(self.motion))
        return self._rows

    def own(self, path: str, index: int, rows: Rows) -> np.ndarray | None:
        """Sample a channel of the source (N,) at the displayed frames; None if it was not sampled."""
        return rows.remembered((path, index), lambda: self._own(path, index, rows))

    def _own(self, path: str, index: int, rows: Rows) -> np.ndarray | None:
        """Sample a channel of the source from the tables."""
        if (table := self.seen.others.get(path)) is not None:
            table = table[:, min(index, table.shape[1] - 1)]
            steps = np.array_equal(table, np.round(table))
            return table[rows.low] if steps else rows.numbers((path, index, "is"), table)
        bone, channel = posed_bone(path), path.rpartition(".")[2]
        if bone not in self.seen.bones:
            return None
        table = self.seen.channels[channel][:, self.seen.number(bone)]
        if channel == "rotation_quaternion":
            table = quaternion.continuous(table)
        return rows.numbers((path, index, "is"), table[:, index])

    def _above(self, count: int, rig: bpy.types.Object) -> np.ndarray:
        """Compute the matrices (count, 4, 4) of the object's parents and constraints, from `start` on."""
        if not self._hangs:
            return np.broadcast_to(self._ways[0], (count, 4, 4))
        if count > len(self._ways):
            with rig_look.alone(rig, bpy.context.scene) as side:
                more = rig_look.look(rig, side, self.start + np.arange(len(self._ways), count))
            self._ways = np.concatenate([self._ways, more.lies @ np.linalg.inv(more.basis)])
        return self._ways[:count]

    def _object(self, moves, rows: Rows, above: np.ndarray, rig: bpy.types.Object) -> dict[tuple[str, int], np.ndarray]:
        """Compute the object's own location and rotation channels where the object itself travels."""
        now = rows.numbers("lies", self.seen.lies).copy()
        now[:, :3, :3] = quaternion.to_matrix(moves.turn[OBJECT]) @ now[:, :3, :3]
        now[:, :3, 3] = moves.point(OBJECT, now[:, :3, 3] / self.units) * self.units
        basis = np.linalg.inv(above) @ now
        mode = rig.rotation_mode
        delta = quaternion.from_matrix(np.array(
            rig.delta_rotation_quaternion.to_matrix() if mode == "QUATERNION"
            else rig.delta_rotation_euler.to_matrix()))
        turned = quaternion.continuous(quaternion.multiply(quaternion.inverse(delta), rig_parts.rotations(basis)))
        table = self.seen.others.get(channel_of(mode), np.array([list(getattr(rig, channel_of(mode)))]))
        location = basis[:, :3, 3] - np.array(rig.delta_location)
        return columns("location", location) | columns(channel_of(mode), channel_values(mode, turned, table[0]))


class Played:
    """The animation of an armature.

    Attributes:
        frames: (F,) scene frames.
        places: (data path, index) of all animated channels of object and bones.
        others: data paths other than a bone's place or rotation.
        bones: the animated bones.
        switches: whether further settings are animated.
        layered: see `is_layered`.
        object_keyed: whether the object itself is animated.
        messages: lines for the user.
    """

    def __init__(self, rig: bpy.types.Object, scene: bpy.types.Scene):
        """Collect the animation. Raises InputError if the armature plays nothing."""
        self.told: list[str] = []
        found, ends, strips = {}, [], playing_strips(rig)
        for action, slot, extent in [(*channels.playing(rig), None)] + [
                (strip.action, strip.action_slot, (strip.frame_start, strip.frame_end)) for strip in strips]:
            own = {place: curve for place, curve in (channels.curves(action, slot) if slot else {}).items()
                   if not curve.mute and len(curve.keyframe_points)}
            if not own:
                continue
            found |= own
            ends.append(extent or channels.keyed_range(own))
        if not found:
            raise no_motion(rig)
        first = int(np.ceil(min(a for a, _ in ends) - 1e-4))
        last = int(np.floor(max(b for _, b in ends) + 1e-4))
        if any(_cycles(curve) for curve in found.values()):
            first, last = min(first, scene.frame_start), max(last, scene.frame_end)
            self.told.append(f"its animation curves repeat: the motion is that of frames {first} to {last}")
        if not 1 <= last - first < _MOST:
            raise InputError(f"armature {rig.name}", f"has a motion of {last - first + 1} frame{'s' * (last > first)}",
                             f"2 to {_MOST} frames", "key more than one frame")
        self.frames = np.arange(first, last + 1)
        self.layered = layered(rig)
        paths = {path for path, _ in found}
        self.others = {path for path in paths if posed_bone(path) is None and _resolves(rig, path)}
        self.places = {place for place in found if posed_bone(place[0]) is not None or place[0] in self.others}
        self.switches = any(path not in _OBJECT for path in self.others)
        self.bones = {bone for path in paths if (bone := posed_bone(path)) is not None}
        self.object_keyed = bool(_OBJECT & paths)


def playing_strips(rig: bpy.types.Object, aside: bool = False) -> list:
    """List the NLA strips that play; aside: also while all of them are muted."""
    data = rig.animation_data
    if data is None or not data.use_nla and not aside:
        return []
    solo = [track for track in data.nla_tracks if track.is_solo]
    return [strip for track in (solo or data.nla_tracks) if not track.mute or track.is_solo
            for strip in track.strips if not strip.mute and strip.action is not None]


def layered(rig: bpy.types.Object) -> bool:
    """Return whether an armature plays more than its action: strips below it, or only a share of it."""
    data = rig.animation_data
    part = data.action is not None and (data.action_influence != 1.0 or data.action_blend_type != "REPLACE")
    return part or bool(playing_strips(rig))


def _cycles(curve: bpy.types.FCurve) -> bool:
    return any(one.type == "CYCLES" and not one.mute for one in curve.modifiers)


def posed_bone(path: str) -> str | None:
    """Find the bone whose place, rotation or scale a data path is; None for other paths."""
    match = BONE.match(path)
    return bpy.utils.unescape_identifier(match[1]) if match and match[2] in CHANNELS else None


def _resolves(rig: bpy.types.Object, path: str) -> bool:
    try:
        rig_look.numbers_of(rig.path_resolve(path))
    except (ValueError, TypeError):
        return False
    return True


def _controls(rig: bpy.types.Object, side: bpy.types.Scene, parts, played: Played) -> list[str]:
    """List the bones that may have to be written: keyed bones, controls and followers of the body, and free top bones.

    Bones that move nothing visible are left out.
    """
    driven = _driven(rig)
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
        idle = {name for name, moves in zip(unkeyed, control_study.list_moving(rig, side, unkeyed, shown)) if not moves}
        names = [name for name in names if name not in idle]
    return sorted(names, key=lambda name: len(rig.data.bones[name].parent_recursive))


def _driven(rig: bpy.types.Object) -> set[str]:
    """List the bones whose place or rotation a driver sets."""
    drivers = rig.animation_data.drivers if rig.animation_data is not None else ()
    return {bone for one in drivers if not one.mute and (bone := posed_bone(one.data_path)) is not None}
