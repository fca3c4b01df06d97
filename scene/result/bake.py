"""Writing a take to the scene: armature, action, body, ball, the track on the ground, and the camera's motion."""

from __future__ import annotations

import bpy
import numpy as np

from ...beyond_mocap.base.time_series import interpolate
from ...beyond_mocap.motion.track import sample
from ...beyond_mocap.motion.track.ball_path import BallPath
from ...beyond_mocap.synthesis.take import Take
from ..core import action, channels
from ..core.material import colour
from ..core.measure import frames_per_second, units_per_metre, whole_frames
from ..core.session import Made
from ..core.settings import BeyondMocapPlayer, BeyondMocapSettings
from ..rigs import armature
from ..stage import ball, body, stage

COLLECTION = "Beyond Mocap"
BALL = "Ball"
MARK = "beyond_mocap_take"  # on datablocks created for a take, which the next one may replace or remove

RIBBON_HEIGHT, RIBBON_WIDTH = 0.015, 0.03  # metres above the ground, half the ribbon's width


def frame_at(scene: bpy.types.Scene, seconds: float) -> float:
    """Compute the (fractional) scene frame of a time `seconds` on the tracking file's clock."""
    settings = scene.beyond_mocap
    return settings.start_frame + (seconds - settings.start_time) * frames_per_second(scene)


def player(context: bpy.types.Context, order: BeyondMocapPlayer, made: Made) -> bpy.types.Object:
    """Write a take to the player's armature; creates armature and body if none fits.

    Args:
        context: for the scene.
        owner: the player.
        result: the take with its plan.
    Returns:
        The armature.
    """
    take, scene, settings = made.take, context.scene, context.scene.beyond_mocap
    room = collection(scene)
    target = order.body
    if target is None or not fits(target, take, scene):
        target = armature.create(context, take.motion.skeleton, order.name, room)
        target[MARK] = True
        order.body = target
    if settings.make_bodies and not any(child.type == "MESH" for child in target.children):
        body.create(target, order.name, tuple(order.shirt), collection=room, scene=scene,
                    example=take.motion)[MARK] = True
    channels.discard(target, MARK)
    start = frame_at(scene, take.start_time)
    action.write(target, take.motion, scene, start, f"{order.name} take", generated=True)[MARK] = True
    if settings.make_paths:
        ground = sample(made.plan.track, made.plan.fps).positions
        write_ribbon(context, track_name(order), ground, tuple(order.shirt), room)
    lengthen(scene, start + take.motion.duration * frames_per_second(scene))
    return target


def the_ball(context: bpy.types.Context, path: BallPath) -> bpy.types.Object:
    """Write the ball's trajectory to the scene's ball."""
    scene = context.scene
    room = collection(scene)
    target = room.objects.get(BALL) or ball.create(context, BALL, room)
    channels.discard(target, MARK)
    ball.write(target, path, scene, frame_at(scene, float(path.times[0])))[MARK] = True
    return target


def camera(scene: bpy.types.Scene, takes: list[Take]) -> None:
    """Let the stage's camera follow the middle of all players smoothly, with all of them in view."""
    start = min(take.start_time for take in takes)
    end = max(take.start_time + take.motion.duration for take in takes)
    fps = frames_per_second(scene)
    frames = whole_frames(frame_at(scene, start), end - start, fps)
    seconds = start + (frames - frame_at(scene, start)) / fps
    places = np.array([_places(take, seconds) for take in takes])
    middle = _smooth(0.5 * (places.min(axis=0) + places.max(axis=0)), fps)
    reach = np.linalg.norm(places - middle, axis=-1).max(axis=0)
    stage.follow(scene, frames, middle, _smooth(reach[:, None], fps)[:, 0])


def collection(scene: bpy.types.Scene) -> bpy.types.Collection:
    """Find or create the scene's collection for all baked objects."""
    found = scene.collection.children.get(COLLECTION)
    if found is None:
        found = bpy.data.collections.new(COLLECTION)
        scene.collection.children.link(found)
    return found


def ball_of(takes: list[Take], settings: BeyondMocapSettings) -> BallPath | None:
    """Find the ball of the first take that has one, if a ball is wanted."""
    return next((take.ball for take in takes if take.ball is not None), None) if settings.make_ball else None


def track_name(order: BeyondMocapPlayer) -> str:
    """Return the name of the ribbon that shows a player's track."""
    return f"{order.name} track"


def fits(target: bpy.types.Object, take: Take, scene: bpy.types.Scene) -> bool:
    """Return whether the object is an armature in this scene with the take's bones."""
    if target.type != "ARMATURE" or target.name not in scene.objects or not target.data.bones:
        return False
    return armature.skeleton_of(target, scene).same_bones(take.motion.skeleton)


def lengthen(scene: bpy.types.Scene, last: float) -> None:
    """Extend the scene's frame range to `last`."""
    scene.frame_end = max(scene.frame_end, int(np.floor(last + 1e-4)))


def _places(take: Take, seconds: np.ndarray) -> np.ndarray:
    """Interpolate the player's places on the ground at times on the track's clock: (N, 2) metres."""
    times = take.start_time + np.arange(len(take.motion)) / take.motion.fps
    return interpolate(seconds, times, take.motion.root_positions[:, :2])


def _smooth(places: np.ndarray, fps: float) -> np.ndarray:
    """Compute the running mean of (F, n) over two seconds, for a smooth camera."""
    half = max(1, int(fps))
    padded = np.concatenate([places[:1].repeat(half, axis=0), places, places[-1:].repeat(half, axis=0)])
    total = np.concatenate([np.zeros((1, places.shape[1])), np.cumsum(padded, axis=0)])
    return (total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1)


def write_ribbon(context: bpy.types.Context, name: str, points: np.ndarray, rgb, collection) -> bpy.types.Object:
    """Create a ribbon along points (N, 2) metres, or replace that of the same name in the collection."""
    units = units_per_metre(context.scene)
    data = bpy.data.curves.new(name, "CURVE")
    data.dimensions = "3D"
    data.extrude, data.twist_mode = RIBBON_WIDTH * units, "Z_UP"
    line = data.splines.new("POLY")
    line.points.add(len(points) - 1)
    placed = np.ones((len(points), 4), np.float32)
    placed[:, :2], placed[:, 2] = np.asarray(points) * units, RIBBON_HEIGHT * units
    line.points.foreach_set("co", placed.ravel())
    line.points.foreach_set("tilt", np.full(len(points), -np.pi / 2, np.float32))  # its upper side faces up
    data.materials.append(colour(f"{name} colour", tuple(rgb), 0.9))
    ribbon = collection.objects.get(name)
    if ribbon is None or ribbon.type != "CURVE":
        ribbon = bpy.data.objects.new(name, data)
        collection.objects.link(ribbon)
    else:
        old, ribbon.data = ribbon.data, data
        if not old.users:  # a preview may have stored it
            bpy.data.curves.remove(old)
            data.name = name
    ribbon.hide_select = True
    return ribbon
