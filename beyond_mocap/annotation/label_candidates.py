"""Find the text that has the labels of a track, or those that may have them where none has the track's own name."""

from __future__ import annotations

import os
import re
from pathlib import Path

from ..base.errors import InputError
from .text import parse_timeline, read_text
from .timeline import KeyMoment, Span

MOST_READ = 40  # text files of a folder that are looked into
_FRAMES_PER_SECOND = 30.0  # any rate does: only the form matters here


def find_track_labels(track: str | os.PathLike) -> Path | None:
    """Find the text beside a track that has its labels by its name.

    Args:
        track: the track's file.
    Returns:
        NAME.txt beside NAME.csv, else SCENARIO_annotations.txt beside SCENARIO_track.csv; None without.
    """
    track = Path(track)
    names = (track.stem, *[f"{track.stem.removesuffix('_track')}_annotations"] * track.stem.endswith("_track"))
    return next((path for name in names if (path := track.with_name(f"{name}.txt")).is_file() and path != track), None)


def find_label_candidates(track: str | os.PathLike) -> tuple[Path, ...]:
    """Find text files beside a track that read as labels and whose names begin as the track's does.

    A file that has the name of another table of the folder belongs to that one.

    Args:
        track: the track's file.
    Returns:
        The files, those with more words of the track's name first; none where one has exactly the track's name.
    """
    track = Path(track)
    if find_track_labels(track):
        return ()
    words = _split_name(track)
    beside = [path for path in sorted(track.parent.glob("*.txt")) if not path.with_suffix(".csv").exists()]
    alike = [(-count, path) for path in beside if (count := _count_common(words, _split_name(path)))]
    return tuple(path for _, path in sorted(alike)[:MOST_READ] if _has_labels(path))


def _split_name(path: Path) -> list[str]:
    return [word for word in re.split(r"[^0-9a-z]+", path.stem.lower()) if word]


def _count_common(words: list[str], others: list[str]) -> int:
    """Count the words with which both names begin."""
    return len(os.path.commonprefix([words, others]))


def _has_labels(path: Path) -> bool:
    """Return whether a file reads as labels, with at least one."""
    try:
        found = parse_timeline(read_text(path), path.name, _FRAMES_PER_SECOND)
    except (InputError, OSError):
        return False
    labels: tuple[Span | KeyMoment, ...] = (*found.spans, *found.keys)
    return any(label.words or label.avoid for label in labels)
