"""The stage: a pitch of any size that the Laws of the Game allow, with grass, lines, goals and nets, daylight, and a
camera that follows the players.
"""

from __future__ import annotations

import bpy
import numpy as np

from ..core import channels
from ..core.material import get_material
from ..core.measure import units_per_metre

NAME = "Stage"
FOCUS = "Stage focus"
MARK = "beyond_mocap_focus"
STAGE_MARK = "beyond_mocap_stage"
"""Custom property of the collection and of everything that `create_stage` adds to it."""

OLDER_NAMES = {"Grass", "Lines", "Sun", "Camera", FOCUS}  # objects of stages in older files, without that property
HALF_WIDTH = 0.36  # metres to either side that the camera shows with some margin, for each metre of distance
CAMERA_FROM = (-1.5, -8.5, 1.3)  # metres from the focus: from the touchline, a little above the players' heads

SIZE, LINE_WIDTH = (105.0, 68.0), 0.12  # metres; International Football Association Board, Laws of the Game, Law 1
GOAL, BAR, POST = 7.32, 2.44, 0.06  # metres between the posts, below the bar, of a post's radius
ROOF, FLOOR = 0.9, 2.1  # metres, depth of the net at the bar and on the ground
MESH, CORD = 0.15, 0.003  # metres between the net's cords, and half a cord's width
BEYOND = 6.0  # metres of grass beyond the lines


def create_stage(context: bpy.types.Context, camera: bool = True) -> bpy.types.Collection:
    """Create the collection "Stage" with pitch, sun and, if wanted, a camera; an older stage is removed first."""
    scene = context.scene
    remove_stage(scene)
    stage = bpy.data.collections.new(NAME)
    scene.collection.children.link(stage)
    units = units_per_metre(scene)
    create_grass(stage, units)
    create_lines(stage, units)
    create_sun(stage)
    if camera:
        scene.camera = _create_camera(stage, units)
    for thing in (stage, *stage.objects):
        thing[STAGE_MARK] = True
    if scene.world is None:
        scene.world = create_sky()
    return stage


def remove_stage(scene: bpy.types.Scene) -> None:
    """Remove the stage with the meshes, lights and cameras that only it used.

    Objects that the user added to its collection stay, and so does another collection of that name.
    """
    stage = _find_stage(scene)
    if stage is None:
        return
    for thing in _list_own_objects(stage):
        data = thing.data
        bpy.data.objects.remove(thing)
        if data is not None and not data.users:
            bpy.data.batch_remove([data])
    if not stage.objects and not stage.children:
        bpy.data.collections.remove(stage)


def find_focus(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Return the empty that the stage's camera is attached to; None where there is no such camera."""
    stage = _find_stage(scene)
    return stage.objects.get(FOCUS) if stage else None


def animate_camera(scene: bpy.types.Scene, frames: np.ndarray, places: np.ndarray, reach: np.ndarray) -> None:
    """Animate the stage's camera to follow the players at a sufficient distance; nothing happens without such a camera.

    The camera is a child of an empty, whose scale is its distance.

    Args:
        scene: the scene.
        frames: (F,) scene frames.
        places: (F, 2) metres, the middle of what should be visible.
        reach: (F,) metres from there to the farthest player.
    """
    target = find_focus(scene)
    if target is None:
        return
    path = np.column_stack([places * units_per_metre(scene), np.full(len(frames), target.location.z)])
    distance = np.maximum(1.0, reach / (HALF_WIDTH * np.linalg.norm(CAMERA_FROM)))
    group = "Object Transforms"
    curves = {"location": (group, path), "scale": (group, np.repeat(distance[:, None], 3, axis=1))}
    channels.remove_marked_action(target, MARK)
    channels.create_action(target, FOCUS, frames, curves)[MARK] = True


def create_sun(collection) -> bpy.types.Object:
    """Create daylight from above, slightly from the side."""
    light = bpy.data.lights.new("Sun", "SUN")
    light.energy, light.angle = 2.8, 0.03
    thing = create_object(collection, "Sun", light)
    thing.rotation_euler = (0.75, 0.25, 0.5)
    return thing


def create_sky() -> bpy.types.World:
    """Create a world of pale blue."""
    world = bpy.data.worlds.new("Sky")
    if world.node_tree is None:
        world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.55, 0.68, 0.85, 1.0)
    background.inputs["Strength"].default_value = 1.1
    return world


def create_grass(collection, units: float, size: tuple[float, float] = SIZE) -> bpy.types.Object:
    """Create mown grass in stripes, a little larger than a pitch of `size` (length, width) metres."""
    x, y = (size[0] / 2 + BEYOND) * units, (size[1] / 2 + BEYOND) * units
    stripes = np.linspace(-x, x, 25)
    corners = [(a, b, 0.0) for a in stripes for b in (-y, y)]
    faces = [(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(len(stripes) - 1)]
    mesh = _create_mesh("Grass", corners, faces)
    mesh.materials.append(get_material("Grass", (0.055, 0.16, 0.035), 0.95))
    mesh.materials.append(get_material("Grass mown", (0.07, 0.195, 0.045), 0.95))
    mesh.polygons.foreach_set("material_index", np.arange(len(faces), dtype=np.int32) % 2)
    return create_object(collection, "Grass", mesh)


def create_lines(collection, units: float, size: tuple[float, float] = SIZE) -> bpy.types.Object:
    """Create all markings as ribbons a few millimetres above the grass, each a little higher to avoid z-fighting."""
    corners, faces = [], []
    for number, stroke in enumerate(_build_strokes(*size)):
        height = 0.004 + 0.0004 * number
        first = len(corners)
        corners += [((*corner, height)) for corner in _build_ribbon(np.array(stroke, float))]
        faces += [(i, i + 1, i + 3, i + 2) for i in range(first, len(corners) - 2, 2)]
    mesh = _create_mesh("Lines", np.array(corners) * units, faces)
    mesh.materials.append(get_material("Line white", (0.85, 0.85, 0.85), 0.9))
    return create_object(collection, "Lines", mesh)


def create_goals(collection, units: float, length: float = SIZE[0]) -> list[bpy.types.Object]:
    """Create both goals of a pitch of `length` metres: posts and bar with the net behind, one shared mesh each."""
    frame = _create_tubes(_build_goal_frame())
    frame.materials.append(get_material("Goal white", (0.9, 0.9, 0.9), 0.35))
    net = _create_cords(_build_net())
    net.materials.append(get_material("Net white", (0.75, 0.75, 0.75), 0.9))
    objects = []
    for side, turn in (("right", 0.0), ("left", np.pi)):
        for mesh, name in ((frame, f"Goal {side}"), (net, f"Net {side}")):
            thing = create_object(collection, name, mesh)
            thing.location.x = (length / 2 if turn == 0.0 else -length / 2) * units
            thing.rotation_euler.z = turn
            thing.scale = (units,) * 3
            objects.append(thing)
    return objects


def create_object(collection, name: str, data) -> bpy.types.Object:
    """Create an object in a collection; meshes are not selectable in the view."""
    thing = bpy.data.objects.new(name, data)
    thing.hide_select = data is not None and isinstance(data, bpy.types.Mesh)
    collection.objects.link(thing)
    return thing


def _find_stage(scene: bpy.types.Scene) -> bpy.types.Collection | None:
    """Find the collection of `create_stage`, of this or an earlier version."""
    found = next((one for one in scene.collection.children if one.get(STAGE_MARK) and one.library is None), None)
    if found is not None:
        return found
    by_name = scene.collection.children.get(NAME)
    return by_name if by_name is not None and _list_own_objects(by_name) else None


def _list_own_objects(stage: bpy.types.Collection) -> list[bpy.types.Object]:
    """List the objects that `create_stage` added to a collection."""
    if stage.get(STAGE_MARK):
        return [thing for thing in stage.objects if thing.get(STAGE_MARK)]
    base_names = {thing: thing.name.split(".")[0] for thing in stage.objects}
    whole = {"Grass", "Lines"} <= set(base_names.values())
    return [thing for thing, name in base_names.items() if whole and name in OLDER_NAMES]


def _create_camera(stage, units: float) -> bpy.types.Object:
    """Create the camera with the empty that it looks at and moves with."""
    focus = create_object(stage, FOCUS, None)
    focus.empty_display_size = 0.5 * units
    focus.location = (0.0, 0.0, 0.9 * units)
    data = bpy.data.cameras.new("Camera")
    data.lens, data.clip_end = 40.0, 1000.0 * units
    camera = create_object(stage, "Camera", data)
    camera.parent = focus
    camera.location = [distance * units for distance in CAMERA_FROM]
    look = camera.constraints.new("TRACK_TO")
    look.target = focus
    look.track_axis, look.up_axis = "TRACK_NEGATIVE_Z", "UP_Y"
    return camera


def _build_strokes(length: float, width: float) -> list:
    """Build the centre lines of all markings, each a list of points (x, y) in metres."""
    x, y, spot = length / 2, width / 2, LINE_WIDTH / 2
    strokes = [_build_box(-x, -y, x, y), [(0, -y), (0, y)], _build_arc((0, 0), 9.15, 0, 360),
               _build_arc((0, 0), spot, 0, 360)]
    for side in (-1, 1):
        goal, mark, inward = side * x, side * (x - 11.0), 180 if side > 0 else 0
        for half_width, depth in ((20.16, 16.5), (9.16, 5.5)):
            front = goal - side * depth
            strokes.append([(goal, half_width), (front, half_width), (front, -half_width), (goal, -half_width)])
        strokes += [_build_arc((mark, 0), 9.15, inward - 53, inward + 53), _build_arc((mark, 0), spot, 0, 360)]
        for touch in (-1, 1):
            middle = np.degrees(np.arctan2(-touch, -side))
            strokes.append(_build_arc((goal, touch * y), 1.0, middle - 45, middle + 45))
    return strokes


def _build_ribbon(points: np.ndarray) -> np.ndarray:
    """Build left and right edges, alternating, of a line along points (N, 2), mitred at its corners: (2 N, 2)."""
    along = np.diff(points, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    closed = np.allclose(points[0], points[-1])
    before = np.concatenate([along[-1:] if closed else along[:1], along])
    after = np.concatenate([along, along[:1] if closed else along[-1:]])
    bisector = before + after
    across = np.stack([-bisector[:, 1], bisector[:, 0]], axis=1)
    across /= np.sum(across * np.stack([-before[:, 1], before[:, 0]], axis=1), axis=1, keepdims=True)
    return np.stack([points + across * LINE_WIDTH / 2, points - across * LINE_WIDTH / 2], axis=1).reshape(-1, 2)


def _build_box(x0, y0, x1, y1):
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]


def _build_arc(centre, radius, start, end):
    angles = np.radians(np.linspace(start, end, max(8, int((end - start) / 6)) + 1))
    return [(centre[0] + radius * np.cos(a), centre[1] + radius * np.sin(a)) for a in angles]


def _build_goal_frame() -> list[tuple[np.ndarray, np.ndarray]]:
    """Build posts and bar of the goal at x = 0 that opens towards -x: the ends of their centre lines, metres."""
    y, z = GOAL / 2 + POST, BAR + POST
    ends = [((0, -y, 0), (0, -y, z)), ((0, y, 0), (0, y, z)), ((0, -y - POST, z), (0, y + POST, z))]
    return [(np.array(a, float), np.array(b, float)) for a, b in ends]


def _build_net() -> list[tuple[np.ndarray, np.ndarray]]:
    """Build the net's cords behind that goal, as ends (3,) metres: roof, back and both sides."""
    y, z = GOAL / 2 + POST, BAR
    roof, floor = np.array([ROOF, 0, z]), np.array([FLOOR, 0, 0])
    cords = []
    for across in np.linspace(-y, y, round(2 * y / MESH) + 1):  # from the bar over the roof and down the back
        shift = np.array([0, across, 0])
        cords += [(np.array([0, 0, z]) + shift, roof + shift), (roof + shift, floor + shift)]
    levels = [(share * roof + (1 - share) * np.array([0, 0, z])) for share in np.linspace(0, 1, round(ROOF / MESH) + 1)]
    slope = np.linalg.norm(floor - roof)
    levels += [roof + share * (floor - roof) for share in np.linspace(0, 1, round(slope / MESH) + 1)[1:]]
    cords += [(level + [0, -y, 0], level + [0, y, 0]) for level in levels]
    for side in (-y, y):
        for height in np.linspace(0, z, round(z / MESH) + 1):
            back = FLOOR + (ROOF - FLOOR) * height / z
            cords.append((np.array([0, side, height]), np.array([back, side, height])))
        for back in np.arange(MESH, FLOOR - 0.5 * MESH, MESH):
            top = z if back <= ROOF else z * (FLOOR - back) / (FLOOR - ROOF)
            cords.append((np.array([back, side, 0.0]), np.array([back, side, top])))
    return cords


def _create_tubes(ends, sides: int = 12) -> bpy.types.Mesh:
    """Create round tubes of a post's radius between pairs of ends."""
    corners, faces = [], []
    angles = 2.0 * np.pi * np.arange(sides) / sides
    for low, high in ends:
        first, second = _find_perpendiculars(high - low)
        circle = POST * (np.cos(angles)[:, None] * first + np.sin(angles)[:, None] * second)
        start = len(corners)
        corners += [*(low + circle), *(high + circle)]
        faces += [(start + i, start + (i + 1) % sides, start + sides + (i + 1) % sides, start + sides + i)
                  for i in range(sides)]
        faces += [tuple(start + i for i in reversed(range(sides))), tuple(start + sides + i for i in range(sides))]
    mesh = _create_mesh("Goal", np.array(corners), faces)
    mesh.polygons.foreach_set("use_smooth", np.array([len(face) == 4 for face in faces]))
    return mesh


def _create_cords(ends) -> bpy.types.Mesh:
    """Create thin crossed ribbons between pairs of ends, visible from all directions."""
    corners, faces = [], []
    for low, high in ends:
        for aside in _find_perpendiculars(high - low):
            start = len(corners)
            corners += [low - CORD * aside, low + CORD * aside, high + CORD * aside, high - CORD * aside]
            faces.append(tuple(range(start, start + 4)))
    return _create_mesh("Net", np.array(corners), faces)


def _find_perpendiculars(along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two unit vectors at right angles to `along` (3,) and to each other."""
    along = along / np.linalg.norm(along)
    first = np.cross(along, [0.0, 0.0, 1.0] if abs(along[2]) < 0.9 else [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    return first, np.cross(along, first)


def _create_mesh(name: str, corners, faces) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.asarray(corners).tolist(), [], faces)
    return mesh
