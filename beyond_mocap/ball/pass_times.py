"""When each strike is: a chain of travels, long enough for who strikes next (Fig. 5)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

from .orders import HitOrder, Stance
from .pass_court import Court, Link
from .pass_scene import GROUND

LONGER = 6
"""How many longer flights are tried at most where there is too little time."""

Need = Callable[[str, "HitOrder | Stance", HitOrder], float]
"""Seconds that a player needs from one strike, or from standing, to the next."""


def first_time(court: Court, order: HitOrder, need: Need) -> float:
    """Seconds, a whole frame: the first strike, when who makes it is ready and the serve has come."""
    site, fps = court.sites[0], court.scene.fps
    least = max(court.scene.lead_in, need(site.player, _standing(court, site.player), order))
    if court.scene.serve != GROUND:
        least = max(least, court.serving_seconds(np.array(order.ball)))
    return float(np.ceil(least * fps - 1e-6) / fps)


def in_time(
    court: Court, chain: list[Link], orders: Sequence[HitOrder], places: np.ndarray, first: float, need: Need
) -> tuple[list[Link], list[str]]:
    """The chain with flights long enough for who strikes next, and a line for everybody who still has too little
    time."""
    told: list[str] = []
    last_of: dict[str, int] = {}
    for number, site in enumerate(court.sites):
        before = last_of.get(site.player)
        start = _standing(court, site.player) if before is None else orders[before]
        needed = need(site.player, start, orders[number])
        lack = needed - _time(chain, before, number, first)
        if lack > 1e-6 and number:
            chain = _longer(court, chain, range(before or 0, number), lack, places)
        have = _time(chain, before, number, first)
        if needed - have > 0.5 / court.scene.fps:
            at = _time(chain, None, number, first)
            told.append(f"{site.player} has {have:.1f} s before the strike at {at:.2f} s, and needs {needed:.1f} s")
        last_of[site.player] = number
    return chain, told


def _standing(court: Court, name: str) -> Stance:
    return Stance(court.scene.player(name).place, court.scene.facing(name))


def _time(chain: Sequence[Link], before: int | None, number: int, first: float) -> float:
    """Seconds from one strike, or from the beginning, to another."""
    return sum(link.seconds for link in chain[before or 0 : number]) + (first if before is None else 0.0)


def _longer(court: Court, chain: list[Link], which: Iterable[int], lack: float, places: np.ndarray) -> list[Link]:
    """The chain with some flights longer, by the frame, as far as they can be; those whose seconds are asked stay."""
    fps = court.scene.fps
    free = [number for number in which if court.passes[number].seconds is None]
    chain = list(chain)
    for done, number in enumerate(free):
        frames = int(np.ceil(lack * fps / (len(free) - done) - 1e-6))
        if frames <= 0:
            break
        tried = chain[number].seconds + np.arange(frames, 0, -max(frames // LONGER, 1)) / fps
        aimed, good = court.flown(number, np.tile(places[number], (len(tried), 1)), places[number + 1], tried)
        if good.any():
            longer = int(np.argmax(good))
            lack -= tried[longer] - chain[number].seconds
            chain[number] = replace(chain[number], seconds=float(tried[longer]), velocity=aimed.velocity[longer])
    return chain
