"""The five scenarios with two libraries: time, every figure of method `path` beside its target, and edits."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from benchmarks import effort, markdown
from benchmarks.edit_time import edit_times
from benchmarks.places import LIBRARIES, library_folder, scenario
from beyond_mocap.evaluation.report import evaluate, judge_figures
from beyond_mocap.library.build import build
from beyond_mocap.library.library import Library
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.synthesize import synthesize

NUMBERS = (1, 2, 3, 4, 5)


def section() -> list[str]:
    """Lines for results.md."""
    lines = [f"- {effort.blas_speed()}", f"- {effort.bvh_speed()}", f"- {effort.library_speed()}", ""]
    with tempfile.TemporaryDirectory() as place:
        for name in LIBRARIES:
            lines += of_library(name, Path(place) / name)
    return lines


def of_library(name: str, place: Path, numbers: Sequence[int] = NUMBERS) -> list[str]:
    """One library, its cache kept in `place`."""
    folder, unit, cache = library_folder(name, place), LIBRARIES[name], place / "cache"
    cold, _ = effort.seconds(lambda: build(folder, unit=unit, cache_dir=cache, rebuild=True), 1)
    warm, library = effort.seconds(lambda: build(folder, unit=unit, cache_dir=cache))
    reports = {number: report_of(library, number) for number in numbers}
    took = [20.0 * report["seconds"]["total"] / report["duration_s"] for report in reports.values()]
    orders = [(f"scenario {number}", *scenario(number)) for number in numbers]
    return [
        f"### Library {name}", "", f"- library: {cold:.2f} s from text, {warm:.2f} s from its cache",
        f"- {np.mean(took):.2f} s for 20 s of motion (target 0.5), {max(took):.2f} at most",
        f"- {effort.peak_memory(name, folder, cache)}", "", *figures(reports), "", *edit_times(library, orders), "",
    ]  # fmt: skip


def report_of(library: Library, number: int) -> dict:
    """A scenario's report, with the processor's seconds, the best of three."""
    track, timeline = scenario(number)
    plan = Plan(track=track, timeline=timeline, library=library.folder, nearest=True)
    best, take = effort.seconds(lambda: synthesize(library, plan))
    take.seconds["total"] = best
    return evaluate(take, track, library)


def figures(reports: Mapping[int, Mapping]) -> list[str]:
    """A row for each figure with a target: its value in every scenario, the recordings' own, in how many it is met."""
    rows = {number: {row.name: row for row in judge_figures(report)} for number, report in reports.items()}
    lines = markdown.head(["figure", "target", *(f"scenario {number}" for number in rows), "recordings", "met in"])
    for name in dict.fromkeys(row.name for of in rows.values() for row in of.values() if row.status):
        found = [of.get(name) for of in rows.values()]
        known = [row for row in found if row is not None and row.status]
        met = sum(row.status == "met" for row in known)
        verdict = f"{met} of {len(known)}" if met == len(known) else f"**{met} of {len(known)}**"
        values = ["" if row is None else str(row.value) for row in found]
        lines.append(markdown.row([name, known[0].target, *values, str(known[0].own), verdict]))
    return lines
