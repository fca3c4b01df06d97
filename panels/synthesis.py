"""Panel of Synthesize: the step's button, its progress, its settings and presets."""

from __future__ import annotations

import bpy
from bl_ui.utils import PresetPanel

from ..scene.core.settings import describe_missed_moments
from .tab import StepPanel, draw_automatic, draw_header, draw_paragraph
from .wrapping import BARE_MARGIN, shorten_progress

MOST_MISSED = 4  # players of whom the panel says that their takes miss moments


class BEYOND_MOCAP_MT_presets(bpy.types.Menu):
    """Menu of the synthesis presets."""

    bl_label = "Synthesis Presets"
    preset_subdir = "beyond_mocap/synthesis"
    preset_operator = "script.execute_preset"
    draw = bpy.types.Menu.draw_preset


class BEYOND_MOCAP_PT_presets(PresetPanel, bpy.types.Panel):
    """Popover of the synthesis presets, with buttons that add and remove one."""

    bl_label = "Synthesis Presets"
    preset_subdir = "beyond_mocap/synthesis"
    preset_operator = "script.execute_preset"
    preset_add_operator = "beyond_mocap.add_preset"


class BEYOND_MOCAP_MT_queue(bpy.types.Menu):
    """The players that wait for their turn; one that is chosen waits no longer."""

    bl_label = "Waiting Players"

    def draw(self, context):
        """Draw a line for each waiting player."""
        for name in context.window_manager.beyond_mocap_work.waiting.splitlines():
            self.layout.operator("beyond_mocap.cancel", text=f"Cancel {name}", icon="X").player = name


class BEYOND_MOCAP_PT_synthesis(StepPanel, bpy.types.Panel):
    """Step 3: Synthesize, its progress and its settings."""

    bl_label = "3  Synthesize"
    task = "PLAYER"
    rooms = ("synthesis",)
    bl_order = 3

    def find_state(self, context):
        """Return whether there is a player to synthesize."""
        return ("next" if context.scene.beyond_mocap.players else "later"), ""

    def draw_step(self, layout, context):
        """Draw the buttons, the line of the progress, and the settings."""
        settings = context.scene.beyond_mocap
        row = layout.row(align=True)
        row.scale_y = 1.3
        row.operator("beyond_mocap.synthesize", icon="ARMATURE_DATA")
        row.operator("beyond_mocap.update", icon="FILE_REFRESH")
        draw_queue(layout, context.window_manager.beyond_mocap_work, settings)
        draw_missed_moments(layout, settings)
        if body := draw_header(layout, "synthesis_more", "Settings"):
            draw_settings(body, settings)


def draw_queue(layout, running, settings) -> None:
    """Draw two lines below the buttons: the work and how to end it, or what stands in their place meanwhile."""
    first, second = layout.row(align=True), layout.row(align=True)
    if running.kind != "synthesis":
        if running.trouble:
            first.label(text=running.trouble, icon="ERROR")
        else:
            first.prop(settings, "live")
        second.menu("BEYOND_MOCAP_MT_presets", text="Presets")
        second.popover("BEYOND_MOCAP_PT_presets", text="", icon="PRESET_NEW")
        return
    first.progress(factor=running.fraction, text=shorten_progress(running.text, BARE_MARGIN))
    early = second.row(align=True)
    early.enabled = not running.ending
    early.operator("beyond_mocap.cancel", text="Finish Early", icon="CHECKMARK").keep = True
    second.operator("beyond_mocap.cancel", text="Cancel", icon="X")
    if waiting := running.waiting.splitlines():
        more = second.row(align=True)
        more.ui_units_x = 2.5
        more.menu("BEYOND_MOCAP_MT_queue", text=f"+{len(waiting)}")


def draw_missed_moments(layout, settings) -> None:
    """Draw a line for each selected player whose take misses key moments, which Quality lists."""
    missed = [(player.name, text) for player in settings.players
              if player.use and (text := describe_missed_moments([player]))]
    for name, text in missed[:MOST_MISSED]:
        draw_paragraph(layout, f"{name}: {text}", "ERROR")
    if len(missed) > MOST_MISSED:
        layout.label(text=f"and {len(missed) - MOST_MISSED} more", icon="BLANK1")


def draw_settings(layout, settings) -> None:
    """Draw the settings of the search."""
    layout.use_property_split, layout.use_property_decorate = True, False
    layout.prop(settings, "method")
    if settings.method == "distance":
        layout.prop(settings, "catch_up")
    for name in ("solve_touches", "recorded_ball", "mirror", "nearest", "rate"):
        layout.prop(settings, name)
    if body := draw_header(layout, "synthesis_tuning", "Fine-Tuning"):
        for name in settings.list_tuning():
            if name == "omega":
                draw_automatic(body, settings, name, 4.0)
            else:
                body.prop(settings, name, slider=name in ("alpha", "watch"))
