"""A character's armature, analysed once for all bodies that are copies of it: which bone moves which part, its skin,
and its twist bones; and a motion on it, as curves of its bones.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import bpy
import numpy as np

from ...beyond_mocap.motion import quaternion
from ...beyond_mocap.motion.motion import Motion
from ..rigs import bone_maps
from ..rigs.bone_curves import build_bone_curves, compute_bone_poses
from ..rigs.driven import DrivenRig
from ..rigs.fit import SourceMotion, add_head_tip
from .ball_touches import BallTouch, build_part_touches
from .skin import read_skin, select_soles

_TWIST = re.compile(r"(?i)twist|roll")
_GIVING_BACK = ("upper_arm", "upper_leg")
_ENDS = {"lower_arm": "hand", "lower_leg": "foot", "upper_arm": "lower_arm", "upper_leg": "lower_leg"}


@dataclass(frozen=True, eq=False)
class TwistBone:
    """A bone that shares a limb's roll.

    Attributes:
        bone: its name.
        joint: of the rig's skeleton, whose roll it shares.
        axis: (3,) along the limb, upright axes.
        share: of the roll; negative where it gives roll back.
        rest: (4,) its rotation at rest, upright axes.
    """

    bone: str
    joint: int
    axis: np.ndarray
    share: float
    rest: np.ndarray


class CharacterRig:
    """A character's rig, skin and twist bones."""

    def __init__(self, body: bpy.types.Object, meshes: list[bpy.types.Object], scene: bpy.types.Scene):
        """Analyse a copy of the character that plays nothing, and set it to follow its keys.

        Args:
            body: the armature.
            meshes: on it.
            scene: of both.
        Raises:
            InputError: if it is no humanoid with legs, or cannot be posed.
        """
        table = bone_maps.load_stored_map(body) or bone_maps.find_bone_map(body)
        self.driven = DrivenRig(body, table, scene)
        self.set_switches(body)  # a constraint may hold the body elsewhere than its bones rest
        bpy.context.view_layer.update()
        self.skin = read_skin(self.driven, meshes)
        self.twist_bones = list_twist_bones(self.driven)

    def build_keys(self, source: SourceMotion, touches: tuple[BallTouch, ...] = ()):
        """Build the curves of a motion on the character.

        Args:
            source: F frames at the scene's rate.
            touches: of the ball.
        Returns:
            Frames (F,), curves as for `channels.create_action`, and the motion on the rig's skeleton.
        """
        motion = self.fit_motion(source, touches)
        frames = source.start + np.arange(len(motion))
        turns, places, _ = compute_bone_poses(self.driven, motion, frames, "KEEP")
        basis, _ = self.driven.controls.compute_channels(turns, places)
        basis |= {one.bone: (self._compute_twist_channel(one, motion), None) for one in self.twist_bones}
        return frames, build_bone_curves(self.driven.rig, basis), motion

    def set_switches(self, body: bpy.types.Object) -> None:
        """Set a copy to follow its keys: IK switches to FK, and constraints off that would override driven bones."""
        for switch in self.driven.controls.switches:
            body.pose.bones[switch.bone][switch.name] = switch.value
        for one in self.driven.overrides:
            body.pose.bones[one.bone].constraints[one.constraint].influence = 0.0

    def fit_motion(self, source: SourceMotion, touches: tuple[BallTouch, ...] = ()) -> Motion:
        """Fit a motion to the character: directions kept, feet on the source's spots, striking parts at the ball."""
        from ...beyond_mocap.motion import contacts  # imports scipy, which is slow
        from ...beyond_mocap.motion.retargeting.match_contacts import match_contacts, read_source_feet
        from ...beyond_mocap.motion.retargeting.retarget import Retargeter

        on_ground = contacts.detect_heel_toe_contacts(source.motion)
        if source.foot_contacts is not None:
            on_ground = on_ground | source.foot_contacts[:, :, None]
        skeleton = add_head_tip(self.driven.skeleton, source.motion.skeleton)
        retargeter = Retargeter(source.motion, skeleton, standing=on_ground.all(axis=2), keeps_travel=True)
        theirs, ours = retargeter.source, retargeter.target
        feet = read_source_feet(source.motion, theirs.body, _build_usual_soles(theirs), on_ground)
        soles = [self._select_soles(side, usual) for side, usual in zip(("left", "right"), _build_usual_soles(ours))]
        fitted = match_contacts(retargeter.retarget(source.motion), ours.body, soles, feet,
                                build_part_touches(touches, self.driven.parts, self.skin))
        return fitted.motion

    def _select_soles(self, side: str, usual: dict[int, np.ndarray]) -> dict[int, np.ndarray]:
        """Select a side's sole from the skin, else one of usual proportions."""
        return select_soles(self.skin, self.driven, side) or usual

    def _compute_twist_channel(self, twist: TwistBone, motion: Motion) -> np.ndarray:
        """Compute the rotation channel (F, 4) of a twist bone."""
        from ...beyond_mocap.motion.retargeting.twist_bones import compute_twist

        turn = compute_twist(motion.rotations[:, twist.joint], twist.axis, twist.share)
        return quaternion.unify_signs(quaternion.multiply(quaternion.inverse(twist.rest),
                                                          quaternion.multiply(turn, twist.rest)))


def _build_usual_soles(anatomy) -> list[dict[int, np.ndarray]]:
    """Build both soles of usual proportions."""
    from ...beyond_mocap.motion.retargeting.body_points import build_sole_points

    return [build_sole_points(anatomy, side) for side in (anatomy.body.left, anatomy.body.right)]


def list_twist_bones(driven: DrivenRig) -> list[TwistBone]:
    """List the twist bones of a rig that nothing else moves: side branches of a limb, without constraints."""
    found = []
    for part in driven.parts:
        kind = part.rpartition(" ")[2]
        end = f"{part.rpartition(' ')[0]} {_ENDS.get(kind)}"
        if kind not in _ENDS or end not in driven.parts:
            continue
        for bone in driven.rig.data.bones[driven.find_bone(part)].children:
            if _is_twist_bone(driven, bone):
                found.append(_build_twist_bone(driven, bone, part, end))
    return found


def _is_twist_bone(driven: DrivenRig, bone: bpy.types.Bone) -> bool:
    """Whether a bone is a twist bone that carries no part and follows no constraint."""
    driven_bones = set(driven.table.values())
    is_carrier = any(one.name in driven_bones for one in (bone, *bone.children_recursive))
    is_free = not len(driven.rig.pose.bones[bone.name].constraints)
    return bool(_TWIST.search(bone.name)) and is_free and not is_carrier


def _build_twist_bone(driven: DrivenRig, bone: bpy.types.Bone, part: str, end: str) -> TwistBone:
    """Build a twist bone of a limb's part; its share is its place along the limb."""
    first, last = driven.to_metres(driven.rest_heads(part, end))
    along = last - first
    place = driven.to_metres(np.array(bone.head_local)) - first
    share = float(np.clip(place @ along / max(along @ along, 1e-12), 0.0, 1.0))
    is_giving_back = part.rpartition(" ")[2] in _GIVING_BACK
    rest = quaternion.multiply(driven.upright, quaternion.from_matrix(np.array(bone.matrix_local.to_3x3())))
    return TwistBone(bone.name, driven.parts.index(part if is_giving_back else end), along,
                     share - 1.0 if is_giving_back else share, rest)
