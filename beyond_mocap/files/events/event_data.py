"""What a provider's people wrote down of a match: passes, shots, saves, in one form for all of them."""

from __future__ import annotations

from dataclasses import dataclass

from ...annotation.event_words import EVENT_KINDS

NOT_PLAYED = frozenset(kind.name for kind in EVENT_KINDS if kind.touch == "none")
"""Kinds that are no touch of the ball."""

CERTAIN = frozenset(kind.name for kind in EVENT_KINDS if kind.touch == "certain")
"""Kinds that are a touch for certain."""


@dataclass(frozen=True)
class MatchEvent:
    """Somebody did something.

    time: s from the begin of its period, on the events' own clock. period: 1 for the first. player: the tracking's id,
    "" where he is not known. team: "home", "away" or "". kind: of `annotation.event_words.KINDS`. part: "foot",
    "head", "chest", "hand" or "". side: "left", "right" or "". details: further words ("throw-in", "lost"). said: how
    the provider calls it. success: None where it does not say. place: (x, y) m on the tracking's pitch, NaN where
    unknown.
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
