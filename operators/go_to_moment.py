"""Go to Key Moment: the playhead goes there, and it is picked."""

from __future__ import annotations

import bpy
from bpy.props import IntProperty, StringProperty

from ..beyond_mocap.errors import InputError
from ..scene import lanes, lay_strips
from ..scene.subject import name_of, subject
from .timeline_verb import TimelineVerb


class BEYOND_MOCAP_OT_go_to_moment(TimelineVerb, bpy.types.Operator):
    """Put the playhead on this key moment and pick it"""

    bl_idname = "beyond_mocap.go_to_moment"
    bl_label = "Go to Key Moment"

    strip: StringProperty(name="Strip", options={"SKIP_SAVE"}, description="The strip whose action has the marker")
    index: IntProperty(name="Index", options={"SKIP_SAVE"}, description="Which marker of the action it is")

    def do(self, context):
        """Pick it, and go there."""
        target = subject(context)
        strip = lanes.strip_named(target, self.strip or lanes.MOMENTS)
        markers = strip.action.pose_markers
        if not 0 <= self.index < len(markers):
            raise InputError(name_of(target), f"key moment {self.index} of strip {strip.name!r}", "one that is there",
                             f"it has {len(markers)}")
        lay_strips.pick(target, strip.name, self.index)
        context.scene.frame_set(lanes.marker_frame(strip, markers[self.index]))
