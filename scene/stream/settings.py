"""Where a stream comes from and what is looked for in it; and, for the panel, how it does."""

from __future__ import annotations

import bpy
from bpy.props import (
    BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty,
)

from ..passes.settings import EITHER, PARTS

PROTOCOLS = (
    ("udp", "UDP", "Frames come as datagrams"),
    ("tcp", "TCP", "Who sends connects to this port"),
    ("call", "TCP, Call", "Who sends waits on this port, as Axis Neuron and Axis Studio do"),
)


class BeyondMocapStream(bpy.types.PropertyGroup):
    """A stream of BVH frames from a program on this machine."""

    attached_to = ("Scene.beyond_mocap_stream",)

    protocol: EnumProperty(name="Protocol", items=PROTOCOLS, default="udp", description="How frames come")
    port: IntProperty(
        name="Port", default=7001, min=1024, max=65535, description="Of this machine; nothing from outside gets in"
    )
    clip: StringProperty(
        name="Suit's BVH", subtype="FILE_PATH",
        description="A BVH file of the same suit, for streams that send numbers only; else empty",
    )
    unit: FloatProperty(
        name="Unit", default=0.0, min=0.0, max=10.0, precision=4,
        description="Metres in one unit of the stream; 0: guessed from the body's size",
    )
    part: EnumProperty(name="Part", items=PARTS, default="foot", description="What the user strikes with")
    side: EnumProperty(name="Side", items=EITHER, default="either", description="Of what there are two")
    threshold: FloatProperty(
        name="Threshold", default=0.0, min=0.0, max=5.0, precision=2,
        description="Metres above the ground that the part has to rise in a strike; 0: automatic",
    )
    target: StringProperty(
        name="Target",
        description="Who gets the next pass in Play Live; empty: the next one of the list. Keys 1 to 9, or click a "
        "player",
    )
    bounces: IntProperty(name="Bounces", default=0, min=0, max=5, description="Of the ball on its way in Play Live")
    body: PointerProperty(
        name="Streamed Body", type=bpy.types.Object, poll=lambda _own, thing: thing.type == "ARMATURE",
        description="The armature that does what the user does; made where it is missing",
    )


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
