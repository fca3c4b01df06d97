"""On what each control of a rig rides, found by turning the controls by chance, with the rig as it stands.

As in `rig_controls`, but with inverse kinematics and switches left as they are, and for as many bones as one likes in
any order: B is the frame that a control has while its own channels are at rest; where M_d^-1 B is the same in all
trials, it rides on bone d.
"""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass

import bpy
import numpy as np

from ...beyond_mocap.motion import quaternion
from ..rig_controls import Kept

_TRIALS, _TURN, _WAY = 4, 0.5, 0.05
_RIDES = 2e-4  # of a turn's matrix, and of the rig's size
STATIC = -1


@dataclass(frozen=True, eq=False)
class Rides:
    """Of n controls: turn_of, place_of (n,): the number of the bone among `carriers` on which turn and place ride,
    STATIC where nothing carries them; firm (n,): whether their channels move them at all and one bone carries them;
    parent_of (n,): the same as turn_of of the bone above."""

    controls: list[str]
    carriers: list[str]
    turn_of: np.ndarray
    place_of: np.ndarray
    parent_of: np.ndarray
    firm: np.ndarray


def study(rig: bpy.types.Object, side: bpy.types.Scene, controls: list[str], shown: list[str]) -> Rides:
    """On which of the controls and `shown` bones each of the controls rides, as the rig stands at the side scene's
    frame.

    The rig is as it was when this returns. side: the scene in which it is alone.
    """
    carriers = [*controls, *(bone for bone in shown if bone not in controls)]
    above = [_above(rig, name) for name in controls]
    watched = list(dict.fromkeys([*carriers, *(name for name in above if name)]))
    size = float(np.ptp([list(bone.head_local) for bone in rig.data.bones], axis=0).max()) or 1.0
    dice, own, went, poses = np.random.default_rng(5), [], [], []
    with _still(rig, side, controls) as pose:
        for _ in range(_TRIALS):
            vectors = dice.normal(size=(2, len(controls), 3))
            vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
            own.append(quaternion.from_rotation_vector(_TURN * vectors[0]))
            went.append(_WAY * size * vectors[1])
            poses.append(pose(own[-1], watched, went[-1]))
    poses, own = np.array(poses), quaternion.to_matrix(np.array(own))  # (K, W, 4, 4), (K, n, 3, 3)
    turn, place = poses[..., :3, :3], poses[..., :3, 3]
    turn = turn / np.maximum(np.linalg.norm(turn, axis=-2, keepdims=True), 1e-12)
    count, still = len(controls), np.broadcast_to(np.eye(3), turn[:, 0].shape)
    base = turn[:, :count] @ np.swapaxes(own, -1, -2)
    parents = np.stack([turn[:, watched.index(name)] if name else still for name in above], axis=1)
    rests = np.stack([_rests(rig, name, poses[:, watched.index(up)] if up else None)
                      for name, up in zip(controls, above)],
                     axis=1)
    for number, name in enumerate(controls):
        if len(rig.pose.bones[name].constraints):  # such as Child Of, which come before the bone's own channels
            rests[:, number] = place[:, number] - (base[:, number] @ np.array(went)[:, number, :, None])[..., 0]
            parents[:, number] = base[:, number]
    carried, origin = turn[:, : len(carriers)], place[:, : len(carriers)]
    turn_of, worst = _carrier(carried, base, count)
    parent_of, _ = _carrier(carried, parents, 0)
    place_of, off = _place_carrier(carried, origin, rests)
    return Rides(list(controls), carriers, turn_of, place_of, parent_of, (worst < 10 * _RIDES) & (off < _RIDES * size))


def _above(rig: bpy.types.Object, name: str) -> str:
    parent = rig.data.bones[name].parent
    return parent.name if parent is not None else ""


def _rests(rig: bpy.types.Object, name: str, parent: np.ndarray | None) -> np.ndarray:
    """Where a bone's head is while its location is zero (K, 3), from the pose (K, 4, 4) of the bone above it."""
    bone = rig.data.bones[name]
    if parent is None:
        return np.repeat(np.array(bone.head_local)[None], _TRIALS, axis=0)
    at = np.array(bone.parent.matrix_local.inverted() @ bone.head_local)
    return parent[:, :3, :3] @ at + parent[:, :3, 3]


def _carrier(carried: np.ndarray, frames: np.ndarray, own: int) -> tuple[np.ndarray, np.ndarray]:
    """For each of n frames (K, n, 3, 3) the bone of `carried` (K, C, 3, 3) in which it never turns, STATIC before all;
    and by how much it does. own: so many frames are of the first bones themselves, which do not carry themselves."""
    spread = np.empty((carried.shape[1] + 1, frames.shape[1]))
    spread[-1] = np.ptp(frames, axis=0).max(axis=(-1, -2))
    for number in range(carried.shape[1]):
        seen = np.swapaxes(carried[:, number], -1, -2)[:, None] @ frames
        spread[number] = np.ptp(seen, axis=0).max(axis=(-1, -2))
    return _least(spread, own)


def _place_carrier(carried: np.ndarray, origin: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same of places (K, n, 3)."""
    spread = np.empty((carried.shape[1] + 1, places.shape[1]))
    spread[-1] = np.ptp(places, axis=0).max(axis=-1)
    for number in range(carried.shape[1]):
        away = places - origin[:, number, None]
        seen = (np.swapaxes(carried[:, number], -1, -2)[:, None] @ away[..., None])[..., 0]
        spread[number] = np.ptp(seen, axis=0).max(axis=-1)
    return _least(spread, places.shape[1])


def _least(spread: np.ndarray, own: int) -> tuple[np.ndarray, np.ndarray]:
    itself = np.arange(own)
    spread[itself, itself] = np.inf
    spread[-1] *= 0.3  # what does not move at all rides on nothing
    best = np.argmin(spread, axis=0)
    least = spread[best, np.arange(spread.shape[1])]
    return np.where(best == len(spread) - 1, STATIC, best), least


def moves(rig: bpy.types.Object, side: bpy.types.Scene, controls: list[str], shown: list[str]) -> list[bool]:
    """Whether each of the controls moves anything of the bones shown, as the rig stands."""
    found = []
    with _still(rig, side, controls) as pose:
        none = quaternion.identity(len(controls))
        start = pose(none, shown)
        for number, name in enumerate(controls):
            turned = none.copy()
            turned[number] = quaternion.from_rotation_vector(np.array([0.3, 0.2, 0.1]))
            rig.pose.bones[name].location = (0.05, 0.07, 0.03)
            found.append(bool(np.abs(pose(turned, shown) - start).max() > 1e-5))
            rig.pose.bones[name].location = (0.0, 0.0, 0.0)
    return found


@contextmanager
def _still(rig: bpy.types.Object, side: bpy.types.Scene, controls: list[str]):
    """The rig without its animation but otherwise as it stands, limits off; gives a function (own rotations (n, 4),
    bones, locations (n, 3)) -> their poses (W, 4, 4). All is as it was afterwards."""
    limits = [
        c for name in controls for c in rig.pose.bones[name].constraints if c.type.startswith("LIMIT") and not c.mute
    ]
    kept = Kept(rig, controls, [])
    try:
        kept.silence()
        for limit in limits:
            limit.mute = True
        for name in controls:
            bone = rig.pose.bones[name]
            bone.location, bone.scale, bone.rotation_mode = (0, 0, 0), (1, 1, 1), "QUATERNION"

        def pose(own: np.ndarray, bones: list[str], went: np.ndarray | None = None) -> np.ndarray:
            for number, (name, turn) in enumerate(zip(controls, own)):
                rig.pose.bones[name].rotation_quaternion = turn
                if went is not None:
                    rig.pose.bones[name].location = went[number]
            rig.update_tag(refresh={"OBJECT", "DATA", "TIME"})
            layer = side.view_layers[0]
            layer.update()
            shown = rig.evaluated_get(layer.depsgraph)
            return np.array([shown.pose.bones[name].matrix for name in bones])

        yield pose
    finally:
        for limit in limits:
            limit.mute = False
        kept.bring_back()
