"""A player's track: drawn as a curve or taken from a moving object, with speeds; pins and heading keys."""

import bpy
import numpy as np

from ..beyond_mocap.base.errors import InputError
from ..beyond_mocap.base.settings.synthesis import MAX_SPEED
from ..beyond_mocap.synthesis import pin as core_pin
from ..scene.core import channels, window
from ..scene.core.measure import units_per_metre
from ..scene.core.settings import find_active_player, is_track
from ..scene.player import dots, drawn_track, heading_keys, pins
from ..scene.result import bake, ball_pins
from .operator_base import BaseOperator
from .player import choose_shirt, find_free_name

SAME = 1e-4  # s by which two times may differ that mean one


class BEYOND_MOCAP_OT_draw_track(BaseOperator, bpy.types.Operator):
    """Add a player whose track is a curve from the 3D cursor; set the speed of its points with Set Speed, or by their
radius (Alt-S): the player waits at points of speed 0"""

    bl_idname = "beyond_mocap.draw_track"
    bl_label = "Draw Track"
    needs = "Leave edit mode first (Tab)", lambda context: context.mode == "OBJECT"

    def do(self, context):
        scene = context.scene
        channels.check_local(scene)
        name = find_free_name("Drawn", {player.name for player in scene.beyond_mocap.players})
        drawn = drawn_track.create_curve(context, f"{name} curve", context.collection)
        add_drawn_player(context, drawn, name)
        window.select_only(context, drawn)
        self.report({"INFO"}, f"{name}: edit the curve (Tab), set the speeds of its points, then press Synthesize")


def add_drawn_player(context, drawn: bpy.types.Object, name: str):
    """Add a player who follows `drawn` to the list, with a dot in the scene."""
    settings = context.scene.beyond_mocap
    player = settings.players.add()
    player.name, player.drawn_track = name, drawn
    player.shirt = choose_shirt(len(settings.players) - 1)
    settings.active_player = len(settings.players) - 1
    dots.ensure_dot(context, player)
    return player


class BEYOND_MOCAP_OT_track_object(BaseOperator, bpy.types.Operator):
    """Use the active object as a track of a new or the active player: a curve with speeds at its points, or any object
that moves by keys or constraints (an Empty, a mesh, another armature's hips)"""

    bl_idname = "beyond_mocap.track_object"
    bl_label = "Track from Object"
    for_active: bpy.props.BoolProperty(name="Active Player",
                                       description="Use it for the active player instead of adding one",
                                       options={"SKIP_SAVE"})
    needs = ("Choose a curve or a moving object first",
             lambda context: context.object is not None and is_track(None, context.object))

    def do(self, context):
        """Read the track first, so that errors are reported, then use it."""
        scene, chosen = context.scene, context.object
        channels.check_local(scene)
        player = find_active_player(scene.beyond_mocap)
        if self.for_active and player is None:
            raise InputError("players", "no player in the list", "a player", "switch Active Player off to add one")
        track = drawn_track.read_drawn_track(scene, chosen)
        if self.for_active:
            player.drawn_track = chosen
        else:
            names = {player.name for player in scene.beyond_mocap.players}
            player = add_drawn_player(context, chosen, find_free_name(chosen.name, names))
        seconds = track.times[-1] - track.times[0]
        self.report({"INFO"}, f"{player.name}: {seconds:.1f} s along {chosen.name}")


class BEYOND_MOCAP_OT_set_speed(BaseOperator, bpy.types.Operator):
    """Set the speed in metres per second at the selected points of the active curve, or at all points outside Edit
Mode; the player waits at points of speed 0"""

    bl_idname = "beyond_mocap.set_speed"
    bl_label = "Set Speed"
    speed: bpy.props.FloatProperty(name="Speed", default=3.0, min=0.0, max=MAX_SPEED, precision=2,
                                   description="Metres per second; 0 for a stop")
    wait: bpy.props.FloatProperty(name="Wait", default=1.0, min=0.01, max=60.0, precision=2, unit="TIME_ABSOLUTE",
                                  description="Seconds of waiting at a stop")
    needs = "Choose a drawn curve first", lambda context: context.object is not None and context.object.type == "CURVE"

    def invoke(self, context, _event):
        points = list_selected_points(context.object)
        if points:
            self.speed, self.wait = min(points[0].radius, MAX_SPEED), points[0].weight_softbody
        return context.window_manager.invoke_props_dialog(self)

    def do(self, context):
        drawn = context.object
        channels.check_local(drawn, drawn.data)
        points = list_selected_points(drawn)
        if not points:
            raise InputError(f"curve {drawn.name}", "no point selected", "one or more", "select points in edit mode")
        drawn_track.set_speed(points, self.speed, self.wait)
        drawn.data.update_tag()
        self.report({"INFO"}, f"Points set: {len(points)}")


def list_selected_points(drawn: bpy.types.Object) -> list:
    """List the selected control points of a curve in edit mode, all of them otherwise."""
    points = [point for spline in drawn.data.splines for point in drawn_track.list_points(spline)]
    if drawn.mode != "EDIT":
        return points
    return [point for point in points if getattr(point, "select_control_point", getattr(point, "select", False))]


class BEYOND_MOCAP_OT_add_pin(BaseOperator, bpy.types.Operator):
    """Add an Empty at which a hand, a foot or the gaze of the active player has to be on the current frame, or the ball
at the nearest key moment; move it with G, and set time and hold in the list of pins"""

    bl_idname = "beyond_mocap.add_pin"
    bl_label = "Add Pin"
    part: bpy.props.EnumProperty(name="Part", items=pins.PARTS, description="Part of the body to pin")
    at: bpy.props.EnumProperty(
        name="At", items=(("BODY", "Body", "Current position of the part"), ("CURSOR", "3D Cursor", "3D cursor")),
        description="Position of the new pin",
    )
    hold: bpy.props.FloatProperty(name="Hold", default=0.0, min=0.0, precision=2, unit="TIME_ABSOLUTE",
                                  description="Seconds for which the part stays there")
    needs = ("Import tracking or draw a track in step 2 first",
             lambda context: find_active_player(context.scene.beyond_mocap) is not None,
             "Leave edit mode first (Tab)", lambda context: context.mode == "OBJECT")

    def do(self, context):
        """Find the position, check for another pin of the part at that time, add the pin."""
        scene, part = context.scene, self.part.replace("_", " ")
        channels.check_local(scene)
        player, now, hold = find_active_player(scene.beyond_mocap), pins.find_current_second(scene), self.hold
        moment = ball_pins.find_ball_moment(scene, player, now) if part == core_pin.BALL else None
        seconds, hold = (now, hold) if moment is None else (moment.time, 0.0)
        for other in player.pins:
            first, last = other.time - SAME, other.time + other.hold + SAME
            if other.part == self.part and first <= seconds + hold and seconds <= last:
                found, step = f"a pin of {part} at {other.time:.2f} s", "go to another frame or move that pin"
                raise InputError(f"player {player.name}", found, "one position at a time", step)
        if self.at == "CURSOR":
            place = np.array(scene.cursor.location) / units_per_metre(scene)
        else:
            place = pins.find_part_position(context, player, self.part) if moment is None else moment.place
        if moment is not None:
            scene.frame_set(round(bake.compute_frame(scene, moment.second)))
        pins.add_pin(context, player, self.part, seconds=seconds, hold=hold, place=place,
                     collection=bake.find_or_create_collection(scene))
        self.report({"INFO"}, f"{player.name}: {part} pinned at {seconds:.2f} s; move it with G, then press Update")


class BEYOND_MOCAP_OT_remove_pin(BaseOperator, bpy.types.Operator):
    """Remove the active pin in the list with its Empty"""

    bl_idname = "beyond_mocap.remove_pin"
    bl_label = "Remove Pin"
    needs = ("The active player has no pins",
             lambda context: (player := find_active_player(context.scene.beyond_mocap)) is not None and len(player.pins)
             > 0)

    def do(self, context):
        """Remove the pin and choose the next one."""
        channels.check_local(context.scene)
        player = find_active_player(context.scene.beyond_mocap)
        pins.remove_pin(player, min(player.active_pin, len(player.pins) - 1))


class BEYOND_MOCAP_OT_add_heading_key(BaseOperator, bpy.types.Operator):
    """Let the body of the active player face a direction or an object from the current frame on"""

    bl_idname = "beyond_mocap.add_heading_key"
    bl_label = "Add Heading Key"
    faces: bpy.props.EnumProperty(
        name="Faces", description="What the body faces",
        items=(("DIRECTION", "Direction", "The X axis of the selected Empty or, without one, of the player's dot"),
               ("OBJECT", "Object", "The active object: it may move, and may be another player's dot or body")))
    heading: bpy.props.FloatProperty(name="Direction", subtype="ANGLE", options={"SKIP_SAVE"},
                                     description="Direction, counterclockwise from the world's X axis")
    hold: bpy.props.FloatProperty(name="Hold", default=1.0, min=0.0, precision=2, unit="TIME_ABSOLUTE",
                                  description="Seconds for which the body faces it")
    needs = ("Import tracking or draw a track in step 2 first",
             lambda context: find_active_player(context.scene.beyond_mocap) is not None)

    def do(self, context):
        """Find what to face, check for another key at that time, add the key."""
        scene = context.scene
        channels.check_local(scene)
        player, seconds = find_active_player(scene.beyond_mocap), pins.find_current_second(scene)
        for other in player.heading_keys:
            if other.time <= seconds + self.hold and seconds <= other.time + other.hold:
                found, step = f"a heading key at {other.time:.2f} s", "go to another frame or shorten that key's hold"
                raise InputError(f"player {player.name}", found, "one heading at a time", step)
        target = find_faced_object(context, player) if self.faces == "OBJECT" else None
        if target is None and not self.properties.is_property_set("heading"):
            self.heading = heading_keys.measure_heading(find_turned_object(context, player))
        heading_keys.add_heading_key(player, seconds, self.hold, self.heading, target)
        what = f"{np.degrees(self.heading):.0f}°" if target is None else target.name
        self.report({"INFO"}, f"{player.name} faces {what} at {seconds:.2f} s; press Update")


def find_turned_object(context, player) -> bpy.types.Object:
    """Find the object whose rotation is the direction: the selected Empty, else the player's dot."""
    chosen = context.object
    if chosen is not None and chosen.type == "EMPTY" and chosen.select_get():
        return chosen
    if player.dot is None:
        raise InputError(f"player {player.name}", "no dot and no Empty selected", "an object that has the direction",
                         "press Add to Timeline, or select an Empty")
    return player.dot


def find_faced_object(context, player) -> bpy.types.Object:
    """Find the object to face: the active one, if it is not the player's own."""
    chosen = context.object
    if chosen is None or not chosen.select_get() or chosen in (player.dot, player.body):
        found = "no object selected" if chosen is None or not chosen.select_get() else f"{chosen.name}, their own"
        raise InputError(f"player {player.name}", found, "the object to face", "select another object")
    return chosen


class BEYOND_MOCAP_OT_remove_heading_key(BaseOperator, bpy.types.Operator):
    """Remove the active heading key in the list; its object stays"""

    bl_idname = "beyond_mocap.remove_heading_key"
    bl_label = "Remove Heading Key"
    needs = ("The active player has no heading keys",
             lambda context: (player := find_active_player(context.scene.beyond_mocap)) is not None
             and len(player.heading_keys) > 0)

    def do(self, context):
        """Remove the key and choose the next one."""
        channels.check_local(context.scene)
        player = find_active_player(context.scene.beyond_mocap)
        heading_keys.remove_heading_key(player, min(player.active_heading_key, len(player.heading_keys) - 1))
