"""Where a body is at the ball, and the same for a character: which of its joints has to bring which skin to the ball.

A touch is found on the body that the take was made for, by the surfaces that its labels name, on the frames that the
scene shows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...beyond_mocap.base.time_series import find_runs, interpolate_columns
from ...beyond_mocap.motion.motion import Motion, forward_kinematics
from ...beyond_mocap.motion.track import BALL_RADIUS

if TYPE_CHECKING:
    from ...beyond_mocap.synthesis.take import DribbleTouch, Take

_AT_BALL = 0.03  # m of gap up to which a part is at the ball, as in `synthesis.resolved_touches`
_NEAR_SECONDS = 0.5  # around a key moment in which its touch is looked for
_MOVED_PARTS = {"foot": "foot", "hand": "hand", "head": "head", "thigh": "upper_leg", "chest": ""}


@dataclass(frozen=True, eq=False)
class BallTouch:
    """A surface of the source's body at the ball.

    Attributes:
        part, side: as in `annotation.striking.Surface`.
        frames: (N,) consecutive frames of the source's motion.
        ball: (N, 3) m, the ball's centre.
        distance: (N,) m from there to the surface.
    """

    part: str
    side: str
    frames: np.ndarray
    ball: np.ndarray
    distance: np.ndarray


def list_touch_times(take: Take) -> np.ndarray:
    """List the times (N,) s, on its clock and rising, at which a take's body is to be at the ball."""
    from ...beyond_mocap.annotation.ball_contact import find_striking_part

    if take.ball is None:
        return np.zeros(0)
    frames = [key.frame for key in take.keys if find_striking_part(key.contact_labels)]
    frames += [_find_middle(push) for push in take.dribble_touches]
    return take.start_time + np.sort(frames) / take.motion.fps


def list_ball_touches(take: Take, motion: Motion, seconds: np.ndarray) -> tuple[BallTouch, ...]:
    """List the touches of the ball in a take.

    Args:
        take: the take.
        motion: F frames of it, as displayed.
        seconds: (F,) of these frames on the take's clock.
    Returns:
        The touches, none where the take has no ball.
    """
    from ...beyond_mocap.annotation.ball_contact import build_surfaces
    from ...beyond_mocap.annotation.striking import build_part_surfaces

    if take.ball is None:
        return ()
    ball = interpolate_columns(seconds, take.ball.times, take.ball.positions, fill_value=np.nan)
    fps, pose, found = take.motion.fps, forward_kinematics(motion), []
    wanted = [(take.start_time + key.frame / fps, surface) for key in take.keys
              for surface in build_surfaces(motion.skeleton, key.contact_labels)]
    wanted += [(take.start_time + _find_middle(push) / fps, surface) for push in take.dribble_touches
               for surface in build_part_surfaces(motion.skeleton, "foot", (push.side,))]
    for moment, surface in wanted:
        touch = _find_touch(surface, pose, ball, seconds, moment)
        if touch is not None:
            found.append(touch)
    return _drop_overlaps(found)


def _find_middle(push: DribbleTouch) -> float:
    return 0.5 * (push.first + push.last)


def _find_touch(surface, pose, ball: np.ndarray, seconds: np.ndarray, moment: float) -> BallTouch | None:
    """Find the frames around a moment in which a surface is at the ball; None where it is not."""
    from ...beyond_mocap.annotation.striking import measure_ball_gap

    near = np.flatnonzero((np.abs(seconds - moment) <= _NEAR_SECONDS) & np.isfinite(ball).all(axis=1))
    if not len(near):
        return None
    places, world = (values[near] for values in pose)
    gaps = measure_ball_gap(surface.compute_line(places, world), surface.radius, ball[near])
    runs = [range(first, end) for first, end in find_runs(np.abs(gaps) < _AT_BALL)]
    run = min(runs, key=lambda one: np.abs(seconds[near[list(one)]] - moment).min(), default=())
    if not len(run) or np.abs(seconds[near[list(run)]] - moment).min() > 0.1:
        return None
    rows = np.array(run)
    return BallTouch(surface.part, surface.side, near[rows], ball[near[rows]],
                     BALL_RADIUS + np.maximum(gaps[rows], 0.0))


def _drop_overlaps(touches: list[BallTouch]) -> tuple[BallTouch, ...]:
    """Drop touches of a part on frames that an earlier one has already."""
    kept, taken = [], set()
    for touch in sorted(touches, key=lambda one: int(one.frames[0])):
        frames = {(touch.part, touch.side, int(frame)) for frame in touch.frames}
        if not frames & taken:
            kept.append(touch)
            taken |= frames
    return tuple(kept)


def build_part_touches(touches: tuple[BallTouch, ...], parts: list[str], skin: dict[str, np.ndarray]):
    """Build the touches of a character from those of its source.

    Args:
        touches: of the source's body.
        parts: of the character's joints.
        skin: the character's, by part.
    Returns:
        `PartTouch` for each touch by a part that the character has skin on.
    """
    from ...beyond_mocap.motion.retargeting.match_contacts import PartTouch

    found = []
    for touch in touches:
        chest = max((part for part in parts if part.startswith("spine")), default="hips")
        moved = f"{touch.side} {_MOVED_PARTS[touch.part]}".strip() if _MOVED_PARTS[touch.part] else chest
        own = [part for part in (moved, f"{touch.side} toe" if touch.part == "foot" else "") if part in skin]
        if moved in parts and own:
            found.append(PartTouch(joint=parts.index(moved), points={parts.index(part): skin[part] for part in own},
                                   frames=touch.frames, ball=touch.ball, distance=touch.distance))
    return tuple(found)
