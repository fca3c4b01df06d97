"""Legs, arms, neck and head in a tree of joints without useful names: two similar limbs that hang on one joint.

Limbs come in pairs whose bones have equal lengths. The two longest pairs are legs and arms; the legs hang nearer to the
root. Left and right follow from the poses: toes point forward and knees bend backward, and left is up x forward.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations

import numpy as np

from ...base.vectors import unit_vectors

_ALIKE = 0.15  # relative difference of two bones that count as left and right
_SHORTEST = 0.3  # least length of a pair (upper plus lower bones), share of the longest pair
_NEARLY_EQUAL = 0.6
_MIN_VOTE = 1e-2


def find_roles(parents: Sequence[int], places: np.ndarray, tips: np.ndarray) -> dict[str, int] | None:
    """Find the roles of joints from poses.

    Args:
        parents: J indices, -1 for the root.
        places: (T, J, 3) metres.
        tips: (T, J, 3) where each joint's bone ends, the joint itself where unknown; shows how toeless feet point.
    Returns:
        Roles ("left upper_leg", ...) -> joint; None if no pair of legs is found.
    """
    lengths = np.array([np.linalg.norm(places[0, j] - places[0, p]) if p >= 0 else 0.0 for j, p in enumerate(parents)])
    pairs = _find_limb_pairs(list(parents), lengths)
    if not pairs:
        return None
    legs, arms = _split_legs_and_arms(parents, pairs)
    left, right = _order_sides(legs, places, tips, parents, arms)
    roles = {"hips": find_common_ancestor(parents, [left[0], right[0]])}
    across = places[:, left[0]] - places[:, right[0]]
    for side, leg in (("left", left), ("right", right)):
        toe = _find_toe(parents, lengths, leg[2])
        roles |= {f"{side} {part}": j for part, j in zip(("upper_leg", "lower_leg", "foot"), leg)}
        roles |= {f"{side} toe": toe} if toe is not None else {}
    if arms is not None:
        apart = places[:, arms[0][0]] - places[:, arms[1][0]]
        ordered = arms if np.sum(apart * across) >= 0.0 else arms[::-1]
        chest = find_common_ancestor(parents, [arms[0][0], arms[1][0]])
        for side, arm in zip(("left", "right"), ordered):
            roles |= {f"{side} {part}": j for part, j in zip(("upper_arm", "lower_arm", "hand"), arm)}
            if parents[arm[0]] != chest:
                roles[f"{side} shoulder"] = parents[arm[0]]
    return roles


def _find_limb_pairs(parents, lengths) -> list[tuple[tuple[int, ...], tuple[int, ...]]]:
    """Find pairs of limbs (upper, middle, end joint) that hang on one joint and are alike, longest first."""
    onward, found = _find_longest_branches(parents, lengths), []
    for joint in {p for p in parents if parents.count(p) > 1 and p >= 0}:
        limbs = [limb for child in list_children(parents, joint) if (limb := _find_limb(lengths, onward, child))]
        for a, b in combinations(limbs, 2):
            sizes = np.array([[lengths[limb[1]], lengths[limb[2]]] for limb in (a, b)])
            if np.all(np.abs(sizes[0] - sizes[1]) <= _ALIKE * sizes.max(axis=0)):
                found.append((float(sizes.sum()), joint, (a, b)))
    found.sort(key=lambda one: (-one[0], one[1]))
    longest = found[0][0] if found else 0.0
    return [pair for size, _, pair in found if size > _SHORTEST * longest and size > 1e-6]


def _find_longest_branches(parents, lengths) -> list[int]:
    """Find for each joint the child towards its farthest end, -1 at an end."""
    reach, onward = np.zeros(len(parents)), [-1] * len(parents)
    # children come after their parents, so going backwards every joint's own reach is complete when its parent needs it
    for joint in range(len(parents) - 1, 0, -1):
        if onward[parents[joint]] < 0 or reach[joint] + lengths[joint] >= reach[parents[joint]]:
            reach[parents[joint]] = reach[joint] + lengths[joint]
            onward[parents[joint]] = joint
    return onward


def _find_limb(lengths, onward, start: int) -> tuple[int, ...] | None:
    """Find the three joints around the two longest consecutive bones from `start` to its farthest end."""
    chain = [start]
    while onward[chain[-1]] >= 0:
        chain.append(onward[chain[-1]])
    if len(chain) < 3:
        return None
    shorter = [min(lengths[chain[i + 1]], lengths[chain[i + 2]]) for i in range(len(chain) - 2)]
    # the last such pair: a long collar bone comes before the arm, hands and toes are much shorter than their limb
    best = max(i for i, length in enumerate(shorter) if length >= _NEARLY_EQUAL * max(shorter))
    return tuple(chain[best : best + 3])


def _split_legs_and_arms(parents, pairs):
    """Split the longest two pairs without a common joint into legs (nearer to the root) and arms, or None."""
    first = pairs[0]
    taken = {j for limb in first for j in limb}
    second = next((pair for pair in pairs[1:] if not taken & {j for limb in pair for j in limb}), None)
    if second is None:
        return first, None
    depth = [len(list_ancestors(parents, find_common_ancestor(parents, [pair[0][0], pair[1][0]])))
             for pair in (first, second)]
    return (first, second) if depth[0] <= depth[1] else (second, first)


def _order_sides(legs, places, tips, parents, arms):
    """Order the pair of legs as (left, right): by feet that point forward and knees that bend backward, else as is."""
    a, b = legs
    hips = 0.5 * (places[:, a[0]] + places[:, b[0]])
    ends = [arm[0] for arm in arms] if arms is not None else [0]
    up = unit_vectors(places[:, ends].mean(axis=1) - hips) if arms is not None else np.array([0.0, 0.0, 1.0])
    across = unit_vectors(places[:, a[0]] - places[:, b[0]])
    vote = 0.0
    for leg in (a, b):
        thigh, shank = (unit_vectors(places[:, leg[i + 1]] - places[:, leg[i]]) for i in (0, 1))
        vote += np.mean(np.sum(np.cross(thigh, shank) * across, axis=1))
        toes = list_children(parents, leg[2])
        ends = places[:, toes].mean(axis=1) if toes else tips[:, leg[2]]
        vote += np.mean(np.sum(np.cross(up, unit_vectors(ends - places[:, leg[2]])) * across, axis=1))
    return (a, b) if vote > -_MIN_VOTE else (b, a)


def _find_toe(parents, lengths, foot: int) -> int | None:
    """Find the joint of the longest bone that hangs on the foot."""
    return max(list_children(parents, foot), key=lambda j: lengths[j], default=None)


def find_neck_and_head(parents, chest: int, used: set[int], roles: Mapping[str, int]) -> dict[str, int]:
    """Find "neck" and "head" on the longest chain that hangs on the chest and is no limb; those in `roles` stay."""
    if "neck" in roles:
        chain = _list_chain(parents, roles["neck"])
    else:
        limbs = {joint for limb in used if limb != chest for joint in list_ancestors(parents, limb)}
        free = [_list_chain(parents, child) for child in list_children(parents, chest) if child not in limbs]
        chain = max(free, key=len, default=[]) if "head" not in roles else []
    found = {"neck": chain[0]} if chain else {}
    return {**found, "head": chain[-1]} if len(chain) > 1 else found


def _list_chain(parents, start: int) -> list[int]:
    """List `start` and the joints below it as long as there is only one child."""
    chain = [start]
    while len(list_children(parents, chain[-1])) == 1:
        chain += list_children(parents, chain[-1])
    return chain


def find_mirror_joints(parents, pairs: Iterable[tuple[int, int]]) -> tuple[int, ...]:
    """Find for each joint the one on the other side: of `pairs`, of their ancestors up to the common one, and, child by
    child, of their descendants.
    """
    out = list(range(len(parents)))
    pairs = [(a, b) for pair in pairs for a,
             b in zip(list_ancestors(parents, pair[0]), list_ancestors(parents, pair[1])) if a != b]
    known = {joint for pair in pairs for joint in pair}
    while pairs:
        a, b = pairs.pop()
        out[a], out[b] = b, a
        rest = [[child for child in list_children(parents, joint) if child not in known] for joint in (a, b)]
        if len(rest[0]) == len(rest[1]):
            pairs += zip(*rest)
    return tuple(out)


def list_children(parents, joint: int) -> list[int]:
    """List the joints that hang on `joint`."""
    return [i for i, p in enumerate(parents) if p == joint]


def list_ancestors(parents, joint: int) -> list[int]:
    """List the joints from `joint` up to the root, both included."""
    found = []
    while joint >= 0:
        found.append(joint)
        joint = parents[joint]
    return found


def list_between(parents, low: int, high: int) -> list[int]:
    """List the joints strictly between `low` and `high`, from below; empty where `high` does not hang on `low`."""
    chain = list_ancestors(parents, high)
    return chain[1 : chain.index(low)][::-1] if low in chain else []


def list_descendants(parents, joint: int) -> list[int]:
    """List `joint` and everything that hangs on it."""
    found = {joint}
    for other, parent in enumerate(parents):
        if parent in found:
            found.add(other)
    return sorted(found)


def find_common_ancestor(parents, joints: Sequence[int]) -> int:
    """Find the lowest joint that all of `joints` hang on, or that is one of them."""
    shared = set(list_ancestors(parents, joints[0])).intersection(*(list_ancestors(parents, j) for j in joints[1:]))
    return max(shared, key=lambda j: len(list_ancestors(parents, j)))
