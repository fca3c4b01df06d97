"""The command line: `python -m beyond_mocap VERB ...`; Blender's command and batch script use the same parser.

Exit status: 0 done; 2 the command line or an input is wrong; 3 asked for something the library cannot do; 130
cancelled.
What is wrong is told in one line on stderr. See the project's README for examples.
"""

from __future__ import annotations

import argparse
import re
import signal
import sys
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path

from . import __version__
from .base.settings.options import add_options, option_values
from .cli import learning, matching, passing, reconstructing, releasing, ride_path, stream, study, throwing, touches
from .cli.outputs import Writer, check_outputs, writer_of
from .cli.progress_reporter import Told
from .base.errors import BeyondMocapError, Cancelled, InputError, NotInLibrary
from .synthesis.plan import Plan


Apart = Callable[[list[str], Callable[[float, str], None], Callable[[], bool]], object]
"""Runs arguments, tells its progress, and is asked whether somebody wants out."""


class OneLineParser(argparse.ArgumentParser):
    """A parser whose errors are one line, with status 2."""

    def __init__(self, *args, **more):
        super().__init__(*args, **more)
        self._negative_number_matcher = re.compile(r"-\.?\d")  # as from Python 3.14 on: -10,2,1 is no option

    def error(self, message: str):
        """Raises the message as an InputError."""
        raise InputError(self.prog, message, "", f"see '{self.prog} --help'")


def parser(prog: str = "beyond-mocap") -> argparse.ArgumentParser:
    """The parser of all verbs."""
    top = OneLineParser(prog=prog, description="From tracks, a few words and motion capture to moving bodies.")
    top.add_argument("--version", action="version", version=f"beyond-mocap {__version__}")
    verbs = top.add_subparsers(dest="verb", required=True, metavar="VERB", parser_class=OneLineParser)
    own = (ride_path.add, touches.add, stream.add, passing.add, reconstructing.add, releasing.add,
           throwing.add, matching.add, study.add)
    for add in (_add_library, _add_synthesize, *own, _add_mirror, _add_retarget, _add_evaluate):
        verb = add(verbs)
        verb.add_argument("--json", action="store_true", help="progress as JSON lines on stderr")
    return top


def _add_library(verbs) -> argparse.ArgumentParser:
    verb = verbs.add_parser("library", help="read a folder of BVH clips and annotations and print what it holds")
    verb.add_argument("library", type=Path, metavar="LIBRARY")
    add_options(verb, "library.build")
    add_options(verb, "library")
    verb.add_argument("--report", type=Path, metavar="R.json")
    learning.add_options(verb)
    verb.set_defaults(run=run_library)
    return verb


def _add_take_files(verb) -> None:
    verb.add_argument("--provenance", type=Path, metavar="P.csv")
    verb.add_argument("--ball", type=Path, metavar="B.csv")


def _add_synthesize(verbs) -> argparse.ArgumentParser:
    verb = verbs.add_parser("synthesize", help="one player's motion from a track, annotations and a library")
    verb.add_argument("--library", type=Path, required=True)
    verb.add_argument("--track", type=Path, required=True, metavar="T.csv")
    verb.add_argument("--annotations", type=Path, required=True, metavar="A.txt")
    verb.add_argument("--out", type=Path, required=True, metavar="OUT.bvh")
    _add_take_files(verb)
    verb.add_argument("--report", type=Path, metavar="R.json")
    add_options(verb, "synthesis")
    verb.add_argument("--pins", type=Path, metavar="P.csv", help="where hands, feet and gaze have to be, and when")
    add_options(verb, "player")
    add_options(verb, "library")
    verb.set_defaults(run=run_synthesize)
    return verb


def _add_mirror(verbs) -> argparse.ArgumentParser:
    verb = verbs.add_parser("mirror", help="left becomes right")
    verb.add_argument("input", type=Path, metavar="IN.bvh")
    verb.add_argument("output", type=Path, metavar="OUT.bvh")
    add_options(verb, "mirror")
    verb.set_defaults(run=run_mirror)
    return verb


def _add_retarget(verbs) -> argparse.ArgumentParser:
    verb = verbs.add_parser("retarget", help="the same motion on other bones")
    verb.add_argument("input", type=Path, metavar="IN.bvh")
    verb.add_argument("--to", type=Path, required=True, metavar="SKELETON.bvh", help="a recording or a pose of it")
    verb.add_argument("--out", type=Path, required=True, metavar="OUT.bvh")
    verb.add_argument("--map", type=Path, metavar="M.json", help="a JSON object, joint of IN -> joint of SKELETON")
    add_options(verb, "retarget")
    verb.set_defaults(run=run_retarget)
    return verb


def _add_evaluate(verbs) -> argparse.ArgumentParser:
    verb = verbs.add_parser("evaluate", help="every figure of a motion")
    verb.add_argument("motion", type=Path, metavar="M.bvh")
    verb.add_argument("--track", type=Path, metavar="T.csv")
    verb.add_argument("--annotations", type=Path, metavar="A.txt")
    _add_take_files(verb)
    verb.add_argument("--library", type=Path)
    add_options(verb, "library")
    verb.add_argument("--report", type=Path, required=True, metavar="R.json")
    verb.add_argument("--html", type=Path, metavar="R.html", help="a page with pictures; needs matplotlib")
    verb.set_defaults(run=run_evaluate)
    return verb


def run_library(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`library`: builds it and prints what it holds; or learns from its words, and proposes those that are lacking."""
    if options.learn or options.propose or options.learned:
        return learning.run(options, told)
    check_outputs(options.report)
    library = _library(options, told, rebuild=options.rebuild)
    summary = summarize(library)
    told.end()
    for line in summary["lines"]:
        print(line)
    if options.report:
        from .files.tables import write_report

        write_report(options.report, summary)


def summarize(library) -> dict:
    """What a library holds: clips, minutes, words, speeds, and the sentences that `library` prints."""
    from .annotation import spoken

    own = [clip for clip in library.clips if not clip.mirrored]
    words = sorted(library.words)
    gaits = [{"word": g.word, "words": list(g.words), "speed_m_s": g.speed} for g in library.gaits]
    keys = sorted({" ".join(spoken(key.words)) for key in library.keys})
    lines = [
        f"{library.folder}: {len(own)} clips (and their mirrors), {library.minutes:.1f} minutes, "
        f"{len(library.skeleton)} joints",
        "words: " + " ".join(words),
        "gaits: " + ", ".join(f"{g['word']} {g['speed_m_s']:.1f} m/s" for g in gaits),
        f"fastest: {library.fastest:.1f} m/s",
        "key moments: " + (", ".join(keys) if keys else "none"),
        *library.notes,
    ]
    return {
        "version": __version__, "clips": len(own), "minutes": library.minutes, "words": words, "gaits": gaits,
        "fastest_m_s": library.fastest, "keys": keys, "notes": list(library.notes), "lines": lines,
    }


def run_synthesize(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`synthesize`: one player, and what was asked to be written about it."""
    from .annotation import read_timeline, validate
    from .synthesis.pins import read_pins
    from .files.tables import write_ball, write_report
    from .synthesis.provenance import write_provenance
    from .files.tracking.tracking import read_track_csv
    from .motion.track import clean
    from .synthesis.synthesize import synthesize

    begun = time.perf_counter()
    outputs = (options.out, options.provenance, options.ball, options.report)
    check_outputs(*outputs, never=(options.track, options.annotations, options.pins))
    write = writer_of(options.out, writers)
    track, data = clean(read_track_csv(options.track))
    timeline = read_timeline(options.annotations, options.fps, float(track.times[0]))
    loaded = time.perf_counter()
    library = _library(options, told, seed=options.seed)
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
        from .evaluation.report import evaluate

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


def run_mirror(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`mirror`: the same file with left and right exchanged."""
    from .files.bvh import bvh
    from .motion.mirror import mirror

    check_outputs(options.output)
    clip = bvh.read(options.input, options.unit)
    try:
        twin = mirror(clip.motion)
    except InputError as error:  # about a skeleton, which does not know its file
        raise InputError(options.input, str(error)) from None
    bvh.write(options.output, twin, clip.form)
    told.end()
    for note in clip.notes:
        told.note(note)
    print(f"{options.output}: {len(clip.motion)} frames")


def run_retarget(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`retarget`: the motion on another skeleton, whose joint names and channels the output has; at its own rate."""
    from .files.bvh import bvh
    from .library.one_skeleton import bring_one

    check_outputs(options.out, never=(options.input, options.to, options.map))
    clip, target = bvh.read(options.input, options.unit), bvh.read(options.to, options.to_unit)
    try:
        motion = bring_one(clip.motion, target.motion, options.map)
    except InputError as error:
        if error.where != "skeleton":
            raise
        raise InputError(f"{options.input} to {options.to}", str(error)) from None  # skeletons do not know their files
    notes = bvh.write(options.out, motion, target.form)
    told.end()
    told_of = [(options.input, clip.notes[0]), (options.to, target.notes[0]), *((options.out, note) for note in notes)]
    for path, note in told_of:
        told.note(f"{path}: {note}")
    print(f"{options.out}: {len(motion)} frames")


def run_evaluate(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`evaluate`: the report of a motion that was written before. `--unit` is the library's where there is one."""
    from .annotation import read_timeline, validate
    from .evaluation.html import html_report
    from .synthesis.quality.played import played_from_tables
    from .evaluation.plots import require_matplotlib
    from .evaluation.report import evaluate_played
    from .files.bvh import bvh
    from .files.tables import read_ball, write_report
    from .synthesis.provenance import read_provenance
    from .files.whole import atomic_write
    from .files.tracking.tracking import read_track_csv
    from .motion.track import clean

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
    library = _library(options, told) if options.library else None
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
    from .library.scan import CACHE_FOLDER

    own = {clip.path for clip in library.clips}
    return [clip for clip in clips if clip and clip not in own and not clip.startswith(CACHE_FOLDER)]


def _library(options, told: Told, rebuild: bool = False, seed: int = 0):
    from .library.build import build

    return build(
        options.library, rebuild=rebuild, cache_dir=options.cache, skeleton=options.skeleton, unit=options.unit,
        seed=seed, progress=told.progress, cancelled=told.cancelled,
    )


def main(
    argv: list[str] | None = None, writers: Mapping[str, Writer] | None = None, prog: str = "beyond-mocap",
    apart: Apart | None = None,
) -> int:  # fmt: skip
    """Runs one command and returns its exit status.

    writers: by suffix, further kinds of `--out` (Blender's). apart: runs a command line in a process of its own, where
    this one cannot send work to others, as within Blender.
    """
    told = None
    _escape(sys.stdout)
    try:
        argv = sys.argv[1:] if argv is None else argv
        options = parser(prog).parse_args(argv)
        options.argv, options.apart = argv, apart
        told = Told(options.json)
        with _interrupts(told):
            options.run(options, told, writers or {})
        return 0
    except BeyondMocapError as error:
        status, text = error.exit_status, str(error)
    except KeyboardInterrupt:
        status, text = Cancelled.exit_status, "cancelled"
    except OSError as error:
        place = error.filename or prog
        status, text = 2, f"{place}: {error.strerror or error}; check that the file can be read and its folder written"
    except SystemExit as done:  # --help and --version
        return int(done.code or 0)
    if told is not None:
        told.end()
    print(text if text.startswith(prog) else f"{prog}: {text}", file=sys.stderr)
    return status


def _escape(stream) -> None:
    """Lets a stream write what its encoding lacks as escapes, where it would raise: names of files and people on a
    console of another script."""
    if getattr(stream, "errors", None) == "strict" and hasattr(stream, "reconfigure"):
        stream.reconfigure(errors="backslashreplace")


class _interrupts:
    """While it lasts, Ctrl-C, or a farm's request to end (SIGTERM), asks the work to stop instead of breaking it off;
    the second one breaks it off. Outside the main thread nothing is done."""

    def __init__(self, told: Told):
        self._told, self._before = told, {}

    def __enter__(self):
        if threading.current_thread() is threading.main_thread():
            self._before = {kind: signal.signal(kind, self._asked) for kind in (signal.SIGINT, signal.SIGTERM)}

    def __exit__(self, *_):
        for kind, before in self._before.items():
            # None: not set from Python, as by Blender for itself, and not to be had back from there
            signal.signal(kind, signal.SIG_DFL if before is None else before)

    def _asked(self, *_):
        if self._told.cancelled():
            raise KeyboardInterrupt
        self._told.cancel()


if __name__ == "__main__":
    sys.exit(main())
