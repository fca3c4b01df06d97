"""The tables of a team in the report over a match: a row per player, then their mean and the worst of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...evaluation import naturalness_figures, physics_figures, touch_figures
from ...evaluation.html_page import (
    Html,
    build_element,
    build_number_cell,
    build_row,
    build_table,
    build_title,
    join_html,
)
from ...evaluation.report import flatten_report
from ...evaluation.titles import Title
from ...synthesis.quality.targets import find_target
from .results import PlayerResult, select_figures, select_own_warnings, to_number


@dataclass(frozen=True)
class Column:
    """A figure of the table.

    Attributes:
        figure: dotted name in the report.
        title: column title.
        unit: shown unit.
        scale: factor from the report's unit to the shown one.
        digits: after the decimal point.
    """

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
    Column("skate.source_contact_cm_s", "in clips", "cm/s"),
    Column("skate.stances_over_21mm", "sliding steps", "%", 100.0),
    Column("seam_jerk_ratio.share_above_real", "hard transitions", "%", 100.0),
    Column("loop_share", "repeated", "%", 100.0),
    Column("overlap_m.max", "overlap", "cm", 100.0),
)
_NATURALNESS = ("snap_turns_per_min", "spins_per_min", "pelvis_drops_per_min", "pelvis_drops_in_locomotion_per_min",
                "jolts_per_min", "cuts_per_min", "dwell_s_median", "short_dwell_share", "unusual_posture_share",
                "off_plan_deg_p90", "off_travel_deg_p90", "standing.foot_lifts_per_min",
                "standing.both_down")  # fmt: skip
_PHYSICS = ("flight.2-4.vertical_m_s2_median", "flight.4-6.vertical_m_s2_median", "flight.2-4.level_m_s2_median",
            "flight.4-6.level_m_s2_median", "flight.accelerating.level_m_s2_median", "lean.side.lean_error_deg_median",
            "lean.fore.lean_error_deg_median", "lean.hard.lean_missing_deg_median",
            "lean.hard.crouch_m_median", "boots.below_share")
_TOUCHES = ("reception.receptions", "reception.speed_m_s_median", "second_strike_count", "kick.kicks",
            "kick.ankle_speed_m_s_median", "kick.plant_in_range_share", "ball_speed.ratio_median", "fit.fit_share",
            "contact.reachable_met_share", "ball_inside.inside_frames", "substituted_count", "synthetic_count")


def _build_columns(group: str, names: Sequence[str], titles: Mapping[str, Title]) -> tuple[Column, ...]:
    """Build the columns of some figures of a group."""
    found = [(f"{group}.{name}", titles[name]) for name in names]
    return tuple(Column(figure, title.text.lower(), title.unit, title.scale, title.digits) for figure, title in found)


EYE_TABLES = {
    "What the eye sees": ("naturalness", _build_columns("naturalness", _NATURALNESS, naturalness_figures.TITLES)),
    "Physics": ("physics", _build_columns("physics", _PHYSICS, physics_figures.TITLES)),
    "At the ball": ("touches", _build_columns("touches", _TOUCHES, touch_figures.TITLES)),
}
"""The further tables of a team: title -> group of the report, and columns."""
_MAX_OVERLAP = 0.02  # m of overlap of two bodies that is accepted


def build_player_link(player: PlayerResult, anchors: Mapping[str, str]) -> Html:
    """Build a link to a player's part of the page; `anchors` has the anchor of each player by id."""
    return build_element("a", player.display_name, href=f"#{anchors[player.id]}")


def build_team_table(
    players: Sequence[PlayerResult], strips: Mapping[str, Html], anchors: Mapping[str, str], shared: tuple[str, ...]
) -> Html:
    """Build a team's table: a row per player, then their mean and the worst of them.

    Args:
        players: of the team.
        strips: strip by player id.
        anchors: anchor of each player's part of the page, by id.
        shared: warnings that are not counted.
    Returns:
        The table.
    """
    titles = [build_title(column.title, column.unit) for column in COLUMNS]
    head = ("player", *titles, build_title("warnings"), "second by second")
    rows = [_build_player_row(player, build_element("td", strips[player.id]), anchors, shared)
            for player in players]
    return build_table(head, [*rows, *_build_summary(players, shared)])


def _build_player_row(player: PlayerResult, strip: Html, anchors: Mapping[str, str], shared: tuple[str, ...]) -> Html:
    """Build a player's row; without a report, only status and strip."""
    link = build_player_link(player, anchors)
    if not player.report:
        why = build_element("td", _describe_status(player), colspan=len(COLUMNS) + 1, class_="missed")
        return build_row(build_element("td", link, class_="name"), why, strip)
    found = flatten_report(select_figures(player.report))
    cells = [_build_cell(column, _find_value(player, column.figure, found), player, found) for column in COLUMNS]
    note = () if player.is_finished else (build_element("br"), build_element("span", _describe_status(player),
                                                                             class_="missed"))
    count = build_number_cell(len(select_own_warnings(player, shared)))
    return build_row(build_element("td", link, *note, class_="name"), *cells, count, strip)


def _describe_status(player: PlayerResult) -> str:
    return f"{player.status}: {player.reason}" if player.reason else player.status


def _build_summary(players: Sequence[PlayerResult], shared: tuple[str, ...]) -> list[Html]:
    """Build the rows with mean and worst over all players with a report; none for a single one."""
    reported = [player for player in players if player.report]
    counts = [len(select_own_warnings(player, shared)) for player in reported]
    return [build_row(title, *cells, build_number_cell(measure(counts)), "", class_="sum")
            for (title, cells), measure in zip(_summarize_columns(COLUMNS, reported),
                                               (lambda known: sum(known) / len(known), max))]


def build_group_table(title: str, players: Sequence[PlayerResult], anchors: Mapping[str, str]) -> Html:
    """Build a team's table of a group of figures: a row per player, mean and worst; empty without such a report.

    Args:
        title: of EYE_TABLES.
        players: of the team.
        anchors: anchor of each player's part of the page, by id.
    Returns:
        The table.
    """
    group, columns = EYE_TABLES[title]
    reported = [player for player in players if player.report.get(group)]
    if not reported:
        return Html()
    rows = []
    for player in reported:
        found = flatten_report(select_figures(player.report))
        cells = [_build_cell(column, _find_value(player, column.figure, found), player, found) for column in columns]
        rows.append(build_row(build_element("td", build_player_link(player, anchors), class_="name"), *cells))
    rows += [build_row(name, *cells, class_="sum") for name, cells in _summarize_columns(columns, reported)]
    titles = [build_title(column.title, column.unit) for column in columns]
    return join_html(build_element("h3", title), build_table(("player", *titles), rows))


def _summarize_columns(columns: Sequence[Column], reported: Sequence[PlayerResult]) -> list[tuple[str, list[Html]]]:
    """Summarize columns by mean and worst: a title and cells for each; none for a single player."""
    if len(reported) < 2:
        return []
    tables = [flatten_report(player.report) for player in reported]
    found = [[_find_value(player, column.figure, table) for player, table in zip(reported, tables)]
             for column in columns]
    known = [[value for value in values if math.isfinite(value)] for values in found]
    means = [sum(values) / len(values) if values else math.nan for values in known]
    worst = [_find_worst_value(column, values) if values else math.nan for column, values in zip(columns, known)]
    return [(title, [_build_plain_cell(column, value) for column, value in zip(columns, values)])
            for title, values in (("mean", means), ("worst", worst))]


def _find_worst_value(column: Column, values: Sequence[float]) -> float:
    """Find the worst of a column's values: the smallest where the target is a lower limit, the farthest from the middle
    of a range.
    """
    target = find_target(column.figure, 30.0)
    if target is not None and target.least is not None and target.most is not None:
        middle = 0.5 * (target.least + target.most)
        return max(values, key=lambda value: abs(value - middle))
    return min(values) if target is not None and target.most is None and target.own is None else max(values)


def _find_value(player: PlayerResult, figure: str, found: Mapping[str, object]) -> float:
    """Find a figure; overlap from the seconds if the report has it only there."""
    reported = to_number(found.get(figure))
    if math.isnan(reported) and figure == "overlap_m.max":
        column = [value for value in player.per_second.get("overlap_m", ()) if math.isfinite(value)]
        return max(column, default=math.nan)
    return reported


def _build_cell(column: Column, value: float, player: PlayerResult, found: Mapping[str, object]) -> Html:
    target = find_target(column.figure, to_number(player.report.get("fps")) or 30.0)
    is_met = target.is_met(value, found) if target is not None and math.isfinite(value) else None
    if column.figure == "overlap_m.max" and math.isfinite(value):
        is_met = value <= _MAX_OVERLAP
    return _build_plain_cell(column, value, {True: "met", False: "missed", None: ""}[is_met])


def _build_plain_cell(column: Column, value: float, status: str = "") -> Html:
    return build_number_cell(value, column.digits, column.scale, status)
