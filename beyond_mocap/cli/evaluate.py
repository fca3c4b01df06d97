"""The verb `evaluate`: every figure of a motion, with pictures."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from ..base.settings.options import add_options
from .library import open_library
from .outputs import Writer, add_take_files, check_outputs
from .progress_reporter import Told


def add_evaluate(verbs) -> argparse.ArgumentParser:
    verb = verbs.add_parser("evaluate", help="every figure of a motion")
    verb.add_argument("motion", type=Path, metavar="M.bvh")
    verb.add_argument("--track", type=Path, metavar="T.csv")
    verb.add_argument("--annotations", type=Path, metavar="A.txt")
    add_take_files(verb)
    verb.add_argument("--library", type=Path)
    add_options(verb, "library")
    verb.add_argument("--report", type=Path, required=True, metavar="R.json")
    verb.add_argument("--html", type=Path, metavar="R.html", help="a page with pictures; needs matplotlib")
    verb.set_defaults(run=run_evaluate)
    return verb


def run_evaluate(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`evaluate`: the report of a motion that was written before. `--unit` is the library's where there is one."""
    from ..annotation import read_timeline, validate
    from ..evaluation.html import html_report
    from ..evaluation.plots import require_matplotlib
    from ..evaluation.report import evaluate_played
    from ..files.bvh import bvh
    from ..files.tables import read_ball, write_report
    from ..files.tracking.tracking import read_track_csv
    from ..files.whole import atomic_write
    from ..motion.track import clean
    from ..synthesis.provenance import read_provenance
    from ..synthesis.quality.played import played_from_tables

    inputs = (options.motion, options.track, options.annotations, options.provenance, options.ball)
    check_outputs(options.report, options.html, never=inputs)
    if options.html:
        require_matplotlib()
    motion = bvh.read(options.motion, None if options.library else options.unit).motion
    track = clean(read_track_csv(options.track))[0] if options.track else None
    start = float(track.times[0]) if track else 0.0
    timeline = read_timeline(options.annotations, motion.fps, start) if options.annotations else None
    provenance = read_provenance(options.provenance) if options.provenance else None
    ball = read_ball(options.ball) if options.ball else None
    played = played_from_tables(motion, provenance, ball, start, str(options.provenance))
    library = open_library(options, told) if options.library else None
    if timeline is not None and track is not None and library is not None:  # else some words or times are not known
        validate(timeline, library.words, start, float(track.times[-1]), str(options.annotations))
    report = evaluate_played(played, track=track, timeline=timeline, library=library)
    write_report(options.report, report)
    if options.html:
        title = options.motion.name
        atomic_write(
            options.html,
            html_report(played, report, track=track, timeline=timeline, library=library, title=title),
        )
    told.end()
    if library is not None and (strangers := _strangers(played.clips, library)):
        first, count = strangers[0], len(strangers)
        told.note(
            f"{options.provenance}: {count} clips, such as {first}, are not in {options.library}: nothing to compare "
            "with"
        )
    print(options.report)


def _strangers(clips: tuple[str, ...], library) -> list[str]:
    """Those paths of a provenance that are neither recordings of the library nor made beside its cache."""
    from ..library.scan import CACHE_FOLDER

    own = {clip.path for clip in library.clips}
    return [clip for clip in clips if clip and clip not in own and not clip.startswith(CACHE_FOLDER)]
