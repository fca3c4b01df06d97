"""Players: their list with its pins and heading keys, annotation by keys and the reference video."""

from __future__ import annotations

import bpy

from ..scene.core.settings import find_active_player
from .tab import TabPanel, create_value_column, draw_header, draw_paragraph


class BEYOND_MOCAP_UL_players(bpy.types.UIList):
    """Players with their shirts; a check box selects those that the next steps use."""

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property):
        row = layout.row(align=True)
        row.prop(item, "use", text="")
        row.prop(item, "name", text="", emboss=False)
        shirt = row.row()
        shirt.ui_units_x = 1.0
        shirt.prop(item, "shirt", text="")
        row.label(text="", icon="CHECKMARK" if item.take else "BLANK1")


class BEYOND_MOCAP_PT_players(TabPanel, bpy.types.Panel):
    """The players, their tracks and their labels."""

    bl_label = "2  Track & Labels"
    bl_order = 2

    def draw(self, context):
        """Draw the list of players, and the files of the active one."""
        layout, settings = self.layout, context.scene.beyond_mocap
        layout.operator("beyond_mocap.import_tracking", icon="IMPORT")
        row = layout.row(align=True)
        row.operator("beyond_mocap.draw_track", icon="CURVE_BEZCURVE")
        row.operator("beyond_mocap.track_object", text="From Object", icon="EMPTY_AXIS")
        row = layout.row()
        row.template_list("BEYOND_MOCAP_UL_players", "", settings, "players", settings, active_propname="active_player",
                          rows=3)
        row.column(align=True).operator("beyond_mocap.remove_player", text="", icon="REMOVE")
        if any(player.dot is None for player in settings.players):
            layout.operator("beyond_mocap.place_players", icon="NLA")
        player = find_active_player(settings)
        if player is None:
            draw_paragraph(layout, "Import a tracking file, drop one into the view, or draw a track", "INFO")
            return
        column = create_value_column(layout)
        column.prop(player, "drawn_track")
        if player.drawn_track is not None:
            draw_curve_settings(column, player)
        else:
            column.prop(player, "tracking_file")
        if player.feed_id:
            column.prop(player, "feed_id")
            column.prop(settings, "section_start")
            column.prop(settings, "section_end")
        file = column.column()
        file.active = player.annotation_text is None  # the text has priority
        file.prop(player, "annotation_file")
        row = column.row(align=True)
        row.prop(player, "annotation_text")
        row.operator("beyond_mocap.read_words", text="", icon="NLA")
        column.prop(player, "body")
        draw_player_settings(layout, player)
        draw_pins(layout, player)
        draw_heading_keys(layout, player)
        draw_contact_edits(layout, player)


class BEYOND_MOCAP_UL_pins(bpy.types.UIList):
    """A player's pins: the part, its time and its duration."""

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property):
        row = layout.row(align=True)
        row.prop(item, "part", text="", emboss=False)
        if item.target is None:
            row.label(text="Missing Empty", icon="ERROR")
            return
        row.prop(item, "time", text="")
        row.prop(item, "hold", text="")


class BEYOND_MOCAP_UL_contact_edits(bpy.types.UIList):
    """A player's edited contacts: the foot, what is done, and when."""

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property):
        row = layout.row(align=True)
        row.prop(item, "foot", text="", emboss=False)
        row.prop(item, "kind", text="", emboss=False)
        row.prop(item, "time", text="", emboss=False)


class BEYOND_MOCAP_UL_heading_keys(bpy.types.UIList):
    """A player's heading keys: the direction or object, the time and the duration."""

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property):
        row = layout.row(align=True)
        if item.faces == "DIRECTION":
            row.prop(item, "heading", text="")
        else:
            place = row.row(align=True)
            place.alert = item.find_target() is None
            place.prop(item, "target", text="")
        row.prop(item, "time", text="")
        row.prop(item, "hold", text="")


def draw_curve_settings(column, player) -> None:
    """Draw the settings of a drawn track."""
    if player.drawn_track.type == "CURVE":
        column.prop(player, "drawn_start")
        column.operator("beyond_mocap.set_speed", icon="DRIVER_DISTANCE")


def draw_player_settings(layout, player) -> None:
    """Draw the settings of this player: height, foot, style, body."""
    if body := draw_header(layout, "player_own", "Player"):
        body.use_property_split, body.use_property_decorate = True, False
        for name in ("height", "strong_foot", "style", "style_weight", "strength", "masses", "fatigue"):
            body.prop(player, name)


def draw_pins(layout, player) -> None:
    """Draw the pins of hands, feet and gaze."""
    if body := draw_header(layout, "player_pins", f"Pins: {len(player.pins)}" if player.pins else "Pins"):
        row = body.row()
        row.template_list("BEYOND_MOCAP_UL_pins", "", player, "pins", player, active_propname="active_pin", rows=2)
        row.column(align=True).operator("beyond_mocap.remove_pin", text="", icon="REMOVE")
        row = body.row(align=True)
        row.operator_menu_enum("beyond_mocap.add_pin", "part", text="Pin at Body", icon="PINNED").at = "BODY"
        row.operator_menu_enum("beyond_mocap.add_pin", "part", text="At Cursor", icon="PIVOT_CURSOR").at = "CURSOR"


def draw_heading_keys(layout, player) -> None:
    """Draw the directions and objects that the body faces."""
    count = len(player.heading_keys)
    if body := draw_header(layout, "player_heading_keys", f"Heading Keys: {count}" if count else "Heading Keys"):
        row = body.row()
        row.template_list("BEYOND_MOCAP_UL_heading_keys", "", player, "heading_keys", player,
                          active_propname="active_heading_key", rows=2)
        row.column(align=True).operator("beyond_mocap.remove_heading_key", text="", icon="REMOVE")
        row = body.row(align=True)
        name = "beyond_mocap.add_heading_key"
        row.operator(name, text="Face Direction", icon="ORIENTATION_LOCAL").faces = "DIRECTION"
        row.operator(name, text="Face This", icon="CON_TRACKTO").faces = "OBJECT"


def draw_contact_edits(layout, player) -> None:
    """Draw the edited contacts of the feet."""
    count = len(player.contact_edits)
    if body := draw_header(layout, "player_contacts", f"Foot Contacts: {count}" if count else "Foot Contacts"):
        body.operator("beyond_mocap.fix_foot", icon="MOD_DYNAMICPAINT")
        if not count:
            return
        row = body.row()
        row.template_list("BEYOND_MOCAP_UL_contact_edits", "", player, "contact_edits", player,
                          active_propname="active_contact_edit", rows=2)
        row.column(align=True).operator("beyond_mocap.remove_contact_edit", text="", icon="REMOVE")
        edit = player.contact_edits[min(player.active_contact_edit, count - 1)]
        if edit.kind != "delete":
            column = body.column()
            column.use_property_split, column.use_property_decorate = True, False
            for name in ("start", "end", "offset"):
                column.prop(edit, name)


class BEYOND_MOCAP_PT_annotate(TabPanel, bpy.types.Panel):
    """Start of annotation."""

    bl_label = "Annotate"
    bl_parent_id = "BEYOND_MOCAP_PT_players"

    def draw(self, context):
        """Draw the button that starts annotation, and one for the strip editor."""
        row = self.layout.row(align=True)
        row.scale_y = 1.3
        row.operator("beyond_mocap.annotate", icon="SYNTAX_ON", text="Annotate by Keys")
        row.operator("beyond_mocap.show_timeline", icon="NLA", text="")


class BEYOND_MOCAP_PT_video(TabPanel, bpy.types.Panel):
    """A movie or image sequence beside the match."""

    bl_label = "Reference Video"
    bl_parent_id = "BEYOND_MOCAP_PT_players"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """Draw the load button, and the video's settings."""
        layout, video = self.layout, context.scene.beyond_mocap.video
        row = layout.row(align=True)
        row.operator("beyond_mocap.load_video", icon="FILE_MOVIE", text=video.clip.name if video.clip else None)
        if video.clip is None:
            return
        row.operator("beyond_mocap.remove_video", text="", icon="X")
        layout.operator("beyond_mocap.show_video", icon="WINDOW")
        column = layout.column(align=True)
        column.use_property_split, column.use_property_decorate = True, False
        row = column.row(align=True)
        row.prop(video, "begins")
        row.operator("beyond_mocap.move_video", text="", icon="TRIA_LEFT").frames = -1
        row.operator("beyond_mocap.move_video", text="", icon="TRIA_RIGHT").frames = 1
        column.prop(video, "rate")
