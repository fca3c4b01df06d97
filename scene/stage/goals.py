"""Goals: posts and bar with the net behind them, high posts, or a ring with its board."""

from __future__ import annotations

import bpy
import numpy as np

from ...beyond_mocap.appearance.sports import Goal
from ..core.material import get_material
from .meshes import create_cords, create_mesh, create_object, create_tubes

MESH, CORD = 0.15, 0.003  # metres between the net's cords, and half a cord's width
RING_PIECES = 24
RING_BELOW = 0.15  # metres from a board's lower edge up to its ring
STAND, ARM = 1.0, 0.06  # metres from the end line to the post that carries a board, and the radius of its tubes


def create_goals(collection: bpy.types.Collection, units: float, goal: Goal, length: float) -> list[bpy.types.Object]:
    """Create both goals of a pitch of `length` metres, with one shared mesh for each part."""
    parts = {"Goal": create_tubes("Goal", _build_frame(goal), goal.post)}
    parts["Goal"].materials.append(_get_paint(goal.colour))
    if goal.form == "net":
        parts["Net"] = create_cords("Net", _build_net(goal), CORD)
        parts["Net"].materials.append(get_material("Net white", (0.75, 0.75, 0.75), 0.9))
    elif goal.form == "hoop":
        parts["Goal stand"] = create_tubes("Goal stand", _build_stand(goal), ARM)
        parts["Goal board"] = create_mesh("Goal board", _build_board(goal), [(0, 1, 2, 3)])
        for part in ("Goal stand", "Goal board"):
            parts[part].materials.append(_get_paint(Goal.colour))
    objects = []
    for side, turn in (("right", 0.0), ("left", np.pi)):
        for name, mesh in parts.items():
            thing = create_object(collection, f"{name} {side}", mesh)
            thing.location.x = (length / 2 - goal.inset) * (1.0 if turn == 0.0 else -1.0) * units
            thing.rotation_euler.z = turn
            thing.scale = (units,) * 3
            objects.append(thing)
    return objects


def _get_paint(colour: tuple[float, float, float]) -> bpy.types.Material:
    """Return the material of posts and boards, one for each colour (linear RGB): sports in one file differ."""
    name = "white" if colour == Goal.colour else " ".join(f"{value:g}" for value in colour)
    return get_material(f"Goal {name}", colour, 0.35)


def _build_frame(goal: Goal) -> list[tuple[np.ndarray, np.ndarray]]:
    """Build the rods of the goal at x = 0 that opens towards -x: the ends of their centre lines, metres."""
    y, z = goal.width / 2 + goal.post, goal.height + goal.post
    if goal.form == "hoop":
        turns = 2.0 * np.pi * np.arange(RING_PIECES + 1) / RING_PIECES
        ring = np.stack([goal.width / 2 * np.cos(turns), goal.width / 2 * np.sin(turns),
                         np.full(len(turns), goal.height)], axis=1)
        bracket = np.array([(goal.width / 2, 0.0, goal.height), (goal.inset - goal.board[2], 0.0, goal.height)])
        return [*zip(ring[:-1], ring[1:]), tuple(bracket)]
    top = goal.top if goal.form == "posts" else z
    ends = [((0, -y, 0), (0, -y, top)), ((0, y, 0), (0, y, top)), ((0, -y - goal.post, z), (0, y + goal.post, z))]
    return [(np.array(a, float), np.array(b, float)) for a, b in ends]


def _build_board(goal: Goal) -> list[tuple[float, float, float]]:
    """Build the corners of the board behind a ring, metres."""
    width, height, away = goal.board
    x, low = goal.inset - away, goal.height - RING_BELOW
    return [(x, side * width / 2, z) for side, z in ((-1, low), (1, low), (1, low + height), (-1, low + height))]


def _build_stand(goal: Goal) -> list[tuple[np.ndarray, np.ndarray]]:
    """Build the post behind the end line and the arm that carries a board, as ends (3,) metres."""
    middle = goal.height - RING_BELOW + goal.board[1] / 2
    foot, top, board = np.array([(goal.inset + STAND, 0.0, 0.0), (goal.inset + STAND, 0.0, middle),
                                 (goal.inset - goal.board[2], 0.0, middle)])
    return [(foot, top), (top, board)]


def _build_net(goal: Goal) -> list[tuple[np.ndarray, np.ndarray]]:
    """Build the net's cords behind that goal, as ends (3,) metres: roof, back and both sides."""
    y, z = goal.width / 2 + goal.post, goal.height
    roof, floor = np.array([goal.roof, 0, z]), np.array([goal.floor, 0, 0])
    cords = []
    for across in np.linspace(-y, y, round(2 * y / MESH) + 1):  # from the bar over the roof and down the back
        shift = np.array([0, across, 0])
        cords += [(np.array([0, 0, z]) + shift, roof + shift), (roof + shift, floor + shift)]
    steps = np.linspace(0, 1, round(goal.roof / MESH) + 1)
    levels = [(share * roof + (1 - share) * np.array([0, 0, z])) for share in steps]
    slope = np.linalg.norm(floor - roof)
    levels += [roof + share * (floor - roof) for share in np.linspace(0, 1, round(slope / MESH) + 1)[1:]]
    cords += [(level + [0, -y, 0], level + [0, y, 0]) for level in levels]
    for side in (-y, y):
        for height in np.linspace(0, z, round(z / MESH) + 1):
            back = goal.floor + (goal.roof - goal.floor) * height / z
            cords.append((np.array([0, side, height]), np.array([back, side, height])))
        for back in np.arange(MESH, goal.floor - 0.5 * MESH, MESH):
            top = z if back <= goal.roof else z * (goal.floor - back) / (goal.floor - goal.roof)
            cords.append((np.array([back, side, 0.0]), np.array([back, side, top])))
    return cords
