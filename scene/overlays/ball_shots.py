"""What is drawn of aimed balls, as in Ball handling Fig. 6: all ways that the ball could take in black, the one it
takes in white, how the striking part moves in each frame in light blue with a point where it would strike, rings where
the ball bounces.

Every shape hangs on the very shot that it was made of. Knows neither gpu nor how to draw.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import numpy as np
from mathutils import Matrix

from ..ball import shots
from ..ball.settings import aimed
from ..core.measure import units_per_metre
from . import colours, shapes
from .prepare import Mesh
from .rides import Item

if TYPE_CHECKING:
    from ..ball.shots import Solved

MOST = 40  # candidates that are drawn
SPEED = 0.04  # metres of a line for each m/s of the striking part
DOT, RING, CROSS, LIFT = 0.018, 0.14, 0.09, 0.012  # metres
WIDE, THIN = 3.5, 1.5  # pixels
STEP = 0.02  # s


def items(scene: bpy.types.Scene) -> list[Item]:
    """All that is to be drawn of the aimed balls that are seen."""
    world = Matrix.Scale(units_per_metre(scene), 4)
    return [Item((solved, "shot"), lambda solved=solved: meshes(solved), world) for solved in seen(scene)]


def seen(scene: bpy.types.Scene) -> list["Solved"]:
    """The shots of which anything is to be drawn."""
    view = scene.beyond_mocap.view
    if not view.show or not view.shots or not shots.anything():
        return []
    found = [shots.solved_of(ball) for ball in aimed(scene) if ball.visible_get() and not ball.beyond_mocap_aim.handed]
    return [solved for solved in found if solved is not None]


def meshes(solved: "Solved") -> list[Mesh]:
    """One shot."""
    shot, strikes, flight = solved.shot, solved.strikes, solved.flight
    end = flight.rests_from if flight.rests_from is not None else flight.end
    arrives = shot.seconds
    few = solved.candidates[:: max(1, -(-len(solved.candidates) // MOST))]
    lines = np.stack([few[:, :-1], few[:, 1:]], axis=2).reshape(-1, 3).astype(np.float32)
    found = [Mesh("LINES", lines, colours.repeated(colours.BLACK, len(lines), 0.75), THIN)]
    found.append(_line(flight.at(_times(0.0, arrives, flight.bounces)), colours.WHITE, WIDE, 1.0))
    if end > arrives:
        found.append(_line(flight.at(_times(arrives, end, flight.bounces)), colours.VERMILION, THIN, 0.9))
    middle = 0.5 * (strikes.start + strikes.end)
    found.append(_strokes(middle, middle + SPEED * strikes.velocity, colours.SKY, THIN, 0.9))
    found.append(_dots(shot.starts, colours.SKY))
    met = flight.at(flight.bounces[flight.bounces < end]) * [1.0, 1.0, 0.0] + [0.0, 0.0, LIFT]
    if len(met):
        rings = np.concatenate([shapes.circle(place, RING) for place in met]).astype(np.float32)
        found.append(Mesh("LINES", rings, colours.repeated(colours.ORANGE, len(rings)), 2.5))
    cross = shapes.cross(shot.start, CROSS)
    found.append(Mesh("LINES", cross, colours.repeated(colours.STRIKE, len(cross)), WIDE))
    return found


def _times(first: float, last: float, bounces: np.ndarray) -> np.ndarray:
    inside = bounces[(bounces > first) & (bounces < last)]
    return np.unique(np.concatenate([np.arange(first, last, STEP), inside, [last]]))


def _line(points: np.ndarray, colour, width: float, alpha: float) -> Mesh:
    lines = shapes.along(points)
    return Mesh("LINES", lines, colours.repeated(colour, len(lines), alpha), width)


def _strokes(start: np.ndarray, end: np.ndarray, colour, width: float, alpha: float) -> Mesh:
    points = np.stack([start, end], axis=1).reshape(-1, 3).astype(np.float32)
    return Mesh("LINES", points, colours.repeated(colour, len(points), alpha), width)


def _dots(places: np.ndarray, colour) -> Mesh:
    """Small octahedra."""
    corners = DOT * np.array([(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], float)
    faces = [(i, (i + 1) % 4, tip) for tip in (4, 5) for i in range(4)]
    one = corners[np.array(faces)].reshape(-1, 3)
    points = (places[:, None] + one).reshape(-1, 3).astype(np.float32)
    return Mesh("TRIS", points, colours.repeated(colour, len(points)))
