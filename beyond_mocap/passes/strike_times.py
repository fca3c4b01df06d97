"""The time of each strike: a chain of flights that leave the next player enough time (Ball handling, Fig. 5)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

from .pass_problem import Link, PassProblem
from .pass_scene import GROUND
from .player_path import HitOrder, Stance

MOST_LONGER = 6
"""Most longer flights that are tried where a player has too little time."""
Need = Callable[[str, "HitOrder | Stance", HitOrder], float]
"""Returns the seconds that a player needs from one strike, or from standing, to the next."""


def find_first_time(problem: PassProblem, order: HitOrder, need: Need) -> float:
    """Compute the time of the first strike: when its player is ready and the serve has arrived.

    Args:
        problem: the scene with its sites.
        order: the first strike.
        need: seconds that a player needs.
    Returns:
        Seconds, a whole frame.
    """
    site, fps = problem.sites[0], problem.scene.fps
    least = max(problem.scene.lead_in, need(site.player, _build_stance(problem, site.player), order))
    if problem.scene.serve != GROUND:
        least = max(least, problem.find_serving_seconds(np.array(order.ball)))
    return float(np.ceil(least * fps - 1e-6) / fps)


def lengthen_flights(problem: PassProblem, chain: list[Link], orders: Sequence[HitOrder], places: np.ndarray,
                     first: float, need: Need) -> tuple[list[Link], list[str]]:
    """Lengthen flights until every player has enough time for their strikes.

    Args:
        problem: the scene with its sites.
        chain: the strikes.
        orders: their orders.
        places: (K, 3) m, the ball at each strike.
        first: s of the first strike.
        need: seconds that a player needs.
    Returns:
        chain: the strikes with their new travel times.
        warnings: one line for each player who still has too little time.
    """
    warnings: list[str] = []
    last_of: dict[str, int] = {}
    for number, site in enumerate(problem.sites):
        before = last_of.get(site.player)
        start = _build_stance(problem, site.player) if before is None else orders[before]
        needed = need(site.player, start, orders[number])
        missing = needed - _time_between(chain, before, number, first)
        if missing > 1e-6 and number:
            chain = _lengthen_chain(problem, chain, range(before or 0, number), missing, places)
        have = _time_between(chain, before, number, first)
        if needed - have > 0.5 / problem.scene.fps:
            at = _time_between(chain, None, number, first)
            warnings.append(f"{site.player} has {have:.1f} s before the strike at {at:.2f} s, but needs {needed:.1f} s")
        last_of[site.player] = number
    return chain, warnings


def _lengthen_chain(problem: PassProblem, chain: list[Link], which: Iterable[int], missing: float,
                    places: np.ndarray) -> list[Link]:
    """Lengthen flights by whole frames where possible; passes with a requested time stay as they are.

    Args:
        which: indices of the flights that may be longer.
        missing: seconds that are missing.
        places: (K, 3) m, the ball at each strike.
    """
    fps = problem.scene.fps
    adjustable = [number for number in which if problem.passes[number].seconds is None]
    chain = list(chain)
    for done, number in enumerate(adjustable):
        # the missing time, shared evenly by the flights that are left
        frames = int(np.ceil(missing * fps / (len(adjustable) - done) - 1e-6))
        if frames <= 0:
            break
        # longest first, so that the first possible one takes the largest share of the missing time
        tried = chain[number].seconds + np.arange(frames, 0, -max(frames // MOST_LONGER, 1)) / fps
        aimed, good = problem.solve_launches(number, np.tile(places[number], (len(tried), 1)), places[number + 1],
                                             tried)
        if good.any():
            longer = int(np.argmax(good))
            missing -= tried[longer] - chain[number].seconds
            chain[number] = replace(chain[number], seconds=float(tried[longer]), velocity=aimed.velocity[longer])
    return chain


def _build_stance(problem: PassProblem, name: str) -> Stance:
    """Build the stance in which a player begins."""
    return Stance(problem.scene.find_player(name).place, problem.scene.find_facing(name))


def _time_between(chain: Sequence[Link], before: int | None, number: int, first: float) -> float:
    """Compute the seconds from one strike, or from the beginning, to another."""
    return sum(link.seconds for link in chain[before or 0 : number]) + (first if before is None else 0.0)
