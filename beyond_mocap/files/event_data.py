"""A match's event data in one form for all providers, and the assignment of its players to tracked players.

Players are assigned by id, then by shirt number, then by name.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass

from ..annotation.event_words import EVENT_KINDS
from ..motion.track.match_data import REFEREE, Match, MatchPlayer

NOT_PLAYED = frozenset(kind.name for kind in EVENT_KINDS if kind.touch == "none")
"""Kinds of events without a ball touch."""

CERTAIN = frozenset(kind.name for kind in EVENT_KINDS if kind.touch == "certain")
"""Kinds of events that are certainly a ball touch."""

_OTHER = {"home": "away", "away": "home"}


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
    said: str = ""
    success: bool | None = None
    place: tuple[float, ...] = (float("nan"), float("nan"))

    @property
    def played(self) -> bool:
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
class Who:
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
    def spelled(cls, said: str, team: str = "") -> "Who":
        """Parse one cell: "home_7", "away 11", "Player7", or a name or an id.

        Args:
            text: the cell.
            team: the team if the cell does not name it.
        Returns:
            The player.
        """
        match = re.fullmatch(r"(?i)(home|away|player)?[ _-]*#?(\d{1,2})", said.strip())
        ground = match[1].lower() if match and match[1] and match[1].lower() != "player" else team
        return cls(said.strip(), ground, int(match[2]) if match else -1, said.strip())

    @property
    def said(self) -> str:
        """The player's name for messages."""
        return self.name or f"{self.team} {self.number if self.number >= 0 else self.id}".strip()


def same_players(everybody: Sequence[Who], match: Match | None) -> tuple[dict[Who, tuple[str, str]], list[str]]:
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
    straight = {who: found for who in everybody if (found := _found(who, players, who.team))}
    turned = {who: found for who in everybody if (found := _found(who, players, _OTHER.get(who.team, "")))}
    notes = []
    best = straight
    if len(turned) > len(straight):
        best = turned
        notes.append("home and away are exchanged in the events")
    lost = [who.said for who in everybody if who not in best]
    if lost:
        notes.append(f"{len(lost)} of {len(everybody)} players of the events are not tracked: {', '.join(lost[:6])}")
    return {who: (player.id, player.team) for who, player in best.items()}, notes


def _found(who: Who, players: Sequence[MatchPlayer], team: str) -> MatchPlayer | None:
    """Find the one player who matches: by id, then within the team by number, then by name."""
    by_id = [player for player in players if player.id == who.id and team in ("", player.team)]
    own = [player for player in players if team in ("", player.team)]
    by_number = [player for player in own if who.number >= 0 and player.number == who.number] if team else []
    name = _plain(who.name)
    by_name = [player for player in own if name and _plain(player.name) == name]
    by_last = [player for player in own if name and _plain(player.name).split()[-1:] == name.split()[-1:]]
    return next((found[0] for found in (by_id, by_number, by_name, by_last) if len(found) == 1), None)


def _plain(name: str) -> str:
    """Convert a name to lower case without accents."""
    flat = unicodedata.normalize("NFKD", name)
    return " ".join("".join(letter for letter in flat if not unicodedata.combining(letter)).lower().split())
