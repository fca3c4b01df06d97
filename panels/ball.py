"""Panel "Ball & Passes" and its sections: players who pass a ball; the ball tracked, struck, carried and aimed."""

from __future__ import annotations

import bpy

from ..scene.ball.settings import find_aimed_ball
from ..scene.passes.settings import (
    find_active_row,
    find_armature,
    find_ball,
    find_picture_icon,
    needs_side,
    parse_lines,
    show_label,
)
from .tab import (
    TabPanel,
    create_value_column,
    draw_automatic,
    draw_paragraph,
    draw_section,
    draw_table,
    draw_values,
    with_progress,
)

LINE = 20.0  # pixels of a line of the interface, at a scale of 1

PART_ICONS = {
    "foot": "MOD_DYNAMICPAINT", "head": "USER", "chest": "OUTLINER_OB_ARMATURE", "hand": "VIEW_PAN", "tool": "MOD_BEVEL"
}  # fmt: skip
KIND_ICONS = {"toss": "IPO_SINE", "pass": "IPO_QUAD", "attack": "IPO_EXPO"}


class BEYOND_MOCAP_UL_touches(bpy.types.UIList):
    """Touches that were solved from tracking data."""

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property):
        row = layout.row(align=True)
        row.prop(item, "use", text="")
        named = row.split(factor=0.62)
        named.label(text=f"{item.time:.2f}  {item.name or '?'}")
        named.label(text=show_label(item.kind))


class BEYOND_MOCAP_PT_ball(TabPanel, bpy.types.Panel):
    """The ball and the players who pass it."""

    bl_label = "Ball & Passes"
    task = "BALL"
    bl_order = 8

    def draw(self, context):
        """Draw the sections; most are closed at first."""
        layout = self.layout
        draw_section(layout, "ball_scene", "Passing Scene", lambda opened: draw_passing_scene(opened, context),
                     closed=False)
        draw_section(layout, "ball_tracked", "Ball from Tracking", lambda opened: draw_tracked_ball(opened, context))
        draw_section(layout, "ball_hits", "Hit Analysis", lambda opened: draw_hit_analysis(opened, context))
        draw_section(layout, "ball_hold", "Carried Ball", lambda opened: draw_carried_ball(opened, context))
        draw_section(layout, "ball_aim", "Aim Ball", lambda opened: draw_aim(opened, context))


def draw_tracked_ball(layout, context) -> None:
    """Draw the button, figures of the solved ball, and its touches."""
    settings = context.scene.beyond_mocap_passes
    with_progress(layout, context, ("ball",), lambda row: row.operator("beyond_mocap.solve_ball", icon="SPHERE"))
    if settings.solved:
        draw_table(layout, settings.solved.splitlines())
    if not len(settings.touches):
        return
    layout.template_list("BEYOND_MOCAP_UL_touches", "", settings, "touches", settings, active_propname="active_touch",
                         rows=5)
    if touch := find_active_row(settings.touches, settings.active_touch):
        kind, part = (show_label(word) for word in (touch.kind, touch.part))
        layout.label(text=f"{kind}, {part}: confidence {touch.confidence:.0%}")
        create_value_column(layout).prop(touch, "words")
        layout.operator("beyond_mocap.jump_to", text="Go to Touch", icon="PLAY").seconds = touch.time
    row = layout.row(align=True)
    row.operator("beyond_mocap.accept_touches", text="Apply All", icon="CHECKMARK")
    row.operator("beyond_mocap.accept_touches", text="Active Player").active = True


def draw_hit_analysis(layout, context) -> None:
    """Draw the settings of the hit analysis, its picture, and a button for each strike."""
    body = find_armature(context)
    if body is None:
        draw_paragraph(layout, "Select an armature with a motion", "INFO")
        return
    found = body.beyond_mocap_hits
    layout.label(text=body.name, icon="ARMATURE_DATA")
    column = create_value_column(layout)
    column.prop(found, "part")
    column.prop(found, "side")
    column.prop_search(found, "bone", body.data, "bones")
    draw_automatic(column, found, "threshold", 0.2)
    row = layout.row(align=True)
    row.operator("beyond_mocap.hit_analysis", icon="GRAPH")
    if not found.found:
        return
    row.operator("beyond_mocap.clear_hits", text="Clear", icon="X")
    if icon := find_picture_icon(found):
        width = context.region.width / context.preferences.system.ui_scale - 2.5 * LINE
        layout.template_icon(icon, scale=max(6.0, min(width / LINE, 16.0)))
    for frame, text in parse_lines(found.lines):
        layout.operator("beyond_mocap.go_to_strike", text=f"{frame}: {text}", icon="KEYTYPE_EXTREME_VEC").frame = frame
    if not found.lines:
        draw_paragraph(layout, "No strike found: try the other side, another part or a threshold", "INFO")


def draw_carried_ball(layout, context) -> None:
    """Draw the settings of a hold and the stretches in which the ball is carried."""
    settings, body, ball = context.scene.beyond_mocap_passes, find_armature(context), find_ball(context)
    layout.label(text=ball.name if ball is not None else "No ball: select one",
                 icon="SPHERE" if ball is not None else "INFO")
    layout.label(text=body.name if body is not None else "No armature: select one",
                 icon="ARMATURE_DATA" if body is not None else "INFO")
    column = create_value_column(layout)
    for name in ("hold_part", "hold_side", "hold_first", "hold_last", "hold_how"):
        column.prop(settings, name)
    take = layout.operator("beyond_mocap.take_ball", icon="CON_CHILDOF")
    take.part, take.side, take.how = settings.hold_part, settings.hold_side, settings.hold_how
    take.first, take.last = settings.hold_first, settings.hold_last
    if ball is None:
        return
    for number, hold in enumerate(ball.beyond_mocap_ball.holds):
        row = layout.row(align=True)
        row.label(text=f"{hold.first} to {hold.last}: {hold.body.name if hold.body else 'missing'}, {hold.bone}")
        row.operator("beyond_mocap.free_ball", text="", icon="X").number = number


def draw_aim(layout, context) -> None:
    """Draw the button, and the aimed ball's settings and result."""
    ball = find_aimed_ball(context)
    layout.operator("beyond_mocap.aim_ball", icon="CON_TRACKTO", text="Aim Again" if ball is not None else "Aim Ball")
    if ball is not None:
        draw_aimed_ball(layout, ball)
    draw_physics(layout, context, ball)


def draw_aimed_ball(layout, ball) -> None:
    """Draw an aimed ball's settings and figures."""
    settings = ball.beyond_mocap_aim
    row = layout.row(align=True)
    row.label(text=ball.name, icon="SPHERE")
    row.operator("beyond_mocap.leave_aim", text="Revert", icon="X")
    layout.prop(settings, "live")
    column = create_value_column(layout)
    column.enabled = not settings.handed
    column.prop(settings, "target")
    column.prop(settings, "way")
    if settings.way == "AIR":
        column.prop(settings, "bounces")
    column.prop(settings, "timing")
    if settings.timing != "FREE":
        column.prop(settings, "seconds" if settings.timing == "SECONDS" else "arrival")
    column.prop(settings, "body")
    if settings.body is not None:
        column.prop(settings, "part")
        if needs_side(settings):
            column.prop(settings, "side")
        column.prop_search(settings, "bone", settings.body.data, "bones")
        pair = column.column(align=True)
        pair.prop(settings, "first")
        pair.prop(settings, "last")
    for name in ("ball", "back", "left", "follow", "human"):
        if settings.way == "AIR" or name not in ("back", "left"):
            column.prop(settings, name)
    if settings.messages:
        draw_paragraph(layout, settings.messages, "ERROR")
    draw_table(layout, settings.figures.splitlines())


def draw_physics(layout, context, ball) -> None:
    """Draw the handover to Blender's rigid bodies and back."""
    row = layout.row(align=True)
    if ball is not None and ball.beyond_mocap_aim.handed:
        row.operator("beyond_mocap.ball_from_physics", icon="LOOP_BACK")
        row.label(text=f"since frame {ball.beyond_mocap_aim.handover}")
    else:
        text = f"To Physics from Frame {context.scene.frame_current}"
        row.operator("beyond_mocap.ball_to_physics", icon="PHYSICS", text=text)


class BEYOND_MOCAP_UL_passers(bpy.types.UIList):
    """The players of a passing scene."""

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property):
        row = layout.row(align=True)
        row.prop(item, "name", text="", emboss=False)
        row.label(text="", icon=PART_ICONS[item.part])
        shirt = row.row()
        shirt.ui_units_x = 1.0
        shirt.prop(item, "shirt", text="")
        if item.place is None:
            row.label(text="", icon="ERROR")


class BEYOND_MOCAP_UL_passes(bpy.types.UIList):
    """The passes in their order."""

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property):
        row = layout.row(align=True)
        row.label(text=f"{item.who} to {item.to}", icon=KIND_ICONS[item.kind])
        bounces = row.row()
        bounces.active, bounces.alignment = False, "RIGHT"
        bounces.label(
            text=f"{item.bounces} {'bounce' if item.bounces == 1 else 'bounces'}" if item.bounces else "direct"
        )
        if item.error != "none":
            row.label(text="", icon="CANCEL")


def draw_list(layout, kind: str, settings, rows: str, active: str, operator: str) -> None:
    """Draw a list with buttons to add, remove and move rows."""
    row = layout.row()
    row.template_list(f"BEYOND_MOCAP_UL_{kind}", "", settings, rows, settings, active_propname=active, rows=3)
    column = row.column(align=True)
    for action, icon in (("ADD", "ADD"), ("REMOVE", "REMOVE"), ("UP", "TRIA_UP"), ("DOWN", "TRIA_DOWN")):
        button = column.operator(f"beyond_mocap.{operator}", text="", icon=icon)
        button.rows, button.what = rows, action


def draw_passing_scene(layout, context) -> None:
    """Draw players, passes, ball, and the result of the scene."""
    settings = context.scene.beyond_mocap_passes
    layout.operator_menu_enum("beyond_mocap.passes_sample", "sample", icon="PRESET")
    row = layout.row(align=True)
    row.operator("beyond_mocap.passes_from_json", text="From File", icon="IMPORT")
    row.operator("beyond_mocap.passes_to_json", text="To File", icon="EXPORT")
    with_progress(layout, context, ("passes",), draw_make_buttons)
    if len(settings.players) < 2 or not settings.passes:
        draw_paragraph(layout, "Add two players and a pass below, or choose a sample", "INFO")
    layout.prop(settings, "live")
    layout.label(text="Players")
    draw_list(layout, "passers", settings, rows="players", active="active_player", operator="passes_list")
    if player := find_active_row(settings.players, settings.active_player):
        draw_section(layout, "ball_player", player.name, lambda opened: draw_player(opened, player))
    layout.label(text="Passes")
    draw_list(layout, "passes", settings, rows="passes", active="active_pass", operator="passes_list")
    if one := find_active_row(settings.passes, settings.active_pass):
        draw_section(layout, "ball_pass", f"{one.who} to {one.to}", lambda opened: draw_pass(opened, settings, one))
    for line in settings.messages.splitlines():
        draw_paragraph(layout, line, "INFO")
    if settings.strikes:
        draw_section(layout, "ball_strikes", "Strikes", lambda opened: draw_strikes(opened, settings))
    draw_section(layout, "ball_choices", "Options", lambda opened: draw_choices(opened, settings))
    draw_section(layout, "ball_ball", "Ball & Air", lambda opened: draw_ball(opened, settings))


def draw_make_buttons(row) -> None:
    """Draw the buttons that make a passing scene and take it away."""
    row.operator("beyond_mocap.passes_make", icon="PLAY")
    row.operator("beyond_mocap.passes_clear", text="Revert", icon="X")


def draw_strikes(layout, settings) -> None:
    """Draw figures and a button for each strike."""
    draw_table(layout, settings.figures.splitlines())
    column = layout.column(align=True)
    for frame, text in parse_lines(settings.strikes):
        column.operator("beyond_mocap.go_to_strike", text=f"{frame}  {text}", icon="KEYTYPE_KEYFRAME_VEC").frame = frame


def draw_player(layout, player) -> None:
    """Draw the settings of the active player."""
    column = create_value_column(layout)
    for name in ("place", "body", "part"):
        column.prop(player, name)
    if needs_side(player):
        column.prop(player, "side")
    if player.part == "tool":
        for name in ("tool_length", "tool_reach", "tool_radius"):
            column.prop(player, name)
    column.prop(player, "bone")
    draw_automatic(column, player, "height", 1.8)


def draw_pass(layout, settings, one) -> None:
    """Draw the settings of the active pass."""
    column = create_value_column(layout)
    column.prop_search(one, "who", settings, "players")
    column.prop_search(one, "to", settings, "players")
    draw_values(column, one, ("kind", "bounces", "seconds", "at", "part", "side", "error", "actor"), {"seconds": 0.8})
    if one.actor is not None:
        for name in ("actor_cut", *(("actor_first", "actor_last") if one.actor_cut else ())):
            column.prop(one, name)
        return
    if one.actor_known:
        column.prop(one, "actor_known", icon="ERROR")
        return
    for name in ("clip", *(("first", "last") if one.clip else ())):
        column.prop(one, name)


def draw_choices(layout, settings) -> None:
    """Draw the settings of all passes."""
    column = create_value_column(layout)
    draw_values(column, settings, ("library_folder", "repeat", "rate", "start_frame", "lead_in", "lead_out",
                                   "serve_from"), {"rate": 30.0, "library_folder": "As in Step 1"})
    if settings.serve_from == "PLAYER":
        column.prop_search(settings, "serve", settings, "players")
    if settings.serve_from == "PLACE":
        column.prop(settings, "serve_at")
    for name in ("transition", "turns", "watch", "missed", "dropped", "seed", "net"):
        column.prop(settings, name)
    if settings.net:
        for name in ("net_from", "net_to", "net_height"):
            column.prop(settings, name)
    draw_section(column, "ball_weights", "Weights", lambda opened: draw_weights(opened, settings))


def draw_weights(layout, settings) -> None:
    """Draw the weights of eq. 1 and eq. 2."""
    column = create_value_column(layout)
    for title, names in (("Compare Strikes", ("speed", "vectors", "times")),
                         ("Compare Poses", ("position", "velocity", "bones"))):
        column.label(text=title)
        for name in names:
            column.prop(settings.weights, name)


def draw_ball(layout, settings) -> None:
    """Draw the ball's kind, or its custom values."""
    column = create_value_column(layout)
    column.prop(settings, "ball")
    column.prop(settings, "own")
    if settings.own:
        for name in ("radius", "restitution", "linear_drag", "drag", "gravity"):
            column.prop(settings, name)
