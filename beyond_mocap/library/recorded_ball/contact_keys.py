"""When a recorded ball is met: key moments of a clip move to the frames of their contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...annotation import ClipAnnotation
from ...annotation.ball_contact import SENDING, comes_from_hands, find_striking_part, measure_contact_gap
from ...base.errors import format_count
from ...base.time_series import find_runs
from ...motion.motion import Motion, compute_pose
from ...motion.track import BALL_RADIUS

_KEY_SECONDS = 0.4  # by which an annotated key moment may be off its contact
_REACH = 0.15  # m between ball and part at a contact: a ball's marker lies on its surface, a skeleton has no skin
_RELEASE = 0.02  # s by which a release is found too late: the hand follows the ball; a key moment so near stays
_CHANGE_SECONDS = 0.03  # before and after a contact over which the ball's velocity is measured
_CHANGE = 1.0  # m/s by which a contact changes the ball's velocity
_STRIKE_SHARE = 0.5  # of the largest change near, that a strike changes the ball's velocity by at least
_BOUNCE_HEIGHT, _BOUNCE_SHARE = 0.05, 0.4  # m above rest, and level share of the change, of a ball that only bounces


def find_contact_frame(motion: Motion, ball: np.ndarray, row: ClipAnnotation) -> float | None:
    """Find the frame in which the part that a key moment's labels name meets the ball.

    That is where the ball's velocity changes while the part is near; of labels that send the ball, where it changes
    about as much as anywhere near: a touch of the run-up is no kick. Of a throw from the hands it is where the hand is
    last near.

    Args:
        motion: T frames.
        ball: (T, 3) m, NaN where it is not known.
        row: an annotation with a key moment.
    Returns:
        The frame, fractional, within 0.4 s of the key moment and within the row; None where there is none.
    """
    if row.key is None or find_striking_part(row.words) is None:
        return None
    width = max(1, round(_CHANGE_SECONDS * motion.fps))
    reach = int(np.ceil(_KEY_SECONDS * motion.fps))
    first, last = max(0, int(row.key) - reach - width), min(len(motion), int(row.key) + reach + width + 2)
    part = motion.frames(first, last)
    pose = compute_pose(part.skeleton, part.root_positions, part.rotations)
    gap = measure_contact_gap(part.skeleton, *pose, row.words, ball[first:last])
    is_near = np.nan_to_num(gap, nan=np.inf) <= _REACH
    if comes_from_hands(row.words):
        frames = [_find_release(gap, *run) for run in find_runs(is_near) if run[1] < len(gap)]
    else:
        changes = [change for change in _find_course_changes(ball[first:last], width, motion.fps)
                   if is_near[max(0, round(change.frame) - width) : round(change.frame) + width + 1].any()]
        largest = max((change.size for change in changes), default=0.0)
        least = _STRIKE_SHARE * largest if SENDING.intersection(row.words) else 0.0
        frames = [change.frame for change in changes if change.size >= least]
    low, high = max(row.key - reach, min(row.start, row.key)), min(row.key + reach, max(row.end, row.key))
    if row.start == row.end:  # a key moment without a span
        low, high = row.key - reach, row.key + reach
    found = [first + frame for frame in frames if low <= first + frame <= high]
    frame = min(found, key=lambda frame: abs(frame - row.key), default=None)
    is_late = frame is not None and comes_from_hands(row.words) and abs(frame - row.key) <= _RELEASE * motion.fps
    return row.key if is_late else frame


def _find_release(gap: np.ndarray, start: int, end: int) -> float:
    """Find the frame, fractional, at which a ball leaves a hand that has been near in frames start .. end - 1, from
    gaps (N,) m: where the growing gap, taken back, is as it was while the ball was held.
    """
    grown, rate = gap[end - 1] - np.median(gap[start:end]), gap[end] - gap[end - 1]
    return float(np.clip(end - 1 - max(grown, 0.0) / max(rate, 1e-6), start, end - 1))


class _CourseChange(NamedTuple):
    """A change of the ball's velocity: the frame, fractional, and its size in m/s."""

    frame: float
    size: float


def _find_course_changes(ball: np.ndarray, width: int, fps: float) -> list[_CourseChange]:
    """Find where the ball (T, 3) m changes its velocity otherwise than by a bounce.

    width: frames before and after over which its velocity is measured.
    """
    if len(ball) < 2 * width + 1:
        return []
    velocity = (ball[width:] - ball[:-width]) * (fps / width)
    change = np.zeros_like(ball)
    change[width:-width] = np.nan_to_num(velocity[width:] - velocity[:-width])
    size = np.linalg.norm(change, axis=1)
    found = []
    for frame in np.flatnonzero(size >= _CHANGE).tolist():
        around = slice(max(0, frame - width), frame + width + 1)
        is_peak = size[frame] >= size[around].max() and not (size[around.start : frame] >= size[frame]).any()
        is_low = ball[around, 2].min() <= BALL_RADIUS + _BOUNCE_HEIGHT
        is_level = np.linalg.norm(change[frame, :2]) >= _BOUNCE_SHARE * size[frame]
        if is_peak and (is_level or not is_low):
            middle = float(np.average(np.arange(len(ball))[around], weights=size[around]))
            found.append(_CourseChange(middle, float(size[frame])))
    return found


def move_keys_to_contacts(motions: Sequence[Motion], balls: Sequence[np.ndarray | None],
                          rows: Sequence[tuple[ClipAnnotation, ...]],
                          notes: list[str]) -> list[tuple[ClipAnnotation, ...]]:
    """Move key moments to the frames in which the recorded balls are met; notes get a line where any moved.

    Args:
        motions: of the clips.
        balls: (T, 3) m each, None for clips without a ball.
        rows: annotations of each clip, in its own frames.
        notes: lines for the user.
    """
    out, moved, found = [], [], 0
    for motion, ball, own in zip(motions, balls, rows):
        contacts = [None if ball is None else find_contact_frame(motion, ball, row) for row in own]
        moved += [abs(frame - row.key) / motion.fps for frame, row in zip(contacts, own)
                  if frame is not None and row.key is not None]
        out.append(tuple(row if frame is None else _move_key(row, frame) for frame, row in zip(contacts, own)))
        found += ball is not None
    if found:
        keys = f"; {format_count(len(moved), 'key moment')} at the contact with it"
        middle = f", moved by {np.median(moved):.2f} s (median)" if moved else ""
        notes.append(f"a ball is recorded in {format_count(found, 'clip')}{keys}{middle}")
    return out


def _move_key(row: ClipAnnotation, frame: float) -> ClipAnnotation:
    """Move a key moment; the span of one that has none moves along."""
    if row.start == row.end:
        return replace(row, start=frame, end=frame, key=frame)
    return replace(row, key=frame)
