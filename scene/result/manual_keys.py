"""Manual keys: keys that a user set, moved, changed or deleted on a take's action; detected, and kept when it is
updated.

An action of the extension stores its generated values, as an array of floats that Blender saves and undoes with it.
Every difference from that is the user's: keys with another value, time or interpolation, channels that had none, and
frames whose key is missing. A key's type alone would not do, since keying a pose over a generated key leaves its type;
but a key with a changed type (R in the dope sheet) counts too, which marks a key as manual without moving it. Of a
bone's quaternion all four channels are kept if one was changed. A locked channel is kept as a whole.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field

import bpy
import numpy as np

from ..core import channels
from ..core.measure import Clock
from ..path_editing.armature_adapter import find_original

VALUES = "beyond_mocap_values"
FORM = "beyond_mocap_form"
SAME_FRAME = 1e-3

Place = tuple[str, int]


@dataclass(frozen=True, eq=False)
class GeneratedKeys:
    """The generated keys of an action: values of each channel on `count` whole frames from `first` on.

    Attributes:
        first: scene frame.
        count: frames.
        clock: of the frames, as text.
        values: (count,) by channel.
    """

    first: int
    count: int
    clock: str
    values: dict[Place, np.ndarray]

    def select_frames(self, start: int, end: int) -> "GeneratedKeys":
        """Select the frames start to end, both included."""
        low, high = max(self.first, start), min(self.first + self.count - 1, end)
        cut = slice(low - self.first, high - self.first + 1)
        return GeneratedKeys(low, high - low + 1, self.clock,
                             {place: values[cut] for place, values in self.values.items()})


@dataclass(frozen=True, eq=False)
class ManualKeys:
    """The manual keys of an action.

    Attributes:
        keys: keys by channel, as `channels.read_keys` returns them.
        missing: by channel, whole frames whose key is missing.
        whole: channels that are kept as they are.
        groups: by channel, name of its group.
    """

    keys: dict[Place, dict[str, np.ndarray]] = field(default_factory=dict)
    missing: dict[Place, np.ndarray] = field(default_factory=dict)
    whole: frozenset[Place] = frozenset()
    groups: dict[Place, str] = field(default_factory=dict)

    def __len__(self) -> int:
        """Count the keys: channels of one property at one frame are one key."""
        marks = {(place[0], round(float(frame), 3)) for place, keys in self.keys.items() for frame in keys["co"][:, 0]}
        marks |= {(place[0], round(float(frame), 3)) for place, frames in self.missing.items() for frame in frames}
        return len(marks)


def store_generated(action: bpy.types.Action, slot, clock: Clock) -> None:
    """Store the generated keys of a new action; all its curves have a key on every frame."""
    values = {place: channels.read_keys(curve)["co"] for place, curve in channels.collect_curves(action, slot).items()}
    first = next(iter(values.values()))
    values_only = {place: co[:, 1] for place, co in values.items()}
    write_generated(action, GeneratedKeys(int(round(first[0, 0])), len(first), clock.to_text(), values_only))


def write_generated(action: bpy.types.Action, generated: GeneratedKeys) -> None:
    """Write generated keys to an action's properties."""
    places = [list(place) for place in generated.values]
    action[FORM] = json.dumps({"first": generated.first, "count": generated.count, "clock": generated.clock,
                               "places": places})
    action[VALUES] = np.concatenate([np.asarray(values, np.float32) for values in generated.values.values()])


def read_generated(action: bpy.types.Action) -> GeneratedKeys | None:
    """Read the generated keys of an action; None if it has none, or if they are damaged."""
    try:
        form = json.loads(action[FORM])
        values = np.frombuffer(action[VALUES], np.float32).reshape(len(form["places"]), form["count"]).copy()
    except (KeyError, TypeError, ValueError):
        return None
    values_by_channel = {(path, index): row for (path, index), row in zip(form["places"], values)}
    return GeneratedKeys(form["first"], form["count"], form["clock"], values_by_channel)


def join_generated(parts: list[GeneratedKeys | None]) -> GeneratedKeys | None:
    """Join the generated keys of consecutive actions, each from the last frame of the one before; None if one has
    none.
    """
    if not parts or any(part is None for part in parts):
        return None
    places = parts[0].values
    values = {place: np.concatenate([part.values[place][:-1] for part in parts[:-1]] + [parts[-1].values[place]])
              for place in places}
    return GeneratedKeys(parts[0].first, sum(part.count - 1 for part in parts) + 1, parts[0].clock, values)


def find_manual_keys(action: bpy.types.Action, slot) -> ManualKeys:
    """Find the manual keys of an action with stored generated keys; none without these."""
    generated = read_generated(action)
    if generated is None:
        return ManualKeys()
    curves = channels.collect_curves(action, slot)
    same_channels = set(generated.values) == set(curves)
    if same_channels and all(_is_unchanged(curve, generated.values[place], generated) for place,
                             curve in curves.items()):
        return ManualKeys()
    tables = {place: channels.read_keys(curve) for place, curve in curves.items()}
    whole = frozenset(place for place, curve in curves.items() if _is_locked(curve))
    is_manual = {place: _find_changed_keys(table, generated.values.get(place), generated) for place,
                 table in tables.items()}
    is_manual = {place: np.ones(len(mask), bool) if place in whole else mask for place, mask in is_manual.items()}
    _extend_to_quaternions(tables, is_manual)
    keys = {place: channels.select_keys(table, is_manual[place]) for place, table in tables.items()
            if is_manual[place].any()}
    missing_frames = {}
    for place in generated.values:
        frames = tables[place]["co"][:, 0] if place in tables else np.empty(0, np.float32)
        missing = _find_missing(frames, generated)
        if len(missing) and place not in whole:
            missing_frames[place] = missing
    groups = {place: curves[place].group.name if curves[place].group is not None else "" for place in keys}
    return ManualKeys(keys, missing_frames, whole, groups)


def write_manual_keys(action: bpy.types.Action, slot, manual: ManualKeys, frame_shift: float = 0.0) -> int:
    """Write manual keys to a new action, shifted by `moved` frames; returns their number."""
    curves = channels.collect_curves(action, slot)
    for place in {*manual.keys, *manual.missing}:
        keys = manual.keys.get(place)
        if keys is not None:
            shift = np.array([frame_shift, 0.0], np.float32)
            keys = {**keys, **{name: keys[name] + shift for name in channels.PLACES}}
        curve = curves.get(place)
        if curve is None:
            if keys is not None:
                channels.write_keys(channels.add_curve(action, slot, *place, manual.groups.get(place, "")), keys)
            continue
        remaining = channels.read_keys(curve)
        frames = remaining["co"][:, 0]
        out = _is_near(frames, manual.missing.get(place, np.empty(0)) + frame_shift)
        if keys is not None:
            out |= np.ones(len(frames), bool) if place in manual.whole else _is_near(frames, keys["co"][:, 0])
        remaining = channels.select_keys(remaining, ~out)
        if keys is not None:
            remaining = {name: np.concatenate([remaining[name], keys[name]]) for name in remaining}
        remaining = channels.select_keys(remaining, np.argsort(remaining["co"][:, 0], kind="stable"))
        curve.keyframe_points.clear()
        channels.write_keys(curve, remaining)
        if place in manual.whole:
            curve.lock = True
    return len(manual)


def find_in_strips(track: bpy.types.NlaTrack) -> ManualKeys:
    """Find the manual keys of all strips of a track."""
    keys, missing, whole, groups = {}, {}, set(), {}
    for strip in track.strips:
        part = find_manual_keys(strip.action, strip.action_slot)
        generated = read_generated(strip.action)
        if generated is None:
            continue
        ends = (generated.first - SAME_FRAME, generated.first + generated.count - 1 + SAME_FRAME)
        for place, table in part.keys.items():
            inside = (table["co"][:, 0] > ends[0]) & (table["co"][:, 0] < ends[1])
            table = channels.select_keys(table, inside)
            keys[place] = _merge_keys(keys.get(place), table)
        for place, frames in part.missing.items():
            missing[place] = np.union1d(missing.get(place, np.empty(0)), frames)
        whole |= part.whole
        groups.update(part.groups)
    return ManualKeys({place: table for place, table in keys.items() if len(table["co"])}, missing, frozenset(whole),
                      groups)


def find_in_body(body: bpy.types.Object) -> tuple[ManualKeys, str]:
    """Find the manual keys of a body's action or strips, and the clock of these."""
    action, slot = find_original(body)
    generated = read_generated(action) if action is not None else None
    if generated is not None:
        return find_manual_keys(action, slot), generated.clock
    tracks = body.animation_data.nla_tracks if body.animation_data is not None else ()
    for track in tracks:
        memories = [read_generated(strip.action) for strip in track.strips if strip.action is not None]
        if memories and all(memory is not None for memory in memories):
            return find_in_strips(track), memories[0].clock
    return ManualKeys(), ""


def compute_shift(before: str, now: Clock) -> float | None:
    """Compute the frames by which keys of the clock `before` (as text) have to move; None if the frame rates differ."""
    old = Clock.from_text(before)
    if old is None or abs(old.fps - now.fps) > 1e-6:
        return None
    return round(now.to_frame(old.to_seconds(0.0)), 4)


def _is_unchanged(curve: bpy.types.FCurve, values: np.ndarray, generated: GeneratedKeys) -> bool:
    """Return whether a channel is unchanged: the usual case, decided without reading all data of the keys."""
    points = curve.keyframe_points
    if len(points) != generated.count or _is_locked(curve):
        return False
    co, figures = np.empty(2 * generated.count, np.float32), np.empty(generated.count, np.int32)
    points.foreach_get("co", co)
    frames = np.arange(generated.first, generated.first + generated.count)
    if not np.array_equal(co[1::2], values) or np.any(np.abs(co[::2] - frames) > SAME_FRAME):
        return False
    points.foreach_get("type", figures)
    if np.any(figures != channels.GENERATED):
        return False
    points.foreach_get("interpolation", figures)
    return bool(np.all(figures == channels.LINEAR))


def _is_locked(curve: bpy.types.FCurve) -> bool:
    return curve.lock or (curve.group is not None and curve.group.lock)


def _find_changed_keys(keys: dict, values: np.ndarray | None, generated: GeneratedKeys) -> np.ndarray:
    """Compare keys with generated ones: (n,) bool; keys beyond the generated frames do not count."""
    frames = keys["co"][:, 0]
    if values is None:
        return np.ones(len(frames), bool)
    at = np.round(frames).astype(int) - generated.first
    inside = (at >= 0) & (at < generated.count)
    same = np.zeros(len(frames), bool)
    same[inside] = values[at[inside]] == keys["co"][inside, 1]
    same &= np.abs(frames - np.round(frames)) < SAME_FRAME
    same &= (keys["interpolation"] == channels.LINEAR) & (keys["type"] == channels.GENERATED)
    beyond = ~inside & (keys["type"] == channels.GENERATED)  # a strip's action has a key or two of its neighbours
    return ~same & ~beyond


def _extend_to_quaternions(tables: dict, is_manual: dict) -> None:
    """Extend manual keys of one quaternion channel to its other channels at the same frame."""
    for path in {path for path, _ in tables if path.endswith("rotation_quaternion")}:
        places = [place for place in tables if place[0] == path]
        frames = np.concatenate([tables[place]["co"][is_manual[place], 0] for place in places])
        for place in places:
            is_manual[place] = is_manual[place] | _is_near(tables[place]["co"][:, 0], frames)


def _find_missing(frames: np.ndarray, generated: GeneratedKeys) -> np.ndarray:
    """Find the whole frames whose generated key is missing."""
    all_frames = np.arange(generated.first, generated.first + generated.count)
    at = np.round(frames).astype(int)
    return all_frames[~np.isin(all_frames, at[np.abs(frames - at) < SAME_FRAME])].astype(float)


def _is_near(frames: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Find which frames are among others, to a thousandth: (n,) bool."""
    if not len(others):
        return np.zeros(len(frames), bool)
    others = np.sort(others)
    at = np.clip(np.searchsorted(others, frames), 1, len(others)) - 1
    after = np.minimum(at + 1, len(others) - 1)
    return np.minimum(np.abs(frames - others[at]), np.abs(frames - others[after])) < SAME_FRAME


def _merge_keys(before: dict | None, after: dict) -> dict:
    if before is None:
        return after
    before = channels.select_keys(before, ~_is_near(before["co"][:, 0], after["co"][:, 0]))
    both = {name: np.concatenate([before[name], after[name]]) for name in after}
    return channels.select_keys(both, np.argsort(both["co"][:, 0], kind="stable"))
