"""Heading keys in the scene: a direction or an object that a player's body has to face, with its time and hold."""

import math

import bpy
from bpy.props import EnumProperty, FloatProperty, PointerProperty

FACES = (("DIRECTION", "Direction", "Face a direction"), ("OBJECT", "Object", "Face an object, also while it moves"))


class BeyondMocapHeadingKey(bpy.types.PropertyGroup):
    """One heading key of a player"""

    faces: EnumProperty(name="Faces", items=FACES, description="What the body faces")
    heading: FloatProperty(name="Direction", subtype="ANGLE",
                           description="Direction that the body faces, counterclockwise from the world's X axis")
    target: PointerProperty(name="Object", type=bpy.types.Object, description="The object that the body faces")
    time: FloatProperty(name="Time", unit="TIME_ABSOLUTE", precision=2,
                        description="Time on the track's clock from which on the body faces it")
    hold: FloatProperty(name="Hold", min=0.0, soft_max=10.0, unit="TIME_ABSOLUTE", precision=2,
                        description="Duration for which the body faces it; 0 for a moment")

    def find_target(self) -> bpy.types.Object | None:
        """Find the object that the body faces; None where it has been deleted."""
        return self.target if self.target is not None and self.target.name in self.id_data.objects else None


def add_heading_key(player, seconds: float, hold: float, heading: float = 0.0,
                    target: bpy.types.Object | None = None) -> BeyondMocapHeadingKey:
    """Add a heading key towards `target`, or without one along `heading` (rad), and make it active in the list."""
    key = player.heading_keys.add()
    key.faces = "DIRECTION" if target is None else "OBJECT"
    key.heading, key.target, key.time, key.hold = heading, target, seconds, hold
    player.active_heading_key = len(player.heading_keys) - 1
    player.id_data.update_tag()  # Blender reports no change of properties by a script, and Live waits for one
    return key


def remove_heading_key(player, number: int) -> None:
    """Remove a heading key; its object stays."""
    player.heading_keys.remove(number)
    player.active_heading_key = max(0, min(player.active_heading_key, len(player.heading_keys) - 1))
    player.id_data.update_tag()


def measure_heading(turned: bpy.types.Object) -> float:
    """Measure where an object's X axis points on the ground, rad from the world's X axis, on the current frame."""
    ahead = turned.matrix_world.col[0]
    return math.atan2(ahead.y, ahead.x)
