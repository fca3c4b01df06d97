"""What kind of action labels name, and its colour in timelines: one table for strips, key moments and the legend.

The colours are those of the 3D view's overlays: a strike is green there and here, the ball's way orange.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

from ..overlays import colours

if TYPE_CHECKING:
    from ...beyond_mocap.annotation.labels import Label

KEEPER = frozenset(("catchb", "stomp", "punch", "throwout", "rollout", "punt", "goal_kick", "ready", "shuffle", "dive",
                    "save"))
SIDES = {"left": "L", "right": "R"}
PARTS = {"foot": "F", "head": "H", "chest": "C", "thigh": "T", "hand": "A", "hands": "A", "tool": "O"}
PART_TITLES = {"foot": "Foot", "head": "Head", "chest": "Chest", "thigh": "Thigh", "hand": "Hand",
               "hands": "Both Hands", "tool": "Racquet or Bat"}

FAST, DARKEST = 5.5, 0.5  # m/s of a sprint; share of black in the colour of who stands

Colour = tuple[float, float, float]


class LabelGroup(NamedTuple):
    """A kind of action.

    Attributes:
        title: in the legend.
        colour: red, green, blue.
    """

    title: str
    colour: Colour


GOALKEEPING = LabelGroup("Goalkeeping", colours.VERMILION)
HEADER = LabelGroup("Header", colours.PURPLE)
RECEIVE = LabelGroup("Receive", colours.YELLOW)
KICK = LabelGroup("Kick", colours.STRIKE)
HANDS = LabelGroup("Throw & Catch", (0.94, 0.72, 0.60))
DRIBBLE = LabelGroup("Dribble", colours.SKY)
GESTURE = LabelGroup("Gesture", colours.BALL)
RUN = LabelGroup("Walk & Run", colours.BLUE)
OTHER = LabelGroup("Duel, Fall, Other", (0.8, 0.8, 0.8))  # the grey of overlays is a header's purple to some eyes
AUTOMATIC = LabelGroup("Automatic", (0.42, 0.42, 0.42))
GROUPS = (RUN, DRIBBLE, KICK, RECEIVE, HEADER, HANDS, GOALKEEPING, GESTURE, OTHER, AUTOMATIC)
"""In the order of the legend."""

_RULES: tuple[tuple[LabelGroup, Callable[["Label"], bool]], ...] = (
    (GOALKEEPING, lambda label: label.name in KEEPER),
    (RECEIVE, lambda label: label.ball == "takes" and "foot" in label.parts),
    (HEADER, lambda label: "head" in label.parts and len(label.parts) == 1),
    (HANDS, lambda label: label.from_hands or label.both_hands or "hand" in label.parts or label.ball == "holds"),
    (KICK, lambda label: label.ball == "sends"),
    (DRIBBLE, lambda label: label.ball == "carries"),
    (OTHER, lambda label: label.ball == "never" and "discrete" in label.kinds),
    (GESTURE, lambda label: label.ball == "never"),
    (RUN, lambda label: label.gait is not None or _is_turning(label)),
)  # fmt: skip


@lru_cache(maxsize=4096)
def find_group(words: tuple[str, ...]) -> LabelGroup:
    """Find the kind of action that labels name.

    Args:
        words: labels of a span or key moment; those to be avoided ("-jump") do not count.
    Returns:
        The group: by the first of the rules that a root label fulfils, else that any label fulfils.
    """
    from ...beyond_mocap.annotation.labels import read_labels

    known = [read_labels()[word] for word in words if word in read_labels()]
    for labels in ([label for label in known if label.is_root], known):
        for group, fulfils in _RULES:
            if any(fulfils(label) for label in labels):
                return group
    return OTHER if words else AUTOMATIC


@lru_cache(maxsize=4096)
def find_group_of_name(name: str) -> LabelGroup:
    """Find the kind of action that the name of a strip or marker names."""
    return find_group(split_labels(name))


def _is_turning(label: "Label") -> bool:
    from ...beyond_mocap.annotation.gaits import TURNING

    return label.name == TURNING


@lru_cache(maxsize=4096)
def find_colour(name: str) -> Colour:
    """Find the colour of a strip or key moment by its name: its group's; on foot, the darker the slower."""
    from ...beyond_mocap.annotation.labels import read_labels

    words, group = split_labels(name), find_group_of_name(name)
    gaits = [label.gait for word in words if (label := read_labels().get(word)) and label.gait is not None]
    slow = 1.0 - min(min(gaits, default=0.0) / FAST, 1.0)
    return mix(group.colour, colours.BLACK, DARKEST * slow) if group is RUN else group.colour


@lru_cache(maxsize=4096)
def find_part_letter(words: tuple[str, ...]) -> str:
    """Find the letter of a key moment's diamond: L or R for a side, else the part that meets the ball, else "".

    Args:
        words: labels.
    Returns:
        One letter, or "".
    """
    side = next((SIDES[word] for word in words if word in SIDES), "")
    return side or PARTS.get(_find_part(words), "")


def describe_contact(words: Iterable[str]) -> str:
    """Describe side, part and height of the ball: "Right Foot, Low"; "" where labels say nothing of them."""
    from ...beyond_mocap.annotation.labels import read_labels

    words, table = tuple(words), read_labels()
    part, side = _find_part(words), next((word.title() for word in words if word in SIDES), "")
    height = next((word.title() for word in words if word in table and table[word].group == "height"), "")
    return ", ".join(text for text in (" ".join(filter(None, (side, PART_TITLES.get(part, "")))), height) if text)


@lru_cache(maxsize=4096)
def split_labels(name: str) -> tuple[str, ...]:
    """Split the name of a strip or marker into its labels, without those to be avoided."""
    return tuple(word for word in name.lower().split() if word[0] not in "-(")


@lru_cache(maxsize=1024)
def mix(a: Colour, b: Colour, share: float) -> Colour:
    """Mix two colours; share: of the second."""
    return tuple((1.0 - share) * x + share * y for x, y in zip(a, b))


@lru_cache(maxsize=256)
def choose_ink(paper: Colour) -> Colour:
    """Choose black or white letters for a background, whichever has more contrast (WCAG 2.1, relative luminance)."""
    red, green, blue = (x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4 for x in paper)
    luminance = 0.2126 * red + 0.7152 * green + 0.0722 * blue
    return colours.BLACK if (luminance + 0.05) ** 2 > 0.05 * 1.05 else colours.WHITE


def elide(text: str, width: float, measure: Callable[[str], float]) -> str:
    """Shorten a text to a width, by an ellipsis at its end.

    Args:
        text: the text.
        width: pixels that it may take.
        measure: from a text to its pixels.
    Returns:
        The text, its beginning with an ellipsis, or "" where not even three letters fit.
    """
    if width < measure("…") or measure(text) <= width:
        return text if width >= measure("…") else ""
    low, high = 0, len(text) - 1
    while low < high:
        middle = (low + high + 1) // 2
        low, high = (middle, high) if measure(text[:middle].rstrip() + "…") <= width else (low, middle - 1)
    return text[:low].rstrip() + "…" if low >= 3 else ""


def _find_part(words: tuple[str, ...]) -> str:
    """Find the part that meets the ball: of the most special label that names one."""
    from ...beyond_mocap.annotation.labels import Label, read_labels

    known = [read_labels()[word] for word in words if word in read_labels()]
    label = next((label for label in reversed(known) if label.part), Label(name=""))
    return "hands" if label.both_hands else label.part
