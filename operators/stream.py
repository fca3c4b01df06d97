"""Live streams: start and stop receiving, play along, choose targets, keep what was received."""

import bpy
from bpy.props import EnumProperty, FloatProperty, IntProperty, StringProperty

from ..beyond_mocap.base.errors import InputError
from ..beyond_mocap.passes.stream import live_hits
from ..scene.core.measure import frames_per_second
from ..scene.passes import generate as make
from ..scene.passes.settings import find_armature
from ..scene.stream import follow, play, streamed_body
from ..scene.stream.settings import add_stream, find_stream, get_key, list_streams
from .operator_base import BackgroundOperator, BaseOperator

NUMBER = {"name": "Number", "default": 1, "min": 1, "options": {"SKIP_SAVE"}, "description": "Number of the stream"}
WHAT = (("ADD", "Add", "Add a stream"), ("REMOVE", "Remove", "Remove a stream"))


class BEYOND_MOCAP_OT_stream_start(BaseOperator, bpy.types.Operator):
    """Receive live motion from a suit's program on this machine, as BVH frames over UDP or TCP, and show it on a
character; nothing is received from other machines, and nothing is sent"""

    bl_idname = "beyond_mocap.stream_start"
    bl_label = "Start Stream"
    bl_options = {"REGISTER"}
    number: IntProperty(**NUMBER)
    needs = ("Every stream is already received: press Stop Stream first",
             lambda context: len(follow.list_received(context.scene)) < len(list_streams(context.scene)))

    def do(self, context):
        """Bind the port and start to listen."""
        follow.start_listening(require_stream(context, self.number))


class ListeningVerb(BaseOperator):
    """An operator for a stream that is received."""

    needs = "No stream is received: press Start Stream first", lambda context: bool(follow.list_received(context.scene))


class BEYOND_MOCAP_OT_stream_stop(ListeningVerb, bpy.types.Operator):
    """Stop receiving and close the port; the streamed character keeps its pose"""

    bl_idname = "beyond_mocap.stream_stop"
    bl_label = "Stop Stream"
    bl_options = {"REGISTER"}
    number: IntProperty(**NUMBER)

    def do(self, context):
        require_listener(context, self.number)
        key = context.scene.session_uid, self.number
        follow.stop_listening(key)
        follow.write_status(key)


class BEYOND_MOCAP_OT_stream_list(BaseOperator, bpy.types.Operator):
    """Add or remove a stream"""

    bl_idname = "beyond_mocap.stream_list"
    bl_label = "Streams"
    what: EnumProperty(name="What", items=WHAT, options={"SKIP_SAVE"}, description="Change to make")
    number: IntProperty(name="Number", default=2, min=2, options={"SKIP_SAVE"}, description="Stream to remove")

    @classmethod
    def description(cls, _context, properties):
        return {"ADD": "Add a stream for another user, on a port of its own",
                "REMOVE": "Stop and remove this stream; its character stays"}[properties.what]

    def do(self, context):
        """Change the list."""
        if self.what == "ADD":
            return add_stream(context.scene)
        follow.stop_listening(get_key(require_stream(context, self.number)))
        further = context.scene.beyond_mocap_stream.further
        further.remove([stream.number for stream in further].index(self.number))


def require_stream(context, number: int):
    """Find a stream of the scene by its number, or raise an InputError."""
    stream = find_stream(context.scene, number)
    if stream is None:
        numbers = ", ".join(str(one.number) for one in list_streams(context.scene))
        raise InputError("stream", f"no number {number}", f"one of {numbers}", "press Add Stream")
    return stream


def require_listener(context, number: int):
    """Find what receives a stream, or raise an InputError."""
    listener = follow.find_listener(context.scene, number)
    if listener is None:
        raise InputError(f"stream {number}", "is not received", "one that is received", "press Start Stream first")
    return listener


class PlayingVerb(BaseOperator):
    """An operator for the rally that is played live."""

    needs = "No rally is being played: press Play Live first", lambda context: play.get_current_rally() is not None


class BEYOND_MOCAP_OT_stream_end(PlayingVerb, bpy.types.Operator):
    """Stop answering strikes; what was played stays and can be played back"""

    bl_idname = "beyond_mocap.stream_end"
    bl_label = "Stop Playing"
    bl_options = {"REGISTER"}

    def do(self, context):
        play.write_rest()
        play.stop_rally()
        status = context.window_manager.beyond_mocap_streaming
        status.playing, status.played = False, ""


class BEYOND_MOCAP_OT_stream_keep(ListeningVerb, bpy.types.Operator):
    """Create a character that plays the last seconds of the stream from the current frame on"""

    bl_idname = "beyond_mocap.stream_keep"
    bl_label = "Keep Recording"
    seconds: FloatProperty(name="Seconds", default=10.0, min=0.1, max=20.0,
                           description="Length of the recording")
    number: IntProperty(**NUMBER)

    def do(self, context):
        """Build a motion from the ring buffer and write it to an action."""
        motion = live_hits.build_recording(require_listener(context, self.number), self.seconds)
        if motion is None:
            raise InputError("stream", "nothing has arrived yet", "frames", "start the sender")
        streamed_body.keep_recording(context, motion)


class BEYOND_MOCAP_OT_stream_play(BackgroundOperator, bpy.types.Operator):
    """Turn each strike of a streamed character into a pass of the player who has the ball, with the most similar
motion of the library, to the player chosen with keys 1 to 9 or a click"""

    bl_idname = "beyond_mocap.stream_play"
    bl_label = "Play Live"
    kind = "live"
    holder: StringProperty(name="Holder", description="Player who has the ball first; empty: the first in the list")
    needs = ("Add players and passes, or choose a sample, under Passing Scene",
             lambda context: len((settings := context.scene.beyond_mocap_passes).players) > 1
             and len(settings.passes) > 0)

    def order(self, context):
        """Collect the order of the scene, the holder of the ball and the rally's time."""
        holder = self.holder or context.scene.beyond_mocap_passes.players[0].name
        follow.check_players(context.scene)
        clock = play.compute_rally_seconds(context.scene), frames_per_second(context.scene)
        return make.build_order(context.scene), holder, clock, follow.find_main_stream(context.scene, holder).part

    @staticmethod
    def run_job(order, progress, cancelled, _hurry):
        from ..scene.stream.new_rally import start_rally

        return start_rally(*order, progress, cancelled)

    def apply(self, scene, result):
        """Apply the rally to characters and ball, and answer strikes from now on."""
        play.apply_rally(scene, result)


class BEYOND_MOCAP_OT_stream_target(PlayingVerb, bpy.types.Operator):
    """Choose this player as receiver of the next pass of Play Live"""

    bl_idname = "beyond_mocap.stream_target"
    bl_label = "Pass To"
    number: IntProperty(name="Number", default=1, min=1, max=99, description="Number of the player in the list, from 1")

    def do(self, context):
        names = [row.name for row in context.scene.beyond_mocap_passes.players]
        if self.number > len(names):
            raise InputError("player", f"number {self.number}", f"1 to {len(names)}")
        if names[self.number - 1] == play.get_current_rally().holder:
            raise InputError("player", f"{names[self.number - 1]} has the ball", "another player")
        context.scene.beyond_mocap_stream.target = names[self.number - 1]


class BEYOND_MOCAP_OT_stream_act(BaseOperator, bpy.types.Operator):
    """Let the player who has the ball repeat the selected armature's strike that is nearest to the current frame"""

    bl_idname = "beyond_mocap.stream_act"
    bl_label = "Do as Selected"
    needs = ("Press Play Live, and select an armature whose motion has a strike",
             lambda context: play.get_current_rally() is not None and find_armature(context) is not None)

    def do(self, context):
        """Find the strike; in a window the answer appears as soon as it is ready."""
        from ..scene.stream.shown_strike import find_shown_strike

        hit = find_shown_strike(context.scene, find_armature(context))
        if bpy.app.background:
            play.answer_now(context.scene, hit)
        else:
            play.store_strike(hit, 0.0)
