"""A football player that fits any humanoid skeleton: one skinned surface in kit and boots, with hair.

The body is sculpted once (`sculpt`), stored as a template, and fitted here: its parts follow the skeleton's bones in a
stance with lifted arms (`fit`), and then move to the skeleton's rest pose. Proportions are those of an athlete of
1.80 m, scaled with the skeleton and varied by build.
"""

from __future__ import annotations

import numpy as np

from ..motion import quaternion
from ..motion.humanoid import Humanoid, identify_joints
from ..motion.motion import Motion
from ..motion.retargeting.adult import ADULT_LEG
from ..motion.retargeting.neutral import NeutralStance
from ..motion.skeleton import Skeleton, freeze_array
from .fit import fit_template
from .landmarks import SEGMENTS
from .look import BUILDS, HAIR_STYLES, Look
from .mesh import GLOVES, SHIRT, SKIN, BodyMesh, blend_joints
from .stance import build_lifted_stance
from .template import Template, read_template

_MOST_JOINTS = 4  # that a vertex follows
_LEAST_ALIKE = np.cos(np.radians(55.0))  # half of the largest angle between rest poses of joints that share a vertex
_HELD_BY_TRUNK = 0.2  # share of the trunk from which parted cloth stays with it: .5 still bares slits above the hem


def build_body(skeleton: Skeleton, height: float | None = None, example: Motion | None = None,
               look: Look = Look(), *, light: bool = False) -> BodyMesh:
    """Build a player's body for a skeleton.

    The face looks ahead as in the rest pose if that stands upright.

    Args:
        skeleton: a humanoid skeleton, J joints.
        height: stature in metres for the girths; None derives it from the legs' length.
        example: any recording on the skeleton; it shows how bones are twisted if the rest pose does not stand. Without
            it, feet and hands of such skeletons may be rotated (see `neutral.build_neutral_stance`).
        look: build, hair and gloves; colours are up to the caller.
        light: about 2,000 faces in place of 14,000.
    Returns:
        The mesh.
    Raises:
        InputError: if the skeleton has no hips or legs.
    """
    stance = build_lifted_stance(skeleton, example)
    scale = stance.leg / ADULT_LEG if height is None else height / 1.80
    template = read_template(light)
    shown = np.isin(template.parts, (0, 1 + HAIR_STYLES.index(look.hair)))
    used, faces = np.unique(template.faces[shown], return_inverse=True)
    used, faces = (used[1:], faces.reshape(-1, 4) - 1) if used[0] < 0 else (used, faces.reshape(-1, 4))
    vertices = fit_template(template, stance, scale, BUILDS[look.build])[used]
    materials = np.array(template.materials[shown])
    if look.gloves:
        vertices = _put_gloves_on(vertices, faces, scale * template.gloves[used])
        materials[(materials == SKIN) & np.all(template.gloves[used][faces] > 0.0, axis=1)] = GLOVES
    joints, weights = _distribute_weights(template, used, stance, vertices[:, 2])
    weights = _part_opposed_joints(stance, joints, weights)
    rest = _move_to_rest(stance, vertices, joints, weights)
    corners = tuple(tuple(row[:3] if row[3] < 0 else row) for row in faces.tolist())
    return BodyMesh(freeze_array(rest), corners, freeze_array(joints, int), freeze_array(weights),
                    material=freeze_array(materials, int), sculpted=freeze_array(template.vertices[used]))


def _put_gloves_on(vertices: np.ndarray, faces: np.ndarray, thickness: np.ndarray) -> np.ndarray:
    """Move vertices (V, 3) m out by `thickness` (V,) m."""
    quads = faces[np.all(thickness[faces] > 0.0, axis=1)]
    last = np.where(quads[:, 3] < 0, quads[:, 2], quads[:, 3])
    normal = np.cross(vertices[quads[:, 2]] - vertices[quads[:, 0]], vertices[last] - vertices[quads[:, 1]])
    total = np.zeros_like(vertices)
    for corner in range(4):
        np.add.at(total, np.where(quads[:, corner] < 0, quads[:, 2], quads[:, corner]), normal)
    total /= np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)
    return vertices + thickness[:, None] * total


def _distribute_weights(template: Template, used: np.ndarray, stance: NeutralStance,
                        heights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distribute the template's shares of `used` vertices, `heights` (V,) m high, among the skeleton's joints.

    Returns:
        Joints and weights (V, K), see `BodyMesh`.
    """
    body = identify_joints(stance.skeleton)
    dense = np.zeros((len(used), len(stance.skeleton)))
    segments, shares = _keep_hem_whole(template, stance, body)[used], template.shares[used]
    for index, name in enumerate(SEGMENTS):
        share = np.sum(np.where(segments == index, shares, 0.0), axis=1)
        if name == "trunk":
            low, high, upper = find_spine_joints(stance, body, heights)
            rows = np.arange(len(used))
            np.add.at(dense, (rows, low), share * (1.0 - upper))
            np.add.at(dense, (rows, high), share * upper)
        else:
            dense[:, _find_joint(body, name)] += share
    order = np.argsort(-dense, axis=1, kind="stable")[:, :_MOST_JOINTS]
    largest = np.take_along_axis(dense, order, axis=1)
    return order, largest / largest.sum(axis=1, keepdims=True)


def _keep_hem_whole(template: Template, stance: NeutralStance, body: Humanoid) -> np.ndarray:
    """Return the template's segments with the trunk for the thighs on the shirt, and where the trunk has a good share.

    Only for skeletons whose thighs rest opposite to the hips: their vertices are parted (`_part_opposed_joints`), and a
    shirt parted along the groin tears with each long step. Thighs show in front of its hem instead.
    """
    if _measure_likeness(stance, np.array([body.left.upper_leg, body.right.upper_leg]), body.hips).min() > _LEAST_ALIKE:
        return template.segments
    thighs = np.isin(template.segments, [SEGMENTS.index(f"upper_leg_{side}") for side in ("left", "right")])
    trunk = template.segments == SEGMENTS.index("trunk")
    shared = np.sum(np.where(trunk, template.shares, 0.0), axis=1) > _HELD_BY_TRUNK
    shirt = template.faces[template.materials == SHIRT]
    shared[shirt[shirt >= 0]] = True
    return np.where(shared[:, None] & thighs, SEGMENTS.index("trunk"), template.segments)


def _find_joint(body: Humanoid, segment: str) -> int:
    """Find the joint that a segment other than the trunk follows, the next one inwards where it is missing."""
    part, _, side = segment.rpartition("_")
    if not part:
        return body.head_or_neck if side == "head" else body.neck_or_chest
    limb = getattr(body, side)
    inwards = {"shoulder": ("shoulder",), "upper_arm": ("upper_arm", "shoulder"),
               "lower_arm": ("lower_arm", "upper_arm", "shoulder"), "toe": ("toe", "foot"),
               "hand": ("hand", "lower_arm", "upper_arm", "shoulder")}.get(part, (part,))
    found = (getattr(limb, name) for name in inwards)
    return next((joint for joint in found if joint is not None), body.chest)


def find_spine_joints(stance: NeutralStance, body: Humanoid,
                       heights: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find which two joints of the spine points follow: half and half at a joint, one joint between.

    Args:
        stance: with lifted arms.
        body: its joints.
        heights: (V,) m above the ground.
    Returns:
        Lower joints, upper joints, shares of the upper ones (V,).
    """
    chain = [body.hips]
    for joint in body.spine:
        if stance.positions[joint, 2] > stance.positions[chain[-1], 2] + 0.02:
            chain.append(joint)
    levels = stance.positions[chain[1:], 2]
    position = np.interp(heights, *_compute_midpoints(levels)) if len(levels) else np.zeros(len(heights))
    low = np.clip(np.floor(position).astype(int), 0, max(len(chain) - 2, 0))
    high = np.minimum(low + 1, len(chain) - 1)
    joints = np.array(chain)
    return joints[low], joints[high], np.clip(position - low, 0.0, 1.0)


def _compute_midpoints(levels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute heights and positions in a chain such that a joint's height is half way between it and the one below it.
    """
    middles = 0.5 * (levels[1:] + levels[:-1])
    heights = np.concatenate([[levels[0] - 0.08], middles, [levels[-1] + 0.08]])
    return heights, np.arange(len(heights), dtype=float)


def _part_opposed_joints(stance: NeutralStance, joints: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Leave a vertex to its first joint where the skeleton rests with the others turned too far from it.

    Blends of joints that rest almost opposite to how they stand would flip while they bend.
    """
    kept = np.where(_measure_likeness(stance, joints, joints[:, :1]) > _LEAST_ALIKE, weights, 0.0)
    return kept / kept.sum(axis=1, keepdims=True)


def _measure_likeness(stance: NeutralStance, joints: np.ndarray, others: np.ndarray | int) -> np.ndarray:
    """Measure how alike joints (...,) rest as others: the cosine of half the angle between their rotations."""
    return np.abs(np.sum(stance.rotations[joints] * stance.rotations[others], axis=-1))


def _move_to_rest(stance: NeutralStance, vertices: np.ndarray, joints: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Compute the rest positions (V, 3) m of vertices (V, 3) m given in the stance: inverse skinning."""
    pose = stance.positions, stance.rotations
    turn, shift = blend_joints(stance.skeleton.rest_positions, pose, joints, weights)
    return quaternion.rotate(quaternion.inverse(turn), vertices - shift)
