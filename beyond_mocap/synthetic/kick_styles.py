"""Styles of kicks: the hard instep kick and the side-foot pass (`kicks.KICKS`), and variations of both."""

from __future__ import annotations

from dataclasses import replace

from .kicks import KICKS, KickStyle

_TURNED_IN = 50.0  # degrees by which the toes are turned in where the outside of the foot meets the ball


def _turn_toes_in(style: KickStyle) -> KickStyle:
    """Turn the toes of a style's foot in around the contact."""
    foot = tuple((time, bent, out - (_TURNED_IN if -0.1 < time < 0.3 else 0.0)) for time, bent, out in style.foot)
    return replace(style, foot=foot)


KICK_STYLES = {**KICKS, "outside": _turn_toes_in(replace(KICKS["instep"], approach=15.0))}
"""Name -> style."""
