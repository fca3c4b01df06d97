"""Models whose networks are linear least squares, for tests that need sensible answers within a second."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from beyond_mocap.base.errors import InputError
from beyond_mocap.synthetic.throws import build_throw
from beyond_mocap.throws.networks.example import Example, build_example
from beyond_mocap.throws.networks.features import build_input, compute_phase
from beyond_mocap.throws.networks.limits import estimate_joint_limits
from beyond_mocap.throws.networks.model import ModelSettings, ThrowModel
from beyond_mocap.throws.networks.network import PhaseNetwork
from beyond_mocap.throws.networks.network_output import build_output
from beyond_mocap.throws.networks.training_set import (
    add_mirror_images,
    build_reference_curve,
    build_steps,
    find_shared_chains,
    join_steps,
    measure_leg_reach,
)
from beyond_mocap.throws.synthetic_examples import generate_kick_at
from beyond_mocap.throws.throw_records import ACTIONS

HIDDEN_OFFSET = 1e3  # hidden values are moved by it, so that no unit is ever below 0, where it would bend


def build_throw_examples(count=12, seed=0, fps=30.0):
    """Made throws of one body at known targets, in the normalised frame, as long as recorded ones are cut at least:
    shorter ones begin and end with a foot in the air, from which no library goes on smoothly."""
    random, found = np.random.default_rng(seed), []
    while len(found) < count:
        speed, far, high = random.uniform(14, 24), random.uniform(8, 20), random.uniform(0.4, 2.0)
        try:
            throw_result = build_throw((far, 0.0, high), speed, fps=120.0)
        except InputError:
            continue
        span = (throw_result.release - ACTIONS["throw"].before[0], throw_result.release + ACTIONS["throw"].after[0])
        found.append(build_example(f"throw{len(found)}", "one", throw_result.motion, "right_hand", throw_result.release,
                                   (far, 0.0, high), throw_result.velocity, fps, span))  # fmt: skip
    return tuple(found)


class TrainingSet(NamedTuple):
    """inputs (N, in), answers (N, out) and phases (N,) of one network; N steps of all examples one after the other."""

    inputs: np.ndarray
    outputs: np.ndarray
    phases: np.ndarray


def build_training_set(examples: Iterable[Example], settings: ModelSettings, mirrors: bool = False) -> dict[str,
        TrainingSet]:
    """What each network of `settings.networks` learns from. mirrors: with the mirror image of each example too.

    All examples have the same skeleton. InputError where there is none or they differ.
    """
    examples = add_mirror_images(examples) if mirrors else list(examples)
    chains = find_shared_chains(examples, settings.shoulder)
    reference = build_reference_curve(examples) if settings.phase == "warped" else None
    reach, whole = measure_leg_reach(examples), join_steps([build_steps(example, reference) for example in examples])
    return {
        name: TrainingSet(
            build_input(name, chains, settings, *whole),
            build_output(name, chains, settings, whole.pose, whole.after),
            compute_phase(name, chains, whole.after, whole.window, reach),
        )
        for name in settings.networks
    }


def build_linear_model(examples, action="throw", ridge=1.0):
    """The hierarchy that answers by ridge regression on the examples."""
    rows = build_training_set(examples, ModelSettings(points=1, layers=1, units=1, action=action))
    units = max(part.outputs.shape[1] for part in rows.values())
    settings = ModelSettings(points=1, layers=1, units=units, action=action)
    return ThrowModel(
        settings=settings, skeleton=examples[0].motion.skeleton,
        networks={name: _build_linear_network(part, units, ridge) for name, part in rows.items()},
        leg_reach=measure_leg_reach(examples), examples=tuple(examples),
        joint_limits=estimate_joint_limits(np.concatenate([example.motion.rotations for example in examples])),
    )  # fmt: skip


def _build_linear_network(rows, units, ridge):
    scales = [(part.mean(0), part.std(0) + 1e-3) for part in (rows.inputs, rows.outputs)]
    x, y = ((part - mean) / scale for part, (mean, scale) in zip((rows.inputs, rows.outputs), scales))
    output_count = y.shape[1]
    slopes = np.zeros((units, x.shape[1]))
    slopes[:output_count] = np.linalg.solve(x.T @ x + ridge * np.eye(x.shape[1]), x.T @ y).T
    selection = np.eye(output_count, units)
    return PhaseNetwork(
        (slopes[None], selection[None]), (np.full((1, units), HIDDEN_OFFSET),
                                          np.full((1, output_count), -HIDDEN_OFFSET)), *scales[0], *scales[1],
    )  # fmt: skip


def build_kick_examples(count=5, seed=0, fps=30.0):
    """Made kicks of one body at known targets, in the normalised frame."""
    random, found = np.random.default_rng(seed), []
    while len(found) < count:
        speed, far, high = random.uniform(14, 24), random.uniform(9, 22), random.uniform(0.3, 1.6)
        try:
            kick_result = generate_kick_at((far, 0.0, high), speed, fps=120.0)
        except InputError:
            continue
        span = (kick_result.contact - 1.1, kick_result.contact + 0.8)
        found.append(build_example(f"kick{len(found)}", "one", kick_result.motion, "right_foot", kick_result.contact,
                                   (far, 0.0, high), kick_result.velocity, fps, span))  # fmt: skip
    return tuple(found)
