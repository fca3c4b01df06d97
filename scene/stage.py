"""Where the players stand: a pitch with its lines, daylight, and a camera that keeps them in view."""

from __future__ import annotations

import bpy
import numpy as np

from . import channels
from .material import colour
from .measure import units_per_metre

LENGTH, WIDTH, LINE = 105.0, 68.0, 0.12  # metres; International Football Association Board, Laws of the Game, Law 1
NAME = "Stage"
FOCUS = "Stage focus"
CAMERA_FROM = (-1.5, -9.5, 3.4)  # metres from the focus: from the touchline, a little above the players' heads


def create(context: bpy.types.Context, camera: bool = True) -> bpy.types.Collection:
    """A collection "Stage" with pitch, sun and, if wanted, a camera; an older one of that name is taken away first."""
    scene = context.scene
    remove(scene)
    stage = bpy.data.collections.new(NAME)
    scene.collection.children.link(stage)
    units = units_per_metre(scene)
    _ground(stage, units)
    _lines(stage, units)
    _sun(stage)
    if camera:
        scene.camera = _camera(stage, units)
    if scene.world is None:
        scene.world = _sky()
    return stage


def remove(scene: bpy.types.Scene) -> None:
    """Take the stage away, with the meshes, lights and cameras that only it used."""
    stage = scene.collection.children.get(NAME)
    if stage is None:
        return
    for thing in list(stage.objects):
        data = thing.data
        bpy.data.objects.remove(thing)
        if data is not None and not data.users:
            bpy.data.batch_remove([data])
    bpy.data.collections.remove(stage)


def follow(scene: bpy.types.Scene, frames: np.ndarray, places: np.ndarray) -> None:
    """Let the stage's camera follow `places` (F, 2) metres over scene frames (F,); nothing happens where there is none."""
    stage = scene.collection.children.get(NAME)
    focus = stage.objects.get(FOCUS) if stage else None
    if focus is None:
        return
    units = units_per_metre(scene)
    path = np.column_stack([places * units, np.full(len(frames), focus.location.z)])
    channels.discard(focus, "beyond_mocap_focus")
    channels.animate(focus, FOCUS, frames, {"location": ("Object Transforms", path)})["beyond_mocap_focus"] = True


def _ground(stage, units: float) -> None:
    x, y = (LENGTH / 2 + 6.0) * units, (WIDTH / 2 + 6.0) * units
    stripes = np.linspace(-x, x, 25)
    corners = [(a, b, 0.0) for a in stripes for b in (-y, y)]
    faces = [(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(len(stripes) - 1)]
    mesh = _mesh("Grass", corners, faces)
    mesh.materials.append(colour("Grass", (0.055, 0.16, 0.035), 0.95))
    mesh.materials.append(colour("Grass mown", (0.07, 0.195, 0.045), 0.95))
    mesh.polygons.foreach_set("material_index", np.arange(len(faces), dtype=np.int32) % 2)
    _place(stage, "Grass", mesh)


def _lines(stage, units: float) -> None:
    """All markings as thin quads a few millimetres above the grass."""
    x, y = LENGTH / 2, WIDTH / 2
    strokes = [_box(-x, -y, x, y), [(0, -y), (0, y)], _arc((0, 0), 9.15, 0, 360), _arc((0, 0), 0.12, 0, 360)]
    for side in (-1, 1):
        goal = side * x
        strokes += [[(goal, w), (goal - side * depth, w), (goal - side * depth, -w), (goal, -w)]
                    for w, depth in ((20.16, 16.5), (9.16, 5.5))]
        middle = 180 if side > 0 else 0
        strokes += [_arc((goal - side * 11.0, 0), 9.15, middle - 53, middle + 53), _arc((goal - side * 11, 0), 0.12, 0, 360)]
        strokes += [_arc((goal, s * y), 1.0, 90 + 45 * (side + 1) if s < 0 else 180 * (side > 0) - 90 * (side < 0),
                         180 + 45 * (side + 1) if s < 0 else 180 * (side > 0) + 90 - 90 * (side < 0)) for s in (-1, 1)]
    corners, faces = [], []
    for stroke in strokes:
        points = np.array(stroke, float)
        for a, b in zip(points[:-1], points[1:]):
            along = (b - a) / np.linalg.norm(b - a) * LINE / 2
            across = np.array([-along[1], along[0]])
            first = len(corners)
            quad = (a - along - across, b + along - across, b + along + across, a - along + across)
            corners += [(*corner * units, 0.006 * units) for corner in quad]
            faces.append((first, first + 1, first + 2, first + 3))
    mesh = _mesh("Lines", corners, faces)
    mesh.materials.append(colour("Line white", (0.85, 0.85, 0.85), 0.9))
    _place(stage, "Lines", mesh)


def _box(x0, y0, x1, y1):
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]


def _arc(centre, radius, start, end):
    angles = np.radians(np.linspace(start, end, max(8, int((end - start) / 6)) + 1))
    return [(centre[0] + radius * np.cos(a), centre[1] + radius * np.sin(a)) for a in angles]


def _mesh(name: str, corners, faces) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    return mesh


def _place(stage, name: str, data) -> bpy.types.Object:
    thing = bpy.data.objects.new(name, data)
    thing.hide_select = data is not None and isinstance(data, bpy.types.Mesh)
    stage.objects.link(thing)
    return thing


def _sun(stage) -> None:
    light = bpy.data.lights.new("Sun", "SUN")
    light.energy, light.angle = 3.2, 0.03
    _place(stage, "Sun", light).rotation_euler = (0.75, 0.25, 0.5)


def _camera(stage, units: float) -> bpy.types.Object:
    focus = _place(stage, FOCUS, None)
    focus.empty_display_size = 0.5 * units
    focus.location = (0.0, 0.0, 0.9 * units)
    data = bpy.data.cameras.new("Camera")
    data.lens, data.clip_end = 40.0, 1000.0 * units
    camera = _place(stage, "Camera", data)
    camera.parent = focus
    camera.location = [distance * units for distance in CAMERA_FROM]
    look = camera.constraints.new("TRACK_TO")
    look.target = focus
    look.track_axis, look.up_axis = "TRACK_NEGATIVE_Z", "UP_Y"
    return camera


def _sky() -> bpy.types.World:
    world = bpy.data.worlds.new("Sky")
    if world.node_tree is None:
        world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.55, 0.68, 0.85, 1.0)
    background.inputs["Strength"].default_value = 0.8
    return world
