"""Key moments of a take: which clip served each, when its key frame is played, and where body and ball were."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...annotation import KeyMoment
from ...annotation.ball_contact import (
    choose_contact_labels,
    find_contact_window,
    list_contact_labels,
    measure_contact_gap,
    takes_with_foot,
)
from ...annotation.striking import build_part_surfaces, measure_smallest_gap
from ...library.clip import SYNTHETIC_FOLDER
from ...library.library import Library
from ...library.missing_actions import add_actions
from ...motion.track import Track
from ..take import DribbleTouch
from .playback import Playback, find_transitions, number_pieces


@dataclass(frozen=True, kw_only=True)
class KeyMomentResult:
    """How one key moment was served.

    Attributes:
        requested: the key moment of the timeline.
        frame: output frame nearest to its resolved time (the requested or the solved one).
        clip: path of the clip, None where no key of a clip is played there.
        clip_frame: the clip's key frame, in its own rate, None as above.
        played_at: s on the track's clock at which that key frame is played, NaN where it is not.
        words: labels that the source carries at `frame`.
        entry: first output frame, without a transition between, that the clip's annotated row covers.
        exit: last one.
        used_instead: the labels used where the library lacks the requested ones, else None.
    """

    requested: KeyMoment
    frame: int
    clip: str | None
    clip_frame: float | None
    played_at: float
    words: tuple[str, ...]
    entry: int
    exit: int
    used_instead: tuple[str, ...] | None

    @property
    def contact_labels(self) -> tuple[str, ...]:
        """Labels that define the part that meets the ball (`ball_contact.list_contact_labels`)."""
        return list_contact_labels(self.words, self.requested)


def evaluate_moments(played: Playback, keys: tuple[KeyMoment, ...], stride: np.ndarray, library: Library
                     | None) -> list[KeyMomentResult]:
    """Evaluate every requested key moment as it was played.

    Args:
        played: the take as played.
        keys: the requested key moments.
        stride: (T,) source frames per output frame at recorded speed.
        library: the recordings, None where it is not known.
    """
    starts = find_transitions(played.clip, played.mirrored, played.clip_frame, stride)
    number = number_pieces(len(played.clip), starts)
    results = {result.requested: result for result in played.keys}
    library = extend_with_synthetic(library, played)
    return [_evaluate_moment(played, key, number, results.get(key), library) for key in keys]


def extend_with_synthetic(library: Library | None, played: Playback) -> Library | None:
    """Return the library that was played: with its synthetic clips where one of them is shown."""
    if library is None or not any(path.startswith(SYNTHETIC_FOLDER) for path in played.clips):
        return library
    return add_actions(library.with_synthetic_clips, played.clips)


def _evaluate_moment(played: Playback, key: KeyMoment, number: np.ndarray, result, library: Library
                     | None) -> KeyMomentResult:
    """Evaluate one key moment."""
    frame = _nearest_frame(played, (key.resolved_time - played.start_time) * played.motion.fps)
    run = np.flatnonzero(number == number[frame if result is None else _nearest_frame(played, result.frame)])
    words = () if played.words is None else tuple(played.words[frame])
    found = _find_key(played, run, frame, key, library)
    instead = _choose_used_instead(key, words if found is None else found.labels, result)
    if found is None:
        known = played.clip[frame] >= 0
        clip, source = (played.clips[played.clip[frame]], float(played.clip_frame[frame])) if known else (None, None)
        return KeyMomentResult(requested=key, frame=frame, clip=clip, clip_frame=source, played_at=np.nan, words=words,
                               entry=frame, exit=frame, used_instead=instead)
    inside = run[(played.clip_frame[run] >= found.start) & (played.clip_frame[run] <= found.end)]
    entry, leave = (inside[0], inside[-1]) if len(inside) else (frame, frame)
    at = find_crossing(played.clip_frame[run], played.times[run], found.frame)
    clip = played.clips[played.clip[run[0]]]
    return KeyMomentResult(requested=key, frame=frame, clip=clip, clip_frame=found.frame, played_at=at, words=words,
                           entry=int(entry), exit=int(leave), used_instead=instead)


def _nearest_frame(played: Playback, frame: float) -> int:
    """Return the output frame nearest to a fractional one."""
    return int(np.clip(np.rint(frame), 0, len(played.motion) - 1))


def _find_key(played: Playback, run: np.ndarray, frame: int, key: KeyMoment, library: Library | None):
    """Find the library key that the run plays: with the requested labels if any, then nearest to `frame`."""
    if library is None or played.clip[run[0]] < 0:
        return None
    path, side = played.clips[played.clip[run[0]]], bool(played.mirrored[run[0]])
    known = (*library.keys, *library.cut_receptions) if takes_with_foot(key.words) else library.keys
    own = [k for k in known if library.clips[k.clip].path == path and library.clips[k.clip].mirrored == side]
    own = [k for k in own if np.isfinite(find_crossing(played.clip_frame[run], played.times[run], k.frame))]
    carrying = [k for k in own if set(key.words) <= set(k.labels)] or own
    return min(carrying, key=lambda k: abs(k.frame - played.clip_frame[frame]), default=None)


def _choose_used_instead(key: KeyMoment, words, result) -> tuple[str, ...] | None:
    """Return the labels used instead of the requested ones, by the take or by what is played there."""
    if result is not None and result.used_instead is not None:
        return tuple(result.used_instead)
    return None if set(key.words) <= set(words) else tuple(sorted(words))


def find_crossing(clip_frames: np.ndarray, times: np.ndarray, key_frame: float) -> float:
    """Find when a run plays a key frame.

    Up to one output frame before or after the run its rate continues.

    Args:
        clip_frames: (R,) ascending.
        times: (R,) s.
        key_frame: in the clip's own rate.
    Returns:
        Seconds, NaN where it is never played.
    """
    if len(times) < 2 or not np.all(np.diff(clip_frames) > 0):
        hit = np.flatnonzero(np.abs(clip_frames - key_frame) < 0.5)
        return float(times[hit[0]]) if len(hit) else np.nan
    first, last = clip_frames[1] - clip_frames[0], clip_frames[-1] - clip_frames[-2]
    step = times[1] - times[0]
    longer = np.concatenate([[clip_frames[0] - first], clip_frames, [clip_frames[-1] + last]])
    if not longer[0] <= key_frame <= longer[-1]:
        return np.nan
    return float(np.interp(key_frame, longer, np.concatenate([[times[0] - step], times, [times[-1] + step]])))


def measure_ball_gap(played: Playback, moment: KeyMomentResult) -> float:
    """Measure the distance between the striking surface and the surface of the written ball at a key moment.

    Measured at the output frame nearest to the requested time (`ball_contact.measure_contact_gap`, overlap counts as
    distance too). The part is that of the labels played there; of the requested ones where those touch no ball.

    Returns:
        m, NaN without ball or part.
    """
    if played.ball is None:
        return np.nan
    pose = played.positions[moment.frame], played.rotations[moment.frame]
    ball = find_written_ball(played, moment.frame)
    return abs(float(measure_contact_gap(played.motion.skeleton, *pose, moment.contact_labels, ball)))


def measure_miss(played: Playback, moment: KeyMomentResult) -> float:
    """Measure how far the reaching part stays from the ball's surface at a key moment that misses it by design.

    Returns:
        m, NaN for other key moments, and without ball or part.
    """
    if played.ball is None or not moment.requested.misses_ball:
        return np.nan
    pose = played.positions[moment.frame], played.rotations[moment.frame]
    labels = choose_contact_labels(moment.words, moment.requested.words)
    return float(measure_contact_gap(played.motion.skeleton, *pose, labels, find_written_ball(played, moment.frame)))


def measure_contact(played: Playback, moment: KeyMomentResult) -> tuple[float, float]:
    """Measure when the ball is met, and the gap there.

    Both are at the key moment, except for dives, in which a hand meets the ball at its nearest on the flight
    (`ball_contact.find_contact_window`).

    Returns:
        Seconds on the track's clock and m, as in `measure_ball_gap`; NaN without ball or part.
    """
    last = min(moment.frame + int(find_contact_window(moment.contact_labels) * played.motion.fps),
               len(played.motion) - 1)
    frames = range(moment.frame, last + 1)
    gaps = [measure_ball_gap(played, replace(moment, frame=frame)) for frame in frames]
    if not np.isfinite(gaps).any():
        return np.nan, np.nan
    nearest = int(np.nanargmin(gaps))
    return float(played.times[frames[nearest]]), gaps[nearest]


def find_written_ball(played: Playback, frame: int) -> np.ndarray:
    """Return the ball's centre (3,) m as written with the take, at the row nearest to an output frame's time."""
    row = int(np.argmin(np.abs(played.ball.times - played.times[frame])))
    return played.ball.positions[row]


def measure_dribble_touches(played: Playback, touches: Sequence[DribbleTouch], track: Track | None) -> list[dict]:
    """Measure every touch of a dribble.

    Args:
        played: the take as played.
        touches: the touches.
        track: the player's track, None where it is not known.
    Returns:
        Per touch its second, the foot, the largest gap between foot and ball while it lasts, and how far the ball is
        from its samples where it begins, m.
    """
    return [
        {"time_s": float(played.times[touch.first]), "side": touch.side,
         "contact_gap_m": max(_measure_foot_gap(played, frame, touch.side)
                              for frame in range(touch.first, touch.last + 1)), "ball_shift_m": None if track is None
         else measure_ball_shift(played, touch.first, track),} for touch in touches
    ]  # fmt: skip


def _measure_foot_gap(played: Playback, frame: int, side: str) -> float:
    """Measure the gap, m, between a foot and the ball at a frame."""
    pose = played.positions[frame], played.rotations[frame]
    foot = build_part_surfaces(played.motion.skeleton, "foot", (side,))
    return abs(float(measure_smallest_gap(foot, *pose, find_written_ball(played, frame))))


def measure_ball_shift(played: Playback, frame: int, track: Track) -> float:
    """Measure how far on the ground the written ball is from the measured one (linear between samples).

    Returns:
        m, NaN where either is missing.
    """
    times, places = track.known_ball
    if played.ball is None or not len(times):
        return np.nan
    measured = [np.interp(played.times[frame], times, places[:, axis]) for axis in (0, 1)]
    return float(np.linalg.norm(find_written_ball(played, frame)[:2] - measured))
