"""Draws the rooms of the core and what they import as docs/pictures/architecture.svg, from the source itself.

    python packaging/draw_house.py            write the picture
    python packaging/draw_house.py --check    exit with 1 where the picture is out of date

Layers stand as in `house.LAYERS`, the ground at the bottom. An arrow means "imports"; an arrow that follows from others
is left out (transitive reduction), or the picture would be black.
"""

from __future__ import annotations

import ast
import sys
from xml.sax.saxutils import escape

from house import CORE, LAYERS, TOP, room_graph

PICTURE = TOP / "docs" / "pictures" / "architecture.svg"
_WIDTH, _BOX, _TALL, _GAP, _MARGIN = 1180, 196, 54, 34, 20
_BLENDER = (("scene/", "Blender data"), ("operators/", "what buttons do"), ("panels/", "what is shown"))


def draw_house() -> str:
    """The picture as the text of an SVG file."""
    places = _place_rooms()
    arrows = [_draw_arrow(places[room], places[other]) for room, others in _reduced().items() for other in sorted(others)]
    boxes = [_draw_box(place, room, _first_words(room)) for room, place in places.items()]
    top = [
        _draw_box((_MARGIN + number * (_BOX + 24), _MARGIN), name, text, "#fdebd0")
        for number, (name, text) in enumerate(_BLENDER)
    ]
    height = _MARGIN * 2 + (len(LAYERS) + 1) * (_TALL + _GAP)
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}" font-family="sans-serif">'
        '<defs><marker id="tip" markerWidth="9" markerHeight="7" refX="8" refY="3.5" orient="auto">'
        '<path d="M0,0 L9,3.5 L0,7 z" fill="#667"/></marker></defs>'
        f'<rect width="{_WIDTH}" height="{height}" fill="#fff"/>'
    )
    return "\n".join([head, *arrows, *boxes, *top, "</svg>", ""])


def _place_rooms() -> dict[str, tuple[float, float]]:
    """Upper left corner of each room's box."""
    places = {}
    for height, rooms in enumerate(LAYERS):
        y = _MARGIN + (len(LAYERS) - height) * (_TALL + _GAP)
        left = 0.5 * (_WIDTH - len(rooms) * _BOX - (len(rooms) - 1) * 24)
        for number, room in enumerate(rooms):
            places[room] = (left + number * (_BOX + 24), y)
    return places


def _reduced() -> dict[str, set[str]]:
    """The rooms' imports without those that follow from others."""
    graph = room_graph()

    def reach(room: str) -> set[str]:
        return graph[room].union(*(reach(other) for other in graph[room]))

    return {room: {o for o in others if not any(o in reach(p) for p in others if p != o)} for room, others in graph.items()}


def _first_words(room: str) -> str:
    """What the room's own docstring begins with."""
    text = ast.get_docstring(ast.parse((TOP / CORE / room / "__init__.py").read_text("utf-8"))) or ""
    return text.split("\n")[0].split(":")[0].split(".")[0].split(";")[0]


def _draw_box(place: tuple[float, float], name: str, text: str, colour: str = "#e8eef7") -> str:
    x, y = place
    words = text if len(text) <= 34 else text[: text.rfind(" ", 0, 33)] + " …"
    return (
        f'<rect x="{x:g}" y="{y:g}" width="{_BOX}" height="{_TALL}" rx="6" fill="{colour}" stroke="#557"/>'
        f'<text x="{x + _BOX / 2:g}" y="{y + 22:g}" text-anchor="middle" font-size="15">{escape(name)}</text>'
        f'<text x="{x + _BOX / 2:g}" y="{y + 41:g}" text-anchor="middle" font-size="10.5" fill="#445">{escape(words)}</text>'
    )


def _draw_arrow(above: tuple[float, float], below: tuple[float, float]) -> str:
    start, end = (above[0] + _BOX / 2, above[1] + _TALL), (below[0] + _BOX / 2, below[1])
    return (
        f'<line x1="{start[0]:g}" y1="{start[1]:g}" x2="{end[0]:g}" y2="{end[1]:g}" stroke="#99a" '
        'marker-end="url(#tip)"/>'
    )


if __name__ == "__main__":
    if "--check" in sys.argv[1:]:
        sys.exit(PICTURE.read_text("utf-8") != draw_house() and f"{PICTURE.name} is out of date: run {sys.argv[0]}")
    PICTURE.write_text(draw_house(), "utf-8")
