"""Live Stream: the part of Ball & Passes in which a user's own motion arrives while it is made."""

from __future__ import annotations

from .tab import paragraph, table

ICONS = {"receiving": "CHECKMARK", "waiting": "SORTTIME", "stopped": "BLANK1"}


def stream(layout, context) -> None:
    """Where to listen, how it does, and the last strike."""
    settings, told = context.scene.beyond_mocap_stream, context.window_manager.beyond_mocap_streaming
    column = layout.column()
    column.use_property_split, column.use_property_decorate = True, False
    chosen = column.column()
    chosen.enabled = not told.on
    for name in ("protocol", "port", "clip", "unit", "part", "side", "threshold"):
        chosen.prop(settings, name)
    column.prop(settings, "body")
    row = layout.row(align=True)
    row.operator("beyond_mocap.stream_start", icon="PLAY")
    row.operator("beyond_mocap.stream_stop", icon="SNAP_FACE")
    if told.line:
        paragraph(layout, told.line, ICONS.get(told.state, "ERROR"))
    if not told.on:
        return
    table(layout, told.figures.splitlines())
    if told.hit:
        layout.label(text=f"Last strike: {told.hit}", icon="KEYTYPE_EXTREME_VEC")
    layout.operator("beyond_mocap.stream_keep", icon="REC")


def live(panel, layout, context) -> None:
    """Who has the ball, and to whom it goes."""
    settings, told = context.scene.beyond_mocap_stream, context.window_manager.beyond_mocap_streaming
    column = layout.column()
    column.use_property_split, column.use_property_decorate = True, False
    column.prop_search(settings, "target", context.scene.beyond_mocap_passes, "players")
    column.prop(settings, "bounces")
    row = layout.row(align=True)
    row.operator("beyond_mocap.stream_play", icon="OUTLINER_OB_ARMATURE")
    row.operator("beyond_mocap.stream_end", icon="SNAP_FACE")
    layout.operator("beyond_mocap.stream_act", icon="ARMATURE_DATA")
    panel.progress(context, "live")
    for line in told.played.splitlines():
        paragraph(layout, line, "BLANK1")
