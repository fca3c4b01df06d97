"""What a library of recordings lacks: kinds of motion that players need and no frame of locomotion shows.

Players spend more than half of their time below 2 m/s, standing, turning, stepping sideways and backward. What a
library lacks there the search replaces by the nearest that it has, and people should know by what.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..annotation import LOCOMOTION
from ..annotation.gaits import TURNING
from ..annotation.labels import find_label
from .features import Frames
from .loops.standing_loops import find_stands
from .posture import find_steady_travel
from .synthetic_clips import SLOWEST_RECORDED

TURN_RATE, TURN_SPEED = np.radians(45.0), 0.5  # rad/s and m/s of a recording that turns in place
NEEDED_TURN_RATE = np.radians(20.0)  # rad/s at which a body needs one: without one the plan turns it slowly
STEP_SPEEDS = (0.4, 2.0)  # m/s of steps in another direction than ahead
TRAVEL_SPEED = 0.3  # m/s above which a body travels
SIDEWAYS = 0.7  # share of the speed
_LEAST_SECONDS = {"turns": 1.0, "sideways": 2.0, "backward": 2.0, "belonging": 1.5}
_SLOW_SECONDS = 1.5
_RATE_SECONDS = 0.3  # over which a heading's rate is measured


def select_locomotion_alone(frames: Frames, clips: Sequence) -> np.ndarray:
    """Select the frames (N,) bool of recordings, twins left out, whose labels say no more than locomotion and turns."""
    acts = [i for i, word in enumerate(frames.vocabulary) if _names_act(word)]
    gaits = [i for i, word in enumerate(frames.vocabulary) if word in LOCOMOTION]
    own = np.array([not clip.mirrored and not clip.is_synthetic for clip in clips])
    return own[frames.clip] & frames.words[:, gaits].any(axis=1) & ~frames.words[:, acts].any(axis=1)


def _names_act(word: str) -> bool:
    """Whether a label names more than locomotion, turns and directions."""
    return bool(set(find_label(word).kinds) - {"modifier"}) and word not in (*LOCOMOTION, TURNING)


def compute_turn_rate(heading: np.ndarray, fps: float) -> np.ndarray:
    """Compute how fast (T,) rad/s an unwrapped heading (T,) rad changes, over a third of a second."""
    half = max(1, round(0.5 * _RATE_SECONDS * fps))
    padded = np.pad(heading, half, mode="edge")
    return (padded[2 * half :] - padded[: -2 * half]) * fps / (2 * half)


def classify_steps(velocity: np.ndarray, turn_rate: np.ndarray, least_rate: float) -> dict[str, np.ndarray]:
    """Classify frames by the kinds of motion that libraries often lack.

    Args:
        velocity: (T, 2) m/s in the body's heading frame, x forward.
        turn_rate: (T,) rad/s of the heading.
        least_rate: rad/s from which on a body turns.
    Returns:
        "turns", "sideways" and "backward" -> (T,) bool.
    """
    speed = np.linalg.norm(velocity, axis=1)
    is_slow = (speed > STEP_SPEEDS[0]) & (speed < STEP_SPEEDS[1])
    return {
        "turns": (np.abs(turn_rate) > least_rate) & (speed < TURN_SPEED),
        "sideways": is_slow & (np.abs(velocity[:, 1]) > SIDEWAYS * speed),
        "backward": is_slow & (-velocity[:, 0] > SIDEWAYS * speed),
    }


def find_missing_motion(clips: Sequence, frames: Frames, fps: float, strangeness: np.ndarray) -> dict[str, str]:
    """Find what a library lacks.

    Args:
        clips: of the library.
        frames: their description, N frames.
        fps: of the frames.
        strangeness: (N,) how far each frame lies from normal locomotion (`posture`).
    Returns:
        Kind ("belonging", "stands", "turns", "slow", "sideways", "backward") -> a line that says what to add and
        what is shown until then; only the kinds that it lacks.
    """
    belongs = select_locomotion_alone(frames, clips) & (strangeness <= 1.0)
    rate = np.concatenate([compute_turn_rate(frames.heading[first : first + count], fps)
                           for first, count in zip(frames.first, frames.count)])
    kinds = {**classify_steps(frames.velocity, rate, TURN_RATE), "belonging": find_steady_travel(frames, fps)}
    slowest = measure_slowest_travel(frames.speed[belongs], fps)
    is_missing = {kind: (belongs & flags).sum() < _LEAST_SECONDS[kind] * fps for kind, flags in kinds.items()}
    is_missing["stands"] = not find_stands(clips, frames, fps, strangeness)
    is_missing["slow"] = slowest > SLOWEST_RECORDED
    lines = {
        "belonging": "no locomotion that surely belongs, since no clip travels straight on at one speed: add a walk; "
                     "until then all that is labelled locomotion counts as such",
        "stands": "no calm standing: add some; until then it is synthetic",
        "turns": "no turn in place: add one; until then steps are synthetic, or those of walks",
        "slow": f"nothing slower than {slowest:.1f} m/s: add a walk; until then it is synthetic",
        "sideways": "no steps sideways: add some; until then they are synthetic, or those of walks",
        "backward": "no steps backward: add some; until then they are synthetic, or those of walks",
    }
    return {kind: line for kind, line in lines.items() if is_missing[kind]}


def measure_slowest_travel(speed: np.ndarray, fps: float) -> float:
    """Measure the m/s below which less than 1.5 s of locomotion travels; infinite where nothing does.

    speed: (N,) m/s of frames of locomotion.
    """
    ordered = np.sort(speed[speed > TRAVEL_SPEED])
    return float(ordered[min(len(ordered) - 1, int(_SLOW_SECONDS * fps))]) if len(ordered) else float("inf")
