"""The table of all settings, one row each: command-line options, Blender's properties, presets, limits, defaults and
docs/settings.md are made from it. A new setting is a row here, and the code that uses it.

Files and objects that a command reads or writes, lists, and what a panel only keeps are no settings.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from . import aim, library, markers, match, passes, path_editing, stream, study, synthesis, throws, view
from .setting import Setting

FEATURES = {
    "Synthesis": synthesis, "Library": library, "Path editing": path_editing, "Passes and ball": passes,
    "Aimed ball": aim, "Throws and kicks": throws, "Markers": markers, "Match": match, "Live stream": stream,
    "Study": study, "Overlays": view,
}
TABLES: dict[str, tuple[Setting, ...]] = {
    group: tuple(replace(row, feature=feature) for row in rows)
    for feature, module in FEATURES.items() for group, rows in module.TABLES.items()
}
"""Group -> its settings. A group is what one verb, or one class of properties, takes together."""


def rows_of(group: str) -> tuple[Setting, ...]:
    """The settings of a group."""
    return TABLES[group]


def setting(group: str, name: str) -> Setting:
    """One setting."""
    return next(row for row in TABLES[group] if row.name == name)


def defaults(*groups: str) -> dict[str, Any]:
    """The defaults of groups of settings, by name."""
    return {row.name: row.default for group in groups for row in TABLES[group]}
