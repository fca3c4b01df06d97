"""Aim Ball: the part of Ball & Passes in which a body strikes a ball at a target."""

from __future__ import annotations

from ..scene.aimed.settings import aimed_ball
from .tab import paragraph, table


def aim(layout, context) -> None:
    """The button; of the ball that is meant, who strikes it, towards what and how, and what comes of it."""
    ball = aimed_ball(context)
    layout.operator("beyond_mocap.aim_ball", icon="CON_TRACKTO", text="Aim Again" if ball is not None else "Aim Ball")
    if ball is not None:
        of_ball(layout, ball)
    physics(layout, context, ball)


def of_ball(layout, ball) -> None:
    """An aimed ball's settings and figures."""
    settings = ball.beyond_mocap_aim
    row = layout.row(align=True)
    row.label(text=ball.name, icon="SPHERE")
    row.prop(settings, "live", text="", icon="LINKED" if settings.live else "UNLINKED")
    row.operator("beyond_mocap.leave_aim", text="", icon="X")
    column = layout.column()
    column.use_property_split, column.use_property_decorate = True, False
    column.enabled = not settings.handed
    column.prop(settings, "target")
    column.row().prop(settings, "way", expand=True)
    if settings.way == "AIR":
        column.prop(settings, "bounces")
    column.prop(settings, "timing")
    if settings.timing != "FREE":
        column.prop(settings, "seconds" if settings.timing == "SECONDS" else "arrival")
    column.prop(settings, "body")
    if settings.body is not None:
        column.prop(settings, "part")
        if settings.part in {"foot", "hand", "tool"} and not settings.bone:
            column.prop(settings, "side")
        column.prop_search(settings, "bone", settings.body.data, "bones")
        pair = column.column(align=True)
        pair.prop(settings, "first")
        pair.prop(settings, "last")
    for name in ("ball", "back", "left", "follow", "human"):
        if settings.way == "AIR" or name not in ("back", "left"):
            column.prop(settings, name)
    if settings.told:
        paragraph(layout, settings.told, "ERROR")
    table(layout, settings.figures.splitlines())


def physics(layout, context, ball) -> None:
    """To Blender's rigid bodies and back."""
    row = layout.row(align=True)
    if ball is not None and ball.beyond_mocap_aim.handed:
        row.operator("beyond_mocap.ball_from_physics", icon="LOOP_BACK")
        row.label(text=f"since frame {ball.beyond_mocap_aim.handover}")
    else:
        text = f"To Physics from Frame {context.scene.frame_current}"
        row.operator("beyond_mocap.ball_to_physics", icon="PHYSICS", text=text)
