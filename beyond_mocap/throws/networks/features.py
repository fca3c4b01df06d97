"""Inputs of each network (Fredriksson sections 7.2 and 7.3); `network_output` converts their outputs to a pose.

All functions are pure, take `xp` (numpy or jax.numpy) last and leave leading axes free. A network predicts frame n +
1 from frame n: `pose` is the state in n, `after` what is known of n + 1 so far, in the order of `HIERARCHY`.

    after = pose
    for name in HIERARCHY:
        x = build_input(name, chains, settings, pose, after, window)
        after = apply_output(name, chains, settings, y(x), pose, after, window)

Decisions where the text leaves something open:

- **Hip**: its 14 joints are the hips, the chest, and upper, middle and end joint of each limb (of legs the ankle).
- **Static frame** (`frame="static"`, as in the thesis): the normalised frame. `frame="hip"` (this project): the
  same, moved so that the hips of frame n are above the origin, so that a run-up may go anywhere.
- **Reference frame of a chain**: position and rotation of the joint that the chain hangs on, in frame n + 1;
  trajectories, impact and joints "in absolute form" are given in it, those of frame n too. δa_o: the rotation from
  the frame's axes in n to those in n + 1, in the axes of n, as six numbers minus those of the identity. The thesis'
  "delta axis" is a difference of world axes; this one does not change when the world rotates.
- **Body**: the 8 joints outside it are elbows, wrists, knees and ankles, in frame n.
- **Arm**: d is from the upper arm to the target of the wrist in n + 1; the wrist's rotation r¹ is that of the hand
  in the reference frame, because the lower arm that it would be relative to is what the network predicts. p_i¹ are
  the hips and the body's joints except the reference itself, a_k¹ those of hips and body.
- **Leg**: p_i¹ are the head and both shoulders (upper arms), a_k¹ six joints of the body: lowest, chest, both joints
  that carry the arms, neck, head.
- **Guided** (`guided`, this project; section 9.3 suggests networks that know inverse kinematics): limb networks also
  receive the rotations r by which the limb of frame n, as it hangs on its reference in n + 1, would reach its target
  (`compute_reach_guide`). The network decides how to use them; nothing is corrected afterwards.
- **Carried** (`carried`, this project): the hip network also receives where the hips of frame n would be if they
  moved along with hands and feet (`carry_hips`). Measured from below the hips, as all its inputs.
- **Wrist inferred**: no r¹, and the hand's relative rotation joins those of the arm, in input and output.
- **Phase**: for a leg, that of d in n + 1, which is part of the input; for all others the motion phase of frame n.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ...base.vectors import cross_on_ground
from .chains import LIMB_OF, Chains
from .description import Windows
from .kinematics import Pose, build_pose, flatten, take_joints, to_six, transpose, update_joints
from .limb_reach import find_hinge_axes, reach_limb
from .model import SINGLE, ModelSettings
from .network_output import build_output, compute_origin, list_predicted_joints
from .phases import compute_distance_phase

HIP_GUIDES = 9
"""Number of values that `carry_hips` returns."""
_EFFECTOR_WEIGHTS = np.array([1.0, 1.0, 3.0,
                              3.0]) / 8.0  # weights of both hands and both feet: feet are planted, hands swing
_TINY = 1e-12  # m^2; keeps the derivative of the square root finite


def build_input(name: str, chains: Chains, settings: ModelSettings, pose: Pose, after: Pose, window: Windows, xp=np):
    """Build the input x (..., in) of a network of `settings.networks`.

    Args:
        name: name of the network.
        chains: chains of the skeleton.
        settings: settings of the model.
        pose: state in frame n.
        after: what is known of frame n + 1 so far.
        window: network inputs of frame n.
        xp: numpy or jax.numpy.
    """
    if name == SINGLE:
        return build_single_input(chains, settings, pose, window, xp)
    if name == "hip":
        return build_hip_input(chains, settings, pose, window, xp)
    if name == "body":
        return build_body_input(chains, pose, after, window, xp)
    number = LIMB_OF.index(name)
    if number < 2:
        x = build_arm_input(number, chains, settings, pose=pose, after=after, window=window, xp=xp)
    else:
        x = build_leg_input(number, chains, pose, after=after, window=window, xp=xp)
    if not settings.guided:
        return x
    return xp.concatenate([x, compute_reach_guide(number, chains, settings, pose=pose, after=after,
                                                  window=window, xp=xp)], axis=-1)


def compute_phase(name: str, chains: Chains, after: Pose, window: Windows, leg_reach, xp=np):
    """Compute the phase (...) at which a network is evaluated.

    Args:
        name: name of the network.
        chains: chains of the skeleton.
        after: what is known of frame n + 1 so far.
        window: network inputs of frame n.
        leg_reach: {"left": (shortest, longest), "right": ...} m.
        xp: numpy or jax.numpy.
    """
    if name not in LIMB_OF[2:]:
        return window.phase
    return compute_distance_phase(measure_limb_distance(LIMB_OF.index(name), chains, after, window, xp)[..., 0],
                                  leg_reach[name[:-4]], xp)


def build_hip_input(chains: Chains, settings: ModelSettings, pose: Pose, window: Windows, xp=np):
    """Build (b_l, b_r, i, four trajectories, p_j, a_j), j = 14 (section 7.3).

    Args:
        chains: chains of the skeleton.
        settings: settings of the model.
        pose: state in frame n.
        window: network inputs of frame n.
        xp: numpy or jax.numpy.
    Returns:
        x (..., in).
    """
    parts = [*_build_motion_input(chains, settings, pose, window, xp),
             *_build_joint_input(chains, settings, pose, chains.hip_inputs, xp)]
    if settings.carried:
        parts.append(carry_hips(chains, pose, window, compute_origin(chains, settings, pose), xp))
    return xp.concatenate(parts, axis=-1)


def build_single_input(chains: Chains, settings: ModelSettings, pose: Pose, window: Windows, xp=np):
    """Build (b_l, b_r, i, four trajectories, p_j, a_j, v_j), j = all joints that networks move.

    Args:
        chains: chains of the skeleton.
        settings: settings of the model.
        pose: state in frame n.
        window: network inputs of frame n.
        xp: numpy or jax.numpy.
    Returns:
        x (..., in).
    Source: Fredriksson section 7.2, where j = 25.
    """
    parts = _build_joint_input(chains, settings, pose, chains.joints, xp)
    moved = flatten(take_joints(pose.moved, chains.joints, -2, xp), 2)
    return xp.concatenate([*_build_motion_input(chains, settings, pose, window, xp), *parts, moved], axis=-1)


def build_body_input(chains: Chains, pose: Pose, after: Pose, window: Windows, xp=np):
    """Build (b_l, b_r, i, both wrists' trajectories, o of both toes, δa_o, r_j, p_i, a_i), i = 8.

    Args:
        chains: chains of the skeleton.
        pose: state in frame n.
        after: what is known of frame n + 1 so far.
        window: network inputs of frame n.
        xp: numpy or jax.numpy.
    Returns:
        x (..., in).
    Source: Fredriksson section 7.3, where j = 10.
    """
    frame = _ReferenceFrame(chains.references["body"], pose, after, xp)
    seen = chains.body_inputs
    return xp.concatenate([
        window.sides,
        frame.to_local_position(window.impact),
        *(_build_trajectory(frame, window, number) for number in (0, 1)),
        *(frame.to_local_position(window.next[..., number, :]) for number in (2, 3)),
        frame.axes_change,
        flatten(to_six(take_joints(pose.local, chains.members["body"], -3, xp), xp), 2),
        flatten(frame.to_local_positions(take_joints(pose.positions, seen, -2, xp)), 2),
        flatten(to_six(frame.to_local_rotations(take_joints(pose.turns, seen, -3, xp)), xp), 2),
    ], axis=-1)  # fmt: skip


def build_arm_input(number: int, chains: Chains, settings: ModelSettings, pose: Pose, after: Pose, window: Windows,
                    xp=np):
    """Build (b_l, b_r, t_wrist, o_wrist, δa_o, r_wrist¹, d, r_upper, r_lower, p_i¹, a_k¹) of arm 0 or 1.

    Args:
        number: of the limb, as in `LIMB_OF`.
        chains: chains of the skeleton.
        settings: settings of the model.
        pose: state in frame n.
        after: what is known of frame n + 1 so far.
        window: network inputs of frame n.
        xp: numpy or jax.numpy.
    Returns:
        x (..., in).
    Source: Fredriksson section 7.3.
    """
    name = LIMB_OF[number]
    frame = _ReferenceFrame(chains.references[name], pose, after, xp)
    given = settings.wrist == "given"
    wrist = [to_six(frame.to_local_rotation(window.hands_next[..., number, :, :]), xp)] if given else []
    return xp.concatenate([
        window.sides,
        _build_trajectory(frame, window, number),
        frame.to_local_position(window.next[..., number, :]),
        frame.axes_change,
        *wrist,
        measure_limb_distance(number, chains, after, window, xp),
        flatten(to_six(take_joints(pose.local, list_predicted_joints(name, chains, settings), -3, xp), xp), 2),
        flatten(frame.to_local_positions(take_joints(after.positions, chains.arm_inputs[number], -2, xp)), 2),
        flatten(to_six(frame.to_local_rotations(take_joints(after.turns, chains.trunk, -3, xp)), xp), 2),
    ], axis=-1)  # fmt: skip


def build_leg_input(number: int, chains: Chains, pose: Pose, after: Pose, window: Windows, xp=np):
    """Build (t_toe, o_toe, δa_o, d, r_j, p_i¹, a_k¹), j = 4, i = 3, k = 6, of leg 2 (left) or 3 (right).

    Args:
        number: of the limb, as in `LIMB_OF`.
        chains: chains of the skeleton.
        pose: state in frame n.
        after: what is known of frame n + 1 so far.
        window: network inputs of frame n.
        xp: numpy or jax.numpy.
    Returns:
        x (..., in).
    Source: Fredriksson section 7.3.
    """
    name = LIMB_OF[number]
    frame = _ReferenceFrame(chains.references[name], pose, after, xp)
    others = (chains.head, *chains.tops[:2])
    return xp.concatenate([
        _build_trajectory(frame, window, number),
        frame.to_local_position(window.next[..., number, :]),
        frame.axes_change,
        measure_limb_distance(number, chains, after, window, xp),
        flatten(to_six(take_joints(pose.local, chains.members[name], -3, xp), xp), 2),
        flatten(frame.to_local_positions(take_joints(after.positions, others, -2, xp)), 2),
        flatten(to_six(frame.to_local_rotations(take_joints(after.turns, chains.leg_inputs, -3, xp)), xp), 2),
    ], axis=-1)  # fmt: skip


def compute_reach_guide(number: int, chains: Chains, settings: ModelSettings, pose: Pose, after: Pose, window: Windows,
                        xp=np):
    """Compute the relative rotations (..., 6 each) with which the limb of frame n would reach its target in n + 1.

    They are those of the joints that the limb's network predicts, by two-bone inverse kinematics.

    Args:
        number: of the limb, as in `LIMB_OF`.
        chains: chains of the skeleton.
        settings: settings of the model.
        pose: state in frame n.
        after: what is known of frame n + 1 so far.
        window: network inputs of frame n.
        xp: numpy or jax.numpy.
    """
    name = LIMB_OF[number]
    local = {joint: pose.local[..., joint, :, :] for joint in chains.members[name]}
    limb = update_joints(chains.skeleton, after, chains.known[name], root=after.root, local=local, given={}, xp=xp)
    bent = reach_limb(number, chains, limb, requested=window.next[..., number, :], share=1.0, axes=_find_hinges(chains),
                      keeps_rotation=True, xp=xp)
    return flatten(to_six(take_joints(bent.local, list_predicted_joints(name, chains, settings), -3, xp), xp), 2)


def count_guides(name: str, chains: Chains, settings: ModelSettings) -> int:
    """Count the last inputs of a network that come from `compute_reach_guide` or, for the hip, from `carry_hips`.

    Args:
        name: name of the network.
        chains: chains of the skeleton.
        settings: settings of the model.
    """
    if name == "hip":
        return HIP_GUIDES if settings.carried else 0
    return 6 * len(list_predicted_joints(name, chains, settings)) if settings.guided and name in LIMB_OF else 0


@lru_cache(maxsize=16)
def _find_hinges(chains: Chains) -> np.ndarray:
    """Find the axes (4, 3) of elbows and knees; they count where a limb is straight."""
    return find_hinge_axes(chains, None)


def count_widths(chains: Chains, settings: ModelSettings) -> dict[str, tuple[int, int]]:
    """Count inputs and outputs of each network: {name: (in, out)}."""
    local = np.broadcast_to(np.eye(3), (len(chains.skeleton), 3, 3))
    pose = build_pose(chains.skeleton, np.zeros(3), local)
    window = Windows(
        points=np.zeros((4, 9, 3)), deltas=np.zeros((4, 9, 3)), next=np.zeros((4, 3)),
        hands_next=np.broadcast_to(np.eye(3), (2, 3, 3)), sides=np.zeros(2), impact=np.zeros(3), phase=np.zeros(()),
    )  # fmt: skip
    found = {}
    for name in settings.networks:
        x = build_input(name, chains, settings, pose=pose, after=pose, window=window)
        found[name] = (x.shape[-1], build_output(name, chains, settings, pose, pose).shape[-1])
    return found


class _ReferenceFrame:
    """The reference frame of a chain: its joint in frame n + 1.

    Attributes:
        origin: (..., 3) m.
        axes: (..., 3, 3).
        inverse_axes: (..., 3, 3).
        axes_change: (..., 6), δa_o.
    """

    def __init__(self, joint: int, pose: Pose, after: Pose, xp):
        self.xp = xp
        self.origin = after.positions[..., joint, :]
        self.axes = after.turns[..., joint, :, :]
        self.inverse_axes = transpose(self.axes, xp)
        step = xp.matmul(transpose(pose.turns[..., joint, :, :], xp), self.axes)
        self.axes_change = to_six(step - np.eye(3), xp)

    def to_local_position(self, place):
        """Convert a position (..., 3) m from the world to this frame."""
        return self.xp.matmul(self.inverse_axes, (place - self.origin)[..., None])[..., 0]

    def to_local_positions(self, places):
        """Convert positions (..., N, 3) m from the world to this frame."""
        return self.xp.matmul(places - self.origin[..., None, :], self.axes)

    def to_local_vectors(self, vectors):
        """Convert vectors (..., N, 3) m from the world to this frame."""
        return self.xp.matmul(vectors, self.axes)

    def to_local_rotation(self, rotation):
        """Convert a rotation (..., 3, 3) from the world to this frame."""
        return self.xp.matmul(self.inverse_axes, rotation)

    def to_local_rotations(self, rotations):
        """Convert rotations (..., N, 3, 3) from the world to this frame."""
        return self.xp.matmul(self.inverse_axes[..., None, :, :], rotations)


def _build_trajectory(frame: _ReferenceFrame, window: Windows, number: int):
    """Build t of one effector, 54 values, in a chain's frame (eq. 7.1)."""
    points = frame.to_local_positions(window.points[..., number, :, :])
    deltas = frame.to_local_vectors(window.deltas[..., number, :, :])
    return flatten(frame.xp.concatenate([points, deltas], axis=-2), 2)


def _build_motion_input(chains: Chains, settings: ModelSettings, pose: Pose, window: Windows, xp) -> list:
    """Build x_m of hip and single: b_l, b_r, i and four trajectories, measured from `compute_origin`."""
    start = compute_origin(chains, settings, pose)
    points = window.points - start[..., None, None, :]
    trajectories = xp.concatenate([points, window.deltas], axis=-2)
    return [window.sides, window.impact - start, flatten(trajectories, 3)]


def _build_joint_input(chains: Chains, settings: ModelSettings, pose: Pose, joints: tuple[int, ...], xp) -> list:
    """Build p_j and a_j of hip and single."""
    places = take_joints(pose.positions, joints, -2, xp) - compute_origin(chains, settings, pose)[..., None, :]
    return [flatten(places, 2), flatten(to_six(take_joints(pose.turns, joints, -3, xp), xp), 2)]


def measure_limb_distance(number: int, chains: Chains, after: Pose, window: Windows, xp=np):
    """Measure d: metres (..., 1) from a limb's first joint to the target of its end in frame n + 1.

    Args:
        number: of the limb, as in `LIMB_OF`.
        chains: chains of the skeleton.
        after: what is known of frame n + 1 so far.
        window: network inputs of frame n.
        xp: numpy or jax.numpy.
    """
    to_target = window.next[..., number, :] - after.positions[..., chains.tops[number], :]
    return xp.sqrt(xp.sum(to_target * to_target, axis=-1, keepdims=True))


def carry_hips(chains: Chains, pose: Pose, window: Windows, origin, xp=np):
    """Compute the hips as hands and feet carry them from frame n to n + 1.

    The hips are rotated about the vertical and moved as brings the effectors of frame n nearest to their targets in
    n + 1, by least squares in which feet count three times as much (Procrustes; Kabsch 1976 with one axis).

    Args:
        chains: chains of the skeleton.
        pose: state in frame n.
        window: network inputs of frame n.
        origin: (..., 3) m, subtracted from the position.
        xp: numpy or jax.numpy.
    Returns:
        (..., 9): position less `origin`, and rotation as six numbers.
    """
    now = take_joints(pose.positions, chains.effectors, -2, xp)
    share = _EFFECTOR_WEIGHTS[:, None]
    middle, target_middle = (now * share).sum(-2), (window.next * share).sum(-2)
    a, b = share * (now - middle[..., None, :]), window.next - target_middle[..., None, :]
    along = (a[..., :2] * b[..., :2]).sum((-1, -2))
    across = cross_on_ground(a, b).sum(-1)
    turn = _build_vertical_rotation(along, across, xp)
    place = xp.matmul(turn, (pose.positions[..., chains.hips, :] - middle)[..., None])[..., 0] + target_middle
    return xp.concatenate([place - origin, to_six(xp.matmul(turn, pose.turns[..., chains.hips, :, :]), xp)],
                          axis=-1)


def _build_vertical_rotation(along, across, xp):
    """Build rotations (..., 3, 3) about the vertical by the angle of (`along`, `across`), both (...)."""
    long = xp.sqrt(along * along + across * across + _TINY)
    cosine, sine, nothing = along / long, across / long, xp.zeros_like(along)
    rows = [[cosine, -sine, nothing], [sine, cosine, nothing], [nothing, nothing, nothing + 1.0]]
    return xp.stack([xp.stack(row, -1) for row in rows], -2)
