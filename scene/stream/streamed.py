"""The armature that does what the user does: posed anew with every frame that arrives, without a key."""

from __future__ import annotations

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.motion import quaternion
from ...beyond_mocap.motion.motion import Motion
from ...beyond_mocap.motion.skeleton import Skeleton
from ..core import action
from ..core.measure import frames_per_second
from ..result import bake
from ..rigs import armature
from ..stage import body

MARK = "beyond_mocap_stream"
SHIRT = (0.55, 0.55, 0.58)


def fits(thing: bpy.types.Object | None, scene: bpy.types.Scene, skeleton: Skeleton) -> bool:
    """Whether an object can show this skeleton: an armature of the scene, of this file, with a bone for every joint."""
    return (
        thing is not None and thing.type == "ARMATURE" and thing.library is None and thing.name in scene.objects
        and all(name in thing.data.bones for name in skeleton.names)
    )


def create(context: bpy.types.Context, motion: Motion, name: str = "Stream") -> bpy.types.Object:
    """A dressed armature for the body that `motion` shows."""
    where = bake.collection(context.scene)
    thing = armature.create(context, motion.skeleton, name, where)
    body.create(thing, name, SHIRT, where, context.scene, motion)
    thing[MARK] = True
    return thing


def pose(
    thing: bpy.types.Object, scene: bpy.types.Scene, skeleton: Skeleton, root: np.ndarray, local: np.ndarray
) -> None:
    """Put an armature into a pose: root (3,) m and local rotations (J, 4). Where the object lies and which way it is
    turned about the vertical is left to the user, so that the streamed body can stand beside others."""
    lie, rest = armature.placement_now(thing, scene), armature.rest_rotations(thing, skeleton.names)
    turn = quaternion.about_up(quaternion.yaw(lie.rotation))
    root, local = lie.origin + quaternion.rotate(turn, root), np.array(local)
    local[0] = quaternion.multiply(quaternion.inverse(lie.rotation), quaternion.multiply(turn, local[0]))
    turned = quaternion.multiply(quaternion.inverse(rest), quaternion.multiply(local, rest))
    bones = thing.pose.bones
    every = np.empty((len(bones), 4), np.float32)
    bones.foreach_get("rotation_quaternion", every.ravel())
    every[[bones.find(name) for name in skeleton.names]] = turned
    bones.foreach_set("rotation_quaternion", every.ravel())
    top = bones[skeleton.names[0]]
    shift = lie.to_armature(root) - np.array(top.bone.head_local)
    top.location = quaternion.rotate(quaternion.inverse(rest[0]), shift)  # also tells Blender that the pose is another


def keep(context: bpy.types.Context, motion: Motion, name: str = "Recorded") -> bpy.types.Object:
    """A body of its own that plays `motion` from the present frame on."""
    if motion.duration * frames_per_second(context.scene) < 1.0:
        raise InputError("stream", "less than a frame", "a second or more of it", "let the stream run for a while")
    thing = create(context, motion, name)
    action.write(thing, motion, context.scene, float(context.scene.frame_current), f"{thing.name} motion")
    return thing
