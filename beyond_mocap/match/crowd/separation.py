"""Separate overlapping bodies: arms rotated away, roots and feet shifted, all as smooth curves.

Each body has twelve curves (`correction`): its root's horizontal shift, its feet's, and the rotations of its arms about
their shoulders. Every round finds the contacts at the bodies' current places and moves each body by its share of each
contact (`crowd_body.solve_curves`), only part of the way at a time, since a change here opens or closes contacts there.
The direction and pressure of each contact are remembered from round to round: each round solves its curves from rest,
and would release whatever no longer presses.

*Pressure:* bodies separate until their contacts are no longer found, and would fall back into each other in the next
round. So a contact keeps pressing until nothing falls back on it: with a missing distance d (negative where there is
room), a round changes its pressure p to max(0, p + PRESSURE_STEP d), and asks for d + p (the method of multipliers for
inequalities: Bertsekas 1982, Constrained Optimization and Lagrange Multiplier Methods, chapter 3).

*Direction:* the shortest separation reverses at the moment two lines cross: both bodies would be pushed one way before
it and the other way after it, and stay where they are. So they separate towards the side on which they pass each other
on average over some tenths of a second.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...base.vectors import unit_vectors
from .capsules import CapsuleContacts, find_capsule_contacts
from .crowd_body import BASE_FPS, BodyContacts, CrowdBody, SmoothnessTerms, move_capsules, solve_curves

ALLOWED_DEPTH = 0.005
"""m of overlap that is accepted."""

SEARCH_MARGIN = 0.06
"""m beyond the accepted overlap: closer capsules count as a contact."""

SIDE_INERTIA = 4.0
"""Weight of a metre of pressure for its side, relative to a metre between two lines."""

# Rounds in all, rounds in which contacts at arms move the arms alone, and the share of each step.
_ROUNDS, _ARM_ROUNDS = 24, 4
_STEP_SHARE = 0.35
_SEARCH_INTERVAL = 8  # rounds after which the close frames are found again
_NEAR_DISTANCE, _NEAR_FRAMES = 0.1, 4  # m within which, and frames around which bodies are close

SIDE_SECONDS = 0.2
"""s before and after a moment within which a contact counts for the side at that moment, with falling weight."""

TRUNK_WEIGHT = 2.0
"""Weight of the direction between two trunks, relative to the side on which two capsules pass."""

PRESSURE_STEP, MAX_PRESSURE = 0.2, 0.5
"""Share of the missing distance that becomes pressure each round, and the largest pressure, m: bodies that cannot be
separated are not thrown about."""


def solve_separation(
    bodies: Sequence[CrowdBody], pairs: Sequence[tuple[int, int]], curves: Sequence[np.ndarray],
    pressures: Sequence[Pressure], held_ends, fps: float, first: int = 0,
) -> list[np.ndarray]:  # fmt: skip
    """Solve the curves with which these pairs no longer overlap, where that is possible.

    Args:
        bodies: over the same T frames.
        pairs: indices of the bodies to separate.
        curves: (T, 12) per body, m and rad so far.
        pressures: the memory of each pair's contacts; changed in place.
        held_ends: per body, whether its curves keep their values at its first and last frame.
        fps: frames per second.
        first: frame of the pressures' clock of the bodies' frame 0.
    Returns:
        (T, 12) per body, m and rad.
    """
    solution = [np.array(values) for values in curves]
    smoothness = [SmoothnessTerms.from_body(body, own, ends, fps) for body, own,
                  ends in zip(bodies, solution, held_ends)]
    capsule_lines = [move_capsules(body, values) for body, values in zip(bodies, solution)]
    for number in range(_ROUNDS):
        if number % _SEARCH_INTERVAL == 0:
            near = [_find_near_frames(bodies, capsule_lines, pair) for pair in pairs]
        contacts = _find_contacts(bodies, capsule_lines, pairs, near=near, pressures=pressures, first=first, fps=fps)
        for body_index, body_contacts in enumerate(contacts):
            if len(body_contacts.frame) and smoothness[body_index].count > 3:
                target = solve_curves(smoothness[body_index], body_contacts, solution[body_index],
                                      capsule_lines=capsule_lines[body_index], arms_too=number >= _ARM_ROUNDS,
                                      weight=BASE_FPS / fps)
                solution[body_index] = solution[body_index] + _STEP_SHARE * (target - solution[body_index])
                capsule_lines[body_index] = move_capsules(bodies[body_index], solution[body_index])
    return solution


class Pressure:
    """The pressures of contacts known by whole numbers, and the sides they press to; 0 for all others.

    Attributes:
        keys: (K,) int, ascending.
        values: (K,) m.
        sides: (K, 3) unit vectors.
    """

    def __init__(self):
        self.keys, self.values, self.sides = np.zeros(0, int), np.zeros(0), np.zeros((0, 3))

    def find_pressures(self, keys: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Find the pressures (K,) m and sides (K, 3) of the contacts `keys` (K,)."""
        if not len(self.keys):
            return np.zeros(len(keys)), np.zeros((len(keys), 3))
        at = np.minimum(np.searchsorted(self.keys, keys), len(self.keys) - 1)
        return np.where(self.keys[at] == keys, self.values[at], 0.0), self.sides[at]

    def update_pressures(self, keys: np.ndarray, values: np.ndarray, sides: np.ndarray, span: tuple[int, int]) -> None:
        """Update the pressures of a span; other contacts in the span no longer press.

        Args:
            keys: (K,) unique numbers of contacts.
            values: (K,) m.
            sides: (K, 3) unit vectors.
            span: numbers from span[0] to below span[1].
        """
        order = np.argsort(keys, kind="stable")
        pressing = order[values[order] > 0.0]
        low, high = np.searchsorted(self.keys, span)
        for name, new in (("keys", keys), ("values", values), ("sides", sides)):
            old = getattr(self, name)
            setattr(self, name, np.concatenate([old[:low], new[pressing], old[high:]]))


def update_pressure(before: np.ndarray, missing: np.ndarray) -> np.ndarray:
    """Compute the new pressures (K,) m from the old (K,) m and the missing distances (K,) m."""
    return np.clip(before + PRESSURE_STEP * missing, 0.0, MAX_PRESSURE)


def compute_sides(found: CapsuleContacts, before: np.ndarray, fps: float) -> np.ndarray:
    """Compute the sides on which capsules pass each other.

    Args:
        found: K contacts.
        before: (K, 3) m, past pressure as a vector.
        fps: frames per second.
    Returns:
        (K, 3) unit vectors from the other to the one: the offset between the lines plus `before`, weighted over
        SIDE_SECONDS among contacts of the same two capsules.
    """
    reach = max(1, round(SIDE_SECONDS * fps))
    order = np.lexsort((found.frame, found.other, found.one))
    frame, one, other = found.frame[order], found.one[order], found.other[order]
    off = (_compute_offsets(found) + before)[order]
    total = np.array(off)
    # Sorted by capsule pair and frame, rows `step` apart are at most so many frames apart; add both ways.
    for step in range(1, min(reach, len(off))):
        gap = frame[step:] - frame[:-step]
        same = (one[step:] == one[:-step]) & (other[step:] == other[:-step])
        weight = np.where(same, np.maximum(1.0 - gap / reach, 0.0), 0.0)[:, None]
        total[step:] += weight * off[:-step]
        total[:-step] += weight * off[step:]
    out = np.empty_like(total)
    out[order] = unit_vectors(total)
    return out


def compute_separation(found: CapsuleContacts, side: np.ndarray, trunks: np.ndarray,
                       allowed: float) -> tuple[np.ndarray, np.ndarray]:
    """Compute in which direction and how far the one has to move.

    Args:
        found: K contacts.
        side: (K, 3) unit vectors, the sides on which they pass. They are turned towards the horizontal direction
            between the trunks, so that interlocked limbs come free.
        trunks: (T, 3) m from the other's trunk to the one's.
        allowed: m of overlap that may remain.
    Returns:
        Directions (K, 3), unit, and distances (K,) m, negative where there is room.
    """
    out = trunks[found.frame] * np.array([1.0, 1.0, 0.0])
    direction = unit_vectors(side + TRUNK_WEIGHT * unit_vectors(out))
    offset = _compute_offsets(found)
    along = np.einsum("kc,kc->k", direction, offset)
    # Solve |offset + distance * direction| = radii - allowed for the distance.
    square = along**2 + (found.radii - allowed) ** 2 - np.einsum("kc,kc->k", offset, offset)
    return direction, np.sqrt(np.maximum(square, 0.0)) - along


def _find_near_frames(bodies, capsule_lines, pair: tuple[int, int]) -> np.ndarray:
    """Find the frames at which two bodies are within _NEAR_DISTANCE, and _NEAR_FRAMES around them."""
    one, other = pair
    found = find_capsule_contacts(capsule_lines[one], capsule_lines[other], (bodies[one].radii, bodies[other].radii),
                                  -_NEAR_DISTANCE).frame
    near = np.zeros(len(capsule_lines[pair[0]]) + 2 * _NEAR_FRAMES, bool)
    for step in range(2 * _NEAR_FRAMES + 1):
        near[found + step] = True
    return np.flatnonzero(near[_NEAR_FRAMES:-_NEAR_FRAMES])


def _find_contacts(bodies, capsule_lines, pairs, near, pressures, first: int, fps: float) -> list[BodyContacts]:
    """Find the contacts of every body with all others, at the frames `near` of each pair."""
    rows: list[list[tuple]] = [[] for _ in bodies]
    for (one, other), frames, pressure in zip(pairs, near, pressures):
        two = capsule_lines[one], capsule_lines[other]
        radii = bodies[one].radii, bodies[other].radii
        found = find_capsule_contacts(two[0][frames], two[1][frames], radii, ALLOWED_DEPTH - SEARCH_MARGIN)
        found = replace(found, frame=frames[found.frame])
        found, direction, distance = _select_pressing(found, two, pressure, first, fps)
        for body, against, sign in ((one, other, 1.0), (other, one, -1.0)):
            rows[body].append(_build_body_contacts(found, sign * direction, distance, bodies=bodies,
                                                   capsule_lines=capsule_lines, pair=(body, against), is_one=sign
                                                   > 0.0))
    empty = (np.zeros(0, int),) * 2 + (np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0))
    return [BodyContacts(*(np.concatenate(columns) for columns in zip(empty, *mine))) for mine in rows]


def _select_pressing(found: CapsuleContacts, two, pressure: Pressure, first: int, fps: float) -> tuple:
    """Select the contacts of two bodies that press; return them, directions (K, 3) and distances (K,) m."""
    parts = two[0].shape[1] * two[1].shape[1]
    # One number per (frame, capsule, capsule), ascending with the frame.
    keys = (found.frame + first) * parts + found.one * two[1].shape[1] + found.other
    before, towards = pressure.find_pressures(keys)
    side = compute_sides(found, SIDE_INERTIA * before[:, None] * towards, fps)
    trunks = two[0][:, 0].mean(axis=1) - two[1][:, 0].mean(axis=1)  # between the middles of the hips
    direction, missing = compute_separation(found, side, trunks, ALLOWED_DEPTH)
    new_pressure = update_pressure(before, missing)
    pressure.update_pressures(keys, new_pressure, side, (first * parts, (first + len(two[0])) * parts))
    pressing = np.flatnonzero(missing + new_pressure > 0.0)
    return found.select_rows(pressing), direction[pressing], (missing + new_pressure)[pressing]


def _build_body_contacts(found: CapsuleContacts, direction, distance, bodies, capsule_lines, pair: tuple[int, int],
                         is_one: bool) -> tuple:
    """Build the columns of `BodyContacts` for one body of a pair.

    is_one: whether the body is the contacts' `one`; direction (K, 3) and distance (K,) m: where to and how far both
    have to separate.
    """
    body, other_body = pair
    part, other_part = (found.one, found.other) if is_one else (found.other, found.one)
    at = found.share_one if is_one else found.share_other
    ends = capsule_lines[body][found.frame, part]
    place = ends[:, 0] + at[:, None] * (ends[:, 1] - ends[:, 0])
    # The firmer body moves less. An arm alone takes the whole distance, two arms half each.
    firm = [bodies[number].firmness[found.frame] for number in pair]
    arms = [np.array([p.limb == "arm" for p in bodies[n].parts])[c] for n,
            c in ((body, part), (other_body, other_part))]
    arm = distance * np.where(arms[0], np.where(arms[1], 0.5, 1.0), 0.0)
    return found.frame, part, at, place, direction, distance * firm[1] / (firm[0] + firm[1]), arm


def _compute_offsets(found: CapsuleContacts) -> np.ndarray:
    """Compute the vectors (K, 3) m from the other's line to the one's."""
    return found.direction * (found.radii - found.depth)[:, None]
