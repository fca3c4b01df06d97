"""Which seconds of a match came out worst, whoever's they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .results import PlayerResult

LIMITS = {"root_error_m": 0.015, "skate_cm_s": 7.0, "overlap_m": 0.02}
"""Figure -> what it is to stay below in a second: 1.5 cm off the track, two bodies 2 cm into each other; 7 cm/s is a
standing foot that goes 21 mm, which eyes notice, within a step of 0.3 s."""
MOST = 10
APART = 3
"""Seconds within which a player's bad seconds are one."""


@dataclass(frozen=True, kw_only=True)
class WorstSecond:
    """One bad second. player: who; time: its beginning, s on the match clock. figure: the one of LIMITS that is worst
    there, value in its unit, times: over its limit. other: the player into whom he runs, None where nobody is told."""

    player: PlayerResult
    time: float
    figure: str
    value: float
    times: float
    other: PlayerResult | None = None


def badness(player: PlayerResult) -> np.ndarray:
    """(S,) how many times the limit the worst figure of each second is; NaN where nothing is known."""
    rows = [player.per_second[figure] / limit for figure, limit in LIMITS.items() if figure in player.per_second]
    if not rows:
        return np.zeros(0)
    return np.fmax.reduce(rows)


def worst_seconds(players: Sequence[PlayerResult], most: int = MOST) -> tuple[WorstSecond, ...]:
    """At most `most` seconds beyond their limits, the worst first; of a player's seconds that follow each other within
    APART the worst stands for all, and two bodies in each other are one."""
    found: list[WorstSecond] = []
    for who, row, times in _in_order(players):
        player, time = players[who], players[who].start + row
        figure = _worst_figure(player, row)
        value = float(player.per_second[figure][row])
        if any(_same(one, player, time, figure, value) for one in found):
            continue
        other = _other(players, player, time, value) if figure == "overlap_m" else None
        found.append(WorstSecond(player=player, time=time, figure=figure, value=value, times=times, other=other))
        if len(found) == most:
            break
    return tuple(found)


def _in_order(players: Sequence[PlayerResult]) -> list[tuple[int, int, float]]:
    """(player, row of per_second, badness) of all seconds beyond a limit, the worst first."""
    each = [(who, badness(player)) for who, player in enumerate(players)]
    rows = [(who, int(row), float(bad[row])) for who, bad in each for row in np.flatnonzero(np.nan_to_num(bad) > 1.0)]
    return sorted(rows, key=lambda entry: (-entry[2], entry[0], entry[1]))


def _worst_figure(player: PlayerResult, row: int) -> str:
    shares = {figure: player.per_second[figure][row] / limit for figure, limit in LIMITS.items()
              if figure in player.per_second}
    return max(shares, key=lambda figure: np.nan_to_num(shares[figure], nan=-1.0))


def _same(one: WorstSecond, player: PlayerResult, time: float, figure: str, value: float) -> bool:
    """Whether this second is told already: his own nearby, or the same two bodies from the other's side."""
    if abs(one.time - time) > APART:
        return False
    return one.player is player or (figure == one.figure == "overlap_m" and one.other is player)


def _other(players: Sequence[PlayerResult], player: PlayerResult, time: float, value: float) -> PlayerResult | None:
    """Who is as deep in somebody in that second, to the millimetre; None where nobody or more than one is."""
    like = [one for one in players if one is not player and abs(_at(one, "overlap_m", time) - value) < 1e-3]
    return like[0] if len(like) == 1 else None


def _at(player: PlayerResult, figure: str, time: float) -> float:
    row, column = round(time - player.start), player.per_second.get(figure, ())
    return float(column[row]) if 0 <= row < len(column) else np.nan
