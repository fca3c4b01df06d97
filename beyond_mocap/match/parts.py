"""What each player is requested to do: labels from touches, events or texts, and a plan for every stretch of a
player.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from ..annotation import Timeline, format_timeline
from ..ball.tracked.solve import SolvedBall
from ..base.errors import InputError, told_time
from ..synthesis.known_touches import course_of
from ..synthesis.plan import Plan
from .folder import MatchFolder
from .order import MatchOrder
from .player_edit import kept
from .roles import Role
from .words import USER, MatchWords, Moment, edited, read_words, timeline_of, write_words


@dataclass(frozen=True, eq=False)
class Part:
    """A role with its plans.

    Attributes:
        role: the player and their tracks.
        file: base name of the player's files.
        plans: one per stretch, as stored in files; () if the player cannot be synthesized (`role.reason`).
        unused: the user's labels for times at which the player is absent.
    """

    role: Role
    file: str
    plans: tuple[Plan, ...] = ()
    unused: tuple[Moment, ...] = ()


def parts_of(
    roles: tuple[Role, ...], files: Mapping[str, str], words: MatchWords, solved: SolvedBall | None,
    order: MatchOrder, folder: MatchFolder, known_words: frozenset[str],
) -> list[Part]:
    """Build the plans of all players.

    Labels are read from the texts of `request.annotations`, else from edited texts in the folder; else they are the
    automatic ones, which are written there. An error in a player's text is the reason why this player fails.

    Args:
        roles: the players.
        files: base name of files by id.
        labels: automatic labels.
        solved: the solved ball, None if it is not solved.
        request: the request.
        folder: the match's folder.
        known_labels: labels beyond the vocabulary.
    Returns:
        One entry per role.
    """
    out = []
    for role in roles:
        file = files[role.player.id]
        try:
            moments = () if role.reason else _moments(file, role, words, order=order, folder=folder,
                                                      known_words=known_words)
            plans = tuple(_plan(role, number, moments, solved, order) for number in range(len(role.asked)))
            unused = tuple(one for one in moments if one.source == USER and not _is_used(one, role))
            out.append(Part(role, file, () if role.reason else plans, unused))
        except InputError as error:
            out.append(Part(replace(role, reason=str(error)), file))
    return out


def check_texts(annotations: Path | None) -> None:
    """Check that the folder with the user's labels exists, if one is named; InputError otherwise."""
    if annotations is not None and not annotations.is_dir():
        found = "is a file" if annotations.exists() else "no such folder"
        raise InputError(annotations, found, "a folder with a text ID.txt for players", "check the path")


def strange_texts(annotations: Path | None, files: Iterable[str]) -> list[str]:
    """List a message for each of the user's texts that belongs to no player. files: base names of all players'
    files.
    """
    known = {f"{file}.txt" for file in files}
    texts = [] if annotations is None else sorted(annotations.glob("*.txt"))
    return [f"{text}: ignored, because no player of the match has this id" for text in texts if text.name not in known]


def unused_lines(parts: Iterable[Part], order: MatchOrder, files: Mapping[str, str]) -> list[str]:
    """List messages about labels that are not used.

    Args:
        parts: the players' plans.
        request: the request.
        files: base name of files by id.
    Returns:
        One line per player with labels for times at which they are absent, and one for texts of players who are absent
        altogether.
    """
    out, there = [], {part.role.player.id for part in parts}
    away = [] if order.players else [file for player, file in files.items() if player not in there]
    idle = [f"{file}.txt" for file in away if _own_text(order.annotations, file) is not None]
    if idle:
        who = "the player is" if len(idle) == 1 else "the players are"
        out.append(f"{', '.join(idle)}: ignored, because {who} absent in that time")
    for part in parts:
        if part.unused:
            first = format_timeline(timeline_of(part.unused[:1])).strip()
            edges = [(track.times[0], track.times[-1]) for track in part.role.asked]
            times = ", ".join(f"{told_time(start)} to {told_time(end)} s" for start, end in edges)
            count = len(part.unused)
            found = f"{count} of your lines {'is' if count == 1 else 'are'} ignored ({first}{' ...' * (count > 1)})"
            out.append(f"{part.file}.txt: {found}, because {part.role.player.id} is present from {times}")
    return out


def _is_used(moment: Moment, role: Role) -> bool:
    """Say whether any of the player's stretches contains the moment, or a part of it."""
    cut = (timeline_of([moment], float(track.times[0]), float(track.times[-1])) for track in role.asked)
    return any(one.spans or one.keys for one in cut)


def _moments(
    file: str, role: Role, words: MatchWords, order: MatchOrder, folder: MatchFolder, known_words: frozenset[str]
) -> tuple[Moment, ...]:
    """Read a player's moments from their text, or write the automatic ones and return them."""
    automatic = words.players.get(role.player.id, ())
    text = _own_text(order.annotations, file)
    if text is None:
        text = folder.words_of(file)
        if not edited(text):
            text.parent.mkdir(exist_ok=True)
            write_words(text, role.player.id, automatic)
            return automatic
    return read_words(text, automatic, known_words)


def _own_text(annotations: Path | None, file: str) -> Path | None:
    """Find the user's text for a player; None if there is none."""
    text = None if annotations is None else annotations / f"{file}.txt"
    return text if text is not None and text.is_file() else None


def _plan(role: Role, number: int, moments, solved: SolvedBall | None, order: MatchOrder) -> Plan:
    """Build the plan of one stretch, as stored in files."""
    track = role.asked[number]
    start, end = float(track.times[0]), float(track.times[-1])
    timeline: Timeline = timeline_of(moments, start, end)
    plan = Plan(
        track=track, timeline=timeline, library=str(order.library), nearest=order.nearest,
        seed=order.seed + role.number, fps=order.fps, solve_touches=solved is not None, variety=order.variety,
        lag=role.lag,
    )
    return kept(plan if solved is None else replace(plan, solved=course_of(solved, role.player.id, plan)))
