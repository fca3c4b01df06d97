"""Keep Apart: riders that would run into each other wait a little or go round."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, FloatProperty

from ..scene.ride import keep_apart
from ..scene.ride.settings import meant, riders
from .verb import Verb


class BEYOND_MOCAP_OT_path_apart(Verb, bpy.types.Operator):
    """Find where riders would run into each other or another body, and let them wait a little or make a small detour,
as little as it takes. Of two or more selected riders only those give way; otherwise all do"""

    bl_idname = "beyond_mocap.path_apart"
    bl_label = "Keep Apart"

    distance: FloatProperty(
        name="Distance", default=0.6, min=0.05, max=20.0, soft_max=2.0, precision=2,
        description="Metres between the middles of two bodies at least",
    )
    delay: FloatProperty(
        name="Longest Wait", default=2.0, min=0.0, max=60.0, soft_max=10.0, precision=2, unit="TIME_ABSOLUTE",
        description="Seconds that a rider may begin later",
    )
    detour: FloatProperty(
        name="Widest Detour", default=0.8, min=0.0, max=20.0, soft_max=3.0, precision=2,
        description="Metres that a rider may leave its path to the side",
    )
    clear: BoolProperty(name="Clear", description="Only take back the waits and detours of before")

    @classmethod
    def poll(cls, context):
        """A rider."""
        cls.poll_message_set("Let an armature ride a path first (Edit Path)")
        return bool(riders(context.scene))

    def do(self, context):
        """Find out, then ask."""
        from ..beyond_mocap.polish.apart import Limits
        from ..beyond_mocap.polish.follower import Change

        bodies = meant(context)
        bodies = bodies if len(bodies) > 1 else riders(context.scene)
        if self.clear:
            keep_apart.lay(context.scene, bodies, [Change()] * len(bodies))
            return
        kept = keep_apart.worked_out(context, bodies, Limits(self.distance, delay=self.delay, detour=self.detour))
        keep_apart.lay(context.scene, bodies, kept.changes)
        self.tell(kept)

    def tell(self, kept):
        """What was found and what was asked for."""
        if not kept.before and not kept.left:
            self.report({"INFO"}, f"Nobody comes within {self.distance:.2f} m of another")
            return
        found = "1 collision" if kept.before == 1 else f"{kept.before} collisions"
        lines = "; ".join([found, *keep_apart.lines_of(kept)])
        self.report({"WARNING"} if kept.left else {"INFO"}, lines)
