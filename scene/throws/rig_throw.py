"""Throws on control rigs: the motion of their driven bones, and the throw on their controls (`rig_bake`)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.motion import quaternion
from ..core import channels
from ..path_editing.rigs import choose_adapter, is_plain
from ..rigs import bone_maps, rig_bake
from ..rigs.driven import DrivenRig, check_rig
from ..rigs.fit import BakeOptions, SourceMotion
from .settings import MARK

if TYPE_CHECKING:
    from ...beyond_mocap.motion.motion import Motion

_own_motions: dict[int, tuple["Motion | None", int]] = {}


def find_rig(scene: bpy.types.Scene, body: bpy.types.Object) -> DrivenRig | None:
    """Find the driven bones of an armature that does not simply play its keys, else None.

    Raises:
        InputError: if it cannot be baked.
    """
    settings = body.beyond_mocap_throw
    if not settings.rigged and (settings.before.kept or not _has_other_animation(body)):
        return None
    check_rig(body)
    return DrivenRig(body, bone_maps.load_stored_map(body) or bone_maps.find_bone_map(body), scene)


def read_own_motion(scene: bpy.types.Scene, body: bpy.types.Object) -> tuple["Motion | None", int]:
    """Read a rig's motion without its throw, on its own skeleton, or None, and the scene frame of its first pose."""
    if body.beyond_mocap_throw.rigged:
        if body.session_uid not in _own_motions:
            raise InputError(f"rig {body.name}", "it has a preview from an earlier session", "its own motion",
                             "press Revert first, then throw again")
        return _own_motions[body.session_uid]
    data = body.animation_data
    strips = data is not None and data.use_nla and any(len(one.strips) and not one.mute for one in data.nla_tracks)
    if channels.find_playing_action(body)[0] is None and not strips:
        found = None, scene.frame_start
    else:
        read = choose_adapter(body).read_motion(scene)
        found = read.motion, read.first
    _own_motions[body.session_uid] = found
    return found


def find_stance(rig: DrivenRig) -> tuple[np.ndarray, float]:
    """Find position (2,) m and heading (rad) of a rig without motion."""
    place = rig.placement.to_world(np.array([rig.rest_positions[rig.find_bone("hips")]]))[0]
    forward = quaternion.rotate(quaternion.inverse(rig.upright), np.array([1.0, 0.0, 0.0]))
    forward = quaternion.rotate(rig.placement.rotation, forward)
    return np.asarray(place[:2]), float(np.arctan2(forward[1], forward[0]))


def measure_sole_lift(rig: DrivenRig) -> float:
    """Measure by how much (m) the rig's toes are higher than those of its bare skeleton."""
    from ...beyond_mocap.motion.contacts import measure_sole_height

    return rig.sole - measure_sole_height(rig.skeleton)


def bake_throw(scene: bpy.types.Scene, body: bpy.types.Object, table: dict[str, str], motion: "Motion", start: int,
               name: str):
    """Bake a motion of the driven skeleton to a rig's controls; `remove_throw` removes it.

    Args:
        scene: the scene.
        body: the rig.
        table: part -> bone.
        motion: the motion.
        start: scene frame of its first pose.
        name: name of the action.
    Returns:
        Messages for people.
    """
    source = SourceMotion(motion, start, name)
    fitted = rig_bake.prepare_bake(body, table, source, scene, BakeOptions(exact=True))
    current_action = channels.find_playing_action(body)[0]
    if current_action is not None and not current_action.get(MARK):
        current_action.pop(rig_bake.MARK, None)  # an earlier bake is the rig's own motion, which must not be removed
    baked = rig_bake.apply_bake(fitted)
    baked.action[MARK] = True
    return baked.messages


def remove_throw(body: bpy.types.Object) -> None:
    """Restore a rig's animation before its throw; an earlier bake can still be removed."""
    rig_bake.remove_bake(body)
    current_action = channels.find_playing_action(body)[0]
    if current_action is not None and rig_bake.PREVIOUS_STATE in current_action:
        current_action[rig_bake.MARK] = True


def _has_other_animation(body: bpy.types.Object) -> bool:
    """Return whether constraints, drivers or NLA strips affect an armature's pose, or keys move more than its bones."""
    data = body.animation_data
    if data is not None and (channels.find_playing_action(body)[0] is not None or data.use_nla
                             and len(data.nla_tracks)):
        return not is_plain(body)
    drivers = data.drivers if data is not None else ()
    return any(driver.data_path.startswith("pose.") for driver in drivers) or any(
        not one.mute and one.influence > 0.0 for bone in body.pose.bones for one in bone.constraints
    )
