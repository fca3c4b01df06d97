"""Kicks on the run, from the swings of a library's own best kicker (`synthetic.running_kicks`).

Recorded kicks are seldom faster than a jog. Each height and surface that a recorded kick shows gets the swing that fits
best: fast, with the plant foot beside the ball and the foot at its fastest at the key moment. It is laid onto runs from
that speed up; where no recorded kick of a kind can be used its swing is synthetic.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..annotation.labels import list_labels
from ..motion.humanoid import identify_joints, measure_leg_length
from ..motion.motion import Motion
from ..motion.plant_place import compute_plant_shift
from ..motion.retargeting.neutral import NeutralStance, build_neutral_stance
from .gait_plan import GaitStyle
from .gestures import Gesture
from .running_kicks import (
    Swing,
    build_running_kick,
    build_swing,
    compute_places,
    measure_foot_speed,
    measure_plant_foot,
)

KICK_LABELS = frozenset({"kick"})
MAX_KICK_SPEED = 8.0  # m/s: faster players do not strike a ball but push it on
_SPEED_STEP = 1.5  # ratio of neighbouring speeds
_SLOWEST_RUN = 2.4  # m/s
_SOURCE_SECONDS = 0.35  # s of a recording before and after its key moment that a swing needs
_HARD, _SOFT = 11.0, 6.5  # m/s of the ankle against the pelvis in a hard kick and in a soft pass
PLAYBACK_RATES = (0.6, 1.25)
"""Limits of a swing's playback rate: slower ones are those of soft passes."""

_PLACE_COST, _PEAK_COST = 15.0, 60.0  # m/s of foot speed that a metre, or a second from the fastest moment, is worth
_FOLLOW_SECONDS, _FOLLOW_HEIGHT = (0.1, 0.25), 0.6
"""Seconds after the contact in which a foot follows through, and shares of the leg to which its ankle then rises."""

_FOLLOW_COST = 12.0  # m/s of foot speed that a leg's length of it is worth
_DIRECTIONS = np.radians([-15.0, 30.0])  # of low balls from the run, toward the plant leg's side
_HIGH_DIRECTIONS, _HIGH_SPEEDS = np.radians([10.0]), 2
_PASS = ("low", "inside")
_PASS_SPEEDS = (1.2, 2.2)  # m/s of soft passes in a walk and a jog: recorded kicks are shots, too hard for them
_RUNNING_SPEED = 2.0  # m/s from which a kick is labelled running, as in `match.labels`
_SURFACES = [word for word in list_labels(group="surface") if word != "volley"]


@dataclass(frozen=True, eq=False, kw_only=True)
class RunningKick:
    """A kick on the run.

    Attributes:
        name: of its file, without folder and ending.
        gesture: the motion.
        words: its labels.
        speed: m/s of the run.
    """

    name: str
    gesture: Gesture
    words: tuple[str, ...]
    speed: float


def iter_running_kicks(clips: Sequence, keys: Sequence, slowest: float, example: Motion,
                       style: GaitStyle) -> Iterator[RunningKick]:
    """Iterate over kicks of the right foot on the run, of each height and surface of the recorded ones.

    Args:
        clips: recordings and their twins.
        keys: their key moments.
        slowest: m/s from which on kicks are needed.
        example: how the skeleton stands.
        style: how the recorded people run.
    """
    if not np.isfinite(slowest):  # no kick is recorded
        return
    neutral = build_neutral_stance(example.skeleton, example)
    speeds = max(0, int(np.ceil(np.log(MAX_KICK_SPEED / max(slowest, _SLOWEST_RUN)) / np.log(_SPEED_STEP))))
    for kind in sorted({_find_kind(key.labels) for key in keys if KICK_LABELS <= key.labels}):
        swing = choose_swing(clips, [key for key in keys if _find_kind(key.labels) == kind], neutral, kind[-1])
        strengths = {"": max(1.0, _HARD / measure_foot_speed(swing))}
        if kind == _PASS:
            soft = {"soft_": _SOFT / measure_foot_speed(swing)}
            strengths |= soft
            for speed in _PASS_SPEEDS:
                yield from _build_kicks(swing, speed, kind, soft, neutral=neutral, style=style)
        # a high ball is seldom met in a sprint
        count = speeds if kind[0] == "low" else min(speeds, _HIGH_SPEEDS)
        for speed in max(slowest, _SLOWEST_RUN) * _SPEED_STEP ** np.arange(count):
            yield from _build_kicks(swing, float(speed), kind, strengths, neutral=neutral, style=style)


def choose_swing(clips: Sequence, keys: Sequence, neutral: NeutralStance, surface: str) -> Swing:
    """Choose the best recorded swing of the right foot, or build one where none can be used.

    Args:
        clips: recordings and their twins.
        keys: key moments of kicks.
        neutral: neutral stance of the skeleton.
        surface: "inside" or another surface of the foot, for a swing that is built.
    """
    swings = [swing for key in keys if {"kick", "right"} <= key.labels
              and (swing := _cut_swing(clips[key.clip], key.frame)) is not None]
    best = max(swings, key=_rate_swing, default=None)
    if best is not None and measure_foot_speed(best) * PLAYBACK_RATES[1] >= _SOFT:
        return best
    return build_swing("inside" if surface == "inside" else "instep", neutral)


def _find_kind(labels: frozenset[str]) -> tuple[str, ...]:
    """Find the height and the surface that labels say, "low" and "top" where they say none."""
    surface = next((word for word in _SURFACES if word in labels), "top")
    return ("high" if "high" in labels else "low", *(("volley",) if "volley" in labels else ()), surface)


def _cut_swing(clip, frame: float) -> Swing | None:
    """Cut the swing around a key frame out of a clip; None where the recording is too short for it."""
    seconds = frame / clip.motion.fps
    if clip.is_synthetic or min(seconds, len(clip.recording) / clip.motion.fps - seconds) < _SOURCE_SECONDS:
        return None
    return Swing(motion=clip.recording, contact=float(frame))


def _rate_swing(swing: Swing) -> float:
    """Rate a swing by the foot's speed, the plant foot's place, its follow-through, and whether the foot is fastest at
    the contact.
    """
    around = np.arange(-3, 4) / 60.0
    speeds = [measure_foot_speed(Swing(motion=swing.motion, contact=swing.contact + s * swing.motion.fps))
              for s in around]
    off = float(np.abs(compute_plant_shift(swing.motion.skeleton, measure_plant_foot(swing))).sum())
    lacking = max(_FOLLOW_HEIGHT - _measure_follow_through(swing), 0.0)
    late = abs(float(around[int(np.argmax(speeds))]))
    return speeds[3] - _PLACE_COST * off - _FOLLOW_COST * lacking - _PEAK_COST * late


def _measure_follow_through(swing: Swing) -> float:
    """Measure how high the kicking ankle rises after the contact, in shares of the leg: the median of its heights."""
    body = identify_joints(swing.motion.skeleton)
    places = compute_places(swing, np.linspace(*_FOLLOW_SECONDS, 7))
    return float(np.median(places[:, body.right.foot, 2])) / measure_leg_length(swing.motion.skeleton)


def _build_kicks(swing: Swing, speed: float, kind: tuple[str, ...], strengths: Mapping[str, float], *,
                 neutral: NeutralStance, style: GaitStyle) -> Iterator[RunningKick]:
    """Build the kicks of one kind and speed: in some directions, at the playback rate of each strength."""
    pace = "running" if speed > _RUNNING_SPEED else "standing"
    for strength, rate in strengths.items():
        for direction in _DIRECTIONS if kind[0] == "low" else _HIGH_DIRECTIONS:
            gesture = build_running_kick(swing, speed, neutral, direction=float(direction),
                                         rate=float(np.clip(rate, *PLAYBACK_RATES)), style=style)
            yield RunningKick(name=f"{strength}{'_'.join(kind)}_{speed:.1f}_{np.degrees(direction):+.0f}",
                              gesture=gesture, speed=speed, words=("kick", "right", *kind, pace, "front"))
