"""Bodies that are in each other pushed apart: arms turned away, roots and feet shifted, all as smooth curves.

Each body has twelve curves (`correction`): its root's shift over the ground, its feet's, and the turns of its arms
about their shoulders. Round after round the contacts are looked for where the bodies are by now, and every body gives
its share of each (`giving`), a part of the way at a time, since what is changed here opens or closes contacts there.
Which way and how hard a contact presses is remembered from round to round (`pressure`, `sides`): each round's curves
are worked out anew from rest, and would let go of whatever is not pressed at any more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .capsules import Touching, touching
from .crowd_body import Contact, CrowdBody, moved
from .giving import BASE, Calm, given
from .pressure import Pressure, pressed
from .sides import sides, way_out

ALLOWED = 0.005
"""Metres of overlap that are left as they are."""

ROOM = 0.06
"""Metres between two capsules, more than ALLOWED lets them, up to which their contact is followed."""

INERTIA = 4.0
"""How much a metre of pressure counts for the side it pressed to, against a metre between two lines."""

_ROUNDS, _ARMS_ALONE = 24, 4
_STEP = 0.35
_LOOKED_OVER = 8  # rounds after which it is looked anew who is near
_CLOSE, _AROUND = 0.1, 4  # metres within which, and frames around which bodies are near


def pushed(
    bodies: Sequence[CrowdBody],
    pairs: Sequence[tuple[int, int]],
    curves: Sequence[np.ndarray],
    pressures: Sequence[Pressure],
    held,
    fps: float,
    first: int = 0,
) -> list[np.ndarray]:
    """The curves (T, 12) of each body with which these pairs are out of each other, as far as they can be.

    curves: those that they have already. pressures: of each pair, what its contacts have pressed with so far; changed.
    held: for each body whether its curves stay what they are at its first and at its last frame. The bodies lie on the
    same T frames, from frame `first` of the clock of the pressures on.
    """
    now = [np.array(values) for values in curves]
    calm = [Calm.of(body, own, ends, fps) for body, own, ends in zip(bodies, now, held)]
    for turn in range(_ROUNDS):
        placed = [moved(body, values) for body, values in zip(bodies, now)]
        if turn % _LOOKED_OVER == 0:
            near = [_near_frames(bodies, placed, pair) for pair in pairs]
        contacts = _contacts(bodies, placed, pairs, near, pressures, first, fps)
        for number, mine in enumerate(contacts):
            if len(mine.frame) and calm[number].count > 3:
                wanted = given(calm[number], mine, now[number], placed[number], turn >= _ARMS_ALONE, BASE / fps)
                now[number] = now[number] + _STEP * (wanted - now[number])
    return now


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
            rows[body].append(_share(found, sign * way, give, bodies, placed, (body, against), sign > 0.0))
    empty = (np.zeros(0, int),) * 2 + (np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0))
    return [Contact(*(np.concatenate(columns) for columns in zip(empty, *mine))) for mine in rows]


def _pressing(found: Touching, two, pressure: Pressure, first: int, fps: float) -> tuple:
    """The contacts of two bodies that press, which way (K, 3), unit, the one is pushed and how far (K,) m."""
    parts = two[0].shape[1] * two[1].shape[1]
    keys = (found.frame + first) * parts + found.one * two[1].shape[1] + found.other
    before, towards = pressure.pushes(keys)
    side = sides(found, INERTIA * before[:, None] * towards, fps)
    way, lack = way_out(found, side, _middle(two[0]) - _middle(two[1]), ALLOWED)
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


def _middle(lines: np.ndarray) -> np.ndarray:
    """(T, 3) m: the middle of the hips."""
    return lines[:, 0].mean(axis=1)
