"""For each strike: the frame of the hit motion, the heading, and how long its ball travels (Table 1, steps 2 to 7).

All natural trajectories of a ball stretch are compared, and those that come nearest to the next player are kept. Then,
from the last strike to the first (each flight goes to the place of the next strike), the exact flights of all of these
and of many travel times are solved. The flight that changes the natural velocity least wins.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..ball.aim import aim
from ..ball.batch import courses
from ..ball.contact import in_world
from ..base.errors import InputError
from ..base.vectors import arctan2, unit_vectors
from ..motion import quaternion
from . import pass_court
from .pass_court import Court, Link, Natural, Site
from .pass_scene import GROUND, RECEIVE, Pass
from .strike_choice import StrikeMoments, launched_from

TURNS = np.radians([0.0, 20.0, -20.0, 40.0, -40.0])
"""Rad added to the heading with which the motion sends the ball to its target."""
EIGHTH = 0.25 * np.pi  # rad: an eighth of a whole turn
MOST_OPTIONS, MOST_OF_A_HIT, MOST_TIMES = 8, 2, 4  # kept for a strike, of these from one hit motion; travel times
CHANCE, AGAIN = 0.4, 0.6
"""m/s: random cost that separates equally good hit motions, and cost of each earlier use by the same player."""
SHORTEST, LONGEST, PER_BOUNCE, TRIED = 0.4, 2.6, 0.5, 16
"""Shortest and longest travel time in s, more for each bounce, and the number of times tried between."""
LIES = 0.2
"""Metres above the centre of a ball on the ground up to which a foot's strike can be at it."""


@dataclass(frozen=True, eq=False)
class _Options:
    """The moments of a strike that are left after its natural trajectories are compared.

    Attributes:
        moments: M moments.
        facing: (M,) rad.
        cost: (M,) m/s.
        natural: natural trajectories.
    """

    moments: StrikeMoments
    facing: np.ndarray
    cost: np.ndarray
    natural: Natural

    def centres(self, site: Site, normal: np.ndarray, radius: float) -> np.ndarray:
        """Compute the ball's centres (M, 3) m on the part toward `normal` (M, 3), world frame."""
        own = quaternion.rotate(quaternion.about_up(-self.facing), normal)
        return in_world(self.moments.ball(own, radius), site.place, self.facing)

    def velocities(self) -> np.ndarray:
        """Compute the part's velocities (M, 3) m/s, world frame."""
        return quaternion.rotate(quaternion.about_up(self.facing), self.moments.struck.velocity)


@dataclass(frozen=True, eq=False, kw_only=True)
class _Tried:
    """N flights of a strike.

    Attributes:
        option: (N,) index of the option.
        starts: (N, 3) m.
        target: (3,) m.
        seconds: (N,) s.
        velocity: (N, 3) m/s at launch.
        cost: (N,) m/s, infinite where a flight is impossible.
        is_reached: whether any flight reaches the target, regardless of a net.
    """

    option: np.ndarray
    starts: np.ndarray
    target: np.ndarray
    seconds: np.ndarray
    velocity: np.ndarray
    cost: np.ndarray
    reached: bool

    def and_also(self, more: _Tried) -> _Tried:
        """Join these flights with more."""
        names = ("option", "starts", "seconds", "velocity", "cost")
        joined = {name: np.concatenate([getattr(self, name), getattr(more, name)]) for name in names}
        return _Tried(target=self.target, reached=self.reached or more.reached, **joined)


def choose(court: Court, progress: Callable[[float, str], None]) -> list[Link]:
    """Choose every strike of a scene.

    Args:
        problem: the scene with its sites.
        progress: receives the share of the work done and a short text.
    Returns:
        The strikes with their flights, in order of time.
    Raises:
        InputError: if no human can send a ball that far, or over the net.
        Cancelled: if the user cancels.
    """
    random = np.random.default_rng(court.scene.seed & (2**64 - 1))
    used: dict[tuple, int] = {}
    options = []
    for number, site in enumerate(court.sites):
        court.check()
        progress(0.5 * number / len(court.sites), f"{site.player}'s strike")
        options.append(_options(court, number, site, used, random))
    chain: list[Link | None] = [None] * len(court.sites)
    chain[-1] = _simplest(options[-1])
    # backwards: a flight's target is the place of the strike after it
    for number in range(court.last - 1, -1, -1):
        court.check()
        progress(1.0 - 0.5 * (number + 1) / len(court.sites), f"{court.sites[number].player}'s flight")
        chain[number] = _linked(court, number, options[number], chain[number + 1])
    return chain


def seconds_of(one: Pass, fps: float) -> np.ndarray:
    """Compute the travel times to try for a pass, (S,) s, on whole frames."""
    if one.seconds is not None:
        return np.array([max(round(one.seconds * fps), 1) / fps])
    longest = LONGEST + PER_BOUNCE * one.bounces
    return np.unique(np.round(np.geomspace(SHORTEST, longest, TRIED) * fps)) / fps


def _options(court: Court, number: int, site: Site, used: dict, random: np.random.Generator) -> _Options:
    """Select the moments whose natural trajectories come nearest to the target (steps 2, 3, 5, 6)."""
    toward = court.toward(number)
    moments, facing = _faced(court, _possible(court, number, site), site, toward)
    starts, velocities = launched_from(moments, site.place, facing, court.ball.radius)
    cost = pass_court.cost_of_moments(moments, facing, court.whence(number) - site.place)
    if site.asked is None:
        cost += 0.3 * np.linalg.norm(velocities, axis=1)
    else:
        ways = courses(starts, velocities, None, court.ball, pass_court.TIMES)
        cost += pass_court.misses(*ways, toward, site.asked.bounces)
    keys = [(site.player, moments.hits[which].clip, moments.hits[which].hit.first) for which in moments.which]
    # one random number per hit motion, drawn in sorted order: results do not depend on order of moments
    chance = dict(zip(sorted(set(keys)), random.uniform(0.0, CHANCE, len(set(keys)))))
    cost += np.array([chance[key] + AGAIN * used.get(key, 0) for key in keys])
    kept = _best(cost, moments.which)
    used[keys[kept[0]]] = used.get(keys[kept[0]], 0) + 1
    return _Options(moments.only(kept), facing[kept], cost[kept], Natural(starts, velocities, int(kept[0])))


def _faced(court: Court, moments: StrikeMoments, site: Site, toward: np.ndarray) -> tuple[StrikeMoments, np.ndarray]:
    """Combine each moment with each heading.

    The headings turn the natural trajectory to `toward` (3,) m, and to its sides; with eight directions they are
    rounded.
    """
    velocity = moments.struck.velocity
    natural = arctan2(velocity[:, 1], velocity[:, 0]) * (site.asked is not None)  # the last strike only stops its ball
    bearing = np.arctan2(*(toward[:2] - site.place)[::-1])
    facing = (bearing - natural)[:, None] + TURNS
    if court.scene.directions:
        facing = site.facing + np.round(quaternion.wrapped(facing - site.facing) / EIGHTH) * EIGHTH
    every = np.repeat(np.arange(len(moments)), facing.shape[1])
    return moments.only(every), quaternion.wrapped(facing.ravel())


def _possible(court: Court, number: int, site: Site) -> StrikeMoments:
    """Select a site's moments; for a ball that lies on the ground those that are low enough."""
    moments, radius = site.moments, court.ball.radius
    if number or court.scene.serve != GROUND:
        return moments
    height = moments.ball(np.broadcast_to([1.0, 0.0, 0.0], (len(moments), 3)), radius)[:, 2]
    if height.min() >= radius + LIES:
        lowest = f"no {site.part} strike of {site.player} is below {height.min():.2f} m"
        found = f"the ball lies on the ground, but {lowest}"
        raise InputError("serve", found, "a motion that strikes lower", "serve from a player or a place")
    return moments.only(height < radius + LIES)


def _simplest(options: _Options) -> Link:
    """Build the last strike: the option with the lowest cost, without a flight."""
    best = int(np.argmin(options.cost))
    return Link(moment=options.moments.only([best]), facing=float(options.facing[best]), seconds=0.0,
                velocity=np.zeros(3), natural=options.natural)


def _linked(court: Court, number: int, options: _Options, after: Link) -> Link:
    """Choose the option and travel time that change the natural velocity least (step 8 for each).

    All times are tried with the best option, then the best times with all options.
    """
    seconds = seconds_of(court.passes[number], court.scene.fps)
    tried = _tried(court, number, options, after=after, option=np.zeros(len(seconds), int), seconds=seconds)
    # without any possible flight all times are tried with the other options
    best = np.argsort(tried.cost, kind="stable")[:MOST_TIMES] if np.isfinite(tried.cost).any() else slice(None)
    others = np.arange(1, len(options.cost))
    tried = tried.and_also(_tried(court, number, options, after, *_each(others, seconds[best])))
    if not np.isfinite(tried.cost).any():
        raise _refusal(court, number, tried)
    best = int(np.argmin(tried.cost))
    option = int(tried.option[best])
    # the natural trajectory that starts nearest to the chosen flight, for display
    chosen = int(np.argmin(np.linalg.norm(options.natural.starts - tried.starts[best], axis=1)))
    return Link(moment=options.moments.only([option]), facing=float(options.facing[option]),
                seconds=float(tried.seconds[best]), velocity=tried.velocity[best],
                natural=replace(options.natural, chosen=chosen))  # fmt: skip


@np.errstate(over="ignore", invalid="ignore")  # impossible flights may overflow
def _tried(court: Court, number: int, options: _Options, after: Link, option: np.ndarray,
           seconds: np.ndarray) -> _Tried:
    """Solve flights from `option` (N,) that take `seconds` (N,), and compute their costs."""
    site, one, receiver = court.sites[number], court.passes[number], court.sites[number + 1]
    natural = pass_court.wished(options.velocities(), site.kind)
    starts = options.centres(site, unit_vectors(natural), court.ball.radius)[option]
    target = court.ball_on(number + 1, after, unit_vectors(-natural[0] * [1.0, 1.0, 0.0]))
    spin = pass_court.spun(starts, target, seconds, court.ball, site.kind)
    aimed = aim(starts, target, court.ball, seconds=seconds, bounces=one.bounces, spin=spin,
                fastest=court.fastest(number))
    flights = (starts, aimed.velocity, spin, seconds)
    ways, arriving = pass_court.ways_of(*flights, court.ball), pass_court.arrivals(*flights, court.ball)
    cost = options.cost[option] + np.linalg.norm(aimed.velocity - natural[option], axis=1)
    cost += court.in_the_way(number, ways).max(axis=1, initial=0.0)
    for near in (site, receiver):
        tall = near.size * pass_court.TRUNK_TO.get(near.part, pass_court.UPRIGHT)
        cost += pass_court.through_body(ways, court.ball.radius, near.place, tall)
    cost += pass_court.against_the_part(arriving, after.velocity, _pushes(receiver, after))
    cost += pass_court.rising(arriving) + pass_court.lasting(seconds, site.kind)
    good = aimed.possible & (aimed.miss <= pass_court.ON_TARGET)
    # impossible flights, and those that hit the net, cost infinitely much
    cost = np.where(good & court.clear(ways), cost, np.inf)
    return _Tried(option=option, starts=starts, target=target, seconds=seconds, velocity=aimed.velocity, cost=cost,
                  reached=bool(good.any()))


def _pushes(site: Site, link: Link) -> np.ndarray:
    """Direction (3,) in which the part pushes the ball: as it moves; a receiver yields and has the ball in front."""
    own = [0.8, 0.0, 0.6] if site.kind == RECEIVE else link.moment.struck.velocity[0]
    return pass_court.turned(np.array([own]), link.facing)[0]


def _refusal(court: Court, number: int, tried: _Tried) -> InputError:
    """Build the error that explains why no flight of a pass is possible."""
    one, part, net = court.passes[number], court.sites[number].part, court.scene.net
    bounces = "a bounce" if one.bounces == 1 else f"{one.bounces} bounces"
    if tried.reached:
        found = f"no trajectory over a net of {net.height:g} m with {bounces}"
        next_step = "lower the net, change the bounces or the seconds, or move the players away from the net"
        return InputError(court.name(number), found, "one that clears it", next_step)
    within = f" in {one.seconds:g} s" if one.seconds else ""
    far = np.linalg.norm(tried.target - tried.starts[0])
    seconds = seconds_of(one, court.scene.fps) if one.seconds else None
    free = aim(tried.starts[:1], tried.target, court.ball, seconds, one.bounces)
    speed, fastest = float(np.linalg.norm(free.velocity[0])), court.fastest(number)
    found, expected = f"no flight of {far:.1f} m{within} with {bounces}", f"one that a human can give by {part}"
    if free.miss[0] <= pass_court.ON_TARGET and speed > fastest:
        found = f"a flight of {far:.1f} m{within} with {bounces} takes {speed:.0f} m/s"
        expected = f"up to {fastest:.0f} m/s by {part}"
    return InputError(court.name(number), found, expected, "move the players nearer, or change bounces or seconds")


def _best(cost: np.ndarray, which: np.ndarray) -> np.ndarray:
    """Find the indices of the lowest costs: MOST_OPTIONS at most, and MOST_PER_HIT of one hit motion."""
    kept: list[int] = []
    of_hit: dict[int, int] = {}
    # cheapest first; each hit motion at most MOST_PER_HIT times, so that the options differ
    for index in np.argsort(cost, kind="stable"):
        if of_hit.get(int(which[index]), 0) < MOST_OF_A_HIT:
            kept.append(int(index))
            of_hit[int(which[index])] = of_hit.get(int(which[index]), 0) + 1
        if len(kept) == MOST_OPTIONS:
            break
    return np.array(kept, dtype=int)


def _each(options: np.ndarray, seconds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Combine every option (N,) with every time (S,): two arrays (N S,)."""
    return np.repeat(options, len(seconds)), np.tile(seconds, len(options))
