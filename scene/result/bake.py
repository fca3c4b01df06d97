"""Writing a take to the scene: armature, action, body, ball, and the track on the ground."""

from __future__ import annotations

import bpy
import numpy as np

from ...beyond_mocap.motion.track import sample_track
from ...beyond_mocap.motion.track.ball_path import BallPath
from ...beyond_mocap.synthesis.take import Take
from ..core import action, channels, take_record
from ..core.frame_range import extend_range
from ..core.material import get_material
from ..core.measure import frames_per_second, units_per_metre, whole_frames
from ..core.names import find_named
from ..core.session import StoredTake
from ..core.settings import BeyondMocapPlayer, BeyondMocapSettings
from ..rigs import armature
from ..stage import ball, body

COLLECTION = "Beyond Mocap"
BALL = "Ball"
MARK = "beyond_mocap_take"  # on datablocks created for a take, which the next one may replace or remove

RIBBON_HEIGHT, RIBBON_WIDTH = 0.03, 0.03  # metres above the ground, half the ribbon's width


def compute_frame(scene: bpy.types.Scene, seconds: float) -> float:
    """Compute the (fractional) scene frame of a time `seconds` on the tracking file's clock."""
    settings = scene.beyond_mocap
    return settings.start_frame + (seconds - settings.start_time) * frames_per_second(scene)


def write_take(context: bpy.types.Context, owner: BeyondMocapPlayer, result: StoredTake) -> bpy.types.Object:
    """Write a take to the player's armature; creates armature and body if none fits.

    Args:
        context: for the scene.
        owner: the player.
        result: the take with its plan.
    Returns:
        The armature.
    """
    take, scene, settings = result.take, context.scene, context.scene.beyond_mocap
    room = find_or_create_collection(scene)
    target = owner.body
    if target is None or not is_matching(target, take, scene):
        target = armature.create_armature(context, take.motion.skeleton, owner.name, room)
        target[MARK] = True
        owner.body = target
    if settings.make_bodies and not any(child.type == "MESH" for child in target.children):
        body.create_character(target, owner.name, tuple(owner.shirt), collection=room, scene=scene,
                              example=take.motion)[MARK] = True
    channels.remove_marked_action(target, MARK)
    start = compute_frame(scene, take.start_time)
    action.write_motion(target, take.motion, scene, start, f"{owner.name} take", generated=True)[MARK] = True
    if settings.make_paths:
        ground = sample_track(result.plan.track, result.plan.fps).positions
        write_ribbon(context, build_track_name(owner), ground, tuple(owner.shirt), room)
    extend_range(scene, start + take.motion.duration * frames_per_second(scene))
    return target


def store_record(written: bpy.types.Action, take: Take, scene: bpy.types.Scene) -> None:
    """Store on a take's action what a bake and an export need of the take."""
    fps, start = frames_per_second(scene), compute_frame(scene, take.start_time)
    frames = whole_frames(start, take.motion.duration, fps)
    at = np.round((frames - start) * take.motion.fps / fps).astype(int)
    take_record.store_contacts(written, frames, take.contacts[np.clip(at, 0, len(take.contacts) - 1)])
    written[take_record.RATE] = float(take.motion.fps)


def write_ball(context: bpy.types.Context, path: BallPath) -> bpy.types.Object:
    """Write the ball's trajectory to the scene's ball."""
    scene = context.scene
    room = find_or_create_collection(scene)
    target = find_named(room.objects, BALL) or ball.create_ball(context, BALL, room)
    channels.remove_marked_action(target, MARK)
    ball.write_trajectory(target, path, scene, compute_frame(scene, float(path.times[0])))[MARK] = True
    return target


def find_or_create_collection(scene: bpy.types.Scene) -> bpy.types.Collection:
    """Find or create the scene's collection for all baked objects."""
    found = find_named(scene.collection.children, COLLECTION)
    if found is None:
        found = bpy.data.collections.new(COLLECTION)
        scene.collection.children.link(found)
    return found


def find_ball(takes: list[Take], settings: BeyondMocapSettings) -> BallPath | None:
    """Find the ball of the first take that has one, if a ball is wanted."""
    return next((take.ball for take in takes if take.ball is not None), None) if settings.make_ball else None


def build_track_name(owner: BeyondMocapPlayer) -> str:
    """Return the name of the ribbon that shows a player's track."""
    return f"{owner.name} track"


def is_matching(target: bpy.types.Object, take: Take, scene: bpy.types.Scene) -> bool:
    """Return whether the object is an armature in this scene with the take's bones."""
    if target.type != "ARMATURE" or target.name not in scene.objects or not target.data.bones:
        return False
    return armature.build_skeleton(target, scene).has_same_bones(take.motion.skeleton)


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
    data.materials.append(get_material(f"{name} colour", tuple(rgb), 0.9))
    ribbon = find_named(collection.objects, name)
    if ribbon is None or ribbon.type != "CURVE":
        ribbon = bpy.data.objects.new(name, data)
        collection.objects.link(ribbon)
    else:
        old, ribbon.data = ribbon.data, data
        if not old.users:  # a preview may have stored it
            bpy.data.curves.remove(old)
            data.name = name
    ribbon.hide_select = ribbon.hide_render = True
    return ribbon
