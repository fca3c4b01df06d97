"""The verb `compare`: methods of synthesis side by side on a folder of scenarios."""

from __future__ import annotations

import argparse
import csv
import io
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from ..base.errors import InputError, format_count
from ..base.optional_packages import import_optional
from ..base.settings.options import add_options, parse_path
from .library import open_library
from .outputs import ProgressReporter, Writer, check_outputs, write_bvh

_FORMS = (".html", ".md", ".json")
_METHODS = "path,distance,distance-no-catch-up,blocks,fs,baseline"
_FPS = 30.0
STUDY_TABLE = "clips.csv"


def add_compare(verbs) -> argparse.ArgumentParser:
    """Add the verb `compare`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("compare", help="methods of synthesis side by side on your own clips and tracks")
    verb.add_argument("--library", type=parse_path, required=True, help="folder of the clips")
    verb.add_argument("--scenarios", type=parse_path, required=True, metavar="FOLDER",
                      help="tracks NAME.csv with labels NAME.txt")
    verb.add_argument("--methods", default=_METHODS, metavar="NAMES", help="methods with commas; default %(default)s")
    verb.add_argument("--out", type=parse_path, required=True, metavar="REPORT",
                      help=".html with curves (needs matplotlib), .md, or .json with all figures")
    verb.add_argument("--takes", type=parse_path, metavar="FOLDER",
                      help="also write every take there, METHOD/SCENARIO.bvh, with a table of them for the verb study")
    add_options(verb, "library")
    verb.set_defaults(run=run_compare)
    return verb


def run_compare(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `compare`: synthesize all scenarios by all methods, and write the report.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: not used; takes are written as BVH.
    Raises:
        InputError: for other forms of report, unknown methods, or a folder without tracks.
    """
    from ..evaluation.methods.comparison import choose_methods, compare_methods
    from ..evaluation.methods.scenarios import check_labels, read_scenarios
    from ..evaluation.methods.tables import describe_differences

    methods = choose_methods(options.methods)
    check_report(options.out)
    scenarios, notes = read_scenarios(options.scenarios, _FPS)
    if options.takes is not None:
        _check_takes(options.takes, options.out)
    library = open_library(options, reporter)
    check_labels(scenarios, library.labels)
    comparison = compare_methods(library, scenarios, methods, _FPS, progress=reporter.show_progress,
                                 cancelled=reporter.is_cancelled)
    comparison = replace(comparison, notes=notes)
    write_comparison(comparison, options.out)
    if options.takes is not None:
        write_takes(comparison, options.takes)
    reporter.finish(notes)
    counted = f"{format_count(len(scenarios), 'scenario')}, {format_count(len(methods), 'method')}"
    print("\n".join([*describe_differences(comparison), f"{options.out}: {counted}"]))


def check_report(out: Path) -> None:
    """Check before the work that a report can be written.

    Raises:
        InputError: if it cannot.
    """
    if out.suffix.lower() not in _FORMS:
        raise InputError(out, f"file type {out.suffix}" if out.suffix else "no file type",
                         f"one of {', '.join(_FORMS)}", "choose another file name")
    check_outputs(out)
    if out.suffix.lower() == ".html":
        import_optional("matplotlib", "HTML report")


def _check_takes(folder: Path, out: Path) -> None:
    """Raise InputError if the folder of the takes exists and has anything in it, or will have the report in it."""
    from ..files.atomic import check_new_folder

    if folder.resolve() in (out.resolve(), *out.resolve().parents):
        raise InputError(folder, f"the report {out} would be in it", "a folder of its own", "name another folder")
    check_new_folder(folder)
    if not folder.absolute().parent.is_dir():
        raise InputError(folder, "its folder does not exist", "an existing folder", "create the folder first")


def write_comparison(comparison, out: Path) -> None:
    """Write a comparison in the form that the file's ending names.

    Args:
        comparison: a `MethodComparison`.
        out: the file.
    """
    from ..evaluation.methods.report import build_comparison_page, build_comparison_report
    from ..evaluation.methods.tables import format_markdown
    from ..files.atomic import atomic_write
    from ..files.tables import write_report

    form = out.suffix.lower()
    if form == ".json":
        write_report(out, dict(build_comparison_report(comparison)))
    elif form == ".html":
        atomic_write(out, build_comparison_page(comparison))
    else:
        atomic_write(out, "\n".join(["# Methods compared", "", *format_markdown(comparison)]))


def write_takes(comparison, folder: Path) -> None:
    """Write every take as BVH, and a table of them in the form that `study order` reads.

    Args:
        comparison: a `MethodComparison`.
        folder: a new or empty folder.
    """
    from ..files.atomic import atomic_folder

    table = io.StringIO(newline="")
    rows = csv.writer(table, lineterminator="\n")
    rows.writerow(("file", "system", "scenario"))
    with atomic_folder(folder) as place:
        for (scenario, method), result in comparison.results.items():
            (place / method).mkdir(exist_ok=True)
            write_bvh(result.take, place / method / f"{scenario}.bvh")
            rows.writerow((f"{method}/{scenario}.bvh", method, scenario))
        (place / STUDY_TABLE).write_text(table.getvalue(), "utf-8")
