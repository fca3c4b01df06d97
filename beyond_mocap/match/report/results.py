"""What a folder with a match holds of its players, read from match.json and the players' reports, whole or not; and
which seconds came out worst, of all players."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...base.errors import InputError
from ...evaluation.report import check_depth

MADE = "done"
FIGURES = ("root_error_m", "skate_cm_s", "overlap_m", "ball_m")
"""Keys of a report's `per_second`, beside its `start_s`."""
LONGEST = 6 * 3600
"""Most seconds of one match that a page shows."""
_LATEST = 1e11  # seconds: some clocks count from 1970
LIMITS = {"root_error_m": 0.015, "skate_cm_s": 7.0, "overlap_m": 0.02}
"""Figure -> what it is to stay below in a second: 1.5 cm off the track, two bodies 2 cm into each other; 7 cm/s is a
standing foot that goes 21 mm, which eyes notice, within a step of 0.3 s."""
MOST = 10
APART = 3
"""Seconds within which a player's bad seconds are one."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PlayerResult:
    """One player. id: in the feed. team: name of his team. status: "done", or how far he came; reason: why he came no
    further, "" where that is not told. data: lines on what was read of him. report: his report, {} where there is none.
    start: seconds on the match clock of the first row of per_second, which has one array (S,) for each of FIGURES, NaN
    where nothing is known, empty where the report tells nothing by the second."""

    id: str
    name: str
    number: str
    team: str
    status: str
    reason: str
    data: tuple[str, ...]
    report: Mapping
    start: float = 0.0
    per_second: Mapping[str, np.ndarray] = field(default_factory=dict)

    @property
    def made(self) -> bool:
        """Whether there is a report of a finished motion."""
        return self.status == MADE and bool(self.report)

    @property
    def called(self) -> str:
        """Number and name, as the page says it; where the name has the number in it, the name alone."""
        name = self.name or self.id
        return name if not self.number or self.number in re.findall(r"\d+", name) else f"{self.number} {name}"


@dataclass(frozen=True)
class TeamResult:
    """A team by name, its colour as "#rrggbb", "" where the feed has none."""

    name: str
    colour: str = ""


@dataclass(frozen=True, eq=False, kw_only=True)
class MatchResults:
    """A match. title; status: of the whole. fps: of the motions, NaN where not told. start, end: seconds on the match
    clock, NaN where not told. seconds: what the making took, by stage. lines: what was told of the data."""

    title: str
    status: str
    fps: float
    start: float
    end: float
    teams: tuple[TeamResult, ...]
    players: tuple[PlayerResult, ...]
    seconds: Mapping[str, float]
    lines: tuple[str, ...]


def read_match_results(folder: Path) -> MatchResults:
    """The results in a folder. InputError where its match.json is missing or is not of the form in
    docs/match/match-report.md; a player whose report is missing or broken is kept, with the reason."""
    path = Path(folder) / "match.json"
    told = _object(path)
    rows = told.get("players", ())
    if not isinstance(rows, list) or not all(isinstance(row, Mapping) and _text(row.get("id")) for row in rows):
        expected = "a list of objects with an id"
        raise InputError(path, "its players are not told one by one", expected, "make the match again")
    teams = _teams(told.get("teams"))
    players = tuple(_player(Path(folder), row, teams) for row in rows)
    known = {team.name for team in teams.values()}
    others = dict.fromkeys(player.team for player in players if player.team not in known)
    sides = [team.name for team in teams.values()][:2]
    seconds = told.get("seconds") if isinstance(told.get("seconds"), Mapping) else {}
    stages = {str(stage): number(spent) for stage, spent in seconds.items()}
    return MatchResults(
        title=_text(told.get("title")) or (" - ".join(sides) if len(sides) == 2 else Path(folder).resolve().name),
        status=_text(told.get("status")), fps=number(told.get("fps")), start=_time(told.get("from_s")),
        end=_time(told.get("to_s")), teams=(*teams.values(), *map(TeamResult, others)), players=players, seconds=stages,
        lines=_lines(told),
    )  # fmt: skip


def _teams(told) -> dict[str, TeamResult]:
    """The teams by their ground, else by name; two of one name are told apart by it."""
    rows = [row for row in told if isinstance(row, Mapping)] if isinstance(told, list) else []
    names = [_text(row.get("name")) for row in rows]
    out = {}
    for row, name in zip(rows, names):
        ground = _text(row.get("ground")) or name
        label = f"{name} ({ground})" if names.count(name) > 1 and name else name or ground
        out[ground] = TeamResult(label, _colour(row.get("colour")))
    return out


def _player(folder: Path, row: Mapping, teams: Mapping[str, TeamResult]) -> PlayerResult:
    name, (status, _, reason) = str(row["id"]), _text(row.get("status")).partition(":")
    report: Mapping = {}
    trouble = ""
    path = folder / f"{Path(_text(row.get('file')) or name).name}.report.json"
    if path.is_file():
        try:
            report = _report(path)
        except InputError as error:
            trouble = str(error)
    elif status == MADE:
        trouble = f"{path.name} is missing"
    if trouble and status == MADE:
        status = "no report"
    ground = _text(row.get("team") or report.get("team"))
    start, per_second = _by_second(report.get("per_second"))
    return PlayerResult(id=name, name=_text(row.get("name") or report.get("name")),
                        number=_text(row.get("number") or report.get("number")),
                        team=teams[ground].name if ground in teams else ground, status=status.strip() or "not told",
                        reason=trouble or _text(row.get("reason")) or reason.strip(), data=_lines(row), report=report,
                        start=start, per_second=per_second)  # fmt: skip


def _by_second(told) -> tuple[float, dict[str, np.ndarray]]:
    """The first second, and the columns (S,) of FIGURES, filled with NaN to one length."""
    if not isinstance(told, Mapping) or not math.isfinite(start := _time(told.get("start_s", 0.0))):
        return 0.0, {}
    lists = {key: told[key][:LONGEST] for key in FIGURES if isinstance(told.get(key), list)}
    columns = {key: [number(value) for value in values] for key, values in lists.items()}
    count = max(map(len, columns.values()), default=0)
    return start, {key: np.array(values + [math.nan] * (count - len(values))) for key, values in columns.items()}


def _lines(told: Mapping) -> tuple[str, ...]:
    """What is told of data and work, in its order, each line once."""
    lines = [line for key in ("data", "notes", "warnings") if isinstance(told.get(key), list) for line in told[key]]
    return tuple(dict.fromkeys(_text(line) for line in lines))


def number(value) -> float:
    """A number from JSON; NaN for anything else, and for one that no computer can count with."""
    try:
        return float(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else math.nan
    except OverflowError:
        return math.nan


def _time(value) -> float:
    """Seconds on a match clock; NaN for anything else."""
    seconds = number(value)
    return seconds if abs(seconds) <= _LATEST else math.nan


def _text(value) -> str:
    return "" if value is None else str(value).strip()


def _colour(value) -> str:
    """A colour "#rrggbb", "" for anything else."""
    text = _text(value)
    return text if len(text) == 7 and text[0] == "#" and all(c in "0123456789abcdefABCDEF" for c in text[1:]) else ""


def _report(path: Path) -> Mapping:
    found = _object(path)
    if not isinstance(found.get("warnings", []), list):
        raise InputError(path, "cannot be read: its warnings are no list", "a player's report", "make the match again")
    return found


def _object(path: Path) -> Mapping:
    try:
        found = json.loads(path.read_text("utf-8"))
    except OSError as error:
        found, trouble = None, error.strerror or str(error)
    except (ValueError, RecursionError) as error:
        found, trouble = None, str(error)
    else:
        trouble = "holds no object"
    if not isinstance(found, Mapping):
        raise InputError(path, f"cannot be read: {trouble}", "what 'beyond-mocap match' writes", "make the match again")
    check_depth(found, path)
    return found


@dataclass(frozen=True, kw_only=True)
class WorstSecond:
    """One bad second. player: who; time: its beginning, s on the match clock. figure: the one of LIMITS that is worst
    there, value in its unit, times: over its limit. other: the player into whom he runs, None where nobody is told."""

    player: PlayerResult
    time: float
    figure: str
    value: float
    times: float
    other: PlayerResult | None = None


def badness(player: PlayerResult) -> np.ndarray:
    """(S,) how many times the limit the worst figure of each second is; NaN where nothing is known."""
    rows = [player.per_second[figure] / limit for figure, limit in LIMITS.items() if figure in player.per_second]
    if not rows:
        return np.zeros(0)
    return np.fmax.reduce(rows)


def worst_seconds(players: Sequence[PlayerResult], most: int = MOST) -> tuple[WorstSecond, ...]:
    """At most `most` seconds beyond their limits, the worst first; of a player's seconds that follow each other within
    APART the worst stands for all, and two bodies in each other are one."""
    found: list[WorstSecond] = []
    for who, row, times in _in_order(players):
        player, time = players[who], players[who].start + row
        figure = _worst_figure(player, row)
        value = float(player.per_second[figure][row])
        if any(_same(one, player, time, figure, value) for one in found):
            continue
        other = _other(players, player, time, value) if figure == "overlap_m" else None
        found.append(WorstSecond(player=player, time=time, figure=figure, value=value, times=times, other=other))
        if len(found) == most:
            break
    return tuple(found)


def _in_order(players: Sequence[PlayerResult]) -> list[tuple[int, int, float]]:
    """(player, row of per_second, badness) of all seconds beyond a limit, the worst first."""
    each = [(who, badness(player)) for who, player in enumerate(players)]
    rows = [(who, int(row), float(bad[row])) for who, bad in each for row in np.flatnonzero(np.nan_to_num(bad) > 1.0)]
    return sorted(rows, key=lambda entry: (-entry[2], entry[0], entry[1]))


def _worst_figure(player: PlayerResult, row: int) -> str:
    shares = {figure: player.per_second[figure][row] / limit for figure, limit in LIMITS.items()
              if figure in player.per_second}
    return max(shares, key=lambda figure: np.nan_to_num(shares[figure], nan=-1.0))


def _same(one: WorstSecond, player: PlayerResult, time: float, figure: str, value: float) -> bool:
    """Whether this second is told already: his own nearby, or the same two bodies from the other's side."""
    if abs(one.time - time) > APART:
        return False
    return one.player is player or (figure == one.figure == "overlap_m" and one.other is player)


def _other(players: Sequence[PlayerResult], player: PlayerResult, time: float, value: float) -> PlayerResult | None:
    """Who is as deep in somebody in that second, to the millimetre; None where nobody or more than one is."""
    like = [one for one in players if one is not player and abs(_at(one, "overlap_m", time) - value) < 1e-3]
    return like[0] if len(like) == 1 else None


def _at(player: PlayerResult, figure: str, time: float) -> float:
    row, column = round(time - player.start), player.per_second.get(figure, ())
    return float(column[row]) if 0 <= row < len(column) else np.nan
