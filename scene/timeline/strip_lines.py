"""What one strip or one marker says, as a line of the text form, and the exact line that is kept beside it.

A strip's or marker's name is the words of its line. The line itself is kept in a record (`action.beyond_mocap`,
`marker.beyond_mocap`): as long as an end or a marker stands on the frame that the line asks for, the line's second
counts, else the frame's; as long as the name is the one that was given, the line's words count, else the name's.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import lru_cache

import bpy
from bpy.props import EnumProperty, StringProperty

from ...beyond_mocap.annotation import KeyMoment, Span, Timeline, format_timeline, parse_timeline
from ...beyond_mocap.base.errors import InputError
from ..core.measure import Clock, nearest_frame

NO_WORDS = "(automatic)"  # the name of a span that says nothing: a strip's name cannot be empty
KINDS = (("none", "None", "Nothing of a timeline"),
         ("span", "Span", "A stretch that is asked for"),
         ("automatic", "Automatic", "A stretch that a synthesis put in"),
         ("moments", "Moments", "The lane of key moments"),
         ("moment", "Moment", "A key moment"))
KEPT = 8192  # lines that are remembered as read: all of a match, since strips are read after every edit
_MOST_BLANKS = 24
_NEAR = 1.0 - 1e-3  # frames; what was moved by less still stands where its line says


class BeyondMocapLine(bpy.types.PropertyGroup):
    """What an action or a marker was written for. Times are text: Blender's own numbers are too coarse for them."""

    attached_to = ("Action.beyond_mocap", "TimelineMarker.beyond_mocap")
    kind: EnumProperty(name="Kind", items=KINDS, description="What this stands for in a timeline")
    line: StringProperty(name="Line", description="The exact line of the text form, in seconds")
    shown: StringProperty(name="Shown", description="The name that Blender gave it then; another one means new words")


def frames_of(span: Span, clock: Clock) -> tuple[int, int]:
    """First and last whole frame of a span's strip; at least one frame long, so that it can be seen."""
    first = clock.whole(span.start)
    return first, max(first + 1, clock.whole(span.end))


@lru_cache(maxsize=KEPT)
def line_of(item: Span | KeyMoment) -> str:
    """The line of the text form that says this, exactly."""
    timeline = Timeline((item,)) if isinstance(item, Span) else Timeline((), (item,))
    return format_timeline(timeline).strip()


def words_of(item: Span | KeyMoment) -> str:
    """The words of its line: the name of its strip or marker."""
    return " ".join(line_of(item).split()[2 if isinstance(item, Span) else 1 :]) or NO_WORDS


def span_of(strip: bpy.types.NlaStrip, clock: Clock, where: str) -> Span:
    """The stretch that a strip stands for, whatever was done to it; InputError where its name is not of the form."""
    record = strip.action.beyond_mocap
    first = nearest_frame(strip.frame_start)
    last = max(nearest_frame(strip.frame_end), first + 1)
    start, end = clock.seconds(first), clock.seconds(last)
    kept = recorded_span(strip.action)
    if kept is not None:
        was = frames_of(kept, clock)
        start = kept.start if abs(strip.frame_start - was[0]) < _NEAR else start
        end = kept.end if abs(strip.frame_end - was[1]) < _NEAR else end
    if kept is None or base_name(strip.name) != base_name(record.shown):
        kept = _parsed("0 1", strip.name, f"{where}, strip on frame {first}").spans[0]
    elif (start, end) == (kept.start, kept.end):
        return kept
    return replace(kept, start=start, end=end, line=None)


def key_of(marker: bpy.types.TimelineMarker, frame: int, clock: Clock, where: str) -> KeyMoment:
    """The key moment that a marker shown on scene frame `frame` stands for; InputError as `span_of`."""
    record, kept = marker.beyond_mocap, None
    if record.line:
        kept = _kept(record.line)
    on_time = kept is not None and clock.whole(kept.time) == frame
    time = kept.time if on_time else clock.seconds(frame)
    if kept is None or marker.name != record.shown:
        place = f"{where}, key moment on frame {frame}"
        kept = _parsed("0", marker.name, place).keys[0]
    elif on_time:
        return kept
    return replace(kept, time=time, line=None)


def said(text: str, start: float, end: float | None = None, where: str = "words") -> Span | KeyMoment:
    """The span (or, without an end, the key moment) that typed words say; InputError where they are not of the form."""
    if end is None:
        return replace(_parsed("0", text, where).keys[0], time=start, line=None)
    return replace(_parsed("0 1", text, where).spans[0], start=start, end=end, line=None)


def recorded_span(action: bpy.types.Action) -> Span | None:
    """The span that an action was written for, None where it was not written by us."""
    line = action.beyond_mocap.line
    return _kept(line) if line else None


def remember(strip: bpy.types.NlaStrip, span: Span, kind: str) -> None:
    """Name a strip by its words and keep the exact line with its action."""
    words = words_of(span)
    for blanks in range(_MOST_BLANKS):  # which nobody sees, and Blender adds no number to the name
        strip.name = words + " " * blanks
        if strip.name == words + " " * blanks:
            break
    record = strip.action.beyond_mocap
    record.kind, record.line, record.shown = kind, line_of(span), strip.name


def tell(marker: bpy.types.TimelineMarker, key: KeyMoment, frame: int) -> None:
    """Let a marker say this key moment; frame: on its own action."""
    marker.name, marker.frame = words_of(key), frame
    record = marker.beyond_mocap
    record.kind, record.line, record.shown = "moment", line_of(key), marker.name


def base_name(name: str) -> str:
    """A strip's name without what keeps it apart from others: "running" of "running  " and "running.001"."""
    return re.sub(r"\.\d{3,}$", "", name).rstrip()


@lru_cache(maxsize=KEPT)
def _kept(line: str) -> Span | KeyMoment:
    """What a kept line says."""
    found = parse_timeline(line)
    return replace((*found.spans, *found.keys)[0], line=None)


def _parsed(times: str, name: str, place: str) -> Timeline:
    """What a name says at one time or two; InputError where the text form would read it as something else."""
    words = base_name(name)
    try:
        found = parse_timeline(f"{times} {'' if words == NO_WORDS else words}")
    except InputError:
        found = None
    if found is None or "#" in name or len(found.keys if times == "0" else found.spans) != 1:
        raise InputError(place, f"the words {name.strip()!r}", "words, without numbers and '#'", "write them anew")
    return found
