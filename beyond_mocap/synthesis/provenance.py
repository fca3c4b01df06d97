"""Provenance: which clip, at which frame, every frame of a take shows, and its table as CSV."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..annotation import sort_labels
from ..files.atomic import atomic_write
from ..files.tables import format_csv, parse_column, parse_flags, read_rows
from ..library.library import Library
from ..motion import quaternion
from ..motion.skeleton import freeze_array
from .search.source_frames import SourceFrames
from .take import Take

PROVENANCE_COLUMNS = (
    "frame", "time_s", "clip", "clip_frame", "mirrored", "labels", "contact_left", "contact_right",
)  # fmt: skip
HEADING_COLUMN = "planned_heading_deg"
"""Last column, where the heading was planned."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Provenance:
    """Where each of T output frames comes from.

    Attributes:
        times: (T,) s on the track's clock.
        clip: T paths below the library.
        clip_frame: (T,) fractional frame in the clip's own rate.
        mirrored: (T,) bool.
        words: T tuples of labels.
        contacts: (T, 2) bool, left and right foot in contact.
        planned_heading: (T,) rad from +x that was planned, NaN or None where there is no plan.
    """

    times: np.ndarray
    clip: tuple[str, ...]
    clip_frame: np.ndarray
    mirrored: np.ndarray
    words: tuple[tuple[str, ...], ...]
    contacts: np.ndarray
    planned_heading: np.ndarray | None = None

    def __post_init__(self):
        for name, kind in (("times", float), ("clip_frame", float), ("mirrored", bool), ("contacts", bool)):
            object.__setattr__(self, name, freeze_array(getattr(self, name), kind))
        if self.planned_heading is not None:
            object.__setattr__(self, "planned_heading", freeze_array(self.planned_heading))

    def __len__(self) -> int:
        return len(self.times)


def build_provenance(take: Take) -> Provenance:
    """Build the provenance of a take."""
    return Provenance(
        times=take.start_time + np.arange(len(take.motion)) / take.motion.fps,
        clip=tuple(take.clips[index] for index in take.clip),
        clip_frame=take.clip_frame,
        mirrored=take.mirrored,
        words=tuple(map(tuple, take.words)),
        contacts=take.contacts,
        planned_heading=take.planned_heading,
    )


def join_provenance(tables: Sequence[Provenance]) -> Provenance:
    """Join the provenance of takes that follow each other."""
    names = ["times", "clip_frame", "mirrored", "contacts"]
    if all(one.planned_heading is not None for one in tables):
        names.append("planned_heading")
    arrays = {name: np.concatenate([getattr(one, name) for one in tables]) for name in names}
    return Provenance(clip=tuple(clip for one in tables for clip in one.clip),
                      words=tuple(words for one in tables for words in one.words), **arrays)


def write_provenance(path: str | os.PathLike, take: Take | Provenance) -> None:
    """Write provenance as CSV, one row per output frame.

    Columns: `frame,time_s,clip,clip_frame,mirrored,labels,contact_left,contact_right`, and where the heading was
    planned `planned_heading_deg`, degrees from +x.

    Args:
        path: the file.
        take: a take or its provenance.
    """
    table = build_provenance(take) if isinstance(take, Take) else take
    columns = [
        range(len(table.times)),
        [f"{time:.6f}" for time in table.times.tolist()],
        table.clip,
        [f"{frame:.4f}" for frame in table.clip_frame.tolist()],
        table.mirrored.astype(int).tolist(),
        list(map(" ".join, table.words)),
        *table.contacts.astype(int).T.tolist(),
    ]
    names = PROVENANCE_COLUMNS
    if table.planned_heading is not None:
        names, degrees = (*names, HEADING_COLUMN), np.degrees(quaternion.wrap_angle(table.planned_heading))
        columns.append([f"{value:.2f}" if math.isfinite(value) else "" for value in degrees.tolist()])
    atomic_write(path, format_csv(names, zip(*columns)))


def read_provenance(path: str | os.PathLike) -> Provenance:
    """Read a table of `write_provenance`.

    Raises:
        InputError: naming the line of a row that does not have this form.
    """
    rows = list(read_rows(path, PROVENANCE_COLUMNS))
    is_planned = bool(rows) and HEADING_COLUMN in rows[0][1]
    return Provenance(
        times=parse_column(rows, "time_s"),
        clip=tuple(row["clip"] for _, row in rows),
        clip_frame=parse_column(rows, "clip_frame"),
        mirrored=parse_flags(rows, "mirrored"),
        words=tuple(tuple(row["labels"].split()) for _, row in rows),
        contacts=np.column_stack([parse_flags(rows, "contact_left"), parse_flags(rows, "contact_right")]),
        planned_heading=np.radians(parse_column(rows, HEADING_COLUMN, blank=True)) if is_planned else None,
    )


def build_provenance_fields(library: Library, frames_shown: SourceFrames) -> dict[str, Any]:
    """Build the fields of a `Take` that say what its frames show: clips, clip, clip_frame, mirrored, words and seams.

    Args:
        library: the clips.
        frames_shown: T source frames.
    Returns:
        Name of a field -> its value.
    """
    sources = list_sources(library, frames_shown)
    names = tuple(dict.fromkeys(sources))
    number = {name: i for i, name in enumerate(names)}
    return {
        "clips": names,
        "clip": np.array([number[source] for source in sources]),
        "clip_frame": frames_shown.clip_frame,
        "mirrored": np.array([library.clips[clip].mirrored for clip in frames_shown.clip]),
        "words": list_labels_shown(library, frames_shown),
        "seams": frames_shown.transitions,
    }


def list_sources(library: Library, frames_shown: SourceFrames) -> tuple[str, ...]:
    """List the file, below the library, of every shown frame: a recording, or the synthetic continuation of one."""
    clips = [library.clips[number] for number in frames_shown.clip.tolist()]
    frames = np.round(frames_shown.clip_frame, 6).tolist()
    return tuple(clip.path if clip.recorded_count is None else clip.source_at(frame)
                 for clip, frame in zip(clips, frames))


def list_labels_shown(library: Library, frames_shown: SourceFrames) -> tuple[tuple[str, ...], ...]:
    """List the labels that every shown frame's clip carries there."""
    labels: list[tuple[str, ...]] = [()] * len(frames_shown.clip)
    clip, frame = frames_shown.clip, np.round(frames_shown.clip_frame, 6)
    for number in np.unique(clip):
        rows, at = library.clips[number].annotations, np.flatnonzero(clip == number)
        edges = np.unique([edge for row in rows for edge in (row.start, row.end)])
        # the labels change at and behind the edges of rows only: each place is an edge, or lies between two
        place = np.searchsorted(edges, frame[at]) + np.searchsorted(edges, frame[at], side="right")
        for one in np.unique(place):
            there = at[place == one]
            words = sort_labels(library.clips[number].labels_at(frame[there[0]]))
            for index in there:
                labels[index] = words
    return tuple(labels)
