"""From examples to a model: what the command and the experiments call."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from beyond_mocap.base.errors import InputError
from beyond_mocap.throws.networks.example import Example
from beyond_mocap.throws.networks.limits import JointLimits, learn
from beyond_mocap.throws.networks.model import ThrowModel
from beyond_mocap.throws.networks.training_set import leg_reach, reference_of, shared_chains, with_mirrors

from .config import TrainingConfig
from .fit import Trained, fit
from .hierarchy import Networks
from .networks import to_use
from .recordings import recordings
from .ridge import held_out, least_astray


def train(
    examples: Sequence[Example],
    config: TrainingConfig,
    *,
    checkpoint: Path | None = None,
    resume: bool = False,
    minutes: float | None = None,
    progress: Callable[[float, str], None] = lambda fraction, text: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> ThrowModel:
    """A model trained on examples of one skeleton, at the config's rate.

    checkpoint: where one is kept, and found with `resume`. minutes: stop then with what stands. InputError: no example,
    different skeletons or rates, a checkpoint of another training; Cancelled where asked to stop.
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
            settings=settings,
            skeleton=chains.skeleton,
            networks={name: to_use(params[name], problem.scales[name]) for name in settings.networks},
            leg_reach=reach,
            examples=spread_over(examples, config.examples),
            stature=float(np.mean([example.stature for example in examples])),
            joint_limits=limits,
            reference=reference,
            trained_on=line,
        )

    if config.linear_start and not config.ridge:
        progress(0.0, "the start is chosen")
        problem.ridge = least_astray(problem, [one for one, out in zip(seen, held) if out], model_of, cancelled)
    trained = fit(
        problem, config, checkpoint=checkpoint, resume=resume, minutes=minutes, progress=progress, cancelled=cancelled,
    )
    return model_of(trained.params, _line(examples, trained))


def spread_over(examples: Sequence[Example], most: int) -> list[Example]:
    """At most so many of the examples, all of the first one's subject (movements of one manner are blended better), of
    different targets: the first, then always the one whose impact is farthest from those taken."""
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
    wanted = config.settings.fps
    for example in examples:
        if abs(example.motion.fps - wanted) > 1e-6:
            found = f"{example.motion.fps:g} frames per second"
            raise InputError(f"example {example.name}", found, f"{wanted:g} as the config has", "read it at that rate")


def _line(examples: Sequence[Example], trained: Trained) -> str:
    subjects = len({example.subject for example in examples})
    frames = sum(len(example.motion) for example in examples)
    whom = f"{len(examples)} examples of {subjects} subject{'s' if subjects > 1 else ''}, {frames} frames"
    loss = f", loss {trained.losses[-1]:.4f}" if trained.losses else ""
    return f"{whom}; {trained.epochs} epochs{loss}"
