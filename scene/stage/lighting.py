"""Daylight or floodlight for the stage, each with a sky of its own; exposure stays 0, since the lights are measured.

A world that the user has made is left alone. Blender's plain grey one is replaced.
"""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Vector

from ..core.material import get_material
from . import surfaces
from .meshes import create_mesh, create_object, create_tubes

MARK = "beyond_mocap_sky"  # of a world: the kind of sky that it was painted as
WORLD = "Stage sky"
DAYLIGHT, FLOODLIGHT = "DAYLIGHT", "FLOODLIGHT"

SUN_STRENGTH, SUN_ANGLE = 3.6, 0.035  # W/m2, rad: a little softer than the real sun
MAST = (0.5, 14.0, 0.5, 12.0, 38.0)  # masts: half length + m, half width + m, as shares and metres; m of height
LAMP_SIZE = (9.0, 5.0)  # metres of a mast's head
LAMP_IRRADIANCE = 1.15  # W/m2 that each mast gives at the centre spot
SKIES = {DAYLIGHT: (((0.045, 0.130, 0.040), (0.50, 0.66, 0.86), (0.12, 0.30, 0.70)), 1.1),
         FLOODLIGHT: (((0.010, 0.014, 0.010), (0.020, 0.026, 0.045), (0.004, 0.006, 0.016)), 1.0)}
"""Colours (linear RGB) below the horizon, at it and above, and strength."""
HAZE = 0.4  # share of the horizon's colour in that of the farthest ground


def create_lights(collection: bpy.types.Collection, units: float, size: tuple[float, float],
                  kind: str, masts: bool) -> None:
    """Create the lights over a pitch.

    Args:
        collection: for the lights.
        units: Blender units in a metre.
        size: length and width of the pitch, m.
        kind: DAYLIGHT or FLOODLIGHT.
        masts: whether floodlights have masts; with stands they are above the roof.
    """
    if kind == DAYLIGHT:
        create_sun(collection)
    else:
        _create_floodlights(collection, units, size, masts)


def create_sun(collection: bpy.types.Collection) -> bpy.types.Object:
    """Create daylight from above, from the side of the broadcast camera."""
    light = bpy.data.lights.new("Sun", "SUN")
    light.energy, light.angle = SUN_STRENGTH, SUN_ANGLE
    light.color = (1.0, 0.94, 0.85)
    thing = create_object(collection, "Sun", light)
    thing.rotation_euler = (0.75, 0.25, 0.5)
    return thing


def set_sky(scene: bpy.types.Scene, kind: str) -> bool:
    """Give the scene the sky of a kind; False, and nothing changes, where the world is one of the user's.

    A sky of that kind is not painted again, so that what the user has changed of it stays.
    """
    world = scene.world
    if world is not None and not world.get(MARK) and not is_plain_world(world):
        return False
    if world is None or not world.get(MARK) or world.library is not None:
        scene.world = bpy.data.worlds.new(WORLD)
    if scene.world.get(MARK) != kind:
        _paint_sky(scene.world, *SKIES[kind])
        scene.world[MARK] = kind
    return True


def has_own_sky(scene: bpy.types.Scene) -> bool:
    """Return whether the scene's world is the stage's."""
    return scene.world is not None and bool(scene.world.get(MARK))


def is_plain_world(world: bpy.types.World) -> bool:
    """Return whether a world is one colour of grey without animation, as in Blender's new files."""
    if world.library is not None or world.animation_data is not None:
        return False
    if world.node_tree is None:
        return max(world.color) - min(world.color) < 1e-3
    nodes = {node.type: node for node in world.node_tree.nodes}
    colour = nodes["BACKGROUND"].inputs["Color"] if set(nodes) == {"BACKGROUND", "OUTPUT_WORLD"} else None
    return colour is not None and not colour.is_linked and max(colour.default_value[:3]) - min(
        colour.default_value[:3]) < 1e-3


def set_exposure(scene: bpy.types.Scene) -> None:
    """Set the view transform that the lights are measured for, unless the user has set one of their own."""
    view = scene.view_settings
    if (view.look, view.exposure, view.gamma, view.use_curve_mapping) == ("None", 0.0, 1.0, False):
        view.view_transform = "AgX"
        view.look = "AgX - Medium High Contrast"


def _paint_sky(world: bpy.types.World, colours, strength: float) -> None:
    """Paint a gradient by height: ground, horizon, zenith."""
    if world.node_tree is None:  # Blender before 5.0 creates it on request
        world.use_nodes = True
    tree = world.node_tree
    tree.nodes.clear()
    place, split, height, ramp, shader, output = (tree.nodes.new(f"ShaderNode{kind}") for kind in (
        "TexCoord", "SeparateXYZ", "MapRange", "ValToRGB", "Background", "OutputWorld"))
    height.inputs["From Min"].default_value = -1.0
    elements = ramp.color_ramp.elements
    elements.new(0.5)
    elements.new(0.5)
    ground, horizon, zenith = colours
    haze = [HAZE * far + (1.0 - HAZE) * near for near, far in zip(ground, horizon)]
    for element, position, colour in zip(elements, (0.44, 0.497, 0.512, 0.75), (ground, haze, horizon, zenith)):
        element.position, element.color = position, (*colour, 1.0)
    shader.inputs["Strength"].default_value = strength
    for start, end in ((place.outputs["Generated"], split.inputs[0]), (split.outputs["Z"], height.inputs["Value"]),
                       (height.outputs[0], ramp.inputs[0]), (ramp.outputs["Color"], shader.inputs["Color"]),
                       (shader.outputs[0], output.inputs["Surface"])):
        tree.links.new(start, end)


def _create_floodlights(collection, units: float, size: tuple[float, float], masts: bool) -> None:
    """Create four area lights at the corners towards the pitch, each with its luminous head and a mast if wanted."""
    height = MAST[4]
    for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1)):
        foot = np.array([x * (MAST[0] * size[0] + MAST[1]), y * (MAST[2] * size[1] + MAST[3]), 0.0])
        head = foot + [0.0, 0.0, height]
        aim = np.array([0.22 * foot[0], 0.22 * foot[1], 0.0])
        turn = Vector(aim - head).to_track_quat("-Z", "Y")
        light = bpy.data.lights.new("Floodlight", "AREA")
        light.shape, (light.size, light.size_y) = "RECTANGLE", (side * units for side in LAMP_SIZE)
        light.energy = LAMP_IRRADIANCE * np.pi * float(np.sum(head**2)) * units**2
        light.color = (0.93, 0.97, 1.0)  # as the lamps of today's stadiums
        lamp = create_object(collection, "Floodlight", light)
        lamp.rotation_mode, lamp.rotation_quaternion, lamp.location = "QUATERNION", turn, Vector(head * units)
        _create_head(collection, units, head, turn)
        if masts:
            _create_mast(collection, units, foot, head)


def _create_mast(collection, units: float, foot: np.ndarray, head: np.ndarray) -> None:
    """Create a mast, which throws no shadow."""
    pole = create_tubes("Floodlight mast", [(foot * units, head * units)], 0.45 * units, 8)
    pole.materials.append(get_material("Mast steel", (0.12, 0.125, 0.13), 0.5))
    create_object(collection, "Floodlight mast", pole).visible_shadow = False


def _create_head(collection, units: float, head: np.ndarray, turn) -> None:
    """Create the luminous head behind an area light, which throws no shadow."""
    half = np.array(LAMP_SIZE) / 2.0
    corners = [turn @ Vector((x * half[0], y * half[1], 0.15)) + Vector(head)
               for x, y in ((-1, 1), (1, 1), (1, -1), (-1, -1))]
    lamps = create_mesh("Floodlight lamps", np.array(corners) * units, [(0, 1, 2, 3)])
    lamps.materials.append(surfaces.get_lamp_material())
    create_object(collection, "Floodlight lamps", lamps).visible_shadow = False
