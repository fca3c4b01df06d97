"""Passing Scene: the part of Ball & Passes in which players keep a ball going."""

from __future__ import annotations

import bpy

from ..scene.passes.settings import active_row, told_lines
from .tab import paragraph, section, split, table

PART_ICONS = {
    "foot": "MOD_DYNAMICPAINT", "head": "USER", "chest": "OUTLINER_OB_ARMATURE", "hand": "VIEW_PAN", "tool": "MOD_BEVEL"
}  # fmt: skip
KIND_ICONS = {"toss": "IPO_SINE", "pass": "IPO_QUAD", "attack": "IPO_EXPO"}


class BEYOND_MOCAP_UL_passers(bpy.types.UIList):
    """The players of a passing scene."""

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property):
        """One player."""
        row = layout.row(align=True)
        row.prop(item, "name", text="", emboss=False)
        row.label(text="", icon=PART_ICONS[item.part])
        shirt = row.row()
        shirt.ui_units_x = 1.0
        shirt.prop(item, "shirt", text="")
        if item.place is None:
            row.label(text="", icon="ERROR")


class BEYOND_MOCAP_UL_passes(bpy.types.UIList):
    """The passes, one after the other."""

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property):
        """One pass."""
        row = layout.row(align=True)
        row.label(text=f"{item.who} to {item.to}", icon=KIND_ICONS[item.kind])
        bounces = row.row()
        bounces.active, bounces.alignment = False, "RIGHT"
        bounces.label(
            text=f"{item.bounces} {'bounce' if item.bounces == 1 else 'bounces'}" if item.bounces else "direct"
        )
        if item.error != "none":
            row.label(text="", icon="CANCEL")


def lists(layout, kind: str, settings, rows: str, active: str, verb: str) -> None:
    """A list with what adds to it, takes away and moves."""
    row = layout.row()
    row.template_list(f"BEYOND_MOCAP_UL_{kind}", "", settings, rows, settings, active_propname=active, rows=3)
    column = row.column(align=True)
    for what, icon in (("ADD", "ADD"), ("REMOVE", "REMOVE"), ("UP", "TRIA_UP"), ("DOWN", "TRIA_DOWN")):
        button = column.operator(f"beyond_mocap.{verb}", text="", icon=icon)
        button.rows, button.what = rows, what


def passing(panel, layout, context) -> None:
    """Players, passes, ball, and what comes of them."""
    settings = context.scene.beyond_mocap_passes
    row = layout.row(align=True)
    row.operator_menu_enum("beyond_mocap.passes_sample", "sample", icon="PRESET")
    row.operator("beyond_mocap.passes_from_json", text="", icon="IMPORT")
    row.operator("beyond_mocap.passes_to_json", text="", icon="EXPORT")
    lists(layout, "passers", settings, rows="players", active="active_player", verb="passes_list")
    if player := active_row(settings.players, settings.active_player):
        of_player(layout, player)
    lists(layout, "passes", settings, rows="passes", active="active_pass", verb="passes_list")
    if one := active_row(settings.passes, settings.active_pass):
        of_pass(layout, settings, one)
    row = layout.row(align=True)
    row.scale_y = 1.3
    row.operator("beyond_mocap.passes_make", icon="PLAY")
    row.prop(settings, "live", text="", icon="UV_SYNC_SELECT")
    row.operator("beyond_mocap.passes_clear", text="", icon="X")
    panel.progress(context, "passes")
    for line in settings.told.splitlines():
        paragraph(layout, line, "INFO")
    if settings.strikes:
        section(layout, "ball_strikes", "Strikes", lambda opened: strikes(opened, settings))
    section(layout, "ball_choices", "Choices", lambda opened: choices(opened, settings))
    section(layout, "ball_ball", "Ball & Air", lambda opened: of_ball(opened, settings))


def strikes(layout, settings) -> None:
    """Figures, and a line for each strike that goes there."""
    table(layout, settings.figures.splitlines())
    column = layout.column(align=True)
    for frame, text in told_lines(settings.strikes):
        column.operator("beyond_mocap.go_to_strike", text=f"{frame}  {text}", icon="KEYTYPE_KEYFRAME_VEC").frame = frame


def of_player(layout, player) -> None:
    """Where the picked player stands, and what he strikes with."""
    column = split(layout)
    for name in ("place", "body", "part"):
        column.prop(player, name)
    if player.part in {"foot", "hand", "tool"} and not player.bone:
        column.prop(player, "side")
    if player.part == "tool":
        for name in ("tool_length", "tool_reach", "tool_radius"):
            column.prop(player, name)
    column.prop(player, "bone")
    column.prop(player, "height")


def of_pass(layout, settings, one) -> None:
    """How the picked pass goes."""
    column = split(layout)
    column.prop_search(one, "who", settings, "players")
    column.prop_search(one, "to", settings, "players")
    column.row().prop(one, "kind", expand=True)
    for name in ("bounces", "seconds", "at", "part", "side", "error", "actor"):
        column.prop(one, name)
    if one.actor is not None:
        for name in ("actor_cut", *(("actor_first", "actor_last") if one.actor_cut else ())):
            column.prop(one, name)
        return
    if one.actor_known:
        column.prop(one, "actor_known", icon="ERROR")
        return
    for name in ("clip", *(("first", "last") if one.clip else ())):
        column.prop(one, name)


def choices(layout, settings) -> None:
    """What holds for all passes."""
    column = split(layout)
    for name in ("library_folder", "repeat", "rate", "start_frame", "lead_in", "lead_out", "serve_from"):
        column.prop(settings, name)
    if settings.serve_from == "PLAYER":
        column.prop_search(settings, "serve", settings, "players")
    if settings.serve_from == "PLACE":
        column.prop(settings, "serve_at")
    for name in ("transition", "turns", "watch", "missed", "dropped", "seed", "net"):
        column.prop(settings, name)
    if settings.net:
        for name in ("net_from", "net_to", "net_height"):
            column.prop(settings, name)
    section(column, "ball_weights", "Weights", lambda opened: weights(opened, settings))


def weights(layout, settings) -> None:
    """Of eq. 1 and 2."""
    column = split(layout)
    for title, names in (
        ("Two Strikes Compared", ("speed", "vectors", "times")),
        ("Two Poses Compared", ("position", "velocity", "bones")),
    ):
        column.label(text=title)
        for name in names:
            column.prop(settings.weights, name)


def of_ball(layout, settings) -> None:
    """The ball's kind, or numbers of one's own."""
    column = split(layout)
    column.prop(settings, "ball")
    column.prop(settings, "own")
    if settings.own:
        for name in ("radius", "restitution", "linear_drag", "drag", "gravity"):
            column.prop(settings, name)
