"""A folder of a made match as what the scene shows of a stretch of it; in any thread, never touching bpy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...beyond_mocap.errors import Cancelled, InputError
from .people import TEAMS, Person, Scenery

if TYPE_CHECKING:
    from ...beyond_mocap.library.library import Library
    from ...beyond_mocap.take import BallPath

LIBRARYS_SHARE = 0.1  # of the bar


@dataclass(frozen=True)
class Wanted:
    """What is to be shown: the match's folder, seconds of its clock (end 0: to its end), players by id (empty:
    everybody), colours of the teams' shirts; the library's folder, its unit, and how it is built."""

    folder: str
    start: float
    end: float
    players: tuple[str, ...]
    colours: dict[str, str]
    library: str
    unit: float | None
    build: dict = field(default_factory=dict)


def scenery(
    wanted: Wanted, library: "Library | None", progress: Callable[[float, str], None], cancelled: Callable[[], bool]
) -> tuple["Library", Scenery, tuple[str, ...]]:
    """The library (built where it is None), everybody's motion, and lines about whoever cannot be shown.

    InputError where the folder holds no match, nobody of it is there in that time, or the library is another one.
    """
    from ...beyond_mocap.library.library import build
    from ...beyond_mocap.match.folder import read_state

    state = read_state(wanted.folder)
    if library is None:
        library = build(
            wanted.library, unit=wanted.unit, **wanted.build, cancelled=cancelled,
            progress=lambda done, text: progress(LIBRARYS_SHARE * done, text),
        )
    start, end = _span(wanted, state)
    people, lines = _people(wanted, state, library, start, end, progress, cancelled)
    if not people:
        raise InputError(wanted.folder, f"nobody is there from {start:g} to {end:g} s", "a time of play", *lines[:1])
    ball = _ball(Path(wanted.folder) / "ball.csv", start, end)
    length, width = map(float, state["pitch_m"])
    return library, Scenery(start, end, length, width, wanted.colours, tuple(people), ball), tuple(lines)


def _span(wanted: Wanted, state: dict) -> tuple[float, float]:
    first, last = float(state["from_s"]), float(state["to_s"])
    start, end = max(wanted.start, first), min(wanted.end or last, last)
    if end - start < 0.2:
        found, expected = f"{wanted.start:g} to {wanted.end:g} s", f"a time within {first:g} to {last:g} s"
        raise InputError(wanted.folder, found, expected, "press Make Match for another")
    return start, end


def _people(wanted, state, library, start, end, progress, cancelled) -> tuple[list[Person], list[str]]:
    """Everybody who is there and was made, and lines about the others."""
    from ...beyond_mocap.files.take_npz import read_player
    from ...beyond_mocap.match.shown import shown

    people, lines = [], []
    asked = [player for player in state["players"] if not wanted.players or player["id"] in wanted.players]
    for number, player in enumerate(asked):
        if cancelled():
            raise Cancelled("cancelled")
        progress(LIBRARYS_SHARE + (1.0 - LIBRARYS_SHARE) * number / len(asked), f"expanding {player['id']}")
        if player.get("status") != "done":
            lines.append(f"{player['id']} was not made: {player.get('reason') or player.get('status')}")
            continue
        edit = read_player(Path(wanted.folder) / f"{player['file']}.take.npz")
        takes = shown(library, edit, None, start, end)
        if takes:
            people.append(_person(player, tuple((take.start_time, take.motion) for take in takes)))
    return people, lines


def _person(player: dict, motions: tuple) -> Person:
    number = int(player.get("number", -1))
    team = player.get("team") if player.get("team") in TEAMS else "home"
    position = str(player.get("position") or "")
    keeper = "keeper" in position.lower() or (not position and number == 1)
    return Person(player["id"], str(player.get("name") or ""), number, team, keeper, motions)


def _ball(path: Path, start: float, end: float) -> "BallPath | None":
    """The ball of that time, gaps in it drawn straight; None where it is nowhere known."""
    from ...beyond_mocap.files.tables import number, read_rows
    from ...beyond_mocap.take import BallPath

    if not path.is_file():
        return None
    names = ("time_s", "x_m", "y_m", "z_m")
    rows = read_rows(path, names)
    cells = np.array([[number(row[name], name, place, blank=True) for name in names] for place, row in rows], float)
    cells = cells.reshape(-1, 4)
    inside = (cells[:, 0] >= start - 1e-6) & (cells[:, 0] <= end + 1e-6)
    known = np.isfinite(cells).all(axis=1) & inside
    if np.count_nonzero(known) < 2:
        return None
    first, last = np.flatnonzero(known)[[0, -1]]
    times = cells[first : last + 1, 0]
    places = np.stack([np.interp(times, cells[known, 0], cells[known, axis]) for axis in (1, 2, 3)], axis=1)
    return BallPath(times, places, known[first : last + 1])
