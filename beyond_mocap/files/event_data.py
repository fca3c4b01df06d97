"""What a provider's people wrote down of a match: passes, shots, saves, in one form for all of them; and which tracked
player each of its people is: by id, by shirt number, by name."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass

from ..annotation.event_words import EVENT_KINDS
from ..motion.track.match_data import REFEREE, Match, MatchPlayer

NOT_PLAYED = frozenset(kind.name for kind in EVENT_KINDS if kind.touch == "none")
"""Kinds that are no touch of the ball."""

CERTAIN = frozenset(kind.name for kind in EVENT_KINDS if kind.touch == "certain")
"""Kinds that are a touch for certain."""

_OTHER = {"home": "away", "away": "home"}


@dataclass(frozen=True, kw_only=True)
class MatchEvent:
    """Somebody did something.

    time: s from the begin of its period, on the events' own clock. period: 1 for the first. player: the tracking's id,
    "" where he is not known. team: "home", "away" or "". kind: of `annotation.event_words.KINDS`. part: "foot",
    "head", "chest", "hand" or "". side: "left", "right" or "". details: further words ("throw-in", "lost"). said: how
    the provider calls it. success: None where it does not say. place: (x, y) m on the tracking's pitch, or NaN."""

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
        """Whether the ball is touched, as far as is known."""
        return self.kind not in NOT_PLAYED


@dataclass(frozen=True)
class MatchEvents:
    """All events of a match by period and time. provider: whose form they had. where: the file, for messages. notes:
    what was guessed or is missing, for people."""

    events: tuple[MatchEvent, ...]
    provider: str
    where: str = "events"
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Who:
    """Somebody as events name him: id; team "home", "away" or ""; shirt number, -1 where unknown; name."""

    id: str
    team: str = ""
    number: int = -1
    name: str = ""

    @classmethod
    def spelled(cls, said: str, team: str = "") -> "Who":
        """From one cell: "home_7", "away 11", "Player7", or a name or an id."""
        match = re.fullmatch(r"(?i)(home|away|player)?[ _-]*#?(\d{1,2})", said.strip())
        ground = match[1].lower() if match and match[1] and match[1].lower() != "player" else team
        return cls(said.strip(), ground, int(match[2]) if match else -1, said.strip())

    @property
    def said(self) -> str:
        """For messages."""
        return self.name or f"{self.team} {self.number if self.number >= 0 else self.id}".strip()


def same_players(everybody: Sequence[Who], match: Match | None) -> tuple[dict[Who, tuple[str, str]], list[str]]:
    """Who -> (id, team) in the match, of those who are found, and notes.

    Feeds may call the other team home: the way round in which more are found counts."""
    if match is None:
        return {}, []
    players = [player for player in match.players if player.team != REFEREE]
    straight = {who: found for who in everybody if (found := _found(who, players, who.team))}
    turned = {who: found for who in everybody if (found := _found(who, players, _OTHER.get(who.team, "")))}
    notes = []
    best = straight
    if len(turned) > len(straight):
        best = turned
        notes.append("home and away are the other way round in the events")
    lost = [who.said for who in everybody if who not in best]
    if lost:
        notes.append(f"{len(lost)} of {len(everybody)} players of the events are not tracked: {', '.join(lost[:6])}")
    return {who: (player.id, player.team) for who, player in best.items()}, notes


def _found(who: Who, players: Sequence[MatchPlayer], team: str) -> MatchPlayer | None:
    """The one player who fits: the id alone, else within his team number, then name."""
    by_id = [player for player in players if player.id == who.id and team in ("", player.team)]
    own = [player for player in players if team in ("", player.team)]
    by_number = [player for player in own if who.number >= 0 and player.number == who.number] if team else []
    name = _plain(who.name)
    by_name = [player for player in own if name and _plain(player.name) == name]
    by_last = [player for player in own if name and _plain(player.name).split()[-1:] == name.split()[-1:]]
    return next((found[0] for found in (by_id, by_number, by_name, by_last) if len(found) == 1), None)


def _plain(name: str) -> str:
    """A name in small letters without accents."""
    flat = unicodedata.normalize("NFKD", name)
    return " ".join("".join(letter for letter in flat if not unicodedata.combining(letter)).lower().split())
