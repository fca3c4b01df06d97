"""Players: their list with its pins and heading keys, annotation by keys and the reference video."""

from __future__ import annotations

import bpy

from ..scene.core.settings import find_active_player
from .characters import draw_player_character
from .tab import StepPanel, TabPanel, create_value_column, draw_header, draw_paragraph, draw_section, draw_values


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


class BEYOND_MOCAP_PT_players(StepPanel, bpy.types.Panel):
    """Step 2: the players, their tracks and their labels."""

    bl_label = "2  Track & Labels"
    task = "PLAYER"
    rooms = ("player", "track", "timeline", "timeline_labels", "annotate")
    bl_order = 2

    def find_state(self, context):
        """Return "next": the list of players is used all the time."""
        return "next", ""

    def draw_step(self, layout, context):
        """Draw the list of players, and the settings of the active one, closed at first."""
        settings = context.scene.beyond_mocap
        player = find_active_player(settings)
        if player is None:
            draw_sources(layout)
            draw_paragraph(layout, "Import a tracking file, drop one into the view, or draw a track", "INFO")
            return
        draw_players(layout, settings)
        draw_section(layout, "player_add", "Add Player", draw_sources)
        draw_section(layout, "player_active", "Player Settings", lambda opened: draw_player(opened, settings, player))


def draw_sources(layout) -> None:
    """Draw what a player can be made from."""
    row = layout.row()
    row.scale_y = 1.3
    row.operator("beyond_mocap.import_tracking", icon="IMPORT")
    row = layout.row(align=True)
    row.operator("beyond_mocap.draw_track", icon="CURVE_BEZCURVE")
    row.operator("beyond_mocap.track_object", text="From Object", icon="EMPTY_AXIS")


def draw_players(layout, settings) -> None:
    """Draw the list of players."""
    row = layout.row()
    row.template_list("BEYOND_MOCAP_UL_players", "", settings, "players", settings, active_propname="active_player",
                      rows=3)
    row.column(align=True).operator("beyond_mocap.remove_player", text="", icon="REMOVE")


def draw_player(layout, settings, player) -> None:
    """Draw the sections of the active player's settings."""
    layout.label(text=player.name, icon="USER")
    draw_section(layout, "player_files", "Track", lambda opened: draw_files(opened, settings, player), closed=False)
    draw_section(layout, "player_own", "Body & Style", lambda opened: draw_player_settings(opened, player))
    draw_player_character(layout, player)
    draw_pins(layout, player)
    draw_heading_keys(layout, player)


def draw_files(layout, settings, player) -> None:
    """Draw where the active player's track comes from."""
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
    if any(one.dot is None for one in settings.players):
        column.operator("beyond_mocap.place_players", icon="NLA")


class BEYOND_MOCAP_UL_pins(bpy.types.UIList):
    """A player's pins: the part, its time and its duration."""

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property):
        row = layout.row(align=True)
        row.prop(item, "part", text="", emboss=False)
        if item.target is None:
            row.label(text="Missing Empty", icon="ERROR")
            return
        row.prop(item, "time", text="")
        if item.part != "ball":
            row.prop(item, "hold", text="")


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
    """Draw the settings of this player: body, height, foot, style."""
    column = create_value_column(layout)
    names = ("body", "height", "strong_foot", "style", "style_weight", "strength", "masses", "fatigue")
    draw_values(column, player, names, {"height": 1.8})


def draw_pins(layout, player) -> None:
    """Draw the pins of hands, feet, gaze and ball."""
    if body := draw_header(layout, "player_pins", f"Pins: {len(player.pins)}" if player.pins else "Pins"):
        row = body.row()
        row.template_list("BEYOND_MOCAP_UL_pins", "", player, "pins", player, active_propname="active_pin", rows=2)
        row.column(align=True).operator("beyond_mocap.remove_pin", text="", icon="REMOVE")
        row = body.row(align=True)
        row.operator_menu_enum("beyond_mocap.add_pin", "part", text="Pin at Body", icon="PINNED").at = "BODY"
        row.operator_menu_enum("beyond_mocap.add_pin", "part", text="At Cursor", icon="PIVOT_CURSOR").at = "CURSOR"
        ball = body.operator("beyond_mocap.add_pin", text="Pin Ball at Key Moment", icon="MESH_UVSPHERE")
        ball.part, ball.at = "ball", "BODY"


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


class BEYOND_MOCAP_PT_annotate(TabPanel, bpy.types.Panel):
    """The labels of the active player."""

    bl_label = "Labels"
    bl_parent_id = "BEYOND_MOCAP_PT_players"
    task = "PLAYER"

    @classmethod
    def poll(cls, context):
        """Return whether there is a player."""
        return super().poll(context) and bool(context.scene.beyond_mocap.players)

    def draw(self, context):
        """Draw the buttons that annotate, and the files of labels."""
        layout, player = self.layout, find_active_player(context.scene.beyond_mocap)
        row = layout.row(align=True)
        row.scale_y = 1.3
        row.operator("beyond_mocap.annotate", icon="SYNTAX_ON", text="Annotate by Keys")
        row.operator("beyond_mocap.show_timeline", icon="NLA", text="Timeline")
        if player is not None:
            draw_section(layout, "player_words", "Label Files", lambda opened: draw_label_files(opened, player))


def draw_label_files(layout, player) -> None:
    """Draw where the labels are read from."""
    column = create_value_column(layout)
    file = column.column()
    file.active = player.annotation_text is None  # the text has priority
    file.prop(player, "annotation_file")
    column.prop(player, "annotation_text")
    layout.operator("beyond_mocap.read_words", icon="NLA")


class BEYOND_MOCAP_PT_video(TabPanel, bpy.types.Panel):
    """A movie or image sequence beside the match."""

    bl_label = "Reference Video"
    bl_parent_id = "BEYOND_MOCAP_PT_players"
    bl_options = {"DEFAULT_CLOSED"}
    task = "PLAYER"

    def draw(self, context):
        """Draw the load button, and the video's settings."""
        layout, video = self.layout, context.scene.beyond_mocap.video
        row = layout.row(align=True)
        row.operator("beyond_mocap.load_video", icon="FILE_MOVIE", text=video.clip.name if video.clip else None)
        if video.clip is None:
            return
        row.operator("beyond_mocap.remove_video", text="", icon="X")
        layout.operator("beyond_mocap.show_video", icon="WINDOW")
        column = create_value_column(layout)
        row = column.row(align=True)
        row.prop(video, "begins")
        row.operator("beyond_mocap.move_video", text="", icon="TRIA_LEFT").frames = -1
        row.operator("beyond_mocap.move_video", text="", icon="TRIA_RIGHT").frames = 1
        column.prop(video, "rate")
