"""Move Key Moment: the picked one, to the playhead or by frames."""

from __future__ import annotations

from dataclasses import replace

import bpy
from bpy.props import IntProperty

from ..scene import lanes, lay_strips
from ..scene.subject import subject
from .timeline_verb import MomentVerb, picked, playhead


class BEYOND_MOCAP_OT_move_moment(MomentVerb, bpy.types.Operator):
    """Move the picked key moment to the playhead"""

    bl_idname = "beyond_mocap.move_moment"
    bl_label = "Move Key Moment"

    frames: IntProperty(name="Frames", options={"SKIP_SAVE"}, description="By how many frames; 0 moves to the playhead")

    def do(self, context):
        """Put its marker there."""
        target = subject(context)
        moment, clock = picked(target), lanes.written_for(target)
        time = clock.seconds(moment.frame + self.frames) if self.frames else playhead(context, target)
        lay_strips.change_moment(target, moment.strip, moment.index, replace(moment.key, time=time))
