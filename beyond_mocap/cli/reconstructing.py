"""The verbs `reconstruct` and `release`.

`reconstruct` solves a moving skeleton from the optical markers of a trial, or of each trial in a folder. `release`
finds when and how a ball left the hand.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

from .. import __version__
from ..base.errors import InputError, describe_no_folder, format_count
from ..base.optional_packages import import_optional
from ..base.settings.options import add_options, name_options, option_values, parse_path
from .outputs import ProgressReporter, Writer, build_take, check_outputs, choose_writer

_MAX_LINES = 12  # notes that the command prints; the report has all


def add_reconstruct(verbs):
    """Add the verb `reconstruct`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("reconstruct", help="solve a moving skeleton from optical markers (.c3d, .trc)")
    verb.add_argument("trial", type=parse_path, metavar="TRIAL", help="a marker recording, or a folder of them")
    verb.add_argument("--static", type=parse_path, metavar="STATIC", help="the same markers on the same body, standing")
    verb.add_argument("--model", type=parse_path, metavar="MODEL.json", help="a saved model, instead of --static")
    verb.add_argument("--out", type=parse_path, required=True, metavar="OUT.bvh",
                      help="a folder for a folder of trials")
    verb.add_argument("--report", type=parse_path, metavar="R.json", help="write all figures to this file")
    verb.add_argument("--save-model", type=parse_path, metavar="MODEL.json", help="keep the model for other trials")
    verb.add_argument("--ball-csv", type=parse_path, metavar="B.csv",
                      help="the ball, where markers are named so; as OUT.ball.csv a library reads it with the clip")
    add_options(verb, "markers")
    verb.set_defaults(run=run_reconstruct)
    return verb


def run_reconstruct(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `reconstruct` on one trial, or on all trials in a folder.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..library.folder.label_files import parse_labels

    if options.model and options.static:
        raise InputError("--model", "set with --static", "one of them", "remove one of them")
    if options.words and not options.add_to:
        raise InputError("--words", "set without --add-to", "both", "add --add-to LIBRARY")
    options.words = parse_labels(options.words)
    if options.trial.is_dir():
        _reconstruct_folder(options, reporter)
    else:
        _reconstruct_trial(options, reporter, writers)


def _reconstruct_trial(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Reconstruct one trial and write its files."""
    from ..files.tables import write_report
    from ..markers.files.model_json import write_model
    from ..markers.reconstruct import reconstruct

    started = time.perf_counter()
    inputs = (options.trial, options.static, options.model)
    check_outputs(options.out, options.report, options.save_model, options.ball_csv, reserved=inputs,
                  library=options.add_to, motion=options.out)
    write = choose_writer(options.out, writers)
    if options.add_to:
        from ..library.folder.label_files import find_free_file

        check_outputs(options.out, find_free_file(options.add_to, options.trial.stem))
    settings = build_settings(options)
    trial = read_trial(options.trial, options)
    static = None if options.static is None else read_trial(options.static, options)
    model = _read_chosen_model(options)
    loaded = time.perf_counter()
    try:
        result = reconstruct(trial, static, model, settings=settings, progress=reporter.show_progress,
                             cancelled=reporter.is_cancelled)
    except InputError as error:
        raise _add_file_name(error, options) from None
    result.seconds.update(load=loaded - started, total=time.perf_counter() - started)
    if _names_throw(options.words) and result.release is None:
        raise InputError(options.trial, "no ball release found, but --words name a throw", "a throw", "remove --words")
    notes = add_to_library(result, options.trial.stem, options) if options.add_to else []
    if options.report:
        write_report(options.report, result.report())
    write(to_take(result), options.out)
    if options.save_model:
        write_model(result.model, options.save_model)
    if options.ball_csv:
        notes += _write_ball(result, options.ball_csv)
    reporter.finish()
    lines = [f"{options.trial}: {name_options(line, 'markers')}" for line in (*trial.notes, *result.warnings)]
    _show_lines(reporter, [*_compare_up_axes(options, trial, static), *lines], options.report)
    for note in notes:
        reporter.show_note(note)
    print(f"{options.out}: {describe_result(result)}")


def _write_ball(result, table: Path) -> list[str]:
    """Write the ball of a trial, if markers show one; return notes."""
    from ..files.tables import write_ball
    from ..markers.recorded_ball import trace_recorded_ball

    ball, notes = trace_recorded_ball(result, on_floor=False)
    if ball is None:
        return [f"no marker is named as a ball, so {table} is not written"]
    write_ball(table, ball)
    return list(notes)


def _compare_up_axes(options, trial, static) -> list[str]:
    """Describe a difference in the up axes of two files of one kind; no line where there is none."""
    if static is None or options.up or options.trial.suffix.lower() != options.static.suffix.lower():
        return []
    trial_axes, static_axes = ({line.split(",")[0] for line in one.notes if " is up" in line}
                               for one in (trial, static))
    if trial_axes == static_axes:
        return []
    axes = ', '.join(sorted(trial_axes | static_axes))
    return [f"{options.trial} and {options.static} have different up axes: {axes}; set --up"]


def _show_lines(reporter: ProgressReporter, lines: list[str], report: Path | None) -> None:
    """Show the first lines of many; the report has all of them."""
    for line in lines[:_MAX_LINES]:
        reporter.show_note(line)
    if len(lines) > _MAX_LINES:
        more = format_count(len(lines) - _MAX_LINES, "more line")
        reporter.show_note(f"{more}: {f'see {report}' if report else 'write them with --report R.json'}")


def _reconstruct_folder(options, reporter: ProgressReporter) -> None:
    """Reconstruct all trials of a folder.

    Each gets NAME.bvh, NAME.report.json and, with a static trial, NAME.model.json; trials.json and report.html
    summarize all.
    """
    from ..markers.pooled_balls import select_throw
    from ..markers.reconstruct_folder import list_recordings, reconstruct_folder

    for name in ("static", "report", "save_model", "ball_csv"):
        if getattr(options, name):
            raise InputError(f"--{name.replace('_', '-')}", "set with a folder of trials", "one trial",
                             "remove it: static trials are detected, and each trial gets a report")  # fmt: skip
    if options.add_to and not options.add_to.is_dir():
        raise InputError(options.add_to, "is not a folder", "a library's folder", "create the folder first")
    list_recordings(options.trial)  # raises InputError where there are none
    settings = build_settings(options)
    model = _read_chosen_model(options)
    _check_folder(options.out, options.trial)
    read = partial(read_trial, options=options)
    rows, throws = [], []
    for result in reconstruct_folder(options.trial, read, settings, model=model, progress=reporter.show_progress,
                                     cancelled=reporter.is_cancelled):
        rows.append(_write_result(result, options))
        if result.reconstruction is not None:
            recording = result.recording
            throws += select_throw(recording.name, partial(read, recording.path), result.reconstruction)
        reporter.finish()
        print(rows[-1]["line"])
    try:
        _write_pooled_balls(throws, settings, options, reporter)
    except InputError as error:  # a throw that cannot be read again; each has its own release
        reporter.show_note(f"the ball's place in the hand is each throw's own: {error}")
    _write_overview(rows, options, reporter)
    if not any(row["bvh"] for row in rows):
        raise InputError(options.trial, "no trial could be reconstructed", "at least one", rows[0]["line"])


def _check_folder(out: Path, trials: Path) -> None:
    if out.exists() and not out.is_dir():
        raise InputError(out, describe_no_folder(out), "a folder, because the input is one", "choose another name")
    if out.resolve() == trials.resolve():
        raise InputError(out, "is the folder of the trials", "another folder", "choose another folder")
    if not out.exists():
        check_outputs(out)
        out.mkdir()


def _write_result(result, options) -> dict:
    """Write the files of one trial's result; return its row of trials.json."""
    from ..files.bvh import bvh
    from ..files.tables import write_report
    from ..markers.files.model_json import write_model

    name = result.recording.name
    row = {"trial": name, "file": str(result.recording.path), "session": result.recording.session,
           "error": result.error, "static": result.static and result.static.name, "bvh": "", "report": ""}  # fmt: skip
    if result.reconstruction is None:
        return {**row, "line": f"{name}: {result.error.removeprefix(f'{result.recording.path.stem}: ')}"}
    place = options.out / name
    place.parent.mkdir(parents=True, exist_ok=True)
    bvh.write_bvh(place.parent / f"{place.name}.bvh", result.reconstruction.motion)
    write_report(place.parent / f"{place.name}.report.json", result.reconstruction.report())
    write_model(result.reconstruction.model, place.parent / f"{place.name}.model.json")
    try:
        notes = add_to_library(result.reconstruction, name.replace("/", "_"), options) if options.add_to else []
    except InputError as error:  # concerns this clip only
        notes = [f"not added: {error}"]
    return {**row, "bvh": f"{name}.bvh", "report": f"{name}.report.json",
            "subject": result.reconstruction.model.subject,
            "line": "; ".join([f"{name}: {describe_result(result.reconstruction)}", *filter(None, [result.note]),
                               *notes])}  # fmt: skip


def _write_pooled_balls(throws, settings, options, reporter: ProgressReporter) -> None:
    """Write reports and models again with the ball's place in the hand that all throws of a hand have together."""
    from ..files.tables import write_report
    from ..markers.files.model_json import write_model
    from ..markers.pooled_balls import pool_balls

    for throw, model, release in pool_balls(throws, settings):
        reporter.check_cancelled()
        place = options.out / f"{throw.name}.report.json"
        report = json.loads(place.read_text("utf-8"))
        write_report(place, {**report, "release": release.report()})
        write_model(model, options.out / f"{throw.name}.model.json")


def _write_overview(rows, options, reporter: ProgressReporter) -> None:
    """Write trials.json, and report.html if matplotlib is installed."""
    from ..files.atomic import atomic_write
    from ..files.tables import write_report
    from ..markers.trials_page import build_trials_report

    write_report(options.out / "trials.json", {"trials": rows})
    try:
        import_optional("matplotlib", "HTML report")
    except InputError as error:
        reporter.show_note(f"{options.out / 'report.html'} was not written: {error}")
        return
    atomic_write(options.out / "report.html", build_trials_report(options.out))


def build_settings(options):
    """Build the reconstruction settings from the command line.

    Args:
        options: the parsed command line.
    Returns:
        The `ReconstructSettings`.
    """
    from ..markers.files.marker_set_text import choose_set
    from ..markers.reconstruct import ReconstructSettings

    values = option_values(ReconstructSettings, options, "markers")
    if _names_throw(options.words) and options.release == "auto":
        values["release"] = "yes"
    values["marker_set"] = None if options.marker_set is None else choose_set(options.marker_set)
    return ReconstructSettings(**values)


def read_trial(path: Path, options):
    """Read a marker recording, at the frame rate of the command line if it sets one.

    Args:
        path: the file.
        options: the parsed command line.
    Returns:
        The recording.
    """
    from ..markers.files.marker_files import read_markers

    trial = read_markers(path, unit=options.unit, subject=options.subject, up=options.up)
    return replace(trial, fps=options.fps) if options.fps else trial


def _read_chosen_model(options):
    """Read the model of `--model`; None without one."""
    from ..markers.files.model_json import read_model

    return None if options.model is None else read_model(options.model)


def _add_file_name(error: InputError, options) -> InputError:
    """Add the file's path to an error: trials know only the file's name."""
    for path in (options.trial, options.static):
        if path is not None and error.where == path.stem:
            return InputError(path, str(error).split(": ", 1)[1])
    return error if error.where.startswith("--") else InputError(options.trial, str(error))


def to_take(result):
    """Convert a reconstruction to a take, for the writers of takes (Blender's formats too).

    Args:
        result: the reconstruction.
    Returns:
        A `Take`.
    """
    from ..motion.contacts import detect_contacts

    fields = {} if result.release is None else {"ball": result.release.path}
    with suppress(InputError):  # no legs
        fields["contacts"] = detect_contacts(result.motion)
    return build_take(result.motion, result.raw.name, "reconstruct", start_time=result.trial.start,
                      warnings=result.warnings, **fields)


def describe_result(result) -> str:
    """Describe a reconstruction in one line.

    Args:
        result: the reconstruction.
    Returns:
        Frames, duration, markers and their mean distance.
    """
    import numpy as np

    residual = result.solved.residual[np.isfinite(result.solved.residual)]
    distance = f", markers {1000.0 * np.mean(residual):.1f} mm off" if len(residual) else ""
    return f"{len(result.motion)} frames, {result.motion.duration:.1f} s, {len(result.model.markers)} markers{distance}"


def _names_throw(labels) -> bool:
    return any(word.startswith("throw") for word in labels)


def add_to_library(result, name: str, options) -> list[str]:
    """Add the motion to a library as a clip, with its ball; a throw's labels are placed at its release.

    Args:
        result: the reconstruction.
        name: name of the clip.
        options: the parsed command line.
    Returns:
        Notes for the user.
    """
    from ..library.folder.label_files import add_clip
    from ..markers.recorded_ball import trace_recorded_ball

    key = None
    if _names_throw(options.words) and result.release is not None:
        key = result.release.frame / result.motion.fps
    ball, notes = trace_recorded_ball(result, on_floor=True)
    return [*add_clip(options.add_to, name, result.place_on_floor(), options.words, key, ball=ball), *notes]


def add_release(verbs):
    """Add the verb `release`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("release", help="when and how a ball leaves the hand in a recorded throw")
    verb.add_argument("trial", type=parse_path, metavar="TRIAL", help="markers, .c3d or .trc")
    verb.add_argument("--motion", type=parse_path, required=True, metavar="M.bvh", help="the motion of this trial")
    verb.add_argument("--report", type=parse_path, required=True, metavar="R.json",
                      help="the release and how sure it is")
    add_options(verb, "release")
    verb.set_defaults(run=run_release)
    return verb


def run_release(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `release`: find the ball's release and write the requested files.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..files.bvh import bvh
    from ..files.tables import write_ball, write_report
    from ..markers.files.marker_files import read_markers
    from ..markers.release.release import ReleaseSettings, estimate_release

    started = time.perf_counter()
    check_outputs(options.report, options.ball_csv, reserved=(options.trial, options.motion))
    trial = read_markers(options.trial, options.unit, options.subject, options.up)
    motion = bvh.read_bvh(options.motion).motion
    loaded = time.perf_counter()
    settings = ReleaseSettings(**option_values(ReleaseSettings, options, "release"))
    try:
        found = estimate_release(trial, motion, settings)
    except InputError as error:  # trials know only the file's name
        raise error if error.where != trial.name else InputError(options.trial, str(error).split(": ", 1)[1]) from None
    done = time.perf_counter()
    report = {"version": __version__, "trial": str(options.trial), **found.report()}
    write_report(options.report, {**report, "seconds": {"load": loaded - started, "release": done - loaded}})
    if options.ball_csv:
        write_ball(options.ball_csv, found.path)
    reporter.finish(f"{options.trial}: {note}" for note in found.notes)
    radar = ""
    if found.radar is not None:
        radar = f", radar {found.radar:.1f} m/s ({100 * (found.speed / found.radar - 1):+.1f} %)"
    print(
        f"{options.report}: {found.side} hand, released at {found.time:.3f} s (frame {found.frame}, +-"
        f"{1000 * found.time_margin:.0f} ms), {found.speed:.1f} +- {found.speed_margin:.1f} m/s{radar}, direction +-"
        f"{math.degrees(found.direction_margin):.1f} degrees"
    )
