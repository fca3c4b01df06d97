"""Timelines as NLA strips: reading the tracks "Words", "Moments" and "Automatic" of an object.

A span is a strip; a key moment is a pose marker on the action of the long strip in the track "Moments" (or on a span's
own). Whatever Blender's own tools do to them can be read as it is: see `strip_lines`. The object stores the clock for
which its frames were written, so that another frame rate of the scene does not change them.
"""

from collections.abc import Iterator
from typing import NamedTuple

import bpy
from bpy.props import StringProperty

from ...beyond_mocap import annotation
from ...beyond_mocap.base.errors import InputError
from ..core.measure import Clock, round_frame
from .strip_lines import read_key_moment, read_recorded_span, read_span

WORDS, MOMENTS, AUTOMATIC = "Words", "Moments", "Automatic"


class BeyondMocapLanes(bpy.types.PropertyGroup):
    """Data that all label strips of an object share."""

    attached_to = ("Object.beyond_mocap_lanes",)
    clock: StringProperty(name="Clock", description="Start frame, its second and the frames per second of these strips")


class PlacedSpan(NamedTuple):
    """A span and its strip.

    Attributes:
        span: the span.
        track: name of the NLA track.
        strip: name of the strip.
        first: frame of the strip's start.
        last: frame of the strip's end.
        is_muted: muted, so that it is ignored.
        is_automatic: added by the last synthesis and unchanged since.
        is_selected: whether the strip is selected.
    """

    span: "annotation.Span"
    track: str
    strip: str
    first: int
    last: int
    is_muted: bool = False
    is_automatic: bool = False
    is_selected: bool = False


class PlacedMoment(NamedTuple):
    """A key moment and its marker.

    Attributes:
        key: the key moment.
        strip: name of the strip.
        index: of the marker on the strip's action.
        frame: scene frame.
        is_muted: on a muted strip.
        is_selected: whether the marker is selected.
    """

    key: "annotation.KeyMoment"
    strip: str
    index: int
    frame: int
    is_muted: bool = False
    is_selected: bool = False

    @property
    def time(self) -> float:
        """Seconds on the clock."""
        return self.key.time

    @property
    def labels(self) -> tuple[str, ...]:
        """The labels of the moment."""
        return self.key.words


def has_label_tracks(target: bpy.types.Object) -> bool:
    """Return whether the object has label tracks."""
    return bool(target.beyond_mocap_lanes.clock) and target.animation_data is not None


def read_clock(target: bpy.types.Object) -> Clock | None:
    """Read the clock for which the strips were written; None without one."""
    return Clock.from_text(target.beyond_mocap_lanes.clock)


def read_timeline(target: bpy.types.Object, where: str = "") -> "annotation.Timeline | None":
    """Read the timeline of an object's strips.

    Args:
        target: the object.
        where: whose strips, for messages.
    Returns:
        All active spans and key moments; None without label tracks.
    Raises:
        InputError: for a strip or marker whose name cannot be parsed.
    """
    if not has_label_tracks(target):
        return None
    active_spans = [placed.span for placed in list_spans(target, where) if not placed.is_muted
                    and not placed.is_automatic]
    return annotation.Timeline(tuple(active_spans), tuple(placed.key for placed in list_moments(target, where)
                                               if not placed.is_muted))


def list_spans(target: bpy.types.Object, where: str = "") -> list[PlacedSpan]:
    """List all spans by start, also muted and automatic ones.

    An automatic strip that was moved, renamed, unmuted or put on another track counts as an ordinary one. Raises
    InputError as `read_timeline`.
    """
    clock, where = read_clock(target), where or target.name
    found = [read_placed_span(track, strip, clock, where) for track, strip in iter_strips(target)
             if strip.action.beyond_mocap.kind != "moments"]
    return sorted(found, key=lambda placed: (placed.span.start, placed.span.end))


def read_placed_span(track: bpy.types.NlaTrack, strip: bpy.types.NlaStrip, clock: Clock, where: str) -> PlacedSpan:
    """Read the span of one strip. Raises InputError as `read_timeline`."""
    span, is_generated = read_span(strip, clock, where), strip.action.beyond_mocap.kind == "automatic"
    is_unchanged = is_generated and track.name.startswith(AUTOMATIC) and strip.mute and span == read_recorded_span(
        strip.action)
    is_muted = (track.mute or strip.mute) and not is_generated
    frames = round_frame(strip.frame_start), round_frame(strip.frame_end)
    return PlacedSpan(span, track.name, strip.name, *frames, is_muted, is_unchanged, strip.select)


def list_moments(target: bpy.types.Object, where: str = "") -> list[PlacedMoment]:
    """List all key moments by time.

    A marker beyond the ends of its strip is ignored; copies on several strips at the same frame count once. Raises
    InputError as `read_timeline`.
    """
    clock, where, found = read_clock(target), where or target.name, {}
    for track, strip in iter_strips(target):
        for index, marker in enumerate(strip.action.pose_markers):
            if is_marker_visible(strip, marker):
                frame = compute_marker_frame(strip, marker)
                is_muted = track.mute or strip.mute
                placed = PlacedMoment(read_key_moment(marker, frame, clock, where), strip.name, index, frame=frame,
                                      is_muted=is_muted, is_selected=marker.select)
                others = found.setdefault((frame, placed.labels), [])
                if all(other.strip == strip.name for other in others):
                    others.append(placed)
    return sorted((placed for same in found.values() for placed in same), key=lambda placed: placed.key.time)


def find_span(target: bpy.types.Object, seconds: float) -> PlacedSpan | None:
    """Find the active span at a time, else the automatic one there, else None."""
    there = [placed for placed in list_spans(target) if placed.span.start <= seconds < placed.span.end
             and not placed.is_muted]
    return min(there, key=lambda placed: (placed.is_automatic, placed.last - placed.first), default=None)


def iter_strips(target: bpy.types.Object) -> Iterator[tuple[bpy.types.NlaTrack, bpy.types.NlaStrip]]:
    """Iterate over the strips of a timeline with their tracks, also within meta strips."""
    data = target.animation_data
    for track in list(data.nla_tracks) if data else ():
        for strip in [inner for top in track.strips for inner in iter_inner_strips(top)]:
            if strip.action is not None and (strip.action.beyond_mocap.kind != "none" or is_label_track(track)):
                yield track, strip


def iter_inner_strips(strip: bpy.types.NlaStrip) -> Iterator[bpy.types.NlaStrip]:
    """Iterate over the strip itself, or all strips of a meta strip."""
    if strip.type != "META":
        yield strip
    for inner in strip.strips:
        yield from iter_inner_strips(inner)


def is_label_track(track: bpy.types.NlaTrack) -> bool:
    """Return whether strips that a user adds to this track are labels."""
    return track.name == MOMENTS or bool(parse_track_number(track))


def parse_track_number(track: bpy.types.NlaTrack) -> int:
    """Parse the number of a label track: 1 for "Words", 2 for "Words 2"; 0 for any other track."""
    first, _, number = track.name.partition(" ")
    return 0 if first != WORDS else 1 if not number else int(number) if number.isdecimal() else 0


def find_strip(target: bpy.types.Object, name: str) -> bpy.types.NlaStrip:
    """Find the strip of that name. Raises InputError if there is none."""
    found = next((strip for _, strip in iter_strips(target) if strip.name == name), None)
    if found is None:
        raise InputError(target.name, f"has no strip {name!r}", "a strip of this object", "select it again")
    return found


def is_marker_visible(strip: bpy.types.NlaStrip, marker: bpy.types.TimelineMarker) -> bool:
    """Return whether a marker of its action is between a strip's ends."""
    return strip.action_frame_start - 0.5 <= marker.frame <= strip.action_frame_end + 0.5


def compute_marker_frame(strip: bpy.types.NlaStrip, marker: bpy.types.TimelineMarker) -> int:
    """Compute the scene frame at which a strip shows a marker of its action."""
    return round_frame(strip.frame_start + (marker.frame - strip.action_frame_start) * strip.scale)
