"""Folders of recorded throws and kicks, as `throw train` and `throw evaluate` take them: `python -m
benchmarks.throw_folders [--out build/throws]`.

Made anew from `../shared/data`, which never becomes part of the project:

- `lmd_kicks`: four players, twenty shots each, a skeleton each; target and ball were not recorded
- `pitches`:   two pitches of CMU, and two pitches and two serves from markers, by `reconstruct` and `release`,
               which tells how fast the ball left; six throws of few people are enough to look at
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.places import CMU_UNIT, DATA, ROOT

PLACE = ROOT / "build" / "throws"
MARKERS = (
    "000870_003252_74_195_002_FF_808.c3d", "pitch_biodata.c3d", "kinematics_tennis_serve.c3d",
    "kinematics_tennis_serve_nan.c3d",
)  # fmt: skip
LAUNCH = ("launch_x_m_s", "launch_y_m_s", "launch_z_m_s")
COLUMNS = ("file", "subject", "limb", "release_s", *LAUNCH)


def lmd_kicks(place: Path = PLACE) -> Path:
    """The folder of the four players' shots; made where it is missing."""
    folder = place / "lmd_kicks"
    rows = [row for row in _annotations() if row["file"].startswith("lmd/") and row["labels"].startswith("kick ")]
    told = []
    for row in rows:
        _, subject, name = row["file"].split("/")
        link = folder / subject / name
        link.parent.mkdir(parents=True, exist_ok=True)
        if not link.exists():
            link.symlink_to(DATA / "mocap" / row["file"])
        told.append({"file": f"{subject}/{name}", "subject": subject, "limb": f"{row['labels'].split()[1]}_foot",
                     "release_s": f"{int(row['key_frame']) / float(row['fps']):.6f}"})  # fmt: skip
    _write(folder / "throws.csv", told)
    return folder


def pitches(place: Path = PLACE) -> Path:
    """The folder of pitches and serves; those from markers are reconstructed where they are missing (a minute)."""
    folder = place / "pitches"
    if (folder / "throws.csv").is_file():
        return folder
    told = [_from_markers(name, folder) for name in MARKERS] + [_of_cmu(row, folder) for row in _annotations()
                                                                if row["file"].startswith("cmu_pitch/")]
    _write(folder / "throws.csv", [row for row in told if row])
    return folder


def _annotations() -> list[dict]:
    with open(DATA / "mocap" / "annotations.csv", newline="", encoding="utf-8") as text:
        return [row for row in csv.DictReader(text) if row["key_frame"]]


def _of_cmu(row: dict, folder: Path) -> dict:
    """A clip of CMU written in metres."""
    from beyond_mocap.files import bvh

    name = Path(row["file"]).stem
    out = folder / "cmu124" / f"{name}.bvh"
    out.parent.mkdir(parents=True, exist_ok=True)
    bvh.write(out, bvh.read(DATA / "mocap" / row["file"], CMU_UNIT).motion)
    return {"file": f"cmu124/{name}.bvh", "subject": "cmu124", "limb": f"{row['labels'].split()[1]}_hand",
            "release_s": f"{int(row['key_frame']) / float(row['fps']):.6f}"}  # fmt: skip


def _from_markers(name: str, folder: Path) -> dict | None:
    """One trial reconstructed; None, told, where no ball leaves a hand."""
    from beyond_mocap.errors import InputError
    from beyond_mocap.files import bvh
    from beyond_mocap.files.marker_files import read_markers
    from beyond_mocap.reconstruct import ReconstructSettings, reconstruct
    from beyond_mocap.release import release

    subject = Path(name).stem[:24]
    out = folder / subject / f"{Path(name).stem}.bvh"
    out.parent.mkdir(parents=True, exist_ok=True)
    made = reconstruct(read_markers(DATA / "markers" / name), None, settings=ReconstructSettings())
    bvh.write(out, made.motion)
    try:
        found = release(made.raw, made.motion)
    except InputError as error:
        print(f"{name}: left out: {error}", file=sys.stderr)
        return None
    print(f"{name}: {found.side} hand, {found.time:.3f} s, {found.speed:.1f} m/s by the {found.how}", file=sys.stderr)
    # a racket serves, of which a hand tells little
    launch = {} if "serve" in name else dict(zip(LAUNCH, found.velocity))
    return {"file": f"{subject}/{out.name}", "subject": subject, "limb": f"{found.side}_hand",
            "release_s": f"{found.time:.6f}", **{axis: f"{value:.6f}" for axis, value in launch.items()}}  # fmt: skip


def _write(path: Path, rows: Sequence[dict]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "w", newline="", encoding="utf-8") as out:
        table = csv.DictWriter(out, COLUMNS, lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def main() -> int:
    """Makes both folders."""
    options = argparse.ArgumentParser(prog="python -m benchmarks.throw_folders", description=__doc__)
    options.add_argument("--out", type=Path, default=PLACE)
    chosen = options.parse_args()
    if not (DATA / "mocap").is_dir():
        print(f"{DATA} is missing; nothing was made")
        return 0
    print(lmd_kicks(chosen.out), pitches(chosen.out), sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
