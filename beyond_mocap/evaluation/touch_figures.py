"""The report's group `touches`: what feet and ball do at receptions and kicks, beside the recordings', whether body and
ball fit each other, and which key moments were served by other labels or by synthetic clips.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..annotation.ball_contact import find_striking_part
from ..annotation.labels import find_label, list_labels
from ..base.errors import TimedMessage
from ..base.time_series import find_runs
from ..library.clip import SYNTHETIC_FOLDER
from ..motion import quaternion
from ..synthesis.quality.moments import KeyMomentResult
from ..synthesis.quality.unmet_constraints import format_stretches
from ..synthesis.search.key_fit import SPEED_RATIO
from . import touches
from .contact_figures import measure_contacts
from .naturalness import format_event
from .titles import Title
from .touch_view import TouchView
from .view import View

FAST_BALL = 18.0  # m/s of the ball just after a kick, from which on it is a fast one
LEAST_BALL = 5.0  # m/s from which on ball and foot speed are compared; slower balls are nudged, or taken along
DEPTH = 0.010  # m that the ball may lie in the body: it is soft, and so are people
_ACROSS = 0.15  # m by which a ball may lie on the other side of the body's middle from the foot that touches it

_HEIGHTS = {
    ("foot", "low"): (0.0, 0.6), ("foot", ""): (0.0, 1.05), ("foot", "high"): (0.35, 2.0), ("thigh", ""): (0.45, 1.1),
    ("chest", ""): (0.9, 1.75), ("head", ""): (1.3, 2.6),
}  # fmt: skip
"""Body part and height that labels name -> heights (m) of the ball's middle at which they touch it, for a leg of
0.86 m: below and above the knee, up to the hips without a height; the chest from the belt to a jump; the head from a
crouch to a jump. Hands reach anywhere."""

_IN_FLIGHT = frozenset(list_labels(in_flight=True))

FRAMES_KEYS = {
    **dict.fromkeys(("speed_m_s_median", "speed_m_s_max", "strike_count"), "receptions"),
    **dict.fromkeys(("ankle_speed_m_s_median", "plant_beside_m_median", "plant_ahead_m_median", "plant_in_range_share",
                     "stride_ratio_median", "run_up_m_s_median", "ratio_median", "ratio_in_range_share"), "kicks"),
    **dict.fromkeys(("fit_share", "part_fit_share", "side_fit_share", "met_share"), "touches"),
    "reachable_met_share": "reachable_touches", "inside_share": "ball_frames",
}  # fmt: skip
"""What a figure rests on: a key beside it."""

TITLES = {
    "reception.receptions": Title("Receptions", "", digits=0),
    "reception.speed_m_s_median": Title("Foot speed at receptions", "m/s"),
    "reception.speed_m_s_max": Title("Fastest foot at a reception", "m/s"),
    "reception.strike_count": Title("Receptions played as strikes", "", digits=0),
    "body_reception.speed_m_s_median": Title("Thigh, chest or head at receptions", "m/s"),
    "second_strike_count": Title("Second strikes", "", digits=0),
    "unasked_strike_count": Title("Strikes not asked for", "", digits=0),
    **{f"{group}.{leaf}": Title(f"{text}, {kicks}", unit, scale, digits)
       for group, kicks in (("fast_kick", "ball above 18 m/s"), ("kick", "all kicks"))
       for leaf, text, unit, scale, digits in (
           ("kicks", "Kicks", "", 1.0, 0), ("ankle_speed_m_s_median", "Kicking foot's speed", "m/s", 1.0, 1),
           ("plant_beside_m_median", "Plant foot beside the kicking one", "cm", 100.0, 0),
           ("plant_ahead_m_median", "Plant foot ahead of the kicking one", "cm", 100.0, 0),
           ("plant_in_range_share", "Plant feet in place", "%", 100.0, 0),
           ("stride_ratio_median", "Last stride over the one before", "", 1.0, 2),
           ("run_up_m_s_median", "Run-up", "m/s", 1.0, 1))},
    "ball_speed.ratio_median": Title("Ball speed over foot speed", "", digits=2),
    "ball_speed.ratio_in_range_share": Title("The same within 1.06 to 1.3", "%", 100.0, 0),
    "fit.fit_share": Title("Touches that fit the ball", "%", 100.0, 0),
    "fit.part_fit_share": Title("By body part", "%", 100.0, 0),
    "fit.side_fit_share": Title("By side", "%", 100.0, 0),
    "contact.met_share": Title("Touches that meet the ball", "%", 100.0, 0),
    "contact.reachable_met_share": Title("The same, of reachable balls", "%", 100.0, 0),
    "ball_inside.inside_frames": Title("Ball inside the body", "frames", digits=0),
    "ball_inside.inside_share": Title("The same, share", "%", 100.0, 2),
    "ball_inside.depth_mm_max": Title("Deepest", "mm", digits=0),
    "substituted_count": Title("Key moments shown by other labels", "", digits=0),
    "synthetic_count": Title("Key moments shown by synthetic clips", "", digits=0),
}  # fmt: skip
"""Figure of the group -> how pages show it."""


def measure_touches(touch_view: TouchView) -> dict:
    """Measure the touches of a take, beside those of its library's recordings.

    Args:
        touch_view: the take.
    Returns:
        The report's group.
    """
    kicks = touch_view.measure_kicks()
    out = {
        "reception": touches.summarize_receptions(touch_view.measure_receptions()),
        "body_reception": touches.summarize_receptions(touch_view.measure_body_receptions()),
        "kick": touches.summarize_kicks(kicks),
        "fast_kick": touches.summarize_kicks([kick for kick in kicks if kick.ball_speed > FAST_BALL]),
        "ball_speed": summarize_ball_speeds(kicks), "fit": measure_fit(touch_view),
        "contact": measure_contacts(touch_view.view),
        "ball_inside": measure_ball_inside(touch_view), "second_strike_count": len(touch_view.second_strikes),
        "unasked_strike_count": len(touch_view.strikes), **list_substituted(touch_view.view),
    }
    reference = touch_view.view.reference
    if reference is not None:
        own = touches.summarize_receptions(reference.receptions), touches.summarize_kicks(reference.kicks)
        for group, twins in (("reception", own[0]), ("kick", own[1]), ("fast_kick", own[1])):
            out[group].update({f"source_{name}": value for name, value in twins.items()})
    return {"touches": out}


def summarize_ball_speeds(kicks: Sequence[touches.Kick]) -> dict:
    """Summarize the ball's speed over that of the foot, of kicks whose ball leaves faster than LEAST_BALL."""
    ratios = np.array([kick.ball_speed / max(kick.foot_speed, 0.1) for kick in kicks if kick.ball_speed > LEAST_BALL])
    in_range = (ratios >= SPEED_RATIO[0]) & (ratios <= SPEED_RATIO[1])
    return {"kicks": len(ratios), "ratio_median": float(np.median(ratios)) if len(ratios) else math.nan,
            "ratio_in_range_share": float(in_range.mean()) if len(ratios) else math.nan}


def measure_fit(touch_view: TouchView) -> dict:
    """Measure the share of touches that are shown with a body part and side which fit the ball's height and place."""
    moments = [one for one in touch_view.moments if find_striking_part(one.requested.words) is not None
               and np.isfinite(touch_view.ball[one.frame]).all()]
    fits = np.array([(fits_part(touch_view, one), fits_side(touch_view, one)) for one in moments], dtype=bool)
    shares = [float(column.mean()) for column in (fits.all(axis=1), *fits.T)] if len(fits) else [math.nan] * 3
    return {"touches": len(fits), **dict(zip(("fit_share", "part_fit_share", "side_fit_share"), shares))}


def fits_part(touch_view: TouchView, moment: KeyMomentResult) -> bool:
    """Return whether the body part that is shown fits the ball's height; False where none is shown."""
    words = moment.requested.words if touch_view.view.played.words is None else moment.words
    part = find_striking_part(words)
    if part is None or part == "hand" or _IN_FLIGHT & set(words):
        return part is not None
    height = next((label.height for label in map(find_label, words) if label.height in ("low", "high")), "")
    least, most = _HEIGHTS.get((part, height), _HEIGHTS.get((part, ""), (0.0, math.inf)))
    return bool(least <= touch_view.legs.scale * touch_view.ball[moment.frame, 2] <= most)


def fits_side(touch_view: TouchView, moment: KeyMomentResult) -> bool:
    """Return whether the ball lies on the side of the foot that is shown, or little across the body's middle."""
    words, view = moment.contact_labels, touch_view.view
    side = touches.find_side(words)
    if side is None or find_striking_part(words) != "foot":
        return True
    frame = min(int(round(touch_view.find_second(moment) * touches.FPS)), len(view.course.heading) - 1)
    to_ball = touch_view.ball[moment.frame, :2] - view.played.pelvis[moment.frame]
    left = quaternion.rotate_level(to_ball, -view.course.heading[max(frame, 0)])[1]
    return bool((left if side == 0 else -left) >= -_ACROSS)


def measure_ball_inside(touch_view: TouchView) -> dict:
    """Measure in how many frames the ball lies more than 10 mm inside the body, and how deep at most."""
    known = int(np.isfinite(touch_view.ball).all(axis=1).sum())
    if not known:
        return {"ball_frames": 0, **dict.fromkeys(("inside_frames", "inside_share", "depth_mm_max"))}
    deepest = touch_view.depths[1].max(axis=1, initial=0.0)
    inside = int(np.sum(deepest > DEPTH))
    return {"ball_frames": known, "inside_frames": inside, "inside_share": inside / known,
            "depth_mm_max": 1000.0 * float(deepest.max(initial=0.0))}


def list_substituted(view: View) -> dict:
    """List the key moments that are shown by other labels than the requested ones, or by synthetic clips."""
    rows = [{"time_s": one.requested.time, "labels": list(one.requested.words),
             "shown": list(one.words or one.used_instead or ()), "clip": one.clip,
             "is_substituted": one.used_instead is not None, "is_synthetic": _is_synthetic(one)}
            for one in view.moments if view.are_clips_known]
    return {"moment_count": len(rows), "substituted_count": sum(row["is_substituted"] for row in rows),
            "synthetic_count": sum(row["is_synthetic"] for row in rows),
            "substituted": [row for row in rows if row["is_substituted"] or row["is_synthetic"]]}


def _is_synthetic(moment: KeyMomentResult) -> bool:
    return moment.clip is not None and moment.clip.startswith(SYNTHETIC_FOLDER)


def list_touch_messages(touch_view: TouchView) -> list[TimedMessage]:
    """List a line for each kind of fault at the ball: strikes that nothing asks for, the ball inside the body."""
    start = touch_view.view.played.start_time
    seconds = [start + second for second, _ in touch_view.strikes]
    strikes = [format_event(seconds, "a foot swings like a kick that nothing asks for")] if seconds else []
    return strikes + _list_inside_messages(touch_view)


def _list_inside_messages(touch_view: TouchView) -> list[TimedMessage]:
    """List a line for each body part in which the ball lies."""
    near, depths, surfaces = touch_view.depths
    times = touch_view.view.played.times
    deepest = np.argmax(depths, axis=1) if depths.size else np.zeros(0, int)
    is_inside = depths.max(axis=1, initial=0.0) > DEPTH
    lines = []
    for part in dict.fromkeys(surface.part for surface in surfaces):
        there = is_inside & np.array([surfaces[index].part == part for index in deepest], dtype=bool)
        if there.any():
            flags = np.zeros(len(times), dtype=bool)
            flags[near[there]] = True
            most = 1000.0 * depths[there].max()
            spans = [(times[first], times[end - 1]) for first, end in find_runs(flags)]
            text = f"the ball is up to {most:.0f} mm inside the body ({part})"
            lines.append(TimedMessage(f"{format_stretches(times, flags)}: {text}", *spans))
    return lines
