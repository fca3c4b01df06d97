"""Goals: posts and bar with the net behind them."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.material import get_material
from .meshes import create_cords, create_object, create_tubes

GOAL, BAR, POST = 7.32, 2.44, 0.06  # metres between the posts, below the bar, of a post's radius
ROOF, FLOOR = 0.9, 2.1  # metres, depth of the net at the bar and on the ground
MESH, CORD = 0.15, 0.003  # metres between the net's cords, and half a cord's width


def create_goals(collection: bpy.types.Collection, units: float, length: float) -> list[bpy.types.Object]:
    """Create both goals of a pitch of `length` metres: posts and bar with the net behind, one shared mesh each."""
    frame = create_tubes("Goal", _build_goal_frame(), POST)
    frame.materials.append(get_material("Goal white", (0.9, 0.9, 0.9), 0.35))
    net = create_cords("Net", _build_net(), CORD)
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
