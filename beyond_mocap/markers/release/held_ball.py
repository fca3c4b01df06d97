"""The ball in the hand before it leaves: the marker on it, the hand that holds it, and until when."""

from __future__ import annotations

import re

import numpy as np

from ...motion.hand import Hand, estimate_ball_centre
from ..trial import MarkerTrial
from .throwing_hand import compute_speeds, find_fastest_frame, find_release_by_distance
from .without_ball import HOLD

MAX_BALL_DISTANCE = 0.35
"""Metres from the palm within which a marker may be on a held ball."""
_BALL_LABEL = re.compile(r"^(base|tennis|hand|foot|soft)?[ _-]?ball[ _-]?\d*$", re.I)
_HELD_SECONDS = (0.15, 0.015)  # s before the first guess, between which the marker is fixed in the hand
_NEARBY_SECONDS = 0.3  # s before a hand is fastest in which it holds the ball


def list_ball_labels(trial: MarkerTrial) -> list[str]:
    """List the markers of a trial that are named as a ball."""
    return [label for label in trial.labels if _BALL_LABEL.match(label)]


def find_ball_label(trial: MarkerTrial, requested: str | None) -> str | None:
    """Find the marker on the ball.

    Args:
        trial: the recorded markers.
        requested: its label; None to find it by its name, "" for none.
    Returns:
        The requested label, else that of the most often visible marker with the name of a ball, or None.
    Raises:
        InputError: if the trial lacks the requested marker.
    """
    if requested:
        trial.index_of(requested)
        return requested
    candidates = list_ball_labels(trial)
    if requested == "" or not candidates:
        return None
    return max(candidates, key=lambda label: np.count_nonzero(trial.visibility[:, trial.index_of(label)]))


def choose_hand(hands: list[Hand], marker: np.ndarray | None) -> Hand:
    """Choose the hand that throws.

    Args:
        hands: one or both, T frames.
        marker: (T, 3) metres, the marker on the ball, or None.
    Returns:
        The hand in which the marker is before the flight; without a marker the faster one.
    """
    peaks = [find_fastest_frame(hand.origin, hand.fps) for hand in hands]
    fast = max(range(len(hands)), key=lambda i: compute_speeds(hands[i].origin, hands[i].fps)[peaks[i]])
    if marker is None or len(hands) == 1:
        return hands[fast]
    nearest = [_measure_distance(hand, marker, peaks[fast]) for hand in hands]
    return hands[int(np.argmin(nearest))] if min(nearest) < 2.0 * MAX_BALL_DISTANCE else hands[fast]


def _measure_distance(hand: Hand, marker: np.ndarray, peak: int) -> float:
    """Measure the distance in metres between hand and marker shortly before the hand is fastest; inf where hardly
    visible.
    """
    away = np.linalg.norm(marker - hand.to_world(HOLD * hand.reach * hand.finger), axis=-1)
    away = away[max(peak - int(_NEARBY_SECONDS * hand.fps), 0) : peak + 1]
    away = away[np.isfinite(away)]
    return float(np.median(away)) if len(away) >= 3 else np.inf


def estimate_usual_place(hand: Hand) -> np.ndarray:
    """Estimate where balls usually lie in a hand.

    Args:
        hand: the hand.
    Returns:
        (3,) metres, in its frame.
    """
    # direction out of the palm at rest: downwards if the rest pose spreads the arms, else unknown
    palm = np.array([0.0, 0.0, -1.0]) if abs(hand.finger[1]) > 0.9 else None
    return estimate_ball_centre(hand.finger, hand.reach, palm)


def find_held_frames(hand: Hand, marker: np.ndarray) -> np.ndarray:
    """Find the frames shortly before the first guess in which the marker is visible.

    Args:
        hand: the hand that throws, T frames.
        marker: (T, 3) metres, the marker on the ball.
    Returns:
        (T,) bool.
    """
    last = guess_release(hand, marker)
    times = hand.times
    return np.isfinite(marker).all(axis=-1) & (times > last - _HELD_SECONDS[0]) & (times < last - _HELD_SECONDS[1])


def guess_release(hand: Hand, marker: np.ndarray) -> float:
    """Guess when the ball leaves: when the hand is fastest, or when the marker is away from it if that is later.

    A tenth more distance (section 6.2) is some 8 mm: a deformed hand or a scattered marker has it before the release.

    Args:
        hand: the hand that throws, T frames.
        marker: (T, 3) metres, the marker on the ball.
    Returns:
        Seconds.
    """
    knuckles = hand.to_world(HOLD * hand.reach * hand.finger)
    away = find_release_by_distance(knuckles, marker, hand.fps)
    return max(find_fastest_frame(knuckles, hand.fps), away or 0) / hand.fps
