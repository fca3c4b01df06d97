"""Synthetic receptions: the right foot (inside, outside, sole, top), thigh, chest or head takes the ball and gives with
it.

Each is one table of key poses over seconds from the touch, played out of standing (`volleys`) or over walking and
running (`gestures`). There is no backswing and no follow-through: the foot is out before the ball arrives, gives with
it for 0.15 to 0.2 s at about 1 m/s against the pelvis, and the next step goes on. The support knee is bent, the trunk
leans over the ball. Skilled players turn the pelvis parallel to the ball's course and turn the sole outward quickly at
the touch (Int. J. Sports Sci. Coach. 2025, doi 10.1177/17479541251350820). How far the foot gives, 0.1 to 0.2 m, and
its 3 m/s against the pelvis at most are the project's targets, not published figures; recorded dribbles give alike.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...motion.motion import Motion
from ...motion.skeleton import Skeleton
from ..gestures import Gesture, StrikeRecipe, build_touch
from ..volleys import Volley, build_standing_touch
from .action import Action, ActionSetting
from .headers import build_jumping_header, build_running_jump

SLOWEST = 0.7
"""Speed in m/s of a body below which it stands while it takes a ball."""

SPEEDS = (0.0, 1.2, 1.8, 2.5, 3.5, 4.9, 6.9)
"""Speeds in m/s of the body at which receptions are built; from one to the next up to 1.4 times, as kicks."""

# a ball taken on the way: seconds from the touch, and share of the slowing down towards it that is reached
_SLOWING = ((-1.3, 0.0), (-0.8, 0.0), (-0.25, 0.65), (0.05, 1.0), (0.4, 0.7), (0.9, 0.0), (1.4, 0.0))
_SLOWED = (0.35, 0.15)  # share of its speed that a walking and a running body loses at the touch
_PACE = (0.52, 0.77)  # factor on the cadence of a walk and a run around the touch
_WALK, _RUN = 1.7, 3.3  # m/s of a walk, and of a run
_LIFT_SECONDS = 0.28, 0.36  # after the touch in which a foot comes down, of a low and of a high ball
_SWING_SHARE = 0.66, 0.56  # of the foot's swing that has passed at the touch of a low and of a high ball
_LOW, _HIGH = 0.3, 0.7  # m of the ankle at a low and at a high ball
_HIGH_PACE = 0.72  # factor on the cadence for a high ball: a foot that comes down from there slowly takes its time
# seconds before and after the touch in which a standing body differs from standing
_SPAN = (-0.75, 0.95)
# seconds from the touch, share by which the hips are lowered: standing, and on the way
_STANDING_SINK, _SINK = ((-0.36, 0.6), (0.0, 1.0), (0.3, 0.8)), ((-0.15, 0.8), (0.0, 1.0), (0.25, 0.8))
_LEFT_ARM = ((-0.20, 12, 34, 15, 42), (0.0, 16, 44, 15, 40), (0.25, 12, 38, 15, 45))
_RIGHT_ARM = ((-0.20, 6, 32, 15, 42), (0.0, -6, 40, 15, 38), (0.25, 4, 34, 15, 42))
_PELVIS = ((-0.20, 3, 3, -6), (0.0, 3, 2, -2), (0.20, 2, 3, -10))
_SPINE = ((-0.20, -4, 9, 4), (0.0, -5, 12, 0), (0.20, -3, 13, 6))


@dataclass(frozen=True, kw_only=True)
class Reception:
    """How the right side takes a ball; seconds from the touch, metres of an adult, degrees.

    Attributes:
        name: as reports call it.
        labels: labels of the vocabulary, without side and pace.
        speeds: m/s of the body from and up to which it is done.
        heights: m of the ball's centre from and up to which the foot is lifted to it; (): not at all.
        height: m of the ball's centre in the rows of the foot.
        most_ball_speed: m/s of the arriving ball up to which it is done.
        foot: rows (time, ahead of the hips, left of them, ankle height, pitch, yaw, roll); () leaves both feet.
        low: metres by which the hips are lowered at the touch.
        sink: rows (time, share of `low`); () as usual: the body is low before the ball arrives.
        pelvis: rows (time, list, tilt, turn).
        spine: rows (time, list, tilt, turn).
        left_arm: rows (time, flexion, abduction, inward, elbow).
        right_arm: rows (time, flexion, abduction, inward, elbow).
        nod: degrees by which the head looks down.
        slows: share of the slowing down towards the touch that a body on its way shows.
        least_lead: m/s by which the ball has to leave faster than the body, along its way.
    """

    name: str
    labels: tuple[str, ...]
    speeds: tuple[float, float]
    heights: tuple[float, ...] = (0.25, 0.45)
    height: float = 0.25
    most_ball_speed: float = np.inf
    foot: tuple = ()
    low: float = 0.05
    sink: tuple = ()
    pelvis: tuple = _PELVIS
    spine: tuple = _SPINE
    left_arm: tuple = _LEFT_ARM
    right_arm: tuple = _RIGHT_ARM
    nod: float = 24.0
    slows: float = 1.0
    least_lead: float = -np.inf


RECEPTIONS = {
    "inside": Reception(
        name="reception with the inside of the foot", labels=("receive", "foot", "low", "inside"), speeds=(0.0, 9.4),
        foot=(
            (-0.16, 0.35, -0.14, 0.140, -4, -64, -4),
            (0.0, 0.36, -0.14, 0.130, -4, -70, -6), (0.08, 0.29, -0.14, 0.125, -3, -70, -8),
            (0.17, 0.19, -0.14, 0.120, -2, -66, -6), (0.28, 0.14, -0.13, 0.110, 2, -44, 0),
        ),
    ),
    # the foot goes on with the ball instead of giving: the ball runs ahead, the body after it
    "push": Reception(
        name="first touch into the run", labels=("receive", "foot", "low", "inside"), speeds=(1.8, 9.4), slows=0.3,
        foot=(
            (-0.16, 0.22, -0.14, 0.140, -4, -56, -4),
            (0.0, 0.30, -0.14, 0.130, -4, -62, -6), (0.08, 0.37, -0.14, 0.125, -3, -60, -6),
            (0.17, 0.40, -0.13, 0.130, -2, -46, -4), (0.28, 0.33, -0.12, 0.110, 0, -20, 0),
        ),
        pelvis=((-0.20, 3, 3, -6), (0.0, 3, 2, -2), (0.20, 2, 4, 4)), nod=18.0, least_lead=1.0,
    ),
    "outside": Reception(
        name="reception with the outside of the foot", labels=("receive", "foot", "low", "outside"), speeds=(2.5, 5.5),
        foot=(
            (-0.16, 0.29, -0.17, 0.140, 14, 26, 8),
            (0.0, 0.30, -0.18, 0.130, 14, 32, 12), (0.08, 0.25, -0.19, 0.125, 12, 32, 12),
            (0.17, 0.17, -0.19, 0.120, 8, 26, 8), (0.28, 0.14, -0.16, 0.110, 4, 8, 2),
        ),
        pelvis=((-0.20, 3, 3, 4), (0.0, 3, 2, 8), (0.20, 2, 3, 2)),
    ),
    "sole": Reception(
        name="reception with the sole",
        labels=("receive", "foot", "low", "sole"), speeds=(0.0, 1.5), heights=(), most_ball_speed=6.0,
        foot=(
            (-0.16, 0.34, -0.12, 0.260, -24, -8, 0),
            (0.0, 0.36, -0.11, 0.240, -26, -8, 0), (0.08, 0.31, -0.11, 0.230, -24, -8, 0),
            (0.17, 0.22, -0.11, 0.225, -18, -8, 0), (0.28, 0.16, -0.12, 0.170, -6, -8, 0),
        ),
        spine=((-0.20, -4, 7, 4), (0.0, -5, 10, 0), (0.20, -3, 13, 2)),
    ),
    "top": Reception(
        name="reception with the instep",
        labels=("receive", "foot", "high", "top"), speeds=(0.0, 5.5), heights=(0.45, 0.75), height=0.46,
        foot=(
            (-0.16, 0.38, -0.12, 0.470, 12, -20, -4),
            (0.0, 0.40, -0.12, 0.480, 10, -22, -6), (0.08, 0.36, -0.12, 0.420, 12, -22, -6),
            (0.17, 0.29, -0.12, 0.340, 14, -18, -4), (0.34, 0.18, -0.12, 0.150, 8, -10, 0),
        ),
        low=0.04, left_arm=((-0.20, 14, 50, 10, 34), (0.0, 22, 64, 10, 30), (0.25, 14, 46, 12, 38)),
        right_arm=((-0.20, 4, 42, 12, 36), (0.0, -14, 54, 10, 30), (0.25, 0, 40, 12, 38)),
        spine=((-0.20, -4, 2, 4), (0.0, -6, 2, 0), (0.20, -3, 10, 4)),
    ),
    "high inside": Reception(
        name="reception with the raised inside of the foot",
        labels=("receive", "foot", "high", "inside"), speeds=(0.0, 2.5), heights=(0.45, 0.75), height=0.5,
        foot=(
            (-0.16, 0.36, -0.15, 0.400, -2, -58, -6),
            (0.0, 0.38, -0.15, 0.390, -2, -64, -8), (0.08, 0.32, -0.15, 0.350, -2, -64, -8),
            (0.17, 0.24, -0.15, 0.280, 0, -54, -6), (0.34, 0.16, -0.13, 0.140, 4, -24, 0),
        ),
        low=0.04, left_arm=((-0.20, 14, 46, 10, 36), (0.0, 20, 58, 10, 32), (0.25, 12, 42, 12, 40)),
        right_arm=((-0.20, 6, 42, 12, 36), (0.0, -8, 52, 10, 32), (0.25, 2, 38, 12, 40)),
        spine=((-0.20, -5, 4, 6), (0.0, -7, 6, 4), (0.20, -3, 11, 4)),
    ),
    "thigh": Reception(
        name="reception with the thigh",
        labels=("receive", "thigh", "high"), speeds=(0.0, 4.0), heights=(0.75, 1.05), height=1.0,
        foot=(
            (-0.16, 0.22, -0.12, 0.490, 30, -8, 0),
            (0.0, 0.24, -0.12, 0.520, 28, -8, 0), (0.08, 0.23, -0.12, 0.450, 28, -8, 0),
            (0.17, 0.20, -0.12, 0.350, 22, -8, 0), (0.34, 0.16, -0.12, 0.150, 10, -8, 0),
        ),
        low=0.03, left_arm=((-0.20, 14, 50, 10, 36), (0.0, 18, 62, 10, 32), (0.25, 12, 44, 12, 40)),
        right_arm=((-0.20, 6, 46, 12, 36), (0.0, -8, 58, 10, 32), (0.25, 2, 42, 12, 40)),
        pelvis=((-0.20, 4, -4, -2), (0.0, 4, -8, 0), (0.20, 2, 0, -2)),
        spine=((-0.20, -5, 2, 2), (0.0, -6, 0, 0), (0.20, -3, 10, 2)),
    ),
    "chest": Reception(
        name="reception with the chest", labels=("receive", "body", "chest", "high"), speeds=(0.0, 4.0), heights=(),
        low=0.07,
        pelvis=((-0.40, 0, 2, 0), (-0.05, 0, -12, 0), (0.10, 0, -10, 0), (0.25, 0, -2, 0), (0.5, 0, 2, 0)),
        spine=((-0.40, 0, 2, 0), (-0.05, 0, -20, 0), (0.08, 0, -12, 0), (0.22, 0, 6, 0), (0.5, 0, 6, 0)),
        left_arm=((-0.35, 6, 36, 8, 34), (0.0, -10, 62, 0, 50), (0.25, 2, 48, 5, 44)),
        right_arm=((-0.35, 6, 36, 8, 34), (0.0, -10, 62, 0, 50), (0.25, 2, 48, 5, 44)),
        nod=18.0,
    ),
    # tall before the ball arrives; then knees, trunk and neck give, and it drops before the feet
    "head": Reception(
        name="reception with the head", labels=("receive", "head"), speeds=(0.0, 4.0), heights=(1.45, 1.9), height=1.75,
        low=0.09, sink=((-0.30, 0.3), (-0.05, 0.2), (0.18, 1.0), (0.4, 0.7)),
        pelvis=((-0.40, 0, 2, 0), (-0.05, 0, 2, 0), (0.18, 0, -4, 0), (0.36, 0, 0, 0), (0.55, 0, 2, 0)),
        spine=((-0.40, 0, 2, 0), (-0.05, 0, 4, 0), (0.18, 0, -9, 0), (0.36, 0, 2, 0), (0.55, 0, 6, 0)),
        left_arm=((-0.35, 8, 30, 10, 40), (0.0, 16, 48, 14, 58), (0.2, 4, 56, 8, 50)),
        right_arm=((-0.35, 8, 30, 10, 40), (0.0, 16, 48, 14, 58), (0.2, 4, 56, 8, 50)),
        nod=-8.0,
    ),
    # no reception, but built alike: the foot is lifted out of the way, the eyes follow the ball
    "let run": Reception(
        name="letting the ball run", labels=("letgo",), speeds=(0.0, 6.9), heights=(), low=0.05, slows=0.3,
        foot=(
            (-0.20, 0.10, -0.20, 0.240, 18, -14, 0), (-0.06, 0.16, -0.26, 0.330, 12, -14, 0),
            (0.0, 0.20, -0.27, 0.340, 10, -14, 0), (0.10, 0.26, -0.25, 0.310, 6, -14, 0),
            (0.22, 0.28, -0.20, 0.200, 2, -12, 0),
        ),
        pelvis=((-0.20, 3, 3, -6), (0.0, 5, 4, -10), (0.20, 3, 3, -6)),
        left_arm=((-0.20, 14, 44, 12, 40), (0.0, 18, 56, 12, 36), (0.25, 12, 40, 12, 42)),
        right_arm=((-0.20, 4, 40, 12, 40), (0.0, -8, 50, 12, 36), (0.25, 4, 36, 12, 42)),
    ),
}  # fmt: skip

_LOOKS_DOWN = 24.0  # degrees by which the head looks down at a ball that has dropped from it


def build_reception(
    kind: str, skeleton: Skeleton | None = None, fps: float = 60.0, speed: float = 0.0, seed: int = 0, *,
    height: float | None = None, example: Motion | None = None,
) -> Gesture:
    """Build the reception of a ball with the right side; the body faces and travels along +X and goes on.

    Args:
        kind: one of RECEPTIONS.
        skeleton: any humanoid skeleton; default: the project's adult.
        fps: frames per second.
        speed: m/s of the body; below SLOWEST it stands.
        seed: of the variation.
        height: m of the ball's centre for an adult, within the reception's; None: as its rows have it.
        example: a recording on `skeleton`, for its neutral stance.
    Returns:
        The move; its key is the touch.
    """
    reception = RECEPTIONS[kind]
    reception = reception if height is None or not reception.heights else _lift(reception, height)
    if speed < SLOWEST:
        return build_standing_touch(_stand(reception), skeleton, fps, seed, example=example)
    return build_touch(travel_with_ball(reception, speed), skeleton, fps, seed=seed, example=example)


def _lift(reception: Reception, height: float) -> Reception:
    """Lift the foot of a reception to a ball at `height` m; it is down again when the foot lands.

    A body that takes it with both feet down is lower for a lower ball.
    """
    lift = min(max(height, reception.heights[0]), reception.heights[-1]) - reception.height
    if not reception.foot:
        low, bent = max(reception.low, lift) - lift, max(-lift, 0.0)  # bent: before the ball arrives
        sink = tuple((time, (share * (low - bent) + bent) / max(low, 1e-9)) for time, share in reception.sink)
        return replace(reception, low=low, sink=sink)
    seconds = _interpolate_height(reception, _LIFT_SECONDS)
    rows = [(row[0], row[1], row[2], row[3] + lift * (1.0 if row[0] <= 0.0 else max(1.0 - row[0] / seconds, 0.0)),
             *row[4:]) for row in reception.foot]
    return replace(reception, foot=tuple(rows))


def _interpolate_height(reception: Reception, ends: tuple[float, float]) -> float:
    """Interpolate between the values for a low and for a high ball by the ankle's height at the touch."""
    height = next((row[3] for row in reception.foot if row[0] == 0.0), 0.0)
    return float(np.interp(height, (_LOW, _HIGH), ends))


def _stand(reception: Reception) -> Volley:
    """Convert a reception to one out of standing: the weight shifts to the left foot, or stays between both."""
    beside, low, nod = 0.075 if reception.foot else 0.0, reception.low, reception.nod
    hips = tuple((time, 0, beside * (1.0 if time == 0.0 else 0.8), share * low)
                 for time, share in reception.sink or _STANDING_SINK)
    return Volley(
        labels=" ".join(reception.labels), span=_SPAN, foot=reception.foot or None,
        hips=((_SPAN[0], 0, 0, 0), *hips, (_SPAN[1], 0, 0, 0)),
        pelvis=reception.pelvis, spine=reception.spine, left_arm=reception.left_arm, right_arm=reception.right_arm,
        head=((-0.6, 4, 0), (0.0, nod, 0), (0.4, nod if nod > 0.0 else _LOOKS_DOWN, 0), (_SPAN[1], 0, 0)),
    )  # fmt: skip


def travel_with_ball(reception: Reception, speed: float) -> StrikeRecipe:
    """Convert a reception to one on the way at `speed` m/s.

    The body slows down, and the step in which it takes the ball lasts longer, most of all a walker's, whose swing is
    short: the foot has to be out and give within it. A run sinks into each step anyway.
    """
    run = float(np.clip((speed - _WALK) / (_RUN - _WALK), 0.0, 1.0))
    low = reception.low * (1.0 - 0.8 * run)
    slowed, pace = (walking + run * (running - walking) for walking, running in (_SLOWED, _PACE))
    slowed *= reception.slows
    return StrikeRecipe(
        foot=reception.foot, pelvis=reception.pelvis, spine=reception.spine, left_arm=reception.left_arm,
        right_arm=reception.right_arm, head=reception.nod,
        pace=pace * _interpolate_height(reception, (1.0, _HIGH_PACE)), at=_interpolate_height(reception, _SWING_SHARE),
        speeds=tuple((time, (1.0 - slowed * share) * speed) for time, share in _SLOWING),
        sink=tuple((time, share * low) for time, share in reception.sink or _SINK),
    )


def _build_action(kind: str, setting: ActionSetting) -> Gesture:
    height = None if setting.height is None else setting.height / setting.scale
    return build_reception(kind, setting.skeleton, setting.fps, setting.speed, height=height, example=setting.example)


def _build_row(kind: str) -> Action:
    """Build the row of a reception: the inside of the foot serves most balls, outside and sole some as well."""
    one = RECEPTIONS[kind]
    return Action(
        name=one.name, labels=frozenset({*one.labels, "standing", "running", "front"}), has_side=kind != "head",
        least_lead=one.least_lead, suits=(one.speeds[0], np.inf) if np.isfinite(one.least_lead) else None,
        build=partial(_build_action, kind), heights=one.heights, most_ball_speed=one.most_ball_speed,
        speeds=tuple(speed for speed in SPEEDS if one.speeds[0] <= speed <= one.speeds[1]),
        varies=RECEPTIONS["inside"].name if kind in ("outside", "sole") else "",
    )  # fmt: skip


_JUMPS = (
    Action(name="reception with the head in a jump", labels=frozenset({"receive", "head", "standing", "jump", "front"}),
           build=build_jumping_header, heights=(1.9, 2.6)),
    Action(name="reception with the head in a jump on the run", build=build_running_jump, speeds=SPEEDS[3:],
           labels=frozenset({"receive", "head", "running", "jump", "front"}), heights=(1.9, 2.6)),
)  # fmt: skip
RECEPTION_ACTIONS = (*(_build_row(kind) for kind in RECEPTIONS if kind != "let run"), *_JUMPS)
LET_RUN_ACTIONS = (_build_row("let run"),)
"""Rows of `actions.table`."""
