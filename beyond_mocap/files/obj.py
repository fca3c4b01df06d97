"""Read a ground mesh from a Wavefront OBJ file: vertices and faces only.

Metres; Y up and -Z ahead, as Blender and others write OBJ by default, so that a hill exported with the defaults keeps
its place: the file's (X, Y, Z) is (X, -Z, Y) here.
"""

from __future__ import annotations

import os
from collections.abc import Iterator

import numpy as np

from ..base.errors import InputError
from .content import content

_FARTHEST = 1e5  # metres; larger coordinates are in a wrong unit


def read_mesh(path: str | os.PathLike) -> tuple[np.ndarray, np.ndarray]:
    """Read vertices and triangles; faces with more corners are split into fans.

    Args:
        path: the file.
    Returns:
        Vertices (V, 3) m, Z up, and triangles (F, 3) int, their indices.
    Raises:
        InputError: with the line, for an invalid number, a face with an unknown vertex or fewer than three corners, or
            a
            file without faces.
    """
    vertices, triangles = [], []
    for place, words in _lines(path):
        if words[0] == "v":
            vertices.append(_vertex(words, place))
        elif words[0] == "f":
            corners = [_corner(word, len(vertices), place) for word in words[1:]]
            if len(corners) < 3:
                raise InputError(place, f"a face of {len(corners)} corners", "at least three", "export it again")
            triangles += [(corners[0], b, c) for b, c in zip(corners[1:], corners[2:])]
    if not triangles:
        found = f"{len(vertices)} vertices and no faces"
        raise InputError(path, found, "a mesh with faces", "export the ground as a mesh")
    places = np.array(vertices)
    return np.stack([places[:, 0], -places[:, 2], places[:, 1]], axis=1), np.array(triangles, dtype=int)


def _lines(path) -> Iterator[tuple[str, list[str]]]:
    """Iterate over (place, words) of every line with content; place is `file:line`. A trailing backslash continues a
    line."""
    held: list[str] = []
    for count, line in enumerate(_text(path).split("\n"), 1):
        line = line.partition("#")[0].rstrip()
        more = line.endswith("\\")
        held += line.rstrip("\\").split()
        if held and not more:
            yield f"{path}:{count}", held
            held = []
    if held:
        yield f"{path}", held


def _text(path) -> str:
    data = content(path, "an OBJ file")
    if not data.strip():
        raise InputError(path, "the file is empty", "an OBJ file", "export it again")
    if b"\0" in data:
        raise InputError(path, "binary content", "an OBJ file", "export it as Wavefront OBJ")
    return data.decode("utf-8-sig", errors="replace")  # names of objects and materials may have any encoding


def _vertex(words: list[str], place: str) -> list[float]:
    try:
        vertex = [float(word) for word in words[1:4]]
    except ValueError:
        vertex = []
    if len(vertex) < 3 or not np.isfinite(vertex).all():
        raise InputError(place, f"vertex {' '.join(words[1:4])[:40]!r}", "three numbers", "export it again")
    if max(map(abs, vertex)) > _FARTHEST:
        raise InputError(place, f"vertex {' '.join(words[1:4])[:40]!r}", "metres", "check the unit")
    return vertex


def _corner(word: str, count: int, place: str) -> int:
    """Parse a corner `v`, `v/vt`, `v//vn` or `v/vt/vn` to its vertex's index; negative numbers count from the end."""
    try:
        named = int(word.partition("/")[0])
    except ValueError:
        raise InputError(place, f"corner {word[:40]!r}", "a vertex's number", "export it again") from None
    index = named - 1 if named > 0 else count + named
    if not 0 <= index < count or named == 0:
        raise InputError(place, f"vertex {named} of {count}", "a vertex defined above", "export it again")
    return index
