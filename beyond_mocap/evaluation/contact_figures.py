"""Whether the ball is met at key moments, and whether a body that keeps to its track can meet it at all."""

from __future__ import annotations

import math

import numpy as np

from ..annotation.ball_contact import comes_from_hands, find_contact_window, find_striking_part
from ..annotation.striking import CHEST_RADIUS, FOOT_RADIUS, HAND_RADIUS, HEAD_RADIUS, THIGH_RADIUS
from ..motion.track import BALL_RADIUS, Track
from ..synthesis.construct.ball_touch.part_reach import PELVIS_RANGE
from ..synthesis.construct.ball_touch.touch_problem import BALL_NOISE, FILLED_NOISE
from ..synthesis.construct.held_ball import HELD_DISTANCE
from ..synthesis.construct.step_to_ball import compute_allowed_step
from ..synthesis.quality.moments import KeyMomentResult, measure_contact
from .view import View

MET_GAP = 0.005
"""Metres between the surfaces of part and ball up to which a touch is met."""

REACH = {"foot": PELVIS_RANGE[1] + FOOT_RADIUS, "thigh": 0.26 + THIGH_RADIUS, "chest": 0.12 + CHEST_RADIUS,
         "head": 0.3 + HEAD_RADIUS, "hand": 0.7 + HAND_RADIUS}  # fmt: skip
"""Metres on the ground from the pelvis to the surface of a part that reaches: a kicking foot's largest distance; the
middle of a level thigh; a chest that bends forward; a head, which leans and is carried ahead of the pelvis; a
stretched arm."""

HEIGHTS = {"foot": (0.0, 1.3), "thigh": (0.45, 1.1), "chest": (0.9, 1.75), "head": (1.0, 2.6), "hand": (0.0, 2.8)}
"""Metres above the ground of a ball's middle that a part can touch, from a crouch or dive to a jump."""

_DIVE_REACH = 2.5  # m, of a keeper's hands in a dive


def measure_contacts(view: View) -> dict:
    """Measure the share of touches that are met, of all and of the reachable ones.

    Args:
        view: the take beside its track.
    Returns:
        The report's group.
    """
    touching = [one for one in view.moments if find_striking_part(one.contact_labels)]
    rows = [(measure_contact(view.played, one)[1], find_reachable(view, one)) for one in touching]
    met = [gap <= MET_GAP for gap, _ in rows if math.isfinite(gap)]
    reachable = [gap <= MET_GAP for gap, is_reachable in rows if math.isfinite(gap) and is_reachable]
    return {"touches": len(met), "met_share": _compute_share(met), "reachable_touches": len(reachable),
            "reachable_met_share": _compute_share(reachable)}


def _compute_share(flags: list[bool]) -> float:
    """Return the share of true flags, NaN without any."""
    return float(np.mean(flags)) if flags else math.nan


def find_reachable(view: View, moment: KeyMomentResult) -> bool | None:
    """Find whether a body can meet the ball of a key moment: both as measured, each moved within its noise.

    Args:
        view: the take beside its track.
        moment: the key moment.
    Returns:
        Whether the ball lies within the part's reach from the tracked pelvis, on the ground and in height, or beside
        who throws or punts it; None without a part, a track or a ball.
    """
    labels = moment.contact_labels
    part = find_striking_part(labels)
    if part is None or view.track is None or not len(view.track.known_ball[0]):
        return None
    sampled, time = view.sampled_track, view.played.times[moment.frame]
    at = int(np.argmin(np.abs(sampled.times - time)))
    noise = BALL_NOISE if sampled.ball_measured[at] else FILLED_NOISE
    reach = _DIVE_REACH if find_contact_window(labels) else REACH[part] + BALL_RADIUS
    away = float(np.linalg.norm(sampled.ball[at, :2] - sampled.raw[at]))
    if comes_from_hands(labels):
        return away < HELD_DISTANCE
    is_near = away <= reach + noise + compute_allowed_step(sampled.speed[at])
    return is_near and _is_at_height(view.track, part, time, sampled.ball[at, 2], noise)


def _is_at_height(track: Track, part: str, time: float, height: float, noise: float) -> bool:
    """Return whether a part can touch a ball at a height, m, give or take its noise, m; any where it is unknown."""
    least, most = HEIGHTS[part]
    is_known = bool(track.ball_height_known[np.abs(track.times - time).argmin()])
    return not is_known or least - noise <= height <= most + noise
