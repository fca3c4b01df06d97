"""Results: previews to apply or revert, and their quality."""

from __future__ import annotations

import bpy

from ..scene.core.settings import find_active_player
from ..scene.result.verdict import judge_take
from .edits import draw_edits
from .tab import StepPanel, TabPanel, create_value_column, draw_figures, draw_header, draw_paragraph, draw_section
from .wrapping import wrap_text

VERDICT_ICONS = {"Good": "CHECKMARK", "Fair": "INFO", "Poor": "ERROR"}
STATES = {"NONE": ("Not Shown", "BLANK1"),
          "PREVIEW": ("Preview", "HIDE_OFF"),
          "ACCEPTED": ("Applied", "CHECKMARK")}
UPDATE_BUTTONS = {  # label and icon of the button that updates a player
    "update": ("Update", "FILE_REFRESH"),
    "build_library": ("Build Library", "ASSET_MANAGER"),
}


class BEYOND_MOCAP_PT_result(StepPanel, bpy.types.Panel):
    """Step 4: apply or revert; alternatives; what is out of date."""

    bl_label = "4  Result"
    task = "PLAYER"
    rooms = ("result",)
    bl_order = 4

    def find_state(self, context):
        """Return whether there is a take to apply."""
        player = find_active_player(context.scene.beyond_mocap)
        return ("next" if player is not None and player.take else "later"), ""

    def draw_step(self, layout, context):
        """Draw the state, the buttons, and below them what the state changes."""
        settings = context.scene.beyond_mocap
        player = find_active_player(settings)
        stale = find_stale_entry(context, player)
        draw_state(layout, player, stale)
        column = layout.column(align=True)
        row = column.row(align=True)
        row.scale_y = 1.3
        row.operator("beyond_mocap.accept", icon="CHECKMARK").form = settings.accept_as
        row.operator("beyond_mocap.discard", icon="X")
        column.row(align=True).prop(settings, "accept_as", expand=True)
        draw_section(layout, "result_others", "Alternatives", lambda opened: draw_alternatives(opened, player))
        draw_section(layout, "result_edits", "Edits", lambda opened: draw_edits(opened, player))
        draw_section(layout, "result_more", "Options", lambda opened: draw_options(opened, settings))
        if stale is not None:
            draw_section(layout, "result_stale", "What Has Changed", lambda opened: draw_changes(opened, stale))


def find_stale_entry(context, player):
    """Find what is out of date of a player's take; None where nothing is."""
    scene, entries = context.scene.session_uid, context.window_manager.beyond_mocap_stale
    if player is None or not player.take:
        return None
    return next((entry for entry in entries if entry.name == player.name and entry.scene == scene
                 and (entry.lines or entry.notes)), None)


def draw_state(layout, player, stale) -> None:
    """Draw one line: the state of the active player's take, or that it is out of date, with the button that updates
    it.
    """
    row = layout.row()
    if player is None or not player.take:
        row.label(text="No take yet: press Synthesize", icon="INFO")
        return
    text, icon = STATES[player.result.state]
    if stale is None or not stale.lines:
        row.label(text=f"{player.name}: {text}", icon=icon)
        return
    row.label(text="Out of Date", icon="ERROR")
    if stale.mend in UPDATE_BUTTONS:
        text, icon = UPDATE_BUTTONS[stale.mend]
        button = row.operator(f"beyond_mocap.{stale.mend}", text=text, icon=icon)
        if stale.mend == "update":
            button.player = player.name


def draw_changes(layout, stale) -> None:
    """Draw what has changed since the take was made."""
    for lines, icon in ((stale.lines, "DOT"), (stale.notes, "KEYFRAME")):
        for line in lines.splitlines():
            draw_paragraph(layout, line, icon)


def draw_options(layout, settings) -> None:
    """Draw what a result consists of, and when it begins."""
    column = create_value_column(layout)
    column = column.column(heading="Create")
    for name in ("make_bodies", "make_ball", "make_paths"):
        column.prop(settings, name)
    column = create_value_column(layout)
    for name in ("keep_hand_keys", "start_frame", "start_time"):
        column.prop(settings, name)


def draw_alternatives(layout, player) -> None:
    """Draw the alternatives: of a range of time, of the whole take."""
    column = layout.column(align=True)
    column.operator("beyond_mocap.resynthesize_stretch", icon="UV_SYNC_SELECT")
    column.operator("beyond_mocap.variants", icon="RENDERLAYERS")
    variants = player.result.variants if player is not None else ()
    if not variants:
        return
    row = column.row(align=True)
    for number, variant in enumerate(variants, 1):
        shown = variant.name == player.take
        button = row.operator("beyond_mocap.preview", text=str(number), depress=shown)
        button.number, button.player = number, player.name
    for number, variant in enumerate(variants, 1):
        row = column.row()
        row.active = variant.name == player.take
        row.label(text=f"{number}: {variant.summary}")


class BEYOND_MOCAP_PT_quality(TabPanel, bpy.types.Panel):
    """One line that judges the active player's take; behind it places to look at, key moments and figures."""

    bl_label = "Quality"
    task = "PLAYER"
    bl_order = 5
    bl_options = {"HIDE_HEADER"}

    def draw(self, context):
        """Draw the verdict, and while it is open what it is made of."""
        player = find_active_player(context.scene.beyond_mocap)
        found = judge_take(player.quality, player.moments, player.warnings) if player is not None else None
        title, icon = (found.line, VERDICT_ICONS[found.word]) if found is not None and found.word else ("", "NONE")
        body = draw_header(self.layout, "quality", f"Quality: {title}" if title else "Quality", icon=icon)
        if not body:
            return
        if not title:
            draw_paragraph(body, "Figures of the active player's take, once it is synthesized", "INFO")
            return
        draw_places(body, player, found)
        draw_section(body, "quality_moments", "Key Moments", lambda opened: draw_moments(opened, player))
        draw_section(body, "quality_figures", f"Figures: {found.met} of {found.judged} Targets Met",
                     lambda opened: draw_figures(opened, player.quality))
        draw_section(body, "quality_why", "Details", lambda opened: draw_reasons(
            opened, context.window_manager.beyond_mocap_playhead.why))


def draw_places(layout, player, found) -> None:
    """Draw the places to look at, and the warnings that have no time."""
    for text, seconds, is_moment in found.places:
        draw_line(layout, player, text, seconds, "KEYTYPE_EXTREME_VEC" if is_moment else "ERROR")
    for line in player.warnings.splitlines():
        text, _, seconds = line.partition("\t")
        if not seconds:
            draw_paragraph(layout, text, "INFO")


def draw_moments(layout, player) -> None:
    """Draw the key moments."""
    for line in player.moments.splitlines():
        text, second, status = (*line.split("\t"), "", "")[:3]
        icon = "KEYTYPE_EXTREME_VEC" if status == "missed" else "KEYTYPE_KEYFRAME_VEC"
        draw_line(layout, player, text, second, icon)


def draw_line(layout, player, text: str, seconds: str, icon: str) -> None:
    """Draw a text that goes to its times, over as many rows as it needs; each of them can be pressed."""
    column = layout.column(align=True)
    column.scale_y = 0.9
    for number, line in enumerate(wrap_text(text)):
        row = column.row(align=True)
        row.alignment = "LEFT"
        button = row.operator("beyond_mocap.jump_to", text=line, icon="BLANK1" if number else icon, emboss=False)
        button.stops, button.player = seconds, player.name


def draw_reasons(layout, text: str) -> None:
    """Draw why the piece at the playhead was chosen, with its costs."""
    column = layout.column(align=True)
    column.scale_y = 0.85
    column.label(text="Why This Clip")
    for line in text.splitlines() or ("No take in this session",):
        draw_paragraph(column, line, "BLANK1")
