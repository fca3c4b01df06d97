"""Which joint is what: hips, legs, arms, head, of any humanoid skeleton, by the names of the common families.

Covers CMU, LAFAN1, Mixamo, Bandai-Namco, Rigify, Unreal, MVN (Xsens) and MakeHuman style names. Every measure that speaks
of feet, heading or sides asks here, so a new family of names is one line in a table.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..errors import InputError
from . import quaternion
from .motion import Motion, forward_kinematics
from .skeleton import Skeleton

# canonical limb part -> names without side, blanks and prefix, in order of preference
_LIMB_NAMES = {
    "shoulder": ("shoulder", "clavicle", "collar"),
    "upper_arm": ("upperarm", "arm", "uparm"),
    "lower_arm": ("forearm", "lowerarm", "lowarm", "elbow"),
    "hand": ("hand", "wrist"),
    "upper_leg": ("upleg", "upperleg", "thigh", "hip"),
    "lower_leg": ("leg", "lowerleg", "lowleg", "shin", "calf", "knee"),
    "foot": ("foot", "ankle"),
    "toe": ("toebase", "toe", "toes", "ball"),
}
_CENTRE_NAMES = {
    "hips": ("hips", "pelvis", "hip"),
    "neck": ("neck", "neck1", "neck01"),
    "head": ("head",),
}


@dataclass(frozen=True)
class Limb:
    """Joint indices of one side. `shoulder` and `toe` may be missing (None); the others too on bodies without arms."""

    shoulder: int | None
    upper_arm: int | None
    lower_arm: int | None
    hand: int | None
    upper_leg: int
    lower_leg: int
    foot: int
    toe: int | None

    @property
    def toe_or_foot(self) -> int:
        """The foremost joint of the foot."""
        return self.foot if self.toe is None else self.toe


@dataclass(frozen=True)
class Humanoid:
    """Joint indices by meaning. `spine`: the joints between hips and neck, from below."""

    hips: int
    spine: tuple[int, ...]
    neck: int | None
    head: int | None
    left: Limb
    right: Limb
    mirror: tuple[int, ...]

    @property
    def chest(self) -> int:
        """The uppermost joint of the spine, or the hips where there is none."""
        return self.spine[-1] if self.spine else self.hips


def side_and_part(name: str) -> tuple[str, str]:
    """Side ("left", "right", "") and the rest of a joint's name, prefix, blanks and case removed."""
    plain = re.sub(r"^.*[:|]", "", name)
    plain = re.sub(r"^(mixamorig\d*|bip\d+|joint|def|org|b)[_\-. ]+", "", plain, flags=re.I)
    for side in ("left", "right"):
        initial = f"[{side[0]}{side[0].upper()}]"
        whole = f"(?i:^{side}|{side}$)"
        match = re.search(rf"{whole}|^{initial}(?=[A-Z_\-. ])|[_\-. ]{initial}$", plain)
        if match:
            plain = plain[: match.start()] + plain[match.end() :]
            return side, re.sub(r"[_\-. ]", "", plain).lower()
    return "", re.sub(r"[_\-. ]", "", plain).lower()


@lru_cache(maxsize=256)
def _identify(names: tuple[str, ...], parents: tuple[int, ...]) -> Humanoid:
    parts = [side_and_part(name) for name in names]
    limbs = {side: _limb(parts, parents, side) for side in ("left", "right")}
    missing = [f"{s} {p}" for s in limbs for p in ("upper_leg", "lower_leg", "foot") if limbs[s][p] is None]
    if missing:
        raise InputError("skeleton", f"no joint found for {', '.join(missing)}", "legs named as in common rigs")
    hips = _centre(parts, "hips")
    if hips is None:
        hips = _common_ancestor(parents, limbs["left"]["upper_leg"], limbs["right"]["upper_leg"])
    neck, head = _centre(parts, "neck"), _centre(parts, "head")
    top = neck if neck is not None else head
    spine = tuple(_chain(parents, hips, top)) if top is not None else ()
    return Humanoid(hips, spine, neck, head, Limb(**limbs["left"]), Limb(**limbs["right"]), _mirror(parts))


def identify(skeleton: Skeleton) -> Humanoid:
    """The meaning of a skeleton's joints; InputError where hips or legs cannot be found."""
    return _identify(skeleton.names, skeleton.parents)


def _limb(parts, parents, side: str) -> dict[str, int | None]:
    found: dict[str, int | None] = {}
    for part, options in _LIMB_NAMES.items():
        places = {rest: i for i, (s, rest) in reversed(list(enumerate(parts))) if s == side}
        found[part] = next((places[o] for o in options if o in places), None)
    if found["upper_leg"] is not None and found["upper_leg"] == found["lower_leg"]:
        found["lower_leg"] = next((i for i, p in enumerate(parents) if p == found["upper_leg"]), None)
    return found


def _centre(parts, part: str) -> int | None:
    places = {rest: i for i, (s, rest) in reversed(list(enumerate(parts))) if not s}
    return next((places[o] for o in _CENTRE_NAMES[part] if o in places), None)


def _common_ancestor(parents, a: int, b: int) -> int:
    above = set()
    while a >= 0:
        above.add(a)
        a = parents[a]
    while b not in above:
        b = parents[b]
    return b


def _chain(parents, low: int, high: int) -> list[int]:
    """Joints strictly between `low` and `high`, from below; empty where `high` does not hang on `low`."""
    chain, joint = [], parents[high]
    while joint >= 0 and joint != low:
        chain.append(joint)
        joint = parents[joint]
    return chain[::-1] if joint == low else []


def _mirror(parts) -> tuple[int, ...]:
    """For each joint the one on the other side (itself where there is none)."""
    other = {"left": "right", "right": "left", "": ""}
    places = {part: i for i, part in reversed(list(enumerate(parts)))}
    return tuple(places.get((other[side], rest), i) if side else i for i, (side, rest) in enumerate(parts))


def heading_from_positions(skeleton: Skeleton, positions: np.ndarray) -> np.ndarray:
    """Facing about Z, radians, 0 along +X: (..., J, 3) world positions -> (...,).

    Across = from right to left upper legs plus from right to left upper arms, so that neither a twisted pelvis nor twisted
    shoulders alone decide; facing is across x up.
    """
    body = identify(skeleton)
    across = positions[..., body.left.upper_leg, :] - positions[..., body.right.upper_leg, :]
    if body.left.upper_arm is not None and body.right.upper_arm is not None:
        across = across + positions[..., body.left.upper_arm, :] - positions[..., body.right.upper_arm, :]
    return np.arctan2(-across[..., 0], across[..., 1])


def heading(motion: Motion) -> np.ndarray:
    """Facing about Z per frame, radians, unwrapped: (T,)."""
    positions, _ = forward_kinematics(motion)
    return np.unwrap(heading_from_positions(motion.skeleton, positions))


def leg_length(skeleton: Skeleton) -> float:
    """Mean length in metres of upper plus lower legs."""
    body = identify(skeleton)
    lengths = [
        np.linalg.norm(skeleton.offsets[limb.lower_leg]) + np.linalg.norm(skeleton.offsets[limb.foot])
        for limb in (body.left, body.right)
    ]
    return float(np.mean(lengths))


def rest_aligned(motion: Motion) -> np.ndarray:
    """Local rotations (T, J, 4) of `motion` with the root's heading taken out, so that it faces +X in every frame."""
    turn = quaternion.about_up(-heading(motion))
    rotations = motion.rotations.copy()
    rotations[:, 0] = quaternion.multiply(turn, rotations[:, 0])
    return rotations
