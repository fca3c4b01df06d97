"""The ball of imported tracking data, solved: as an object of its own, with its touches as proposals for key moments.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...beyond_mocap.ball.tracked.kinds import TOUCH_KINDS
from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.base.fixes import Fix
from ..core import channels
from ..core.measure import build_scene_clock, frames_per_second
from ..core.settings import BeyondMocapPlayer, find_active_player, to_absolute_path
from ..player import dots, tracks
from ..result import bake
from ..stage import ball
from ..timeline import label_tracks as lanes
from ..timeline import strip_writing as lay_strips
from ..timeline import strips
from ..timeline.strip_lines import parse_labels
from . import possession
from .settings import KEPT

if TYPE_CHECKING:
    from ...beyond_mocap.ball.tracked.solve import SolvedBall

BALL = "Solved Ball"
TOUCH_LABELS = {kind.name: " ".join(kind.labels) for kind in TOUCH_KINDS if kind.labels and kind.ball != "carries"}
"""Kind of a touch -> labels of its key moment. Dribbles are stretches and deflections are unintended: they have none.
"""

NEAR_SECONDS = 0.4  # s between a touch and an existing key moment within which no moment is added


@dataclass(frozen=True, eq=False)
class Order:
    """Order for solving the ball.

    Attributes:
        tracks: (name, track) of players with files of their own; empty for a match.
        path: tracking file of a match.
        metadata: its metadata file.
        provider: its provider.
        start: s; None: from the beginning.
        end: s; None: to the end.
    """

    tracks: tuple = ()
    path: str = ""
    metadata: str = ""
    provider: str = ""
    start: float | None = None
    end: float | None = None


def build_order(scene: bpy.types.Scene) -> Order:
    """Build the order: the match of the active player, or the tracks of all selected players with files of their own.

    Raises:
        InputError: if no player has a file.
    """
    settings = scene.beyond_mocap
    player = find_active_player(settings)
    if player is None or not player.tracking_file:
        raise InputError("tracking", "no file", "players with a tracking file", "import one in step 2",
                         fixes=(Fix("add_track"),))
    if player.feed_id:
        end = settings.section_end if settings.section_end > settings.section_start else None
        path, metadata = to_absolute_path(player.tracking_file), to_absolute_path(player.metadata_file)
        return Order((), path, metadata, provider=player.provider, start=settings.section_start, end=end)
    others = [one for one in settings.players if one.use and one != player and one.tracking_file and not one.feed_id]
    return Order(tuple((one.name, tracks.read_track(settings, one)) for one in (player, *others)))


def run_order(order: Order, progress, cancelled, _hurry) -> "SolvedBall":
    """Read the files and solve the ball. Does not use bpy."""
    from ...beyond_mocap.ball.tracked.solve import solve_ball

    if order.tracks:
        source = join_tracks(order.tracks)
    else:
        progress(0.0, "Reading the match")
        source = tracks.read_match(order.path, order.metadata, order.provider)
    return solve_ball(source, progress, cancelled, order.start, order.end)


def join_tracks(named: tuple):
    """Join the tracks of several players, (name, track) each, to a match at the first one's times; one track stays a
    track.
    """
    from ...beyond_mocap.ball.tracked.solve import PITCH
    from ...beyond_mocap.files.tracking.tracking import Match, MatchPlayer

    name, first = named[0]
    if len(named) == 1:
        return replace(first, name=name)
    times = first.times
    places = np.array([[np.interp(times, track.times, track.positions[:, axis], np.nan, np.nan) for axis in range(2)]
                       for _, track in named]).swapaxes(1, 2)
    height = np.where(first.ball_height_known, first.ball[:, 2], np.nan)
    players = tuple(MatchPlayer(name, "", name, -1) for name, _ in named)
    fps = 1.0 / float(np.median(np.diff(times)))
    samples = np.column_stack([first.ball[:, :2], height])
    return Match(times=times, players=players, positions=places, ball=samples, length=PITCH[0], width=PITCH[1], fps=fps,
                 provider="csv", periods=((float(times[0]), float(times[-1])),))


def write_ball(scene: bpy.types.Scene, solved: "SolvedBall") -> bpy.types.Object:
    """Create or update the solved ball on every frame of the scene, and list its touches.

    Returns:
        The ball.
    """
    from ...beyond_mocap.motion.track.ball_path import BallPath

    settings, room = scene.beyond_mocap_passes, bake.find_or_create_collection(scene)
    own = next((thing for thing in room.objects if thing.get(KEPT) == BALL), None)
    target = own or ball.create_ball(bpy.context, BALL, room)
    channels.check_local(target)
    channels.check_editable(target)
    possession.check_unaimed(target)
    clock, (start, end) = build_scene_clock(scene), (float(solved.times[0]), float(solved.times[-1]))
    frames = np.arange(np.ceil(clock.to_frame(start) - 1e-4), np.floor(clock.to_frame(end) + 1e-4) + 1)
    # seconds of the scene's frames on the track's clock
    times = clock.start_time + (frames - clock.start_frame) / frames_per_second(scene)
    path = BallPath(times, solved.ball.at(times), np.ones(len(times), bool))
    target[KEPT] = BALL  # marks it, whatever its name is

    def write_path() -> None:
        """Write the path to the ball's action."""
        channels.remove_marked_action(target, KEPT)
        ball.write_trajectory(target, path, scene, bake.compute_frame(scene, float(times[0])))[KEPT] = True

    possession.replace_own_action(scene, target, write_path)
    _list_touches(scene, solved)
    settings.solved = "\n".join(list_figures(solved))
    return target


def accept_touches(context: bpy.types.Context, only: str = "") -> tuple[int, list[str]]:
    """Add key moments for the selected touches, of one player or of all.

    Returns:
        count: number of key moments added.
        messages: one line for each touch that was not used.
    """
    settings, messages, count = context.scene.beyond_mocap, [], 0
    players = {player.name: player for player in settings.players}
    for touch in context.scene.beyond_mocap_passes.touches:
        if not touch.use or not touch.words or touch.name not in players or (only and touch.name != only):
            continue
        player = players[touch.name]
        try:
            line = _find_obstacle(context, player, touch)
        except InputError as error:  # this player's track or labels cannot be read; go on with the others
            line = str(error)
        if line:
            messages.append(line)
            continue
        lay_strips.add_moment(player.dot, parse_labels(touch.words, round(touch.time, 3)),
                              build_scene_clock(context.scene))
        touch.use = False
        count += 1
    return count, messages


def list_figures(solved: "SolvedBall") -> list[str]:
    """List lines about a solved ball for the panel."""
    residual = solved.residuals[solved.measured & np.isfinite(solved.residuals)]
    figures = [f"Touches: {len(solved.touches)}", f"Confidence: {solved.confidence:.0%}"]
    if len(residual):
        figures.append(f"Median residual: {100 * np.median(residual):.0f} cm")
    figures += [f"Filled samples: {solved.filled.mean():.0%}", f"Outliers: {int(solved.outlier.sum())}"]
    figures += [f"{end.kind.capitalize()}: {end.time:.2f} s" for end in solved.ends]
    return figures + list(solved.notes)


def _list_touches(scene, solved: "SolvedBall") -> None:
    """List the touches as rows; players are named by their ids in the feed."""
    names = {player.feed_id: player.name for player in scene.beyond_mocap.players if player.feed_id}
    rows = scene.beyond_mocap_passes.touches
    rows.clear()
    for touch in solved.touches:
        row = rows.add()
        row.name = names.get(touch.player, touch.player)
        row.player, row.time, row.part, row.kind = touch.player, touch.time, touch.part, touch.kind
        row.words, row.confidence = TOUCH_LABELS.get(touch.kind, ""), touch.confidence
        row.use = bool(row.words) and row.name in {player.name for player in scene.beyond_mocap.players}
    scene.beyond_mocap_passes.active_touch = 0


def _find_obstacle(context, player: BeyondMocapPlayer, touch) -> str:
    """Describe why a touch becomes no key moment of a player, or return ""; the player has a timeline afterwards."""
    target = strips.ensure_label_tracks(context, player)
    clock = build_scene_clock(context.scene)
    first, last = (clock.to_seconds(frame) for frame in dots.find_key_range(player.dot) or (-np.inf, np.inf))
    if not first <= touch.time <= last:
        return f"{player.name}: the touch at {touch.time:.2f} s is outside the player's track"
    near = [moment for moment in lanes.list_moments(target) if abs(moment.key.time - touch.time) < NEAR_SECONDS]
    if near:
        existing = f"{player.name}: there is a key moment at {near[0].key.time:.2f} s"
        return f"{existing}, so the touch at {touch.time:.2f} s adds none"
    return ""
