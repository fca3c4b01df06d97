"""What a library of recordings lacks: kinds of motion that players need and no frame of locomotion shows.

Players spend more than half of their time below 2 m/s, standing, turning, stepping sideways and backward. What a
library lacks there the search replaces by the nearest that it has, and people should know by what.
"""

from __future__ import annotations

import weakref

import numpy as np

from .left_out import select_locomotion_frames
from .library import Library
from .posture import find_steady_travel
from .standing_loops import find_stands

TURN_RATE, TURN_SPEED = np.radians(45.0), 0.5  # rad/s and m/s of a body that turns in place
STEP_SPEEDS = (0.4, 2.0)  # m/s of steps in another direction than ahead
TRAVEL_SPEED = 0.3  # m/s above which a body travels
SIDEWAYS = 0.7  # share of the speed
SLOWEST = 1.2  # m/s that a library's slowest travel should not exceed
_LEAST_SECONDS = {"turning": 1.0, "sideways": 2.0, "backward": 2.0, "slow": 1.5, "belonging": 1.5}
_RATE_SECONDS = 0.3  # over which a heading's rate is measured
_found: weakref.WeakKeyDictionary[Library, dict[str, str]] = weakref.WeakKeyDictionary()


def compute_turn_rate(heading: np.ndarray, fps: float) -> np.ndarray:
    """Compute how fast (T,) rad/s an unwrapped heading (T,) rad changes, over a third of a second."""
    half = max(1, round(0.5 * _RATE_SECONDS * fps))
    padded = np.pad(heading, half, mode="edge")
    return (padded[2 * half :] - padded[: -2 * half]) * fps / (2 * half)


def classify_steps(velocity: np.ndarray, turn_rate: np.ndarray) -> dict[str, np.ndarray]:
    """Classify frames by the kinds of motion that libraries often lack.

    Args:
        velocity: (T, 2) m/s in the body's heading frame, x forward.
        turn_rate: (T,) rad/s of the heading.
    Returns:
        "turning", "sideways" and "backward" -> (T,) bool.
    """
    speed = np.linalg.norm(velocity, axis=1)
    is_slow = (speed > STEP_SPEEDS[0]) & (speed < STEP_SPEEDS[1])
    return {
        "turning": (np.abs(turn_rate) > TURN_RATE) & (speed < TURN_SPEED),
        "sideways": is_slow & (np.abs(velocity[:, 1]) > SIDEWAYS * speed),
        "backward": is_slow & (-velocity[:, 0] > SIDEWAYS * speed),
    }


def find_missing_motion(library: Library) -> dict[str, str]:
    """Find what a library lacks; computed once for each.

    Args:
        library: the recordings.
    Returns:
        Kind ("belonging", "standing", "turning", "slow", "sideways", "backward") -> a line that says what to add and
        what is shown until then; only the kinds that it lacks.
    """
    if library not in _found:
        _found[library] = _find_missing_motion(library)
    return _found[library]


def _find_missing_motion(library: Library) -> dict[str, str]:
    """Find what a library lacks."""
    frames, fps = library.frames, library.fps
    belongs = select_locomotion_frames(library) & (library.strangeness <= 1.0)
    rate = np.concatenate([compute_turn_rate(frames.heading[first : first + count], fps)
                           for first, count in zip(frames.first, frames.count)])
    seconds = {kind: float((belongs & flags).sum() / fps) for kind, flags in
               classify_steps(frames.velocity, rate).items()}
    seconds["belonging"] = float((belongs & find_steady_travel(frames, fps)).sum() / fps)
    slowest = measure_slowest_travel(library)
    lines = {
        "belonging": "no locomotion that surely belongs, since no clip travels straight on at one speed: add a walk; "
                     "until then all that is labelled locomotion counts as such",
        "standing": "no calm standing: add some; until then steps of walking clips are slowed",
        "turning": "no turn in place: add one; until then the body turns by steps of walking clips",
        "slow": f"nothing slower than {slowest:.1f} m/s: add a walk; until then steps at that speed are shortened",
        "sideways": "no steps sideways: add some; until then the body is moved sideways in steps of other clips",
        "backward": "no steps backward: add some; until then the body is moved backward in steps of other clips",
    }
    is_missing = {kind: seconds[kind] < least for kind, least in _LEAST_SECONDS.items() if kind in seconds}
    is_missing["standing"] = not find_stands(library.clips, frames, fps, library.strangeness)
    is_missing["slow"] = slowest > SLOWEST
    return {kind: line for kind, line in lines.items() if is_missing[kind]}


def measure_slowest_travel(library: Library) -> float:
    """Measure the m/s below which less than _LEAST_SECONDS of locomotion travels; the fastest of a shorter one."""
    speed = library.frames.speed[select_locomotion_frames(library) & (library.strangeness <= 1.0)]
    ordered = np.sort(speed[speed > TRAVEL_SPEED])
    if not len(ordered):
        return float("inf")
    return float(ordered[min(len(ordered) - 1, int(_LEAST_SECONDS["slow"] * library.fps))])
