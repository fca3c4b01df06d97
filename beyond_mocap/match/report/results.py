"""Read what a folder of a match has about its players, from match.json and the players' reports, complete or not; find
the worst seconds of all players.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...base.errors import InputError
from ...evaluation.report import check_depth, judge_figures

DONE_STATUS = "done"
FIGURES = ("root_error_m", "skate_cm_s", "overlap_m", "ball_m")
"""Keys of a report's `per_second`, beside its `start_s`."""
MAX_SECONDS = 6 * 3600
"""s: the longest span of a match that a page shows."""
_MAX_TIME = 1e11  # s: some clocks count from 1970
LIMITS = {"root_error_m": 0.015, "skate_cm_s": 7.0, "overlap_m": 0.02}
"""Limit of each figure in a second: 1.5 cm off the track, 2 cm of overlap of two bodies; at 7 cm/s a foot in contact
slides 21 mm, which is visible, within a step of 0.3 s."""
MAX_WORST = 10
GROUP_SECONDS = 3
"""s within which a player's bad seconds count as one."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PlayerResult:
    """One player.

    Attributes:
        id: in the feed.
        name: of the player.
        number: on the shirt, "" where it is unknown.
        team: name of the team.
        status: "done", or how far the player got.
        reason: why the player got no further, "" if unknown.
        data: messages about the data that were read.
        report: the player's report, {} if there is none.
        start: s on the match clock of the first row of `per_second`.
        per_second: array (S,) for each of FIGURES, NaN where unknown; empty if the report has none.
    """

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
    def is_finished(self) -> bool:
        """True if there is a report of a finished motion."""
        return self.status == DONE_STATUS and bool(self.report)

    @property
    def display_name(self) -> str:
        """Number and name for the page; the name alone if it includes the number."""
        name = self.name or self.id
        return name if not self.number or self.number in re.findall(r"\d+", name) else f"{self.number} {name}"


@dataclass(frozen=True)
class TeamResult:
    """A team.

    Attributes:
        name: of the team.
        colour: "#rrggbb", "" if the feed has none.
    """

    name: str
    colour: str = ""


@dataclass(frozen=True, eq=False, kw_only=True)
class MatchResults:
    """A match.

    Attributes:
        title: of the match.
        status: of the whole.
        fps: of the motions, NaN if unknown.
        start: s on the match clock, NaN if unknown.
        end: s on the match clock, NaN if unknown.
        teams: the teams.
        players: the players.
        seconds: s of each stage.
        lines: messages about the data.
    """

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
    """Read the results in a folder.

    Args:
        folder: the match's folder.
    Returns:
        The results; a player whose report is missing or damaged is included, with the reason.
    Raises:
        InputError: if match.json is missing or not of the form in docs/reference/match-report.md.
    """
    path = Path(folder) / "match.json"
    state = _read_object(path)
    rows = state.get("players", ())
    if not isinstance(rows, list) or not all(isinstance(row, Mapping) and _to_text(row.get("id")) for row in rows):
        expected = "a list of objects with an id"
        raise InputError(path, "its players are not listed one by one", expected, "run the match again")
    teams = _parse_teams(state.get("teams"))
    players = tuple(_parse_player(Path(folder), row, teams) for row in rows)
    known = {team.name for team in teams.values()}
    others = dict.fromkeys(player.team for player in players if player.team not in known)
    sides = [team.name for team in teams.values()][:2]
    seconds = state.get("seconds") if isinstance(state.get("seconds"), Mapping) else {}
    stages = {str(stage): to_number(duration) for stage, duration in seconds.items()}
    return MatchResults(
        title=_to_text(state.get("title")) or (" - ".join(sides) if len(sides) == 2 else Path(folder).resolve().name),
        status=_to_text(state.get("status")), fps=to_number(state.get("fps")), start=_to_time(state.get("from_s")),
        end=_to_time(state.get("to_s")), teams=(*teams.values(), *map(TeamResult, others)), players=players,
        seconds=stages, lines=_collect_messages(state),
    )  # fmt: skip


def select_figures(report: Mapping) -> dict:
    """Select what a report has of a whole motion, without the thousands of values of its seconds."""
    return {key: value for key, value in report.items() if key != "per_second"}


def _parse_teams(rows_found) -> dict[str, TeamResult]:
    """Parse the teams by their ground, else by name; two teams of the same name get their ground added."""
    rows = [row for row in rows_found if isinstance(row, Mapping)] if isinstance(rows_found, list) else []
    names = [_to_text(row.get("name")) for row in rows]
    out = {}
    for row, name in zip(rows, names):
        ground = _to_text(row.get("ground")) or name
        label = f"{name} ({ground})" if names.count(name) > 1 and name else name or ground
        out[ground] = TeamResult(label, _to_colour(row.get("colour")))
    return out


def _parse_player(folder: Path, row: Mapping, teams: Mapping[str, TeamResult]) -> PlayerResult:
    """Parse a player's row and report."""
    name, (status, _, reason) = str(row["id"]), _to_text(row.get("status")).partition(":")
    report: Mapping = {}
    problem = ""
    path = folder / f"{Path(_to_text(row.get('file')) or name).name}.report.json"
    if path.is_file():
        try:
            report = _read_report(path)
        except InputError as error:
            problem = str(error)
    elif status == DONE_STATUS:
        problem = f"{path.name} is missing"
    if problem and status == DONE_STATUS:
        status = "no report"
    ground = _to_text(row.get("team") or report.get("team"))
    number = _to_text(row.get("number") or report.get("number"))
    start, per_second = _parse_per_second(report.get("per_second"))
    return PlayerResult(id=name, name=_to_text(row.get("name") or report.get("name")),
                        number="" if number == "-1" else number, team=teams[ground].name
                        if ground in teams else ground, status=status.strip() or "unknown", reason=problem
                        or _to_text(row.get("reason")) or reason.strip(), data=_collect_messages(row), report=report,
                        start=start, per_second=per_second)  # fmt: skip


def _parse_per_second(values_found) -> tuple[float, dict[str, np.ndarray]]:
    """Parse the first second, and the columns (S,) of FIGURES, filled with NaN to one length."""
    if not isinstance(values_found, Mapping) or not math.isfinite(start := _to_time(values_found.get("start_s", 0.0))):
        return 0.0, {}
    lists = {key: values_found[key][:MAX_SECONDS] for key in FIGURES if isinstance(values_found.get(key), list)}
    columns = {key: [to_number(value) for value in values] for key, values in lists.items()}
    count = max(map(len, columns.values()), default=0)
    return start, {key: np.array(values + [math.nan] * (count - len(values))) for key, values in columns.items()}


def _collect_messages(found: Mapping) -> tuple[str, ...]:
    """Collect the messages about data and work, in order, each once."""
    lines = [line for key in ("data", "notes", "warnings") if isinstance(found.get(key), list) for line in found[key]]
    return tuple(dict.fromkeys(_to_text(line) for line in lines))


def to_number(value) -> float:
    """Convert a JSON number to float; NaN for anything else, or if it is too large."""
    try:
        return float(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else math.nan
    except OverflowError:
        return math.nan


def _to_time(value) -> float:
    """Convert seconds on a match clock; NaN for anything else."""
    seconds = to_number(value)
    return seconds if abs(seconds) <= _MAX_TIME else math.nan


def _to_text(value) -> str:
    return "" if value is None else str(value).strip()


def _to_colour(value) -> str:
    """Convert a colour "#rrggbb"; "" for anything else."""
    text = _to_text(value)
    return text if len(text) == 7 and text[0] == "#" and all(c in "0123456789abcdefABCDEF" for c in text[1:]) else ""


def _read_report(path: Path) -> Mapping:
    found = _read_object(path)
    if not isinstance(found.get("warnings", []), list):
        raise InputError(path, "cannot be read: its warnings are no list", "a player's report", "run the match again")
    try:
        list(judge_figures(select_figures(found)))
    except (AttributeError, OverflowError, TypeError, ValueError):
        raise InputError(path, "cannot be read: figures in another form", "a player's report",
                         "run the match again") from None
    return found


def _read_object(path: Path) -> Mapping:
    try:
        found = json.loads(path.read_text("utf-8"))
    except OSError as error:
        found, problem = None, error.strerror or str(error)
    except (ValueError, RecursionError) as error:
        found, problem = None, str(error)
    else:
        problem = "not an object"
    if not isinstance(found, Mapping):
        raise InputError(path, f"cannot be read: {problem}", "a file of 'beyond-mocap match'", "run the match again")
    check_depth(found, path)
    return found


@dataclass(frozen=True, kw_only=True)
class WorstSecond:
    """One bad second.

    Attributes:
        player: who.
        time: s on the match clock, its start.
        figure: the one of LIMITS that is worst.
        value: of the figure, in its unit.
        times: multiple of its limit.
        other: the player they overlap, None if unknown.
    """

    player: PlayerResult
    time: float
    figure: str
    value: float
    times: float
    other: PlayerResult | None = None


def measure_badness(player: PlayerResult) -> np.ndarray:
    """Measure (S,) by how much the worst figure of each second exceeds its limit, as a multiple; NaN where unknown."""
    rows = [player.per_second[figure] / limit for figure, limit in LIMITS.items() if figure in player.per_second]
    if not rows:
        return np.zeros(0)
    return np.fmax.reduce(rows)


def find_worst_seconds(players: Sequence[PlayerResult], limit: int = MAX_WORST) -> tuple[WorstSecond, ...]:
    """Find the worst seconds beyond their limits.

    Of a player's seconds within GROUP_SECONDS the worst stands for all; an overlap of two bodies counts once.

    Args:
        players: of the match.
        limit: the most seconds.
    Returns:
        The seconds, the worst first.
    """
    found: list[WorstSecond] = []
    for index, row, times in _sort_bad_seconds(players):
        player, time = players[index], players[index].start + row
        figure = _find_worst_figure(player, row)
        value = float(player.per_second[figure][row])
        if any(_is_same_second(one, player, time, figure, value) for one in found):
            continue
        other = _find_other_player(players, player, time, value) if figure == "overlap_m" else None
        found.append(WorstSecond(player=player, time=time, figure=figure, value=value, times=times, other=other))
        if len(found) == limit:
            break
    return tuple(found)


def _sort_bad_seconds(players: Sequence[PlayerResult]) -> list[tuple[int, int, float]]:
    """Sort (player, row of per_second, badness) of all seconds beyond a limit, the worst first."""
    each = [(index, measure_badness(player)) for index, player in enumerate(players)]
    rows = [(index, int(row), float(bad[row])) for index, bad in each
            for row in np.flatnonzero(np.nan_to_num(bad) > 1.0)]
    return sorted(rows, key=lambda entry: (-entry[2], entry[0], entry[1]))


def _find_worst_figure(player: PlayerResult, row: int) -> str:
    shares = {figure: player.per_second[figure][row] / limit for figure, limit in LIMITS.items()
              if figure in player.per_second}
    return max(shares, key=lambda figure: np.nan_to_num(shares[figure], nan=-1.0))


def _is_same_second(known: WorstSecond, player: PlayerResult, time: float, figure: str, value: float) -> bool:
    """Say whether this second is in the list already: the same player nearby, or the same overlap from the other
    player.
    """
    if abs(known.time - time) > GROUP_SECONDS:
        return False
    return known.player is player or (figure == known.figure == "overlap_m" and known.other is player)


def _find_other_player(players: Sequence[PlayerResult], player: PlayerResult, time: float,
                       value: float) -> PlayerResult | None:
    """Find the player with the same overlap in that second, to the millimetre; None if there is none or more than
    one.
    """
    matches = [one for one in players if one is not player and abs(_find_value(one, "overlap_m", time) - value) < 1e-3]
    return matches[0] if len(matches) == 1 else None


def _find_value(player: PlayerResult, figure: str, time: float) -> float:
    row, column = round(time - player.start), player.per_second.get(figure, ())
    return float(column[row]) if 0 <= row < len(column) else np.nan


def find_shared_warnings(players: Sequence[PlayerResult]) -> tuple[str, ...]:
    """Find the warnings that all reports share: they are about the library, not a player.

    Args:
        players: the players, some with reports.
    Returns:
        Those lines; none for a single report.
    """
    warnings = [select_own_warnings(player, ()) for player in players if player.report]
    return tuple(line for line in warnings[0] if all(line in other for other in warnings)) if len(warnings) > 1 else ()


def select_own_warnings(player: PlayerResult, shared: tuple[str, ...]) -> tuple[str, ...]:
    """Select a player's warnings, each once, without those in `shared`."""
    lines = dict.fromkeys(map(str, player.report.get("warnings") or ()))
    return tuple(line for line in lines if line not in shared)
