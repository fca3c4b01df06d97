"""The physics of a ball: air, bounce and ground, with the parameters of real balls.

In the air a ball of mass m feels gravity, drag that grows with its speed (the paper's) or with its square (measured),
and the Magnus lift of its spin, perpendicular to its velocity:

    dv/dt = -g z - linear_drag v - drag |v| v + lift_scale C_L |v| (w x v) / |w|,   C_L = 1 / (a + b |v| / (r |w|))

At a bounce the ground returns `restitution` of the downward speed. Horizontally it stops the ball's lowest point (grip)
if `friction` times the upward push allows it; otherwise the ball slides. This couples velocity and spin: Cross,
"Grip-slip behavior of a bouncing ball", Am. J. Phys. 70 (2002). No formula adds energy to the ball.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Ball:
    """One kind of ball.

    Attributes:
        name: identifier.
        radius: m.
        mass: kg.
        gravity: m/s^2.
        linear_drag: 1/s, share of the speed lost per second.
        drag: 1/m, rho C_D A / 2m.
        lift: (scale 1/m: rho A / 2m, a, b) of the Magnus lift above; scale 0: none.
        restitution: share of the downward speed that a bounce returns.
        friction: Coulomb's coefficient, at a bounce and while sliding; 0: the ground causes no spin.
        rolling: m/s^2, deceleration of a rolling ball.
        spin_decay: 1/s.
        inertia: moment of inertia / (mass radius^2), 2/3 for a hollow ball.
    """

    name: str
    radius: float
    mass: float
    gravity: float = 9.8
    linear_drag: float = 0.0
    drag: float = 0.0
    lift: tuple[float, float, float] = (0.0, 2.0, 1.0)
    restitution: float = 0.7
    friction: float = 0.0
    rolling: float = 1.0
    spin_decay: float = 0.0
    inertia: float = 2.0 / 3.0


PAPER = Ball("paper", 0.11, 0.43, linear_drag=0.2)
"""Ball handling, section 5: air resistance 0.2 (taken as -0.2 v per second), elasticity 0.7, gravity 9.8; no spin. The
paper gives no rolling resistance; it is a football's."""
FOOTBALL = Ball("football", 0.11, 0.43, 9.81, drag=0.0133, lift=(0.0531, 2.0, 0.4), restitution=0.62, friction=0.5,
                rolling=1.0, spin_decay=0.05)
"""C_D 0.25, between the 0.2 that Goff & Carre, "Trajectory analysis of a soccer ball", Am. J. Phys. 77 (2009), find
above the drag crisis near 12 m/s and the 0.4 and more below it (Asai et al., "Fundamental aerodynamics of the soccer
ball", Sports Eng. 10 (2007)); C_L about 0.3 for spin parameters of 0.3 (both), levelling off. Bounce and roll as on
good turf: FIFA's test manual asks for a rebound of 0.6 to 0.85 m from 2 m and 4 to 8 m of roll from a 1 m ramp.
Friction: 0.37 to 0.62 are measured ("The coefficient of friction of soccer balls", Proceedings 49 (2020) 92)."""
VOLLEYBALL = Ball("volleyball", 0.105, 0.27, 9.81, drag=0.0192, lift=(0.0770, 2.0, 0.4), restitution=0.74, friction=0.5,
                  rolling=0.4, spin_decay=0.05)
"""C_D 0.25 between 0.15 above and 0.45 below the crisis (Asai et al., "A study of knuckle effect of volleyball",
Procedia Eng. 2 (2010)); a hard floor."""
TENNIS = Ball("tennis", 0.0335, 0.0577, 9.81, drag=0.0202, lift=(0.0367, 2.022, 0.981), restitution=0.745, friction=0.6,
              rolling=0.6, spin_decay=0.05, inertia=0.55)
"""C_D 0.55 (Mehta, Alam & Subic, "Aerodynamics of tennis balls", Sports Technol. 1 (2008)); lift: Stepanek, "The
aerodynamics of tennis balls: the topspin lob", Am. J. Phys. 56 (1988); bounce: the rules ask for 1.35 to 1.47 m from
2.54 m; inertia: Cross (2002)."""
BASEBALL = Ball("baseball", 0.0366, 0.145, 9.81, drag=0.0061, lift=(0.0174, 2.32, 0.4), restitution=0.5, friction=0.5,
                rolling=1.0, spin_decay=0.02, inertia=0.4)
"""C_D 0.35 at 30 to 40 m/s (Kagan & Nathan, "Simplified models for the drag coefficient of a pitched baseball", Phys.
Teach. 52 (2014)); lift: Nathan, "The effect of spin on the flight of a baseball", Am. J. Phys. 76 (2008); size and
weight: the rules' 9 to 9 1/4 in round and 5 to 5 1/4 oz."""
HANDBALL = Ball("handball", 0.094, 0.45, 9.81, drag=0.0093, lift=(0.0370, 2.0, 0.4), restitution=0.7, friction=0.6,
                rolling=0.6, spin_decay=0.05)
"""Size 3: 58 to 60 cm round, 425 to 475 g; C_D 0.25 as for other large balls above the drag crisis."""
BALLS: dict[str, Ball] = {ball.name: ball for ball in (PAPER, FOOTBALL, VOLLEYBALL, TENNIS)}

THROWN_BALLS: dict[str, Ball] = {ball.name: ball for ball in (BASEBALL, TENNIS, HANDBALL, VOLLEYBALL, FOOTBALL)}
"""Balls that are thrown by hand."""
HUMAN_BALL_SPEEDS: dict[str, float] = {"foot": 38.0, "head": 23.0, "chest": 10.0, "hand": 38.0, "tool": 73.0}
"""m/s: the highest speed a person gives the ball, by body part.
Foot: professionals' instep kicks reach 30 to 34 m/s (Kellis & Katis,
"Biomechanical characteristics of instep soccer kick", J. Sports Sci. Med. 6 (2007)), records some more. Hand: the
fastest volleyball serves and spikes (some 137 km/h). Tool: the fastest tennis serves (263 km/h). Head and chest: the
best runs up and dives, rounded up."""


def vector_length(vectors: np.ndarray) -> np.ndarray:
    """Lengths (...,) of vectors (..., 3)."""
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return np.sqrt(x * x + y * y + z * z)


def compute_air_acceleration(velocity: np.ndarray, spin: np.ndarray, ball: Ball) -> np.ndarray:
    """Compute the acceleration of balls in the air (eq. 3).

    Args:
        velocity: (..., 3) m/s.
        spin: (..., 3) rad/s.
        ball: the ball's physics.
    Returns:
        (..., 3) m/s^2.
    """
    speed = vector_length(velocity)
    out = velocity * -(ball.linear_drag + ball.drag * speed)[..., None]
    scale, a, b = ball.lift
    if scale and spin.any():
        rim = ball.radius * vector_length(spin)
        share = scale * ball.radius * speed / np.maximum(a * rim + b * speed, 1e-9)
        wx, wy, wz = spin[..., 0], spin[..., 1], spin[..., 2]
        vx, vy, vz = velocity[..., 0], velocity[..., 1], velocity[..., 2]
        out[..., 0] += (wy * vz - wz * vy) * share
        out[..., 1] += (wz * vx - wx * vz) * share
        out[..., 2] += (wx * vy - wy * vx) * share
    out[..., 2] -= ball.gravity
    return out


def compute_bounce(velocity: np.ndarray, spin: np.ndarray, ball: Ball) -> tuple[np.ndarray, np.ndarray]:
    """Compute velocity and spin after a bounce on level ground: the impulse of eq. 5.

    The horizontal push also changes the spin; at most it stops the ball's lowest point.

    Args:
        velocity: (..., 3) m/s before the bounce.
        spin: (..., 3) rad/s before the bounce.
        ball: the ball's physics.
    Returns:
        Velocity (..., 3) m/s and spin (..., 3) rad/s after it.
    """
    down = np.maximum(-velocity[..., 2], 0.0)
    push = _compute_contact_push(velocity, spin, ball, ball.friction * (1.0 + ball.restitution) * down)
    after = velocity + push
    after[..., 2] = np.where(velocity[..., 2] < 0.0, ball.restitution * down, velocity[..., 2])
    return after, spin + _compute_spin_change(push, ball)


def compute_grip(velocity: np.ndarray, spin: np.ndarray, ball: Ball) -> tuple[np.ndarray, np.ndarray]:
    """Compute velocity and spin (..., 3) once the lowest point has no slip and the ball rolls.

    A ball without friction keeps both.
    """
    push = _compute_contact_push(velocity, spin, ball, np.full(velocity.shape[:-1], np.inf if ball.friction else 0.0))
    return velocity + push, spin + _compute_spin_change(push, ball)


def compute_slip(velocity: np.ndarray, spin: np.ndarray, ball: Ball) -> np.ndarray:
    """Compute the horizontal velocity (..., 3) m/s of the ball's lowest point relative to the ground."""
    along = velocity[..., 0] - ball.radius * spin[..., 1]
    out = np.zeros((*along.shape, 3))
    out[..., 0], out[..., 1] = along, velocity[..., 1] + ball.radius * spin[..., 0]
    return out


def compute_sliding(velocity: np.ndarray, spin: np.ndarray, ball: Ball,
                    ahead: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Compute the accelerations of balls that slide over the ground.

    Args:
        velocity: (..., 3) m/s.
        spin: (..., 3) rad/s.
        ball: the ball's physics.
        ahead: (..., 3) initial slip direction. Friction keeps opposing it after the slip has reversed, so that an
            integrator that looks past the end of the slide finds the same law there.
    Returns:
        Acceleration (..., 3) m/s^2 and angular acceleration (..., 3) rad/s^2.
    """
    over = compute_slip(velocity, spin, ball)
    if ahead is not None:
        over = over * np.where(np.sum(over * ahead, axis=-1) < 0.0, -1.0, 1.0)[..., None]
    rub = over * (-ball.friction * ball.gravity / np.maximum(vector_length(over), 1e-12))[..., None]
    air = velocity * -(ball.linear_drag + ball.drag * vector_length(velocity))[..., None]
    return rub + air, _compute_spin_change(rub, ball) - ball.spin_decay * spin


def compute_rolling_spin(velocity: np.ndarray, ball: Ball) -> np.ndarray:
    """Compute the horizontal spin (..., 3) rad/s of a ball that rolls at velocity (..., 3) m/s."""
    out = np.zeros(velocity.shape)
    out[..., 0], out[..., 1] = -velocity[..., 1] / ball.radius, velocity[..., 0] / ball.radius
    return out


def compute_deceleration(speed: np.ndarray, ball: Ball) -> np.ndarray:
    """Compute the deceleration (...,) m/s^2, by ground and air, of a ball that rolls at `speed` (...,) m/s."""
    return ball.rolling + ball.linear_drag * speed + ball.drag * speed**2


def _compute_contact_push(velocity, spin, ball: Ball, most) -> np.ndarray:
    """Compute the horizontal velocity change (..., 3) m/s that stops the lowest point, limited to `most` (...,) m/s."""
    push = compute_slip(velocity, spin, ball) * (-ball.inertia / (1.0 + ball.inertia))
    size = vector_length(push)
    return push * np.minimum(1.0, most / np.maximum(size, 1e-12))[..., None]


def _compute_spin_change(push: np.ndarray, ball: Ball) -> np.ndarray:
    """Compute the spin change (..., 3) rad/s by a horizontal velocity change (..., 3) m/s at the lowest point."""
    out = np.zeros(push.shape)
    out[..., 0], out[..., 1] = push[..., 1], -push[..., 0]
    return out / (ball.inertia * ball.radius)
