"""A training that was broken off goes on where its last checkpoint was written: parameters, the optimizer's state and
how far it was, in one file beside the weights, written whole or not at all."""

from __future__ import annotations

import json
import os
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from beyond_mocap.base.errors import InputError
from beyond_mocap.files.whole import beside

VERSION = 1
NEXT_STEP = "give the same command again, or leave --resume out to begin anew"


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """How far a training is. state: parameters and optimizer's state, a tree of arrays. epoch: epochs done. seconds:
    time spent. losses: (E,) mean loss of each epoch. fits: what it was trained on and how, as one text to compare."""

    state: object
    epoch: int
    seconds: float
    losses: tuple[float, ...]
    fits: str


def path_of(out: str | os.PathLike) -> Path:
    """Where the checkpoint of the weights at `out` stands."""
    out = Path(out)
    return out.with_name(f"{out.stem}.checkpoint.npz")


def check_there(path: Path) -> None:
    """InputError where there is no checkpoint to go on from."""
    if not path.is_file():
        raise InputError(path, "no checkpoint there", "one, for --resume", "leave --resume out to begin anew")


def write(path: Path, checkpoint: Checkpoint) -> None:
    """Writes it whole. InputError where the folder cannot be written."""
    leaves = [np.asarray(leaf) for leaf in jax.tree.leaves(checkpoint.state)]
    told = {"version": VERSION, "epoch": checkpoint.epoch, "seconds": checkpoint.seconds, "fits": checkpoint.fits}
    with beside(path, ".npz") as part:
        np.savez(part, told=np.array(json.dumps(told)), losses=np.array(checkpoint.losses, float),
                 **{f"leaf_{i:04d}": leaf for i, leaf in enumerate(leaves)})  # fmt: skip


def read(path: Path, like: object, fits: str) -> Checkpoint:
    """The checkpoint at `path`, whose state has the form of the tree `like`.

    InputError, one line: missing, damaged, of another version, or of a training with other settings or recordings.
    """
    check_there(path)
    try:
        with np.load(path, allow_pickle=False) as file:
            told = json.loads(str(file["told"][()]))
            losses = tuple(float(one) for one in file["losses"])
            leaves = [file[name] for name in sorted(name for name in file.files if name.startswith("leaf_"))]
        version, epoch, seconds, trained = (told[name] for name in ("version", "epoch", "seconds", "fits"))
    except (ValueError, KeyError, TypeError, EOFError, OSError, zipfile.BadZipFile, zlib.error,
            NotImplementedError, RuntimeError, AttributeError) as error:
        raise InputError(path, f"is no checkpoint that can be read ({type(error).__name__})", "", NEXT_STEP) from None
    if version != VERSION:
        raise InputError(path, f"version {version}", f"version {VERSION}", NEXT_STEP)
    wanted, tree = jax.tree.flatten(like)
    if trained != fits or [(a.shape, a.dtype) for a in leaves] != [(b.shape, b.dtype) for b in map(np.asarray, wanted)]:
        raise InputError(path, "of a training with other settings or recordings", "", NEXT_STEP)
    state = jax.tree.unflatten(tree, [jnp.asarray(leaf) for leaf in leaves])
    return Checkpoint(state, int(epoch), float(seconds), losses, fits)
