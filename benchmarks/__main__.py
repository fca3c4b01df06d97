"""`make bench`: library time, BVH speed, and every figure of scenarios with each method side by side.

Everything of one table is measured in one process; seconds are the best of three, cold (library built from text) and warm
(from its cache). Written to benchmarks/results.md with the command that made it.
"""

from __future__ import annotations

import argparse
import platform
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from beyond_mocap.annotation import read_timeline  # noqa: E402
from beyond_mocap.evaluation.report import evaluate, table  # noqa: E402
from beyond_mocap.files import bvh  # noqa: E402
from beyond_mocap.files.tracking import read_track_csv  # noqa: E402
from beyond_mocap.library.library import build  # noqa: E402
from beyond_mocap.motion.track import clean  # noqa: E402
from beyond_mocap.plan import Plan  # noqa: E402
from beyond_mocap.synthesize import synthesize  # noqa: E402

DATA = ROOT.parent / "shared" / "data"
CMU_UNIT = 0.05644
RUNS = 3
METHODS = {
    "blocks": {"method": "blocks"},
    "distance": {"method": "distance"},
    "distance, no catch-up": {"method": "distance", "catch_up": False},
    "path": {"method": "path"},
}
FAUSTINO = {  # his Tables 1, 2 and 4, whole animation and at frame constraints; other data, for orientation only
    1: "4.52 m (keys 1.20 m), similarity -0.05 (keys -1), 65 s / 148 s",
    2: "3.42 m (keys 2.14 m), similarity -0.54 (keys -0.24), 95 s / 215 s",
    3: "3.24 m (keys 3.50 m), similarity -0.09 (keys -0.75), 34 s / 353 s",
    4: "1.21 m (keys 3.19 m), similarity -0.34 (keys -0.44), 199 s / 477 s",
    5: "1.86 m (keys 1.20 m), similarity -0.25 (keys -0.8), 94 s / 614 s",
}
MIXED = ("cmu10", "lmd/Player1", "lafan1", "runs15", "sprinter")


def seconds(work, runs: int = RUNS) -> tuple[float, object]:
    """The best of several runs, and what the last one returned."""
    best, result = np.inf, None
    for _ in range(runs):
        begun = time.perf_counter()
        result = work()
        best = min(best, time.perf_counter() - begun)
    return best, result


def bvh_speed() -> list[str]:
    """How fast a long clip is read, in MB per second of the whole file."""
    source = DATA / "mocap" / "lafan1" / "walk1_subject1_walk2_filtered.bvh"
    head, _, motion = source.read_text().partition("MOTION")
    rows = motion.strip().splitlines()
    with tempfile.TemporaryDirectory() as folder:
        long = Path(folder) / "long.bvh"
        many = rows[2:] * (24_000_000 // max(1, sum(map(len, rows[2:]))))
        long.write_text("\n".join([head + "MOTION", f"Frames: {len(many)}", rows[1], *many]) + "\n")
        size = long.stat().st_size / 1e6
        best, _ = seconds(lambda: bvh.read(long))
    return [f"- a clip of {size:.0f} MB: {size / best:.0f} MB/s from text to quaternions"]


def library_speed() -> list[str]:
    """150 clips of about 120 frames at 30 fps, the mirrored counted, from text to clusters and from the cache.

    Made of the Bandai clips, cut or repeated to 120 frames: 75 files and their 75 twins.
    """
    sources = sorted((DATA / "mocap" / "bandai").glob("*.bvh"))
    with tempfile.TemporaryDirectory() as folder:
        rows = ["file,start_frame,end_frame,key_frame,labels"]
        for number in range(75):
            text = sources[number % len(sources)].read_text()
            head, _, motion = text.partition("MOTION")
            lines = motion.strip().splitlines()
            frames = (lines[2:] * 120)[:120]
            name = f"clip{number:03d}.bvh"
            Path(folder, name).write_text("\n".join([head + "MOTION", "Frames: 120", lines[1], *frames]) + "\n")
            rows.append(f"{name},0,119,,walking front" if number % 2 else f"{name},0,119,,running front")
        Path(folder, "annotations.csv").write_text("\n".join(rows) + "\n")
        cold, _ = seconds(lambda: build(folder, rebuild=True))
        warm, _ = seconds(lambda: build(folder))
    return [f"- library of 75 clips and their twins, 120 frames each: {cold:.2f} s from text to clusters, {warm:.2f} s cached"]


def mixed_folder(folder: Path) -> Path:
    """A library of five kinds of recordings: links to their folders, and one table of words for all of them."""
    rows = (DATA / "mocap" / "annotations.csv").read_text().splitlines()
    kept = [row for row in rows[1:] if row.split(",")[0].startswith(tuple(f"{name}/" for name in MIXED))]
    for name in MIXED:
        link = folder / name
        link.parent.mkdir(parents=True, exist_ok=True)
        link.symlink_to(DATA / "mocap" / name, target_is_directory=True)
    (folder / "annotations.csv").write_text("\n".join([rows[0], *kept]) + "\n")
    return folder


def scenario(number: int, library) -> dict[str, dict]:
    """Reports of one scenario by all methods, seconds best of three."""
    place = DATA / "tracking" / "scenarios" / f"scenario{number}_"
    track, _ = clean(read_track_csv(f"{place}track.csv"))
    timeline = read_timeline(f"{place}annotations.txt", 30.0, float(track.times[0]))
    reports = {}
    for name, options in METHODS.items():
        plan = Plan(track=track, timeline=timeline, library=library.folder, nearest=True, **options)
        best, take = seconds(lambda: synthesize(library, plan))
        take.seconds["total"] = best
        reports[name] = evaluate(take, track, library)
    return reports


def library_results(name: str, place: Path, scenarios: list[int]) -> list[str]:
    """The tables of one library, its cache kept in `place`."""
    folder = mixed_folder(place / "mixed") if name == "mixed" else DATA / "mocap" / "cmu10"
    unit = CMU_UNIT if name == "cmu10" else None
    cold, _ = seconds(lambda: build(folder, unit=unit, cache_dir=place / "cache", rebuild=True))
    warm, library = seconds(lambda: build(folder, unit=unit, cache_dir=place / "cache"))
    lines = [f"# Library {name}", "", f"{cold:.2f} s from text, {warm:.2f} s from its cache.", ""]
    lines += [f"- {note}" for note in library.notes] + [""]
    for number in scenarios:
        lines += [f"## Scenario {number}", ""]
        if number in FAUSTINO:
            lines += [f"Faustino's scenario {number} (other data): {FAUSTINO[number]}", ""]
        lines += [table(scenario(number, library)), ""]
    return lines


def main() -> int:
    """Runs everything and writes the results."""
    options = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    options.add_argument("--scenarios", type=int, nargs="+", default=[3, 4])
    options.add_argument("--library", choices=("cmu10", "mixed"), nargs="+", default=["cmu10"])
    options.add_argument("--out", type=Path, default=ROOT / "benchmarks" / "results.md")
    chosen = options.parse_args()
    if not (DATA / "mocap").is_dir():
        print(f"bench: {DATA} is missing; the benchmarks need its recordings and were skipped")
        return 0
    command = "python -m benchmarks " + " ".join(sys.argv[1:])
    lines = [
        "# Results", "", f"`{command.strip()}`; Python {platform.python_version()}, numpy {np.__version__}, one thread.", "",
        "Seconds are the best of three runs in one process; `--nearest` everywhere.", "",
        *bvh_speed(), *library_speed(), "",
    ]
    for name in chosen.library:
        with tempfile.TemporaryDirectory() as place:
            lines += library_results(name, Path(place), chosen.scenarios)
    chosen.out.write_text("\n".join(lines))
    print("\n".join(lines))
    return 0


if __name__ == "__main__":
    sys.exit(main())
