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
from ..ball.settings import list_aimed_balls
from ..core.measure import frames_per_second, units_per_metre
from ..passes import generate as make
from . import colours, shapes
from .path_overlays import DrawItem
from .prepare import Mesh, build_line_mesh, build_segments_mesh, build_uniform_mesh

if TYPE_CHECKING:
    from ..ball.shots import SolvedShot

MOST = 40  # candidates drawn, at most
FAINT = 0.25  # their alpha: they are many, and lie over each other
SPEED = 0.04  # metres of a line for each m/s of the striking part
DOT, RING, CROSS, LIFT = 0.018, 0.14, 0.09, 0.012  # metres
WIDE, THIN = 3.5, 1.5  # pixels
STEP = 0.02  # s


def list_items(scene: bpy.types.Scene) -> list[DrawItem]:
    """List everything to draw at the current frame."""
    world, rally = Matrix.Scale(units_per_metre(scene), 4), find_rally(scene)
    found = [DrawItem((solved, "shot"), lambda solved=solved: build_shot_meshes(solved), world)
             for solved in list_shots(scene)]
    if rally is not None:
        now = rally.flight_at((scene.frame_current_final - rally.start) / frames_per_second(scene))
        found += [DrawItem((rally, "all"), lambda: build_rally_meshes(rally), world),
                  DrawItem((rally, "flight", now), lambda: build_flight_meshes(rally, now), world)]
    return found


def has_items(scene: bpy.types.Scene) -> bool:
    """Return whether any ball overlay is drawn."""
    return bool(list_shots(scene)) or find_rally(scene) is not None


def list_shots(scene: bpy.types.Scene) -> list["SolvedShot"]:
    """List the shots to draw."""
    view = scene.beyond_mocap.view
    if not view.show or not view.shots or not shots.has_solved_shots():
        return []
    found = [shots.find_solved(ball) for ball in list_aimed_balls(scene) if ball.visible_get()
             and not ball.beyond_mocap_aim.handed]
    return [solved for solved in found if solved is not None]


def find_rally(scene: bpy.types.Scene) -> make.Trajectories | None:
    """Find the rally to draw, or None."""
    view = scene.beyond_mocap.view
    return make.find_trajectories(scene) if make.has_trajectories() and view.show and view.shots else None


def build_shot_meshes(solved: "SolvedShot") -> list[Mesh]:
    """Build the meshes of one shot."""
    shot, strikes, flight = solved.shot, solved.strikes, solved.flight
    end = flight.rests_from if flight.rests_from is not None else flight.end
    arrives = shot.seconds
    found = [_build_candidates(solved.candidate_trajectories[:: max(1,
                                                                    -(-len(solved.candidate_trajectories) // MOST))])]
    found.append(build_line_mesh(flight.at(_sample_times(0.0, arrives, flight.bounces)), colours.WHITE, WIDE))
    if end > arrives:
        found.append(build_line_mesh(flight.at(_sample_times(arrives, end, flight.bounces)), colours.VERMILION, THIN,
                                     0.9))
    middle = 0.5 * (strikes.start + strikes.end)
    found.append(build_segments_mesh(middle, middle + SPEED * strikes.velocity, colours.SKY, THIN, 0.9))
    found.append(_build_points(shot.starts, colours.SKY))
    found += _build_bounces(flight.at(flight.bounces[flight.bounces < end]) * [1.0, 1.0, 0.0])
    found.append(build_uniform_mesh(shapes.build_cross(shot.start, CROSS), colours.STRIKE, WIDE))
    return found


def build_rally_meshes(rally: make.Trajectories) -> list[Mesh]:
    """Build the meshes of all flights, strikes and bounces of a passing scene."""
    lines = np.concatenate([shapes.build_polyline(trajectory) for trajectory in rally.flight_paths])
    found = [build_uniform_mesh(lines, colours.GREY, THIN, 0.6)]
    if len(rally.strikes):
        crosses = np.concatenate([shapes.build_cross(place, CROSS) for place in rally.strikes])
        found.append(build_uniform_mesh(crosses, colours.STRIKE, WIDE))
    return found + _build_bounces(rally.bounces)


def build_flight_meshes(rally: make.Trajectories, now: int) -> list[Mesh]:
    """Build the meshes of one flight of a passing scene, with the candidates of its strike."""
    found, strike = [], int(np.searchsorted(rally.strike_times, rally.starts[now] + 1e-6)) - 1
    if strike >= 0 and rally.candidates[strike].size:
        found.append(_build_candidates(rally.candidates[strike]))
    return [*found, build_line_mesh(rally.flight_paths[now], colours.WHITE, WIDE)]


def _build_candidates(few: np.ndarray) -> Mesh:
    """Build lines of candidate flights (N, P, 3) m."""
    return build_segments_mesh(few[:, :-1], few[:, 1:], colours.BLACK, THIN, FAINT)


def _build_bounces(places: np.ndarray) -> list[Mesh]:
    """Build rings on the ground at places (N, 3) m."""
    if not len(places):
        return []
    rings = np.concatenate([shapes.build_circle(place + [0.0, 0.0, LIFT], RING) for place in places]).astype(np.float32)
    return [build_uniform_mesh(rings, colours.ORANGE, 2.5)]


def _sample_times(first: float, last: float, bounces: np.ndarray) -> np.ndarray:
    inside = bounces[(bounces > first) & (bounces < last)]
    return np.unique(np.concatenate([np.arange(first, last, STEP), inside, [last]]))


def _build_points(places: np.ndarray, colour) -> Mesh:
    """Build small octahedra."""
    corners = DOT * np.array([(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], float)
    faces = [(i, (i + 1) % 4, tip) for tip in (4, 5) for i in range(4)]
    one = corners[np.array(faces)].reshape(-1, 3)
    points = (places[:, None] + one).reshape(-1, 3).astype(np.float32)
    return Mesh("TRIS", points, colours.repeat_colour(colour, len(points)))
