"""What all stages of a match share."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from ...library.library import Library
from ..folder import MatchFolder
from ..player_edit import PlayerEdit
from ..request import FORM, MatchRequest, compute_digest
from ..state import MatchState
from .pool import WorkerConfig, run_tasks
from .tasks import LibrarySource

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

    request: MatchRequest
    folder: MatchFolder
    state: MatchState
    source: LibrarySource
    library: Library
    workers: WorkerConfig
    report: Report
    cancelled: Callable[[], bool] | None = None

    def build_name(self, *values: object) -> str:
        """Build the name of a piece of work that depends on the library and on `values`."""
        return compute_digest(FORM, self.source.key, *values)


def run_stage(job: Job, tasks, work, stage: str) -> Iterator[tuple]:
    """Run a stage's tasks.

    Args:
        job: what all stages share.
        tasks: as for `pool.run_tasks`.
        work: as for `pool.run_tasks`.
        stage: its name.
    Returns:
        An iterator over (key, result).
    """
    return run_tasks(tasks, work, job.workers, job.cancelled, job.state.build_result_counter(stage))


def remove_library_paths(edits: Sequence[PlayerEdit]) -> tuple:
    """Remove the library's path from edit lists, because their motion does not depend on it.

    Args:
        edits: the edit lists.
    Returns:
        The same without paths.
    """
    stretches_of_edits = [[replace(one, plan=replace(one.plan, library="")) for one in edit.stretches]
                          for edit in edits]
    return tuple(replace(edit, stretches=tuple(stretches)) for edit, stretches in zip(edits, stretches_of_edits))
