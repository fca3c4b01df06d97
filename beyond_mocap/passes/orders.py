"""What a passing scene asks of one body: where it stands, and when, where and how it strikes the ball."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..ball.contact import Tool

if TYPE_CHECKING:
    from .hits import HitMotion


@dataclass(frozen=True)
class Stance:
    """Where a player stands and which way he faces: place (2,) m on the ground of his root, facing rad from +x."""

    place: tuple[float, ...]
    facing: float


@dataclass(frozen=True, eq=False)
class HitOrder:
    """One strike.

    time: s. clip: index into the library's clips; hit: the hit motion, frames in the clip's own rate; strike_frame: the
    one that strikes, in that rate. place (2,) m and facing rad: of the root on the ground and of the heading at the
    strike. ball (3,) m: the ball's centre then; normal (3,): unit, the way from the part to the ball. part, side: of
    `contact.PARTS` or a joint's name. tool: what is in the hand. kind: toss, pass, attack or receive. touches: whether
    he meets the ball; who misses it plays on as recorded.
    """

    time: float
    clip: int
    hit: HitMotion
    strike_frame: float
    place: tuple[float, ...]
    facing: float
    ball: tuple[float, ...]
    normal: tuple[float, ...]
    part: str
    side: str
    tool: Tool | None = None
    kind: str = "pass"
    touches: bool = True
