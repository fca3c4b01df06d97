"""The ridge of the linear start, chosen by what it is for: frames fed back on movements that regression did not see."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import jax
import numpy as np

from beyond_mocap.base.errors import Cancelled, InputError
from beyond_mocap.throws.networks.example import Example, describe
from beyond_mocap.throws.networks.generate import Options, generate
from beyond_mocap.throws.networks.model import ThrowModel

from .hierarchy import Networks
from .networks import RIDGES

_RAW = Options(pose_iterations=0, ik=False, blend=False, limits=False)
_FOURTH = 4
_MOST = 8  # movements that are generated for each ridge
_ALIKE = 1.05  # so much more than the least still counts as the least: of those, the largest ridge is the safest


def held_out(examples: Sequence[Example]) -> np.ndarray:
    """Which examples (N,) are left out while the ridge is chosen: all of the last subject, or a fourth of one
    subject's; none of three examples or fewer. An example's mirror image goes with it."""
    subjects = list(dict.fromkeys(example.subject for example in examples))
    if len(subjects) > 1:
        return np.array([example.subject == subjects[-1] for example in examples])
    groups = list(dict.fromkeys((example.name, round(example.release, 6)) for example in examples))
    if len(groups) < _FOURTH:
        return np.zeros(len(examples), bool)
    out = set(groups[_FOURTH - 1 :: _FOURTH])
    return np.array([(example.name, round(example.release, 6)) in out for example in examples])


def least_astray(
    problem: Networks,
    held: Sequence[Example],
    model_of: Callable[[dict, str], ThrowModel],
    cancelled: Callable[[], bool] = lambda: False,
) -> float:
    """Of `RIDGES` the one whose networks keep hands and feet nearest to where they are wanted, on movements of which
    regression saw nothing. model_of: a model out of parameters and a line. The largest where nothing is held out."""
    if not held:
        return RIDGES[-1]
    asked = [held[i] for i in np.unique(np.linspace(0, len(held) - 1, _MOST).round().astype(int))]
    off = []
    for ridge in RIDGES:
        if cancelled():
            raise Cancelled("stopped while the start was chosen")
        model = model_of(problem.started(jax.random.key(0), problem.linear(ridge, whole=False)), "")
        off.append(np.mean([_off(model, example) for example in asked]))
    good = [ridge for ridge, one in zip(RIDGES, off) if one <= _ALIKE * min(off)]
    return good[-1] if good else RIDGES[-1]


def _off(model: ThrowModel, example: Example) -> float:
    """Metres by which what the networks say misses, mean over frames, hands and feet; a body that is lost is far
    off."""
    try:
        with np.errstate(all="ignore"):
            made = generate(model, describe(example), options=_RAW)
    except InputError:
        return np.inf
    return float(np.mean(made.raw))
