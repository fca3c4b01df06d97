"""Measuring and reporting: processor seconds, the cost of reading, building and memory, and rows of tables."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from beyond_mocap.files.bvh import bvh
from beyond_mocap.library.build import build_library

from .places import DATA, LIBRARIES, ROOT, scenario_files

RUNS = 3  # the best of so many runs counts


def measure_seconds(work, runs: int = RUNS) -> tuple[float, object]:
    """Measure the best processor time of several runs.

    With one thread on one core this is what a clock shows while nothing else runs, and it does not change when
    something does.

    Args:
        work: what is measured.
        runs: how many runs.
    Returns:
        Seconds, and what the last run returned.
    """
    best, result = np.inf, None
    for _ in range(runs):
        started = time.process_time()
        result = work()
        best = min(best, time.process_time() - started)
    return best, result


def bind_to_one_core() -> None:
    """Bind this process and those it starts to one core, where the system permits it."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def report_blas_speed() -> str:
    """Measure numpy's matrix products: official Blenders have no fast BLAS, so everything that multiplies is slower."""
    random = np.random.default_rng(0)
    a, b = (random.normal(size=(2000, 27)).astype(np.float32) for _ in range(2))
    took, _ = measure_seconds(lambda: [a @ b.T for _ in range(10)])
    speed = 10 * 2 * 2000 * 2000 * 27 / took / 1e9
    return f"numpy multiplies at {speed:.0f} GFLOP/s (pip's some 100, one without BLAS 2 to 6)"


def report_bvh_speed() -> str:
    """Measure how fast a long clip is read, in MB per second of the whole file."""
    source = DATA / "mocap" / "lafan1" / "walk1_subject1_walk2_filtered.bvh"
    head, _, motion = source.read_text().partition("MOTION")
    rows = motion.strip().splitlines()
    with tempfile.TemporaryDirectory() as folder:
        long = Path(folder) / "long.bvh"
        many = rows[2:] * (24_000_000 // max(1, sum(map(len, rows[2:]))))
        long.write_text("\n".join([head + "MOTION", f"Frames: {len(many)}", rows[1], *many]) + "\n")
        size = long.stat().st_size / 1e6
        best, _ = measure_seconds(lambda: bvh.read_bvh(long))
    return f"a clip of {size:.0f} MB: {size / best:.0f} MB/s from text to quaternions"


def report_library_speed() -> str:
    """Measure the building of 150 clips of 120 frames at 30 fps, mirrored ones included, from text and from the cache.

    Built from the Bandai clips, cut or repeated to 120 frames: 75 files and their 75 mirror images.
    """
    sources = sorted((DATA / "mocap" / "bandai").glob("*.bvh"))
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as caches:
        rows = ["file,start_frame,end_frame,key_frame,labels"]
        for number in range(75):
            head, _, motion = sources[number % len(sources)].read_text().partition("MOTION")
            lines = motion.strip().splitlines()
            frames = (lines[2:] * 120)[:120]
            name = f"clip{number:03d}.bvh"
            Path(folder, name).write_text("\n".join([head + "MOTION", "Frames: 120", lines[1], *frames]) + "\n")
            rows.append(f"{name},0,119,,{'walking' if number % 2 else 'running'} front")
        Path(folder, "annotations.csv").write_text("\n".join(rows) + "\n")
        cold, _ = measure_seconds(lambda: _build_clusters(folder, tempfile.mkdtemp(dir=caches)))
        cache = tempfile.mkdtemp(dir=caches)
        _build_clusters(folder, cache)
        warm, _ = measure_seconds(lambda: _build_clusters(folder, cache))
    return (
        f"75 clips of 120 frames and their mirror images: {cold:.2f} s from text to clusters (target 5), {warm:.2f} s "
        "cached (target 0.3); Faustino 187 s and 12.9 s"
    )


def _build_clusters(folder: str, cache: str) -> None:
    """Build a library with its clusters, which are computed when they are first needed."""
    build_library(folder, cache_dir=cache).clusters  # noqa: B018


def report_peak_memory(name: str, folder: Path, cache: Path, number: int = 2) -> str:
    """Measure peak resident memory and seconds of the whole command, in a process of its own, with a cached library."""
    if not hasattr(os, "wait4"):
        return "peak memory: not known on this system"
    track, words = scenario_files(number)
    with tempfile.TemporaryDirectory() as out:
        command = [sys.executable, "-m", "beyond_mocap", "synthesize", "--library", folder, "--cache", cache, "--track",
                   track, "--annotations", words, "--out", Path(out) / "out.bvh", "--nearest"]
        if LIBRARIES[name]:
            command += ["--unit", str(LIBRARIES[name])]
        quiet = subprocess.DEVNULL
        run = subprocess.Popen(list(map(str, command)), cwd=ROOT, stdout=quiet, stderr=quiet)
        _, status, used = os.wait4(run.pid, 0)
    if status:
        return f"peak memory: the command ended with {status}"
    kilo = 1024 if sys.platform == "darwin" else 1
    took, peak = used.ru_utime + used.ru_stime, used.ru_maxrss / 1024**2 / kilo
    return f"scenario {number} by the command, with imports and cached library: {took:.1f} s, {peak:.2f} GiB at most"


def format_head(names: Sequence[str]) -> list[str]:
    """Format the two lines that begin a table."""
    return [format_row(names), "|" + "---|" * len(names)]


def format_row(cells: Iterable[str]) -> str:
    """Format one line of a table."""
    return f"| {' | '.join(cells)} |"
