"""Where a stream comes from and what is looked for in it; and, for the panel, how it does."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, PointerProperty, StringProperty

from ..core.properties import with_settings


@with_settings("stream")
class BeyondMocapStream(bpy.types.PropertyGroup):
    """A stream of BVH frames from a program on this machine."""

    attached_to = ("Scene.beyond_mocap_stream",)

    clip: StringProperty(name="Suit's BVH", subtype="FILE_PATH",
                         description="A BVH file of the same suit, for streams that send numbers only; else empty")
    target: StringProperty(
        name="Target",
        description="Who gets the next pass in Play Live; empty: the next one of the list. Keys 1 to 9, or click a "
        "player",
    )
    body: PointerProperty(name="Streamed Body", type=bpy.types.Object, poll=lambda _, thing: thing.type == "ARMATURE",
                          description="The armature that does what the user does; made where it is missing")


class BeyondMocapStreaming(bpy.types.PropertyGroup):
    """How the stream does; of the session, in no file."""

    attached_to = ("WindowManager.beyond_mocap_streaming",)

    on: BoolProperty(description="Whether a stream is listened to")
    state: StringProperty(description="Waiting, receiving, stalled, ended, failed or stopped")
    line: StringProperty(description="The same in a sentence")
    figures: StringProperty(description="Lines 'name: value'")
    hit: StringProperty(description="The last strike that was recognised")
    playing: BoolProperty(description="Whether the passing scene is played live")
    played: StringProperty(description="Lines about the rally that is played live")
