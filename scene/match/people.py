"""Who is to be seen in a stretch of a match, as plain values and arrays: what a thread makes and the scene shows."""

from __future__ import annotations

from dataclasses import dataclass

from ...beyond_mocap.motion.motion import Motion
from ...beyond_mocap.motion.track.ball_path import BallPath

TEAMS = ("home", "away", "referee")


@dataclass(frozen=True, eq=False)
class Person:
    """A player or referee. id: as the feed has it. number: of the shirt, -1 where there is none. team: one of TEAMS.
    motions: (s on the match's clock, motion) for every stretch in which he is there, in order."""

    id: str
    name: str
    number: int
    team: str
    keeper: bool
    motions: tuple[tuple[float, Motion], ...]


@dataclass(frozen=True, eq=False)
class Scenery:
    """A stretch of a match: start and end, s on its clock; length and width of the pitch, m; colours: team -> "#RRGGBB"
    of the shirts; who is there; the ball, where it is known."""

    start: float
    end: float
    length: float
    width: float
    colours: dict[str, str]
    people: tuple[Person, ...]
    ball: BallPath | None
