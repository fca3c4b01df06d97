"""Edits of foot contacts: a contact that is moved, longer, shorter, left out or added."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..base.errors import InputError

FEET = ("left", "right")
KINDS = ("change", "delete", "add")
ADDED_SECONDS = 0.2
"""Seconds of a new contact; its edit's `start` and `end` change them."""


@dataclass(frozen=True)
class ContactEdit:
    """An edit of one contact of a foot with the ground.

    Attributes:
        time: s on the track's clock, within the contact as it is without edits; the middle of one that is added.
        foot: one of FEET.
        kind: one of KINDS.
        start: s by which the contact begins later (negative: earlier).
        end: s by which it ends later (negative: earlier).
        offset: (x, y) m by which it is moved on the ground, world, in the player's size.
    Raises:
        InputError: for an unknown foot or kind, and for NaN or infinite values.
    """

    time: float
    foot: str
    kind: str = "change"
    start: float = 0.0
    end: float = 0.0
    offset: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self):
        where = "contact edit"
        if self.foot not in FEET:
            raise InputError(where, f"foot {self.foot!r}", f"one of {', '.join(FEET)}", "correct the foot")
        if self.kind not in KINDS:
            raise InputError(where, f"kind {self.kind!r}", f"one of {', '.join(KINDS)}", "correct the kind")
        for name in ("time", "start", "end"):
            object.__setattr__(self, name, float(getattr(self, name)))
        object.__setattr__(self, "offset", tuple(float(value) for value in self.offset))
        if len(self.offset) != 2 or not all(map(math.isfinite, (self.time, self.start, self.end, *self.offset))):
            found = f"{self.time:g} s, {self.start:g} s, {self.end:g} s, {self.offset}"
            raise InputError(where, found, "finite times and a finite (x, y) offset", "correct the edit")
