"""What networks learn from: the steps of all examples, their mirror images, their skeleton and their reach."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from ...base.errors import InputError
from .chains import LIMB_OF, Chains, chains_of
from .description import Description, Windows, windows
from .example import Example, describe, mirrored, poses
from .features import stretch
from .kinematics import Pose
from .phases import reference_curve

_MARGIN = 1e-6  # metres by which a leg's reach is widened, so that it is a range even where nothing moves


class Steps(NamedTuple):
    """All steps n -> n + 1 of an example: states before and after (T - 1, ...), and what is told of each."""

    pose: Pose
    after: Pose
    window: Windows


def steps(example: Example, reference: np.ndarray | None = None) -> Steps:
    """The example's steps. reference: the speed curve for warped phases."""
    states, window = poses(example), windows(describe(example), reference)
    return Steps(_rows(states, slice(-1)), _rows(states, slice(1, None)), _rows(window, slice(-1)))


def joined(all_steps: Sequence[Steps]) -> Steps:
    """The steps of several examples as those of one."""
    return Steps(*(_stacked([steps[i] for steps in all_steps]) for i in range(3)))


def with_mirrors(examples: Iterable[Example]) -> list[Example]:
    """Each example and its mirror image."""
    return [one for example in examples for one in (example, mirrored(example))]


def shared_chains(examples: Sequence[Example]) -> Chains:
    """The chains of the skeleton that all examples have; InputError where there is none or they differ."""
    if not examples:
        raise InputError("examples", "none", "one throw or kick at least")
    first = examples[0].motion.skeleton
    for example in examples:
        if not example.motion.skeleton.same_bones(first):
            raise InputError(f"example {example.name}", "another skeleton", "that of the others", "retarget them first")
    return chains_of(first)


def leg_reach(examples: Sequence[Example]) -> dict[str, tuple[float, float]]:
    """Shortest and longest distance in metres from the top of a leg to its toe (eq. 7.3), over both legs' own
    examples."""
    chains = shared_chains(examples)
    whole = joined([steps(example) for example in examples])
    found = {}
    for number in (2, 3):
        distance = stretch(number, chains, whole.after, whole.window)[..., 0]
        found[LIMB_OF[number][:-4]] = (float(distance.min()) - _MARGIN, float(distance.max()) + _MARGIN)
    return found


def reference_of(examples: Iterable[Example]) -> np.ndarray:
    """The speed curve that warped phases of these examples are warped to (§9.3)."""
    told: list[Description] = [describe(example) for example in examples]
    return reference_curve([(one.effectors[:, one.limb], one.release) for one in told], told[0].fps if told else 1.0)


def _rows(arrays, cut: slice):
    """The same rows of every array of a Pose or Windows; what is None stays so."""
    return type(arrays)(*(None if array is None else array[cut] for array in arrays))


def _stacked(parts: list):
    """Poses or Windows one after the other."""
    return type(parts[0])(*(None if rows[0] is None else np.concatenate(rows) for rows in zip(*parts)))
