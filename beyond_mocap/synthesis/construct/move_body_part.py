"""Move a part of the body: a foot or hand with its limb, the head or chest with the spine. The ground is at height 0.

A limb swings about its upper joint and bends or straightens by a share of the range to the smallest or largest angle
of its knee or elbow. A constant shift of the foot in space would need more than the length of the leg where the
recording stretches it, and the knee would snap straight. What is applied is the difference between reaching for the
new place and reaching for the old one, so a shift of zero changes nothing, however straight the limb is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...annotation.striking import Surface
from ...base.vectors import skew_matrix
from ...motion import quaternion
from ...motion.humanoid import Limb, identify_joints
from ...motion.limb import compute_inner_angle, solve_posed_limb
from ...motion.motion import compute_pose
from ...motion.retargeting.structure import list_ancestors
from ...motion.skeleton import Skeleton

MAX_BEND = {"head": 0.6, "chest": 0.35}  # rad, largest bend of the whole spine, by the part that is moved
MIN_ANGLE, MAX_ANGLE = np.radians(35.0), np.radians(170.0)
"""Radians, smallest and largest inner angle of the knee or elbow of a moved limb, unless the recording has a smaller
or larger one."""

MAX_SWING = {"foot": np.radians(35.0), "hand": np.radians(60.0)}  # rad, largest turn of a limb about its upper joint
SOFTENING = 0.003  # m below full length from which on a limb extends softly
_DAMPING = 1e-3  # of the least squares step: keeps the bend small where bending hardly moves the part

_SOLE, _ROUNDING = 0.02, 0.03  # m: lowest foot joint above the ground, and the range over which it nears that softly


@dataclass(frozen=True, eq=False)
class Body:
    """A body over W frames, with the world placement of its joints.

    Attributes:
        skeleton: the skeleton of all frames.
        root: (W, 3) m, world.
        rotations: (W, J, 4) local quaternions.
        places: (W, J, 3) m, joint positions, world.
        world: (W, J, 4) joint rotations, world.
    """

    skeleton: Skeleton
    root: np.ndarray
    rotations: np.ndarray
    places: np.ndarray
    world: np.ndarray

    @classmethod
    def from_pose(cls, skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray) -> "Body":
        """Build a body and compute the world placement of its joints.

        Args:
            skeleton: the skeleton.
            root: (W, 3) m, world.
            rotations: (W, J, 4) local quaternions.
        Returns:
            The body with `places` and `world`.
        """
        return cls(skeleton, root, rotations, *compute_pose(skeleton, root, rotations))

    def surface_line(self, surface: Surface, at) -> tuple[np.ndarray, np.ndarray]:
        """Return both ends of a striking surface's line.

        Args:
            surface: the striking surface.
            at: frame or frames.
        Returns:
            Two arrays (..., 3) m, world.
        """
        return surface.compute_line(self.places[at], self.world[at])


def arm_chain(limb: Limb) -> tuple[int, int, int]:
    """Return the joints of an arm: shoulder, elbow, wrist."""
    return limb.upper_arm, limb.lower_arm, limb.hand


def limb_chain(skeleton: Skeleton, part: Surface) -> tuple[int, int, int]:
    """Return the three joints of the limb that carries a foot, a hand or a tool in a hand.

    Args:
        skeleton: the skeleton.
        part: a striking surface on a limb.
    """
    limb = getattr(identify_joints(skeleton), part.side)
    return limb.leg if part.part == "foot" else arm_chain(limb)


@dataclass(frozen=True, eq=False)
class LimbReference:
    """A limb solved for the place where its end already is, the reference from which shifts are measured.

    A nearly straight limb misses its own place a little, because it extends softly; the difference cancels out.

    Attributes:
        chain: upper, middle and end joint, as for `limb.solve_two_bone`.
        soft: m of soft extension, as for `limb.solve_two_bone`.
        world: joint -> (W, 4) world rotation.
    """

    chain: tuple[int, int, int]
    soft: float
    world: dict[int, np.ndarray]

    @classmethod
    def from_body(cls, body: Body, chain: tuple[int, int, int], soft: float = SOFTENING) -> "LimbReference":
        """Solve the limb of a body for its own place.

        Args:
            body: the body, W frames.
            chain: upper, middle and end joint.
            soft: m below full length from which on the limb extends softly.
        """
        end = body.places[:, chain[2]]
        still, _ = solve_posed_limb(body.skeleton, body.places, body.world, chain, end, soft=soft)
        return cls(chain, soft, _limb_world_rotations(body, still, chain))


@dataclass(frozen=True, eq=False)
class Swing:
    """How a limb moves to another place.

    Attributes:
        turn: (3,) rad, rotation vector about the upper joint, world.
        bend: share of the range to the largest angle of the middle joint; negative: to its smallest angle.
        lowered: m by which the upper joint sinks.
    """

    turn: np.ndarray
    bend: float
    lowered: float = 0.0


def solve_swing(body: Body, chain: tuple[int, int, int], at: int, place: np.ndarray, max_turn: float,
                lowered=0.0) -> Swing:
    """Solve the swing that brings the end of a limb to a place, or as near as the limits let it.

    Args:
        body: the body, W frames.
        chain: upper, middle and end joint.
        at: frame of the body.
        place: (3,) m, world, target of the end joint.
        max_turn: rad, largest turn about the upper joint.
        lowered: m by which the upper joint sinks.
    Returns:
        The swing, its angles within MIN_ANGLE and MAX_ANGLE.
    """
    top, middle, end = body.places[at, list(chain)]
    old, new = end - top, place - top + [0.0, 0.0, lowered]
    turn = quaternion.to_rotation_vector(quaternion.rotation_between(old[None], new[None]))[0]
    turn *= min(1.0, max_turn / max(np.linalg.norm(turn), 1e-9))
    bones = np.linalg.norm(middle - top), np.linalg.norm(end - middle)
    own_angle, target_angle = (compute_inner_angle(*bones, np.linalg.norm(line)) for line in (old, new))
    limit = MAX_ANGLE if target_angle > own_angle else MIN_ANGLE
    left = limit - own_angle
    bend = 0.0 if left * (target_angle - own_angle) <= 0.0 else min((target_angle - own_angle) / left,
                                                                    1.0) * np.sign(left)
    return Swing(turn, bend, lowered)


def compute_swing_shift(body: Body, chain: tuple[int, int, int], swing: Swing, share: np.ndarray) -> np.ndarray:
    """Compute how far the end of a limb moves with a share of a swing at each frame.

    A limb that bends less than the limit at one frame bends less at all frames, so the knee keeps the speed of the
    recording.

    Args:
        body: the body, W frames.
        chain: upper, middle and end joint.
        swing: the whole swing.
        share: (W,) 0 to 1.
    Returns:
        (W, 3) m, world; exactly zero where the share is 0.
    """
    top, middle, end = (body.places[:, joint] for joint in chain)
    line = end - top
    length = np.linalg.norm(line, axis=1)
    bones = np.linalg.norm(middle - top, axis=1), np.linalg.norm(end - middle, axis=1)
    own = compute_inner_angle(*bones, length)
    # the range left to the limit at every frame, and the same share of it everywhere
    left = np.maximum(MAX_ANGLE - own, 0.0) if swing.bend > 0.0 else np.minimum(MIN_ANGLE - own, 0.0)
    angle = own + share * abs(swing.bend) * left
    # law of cosines: distance from the upper joint to the end for this inner angle
    reach = np.sqrt(bones[0] ** 2 + bones[1] ** 2 - 2.0 * bones[0] * bones[1] * np.cos(angle))
    turned = quaternion.rotate(quaternion.from_rotation_vector(share[:, None] * swing.turn), line)
    moves = turned * (reach / length)[:, None] - line - share[:, None] * [0.0, 0.0, swing.lowered]
    return np.where(share[:, None] > 0.0, moves, 0.0)


def move_limb(
    body: Body, limb: LimbReference, shift: np.ndarray, root: np.ndarray | None = None, rotations: np.ndarray
    | None = None
) -> np.ndarray:
    """Rotate the joints of a limb so that its end lies at a shift from where `body` has it.

    The end joint keeps its world rotation.

    Args:
        body: the body before the shift, W frames.
        limb: its reference solution.
        shift: (W, 3) m, world.
        root: (W, 3) m, where the root is now, if it has moved.
        rotations: (W, J, 4) local, what the other joints have now, if they have changed.
    Returns:
        (W, J, 4) local rotations.
    """
    skeleton, chain = body.skeleton, limb.chain
    target = body.places[:, chain[2]] + shift
    places = body.places
    if root is not None:
        places, _ = compute_pose(skeleton, root, body.rotations, list_ancestors(skeleton.parents, chain[2]))
    moved, _ = solve_posed_limb(skeleton, places, body.world, chain, target, soft=limb.soft)
    after = _limb_world_rotations(body, moved, chain)
    out = (body.rotations if rotations is None else rotations).copy()
    above = body.world[:, skeleton.parents[chain[0]]]
    for joint, turned in after.items():
        # change against the reference solution, applied to the recorded rotation
        change = quaternion.multiply(turned, quaternion.inverse(limb.world[joint]))
        world = quaternion.multiply(change, body.world[:, joint])
        local = quaternion.multiply(quaternion.inverse(above), world)
        out[:, joint] = quaternion.match_signs(local, body.rotations[:, joint])
        above = world
    return out


def hold_foot(body: Body, limb: Limb, root: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Hold a foot where `body` has it although the root has moved.

    Args:
        body: the body before the move, W frames.
        limb: the leg.
        root: (W, 3) m, where the root is now.
        rotations: (W, J, 4) local, what the other joints have now.
    Returns:
        (W, J, 4) local rotations.
    """
    return move_limb(body, LimbReference.from_body(body, limb.leg, soft=1e-3), np.zeros_like(body.root), root,
                     rotations)


def bend_spine(body: Body, surface: Surface, at: int, shift: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Bend the spine so that the middle of a surface moves by a shift at one frame.

    Every joint of the spine (and the neck, for the head) turns by the same rotation: one damped step of the inverse of
    how the middle moves. The bend is fixed in the frame of the hips, and is at most MAX_BEND.

    Args:
        body: the body, W frames.
        surface: a surface of the head or chest.
        at: frame of the body.
        shift: (3,) m, world.
        weight: (W,) share of the bend at each frame.
    Returns:
        (W, J, 4) local rotations.
    """
    skeleton, joint = body.skeleton, surface.start[0]
    hips = identify_joints(skeleton).hips
    bending = [j for j in list_joint_chain(skeleton, hips, joint)[1:] if j != joint or surface.part == "head"]
    if not bending:
        return body.rotations.copy()
    middle = np.mean(body.surface_line(surface, at), axis=0)
    arms = middle - body.places[at, bending]
    # moves @ bend is the mean shift of the middle if each joint turned by `bend`
    moves = np.mean([skew_matrix(a).T for a in arms], axis=0)
    # damped least squares: (M'M + damping I) bend = M' shift
    bend = np.linalg.solve(moves.T @ moves + _DAMPING * np.eye(3), moves.T @ shift)
    bend *= min(1.0, MAX_BEND[surface.part] / max(np.linalg.norm(bend), 1e-9))
    carried = quaternion.rotate(quaternion.inverse(body.world[at, hips]), bend / len(bending))
    turn = quaternion.from_rotation_vector(weight[:, None] * quaternion.rotate(body.world[:, hips], carried))
    out = body.rotations.copy()
    for j in bending:
        parent = body.world[:, skeleton.parents[j]]
        own = quaternion.multiply(quaternion.inverse(parent), quaternion.multiply(turn, parent))
        out[:, j] = quaternion.multiply(own, body.rotations[:, j])
    return out


def swing_thigh(body: Body, surface: Surface, at: int, shift: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Swing a leg about its hip so that the middle of its thigh moves by a shift at one frame, as far as an arc goes.

    Args:
        body: the body, W frames.
        surface: a thigh's surface.
        at: frame of the body.
        shift: (3,) m, world.
        weight: (W,) share of the swing at each frame.
    Returns:
        (W, J, 4) local rotations.
    """
    hip = surface.start[0]
    arm = surface.compute_line(body.places[at], body.world[at])[0] - body.places[at, hip]
    swing = quaternion.to_rotation_vector(quaternion.rotation_between(arm[None], (arm + shift)[None]))[0]
    turn = quaternion.from_rotation_vector(weight[:, None] * swing)
    above = body.world[:, body.skeleton.parents[hip]]
    own = quaternion.multiply(quaternion.inverse(above), quaternion.multiply(turn, above))
    out = body.rotations.copy()
    out[:, hip] = quaternion.multiply(own, body.rotations[:, hip])
    return out


def limit_to_ground(body: Body, foot: Surface, at, shift: np.ndarray) -> np.ndarray:
    """Limit the shift of a foot so that it does not go through the ground, except where it is below it already.

    Args:
        body: the body, W frames.
        foot: the foot's surface.
        at: frame or frames.
        shift: (..., 3) m, world.
    Returns:
        (..., 3) m, world.
    """
    tip = foot_tip_line(body.skeleton, getattr(identify_joints(body.skeleton), foot.side), body.places[at],
                        body.world[at])[1]
    lowest = np.minimum(np.min(body.surface_line(foot, at), axis=0)[..., 2], tip[..., 2])
    out = shift.copy()
    least, requested = np.minimum(_SOLE - lowest, 0.0), shift[..., 2]
    # smooth maximum of wish and least, rounded by up to _ROUNDING; not rounded where the foot does not move
    corner = _ROUNDING * np.minimum(1.0, np.linalg.norm(shift, axis=-1) / (2.0 * _ROUNDING))
    out[..., 2] = 0.5 * (requested + least + np.hypot(requested - least, corner))
    return out


def foot_tip_line(skeleton: Skeleton, limb: Limb, places: np.ndarray, world: np.ndarray) -> tuple[np.ndarray,
        np.ndarray]:
    """Return both ends of what lies beyond the foremost joint of a foot; twice the joint where the skeleton has no end
    site.

    Args:
        skeleton: the skeleton.
        limb: the leg.
        places: (..., J, 3) m, joint positions, world.
        world: (..., J, 4) joint rotations, world.
    Returns:
        Two arrays (..., 3) m, world.
    """
    toe = limb.toe_or_foot
    offset = next((o for p, o in zip(skeleton.end_parents, skeleton.end_offsets) if p == toe), np.zeros(3))
    return places[..., toe, :], places[..., toe, :] + quaternion.rotate(world[..., toe, :], offset)


def list_joint_chain(skeleton: Skeleton, high: int, low: int) -> list[int]:
    """List the joints from `high` down to `low`, both included."""
    chain = [low]
    while chain[-1] != high:
        chain.append(skeleton.parents[chain[-1]])
    return chain[::-1]


def _limb_world_rotations(body: Body, local: Mapping[int, np.ndarray], chain: tuple[int, int, int]
                          ) -> dict[int, np.ndarray]:
    """Compute world rotations (W, 4) of a limb's joints for other local ones; above the limb all is as in `body`."""
    world, above = {}, body.world[:, body.skeleton.parents[chain[0]]]
    for joint in list_joint_chain(body.skeleton, chain[0], chain[2]):
        above = world[joint] = quaternion.multiply(above, local[joint])
    return world
