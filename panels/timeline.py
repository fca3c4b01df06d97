"""The tab "Beyond Mocap" in the NLA editor and the dope sheet: the labels of one player."""

from __future__ import annotations

import bpy

from ..scene.core.settings import find_active_player
from .notices import draw_notices
from .tab import draw_header, draw_paragraph

MOST = 60  # key moments that the list shows


class BEYOND_MOCAP_MT_choose_player(bpy.types.Menu):
    """Choose the player whose strips are shown."""

    bl_label = "Player"

    def draw(self, context):
        """Draw a line for each player."""
        for player in context.scene.beyond_mocap.players:
            icon = "LAYER_ACTIVE" if player == find_active_player(context.scene.beyond_mocap) else "BLANK1"
            self.layout.operator("beyond_mocap.choose_player", text=player.name, icon=icon).player = player.name


class TimelineTab:
    """The content that all time editors share."""

    bl_region_type = "UI"
    bl_category = "Beyond Mocap"
    bl_label = "Timeline"

    def draw(self, context):
        """Draw the player, key moments, problems and tools."""
        layout, settings = self.layout, context.scene.beyond_mocap
        target, player = find_target(context), find_active_player(settings)
        clip = target is not None and not target.beyond_mocap_dot.player
        row = layout.row(align=True)
        row.menu("BEYOND_MOCAP_MT_choose_player", text=target.name if clip else player.name if player else "No Player")
        row.operator("beyond_mocap.choose_player", text="", icon="RESTRICT_SELECT_OFF")
        row.prop(settings, "show_moment_names", text="", icon="SYNTAX_OFF")
        if target is None:
            layout.operator("beyond_mocap.place_players", icon="NLA")
        else:
            self.draw_moments(layout, target)
            self.draw_problems(layout, context, target)
        self.draw_tools(layout)
        draw_notices(layout, context, ("timeline", "timeline_labels", "annotate"))

    def draw_moments(self, layout, target):
        """Draw the key moments by frame; a click goes there and selects the moment."""
        found = sorted(iter_visible_moments(target), key=lambda one: one[0])
        box = layout.column(align=True)
        for frame, name, strip, index, picked in found[:MOST]:
            line = box.operator("beyond_mocap.go_to_moment", text=f"{frame}   {name}", depress=picked)
            line.strip, line.index = strip, index
        if len(found) > MOST:
            box.label(text=f"and {len(found) - MOST} more")
        row = layout.row(align=True)
        row.operator("beyond_mocap.add_moment", text="Add", icon="ADD")
        row.operator("beyond_mocap.move_moment", text="Move", icon="TRIA_DOWN_BAR")
        row.operator("beyond_mocap.delete_moment", text="Delete", icon="REMOVE")

    def draw_problems(self, layout, context, target):
        """Draw the problems of the labels, as of their last change."""
        for one in context.window_manager.beyond_mocap_problems.lines:
            if one.target == target.name:
                draw_paragraph(layout, f"{one.frame}: {one.line}", "ERROR")

    def draw_tools(self, layout):
        """Draw the tools for labels, spans and the text form."""
        layout.operator("beyond_mocap.annotate", icon="SYNTAX_ON")
        column = layout.column(align=True)
        column.operator("beyond_mocap.edit_words", icon="GREASEPENCIL")
        column.operator("beyond_mocap.mirror_side", icon="MOD_MIRROR")
        column = layout.column(align=True)
        column.operator("beyond_mocap.add_span", icon="ADD")
        column.operator("beyond_mocap.split_span", icon="UNLINKED")
        column.operator("beyond_mocap.join_spans", icon="LINKED")
        if body := draw_header(layout, "timeline_text", "Text Form"):
            column = body.column(align=True)
            column.operator("beyond_mocap.read_words", icon="IMPORT")
            column.operator("beyond_mocap.words_to_text", icon="TEXT")
            column.operator("beyond_mocap.export_words", icon="EXPORT")
            body.operator("beyond_mocap.player_from_dot", icon="ADD")


class BEYOND_MOCAP_PT_timeline(TimelineTab, bpy.types.Panel):
    """The tab in the NLA editor."""

    bl_space_type = "NLA_EDITOR"


class BEYOND_MOCAP_PT_timeline_dope_sheet(TimelineTab, bpy.types.Panel):
    """The tab in the dope sheet."""

    bl_space_type = "DOPESHEET_EDITOR"


def find_target(context) -> bpy.types.Object | None:
    """Find the target object: a clip that is being annotated, else the active player's dot."""
    active = context.view_layer.objects.active
    if active is not None and active.beyond_mocap_lanes.clock and not active.beyond_mocap_dot.player:
        return active
    player = find_active_player(context.scene.beyond_mocap)
    dot = player.dot if player else None
    return dot if dot is not None and dot.beyond_mocap_lanes.clock and dot.animation_data else None


def iter_visible_moments(target):
    """Iterate over (frame, name, strip, index, is_selected) of the visible markers of an object's strips."""
    for track in target.animation_data.nla_tracks if target.animation_data else ():
        for strip in track.strips:
            low, high = strip.action_frame_start - 0.5, strip.action_frame_end + 0.5
            for index, marker in enumerate(strip.action.pose_markers if strip.action else ()):
                if low <= marker.frame <= high and marker.beyond_mocap.kind == "moment":
                    frame = strip.frame_start + (marker.frame - strip.action_frame_start) * strip.scale
                    yield round(frame), marker.name, strip.name, index, marker.select
