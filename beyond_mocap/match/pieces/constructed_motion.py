"""The motion of all players of a match, constructed once, window by window, and stored in the folder while it is
needed.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from ...base.errors import InputError
from ...files.atomic import atomic_write
from ...synthesis.take import Take
from ..crowd.window import cut_edit
from ..player_edit import PlayerEdit
from ..player_motion import MARGIN_SECONDS, StretchWindows
from .job import Job, remove_library_paths, run_stage
from .motion_parts import Content, MotionBlock, MotionSpan, list_blocks, load_part
from .pool import TaskFailure
from .tasks import construct_block

MOTION = "motion"
"""The kind of these pieces."""

_OTHER_NUMBERS = 25  # that are stored of a frame beside the rotations

Times = tuple[float, float]


@dataclass(frozen=True, eq=False)
class _StoredBlock:
    """A block, where it is, and the files of its windows."""

    block: MotionBlock
    start: float
    end: float
    files: tuple[Path, ...]


class ConstructedMotion:
    """The motion of all players.

    Attributes:
        edits: edit list by player id, without those whose construction failed.
    """

    def __init__(self, job: Job, edits: dict[str, PlayerEdit]):
        """Name the files.

        Args:
            job: what all stages share.
            edits: edit list by player id.
        """
        self.edits = dict(edits)
        self._job, self._ready = job, set[Path]()
        self._grids = {player: [StretchWindows(stretch, edit.window) for stretch in edit.stretches]
                       for player, edit in edits.items()}  # fmt: skip
        self._blocks = {player: [_name_block(job, edit, self._grids[player][index], block)
                                 for index, block in list_blocks(edit)] for player, edit in edits.items()}  # fmt: skip
        self._files = {player: [[file for one in blocks if one.block.stretch is stretch for file in one.files]
                                for stretch in edits[player].stretches] for player, blocks in self._blocks.items()}

    def construct(self, times: Iterable[Times], players: Iterable[str] | None = None) -> bool:
        """Construct what is not stored of some times.

        Args:
            times: (start, end) s.
            players: ids; None: all.
        Returns:
            Whether all of it is constructed; if not, the players that failed are no longer in `edits`.
        Raises:
            InputError: if the folder has no room for it.
        """
        job, spans = self._job, list(times)
        missing = [(player, one) for player in (list(self.edits) if players is None else players)
                   for one in self._blocks[player] if any(one.start < end and one.end > start for start, end in spans)
                   and not all(map(self._is_stored, one.files))]  # fmt: skip
        self._check_room(sum(one.end - one.start for _, one in missing))
        tasks = (((player, one.files), (job.source, one.block)) for player, one in missing if player in self.edits)
        has_failed = False
        for done, ((player, files), result) in enumerate(run_stage(job, tasks, construct_block, MOTION), 1):
            if isinstance(result, TaskFailure):
                has_failed |= self._drop_player(player, result)
                continue
            for file, content in zip(files, result, strict=True):
                atomic_write(file, content)
            self._ready.update(files)
            job.report(done / len(missing), f"Constructing: {done} of {len(missing)} pieces")
        return not has_failed

    def find_spans(self, player: str, start: float, end: float) -> tuple[MotionSpan, ...]:
        """Find what shows a player from `start` to `end` s, one span for each stretch in it, for workers."""
        spans = []
        for grid, files in zip(self._grids[player], self._files[player], strict=True):
            if (frames := grid.find_frames(start, end)) is not None:
                spans.append(MotionSpan(grid.cut_plan(*frames), tuple(self._iter_parts(grid, files, *frames))))
        return tuple(spans)

    def load_takes(self, player: str, start: float, end: float) -> list[Take] | None:
        """Load what a player does from `start` to `end` s, one take for each stretch; None where it is not stored."""
        if player not in self.edits:
            return None
        try:
            return [span.load_take(self._job.library.skeleton) for span in self.find_spans(player, start, end)]
        except (InputError, OSError, ValueError):
            return None

    def remove(self) -> None:
        """Remove the stored motion."""
        self._job.folder.remove_pieces(MOTION, ())

    def _check_room(self, seconds: float) -> None:
        """Check that the folder has room for so many seconds of motion; InputError otherwise."""
        job = self._job
        needed = seconds * job.request.fps * 8 * (4 * len(job.library.skeleton) + _OTHER_NUMBERS)
        if (free := shutil.disk_usage(job.folder.path).free) < needed:
            raise InputError(job.folder.path, f"{free / 1e6:.1f} MB free", f"{needed / 1e6:.1f} MB while it is made",
                             "make room, or choose another folder")

    def _iter_parts(self, grid: StretchWindows, files: list[Path], low: int, high: int) -> Iterator[tuple[Content, int,
            int]]:
        """Iterate over (content, first, end) of the windows with frames low .. high."""
        for number in grid.list_windows(low, high):
            first, end = grid.edges[number : number + 2]
            file = files[number]
            content = file.read_bytes() if self._job.workers.scheduler else file
            yield content, max(low, first) - first, min(high, end) - first

    def _is_stored(self, file: Path) -> bool:
        """Say whether a file is there and undamaged; what this run has written is not read again."""
        if file not in self._ready and file.is_file():
            try:
                load_part(file, self._job.library.skeleton)
                self._ready.add(file)
            except Exception:  # a damaged file can raise any error of zipfile, zlib, numpy or this package
                return False
        return file in self._ready

    def _drop_player(self, player: str, failure: TaskFailure) -> bool:
        """Record that a player failed; whether this is new."""
        if self.edits.pop(player, None) is None:
            return False
        self._job.state.mark_failed(player, failure)
        return True


def _name_block(job: Job, edit: PlayerEdit, grid: StretchWindows, block: MotionBlock) -> _StoredBlock:
    """Name the files of a block by all that its motion depends on."""
    edges = grid.edges[max(block.first - 1, 0) : block.end + 1]  # it blends from the window before
    start, end = grid.compute_time(edges[0]) - MARGIN_SECONDS, grid.compute_time(edges[-1]) + MARGIN_SECONDS
    cut = cut_edit(replace(edit, stretches=(block.stretch,), correction=None), start, end)
    name = job.build_name(MOTION, grid.begin, edges, block.first, remove_library_paths([cut]))
    files = tuple(job.folder.piece_path(MOTION, f"{name}-{number}") for number in range(block.first, block.end))
    low, high = grid.edges[block.first], grid.edges[block.end]
    return _StoredBlock(block, grid.compute_time(low), grid.compute_time(high), files)
