"""Leave the own path of a body for a throw some seconds before it, and return to it some seconds after.

Run-up and recovery come from a library (`run_up`) for the seconds around the throw; the rest stays unchanged.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..base.errors import TimedLine
from ..library.library import Library
from ..motion.humanoid import stature
from ..motion.motion import Motion, forward_kinematics, resample
from ..motion.track import Track, zero_phase_hann
from ..synthesis.construct.meeting import eased
from ..synthesis.plan import Plan
from .join_throw import FADE, blend_bodies, hold_ends
from .run_up import SMOOTH, RunUpResult, construct_run_up

REACH = 4.5
"""Seconds before and after a throw in which a body may leave its own path."""

_LEAST_STOP = 1.0  # s, shortest time in which a body stops or starts
_SPEEDS_UP = 2.5  # m/s^2, acceleration of a body that stops or starts
_TOO_FAST = 1.2  # warning above this multiple of the speed of the library, or of the body itself


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

    own: Motion
    start: float
    low: int
    first: int
    end: int
    high: int
    comes_back: bool


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
    part = _stretch(own, start, throw, release, at)
    around = part.own.frames(part.low, part.high)
    run_up = construct_run_up(
        library, _plan(library, part), throw, release, at, action=action, progress=progress, cancelled=cancelled,
        between=around,
    )  # fmt: skip
    leaves, comes = _edges(part, run_up.motion, around)
    root, rotations = _blended(part, run_up.motion, leaves, comes)
    seams = np.array([part.low + leaves, *(run_up.seams + part.low), part.low + comes])
    return RunUpResult(
        motion=Motion(part.own.skeleton, root, rotations, part.own.fps), start=part.start, seams=seams,
        warnings=(*run_up.warnings, *_warnings(part, library, root)),
    )


def _stretch(own: Motion, start: float, throw: Motion, release: float, at: float) -> _Stretch:
    """Find the frames around a throw; without time to return, the following motion continues from the throw's end."""
    fps = own.fps
    first = int(round((at - release - start) * fps))
    own, start, first, end = hold_ends(own, start, first - 1, first + len(resample(throw, fps)) + 1)
    low, high = max(first - int(REACH * fps), 0), min(end + int(REACH * fps), len(own))
    last = throw.root_positions[-1, :2]
    comes_back = _speed_over(own.root_positions[high - 1, :2] - last, high - end, fps) <= _easy_speed(own)
    own = own if comes_back else _continue_from(own, end, last)
    return _Stretch(own=own, start=start, low=low, first=first, end=end, high=high, comes_back=comes_back)


def _plan(library: Library, part: _Stretch) -> Plan:
    """Build a plan from the body's own path around the throw."""
    fps = part.own.fps
    times = part.start + np.arange(part.low, part.high) / fps
    path = zero_phase_hann(part.own.root_positions[part.low : part.high, :2], fps, SMOOTH)
    return Plan(track=Track(times, path, None), library=library.folder, fps=fps, height=stature(part.own.skeleton))


def _edges(part: _Stretch, new: Motion, old: Motion) -> tuple[int, int]:
    """Find the frames, from `low` on, at which the body leaves its own path and has returned to it."""
    count, fade = min(len(new), len(old)), int(FADE * part.own.fps)
    apart = np.linalg.norm(
        forward_kinematics(new)[0][:count] - forward_kinematics(old)[0][:count], axis=-1
    ).mean(axis=1)  # fmt: skip
    leaves = _most_alike(apart, 0, part.first - part.low - fade, fade) if part.low else 0
    ends = part.high == len(part.own)
    return leaves, count if ends else _most_alike(apart, part.end - part.low + fade, count, fade)


def _blended(part: _Stretch, new: Motion, leaves: int, comes: int) -> tuple[np.ndarray, np.ndarray]:
    """Blend the new motion into the own one between its edges; return root (T, 3) m and rotations (T, J, 4)."""
    own, low, fade = part.own, part.low, int(FADE * part.own.fps)
    at, none = np.arange(len(own)) - low, np.zeros(len(own))
    before = (leaves + fade - at) / (fade + 1.0) if low else none
    behind = (at - comes + 1) / (fade + 1.0) if part.high < len(own) else none
    share = eased(np.maximum(before, behind), np.ones(len(own)))
    root, rotations = own.root_positions.copy(), own.rotations.copy()
    count = min(len(new), part.high - low)
    root[low : low + count], rotations[low : low + count] = new.root_positions[:count], new.rotations[:count]
    return blend_bodies(own.skeleton, (root, rotations), (own.root_positions, own.rotations), share)


def _warnings(part: _Stretch, library: Library, root: np.ndarray) -> list[str]:
    """List warnings about a missing return and a high speed."""
    fps = part.own.fps
    warnings: list[str] = []
    if not part.comes_back:
        when = part.start + part.end / fps
        text = (
            f"{when:.1f} s: no time to return to the own path; the following motion continues from the end of the throw"
        )
        warnings.append(TimedLine(text, (when, when)))
    fastest = float(np.linalg.norm(np.diff(root[part.low : part.high, :2], axis=0), axis=1).max() * fps)
    if fastest > _TOO_FAST * max(library.fastest, _easy_speed(part.own)):
        warnings.append(
            f"the body has to move at {fastest:.1f} m/s around the throw: choose another frame or target"
        )
    return warnings


def is_in_reach(own: Motion, start: float, throw: Motion, release: float, at: float) -> bool:
    """Return whether a body can reach the start of the throw in time from its own path without hurrying much."""
    first = int(np.clip(round((at - release - start) * own.fps), 0, len(own) - 1))
    low = max(first - int(REACH * own.fps), 0)
    away = throw.root_positions[0, :2] - own.root_positions[low, :2]
    return _speed_over(away, first - low, own.fps) <= _easy_speed(own)


def stopping_place(own: Motion, start: float, seconds: float) -> np.ndarray:
    """Compute where (2,) m a body on its own path stops at second `seconds`."""
    frame = int(np.clip(round((seconds - start) * own.fps), 0, len(own) - 1))
    spot, way, _ = _stop(own, frame, -1)
    return spot + way


def _stop(own: Motion, frame: int, side: int) -> tuple[np.ndarray, np.ndarray, int]:
    """Compute how a body stops before a frame (side -1), or starts after it (side 1), at its own speed there.

    Returns:
        Position (2,) m of the own path some frames before or after, the distance (2,) m covered meanwhile, and the
        number of frames.
    """
    fps, places = own.fps, own.root_positions[:, :2]
    second = int(fps)
    near = places[np.clip([frame, frame + side * second], 0, len(own) - 1)]
    velocity = (near[1] - near[0]) * side
    seconds = max(_LEAST_STOP, float(np.linalg.norm(velocity)) / _SPEEDS_UP)
    frames = int(round(seconds * fps))
    other = int(np.clip(frame + side * frames, 0, len(own) - 1))
    return places[other], 0.5 * velocity * seconds, frames


def _continue_from(own: Motion, end: int, place: np.ndarray) -> Motion:
    """Move everything from frame `end` on so that a body that starts from `place` (2,) m gets into it."""
    spot, way, _ = _stop(own, min(end, len(own) - 1), 1)
    root = own.root_positions.copy()
    root[end:, :2] += place + way - spot
    return replace(own, root_positions=root)


def _speed_over(away: np.ndarray, frames: int, fps: float) -> float:
    """Compute the speed (m/s) that covers `away` (2,) m within a number of frames."""
    return float(np.linalg.norm(away)) * fps / max(frames, 1)


def _easy_speed(own: Motion) -> float:
    """Compute a speed (m/s) that is easy for a body: its usual speed and a little more."""
    step = np.linalg.norm(np.diff(own.root_positions[:, :2], axis=0), axis=1) * own.fps
    usual = float(np.median(step)) if len(step) else 0.0
    return max(min(1.5 * usual, usual + 0.6), 1.6)


def _most_alike(apart: np.ndarray, low: int, high: int, fade: int) -> int:
    """Find the frame of low .. high from which two motions are most similar for `fade` frames; distances (T,) m."""
    low, high = max(low, 0), min(high, len(apart)) - fade
    if high <= low:
        return max(min(low, len(apart) - fade), 0)
    means = np.convolve(apart, np.ones(fade) / fade, mode="valid")
    return low + int(np.argmin(means[low : high + 1]))
