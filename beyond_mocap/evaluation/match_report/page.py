"""The report over a whole match as one page for a browser: it loads nothing and runs nothing, and all names are
escaped."""

from __future__ import annotations

import base64
import math
from collections.abc import Callable, Mapping
from html import escape
from pathlib import Path

import numpy as np

from ...errors import told_time
from .results import LONGEST, MatchResults, PlayerResult, read_match_results
from .strips import heat_strip, png
from .tables import own_warnings, shared_warnings, team_table
from .worst import LIMITS, WorstSecond, badness, worst_seconds

Thumbnail = Callable[[str, float], "np.ndarray | None"]
"""Player's id and second on the match clock -> his picture as `motion.picture.pose_picture` draws it, or None."""

_AROUND = 15.0  # seconds before and after a bad second that are shown beside it
_TITLES = {"root_error_m": "off the track", "skate_cm_s": "feet that stand slide", "overlap_m": "bodies in each other"}
_TOLD = {
    "root_error_m": ("{:.1f} cm off the track", 100.0), "skate_cm_s": ("standing feet slide at {:.1f} cm/s", 1.0),
    "overlap_m": ("{:.1f} cm deep in another body", 100.0), "ball_m": ("ball {:.1f} m away", 1.0),
}
_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #222; background: #fff; max-width: 1320px; margin: 1.5em auto;
  padding: 0 1em }
h1 { font-size: 1.5em; margin-bottom: 0 } h2 { font-size: 1.15em; margin: 1.6em 0 .4em } p { margin: .3em 0 }
.quiet { color: #666; font-weight: normal } code { font-size: 12px; color: #555; overflow-wrap: anywhere }
table { border-collapse: collapse; font-size: 14px } tr { border-bottom: 1px solid #eee } tr.sum { background: #f7f7f7 }
th, td { padding: .18em .7em .18em 0; text-align: left; vertical-align: top }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap }
td.name { min-width: 11em; max-width: 16em; overflow-wrap: anywhere }
.scroll { overflow-x: auto } .met { color: #23703a } .missed { color: #b3261e; font-weight: 600 }
.strip { display: block; width: 260px; height: 16px; image-rendering: pixelated; border-radius: 2px; margin-top: 2px }
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
    """The page, as text, of what 'beyond-mocap match' wrote into `folder`; players that failed or are not yet done are
    marked. thumbnail: draws a player in a second, for the worst of them; without it they have no picture.

    InputError where match.json is missing or cannot be read.
    """
    match = read_match_results(Path(folder))
    anchors = {player.id: f"player-{number}" for number, player in enumerate(match.players, 1)}
    worst, span = worst_seconds(match.players), _span(match)
    everybody = shared_warnings(match.players)
    parts = [_head(match, span), _worst(match, worst, anchors, thumbnail), *_teams(match, span, anchors, everybody)]
    parts += [_lines("The data", (*match.lines, *everybody)), _took(match)]
    parts.append(_players(match, worst, span, anchors, everybody))
    title = escape(match.title)
    head = (f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
            f'<meta name="viewport" content="width=device-width"><style>{_STYLE}</style></head>\n')  # fmt: skip
    return head + "<body>\n" + "\n".join(part for part in parts if part) + "\n</body></html>\n"


def _span(match: MatchResults) -> tuple[float, float]:
    """First and last second that the page shows: what was asked for, else what there is; LONGEST at most."""
    known = [one for one in match.players if one.per_second]
    first, last = match.start, match.end
    if not math.isfinite(first):
        first = min((one.start for one in known), default=0.0)
    if not math.isfinite(last):
        last = max((one.start + len(badness(one)) for one in known), default=first + 1.0)
    return first, min(max(last, first + 1.0), first + LONGEST)


def _head(match: MatchResults, span: tuple[float, float]) -> str:
    made, missing = sum(one.made for one in match.players), [one for one in match.players if not one.made]
    rate = f", {match.fps:g} frames a second" if math.isfinite(match.fps) else ""
    parts = [f"<h1>{escape(match.title)}</h1>", f"<p class=quiet>{_clock(span[0])} to {_clock(span[1])} on the match "
             f"clock{rate}; {made} of {len(match.players)} players made</p>"]  # fmt: skip
    if missing:
        names = ", ".join(escape(one.called) for one in missing)
        parts.append(f"<p class=missed>Partial: {len(missing)} not made: {names}</p>")
    elif match.status and match.status != "done":
        parts.append(f"<p class=missed>Partial: {escape(match.status)}</p>")
    return "\n".join(parts)


def _worst(match: MatchResults, worst: tuple[WorstSecond, ...], anchors: Mapping[str, str], thumbnail) -> str:
    if not any(player.per_second for player in match.players):
        return "<h2>Worst seconds</h2><p class=quiet>No report tells figures by the second.</p>"
    track, overlap = 100 * LIMITS["root_error_m"], 100 * LIMITS["overlap_m"]
    limits = (f"beyond {track:g} cm off the track, {LIMITS['skate_cm_s']:g} cm/s of a standing foot, or {overlap:g} cm "
              "of two bodies in each other")  # fmt: skip
    if not worst:
        return f"<h2>Worst seconds</h2><p class=met>No second is {limits}.</p>"
    lines = [_worst_line(match, place, one, anchors, thumbnail) for place, one in enumerate(worst, 1)]
    return f"<h2>Worst seconds</h2><p class=quiet>Seconds {limits}.</p>\n" + "\n".join(lines)


def _worst_line(match: MatchResults, place: int, one: WorstSecond, anchors: Mapping[str, str], thumbnail) -> str:
    pose = thumbnail(one.player.id, one.time + 0.5) if thumbnail is not None else None
    picture = _pose(one.player, pose) if pose is not None else ""
    strip = _strip(one.player, (one.time - _AROUND, one.time + _AROUND + 1.0), "wide")
    other = f" (in {_linked(one.other, anchors)})" if one.other is not None else ""
    told = "; ".join(_figures_at(one))
    when = f"<b>{_clock(one.time)}</b>{_frame(match, one.time)}"
    return (f'<div class=worst id="{_moment_anchor(one, anchors)}"><b>{place}</b>{picture}<div>'
            f"<p>{_linked(one.player, anchors)}{other}, {when}: {escape(told)}</p>{strip}"
            f"<p class=quiet>{one.times:.1f} times the limit; {_AROUND:g} s before and after. In Blender: "
            f"<code>{_go_to(one)}</code></p></div></div>")  # fmt: skip


def _figures_at(one: WorstSecond) -> list[str]:
    """What is wrong in this second, the worst figure first, and how far the ball is."""
    row = round(one.time - one.player.start)
    values = {figure: column[row] for figure, column in one.player.per_second.items() if np.isfinite(column[row])}
    wrong = [figure for figure in values if figure not in LIMITS or values[figure] > LIMITS[figure]]
    order = sorted(wrong, key=lambda figure: figure != one.figure)
    return [_TOLD[figure][0].format(_TOLD[figure][1] * values[figure]) for figure in order]


def _teams(match: MatchResults, span: tuple[float, float], anchors, everybody: tuple[str, ...]) -> list[str]:
    strips = {player.id: _strip(player, span) for player in match.players}
    parts = []
    for team in match.teams:
        own = [player for player in match.players if player.team == team.name]
        dot = f'<span class=dot style="background:{team.colour}"></span>' if team.colour else ""
        if own:
            table = team_table(own, strips, anchors, everybody)
            parts.append(f"<h2>{dot}{escape(team.name or 'No team')}</h2>\n{table}")
    return [*parts, _legend()] if parts else []


def _legend() -> str:
    return ("<p class=quiet>Strips: the worst figure of every second; green far below its limit, amber at it, red "
            "beyond, grey where the player has no motion. Green and red figures: target met or not.</p>")  # fmt: skip


def _players(match: MatchResults, worst: tuple[WorstSecond, ...], span, anchors, everybody: tuple[str, ...]) -> str:
    parts = ["<h2>Every player</h2>"] if match.players else []
    for player in match.players:
        lines = [f"<p class=missed>{escape(player.status)}{escape(': ' + player.reason if player.reason else '')}</p>"
                 ] if not player.made else []  # fmt: skip
        for figure, limit in LIMITS.items():
            if figure in player.per_second:
                bad = player.per_second[figure] / limit
                strip = _image(heat_strip(bad, player.start, span), "wide")
                lines.append(f"<p class=quiet>{_TITLES[figure]}</p>{strip}")
        own = [one for one in worst if one.player is player]
        lines += [f'<p><a href="#{_moment_anchor(one, anchors)}">{_clock(one.time)}: one of the worst seconds</a></p>'
                  for one in own]  # fmt: skip
        lines.append(_lines("", own_warnings(player, everybody) + player.data))
        parts.append(f'<details id="{anchors[player.id]}"{" open" if own else ""}><summary>{escape(player.called)} '
                     f"<span class=quiet>{escape(player.team)}</span></summary>{''.join(lines)}</details>")  # fmt: skip
    return "\n".join(parts)


def _lines(title: str, lines: tuple[str, ...]) -> str:
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    head = f"<h2>{escape(title)}</h2>" if title else ""
    return f"{head}<ul>{items}</ul>" if lines else ""


def _took(match: MatchResults) -> str:
    rows = "".join(f"<tr><td>{escape(stage)}<td class=n>{spent:.1f} s" for stage, spent in match.seconds.items())
    return f"<h2>Where the time went</h2><table>{rows}</table>" if rows else ""


def _strip(player: PlayerResult, span: tuple[float, float], look: str = "") -> str:
    bad = badness(player)
    if not len(bad):
        return "<span class=quiet>nothing by the second</span>"
    return _image(heat_strip(bad, player.start, span), look)


def _image(data: bytes, look: str) -> str:
    return f'<img class="strip {look}" alt="worst figure of every second" src="{_source(data)}">'


def _source(data: bytes) -> str:
    return f'data:image/png;base64,{base64.b64encode(data).decode("ascii")}'


def _pose(player: PlayerResult, pose: np.ndarray) -> str:
    """A picture of `motion.picture`, whose lowest row is the first."""
    data = png(np.rint(255.0 * np.clip(pose[::-1], 0.0, 1.0)).astype(np.uint8))
    return f'<img class=pose alt="{escape(player.called)}" src="{_source(data)}">'


def _linked(player: PlayerResult, anchors: Mapping[str, str]) -> str:
    return f'<a href="#{anchors[player.id]}">{escape(player.called)}</a>'


def _moment_anchor(one: WorstSecond, anchors: Mapping[str, str]) -> str:
    return f"{anchors[one.player.id]}-second-{one.time:.0f}"


def _frame(match: MatchResults, time: float) -> str:
    """Which frame of the span it is, counted from the first on the clock's grid, as in ball.csv; nothing where rate or
    beginning are not known."""
    if not math.isfinite(match.start * match.fps):
        return ""
    first = math.ceil(match.start * match.fps - 1e-6)
    return f", frame {max(math.ceil(time * match.fps - 1e-6) - first, 0)}"


def _go_to(one: WorstSecond) -> str:
    return escape(f"bpy.ops.beyond_mocap.match_second(seconds={told_time(one.time)}, player={one.player.id!r})")


def _clock(seconds: float) -> str:
    """Seconds as the page says them: 754 s (12:34)."""
    return f"{told_time(seconds)} s ({int(seconds // 60)}:{int(seconds % 60):02d})"
