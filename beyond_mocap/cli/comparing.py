"""The option `--against` of the verb `evaluate`: compare takes with a library's recordings by classifiers."""

from __future__ import annotations

from pathlib import Path

from ..base.errors import InputError
from .library import open_library
from .outputs import ProgressReporter, check_outputs

_OF_ONE_MOTION = ("track", "annotations", "ball", "library", "html")  # options that do not go with --against


def run_comparison(options, reporter: ProgressReporter) -> None:
    """Run `evaluate --against LIBRARY`: write the report and print it.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
    Raises:
        InputError: for other options, missing or unsuitable files, or too little motion.
    """
    from ..evaluation.report import round_values
    from ..evaluation.two_sample_test.comparison import compare_with_recordings, format_comparison
    from ..files.bvh import bvh
    from ..files.tables import write_report
    from ..synthesis.provenance import read_provenance
    from ..synthesis.quality.playback import playback_from_tables

    for name in _OF_ONE_MOTION:
        if getattr(options, name):
            raise InputError(f"--{name}", "set with --against", "only --provenance beside it", f"remove --{name}")
    files = list_take_files(options.motion, options.provenance)
    check_outputs(options.report, reserved=tuple(path for pair in files.items() for path in pair),
                  library=options.against)
    takes = {}
    for motion, provenance in files.items():
        body = bvh.read_bvh(motion).motion
        takes[str(motion)] = playback_from_tables(body, read_provenance(provenance), where=str(provenance))
    library = open_library(options, reporter, folder=options.against)
    report = compare_with_recordings(takes, library)
    write_report(options.report, round_values(report))
    reporter.finish()
    print(format_comparison(report))
    print(options.report)


def list_take_files(paths: list[Path], provenance: Path | None = None) -> dict[Path, Path]:
    """List the takes of files and folders, each with its table of sources, NAME.provenance.csv beside NAME.bvh.

    Args:
        paths: BVH files, or folders of them.
        provenance: the table of a single take, if it has another name.
    Raises:
        InputError: without a take, for a take without a table, or a table that could be of several.
    """
    motions = []
    for path in paths:
        inside = sorted(path.glob("*.bvh")) if path.is_dir() else [path]
        if not inside:
            raise InputError(path, "no BVH file in it", "takes as NAME.bvh and NAME.provenance.csv",
                             "name the folder with the takes")
        motions += inside
    if provenance is not None and len(motions) > 1:
        raise InputError("--provenance", f"one table for {len(motions)} takes", "NAME.provenance.csv beside each take",
                         "remove --provenance")
    files = {motion: provenance or motion.with_suffix(".provenance.csv") for motion in motions}
    for motion, table in files.items():
        if motion.is_file() and not table.is_file():
            raise InputError(motion, f"{table.name} is missing", "the table of its sources",
                             "write it with synthesize --provenance")
    return files
