"""The verb `library`: print what a folder of clips and annotations holds, learn from its labels, propose others."""

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

PROPOSAL_COLUMNS = ("file", "fps", "start_frame", "end_frame", "key_frame", "labels", "confidence", "source", "why")


def add_library(verbs) -> argparse.ArgumentParser:
    verb = verbs.add_parser("library", help="read a folder of BVH clips and annotations and print what it holds")
    verb.add_argument("library", type=Path, metavar="LIBRARY")
    add_options(verb, "library.build")
    add_options(verb, "library")
    verb.add_argument("--report", type=Path, metavar="R.json")
    add_learning_options(verb)
    verb.set_defaults(run=run_library)
    return verb


def run_library(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`library`: builds it and prints what it holds; or learns from its words, and proposes those that are lacking."""
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
    """What a library holds: clips, minutes, words, speeds, and the sentences that `library` prints."""
    from ..annotation import spoken

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


def open_library(options, told: Told, rebuild: bool = False, seed: int = 0):
    from ..library.build import build

    return build(
        options.library, rebuild=rebuild, cache_dir=options.cache, skeleton=options.skeleton, unit=options.unit,
        seed=seed, progress=told.progress, cancelled=told.cancelled,
    )


def add_learning_options(verb) -> None:
    """`--learn`, `--propose`, `--learned` and `--least`."""
    verb.add_argument("--learn", type=Path, metavar="MODEL.npz", help="learn from the clips that have words")
    verb.add_argument("--propose", type=Path, metavar="OUT.csv", help="words for the clips that have none")
    verb.add_argument("--learned", type=Path, metavar="MODEL.npz", help="what was learned; without it rules alone")
    add_options(verb, "library.learn")


def run_learning(options, told: Told) -> None:
    """Learns, proposes, or first the one and then the other. InputError for clips that cannot be read, and for a table
    of words that would be lost."""
    from ..library.classify import classifier
    from ..library.classify.examples import examples_of
    from ..library.classify.train import trained
    from ..library.scan import TABLE_NAME

    check_outputs(options.learn, options.propose, never=(options.learned,))
    if options.learn and options.learned:
        raise InputError("--learned", "given beside --learn", "one of them", "leave it away: what is learned is used")
    if options.learned and not options.propose:
        raise InputError("--learned", "given without --propose", "--propose OUT.csv", "say where the proposals go")
    if options.propose and options.propose.name == TABLE_NAME and options.propose.exists():
        what = "holds words already, which would be lost"
        raise InputError(options.propose, what, "a new file", "choose another name, then put the rows together")
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
        print(f"{options.propose}: {count} rows for {clips} clips without words")


def _write_proposals(options, known, told: Told) -> tuple[int, int]:
    """Writes the table; returns its number of rows and of clips that were looked at."""
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
