"""Leave the own path of a body for a throw some seconds before it, and return to it some seconds after.

Run-up and recovery come from a library (`run_up`) for the seconds around the throw; the rest stays unchanged.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..base.errors import TimedMessage
from ..library.library import Library
from ..motion.humanoid import estimate_stature
from ..motion.motion import Motion, forward_kinematics, resample
from ..motion.track import Track, smooth_zero_phase_hann
from ..synthesis.construct.contact_geometry import ease_in_out
from ..synthesis.plan import Plan
from .join_throw import FADE, blend_bodies, hold_ends
from .run_up import SMOOTHING_WINDOW, RunUpResult, construct_run_up

MAX_SECONDS_OFF_PATH = 4.5
"""Seconds before and after a throw in which a body may leave its own path."""

_MIN_STOP_SECONDS = 1.0  # s, shortest time in which a body stops or starts
_ACCELERATION = 2.5  # m/s^2, acceleration of a body that stops or starts
_MAX_SPEED_RATIO = 1.2  # warning above this multiple of the speed of the library, or of the body itself


@dataclass(frozen=True, eq=False, kw_only=True)
class _Stretch:
    """Frames of a motion around a throw.

    Attributes:
        own_motion: the motion with its ends held.
        start: s of its first frame.
        low: first frame that may change.
        first: first frame of the throw.
        end: frame after the throw.
        high: frame after the last that may change.
        returns: whether the body returns to its own path.
    """

    own_motion: Motion
    start: float
    low: int
    first: int
    end: int
    high: int
    returns: bool


def leave_path(
    library: Library, own: Motion, start: float, throw: Motion, release: float, *, at: float, action: str = "throw",
    progress: Callable[[float, str], None] | None = None, cancelled: Callable[[], bool] | None = None,
) -> RunUpResult:
    """Construct a motion with a run-up to a throw and a recovery from a library.

    The body leaves its own path and returns to it where both have the most similar poses; elsewhere it stays bit for
    bit. `join_throw` then inserts the throw.

    Args:
        library: the clips.
        own: the body's motion, on the throw's skeleton.
        start: s of its first frame.
        throw: the throw at its final position.
        release: s in the throw at which the ball leaves.
        at: approximate s of the release on the clock of `own`.
        action: "throw" or "kick".
        progress: receives a share of 0 .. 1 and a text.
        cancelled: returns True to stop.
    """
    stretch = _find_stretch(own, start, throw, release, at)
    motion_around = stretch.own_motion.frames(stretch.low, stretch.high)
    run_up = construct_run_up(
        library, _build_plan(library, stretch), throw, release, at, action=action, progress=progress,
        cancelled=cancelled, between=motion_around,
    )  # fmt: skip
    left, returned = _find_edges(stretch, run_up.motion, motion_around)
    root, rotations = _blend_stretch(stretch, run_up.motion, left, returned)
    seams = np.array([stretch.low + left, *(run_up.transitions + stretch.low), stretch.low + returned])
    return RunUpResult(
        motion=Motion(stretch.own_motion.skeleton, root, rotations, stretch.own_motion.fps), start=stretch.start,
        transitions=seams, warnings=(*run_up.warnings, *_list_warnings(stretch, library, root)),
    )


def _find_stretch(own: Motion, start: float, throw: Motion, release: float, at: float) -> _Stretch:
    """Find the frames around a throw; without time to return, the following motion continues from the throw's end."""
    fps = own.fps
    first = int(round((at - release - start) * fps))
    own, start, first, end = hold_ends(own, start, first - 1, first + len(resample(throw, fps)) + 1)
    low, high = max(first - int(MAX_SECONDS_OFF_PATH * fps), 0), min(end + int(MAX_SECONDS_OFF_PATH * fps), len(own))
    last = throw.root_positions[-1, :2]
    comes_back = _compute_speed(own.root_positions[high - 1, :2] - last, high - end, fps) <= _compute_easy_speed(own)
    own = own if comes_back else _continue_from(own, end, last)
    return _Stretch(own_motion=own, start=start, low=low, first=first, end=end, high=high, returns=comes_back)


def _build_plan(library: Library, part: _Stretch) -> Plan:
    """Build a plan from the body's own path around the throw."""
    fps = part.own_motion.fps
    times = part.start + np.arange(part.low, part.high) / fps
    path = smooth_zero_phase_hann(part.own_motion.root_positions[part.low : part.high, :2], fps, SMOOTHING_WINDOW)
    return Plan(track=Track(times, path, None), library=library.folder, fps=fps,
                height=estimate_stature(part.own_motion.skeleton))


def _find_edges(part: _Stretch, new: Motion, old: Motion) -> tuple[int, int]:
    """Find the frames, from `low` on, at which the body leaves its own path and has returned to it."""
    count, fade = min(len(new), len(old)), int(FADE * part.own_motion.fps)
    distances = np.linalg.norm(
        forward_kinematics(new)[0][:count] - forward_kinematics(old)[0][:count], axis=-1
    ).mean(axis=1)  # fmt: skip
    leaves = _find_most_similar(distances, 0, part.first - part.low - fade, fade) if part.low else 0
    ends = part.high == len(part.own_motion)
    return leaves, count if ends else _find_most_similar(distances, part.end - part.low + fade, count, fade)


def _blend_stretch(part: _Stretch, new: Motion, leaves: int, comes: int) -> tuple[np.ndarray, np.ndarray]:
    """Blend the new motion into the own one between its edges; return root (T, 3) m and rotations (T, J, 4)."""
    own, low, fade = part.own_motion, part.low, int(FADE * part.own_motion.fps)
    at, none = np.arange(len(own)) - low, np.zeros(len(own))
    before = (leaves + fade - at) / (fade + 1.0) if low else none
    behind = (at - comes + 1) / (fade + 1.0) if part.high < len(own) else none
    share = ease_in_out(np.maximum(before, behind), np.ones(len(own)))
    root, rotations = own.root_positions.copy(), own.rotations.copy()
    count = min(len(new), part.high - low)
    root[low : low + count], rotations[low : low + count] = new.root_positions[:count], new.rotations[:count]
    return blend_bodies(own.skeleton, (root, rotations), (own.root_positions, own.rotations), share)


def _list_warnings(part: _Stretch, library: Library, root: np.ndarray) -> list[str]:
    """List warnings about a missing return and a high speed."""
    fps = part.own_motion.fps
    warnings: list[str] = []
    if not part.returns:
        when = part.start + part.end / fps
        text = (f"{when:.1f} s: no time to return to the own path; the following motion continues from the end of the "
                "throw or kick")
        warnings.append(TimedMessage(text, (when, when)))
    fastest = float(np.linalg.norm(np.diff(root[part.low : part.high, :2], axis=0), axis=1).max() * fps)
    if fastest > _MAX_SPEED_RATIO * max(library.max_speed, _compute_easy_speed(part.own_motion)):
        warnings.append(
            f"the body has to move at {fastest:.1f} m/s around the throw or kick: choose another frame or target"
        )
    return warnings


def is_in_reach(own: Motion, start: float, throw: Motion, release: float, at: float) -> bool:
    """Return whether a body can reach the start of the throw in time from its own path without hurrying much."""
    first = int(np.clip(round((at - release - start) * own.fps), 0, len(own) - 1))
    low = max(first - int(MAX_SECONDS_OFF_PATH * own.fps), 0)
    offset = throw.root_positions[0, :2] - own.root_positions[low, :2]
    return _compute_speed(offset, first - low, own.fps) <= _compute_easy_speed(own)


def find_stopping_position(own: Motion, start: float, seconds: float) -> np.ndarray:
    """Compute where (2,) m a body on its own path stops at second `seconds`."""
    frame = int(np.clip(round((seconds - start) * own.fps), 0, len(own) - 1))
    position, stopping_distance, _ = _compute_stop(own, frame, -1)
    return position + stopping_distance


def _compute_stop(own: Motion, frame: int, side: int) -> tuple[np.ndarray, np.ndarray, int]:
    """Compute how a body stops before a frame (side -1), or starts after it (side 1), at its own speed there.

    Returns:
        Position (2,) m of the own path some frames before or after, the distance (2,) m covered meanwhile, and the
        number of frames.
    """
    fps, places = own.fps, own.root_positions[:, :2]
    second = int(fps)
    positions = places[np.clip([frame, frame + side * second], 0, len(own) - 1)]
    velocity = (positions[1] - positions[0]) * side
    seconds = max(_MIN_STOP_SECONDS, float(np.linalg.norm(velocity)) / _ACCELERATION)
    frames = int(round(seconds * fps))
    other = int(np.clip(frame + side * frames, 0, len(own) - 1))
    return places[other], 0.5 * velocity * seconds, frames


def _continue_from(own: Motion, end: int, place: np.ndarray) -> Motion:
    """Move everything from frame `end` on so that a body that starts from `place` (2,) m gets into it."""
    position, starting_distance, _ = _compute_stop(own, min(end, len(own) - 1), 1)
    root = own.root_positions.copy()
    root[end:, :2] += place + starting_distance - position
    return replace(own, root_positions=root)


def _compute_speed(away: np.ndarray, frames: int, fps: float) -> float:
    """Compute the speed (m/s) that covers `away` (2,) m within a number of frames."""
    return float(np.linalg.norm(away)) * fps / max(frames, 1)


def _compute_easy_speed(own: Motion) -> float:
    """Compute a speed (m/s) that is easy for a body: its usual speed and a little more."""
    step = np.linalg.norm(np.diff(own.root_positions[:, :2], axis=0), axis=1) * own.fps
    usual = float(np.median(step)) if len(step) else 0.0
    return max(min(1.5 * usual, usual + 0.6), 1.6)


def _find_most_similar(distances: np.ndarray, low: int, high: int, fade: int) -> int:
    """Find the frame of low .. high from which two motions are most similar for `fade` frames; distances (T,) m."""
    low, high = max(low, 0), min(high, len(distances)) - fade
    if high <= low:
        return max(min(low, len(distances) - fade), 0)
    means = np.convolve(distances, np.ones(fade) / fade, mode="valid")
    return low + int(np.argmin(means[low : high + 1]))
