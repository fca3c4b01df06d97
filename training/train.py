"""Train a model from a folder of examples: used by `throw train` and the experiments.

The ridge of the linear start is chosen by its purpose: frames fed back on movements that were not used in the
regression.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path

import jax
import numpy as np

from beyond_mocap.base.errors import Cancelled, InputError
from beyond_mocap.cli.outputs import Told, check_outputs
from beyond_mocap.files.bvh import bvh
from beyond_mocap.motion.skeleton import Skeleton
from beyond_mocap.throws.network_npz import write_model
from beyond_mocap.throws.networks.chains import chains_of
from beyond_mocap.throws.networks.example import Example, describe
from beyond_mocap.throws.networks.generate import Options, generate
from beyond_mocap.throws.networks.limits import JointLimits, learn
from beyond_mocap.throws.networks.model import ThrowModel
from beyond_mocap.throws.networks.training_set import leg_reach, reference_of, shared_chains, with_mirrors
from beyond_mocap.throws.throw_examples import examples_in

from .config import TrainingConfig, read_config
from .fit import Trained, check_checkpoint, checkpoint_path, fit
from .hierarchy import Networks
from .networks import RIDGES, to_use
from .recordings import recordings

_RAW = Options(pose_iterations=0, ik=False, blend=False, limits=False)
_FOURTH = 4  # every fourth movement of a single subject is held out
_MOST = 8  # movements that are generated for each ridge
_ALIKE = 1.05  # errors up to this multiple of the lowest count as equal; the largest ridge of those is the safest
READING = 0.05
"""Share of the progress for reading the folder."""


def train(
    examples: Sequence[Example], config: TrainingConfig, *, checkpoint: Path | None = None, resume: bool = False,
    minutes: float | None = None, progress: Callable[[float, str], None] = lambda fraction, text: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> ThrowModel:
    """Train a model on examples of one skeleton, at the config's frame rate.

    Args:
        examples: the examples.
        config: configuration of the training.
        checkpoint: file of the checkpoint, used by `resume`, or None.
        resume: continue from the checkpoint.
        minutes: time limit, or None.
        progress: receives a share of 0 .. 1 and a text.
        cancelled: returns True to stop.
    Raises:
        InputError: if there is no example, skeletons or rates differ, or the checkpoint is of another training.
        Cancelled: if `cancelled` returns True.
    """
    _check(examples, config)
    settings = config.settings
    chains = shared_chains(examples)
    seen = with_mirrors(examples) if config.mirrored else list(examples)
    reference = reference_of(seen) if settings.phase == "warped" else None
    reach = leg_reach(seen)
    limits = learn(np.concatenate([one.motion.rotations for one in seen]), (0, *chains.above, chains.hips))
    held = held_out(seen)
    problem = Networks(recordings(seen, reference), chains, config, reach, JointLimits(chains.skeleton, limits), held)

    def model_of(params: dict, line: str) -> ThrowModel:
        return ThrowModel(
            settings=settings, skeleton=chains.skeleton,
            networks={name: to_use(params[name], problem.scales[name]) for name in settings.networks}, leg_reach=reach,
            examples=spread_over(examples, config.examples),
            stature=float(np.mean([example.stature for example in examples])), joint_limits=limits, reference=reference,
            trained_on=line,
        )

    if config.linear_start and not config.ridge:
        progress(0.0, "choosing the start")
        problem.ridge = least_astray(problem, [one for one, out in zip(seen, held) if out], model_of, cancelled)
    trained = fit(
        problem, config, checkpoint=checkpoint, resume=resume, minutes=minutes, progress=progress, cancelled=cancelled,
    )
    return model_of(trained.params, _line(examples, trained))


def spread_over(examples: Sequence[Example], most: int) -> list[Example]:
    """Select at most `most` examples of the first one's subject with different targets.

    The first, then always the one whose impact is farthest from those selected. Movements of one style blend better.
    """
    examples = [example for example in examples if example.subject == examples[0].subject]
    places = np.array([(*example.impact, 10.0 * example.limb) for example in examples])
    taken = [0]
    nearest = np.linalg.norm(places - places[0], axis=1)
    while len(taken) < min(most, len(examples)):
        nearest[taken] = -1.0
        taken.append(int(np.argmax(nearest)))
        nearest = np.minimum(nearest, np.linalg.norm(places - places[taken[-1]], axis=1))
    return [examples[i] for i in sorted(taken)]


def _check(examples: Sequence[Example], config: TrainingConfig) -> None:
    """Raise InputError if an example has another frame rate than the config."""
    wanted = config.settings.fps
    for example in examples:
        if abs(example.motion.fps - wanted) > 1e-6:
            found = f"{example.motion.fps:g} frames per second"
            raise InputError(f"example {example.name}", found, f"{wanted:g}, the config's rate", "read it at that rate")


def _line(examples: Sequence[Example], trained: Trained) -> str:
    """Describe the training in one line."""
    subjects = len({example.subject for example in examples})
    frames = sum(len(example.motion) for example in examples)
    whom = f"{len(examples)} examples of {subjects} subject{'s' if subjects > 1 else ''}, {frames} frames"
    loss = f", loss {trained.losses[-1]:.4f}" if trained.losses else ""
    return f"{whom}; {trained.epochs} epochs{loss}"


def held_out(examples: Sequence[Example]) -> np.ndarray:
    """Select the examples (N,) bool to hold out while the ridge is chosen.

    All of the last subject, or a fourth of a single subject's; none of three examples or fewer. An example's mirror
    image is held out with it.
    """
    subjects = list(dict.fromkeys(example.subject for example in examples))
    if len(subjects) > 1:
        return np.array([example.subject == subjects[-1] for example in examples])
    groups = list(dict.fromkeys((example.name, round(example.release, 6)) for example in examples))
    if len(groups) < _FOURTH:
        return np.zeros(len(examples), bool)
    out = set(groups[_FOURTH - 1 :: _FOURTH])
    return np.array([(example.name, round(example.release, 6)) in out for example in examples])


def least_astray(
    problem: Networks, held: Sequence[Example], model_of: Callable[[dict, str], ThrowModel],
    cancelled: Callable[[], bool] = lambda: False,
) -> float:
    """Choose the ridge whose networks keep hands and feet nearest to their targets on held out movements.

    Args:
        problem: the training problem.
        held: examples that the regression does not use; if empty, the largest ridge is returned.
        build_model: function that builds a model from parameters and a line of text.
        cancelled: returns True to stop.
    Returns:
        One of `RIDGES`.
    """
    if not held:
        return RIDGES[-1]
    asked = [held[i] for i in np.unique(np.linspace(0, len(held) - 1, _MOST).round().astype(int))]
    off = []
    for ridge in RIDGES:
        if cancelled():
            raise Cancelled("cancelled while choosing the start")
        model = model_of(problem.started(jax.random.key(0), problem.linear(ridge, whole=False)), "")
        off.append(np.mean([_off(model, example) for example in asked]))
    good = [ridge for ridge, one in zip(RIDGES, off) if one <= _ALIKE * min(off)]
    return good[-1] if good else RIDGES[-1]


def _off(model: ThrowModel, example: Example) -> float:
    """Measure the mean error (m) of the networks over frames, hands and feet; infinite if the body is invalid."""
    try:
        with np.errstate(all="ignore"):
            made = generate(model, describe(example), options=_RAW)
    except InputError:
        return np.inf
    return float(np.mean(made.raw))


def train_folder(options, told: Told) -> None:
    """Read the folder, train, and write the model and its checkpoint; options: of `throw train`."""
    begun = time.perf_counter()
    config = read_config(options.config, seed=options.seed, epochs=options.epochs, action=options.action)
    kept = checkpoint_path(options.out)
    check_outputs(options.out, kept, never=(options.config, options.skeleton))
    if options.resume:
        check_checkpoint(kept)
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
    """Read the folder's examples of the requested subjects, on the given skeleton or the first one's."""
    skeleton = _skeleton(options.skeleton) if options.skeleton else None
    found = _read(options, config, told, skeleton)
    first = found[0].motion.skeleton
    if skeleton is None and not all(example.motion.skeleton.same_bones(first) for example in found):
        found = _read(options, config, told, first)
    return found


def _skeleton(path: Path) -> Skeleton:
    """Read the skeleton of the model; InputError with the file's name if it lacks hands or feet."""
    skeleton = bvh.read(path).motion.skeleton
    try:
        chains_of(skeleton)
    except InputError as error:
        raise InputError(path, str(error)) from None
    return skeleton


def _read(options, config: TrainingConfig, told: Told, skeleton) -> list[Example]:
    """Read the examples and select the requested subjects."""
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
