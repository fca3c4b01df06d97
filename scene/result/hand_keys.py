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
from ..path_editing.carrier import original_of

VALUES = "beyond_mocap_values"
FORM = "beyond_mocap_form"
SAME_FRAME = 1e-3

Place = tuple[str, int]


@dataclass(frozen=True, eq=False)
class Made:
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

    def part(self, start: int, end: int) -> "Made":
        """Select the frames start to end, both included."""
        low, high = max(self.first, start), min(self.first + self.count - 1, end)
        cut = slice(low - self.first, high - self.first + 1)
        return Made(low, high - low + 1, self.clock, {place: values[cut] for place, values in self.values.items()})


@dataclass(frozen=True, eq=False)
class Hand:
    """The manual keys of an action.

    Attributes:
        keys: keys by channel, as of `channels.keys_of`.
        missing: by channel, whole frames whose key is missing.
        whole: channels that are kept as they are.
        groups: by channel, name of its group.
    """

    keys: dict[Place, dict[str, np.ndarray]] = field(default_factory=dict)
    gone: dict[Place, np.ndarray] = field(default_factory=dict)
    whole: frozenset[Place] = frozenset()
    groups: dict[Place, str] = field(default_factory=dict)

    def __len__(self) -> int:
        """Count the keys: channels of one property at one frame are one key."""
        marks = {(place[0], round(float(frame), 3)) for place, keys in self.keys.items() for frame in keys["co"][:, 0]}
        marks |= {(place[0], round(float(frame), 3)) for place, frames in self.gone.items() for frame in frames}
        return len(marks)


def note(action: bpy.types.Action, slot, clock: Clock) -> None:
    """Store the generated keys of a new action; all its curves have a key on every frame."""
    values = {place: channels.keys_of(curve)["co"] for place, curve in channels.curves(action, slot).items()}
    first = next(iter(values.values()))
    made = {place: co[:, 1] for place, co in values.items()}
    write(action, Made(int(round(first[0, 0])), len(first), clock.spelled(), made))


def write(action: bpy.types.Action, made: Made) -> None:
    """Write generated keys to an action's properties."""
    places = [list(place) for place in made.values]
    action[FORM] = json.dumps({"first": made.first, "count": made.count, "clock": made.clock, "places": places})
    action[VALUES] = np.concatenate([np.asarray(values, np.float32) for values in made.values.values()])


def read(action: bpy.types.Action) -> Made | None:
    """Read the generated keys of an action; None if it has none, or if they are damaged."""
    try:
        form = json.loads(action[FORM])
        values = np.frombuffer(action[VALUES], np.float32).reshape(len(form["places"]), form["count"]).copy()
    except (KeyError, TypeError, ValueError):
        return None
    made = {(path, index): row for (path, index), row in zip(form["places"], values)}
    return Made(form["first"], form["count"], form["clock"], made)


def joined(parts: list[Made | None]) -> Made | None:
    """Join the generated keys of consecutive actions, each from the last frame of the one before; None if one has
    none.
    """
    if not parts or any(part is None for part in parts):
        return None
    places = parts[0].values
    values = {place: np.concatenate([part.values[place][:-1] for part in parts[:-1]] + [parts[-1].values[place]])
              for place in places}
    return Made(parts[0].first, sum(part.count - 1 for part in parts) + 1, parts[0].clock, values)


def found(action: bpy.types.Action, slot) -> Hand:
    """Find the manual keys of an action with stored generated keys; none without these."""
    made = read(action)
    if made is None:
        return Hand()
    curves = channels.curves(action, slot)
    same_channels = set(made.values) == set(curves)
    if same_channels and all(_as_made(curve, made.values[place], made) for place, curve in curves.items()):
        return Hand()
    tables = {place: channels.keys_of(curve) for place, curve in curves.items()}
    whole = frozenset(place for place, curve in curves.items() if _locked(curve))
    mine = {place: _changed(table, made.values.get(place), made) for place, table in tables.items()}
    mine = {place: np.ones(len(mask), bool) if place in whole else mask for place, mask in mine.items()}
    _together(tables, mine)
    keys = {place: channels.chosen(table, mine[place]) for place, table in tables.items() if mine[place].any()}
    gone = {}
    for place in made.values:
        frames = tables[place]["co"][:, 0] if place in tables else np.empty(0, np.float32)
        missing = _missing(frames, made)
        if len(missing) and place not in whole:
            gone[place] = missing
    groups = {place: curves[place].group.name if curves[place].group is not None else "" for place in keys}
    return Hand(keys, gone, whole, groups)


def put(action: bpy.types.Action, slot, hand: Hand, moved: float = 0.0) -> int:
    """Write manual keys to a new action, shifted by `moved` frames; returns their number."""
    curves = channels.curves(action, slot)
    for place in {*hand.keys, *hand.gone}:
        mine = hand.keys.get(place)
        if mine is not None:
            shift = np.array([moved, 0.0], np.float32)
            mine = {**mine, **{name: mine[name] + shift for name in channels.PLACES}}
        curve = curves.get(place)
        if curve is None:
            if mine is not None:
                channels.put_keys(channels.new_curve(action, slot, *place, hand.groups.get(place, "")), mine)
            continue
        kept = channels.keys_of(curve)
        frames = kept["co"][:, 0]
        out = _near(frames, hand.gone.get(place, np.empty(0)) + moved)
        if mine is not None:
            out |= np.ones(len(frames), bool) if place in hand.whole else _near(frames, mine["co"][:, 0])
        kept = channels.chosen(kept, ~out)
        if mine is not None:
            kept = {name: np.concatenate([kept[name], mine[name]]) for name in kept}
        kept = channels.chosen(kept, np.argsort(kept["co"][:, 0], kind="stable"))
        curve.keyframe_points.clear()
        channels.put_keys(curve, kept)
        if place in hand.whole:
            curve.lock = True
    return len(hand)


def of_strips(track: bpy.types.NlaTrack) -> Hand:
    """Find the manual keys of all strips of a track."""
    keys, gone, whole, groups = {}, {}, set(), {}
    for strip in track.strips:
        part = found(strip.action, strip.action_slot)
        made = read(strip.action)
        if made is None:
            continue
        ends = (made.first - SAME_FRAME, made.first + made.count - 1 + SAME_FRAME)
        for place, table in part.keys.items():
            inside = (table["co"][:, 0] > ends[0]) & (table["co"][:, 0] < ends[1])
            table = channels.chosen(table, inside)
            keys[place] = _merged(keys.get(place), table)
        for place, frames in part.gone.items():
            gone[place] = np.union1d(gone.get(place, np.empty(0)), frames)
        whole |= part.whole
        groups.update(part.groups)
    return Hand({place: table for place, table in keys.items() if len(table["co"])}, gone, frozenset(whole), groups)


def of_body(body: bpy.types.Object) -> tuple[Hand, str]:
    """Find the manual keys of a body's action or strips, and the clock of these."""
    action, slot = original_of(body)
    made = read(action) if action is not None else None
    if made is not None:
        return found(action, slot), made.clock
    tracks = body.animation_data.nla_tracks if body.animation_data is not None else ()
    for track in tracks:
        memories = [read(strip.action) for strip in track.strips if strip.action is not None]
        if memories and all(memory is not None for memory in memories):
            return of_strips(track), memories[0].clock
    return Hand(), ""


def shift_between(before: str, now: Clock) -> float | None:
    """Compute the frames by which keys of the clock `before` (as text) have to move; None if the frame rates differ."""
    old = Clock.read(before)
    if old is None or abs(old.fps - now.fps) > 1e-6:
        return None
    return round(now.frame(old.seconds(0.0)), 4)


def _as_made(curve: bpy.types.FCurve, values: np.ndarray, made: Made) -> bool:
    """Return whether a channel is unchanged: the usual case, decided without reading all data of the keys."""
    points = curve.keyframe_points
    if len(points) != made.count or _locked(curve):
        return False
    co, figures = np.empty(2 * made.count, np.float32), np.empty(made.count, np.int32)
    points.foreach_get("co", co)
    frames = np.arange(made.first, made.first + made.count)
    if not np.array_equal(co[1::2], values) or np.any(np.abs(co[::2] - frames) > SAME_FRAME):
        return False
    points.foreach_get("type", figures)
    if np.any(figures != channels.GENERATED):
        return False
    points.foreach_get("interpolation", figures)
    return bool(np.all(figures == channels.LINEAR))


def _locked(curve: bpy.types.FCurve) -> bool:
    return curve.lock or (curve.group is not None and curve.group.lock)


def _changed(keys: dict, values: np.ndarray | None, made: Made) -> np.ndarray:
    """Compare keys with generated ones: (n,) bool; keys beyond the generated frames do not count."""
    frames = keys["co"][:, 0]
    if values is None:
        return np.ones(len(frames), bool)
    at = np.round(frames).astype(int) - made.first
    inside = (at >= 0) & (at < made.count)
    same = np.zeros(len(frames), bool)
    same[inside] = values[at[inside]] == keys["co"][inside, 1]
    same &= np.abs(frames - np.round(frames)) < SAME_FRAME
    same &= (keys["interpolation"] == channels.LINEAR) & (keys["type"] == channels.GENERATED)
    beyond = ~inside & (keys["type"] == channels.GENERATED)  # a strip's action has a key or two of its neighbours
    return ~same & ~beyond


def _together(tables: dict, mine: dict) -> None:
    """Extend manual keys of one quaternion channel to its other channels at the same frame."""
    for path in {path for path, _ in tables if path.endswith("rotation_quaternion")}:
        places = [place for place in tables if place[0] == path]
        frames = np.concatenate([tables[place]["co"][mine[place], 0] for place in places])
        for place in places:
            mine[place] = mine[place] | _near(tables[place]["co"][:, 0], frames)


def _missing(frames: np.ndarray, made: Made) -> np.ndarray:
    """Find the whole frames whose generated key is missing."""
    all_frames = np.arange(made.first, made.first + made.count)
    at = np.round(frames).astype(int)
    return all_frames[~np.isin(all_frames, at[np.abs(frames - at) < SAME_FRAME])].astype(float)


def _near(frames: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Find which frames are among others, to a thousandth: (n,) bool."""
    if not len(others):
        return np.zeros(len(frames), bool)
    others = np.sort(others)
    at = np.clip(np.searchsorted(others, frames), 1, len(others)) - 1
    after = np.minimum(at + 1, len(others) - 1)
    return np.minimum(np.abs(frames - others[at]), np.abs(frames - others[after])) < SAME_FRAME


def _merged(before: dict | None, after: dict) -> dict:
    if before is None:
        return after
    before = channels.chosen(before, ~_near(before["co"][:, 0], after["co"][:, 0]))
    both = {name: np.concatenate([before[name], after[name]]) for name in after}
    return channels.chosen(both, np.argsort(both["co"][:, 0], kind="stable"))
