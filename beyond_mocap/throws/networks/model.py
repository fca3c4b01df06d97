"""Contents of one file of weights: settings, skeleton, networks, and the examples that start poses are taken from.

Source: Fredriksson section 7.7.1.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from ...base.errors import InputError
from ...motion.skeleton import Skeleton, freeze_array
from .chains import HIERARCHY
from .network import PhaseNetwork

if TYPE_CHECKING:
    from .example import Example

SINGLE = "single"
"""The one network of the monolithic model (section 7.2)."""
_CHOICES = {
    "kind": ("hierarchy", "single"), "wrist": ("given", "inferred"), "frame": ("hip", "static"),
    "phase": ("distance", "warped"), "action": ("throw", "kick"), "shoulder": ("body", "arm"),
}  # fmt: skip
_RANGES = {"points": (1, 16), "layers": (1, 16), "units": (1, 4096)}
MIN_FPS, MAX_FPS = 10.0, 500.0
"""Range of frame rates, frames per second, at which a model may be trained."""


@dataclass(frozen=True, kw_only=True)
class ModelSettings:
    """Settings of a model.

    Attributes:
        kind: hierarchy (six networks) or single (one network).
        points: control points of the phase function; 1 is a plain feed-forward network.
        layers: hidden layers of each network.
        units: units of each hidden layer.
        wrist: given (the description contains the hands' rotations) or inferred (the networks predict them).
        frame: origin of the positions: hip (below the hips in each frame) or static (where the example begins, the
            capture frame of section 7.3).
        phase: distance (by travelled distance, section 7.4.1) or warped (by time warping, section 9.3).
        ik_layer: limbs were trained with inverse kinematics inside the loss.
        conditioned: child networks were trained on the output of their parents (section 9.4).
        guided: limb networks also receive the inverse-kinematics solution (`features.compute_reach_guide`).
        carried: the hip network also receives the hips as hands and feet carry them (`features.carry_hips`).
        shoulder: body, or arm (an arm's network also moves its shoulder, section 9.3).
        fps: frames per second.
        action: throw or kick.
    """

    kind: str = "hierarchy"
    points: int = 4
    layers: int = 3
    units: int = 128
    wrist: str = "given"
    frame: str = "hip"
    phase: str = "distance"
    ik_layer: bool = False
    conditioned: bool = False
    guided: bool = False
    carried: bool = False
    shoulder: str = "body"
    fps: float = 30.0
    action: str = "throw"

    def __post_init__(self):
        for name, choices in _CHOICES.items():
            if getattr(self, name) not in choices:
                raise InputError(f"model settings: {name}", str(getattr(self, name))[:40], " or ".join(choices))
        for name, (least, most) in _RANGES.items():
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
                raise InputError(f"model settings: {name}", str(value)[:40], f"a whole number of {least} to {most}")
        for name in ("ik_layer", "conditioned", "guided", "carried"):
            if not isinstance(getattr(self, name), bool):
                raise InputError(f"model settings: {name}", str(getattr(self, name))[:40], "true or false")
        if isinstance(self.fps, bool) or not isinstance(self.fps, (int, float)) or not MIN_FPS <= self.fps <= MAX_FPS:
            raise InputError("model settings: fps", str(self.fps)[:40], f"{MIN_FPS:g} to {MAX_FPS:g} frames per second")

    @property
    def networks(self) -> tuple[str, ...]:
        """Names of the networks, in order of evaluation."""
        return HIERARCHY if self.kind == "hierarchy" else (SINGLE,)


@dataclass(frozen=True, eq=False, kw_only=True)
class ThrowModel:
    """A trained model of throws or kicks.

    Attributes:
        settings: settings of the model.
        skeleton: skeleton of all its motions.
        networks: networks by name, `settings.networks`.
        leg_reach: {"left": (shortest, longest), "right": ...}, metres from the top of the leg to the toe in the
            training data (eq. 7.3).
        examples: recorded movements in the normalised frame, at the model's rate, on its skeleton.
        stature: metres.
        joint_limits: (J, 3, 3) rad, from `limits.estimate_joint_limits` of the training data, or None.
        reference: (N,) speed of the limb over evenly spaced phases, to which warped phases are warped, or None.
        trained_on: one line about the training data.
        notes: one line each.
    """

    settings: ModelSettings
    skeleton: Skeleton
    networks: Mapping[str, PhaseNetwork]
    leg_reach: Mapping[str, tuple[float, float]]
    examples: tuple["Example", ...] = ()
    stature: float = 1.8
    joint_limits: np.ndarray | None = None
    reference: np.ndarray | None = None
    trained_on: str = ""
    notes: tuple[str, ...] = field(default=())

    def __post_init__(self):
        object.__setattr__(self, "networks", MappingProxyType(dict(self.networks)))
        reach = {side: (float(low), float(high)) for side, (low, high) in self.leg_reach.items()}
        object.__setattr__(self, "leg_reach", MappingProxyType(reach))
        object.__setattr__(self, "examples", tuple(self.examples))
        object.__setattr__(self, "notes", tuple(str(note) for note in self.notes))
        for name in ("joint_limits", "reference"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, freeze_array(getattr(self, name)))
        _check_networks(self)
        _check_body(self)


def _check_networks(model: ThrowModel) -> None:
    """Raise InputError if the networks' names, control points or hidden layers differ from the settings."""
    settings = model.settings
    if set(model.networks) != set(settings.networks):
        raise InputError("model: networks", ", ".join(model.networks) or "none", ", ".join(settings.networks))
    for name, network in model.networks.items():
        hidden = [weight.shape[1] for weight in network.weights[:-1]]
        if network.points != settings.points or hidden != [settings.units] * settings.layers:
            raise InputError(f"model: network {name}", f"{network.points} control points, hidden layers {hidden}",
                             f"{settings.points} and {settings.layers} layers of {settings.units}")  # fmt: skip


def _check_body(model: ThrowModel) -> None:
    """Raise InputError if leg reach, stature, joint limits, reference curve or examples do not fit the model."""
    joints = len(model.skeleton)
    reach = model.leg_reach
    if set(reach) != {"left", "right"} or not all(0 <= low < high < 10.0 for low, high in reach.values()):
        raise InputError("model: leg_reach", str(dict(reach))[:80], "(shortest, longest) in metres, for left and right")
    if not 0.1 <= model.stature <= 10.0:
        raise InputError("model: stature", f"{model.stature:g} m", "0.1 to 10 m")
    limits = model.joint_limits
    if limits is not None and (limits.shape != (joints, 3, 3) or not np.all(limits[:, 1] <= limits[:, 2])):
        raise InputError("model: joint_limits", f"shape {limits.shape}", f"({joints}, 3, 3): middle, lowest, highest")
    reference = model.reference
    if model.settings.phase == "warped" and reference is None:
        raise InputError("model: reference", "none", "a speed curve, because the phases are warped")
    if reference is not None and (reference.ndim != 1 or len(reference) < 2 or not np.all(np.isfinite(reference))):
        raise InputError("model: reference", f"shape {reference.shape}", "(N,) finite speeds")
    for example in model.examples:
        where = f"model: example {example.name}"
        if not example.motion.skeleton.has_same_bones(model.skeleton):
            raise InputError(where, "a different skeleton", "the model's skeleton")
        if abs(example.motion.fps - model.settings.fps) > 1e-9:
            raise InputError(where, f"{example.motion.fps:g} frames per second", f"{model.settings.fps:g}, the model's")
