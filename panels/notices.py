"""Notices: what went wrong, with its fixes as buttons, in the panel that it belongs to, else in a pop-up."""

from __future__ import annotations

import textwrap

import bpy

from .wrapping import wrap_text

TASKS = {  # feature -> the task below whose switch its notices are shown; a step of that name shows its own
    "library": "LIBRARY", "library_labels": "LIBRARY", "clips": "LIBRARY", "match": "MATCH", "path_editing": "PATH",
    "ball": "BALL", "passes": "BALL", "throws": "BALL", "markers": "MARKERS", "stream": "MARKERS",
    "player": "", "track": "", "timeline": "", "timeline_labels": "", "annotate": "", "synthesis": "", "result": "",
    "rigs": "",
}
POPUP_WIDTH, POPUP_LETTERS = 21, 70  # the pop-up's width in units of the interface, and letters in a line of it
SWITCH_HEIGHT = 60  # pixels of the switch above a task's notices, at a scale of 1

_drawn: set[int] = set()  # numbers of the notices that a panel has drawn where they can be seen


class BEYOND_MOCAP_PT_notices(bpy.types.Panel):
    """The pop-up after a failure that no panel shows: what is wrong, what to do, and buttons that do it."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "HEADER"
    bl_label = "Beyond Mocap"
    bl_options = {"INSTANCED"}
    bl_ui_units_x = POPUP_WIDTH

    @classmethod
    def poll(cls, context):
        """Return whether there is a notice of the last failure that no panel has drawn."""
        group = context.window_manager.beyond_mocap_notices
        return any(row.number >= group.shown and row.number not in _drawn for row in group.rows)

    def draw(self, context):
        """Draw the notices of the last failure."""
        group = context.window_manager.beyond_mocap_notices
        for row in group.rows:
            if row.number >= group.shown:
                self.layout.label(text=row.name)
                draw_notice(self.layout.column(), row, lambda text: textwrap.wrap(text, POPUP_LETTERS))


def draw_notices(layout, context, rooms: tuple[str, ...], is_in_view: bool = True) -> None:
    """Draw the notices of some features in boxes; nothing where there are none.

    Args:
        layout: the layout to draw into.
        context: Blender's context.
        rooms: names of operators' modules.
        is_in_view: whether they can be seen: Blender draws what is scrolled out of view too.
    """
    for row in context.window_manager.beyond_mocap_notices.rows:
        if row.room in rooms and row.scene == str(context.scene.session_uid):
            if is_in_view:
                _drawn.add(row.number)
            draw_notice(layout.box().column(), row, wrap_text)


def draw_task_notices(layout, context) -> None:
    """Draw the notices of the task that is chosen, below the switch: those that no step shows.

    Args:
        layout: the layout to draw into.
        context: Blender's context.
    """
    task = context.scene.beyond_mocap.task
    rows = context.window_manager.beyond_mocap_notices.rows
    rooms = {row.room for row in rows if TASKS.get(row.room, task) == task}
    if rooms:
        draw_notices(layout, context, tuple(rooms), is_in_view=_is_top_in_view(context))


def _is_top_in_view(context) -> bool:
    """Return whether the tab is not scrolled further down than the switch is high."""
    _, top = context.region.view2d.region_to_view(0, context.region.height)
    return top > -SWITCH_HEIGHT * context.preferences.system.ui_scale


def draw_notice(column, row, wrap) -> None:
    """Draw what is wrong, fainter what to do about it, then a button for each fix.

    Args:
        column: the layout to draw into.
        row: the notice.
        wrap: splits a text into lines that fit.
    """
    _draw_lines(column, wrap(row.found), "ERROR" if row.is_error else "INFO")
    if row.step:
        column.separator(factor=0.4)
        _draw_lines(column, wrap(row.step[0].upper() + row.step[1:]), "BLANK1")
    column.separator(factor=0.4)
    buttons = column.column(align=True)
    for index, fix in enumerate(row.fixes):
        button = buttons.operator("beyond_mocap.apply_fix", text=fix.name, icon=fix.icon)
        button.notice, button.index = row.number, index
    last = column.row(align=True)
    if row.operator:
        last.operator("beyond_mocap.try_again", text="Try Again", icon="FILE_REFRESH").notice = row.number
    last.operator("beyond_mocap.dismiss_notice", text="Dismiss", icon="X").notice = row.number


def _draw_lines(column, lines, icon: str) -> None:
    """Draw lines closely below each other; an icon precedes the first."""
    text = column.column(align=True)
    text.scale_y = 0.8
    for number, line in enumerate(lines):
        text.label(text=line, icon="BLANK1" if number else icon)
