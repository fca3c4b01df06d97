"""Ball & Passes: the panel and its parts about the ball: tracked, struck, carried, aimed."""

from __future__ import annotations

import bpy

from ..scene.ball.settings import aimed_ball
from ..scene.passes.settings import active_row, ball_of, picture_icon, subject, told_lines
from .passes import passing
from .stream import live, stream
from .tab import Step, paragraph, section, split, table

LINE = 20.0  # pixels of a line of the interface, at a scale of 1


class BEYOND_MOCAP_UL_touches(bpy.types.UIList):
    """Touches that were solved from tracking."""

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property):
        """One touch."""
        row = layout.row(align=True)
        row.prop(item, "use", text="")
        named = row.split(factor=0.62)
        named.label(text=f"{item.time:.2f}  {item.name or '?'}")
        named.label(text=item.kind)


class BEYOND_MOCAP_PT_ball(Step, bpy.types.Panel):
    """The ball and the players who keep it going."""

    bl_label = "Ball & Passes"
    bl_order = 8
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """Its parts, each folded until it is wanted."""
        layout = self.layout
        section(layout, "ball_scene", "Passing Scene", lambda opened: passing(self, opened, context), closed=False)
        section(layout, "ball_tracked", "Ball from Tracking", lambda opened: tracked(self, opened, context))
        section(layout, "ball_hits", "Hit Analysis", lambda opened: hits(opened, context))
        section(layout, "ball_hold", "Carried Ball", lambda opened: carried(opened, context))
        section(layout, "ball_aim", "Aim Ball", lambda opened: aim(opened, context))
        section(layout, "ball_stream", "Live Stream", lambda opened: stream(opened, context))
        section(layout, "ball_live", "Play Live", lambda opened: live(self, opened, context))


def tracked(panel, layout, context) -> None:
    """The button, what was solved, and the touches."""
    settings = context.scene.beyond_mocap_passes
    layout.operator("beyond_mocap.solve_ball", icon="SPHERE")
    panel.progress(context, "ball")
    if settings.solved:
        table(layout, settings.solved.splitlines())
    if not len(settings.touches):
        return
    layout.template_list("BEYOND_MOCAP_UL_touches", "", settings, "touches", settings, "active_touch", rows=5)
    if touch := active_row(settings.touches, settings.active_touch):
        layout.label(text=f"{touch.kind} by the {touch.part}, {touch.confidence:.0%} sure")
        row = layout.row(align=True)
        row.prop(touch, "words", text="")
        row.operator("beyond_mocap.jump_to", text="", icon="PLAY").seconds = touch.time
    row = layout.row(align=True)
    row.operator("beyond_mocap.accept_touches", icon="CHECKMARK")
    row.operator("beyond_mocap.accept_touches", text="of Active").active = True


def hits(layout, context) -> None:
    """What to look for, the graph, and a line for each strike that goes there."""
    body = subject(context)
    if body is None:
        paragraph(layout, "Select an armature with a motion", "INFO")
        return
    found = body.beyond_mocap_hits
    layout.label(text=body.name, icon="ARMATURE_DATA")
    row = layout.row(align=True)
    row.prop(found, "part", text="")
    row.prop(found, "side", text="")
    column = split(layout)
    column.prop_search(found, "bone", body.data, "bones")
    column.prop(found, "threshold")
    row = layout.row(align=True)
    row.operator("beyond_mocap.hit_analysis", icon="GRAPH")
    if not found.found:
        return
    row.operator("beyond_mocap.clear_hits", text="", icon="X")
    if icon := picture_icon(found):
        width = context.region.width / context.preferences.system.ui_scale - 2.5 * LINE
        layout.template_icon(icon, scale=max(6.0, min(width / LINE, 16.0)))
    for frame, text in told_lines(found.lines):
        layout.operator("beyond_mocap.go_to_strike", text=f"{frame}: {text}", icon="KEYTYPE_EXTREME_VEC").frame = frame
    if not found.lines:
        paragraph(layout, "No strike found: try the other side, another part or a threshold", "INFO")


def carried(layout, context) -> None:
    """Who carries the ball and when."""
    settings, body, ball = context.scene.beyond_mocap_passes, subject(context), ball_of(context)
    layout.label(
        text=ball.name if ball is not None else "No ball: select one", icon="SPHERE" if ball is not None else "INFO"
    )
    layout.label(
        text=body.name if body is not None else "No armature: select one",
        icon="ARMATURE_DATA" if body is not None else "INFO",
    )
    row = layout.row(align=True)
    row.prop(settings, "hold_part", text="")
    row.prop(settings, "hold_side", text="")
    row = layout.row(align=True)
    row.prop(settings, "hold_first")
    row.prop(settings, "hold_last")
    layout.row().prop(settings, "hold_how", expand=True)
    take = layout.operator("beyond_mocap.take_ball", icon="CON_CHILDOF")
    take.part, take.side, take.how = settings.hold_part, settings.hold_side, settings.hold_how
    take.first, take.last = settings.hold_first, settings.hold_last
    if ball is None:
        return
    for number, hold in enumerate(ball.beyond_mocap_ball.holds):
        row = layout.row(align=True)
        row.label(text=f"{hold.first} to {hold.last}: {hold.body.name if hold.body else 'gone'}, {hold.bone}")
        row.operator("beyond_mocap.free_ball", text="", icon="X").number = number


def aim(layout, context) -> None:
    """The button; of the ball that is meant, who strikes it, towards what and how, and what comes of it."""
    ball = aimed_ball(context)
    layout.operator("beyond_mocap.aim_ball", icon="CON_TRACKTO", text="Aim Again" if ball is not None else "Aim Ball")
    if ball is not None:
        of_aimed_ball(layout, ball)
    physics(layout, context, ball)


def of_aimed_ball(layout, ball) -> None:
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
