"""One player's track of any length, in the windows of a match: what is in memory does not grow with the track.

Windows are searched one after the other and joined where neighbours agree (`pieces.windows`); the motion is constructed
in parts, of which each frame is the same whatever the parts are (`player_motion`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..base.errors import UserCancelledError
from ..evaluation.report import evaluate
from ..files.bvh.bvh import write_bvh_parts
from ..files.bvh.bvh_write import BvhForm
from ..files.tables import write_ball
from ..library.library import Library
from ..motion.track.ball_path import BallPath
from ..synthesis.construct.ball_touch.carry_ball import report_recorded_ball
from ..synthesis.plan import Plan
from ..synthesis.provenance import build_provenance, join_provenance, write_provenance
from ..synthesis.resolve_plan import resolve_plan
from ..synthesis.synthesize import report_unmet_requests
from ..synthesis.take import Take
from .pieces.tasks import merge_reports
from .pieces.units import build_units, count_frames, cut_track
from .pieces.windows import join_pieces, search_window
from .player_edit import PlayerEdit, to_stored_plan
from .player_motion import construct_player, join_balls

PART_WINDOWS = 10
"""Windows that a part of the motion has: the one before each part is constructed twice."""

Progress = Callable[[float, str], None]


def search_long_player(library: Library, plan: Plan, window: float, progress: Progress,
                       cancelled: Callable[[], bool]) -> PlayerEdit:
    """Search the edit list of a player window by window. The same library, plan and numpy give the same bits.

    Args:
        library: the recordings.
        plan: of method "path".
        window: s of a window.
        progress: called as progress(fraction, text).
        cancelled: returns whether to stop.
    Raises:
        InputError, NotInLibraryError: as for `synthesize`.
        UserCancelledError: when `cancelled` returns true.
    """
    plan = to_stored_plan(plan)
    if plan.heading_path is None:
        plan = replace(plan, heading_path=resolve_plan(plan, library, are_touches_resolved=True).plan_heading())
    units, pieces = build_units(plan, window=window), []
    for unit in units:
        progress(0.6 * unit.number / len(units), "Searching")
        pieces.append(search_window(library, unit, cancelled))
    return join_pieces(library, [plan], pieces)[0]


def iter_parts(library: Library, edit: PlayerEdit, progress: Progress,
               cancelled: Callable[[], bool]) -> Iterator[Take]:
    """Construct a player's motion part by part.

    Args:
        library: the recordings.
        edit: of one stretch.
        progress: called as progress(fraction, text).
        cancelled: returns whether to stop.
    Returns:
        Takes that follow each other without a gap.
    Raises:
        UserCancelledError: when `cancelled` returns true.
    """
    plan = edit.stretches[0].plan
    begin, count = float(plan.track.times[0]), count_frames(plan, plan.fps)
    step = int(round(PART_WINDOWS * edit.window * plan.fps))
    for first in range(0, count - 1, step):
        if cancelled():
            raise UserCancelledError("synthesis: cancelled")
        progress(0.6 + 0.4 * first / count, "Constructing")
        # a rest of one frame is no motion: the part before takes it
        last = count - 1 if count - first - step < 2 else first + step - 1
        yield construct_player(library, edit, begin + first / plan.fps, begin + last / plan.fps)[0]
        if last == count - 1:
            return


class LongTakeFiles:
    """Writes the files of a take that comes in parts: the motion as it comes, tables and report in the end.

    Attributes:
        frames: number of frames so far.
        warnings: of all parts.
    """

    def __init__(self, library: Library, plan: Plan, has_report: bool):
        """Begin. plan: of the whole take."""
        self.frames = 0
        self.warnings: tuple[str, ...] = ()
        self._library, self._plan, self._has_report = library, plan, has_report
        self._tables, self._balls, self._reports, self._counts = [], [], [], []  # type: ignore[var-annotated]
        self._seams: list[int] = []

    def write_motion(self, path: Path, parts: Iterable[Take], count: int, form: BvhForm) -> None:
        """Write the motion of `count` frames in a form, and keep what the other files need."""
        write_bvh_parts(path, (self._note(part).motion for part in parts), count, form)
        self.warnings += tuple(report_recorded_ball(self._plan, self.ball, self._seams))

    def _note(self, part: Take) -> Take:
        """Keep of a part what the tables and the report need."""
        self._seams += (part.seams + self.frames).tolist()
        self.frames += len(part.motion)
        unmet = report_unmet_requests(self._library, part)
        self.warnings = tuple(dict.fromkeys((*self.warnings, *part.warnings, *unmet)))
        self._tables.append(build_provenance(part))
        self._balls.append(part.ball)
        self._counts.append(len(part.motion))
        if self._has_report:
            end = part.start_time + part.motion.duration
            self._reports.append(evaluate(part, cut_track(self._plan.track, part.start_time, end), self._library))
        return part

    @property
    def ball(self) -> BallPath | None:
        """The ball's trajectory, None without one."""
        times = float(self._plan.track.times[0]) + np.arange(self.frames) / self._plan.fps
        return join_balls(self._balls, self._counts, times)

    def write_tables(self, provenance: Path | None, ball: Path | None) -> None:
        """Write provenance and ball, where they are asked for."""
        if provenance:
            write_provenance(provenance, join_provenance(self._tables))
        if ball and self.ball is not None:
            write_ball(ball, self.ball)

    def build_report(self) -> dict:
        """Merge the reports of all parts."""
        merged = merge_reports(self._reports, self._counts)
        return {**merged, "warnings": list(dict.fromkeys((*merged.get("warnings", ()), *self.warnings)))}
