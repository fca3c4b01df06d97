"""Bodies that are in each other pushed apart: arms turned away, roots and feet shifted, all as smooth curves.

Each body has twelve curves (`correction`): its root's shift over the ground, its feet's, and the turns of its arms
about their shoulders. Round after round the contacts are looked for where the bodies are by now, and every body gives
its share of each (`crowd_body.solve_curves`), a part of the way at a time, since what is changed here opens or closes
contacts there. Which way and how hard a contact presses is remembered from round to round: each round's curves are
worked out from rest, and would let go of whatever is not pressed at any more.

*How hard:* bodies come apart to where contacts are no longer found, and would fall back into each other in the next
round. So a contact goes on pressing until nothing falls back on it: with a lack d of distance (negative where there is
room), a round turns its pressure p into max(0, p + PRESSURE_STEP d), and asks for d + p (the method of multipliers for
inequalities: Bertsekas 1982, Constrained Optimization and Lagrange Multiplier Methods, ch. 3).

*Which way:* the shortest way apart turns round at the moment at which two lines cross: pushed by it, both would be
pushed the one way before and the other way after, and stay where they are. So they part on the side on which they miss
each other on the whole, over some tenths of a second.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...base.vectors import unit_vectors
from .capsules import Touching, touching
from .crowd_body import BASE, Calm, Contact, CrowdBody, moved, solve_curves

ALLOWED = 0.005
"""Metres of overlap that are left as they are."""

ROOM = 0.06
"""Metres between two capsules, more than ALLOWED lets them, up to which their contact is followed."""

INERTIA = 4.0
"""How much a metre of pressure counts for the side it pressed to, against a metre between two lines."""

_ROUNDS, _ARMS_ALONE = 24, 4
_STEP = 0.35
_LOOKED_OVER = 8  # rounds after which it is looked up again who is near
_CLOSE, _AROUND = 0.1, 4  # metres within which, and frames around which bodies are near

SIDE_SECONDS = 0.2
"""Seconds before and behind a moment within which a contact counts for the side at that moment, less the farther."""

OUTWARD = 2.0
"""How much the way between two trunks counts against the side on which two capsules pass."""

PRESSURE_STEP, MOST_PRESSURE = 0.2, 0.5
"""Share of what lacks that a contact presses with from then on, and metres that it presses with at most: bodies that
cannot get apart are not thrown about."""


def pushed(
    bodies: Sequence[CrowdBody], pairs: Sequence[tuple[int, int]], curves: Sequence[np.ndarray],
    pressures: Sequence[Pressure], held, fps: float, first: int = 0,
) -> list[np.ndarray]:  # fmt: skip
    """The curves (T, 12) of each body with which these pairs are out of each other, as far as they can be.

    curves: those that they have already. pressures: of each pair, what its contacts have pressed with so far; changed.
    held: for each body whether its curves stay what they are at its first and at its last frame. The bodies lie on the
    same T frames, from frame `first` of the clock of the pressures on."""
    now = [np.array(values) for values in curves]
    calm = [Calm.of(body, own, ends, fps) for body, own, ends in zip(bodies, now, held)]
    for turn in range(_ROUNDS):
        placed = [moved(body, values) for body, values in zip(bodies, now)]
        if turn % _LOOKED_OVER == 0:
            near = [_near_frames(bodies, placed, pair) for pair in pairs]
        contacts = _contacts(bodies, placed, pairs, near=near, pressures=pressures, first=first, fps=fps)
        for number, mine in enumerate(contacts):
            if len(mine.frame) and calm[number].count > 3:
                wanted = solve_curves(calm[number], mine, now[number], placed=placed[number],
                                      arms_too=turn >= _ARMS_ALONE, weight=BASE / fps)
                now[number] = now[number] + _STEP * (wanted - now[number])
    return now


class Pressure:
    """The pressures (K,) m of contacts that are known by whole numbers, and the sides (K, 3) to which the one is pushed
    out of the other; 0 for all others."""

    def __init__(self):
        self.keys, self.values, self.sides = np.zeros(0, int), np.zeros(0), np.zeros((0, 3))

    def pushes(self, keys: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What contacts `keys` (K,) have pressed with so far: (K,) m and to which side (K, 3) unit."""
        if not len(self.keys):
            return np.zeros(len(keys)), np.zeros((len(keys), 3))
        at = np.minimum(np.searchsorted(self.keys, keys), len(self.keys) - 1)
        return np.where(self.keys[at] == keys, self.values[at], 0.0), self.sides[at]

    def keep(self, keys: np.ndarray, values: np.ndarray, sides: np.ndarray, span: tuple[int, int]) -> None:
        """Contacts `keys` (K,), no number twice, press with `values` (K,) m to the sides (K, 3) from now on; all others
        with numbers from span[0] to below span[1] press no more."""
        order = np.argsort(keys, kind="stable")
        kept = order[values[order] > 0.0]
        low, high = np.searchsorted(self.keys, span)
        for name, new in (("keys", keys), ("values", values), ("sides", sides)):
            old = getattr(self, name)
            setattr(self, name, np.concatenate([old[:low], new[kept], old[high:]]))


def pressed(before: np.ndarray, lack: np.ndarray) -> np.ndarray:
    """(K,) m that contacts press with which pressed with `before` (K,) m and lack `lack` (K,) m of distance."""
    return np.clip(before + PRESSURE_STEP * lack, 0.0, MOST_PRESSURE)


def sides(found: Touching, before: np.ndarray, fps: float) -> np.ndarray:
    """(K, 3) unit vectors from the other to the one: the way from line to line plus `before` (K, 3) m, weighed over
    SIDE_SECONDS around each contact among contacts of the same two capsules."""
    reach = max(1, round(SIDE_SECONDS * fps))
    order = np.lexsort((found.frame, found.other, found.one))
    frame, one, other = found.frame[order], found.one[order], found.other[order]
    off = (_off(found) + before)[order]
    total = np.array(off)
    for step in range(1, min(reach, len(off))):
        apart = frame[step:] - frame[:-step]
        same = (one[step:] == one[:-step]) & (other[step:] == other[:-step])
        weight = np.where(same, np.maximum(1.0 - apart / reach, 0.0), 0.0)[:, None]
        total[step:] += weight * off[:-step]
        total[:-step] += weight * off[step:]
    out = np.empty_like(total)
    out[order] = unit_vectors(total)
    return out


def way_out(found: Touching, side: np.ndarray, trunks: np.ndarray, allowed: float) -> tuple[np.ndarray, np.ndarray]:
    """Which way (K, 3), unit, the one leaves the other by, and how far (K,) m until they are `allowed` m in each other,
    negative where there is room. side (K, 3): on which they pass, turned towards the way over the ground from the
    other's trunk to the one's, trunks (T, 3) m, so that limbs that have caught each other come free."""
    out = trunks[found.frame] * np.array([1.0, 1.0, 0.0])
    way = unit_vectors(side + OUTWARD * unit_vectors(out))
    off = _off(found)
    along = np.einsum("kc,kc->k", way, off)
    square = along**2 + (found.radii - allowed) ** 2 - np.einsum("kc,kc->k", off, off)
    return way, np.sqrt(np.maximum(square, 0.0)) - along


def _near_frames(bodies, placed, pair: tuple[int, int]) -> np.ndarray:
    """The frames at which two bodies are within _CLOSE of each other, and _AROUND before and behind."""
    one, other = pair
    found = touching(placed[one], placed[other], (bodies[one].radii, bodies[other].radii), -_CLOSE).frame
    near = np.zeros(len(placed[pair[0]]) + 2 * _AROUND, bool)
    for step in range(2 * _AROUND + 1):
        near[found + step] = True
    return np.flatnonzero(near[_AROUND:-_AROUND])


def _contacts(bodies, placed, pairs, near, pressures, first: int, fps: float) -> list[Contact]:
    """The contacts of every body with all others, of each pair at the frames `near`."""
    rows: list[list[tuple]] = [[] for _ in bodies]
    for (one, other), frames, pressure in zip(pairs, near, pressures):
        two = placed[one], placed[other]
        radii = bodies[one].radii, bodies[other].radii
        found = touching(two[0][frames], two[1][frames], radii, ALLOWED - ROOM)
        found = replace(found, frame=frames[found.frame])
        found, way, give = _pressing(found, two, pressure, first, fps)
        for body, against, sign in ((one, other, 1.0), (other, one, -1.0)):
            rows[body].append(_share(found, sign * way, give, bodies=bodies, placed=placed, pair=(body, against),
                                     is_one=sign > 0.0))
    empty = (np.zeros(0, int),) * 2 + (np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0))
    return [Contact(*(np.concatenate(columns) for columns in zip(empty, *mine))) for mine in rows]


def _pressing(found: Touching, two, pressure: Pressure, first: int, fps: float) -> tuple:
    """The contacts of two bodies that press, which way (K, 3), unit, the one is pushed and how far (K,) m."""
    parts = two[0].shape[1] * two[1].shape[1]
    keys = (found.frame + first) * parts + found.one * two[1].shape[1] + found.other
    before, towards = pressure.pushes(keys)
    side = sides(found, INERTIA * before[:, None] * towards, fps)
    trunks = two[0][:, 0].mean(axis=1) - two[1][:, 0].mean(axis=1)  # by the middle of the hips
    way, lack = way_out(found, side, trunks, ALLOWED)
    now = pressed(before, lack)
    pressure.keep(keys, now, side, (first * parts, (first + len(two[0])) * parts))
    pressing = np.flatnonzero(lack + now > 0.0)
    return found.rows(pressing), way[pressing], (lack + now)[pressing]


def _share(found: Touching, way, give, bodies, placed, pair: tuple[int, int], is_one: bool) -> tuple:
    """What one of a pair, of whom is_one tells whether it is the contacts' one, has of them, as columns of `Contact`;
    way (K, 3) and give (K,) m: where to and how far both have to part."""
    body, against = pair
    part, beside = (found.one, found.other) if is_one else (found.other, found.one)
    at = found.at_one if is_one else found.at_other
    ends = placed[body][found.frame, part]
    place = ends[:, 0] + at[:, None] * (ends[:, 1] - ends[:, 0])
    firm = [bodies[number].firm[found.frame] for number in pair]
    arms = [np.array([p.limb == "arm" for p in bodies[n].parts])[c] for n, c in ((body, part), (against, beside))]
    arm = give * np.where(arms[0], np.where(arms[1], 0.5, 1.0), 0.0)
    return found.frame, part, at, place, way, give * firm[1] / (firm[0] + firm[1]), arm


def _off(found: Touching) -> np.ndarray:
    """(K, 3) m from the other's line to the one's."""
    return found.away * (found.radii - found.depth)[:, None]
