"""Adapters of armatures whose bones do not simply play their keys: control rigs, inverse kinematics, moving objects,
several travelling bones, NLA strips, modifiers; and the test for plain armatures.

A rig is sampled once, frame by frame (`rig_source`); while a path is dragged everything is arithmetic.
"""

from __future__ import annotations

import json
from contextlib import contextmanager
from dataclasses import dataclass

import bpy
import numpy as np

from ...beyond_mocap.base.digest import byte_digest
from ...beyond_mocap.base.errors import InputError
from ..core import channels
from ..core.action import PLACED
from ..core.measure import frames_per_second, units_per_metre
from ..core.set_aside import play_as_before, put_aside, stance_of, stand
from ..rigs import armature
from ..rigs.bone_curves import is_carried
from ..rigs.control_study import CHANNELS
from . import keys, rig_parts
from .carrier import MARK, Carrier, PlainCarrier, Read, check_finite, no_motion
from .rig_source import BONE, RigSource, layered, playing_strips

KIND = "beyond_mocap_ride_kind"
"""Custom property of an edited body's action that was written as a rig: "rig", or "layers" where it replaces
several.
"""

_STILL = 1e-5


@dataclass(frozen=True, eq=False)
class RigRead(Read):
    """The motion that was read, with the rig that shows it."""

    rig: RigSource | None = None


class RigCarrier(Carrier):
    """An armature of any kind: its visible motion is read, and its controls, or its object, are written."""

    def check(self) -> None:
        super().check()
        if self.body.type != "ARMATURE" or not len(self.body.data.bones):
            raise InputError(f"armature {self.body.name}", "has no bones", "an armature with bones")
        if not self.ride.on and self.source()[0] is None and not playing_strips(self.body):
            raise no_motion(self.body)

    def stamp(self, scene: bpy.types.Scene) -> bytes:
        """Compute a digest of rest pose, rates, rotation modes, constraints and unanimated ancestors."""
        body = self.body
        rest = np.empty(16 * len(body.data.bones), np.float32)
        body.data.bones.foreach_get("matrix_local", rest)
        form = [frames_per_second(scene), units_per_metre(scene), [bone.rotation_mode for bone in body.pose.bones]]
        form += [[one.type, one.mute, getattr(one, "subtarget", ""), getattr(one, "target", None) and one.target.name]
                 for bone in body.pose.bones for one in bone.constraints]
        original, slot = self.source()
        found = channels.curves(original, slot) if slot is not None else {}
        thing = body.parent if any(not path.startswith("pose.") for path, _ in found) else body
        while thing is not None:
            if thing is body or thing.animation_data is None:
                form.append([thing.name, [list(row) for row in thing.matrix_basis]])
            thing = thing.parent
        return byte_digest(rest, repr(form))

    def keys_digest(self) -> bytes:
        parts = [super().keys_digest()]
        for strip in self._strips():
            parts.append(repr((strip.action.name, strip.frame_start, strip.frame_end, strip.scale, strip.repeat,
                               strip.blend_type, strip.influence, strip.mute)))
            for place, curve in channels.curves(strip.action, strip.action_slot).items():
                parts += [repr(place), keys.places(curve)]
        return byte_digest(*parts)

    def read(self, scene: bpy.types.Scene) -> Read:
        armature.placement(self.body, scene)  # an uneven scale turns bones askew
        with self._original():
            rig = RigSource(self.body, scene)
        check_finite(self.body, rig.motion)
        return RigRead(rig.motion, rig.start, None, tuple(rig.told), rig)

    def begin(self) -> None:
        """Store the original and play an action of ours: a copy of the original, or a new one if several layers
        play.
        """
        body, (original, slot) = self.body, self.source()
        several = layered(body)
        put_aside(self.ride.before, body)
        name = f"{body.name} path motion"
        if several or original is None:
            made = bpy.data.actions.new(name)
            own = made.slots.new(id_type="OBJECT", name=body.name)
            keys.begin(made, own.identifier, MARK)
        else:
            made = original.copy()
            made.name, made.use_fake_user = name, False
            keys.begin(made, slot.identifier, MARK)
            own = next(one for one in made.slots if one.identifier == slot.identifier)
        made[KIND] = "layers" if several else "rig"
        channels.assign(body, made, own)

    def write(self, scene: bpy.types.Scene, read: Read, ridden, digest: str) -> None:
        """Write the controls' channels that differ from the source."""
        made, slot = self.ours()
        rig, (original, own) = read.rig, self.source()
        sources = {} if made[KIND] == "layers" or original is None else channels.curves(original, own)
        sheet = keys.Sheet(made, slot, channels.curves(made, slot), sources)
        wanted = rig.values(ridden, self.body)
        rows = rig.rows(ridden)
        for place in sheet.curves:  # written before, but now equal to the source again
            if place not in wanted and place not in sources and (values := rig.own(*place, rows)) is not None:
                wanted[place] = values
        if not all(np.isfinite(values).all() for values in wanted.values()):
            raise InputError("motion on the path", "a pose with NaN or infinite values", "finite values",
                             "undo the last edit")
        keys.lay(sheet, read.first, wanted, str(made[MARK]), digest)
        for place in wanted:
            if sheet.curves[place].mute:
                sheet.curves[place].mute = False
        made[PLACED] = [number for row in self.body.matrix_world for number in row]
        made[MARK] = digest

    def settle(self) -> None:
        made, slot = self.ours()
        original, own = self.source()
        before = self.ride.before
        if made[KIND] == "layers":  # the action includes the effect of the strips: they are muted
            before.use_nla, before.influence, before.blend, before.extrapolation = False, 1.0, "REPLACE", "HOLD"
        elif original is not None:
            keys.settle(keys.Sheet.of(made, slot, original, own))
        del made[KIND]

    def _strips(self) -> list:
        """List the NLA strips that contribute to the original."""
        data = self.body.animation_data
        if data is None or self.ride.on and not self.ride.before.use_nla:
            return []
        return playing_strips(self.body, aside=self.ride.on)

    @contextmanager
    def _original(self):
        """Restore the original armature for the length of a `with`."""
        body, before = self.body, self.ride.before
        if not self.ride.on:
            yield
            return
        data, now = body.animation_data, stance_of(body)
        mine = (data.action, data.action_slot, data.use_nla, data.action_influence, data.action_blend_type,
                data.action_extrapolation)
        try:
            original, slot = self.source()
            data.action = original
            if original is not None:
                data.action_slot = slot
            play_as_before(before, data)
            stand(body, json.loads(before.stance))
            yield
        finally:
            data.action, data.action_slot = mine[:2]
            data.use_nla, data.action_influence, data.action_blend_type, data.action_extrapolation = mine[2:]
            stand(body, now)
            body.update_tag(refresh={"OBJECT", "DATA", "TIME"})


def carrier_of(body: bpy.types.Object) -> Carrier:
    """Choose the adapter of an armature."""
    return RigCarrier(body) if rides_as_rig(body) else PlainCarrier(body)


def rides_as_rig(body: bpy.types.Object) -> bool:
    """Return whether an armature is edited as a rig: as its path edit started, or would now."""
    if body.beyond_mocap_ride.on:
        playing = channels.playing(body)[0]
        return playing is not None and bool(playing.get(KIND))
    return body.type == "ARMATURE" and bool(playing_strips(body) or channels.playing(body)[0]) and not is_plain(body)


def is_plain(body: bpy.types.Object) -> bool:
    """Return whether an armature shows exactly the channels of its bones, of which only the topmost travels."""
    data = body.animation_data
    if data is None or layered(body) or is_carried(body):
        return False
    bones = body.pose.bones
    if any(not one.mute and one.influence > 0.0 for bone in bones for one in bone.constraints):
        return False
    if any(driver.data_path.startswith("pose.") for driver in data.drivers):
        return False
    roots = [bone for bone in body.data.bones if bone.parent is None]
    if len(roots) > 1 or not all(
        bone.use_inherit_rotation and bone.inherit_scale == "FULL" and bone.use_local_location
        for bone in body.data.bones if bone.parent is not None
    ):
        return False
    if any(_out_of_joint(bone, 1e-4 * body.dimensions.length) for bone in bones):
        return False
    action, slot = channels.playing(body)
    found = channels.curves(action, slot) if action is not None else {}
    top = f'pose.bones["{bpy.utils.escape_identifier(roots[0].name)}"].location' if roots else ""
    for (path, _), curve in found.items():
        if curve.mute or curve.modifiers:
            return False
        posed = BONE.match(path)
        moves = path in CHANNELS or posed is not None and posed[2] in ("location", "scale") and not path.startswith(top)
        if (moves or posed is not None and posed[2] == "scale") and _varies(curve):
            return False
    humanoid = rig_parts.of_rig(body)
    return humanoid is not None and body.data.bones[humanoid.controls["hips"]].parent is None


def _out_of_joint(bone: bpy.types.PoseBone, least: float) -> bool:
    """Return whether a bone is away from where its parent puts it, or of another size."""
    return bone.parent is not None and bone.location.length > least or max(abs(one - 1.0) for one in bone.scale) > 1e-4


def _varies(curve: bpy.types.FCurve) -> bool:
    values = keys.places(curve)[1::2]
    return bool(len(values)) and float(np.ptp(values)) > _STILL
