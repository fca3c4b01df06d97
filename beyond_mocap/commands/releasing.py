"""The verb `release`: when and how a ball left the hand of a recorded throw."""

from __future__ import annotations

import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path

from .. import __version__
from ..errors import InputError
from .numbers import between
from .outputs import Writer, check_outputs
from .told import Told


def add(verbs):
    """The verb's parser."""
    from ..ball.physics import THROWN

    verb = verbs.add_parser("release", help="when and how a ball left the hand of a recorded throw")
    verb.add_argument("trial", type=Path, metavar="TRIAL", help="markers, .c3d or .trc")
    verb.add_argument("--motion", type=Path, required=True, metavar="M.bvh", help="the motion made from this trial")
    verb.add_argument("--report", type=Path, required=True, metavar="R.json")
    verb.add_argument("--ball-marker", metavar="LABEL", help="the marker on the ball; default: one named as a ball")
    radius = partial(between, low=0.01, high=0.2, expected="0.01 to 0.2 metres")
    verb.add_argument("--radius", type=radius, metavar="METRES", help="of the ball; default: its kind's, or as fitted")
    verb.add_argument("--hand", choices=("left", "right"), help="that throws; default: found")
    verb.add_argument("--ball-kind", choices=tuple(THROWN), default="baseball")
    verb.add_argument("--ball-csv", type=Path, metavar="B.csv", help="the ball's way over the whole trial")
    verb.add_argument("--unit", metavar="UNIT", help="of the markers: metres per unit, or mm, cm, m, in")
    verb.add_argument("--subject", metavar="NAME", help="whose markers, where there are several bodies in the file")
    verb.add_argument("--up", metavar="AXIS", help="of the file that points up: X, Y, Z or --up=-Y; default: found")
    verb.set_defaults(run=run)
    return verb


def run(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`release`: finds the release and writes what was asked for."""
    from ..files import bvh
    from ..files.marker_files import read_markers
    from ..files.tables import write_ball, write_report
    from ..release import ReleaseSettings, release

    begun = time.perf_counter()
    check_outputs(options.report, options.ball_csv, never=(options.trial, options.motion))
    trial = read_markers(options.trial, options.unit, options.subject, options.up)
    motion = bvh.read(options.motion).motion
    loaded = time.perf_counter()
    settings = ReleaseSettings(options.ball_marker, options.radius, options.hand, options.ball_kind)
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
