"""The verb `library`: describe a folder of clips and annotations, learn from its labels, propose labels."""

from __future__ import annotations

import argparse
import csv
import io
from collections.abc import Mapping
from pathlib import Path

from .. import __version__
from ..base.errors import InputError
from ..base.settings.options import add_options
from .outputs import Told, Writer, check_outputs

# Header of the table of proposed labels.
PROPOSAL_COLUMNS = ("file", "fps", "start_frame", "end_frame", "key_frame", "labels", "confidence", "source", "why")


def add_library(verbs) -> argparse.ArgumentParser:
    """Add the verb `library`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("library", help="read a folder of BVH clips and annotations and describe it")
    verb.add_argument("library", type=Path, metavar="LIBRARY")
    add_options(verb, "library.build")
    add_options(verb, "library")
    verb.add_argument("--report", type=Path, metavar="R.json")
    add_learning_options(verb)
    verb.set_defaults(run=run_library)
    return verb


def run_library(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """Run `library`: build the library and describe it, or learn from its labels and propose missing ones.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    if options.learn or options.propose or options.learned:
        return run_learning(options, told)
    check_outputs(options.report)
    library = open_library(options, told, rebuild=options.rebuild)
    summary = summarize(library)
    told.end()
    for line in summary["lines"]:
        print(line)
    if options.report:
        from ..files.tables import write_report

        write_report(options.report, summary)


def summarize(library) -> dict:
    """Summarize a library: clips, minutes, labels, speeds, and the lines that `library` prints.

    Args:
        library: a `Library`.
    Returns:
        The report as plain values for JSON.
    """
    from ..annotation import spoken

    own = [clip for clip in library.clips if not clip.mirrored]
    words = sorted(library.words)
    gaits = [{"word": g.word, "words": list(g.words), "speed_m_s": g.speed} for g in library.gaits]
    keys = sorted({" ".join(spoken(key.words)) for key in library.keys})
    lines = [
        f"{library.folder}: {len(own)} clips (and their mirrors), {library.minutes:.1f} minutes, "
        f"{len(library.skeleton)} joints",
        "labels: " + " ".join(words),
        "gaits: " + ", ".join(f"{g['word']} {g['speed_m_s']:.1f} m/s" for g in gaits),
        f"fastest: {library.fastest:.1f} m/s",
        "key moments: " + (", ".join(keys) if keys else "none"),
        *library.notes,
    ]
    return {
        "version": __version__, "clips": len(own), "minutes": library.minutes, "words": words, "gaits": gaits,
        "fastest_m_s": library.fastest, "keys": keys, "notes": list(library.notes), "lines": lines,
    }


def open_library(options, told: Told, rebuild: bool = False, seed: int = 0):
    """Build or load the library of the command line.

    Args:
        options: the parsed command line.
        reporter: progress and cancellation.
        rebuild: whether to build it again although the cache is up to date.
        seed: seed of the clustering.
    Returns:
        The `Library`.
    """
    from ..library.build import build

    return build(
        options.library, rebuild=rebuild, cache_dir=options.cache, skeleton=options.skeleton, unit=options.unit,
        seed=seed, progress=told.progress, cancelled=told.cancelled,
    )


def add_learning_options(verb) -> None:
    """Add `--learn`, `--propose`, `--learned` and `--least`.

    Args:
        verb: the parser to add them to.
    """
    verb.add_argument("--learn", type=Path, metavar="MODEL.npz", help="learn from the clips that have labels")
    verb.add_argument("--propose", type=Path, metavar="OUT.csv", help="propose labels for the clips without any")
    verb.add_argument("--learned", type=Path, metavar="MODEL.npz", help="a learned model; without it rules alone")
    add_options(verb, "library.learn")


def run_learning(options, told: Told) -> None:
    """Learn from labels, propose labels, or both in this order.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
    Raises:
        InputError: if clips cannot be read, options contradict each other, or an existing table of labels would be
            overwritten.
    """
    from ..library.classify import classifier
    from ..library.classify.examples import examples_of
    from ..library.classify.train import trained
    from ..library.scan import TABLE_NAME

    check_outputs(options.learn, options.propose, never=(options.learned,))
    if options.learn and options.learned:
        raise InputError("--learned", "set with --learn", "one of them", "remove one of them")
    if options.learned and not options.propose:
        raise InputError("--learned", "set without --propose", "--propose OUT.csv", "add --propose OUT.csv")
    if options.propose and options.propose.name == TABLE_NAME and options.propose.exists():
        what = "already has labels, which would be lost"
        raise InputError(options.propose, what, "a new file", "choose another name, then merge the rows")
    known = classifier.read_classifier(options.learned) if options.learned else None
    if options.learn:
        examples = examples_of(options.library, options.unit, told.progress, cache_dir=options.cache,
                               cancelled=told.cancelled, note=told.note)
        known = trained(examples, told.progress, told.cancelled)
        classifier.write_classifier(options.learn, known)
        told.end()
        for line in known.told():
            print(line)
    if options.propose:
        count, clips = _write_proposals(options, known, told)
        told.end()
        print(f"{options.propose}: {count} rows for {clips} clips without labels")


def _write_proposals(options, known, told: Told) -> tuple[int, int]:
    """Write the table of proposals; return its number of rows and the number of clips without labels."""
    from ..files.whole import atomic_write
    from ..library.classify.examples import without_words
    from ..library.proposals import propose

    out = io.StringIO(newline="")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(PROPOSAL_COLUMNS)
    count = clips = 0
    for name, motion in without_words(options.library, options.unit, told.progress, options.cache, told.cancelled):
        clips += 1
        for one in propose(motion, classifier=known):
            row = one.annotation
            if one.confidence >= options.least:
                key = "" if row.key is None else row.key
                figures = (f"{motion.fps:g}", row.start, row.end, key, " ".join(row.words), f"{one.confidence:.2f}")
                writer.writerow((name, *figures, one.source, one.why))
                count += 1
    atomic_write(options.propose, out.getvalue())
    return count, clips
