"""The verb `throw train`: networks out of a folder of recorded throws or kicks."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

from ..errors import InputError
from .numbers import between, whole
from .outputs import Writer, check_outputs
from .told import Told

FOUND, EXPECTED = "this Python has no training", "jax and optax, and the project's folder"
NEXT_STEP = (
    "in the project's folder run 'make training', then .venv-training/bin/python -m beyond_mocap throw train ..."
)


def add(verbs):
    """The verb's parser."""
    verb = verbs.add_parser("train", help="train networks on a folder of BVH and annotations (see make training)")
    verb.add_argument("folder", type=Path, metavar="FOLDER", help="recordings, annotations and, if any, throws.csv")
    verb.add_argument("--out", type=Path, required=True, metavar="W.npz", help="the trained model")
    verb.add_argument("--action", choices=("throw", "kick"), default="throw")
    verb.add_argument("--config", type=Path, metavar="C.json", help="sizes and rates; default: as shipped weights have")
    verb.add_argument("--subject", action="append", default=[], metavar="S", help="train on this one only; repeatable")
    verb.add_argument("--skeleton", type=Path, metavar="S.bvh", help="whose bones the model has; default: the first's")
    verb.add_argument("--resume", action="store_true", help="go on from the checkpoint beside W.npz")
    seeds = partial(whole, low=0, high=2**31 - 1, expected="0 to 2147483647")
    verb.add_argument("--seed", type=seeds, help="of first weights, batches and dropout; default: the config's, else 0")
    minutes = partial(between, low=0.01, high=1e5, expected="0.01 to 100000 minutes")
    verb.add_argument("--minutes", type=minutes, metavar="M", help="stop after so many minutes with what stands then")
    epochs = partial(whole, low=0, high=1_000_000, expected="0 to 1000000")
    verb.add_argument("--epochs", type=epochs, metavar="N", help="times through the examples; default: the config's")
    verb.add_argument("--half", action="store_true", help="store the weights as 16 bits")
    verb.set_defaults(run=run)
    return verb


def run(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`throw train`: trains and writes the model."""
    check_outputs(options.out, never=(options.config, options.skeleton))
    if options.out.suffix.lower() != ".npz":
        raise InputError(options.out, "no file of weights", "a name ending in .npz", "choose another ending")
    _require_training()
    from training.command import train_folder

    train_folder(options, told)


def _require_training() -> None:
    """InputError, one line, where jax, optax or the project's `training` folder is missing: in Blender, say."""
    core = __name__.partition(".commands.")[0]
    try:
        if core != "beyond_mocap":  # inside Blender the core has another name, and training knows it by this one
            raise ImportError
        import jax  # noqa: F401
        import optax  # noqa: F401
        import training  # noqa: F401
    except ImportError:
        raise InputError("throw train", FOUND, EXPECTED, NEXT_STEP) from None
