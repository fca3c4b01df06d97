"""Nudge Points: the selected control points of a curve go one set step along an axis of the world."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, FloatProperty

from ..beyond_mocap.errors import InputError
from ..scene.measure import units_per_metre
from .verb import Verb

DIRECTIONS = (
    ("LEFT", "Left", "Along -X", "TRIA_LEFT", 0),
    ("RIGHT", "Right", "Along X", "TRIA_RIGHT", 1),
    ("FORTH", "Forth", "Along Y", "TRIA_UP", 2),
    ("BACK", "Back", "Along -Y", "TRIA_DOWN", 3),
    ("UP", "Up", "Along Z", "SORT_DESC", 4),
    ("DOWN", "Down", "Along -Z", "SORT_ASC", 5),
)
AXES = {
    "LEFT": (-1.0, 0.0, 0.0), "RIGHT": (1.0, 0.0, 0.0), "BACK": (0.0, -1.0, 0.0), "FORTH": (0.0, 1.0, 0.0),
    "UP": (0.0, 0.0, 1.0), "DOWN": (0.0, 0.0, -1.0),
}


class BEYOND_MOCAP_OT_nudge_points(Verb, bpy.types.Operator):
    """Move the selected control points or handles by the set step along an axis of the world, whichever way the view
looks"""

    bl_idname = "beyond_mocap.nudge_points"
    bl_label = "Nudge Points"

    direction: EnumProperty(name="Direction", items=DIRECTIONS, default="RIGHT", description="Which way, in the world")
    step: FloatProperty(
        name="Step", default=0.0, min=0.0, precision=3, options={"SKIP_SAVE"},
        description="Metres to move; 0: the step that is set in the panel Path Editing",
    )

    @classmethod
    def poll(cls, context):
        """A curve is in edit mode."""
        cls.poll_message_set("Select a curve and go into edit mode with Tab first")
        return context.mode == "EDIT_CURVE"

    @classmethod
    def description(cls, _context, properties):
        """With the key that does the same."""
        way = next(item[2].lower() for item in DIRECTIONS if item[0] == properties.direction)
        key = {"FORTH": "Up Arrow", "BACK": "Down Arrow", "UP": "Page Up", "DOWN": "Page Down"}
        return (f"Move the selected control points or handles by the step, {way} of the world.\n"
                f"Alt + {key.get(properties.direction) or properties.direction.capitalize() + ' Arrow'}")

    def do(self, context):
        """Blender's own move, since it knows what a handle does to its neighbour."""
        step = (self.step or context.scene.beyond_mocap.nudge_step) * units_per_metre(context.scene)
        moved = bpy.ops.transform.translate(
            "EXEC_DEFAULT", value=[step * part for part in AXES[self.direction]], orient_type="GLOBAL", mirror=False,
            use_proportional_edit=False, snap=False,
        )
        if moved != {"FINISHED"}:
            raise InputError("nudge", "no control point selected", "one or more", "click on a point first")
