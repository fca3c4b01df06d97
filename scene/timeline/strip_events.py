"""Normalize strips after edits by Blender's own tools: dragged, scaled, split, duplicated, renamed, muted.

`label_tracks` reads strips as they are; here they return to whole frames, scale 1 and an action of their own, on a
label track, with the line of their present state. In a window this happens automatically shortly after an edit, an
undo, a redo or the loading of a file; without a window, call `normalize_strips`. It is no undo step: undo restores the
state before the user's edit, which is normalized again.
"""

from __future__ import annotations

import bpy

from ...beyond_mocap.annotation import Span
from ...beyond_mocap.base.errors import InputError
from ..core.live import Watcher, is_running, soon
from ..core.measure import Clock, scene_clock
from ..player import dots
from . import moment_names, word_checks
from .lanes import AUTOMATIC, WORDS, has, is_lane, marker_frame, shows, strips, written_for
from .lay_strips import lane_with_room, place, place_all, relay
from .strip_lines import base_name, frames_of, key_of, line_of, recorded_span, remember, span_of, tell, words_of

DELAY = 0.1  # seconds after an edit
UNDER_WAY = ("TRANSFORM_OT_", "NLA_OT_", "ACTION_OT_", "ANIM_OT_", "MARKER_OT_")  # operators that must end first


def put_in_order(scene: bpy.types.Scene, only: set[str] | None = None) -> bool:
    """Normalize all strips of the scene; those of players move to the scene's clock if it changed.

    Args:
        scene: with players and their dots.
        only: names of objects that may have changed; None: all.
    Returns:
        Whether anything changed.
    """
    clock, changed = scene_clock(scene), False
    for player in scene.beyond_mocap.players:
        if player.dot is not None and _ours_to_change(player.dot):
            changed |= dots.relay(player.dot, clock) | _onto_clock(player.dot, clock)
    for target in scene.objects:
        if (only is None or target.name in only) and has(target) and _ours_to_change(target):
            changed |= tidy(target)
    return changed


def _onto_clock(target: bpy.types.Object, clock: Clock) -> bool:
    """Move strips to a clock; if one of them cannot be read, they stay until it is renamed."""
    try:
        return has(target) and relay(target, clock)
    except InputError:
        return False


def tidy(target: bpy.types.Object) -> bool:
    """Normalize the strips of one object; returns whether anything changed. Names that cannot be parsed stay."""
    clock, changed = written_for(target), _name_lanes(target)
    for track, strip in _outermost(target):
        if strip.action.beyond_mocap.kind == "moments":
            changed |= _tidy_moments(strip, clock, target.name)
            continue
        try:
            span = span_of(strip, clock, target.name)
        except InputError:
            continue
        changed |= _tidy_markers(strip, clock, target.name)
        if _out_of_order(track, strip, span, clock):
            _renew(target, track, strip, span, clock)
            changed = True
    return changed | _onto_frames(target, clock)


def _outermost(target: bpy.types.Object) -> list:
    """List (track, strip) of a timeline without those within meta strips, which cannot be moved to another track."""
    within = [inner for track in target.animation_data.nla_tracks for top in track.strips if top.type == "META"
              for inner in top.strips]
    return [(track, strip) for track, strip in strips(target) if not within or strip not in within]


def _ours_to_change(target: bpy.types.Object) -> bool:
    """Return whether the object may be changed now: not linked, and none of its strips in tweak mode."""
    data = target.animation_data
    mine = target.library is None and target.override_library is None
    return mine and not (data is not None and data.use_tweak_mode)


def _name_lanes(target: bpy.types.Object) -> bool:
    """Turn tracks that Blender created for duplicated spans into label tracks."""
    tracks, changed = target.animation_data.nla_tracks, False
    for track in tracks:
        kinds = {strip.action.beyond_mocap.kind if strip.action else "none" for strip in track.strips}
        if kinds and kinds <= {"span"} and not is_lane(track) and not track.name.startswith(AUTOMATIC):
            taken = {other.name for other in tracks}
            track.name = next(name for n in range(2, 99) if (name := f"{WORDS} {n}") not in taken)
            changed = True
    return changed


def _out_of_order(track, strip: bpy.types.NlaStrip, span: Span, clock: Clock) -> bool:
    """Return whether a span's strip needs another action: its line changed, or its action is shared."""
    action = strip.action
    own = action.users - action.use_fake_user == 1
    if not own or recorded_span(action) != span or base_name(strip.name) != base_name(action.beyond_mocap.shown):
        return True
    made = action.beyond_mocap.kind == "automatic"
    return action.beyond_mocap.kind == "none" or made and not (track.name.startswith(AUTOMATIC) and strip.mute)


def _renew(target, track, strip: bpy.types.NlaStrip, span: Span, clock: Clock) -> None:
    """Give a strip an action of its own with its present line and visible markers; a changed automatic strip becomes an
    ordinary one.
    """
    old, touched = strip.action, strip.action.beyond_mocap.kind == "automatic"
    keys = _shown_keys(strip, clock, target.name)
    new = bpy.data.actions.new(f"{target.name} {words_of(span)}")
    strip.action = new
    place(strip, *frames_of(span, clock))
    remember(strip, span, "span")
    for key, selected in keys:
        marker = new.pose_markers.new("")
        tell(marker, key, clock.whole(key.time))
        marker.select = selected
    _drop(old)
    if touched:
        strip.mute = False
        if not is_lane(track):
            _move(target, track, strip)


def _move(target, track, strip: bpy.types.NlaStrip) -> None:
    """Move a strip to a label track with room; it is created again, since tracks cannot exchange strips."""
    first, last, action = strip.frame_start, strip.frame_end, strip.action
    selected, muted = strip.select, strip.mute
    lane = lane_with_room(target, WORDS, int(first), int(last))
    track.strips.remove(strip)
    strip = lane.strips.new(action.name, int(first), action)
    strip.extrapolation, strip.select, strip.mute = "NOTHING", selected, muted
    place(strip, first, last)
    remember(strip, recorded_span(action), action.beyond_mocap.kind)


def _onto_frames(target: bpy.types.Object, clock: Clock) -> bool:
    """Align strips with the whole frames of their spans at scale 1; overlapping ones move to another track."""
    changed = False
    for track in list(target.animation_data.nla_tracks):
        wanted, evicted, reached = [], [], None
        for strip in sorted(track.strips, key=lambda one: one.frame_start):
            kept = recorded_span(strip.action) if strip.action else None
            if kept is None:
                continue
            first, last = frames_of(kept, clock)
            late = reached is not None and first < reached
            (evicted if late else wanted).append((strip, first, last))
            reached = last if not late else reached
        for strip, first, last in evicted:
            _move(target, track, strip)
        if evicted or any(not _in_place(*one) for one in wanted):
            place_all(wanted)
            changed = True
    return changed


def _in_place(strip: bpy.types.NlaStrip, first: int, last: int) -> bool:
    action = strip.action
    ends = (strip.frame_start, strip.frame_end, strip.action_frame_start, strip.action_frame_end)
    own = action.use_frame_range and (action.frame_start, action.frame_end) == (first, last)
    return own and strip.scale == 1.0 and strip.repeat == 1.0 and ends == (first, last, first, last)


def _tidy_moments(strip: bpy.types.NlaStrip, clock: Clock, where: str) -> bool:
    """Normalize the strip of key moments: scale 1 in its own frames; a shared or moved action is replaced."""
    action = strip.action
    first, last = round(strip.frame_start), max(round(strip.frame_end), round(strip.frame_start) + 1)
    own = action.users - action.use_fake_user == 1
    still = strip.scale == 1.0 and abs(strip.frame_start - strip.action_frame_start) < 1e-3
    whole = abs(strip.frame_start - first) < 1e-3 and abs(strip.frame_end - last) < 1e-3
    if own and still and whole:
        return _tidy_markers(strip, clock, where)
    try:
        keys = _shown_keys(strip, clock, where)
    except InputError:
        return False
    new = bpy.data.actions.new(action.name)
    new.beyond_mocap.kind = "moments"
    strip.action = new
    place(strip, first, last)
    for key, selected in keys:
        marker = new.pose_markers.new("")
        tell(marker, key, min(max(clock.whole(key.time), first), last))
        marker.select = selected
    _drop(action)
    new.name = base_name(new.name)
    return True


def _tidy_markers(strip: bpy.types.NlaStrip, clock: Clock, where: str) -> bool:
    """Store the present line of markers that were moved, renamed or added."""
    changed = False
    for marker in strip.action.pose_markers:
        try:
            key = key_of(marker, marker_frame(strip, marker), clock, where)
        except InputError:
            continue
        record = marker.beyond_mocap
        if shows(strip, marker) and (line_of(key) != record.line or marker.name != record.shown):
            tell(marker, key, marker.frame)
            changed = True
    return changed


def _shown_keys(strip: bpy.types.NlaStrip, clock: Clock, where: str) -> list:
    """List (key moment, whether it is selected) of each visible marker of a strip."""
    return [(key_of(marker, marker_frame(strip, marker), clock, where), marker.select)
            for marker in strip.action.pose_markers if shows(strip, marker)]


def _drop(action: bpy.types.Action) -> None:
    if action.users == 0:
        bpy.data.actions.remove(action)


def _soon(names: set[str] | None) -> None:
    """Schedule the strips of these objects (None: all) for normalization; does nothing without a window."""
    global _waiting
    if bpy.app.background:
        return
    _waiting = None if names is None or _waiting is None else _waiting | names
    soon(_later, DELAY)


def _later():
    """Run the scheduled work; the timer waits while the user is still dragging."""
    global _waiting
    if is_running(UNDER_WAY):
        return DELAY
    names, _waiting = _waiting, set()
    if put_in_order(bpy.context.scene, names):
        moment_names.redraw()
    word_checks.keep(bpy.context)
    return None


def _changed(_scene, depsgraph) -> None:
    """Schedule objects whose label tracks, actions or clock may have changed."""
    names, wanted = set(), False
    for update in depsgraph.updates:
        thing = update.id.original
        if isinstance(thing, bpy.types.Action) and thing.beyond_mocap.kind != "none":
            return _soon(None)
        if isinstance(thing, bpy.types.Object) and thing.beyond_mocap_lanes.clock:
            names.add(thing.name)
        wanted |= isinstance(thing, bpy.types.Scene) and (_other_clock(thing) or word_checks.out_of_date(thing))
    if names or wanted:
        _soon(names)


def _other_clock(scene: bpy.types.Scene) -> bool:
    """Return whether a player's strips use another clock than the scene's."""
    clock = scene_clock(scene).spelled()
    return any(player.dot is not None and player.dot.beyond_mocap_lanes.clock not in ("", clock)
               for player in scene.beyond_mocap.players)


def _restored() -> None:
    """Schedule everything after undo, redo or loading a file."""
    _soon(None)


_waiting: set[str] | None = set()
WATCHER = Watcher(name="Strips", changed=_changed, restored=_restored, loaded=_restored)
