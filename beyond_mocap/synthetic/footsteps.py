"""Stances of the feet and their movement between stances: in contact they roll from the heel to the toes.

A foot's movement is a sequence of stances. In a stance its sole rolls over heel, ball and toe tip without sliding (the
rockers of Perry 1992, "Gait analysis"). Between two stances it follows the published angles of a swinging leg, bent so
that it leaves and lands where the stances are, with their speed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.easing import quintic_step
from ..base.time_series import interpolate_columns
from ..motion.retargeting.neutral import NeutralStance
from . import gait_tables as tables

# rad of pitch beyond which the ball of the foot leaves the ground and the toe tip stays
TOE_LIFT_PITCH = np.radians(42.0)
# rad of pitch around it over which a sprinter's toes begin to lift
_SPRINT_SOFT = np.radians(6.0)
# shares of a swing over which the speed of a foot's pitch at its landing is corrected: of a walk or jog, and of a
# sprint, whose toes stay up until just before they land
_PITCH_REACH = (1.0 / 3.0, 1.0 / 12.0)
# m for an adult: a step this long is a full one; shorter ones roll and lift less
_FULL_STEP = 0.55


@dataclass(frozen=True, eq=False, kw_only=True)
class Footsteps:
    """The K stances of one foot in order of time.

    Attributes:
        side: 0 left, 1 right.
        on: (K,) s at which the foot lands.
        off: (K,) s at which it leaves the ground.
        place: (K, 2) m, below the ankle of the flat foot, world frame.
        yaw: (K,) rad, direction of the foot.
        speed: (K,) m/s of travel for an adult's leg, which selects how the foot rolls.
        direction: (K,) rad, travel relative to the foot.
    """

    side: int
    on: np.ndarray
    off: np.ndarray
    place: np.ndarray
    yaw: np.ndarray
    speed: np.ndarray
    direction: np.ndarray

    def find_stance(self, times: np.ndarray) -> np.ndarray:
        """Find the stance at each of `times` (T,): the current one, or the last one before it."""
        return np.clip(np.searchsorted(self.on, times, side="right") - 1, 0, len(self.on) - 2)

    def is_in_contact(self, times: np.ndarray) -> np.ndarray:
        """Whether the foot is in contact with the ground at `times`: (T,) bool."""
        return times <= self.off[self.find_stance(times)]

    def compute_step_size(self, scale: float) -> np.ndarray:
        """Compute the share (K-1,) of a full step between each stance and the next; turning on the spot counts too."""
        distances = np.linalg.norm(np.diff(self.place, axis=0), axis=1) / scale
        return quintic_step((distances + 0.3 * np.abs(np.diff(self.yaw))) / _FULL_STEP)


@dataclass(frozen=True, eq=False)
class FootPath:
    """Movement of one foot over T moments.

    Attributes:
        ankle: (T, 3) m, world frame.
        pitch: (T,) rad of the sole, toes down positive.
        yaw: (T,) rad, direction of the foot.
        bend: (T,) rad of the toes, up positive.
    """

    ankle: np.ndarray
    pitch: np.ndarray
    yaw: np.ndarray
    bend: np.ndarray


def compute_stance(steps: Footsteps, which: np.ndarray, share: np.ndarray, neutral: NeutralStance) -> FootPath:
    """Compute the foot within its stances: it rolls over heel, ball and toe tip, none of which slides.

    Args:
        steps: the stances.
        which: (T,) index of the stance.
        share: (T,) share of the stance that has passed.
        neutral: neutral stance of the body.
    Returns:
        The foot at these T moments.
    """
    sizes = steps.compute_step_size(neutral.leg / tables.LEG)
    before = np.concatenate([sizes[:1], sizes])[which]
    after = np.concatenate([sizes, sizes[-1:]])[which]
    amount = before + (after - before) * quintic_step((share - 0.2) / 0.3)
    pitch = amount * _compute_pitch(share, steps.speed[which], steps.direction[which])
    tip_pitch = 0.6 * np.maximum(pitch - TOE_LIFT_PITCH, 0.0)
    # a sprinter pushes off over the tip of the boot: toes leave the ground with all of that excess, softly
    soft = _SPRINT_SOFT * np.logaddexp(0.0, (pitch - TOE_LIFT_PITCH) / _SPRINT_SOFT)
    tip_pitch = tip_pitch + tables.compute_sprint_share(steps.speed[which]) * (soft - tip_pitch)
    forward, up = roll_foot(pitch, tip_pitch, neutral, steps.side)
    yaw = steps.yaw[which]
    ankle = np.stack(
        [steps.place[which, 0] + forward * np.cos(yaw), steps.place[which, 1] + forward * np.sin(yaw), up], axis=-1
    )
    return FootPath(ankle, pitch, yaw, np.maximum(pitch, 0.0) - tip_pitch)


def _compute_pitch(share: np.ndarray, speed: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Compute the pitch (T,) rad of the sole for a direction of travel.

    Forward the foot rolls from heel to toe, backward the other way round and less (source T); sideways the heel hardly
    leaves the ground.
    """
    ahead, back = np.maximum(np.cos(direction), 0.0) ** 2, np.maximum(-np.cos(direction), 0.0) ** 2
    forward_roll = tables.interpolate_stance_pitch(share, speed)
    backward_roll = tables.interpolate_stance_pitch(1.0 - share, speed)
    return (
        ahead * forward_roll
        + 0.5 * back * backward_roll
        + 0.25 * np.sin(direction) ** 2 * np.maximum(forward_roll, 0.0)
    )


def roll_foot(pitch: np.ndarray, tip_pitch: np.ndarray, neutral: NeutralStance, side: int) -> tuple[np.ndarray,
        np.ndarray]:
    """Compute how far the ankle is ahead of its flat place and above the ground, (T,) m each, when the sole pitches."""
    ball_ahead, drop = neutral.ball[side, 0], -neutral.ball[side, 2]
    ball_up = neutral.ankle_height - drop
    # toes down: the foot turns about its ball and, beyond TOE_LIFT_PITCH, about the toe tip
    tip = neutral.tip
    lifted_ahead = ball_ahead + tip * (1.0 - np.cos(tip_pitch))
    lifted_up = ball_up + tip * np.sin(tip_pitch)
    ahead = lifted_ahead - ball_ahead * np.cos(pitch) + drop * np.sin(pitch)
    up = lifted_up + ball_ahead * np.sin(pitch) + drop * np.cos(pitch)
    # toes up: the foot turns about its heel
    heel_ahead = -neutral.heel + neutral.heel * np.cos(pitch) + neutral.ankle_height * np.sin(pitch)
    heel_up = -neutral.heel * np.sin(pitch) + neutral.ankle_height * np.cos(pitch)
    return np.where(pitch >= 0.0, ahead, heel_ahead), np.where(pitch >= 0.0, up, heel_up)


class FootMovement:
    """The movement of one foot at T moments: all of it that does not hang on the hips, computed once.

    Args:
        steps: the stances.
        times: (T,) s, evenly spaced.
        heading: (T,) rad of the body.
        neutral: neutral stance of the body.
        thigh_shank: bone lengths, m.
    """

    def __init__(self, steps: Footsteps, times: np.ndarray, heading: np.ndarray, neutral: NeutralStance,
                 thigh_shank: tuple[float, float]):
        self.times = times
        which = steps.find_stance(times)
        share = np.clip((times - steps.on[which]) / (steps.off[which] - steps.on[which]), 0.0, 1.0)
        self.stance = compute_stance(steps, which, share, neutral)
        self.is_in_air = times > steps.off[which]
        self.swings = None
        if np.any(self.is_in_air):
            self.swings = _Swings(steps, which[self.is_in_air], times, air=self.is_in_air, heading=heading,
                                  neutral=neutral, thigh_shank=thigh_shank)

    def compute_path(self, hip: np.ndarray) -> FootPath:
        """Compute the foot at these T moments for a hip joint at `hip`, (T, 3) m, world frame."""
        if self.swings is None:
            return self.stance
        swing, out = self.swings.compute_path(self.times, hip), {}
        for name in ("ankle", "pitch", "yaw", "bend"):
            out[name] = getattr(self.stance, name).copy()
            out[name][self.is_in_air] = getattr(swing, name)
        return FootPath(**out)


class _Swings:
    """The foot in the air at N moments `times[air]`, after stances `which`. All frames of a swing have the same two
    ends, which are computed once a swing.
    """

    def __init__(self, steps: Footsteps, which, times, air, heading, neutral: NeutralStance, thigh_shank):
        scale = neutral.leg / tables.LEG
        swings, of = np.unique(which, return_inverse=True)
        begin, end = steps.off[swings], steps.on[swings + 1]
        length = end - begin
        self.neutral, self.of, self.length = neutral, of, length
        self.share = (times[air] - begin[of]) / length[of]
        self.leave, self.land = (
            compute_stance(steps, w, np.full(len(w), u), neutral) for w, u in ((swings, 1.0), (swings + 1, 0.0))
        )
        self.leave_speed, self.land_speed = _compute_edge_speeds(steps, swings, neutral)
        self.size = steps.compute_step_size(scale)[which]
        wanted = [np.concatenate([foot.ankle, foot.pitch[:, None]], axis=-1) for foot in (self.leave, self.land)]
        self.wanted_leave, self.wanted_land = wanted
        self.small = _compute_small_step(self.share, self.wanted_leave[of], self.wanted_land[of],
                                         self.size * 0.05 * scale)
        speed = 0.5 * (steps.speed[swings] + steps.speed[swings + 1])
        direction = steps.direction[swings + 1]
        jog, sprint = _PITCH_REACH
        self.pitch_reach = (jog + (sprint - jog) * tables.compute_sprint_share(speed))[of]
        step = self.step = 0.01

        def publish(at, share_at, rows=slice(None)):
            """Seconds `at`, and ankle (N, 3) from the hip and pitch (N, 1) of the published swings of `rows`."""
            heading_at = np.interp(at, times, heading)
            forward, up, pitch = _compute_leg_swing(share_at, speed[rows], direction[rows], thigh_shank)
            return at, np.stack([forward * np.cos(heading_at), forward * np.sin(heading_at), up], axis=-1), pitch[:,
                    None]

        self.now = publish(times[air], self.share, of)
        self.at_leave, self.at_land = publish(begin, np.zeros_like(length)), publish(end, np.ones_like(length))
        self.after_leave = publish(begin + step * length, np.full_like(length, step))
        self.before_land = publish(end - step * length, np.full_like(length, 1 - step))

    def compute_path(self, times: np.ndarray, hip: np.ndarray) -> FootPath:
        """Compute the foot in the air, hung on the hip joint, (T, 3) m at `times` (T,)."""

        def hang(published):
            at, from_hip, pitch = published
            return np.concatenate([interpolate_columns(at, times, hip) + from_hip, pitch], axis=-1)

        of, share, span = self.of, self.share, (self.step * self.length)[:, None]
        at_leave, at_land = hang(self.at_leave), hang(self.at_land)
        # velocities of the published swing at its ends, by one-sided differences
        free_leave = (hang(self.after_leave) - at_leave) / span
        free_land = (at_land - hang(self.before_land)) / span
        full = hang(self.now) + _bridge_ends(
            share, self.length[of], (self.wanted_leave - at_leave)[of], offset1=(self.wanted_land - at_land)[of],
            speed0=(self.leave_speed - free_leave)[of], speed1=(self.land_speed - free_land)[of],
            pitch_reach=self.pitch_reach)
        size, neutral = self.size, self.neutral
        mixed = full * size[:, None] + self.small * (1.0 - size[:, None])
        yaw = self.leave.yaw[of] + (self.land.yaw - self.leave.yaw)[of] * quintic_step(share)
        ankle = mixed[:, :3].copy()
        ankle[:, 2] += _compute_clearance(ankle[:, 2], mixed[:, 3], share, size, neutral)
        return FootPath(ankle, mixed[:, 3], yaw, self.leave.bend[of] * (1.0 - quintic_step(share / 0.3)))


def _compute_edge_speeds(steps: Footsteps, which: np.ndarray, neutral: NeutralStance) -> tuple[np.ndarray, np.ndarray]:
    """Compute the velocities (N, 4) of ankle and pitch at the end of stances `which` and at the start of the next ones.
    """
    edges = []
    for stance, inner, edge in ((which, 0.98, 1.0), (which + 1, 0.02, 0.0)):
        a, b = (compute_stance(steps, stance, np.full(len(stance), u), neutral) for u in (inner, edge))
        span = (edge - inner) * (steps.off[stance] - steps.on[stance])
        change = np.concatenate([b.ankle - a.ankle, (b.pitch - a.pitch)[:, None]], axis=-1)
        edges.append(change / span[:, None])
    return edges[0], edges[1]


def _compute_leg_swing(share, speed, direction, thigh_shank) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute the ankle ahead of and above the hip joint, (N,) m each, and the sole's pitch (N,) rad, from published
    angles.
    """
    parts = []
    for at in (share, 1.0 - share):
        thigh, knee, ankle = np.moveaxis(tables.interpolate_swing(at, speed), -1, 0)
        shank = thigh - knee
        ahead = thigh_shank[0] * np.sin(thigh) + thigh_shank[1] * np.sin(shank)
        up = -thigh_shank[0] * np.cos(thigh) - thigh_shank[1] * np.cos(shank)
        parts.append((ahead, up, -shank - ankle))
    ahead_share, back_share = np.maximum(np.cos(direction), 0.0) ** 2, np.maximum(-np.cos(direction), 0.0) ** 2
    side_share = np.sin(direction) ** 2
    (x0, z0, p0), (x1, z1, p1) = parts
    return (
        ahead_share * x0 + back_share * x1, ahead_share * z0 + back_share * z1 + side_share * 0.5 * (z0 + z1),
        ahead_share * p0 + 0.6 * back_share * p1 + side_share * np.radians(8.0),
    )


def _bridge_ends(share, length, offset0, offset1, speed0, speed1, pitch_reach) -> np.ndarray:
    """Compute what to add (N, 4) along a swing so that both ends move by the offsets and their speeds change as
    requested.

    Offsets are spread over the whole swing; speeds are corrected within its first and last third, that of the pitch
    within the last `pitch_reach` (N,).
    """
    third = np.full((len(share), 4), 1.0 / 3.0)
    landing = np.column_stack([third[:, :3], pitch_reach])
    blend = quintic_step(share)[:, None]
    out = offset0 * (1.0 - blend) + offset1 * blend
    for s, speed, reach, sign in ((share, speed0, third, 1.0), (1.0 - share, speed1, landing, -1.0)):
        inside = np.clip(s[:, None] / reach, 0.0, 1.0)
        out = out + sign * speed * ((length * s)[:, None] * (1.0 - inside) ** 2)
    return out


def _compute_small_step(share, leave, land, lift) -> np.ndarray:
    """Compute a foot (N, 4) that moves straight to its next place, slightly lifted."""
    out = leave + (land - leave) * quintic_step(share)[:, None]
    out[:, 2] += lift * np.sin(np.pi * share) ** 2
    return out


def _compute_clearance(ankle_up, pitch, share, size, neutral: NeutralStance) -> np.ndarray:
    """Compute how much (N,) m to lift the swinging foot so that toes and heel pass above the ground."""
    clearance = 0.014 * size * np.sin(np.pi * share) ** 2
    return compute_ground_lift(ankle_up, pitch, neutral, clearance) * np.sqrt(np.clip(np.sin(np.pi * share), 0.0, 1.0))


def lift_foot(rows: np.ndarray, neutral: NeutralStance) -> np.ndarray:
    """Convert table rows of a foot to the body's size, above the ground.

    Args:
        rows: (T, 5) of an adult: ahead, left, raised (m), pitch, yaw (degrees).
        neutral: neutral stance of the body.
    Returns:
        (T, 6): ankle (m) and the foot's rotation (rad).
    """
    scale = neutral.leg / tables.LEG
    ahead, left, raised, pitch, yaw = rows.T
    pitch, yaw = np.radians(pitch), np.radians(yaw)
    up = neutral.ankle_height + raised * scale
    up = up + compute_ground_lift(up, pitch, neutral) * (np.abs(pitch) > 1e-3)
    return np.stack([ahead * scale, left * scale, up, np.zeros_like(up), pitch, yaw], axis=-1)


def compute_ground_lift(
    ankle_up: np.ndarray, pitch: np.ndarray, neutral: NeutralStance, clearance: float | np.ndarray = 0.0
) -> np.ndarray:
    """Compute how much to raise a foot for its lowest point to be `clearance` above the ground, with a soft limit.

    Args:
        ankle_up: (T,) m, height of the ankle.
        pitch: (T,) rad of the sole, toes down positive.
        neutral: neutral stance of the body.
        clearance: m, one or (T,).
    Returns:
        (T,) m.
    """
    ball_ahead, drop, ball_up = neutral.ball[0, 0], -neutral.ball[0, 2], neutral.ankle_height + neutral.ball[0, 2]
    toe = ankle_up - (ball_ahead + neutral.tip) * np.sin(pitch) - drop * np.cos(pitch) - ball_up
    heel = ankle_up + neutral.heel * np.sin(pitch) - neutral.ankle_height * np.cos(pitch)
    soft = 0.006
    return soft * np.logaddexp(0.0, (clearance - np.minimum(toe, heel)) / soft)
