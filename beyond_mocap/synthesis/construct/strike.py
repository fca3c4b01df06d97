"""Bring the ball and the striking part together: at each key moment the part is on the ball's surface, eased in and
out.

First the ball moves, within the noise of its measurement, to where the recorded foot (head, chest, hand) strikes. The
limb does the rest by two-bone inverse kinematics, or the spine by bending, within the reach of a body; where that is
not enough the pelvis steps towards the ball within the noise of its own track (`step_to_ball`); what remains is
reported. A kick lasts a hundredth of a second, so between the two frames around the key moment the ball moves with the
foot; a ball that is taken stays longer on it (`give`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...annotation.ball_contact import find_contact_window, measure_contact_gap
from ...motion.motion import compute_pose
from ...motion.skeleton import Skeleton
from .ball_touch.reach_ball import calm_taking_foot, reach_ball
from .ball_touch.touch_frames import Touch, find_nearest_frame, iter_touch_frames
from .ball_touch.touch_problem import BALL_NOISE, build_problem
from .contact_geometry import shift_ball_eased
from .give import give_with_ball
from .move_body_part import Body


@dataclass(frozen=True, eq=False)
class StrikeResult:
    """A motion with the ball met at every touch.

    Attributes:
        root: (T, 3) m, world.
        rotations: (T, J, 4) local.
        ball: (T, 3) m, its centre.
        gap: (K,) m between the surfaces at the frame nearest to each touch; NaN where the labels touch no ball or there
            is no ball, as in the next two.
        ball_shift: (K,) m on the ground that the ball was moved there.
        moved: (K,) m that the part was moved.
    """

    root: np.ndarray
    rotations: np.ndarray
    ball: np.ndarray
    gap: np.ndarray
    ball_shift: np.ndarray
    moved: np.ndarray


def strike_ball(
    skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, contacts: np.ndarray, ball: np.ndarray,
    touches: Sequence[Touch], fps: float, *, measured: np.ndarray | None = None, height_known: np.ndarray | None = None,
) -> StrikeResult:
    """Bring ball and body together at every touch, within the reach of a body.

    Frames outside the touches' windows stay bit for bit.

    Args:
        skeleton: the skeleton.
        root: (T, 3) m, the motion on the pitch, feet planted.
        rotations: (T, J, 4) local.
        contacts: (T, 2) bool, left and right foot in contact; a striking foot changes only between lift-off and
            landing.
        ball: (T, 3) m, its centre, NaN where it is unknown.
        touches: where the ball is met.
        fps: frames per second.
        measured: (T,) bool, False where the feed filled the ball in; None: measured everywhere.
        height_known: (T,) bool, where the ball's height is measured; None: everywhere. Elsewhere the ball lies on the
            ground, except at high touches, to which it rises and from which it falls freely.
    """
    count = len(root)
    measured, height_known = (np.ones(count, bool) if flags is None else np.asarray(flags, bool)
                              for flags in (measured, height_known))
    root, rotations, samples = (np.array(values, dtype=float) for values in (root, rotations, ball))
    path, moved = samples.copy(), np.full(len(touches), np.nan)
    touches = [_move_to_contact(skeleton, root, rotations, feed=samples, touch=touch, fps=fps) for touch in touches]
    for number, moment in iter_touch_frames(skeleton, touches, count, fps):
        if not np.isfinite(samples[list(moment.held)]).all():
            continue
        place = touches[number].place
        if place is not None:
            path = shift_ball_eased(path, (moment.frame, moment.frame), np.array([place, place]), moment.bounds, fps)
        span = slice(max(moment.low, 0), min(moment.high, count - 1) + 1)
        body = Body.from_pose(skeleton, root[span], rotations[span])
        scene = build_problem(body, moment, span.start, contacts=contacts[span], path=path, measured=measured,
                               height_known=height_known, fps=fps)
        reached, moved[number] = reach_ball(scene, body)
        reached = calm_taking_foot(scene, reached, contacts[span], fps)
        root[span], rotations[span] = reached.root, reached.rotations
        places = [scene.solve_ball(scene.compute_surface_lines(reached, frame), frame)[0] for frame in moment.held]
        path = shift_ball_eased(scene.ball, moment.held, np.array(places), moment.bounds, fps)
        path = give_with_ball(skeleton, root, rotations, path, held=moment.held, words=moment.words,
                              until=moment.bounds[1], fps=fps)
    gap, shift = _measure_gaps(skeleton, root, rotations, feed=samples, path=path, touches=touches)
    return StrikeResult(root, rotations, path, gap=gap, ball_shift=shift, moved=moved)


def _move_to_contact(skeleton: Skeleton, root, rotations, feed, touch: Touch, fps: float) -> Touch:
    """Move a touch to the frame at which a hand passes the ball nearest.

    Only where the labels allow for that and the ball is out of reach at the key moment itself.
    """
    if touch.place is not None:
        return touch
    latest = touch.frame + find_contact_window(touch.words) * fps
    first, last = (find_nearest_frame(frame, len(root)) for frame in (touch.frame, latest))
    if first == last or not np.isfinite(feed[first : last + 1]).all():
        return touch
    places, world = compute_pose(skeleton, root[first : last + 1], rotations[first : last + 1])
    gaps = measure_contact_gap(skeleton, places, world, touch.words, feed[first : last + 1])
    later = int(np.argmin(gaps))
    if not later or gaps[0] < BALL_NOISE:
        return touch
    return replace(touch, frame=float(first + later), entry=touch.entry + later, leave=touch.leave - later)


def _measure_gaps(skeleton: Skeleton, root, rotations, feed, path, touches) -> tuple[np.ndarray, np.ndarray]:
    """Measure gap (K,) m and level shift of the ball (K,) m at the frame nearest to each touch."""
    frames = np.array([find_nearest_frame(touch.frame, len(root)) for touch in touches], dtype=int)
    places, world = compute_pose(skeleton, root[frames], rotations[frames])
    rows = zip(places, world, touches, path[frames])
    gaps = [measure_contact_gap(skeleton, place, turn, touch.words, ball) for place, turn, touch, ball in rows]
    shift = np.linalg.norm((path - feed)[frames, :2], axis=1)
    return np.abs(np.array(gaps, dtype=float)), np.where(np.isfinite(gaps), shift, np.nan)
