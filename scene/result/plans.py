"""From settings to plans: players, the core's plans, and the selected seconds."""

from __future__ import annotations

import bpy
import numpy as np

from ...beyond_mocap.annotation import Timeline
from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.base.fixes import Fix
from ...beyond_mocap.base.time_series import interpolate_columns
from ...beyond_mocap.motion.track import Track, clean_track
from ...beyond_mocap.synthesis.heading_request import HeadingKey
from ...beyond_mocap.synthesis.plan import Plan
from ..core.measure import build_scene_clock
from ..core.properties import read_property_values
from ..core.settings import BeyondMocapPlayer, BeyondMocapSettings, find_active_player, to_absolute_path
from ..player import contact_edits, drawn_track, pins
from ..player.tracks import read_track
from ..timeline import label_tracks as lanes
from ..timeline import strips
from . import blocks

FACING_SECONDS = 0.15  # s between two headings towards an object that moves; shorter than the plan's own decisions


def list_selected_players(settings: BeyondMocapSettings) -> list[BeyondMocapPlayer]:
    """List the players that are switched on. Raises InputError if there is none."""
    players = [player for player in settings.players if player.use]
    if not players:
        raise InputError("players", "no players are selected", "at least one", "import tracking in step 2",
                         fixes=(Fix("use_all_players"), Fix("add_track")))
    return players


def build_plan(settings: BeyondMocapSettings, player: BeyondMocapPlayer,
               still: bool = False) -> tuple[Plan, tuple[str, ...]]:
    """Build the plan of one player.

    Args:
        settings: of the scene.
        player: the player.
        still: see `drawn_track.read_drawn_track`.
    Returns:
        The plan, and warnings about the track.
    """
    track, found = clean_track(read_track(settings, player, still))
    plan = Plan(track=track, timeline=read_timeline(player, settings.rate, track),
                library=to_absolute_path(settings.library_folder), pins=pins.read_pins(player.id_data, player),
                heading_keys=read_heading_keys(settings, player, still),
                contact_edits=contact_edits.read_contact_edits(player),
                **read_property_values(Plan, settings, "synthesis"), **read_property_values(Plan, player, "player"))
    return plan, found.warnings


def read_heading_keys(settings: BeyondMocapSettings, player: BeyondMocapPlayer,
                      still: bool = False) -> tuple[HeadingKey, ...]:
    """Read a player's heading keys; one towards an object that moves while it holds becomes several.

    Args:
        settings: of the scene.
        player: the player.
        still: see `drawn_track.read_drawn_track`.
    Raises:
        InputError: if the object of a key is missing, or is the player's own.
    """
    return tuple(found for key in player.heading_keys for found in _read_heading_key(settings, player, key, still))


def _read_heading_key(settings, player, key, still: bool) -> list[HeadingKey]:
    start, hold = round(key.time, 6), round(key.hold, 6)
    if key.faces == "DIRECTION":
        return [HeadingKey(start, heading=round(key.heading, 6), hold=hold)]
    times = np.unique(np.round(np.append(np.arange(start, start + hold, FACING_SECONDS), start + hold), 6))
    places = _sample_target(settings, player, key, times, still)
    if (places == places[0]).all():
        return [HeadingKey(start, target=tuple(places[0].tolist()), hold=hold)]
    return [HeadingKey(time, target=tuple(place)) for time, place in zip(times.tolist(), places.tolist())]


def _sample_target(settings, player, key, times: np.ndarray, still: bool) -> np.ndarray:
    """Sample where the object of a key is, (T, 2) m at times (T,) s; a player is where their track is."""
    target = key.find_target()
    where, step = f"player {player.name}, heading key at {key.time:.2f} s", "choose one in the list, or remove the key"
    if target is None:
        raise InputError(where, "its object is missing", "an object of the scene", step)
    owner = next((other for other in settings.players if target in (other.dot, other.body)), None)
    if owner == player:
        raise InputError(where, f"{target.name}, the player's own", "another object", step)
    if owner is None:
        places = drawn_track.sample_object(player.id_data, target, times, still)
    else:
        track, _ = clean_track(read_track(settings, owner, still))
        places = interpolate_columns(times, track.times, track.positions)
    return np.round(places, 6)


def read_timeline(player: BeyondMocapPlayer, fps: float, track: Track) -> Timeline:
    """Read the player's labels: from their strips, else from the text, else from the file, else none (all
    automatic).
    """
    timeline = strips.read_player_timeline(player, player.id_data)
    return strips.read_written_labels(player, fps, track) if timeline is None else timeline


def describe_label_source(player: BeyondMocapPlayer) -> str:
    """Describe where the player's labels are written, for messages."""
    return strips.describe_label_source(player) if strips.find_dot(player,
                                                                   player.id_data) is None else strips.describe_strips(
        player)


def find_selected_range(scene: bpy.types.Scene) -> tuple[BeyondMocapPlayer, float, float]:
    """Find the selected player and seconds on the track's clock. Raises InputError without a selection."""
    clock = build_scene_clock(scene)
    for player in scene.beyond_mocap.players:
        frames = _find_result_range(player) or _find_label_range(player, scene)
        if frames is not None:
            return player, clock.to_seconds(frames[0]), clock.to_seconds(frames[1])
    player = find_shown_player(scene)
    if player is not None and scene.use_preview_range:
        return player, clock.to_seconds(scene.frame_preview_start), clock.to_seconds(scene.frame_preview_end)
    raise InputError("resynthesize", "no range of time is selected", "a selected strip or a preview range",
                     "select a strip in the NLA editor, or press P in the timeline and draw a range")


def find_shown_player(scene: bpy.types.Scene) -> BeyondMocapPlayer | None:
    """Find the active player if they have a take; else None."""
    player = find_active_player(scene.beyond_mocap)
    return player if player is not None and player.take else None


def _find_result_range(player: BeyondMocapPlayer) -> tuple[float, float] | None:
    """Find the frames of the selected strips of an applied result."""
    track = blocks.find_track(player.body) if player.body is not None else None
    chosen = [strip for strip in track.strips if strip.select] if track is not None and player.body.select_get() else []
    if not chosen or len(chosen) == len(track.strips) > 1:
        return None
    return min(strip.frame_start for strip in chosen), max(strip.frame_end for strip in chosen)


def _find_label_range(player: BeyondMocapPlayer, scene: bpy.types.Scene) -> tuple[float, float] | None:
    """Find the frames of the selected label strips of a player's selected dot."""
    dot = strips.find_dot(player, scene)
    if dot is None or not player.take or not dot.select_get():
        return None
    chosen = [strip for _, strip in lanes.iter_strips(dot) if strip.select
              and strip.action.beyond_mocap.kind != "moments"]
    if not chosen:
        return None
    return min(strip.frame_start for strip in chosen), max(strip.frame_end for strip in chosen)
