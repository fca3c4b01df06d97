"""What strikes and their flights cost, in m/s of changed velocity."""

from __future__ import annotations

import numpy as np

from .strike_choice import StrikeMoments

LONG_TRAVEL = {"toss": 1.5, "pass": 1.5, "attack": 0.9}  # s
COST_PER_SECOND = 2.0
"""m/s of cost for each second of travel beyond LONG_TRAVEL."""
BEHIND, COST_PER_RADIAN = np.radians(100.0), 2.0
"""Rad from the heading beyond which a body does not see a ball come, and cost in m/s of each further radian."""
MOST_MISS, COST_PER_METRE = 4.0, 0.8  # m: most that a miss counts; m/s for each metre that a hit motion travels
BLOCKED_COST, PLAYER_RADIUS, PLAYER_HEIGHT = 6.0, 0.45, 1.9
"""m/s of cost to fly through the middle of a player; radius in m of a player with room around; height in m."""
HIT_COST = 0.35 * BLOCKED_COST
"""Cost from which on a ball meets the body itself."""
PUSH_COST = 2.0
"""m/s of cost for pushing a ball across the part's direction; pushing it backward costs twice as much."""
STEADY_RISE, RISE_COST = 1.0, 0.5
"""m/s upward with which a ball can still arrive, and cost of each further m/s: it has bounced a moment ago."""
TRUNK_COST, TRUNK_RADIUS, TRUNK_FROM = 8.0, 0.22, 0.8
"""m/s of cost to fly through the middle of a trunk; its radius and lower end in m."""
TRUNK_TO = {"head": 1.35, "chest": 0.0}  # m, by the part that strikes
TRUNK_HEIGHT = 1.7
"""Metres up to which a ball stays clear of the striking body, for parts that TRUNK_TO does not have."""


def compute_moment_cost(moments: StrikeMoments, facing: np.ndarray, to_origin: np.ndarray) -> np.ndarray:
    """Compute the costs of moments apart from their ball's trajectory.

    A ball that comes from behind the body costs, and so does a hit motion that travels.

    Args:
        moments: N moments.
        facing: (N,) rad, headings.
        to_origin: (2,) m, vector to where the ball comes from.
    Returns:
        (N,) m/s.
    """
    comes = np.arctan2(to_origin[1], to_origin[0])
    aside = np.abs((comes - facing + np.pi) % (2.0 * np.pi) - np.pi)
    return COST_PER_RADIAN * np.maximum(aside - BEHIND, 0.0) + COST_PER_METRE * moments.travel


def measure_misses(trajectories: np.ndarray, speeds: np.ndarray, toward: np.ndarray, bounces: int) -> np.ndarray:
    """Compute how far natural trajectories pass their target after the requested bounces.

    Args:
        trajectories: (N, T, 3) m, trajectories.
        speeds: (N, T, 3) m/s, velocities on them.
        toward: (3,) m, target.
        bounces: requested number of bounces.
    Returns:
        (N,) m, MOST_MISS at most.
    """
    up = speeds[..., 2] > 0.0
    # the velocity turns upward at each bounce
    bounced = np.cumsum(up[:, 1:] & ~up[:, :-1], axis=1)
    counted = np.concatenate([np.zeros((len(trajectories), 1), int), bounced], axis=1)
    far = np.linalg.norm(trajectories - toward, axis=2) + np.where(counted == bounces, 0.0, 1.0)
    return np.minimum(far.min(axis=1), MOST_MISS)


def compute_travel_cost(seconds: np.ndarray, kind: str) -> np.ndarray:
    """Compute the cost (N,) m/s of travel times (N,) s for a kind of pass."""
    return COST_PER_SECOND * np.maximum(seconds - LONG_TRAVEL[kind], 0.0)


def compute_rise_cost(arriving: np.ndarray) -> np.ndarray:
    """Compute the cost (N,) m/s of balls that arrive with `arriving` (N, 3) m/s straight from their bounce."""
    return RISE_COST * np.maximum(arriving[:, 2] - STEADY_RISE, 0.0)


def compute_push_cost(arriving: np.ndarray, leaving: np.ndarray, part: np.ndarray) -> np.ndarray:
    """Compute the cost of pushing a ball in another direction than the part moves.

    Args:
        arriving: (N, 3) m/s of the balls.
        leaving: (3,) m/s of the ball.
        part: (3,) m/s of the part.
    Returns:
        (N,) m/s.
    """
    push = leaving - arriving
    # cosine of the angle between the ball's change of velocity and the part's movement
    along = push @ part / np.maximum(np.linalg.norm(push, axis=1) * np.linalg.norm(part), 1e-9)
    return PUSH_COST * (1.0 - along)


def compute_player_cost(trajectories: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Compute the cost of flying through players.

    Args:
        trajectories: (N, S, 3) m, trajectories.
        others: (P, 2) m, places of the players.
    Returns:
        (N, P) m/s.
    """
    if not len(others):
        return np.zeros((len(trajectories), 0))
    a, b = trajectories[:, :-1, None, :2], trajectories[:, 1:, None, :2]
    # the nearest point to each player on each level segment a-b of a trajectory
    share = np.sum((others - a) * (b - a), axis=-1) / np.maximum(np.sum((b - a) ** 2, axis=-1), 1e-9)
    near = np.linalg.norm(others - a - np.clip(share, 0.0, 1.0)[..., None] * (b - a), axis=-1)
    low = np.minimum(trajectories[:, :-1, 2], trajectories[:, 1:, 2])[..., None] < PLAYER_HEIGHT
    inside = np.where(low, np.maximum(PLAYER_RADIUS - near, 0.0) / PLAYER_RADIUS, 0.0)
    return BLOCKED_COST * inside.max(axis=1)


def compute_trunk_cost(trajectories: np.ndarray, radius: float, place: np.ndarray, tall: float) -> np.ndarray:
    """Compute the cost of flying through the trunk of the passer or receiver.

    Args:
        trajectories: (N, S, 3) m, trajectories.
        radius: of the ball, m.
        place: (2,) m, the player.
        tall: upper end of the trunk, m.
    Returns:
        (N,) m/s.
    """
    near = np.linalg.norm(trajectories[..., :2] - place, axis=-1) - radius
    inside = (trajectories[..., 2] > TRUNK_FROM) & (trajectories[..., 2] < tall + radius)
    return TRUNK_COST * np.where(inside, np.clip((TRUNK_RADIUS - near) / TRUNK_RADIUS, 0.0, 1.0), 0.0).max(axis=1)
