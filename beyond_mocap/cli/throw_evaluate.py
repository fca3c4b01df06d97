"""The verb `throw evaluate`: how good trained networks are on throws or kicks that they never saw."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path

from .. import __version__
from ..base.errors import InputError
from ..base.settings.options import add_options
from .outputs import Writer, check_outputs
from .progress_reporter import Told


def add(verbs):
    """The verb's parser."""
    verb = verbs.add_parser("evaluate", help="how good trained networks are on recorded throws or kicks")
    verb.add_argument("--model", type=Path, required=True, metavar="W.npz", help="what throw train wrote")
    verb.add_argument("--examples", type=Path, required=True, metavar="FOLDER", help="recordings with annotations")
    add_options(verb, "throw.evaluate")
    verb.set_defaults(run=run)
    return verb


def run(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`throw evaluate`: generates every example anew and writes how far off it is."""
    from ..files.tables import write_report
    from ..files.whole import atomic_write
    from ..throws.evaluate_throws import FULL, RAW, evaluate_throws, some_of_each
    from ..throws.network_npz import read_model
    from ..throws.throw_records import TABLE_NAME
    from ..throws.throws_page import throws_page

    begun = time.perf_counter()
    check_outputs(options.report, options.html, never=(options.model, options.examples / TABLE_NAME))
    model = read_model(options.model)
    every = _examples(options.examples, model, told)
    chosen = some_of_each(_of_subjects(every, options.subject, options.examples), options.motions)
    loaded = time.perf_counter()
    found = evaluate_throws(
        model, chosen, RAW if options.raw else FULL, by_height=not options.as_they_are, progress=told.progress,
        cancelled=told.cancelled,
    )  # fmt: skip
    for line in found.left_out:
        told.note(line)
    report = {
        "version": __version__, "model": str(options.model), "trained_on": model.trained_on,
        "examples": str(options.examples), **found.report(),
        "elapsed": {"load": loaded - begun, "evaluate": time.perf_counter() - loaded},
    }  # fmt: skip
    write_report(options.report, report)
    if options.html:
        atomic_write(options.html, throws_page(report))
    told.end()
    print(f"{options.report}: {report['motions']} of {len(chosen)} motions")


def _examples(folder: Path, model, told: Told) -> list:
    """The folder's examples: those on bones of the model's names as they are, else all brought to its skeleton, because
    hands that rest otherwise turn otherwise."""
    from ..throws.throw_examples import examples_in

    settings = model.settings
    found = examples_in(folder, settings.action, settings.fps, told=told.note, cancelled=told.cancelled)
    if all(example.motion.skeleton.names == model.skeleton.names for example in found):
        return found
    told.note(f"{folder}: other skeletons than the model's; brought to its own")
    return examples_in(folder, settings.action, settings.fps, model.skeleton, cancelled=told.cancelled)


def _of_subjects(examples, wanted: list[str], folder: Path):
    """The examples of the wanted subjects, all without any. InputError for one that nobody is."""
    there = sorted({example.subject for example in examples})
    for name in wanted:
        if name not in there:
            raise InputError("--subject", name, f"one of {', '.join(there)}", f"see {folder}")
    return [example for example in examples if not wanted or example.subject in wanted]
