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
class _WrittenKeys:
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


_written: dict[int, _WrittenKeys] = {}  # by session_uid of the action


def clear_cache() -> None:
    """Clear the cache when another file is opened."""
    _written.clear()


def invalidate_cache() -> None:
    """Mark the originals as possibly changed: their channels are read again, and written channels are not trusted."""
    for known in _written.values():
        known.digest, known.tables = "", {}


def read_keys(curve: bpy.types.FCurve) -> np.ndarray:
    """Read the frames and values of a curve's keys: (2 n,)."""
    values = np.empty(2 * len(curve.keyframe_points), np.float32)
    curve.keyframe_points.foreach_get("co", values)
    return values


def split_channels(path: str, values: np.ndarray) -> dict[Place, np.ndarray]:
    """Split values (N, n) of a property into channels."""
    return {(path, index): column for index, column in enumerate(np.ascontiguousarray(values.T))}


def prepare_action(action: bpy.types.Action, identifier: str, mark: str) -> None:
    """Turn a copy of an original into an action of ours with `mark`: other slots and stored properties are removed."""
    for slot in [slot for slot in action.slots if slot.identifier != identifier]:
        action.slots.remove(slot)
    for name in [name for name in action.keys() if name.startswith("beyond_mocap")]:
        del action[name]
    action.property_unset("beyond_mocap")
    action[mark] = "begun"
    _written[action.session_uid] = _WrittenKeys("begun")


@dataclass(frozen=True, eq=False)
class ActionPair:
    """An action of ours and its original while they are written; curves by (path, index)."""

    action: bpy.types.Action
    slot: object
    curves: dict[Place, bpy.types.FCurve]
    sources: dict[Place, bpy.types.FCurve]

    @classmethod
    def from_actions(cls, action, slot, original, original_slot) -> ActionPair:
        """Build the sheet of two actions and their slots."""
        return cls(action, slot, channels.collect_curves(action, slot),
                   channels.collect_curves(original, original_slot))

    def has_added(self, path: str) -> bool:
        """Return whether a property has curves here that the original does not have."""
        return any((path, index) in self.curves and (path, index) not in self.sources for index in range(4))


def write_channels(sheet: ActionPair, first: int, targets: dict[Place, np.ndarray], now: str, digest: str) -> None:
    """Write the target values to their channels on whole frames, and the original's keys to all others.

    Args:
        sheet: the actions.
        first: scene frame of the first value.
        targets: (N,) values by channel.
        now: digest that the action has.
        digest: digest that the action gets.
    """
    known = _written.setdefault(sheet.action.session_uid, _WrittenKeys())
    sure = bool(known.digest) and known.digest == now
    known.digest = ""
    previous = known.written if sure else {}
    for place in (previous if sure else sheet.curves):
        if place not in targets and place in sheet.sources:
            _restore_channel(sheet, place)
    count = len(next(iter(targets.values()), ()))
    keys = np.empty((count, 2), np.float32)
    keys[:, 0] = first + np.arange(count)
    for place, values in targets.items():
        before = previous.get(place)
        if before is not None and first == known.first and np.array_equal(before, values):
            continue
        keys[:, 1] = values
        _write_keys(sheet, place, keys, fresh=before is None)
    known.written, known.first, known.digest = targets, first, digest


def sample_channels(sheet: ActionPair, places: list[Place], whole: np.ndarray, frames: np.ndarray) -> dict[Place,
        np.ndarray]:
    """Sample the original's channels at fractional frames; channels with whole numbers only, such as switches, stay
    stepped.

    Args:
        sheet: the actions.
        places: the channels.
        whole: (T,) whole scene frames.
        frames: (N,) scene frames.
    Returns:
        (N,) values by channel.
    """
    known = _written.setdefault(sheet.action.session_uid, _WrittenKeys())
    found = {}
    for place in places:
        if len(known.tables.get(place, ((),))[0]) != len(whole):
            table = channels.sample_curve(sheet.sources[place], whole)
            known.tables[place] = table, bool(np.all(table == np.round(table)))
        table, steps = known.tables[place]
        found[place] = np.interp(np.floor(frames + 1e-6) if steps else frames, whole, table)
    return found


def remove_muted_modifiers(sheet: ActionPair) -> None:
    """Remove the muted modifiers of the original from written channels: their effect is in the keys."""
    for curve in sheet.curves.values():
        for modifier in [modifier for modifier in curve.modifiers if modifier.mute]:
            curve.modifiers.remove(modifier)


def to_rotation_channel(mode: str, pose: np.ndarray) -> np.ndarray:
    """Convert rotations (N, 4) to the values (N, n) of a bone's rotation mode, without jumps."""
    if mode == "QUATERNION":
        return quaternion.unify_signs(pose)
    if mode == "AXIS_ANGLE":
        pose = quaternion.unify_signs(pose)
        half = np.linalg.norm(pose[:, 1:], axis=1)
        axis = np.where(half[:, None] > 1e-9, pose[:, 1:] / np.maximum(half, 1e-9)[:, None], [0.0, 1.0, 0.0])
        return np.column_stack([2.0 * np.arctan2(half, pose[:, 0]), axis])
    order = mode[::-1]  # as in `action`: Blender names the axes in the order in which they are applied
    angles = _unwrap_angles(quaternion.to_euler(pose, order))
    return angles[:, [order.index(letter) for letter in "XYZ"]]


def _unwrap_angles(angles: np.ndarray) -> np.ndarray:
    """Remove the jumps of Euler angles (N, 3): each rotation is (a, b, c) or (a + pi, pi - b, c + pi)."""
    other = np.stack([angles[:, 0] + np.pi, np.pi - angles[:, 1], angles[:, 2] + np.pi], axis=1)
    stay = np.abs(quaternion.wrap_angle(angles[1:] - angles[:-1])).sum(axis=1)
    swap = np.abs(quaternion.wrap_angle(other[1:] - angles[:-1])).sum(axis=1)
    swapped = np.concatenate([[0], np.cumsum(swap < stay)]) % 2 == 1
    return np.unwrap(np.where(swapped[:, None], other, angles), axis=0)


def _restore_channel(sheet: ActionPair, place: Place) -> None:
    """Restore one channel from the original."""
    source, curve = sheet.sources[place], _find_or_create_curve(sheet, place)
    curve.keyframe_points.clear()
    channels.write_keys(curve, channels.read_keys(source))
    for modifier, own in zip(curve.modifiers, source.modifiers):
        modifier.mute = own.mute


def _write_keys(sheet: ActionPair, place: Place, keys: np.ndarray, fresh: bool) -> None:
    """Write keys (N, 2) of one channel; fresh: the previous keys may be anything."""
    curve = _find_or_create_curve(sheet, place)
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


def _find_or_create_curve(sheet: ActionPair, place: Place) -> bpy.types.FCurve:
    if place not in sheet.curves:
        like = next((curve for (path, _), curve in sheet.sources.items() if path == place[0] and curve.group), None)
        bone = place[0].split('"')[1] if place[0].startswith("pose.bones") else ""
        group = like.group.name if like is not None else bone
        sheet.curves[place] = channels.add_curve(sheet.action, sheet.slot, *place, group)
    return sheet.curves[place]

