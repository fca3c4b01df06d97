"""Options of `library`: learn acts from the clips that have words, propose words for those that have none."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from ..base.errors import InputError
from ..base.settings.options import add_options as add_settings
from .outputs import check_outputs
from .progress_reporter import Told

COLUMNS = ("file", "fps", "start_frame", "end_frame", "key_frame", "labels", "confidence", "source", "why")


def add_options(verb) -> None:
    """`--learn`, `--propose`, `--learned` and `--least`."""
    verb.add_argument("--learn", type=Path, metavar="MODEL.npz", help="learn from the clips that have words")
    verb.add_argument("--propose", type=Path, metavar="OUT.csv", help="words for the clips that have none")
    verb.add_argument("--learned", type=Path, metavar="MODEL.npz", help="what was learned; without it rules alone")
    add_settings(verb, "library.learn")


def run(options, told: Told) -> None:
    """Learns, proposes, or first the one and then the other. InputError for clips that cannot be read, and for a table
    of words that would be lost."""
    from ..library.classify import keep
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
    known = keep.read(options.learned) if options.learned else None
    if options.learn:
        examples = examples_of(
            options.library, options.unit, told.progress, options.cache, told.cancelled, told.note
        )
        known = trained(examples, told.progress, told.cancelled)
        keep.write(options.learn, known)
        told.end()
        for line in known.told():
            print(line)
    if options.propose:
        count, clips = _proposed(options, known, told)
        told.end()
        print(f"{options.propose}: {count} rows for {clips} clips without words")


def _proposed(options, known, told: Told) -> tuple[int, int]:
    """Writes the table; returns its number of rows and of clips that were looked at."""
    from ..files.whole import atomic_write
    from ..library.classify.examples import without_words
    from ..library.proposals import propose

    out = io.StringIO(newline="")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
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
