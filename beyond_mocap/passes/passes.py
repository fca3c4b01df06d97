"""Recipe for a passing scene: several players keep a ball in play (Ball handling).

`plan_passes` gives time, place and means of each strike and the flights of the ball; `build_player_motion` moves each
player; the ball's path is the flights, one after the other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from ..ball.physics import BALLS, Ball
from ..base.errors import InputError, UserCancelledError
from ..base.settings import find_setting
from ..library.library import Library
from ..motion.humanoid import estimate_stature
from ..motion.quaternion import multiply
from ..motion.track.ball_path import BallPath
from ..synthesis.body_size import to_player_size
from ..synthesis.take import Take
from .pass_plan import PassPlan, plan_passes
from .pass_problem import Site
from .pass_scene import BONES, PassScene, Player, Weights
from .player_motion import BodySettings, PlayerMotion, build_player_motion, estimate_least_seconds
from .player_path import HitOrder, Stance
from .pose_distance import BoneWeights
from .strike_choice import is_unlabelled_strike
from .strike_means import StrikeMeans

BALL_LIMITS: dict[str, Any] = {
    **{name: (find_setting("passes", name).least, find_setting("passes", name).most)
       for name in ("radius", "gravity", "linear_drag", "drag", "restitution")},
    "mass": (0.001, 20.0), "lift": ((0.0, 0.5, 0.0), (1.0, 10.0, 10.0)), "friction": (0.0, 5.0),
    "rolling": (0.01, 20.0), "spin_decay": (0.0, 20.0), "inertia": (0.1, 1.0),
}  # fmt: skip
"""Lowest and highest value of a ball's numbers."""
PLAN_SHARE = 0.3
"""Share of the whole work after which the plan is ready."""


@dataclass(frozen=True, eq=False)
class PlayerPasses:
    """One player of a played scene.

    Attributes:
        name: the player's name.
        take: motion, contacts and provenance.
        gaps: (K,) m between part and ball at each of their strikes; NaN where they miss.
        part_shifts: (K,) m by which the part was moved to meet the ball.
    """

    name: str
    take: Take
    gaps: np.ndarray
    part_shifts: np.ndarray


@dataclass(frozen=True, eq=False, kw_only=True)
class PlayedScene:
    """A passing scene as it is played.

    Attributes:
        scene: the request.
        kind: the ball.
        plan: strikes and flights.
        ball: the ball's path.
        players: in the scene's order.
        warnings: what differs from the request.
    """

    scene: PassScene
    kind: Ball
    plan: PassPlan
    ball: BallPath
    players: tuple[PlayerPasses, ...]
    warnings: tuple[str, ...]

    def find_gap(self, number: int) -> float:
        """Measure the distance in m between part and ball at a strike of the plan."""
        one = self.plan.strikes[number]
        own = sum(other.player == one.player for other in self.plan.strikes[:number])
        return float(next(player for player in self.players if player.name == one.player).gaps[own])


def synthesize_passes(library: Library, scene: PassScene, progress: Callable[[float, str], None] | None = None,
                      cancelled: Callable[[], bool] | None = None) -> PlayedScene:
    """Play a scene with the motions of a library. The same scene and library give the same bits.

    Args:
        library: the library.
        scene: the request.
        progress: receives the share of the work done and a short text.
        cancelled: whether to stop.
    Returns:
        The scene as it is played.
    Raises:
        InputError: for a part that the skeleton lacks, and for passes that no human can give.
        NotInLibraryError: if no clip of the library strikes with a part.
        UserCancelledError: if `cancelled` returns True.
    """
    report, stop = progress or (lambda share, text: None), cancelled or (lambda: False)
    plan = plan_scene(library, scene, lambda share, text: report(PLAN_SHARE * share, text), stop)
    path = build_ball_path(plan)
    players = []
    for number, player in enumerate(scene.players):
        if stop():
            raise UserCancelledError("cancelled")
        players.append(_build_motion(library, scene, plan, path=path, player=player,
                                     progress=_split_progress(report, number, scene.players), cancelled=stop))
    player_warnings = [f"{player.name}: {line}" for player, motion in zip(scene.players, players)
                       for line in motion.warnings]
    played = tuple(PlayerPasses(who.name, one.take, one.gaps, one.part_shifts) for who,
                   one in zip(scene.players, players))
    report(1.0, "Done")
    return PlayedScene(scene=scene, kind=build_ball(scene), plan=plan, ball=path, players=played,
                       warnings=(*plan.warnings, *list_unlabelled_strikes(library, plan), *player_warnings))


def list_unlabelled_strikes(library: Library, plan: PassPlan) -> list[str]:
    """List a warning for each part except the foot that strikes with motions without such labels."""
    clips: dict[str, set[str]] = {}
    for strike in plan.strikes:
        if strike.order.part in ("head", "chest", "hand", "tool") and is_unlabelled_strike(library, strike.order):
            clips.setdefault(strike.order.part, set()).add(library.clips[strike.order.clip].path)
    return [
        f"no labels of the library name strikes with the {part}; motions that look like one are taken from "
        f"{', '.join(sorted(paths))}"
        for part, paths in clips.items()
    ]


def _split_progress(report, number: int, players: tuple[Player, ...]):
    """Build the progress callback of one player's motion within the whole work."""
    def report_share(share: float, text: str) -> None:
        """Report the share of this player's work."""
        report(PLAN_SHARE + (1.0 - PLAN_SHARE) * (number + share) / len(players), f"{players[number].name}: {text}")

    return report_share


def plan_scene(library: Library, scene: PassScene, progress: Callable[[float, str], None] | None = None,
               cancelled: Callable[[], bool] | None = None) -> PassPlan:
    """Plan the strikes and flights of a scene, without motions, for live editing.

    Args:
        library: the library.
        scene: the request.
        progress: receives the share of the work done and a short text.
        cancelled: whether to stop.
    Returns:
        The plan.
    Raises:
        InputError, NotInLibraryError, UserCancelledError: as `synthesize_passes`.
    """
    scene = _apply_chance(scene)
    ball = build_ball(scene)
    sizes = {player.name: compute_size(player, library) for player in scene.players}
    return plan_passes(scene, _build_sites(library, scene, sizes), ball, need=_build_need(library, sizes),
                       cancelled=cancelled, progress=progress)


def build_ball(scene: PassScene) -> Ball:
    """Build the scene's ball.

    Raises:
        InputError: for an unknown kind, an unknown value, or values outside BALL_LIMITS.
    """
    choice = scene.ball
    if choice.kind not in BALLS:
        raise InputError("ball", f"the kind {choice.kind!r}", f"one of {', '.join(BALLS)}", "choose one of these")
    known = {entry.name for entry in fields(Ball)} - {"name"}
    for name in choice.changes:
        if name not in known:
            raise InputError("ball", f"{name!r}", f"one of {', '.join(sorted(known))}", "check the spelling")
    for name, value in choice.changes.items():
        low, high = BALL_LIMITS[name]
        if np.shape(value) != np.shape(low) or not np.all((np.array(low) <= value) & (value <= np.array(high))):
            raise InputError(f"ball: {name}", f"{value}", f"{low} to {high}")
    return replace(BALLS[choice.kind], **choice.changes)


def compute_size(player: Player, library: Library) -> float:
    """Compute the size of a player over that of the library's skeleton."""
    return player.height / estimate_stature(library.skeleton) if player.height else 1.0


def build_bone_weights(weights: Weights) -> BoneWeights:
    """Build the weights of eq. 1 for a scene: its factors times the default weights."""
    own = BoneWeights()
    factors = [weights.bones.get(bone, 1.0) for bone in BONES]
    return BoneWeights(
        position=tuple(weights.position * value * factor for value, factor in zip(own.position, factors)),
        velocity=tuple(weights.velocity * value * factor for value, factor in zip(own.velocity, factors)),
    )


def build_ball_path(plan: PassPlan) -> BallPath:
    """Build the ball's path: position and rotation at every frame of the scene."""
    times = np.arange(int(round(plan.seconds * plan.fps)) + 1) / plan.fps
    which = plan.flight_at(times)
    positions, rotations, last_rotation = np.empty((len(times), 3)), np.empty((len(times), 4)), np.array([1.0, 0.0, 0.0,
            0.0])
    for number, flight in enumerate(plan.flights):
        own = which == number
        positions[own] = flight.at(times[own])
        flight_rotations = flight.rotations(np.append(times[own], flight.end))
        # each flight starts with the rotation that the one before ended with
        rotations[own], last_rotation = multiply(flight_rotations[:-1], last_rotation), multiply(flight_rotations[-1],
                last_rotation)
    return BallPath(times, positions, np.ones(len(times), bool), rotations)


# -- the motions that each strike can use


def _apply_chance(scene: PassScene) -> PassScene:
    """Apply random errors: the first ball that is missed or dropped ends the rally."""
    order = list(scene.order)
    random = np.random.default_rng([scene.seed & (2**64 - 1), 1])
    for number, one in enumerate(order):
        draw = random.random()
        if one.error:
            break
        if draw < scene.missed + scene.dropped:
            order[number] = replace(one, error="missed" if draw < scene.missed else "dropped")
            break
    return replace(scene, passes=tuple(order[: number + 1]), repeat=1)


def _build_sites(library: Library, scene: PassScene, sizes: dict[str, float]) -> list[Site]:
    """Build the site of each strike."""
    means = StrikeMeans(library, scene, sizes)
    places = {player.name: np.array(player.place, float) for player in scene.players}
    out = []
    for number, one in enumerate(scene.passes):
        out.append(means.build_site(one.giver, places[one.giver], one, number + 1))
        if one.at is not None:
            places[one.receiver] = np.array(one.at, float)
    last = scene.passes[-1].receiver
    return [*out, means.build_site(last, places[last], None, len(scene.passes))]


def _build_need(library: Library, sizes: dict[str, float]):
    """Build the function that gives the seconds a player needs; a larger body moves as the library does, scaled."""
    def estimate_need(player: str, before: Stance | HitOrder, after: HitOrder) -> float:
        """Seconds that a player needs from one strike, or from standing, to the next."""
        return estimate_least_seconds(library, _to_library_size(before, sizes[player]),
                                      _to_library_size(after, sizes[player]))

    return estimate_need


# -- the players' motions


def _build_motion(library: Library, scene: PassScene, plan: PassPlan, path: BallPath, player: Player, progress,
                  cancelled) -> PlayerMotion:
    """Build one player's motion in their own size; the work is done in the library's size."""
    size = compute_size(player, library)
    orders = [_to_library_size(order, size) for order in plan.list_orders(player.name)]
    stance = _to_library_size(Stance(player.place, scene.find_facing(player.name)), size)
    ball = path if size == 1.0 else replace(path, positions=path.positions / size)
    settings = BodySettings(scene.transition, scene.watch, scene.seed, build_bone_weights(scene.weights))
    player_motion = build_player_motion(library, stance, orders, ball=ball, ball_radius=build_ball(scene).radius / size,
                                        fps=scene.fps, settings=settings, progress=progress,
                                        cancelled=cancelled)  # fmt: skip
    if size == 1.0:
        return player_motion
    scaled_take = to_player_size(player_motion.take, size, _scale_plan(player_motion.take.plan, size, player.height))
    return replace(player_motion, take=replace(scaled_take, ball=path), gaps=player_motion.gaps * size,
                   part_shifts=player_motion.part_shifts * size)


def _to_library_size(order, size: float):
    """Convert an order or stance of a player `size` times as large as the library to the library's size."""
    if size == 1.0:
        return order
    if isinstance(order, Stance):
        return replace(order, place=tuple(np.array(order.place) / size))
    place, ball = (tuple(np.array(values) / size) for values in (order.place, order.ball))
    return replace(order, place=place, ball=ball, tool=order.tool and order.tool.scale_to_library(size))


def _scale_plan(plan, size: float, height: float):
    """Scale the track of a take's plan to the player's size."""
    track = plan.track
    ball = None if track.ball is None else track.ball * size
    return replace(plan, track=replace(track, positions=track.positions * size, ball=ball), height=height)
