"""Sports: size, lines, ground, goal and ball of each, one entry of `sports.json`, from their rule books.

Sources: The International Football Association Board, Laws of the Game, Law 1; FIFA, Futsal Laws of the Game, Law 1;
International Handball Federation, Rules of the Game, rule 1; FIBA, Official Basketball Rules, article 2; IIHF, Official
Rule Book, section 1; FIH, Rules of Hockey, field and equipment specifications; World Rugby, Laws of the Game, law 1;
NFL, Official Playing Rules, rule 1. Where rules leave a choice (the rugby posts' height, a goal's depth, the ice's
width), a usual value stands.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

FOOTBALL = "football"
"""The sport whose touches of the ball and goalkeepers are known, and whose pitch readers assume."""


@dataclass(frozen=True)
class Goal:
    """A goal, in metres.

    Attributes:
        form: "net" (posts, bar and net), "posts" (two high posts with a bar between) or "hoop" (ring and board).
        width: between the posts, or the ring's diameter.
        height: below the bar, or of the ring.
        post: radius of a post, or of the ring's rod.
        roof: depth of the net at the bar.
        floor: depth of the net on the ground.
        top: height of the posts of the form "posts".
        inset: from the end line inwards to the goal.
        board: width and height of a hoop's board, and its distance from the end line.
        colour: linear RGB of posts and bar.
    """

    form: str
    width: float
    height: float
    post: float
    roof: float = 0.0
    floor: float = 0.0
    top: float = 0.0
    inset: float = 0.0
    board: tuple[float, float, float] = (0.0, 0.0, 0.0)
    colour: tuple[float, float, float] = (0.9, 0.9, 0.9)


@dataclass(frozen=True)
class SportBall:
    """A ball, in metres.

    Attributes:
        radius: of a sphere, across an oval one's length, or of a disc.
        length: of an oval ball; 0: it is round.
        thickness: of a disc; 0: it is none.
        colour: linear RGB; None: white with a football's dark patches.
    """

    radius: float
    length: float = 0.0
    thickness: float = 0.0
    colour: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class Sport:
    """A sport's pitch, goal and ball.

    Attributes:
        name: identifier.
        title: for people.
        size: regular length between the end lines and width, m.
        line: width of a line, m.
        ground: what it is played on, a key of the stage's surfaces.
        goal: the goal.
        ball: the ball.
        marks: kind, numbers and options of each line, see `pitch_markings.build_markings`.
        behind: depth of the area behind each end line that is marked too, m.
        rounding: radius of the corners, m.
        boards: height of the boards around it, m; 0: none.
    """

    name: str
    title: str
    size: tuple[float, float]
    line: float
    ground: str
    goal: Goal
    ball: SportBall
    marks: tuple[tuple, ...] = field(repr=False)
    behind: float = 0.0
    rounding: float = 0.0
    boards: float = 0.0


@cache
def load_sports() -> Mapping[str, Sport]:
    """Load all sports.

    Returns:
        Name -> sport, football first.
    """
    content = json.loads((Path(__file__).parent / "sports.json").read_text("utf-8"))
    return {name: _build_sport(name, entry) for name, entry in content.items()}


def find_assumed_pitch(sport: str) -> tuple[float, float] | None:
    """Find the size of the pitch, m, for tracking data without it; None: what readers assume, a football pitch."""
    return None if sport == FOOTBALL else load_sports()[sport].size


def _build_sport(name: str, entry: dict) -> Sport:
    values = {key: _freeze(value) for key, value in entry.items() if key not in ("goal", "ball")}
    goal, ball = ({key: _freeze(value) for key, value in entry[part].items()} for part in ("goal", "ball"))
    return Sport(name=name, goal=Goal(**goal), ball=SportBall(**ball), **values)


def _freeze(value):
    return tuple(map(_freeze, value)) if isinstance(value, list) else value
