"""Train a model from a folder of examples: used by `throw train`.

The ridge of the linear start and the number of epochs are chosen by their purpose: frames fed back on movements that
were held out, those of one subject where there are several. The model itself is then trained on all.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import jax
import numpy as np

from beyond_mocap.base.errors import InputError, UserCancelledError
from beyond_mocap.cli.outputs import ProgressReporter, check_outputs
from beyond_mocap.cli.throwing import select_subjects
from beyond_mocap.files.bvh import bvh
from beyond_mocap.motion.motion import Motion
from beyond_mocap.throws.evaluate_throws import RAW_OPTIONS
from beyond_mocap.throws.network_npz import write_model
from beyond_mocap.throws.networks.chains import Chains, find_chains
from beyond_mocap.throws.networks.example import Example, build_description
from beyond_mocap.throws.networks.features import count_widths
from beyond_mocap.throws.networks.generate import generate_motion
from beyond_mocap.throws.networks.limits import JointLimits, estimate_joint_limits
from beyond_mocap.throws.networks.model import ThrowModel
from beyond_mocap.throws.networks.training_set import (
    add_mirror_images,
    build_reference_curve,
    find_shared_chains,
    measure_leg_reach,
)
from beyond_mocap.throws.throw_examples import read_examples

from .config import TrainingConfig, read_config
from .fit import EpochChoice, TrainingResult, build_checkpoint_path, check_checkpoint, fit
from .hierarchy import TrainingProblem
from .networks import RIDGES, to_phase_network
from .recordings import build_recordings

_HOLD_OUT_STEP = 4  # every fourth movement of a single subject is held out
_MAX_TESTED = 8  # movements that are generated for each ridge
_TOLERANCE = 1.05  # errors up to this multiple of the lowest count as equal; the largest ridge of those is the safest
_LEAST_MINUTES = 1e-3  # left to the training itself, where choosing the number of epochs took longer than it had
READING_SHARE = 0.05
"""Share of the progress for reading the folder."""
_CHOOSING_SHARE = 0.4  # share of progress and time for choosing the number of epochs; the time it leaves is used, too


def train(
    examples: Sequence[Example], config: TrainingConfig, *, checkpoint: Path | None = None, resume: bool = False,
    minutes: float | None = None, is_done: Callable[[int], bool] = lambda epoch: False,
    progress: Callable[[float, str], None] = lambda fraction, text: None, cancelled: Callable[[], bool] = lambda: False,
) -> ThrowModel:
    """Train a model on examples of one skeleton, at the config's frame rate.

    Args:
        examples: the examples.
        config: configuration of the training.
        checkpoint: file of the checkpoint, used by `resume`, or None.
        resume: continue from the checkpoint.
        minutes: time limit of the epochs, or None; the start and compiling are not counted.
        is_done: receives the epochs after each macro-epoch, and returns True to end with the model as it is then;
            `resume` continues from there.
        progress: receives a share of 0 .. 1 and a text.
        cancelled: returns True to stop.
    Raises:
        InputError: if there is no example, skeletons or rates differ, or the checkpoint is of another training.
        UserCancelledError: if `cancelled` returns True.
    """
    _check_rates(examples, config)
    _check_start(config)
    chains = find_shared_chains(examples, config.settings.shoulder)
    config, notes = widen_units(config, chains)
    settings = config.settings
    training_examples = add_mirror_images(examples) if config.mirrored else list(examples)
    reference = build_reference_curve(training_examples) if settings.phase == "warped" else None
    reach = measure_leg_reach(training_examples)
    limits = estimate_joint_limits(np.concatenate([one.motion.rotations for one in training_examples]),
                                   (0, *chains.above, chains.hips))
    is_held_out = select_held_out(training_examples)
    held = [one for one, out in zip(training_examples, is_held_out) if out]
    problem = TrainingProblem(build_recordings(training_examples, reference), chains, config, reach,
                              JointLimits(chains.skeleton, limits), is_held_out)

    def build_model(params: dict, line: str) -> ThrowModel:
        return ThrowModel(
            settings=settings, skeleton=chains.skeleton,
            networks={name: to_phase_network(params[name], problem.scales[name]) for name in settings.networks},
            leg_reach=reach, examples=select_spread(examples, config.examples, config.all_subjects),
            stature=float(np.mean([example.stature for example in examples])), joint_limits=limits, reference=reference,
            trained_on=line, notes=notes,
        )

    if config.linear_start and not config.ridge:
        progress(0.0, "choosing the start")
        problem.ridge = choose_ridge(problem, held, build_model, cancelled)
    choice, share, used = None, 0.0, 0.0
    if config.early_stopping and config.epochs and not resume:
        share = _CHOOSING_SHARE
        others = held if len({example.subject for example in examples}) > 1 else []
        choice, used = choose_epochs(problem, config, others, build_model, minutes=minutes and share * minutes,
                                     progress=lambda done, text: progress(share * done, f"held out: {text}"),
                                     cancelled=cancelled)
    trained = fit(
        problem, config, checkpoint=checkpoint, resume=resume,
        minutes=minutes and max(minutes - used / 60.0, _LEAST_MINUTES),
        choice=choice, is_done=lambda params, epoch: is_done(epoch),
        progress=lambda done, text: progress(share + (1.0 - share) * done, text), cancelled=cancelled,
    )
    late = f"the time limit ended the training after {trained.epochs} epochs" if trained.is_out_of_time else ""
    notes = (*notes, *(line for line in (trained.line, late) if line))
    return build_model(trained.params, _describe_training(examples, trained))


def widen_units(config: TrainingConfig, chains: Chains) -> tuple[TrainingConfig, tuple[str, ...]]:
    """Widen the networks where the linear start needs it: twice as many units as a network has outputs.

    Returns:
        The config, and a line about it if it is another one.
    """
    widths = count_widths(chains, config.settings)
    name = max(widths, key=lambda each: widths[each][1])
    outputs, units = widths[name][1], config.settings.units
    if not config.linear_start or 2 * outputs <= units:
        return config, ()
    line = f"{2 * outputs} units instead of {units}, because the network {name} has {outputs} outputs"
    return replace(config, settings=replace(config.settings, units=2 * outputs)), (line,)


def choose_epochs(
    problem: TrainingProblem, config: TrainingConfig, held: Sequence[Example],
    build_model: Callable[[dict, str], ThrowModel], *, minutes: float | None,
    progress: Callable[[float, str], None] = lambda share, text: None, cancelled: Callable[[], bool] = lambda: False,
) -> tuple[EpochChoice, float]:
    """Choose the number of epochs by training without the held out examples until they no longer improve.

    Args:
        problem: the training problem.
        config: its configuration.
        held: examples of a subject that is held out; if empty, no epoch can be shown to help. Other movements of a
            subject that is trained on do not show it: five kicks of one player gained there, and lost on others.
        build_model: function that builds a model from parameters and a line of text.
        minutes: time limit, or None.
        progress: receives a share of 0 .. 1 and a text.
        cancelled: returns True to stop.
    Returns:
        The choice, and the seconds of training that it took.
    """
    if not held:
        few = "there is no second subject to hold out, to see how many epochs help other people"
        count, name = (0, "the linear start alone") if config.linear_start else (config.epochs, "all epochs")
        return EpochChoice(count, f"{name}: {few}"), 0.0
    tested, kept = _select_tested(held), problem.without_held_out()
    start = build_model(kept.build_parameters(jax.random.key(config.seed)), "")
    epochs, errors = [0], [_measure_errors(start, tested, cancelled)]

    def is_done(params: dict, epoch: int) -> bool:
        epochs.append(epoch)
        errors.append(_measure_errors(build_model(params, ""), tested, cancelled))
        return len(errors) - 1 - int(np.argmin(errors)) >= config.patience

    tried = fit(kept, config, minutes=minutes, is_done=is_done, progress=progress, cancelled=cancelled)
    best = int(np.argmin(errors))
    who = ", ".join(dict.fromkeys(example.subject for example in held))
    late = f" (the time limit ended the choice after {epochs[-1]})" if tried.is_out_of_time else ""
    chosen = epochs[best] or (0 if config.linear_start else config.epochs)
    return EpochChoice(chosen, (
        f"{chosen} of {config.epochs} epochs{late}: held out to choose that, {len(tested)} movements of {who}, "
        f"hands and feet {100 * errors[0]:.2f} cm off without epochs and {100 * min(errors[1:]):.2f} cm with "
        f"{epochs[1 + int(np.argmin(errors[1:]))]}, networks alone")), tried.seconds


def select_spread(examples: Sequence[Example], most: int, all_subjects: bool = True) -> list[Example]:
    """Select at most `most` examples with different targets, as many of each subject as of any other.

    Args:
        examples: the examples.
        most: largest number of them.
        all_subjects: of all subjects, otherwise of the first one.
    """
    subjects = list(dict.fromkeys(example.subject for example in examples))[: None if all_subjects else 1]
    own = [[example for example in examples if example.subject == subject] for subject in subjects]
    found: list[Example] = []
    for number, part in enumerate(sorted(own, key=len)):  # what few examples leave free is for the others
        found += _select_spread_of_subject(part, (most - len(found)) // (len(own) - number))
    return [example for example in examples if any(example is one for one in found)]


def _select_spread_of_subject(examples: Sequence[Example], most: int) -> list[Example]:
    """Select at most `most` examples: the first, then always the one whose impact is farthest from those selected."""
    if not most:
        return []
    places = np.array([(*example.impact, 10.0 * example.limb) for example in examples])
    selected = [0]
    nearest = np.linalg.norm(places - places[0], axis=1)
    while len(selected) < min(most, len(examples)):
        nearest[selected] = -1.0
        selected.append(int(np.argmax(nearest)))
        nearest = np.minimum(nearest, np.linalg.norm(places - places[selected[-1]], axis=1))
    return [examples[i] for i in sorted(selected)]


def _check_rates(examples: Sequence[Example], config: TrainingConfig) -> None:
    """Raise InputError if an example has another frame rate than the config."""
    rate = config.settings.fps
    for example in examples:
        if abs(example.motion.fps - rate) > 1e-6:
            found = f"{example.motion.fps:g} frames per second"
            raise InputError(f"example {example.name}", found, f"{rate:g}, the config's rate", "read it at that rate")


def _check_start(config: TrainingConfig) -> None:
    """Raise InputError if the networks would stay random."""
    if not config.linear_start and not config.epochs:
        raise InputError("training: epochs", "0 from random weights", "1 or more, or linear_start true",
                         "networks that are not trained move nothing")  # fmt: skip


def _describe_training(examples: Sequence[Example], trained: TrainingResult) -> str:
    """Describe the training in one line."""
    subjects = len({example.subject for example in examples})
    frames = sum(len(example.motion) for example in examples)
    data_text = f"{len(examples)} examples of {subjects} subject{'s' if subjects > 1 else ''}, {frames} frames"
    loss = f", loss {trained.losses[-1]:.4f}" if trained.losses else ""
    return f"{data_text}; {trained.epochs} epochs{loss}"


def select_held_out(examples: Sequence[Example]) -> np.ndarray:
    """Select the examples (N,) bool to hold out while the ridge is chosen.

    All of the last subject, or a fourth of a single subject's; none of three examples or fewer. An example's mirror
    image is held out with it.
    """
    subjects = list(dict.fromkeys(example.subject for example in examples))
    if len(subjects) > 1:
        return np.array([example.subject == subjects[-1] for example in examples])
    groups = list(dict.fromkeys((example.name, round(example.release, 6)) for example in examples))
    if len(groups) < _HOLD_OUT_STEP:
        return np.zeros(len(examples), bool)
    held_out_groups = set(groups[_HOLD_OUT_STEP - 1 :: _HOLD_OUT_STEP])
    return np.array([(example.name, round(example.release, 6)) in held_out_groups for example in examples])


def choose_ridge(
    problem: TrainingProblem, held: Sequence[Example], build_model: Callable[[dict, str], ThrowModel],
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
    tested = _select_tested(held)
    errors = []
    for ridge in RIDGES:
        model = build_model(problem.build_weights(jax.random.key(0), problem.fit_linear(ridge, use_held_out=False)), "")
        errors.append(_measure_errors(model, tested, cancelled))
    good = [ridge for ridge, one in zip(RIDGES, errors) if one <= _TOLERANCE * min(errors)]
    return good[-1] if good else RIDGES[-1]


def _select_tested(held: Sequence[Example]) -> list[Example]:
    """Select the examples that are generated, evenly."""
    return [held[i] for i in np.unique(np.linspace(0, len(held) - 1, _MAX_TESTED).round().astype(int))]


def _measure_errors(model: ThrowModel, examples: Sequence[Example], cancelled: Callable[[], bool]) -> float:
    """Measure the mean of `_measure_error` over examples; UserCancelledError if `cancelled` returns True."""
    errors = []
    for example in examples:
        if cancelled():
            raise UserCancelledError("cancelled before the training on all examples; it begins again")
        errors.append(_measure_error(model, example))
    return float(np.mean(errors))


def _measure_error(model: ThrowModel, example: Example) -> float:
    """Measure the mean error (m) of the networks over frames, hands and feet; infinite if the body is invalid."""
    try:
        with np.errstate(all="ignore"):
            generated = generate_motion(model, build_description(example), options=RAW_OPTIONS)
    except InputError:
        return np.inf
    return float(np.mean(generated.network_deviation))


def train_folder(options, report: ProgressReporter) -> None:
    """Read the folder, train, and write the model and its checkpoint; options: of `throw train`."""
    start_time = time.perf_counter()
    config = read_config(options.config, seed=options.seed, epochs=options.epochs, action=options.action)
    checkpoint = build_checkpoint_path(options.out)
    check_outputs(options.out, checkpoint, reserved=(options.config, options.skeleton))
    if options.resume:
        check_checkpoint(checkpoint)
    target = _read_target(options.skeleton) if options.skeleton else None
    examples = read_training_examples(options.folder, config, options.subject, target, report)

    def progress(share: float, text: str) -> None:
        report.show_progress(READING_SHARE + (1.0 - READING_SHARE) * share, text)

    model = train(
        examples, config, checkpoint=checkpoint, resume=options.resume, minutes=options.minutes,
        progress=progress, cancelled=report.is_cancelled,
    )
    write_model(model, options.out, half=options.half)
    report.finish()
    for note in model.notes:
        report.show_note(note)
    weights = sum(network.parameters for network in model.networks.values())
    seconds = time.perf_counter() - start_time
    print(f"{options.out}: {model.trained_on}; {len(model.networks)} networks, {weights} weights, {seconds:.0f} s")


def read_training_examples(
    folder: Path, config: TrainingConfig, subjects: Sequence[str], target: Motion | None, report: ProgressReporter,
) -> list[Example]:
    """Read a folder's examples, all on one skeleton.

    Args:
        folder: folder of recordings.
        config: configuration of the training.
        subjects: names of the subjects to select; if empty, all.
        target: a motion on the skeleton of the examples; None for the first of them.
        report: receives notes and progress.
    Raises:
        InputError: if there is no example, or a subject is unknown.
    """
    found = _read_selected(folder, config, subjects, target, report)
    first = found[0].motion
    if target is None and not all(example.motion.skeleton.has_same_bones(first.skeleton) for example in found):
        found = _read_selected(folder, config, subjects, first, report)
    return found


def _read_target(path: Path) -> Motion:
    """Read a motion on the model's skeleton; InputError with the file's name if it lacks hands or feet."""
    motion = bvh.read_bvh(path).motion
    try:
        find_chains(motion.skeleton)
    except InputError as error:
        raise InputError(path, str(error)) from None
    return motion


def _read_selected(folder, config: TrainingConfig, subjects, target, report: ProgressReporter) -> list[Example]:
    """Read the examples and select the requested subjects."""
    def progress(share: float, text: str) -> None:
        report.show_progress(READING_SHARE * share, text)

    settings = config.settings
    found = read_examples(
        folder, settings.action, settings.fps, target, report.show_note, progress=progress,
        cancelled=report.is_cancelled,
    )
    return select_subjects(found, subjects, folder)
