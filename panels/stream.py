"""Live streams: motion that a user performs is received, and answered by a passing scene."""

from __future__ import annotations

import bpy

from .tab import TabPanel, create_value_column, draw_paragraph, draw_section, draw_table, draw_values, with_progress

STREAM_ICONS = {"receiving": "CHECKMARK", "waiting": "SORTTIME", "stopped": "BLANK1"}


class BEYOND_MOCAP_PT_stream(TabPanel, bpy.types.Panel):
    """A motion that is received live, and players who answer it."""

    bl_label = "Live Stream"
    task = "MARKERS"
    bl_order = 12
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """Draw the stream; playing live is closed at first."""
        draw_stream(self.layout, context)
        draw_section(self.layout, "ball_live", "Play Live", lambda opened: draw_play_live(opened, context))


def draw_stream(layout, context) -> None:
    """Draw the settings of the stream, its status, and the last strike."""
    settings, status = context.scene.beyond_mocap_stream, context.window_manager.beyond_mocap_streaming
    column = create_value_column(layout)
    chosen = column.column()
    chosen.enabled = not status.on
    draw_values(chosen, settings, ("protocol", "port", "clip", "unit", "part", "side", "threshold"),
                {"unit": 1.0, "threshold": 0.2})
    column.prop(settings, "body")
    row = layout.row(align=True)
    row.operator("beyond_mocap.stream_start", icon="PLAY")
    row.operator("beyond_mocap.stream_stop", icon="SNAP_FACE")
    if status.line:
        draw_paragraph(layout, status.line, STREAM_ICONS.get(status.state, "ERROR"))
    if not status.on:
        return
    draw_table(layout, status.figures.splitlines())
    if status.hit:
        layout.label(text=f"Last strike: {status.hit}", icon="KEYTYPE_EXTREME_VEC")
    layout.operator("beyond_mocap.stream_keep", icon="REC")


def draw_play_live(layout, context) -> None:
    """Draw the settings of Play Live and the state of the rally."""
    settings, status = context.scene.beyond_mocap_stream, context.window_manager.beyond_mocap_streaming
    column = create_value_column(layout)
    column.prop_search(settings, "target", context.scene.beyond_mocap_passes, "players")
    column.prop(settings, "bounces")
    with_progress(layout, context, ("live",), draw_play_buttons)
    layout.operator("beyond_mocap.stream_act", icon="ARMATURE_DATA")
    for line in status.played.splitlines():
        draw_paragraph(layout, line, "BLANK1")


def draw_play_buttons(row) -> None:
    """Draw the buttons that begin and end a rally."""
    row.operator("beyond_mocap.stream_play", icon="OUTLINER_OB_ARMATURE")
    row.operator("beyond_mocap.stream_end", icon="SNAP_FACE")
