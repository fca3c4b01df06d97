"""World poses as values of a rig's channels: plain arithmetic, without evaluating the rig for each frame.

The arithmetic's parameters are found once (`control_study`): the carrier of each driven bone, and the direction in
which each of its location channels moves it.
"""

from __future__ import annotations

import json
import re
from contextlib import contextmanager
from dataclasses import dataclass

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.motion import quaternion
from ..core import channels
from .control_study import (
    CARRIER_TOLERANCE,
    STATIC,
    TRIALS,
    PosedRig,
    compute_position_spread,
    compute_rotation_spread,
    find_nearest_carrier,
    split_poses,
)

PREVIOUS_STATE = "beyond_mocap_before"  # on a baked action: JSON with the rig's state before its first bake

_TRIAL_ANGLE = 0.7
_IK_TO_FK, _FK_TO_IK = re.compile(r"(?i)ik.*fk"), re.compile(r"(?i)fk.*ik")
_FOLLOW = re.compile(r"(?i)follow")


@dataclass(frozen=True)
class Switch:
    """A number on a pose bone that has to be `value` for the controls to take effect; it was `before` the first bake.
    """

    bone: str
    name: str
    value: float
    before: float


@dataclass(frozen=True)
class Override:
    """A constraint that would override a driven bone's channels."""

    bone: str
    constraint: str
    kind: str


@dataclass
class _Carrier:
    """The carrier of one control: its index (-1: the armature itself) and the constant part seen in it."""

    rotation_carrier: int
    rotation: np.ndarray
    position_carrier: int
    position: np.ndarray
    axes_carrier: int = STATIC
    axes: np.ndarray | None = None


class Controls:
    """The driven bones of a rig and their carriers."""

    def __init__(self, rig: bpy.types.Object, bones: list[str], movers: list[str], overrides: list[Override]):
        """Find the carriers of the driven bones; the rig is restored at the end.

        Args:
            rig: the armature.
            bones: driven ones, carriers before what they carry.
            movers: those that also get a location.
            overrides: constraints to mute.
        """
        self.rig, self.bones, self.movers = rig, list(bones), [bone for bone in bones if bone in movers]
        self.switches, self.overrides = list_switches(rig), overrides
        self.unreliable: list[str] = []
        with self._pose_rig() as posed:
            self._run_study(posed)

    def _run_study(self, posed: PosedRig) -> None:
        """Pose the rig in random trials and find carriers and axes."""
        random, none = np.random.default_rng(7), quaternion.identity(len(self.bones))
        self.rest_rotations, self.rest_positions = split_poses(posed.apply_pose(none, self.bones))
        self.size = float(np.ptp(self.rest_positions, axis=0).max()) or 1.0
        own, poses = [], []
        for _ in range(TRIALS):
            vectors = random.normal(size=(len(self.bones), 3))
            vectors *= _TRIAL_ANGLE / np.linalg.norm(vectors, axis=1, keepdims=True)
            own.append(quaternion.from_rotation_vector(vectors))
            poses.append(posed.apply_pose(own[-1], self.bones))
        turns, places = split_poses(np.array(poses))
        self.carriers = self._find_carriers(turns, places, quaternion.to_matrix(np.array(own)))
        for bone in self.movers:
            self._measure_axes(posed, bone, own[-1], turns[-1])

    def _find_carriers(self, turns: np.ndarray, places: np.ndarray, own: np.ndarray) -> list[_Carrier]:
        """Find each bone's carriers from the trials' poses (K, B, 3, 3), (K, B, 3) and own rotations (K, B, 3, 3)."""
        base, found = turns @ own.transpose(0, 1, 3, 2), []
        turning, going = compute_rotation_spread(turns, base), compute_position_spread(turns, places, places)
        for i, bone in enumerate(self.bones):
            turn_of, worst = find_nearest_carrier(turning[:, i], i)
            place_of, off = find_nearest_carrier(going[:, i], i)
            seen = np.swapaxes(self._get_rotation(turns, turn_of), -1, -2) @ base[:, i]
            away = places[:, i] - (places[:, place_of] if place_of >= 0 else np.zeros((len(places), 3)))
            carrier = np.broadcast_to(self._get_rotation(turns, place_of), base[:, i].shape)
            place = np.einsum("kji,kj->ki", carrier, away).mean(axis=0)
            found.append(_Carrier(turn_of, _find_nearest_rotation(seen.mean(axis=0)), place_of, place))
            if worst > 10 * CARRIER_TOLERANCE or off > CARRIER_TOLERANCE * self.size:
                self.unreliable.append(bone)
        return found

    def _measure_axes(self, posed: PosedRig, bone: str, own: np.ndarray, turns: np.ndarray) -> None:
        """Measure the directions of a mover's location channels.

        At rest, and in the last trial, in which the bones were rotated by `own` (B, 4) and posed as `turns` (B, 3, 3).
        """
        i = self.bones.index(bone)
        measured = [self._measure_motion_axes(posed, i, turn) for turn in (quaternion.identity(len(self.bones)), own)]
        if abs(np.linalg.det(measured[0])) < 1e-3:
            raise InputError(f"rig {self.rig.name}", f"bone {bone} does not move when its location is set",
                             "a bone that is free to move", "choose another one in the bone map")
        carriers = [(d, self.rest_rotations[d], turns[d]) for d in range(i - 1, -1, -1)]
        carriers.append((STATIC, np.eye(3), np.eye(3)))
        spread = [np.abs(a.T @ measured[0] - b.T @ measured[1]).max() for _, a, b in carriers]
        d, rest, _ = carriers[int(np.argmin(spread))]
        self.carriers[i].axes_carrier, self.carriers[i].axes = d, rest.T @ measured[0]

    def _measure_motion_axes(self, posed: PosedRig, i: int, own: np.ndarray) -> np.ndarray:
        """Measure how bone i moves (3, 3), one column per location channel, while the bones are rotated by `own`."""
        _, start = split_poses(posed.apply_pose(own, self.bones))
        columns = []
        for axis in range(3):
            shifts = np.zeros((len(self.bones), 3))
            shifts[i, axis] = self.size
            columns.append((split_poses(posed.apply_pose(own, self.bones, shifts))[1][i] - start[i]) / self.size)
        return np.stack(columns, axis=1)

    def compute_channels(self, turns: dict[str, np.ndarray], places: dict[str, np.ndarray]):
        """Compute the channels for given poses of the driven bones.

        Args:
            turns: bone -> rotation matrices (F, 3, 3), for all bones, armature space.
            places: mover -> heads (F, 3), armature space.
        Returns:
            Bone -> (basis rotations (F, 4), locations (F, 3) or None), and all heads (F, B, 3).
        """
        count = len(next(iter(turns.values())))
        turn = np.stack([turns[bone] for bone in self.bones], axis=1)
        heads, out = np.zeros((count, len(self.bones), 3)), {}
        for i, (bone, carrier) in enumerate(zip(self.bones, self.carriers)):
            base = self._get_rotation(turn, carrier.rotation_carrier) @ carrier.rotation
            origin = heads[:, carrier.position_carrier] if carrier.position_carrier >= 0 else 0.0
            heads[:, i] = self._get_rotation(turn, carrier.position_carrier) @ carrier.position + origin
            location = None
            if bone in places:
                axes = self._get_rotation(turn, carrier.axes_carrier) @ carrier.axes
                # the location channels that move the head from where its carrier puts it to the given position
                location = np.linalg.solve(axes, (places[bone] - heads[:, i])[..., None])[..., 0]
                heads[:, i] = places[bone]
            rotation = quaternion.from_matrix(np.swapaxes(base, -1, -2) @ turn[:, i])
            out[bone] = quaternion.unify_signs(rotation), location
        return out, heads

    def compute_heads(self, turns: dict[str, np.ndarray], locations: dict[str, np.ndarray | None]) -> np.ndarray:
        """Compute heads (F, B, 3) in the armature's space from channels: the inverse of `compute_channels`.

        Args:
            turns: bone -> basis rotations (F, 4), for all driven bones.
            locations: bone -> (F, 3), or None.
        Returns:
            (F, B, 3).
        """
        count = len(next(iter(turns.values())))
        turn = np.zeros((count, len(self.bones), 3, 3))
        heads = np.zeros((count, len(self.bones), 3))
        for i, (bone, carrier) in enumerate(zip(self.bones, self.carriers)):
            base = self._get_rotation(turn, carrier.rotation_carrier) @ carrier.rotation
            turn[:, i] = base @ quaternion.to_matrix(turns[bone])
            origin = heads[:, carrier.position_carrier] if carrier.position_carrier >= 0 else 0.0
            heads[:, i] = self._get_rotation(turn, carrier.position_carrier) @ carrier.position + origin
            if locations[bone] is not None and carrier.axes is not None:
                axes = self._get_rotation(turn, carrier.axes_carrier) @ carrier.axes
                heads[:, i] += (axes @ locations[bone][..., None])[..., 0]
        return heads

    @staticmethod
    def _get_rotation(turn: np.ndarray, d: int) -> np.ndarray:
        return turn[:, d] if d >= 0 else np.eye(3)

    @contextmanager
    def _pose_rig(self):
        """Pose the rig without its animation, its switches on FK, overrides muted; all is restored afterwards."""
        bones = self.rig.pose.bones
        silent = [bones[one.bone].constraints[one.constraint] for one in self.overrides]
        current = [bones[switch.bone][switch.name] for switch in self.switches]
        with PosedRig(self.rig, bpy.context.view_layer, self.bones, silent) as posed:
            try:
                for switch in self.switches:
                    bones[switch.bone][switch.name] = switch.value
                yield posed
            finally:
                for switch, value in zip(self.switches, current):
                    bones[switch.bone][switch.name] = value


def _find_nearest_rotation(matrix: np.ndarray) -> np.ndarray:
    """Find the rotation (3, 3) nearest to a matrix."""
    u, _, v = np.linalg.svd(matrix)
    return u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ v))]) @ v


def read_previous_state(rig: bpy.types.Object) -> dict:
    """Read the rig's state before its first bake, while it plays a bake; else nothing."""
    playing, _ = channels.find_playing_action(rig)
    return json.loads(playing.get(PREVIOUS_STATE, "{}")) if playing is not None else {}


def list_switches(rig: bpy.types.Object) -> list[Switch]:
    """List the numbers on pose bones that choose between IK and FK, or let a bone follow partly: as they were before
    the first bake, which sets them.
    """
    found = []
    earlier = {(bone, name): value for bone, name, value in read_previous_state(rig).get("switches", ())}
    for bone in rig.pose.bones:
        for name, current in bone.items():
            value = earlier.get((bone.name, name), current)
            if isinstance(value, bool) or not isinstance(value, (int, float)):
                continue
            if _IK_TO_FK.search(name) or _FK_TO_IK.search(name):
                whole = type(value)(1 if _IK_TO_FK.search(name) else 0)
            elif _FOLLOW.search(name) and 0.0 < value < 1.0:
                whole = 1.0
            else:
                continue
            found.append(Switch(bone.name, name, whole, value))
    return found


def list_overrides(rig: bpy.types.Object, bones: list[str]) -> list[Override]:
    """List the constraints that override driven bones: those on them, and inverse kinematics further down the chain.

    Those that an earlier bake has switched off count as they were before it.
    """
    driven, found = set(bones), []
    earlier = {(bone, name): value for bone, name, value in read_previous_state(rig).get("constraints", ())}
    for bone in rig.pose.bones:
        for constraint in bone.constraints:
            influence = earlier.get((bone.name, constraint.name), constraint.influence)
            if constraint.mute or influence == 0.0:
                continue
            held = {bone.name}
            if constraint.type in {"IK", "SPLINE_IK"}:
                chain = [bone, *bone.parent_recursive]
                length = constraint.chain_count
                held = {one.name for one in (chain[:length] if length else chain)}
            if held & driven:
                found.append(Override(bone.name, constraint.name, constraint.type))
    return found
