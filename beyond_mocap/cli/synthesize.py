"""The verbs `synthesize` and `evaluate`: synthesize one player's motion, and evaluate a motion."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ..base.errors import InputError, NotInLibraryError, format_count
from ..base.memory import check_memory
from ..base.optional_packages import import_optional
from ..base.settings.match import OVERLAP, WINDOW
from ..base.settings.options import add_options, describe_ignored_options, name_options, option_values, parse_path
from .comparing import run_comparison
from .library import check_library_options, open_library
from .outputs import ProgressReporter, Writer, add_take_files, check_outputs, choose_writer, locate_errors

if TYPE_CHECKING:  # imported where they are used: the command line starts at once
    from ..annotation import Timeline
    from ..library.library import Library
    from ..motion.track import Track
    from ..synthesis.plan import Plan

LONG_TRACK = 1200.0  # s of a track from which on it is done in windows
_WINDOW_LIMITS = (2.0 * OVERLAP, 3600.0)  # s
_FRAME_BYTES = 27e3  # of memory that a frame of a track takes that is not done in windows
_BASE_BYTES = 1e8  # of memory that any take needs
_MAX_REPORT_BYTES = 100_000_000  # no report is as large
_OTHER_LENGTH, _OTHER_PLACE = 1.0, 2.0  # s and m by which a motion differs from its track at most


def add_synthesize(verbs) -> argparse.ArgumentParser:
    """Add the verb `synthesize`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("synthesize", help="synthesize a player's motion from track, annotations and library")
    verb.add_argument("--library", type=parse_path, required=True, help="a folder with recordings and annotations")
    verb.add_argument("--track", type=parse_path, required=True, metavar="T.csv",
                      help="the player's track, and the ball")
    verb.add_argument("--annotations", type=parse_path, metavar="A.txt",
                      help="the labels; "
                           "default: T.txt beside T.csv, or S_annotations.txt beside S_track.csv, else all automatic")
    verb.add_argument("--out", type=parse_path, required=True, metavar="OUT.bvh", help="the motion")
    add_take_files(verb)
    verb.add_argument("--report", type=parse_path, metavar="R.json", help="write all figures to this file")
    add_options(verb, "synthesis")
    verb.add_argument("--keep-root", action="store_true", help="put the joints that the library's skeleton has above "
                      "the hips in its recordings, such as a root, back above those of OUT")
    verb.add_argument("--window", type=float, metavar="SECONDS",
                      help="search and construct the track in windows of so many seconds, "
                           f"{_WINDOW_LIMITS[0]:g} to {_WINDOW_LIMITS[1]:g}, which takes less memory; "
                           f"default: {WINDOW:g} for tracks above {LONG_TRACK / 60.0:g} minutes; 0: never")
    verb.add_argument("--solve-touches", action="store_true", default=True, help="the default; version 0.1 needed it")
    verb.add_argument("--pins", type=parse_path, metavar="P.csv",
                      help="targets of hands, feet, gaze and ball with times")
    verb.add_argument("--headings", type=parse_path, metavar="H.csv", help="where the body faces, with times")
    add_options(verb, "player")
    add_options(verb, "library")
    verb.set_defaults(run=run_synthesize)
    return verb


def run_synthesize(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `synthesize`: synthesize one player's motion and write the requested files.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..annotation import Timeline, check_timeline, read_timeline
    from ..annotation.label_candidates import find_track_labels
    from ..files.tracking.tracking import read_track_csv
    from ..motion.track import clean_track
    from ..synthesis.search.request import USE_NEAREST

    started = time.perf_counter()
    outputs = (options.out, options.provenance, options.ball, options.report)
    annotations = options.annotations or find_track_labels(options.track)
    check_outputs(*outputs, reserved=(options.track, annotations, options.pins, options.headings,
                                      options.skeleton), library=options.library, motion=options.out)
    write = choose_writer(options.out, writers)
    track, data = clean_track(read_track_csv(options.track))
    timeline = read_timeline(annotations, options.fps, float(track.times[0])) if annotations else Timeline()
    window, loaded = _choose_window(options, track), time.perf_counter()
    library = open_library(options, reporter, seed=options.seed)
    check_timeline(timeline, library.labels, float(track.times[0]), float(track.times[-1]), str(annotations))
    above = _read_root(options, library, reporter) if options.keep_root else ()
    ready = time.perf_counter()
    plan = _build_plan(options, track, timeline)
    seconds = {"load": loaded - started, "library": ready - loaded}
    try:
        if window:
            frames, ball, warnings = _synthesize_in_windows(options, reporter, library, plan, window=window,
                                                            above=above, seconds=seconds, lines=data.lines)
        else:
            frames, ball, warnings = _synthesize_whole(options, reporter, library, plan, seconds=seconds,
                                                       write=partial(write, above=above) if above else write,
                                                       lines=data.lines)
    except NotInLibraryError as error:
        message = str(error.locate(annotations)).replace(USE_NEAREST, "add --nearest")
        raise NotInLibraryError(message, error.nearest, error.line, error.fixes) from None
    reporter.finish()
    messages = [*(line for line in warnings if line not in library.notes),
                *(f"{options.track}: {line}" for line in data.lines)]
    for line in (*_describe_inputs(options, library, annotations),
                 *(name_options(line, "synthesis") for line in messages),
                 *describe_ignored_options(options, "synthesis", "player")):
        reporter.show_note(line)
    if options.ball and ball is None:
        reporter.show_note(_describe_missing_ball(options, library))
    print(f"{options.out}: {frames} frames, {(frames - 1) / options.fps:.1f} s")


def _build_plan(options, track: Track, timeline: Timeline) -> Plan:
    """Build the plan of the command line."""
    from ..synthesis.heading_table import read_heading_keys
    from ..synthesis.pin_table import read_pins
    from ..synthesis.plan import Plan

    return Plan(
        track=track, timeline=timeline, library=str(options.library),
        pins=read_pins(options.pins) if options.pins else (),
        heading_keys=read_heading_keys(options.headings) if options.headings else (),
        **option_values(Plan, options, "synthesis", "player"),
    )


def _describe_inputs(options, library: Library, annotations: Path | None) -> list[str]:
    """Describe where the labels come from, and that there are notes on the library."""
    from ..annotation.label_candidates import find_label_candidates

    lines = []
    if annotations and not options.annotations:
        lines.append(f"{options.track}: with the labels of {annotations}")
    if candidates := find_label_candidates(options.track) if not annotations else ():
        lines.append(f"{options.track}: no labels; {candidates[0]} may have them, name it with --annotations")
    if library.notes:
        notes = f"{format_count(len(library.notes), 'note')} on how its recordings were read and repaired"
        lines.append(f"{options.library}: {notes}; the command 'library' prints all")
    return lines


def _describe_missing_ball(options, library: Library) -> str:
    """Describe why no ball is written, and whether the recordings have one."""
    has_recorded = any(clip.ball is not None for clip in library.clips)
    hint = "; --recorded-ball takes that of the recordings" if has_recorded and not options.recorded_ball else ""
    return f"{options.track} has no ball, so {options.ball} is not written{hint}"


def _read_root(options, library, reporter: ProgressReporter) -> tuple:
    """Read the joints above the hips in the recordings of the library's skeleton; a note where there are none."""
    from ..library.common_skeleton import read_joints_above_hips

    above = read_joints_above_hips(library, options.skeleton, options.unit)
    if not above:
        reporter.show_note(f"{options.library}: no joint above the hips in its recordings; --keep-root adds none")
    return above


def _choose_window(options, track) -> float:
    """Choose the seconds of the windows, 0 for the whole track at once.

    Raises:
        InputError: where windows are asked for that this take cannot have, or a whole take needs more memory than is
            free.
    """
    seconds, window = float(track.times[-1] - track.times[0]), options.window
    can_be_cut = options.method == "path" and options.out.suffix.lower() == ".bvh"
    if window and not can_be_cut:
        raise InputError("--window", f"method {options.method} to {options.out.suffix}", "method path to .bvh",
                         "leave it out")
    if window and not _WINDOW_LIMITS[0] <= window <= _WINDOW_LIMITS[1]:
        raise InputError("--window", f"{window:g} s", f"{_WINDOW_LIMITS[0]:g} to {_WINDOW_LIMITS[1]:g} s, "
                         "or 0 for the whole track at once")
    if window is None:
        window = WINDOW if can_be_cut and seconds > LONG_TRACK else 0.0
    if not window:
        next_step = "use --window" if can_be_cut else "use a shorter track"
        check_memory(options.track, _BASE_BYTES + _FRAME_BYTES * seconds * options.fps, next_step)
    return window


def _synthesize_whole(options, reporter: ProgressReporter, library, plan, *, write: Writer, seconds: dict,
                      lines):
    """Synthesize a track at once and write its files; returns the number of frames, the ball and warnings."""
    from ..files.tables import write_ball, write_report
    from ..synthesis.provenance import write_provenance
    from ..synthesis.synthesize import synthesize

    started = time.perf_counter()
    take = synthesize(library, plan, reporter.show_progress, reporter.is_cancelled)
    take.seconds.update(**seconds, total=sum(seconds.values()) + time.perf_counter() - started)
    if options.report:
        from ..evaluation.report import evaluate

        with reporter.stop_at_once():
            report = evaluate(take, plan.track, library)
        report["warnings"] = [*report.get("warnings", []), *lines]
    notes = write(take, options.out) or ()
    if options.provenance:
        write_provenance(options.provenance, take)
    if options.ball and take.ball is not None:
        write_ball(options.ball, take.ball)
    if options.report:
        write_report(options.report, report)
    return len(take.motion), take.ball, (*take.warnings, *notes)


def _synthesize_in_windows(options, reporter: ProgressReporter, library, plan, *, window: float, above: tuple,
                           seconds: dict, lines):
    """Synthesize a track in windows and write its files; returns the number of frames, the ball and warnings."""
    from ..files.bvh.bvh_write import BvhForm
    from ..files.tables import write_report
    from ..match.long_player import LongTakeFiles, iter_parts, search_long_player
    from ..match.pieces.units import count_frames

    started, report = time.perf_counter(), (reporter.show_progress, reporter.is_cancelled)
    edit = search_long_player(library, plan, window, *report)
    seconds["search"], plan = time.perf_counter() - started, edit.stretches[0].plan
    files = LongTakeFiles(library, plan, bool(options.report))
    parts = iter_parts(library, edit, *report)
    files.write_motion(options.out, parts, count_frames(plan, plan.fps), BvhForm(above=above))
    files.write_tables(options.provenance, options.ball)
    warnings = (*edit.stretches[0].warnings, *files.warnings)
    if options.report:
        merged = files.build_report()
        merged["warnings"] = [*merged.get("warnings", []), *lines]
        merged["seconds"] = {**merged["seconds"], **seconds, "total": sum(seconds.values())}
        write_report(options.report, merged)
    return files.frames, files.ball, warnings


def add_evaluate(verbs) -> argparse.ArgumentParser:
    """Add the verb `evaluate`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("evaluate", help="measure a motion, or compare takes with recordings")
    verb.add_argument("motion", type=parse_path, nargs="+", metavar="M.bvh",
                      help="the motion; with --against one or more takes, or folders of takes")
    verb.add_argument("--track", type=parse_path, metavar="T.csv", help="the track that the motion follows")
    verb.add_argument("--annotations", type=parse_path, metavar="A.txt", help="the labels that it was made from")
    add_take_files(verb)
    verb.add_argument("--library", type=parse_path, help="the clips that it was made from, to compare with")
    verb.add_argument("--against", type=parse_path, metavar="LIBRARY",
                      help="measure whether classifiers can distinguish the takes from this library's recordings")
    add_options(verb, "library")
    verb.add_argument("--report", type=parse_path, required=True, metavar="R.json",
                      help="write all figures to this file")
    verb.add_argument("--html", type=parse_path, metavar="R.html", help="a page with plots; needs matplotlib")
    verb.set_defaults(run=run_evaluate)
    return verb


def run_evaluate(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `evaluate`: report on a motion that was written before, or compare takes with recordings.

    If there is a library, `--unit` applies to its recordings.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    with reporter.stop_at_once():
        if options.against:
            run_comparison(options, reporter)
        else:
            _evaluate_motion(options, reporter)


def _evaluate_motion(options, reporter: ProgressReporter) -> None:
    """Report on a motion that was written before."""
    if len(options.motion) > 1:
        raise InputError("evaluate", f"{len(options.motion)} motions", "one motion, or --against LIBRARY",
                         "evaluate them one after the other")
    (options.motion,) = options.motion

    from ..annotation import check_timeline, read_timeline
    from ..evaluation.html import build_html_report
    from ..evaluation.report import describe_figures, evaluate_played
    from ..files.atomic import atomic_write
    from ..files.bvh import bvh
    from ..files.tables import read_ball, write_report
    from ..files.tracking.tracking import read_track_csv
    from ..motion.track import clean_track
    from ..synthesis.provenance import read_provenance
    from ..synthesis.quality.playback import playback_from_tables

    inputs = (options.motion, options.track, options.annotations, options.provenance, options.ball)
    check_outputs(options.report, options.html, reserved=inputs, library=options.library)
    check_library_options(options, "cache", "skeleton")  # the unit is the motion's too
    if options.html:
        import_optional("matplotlib", "HTML report")
    motion = bvh.read_bvh(options.motion, None if options.library else options.unit).motion
    track = clean_track(read_track_csv(options.track))[0] if options.track else None
    start = float(track.times[0]) if track else 0.0
    timeline = read_timeline(options.annotations, motion.fps, start) if options.annotations else None
    provenance = read_provenance(options.provenance) if options.provenance else None
    ball = read_ball(options.ball) if options.ball else None
    with locate_errors(options.motion):
        played = playback_from_tables(motion, provenance, ball, start, str(options.provenance))
    library = open_library(options, reporter) if options.library else None
    if timeline is not None and track is not None and library is not None:  # otherwise some labels or times are unknown
        check_timeline(timeline, library.labels, start, float(track.times[-1]), str(options.annotations))
    with locate_errors(options.motion):
        report = evaluate_played(played, track=track, timeline=timeline, library=library)
    notes = [*report["warnings"], *report["notes"], *_describe_fit(report, motion, track, options),
             *_describe_unknown(options, report, track)]
    write_report(options.report, report)
    if options.html:
        atomic_write(options.html, build_html_report(played, report, track=track, timeline=timeline, library=library,
                                                     title=options.motion.name))  # fmt: skip
    reporter.finish(notes)
    if library is not None and (unknown_clips := played.list_unknown_clips(library)):
        count = format_count(len(unknown_clips), "clip")
        reporter.show_note(
            f"{options.provenance}: {count} not in {options.library} and not compared, such as {unknown_clips[0]}"
        )
    print("\n".join((*describe_figures(report), str(options.report))))


def _describe_fit(report: dict, motion, track, options) -> list[str]:
    """Describe why a motion is hardly this track's: it has another length, or is far away."""
    if track is None:
        return []
    seconds, lines = float(track.times[-1] - track.times[0]), []
    if abs(motion.duration - seconds) > _OTHER_LENGTH:
        lines.append(f"{options.motion} lasts {motion.duration:.1f} s, {options.track} {seconds:.1f} s; check that "
                     "they belong together")
    away = report["root_error_m"]["mean"]
    if away is not None and away > _OTHER_PLACE:
        lines.append(f"{options.motion} is {away:.1f} m from {options.track} on average; check that they belong "
                     "together")
    return lines


def _describe_unknown(options, report: dict, track: Track | None) -> list[str]:
    """Describe what the report lacks because it was not named, and a better one that it replaces."""
    import numpy as np

    lines = []
    if not options.provenance and report["keys"]:
        lines.append("the clips that played are unknown; name them with --provenance")
    if not options.ball and track is not None and np.isfinite(track.ball).any():
        lines.append(f"{options.motion}: the ball as written is unknown, so the report has no contact gaps and no "
                     "angle between head and ball; name it with --ball")
    if _is_synthesis_report(options.report):
        lines.append(f"{options.report}: replaces the report of synthesize, which knew more, such as the clips")
    return lines


def _is_synthesis_report(path: Path) -> bool:
    """Whether a file is a report that `synthesize` wrote: only that one knows the method."""
    from ..base.content import read_utf8

    try:
        found = json.loads(read_utf8(path, "a report", _MAX_REPORT_BYTES))
    except (InputError, ValueError, RecursionError):
        return False
    return isinstance(found, dict) and "method" in found
