"""Read a ground mesh from a Wavefront OBJ file: vertices and faces only.

Metres; Y up and -Z ahead, as Blender and others write OBJ by default, so that a hill exported with the defaults keeps
its place: the file's (X, Y, Z) is (X, -Z, Y) here.
"""

from __future__ import annotations

import os
from collections.abc import Iterator

import numpy as np

from ..base.content import read_bytes
from ..base.errors import InputError, format_count

_MAX_METRES = 1e5  # metres; larger coordinates are in a wrong unit


def read_mesh(path: str | os.PathLike) -> tuple[np.ndarray, np.ndarray]:
    """Read vertices and triangles; faces with more corners are split into fans.

    Args:
        path: the file.
    Returns:
        Vertices (V, 3) m, Z up, and triangles (F, 3) int, their indices.
    Raises:
        InputError: with the line, for an invalid number, a face with an unknown vertex or fewer than three corners, or
            a file without faces.
    """
    vertices, triangles = [], []
    for place, words in _iter_statements(path):
        if words[0] == "v":
            vertices.append(_parse_vertex(words, place))
        elif words[0] == "f":
            corners = [_parse_corner(word, len(vertices), place) for word in words[1:]]
            if len(corners) < 3:
                raise InputError(place, f"a face of {len(corners)} corners", "at least three", "export it again")
            triangles += [(corners[0], b, c) for b, c in zip(corners[1:], corners[2:])]
    if not triangles:
        found = f"{format_count(len(vertices), 'vertex', 'vertices')} and no faces"
        raise InputError(path, found, "a mesh with faces", "export the ground as a mesh")
    file_vertices = np.array(vertices)
    return np.stack([file_vertices[:, 0], -file_vertices[:, 2], file_vertices[:, 1]], axis=1), np.array(triangles,
            dtype=int)


def _iter_statements(path) -> Iterator[tuple[str, list[str]]]:
    """Iterate over (place, words) of every line with content; place is `file:line`. A trailing backslash continues a
    line."""
    words: list[str] = []
    for count, line in enumerate(_read_text(path).split("\n"), 1):
        line = line.partition("#")[0].rstrip()
        is_continued = line.endswith("\\")
        words += line.rstrip("\\").split()
        if words and not is_continued:
            yield f"{path}:{count}", words
            words = []
    if words:
        yield f"{path}", words


def _read_text(path) -> str:
    data = read_bytes(path, "an OBJ file")
    if not data.strip():
        raise InputError(path, "the file is empty", "an OBJ file", "export it again")
    if b"\0" in data:
        raise InputError(path, "binary content", "an OBJ file", "export it as Wavefront OBJ")
    return data.decode("utf-8-sig", errors="replace")  # names of objects and materials may have any encoding


def _parse_vertex(words: list[str], place: str) -> list[float]:
    try:
        vertex = [float(word) for word in words[1:4]]
    except ValueError:
        vertex = []
    if len(vertex) < 3 or not np.isfinite(vertex).all():
        raise InputError(place, f"vertex {' '.join(words[1:4])[:40]!r}", "three numbers", "export it again")
    if max(map(abs, vertex)) > _MAX_METRES:
        raise InputError(place, f"vertex {' '.join(words[1:4])[:40]!r}", "metres", "check the unit")
    return vertex


def _parse_corner(word: str, count: int, place: str) -> int:
    """Parse a corner `v`, `v/vt`, `v//vn` or `v/vt/vn` to its vertex's index; negative numbers count from the end."""
    try:
        number = int(word.partition("/")[0])
    except ValueError:
        raise InputError(place, f"corner {word[:40]!r}", "a vertex's number", "export it again") from None
    index = number - 1 if number > 0 else count + number
    if not 0 <= index < count or number == 0:
        raise InputError(place, f"vertex {number} of {count}", "a vertex defined above", "export it again")
    return index
