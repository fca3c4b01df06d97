"""The scenarios of a folder: tracks with their labels."""

from __future__ import annotations

import csv
import hashlib
from dataclasses import dataclass
from pathlib import Path

from ...annotation import Timeline, read_timeline
from ...base.errors import InputError
from ...files.tracking.tracking import read_track_csv
from ...motion.track import Track, clean_track
from .thesis import THESIS, ThesisFigures

_FORM = "NAME.csv with the columns time_s,x_m,y_m, and its labels in NAME.txt"
_HEAD_BYTES = 4096  # read of a table to see whether it is a track


@dataclass(frozen=True, eq=False, kw_only=True)
class Scenario:
    """A track with its labels.

    Attributes:
        name: of the file, without its ending.
        track: the player's samples, cleaned.
        timeline: the requested labels, not yet filled.
        thesis: what the thesis measured, where the track is one of those that stand for its scenarios.
    """

    name: str
    track: Track
    timeline: Timeline
    thesis: ThesisFigures | None = None


def read_scenarios(folder: Path, fps: float) -> tuple[list[Scenario], list[str]]:
    """Read the scenarios of a folder.

    Args:
        folder: the folder; folders below it are not looked into.
        fps: frames per second of the takes, in which labels may count.
    Returns:
        The scenarios by name, and a line for each thing that a user should know.
    Raises:
        InputError: for a folder without tracks, and for tracks and labels that cannot be read.
    """
    if not folder.is_dir():
        found = "is a file" if folder.exists() else "no such folder"
        raise InputError(folder, found, f"a folder of tracks: {_FORM}", "name the folder that has them")
    tables = sorted(folder.glob("*.csv"))
    tracks = [path for path in tables if _is_track(path)]
    if not tracks:
        found = f"no track among its {len(tables)} .csv files" if tables else "no .csv file in it"
        raise InputError(folder, found, _FORM, "name the folder that has the tracks")
    notes = [f"{path}: not a track, left out" for path in tables if path not in tracks]
    notes += [f"{path}: no labels beside it; all is automatic locomotion" for path in tracks if not find_labels(path)]
    return [_read_scenario(path, fps) for path in tracks], notes


def _is_track(path: Path) -> bool:
    """Return whether a table's first row has the columns of a track."""
    with path.open("rb") as file:
        line = file.read(_HEAD_BYTES).decode("utf-8-sig", "replace").partition("\n")[0]
    names = {name.strip() for name in next(csv.reader([line.strip()]), [])}
    return {"time_s", "x_m", "y_m"} <= names


def find_labels(track: Path) -> Path | None:
    """Find the labels of a track: NAME.txt, or SCENARIO_annotations.txt beside SCENARIO_track.csv; None without."""
    names = (track.stem, f"{track.stem.removesuffix('_track')}_annotations")
    return next((path for name in names if (path := track.with_name(f"{name}.txt")).is_file()), None)


def _read_scenario(path: Path, fps: float) -> Scenario:
    """Read a track and its labels."""
    track, _ = clean_track(read_track_csv(path))
    labels = find_labels(path)
    timeline = read_timeline(labels, fps, float(track.times[0])) if labels else Timeline()
    return Scenario(name=path.stem.removesuffix("_track"), track=track, timeline=timeline,
                    thesis=THESIS.get(hashlib.sha256(path.read_bytes()).hexdigest()))
