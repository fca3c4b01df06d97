"""What labels say of a ball that is met: by which part, by both hands, in flight; and the surfaces that may meet it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..motion.skeleton import Skeleton
from .labels import find_label, list_labels, read_labels
from .striking import Surface, part_surfaces, smallest_gap
from .vocabulary import SIDES

_BY_PART = {part: frozenset(list_labels(part=part)) for part in ("head", "chest", "hand", "foot")}
"""Part -> its labels; of a motion's labels the first part with one of them counts."""

_BOTH_HANDS = frozenset(list_labels(both_hands=True))
_IN_FLIGHT = frozenset(list_labels(in_flight=True))
_FOOT_ON_BALL = tuple(
    {label.name, other} if other else {label.name}
    for label in read_labels().values() if label.is_root and label.part == "foot"
    for other in label.part_with or ("",)
)  # fmt: skip
_FOOT_OR_OTHER = frozenset(label.name for label in read_labels().values() if "foot" in label.parts and not label.part)
_FOOT_TAKES = frozenset(list_labels(ball="takes", part="foot", is_root=True))
_FLIGHT_SECONDS = 0.6


def striking_part(words: Iterable[str]) -> str | None:
    """Which part meets the ball: "foot", "head", "chest" or "hand"; None for words that touch no ball.

    A receive is taken with the foot unless it says body or chest (Faustino App. A: receive foot | body)."""
    words = set(words)
    return next((part for part, named in _BY_PART.items() if named & words), None)


def meeting_words(played: Iterable[str], asked: Iterable[str]) -> tuple[str, ...]:
    """The words that say which part meets the ball at a key moment: those that are played, else those asked for."""
    played = tuple(played)
    return played if striking_part(played) else tuple(asked)


def met_within(words: Iterable[str]) -> float:
    """Seconds after a key moment in which the ball may be met: 0, but for dives by hand, whose key is where the ball is
    met or, in recordings without a ball, where the body takes off."""
    words = set(words)
    return _FLIGHT_SECONDS if _IN_FLIGHT & words and striking_part(words) == "hand" else 0.0


def by_both_hands(words: Iterable[str]) -> bool:
    """Whether the words ask for a ball between both hands, where both come near enough."""
    return bool(_BOTH_HANDS & set(words))


def shows_foot_on_ball(words: frozenset[str]) -> bool:
    """Whether a foot meets the ball for certain in what has these words."""
    return any(part <= words for part in _FOOT_ON_BALL)


def may_use_foot(words: frozenset[str]) -> bool:
    """Whether a foot meets the ball in what has these words, be it with other parts in turn."""
    return shows_foot_on_ball(words) or bool(_FOOT_OR_OTHER & words)


def may_use_several(words: Iterable[str], part: str) -> bool:
    """Whether the words name something that meets the ball with several parts, `part` among them."""
    labels = (find_label(word) for word in words)
    return any(part in label.parts and not label.part for label in labels)


def takes_with_foot(words: Iterable[str]) -> bool:
    """Whether the words name an action in which a foot takes the ball, unless a word beside says another part does."""
    return bool(_FOOT_TAKES.intersection(words))


def surfaces(skeleton: Skeleton, words: Iterable[str]) -> tuple[Surface, ...]:
    """The surfaces that may meet the ball by these words: one per limb, of the side that is named or of both (a dive's
    side is where it goes: either hand serves); none for words that touch no ball or a part that the skeleton lacks."""
    words = set(words)
    part = striking_part(words)
    named = set() if part == "hand" and _IN_FLIGHT & words else words
    return part_surfaces(skeleton, part, [side for side in SIDES if side in named] or SIDES) if part else ()


def contact_gap(
    skeleton: Skeleton, positions: np.ndarray, rotations: np.ndarray, words: Iterable[str], ball: np.ndarray
) -> np.ndarray:
    """The smallest gap (...,) m of the surfaces that may meet the ball by these words, NaN without any; see
    `annotation.striking.smallest_gap`, which says what the arrays are."""
    return smallest_gap(surfaces(skeleton, words), positions, rotations, ball)
