"""The verb `synthesize`: one player."""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping
from pathlib import Path

from ..base.errors import NotInLibrary
from ..base.settings.options import add_options, option_values
from ..synthesis.plan import Plan
from .library import open_library
from .outputs import Writer, add_take_files, check_outputs, writer_of
from .progress_reporter import Told


def add_synthesize(verbs) -> argparse.ArgumentParser:
    verb = verbs.add_parser("synthesize", help="one player's motion from a track, annotations and a library")
    verb.add_argument("--library", type=Path, required=True)
    verb.add_argument("--track", type=Path, required=True, metavar="T.csv")
    verb.add_argument("--annotations", type=Path, required=True, metavar="A.txt")
    verb.add_argument("--out", type=Path, required=True, metavar="OUT.bvh")
    add_take_files(verb)
    verb.add_argument("--report", type=Path, metavar="R.json")
    add_options(verb, "synthesis")
    verb.add_argument("--pins", type=Path, metavar="P.csv", help="where hands, feet and gaze have to be, and when")
    add_options(verb, "player")
    add_options(verb, "library")
    verb.set_defaults(run=run_synthesize)
    return verb


def run_synthesize(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`synthesize`: one player, and what was asked to be written about it."""
    from ..annotation import read_timeline, validate
    from ..files.tables import write_ball, write_report
    from ..files.tracking.tracking import read_track_csv
    from ..motion.track import clean
    from ..synthesis.pins import read_pins
    from ..synthesis.provenance import write_provenance
    from ..synthesis.synthesize import synthesize

    begun = time.perf_counter()
    outputs = (options.out, options.provenance, options.ball, options.report)
    check_outputs(*outputs, never=(options.track, options.annotations, options.pins))
    write = writer_of(options.out, writers)
    track, data = clean(read_track_csv(options.track))
    timeline = read_timeline(options.annotations, options.fps, float(track.times[0]))
    loaded = time.perf_counter()
    library = open_library(options, told, seed=options.seed)
    validate(timeline, library.words, float(track.times[0]), float(track.times[-1]), str(options.annotations))
    ready = time.perf_counter()
    plan = Plan(
        track=track, timeline=timeline, library=str(options.library),
        pins=read_pins(options.pins) if options.pins else (), **option_values(Plan, options, "synthesis", "player"),
    )
    try:
        take = synthesize(library, plan, told.progress, told.cancelled)
    except NotInLibrary as error:
        raise NotInLibrary(f"{options.annotations}: {error}", error.nearest) from None
    take.seconds.update(load=loaded - begun, library=ready - loaded, total=time.perf_counter() - begun)
    if options.report:
        from ..evaluation.report import evaluate

        report = evaluate(take, track, library)
        report["warnings"] = [*report.get("warnings", []), *data.lines]
    write(take, options.out)
    if options.provenance:
        write_provenance(options.provenance, take)
    if options.ball and take.ball is not None:
        write_ball(options.ball, take.ball)
    if options.report:
        write_report(options.report, report)
    told.end()
    if library.notes:
        notes = f"{len(library.notes)} notes on how its recordings were read and mended"
        told.note(f"{options.library}: {notes}; the command 'library' prints them")
    of_take = [line for line in take.warnings if line not in library.notes]
    for line in (*of_take, *(f"{options.track}: {line}" for line in data.lines)):
        told.note(line)
    if options.ball and take.ball is None:
        told.note(f"{options.track} has no ball, so {options.ball} was not written")
    print(f"{options.out}: {len(take.motion)} frames, {take.motion.duration:.1f} s")
