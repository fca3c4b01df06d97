"""The stages of a match that are distributed over workers: search, collision avoidance, figures.

Finished work is found by the digest of everything it depends on, so a run resumes where another ended, and after an
edit only affected pieces are computed again.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...annotation import Timeline
from ...base.errors import BeyondMocapError, told_time
from ...files.tables import plain
from ...files.whole import atomic_write
from ...library.library import Library
from ...motion.track.ball_path import BallPath
from ..crowd.crowd_window import BEYOND, LONGEST, CrowdPart, cut_edit, join_windows, keep_parts, kept_parts
from ..folder import MatchFolder
from ..order import FORM, MatchOrder, digest_of
from ..parts import Part
from ..player_edit import PlayerEdit, write_player
from ..state import MatchState
from .pool import Failed, Workplace, run
from .units import units_of
from .windows import Piece, keep_piece, kept_piece, spliced
from .work import Finish, LibrarySource, finish_player, part_crowd, search_unit

SEARCH, CROWD = "search", "crowd"
"""The kinds of pieces that are stored."""

Report = Callable[[float, str], None]


@dataclass(frozen=True, eq=False, kw_only=True)
class Job:
    """What all stages share.

    Attributes:
        request: the match's request.
        folder: its folder.
        state: its state.
        source: the library as workers read it.
        library: the library in this process.
        workers: where work runs.
        report: receives the share of the stage done and a text.
        cancelled: called now and then; True cancels the work.
    """

    order: MatchOrder
    folder: MatchFolder
    state: MatchState
    source: LibrarySource
    library: Library
    place: Workplace
    report: Report
    cancelled: Callable[[], bool] | None = None

    def named(self, *values: object) -> str:
        """Build the name of a piece of work that depends on the library and on `values`."""
        return digest_of(FORM, self.source.key, *values)


def _spread(job: Job, tasks, work, stage: str) -> Iterator[tuple]:
    """Run a stage's tasks; (key, result) as of `pool.run_tasks`."""
    return run(tasks, work, job.place, job.cancelled, job.state.spent(stage))


def search(job: Job, parts: Sequence[Part]) -> dict[str, PlayerEdit]:
    """Search every player's edit list; each is written as soon as it is complete.

    Args:
        job: what all stages share.
        parts: the players' plans.
    Returns:
        Edit list by player id; failures are recorded in the state.
    """
    return _Search(job, parts).done()


class _Search:
    """The windows of all players: those that are stored, and those that have to be searched."""

    def __init__(self, job: Job, parts: Sequence[Part]):
        self._job, self._parts = job, {part.role.player.id: part for part in parts if part.plans}
        self._found: dict[str, list[Piece]] = {player: [] for player in self._parts}
        self._names: set[str] = set()
        self._edits: dict[str, PlayerEdit] = {}
        self._count = 0
        order = job.order
        for player, part in self._parts.items():
            bare = (replace(plan, timeline=Timeline(), solved=None, solve_touches=False) for plan in part.plans)
            units = sum(len(units_of(plan, 0, order.window, order.overlap)) for plan in bare)  # of the track
            job.state.players[player]["units"] = units
            self._count += units

    def done(self) -> dict[str, PlayerEdit]:
        """Search what is missing, then return the edit lists by id."""
        job = self._job
        for (player, name), result in _spread(job, self._missing(), search_unit, SEARCH):
            if isinstance(result, Failed):
                self._fail(player, result.reason)
                continue
            path = job.folder.place(SEARCH, name)
            keep_piece(path, result)
            self._take(player, kept_piece(path) or result)  # the stored form, as a later run reads it
        job.folder.forget(SEARCH, self._names)
        return {player: self._edits[player] for player in self._parts if player in self._edits}

    def _missing(self) -> Iterator[tuple[tuple[str, str], tuple]]:
        """Iterate over the tasks that are not stored; add the stored pieces."""
        job = self._job
        for player, part in self._parts.items():
            for number, plan in enumerate(part.plans):
                for unit in units_of(plan, number, job.order.window, job.order.overlap):
                    if self._failed(player):
                        break
                    name = job.named(replace(unit, plan=replace(unit.plan, library="")))
                    self._names.add(name)
                    found = kept_piece(job.folder.place(SEARCH, name))
                    if found is not None:
                        self._take(player, found)
                    else:
                        yield (player, name), (job.source, unit)

    def _take(self, player: str, piece: Piece) -> None:
        """Add one window; the last one completes the player's edit list."""
        job, mine = self._job, self._found[player]
        mine.append(piece)
        if self._failed(player):
            return
        job.state.counted(player)
        done = sum(map(len, self._found.values()))
        job.report(done / self._count, f"Searching: {done} of {self._count} windows")
        if len(mine) == job.state.players[player]["units"]:
            try:
                edit, joints = spliced(job.library, self._parts[player].plans, mine)
            except BeyondMocapError as error:
                return self._fail(player, str(error))
            self._edits[player] = edit
            file = job.folder.of(self._parts[player].file, "take.npz")
            write_player(file, edit)
            agreed = sum(joint.agreed for joint in joints)
            job.state.player(player, status="searched", take=file.name, joints=[len(joints), agreed],
                             search_s=round(sum(piece.seconds for piece in mine), 3))  # fmt: skip

    def _fail(self, player: str, reason: str) -> None:
        if not self._failed(player):
            self._job.state.player(player, status="failed", reason=reason)

    def _failed(self, player: str) -> bool:
        return self._job.state.players[player]["status"] == "failed"


def keep_apart(job: Job, edits: dict[str, PlayerEdit], span: tuple[float, float]) -> dict[str, CrowdPart]:
    """Resolve the collisions of the whole span, in windows of all players on the match's clock.

    Args:
        job: what all stages share.
        edits: edit list by player id.
        span: (start, end) s.
    Returns:
        Correction by player id.
    """
    players, names = list(edits), {}
    windows = _windows(span, min(job.order.window, LONGEST), job.order.fps)
    found: dict[int, tuple[CrowdPart, ...]] = {}

    def missing():
        for number, (start, end) in enumerate(windows):
            cut = tuple(cut_edit(edits[player], start - BEYOND, end + BEYOND) for player in players)
            names[number] = job.named(start, end, _unnamed(cut))
            kept = kept_parts(job.folder.place(CROWD, names[number]))
            if kept is not None and len(kept) == len(players):
                found[number] = kept
            else:
                yield number, (job.source, cut, start, end)

    for number, result in _spread(job, missing(), part_crowd, CROWD):
        if isinstance(result, Failed):
            start, end = windows[number]
            when = f"{told_time(start)}-{told_time(end)} s"
            job.state.told["notes"].append(f"{when}: collisions are not resolved: {result.reason}")
            continue
        keep_parts(job.folder.place(CROWD, names[number]), result)
        found[number] = result
        job.report(len(found) / len(windows), f"Resolving collisions: {len(found)} of {len(windows)} windows")
    job.folder.forget(CROWD, names.values())
    rows = [(found[number], windows[number]) for number in sorted(found)]
    return {player: join_windows([(parts[place], window) for parts, window in rows], job.order.fps)
            for place, player in enumerate(players)}  # fmt: skip


def _windows(span: tuple[float, float], window: float, fps: float) -> list[tuple[float, float]]:
    """Build the windows (start, end) s of the span, on frames and on the grid."""
    numbers = range(int(np.floor(span[0] / window)) + 1, int(np.ceil(span[1] / window)))
    edges = [span[0], *(number * window for number in numbers), span[1] + 1.0 / fps]
    return list(zip(edges, edges[1:]))


def _unnamed(edits: Sequence[PlayerEdit]) -> tuple:
    """Remove the library's path from edit lists, because their motion does not depend on it."""
    bare = [[replace(one, plan=replace(one.plan, library="")) for one in edit.stretches] for edit in edits]
    return tuple(replace(edit, stretches=tuple(stretches)) for edit, stretches in zip(edits, bare))


def finish(
    job: Job, parts: Sequence[Part], edits: dict[str, PlayerEdit], crowd: dict[str, CrowdPart], ball: BallPath
) -> None:
    """Write all players' files: the corrected edit list and, where requested, report, provenance and BVH.

    Args:
        job: what all stages share.
        parts: the players' plans.
        edits: edit list by player id.
        crowd: correction by player id.
        ball: the match's ball.
    """
    mine = {part.role.player.id: part for part in parts if part.role.player.id in edits}
    names: dict[str, str] = {}
    done = 0

    def missing():
        nonlocal done
        for player, part in mine.items():
            edit = replace(edits[player], correction=crowd[player].correction)
            write_player(job.folder.of(part.file, "take.npz"), edit)
            order = Finish(edit=edit, measured=part.role.measured, ball=ball, frames=crowd[player].frames,
                           depth=crowd[player].depth, figures=job.order.figures, bvh=job.order.bvh)  # fmt: skip
            names[player] = job.named(replace(order, edit=_unnamed([edit])[0]), part.role.player, part.role.notes)
            if _is_finished(job, part, names[player]):
                done += 1
            else:
                yield player, (job.source, order)

    for player, result in _spread(job, missing(), finish_player, "figures"):
        if isinstance(result, Failed):
            job.state.player(player, status="failed", reason=result.reason)
            continue
        files = _write(job, mine[player], result, names[player])
        done += 1
        job.report(done / len(mine), f"Figures: {done} of {len(mine)} players")
        job.state.player(player, status="done", **files)


def _is_finished(job: Job, part: Part, name: str) -> bool:
    """Say whether an earlier run wrote this player's files; if so, record them again."""
    endings = {"report": "report.json", "provenance": "provenance.csv"} if job.order.figures else {}
    endings |= {"bvh": "bvh"} if job.order.bvh else {}
    files = {kind: job.folder.of(part.file, ending) for kind, ending in endings.items()}
    player = part.role.player.id
    if job.state.players[player].get("finished") != name or not all(path.is_file() for path in files.values()):
        return False
    job.state.player(player, status="done", **{kind: path.name for kind, path in files.items()})
    return True


def _write(job: Job, part: Part, made, name: str) -> dict[str, str]:
    """Write a player's files; return their names for the player's row and discard what an earlier run recorded."""
    job.state.player(part.role.player.id, finished=None)
    told = {"finished": name}
    for ending, content in made.files.items():
        path = job.folder.of(part.file, ending)
        atomic_write(path, content)
        told.setdefault(ending.rpartition(".")[2] if ending.endswith("bvh") else ending.partition(".")[0], path.name)
    if made.report is not None:
        path, player = job.folder.of(part.file, "report.json"), part.role.player
        who = {"id": player.id, "team": player.team, "number": player.number, "name": player.name}
        took = {**made.report["seconds"], "search": job.state.players[player.id]["search_s"]}
        whole = {**made.report, **who, "seconds": took, "warnings": [*made.report["warnings"], *part.role.notes]}
        atomic_write(path, json.dumps(plain(whole), indent=1, ensure_ascii=False, allow_nan=False) + "\n")
        told["report"] = path.name
    return told
