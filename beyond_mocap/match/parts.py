"""What everybody is asked to do: words from touches, events or texts, and the plan of every stretch of a player."""

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
    """A role with its orders. file: what the player's files are called; plans: one for each stretch, as files keep
    them; () where he cannot be made (`role.reason`). unused: the user's words for times at which he is not there."""

    role: Role
    file: str
    plans: tuple[Plan, ...] = ()
    unused: tuple[Moment, ...] = ()


def parts_of(
    roles: tuple[Role, ...], files: Mapping[str, str], words: MatchWords, solved: SolvedBall | None,
    order: MatchOrder, folder: MatchFolder, known_words: frozenset[str],
) -> list[Part]:
    """Everybody's orders. Words are read from the texts of `order.annotations`, else from those in the folder that have
    been edited, and else are the automatic ones, which are written there. What is wrong with a player's text is the
    reason why he is not made."""
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
    """InputError where the folder with the user's words is named and not there."""
    if annotations is not None and not annotations.is_dir():
        found = "is a file" if annotations.exists() else "no such folder"
        raise InputError(annotations, found, "a folder with a text ID.txt for players", "check the path")


def strange_texts(annotations: Path | None, files: Iterable[str]) -> list[str]:
    """A line for each text of the user's that is nobody's. files: what everybody's files are called."""
    known = {f"{file}.txt" for file in files}
    texts = [] if annotations is None else sorted(annotations.glob("*.txt"))
    return [f"{text}: not used, since nobody of the match is called so" for text in texts if text.name not in known]


def unused_lines(parts: Iterable[Part], order: MatchOrder, files: Mapping[str, str]) -> list[str]:
    """A line for each player whose text has words of the user's for times at which he is not there, and one for texts
    in `order.annotations` of players who are not there at all. files: id -> what the player's files are called."""
    out, there = [], {part.role.player.id for part in parts}
    away = [] if order.players else [file for player, file in files.items() if player not in there]
    idle = [f"{file}.txt" for file in away if _own_text(order.annotations, file) is not None]
    if idle:
        who = "he is" if len(idle) == 1 else "they are"
        out.append(f"{', '.join(idle)}: not used, since {who} not there in that time")
    for part in parts:
        if part.unused:
            first = format_timeline(timeline_of(part.unused[:1])).strip()
            edges = [(track.times[0], track.times[-1]) for track in part.role.asked]
            times = ", ".join(f"{told_time(start)} to {told_time(end)} s" for start, end in edges)
            count = len(part.unused)
            found = f"{count} of your lines {'is' if count == 1 else 'are'} not used ({first}{' ...' * (count > 1)})"
            out.append(f"{part.file}.txt: {found}, since {part.role.player.id} is there from {times}")
    return out


def _is_used(moment: Moment, role: Role) -> bool:
    """Whether any stretch of a player's has it, or a part of it."""
    cut = (timeline_of([moment], float(track.times[0]), float(track.times[-1])) for track in role.asked)
    return any(one.spans or one.keys for one in cut)


def _moments(
    file: str, role: Role, words: MatchWords, order: MatchOrder, folder: MatchFolder, known_words: frozenset[str]
) -> tuple[Moment, ...]:
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
    """The text that the user has for a player, None where he has none."""
    text = None if annotations is None else annotations / f"{file}.txt"
    return text if text is not None and text.is_file() else None


def _plan(role: Role, number: int, moments, solved: SolvedBall | None, order: MatchOrder) -> Plan:
    track = role.asked[number]
    start, end = float(track.times[0]), float(track.times[-1])
    timeline: Timeline = timeline_of(moments, start, end)
    plan = Plan(
        track=track, timeline=timeline, library=str(order.library), nearest=order.nearest,
        seed=order.seed + role.number, fps=order.fps, solve_touches=solved is not None, variety=order.variety,
        lag=role.lag,
    )
    return kept(plan if solved is None else replace(plan, solved=course_of(solved, role.player.id, plan)))
