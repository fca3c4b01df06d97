"""The verb `throw examples`: a folder of made throws or kicks with known targets."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path

from ..base.settings.options import add_options
from .outputs import Writer
from .progress_reporter import Told


def add(verbs):
    """The verb's parser."""
    verb = verbs.add_parser("examples", help="make throws or kicks with known targets, to train on and to test with")
    verb.add_argument("--out", type=Path, required=True, metavar="FOLDER", help="a new or an empty folder")
    add_options(verb, "throw.examples")
    verb.set_defaults(run=run)
    return verb


def run(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`throw examples`: makes them and writes them."""
    from ..throws.planted_examples import write_planted
    from ..throws.throw_records import TABLE_NAME

    begun = time.perf_counter()
    count = write_planted(options.out, options.action, options.subjects, count=options.throws, seed=options.seed,
                          progress=told.progress, cancelled=told.cancelled)
    told.end()
    seconds = time.perf_counter() - begun
    who = "person" if options.subjects == 1 else "people"
    what = f"{count} {options.action}{'s' * (count > 1)} of {options.subjects} {who}"
    print(f"{options.out}: {what}, with {TABLE_NAME}, in {seconds:.1f} s")
