"""One frame after the other: what the networks say of the next frame, brought within the joints' limits and towards
where hands and feet are wanted (Fredriksson §7.7)."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...base.errors import InputError
from . import answers, features, phase_function
from .chains import Chains, chains_of
from .description import BACK, SAMPLES, STEP, Windows
from .kinematics import Pose
from .limb_reach import LimbReach, posed
from .limits import JointLimits, learn
from .model import SINGLE, ThrowModel
from .one_frame import OneFrame

_SETTLES = 0.12
"""Seconds in which tanh brings an offset trajectory back to the wanted one by three quarters (§7.7.3)."""

_FELT = 2e-3
"""Radians that a limit takes off a joint from where its limb reaches again."""


class Step(NamedTuple):
    """The next frame. pose: as it is to be. state: what the frame after is predicted from: the pose, or for a single
    network without inverse kinematics its own floating places (§7.2). predicted (4, 3) m: where the networks had the
    effectors. over (J,): radians by which joints were beyond their limits. floating (j, 3) m: the places that a
    single network says, or None."""

    pose: Pose
    state: Pose
    predicted: np.ndarray
    over: np.ndarray
    floating: np.ndarray | None


class Stepper:
    """A model made ready to say one frame after the other."""

    def __init__(self, model: ThrowModel):
        """InputError where networks are told other than their settings say."""
        self.model = model
        self.chains = chains_of(model.skeleton)
        _check_widths(model, self.chains)
        self.limits = JointLimits(model.skeleton, _limits_of(model))
        self.effectors = list(self.chains.effectors)
        self.hierarchy = OneFrame(model, self.chains) if model.settings.kind == "hierarchy" else None
        self.reach = LimbReach(self.chains, self.limits, model.settings.wrist == "given")

    def step(self, pose: Pose, window: Windows, wanted: np.ndarray, share: np.ndarray | None, limited: bool) -> Step:
        """Frame n + 1 from the pose and window of n. wanted (4, 3) m: where the effectors are to be; share (4,): how
        much of the way from what the networks say to there each is taken, None for none of them. limited: joints are
        kept within their limits, and networks asked only for what is near what they know."""
        after, floating = self.predicted(pose, window, limited)
        said = after.positions[self.effectors] if floating is None else self._said(floating)
        over = np.zeros(len(self.model.skeleton))
        if limited and share is None:
            after, over = self._limited(after)
        elif limited:
            after, over = self._within_reach(after, wanted, share)
        elif share is not None:
            after = self.reach(after, wanted, share)
        state = after if floating is None or share is not None else self._afloat(after, floating)
        return Step(after, state._replace(moved=state.positions - pose.positions), said, over, floating)

    def predicted(self, pose: Pose, window: Windows, bounded: bool) -> tuple[Pose, np.ndarray | None]:
        """What the networks say of the next frame; of a single network also the places of the joints that it moves.
        bounded: they are not asked for what lies far from all that they have seen."""
        if self.hierarchy is not None:
            return self.hierarchy(pose, window, bounded), None
        network, settings = self.model.networks[SINGLE], self.model.settings
        theta = phase_function.weights_at(float(window.phase), network.points)
        x = features.single_input(self.chains, settings, pose, window)
        y = network.frame(np.clip(x, *network.bounds) if bounded else x, theta).astype(float)
        floating = answers.floating(self.chains, settings, y, pose)[0]
        return answers.answered(SINGLE, self.chains, settings, y=y, pose=pose, after=pose, window=window), floating

    def _said(self, floating: np.ndarray) -> np.ndarray:
        return floating[[self.chains.joints.index(joint) for joint in self.effectors]]

    def _afloat(self, pose: Pose, floating: np.ndarray) -> Pose:
        places = pose.positions.copy()
        places[list(self.chains.joints)] = floating
        return pose._replace(positions=places)

    def _within_reach(self, after: Pose, wanted: np.ndarray, share: np.ndarray) -> tuple[Pose, np.ndarray]:
        """The pose with limbs that reach and joints within their limits; where a limit has a say, limbs reach again
        with what is left to them."""
        after, over = self._limited(self.reach(after, wanted, share))
        if over.max() > _FELT:
            after, more = self._limited(self.reach(after, wanted, share))
            over = np.maximum(over, more)
        return after, over

    def _limited(self, pose: Pose) -> tuple[Pose, np.ndarray]:
        local, over = self.limits.within(pose.local)
        return (pose, over) if local is pose.local else (posed(self.chains, pose.root, local), over)


@lru_cache(maxsize=8)
def stepper(model: ThrowModel) -> Stepper:
    """The model made ready; kept, as models are asked again and again."""
    return Stepper(model)


def _check_widths(model: ThrowModel, chains: Chains) -> None:
    for name, (inputs, outputs) in features.widths(chains, model.settings).items():
        network = model.networks[name]
        if (network.inputs, network.outputs) != (inputs, outputs):
            found = f"{network.inputs} inputs and {network.outputs} outputs"
            raise InputError(
                f"model: network {name}", found, f"{inputs} and {outputs} on this skeleton", "train it again"
            )


def _limits_of(model: ThrowModel) -> np.ndarray:
    """The model's joint limits, or those of its examples."""
    if model.joint_limits is not None:
        return model.joint_limits
    free = (0, *stillness(model))
    return learn(np.concatenate([example.motion.rotations for example in model.examples]), free)


def stillness(model: ThrowModel) -> tuple[int, ...]:
    """Joints without limits besides the root: those between it and the hips, and the hips."""
    chains = chains_of(model.skeleton)
    return (*chains.above, chains.hips)


@lru_cache(maxsize=8)
def _fading(fps: float) -> tuple[np.ndarray, np.ndarray, float]:
    """How much of an offset is left at a window's samples (9, 1), how much less a frame later (9, 1), and in the next
    frame."""
    seconds = (np.arange(SAMPLES) - BACK) * STEP

    def left(t):
        return 1.0 - np.tanh(np.maximum(t, 0.0) / _SETTLES)

    return left(seconds)[:, None], (left(seconds + 1.0 / fps) - left(seconds))[:, None], float(left(1.0 / fps))


def blended(window: Windows, offset: np.ndarray, fps: float) -> Windows:
    """The window with its trajectories led through where the effectors are, offset (4, 3) m from where they are wanted,
    and back to the wanted ones by tanh (§7.7.3)."""
    left, change, following = _fading(fps)
    return window._replace(
        points=window.points + offset[:, None, :] * left,
        deltas=window.deltas + offset[:, None, :] * change,
        next=window.next + offset * following,
    )
