"""Synthesize a match: files in, a folder out (docs/match/match.md).

    result = synthesize_match(MatchRequest(tracking=Path("match.dat"), library=Path("clips"), out=Path("out"),
    end=60.0))

Read -> find who is present when -> solve the ball -> labels -> separate tracks -> workers search windows of all players
-> join them into edit lists -> resolve collisions -> place the ball where it is touched -> reports. However a run ends,
the same request resumes where it was, with the same bits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..ball.tracked.solve import SolvedBall, solve_ball
from ..base.errors import BeyondMocapError, Cancelled, InputError
from ..files.event_data import MatchEvents
from ..files.events import read_events
from ..files.tables import write_ball
from ..files.tracking.tracking import read_match
from ..files.whole import atomic_write
from ..library.build import build
from ..library.library import Library
from ..motion.track.ball_path import BallPath
from ..motion.track.match_data import Match
from .folder import check_folder, file_names, opened, read_state
from .match_ball import ball_plan, course, met
from .order import MatchOrder, identity
from .parts import check_texts, parts_of, strange_texts, unused_lines
from .pieces import stages
from .pieces.pool import Workplace, check_place, ended
from .pieces.work import LibrarySource, hold
from .report.pictures import thumbnails
from .roles import absent_lines, pushed_apart, roles_of, span_of
from .state import begun, now, row_of
from .words import MatchWords, words_of

AROUND = 5.0
"""s before and after the span in which the ball is solved too."""

_SHARES = {"read": 0.02, "library": 0.07, "ball": 0.12, "search": 0.7, "crowd": 0.8, "figures": 0.98, "page": 1.0}
"""Progress at the end of each stage."""

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class MadePlayer:
    """How a player ended.

    Attributes:
        id: of the player.
        reason: why they could not be synthesized, "" if they were.
    """

    id: str
    reason: str = ""


@dataclass(frozen=True, kw_only=True)
class MatchResult:
    """The result of a match.

    Attributes:
        request: what was requested.
        span: (start, end) s.
        finished: players that were synthesized.
        failed: players that were not.
        notes: messages for people.
    """

    order: MatchOrder
    span: tuple[float, float]
    done: tuple[MadePlayer, ...]
    failed: tuple[MadePlayer, ...]
    notes: tuple[str, ...]


def make_match(
    order: MatchOrder, progress: Progress | None = None, cancelled: Callable[[], bool] | None = None
) -> MatchResult:
    """Synthesize whatever of a request is not in its folder yet.

    A player who fails does not stop the others; match.json and the result give the reason. After a cancellation or an
    error the next run resumes from what is done.

    Args:
        request: the request.
        progress: receives the share done and a text.
        cancelled: called now and then; True cancels the work.
    Returns:
        The result.
    Raises:
        InputError: if the request, its files or its cluster are wrong.
        Cancelled: if `cancelled` returns True.
    """
    from threadpoolctl import threadpool_limits

    report = progress or (lambda fraction, text: None)
    check_folder(order.out)
    check_texts(order.annotations)
    place = Workplace(order.workers, order.scheduler)
    check_place(place)
    clock = now()
    report(0.0, f"Reading {order.tracking.name}")
    match = read_match(order.tracking, order.meta, order.provider or None)
    span = span_of(match, order)
    events = None if order.events is None else read_events(order.events, order.events_meta,
                                                           order.events_provider or None, match)
    read = now()
    library, source = _library(order, _part(report, "library"), cancelled)
    known = identity(order, source.key)
    with opened(order.out, known) as folder:
        state = begun(folder, order, known, match, span)
        state.told["notes"] += folder.notes
        state.seconds["read"] = round(read[0] - clock[0], 3)
        state.took("library", read)
        job = stages.Job(order=order, folder=folder, state=state, source=source, library=library, place=place,
                         report=report, cancelled=cancelled)
        try:
            with threadpool_limits(limits=1):  # more threads would change the order of sums
                _make(job, match, events, span, report)
        except BeyondMocapError as error:
            if state.players:  # otherwise no work has started
                state.tell(status="cancelled" if isinstance(error, Cancelled) else "failed", reason=str(error))
            raise
        finally:
            if not order.scheduler:
                ended()
    return result_of(order)


def _library(order: MatchOrder, report: Progress, cancelled) -> tuple[Library, LibrarySource]:
    """Build the library, with everything it derives stored beside its cache, and the source by which workers find
    it.
    """
    library = build(order.library, cache_dir=order.cache, skeleton=order.skeleton, unit=order.unit, seed=order.seed,
                    progress=report, cancelled=cancelled)
    library.extended  # computed once, here, instead of by every worker  # noqa: B018
    source = LibrarySource(order.library, order.cache, skeleton=order.skeleton, unit=order.unit, seed=order.seed,
                           key=library.kept[1])
    hold(source, library)
    return library, source


def _make(
    job: stages.Job, match: Match, events: MatchEvents | None, span: tuple[float, float], report: Progress
) -> None:
    """Run all stages after reading."""
    state, begin = job.state, now()
    roles = roles_of(match, job.order, span)
    state.told["notes"] += absent_lines(job.order, roles, span)
    solved = _solved(job, match, span, _part(report, "ball"))
    state.took("ball", begin)
    clock = now()
    words = _words(job, match, events, solved)
    inside = (match.times >= span[0] - 1e-6) & (match.times <= span[1] + 1e-6)
    touches = {player: [one.time for one in moments if one.end is None] for player, moments in words.players.items()}
    roles, state.told["spacing"] = pushed_apart(roles, match.times[inside], touches)
    names = file_names(player.id for player in match.players)
    parts = parts_of(roles, names, words, solved=solved, order=job.order, folder=job.folder,
                     known_words=job.library.words)
    told = job.folder.before.get("players", ())
    finished = {row["id"]: row["finished"] for row in told if isinstance(row.get("finished"), str)}
    state.players = {part.role.player.id: row_of(part, finished.get(part.role.player.id)) for part in parts}
    state.told["notes"] += strange_texts(job.order.annotations, names.values())
    state.told["notes"] += unused_lines(parts, job.order, names)
    state.took("words", clock)
    state.write()
    clock = now()
    edits = stages.search(replace(job, report=_part(report, "search")), parts)
    state.took("search", clock)
    clock = now()
    crowd = stages.keep_apart(replace(job, report=_part(report, "crowd")), edits, span) if edits else {}
    ball = _ball(job, match, solved, span, crowd)
    state.took("crowd", clock)
    clock = now()
    stages.finish(replace(job, report=_part(report, "figures")), parts, edits, crowd, ball)
    state.took("figures", clock)
    state.took("total", begin)
    _close(job, crowd)


def _solved(job: stages.Job, match: Match, span: tuple[float, float], report: Progress) -> SolvedBall | None:
    """Solve the ball around the span; None if it is not requested or not possible."""
    if not job.order.solve_touches:
        return None
    try:
        return solve_ball(match, report, job.cancelled, span[0] - AROUND, span[1] + AROUND)
    except InputError as error:
        job.state.told["notes"].append(f"the ball cannot be solved: {error}")
        return None


def _words(job: stages.Job, match: Match, events: MatchEvents | None, solved: SolvedBall | None) -> MatchWords:
    """Label all players from touches and, if there are any, events."""
    told = job.state.told
    if events is not None and solved is None:
        told["notes"].append(f"{job.order.events}: ignored, because without ball touches its clock is unknown")
    words = words_of(match, solved, events)
    told["notes"] += words.notes
    told["events"] = dict(words.figures) or None
    return words


def _ball(job: stages.Job, match: Match, solved: SolvedBall | None, span, crowd) -> BallPath:
    """Write the match's ball over the span, if it is known at all, and return it."""
    fps = job.order.fps
    first, last = int(np.ceil(span[0] * fps - 1e-6)), int(np.floor(span[1] * fps + 1e-6))
    times = np.arange(first, last + 1) / fps
    plan = ball_plan(match, solved, span[0], span[1], fps)
    if plan is None:
        return BallPath(times, np.full((len(times), 3), np.nan), np.zeros(len(times), bool))
    ball = met(course(plan, times), first, ((part.led_frames, part.led) for part in crowd.values()))
    path = job.folder.path / "ball.csv"
    write_ball(path, ball)
    job.state.told["ball"] = {
        "file": path.name, "touches": len(solved.touches) if solved else 0, "measured_share": ball.measured.mean(),
        "notes": list(solved.notes) if solved else [],
    }  # fmt: skip
    return ball


def _close(job: stages.Job, crowd) -> None:
    """Write the final state and the page."""
    state = job.state
    state.told["crowd"] = {
        "overlap_before_m": max((part.before for part in crowd.values()), default=0.0),
        "overlap_m": max((float(part.depth.max(initial=0.0)) for part in crowd.values()), default=0.0),
        "players_corrected": sum(bool(len(part.correction.knots)) for part in crowd.values()),
    }  # fmt: skip
    made = len(state.players) - len(state.failed)
    state.tell(status="failed" if not made else "partial" if state.failed else "done")
    if job.order.figures:
        from .report.page import page

        path = job.folder.path
        atomic_write(path / "report.html", page(path, thumbnails(job.library, path)))


def result_of(order: MatchOrder) -> MatchResult:
    """Read the result of a request that has been run.

    Args:
        request: the request.
    Returns:
        The result.
    Raises:
        InputError: as for `folder.read_state`.
    """
    told = read_state(order.out)
    made = {status: tuple(MadePlayer(row["id"], row.get("reason", "")) for row in told["players"]
                          if row["status"] == status) for status in ("done", "failed")}  # fmt: skip
    notes = tuple(dict.fromkeys((*told["data"], *told["notes"])))
    return MatchResult(order=order, span=(told["from_s"], told["to_s"]), done=made["done"], failed=made["failed"],
                       notes=notes)


def _part(report: Progress, stage: str) -> Progress:
    """Scale the progress of one stage to its part of the whole."""
    names = list(_SHARES)
    low, high = _SHARES[names[names.index(stage) - 1]] if stage != names[0] else 0.0, _SHARES[stage]
    return lambda fraction, text: report(low + (high - low) * fraction, text)
