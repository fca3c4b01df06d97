"""Normalize strips after edits by Blender's own tools: dragged, scaled, split, duplicated, renamed, muted.

`label_tracks` reads strips as they are; here they return to whole frames, scale 1 and an action of their own, on a
label track, with the line of their present state. In a window this happens automatically shortly after an edit, an
undo, a redo or the loading of a file; without a window, call `normalize_strips`. It is no undo step: undo restores the
state before the user's edit, which is normalized again.
"""

from __future__ import annotations

import bpy

from ...beyond_mocap import annotation
from ...beyond_mocap.base.errors import InputError
from ..core.live import Watcher, call_soon, is_running
from ..core.measure import Clock, build_scene_clock
from ..player import dots
from . import label_checks as word_checks
from . import moment_names, strip_writing
from .label_tracks import (
    AUTOMATIC,
    WORDS,
    compute_marker_frame,
    has_label_tracks,
    is_label_track,
    is_marker_visible,
    iter_strips,
    read_clock,
)
from .strip_lines import (
    compute_frames,
    format_labels,
    format_line,
    read_key_moment,
    read_recorded_span,
    read_span,
    remove_name_suffix,
    store_key_moment,
    store_span,
)

DELAY = 0.1  # seconds after an edit
RUNNING_OPERATORS = ("TRANSFORM_OT_", "NLA_OT_", "ACTION_OT_", "ANIM_OT_",
                     "MARKER_OT_")  # operators that must end first


def normalize_strips(scene: bpy.types.Scene, only: set[str] | None = None) -> bool:
    """Normalize all strips of the scene; those of players move to the scene's clock if it changed.

    Args:
        scene: with players and their dots.
        only: names of objects that may have changed; None: all.
    Returns:
        Whether anything changed.
    """
    clock, changed = build_scene_clock(scene), False
    for player in scene.beyond_mocap.players:
        if player.dot is not None and _can_change(player.dot):
            changed |= dots.move_keys(player.dot, clock) | _move_to_clock(player.dot, clock)
    for target in scene.objects:
        if (only is None or target.name in only) and has_label_tracks(target) and _can_change(target):
            changed |= normalize_object(target)
    return changed


def _move_to_clock(target: bpy.types.Object, clock: Clock) -> bool:
    """Move strips to a clock; if one of them cannot be read, they stay until it is renamed."""
    try:
        return has_label_tracks(target) and strip_writing.move_to_clock(target, clock)
    except InputError:
        return False


def normalize_object(target: bpy.types.Object) -> bool:
    """Normalize the strips of one object; returns whether anything changed. Names that cannot be parsed stay."""
    clock, changed = read_clock(target), _name_tracks(target)
    for track, strip in _list_outer_strips(target):
        if strip.action.beyond_mocap.kind == "moments":
            changed |= _normalize_moments(strip, clock, target.name)
            continue
        try:
            span = read_span(strip, clock, target.name)
        except InputError:
            continue
        changed |= _normalize_markers(strip, clock, target.name)
        if _needs_action(track, strip, span):
            _renew_action(target, track, strip, span, clock)
            changed = True
    return changed | _align_to_frames(target, clock)


def _list_outer_strips(target: bpy.types.Object) -> list:
    """List (track, strip) of a timeline without those within meta strips, which cannot be moved to another track."""
    within = [inner for track in target.animation_data.nla_tracks for top in track.strips if top.type == "META"
              for inner in top.strips]
    return [(track, strip) for track, strip in iter_strips(target) if not within or strip not in within]


def _can_change(target: bpy.types.Object) -> bool:
    """Return whether the object may be changed now: not linked, and none of its strips in tweak mode."""
    data = target.animation_data
    is_local = target.library is None and target.override_library is None
    return is_local and not (data is not None and data.use_tweak_mode)


def _name_tracks(target: bpy.types.Object) -> bool:
    """Turn tracks that Blender created for duplicated spans into label tracks."""
    tracks, changed = target.animation_data.nla_tracks, False
    for track in tracks:
        kinds = {strip.action.beyond_mocap.kind if strip.action else "none" for strip in track.strips}
        if kinds and kinds <= {"span"} and not is_label_track(track) and not track.name.startswith(AUTOMATIC):
            taken = {other.name for other in tracks}
            track.name = next(name for n in range(2, 99) if (name := f"{WORDS} {n}") not in taken)
            changed = True
    return changed


def _needs_action(track, strip: bpy.types.NlaStrip, span: annotation.Span) -> bool:
    """Return whether a span's strip needs another action: its line changed, or its action is shared."""
    action = strip.action
    own = action.users - action.use_fake_user == 1
    if not own or read_recorded_span(action) != span or remove_name_suffix(strip.name) != remove_name_suffix(
            action.beyond_mocap.shown):
        return True
    is_automatic = action.beyond_mocap.kind == "automatic"
    return action.beyond_mocap.kind == "none" or is_automatic and not (track.name.startswith(AUTOMATIC) and strip.mute)


def _renew_action(target, track, strip: bpy.types.NlaStrip, span: annotation.Span, clock: Clock) -> None:
    """Give a strip an action of its own with its present line and visible markers; a changed automatic strip becomes an
    ordinary one.
    """
    old, was_automatic = strip.action, strip.action.beyond_mocap.kind == "automatic"
    keys = _list_visible_keys(strip, clock, target.name)
    new = bpy.data.actions.new(f"{target.name} {format_labels(span)}")
    strip.action = new
    strip_writing.place_strip(strip, *compute_frames(span, clock))
    store_span(strip, span, "span")
    for key, selected in keys:
        marker = new.pose_markers.new("")
        store_key_moment(marker, key, clock.to_whole_frame(key.time))
        marker.select = selected
    _remove_unused_action(old)
    if was_automatic:
        strip.mute = False
        if not is_label_track(track):
            _move_strip(target, track, strip)


def _move_strip(target, track, strip: bpy.types.NlaStrip) -> None:
    """Move a strip to a label track with room; it is created again, since tracks cannot exchange strips."""
    first, last, action = strip.frame_start, strip.frame_end, strip.action
    selected, muted = strip.select, strip.mute
    new_track = strip_writing.find_free_track(target, WORDS, int(first), int(last))
    track.strips.remove(strip)
    strip = new_track.strips.new(action.name, int(first), action)
    strip.extrapolation, strip.select, strip.mute = "NOTHING", selected, muted
    strip_writing.place_strip(strip, first, last)
    store_span(strip, read_recorded_span(action), action.beyond_mocap.kind)


def _align_to_frames(target: bpy.types.Object, clock: Clock) -> bool:
    """Align strips with the whole frames of their spans at scale 1; overlapping ones move to another track."""
    changed = False
    for track in list(target.animation_data.nla_tracks):
        placements, evicted, reached = [], [], None
        for strip in sorted(track.strips, key=lambda one: one.frame_start):
            span = read_recorded_span(strip.action) if strip.action else None
            if span is None:
                continue
            first, last = compute_frames(span, clock)
            late = reached is not None and first < reached
            (evicted if late else placements).append((strip, first, last))
            reached = last if not late else reached
        for strip, first, last in evicted:
            _move_strip(target, track, strip)
        if evicted or any(not _is_in_place(*one) for one in placements):
            strip_writing.place_strips(placements)
            changed = True
    return changed


def _is_in_place(strip: bpy.types.NlaStrip, first: int, last: int) -> bool:
    action = strip.action
    ends = (strip.frame_start, strip.frame_end, strip.action_frame_start, strip.action_frame_end)
    own = action.use_frame_range and (action.frame_start, action.frame_end) == (first, last)
    return own and strip.scale == 1.0 and strip.repeat == 1.0 and ends == (first, last, first, last)


def _normalize_moments(strip: bpy.types.NlaStrip, clock: Clock, where: str) -> bool:
    """Normalize the strip of key moments: scale 1 in its own frames; a shared or moved action is replaced."""
    action = strip.action
    first, last = round(strip.frame_start), max(round(strip.frame_end), round(strip.frame_start) + 1)
    own = action.users - action.use_fake_user == 1
    is_unscaled = strip.scale == 1.0 and abs(strip.frame_start - strip.action_frame_start) < 1e-3
    is_on_frames = abs(strip.frame_start - first) < 1e-3 and abs(strip.frame_end - last) < 1e-3
    if own and is_unscaled and is_on_frames:
        return _normalize_markers(strip, clock, where)
    try:
        keys = _list_visible_keys(strip, clock, where)
    except InputError:
        return False
    new = bpy.data.actions.new(action.name)
    new.beyond_mocap.kind = "moments"
    strip.action = new
    strip_writing.place_strip(strip, first, last)
    for key, selected in keys:
        marker = new.pose_markers.new("")
        store_key_moment(marker, key, min(max(clock.to_whole_frame(key.time), first), last))
        marker.select = selected
    _remove_unused_action(action)
    new.name = remove_name_suffix(new.name)
    return True


def _normalize_markers(strip: bpy.types.NlaStrip, clock: Clock, where: str) -> bool:
    """Store the present line of markers that were moved, renamed or added."""
    changed = False
    for marker in strip.action.pose_markers:
        try:
            key = read_key_moment(marker, compute_marker_frame(strip, marker), clock, where)
        except InputError:
            continue
        record = marker.beyond_mocap
        if is_marker_visible(strip, marker) and (format_line(key) != record.line or marker.name != record.shown):
            store_key_moment(marker, key, marker.frame)
            changed = True
    return changed


def _list_visible_keys(strip: bpy.types.NlaStrip, clock: Clock, where: str) -> list:
    """List (key moment, whether it is selected) of each visible marker of a strip."""
    return [(read_key_moment(marker, compute_marker_frame(strip, marker), clock, where), marker.select)
            for marker in strip.action.pose_markers if is_marker_visible(strip, marker)]


def _remove_unused_action(action: bpy.types.Action) -> None:
    if action.users == 0:
        bpy.data.actions.remove(action)


def _schedule_objects(names: set[str] | None) -> None:
    """Schedule the strips of these objects (None: all) for normalization; does nothing without a window."""
    global _scheduled
    if bpy.app.background:
        return
    _scheduled = None if names is None or _scheduled is None else _scheduled | names
    call_soon(_run_scheduled, DELAY)


def _run_scheduled():
    """Run the scheduled work; the timer waits while the user is still dragging."""
    global _scheduled
    if is_running(RUNNING_OPERATORS):
        return DELAY
    names, _scheduled = _scheduled, set()
    if normalize_strips(bpy.context.scene, names):
        moment_names.redraw_editors()
    word_checks.update_problems(bpy.context)
    return None


def _handle_change(_scene, depsgraph) -> None:
    """Schedule objects whose label tracks, actions or clock may have changed."""
    names, wanted = set(), False
    for update in depsgraph.updates:
        thing = update.id.original
        if isinstance(thing, bpy.types.Action) and thing.beyond_mocap.kind != "none":
            return _schedule_objects(None)
        if isinstance(thing, bpy.types.Object) and thing.beyond_mocap_lanes.clock:
            names.add(thing.name)
        wanted |= isinstance(thing, bpy.types.Scene) and (_has_other_clock(thing) or word_checks.is_out_of_date(thing))
    if names or wanted:
        _schedule_objects(names)


def _has_other_clock(scene: bpy.types.Scene) -> bool:
    """Return whether a player's strips use another clock than the scene's."""
    clock = build_scene_clock(scene).to_text()
    return any(player.dot is not None and player.dot.beyond_mocap_lanes.clock not in ("", clock)
               for player in scene.beyond_mocap.players)


def _handle_restore() -> None:
    """Schedule everything after undo, redo or loading a file."""
    _schedule_objects(None)


_scheduled: set[str] | None = set()
WATCHER = Watcher(name="Strips", changed=_handle_change, restored=_handle_restore, loaded=_handle_restore)
