"""All that one file of weights holds: what was trained, on which skeleton, the networks, and the examples that a start
pose is taken from (Fredriksson §7.7.1)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from ...base.errors import InputError
from ...motion.skeleton import Skeleton, frozen_array
from .chains import HIERARCHY
from .network import PhaseNetwork

if TYPE_CHECKING:
    from .example import Example

SINGLE = "single"
"""The one network of the monolithic model (§7.2)."""
_CHOICES = {
    "kind": ("hierarchy", "single"), "wrist": ("given", "inferred"), "frame": ("hip", "static"),
    "phase": ("distance", "warped"), "action": ("throw", "kick"),
}  # fmt: skip
_RANGES = {"points": (1, 16), "layers": (1, 16), "units": (1, 4096)}
SLOWEST, FASTEST = 10.0, 500.0
"""Frames per second between which a model may be trained."""


@dataclass(frozen=True, kw_only=True)
class ModelSettings:
    """What kind of model it is.

    kind: hierarchy (six networks) or single (one). points: control points of the phase function; 1 is feed-forward.
    layers, units: hidden layers of each network, and units in each. wrist: whether the hands' rotations are given in
    the description or inferred. frame: positions from where the hips stand on the ground in each frame (hip), or from
    where the example begins (static, §7.3's capture frame). phase: by travelled distance (§7.4.1) or warped in time
    (§9.3). ik_layer: limbs were trained with their inverse kinematics inside the loss. conditioned: children were
    trained on what their parents predict (§9.4). guided: the networks of limbs are told how inverse kinematics would
    reach (`features.reached`). carried: the network of the hips is told where hands and feet would carry them
    (`features.carry_hips`). fps: frames per second. action: throw or kick."""

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
        if isinstance(self.fps, bool) or not isinstance(self.fps, (int, float)) or not SLOWEST <= self.fps <= FASTEST:
            raise InputError("model settings: fps", str(self.fps)[:40], f"{SLOWEST:g} to {FASTEST:g} frames per second")

    @property
    def networks(self) -> tuple[str, ...]:
        """Names of its networks, in the order in which they are evaluated."""
        return HIERARCHY if self.kind == "hierarchy" else (SINGLE,)


@dataclass(frozen=True, eq=False, kw_only=True)
class ThrowModel:
    """A trained model of throws or kicks.

    networks: by name, `settings.networks`. leg_reach: {"left": (shortest, longest), "right": ...}, metres from the top
    of the leg to the toe in the training data (eq. 7.3). examples: recorded movements in the normalised frame, at the
    model's rate, on its skeleton. stature: metres. joint_limits: (J, 3, 3) radians, as of `limits.learn` of the
    training data, or None. reference: (N,) the limb's speed over evenly spaced phases, which `warped` phases
    are warped to, or None. trained_on: one line. notes: one line each."""

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
                object.__setattr__(self, name, frozen_array(getattr(self, name)))
        _check_networks(self)
        _check_body(self)


def _check_networks(model: ThrowModel) -> None:
    settings = model.settings
    if set(model.networks) != set(settings.networks):
        raise InputError("model: networks", ", ".join(model.networks) or "none", ", ".join(settings.networks))
    for name, network in model.networks.items():
        hidden = [weight.shape[1] for weight in network.weights[:-1]]
        if network.points != settings.points or hidden != [settings.units] * settings.layers:
            raise InputError(f"model: network {name}", f"{network.points} control points, hidden layers {hidden}",
                             f"{settings.points} and {settings.layers} layers of {settings.units}")  # fmt: skip


def _check_body(model: ThrowModel) -> None:
    joints = len(model.skeleton)
    reach = model.leg_reach
    if set(reach) != {"left", "right"} or not all(0 <= low < high < 10.0 for low, high in reach.values()):
        raise InputError("model: leg_reach", str(dict(reach))[:80], "(shortest, longest) metres of left and right")
    if not 0.1 <= model.stature <= 10.0:
        raise InputError("model: stature", f"{model.stature:g} m", "0.1 to 10 m")
    limits = model.joint_limits
    if limits is not None and (limits.shape != (joints, 3, 3) or not np.all(limits[:, 1] <= limits[:, 2])):
        raise InputError("model: joint_limits", f"shape {limits.shape}", f"({joints}, 3, 3): middle, lowest, highest")
    reference = model.reference
    if model.settings.phase == "warped" and reference is None:
        raise InputError("model: reference", "none", "a speed curve, because its phases are warped")
    if reference is not None and (reference.ndim != 1 or len(reference) < 2 or not np.all(np.isfinite(reference))):
        raise InputError("model: reference", f"shape {reference.shape}", "(N,) finite speeds")
    for example in model.examples:
        where = f"model: example {example.name}"
        if not example.motion.skeleton.same_bones(model.skeleton):
            raise InputError(where, "another skeleton", "the model's skeleton")
        if abs(example.motion.fps - model.settings.fps) > 1e-9:
            raise InputError(where, f"{example.motion.fps:g} frames per second", f"{model.settings.fps:g}, the model's")
