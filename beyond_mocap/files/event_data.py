"""A match's event data in one form for all providers, and the assignment of its players to tracked players.

Players are assigned by id, then by shirt number, then by name.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass

from ..annotation.event_labels import EVENT_KINDS
from ..motion.track.match_data import REFEREE, Match, MatchPlayer

NOT_PLAYED = frozenset(kind.name for kind in EVENT_KINDS if kind.touch == "none")
"""Kinds of events without a ball touch."""

CERTAIN_TOUCHES = frozenset(kind.name for kind in EVENT_KINDS if kind.touch == "certain")
"""Kinds of events that are certainly a ball touch."""

_OTHER_TEAM = {"home": "away", "away": "home"}


@dataclass(frozen=True, kw_only=True)
class MatchEvent:
    """One event of a match.

    Attributes:
        time: s from the start of its period, on the events' own clock.
        period: 1 for the first.
        player: the tracking's id, "" if unknown.
        team: "home", "away" or "".
        kind: of `annotation.event_labels.KINDS`.
        part: "foot", "head", "chest", "hand" or "".
        side: "left", "right" or "".
        details: further properties ("throw-in", "lost").
        original_text: the provider's name of the event.
        success: None if the provider does not say.
        place: (x, y) m on the tracking's pitch, or NaN.
    """

    time: float
    period: int
    player: str
    team: str
    kind: str
    part: str = ""
    side: str = ""
    details: tuple[str, ...] = ()
    original_text: str = ""
    success: bool | None = None
    place: tuple[float, ...] = (float("nan"), float("nan"))

    @property
    def may_be_touch(self) -> bool:
        """Whether the event is known to be, or may be, a ball touch."""
        return self.kind not in NOT_PLAYED


@dataclass(frozen=True)
class MatchEvents:
    """All events of a match, ordered by period and time.

    Attributes:
        events: the events.
        provider: the provider of the file.
        where: the file, for messages.
        notes: assumptions and missing data, one line each.
    """

    events: tuple[MatchEvent, ...]
    provider: str
    where: str = "events"
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class EventPlayer:
    """A player as events name them.

    Attributes:
        id: the provider's id.
        team: "home", "away" or "".
        number: shirt number, -1 if unknown.
        name: the name, or "".
    """

    id: str
    team: str = ""
    number: int = -1
    name: str = ""

    @classmethod
    def from_text(cls, text: str, team: str = "") -> "EventPlayer":
        """Parse one cell: "home_7", "away 11", "Player7", or a name or an id.

        Args:
            text: the cell.
            team: the team if the cell does not name it.
        Returns:
            The player.
        """
        match = re.fullmatch(r"(?i)(home|away|player)?[ _-]*#?(\d{1,2})", text.strip())
        ground = match[1].lower() if match and match[1] and match[1].lower() != "player" else team
        return cls(text.strip(), ground, int(match[2]) if match else -1, text.strip())

    @property
    def display_name(self) -> str:
        """The player's name for messages."""
        return self.name or f"{self.team} {self.number if self.number >= 0 else self.id}".strip()


def assign_players(event_players: Sequence[EventPlayer], match: Match
                   | None) -> tuple[dict[EventPlayer, tuple[str, str]], list[str]]:
    """Assign the players of events to the players of a match.

    Feeds may exchange home and away: the assignment that finds more players is used.

    Args:
        event_players: the players of the events.
        match: the tracked match, or None.
    Returns:
        Event player -> (id, team) in the match for those that are found, and notes.
    """
    if match is None:
        return {}, []
    players = [player for player in match.players if player.team != REFEREE]
    as_named = {who: found for who in event_players if (found := _find_player(who, players, who.team))}
    exchanged = {who: found for who in event_players
                 if (found := _find_player(who, players, _OTHER_TEAM.get(who.team, "")))}
    notes = []
    best = as_named
    if len(exchanged) > len(as_named):
        best = exchanged
        notes.append("home and away are exchanged in the events")
    missing = [who.display_name for who in event_players if who not in best]
    if missing:
        notes.append(
            f"not tracked: {len(missing)} of {len(event_players)} players of the events: {', '.join(missing[:6])}")
    return {who: (player.id, player.team) for who, player in best.items()}, notes


def _find_player(who: EventPlayer, players: Sequence[MatchPlayer], team: str) -> MatchPlayer | None:
    """Find the one player who matches: by id, then within the team by number, then by name."""
    by_id = [player for player in players if player.id == who.id and team in ("", player.team)]
    teammates = [player for player in players if team in ("", player.team)]
    by_number = [player for player in teammates if who.number >= 0 and player.number == who.number] if team else []
    name = _normalize_name(who.name)
    by_name = [player for player in teammates if name and _normalize_name(player.name) == name]
    by_last = [player for player in teammates if name and _normalize_name(player.name).split()[-1:]
               == name.split()[-1:]]
    return next((found[0] for found in (by_id, by_number, by_name, by_last) if len(found) == 1), None)


def _normalize_name(name: str) -> str:
    """Convert a name to lower case without accents."""
    flat = unicodedata.normalize("NFKD", name)
    return " ".join("".join(letter for letter in flat if not unicodedata.combining(letter)).lower().split())
