"""Layout functions shared by all panels of the "Beyond Mocap" tab."""

from __future__ import annotations

import bpy

from .notices import draw_notices
from .wrapping import shorten_progress, wrap_text

MARKS = {"met": "CHECKMARK", "missed": "ERROR", "": "BLANK1"}
NAME_SHARE = 0.72  # of the width that the name of a figure takes
LABEL_SHARE = 0.4  # of the width, where Blender splits names and values


def draw_table(layout, lines) -> None:
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


def draw_paragraph(layout, text: str, icon: str) -> None:
    """Draw text over as many lines as the sidebar's width needs, because labels are cut; an icon precedes the first."""
    column = layout.column(align=True)
    column.scale_y = 0.85
    for number, line in enumerate(wrap_text(text)):
        column.label(text=line, icon="BLANK1" if number else icon)


def draw_figures(layout, text: str) -> None:
    """Draw lines "name: value" with target and status separated by tabs: an icon shows whether the target is met, and
    below what misses it stands the target.
    """
    column = layout.column(align=True)
    column.scale_y = 0.85
    for line in text.splitlines():
        name_and_value, target, status = (*line.split("\t"), "", "")[:3]
        name, _, value = name_and_value.partition(": ")
        row = column.split(factor=NAME_SHARE)
        row.label(text=name, icon=MARKS.get(status, "BLANK1"))
        row.label(text=value)
        if status == "missed":
            row = column.split(factor=LABEL_SHARE)
            row.active = False
            row.label(text="Target", icon="BLANK1")
            row.label(text=target)


def draw_header(layout, name: str, title: str, closed: bool = True, icon: str = "NONE"):
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


def draw_section(layout, name: str, title: str, draw, closed: bool = True) -> None:
    """Draw a collapsible part with the function `draw` while it is open."""
    if body := draw_header(layout, name, title, closed):
        draw(body)


def create_value_column(layout):
    """Create a column of named values."""
    column = layout.column()
    column.use_property_split, column.use_property_decorate = True, False
    return column


def draw_automatic(column, owner, name: str, start: float) -> None:
    """Draw a value whose 0 means that it is chosen automatically: as "Automatic", or as a field with a button back.

    Args:
        column: a column of named values.
        owner: the property group.
        name: of its property.
        start: the value with which one of the user's own begins.
    """
    value = getattr(owner, name)
    if value:
        row = column.row(align=True)
        row.prop(owner, name)
        button = row.operator("beyond_mocap.set_automatic", text="", icon="X")
    else:
        row = column.split(factor=LABEL_SHARE)
        label = row.row()
        label.alignment = "RIGHT"
        label.label(text=owner.bl_rna.properties[name].name)
        button = row.operator("beyond_mocap.set_automatic", text="Automatic")
        button.value = start
    button.object = owner.id_data.name if isinstance(owner.id_data, bpy.types.Object) else ""
    button.path = owner.path_from_id(name)


def draw_values(column, owner, names, automatic=None) -> None:
    """Draw values below each other.

    Args:
        column: a column of named values.
        owner: the property group.
        names: of its properties.
        automatic: name -> value to start with, of those whose 0 means automatic; of a text, what it is while empty.
    """
    for name in names:
        if automatic and isinstance(automatic.get(name), str):
            column.prop(owner, name, placeholder=automatic[name])
        elif automatic and name in automatic:
            draw_automatic(column, owner, name, automatic[name])
        else:
            column.prop(owner, name)


def with_progress(layout, context, kinds, draw) -> None:
    """Draw a step's main buttons, or in their place, as high as they are, a bar and Cancel while such work runs.

    Args:
        layout: the layout to draw into.
        context: Blender's context.
        kinds: of the work.
        draw: function that draws the buttons into a row.
    """
    row = layout.row(align=True)
    row.scale_y = 1.3
    running = context.window_manager.beyond_mocap_work
    if running.kind in kinds:
        draw_bar(row, running)
    else:
        draw(row)


def draw_bar(row, running) -> None:
    """Draw a bar with the present step and the time that is left, and Cancel."""
    row.progress(factor=running.fraction, text=shorten_progress(running.text))
    row.operator("beyond_mocap.cancel", text="", icon="X")


class TabPanel:
    """A collapsible panel in the 3D view's sidebar; the panels are ordered by `bl_order`.

    Attributes:
        task: the task that shows the panel, see `TASKS`; "" for every task.
        rooms: names of the operators' modules whose notices the panel shows.
        also: other tasks that show it.
    """

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Beyond Mocap"
    task = ""
    rooms: tuple[str, ...] = ()
    also: tuple[str, ...] = ()

    @classmethod
    def poll(cls, context):
        """Return whether the panel belongs to the task that is chosen at the top of the tab."""
        chosen = context.scene.beyond_mocap.task
        return cls.task in ("", chosen) or chosen in cls.also


class StepPanel(TabPanel):
    """A step of a task: one line once it is done, open while it is next, closed while something before it is missing.

    The line opens what is behind it; Blender remembers that for each of the three states.
    """

    bl_options = {"HIDE_HEADER"}

    def draw(self, context):
        """Draw the step's line, and its content while it is open."""
        state, summary = self.find_state(context)
        header, body = self.layout.panel(f"beyond_mocap_step_{self.bl_order}_{state}", default_closed=state != "next")
        plain = self.bl_label.partition("  ")[2]
        if state == "done":
            header.label(text=f"{plain}: {summary}", icon="CHECKMARK")
        else:  # the number is that of its own task
            header.label(text=self.bl_label if context.scene.beyond_mocap.task == self.task else plain)
        if body:
            self.draw_step(body, context)
        draw_notices(self.layout, context, self.rooms)
