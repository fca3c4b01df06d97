"""From distance fields to even meshes: surface nets, relaxation on the surface, and crisp cuts along isolines.

Surface nets: Gibson 1998, "Constrained elastic surface nets". One vertex for each cell of the grid that the surface
passes, one quad for each edge of the grid that it crosses.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy import sparse

from .fields import Field

_STEP = 5e-4  # m, for gradients
_SNAP = 0.34  # share of an edge within which a vertex moves onto the cut


@dataclass
class Piece:
    """A part of the surface while it is made.

    Attributes:
        vertices: (V, 3) m.
        faces: tuples of vertex indices, counterclockwise from outside.
        materials: a number for each face.
    """

    vertices: np.ndarray
    faces: list[tuple[int, ...]]
    materials: list[int] = field(default_factory=list)


def mesh_field(solid: Field, axes) -> Piece:
    """Mesh the surface of a solid inside a box.

    Args:
        solid: the field.
        axes: the grid's coordinates along x, y and z, m, rising (`grade`).
    """
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = solid(grid.reshape(-1, 3)).reshape(grid.shape[:3])
    cell, vertices = _place_cell_vertices(values, grid)
    quads = np.concatenate([_find_quads(values < 0.0, cell, axis) for axis in range(3)])
    return Piece(vertices, [tuple(map(int, quad)) for quad in quads[np.all(quads >= 0, axis=1)]])


def grade(*steps) -> np.ndarray:
    """Lay coordinates from the first place to the last, m.

    Args:
        steps: rows (place, distance to the next coordinate there) m; between the places the distance changes evenly.
    """
    places, sizes = np.array(steps, dtype=float).T
    row = [places[0]]
    while row[-1] < places[-1]:
        row.append(row[-1] + float(np.interp(row[-1], places, sizes)))
    return np.array(row)


def _place_cell_vertices(values: np.ndarray, grid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Place a vertex at the mean crossing of each cell's edges; return the cells' vertex numbers (-1: none) and the
    vertices (V, 3) m."""
    shape = tuple(n - 1 for n in values.shape)
    corner = {offset: values[tuple(slice(o, o + n) for o, n in zip(offset, shape))] for offset in np.ndindex(2, 2, 2)}
    total, count = np.zeros((*shape, 3)), np.zeros(shape)
    for offset in corner:
        for axis in range(3):
            if offset[axis]:
                continue
            other = tuple(1 if a == axis else o for a, o in enumerate(offset))
            a, b = corner[offset], corner[other]
            crosses = (a < 0.0) != (b < 0.0)
            share = np.where(crosses, a / np.where(crosses, a - b, 1.0), 0.0)
            place = np.broadcast_to(np.array(offset, dtype=float), (*shape, 3)).copy()
            place[..., axis] = share
            total += place * crosses[..., None]
            count += crosses
    active = count > 0
    cell = np.full(shape, -1)
    cell[active] = np.arange(np.count_nonzero(active))
    start, end = grid[:-1, :-1, :-1][active], grid[1:, 1:, 1:][active]
    return cell, start + (end - start) * total[active] / count[active][:, None]


def _find_quads(inside: np.ndarray, cell: np.ndarray, axis: int) -> np.ndarray:
    """Find the quads (Q, 4) of cells around the grid's edges along an axis; -1 where a cell is missing."""
    after, before = np.moveaxis(inside, axis, 0)[1:], np.moveaxis(inside, axis, 0)[:-1]
    numbers = np.pad(np.moveaxis(cell, axis, 0), ((0, 0), (1, 1), (1, 1)), constant_values=-1)
    where = np.argwhere(after != before)
    i, j, k = where.T
    around = [numbers[i, j, k], numbers[i, j + 1, k], numbers[i, j + 1, k + 1], numbers[i, j, k + 1]]
    quads = np.stack(around, axis=1)
    flip = after[i, j, k] ^ (axis == 1)
    return np.where(flip[:, None], quads[:, ::-1], quads)


def compute_gradient(solid: Field, points: np.ndarray) -> np.ndarray:
    """Compute the gradient (N, 3) of a field at points (N, 3) m."""
    moves = np.concatenate([_STEP * np.eye(3), -_STEP * np.eye(3)])
    values = solid((points[None] + moves[:, None]).reshape(-1, 3)).reshape(6, -1)
    return ((values[:3] - values[3:]) / (2.0 * _STEP)).T


def project(solid: Field, points: np.ndarray, most: float) -> np.ndarray:
    """Project points (N, 3) onto the surface of a solid, each by at most `most` metres."""
    slope = compute_gradient(solid, points)
    steep = np.maximum(np.sum(slope**2, axis=1, keepdims=True), 0.05)
    return points - np.clip(solid(points)[:, None], -most, most) * slope / steep


def relax(piece: Piece, solid: Field, turns: int, most: float) -> None:
    """Even a piece's quads out on its solid; vertices on open edges stay.

    Args:
        piece: changed in place.
        solid: its field.
        turns: how often.
        most: m, the largest move onto the surface in a turn.
    """
    edges = _list_edges(piece.faces)
    count = len(piece.vertices)
    links = sparse.coo_matrix((np.ones(len(edges)), edges.T), (count, count)).tocsr()
    links = ((links + links.T) > 0).astype(float)
    share = sparse.diags(1.0 / np.maximum(np.asarray(links.sum(axis=1)).ravel(), 1.0)) @ links
    free = np.ones(count, dtype=bool)
    free[np.unique(list_border_edges(piece.faces))] = False
    for _ in range(turns):
        moved = piece.vertices + 0.6 * (share @ piece.vertices - piece.vertices)
        piece.vertices[free] = project(solid, moved[free], most)


def _list_edges(faces) -> np.ndarray:
    """List the directed edges (E, 2) of faces."""
    return np.array([(a, b) for face in faces for a, b in zip(face, (*face[1:], face[0]))], dtype=int)


def list_border_edges(faces) -> np.ndarray:
    """List the edges (B, 2) that only one face has, in that face's direction."""
    known = {tuple(edge) for edge in _list_edges(faces).tolist()}
    return np.array([(a, b) for a, b in sorted(known) if (b, a) not in known], dtype=int).reshape(-1, 2)


def list_borders(faces) -> list[list[int]]:
    """List the closed borders of faces as rows of vertices, each in the direction of its faces."""
    after = dict(map(tuple, list_border_edges(faces).tolist()))
    borders = []
    while after:
        start, here = next(iter(after.items()))
        border = [start]
        del after[start]
        while here != start:
            border.append(here)
            here = after.pop(here)
        borders.append(border)
    return borders


def cut_piece(piece: Piece, solid: Field, isoline: Field, keep: tuple[int | None, int | None]) -> None:
    """Cut a piece along the line where `isoline` is zero; vertices near the line move onto it.

    Args:
        piece: changed in place.
        solid: its field, onto which the line's vertices are projected.
        isoline: any smooth field.
        keep: material of the faces where it is negative and positive; None drops that side, -1 leaves materials.
    """
    values = isoline(piece.vertices)
    _snap_to_line(piece, values)
    made: dict[tuple[int, int], int] = {}
    added: list[np.ndarray] = []
    faces, materials = [], []
    before = piece.materials or [0] * len(piece.faces)
    for face, material in zip(piece.faces, before):
        for side, part in _split_face(piece, values, face, (made, added)):
            wanted = keep[side]
            if wanted is not None:
                faces.append(part)
                materials.append(material if wanted == -1 else wanted)
    piece.vertices = np.concatenate([piece.vertices, np.array(added).reshape(-1, 3)])
    on_line = np.concatenate([np.flatnonzero(values == 0.0), len(values) + np.arange(len(added))]).astype(int)
    for _ in range(4):
        piece.vertices[on_line] = project(solid, piece.vertices[on_line], 0.01)
        piece.vertices[on_line] = project(isoline, piece.vertices[on_line], 0.01)
    piece.faces, piece.materials = faces, materials
    drop_unused(piece)


def _snap_to_line(piece: Piece, values: np.ndarray) -> None:
    """Move vertices close to the line onto it, each along the edge with the shortest move; `values` (V,) follow."""
    edges = _list_edges(piece.faces)
    a, b = edges[:, 0], edges[:, 1]
    crosses = values[a] * values[b] < 0.0
    edges = np.concatenate([edges[crosses], edges[crosses][:, ::-1]])
    share = values[edges[:, 0]] / (values[edges[:, 0]] - values[edges[:, 1]])
    near = share < _SNAP
    edges, share = edges[near], share[near]
    order = np.argsort(np.round(share, 9), kind="stable")  # on equal shares the processor does not choose
    chosen, first = np.unique(edges[order, 0], return_index=True)
    ends, part = edges[order, 1][first], share[order][first]
    start = piece.vertices.copy()
    piece.vertices[chosen] = start[chosen] + part[:, None] * (start[ends] - start[chosen])
    values[chosen] = 0.0


def _split_face(piece: Piece, values, face, store) -> list[tuple[int, tuple[int, ...]]]:
    """Split a face along the line; return its parts, each with 0 for the negative side or 1."""
    signs = np.sign(values[list(face)])
    if np.all(signs <= 0.0) or np.all(signs >= 0.0):
        return [(int(signs.sum() > 0.0), face)]
    made, added = store
    sides: tuple[list[int], list[int]] = ([], [])
    for a, b in zip(face, (*face[1:], face[0])):
        if values[a] <= 0.0:
            sides[0].append(a)
        if values[a] >= 0.0:
            sides[1].append(a)
        if values[a] * values[b] < 0.0:
            key = (min(a, b), max(a, b))
            if key not in made:
                share = values[key[0]] / (values[key[0]] - values[key[1]])
                made[key] = len(values) + len(added)
                added.append(piece.vertices[key[0]] + share * (piece.vertices[key[1]] - piece.vertices[key[0]]))
            sides[0].append(made[key])
            sides[1].append(made[key])
    return [(side, tuple(part)) for side, part in enumerate(sides) if len(part) > 2]


def drop_unused(piece: Piece) -> None:
    """Drop vertices that no face uses."""
    used = np.unique([v for face in piece.faces for v in face])
    number = np.full(len(piece.vertices), -1)
    number[used] = np.arange(len(used))
    piece.vertices = piece.vertices[used]
    piece.faces = [tuple(int(number[v]) for v in face) for face in piece.faces]


def keep_largest(piece: Piece) -> None:
    """Keep the part of a piece that hangs together and has most faces."""
    edges = _list_edges(piece.faces)
    count = len(piece.vertices)
    links = sparse.coo_matrix((np.ones(len(edges)), edges.T), (count, count))
    _, label = sparse.csgraph.connected_components(links, directed=False)
    owner = label[[face[0] for face in piece.faces]]
    largest = np.argmax(np.bincount(owner))
    chosen = np.flatnonzero(owner == largest)
    piece.faces = [piece.faces[i] for i in chosen]
    piece.materials = [piece.materials[i] for i in chosen] if piece.materials else []
    drop_unused(piece)
