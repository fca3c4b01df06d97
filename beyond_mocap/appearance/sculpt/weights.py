"""Which bones each point of the sculpted body follows: smooth shares that depend on its place alone.

Layers that lie over one another get the same shares, so cloth and what is below it move together.
"""

from __future__ import annotations

import numpy as np

from ...base.easing import smoothstep
from ..landmarks import ANKLE, ELBOW, KNEE, SEGMENTS, SHOULDER, WRIST
from .limbs import ARM_TURN


def compute_shares(points: np.ndarray) -> np.ndarray:
    """Compute the shares (N, S) of SEGMENTS for points (N, 3) m, sum 1."""
    shares = {name: np.zeros(len(points)) for name in SEGMENTS}
    rest = np.ones(len(points))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        mirrored = points * np.array([1.0, sign, 1.0])
        rest = rest - _share_arm(shares, side, mirrored) - _share_leg(shares, side, mirrored)
    rest = np.maximum(rest, 0.0)
    _share_trunk(shares, points, rest)
    table = np.stack([shares[name] for name in SEGMENTS], axis=1)
    return table / table.sum(axis=1, keepdims=True)


def _share_arm(shares, side: str, points: np.ndarray) -> np.ndarray:
    """Share points between the parts of an arm, and return what the arm has (N,)."""
    local = (points - SHOULDER) @ ARM_TURN
    down, aside = -local[:, 2], local[:, 1]
    along = down + 1.35 * np.minimum(aside, 0.0) + 0.3 * np.maximum(aside, 0.0)
    arm = smoothstep(along, -0.045, 0.105) * smoothstep(points[:, 1], 0.09, 0.15)
    lower, hand = smoothstep(down, ELBOW - 0.055, ELBOW + 0.055), smoothstep(down, WRIST - 0.035, WRIST + 0.015)
    shares[f"upper_arm_{side}"] = arm * (1.0 - lower)
    shares[f"lower_arm_{side}"] = arm * lower * (1.0 - hand)
    shares[f"hand_{side}"] = arm * hand
    collar = smoothstep(points[:, 1], 0.035, 0.16) * smoothstep(points[:, 2], 1.28, 1.47)
    shares[f"shoulder_{side}"] = 0.75 * collar * (1.0 - arm)
    return arm + shares[f"shoulder_{side}"]


def _share_leg(shares, side: str, points: np.ndarray) -> np.ndarray:
    """Share points between the parts of a leg, and return what the leg has (N,)."""
    x, y, z = points.T
    crease = 0.865 + 0.85 * np.clip(np.abs(y), 0.0, 0.13) - 0.035 * smoothstep(x, 0.0, -0.10)
    width = 0.004 + 0.116 * smoothstep(z, 0.78, 0.90)  # narrow between the legs; a shirt is one cloth
    own = smoothstep(y, -width, width)
    leg = smoothstep(crease - z, -0.110, 0.130) * own * smoothstep(y, 0.55, 0.35)
    lower = smoothstep(z, KNEE + 0.06, KNEE - 0.06)
    foot = smoothstep(z, ANKLE + 0.055, ANKLE - 0.005)
    toe = smoothstep(x, 0.105, 0.160) * foot
    shares[f"upper_leg_{side}"] = leg * (1.0 - lower)
    shares[f"lower_leg_{side}"] = leg * lower * (1.0 - foot)
    shares[f"foot_{side}"] = leg * lower * (foot - toe)
    shares[f"toe_{side}"] = leg * lower * toe
    return leg


def _share_trunk(shares, points: np.ndarray, rest: np.ndarray) -> None:
    """Share what is left between trunk, neck and head."""
    x, y, z = points.T
    neck = smoothstep(z + 0.3 * x, 1.490, 1.560) * smoothstep(np.abs(y), 0.125, 0.065)
    head = smoothstep(z + 0.8 * np.maximum(x, 0.0), 1.570, 1.630)
    shares["trunk"] = rest * (1.0 - neck)
    shares["neck"] = rest * neck * (1.0 - head)
    shares["head"] = rest * neck * head
