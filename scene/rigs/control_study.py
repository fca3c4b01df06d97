"""A rig posed by hand for a while, and on what each of its controls rides, found by turning the controls by chance.

Between a control and the bones that carry it a rig may put anything: helper bones, constraints, drivers. Instead of
following these, all controls are turned by chance a few times, and for each one the bone is sought on which it rides:
with B the frame that a control has while its own channels are at rest and M_d the pose of bone d, M_d^-1 B is the same
in all trials for the one that carries it. Turn and place may ride on different bones.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from ...beyond_mocap.motion import quaternion

TRIALS = 4
RIDES = 2e-4
"""By how much the frame that a control rides on may turn and go within its carrier: of a turn's matrix, and of the
rig's size."""

STATIC = -1
_TURN, _WAY = 0.5, 0.05  # radians, and of the rig's size
_SURELY = 0.3  # of another carrier's spread: a bone that is this much steadier carries instead

CHANNELS = ("location", "rotation_quaternion", "rotation_euler", "rotation_axis_angle", "scale")


class PosedRig:
    """Some controls of a rig, posed by hand.

        with PosedRig(rig, layer, controls) as posed:
            matrices = posed.pose(turns, bones)

    controls: the bones that are posed. layer: the view layer whose depsgraph poses the rig. silent: constraints that
    are muted meanwhile."""

    def __init__(
        self, rig: bpy.types.Object, layer: bpy.types.ViewLayer, controls: Sequence[str],
        silent: Iterable[bpy.types.Constraint] = (),
    ):  # fmt: skip
        self.rig, self.layer, self.controls = rig, layer, list(controls)
        self._muted = [(constraint, constraint.mute) for constraint in silent]

    def pose(self, turns: np.ndarray, bones: Sequence[str], places: np.ndarray | None = None) -> np.ndarray:
        """Pose the controls, and read bones as Blender then poses them.

        turns: (n, 4), the controls' own rotations. places: (n, 3), their locations, at rest where None.
        Returns (W, 4, 4), the bones' poses in the armature's space."""
        for number, (name, turn) in enumerate(zip(self.controls, turns)):
            bone = self.rig.pose.bones[name]
            bone.rotation_quaternion = turn
            bone.location = (0.0, 0.0, 0.0) if places is None else places[number]
        _update(self.rig, self.layer)
        shown = self.rig.evaluated_get(self.layer.depsgraph)
        return np.array([shown.pose.bones[name].matrix for name in bones])

    def __enter__(self) -> PosedRig:
        self._remember()
        try:
            self._silence()
        except BaseException:
            self._restore()
            raise
        return self

    def __exit__(self, *_) -> None:
        self._restore()

    def _remember(self) -> None:
        data, bones = self.rig.animation_data, self.rig.pose.bones
        self._playing = (data.use_nla, data.action, data.action_slot) if data else None
        self._position = self.rig.data.pose_position
        self._modes = {name: bones[name].rotation_mode for name in self.controls}
        self._values = {(name, channel): tuple(getattr(bones[name], channel)) for name in self.controls
                        for channel in CHANNELS}

    def _silence(self) -> None:
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

    def _restore(self) -> None:
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
        _update(self.rig, bpy.context.view_layer)


def _update(rig: bpy.types.Object, layer: bpy.types.ViewLayer) -> None:
    rig.update_tag(refresh={"OBJECT", "DATA", "TIME"})
    layer.update()


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


def split_poses(poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Turns (..., 3, 3) without scale, and places (..., 3), of poses (..., 4, 4)."""
    turn = poses[..., :3, :3]
    return turn / np.maximum(np.linalg.norm(turn, axis=-2, keepdims=True), 1e-12), poses[..., :3, 3]


def turn_spread(carried: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """By how much n frames turn within each of C bones, and within nothing.

    carried: (K, C, 3, 3), the bones' turns in K trials. frames: (K, n, 3, 3).
    Returns (C + 1, n), the last row for nothing."""
    spread = np.empty((carried.shape[1] + 1, frames.shape[1]))
    spread[-1] = np.ptp(frames, axis=0).max(axis=(-1, -2))
    for number in range(carried.shape[1]):
        seen = np.swapaxes(carried[:, number], -1, -2)[:, None] @ frames
        spread[number] = np.ptp(seen, axis=0).max(axis=(-1, -2))
    return spread


def place_spread(carried: np.ndarray, origin: np.ndarray, places: np.ndarray) -> np.ndarray:
    """By how much n places go within each of C bones, and within nothing: (C + 1, n), as `turn_spread`.

    carried: (K, C, 3, 3) and origin: (K, C, 3), the bones' turns and places. places: (K, n, 3)."""
    spread = np.empty((carried.shape[1] + 1, places.shape[1]))
    spread[-1] = np.ptp(places, axis=0).max(axis=-1)
    for number in range(carried.shape[1]):
        away = places - origin[:, number, None]
        seen = (np.swapaxes(carried[:, number], -1, -2)[:, None] @ away[..., None])[..., 0]
        spread[number] = np.ptp(seen, axis=0).max(axis=-1)
    return spread


def nearest_carrier(spread: np.ndarray, number: int) -> tuple[int, float]:
    """The carrier of a bone among those before it, and its spread: the last of them, unless another is surely steadier.

    spread: (C + 1,), of the bone with that `number`, as `turn_spread` has it."""
    best, least = STATIC, np.inf
    for d in [*range(number - 1, -1, -1), STATIC]:
        if spread[d] < _SURELY * least:
            best, least = d, float(spread[d])
    return best, least


def steadiest_carrier(spread: np.ndarray, own: int) -> tuple[np.ndarray, np.ndarray]:
    """For each of n frames the steadiest bone, STATIC before all, and its spread; spread: as `turn_spread` has it.

    own: so many frames are of the first bones themselves, which do not carry themselves."""
    spread, itself = spread.copy(), np.arange(own)
    spread[itself, itself] = np.inf
    spread[-1] *= _SURELY  # what does not move at all rides on nothing
    best = np.argmin(spread, axis=0)
    least = spread[best, np.arange(spread.shape[1])]
    return np.where(best == len(spread) - 1, STATIC, best), least


def study_rides(rig: bpy.types.Object, side: bpy.types.Scene, controls: list[str], shown: list[str]) -> Rides:
    """On which of the controls and `shown` bones each of the controls rides, as the rig stands at the side scene's
    frame, with its inverse kinematics and switches as they are.

    The rig is as it was when this returns. side: the scene in which it is alone."""
    carriers = [*controls, *(bone for bone in shown if bone not in controls)]
    above = [_above(rig, name) for name in controls]
    watched = list(dict.fromkeys([*carriers, *(name for name in above if name)]))
    size = float(np.ptp([list(bone.head_local) for bone in rig.data.bones], axis=0).max()) or 1.0
    poses, own, went = _trials(rig, side, controls, watched, size)
    turn, place = split_poses(poses)
    base = turn[:, : len(controls)] @ np.swapaxes(own, -1, -2)
    still = np.broadcast_to(np.eye(3), turn[:, 0].shape)
    parents = np.stack([turn[:, watched.index(name)] if name else still for name in above], axis=1)
    ups = [poses[:, watched.index(name)] if name else None for name in above]
    rests = np.stack([_rests(rig, name, up) for name, up in zip(controls, ups)], axis=1)
    for number, name in enumerate(controls):
        if len(rig.pose.bones[name].constraints):  # such as Child Of, which come before the bone's own channels
            rests[:, number] = place[:, number] - (base[:, number] @ went[:, number, :, None])[..., 0]
            parents[:, number] = base[:, number]
    carried, origin = turn[:, : len(carriers)], place[:, : len(carriers)]
    turn_of, worst = steadiest_carrier(turn_spread(carried, base), len(controls))
    parent_of, _ = steadiest_carrier(turn_spread(carried, parents), 0)
    place_of, off = steadiest_carrier(place_spread(carried, origin, rests), len(controls))
    return Rides(list(controls), carriers, turn_of, place_of=place_of, parent_of=parent_of,
                 firm=(worst < 10 * RIDES) & (off < RIDES * size))


def list_moving(rig: bpy.types.Object, side: bpy.types.Scene, controls: list[str], shown: list[str]) -> list[bool]:
    """Whether each of the controls moves anything of the bones shown, as the rig stands."""
    found, none = [], quaternion.identity(len(controls))
    with _posed(rig, side, controls) as posed:
        start = posed.pose(none, shown)
        for number in range(len(controls)):
            turned, went = none.copy(), np.zeros((len(controls), 3))
            turned[number] = quaternion.from_rotation_vector(np.array([0.3, 0.2, 0.1]))
            went[number] = (0.05, 0.07, 0.03)
            found.append(bool(np.abs(posed.pose(turned, shown, went) - start).max() > 1e-5))
    return found


def _posed(rig: bpy.types.Object, side: bpy.types.Scene, controls: list[str]) -> PosedRig:
    """The rig without its animation but otherwise as it stands, limits off."""
    limits = [c for name in controls for c in rig.pose.bones[name].constraints if c.type.startswith("LIMIT")
              and not c.mute]
    return PosedRig(rig, side.view_layers[0], controls, limits)


def _trials(rig, side, controls: list[str], watched: list[str], size: float) -> tuple[np.ndarray, ...]:
    """Poses (K, W, 4, 4) of the bones watched, the controls' own turns (K, n, 3, 3) and locations (K, n, 3)."""
    dice, own, went, poses = np.random.default_rng(5), [], [], []
    with _posed(rig, side, controls) as posed:
        for _ in range(TRIALS):
            vectors = dice.normal(size=(2, len(controls), 3))
            vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
            own.append(quaternion.from_rotation_vector(_TURN * vectors[0]))
            went.append(_WAY * size * vectors[1])
            poses.append(posed.pose(own[-1], watched, went[-1]))
    return np.array(poses), quaternion.to_matrix(np.array(own)), np.array(went)


def _above(rig: bpy.types.Object, name: str) -> str:
    parent = rig.data.bones[name].parent
    return parent.name if parent is not None else ""


def _rests(rig: bpy.types.Object, name: str, parent: np.ndarray | None) -> np.ndarray:
    """Where a bone's head is while its location is zero (K, 3), from the pose (K, 4, 4) of the bone above it."""
    bone = rig.data.bones[name]
    if parent is None:
        return np.repeat(np.array(bone.head_local)[None], TRIALS, axis=0)
    at = np.array(bone.parent.matrix_local.inverted() @ bone.head_local)
    return parent[:, :3, :3] @ at + parent[:, :3, 3]
