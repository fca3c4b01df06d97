"""Reconstructions that live as long as Blender runs, under names that a cloud keeps: at the recording's own rate, which
an action has not."""

from __future__ import annotations

import itertools
import uuid
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ...beyond_mocap.markers.reconstruct import Reconstruction

MOST = 30

_numbers = itertools.count(1)
_session = uuid.uuid4().hex[:8]  # part of every name, so that none of another session is taken for one of this
_made: dict[str, "Reconstruction"] = {}


def keep(made: "Reconstruction") -> str:
    """Keep it; returns its name."""
    name = f"markers-{_session}-{next(_numbers)}"
    _made[name] = made
    while len(_made) > MOST:
        _made.pop(next(iter(_made)))
    return name


def made(name: str) -> "Reconstruction | None":
    """The one of that name; None where this session has not made it."""
    return _made.get(name)


def clear() -> None:
    """Forget everything."""
    _made.clear()
