"""Transfer an edited motion to a rig of any kind: the values its controls need to show that motion.

Every part of the body has moved by a rigid motion D(t) from its place in the source; so has the whole rig. A control of
part o, with its rotation relative to part b and its place relative to part q, gets the rotation B'^-1 D_o M, where B is
its rest frame, B' = D_b B, and M is its pose in the source; places likewise. Where o, b and q move alike, its channels
stay as they are, bit for bit: that is why a rig that hangs on one root needs only that root, and its own path changes
nothing. Blender evaluates no frame again.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy
import numpy as np

from ...beyond_mocap.motion import quaternion
from ...beyond_mocap.motion.motion import Motion, forward_kinematics, sample_frames
from ..rigs.control_study import STATIC, Carriers
from .keys import to_rotation_channel
from .rig_parts import RigParts, compute_world_places, to_rotations
from .rig_sampling import RigSamples

WHOLE, OBJECT = "whole", "object"
_SAME = 1e-6
_STAYS, _LEAST_WAY = 0.5, 1.0  # share of the body's travel, metres: what stays behind further does not travel with it


@dataclass(frozen=True)
class Control:
    """One control of a rig.

    Attributes:
        name: of the bone.
        own: the group that it moves with.
        turn: the group that its rotation is relative to.
        place: the group that its place is relative to.
        axes: the group that gives the axes of its location.
        slides: whether its location is written.
    """

    name: str
    own: str
    turn: str
    place: str
    axes: str
    has_location: bool


@dataclass(frozen=True, eq=False)
class GroupMotions:
    """The rigid motion of each group from the source to its present place: x -> turn (x - before) + after.

    Attributes:
        turn: group -> (N, 4) rotations.
        before: group -> (N, 3) metres.
        after: group -> (N, 3) metres.
        known: cache of comparisons.
    """

    rotation: dict[str, np.ndarray]
    before: dict[str, np.ndarray]
    after: dict[str, np.ndarray]
    known: dict = field(default_factory=dict)

    def transform_point(self, group: str, points: np.ndarray) -> np.ndarray:
        """Transform points (N, 3) that move with a group."""
        return quaternion.rotate(self.rotation[group], points - self.before[group]) + self.after[group]

    def transform_points(self, groups: list[str], points: np.ndarray) -> np.ndarray:
        """Transform points (N, C, 3), each column with its group."""
        turn, before, after = (np.stack([table[group] for group in groups], axis=1)
                               for table in (self.rotation, self.before, self.after))
        return quaternion.rotate(turn, points - before) + after

    def is_same_motion(self, one: str, other: str) -> bool:
        """Return whether two groups move alike: to a ten-thousandth of a degree and of a millimetre."""
        if one == other:
            return True
        if (known := self.known.get((one, other))) is None:
            same = np.abs(np.abs(self.compute_relative_rotation(one, other)[:, 0]) - 1.0).max() <= 1e-12
            same = same and np.abs(self.transform_point(one, self.before[other]) - self.after[other]).max() < 1e-7
            known = self.known[one, other] = bool(same)
        return known

    def compute_relative_rotation(self, one: str, other: str) -> np.ndarray:
        """Compute the rotation (N, 4) of group `other` relative to group `one`."""
        if (known := self.known.get((one, other, "turn"))) is None:
            known = quaternion.multiply(quaternion.inverse(self.rotation[one]), self.rotation[other])
            self.known[one, other, "turn"] = known
        return known


class SourceRows:
    """Source frames (N,) of the displayed frames, fractional in general, counted from the first sample.

    Attributes:
        known: cache of table values there, by name; a path that is dragged needs the same again.
    """

    def __init__(self, at: np.ndarray, count: int):
        self.frames, self.known = at, {}
        at = np.clip(at, 0.0, count - 1.0)
        near = np.round(at)
        self.at, self.whole = at, bool(np.abs(at - near).max(initial=0.0) < 1e-6)
        self.low = near.astype(int) if self.whole else np.minimum(np.floor(at).astype(int), max(count - 2, 0))
        self.weight = np.zeros(len(at)) if self.whole else at - self.low
        self.same = self.whole and len(at) == count and np.array_equal(self.low, np.arange(count))

    def sample_numbers(self, name, table: np.ndarray) -> np.ndarray:
        """Interpolate a table (F, ...) of numbers; name: a unique key for the cache."""
        return self.find_cached(name, lambda: self._select_rows(table, self._blend_rows))

    def sample_rotations(self, name, table: np.ndarray) -> np.ndarray:
        """Interpolate a table (F, 4) of rotations; name: a unique key for the cache."""
        return self.find_cached(name, lambda: self._select_rows(table, lambda a,
                                                                b: quaternion.slerp(a, b, self.weight)))

    def find_cached(self, name, compute) -> np.ndarray:
        """Return the cached value of a name, computed by `compute` when missing."""
        if name not in self.known:
            self.known[name] = compute()
        return self.known[name]

    def _select_rows(self, table: np.ndarray, blend) -> np.ndarray:
        """Select rows of a table; blend(before, after) interpolates between two rows."""
        if self.same:
            return table
        if self.whole:
            return table[self.low]
        return blend(table[self.low], table[np.minimum(self.low + 1, len(table) - 1)])

    def _blend_rows(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        weight = self.weight.reshape(-1, *[1] * (before.ndim - 1))
        return (1.0 - weight) * before + weight * after


class RigTransfer:
    """A sampled rig, with its controls and the values that they need."""

    def __init__(self, rig: bpy.types.Object, parts: RigParts, samples: RigSamples, dependencies: Carriers,
                 object_keyed: bool, motion: Motion, units: float):
        """Sort the controls into groups and tabulate them.

        Args:
            rig: the armature.
            parts: its parts.
            samples: its samples.
            dependencies: what each control depends on.
            object_keyed: whether the object itself is animated.
            motion: the motion that the parts show.
            units: Blender units in a metre.
        """
        self.samples, self.parts, self.motion, self.units = samples, parts, motion, units
        self.joint = {part: number for number, part in enumerate(parts.visible_bones)}
        self.places, self.world = forward_kinematics(motion)
        self.placement = to_rotations(samples.world_matrices), samples.world_matrices[:, :3, 3] / units
        self.object_travels = object_keyed and self._is_travelling(self.placement[1])
        self.group: dict[str, str] = {
            bone: part for table in (parts.visible_bones, parts.controls) for part, bone in table.items()
        }
        self.controls = self._list_controls(rig, dependencies)
        self.tables = {control.name: self._tabulate_control(rig, control) for control in self.controls}

    def _is_travelling(self, places: np.ndarray) -> bool:
        """Return whether something at places (F, 3) travels with the body."""
        travel = self.motion.root_positions[:, :2]
        behind = np.ptp(places[:, :2] - travel, axis=0).max()
        return bool(behind <= max(_STAYS * np.ptp(travel, axis=0).max(), _LEAST_WAY))

    def _list_controls(self, rig: bpy.types.Object, dependencies: Carriers) -> list[Control]:
        """List all firm controls with their groups."""
        known = dict(self.group)
        places, _ = compute_world_places(self.samples, [self.samples.find_bone(name) for name in dependencies.controls],
                                         self.units)

        def find_group(number: int, trail: tuple = ()) -> str:
            """Find the group of a carrier, following what it depends on."""
            if number == STATIC or number in trail:
                return OBJECT
            name = dependencies.carriers[number]
            if name in known:
                return known[name]
            found = find_group(int(dependencies.rotation_carrier[number]), (*trail, number))
            followed_part = self.parts.follows.get(name) or self.parts.trunk.get(name)
            if followed_part is not None and (followed_part.endswith("toe")
                                              or followed_part.partition(" ")[0] != found.partition(" ")[0]):
                found = followed_part
            elif found == OBJECT and not self.object_travels and self._is_travelling(places[:, number]):
                found = WHOLE
            known[name] = found
            return found

        found = []
        for number, name in enumerate(dependencies.controls):
            if not dependencies.is_reliable[number]:
                continue
            own, turn, place, axes = find_group(number), *(find_group(int(table[number])) for table in (
                dependencies.rotation_carrier, dependencies.position_carrier, dependencies.parent_carrier))
            limb = name in self.parts.controls.values() and name != self.parts.controls.get("hips")
            slides = own != place and not limb and not rig.data.bones[name].use_connect
            if {turn, place} != {own}:
                found.append(Control(name, own, turn, place=place, axes=axes, has_location=slides))
        return [*found, *self._list_ik_bones(rig)]

    def _list_ik_bones(self, rig: bpy.types.Object) -> list[Control]:
        """List the bones of legs and arms that inverse kinematics without a pole bends.

        The solver starts from the bones' own rotations, so that the target pose is set as its start.
        """
        found = []
        for bone in rig.pose.bones:
            for one in bone.constraints:
                if one.type == "IK" and not one.mute and one.influence > 0.0 and one.pole_target is None:
                    chain = [bone, *bone.parent_recursive][: one.chain_count or None]
                    for held in reversed(chain):
                        above = self.group.get(held.parent.name) if held.parent is not None else None
                        if held.name in self.parts.visible_bones.values() and above is not None:
                            found.append(Control(held.name, self.group[held.name], above, place=above, axes=above,
                                                 has_location=False))
        self.ik_bones = {control.name for control in found}
        return found

    def _tabulate_control(self, rig: bpy.types.Object, control: Control) -> dict[str, np.ndarray]:
        """Tabulate a control over the source's frames.

        Rotation of its base and its own (F, 4); its place and the place of its zero location (F, 3) m; the matrix from
        metres to its location's units (F, 3, 3); its location (F, 3).
        """
        number = self.samples.find_bone(control.name)
        places, turn = compute_world_places(self.samples, [number], self.units)
        own, location = self.samples.compute_own_rotations(number), self.samples.channels["location"][:, number]
        if control.name in self.ik_bones:
            bone = rig.data.bones[control.name]
            rest = quaternion.from_matrix(np.array((bone.parent.matrix_local.inverted() @ bone.matrix_local).to_3x3()))
            _, above = compute_world_places(self.samples, [self.samples.find_bone(bone.parent.name)], self.units)
            own = quaternion.multiply(quaternion.inverse(quaternion.multiply(above[:, 0], rest)), turn[:, 0])
        base = quaternion.multiply(turn[:, 0], quaternion.inverse(own))
        axes = self.samples.world_matrices[:, :3, :3] @ self._compute_axes(rig, control.name, base) / self.units
        rests = places[:, 0] - np.einsum("fij,fj->fi", axes, location)
        return {"base": quaternion.unify_signs(base), "own": quaternion.unify_signs(own), "place": places[:, 0],
                "rests": rests, "back": np.linalg.inv(axes), "location": location}  # fmt: skip

    def _compute_axes(self, rig: bpy.types.Object, name: str, base: np.ndarray) -> np.ndarray:
        """Compute the axes (F, 3, 3) of a bone's location in the armature's space, as Blender composes poses."""
        bone = rig.data.bones[name]
        if len(rig.pose.bones[name].constraints):
            return quaternion.to_matrix(quaternion.multiply(quaternion.inverse(self.placement[0]), base))
        own = np.array(bone.matrix_local.to_3x3()) if bone.use_local_location else np.eye(3)
        if bone.parent is None:
            return np.broadcast_to(own, (len(base), 3, 3))
        above = self.samples.poses[:, self.samples.find_bone(bone.parent.name), :3, :3]
        if not bone.use_local_location:
            return above
        return above @ np.linalg.inv(np.array(bone.parent.matrix_local.to_3x3())) @ own

    def compute_group_motions(self, motion: Motion, rigid: Motion, rows: SourceRows, world_matrices: np.ndarray
                              | None) -> GroupMotions:
        """Compute the rigid motion of each group.

        Args:
            motion: the edited motion.
            rigid: the same before leaning and planting.
            rows: source frames of the displayed frames.
            world_matrices: (N, 4, 4) of the object on the displayed frames; None where they are those of the source.
        Returns:
            The motion of each group.
        """
        places, world = forward_kinematics(motion)
        was, had = rows.find_cached("source", lambda: self._source_at(rows))
        used = {group for one in self.controls for group in (one.own, one.turn, one.place, one.axes)}
        turn, before, after = {}, {}, {}
        for part in used & set(self.joint):
            joint = self.joint[part]
            turn[part] = quaternion.multiply(world[:, joint], quaternion.inverse(had[:, joint]))
            before[part], after[part] = was[:, joint], places[:, joint]
        turn[WHOLE] = quaternion.multiply(rigid.rotations[:, 0], quaternion.inverse(had[:, 0]))
        before[WHOLE], after[WHOLE] = was[:, 0], rigid.root_positions
        if self.object_travels:
            turn[OBJECT], before[OBJECT], after[OBJECT] = turn[WHOLE], before[WHOLE], after[WHOLE]
        else:
            then, origin = rows.sample_rotations("lie", self.placement[0]), rows.sample_numbers("origin",
                    self.placement[1])
            now = then if world_matrices is None else to_rotations(world_matrices)
            turn[OBJECT] = quaternion.multiply(now, quaternion.inverse(then))
            before[OBJECT], after[OBJECT] = origin, origin if world_matrices is None else world_matrices[:, :3,
                    3] / self.units
        return GroupMotions(turn, before, after)

    def _source_at(self, rows: SourceRows) -> tuple[np.ndarray, np.ndarray]:
        """Compute places (N, J, 3) and rotations (N, J, 4) of the source's joints in the world."""
        if rows.whole:
            return self.places[rows.low], self.world[rows.low]
        root, local = sample_frames(self.motion, rows.at)
        return forward_kinematics(Motion(self.motion.skeleton, root, local, self.motion.fps))

    def compute_changes(self, moves: GroupMotions, rows: SourceRows) -> dict[tuple[str, str], np.ndarray]:
        """Compute the channels that differ from the source.

        Args:
            moves: motion of each group.
            rows: source frames of the displayed frames.
        Returns:
            (bone, "turn") -> continuous rotations (N, 4) of its own channels; (bone, "location") -> (N, 3).
        """
        some = [one for one in self.controls
                if not all(moves.is_same_motion(one.own, other) for other in (one.turn, one.place))]
        return (self._compute_rotations(some, moves, rows)
                | self._compute_locations([one for one in some if one.has_location], moves, rows)) if some else {}

    def _compute_rotations(self, some: list[Control], moves: GroupMotions, rows: SourceRows) -> dict[tuple[str, str],
            np.ndarray]:
        back, own, pose = rows.find_cached(("turns", *some), lambda: self._sample_control_rotations(some, rows))
        between = np.stack([moves.compute_relative_rotation(one.turn, one.own) for one in some], axis=1)
        rotations = quaternion.multiply(back, quaternion.multiply(between, pose))
        other = np.abs(np.abs(np.sum(rotations * own, axis=2)) - 1.0).max(axis=0) > 1e-14
        rotations = quaternion.unify_signs(rotations)
        return {(one.name, "turn"): rotations[:, i] for i, one in enumerate(some) if other[i]
                or one.name in self.ik_bones}

    def _sample_control_rotations(self, some: list[Control], rows: SourceRows) -> tuple[np.ndarray, np.ndarray,
            np.ndarray]:
        """Compute rotations (N, C, 4) of controls: the inverse of their base, their own, and base and own together."""
        base, own = (np.stack([rows.sample_rotations((one, what), self.tables[one.name][what]) for one in some], axis=1)
                     for what in ("base", "own"))
        return quaternion.inverse(base), own, quaternion.multiply(base, own)

    def _compute_locations(self, some: list[Control], moves: GroupMotions, rows: SourceRows) -> dict[tuple[str, str],
            np.ndarray]:
        """Compute the locations (N, 3) of controls with their own location channel."""
        if not some:
            return {}

        def stack_tables(what: str) -> np.ndarray:
            """Stack a table of all controls: (N, C, ...)."""
            made = lambda: np.stack([rows.sample_numbers((one, what), self.tables[one.name][what]) for one in some],
                                    axis=1)  # noqa: E731
            return rows.find_cached((what, *some), made)

        rests = moves.transform_points([one.place for one in some], stack_tables("rests"))
        away = moves.transform_points([one.own for one in some], stack_tables("place")) - rests
        turn = np.stack([moves.rotation[one.axes] for one in some], axis=1)
        location = np.einsum("ncij,ncj->nci", stack_tables("back"), quaternion.rotate(quaternion.inverse(turn), away))
        other = np.abs(location - stack_tables("location")).max(axis=(0, 2)) > _SAME
        return {(one.name, "location"): location[:, i] for i, one in enumerate(some) if other[i]}


def to_channel_values(mode: str, rotations: np.ndarray, like: np.ndarray) -> np.ndarray:
    """Convert continuous rotations to the values of a bone's rotation channel.

    Args:
        mode: rotation mode of the bone.
        rotations: (N, 4) continuous rotations.
        like: (n,) the source's first values, whose sign and full turns are kept.
    Returns:
        (N, n) values.
    """
    values = rotations if mode == "QUATERNION" else to_rotation_channel(mode, rotations)
    if mode == "QUATERNION":
        return values if np.sum(values[0] * like) >= 0.0 else -values
    return values if mode == "AXIS_ANGLE" else values + 2.0 * np.pi * np.round((like - values[0]) / (2.0 * np.pi))
