"""Styles of kicks: the hard instep kick and the side-foot pass (`kicks.KICKS`), and variations of both.

No joint angles over time are published for most of these kicks: where no source is named they are by judgement, after
coaching manuals and photographs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from .kicks import KICKS, KickStyle

_INSTEP, _INSIDE = KICKS["instep"], KICKS["inside"]
_WIDTH = 0.16  # s, standard deviation of the time around the contact in which a style differs


def _add(rows: tuple, *by: float) -> tuple:
    """Add degrees to the values of rows (time, values...) around the contact."""

    def near(time: float) -> float:
        return float(np.exp(-0.5 * (time / _WIDTH) ** 2))

    return tuple((row[0], *(value + near(row[0]) * more for value, more in zip(row[1:], by))) for row in rows)


def _scale(rows: tuple, before: float, after: float) -> tuple:
    """Scale by how far rows (time, values...) differ from their values at the contact, before and after it."""
    middle = next(row for row in rows if row[0] == 0.0)[1:]

    def scale(row: tuple) -> tuple:
        share = before if row[0] < 0.0 else after
        return (row[0], *(at + share * (value - at) for value, at in zip(row[1:], middle)))

    return tuple(map(scale, rows))


def _swing(style: KickStyle, before: float, after: float) -> KickStyle:
    """Swing the leg of a style less or more before and after the contact."""
    return replace(style, leg=_scale(style.leg, before, after))


def _build_chip() -> KickStyle:
    """Build a chip: a short stab below the ball with the toes low and forward, which ends at it; the trunk is back."""
    stab = _swing(_INSTEP, 0.8, 0.3)
    return replace(stab, approach=20.0, foot=_add(stab.foot, -22.0, -8.0), spine=_add(stab.spine, 6.0, -12.0, 0.0),
                   strides=(0.6, 0.85, 1.0))


def _build_toe_poke() -> KickStyle:
    """Build a toe poke: straight on, hardly a backswing, the ankle at a right angle and the toes ahead."""
    poke = _swing(_INSTEP, 0.62, 0.45)
    return replace(poke, approach=5.0, foot=_add(poke.foot, -34.0, -16.0), strides=(0.6, 0.8, 0.95),
                   pelvis=tuple((time, side, tilt, 0.4 * turn) for time, side, tilt, turn in poke.pelvis),
                   spine=tuple((time, 0.5 * side, tilt, 0.4 * turn) for time, side, tilt, turn in poke.spine))


def _build_cross() -> KickStyle:
    """Build a cross with the inner instep: a wider approach, the trunk more to the support leg, the leg across the body
    after it. Curved kicks approach wider and turn the foot out more (Lees, Asai, Andersen, Nunome and Sterzing 2010).
    """
    plane = tuple((time, turn + (18.0 if 0.05 < time < 0.4 else 0.0), out) for time, turn, out in _INSTEP.plane)
    return replace(_INSTEP, approach=45.0, plane=plane, foot=_add(_INSTEP.foot, -8.0, 16.0),
                   spine=_add(_INSTEP.spine, -5.0, 0.0, 0.0))


def _build_half_volley() -> KickStyle:
    """Build a half volley: the knee over the ball, the trunk inclined forward, a short follow-through."""
    short = _swing(_INSTEP, 0.9, 0.6)
    return replace(short, approach=20.0, spine=_add(short.spine, 4.0, 10.0, 0.0), foot=_add(short.foot, 6.0, -6.0))


def _build_back_heel() -> KickStyle:
    """Build a back heel: the foot is lifted past the ball and swings back to it, toes up; the trunk leans forward."""
    leg = ((-0.32, -6, 30), (-0.24, 20, 62), (-0.16, 36, 56), (-0.1, 36, 40), (-0.05, 22, 30), (0.0, 2, 34),
           (0.05, -18, 46), (0.12, -28, 58), (0.24, -20, 52), (0.38, -2, 34), (0.5, 4, 18))
    plane = tuple((time, 0.2 * turn, 0.4 * out) for time, turn, out in _INSIDE.plane)
    foot = ((-0.3, 0, 4), (-0.16, -8, 4), (0.0, -8, 2), (0.12, 0, 2), (0.42, 2, 4), (0.5, 0, 4))
    still = {name: tuple((row[0], *(0.35 * value for value in row[1:3]), 0.15 * row[3])
                         for row in getattr(_INSIDE, name)) for name in ("pelvis", "spine")}
    return replace(_INSIDE, approach=0.0, leg=leg, plane=plane, foot=foot, pelvis=still["pelvis"],
                   spine=_add(still["spine"], 0.0, 8.0, 0.0), strides=(0.5, 0.7, 0.8))


def _build_outside() -> KickStyle:
    """Build a kick with the outside of the foot: straighter, the toes turned in."""
    return replace(_INSTEP, approach=15.0, foot=_add(_INSTEP.foot, 0.0, -50.0))


_VARIATIONS: dict[str, Callable[[], KickStyle]] = {
    "outside": _build_outside, "chip": _build_chip, "toe poke": _build_toe_poke, "cross": _build_cross,
    "half volley": _build_half_volley, "back heel": _build_back_heel,
}  # fmt: skip
KICK_STYLES = {**KICKS, **{name: build() for name, build in _VARIATIONS.items()}}
"""Name -> style."""
