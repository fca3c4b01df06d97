"""The verb `library`: describe a folder of clips and annotations, learn from its labels, propose labels."""

from __future__ import annotations

import argparse
import csv
import io
from collections.abc import Mapping
from math import isfinite
from pathlib import Path

from .. import __version__
from ..base.errors import InputError, format_count
from ..base.settings.options import add_options, parse_path
from .outputs import ProgressReporter, Writer, check_outputs

# Header of the table of proposed labels.
PROPOSAL_COLUMNS = ("file", "fps", "start_frame", "end_frame", "key_frame", "labels", "confidence", "source", "why")


def add_library(verbs) -> argparse.ArgumentParser:
    """Add the verb `library`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("library", help="read a folder of recordings and annotations and describe it")
    verb.add_argument("library", type=parse_path, metavar="LIBRARY", help="a folder with recordings and annotations")
    add_options(verb, "library.build")
    add_options(verb, "library")
    verb.add_argument("--report", type=parse_path, metavar="R.json", help="write what is printed, and more, as JSON")
    add_learning_options(verb)
    verb.set_defaults(run=run_library)
    return verb


def run_library(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `library`: build the library and describe it, or learn from its labels and propose missing ones.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    if options.learn or options.propose or options.learned:
        return run_learning(options, reporter)
    check_outputs(options.report, reserved=(options.skeleton,), library=options.library)
    library = open_library(options, reporter, rebuild=options.rebuild)
    summary = summarize_library(library)
    if options.report:
        from ..files.tables import write_report

        write_report(options.report, summary)
    reporter.finish()
    for line in summary["lines"]:
        print(line)


def summarize_library(library) -> dict:
    """Summarize a library: clips, minutes, labels, speeds, and the lines that `library` prints.

    Args:
        library: a `Library`.
    Returns:
        The report as plain values for JSON.
    """
    from ..annotation import sort_labels
    from ..library.left_out import describe_left_out, find_left_out, measure_speed_classes

    originals = [clip for clip in library.clips if not clip.mirrored]
    labels = sorted(library.labels)
    gaits = [{"word": g.label, "words": list(g.labels), "speed_m_s": g.speed} for g in library.gaits]
    keys = sorted({" ".join(sort_labels(key.labels)) for key in library.keys})
    lines = [
        f"{library.folder}: {format_count(len(originals), 'clip')} (and their mirrors), {library.minutes:.1f} minutes, "
        f"{len(library.skeleton)} joints",
        "labels: " + " ".join(labels),
        "gaits: " + ", ".join(f"{g['word']} {g['speed_m_s']:.1f} m/s" for g in gaits),
        f"fastest: {library.max_speed:.1f} m/s",
        "key moments: " + ("" if keys else "none"), *(f"  {key}" for key in keys),
        *library.proposal_notes, *library.unlabelled_notes,
        *library.coverage.lines.values(),
        *describe_left_out(library),
        *library.notes,
    ]
    return {
        "version": __version__, "clips": len(originals), "minutes": library.minutes, "words": labels, "gaits": gaits,
        "fastest_m_s": library.max_speed, "keys": keys, "notes": list(library.notes), "lines": lines,
        "proposed_clips": sum(clip.has_proposed_labels for clip in originals),
        "lacks": [{"kind": kind, "line": line} for kind, line in library.coverage.lines.items()],
        "left_out": [{"clip": one.clip, "start_s": one.start, "end_s": one.end, "speed_m_s": one.speed,
                      "part": one.part, "why": one.reason} for one in find_left_out(library)],
        "locomotion": [{"from_m_s": one.low, "to_m_s": one.high if isfinite(one.high) else None,
                        "seconds": one.seconds, "left_out_s": one.left_out} for one in measure_speed_classes(library)],
    }


def open_library(options, reporter: ProgressReporter, rebuild: bool = False, seed: int = 0,
                 folder: Path | None = None):
    """Build or load the library of the command line.

    Args:
        options: the parsed command line.
        reporter: progress and cancellation.
        rebuild: whether to build it again although the cache is up to date.
        seed: seed of the clustering.
        folder: its folder; None for the option `library`.
    Returns:
        The `Library`.
    """
    from ..library.build import build_library

    return build_library(
        folder or options.library, rebuild=rebuild, cache_dir=options.cache, skeleton=options.skeleton,
        unit=options.unit, seed=seed, progress=reporter.show_progress, cancelled=reporter.is_cancelled,
    )


def check_library_options(options, *names: str) -> None:
    """Check that options that concern a library are set beside one.

    Args:
        options: the parsed command line.
        names: of the options.
    Raises:
        InputError: for the first that is set without --library.
    """
    for name in names:
        if getattr(options, name) is not None and options.library is None:
            raise InputError(f"--{name}", "set without --library", "a folder of clips", "add --library")


def add_learning_options(verb) -> None:
    """Add `--learn`, `--propose`, `--learned` and `--least`.

    Args:
        verb: the parser to add them to.
    """
    verb.add_argument("--learn", type=parse_path, metavar="MODEL.npz", help="learn from the clips that have labels")
    verb.add_argument("--propose", type=parse_path, metavar="OUT.csv", help="propose labels for the clips without any")
    verb.add_argument("--learned", type=parse_path, metavar="MODEL.npz", help="a learned model; without it rules alone")
    add_options(verb, "library.learn")


def run_learning(options, reporter: ProgressReporter) -> None:
    """Learn from labels, propose labels, or both in this order.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
    Raises:
        InputError: if clips cannot be read, options contradict each other, or an existing table of labels would be
            overwritten.
    """
    from ..library.classify import classifier
    from ..library.classify.examples import read_examples
    from ..library.classify.train import train_classifier
    from ..library.folder.annotations import TABLE_NAME

    if options.learn and options.learned:
        raise InputError("--learned", "set with --learn", "one of them", "remove one of them")
    if options.learned and not options.propose:
        raise InputError("--learned", "set without --propose", "--propose OUT.csv", "add --propose OUT.csv")
    if options.propose and options.propose.name == TABLE_NAME and options.propose.exists():
        problem = "already has labels, which would be lost"
        raise InputError(options.propose, problem, "a new file", "choose another name, then merge the rows")
    check_outputs(options.learn, options.propose, reserved=(options.learned,), library=options.library,
                  labels=options.propose)
    model = classifier.read_classifier(options.learned) if options.learned else None
    if options.learn:
        examples = read_examples(options.library, options.unit, reporter.show_progress, cache_dir=options.cache,
                                 cancelled=reporter.is_cancelled, on_note=reporter.show_note)
        model = train_classifier(examples, reporter.show_progress, reporter.is_cancelled)
        classifier.write_classifier(options.learn, model)
        reporter.finish()
        for line in model.describe():
            print(line)
    if options.propose:
        count, clips = _write_proposals(options, model, reporter)
        reporter.finish()
        print(f"{options.propose}: {format_count(count, 'row')} for {format_count(clips, 'clip')} without labels")


def _write_proposals(options, model, reporter: ProgressReporter) -> tuple[int, int]:
    """Write the table of proposals; return its number of rows and the number of clips without labels."""
    from ..files.atomic import atomic_write
    from ..library.classify.examples import iter_unlabelled_clips
    from ..library.proposals import propose_labels

    out = io.StringIO(newline="")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(PROPOSAL_COLUMNS)
    count = clips = 0
    for name, motion in iter_unlabelled_clips(options.library, options.unit, reporter.show_progress, options.cache,
                                              reporter.is_cancelled):
        clips += 1
        for proposal in propose_labels(motion, classifier=model):
            row = proposal.annotation
            if proposal.confidence >= options.least:
                key = "" if row.key is None else row.key
                figures = (f"{motion.fps:g}", row.start, row.end, key, " ".join(row.words),
                           f"{proposal.confidence:.2f}")
                writer.writerow((name, *figures, proposal.source, proposal.why))
                count += 1
    atomic_write(options.propose, out.getvalue())
    return count, clips
