"""Overlay of an armature's momentum at the current frame: centre of mass with the parabolas of its flights, support
polygon, and ground force.

Lines within the time range are drawn second by second. A force while nothing carries the body has no cause: it has a
colour of its own and begins at the centre of mass. Independent of gpu.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..core.measure import units_per_metre
from . import colours, shapes
from .momentum_traces import ShownMomentum, find_momentum, has_traces, list_showing_armatures
from .path_overlays import DrawItem
from .prepare import Mesh, build_line_mesh, build_segments_mesh, build_uniform_mesh

if TYPE_CHECKING:
    from ...beyond_mocap.motion.momentum_trace import MomentumTrace

LIFT = 0.036  # metres of the polygon above the ground
BALL = 0.045  # metres, radius of the centre of mass
PER_FORCE = 0.4 / 9.81  # metres of an arrow for each m/s^2: 0.4 m for the weight
WIDE, MIDDLE, THIN = 3.5, 2.0, 1.2  # pixels
FILL = 0.35  # opacity of the polygon
STEPS = 12  # of a parabola


def list_items(scene: bpy.types.Scene) -> list[DrawItem]:
    """List everything to draw at the current frame: lines by the second, which stay while the animation plays."""
    rows, found = list_current_rows(scene), []
    if not rows:
        return found
    world, reach = Matrix.Scale(units_per_metre(scene), 4), scene.beyond_mocap.view.reach
    for shown, row in rows:
        trace = shown.trace
        ball = world @ Matrix.Translation(trace.centre[row].tolist())
        found += [DrawItem((shown, "second", second), partial(build_lines, trace, second), world)
                  for second in _list_seconds(trace, row, reach)]
        found += [DrawItem((shown, "frame", row), partial(build_frame, trace, row), world, in_front=True),
                  DrawItem(("", "centre of mass"), _build_ball, ball, in_front=True)]
    return found


def list_labels(scene: bpy.types.Scene) -> list[tuple[Vector, str]]:
    """List a place in the scene's units and a line of text for every armature that shows its momentum."""
    rows = list_current_rows(scene)
    units = units_per_metre(scene) if rows else 1.0
    return [(units * Vector(shown.trace.centre[row].tolist()), describe_momentum(shown.trace, row))
            for shown, row in rows]


def list_current_rows(scene: bpy.types.Scene) -> list[tuple[ShownMomentum, int]]:
    """List the traces to draw, each with its row at the current frame."""
    if not has_traces():  # most redraws end here
        return []
    view = scene.beyond_mocap.view
    if not (view.show and view.momentum):
        return []
    found = [find_momentum(body) for body in list_showing_armatures(scene) if body.visible_get()]
    rows = [(shown, round(scene.frame_current_final - shown.first)) for shown in found if shown is not None]
    return [(shown, row) for shown, row in rows if 0 <= row < len(shown.trace)]


def describe_momentum(trace: "MomentumTrace", row: int) -> str:
    """Describe a frame in a line: its flight, or the force in body weights."""
    from ...beyond_mocap.motion.supports import GRAVITY

    flight = trace.find_flight(row)
    if flight is None:
        return f"ground force {np.linalg.norm(trace.force[row]) / GRAVITY:.1f} x weight"
    seconds = np.ptp(trace.flights[flight]) / trace.fps
    return f"flight {seconds:.2f} s, up to {1000.0 * trace.deviations[flight]:.0f} mm off its parabola"


def build_lines(trace: "MomentumTrace", second: int) -> list[Mesh]:
    """Build the path of the centre of mass in one second of a trace, and the parabolas of flights that begin in it."""
    start, end = (round(at * trace.fps) for at in (second, second + 1))
    path = trace.centre[start : end + 1]
    meshes = [] if len(path) < 2 else [build_line_mesh(path, colours.WHITE, THIN, 0.8)]
    begins = (trace.flights[:, 0] >= start) & (trace.flights[:, 0] < end)
    lines = [shapes.build_polyline(trace.sample_parabola(flight, np.linspace(*trace.flights[flight], STEPS)))
             for flight in np.flatnonzero(begins)]
    return [*meshes, *([build_uniform_mesh(np.concatenate(lines), colours.FLIGHT, WIDE)] if lines else [])]


def build_frame(trace: "MomentumTrace", row: int) -> list[Mesh]:
    """Build the polygon, the line below the centre of mass and the force of a frame."""
    centre = trace.centre[row]
    below = np.append(centre[:2], trace.ground)
    return [*_build_polygon(trace, row), build_segments_mesh(centre, below, colours.GREY, THIN, 0.8),
            *_build_force(trace, row)]


def _list_seconds(trace: "MomentumTrace", row: int, reach: float) -> range:
    """List the seconds of a trace that are within the time range of a row; none for a range of 0."""
    if reach <= 0.0:
        return range(0)
    first, last = max(row / trace.fps - reach, 0.0), min(row / trace.fps + reach, (len(trace) - 1) / trace.fps)
    return range(int(first), int(last) + 1)


def _build_ball() -> list[Mesh]:
    """Build the centre of mass, at the origin."""
    points = shapes.build_circle(np.zeros(3), BALL, up=True).astype(np.float32)
    return [build_uniform_mesh(points, colours.WHITE, MIDDLE)]


def _build_polygon(trace: "MomentumTrace", row: int) -> list[Mesh]:
    """Build the support polygon: filled, with an outline."""
    corners = trace.build_support_polygon(row)
    if not len(corners):
        return []
    placed, height = np.roll(corners, -1, axis=0), trace.ground + LIFT
    fan = np.stack([np.broadcast_to(corners[0], corners.shape), corners, placed], axis=1).reshape(-1, 2)
    points = shapes.place_on_ground(fan, height)
    outline = shapes.place_on_ground(np.stack([corners, placed], axis=1).reshape(-1, 2), height)
    return [Mesh("TRIS", points, colours.repeat_colour(colours.SUPPORT, len(points), FILL)),
            build_uniform_mesh(outline, colours.SUPPORT, MIDDLE)]


def _build_force(trace: "MomentumTrace", row: int) -> list[Mesh]:
    """Build the arrow of the force; none beside take-off and landing, where its mean takes in the stance."""
    arrow = PER_FORCE * trace.force[row]
    if trace.find_flight(row) is None:
        start, colour = trace.find_force_origin(row), colours.FORCE
    elif trace.is_force_of_flight(row):
        start, colour = trace.centre[row], colours.UNSUPPORTED_FORCE
    else:
        return []
    return [build_uniform_mesh(shapes.build_arrow(start, start + arrow), colour, WIDE)]
