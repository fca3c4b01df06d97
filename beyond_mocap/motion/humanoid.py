"""Which joint is what (hips, legs, arms, head) in any humanoid skeleton: by name, or by structure where names say
nothing.

Covers the names of CMU (.bvh and .asf), LAFAN1, Mixamo, Bandai-Namco, Rigify, Unreal, MVN (Xsens), MakeHuman, VRM, 3ds
Max Biped, Daz, Character Creator and SMPL. Every measure of feet, heading or sides uses this module, so a new family of
names is one line in a table. What no name shows is found in the tree of joints (`structure`).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..base.errors import InputError
from ..base.vectors import arctan2
from . import quaternion
from .motion import Motion, compute_pose, forward_kinematics
from .retargeting import structure
from .skeleton import Skeleton

# canonical limb part -> names without side, blanks and prefix, in order of preference
_LIMB_NAMES = {
    "shoulder": ("clavicle", "collar", "shoulder"),
    "upper_arm": ("upperarm", "arm", "uparm", "upperarm01", "shldr", "shldrbend", "humerus"),
    "lower_arm": ("forearm", "lowerarm", "lowarm", "elbow", "lowerarm01", "forearmbend", "radius"),
    "hand": ("wrist", "hand"),
    "upper_leg": ("upleg", "upperleg", "thigh", "hip", "upperleg01", "thighbend", "femur"),
    "lower_leg": ("leg", "lowerleg", "lowleg", "shin", "calf", "knee", "lowerleg01", "tibia"),
    "foot": ("ankle", "foot"),
    "toe": ("toebase", "toe", "toes", "ball", "toe0", "toe11"),
}
_CENTRE_NAMES = {
    "hips": ("hips", "pelvis", "hip"),
    "neck": ("neck", "neck1", "neck01", "necklower", "necktwist01", "lowerneck"),
    "head": ("head",),
}
_MIN_LEG = 1e-3  # m of thigh and shank
_PREFIX = re.compile(r"^(mixamorig\d*|valvebiped|j_bip|cc_base|bip\d+|joint|def|org|b)[_\-. ]+(c_)?", re.I)
_PARTS = {name for names in _LIMB_NAMES.values() for name in names}


@dataclass(frozen=True)
class Limb:
    """Joint indices of one side.

    Attributes:
        shoulder, upper_arm, lower_arm, hand: the arm; None on bodies without it, the shoulder also on bodies with arms.
        upper_leg, lower_leg, foot: the leg, always there.
        toe: None where the skeleton has no toe joint.
    """

    shoulder: int | None
    upper_arm: int | None
    lower_arm: int | None
    hand: int | None
    upper_leg: int
    lower_leg: int
    foot: int
    toe: int | None

    @property
    def leg(self) -> tuple[int, int, int]:
        """Hip, knee and ankle."""
        return self.upper_leg, self.lower_leg, self.foot

    @property
    def toe_or_foot(self) -> int:
        """The foremost joint of the foot."""
        return self.foot if self.toe is None else self.toe


@dataclass(frozen=True, kw_only=True)
class Humanoid:
    """Joint indices by meaning.

    Attributes:
        hips: the joint that carries legs and trunk.
        spine: the joints between hips and neck, from below.
        neck, head: None where the skeleton has none.
        left, right: the limbs of each side.
        mirror: for each joint the one on the other side, itself where there is none.
    """

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

    @property
    def neck_or_chest(self) -> int:
        """The top of the trunk: the neck, or the chest where there is none."""
        return self.chest if self.neck is None else self.neck

    @property
    def head_or_neck(self) -> int:
        """The joint that rotates the head: the head, or the neck or chest where there is none."""
        return self.neck_or_chest if self.head is None else self.head


def split_joint_name(name: str) -> tuple[str, str]:
    """Split a joint's name into its side ("left", "right", "") and the rest without prefix, blanks and case."""
    plain = re.sub(r"^.*[:|]", "", name)
    while _PREFIX.search(plain):
        plain = _PREFIX.sub("", plain)
    for side in ("left", "right"):
        initial = f"[{side[0]}{side[0].upper()}]"
        whole = f"(?i:^{side}|{side}$)"
        match = re.search(rf"{whole}|^{initial}(?=[A-Z_\-. ])|[_\-. ]{initial}$", plain)
        if match:
            plain = plain[: match.start()] + plain[match.end() :]
            return side, re.sub(r"[_\-. ]", "", plain).lower()
        if plain[:1] == side[0] and plain[1:].lower() in _PARTS:
            return side, plain[1:].lower()
    return "", re.sub(r"[_\-. ]", "", plain).lower()


def identify_joints(skeleton: Skeleton) -> Humanoid:
    """Identify the meaning of a skeleton's joints, by names, else by the structure of its rest pose.

    Args:
        skeleton: J joints.
    Returns:
        The joints by meaning.
    Raises:
        InputError: if no legs can be found.
    """
    tips = (skeleton.end_parents, skeleton.end_offsets.tobytes())
    return _identify_from_arrays(skeleton.names, skeleton.parents, skeleton.offsets.tobytes(), tips)


def pose_legs(skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute the pose of both legs, and of what carries them, down to the toes; other joints would cost as much again.

    Args:
        skeleton: J joints.
        root: (T, 3) m, world.
        rotations: (T, J, 4) local rotations.
    Returns:
        Positions (T, J, 3) m and rotations (T, J, 4), world; NaN for other joints.
    Raises:
        InputError: if the skeleton has no legs.
    """
    body = identify_joints(skeleton)
    ends = (joint for limb in (body.left, body.right)
            for joint in (limb.upper_leg, limb.lower_leg, limb.foot, limb.toe_or_foot))
    legs = {joint for end in ends for joint in structure.list_ancestors(skeleton.parents, end)}
    return compute_pose(skeleton, root, rotations, legs)


def identify_posed_joints(motion: Motion) -> Humanoid:
    """Identify joints as `identify_joints` does, but tell left from right by recorded poses where names say nothing.

    A rest pose may be folded up; recorded feet point forward and knees bend backward.

    Args:
        motion: T frames on the skeleton.
    Returns:
        The joints by meaning.
    Raises:
        InputError: if no legs can be found.
    """
    skeleton = motion.skeleton
    parts = [split_joint_name(name) for name in skeleton.names]
    roles = _find_named_roles(parts)
    if not _has_legs(skeleton.parents, roles):
        frames = np.unique(np.linspace(0, len(motion) - 1, 64).astype(int))
        roles = _choose_roles(_find_structural_roles(skeleton, motion.root_positions[frames], motion.rotations[frames]),
                              roles)
    body = build_humanoid(skeleton.names, skeleton.parents, roles)
    _check_legs(skeleton.names, skeleton.offsets, body)
    return body


@lru_cache(maxsize=256)
def _identify_from_arrays(names: tuple[str, ...], parents: tuple[int, ...], offsets: bytes, tips: tuple) -> Humanoid:
    """Identify joints from hashable parts of a skeleton, so that results can be cached."""
    roles = _find_named_roles([split_joint_name(name) for name in names])
    if not _has_legs(parents, roles):
        ends = np.frombuffer(tips[1]).reshape(-1, 3)
        skeleton = Skeleton(names, parents, np.frombuffer(offsets).reshape(-1, 3), tips[0], ends)
        roles = _choose_roles(_find_structural_roles(skeleton, np.zeros((1, 3)), quaternion.identity(1, len(names))),
                              roles)
    body = build_humanoid(names, parents, roles)
    _check_legs(names, np.frombuffer(offsets).reshape(-1, 3), body)
    return body


def _check_legs(names: tuple[str, ...], offsets: np.ndarray, body: Humanoid) -> None:
    """Check that legs have a length, by which motions are scaled; offsets (J, 3) m; InputError otherwise."""
    for limb in (body.left, body.right):
        if not np.linalg.norm(offsets[[limb.lower_leg, limb.foot]], axis=1).sum() >= _MIN_LEG:
            raise InputError("skeleton", f"no length from {names[limb.upper_leg]} to {names[limb.foot]}",
                             "legs with a length", "correct their OFFSETs, or the unit")  # fmt: skip


def _find_structural_roles(skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray) -> dict[str, int] | None:
    """Find roles by structure from poses: root (T, 3) metres, local rotations (T, J, 4)."""
    places, world = compute_pose(skeleton, root, rotations)
    tips = places.copy()
    for joint, offset in zip(skeleton.end_parents, skeleton.end_offsets):
        tips[:, joint] = places[:, joint] + quaternion.rotate(world[:, joint], offset)
    return structure.find_roles(skeleton.parents, places, tips)


def _choose_roles(found: dict[str, int] | None, named: dict[str, int]) -> dict[str, int]:
    """Choose the roles found by structure, or the named ones if structure finds none or takes a named arm for a leg."""
    arms = {joint for role, joint in named.items() if role.endswith(("arm", "hand"))}
    return named if not found or arms & {found[role] for role in _LEG_ROLES} else found


def build_humanoid(names: tuple[str, ...], parents: tuple[int, ...], roles: Mapping[str, int]) -> Humanoid:
    """Build a humanoid from known roles.

    Hips, spine, neck and head that are not named are found from where legs and arms hang.

    Args:
        names: J joint names.
        parents: J indices, -1 for the root.
        roles: "hips", "neck", "head", "left upper_leg" and the like -> joint.
    Returns:
        The joints by meaning.
    Raises:
        InputError: if a leg's joint is missing, or a joint of a limb does not hang below the one before.
    """
    roles = dict(roles)
    if missing := [part for part in _LEG_ROLES if part not in roles]:
        raise InputError(
            "skeleton", f"no joint found for {', '.join(missing)}",
            "legs named as in common rigs, or two legs alike below the hips", "give a bone map",
        )
    for high, low in _find_broken_chains(parents, roles, _CHAINS):
        found = f"{names[roles[low]]} ({low}) does not hang below {names[roles[high]]} ({high})"
        raise InputError("skeleton", found, "limbs that are chains", "correct the names or the bone map")
    legs = [roles["left upper_leg"], roles["right upper_leg"]]
    arms = [roles[part] for part in ("left upper_arm", "right upper_arm") if part in roles]
    crossing = structure.find_common_ancestor(parents, legs)
    if "hips" not in roles or not set(legs) <= set(structure.list_descendants(parents, roles["hips"])):
        roles["hips"] = crossing
    if arms and roles["hips"] not in structure.list_ancestors(parents, arms[0]):
        roles["hips"] = structure.find_common_ancestor(parents, [*legs, *arms])
    chest = structure.find_common_ancestor(parents, arms) if len(arms) == 2 else None
    if chest is not None:
        roles.update({**structure.find_neck_and_head(parents, chest, set(roles.values()), roles), **roles})
    top = roles.get("neck", roles.get("head"))
    spine = structure.list_between(parents, roles["hips"], top) if top is not None else []
    if not spine and chest is not None and chest != roles["hips"]:
        spine = [*structure.list_between(parents, roles["hips"], chest), chest]
    limbs = {side: Limb(**{part: roles.get(f"{side} {part}") for part in _LIMB_NAMES}) for side in ("left", "right")}
    mirror = _find_mirror_joints([split_joint_name(name) for name in names], parents, roles)
    neck, head = roles.get("neck"), roles.get("head")
    return Humanoid(hips=roles["hips"], spine=tuple(spine), neck=neck, head=head, left=limbs["left"],
                    right=limbs["right"], mirror=mirror)


def list_roles(body: Humanoid) -> dict[str, int]:
    """List every role that the body has with its joint, without the spine: the inverse of `build_humanoid`."""
    found = {"hips": body.hips, "neck": body.neck, "head": body.head}
    for side, limb in (("left", body.left), ("right", body.right)):
        found.update({f"{side} {part}": getattr(limb, part) for part in _LIMB_NAMES})
    return {role: joint for role, joint in found.items() if joint is not None}


_SIDES = ("left", "right")
_LEG_CHAINS = tuple((f"{side} {high}", f"{side} {low}") for side in _SIDES
                    for high, low in (("upper_leg", "lower_leg"), ("lower_leg", "foot")))
_CHAINS = (*_LEG_CHAINS, *((f"{side} {high}", f"{side} {low}") for side in _SIDES
                           for high, low in (("foot", "toe"), ("upper_arm", "lower_arm"), ("lower_arm", "hand"))))
_LEG_ROLES = tuple(f"{side} {part}" for side in _SIDES for part in ("upper_leg", "lower_leg", "foot"))


def _has_legs(parents: tuple[int, ...], roles: Mapping[str, int]) -> bool:
    """Say whether both legs are there, each joint below the one before."""
    return all(role in roles for role in _LEG_ROLES) and not _find_broken_chains(parents, roles, _LEG_CHAINS)


def _find_broken_chains(parents: tuple[int, ...], roles: Mapping[str, int], chains) -> list[tuple[str, str]]:
    """Find the pairs of roles whose second joint does not hang below the first, among the roles that there are."""
    pairs = [(high, low) for high, low in chains if high in roles and low in roles]
    return [(high, low) for high, low in pairs
            if roles[high] == roles[low] or roles[high] not in structure.list_ancestors(parents, roles[low])]


def _find_named_roles(parts) -> dict[str, int]:
    """Find the roles that names show."""
    roles: dict[str, int | None] = {centre: _find_centre_joint(parts, centre) for centre in _CENTRE_NAMES}
    for side in ("left", "right"):
        roles.update({f"{side} {part}": joint for part, joint in _find_limb(parts, side).items()})
    return {role: joint for role, joint in roles.items() if joint is not None}


def _find_limb(parts, side: str) -> dict[str, int | None]:
    """Find the joints of one side's limb parts by name; None for a part without a name."""
    places = {rest: i for i, (s, rest) in reversed(list(enumerate(parts))) if s == side}
    found = {part: next((places[o] for o in names if o in places), None) for part, names in _LIMB_NAMES.items()}
    if found["upper_arm"] is None and "shoulder" in places:  # collar, shoulder, elbow, wrist: the joints' own names
        found["upper_arm"] = places["shoulder"]
        found["shoulder"] = next((places[o] for o in ("clavicle", "collar") if o in places), None)
    if found["toe"] is None and "ankle" in places and "foot" in places:
        found["toe"] = places["foot"]
    return found


def _find_centre_joint(parts, part: str) -> int | None:
    places = {rest: i for i, (s, rest) in reversed(list(enumerate(parts))) if not s}
    return next((places[o] for o in _CENTRE_NAMES[part] if o in places), None)


def _find_mirror_joints(parts, parents, roles: Mapping[str, int]) -> tuple[int, ...]:
    """Find for each joint the one on the other side (itself where there is none)."""
    other = {"left": "right", "right": "left", "": ""}
    places = {part: i for i, part in reversed(list(enumerate(parts)))}
    if any(side for side, _ in parts):
        return tuple(places.get((other[side], rest), i) if side else i for i, (side, rest) in enumerate(parts))
    pairs = [(roles[role], roles.get("right" + role[4:])) for role in roles if role.startswith("left ")]
    return structure.find_mirror_joints(parents, [(a, b) for a, b in pairs if b is not None])


def compute_heading_from_positions(skeleton: Skeleton, positions: np.ndarray) -> np.ndarray:
    """Compute the heading of a body about Z.

    The axis across the body is the sum of the vectors from right to left upper legs and from right to left upper arms,
    so that neither a twisted pelvis nor twisted shoulders alone decide; the heading is across x up.

    Args:
        skeleton: J joints.
        positions: (..., J, 3) world positions, metres.
    Returns:
        (...,) radians, 0 along +X.
    Raises:
        InputError: if the skeleton has no legs.
    """
    body = identify_joints(skeleton)
    across = positions[..., body.left.upper_leg, :] - positions[..., body.right.upper_leg, :]
    if body.left.upper_arm is not None and body.right.upper_arm is not None:
        across = across + positions[..., body.left.upper_arm, :] - positions[..., body.right.upper_arm, :]
    return arctan2(-across[..., 0], across[..., 1])


def compute_heading(motion: Motion) -> np.ndarray:
    """Compute the heading about Z of every frame: (T,) radians, unwrapped."""
    positions, _ = forward_kinematics(motion)
    return np.unwrap(compute_heading_from_positions(motion.skeleton, positions))


LEG_SHARE = 0.485
"""Length of upper plus lower leg as a share of the stature (`adult`, after Drillis and Contini 1966)."""


def estimate_stature(skeleton: Skeleton) -> float:
    """Estimate the stature in metres of a body with these legs; recordings seldom have a joint at the top of the head.
    """
    return measure_leg_length(skeleton) / LEG_SHARE


def measure_leg_length(skeleton: Skeleton) -> float:
    """Measure the mean length in metres of upper plus lower legs."""
    body = identify_joints(skeleton)
    lengths = [
        np.linalg.norm(skeleton.offsets[limb.lower_leg]) + np.linalg.norm(skeleton.offsets[limb.foot])
        for limb in (body.left, body.right)
    ]
    return float(np.mean(lengths))
