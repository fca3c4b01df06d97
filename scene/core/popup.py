"""The menu of words as it is drawn at the pointer while annotating: rows of digit, word, and the nearest that the
library has instead; laid out within the editor, in several columns where it is low.

Everything is in pixels of the region, from its lower left corner. `laid_out` needs no window.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import bpy

from ...beyond_mocap.annotation.annotating import State
from ...beyond_mocap.annotation.decision import can_skip, instead_of, served

Rect = tuple[float, float, float, float]

_ROW, _EDGE, _GAP = 1.65, 0.7, 0.8  # of the letters' size: height of a row, edge of the box, between columns
_OFF_POINTER = 1.2
_ARROW = "\u2192"


@dataclass(frozen=True)
class Row:
    """One option. key: what to press. note: what the library has instead. word: for the mouse. faint: the library
    cannot serve it. chosen: it is among the words already."""

    key: str
    text: str
    note: str = ""
    word: str = ""
    faint: bool = False
    chosen: bool = False


@dataclass(frozen=True)
class Content:
    """What stands in the menu: a line above (who, which words, when), the options, hints below."""

    head: str
    rows: tuple[Row, ...]
    foot: tuple[str, ...]


@dataclass(frozen=True)
class Box:
    """The menu in place. box, and for each row its place; columns: x of key, text and note in each; size: of the
    letters in pixels."""

    content: Content
    box: Rect
    rows: tuple[Rect, ...]
    head: tuple[float, float]
    foot: tuple[tuple[float, float], ...]
    offsets: tuple[float, float]
    size: float

    def word_at(self, x: float, y: float) -> str | None:
        """The word of the row at this place; "" elsewhere in the box, None outside."""
        for row, rect in zip(self.content.rows, self.rows):
            if _inside(rect, x, y):
                return row.word
        return "" if _inside(self.box, x, y) else None


def content(state: State, who: str, told: str = "", folded: bool = False) -> Content:
    """What the menu says in a state. told: what was done last; folded: no list before a first word is chosen."""
    rows = tuple(Row(str(option.digit), option.word, f"{_ARROW} {' '.join(option.instead)}" if option.instead else "",
                     word=option.word, faint=not option.served, chosen=option.chosen)
                 for option in state.shown)
    more = [f"= more ({state.page + 1}/{state.pages})"] if state.pages > 1 else []
    if not state.trail:
        begun = [f"in {state.start:.2f} s, O: out"] if state.start is not None else ["I in  O out"]
        hints = "   ".join([*begun, *more, "Esc leave"])
        shown = () if folded else rows
        return Content(f"{who}: key moment at the playhead", shown, (hints, told) if told else (hints,))
    walk = state.walk
    when = f"{state.time:.2f} s" if walk.kind == "moment" else f"{state.start:.2f} to {state.end:.2f} s"
    head = f"{who}: {' '.join(walk.words) or '...'}   {when}"
    skip = ["0 any"] if can_skip(walk) else []
    hints = ["   ".join([*skip, *more, "Enter done", "Backspace back"])]
    if walk.words and not served(walk, state.held):
        near = " ".join(instead_of(walk.words, walk.kind, state.held))
        hints.insert(0, "not in the library" + (f" {_ARROW} {near}" if near else ""))
    return Content(head, rows, tuple(hints))


def laid_out(content: Content, at: tuple[float, float] | None, free: Rect, size: float,
             width_of: Callable[[str], float]) -> Box:
    """The menu with its upper left corner by the pointer `at` (None: in the lower left corner of `free`), moved to lie
    within `free`. size: of the letters; width_of: pixels that a text takes."""
    row, edge, gap = round(_ROW * size), round(_EDGE * size), round(_GAP * size)
    key = max((width_of(one.key) for one in content.rows), default=0.0) + gap
    text = max((width_of(one.text) for one in content.rows), default=0.0) + gap
    note = max((width_of(one.note) for one in content.rows), default=0.0)
    lines = 1 + len(content.foot)
    per_column = max(1, int((free[3] - free[1] - 2 * edge) / row) - lines)
    columns = max(1, -(-len(content.rows) // per_column))
    tallest = -(-len(content.rows) // columns) if content.rows else 0
    column = math.ceil(key + text + note + (gap if columns > 1 else 0.0))
    wide = math.ceil(max([columns * column, width_of(content.head), *map(width_of, content.foot)])) + 2 * edge
    tall = (tallest + lines) * row + 2 * edge
    left, top = map(round, _corner(at, free, wide, tall, _OFF_POINTER * size))
    first = top - edge - row
    rects = []
    for number in range(len(content.rows)):
        x, y = left + edge + (number // tallest) * column, first - (number % tallest + 1) * row
        rects.append((x, y, x + (column if columns > 1 else wide - 2 * edge), y + row))
    feet = [(left + edge, first - (tallest + number + 1) * row) for number in range(len(content.foot))]
    box = (left, top - tall, left + wide, top)
    return Box(content, box, tuple(rects), head=(left + edge, first), foot=tuple(feet), offsets=(key, key + text),
               size=size)


def letters() -> float:
    """Pixels of the interface's letters."""
    preferences = bpy.context.preferences
    return preferences.ui_styles[0].widget.points * preferences.system.ui_scale


def width_of(text: str) -> float:
    """Pixels that a text takes in the interface's letters."""
    import blf

    blf.size(0, letters())
    return blf.dimensions(0, text)[0]


def draw(box: Box, hovered: str = "") -> None:
    """Draw the menu into the region that is drawn just now; hovered: the word under the mouse."""
    import gpu

    theme = bpy.context.preferences.themes[0].user_interface
    back, item = theme.wcol_menu_back, theme.wcol_menu_item
    gpu.state.blend_set("ALPHA")
    _fill(box.box, (*back.inner[:3], max(back.inner[3], 0.92)))
    for row, rect in zip(box.content.rows, box.rows):
        if row.word and (row.word == hovered or row.chosen):
            _fill(rect, tuple(item.inner_sel) if row.word == hovered else (*item.inner_sel[:3], 0.45))
    plain, bright = (*item.text, 1.0), (*item.text_sel, 1.0)
    _write(box.content.head, *box.head, bright, box)
    for row, rect in zip(box.content.rows, box.rows):
        faint = (*item.text, 0.45)
        _write(row.key, rect[0], rect[1], faint if row.faint else bright, box)
        _write(row.text, rect[0] + box.offsets[0], rect[1], faint if row.faint else plain, box)
        _write(row.note, rect[0] + box.offsets[1], rect[1], (*item.text, 0.6), box)
    for line, place in zip(box.content.foot, box.foot):
        _write(line, *place, (*item.text, 0.7), box)
    gpu.state.blend_set("NONE")


def _corner(at, free: Rect, wide: float, tall: float, away: float) -> tuple[float, float]:
    """Left and top of the box."""
    left, top = (free[0], free[1] + tall) if at is None else (at[0] + away, at[1] - away)
    if at is not None and left + wide > free[2] and at[0] - away - wide >= free[0]:
        left = at[0] - away - wide
    return max(free[0], min(left, free[2] - wide)), min(free[3], max(top, free[1] + tall))


def _inside(rect: Rect, x: float, y: float) -> bool:
    return rect[0] <= x < rect[2] and rect[1] <= y < rect[3]


def _fill(rect: Rect, color: Sequence[float]) -> None:
    import gpu
    from gpu_extras.batch import batch_for_shader

    x0, y0, x1, y1 = rect
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    batch = batch_for_shader(shader, "TRI_STRIP", {"pos": ((x0, y0), (x1, y0), (x0, y1), (x1, y1))})
    shader.bind()
    shader.uniform_float("color", color)
    batch.draw(shader)


def _write(text: str, x: float, y: float, color: Sequence[float], box: Box) -> None:
    """Text on the base line of the row whose lower edge is `y`, cut off at the box's right edge."""
    import blf

    blf.size(0, box.size)
    blf.color(0, *color)
    blf.enable(0, blf.CLIPPING)
    blf.clipping(0, box.box[0], box.box[1], box.box[2] - 2, box.box[3])
    blf.position(0, x, y + 0.5 * box.size, 0)
    blf.draw(0, text)
    blf.disable(0, blf.CLIPPING)
