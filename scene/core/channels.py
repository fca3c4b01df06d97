"""Animation curves in bulk: the only module that handles slots, layers, strips and channelbags.

Values are read and written with `foreach_get` and `foreach_set` only: 72,000 keys take about 0.04 s that way, and many
seconds key by key.
"""

from __future__ import annotations

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError

LINEAR = 1  # Keyframe.interpolation as foreach_set takes it
GENERATED = 5  # Keyframe.type likewise: drawn dimmed in the editors
_FEW_KEYS = 40  # of a curve with thousands: up to so many are written faster one by one

PLACES = ("co", "handle_left", "handle_right")
FIGURES = {  # other properties of a key, with the type that foreach_get returns
    "interpolation": np.int32, "easing": np.int32, "type": np.int32, "handle_left_type": np.int32,
    "handle_right_type": np.int32, "amplitude": np.float32, "back": np.float32, "period": np.float32,
}


def create_action(target: bpy.types.Object, name: str, frames: np.ndarray, channels: dict[str, tuple[str, np.ndarray]],
                  generated: bool = False):
    """Create a new action and assign it to an object; the earlier action stays in the file.

    Args:
        target: the object.
        name: of the action.
        frames: (F,) scene frames, increasing.
        channels: data path -> (name of the curves' group, values (F, n), or (1, n) for one key on the first frame).
        generated: mark the keys by their type, to distinguish them from keys of the user.
    Returns:
        The action.
    Raises:
        InputError: as `check_editable`.
    """
    check_editable(target)
    action = bpy.data.actions.new(name)
    slot = action.slots.new(id_type=target.id_type, name=target.name)
    bag = _get_channelbag(action, slot)
    keys = np.empty((len(frames), 2), np.float32)
    keys[:, 0] = frames
    linear = np.full(len(frames), LINEAR, np.int32)
    for path, (group, values) in channels.items():
        count = len(values)
        for index in range(values.shape[1]):
            keys[:count, 1] = values[:, index]
            points = (curve := _add_curve(bag, path, index, group)).keyframe_points
            points.add(count)
            points.foreach_set("co", keys[:count].ravel())
            points.foreach_set("interpolation", linear[:count])
            if generated:
                points.foreach_set("type", np.full(count, GENERATED, np.int32))
            curve.update()
    assign_action(target, action, slot)
    return action


def replace_keys(target: bpy.types.Object, frames: np.ndarray, channels: dict[str, np.ndarray]) -> None:
    """Replace the keys of the action that an object plays, in place; paths without curves get no keys.

    Args:
        target: the object.
        frames: (F,) scene frames, increasing.
        channels: data path -> values (F, n).
    """
    found = collect_curves(*find_playing_action(target))
    keys = np.empty((len(frames), 2), np.float32)
    keys[:, 0] = frames
    for path, values in channels.items():
        for index in range(values.shape[1]):
            curve = found.get((path, index))
            if curve is None:
                continue
            points = curve.keyframe_points
            if len(points) != len(frames):
                points.clear()
                points.add(len(frames))
            keys[:, 1] = values[:, index]
            points.foreach_set("co", keys.ravel())
            points.foreach_set("interpolation", np.full(len(frames), LINEAR, np.int32))
            curve.update()


class WrittenKeys:
    """The keys that an action has on every frame, kept so that those from some frame on can be replaced quickly.

    Neither action nor slot change: after that Blender builds its dependency graph again. Values that the user has
    edited since are found by comparison; they stay where they are not replaced.

    Args:
        target: the object that plays the action; all curves have keys on the same frames.
    Attributes:
        is_current: whether the action has no other keys than these; set it to False where it may.
    """

    def __init__(self, target: bpy.types.Object):
        action, slot = find_playing_action(target)
        self._action: int | None = action.session_uid
        self._places = _read_places(collect_curves(action, slot))
        self._frames = next(iter(self._places.values()))[::2].copy()
        self._edited = {key: np.zeros(len(self._frames), bool) for key in self._places}
        self._unwritten: slice | None = None  # columns that `replace` has left out
        self.is_current = True

    def can_replace(self, target: bpy.types.Object, first: float, channels: dict[str, tuple[str, np.ndarray]]) -> bool:
        """Whether `replace` is possible: not after others have added, removed or moved keys, nor without a key on each
        frame.
        """
        action, _ = find_playing_action(target)
        if action is None or action.session_uid != self._action:
            return False
        column, count = self._find_column(first), len(next(iter(channels.values()))[1])
        if column + count > len(self._frames) or abs(self._frames[column] - first) > 1e-3:
            return False
        return self.is_current or self.note_edits(target)

    def note_edits(self, target: bpy.types.Object) -> bool:
        """Note the values that the user has edited; False where keys have been added, removed or moved in time: from
        then on they are not these.
        """
        action, slot = find_playing_action(target)
        if action is None or action.session_uid != self._action:
            return False
        now, self.is_current = _read_places(collect_curves(action, slot)), True
        if ({key: len(places) for key, places in now.items()} != {key: len(old) for key, old in self._places.items()}
                or any((places != self._places[key])[::2].any() for key, places in now.items())):
            self._action = None
            return False
        for key, places in now.items():
            self._edited[key] |= (places != self._places[key])[1::2]
        self._places = now
        return True

    def count_edits(self, first: float = float("-inf")) -> int:
        """Count the frames from `first` on whose values the user has edited, as `note_edits` has found."""
        return int(np.any([edited[self._find_column(first) :] for edited in self._edited.values()], axis=0).sum())

    def copy_edits(self, target: bpy.types.Object, old: WrittenKeys) -> None:
        """Give the frames that are also in `old` the values that the user has edited there."""
        found, at = collect_curves(*find_playing_action(target)), np.searchsorted(self._frames, old._frames - 1e-3)
        is_here = np.abs(self._frames[np.minimum(at, len(self._frames) - 1)] - old._frames) < 1e-3
        for key in self._places.keys() & old._places.keys():
            which = old._edited[key] & is_here
            self._places[key][2 * at[which] + 1] = old._places[key][1::2][which]
            self._edited[key][at[which]] = True
            if which.any():
                found[key].keyframe_points.foreach_set("co", self._places[key])
                found[key].update()

    def replace(self, target: bpy.types.Object, first: float, channels: dict[str, tuple[str, np.ndarray]],
                shown: float | None = None) -> None:
        """Replace the keys from a frame on; after the last value they hold it. Handles are left as they are.

        Args:
            target: the object, of which `can_replace` holds.
            first: the frame.
            channels: as `create_action`, all of the action's curves, values (F, n) for F frames.
            shown: the frame that is drawn next: what comes later may be left to `write_others`, which has to follow
                before anything else uses the keys. None: all are written.
        """
        column = self._find_column(first)
        for path, (_, values) in channels.items():
            self._set_values(path, column, values)
        for edited in self._edited.values():
            edited[column:] = False
        end = len(self._frames) if shown is None else self._find_column(shown) + 2
        if end - column <= _FEW_KEYS:
            self._write_few(target, slice(column, end))
            self._unwritten = slice(max(column, end), None)  # a strike may be later than what is drawn
        else:
            self._write_all(target)
            self._unwritten = None

    def write_others(self, target: bpy.types.Object) -> bool:
        """Write the keys that the last `replace` has left out; what the user has edited before them meanwhile stays.

        Returns:
            Whether all are written: False, from then on, where keys have been added, removed or moved meanwhile, or
            another action is played.
        """
        if self._unwritten is None:
            return True
        new = {key: places.reshape(-1, 2)[self._unwritten, 1].copy() for key, places in self._places.items()}
        if not self.note_edits(target):
            return False
        for key, values in new.items():  # the keys there are still the old ones, which is no edit
            self._places[key].reshape(-1, 2)[self._unwritten, 1] = values
            self._edited[key][self._unwritten] = False
        self._write_all(target)
        self._unwritten = None
        return True

    def _write_all(self, target: bpy.types.Object) -> None:
        """Write all keys: the time grows with their number, 75 ns each."""
        for key, curve in collect_curves(*find_playing_action(target)).items():
            curve.keyframe_points.foreach_set("co", self._places[key])
        curve.update()  # one of them tells Blender

    def _write_few(self, target: bpy.types.Object, columns: slice) -> None:
        """Write some of many keys one by one, 2 µs each."""
        for key, curve in collect_curves(*find_playing_action(target)).items():
            places = self._places[key].reshape(-1, 2)[columns].tolist()
            for point, place in zip(curve.keyframe_points[columns], places):
                point.co = place
        curve.update()  # one of them tells Blender

    def _find_column(self, frame: float) -> int:
        """Find the number of the first key from a frame on."""
        return int(np.searchsorted(self._frames, frame - 1e-3))

    def _set_values(self, path: str, column: int, values: np.ndarray) -> None:
        """Set the values (F, n) of a property from a column on; rotations get the sign that is near the key there."""
        rows = [self._places[path, index][2 * column + 1 :: 2] for index in range(values.shape[1])]
        away = path.endswith("rotation_quaternion") and np.dot([row[0] for row in rows], values[0]) < 0.0
        for row, new in zip(rows, -values.T if away else values.T):
            row[: len(new)], row[len(new) :] = new, new[-1]


def _read_places(curves: dict[tuple[str, int], bpy.types.FCurve]) -> dict[tuple[str, int], np.ndarray]:
    """Read the frames and values of curves, (2 n,) for n keys each."""
    places = {key: np.empty(2 * len(curve.keyframe_points), np.float32) for key, curve in curves.items()}
    for key, curve in curves.items():
        curve.keyframe_points.foreach_get("co", places[key])
    return places


def check_editable(target: bpy.types.ID) -> None:
    """Raise InputError while an NLA strip is in tweak mode: Blender does not allow a change of the action then."""
    data = target.animation_data
    if data is not None and data.use_tweak_mode:
        raise InputError(target.name, "one of its NLA strips is in tweak mode", "an object whose action may change",
                         "leave tweak mode with Tab in the NLA editor")


def assign_action(target: bpy.types.Object, action: bpy.types.Action, slot=None) -> None:
    """Assign an action, by `slot` or the first that fits; the earlier action is kept, even if unused.

    Raises InputError as `check_editable`.
    """
    check_editable(target)
    bpy.context.view_layer.update()  # assigning a slot to an object that is not in the depsgraph yet crashes Blender
    data = target.animation_data_create()
    if data.action is not None and data.action.users == 1:
        data.action.use_fake_user = True
    data.action = action
    data.action_slot = slot or data.action_suitable_slots[0]


def remove_marked_action(target: bpy.types.Object, mark: str) -> None:
    """Remove the action that an object plays, if it has the custom property `mark` and no other user.

    Used for results that are regenerated often, so that they do not accumulate in the file.
    """
    action, _ = find_playing_action(target)
    if action is not None and action.get(mark) and action.users - action.use_fake_user == 1:
        target.animation_data.action = None
        bpy.data.actions.remove(action)


def find_playing_action(target: bpy.types.Object):
    """Return the action and slot that an object plays; (None, None) where it plays none."""
    data = target.animation_data
    if data is None or data.action is None or data.action_slot is None:
        return None, None
    return data.action, data.action_slot


def collect_curves(action: bpy.types.Action, slot) -> dict[tuple[str, int], bpy.types.FCurve]:
    """Collect the curves of one slot by data path and array index."""
    found = {}
    for layer in action.layers:
        for strip in layer.strips:
            bag = strip.channelbag(slot)
            found.update({(c.data_path, c.array_index): c for c in (bag.fcurves if bag else ())})
    return found


def remove_curve(action: bpy.types.Action, slot, curve: bpy.types.FCurve) -> None:
    """Remove a curve from an action."""
    for layer in action.layers:
        for strip in layer.strips:
            bag = strip.channelbag(slot)
            if bag is not None and curve in bag.fcurves[:]:
                bag.fcurves.remove(curve)
                return


def read_keys(curve: bpy.types.FCurve) -> dict[str, np.ndarray]:
    """Read all properties of the n keys of a curve: PLACES (n, 2), FIGURES (n,)."""
    points, count = curve.keyframe_points, len(curve.keyframe_points)
    found = {}
    for name in PLACES:
        values = np.empty(2 * count, np.float32)
        points.foreach_get(name, values)
        found[name] = values.reshape(-1, 2)
    for name, kind in FIGURES.items():
        found[name] = np.empty(count, kind)
        points.foreach_get(name, found[name])
    return found


def write_keys(curve: bpy.types.FCurve, keys: dict[str, np.ndarray]) -> None:
    """Write keys as `read_keys` returns them to a curve without keys; frames increase."""
    points = curve.keyframe_points
    points.add(len(keys["co"]))
    for name in ("handle_left_type", "handle_right_type", *PLACES, *(n for n in FIGURES if not n.startswith("handle"))):
        points.foreach_set(name, np.ascontiguousarray(keys[name]).ravel())


def add_curve(action: bpy.types.Action, slot, path: str, index: int, group: str) -> bpy.types.FCurve:
    """Add a curve that the action does not have yet."""
    return _add_curve(_get_channelbag(action, slot), path, index, group)


def select_keys(keys: dict[str, np.ndarray], which: np.ndarray) -> dict[str, np.ndarray]:
    """Select keys of a table by an index or mask."""
    return {name: values[which] for name, values in keys.items()}


def build_action(name: str, slot_name: str, tables: dict, models: dict):
    """Build a new action with one slot.

    Args:
        name: of the action.
        slot_name: of the slot.
        tables: (data path, array index) -> keys as of `read_keys`.
        models: (data path, array index) -> a curve whose group, extrapolation, lock and mute are copied.
    Returns:
        The action and its slot.
    """
    action = bpy.data.actions.new(name)
    slot = action.slots.new(id_type="OBJECT", name=slot_name)
    bag = _get_channelbag(action, slot)
    for (path, index), keys in tables.items():
        model = models[path, index]
        curve = _add_curve(bag, path, index, model.group.name if model.group is not None else "")
        write_keys(curve, keys)
        curve.extrapolation, curve.lock, curve.mute = model.extrapolation, model.lock, model.mute
    return action, slot


def cut_action(whole: bpy.types.Action, slot, start: float, end: float, name: str):
    """Cut a new action from the keys between two frames; return it with its slot.

    Two more keys on either side are kept, so that the curves between the frames stay the same.
    """
    models, tables = collect_curves(whole, slot), {}
    for place, curve in models.items():
        keys = read_keys(curve)
        frames = keys["co"][:, 0]
        if len(frames):
            low = max(0, int(np.searchsorted(frames, start - 1e-3)) - 2)
            high = int(np.searchsorted(frames, end + 1e-3)) + 2
            tables[place] = select_keys(keys, slice(low, high))
    return build_action(name, slot.name_display, tables, models)


def join_actions(parts: list, name: str, slot_name: str):
    """Join (action, slot, start frame, end frame) one after the other; return the new action and its slot.

    On a shared frame the later part's key is used.
    """
    tables, models = {}, {}
    for action, slot, start, end in parts:
        for place, curve in collect_curves(action, slot).items():
            keys = read_keys(curve)
            inside = (keys["co"][:, 0] > start - 1e-3) & (keys["co"][:, 0] < end + 1e-3)
            before = tables.get(place)
            if before is not None:
                before = select_keys(before, before["co"][:, 0] < start - 1e-3)
            tables[place] = _append_keys(before, select_keys(keys, inside))
            models.setdefault(place, curve)
    return build_action(name, slot_name, tables, models)


def find_key_range(found: dict) -> tuple[int, int] | None:
    """Find the first and last whole frame between the outermost keys of curves; None without keys."""
    ranges = [curve.range() for curve in found.values() if len(curve.keyframe_points)]
    if not ranges:
        return None
    return int(np.ceil(min(low for low, _ in ranges) - 1e-4)), int(np.floor(max(high for _, high in ranges) + 1e-4))


def sample_curve(curve: bpy.types.FCurve, frames: np.ndarray) -> np.ndarray:
    """Sample a curve's values (F,) at scene frames (F,): from the keys where every frame has one, else by Blender."""
    count = len(curve.keyframe_points)
    if not curve.modifiers and count >= len(frames):
        keys = np.empty(2 * count, np.float32)
        curve.keyframe_points.foreach_get("co", keys)
        times, values = keys.reshape(-1, 2).T
        at = np.clip(np.searchsorted(times, frames - 1e-3), 0, count - 1)
        if np.all(np.abs(times[at] - frames) < 1e-3):
            return values[at].astype(float)
    return np.array([curve.evaluate(frame) for frame in frames])


def check_local(*things: bpy.types.ID | None) -> None:
    """Raise InputError where data is linked from another file: changes to it are lost when the file is loaded again."""
    for thing in things:
        if thing is not None and thing.library is not None:
            found = f"linked from {thing.library.filepath}"
            step = "use Object > Library Override > Make, or Object > Relations > Make Local"
            raise InputError(thing.name, found, "one of this file", step)


def _append_keys(before: dict | None, after: dict) -> dict:
    return after if before is None else {name: np.concatenate([before[name], after[name]]) for name in after}


def _get_channelbag(action, slot):
    layer = action.layers[0] if action.layers else action.layers.new("Layer")
    strip = layer.strips[0] if layer.strips else layer.strips.new(type="KEYFRAME")
    return strip.channelbag(slot, ensure=True)


def _add_curve(bag, path: str, index: int, group: str):
    if bpy.app.version >= (5, 0, 0):
        return bag.fcurves.new(path, index=index, group_name=group)
    curve = bag.fcurves.new(path, index=index)
    if not group:
        return curve
    curve.group = bag.groups.get(group) or bag.groups.new(group)
    return curve
