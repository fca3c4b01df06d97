"""What a foot gives a ball that lies: where the two touch, and how the ball leaves.

Along the line from the foot's surface to the ball's centre the ball leaves `RATIO` times as fast as the foot comes:
(1 + e) M / (M + m) for a foot of effective mass M, some 1.2 in good kicks (Lees and Nolan 1998, J. Sports Sci. 16,
211-234; Kellis and Katis 2007, J. Sports Sci. Med. 6, 154-165). Across it the foot takes the ball's surface along as
far as friction goes, as the ground does at a bounce (`physics`), which gives spin (Asai, Carre, Akatsuka and Haake
2002, Sports Eng. 5, 183-192): a ball met below its middle rises and spins backward.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..ball.physics import Ball

RATIO = 1.2
"""Speed of the ball over that of the foot, along the line between them."""
FRICTION = 0.4
"""Coulomb's, of shoe on ball: 0.3 to 0.5 (Asai et al. 2002)."""


@dataclass(frozen=True, eq=False)
class Struck:
    """How balls (N) leave: velocity (N, 3) m/s and spin (N, 3) rad/s; gap (N,) m between foot and ball, negative where
    they overlap; share (N,) of the way from the foot's first end to its other at which they touch."""

    velocity: np.ndarray
    spin: np.ndarray
    gap: np.ndarray
    share: np.ndarray


def struck(ends: np.ndarray, velocities: np.ndarray, radius: float, centre: np.ndarray, ball: Ball) -> Struck:
    """Balls at `centre` (N, 3) m struck by a foot whose line has `ends` (N, 2, 3) m and moves with `velocities`
    (N, 2, 3) m/s; radius: the foot's about that line, m."""
    along = ends[:, 1] - ends[:, 0]
    share = np.sum((centre - ends[:, 0]) * along, axis=-1) / np.maximum(np.sum(along * along, axis=-1), 1e-12)
    share = np.clip(share, 0.0, 1.0)
    way = centre - ends[:, 0] - share[:, None] * along
    far = np.maximum(np.linalg.norm(way, axis=-1), 1e-9)
    normal = way / far[:, None]
    foot = velocities[:, 0] + share[:, None] * (velocities[:, 1] - velocities[:, 0])
    into = np.sum(foot * normal, axis=-1)
    push = RATIO * into[:, None] * normal
    across = foot - into[:, None] * normal
    wanted = across * ball.inertia / (1.0 + ball.inertia)
    most = FRICTION * RATIO * np.maximum(into, 0.0) / np.maximum(np.linalg.norm(wanted, axis=-1), 1e-12)
    drag = wanted * np.minimum(1.0, most)[:, None]
    spin = np.cross(-normal, drag) / (ball.inertia * ball.radius)
    return Struck(push + drag, spin, far - radius - ball.radius, share)
