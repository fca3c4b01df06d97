"""Models whose networks are linear least squares, for tests that need sensible answers within a second."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from beyond_mocap.base.errors import InputError
from beyond_mocap.synthetic.throws import throw
from beyond_mocap.throws.networks.answers import network_output
from beyond_mocap.throws.networks.example import Example, example_of
from beyond_mocap.throws.networks.features import network_input, phase_of
from beyond_mocap.throws.networks.limits import learn
from beyond_mocap.throws.networks.model import ModelSettings, ThrowModel
from beyond_mocap.throws.networks.network import PhaseNetwork
from beyond_mocap.throws.networks.training_set import (
    joined,
    leg_reach,
    reference_of,
    shared_chains,
    steps,
    with_mirrors,
)
from beyond_mocap.throws.planted_examples import kick

FAR = 1e3  # hidden values are moved by it, so that no unit is ever below 0, where it would bend


def planted_examples(count=12, seed=0, fps=30.0):
    """Made throws of one body at known targets, in the normalised frame."""
    random, found = np.random.default_rng(seed), []
    while len(found) < count:
        speed, far, high = random.uniform(14, 24), random.uniform(8, 20), random.uniform(0.4, 2.0)
        try:
            made = throw((far, 0.0, high), speed, fps=120.0)
        except InputError:
            continue
        span = (made.release - 1.2, made.release + 0.8)
        found.append(example_of(f"throw{len(found)}", "one", made.motion, "right_hand", made.release,
                                (far, 0.0, high), made.velocity, fps, span))  # fmt: skip
    return tuple(found)


class TrainingSet(NamedTuple):
    """inputs (N, in), answers (N, out) and phases (N,) of one network; N steps of all examples one after the other."""

    inputs: np.ndarray
    answers: np.ndarray
    phases: np.ndarray


def training_set(examples: Iterable[Example], settings: ModelSettings, mirrors: bool = False) -> dict[str, TrainingSet]:
    """What each network of `settings.networks` learns from. mirrors: with the mirror image of each example too.

    All examples have the same skeleton. InputError where there is none or they differ.
    """
    examples = with_mirrors(examples) if mirrors else list(examples)
    chains = shared_chains(examples)
    reference = reference_of(examples) if settings.phase == "warped" else None
    reach, whole = leg_reach(examples), joined([steps(example, reference) for example in examples])
    return {
        name: TrainingSet(
            network_input(name, chains, settings, *whole),
            network_output(name, chains, settings, whole.pose, whole.after),
            phase_of(name, chains, whole.after, whole.window, reach),
        )
        for name in settings.networks
    }


def linear_model(examples, action="throw", ridge=1.0):
    """The hierarchy that answers by ridge regression on the examples."""
    rows = training_set(examples, ModelSettings(points=1, layers=1, units=1, action=action))
    units = max(part.answers.shape[1] for part in rows.values())
    settings = ModelSettings(points=1, layers=1, units=units, action=action)
    return ThrowModel(
        settings=settings, skeleton=examples[0].motion.skeleton,
        networks={name: _linear(part, units, ridge) for name, part in rows.items()}, leg_reach=leg_reach(examples),
        examples=tuple(examples),
        joint_limits=learn(np.concatenate([example.motion.rotations for example in examples])),
    )  # fmt: skip


def _linear(rows, units, ridge):
    scales = [(part.mean(0), part.std(0) + 1e-3) for part in (rows.inputs, rows.answers)]
    x, y = ((part - mean) / scale for part, (mean, scale) in zip((rows.inputs, rows.answers), scales))
    answers = y.shape[1]
    slopes = np.zeros((units, x.shape[1]))
    slopes[:answers] = np.linalg.solve(x.T @ x + ridge * np.eye(x.shape[1]), x.T @ y).T
    taken = np.eye(answers, units)
    return PhaseNetwork(
        (slopes[None], taken[None]), (np.full((1, units), FAR), np.full((1, answers), -FAR)),
        *scales[0], *scales[1],
    )  # fmt: skip


def planted_kicks(count=5, seed=0, fps=30.0):
    """Made kicks of one body at known targets, in the normalised frame."""
    random, found = np.random.default_rng(seed), []
    while len(found) < count:
        speed, far, high = random.uniform(14, 24), random.uniform(9, 22), random.uniform(0.3, 1.6)
        try:
            made = kick((far, 0.0, high), speed, fps=120.0)
        except InputError:
            continue
        span = (made.contact - 1.1, made.contact + 0.8)
        found.append(example_of(f"kick{len(found)}", "one", made.motion, "right_foot", made.contact,
                                (far, 0.0, high), made.velocity, fps, span))  # fmt: skip
    return tuple(found)
