"""Settings of the live stream and, for the panel, its status."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, PointerProperty, StringProperty

from ..core.properties import with_settings


@with_settings("stream")
class BeyondMocapStream(bpy.types.PropertyGroup):
    """A stream of BVH frames from a program on this machine."""

    attached_to = ("Scene.beyond_mocap_stream",)

    clip: StringProperty(name="Suit's BVH", subtype="FILE_PATH",
                         description="BVH file of the same suit, needed for streams that send numbers only")
    target: StringProperty(
        name="Target",
        description="Player who receives the next pass in Play Live, also chosen by keys 1 to 9 or a click; "
        "leave empty for the next one in the list",
    )
    body: PointerProperty(name="Streamed Body", type=bpy.types.Object, poll=lambda _, thing: thing.type == "ARMATURE",
                          description="Armature that follows the user; created if empty")


class BeyondMocapStreaming(bpy.types.PropertyGroup):
    """Status of the stream. It belongs to the session and is not saved."""

    attached_to = ("WindowManager.beyond_mocap_streaming",)

    on: BoolProperty(description="Whether a stream is being received")
    state: StringProperty(description="Waiting, receiving, stalled, ended, failed or stopped")
    line: StringProperty(description="State of the stream in a sentence")
    figures: StringProperty(description="Figures of the stream")
    hit: StringProperty(description="Last strike that was detected")
    playing: BoolProperty(description="Whether the passing scene is being played live")
    played: StringProperty(description="State of the rally that is being played live")
