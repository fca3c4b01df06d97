"""A part of the body carried elsewhere: a foot or hand by its limb, head or chest by the spine, the rest as it was.
The ground is at height 0.

A limb is swung about its upper joint and bends or straightens by a share of the way to the least or largest angle of
its knee or elbow. A shift of the foot in space, the same at every frame, would ask for more than the leg's length where
the recording stretches it, and the knee would snap straight.

What is applied is the difference between reaching for the new place and reaching for the old one, so that a shift of
zero changes nothing at all, however straight the limb is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...annotation.striking import Surface
from ...base.vectors import skew_matrix
from ...motion import quaternion
from ...motion.humanoid import Limb, identify
from ...motion.limb import inner_angle, two_bone
from ...motion.motion import pose_kinematics
from ...motion.skeleton import Skeleton

MOST_BEND = {"head": 0.6, "chest": 0.35}  # rad that the whole spine bends at most
LEAST_ANGLE, MOST_ANGLE = np.radians(35.0), np.radians(170.0)
"""Radians inside a knee or elbow that a carried limb has at least and at most, unless the recording has less or
more."""

MOST_SWING = {"foot": np.radians(35.0), "hand": np.radians(60.0)}  # rad that a whole limb turns about its upper joint
SOFT = 0.003  # m below full length from where a limb eases
_DAMPING = 1e-3  # keeps the bend of a spine small where it moves the part little

_SOLE, _ROUNDING = 0.02, 0.03  # metres of the lowest foot joint above the ground, and over which it nears that


@dataclass(frozen=True, eq=False)
class Body:
    """A body over W frames: root (W, 3) m, rotations (W, J, 4) local; places (W, J, 3) m and world (W, J, 4) of its
    joints."""

    skeleton: Skeleton
    root: np.ndarray
    rotations: np.ndarray
    places: np.ndarray
    world: np.ndarray

    @classmethod
    def posed(cls, skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray) -> "Body":
        """With its joints' places worked out."""
        return cls(skeleton, root, rotations, *pose_kinematics(skeleton, root, rotations))

    def line(self, surface: Surface, at) -> tuple[np.ndarray, np.ndarray]:
        """Both ends (..., 3) m of a striking surface's line at frame or frames `at`."""
        return surface.line(self.places[at], self.world[at])


def leg(limb: Limb) -> tuple[int, int, int]:
    """Hip, knee and ankle."""
    return limb.upper_leg, limb.lower_leg, limb.foot


def arm(limb: Limb) -> tuple[int, int, int]:
    """Shoulder, elbow and wrist."""
    return limb.upper_arm, limb.lower_arm, limb.hand


def limb_chain(skeleton: Skeleton, part: Surface) -> tuple[int, int, int]:
    """The joints of the limb that a foot, a hand or a tool in a hand hangs on."""
    limb = getattr(identify(skeleton), part.side)
    return leg(limb) if part.part == "foot" else arm(limb)


@dataclass(frozen=True, eq=False)
class Resting:
    """A limb that reaches for where its end is anyway, which a nearly straight limb misses a little: `chain` and `soft`
    as for `limb.two_bone`; world: (W, 4) rotations of the limb's joints, by joint."""

    chain: tuple[int, int, int]
    soft: float
    world: dict[int, np.ndarray]

    @classmethod
    def of(cls, body: Body, chain: tuple[int, int, int], soft: float = SOFT) -> "Resting":
        """The limb of a body."""
        end = body.places[:, chain[2]]
        still = two_bone(body.skeleton, body.root, body.rotations, chain, end, soft=soft).rotations
        return cls(chain, soft, _limb_world(body, still, chain))


@dataclass(frozen=True, eq=False)
class Swing:
    """How a limb goes elsewhere. turn (3,) rad: rotation vector about the upper joint. bend: share of the way to the
    middle joint's largest angle, or, negative, to its least. lowered: m by which the upper joint sinks."""

    turn: np.ndarray
    bend: float
    lowered: float = 0.0


def swing_to(body: Body, chain: tuple[int, int, int], at: int, place: np.ndarray, most: float, lowered=0.0) -> Swing:
    """The swing that brings the limb's end to `place` (3,) m at frame `at`, or as near as MOST_ANGLE, LEAST_ANGLE and a
    turn of `most` rad let it."""
    top, middle, end = body.places[at, list(chain)]
    old, new = end - top, place - top + [0.0, 0.0, lowered]
    turn = quaternion.to_rotation_vector(quaternion.between(old[None], new[None]))[0]
    turn *= min(1.0, most / max(np.linalg.norm(turn), 1e-9))
    bones = np.linalg.norm(middle - top), np.linalg.norm(end - middle)
    own, wanted = (inner_angle(*bones, np.linalg.norm(line)) for line in (old, new))
    limit = MOST_ANGLE if wanted > own else LEAST_ANGLE
    left = limit - own
    bend = 0.0 if left * (wanted - own) <= 0.0 else min((wanted - own) / left, 1.0) * np.sign(left)
    return Swing(turn, bend, lowered)


def swung(body: Body, chain: tuple[int, int, int], swing: Swing, share: np.ndarray) -> np.ndarray:
    """(W, 3) m by which the limb's end moves, with a share (W,) of a swing at each frame. What bends less than the
    limit at one frame bends less at all, so that the knee's speed stays that of the recording."""
    top, middle, end = (body.places[:, joint] for joint in chain)
    line = end - top
    length = np.linalg.norm(line, axis=1)
    bones = np.linalg.norm(middle - top, axis=1), np.linalg.norm(end - middle, axis=1)
    own = inner_angle(*bones, length)
    left = np.maximum(MOST_ANGLE - own, 0.0) if swing.bend > 0.0 else np.minimum(LEAST_ANGLE - own, 0.0)
    angle = own + share * abs(swing.bend) * left
    reach = np.sqrt(bones[0] ** 2 + bones[1] ** 2 - 2.0 * bones[0] * bones[1] * np.cos(angle))
    turned = quaternion.rotate(quaternion.from_rotation_vector(share[:, None] * swing.turn), line)
    moves = turned * (reach / length)[:, None] - line - share[:, None] * [0.0, 0.0, swing.lowered]
    return np.where(share[:, None] > 0.0, moves, 0.0)


def limb_carried(
    body: Body, limb: Resting, shift: np.ndarray, root: np.ndarray | None = None, rotations: np.ndarray | None = None
) -> np.ndarray:
    """Local rotations (W, J, 4) with the limb's joints turned so that its end lies `shift` (W, 3) m from where `body`
    has it; the end joint keeps its world rotation.

    root (W, 3) m: where the body's root is now, if elsewhere. rotations (W, J, 4): what the other joints have, if else.
    """
    skeleton, chain = body.skeleton, limb.chain
    target = body.places[:, chain[2]] + shift
    moved = two_bone(skeleton, body.root if root is None else root, body.rotations, chain, target, soft=limb.soft)
    after = _limb_world(body, moved.rotations, chain)
    out = (body.rotations if rotations is None else rotations).copy()
    above = body.world[:, skeleton.parents[chain[0]]]
    for joint, turned in after.items():
        change = quaternion.multiply(turned, quaternion.inverse(limb.world[joint]))
        world = quaternion.multiply(change, body.world[:, joint])
        local = quaternion.multiply(quaternion.inverse(above), world)
        out[:, joint] = quaternion.signed_like(local, body.rotations[:, joint])
        above = world
    return out


def foot_kept(body: Body, limb: Limb, root: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Local rotations (W, J, 4) with a foot where `body` has it, though its root is now at root (W, 3) m."""
    return limb_carried(body, Resting.of(body, leg(limb), soft=1e-3), np.zeros_like(body.root), root, rotations)


def spine_bent(body: Body, surface: Surface, at: int, shift: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Local rotations (W, J, 4) with the spine bent so that the surface's middle lies `shift` (3,) m away at frame
    `at`.

    weight (W,): share of the bend at each frame. Every joint of the spine (and neck, for the head) turns alike, by one
    damped step of the inverse of how the middle moves; the bend goes along with the hips, and is at most MOST_BEND."""
    skeleton, joint = body.skeleton, surface.start[0]
    hips = identify(skeleton).hips
    bending = [j for j in joints_down(skeleton, hips, joint)[1:] if j != joint or surface.part == "head"]
    if not bending:
        return body.rotations.copy()
    middle = np.mean(body.line(surface, at), axis=0)
    arms = middle - body.places[at, bending]
    moves = np.mean([skew_matrix(a).T for a in arms], axis=0)
    bend = np.linalg.solve(moves.T @ moves + _DAMPING * np.eye(3), moves.T @ shift)
    bend *= min(1.0, MOST_BEND[surface.part] / max(np.linalg.norm(bend), 1e-9))
    carried = quaternion.rotate(quaternion.inverse(body.world[at, hips]), bend / len(bending))
    turn = quaternion.from_rotation_vector(weight[:, None] * quaternion.rotate(body.world[:, hips], carried))
    out = body.rotations.copy()
    for j in bending:
        parent = body.world[:, skeleton.parents[j]]
        own = quaternion.multiply(quaternion.inverse(parent), quaternion.multiply(turn, parent))
        out[:, j] = quaternion.multiply(own, body.rotations[:, j])
    return out


def above_ground(body: Body, foot: Surface, at, shift: np.ndarray) -> np.ndarray:
    """Shifts (..., 3) m of a foot at frames `at` that does not go through the ground, but where it is there already."""
    tip = foot_tip(body.skeleton, getattr(identify(body.skeleton), foot.side), body.places[at], body.world[at])[1]
    lowest = np.minimum(np.min(body.line(foot, at), axis=0)[..., 2], tip[..., 2])
    out = shift.copy()
    least, wish = np.minimum(_SOLE - lowest, 0.0), shift[..., 2]
    # a maximum without a corner: at its sharpest _ROUNDING is between the two, and nothing where nothing is moved
    corner = _ROUNDING * np.minimum(1.0, np.linalg.norm(shift, axis=-1) / (2.0 * _ROUNDING))
    out[..., 2] = 0.5 * (wish + least + np.hypot(wish - least, corner))
    return out


def foot_tip(skeleton: Skeleton, limb: Limb, places: np.ndarray, world: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both ends (..., 3) m of what is beyond a foot's foremost joint, twice the joint where nothing is; places (..., J,
    3) m and world (..., J, 4) of the joints."""
    toe = limb.toe_or_foot
    offset = next((o for p, o in zip(skeleton.end_parents, skeleton.end_offsets) if p == toe), np.zeros(3))
    return places[..., toe, :], places[..., toe, :] + quaternion.rotate(world[..., toe, :], offset)


def joints_down(skeleton: Skeleton, high: int, low: int) -> list[int]:
    """Joints from `high` down to `low`, both included."""
    chain = [low]
    while chain[-1] != high:
        chain.append(skeleton.parents[chain[-1]])
    return chain[::-1]


def _limb_world(body: Body, rotations: np.ndarray, chain: tuple[int, int, int]) -> dict[int, np.ndarray]:
    """World rotations (W, 4) of a limb's joints with other local ones, what is above the limb being as in `body`."""
    world, above = {}, body.world[:, body.skeleton.parents[chain[0]]]
    for joint in joints_down(body.skeleton, chain[0], chain[2]):
        above = world[joint] = quaternion.multiply(above, rotations[:, joint])
    return world
