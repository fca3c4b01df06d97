"""What a feed would deliver of a planted match: samples with noise, stretches filled in, balls lost behind legs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .planted import LENGTH, TEAMS, WIDTH, PlantedMatch

_SLOW = 0.4  # seconds over which the ball's error hangs together
_PLAYERS_SLOW, _PLAYERS_NOISE, _JITTER = 2.0, 0.08, 0.01  # the players' errors: seconds, metres; metres between samples


@dataclass(frozen=True, eq=False, kw_only=True)
class Feed:
    """N samples. times (N,) s. ball (N, 3) m, z NaN where there are no heights. positions (P, N, 2) m of players `ids`
    in `teams`. filled, wrong (N,) bool: made at constant velocity, put elsewhere. length, width of the pitch, m."""

    times: np.ndarray
    ball: np.ndarray
    positions: np.ndarray
    ids: tuple[str, ...]
    teams: tuple[str, ...]
    filled: np.ndarray
    wrong: np.ndarray
    fps: float
    length: float = LENGTH
    width: float = WIDTH


def sampled(
    match: PlantedMatch, fps: float = 25.0, noise: float = 0.08, heights: bool = True, filled: float = 0.0,
    snaps: float = 0.1, seed: int = 0,
) -> Feed:  # fmt: skip
    """A feed of `match` at `fps` Hz.

    noise: m, standard deviation of each of the ball's coordinates, half of it from sample to sample. filled: share of
    samples that lie on straight lines between the touches instead. snaps: share of touches at which the ball is put to
    the player for a fifth of a second.
    """
    rng = np.random.default_rng(seed)
    times = np.arange(int(match.seconds * fps)) / fps
    ball = match.ball_at(times) - np.array([0.0, 0.0, match.ball.radius])
    players = match.players_at(times)
    measured = ball + _slow_noise(rng, ball.shape, _SLOW * fps, 0.87 * noise) + rng.normal(0.0, 0.5 * noise, ball.shape)
    wrong = _snapped(match, times, measured, players=players, share=snaps, rng=rng)
    made = _filled(match, times, measured, ball=ball, share=filled, rng=rng)
    measured[:, 2] = np.maximum(measured[:, 2], 0.0) if heights else np.nan
    seen = players + _slow_noise(rng, players.shape, _PLAYERS_SLOW * fps, _PLAYERS_NOISE, axis=1)
    seen += rng.normal(0.0, _JITTER, seen.shape)
    teams = tuple(TEAMS[i // 11] for i in range(len(match.ids)))
    return Feed(times=times, ball=measured.round(2), positions=seen.round(2), ids=match.ids, teams=teams, filled=made,
                wrong=wrong & ~made, fps=fps)


def _slow_noise(rng, shape, samples: float, size: float, axis: int = 0) -> np.ndarray:
    """Noise of standard deviation `size` that hangs together over `samples` along an axis."""
    from scipy.signal import lfilter

    keep = np.exp(-1.0 / samples)
    white = rng.normal(0.0, size, shape)
    first = np.take(white, [0], axis=axis) * keep
    return lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], white, axis=axis, zi=first)[0]


def _snapped(match, times, measured, players, share: float, rng) -> np.ndarray:
    """Puts the ball to the player at some touches, in place; (N,) bool where."""
    wrong = np.zeros(len(times), bool)
    for touch in match.touches:
        if rng.random() < share:
            near = np.abs(times - touch.time) < 0.1
            measured[near] = np.column_stack([players[match.ids.index(touch.player), near], np.zeros(near.sum())])
            wrong |= near
    return wrong


def _filled(match, times, measured, ball, share: float, rng) -> np.ndarray:
    """Draws straight lines between the touches of some stretches, in place; (N,) bool where."""
    made = np.zeros(len(times), bool)
    touches = np.array([touch.time for touch in match.touches])
    while made.mean() < share:
        start = rng.uniform(0.0, match.seconds)
        first, last = np.searchsorted(times, [start, min(start + rng.uniform(1.0, 6.0), times[-1])])
        if last - first < 3:
            continue
        inside = np.searchsorted(times, touches[(touches > times[first]) & (touches < times[last])])
        corners = np.unique([first, *inside, last])
        for axis in range(3):
            measured[first : last + 1, axis] = np.interp(times[first : last + 1], times[corners], ball[corners, axis])
        made[first : last + 1] = True
    return made
