"""The content of match.json: the request, the players and how far each is, messages, and costs
(docs/reference/match-folder.md).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from .. import __version__
from ..base.memory import read_peak_memory
from ..motion.track.match_data import Match
from ..synthesis.search.request import USE_NEAREST
from .folder import MatchFolder
from .pieces.pool import TaskFailure, TaskResult
from .player_plans import PlayerPlans
from .request import MatchRequest

ALLOW_NEAREST = "leave out --exact"
"""The next step of a player whose labels the library lacks: that option alone makes labels strict in a match."""
WRITE_INTERVAL = 1.0
"""s between two writes of a state in which only the number of finished windows has changed."""


@dataclass(eq=False)
class MatchState:
    """The state while the match is synthesized.

    Attributes:
        folder: the match's folder.
        report: values of match.json, except those below.
        players: rows by id, in the order of the feed.
        seconds: s of wall time by stage.
        main_seconds: s of processor time of this process by stage.
        worker_memory: MB, the highest peak of a worker.
        worker_seconds: s of processor time of workers by stage.
    """

    folder: MatchFolder
    report: dict
    players: dict[str, dict] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    main_seconds: dict[str, float] = field(default_factory=dict)
    worker_memory: float = 0.0
    worker_seconds: dict[str, float] = field(default_factory=dict)
    _write_time: float = 0.0

    def update_player(self, player: str, **values) -> None:
        """Update a player's row and write the state."""
        self.players[player].update(values)
        self.write_state()

    def mark_failed(self, player: str, failure: TaskFailure) -> None:
        """Record why a player failed."""
        reason = failure.reason.replace(USE_NEAREST, ALLOW_NEAREST)
        self.update_player(player, status="failed", reason=reason, exit_status=failure.exit_status)

    def record_window(self, player: str) -> None:
        """Count one more searched window of a player."""
        self.players[player]["units_done"] += 1
        if time.monotonic() - self._write_time > WRITE_INTERVAL:
            self.write_state()

    def update_report(self, **values) -> None:
        """Update values of the match and write the state."""
        self.report.update(values)
        self.write_state()

    def write_state(self) -> None:
        """Write match.json."""
        rows = [{name: value for name, value in row.items() if value is not None} for row in self.players.values()]
        memory = {"main": round(read_peak_memory(), 1), "worker": round(self.worker_memory, 1)}
        spent = {stage: round(seconds, 3) for stage, seconds in self.worker_seconds.items()}
        self.folder.write_state({**self.report, "players": rows, "seconds": self.seconds,
                                 "main_cpu_s": self.main_seconds, "worker_cpu_s": spent,
                                 "peak_memory_mb": memory})  # fmt: skip
        self._write_time = time.monotonic()

    def build_result_counter(self, stage: str) -> Callable[[TaskResult], None]:
        """Build the function that adds the cost of each piece of a stage."""

        def count_result(done: TaskResult) -> None:
            self.worker_memory = max(self.worker_memory, done.memory)
            self.worker_seconds[stage] = self.worker_seconds.get(stage, 0.0) + done.seconds

        return count_result

    def record_stage(self, stage: str, started: tuple[float, float]) -> None:
        """Record a finished stage that started at `started` (`read_clocks`)."""
        self.seconds[stage], self.main_seconds[stage] = (round(b - a, 3) for a, b in zip(started, read_clocks()))

    @property
    def failed_rows(self) -> list[dict]:
        """Rows of the players who could not be synthesized."""
        return [row for row in self.players.values() if row["status"] == "failed"]


def read_clocks() -> tuple[float, float]:
    """Read the wall clock and this process's processor time, s."""
    return time.perf_counter(), time.process_time()


def build_state(
    folder: MatchFolder, request: MatchRequest, identity: Mapping, match: Match, span: tuple[float, float]
) -> MatchState:
    """Build the state of a match before its work starts.

    Args:
        folder: the match's folder.
        request: the request.
        identity: what determines the results, by name.
        match: the match.
        span: (start, end) s.
    Returns:
        The state, without players.
    """
    sides = [team.name for team in match.teams if team.name and team.ground != "referee"]
    return MatchState(folder, {
        "software": __version__, "status": "running", "title": " - ".join(sides[:2]) or request.tracking.stem,
        "identity": dict(identity), "order": request.to_plain(), "from_s": span[0], "to_s": span[1], "fps": request.fps,
        "pitch_m": [match.length, match.width], "provider": match.provider,
        "periods_s": [list(period) for period in match.periods], "teams": [vars(team) for team in match.teams],
        "ball": None, "events": None, "crowd": None, "data": list(dict.fromkeys((*match.notes, *match.report))),
        "notes": [], "workers": request.scheduler or request.workers,
    })  # fmt: skip


def build_player_row(part: PlayerPlans, finished: str | None = None) -> dict:
    """Build a player's row at the start.

    Args:
        part: the player's plans.
        finished: digest of the files that an earlier run has left.
    Returns:
        The row.
    """
    player, role = part.role.player, part.role
    return {
        "id": player.id, "file": part.file, "team": player.team, "name": player.name, "number": player.number,
        "position": player.position, "status": "failed" if role.reason else "waiting", "reason": role.reason,
        "stretches_s": [[float(track.times[0]), float(track.times[-1])] for track in role.measured],
        "units": 0, "units_done": 0, "data": list(role.notes), "finished": finished,
    }  # fmt: skip
