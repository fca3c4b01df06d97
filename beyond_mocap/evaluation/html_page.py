"""Pages for a browser, in one file that loads nothing: style, elements, tables and pictures of every report.

    build_page("Walk", element("h1", "Walk"), build_section("Speed", build_image(png, "speed over time")))

Text is escaped wherever it is put in; only `Html`, which these functions return, is taken as it is.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Iterable, Sequence
from html import escape

_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #222; background: #fff; max-width: 1120px; margin: 1.5em auto;
  padding: 0 1em }
h1 { font-size: 1.5em; margin-bottom: 0; overflow-wrap: anywhere } h2 { font-size: 1.15em; margin: 1.6em 0 .4em }
h3 { font-size: 1em; margin: 1em 0 .2em } p { margin: .3em 0; overflow-wrap: anywhere }
img, svg { max-width: 100%; height: auto; display: block } svg { font: 12px system-ui, sans-serif }
table { border-collapse: collapse; font-size: 14px } tr { border-bottom: 1px solid #eee } .scroll { overflow-x: auto }
th, td { padding: .18em .9em .18em 0; text-align: left; vertical-align: top }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap }
td.name { overflow-wrap: anywhere; min-width: 9em; max-width: 22em }
.quiet { color: #666; font-weight: normal } .met { color: #23703a } .missed { color: #b3261e; font-weight: 600 }
"""
_WITHOUT_END = frozenset({"img", "br", "input", "td", "th"})  # void, or closed by what follows


class Html(str):
    """Text that is HTML already. Joined or formatted it is plain text again, so it is escaped rather than trusted."""


def element(name: str, /, *content: str, **attributes: object) -> Html:
    """Builds an element.

    Args:
        name: of the element, such as "p".
        content: what stands in it, in order; text is escaped, Html is not.
        attributes: `class_` stands for class, an underscore for a hyphen; True has no value; None, False and "" are
            left out.
    """
    begin = name + "".join(_format_attribute(key, value) for key, value in attributes.items())
    return Html(f"<{begin}>{fragment(*content)}" + ("" if name in _WITHOUT_END else f"</{name}>"))


def fragment(*content: str, between: str = "") -> Html:
    """Puts text, which is escaped, and Html one behind another."""
    return Html(between.join(part if isinstance(part, Html) else escape(str(part)) for part in content))


def _format_attribute(key: str, value: object) -> str:
    if value is None or value is False or value == "":
        return ""
    key = key.rstrip("_").replace("_", "-")
    if value is True:
        return f" {key}"
    return f" {key}={value}" if str(value).isalnum() and str(value).isascii() else f' {key}="{escape(str(value))}"'


def build_page(title: str, *parts: str, style: str = "") -> str:
    """Builds the whole document. parts: of the body, empty ones are left out; style: CSS that goes before the shared
    one."""
    head = fragment(
        Html('<meta charset="utf-8"><meta name="viewport" content="width=device-width">'), element("title", title),
        element("style", Html(_STYLE + style)),
    )  # fmt: skip
    body = fragment(*(part for part in parts if part), between="\n")
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head>\n<body>\n{body}\n</body></html>\n'


def build_section(title: str, *parts: str) -> Html:
    """Builds a titled part of the page."""
    return fragment(element("h2", title), *parts, between="\n")


def build_list(lines: Iterable[str]) -> Html:
    """Builds a list with a point for each line; nothing for no lines."""
    points = [element("li", line) for line in lines]
    return element("ul", *points) if points else Html()


def build_table(head: Sequence[str], rows: Iterable[Html], **attributes: object) -> Html:
    """Builds a table that scrolls where it is too wide. head: titles, () for none; rows: of `build_row`."""
    cells = [title if isinstance(title, Html) else element("th", title) for title in head]
    lines = ([element("tr", *cells)] if cells else []) + list(rows)
    return element("div", element("table", fragment(*lines, between="\n"), **attributes), class_="scroll")


def build_row(*cells: str, class_: str = "") -> Html:
    """Builds a row of a table; text becomes a cell, Html has to be one."""
    return element("tr", *(cell if isinstance(cell, Html) else element("td", cell) for cell in cells), class_=class_)


def build_number_cell(value: float | None, digits: int = 0, scale: float = 1.0, status: str = "") -> Html:
    """Builds a cell with scale x value, a dash where it is unknown. status: "met", "missed" or ""."""
    if value is None or not math.isfinite(value):
        return element("td", "–", class_="n")
    return element("td", f"{scale * value:.{digits}f}", class_=f"n {status}".strip())


def build_title(title: str, note: str = "", class_: str = "n") -> Html:
    """Builds the title of a column, by default of numbers, with a note, such as the unit, below."""
    below = (element("br"), element("span", note, class_="quiet")) if note else ()
    return element("th", title, *below, class_=class_)


def build_image(png: bytes, text: str, class_: str = "") -> Html:
    """Builds a picture that is inside the page. text: what is seen in it."""
    return element("img", class_=class_, alt=text, src=build_data_address(png, "image/png"))


def build_data_address(data: bytes, kind: str) -> str:
    """Builds the address that holds the data itself. kind: its media type, such as "image/png"."""
    return f"data:{kind};base64,{base64.b64encode(data).decode('ascii')}"
