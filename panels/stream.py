"""Live streams: motion that users perform is received, and answered by a passing scene."""

from __future__ import annotations

import bpy

from ..scene.stream.settings import find_status, get_key, list_streams
from .tab import TabPanel, create_value_column, draw_paragraph, draw_section, draw_table, draw_values, with_progress

STREAM_ICONS = {"receiving": "CHECKMARK", "waiting": "SORTTIME", "stopped": "BLANK1"}


class BEYOND_MOCAP_PT_stream(TabPanel, bpy.types.Panel):
    """Motions that are received live, and players who answer them."""

    bl_label = "Live Stream"
    task = "MARKERS"
    bl_order = 12
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """Draw the streams; playing live is closed at first."""
        draw_streams(self.layout, context)
        draw_section(self.layout, "ball_live", "Play Live", lambda opened: draw_play_live(opened, context))


def draw_streams(layout, context) -> None:
    """Draw the only stream, or a section for each of several, and the button that adds one."""
    streams = list_streams(context.scene)
    if len(streams) == 1:
        draw_stream(layout, streams[0])
    else:
        for stream in streams:
            draw_section(layout, f"stream_{stream.number}", name_stream(stream),
                         lambda opened, stream=stream: draw_stream_of_several(opened, context, stream), closed=False)
    layout.operator("beyond_mocap.stream_list", text="Add Stream", icon="ADD").what = "ADD"


def name_stream(stream) -> str:
    """Name a stream, with its player and its state where there is one."""
    status = find_status(get_key(stream))
    state = status.state if status is not None and status.on else ""
    return ", ".join(text for text in (f"Stream {stream.number}", stream.player, state) if text)


def draw_stream_of_several(layout, context, stream) -> None:
    """Draw one of several streams: whose strikes they are, the rest as of an only one, and the button that removes
    it.
    """
    status = find_status(get_key(stream))
    column = create_value_column(layout)
    column.enabled = status is None or not status.on
    column.prop_search(stream, "player", context.scene.beyond_mocap_passes, "players")
    draw_stream(layout, stream)
    if stream.number > 1:
        button = layout.operator("beyond_mocap.stream_list", text="Remove Stream", icon="REMOVE")
        button.what, button.number = "REMOVE", stream.number


def draw_stream(layout, stream) -> None:
    """Draw the settings of a stream, its status, and the last strike."""
    status = find_status(get_key(stream))
    is_on = status is not None and status.on
    column = create_value_column(layout)
    chosen = column.column()
    chosen.enabled = not is_on
    draw_values(chosen, stream, ("protocol", "port", "clip", "unit", "part", "side", "threshold"),
                {"unit": 1.0, "threshold": 0.2})
    column.prop(stream, "body")
    row = layout.row(align=True)
    draw_verb(row, "start", "PLAY", stream.number, not is_on)
    draw_verb(row, "stop", "SNAP_FACE", stream.number, is_on)
    if status is not None and status.line:
        draw_paragraph(layout, status.line, STREAM_ICONS.get(status.state, "ERROR"))
    if not is_on:
        return
    draw_table(layout, status.figures.splitlines())
    if status.hit:
        layout.label(text=f"Last strike: {status.hit}", icon="KEYTYPE_EXTREME_VEC")
    draw_verb(layout, "keep", "REC", stream.number, True)


def draw_verb(layout, verb: str, icon: str, number: int, enabled: bool) -> None:
    """Draw a button for a stream."""
    own = layout.row(align=True)
    own.enabled = enabled
    own.operator(f"beyond_mocap.stream_{verb}", icon=icon).number = number


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
