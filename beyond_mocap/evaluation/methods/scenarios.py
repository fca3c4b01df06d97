"""The scenarios of a folder: tracks with their labels."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from ...annotation import Timeline, check_timeline, read_timeline
from ...annotation.label_candidates import find_track_labels
from ...base.content import is_utf16
from ...base.errors import InputError, describe_no_folder
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
        labels: their file, or None.
        thesis: what the thesis measured, where the track is one of those that stand for its scenarios.
    """

    name: str
    track: Track
    timeline: Timeline
    labels: Path | None = None
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
        raise InputError(folder, describe_no_folder(folder), f"a folder of tracks: {_FORM}",
                         "name the folder that has them")
    tables = sorted(path for path in folder.iterdir() if path.suffix.lower() == ".csv" and path.is_file())
    tracks = [path for path in tables if _is_track(path)]
    if not tracks:
        found = f"no track among its {len(tables)} .csv files" if tables else "no .csv file in it"
        raise InputError(folder, found, _FORM, "name the folder that has the tracks")
    notes = [f"{path}: not a track, left out" for path in tables if path not in tracks]
    notes += [f"{path}: no labels beside it; all is automatic locomotion" for path in tracks
              if not find_track_labels(path)]
    _check_names(tracks)
    return [_read_scenario(path, fps, notes) for path in tracks], notes


def _check_names(tracks: Iterable[Path]) -> None:
    """Check that no two tracks are the same scenario, NAME.csv and NAME_track.csv; InputError where they are."""
    known: dict[str, Path] = {}
    for path in tracks:
        other = known.setdefault(_name_scenario(path), path)
        if other != path:
            raise InputError(path, f"has the name of {other.name}", "one track for each scenario", "rename one")


def _name_scenario(path: Path) -> str:
    return path.stem.removesuffix("_track")


def check_labels(scenarios: Iterable[Scenario], known_labels: Iterable[str]) -> None:
    """Check labels and times of all scenarios.

    Args:
        scenarios: the scenarios.
        known_labels: those of the library, beside the usual ones.
    Raises:
        InputError: for an unknown label, or a time outside the track.
    """
    known = tuple(known_labels)
    for scenario in scenarios:
        first, *_, last = scenario.track.times.tolist()
        check_timeline(scenario.timeline, known, first, last, str(scenario.labels))


def _is_track(path: Path) -> bool:
    """Return whether a table's first row names the columns of a track; with other separators, its reader says so."""
    with path.open("rb") as file:
        data = file.read(_HEAD_BYTES)
    head = data.decode("utf-16" if is_utf16(data) else "utf-8-sig", "replace")
    names = re.split("[,;\t]", re.split("[\r\n]", head, maxsplit=1)[0])
    return {"time_s", "x_m", "y_m"} <= {name.strip(' "') for name in names}


def _read_scenario(path: Path, fps: float, notes: list[str]) -> Scenario:
    """Read a track and its labels; what was repaired in the track is added to `notes`."""
    track, data = clean_track(read_track_csv(path))
    notes += [f"{path}: {line}" for line in data.lines]
    labels = find_track_labels(path)
    timeline = read_timeline(labels, fps, float(track.times[0])) if labels else Timeline()
    return Scenario(name=_name_scenario(path), track=track, timeline=timeline, labels=labels,
                    thesis=THESIS.get(hashlib.sha256(path.read_bytes()).hexdigest()))
