"""Overlays of path editing: the original and the new path, the place on both, and the original motion.

Every shape is cached with its motion or source, so that it is rebuilt only when that was recomputed. Independent of
gpu.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import bpy
import numpy as np
from mathutils import Matrix

from ..core.measure import units_per_metre
from ..path_editing import riders
from ..path_editing.settings import riders as riding
from . import colours, shapes
from .prepare import Mesh, line_mesh, repeated_mesh, segments_mesh

if TYPE_CHECKING:
    from ...beyond_mocap.path_editing.ride import Ridden, RideSource

LIFT = 0.012  # metres above the ground
EVERY = 0.2  # seconds from one faint residual to the next
HALF_TICK, RING, ARROW = 0.09, 0.16, 0.5  # metres
WIDE, THIN = 3.5, 1.5  # pixels
ORIGINAL, NEW = colours.SKY, colours.ORANGE


class Item(NamedTuple):
    """One thing to draw.

    Attributes:
        key: stays the same while its look does.
        meshes: builds its meshes, in metres.
        world: matrix to the scene.
    """

    key: tuple
    meshes: Callable[[], list[Mesh]]
    world: Matrix


def items(scene: bpy.types.Scene) -> list[Item]:
    """List everything to draw of visible edited bodies at the current frame."""
    found = seen(scene)
    if not found:
        return []
    on, world = scene.beyond_mocap.view.on_path(), Matrix.Scale(units_per_metre(scene), 4)
    return [item for shown in found for item in _items(on, shown, scene.frame_current_final, world)]


def seen(scene: bpy.types.Scene) -> list[riders.Shown]:
    """List the edited bodies to draw."""
    if not riders.anybody_shown() or not scene.beyond_mocap.view.on_path():
        return []
    found = [riders.shown(body) for body in riding(scene) if body.visible_get()]
    return [shown for shown in found if shown is not None]


def _items(on: list[str], shown: riders.Shown, frame: float, world: Matrix) -> list[Item]:
    """Build the items of one edited body for the switched-on overlays."""
    source, ridden, found = shown.source, shown.ridden, []
    row, was = shown.frames(frame)  # rows of the edited motion and of the original
    if "path_source" in on:
        found.append(Item((source, "path"), lambda: source_path(source, shown.source_line), world))
    if "path_new" in on:
        found.append(Item((ridden, "path"), lambda: new_path(ridden, shown.line), world))
    if "path_residuals" in on:
        origin = source.moving.origin
        found += [Item((source, "residuals"), lambda: residuals(source.motion, origin, ORIGINAL), world),
                  Item((ridden, "residuals"), lambda: residuals(ridden.motion, ridden.origin, NEW), world),
                  Item((source, "residual", was), lambda: residual(source.motion, origin, was, ORIGINAL), world),
                  Item((ridden, "residual", row), lambda: residual(ridden.motion, ridden.origin, row, NEW), world)]
    if "path_ghost" in on:
        found.append(Item((source, "ghost", was), lambda: figure(source, was), world))
    if "path_trackers" in on:
        for name, colour, place, heading in (
                ("original", ORIGINAL, source.moving.origin[was], source.moving.heading[was]),
                ("new", NEW, ridden.origin[row], ridden.heading[row])):
            there = world @ Matrix.Translation(place.tolist()) @ Matrix.Rotation(float(heading), 4, "Z")
            found.append(Item(("", "tracker", name), lambda colour=colour: tracker(colour), there))
    return found


def source_path(source: "RideSource", line: np.ndarray) -> list[Mesh]:
    """Build the original path, line (N, 3) m, with a tick every second."""
    return [_line(line, ORIGINAL, WIDE, 0.9),
            _ticks(source.moving.origin, source.moving.heading, source.motion.fps, ORIGINAL)]


def new_path(ridden: "Ridden", line: np.ndarray) -> list[Mesh]:
    """Build the new path, line (N, 3) m, thin; the part that the motion covers wide; with a tick every second."""
    return [_line(line, NEW, THIN, 0.6), *_ridden(ridden),
            _ticks(ridden.origin, ridden.heading, ridden.motion.fps, NEW)]


def residuals(motion, origin: np.ndarray, colour) -> list[Mesh]:
    """Build faint lines from the path up to the pelvis, several in every second."""
    step = max(1, round(EVERY * motion.fps))
    return [_strokes(origin[::step], motion.root_positions[: len(origin) : step], colour, THIN, 0.4)]


def residual(motion, origin: np.ndarray, row: int, colour) -> list[Mesh]:
    """Build the strong line from the path to the pelvis at one frame."""
    return [_strokes(origin[row : row + 1], motion.root_positions[row : row + 1], colour, WIDE, 1.0)]


def figure(source: "RideSource", row: int) -> list[Mesh]:
    """Build the original motion at one frame as a stick figure."""
    from ...beyond_mocap.motion.motion import pose_kinematics

    motion = source.motion
    places, _ = pose_kinematics(motion.skeleton, motion.root_positions[row : row + 1], motion.rotations[row : row + 1])
    points = places[0][shapes.figure_pairs(motion.skeleton.parents)].reshape(-1, 3).astype(np.float32)
    return [repeated_mesh(points, ORIGINAL, 2.5, 0.8)]


def tracker(colour) -> list[Mesh]:
    """Build a ring with an arrow along X."""
    tip, back = ARROW, ARROW - 0.14
    arrow = [(RING, 0.0, LIFT), (tip, 0.0, LIFT), (tip, 0.0, LIFT), (back, 0.08, LIFT), (tip, 0.0, LIFT),
             (back, -0.08, LIFT)]
    points = np.concatenate([shapes.circle((0.0, 0.0, LIFT), RING), np.array(arrow, np.float32)])
    return [repeated_mesh(points, colour, WIDE)]


def _ridden(ridden: "Ridden") -> list[Mesh]:
    """Build the path of the tracker, split where it restarts."""
    step = np.linalg.norm(np.diff(ridden.origin, axis=0), axis=1)
    starts = np.flatnonzero(step > 0.5) + 1
    return [_line(piece, NEW, WIDE, 0.9) for piece in np.split(ridden.origin, starts) if len(piece) > 1]


def _line(points: np.ndarray, colour, width: float, alpha: float) -> Mesh:
    return line_mesh(points + [0.0, 0.0, LIFT], colour, width, alpha)


def _strokes(start: np.ndarray, end: np.ndarray, colour, width: float, alpha: float) -> Mesh:
    return segments_mesh(start + [0.0, 0.0, LIFT], end, colour, width, alpha)


def _ticks(origin: np.ndarray, heading: np.ndarray, fps: float, colour) -> Mesh:
    """Build a short bar across the path at every whole second."""
    rows = np.round(np.arange(0.0, len(origin), fps)).astype(int)
    rows = rows[rows < len(origin)]
    aside = HALF_TICK * np.stack([-np.sin(heading[rows]), np.cos(heading[rows]), np.zeros(len(rows))], axis=1)
    points = np.stack([origin[rows] - aside, origin[rows] + aside], axis=1).reshape(-1, 3) + [0.0, 0.0, LIFT]
    return repeated_mesh(points.astype(np.float32), colour, 2.0)
