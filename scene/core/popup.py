"""The label menu at the pointer during annotation: rows of a digit, a label, and the nearest that the library has.

The menu is placed within the editor, in several columns where there is little height. Units are pixels of the region,
from its lower left corner. `place_menu` needs no window.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import bpy

from ...beyond_mocap.annotation.decision import can_skip, find_alternative, is_available
from ...beyond_mocap.annotation.key_commands import AnnotationState

Rect = tuple[float, float, float, float]

_ROW, _EDGE, _GAP = 1.65, 0.7, 0.8  # shares of the font size: height of a row, edge of the box, column gap
_OFF_POINTER = 1.2  # share of the font size between pointer and box
_ARROW = "\u2192"


@dataclass(frozen=True)
class Row:
    """One option.

    Attributes:
        key: what to press.
        text: the label as drawn.
        note: the nearest that the library has.
        word: the label, for the mouse.
        faint: whether the library cannot serve it.
        chosen: whether it is among the chosen labels.
    """

    key: str
    text: str
    note: str = ""
    word: str = ""
    faint: bool = False
    chosen: bool = False


@dataclass(frozen=True)
class Content:
    """The contents of the menu.

    Attributes:
        head: line above (player, labels, time).
        rows: the options.
        foot: hints below.
    """

    head: str
    rows: tuple[Row, ...]
    foot: tuple[str, ...]


@dataclass(frozen=True)
class Box:
    """The menu in place, in pixels.

    Attributes:
        content: what it shows.
        box: left, bottom, right, top.
        rows: the same for each row.
        head: place of the line above.
        foot: places of the hints.
        offsets: x of text and of note within a row.
        size: font size.
    """

    content: Content
    box: Rect
    rows: tuple[Rect, ...]
    head: tuple[float, float]
    foot: tuple[tuple[float, float], ...]
    offsets: tuple[float, float]
    size: float

    def word_at(self, x: float, y: float) -> str | None:
        """Return the label of the row at this place; "" elsewhere in the box, None outside."""
        for row, rect in zip(self.content.rows, self.rows):
            if _is_inside(rect, x, y):
                return row.word
        return "" if _is_inside(self.box, x, y) else None


def build_content(state: AnnotationState, player: str, message: str = "", folded: bool = False) -> Content:
    """Build the contents for a state.

    Args:
        state: of the annotation.
        player: the player's name.
        message: on what was done last.
        folded: show no list before a first label is chosen.
    Returns:
        The contents.
    """
    rows = tuple(Row(str(option.digit), option.word, f"{_ARROW} {' '.join(option.alternative)}" if option.alternative
                     else "", word=option.word, faint=not option.is_available, chosen=option.is_chosen)
                 for option in state.page_options)
    more = [f"= more ({state.page + 1}/{state.page_count})"] if state.page_count > 1 else []
    if not state.trail:
        start_hint = [f"in {state.start:.2f} s, O: out"] if state.start is not None else ["I in  O out"]
        hints = "   ".join([*start_hint, *more, "Esc close"])
        visible_rows = () if folded else rows
        return Content(f"{player}: key moment at the playhead", visible_rows, (hints, message) if message else (hints,))
    walk = state.walk
    when = f"{state.time:.2f} s" if walk.kind == "moment" else f"{state.start:.2f} to {state.end:.2f} s"
    head = f"{player}: {' '.join(walk.words) or '...'}   {when}"
    skip = ["0 any"] if can_skip(walk) else []
    hints = ["   ".join([*skip, *more, "Enter done", "Backspace back"])]
    if walk.words and not is_available(walk, state.available):
        nearest = " ".join(find_alternative(walk.words, walk.kind, state.available))
        hints.insert(0, "not in the library" + (f" {_ARROW} {nearest}" if nearest else ""))
    return Content(head, rows, tuple(hints))


def place_menu(content: Content, at: tuple[float, float] | None, free: Rect, size: float,
               width_of: Callable[[str], float]) -> Box:
    """Place the menu within a free rectangle.

    Args:
        content: what it shows.
        at: the pointer, at which the upper left corner goes; None for the lower left corner of `free`.
        free: left, bottom, right, top of the free part of the region.
        size: font size.
        width_of: returns the width of a text.
    Returns:
        The menu in place.
    """
    row, edge, gap = round(_ROW * size), round(_EDGE * size), round(_GAP * size)
    key = max((width_of(one.key) for one in content.rows), default=0.0) + gap
    text = max((width_of(one.text) for one in content.rows), default=0.0) + gap
    note = max((width_of(one.note) for one in content.rows), default=0.0)
    lines = 1 + len(content.foot)
    # rows that fit below the head and above the hints; more rows go to further columns
    per_column = max(1, int((free[3] - free[1] - 2 * edge) / row) - lines)
    columns = max(1, -(-len(content.rows) // per_column))
    tallest = -(-len(content.rows) // columns) if content.rows else 0
    column = math.ceil(key + text + note + (gap if columns > 1 else 0.0))
    width = math.ceil(max([columns * column, width_of(content.head), *map(width_of, content.foot)])) + 2 * edge
    height = (tallest + lines) * row + 2 * edge
    left, top = map(round, _find_corner(at, free, width, height, _OFF_POINTER * size))
    first = top - edge - row
    rects = []
    for number in range(len(content.rows)):
        x, y = left + edge + (number // tallest) * column, first - (number % tallest + 1) * row
        rects.append((x, y, x + (column if columns > 1 else width - 2 * edge), y + row))
    feet = [(left + edge, first - (tallest + number + 1) * row) for number in range(len(content.foot))]
    box = (left, top - height, left + width, top)
    return Box(content, box, tuple(rects), head=(left + edge, first), foot=tuple(feet), offsets=(key, key + text),
               size=size)


def measure_font_size() -> float:
    """Return the font size of the interface in pixels."""
    preferences = bpy.context.preferences
    return preferences.ui_styles[0].widget.points * preferences.system.ui_scale


def measure_text(text: str) -> float:
    """Return the width of a text in the interface's font, in pixels."""
    import blf

    blf.size(0, measure_font_size())
    return blf.dimensions(0, text)[0]


def draw_menu(box: Box, hovered: str = "") -> None:
    """Draw the menu into the present region; `hovered` is the label under the mouse."""
    import gpu

    theme = bpy.context.preferences.themes[0].user_interface
    back, item = theme.wcol_menu_back, theme.wcol_menu_item
    gpu.state.blend_set("ALPHA")
    _draw_rectangle(box.box, (*back.inner[:3], max(back.inner[3], 0.92)))
    for row, rect in zip(box.content.rows, box.rows):
        if row.word and (row.word == hovered or row.chosen):
            _draw_rectangle(rect, tuple(item.inner_sel) if row.word == hovered else (*item.inner_sel[:3], 0.45))
    plain, bright = (*item.text, 1.0), (*item.text_sel, 1.0)
    _draw_text(box.content.head, *box.head, bright, box)
    for row, rect in zip(box.content.rows, box.rows):
        faint = (*item.text, 0.45)
        _draw_text(row.key, rect[0], rect[1], faint if row.faint else bright, box)
        _draw_text(row.text, rect[0] + box.offsets[0], rect[1], faint if row.faint else plain, box)
        _draw_text(row.note, rect[0] + box.offsets[1], rect[1], (*item.text, 0.6), box)
    for line, place in zip(box.content.foot, box.foot):
        _draw_text(line, *place, (*item.text, 0.7), box)
    gpu.state.blend_set("NONE")


def _find_corner(at, free: Rect, wide: float, tall: float, away: float) -> tuple[float, float]:
    """Return left and top of the box: beside the pointer, on its other side at the right edge, always within `free`."""
    left, top = (free[0], free[1] + tall) if at is None else (at[0] + away, at[1] - away)
    if at is not None and left + wide > free[2] and at[0] - away - wide >= free[0]:
        left = at[0] - away - wide
    return max(free[0], min(left, free[2] - wide)), min(free[3], max(top, free[1] + tall))


def _is_inside(rect: Rect, x: float, y: float) -> bool:
    return rect[0] <= x < rect[2] and rect[1] <= y < rect[3]


def _draw_rectangle(rect: Rect, color: Sequence[float]) -> None:
    """Draw a filled rectangle."""
    import gpu
    from gpu_extras.batch import batch_for_shader

    x0, y0, x1, y1 = rect
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    batch = batch_for_shader(shader, "TRI_STRIP", {"pos": ((x0, y0), (x1, y0), (x0, y1), (x1, y1))})
    shader.bind()
    shader.uniform_float("color", color)
    batch.draw(shader)


def _draw_text(text: str, x: float, y: float, color: Sequence[float], box: Box) -> None:
    """Draw text on the baseline of the row with lower edge `y`, clipped at the box's right edge."""
    import blf

    blf.size(0, box.size)
    blf.color(0, *color)
    blf.enable(0, blf.CLIPPING)
    blf.clipping(0, box.box[0], box.box[1], box.box[2] - 2, box.box[3])
    blf.position(0, x, y + 0.5 * box.size, 0)
    blf.draw(0, text)
    blf.disable(0, blf.CLIPPING)
