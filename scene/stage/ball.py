"""The ball: a mesh of the regulation size, and its trajectory over the pitch with matching roll."""

from __future__ import annotations

import bmesh
import bpy
import numpy as np

from ...beyond_mocap.appearance.sports import SportBall
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
ROLLING_BELOW = 0.16  # metres, height of the centre up to which the ball rolls on the ground


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
    kind = SportBall(radius) if radius is not None else find_sport(context.scene).ball
    mesh = bpy.data.meshes.new(name)
    shape = bmesh.new()
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
    bmesh.ops.scale(shape, vec=units_per_metre(context.scene) * np.array([along, 1.0, 1.0]), verts=shape.verts)
    shape.to_mesh(mesh)
    shape.free()
    if kind.colour is None:
        mesh.materials.append(get_material(MATERIAL, (0.9, 0.9, 0.9), 0.4))
        mesh.materials.append(get_material("Ball black", (0.01, 0.01, 0.012), 0.4))
    else:
        mesh.materials.append(get_material(f"{MATERIAL} {find_sport(context.scene).name}", kind.colour, 0.5))
    ball = bpy.data.objects.new(name, mesh)
    ball.rotation_mode = "QUATERNION"
    ball[ROLLING_RADIUS] = 0.0 if kind.thickness else kind.radius
    collection.objects.link(ball)
    return ball


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
    fps = frames_per_second(scene)
    seconds = path.times - path.times[0]
    frames = whole_frames(start, float(seconds[-1]), fps)
    at = (frames - start) / fps
    places = interpolate_columns(at, *_hold_unknown(seconds, path.positions))
    group = "Object Transforms"
    radius = ball.get(ROLLING_RADIUS, RADIUS)
    curves = {"location": (group, places * units_per_metre(scene)),
              "rotation_quaternion": (group, compute_roll(places, radius) if path.rotations is None
                                      else _sample_rotations(path, at))}
    return channels.create_action(ball, f"{ball.name} path", frames, curves)


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
    for i in np.flatnonzero(places[1:, 2] > ROLLING_BELOW):
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
