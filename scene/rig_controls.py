"""What a rig's controls do, found out by moving them: then a pose asked for in the world becomes values of channels.

Between a control and the bones that carry it a rig may put anything: helper bones, constraints, drivers. Instead of
following these, all driven bones are turned by chance a few times, and for each one the driven bone is sought on which
it rides: with B the frame that a bone has while its own channels are at rest and M_d the pose of bone d, M_d^-1 B is
the same in all trials for the one that carries it. Turning, place and the axes of the location channels may ride on
different bones. From there on a pose of all frames is plain arithmetic, without asking Blender for each frame.
"""

from __future__ import annotations

import re
from contextlib import contextmanager
from dataclasses import dataclass, field

import bpy
import numpy as np

from ..beyond_mocap.errors import InputError
from ..beyond_mocap.motion import quaternion

_TRIALS, _TURN = 4, 0.7
_RIDES = 2e-4  # of a turn's matrix, and of the rig's size
_TO_FK, _FROM_FK = re.compile(r"(?i)ik.*fk"), re.compile(r"(?i)fk.*ik")
_FOLLOW = re.compile(r"(?i)follow")
_STATIC = -1
CHANNELS = ("location", "rotation_quaternion", "rotation_euler", "rotation_axis_angle", "scale")


@dataclass(frozen=True)
class Switch:
    """A number on a pose bone that has to stand at `value` for the controls to count."""

    bone: str
    name: str
    value: float
    before: float


@dataclass(frozen=True)
class Override:
    """A constraint that would hold a driven bone against its channels."""

    bone: str
    constraint: str
    kind: str


@dataclass
class _Ride:
    """What one control rides on: the carrier's index (-1: the armature itself) and the constant part, seen in it."""

    turn_of: int = _STATIC
    turn: np.ndarray = field(default_factory=lambda: np.eye(3))
    place_of: int = _STATIC
    place: np.ndarray = field(default_factory=lambda: np.zeros(3))
    axes_of: int = _STATIC
    axes: np.ndarray | None = None


class Controls:
    """The driven bones of a rig, studied."""

    def __init__(self, rig: bpy.types.Object, bones: list[str], movers: list[str], overrides: list[Override]):
        """bones: driven ones, carriers before what they carry. movers: those of them that are also moved.

        overrides: constraints that are to be silent. The rig is as it was when this returns.
        """
        self.rig, self.bones, self.movers = rig, list(bones), [bone for bone in bones if bone in movers]
        self.switches, self.overrides = switches(rig), overrides
        self.loose: list[str] = []
        with self._still():
            self._study()

    def _study(self) -> None:
        dice = np.random.default_rng(7)
        self.rest_turn, self.rest_place = self._posed()
        self.size = float(np.ptp(self.rest_place, axis=0).max()) or 1.0
        turns, places, own = [], [], []
        for _ in range(_TRIALS):
            vectors = dice.normal(size=(len(self.bones), 3))
            vectors *= _TURN / np.linalg.norm(vectors, axis=1, keepdims=True)
            own.append(quaternion.to_matrix(quaternion.from_rotation_vector(vectors)))
            self._turn(vectors)
            turn, place = self._posed()
            turns.append(turn)
            places.append(place)
        self.rides = [self._ride(i, np.array(turns), np.array(places), np.array(own)) for i in range(len(self.bones))]
        self._axes(turns[-1])

    def _ride(self, i: int, turns: np.ndarray, places: np.ndarray, own: np.ndarray) -> _Ride:
        """What bone i rides on, from the trials' poses (K, B, 3, 3), (K, B, 3) and its own turns (K, B, 3, 3)."""
        base = turns[:, i] @ own[:, i].transpose(0, 2, 1)
        ride, best_turn, best_place = _Ride(), np.inf, np.inf
        for d in [*range(i - 1, -1, -1), _STATIC]:
            carrier = turns[:, d] if d >= 0 else np.broadcast_to(np.eye(3), base.shape)
            origin = places[:, d] if d >= 0 else np.zeros((len(places), 3))
            seen = carrier.transpose(0, 2, 1) @ base
            if (spread := float(np.ptp(seen, axis=0).max())) < 0.3 * best_turn:
                ride.turn_of, ride.turn, best_turn = d, _nearest_turn(seen.mean(axis=0)), spread
            seen = np.einsum("kji,kj->ki", carrier, places[:, i] - origin)
            if (spread := float(np.ptp(seen, axis=0).max())) < 0.3 * best_place:
                ride.place_of, ride.place, best_place = d, seen.mean(axis=0), spread
        if best_turn > 10 * _RIDES or best_place > _RIDES * self.size:
            self.loose.append(self.bones[i])
        return ride

    def _axes(self, turns: np.ndarray) -> None:
        """Which way each mover goes for each of its location channels: measured in the last trial and at rest."""
        for bone in self.movers:
            i = self.bones.index(bone)
            measured = []
            for vectors in (None, self._last):
                self._turn(vectors)
                _, start = self._posed()
                columns = []
                for axis in range(3):
                    self._pose_bone(bone).location[axis] = self.size
                    columns.append((self._posed()[1][i] - start[i]) / self.size)
                    self._pose_bone(bone).location[axis] = 0.0
                measured.append(np.stack(columns, axis=1))
            if abs(np.linalg.det(measured[0])) < 1e-3:
                raise InputError(f"rig {self.rig.name}", f"bone {bone} does not move when its location is set",
                                 "a bone that is free to move", "choose another one in the bone map")
            carriers = [(d, self.rest_turn[d], turns[d]) for d in range(i - 1, -1, -1)]
            carriers.append((_STATIC, np.eye(3), np.eye(3)))
            spread = [np.abs(a.T @ measured[0] - b.T @ measured[1]).max() for _, a, b in carriers]
            d, rest, _ = carriers[int(np.argmin(spread))]
            self.rides[i].axes_of, self.rides[i].axes = d, rest.T @ measured[0]

    def basis(self, turns: dict[str, np.ndarray], places: dict[str, np.ndarray]):
        """The channels that put the driven bones so, in the armature's space.

        turns: bone -> rotation matrices (F, 3, 3), for all bones; places: mover -> heads (F, 3). Returns bone ->
        (basis rotations (F, 4), locations (F, 3) or None), and all heads (F, B, 3).
        """
        count = len(next(iter(turns.values())))
        turn = np.stack([turns[bone] for bone in self.bones], axis=1)
        heads, out = np.zeros((count, len(self.bones), 3)), {}
        for i, (bone, ride) in enumerate(zip(self.bones, self.rides)):
            base = self._of(turn, ride.turn_of) @ ride.turn
            origin = heads[:, ride.place_of] if ride.place_of >= 0 else 0.0
            heads[:, i] = self._of(turn, ride.place_of) @ ride.place + origin
            location = None
            if bone in places:
                axes = self._of(turn, ride.axes_of) @ ride.axes
                location = np.linalg.solve(axes, (places[bone] - heads[:, i])[..., None])[..., 0]
                heads[:, i] = places[bone]
            rotation = quaternion.from_matrix(np.swapaxes(base, -1, -2) @ turn[:, i])
            out[bone] = quaternion.continuous(rotation), location
        return out, heads

    def forward(self, turns: dict[str, np.ndarray], locations: dict[str, np.ndarray | None]) -> np.ndarray:
        """The opposite of `basis`: heads (F, B, 3) in the armature's space from channels, basis rotations (F, 4) of all
        driven bones and locations (F, 3) of those that have some."""
        count = len(next(iter(turns.values())))
        turn = np.zeros((count, len(self.bones), 3, 3))
        heads = np.zeros((count, len(self.bones), 3))
        for i, (bone, ride) in enumerate(zip(self.bones, self.rides)):
            turn[:, i] = self._of(turn, ride.turn_of) @ ride.turn @ quaternion.to_matrix(turns[bone])
            origin = heads[:, ride.place_of] if ride.place_of >= 0 else 0.0
            heads[:, i] = self._of(turn, ride.place_of) @ ride.place + origin
            if locations[bone] is not None and ride.axes is not None:
                axes = self._of(turn, ride.axes_of) @ ride.axes
                heads[:, i] += (axes @ locations[bone][..., None])[..., 0]
        return heads

    @staticmethod
    def _of(turn: np.ndarray, d: int) -> np.ndarray:
        return turn[:, d] if d >= 0 else np.eye(3)

    def _pose_bone(self, name: str) -> bpy.types.PoseBone:
        return self.rig.pose.bones[name]

    def _turn(self, vectors: np.ndarray | None) -> None:
        """Turn all driven bones by rotation vectors (B, 3), none where there are none; places at rest."""
        self._last = vectors
        for i, name in enumerate(self.bones):
            bone = self._pose_bone(name)
            bone.location, bone.scale = (0, 0, 0), (1, 1, 1)
            bone.rotation_mode = "QUATERNION"
            bone.rotation_quaternion = (
                (1, 0, 0, 0) if vectors is None else quaternion.from_rotation_vector(vectors[i])
            )

    def _posed(self) -> tuple[np.ndarray, np.ndarray]:
        """Turns (B, 3, 3) and heads (B, 3) of the driven bones as Blender poses them, in the armature's space."""
        self.rig.update_tag(refresh={"OBJECT", "DATA", "TIME"})
        bpy.context.view_layer.update()
        matrices = np.array([self._pose_bone(name).matrix for name in self.bones])
        turn = matrices[:, :3, :3]
        return turn / np.linalg.norm(turn, axis=1, keepdims=True), matrices[:, :3, 3]

    @contextmanager
    def _still(self):
        """The rig without its animation, its switches on FK, overrides silent; all as it was afterwards."""
        before = Kept(self.rig, self.bones, self.overrides)
        try:
            before.silence()
            for switch in self.switches:
                self._pose_bone(switch.bone)[switch.name] = switch.value
            self._turn(None)
            yield
        finally:
            for switch in self.switches:
                self._pose_bone(switch.bone)[switch.name] = switch.before
            before.bring_back()


class Kept:
    """Animation, channels and influences of a rig, kept to be brought back."""

    def __init__(self, rig: bpy.types.Object, bones: list[str], overrides: list[Override]):
        self.rig, data = rig, rig.animation_data
        self.playing = (data.action, data.action_slot, data.use_nla) if data else None
        self.position = rig.data.pose_position
        self.modes = {name: rig.pose.bones[name].rotation_mode for name in bones}
        self.values = {(name, channel): tuple(getattr(rig.pose.bones[name], channel))
                       for name in bones for channel in CHANNELS}
        self.constraints = [rig.pose.bones[o.bone].constraints[o.constraint] for o in overrides]
        self.muted = [constraint.mute for constraint in self.constraints]

    def silence(self) -> None:
        if self.playing is not None:
            self.rig.animation_data.action = None
            self.rig.animation_data.use_nla = False
        if self.position != "POSE":
            self.rig.data.pose_position = "POSE"
        for constraint in self.constraints:
            constraint.mute = True

    def bring_back(self) -> None:
        for constraint, mute in zip(self.constraints, self.muted):
            constraint.mute = mute
        for name, mode in self.modes.items():
            self.rig.pose.bones[name].rotation_mode = mode
        for (name, channel), value in self.values.items():
            setattr(self.rig.pose.bones[name], channel, value)
        if self.position != self.rig.data.pose_position:
            self.rig.data.pose_position = self.position
        if self.playing is not None:
            data = self.rig.animation_data
            data.use_nla = self.playing[2]
            data.action = self.playing[0]
            if self.playing[0] is not None and self.playing[1] is not None:
                data.action_slot = self.playing[1]
        self.rig.update_tag(refresh={"OBJECT", "DATA", "TIME"})
        bpy.context.view_layer.update()


def switches(rig: bpy.types.Object) -> list[Switch]:
    """Numbers on pose bones that choose between IK and FK, or let a bone follow by halves."""
    found = []
    for bone in rig.pose.bones:
        for name, value in bone.items():
            if isinstance(value, bool) or not isinstance(value, (int, float)):
                continue
            if _TO_FK.search(name) or _FROM_FK.search(name):
                whole = type(value)(1 if _TO_FK.search(name) else 0)
            elif _FOLLOW.search(name) and 0.0 < value < 1.0:
                whole = 1.0
            else:
                continue
            found.append(Switch(bone.name, name, whole, value))
    return found


def overriding(rig: bpy.types.Object, bones: list[str]) -> list[Override]:
    """Constraints that hold driven bones: those on them, and inverse kinematics below that reach up to them."""
    driven, found = set(bones), []
    for bone in rig.pose.bones:
        for constraint in bone.constraints:
            if constraint.mute or constraint.influence == 0.0:
                continue
            held = {bone.name}
            if constraint.type in {"IK", "SPLINE_IK"}:
                chain = [bone, *bone.parent_recursive]
                length = constraint.chain_count
                held = {one.name for one in (chain[:length] if length else chain)}
            if held & driven:
                found.append(Override(bone.name, constraint.name, constraint.type))
    return found


def _nearest_turn(matrix: np.ndarray) -> np.ndarray:
    """The rotation (3, 3) nearest to a matrix."""
    u, _, v = np.linalg.svd(matrix)
    return u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ v))]) @ v
