"""Settings of the live streams and, for the panel, their status."""

from inspect import get_annotations
from itertools import count

import bpy
from bpy.props import BoolProperty, CollectionProperty, IntProperty, PointerProperty, StringProperty

from ..core.properties import with_settings
from ..passes.settings import rename_calls

OWN = {"number", "port", "body", "player"}
"""Settings in which the streams of a scene differ from each other."""


@with_settings("stream")
class StreamSettings:
    """What every stream has."""

    number: IntProperty(name="Number", default=1, options={"HIDDEN"},
                        description="Number of the stream in its scene; it stays when other streams are removed")
    clip: StringProperty(name="Suit's BVH", subtype="FILE_PATH",
                         description="BVH file of the same suit, needed for streams that send numbers only")
    body: PointerProperty(name="Streamed Body", type=bpy.types.Object,
                          poll=lambda stream, thing: can_follow(stream, thing),
                          description="Armature that follows the user; created if empty")
    player: StringProperty(name="Player", description="Player who repeats this user's strikes in Play Live; leave "
                           "empty for each player who has the ball and no user")


class BeyondMocapFurtherStream(StreamSettings, bpy.types.PropertyGroup):
    """A stream beside the first one."""


@with_settings("stream.play")
class BeyondMocapStream(StreamSettings, bpy.types.PropertyGroup):
    """The first stream of BVH frames from a program on this machine, those beside it, and Play Live."""

    attached_to = ("Scene.beyond_mocap_stream",)

    target: StringProperty(
        name="Target",
        description="Player who receives the next pass in Play Live, also chosen by keys 1 to 9 or a click; "
        "leave empty for the next one in the list, or the next one with a user",
    )
    further: CollectionProperty(type=BeyondMocapFurtherStream, description="Streams beside the first one")


class StreamStatus:
    """How one stream does."""

    scene: IntProperty(description="The stream's scene, by its number in this session")
    number: IntProperty(default=1, description="Number of the stream in its scene")
    on: BoolProperty(description="Whether a stream is being received")
    state: StringProperty(description="Waiting, receiving, stalled, ended, failed or stopped")
    line: StringProperty(description="State of the stream in a sentence")
    figures: StringProperty(description="Figures of the stream")
    hit: StringProperty(description="Last strike that was detected")


class BeyondMocapFurtherStreaming(StreamStatus, bpy.types.PropertyGroup):
    """Status of a stream beside the first one."""


class BeyondMocapStreaming(StreamStatus, bpy.types.PropertyGroup):
    """Status of the streams and of Play Live. It belongs to the session and is not saved."""

    attached_to = ("WindowManager.beyond_mocap_streaming",)

    further: CollectionProperty(type=BeyondMocapFurtherStreaming, description="Status of the streams beside the first")
    playing: BoolProperty(description="Whether the passing scene is being played live")
    played: StringProperty(description="State of the rally that is being played live")


def list_streams(scene: bpy.types.Scene) -> list[StreamSettings]:
    """List the streams of a scene, the first one first."""
    return [scene.beyond_mocap_stream, *scene.beyond_mocap_stream.further]


def find_stream(scene: bpy.types.Scene, number: int) -> StreamSettings | None:
    """Find a stream of a scene by its number; None if the scene has none of that number."""
    return next((stream for stream in list_streams(scene) if stream.number == number), None)


def get_key(stream: StreamSettings) -> tuple[int, int]:
    """What tells a stream from all others in this session: its scene and its number there."""
    return stream.id_data.session_uid, stream.number


def add_stream(scene: bpy.types.Scene) -> None:
    """Add a stream with the lowest number and the lowest port that are free; the rest is as in the first stream."""
    streams, first = list_streams(scene), scene.beyond_mocap_stream
    numbers, ports = {stream.number for stream in streams}, {stream.port for stream in streams}
    stream = first.further.add()
    stream.number = next(number for number in count(2) if number not in numbers)
    stream.port = next(port for port in (*range(first.port + 1, 65536), *range(1024, first.port)) if port not in ports)
    for name in get_annotations(StreamSettings).keys() - OWN:
        setattr(stream, name, getattr(first, name))


def rename_player(scene: bpy.types.Scene, before: str, after: str) -> None:
    """Let the streams of a player follow their new name."""
    for stream in list_streams(scene):
        stream.player = after if stream.player == before else stream.player


rename_calls.append(rename_player)


def can_follow(stream: StreamSettings, thing: bpy.types.Object) -> bool:
    """Whether an object can be chosen as a stream's body: an armature that is no other stream's."""
    others = (one for one in list_streams(stream.id_data) if one.number != stream.number)
    return thing.type == "ARMATURE" and all(one.body != thing for one in others)


def list_statuses() -> list[StreamStatus]:
    """List the status of each stream that has been started in this session, and of the first one."""
    streaming = bpy.context.window_manager.beyond_mocap_streaming
    return [streaming, *streaming.further]


def find_status(key: tuple[int, int]) -> StreamStatus | None:
    """Find the status of a stream by its key; None if it has not been started in this session."""
    return next((status for status in list_statuses() if (status.scene, status.number) == key), None)
