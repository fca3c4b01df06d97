"""The report over a whole match as one page for a browser: it loads nothing and runs nothing, and all names are
escaped.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...appearance.picture import encode_png
from ...base.errors import format_seconds
from ...evaluation import naturalness_figures, physics_figures, touch_figures
from ...evaluation.html_page import (
    Html,
    build_element,
    build_image,
    build_list,
    build_number_cell,
    build_page,
    build_row,
    build_section,
    build_table,
    build_title,
    join_html,
)
from ...evaluation.report import flatten_report
from ...evaluation.titles import Title
from ...synthesis.quality.targets import find_target
from .pictures import render_heat_strip
from .results import (
    LIMITS,
    MAX_SECONDS,
    MatchResults,
    PlayerResult,
    WorstSecond,
    find_worst_seconds,
    measure_badness,
    read_match_results,
    to_number,
)

Thumbnail = Callable[[str, float], "np.ndarray | None"]
"""Player's id and second on the match clock -> picture as of `appearance.picture.render_pose`, or None."""

_STRIP_SECONDS = 15.0  # s before and after a bad second, shown in its strip
_TITLES = {"root_error_m": "off the track", "skate_cm_s": "feet in contact slide", "overlap_m": "bodies overlap"}
_PHRASES = {
    "root_error_m": ("{:.1f} cm off the track", 100.0), "skate_cm_s": ("feet in contact slide at {:.1f} cm/s", 1.0),
    "overlap_m": ("{:.1f} cm deep in another body", 100.0), "ball_m": ("ball {:.1f} m away", 1.0),
}
_STYLE = """
body { max-width: 1320px } code { font-size: 12px; color: #555; overflow-wrap: anywhere }
tr.sum { background: #f7f7f7 } td.name { min-width: 11em; max-width: 16em }
.strip { width: 260px; max-width: none; height: 16px; image-rendering: pixelated; border-radius: 2px; margin-top: 2px }
.wide { width: 100%; height: 14px }
.worst { display: flex; gap: 1em; align-items: center; border-bottom: 1px solid #eee; padding: .4em 0 }
.worst > b { min-width: 1.6em; text-align: right; color: #b3261e; font-size: 1.1em }
.worst > div { flex: 1; min-width: 0 }
.worst img.pose { width: 112px; height: 112px; background: #e9efe6; border-radius: 4px; flex: none }
.dot { display: inline-block; width: .9em; height: .9em; border: 1px solid #999; border-radius: 50%;
  margin-right: .4em }
details { border-bottom: 1px solid #eee; padding: .3em 0 } summary { cursor: pointer } :target { background: #fff6d6 }
"""


def build_match_page(folder: Path, thumbnail: Thumbnail | None = None) -> str:
    """Build the page of what 'beyond-mocap match' wrote, as text; failed and unfinished players are marked.

    Args:
        folder: the match's folder.
        thumbnail: renders a player in a second, for the worst seconds; None: no pictures.
    Returns:
        HTML.
    Raises:
        InputError: if match.json is missing or cannot be read.
    """
    match = read_match_results(Path(folder))
    anchors = {player.id: f"player-{number}" for number, player in enumerate(match.players, 1)}
    worst, span = find_worst_seconds(match.players), _choose_span(match)
    shared = find_shared_warnings(match.players)
    data = build_list((*match.lines, *shared))
    return build_page(
        match.title, _build_head(match, span), _build_worst_section(match, worst, anchors, thumbnail),
        *_build_teams(match, span, anchors, shared), build_section("The data", data) if data else "",
        _build_times(match), _build_players(match, worst, span, anchors, shared), style=_STYLE,
    )  # fmt: skip


def _choose_span(match: MatchResults) -> tuple[float, float]:
    """Choose the first and last second of the page: those requested, else those available; LONGEST at most."""
    known = [one for one in match.players if one.per_second]
    first, last = match.start, match.end
    if not math.isfinite(first):
        first = min((one.start for one in known), default=0.0)
    if not math.isfinite(last):
        last = max((one.start + len(measure_badness(one)) for one in known), default=first + 1.0)
    return first, min(max(last, first + 1.0), first + MAX_SECONDS)


def _build_head(match: MatchResults, span: tuple[float, float]) -> Html:
    """Build the title and the summary of who is finished."""
    finished, missing = sum(one.is_finished for one in match.players), [one for one in match.players
                                                                        if not one.is_finished]
    rate = f", {match.fps:g} frames a second" if math.isfinite(match.fps) else ""
    text = (f"{_format_clock(span[0])} to {_format_clock(span[1])} on the match clock{rate}; {finished} of "
            f"{len(match.players)} players finished")  # fmt: skip
    parts = [build_element("h1", match.title), build_element("p", text, class_="quiet")]
    if missing:
        names = ", ".join(one.display_name for one in missing)
        parts.append(build_element("p", f"Partial: {len(missing)} not finished: {names}", class_="missed"))
    elif match.status and match.status != "done":
        parts.append(build_element("p", f"Partial: {match.status}", class_="missed"))
    return join_html(*parts, separator="\n")


def _build_worst_section(match: MatchResults, worst: tuple[WorstSecond, ...], anchors: Mapping[str, str],
                         thumbnail) -> Html:
    """Build the section with the worst seconds."""
    title = "Worst seconds"
    if not any(player.per_second for player in match.players):
        return build_section(title, build_element("p", "No report has figures by the second.", class_="quiet"))
    track, overlap = 100 * LIMITS["root_error_m"], 100 * LIMITS["overlap_m"]
    limits = (f"beyond {track:g} cm off the track, {LIMITS['skate_cm_s']:g} cm/s of foot sliding, or {overlap:g} cm "
              "of overlap of two bodies")  # fmt: skip
    if not worst:
        return build_section(title, build_element("p", f"No second is {limits}.", class_="met"))
    lines = [_build_worst_line(match, place, one, anchors, thumbnail) for place, one in enumerate(worst, 1)]
    return build_section(title, build_element("p", f"Seconds {limits}.", class_="quiet"), *lines)


def _build_worst_line(match: MatchResults, place: int, second: WorstSecond, anchors: Mapping[str, str],
                      thumbnail) -> Html:
    """Build one line of the worst seconds, with picture, figures and strip."""
    pose = thumbnail(second.player.id, second.time + 0.5) if thumbnail is not None else None
    strip = _build_strip(second.player, (second.time - _STRIP_SECONDS, second.time + _STRIP_SECONDS + 1.0), "wide")
    other = (" (in ", _build_link(second.other, anchors), ")") if second.other is not None else ()
    who = (_build_link(second.player, anchors), *other, ", ", build_element("b", _format_clock(second.time)),
           _describe_frame(match, second.time))
    limit = f"{second.times:.1f} times the limit; {_STRIP_SECONDS:g} s before and after. In Blender: "
    return build_element(
        "div", build_element("b", str(place)), _build_pose_image(second.player, pose) if pose is not None else "",
        build_element("div", build_element("p", *who, ": ", "; ".join(_describe_figures(second))), strip,
                      build_element("p", limit, build_element("code", _build_jump_command(second)), class_="quiet")),
        class_="worst", id=_build_anchor(second, anchors),
    )  # fmt: skip


def _describe_figures(second: WorstSecond) -> list[str]:
    """Describe what is wrong in this second, the worst figure first, and how far away the ball is."""
    row = round(second.time - second.player.start)
    values = {figure: column[row] for figure, column in second.player.per_second.items() if np.isfinite(column[row])}
    wrong = [figure for figure in values if figure not in LIMITS or values[figure] > LIMITS[figure]]
    order = sorted(wrong, key=lambda figure: figure != second.figure)
    return [_PHRASES[figure][0].format(_PHRASES[figure][1] * values[figure]) for figure in order]


def _build_teams(match: MatchResults, span: tuple[float, float], anchors, shared: tuple[str, ...]) -> list[Html]:
    """Build a table of players per team."""
    strips = {player.id: _build_strip(player, span) for player in match.players}
    parts = []
    for team in match.teams:
        members = [player for player in match.players if player.team == team.name]
        dot = build_element("span", class_="dot", style=f"background:{team.colour}") if team.colour else ""
        if members:
            tables = [build_group_table(title, members, anchors) for title in EYE_TABLES]
            first = build_team_table(members, strips, anchors, shared)
            parts.append(build_section(join_html(dot, team.name or "No team"), first, *tables))
    text = ("Strips: the worst figure of every second; green far below its limit, amber at it, red beyond, grey where "
            "the player has no motion. Green and red figures: target met or not.")  # fmt: skip
    return [*parts, build_element("p", text, class_="quiet")] if parts else []


def _build_players(match: MatchResults, worst: tuple[WorstSecond, ...], span, anchors, shared: tuple[str, ...]) -> Html:
    """Build the details of every player."""
    parts = []
    for player in match.players:
        reason = f": {player.reason}" if player.reason else ""
        lines = [] if player.is_finished else [build_element("p", f"{player.status}{reason}", class_="missed")]
        for figure, limit in LIMITS.items():
            if figure in player.per_second:
                bad = player.per_second[figure] / limit
                strip = _build_strip_image(render_heat_strip(bad, player.start, span), "wide")
                lines += [build_element("p", _TITLES[figure], class_="quiet"), strip]
        own = [one for one in worst if one.player is player]
        for one in own:
            anchor, text = f"#{_build_anchor(one, anchors)}", f"{_format_clock(one.time)}: one of the worst seconds"
            lines.append(build_element("p", build_element("a", text, href=anchor)))
        lines.append(build_list(select_own_warnings(player, shared) + player.data))
        name = build_element("summary", player.display_name, " ", build_element("span", player.team, class_="quiet"))
        parts.append(build_element("details", name, *lines, id=anchors[player.id], open=bool(own)))
    return build_section("Every player", *parts) if parts else Html()


def _build_times(match: MatchResults) -> Html:
    rows = [build_row(stage, build_element("td", f"{spent:.1f} s", class_="n")) for stage,
            spent in match.seconds.items()]
    return build_section("Computing time", build_table((), rows)) if rows else Html()


def _build_strip(player: PlayerResult, span: tuple[float, float], look: str = "") -> Html:
    bad = measure_badness(player)
    if not len(bad):
        return build_element("span", "nothing by the second", class_="quiet")
    return _build_strip_image(render_heat_strip(bad, player.start, span), look)


def _build_strip_image(data: bytes, look: str) -> Html:
    return build_image(data, "worst figure of every second", f"strip {look}".strip())


def _build_pose_image(player: PlayerResult, pose: np.ndarray) -> Html:
    """Build the image of a picture of `appearance.picture`, whose lowest row is the first."""
    return build_image(encode_png(np.rint(255.0 * np.clip(pose[::-1], 0.0, 1.0)).astype(np.uint8)), player.display_name,
                       "pose")


def _build_link(player: PlayerResult, anchors: Mapping[str, str]) -> Html:
    return build_element("a", player.display_name, href=f"#{anchors[player.id]}")


def _build_anchor(one: WorstSecond, anchors: Mapping[str, str]) -> str:
    return f"{anchors[one.player.id]}-second-{one.time:.0f}"


def _describe_frame(match: MatchResults, time: float) -> str:
    """Describe the frame of the span, counted from the first on the clock's grid as in ball.csv; "" if unknown."""
    if not math.isfinite(match.start * match.fps):
        return ""
    first = math.ceil(match.start * match.fps - 1e-6)
    return f", frame {max(math.ceil(time * match.fps - 1e-6) - first, 0)}"


def _build_jump_command(one: WorstSecond) -> str:
    return f"bpy.ops.beyond_mocap.match_second(seconds={format_seconds(one.time)}, player={one.player.id!r})"


def _format_clock(seconds: float) -> str:
    """Format seconds for the page: 754 s (12:34)."""
    return f"{format_seconds(seconds)} s ({int(seconds // 60)}:{int(seconds % 60):02d})"


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
_NATURALNESS = ("snap_turns_per_min", "spins_per_min", "pelvis_drops_per_min", "jolts_per_min", "cuts_per_min",
                "dwell_s_median", "short_dwell_share", "unusual_posture_share", "off_plan_deg_p90",
                "off_travel_deg_p90", "standing.foot_lifts_per_min", "standing.both_down")  # fmt: skip
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


def find_shared_warnings(players: Sequence[PlayerResult]) -> tuple[str, ...]:
    """Find the warnings that all reports share: they are about the library, not a player; none for a single player."""
    warnings = [select_own_warnings(player, ()) for player in players if player.report]
    return tuple(line for line in warnings[0] if all(line in other for other in warnings)) if len(warnings) > 1 else ()


def select_own_warnings(player: PlayerResult, shared: tuple[str, ...]) -> tuple[str, ...]:
    """Select a player's warnings, each once, without those in `shared`."""
    lines = dict.fromkeys(map(str, player.report.get("warnings") or ()))
    return tuple(line for line in lines if line not in shared)


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
    rows = [_build_player_row(player, build_element("td", strips[player.id]), anchors[player.id], shared)
            for player in players]
    return build_table(head, [*rows, *_build_summary(players, shared)])


def _build_player_row(player: PlayerResult, strip: Html, anchor: str, shared: tuple[str, ...]) -> Html:
    """Build a player's row; without a report, only status and strip."""
    link = build_element("a", player.display_name, href=f"#{anchor}")
    if not player.report:
        why = build_element("td", _describe_status(player), colspan=len(COLUMNS) + 1, class_="missed")
        return build_row(build_element("td", link, class_="name"), why, strip)
    found = flatten_report({key: value for key, value in player.report.items() if key != "per_second"})
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
        found = flatten_report({key: value for key, value in player.report.items() if key != "per_second"})
        cells = [_build_cell(column, _find_value(player, column.figure, found), player, found) for column in columns]
        rows.append(build_row(build_element("td", _build_link(player, anchors), class_="name"), *cells))
    rows += [build_row(name, *cells, class_="sum") for name, cells in _summarize_columns(columns, reported)]
    titles = [build_title(column.title, column.unit) for column in columns]
    return join_html(build_element("h3", title), build_table(("player", *titles), rows))


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
