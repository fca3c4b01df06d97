"""How good the active player's take is: figures and targets, key moments, warnings, why this clip."""

from __future__ import annotations

import bpy

from ..scene.settings import active_player
from .tab import Step, figures, paragraph, wrapped


class BEYOND_MOCAP_PT_quality(Step, bpy.types.Panel):
    """Figures, key moments and warnings of the active player's take; a line with a time goes there."""

    bl_label = "Quality"
    bl_order = 6
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        """There is a take to tell about."""
        player = active_player(context.scene.beyond_mocap)
        return player is not None and bool(player.quality)

    def draw(self, context):
        """What the player's settings keep."""
        layout, player = self.layout, active_player(context.scene.beyond_mocap)
        layout.label(text=player.name, icon="ARMATURE_DATA")
        header, body = layout.panel("beyond_mocap_quality_warnings")
        lines = player.warnings.splitlines()
        header.label(text=f"Warnings: {len(lines)}" if lines else "No Warnings", icon="ERROR" if lines else "CHECKMARK")
        if body:
            for line in lines:
                text, _, seconds = line.partition("\t")
                self.jump(body, player, text, seconds, "ERROR")
        header, body = layout.panel("beyond_mocap_quality_moments")
        header.label(text="Key Moments")
        if body:
            for line in player.moments.splitlines():
                text, second, status = (*line.split("\t"), "", "")[:3]
                self.jump(
                    body, player, text, second, "KEYTYPE_EXTREME_VEC" if status == "missed" else "KEYTYPE_KEYFRAME_VEC"
                )
        header, body = layout.panel("beyond_mocap_quality_why")
        header.label(text="Why This Clip")
        if body:
            self.why(body, context.window_manager.beyond_mocap_playhead.why)
        header, body = layout.panel("beyond_mocap_quality_figures")
        header.label(text="Figures")
        if body:
            figures(body, player.quality)

    def jump(self, layout, player, text: str, seconds: str, icon: str) -> None:
        """A line over as many rows as it takes; the first is a button where the line has times."""
        if not seconds:
            paragraph(layout, text, icon)
            return
        column = layout.column(align=True)
        column.scale_y = 0.9
        first, *rest = wrapped(text)
        row = column.row(align=True)
        row.alignment = "LEFT"
        button = row.operator("beyond_mocap.jump_to", text=first, icon=icon, emboss=False)
        button.stops, button.player = seconds, player.name
        for line in rest:
            column.label(text=line, icon="BLANK1")

    def why(self, layout, text: str) -> None:
        """The prepared lines about the piece at the playhead."""
        column = layout.column(align=True)
        column.scale_y = 0.85
        for number, line in enumerate(text.splitlines() or ("No take of this session here",)):
            column.label(text=line, icon="SEQUENCE" if number == 0 and text else "BLANK1")
