"""Add Pin: a place at which a hand, a foot or the gaze of the active player has to be on this frame."""

from __future__ import annotations

import bpy
import numpy as np

from ..beyond_mocap.errors import InputError
from ..scene import bake, linked, pins
from ..scene.measure import units_per_metre
from ..scene.settings import active_player
from .verb import Verb


class BEYOND_MOCAP_OT_add_pin(Verb, bpy.types.Operator):
    """Add an Empty at which a hand, a foot or the gaze of the active player has to be on the present frame. Move it
with G; time and hold stand in the list of pins"""

    bl_idname = "beyond_mocap.add_pin"
    bl_label = "Add Pin"

    part: bpy.props.EnumProperty(name="Part", items=pins.PARTS, description="What is held")
    at: bpy.props.EnumProperty(
        name="At", items=(("BODY", "Body", "Where the part is now"), ("CURSOR", "3D Cursor", "At the 3D cursor")),
        description="Where the pin is made",
    )
    hold: bpy.props.FloatProperty(
        name="Hold", default=0.0, min=0.0, precision=2, unit="TIME_ABSOLUTE",
        description="Seconds for which it stays there"
    )

    @classmethod
    def poll(cls, context):
        """A player, and object mode."""
        if active_player(context.scene.beyond_mocap) is None:
            cls.poll_message_set("Import tracking or draw a track in step 2 first")
            return False
        cls.poll_message_set("Leave edit mode first (Tab)")
        return context.mode == "OBJECT"

    def do(self, context):
        """Find the place, refuse a second pin of the part at that time, make it."""
        scene, part = context.scene, self.part.replace("_", " ")
        linked.refuse(scene)
        player, seconds = active_player(scene.beyond_mocap), pins.second_now(scene)
        for other in player.pins:
            if other.part == self.part and other.time <= seconds + self.hold and seconds <= other.time + other.hold:
                found, step = f"a pin of {part} at {other.time:.2f} s", "go to another frame, or move that one"
                raise InputError(f"player {player.name}", found, "one place at a time", step)
        if self.at == "BODY":
            place = pins.body_place(context, player, self.part)
        else:
            place = np.array(scene.cursor.location) / units_per_metre(scene)
        pins.add(context, player, self.part, seconds, self.hold, place, bake.collection(scene))
        self.report({"INFO"}, f"{player.name}: {part} pinned at {seconds:.2f} s; move it with G, then Update")
