"""A player's timeline as strips on the player's dot: `lanes` and `lay_strips` for players, on the scene's clock.

Whose timeline is meant: the active player's, or that of a library clip that is being annotated."""

from __future__ import annotations

import bpy

from ...beyond_mocap.annotation import Timeline, parse_timeline, read_timeline
from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.motion.track import Track
from ..core.measure import Clock, scene_clock
from ..core.settings import BeyondMocapPlayer, absolute, active_player
from ..player import dots
from ..player.tracks import read_track
from . import lanes, lay_strips
from .lanes import PlacedMoment, PlacedSpan
from .strip_lines import said


def read(player: BeyondMocapPlayer, scene: bpy.types.Scene) -> Timeline | None:
    """What the player's strips ask for, in seconds on the track's clock; None where he has none in this scene."""
    dot = dot_of(player, scene)
    return None if dot is None else lanes.read(dot, where(player))


def write(context: bpy.types.Context, player: BeyondMocapPlayer, timeline: Timeline) -> None:
    """Let the player's strips say `timeline` and nothing else; his dot is made where there is none."""
    dot, clock = dots.ensure(context, player), scene_clock(context.scene)
    lay_strips.write(dot, timeline, clock, _extent(dot, clock))


def set_automatic(context: bpy.types.Context, player: BeyondMocapPlayer, timeline: Timeline) -> None:
    """Show the automatic spans of a take's filled timeline as dimmed strips, in place of those before."""
    lay_strips.set_automatic(dots.ensure(context, player), timeline, scene_clock(context.scene))


def add_span(context: bpy.types.Context, player: BeyondMocapPlayer, start_s: float, end_s: float,
             words: tuple[str, ...]) -> PlacedSpan:
    """One more span, in seconds on the track's clock; words as in the text form, "-word" for one that must not be.
    InputError where it is empty or its words are not of the form."""
    if end_s <= start_s:
        raise InputError("span", f"the end {end_s:g} is not after the start {start_s:g}", "START < END")
    span = said(" ".join(words), start_s, end_s)
    return lay_strips.add_span(with_lanes(context, player), span, scene_clock(context.scene))


def add_moment(context: bpy.types.Context, player: BeyondMocapPlayer, time_s: float,
               words: tuple[str, ...]) -> PlacedMoment:
    """One more key moment, picked; InputError where its words are not of the form."""
    key = said(" ".join(words), time_s)
    return lay_strips.add_moment(with_lanes(context, player), key, scene_clock(context.scene))


def dot_of(player: BeyondMocapPlayer, scene: bpy.types.Scene) -> bpy.types.Object | None:
    """The player's dot, where it is in this scene and has lanes."""
    dot = player.dot
    return dot if dot is not None and dot.name in scene.objects and lanes.has(dot) else None


def where(player: BeyondMocapPlayer) -> str:
    """Where these words are written, for messages."""
    return f"strips of {player.name}"


def with_lanes(context: bpy.types.Context, player: BeyondMocapPlayer) -> bpy.types.Object:
    """The player's dot; where it has no lanes yet, it gets them with the words of his text or file, so that none is
    lost. InputError where track or words cannot be read."""
    if player.dot is not None and lanes.has(player.dot):
        return dots.ensure(context, player)
    settings = context.scene.beyond_mocap
    write(context, player, written_words(player, settings.rate, read_track(settings, player)))
    return player.dot


def timeline_subject(context: bpy.types.Context) -> bpy.types.Object | None:
    """The object whose strips are meant: the active object, where it has lanes and is nobody's dot; else the active
    player's dot, where it has lanes; else None."""
    chosen = active_clip(context)
    if chosen is not None:
        return chosen
    player = active_player(context.scene.beyond_mocap)
    return None if player is None else dot_of(player, context.scene)


def active_clip(context: bpy.types.Context) -> bpy.types.Object | None:
    """The active object, where it has lanes and is nobody's dot."""
    active = context.view_layer.objects.active
    return active if active is not None and lanes.has(active) and not active.beyond_mocap_dot.player else None


def can_have_timeline(context: bpy.types.Context) -> bool:
    """Whether there is somebody whose timeline can be written."""
    return active_clip(context) is not None or active_player(context.scene.beyond_mocap) is not None


def subject_with_lanes(context: bpy.types.Context) -> bpy.types.Object:
    """The subject, the player's dot and lanes made where there are none; InputError where track or words cannot be
    read."""
    found = timeline_subject(context)
    return with_lanes(context, active_player(context.scene.beyond_mocap)) if found is None else found


def subject_clock(context: bpy.types.Context, target: bpy.types.Object) -> Clock:
    """The clock of its seconds: the scene's for a player's dot, its own for a clip."""
    return scene_clock(context.scene) if target.beyond_mocap_dot.player else lanes.written_for(target)


def subject_name(target: bpy.types.Object) -> str:
    """Whose timeline it is, for messages."""
    return target.beyond_mocap_dot.player or target.name


def show_player(context: bpy.types.Context, player) -> None:
    """Make a player the active one, his dot alone selected, so that the NLA editor shows his strips."""
    settings = context.scene.beyond_mocap
    settings.active_player = next(n for n, other in enumerate(settings.players) if other == player)
    dot = with_lanes(context, player) if player.dot is None else dots.ensure(context, player)
    for other in context.view_layer.objects.selected:
        other.select_set(False)
    if dot.name in context.view_layer.objects:
        dot.select_set(True)
        context.view_layer.objects.active = dot


def written_words(player: BeyondMocapPlayer, fps: float, track: Track) -> Timeline:
    """The words of the player's text or file, as they are before they become strips; fps: of times in frames."""
    start = float(track.times[0])
    if player.annotation_text is not None:
        return parse_timeline(player.annotation_text.as_string(), written_in(player), fps, start)
    if player.annotation_file:
        return read_timeline(written_in(player), fps, start)
    return Timeline()


def written_in(player: BeyondMocapPlayer) -> str:
    """The text or file with the player's words, for messages."""
    if player.annotation_text is not None:
        return f"text {player.annotation_text.name}"
    return absolute(player.annotation_file) or f"player {player.name}"


def _extent(dot: bpy.types.Object, clock: Clock) -> tuple[float, float] | None:
    """First and last second of the dot's keys."""
    frames = dots.keyed_frames(dot)
    return None if frames is None else (clock.seconds(frames[0]), clock.seconds(frames[1]))
