"""Text over the 3D view, and the legend of the overlays that are switched on."""

from __future__ import annotations

import blf
import gpu
from gpu_extras.batch import batch_for_shader

from ..core import window
from . import colours

SIZE, MARGIN, LINE = 11, 5, 1.4  # points, points, sizes
SWATCH = 150  # points: length of a colour scale
FONT = 0
GROUND = (0.03, 0.03, 0.03, 0.72)  # what text stands on

_square: list = []


def write(x: float, y: float, lines, scale: float, strength: float = 1.0) -> None:
    """Lines of text, the first on top, on a dark ground whose lower left corner is at pixel x, y."""
    size, margin, text = SIZE * scale, MARGIN * scale, "\n".join(lines)
    blf.size(FONT, size)
    blf.enable(FONT, blf.WORD_WRAP)  # breaks at line ends too, so that one call draws all lines
    blf.word_wrap(FONT, 10000)
    width, height = blf.dimensions(FONT, text)
    box(x, y, width + 2 * margin, height + 2.4 * margin, (*GROUND[:3], GROUND[3] * strength))
    blf.color(FONT, 1.0, 1.0, 1.0, strength)
    blf.position(FONT, x + margin, y + margin + height - 0.78 * size, 0.0)
    blf.draw(FONT, text)
    blf.disable(FONT, blf.WORD_WRAP)


def box(x: float, y: float, width: float, height: float, colour) -> None:
    """A filled rectangle in pixels."""
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    if not _square:
        _square.append(batch_for_shader(shader, "TRIS", {"pos": [(0, 0), (1, 0), (1, 1), (0, 0), (1, 1), (0, 1)]}))
    with gpu.matrix.push_pop():
        gpu.matrix.translate((x, y))
        gpu.matrix.scale((width, height))
        shader.bind()
        shader.uniform_float("color", colour)
        _square[0].draw(shader)


def free() -> None:
    """Forget the rectangle."""
    _square.clear()


def draw(context, on: list[str]) -> None:
    """The legend in the view's lower left corner, a row for each overlay that needs one."""
    rows = [row for name, row in ROWS.items() if name in on]
    if not rows:
        return
    scale = context.preferences.system.ui_scale
    left, bottom, _, _ = window.free_region(context.area, context.region)
    x, y = left + 8 * scale, bottom + 8 * scale
    for row in reversed(rows):
        y += row(x, y, scale) + 4 * scale


def _scale(title: str, stops, factor: float, unit: str):
    """A row that shows a colour scale with its numbers."""

    def row(x: float, y: float, scale: float) -> float:
        size, margin = SIZE * scale, MARGIN * scale
        step, width = LINE * size, SWATCH * scale
        height = 2 * step + 0.6 * size + 2 * margin
        box(x, y, width + 6 * margin, height, GROUND)
        part = width / len(stops)
        blf.size(FONT, size)
        for number, (stop, rgb) in enumerate(zip(stops, colours.SCALE)):
            left = x + margin + number * part
            box(left, y + margin + step, part, 0.6 * size, (*rgb, 1.0))
            _line(left, y + margin + 0.2 * size, f"{factor * stop:g}", size)
        _line(x + margin + width, y + margin + 0.2 * size, unit, size)
        _line(x + margin, y + margin + step + 0.9 * size, title, size)
        return height

    return row


def _keys(*entries: tuple[str, tuple]):
    """A row of coloured squares with words."""

    def row(x: float, y: float, scale: float) -> float:
        size, margin = SIZE * scale, MARGIN * scale
        blf.size(FONT, size)
        widths = [blf.dimensions(FONT, text)[0] + 2.4 * size for text, _ in entries]
        height = LINE * size + 2 * margin
        box(x, y, sum(widths) + 2 * margin, height, GROUND)
        left = x + margin
        for (text, rgb), width in zip(entries, widths):
            box(left, y + margin + 0.25 * size, 0.8 * size, 0.8 * size, (*rgb, 1.0))
            _line(left + 1.2 * size, y + margin + 0.3 * size, text, size)
            left += width
        return height

    return row


def _line(x: float, y: float, text: str, size: float) -> None:
    blf.size(FONT, size)
    blf.color(FONT, 1.0, 1.0, 1.0, 1.0)
    blf.position(FONT, x, y, 0.0)
    blf.draw(FONT, text)


_SIDES = (("left", colours.LEFT), ("right", colours.RIGHT))
ROWS = {
    "track": _scale("Off the track", colours.ROOT_STOPS, 100.0, "cm"),
    "footprints": _scale("Standing foot slides", colours.SLIDE_STOPS, 1000.0, "mm"),
    "speed": _keys(("asked speed", colours.ASKED), ("the body's", colours.PLAYED), ("1 m high: 5 m/s", colours.GREY)),
    "contacts": _keys(*_SIDES),
    "rides": _keys(("original", colours.SKY), ("new path", colours.ORANGE), ("a tick: 1 s", colours.GREY)),
    "shots": _keys(("the ball's way", colours.WHITE), ("other ways", colours.BLACK),
                   ("after the target", colours.VERMILION), ("striking part", colours.SKY),
                   ("strike", colours.STRIKE), ("bounce", colours.ORANGE)),
    "moments": _keys(("strike point", colours.STRIKE), ("ball", colours.BALL), ("gap", colours.GAP)),
}
