"""The verbs `match` and `touches`: all players' motion, or all ball touches, from a provider's tracking data."""

from __future__ import annotations

import argparse
import os
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from .. import __version__
from ..base.errors import BeyondMocapError, InputError, NotInLibraryError, format_count, format_seconds
from ..base.settings.options import add_options, option_values, parse_path
from .outputs import ProgressReporter, Writer, check_outputs, locate_errors

if TYPE_CHECKING:
    import numpy as np

_MATCH_EXAMPLES = """examples:
  %(prog)s --tracking game.dat --library clips --from 60 --to 120 --out minute
  %(prog)s --tracking game.dat --joints joints.jsonl --library clips --out bodies
  %(prog)s --tracking players.csv --sport handball --library clips --out handball"""


class _ProviderOption(argparse.Action):
    """An option whose help names all providers; they are imported only where it is shown, so that the program starts
    quickly.
    """

    @property
    def help(self) -> str:
        """The help with the providers' names."""
        from ..files.event_providers import EVENT_PROVIDERS
        from ..files.tracking.providers import PROVIDERS

        return self._text.format(", ".join(EVENT_PROVIDERS if self.dest == "events_provider" else PROVIDERS))

    @help.setter
    def help(self, text: str) -> None:
        self._text = text

    def __call__(self, parser, namespace, values, option_string=None):
        setattr(namespace, self.dest, values)


def add_match(verbs):
    """Add the verb `match`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("match", help="all players' motion and the ball of a tracked match, resumable",
                            epilog=_MATCH_EXAMPLES)
    verb.add_argument("--tracking", type=parse_path, required=True, metavar="FILE",
                      help="a provider's tracking data, or skeletal tracking")
    verb.add_argument("--joints", type=parse_path, metavar="FILE",
                      help="skeletal tracking of the same match: bodies where it shows them")
    verb.add_argument("--meta", type=parse_path, metavar="FILE", help="the provider's metadata; default: beside FILE")
    verb.add_argument("--events", type=parse_path, metavar="FILE", help="event data, from a provider or as CSV")
    verb.add_argument("--events-meta", type=parse_path, metavar="FILE",
                      help="metadata of the events; default: beside them")
    verb.add_argument("--events-provider", metavar="NAME", default="", action=_ProviderOption,
                      help="format of the events: {}; default: detected")
    verb.add_argument("--provider", metavar="NAME", default="", action=_ProviderOption,
                      help="format of FILE: {}; default: detected")
    verb.add_argument("--library", type=parse_path, required=True, help="a folder with recordings and annotations")
    verb.add_argument("--out", type=parse_path, required=True, metavar="FOLDER",
                      help="output folder; an unfinished run continues there")
    add_options(verb, "match.section")
    add_options(verb.add_mutually_exclusive_group(), "match.work")
    add_options(verb, "match")
    verb.add_argument("--nearest", action="store_true", help="use the nearest labels for missing ones; the default")
    add_options(verb, "pitch")
    verb.add_argument("--pitch", type=parse_pitch, metavar="LENGTHxWIDTH",
                      help="its size in metres, for tracking data without it; default: the sport's regular size")
    add_options(verb, "library")
    verb.set_defaults(run=run_match)
    return verb


def run_match(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `match`: synthesize what is not there yet and report the result.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..match.request import MatchRequest
    from ..match.synthesize_match import read_result, synthesize_match

    write = choose_scene_writer(options.scene, writers) if options.scene else None
    order = MatchRequest(
        tracking=options.tracking, library=options.library, out=options.out, meta=options.meta, events=options.events,
        joints=options.joints, events_meta=options.events_meta, events_provider=options.events_provider,
        provider=options.provider, pitch=options.pitch,
        **{**option_values(MatchRequest, options, "match.section", "match.work", "match", "pitch", "library"),
           "players": tuple(dict.fromkeys(options.players)), "workers": options.workers or len(_list_cores())},
    )  # fmt: skip
    if options.run_isolated is None:
        result = synthesize_match(order, reporter.show_progress, reporter.is_cancelled)
    else:
        options.run_isolated(remove_option(options.argv, "--scene"), reporter.show_progress, reporter.is_cancelled)
        result = read_result(order)
    reporter.finish(result.notes)
    for player in result.failed:
        reporter.show_note(f"player {player.id} was skipped: {player.reason}")
    if not result.finished:
        lacks_labels = {player.exit_status for player in result.failed} == {NotInLibraryError.exit_status}
        error = NotInLibraryError if lacks_labels else BeyondMocapError
        raise error(f"{options.out}: no player could be synthesized; see match.json there for the reasons")
    if write is not None:
        for line in write(result, options.scene) or ():
            reporter.show_note(line)
        print(f"{options.scene}: written")
    print(f"{options.out}: {len(result.finished)} of {len(result.finished) + len(result.failed)} players, "
          f"{result.span[1] - result.span[0]:.1f} s")  # fmt: skip


def parse_pitch(text: str) -> tuple[float, float]:
    """Parse the size of a pitch, LENGTHxWIDTH in metres.

    Args:
        text: the option's text.
    Returns:
        Length and width.
    Raises:
        ArgumentTypeError: if it is none.
    """
    from ..files.tracking.match_arrays import PITCH_SIDES, is_pitch_size

    try:
        length, width = map(float, text.lower().split("x"))
    except ValueError:
        length = width = 0.0
    if not is_pitch_size((length, width)):
        raise argparse.ArgumentTypeError(f"{text!r}: expected a length and a width of {PITCH_SIDES[0]:g} to "
                                         f"{PITCH_SIDES[1]:g} metres, such as 105x68")
    return length, width


def choose_scene_writer(scene: Path, writers: Mapping[str, Writer]) -> Writer:
    """Choose the function that writes a whole match to a file.

    Args:
        scene: the output file.
        writers: the known functions, by file suffix.
    Returns:
        The function.
    Raises:
        InputError: if no function writes this kind of file, or the file cannot be written.
    """
    check_outputs(scene)
    if not writers:
        raise InputError("--scene", f"{scene.name} cannot be written without Blender", "a run inside Blender",
                         "blender --command beyond_mocap match ...")  # fmt: skip
    if scene.suffix.lower() not in writers:
        raise InputError(scene, f"file type {scene.suffix!r}", f"one of {', '.join(sorted(writers))}")
    return writers[scene.suffix.lower()]


def remove_option(arguments: Sequence[str], option: str) -> list[str]:
    """Remove a long option with one value from a command line, also where it is abbreviated as argparse allows.

    Args:
        arguments: the command line.
        option: the long option, such as `--scene`.
    Returns:
        The other arguments.
    """
    others, remaining = [], iter(arguments)
    for argument in remaining:
        name, equals, _ = argument.partition("=")
        if len(name) > 2 and option.startswith(name):
            next(remaining if not equals else iter(()), None)
        else:
            others.append(argument)
    return others


def _list_cores() -> range | set[int]:
    """List the cores that this process may use."""
    return os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(os.cpu_count() or 1)


def add_touches(verbs):
    """Add the verb `touches`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("touches", help="who touches the ball and when, from tracking data")
    verb.add_argument("input", type=parse_path, metavar="FILE",
                      help="a provider's tracking data, or a player's track as CSV")
    verb.add_argument("--meta", type=parse_path, metavar="FILE", help="the provider's metadata; default: beside FILE")
    verb.add_argument("--provider", metavar="NAME", action=_ProviderOption,
                      help="format of FILE: {}; default: detected from its content")
    add_options(verb, "touches")
    verb.add_argument("--out", type=parse_path, required=True, metavar="TOUCHES.csv", help="a table of the touches")
    verb.add_argument("--ball", type=parse_path, metavar="BALL.csv", help="the solved trajectory at the samples' times")
    verb.add_argument("--report", type=parse_path, metavar="R.json", help="write all figures to this file")
    verb.set_defaults(run=run_touches)
    return verb


def run_touches(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `touches`: solve the ball's trajectory and write the requested files.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..ball.tracked.solve import solve_ball
    from ..files.tables import write_ball, write_report, write_touches
    from ..motion.track.ball_path import BallPath

    started = time.perf_counter()
    check_outputs(options.out, options.ball, options.report, reserved=(options.input, options.meta))
    if options.start is not None and options.end is not None and options.end <= options.start:
        raise InputError("--to", f"{format_seconds(options.end)} s",
                         f"later than --from {format_seconds(options.start)} s", "choose a later end")
    source = _read_tracking(options)
    loaded = time.perf_counter()
    with locate_errors(options.input):
        solved = solve_ball(source, reporter.show_progress, reporter.is_cancelled, options.start, options.end)
    done = time.perf_counter()
    write_touches(options.out, solved.touches)
    if options.ball:
        write_ball(options.ball, BallPath(solved.times, solved.ball.at(solved.times), solved.measured))
    if options.report:
        seconds = {"load": loaded - started, "solve": done - loaded}
        write_report(options.report, {**_build_touch_report(solved), "seconds": seconds})
    reporter.finish(f"{options.input}: {note}" for note in solved.notes)
    count = format_count(len(solved.touches), "touch", "touches")
    print(f"{options.out}: {count} in {solved.times[-1] - solved.times[0]:.1f} s")


def _read_tracking(options):
    """Read the match, or the track where the file is the project's own table."""
    from ..files.tracking.feed import is_track_csv
    from ..files.tracking.providers import find_feed
    from ..files.tracking.tracking import read_match, read_track_csv
    from ..motion.track import clean_track

    if not options.provider and is_track_csv(options.input):
        if options.meta:
            raise InputError("--meta", f"{options.meta} beside a player's track", "no metadata for a track")
        track = read_track_csv(options.input)
        clean_track(track)  # for its errors; touches are solved from the samples as they are
        return replace(track, name=options.input.stem)  # the player's name in the table
    outputs = (options.out, options.ball, options.report)
    if any(path is not None and path.exists() for path in outputs):
        feed, _ = find_feed(options.input, options.meta, options.provider)  # also the files that are found beside it
        check_outputs(*outputs, reserved=(*feed.tracking, *feed.meta))
    return read_match(options.input, options.meta, options.provider)


def _build_touch_report(solved) -> dict:
    """Build the report of a `SolvedBall`, for JSON."""
    import numpy as np

    residuals = solved.residuals[solved.measured & np.isfinite(solved.residuals)]
    spread = [touch.uncertainty for touch in solved.touches]
    return {
        "version": __version__, "samples": len(solved.times), "touches": len(solved.touches),
        "kinds": dict(Counter(touch.kind for touch in solved.touches)),
        "parts": dict(Counter(touch.part for touch in solved.touches)),
        "players": dict(Counter(touch.player for touch in solved.touches)),
        "filled_share": solved.filled.mean(), "outliers": int(np.count_nonzero(solved.outlier)),
        "measured_share": solved.measured.mean(),
        "residual_m": _compute_percentiles(residuals), "uncertainty_s": _compute_percentiles(np.array(spread)),
        "confidence": solved.confidence,
        "pieces": dict(Counter(piece.kind for piece in solved.pieces)),
        "ends": [vars(end) for end in solved.ends], "notes": list(solved.notes),
    }  # fmt: skip


def _compute_percentiles(values: np.ndarray) -> dict | None:
    """Compute median, 95th percentile and maximum; None without values."""
    import numpy as np

    if not len(values):
        return None
    return {"median": np.median(values), "p95": np.percentile(values, 95), "max": values.max()}
