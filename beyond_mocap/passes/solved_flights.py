"""The flights between chosen strikes, solved exactly (Ball handling, section 4; Table 1, step 8).

A ball touches its part along the change of its velocity. That moves the ball a little, and with it the flights, so ball
places and flights are solved in turns for some rounds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..ball.aim import solve_launches
from ..ball.flight import Launch
from ..base.vectors import unit_vectors
from .pass_problem import LONGEST_SERVE, ON_TARGET, Link, PassProblem, compute_arrivals, compute_spin, rotate_about_up
from .pass_scene import GROUND

MISS_DISTANCE = 0.45
"""Metres by which a missed ball passes the part."""
ROUNDS = 5  # rounds in which ball places and flights are solved in turns
LAUNCH_CHANGE = 3.0
"""m/s between two launches above which the ball takes a different trajectory, such as into the ground instead of up."""
FRAME_OFFSETS = np.array([1, -1, 2, -2, 3, -3, 5, -5, 8, -8, 12])
"""Frames that are added to a flight where the ball's places have moved."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SolvedFlights:
    """Flights of K strikes.

    Attributes:
        serve: launch of the ball before the first strike.
        places: (K, 3) m, the ball at each strike.
        normals: (K, 3) unit vectors from part to ball.
        arriving: (K, 3) m/s of the balls.
        leaving: (K-1, 3) m/s of the balls.
        spin: (K-1, 3) rad/s of the leaving balls.
        missed: (K-1,) m by which each flight misses the next strike.
    """

    serve: Launch
    places: np.ndarray
    normals: np.ndarray
    arriving: np.ndarray
    leaving: np.ndarray
    spin: np.ndarray
    missed: np.ndarray


def estimate_ball_places(problem: PassProblem, chain: Sequence[Link]) -> tuple[np.ndarray, np.ndarray]:
    """Compute places (K, 3) m and normals (K, 3) of the balls if each part pushes its ball in the direction of its
    movement.
    """
    part_velocities = np.array([rotate_about_up(link.moment.part_states.velocity, link.facing)[0] for link in chain])
    return _place_balls(problem, chain, unit_vectors(part_velocities))


def fit_flights(problem: PassProblem, chain: list[Link], places: np.ndarray, first: float) -> tuple[list[Link],
        SolvedFlights]:
    """Solve flights and ball places together; some flights may become some frames longer or shorter.

    Args:
        problem: the scene with its sites.
        chain: the K strikes.
        places: (K, 3) m, first estimate of the balls' places.
        first: s of the first strike.
    Returns:
        chain: the strikes with their new travel times.
        flown: their flights.
    """
    serve_seconds = 0.0 if problem.scene.serve == GROUND else min(first, LONGEST_SERVE)  # it starts as the scene begins
    # ball places follow from flights, flights from places; this converges in a few rounds
    for _ in range(ROUNDS):
        leaving, spin, missed = _solve_between(problem, chain, places)
        _, arriving = _compute_arriving(problem, chain, places, serve_times=(first, serve_seconds), leaving=leaving,
                                        spin=spin)
        places, _ = _place_balls(problem, chain, unit_vectors(np.concatenate([leaving, np.zeros((1, 3))]) - arriving))
        chain = _adjust_flights(problem, chain, places, missed)
    leaving, spin, missed = _solve_between(problem, chain, places, last=True)
    serve, arriving = _compute_arriving(problem, chain, places, serve_times=(first, serve_seconds), leaving=leaving,
                                        spin=spin)
    normals = unit_vectors(np.concatenate([leaving, np.zeros((1, 3))]) - arriving)
    return chain, SolvedFlights(serve=serve, places=places, normals=normals, arriving=arriving, leaving=leaving,
                                spin=spin, missed=missed)


def _place_balls(problem: PassProblem, chain: Sequence[Link], normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute the balls' places (K, 3) m on their parts toward `normals` (K, 3); both are returned."""
    each = enumerate(zip(chain, normals))
    return np.array([problem.place_ball(number, link, normal) for number, (link, normal) in each]), normals


def _solve_between(problem: PassProblem, chain, places, last: bool = False) -> tuple[np.ndarray, np.ndarray,
        np.ndarray]:
    """Solve the flights between strikes.

    A ball that only a very different flight would bring to the next strike takes that flight in the `last` round only;
    before, it counts as a miss.

    Returns:
        velocities: (K-1, 3) m/s with which the balls leave.
        spin: (K-1, 3) rad/s.
        missed: (K-1,) m by which they miss the next strike.
    """
    targets = np.array([_find_target(problem, number, places, chain) for number in range(problem.last)])
    seconds, spin = np.array([link.seconds for link in chain[:-1]]), _compute_spins(problem, chain, places, targets)
    bounces = np.array([one.bounces for one in problem.passes])
    velocities, missed = np.empty((problem.last, 3)), np.empty(problem.last)
    for count in np.unique(bounces):
        same = np.flatnonzero(bounces == count)
        near = np.array([chain[number].velocity for number in same])
        aimed = solve_launches(places[same], targets[same], problem.ball, seconds=seconds[same], bounces=int(count),
                               spin=spin[same], initial_velocity=near)
        # a jump of the launch velocity means another trajectory: keep the old one until the last round
        other = (np.linalg.norm(aimed.velocity - near, axis=1) > LAUNCH_CHANGE) & (not last)
        velocities[same] = np.where(other[:, None], near, aimed.velocity)
        missed[same] = np.where(other, np.inf, aimed.miss)
    return velocities, spin, missed


def _compute_spins(problem: PassProblem, chain, places, targets) -> np.ndarray:
    """Compute the spins (K-1, 3) rad/s with which the balls leave."""
    each = zip(places[:-1], targets, chain, problem.sites)
    return np.array([compute_spin(a[None], b, np.array([link.seconds]), problem.ball, site.kind)[0] for a, b, link,
                     site in each])


def _find_target(problem: PassProblem, number: int, places: np.ndarray, chain: Sequence[Link]) -> np.ndarray:
    """Compute the target (3,) m of a pass: the next strike, or a point past it if the ball is missed."""
    place, site = places[number + 1], problem.sites[number + 1]
    if problem.passes[number].error != "missed":
        return place
    if site.part in ("head", "chest"):
        return place + [0.0, 0.0, MISS_DISTANCE]
    facing = chain[number + 1].facing
    beside = np.array([-np.sin(facing), np.cos(facing), 0.0])
    side = np.sign((place[:2] - site.place) @ beside[:2]) or 1.0
    return place + side * MISS_DISTANCE * beside


def _compute_arriving(problem: PassProblem, chain, places, serve_times: tuple[float, float], leaving,
                      spin) -> tuple[Launch, np.ndarray]:
    """Compute the serve and the velocities (K, 3) m/s with which all balls arrive.

    Args:
        serve_times: s of the first strike, and for how many s the ball has flown by then.
    """
    serve, served = _solve_serve(problem, places[0], *serve_times)
    seconds = np.array([link.seconds for link in chain[:-1]])
    return serve, np.concatenate([served[None], compute_arrivals(places[:-1], leaving, spin, seconds, problem.ball)])


def _solve_serve(problem: PassProblem, place: np.ndarray, first: float, seconds: float) -> tuple[Launch, np.ndarray]:
    """Compute the launch `seconds` before the first strike at `first` s, and the ball's velocity (3,) m/s there."""
    if problem.scene.serve == GROUND:
        return Launch(0.0, place, np.zeros(3)), np.zeros(3)
    start = problem.find_serving_place(place)
    aimed = solve_launches(start[None], place[None], problem.ball, np.array([seconds]), 0)
    launch = Launch(first - seconds, start, aimed.velocity[0])
    return launch, compute_arrivals(start[None], aimed.velocity, None, np.array([seconds]), problem.ball)[0]


def _adjust_flights(problem: PassProblem, chain: list[Link], places: np.ndarray, missed: np.ndarray) -> list[Link]:
    """Change flights that miss by some frames, where they then reach the next strike."""
    chain, fps = list(chain), problem.scene.fps
    for number in np.flatnonzero(missed > ON_TARGET):
        frames = round(chain[number].seconds * fps) + FRAME_OFFSETS
        frames = frames[frames > 2]
        starts = np.tile(places[number], (len(frames), 1))
        aimed, good = problem.solve_launches(number, starts, _find_target(problem, number, places, chain), frames / fps)
        if good.any() and problem.passes[number].seconds is None:
            other = np.linalg.norm(aimed.velocity - chain[number].velocity, axis=1)
            best = int(np.argmin(np.where(good, other, np.inf)))
            chain[number] = replace(chain[number], seconds=float(frames[best] / fps), velocity=aimed.velocity[best])
    return chain
