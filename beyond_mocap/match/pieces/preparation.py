"""What is prepared before the search of a match: the spacing of the players and their headings.

In a long match the workers do it. They start while the main process solves the ball, and read the library meanwhile.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator, Sequence

import numpy as np

from ...base.errors import BeyondMocapError
from ...synthesis.heading_path import HeadingPath
from ...synthesis.heading_request import Play
from ...synthesis.one_thread import limit_to_one_thread
from ...synthesis.plan import Plan
from ..crowd.spacing import solve_episode
from ..player_heading import plan_player_heading
from .job import Job
from .pool import TaskFailure, WorkerConfig, run_tasks, start_workers
from .tasks import LibrarySource, load_library

LONG_SECONDS = 120.0
"""s of a match from which on workers prepare it; a shorter one is prepared before they have started."""

Headings = tuple[HeadingPath, ...] | str


class Preparation:
    """Prepares a match, with its workers where it is long."""

    def __init__(self, job: Job, span: tuple[float, float]):
        """Start the workers of a long match.

        Args:
            job: what all stages share.
            span: (start, end) s.
        """
        self._job = job
        self._workers = job.workers if span[1] - span[0] >= LONG_SECONDS else WorkerConfig()
        start_workers(self._workers, read_library, (job.source,))

    def solve_episodes(self, tasks: Sequence[tuple]) -> list[np.ndarray]:
        """Solve the spacing of all episodes.

        Args:
            tasks: arguments of `spacing.solve_episode`.
        Returns:
            The shifts of each.
        Raises:
            BeyondMocapError: if one of them cannot be solved.
        """
        longest_first = sorted(range(len(tasks)), key=lambda number: -tasks[number][1].size)
        found = dict(self._run(((number, tasks[number]) for number in longest_first), solve_spacing))
        for result in found.values():
            if isinstance(result, TaskFailure):
                raise BeyondMocapError(result.reason)
        return [found[number] for number in range(len(tasks))]

    def plan_headings(self, players: Sequence[Sequence[tuple[Plan, Play | None]]]) -> list[Headings]:
        """Plan the headings of all players.

        Args:
            players: for each player, the plans of the stretches with what they face beside the ball.
        Returns:
            For each player the headings of the stretches, or why they cannot be planned.
        """
        tasks = ((number, (self._job.source, plans)) for number, plans in enumerate(players))
        found = dict(self._run(tasks, plan_headings))
        results = (found[number] for number in range(len(players)))
        return [result.reason if isinstance(result, TaskFailure) else
                tuple(HeadingPath(path.times, path.bins) for path in result) for result in results]

    def _run(self, tasks, work) -> Iterator[tuple]:
        """Run tasks where this match is prepared."""
        job = self._job
        counter = job.state.build_result_counter("words") if self._workers is job.workers else None
        return run_tasks(tasks, work, self._workers, job.cancelled, counter)


def read_library(source: LibrarySource) -> None:
    """Read the library and what every window of the search needs of it; the garbage collector passes it over."""
    library = load_library(source).with_synthetic_clips
    library.cut_receptions, library.gaits  # noqa: B018
    gc.collect()
    gc.freeze()  # the worker keeps the library: to look through its objects for garbage takes 1.5 % of a search


def solve_spacing(*arguments) -> np.ndarray:
    """Solve the spacing of one episode (`spacing.solve_episode`)."""
    with limit_to_one_thread():
        return solve_episode(*arguments)


def plan_headings(source: LibrarySource, plans: Sequence[tuple[Plan, Play | None]]) -> list[HeadingPath]:
    """Plan the headings of one player (`player_heading.plan_player_heading`)."""
    library = load_library(source)
    with limit_to_one_thread():
        return [plan_player_heading(library, plan, play) for plan, play in plans]
