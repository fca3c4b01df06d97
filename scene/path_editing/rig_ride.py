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
from ...beyond_mocap.motion.motion import Motion, at_frames, forward_kinematics
from ..rigs.control_study import STATIC, Rides
from .keys import rotation
from .rig_look import Look
from .rig_parts import Parts, in_world, rotations

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
    slides: bool


@dataclass(frozen=True, eq=False)
class Moves:
    """The rigid motion of each group from the source to its present place: x -> turn (x - before) + after.

    Attributes:
        turn: group -> (N, 4) rotations.
        before: group -> (N, 3) metres.
        after: group -> (N, 3) metres.
        known: cache of comparisons.
    """

    turn: dict[str, np.ndarray]
    before: dict[str, np.ndarray]
    after: dict[str, np.ndarray]
    known: dict = field(default_factory=dict)

    def point(self, group: str, points: np.ndarray) -> np.ndarray:
        """Transform points (N, 3) that move with a group."""
        return quaternion.rotate(self.turn[group], points - self.before[group]) + self.after[group]

    def points(self, groups: list[str], points: np.ndarray) -> np.ndarray:
        """Transform points (N, C, 3), each column with its group."""
        turn, before, after = (np.stack([table[group] for group in groups], axis=1)
                               for table in (self.turn, self.before, self.after))
        return quaternion.rotate(turn, points - before) + after

    def alike(self, one: str, other: str) -> bool:
        """Return whether two groups move alike: to a ten-thousandth of a degree and of a millimetre."""
        if one == other:
            return True
        if (known := self.known.get((one, other))) is None:
            same = np.abs(np.abs(self.between(one, other)[:, 0]) - 1.0).max() <= 1e-12
            same = same and np.abs(self.point(one, self.before[other]) - self.after[other]).max() < 1e-7
            known = self.known[one, other] = bool(same)
        return known

    def between(self, one: str, other: str) -> np.ndarray:
        """Compute the rotation (N, 4) of group `other` relative to group `one`."""
        if (known := self.known.get((one, other, "turn"))) is None:
            known = quaternion.multiply(quaternion.inverse(self.turn[one]), self.turn[other])
            self.known[one, other, "turn"] = known
        return known


class Rows:
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

    def numbers(self, name, table: np.ndarray) -> np.ndarray:
        """Interpolate a table (F, ...) of numbers; name: a unique key for the cache."""
        return self.remembered(name, lambda: self._at(table, self._mixed))

    def turns(self, name, table: np.ndarray) -> np.ndarray:
        """Interpolate a table (F, 4) of rotations; name: a unique key for the cache."""
        return self.remembered(name, lambda: self._at(table, lambda a, b: quaternion.slerp(a, b, self.weight)))

    def remembered(self, name, made) -> np.ndarray:
        """Return the cached value of a name, computed by `compute` when missing."""
        if name not in self.known:
            self.known[name] = made()
        return self.known[name]

    def _at(self, table: np.ndarray, blend) -> np.ndarray:
        """Select rows of a table; blend(before, after) interpolates between two rows."""
        if self.same:
            return table
        if self.whole:
            return table[self.low]
        return blend(table[self.low], table[np.minimum(self.low + 1, len(table) - 1)])

    def _mixed(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        weight = self.weight.reshape(-1, *[1] * (before.ndim - 1))
        return (1.0 - weight) * before + weight * after


class Carried:
    """A sampled rig, with its controls and the values that they need."""

    def __init__(self, rig: bpy.types.Object, parts: Parts, seen: Look, rides: Rides, object_keyed: bool,
                 motion: Motion, units: float):
        """Sort the controls into groups and tabulate them.

        Args:
            rig: the armature.
            parts: its parts.
            seen: its samples.
            dependencies: what each control depends on.
            object_keyed: whether the object itself is animated.
            motion: the motion that the parts show.
            units: Blender units in a metre.
        """
        self.seen, self.parts, self.motion, self.units = seen, parts, motion, units
        self.joint = {part: number for number, part in enumerate(parts.shown)}
        self.places, self.world = forward_kinematics(motion)
        self.lie = rotations(seen.lies), seen.lies[:, :3, 3] / units
        self.object_goes = object_keyed and self._travels(self.lie[1])
        self.group: dict[str, str] = {
            bone: part for table in (parts.shown, parts.controls) for part, bone in table.items()
        }
        self.controls = self._sorted(rig, rides)
        self.tables = {control.name: self._table(rig, control) for control in self.controls}

    def _travels(self, places: np.ndarray) -> bool:
        """Return whether something at places (F, 3) travels with the body."""
        way = self.motion.root_positions[:, :2]
        behind = np.ptp(places[:, :2] - way, axis=0).max()
        return bool(behind <= max(_STAYS * np.ptp(way, axis=0).max(), _LEAST_WAY))

    def _sorted(self, rig: bpy.types.Object, rides: Rides) -> list[Control]:
        """List all firm controls with their groups."""
        known = dict(self.group)
        places, _ = in_world(self.seen, [self.seen.number(name) for name in rides.controls], self.units)

        def group(number: int, trail: tuple = ()) -> str:
            """Find the group of a carrier, following what it depends on."""
            if number == STATIC or number in trail:
                return OBJECT
            name = rides.carriers[number]
            if name in known:
                return known[name]
            found = group(int(rides.turn_of[number]), (*trail, number))
            goes = self.parts.follows.get(name) or self.parts.trunk.get(name)
            if goes is not None and (goes.endswith("toe") or goes.partition(" ")[0] != found.partition(" ")[0]):
                found = goes
            elif found == OBJECT and not self.object_goes and self._travels(places[:, number]):
                found = WHOLE
            known[name] = found
            return found

        found = []
        for number, name in enumerate(rides.controls):
            if not rides.firm[number]:
                continue
            own, turn, place, axes = group(number), *(group(int(table[number])) for table in (
                rides.turn_of, rides.place_of, rides.parent_of))
            limb = name in self.parts.controls.values() and name != self.parts.controls.get("hips")
            slides = own != place and not limb and not rig.data.bones[name].use_connect
            if {turn, place} != {own}:
                found.append(Control(name, own, turn, place=place, axes=axes, slides=slides))
        return [*found, *self._bent(rig)]

    def _bent(self, rig: bpy.types.Object) -> list[Control]:
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
                        if held.name in self.parts.shown.values() and above is not None:
                            found.append(Control(held.name, self.group[held.name], above, place=above, axes=above,
                                                 slides=False))
        self.held = {control.name for control in found}
        return found

    def _table(self, rig: bpy.types.Object, control: Control) -> dict[str, np.ndarray]:
        """Tabulate a control over the source's frames.

        Rotation of its base and its own (F, 4); its place and the place of its zero location (F, 3) m; the matrix from
        metres to its location's units (F, 3, 3); its location (F, 3).
        """
        number = self.seen.number(control.name)
        places, turn = in_world(self.seen, [number], self.units)
        own, location = self.seen.own(number), self.seen.channels["location"][:, number]
        if control.name in self.held:
            bone = rig.data.bones[control.name]
            rest = quaternion.from_matrix(np.array((bone.parent.matrix_local.inverted() @ bone.matrix_local).to_3x3()))
            _, above = in_world(self.seen, [self.seen.number(bone.parent.name)], self.units)
            own = quaternion.multiply(quaternion.inverse(quaternion.multiply(above[:, 0], rest)), turn[:, 0])
        base = quaternion.multiply(turn[:, 0], quaternion.inverse(own))
        axes = self.seen.lies[:, :3, :3] @ self._axes(rig, control.name, base) / self.units
        rests = places[:, 0] - np.einsum("fij,fj->fi", axes, location)
        return {"base": quaternion.continuous(base), "own": quaternion.continuous(own), "place": places[:, 0],
                "rests": rests, "back": np.linalg.inv(axes), "location": location}  # fmt: skip

    def _axes(self, rig: bpy.types.Object, name: str, base: np.ndarray) -> np.ndarray:
        """Compute the axes (F, 3, 3) of a bone's location in the armature's space, as Blender composes poses."""
        bone = rig.data.bones[name]
        if len(rig.pose.bones[name].constraints):
            return quaternion.to_matrix(quaternion.multiply(quaternion.inverse(self.lie[0]), base))
        own = np.array(bone.matrix_local.to_3x3()) if bone.use_local_location else np.eye(3)
        if bone.parent is None:
            return np.broadcast_to(own, (len(base), 3, 3))
        above = self.seen.poses[:, self.seen.number(bone.parent.name), :3, :3]
        if not bone.use_local_location:
            return above
        return above @ np.linalg.inv(np.array(bone.parent.matrix_local.to_3x3())) @ own

    def moves(self, motion: Motion, rigid: Motion, rows: Rows, lies: np.ndarray | None) -> Moves:
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
        was, had = rows.remembered("source", lambda: self._source_at(rows))
        used = {group for one in self.controls for group in (one.own, one.turn, one.place, one.axes)}
        turn, before, after = {}, {}, {}
        for part in used & set(self.joint):
            joint = self.joint[part]
            turn[part] = quaternion.multiply(world[:, joint], quaternion.inverse(had[:, joint]))
            before[part], after[part] = was[:, joint], places[:, joint]
        turn[WHOLE] = quaternion.multiply(rigid.rotations[:, 0], quaternion.inverse(had[:, 0]))
        before[WHOLE], after[WHOLE] = was[:, 0], rigid.root_positions
        if self.object_goes:
            turn[OBJECT], before[OBJECT], after[OBJECT] = turn[WHOLE], before[WHOLE], after[WHOLE]
        else:
            then, origin = rows.turns("lie", self.lie[0]), rows.numbers("origin", self.lie[1])
            now = then if lies is None else rotations(lies)
            turn[OBJECT] = quaternion.multiply(now, quaternion.inverse(then))
            before[OBJECT], after[OBJECT] = origin, origin if lies is None else lies[:, :3, 3] / self.units
        return Moves(turn, before, after)

    def _source_at(self, rows: Rows) -> tuple[np.ndarray, np.ndarray]:
        """Compute places (N, J, 3) and rotations (N, J, 4) of the source's joints in the world."""
        if rows.whole:
            return self.places[rows.low], self.world[rows.low]
        root, local = at_frames(self.motion, rows.at)
        return forward_kinematics(Motion(self.motion.skeleton, root, local, self.motion.fps))

    def changed(self, moves: Moves, rows: Rows) -> dict[tuple[str, str], np.ndarray]:
        """Compute the channels that differ from the source.

        Args:
            moves: motion of each group.
            rows: source frames of the displayed frames.
        Returns:
            (bone, "turn") -> continuous rotations (N, 4) of its own channels; (bone, "location") -> (N, 3).
        """
        some = [one for one in self.controls if not all(moves.alike(one.own, other) for other in (one.turn, one.place))]
        return (self._turned(some, moves, rows)
                | self._slid([one for one in some if one.slides], moves, rows)) if some else {}

    def _turned(self, some: list[Control], moves: Moves, rows: Rows) -> dict[tuple[str, str], np.ndarray]:
        back, own, pose = rows.remembered(("turns", *some), lambda: self._turns_at(some, rows))
        between = np.stack([moves.between(one.turn, one.own) for one in some], axis=1)
        turned = quaternion.multiply(back, quaternion.multiply(between, pose))
        other = np.abs(np.abs(np.sum(turned * own, axis=2)) - 1.0).max(axis=0) > 1e-14
        turned = quaternion.continuous(turned)
        return {(one.name, "turn"): turned[:, i] for i, one in enumerate(some) if other[i] or one.name in self.held}

    def _turns_at(self, some: list[Control], rows: Rows) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Compute rotations (N, C, 4) of controls: the inverse of their base, their own, and base and own together."""
        base, own = (np.stack([rows.turns((one, what), self.tables[one.name][what]) for one in some], axis=1)
                     for what in ("base", "own"))
        return quaternion.inverse(base), own, quaternion.multiply(base, own)

    def _slid(self, some: list[Control], moves: Moves, rows: Rows) -> dict[tuple[str, str], np.ndarray]:
        """Compute the locations (N, 3) of controls with their own location channel."""
        if not some:
            return {}

        def all_of(what: str) -> np.ndarray:
            """Stack a table of all controls: (N, C, ...)."""
            made = lambda: np.stack([rows.numbers((one, what), self.tables[one.name][what]) for one in some],
                                    axis=1)  # noqa: E731
            return rows.remembered((what, *some), made)

        rests = moves.points([one.place for one in some], all_of("rests"))
        away = moves.points([one.own for one in some], all_of("place")) - rests
        turn = np.stack([moves.turn[one.axes] for one in some], axis=1)
        location = np.einsum("ncij,ncj->nci", all_of("back"), quaternion.rotate(quaternion.inverse(turn), away))
        other = np.abs(location - all_of("location")).max(axis=(0, 2)) > _SAME
        return {(one.name, "location"): location[:, i] for i, one in enumerate(some) if other[i]}


def channel_values(mode: str, turned: np.ndarray, like: np.ndarray) -> np.ndarray:
    """Convert continuous rotations to the values of a bone's rotation channel.

    Args:
        mode: rotation mode of the bone.
        turned: (N, 4) continuous rotations.
        like: (n,) the source's first values, whose sign and full turns are kept.
    Returns:
        (N, n) values.
    """
    values = turned if mode == "QUATERNION" else rotation(mode, turned)
    if mode == "QUATERNION":
        return values if np.sum(values[0] * like) >= 0.0 else -values
    return values if mode == "AXIS_ANGLE" else values + 2.0 * np.pi * np.round((like - values[0]) / (2.0 * np.pi))
