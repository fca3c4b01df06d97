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
MARK = "beyond_mocap_focus"
HALF_WIDTH = 0.36  # metres to either side that the camera shows with some margin, per metre of its distance
CAMERA_FROM = (-1.5, -8.5, 1.3)  # metres from the focus: from the touchline, a little above the players' heads


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


def focus(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """The empty that the stage's camera hangs on; None where there is no such camera."""
    stage = scene.collection.children.get(NAME)
    return stage.objects.get(FOCUS) if stage else None


def follow(scene: bpy.types.Scene, frames: np.ndarray, places: np.ndarray, reach: np.ndarray) -> None:
    """Let the stage's camera follow and stand back as far as it takes; nothing happens where there is no such camera.

    frames: (F,) scene frames. places: (F, 2) metres, the middle of what is to be seen. reach: (F,) metres from there to
    the farthest player. The camera hangs on an empty, whose size is its distance.
    """
    target = focus(scene)
    if target is None:
        return
    path = np.column_stack([places * units_per_metre(scene), np.full(len(frames), target.location.z)])
    distance = np.maximum(1.0, reach / (HALF_WIDTH * np.linalg.norm(CAMERA_FROM)))
    group = "Object Transforms"
    curves = {"location": (group, path), "scale": (group, np.repeat(distance[:, None], 3, axis=1))}
    channels.discard(target, MARK)
    channels.animate(target, FOCUS, frames, curves)[MARK] = True


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
    """All markings as ribbons a few millimetres above the grass, each a little higher, lest crossings flicker."""
    corners, faces = [], []
    for number, stroke in enumerate(_strokes()):
        height = 0.004 + 0.0004 * number
        first = len(corners)
        corners += [((*corner, height)) for corner in _ribbon(np.array(stroke, float))]
        faces += [(i, i + 1, i + 3, i + 2) for i in range(first, len(corners) - 2, 2)]
    mesh = _mesh("Lines", np.array(corners) * units, faces)
    mesh.materials.append(colour("Line white", (0.85, 0.85, 0.85), 0.9))
    _place(stage, "Lines", mesh)


def _strokes() -> list:
    """The middles of all lines, each a row of points (x, y) in metres."""
    x, y, spot = LENGTH / 2, WIDTH / 2, LINE / 2
    strokes = [_box(-x, -y, x, y), [(0, -y), (0, y)], _arc((0, 0), 9.15, 0, 360), _arc((0, 0), spot, 0, 360)]
    for side in (-1, 1):
        goal, mark, inward = side * x, side * (x - 11.0), 180 if side > 0 else 0
        for half_width, depth in ((20.16, 16.5), (9.16, 5.5)):
            front = goal - side * depth
            strokes.append([(goal, half_width), (front, half_width), (front, -half_width), (goal, -half_width)])
        strokes += [_arc((mark, 0), 9.15, inward - 53, inward + 53), _arc((mark, 0), spot, 0, 360)]
        for touch in (-1, 1):
            middle = np.degrees(np.arctan2(-touch, -side))
            strokes.append(_arc((goal, touch * y), 1.0, middle - 45, middle + 45))
    return strokes


def _ribbon(points: np.ndarray) -> np.ndarray:
    """Left and right edge, in turn, of a line along points (N, 2), mitred at its corners: (2 N, 2)."""
    along = np.diff(points, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    closed = np.allclose(points[0], points[-1])
    before = np.concatenate([along[-1:] if closed else along[:1], along])
    after = np.concatenate([along, along[:1] if closed else along[-1:]])
    bisector = before + after
    across = np.stack([-bisector[:, 1], bisector[:, 0]], axis=1)
    across /= np.sum(across * np.stack([-before[:, 1], before[:, 0]], axis=1), axis=1, keepdims=True)
    return np.stack([points + across * LINE / 2, points - across * LINE / 2], axis=1).reshape(-1, 2)


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
    light.energy, light.angle = 2.8, 0.03
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
    background.inputs["Strength"].default_value = 1.1
    return world
