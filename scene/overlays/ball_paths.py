"""Overlays of balls, as in Ball handling Fig. 6: all candidate trajectories in black, the chosen one in white, where it
is struck, rings where it bounces.

Of an aimed ball also the path of the striking part, in light blue with a point where it would strike; of a passing
scene the current flight, the others thin. Every shape is cached with its shot or rally. Independent of gpu.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import numpy as np
from mathutils import Matrix

from ..ball import shots
from ..ball.settings import aimed
from ..core.measure import frames_per_second, units_per_metre
from ..passes import make
from . import colours, shapes
from .prepare import Mesh, line_mesh, repeated_mesh, segments_mesh
from .rides import Item

if TYPE_CHECKING:
    from ..ball.shots import Solved

MOST = 40  # candidates drawn, at most
SPEED = 0.04  # metres of a line for each m/s of the striking part
DOT, RING, CROSS, LIFT = 0.018, 0.14, 0.09, 0.012  # metres
WIDE, THIN = 3.5, 1.5  # pixels
STEP = 0.02  # s


def items(scene: bpy.types.Scene) -> list[Item]:
    """List everything to draw at the current frame."""
    world, shown = Matrix.Scale(units_per_metre(scene), 4), rally_seen(scene)
    found = [Item((solved, "shot"), lambda solved=solved: shot_meshes(solved), world) for solved in shots_seen(scene)]
    if shown is not None:
        now = shown.flight_at((scene.frame_current_final - shown.start) / frames_per_second(scene))
        found += [Item((shown, "all"), lambda: rally_meshes(shown), world),
                  Item((shown, "flight", now), lambda: flight_meshes(shown, now), world)]
    return found


def any_seen(scene: bpy.types.Scene) -> bool:
    """Return whether any ball overlay is drawn."""
    return bool(shots_seen(scene)) or rally_seen(scene) is not None


def shots_seen(scene: bpy.types.Scene) -> list["Solved"]:
    """List the shots to draw."""
    view = scene.beyond_mocap.view
    if not view.show or not view.shots or not shots.anything():
        return []
    found = [shots.solved_of(ball) for ball in aimed(scene) if ball.visible_get() and not ball.beyond_mocap_aim.handed]
    return [solved for solved in found if solved is not None]


def rally_seen(scene: bpy.types.Scene) -> make.Rally | None:
    """Find the rally to draw, or None."""
    view = scene.beyond_mocap.view
    return make.rally_of(scene) if make.has_rallies() and view.show and view.shots else None


def shot_meshes(solved: "Solved") -> list[Mesh]:
    """Build the meshes of one shot."""
    shot, strikes, flight = solved.shot, solved.strikes, solved.flight
    end = flight.rests_from if flight.rests_from is not None else flight.end
    arrives = shot.seconds
    found = [_candidates(solved.candidates[:: max(1, -(-len(solved.candidates) // MOST))])]
    found.append(line_mesh(flight.at(_times(0.0, arrives, flight.bounces)), colours.WHITE, WIDE))
    if end > arrives:
        found.append(line_mesh(flight.at(_times(arrives, end, flight.bounces)), colours.VERMILION, THIN, 0.9))
    middle = 0.5 * (strikes.start + strikes.end)
    found.append(segments_mesh(middle, middle + SPEED * strikes.velocity, colours.SKY, THIN, 0.9))
    found.append(_dots(shot.starts, colours.SKY))
    found += _bounces(flight.at(flight.bounces[flight.bounces < end]) * [1.0, 1.0, 0.0])
    found.append(repeated_mesh(shapes.cross(shot.start, CROSS), colours.STRIKE, WIDE))
    return found


def rally_meshes(shown: make.Rally) -> list[Mesh]:
    """Build the meshes of all flights, strikes and bounces of a passing scene."""
    lines = np.concatenate([shapes.along(way) for way in shown.ways])
    found = [repeated_mesh(lines, colours.GREY, THIN, 0.6)]
    if len(shown.strikes):
        crosses = np.concatenate([shapes.cross(place, CROSS) for place in shown.strikes])
        found.append(repeated_mesh(crosses, colours.STRIKE, WIDE))
    return found + _bounces(shown.bounces)


def flight_meshes(shown: make.Rally, now: int) -> list[Mesh]:
    """Build the meshes of one flight of a passing scene, with the candidates of its strike."""
    found, strike = [], int(np.searchsorted(shown.strike_times, shown.starts[now] + 1e-6)) - 1
    if strike >= 0 and shown.candidates[strike].size:
        found.append(_candidates(shown.candidates[strike]))
    return [*found, line_mesh(shown.ways[now], colours.WHITE, WIDE)]


def _candidates(few: np.ndarray) -> Mesh:
    """Build lines of candidate flights (N, P, 3) m."""
    return segments_mesh(few[:, :-1], few[:, 1:], colours.BLACK, THIN, 0.75)


def _bounces(places: np.ndarray) -> list[Mesh]:
    """Build rings on the ground at places (N, 3) m."""
    if not len(places):
        return []
    rings = np.concatenate([shapes.circle(place + [0.0, 0.0, LIFT], RING) for place in places]).astype(np.float32)
    return [repeated_mesh(rings, colours.ORANGE, 2.5)]


def _times(first: float, last: float, bounces: np.ndarray) -> np.ndarray:
    inside = bounces[(bounces > first) & (bounces < last)]
    return np.unique(np.concatenate([np.arange(first, last, STEP), inside, [last]]))


def _dots(places: np.ndarray, colour) -> Mesh:
    """Build small octahedra."""
    corners = DOT * np.array([(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], float)
    faces = [(i, (i + 1) % 4, tip) for tip in (4, 5) for i in range(4)]
    one = corners[np.array(faces)].reshape(-1, 3)
    points = (places[:, None] + one).reshape(-1, 3).astype(np.float32)
    return Mesh("TRIS", points, colours.repeated(colour, len(points)))
