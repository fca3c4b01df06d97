"""Bodies that are in each other pushed apart: arms turned away, roots and feet shifted, all as smooth curves.

Each body has twelve curves (`correction`): its root's shift over the ground, its feet's, and the turns of its arms
about their shoulders. Round after round the contacts are looked for where the bodies are by now, and every body gives
its share of each (`giving`), half of the way at a time, since what is changed here opens or closes contacts there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from .capsules import Touching, touching
from .crowd_body import Contact, CrowdBody, moved
from .giving import BASE, Calm, given
from .pressure import Pressure
from .sides import sides

ALLOWED = 0.005
"""Metres of overlap that are left as they are."""

MARGIN = 0.03
"""Metres of room between capsules up to which their contact is followed."""

OUTWARD = 1.0
"""How much the way between two trunks counts against the shortest way out of a contact."""

_ROUNDS, _ARMS_ALONE = 16, 4
_STEP = 0.35
_LOOKED_OVER, _CLOSE = 8, 0.1  # rounds after which, and metres within which, it is looked anew who is near
_AROUND = 4  # frames


def pushed(
    bodies: Sequence[CrowdBody], pairs: Sequence[tuple[int, int]], curves: Sequence[np.ndarray], held, fps: float,
    pressures: Sequence[Pressure], first: int,
) -> list[np.ndarray]:
    """The curves (T, 12) of each body with which these pairs are out of each other, as far as they can be.

    curves: those that they have already. held: for each body whether its curves stay what they are at its first and at
    its last frame. The bodies lie on the same T frames.
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
                weight = BASE / fps
                wanted = given(calm[number], mine, now[number], placed[number], turn >= _ARMS_ALONE, weight)
                now[number] = now[number] + _STEP * (wanted - now[number])
    return now


def _near_frames(bodies, placed, pair: tuple[int, int]) -> np.ndarray:
    """The frames at which two bodies are within _CLOSE of each other, and _AROUND before and behind."""
    one, other = pair
    found = touching(placed[one], placed[other], (bodies[one].radii, bodies[other].radii), -_CLOSE).frame
    near = np.zeros(len(placed[one]) + 2 * _AROUND, bool)
    for step in range(2 * _AROUND + 1):
        near[found + step] = True
    return np.flatnonzero(near[_AROUND:-_AROUND])


def _contacts(bodies, placed, pairs, near, pressures, first: int, fps: float) -> list[Contact]:
    """The contacts of every body with all others, of each pair at the frames `near`."""
    rows: list[list[tuple]] = [[] for _ in bodies]
    for (one, other), frames, pressure in zip(pairs, near, pressures):
        radii = bodies[one].radii, bodies[other].radii
        found = touching(placed[one][frames], placed[other][frames], radii, ALLOWED - MARGIN)
        found = replace(found, frame=frames[found.frame])
        way, lack = _way_out(found, sides(found, fps), placed[one], placed[other])
        sizes = len(radii[0]), len(radii[1])
        keys = ((found.frame + first) * sizes[0] + found.one) * sizes[1] + found.other
        span = [frame * sizes[0] * sizes[1] for frame in (first, first + len(placed[one]))]
        deep = lack + pressure.after(keys, lack, span)
        pressing = np.flatnonzero(deep > 0.0)
        found, way, deep = Touching(*(getattr(found, f.name)[pressing] for f in fields(found))), way[pressing], deep[pressing]
        for body, against, sign in ((one, other, 1.0), (other, one, -1.0)):
            rows[body].append(_side(found, sign * way, deep, bodies, placed, body, against, sign > 0.0))
    empty = (np.zeros(0, int),) * 2 + (np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0))
    return [Contact(*(np.concatenate(columns) for columns in zip(empty, *mine))) for mine in rows]


def _side(found: Touching, way, deep, bodies, placed, body: int, against: int, first: bool) -> tuple:
    """One body's side of its contacts with another, as columns of `Contact`; first: whether it is the one."""
    part, beside = (found.one, found.other) if first else (found.other, found.one)
    at = found.at_one if first else found.at_other
    ends = placed[body][found.frame, part]
    place = ends[:, 0] + at[:, None] * (ends[:, 1] - ends[:, 0])
    firm = [bodies[number].firm[found.frame] for number in (body, against)]
    arms = [np.array([p.limb == "arm" for p in bodies[n].parts])[c] for n, c in ((body, part), (against, beside))]
    arm = deep * np.where(arms[0], np.where(arms[1], 0.5, 1.0), 0.0)
    return found.frame, part, at, place, way, deep * firm[1] / (firm[0] + firm[1]), arm


def _way_out(found: Touching, side: np.ndarray, one, other) -> tuple[np.ndarray, np.ndarray]:
    """Which way (K, 3), unit, the one leaves the other by at each contact, and how far (K,) m, negative where there is
    room: to its side (K, 3) turned towards the way from the other's trunk to its own, so that limbs that have caught
    each other come free."""
    out = _middle(one)[found.frame] - _middle(other)[found.frame]
    out[:, 2] = 0.0
    way = side + OUTWARD * out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-9)
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    off = found.away * (found.radii - found.depth)[:, None]
    along = np.einsum("kc,kc->k", way, off)
    square = along**2 + (found.radii - ALLOWED) ** 2 - np.einsum("kc,kc->k", off, off)
    return way, np.sqrt(np.maximum(square, 0.0)) - along


def _middle(lines: np.ndarray) -> np.ndarray:
    """(T, 3) m: the middle of the hips."""
    return lines[:, 0].mean(axis=1)
