"""The ball: a mesh of the regulation size, and its trajectory over the pitch with matching roll."""

from __future__ import annotations

import bmesh
import bpy
import numpy as np

from ...beyond_mocap.appearance.sports import FOOTBALL, SportBall
from ...beyond_mocap.base.time_series import interpolate_columns
from ...beyond_mocap.motion import quaternion
from ...beyond_mocap.motion.track.ball_path import BallPath
from ..core import channels
from ..core.material import get_material
from ..core.measure import frames_per_second, units_per_metre, whole_frames
from .stage_collection import find_sport

RADIUS = 0.11  # metres, Laws of the Game: circumference 0.68 to 0.70 m
MATERIAL = "Ball white"
ROLLING_RADIUS = "beyond_mocap_rolling_radius"  # custom property of a ball: metres, 0 for a disc, which slides
ROLLS = "beyond_mocap_rolls"  # custom property of an action whose rotations are the ball's roll
SPORT = "beyond_mocap_sport"  # custom property of a mesh: the sport whose ball it is, which changes with the stage's
_SAME_RADIUS = 0.002  # metres
_ABOVE_GROUND = 0.05  # metres between a ball and the ground up to which it rolls


def create_ball(context: bpy.types.Context, name: str, collection, radius: float | None = None) -> bpy.types.Object:
    """Create a ball in a collection.

    Args:
        context: Blender's context.
        name: of the ball.
        collection: where it is linked.
        radius: of a football of another size, m; None for the ball of the sport that the scene's stage is for.
    Returns:
        The ball.
    """
    sport = find_sport(context.scene)
    kind = sport.ball if radius is None else SportBall(radius)
    mesh = _build_mesh(name, context.scene, kind, sport.name)
    if radius is None:
        mesh[SPORT] = sport.name
    ball = bpy.data.objects.new(name, mesh)
    ball[ROLLING_RADIUS] = _find_rolling_radius(kind)
    ball.rotation_mode = "QUATERNION"
    collection.objects.link(ball)
    return ball


def _find_rolling_radius(kind: SportBall) -> float:
    return 0.0 if kind.thickness else kind.radius


def _build_mesh(name: str, scene: bpy.types.Scene, kind: SportBall, sport: str) -> bpy.types.Mesh:
    """Build the mesh of a ball with its materials."""
    mesh, shape = bpy.data.meshes.new(name), bmesh.new()
    if kind.thickness:
        bmesh.ops.create_cone(shape, cap_ends=True, segments=32, radius1=kind.radius, radius2=kind.radius,
                              depth=kind.thickness)
    else:
        bmesh.ops.create_icosphere(shape, subdivisions=4, radius=kind.radius)
    along = kind.length / (2.0 * kind.radius) if kind.length else 1.0
    patches = _build_pentagons()
    for face in shape.faces:
        face.smooth = not kind.thickness
        face.material_index = int(kind.colour is None and np.max(patches @ np.array(face.normal)) > 0.94)
    bmesh.ops.scale(shape, vec=units_per_metre(scene) * np.array([along, 1.0, 1.0]), verts=shape.verts)
    shape.to_mesh(mesh)
    shape.free()
    for material in _get_materials(kind, sport):
        mesh.materials.append(material)
    return mesh


def _get_materials(kind: SportBall, sport: str) -> tuple[bpy.types.Material, ...]:
    if kind.colour is not None:
        return (get_material(f"{MATERIAL} {sport}", kind.colour, 0.5),)
    return get_material(MATERIAL, (0.9, 0.9, 0.9), 0.4), get_material("Ball black", (0.01, 0.01, 0.012), 0.4)


def update_sport_balls(scene: bpy.types.Scene) -> None:
    """Give the balls of a scene that are its sport's the look, the radius and the roll of the sport that it has now.

    Balls of a size of their own, and meshes of the user, stay as they are.
    """
    sport = find_sport(scene)
    for ball in scene.objects:
        mesh = ball.data if is_ball(ball) and ball.library is None else None
        if mesh is None or _find_ball_sport(ball, scene) in (None, sport.name):
            continue
        ball.data = _build_mesh(mesh.name, scene, sport.ball, sport.name)
        ball.data[SPORT], ball[ROLLING_RADIUS] = sport.name, _find_rolling_radius(sport.ball)
        if not mesh.users:
            bpy.data.meshes.remove(mesh)
        _write_roll(ball, scene)


def _find_ball_sport(ball: bpy.types.Object, scene: bpy.types.Scene) -> str | None:
    """Find the sport whose ball an object is; None for a size of its own. Earlier versions had footballs, unmarked."""
    is_marked = SPORT in ball.data or ROLLING_RADIUS in ball
    if not is_marked and abs(find_rolling_radius(ball, scene) - RADIUS) < _SAME_RADIUS:
        return FOOTBALL
    return ball.data.get(SPORT)


def _write_roll(ball: bpy.types.Object, scene: bpy.types.Scene) -> None:
    """Write the roll of a ball again where `write_trajectory` gave it one."""
    action, slot = channels.find_playing_action(ball)
    if action is None or not action.get(ROLLS) or action.library is not None:
        return
    curves = channels.collect_curves(action, slot)
    location, turn = [curves.get(("location", axis)) for axis in range(3)], curves.get(("rotation_quaternion", 0))
    if None in location or turn is None:
        return
    frames = channels.read_keys(turn)["co"][:, 0]
    places = np.stack([channels.sample_curve(curve, frames) for curve in location], axis=1) / units_per_metre(scene)
    channels.replace_keys(ball, frames, {"rotation_quaternion": compute_roll(places, find_rolling_radius(ball, scene))})


def is_ball(thing: bpy.types.Object) -> bool:
    """Return whether an object is a ball of `create_ball`, of this or an earlier version."""
    materials = thing.data.materials if thing.type == "MESH" else ()
    return any(material is not None and material.name.startswith(MATERIAL) for material in materials)


def write_trajectory(ball: bpy.types.Object, path: BallPath, scene: bpy.types.Scene, start: float) -> bpy.types.Action:
    """Bake the ball's trajectory and roll with a key on every whole scene frame; where its place is not known it waits.

    Args:
        ball: the object.
        path: the trajectory.
        scene: says frame rate and unit scale.
        start: scene frame of the path's first sample.
    Returns:
        The action.
    """
    action = channels.create_action(ball, f"{ball.name} path", *build_keys(ball, path, scene, start))
    action[ROLLS] = path.rotations is None
    return action


def build_keys(ball: bpy.types.Object, path: BallPath, scene: bpy.types.Scene, start: float):
    """Build the keys that `write_trajectory` writes, as `channels.create_action` takes them.

    Returns:
        Whole scene frames (F,), and the values of every curve.
    """
    fps = frames_per_second(scene)
    seconds = path.times - path.times[0]
    frames = whole_frames(start, float(seconds[-1]), fps)
    at = (frames - start) / fps
    places = interpolate_columns(at, *_hold_unknown(seconds, path.positions))
    group = "Object Transforms"
    return frames, {"location": (group, places * units_per_metre(scene)),
                    "rotation_quaternion": (group, compute_roll(places, find_rolling_radius(ball, scene))
                                            if path.rotations is None else _sample_rotations(path, at))}


def find_rolling_radius(ball: bpy.types.Object, scene: bpy.types.Scene) -> float:
    """Find the radius in metres by which a ball rolls, also of the user's own; 0 for a disc, which slides."""
    if ROLLING_RADIUS in ball:
        return ball[ROLLING_RADIUS] * ball.scale[1]
    across = min(ball.dimensions) / units_per_metre(scene)
    return across / 2.0 if across > 0.0 else RADIUS


def _hold_unknown(seconds: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Let a ball at (T, 3) m wait where it was last known; before it is first known, where that will be."""
    known = np.isfinite(places).all(axis=1)
    if known.all() or not known.any():
        return seconds, places
    last = np.maximum.accumulate(np.where(known, np.arange(len(places)), -1))
    return seconds, places[np.where(last < 0, np.argmax(known), last)]


def _sample_rotations(path: BallPath, at: np.ndarray) -> np.ndarray:
    """Interpolate the rotations (F, 4) of a path that has its own, at seconds (F,) after its first sample."""
    seconds = path.times - path.times[0]
    after = np.clip(np.searchsorted(seconds, at), 1, len(seconds) - 1)
    share = np.clip((at - seconds[after - 1]) / (seconds[after] - seconds[after - 1]), 0.0, 1.0)
    return quaternion.unify_signs(quaternion.slerp(path.rotations[after - 1], path.rotations[after], share))


def compute_roll(places: np.ndarray, radius: float = RADIUS) -> np.ndarray:
    """Compute the rotations of a ball that rolls on the ground; in the air it keeps its rotation per frame.

    Args:
        places: (F, 3) metres, the ball's centre.
        radius: metres; 0: it never turns.
    Returns:
        (F, 4) quaternions.
    """
    if not radius:
        return quaternion.identity(len(places))
    step = np.diff(places, axis=0)
    rotation_steps = np.stack([-step[:, 1], step[:, 0], np.zeros(len(step))],
                              axis=1) / radius  # up x step: rotation vectors
    for i in np.flatnonzero(places[1:, 2] > radius + _ABOVE_GROUND):
        rotation_steps[i] = rotation_steps[i - 1] if i else rotation_steps[i]
    out = quaternion.identity(len(places))
    for i, spin in enumerate(quaternion.from_rotation_vector(rotation_steps)):
        out[i + 1] = quaternion.multiply(spin, out[i])
    return quaternion.unify_signs(quaternion.normalize(out))


def _build_pentagons() -> np.ndarray:
    """Return the directions (12, 3) of a football's pentagons: the corners of an icosahedron."""
    golden = (1.0 + 5.0**0.5) / 2.0
    corners = [(0.0, a, b * golden) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
    corners = np.array([np.roll(corner, shift) for corner in corners for shift in range(3)])
    return corners / np.linalg.norm(corners[0])
