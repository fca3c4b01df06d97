"""Duels for the ball: one player touches it, an opponent close to it reaches and misses by design.

Tracking does not say who fights for a ball. An opponent whose leg could reach it at the moment of a touch, who has it
ahead and does not touch it within half a second, is taken to reach for it; an event of their own (a lost tackle or
aerial) confirms it. Their key moment excludes `touch`, so their body comes near the ball and never moves it
(`synthesis.construct.near_miss`). An opponent whom a kick hits within BLOCK_SECONDS blocks it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..annotation import AVOID_PREFIX
from ..annotation.event_labels import EventLabelTable
from ..annotation.timeline import TOUCH
from ..ball.tracked import kinds
from ..ball.tracked.solve import SolvedTouch
from ..ball.tracked.touches import measure_player_distances
from ..motion.track.match_data import REFEREE, Match
from .event_clock import AlignedEvents
from .moments import DUELS, MIN_DISTANCE_SECONDS, Moment, build_moment

REACH, EVENT_REACH = 1.2, 2.0
"""m from the ball within which an opponent may reach for it: a long step and a stretched leg; farther where their own
event says so."""

APART_SECONDS = 2.0
"""s between two duels of one player: no player lunges at each touch of a dribble."""

BLOCK_SECONDS, BLOCKED_SPEED = 0.35, 12.0
"""s after a kick within which an opponent has no time for a swing of their own, and m/s of the ball then: who meets it
blocks it."""

RUNNING = "running"
"""Pace of a player who stretches a leg in the run instead of blocking from a stand."""

_MIN_CONFIDENCE = 0.3  # of the touch
_EVENT_SECONDS = 1.0  # s between a touch and the event of the opponent who lost it
_DUEL_EVENTS = ("tackle", "aerial", "take-on", "interception")
_TURNED_SPEED, _TURNED_ANGLE = 2.0, np.radians(100.0)  # m/s from which a player reaches for no ball behind them
_SIDE_SPEED, _SIDE_ANGLE = 1.0, np.radians(25.0)  # m/s and rad off the travel from which the foot on that side reaches
_HIGHEST_BLOCK, _BLOCK_GAIN = 0.45, 1.2  # m of the ball's centre; factor on its speed by which no block speeds it up
_UNCONTESTED = (kinds.THROW_IN, kinds.HAND, kinds.SAVE, kinds.CHEST_CONTROL)  # by a foot or a head


@dataclass(frozen=True, kw_only=True)
class Duel:
    """A duel.

    Attributes:
        time: s, of the winner's touch.
        winner: id of the player who touches the ball.
        loser: id of the opponent who reaches for it.
        kind: "aerial" for a header, else "tackle"; the kind of event whose row with the detail "lost" names the labels,
            "interception" for a tackle of a runner: a leg stretched for the ball without a stop.
        details: of the loser's event, () without one.
        distance: m on the ground from the loser's place to the ball.
        side: "left", "right", or "" for a ball ahead.
        height: m of the ball's centre.
        confidence: 0 to 1.
    """

    time: float
    winner: str
    loser: str
    kind: str
    details: tuple[str, ...]
    distance: float
    side: str
    height: float
    confidence: float


def find_duels(
    match: Match, touches: Sequence[SolvedTouch], keepers: Collection[str] = (), aligned: AlignedEvents | None = None
) -> tuple[Duel, ...]:
    """Find the duels of a match: at most one opponent for each touch, the nearest.

    Args:
        match: the match.
        touches: solved, in order of time.
        keepers: ids of the goalkeepers, who reach with their hands (`goalkeeping`).
        aligned: the provider's events, None without.
    Returns:
        The duels in order of time.
    """
    search = _DuelSearch(match, touches, frozenset(keepers), aligned)
    found = [duel for number in range(len(touches)) if (duel := search.find_duel(number)) is not None]
    chosen: list[Duel] = []
    for duel in sorted(found, key=lambda duel: (-duel.confidence, duel.time)):
        if all(duel.loser != other.loser or abs(duel.time - other.time) >= APART_SECONDS for other in chosen):
            chosen.append(duel)
    return tuple(sorted(chosen, key=lambda duel: duel.time))


def label_lost_duels(
    duels: Sequence[Duel], player: str, table: EventLabelTable, values: Mapping[float, Mapping[str, str]]
) -> list[Moment]:
    """Label what a player does in the duels that they lose.

    Args:
        duels: of the match.
        player: id.
        table: labels by event.
        values: by the duel's time, the labels that replace placeholders.
    Returns:
        Key moments that miss the ball.
    """
    out = []
    for duel in duels:
        if duel.loser == player:
            found = {**values.get(duel.time, {}), "side": duel.side}
            kind = "interception" if duel.kind == "tackle" and found.get("gait") == RUNNING else duel.kind
            labels = table.find_labels(kind, "head" if kind == "aerial" else "foot", (*duel.details, "lost"), found)
            out.append(build_moment(duel.time, (*labels, AVOID_PREFIX + TOUCH), DUELS, duel.confidence))
    return [moment for moment in out if moment is not None]


def find_blocks(match: Match, touches: Sequence[SolvedTouch]) -> frozenset[int]:
    """Find the touches with which an opponent blocks a kick with the foot.

    Args:
        match: the match.
        touches: solved, in order of time.
    Returns:
        Their indices.
    """
    teams = {player.id: player.team for player in match.players}
    return frozenset(number + 1 for number, (kick, touch) in enumerate(zip(touches, touches[1:]))
                     if kick.player and touch.player and teams[kick.player] != teams[touch.player]
                     and _is_block(kick, touch))


def _is_block(kick: SolvedTouch, touch: SolvedTouch) -> bool:
    """Say whether a touch by an opponent blocks a kick."""
    before, after = (float(np.linalg.norm(velocity)) for velocity in (touch.before, touch.after))
    return (kick.kind == kinds.KICK and touch.kind in (kinds.KICK, kinds.DEFLECTION) and touch.part == "foot"
            and touch.time - kick.time <= BLOCK_SECONDS and touch.position[2] <= _HIGHEST_BLOCK
            and before >= BLOCKED_SPEED and after <= _BLOCK_GAIN * before)


class _DuelSearch:
    """Where every player is at each touch."""

    def __init__(self, match: Match, touches: Sequence[SolvedTouch], keepers: frozenset[str],
                 aligned: AlignedEvents | None):
        self._match, self._touches, self._aligned = match, touches, aligned
        self._teams = {player.id: player.team for player in match.players}
        self._may_lose = np.array([player.team != REFEREE and player.id not in keepers for player in match.players])
        self._times = np.array([touch.time for touch in touches])
        ball = np.array([touch.position[:2] for touch in touches]).reshape(-1, 2)
        self._distances = measure_player_distances(match.times, ball, match.positions, self._times)

    def find_duel(self, number: int) -> Duel | None:
        """Find the duel at a touch, None if no opponent contests it."""
        touch = self._touches[number]
        if not touch.player or touch.confidence < _MIN_CONFIDENCE or touch.kind in _UNCONTESTED:
            return None
        is_opponent = np.array([player.team != self._teams[touch.player] for player in self._match.players])
        distances = np.where(is_opponent & self._may_lose, self._distances[:, number], np.inf)
        for row in np.argsort(distances, kind="stable"):
            if distances[row] > EVENT_REACH:
                break
            duel = self._build_duel(touch, int(row), float(distances[row]))
            if duel is not None:
                return duel
        return None

    def _build_duel(self, touch: SolvedTouch, row: int, distance: float) -> Duel | None:
        """Build the duel with an opponent; None if they do not reach for the ball."""
        loser = self._match.players[row].id
        event = self._find_event(loser, touch.time)
        if distance > (REACH if event is None else EVENT_REACH) or self._touches_near(loser, touch.time):
            return None
        bearing = self._measure_bearing(row, touch)
        if bearing is not None and bearing[1] > _TURNED_SPEED and abs(bearing[0]) > _TURNED_ANGLE:
            return None
        is_aside = bearing is not None and bearing[1] > _SIDE_SPEED and abs(bearing[0]) > _SIDE_ANGLE
        doubt = 0.5 * distance / (REACH if event is None else EVENT_REACH)
        return Duel(time=touch.time, winner=touch.player, loser=loser, details=() if event is None else event.details,
                    kind="aerial" if touch.part == "head" else "tackle", distance=distance,
                    side=("left" if bearing[0] > 0.0 else "right") if is_aside else "", height=float(touch.position[2]),
                    confidence=touch.confidence * (1.0 - doubt if event is None else 1.0))

    def _touches_near(self, player: str, time: float) -> bool:
        """Say whether a player touches the ball within MIN_DISTANCE_SECONDS."""
        near = np.flatnonzero(np.abs(self._times - time) < MIN_DISTANCE_SECONDS)
        return any(self._touches[index].player == player for index in near)

    def _find_event(self, player: str, time: float):
        """Find the event of a duel that a player takes part in without a touch; None if there is none."""
        if self._aligned is None:
            return None
        rows = zip(self._aligned.events, self._aligned.times, self._aligned.touches)
        return next((event for event, at, touch in rows if touch < 0 and event.player == player
                     and event.kind in _DUEL_EVENTS and abs(at - time) <= _EVENT_SECONDS), None)

    def _measure_bearing(self, row: int, touch: SolvedTouch) -> tuple[float, float] | None:
        """Measure the ball's bearing from a player's travel, rad, left positive, and their speed, m/s; None if they are
        absent around the touch.
        """
        times, path = self._match.times, self._match.positions[row]
        first, last = (int(np.clip(np.searchsorted(times, touch.time + step), 0, len(times) - 1))
                       for step in (-0.2, 0.2))
        if last <= first or not np.isfinite(path[[first, last]]).all():
            return None
        velocity = (path[last] - path[first]) / (times[last] - times[first])
        to_ball = touch.position[:2] - 0.5 * (path[first] + path[last])
        across = velocity[0] * to_ball[1] - velocity[1] * to_ball[0]
        return float(np.arctan2(across, velocity @ to_ball)), float(np.linalg.norm(velocity))
