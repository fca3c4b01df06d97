"""The verb `release`: when and how a ball left the hand of a recorded throw."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path

from .. import __version__
from ..base.errors import InputError
from ..base.settings.options import add_options, option_values
from .outputs import Writer, check_outputs
from .progress_reporter import Told


def add(verbs):
    """The verb's parser."""
    verb = verbs.add_parser("release", help="when and how a ball left the hand of a recorded throw")
    verb.add_argument("trial", type=Path, metavar="TRIAL", help="markers, .c3d or .trc")
    verb.add_argument("--motion", type=Path, required=True, metavar="M.bvh", help="the motion made from this trial")
    verb.add_argument("--report", type=Path, required=True, metavar="R.json")
    add_options(verb, "release")
    verb.set_defaults(run=run)
    return verb


def run(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`release`: finds the release and writes what was asked for."""
    from ..files.bvh import bvh
    from ..files.tables import write_ball, write_report
    from ..markers.files.marker_files import read_markers
    from ..markers.release.release import ReleaseSettings, release

    begun = time.perf_counter()
    check_outputs(options.report, options.ball_csv, never=(options.trial, options.motion))
    trial = read_markers(options.trial, options.unit, options.subject, options.up)
    motion = bvh.read(options.motion).motion
    loaded = time.perf_counter()
    settings = ReleaseSettings(**option_values(ReleaseSettings, options, "release"))
    try:
        found = release(trial, motion, settings)
    except InputError as error:  # trials know only the file's name
        raise error if error.where != trial.name else InputError(options.trial, str(error).split(": ", 1)[1]) from None
    done = time.perf_counter()
    report = {"version": __version__, "trial": str(options.trial), **found.report()}
    write_report(options.report, {**report, "seconds": {"load": loaded - begun, "release": done - loaded}})
    if options.ball_csv:
        write_ball(options.ball_csv, found.path)
    told.end()
    for note in found.notes:
        told.note(f"{options.trial}: {note}")
    radar = ""
    if found.radar is not None:
        radar = f", radar {found.radar:.1f} m/s ({100 * (found.speed / found.radar - 1):+.1f} %)"
    print(
        f"{options.report}: {found.side} hand, released at {found.time:.3f} s (frame {found.frame}, +-"
        f"{1000 * found.time_sigma:.0f} ms), {found.speed:.1f} +- {found.speed_sigma:.1f} m/s{radar}"
    )
