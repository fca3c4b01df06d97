"""For each strike: the frame of the hit motion, the heading, and how long its ball travels (Table 1, steps 2 to 7).

All natural trajectories of a ball stretch are compared, and those that come nearest to the next player are kept. Then,
from the last strike to the first (each flight goes to the place of the next strike), the exact flights of all of these
and of many travel times are solved. The flight that changes the natural velocity least wins.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..ball.aim import solve_launches
from ..ball.batch import simulate_trajectories
from ..ball.contact import convert_to_world
from ..base.errors import InputError
from ..base.vectors import arctan2, unit_vectors
from ..motion import quaternion
from . import pass_cost
from .pass_problem import (
    ON_TARGET,
    SAMPLE_TIMES,
    Link,
    NaturalFlights,
    PassProblem,
    Site,
    compute_arrivals,
    compute_spin,
    limit_launch,
    rotate_about_up,
    simulate_flights,
)
from .pass_scene import GROUND, RECEIVE, Pass
from .strike_choice import StrikeMoments, compute_natural_launch

TURNS = np.radians([0.0, 20.0, -20.0, 40.0, -40.0])
"""Rad added to the heading with which the motion sends the ball to its target."""
EIGHTH_TURN = 0.25 * np.pi  # rad: an eighth of a whole turn
MOST_OPTIONS, MOST_PER_HIT, MOST_TIMES = 12, 2, 4  # kept for a strike, of these from one hit motion; travel times
RANDOM_COST = 0.4
"""m/s: random cost that separates equally good hit motions."""
REUSE_COST, REUSE_FADE, REUSE_OF_RECORDING, MOST_REUSE_COST = 0.8, 0.85, 0.5, 2.4
"""Cost in m/s of a hit motion that the next strike of the scene plays; its share for each strike further away; its
share for another hit motion of the same recording, such as its mirror image; the most in m/s that variety costs."""
SHORTEST_TRAVEL, LONGEST_TRAVEL, TRAVEL_PER_BOUNCE, TRAVEL_TIMES = 0.4, 2.6, 0.5, 16
"""Shortest and longest travel time in s, more for each bounce, and the number of times tried between."""
GROUND_REACH = 0.2
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
    natural: NaturalFlights

    def compute_centres(self, site: Site, normal: np.ndarray, radius: float) -> np.ndarray:
        """Compute the ball's centres (M, 3) m on the part toward `normal` (M, 3), world frame."""
        own = quaternion.rotate(quaternion.from_up_angle(-self.facing), normal)
        return convert_to_world(self.moments.place_ball(own, radius), site.place, self.facing)

    def compute_velocities(self) -> np.ndarray:
        """Compute the part's velocities (M, 3) m/s, world frame."""
        return quaternion.rotate(quaternion.from_up_angle(self.facing), self.moments.part_states.velocity)


@dataclass(frozen=True, eq=False, kw_only=True)
class _Flights:
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
    is_reached: bool

    def join_with(self, more: _Flights) -> _Flights:
        """Join these flights with more."""
        names = ("option", "starts", "seconds", "velocity", "cost")
        arrays = {name: np.concatenate([getattr(self, name), getattr(more, name)]) for name in names}
        return _Flights(target=self.target, is_reached=self.is_reached or more.is_reached, **arrays)


def choose_strikes(problem: PassProblem, progress: Callable[[float, str], None]) -> list[Link]:
    """Choose every strike of a scene.

    Args:
        problem: the scene with its sites.
        progress: receives the share of the work done and a short text.
    Returns:
        The strikes with their flights, in order of time.
    Raises:
        InputError: if no human can send a ball that far, or over the net.
        UserCancelledError: if the user cancels.
    """
    random = np.random.default_rng(problem.scene.seed & (2**64 - 1))
    options = []
    for number, site in enumerate(problem.sites):
        problem.check_cancelled()
        progress(0.5 * number / len(problem.sites), f"{site.player}'s strike")
        options.append(_select_options(problem, number, site, random))
    chain: list[Link | None] = [None] * len(problem.sites)
    chain[-1] = _build_last_link(options[-1])
    # backwards: a flight's target is the place of the strike after it
    for number in range(problem.last - 1, -1, -1):
        problem.check_cancelled()
        progress(1.0 - 0.5 * (number + 1) / len(problem.sites), f"{problem.sites[number].player}'s flight")
        chain[number] = _choose_link(problem, number, options[number], chain[number + 1 :])
    return chain


def list_travel_times(one: Pass, fps: float) -> np.ndarray:
    """Compute the travel times to try for a pass, (S,) s, on whole frames."""
    if one.seconds is not None:
        return np.array([max(round(one.seconds * fps), 1) / fps])
    longest = LONGEST_TRAVEL + TRAVEL_PER_BOUNCE * one.bounces
    return np.unique(np.round(np.geomspace(SHORTEST_TRAVEL, longest, TRAVEL_TIMES) * fps)) / fps


def _select_options(problem: PassProblem, number: int, site: Site, random: np.random.Generator) -> _Options:
    """Select the moments whose natural trajectories come nearest to the target (steps 2, 3, 5, 6)."""
    toward = problem.find_target(number)
    moments, facing = _combine_headings(problem, _select_possible(problem, number, site), site, toward)
    starts, velocities = compute_natural_launch(moments, site.place, facing, problem.ball.radius)
    cost = pass_cost.compute_moment_cost(moments, facing, problem.find_origin(number) - site.place)
    if site.requested is None:
        cost += 0.3 * np.linalg.norm(velocities, axis=1)
    else:
        trajectories = simulate_trajectories(starts, velocities, None, problem.ball, SAMPLE_TIMES)
        cost += pass_cost.measure_misses(*trajectories, toward, site.requested.bounces)
    keys = [(site.player, moments.hits[which].clip, moments.hits[which].hit.first) for which in moments.which]
    # one random number per hit motion, drawn in sorted order: results do not depend on order of moments
    random_costs = dict(zip(sorted(set(keys)), random.uniform(0.0, RANDOM_COST, len(set(keys)))))
    cost += np.array([random_costs[key] for key in keys])
    best = _find_best(cost, moments.which)
    flights = NaturalFlights(starts, velocities, int(best[0]))
    return _Options(moments.select_moments(best), facing[best], cost[best], flights)


def _combine_headings(problem: PassProblem, moments: StrikeMoments, site: Site,
                      toward: np.ndarray) -> tuple[StrikeMoments, np.ndarray]:
    """Combine each moment with each heading.

    The headings turn the natural trajectory to `toward` (3,) m, and to its sides; with eight directions they are
    rounded.
    """
    velocity = moments.part_states.velocity
    natural = arctan2(velocity[:, 1], velocity[:,
                                               0]) * (site.requested is not None)  # the last strike only stops its ball
    bearing = np.arctan2(*(toward[:2] - site.place)[::-1])
    facing = (bearing - natural)[:, None] + TURNS
    if problem.scene.directions:
        facing = site.facing + np.round(quaternion.wrap_angle(facing - site.facing) / EIGHTH_TURN) * EIGHTH_TURN
    every = np.repeat(np.arange(len(moments)), facing.shape[1])
    return moments.select_moments(every), quaternion.wrap_angle(facing.ravel())


def _select_possible(problem: PassProblem, number: int, site: Site) -> StrikeMoments:
    """Select a site's moments; for a ball that lies on the ground those that are low enough."""
    moments, radius = site.moments, problem.ball.radius
    if number or problem.scene.serve != GROUND:
        return moments
    height = moments.place_ball(np.broadcast_to([1.0, 0.0, 0.0], (len(moments), 3)), radius)[:, 2]
    if height.min() >= radius + GROUND_REACH:
        lowest = f"no {site.part} strike of {site.player} is below {height.min():.2f} m"
        found = f"the ball lies on the ground, but {lowest}"
        raise InputError("serve", found, "a motion that strikes lower", "serve from a player or a place")
    return moments.select_moments(height < radius + GROUND_REACH)


def _build_last_link(options: _Options) -> Link:
    """Build the last strike: the option with the lowest cost, without a flight."""
    best = int(np.argmin(options.cost))
    return Link(moment=options.moments.select_moments([best]), facing=float(options.facing[best]), seconds=0.0,
                velocity=np.zeros(3), cost=float(options.cost[best]), natural=options.natural)


def compute_reuse_cost(moments: StrikeMoments, later: Sequence[Link]) -> np.ndarray:
    """Compute what it costs to play hit motions that strikes of the scene play soon after, by any player.

    Args:
        moments: N moments.
        later: the strikes after this one, the next one first.
    Returns:
        (N,) m/s.
    """
    cost = np.zeros(len(moments.hits))
    for number, link in enumerate(later):
        played = int(link.moment.which[0])
        used, recording = link.moment.hits[played], link.moment.recordings[played]
        is_same = np.array([(one.clip, one.hit.first) == (used.clip, used.hit.first) for one in moments.hits])
        is_near = np.array([path == recording for path in moments.recordings])
        cost += REUSE_COST * REUSE_FADE**number * np.where(is_same, 1.0, REUSE_OF_RECORDING * is_near)
    return np.minimum(cost, MOST_REUSE_COST)[moments.which]


def _choose_link(problem: PassProblem, number: int, options: _Options, later: list[Link]) -> Link:
    """Choose the option and travel time that change the natural velocity least (step 8 for each).

    All times are tried with the best option, then the best times with all options.
    """
    seconds = list_travel_times(problem.passes[number], problem.scene.fps)
    after, reuse = later[0], compute_reuse_cost(options.moments, later)
    options = replace(options, cost=options.cost + reuse)
    flights = _solve_flights(problem, number, options, after=after, option=np.zeros(len(seconds), int), seconds=seconds)
    # without any possible flight all times are tried with the other options
    best = np.argsort(flights.cost, kind="stable")[:MOST_TIMES] if np.isfinite(flights.cost).any() else slice(None)
    others = np.arange(1, len(options.cost))
    flights = flights.join_with(_solve_flights(problem, number, options, after, *_pair_all(others, seconds[best])))
    if not np.isfinite(flights.cost).any():
        raise _explain_refusal(problem, number, flights)
    best = int(np.argmin(flights.cost))
    option = int(flights.option[best])
    # the natural trajectory that starts nearest to the chosen flight, for display
    chosen_index = int(np.argmin(np.linalg.norm(options.natural.starts - flights.starts[best], axis=1)))
    return Link(moment=options.moments.select_moments([option]), facing=float(options.facing[option]),
                seconds=float(flights.seconds[best]), velocity=flights.velocity[best],
                cost=float(flights.cost[best] - reuse[option]),
                natural=replace(options.natural, chosen_index=chosen_index))  # fmt: skip


@np.errstate(over="ignore", invalid="ignore")  # impossible flights may overflow
def _solve_flights(problem: PassProblem, number: int, options: _Options, after: Link, option: np.ndarray,
                   seconds: np.ndarray) -> _Flights:
    """Solve flights from `option` (N,) that take `seconds` (N,), and compute their costs."""
    site, one, receiver = problem.sites[number], problem.passes[number], problem.sites[number + 1]
    natural = limit_launch(options.compute_velocities(), site.kind)
    starts = options.compute_centres(site, unit_vectors(natural), problem.ball.radius)[option]
    target = problem.place_ball(number + 1, after, unit_vectors(-natural[0] * [1.0, 1.0, 0.0]))
    spin = compute_spin(starts, target, seconds, problem.ball, site.kind)
    aimed = solve_launches(starts, target, problem.ball, seconds=seconds, bounces=one.bounces, spin=spin,
                           fastest=problem.find_fastest(number))
    flights = (starts, aimed.velocity, spin, seconds)
    trajectories, arriving = simulate_flights(*flights, problem.ball), compute_arrivals(*flights, problem.ball)
    cost = options.cost[option] + np.linalg.norm(aimed.velocity - natural[option], axis=1)
    cost += problem.compute_blocked_cost(number, trajectories).max(axis=1, initial=0.0)
    for near in (site, receiver):
        tall = near.size * pass_cost.TRUNK_TO.get(near.part, pass_cost.TRUNK_HEIGHT)
        cost += pass_cost.compute_trunk_cost(trajectories, problem.ball.radius, near.place, tall)
    cost += pass_cost.compute_push_cost(arriving, after.velocity, _push_direction(receiver, after))
    cost += pass_cost.compute_rise_cost(arriving) + pass_cost.compute_travel_cost(seconds, site.kind)
    is_possible = aimed.possible & (aimed.miss <= ON_TARGET)
    # impossible flights, and those that hit the net, cost infinitely much
    cost = np.where(is_possible & problem.clears_net(trajectories), cost, np.inf)
    return _Flights(option=option, starts=starts, target=target, seconds=seconds, velocity=aimed.velocity, cost=cost,
                    is_reached=bool(is_possible.any()))


def _push_direction(site: Site, link: Link) -> np.ndarray:
    """Direction (3,) in which the part pushes the ball: as it moves; a receiver yields and has the ball in front."""
    own = [0.8, 0.0, 0.6] if site.kind == RECEIVE else link.moment.part_states.velocity[0]
    return rotate_about_up(np.array([own]), link.facing)[0]


def _explain_refusal(problem: PassProblem, number: int, flights: _Flights) -> InputError:
    """Build the error that explains why no flight of a pass is possible."""
    one, part, net = problem.passes[number], problem.sites[number].part, problem.scene.net
    bounces = "a bounce" if one.bounces == 1 else f"{one.bounces} bounces"
    if flights.is_reached:
        found = f"no trajectory over a net of {net.height:g} m with {bounces}"
        next_step = "lower the net, change the bounces or the seconds, or move the players away from the net"
        return InputError(problem.describe_pass(number), found, "one that clears it", next_step)
    within = f" in {one.seconds:g} s" if one.seconds else ""
    far = np.linalg.norm(flights.target - flights.starts[0])
    seconds = list_travel_times(one, problem.scene.fps) if one.seconds else None
    unlimited = solve_launches(flights.starts[:1], flights.target, problem.ball, seconds, one.bounces)
    speed, fastest = float(np.linalg.norm(unlimited.velocity[0])), problem.find_fastest(number)
    found, expected = f"no flight of {far:.1f} m{within} with {bounces}", f"one that a human can give by {part}"
    if unlimited.miss[0] <= ON_TARGET and speed > fastest:
        found = f"a flight of {far:.1f} m{within} with {bounces} takes {speed:.0f} m/s"
        expected = f"up to {fastest:.0f} m/s by {part}"
    return InputError(problem.describe_pass(number), found, expected,
                      "move the players nearer, or change bounces or seconds")


def _find_best(cost: np.ndarray, which: np.ndarray) -> np.ndarray:
    """Find the indices of the lowest costs: MOST_OPTIONS at most, and MOST_PER_HIT of one hit motion."""
    best: list[int] = []
    of_hit: dict[int, int] = {}
    # cheapest first; each hit motion at most MOST_PER_HIT times, so that the options differ
    for index in np.argsort(cost, kind="stable"):
        if of_hit.get(int(which[index]), 0) < MOST_PER_HIT:
            best.append(int(index))
            of_hit[int(which[index])] = of_hit.get(int(which[index]), 0) + 1
        if len(best) == MOST_OPTIONS:
            break
    return np.array(best, dtype=int)


def _pair_all(options: np.ndarray, seconds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Combine every option (N,) with every time (S,): two arrays (N S,)."""
    return np.repeat(options, len(seconds)), np.tile(seconds, len(options))
