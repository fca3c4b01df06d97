"""The verb `throw examples`: a folder of made throws or kicks with known targets."""

from __future__ import annotations

import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path

from .numbers import whole
from .outputs import Writer
from .told import Told


def add(verbs):
    """The verb's parser."""
    verb = verbs.add_parser("examples", help="make throws or kicks with known targets, to train on and to test with")
    verb.add_argument("--out", type=Path, required=True, metavar="FOLDER", help="a new or an empty folder")
    verb.add_argument("--action", choices=("throw", "kick"), default="throw")
    people = partial(whole, low=1, high=1000, expected="1 to 1000 people")
    verb.add_argument("--subjects", type=people, default=4, metavar="N", help="different people; default 4")
    each = partial(whole, low=1, high=10000, expected="1 to 10000 of each")
    verb.add_argument("--throws", type=each, default=40, metavar="M", help="of each of them; default 40")
    seeds = partial(whole, low=0, high=10**6, expected="0 to 1000000")
    verb.add_argument("--seed", type=seeds, default=1, help="of the first of them; default 1")
    verb.set_defaults(run=run)
    return verb


def run(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`throw examples`: makes them and writes them."""
    from ..planted_examples import write_planted
    from ..throw_examples import TABLE_NAME

    begun = time.perf_counter()
    count = write_planted(
        options.out, options.action, options.subjects, options.throws, options.seed, told.progress, told.cancelled
    )
    told.end()
    seconds = time.perf_counter() - begun
    who = "person" if options.subjects == 1 else "people"
    what = f"{count} {options.action}{'s' * (count > 1)} of {options.subjects} {who}"
    print(f"{options.out}: {what}, with {TABLE_NAME}, in {seconds:.1f} s")
