"""Draw the packages of the core and their imports as docs/pictures/architecture.svg, from the source itself.

    python packaging/draw_architecture.py            write the picture
    python packaging/draw_architecture.py --check    exit with 1 if the picture is out of date

Packages are arranged as in `architecture.LAYERS`, the lowest layer at the bottom. An arrow means "imports"; arrows that
follow from others are left out (transitive reduction), to keep the picture readable.
"""

from __future__ import annotations

import ast
import re
import sys
import textwrap
from xml.sax.saxutils import escape

from architecture import CORE, LAYERS, TOP, build_package_graph, find_layer

PICTURE = TOP / "docs" / "pictures" / "architecture.svg"
COLUMNS = {"annotation": 0, "synthetic": 1, "appearance": 5, "files": 0, "ball": 2, "library": 1, "synthesis": 1,
           "evaluation": 3, "path_editing": 0, "passes": 1, "throws": 2, "markers": 3, "study": 4, "match": 5}
"""Column of a package in its layer; other packages fill the width."""
BLENDER = {"panels": "Panels in the sidebar", "scene": "Data in Blender, updates", "operators": "Actions of buttons"}
_MARGIN, _COLUMN_STEP, _BOX_WIDTH, _ROW_STEP, _BOX_HEIGHT = 36, 200, 180, 84, 56
_FULL_WIDTH = 5 * _COLUMN_STEP + _BOX_WIDTH
_TOP = _MARGIN + _ROW_STEP + 20


def draw_architecture() -> str:
    """Draw the picture; return the text of an SVG file."""
    boxes = [_draw_box(*_compute_corner(room), _read_summary(room), room) for rooms in LAYERS for room in rooms]
    arrows = [_draw_arrow(_compute_route(room, other)) for room, others in _reduce_imports().items()
              for other in sorted(others)]
    right, bottom = _FULL_WIDTH + 2 * _MARGIN, _TOP + len(LAYERS) * _ROW_STEP + 20
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {right} {bottom}" font-family="sans-serif">'
        '<defs><marker id="tip" markerWidth="9" markerHeight="7" refX="8" refY="3.5" orient="auto">'
        '<path d="M0,0 L9,3.5 L0,7 z" fill="#667"/></marker></defs>'
        f'<rect width="{right}" height="{bottom}" fill="#fff"/>'
        f'<rect x="12" y="{_TOP - 30}" width="{right - 24}" height="{bottom - _TOP + 18}" rx="10" fill="#f7f8fa" '
        f'stroke="#ccd"/><text x="24" y="{_TOP - 12}" font-size="13" fill="#445">{CORE}/, without Blender</text>'
    )
    return "\n".join([head, *_draw_blender(), *arrows, *boxes, "</svg>", ""])


def _draw_blender() -> list[str]:
    """Draw the packages for Blender in a row above the core."""
    lefts = [_MARGIN + column * _COLUMN_STEP for column in (0, 2, 4)]
    middle = _MARGIN + _BOX_HEIGHT / 2 - 14
    arrows = [_draw_arrow([(lefts[0] + _BOX_WIDTH, middle), (lefts[1], middle)]),
              _draw_arrow([(lefts[2], middle), (lefts[1] + _BOX_WIDTH, middle)]),
              *(_draw_arrow([(left + _BOX_WIDTH / 2, middle), (left + _BOX_WIDTH / 2, _TOP - 30)])
                for left in lefts[1:])]
    boxes = zip(lefts, BLENDER.items())
    return arrows + [_draw_box(left, _MARGIN - 14, _BOX_WIDTH, text, name, "#fdebd0") for left, (name, text) in boxes]


def _compute_corner(room: str) -> tuple[float, float, float]:
    """Compute left, top and width of a package's box."""
    y = _TOP + (len(LAYERS) - 1 - find_layer(room)) * _ROW_STEP
    return (_MARGIN + COLUMNS[room] * _COLUMN_STEP, y, _BOX_WIDTH) if room in COLUMNS else (_MARGIN, y, _FULL_WIDTH)


def _reduce_imports() -> dict[str, set[str]]:
    """Reduce the packages' imports to those that do not follow from others; `synthetic.ground_truth` is left out."""
    graph = {room: {o for o in others if find_layer(o) < find_layer(room)} for room,
             others in build_package_graph().items()}

    def reach(room: str) -> set[str]:
        return graph[room].union(*(reach(other) for other in graph[room]))

    implied = {room: set().union(*map(reach, others)) for room, others in graph.items()}
    return {room: others - implied[room] for room, others in graph.items()}


def _compute_route(room: str, other: str) -> list[tuple[float, float]]:
    """Compute the corners of an arrow: straight down, or down and aside, or aside and down if a box is in the way."""
    (left, top, wide), (to_left, to_top, to_wide) = _compute_corner(room), _compute_corner(other)
    start, end = left + wide / 2, to_left + to_wide / 2
    if room not in COLUMNS or other not in COLUMNS or start == end:
        x = end if room not in COLUMNS else start
        return [(x, top + _BOX_HEIGHT), (x, to_top)]
    below = [r for r in COLUMNS if COLUMNS[r] == COLUMNS[room] and find_layer(other) <= find_layer(r)
             < find_layer(room)]
    if below:
        y = top + 0.75 * _BOX_HEIGHT
        return [(left if end < start else left + wide, y), (end, y), (end, to_top)]
    y = to_top + 0.35 * _BOX_HEIGHT
    return [(start, top + _BOX_HEIGHT), (start, y), (to_left + to_wide if end < start else to_left, y)]


def _read_summary(room: str) -> str:
    """Return the beginning of the package's docstring."""
    text = ast.get_docstring(ast.parse((TOP / CORE / room / "__init__.py").read_text("utf-8"))) or ""
    return re.split(r"[.:;(]", text.split("\n")[0])[0].strip()


def _draw_box(x: float, y: float, wide: float, text: str, name: str, colour: str = "#e8eef7") -> str:
    lines = textwrap.wrap(text, wide // 6)[:2]
    middle = x + wide / 2
    return (
        f'<rect x="{x:g}" y="{y:g}" width="{wide}" height="{_BOX_HEIGHT}" rx="6" fill="{colour}" stroke="#557"/>'
        f'<text x="{middle:g}" y="{y + 19:g}" text-anchor="middle" font-size="15">{escape(name)}</text>'
    ) + "".join(
        f'<text x="{middle:g}" y="{y + 35 + 13 * number:g}" text-anchor="middle" font-size="10.5" fill="#445">'
        f"{escape(line)}</text>" for number, line in enumerate(lines)
    )  # fmt: skip


def _draw_arrow(corners: list[tuple[float, float]]) -> str:
    points = " ".join(f"{x:g},{y:g}" for x, y in corners)
    return f'<polyline points="{points}" fill="none" stroke="#778" marker-end="url(#tip)"/>'


if __name__ == "__main__":
    if "--check" in sys.argv[1:]:
        sys.exit(PICTURE.read_text("utf-8") != draw_architecture()
                 and f"{PICTURE.name} is out of date: run {sys.argv[0]}")
    PICTURE.write_text(draw_architecture(), "utf-8")
