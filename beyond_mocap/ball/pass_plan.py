"""Who strikes the ball when, where, with which frame of which motion, and how it flies between (Ball handling §4, Table 1,
Fig. 5).

The paper lets the natural flights of all frames of a ball stretch choose the strike, and then solves the flight between
two strikes exactly. So is it done here, and of the exact flights, of all times of travel, the one is taken that changes
the natural velocity least. Strikes lie on whole frames of the output.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import Cancelled, InputError
from ..motion import quaternion
from .aim import aim
from .batch import courses
from .contact import Tool, in_world
from .flight import Flight, Launch, fly
from .orders import HitOrder, Stance
from .pass_costs import (
    THROUGH, TIMES, TRUNK_TO, UPRIGHT, against_the_part, arrivals, clears_net, cost_of_moments, lasting, misses,
    out_of_the_way, rising, spun, through_body, ways_of, wished,
)  # fmt: skip
from .pass_scene import GROUND, Pass, PassScene, served_by
from .physics import FASTEST, Ball
from .strike_moments import StrikeMoments, launched_from

TURNS = np.radians([0.0, 20.0, -20.0, 40.0, -40.0])
"""Radians by which a body may face beside where its motion sends the ball by itself."""

EIGHTH = 0.25 * np.pi
MOST_OPTIONS, MOST_OF_A_HIT, MOST_TIMES = 8, 2, 4
SERVED_FROM, SERVED_HEIGHT = 0.4, 1.2
"""Metres before who serves, and above the ground, from where the ball comes in."""

SERVED_SECONDS, SERVED_PER_METRE, LONGEST_SERVE = 0.5, 0.07, 3.0
"""How long it flies, how much longer for each metre, and at most."""

LIES = 0.2
"""Metres above where a ball lies on the ground up to which a foot's strike may be at a ball that lies there."""

BESIDE = 0.45
"""Metres by which a missed ball goes past the part."""

LIMP = {"received": (0.9, 0.4), "dropped": (1.1, 0.9)}
"""m/s ahead and up with which a ball goes that was stopped, or that slipped off."""

ROUNDS, LONGER = 5, 6
LEAP = 3.0
"""m/s between two launches above which the ball takes quite another way, such as into the ground instead of up."""

NEARBY = np.array([1, -1, 2, -2, 3, -3, 5, -5, 8, -8, 12])
"""Frames by which a flight may be longer or shorter than was best, where places have moved."""

ON_TARGET = 0.02

Need = Callable[[str, "HitOrder | Stance", HitOrder], float]


@dataclass(frozen=True, eq=False)
class Site:
    """Where, with what and how one of the strikes is to be made.

    player: his name. place (2,) m; facing rad before it. kind: toss, pass, attack, or receive (the last one). part; tool.
    size: of the body against the library's. moments: what it can strike with. asked: the pass that goes out, None for
    the last strike.
    """

    player: str
    place: np.ndarray
    facing: float
    kind: str
    part: str
    tool: Tool | None
    size: float
    moments: StrikeMoments
    asked: Pass | None

    @property
    def height(self) -> float:
        """Metres above the ground at which a ball is met here, about."""
        middle = 0.5 * (self.moments.struck.start + self.moments.struck.end)
        return float(np.median(middle[:, 2]))


@dataclass(frozen=True, eq=False)
class Natural:
    """The balls' natural ways of a strike (Fig. 6, black): starts, velocities (M, 3), chosen: which of them was taken."""

    starts: np.ndarray
    velocities: np.ndarray
    chosen: int


@dataclass(frozen=True, eq=False)
class Strike:
    """One strike as it is played. order: what the body has to do. velocity_in, velocity_out (3,) m/s of the ball; spin
    (3,) rad/s with which it leaves.
    outcome: struck, received, missed or dropped. bounces, travel s: of the flight that goes out (0 for the last).
    natural: the ways it was chosen from; None for the last."""

    player: str
    order: HitOrder
    velocity_in: np.ndarray
    velocity_out: np.ndarray
    spin: np.ndarray
    outcome: str
    bounces: int
    travel: float
    natural: Natural | None


@dataclass(frozen=True, eq=False)
class PassPlan:
    """strikes in order of time; flights: to the first strike, from each strike to the next, and from the last on; seconds:
    of the whole scene; fps; warnings."""

    strikes: tuple[Strike, ...]
    flights: tuple[Flight, ...]
    seconds: float
    fps: float
    warnings: tuple[str, ...]

    def orders(self, player: str) -> tuple[HitOrder, ...]:
        """What one player has to do."""
        return tuple(one.order for one in self.strikes if one.player == player)

    def flight_at(self, times: np.ndarray) -> np.ndarray:
        """(N,): which flight the ball is in at `times` (N,) s; at a strike the one that goes out."""
        starts = [one.launch.time for one in self.flights]
        return np.maximum(np.searchsorted(starts, np.asarray(times, float) + 1e-9, side="right") - 1, 0)


@dataclass(frozen=True, eq=False)
class _Options:
    """What is left of a strike's moments after the natural ways: moments (M), facing (M,) rad, cost (M,) m/s, natural."""

    moments: StrikeMoments
    facing: np.ndarray
    cost: np.ndarray
    natural: Natural

    def centres(self, site: Site, normal: np.ndarray, radius: float) -> np.ndarray:
        """(M, 3) m: the ball on the part toward `normal` (M, 3), world."""
        own = quaternion.rotate(quaternion.about_up(-self.facing), normal)
        return in_world(self.moments.ball(own, radius), site.place, self.facing)

    def velocities(self) -> np.ndarray:
        """(M, 3) m/s of the parts, world."""
        return quaternion.rotate(quaternion.about_up(self.facing), self.moments.struck.velocity)


@dataclass(frozen=True, eq=False)
class _Link:
    """A strike as chosen: the option (a single moment), its facing rad, the seconds that the ball travels on from it, and
    about which velocity (3,) m/s it leaves with."""

    moment: StrikeMoments
    facing: float
    seconds: float
    velocity: np.ndarray
    natural: Natural


@dataclass(frozen=True, eq=False)
class _Tried:
    """Flights (N) of a strike: from which option, starts (N, 3), target (3,), seconds, velocity (N, 3); cost (N,),
    infinite where it cannot be; reached: whether any comes to the target at all, net or no net."""

    option: np.ndarray
    starts: np.ndarray
    target: np.ndarray
    seconds: np.ndarray
    velocity: np.ndarray
    cost: np.ndarray
    reached: bool

    def and_also(self, more: _Tried) -> _Tried:
        """Both together."""
        names = ("option", "starts", "seconds", "velocity", "cost")
        joined = {name: np.concatenate([getattr(self, name), getattr(more, name)]) for name in names}
        return _Tried(target=self.target, reached=self.reached or more.reached, **joined)


def plan_passes(
    scene: PassScene,
    sites: Sequence[Site],
    ball: Ball,
    need: Need,
    cancelled: Callable[[], bool] | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> PassPlan:
    """The chain of strikes and flights of a scene.

    sites: of every strike, the last one where the last pass ends. need: seconds that a player needs from one strike, or
    from standing, to the next. InputError where no human sends the ball so far, or over the net.
    """
    plan = _Planner(scene, list(sites), ball, need, cancelled or (lambda: False), progress or (lambda share, text: None))
    return plan.whole()


class _Planner:
    def __init__(self, scene, sites, ball, need, cancelled, progress):
        self.scene, self.sites, self.ball, self.need = scene, sites, ball, need
        self.cancelled, self.progress = cancelled, progress
        self.random = np.random.default_rng(scene.seed & (2**64 - 1))
        self.last = len(sites) - 1
        self.passes = [site.asked for site in sites[:-1]]
        self.warnings: list[str] = []
        self.others = self._standing_by()
        self.serving = 0.0

    def whole(self) -> PassPlan:
        chain = self._chain()
        places, normals = self._met_by_chance(chain)
        chain, first = self._in_time(chain, places, normals)
        for _ in range(ROUNDS):
            velocities, arriving, missed = self._between(chain, places)
            serve = self._served(places[0], first)
            places, normals = self._met(chain, velocities, [serve[1], *arriving])
            chain = self._within_reach(chain, places, missed)
        velocities, arriving, missed = self._between(chain, places, last=True)
        self._tell_misses(missed)
        self._tell_ways(chain, places, velocities)
        serve = self._served(places[0], first)
        return self._told(chain, first, places, normals, velocities, [serve[1], *arriving], serve[0])

    def _standing_by(self) -> list[list[tuple[str, np.ndarray]]]:
        """For each pass, who has nothing to do with it, and where (2,) m he stands by then."""
        places = {player.name: np.array(player.place, float) for player in self.scene.players}
        out = []
        for one in self.passes:
            out.append([(name, place) for name, place in places.items() if name not in (one.giver, one.receiver)])
            if one.at is not None:
                places[one.receiver] = np.array(one.at, float)
        return out

    def _in_the_way(self, number: int, ways: np.ndarray) -> np.ndarray:
        """(N, P): how far flights of a pass, on their ways (N, S, 3) m, go through each of those who stand by."""
        return out_of_the_way(ways, np.array([place for _, place in self.others[number]]).reshape(-1, 2))

    # -- Table 1, steps 2 to 7

    def _chain(self) -> list[_Link]:
        """Every strike's frame, facing and time of travel, from the last one to the first, since each flight goes to
        where the next strike is."""
        options = []
        used: dict[tuple, int] = {}
        for number, site in enumerate(self.sites):
            self._check()
            self.progress(0.5 * number / len(self.sites), f"{site.player}'s strike")
            options.append(self._options(number, site, used))
        chain: list[_Link | None] = [None] * len(self.sites)
        chain[-1] = self._simplest(options[-1])
        for number in range(self.last - 1, -1, -1):
            self._check()
            self.progress(0.5 + 0.3 * (1 - number / len(self.sites)), f"{self.sites[number].player}'s flight")
            chain[number] = self._linked(number, options[number], chain[number + 1])
        return chain

    def _toward(self, number: int) -> np.ndarray:
        """(3,) m: where the ball of a strike goes, about; the last one's back to whence it came."""
        other = self.sites[number + 1 if number < self.last else number - 1]
        return np.array([*other.place, other.height])

    def _whence(self, number: int) -> np.ndarray:
        """(2,) m: where the ball comes from."""
        if number:
            return self.sites[number - 1].place
        serve = self.scene.serve
        if serve == GROUND:
            return self._toward(0)[:2]
        if isinstance(serve, tuple):
            return np.array(serve[:2])
        return np.array(self.scene.player(serve or served_by(self.scene)).place)

    def _options(self, number: int, site: Site, used: dict) -> _Options:
        """The moments whose natural ways come nearest to where the ball is to go (steps 2, 3, 5, 6)."""
        toward, kind = self._toward(number), "toss" if site.kind == "receive" else site.kind
        moments = self._possible(number, site)
        velocity = moments.struck.velocity
        natural_way = np.arctan2(velocity[:, 1], velocity[:, 0]) * (site.asked is not None)  # a trap gives way
        bearing = np.arctan2(*(toward[:2] - site.place)[::-1])
        turned = (bearing - natural_way)[:, None] + TURNS
        if self.scene.directions:
            turned = site.facing + np.round(quaternion.wrapped(turned - site.facing) / EIGHTH) * EIGHTH
        every = np.repeat(np.arange(len(moments)), turned.shape[1])
        moments, facing = moments.only(every), quaternion.wrapped(turned.ravel())
        starts, velocities = launched_from(moments, site.place, facing, self.ball.radius)
        ways, speeds = courses(starts, velocities, None, self.ball, TIMES)
        bounces = site.asked.bounces if site.asked else 0
        cost = cost_of_moments(moments, kind, site.part, facing, self._whence(number) - site.place)
        cost += misses(ways, speeds, toward, bounces) if site.asked else 0.3 * np.linalg.norm(velocities, axis=1)
        keys = [(moments.hits[which].clip, moments.hits[which].hit.first) for which in moments.which]
        chance = dict(zip(sorted(set(keys)), self.random.uniform(0.0, 0.4, len(set(keys)))))
        cost += np.array([chance[key] + 0.6 * used.get((site.player, *key), 0) for key in keys])
        kept = _best(cost, moments.which, MOST_OPTIONS)
        best = keys[kept[0]]
        used[(site.player, *best)] = used.get((site.player, *best), 0) + 1
        return _Options(moments.only(kept), facing[kept], cost[kept], Natural(starts, velocities, int(kept[0])))

    def _possible(self, number: int, site: Site) -> StrikeMoments:
        """All of a site's moments; for a ball that lies on the ground those that are low enough."""
        moments = site.moments
        if number or self.scene.serve != GROUND:
            return moments
        own = moments.ball(np.broadcast_to([1.0, 0.0, 0.0], (len(moments), 3)), self.ball.radius)
        low = own[:, 2] < self.ball.radius + LIES
        if not low.any():
            found = f"the ball lies on the ground, and no {site.part} of {site.player}'s motions is below {own[:, 2].min():.2f} m"
            raise InputError("serve", found, "a motion that strikes lower", "let the ball come from a player or a place")
        return moments.only(low)

    def _simplest(self, options: _Options) -> _Link:
        best = int(np.argmin(options.cost))
        return _Link(options.moments.only([best]), float(options.facing[best]), 0.0, np.zeros(3), options.natural)

    def _linked(self, number: int, options: _Options, after: _Link) -> _Link:
        """The option and the seconds of travel with which the natural velocity is changed least (step 8 for each): all
        times with the best option, then the best times with all."""
        seconds = self._seconds(self.passes[number])
        tried = self._tried(number, options, after, np.zeros(len(seconds), int), seconds)
        best = np.argsort(tried.cost, kind="stable")[:MOST_TIMES] if np.isfinite(tried.cost).any() else slice(None)
        others = np.arange(1, len(options.cost))
        more = self._tried(number, options, after, *_each(others, seconds[best]))
        tried = tried.and_also(more)
        if not np.isfinite(tried.cost).any():
            self._refuse(number, tried)
        best = int(np.argmin(tried.cost))
        option = int(tried.option[best])
        chosen = _nearest_row(options.natural, tried.starts[best])
        return _Link(
            options.moments.only([option]), float(options.facing[option]), float(tried.seconds[best]), tried.velocity[best],
            replace(options.natural, chosen=chosen),
        )  # fmt: skip

    def _tried(self, number: int, options: _Options, after: _Link, option: np.ndarray, seconds: np.ndarray) -> _Tried:
        """Flights from `option` (N,) that take `seconds` (N,), and what each costs."""
        site, one, after_site = self.sites[number], self.passes[number], self.sites[number + 1]
        natural = wished(options.velocities(), site.kind)
        starts = options.centres(site, _unit(natural), self.ball.radius)[option]
        target = self._place_of(number + 1, after, -natural[:1] * [1.0, 1.0, 0.0])
        spin = spun(starts, target, seconds, self.ball, site.kind)
        aimed = aim(starts, target, self.ball, seconds, one.bounces, spin, fastest=self._fastest(number))
        flights = (starts, aimed.velocity, spin, seconds)
        arriving = arrivals(*flights, self.ball)
        cost = options.cost[option] + np.linalg.norm(aimed.velocity - natural[option], axis=1)
        ways = ways_of(*flights, self.ball)
        cost += self._in_the_way(number, ways).max(axis=1, initial=0.0)
        for near in (site, after_site):
            cost += through_body(ways, self.ball.radius, near.place, near.size * TRUNK_TO.get(near.part, UPRIGHT))
        cost += against_the_part(arriving, after.velocity, self._pushes(number + 1, after))
        cost += rising(arriving) + lasting(seconds, site.kind)
        good = aimed.possible & (aimed.miss <= ON_TARGET)
        clear = good & self._clear(ways)
        return _Tried(option, starts, target, seconds, aimed.velocity, np.where(clear, cost, np.inf), bool(good.any()))

    def _clear(self, ways: np.ndarray) -> np.ndarray:
        """(N,) bool: whether flights with ways (N, S, 3) m go over the net, where there is one."""
        net = self.scene.net
        return np.ones(len(ways), bool) if net is None else clears_net(ways, self.ball.radius, net)

    def _fastest(self, number: int) -> float:
        return FASTEST.get(self.sites[number].part, FASTEST["foot"])

    def _pushes(self, number: int, link: _Link) -> np.ndarray:
        """(3,): the way in which the part pushes the ball: as it moves; who receives gives way, and has it before him."""
        own = [0.8, 0.0, 0.6] if self.sites[number].kind == "receive" else link.moment.struck.velocity[0]
        return _turned(np.array([own]), link.facing)[0]

    def _seconds(self, one: Pass) -> np.ndarray:
        """(S,) s, on whole frames: the times of travel that are tried."""
        fps = self.scene.fps
        if one.seconds is not None:
            return np.array([max(round(one.seconds * fps), 1) / fps])
        longest = 2.6 + 0.5 * one.bounces
        return np.unique(np.round(np.geomspace(0.4, longest, 16) * fps)) / fps

    # -- where ball and part meet

    def _place_of(self, number: int, link: _Link, normal: np.ndarray) -> np.ndarray:
        """(3,) m: the ball on the part toward `normal` (1, 3), world."""
        own = quaternion.rotate(quaternion.about_up(np.array([-link.facing])), _unit(normal))
        at = link.moment.ball(own, self.ball.radius)
        place = in_world(at, self.sites[number].place, np.array([link.facing]))[0]
        if number == 0 and self.scene.serve == GROUND:
            place[2] = self.ball.radius
        return place

    def _met_by_chance(self, chain: list[_Link]) -> tuple[np.ndarray, np.ndarray]:
        """Places and normals (K, 3) as if each ball came from where it goes."""
        pushes = [_turned(link.moment.struck.velocity, link.facing) for link in chain]
        return self._placed(chain, np.array([_unit(push)[0] for push in pushes]))

    def _met(self, chain, velocities, arriving) -> tuple[np.ndarray, np.ndarray]:
        """Places and normals (K, 3): each ball lies on the part along the change of its velocity."""
        leaving = [*velocities, np.zeros(3)]
        change = np.array([after - before for before, after in zip(arriving, leaving)])
        return self._placed(chain, _unit(change))

    def _placed(self, chain, normals) -> tuple[np.ndarray, np.ndarray]:
        places = np.array([self._place_of(number, link, normals[number][None]) for number, link in enumerate(chain)])
        return places, normals

    # -- the flights

    def _target(self, number: int, places: np.ndarray, chain: list[_Link]) -> np.ndarray:
        """(3,) m: where the ball of a pass goes: to the next strike, or past it where it is missed."""
        place = places[number + 1]
        if self.passes[number].error != "missed":
            return place
        if self.sites[number + 1].part in ("head", "chest"):
            return place + [0.0, 0.0, BESIDE]
        facing, site = chain[number + 1].facing, self.sites[number + 1]
        beside = np.array([-np.sin(facing), np.cos(facing)])
        side = np.sign((place[:2] - site.place) @ beside) or 1.0
        return np.array([*(place[:2] + side * BESIDE * beside), place[2]])

    def _between(self, chain, places, last: bool = False) -> tuple[np.ndarray, list[np.ndarray], np.ndarray]:
        """The velocities (K-1, 3) m/s with which the balls leave, those with which they come to the next strike, and by
        how many m (K-1,) they miss it. One that only quite another flight would bring there is taken so at the `last`
        only; before, it is told to miss."""
        targets = np.array([self._target(number, places, chain) for number in range(self.last)])
        seconds = np.array([link.seconds for link in chain[:-1]])
        bounces = np.array([one.bounces for one in self.passes])
        spin = self._spins(places[:-1], targets, seconds)
        velocities, missed = np.empty((self.last, 3)), np.empty(self.last)
        for count in np.unique(bounces):
            same = np.flatnonzero(bounces == count)
            near = np.array([chain[number].velocity for number in same])
            aimed = aim(places[same], targets[same], self.ball, seconds[same], int(count), spin[same], near=near)
            other = (np.linalg.norm(aimed.velocity - near, axis=1) > LEAP) & (not last)
            velocities[same] = np.where(other[:, None], near, aimed.velocity)
            missed[same] = np.where(other, np.inf, aimed.miss)
        return velocities, list(arrivals(places[:-1], velocities, spin, seconds, self.ball)), missed

    def _spins(self, places, targets, seconds) -> np.ndarray:
        """(K-1, 3) rad/s with which the balls leave."""
        each = zip(places, targets, seconds, self.sites)
        return np.array([spun(a[None], b, np.array([s]), self.ball, site.kind)[0] for a, b, s, site in each])

    def _within_reach(self, chain, places, missed: np.ndarray) -> list[_Link]:
        """The chain with flights that miss some frames longer or shorter, where they then do not."""
        chain, fps = list(chain), self.scene.fps
        for number in np.flatnonzero(missed > ON_TARGET):
            frames = round(chain[number].seconds * fps) + NEARBY
            frames = frames[frames > 2]
            good, velocities = self._flies(number, places, frames / fps)
            if good.any() and self.passes[number].seconds is None:
                other = np.linalg.norm(velocities - chain[number].velocity, axis=1)
                best = int(np.argmin(np.where(good, other, np.inf)))
                chain[number] = replace(chain[number], seconds=float(frames[best] / fps), velocity=velocities[best])
        return chain

    def _tell_misses(self, missed: np.ndarray) -> None:
        for number, miss in enumerate(missed):
            if miss > ON_TARGET:
                a, b = self.sites[number].player, self.sites[number + 1].player
                self.warnings.append(f"pass {number + 1}, from {a} to {b}: the ball is {100 * miss:.0f} cm beside {b}'s strike")

    def _tell_ways(self, chain, places, velocities) -> None:
        for number, one in enumerate(self.passes):
            flight = (places[number][None], velocities[number][None], None, np.array([chain[number].seconds]))
            through = self._in_the_way(number, ways_of(*flight, self.ball))[0]
            for (name, _), depth in zip(self.others[number], through):
                if depth > THROUGH:
                    self.warnings.append(f"pass {number + 1}, from {one.giver} to {one.receiver}: the ball flies through {name}")

    def _served(self, place: np.ndarray, first: float) -> tuple[Launch, np.ndarray]:
        """The ball's launch before the first strike, and its velocity (3,) m/s there."""
        serve = self.scene.serve
        if serve == GROUND:
            return Launch(0.0, place, np.zeros(3)), np.zeros(3)
        start = self._serving_place(place)
        seconds = min(first, self.serving)
        aimed = aim(start[None], place[None], self.ball, np.array([seconds]), 0)
        launch = Launch(first - seconds, start, aimed.velocity[0])
        return launch, arrivals(start[None], aimed.velocity, None, np.array([seconds]), self.ball)[0]

    def _serving_seconds(self, place: np.ndarray) -> float:
        """How long the ball flies in, on whole frames: a quiet throw, as high as a net needs."""
        start, fps = self._serving_place(place), self.scene.fps
        quiet = SERVED_SECONDS + SERVED_PER_METRE * np.linalg.norm(place[:2] - start[:2])
        tried = np.ceil(np.linspace(quiet, LONGEST_SERVE, 8) * fps) / fps if quiet < LONGEST_SERVE else np.array([quiet])
        starts = np.tile(start, (len(tried), 1))
        aimed = aim(starts, place, self.ball, tried, 0)
        good = (aimed.miss <= ON_TARGET) & self._clear(ways_of(starts, aimed.velocity, None, tried, self.ball))
        return float(tried[np.argmax(good)])

    def _serving_place(self, place: np.ndarray) -> np.ndarray:
        serve = self.scene.serve
        if isinstance(serve, tuple):
            return np.maximum(np.array(serve), [-np.inf, -np.inf, self.ball.radius])
        whence = self._whence(0)
        way = place[:2] - whence
        return np.array([*(whence + SERVED_FROM * way / max(np.linalg.norm(way), 1e-9)), SERVED_HEIGHT])

    # -- the chain of times (Fig. 5)

    def _in_time(self, chain, places, normals) -> tuple[list[_Link], float]:
        """The chain with flights long enough for who strikes next, and the seconds of the first strike."""
        fps = self.scene.fps
        orders = [self._order(chain, number, 0.0, places, normals) for number in range(len(chain))]
        first = self._first_time(orders)
        last_of: dict[str, int] = {}
        for number, site in enumerate(self.sites):
            before = last_of.get(site.player)
            if before is None:
                start = Stance(self._home(site.player), self.scene.facing(site.player))
            else:
                start = orders[before]
            times = np.cumsum([first, *(link.seconds for link in chain)])
            have = times[number] - (times[before] if before is not None else 0.0)
            lack = self.need(site.player, start, orders[number]) - have
            if lack > 1e-6 and number:
                chain = self._longer(chain, range(before or 0, number), lack, places)
                times = np.cumsum([first, *(link.seconds for link in chain)])
                have = times[number] - (times[before] if before is not None else 0.0)
                lack = self.need(site.player, start, orders[number]) - have
            if lack > 0.5 / fps:
                self._tell_haste(site.player, float(times[number]), have, have + lack)
            last_of[site.player] = number
        return chain, first

    def _tell_haste(self, name: str, time: float, have: float, need: float) -> None:
        self.warnings.append(f"{name} has {have:.1f} s before the strike at {time:.2f} s, and needs {need:.1f} s")

    def _home(self, name: str) -> tuple[float, float]:
        return self.scene.player(name).place

    def _first_time(self, orders) -> float:
        """Seconds, a whole frame: the first strike, when who makes it is ready and the serve has come."""
        site, fps = self.sites[0], self.scene.fps
        start = Stance(tuple(site.place), self.scene.facing(site.player))
        least = max(self.scene.lead_in, self.need(site.player, start, orders[0]))
        if self.scene.serve != GROUND:
            self.serving = self._serving_seconds(np.array(orders[0].ball))
            least = max(least, self.serving)
        return float(np.ceil(least * fps - 1e-6) / fps)

    def _longer(self, chain, which, lack: float, places) -> list[_Link]:
        """The chain with some flights longer, by the frame, as far as they can be; those whose seconds are asked stay."""
        fps = self.scene.fps
        free = [number for number in which if self.passes[number].seconds is None]
        chain = list(chain)
        for left, number in enumerate(free):
            frames = int(np.ceil(lack * fps / (len(free) - left) - 1e-6))
            if frames <= 0:
                break
            tried = chain[number].seconds + np.arange(frames, 0, -max(frames // LONGER, 1)) / fps
            good, velocities = self._flies(number, places, tried)
            if good.any():
                longer = int(np.argmax(good))
                lack -= tried[longer] - chain[number].seconds
                chain[number] = replace(chain[number], seconds=float(tried[longer]), velocity=velocities[longer])
        return chain

    def _flies(self, number: int, places, seconds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(S,) bool: whether a pass can take `seconds` (S,), and the velocities (S, 3) m/s that it then takes."""
        start, target = np.tile(places[number], (len(seconds), 1)), places[number + 1]
        spin = spun(start, target, seconds, self.ball, self.sites[number].kind)
        aimed = aim(start, target, self.ball, seconds, self.passes[number].bounces, spin, fastest=self._fastest(number))
        clear = self._clear(ways_of(start, aimed.velocity, spin, seconds, self.ball))
        good = aimed.possible & (aimed.miss <= ON_TARGET) & clear
        return good, aimed.velocity

    # -- what came out

    def _order(self, chain, number: int, time: float, places, normals) -> HitOrder:
        link, site = chain[number], self.sites[number]
        one = link.moment.hits[int(link.moment.which[0])]
        missed = number == self.last and self.passes[-1].error == "missed"
        return HitOrder(
            time=time, clip=one.clip, hit=one.hit, strike_frame=float(link.moment.frame[0]),
            place=tuple(map(float, site.place)), facing=link.facing, ball=tuple(map(float, places[number])),
            normal=tuple(map(float, normals[number])), part=site.part, side=one.hit.side, tool=site.tool, kind=site.kind,
            touches=not missed,
        )  # fmt: skip

    def _told(self, chain, first, places, normals, velocities, arriving, serve: Launch) -> PassPlan:
        fps = self.scene.fps
        frames = np.round(np.cumsum([first, *(link.seconds for link in chain[:-1])]) * fps)
        times = frames / fps
        seconds = float(np.ceil((times[-1] + self.scene.lead_out) * fps - 1e-6) / fps)
        outcome = {"missed": "missed", "dropped": "dropped", "": "received"}[self.passes[-1].error]
        leaving = [*velocities, self._limp(outcome, chain[-1], arriving[-1])]
        targets = np.array([self._target(number, places, chain) for number in range(self.last)])
        spins = [*self._spins(places[:-1], targets, np.array([link.seconds for link in chain[:-1]])), np.zeros(3)]
        strikes = []
        for number, (time, link) in enumerate(zip(times, chain)):
            order, out = self._order(chain, number, float(time), places, normals), number < self.last
            strikes.append(Strike(
                self.sites[number].player, order, arriving[number], leaving[number], spins[number], "struck" if out else outcome,
                self.passes[number].bounces if out else 0, link.seconds, link.natural if out else None,
            ))  # fmt: skip
        flights = self._flights(serve, strikes, seconds, outcome)
        return PassPlan(tuple(strikes), flights, seconds, fps, tuple(self.warnings))

    def _limp(self, outcome: str, link: _Link, arriving: np.ndarray) -> np.ndarray:
        """(3,) m/s: how the ball goes on from the last one."""
        if outcome == "missed":
            return arriving
        ahead, up = LIMP[outcome]
        return np.array([ahead * np.cos(link.facing), ahead * np.sin(link.facing), up])

    def _flights(self, serve: Launch, strikes: Sequence[Strike], seconds: float, outcome: str) -> tuple[Flight, ...]:
        flights = [fly(serve, self.ball, strikes[0].order.time - serve.time)]
        sent = strikes[:-1] if outcome == "missed" else strikes  # a ball that is missed flies on
        ends = [*(one.order.time for one in strikes[1 : len(sent)]), seconds]
        for one, end in zip(sent, ends):
            launch = Launch(one.order.time, np.array(one.order.ball), one.velocity_out, one.spin)
            flights.append(fly(launch, self.ball, max(end - launch.time, 1.0 / self.scene.fps)))
        return tuple(flights)

    # -- what cannot be

    def _refuse(self, number: int, tried: _Tried) -> None:
        """InputError that says why no flight of a pass can be."""
        one, part, net = self.passes[number], self.sites[number].part, self.scene.net
        where = f"pass {number + 1}, from {one.giver} to {one.receiver}"
        bounces = "a bounce" if one.bounces == 1 else f"{one.bounces} bounces"
        if tried.reached:
            raise InputError(where, f"no way over a net of {net.height:g} m with {bounces}", "one that goes over it",
                             "lower the net, change bounces or seconds, or move them away from it")  # fmt: skip
        within = f" in {one.seconds:g} s" if one.seconds else ""
        far = np.linalg.norm(tried.target - tried.starts[0])
        free = aim(tried.starts[:1], tried.target, self.ball, self._seconds(one) if one.seconds else None, one.bounces)
        speed, fastest = float(np.linalg.norm(free.velocity[0])), self._fastest(number)
        if free.miss[0] <= ON_TARGET and speed > fastest:
            found, expected = f"{far:.1f} m away{within} with {bounces} takes {speed:.0f} m/s", f"up to {fastest:.0f} m/s by {part}"
        else:
            found, expected = f"no way of {far:.1f} m{within} with {bounces}", f"one that a human can give by {part}"
        raise InputError(where, found, expected, "move them nearer, or change bounces or seconds")

    def _check(self) -> None:
        if self.cancelled():
            raise Cancelled("cancelled")


def _best(cost: np.ndarray, which: np.ndarray, most: int) -> np.ndarray:
    """Indices of the least costs, at most MOST_OF_A_HIT of one hit motion."""
    kept: list[int] = []
    of_hit: dict[int, int] = {}
    for index in np.argsort(cost, kind="stable"):
        if of_hit.get(int(which[index]), 0) < MOST_OF_A_HIT:
            kept.append(int(index))
            of_hit[int(which[index])] = of_hit.get(int(which[index]), 0) + 1
        if len(kept) == most:
            break
    return np.array(kept, dtype=int)


def _each(options: np.ndarray, seconds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Every option (N,) with every time (S,): two arrays (N S,)."""
    return np.repeat(options, len(seconds)), np.tile(seconds, len(options))


def _nearest_row(natural: Natural, start: np.ndarray) -> int:
    return int(np.argmin(np.linalg.norm(natural.starts - start, axis=1)))


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)


def _turned(vectors: np.ndarray, angle: float) -> np.ndarray:
    return quaternion.rotate(quaternion.about_up(np.array([angle])), vectors)

