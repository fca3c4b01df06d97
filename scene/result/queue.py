"""The queue of requests: one entry a player, first come, first served; not part of the file, so that undo ignores
it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

_waiting: list["Entry"] = []
_busy = [False]  # whether an operator is processing the queue


@dataclass(eq=False)
class Entry:
    """A player's place in the queue.

    Attributes:
        scene: session_uid of the scene.
        player: name.
        how: what to synthesize, in the terms of the operator that processes it.
        order: everything that the work needs.
        fingerprint: of the player's inputs when the request was created; results for other inputs are dropped.
        tries: number of requests so far.
    """

    scene: int
    player: str
    how: Any
    order: Any
    fingerprint: str
    tries: int = field(default=1)


def add(entry: Entry) -> None:
    """Add an entry at the end; it replaces a waiting one of the same player."""
    for number, other in enumerate(_waiting):
        if (other.scene, other.player) == (entry.scene, entry.player):
            _waiting[number] = entry
            return
    _waiting.append(entry)


def take() -> Entry | None:
    """Remove and return the next entry; None if the queue is empty."""
    return _waiting.pop(0) if _waiting else None


def remove(player: str) -> bool:
    """Remove the entry of this player; returns whether there was one."""
    before = len(_waiting)
    _waiting[:] = [entry for entry in _waiting if entry.player != player]
    return len(_waiting) < before


def names() -> list[str]:
    """List the waiting players in their order."""
    return [entry.player for entry in _waiting]


def work(busy: bool) -> None:
    """Mark the queue as being processed, or not."""
    _busy[0] = busy


def worked() -> bool:
    """Return whether the queue is being processed."""
    return _busy[0]


def clear() -> None:
    """Remove all entries."""
    _waiting.clear()
