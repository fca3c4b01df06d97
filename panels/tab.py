"""Layout functions shared by all panels of the "Beyond Mocap" tab."""

from __future__ import annotations

import textwrap

import bpy

LETTER = 5.7  # mean width of an interface letter in pixels, at a scale of 1
MARKS = {"met": "CHECKMARK", "missed": "ERROR", "": "BLANK1"}
EDGES = 70  # pixels of a sidebar without text: tabs, the box and its icon


def table(layout, lines) -> None:
    """Draw lines "name: value" in two columns; a line without a colon fills the width."""
    column = layout.column(align=True)
    column.scale_y = 0.85
    for line in lines:
        name, colon, value = line.partition(": ")
        if not colon:
            column.label(text=line)
            continue
        row = column.split(factor=0.62)
        row.label(text=name)
        row.label(text=value)


def paragraph(layout, text: str, icon: str) -> None:
    """Draw text over as many lines as the sidebar's width needs, because labels are cut; an icon precedes the first."""
    column = layout.column(align=True)
    column.scale_y = 0.85
    for number, line in enumerate(wrapped(text)):
        column.label(text=line, icon="BLANK1" if number else icon)


def figures(layout, text: str) -> None:
    """Draw lines "name: value" with target and status separated by tabs; an icon shows whether the target is met."""
    column = layout.column(align=True)
    column.scale_y = 0.85
    for line in text.splitlines():
        told, target, status = (*line.split("\t"), "", "")[:3]
        name, _, value = told.partition(": ")
        row = column.split(factor=0.54)
        row.label(text=name, icon=MARKS.get(status, "BLANK1"))
        right = row.split(factor=0.54)
        right.label(text=value)
        aim = right.row()
        aim.active = False
        aim.label(text=target)


def wrapped(text: str) -> list[str]:
    """Wrap text to the sidebar's width."""
    width = bpy.context.region.width / bpy.context.preferences.system.ui_scale
    return textwrap.wrap(text, max(16, int((width - EDGES) / LETTER)))


def part(layout, name: str, title: str, closed: bool = True, icon: str = "NONE"):
    """Draw the header of a collapsible part.

    Args:
        layout: the layout to draw into.
        name: identifier, unique among all panels.
        title: the header's text.
        closed: whether it is closed at first.
        icon: Blender's icon name.
    Returns:
        The layout of its body; None while it is closed.
    """
    header, body = layout.panel(f"beyond_mocap_{name}", default_closed=closed)
    header.label(text=title, icon=icon)
    return body


def section(layout, name: str, title: str, draw, closed: bool = True) -> None:
    """Draw a collapsible part with the function `draw` while it is open."""
    if body := part(layout, name, title, closed):
        draw(body)


def split(layout):
    """Create a column of named values."""
    column = layout.column()
    column.use_property_split, column.use_property_decorate = True, False
    return column


class Step:
    """A collapsible panel in the 3D view's sidebar; the panels are ordered by `bl_order`."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Beyond Mocap"

    def progress(self, context, kind: str) -> None:
        """Draw a progress bar and a Cancel button while work of this kind runs in the background."""
        running = context.window_manager.beyond_mocap_work
        if running.kind == kind:
            row = self.layout.row(align=True)
            row.progress(factor=running.fraction, text=running.text)
            row.operator("beyond_mocap.cancel", text="", icon="X")
