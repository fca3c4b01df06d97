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
from ..path_editing import edited_bodies
from ..path_editing.settings import list_edited_bodies
from . import colours, shapes
from .prepare import Mesh, build_line_mesh, build_segments_mesh, build_uniform_mesh

if TYPE_CHECKING:
    from ...beyond_mocap.path_editing.path_edit import EditedMotion
    from ...beyond_mocap.path_editing.path_edit_source import PathEditSource

LIFT = 0.012  # metres above the ground
EVERY = 0.2  # seconds from one faint residual to the next
HALF_TICK, RING, ARROW = 0.09, 0.16, 0.5  # metres
WIDE, THIN = 3.5, 1.5  # pixels
ORIGINAL, NEW = colours.SKY, colours.ORANGE


class DrawItem(NamedTuple):
    """One thing to draw.

    Attributes:
        key: stays the same while its look does.
        meshes: builds its meshes, in metres.
        world: matrix to the scene.
        in_front: whether it is drawn in front of all objects in any case, since it is inside of a body.
    """

    key: tuple
    meshes: Callable[[], list[Mesh]]
    world: Matrix
    in_front: bool = False


def list_items(scene: bpy.types.Scene) -> list[DrawItem]:
    """List everything to draw of visible edited bodies at the current frame."""
    found = list_visible_edits(scene)
    if not found:
        return []
    on, world = scene.beyond_mocap.view.list_path_overlays(), Matrix.Scale(units_per_metre(scene), 4)
    return [item for shown in found for item in _build_items(on, shown, scene.frame_current_final, world)]


def list_visible_edits(scene: bpy.types.Scene) -> list[edited_bodies.ComputedEdit]:
    """List the edited bodies to draw."""
    if not edited_bodies.has_computed_edits() or not scene.beyond_mocap.view.list_path_overlays():
        return []
    found = [edited_bodies.find_computed_edit(body) for body in list_edited_bodies(scene) if body.visible_get()]
    return [shown for shown in found if shown is not None]


def _build_items(on: list[str], computed: edited_bodies.ComputedEdit, frame: float, world: Matrix) -> list[DrawItem]:
    """Build the items of one edited body for the switched-on overlays."""
    source, edited, found = computed.source, computed.edited, []
    row, source_row = computed.find_frames(frame)  # rows of the edited motion and of the original
    if "path_source" in on:
        found.append(DrawItem((source, "path"), lambda: build_source_path(source, computed.source_line), world))
    if "path_new" in on:
        found.append(DrawItem((edited, "path"), lambda: build_new_path(edited, computed.line), world))
    if "path_residuals" in on:
        origin = source.moving.origin
        found += [DrawItem((source, "residuals"), lambda: build_residuals(source.motion, origin, ORIGINAL), world),
                  DrawItem((edited, "residuals"), lambda: build_residuals(edited.motion, edited.origin, NEW), world),
                  DrawItem((source, "residual", source_row), lambda: build_residual(source.motion, origin, source_row,
                                                                                    ORIGINAL), world),
                  DrawItem((edited, "residual", row), lambda: build_residual(edited.motion, edited.origin, row, NEW),
                           world)]
    if "path_ghost" in on:
        found.append(DrawItem((source, "ghost", source_row), lambda: build_figure(source, source_row), world))
    if "path_trackers" in on:
        for name, colour, place, heading in (
                ("original", ORIGINAL, source.moving.origin[source_row], source.moving.heading[source_row]),
                ("new", NEW, edited.origin[row], edited.heading[row])):
            there = world @ Matrix.Translation(place.tolist()) @ Matrix.Rotation(float(heading), 4, "Z")
            found.append(DrawItem(("", "tracker", name), lambda colour=colour: build_tracker(colour), there))
    return found


def build_source_path(source: "PathEditSource", line: np.ndarray) -> list[Mesh]:
    """Build the original path, line (N, 3) m, with a tick every second."""
    return [_build_line(line, ORIGINAL, WIDE, 0.9),
            _build_ticks(source.moving.origin, source.moving.heading, source.motion.fps, ORIGINAL)]


def build_new_path(edited: "EditedMotion", line: np.ndarray) -> list[Mesh]:
    """Build the new path, line (N, 3) m, thin; the part that the motion covers wide; with a tick every second."""
    return [_build_line(line, NEW, THIN, 0.6), *_build_covered_path(edited),
            _build_ticks(edited.origin, edited.heading, edited.motion.fps, NEW)]


def build_residuals(motion, origin: np.ndarray, colour) -> list[Mesh]:
    """Build faint lines from the path up to the pelvis, several in every second."""
    step = max(1, round(EVERY * motion.fps))
    return [_build_strokes(origin[::step], motion.root_positions[: len(origin) : step], colour, THIN, 0.4)]


def build_residual(motion, origin: np.ndarray, row: int, colour) -> list[Mesh]:
    """Build the strong line from the path to the pelvis at one frame."""
    return [_build_strokes(origin[row : row + 1], motion.root_positions[row : row + 1], colour, WIDE, 1.0)]


def build_figure(source: "PathEditSource", row: int) -> list[Mesh]:
    """Build the original motion at one frame as a stick figure."""
    from ...beyond_mocap.motion.motion import compute_pose

    motion = source.motion
    places, _ = compute_pose(motion.skeleton, motion.root_positions[row : row + 1], motion.rotations[row : row + 1])
    points = places[0][shapes.list_figure_pairs(motion.skeleton.parents)].reshape(-1, 3).astype(np.float32)
    return [build_uniform_mesh(points, ORIGINAL, 2.5, 0.8)]


def build_tracker(colour) -> list[Mesh]:
    """Build a ring with an arrow along X."""
    arrow = shapes.build_arrows(np.array([[RING, 0.0]]), np.zeros(1), ARROW - RING, LIFT)
    points = np.concatenate([shapes.build_circle((0.0, 0.0, LIFT), RING), arrow])
    return [build_uniform_mesh(points, colour, WIDE)]


def _build_covered_path(edited: "EditedMotion") -> list[Mesh]:
    """Build the path of the tracker, split where it restarts."""
    step = np.linalg.norm(np.diff(edited.origin, axis=0), axis=1)
    starts = np.flatnonzero(step > 0.5) + 1
    return [_build_line(piece, NEW, WIDE, 0.9) for piece in np.split(edited.origin, starts) if len(piece) > 1]


def _build_line(points: np.ndarray, colour, width: float, alpha: float) -> Mesh:
    return build_line_mesh(points + [0.0, 0.0, LIFT], colour, width, alpha)


def _build_strokes(start: np.ndarray, end: np.ndarray, colour, width: float, alpha: float) -> Mesh:
    return build_segments_mesh(start + [0.0, 0.0, LIFT], end, colour, width, alpha)


def _build_ticks(origin: np.ndarray, heading: np.ndarray, fps: float, colour) -> Mesh:
    """Build a short bar across the path at every whole second."""
    rows = np.round(np.arange(0.0, len(origin), fps)).astype(int)
    rows = rows[rows < len(origin)]
    aside = HALF_TICK * np.stack([-np.sin(heading[rows]), np.cos(heading[rows]), np.zeros(len(rows))], axis=1)
    points = np.stack([origin[rows] - aside, origin[rows] + aside], axis=1).reshape(-1, 3) + [0.0, 0.0, LIFT]
    return build_uniform_mesh(points.astype(np.float32), colour, 2.0)
