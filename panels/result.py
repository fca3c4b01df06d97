"""Results: previews to apply or revert, and their quality."""

from __future__ import annotations

import bpy

from ..scene.core.settings import find_active_player
from .tab import TabPanel, draw_figures, draw_header, draw_paragraph, wrap_text

STATES = {"NONE": ("Not Shown", "BLANK1"),
          "PREVIEW": ("Preview", "HIDE_OFF"),
          "ACCEPTED": ("Applied", "CHECKMARK")}
UPDATE_BUTTONS = {  # label and icon of the button that updates a player
    "update": ("Update", "FILE_REFRESH"),
    "build_library": ("Build Library", "ASSET_MANAGER"),
}


class BEYOND_MOCAP_PT_result(TabPanel, bpy.types.Panel):
    """Apply or revert; alternatives; what is out of date."""

    bl_label = "4  Result"
    bl_order = 4

    def draw(self, context):
        """Draw the state, the buttons and the options."""
        layout, settings = self.layout, context.scene.beyond_mocap
        player = find_active_player(settings)
        if player is not None and player.take:
            text, icon = STATES[player.result.state]
            layout.label(text=f"{player.name}: {text}", icon=icon)
            self.draw_out_of_date(context, player)
        column = layout.column(align=True)
        row = column.row(align=True)
        row.scale_y = 1.3
        row.operator("beyond_mocap.accept", icon="CHECKMARK").form = settings.accept_as
        row.operator("beyond_mocap.discard", icon="X")
        column.row(align=True).prop(settings, "accept_as", expand=True)
        self.draw_alternatives(player)
        row = layout.row(align=True)
        for name in ("make_bodies", "make_ball", "make_paths"):
            row.prop(settings, name, toggle=True)
        if body := draw_header(layout, "result_more", "Time & Stage"):
            body.use_property_split, body.use_property_decorate = True, False
            body.prop(settings, "keep_hand_keys")
            body.prop(settings, "start_frame")
            body.prop(settings, "start_time")
            body.operator("beyond_mocap.add_stage", icon="VIEW_CAMERA")

    def draw_out_of_date(self, context, player):
        """Draw what is out of date, with the button that updates it."""
        scene = context.scene.session_uid
        entries = context.window_manager.beyond_mocap_stale
        entry = next((entry for entry in entries if entry.name == player.name and entry.scene == scene), None)
        if entry is None or not (entry.lines or entry.notes):
            return
        box = self.layout.box().column(align=True)
        if entry.lines:
            box.label(text="Out of Date", icon="ERROR")
        for line in entry.lines.splitlines():
            draw_paragraph(box, line, "DOT")
        for line in entry.notes.splitlines():
            draw_paragraph(box, line, "KEYFRAME")
        if entry.mend in UPDATE_BUTTONS:
            text, icon = UPDATE_BUTTONS[entry.mend]
            button = box.operator(f"beyond_mocap.{entry.mend}", text=text, icon=icon)
            if entry.mend == "update":
                button.player = player.name

    def draw_alternatives(self, player):
        """Draw the alternatives: of a range of time, of the whole take."""
        column = self.layout.column(align=True)
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
    """Figures, key moments and warnings of the active player's take; a line with a time goes there."""

    bl_label = "Quality"
    bl_order = 6
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        """Return whether the active player has figures."""
        player = find_active_player(context.scene.beyond_mocap)
        return player is not None and bool(player.quality)

    def draw(self, context):
        """Draw the stored figures, key moments and warnings."""
        layout, player = self.layout, find_active_player(context.scene.beyond_mocap)
        layout.label(text=player.name, icon="ARMATURE_DATA")
        lines = player.warnings.splitlines()
        title, icon = (f"Warnings: {len(lines)}", "ERROR") if lines else ("No Warnings", "CHECKMARK")
        if body := draw_header(layout, "quality_warnings", title, closed=False, icon=icon):
            for line in lines:
                text, _, seconds = line.partition("\t")
                self.draw_line(body, player, text, seconds, "ERROR")
        if body := draw_header(layout, "quality_moments", "Key Moments", closed=False):
            for line in player.moments.splitlines():
                text, second, status = (*line.split("\t"), "", "")[:3]
                self.draw_line(body, player, text, second,
                               "KEYTYPE_EXTREME_VEC" if status == "missed" else "KEYTYPE_KEYFRAME_VEC")
        if body := draw_header(layout, "quality_why", "Why This Clip", closed=False):
            self.draw_reasons(body, context.window_manager.beyond_mocap_playhead.why)
        if body := draw_header(layout, "quality_figures", "Figures", closed=False):
            draw_figures(body, player.quality)

    def draw_line(self, layout, player, text: str, seconds: str, icon: str) -> None:
        """Draw a line over several rows; the first row is a button if the line has times."""
        if not seconds:
            draw_paragraph(layout, text, icon)
            return
        column = layout.column(align=True)
        column.scale_y = 0.9
        first, *rest = wrap_text(text)
        row = column.row(align=True)
        row.alignment = "LEFT"
        button = row.operator("beyond_mocap.jump_to", text=first, icon=icon, emboss=False)
        button.stops, button.player = seconds, player.name
        for line in rest:
            column.label(text=line, icon="BLANK1")

    def draw_reasons(self, layout, text: str) -> None:
        """Draw the reasons for the piece at the playhead."""
        column = layout.column(align=True)
        column.scale_y = 0.85
        for number, line in enumerate(text.splitlines() or ("No take in this session",)):
            column.label(text=line, icon="SEQUENCE" if number == 0 and text else "BLANK1")
