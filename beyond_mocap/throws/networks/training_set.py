"""Training data of the networks: the steps of all examples, their mirror images, skeleton and leg reach."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from ...base.errors import InputError
from .chains import LIMB_OF, Chains, find_chains
from .description import Description, Windows, build_windows
from .example import Example, build_description, compute_poses, mirror_example
from .features import measure_limb_distance
from .kinematics import Pose
from .phases import compute_reference_curve

_MARGIN = 1e-6  # metres by which a leg's reach is widened, so that it is never empty


class Steps(NamedTuple):
    """All steps n -> n + 1 of an example.

    Attributes:
        pose: states before, (T - 1, ...).
        after: states after, (T - 1, ...).
        window: network inputs of each step.
    """

    pose: Pose
    after: Pose
    window: Windows


def build_steps(example: Example, reference: np.ndarray | None = None) -> Steps:
    """Build the steps of an example.

    Args:
        example: the example.
        reference: (N,) speed curve for warped phases, or None.
    """
    states, window = compute_poses(example), build_windows(build_description(example), reference)
    return Steps(_slice_rows(states, slice(-1)), _slice_rows(states, slice(1, None)), _slice_rows(window, slice(-1)))


def join_steps(all_steps: Sequence[Steps]) -> Steps:
    """Join the steps of several examples."""
    return Steps(*(_stack_rows([steps[i] for steps in all_steps]) for i in range(3)))


def add_mirror_images(examples: Iterable[Example]) -> list[Example]:
    """Return each example, followed by its mirror image."""
    return [variant for example in examples for variant in (example, mirror_example(example))]


def find_shared_chains(examples: Sequence[Example], shoulder: str = "body") -> Chains:
    """Find the chains of the skeleton that all examples share; `shoulder` as for `find_chains`.

    Raises:
        InputError: if there is no example, or the skeletons differ.
    """
    if not examples:
        raise InputError("examples", "none", "at least one throw or kick")
    first = examples[0].motion.skeleton
    for example in examples:
        if not example.motion.skeleton.has_same_bones(first):
            raise InputError(f"example {example.name}", "a different skeleton", "the skeleton of the other examples",
                             "retarget them first")  # fmt: skip
    return find_chains(first, shoulder)


def measure_leg_reach(examples: Sequence[Example]) -> dict[str, tuple[float, float]]:
    """Measure the shortest and longest distance, metres, from the top of each leg to its toe (eq. 7.3)."""
    chains = find_shared_chains(examples)
    all_steps = join_steps([build_steps(example) for example in examples])
    found = {}
    for number in (2, 3):
        distance = measure_limb_distance(number, chains, all_steps.after, all_steps.window)[..., 0]
        found[LIMB_OF[number][:-4]] = (float(distance.min()) - _MARGIN, float(distance.max()) + _MARGIN)
    return found


def build_reference_curve(examples: Iterable[Example]) -> np.ndarray:
    """Build the speed curve (N,) to which warped phases of these examples are warped (section 9.3)."""
    descriptions: list[Description] = [build_description(example) for example in examples]
    return compute_reference_curve([(description.effectors[:, description.limb], description.release)
                                    for description in descriptions], descriptions[0].fps if descriptions else 1.0)


def _slice_rows(arrays, cut: slice):
    """Slice every array of a Pose or Windows; None stays None."""
    return type(arrays)(*(None if array is None else array[cut] for array in arrays))


def _stack_rows(parts: list):
    """Join Poses or Windows along the first axis."""
    return type(parts[0])(*(None if rows[0] is None else np.concatenate(rows) for rows in zip(*parts)))
