"""Celebrations, and walking off with the head down.

Forms follow what players do on video, times and angles are by judgement; a knee slide loses 3.5 m/s^2, about a third of
gravity, as knees on wet grass do.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..gait_plan import GaitStyle
from .keeper_saves import CATCH_HIGH
from .key_poses import REST_ARM, KeyPoses, Rows, mirror_foot

_RUN: Rows = ((-3.4, 2.4), (-2.0, 4.6), (1.6, 4.6), (3.2, 2.2))


def _wave(*values: tuple[float, float], first: float, last: float, period: float) -> Rows:
    """Build rows that swing: for each value (middle, amplitude), from `first` to `last` s, with a period in s."""
    times = np.arange(first, last + 1e-9, period / 4.0)
    swing = np.sin(2.0 * np.pi * (times - first) / period)
    return tuple((float(t), *(float(middle + size * s) for middle, size in values)) for t, s in zip(times, swing))


ARMS_SPREAD = KeyPoses(
    labels="celebration running arms outside",
    is_span=True,
    span=(-2.6, -1.8, 1.6, 2.4),
    speeds=_RUN,
    arms=((-1.8, 6, 62, -5, 22, 60), (-0.6, 4, 96, -10, 16, 70), (0.8, 8, 98, -10, 14, 70), (1.6, 6, 74, -5, 20, 60)),
    head=((-1.8, 0, -6, 0), (0.0, 0, -20, 0), (1.6, 0, -10, 0)),
    spine=((-1.8, 0, 2, 0), (0.0, 0, -8, 0), (1.6, 0, 0, 0)),
)
AEROPLANE = KeyPoses(
    labels="celebration running arms",
    is_span=True,
    span=(-2.6, -1.8, 1.8, 2.6),
    speeds=((-3.4, 2.2), (-2.0, 3.8), (2.0, 3.8), (3.4, 2.0)),
    turns=((-2.8, 0), (-1.4, 38), (0.0, 0), (1.4, -38), (2.8, 0)),
    spine=((-2.4, 0, 22, 0), (-1.4, -18, 26, 0), (0.0, 0, 26, 0), (1.4, 18, 26, 0), (2.4, 0, 22, 0)),
    head=((-2.4, 0, -22, 0), (-1.4, 10, -26, 0), (0.0, 0, -26, 0), (1.4, -10, -26, 0), (2.4, 0, -22, 0)),
    left_arm=((-2.4, 4, 84, 0, 8, 70), (-1.4, 4, 74, 0, 8, 70), (0.0, 4, 86, 0, 8, 70), (1.4, 4, 100, 0, 8, 70)),
    right_arm=((-2.4, 4, 84, 0, 8, 70), (-1.4, 4, 100, 0, 8, 70), (0.0, 4, 86, 0, 8, 70), (1.4, 4, 74, 0, 8, 70)),
)
_KNEEL_FEET: Rows = ((-0.5, -0.30, 0.0, 0.12, 60, 0, 0), (-0.2, -0.30, 0.0, 0.16, 100, 0, 0),
                     (0.0, -0.40, 0.02, 0.02, 140, 0, 0),
                     (0.12, -0.46, 0.03, 0.0, 150, 0, 0), (1.75, -0.46, 0.03, 0.0, 150, 0, 0))
KNEE_SLIDE = KeyPoses(
    labels="celebration slide knee arms",
    is_span=True,
    span=(-0.5, -0.1, 2.7, 3.3),
    margin=(2.2, 0.8),
    speeds=((-2.7, 2.6), (-1.2, 5.0), (-0.3, 5.0), (0.0, 4.4), (0.4, 3.0), (0.8, 1.6), (1.3, 0.0)),
    feet_span=(-0.36, -0.06, 9.0, 10.0),
    hips=((-0.45, 0, 0, 0), (-0.2, 0, 0, -0.16), (0.0, 0.0, 0, -0.42), (0.14, -0.03, 0, -0.46), (0.6, -0.06, 0, -0.46),
          (1.2, -0.02, 0, -0.45), (1.75, 0.0, 0, -0.44), (2.15, 0.18, 0, -0.32), (2.5, 0.32, 0, -0.06),
          (2.8, 0.35, 0, 0)),
    pelvis=((-0.3, 0, 4, 0), (0.0, 0, -10, 0), (0.4, 0, -16, 0), (1.2, 0, -4, 0), (1.7, 0, 8, 0), (2.1, 0, 30, 0),
            (2.5, 0, 12, 0), (3.0, 0, 0, 0)),
    spine=((-0.3, 0, 8, 0), (0.0, 0, 2, 0), (0.4, 0, -16, 0), (1.2, 0, -8, 0), (1.7, 0, 8, 0), (2.1, 0, 22, 0),
           (2.5, 0, 10, 0), (3.0, 0, 2, 0)),
    head=((-0.3, 0, -6, 0), (0.4, 0, -14, 0), (1.2, 0, -16, 0), (1.8, 0, -14, 0), (2.1, 0, -26, 0), (3.0, 0, 2, 0)),
    arms=((-0.3, 20, 40, 10, 40, 20), (0.1, 10, 70, -10, 30, 60), (0.5, 6, 104, -20, 16, 70),
          (1.2, 10, 112, -20, 20, 70),
          (1.8, 20, 40, 10, 50, 20), (2.2, 30, 20, 16, 50, 10), (2.6, 10, 12, 14, 26, 5), (3.2, *REST_ARM)),
    left_foot=(*_KNEEL_FEET, (1.85, -0.42, 0.03, 0.13, 130, 0, 0), (2.02, 0.06, 0.03, 0.10, 40, 0, 0),
        (2.17, 0.36, 0, 0, 0, 0, 0), (3.3, 0.36, 0, 0, 0, 0, 0)),
    right_foot=(*mirror_foot(_KNEEL_FEET), (1.86, -0.46, -0.03, 0.12, 140, 0, 0),
        (2.0, -0.45, -0.03, 0.18, 105, 0, 0), (2.14, -0.42, -0.02, 0.0, 76, 0, 0),
                (2.3, -0.42, -0.02, 0.0, 70, 0, 0), (2.5, -0.05, 0, 0.10, 40, 0, 0), (2.75, 0.35, 0, 0, 0, 0, 0),
                (3.3, 0.35, 0, 0, 0, 0, 0)),
)
_HOP_FOOT: Rows = ((-1.0, 0, 0, 0, 0, 0, 0), (-0.48, 0, 0, 0, 10, 0, 0), (-0.25, 0, 0, 0, 58, 0, 0),
                   (-0.08, -0.12, 0, 0.12, 66, 0, 0), (0.08, -0.10, 0, 0.12, 54, 0, 0), (0.25, 0, 0, 0, 26, 0, 0),
                   (0.36, 0, 0, 0, 0, 0, 0), (1.2, 0, 0, 0, 0, 0, 0))
JUMP_FIST = KeyPoses(
    labels="celebration jump fist",
    is_span=True,
    span=(-0.9, -0.7, 0.34, 0.75),  # standing behind it would be all that a calm search shows
    hips=((-0.9, 0, 0, 0), (-0.5, -0.03, 0, -0.24), (-0.25, 0, 0, 0.06), (0.0, 0, 0, 0.1), (0.25, 0, 0, 0.03),
          (0.42, -0.03, 0, -0.20), (0.8, 0, 0, -0.03), (1.0, 0, 0, 0)),
    pelvis=CATCH_HIGH.pelvis, spine=CATCH_HIGH.spine, left_foot=_HOP_FOOT, right_foot=mirror_foot(_HOP_FOOT),
    flights=CATCH_HIGH.flights,
    head=((-0.8, 0, -10, 0), (0.0, 0, -18, -10), (0.4, 0, 4, 0), (1.0, 0, 2, 0)),
    right_arm=((-0.75, 6, 16, 12, 50, 10), (-0.46, -30, 22, 14, 80, 10), (-0.22, 70, 20, 20, 110, 40),
               (0.0, 160, 6, 10, 30, 40), (0.12, 164, 4, 10, 24, 40), (0.32, 60, 20, 20, 110, 40),
               (0.46, 14, 18, 16, 112, 30), (1.0, *REST_ARM)),
    left_arm=((-0.75, 6, 16, 12, 50, 10), (-0.46, -24, 24, 14, 60, 10), (-0.1, 30, 36, 14, 96, 20),
              (0.1, 10, 34, 14, 100, 20), (0.46, 20, 30, 16, 70, 20), (1.0, *REST_ARM)),
)
ARMS_RAISED = KeyPoses(
    labels="celebration standing arms outside",
    is_span=True,
    span=(-0.9, -0.3, 1.5, 2.2),
    hips=((-0.9, 0, 0, 0), (-0.4, 0, 0, -0.03), (0.0, 0, 0, 0.0), (0.5, 0, 0, -0.02), (1.0, 0, 0, 0.0), (2.0, 0, 0, 0)),
    spine=((-0.4, 0, 2, 0), (0.0, 0, -10, 0), (0.7, 0, -8, 6), (1.4, 0, -10, -6), (2.1, 0, 2, 0)),
    head=((-0.4, 0, -4, 0), (0.0, 0, -24, 0), (0.7, 0, -18, 14), (1.4, 0, -22, -10), (2.1, 0, 2, 0)),
    arms=((-0.8, *REST_ARM), (-0.3, 12, 92, -10, 30, 50), (0.0, 8, 136, -16, 16, 70), (0.5, 8, 126, -16, 22, 70),
          (1.0, 8, 140, -16, 12, 70), (1.5, 8, 128, -16, 20, 70), (1.9, 10, 60, 0, 30, 30), (2.2, *REST_ARM)),
)
HANDS_ON_BADGE = KeyPoses(
    labels="celebration standing arms inside",
    is_span=True,
    span=(-0.9, -0.3, 1.5, 2.2),
    spine=((-0.4, 0, 2, 0), (0.0, 0, -6, 0), (1.4, 0, -4, 0), (2.1, 0, 2, 0)),
    head=((-0.4, 0, -4, 0), (0.0, 0, -16, 10), (0.8, 0, -14, -14), (1.4, 0, -16, 4), (2.1, 0, 2, 0)),
    arms=((-0.8, *REST_ARM), (-0.4, 20, 16, 30, 90, 40), *((float(time), 20, 14, 50, 124 - 16 * (beat % 2), 60)
          for beat, time in enumerate(np.arange(0.0, 1.51, 0.25))), (1.9, 14, 14, 26, 70, 20), (2.2, *REST_ARM)),
)
BADGE_ON_THE_RUN = replace(HANDS_ON_BADGE, labels="celebration running arms inside", speeds=_RUN)
POINTING_UP = KeyPoses(
    labels="celebration walking pointing arms",
    is_span=True,
    span=(-2.2, -1.3, 1.4, 2.4),
    speeds=((-3.0, 1.3), (-1.6, 0.9), (1.6, 0.9), (3.0, 1.3)),
    head=((-1.3, 0, -24, 0), (-0.4, 0, -36, 0), (1.0, 0, -34, 0), (1.6, 0, -10, 0)),
    spine=((-1.3, 0, -2, 0), (-0.4, 0, -10, 0), (1.0, 0, -8, 0), (1.6, 0, 0, 0)),
    left_arm=((-1.6, 40, 16, 10, 50, 20), (-0.9, 140, -6, 6, 34, 30), (-0.3, 158, -14, 4, 12, 30),
              (1.0, 158, -14, 4, 12, 30),
              (1.6, 100, 4, 10, 60, 20), (2.2, *REST_ARM)),
    right_arm=((-1.8, 40, 16, 10, 50, 20), (-1.0, 140, -6, 6, 34, 30), (-0.4, 160, -14, 4, 10, 30),
               (1.0, 160, -14, 4, 10, 30),
               (1.5, 100, 4, 10, 60, 20), (2.1, *REST_ARM)),
)
POINTING_TO_THE_SKY = KeyPoses(
    labels="celebration standing pointing arms",
    is_span=True,
    span=(-1.4, -0.6, 1.4, 2.2),
    head=POINTING_UP.head, spine=POINTING_UP.spine, left_arm=POINTING_UP.left_arm, right_arm=POINTING_UP.right_arm,
)
FIST_PUMP = KeyPoses(
    labels="celebration standing fist",
    is_span=True,
    span=(-0.8, -0.35, 1.3, 2.0),
    hips=((-0.8, 0, 0, 0), (-0.3, 0, 0, -0.02), (0.0, 0, 0, -0.14), (0.25, 0, 0, -0.08), (0.45, 0, 0, -0.14),
          (0.7, 0, 0, -0.08), (0.9, 0, 0, -0.14), (1.3, 0, 0, -0.05), (1.8, 0, 0, 0)),
    pelvis=((-0.4, 0, -2, -6), (0.0, 0, 14, 4), (1.0, 0, 12, 4), (1.8, 0, 0, 0)),
    spine=((-0.4, 0, -4, -8), (0.0, 0, 20, 6), (0.25, 0, 12, 2), (0.45, 0, 20, 6), (0.7, 0, 12, 2), (0.9, 0, 20, 6),
           (1.4, 0, 6, 0), (1.9, 0, 2, 0)),
    head=((-0.4, 0, -10, 0), (0.0, 0, -12, 0), (1.0, 0, -12, 0), (1.8, 0, 2, 0)),
    right_arm=((-0.3, 96, 24, 20, 118, 50), (0.0, 14, 20, 14, 100, 50), (0.25, 50, 24, 18, 118, 50),
               (0.45, 14, 20, 14, 100, 50),
               (0.7, 50, 24, 18, 118, 50), (0.9, 14, 20, 14, 100, 50), (1.4, 10, 14, 12, 60, 20), (1.9, *REST_ARM)),
    left_arm=((-0.3, 60, 24, 20, 112, 50), (0.0, 6, 22, 14, 96, 50), (0.25, 30, 24, 18, 110, 50),
              (0.45, 6, 22, 14, 96, 50),
              (0.7, 30, 24, 18, 110, 50), (0.9, 6, 22, 14, 96, 50), (1.4, 8, 14, 12, 60, 20), (1.9, *REST_ARM)),
    left_foot=((-0.8, 0, 0, 0, 0, 0, 0), (-0.35, 0, 0, 0, 4, 0, 0), (-0.2, 0.06, 0.05, 0.05, 4, 0, 0),
               (-0.05, 0.10, 0.09, 0, 0, 0, 0),
               (1.5, 0.10, 0.09, 0, 0, 0, 0), (1.65, 0.05, 0.04, 0.03, 4, 0, 0), (1.8, 0, 0, 0, 0, 0, 0)),
)


def _step(times: tuple[float, ...], left: float) -> Rows:
    """Build the rows of a foot that taps aside by `left` m and back at each of `times`."""
    rows: list[tuple[float, ...]] = []
    for time in times:
        rows += [(time - 0.24, 0, 0, 0, 0, 0, 0), (time - 0.12, 0, 0.5 * left, 0.07, 14, 0, 0),
        (time, 0, left, 0, 0, 0, 0),
                 (time + 0.20, 0, left, 0, 0, 0, 0), (time + 0.34, 0, 0.5 * left, 0.05, 10, 0, 0),
                 (time + 0.48, 0, 0, 0, 0, 0, 0)]
    return tuple(rows)


def _sway(*values: tuple[float, float], rest: tuple[float, ...]) -> Rows:
    """Build rows that go from side to side: for each value (amplitude, middle), from and to `rest`."""
    beats = [(time, *(size * side + middle for size, middle in values))
             for time, side in zip((-1.25, -0.5, 0.25, 1.0, 1.75), (1, -1, 1, -1, 1))]
    return ((-1.9, *rest), *beats, (2.4, *rest))


DANCE = KeyPoses(
    labels="celebration standing dance",
    is_span=True,
    span=(-1.9, -1.5, 2.0, 2.6),
    hips=_sway((0, 0), (0.09, 0), (0.01, -0.06), rest=(0, 0, 0)),
    pelvis=_sway((10, 0), (0, 4), (8, 0), rest=(0, 0, 0)),
    spine=_sway((-14, 0), (0, 8), (-12, 0), rest=(0, 2, 0)),
    head=_sway((8, 0), (0, -2), (4, 0), rest=(0, 2, 0)),
    left_arm=_wave((34, 26), (30, 8), (24, 10), (92, 10), (40, 0), first=-1.6, last=2.0, period=0.75),
    right_arm=_wave((34, -26), (30, -8), (24, -10), (92, -10), (40, 0), first=-1.6, last=2.0, period=0.75),
    left_foot=_step((-1.25, 0.25, 1.75), 0.12),
    right_foot=_step((-0.5, 1.0), -0.12),
)
HEAD_DOWN = KeyPoses(
    labels="walking dejected",
    is_span=True,
    span=(-2.2, -1.2, 1.6, 2.6),
    speeds=((-3.0, 1.2), (-1.6, 0.95), (1.6, 0.95), (3.0, 1.2)),
    style=GaitStyle(arm_swing=0.5, life=0.6),
    head=((-1.2, 0, 34, 0), (0.2, 0, 38, 8), (1.6, 0, 34, 0)),
    spine=((-1.2, 0, 16, 0), (1.6, 0, 16, 0)),
)
CELEBRATIONS = dict(
    arms_spread=ARMS_SPREAD, fist_pump=FIST_PUMP, aeroplane=AEROPLANE, jump_fist=JUMP_FIST,
    arms_raised=ARMS_RAISED, hands_on_badge=HANDS_ON_BADGE, pointing_to_the_sky=POINTING_TO_THE_SKY,
    pointing_up=POINTING_UP, badge_on_the_run=BADGE_ON_THE_RUN, knee_slide=KNEE_SLIDE, dance=DANCE, head_down=HEAD_DOWN,
)
"""Recipes by name: that of a plain celebration in a run first, then that in a stand."""
