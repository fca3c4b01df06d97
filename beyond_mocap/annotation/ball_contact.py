"""What labels say about ball contact: the body part, both hands, in flight; and the surfaces that may meet the ball."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..motion.skeleton import Skeleton
from .labels import find_label, list_labels, read_labels
from .striking import Surface, build_part_surfaces, measure_smallest_gap
from .timeline import KeyMoment
from .vocabulary import SIDES

_BY_PART = {part: frozenset(list_labels(part=part)) for part in ("head", "chest", "hand", "thigh", "foot")}
"""Part -> its labels. The first part that has one of a motion's labels counts."""

_BOTH_HANDS = frozenset(list_labels(both_hands=True))
_IN_FLIGHT = frozenset(list_labels(in_flight=True))
_FROM_HANDS = frozenset(list_labels(from_hands=True))
_FOOT_ON_BALL = tuple(
    {label.name, other} if other else {label.name}
    for label in read_labels().values() if label.is_root and label.part == "foot"
    for other in label.part_with or ("",)
)  # fmt: skip
_FOOT_OR_OTHER = frozenset(label.name for label in read_labels().values() if "foot" in label.parts and not label.part)
_FOOT_TAKES = frozenset(list_labels(ball="takes", part="foot", is_root=True))
TAKING, SENDING, CARRYING = (frozenset(list_labels(ball=what)) for what in ("takes", "sends", "carries"))
"""The labels of motions that take, send and carry the ball."""

_STATED = frozenset({"foot", *list_labels(group="height"), *list_labels(group="surface")})
_PART_BY_HEIGHT = (
    (0.45, ("foot", "low")), (0.75, ("foot", "high")), (1.05, ("thigh",)), (1.55, ("body",)), (np.inf, ("head",)),
)  # fmt: skip
"""Below which height in m of the ball which part takes it: the knee of an adult is at 0.5 m, the hip at 0.95 m, the
middle of the chest at 1.3 m, the forehead at 1.65 m."""
_FLIGHT_SECONDS = 0.6  # from take-off to ball contact at most, in dives by hand


def find_striking_part(labels: Iterable[str]) -> str | None:
    """Find the body part that meets the ball.

    A receive is taken with the foot unless a label says body or chest (Faustino, Appendix A: receive foot | body).

    Args:
        labels: the labels of a motion.
    Returns:
        "foot", "thigh", "head", "chest" or "hand"; None for labels without ball contact.
    """
    labels = set(labels)
    return next((part for part, part_labels in _BY_PART.items() if part_labels & labels), None)


def choose_contact_labels(played: Iterable[str], requested: Iterable[str]) -> tuple[str, ...]:
    """Choose the labels that define the body part at a key moment.

    Args:
        played: the labels of the clip.
        requested: the labels of the key moment.
    Returns:
        The clip's labels if they name a part, otherwise the requested ones. A dribble that plays where a touch is
        requested does not name that touch's part.
    """
    played, requested = tuple(played), tuple(requested)
    only_carries = bool(CARRYING.intersection(played)) and not (TAKING | SENDING).intersection(played)
    is_other = only_carries and not CARRYING.intersection(requested) and find_striking_part(requested) is not None
    return played if find_striking_part(played) and not is_other else requested


def list_contact_labels(played: Iterable[str], requested: KeyMoment) -> tuple[str, ...]:
    """List the labels that define the body part at a key moment; none if it misses the ball by design.

    Args:
        played: the labels of the clip.
        requested: the key moment.
    """
    return () if requested.misses_ball else choose_contact_labels(played, requested.words)


def find_contact_window(labels: Iterable[str]) -> float:
    """Find how long after a key moment the ball may be met.

    Only dives by hand have such a window: their key moment is the ball contact or, in recordings without a ball, the
    body's take-off.

    Args:
        labels: the labels of a motion.
    Returns:
        Seconds, 0 for all other labels.
    """
    labels = set(labels)
    return _FLIGHT_SECONDS if _IN_FLIGHT & labels and find_striking_part(labels) == "hand" else 0.0


def uses_both_hands(labels: Iterable[str]) -> bool:
    """Return whether the labels mean a ball between both hands, where both come near enough.

    Args:
        labels: the labels of a motion.
    """
    return bool(_BOTH_HANDS & set(labels))


def comes_from_hands(labels: Iterable[str]) -> bool:
    """Return whether the labels send a ball that the hands have held until then: a throw or a punt, not a punch.

    Args:
        labels: the labels of a motion.
    """
    return bool(_FROM_HANDS & set(labels))


def shows_foot_on_ball(labels: frozenset[str]) -> bool:
    """Return whether a foot certainly meets the ball in a motion with these labels.

    Args:
        labels: the labels of a motion.
    """
    return any(part <= labels for part in _FOOT_ON_BALL)


def may_use_foot(labels: frozenset[str]) -> bool:
    """Return whether a foot may meet the ball, possibly besides other parts, in a motion with these labels.

    Args:
        labels: the labels of a motion.
    """
    return shows_foot_on_ball(labels) or bool(_FOOT_OR_OTHER & labels)


def may_use_several_parts(labels: Iterable[str], part: str) -> bool:
    """Return whether a label names an action that meets the ball with several parts, including `part`.

    Args:
        labels: the labels of a motion.
        part: a part of `BODY_PARTS` or "tool".
    """
    known = (find_label(word) for word in labels)
    return any(part in label.parts and not label.part for label in known)


def takes_with_foot(labels: Iterable[str]) -> bool:
    """Return whether a label names an action in which a foot takes the ball, unless another label names another part.

    Args:
        labels: the labels of a motion.
    """
    return bool(_FOOT_TAKES.intersection(labels))


def choose_part_by_height(labels: Iterable[str], height: float | None) -> tuple[str, ...]:
    """Choose the part that takes a ball at a height, where the labels leave that open: a plain "receive".

    Args:
        labels: the labels of a motion.
        height: m of the ball's centre above the ground, None where it is unknown.
    Returns:
        The labels, with those of the part and height added.
    """
    labels = tuple(labels)
    is_open = takes_with_foot(labels) and find_striking_part(labels) == "foot" and not _STATED & set(labels)
    if not is_open or height is None or shows_foot_on_ball(frozenset(labels)):
        return labels
    return (*labels, *next(part for most, part in _PART_BY_HEIGHT if height < most))


def takes_and_sends(a: frozenset[str], b: frozenset[str]) -> bool:
    """Return whether one of two motions only takes the ball and the other one only sends it.

    A foot that stops a ball gives with it, one that sends it swings through, so neither can stand for the other. A
    dribble carries the ball and does both.

    Args:
        a: the labels of one motion.
        b: the labels of the other.
    """
    (a_takes, a_sends), (b_takes, b_sends) = ((bool(TAKING & labels), bool(SENDING & labels)) for labels in (a, b))
    return a_takes != a_sends and a_takes == b_sends and a_sends == b_takes


def build_surfaces(skeleton: Skeleton, labels: Iterable[str]) -> tuple[Surface, ...]:
    """Build the surfaces that may meet the ball in a motion with these labels.

    There is one surface per limb, on the side that a label names or on both. The side of a dive is its direction, so
    either hand counts.

    Args:
        skeleton: the skeleton, J joints.
        labels: the labels of a motion.
    Returns:
        The surfaces; none for labels without ball contact, or for a part that the skeleton lacks.
    """
    labels = set(labels)
    part = find_striking_part(labels)
    side_labels = set() if part == "hand" and _IN_FLIGHT & labels else labels
    return build_part_surfaces(skeleton, part, [side for side in SIDES if side in side_labels] or SIDES) if part else ()


def measure_contact_gap(
    skeleton: Skeleton, positions: np.ndarray, rotations: np.ndarray, labels: Iterable[str], ball: np.ndarray
) -> np.ndarray:
    """Measure the smallest gap between the ball and the surfaces that may meet it.

    Args:
        skeleton: the skeleton, J joints.
        positions: (..., J, 3) m, world frame.
        rotations: (..., J, 4) quaternions, world frame.
        labels: the labels of the motion.
        ball: (..., 3) m, the ball's centre, world frame.
    Returns:
        (...,) m, negative where surfaces overlap, NaN without a surface.
    """
    return measure_smallest_gap(build_surfaces(skeleton, labels), positions, rotations, ball)
