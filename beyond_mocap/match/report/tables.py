"""A team's players side by side: one row each, figures beside their targets."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...evaluation.html_page import Html, build_number_cell, build_row, build_table, build_title, element
from ...evaluation.report import flat
from ...synthesis.quality.targets import target_of
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
    players: Sequence[PlayerResult], strips: Mapping[str, Html], anchors: Mapping[str, str], everybody: tuple[str, ...]
) -> Html:
    """The table: a row for each player, then their mean and the worst of them. strips: each player's strip by his id;
    anchors: of his own part of the page; everybody: warnings that are not counted."""
    titles = [build_title(column.title, column.unit) for column in COLUMNS]
    head = ("player", *titles, build_title("warnings"), "second by second")
    rows = [_row(player, element("td", strips[player.id]), anchors[player.id], everybody) for player in players]
    return build_table(head, [*rows, *_summary(players, everybody)])


def _row(player: PlayerResult, strip: Html, anchor: str, everybody: tuple[str, ...]) -> Html:
    link = element("a", player.called, href=f"#{anchor}")
    if not player.report:
        why = element("td", _why(player), colspan=len(COLUMNS) + 1, class_="missed")
        return build_row(element("td", link, class_="name"), why, strip)
    found = flat({key: value for key, value in player.report.items() if key != "per_second"})
    cells = [_cell(column, _value(player, column.figure, found), player, found) for column in COLUMNS]
    note = () if player.made else (element("br"), element("span", _why(player), class_="missed"))
    count = build_number_cell(len(own_warnings(player, everybody)))
    return build_row(element("td", link, *note, class_="name"), *cells, count, strip)


def _why(player: PlayerResult) -> str:
    return f"{player.status}: {player.reason}" if player.reason else player.status


def _summary(players: Sequence[PlayerResult], everybody: tuple[str, ...]) -> list[Html]:
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
        lines.append(build_row(title, *cells, build_number_cell(measure(counts)), "", class_="sum"))
    return lines


def _value(player: PlayerResult, figure: str, found: Mapping[str, object]) -> float:
    """The figure; overlap from the seconds where the report has it only there."""
    told = number(found.get(figure))
    if math.isnan(told) and figure == "overlap_m.max":
        column = [value for value in player.per_second.get("overlap_m", ()) if math.isfinite(value)]
        return max(column, default=math.nan)
    return told


def _cell(column: Column, value: float, player: PlayerResult, found: Mapping[str, object]) -> Html:
    target = target_of(column.figure, number(player.report.get("fps")) or 30.0)
    met = target.met(value, found) if target is not None and math.isfinite(value) else None
    if column.figure == "overlap_m.max" and math.isfinite(value):
        met = value <= _OVERLAP
    return _plain(column, value, {True: "met", False: "missed", None: ""}[met])


def _plain(column: Column, value: float, status: str = "") -> Html:
    return build_number_cell(value, column.digits, column.scale, status)
