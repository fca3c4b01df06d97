"""Film a motion for a rating study: one grey body on a plain floor, constant light, a camera at a constant distance.

Faustino's study (§5.1.1) lacked shadows and the ball.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

from ..beyond_mocap.files.atomic import atomic_folder, atomic_path
from ..beyond_mocap.motion.motion import Motion
from ..beyond_mocap.motion.track.ball_path import BallPath
from .core import action, channels
from .core.material import get_material
from .core.measure import frames_per_second, whole_frames
from .core.saved_state import use_temporary_scene
from .rigs import armature
from .stage import ball, body
from .stage.render_child import MOVIE_OUTPUT, PICTURE_OUTPUT, apply_settings

SHIRT = (0.30, 0.32, 0.35)  # linear RGB, a neutral grey
CAMERA_FROM = (-1.1, -5.2, 0.75)  # metres from the middle of the body
BODY_HEIGHT = 0.95  # metres, height of that middle above the floor
SMOOTHING_SECONDS = 1.0  # seconds of the running mean for the camera's path
_AROUND, _TILE = 24.0, 1.0  # metres of floor around the path, and of a tile; tiles make foot slide visible


@dataclass(frozen=True)
class RenderLook:
    """How clips are rendered.

    Attributes:
        engine: Blender's name.
        size: pixels (width, height).
        fps: frames per second.
        samples: per pixel.
        movie: whether to write an MP4, else a folder of numbered PNGs.
    """

    engine: str
    size: tuple[int, int]
    fps: int
    samples: int
    movie: bool = True


def render_motion(path: Path, motion: Motion, ball_path: BallPath | None, look: RenderLook) -> None:
    """Render a motion to a movie or a folder of pictures, completely or not at all; the blend file stays unchanged.

    Args:
        path: the movie or folder.
        motion: the motion.
        ball_path: its ball, whose first sample is at the motion's first frame, or None.
        look: how to render.
    """
    with use_temporary_scene("Study") as scene:
        _apply_settings(scene, look)
        scene.frame_start, scene.frame_end = 1, 1 + int(motion.duration * look.fps + 1e-4)
        _create_player(scene, motion)
        if ball_path is not None:
            ball.write_trajectory(ball.create_ball(bpy.context, "Ball", scene.collection), ball_path, scene,
                                  float(scene.frame_start))
        _create_floor(scene, motion)
        _create_light(scene)
        _create_camera(scene, motion)
        with atomic_path(path, path.suffix) if look.movie else atomic_folder(path) as temporary:
            scene.render.filepath = str(temporary) if look.movie else f"{temporary}/"
            bpy.ops.render.render(animation=True, scene=scene.name)


def find_engine(requested: str) -> str:
    """Find Blender's name of an engine in this version (EEVEE has two names).

    AUTO is Cycles if there is no window, because EEVEE is very slow without a graphics card. If the Cycles add-on is
    disabled, EEVEE replaces it.

    Args:
        requested: "AUTO", "CYCLES", "EEVEE" or "WORKBENCH".
    Returns:
        Blender's name.
    """
    if requested == "AUTO":
        requested = "CYCLES" if bpy.app.background else "EEVEE"
    if requested == "CYCLES" and not hasattr(bpy.types.Scene, "cycles"):
        requested = "EEVEE"
    names = {item.identifier for item in bpy.types.RenderSettings.bl_rna.properties["engine"].enum_items}
    if requested == "EEVEE":
        return "BLENDER_EEVEE" if "BLENDER_EEVEE" in names else "BLENDER_EEVEE_NEXT"
    return {"CYCLES": "CYCLES", "WORKBENCH": "BLENDER_WORKBENCH"}[requested]


def _apply_settings(scene: bpy.types.Scene, look: RenderLook) -> None:
    """Set the render settings of the scene."""
    render = scene.render
    render.engine, render.fps, render.fps_base = look.engine, look.fps, 1.0
    render.resolution_x, render.resolution_y, render.resolution_percentage = *look.size, 100
    scene.unit_settings.system, scene.unit_settings.scale_length = "METRIC", 1.0
    if look.engine == "CYCLES":
        scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.max_bounces = look.samples, False, 2
    elif look.engine != "BLENDER_WORKBENCH":
        scene.eevee.taa_render_samples = look.samples
    else:
        scene.display.shading.show_shadows = True
    apply_settings(scene, MOVIE_OUTPUT if look.movie else PICTURE_OUTPUT)
    render.use_stamp = False  # stamps would reveal files and times


def _create_player(scene: bpy.types.Scene, motion: Motion) -> None:
    player = armature.create_armature(bpy.context, motion.skeleton, "Body", scene.collection)
    body.create_character(player, "Study", SHIRT, scene.collection, scene, example=motion)
    action.write_motion(player, motion, scene, float(scene.frame_start))
    player.hide_render = True


def _create_floor(scene: bpy.types.Scene, motion: Motion) -> None:
    """Create a floor of tiles in two greys below the whole path."""
    low = np.floor(motion.root_positions[:, :2].min(axis=0) - _AROUND)
    high = np.ceil(motion.root_positions[:, :2].max(axis=0) + _AROUND)
    across, along = (np.arange(a, b + _TILE, _TILE) for a, b in zip(low, high))
    corners = np.stack([*np.meshgrid(across, along, indexing="ij"), np.zeros((len(across), len(along)))], axis=-1)
    number = np.arange(len(across) * len(along)).reshape(len(across), len(along))
    faces = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1)
    mesh = bpy.data.meshes.new("Floor")
    mesh.from_pydata(corners.reshape(-1, 3).tolist(), [], faces.reshape(-1, 4).tolist())
    for name, grey in (("Floor", 0.30), ("Floor tile", 0.36)):
        mesh.materials.append(get_material(name, (grey, grey, grey), 0.95))
    tiles = np.add.outer(np.arange(len(across) - 1), np.arange(len(along) - 1)) % 2
    mesh.polygons.foreach_set("material_index", tiles.ravel().astype(np.int32))
    scene.collection.objects.link(bpy.data.objects.new("Floor", mesh))


def _create_light(scene: bpy.types.Scene) -> None:
    """Create a sun that casts shadows, and a pale sky."""
    data = bpy.data.lights.new("Sun", "SUN")
    data.energy, data.angle = 3.0, 0.03
    sun = bpy.data.objects.new("Sun", data)
    sun.rotation_euler = (0.75, 0.25, 0.5)
    scene.collection.objects.link(sun)
    world = bpy.data.worlds.new("Study")
    if world.node_tree is None:  # Blender before 5.0 creates it on request
        world.use_nodes = True
    sky = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    sky.inputs["Color"].default_value, sky.inputs["Strength"].default_value = (0.72, 0.76, 0.80, 1.0), 0.8
    scene.world = world


def _create_camera(scene: bpy.types.Scene, motion: Motion) -> None:
    """Create a camera with a constant direction that follows the body smoothly."""
    data = bpy.data.cameras.new("Camera")
    data.lens, data.clip_end = 40.0, 500.0
    camera = bpy.data.objects.new("Camera", data)
    scene.collection.objects.link(camera)
    scene.camera = camera
    camera.rotation_euler = Vector(-np.array(CAMERA_FROM)).to_track_quat("-Z", "Y").to_euler()
    frames = whole_frames(float(scene.frame_start), motion.duration, frames_per_second(scene))
    seconds = (frames - scene.frame_start) / frames_per_second(scene)
    path = smooth_path(motion.root_positions[:, :2], motion.fps)
    times = np.arange(len(motion)) / motion.fps
    x, y = (np.interp(seconds, times, path[:, axis]) for axis in range(2))
    positions = np.column_stack([x, y, np.full(len(frames), BODY_HEIGHT)]) + CAMERA_FROM
    channels.create_action(camera, "Camera", frames, {"location": ("Object Transforms", positions)})


def smooth_path(positions: np.ndarray, fps: float) -> np.ndarray:
    """Smooth a path for the camera: the running mean over GLIDE seconds.

    The ends are point-reflected, so that it neither lags nor starts with a jolt.

    Args:
        positions: (T, 2) m.
        fps: frames per second.
    Returns:
        (T, 2) m.
    """
    half = min(int(0.5 * SMOOTHING_SECONDS * fps), len(positions) - 1)
    if half < 1:
        return positions
    before, after = 2.0 * positions[:1] - positions[half:0:-1], 2.0 * positions[-1:] - positions[-2 : -half - 2 : -1]
    total = np.cumsum(np.concatenate([np.zeros((1, 2)), before, positions, after]), axis=0)
    return (total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1)
