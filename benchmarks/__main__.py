"""`make bench`: the five scenarios with two libraries and each method side by side, every figure beside its target.

Everything of one run is measured in one process on one core; seconds are the best of three. Written to
benchmarks/results.md with the command that made it: a summary, Faustino's tables with our rows, then all figures.
`--compare` measures instead what is decided once, `--paths` recordings on other paths, `--ball` the ball and who
touches it, `--markers` optical recordings, `--throws` thrown and kicked balls, and writes that section anew. A Blender
measures with the numpy that it has: `blender -b --python benchmarks/__main__.py -- --out FILE`.
"""

from __future__ import annotations

import argparse
import platform
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from beyond_mocap.evaluation import played_from_take  # noqa: E402
from beyond_mocap.evaluation.judged import judged  # noqa: E402
from beyond_mocap.evaluation.report import cell, evaluate, flat  # noqa: E402
from beyond_mocap.evaluation.view import View  # noqa: E402
from beyond_mocap.library.library import Library  # noqa: E402
from beyond_mocap.library.build import build  # noqa: E402
from beyond_mocap.plan import Plan  # noqa: E402
from beyond_mocap.synthesize import synthesize  # noqa: E402

from benchmarks import ball, compare, effort, markdown, markers, misses, paper, path_editing, throws  # noqa: E402
from benchmarks.edit_time import edit_times  # noqa: E402
from benchmarks.places import DATA, LIBRARIES, ROOT, library_folder, scenario  # noqa: E402

METHODS = {
    "blocks": {"method": "blocks"},
    "distance, no catch-up": {"method": "distance", "catch_up": False},
    "distance": {"method": "distance"},
    "path": {"method": "path"},
}
COMPARED, PATHS, BALL, MARKERS, THROWS = (
    "## Compared once", "## Path editing", "## The ball", "## Markers", "## Throws and kicks",
)  # fmt: skip
KEY_COLUMNS = (
    "time_s", "labels", "clip", "time_error_s", "position_error_m", "contact_gap_m", "ball_shift_m", "used_instead",
)
_QUIET = ("version", "seed", "fps", "method", "warnings")


@dataclass
class Results:
    """All reports of one library. missed: what `path` misses in each scenario; edits: how long edits take."""

    library: Library
    effort: list[str]
    reports: dict[str, dict[int, dict]] = field(default_factory=lambda: {name: {} for name in METHODS})
    missed: list[misses.Misses] = field(default_factory=list)
    edits: list[str] = field(default_factory=list)


def measured(name: str, scenarios: list[int], place: Path) -> Results:
    """Builds a library, its cache kept in `place`, and runs all scenarios by all methods."""
    folder, unit, cache = library_folder(name, place), LIBRARIES[name], place / "cache"
    cold, _ = effort.seconds(lambda: build(folder, unit=unit, cache_dir=cache, rebuild=True), 1)
    warm, library = effort.seconds(lambda: build(folder, unit=unit, cache_dir=cache))
    results = Results(library, [f"library: {cold:.2f} s from text, {warm:.2f} s from its cache"])
    for number in scenarios:
        track, timeline = scenario(number)
        for method, options in METHODS.items():
            plan = Plan(track=track, timeline=timeline, library=library.folder, nearest=True, **options)
            best, take = effort.seconds(lambda plan=plan: synthesize(library, plan))
            take.seconds["total"] = best
            results.reports[method][number] = evaluate(take, track, library)
        view = View(played_from_take(take), track, take.timeline, library)
        results.missed.append(misses.counted(view, take.ik_miss))
    results.edits = edit_times(library, [(f"scenario {number}", *scenario(number)) for number in scenarios])
    results.effort.append(effort.peak_memory(name, folder, cache))
    return results


def summary(results: dict[str, Results], scenarios: list[int]) -> list[str]:
    """What came out, before all figures."""
    by_row = {(name, method): of for name, found in results.items() for method, of in found.reports.items()}
    lines = ["## Summary", ""]
    for name, found in results.items():
        took = [report["seconds"]["total"] for report in found.reports["path"].values()]
        per20 = [20.0 * r["seconds"]["total"] / r["duration_s"] for r in found.reports["path"].values()]
        lines += [
            f"### Library {name}, method path", "",
            f"{min(took):.2f} to {max(took):.2f} s a scenario, {np.mean(per20):.2f} s for 20 s of motion (target 0.5); "
            f"fastest recording {found.library.fastest:.1f} m/s.", "",
            *misses.summary(found.reports["path"], found.missed), "",
            "Edits of a take (every key moment moved by 0.2 s, stretches of track dragged by half a metre):", "",
            *found.edits, "",
        ]
    return [*lines, "## Faustino's tables", "", *paper.tables(by_row, scenarios)]


def all_figures(name: str, found: Results, scenarios: list[int]) -> list[str]:
    """Every figure of every scenario with one library."""
    lines = [f"## All figures, library {name}", "", *(f"- {note}" for note in found.library.notes), ""]
    for number in scenarios:
        of = {method: reports[number] for method, reports in found.reports.items()}
        lines += [f"### Scenario {number}, {name}", "", *figure_table(of), "", *key_table(of["path"]), ""]
        lines += [*(f"- {line}" for line in of["path"]["warnings"] if line not in found.library.notes), ""]
    return lines


def figure_table(reports: dict[str, dict]) -> list[str]:
    """One row per figure: each method, the recordings' own and the target of `path`, and whether `path` meets it."""
    columns = {method: flat(report) for method, report in reports.items()}
    lines = markdown.head(["figure", *columns, "recordings", "target", "path"])
    for of in judged(reports["path"]):
        stage = of.name.startswith("seconds.") and of.name != "seconds.total"  # by the clock, which others share
        if not of.name.startswith("keys ") and of.name not in _QUIET and not stage:
            values = [cell(column.get(of.name)) for column in columns.values()]
            lines.append(markdown.row([of.name, *values, of.own, of.target, of.status]))
    return lines


def key_table(report: dict) -> list[str]:
    """One row per key moment of `path`."""
    return markdown.head(KEY_COLUMNS) + [
        markdown.row(cell(key[leaf]) for leaf in KEY_COLUMNS) for key in report["keys"]
    ]


def bench(scenarios: list[int], libraries: list[str], command: str) -> list[str]:
    """The lines of the results, but for what is compared once."""
    lines = [
        "# Results", "",
        f"`{command}`; Python {platform.python_version()}, numpy {np.__version__}, one core, one thread.",
        "Seconds are the processor's, the best of three in one process with the library loaded; `--nearest` "
        "everywhere.", "",
        f"- {effort.blas_speed()}", f"- {effort.bvh_speed()}", f"- {effort.library_speed()}",
    ]
    with tempfile.TemporaryDirectory() as place:
        results = {name: measured(name, scenarios, Path(place) / name) for name in libraries}
    lines += [f"- {name}: {line}" for name, found in results.items() for line in found.effort] + [""]
    lines += summary(results, scenarios)
    for name, found in results.items():
        lines += all_figures(name, found, scenarios)
    return lines


def sections(path: Path) -> dict[str, list[str]]:
    """The lines of results written before by the heading of their section; "" is all before the first of these."""
    found: dict[str, list[str]] = {"": []}
    for line in path.read_text().splitlines() if path.is_file() else []:
        if line in (PATHS, BALL, MARKERS, THROWS, COMPARED):
            found[line] = []
        list(found.values())[-1].append(line)
    return found


def main() -> int:
    """Runs everything and writes the results."""
    options = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    options.add_argument("--scenarios", type=int, nargs="+", default=[1, 2, 3, 4, 5])
    options.add_argument("--library", choices=tuple(LIBRARIES), nargs="+", default=list(LIBRARIES))
    options.add_argument("--compare", action="store_true", help="what is decided once, instead of the methods")
    options.add_argument("--paths", action="store_true", help="recordings on other paths, instead of the scenarios")
    options.add_argument("--ball", action="store_true", help="the ball and who touches it, instead of the scenarios")
    options.add_argument("--markers", action="store_true", help="optical markers, instead of the scenarios")
    options.add_argument("--throws", action="store_true", help="throws and kicks, instead of the scenarios")
    options.add_argument("--out", type=Path, default=ROOT / "benchmarks" / "results.md")
    arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    chosen = options.parse_args(arguments)
    if not (DATA / "mocap").is_dir():
        print(f"bench: {DATA} is missing; the benchmarks need its recordings and were skipped")
        return 0
    effort.on_one_core()
    command = " ".join(["python -m benchmarks", *arguments])
    parts = sections(chosen.out)
    begin = ["", f"`{command}`", ""]
    if chosen.compare:
        made = {COMPARED: [COMPARED, *begin, *compare.all_of(chosen.scenarios, chosen.library)]}
    elif chosen.ball:
        made = {BALL: [BALL, *begin, *ball.section(), ""]}
    elif chosen.markers:
        made = {MARKERS: [MARKERS, *begin, *markers.section(), ""]}
    elif chosen.throws:
        made = {THROWS: [THROWS, *begin, *throws.section(), ""]}
    else:
        made = {PATHS: [PATHS, *begin, *path_editing.section(), ""]}
        if not chosen.paths:
            made = {"": bench(chosen.scenarios, chosen.library, command), **made}
    parts |= made
    whole = [line for name in ("", PATHS, BALL, MARKERS, THROWS, COMPARED) for line in parts.get(name, [])]
    chosen.out.write_text("\n".join(whole).rstrip() + "\n")
    print("\n".join(line for lines in made.values() for line in lines))
    return 0


if __name__ == "__main__":
    sys.exit(main())
