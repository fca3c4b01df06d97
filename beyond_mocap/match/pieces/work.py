"""The three kinds of work that a match is made of, as functions that any process can be given: each takes all that it
needs, but the library, which a worker reads by itself."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...files.bvh import bvh
from ...motion.track import Track
from ...motion.track.ball_path import BallPath
from ...synthesis.provenance import Provenance, provenance_of, write_provenance
from ...synthesis.take import Take
from ..crowd.crowd_window import CrowdPart, crowd_window
from ..player_edit import PlayerEdit
from ..report.figures import player_report
from ..shown import shown
from .searched import Piece, searched
from .units import Unit
from .workplace_library import LibrarySource, library_of


@dataclass(frozen=True, eq=False)
class PlayerFiles:
    """report: a player's report, None where no figures are asked for. files: ending -> content of his files."""

    report: dict | None
    files: dict[str, bytes]


@dataclass(frozen=True, eq=False)
class Finish:
    """What is needed to finish a player. edit: his edit list, with its correction; measured: his tracks, one
    per stretch; ball: the match's; frames (K,) of the match's clock at which he is in somebody, depth (K,) m how deep.
    figures, bvh: whether report and provenance, and BVH, are asked for."""

    edit: PlayerEdit
    measured: tuple[Track, ...]
    ball: BallPath
    frames: np.ndarray
    depth: np.ndarray
    figures: bool
    bvh: bool


def search_unit(source: LibrarySource, unit: Unit) -> Piece:
    """Searches one window of one player."""
    return searched(library_of(source), unit)


def part_crowd(
    source: LibrarySource, edits: Sequence[PlayerEdit], start: float, end: float
) -> tuple[CrowdPart, ...]:
    """Keeps everybody apart in one window."""
    return crowd_window(library_of(source), edits, start, end)


def finish_player(source: LibrarySource, order: Finish) -> PlayerFiles:
    """Makes a player's whole motion, its figures and its files."""
    from threadpoolctl import threadpool_limits

    library = library_of(source)
    with threadpool_limits(limits=1):
        plans = [stretch.plan for stretch in order.edit.stretches]
        span = float(plans[0].track.times[0]), float(plans[-1].track.times[-1])
        takes = shown(library, order.edit, order.ball, *span)
        files = {}
        report = None
        if order.figures:
            overlap = [_overlap(take, order) for take in takes]
            report = player_report(library, takes, order.measured, overlap, order.ball)
            table = in_turn([provenance_of(take) for take in takes])
            files["provenance.csv"] = _written(lambda path: write_provenance(path, table))
        if order.bvh:
            for number, take in enumerate(takes, 1):
                ending = "bvh" if number == 1 else f"{number}.bvh"
                files[ending] = _written(lambda path, take=take: bvh.write(path, take.motion))
    return PlayerFiles(report, files)


def _overlap(take: Take, order: Finish) -> np.ndarray:
    """(T,) m by which a take's body is in others."""
    out = np.zeros(len(take.motion))
    at = order.frames - round(take.start_time * take.motion.fps)
    inside = (at >= 0) & (at < len(out))
    out[at[inside]] = order.depth[inside]
    return out


def in_turn(tables: Sequence[Provenance]) -> Provenance:
    """The provenance of several stretches, one behind the other."""
    return Provenance(
        np.concatenate([one.times for one in tables]),
        tuple(clip for one in tables for clip in one.clip),
        np.concatenate([one.clip_frame for one in tables]),
        np.concatenate([one.mirrored for one in tables]),
        tuple(words for one in tables for words in one.words),
        np.concatenate([one.contacts for one in tables]),
    )


def _written(write) -> bytes:
    """What `write(path)` writes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "content"
        write(path)
        return path.read_bytes()
