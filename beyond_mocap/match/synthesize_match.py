"""Synthesize a match: files in, a folder out (docs/reference/match-folder.md).

    result = synthesize_match(MatchRequest(tracking=Path("match.dat"), library=Path("clips"), out=Path("out"),
    end=60.0))

Read -> find who is present when -> solve the ball -> labels -> separate tracks -> workers search windows of all players
-> join them into edit lists -> construct -> resolve collisions -> place the ball where it is touched -> reports.
However a run ends, the same request resumes where it was, with the same bits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from ..appearance.sports import FOOTBALL, load_sports
from ..ball.tracked.solve import SolvedBall, solve_ball
from ..base.errors import BeyondMocapError, InputError, UserCancelledError
from ..base.memory import check_memory
from ..files.atomic import atomic_write
from ..files.event_data import MatchEvents
from ..files.events import read_events
from ..files.file_names import build_file_names
from ..files.joints.joint_feed import JointFeed
from ..files.tables import write_ball
from ..library.build import build_library
from ..library.library import Library
from ..motion.track.ball_path import BallPath
from ..motion.track.match_data import Match
from ..synthesis.one_thread import limit_to_one_thread
from .folder import check_folder, open_folder, read_state
from .goalkeeping.positions import fill_keepers
from .known_bodies import SeenBodies, build_known_bodies, follow_bodies, read_tracked
from .labels import MatchLabels, label_match
from .match_ball import apply_led_ball, build_ball_plan, sample_ball
from .pieces import stages
from .pieces.constructed_motion import ConstructedMotion
from .pieces.job import Job
from .pieces.pool import WorkerConfig, check_workers, stop_workers
from .pieces.preparation import Preparation
from .pieces.tasks import LibrarySource, set_library
from .play import build_plays, find_kept_lines
from .player_plans import (
    PlayerPlans,
    build_player_plans,
    check_label_folder,
    list_overruled_labels,
    list_unknown_texts,
    list_unused_labels,
)
from .report.pictures import build_thumbnail_renderer
from .request import MatchRequest, build_identity
from .roles import Role, build_roles, list_absent_players, resolve_span, separate_roles
from .seen_touches import name_seen_touches
from .state import MatchState, build_player_row, build_state, read_clocks

_PLAYER_BYTES, _WORKER_BYTES, _FIGURE_BYTES, _LONGEST_STRETCH = 8e3, 0.4e9, 0.12e6, 3000.0
"""Bytes of the main process for each second of a player; of a worker; and of a worker for each second of the longest
stretch, a half, whose figures it measures. Fitted to the halves and matches of docs/explanation/limits.md, rather below
than above: not all are needed at the same time."""

BALL_MARGIN = 5.0
"""s before and after the span in which the ball is solved too."""

_OTHER_SIZE = 2.0  # ratio of a side of the pitch to the regular one from which a message is given

_STAGE_ENDS = {"read": 0.02, "library": 0.07, "ball": 0.12, "search": 0.55, "motion": 0.8, "crowd": 0.85,
               "figures": 0.98, "page": 1.0}
"""Progress at the end of each stage."""

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class PlayerStatus:
    """How a player ended.

    Attributes:
        id: of the player.
        reason: why they could not be synthesized, "" if they were.
        exit_status: of a command that fails so.
    """

    id: str
    reason: str = ""
    exit_status: int = BeyondMocapError.exit_status


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

    request: MatchRequest
    span: tuple[float, float]
    finished: tuple[PlayerStatus, ...]
    failed: tuple[PlayerStatus, ...]
    notes: tuple[str, ...]


def synthesize_match(
    request: MatchRequest, progress: Progress | None = None, cancelled: Callable[[], bool] | None = None
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
        UserCancelledError: if `cancelled` returns True.
    """
    report = progress or (lambda fraction, text: None)
    check_folder(request.out)
    check_label_folder(request.annotations)
    place = WorkerConfig(request.workers, request.scheduler)
    check_workers(place)
    clock = read_clocks()
    report(0.0, f"Reading {request.tracking.name}")
    match, feed = read_tracked(request)
    span = resolve_span(match, request)
    _check_memory(request, len(request.players or match.players), span)
    events = None if request.events is None else read_events(request.events, request.events_meta,
                                                             request.events_provider or None, match)
    read = read_clocks()
    library, source = _build_library(request, _scale_progress(report, "library"), cancelled)
    identity_values = build_identity(request, source.key)
    with open_folder(request.out, identity_values) as folder:
        state = build_state(folder, request, identity_values, match, span)
        state.report["notes"] += folder.notes
        state.seconds["read"] = round(read[0] - clock[0], 3)
        state.record_stage("library", read)
        job = Job(request=request, folder=folder, state=state, source=source, library=library, workers=place,
                         report=report, cancelled=cancelled)
        try:
            with limit_to_one_thread():
                _run_stages(job, (match, feed), events, span)
        except BeyondMocapError as error:
            if state.players:  # otherwise no work has started
                state.update_report(status="cancelled" if isinstance(error, UserCancelledError) else "failed",
                                    reason=str(error))
            raise
        finally:
            if not request.scheduler:
                stop_workers()
    return read_result(request)


def _check_memory(request: MatchRequest, players: int, span: tuple[float, float]) -> None:
    """Check that the memory for the players of a span, (first, last) s, is free; InputError where it is not."""
    seconds = span[1] - span[0]
    worker = _WORKER_BYTES + (_FIGURE_BYTES * min(seconds, _LONGEST_STRETCH) if request.figures else 0.0)
    needed = _PLAYER_BYTES * players * seconds + worker * (0 if request.scheduler else request.workers)
    check_memory(request.tracking, needed, "use fewer workers, or a shorter part of the match")


def _build_library(request: MatchRequest, report: Progress, cancelled) -> tuple[Library, LibrarySource]:
    """Build the library, with everything it derives stored beside its cache, and the source by which workers find
    it.
    """
    library = build_library(request.library, cache_dir=request.cache, skeleton=request.skeleton, unit=request.unit,
                            seed=request.seed, progress=report, cancelled=cancelled)
    library.with_synthetic_clips  # computed once, here, instead of by every worker  # noqa: B018
    source = LibrarySource(request.library, request.cache, skeleton=request.skeleton, unit=request.unit,
                           seed=request.seed, key=library.cache_location[1])
    set_library(source, library)
    return library, source


def _run_stages(job: Job, tracked: tuple[Match, JointFeed | None], events: MatchEvents | None,
                span: tuple[float, float]) -> None:
    """Run all stages after reading."""
    state, begin, preparation = job.state, read_clocks(), Preparation(job, span)
    with _record_stage(state, "ball"):
        people = _find_people(job, *tracked, span)
    with _record_stage(state, "words"):
        parts = _plan_players(job, people, events, span, preparation)
    state.write_state()
    with _record_stage(state, "search"):
        edits = stages.search_players(_scale_job(job, "search"), parts)
    with _record_stage(state, "crowd"):
        motion = ConstructedMotion(_scale_job(job, "motion"), edits)
        crowd = stages.resolve_player_collisions(_scale_job(job, "crowd"), motion, span) if edits else {}
        ball = _write_match_ball(job, people.match, people.solved, span, crowd)
    with _record_stage(state, "figures"):
        stages.finish_players(_scale_job(job, "figures"), parts, motion, crowd, ball)
    state.record_stage("total", begin)
    _finish_match(job, crowd, motion)


@contextmanager
def _record_stage(state: MatchState, stage: str) -> Iterator[None]:
    """Record how long a stage takes, once it is finished."""
    clock = read_clocks()
    yield
    state.record_stage(stage, clock)


@dataclass(frozen=True, eq=False, kw_only=True)
class _People:
    """Who is where in a match, and where the ball is.

    Attributes:
        match: the tracks, those of players who were seen as bodies among them.
        bodies: bodies that were seen.
        roles: the players' roles, goalkeepers filled in.
        solved: the solved ball, None where it is not solved.
        sides: index of a touch -> side that was seen.
    """

    match: Match
    bodies: SeenBodies
    roles: tuple[Role, ...]
    solved: SolvedBall | None
    sides: Mapping[int, str]


def _find_people(job: Job, match: Match, feed: JointFeed | None, span: tuple[float, float]) -> _People:
    """Find who is where and solve the ball; notes go to the job's report."""
    notes = job.state.report["notes"]
    if job.request.pitch not in (None, (match.length, match.width)):
        notes.append(f"the tracking data has its own pitch, {match.length:g} x {match.width:g} m: the requested size "
                     "is not used")
    notes += _check_sport(match, job.request.sport)
    bodies = build_known_bodies(feed, match, job.request, job.library, span)
    notes += bodies.notes
    match = follow_bodies(match, bodies)
    present, filled = fill_keepers(match, find_kept_lines(match)) if job.request.sport == FOOTBALL else (match, ())
    notes += filled
    roles = build_roles(present, job.request, span)
    notes += list_absent_players(job.request, roles, span)
    solved = _solve_ball(job, match, span, _scale_progress(job.report, "ball"))
    solved, sides = (solved, {}) if solved is None else name_seen_touches(solved, bodies, job.library)
    return _People(match=match, bodies=bodies, roles=roles, solved=solved, sides=sides)


def _plan_players(job: Job, people: _People, events: MatchEvents | None, span: tuple[float, float],
                  preparation: Preparation) -> list[PlayerPlans]:
    """Label all players, separate their tracks and build their plans; the state gets a row for each."""
    state, match = job.state, people.match
    words = _label_players(job, match, events, people.solved, people.sides)
    inside = (match.times >= span[0] - 1e-6) & (match.times <= span[1] + 1e-6)
    touches = {player: [one.time for one in moments if one.end is None and not one.misses_ball]
               for player, moments in words.players.items()}
    roles, state.report["spacing"] = separate_roles(people.roles, match.times[inside], touches,
                                                    preparation.solve_episodes)
    names = build_file_names(player.id for player in match.players)
    parts = build_player_plans(roles, names, words, solved=people.solved, request=job.request, folder=job.folder,
                               library=job.library, plays=build_plays(match), bodies=people.bodies,
                               plan_headings=preparation.plan_headings)
    rows = job.folder.previous_state.get("players", ())
    finished = {row["id"]: row["finished"] for row in rows if isinstance(row.get("finished"), str)}
    state.players = {part.role.player.id: build_player_row(part, finished.get(part.role.player.id)) for part in parts}
    for player, one in people.bodies.players.items():
        if player in state.players:
            state.players[player]["bodies"] = one.rows
    state.report["notes"] += list_unknown_texts(job.request.annotations, names.values())
    state.report["notes"] += list_unused_labels(parts, job.request, names) + list_overruled_labels(parts)
    return parts


def _check_sport(match: Match, sport: str) -> list[str]:
    """Return a message where the pitch is not of a size that the sport has."""
    regular = load_sports()[sport].size
    if all(1.0 / _OTHER_SIZE < side / usual < _OTHER_SIZE for side, usual in zip((match.length, match.width), regular)):
        return []
    return [f"the pitch of {match.length:g} x {match.width:g} m is not of the size of {sport.replace('_', ' ')}, "
            f"{regular[0]:g} x {regular[1]:g} m: check the sport"]


def _solve_ball(job: Job, match: Match, span: tuple[float, float], report: Progress) -> SolvedBall | None:
    """Solve the ball around the span; None if it is not requested or not possible."""
    if not job.request.solve_touches:
        return None
    if not np.isfinite(match.ball[:, :2]).any():
        job.state.report["notes"].append("without a ball in the tracking data, players run, and your labels say what "
                                         "else they do")
        return None
    if job.request.sport != FOOTBALL:
        job.state.report["notes"].append("touches of the ball are found in football only: it stays as tracked")
        return None
    try:
        return solve_ball(match, report, job.cancelled, span[0] - BALL_MARGIN, span[1] + BALL_MARGIN)
    except InputError as error:
        job.state.report["notes"].append(f"the ball cannot be solved: {error}")
        return None


def _label_players(job: Job, match: Match, events: MatchEvents | None, solved: SolvedBall | None,
                   sides: Mapping[int, str]) -> MatchLabels:
    """Label all players from touches, their sides where these were seen, and, if there are any, events."""
    report = job.state.report
    if events is not None and solved is None:
        report["notes"].append(f"{job.request.events}: ignored, because without ball touches its clock is unknown")
    labels = label_match(match, solved, events, sides=sides)
    report["notes"] += labels.notes
    report["events"] = dict(labels.figures) or None
    return labels


def _write_match_ball(job: Job, match: Match, solved: SolvedBall | None, span, crowd) -> BallPath:
    """Write the match's ball over the span, if it is known at all, and return it."""
    fps = job.request.fps
    first, last = int(np.ceil(span[0] * fps - 1e-6)), int(np.floor(span[1] * fps + 1e-6))
    times = np.arange(first, last + 1) / fps
    plan = build_ball_plan(match, solved, span[0], span[1], fps)
    if plan is None:
        return BallPath(times, np.full((len(times), 3), np.nan), np.zeros(len(times), bool))
    ball = apply_led_ball(sample_ball(plan, times), first, ((part.led_frames, part.led) for part in crowd.values()))
    path = job.folder.path / "ball.csv"
    write_ball(path, ball)
    job.state.report["ball"] = {
        "file": path.name, "touches": len(solved.touches) if solved else 0, "measured_share": ball.measured.mean(),
        "notes": list(solved.notes) if solved else [],
    }  # fmt: skip
    return ball


def _finish_match(job: Job, crowd, motion: ConstructedMotion) -> None:
    """Write the final state and the page, then remove the stored motion."""
    state = job.state
    state.report["crowd"] = {
        "overlap_before_m": max((part.before for part in crowd.values()), default=0.0),
        "overlap_m": max((float(part.depth.max(initial=0.0)) for part in crowd.values()), default=0.0),
        "players_corrected": sum(bool(len(part.correction.knots)) for part in crowd.values()),
    }  # fmt: skip
    finished = len(state.players) - len(state.failed_rows)
    state.update_report(status="failed" if not finished else "partial" if state.failed_rows else "done")
    if job.request.figures:
        from .report.page import build_match_page

        path, clock = job.folder.path, read_clocks()
        thumbnail = build_thumbnail_renderer(job.library, path, motion.load_takes)
        atomic_write(path / "report.html", build_match_page(path, thumbnail))
        state.record_stage("page", clock)
        state.write_state()
    motion.remove()


def read_result(request: MatchRequest) -> MatchResult:
    """Read the result of a request that has been run.

    Args:
        request: the request.
    Returns:
        The result.
    Raises:
        InputError: as for `folder.read_state`.
    """
    state = read_state(request.out)
    players = {status: tuple(_read_status(row) for row in state["players"] if row["status"] == status)
               for status in ("done", "failed")}
    notes = tuple(dict.fromkeys((*state["data"], *state["notes"])))
    return MatchResult(request=request, span=(state["from_s"], state["to_s"]), finished=players["done"],
                       failed=players["failed"], notes=notes)


def _read_status(row: Mapping) -> PlayerStatus:
    return PlayerStatus(**{name: row[name] for name in ("id", "reason", "exit_status") if name in row})


def _scale_progress(report: Progress, stage: str) -> Progress:
    """Scale the progress of one stage to its part of the whole."""
    names = list(_STAGE_ENDS)
    low, high = _STAGE_ENDS[names[names.index(stage) - 1]] if stage != names[0] else 0.0, _STAGE_ENDS[stage]
    return lambda fraction, text: report(low + (high - low) * fraction, text)


def _scale_job(job: Job, stage: str) -> Job:
    """Return the job with the progress of one stage scaled to its part of the whole."""
    return replace(job, report=_scale_progress(job.report, stage))
