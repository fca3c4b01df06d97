"""A player's timeline as strips on the player's dot: `label_tracks` and `strip_writing` for players, on the scene's
clock.

The target is the active player's timeline, or that of a library clip that is being annotated.
"""

from __future__ import annotations

import bpy

from ...beyond_mocap.annotation import Timeline, parse_timeline, read_timeline
from ...beyond_mocap.base.errors import InputError, format_count
from ...beyond_mocap.base.fixes import Fix
from ...beyond_mocap.motion.track import Track
from ..core.measure import Clock, build_scene_clock
from ..core.settings import BeyondMocapPlayer, find_active_player, to_absolute_path
from ..player import dots
from ..player.tracks import read_track
from . import label_tracks as lanes
from . import strip_writing as lay_strips
from .label_tracks import PlacedMoment, PlacedSpan
from .strip_lines import parse_labels


def read_player_timeline(player: BeyondMocapPlayer, scene: bpy.types.Scene) -> Timeline | None:
    """Read the timeline of a player's strips, in seconds on the track's clock; None without strips in this scene."""
    dot = find_dot(player, scene)
    return None if dot is None else lanes.read_timeline(dot, describe_strips(player))


def write_player_timeline(context: bpy.types.Context, player: BeyondMocapPlayer, timeline: Timeline) -> None:
    """Replace a player's strips by `timeline`; creates the player's dot if needed."""
    dot, clock = dots.ensure_dot(context, player), build_scene_clock(context.scene)
    lay_strips.write_timeline(dot, timeline, clock, _compute_extent(dot, clock))


def show_automatic_spans(context: bpy.types.Context, player: BeyondMocapPlayer, timeline: Timeline) -> None:
    """Show the automatic spans of a take's filled timeline as dimmed strips, in place of the previous ones."""
    lay_strips.show_automatic_spans(dots.ensure_dot(context, player), timeline, build_scene_clock(context.scene))


def add_span(context: bpy.types.Context, player: BeyondMocapPlayer, start_s: float, end_s: float,
             labels: tuple[str, ...]) -> PlacedSpan:
    """Add one span.

    Args:
        context: for the scene.
        player: whose timeline.
        start_s, end_s: seconds on the track's clock.
        labels: as in the text form, "-word" for one that must not occur.
    Returns:
        The span with its strip.
    Raises:
        InputError: if it is empty or its labels cannot be parsed.
    """
    if end_s <= start_s:
        raise InputError("span", f"the end {end_s:g} s is not after the start {start_s:g} s", "an end after the start")
    span = parse_labels(" ".join(labels), start_s, end_s)
    return lay_strips.add_span(ensure_label_tracks(context, player), span, build_scene_clock(context.scene))


def add_moment(context: bpy.types.Context, player: BeyondMocapPlayer, time_s: float,
               labels: tuple[str, ...]) -> PlacedMoment:
    """Add one key moment and select it. Raises InputError if its labels cannot be parsed."""
    key = parse_labels(" ".join(labels), time_s)
    return lay_strips.add_moment(ensure_label_tracks(context, player), key, build_scene_clock(context.scene))


def find_dot(player: BeyondMocapPlayer, scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Find the player's dot if it is in this scene and has label tracks."""
    dot = player.dot
    return dot if dot is not None and dot.name in scene.objects and lanes.has_label_tracks(dot) else None


def describe_strips(player: BeyondMocapPlayer) -> str:
    """Describe where these labels are, for messages."""
    return f"strips of {player.name}"


def ensure_label_tracks(context: bpy.types.Context, player: BeyondMocapPlayer) -> bpy.types.Object:
    """Find or create the player's dot and its label tracks.

    New tracks get the labels of the player's text or file, so that none is lost. Raises InputError if track or labels
    cannot be read.
    """
    if player.dot is not None and lanes.has_label_tracks(player.dot):
        return dots.ensure_dot(context, player)
    settings = context.scene.beyond_mocap
    write_player_timeline(context, player, read_written_labels(player, settings.rate, read_track(settings, player)))
    return player.dot


def find_target(context: bpy.types.Context) -> bpy.types.Object | None:
    """Find the object whose strips are the target: the active object if it has label tracks and is no player's dot,
    else the active player's dot, else None.
    """
    chosen = find_active_clip(context)
    if chosen is not None:
        return chosen
    player = find_active_player(context.scene.beyond_mocap)
    return None if player is None else find_dot(player, context.scene)


def find_active_clip(context: bpy.types.Context) -> bpy.types.Object | None:
    """Find the active object if it has label tracks and is no player's dot."""
    active = context.view_layer.objects.active
    return active if active is not None and lanes.has_label_tracks(
        active) and not active.beyond_mocap_dot.player else None


def can_have_timeline(context: bpy.types.Context) -> bool:
    """Return whether there is a target whose timeline can be written."""
    return find_active_clip(context) is not None or find_active_player(context.scene.beyond_mocap) is not None


def ensure_target(context: bpy.types.Context) -> bpy.types.Object:
    """Find the target, or create the player's dot and tracks. Raises InputError if track or labels cannot be read."""
    found = find_target(context)
    return ensure_label_tracks(context, find_active_player(context.scene.beyond_mocap)) if found is None else found


def find_target_clock(context: bpy.types.Context, target: bpy.types.Object) -> Clock:
    """Find the clock of the target's seconds: the scene's for a player's dot, its own for a clip."""
    return build_scene_clock(context.scene) if target.beyond_mocap_dot.player else lanes.read_clock(target)


def describe_target(target: bpy.types.Object) -> str:
    """Describe the target for messages."""
    return target.beyond_mocap_dot.player or target.name


def show_player(context: bpy.types.Context, player) -> None:
    """Make a player active and select only their dot, so that the NLA editor shows their strips."""
    settings = context.scene.beyond_mocap
    settings.active_player = next(n for n, other in enumerate(settings.players) if other == player)
    dot = ensure_label_tracks(context, player) if player.dot is None else dots.ensure_dot(context, player)
    for other in context.view_layer.objects.selected:
        other.select_set(False)
    if dot.name in context.view_layer.objects:
        dot.select_set(True)
        context.view_layer.objects.active = dot


def read_written_labels(player: BeyondMocapPlayer, fps: float, track: Track) -> Timeline:
    """Read the labels of the player's text or file, as they are before they become strips; fps: of times in frames."""
    start = float(track.times[0])
    if player.annotation_text is not None:
        return parse_timeline(player.annotation_text.as_string(), describe_label_source(player), fps, start)
    if player.annotation_file:
        try:
            return read_timeline(describe_label_source(player), fps, start)
        except InputError as error:
            raise error.offer(Fix("choose_labels")) from None
    return Timeline()


def describe_counts(timeline: Timeline) -> str:
    """Describe how many spans and key moments a timeline has, for messages."""
    return f"{format_count(len(timeline.spans), 'span')} and {format_count(len(timeline.keys), 'key moment')}"


def describe_label_source(player: BeyondMocapPlayer) -> str:
    """Describe the text or file with the player's labels, for messages."""
    if player.annotation_text is not None:
        return f"text {player.annotation_text.name}"
    return to_absolute_path(player.annotation_file) or f"player {player.name}"


def _compute_extent(dot: bpy.types.Object, clock: Clock) -> tuple[float, float] | None:
    """Compute the first and last second of the dot's keys."""
    frames = dots.find_key_range(dot)
    return None if frames is None else (clock.to_seconds(frames[0]), clock.to_seconds(frames[1]))
