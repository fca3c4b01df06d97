"""Train any problem with Adam: epochs, macro-epochs with a checkpoint, a falling learning rate, a time limit.

The same seed gives the same bits on one machine, also if interrupted and resumed; with a time limit the result
depends on the speed of the machine. An interrupted training continues from its last checkpoint: parameters, the
optimizer's state and the progress, in one file beside the weights, written completely or not at all.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Protocol

import jax
import jax.numpy as jnp
import numpy as np
import optax

from beyond_mocap.base.errors import InputError, UserCancelledError
from beyond_mocap.files.atomic import atomic_path
from beyond_mocap.files.plain_npz import read_own_arrays

from .config import TrainingConfig

MAX_GRADIENT = 1.0
"""Largest norm of a gradient; feeding a frame back many times can cause large ones."""
VERSION = 2
NEXT_STEP = "repeat the same command, or leave --resume out to start again"


# Order of the examples: stretches of some frames, shuffled again in each epoch.


def list_stretches(lengths, frames: int, seed: int, epoch: int) -> np.ndarray:
    """List stretches (N, 2) of `frames` steps, (example, first frame), shuffled.

    Stretches are adjacent from a random frame on, so that within an epoch nearly every frame is predicted once;
    examples too short for one are left out. The result depends on seed and epoch only.

    Args:
        lengths: frames of each example.
        frames: steps of a stretch.
        seed: of the training.
        epoch: number of the epoch.
    """
    rng = np.random.default_rng([seed, epoch])
    rows = []
    for example, length in enumerate(lengths):
        steps = length - 1
        if steps < frames:
            continue
        first = int(rng.integers(0, min(frames, steps - frames + 1)))
        starts = np.arange(first, steps - frames + 1, frames)
        rows.append(np.stack([np.full_like(starts, example), starts], axis=1))
    rows = np.concatenate(rows) if rows else np.zeros((0, 2), int)
    return rows[rng.permutation(len(rows))]


def split_batches(rows: np.ndarray, size: int) -> np.ndarray:
    """Split rows (N, ...) into equal batches (B, size, ...); the last is filled up from the beginning."""
    count = max(1, -(-len(rows) // size))
    return rows[np.arange(count * size) % len(rows)].reshape(count, size, *rows.shape[1:])


class Problem(Protocol):
    """A training problem.

    Attributes:
        lengths: frames of each example.
        fits: settings and recordings as one text to compare.
        data: tree of arrays that the loss receives.
    """

    lengths: Sequence[int]
    fits: str
    data: object

    def build_parameters(self, key) -> dict:
        """Build the first parameters."""

    def count_frames(self, share: float) -> int:
        """Return the number of frames to feed back when `share` of the training is done; 0: single frames."""

    def compute_loss(self, params, data, rows, key, frames: int):
        """Compute the loss (), and its parts by name, of stretches rows (B, 2) of that many frames."""


@dataclass(frozen=True)
class EpochChoice:
    """How many epochs to train.

    Attributes:
        epochs: their number.
        line: why, one line.
    """

    epochs: int
    line: str = ""


@dataclass(frozen=True, eq=False)
class TrainingResult:
    """Result of a training.

    Attributes:
        params: parameters, as the problem defines them.
        epochs: number of epochs.
        seconds: training time, without compiling.
        losses: mean loss of each epoch.
        parts: parts of the loss in the last epoch, by name.
        line: why it has that number of epochs.
        is_out_of_time: whether the time limit ended it.
    """

    params: dict
    epochs: int
    seconds: float
    losses: tuple[float, ...]
    parts: dict[str, float]
    line: str = ""
    is_out_of_time: bool = False


def fit(
    problem: Problem, config: TrainingConfig, *, checkpoint: Path | None = None, resume: bool = False,
    minutes: float | None = None, choice: EpochChoice | None = None,
    is_done: Callable[[dict, int], bool] = lambda params, epoch: False,
    progress: Callable[[float, str], None] = lambda fraction, text: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> TrainingResult:
    """Train a problem.

    Args:
        problem: the problem.
        config: configuration of the training.
        checkpoint: file to write after each macro-epoch and when cancelled, or None.
        resume: continue from the checkpoint.
        minutes: time limit of the training, or None; compiling is not counted, and the first epoch is always trained.
        choice: epochs after which it ends, while the learning rate falls as for `config.epochs`; None for all of
            these. A checkpoint that is resumed contains it.
        is_done: receives parameters and epochs after each macro-epoch and the last epoch, also where time ends, and
            returns True to end.
        progress: receives a share of 0 .. 1 and a text.
        cancelled: returns True to stop; asked between batches. A step that compiles ends first.
    Raises:
        InputError: if no example is long enough, the checkpoint is of another training, or the loss is not finite.
        UserCancelledError: if `cancelled` returns True.
    """
    adam = optax.chain(_build_clipping(), optax.scale_by_adam())
    params = problem.build_parameters(jax.random.key(config.seed))
    state = (params, adam.init(params))
    epoch, earlier_seconds, losses = 0, 0.0, ()
    if resume and checkpoint is not None:
        previous = read_checkpoint(checkpoint, state, problem.fits)
        state, epoch, earlier_seconds, losses = previous.state, previous.epoch, previous.seconds, previous.losses
        choice = previous.choice
    start_time = time.perf_counter() - earlier_seconds
    step, parts, choice = CompiledStep(problem, adam), {}, choice or EpochChoice(config.epochs)

    def measure_seconds() -> float:
        return time.perf_counter() - start_time - step.seconds

    def save_checkpoint() -> None:
        if checkpoint is not None:
            write_checkpoint(checkpoint, Checkpoint(state, epoch, measure_seconds(), losses, problem.fits, choice))

    def check_cancelled() -> None:
        if cancelled():
            save_checkpoint()
            raise UserCancelledError(f"cancelled after {epoch} epochs" + ("; --resume continues" if checkpoint else ""))

    def compute_share() -> float:
        return _compute_share(epoch, measure_seconds(), config, minutes)

    share, is_stopped = compute_share(), False
    while epoch < choice.epochs and share < 1.0 and not is_stopped:
        progress(share, f"epoch {epoch + 1}, loss {losses[-1]:.4f}" if losses else "compiling")
        check_cancelled()
        state, parts = _train_epoch(problem, config, step, state, epoch, share, check_cancelled)
        losses, epoch = (*losses, parts["loss"]), epoch + 1
        if not np.isfinite(losses[-1]):
            raise InputError("training", f"the loss is not finite after {epoch} epochs", "a lower learning_rate")
        share = compute_share()
        if epoch % config.macro == 0 or epoch == choice.epochs or share >= 1.0:
            save_checkpoint()
            is_stopped = is_done(jax.tree.map(np.array, state[0]), epoch)
    check_cancelled()
    save_checkpoint()
    return TrainingResult(state[0], epoch, measure_seconds(), losses, parts, choice.line,
                          epoch < choice.epochs and not is_stopped)


def compute_rate(share: float, config: TrainingConfig) -> float:
    """Compute Adam's rate when `share` of the training is done.

    It follows half a cosine from learning_rate to final_rate times that, after a short rise.
    """
    falling = config.final_rate + (1.0 - config.final_rate) * 0.5 * (1.0 + np.cos(np.pi * share))
    return config.learning_rate * falling * min(1.0, 0.1 + share / 0.01)


def _compute_share(epoch: int, seconds: float, config: TrainingConfig, minutes: float | None) -> float:
    """Compute the share of the training that is done, by epochs or by time, whichever is larger."""
    done = epoch / config.epochs if config.epochs else 1.0
    return max(done, 0.0 if minutes is None or not epoch else seconds / (60.0 * minutes))


def _build_clipping() -> optax.GradientTransformation:
    """Build a transformation that clips the gradient of each network separately to MAX_GRADIENT.

    Separately trained networks stay independent that way.
    """

    def update(updates, state, params=None):
        clip = optax.clip_by_global_norm(MAX_GRADIENT).update
        return {name: clip(one, optax.EmptyState())[0] for name, one in updates.items()}, state

    return optax.GradientTransformation(lambda params: optax.EmptyState(), update)


class CompiledStep:
    """A step of the optimizer, compiled once for each number of frames that are fed back.

    Attributes:
        seconds: time that compiling took so far.
    """

    def __init__(self, problem: Problem, adam: optax.GradientTransformation):
        """Prepare the step of a problem; nothing is compiled yet.

        Args:
            problem: the problem.
            adam: the optimizer.
        """
        @partial(jax.jit, static_argnames="frames")
        def step(state, data, rows, key, rate, frames: int):
            params, optimizer = state
            (loss, parts), gradient = jax.value_and_grad(problem.compute_loss, has_aux=True)(params, data, rows, key,
                                                                                           frames)
            updates, optimizer = adam.update(gradient, optimizer, params)
            params = jax.tree.map(lambda p, u: p - rate * u, params, updates)
            return (params, optimizer), {"loss": loss, **parts}

        self.seconds, self._step, self._compiled = 0.0, step, {}

    def run(self, frames: int, *arguments):
        """Run the step on state, data, rows, key and rate: the new state, and the parts of the loss."""
        if frames not in self._compiled:
            start_time = time.perf_counter()
            self._compiled[frames] = self._step.lower(*arguments, frames=frames).compile()
            self.seconds += time.perf_counter() - start_time
        return self._compiled[frames](*arguments)


def _train_epoch(problem, config, step: CompiledStep, state, epoch, share, check_cancelled):
    """Train one epoch: the new state, and the mean of the losses. A cancelled one leaves the state as it was."""
    frames, rate = problem.count_frames(share), compute_rate(share, config)
    length = max(1, frames)
    rows = list_stretches(problem.lengths, length, config.seed, epoch)
    if not len(rows):
        raise InputError("training", f"no example has {length + 1} frames", "longer examples, or a shorter rollout")
    key = jax.random.fold_in(jax.random.key(config.seed + 1), epoch)
    losses = []
    for number, batch in enumerate(split_batches(rows, max(1, config.batch // length))):
        one = jax.random.fold_in(key, number)
        state, parts = step.run(frames, state, problem.data, jnp.asarray(batch), one, jnp.float32(rate))
        losses.append(jax.device_get(parts))
        check_cancelled()
    return state, {name: float(np.mean([parts[name] for parts in losses])) for name in losses[0]}


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """State of a training.

    Attributes:
        state: parameters and optimizer's state, a tree of arrays.
        epoch: number of epochs done.
        seconds: training time so far, without compiling.
        losses: (E,) mean loss of each epoch.
        fits: settings and recordings as one text to compare.
        choice: epochs after which the training ends.
    """

    state: object
    epoch: int
    seconds: float
    losses: tuple[float, ...]
    fits: str
    choice: EpochChoice


def build_checkpoint_path(out: str | os.PathLike) -> Path:
    """Return the path of the checkpoint of the weights at `out`."""
    out = Path(out)
    return out.with_name(f"{out.stem}.checkpoint.npz")


def check_checkpoint(path: Path) -> None:
    """Raise InputError if there is no checkpoint."""
    if not path.is_file():
        raise InputError(path, "no such file", "a checkpoint for --resume", "leave --resume out to start again")


def write_checkpoint(path: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint completely or not at all; InputError if the folder cannot be written."""
    leaves = [np.asarray(leaf) for leaf in jax.tree.leaves(checkpoint.state)]
    header = {"version": VERSION, "epoch": checkpoint.epoch, "seconds": checkpoint.seconds, "fits": checkpoint.fits,
              "choice": asdict(checkpoint.choice)}
    with atomic_path(path, ".npz") as part:
        np.savez(part, told=np.array(json.dumps(header)), losses=np.array(checkpoint.losses, float),
                 **{f"leaf_{i:04d}": leaf for i, leaf in enumerate(leaves)})  # fmt: skip


def read_checkpoint(path: Path, like: object, fits: str) -> Checkpoint:
    """Read a checkpoint, whose state has the structure of the tree `like`.

    Args:
        path: the file.
        like: tree of arrays with the expected structure.
        fits: text of the present settings and recordings.
    Raises:
        InputError: one line: missing, damaged, of another version, or of a training with other settings or
            recordings.
    """
    found = read_progress(path)
    leaves, (expected_leaves, tree) = found.state, jax.tree.flatten(like)
    if found.fits != fits or [(a.shape, a.dtype) for a in leaves] != [(b.shape, b.dtype)
                                                                      for b in map(np.asarray, expected_leaves)]:
        raise InputError(path, "belongs to a training with other settings or recordings", "", NEXT_STEP)
    return replace(found, state=jax.tree.unflatten(tree, [jnp.asarray(leaf) for leaf in leaves]))


def read_progress(path: Path) -> Checkpoint:
    """Read a checkpoint of any training; its state is the list of its arrays.

    Args:
        path: the file.
    Raises:
        InputError: one line: missing, damaged, or of another version.
    """
    check_checkpoint(path)
    try:
        arrays = read_own_arrays(path, "a checkpoint")
        header = json.loads(str(arrays["told"][()]))
        losses = tuple(float(one) for one in arrays["losses"])
        leaves = [arrays[name] for name in sorted(name for name in arrays if name.startswith("leaf_"))]
        version, epoch, seconds, trained, choice = (header[name] for name in ("version", "epoch", "seconds",
                "fits", "choice"))
    except (InputError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        raise InputError(path, "is not a readable checkpoint", "", NEXT_STEP) from None
    if version != VERSION:
        raise InputError(path, f"version {version}", f"version {VERSION}", NEXT_STEP)
    return Checkpoint(leaves, int(epoch), float(seconds), losses, trained, EpochChoice(**choice))
