"""The report over a whole match as one page for a browser: it loads nothing and runs nothing, and all names are
escaped.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.errors import told_time
from ...evaluation.html_page import (
    Html,
    build_image,
    build_list,
    build_number_cell,
    build_page,
    build_row,
    build_section,
    build_table,
    build_title,
    element,
    fragment,
)
from ...evaluation.report import flat
from ...synthesis.quality.targets import target_of
from .pictures import heat_strip, png
from .results import (
    LIMITS,
    LONGEST,
    MatchResults,
    PlayerResult,
    WorstSecond,
    badness,
    number,
    read_match_results,
    worst_seconds,
)

Thumbnail = Callable[[str, float], "np.ndarray | None"]
"""Player's id and second on the match clock -> picture as of `appearance.picture.pose_picture`, or None."""

_AROUND = 15.0  # s before and after a bad second, shown in its strip
_TITLES = {"root_error_m": "off the track", "skate_cm_s": "feet in contact slide", "overlap_m": "bodies overlap"}
_TOLD = {
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


def page(folder: Path, thumbnail: Thumbnail | None = None) -> str:
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
    worst, span = worst_seconds(match.players), _span(match)
    everybody = shared_warnings(match.players)
    data = build_list((*match.lines, *everybody))
    return build_page(
        match.title, _head(match, span), _worst(match, worst, anchors, thumbnail),
        *_teams(match, span, anchors, everybody), build_section("The data", data) if data else "", _took(match),
        _players(match, worst, span, anchors, everybody), style=_STYLE,
    )  # fmt: skip


def _span(match: MatchResults) -> tuple[float, float]:
    """Choose the first and last second of the page: those requested, else those available; LONGEST at most."""
    known = [one for one in match.players if one.per_second]
    first, last = match.start, match.end
    if not math.isfinite(first):
        first = min((one.start for one in known), default=0.0)
    if not math.isfinite(last):
        last = max((one.start + len(badness(one)) for one in known), default=first + 1.0)
    return first, min(max(last, first + 1.0), first + LONGEST)


def _head(match: MatchResults, span: tuple[float, float]) -> Html:
    """Build the title and the summary of who is finished."""
    made, missing = sum(one.made for one in match.players), [one for one in match.players if not one.made]
    rate = f", {match.fps:g} frames a second" if math.isfinite(match.fps) else ""
    told = (f"{_clock(span[0])} to {_clock(span[1])} on the match clock{rate}; {made} of {len(match.players)} "
            "players finished")  # fmt: skip
    parts = [element("h1", match.title), element("p", told, class_="quiet")]
    if missing:
        names = ", ".join(one.called for one in missing)
        parts.append(element("p", f"Partial: {len(missing)} not finished: {names}", class_="missed"))
    elif match.status and match.status != "done":
        parts.append(element("p", f"Partial: {match.status}", class_="missed"))
    return fragment(*parts, between="\n")


def _worst(match: MatchResults, worst: tuple[WorstSecond, ...], anchors: Mapping[str, str], thumbnail) -> Html:
    """Build the section with the worst seconds."""
    title = "Worst seconds"
    if not any(player.per_second for player in match.players):
        return build_section(title, element("p", "No report has figures by the second.", class_="quiet"))
    track, overlap = 100 * LIMITS["root_error_m"], 100 * LIMITS["overlap_m"]
    limits = (f"beyond {track:g} cm off the track, {LIMITS['skate_cm_s']:g} cm/s of foot sliding, or {overlap:g} cm "
              "of overlap of two bodies")  # fmt: skip
    if not worst:
        return build_section(title, element("p", f"No second is {limits}.", class_="met"))
    lines = [_worst_line(match, place, one, anchors, thumbnail) for place, one in enumerate(worst, 1)]
    return build_section(title, element("p", f"Seconds {limits}.", class_="quiet"), *lines)


def _worst_line(match: MatchResults, place: int, one: WorstSecond, anchors: Mapping[str, str], thumbnail) -> Html:
    """Build one line of the worst seconds, with picture, figures and strip."""
    pose = thumbnail(one.player.id, one.time + 0.5) if thumbnail is not None else None
    strip = _strip(one.player, (one.time - _AROUND, one.time + _AROUND + 1.0), "wide")
    other = (" (in ", _linked(one.other, anchors), ")") if one.other is not None else ()
    who = (_linked(one.player, anchors), *other, ", ", element("b", _clock(one.time)), _frame(match, one.time))
    limit = f"{one.times:.1f} times the limit; {_AROUND:g} s before and after. In Blender: "
    return element(
        "div", element("b", str(place)), _pose(one.player, pose) if pose is not None else "",
        element("div", element("p", *who, ": ", "; ".join(_figures_at(one))), strip,
                element("p", limit, element("code", _go_to(one)), class_="quiet")),
        class_="worst", id=_moment_anchor(one, anchors),
    )  # fmt: skip


def _figures_at(one: WorstSecond) -> list[str]:
    """Describe what is wrong in this second, the worst figure first, and how far away the ball is."""
    row = round(one.time - one.player.start)
    values = {figure: column[row] for figure, column in one.player.per_second.items() if np.isfinite(column[row])}
    wrong = [figure for figure in values if figure not in LIMITS or values[figure] > LIMITS[figure]]
    order = sorted(wrong, key=lambda figure: figure != one.figure)
    return [_TOLD[figure][0].format(_TOLD[figure][1] * values[figure]) for figure in order]


def _teams(match: MatchResults, span: tuple[float, float], anchors, everybody: tuple[str, ...]) -> list[Html]:
    """Build a table of players per team."""
    strips = {player.id: _strip(player, span) for player in match.players}
    parts = []
    for team in match.teams:
        own = [player for player in match.players if player.team == team.name]
        dot = element("span", class_="dot", style=f"background:{team.colour}") if team.colour else ""
        if own:
            table = team_table(own, strips, anchors, everybody)
            parts.append(build_section(fragment(dot, team.name or "No team"), table))
    told = ("Strips: the worst figure of every second; green far below its limit, amber at it, red beyond, grey where "
            "the player has no motion. Green and red figures: target met or not.")  # fmt: skip
    return [*parts, element("p", told, class_="quiet")] if parts else []


def _players(match: MatchResults, worst: tuple[WorstSecond, ...], span, anchors, everybody: tuple[str, ...]) -> Html:
    """Build the details of every player."""
    parts = []
    for player in match.players:
        reason = f": {player.reason}" if player.reason else ""
        lines = [] if player.made else [element("p", f"{player.status}{reason}", class_="missed")]
        for figure, limit in LIMITS.items():
            if figure in player.per_second:
                bad = player.per_second[figure] / limit
                strip = _image(heat_strip(bad, player.start, span), "wide")
                lines += [element("p", _TITLES[figure], class_="quiet"), strip]
        own = [one for one in worst if one.player is player]
        for one in own:
            anchor, told = f"#{_moment_anchor(one, anchors)}", f"{_clock(one.time)}: one of the worst seconds"
            lines.append(element("p", element("a", told, href=anchor)))
        lines.append(build_list(own_warnings(player, everybody) + player.data))
        name = element("summary", player.called, " ", element("span", player.team, class_="quiet"))
        parts.append(element("details", name, *lines, id=anchors[player.id], open=bool(own)))
    return build_section("Every player", *parts) if parts else Html()


def _took(match: MatchResults) -> Html:
    rows = [build_row(stage, element("td", f"{spent:.1f} s", class_="n")) for stage, spent in match.seconds.items()]
    return build_section("Where the time went", build_table((), rows)) if rows else Html()


def _strip(player: PlayerResult, span: tuple[float, float], look: str = "") -> Html:
    bad = badness(player)
    if not len(bad):
        return element("span", "nothing by the second", class_="quiet")
    return _image(heat_strip(bad, player.start, span), look)


def _image(data: bytes, look: str) -> Html:
    return build_image(data, "worst figure of every second", f"strip {look}".strip())


def _pose(player: PlayerResult, pose: np.ndarray) -> Html:
    """Build the image of a picture of `appearance.picture`, whose lowest row is the first."""
    return build_image(png(np.rint(255.0 * np.clip(pose[::-1], 0.0, 1.0)).astype(np.uint8)), player.called, "pose")


def _linked(player: PlayerResult, anchors: Mapping[str, str]) -> Html:
    return element("a", player.called, href=f"#{anchors[player.id]}")


def _moment_anchor(one: WorstSecond, anchors: Mapping[str, str]) -> str:
    return f"{anchors[one.player.id]}-second-{one.time:.0f}"


def _frame(match: MatchResults, time: float) -> str:
    """Describe the frame of the span, counted from the first on the clock's grid as in ball.csv; "" if unknown."""
    if not math.isfinite(match.start * match.fps):
        return ""
    first = math.ceil(match.start * match.fps - 1e-6)
    return f", frame {max(math.ceil(time * match.fps - 1e-6) - first, 0)}"


def _go_to(one: WorstSecond) -> str:
    return f"bpy.ops.beyond_mocap.match_second(seconds={told_time(one.time)}, player={one.player.id!r})"


def _clock(seconds: float) -> str:
    """Format seconds for the page: 754 s (12:34)."""
    return f"{told_time(seconds)} s ({int(seconds // 60)}:{int(seconds % 60):02d})"


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
_OVERLAP = 0.02  # m of overlap of two bodies that is accepted


def shared_warnings(players: Sequence[PlayerResult]) -> tuple[str, ...]:
    """Find the warnings that all reports share: they are about the library, not a player; none for a single player."""
    told = [own_warnings(player, ()) for player in players if player.report]
    return tuple(line for line in told[0] if all(line in other for other in told)) if len(told) > 1 else ()


def own_warnings(player: PlayerResult, everybody: tuple[str, ...]) -> tuple[str, ...]:
    """Select a player's warnings, each once, without those in `shared`."""
    lines = dict.fromkeys(map(str, player.report.get("warnings") or ()))
    return tuple(line for line in lines if line not in everybody)


def team_table(
    players: Sequence[PlayerResult], strips: Mapping[str, Html], anchors: Mapping[str, str], everybody: tuple[str, ...]
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
    rows = [_row(player, element("td", strips[player.id]), anchors[player.id], everybody) for player in players]
    return build_table(head, [*rows, *_summary(players, everybody)])


def _row(player: PlayerResult, strip: Html, anchor: str, everybody: tuple[str, ...]) -> Html:
    """Build a player's row; without a report, only status and strip."""
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
    """Build the rows with mean and maximum over all players with a report; none for a single one."""
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
    """Find a figure; overlap from the seconds if the report has it only there."""
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
