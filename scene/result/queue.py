"""The queue of requests: one entry a player, first come, first served; not part of the file, so that undo ignores
it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

_waiting: list["QueueEntry"] = []
_busy = [False]  # whether an operator is processing the queue


@dataclass(eq=False)
class QueueEntry:
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
    mode: Any
    request: Any
    fingerprint: str
    tries: int = field(default=1)


def add_entry(entry: QueueEntry) -> None:
    """Add an entry at the end; it replaces a waiting one of the same player."""
    for number, other in enumerate(_waiting):
        if (other.scene, other.player) == (entry.scene, entry.player):
            _waiting[number] = entry
            return
    _waiting.append(entry)


def pop_entry() -> QueueEntry | None:
    """Remove and return the next entry; None if the queue is empty."""
    return _waiting.pop(0) if _waiting else None


def remove_player(player: str) -> bool:
    """Remove the entry of this player; returns whether there was one."""
    before = len(_waiting)
    _waiting[:] = [entry for entry in _waiting if entry.player != player]
    return len(_waiting) < before


def list_players() -> list[str]:
    """List the waiting players in their order."""
    return [entry.player for entry in _waiting]


def set_busy(busy: bool) -> None:
    """Mark the queue as being processed, or not."""
    _busy[0] = busy


def is_busy() -> bool:
    """Return whether the queue is being processed."""
    return _busy[0]


def clear_queue() -> None:
    """Remove all entries."""
    _waiting.clear()
