"""The actions that a plan asks for: labels of key moments and spans, with the player's speed and the ball there."""

from __future__ import annotations

import numpy as np

from ..annotation import KeyMoment, Span
from ..annotation.ball_contact import choose_part_by_height
from ..library.missing_actions import ActionMoment
from ..motion.track import SampledTrack, Track

_ARRIVING = (-0.3, -0.06)  # s from a key moment between which the arriving ball's speed is measured
LEAVING_SECONDS = (0.06, 0.3)
"""s after a key moment between which the leaving ball's velocity is measured."""


def read_moment_action(moment: KeyMoment, track: Track, sampled: SampledTrack) -> ActionMoment:
    """Read the action that a key moment asks for.

    Args:
        moment: the key moment.
        track: the player's track, with its ball.
        sampled: the same at the library's rate.
    """
    time = moment.resolved_time
    at = int(np.argmin(np.abs(track.times - time)))
    height = float(track.ball[at, 2]) if track.ball_height_known[at] else None
    return ActionMoment(labels=frozenset(choose_part_by_height(moment.words, height)), avoid=frozenset(moment.avoid),
                        height=height, speed=float(np.interp(time, sampled.times, sampled.speed)),
                        ball_speed=_measure_ball_speed(sampled, time, _ARRIVING) or 0.0,
                        exit_speed=_measure_ball_speed(sampled, time, LEAVING_SECONDS),
                        lead=_measure_lead(sampled, time))


def read_span_action(span: Span, sampled: SampledTrack) -> ActionMoment:
    """Read the action that a span asks for.

    Args:
        span: the span.
        sampled: the player's track at the library's rate.
    """
    inside = (sampled.times >= span.start) & (sampled.times <= span.end)
    speed = float(sampled.speed[inside].mean()) if inside.any() else 0.0
    return ActionMoment(labels=frozenset(span.words), avoid=frozenset(span.avoid), speed=speed, is_span=True,
                        seconds=span.end - span.start)


def _measure_lead(track: SampledTrack, time: float) -> float:
    """Measure by how many m/s the ball leaves faster than the player at `time` s, along their way; 0 where unknown."""
    moved = _measure_ball_move(track, time, LEAVING_SECONDS)
    direction, speed = (np.interp(time, track.times, column) for column in (track.direction, track.speed))
    ahead = float(moved[:2] @ (np.cos(direction), np.sin(direction))) / (LEAVING_SECONDS[1] - LEAVING_SECONDS[0])
    return ahead - float(speed) if np.isfinite(ahead) else 0.0


def _measure_ball_speed(track: SampledTrack, time: float, between: tuple[float, float]) -> float | None:
    """Measure the speed of the ball in m/s `between` two s from `time`, None where it is unknown."""
    moved = float(np.linalg.norm(_measure_ball_move(track, time, between)))
    return moved / (between[1] - between[0]) if np.isfinite(moved) else None


def _measure_ball_move(track: SampledTrack, time: float, between: tuple[float, float]) -> np.ndarray:
    """Measure how far the ball moves `between` two s from `time`: (3,) m, NaN where it is unknown."""
    first, last = (np.array([np.interp(time + second, track.times, column) for column in track.ball.T])
                   for second in between)
    return last - first
