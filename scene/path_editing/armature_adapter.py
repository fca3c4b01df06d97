"""Adapters: how an armature's motion is read, and how the edited motion is written to it.

The original, relative to its own path, is computed once and cached while its inputs stay the same. `PlainAdapter` is
for armatures whose bones are keyed directly. Other kinds are in `rigs`, where `choose_adapter` decides.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import bpy
import numpy as np

from ...beyond_mocap.base.digest import byte_digest
from ...beyond_mocap.base.errors import BeyondMocapError, InputError
from ...beyond_mocap.motion import quaternion
from ...beyond_mocap.motion.motion import Motion
from ..core import action, channels
from ..core.measure import frames_per_second, units_per_metre
from ..core.saved_state import restore_playback, save_playback
from ..rigs import armature
from . import keys

MARK = "beyond_mocap_ride"  # custom property of an edited body's action: a digest of its inputs
SOURCE_SETTINGS = ("fit", "degree", "frame")  # settings on which the original's own path and the offsets from it depend

_sources: dict[int, OriginalMotion] = {}  # by session_uid of the armature
# likewise: the original action and its keys' digest, until they may have changed
_keys: dict[int, tuple[int, bytes]] = {}
_refused: dict[int, tuple[bytes, str]] = {}  # likewise: digest of inputs that could not be read, and the error


@dataclass(frozen=True, eq=False)
class ReadMotion:
    """A motion in metres of the scene's world at the scene's rate.

    Attributes:
        motion: the original motion.
        first: scene frame of its first frame.
        standing: (T, 2, 2) bool, contact of left and right, heel and toe; None where unknown.
        messages: lines for the user.
    """

    motion: Motion
    first: int
    standing: np.ndarray | None = None
    messages: tuple[str, ...] = ()


def find_original(body: bpy.types.Object) -> tuple[bpy.types.Action | None, object]:
    """Find action and slot of an armature's own motion: the stored ones of an edited body, else those that play."""
    if not body.beyond_mocap_ride.on:
        return channels.find_playing_action(body)
    before = body.beyond_mocap_ride.before
    if before.action is None:
        return None, None
    slots = [slot for slot in before.action.slots if slot.target_id_type == "OBJECT"]
    return before.action, next((slot for slot in slots if slot.identifier == before.slot), slots[0] if slots else None)


def build_no_motion_error(body: bpy.types.Object) -> InputError:
    """Build the error for an armature that plays nothing."""
    return InputError(f"armature {body.name}", "plays no action", "a motion", "import one, or choose an action")


def check_finite(body: bpy.types.Object, motion: Motion) -> None:
    """Raise InputError if an armature's motion has NaN or infinite values."""
    if not (np.isfinite(motion.root_positions).all() and np.isfinite(motion.rotations).all()):
        raise InputError(f"armature {body.name}", "a pose with NaN or infinite values", "finite values",
                         "check its keys")


def check_editable_override(body: bpy.types.Object, what: str = "armature") -> None:
    """Raise InputError if an object is a library override that cannot be edited."""
    if body.override_library is not None and body.override_library.is_system_override:
        raise InputError(f"{what} {body.name}", "is an override that cannot be edited", "an editable override",
                         "make it editable: Outliner, Library Override, Make")


class ArmatureAdapter(ABC):
    """Reads and writes the motion of one armature during one event; it keeps no Blender data longer than that."""

    def __init__(self, body: bpy.types.Object):
        self.body = body

    @property
    def edit(self):
        """The stored state of the armature's path edit."""
        return self.body.beyond_mocap_ride

    def find_source(self) -> tuple[bpy.types.Action | None, object]:
        """Find action and slot of the original motion."""
        return find_original(self.body)

    def check(self) -> None:
        """Raise InputError if the armature cannot follow a path."""
        body = self.body
        channels.check_local(body)
        check_editable_override(body)
        if body.mode == "EDIT":
            raise InputError(f"armature {body.name}", "is in edit mode", "object or pose mode",
                             "leave edit mode (Tab)")
        channels.check_editable(body)

    @abstractmethod
    def compute_input_digest(self, scene: bpy.types.Scene) -> bytes:
        """Compute a fast digest of all inputs of `read_motion` except the original's keys."""

    @abstractmethod
    def read_motion(self, scene: bpy.types.Scene) -> ReadMotion:
        """Read the original motion. Raises InputError if there is none."""

    @abstractmethod
    def start_edit(self) -> None:
        """Store the original and play an action of ours, with MARK."""

    @abstractmethod
    def write_motion(self, scene: bpy.types.Scene, original: ReadMotion, edited, digest: str) -> None:
        """Write the edited motion to our action and its digest to MARK.

        Everything is computed before anything is written. Raises InputError, and changes nothing, if it cannot be
        written.
        """

    def revert_edit(self) -> None:
        """Play the original again, bit for bit, in its previous state."""
        restore_playback(self.edit.before, self.body, MARK)

    @abstractmethod
    def detach_action(self) -> None:
        """Make our action independent of the path edit, for it is to stay."""

    def compute_keys_digest(self) -> bytes:
        """Compute a digest of the original's keys."""
        found, slot = self.find_source()
        if found is None or slot is None:
            return b""
        parts = []
        for (path, index), curve in channels.collect_curves(found, slot).items():
            parts += [f"{path} {index} {len(curve.modifiers)}", keys.read_keys(curve)]
        return byte_digest(*parts)

    def find_edit_action(self) -> tuple[bpy.types.Action, object]:
        """Find our action and its slot, as a copy if another object plays it too: a duplicated body has its own path
        edit.

        Raises InputError if the armature plays another action.
        """
        found, slot = channels.find_playing_action(self.body)
        if found is None or not found.get(MARK):
            raise InputError(f"armature {self.body.name}", "plays another action than that of its path edit",
                             "that action", "choose it again in the Action Editor, or press Revert")
        channels.check_local(found)
        if found.users - found.use_fake_user < 2:
            return found, slot
        copy = found.copy()
        copy.use_fake_user = False
        channels.assign_action(self.body, copy, next(one for one in copy.slots if one.identifier == slot.identifier))
        return channels.find_playing_action(self.body)


class PlainAdapter(ArmatureAdapter):
    """An armature whose motion is the channels of its bones, in any rotation mode."""

    def check(self) -> None:
        super().check()
        self._check_original()

    def _check_original(self) -> tuple[bpy.types.Action, object]:
        found, slot = self.find_source()
        if found is None:
            raise build_no_motion_error(self.body)
        return found, slot

    def compute_input_digest(self, scene: bpy.types.Scene) -> bytes:
        body, bones = self.body, self.body.data.bones
        rest = np.empty(16 * len(bones), np.float32)
        bones.foreach_get("matrix_local", rest)
        modes = " ".join(bone.rotation_mode for bone in body.pose.bones)
        form = f"{frames_per_second(scene)!r} {units_per_metre(scene)!r} {modes}"
        return byte_digest(np.array(body.matrix_world), rest, form)

    def read_motion(self, scene: bpy.types.Scene) -> ReadMotion:
        """Read the motion of the bones' channels."""
        found, slot = self._check_original()
        motion = action.read_motion(self.body, scene, found, slot)
        if not (np.isfinite(motion.root_positions).all() and np.isfinite(motion.rotations).all()):
            raise InputError(f"action {found.name}", "a key with NaN or infinite values", "finite values",
                             "delete that key")
        ends = channels.find_key_range({
            key: curve for key, curve in channels.collect_curves(found, slot).items() if key[0].startswith("pose.bones")
        })
        return ReadMotion(motion, ends[0])

    def start_edit(self) -> None:
        original, slot = self.find_source()
        save_playback(self.edit.before, self.body)
        identifier = slot.identifier
        edit_action = original.copy()
        edit_action.name, edit_action.use_fake_user = f"{self.body.name} path motion", False
        keys.prepare_action(edit_action, identifier, MARK)
        channels.assign_action(self.body, edit_action, next(slot for slot in edit_action.slots if slot.identifier
                                                            == identifier))

    def write_motion(self, scene: bpy.types.Scene, original: ReadMotion, edited, digest: str) -> None:
        """Write the changed channels, and the original ones resampled where other source frames are displayed."""
        action_to_write, slot = self.find_edit_action()
        sheet = keys.ActionPair.from_actions(action_to_write, slot, *self.find_source())
        targets = self._compute_channels(scene, original, edited, sheet)
        whole = np.arange(len(original.motion), dtype=float)
        if not np.array_equal(edited.frames, whole):
            others = [place for place in sheet.sources if place not in targets]
            targets |= keys.sample_channels(sheet, others, original.first + whole, original.first + edited.frames)
        if not all(np.isfinite(values).all() for values in targets.values()):
            raise InputError("motion on the path", "a pose with NaN or infinite values", "finite values",
                             "undo the last edit")
        keys.write_channels(sheet, original.first, targets, str(action_to_write[MARK]), digest)
        action_to_write[action.PLACEMENT] = [number for row in self.body.matrix_world for number in row]
        action_to_write[MARK] = digest

    def detach_action(self) -> None:
        if self.find_source()[0] is not None:
            keys.remove_muted_modifiers(keys.ActionPair.from_actions(*self.find_edit_action(), *self.find_source()))

    def _compute_channels(self, scene: bpy.types.Scene, original: ReadMotion, edited,
                          sheet: keys.ActionPair) -> dict[keys.Place, np.ndarray]:
        """Compute the values (N,) of the bones' channels that differ from the original."""
        body, motion, names = self.body, edited.motion, edited.motion.skeleton.names
        bones = [body.pose.bones[name] for name in names]
        changed = _find_changed_joints(original.motion, motion)
        joints = [
            joint for joint, bone in enumerate(bones) if changed[joint]
            or sheet.has_added(_build_data_path(bone, bone.rotation_mode))
        ]
        placement, rest = armature.find_current_placement(body, scene), armature.compute_rest_rotations(body, names)
        turns, at_rest = motion.rotations[:, joints], rest[joints]
        if joints and joints[0] == 0:
            turns[:, 0] = quaternion.multiply(quaternion.inverse(placement.rotation), turns[:, 0])
        poses = quaternion.multiply(quaternion.multiply(quaternion.inverse(at_rest), turns), at_rest)
        shift = placement.to_armature(motion.root_positions) - np.array(bones[0].bone.head_local)
        found = keys.split_channels(_build_data_path(bones[0], "location"),
                                    quaternion.rotate(quaternion.inverse(rest[0]), shift))
        for number, joint in enumerate(joints):
            mode = bones[joint].rotation_mode
            found |= keys.split_channels(_build_data_path(bones[joint], mode),
                                         keys.to_rotation_channel(mode, poses[:, number]))
        return found


@dataclass(frozen=True, eq=False)
class OriginalMotion:
    """An original motion, relative to its own path.

    Attributes:
        read: the original motion.
        core: `PathEditSource` of the core.
        digest: of all inputs.
    """

    read: ReadMotion
    core: object
    digest: bytes


def clear_source_cache() -> None:
    """Clear all caches when another file is opened."""
    _sources.clear()
    invalidate_sources()


def invalidate_sources() -> None:
    """Mark the keys of all originals as possibly changed, also of those that could not be read."""
    _keys.clear()
    _refused.clear()


def read_source(adapter: ArmatureAdapter, scene: bpy.types.Scene, settings) -> OriginalMotion:
    """Read an armature's original motion for these settings of the core, from the cache if its inputs are the same.

    Args:
        adapter: adapter of the armature.
        scene: for rate and unit.
        settings: `PathEditSettings` of the core.
    Returns:
        The motion relative to its own path.
    Raises:
        InputError: if there is no motion.
    """
    from ...beyond_mocap.path_editing.path_edit_source import prepare_source

    uid, options = adapter.body.session_uid, tuple(getattr(settings, name) for name in SOURCE_SETTINGS)
    original = adapter.find_source()[0]
    number = original.session_uid if original is not None else 0
    if uid not in _keys or _keys[uid][0] != number:
        _keys[uid] = number, adapter.compute_keys_digest()
    digest = byte_digest(_keys[uid][1], adapter.compute_input_digest(scene), repr(options))
    known = _sources.get(uid)
    if known is not None and known.digest == digest:
        return known
    if _refused.get(uid, (b"", ""))[0] == digest:
        raise BeyondMocapError(_refused[uid][1])
    keys.invalidate_cache()
    try:
        read = adapter.read_motion(scene)
        found = OriginalMotion(read, prepare_source(read.motion, settings, read.standing), digest)
    except BeyondMocapError as error:  # sampling a rig changes the frame, which would trigger it again and again
        _refused[uid] = digest, str(error)
        raise
    _sources[uid] = found
    return found


def _build_data_path(bone: bpy.types.PoseBone, what: str) -> str:
    """Build the data path of a bone's location, or of its rotation in a mode."""
    name = {"location": "location", "QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}
    return f'pose.bones["{bpy.utils.escape_identifier(bone.name)}"].{name.get(what, "rotation_euler")}'


def _find_changed_joints(before: Motion, after: Motion) -> np.ndarray:
    """Compare two motions: (J,) bool, joints whose rotations differ; all if the motions differ in length."""
    if len(before) != len(after):
        return np.ones(len(after.skeleton), dtype=bool)
    return (np.abs(np.sum(before.rotations * after.rotations, axis=2)) < 1.0 - 1e-11).any(axis=0)
