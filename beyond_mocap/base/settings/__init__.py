"""The table of all settings, one row each.

Command-line options, Blender's properties, presets, limits, defaults and docs/reference/settings.md are generated from
it. To add a setting, add a row here and the code that uses it. Not settings: files and objects that a command reads or
writes, lists, and values that a panel only stores.
"""

from __future__ import annotations

from typing import Any

from . import aim, library, markers, match, passes, path_editing, stream, study, synthesis, throws, view
from .setting import Setting

FEATURES = {
    "Synthesis": synthesis, "Library": library, "Path editing": path_editing, "Passes and ball": passes,
    "Aimed ball": aim, "Throws and kicks": throws, "Markers": markers, "Match": match, "Live stream": stream,
    "Study": study, "Overlays": view,
}
TABLES: dict[str, tuple[Setting, ...]] = {
    group: tuple(rows) for module in FEATURES.values() for group, rows in module.TABLES.items()
}
"""Group -> its settings. A group is the set of settings that one verb or one property class uses together."""


def list_settings(group: str) -> tuple[Setting, ...]:
    """List the settings of a group.

    Args:
        group: key of `TABLES`.
    Returns:
        The settings in the table's order.
    """
    return TABLES[group]


def find_setting(group: str, name: str) -> Setting:
    """Find one setting.

    Args:
        group: key of `TABLES`.
        name: name of the setting within the group.
    Returns:
        The setting.
    """
    return next(row for row in TABLES[group] if row.name == name)


def collect_defaults(*groups: str) -> dict[str, Any]:
    """Collect the defaults of groups of settings.

    Args:
        groups: keys of `TABLES`.
    Returns:
        Setting name -> default.
    """
    return {row.name: row.default for group in groups for row in TABLES[group]}
