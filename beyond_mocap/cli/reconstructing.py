"""The verbs `reconstruct` and `release`.

`reconstruct` solves a moving skeleton from the optical markers of a trial, or of each trial in a folder. `release`
finds when and how a ball left the hand.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from .. import __version__
from ..base.errors import InputError
from ..base.settings.options import add_options, option_values
from .outputs import Told, Writer, build_take, check_outputs, writer_of

_MOST_LINES = 12  # notes that the command prints; the report has all


def add_reconstruct(verbs):
    """Add the verb `reconstruct`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("reconstruct", help="solve a moving skeleton from optical markers (.c3d, .trc)")
    verb.add_argument("trial", type=Path, metavar="TRIAL", help="a marker recording, or a folder of them")
    verb.add_argument("--static", type=Path, metavar="STATIC", help="the same markers on the same body, standing")
    verb.add_argument("--model", type=Path, metavar="MODEL.json", help="a saved model, instead of --static")
    verb.add_argument("--out", type=Path, required=True, metavar="OUT.bvh", help="a folder for a folder of trials")
    verb.add_argument("--report", type=Path, metavar="R.json")
    verb.add_argument("--save-model", type=Path, metavar="MODEL.json")
    add_options(verb, "markers")
    verb.set_defaults(run=run_reconstruct)
    return verb


def run_reconstruct(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """Run `reconstruct` on one trial, or on all trials in a folder.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..library.keep_words import plain_words

    if options.model and options.static:
        raise InputError("--model", "set with --static", "one of them", "remove one of them")
    if options.words and not options.add_to:
        raise InputError("--words", "set without --add-to", "both", "add --add-to LIBRARY")
    options.words = plain_words(options.words)
    if options.trial.is_dir():
        _run_folder(options, told)
    else:
        _run_one(options, told, writers)


def _run_one(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """Reconstruct one trial and write its files."""
    from ..files.tables import write_report
    from ..markers.files.model_json import write_model
    from ..markers.reconstruct import reconstruct

    begun = time.perf_counter()
    inputs = (options.trial, options.static, options.model)
    check_outputs(options.out, options.report, options.save_model, never=inputs)
    write = writer_of(options.out, writers)
    if options.add_to:
        from ..library.keep_words import free_place

        check_outputs(options.out, free_place(options.add_to, options.trial.stem))
    settings = settings_of(options)
    trial = read_trial(options.trial, options)
    static = None if options.static is None else read_trial(options.static, options)
    model = _read_chosen_model(options)
    loaded = time.perf_counter()
    try:
        made = reconstruct(trial, static, model, settings=settings, progress=told.progress, cancelled=told.cancelled)
    except InputError as error:
        raise _with_file(error, options) from None
    made.seconds.update(load=loaded - begun, total=time.perf_counter() - begun)
    if _is_throw(options.words) and made.release is None:
        raise InputError(options.trial, "no ball release found, but --words name a throw", "a throw", "remove --words")
    notes = add_to_library(made, options.trial.stem, options) if options.add_to else []
    if options.report:
        write_report(options.report, made.report())
    write(as_take(made), options.out)
    if options.save_model:
        write_model(made.model, options.save_model)
    told.end()
    lines = [f"{options.trial}: {line}" for line in (*trial.notes, *made.warnings)]
    _tell(told, [*_upright_alike(options, trial, static), *lines], options.report)
    for note in notes:
        told.note(note)
    print(f"{options.out}: {summary(made)}")


def _upright_alike(options, trial, static) -> list[str]:
    """Describe a difference in the up axes of two files of one kind; no line where there is none."""
    if static is None or options.up or options.trial.suffix.lower() != options.static.suffix.lower():
        return []
    mine, other = ({line.split(",")[0] for line in one.notes if " is up" in line} for one in (trial, static))
    if mine == other:
        return []
    return [f"{options.trial} and {options.static} have different up axes: {', '.join(sorted(mine | other))}; set --up"]


def _tell(told: Told, lines: list[str], report: Path | None) -> None:
    """Show the first lines of many; the report has all of them."""
    for line in lines[:_MOST_LINES]:
        told.note(line)
    if len(lines) > _MOST_LINES:
        more = len(lines) - _MOST_LINES
        told.note(f"{more} more lines: {f'see {report}' if report else 'write them with --report R.json'}")


def _run_folder(options, told: Told) -> None:
    """Reconstruct all trials of a folder.

    Each gets NAME.bvh, NAME.report.json and, with a static trial, NAME.model.json; trials.json and report.html
    summarize all.
    """
    from ..markers.reconstruct_folder import reconstruct_folder, recordings_of

    for name in ("static", "report", "save_model"):
        if getattr(options, name):
            raise InputError(f"--{name.replace('_', '-')}", "set with a folder of trials", "one trial",
                             "remove it: static trials are detected, and each trial gets a report")  # fmt: skip
    if options.add_to and not options.add_to.is_dir():
        raise InputError(options.add_to, "is not a folder", "a library's folder", "create the folder first")
    recordings_of(options.trial)  # raises InputError where there are none
    settings = settings_of(options)
    model = _read_chosen_model(options)
    _check_folder(options.out, options.trial)
    read = partial(read_trial, options=options)
    rows = []
    for made in reconstruct_folder(options.trial, read, settings, model=model, progress=told.progress,
                                   cancelled=told.cancelled):
        rows.append(_kept(made, options))
        told.end()
        print(rows[-1]["line"])
    _write_overview(rows, options, told)
    if not any(row["bvh"] for row in rows):
        raise InputError(options.trial, "no trial could be reconstructed", "at least one", rows[0]["line"])


def _check_folder(out: Path, trials: Path) -> None:
    if out.exists() and not out.is_dir():
        raise InputError(out, "is a file", "a folder, because the input is one", "choose another name")
    if out.resolve() == trials.resolve():
        raise InputError(out, "is the folder of the trials", "another folder", "choose another folder")
    if not out.exists():
        check_outputs(out)
        out.mkdir()


def _kept(made, options) -> dict:
    """Write the files of one trial's result; return its row of trials.json."""
    from ..files.bvh import bvh
    from ..files.tables import write_report
    from ..markers.files.model_json import write_model

    name = made.recording.name
    row = {"trial": name, "file": str(made.recording.path), "session": made.recording.session, "error": made.error,
           "static": made.static and made.static.name, "bvh": "", "report": ""}  # fmt: skip
    if made.made is None:
        return {**row, "line": f"{name}: {made.error.removeprefix(f'{made.recording.path.stem}: ')}"}
    place = options.out / name
    place.parent.mkdir(parents=True, exist_ok=True)
    bvh.write(place.parent / f"{place.name}.bvh", made.made.motion)
    write_report(place.parent / f"{place.name}.report.json", made.made.report())
    write_model(made.made.model, place.parent / f"{place.name}.model.json")
    try:
        notes = add_to_library(made.made, name.replace("/", "_"), options) if options.add_to else []
    except InputError as error:  # concerns this clip only
        notes = [f"not added: {error}"]
    return {**row, "bvh": f"{name}.bvh", "report": f"{name}.report.json", "subject": made.made.model.subject,
            "line": "; ".join([f"{name}: {summary(made.made)}", *filter(None, [made.note]), *notes])}  # fmt: skip


def _write_overview(rows, options, told: Told) -> None:
    """Write trials.json, and report.html if matplotlib is installed."""
    from ..evaluation.plots import require_matplotlib
    from ..files.tables import write_report
    from ..files.whole import atomic_write
    from ..markers.trials_page import trials_report

    write_report(options.out / "trials.json", {"trials": rows})
    try:
        require_matplotlib()
    except InputError as error:
        told.note(f"{options.out / 'report.html'} was not written: {error}")
        return
    atomic_write(options.out / "report.html", trials_report(options.out))


def settings_of(options):
    """Build the reconstruction settings from the command line.

    Args:
        options: the parsed command line.
    Returns:
        The `ReconstructSettings`.
    """
    from ..markers.files.marker_set_text import chosen_set
    from ..markers.reconstruct import ReconstructSettings

    found = option_values(ReconstructSettings, options, "markers")
    if _is_throw(options.words) and options.release == "auto":
        found["release"] = "yes"
    return ReconstructSettings(marker_set=options.marker_set and chosen_set(options.marker_set), **found)


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


def _with_file(error: InputError, options) -> InputError:
    """Add the file's path to an error: trials know only the file's name."""
    for path in (options.trial, options.static):
        if path is not None and error.where == path.stem:
            return InputError(path, str(error).split(": ", 1)[1])
    return error if error.where.startswith("--") else InputError(options.trial, str(error))


def as_take(made):
    """Convert a reconstruction to a take, for the writers of takes (Blender's formats too).

    Args:
        result: the reconstruction.
    Returns:
        A `Take`.
    """
    from ..motion.contacts import detect

    known = {} if made.release is None else {"ball": made.release.path}
    with suppress(InputError):  # no legs
        known["contacts"] = detect(made.motion)
    return build_take(made.motion, made.raw.name, "reconstruct", start_time=made.trial.start, warnings=made.warnings,
                      **known)


def summary(made) -> str:
    """Describe a reconstruction in one line.

    Args:
        result: the reconstruction.
    Returns:
        Frames, duration, markers and their mean distance.
    """
    residual = made.solved.residual[np.isfinite(made.solved.residual)]
    near = f", markers {1000.0 * np.mean(residual):.1f} mm off" if len(residual) else ""
    return f"{len(made.motion)} frames, {made.motion.duration:.1f} s, {len(made.model.markers)} markers{near}"


def _is_throw(words) -> bool:
    return any(word.startswith("throw") for word in words)


def add_to_library(made, name: str, options) -> list[str]:
    """Add the motion to a library as a clip; a throw's labels are placed at its release.

    Args:
        result: the reconstruction.
        name: name of the clip.
        options: the parsed command line.
    Returns:
        Notes for the user.
    """
    from ..library.keep_words import add_clip

    key = None
    if _is_throw(options.words) and made.release is not None:
        key = made.release.frame / made.motion.fps
    return add_clip(options.add_to, name, made.on_floor(), options.words, key)


def add_release(verbs):
    """Add the verb `release`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("release", help="when and how a ball leaves the hand in a recorded throw")
    verb.add_argument("trial", type=Path, metavar="TRIAL", help="markers, .c3d or .trc")
    verb.add_argument("--motion", type=Path, required=True, metavar="M.bvh", help="the motion of this trial")
    verb.add_argument("--report", type=Path, required=True, metavar="R.json")
    add_options(verb, "release")
    verb.set_defaults(run=run_release)
    return verb


def run_release(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """Run `release`: find the ball's release and write the requested files.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
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
    told.end(f"{options.trial}: {note}" for note in found.notes)
    radar = ""
    if found.radar is not None:
        radar = f", radar {found.radar:.1f} m/s ({100 * (found.speed / found.radar - 1):+.1f} %)"
    print(
        f"{options.report}: {found.side} hand, released at {found.time:.3f} s (frame {found.frame}, +-"
        f"{1000 * found.time_sigma:.0f} ms), {found.speed:.1f} +- {found.speed_sigma:.1f} m/s{radar}"
    )
