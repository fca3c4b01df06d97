"""The stages of a match that are distributed over workers: search, collision avoidance, figures.

Finished work is found by the digest of everything it depends on, so a run resumes where another ended, and after an
edit only affected pieces are computed again.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from ...annotation import Timeline
from ...base.errors import BeyondMocapError, format_seconds
from ...files.atomic import atomic_write
from ...files.tables import to_plain
from ...library.clip import Clip
from ...motion.track.ball_path import BallPath
from ..crowd.window import MARGIN_SECONDS, MAX_SECONDS, PlayerCorrection, cut_edit, join_windows, load_parts, save_parts
from ..player_edit import PlayerEdit
from ..player_file import write_player
from ..player_plans import PlayerPlans
from .constructed_motion import ConstructedMotion
from .job import Job, remove_library_paths, run_stage
from .motion_parts import MotionSpan
from .named_edit import ClipName
from .pool import TaskFailure
from .stored_piece import fits_window, list_library_clips, load_piece, save_piece
from .tasks import FinishRequest, finish_player, resolve_collision_window, search_unit
from .units import build_units
from .windows import Piece, join_pieces

SEARCH, CROWD = "search", "crowd"
"""The kinds of pieces that are stored, beside the constructed motion."""

_ALWAYS = -np.inf, np.inf


def search_players(job: Job, parts: Sequence[PlayerPlans]) -> dict[str, PlayerEdit]:
    """Search every player's edit list; each is written as soon as it is complete.

    Args:
        job: what all stages share.
        parts: the players' plans.
    Returns:
        Edit list by player id; failures are recorded in the state.
    """
    return _PlayerSearch(job, parts).search_missing()


class _PlayerSearch:
    """The windows of all players: those that are stored, and those that have to be searched."""

    def __init__(self, job: Job, parts: Sequence[PlayerPlans]):
        self._job, self._parts = job, {part.role.player.id: part for part in parts if part.plans}
        self._found: dict[str, list[Piece]] = {player: [] for player in self._parts}
        self._names: set[str] = set()
        self._edits: dict[str, PlayerEdit] = {}
        self._count = 0
        order = job.request
        for player, part in self._parts.items():
            plans = (replace(plan, timeline=Timeline(), solved=None, solve_touches=False) for plan in part.plans)
            units = sum(len(build_units(plan, 0, order.window, order.overlap)) for plan in plans)  # of the track
            job.state.players[player]["units"] = units
            self._count += units

    def search_missing(self) -> dict[str, PlayerEdit]:
        """Search what is missing, then return the edit lists by id."""
        job = self._job
        for (player, name), result in run_stage(job, self._iter_missing(), search_unit, SEARCH):
            if isinstance(result, TaskFailure):
                self._mark_failed(player, result)
                continue
            path = job.folder.piece_path(SEARCH, name)
            save_piece(path, result)
            self._add_piece(player, load_piece(path) or result)  # the stored form, as a later run reads it
        job.folder.remove_pieces(SEARCH, self._names)
        return {player: self._edits[player] for player in self._parts if player in self._edits}

    def _iter_missing(self) -> Iterator[tuple[tuple[str, str], tuple]]:
        """Iterate over the tasks that are not stored; add the stored pieces."""
        job = self._job
        for player, part in self._parts.items():
            for number, plan in enumerate(part.plans):
                for unit in build_units(plan, number, job.request.window, job.request.overlap):
                    if self._is_failed(player):
                        break
                    name = job.build_name(replace(unit, plan=replace(unit.plan, library="")))
                    self._names.add(name)
                    found = load_piece(job.folder.piece_path(SEARCH, name))
                    if found is not None and fits_window(found, unit, self._clips, job.library):
                        self._add_piece(player, found)
                    else:
                        yield (player, name), (job.source, unit)

    @cached_property
    def _clips(self) -> dict[ClipName, Clip]:
        return list_library_clips(self._job.library)

    def _add_piece(self, player: str, piece: Piece) -> None:
        """Add one window; the last one completes the player's edit list."""
        job, pieces = self._job, self._found[player]
        pieces.append(piece)
        if self._is_failed(player):
            return
        job.state.record_window(player)
        count = sum(map(len, self._found.values()))
        job.report(count / self._count, f"Searching: {count} of {self._count} windows")
        if len(pieces) == job.state.players[player]["units"]:
            try:
                edit, joints = join_pieces(job.library, self._parts[player].plans, pieces)
            except BeyondMocapError as error:
                return self._mark_failed(player, TaskFailure(str(error), error.exit_status))
            self._edits[player] = edit
            file = job.folder.player_path(self._parts[player].file, "take.npz")
            write_player(file, edit)
            agreed = sum(joint.agreed for joint in joints)
            job.state.update_player(player, status="searched", take=file.name, joints=[len(joints), agreed],
                                    search_s=round(sum(piece.seconds for piece in pieces), 3))  # fmt: skip

    def _mark_failed(self, player: str, failure: TaskFailure) -> None:
        if not self._is_failed(player):
            self._job.state.mark_failed(player, failure)

    def _is_failed(self, player: str) -> bool:
        return self._job.state.players[player]["status"] == "failed"


def resolve_player_collisions(job: Job, motion: ConstructedMotion, span: tuple[float, float]) -> dict[str,
        PlayerCorrection]:
    """Resolve the collisions of the whole span, in windows of all players on the match's clock.

    Args:
        job: what all stages share.
        motion: of all players; what is needed of it is constructed.
        span: (start, end) s.
    Returns:
        Correction by player id.
    """
    windows = _build_windows(span, min(job.request.window, MAX_SECONDS), job.request.fps)

    def find_file(number: int) -> Path:
        return job.folder.piece_path(CROWD, _name_window(job, motion.edits, *windows[number]))

    while True:
        # names take seconds: where nothing is stored they are built beside the workers' results
        players, is_stored = list(motion.edits), job.folder.has_pieces(CROWD)
        files = {number: find_file(number) for number in range(len(windows))} if is_stored else {}
        found = _load_windows(files, windows, job.request.fps, len(players))
        if motion.construct(_widen(*window) for number, window in enumerate(windows) if number not in found):
            break
    if not players:
        return {}
    tasks = ((number, (job.source, [motion.find_spans(player, *_widen(*window)) for player in players], *window))
             for number, window in enumerate(windows) if number not in found)
    for number, result in run_stage(job, tasks, resolve_collision_window, CROWD):
        files[number] = files.get(number) or find_file(number)
        if isinstance(result, TaskFailure):
            start, end = windows[number]
            when = f"{format_seconds(start)}-{format_seconds(end)} s"
            job.state.report["notes"].append(f"{when}: collisions are not resolved: {result.reason}")
            continue
        save_parts(files[number], result)
        found[number] = result
        job.report(len(found) / len(windows), f"Resolving collisions: {len(found)} of {len(windows)} windows")
    job.folder.remove_pieces(CROWD, (file.stem for file in files.values()))
    rows = [(found[number], windows[number]) for number in sorted(found)]
    return {player: join_windows([(parts[place], window) for parts, window in rows], job.request.fps)
            for place, player in enumerate(players)}  # fmt: skip


def _widen(start: float, end: float) -> tuple[float, float]:
    return start - MARGIN_SECONDS, end + MARGIN_SECONDS


def _name_window(job: Job, edits: dict[str, PlayerEdit], start: float, end: float) -> str:
    """Name a window by all that its result depends on."""
    cut = tuple(cut_edit(edit, *_widen(start, end)) for edit in edits.values())
    return job.build_name(start, end, remove_library_paths(cut))


def _load_windows(files: Mapping[int, Path], windows: Sequence[tuple[float, float]], fps: float,
                  count: int) -> dict[int, tuple[PlayerCorrection, ...]]:
    """Load the results of the windows that are stored, by number; count: of players."""
    loaded = ((number, load_parts(file, *windows[number], fps)) for number, file in files.items())
    return {number: parts for number, parts in loaded if parts is not None and len(parts) == count}


def _build_windows(span: tuple[float, float], window: float, fps: float) -> list[tuple[float, float]]:
    """Build the windows (start, end) s of the span, on frames and on the grid."""
    numbers = range(int(np.floor(span[0] / window)) + 1, int(np.ceil(span[1] / window)))
    edges = [span[0], *(number * window for number in numbers), span[1] + 1.0 / fps]
    return list(zip(edges, edges[1:]))


def finish_players(
    job: Job, parts: Sequence[PlayerPlans], motion: ConstructedMotion, crowd: dict[str, PlayerCorrection],
    ball: BallPath
) -> None:
    """Write all players' files: the corrected edit list and, where requested, report, provenance and BVH.

    Args:
        job: what all stages share.
        parts: the players' plans.
        motion: of all players; what is needed of it is constructed.
        crowd: correction by player id.
        ball: the match's ball.
    """
    request = job.request
    files = {part.role.player.id: _PlayerFiles(job, part, motion.edits[part.role.player.id],
                                               crowd[part.role.player.id], ball)
             for part in parts if part.role.player.id in motion.edits}
    missing = [player for player, one in files.items() if not one.are_finished()]
    for player in files.keys() - set(missing):
        files[player].write_edit()
    if request.figures or request.bvh:
        motion.construct([_ALWAYS], missing)

    def iter_tasks() -> Iterator[tuple[str, tuple]]:
        for player in missing:
            if player in motion.edits:
                files[player].write_edit()
                spans = motion.find_spans(player, *_ALWAYS) if request.figures or request.bvh else ()
                yield player, (job.source, files[player].build_request(spans))

    done = len(files) - len(missing)
    for player, result in run_stage(job, iter_tasks(), finish_player, "figures"):
        if isinstance(result, TaskFailure):
            job.state.mark_failed(player, result)
            continue
        row = files[player].write_result(result)
        done += 1
        job.report(done / len(files), f"Figures: {done} of {len(files)} players")
        job.state.update_player(player, status="done", **row)


@dataclass(frozen=True, eq=False)
class _PlayerFiles:
    """A player's files at the end of a match.

    Attributes:
        job: what all stages share.
        part: the player's plans.
        edit: the edit list, before it is corrected.
        found: the correction, with what remains of overlaps.
        ball: the match's ball.
    """

    job: Job
    part: PlayerPlans
    edit: PlayerEdit
    found: PlayerCorrection
    ball: BallPath

    def are_finished(self) -> bool:
        """Say whether an earlier run wrote the files; if so, record them again."""
        job, player = self.job, self.part.role.player.id
        endings = {"report": "report.json", "provenance": "provenance.csv"} if job.request.figures else {}
        endings |= {"bvh": "bvh"} if job.request.bvh else {}
        files = {kind: job.folder.player_path(self.part.file, ending) for kind, ending in endings.items()}
        finished = job.state.players[player].get("finished")
        if finished is None or not all(path.is_file() for path in files.values()) or finished != self._build_name():
            return False
        job.state.update_player(player, status="done", **{kind: path.name for kind, path in files.items()})
        return True

    def write_edit(self) -> None:
        """Write the corrected edit list."""
        write_player(self.job.folder.player_path(self.part.file, "take.npz"), self._apply_correction())

    def build_request(self, spans: tuple[MotionSpan, ...]) -> FinishRequest:
        """Build what a worker needs; spans: the player's motion, () where it is not needed."""
        request, found = self.job.request, self.found
        return FinishRequest(motion=spans, correction=found.correction, measured=self.part.role.measured,
                             ball=self.ball, frames=found.frames, depth=found.depth, figures=request.figures,
                             bvh=request.bvh)

    def write_result(self, result) -> dict[str, str]:
        """Write what a worker returned; return the names for the player's row and discard what an earlier run
        recorded.
        """
        job, player = self.job, self.part.role.player
        job.state.update_player(player.id, finished=None)
        row = {"finished": self._build_name()}
        for ending, content in result.files.items():
            path = job.folder.player_path(self.part.file, ending)
            atomic_write(path, content)
            row.setdefault(ending.rpartition(".")[2] if ending.endswith("bvh") else ending.partition(".")[0], path.name)
        if result.report is not None:
            path = job.folder.player_path(self.part.file, "report.json")
            who = {"id": player.id, "team": player.team, "number": player.number, "name": player.name}
            took = {**result.report["seconds"], "search": job.state.players[player.id]["search_s"]}
            whole = {**result.report, **who, "seconds": took,
                     "warnings": [*result.report["warnings"], *self.part.role.notes]}
            atomic_write(path, json.dumps(to_plain(whole), indent=1, ensure_ascii=False, allow_nan=False) + "\n")
            row["report"] = path.name
        return row

    def _apply_correction(self) -> PlayerEdit:
        return replace(self.edit, correction=self.found.correction)

    def _build_name(self) -> str:
        """Name the files by all that they depend on."""
        role, found, request = self.part.role, self.found, self.job.request
        depends_on = (remove_library_paths([self._apply_correction()])[0], role.measured, self.ball, found.frames,
                      found.depth, request.figures, request.bvh, role.player, role.notes)
        return self.job.build_name(*depends_on)
