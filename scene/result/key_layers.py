"""Own keys as a layer: an additive NLA strip above the take, with an influence that one can dial.

Keys that the user sets on a take's action replace its keys. As a layer only their difference from the take is kept, in
an action of its own: at influence 1 the body has exactly the keyed pose at the keys, at 0 exactly the take's, and away
from the keys the difference fades. A take that is updated keeps its layers, which then add to the new take.

Strips play below the action of a body. So a body with layers plays its take as a strip too (`stack_layers`); while a
preview is shown, applied or reverted the take is an ordinary action again (`unstack_layers`).
"""

from __future__ import annotations

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.motion import quaternion
from ..core import channels
from ..core.measure import frames_per_second
from . import bake, blocks
from . import manual_keys as hand_keys

LAYER = "beyond_mocap_layer"  # on the action of a layer
STACKED = "beyond_mocap_stacked"  # on a take's action that plays as a strip below layers
NAME = "Own Keys"
FADE_SECONDS = 0.3  # s beside keys over which their difference fades
_ROTATION, _SCALE = "rotation_quaternion", "scale"
_STRIP_SETTINGS = (
    "action_frame_start", "action_frame_end", "repeat", "scale", "frame_start", "frame_end", "blend_type",
    "extrapolation", "use_auto_blend", "blend_in", "blend_out", "use_reverse", "mute", "use_sync_length",
    "use_animated_influence", "use_animated_time", "use_animated_time_cyclic")
_DEFAULTS = {_ROTATION: (1.0, 0.0, 0.0, 0.0), _SCALE: (1.0, 1.0, 1.0)}

Table = tuple[np.ndarray, np.ndarray]  # frames (F,) and values (F, N) of one property


def list_layers(body: bpy.types.Object | None) -> list[bpy.types.NlaStrip]:
    """List the layers of a body, from the lowest up."""
    data = body.animation_data if body is not None else None
    return [strip for track in (data.nla_tracks if data is not None else ()) for strip in track.strips
            if strip.action is not None and strip.action.get(LAYER)]


def keep_as_layer(body: bpy.types.Object, fps: float, fade: float = FADE_SECONDS) -> bpy.types.NlaStrip:
    """Keep the user's own keys of a body as a layer above its take, which gets its own keys back.

    Args:
        body: the armature, playing its take, or the user's action above the take.
        fps: frames per second of the scene.
        fade: s beside keys over which their difference fades.
    Returns:
        The layer.
    Raises:
        InputError: if the body has no keys of the user.
    """
    channels.check_local(body)
    channels.check_editable(body)
    action, slot = channels.find_playing_action(body)
    generated = hand_keys.read_generated(action) if action is not None else None
    is_above = generated is None and action is not None and blocks.find_track(body) is not None
    tables = _read_own_keys(body, action, slot, generated) if generated is not None or is_above else {}
    if not tables:
        raise InputError(f"body {body.name}", "no keys of your own on its take", "keys that differ from the take's",
                         "key a pose first, then press Keep as Layer")
    bases = {path: _sample_generated(generated, path, *table) for path, table in tables.items()} if not is_above \
        else _sample_below(body, tables)
    groups = {path: (curve.group.name if curve.group else "") for (path, _), curve in
              channels.collect_curves(action, slot).items()}
    differences = {path: (frames, _subtract(path, _fill_components(path, values, bases[path], is_above), bases[path]))
                   for path, (frames, values) in tables.items()}
    layer, part = _build_layer(body, differences, groups, max(1, round(fade * fps)))
    if is_above:
        body.animation_data.action = None
        if not action.users - action.use_fake_user:
            bpy.data.actions.remove(action)
    else:
        _restore_generated(action, slot, generated)
    track = body.animation_data.nla_tracks.new()
    track.name = NAME
    _add_layer_strip(track, layer, part)
    stack_layers(body)
    return list_layers(body)[-1]


def remove_layer(body: bpy.types.Object, number: int) -> None:
    """Remove a layer of a body with its action; without layers the take plays as an ordinary action again."""
    strip = list_layers(body)[number]
    track = next(track for track in body.animation_data.nla_tracks if any(one == strip for one in track.strips))
    action, slot = strip.action, strip.action_slot
    paths = {path for path, _ in channels.collect_curves(action, slot)}
    body.animation_data.nla_tracks.remove(track)
    if not action.users - action.use_fake_user:
        bpy.data.actions.remove(action)
    if not list_layers(body):
        unstack_layers(body)
    _reset_channels(body, paths)


def stack_layers(body: bpy.types.Object | None) -> None:
    """Let a body with layers play its take as a strip below them."""
    if not list_layers(body):
        return
    data = body.animation_data
    action, slot = channels.find_playing_action(body)
    if action is not None and action.get(bake.MARK):
        earlier = blocks.find_track(body)
        if earlier is not None:
            earlier.mute = True
        data.action = None
        action[STACKED] = True
        first, last = channels.find_key_range(channels.collect_curves(action, slot))
        track = data.nla_tracks.new()
        track.name = blocks.TRACK
        blocks.add_strip(track, action, slot, first, last=last, name=action.name).extrapolation = "HOLD"
    _raise_layers(body)
    data.use_nla = True


def unstack_layers(body: bpy.types.Object | None, uses_nla: bool = True) -> None:
    """Let a body play its take as an ordinary action again; uses_nla: whether its other strips play too.

    Keys that the user has set above the layers become a layer.
    """
    data = body.animation_data if body is not None else None
    if data is None or data.use_tweak_mode:
        return
    track = next((track for track in data.nla_tracks for strip in track.strips
                  if strip.action is not None and strip.action.get(STACKED)), None)
    if track is None:
        return
    if channels.find_playing_action(body)[0] is not None:  # the user has keyed above the layers
        keep_as_layer(body, frames_per_second(bpy.context.scene))
    strip = track.strips[0]
    action, slot = strip.action, strip.action_slot
    data.nla_tracks.remove(track)
    del action[STACKED]
    channels.assign_action(body, action, slot)
    earlier = blocks.find_track(body)
    if earlier is not None:
        earlier.mute = False
    data.use_nla = uses_nla


def _read_own_keys(body: bpy.types.Object, action: bpy.types.Action, slot,
                   generated: hand_keys.GeneratedKeys | None) -> dict[str, Table]:
    """Read frames and values of the user's keys of an action: those that differ from the generated ones, or all.

    Components of a property without keys are NaN; properties that the body does not have any more are left out.
    """
    curves, frames = channels.collect_curves(action, slot), {}
    if generated is None:
        for (path, _), curve in curves.items():
            frames.setdefault(path, []).extend(channels.read_keys(curve)["co"][:, 0])
    else:
        manual = hand_keys.find_manual_keys(action, slot)
        for (path, _), keys in manual.keys.items():
            frames.setdefault(path, []).extend(keys["co"][:, 0])
        for (path, _), missing in manual.missing.items():
            frames.setdefault(path, []).extend(missing)
    found = {}
    for path, given in frames.items():
        at = np.unique(np.round(np.array(given, float), 3))
        values = np.full((len(at), _count_components(body, path)), np.nan)
        for index in range(values.shape[1]):
            if (path, index) in curves:
                values[:, index] = [curves[path, index].evaluate(frame) for frame in at]
        if values.shape[1]:
            found[path] = at, values
    return found


def _count_components(body: bpy.types.Object, path: str) -> int:
    """Count the numbers of a body's property, 0 where it is gone; InputError for one that is no number."""
    try:
        value = body.path_resolve(path)
    except ValueError:
        return 0
    if isinstance(value, str):
        raise InputError(f"body {body.name}", f"keys on {path}", "keys of numbers, which a layer can add",
                         "remove these keys first")
    return int(np.size(value))


def _sample_generated(generated: hand_keys.GeneratedKeys, path: str, frames: np.ndarray,
                      values: np.ndarray) -> np.ndarray:
    """Sample a property (F, N) of the take alone at frames (F,); `values` (F, N) has its size."""
    out = np.tile(np.array(_DEFAULTS.get(path.rpartition(".")[2], (0.0,) * values.shape[1])), (len(frames), 1))
    for index in range(values.shape[1]):
        if (path, index) in generated.values:
            out[:, index] = _interpolate(generated, (path, index), frames)
    return out


def _interpolate(generated: hand_keys.GeneratedKeys, place: hand_keys.Place, frames: np.ndarray) -> np.ndarray:
    return np.interp(frames, generated.first + np.arange(generated.count), generated.values[place])


def _reset_channels(body: bpy.types.Object, paths: set[str]) -> None:
    """Reset these properties to rest; those that something else still animates are evaluated again afterwards."""
    for path in sorted(paths):
        owner, _, name = path.rpartition(".")
        try:
            thing = body.path_resolve(owner) if owner else body
            value = getattr(thing, name)
        except (AttributeError, ValueError):  # a custom property, or of a bone that is gone: its value stays
            continue
        if not isinstance(value, (bool, int, float, str)):
            setattr(thing, name, _DEFAULTS.get(name, (0.0,) * len(value)))
    body.update_tag(refresh={"OBJECT", "DATA", "TIME"})


def _sample_below(body: bpy.types.Object, tables: dict[str, Table]) -> dict[str, np.ndarray]:
    """Sample what the strips below a body's action give for its properties, at the frames of each."""
    scene, data = bpy.context.scene, body.animation_data
    action, slot = channels.find_playing_action(body)
    now, subframe = scene.frame_current, scene.frame_subframe
    found = {path: np.zeros_like(values) for path, (_, values) in tables.items()}
    data.action = None
    try:
        for frame in np.unique(np.concatenate([frames for frames, _ in tables.values()])):
            scene.frame_set(int(np.floor(frame)), subframe=float(frame - np.floor(frame)))
            for path, (frames, _) in tables.items():
                row = np.flatnonzero(frames == frame)
                if len(row):
                    found[path][row[0]] = np.array(body.path_resolve(path))
    finally:
        channels.assign_action(body, action, slot)
        scene.frame_set(now, subframe=subframe)
    return found


def _fill_components(path: str, values: np.ndarray, base: np.ndarray, is_above: bool) -> np.ndarray:
    """Fill the components without keys, NaN in `values` (F, N), as Blender does: from `base` (F, N) below, but in a
    quaternion above strips, which it takes as a whole, with those of no rotation.
    """
    takes_whole = is_above and path.rpartition(".")[2] == _ROTATION
    return np.where(np.isnan(values), np.array(_DEFAULTS[_ROTATION]) if takes_whole else base, values)


def _subtract(path: str, values: np.ndarray, base: np.ndarray) -> np.ndarray:
    """Compute what a layer adds to `base` (F, N) so that `values` (F, N) result, as Blender combines them."""
    name = path.rpartition(".")[2]
    if name == _ROTATION:
        own, below = (quaternion.normalize(rows) for rows in (values, base))
        turn = quaternion.multiply(quaternion.inverse(below), own)
        return turn * np.where(turn[:, :1] < 0.0, -1.0, 1.0)  # the shorter way round
    if name == _SCALE:
        return values / np.where(np.abs(base) < 1e-6, 1.0, base)
    return values - base


def _build_layer(body: bpy.types.Object, tables: dict[str, Table], groups: dict[str, str], fade: int):
    """Build the action of a layer from differences (F, N) by property, fading over frames; returns it and its slot."""
    action = bpy.data.actions.new(f"{body.name} {NAME.lower()}")
    action[LAYER] = True
    slot = action.slots.new(id_type="OBJECT", name=body.name)
    for path, (frames, values) in tables.items():
        frames, values = _add_fades(frames, values, _DEFAULTS.get(path.rpartition(".")[2], (0.0,) * values.shape[1]),
                                    fade)
        for index in range(values.shape[1]):
            curve = channels.add_curve(action, slot, path, index, groups.get(path, ""))
            points = curve.keyframe_points
            points.add(len(frames))
            points.foreach_set("co", np.column_stack([frames, values[:, index]]).astype(np.float32).ravel())
            curve.update()
    return action, slot


def _add_fades(frames: np.ndarray, values: np.ndarray, nothing, fade: int) -> Table:
    """Add keys without a difference beside each group of keys that are closer than two fades."""
    groups = np.split(np.arange(len(frames)), np.flatnonzero(np.diff(frames) > 2 * fade) + 1)
    at = [edge for group in groups for edge in (frames[group[0]] - fade, frames[group[-1]] + fade)]
    rows = np.concatenate([values, np.tile(np.array(nothing, float), (len(at), 1))])
    order = np.argsort(np.concatenate([frames, at]), kind="stable")
    return np.concatenate([frames, at])[order], rows[order]


def _restore_generated(action: bpy.types.Action, slot, generated: hand_keys.GeneratedKeys) -> None:
    """Give a take's action its own keys back."""
    frames = generated.first + np.arange(generated.count)
    curves = channels.collect_curves(action, slot)
    for place, curve in curves.items():
        if place not in generated.values:
            channels.remove_curve(action, slot, curve)
    for place, values in generated.values.items():
        curve = curves.get(place)
        if curve is None:
            curve = channels.add_curve(action, slot, *place, "")
        curve.lock = False
        points = curve.keyframe_points
        points.clear()
        points.add(generated.count)
        points.foreach_set("co", np.column_stack([frames, values]).astype(np.float32).ravel())
        points.foreach_set("interpolation", np.full(generated.count, channels.LINEAR, np.int32))
        points.foreach_set("type", np.full(generated.count, channels.GENERATED, np.int32))
        curve.update()


def _add_layer_strip(track: bpy.types.NlaTrack, action: bpy.types.Action, slot) -> None:
    """Add the strip of a layer."""
    first, last = channels.find_key_range(channels.collect_curves(action, slot))
    strip = blocks.add_strip(track, action, slot, first, last=last, name=NAME)
    strip.blend_type, strip.extrapolation = "COMBINE", "NOTHING"
    strip.use_animated_influence = True  # else Blender takes the influence from the strip's blend in and out
    for curve in strip.fcurves:
        curve.keyframe_points.clear()  # a plain slider, until the user keys it
    strip.influence = 1.0


def _raise_layers(body: bpy.types.Object) -> None:
    """Let the layers play above all takes."""
    data = body.animation_data
    tracks = list(data.nla_tracks)
    takes = [number for number, track in enumerate(tracks)
             if any(strip.action is not None and strip.action.get(bake.MARK) for strip in track.strips)]
    for track in tracks[:takes[-1]] if takes else ():
        if any(strip.action is not None and strip.action.get(LAYER) for strip in track.strips):
            _raise_track(data.nla_tracks, track)


def _raise_track(tracks, old: bpy.types.NlaTrack) -> None:
    """Put a copy of a track on top, with all that the user has set on its strips, in place of the track."""
    new, name, strips = tracks.new(), old.name, [strip for strip in old.strips if strip.action is not None]
    new.mute, new.lock = old.mute, old.lock
    copies = [(_copy_strip(new, strip), strip.name) for strip in strips]
    tracks.remove(old)
    new.name = name
    for copied, strip_name in copies:
        copied.name = strip_name


def _copy_strip(track: bpy.types.NlaTrack, strip: bpy.types.NlaStrip) -> bpy.types.NlaStrip:
    """Copy a strip, with its place in time, its blending and the keys of its own properties, to another track."""
    copied = blocks.add_strip(track, strip.action, strip.action_slot, int(np.floor(strip.frame_start)),
                              last=int(np.ceil(strip.frame_end)), name=strip.name)
    for name in _STRIP_SETTINGS:
        setattr(copied, name, getattr(strip, name))
    for curve in strip.fcurves:
        target = copied.fcurves.find(curve.data_path)
        target.keyframe_points.clear()
        channels.write_keys(target, channels.read_keys(curve))
    copied.influence = strip.influence
    return copied
