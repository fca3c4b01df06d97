"""A player's timeline as strips on his dot: `lanes` and `lay_strips` for players, on the scene's clock."""

from __future__ import annotations

import bpy

from ...beyond_mocap.annotation import Timeline
from ...beyond_mocap.base.errors import InputError
from ..core.measure import Clock, scene_clock
from ..core.settings import BeyondMocapPlayer
from ..player import dots
from ..player.tracks import read_track
from . import lanes, lay_strips
from .lanes import PlacedMoment, PlacedSpan
from .strip_lines import said
from .written import written_words


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


def add_span(
    context: bpy.types.Context, player: BeyondMocapPlayer, start_s: float, end_s: float, words: tuple[str, ...]
) -> PlacedSpan:
    """One more span, in seconds on the track's clock; words as in the text form, "-word" for one that must not be.
    InputError where it is empty or its words are not of the form."""
    if end_s <= start_s:
        raise InputError("span", f"the end {end_s:g} is not after the start {start_s:g}", "START < END")
    span = said(" ".join(words), start_s, end_s)
    return lay_strips.add_span(with_lanes(context, player), span, scene_clock(context.scene))


def add_moment(
    context: bpy.types.Context, player: BeyondMocapPlayer, time_s: float, words: tuple[str, ...]
) -> PlacedMoment:
    """One more key moment, picked; InputError where its words are not of the form."""
    key = said(" ".join(words), time_s)
    return lay_strips.add_moment(with_lanes(context, player), key, scene_clock(context.scene))


def remove(player: BeyondMocapPlayer, placed: PlacedSpan | PlacedMoment) -> None:
    """Take a span or key moment away."""
    if isinstance(placed, PlacedSpan):
        lay_strips.remove_span(player.dot, placed.strip)
    else:
        lay_strips.remove_moment(player.dot, placed.strip, placed.index)


def moments(player: BeyondMocapPlayer, scene: bpy.types.Scene) -> list[PlacedMoment]:
    """All key moments by time; none where the player has no strips."""
    dot = dot_of(player, scene)
    return [] if dot is None else lanes.moments(dot, where(player))


def span_at(player: BeyondMocapPlayer, scene: bpy.types.Scene, seconds: float) -> PlacedSpan | None:
    """The span that holds at a time: one that is asked for, else an automatic one, else None."""
    dot = dot_of(player, scene)
    return None if dot is None else lanes.span_at(dot, seconds)


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


def _extent(dot: bpy.types.Object, clock: Clock) -> tuple[float, float] | None:
    """First and last second of the dot's keys."""
    frames = dots.keyed_frames(dot)
    return None if frames is None else (clock.seconds(frames[0]), clock.seconds(frames[1]))
