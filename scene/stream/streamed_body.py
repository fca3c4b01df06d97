"""The character that shows a stream: created with the first frame, posed by each later one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.motion import motion as motions
from ...beyond_mocap.motion import quaternion
from ..core import action
from ..core.measure import frames_per_second
from ..result import bake
from ..rigs import armature
from ..stage import body

if TYPE_CHECKING:
    from ...beyond_mocap.motion.skeleton import Skeleton

MARK = "beyond_mocap_stream"
SHIRTS = ((0.55, 0.55, 0.58), (0.16, 0.18, 0.22))  # of the first stream and every other one, of the second and so on


def can_show(thing: bpy.types.Object | None, scene: bpy.types.Scene, skeleton: Skeleton) -> bool:
    """Whether an object can show this skeleton: an armature of the scene and file with a bone for every joint."""
    return (
        thing is not None and thing.type == "ARMATURE" and thing.library is None and thing.name in scene.objects
        and all(name in thing.data.bones for name in skeleton.names)
    )


def create_body(context: bpy.types.Context, motion: motions.Motion, name: str = "Stream",
                number: int = 1) -> bpy.types.Object:
    """Create a character with the skeleton of `motion`; its shirt tells neighbouring numbers of streams apart."""
    where = bake.find_or_create_collection(context.scene)
    thing = armature.create_armature(context, motion.skeleton, name, where)
    body.create_character(thing, name, SHIRTS[(number - 1) % len(SHIRTS)], collection=where, scene=context.scene,
                          example=motion)
    thing[MARK] = True
    return thing


def pose_body(
    thing: bpy.types.Object, scene: bpy.types.Scene, skeleton: Skeleton, root: np.ndarray, local: np.ndarray
) -> None:
    """Pose an armature.

    Its location and its rotation about the vertical are left to the user, so that it can stand beside other characters.

    Args:
        thing: the armature.
        scene: the scene.
        skeleton: skeleton of the pose.
        root: (3,) m, root position.
        local: (J, 4) local rotations.
    """
    placement, rest = armature.find_current_placement(thing, scene), armature.compute_rest_rotations(thing,
            skeleton.names)
    # the object's rotation about the vertical turns the streamed motion with it
    turn = quaternion.from_up_angle(quaternion.to_yaw(placement.rotation))
    root, local = placement.origin + quaternion.rotate(turn, root), np.array(local)
    local[0] = quaternion.multiply(quaternion.inverse(placement.rotation), quaternion.multiply(turn, local[0]))
    # pose rotations are relative to the bones' rest rotations
    pose_rotations = quaternion.multiply(quaternion.inverse(rest), quaternion.multiply(local, rest))
    bones = thing.pose.bones
    all_rotations = np.empty((len(bones), 4), np.float32)
    bones.foreach_get("rotation_quaternion", all_rotations.ravel())
    all_rotations[[bones.find(name) for name in skeleton.names]] = pose_rotations
    bones.foreach_set("rotation_quaternion", all_rotations.ravel())
    top = bones[skeleton.names[0]]
    shift = placement.to_armature(root) - np.array(top.bone.head_local)
    top.location = quaternion.rotate(quaternion.inverse(rest[0]), shift)  # assigning also makes Blender update


def keep_recording(context: bpy.types.Context, motion: motions.Motion) -> bpy.types.Object:
    """Create a character that plays `motion` from the current frame on."""
    if motion.duration * frames_per_second(context.scene) < 1.0:
        raise InputError("stream", "less than a frame", "a second or more", "let the stream run for a while")
    thing = create_body(context, motion, "Recorded")
    action.write_motion(thing, motion, context.scene, float(context.scene.frame_current), f"{thing.name} motion")
    return thing
