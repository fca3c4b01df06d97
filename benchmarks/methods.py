"""The methods side by side, as `beyond-mocap compare` shows them: on the shipped sample, and on the five scenarios."""

from __future__ import annotations

import tempfile
from itertools import takewhile
from pathlib import Path

from benchmarks.places import DATA, LIBRARIES, SAMPLE, library_folder
from beyond_mocap.evaluation.methods.comparison import METHOD_OPTIONS, compare_methods
from beyond_mocap.evaluation.methods.scenarios import read_scenarios
from beyond_mocap.evaluation.methods.tables import format_markdown
from beyond_mocap.library.build import build_library

FPS = 30.0


def section() -> list[str]:
    """Build the lines for results.md."""
    lines = compare_folder("The shipped sample", SAMPLE / "library", SAMPLE / "match")
    if (DATA / "mocap").is_dir():
        with tempfile.TemporaryDirectory() as place:
            for name, unit in LIBRARIES.items():
                lines += compare_folder(f"Library {name}", library_folder(name, Path(place) / name),
                                        DATA / "tracking" / "scenarios", unit)
    return lines


def compare_folder(title: str, library: Path, scenarios: Path, unit: float | None = None) -> list[str]:
    """Compare all methods on a folder of scenarios.

    Args:
        title: heading.
        library: folder of the clips.
        scenarios: folder of the tracks.
        unit: m per unit of the clips; None to estimate it.
    """
    with tempfile.TemporaryDirectory() as cache:
        clips = build_library(library, unit=unit, cache_dir=Path(cache))
        comparison = compare_methods(clips, read_scenarios(scenarios, FPS)[0], list(METHOD_OPTIONS), FPS)
    lines = format_markdown(comparison, level=4)
    # the warnings of every take, the last section, are too many for a page of results
    return [f"### {title}", "", *takewhile(lambda line: line != "#### Warnings", lines)]
