"""What each player is requested to do: labels from touches, events or texts, and a plan for every stretch of a
player.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path

from ..annotation import Timeline, format_timeline
from ..ball.tracked.solve import SolvedBall
from ..base.errors import InputError, describe_no_folder, format_seconds
from ..library.library import Library
from ..synthesis.heading_path import HeadingPath
from ..synthesis.heading_request import Play
from ..synthesis.known_body import cut_bodies
from ..synthesis.plan import Plan, SolvedTrajectory
from ..synthesis.resolved_touches import build_trajectory, sample_solved_ball
from .folder import MatchFolder
from .known_bodies import SeenBodies, SeenPlayer
from .labels import MatchLabels
from .moments import USER, Moment, build_timeline, is_edited, read_labels, write_labels
from .player_edit import to_stored_plan
from .request import MatchRequest
from .roles import Role

PlanHeadings = Callable[[Sequence[Sequence[tuple[Plan, Play | None]]]], Iterable["Sequence[HeadingPath] | str"]]
"""Returns, for the plans of each player with what they face beside the ball, their headings or why there are none."""


@dataclass(frozen=True, eq=False)
class PlayerPlans:
    """A role with its plans.

    Attributes:
        role: the player and their tracks.
        file: base name of the player's files.
        plans: one per stretch, as stored in files; () if the player cannot be synthesized (`role.reason`).
        unused: the user's labels for times at which the player is absent.
        overruled: the user's labels for times at which joints show the player.
    """

    role: Role
    file: str
    plans: tuple[Plan, ...] = ()
    unused: tuple[Moment, ...] = ()
    overruled: tuple[Moment, ...] = ()


def build_player_plans(
    roles: tuple[Role, ...], files: Mapping[str, str], labels: MatchLabels, solved: SolvedBall | None,
    request: MatchRequest, folder: MatchFolder, library: Library, plays: Mapping[str, Play],
    bodies: SeenBodies | None = None, *, plan_headings: PlanHeadings,
) -> list[PlayerPlans]:
    """Build the plans of all players.

    Labels are read from the texts of `request.annotations`, else from edited texts in the folder; else they are the
    automatic ones, which are written there. An error in a plan is the reason why this player fails.

    Args:
        roles: the players.
        files: base name of files by id.
        labels: automatic labels.
        solved: the solved ball, None if it is not solved.
        request: the request.
        folder: the match's folder.
        library: the clips; its labels are known beyond the vocabulary.
        plays: what players face beside the ball, by id.
        bodies: what cameras have seen of players, None for nothing.
        plan_headings: plans the headings of all players.
    Returns:
        One entry per role.
    Raises:
        InputError: for a mistake in a player's text, before anything is searched.
    """
    out, seen = [], bodies.players if bodies else {}
    sample = lru_cache(maxsize=1)(sample_solved_ball)  # most players are present for the same time
    build_course = None if solved is None else partial(build_trajectory, solved, sample=sample)
    present = {files[role.player.id]: labels.players.get(role.player.id, ()) for role in roles if not role.reason}
    own = {file: read_labels(text, automatic, library.labels) for file, automatic in present.items()
           if (text := _find_own_text(file, request, folder)) is not None}
    for role in roles:
        file = files[role.player.id]
        moments = () if role.reason else own[file] if file in own else _write_automatic(file, role, labels, folder)
        try:
            plans = tuple(_add_bodies(_build_plan(role, number, moments, request, build_course),
                                      seen.get(role.player.id)) for number in range(len(role.target_tracks)))
            typed = [one for one in moments if one.source == USER]
            unused = tuple(one for one in typed if not _overlaps(one, _list_present_times(role)))
            overruled = tuple(one for one in typed if _overlaps(one, _list_shown_times(plans)))
            out.append(PlayerPlans(role, file, () if role.reason else plans, unused, overruled))
        except InputError as error:
            out.append(PlayerPlans(replace(role, reason=str(error)), file))
    return _add_headings(out, plan_headings([[(plan, plays.get(part.role.player.id)) for plan in part.plans]
                                             for part in out]))


def _add_headings(parts: Sequence[PlayerPlans], found: Iterable[Sequence[HeadingPath] | str]) -> list[PlayerPlans]:
    """Add the headings of each player's plans, or why they cannot be planned, which is why this player fails."""
    return [PlayerPlans(replace(part.role, reason=paths), part.file) if isinstance(paths, str)
            else replace(part, plans=tuple(replace(plan, heading_path=path) for plan, path in zip(part.plans, paths)))
            for part, paths in zip(parts, found)]


def check_label_folder(annotations: Path | None) -> None:
    """Check that the folder with the user's labels exists, if one is named; InputError otherwise."""
    if annotations is not None and not annotations.is_dir():
        raise InputError(annotations, describe_no_folder(annotations), "a folder with a text ID.txt for players",
                         "check the path")


def list_unknown_texts(annotations: Path | None, files: Iterable[str]) -> list[str]:
    """List a message for each of the user's texts that belongs to no player. files: base names of all players'
    files.
    """
    known = {f"{file}.txt" for file in files}
    texts = [] if annotations is None else sorted(annotations.glob("*.txt"))
    return [f"{text}: ignored, because no player of the match has this id" for text in texts if text.name not in known]


def list_unused_labels(parts: Iterable[PlayerPlans], request: MatchRequest, files: Mapping[str, str]) -> list[str]:
    """List messages about labels that are not used.

    Args:
        parts: the players' plans.
        request: the request.
        files: base name of files by id.
    Returns:
        One line per player with labels for times at which they are absent, and one for texts of players who are absent
        altogether.
    """
    out, present = [], {part.role.player.id for part in parts}
    absent_files = [] if request.players else [file for player, file in files.items() if player not in present]
    idle = [f"{file}.txt" for file in absent_files if _find_text(request.annotations, file) is not None]
    if idle:
        subject = "the player is" if len(idle) == 1 else "the players are"
        out.append(f"{', '.join(idle)}: ignored, because {subject} absent in that time")
    for part in parts:
        if part.unused:
            first = format_timeline(build_timeline(part.unused[:1])).strip()
            found = f"{_count_lines(part.unused)} ignored ({first}{' ...' * (len(part.unused) > 1)})"
            out.append(f"{part.file}.txt: {found}, because {part.role.player.id} is present from "
                       f"{_format_times(_list_present_times(part.role))}")
    return out


def list_overruled_labels(parts: Iterable[PlayerPlans]) -> list[str]:
    """List a message for each player with labels for times at which joints say what the body does."""
    return [f"{part.file}.txt: {_count_lines(part.overruled)} shown as the joints have it, not as the label says, "
            f"where joints show the player: from {_format_times(_list_shown_times(part.plans))}"
            for part in parts if part.overruled]


def _count_lines(moments: Sequence[Moment]) -> str:
    return f"{len(moments)} of your lines {'is' if len(moments) == 1 else 'are'}"


def _format_times(edges: Iterable[tuple[float, float]]) -> str:
    return ", ".join(f"{format_seconds(start)} to {format_seconds(end)} s" for start, end in edges)


def _list_present_times(role: Role) -> list[tuple[float, float]]:
    """List first and last seconds of a player's stretches."""
    return [(float(track.times[0]), float(track.times[-1])) for track in role.target_tracks]


def _list_shown_times(plans: Iterable[Plan]) -> list[tuple[float, float]]:
    """List first and last seconds, to the hundredth, of the bodies of some plans."""
    return [(round(body.start, 2), round(body.end, 2)) for plan in plans for body in plan.bodies]


def _overlaps(moment: Moment, edges: Iterable[tuple[float, float]]) -> bool:
    """Say whether any time between edges contains the moment, or a part of it."""
    cut = (build_timeline([moment], start, end) for start, end in edges)
    return any(one.spans or one.keys for one in cut)


def _find_own_text(file: str, request: MatchRequest, folder: MatchFolder) -> Path | None:
    """Find the text with the user's labels of a player: theirs, or an edited one in the folder; None without any."""
    text = _find_text(request.annotations, file)
    edited = folder.labels_path(file)
    return text or (edited if is_edited(edited) else None)


def _write_automatic(file: str, role: Role, labels: MatchLabels, folder: MatchFolder) -> tuple[Moment, ...]:
    """Write a player's automatic moments into the folder, and return them."""
    automatic, text = labels.players.get(role.player.id, ()), folder.labels_path(file)
    text.parent.mkdir(exist_ok=True)
    write_labels(text, role.player.id, automatic)
    return automatic


def _find_text(annotations: Path | None, file: str) -> Path | None:
    """Find the user's text for a player; None if there is none."""
    text = None if annotations is None else annotations / f"{file}.txt"
    return text if text is not None and text.is_file() else None


def _build_plan(role: Role, number: int, moments, request: MatchRequest,
                build_course: Callable[[str, Plan], SolvedTrajectory] | None) -> Plan:
    """Build the plan of one stretch, as stored in files."""
    track = role.target_tracks[number]
    start, end = float(track.times[0]), float(track.times[-1])
    timeline: Timeline = build_timeline(moments, start, end)
    plan = Plan(
        track=track, timeline=timeline, library=str(request.library), nearest=request.nearest,
        seed=request.seed + role.number, fps=request.fps, solve_touches=build_course is not None,
        variety=request.variety, lag=role.lag, manner=role.number, watch=request.watch, strength=request.strength,
        masses=request.masses, fatigue=request.fatigue,
    )
    return to_stored_plan(plan if build_course is None
                          else replace(plan, solved=build_course(role.player.id, plan)))


def _add_bodies(plan: Plan, seen: SeenPlayer | None) -> Plan:
    """Add what cameras have seen in the time of a plan, and how tall the player is."""
    if seen is None:
        return plan
    bodies = cut_bodies(seen.bodies, float(plan.track.times[0]), float(plan.track.times[-1]))
    return replace(plan, bodies=bodies, height=seen.height)
