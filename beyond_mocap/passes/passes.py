"""The recipe of a passing scene: several players keep a ball going (Ball handling).

`passes.pass_plan` says when, where and with what each of them strikes and how the ball flies; `bodies` moves each
player; the ball's path is the flights, one after the other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from ..ball.contact import Tool
from ..ball.physics import BALLS, Ball
from ..base.errors import Cancelled, InputError, NotInLibrary
from ..base.settings import setting
from ..library.library import Library
from ..motion.humanoid import stature
from ..motion.quaternion import multiply
from ..motion.track.ball_path import BallPath
from ..synthesis.own_size import in_own_size
from ..synthesis.take import Take
from .bodies import BodySettings, PlayerMotion, least_seconds, player_motion
from .hit_library import MatchWeights
from .hits import HitMotion, strongest
from .links import BoneWeights
from .pass_court import Site
from .pass_plan import PassPlan, plan_passes
from .pass_scene import BONES, Pass, PassScene, Player, Weights
from .strike_choice import Choice, StrikeMoments, strike_moments, unsaid
from .way import HitOrder, Stance

MOST_HITS = 24
"""Hit motions that are looked at for one strike, those that suit its kind best."""
BALL_LIMITS: dict[str, Any] = {
    **{name: (setting("passes", name).least, setting("passes", name).most)
       for name in ("radius", "gravity", "linear_drag", "drag", "restitution")},
    "mass": (0.001, 20.0), "lift": ((0.0, 0.5, 0.0), (1.0, 10.0, 10.0)), "friction": (0.0, 5.0),
    "rolling": (0.01, 20.0), "spin_decay": (0.0, 20.0), "inertia": (0.1, 1.0),
}  # fmt: skip
"""Least and most of a ball's numbers."""
PLANNED = 0.3
"""Share of the whole work after which the plan stands."""
_SIDED = ("foot", "hand", "tool")


@dataclass(frozen=True, eq=False)
class PlayerPasses:
    """One player of the scene. take: his motion, contacts and where its frames came from; gaps (K,) m between part and
    ball at each of his strikes (NaN where he misses), moved (K,) m that the part was moved for it."""

    name: str
    take: Take
    gaps: np.ndarray
    moved: np.ndarray


@dataclass(frozen=True, eq=False, kw_only=True)
class Passes:
    """A passing scene as it is played. plan: strikes and flights; ball: its path, kind the ball; players in the scene's
    order; warnings: what could not be kept."""

    scene: PassScene
    kind: Ball
    plan: PassPlan
    ball: BallPath
    players: tuple[PlayerPasses, ...]
    warnings: tuple[str, ...]

    def gap(self, number: int) -> float:
        """Metres between part and ball at a strike of the plan."""
        one = self.plan.strikes[number]
        own = sum(other.player == one.player for other in self.plan.strikes[:number])
        return float(next(player for player in self.players if player.name == one.player).gaps[own])


def passes(library: Library, scene: PassScene, progress: Callable[[float, str], None] | None = None,
           cancelled: Callable[[], bool] | None = None) -> Passes:
    """The scene played with the motions of a library. The same scene and library give the same bits.

    InputError for a part that the skeleton lacks, and for passes that no human can give; NotInLibrary where nothing in
    the library strikes with a part; Cancelled."""
    report, stop = progress or (lambda share, text: None), cancelled or (lambda: False)
    plan = planned(library, scene, lambda share, text: report(PLANNED * share, text), stop)
    path = ball_path(plan)
    players = []
    for number, player in enumerate(scene.players):
        if stop():
            raise Cancelled("cancelled")
        players.append(_played(library, scene, plan, path=path, player=player,
                               progress=_part_of(report, number, scene.players), cancelled=stop))
    told = [f"{player.name}: {line}" for player, motion in zip(scene.players, players) for line in motion.warnings]
    moved = tuple(PlayerPasses(who.name, one.take, one.gaps, one.moved) for who, one in zip(scene.players, players))
    report(1.0, "Done")
    return Passes(scene=scene, kind=ball_of(scene), plan=plan, ball=path, players=moved,
                  warnings=(*plan.warnings, *list_unlabelled_strikes(library, plan), *told))


def list_unlabelled_strikes(library: Library, plan: PassPlan) -> list[str]:
    """A line for each part but the foot that strikes with motions whose words say nothing of it."""
    clips: dict[str, set[str]] = {}
    for strike in plan.strikes:
        if strike.order.part in ("head", "chest", "hand", "tool") and unsaid(library, strike.order):
            clips.setdefault(strike.order.part, set()).add(library.clips[strike.order.clip].path)
    return [
        f"no words of the library tell of strikes with the {part}; what moves it like one is taken from "
        f"{', '.join(sorted(paths))}"
        for part, paths in clips.items()
    ]


def _part_of(report, number: int, players: tuple[Player, ...]):
    """The progress of one player's motion among all."""
    def told(share: float, text: str) -> None:
        report(PLANNED + (1.0 - PLANNED) * (number + share) / len(players), f"{players[number].name}: {text}")

    return told


def planned(library: Library, scene: PassScene, progress: Callable[[float, str], None] | None = None,
            cancelled: Callable[[], bool] | None = None) -> PassPlan:
    """Strikes and flights of a scene alone, for live editing. Errors as for `passes`."""
    scene = _with_chance(scene)
    ball = ball_of(scene)
    sizes = {player.name: size_of(player, library) for player in scene.players}
    return plan_passes(scene, _sites(library, scene, sizes), ball, need=_needs(library, sizes), cancelled=cancelled,
                       progress=progress)


def ball_of(scene: PassScene) -> Ball:
    """The scene's ball. InputError for an unknown kind, and for numbers that no ball has."""
    choice = scene.ball
    if choice.kind not in BALLS:
        raise InputError("ball", f"the kind {choice.kind!r}", f"one of {', '.join(BALLS)}")
    known = {entry.name for entry in fields(Ball)} - {"name"}
    for name in choice.changes:
        if name not in known:
            raise InputError("ball", f"{name!r}", f"one of {', '.join(sorted(known))}", "check the spelling")
    for name, value in choice.changes.items():
        low, high = BALL_LIMITS[name]
        if np.shape(value) != np.shape(low) or not np.all((np.array(low) <= value) & (value <= np.array(high))):
            raise InputError(f"ball: {name}", f"{value}", f"{low} to {high}")
    return replace(BALLS[choice.kind], **choice.changes)


def size_of(player: Player, library: Library) -> float:
    """How many times as large as the library's skeleton a player is."""
    return player.height / stature(library.skeleton) if player.height else 1.0


def bone_weights(weights: Weights) -> BoneWeights:
    """The weights of eq. 1 that a scene asks for: so many times the usual ones."""
    own = BoneWeights()
    factors = [weights.bones.get(bone, 1.0) for bone in BONES]
    return BoneWeights(
        position=tuple(weights.position * value * factor for value, factor in zip(own.position, factors)),
        velocity=tuple(weights.velocity * value * factor for value, factor in zip(own.velocity, factors)),
    )


def ball_path(plan: PassPlan) -> BallPath:
    """The ball at every frame of the scene, and how it has turned."""
    times = np.arange(int(round(plan.seconds * plan.fps)) + 1) / plan.fps
    which = plan.flight_at(times)
    positions, rotations, turned = np.empty((len(times), 3)), np.empty((len(times), 4)), np.array([1.0, 0.0, 0.0, 0.0])
    for number, flight in enumerate(plan.flights):
        own = which == number
        positions[own] = flight.at(times[own])
        way = flight.rotations(np.append(times[own], flight.end))
        rotations[own], turned = multiply(way[:-1], turned), multiply(way[-1], turned)
    return BallPath(times, positions, np.ones(len(times), bool), rotations)


# -- what each strike can be made with


def _with_chance(scene: PassScene) -> PassScene:
    """The scene with the errors that chance brings: the first ball that is missed or dropped ends the rally."""
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


def _sites(library: Library, scene: PassScene, sizes: dict[str, float]) -> list[Site]:
    """Where and with what each strike is made."""
    reach = _Reach(library, scene, sizes)
    places = {player.name: np.array(player.place, float) for player in scene.players}
    out = []
    for number, one in enumerate(scene.passes):
        out.append(reach.site(one.giver, places[one.giver], one, number + 1))
        if one.at is not None:
            places[one.receiver] = np.array(one.at, float)
    last = scene.passes[-1].receiver
    return [*out, reach.site(last, places[last], None, len(scene.passes))]


class _Reach:
    """What the players can strike with; each question is answered once."""

    def __init__(self, library: Library, scene: PassScene, sizes: dict[str, float]):
        self.library, self.scene, self.sizes = library, scene, sizes
        self._choices: dict[tuple[str, Tool | None], Choice] = {}
        self._moments: dict[tuple, StrikeMoments] = {}

    def site(self, name: str, place: np.ndarray, one: Pass | None, number: int) -> Site:
        """A strike of one player; `one`: the pass that goes out, `number`: which pass an error names."""
        player = self.scene.player(name)
        part = (one and one.part) or player.part
        side = player.side if one is None or one.side is None else one.side
        tool = (player.tool or Tool()) if part == "tool" else None
        kind = "receive" if one is None else one.kind
        try:
            size, example = self.sizes[name], one.example if one else None
            moments = self._reached(part, side, tool and tool.for_body(size), size=size, kind=kind, example=example)
        except InputError as error:
            raise InputError(f"pass {number}, {name}", str(error)) from None
        return Site(player=name, place=place, facing=self.scene.facing(name), kind=kind, part=part, tool=tool,
                    size=size, moments=moments, asked=one)

    def _reached(self, part, side, tool, size: float, kind: str, example) -> StrikeMoments:
        key = (part, side, tool, size, kind, example)
        if key not in self._moments:
            if (part, tool) not in self._choices:
                self._choices[part, tool] = Choice.of(self.library, part, tool)
            own, wanted = self._choices[part, tool], side if part in _SIDED else ""
            if example is None:
                hits = own.of_kind(kind, wanted)[:MOST_HITS]
            else:
                order, _ = own.measured.match(self._example(example, part, side, tool), self._weights(), wanted or None)
                hits = tuple(own.hits[index] for index in order[:1])
            if not hits:
                with_what = f"the {side} {part}" if wanted else part
                others = self._others()
                other = f"ask for another part ({', '.join(others)}) or " if others else ""
                message = f"no clip of the library strikes with {with_what}; {other}add clips that do"
                raise NotInLibrary(message, others)
            self._moments[key] = strike_moments(self.library, hits, tool, size)
        return self._moments[key]

    def _others(self) -> tuple[str, ...]:
        """Parts with which something in the library strikes."""
        return tuple(part for part in ("foot", "head", "chest", "hand") if Choice.of(self.library, part).hits)

    def _weights(self) -> MatchWeights:
        own, asked = MatchWeights(), self.scene.weights
        return MatchWeights(own.speed * asked.speed, own.vector * asked.vectors, own.time * asked.times)

    def _example(self, example, part: str, side: str, tool: Tool | None) -> HitMotion:
        """The strongest hit motion in a stretch of a recording, or the one that is given."""
        if example.hit is not None:
            return example.hit
        clip = next((clip for clip in self.library.clips if clip.path == example.clip and not clip.mirrored), None)
        if clip is None:
            names = ", ".join(sorted({clip.path for clip in self.library.clips if not clip.made})[:5])
            raise InputError("example", f"no recording {example.clip!r} in the library", f"one such as {names}")
        motion = clip.recording
        first = int(np.floor(example.start * motion.fps))
        last = len(motion) if example.end is None else int(np.ceil(example.end * motion.fps)) + 1
        if first > len(motion) - 3:
            found = f"{example.clip} from {example.start:g} s"
            raise InputError("example", found, f"seconds up to {motion.duration:.2f}")
        found = strongest(motion.frames(first, min(last, len(motion))), part, side, tool)
        if found is None:
            raise InputError("example", f"no strike by {part} in {example.clip} there", "a stretch with a whole strike")
        return found


def _needs(library: Library, sizes: dict[str, float]):
    """Seconds that a player needs between two strikes; a larger one moves as the library does, only larger."""
    def need(player: str, before: Stance | HitOrder, after: HitOrder) -> float:
        return least_seconds(library, _sized(before, sizes[player]), _sized(after, sizes[player]))

    return need


# -- the bodies


def _played(library: Library, scene: PassScene, plan: PassPlan, path: BallPath, player: Player, progress,
            cancelled) -> PlayerMotion:
    """One player's motion in his own size; the work is done in the library's."""
    size = size_of(player, library)
    orders = [_sized(order, size) for order in plan.orders(player.name)]
    stance = _sized(Stance(player.place, scene.facing(player.name)), size)
    ball = path if size == 1.0 else replace(path, positions=path.positions / size)
    settings = BodySettings(scene.transition, scene.watch, scene.seed, bone_weights(scene.weights))
    moved = player_motion(library, stance, orders, ball=ball, ball_radius=ball_of(scene).radius / size,
                          fps=scene.fps, settings=settings, progress=progress,
                          cancelled=cancelled)  # fmt: skip
    if size == 1.0:
        return moved
    grown = in_own_size(moved.take, size, _grown_plan(moved.take.plan, size, player.height))
    return replace(moved, take=replace(grown, ball=path), gaps=moved.gaps * size, moved=moved.moved * size)


def _sized(order, size: float):
    """What a player `size` times as large as the library has to do, in the library's size."""
    if size == 1.0:
        return order
    if isinstance(order, Stance):
        return replace(order, place=tuple(np.array(order.place) / size))
    place, ball = (tuple(np.array(values) / size) for values in (order.place, order.ball))
    return replace(order, place=place, ball=ball, tool=order.tool and order.tool.for_body(size))


def _grown_plan(plan, size: float, height: float):
    track = plan.track
    ball = None if track.ball is None else track.ball * size
    return replace(plan, track=replace(track, positions=track.positions * size, ball=ball), height=height)
