"""The new path as an ordinary curve object: read in world space, also while it is edited, and created; and the
ground.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
import numpy as np
from mathutils import Vector

from ...beyond_mocap.base.digest import byte_digest
from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.base.vectors import unit_vectors
from ..core.measure import units_per_metre
from ..player.drawn_track import list_points
from .settings import MOST_DEGREE

if TYPE_CHECKING:
    from ...beyond_mocap.motion.path.path import Path

MARK = "beyond_mocap_path"  # on curve objects that the extension created
MOST_ORDER = 6  # highest order that Blender draws
DEGREE = "beyond_mocap_degree"  # on curve data whose degree is higher than Blender draws
_STEP, _PIECES = 0.04, (8, 600)  # metres between samples of a Bezier segment; limits of their number
_NURBS_PIECES = 48
_COUNTS = (6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48, 60, 80)
_FIT_TOLERANCE = 0.03  # metres between a fitted curve and the path, at most
_MOST_SPACING = 5.0  # metres between two points, at most, so that there is always one to drag
_LEAST_SPACING, _MOST_POINTS = 0.08, 240  # metres between two Bezier points, at least; number of points, at most
_SWAY, _MOST_EXTENSIONS = 0.1, 8  # metres that the end of a path sways at most; times that a curve is extended
_SPARE = 0.002  # metres by which a fitted curve is longer than the path, so that the motion does not end early
_grounds: dict[int, tuple[bytes, object]] = {}  # by session_uid of the mesh object: digest, `Terrain`


@dataclass(frozen=True, eq=False)
class DrawnCurve:
    """A curve object as it is now.

    Attributes:
        name: of the object.
        kind: BEZIER, NURBS or POLY.
        points: (P, 9) metres, Bezier points with their left and right handles, or (P, 4) other control points with
            their weights, world frame.
        order: of a NURBS curve.
        clamped: whether a NURBS curve reaches its end points.
        closed: whether its end is its start.
        static_bytes: bytes that change with edits only, not with animation.
        notes: messages for the user.
    """

    name: str
    kind: str
    points: np.ndarray
    order: int
    clamped: bool
    closed: bool
    static_bytes: bytes
    notes: tuple[str, ...]

    @property
    def digest(self) -> bytes:
        """A digest that changes with the path."""
        return byte_digest(f"{self.kind} {self.order} {self.clamped} {self.closed}", self.static_bytes)

    def sample_line(self) -> np.ndarray:
        """Sample the curve: places (N, 3) m, dense where it bends."""
        from ...beyond_mocap.motion.track.line_track import sample_nurbs

        points = self.points
        if self.kind == "BEZIER":
            return _sample_bezier(np.concatenate([points, points[:1]]) if self.closed else points)
        if self.kind == "POLY":
            return points[:, :3]
        degree = min(self.order, len(points)) - 1
        if self.closed:  # repeat the first points, so that the curve closes smoothly
            points = np.concatenate([points, points[:degree]])
        weights = np.maximum(points[:, 3], 1e-6)
        return sample_nurbs(points[:, :3], weights, degree + 1, self.clamped and not self.closed, _NURBS_PIECES)[0]

    def to_path(self) -> Path:
        """Convert the curve to a path of the core. Raises InputError if it has no length."""
        from ...beyond_mocap.path_editing.path_line import fit_line

        line = self.sample_line()
        if self.closed and len(line) and np.linalg.norm(line[-1] - line[0]) < 1e-6:
            line = line[:-1]
        return fit_line(line, f"curve {self.name}", closed=self.closed)


def read_curve(scene: bpy.types.Scene, drawn: bpy.types.Object | None) -> DrawnCurve:
    """Read a curve object as it is drawn now. Raises InputError if it has no line."""
    if drawn is None or drawn.name not in scene.objects:
        raise InputError("new path", "its curve is not in the scene", "a curve object",
                         "choose another curve, or press New Curve")
    if drawn.type != "CURVE":
        raise InputError(f"object {drawn.name}", "is not a curve", "a curve object (Add > Curve)", "choose another")
    lines = [spline for spline in drawn.data.splines if len(list_points(spline)) > 1]
    if not lines:
        raise InputError(f"curve {drawn.name}", "has no line", "two points or more", "add points in edit mode")
    spline, notes = lines[0], []
    if len(lines) > 1:
        notes.append(f"curve {drawn.name}: only the first of its {len(lines)} splines is the path")
    if any(modifier.show_viewport for modifier in drawn.modifiers):
        notes.append(f"curve {drawn.name}: its modifiers are ignored")
    if drawn.data.shape_keys is not None:
        notes.append(f"curve {drawn.name}: its shape keys are ignored")
    if animated := is_animated(drawn):
        notes.append(f"curve {drawn.name}: its animation is ignored; the motion follows its state at the last edit")
    world, units = np.array(drawn.matrix_world), units_per_metre(scene)
    points = _read_control_points(spline)
    places = points[:, :9] if spline.type == "BEZIER" else points[:, :3]
    transformed = (places.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3]) / units
    values = np.concatenate([transformed.reshape(len(points), -1), points[:, places.shape[1]:]], axis=1)
    if not np.isfinite(values).all():
        raise InputError(f"curve {drawn.name}", "a point with NaN or infinite values", "finite coordinates",
                         "move or delete that point")
    kind = spline.type if spline.type in {"BEZIER", "POLY"} else "NURBS"
    order = _read_order(drawn.data, spline) if kind == "NURBS" else 0
    if order > MOST_ORDER:
        notes.append(f"curve {drawn.name}: Blender draws it with degree {MOST_ORDER - 1}, the motion follows degree "
                     f"{order - 1}, which the overlay shows")
    static_bytes = points.tobytes() + repr(units).encode() if animated else values.tobytes()
    return DrawnCurve(drawn.name, kind, values, order=order, clamped=spline.use_endpoint_u, closed=spline.use_cyclic_u,
                      static_bytes=static_bytes, notes=tuple(notes))


def _read_order(data: bpy.types.Curve, spline: bpy.types.Spline) -> int:
    """Read the order of a NURBS curve: that of its data where Blender's is at its limit and the curve is ours."""
    degree = data.get(DEGREE)
    if spline.order_u < MOST_ORDER or not isinstance(degree, int):
        return spline.order_u
    return max(MOST_ORDER, min(degree, MOST_DEGREE) + 1)


def create_curve(
    context: bpy.types.Context, name: str, path: Path, straight: bool = False, count: int = 0, kind: str = "BEZIER",
    degree: int = 3,
) -> bpy.types.Object:
    """Create a curve object along a path, or a straight line of the same length, from its start toward its end.

    Args:
        context: for scene and collection.
        name: of the object.
        path: world frame, metres.
        straight: a straight line.
        count: control points; 0 takes as many as it needs to be within 3 cm.
        kind: BEZIER or NURBS.
        degree: of a NURBS curve.
    Returns:
        The object.
    Raises:
        InputError: for too few points for the degree.
    """
    points, handles = _fit_points(path, count, kind, degree, straight)
    units = units_per_metre(context.scene)
    origin = points[0] * units
    data = bpy.data.curves.new(name, "CURVE")
    data.dimensions, data.bevel_depth = "3D", 0.0
    spline = data.splines.new(kind)
    local = np.ascontiguousarray(points * units - origin, np.float32)
    if kind == "BEZIER":
        spline.bezier_points.add(len(points) - 1)
        spline.bezier_points.foreach_set("co", local.ravel())
        for point in spline.bezier_points:
            point.handle_left_type = point.handle_right_type = "ALIGNED"
        for side, places in zip(("handle_left", "handle_right"), handles):
            spline.bezier_points.foreach_set(side, np.ascontiguousarray(places * units - origin, np.float32).ravel())
        if path.closed and not straight:
            spline.use_cyclic_u = True
    else:
        spline.points.add(len(points) - 1)
        spline.points.foreach_set("co", np.column_stack([local, np.ones(len(local), np.float32)]).ravel())
        spline.order_u, spline.use_endpoint_u = min(degree + 1, len(points), MOST_ORDER), True
        if degree >= MOST_ORDER:
            data[DEGREE] = degree
    created = bpy.data.objects.new(name, data)
    created.location, created[MARK] = origin, True
    room = context.scene.collection if context.layer_collection.exclude else context.collection
    room.objects.link(created)
    context.view_layer.update()
    _extend_curve(context.scene, created, path)
    return created


def remove_curve(drawn: bpy.types.Object) -> None:
    """Remove a curve object from the file, with its curve data if no other object uses it."""
    data = drawn.data
    bpy.data.objects.remove(drawn)
    if not data.users:
        bpy.data.curves.remove(data)


def is_animated(drawn: bpy.types.Object) -> bool:
    """Return whether an object moves with the frame, by its own animation or that of its parents and constraint
    targets.
    """
    known, waiting = set(), [drawn]
    while waiting:
        thing = waiting.pop()
        if thing is None or thing in known:
            continue
        known.add(thing)
        data = thing.animation_data
        if data is not None and (data.action or data.nla_tracks or data.drivers):
            return True
        waiting += [thing.parent, *(getattr(constraint, "target", None) for constraint in thing.constraints)]
    return False


def compute_ground_digest(scene: bpy.types.Scene, ground: bpy.types.Object | None) -> bytes:
    """Compute a digest of the ground's evaluated mesh; the place of an animated ground is ignored.

    Raises InputError if the ground was deleted.
    """
    if ground is None:
        return b""
    if ground.name not in scene.objects:
        raise InputError("ground", f"{ground.name} is not in the scene", "a mesh object", "choose another, or none")
    evaluated = ground.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()  # also while it is being edited
    parts = [_read_vertices(mesh)]
    if corners := mesh.attributes.get(".corner_vert"):  # ten times as fast as Blender's triangles
        found = np.empty(len(corners.data), np.int32)
        corners.data.foreach_get("value", found)
        parts += [found, len(mesh.polygons).to_bytes(8, "little")]
    evaluated.to_mesh_clear()
    if not is_animated(ground):
        parts.append(np.array(evaluated.matrix_world))
    return byte_digest(*parts)


def list_ground_messages(ground: bpy.types.Object | None) -> tuple[str, ...]:
    """List messages about the ground."""
    moves = ground is not None and is_animated(ground)
    return (f"ground {ground.name}: its animation is ignored; feet follow its state at the last edit",
            ) if moves else ()


def load_ground(scene: bpy.types.Scene, ground: bpy.types.Object | None, digest: bytes):
    """Load the `Terrain` of a mesh object in metres; None without one.

    Args:
        scene: for the unit.
        ground: a mesh object, or None.
        digest: of `compute_ground_digest`.
    Returns:
        The terrain, cached by digest.
    Raises:
        InputError: for a mesh without faces.
    """
    from ...beyond_mocap.motion.path.terrain import Terrain

    if ground is None:
        return None
    units = units_per_metre(scene)
    digest += repr(units).encode()
    if _grounds.get(ground.session_uid, (b"", None))[0] != digest:
        places, corners = _read_mesh(ground)
        if not len(corners):
            raise InputError(f"ground {ground.name}", "a mesh without faces", "a mesh with faces", "choose another")
        _grounds[ground.session_uid] = digest, Terrain(places / units, corners)
    return _grounds[ground.session_uid][1]


def clear_ground_cache() -> None:
    """Clear the cache when another file is opened."""
    _grounds.clear()


def _read_control_points(spline: bpy.types.Spline) -> np.ndarray:
    """Read control points (P, 9) or (P, 4), see `DrawnCurve`, in the curve's own space."""
    points = list_points(spline)
    names = (("co", 3), ("handle_left", 3), ("handle_right", 3)) if spline.type == "BEZIER" else (("co", 4),)
    columns = []
    for name, size in names:
        values = np.empty(size * len(points), np.float32)
        points.foreach_get(name, values)
        columns.append(values.reshape(-1, size).astype(float))
    return np.concatenate(columns, axis=1)


def _sample_bezier(points: np.ndarray) -> np.ndarray:
    """Sample places (N, 3) along Bezier points (P, 9)."""
    a, b, c, d = points[:-1, :3], points[:-1, 6:9], points[1:, 3:6], points[1:, :3]
    length = sum(np.linalg.norm(end - start, axis=1) for start, end in ((a, b), (b, c), (c, d)))
    pieces = np.clip(np.ceil(length / _STEP).astype(int), *_PIECES)
    segment = np.repeat(np.arange(len(pieces)), pieces)
    first = np.cumsum(pieces) - pieces
    t = ((np.arange(pieces.sum()) - first[segment]) / pieces[segment])[:, None]
    a, b, c, last = a[segment], b[segment], c[segment], d[-1:]
    d = d[segment]
    fine = (1 - t) ** 3 * a + 3 * t * (1 - t) ** 2 * b + 3 * t**2 * (1 - t) * c + t**3 * d
    return np.concatenate([fine, last])


def _fit_points(path: Path, count: int, kind: str, degree: int, straight: bool) -> tuple[np.ndarray, tuple]:
    """Fit control points (P, 3) in metres and, for Bezier points, their left and right handles."""
    from ...beyond_mocap.path_editing import path_line

    degree = 3 if kind == "BEZIER" else degree
    more = 2 if kind == "BEZIER" else 0  # a cubic spline of P control points is a chain of P - 2 Bezier points
    count = max(count, 2) if count else 0
    if straight:
        points = _scale_line(path_line.build_straight_points(path, count or max(4, degree + 1)), path)
        third = (points[1] - points[0]) / 3.0
        return points, (points - third, points + third)
    if kind == "BEZIER" and not count:
        return _fit_bezier_chain(path)
    points = path_line.fit_control_points(path, count + more, degree) if count else _fit_control_points(path, degree)
    if kind != "BEZIER":
        return points, ()
    spline = path_line.build_b_spline(points, degree)
    knots = spline.breaks
    places, tangents = spline.at(knots), spline.at(knots, 1)
    gaps = np.diff(knots)[:, None] / 3.0
    before, after = np.concatenate([gaps[:1], gaps]), np.concatenate([gaps, gaps[-1:]])
    return places, (places - tangents * before, places + tangents * after)


def _fit_bezier_chain(path: Path) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Fit Bezier points (P, 3) on the path and their left and right handles, denser in bends, within _FIT_TOLERANCE of
    it.

    Corners that were cut would make the motion run ahead of the path from there on.
    """
    from ...beyond_mocap.motion.path.arc_length import ArcLength

    arc = ArcLength(path)
    pieces = max(int(np.ceil(arc.length / _MOST_SPACING)), 3)
    nodes = np.linspace(0.0, arc.length, pieces + 1)
    while len(nodes) < _MOST_POINTS:
        gap = np.diff(nodes)
        split = (_measure_deviation(path, arc, nodes) > _FIT_TOLERANCE) & (gap > 2.0 * _LEAST_SPACING)
        if not split.any():
            break
        worst = np.flatnonzero(split)[: _MOST_POINTS - len(nodes)]
        nodes = np.sort(np.concatenate([nodes, nodes[worst] + 0.5 * gap[worst]]))
    places, tangents = _compute_nodes(path, arc, nodes)
    third = np.diff(nodes)[:, None] / 3.0
    before, after = np.concatenate([third[:1], third]), np.concatenate([third, third[-1:]])
    if path.closed:  # the first point is the last one too
        return places[:-1], ((places - tangents * np.concatenate([third[-1:], third]))[:-1],
                             (places + tangents * after)[:-1])
    return places, (places - tangents * before, places + tangents * after)


def _compute_nodes(path: Path, arc, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute places (N, 3) and unit tangents (N, 3) at arc lengths s (N,) m."""
    u = arc.parameter_at(s)
    tangents = path.at(u, 1)
    return path.at(u), unit_vectors(tangents)


def _measure_deviation(path: Path, arc, nodes: np.ndarray) -> np.ndarray:
    """Measure how far (N - 1,) m the Bezier segments between nodes (N,) m are off the path."""
    places, tangents = _compute_nodes(path, arc, nodes)
    gap = np.diff(nodes)[:, None, None]
    t = np.linspace(0.0, 1.0, 9)[1:-1, None]
    a, d = places[:-1, None], places[1:, None]
    b, c = a + tangents[:-1, None] * gap / 3.0, d - tangents[1:, None] * gap / 3.0
    drawn = (1 - t) ** 3 * a + 3 * t * (1 - t) ** 2 * b + 3 * t**2 * (1 - t) * c + t**3 * d
    s = nodes[:-1, None] + gap[..., 0] * t[:, 0]
    return np.linalg.norm(drawn - path.at(arc.parameter_at(s.ravel())).reshape(drawn.shape), axis=2).max(axis=1)


def _fit_control_points(path: Path, degree: int) -> np.ndarray:
    """Fit the fewest control points whose spline is within _FIT_TOLERANCE of the path."""
    from ...beyond_mocap.motion.path.arc_length import ArcLength
    from ...beyond_mocap.path_editing import path_line

    arc = ArcLength(path)
    share = np.linspace(0.0, 1.0, 400)
    places = path.at(arc.parameter_at(share * arc.length * (1.0 - 1e-9)))
    least = max(degree + 1, arc.length / _MOST_SPACING + 2.0)
    for count in [count for count in _COUNTS if count >= least] or _COUNTS[-1:]:
        points = path_line.fit_control_points(path, count, degree)
        if np.linalg.norm(path_line.build_b_spline(points, degree).at(share) - places, axis=1).max() <= _FIT_TOLERANCE:
            break
    return points


def _extend_curve(scene: bpy.types.Scene, created: bpy.types.Object, path: Path) -> None:
    """Extend a new curve that is shorter than the path, so that the motion does not end early."""
    from ...beyond_mocap.motion.path.arc_length import ArcLength

    spline = created.data.splines[0]
    if spline.use_cyclic_u:
        return
    units, length = units_per_metre(scene), ArcLength(path).length + _SPARE
    line, last = read_curve(scene, created).sample_line(), list_points(spline)[-1]
    # The last tangent would not do: a body that sways back where it stops has it against the way that it came.
    before = np.flatnonzero(np.linalg.norm(line - line[-1], axis=1) > _SWAY)
    ahead = unit_vectors(line[-1] - line[before[-1] if len(before) else 0])
    for _ in range(_MOST_EXTENSIONS):
        lacks = length - ArcLength(read_curve(scene, created).to_path()).length
        if lacks <= 0.5 * _SPARE:
            return
        by = Vector(ahead * (lacks * units))
        if spline.type == "BEZIER":
            last.handle_left, last.handle_right = last.handle_left + by, last.handle_right + by
            last.co = last.co + by
        else:
            last.co = last.co + Vector((*by, 0.0))


def _scale_line(points: np.ndarray, path: Path) -> np.ndarray:
    """Scale even points (P, 3) of a straight line to the length of the path."""
    from ...beyond_mocap.motion.path.arc_length import ArcLength

    whole = points[-1] - points[0]
    return points[0] + (points - points[0]) * ((ArcLength(path).length + _SPARE) / np.linalg.norm(whole))


def _read_mesh(ground: bpy.types.Object) -> tuple[np.ndarray, np.ndarray]:
    """Read an evaluated mesh object: vertices (V, 3) in the world, Blender units, and triangles (F, 3)."""
    evaluated = ground.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    places, corners = _read_vertices(mesh), np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("vertices", corners)
    evaluated.to_mesh_clear()
    world = np.array(evaluated.matrix_world)
    return places @ world[:3, :3].T + world[:3, 3], corners.reshape(-1, 3)


def _read_vertices(mesh: bpy.types.Mesh) -> np.ndarray:
    """Read the vertices (V, 3) of a mesh, in its own space."""
    places = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", places)
    return places.reshape(-1, 3)
