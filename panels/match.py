"""Panel "Match": a whole match from a provider's files, all players together."""

from __future__ import annotations

import bpy

from .characters import draw_team_characters
from .tab import TabPanel, create_value_column, draw_paragraph, draw_section, draw_values, with_progress

MAX_LINES = 12  # lines of a report shown in the panel
TEAM_ICONS = {"home": "EVENT_H", "away": "EVENT_A", "referee": "EVENT_R"}


class BEYOND_MOCAP_UL_match(bpy.types.UIList):
    """Players of the match, with team and number, and a checkbox to include them."""

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property):
        row = layout.row(align=True)
        row.prop(item, "use", text="")
        row.label(text="", icon=TEAM_ICONS[item.team])
        number = row.row()
        number.ui_units_x = 1.4
        number.label(text=str(item.number) if item.number >= 0 else "")
        row.label(text=item.name or item.feed_id)


class BEYOND_MOCAP_PT_match(TabPanel, bpy.types.Panel):
    """Files, players, time and result of a match."""

    bl_label = "Match"
    task = "MATCH"
    bl_order = 10

    def draw(self, context):
        """Draw files, list, time and buttons."""
        layout, match = self.layout, context.scene.beyond_mocap_match
        column = create_value_column(layout)
        column.prop(match, "tracking_file")
        draw_section(layout, "match_files", "More Files", lambda opened: draw_more_files(opened, match))
        with_progress(layout, context, ("match file",), lambda row: row.operator("beyond_mocap.read_match",
                      icon="FILE_REFRESH"))
        if not match.tracking_file:
            draw_paragraph(layout, "Choose a provider's tracking file, or drop it into the view", "INFO")
        if match.players:
            draw_players(layout, match)
        if match.report:
            draw_section(layout, "match_data", "Data", lambda opened: draw_messages(opened, match.report))
        draw_team_characters(layout, match)
        draw_values(create_value_column(layout), match, ("start", "end", "folder"),
                    {"end": match.start + 30.0, "folder": "Automatic"})
        with_progress(layout, context, ("match",), draw_buttons)
        if match.players and not context.scene.beyond_mocap.library_folder:
            draw_paragraph(layout, "Choose the library's folder in the step Library first", "INFO")
        draw_section(layout, "match_work", "Processing", lambda opened: draw_processing(opened, context.scene))
        if match.shown:
            draw_display(layout, match)


def draw_more_files(layout, match) -> None:
    """Draw the files that are not found from the tracking file's name."""
    column = create_value_column(layout)
    for name in ("metadata_file", "provider", "joints_file", "events_file"):
        column.prop(match, name)
    column.prop(match.id_data.beyond_mocap_stage, "sport")
    if match.events_file:
        for name in ("events_metadata_file", "events_provider"):
            column.prop(match, name)


def draw_players(layout, match) -> None:
    """Draw the list, buttons to select many players, and the teams' colours."""
    layout.template_list("BEYOND_MOCAP_UL_match", "", match, "players", match, active_propname="active", rows=5)
    layout.operator_menu_enum("beyond_mocap.tick_match", "whom", icon="CHECKBOX_HLT")
    draw_section(layout, "match_colours", "Colours", lambda opened: draw_colours(opened, match))


def draw_colours(layout, match) -> None:
    """Draw the colours of the teams' shirts."""
    column = create_value_column(layout)
    for team in ("home", "away", "referee"):
        column.prop(match, f"{team}_colour")


def draw_buttons(row) -> None:
    """Draw the buttons that make and show a match."""
    row.operator("beyond_mocap.make_match", icon="PLAY")
    row.operator("beyond_mocap.show_match", icon="HIDE_OFF")


def draw_messages(layout, lines: str) -> None:
    """Draw messages about detected and corrected data."""
    messages = lines.splitlines()
    for line in messages[:MAX_LINES]:
        draw_paragraph(layout, line, "DOT")
    if len(messages) > MAX_LINES:
        layout.label(text=f"and {len(messages) - MAX_LINES} more")


def draw_processing(layout, scene) -> None:
    """Draw how the work is done."""
    match = scene.beyond_mocap_match
    column = create_value_column(layout)
    draw_values(column, match, ("solve_touches", "strength"))
    column.prop(match, "masses", text="Masses")
    draw_values(column, match, ("fatigue", "workers", "scheduler", "first_frame"),
                {"workers": 2, "scheduler": "This Computer"})
    column.prop(scene.beyond_mocap, "rate")
    column.prop(scene.beyond_mocap, "watch", slider=True)


def draw_display(layout, match) -> None:
    """Draw the quality, the cameras, and messages about the displayed match."""
    if match.quality:
        draw_paragraph(layout, f"Quality: {match.quality}", "INFO")
    row = layout.row(align=True)
    row.operator("beyond_mocap.match_camera", text="Broadcast", icon="VIEW_CAMERA").which = "STAND"
    row.operator("beyond_mocap.match_camera", text="Eyes", icon="HIDE_OFF").which = "EYES"
    layout.operator("beyond_mocap.match_export", icon="EXPORT")
    layout.operator("beyond_mocap.deliver", text="Deliver a File per Player", icon="FILE_FOLDER").who = "MATCH"
    for line in match.messages.splitlines()[:MAX_LINES]:
        draw_paragraph(layout, line, "INFO")
