"""The label line of one strip or marker, and the exact line that is stored beside it.

The name of a strip or marker is its labels. The line itself is stored in a record (`action.beyond_mocap`,
`marker.beyond_mocap`): while an end or a marker is on the frame of that line, the line's exact second counts, else that
of the frame; while the name is the stored one, the line's labels count, else those of the name.
"""

import re
from dataclasses import replace
from functools import lru_cache

import bpy
from bpy.props import EnumProperty, StringProperty

from ...beyond_mocap import annotation
from ...beyond_mocap.base.errors import InputError
from ..core.measure import Clock, round_frame

NO_LABELS = "(automatic)"  # the name of a span without labels: a strip's name cannot be empty
KINDS = (("none", "None", "Not part of a timeline"),
         ("span", "Span", "A span with labels"),
         ("automatic", "Automatic", "A span added by a synthesis"),
         ("moments", "Moments", "The NLA track of key moments"),
         ("moment", "Moment", "A key moment"))
CACHE_SIZE = 8192  # lines in the cache: all of a match, since strips are read after every edit
_MOST_BLANKS = 24  # blanks added to a strip's name to make it unique
_NEAR = 1.0 - 1e-3  # frames; after a smaller move the time of the line still holds


class BeyondMocapLine(bpy.types.PropertyGroup):
    """The stored line of an action or marker. Times are text, since Blender's floats are too coarse for them."""

    attached_to = ("Action.beyond_mocap", "TimelineMarker.beyond_mocap")
    kind: EnumProperty(name="Kind", items=KINDS, description="Role of this item in a timeline")
    line: StringProperty(name="Line", description="The exact line of the text form, in seconds")
    shown: StringProperty(name="Shown", description="Its name when it was written; another name means new labels")


def compute_frames(span: "annotation.Span", clock: Clock) -> tuple[int, int]:
    """Compute the first and last whole frame of a span's strip; at least one frame long, so that it is visible."""
    first = clock.to_whole_frame(span.start)
    return first, max(first + 1, clock.to_whole_frame(span.end))


@lru_cache(maxsize=CACHE_SIZE)
def format_line(item: "annotation.Span | annotation.KeyMoment") -> str:
    """Format a span or key moment as a line of the text form, exactly."""
    timeline = annotation.Timeline((item,)) if isinstance(item, annotation.Span) else annotation.Timeline((), (item,))
    return annotation.format_timeline(timeline).strip()


def format_labels(item: "annotation.Span | annotation.KeyMoment") -> str:
    """Format the labels of a span or key moment: the name of its strip or marker."""
    return " ".join(format_line(item).split()[2 if isinstance(item, annotation.Span) else 1 :]) or NO_LABELS


def read_span(strip: bpy.types.NlaStrip, clock: Clock, where: str) -> "annotation.Span":
    """Read the span of a strip in its present state. Raises InputError if its name cannot be parsed."""
    record = strip.action.beyond_mocap
    first = round_frame(strip.frame_start)
    last = max(round_frame(strip.frame_end), first + 1)
    start, end = clock.to_seconds(first), clock.to_seconds(last)
    recorded = read_recorded_span(strip.action)
    if recorded is not None:
        recorded_frames = compute_frames(recorded, clock)
        start = recorded.start if abs(strip.frame_start - recorded_frames[0]) < _NEAR else start
        end = recorded.end if abs(strip.frame_end - recorded_frames[1]) < _NEAR else end
    if recorded is None or remove_name_suffix(strip.name) != remove_name_suffix(record.shown):
        recorded = _parse_name("0 1", strip.name, f"{where}, strip on frame {first}").spans[0]
    elif (start, end) == (recorded.start, recorded.end):
        return recorded
    return replace(recorded, start=start, end=end, line=None)


def read_key_moment(marker: bpy.types.TimelineMarker, frame: int, clock: Clock, where: str) -> "annotation.KeyMoment":
    """Read the key moment of a marker on scene frame `frame`. Raises InputError if its name cannot be parsed."""
    record, recorded = marker.beyond_mocap, None
    if record.line:
        recorded = _parse_line(record.line)
    is_unmoved = recorded is not None and clock.to_whole_frame(recorded.time) == frame
    time = recorded.time if is_unmoved else clock.to_seconds(frame)
    if recorded is None or marker.name != record.shown:
        place = f"{where}, key moment on frame {frame}"
        recorded = _parse_name("0", marker.name, place).keys[0]
    elif is_unmoved:
        return recorded
    return replace(recorded, time=time, line=None)


def parse_labels(text: str, start: float, end: float | None = None,
                 where: str = "labels") -> "annotation.Span | annotation.KeyMoment":
    """Parse typed labels to a span, or without an end to a key moment.

    Args:
        text: the labels.
        start: seconds.
        end: seconds; None for a key moment.
        where: for messages.
    Returns:
        The span or key moment.
    Raises:
        InputError: if the labels cannot be parsed.
    """
    if end is None:
        return replace(_parse_name("0", text, where).keys[0], time=start, line=None)
    return replace(_parse_name("0 1", text, where).spans[0], start=start, end=end, line=None)


def read_recorded_span(action: bpy.types.Action) -> "annotation.Span | None":
    """Read the span for which an action was written; None if the extension did not write it."""
    line = action.beyond_mocap.line
    return _parse_line(line) if line else None


def store_span(strip: bpy.types.NlaStrip, span: "annotation.Span", kind: str) -> None:
    """Name a strip by its labels and store the exact line with its action."""
    labels = format_labels(span)
    for blanks in range(_MOST_BLANKS):  # invisible, and keeps Blender from adding a number to the name
        strip.name = labels + " " * blanks
        if strip.name == labels + " " * blanks:
            break
    record = strip.action.beyond_mocap
    record.kind, record.line, record.shown = kind, format_line(span), strip.name


def store_key_moment(marker: bpy.types.TimelineMarker, key: "annotation.KeyMoment", frame: int) -> None:
    """Write a key moment to a marker; frame: on its own action."""
    marker.name, marker.frame = format_labels(key), frame
    record = marker.beyond_mocap
    record.kind, record.line, record.shown = "moment", format_line(key), marker.name


def remove_name_suffix(name: str) -> str:
    """Remove what makes a strip's name unique: "running" of "running  " and "running.001"."""
    return re.sub(r"\.\d{3,}$", "", name).rstrip()


@lru_cache(maxsize=CACHE_SIZE)
def _parse_line(line: str) -> "annotation.Span | annotation.KeyMoment":
    """Parse a stored line."""
    found = annotation.parse_timeline(line)
    return replace((*found.spans, *found.keys)[0], line=None)


def _parse_name(times: str, name: str, place: str) -> "annotation.Timeline":
    """Parse a name at one time or two. Raises InputError if the text form would read it as something else."""
    labels = remove_name_suffix(name)
    try:
        found = annotation.parse_timeline(f"{times} {'' if labels == NO_LABELS else labels}")
    except InputError:
        found = None
    if found is None or "#" in name or len(found.keys if times == "0" else found.spans) != 1:
        raise InputError(place, f"the labels {name.strip()!r}", "labels without numbers and '#'", "correct them")
    return found
