"""What the readers of this folder make of a match's files: people, and samples of them and of the ball on one clock."""

from __future__ import annotations

import io
import json
import math
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ....base.content import open_file
from ....base.errors import InputError, format_count
from ....motion.track.match_data import REFEREE
from ..feed import MAX_PLAYERS
from ..match_arrays import check_clock, check_size, lay_periods

_MOST_SAMPLES = 20_000_000
_FARTHEST = 1e4  # metres; anything beyond is no place
_KEEPER = "goalkeeper"
_LONGEST_GAP = 1.0  # seconds between two samples that are joined by a line


@dataclass(frozen=True, kw_only=True)
class MatchSamples:
    """A match as a reader found it.

    Attributes:
        times: (N,) seconds on one clock for all periods.
        periods: start and end on that clock, number, and seconds that had passed at the first sample.
        people: id, team, name, number ("-1" unknown) and position of each of P.
        positions: (P, N, 2) metres from the pitch's centre, NaN where absent.
        ball: (N, 3), NaN where unknown.
        fps: samples per second.
        size: length and width of the pitch in metres; None where the feed does not say.
        teams: ground, name and colour of home and away.
        lines: what was left out or assumed.
        angles: (P, N) of bodies, rad or degrees as the feed measures them, NaN where not known; None for a feed
            without.
    """

    times: np.ndarray
    periods: list[tuple[float, float, int, float]]
    people: list[tuple[str, str, str, str, str]]
    positions: np.ndarray
    ball: np.ndarray
    fps: float
    size: tuple[float, float] | None
    teams: list[tuple[str, str, str]]
    lines: list[str] = field(default_factory=list)
    angles: np.ndarray | None = None


class SampleCollector:
    """Collects samples in any order.

    Attributes:
        people: key -> id, team, name, number and position.
        lines: what was left out or assumed.
    """

    def __init__(self, path: Path):
        """Collect the samples of a file, whose path errors name."""
        self.people: dict[str, tuple[str, str, str, str, str]] = {}
        self.lines: list[str] = []
        self._path = path
        self._moments: dict[tuple[int, float], int] = {}
        self._who: dict[str, int] = {}
        self._samples, self._ball, self._angles = array("d"), array("d"), array("d")

    def add_person(self, key: str, team: str, name: str = "", number: object = None, position: str = "") -> None:
        """Add a person who may have samples; team is "home", "away", or anything else for a referee."""
        ground = team if team in ("home", "away") else REFEREE
        if isinstance(number, str) and number.isdigit() and len(number) < 4:
            number = int(number)
        shirt = int(number) if isinstance(number, (int, float)) and math.isfinite(number) else -1
        self.people.setdefault(key, (key, ground, name or key, str(shirt),
                                     _KEEPER if "keeper" in position.lower() else position))

    def add_sample(self, moment: tuple[int, float], key: str, x: object, y: object) -> None:
        """Add where a person is, metres, at a period's number and its seconds."""
        place = _to_place(x, y)
        if place is not None:
            self._samples.extend((self._find_moment(moment), self._who.setdefault(key, len(self._who)), *place))
            if len(self._samples) > 4 * _MOST_SAMPLES:
                raise InputError(self._path, f"more than {_MOST_SAMPLES:,} samples", "one match", "divide the file")

    def add_angle(self, moment: tuple[int, float], key: str, angle: float | None) -> None:
        """Add where the body of a person with a sample at this moment faces, as the feed has it; None: not known."""
        if angle is not None and key in self._who and moment in self._moments:
            self._angles.extend((self._moments[moment], self._who[key], angle))

    def add_track(self, period: int, key: str, times: np.ndarray, places: np.ndarray, step: float) -> None:
        """Add where a person is at the multiples of `step` s, by lines between own samples, none within a gap.

        Args:
            period: number.
            key: whose.
            times: (N,) s, increasing.
            places: (N, 2) metres.
            step: s.
        Raises:
            InputError: for times of more than a day.
        """
        check_clock(self._path, times)
        first, last = int(np.ceil(times[0] / step - 1e-6)), int(np.floor(times[-1] / step + 1e-6))
        moments = np.arange(first, last + 1)
        at = np.clip(moments * step, times[0], times[-1])
        after = np.clip(np.searchsorted(times, at), 1, len(times) - 1)
        joined = times[after] - times[after - 1] <= max(_LONGEST_GAP, 2.0 * step)
        x, y = (np.interp(at, times, column) for column in places.T)
        for number, is_joined, one, other in zip(moments.tolist(), joined.tolist(), x.tolist(), y.tolist()):
            if is_joined:
                self.add_sample((period, round(number * step, 4)), key, one, other)

    def add_ball(self, moment: tuple[int, float], x: object, y: object, z: object = None) -> None:
        """Add where the ball is, metres."""
        place = _to_place(x, y)
        if place is not None:
            height = z if isinstance(z, (int, float)) and abs(z) < _FARTHEST else math.nan
            self._ball.extend((self._find_moment(moment), *place, height))

    def build(self, size: tuple[float, float] | None = None, team_names: tuple[str, str] = ("", ""),
              fps: float | None = None) -> MatchSamples:
        """Build the match of all samples.

        Args:
            size: length and width of the pitch, metres; None: not known.
            team_names: of home and away.
            fps: samples per second; None: from the samples.
        Returns:
            The match.
        Raises:
            InputError: for fewer than two moments or too many people.
        """
        if len(self._moments) < 2 or not self._who:
            found = f"{format_count(len(self._moments), 'frame')}, {format_count(len(self._who), 'player')} in them"
            raise InputError(self._path, found, "players in at least two frames", "export it again")
        if len(self._who) > MAX_PLAYERS:
            raise InputError(self._path, f"{len(self._who)} players", f"at most {MAX_PLAYERS} in one match",
                             "reduce the file to one match")
        order = sorted(self._moments)
        row = {self._moments[moment]: number for number, moment in enumerate(order)}
        rows = np.array([row[number] for number in range(len(row))])
        positions = np.full((len(self._who), len(order), 2), np.nan)
        samples = np.frombuffer(self._samples).reshape(-1, 4)
        positions[samples[:, 1].astype(int), rows[samples[:, 0].astype(int)]] = samples[:, 2:]
        angles = None
        if self._angles:
            turned, angles = np.frombuffer(self._angles).reshape(-1, 3), np.full(positions.shape[:2], np.nan)
            angles[turned[:, 1].astype(int), rows[turned[:, 0].astype(int)]] = turned[:, 2]
        ball = np.full((len(order), 3), np.nan)
        found = np.frombuffer(self._ball).reshape(-1, 4) if self._ball else np.zeros((0, 4))
        ball[rows[found[:, 0].astype(int)]] = found[:, 1:]
        times, periods = lay_periods(*(np.array(column) for column in zip(*order)))
        check_clock(self._path, times)
        if size is not None:
            check_size(self._path, size)
        people = [self.people.get(key, (key, REFEREE, key, "-1", "")) for key in self._who]
        unknown = [key for key in self._who if key not in self.people]
        lines = [f"{format_count(len(unknown), 'person')} without a team, {unknown[0]}: taken for "
                 "referees"] if unknown else []
        step = float(np.median(np.diff(times)))
        return MatchSamples(times=times, periods=periods, people=people, positions=positions, ball=ball,
                            fps=fps or round(1.0 / step, 3), size=size,
                            teams=[(ground, name, "") for ground, name in zip(("home", "away"), team_names)],
                            lines=[*self.lines, *lines], angles=angles)

    def _find_moment(self, moment: tuple[int, float]) -> int:
        return self._moments.setdefault(moment, len(self._moments))


def _to_place(x: object, y: object) -> tuple[float, float] | None:
    """Return coordinates; None for what is missing or absurd."""
    if isinstance(x, (int, float)) and isinstance(y, (int, float)) and abs(x) < _FARTHEST and abs(y) < _FARTHEST:
        return float(x), float(y)
    return None


def iter_json_lines(path: Path) -> Iterator[tuple[int, dict]]:
    """Iterate over the objects of a file with one JSON object a line, with their line numbers.

    Raises:
        InputError: for a line that is none.
    """
    try:
        with io.TextIOWrapper(open_file(path, "a tracking file"), encoding="utf-8-sig") as file:
            for number, line in enumerate(file, 1):
                if line.strip():
                    yield number, _parse_line(path, number, line)
    except UnicodeDecodeError:
        raise InputError(path, "is not UTF-8 text", "JSON, one object a line", "save it as UTF-8") from None


def _parse_line(path: Path, number: int, line: str) -> dict:
    try:
        value = json.loads(line)
    except (ValueError, RecursionError):
        raise InputError(f"{path}:{number}", "not a JSON object", "one object a line", "export it again") from None
    if not isinstance(value, dict):
        raise InputError(f"{path}:{number}", "not a JSON object", "one object a line", "export it again")
    return value
