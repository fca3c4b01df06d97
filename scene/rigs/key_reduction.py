"""Keyframe reduction: keys that a curve does not need are removed, within a tolerance on every frame.

All channels of a bone's rotation have keys on the same frames. Between two keys the curve is the cubic with the slopes
of the dense motion, which is what Blender draws with handles at a third of the distance; where it is off by more than
the tolerance, the worst frame gets a key too (Douglas and Peucker 1973, with cubics). Quaternions are compared as
rotations, so their length does not matter. A bone may rotate by as much as moves the ends that it carries by the
tolerance; as such rotations add up along a limb, this share is lowered until hands, feet and head are within it.
"""

from __future__ import annotations

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.base.fixes import Fix
from ...beyond_mocap.motion import quaternion
from ..core import channels
from ..path_editing.rig_sampling import find_rotation_channel, to_rotations
from . import rig_bake
from .driven import DrivenRig

BEZIER, ALIGNED = 2, "ALIGNED"
_ROUNDS, _TIGHTEN = 14, 0.6
_ENDS = ("head", "left hand", "right hand", "left foot", "right foot", "left toe", "right toe")


def reduce_keys(
    rig: bpy.types.Object, table: dict[str, str], scene: bpy.types.Scene, tolerance: float, rotation_tolerance: float
) -> tuple[int, int]:
    """Remove keys of the action that the rig plays on the bones of `table`.

    Args:
        rig: the armature.
        table: part -> bone.
        scene: of the rig.
        tolerance: metres that hands, feet, head and moved bones may be off.
        rotation_tolerance: radians that a bone may be off.
    Returns:
        The numbers of keys before and after.
    Raises:
        InputError: if the rig plays no action.
    """
    playing, slot = channels.find_playing_action(rig)
    if playing is None:
        raise InputError(f"rig {rig.name}", "plays no action", "a baked rig", "press Bake to Rig first",
                         fixes=(Fix("press", "beyond_mocap.bake_to_rig"),))
    channels.check_editable(rig)
    curves = channels.collect_curves(playing, slot)
    ends = channels.find_key_range(curves)
    driven = DrivenRig(rig, table, scene)
    frames = np.arange(ends[0], ends[1] + 1)
    dense = _sample_channels(curves, frames)
    reach = _build_end_function(driven, dense)
    places, levers, share = reach({}), _measure_levers(driven), 1.0
    for _ in range(_ROUNDS):
        key_frames = {}
        for path, values in dense.items():
            lever = levers.get(path.rpartition(".")[0], 0.0)
            most = min(rotation_tolerance, share * tolerance / max(lever, 1e-3)) if _is_rotation(path) else (
                share * tolerance / driven.placement.scale)
            key_frames[path] = select_key_frames(values, most, _build_distance(rig, path))
        found = {path: interpolate_keys(dense[path], key_frames[path]) for path in dense}
        if np.abs(np.linalg.norm(reach(found) - places, axis=-1)).max(initial=0.0) <= tolerance:
            break
        share *= _TIGHTEN
    before, as_baked = sum(len(curve.keyframe_points) for curve in curves.values()), rig_bake.has_baked_keys(rig)
    for path, values in dense.items():
        for index in range(values.shape[1]):
            _replace_keys(curves[path, index], frames, values[:, index], key_frames[path])
    if as_baked:
        rig_bake.record_keys(rig)
    return before, sum(len(curve.keyframe_points) for curve in curves.values())


def select_key_frames(values: np.ndarray, tolerance: float, metric) -> np.ndarray:
    """Select the frames that need a key.

    Args:
        values: (F, n) dense values.
        tolerance: in the unit of the metric.
        metric: (values, values) -> (F,) distances.
    Returns:
        Indices, rising.
    """
    slopes = np.gradient(values, axis=0) if len(values) > 1 else np.zeros_like(values)
    selected, open_spans = {0, len(values) - 1}, [(0, len(values) - 1)]
    while open_spans:
        low, high = open_spans.pop()
        if high - low < 2:
            continue
        inside = np.arange(low + 1, high)
        off = metric(_interpolate_cubic(values, slopes, low, high, inside), values[inside])
        worst = int(np.argmax(off))
        if off[worst] > tolerance:
            middle = int(inside[worst])
            selected.add(middle)
            open_spans += [(low, middle), (middle, high)]
    return np.array(sorted(selected))


def interpolate_keys(values: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Interpolate the curve (F, n) of keys on the frames `kept` of values (F, n)."""
    slopes = np.gradient(values, axis=0) if len(values) > 1 else np.zeros_like(values)
    out = values.copy()
    for low, high in zip(kept[:-1], kept[1:]):
        inside = np.arange(low + 1, high)
        out[inside] = _interpolate_cubic(values, slopes, low, high, inside)
    return out


def _interpolate_cubic(values: np.ndarray, slopes: np.ndarray, low: int, high: int, at: np.ndarray) -> np.ndarray:
    """Interpolate with Hermite's cubic from frame `low` to frame `high`, at frames (N,): (N, n)."""
    width = float(high - low)
    u = ((at - low) / width)[:, None]
    a, b, c, d = 2 * u**3 - 3 * u**2 + 1, u**3 - 2 * u**2 + u, -2 * u**3 + 3 * u**2, u**3 - u**2
    return a * values[low] + b * width * slopes[low] + c * values[high] + d * width * slopes[high]


def _is_rotation(path: str) -> bool:
    return ".rotation_" in path


def _sample_channels(curves: dict, frames: np.ndarray) -> dict[str, np.ndarray]:
    """Sample the values (F, n) of every complete bone channel: rotations and locations with keys in all components."""
    found: dict[str, np.ndarray] = {}
    for path in dict.fromkeys(path for path, _ in curves):
        count = 4 if path.endswith(("quaternion", "axis_angle")) else 3
        whole = path.startswith("pose.bones") and path.endswith(
            (".location", ".rotation_quaternion", ".rotation_euler", ".rotation_axis_angle"))
        if whole and all((path, i) in curves for i in range(count)):
            found[path] = np.stack([channels.sample_curve(curves[path, i], frames) for i in range(count)], axis=1)
    return found


def _build_distance(rig: bpy.types.Object, path: str):
    """Build the distance of two stretches of a channel's values: radians of rotations, units of positions."""
    if not _is_rotation(path):
        return lambda a, b: np.linalg.norm(a - b, axis=1)
    mode = rig.path_resolve(path.rpartition(".")[0]).rotation_mode
    return lambda a, b: _measure_angles(to_rotations(mode, a), to_rotations(mode, b))


def _measure_angles(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    apart = quaternion.multiply(quaternion.inverse(a), b)
    return 2.0 * np.arctan2(np.linalg.norm(apart[:, 1:], axis=1), np.abs(apart[:, 0]))


def _build_end_function(driven: DrivenRig, dense: dict[str, np.ndarray]):
    """Build a function from changed channels (path -> values) to the positions of hands, feet and head: (F, E, 3)
    metres.
    """
    controls, rig = driven.controls, driven.rig
    ends = [controls.bones.index(driven.table[part]) for part in _ENDS if part in driven.table]
    count = len(next(iter(dense.values())))

    def reach(changed: dict[str, np.ndarray]) -> np.ndarray:
        turned, locations = {}, {}
        for name in controls.bones:
            path = f'pose.bones["{bpy.utils.escape_identifier(name)}"]'
            mode = rig.pose.bones[name].rotation_mode
            values = changed.get(f"{path}.{find_rotation_channel(mode)}",
                                 dense.get(f"{path}.{find_rotation_channel(mode)}"))
            turned[name] = quaternion.identity(count) if values is None else to_rotations(mode, values)
            locations[name] = changed.get(f"{path}.location", dense.get(f"{path}.location"))
        return controls.compute_heads(turned, locations)[:, ends] * driven.placement.scale

    return reach


def _measure_levers(driven: DrivenRig) -> dict[str, float]:
    """Measure for each driven bone's path the metres at rest to the farthest of those that it carries."""
    controls, scale = driven.controls, driven.placement.scale
    found: dict[str, float] = {}
    for i, bone in enumerate(controls.bones):
        at = controls.carriers[i].position_carrier
        while at >= 0:
            path = f'pose.bones["{bpy.utils.escape_identifier(controls.bones[at])}"]'
            away = float(np.linalg.norm(controls.rest_positions[i] - controls.rest_positions[at])) * scale
            found[path] = max(found.get(path, 0.0), away)
            at = controls.carriers[at].position_carrier
    return found


def _replace_keys(curve: bpy.types.FCurve, frames: np.ndarray, values: np.ndarray, key_frames: np.ndarray) -> None:
    """Replace a curve's keys by those on `key_frames`, joined by cubics with the slopes of the dense values."""
    slopes = np.gradient(values) if len(values) > 1 else np.zeros_like(values)
    at, value, slope = frames[key_frames].astype(float), values[key_frames], slopes[key_frames]
    after = np.diff(at, append=at[-1] + 1.0) / 3.0
    before = np.diff(at, prepend=at[0] - 1.0) / 3.0
    points = curve.keyframe_points
    points.clear()
    points.add(len(key_frames))
    kind = bpy.types.Keyframe.bl_rna.properties["handle_left_type"].enum_items[ALIGNED].value
    for side in ("handle_left_type", "handle_right_type"):
        points.foreach_set(side, np.full(len(key_frames), kind, np.int32))
    for name, x, y in (("co", at, value), ("handle_left", at - before, value - before * slope),
                       ("handle_right", at + after, value + after * slope)):
        points.foreach_set(name, np.column_stack([x, y]).astype(np.float32).ravel())
    points.foreach_set("interpolation", np.full(len(key_frames), BEZIER, np.int32))
