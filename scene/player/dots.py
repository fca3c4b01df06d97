"""The dots: an Empty for each player that follows the track in the scene's frames, and one for the ball.

A player's dot carries the strips of its timeline, and the data to add its player to the list in another file.
"""

from typing import TYPE_CHECKING

import bpy
import numpy as np

from ..core import channels, names
from ..core.measure import Clock, build_scene_clock, units_per_metre
from ..core.settings import BeyondMocapPlayer, BeyondMocapSettings, to_absolute_path, to_setting_path
from ..result import bake
from . import tracks

if TYPE_CHECKING:
    from ...beyond_mocap.motion.track import Track

BALL = "Ball dot"
MARK = "beyond_mocap_dot"  # on actions that move a dot and may be regenerated
SIZE, BALL_SIZE = 0.4, 0.11  # metres
SMALL = 0.05  # metres: a cross in place of a dot whose player or ball is shown
BALL_RGB = (0.9, 0.9, 0.9)
FILES = ("tracking_file", "metadata_file")  # absolute: a dot may be appended to a file in another folder
ORIGIN = (*FILES, "feed_id", "provider", "shirt")


class BeyondMocapDot(bpy.types.PropertyGroup):
    """The player of this dot: what another file needs to continue with this player"""

    attached_to = ("Object.beyond_mocap_dot",)
    player: bpy.props.StringProperty(name="Player", description="The player's name")
    tracking_file: bpy.props.StringProperty(name="Tracking", description="The file with the player's positions")
    metadata_file: bpy.props.StringProperty(name="Metadata", description="The provider's second file")
    feed_id: bpy.props.StringProperty(name="ID in the Feed", description="Which player of the tracking file this is")
    provider: bpy.props.StringProperty(name="Provider", description="Provider whose format the tracking file has")
    clock: bpy.props.StringProperty(name="Clock", description="Start frame, seconds there and rate of its keys")
    shirt: bpy.props.FloatVectorProperty(name="Shirt", subtype="COLOR", description="Colour of the player's shirt")


def ensure_dot(context: bpy.types.Context, player: BeyondMocapPlayer) -> bpy.types.Object:
    """Return the player's dot; create and animate it where there is none. InputError where the track cannot be read."""
    collection = bake.find_or_create_collection(context.scene)
    if player.dot is not None:
        if player.dot.name not in context.scene.objects:  # deleted in the view; the player still refers to it
            collection.objects.link(player.dot)
        return player.dot
    track = tracks.read_track(context.scene.beyond_mocap, player)
    dot = _create_empty(context.scene, f"{player.name} dot", SIZE, collection)
    player.dot = dot
    update_dot(player)
    clock = build_scene_clock(context.scene)
    seconds, places = _select_measured(track.times, track.positions)
    _animate_dot(context.scene, dot, seconds, np.pad(places, ((0, 0), (0, 1))), clock)
    if names.find_named(collection.objects, BALL) is None:
        _create_ball_dot(context.scene, track, collection, clock)
    return dot


def update_dot_track(context: bpy.types.Context, player: BeyondMocapPlayer) -> None:
    """Update the dot's keys to the player's current track, unless the user has given it other keys."""
    dot = player.dot
    action = channels.find_playing_action(dot)[0] if dot is not None else None
    if action is None or not action.get(MARK):
        return
    track = tracks.read_track(context.scene.beyond_mocap, player)
    seconds, places = _select_measured(track.times, track.positions)
    channels.remove_marked_action(dot, MARK)
    _animate_dot(context.scene, dot, seconds, np.pad(places, ((0, 0), (0, 1))), build_scene_clock(context.scene))


def update_dot(player: BeyondMocapPlayer) -> None:
    """Update the dot's name, colour and data from its player."""
    dot = player.dot
    if dot is None:
        return
    dot.name, dot.color = f"{player.name} dot", (*player.shirt, 1.0)
    dot.beyond_mocap_dot.player = player.name
    for name in ORIGIN:
        value = getattr(player, name)
        setattr(dot.beyond_mocap_dot, name, to_absolute_path(value) if name in FILES else value)


def update_displays(scene: bpy.types.Scene, shown: list[BeyondMocapPlayer]) -> None:
    """Show dots as small crosses where a body or the ball is shown in their place, else as spheres; those that a user
    displays differently stay as they are.

    Args:
        scene: the scene.
        shown: players whose takes are shown.
    """
    for player in scene.beyond_mocap.players:
        if player.dot is not None and player.dot.library is None:
            _update_display(scene, player.dot, SIZE, player in shown)
    room = bake.find_or_create_collection(scene)
    ball = names.find_named(room.objects, BALL)
    if ball is not None and ball.library is None:
        _update_display(scene, ball, BALL_SIZE, bool(shown) and names.find_named(room.objects, bake.BALL) is not None)


def _update_display(scene: bpy.types.Scene, dot: bpy.types.Object, size: float, is_covered: bool) -> None:
    units = units_per_metre(scene)
    large, small = ("SPHERE", float(np.float32(size * units))), ("PLAIN_AXES", float(np.float32(SMALL * units)))
    if (dot.empty_display_type, dot.empty_display_size) == (large if is_covered else small):
        dot.empty_display_type, dot.empty_display_size = small if is_covered else large


def remove_dot(scene: bpy.types.Scene, player: BeyondMocapPlayer) -> None:
    """Remove the player's dot with its strips from the file; with the last one the ball's too."""
    dot, player.dot = player.dot, None
    if dot is not None:
        _delete_dot(dot)
    if not any(other.dot for other in scene.beyond_mocap.players):
        ball = names.find_named(bake.find_or_create_collection(scene).objects, BALL)
        if ball is not None:
            _delete_dot(ball)


def list_orphan_dots(context: bpy.types.Context) -> list[bpy.types.Object]:
    """List the selected dots of players that are in no list of this scene."""
    owned = {player.dot for player in context.scene.beyond_mocap.players}
    return [dot for dot in context.selected_objects if dot.beyond_mocap_dot.player and dot not in owned]


def add_player_for_dot(settings: BeyondMocapSettings, dot: bpy.types.Object, name: str) -> BeyondMocapPlayer:
    """Add a player to this scene who owns the dot."""
    origin = {key: getattr(dot.beyond_mocap_dot, key) for key in ORIGIN}
    player = settings.players.add()
    for key, value in origin.items():
        setattr(player, key, to_setting_path(value) if key in FILES and value else value)
    player.dot = dot
    player.name = name
    settings.active_player = len(settings.players) - 1
    return player


def list_dots(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """List the dots of a scene, the ball's too, that move as their tracks say."""
    playing = ((thing, channels.find_playing_action(thing)[0]) for thing in scene.objects)
    return [thing for thing, action in playing if action is not None and action.get(MARK)]


def find_first_second(dot: bpy.types.Object) -> float:
    """Return the track's time in seconds at the dot's first key."""
    clock, frames = Clock.from_text(dot.beyond_mocap_dot.clock), find_key_range(dot)
    return clock.to_seconds(frames[0]) if clock and frames else 0.0


def move_keys(dot: bpy.types.Object, new: Clock) -> bool:
    """Move a dot's keys to the frames of another clock; returns whether anything changed."""
    old = Clock.from_text(dot.beyond_mocap_dot.clock)
    action, slot = channels.find_playing_action(dot)
    if old is None or old == new or action is None or not action.get(MARK):
        return False
    for curve in channels.collect_curves(action, slot).values():
        keys = np.empty(2 * len(curve.keyframe_points), np.float32)
        curve.keyframe_points.foreach_get("co", keys)
        seconds = old.start_time + (keys[::2].astype(float) - old.start_frame) / old.fps
        keys[::2] = new.start_frame + (seconds - new.start_time) * new.fps
        curve.keyframe_points.foreach_set("co", keys)
        curve.update()
    dot.beyond_mocap_dot.clock = new.to_text()
    return True


def find_key_range(dot: bpy.types.Object) -> tuple[float, float] | None:
    """Return the first and last frame on which the dot has a key; None where it has none."""
    action, slot = channels.find_playing_action(dot)
    ends = [curve.range() for curve in channels.collect_curves(action, slot).values()] if action else []
    return (min(low for low, _ in ends), max(high for _, high in ends)) if ends else None


def _create_ball_dot(scene: bpy.types.Scene, track: "Track", collection: bpy.types.Collection, clock: Clock) -> None:
    places = np.where(np.isnan(track.ball), [np.nan, np.nan, BALL_SIZE], track.ball)
    seconds, places = _select_measured(track.times, places)
    if len(seconds):
        dot = _create_empty(scene, BALL, BALL_SIZE, collection)
        dot.color = (*BALL_RGB, 1.0)
        _animate_dot(scene, dot, seconds, places, clock)


def _create_empty(scene: bpy.types.Scene, name: str, size: float, collection: bpy.types.Collection) -> bpy.types.Object:
    dot = bpy.data.objects.new(name, None)
    dot.empty_display_type, dot.empty_display_size = "SPHERE", size * units_per_metre(scene)
    collection.objects.link(dot)
    return dot


def _select_measured(times: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Select the samples with a time and a position, each time once, in order."""
    known = np.isfinite(times) & np.isfinite(places).all(axis=1)
    seconds, first = np.unique(times[known], return_index=True)
    return seconds, places[known][first]


def _animate_dot(scene: bpy.types.Scene, dot: bpy.types.Object, seconds: np.ndarray, places: np.ndarray, clock: Clock):
    """Add a key for each sample: seconds (N,), places (N, 3) metres."""
    frames = clock.start_frame + (seconds - clock.start_time) * clock.fps
    curves = {"location": ("Object Transforms", places * units_per_metre(scene))}
    channels.create_action(dot, f"{dot.name} track", frames, curves)[MARK] = True
    dot.beyond_mocap_dot.clock = clock.to_text()


def _delete_dot(dot: bpy.types.Object) -> None:
    """Remove an object and the actions that only it plays."""
    data = dot.animation_data
    actions = {strip.action for track in data.nla_tracks for strip in track.strips} | {data.action} if data else set()
    bpy.data.objects.remove(dot)
    for action in actions - {None}:
        if action.users == 0:
            bpy.data.actions.remove(action)
