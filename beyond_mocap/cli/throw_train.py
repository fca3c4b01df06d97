"""The verb `throw train`: networks out of a folder of recorded throws or kicks."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ..base.errors import InputError
from ..base.settings.options import add_options
from .outputs import Writer, check_outputs
from .progress_reporter import Told

FOUND, EXPECTED = "this Python has no training", "jax and optax, and the project's folder"
NEXT_STEP = (
    "in the project's folder run 'make training', then .venv-training/bin/python -m beyond_mocap throw train ..."
)


def add(verbs):
    """The verb's parser."""
    verb = verbs.add_parser("train", help="train networks on a folder of BVH and annotations (see make training)")
    verb.add_argument("folder", type=Path, metavar="FOLDER", help="recordings, annotations and, if any, throws.csv")
    verb.add_argument("--out", type=Path, required=True, metavar="W.npz", help="the trained model")
    add_options(verb, "throw.train")
    verb.set_defaults(run=run)
    return verb


def run(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`throw train`: trains and writes the model."""
    check_outputs(options.out, never=(options.config, options.skeleton))
    if options.out.suffix.lower() != ".npz":
        raise InputError(options.out, "no file of weights", "a name ending in .npz", "choose another ending")
    _require_training()
    from training.train import train_folder

    train_folder(options, told)


def _require_training() -> None:
    """InputError, one line, where jax, optax or the project's `training` folder is missing: in Blender, say."""
    core = __name__.partition(".cli.")[0]
    try:
        if core != "beyond_mocap":  # inside Blender the core has another name, and training knows it by this one
            raise ImportError
        import jax  # noqa: F401
        import optax  # noqa: F401

        import training  # noqa: F401
    except ImportError:
        raise InputError("throw train", FOUND, EXPECTED, NEXT_STEP) from None
