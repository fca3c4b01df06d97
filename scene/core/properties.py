"""The settings as properties of Blender's classes."""

from __future__ import annotations

from collections.abc import Callable
from inspect import get_annotations
from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, StringProperty

from ...beyond_mocap.base.settings import list_settings
from ...beyond_mocap.base.settings.setting import Setting, collect_values

_PROPERTY_TYPES = {bool: BoolProperty, int: IntProperty, float: FloatProperty, str: StringProperty,
                   Path: StringProperty, tuple: StringProperty}


def with_settings(*groups: str, **callbacks: Callable) -> Callable[[type], type]:
    """Return a class decorator that adds the properties of groups of settings; callbacks are arguments such as
    `update`.
    """

    def add_properties(cls: type) -> type:
        properties = {row.identifier: build_property(row, **callbacks) for row in _list_panel_settings(groups)}
        cls.__annotations__ = {**get_annotations(cls), **properties}
        return cls

    return add_properties


def build_property(row: Setting, **more):
    """Build a property of bpy from a setting, with further arguments."""
    arguments = {
        "name": row.title, "description": row.tooltip, "default": row.default or None, "min": row.least,
        "max": row.most, "precision": row.precision, "unit": "TIME_ABSOLUTE" if row.unit == "seconds" else None,
        **row.panel_more, **more,
    }  # fmt: skip
    maker = _PROPERTY_TYPES[type(arguments["default"])] if arguments["default"] is not None else _PROPERTY_TYPES[
        row.kind]
    if row.choices:
        maker, arguments["items"] = EnumProperty, row.choices
    elif row.kind is tuple and row.default:
        maker, arguments["size"] = FloatVectorProperty, len(row.default)
    return maker(**{name: value for name, value in arguments.items() if value is not None})


def read_property_values(record: type, properties: bpy.types.PropertyGroup, *groups: str) -> dict[str, object]:
    """Read the values for the fields of a dataclass from properties.

    Args:
        record: the dataclass.
        properties: the property group.
        groups: groups of settings.
    Returns:
        Field name -> value.
    """
    return collect_values(record, _list_panel_settings(groups), lambda row: getattr(properties, row.identifier))


def find_active_row(rows, number: int):
    """Return the active row of a list; None while the list is empty."""
    return rows[number] if 0 <= number < len(rows) else None


def _list_panel_settings(groups: tuple[str, ...]) -> list[Setting]:
    """List the settings of groups that panels show."""
    return [row for group in groups for row in list_settings(group) if row.tooltip]
