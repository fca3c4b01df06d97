"""Writing timelines as NLA strips: created, changed, removed, and moved to another clock.

Each strip has an action of its own without any curves; its manual frame range is the strip's own place in the scene, so
that a marker's frame on it is the scene's.
"""

from __future__ import annotations

import bpy

from ...beyond_mocap.annotation import KeyMoment, Span, Timeline
from ...beyond_mocap.base.errors import InputError
from ..core.measure import Clock, round_frame
from . import label_tracks as lanes
from .label_tracks import PlacedMoment, PlacedSpan
from .strip_lines import compute_frames, format_labels, read_key_moment, read_span, store_key_moment, store_span


def write_timeline(target: bpy.types.Object, timeline: Timeline, clock: Clock,
                   extent: tuple[float, float] | None = None) -> None:
    """Replace all active strips by a timeline; automatic strips stay.

    Args:
        target: the object.
        timeline: spans and key moments.
        clock: of its frames.
        extent: first and last second of the track of key moments (the ends of the tracking data); longer if needed.
    """
    ensure_label_tracks(target, clock)
    for track, strip in list(lanes.iter_strips(target)):
        if strip.action.beyond_mocap.kind != "automatic":
            _remove_strip(track, strip)
    _remove_empty_tracks(target)
    for span in timeline.spans:
        _create_span_strip(target, span, clock, "span")
    first, last = extent or _find_ends(timeline, clock)
    _find_moments_strip(target, clock.to_whole_frame(first), clock.to_whole_frame(last))
    for key in timeline.keys:
        _create_marker(target, key, clock)


def show_automatic_spans(target: bpy.types.Object, timeline: Timeline, clock: Clock) -> None:
    """Show the spans that a synthesis added to its filled timeline, as muted strips in place of the previous ones.

    Automatic strips that the user changed are ordinary ones and stay.
    """
    ensure_label_tracks(target, clock)
    placed = lanes.list_spans(target)
    old = {one.strip for one in placed if one.is_automatic}
    for track, strip in list(lanes.iter_strips(target)):
        if strip.name in old:
            _remove_strip(track, strip)
    active_spans = {one.span for one in placed if not one.is_automatic and not one.is_muted}
    for span in timeline.spans:
        if span not in active_spans and span.words:
            _create_span_strip(target, span, clock, "automatic")


def add_span(target: bpy.types.Object, span: Span, clock: Clock) -> PlacedSpan:
    """Add a span on the first label track with room, and select only it."""
    ensure_label_tracks(target, clock)
    strip = _create_span_strip(target, span, clock, "span")
    _select_only(target, strip.name)
    return _find_placed_span(target, strip.name)


def add_moment(target: bpy.types.Object, key: KeyMoment, clock: Clock) -> PlacedMoment:
    """Add a key moment and select it; its strip is extended if it is too short."""
    ensure_label_tracks(target, clock)
    strip, index = _create_marker(target, key, clock)
    select_moment(target, strip.name, index)
    return PlacedMoment(key, strip.name, index, frame=clock.to_whole_frame(key.time), is_muted=False, is_selected=True)


def remove_span(target: bpy.types.Object, strip_name: str) -> None:
    """Remove a span's strip."""
    check_editable(target)
    track = next(track for track, strip in lanes.iter_strips(target) if strip.name == strip_name)
    _remove_strip(track, lanes.find_strip(target, strip_name))


def remove_moment(target: bpy.types.Object, strip_name: str, index: int) -> None:
    """Remove a key moment's marker."""
    check_editable(target)
    markers = lanes.find_strip(target, strip_name).action.pose_markers
    markers.remove(markers[index])


def change_span(target: bpy.types.Object, strip_name: str, span: Span) -> PlacedSpan:
    """Change the labels or time of a span; an automatic one becomes an ordinary one."""
    check_editable(target)
    strip, clock = lanes.find_strip(target, strip_name), lanes.read_clock(target)
    is_muted = strip.mute and strip.action.beyond_mocap.kind == "span"
    selected, inner = strip.select, [placed for placed in lanes.list_moments(target) if placed.strip == strip_name]
    remove_span(target, strip_name)
    created = _create_span_strip(target, span, clock, "span")
    created.mute, created.select = is_muted, selected
    for placed in inner:
        _create_marker(target, placed.key, clock)
    return _find_placed_span(target, created.name)


def change_moment(target: bpy.types.Object, strip_name: str, index: int, key: KeyMoment) -> PlacedMoment:
    """Change the labels or time of a key moment, and select it."""
    check_editable(target)
    clock, strip = lanes.read_clock(target), lanes.find_strip(target, strip_name)
    frame = clock.to_whole_frame(key.time)
    if not strip.frame_start <= frame <= strip.frame_end:
        remove_moment(target, strip_name, index)
        return add_moment(target, key, clock)
    store_key_moment(strip.action.pose_markers[index], key, _compute_action_frame(strip, frame))
    select_moment(target, strip_name, index)
    return PlacedMoment(key, strip_name, index, frame=frame, is_muted=False, is_selected=True)


def select_moment(target: bpy.types.Object, strip_name: str, index: int) -> None:
    """Select only this key moment; an empty name selects none."""
    check_editable(target)
    for _, strip in lanes.iter_strips(target):
        markers = strip.action.pose_markers
        for number, marker in enumerate(markers):
            marker.select = strip.name == strip_name and number == index
        if strip.name == strip_name and len(markers):
            markers.active_index = index


def move_to_clock(target: bpy.types.Object, clock: Clock) -> bool:
    """Move the strips to the frames of another clock, by their exact seconds; returns whether anything changed."""
    old = lanes.read_clock(target)
    if old is None or old == clock:
        return False
    check_editable(target)
    spans_by_strip = {strip.name: read_span(strip, old, target.name) for _, strip in lanes.iter_strips(target)}
    keys = [(strip, marker, read_key_moment(marker, lanes.compute_marker_frame(strip, marker), old, target.name)) for _,
            strip in lanes.iter_strips(target) for marker in strip.action.pose_markers
            if lanes.is_marker_visible(strip, marker)]
    for track in target.animation_data.nla_tracks:
        place_strips([(strip, *compute_frames(spans_by_strip[strip.name], clock)) for strip in track.strips
                      if strip.name in spans_by_strip])
    for _, strip in lanes.iter_strips(target):
        if strip.action.beyond_mocap.kind != "moments":
            store_span(strip, spans_by_strip[strip.name], strip.action.beyond_mocap.kind)
    for strip, marker, key in keys:
        frame = clock.to_whole_frame(key.time)
        if strip.action.beyond_mocap.kind == "moments":  # its ends may be rounded to coarser frames than the key's
            _extend_strip(strip, frame, frame)
        store_key_moment(marker, key, min(max(frame, int(strip.frame_start)), int(strip.frame_end)))
    target.beyond_mocap_lanes.clock = clock.to_text()
    return True


def ensure_label_tracks(target: bpy.types.Object, clock: Clock) -> None:
    """Create an object's label tracks on this clock if needed."""
    check_editable(target)
    target.animation_data_create()
    move_to_clock(target, clock)
    target.beyond_mocap_lanes.clock = clock.to_text()
    tracks = target.animation_data.nla_tracks
    for name in (lanes.AUTOMATIC, lanes.WORDS, lanes.MOMENTS):  # from bottom to top
        if name not in tracks:
            tracks.new().name = name


def check_editable(target: bpy.types.Object) -> None:
    """Raise InputError for an object that another file owns."""
    if target.library is not None or target.override_library is not None:
        found = "is linked from another file" if target.library else "is a library override"
        raise InputError(f"object {target.name}", found, "an object of this file", "make it local first")


def place_strip(strip: bpy.types.NlaStrip, first: float, last: float) -> None:
    """Place a strip at scale 1, with its action's range at the same frames."""
    strip.action.use_frame_range = True
    strip.action.frame_start, strip.action.frame_end = first, last
    strip.scale, strip.repeat, strip.use_reverse = 1.0, 1.0, False
    strip.action_frame_start, strip.action_frame_end = first, last
    strip.frame_start_raw, strip.frame_end_raw = first, last


def _create_span_strip(target: bpy.types.Object, span: Span, clock: Clock, kind: str) -> bpy.types.NlaStrip:
    first, last = compute_frames(span, clock)
    track = find_free_track(target, lanes.AUTOMATIC if kind == "automatic" else lanes.WORDS, first, last)
    strip = _create_strip(track, f"{target.name} {format_labels(span)}", first, last)
    store_span(strip, span, kind)
    strip.mute = kind == "automatic"
    return strip


def _create_strip(track: bpy.types.NlaTrack, name: str, first: int, last: int) -> bpy.types.NlaStrip:
    action = bpy.data.actions.new(name)
    action.use_frame_range = True
    action.frame_start, action.frame_end = first, last
    strip = track.strips.new(name, first, action)
    strip.extrapolation, strip.select = "NOTHING", False
    return strip


def find_free_track(target: bpy.types.Object, name: str, first: int, last: int) -> bpy.types.NlaTrack:
    """Find the first track of that kind with room from first to last, or create one."""
    tracks = target.animation_data.nla_tracks
    is_label_kind = name == lanes.WORDS
    fitting = [track for track in tracks if (lanes.parse_track_number(track) if is_label_kind
                                             else track.name.startswith(name))]
    for track in fitting:
        if not track.mute and all(last <= strip.frame_start or strip.frame_end <= first for strip in track.strips):
            return track
    new = tracks.new(prev=fitting[-1]) if fitting else tracks.new()
    taken = {track.name for track in tracks}
    new.name = next(f"{name} {number}" for number in range(2, len(taken) + 3) if f"{name} {number}" not in taken)
    return new


def _create_marker(target: bpy.types.Object, key: KeyMoment, clock: Clock) -> tuple[bpy.types.NlaStrip, int]:
    """Create a marker for a key moment; returns its strip and index."""
    frame = clock.to_whole_frame(key.time)
    strip = _find_moments_strip(target, frame, frame)
    markers = strip.action.pose_markers
    marker = markers.new("")
    store_key_moment(marker, key, _compute_action_frame(strip, frame))
    marker.select = False
    return strip, len(markers) - 1


def _find_moments_strip(target: bpy.types.Object, first: int, last: int) -> bpy.types.NlaStrip:
    """Find the strip of key moments from first to last: created, or the nearest one extended."""
    own_strips = [strip for _, strip in lanes.iter_strips(target) if strip.action.beyond_mocap.kind == "moments"]
    if not own_strips:
        track = target.animation_data.nla_tracks[lanes.MOMENTS]
        strip = _create_strip(track, lanes.MOMENTS, first, max(last, first + 1))
        strip.action.name = f"{target.name} {lanes.MOMENTS}"
        strip.action.beyond_mocap.kind = "moments"
        return strip
    strip = min(own_strips, key=lambda one: max(one.frame_start - first, last - one.frame_end, 0.0))
    _extend_strip(strip, first, last)
    return strip


def _extend_strip(strip: bpy.types.NlaStrip, first: int, last: int) -> None:
    """Extend a strip to reach from first to last; its markers stay on their frames."""
    start, end = min(strip.frame_start, first), max(strip.frame_end, last)
    if (start, end) == (strip.frame_start, strip.frame_end):
        return
    low = strip.action_frame_start + (start - strip.frame_start) / strip.scale
    high = strip.action_frame_start + (end - strip.frame_start) / strip.scale
    strip.action.frame_start, strip.action.frame_end = low, high
    strip.action_frame_start, strip.action_frame_end = low, high
    strip.frame_start_raw, strip.frame_end_raw = start, end


def _compute_action_frame(strip: bpy.types.NlaStrip, frame: int) -> int:
    """Compute the frame of a strip's action that it shows at a scene frame."""
    return round_frame(strip.action_frame_start + (frame - strip.frame_start) / strip.scale)


def place_strips(placements: list[tuple[bpy.types.NlaStrip, int, int]]) -> None:
    """Place all strips of one track; they move far away first, since a strip placed on another would push it."""
    placements = sorted(placements, key=lambda one: one[0].frame_start)
    far = 1.0 + max((max(strip.frame_end, last) for strip, _, last in placements), default=0.0)
    for strip, _, _ in reversed(placements):
        strip.frame_start_raw, strip.frame_end_raw = strip.frame_start + far, strip.frame_end + far
    for strip, first, last in placements:
        place_strip(strip, first, last)


def _remove_strip(track: bpy.types.NlaTrack, strip: bpy.types.NlaStrip) -> None:
    """Remove a strip (or its meta strip), and its action if nothing else uses that."""
    top = next(top for top in track.strips if strip in list(lanes.iter_inner_strips(top)))
    actions = {inner.action for inner in lanes.iter_inner_strips(top)}
    track.strips.remove(top)
    for action in actions:
        if action is not None and action.users == 0:
            bpy.data.actions.remove(action)


def _remove_empty_tracks(target: bpy.types.Object) -> None:
    tracks = target.animation_data.nla_tracks
    for track in list(tracks):
        if lanes.parse_track_number(track) > 1 and not track.strips:
            tracks.remove(track)


def _find_ends(timeline: Timeline, clock: Clock) -> tuple[float, float]:
    """Find the first and last second of a timeline."""
    times = [time for span in timeline.spans for time in (span.start, span.end)] + [key.time for key in timeline.keys]
    return (min(times), max(times)) if times else (clock.start_time, clock.start_time + 1.0)


def _select_only(target: bpy.types.Object, strip_name: str) -> None:
    for _, strip in lanes.iter_strips(target):
        strip.select = strip.name == strip_name


def _find_placed_span(target: bpy.types.Object, strip_name: str) -> PlacedSpan:
    track = next(track for track, strip in lanes.iter_strips(target) if strip.name == strip_name)
    return lanes.read_placed_span(track, lanes.find_strip(target, strip_name), lanes.read_clock(target), target.name)
