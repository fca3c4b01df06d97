"""A goalkeeper's slide on both knees into a low ball, which is wrapped before the chest.

Legs, path and getting up are those of the knee slide of a celebration, the hands those of a low catch; how they go
together is by judgement.
"""

from __future__ import annotations

from dataclasses import replace

from .celebrations import KNEE_SLIDE
from .key_poses import KeyPoses, Rows

_KNEES_DOWN = -0.3  # s before the catch in which the knees land


def _shift_rows(rows: Rows | None) -> Rows:
    """Shift rows of the knee slide so that the knees land before the catch."""
    return tuple((row[0] + _KNEES_DOWN, *row[1:]) for row in rows or ())


CATCH_SLIDE = replace(
    KNEE_SLIDE,
    labels="catchb catch save low slide knee",
    needs="catchb slide",
    is_span=False,
    meets=(0.0, 0.5),
    span=(-0.8, -0.35, 2.4, 3.0),
    speeds=((-2.7, 2.2), (-1.4, 3.8), (-0.6, 3.8), (-0.3, 3.4), (0.0, 2.4), (0.3, 1.3), (0.7, 0.0)),
    feet_span=(-0.66, -0.36, 9.0, 10.0),
    hips=_shift_rows(KNEE_SLIDE.hips),
    pelvis=((-0.6, 0, 10, 0), (-0.3, 0, 18, 0), (0.0, 0, 40, 0), (0.3, 0, 26, 0), (0.9, 0, 6, 0), (1.4, 0, 8, 0),
            (1.8, 0, 30, 0), (2.2, 0, 12, 0), (2.7, 0, 0, 0)),
    spine=((-0.6, 0, 12, 0), (-0.3, 0, 26, 0), (0.0, 0, 58, 0), (0.3, 0, 40, 0), (0.9, 0, 16, 0), (1.4, 0, 14, 0),
           (1.8, 0, 26, 0), (2.2, 0, 12, 0), (2.7, 0, 2, 0)),
    head=((-0.6, 0, -8, 0), (-0.3, 0, -24, 0), (0.0, 0, -20, 0), (0.3, 0, 0, 0), (0.9, 0, -10, 0), (1.8, 0, -26, 0),
          (2.7, 0, 2, 0)),
    arms=((-0.7, 20, 14, 12, 50, 10), (-0.3, 60, 8, 8, 40, -20), (0.0, 84, 4, 4, 30, -60), (0.14, 66, 6, 18, 60, -20),
          (0.38, 34, 10, 44, 112, 80), (1.9, 20, 12, 46, 118, 85), (2.4, 20, 10, 34, 84, 50), (3.0, 2, 9, 12, 16, 0)),
    wrists=((-0.5, 8), (-0.1, -18), (0.04, 6), (0.35, 34), (1.9, 34), (2.5, 8)),
    left_foot=_shift_rows(KNEE_SLIDE.left_foot), right_foot=_shift_rows(KNEE_SLIDE.right_foot),
    hold=((-0.25, 0, 0.24), (-0.04, 1, 0.24), (0.12, 1, 0.22), (0.38, 1, 0.14), (1.9, 1, 0.14), (2.5, 0, 0.24)),
)

SLIDES: dict[str, KeyPoses] = dict(catch_slide=CATCH_SLIDE)
"""Recipes by name."""
