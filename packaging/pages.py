"""Write the pages of docs/reference that come from the code: settings, commands, labels, and the tables of providers.

`make tables` in the project's folder writes them all."""

from __future__ import annotations

import re
import sys
from pathlib import Path

TOP = Path(__file__).resolve().parents[1]
REFERENCE = TOP / "docs" / "reference"
SETTINGS_PAGE = REFERENCE / "settings.md"
PROVIDERS_PAGE = REFERENCE / "match-input.md"
COMMANDS_PAGE = REFERENCE / "commands.md"
LABELS_PAGE = REFERENCE / "labels.md"
HEAD = """# Settings

*For all who look up a setting: its name in Blender, its option on the command line, its default and limits. This page
is generated from the table in `beyond_mocap/base/settings` by `make tables`.*

Files and objects that are only read or written are on the pages of [commands](commands.md) and file forms.
"""


def build_settings_page() -> str:
    """Build the settings page.

    Returns:
        The page as text.
    """
    from beyond_mocap.base.settings import FEATURES, TABLES

    parts = [HEAD]
    for feature, module in FEATURES.items():
        parts.append(f"\n## {feature}\n")
        for group in module.TABLES:
            parts.append(f"\nGroup `{group}`:\n\n")
            parts.extend(_format_setting(row) for row in TABLES[group])
    return "".join(parts)


def _format_setting(row) -> str:
    """One setting as a list item: names, meaning, default, limits."""
    option = " ".join(f"`{flag}`" for flag in row.option.split())
    title = f"**{row.title}**, " if row.tooltip else ""
    names = title + f"`{row.name}`" + (f", {option}" if option else "")
    limits = _format_limits(row)
    facts = [_format_meaning(row), f"Default: {_format_default(row)}", limits[:1].upper() + limits[1:]]
    return f"- {names}: {'. '.join(filter(None, facts))}.\n"


def _format_default(row) -> str:
    """Format the default in code, and the panel's if it differs."""
    in_code, in_panel = (_format_value(value) for value in (row.default, row.panel_more.get("default", row.default)))
    return in_code if in_code == in_panel else f"{in_code}; in Blender {in_panel}"


def _format_value(value) -> str:
    """Format a value as users write it."""
    if isinstance(value, bool):
        return "on" if value else "off"
    if value is None or value in ("", ()):
        return "not set"
    if isinstance(value, tuple):
        return ", ".join(map(str, value))
    return f"{value:g}" if isinstance(value, float) else str(value)


def _format_limits(row) -> str:
    """Format the choices or the limits, and those of the option and of the panel if they differ."""
    if row.choices:
        return ", ".join(f"`{name}`" for name in row.choice_names)
    limits, option, panel = (row.least, row.most), row.option_more, row.panel_more
    option_limits = (option.get("least", row.least), option.get("most", row.most))
    panel_limits = (panel.get("min", row.least), panel.get("max", row.most))
    parts = [_format_range(limits), *(f"{place} {_format_range(pair)}" for place,
                                      pair in (("option", option_limits), ("Blender", panel_limits))
                                      if pair not in (limits, (None, None)))]  # fmt: skip
    return "; ".join(filter(None, parts)) + (f" {row.unit}" if row.unit and any(parts) else "")


def _format_range(pair: tuple) -> str:
    least, most = (None if limit is None else _format_value(limit) for limit in pair)
    return "" if least is None else f"{least} or more" if most is None else f"{least} to {most}"


def _format_meaning(row) -> str:
    """Return the tooltip of the panel, else the help of the option."""
    return row.tooltip or re.sub(r"[;(] ?default %\(default\)[gs]\)?", "", row.help or "").strip()


def replace_tables(text: str) -> str:
    """Replace both tables of providers in a page, in the order of their records.

    Args:
        text: the page.
    Returns:
        The new page.
    """
    from beyond_mocap.files.event_providers import EVENT_PROVIDERS
    from beyond_mocap.files.tracking.providers import PROVIDERS

    tables = iter((PROVIDERS, EVENT_PROVIDERS))

    def rows(head):
        return head[1] + "".join(f"| {one.title} | {one.files} |\n" for one in next(tables).values())

    return re.sub(r"(?m)^(\| provider \|.*\n\|-.*\n)(?:\|.*\n)*", rows, text)


def write_pages() -> None:
    """Write all generated pages."""
    from beyond_mocap.annotation.labels import read_labels
    from beyond_mocap.cli.main import build_parser
    from command_pages import build_commands_page, build_labels_page

    SETTINGS_PAGE.write_text(build_settings_page(), "utf-8")
    COMMANDS_PAGE.write_text(build_commands_page(build_parser()), "utf-8")
    LABELS_PAGE.write_text(build_labels_page(read_labels().values()), "utf-8")
    PROVIDERS_PAGE.write_text(replace_tables(PROVIDERS_PAGE.read_text("utf-8")), "utf-8")


if __name__ == "__main__":
    sys.path.insert(0, str(TOP))
    write_pages()
