"""One Gauss-Newton step of a whole chain, solved from the tips to the root without the full matrix.

The markers of a body enter its equations only as a rigid body: a rotation w and a shift v of space move a marker at x
by w x x + v, so their terms in (w, v) are one 6x6 matrix and one vector, like the inertia and force of a body. A joint
passes on to its parent what remains when its own rotations are eliminated: Featherstone's articulated-body algorithm
(Rigid Body Dynamics Algorithms, 2008, ch. 7), with the second derivative of squared distances in place of masses. The
cost grows with the number of joints, not with its cube, and every operation runs over many frames.

Beside the products of first derivatives (Gauss-Newton) there are the second derivatives: a rotation about a carries
along what a rotation further out has moved, a x (b x y). Summed over all markers below a joint they form one 3x3 matrix
(`SecondDerivatives`). They matter where a chain is stretched or pressed along itself, as a nearly straight spine is.

"The origin" is each frame's own origin (`WorldPoses.origin`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .chain import Chain, WorldPoses, cross


class BodyTerms(NamedTuple):
    """The terms of each joint's body: second and first derivative of half the weighted squared distances.

    Attributes:
        curvature: (J, 6, 6, F), by rotation and shift about the origin.
        pull: (J, 6, F), likewise.
    """

    curvature: np.ndarray
    pull: np.ndarray


class SecondDerivatives(NamedTuple):
    """The second derivatives of the distances.

    Attributes:
        inner: (J, 3, 3, F), between a joint's own rotations.
        above: (J, 3, 3, F), between a rotation of everything above it (rows) and its own rotations.
    """

    inner: np.ndarray
    above: np.ndarray


class JointTerms(NamedTuple):
    """The terms of each joint's own rotations about its axes.

    Attributes:
        curvature: (J, 3, 3, F).
        pull: (J, 3, F).
    """

    curvature: np.ndarray
    pull: np.ndarray


def build_body_terms(chain: Chain, placed: WorldPoses, away: np.ndarray, weights: np.ndarray) -> BodyTerms:
    """Build the terms of the markers.

    Args:
        chain: the chain.
        placed: joints and markers in the world.
        away: (M, 3, F) metres, model minus recorded markers.
        weights: (M, F), 0 where not visible.
    Returns:
        The terms of each joint's body.
    """
    count, frames = len(chain.skeleton), weights.shape[-1]
    curvature, pull = np.zeros((count, 6, 6, frames)), np.zeros((count, 6, frames))
    for joint, own in chain.clusters:
        _add_points(curvature[joint], pull[joint], placed.markers[own], weights[own], away[own])
    return BodyTerms(curvature, pull)


def _add_points(curvature, pull, x, w, r) -> None:
    """Add points x (N, 3, F) of weights w (N, F), each r (N, 3, F) away from its target, in place."""
    wx, wr = w[:, None] * x, w[:, None] * r
    mass, first, force = w.sum(axis=0), wx.sum(axis=0), wr.sum(axis=0)
    second = np.einsum("naf,nbf->abf", wx, x)
    square = second[0, 0] + second[1, 1] + second[2, 2]
    # rotation block: sum of w (|x|^2 I - x x'), as a tensor of inertia
    curvature[:3, :3] -= second
    for axis in range(3):
        curvature[axis, axis] += square
        curvature[3 + axis, 3 + axis] += mass
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        # blocks between rotation and shift: the skew matrix of the weighted sum of places
        curvature[a, 3 + b] -= first[c]
        curvature[b, 3 + a] += first[c]
        curvature[3 + b, a] -= first[c]
        curvature[3 + a, b] += first[c]
    pull[:3] += cross(np.moveaxis(x, 1, 0), np.moveaxis(wr, 1, 0)).sum(axis=1)
    pull[3:] += force


def add_distance_terms(terms: BodyTerms, joint: int, x: np.ndarray, along: np.ndarray, weight, away, across) -> None:
    """Add the terms of a point that should keep a distance, in place.

    Args:
        terms: the terms to add to.
        joint: whose body the point belongs to.
        x: (3, F) metres, the point.
        along: (3, F) unit direction of the distance.
        weight: (F,).
        away: (F,) metres by which the point is too far along.
        across: (F,) weight at right angles, where the direction rotates with the point.
    """
    arm = np.zeros((3, 6, x.shape[-1]))
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        arm[b, a], arm[a, b] = -x[c], x[c]
        arm[a, 3 + a] = 1.0
    lever = np.einsum("af,acf->cf", along, arm)
    terms.curvature[joint] += np.einsum("af,bf,f->abf", lever, lever, weight - across)
    terms.curvature[joint] += np.einsum("caf,cbf,f->abf", arm, arm, across)
    terms.pull[joint] += lever * (weight * away)


def compute_gradient(chain: Chain, placed: WorldPoses, axes: np.ndarray, body_terms: BodyTerms,
                     joint_terms: JointTerms) -> np.ndarray:
    """Compute the derivative of half the cost by each joint's rotations.

    Args:
        chain: the chain.
        placed: joints in the world.
        axes: (J, 3, 3, F) of `compute_step_axes`.
        body_terms: the terms of the bodies.
        joint_terms: the terms of the joints.
    Returns:
        (J, 3, F).
    """
    total = body_terms.pull.copy()
    for joint in range(len(chain.skeleton) - 1, 0, -1):
        total[chain.skeleton.parents[joint]] += total[joint]
    # a rotation about axis a through p: a acts on the moment, p x a on the force
    moment = total[:, :3] - np.moveaxis(cross(np.moveaxis(placed.joints, 1, 0), np.moveaxis(total[:, 3:], 1, 0)), 0, 1)
    return joint_terms.pull + np.einsum("jacf,jaf->jcf", axes, moment)


def compute_second_derivatives(chain: Chain, placed: WorldPoses, axes: np.ndarray, away: np.ndarray,
                               weights: np.ndarray, share) -> SecondDerivatives:
    """Compute the second derivatives of half the weighted squared distances.

    Args:
        chain: the chain.
        placed: joints and markers in the world.
        axes: (J, 3, 3, F) of `compute_step_axes`.
        away: (M, 3, F) metres, model minus recorded markers.
        weights: (M, F).
        share: (F,) factor of the result.
    Returns:
        The second derivatives.
    """
    count, frames = len(chain.skeleton), weights.shape[-1]
    moment, force = np.zeros((count, 3, 3, frames)), np.zeros((count, 3, frames))
    weighted = (weights * share)[:, None] * away
    for joint, own in chain.clusters:
        np.einsum("naf,nbf->abf", placed.markers[own], weighted[own], out=moment[joint])
        np.sum(weighted[own], axis=0, out=force[joint])
    for joint in range(count - 1, 0, -1):
        moment[chain.skeleton.parents[joint]] += moment[joint]
        force[chain.skeleton.parents[joint]] += force[joint]
    # f . (a x (b x y)) = a . (y f' - (y . f) 1) b, with y from the joint
    moment -= placed.joints[:, :, None] * force[:, None]
    moment -= np.einsum("jaaf->jf", moment)[:, None, None] * np.eye(3)[:, :, None]
    above = np.einsum("jabf,jbcf->jacf", moment, axes)
    inner = np.einsum("jabf,jacf->jbcf", axes, above)
    for joint, all_ways in enumerate(chain.is_fully_free):
        if all_ways:
            inner[joint] = 0.5 * (inner[joint] + inner[joint].swapaxes(0, 1))
        else:  # of two angles of a hinge, the earlier carries the later
            for a, b in ((1, 0), (2, 0), (2, 1)):
                inner[joint, a, b] = inner[joint, b, a]
    return SecondDerivatives(inner, above)


def solve_step(chain: Chain, placed: WorldPoses, axes: np.ndarray, body_terms: BodyTerms, joint_terms: JointTerms,
               damping: np.ndarray, second_derivatives: SecondDerivatives | None = None) -> tuple[np.ndarray,
        np.ndarray]:
    """Solve one damped step.

    Args:
        chain: the chain.
        placed: joints in the world.
        axes: (J, 3, 3, F) of `compute_step_axes`.
        body_terms: the terms of the bodies; overwritten.
        joint_terms: the terms of the joints.
        damping: (F,) >= 0, added to the curvature of every rotation (and of the root's shift).
        second_derivatives: to add, or None.
    Returns:
        The root's shift (3, F) metres, and all joints' rotations (J, 3, F) radians about their axes.
    """
    parents = chain.skeleton.parents
    # inward pass, tips to root: eliminate each joint's rotations and add the remainder to its parent
    coupling, solutions = {}, {}
    for joint in range(len(parents) - 1, 0, -1):
        lever = np.concatenate([axes[joint], cross(placed.joints[joint][:, None], axes[joint])])
        share = np.einsum("abf,bcf->acf", body_terms.curvature[joint], lever)
        inner = np.einsum("abf,acf->bcf", lever, share) + joint_terms.curvature[joint]
        if second_derivatives is not None:
            inner += second_derivatives.inner[joint]
            share[:3] += second_derivatives.above[joint]
        _add_diagonal(inner, damping, chain.free[joint])
        right = joint_terms.pull[joint] + np.einsum("abf,af->bf", lever, body_terms.pull[joint])
        inverse = invert_symmetric(inner)
        coupling[joint] = np.einsum("acf,cbf->abf", share, inverse)
        solutions[joint] = np.einsum("abf,bf->af", inverse, right)
        body_terms.curvature[parents[joint]] += body_terms.curvature[joint] - np.einsum("acf,bcf->abf", coupling[joint],
                share)
        body_terms.pull[parents[joint]] += body_terms.pull[joint] - np.einsum("acf,cf->af", coupling[joint], right)
        solutions[joint] = (solutions[joint], lever)
    if second_derivatives is not None:
        body_terms.curvature[0][:3, :3] += second_derivatives.inner[0]
    # outward pass: the root's motion, then each joint's rotations given the motion above it
    motions = {0: _solve_root(body_terms, joint_terms, damping)}
    turns = np.empty((len(parents), 3, damping.shape[-1]))
    turns[0] = motions[0][:3]
    for joint in range(1, len(parents)):
        solution, lever = solutions[joint]
        above = motions[parents[joint]]
        turns[joint] = -solution - np.einsum("abf,af->bf", coupling[joint], above)
        motions[joint] = above + np.einsum("abf,bf->af", lever, turns[joint])
    return motions[0][3:], turns


def _add_diagonal(inner: np.ndarray, damping: np.ndarray, free: np.ndarray) -> None:
    """Damp (3, 3, F) in place; an axis that is not free gets 1, which makes its (zero) equation solvable."""
    for axis in range(3):
        inner[axis, axis] += damping if free[axis] else 1.0


def _solve_root(body_terms: BodyTerms, joint_terms: JointTerms, damping: np.ndarray) -> np.ndarray:
    """Solve rotation and shift (6, F) of the root."""
    curvature, pull = body_terms.curvature[0], body_terms.pull[0]
    curvature[:3, :3] += joint_terms.curvature[0]
    pull[:3] += joint_terms.pull[0]
    for axis in range(6):
        curvature[axis, axis] += damping
    return -np.linalg.solve(np.moveaxis(curvature, -1, 0), pull.T[..., None])[..., 0].T


def invert_symmetric(m: np.ndarray) -> np.ndarray:
    """Invert symmetric positive definite matrices (3, 3, F)."""
    out = np.empty_like(m)
    a, b, c, d, e, f = m[0, 0], m[0, 1], m[0, 2], m[1, 1], m[1, 2], m[2, 2]
    out[0, 0], out[1, 1], out[2, 2] = d * f - e * e, a * f - c * c, a * d - b * b
    out[0, 1] = out[1, 0] = c * e - b * f
    out[0, 2] = out[2, 0] = b * e - c * d
    out[1, 2] = out[2, 1] = b * c - a * e
    return out / (a * out[0, 0] + b * out[0, 1] + c * out[0, 2])
