"""Live streams: start and stop receiving, play along, choose targets, keep what was received."""

from __future__ import annotations

import bpy
from bpy.props import FloatProperty, IntProperty, StringProperty

from ..beyond_mocap.base.errors import InputError
from ..beyond_mocap.passes.stream.live_hits import recorded
from ..scene.passes import make
from ..scene.passes.settings import subject
from ..scene.stream import follow, play
from .verb import BackgroundVerb, Verb


class BEYOND_MOCAP_OT_stream_start(Verb, bpy.types.Operator):
    """Receive motion live from a suit's program on this machine, as BVH frames over UDP or TCP; a body shows it.
Nothing from other machines gets in, and nothing is sent"""

    bl_idname = "beyond_mocap.stream_start"
    bl_label = "Start Stream"
    bl_options = {"REGISTER"}
    needs = ("A stream is listened to already: press Stop Stream first",
             lambda context: follow.current_listener() is None)

    def do(self, context):
        """Bind the port and begin to listen."""
        follow.start_listening(context.scene.beyond_mocap_stream)
        follow.began()


class ListeningVerb(Verb):
    """A verb about the stream that is received."""

    needs = ("No stream is listened to: press Start Stream first",
             lambda context: follow.current_listener() is not None)


class BEYOND_MOCAP_OT_stream_stop(ListeningVerb, bpy.types.Operator):
    """Stop listening and close the port; the streamed body stays as it stands"""

    bl_idname = "beyond_mocap.stream_stop"
    bl_label = "Stop Stream"
    bl_options = {"REGISTER"}

    def do(self, context):
        follow.stop_listening()
        follow.tell()


class PlayingVerb(Verb):
    """A verb about what is played live."""

    needs = "Nothing is played live: press Play Live first", lambda context: play.rally() is not None


class BEYOND_MOCAP_OT_stream_end(PlayingVerb, bpy.types.Operator):
    """Answer no more strikes; what was played stays as it is and can be played back"""

    bl_idname = "beyond_mocap.stream_end"
    bl_label = "Stop Playing"
    bl_options = {"REGISTER"}

    def do(self, context):
        play.stop()
        told = context.window_manager.beyond_mocap_streaming
        told.playing, told.played = False, ""


class BEYOND_MOCAP_OT_stream_keep(ListeningVerb, bpy.types.Operator):
    """Make a body that plays the last seconds of the stream, from the present frame on"""

    bl_idname = "beyond_mocap.stream_keep"
    bl_label = "Keep Recording"
    seconds: FloatProperty(name="Seconds", default=10.0, min=0.1, max=20.0,
                           description="How much of what has just been seen is kept")

    def do(self, context):
        """Read the ring, write an action."""
        motion = recorded(follow.current_listener(), self.seconds)
        if motion is None:
            raise InputError("stream", "nothing has arrived yet", "frames", "start the sender")
        follow.keep_recording(context, motion)


class BEYOND_MOCAP_OT_stream_play(BackgroundVerb, bpy.types.Operator):
    """Let who has the ball do what you do: each strike of the streamed body becomes a pass of the passing scene.
The library's most alike motion is played, to whom you choose by the keys 1 to 9 or by a click;
the scene plays on meanwhile"""

    bl_idname = "beyond_mocap.stream_play"
    bl_label = "Play Live"
    kind = "live"
    holder: StringProperty(name="Holder", description="Who has the ball first; empty: the first one of the list")
    needs = ("Add players and passes, or take a sample, under Passing Scene",
             lambda context: len((settings := context.scene.beyond_mocap_passes).players) > 1
             and len(settings.passes) > 0)

    def order(self, context):
        """The passing scene, and who has the ball."""
        settings = context.scene.beyond_mocap_passes
        return make.order_of(context.scene), self.holder or settings.players[0].name, play.seconds(context.scene)

    @staticmethod
    def work(order, progress, cancelled, _hurry):
        return play.begin(*order, progress, cancelled)

    def apply(self, scene, result):
        """Bodies and ball; from now on strikes are answered."""
        play.show(scene, result)


class BEYOND_MOCAP_OT_stream_target(PlayingVerb, bpy.types.Operator):
    """Let the next pass of Play Live go to this player"""

    bl_idname = "beyond_mocap.stream_target"
    bl_label = "Pass To"
    number: IntProperty(name="Number", default=1, min=1, max=99, description="Of the player in the list, from 1")

    def do(self, context):
        names = [row.name for row in context.scene.beyond_mocap_passes.players]
        if self.number > len(names):
            raise InputError("player", f"number {self.number}", f"1 to {len(names)}")
        if names[self.number - 1] == play.rally().holder:
            raise InputError("player", f"{names[self.number - 1]} has the ball", "another one")
        context.scene.beyond_mocap_stream.target = names[self.number - 1]


class BEYOND_MOCAP_OT_stream_act(Verb, bpy.types.Operator):
    """Let who has the ball do what the selected armature does: its strike nearest to the present frame is the example,
as if you had just done it yourself"""

    bl_idname = "beyond_mocap.stream_act"
    bl_label = "Do as Selected"
    needs = ("Press Play Live, and select an armature whose motion has a strike",
             lambda context: play.rally() is not None and subject(context) is not None)

    def do(self, context):
        """Find the strike; in a window the answer comes as soon as it is worked out."""
        hit = play.shown_by(context.scene, subject(context))
        if bpy.app.background:
            play.answer_now(context.scene, hit)
        else:
            play.struck(context.scene, hit, 0.0)
