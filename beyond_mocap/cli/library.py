"""The verb `library`: read a folder of clips and annotations and print what it holds."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from .. import __version__
from ..base.settings.options import add_options
from . import learning
from .outputs import Writer, check_outputs
from .progress_reporter import Told


def add_library(verbs) -> argparse.ArgumentParser:
    verb = verbs.add_parser("library", help="read a folder of BVH clips and annotations and print what it holds")
    verb.add_argument("library", type=Path, metavar="LIBRARY")
    add_options(verb, "library.build")
    add_options(verb, "library")
    verb.add_argument("--report", type=Path, metavar="R.json")
    learning.add_options(verb)
    verb.set_defaults(run=run_library)
    return verb


def run_library(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`library`: builds it and prints what it holds; or learns from its words, and proposes those that are lacking."""
    if options.learn or options.propose or options.learned:
        return learning.run(options, told)
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
