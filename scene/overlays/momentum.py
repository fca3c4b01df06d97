"""Overlay of an armature's momentum at the current frame: centre of mass with the parabolas of its flights, support
polygon, and ground force.

Lines within the time range are drawn with it. A force while nothing carries the body has no cause: it has a colour of
its own and begins at the centre of mass. Independent of gpu.
"""

from __future__ import annotations

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
    """List everything to draw at the current frame."""
    world, reach = Matrix.Scale(units_per_metre(scene), 4), scene.beyond_mocap.view.reach
    return [DrawItem((shown, row, reach), lambda shown=shown, row=row: build_meshes(shown.trace, row, reach), world)
            for shown, row in list_current_rows(scene)]


def list_labels(scene: bpy.types.Scene) -> list[tuple[Vector, str]]:
    """List a place in the scene's units and a line of text for every armature that shows its momentum."""
    units = units_per_metre(scene)
    return [(units * Vector(shown.trace.centre[row].tolist()), describe_momentum(shown.trace, row))
            for shown, row in list_current_rows(scene)]


def list_current_rows(scene: bpy.types.Scene) -> list[tuple[ShownMomentum, int]]:
    """List the traces to draw, each with its row at the current frame."""
    view = scene.beyond_mocap.view
    if not has_traces() or not (view.show and view.momentum):
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
    return f"flight {seconds:.2f} s, up to {1000.0 * trace.measure_deviation(flight):.0f} mm off its parabola"


def build_meshes(trace: "MomentumTrace", row: int, reach: float) -> list[Mesh]:
    """Build all meshes of a frame.

    Args:
        trace: the trace.
        row: its frame.
        reach: seconds to either side within which the path and the parabolas are drawn.
    """
    frames = round(reach * trace.fps)
    centre, path = trace.centre[row], trace.centre[max(row - frames, 0) : row + frames + 1]
    meshes = [] if len(path) < 2 else [build_line_mesh(path, colours.WHITE, THIN, 0.8)]
    near = (trace.flights[:, 0] <= row + frames) & (trace.flights[:, 1] >= row - frames)
    for flight in np.flatnonzero(near):
        points = trace.sample_parabola(flight, np.linspace(*trace.flights[flight], STEPS))
        meshes.append(build_line_mesh(points, colours.FLIGHT, WIDE))
    below = np.append(centre[:2], trace.ground)
    return [*meshes, *_build_polygon(trace, row), build_segments_mesh(centre, below, colours.GREY, THIN, 0.8),
            build_uniform_mesh(shapes.build_circle(centre, BALL, up=True).astype(np.float32), colours.WHITE, MIDDLE),
            *_build_force(trace, row)]


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
