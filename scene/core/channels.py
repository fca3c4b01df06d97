"""Animation curves in bulk: the one file that knows of slots, layers, strips and channelbags.

Values cross the border by `foreach_get` and `foreach_set` only: 72,000 keys take some 0.04 s that way and many seconds
key by key.
"""

from __future__ import annotations

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError

LINEAR = 1  # Keyframe.interpolation as foreach_set takes it
GENERATED = 5  # Keyframe.type likewise: drawn dim in the editors

PLACES = ("co", "handle_left", "handle_right")
FIGURES = {  # what else a key has, and how foreach_get gives it
    "interpolation": np.int32, "easing": np.int32, "type": np.int32, "handle_left_type": np.int32,
    "handle_right_type": np.int32, "amplitude": np.float32, "back": np.float32, "period": np.float32,
}


def animate(target: bpy.types.Object, name: str, frames: np.ndarray, channels: dict[str, tuple[str, np.ndarray]],
            generated: bool = False):
    """Give `target` a new action `name` and return it.

    frames: (F,) scene frames, rising. channels: data path -> (name of the curves' group, values (F, n), or (1, n) for
    one key on the first frame). generated: whether the keys are to be told from hand-made ones by their type. The
    action that was there before is kept in the file. InputError as `check_free`."""
    check_free(target)
    action = bpy.data.actions.new(name)
    slot = action.slots.new(id_type=target.id_type, name=target.name)
    bag = _channelbag(action, slot)
    keys = np.empty((len(frames), 2), np.float32)
    keys[:, 0] = frames
    linear = np.full(len(frames), LINEAR, np.int32)
    for path, (group, values) in channels.items():
        count = len(values)
        for index in range(values.shape[1]):
            keys[:count, 1] = values[:, index]
            points = (curve := _new_curve(bag, path, index, group)).keyframe_points
            points.add(count)
            points.foreach_set("co", keys[:count].ravel())
            points.foreach_set("interpolation", linear[:count])
            if generated:
                points.foreach_set("type", np.full(count, GENERATED, np.int32))
            curve.update()
    assign(target, action, slot)
    return action


def rewrite(target: bpy.types.Object, frames: np.ndarray, channels: dict[str, np.ndarray]) -> None:
    """Let the action that `target` plays have other keys, in place: data path -> values (F, n) at frames (F,), rising.
    Paths without curves get no keys."""
    found = curves(*playing(target))
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


def check_free(target: bpy.types.ID) -> None:
    """InputError where an NLA strip is being tweaked: Blender lets nobody change the action then."""
    data = target.animation_data
    if data is not None and data.use_tweak_mode:
        raise InputError(target.name, "one of its NLA strips is in tweak mode", "an object whose action may change",
                         "leave tweak mode with Tab in the NLA editor")


def assign(target: bpy.types.Object, action: bpy.types.Action, slot=None) -> None:
    """Play `action` on `target`, by `slot` or the first that fits; the action before is kept, even if unused.
    InputError as `check_free`."""
    check_free(target)
    bpy.context.view_layer.update()  # a slot given to an object that the depsgraph has not met yet crashes Blender
    data = target.animation_data_create()
    if data.action is not None and data.action.users == 1:
        data.action.use_fake_user = True
    data.action = action
    data.action_slot = slot or data.action_suitable_slots[0]


def discard(target: bpy.types.Object, mark: str) -> None:
    """Take off and remove the action that `target` plays, if it carries the custom property `mark` and has no other
    user.

    For results that are made again and again, so that they do not pile up in the file."""
    action, _ = playing(target)
    if action is not None and action.get(mark) and action.users - action.use_fake_user == 1:
        target.animation_data.action = None
        bpy.data.actions.remove(action)


def playing(target: bpy.types.Object):
    """The action and slot that `target` plays; (None, None) where it plays none."""
    data = target.animation_data
    if data is None or data.action is None or data.action_slot is None:
        return None, None
    return data.action, data.action_slot


def curves(action: bpy.types.Action, slot) -> dict[tuple[str, int], bpy.types.FCurve]:
    """The curves of one slot by data path and array index."""
    found = {}
    for layer in action.layers:
        for strip in layer.strips:
            bag = strip.channelbag(slot)
            found.update({(c.data_path, c.array_index): c for c in (bag.fcurves if bag else ())})
    return found


def remove_curve(action: bpy.types.Action, slot, curve: bpy.types.FCurve) -> None:
    """Take a curve out of an action."""
    for layer in action.layers:
        for strip in layer.strips:
            bag = strip.channelbag(slot)
            if bag is not None and curve in bag.fcurves[:]:
                bag.fcurves.remove(curve)
                return


def keys_of(curve: bpy.types.FCurve) -> dict[str, np.ndarray]:
    """All that the n keys of a curve have: PLACES (n, 2), FIGURES (n,)."""
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


def put_keys(curve: bpy.types.FCurve, keys: dict[str, np.ndarray]) -> None:
    """Let a curve without keys have those of `keys_of`, whose frames rise."""
    points = curve.keyframe_points
    points.add(len(keys["co"]))
    for name in ("handle_left_type", "handle_right_type", *PLACES, *(n for n in FIGURES if not n.startswith("handle"))):
        points.foreach_set(name, np.ascontiguousarray(keys[name]).ravel())


def new_curve(action: bpy.types.Action, slot, path: str, index: int, group: str) -> bpy.types.FCurve:
    """A curve that the action does not have yet."""
    return _new_curve(_channelbag(action, slot), path, index, group)


def chosen(keys: dict[str, np.ndarray], which: np.ndarray) -> dict[str, np.ndarray]:
    """Those keys of a table that an index or mask picks."""
    return {name: values[which] for name, values in keys.items()}


def built(name: str, slot_name: str, tables: dict, like: dict):
    """A new action `name` with one slot, and that slot.

    tables: (data path, array index) -> keys as of `keys_of`. like: (data path, array index) -> a curve whose group,
    extrapolation, lock and mute are taken over."""
    action = bpy.data.actions.new(name)
    slot = action.slots.new(id_type="OBJECT", name=slot_name)
    bag = _channelbag(action, slot)
    for (path, index), keys in tables.items():
        model = like[path, index]
        curve = _new_curve(bag, path, index, model.group.name if model.group is not None else "")
        put_keys(curve, keys)
        curve.extrapolation, curve.lock, curve.mute = model.extrapolation, model.lock, model.mute
    return action, slot


def cut(whole: bpy.types.Action, slot, start: float, end: float, name: str):
    """A new action with the keys between two frames, and two more on either side, so that its curves run between them
    as the whole's do; and its slot."""
    models, tables = curves(whole, slot), {}
    for place, curve in models.items():
        keys = keys_of(curve)
        frames = keys["co"][:, 0]
        if len(frames):
            low = max(0, int(np.searchsorted(frames, start - 1e-3)) - 2)
            high = int(np.searchsorted(frames, end + 1e-3)) + 2
            tables[place] = chosen(keys, slice(low, high))
    return built(name, slot.name_display, tables, models)


def joined(parts: list, name: str, slot_name: str):
    """A new action that plays (action, slot, start frame, end frame) one after the other, and its slot; on a frame that
    two share the later one's key counts."""
    tables, models = {}, {}
    for action, slot, start, end in parts:
        for place, curve in curves(action, slot).items():
            keys = keys_of(curve)
            inside = (keys["co"][:, 0] > start - 1e-3) & (keys["co"][:, 0] < end + 1e-3)
            before = tables.get(place)
            if before is not None:
                before = chosen(before, before["co"][:, 0] < start - 1e-3)
            tables[place] = _appended(before, chosen(keys, inside))
            models.setdefault(place, curve)
    return built(name, slot_name, tables, models)


def keyed_range(found: dict) -> tuple[int, int] | None:
    """First and last whole frame between the outermost keys of curves from `curves`; None where there is no key."""
    ends = [curve.range() for curve in found.values() if len(curve.keyframe_points)]
    if not ends:
        return None
    return int(np.ceil(min(low for low, _ in ends) - 1e-4)), int(np.floor(max(high for _, high in ends) + 1e-4))


def sample(curve: bpy.types.FCurve, frames: np.ndarray) -> np.ndarray:
    """The curve's values (F,) at scene frames (F,): keys where every frame has one, else evaluated by Blender."""
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
    """InputError where one of these is linked from another file: what is written to it is lost with the next load."""
    for thing in things:
        if thing is not None and thing.library is not None:
            found = f"linked from {thing.library.filepath}"
            step = "use Object > Library Override > Make, or Object > Relations > Make Local"
            raise InputError(thing.name, found, "one of this file", step)


def _appended(before: dict | None, after: dict) -> dict:
    return after if before is None else {name: np.concatenate([before[name], after[name]]) for name in after}


def _channelbag(action, slot):
    layer = action.layers[0] if action.layers else action.layers.new("Layer")
    strip = layer.strips[0] if layer.strips else layer.strips.new(type="KEYFRAME")
    return strip.channelbag(slot, ensure=True)


def _new_curve(bag, path: str, index: int, group: str):
    if bpy.app.version >= (5, 0, 0):
        return bag.fcurves.new(path, index=index, group_name=group)
    curve = bag.fcurves.new(path, index=index)
    if not group:
        return curve
    curve.group = bag.groups.get(group) or bag.groups.new(group)
    return curve
