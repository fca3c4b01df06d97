"""The verb `touches`: who touched the ball, and when, from tracking."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from .. import __version__
from ..base.errors import InputError, told_time
from ..base.settings.options import add_options
from .outputs import Writer, check_outputs
from .progress_reporter import Told


def add(verbs):
    """The verb's parser."""
    from ..files.tracking.providers import PROVIDERS

    verb = verbs.add_parser("touches", help="who touched the ball and when, from tracking")
    verb.add_argument("input", type=Path, metavar="FILE", help="a provider's tracking, or one player's track as CSV")
    verb.add_argument("--meta", type=Path, metavar="FILE", help="the provider's metadata; default: looked for beside")
    verb.add_argument("--provider", metavar="NAME",
                      help=f"whose form FILE has: {', '.join(PROVIDERS)}; default: guessed from its content")
    add_options(verb, "touches")
    verb.add_argument("--out", type=Path, required=True, metavar="TOUCHES.csv")
    verb.add_argument("--ball", type=Path, metavar="BALL.csv", help="the solved path at the times of the samples")
    verb.add_argument("--report", type=Path, metavar="R.json")
    verb.set_defaults(run=run)
    return verb


def run(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`touches`: solves the ball and writes what was asked for."""
    from ..ball.tracked.solve import solve_ball
    from ..files.tables import write_ball, write_report
    from ..files.touches_csv import write_touches
    from ..motion.track.ball_path import BallPath

    begun = time.perf_counter()
    check_outputs(options.out, options.ball, options.report, never=(options.input, options.meta))
    if options.start is not None and options.end is not None and options.end <= options.start:
        raise InputError("--to", f"{told_time(options.end)} s", f"later than --from {told_time(options.start)} s")
    source = _read(options)
    loaded = time.perf_counter()
    solved = solve_ball(source, told.progress, told.cancelled, options.start, options.end)
    done = time.perf_counter()
    write_touches(options.out, solved.touches)
    if options.ball:
        write_ball(options.ball, BallPath(solved.times, solved.ball.at(solved.times), solved.measured))
    if options.report:
        write_report(options.report, {**report(solved), "seconds": {"load": loaded - begun, "solve": done - loaded}})
    told.end()
    for note in solved.notes:
        told.note(f"{options.input}: {note}")
    print(f"{options.out}: {len(solved.touches)} touches in {solved.times[-1] - solved.times[0]:.1f} s")


def _read(options):
    """The match, or the track where the file is the contract's own table."""
    from ..files.tracking.tracking import read_match, read_track_csv

    if options.input.is_file() and not options.provider:
        with open(options.input, "rb") as file:
            if b"time_s" in file.readline(4096):
                if options.meta:
                    raise InputError(
                        "--meta", f"{options.meta} beside a player's track", "none: a track has no metadata"
                    )
                return replace(read_track_csv(options.input), name=options.input.stem)  # who touches, in the table
    return read_match(options.input, options.meta, options.provider)


def report(solved) -> dict:
    """The figures of a `SolvedBall`, for JSON."""
    off = solved.residuals[solved.measured & np.isfinite(solved.residuals)]
    spread = [touch.uncertainty for touch in solved.touches]
    return {
        "version": __version__, "samples": len(solved.times), "touches": len(solved.touches),
        "kinds": dict(Counter(touch.kind for touch in solved.touches)),
        "parts": dict(Counter(touch.part for touch in solved.touches)),
        "players": dict(Counter(touch.player for touch in solved.touches)),
        "filled_share": solved.filled.mean(), "outliers": int(np.count_nonzero(solved.outlier)),
        "measured_share": solved.measured.mean(),
        "residual_m": _percentiles(off), "uncertainty_s": _percentiles(np.array(spread)),
        "confidence": solved.confidence,
        "pieces": dict(Counter(piece.kind for piece in solved.pieces)),
        "ends": [vars(end) for end in solved.ends], "notes": list(solved.notes),
    }  # fmt: skip


def _percentiles(values: np.ndarray) -> dict | None:
    if not len(values):
        return None
    return {"median": np.median(values), "p95": np.percentile(values, 95), "max": values.max()}
