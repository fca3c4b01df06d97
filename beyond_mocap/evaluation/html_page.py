"""HTML pages in one file that loads nothing: style, elements, tables and pictures of every report.

    build_page("Walk", build_element("h1", "Walk"), build_section("Speed", build_image(png, "speed over time")))

All text is escaped; only `Html`, which these functions return, is inserted unchanged.
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
_WITHOUT_END = frozenset({"img", "br", "input", "td", "th"})  # void elements, or closed by the next one


class Html(str):
    """Text that is HTML already.

    Joined or formatted it becomes plain text again, so it is escaped rather than trusted.
    """


def build_element(name: str, /, *content: str, **attributes: object) -> Html:
    """Build an element.

    Args:
        name: name of the element, such as "p".
        content: its content in order; text is escaped, Html is not.
        attributes: `class_` stands for class, an underscore for a hyphen; True gives an attribute without a value;
            None, False and "" are left out.
    Returns:
        The element.
    """
    begin = name + "".join(_format_attribute(key, value) for key, value in attributes.items())
    return Html(f"<{begin}>{join_html(*content)}" + ("" if name in _WITHOUT_END else f"</{name}>"))


def join_html(*content: str, separator: str = "") -> Html:
    """Join text, which is escaped, and Html.

    Args:
        content: the parts in order.
        separator: text between the parts.
    Returns:
        The joined HTML.
    """
    return Html(separator.join(part if isinstance(part, Html) else escape(str(part)) for part in content))


def _format_attribute(key: str, value: object) -> str:
    if value is None or value is False or value == "":
        return ""
    key = key.rstrip("_").replace("_", "-")
    if value is True:
        return f" {key}"
    return f" {key}={value}" if str(value).isalnum() and str(value).isascii() else f' {key}="{escape(str(value))}"'


def build_page(title: str, *parts: str, style: str = "") -> str:
    """Build the whole document.

    Args:
        title: title of the page.
        parts: parts of the body; empty ones are left out.
        style: CSS in addition to the shared style.
    Returns:
        The document as text.
    """
    head = join_html(
        Html('<meta charset="utf-8"><meta name="viewport" content="width=device-width">'),
        build_element("title", title), build_element("style", Html(_STYLE + style)),
    )  # fmt: skip
    body = join_html(*(part for part in parts if part), separator="\n")
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head>\n<body>\n{body}\n</body></html>\n'


def build_section(title: str, *parts: str) -> Html:
    """Build a part of the page with a heading.

    Args:
        title: the heading.
        parts: its content.
    Returns:
        The section.
    """
    return join_html(build_element("h2", title), *parts, separator="\n")


def build_list(lines: Iterable[str]) -> Html:
    """Build a list with one item for each line; empty without lines.

    Args:
        lines: the items.
    Returns:
        The list.
    """
    items = [build_element("li", line) for line in lines]
    return build_element("ul", *items) if items else Html()


def build_table(head: Sequence[str], rows: Iterable[Html], **attributes: object) -> Html:
    """Build a table that scrolls if it is too wide.

    Args:
        head: titles of the columns; () for none.
        rows: from `build_row`.
        attributes: attributes of the table element.
    Returns:
        The table.
    """
    cells = [title if isinstance(title, Html) else build_element("th", title) for title in head]
    lines = ([build_element("tr", *cells)] if cells else []) + list(rows)
    return build_element("div", build_element("table", join_html(*lines, separator="\n"), **attributes),
                         class_="scroll")


def build_row(*cells: str, class_: str = "") -> Html:
    """Build a row of a table.

    Args:
        cells: text becomes a cell; Html has to be one.
        class_: CSS class of the row.
    Returns:
        The row.
    """
    return build_element("tr", *(cell if isinstance(cell, Html) else build_element("td", cell) for cell in cells),
                         class_=class_)


def build_number_cell(value: float | None, digits: int = 0, scale: float = 1.0, status: str = "") -> Html:
    """Build a cell with a number, a dash if it is unknown.

    Args:
        value: the number; None or NaN if unknown.
        digits: decimals.
        scale: factor of the displayed number.
        status: "met", "missed" or "".
    Returns:
        The cell.
    """
    if value is None or not math.isfinite(value):
        return build_element("td", "–", class_="n")
    return build_element("td", f"{scale * value:.{digits}f}", class_=f"n {status}".strip())


def build_title(title: str, note: str = "", class_: str = "n") -> Html:
    """Build the title of a column, by default of numbers.

    Args:
        title: the title.
        note: text below it, such as the unit.
        class_: CSS class.
    Returns:
        The cell.
    """
    below = (build_element("br"), build_element("span", note, class_="quiet")) if note else ()
    return build_element("th", title, *below, class_=class_)


def build_image(png: bytes, text: str, class_: str = "") -> Html:
    """Build a picture that is stored inside the page.

    Args:
        png: the picture.
        text: description of its content.
        class_: CSS class.
    Returns:
        The image element.
    """
    return build_element("img", class_=class_, alt=text, src=build_data_url(png, "image/png"))


def build_data_url(data: bytes, kind: str) -> str:
    """Build the data URL of a file.

    Args:
        data: the file's content.
        kind: its media type, such as "image/png".
    Returns:
        The URL.
    """
    return f"data:{kind};base64,{base64.b64encode(data).decode('ascii')}"
