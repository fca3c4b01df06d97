"""Tracks that are drawn or animated in Blender: a curve with a speed at each point, or any object that moves.

The speed of a control point, in metres per second, is its Radius (Item tab, Alt-S), and the wait in seconds at a point
of speed 0 its Weight: both stay with the point when the curve is subdivided or cut, and Blender itself saves them.
"""

from __future__ import annotations

from typing import NamedTuple

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d

from ...beyond_mocap.base import time_series, vectors
from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.motion import humanoid, track
from ..core import channels
from ..core.live import Watcher
from ..core.measure import build_scene_clock, units_per_metre
from ..core.settings import find_active_player
from ..rigs import armature
from . import drawn_track

BEZIER_PIECES = 48  # straight pieces of a Bezier segment

LABEL_SIZE, RGBA, PIN_RGBA = 12, (1.0, 0.85, 0.2, 1.0), (0.4, 0.9, 1.0, 1.0)


class DrawnLine(NamedTuple):
    """A curve on the ground.

    Attributes:
        line: (N, 3) metres, world.
        point_indices: (P,) index into it of each control point.
        speeds: (P,) m/s.
        waits: (P,) seconds.
    """

    line: np.ndarray
    point_indices: np.ndarray
    speeds: np.ndarray
    waits: np.ndarray


EMPTY_LINE = DrawnLine(np.empty((0, 3)), np.empty(0, int), np.empty(0), np.empty(0))
MAX_PLAYED = 32
_played_paths: dict[tuple[int, int], tuple] = {}  # (scene, object) by session_uid: stamp, frames, places


def read_drawn_track(scene: bpy.types.Scene, drawn: bpy.types.Object, start: float = 0.0,
                     still: bool = False) -> track.Track:
    """Read the track of a curve or a moving object.

    Args:
        scene: of the object.
        drawn: a curve, or an object that moves.
        start: seconds on the track's clock at which a curve begins.
        still: do not change the scene's frame. An object moved by more than its own keys has to be played frame by
            frame, which takes time and discards a pose without a key; with `still` the last such result is used,
            InputError where there is none.
    Returns:
        The track.
    Raises:
        InputError: if the object is no track.
    """
    from ...beyond_mocap.motion.track import line_track

    if drawn.type == "CURVE":
        line = build_line(scene, drawn)
        level = line.line[:, :2]
        distances = vectors.distances_along(level)
        return line_track.build_line_track(level, distances[line.point_indices], line.speeds, waits=line.waits,
                                           start=start, name=f"curve {drawn.name}")
    if drawn.type == "CURVES":
        raise InputError(f"object {drawn.name}", "hair curves", "a curve (Add > Curve)", "convert it: Object > Convert")
    return line_track.build_moving_track(*_read_timed_places(scene, drawn, still), f"object {drawn.name}")


def sample_object(scene: bpy.types.Scene, target: bpy.types.Object, times: np.ndarray, still: bool) -> np.ndarray:
    """Sample where an object is on the ground, moving or not.

    Args:
        scene: of the object.
        target: any object; a curve stands where its origin is.
        times: (T,) s on the track's clock.
        still: see `read_drawn_track`.
    Returns:
        (T, 2) m; before and after its motion where that begins and ends.
    """
    if _is_at_rest(target):
        place = np.array(target.matrix_world.translation, dtype=float)[:2] / units_per_metre(scene)
        return np.tile(place, (len(times), 1))
    seconds, places = _read_timed_places(scene, target, still)
    return time_series.interpolate_columns(times, seconds, places)


def build_line(scene: bpy.types.Scene, drawn: bpy.types.Object) -> DrawnLine:
    """Build the line of a curve object's first spline, as it is now, also in edit mode; InputError for a closed or
    empty one.
    """
    spline = next((spline for spline in drawn.data.splines if len(list_points(spline)) > 1), None)
    if spline is None:
        raise InputError(f"curve {drawn.name}", "fewer than two points", "a line", "add points in edit mode")
    if spline.use_cyclic_u:
        raise InputError(f"curve {drawn.name}", "a closed curve", "a curve with two ends", "switch Cyclic off (Alt-C)")
    points = list_points(spline)
    if spline.type == "BEZIER":
        local, at = _sample_bezier(points)
    elif spline.type == "POLY":
        local, at = _read_values(points, "co", 4)[:, :3], np.arange(len(points))
    else:
        from ...beyond_mocap.motion.track.line_track import sample_nurbs

        places, weights = _read_values(points, "co", 4)[:, :3], _read_values(points, "weight", 1)
        local, at = sample_nurbs(places, weights, spline.order_u, spline.use_endpoint_u, BEZIER_PIECES)
    world = np.array(drawn.matrix_world)
    line = (local @ world[:3, :3].T + world[:3, 3]) / units_per_metre(scene)
    return DrawnLine(line, at, _read_values(points, "radius", 1), _read_values(points, "weight_softbody", 1))


def list_points(spline: bpy.types.Spline):
    """List a spline's control points, of either kind."""
    return spline.bezier_points if spline.type == "BEZIER" else spline.points


def set_speed(points, speed: float, wait: float) -> None:
    """Set the speed of control points in m/s and, for stops, a wait in seconds."""
    for point in points:
        point.radius, point.weight_softbody = speed, max(wait, 0.01)


def create_curve(context: bpy.types.Context, name: str, collection) -> bpy.types.Object:
    """Create a Bezier curve as a start, from the 3D cursor along X: starting from rest, a bend, a stop."""
    units = units_per_metre(context.scene)
    origin = np.array(context.scene.cursor.location) * [1.0, 1.0, 0.0]
    data = bpy.data.curves.new(name, "CURVE")
    data.dimensions, data.bevel_depth = "3D", 0.0
    spline = data.splines.new("BEZIER")
    places = np.array([[0.0, 0.0, 0.0], [6.0, 1.5, 0.0], [12.0, 0.0, 0.0], [18.0, -1.5, 0.0]]) * units
    spline.bezier_points.add(len(places) - 1)
    for point, place, speed in zip(spline.bezier_points, places, (0.0, 3.0, 3.0, 0.0)):
        point.co, point.radius, point.weight_softbody = origin + place, speed, 0.5
        point.handle_left_type = point.handle_right_type = "AUTO"
    drawn = bpy.data.objects.new(name, data)
    collection.objects.link(drawn)
    context.view_layer.update()  # computes the handles
    return drawn


def _is_at_rest(target: bpy.types.Object) -> bool:
    """Return whether nothing moves an object but the user."""
    data = target.animation_data
    is_animated = data is not None and (data.action or data.drivers or data.nla_tracks)
    return not (is_animated or target.parent or target.constraints or target.type == "ARMATURE")


def _read_timed_places(scene: bpy.types.Scene, moving: bpy.types.Object, still: bool) -> tuple[np.ndarray, np.ndarray]:
    """Read seconds (F,) on the track's clock and positions (F, 2) m of a moving object."""
    frames, places = _read_moving_object(scene, moving, still)
    clock = build_scene_clock(scene)
    seconds = clock.start_time + (frames - clock.start_frame) / clock.fps
    return seconds, places[:, :2] / units_per_metre(scene)


def _read_values(points, name: str, size: int) -> np.ndarray:
    out = np.empty(size * len(points), np.float32)
    points.foreach_get(name, out)
    return out.reshape(-1, size).astype(float) if size > 1 else out.astype(float)


def _sample_bezier(points) -> tuple[np.ndarray, np.ndarray]:
    """Sample the line (N, 3) through Bezier points, and the index of each point on it."""
    co, left, right = (_read_values(points, name, 3) for name in ("co", "handle_left", "handle_right"))
    t = np.linspace(0.0, 1.0, BEZIER_PIECES + 1)[:-1, None, None]
    a, b, c, d = co[:-1], right[:-1], left[1:], co[1:]
    fine = (1 - t) ** 3 * a + 3 * t * (1 - t) ** 2 * b + 3 * t**2 * (1 - t) * c + t**3 * d
    line = np.concatenate([fine.transpose(1, 0, 2).reshape(-1, 3), co[-1:]])
    return line, BEZIER_PIECES * np.arange(len(co))


def _read_moving_object(scene: bpy.types.Scene, moving: bpy.types.Object, still: bool) -> tuple[np.ndarray, np.ndarray]:
    """Read frames (F,) and positions (F, 3), in Blender's units, of a moving object; of an armature its hips, or first
    bone.
    """
    own = _sample_own_keys(moving)
    if own is not None:
        return own
    key, stamp = (scene.session_uid, moving.session_uid), _compute_stamp(scene, moving)
    if still:
        if key not in _played_paths or _played_paths[key][0] != stamp:
            raise InputError(f"object {moving.name}", "not played since it was opened or changed", "its motion",
                             "press Update to play it")
        return _played_paths[key][1:]
    frames, places = _play_scene(scene, moving)
    _played_paths.pop(key, None)
    _played_paths[key] = stamp, frames, places
    if len(_played_paths) > MAX_PLAYED:
        del _played_paths[next(iter(_played_paths))]
    return frames, places


def _compute_stamp(scene: bpy.types.Scene, moving: bpy.types.Object) -> tuple:
    """Compute a value that changes when an object's own keys or the frames in which it moves change."""
    action, slot = channels.find_playing_action(moving)
    keys = (
        [channels.read_keys(curve)["co"].tobytes() for curve in channels.collect_curves(action, slot).values()]
        if action else []
    )
    return *_find_frame_range(scene, moving), hash(tuple(keys))


def _play_scene(scene: bpy.types.Scene, moving: bpy.types.Object) -> tuple[np.ndarray, np.ndarray]:
    """Read frames and positions by playing the scene."""
    first, last = _find_frame_range(scene, moving)
    frames = np.arange(first, last + 1, dtype=float)
    bone = _find_hips_bone(scene, moving) if moving.type == "ARMATURE" else None
    before, places = (scene.frame_current, scene.frame_subframe), np.empty((len(frames), 3))
    try:
        for number, frame in enumerate(frames):
            scene.frame_set(int(frame))
            shown = moving.evaluated_get(bpy.context.evaluated_depsgraph_get())
            place = shown.matrix_world.translation
            if bone is not None:
                place = shown.matrix_world @ shown.pose.bones[bone].head
            places[number] = place
    finally:
        scene.frame_set(before[0], subframe=before[1])
    return frames, places


def _sample_own_keys(moving: bpy.types.Object) -> tuple[np.ndarray, np.ndarray] | None:
    """Sample frames and positions from the object's own curves, which is quick; None where something else moves it."""
    action, slot = channels.find_playing_action(moving)
    data = moving.animation_data
    if action is None or moving.type == "ARMATURE" or moving.parent or moving.constraints or data.drivers:
        return None
    if data.nla_tracks or moving.delta_location.length:
        return None
    curves = channels.collect_curves(action, slot)
    ends = channels.find_key_range(curves)
    if ends is None:
        return None
    frames = np.arange(ends[0], ends[1] + 1, dtype=float)
    columns = [channels.sample_curve(curves["location", axis], frames) if ("location", axis) in curves
               else np.full(len(frames), moving.location[axis])
               for axis in range(3)]
    return frames, np.stack(columns, axis=1)


def _find_frame_range(scene: bpy.types.Scene, moving: bpy.types.Object) -> tuple[int, int]:
    """Find the frames in which it moves: those of its own keys, else the scene's."""
    action, slot = channels.find_playing_action(moving)
    ends = channels.find_key_range(channels.collect_curves(action, slot)) if action else None
    return ends or (scene.frame_start, scene.frame_end)


def _find_hips_bone(scene: bpy.types.Scene, moving: bpy.types.Object) -> str:
    """Find the pelvis bone, or the first without a parent."""
    try:
        skeleton = armature.build_skeleton(moving, scene)
        return skeleton.names[humanoid.identify_joints(skeleton).hips]
    except InputError:
        if not moving.data.bones:
            raise
        return next(bone.name for bone in moving.data.bones if bone.parent is None)


def build_speed_labels(scene: bpy.types.Scene) -> list[tuple[tuple[float, float, float], str, tuple]]:
    """Build the labels in the view: (position in Blender's units, text, colour)."""
    player, units = find_active_player(scene.beyond_mocap), units_per_metre(scene)
    if player is None:
        return []
    found = []
    drawn = player.drawn_track
    if drawn is not None and drawn.type == "CURVE" and drawn.visible_get():
        try:
            line = drawn_track.build_line(scene, drawn)
        except InputError:  # reported when the track is used
            line = drawn_track.EMPTY_LINE
        for at, speed, wait in zip(line.point_indices, line.speeds, line.waits):
            text = f"{speed:.1f} m/s" if speed > 0.0 else f"stop {wait:.1f} s"
            found.append((tuple(np.array(line.line[at]) * units), text, RGBA))
    for pin in player.pins:
        if pin.target is not None and pin.target.visible_get():
            hold = f" + {pin.hold:.1f}" if pin.hold else ""
            found.append((tuple(pin.target.matrix_world.translation), f"{pin.time:.1f}{hold} s", PIN_RGBA))
    for key in player.heading_keys:
        target = key.find_target() if key.faces == "OBJECT" else None
        if target is not None and target.visible_get():
            hold = f" + {key.hold:.1f}" if key.hold else ""
            found.append((tuple(target.matrix_world.translation), f"faced {key.time:.1f}{hold} s", PIN_RGBA))
    return found


def _draw_labels() -> None:
    import blf

    context = bpy.context
    if context.space_data is None or not context.space_data.overlay.show_overlays:
        return
    scale = context.preferences.system.ui_scale
    for place, text, rgba in build_speed_labels(context.scene):
        at = location_3d_to_region_2d(context.region, context.region_data, place)
        if at is not None:
            blf.size(0, LABEL_SIZE * scale)
            blf.color(0, *rgba)
            blf.position(0, at.x + 8 * scale, at.y + 8 * scale, 0)
            blf.draw(0, text)


WATCHER = Watcher(name="Labels of drawn tracks", draws=((bpy.types.SpaceView3D, _draw_labels, "POST_PIXEL"),))
