"""What carries a motion: how an armature's motion is read, and how the ridden one is written onto it. The original,
relative to its own path, is worked out once and kept as long as nothing of it changes.

`PlainCarrier` knows armatures whose bones are keyed themselves. Other kinds are in `rigs`, where `carrier_of` chooses.
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
from ..core.set_aside import bring_back, put_aside
from ..rigs import armature
from . import keys

MARK = "beyond_mocap_ride"  # custom property of an action that a rider plays: a digest of what it was made of
MADE_OF = ("fit", "degree", "frame")  # settings that the original's own path and the offsets from it depend on

_sources: dict[int, Source] = {}  # by session_uid of the armature
# likewise: the original action and its keys' digest, until they may have changed
_keys: dict[int, tuple[int, bytes]] = {}
_refused: dict[int, tuple[bytes, str]] = {}  # likewise: digest of what could not be read, and why


@dataclass(frozen=True, eq=False)
class Read:
    """A motion in metres of the scene's world at the scene's rate, its first frame on scene frame `first`; standing
    (T, 2, 2) bool, left and right, heel and toe, where it is known; told: lines for the user."""

    motion: Motion
    first: int
    standing: np.ndarray | None = None
    told: tuple[str, ...] = ()


def original_of(body: bpy.types.Object) -> tuple[bpy.types.Action | None, object]:
    """Action and slot of an armature's own motion: of a rider those put aside, else those that are played."""
    if not body.beyond_mocap_ride.on:
        return channels.playing(body)
    before = body.beyond_mocap_ride.before
    if before.action is None:
        return None, None
    slots = [slot for slot in before.action.slots if slot.target_id_type == "OBJECT"]
    return before.action, next((slot for slot in slots if slot.identifier == before.slot), slots[0] if slots else None)


def no_motion(body: bpy.types.Object) -> InputError:
    """The error of an armature that plays nothing."""
    return InputError(f"armature {body.name}", "it plays no action", "a motion", "import one, or choose an action")


def check_finite(body: bpy.types.Object, motion: Motion) -> None:
    """InputError where an armature's motion has a pose that is no number."""
    if not (np.isfinite(motion.root_positions).all() and np.isfinite(motion.rotations).all()):
        raise InputError(f"armature {body.name}", "a pose that is no number", "numbers", "look at its keys")


def refuse_system_override(body: bpy.types.Object, what: str = "armature") -> None:
    """InputError where an object is a library override that cannot be edited."""
    if body.override_library is not None and body.override_library.is_system_override:
        raise InputError(f"{what} {body.name}", "an override that cannot be edited", "an editable override",
                         "make it editable: Outliner, Library Override, Make")


class Carrier(ABC):
    """One armature for the length of one event; nothing of Blender's is kept in it longer than that."""

    def __init__(self, body: bpy.types.Object):
        self.body = body

    @property
    def ride(self):
        """What the armature keeps of its ride."""
        return self.body.beyond_mocap_ride

    def source(self) -> tuple[bpy.types.Action | None, object]:
        """Action and slot of the original motion."""
        return original_of(self.body)

    def check(self) -> None:
        """InputError where the armature cannot ride."""
        body = self.body
        channels.check_local(body)
        refuse_system_override(body)
        if body.mode == "EDIT":
            raise InputError(f"armature {body.name}", "its bones are being edited", "object or pose mode",
                             "leave edit mode (Tab)")
        channels.check_free(body)

    @abstractmethod
    def stamp(self, scene: bpy.types.Scene) -> bytes:
        """Quick: another where `read` would read something else though no key of the original is another."""

    @abstractmethod
    def read(self, scene: bpy.types.Scene) -> Read:
        """The original motion. InputError where there is none."""

    @abstractmethod
    def begin(self) -> None:
        """Put the original aside and play an action of ours, which carries MARK."""

    @abstractmethod
    def write(self, scene: bpy.types.Scene, read: Read, ridden, digest: str) -> None:
        """Bring the ridden motion into our action and note the digest in MARK. All is worked out before anything is
        written; InputError, and nothing changed, where it cannot be written."""

    def end(self) -> None:
        """Play the original again, to the last bit, and stand as before."""
        bring_back(self.ride.before, self.body, MARK)

    @abstractmethod
    def settle(self) -> None:
        """Our action is to stay: it needs nothing of ours any more."""

    def keys_digest(self) -> bytes:
        """Another where a key of the original is another."""
        found, slot = self.source()
        if found is None or slot is None:
            return b""
        parts = []
        for (path, index), curve in channels.curves(found, slot).items():
            parts += [f"{path} {index} {len(curve.modifiers)}", keys.places(curve)]
        return byte_digest(*parts)

    def ours(self) -> tuple[bpy.types.Action, object]:
        """Our action and its slot; a copy where another object plays it too: a duplicate of a rider is a rider of its
        own. InputError where the armature plays another."""
        found, slot = channels.playing(self.body)
        if found is None or not found.get(MARK):
            raise InputError(f"armature {self.body.name}", "it plays another action than that of its ride",
                             "that action", "choose it again in the Action Editor, or press Leave")
        channels.check_local(found)
        if found.users - found.use_fake_user < 2:
            return found, slot
        copy = found.copy()
        copy.use_fake_user = False
        channels.assign(self.body, copy, next(one for one in copy.slots if one.identifier == slot.identifier))
        return channels.playing(self.body)


class PlainCarrier(Carrier):
    """An armature whose motion is the channels of its bones, in any rotation mode."""

    def check(self) -> None:
        super().check()
        self._original()

    def _original(self) -> tuple[bpy.types.Action, object]:
        found, slot = self.source()
        if found is None:
            raise no_motion(self.body)
        return found, slot

    def stamp(self, scene: bpy.types.Scene) -> bytes:
        body, bones = self.body, self.body.data.bones
        rest = np.empty(16 * len(bones), np.float32)
        bones.foreach_get("matrix_local", rest)
        modes = " ".join(bone.rotation_mode for bone in body.pose.bones)
        form = f"{frames_per_second(scene)!r} {units_per_metre(scene)!r} {modes}"
        return byte_digest(np.array(body.matrix_world), rest, form)

    def read(self, scene: bpy.types.Scene) -> Read:
        found, slot = self._original()
        motion = action.read(self.body, scene, found, slot)
        if not (np.isfinite(motion.root_positions).all() and np.isfinite(motion.rotations).all()):
            raise InputError(f"action {found.name}", "a key that is no number", "numbers", "delete that key")
        ends = channels.keyed_range({
            key: curve for key, curve in channels.curves(found, slot).items() if key[0].startswith("pose.bones")
        })
        return Read(motion, ends[0])

    def begin(self) -> None:
        original, slot = self.source()
        put_aside(self.ride.before, self.body)
        identifier = slot.identifier
        made = original.copy()
        made.name, made.use_fake_user = f"{self.body.name} path motion", False
        keys.begin(made, identifier, MARK)
        channels.assign(self.body, made, next(slot for slot in made.slots if slot.identifier == identifier))

    def write(self, scene: bpy.types.Scene, read: Read, ridden, digest: str) -> None:
        made, slot = self.ours()
        sheet = keys.Sheet.of(made, slot, *self.source())
        wanted = self._wanted(scene, read, ridden, sheet)
        whole = np.arange(len(read.motion), dtype=float)
        if not np.array_equal(ridden.frames, whole):
            others = [place for place in sheet.sources if place not in wanted]
            wanted |= keys.sampled(sheet, others, read.first + whole, read.first + ridden.frames)
        if not all(np.isfinite(values).all() for values in wanted.values()):
            raise InputError("motion on the path", "a pose that is no number", "numbers", "take back the last edit")
        keys.lay(sheet, read.first, wanted, str(made[MARK]), digest)
        made[action.PLACED] = [number for row in self.body.matrix_world for number in row]
        made[MARK] = digest

    def settle(self) -> None:
        if self.source()[0] is not None:
            keys.settle(keys.Sheet.of(*self.ours(), *self.source()))

    def _wanted(self, scene: bpy.types.Scene, read: Read, ridden, sheet: keys.Sheet) -> dict[keys.Place, np.ndarray]:
        """Values (N,) of the bones' channels that are others than in the original."""
        body, motion, names = self.body, ridden.motion, ridden.motion.skeleton.names
        bones = [body.pose.bones[name] for name in names]
        changed = _changed(read.motion, motion)
        joints = [
            joint for joint, bone in enumerate(bones) if changed[joint] or sheet.added(_path(bone, bone.rotation_mode))
        ]
        lie, rest = armature.placement_now(body, scene), armature.rest_rotations(body, names)
        turns, at_rest = motion.rotations[:, joints], rest[joints]
        if joints and joints[0] == 0:
            turns[:, 0] = quaternion.multiply(quaternion.inverse(lie.rotation), turns[:, 0])
        poses = quaternion.multiply(quaternion.multiply(quaternion.inverse(at_rest), turns), at_rest)
        shift = lie.to_armature(motion.root_positions) - np.array(bones[0].bone.head_local)
        found = keys.columns(_path(bones[0], "location"), quaternion.rotate(quaternion.inverse(rest[0]), shift))
        for number, joint in enumerate(joints):
            mode = bones[joint].rotation_mode
            found |= keys.columns(_path(bones[joint], mode), keys.rotation(mode, poses[:, number]))
        return found


@dataclass(frozen=True, eq=False)
class Source:
    """read: the original motion; core: it relative to its own path; digest: of what both were made of."""

    read: Read
    core: object
    digest: bytes


def forget_sources() -> None:
    """Nothing is remembered any more: another file is open."""
    _sources.clear()
    recheck_sources()


def recheck_sources() -> None:
    """Keys of any original may be others: they are looked at again, those too that could not be read."""
    _keys.clear()
    _refused.clear()


def read_source(carrier: Carrier, scene: bpy.types.Scene, settings) -> Source:
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


def _path(bone: bpy.types.PoseBone, what: str) -> str:
    """The data path of a bone's location, or of its rotation in a mode."""
    name = {"location": "location", "QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}
    return f'pose.bones["{bpy.utils.escape_identifier(bone.name)}"].{name.get(what, "rotation_euler")}'


def _changed(before: Motion, after: Motion) -> np.ndarray:
    """(J,) bool: which joints turn otherwise than before; all where the motions are not of one length."""
    if len(before) != len(after):
        return np.ones(len(after.skeleton), dtype=bool)
    return (np.abs(np.sum(before.rotations * after.rotations, axis=2)) < 1.0 - 1e-11).any(axis=0)
