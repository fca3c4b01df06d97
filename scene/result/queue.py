"""What waits to be made: one entry a player, first come, first served; beside the file, so that undo leaves it
alone."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

_waiting: list["Entry"] = []
_busy = [False]  # whether somebody works it off


@dataclass(eq=False)
class Entry:
    """A player's turn. scene: the scene's session_uid. how: what is to be made, in the words of whoever makes it.
    order: all that the work needs. fingerprint: of what the player asked for when the order was written; a result of
    another one is not written. tries: how often it has been ordered."""

    scene: int
    player: str
    how: Any
    order: Any
    fingerprint: str
    tries: int = field(default=1)


def add(entry: Entry) -> None:
    """Let an entry wait at the end; it takes the place of what waited for the same player."""
    for number, other in enumerate(_waiting):
        if (other.scene, other.player) == (entry.scene, entry.player):
            _waiting[number] = entry
            return
    _waiting.append(entry)


def take() -> Entry | None:
    """The next one, which waits no longer."""
    return _waiting.pop(0) if _waiting else None


def remove(player: str) -> bool:
    """Let nothing wait for this player any more; whether anything did."""
    before = len(_waiting)
    _waiting[:] = [entry for entry in _waiting if entry.player != player]
    return len(_waiting) < before


def names() -> list[str]:
    """The players that wait, in their order."""
    return [entry.player for entry in _waiting]


def work(busy: bool) -> None:
    """Somebody begins, or ends, to work the queue off."""
    _busy[0] = busy


def worked() -> bool:
    """Whether somebody works it off."""
    return _busy[0]


def clear() -> None:
    """Nobody waits any more."""
    _waiting.clear()
