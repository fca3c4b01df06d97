"""Settings as command-line options."""

from __future__ import annotations

import argparse
import contextlib
import math
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from . import list_settings
from .setting import Setting, collect_values


def add_options(parser, group: str, *names: str) -> None:
    """Add the options of a group of settings, in their order.

    Args:
        parser: an argparse parser or argument group.
        group: key of the settings table.
        names: add only these settings; none adds all.
    """
    for row in list_settings(group):
        if row.option and (not names or row.name in names):
            parser.add_argument(*row.option.split(), **_build_arguments(row))


def option_values(record: type, options: argparse.Namespace, *groups: str) -> dict[str, Any]:
    """Collect the values that the command line sets for fields of a dataclass.

    Args:
        record: the dataclass.
        options: the parsed command line.
        groups: keys of the settings table.
    Returns:
        Field name -> value; fields that are not set are left out.
    """
    rows = [row for group in groups for row in list_settings(group) if row.option]
    return collect_values(record, rows, lambda row: getattr(options, row.name))


def name_options(line: str, *groups: str) -> str:
    """Name the options in a message that names settings as Blender's panels do: "use Floor at 0" -> "use --floor".

    Args:
        line: the message.
        groups: keys of the settings table.
    Returns:
        The same with "use TITLE" and "a higher TITLE" as the command line has them.
    """
    rows = [row for group in groups for row in list_settings(group) if row.option]
    for row in sorted(rows, key=lambda one: -len(one.title)):  # a title may begin another one
        option = row.option.split()[0]
        use = "leave out" if row.kind is bool and row.default else "use"
        line = line.replace(f"use {row.title}", f"{use} {option}")
        line = line.replace(f"a higher {row.title}", f"a higher {option}")
    return line


def describe_ignored_options(options: argparse.Namespace, *groups: str) -> list[str]:
    """Describe the options that are set although the chosen method of synthesis does not use them.

    Args:
        options: the parsed command line, with `method`.
        groups: keys of the settings table.
    Returns:
        One line for each of them.
    """
    rows = [row for group in groups for row in list_settings(group) if row.option]
    return [f"{row.option.split()[0]}: the method {options.method} does not use it; ignored; use it with "
            f"{' or '.join(row.methods.split())}"
            for row in rows if not row.is_used_by(options.method)
            and getattr(options, row.name) != _build_arguments(row)["default"]]


def _build_arguments(row: Setting) -> dict:
    """Build the arguments of `add_argument` for a setting."""
    more = {name: value for name, value in row.option_more.items() if name not in ("least", "most")}
    tooltip = row.tooltip[:1].lower() + row.tooltip[1:].replace("%", "%%")
    out = {"dest": row.name, "help": row.help or tooltip or None, "default": [] if row.kind is tuple else row.default}
    if row.kind is bool:
        return {**out, "action": "store_false" if row.default else "store_true", **more}
    if row.choices:
        out["choices"] = row.choice_names
    elif row.kind not in (str, tuple):
        out["type"] = _build_value_parser(row)
    unit = row.unit.upper() if row.unit and " " not in row.unit else None
    return {**out, "metavar": row.metavar or unit, **more}


def parse_path(text: str) -> Path:
    """Parse an option that names a file or a folder; an empty one would mean the current folder.

    Args:
        text: the option's text.
    Returns:
        The path.
    Raises:
        ArgumentTypeError: if the text is empty.
    """
    if not text.strip():
        raise argparse.ArgumentTypeError("no file or folder is named")
    return Path(text)


def _build_value_parser(row: Setting):
    """Build the function that parses an option's text into the setting's value."""
    if row.kind is Path:
        return parse_path
    least, most = (row.option_more.get(name, getattr(row, name)) for name in ("least", "most"))
    if least is None:
        row, least, most = replace(row, expected="a number of {unit}"), -math.inf, math.inf
    return partial(parse_number, row=row, least=least, most=most)


def parse_number(text: str, row: Setting, least: float, most: float) -> float:
    """Parse a number of an option and check its limits.

    Args:
        text: the option's text.
        row: the setting.
        least, most: the limits, both included.
    Returns:
        The number, of the setting's type.
    Raises:
        ArgumentTypeError: if the text is not a number within the limits.
    """
    with contextlib.suppress(ValueError):
        value = row.kind(text)
        if least <= value <= most:
            return value
    raise argparse.ArgumentTypeError(f"{text!r} is not {row.describe_limits(least, most)}")
