"""What is aimed at: a place, or the way of one that moves, on which the ball meets it."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix

from ...beyond_mocap.base.errors import InputError
from ..core.measure import frames_per_second, units_per_metre
from ..path_editing.rig_look import alone
from .settings import BeyondMocapThrow

LONGEST = 8.0
"""Seconds from the release on in which a target's own way counts."""
_STILL = 1e-3  # m that a target moves by at most which stands


def places(scene: bpy.types.Scene, wish: BeyondMocapThrow, frame: int) -> np.ndarray:
    """(F, 3) m: where the target is on each frame from `frame` on; (1, 3) for one that stands. InputError below the
    ground or in another scene."""
    target, metres = wish.target, 1.0 / units_per_metre(scene)
    if target is None:
        found = np.array([scene.cursor.location]) * metres
    elif target.name not in scene.objects:
        raise InputError("target", f"{target.name} is not in this scene", "an object of this scene", "pick another")
    elif _may_move(target):
        found = _way(scene, target, frame) * metres
        if np.ptp(found, axis=0).max() < _STILL:
            found = found[:1]
    else:
        found = np.array([_stands(target).translation]) * metres
    below = found[:, 2].min()
    if below < 0.0:
        raise InputError(
            "target", f"{-below:.2f} m below the ground", "one on or above it, where balls get", "raise it"
        )
    return found


def told_by(scene: bpy.types.Scene, wish: BeyondMocapThrow) -> list | str:
    """Where the target is, units, or the name of one that may move by itself."""
    target = wish.target
    if target is not None and _may_move(target):
        return target.name
    place = scene.cursor.location if target is None else _stands(target).translation
    return [round(value, 5) for value in place]


def _may_move(thing: bpy.types.Object) -> bool:
    """Whether keys, drivers or constraints have a say in where an object is, or in where its parents are."""
    while thing is not None:
        if thing.animation_data is not None or len(thing.constraints) or thing.type == "ARMATURE" or thing.rigid_body:
            return True
        thing = thing.parent
    return False


def _stands(thing: bpy.types.Object) -> Matrix:
    """Where an object is that nothing moves. Worked out, since Blender forgets the matrix_world of what is hidden with
    the next undo or load."""
    parent = thing.parent
    if parent is None:
        return thing.matrix_basis
    if thing.parent_type != "OBJECT" or parent.type == "CURVE":
        return thing.matrix_world
    return _stands(parent) @ thing.matrix_parent_inverse @ thing.matrix_basis


def _way(scene: bpy.types.Scene, target: bpy.types.Object, frame: int) -> np.ndarray:
    """(F, 3) units: where a target is from a frame on."""
    found = []
    with alone(target, scene) as side:
        for at in range(frame, frame + int(LONGEST * frames_per_second(scene)) + 1):
            side.frame_set(at)
            found.append(target.evaluated_get(side.view_layers[0].depsgraph).matrix_world.translation[:])
    return np.array(found)
