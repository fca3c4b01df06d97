"""Where the recordings and scenarios are, and the libraries built from them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from beyond_mocap.annotation import Timeline, read_timeline
from beyond_mocap.files.tracking.tracking import read_track_csv
from beyond_mocap.motion.track import Track, clean_track

ROOT = Path(__file__).resolve().parent.parent
DATA = ROOT.parent / "shared" / "data"
CMU_UNIT = 0.05644  # m per unit of the CMU recordings
MIXED = ("cmu10", "lmd/Player1", "lafan1", "runs15", "sprinter")
SAMPLE = ROOT / "sample_blend"
"""The shipped sample: `library` has its clips, `match` two players with labels."""
LIBRARIES = {"cmu10": CMU_UNIT, "mixed": None}
"""Name -> metres per unit of its clips, None where each is estimated."""


def library_folder(name: str, place: Path) -> Path:
    """Return the folder of a library; the mixed one is built below `place`."""
    return link_recordings(MIXED, place / name) if name == "mixed" else DATA / "mocap" / name


def link_recordings(kinds: Sequence[str], folder: Path) -> Path:
    """Link the folders of several kinds of recordings in `folder`, with one table of labels for all."""
    rows = (DATA / "mocap" / "annotations.csv").read_text().splitlines()
    rows_kept = [row for row in rows[1:] if row.split(",")[0].startswith(tuple(f"{kind}/" for kind in kinds))]
    for kind in kinds:
        link = folder / kind
        link.parent.mkdir(parents=True, exist_ok=True)
        link.symlink_to(DATA / "mocap" / kind, target_is_directory=True)
    (folder / "annotations.csv").write_text("\n".join([rows[0], *rows_kept]) + "\n")
    return folder


def scenario_files(number: int) -> tuple[Path, Path]:
    """Return the track and annotation files of a scenario."""
    place = DATA / "tracking" / "scenarios"
    return place / f"scenario{number}_track.csv", place / f"scenario{number}_annotations.txt"


def read_scenario(number: int) -> tuple[Track, Timeline]:
    """Read the track and timeline of a scenario."""
    track_file, words_file = scenario_files(number)
    track, _ = clean_track(read_track_csv(track_file))
    return track, read_timeline(words_file, 30.0, float(track.times[0]))
