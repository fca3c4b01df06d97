"""What `throw train` does."""

from __future__ import annotations

import time
from pathlib import Path

from beyond_mocap.base.errors import InputError
from beyond_mocap.cli.outputs import Told, check_outputs
from beyond_mocap.files.bvh import bvh
from beyond_mocap.motion.skeleton import Skeleton
from beyond_mocap.throws.network_npz import write_model
from beyond_mocap.throws.networks.chains import chains_of
from beyond_mocap.throws.networks.example import Example
from beyond_mocap.throws.throw_examples import examples_in

from . import checkpoint
from .config import TrainingConfig, read_config
from .train import train

READING = 0.05
"""Share of the progress that reading the folder is."""


def train_folder(options, told: Told) -> None:
    """Reads the folder, trains, and writes the model and its checkpoint; options: of `throw train`."""
    begun = time.perf_counter()
    config = read_config(options.config, seed=options.seed, epochs=options.epochs, action=options.action)
    kept = checkpoint.path_of(options.out)
    check_outputs(options.out, kept, never=(options.config, options.skeleton))
    if options.resume:
        checkpoint.check_there(kept)
    examples = _examples(options, config, told)

    def progress(share: float, text: str) -> None:
        told.progress(READING + (1.0 - READING) * share, text)

    model = train(
        examples, config, checkpoint=kept, resume=options.resume, minutes=options.minutes,
        progress=progress, cancelled=told.cancelled,
    )
    write_model(model, options.out, half=options.half)
    told.end()
    weights = sum(network.parameters for network in model.networks.values())
    seconds = time.perf_counter() - begun
    print(f"{options.out}: {model.trained_on}; {len(model.networks)} networks, {weights} weights, {seconds:.0f} s")


def _examples(options, config: TrainingConfig, told: Told) -> list[Example]:
    """The folder's examples of the asked subjects, on one skeleton: the given one, else that of the first."""
    skeleton = _skeleton(options.skeleton) if options.skeleton else None
    found = _read(options, config, told, skeleton)
    first = found[0].motion.skeleton
    if skeleton is None and not all(example.motion.skeleton.same_bones(first) for example in found):
        found = _read(options, config, told, first)
    return found


def _skeleton(path: Path) -> Skeleton:
    """Whose bones the model is to have. InputError that names the file where it lacks hands or feet."""
    skeleton = bvh.read(path).motion.skeleton
    try:
        chains_of(skeleton)
    except InputError as error:
        raise InputError(path, str(error)) from None
    return skeleton


def _read(options, config: TrainingConfig, told: Told, skeleton) -> list[Example]:
    def progress(share: float, text: str) -> None:
        told.progress(READING * share, text)

    settings = config.settings
    found = examples_in(
        options.folder, settings.action, settings.fps, skeleton, told.note, progress=progress, cancelled=told.cancelled,
    )
    chosen = [example for example in found if not options.subject or example.subject in options.subject]
    there = sorted({example.subject for example in found})
    for name in options.subject:
        if name not in there:
            raise InputError("--subject", name, f"one of {', '.join(there)}", f"see {options.folder}")
    return chosen
