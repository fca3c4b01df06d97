"""Timelines as NLA strips: what an object's lanes "Words", "Moments" and "Automatic" say.

A span is a strip; a key moment is a pose marker on the action of the long strip in the lane "Moments" (or on a span's
own). Whatever is done to them with Blender's own tools can be read as it is: see `strip_lines`. The object keeps the
clock that its frames were written for, so that another frame rate of the scene does not change what they say.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import bpy
from bpy.props import StringProperty

from ...beyond_mocap.annotation import KeyMoment, Span, Timeline
from ...beyond_mocap.base.errors import InputError
from ..core.measure import Clock, nearest_frame
from .strip_lines import key_of, recorded_span, span_of

WORDS, MOMENTS, AUTOMATIC = "Words", "Moments", "Automatic"


class BeyondMocapLanes(bpy.types.PropertyGroup):
    """What an object with annotations knows about all of them."""

    attached_to = ("Object.beyond_mocap_lanes",)
    clock: StringProperty(name="Clock", description="Start frame, seconds there and frames per second of these strips")


@dataclass(frozen=True)
class PlacedSpan:
    """A span and the strip that says it.

    track, strip: names. first, last: frames of the strip's ends. off: muted, so that nobody asks for it. automatic:
    put in by the last synthesis and untouched since."""

    span: Span
    track: str
    strip: str
    first: int
    last: int
    off: bool = False
    automatic: bool = False
    selected: bool = False


@dataclass(frozen=True)
class PlacedMoment:
    """A key moment and the marker that says it: the strip's name, the marker's index on its action, the scene's frame.
    off: on a muted strip."""

    key: KeyMoment
    strip: str
    index: int
    frame: int
    off: bool = False
    selected: bool = False

    @property
    def time(self) -> float:
        """Seconds on the clock."""
        return self.key.time

    @property
    def words(self) -> tuple[str, ...]:
        """What happens."""
        return self.key.words


def has(target: bpy.types.Object) -> bool:
    """Whether the object has lanes."""
    return bool(target.beyond_mocap_lanes.clock) and target.animation_data is not None


def written_for(target: bpy.types.Object) -> Clock | None:
    """The clock whose frames the strips stand on; None where there is none yet."""
    return Clock.read(target.beyond_mocap_lanes.clock)


def read(target: bpy.types.Object, where: str = "") -> Timeline | None:
    """What the strips ask for; None where the object has no lanes.

    where: whose they are, for messages. InputError for a strip or marker whose name is not of the text form."""
    if not has(target):
        return None
    asked = [placed.span for placed in spans(target, where) if not placed.off and not placed.automatic]
    return Timeline(tuple(asked), tuple(placed.key for placed in moments(target, where) if not placed.off))


def spans(target: bpy.types.Object, where: str = "") -> list[PlacedSpan]:
    """All spans by start, those that are off and automatic ones too; InputError as `read`.

    An automatic strip that was moved, renamed, unmuted or put on another lane is asked for from then on."""
    clock, where = written_for(target), where or target.name
    found = [placed_span(track, strip, clock, where) for track, strip in strips(target)
             if strip.action.beyond_mocap.kind != "moments"]
    return sorted(found, key=lambda placed: (placed.span.start, placed.span.end))


def placed_span(track: bpy.types.NlaTrack, strip: bpy.types.NlaStrip, clock: Clock, where: str) -> PlacedSpan:
    """One strip's span; InputError as `read`."""
    span, made = span_of(strip, clock, where), strip.action.beyond_mocap.kind == "automatic"
    untouched = made and track.name.startswith(AUTOMATIC) and strip.mute and span == recorded_span(strip.action)
    off = (track.mute or strip.mute) and not made
    frames = nearest_frame(strip.frame_start), nearest_frame(strip.frame_end)
    return PlacedSpan(span, track.name, strip.name, *frames, off, untouched, strip.select)


def moments(target: bpy.types.Object, where: str = "") -> list[PlacedMoment]:
    """All key moments by time; InputError as `read`.

    A marker beyond the ends of its strip is not seen and does not count; what several strips show on the same frame,
    since one is a copy of the other, counts once."""
    clock, where, found = written_for(target), where or target.name, {}
    for track, strip in strips(target):
        for index, marker in enumerate(strip.action.pose_markers):
            if shows(strip, marker):
                frame = marker_frame(strip, marker)
                off = track.mute or strip.mute
                placed = PlacedMoment(key_of(marker, frame, clock, where), strip.name, index, frame=frame, off=off,
                                      selected=marker.select)
                others = found.setdefault((frame, placed.words), [])
                if all(other.strip == strip.name for other in others):
                    others.append(placed)
    return sorted((placed for same in found.values() for placed in same), key=lambda placed: placed.key.time)


def span_at(target: bpy.types.Object, seconds: float) -> PlacedSpan | None:
    """The span that is asked for at a time, else the automatic one there, else None."""
    there = [placed for placed in spans(target) if placed.span.start <= seconds < placed.span.end and not placed.off]
    return min(there, key=lambda placed: (placed.automatic, placed.last - placed.first), default=None)


def strips(target: bpy.types.Object) -> Iterator[tuple[bpy.types.NlaTrack, bpy.types.NlaStrip]]:
    """Every strip of a timeline with its track, those within meta strips too."""
    data = target.animation_data
    for track in list(data.nla_tracks) if data else ():
        for strip in [inner for top in track.strips for inner in within(top)]:
            if strip.action is not None and (strip.action.beyond_mocap.kind != "none" or is_lane(track)):
                yield track, strip


def within(strip: bpy.types.NlaStrip) -> Iterator[bpy.types.NlaStrip]:
    """The strip itself, or all strips of a meta strip."""
    if strip.type != "META":
        yield strip
    for inner in strip.strips:
        yield from within(inner)


def is_lane(track: bpy.types.NlaTrack) -> bool:
    """Whether what a user puts on this track is meant as words."""
    return track.name == MOMENTS or bool(lane_number(track))


def lane_number(track: bpy.types.NlaTrack) -> int:
    """Which lane of words a track is: 1 for "Words", 2 for "Words 2"; 0 for any other track."""
    first, _, number = track.name.partition(" ")
    return 0 if first != WORDS else 1 if not number else int(number) if number.isdecimal() else 0


def strip_named(target: bpy.types.Object, name: str) -> bpy.types.NlaStrip:
    """The strip of that name; InputError where it is gone."""
    found = next((strip for _, strip in strips(target) if strip.name == name), None)
    if found is None:
        raise InputError(target.name, f"no strip {name!r}", "a strip of this object", "pick it again")
    return found


def shows(strip: bpy.types.NlaStrip, marker: bpy.types.TimelineMarker) -> bool:
    """Whether a marker of its action lies between a strip's ends."""
    return strip.action_frame_start - 0.5 <= marker.frame <= strip.action_frame_end + 0.5


def marker_frame(strip: bpy.types.NlaStrip, marker: bpy.types.TimelineMarker) -> int:
    """The scene frame on which a strip shows a marker of its action."""
    return nearest_frame(strip.frame_start + (marker.frame - strip.action_frame_start) * strip.scale)
