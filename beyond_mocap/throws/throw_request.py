"""Request for a throw or kick at a target, its result, and the ball's path."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..ball.flight import Flight, Launch, simulate_flight
from ..ball.physics import BALLS, THROWN_BALLS, Ball
from ..base.errors import InputError
from ..motion import quaternion
from ..motion.motion import Motion
from ..motion.skeleton import Skeleton
from ..motion.track.ball_path import BallPath
from ..synthetic.throws import find_grip
from .ball_release import AtFoot, InHand, sample_points
from .corrected_motion import Freedom
from .networks.chains import EFFECTORS

KINDS: dict[str, Ball] = {**BALLS, **THROWN_BALLS}
"""Kinds of balls by name."""
RATES = (10.0, 480.0)
"""Frame rates, frames per second, at which a throw can be generated: the ball's velocity is that of the hand between
frames.
"""


@dataclass(frozen=True)
class ThrowRequest:
    """Request for a throw or kick.

    At most one of start, over and ball_place positions it on the ground; without any it starts at the origin. The
    body faces the target as the examples do.

    Attributes:
        target: (3,) m, world, point that the ball's centre has to pass.
        limb: one of EFFECTORS, None: the one that the examples use.
        speed: m/s of the ball at the release, None: automatic.
        ball: name of a kind or a `Ball`, None: baseball in a hand, football at a foot.
        start: (2,) or (3,) m, position of the hips in the first frame.
        over: (2,) or (3,) m, position of the hips at the release.
        ball_place: (2,) or (3,) m, position of the kicked ball, on the ground or as far above it as a foot reaches.
        release_time: s on the caller's clock at which the ball leaves, None: the motion begins at 0.
        fps: frames per second of the result, None: the model's.
        seed: selects another motion with the same target.
        freedom: what the correction may change besides wrist or ankle.
    """

    target: tuple[float, float, float]
    limb: str | None = None
    speed: float | None = None
    ball: str | Ball | None = None
    start: tuple[float, ...] | None = None
    over: tuple[float, ...] | None = None
    ball_place: tuple[float, ...] | None = None
    release_time: float | None = None
    fps: float | None = None
    seed: int = 0
    freedom: Freedom = field(default_factory=Freedom)

    def __post_init__(self):
        target = np.asarray(self.target, float)
        if target.shape != (3,) or not np.all(np.isfinite(target)):
            raise InputError("target", str(self.target)[:60], "x, y, z in metres")
        if self.limb is not None and self.limb not in EFFECTORS:
            raise InputError("limb", str(self.limb)[:40], ", ".join(EFFECTORS))
        if isinstance(self.ball, str) and self.ball not in KINDS:
            raise InputError("ball", f"the kind {self.ball[:40]!r}", f"one of {', '.join(KINDS)}",
                             "choose one of these")  # fmt: skip
        if self.speed is not None and not 0.0 < self.speed < np.inf:
            raise InputError("speed", f"{self.speed:g} m/s", "more than 0 m/s")
        if self.seed < 0:
            raise InputError("seed", str(self.seed)[:40], "0 or more")
        given = [value for value in (self.start, self.over, self.ball_place) if value is not None]
        if len(given) > 1:
            raise InputError("throw", "several positions", "only one: of the start, the release or the ball")
        if any(len(value) not in (2, 3) or not np.all(np.isfinite(value)) for value in given):
            raise InputError("throw", f"a position {given[0]}"[:60], "x, y or x, y, z in metres")
        if self.ball_place is not None and self.limb is not None and self.limb.endswith("hand"):
            raise InputError("throw", "a ball on the ground and a hand", "a foot that kicks the ball")
        if self.fps is not None and not RATES[0] <= self.fps <= RATES[1]:
            raise InputError("fps", f"{self.fps:g}", f"{RATES[0]:g} to {RATES[1]:g} frames per second")


@dataclass(frozen=True, eq=False, kw_only=True)
class ThrowResult:
    """A generated throw or kick that hits the target as well as physics allows.

    Attributes:
        motion: the motion.
        start_time: s of its first frame on the caller's clock.
        release: s from its first frame at which the ball leaves.
        limb: one of EFFECTORS.
        ball: kind of ball.
        grip: (3,) m, the ball in the hand joint's axes, None for kicks.
        path: the ball at the motion's rate, held or at rest, then in flight, beyond the motion's end until it is
            past its target.
        launch: position, velocity and spin at the release.
        flight: flight of the ball.
        target: (3,) m.
        impact: (3,) m, where the ball passes the target.
        displacement: m, largest displacement of the wrist or ankle by the correction.
        shift: (T, 3) m, displacement of the wrist or ankle in each frame.
        rotation: rad by which the body was rotated (see `CorrectedMotion`).
        pace: playback rate that was applied.
        release_delay: s by which the release was moved.
        foot_tilt: rad by which a kicking foot was pointed.
        start_offset: m by which the start was moved.
        min_speed: m/s, lowest speed at which a ball reaches the target.
        requested_speed: m/s requested, or the actual speed without a request.
        network_deviation: m, mean distance of hands and feet from their targets before any inverse kinematics.
        limit_excess: rad, largest excess of a joint of the corrected limb over the model's limits; only other bones or
            another frame rate can cause it, before any correction.
        examples: names and weights of the blended examples.
        warnings: warnings for people.
    """

    motion: Motion
    start_time: float
    release: float
    limb: str
    ball: Ball
    grip: np.ndarray | None
    path: BallPath
    launch: Launch
    flight: Flight
    target: np.ndarray
    impact: np.ndarray
    displacement: float
    shift: np.ndarray
    rotation: float
    pace: float
    release_delay: float
    foot_tilt: float
    start_offset: float
    min_speed: float
    requested_speed: float
    network_deviation: float
    limit_excess: float
    examples: tuple[tuple[str, float], ...]
    warnings: tuple[str, ...] = ()

    @property
    def impact_error(self) -> float:
        """Distance (m) between target and impact, infinite if the ball does not reach the target."""
        error = float(np.linalg.norm(self.impact - self.target))
        return error if np.isfinite(error) else np.inf

    @property
    def speed(self) -> float:
        """Speed (m/s) of the ball at the release."""
        return float(np.linalg.norm(self.launch.velocity))

    @property
    def release_time(self) -> float:
        """Time (s) of the release on the caller's clock."""
        return self.start_time + self.release

    def build_report(self) -> dict:
        """Collect all figures for a JSON report."""
        frames = np.flatnonzero(np.any(self.shift != 0.0, axis=1))
        return {
            "limb": self.limb, "ball": self.ball.name, "fps": self.motion.fps, "frames": len(self.motion),
            "duration_s": self.motion.duration, "release_time_s": self.release_time,
            "release_frame": self.release * self.motion.fps, "release_position_m": self.launch.position,
            "velocity_m_s": self.launch.velocity, "spin_rad_s": self.launch.spin, "speed_m_s": self.speed,
            "asked_speed_m_s": self.requested_speed, "slowest_m_s": self.min_speed, "target_m": self.target,
            "impact_m": self.impact, "impact_error_m": self.impact_error, "moved_m": self.displacement,
            "corrected_frames": [int(frames[0]), int(frames[-1])] if len(frames) else [],
            "turned_deg": np.degrees(self.rotation), "pace": self.pace, "release_later_s": self.release_delay,
            "foot_pointed_deg": np.degrees(self.foot_tilt),
            "begins_elsewhere_m": self.start_offset,
            "raw_deviation_m": self.network_deviation, "joint_beyond_deg": np.degrees(self.limit_excess),
            "examples": {name: weight for name, weight in self.examples}, "warnings": list(self.warnings),
        }  # fmt: skip


def build_release_part(skeleton: Skeleton, limb: int, ball: Ball, rest_position: np.ndarray
                       | None = None) -> InHand | AtFoot:
    """Build the hand or foot that releases the ball.

    Args:
        skeleton: skeleton of the body.
        limb: index into EFFECTORS.
        ball: kind of ball.
        rest_position: (3,) m of a kicked ball, None: to be chosen.
    """
    side, what = EFFECTORS[limb].split("_")
    return AtFoot(side, rest_position) if what == "foot" else InHand(side, find_grip(skeleton, side, ball.radius))


def place_in_motion(thrown: ThrowResult, motion: Motion, start: float, release: float, first: int) -> ThrowResult:
    """Convert a throw to a part of a longer motion, as built by `throws.join_throw`.

    The ball is held, or at rest, all the time before.

    Args:
        thrown: the throw.
        motion: the longer motion.
        start: s of its first frame.
        release: s at which the ball leaves.
        first: frame of the longer motion with the first frame of the throw.
    """
    launch = replace(thrown.launch, time=release)
    flight = simulate_flight(launch, thrown.ball, thrown.flight.end - thrown.launch.time + motion.duration)
    shift = np.zeros((len(motion), 3))
    shift[first : first + len(thrown.shift)] = thrown.shift[: len(motion) - first]
    part = build_release_part(motion.skeleton, EFFECTORS.index(thrown.limb), thrown.ball)
    seconds = thrown.path.times[-1] - thrown.launch.time
    return replace(
        thrown, motion=motion, start_time=start, release=release - start, shift=shift, launch=launch, flight=flight,
        path=build_ball_path(motion, part, flight, start, seconds),
    )


def build_ball_path(motion: Motion, part: InHand | AtFoot, flight: Flight, start: float, seconds: float) -> BallPath:
    """Build the ball's path at the motion's rate.

    Args:
        motion: the motion.
        part: hand or foot.
        flight: flight of the ball.
        start: s of the first frame on the caller's clock.
        seconds: s of flight to include; the path lasts at least as long as the motion.
    """
    fps = motion.fps
    release_time = flight.launch.time
    last = max(len(motion) - 1, int(np.ceil((release_time - start + seconds) * fps)))
    frames = np.arange(last + 1)
    times = start + frames / fps
    in_flight = times > release_time
    positions = flight.at(np.maximum(times, release_time))
    if isinstance(part, InHand):
        held = frames[~in_flight]
        positions[held] = sample_points(motion, part, held.astype(float))[:, 0]
    rotations = quaternion.identity(len(times)) if not np.any(flight.launch.spin) else flight.rotations(times)
    return BallPath(times, positions, np.zeros(len(times), bool), rotations)
