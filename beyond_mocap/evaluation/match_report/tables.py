"""A team's players side by side: one row each, figures beside their targets."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

from ..report import flat
from ..targets import target_of
from .results import PlayerResult, number


@dataclass(frozen=True)
class Column:
    """A figure of the table: its dotted name in the report, the title, its unit, what it is multiplied by, digits."""

    figure: str
    title: str
    unit: str
    scale: float = 1.0
    digits: int = 1


COLUMNS = (
    Column("time_lost_s", "time lost", "s"),
    Column("root_error_m.mean", "off the track", "cm", 100.0, 2),
    Column("root_error_m.p95", "in 95 %", "cm", 100.0, 2),
    Column("skate.contact_cm_s", "skate", "cm/s"),
    Column("skate.source_contact_cm_s", "recordings'", "cm/s"),
    Column("skate.stances_over_21mm", "sliding steps", "%", 100.0),
    Column("seam_jerk_ratio.share_above_real", "hard seams", "%", 100.0),
    Column("loop_share", "repeated", "%", 100.0),
    Column("overlap_m.max", "overlap", "cm", 100.0),
)
_OVERLAP = 0.02  # metres that two bodies may be in each other


def shared_warnings(players: Sequence[PlayerResult]) -> tuple[str, ...]:
    """Lines that all reports have, which are about the library and not about a player; none for a single player."""
    told = [own_warnings(player, ()) for player in players if player.report]
    return tuple(line for line in told[0] if all(line in other for other in told)) if len(told) > 1 else ()


def own_warnings(player: PlayerResult, everybody: tuple[str, ...]) -> tuple[str, ...]:
    """A player's warnings, each once, without those that `everybody` has."""
    lines = dict.fromkeys(map(str, player.report.get("warnings") or ()))
    return tuple(line for line in lines if line not in everybody)


def team_table(
    players: Sequence[PlayerResult], strips: Mapping[str, str], anchors: Mapping[str, str], everybody: tuple[str, ...]
) -> str:
    """The table as HTML: a row for each player, then their mean and the worst of them. strips: HTML of each player's
    strip by his id; anchors: of his own part of the page; everybody: warnings that are not counted."""
    head = "".join(f"<th class=n>{column.title}<br><span class=quiet>{column.unit}</span>" for column in COLUMNS)
    lines = [f"<tr><th>player{head}<th class=n>warnings<th>second by second"]
    for player in players:
        who = f'<tr><td class=name><a href="#{anchors[player.id]}">{escape(player.called)}</a>'
        if not player.report:
            lines.append(f"{who}<td colspan={len(COLUMNS) + 1} class=missed>{_why(player)}<td>{strips[player.id]}")
            continue
        found = flat({key: value for key, value in player.report.items() if key != "per_second"})
        cells = "".join(_cell(column, _value(player, column.figure, found), player, found) for column in COLUMNS)
        count = len(own_warnings(player, everybody))
        note = "" if player.made else f"<br><span class=missed>{_why(player)}</span>"
        lines.append(f"{who}{note}{cells}<td class=n>{count}<td>{strips[player.id]}")
    lines += _summary(players, everybody)
    return f"<div class=scroll><table>{chr(10).join(lines)}</table></div>"


def _why(player: PlayerResult) -> str:
    return escape(f"{player.status}: {player.reason}" if player.reason else player.status)


def _summary(players: Sequence[PlayerResult], everybody: tuple[str, ...]) -> list[str]:
    """The mean and the largest over all players with a report; nothing for a single one."""
    made = [player for player in players if player.report]
    if len(made) < 2:
        return []
    columns = [[_value(player, column.figure, flat(player.report)) for player in made] for column in COLUMNS]
    lines = []
    for title, measure in (("mean", lambda known: sum(known) / len(known)), ("worst", max)):
        known = [[value for value in values if math.isfinite(value)] for values in columns]
        cells = [_plain(column, measure(values) if values else math.nan) for column, values in zip(COLUMNS, known)]
        counts = [len(own_warnings(player, everybody)) for player in made]
        lines.append(f"<tr class=sum><td>{title}{''.join(cells)}<td class=n>{measure(counts):.0f}<td>")
    return lines


def _value(player: PlayerResult, figure: str, found: Mapping[str, object]) -> float:
    """The figure; overlap from the seconds where the report has it only there."""
    told = number(found.get(figure))
    if math.isnan(told) and figure == "overlap_m.max":
        column = [value for value in player.per_second.get("overlap_m", ()) if math.isfinite(value)]
        return max(column, default=math.nan)
    return told


def _cell(column: Column, value: float, player: PlayerResult, found: Mapping[str, object]) -> str:
    target = target_of(column.figure, number(player.report.get("fps")) or 30.0)
    met = target.met(value, found) if target is not None and math.isfinite(value) else None
    if column.figure == "overlap_m.max" and math.isfinite(value):
        met = value <= _OVERLAP
    return _plain(column, value, {True: " met", False: " missed", None: ""}[met])


def _plain(column: Column, value: float, status: str = "") -> str:
    if not math.isfinite(value):
        return "<td class=n>–"
    return f'<td class="n{status}">{column.scale * value:.{column.digits}f}'
