"""A rig posed temporarily, and the carrier of each of its controls, found by random rotations.

Between a control and the bones that carry it a rig may have helper bones, constraints and drivers. Instead of following
these, all controls are rotated randomly a few times, and for each one its carrier is searched: with B the frame of a
control while its own channels are at rest and M_d the pose of bone d, M_d^-1 B is the same in all trials for the bone
that carries it. Rotation and position may have different carriers.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from ...beyond_mocap.motion import quaternion

TRIALS = 4
CARRIER_TOLERANCE = 2e-4
"""Tolerance of a control's frame within its carrier: of a rotation matrix's entries, and as share of the rig's size."""

STATIC = -1
_TURN, _SHIFT = 0.5, 0.05  # random rotation in radians, random shift as a share of the rig's size
_STEADIER_SHARE = 0.3  # share of another carrier's spread below which a bone is the carrier instead

CHANNELS = ("location", "rotation_quaternion", "rotation_euler", "rotation_axis_angle", "scale")


class PosedRig:
    """Some controls of a rig, posed temporarily.

        with PosedRig(rig, layer, controls) as posed:
            matrices = posed.apply_pose(rotations, bones)

    Attributes:
        controls: the bones that are posed.
        layer: the view layer whose depsgraph poses the rig.
        silent: constraints that are muted meanwhile.
    """

    def __init__(
        self, rig: bpy.types.Object, layer: bpy.types.ViewLayer, controls: Sequence[str],
        silent: Iterable[bpy.types.Constraint] = (),
    ):  # fmt: skip
        self.rig, self.layer, self.controls = rig, layer, list(controls)
        self._muted = [(constraint, constraint.mute) for constraint in silent]

    def apply_pose(self, rotations: np.ndarray, bones: Sequence[str], places: np.ndarray | None = None) -> np.ndarray:
        """Pose the controls, and read bones as Blender then poses them.

        Args:
            rotations: (n, 4) the controls' own rotations.
            bones: W names to read.
            places: (n, 3) the controls' locations; None for rest.
        Returns:
            (W, 4, 4) the bones' poses in the armature's space.
        """
        for number, (name, turn) in enumerate(zip(self.controls, rotations)):
            bone = self.rig.pose.bones[name]
            bone.rotation_quaternion = turn
            bone.location = (0.0, 0.0, 0.0) if places is None else places[number]
        _update_rig(self.rig, self.layer)
        evaluated = self.rig.evaluated_get(self.layer.depsgraph)
        return np.array([evaluated.pose.bones[name].matrix for name in bones])

    def __enter__(self) -> PosedRig:
        self._save_state()
        try:
            self._mute()
        except BaseException:
            self._restore_state()
            raise
        return self

    def __exit__(self, *_) -> None:
        self._restore_state()

    def _save_state(self) -> None:
        data, bones = self.rig.animation_data, self.rig.pose.bones
        self._playing = (data.use_nla, data.action, data.action_slot) if data else None
        self._position = self.rig.data.pose_position
        self._modes = {name: bones[name].rotation_mode for name in self.controls}
        self._values = {(name, channel): tuple(getattr(bones[name], channel)) for name in self.controls
                        for channel in CHANNELS}

    def _mute(self) -> None:
        if self._playing is not None:
            self.rig.animation_data.action = None
            self.rig.animation_data.use_nla = False
        if self._position != "POSE":
            self.rig.data.pose_position = "POSE"
        for constraint, _ in self._muted:
            constraint.mute = True
        for name in self.controls:
            bone = self.rig.pose.bones[name]
            bone.location, bone.scale, bone.rotation_mode = (0, 0, 0), (1, 1, 1), "QUATERNION"

    def _restore_state(self) -> None:
        for constraint, mute in self._muted:
            constraint.mute = mute
        for name, mode in self._modes.items():
            self.rig.pose.bones[name].rotation_mode = mode
        for (name, channel), value in self._values.items():
            setattr(self.rig.pose.bones[name], channel, value)
        if self._position != self.rig.data.pose_position:
            self.rig.data.pose_position = self._position
        if self._playing is not None:
            data = self.rig.animation_data
            data.use_nla, data.action, slot = self._playing
            if data.action is not None and slot is not None:
                data.action_slot = slot
        _update_rig(self.rig, bpy.context.view_layer)


def _update_rig(rig: bpy.types.Object, layer: bpy.types.ViewLayer) -> None:
    rig.update_tag(refresh={"OBJECT", "DATA", "TIME"})
    layer.update()


@dataclass(frozen=True, eq=False)
class Carriers:
    """The carriers of n controls.

    Attributes:
        controls: their names.
        carriers: names of possible carriers.
        rotation_carrier, position_carrier: (n,) index into `carriers` of the bone that carries rotation and position,
            STATIC for none.
        parent_carrier: (n,) the rotation's carrier of the bone above.
        is_reliable: (n,) bool, the control's channels move it and one bone carries it.
    """

    controls: list[str]
    carriers: list[str]
    rotation_carrier: np.ndarray
    position_carrier: np.ndarray
    parent_carrier: np.ndarray
    is_reliable: np.ndarray


def split_poses(poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Split poses (..., 4, 4) into rotations (..., 3, 3) without scale and positions (..., 3)."""
    turn = poses[..., :3, :3]
    return turn / np.maximum(np.linalg.norm(turn, axis=-2, keepdims=True), 1e-12), poses[..., :3, 3]


def compute_rotation_spread(carried: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Compute how much n frames rotate within each of C bones, and within nothing.

    Args:
        carried: (K, C, 3, 3) the bones' rotations in K trials.
        frames: (K, n, 3, 3).
    Returns:
        (C + 1, n), the last row for nothing.
    """
    spread = np.empty((carried.shape[1] + 1, frames.shape[1]))
    spread[-1] = np.ptp(frames, axis=0).max(axis=(-1, -2))
    for number in range(carried.shape[1]):
        seen = np.swapaxes(carried[:, number], -1, -2)[:, None] @ frames
        spread[number] = np.ptp(seen, axis=0).max(axis=(-1, -2))
    return spread


def compute_position_spread(carried: np.ndarray, origin: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Compute how much n positions move within each of C bones, and within nothing: (C + 1, n).

    Args:
        carried: (K, C, 3, 3) the bones' rotations.
        origin: (K, C, 3) the bones' positions.
        places: (K, n, 3).
    Returns:
        (C + 1, n), the last row for nothing.
    """
    spread = np.empty((carried.shape[1] + 1, places.shape[1]))
    spread[-1] = np.ptp(places, axis=0).max(axis=-1)
    for number in range(carried.shape[1]):
        away = places - origin[:, number, None]
        seen = (np.swapaxes(carried[:, number], -1, -2)[:, None] @ away[..., None])[..., 0]
        spread[number] = np.ptp(seen, axis=0).max(axis=-1)
    return spread


def find_nearest_carrier(spread: np.ndarray, number: int) -> tuple[int, float]:
    """Find the carrier of a bone among those before it: the last of them, unless another is clearly steadier.

    Args:
        spread: (C + 1,) of that bone, as from `compute_rotation_spread`.
        number: of the bone.
    Returns:
        The carrier and its spread.
    """
    best, least = STATIC, np.inf
    for d in [*range(number - 1, -1, -1), STATIC]:
        if spread[d] < _STEADIER_SHARE * least:
            best, least = d, float(spread[d])
    return best, least


def find_steadiest_carriers(spread: np.ndarray, own: int) -> tuple[np.ndarray, np.ndarray]:
    """Find the steadiest carrier of each of n frames, preferring STATIC, and its spread.

    Args:
        spread: (C + 1, n) as from `compute_rotation_spread`.
        own: number of frames that belong to the first bones themselves, which cannot carry themselves.
    Returns:
        (n,) carriers and (n,) spreads.
    """
    spread, itself = spread.copy(), np.arange(own)
    spread[itself, itself] = np.inf
    spread[-1] *= _STEADIER_SHARE  # a frame that does not move has no carrier
    best = np.argmin(spread, axis=0)
    least = spread[best, np.arange(spread.shape[1])]
    return np.where(best == len(spread) - 1, STATIC, best), least


def find_carriers(rig: bpy.types.Object, side: bpy.types.Scene, controls: list[str], shown: list[str]) -> Carriers:
    """Find the carrier of each control among the controls and `shown` bones, at the side scene's frame.

    Inverse kinematics and switches stay as they are, and the rig is restored at the end. side: the scene in which it is
    alone.
    """
    carriers = [*controls, *(bone for bone in shown if bone not in controls)]
    above = [_find_parent(rig, name) for name in controls]
    bones = list(dict.fromkeys([*carriers, *(name for name in above if name)]))
    size = float(np.ptp([list(bone.head_local) for bone in rig.data.bones], axis=0).max()) or 1.0
    poses, own, shifts = _run_trials(rig, side, controls, bones, size)
    turn, place = split_poses(poses)
    base = turn[:, : len(controls)] @ np.swapaxes(own, -1, -2)
    still = np.broadcast_to(np.eye(3), turn[:, 0].shape)
    parents = np.stack([turn[:, bones.index(name)] if name else still for name in above], axis=1)
    ups = [poses[:, bones.index(name)] if name else None for name in above]
    rests = np.stack([_compute_rest_heads(rig, name, up) for name, up in zip(controls, ups)], axis=1)
    for number, name in enumerate(controls):
        if len(rig.pose.bones[name].constraints):  # such as Child Of, which act before the bone's own channels
            rests[:, number] = place[:, number] - (base[:, number] @ shifts[:, number, :, None])[..., 0]
            parents[:, number] = base[:, number]
    carried, origin = turn[:, : len(carriers)], place[:, : len(carriers)]
    turn_of, worst = find_steadiest_carriers(compute_rotation_spread(carried, base), len(controls))
    parent_of, _ = find_steadiest_carriers(compute_rotation_spread(carried, parents), 0)
    place_of, off = find_steadiest_carriers(compute_position_spread(carried, origin, rests), len(controls))
    return Carriers(list(controls), carriers, turn_of, position_carrier=place_of, parent_carrier=parent_of,
                    is_reliable=(worst < 10 * CARRIER_TOLERANCE) & (off < CARRIER_TOLERANCE * size))


def list_moving(rig: bpy.types.Object, side: bpy.types.Scene, controls: list[str], shown: list[str]) -> list[bool]:
    """List for each control whether it moves any of the bones shown, in the rig's current state."""
    found, none = [], quaternion.identity(len(controls))
    with _pose_rig(rig, side, controls) as posed:
        start = posed.apply_pose(none, shown)
        for number in range(len(controls)):
            rotations, shifts = none.copy(), np.zeros((len(controls), 3))
            rotations[number] = quaternion.from_rotation_vector(np.array([0.3, 0.2, 0.1]))
            shifts[number] = (0.05, 0.07, 0.03)
            found.append(bool(np.abs(posed.apply_pose(rotations, shown, shifts) - start).max() > 1e-5))
    return found


def _pose_rig(rig: bpy.types.Object, side: bpy.types.Scene, controls: list[str]) -> PosedRig:
    """Create the context of the rig without its animation and limits, otherwise unchanged."""
    limits = [c for name in controls for c in rig.pose.bones[name].constraints if c.type.startswith("LIMIT")
              and not c.mute]
    return PosedRig(rig, side.view_layers[0], controls, limits)


def _run_trials(rig, side, controls: list[str], watched: list[str], size: float) -> tuple[np.ndarray, ...]:
    """Run random trials: poses (K, W, 4, 4) of the bones watched, the controls' rotations (K, n, 3, 3) and locations
    (K, n, 3).
    """
    random, own, shifts, poses = np.random.default_rng(5), [], [], []
    with _pose_rig(rig, side, controls) as posed:
        for _ in range(TRIALS):
            vectors = random.normal(size=(2, len(controls), 3))
            vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
            own.append(quaternion.from_rotation_vector(_TURN * vectors[0]))
            shifts.append(_SHIFT * size * vectors[1])
            poses.append(posed.apply_pose(own[-1], watched, shifts[-1]))
    return np.array(poses), quaternion.to_matrix(np.array(own)), np.array(shifts)


def _find_parent(rig: bpy.types.Object, name: str) -> str:
    parent = rig.data.bones[name].parent
    return parent.name if parent is not None else ""


def _compute_rest_heads(rig: bpy.types.Object, name: str, parent: np.ndarray | None) -> np.ndarray:
    """Compute a bone's head while its location is zero (K, 3), from the pose (K, 4, 4) of the bone above it."""
    bone = rig.data.bones[name]
    if parent is None:
        return np.repeat(np.array(bone.head_local)[None], TRIALS, axis=0)
    at = np.array(bone.parent.matrix_local.inverted() @ bone.head_local)
    return parent[:, :3, :3] @ at + parent[:, :3, 3]
