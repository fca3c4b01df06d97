"""The keys of a path edit, written in place: only channels that differ are written, all others keep the original's
keys.

What was written is stored with the action's digest, so that undo, which restores action and digest together, is
recognized without reading the keys.
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
    """What an action of ours holds.

    Attributes:
        digest: of its inputs.
        first: its first frame.
        written: (N,) values of the channels written; all others are the original's.
        tables: the original's channels sampled on whole frames, and whether they are stepped.
    """

    digest: str = ""
    first: int = 0
    written: dict[Place, np.ndarray] = field(default_factory=dict)
    tables: dict[Place, tuple[np.ndarray, bool]] = field(default_factory=dict)


_laid: dict[int, _Laid] = {}  # by session_uid of the action


def forget() -> None:
    """Clear the cache when another file is opened."""
    _laid.clear()


def refresh() -> None:
    """Mark the originals as possibly changed: their channels are read again, and written channels are not trusted."""
    for known in _laid.values():
        known.digest, known.tables = "", {}


def places(curve: bpy.types.FCurve) -> np.ndarray:
    """Read the frames and values of a curve's keys: (2 n,)."""
    values = np.empty(2 * len(curve.keyframe_points), np.float32)
    curve.keyframe_points.foreach_get("co", values)
    return values


def columns(path: str, values: np.ndarray) -> dict[Place, np.ndarray]:
    """Split values (N, n) of a property into channels."""
    return {(path, index): column for index, column in enumerate(np.ascontiguousarray(values.T))}


def begin(made: bpy.types.Action, identifier: str, mark: str) -> None:
    """Turn a copy of an original into an action of ours with `mark`: other slots and stored properties are removed."""
    for slot in [slot for slot in made.slots if slot.identifier != identifier]:
        made.slots.remove(slot)
    for name in [name for name in made.keys() if name.startswith("beyond_mocap")]:
        del made[name]
    made.property_unset("beyond_mocap")
    made[mark] = "begun"
    _laid[made.session_uid] = _Laid("begun")


@dataclass(frozen=True, eq=False)
class Sheet:
    """An action of ours and its original while they are written; curves by (path, index)."""

    made: bpy.types.Action
    slot: object
    curves: dict[Place, bpy.types.FCurve]
    sources: dict[Place, bpy.types.FCurve]

    @classmethod
    def of(cls, made, slot, original, original_slot) -> Sheet:
        """Build the sheet of two actions and their slots."""
        return cls(made, slot, channels.curves(made, slot), channels.curves(original, original_slot))

    def added(self, path: str) -> bool:
        """Return whether a property has curves here that the original does not have."""
        return any((path, index) in self.curves and (path, index) not in self.sources for index in range(4))


def lay(sheet: Sheet, first: int, wanted: dict[Place, np.ndarray], now: str, digest: str) -> None:
    """Write the target values to their channels on whole frames, and the original's keys to all others.

    Args:
        sheet: the actions.
        first: scene frame of the first value.
        targets: (N,) values by channel.
        now: digest that the action has.
        digest: digest that the action gets.
    """
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
    """Sample the original's channels at fractional frames; channels with whole numbers only, such as switches, stay
    stepped.

    Args:
        sheet: the actions.
        places: the channels.
        whole: (T,) whole scene frames.
        shown: (N,) scene frames.
    Returns:
        (N,) values by channel.
    """
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
    """Remove the muted modifiers of the original from written channels: their effect is in the keys."""
    for curve in sheet.curves.values():
        for modifier in [modifier for modifier in curve.modifiers if modifier.mute]:
            curve.modifiers.remove(modifier)


def rotation(mode: str, pose: np.ndarray) -> np.ndarray:
    """Convert rotations (N, 4) to the values (N, n) of a bone's rotation mode, without jumps."""
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
    """Remove the jumps of Euler angles (N, 3): each rotation is (a, b, c) or (a + pi, pi - b, c + pi)."""
    other = np.stack([turns[:, 0] + np.pi, np.pi - turns[:, 1], turns[:, 2] + np.pi], axis=1)
    stay = np.abs(quaternion.wrapped(turns[1:] - turns[:-1])).sum(axis=1)
    swap = np.abs(quaternion.wrapped(other[1:] - turns[:-1])).sum(axis=1)
    swapped = np.concatenate([[0], np.cumsum(swap < stay)]) % 2 == 1
    return np.unwrap(np.where(swapped[:, None], other, turns), axis=0)


def _restore(sheet: Sheet, place: Place) -> None:
    """Restore one channel from the original."""
    source, curve = sheet.sources[place], _curve(sheet, place)
    curve.keyframe_points.clear()
    channels.put_keys(curve, channels.keys_of(source))
    for modifier, own in zip(curve.modifiers, source.modifiers):
        modifier.mute = own.mute


def _write(sheet: Sheet, place: Place, keys: np.ndarray, fresh: bool) -> None:
    """Write keys (N, 2) of one channel; fresh: the previous keys may be anything."""
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

