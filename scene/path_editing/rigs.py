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
from ..core.action import PLACEMENT
from ..core.measure import frames_per_second, units_per_metre
from ..core.saved_state import apply_stance, read_stance, restore_nla, save_playback
from ..rigs import armature
from ..rigs.bone_curves import is_carried
from ..rigs.control_study import CHANNELS
from . import keys, rig_parts
from .armature_adapter import MARK, ArmatureAdapter, PlainAdapter, ReadMotion, build_no_motion_error, check_finite
from .rig_source import BONE, RigSource, is_layered, list_playing_strips

KIND = "beyond_mocap_ride_kind"
"""Custom property of an edited body's action that was written as a rig: "rig", or "layers" where it replaces
several.
"""

_STILL = 1e-5


@dataclass(frozen=True, eq=False)
class RigMotion(ReadMotion):
    """The motion that was read, with the rig that shows it."""

    rig: RigSource | None = None


class RigAdapter(ArmatureAdapter):
    """An armature of any kind: its visible motion is read, and its controls, or its object, are written."""

    def check(self) -> None:
        super().check()
        if self.body.type != "ARMATURE" or not len(self.body.data.bones):
            raise InputError(f"armature {self.body.name}", "has no bones", "an armature with bones")
        if not self.edit.on and self.find_source()[0] is None and not list_playing_strips(self.body):
            raise build_no_motion_error(self.body)

    def compute_input_digest(self, scene: bpy.types.Scene) -> bytes:
        """Compute a digest of rest pose, rates, rotation modes, constraints and unanimated ancestors."""
        body = self.body
        rest = np.empty(16 * len(body.data.bones), np.float32)
        body.data.bones.foreach_get("matrix_local", rest)
        form = [frames_per_second(scene), units_per_metre(scene), [bone.rotation_mode for bone in body.pose.bones]]
        form += [[one.type, one.mute, getattr(one, "subtarget", ""), getattr(one, "target", None) and one.target.name]
                 for bone in body.pose.bones for one in bone.constraints]
        original, slot = self.find_source()
        found = channels.collect_curves(original, slot) if slot is not None else {}
        ancestor = body.parent if any(not path.startswith("pose.") for path, _ in found) else body
        while ancestor is not None:
            if ancestor is body or ancestor.animation_data is None:
                form.append([ancestor.name, [list(row) for row in ancestor.matrix_basis]])
            ancestor = ancestor.parent
        return byte_digest(rest, repr(form))

    def compute_keys_digest(self) -> bytes:
        parts = [super().compute_keys_digest()]
        for strip in self._list_strips():
            parts.append(repr((strip.action.name, strip.frame_start, strip.frame_end, strip.scale, strip.repeat,
                               strip.blend_type, strip.influence, strip.mute)))
            for place, curve in channels.collect_curves(strip.action, strip.action_slot).items():
                parts += [repr(place), keys.read_keys(curve)]
        return byte_digest(*parts)

    def read_motion(self, scene: bpy.types.Scene) -> ReadMotion:
        armature.find_placement(self.body, scene)  # an uneven scale turns bones askew
        with self._restore_original():
            rig = RigSource(self.body, scene)
        check_finite(self.body, rig.motion)
        return RigMotion(rig.motion, rig.start, None, tuple(rig.messages), rig)

    def start_edit(self) -> None:
        """Store the original and play an action of ours: a copy of the original, or a new one if several layers
        play.
        """
        body, (original, slot) = self.body, self.find_source()
        several = is_layered(body)
        save_playback(self.edit.before, body)
        name = f"{body.name} path motion"
        if several or original is None:
            action = bpy.data.actions.new(name)
            own = action.slots.new(id_type="OBJECT", name=body.name)
            keys.prepare_action(action, own.identifier, MARK)
        else:
            action = original.copy()
            action.name, action.use_fake_user = name, False
            keys.prepare_action(action, slot.identifier, MARK)
            own = next(one for one in action.slots if one.identifier == slot.identifier)
        action[KIND] = "layers" if several else "rig"
        channels.assign_action(body, action, own)

    def write_motion(self, scene: bpy.types.Scene, original_motion: ReadMotion, edited, digest: str) -> None:
        """Write the controls' channels that differ from the source."""
        action, slot = self.find_edit_action()
        rig, (original, own) = original_motion.rig, self.find_source()
        sources = {} if action[KIND] == "layers" or original is None else channels.collect_curves(original, own)
        sheet = keys.ActionPair(action, slot, channels.collect_curves(action, slot), sources)
        targets = rig.compute_channels(edited, self.body)
        rows = rig.build_rows(edited)
        for place in sheet.curves:  # written before, but now equal to the source again
            if place not in targets and place not in sources:
                if (values := rig.sample_channel(*place, rows)) is not None:
                    targets[place] = values
        if not all(np.isfinite(values).all() for values in targets.values()):
            raise InputError("motion on the path", "a pose with NaN or infinite values", "finite values",
                             "undo the last edit")
        keys.write_channels(sheet, original_motion.first, targets, str(action[MARK]), digest)
        for place in targets:
            if sheet.curves[place].mute:
                sheet.curves[place].mute = False
        action[PLACEMENT] = [number for row in self.body.matrix_world for number in row]
        action[MARK] = digest

    def detach_action(self) -> None:
        action, slot = self.find_edit_action()
        original, own = self.find_source()
        before = self.edit.before
        if action[KIND] == "layers":  # the action includes the effect of the strips: they are muted
            before.use_nla, before.influence, before.blend, before.extrapolation = False, 1.0, "REPLACE", "HOLD"
        elif original is not None:
            keys.remove_muted_modifiers(keys.ActionPair.from_actions(action, slot, original, own))
        del action[KIND]

    def _list_strips(self) -> list:
        """List the NLA strips that contribute to the original."""
        data = self.body.animation_data
        if data is None or self.edit.on and not self.edit.before.use_nla:
            return []
        return list_playing_strips(self.body, include_muted=self.edit.on)

    @contextmanager
    def _restore_original(self):
        """Restore the original armature for the length of a `with`."""
        body, before = self.body, self.edit.before
        if not self.edit.on:
            yield
            return
        data, now = body.animation_data, read_stance(body)
        saved_state = (data.action, data.action_slot, data.use_nla, data.action_influence, data.action_blend_type,
                       data.action_extrapolation)
        try:
            original, slot = self.find_source()
            data.action = original
            if original is not None:
                data.action_slot = slot
            restore_nla(before, data)
            apply_stance(body, json.loads(before.stance))
            yield
        finally:
            data.action, data.action_slot = saved_state[:2]
            data.use_nla, data.action_influence, data.action_blend_type, data.action_extrapolation = saved_state[2:]
            apply_stance(body, now)
            body.update_tag(refresh={"OBJECT", "DATA", "TIME"})


def choose_adapter(body: bpy.types.Object) -> ArmatureAdapter:
    """Choose the adapter of an armature."""
    return RigAdapter(body) if is_edited_as_rig(body) else PlainAdapter(body)


def is_edited_as_rig(body: bpy.types.Object) -> bool:
    """Return whether an armature is edited as a rig: as its path edit started, or would now."""
    if body.beyond_mocap_ride.on:
        playing = channels.find_playing_action(body)[0]
        return playing is not None and bool(playing.get(KIND))
    return body.type == "ARMATURE" and bool(list_playing_strips(body)
                                            or channels.find_playing_action(body)[0]) and not is_plain(body)


def is_plain(body: bpy.types.Object) -> bool:
    """Return whether an armature is an upright body that shows exactly the channels of its bones."""
    if not is_keyed_on_bones(body):
        return False
    humanoid = rig_parts.identify_parts(body)
    return humanoid is not None and body.data.bones[humanoid.controls["hips"]].parent is None


def is_keyed_on_bones(body: bpy.types.Object) -> bool:
    """Return whether an armature shows exactly the channels of its bones, of which only the topmost travels."""
    data = body.animation_data
    if data is None or is_layered(body) or is_carried(body):
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
    if any(_is_displaced(bone, 1e-4 * body.dimensions.length) for bone in bones):
        return False
    action, slot = channels.find_playing_action(body)
    found = channels.collect_curves(action, slot) if action is not None else {}
    top = f'pose.bones["{bpy.utils.escape_identifier(roots[0].name)}"].location' if roots else ""
    for (path, _), curve in found.items():
        if curve.mute or curve.modifiers:
            return False
        posed = BONE.match(path)
        moves = path in CHANNELS or posed is not None and posed[2] in ("location", "scale") and not path.startswith(top)
        if (moves or posed is not None and posed[2] == "scale") and _has_variation(curve):
            return False
    return True


def _is_displaced(bone: bpy.types.PoseBone, least: float) -> bool:
    """Return whether a bone is away from where its parent puts it, or of another size."""
    return bone.parent is not None and bone.location.length > least or max(abs(one - 1.0) for one in bone.scale) > 1e-4


def _has_variation(curve: bpy.types.FCurve) -> bool:
    values = keys.read_keys(curve)[1::2]
    return bool(len(values)) and float(np.ptp(values)) > _STILL
