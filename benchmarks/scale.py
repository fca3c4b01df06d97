"""What a large library, a long track and the start of the program cost: processor seconds and memory of whole commands.

The library is made of links to the shortest recordings, repeated under other names until they are as many as asked.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from itertools import islice
from pathlib import Path

import numpy as np

from .effort import format_head, format_row
from .places import DATA, ROOT

COUNTS = (160, 500, 2000)
"""Clips of the libraries that are compared."""
MEAN_SECONDS = 1.8
"""Mean duration of the recordings that are linked: 2,000 of them last an hour."""
SECONDS = (20.0, 5400.0)
"""Durations of the tracks."""


def section() -> list[str]:
    """Measure commands: the start, building, opening and a take with each library, and a long track."""
    if not hasattr(os, "wait4"):
        return ["Memory of commands is not known on this system."]
    lines = format_head(("command", "processor s", "memory GiB"))
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        short, long = (write_track(folder / f"track{seconds:g}.csv", seconds) for seconds in SECONDS)
        lines.append(_measure("--help", ["--help"]))
        for count in COUNTS:
            library = link_clips(folder / f"library{count}", count)
            options = ["--library", library, "--out", folder / "out.bvh", "--track"]
            lines += [
                _measure(f"library of {count} clips, built", ["library", library]),
                _measure(f"library of {count} clips, from the cache", ["library", library]),
                _measure(f"the first take from {count} clips, {SECONDS[0]:g} s", ["synthesize", *options, short]),
                _measure(f"a take from {count} clips, {SECONDS[0]:g} s", ["synthesize", *options, short]),
            ]
        lines.append(_measure(f"a take of {SECONDS[1] / 60:g} minutes", ["synthesize", *options, long]))
    return lines


def link_clips(folder: Path, count: int) -> Path:
    """Link the shortest recordings, as many times as needed, with one table of labels."""
    source = DATA / "mocap"
    head, *rows = (source / "annotations.csv").read_text("utf-8").splitlines()
    labels: dict[str, list[str]] = {}
    for row in rows:
        labels.setdefault(row.split(",", 1)[0], []).append(row.split(",", 1)[1])
    clips = select_clips(source)
    folder.mkdir()
    table = [head]
    for number in range(count):
        clip = clips[number % len(clips)]
        path = clip.relative_to(source).as_posix()
        name = f"{number // len(clips):03d}_{path.replace('/', '_')}"
        (folder / name).symlink_to(clip)
        table += [f"{name},{row}" for row in labels.get(path, ())]
    (folder / "annotations.csv").write_text("\n".join(table) + "\n", "utf-8")
    return folder


def select_clips(source: Path) -> list[Path]:
    """Select the shortest recordings, as many as last MEAN_SECONDS on average."""
    lengths = sorted((_read_seconds(clip), clip) for clip in sorted(source.rglob("*.bvh")))
    means = np.cumsum([seconds for seconds, _ in lengths]) / np.arange(1, len(lengths) + 1)
    return sorted(clip for _, clip in lengths[: int(np.searchsorted(means, MEAN_SECONDS)) + 1])


def _read_seconds(clip: Path) -> float:
    """Read the duration of a recording from the two lines above its rows."""
    with open(clip, encoding="utf-8", errors="replace") as lines:
        head = list(islice((line for line in lines if line.startswith(("Frames:", "Frame Time:"))), 2))
    return int(head[0].split()[1]) * float(head[1].split()[2])


def write_track(path: Path, seconds: float) -> Path:
    """Write a player's track of changing speed and direction, which stays on the pitch."""
    random, times = np.random.default_rng(0), np.arange(0.0, seconds, 0.1)
    knots = 4.0 * np.arange(int(seconds / 4.0) + 2)
    speed = np.clip(np.interp(times, knots, random.gamma(2.0, 0.9, len(knots))), 0.0, 7.5)
    angle = np.interp(times, knots, np.cumsum(random.normal(0.0, 0.8, len(knots))))
    place = np.cumsum(0.1 * speed[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1), axis=0)
    half = np.array([50.0, 32.0])
    place = np.abs((place + half) % (4.0 * half) - 2.0 * half) - half  # mirrored at the lines
    rows = "".join(f"{time:.1f},{x:.3f},{y:.3f}\n" for time, (x, y) in zip(times, place))
    path.write_text("time_s,x_m,y_m\n" + rows, "utf-8")
    return path


def _measure(title: str, arguments: list) -> str:
    """Run a command and format its row: processor time, and the memory that it had at most."""
    command = [sys.executable, "-m", "beyond_mocap", *map(str, arguments)]
    run = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(run.pid, 0)
    if status:
        return format_row((title, "failed", ""))
    kilo = 1024 if sys.platform == "darwin" else 1
    return format_row((title, f"{used.ru_utime + used.ru_stime:.2f}", f"{used.ru_maxrss / 1024**2 / kilo:.2f}"))
