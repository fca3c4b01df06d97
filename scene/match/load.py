"""Load a section of a synthesized match for the scene, as plain values and arrays; in any thread, without bpy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...beyond_mocap.appearance.sports import FOOTBALL, load_sports
from ...beyond_mocap.base.errors import InputError, UserCancelledError, format_count, format_seconds
from ...beyond_mocap.base.fixes import Fix
from ...beyond_mocap.motion.motion import Motion
from ...beyond_mocap.motion.track.ball_path import BallPath

if TYPE_CHECKING:
    from ...beyond_mocap.library.library import Library
    from ...beyond_mocap.synthesis.take import Take

LIBRARY_SHARE = 0.1  # share of the progress bar
TEAMS = ("home", "away", "referee")
_MAKE_AGAIN = "press Make Match, which uses the nearest labels"


@dataclass(frozen=True, eq=False)
class Character:
    """A player or referee.

    Attributes:
        id: as in the feed.
        name: of the player.
        number: of the shirt, -1 if there is none.
        team: one of TEAMS.
        keeper: True for a goalkeeper.
        motions: (s on the match's clock, motion) for every stretch on the pitch, in order.
        takes: the takes of these stretches, with foot contacts and ball; none where they are not known.
    """

    id: str
    name: str
    number: int
    team: str
    keeper: bool
    motions: tuple[tuple[float, Motion], ...]
    takes: tuple["Take", ...] = ()


@dataclass(frozen=True, eq=False)
class MatchSection:
    """A section of a match.

    Attributes:
        start: s on the match's clock.
        end: s on the match's clock.
        length: m of the pitch.
        width: m of the pitch.
        colours: "#RRGGBB" of shirts by team.
        characters: players and referees who are present.
        ball: where it is known, else None.
        sport: whose pitch it is.
        quality: how many targets the players meet, "" where no player has a report.
    """

    start: float
    end: float
    length: float
    width: float
    colours: dict[str, str]
    characters: tuple[Character, ...]
    ball: BallPath | None
    sport: str = FOOTBALL
    quality: str = ""


@dataclass(frozen=True)
class DisplayRequest:
    """What to display.

    Attributes:
        folder: of the match.
        start: s on its clock.
        end: s on its clock, 0 for its end.
        players: ids, () for all.
        colours: "#RRGGBB" of shirts by team.
        library: folder of the library.
        unit: metres per unit of the library.
        build: how the library is built.
    """

    folder: str
    start: float
    end: float
    players: tuple[str, ...]
    colours: dict[str, str]
    library: str
    unit: float | None
    build: dict = field(default_factory=dict)


def load_section(request: DisplayRequest, library: "Library | None", progress: Callable[[float, str], None],
                 cancelled: Callable[[], bool]) -> tuple["Library", MatchSection, tuple[str, ...]]:
    """Load a section of a match.

    Args:
        request: what to display.
        library: the clips; None: build the library.
        progress: receives the share done and a text.
        cancelled: called now and then; True cancels the work.
    Returns:
        The library, the section, and messages about players who cannot be displayed.
    Raises:
        InputError: if the folder holds no match, no player is present in that time, or the library is a different one.
        UserCancelledError: if `cancelled` returns True.
    """
    from ...beyond_mocap.files.tables import read_ball
    from ...beyond_mocap.library.build import build_library

    state = _read_state(request.folder)
    if library is None:
        library = build_library(request.library, unit=request.unit, **request.build, cancelled=cancelled,
                                progress=lambda done, text: progress(LIBRARY_SHARE * done, text))
    start, end = _resolve_span(request, state)
    ball_file = Path(request.folder) / "ball.csv"
    ball = read_ball(ball_file) if ball_file.is_file() else None
    characters, lines = _construct_characters(request, state, library, ball=ball, span=(start, end), progress=progress,
                                              cancelled=cancelled)
    if not characters:
        found = f"no player is present from {format_seconds(start)} to {format_seconds(end)} s"
        raise InputError(request.folder, found, "a time of play", *lines[:1])
    length, width = map(float, state["pitch_m"])
    section = MatchSection(start, end, length, width=width, colours=request.colours, characters=tuple(characters),
                           ball=_cut_ball(ball, start, end), sport=_find_sport(state),
                           quality=_describe_quality(request.folder, characters))
    return library, section, tuple(lines)


def _read_state(folder: str) -> dict:
    """Read match.json; InputError if something needed here is missing."""
    from ...beyond_mocap.match.folder import STATE, read_state

    state = read_state(folder)
    size = state.get("pitch_m") if isinstance(state.get("pitch_m"), list) else []
    numbers = [state.get("from_s"), state.get("to_s"), *size]
    known = len(numbers) == 4 and all(isinstance(number, (int, float)) for number in numbers)
    if not known or not all("file" in player for player in state["players"]):
        raise InputError(Path(folder) / STATE, "times, pitch or a player's file are missing", "the state of a match",
                         "choose another folder for the match")
    return state


def _describe_quality(folder: str, characters: list[Character]) -> str:
    """Describe how many of their targets the characters meet, by their reports of the whole match."""
    from ...beyond_mocap.evaluation.report import judge_figures
    from ...beyond_mocap.match.report.results import read_match_results, select_figures

    shown, found = {person.id for person in characters}, []
    for player in read_match_results(Path(folder)).players:
        met = [row.status == "met" for row in judge_figures(select_figures(player.report)) if row.status]
        if player.id in shown and met:
            found.append((np.mean(met), player.display_name, met))
    if not found:
        return ""
    share, (least, worst, _) = np.mean(sum((met for *_, met in found), [])), min(found)
    count = format_count(len(found), "player")
    if len(found) < len(characters):
        count = f"{len(found)} of {format_count(len(characters), 'player')}, the others have no figures"
    text = f"{100.0 * share:.0f} % of the targets met by {count}"
    return f"{text}; fewest by {worst} ({100.0 * least:.0f} %)" if len(found) > 1 else text


def _find_sport(state: dict) -> str:
    """Return the sport of a match; football for one of an earlier version, or of a sport that is not known."""
    order = state.get("order")
    sport = order.get("sport") if isinstance(order, dict) else None
    return sport if isinstance(sport, str) and sport in load_sports() else FOOTBALL


def _resolve_span(request: DisplayRequest, state: dict) -> tuple[float, float]:
    """Resolve the requested span (start, end) s within the match."""
    first, last = float(state["from_s"]), float(state["to_s"])
    start, end = max(request.start, first), min(request.end or last, last)
    if end - start < 0.2:
        found = f"{format_seconds(request.start)} to {format_seconds(request.end)} s"
        expected = f"a time within {format_seconds(first)} to {format_seconds(last)} s"
        raise InputError(request.folder, found, expected, "press Make Match for another time",
                         fixes=(Fix("press", "beyond_mocap.make_match"),))
    return start, end


def _construct_characters(request, state, library, ball, span, progress, cancelled) -> tuple[list[Character],
        list[str]]:
    """Construct all players who are present and finished; return them and messages about the others."""
    from ...beyond_mocap.match.displayed_motion import construct_displayed_player
    from ...beyond_mocap.match.player_file import read_player
    from ...beyond_mocap.match.state import ALLOW_NEAREST

    characters, lines, last_error = [], [], None
    selected = [player for player in state["players"] if not request.players or player["id"] in request.players]
    for number, player in enumerate(selected):
        if cancelled():
            raise UserCancelledError("cancelled")
        progress(LIBRARY_SHARE + (1.0 - LIBRARY_SHARE) * number / len(selected), f"constructing {player['id']}")
        if player.get("status") != "done":
            reason = str(player.get("reason") or player.get("status")).replace(ALLOW_NEAREST, _MAKE_AGAIN)
            lines.append(f"{player['id']} is not finished: {reason}")
            continue
        try:
            takes = construct_displayed_player(library,
                                               read_player(Path(request.folder) / f"{player['file']}.take.npz"), ball,
                                               *span)
        except InputError as error:  # this player's file, or the library, which then fails for all
            last_error = error
            lines.append(f"{player['id']} cannot be shown: {error}")
            continue
        if takes:
            characters.append(_build_character(player, takes))
    if last_error is not None and not characters:
        raise last_error
    return characters, lines


def _build_character(player: dict, takes: tuple["Take", ...]) -> Character:
    number = int(player.get("number", -1))
    team = player.get("team") if player.get("team") in TEAMS else "home"
    position = str(player.get("position") or "")
    keeper = "keeper" in position.lower() or (not position and number == 1)
    return Character(player["id"], str(player.get("name") or ""), number, team=team, keeper=keeper,
                     motions=tuple((take.start_time, take.motion) for take in takes), takes=tuple(takes))


def _cut_ball(ball: "BallPath | None", start: float, end: float) -> "BallPath | None":
    """Cut the ball to `start` .. `end` s, with gaps interpolated linearly; None if it is not known anywhere."""
    if ball is None:
        return None
    inside = (ball.times >= start - 1e-6) & (ball.times <= end + 1e-6)
    known = inside & np.isfinite(ball.positions).all(axis=1)
    if np.count_nonzero(known) < 2:
        return None
    part = slice(*(np.flatnonzero(known)[[0, -1]] + [0, 1]))
    times = ball.times[part]
    columns = [np.interp(times, ball.times[known], ball.positions[known, axis]) for axis in range(3)]
    return replace(ball, times=times, positions=np.stack(columns, axis=1), measured=ball.measured[part])
