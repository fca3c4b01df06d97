"""Hit Analysis: where in an armature's motion a ball can be struck."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..beyond_mocap.base.settings.choices import PARTS, SIDES
from ..beyond_mocap.errors import InputError
from ..scene import channels, linked
from ..scene.passes import hits_shown
from ..scene.passes.settings import found_of, subject
from .verb import Verb


class HitVerb(Verb):
    """A verb about an armature's strikes."""

    @classmethod
    def poll(cls, context):
        """An armature."""
        cls.poll_message_set("Select an armature with a motion")
        return subject(context) is not None


class BEYOND_MOCAP_OT_hit_analysis(HitVerb, bpy.types.Operator):
    """Find where the armature's foot, head, chest, hand or any bone can strike a ball: height and speed as a graph in
the panel, and markers on its action. A ball was never seen: the marked frame is the likeliest one"""

    bl_idname = "beyond_mocap.hit_analysis"
    bl_label = "Hit Analysis"

    part: EnumProperty(name="Part", items=PARTS, default="foot", description="The part whose strikes are looked for")
    side: EnumProperty(name="Side", items=SIDES, default="right", description="Left or right, of what there are two")
    threshold: FloatProperty(
        name="Threshold", default=0.0, min=0.0, max=5.0, precision=2,
        description="Metres above which a strike may be; 0: automatic",
    )
    bone: StringProperty(name="Bone", description="A bone by name, in place of the part")
    markers: BoolProperty(name="Markers", default=True, description="Set markers on the action")

    def invoke(self, context, _event):
        """With the choices of the panel."""
        hits = subject(context).beyond_mocap_hits
        self.part, self.side, self.threshold, self.bone = hits.part, hits.side, hits.threshold, hits.bone
        return self.execute(context)

    def do(self, context):
        """Analyse, note, mark."""
        body = subject(context)
        found = hits_shown.analyse(
            context.scene, body, self.part, self.side, self.threshold, self.bone, self.markers
        )
        count = len(found.motions)
        what = self.bone or self.part
        if not count:
            self.report({"WARNING"}, f"{body.name}: no strike of the {what} found; try the other side, or a threshold")
            return
        self.report({"INFO"}, f"{body.name}: {count} {'strike' if count == 1 else 'strikes'} of the {what}, "
                    f"above {found.threshold:.2f} m")


class BEYOND_MOCAP_OT_go_to_strike(Verb, bpy.types.Operator):
    """Go to the frame of this strike"""

    bl_idname = "beyond_mocap.go_to_strike"
    bl_label = "Go to Strike"

    frame: IntProperty(name="Frame", options={"SKIP_SAVE"}, description="Scene frame to go to")

    def do(self, context):
        """Set the frame."""
        context.scene.frame_set(self.frame)


class BEYOND_MOCAP_OT_clear_hits(HitVerb, bpy.types.Operator):
    """Forget the hit analysis of this armature, and take its markers away"""

    bl_idname = "beyond_mocap.clear_hits"
    bl_label = "Clear Hit Analysis"

    def do(self, context):
        """Markers and figures."""
        body = subject(context)
        linked.refuse(body)
        if not found_of(body.beyond_mocap_hits):
            raise InputError(f"armature {body.name}", "no hit analysis", "one", "press Hit Analysis")
        played = channels.playing(body)[0]
        if played is not None and played.library is None:
            hits_shown.unmark(played)
        body.beyond_mocap_hits.property_unset("found")
        body.beyond_mocap_hits.property_unset("lines")
