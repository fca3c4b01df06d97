"""A rider's keys, in place: only channels that are other than they were are written, all others stay as the original's.

What of an action stands as in the original and what was written is remembered by the action's digest, so that undo,
which brings back action and digest together, is known without looking at the keys.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy
import numpy as np

from ...beyond_mocap.motion import quaternion
from ..core import channels

Place = tuple[str, int]


@dataclass
class _Laid:
    """What an action of ours holds: digest of what it was made of; first frame and values (N,) of the channels that are
    written, all others are the original's; the original's channels sampled on whole frames, and whether in steps."""

    digest: str = ""
    first: int = 0
    written: dict[Place, np.ndarray] = field(default_factory=dict)
    tables: dict[Place, tuple[np.ndarray, bool]] = field(default_factory=dict)


_laid: dict[int, _Laid] = {}  # by session_uid of the action


def forget() -> None:
    """Nothing is remembered any more: another file is open."""
    _laid.clear()


def refresh() -> None:
    """The originals may have changed: their channels are read again, and what was written is not relied on."""
    for known in _laid.values():
        known.digest, known.tables = "", {}


def places(curve: bpy.types.FCurve) -> np.ndarray:
    """Frames and values of a curve's keys: (2 n,)."""
    values = np.empty(2 * len(curve.keyframe_points), np.float32)
    curve.keyframe_points.foreach_get("co", values)
    return values


def columns(path: str, values: np.ndarray) -> dict[Place, np.ndarray]:
    """Values (N, n) of a property, one channel each."""
    return {(path, index): column for index, column in enumerate(np.ascontiguousarray(values.T))}


def begin(made: bpy.types.Action, identifier: str, mark: str) -> None:
    """Let a copy of an original be ours, which carries `mark`: other slots and what we kept with the original go."""
    for slot in [slot for slot in made.slots if slot.identifier != identifier]:
        made.slots.remove(slot)
    for name in [name for name in made.keys() if name.startswith("beyond_mocap")]:
        del made[name]
    made.property_unset("beyond_mocap")
    made[mark] = "begun"
    _laid[made.session_uid] = _Laid("begun")


@dataclass(frozen=True, eq=False)
class Sheet:
    """An action of ours and the original that it stands for, while they are written: curves by (path, index)."""

    made: bpy.types.Action
    slot: object
    curves: dict[Place, bpy.types.FCurve]
    sources: dict[Place, bpy.types.FCurve]

    @classmethod
    def of(cls, made, slot, original, original_slot) -> Sheet:
        """The sheet of two actions and their slots."""
        return cls(made, slot, channels.curves(made, slot), channels.curves(original, original_slot))

    def added(self, path: str) -> bool:
        """Whether a property has curves here that it does not have in the original."""
        return any((path, index) in self.curves and (path, index) not in self.sources for index in range(4))


def lay(sheet: Sheet, first: int, wanted: dict[Place, np.ndarray], now: str, digest: str) -> None:
    """Let the channels hold the wanted values (N,) on whole frames from `first` on, and all others what the original
    has.

    now: the digest that the action carries; digest: the one that it will carry."""
    known = _laid.setdefault(sheet.made.session_uid, _Laid())
    sure = bool(known.digest) and known.digest == now
    known.digest = ""
    held = known.written if sure else {}
    for place in (held if sure else sheet.curves):
        if place not in wanted and place in sheet.sources:
            _restore(sheet, place)
    count = len(next(iter(wanted.values()), ()))
    keys = np.empty((count, 2), np.float32)
    keys[:, 0] = first + np.arange(count)
    for place, values in wanted.items():
        before = held.get(place)
        if before is not None and first == known.first and np.array_equal(before, values):
            continue
        keys[:, 1] = values
        _write(sheet, place, keys, fresh=before is None)
    known.written, known.first, known.digest = wanted, first, digest


def sampled(sheet: Sheet, places: list[Place], whole: np.ndarray, shown: np.ndarray) -> dict[Place, np.ndarray]:
    """The original's channels at frames `shown` (N,), between whole frames (T,): (N,) each. Channels that know whole
    numbers only, as switches do, stay at those."""
    known = _laid.setdefault(sheet.made.session_uid, _Laid())
    found = {}
    for place in places:
        if len(known.tables.get(place, ((),))[0]) != len(whole):
            table = channels.sample(sheet.sources[place], whole)
            known.tables[place] = table, bool(np.all(table == np.round(table)))
        table, steps = known.tables[place]
        found[place] = np.interp(np.floor(shown + 1e-6) if steps else shown, whole, table)
    return found


def settle(sheet: Sheet) -> None:
    """Written channels need the original's modifiers no more: they are in the keys."""
    for curve in sheet.curves.values():
        for modifier in [modifier for modifier in curve.modifiers if modifier.mute]:
            curve.modifiers.remove(modifier)


def rotation(mode: str, pose: np.ndarray) -> np.ndarray:
    """Rotations (N, 4) as the values (N, n) of a bone's rotation mode, without jumps."""
    if mode == "QUATERNION":
        return quaternion.continuous(pose)
    if mode == "AXIS_ANGLE":
        pose = quaternion.continuous(pose)
        half = np.linalg.norm(pose[:, 1:], axis=1)
        axis = np.where(half[:, None] > 1e-9, pose[:, 1:] / np.maximum(half, 1e-9)[:, None], [0.0, 1.0, 0.0])
        return np.column_stack([2.0 * np.arctan2(half, pose[:, 0]), axis])
    order = mode[::-1]  # as in `action`: Blender names the axes in the order in which they are applied
    turns = _continuous(quaternion.to_euler(pose, order))
    return turns[:, [order.index(letter) for letter in "XYZ"]]


def _continuous(turns: np.ndarray) -> np.ndarray:
    """Euler angles (N, 3) without jumps: of each rotation (a, b, c) or (a + pi, pi - b, c + pi)."""
    other = np.stack([turns[:, 0] + np.pi, np.pi - turns[:, 1], turns[:, 2] + np.pi], axis=1)
    stay = np.abs(quaternion.wrapped(turns[1:] - turns[:-1])).sum(axis=1)
    swap = np.abs(quaternion.wrapped(other[1:] - turns[:-1])).sum(axis=1)
    swapped = np.concatenate([[0], np.cumsum(swap < stay)]) % 2 == 1
    return np.unwrap(np.where(swapped[:, None], other, turns), axis=0)


def _restore(sheet: Sheet, place: Place) -> None:
    """One channel as in the original."""
    source, curve = sheet.sources[place], _curve(sheet, place)
    curve.keyframe_points.clear()
    channels.put_keys(curve, channels.keys_of(source))
    for modifier, own in zip(curve.modifiers, source.modifiers):
        modifier.mute = own.mute


def _write(sheet: Sheet, place: Place, keys: np.ndarray, fresh: bool) -> None:
    """Keys (N, 2) of one channel; fresh: what stands there may be anything."""
    curve = _curve(sheet, place)
    points = curve.keyframe_points
    if len(points) != len(keys):
        points.clear()
        points.add(len(keys))
        fresh = True
    points.foreach_set("co", keys.ravel())
    if fresh:
        points.foreach_set("interpolation", np.full(len(keys), channels.LINEAR, np.int32))
        for modifier in curve.modifiers:
            modifier.mute = True
    curve.update()


def _curve(sheet: Sheet, place: Place) -> bpy.types.FCurve:
    if place not in sheet.curves:
        like = next((curve for (path, _), curve in sheet.sources.items() if path == place[0] and curve.group), None)
        bone = place[0].split('"')[1] if place[0].startswith("pose.bones") else ""
        group = like.group.name if like is not None else bone
        sheet.curves[place] = channels.new_curve(sheet.made, sheet.slot, *place, group)
    return sheet.curves[place]

