"""Joints that the networks of the hierarchy move: hip, body, two arms, two legs, of any humanoid (Fredriksson 7.3).

The thesis has 25 joints: the hips, ten of the body (spine, thorax, neck, head, both scapulae), three of each arm and
four of each leg. Here the body chain contains all joints between the hips, the head and both upper arms, an arm runs
from the upper arm to the hand and a leg from the upper leg to the toe, including joints between them. All other
joints (fingers, twist bones, props, joints between the hips and an upper leg) keep their local rotation. With
`shoulder` "arm" an arm begins with the shoulder (clavicle or scapula), as section 9.3 suggests: the range of the
arm depends on it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from ...base.errors import InputError
from ...motion.humanoid import Limb, identify_joints
from ...motion.retargeting import structure
from ...motion.skeleton import Skeleton

HIERARCHY = ("hip", "body", "left_arm", "right_arm", "left_leg", "right_leg")
"""The networks in the order of evaluation: each receives the output of those before it."""
EFFECTORS = ("left_hand", "right_hand", "left_foot", "right_foot")
LIMB_OF = ("left_arm", "right_arm", "left_leg", "right_leg")
"""The chain of each effector."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Chains:
    """Joint indices of a skeleton by chain.

    Attributes:
        skeleton: the skeleton.
        hips: the hip joint.
        above: joints above the hips, which do not rotate.
        members: chain name -> its joints, parents first; arms end with the hand, legs with the toe.
        references: chain -> the joint that it hangs on (-1 for the hip).
        known: chain -> all joints whose position is known once this chain is.
        effectors: joints of both hands and both toes.
        sockets: both upper arms and both upper legs.
        middles: elbows and knees.
        ankles: both feet.
        chest: chest joint, or the next joint below.
        neck: neck joint, or the next joint below.
        head: head joint, or the next joint below.
    """

    skeleton: Skeleton
    hips: int
    above: tuple[int, ...]
    members: dict[str, tuple[int, ...]]
    references: dict[str, int]
    known: dict[str, tuple[int, ...]]
    effectors: tuple[int, int, int, int]
    sockets: tuple[int, int, int, int]
    middles: tuple[int, int, int, int]
    ankles: tuple[int, int]
    chest: int
    neck: int
    head: int

    @cached_property
    def joints(self) -> tuple[int, ...]:
        """All joints that networks move, in the order of the chains."""
        return tuple(joint for name in HIERARCHY for joint in self.members[name])

    @cached_property
    def hip_inputs(self) -> tuple[int, ...]:
        """The 14 input joints of the hip network: hips, chest, and of each limb upper, middle and end."""
        ends = (*self.effectors[:2], *self.ankles)
        return (self.hips, self.chest, *self.sockets, *self.middles, *ends)

    @cached_property
    def body_inputs(self) -> tuple[int, ...]:
        """The 8 input joints of the body network, all outside the body: elbows, knees, wrists, ankles."""
        return (*self.middles, *self.effectors[:2], *self.ankles)

    @cached_property
    def tops(self) -> tuple[int, ...]:
        """First joints of the chains of both arms and both legs, where the chains before them place them."""
        return tuple(self.members[name][0] for name in LIMB_OF)

    @cached_property
    def trunk(self) -> tuple[int, ...]:
        """Hips and body."""
        return (self.hips, *self.members["body"])

    @cached_property
    def arm_inputs(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """The (7) trunk joints whose positions the left and right arm networks receive: all but their own reference."""
        left, right = (tuple(j for j in self.trunk if j != self.references[arm]) for arm in LIMB_OF[:2])
        return left, right

    @cached_property
    def leg_inputs(self) -> tuple[int, ...]:
        """The (6) body joints whose rotations the leg networks receive."""
        carriers = (self.references[arm] for arm in LIMB_OF[:2])
        return tuple(dict.fromkeys((self.members["body"][0], self.chest, *carriers, self.neck, self.head)))


def find_chains(skeleton: Skeleton, shoulder: str = "body") -> Chains:
    """Find the chains of a humanoid skeleton.

    Args:
        skeleton: the skeleton.
        shoulder: "body" or "arm", the chain that moves the shoulders.
    Raises:
        InputError: if the skeleton lacks hands, legs or a trunk between hips and arms, or shoulders of their own.
    """
    body = identify_joints(skeleton)
    _check_limbs(body.left, body.right, shoulder)
    parents = skeleton.parents
    arms = [_list_joints_between(skeleton, limb.upper_arm if shoulder == "body" else limb.shoulder, limb.hand)
            for limb in (body.left, body.right)]
    legs = [_list_joints_between(skeleton, limb.upper_leg, limb.toe_or_foot) for limb in (body.left, body.right)]
    sockets = (body.left.upper_arm, body.right.upper_arm, body.left.upper_leg, body.right.upper_leg)
    top = body.neck if body.head is None else body.head
    trunk: set[int] = set()
    for joint in (*(parents[arm[0]] for arm in arms), *([] if top is None else [top])):
        trunk |= set(_list_joints_between(skeleton, body.hips, joint)) - {body.hips}
    if not trunk:
        raise InputError("skeleton", "no joint between the hips and the arms", "a spine")
    members = dict(zip(HIERARCHY, [(body.hips,), tuple(sorted(trunk)), *arms, *legs]))
    references = dict(zip(HIERARCHY, [-1, body.hips, *(parents[limb[0]] for limb in (*arms, *legs))]))
    chest = structure.find_common_ancestor(parents, [parents[arm] for arm in sockets[:2]])
    head = chest if top is None else top
    return Chains(
        skeleton=skeleton, hips=body.hips, above=tuple(j for j in _list_joints_between(skeleton, 0, body.hips)
                                                       if j != body.hips), members=members, references=references,
        known=_group_by_chain(skeleton, members), effectors=(body.left.hand, body.right.hand, body.left.toe_or_foot,
                                                             body.right.toe_or_foot), sockets=sockets,
        middles=(body.left.lower_arm, body.right.lower_arm, body.left.lower_leg, body.right.lower_leg),
        ankles=(body.left.foot, body.right.foot), chest=chest, neck=head if body.neck is None else body.neck, head=head,
    )


def _check_limbs(left: Limb, right: Limb, shoulder: str) -> None:
    """Raise InputError if an arm or leg lacks a joint."""
    own = ("shoulder",) if shoulder == "arm" else ()
    required = (*own, "upper_arm", "lower_arm", "hand", "upper_leg", "lower_leg", "foot")
    missing = [
        f"{side} {part.replace('_', ' ')}"
        for side, limb in (("left", left), ("right", right))
        for part in required
        if getattr(limb, part) is None
    ]
    if missing:
        found = f"no {', no '.join(missing)}"
        raise InputError("skeleton", found, "a body with arms, hands and feet", "choose another rig")


def _list_joints_between(skeleton: Skeleton, high: int, low: int) -> tuple[int, ...]:
    """List the joints from `high` down to `low`, both included; InputError if `low` does not hang below `high`."""
    joints = sorted(structure.list_ancestors(skeleton.parents, low))
    if high not in joints:
        found = f"{skeleton.names[low]} does not hang below {skeleton.names[high]}"
        raise InputError("skeleton", found, "limbs whose joints follow each other")
    return tuple(joints[joints.index(high) :])


def _group_by_chain(skeleton: Skeleton, members: dict[str, tuple[int, ...]]) -> dict[str, tuple[int, ...]]:
    """Assign every joint to the chain of the nearest chain joint at or above it, joints above the hips to the hip.

    The first joint of a limb is also assigned to the chain that it hangs on, which determines its position.
    """
    owner = {joint: name for name, joints in members.items() for joint in joints}
    groups: dict[str, list[int]] = {name: [] for name in HIERARCHY}
    chain_of_joint: list[str] = []
    # of[joint]: chain of the joint, inherited from its parent unless the joint is a chain member itself
    for joint, parent in enumerate(skeleton.parents):
        chain_of_joint.append(owner.get(joint, chain_of_joint[parent] if parent >= 0 else "hip"))
        groups[chain_of_joint[-1]].append(joint)
        if parent >= 0 and chain_of_joint[parent] != chain_of_joint[-1]:
            groups[chain_of_joint[parent]].append(joint)
    return {name: tuple(joints) for name, joints in groups.items()}
