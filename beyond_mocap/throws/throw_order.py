"""What is asked of a throw or kick at a target, and what comes of it: the order, what was thrown, the ball's path."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..ball.flight import Flight, Launch, fly
from ..ball.physics import BALLS, THROWN, Ball
from ..base.errors import InputError
from ..motion import quaternion
from ..motion.motion import Motion
from ..motion.skeleton import Skeleton
from ..motion.track.ball_path import BallPath
from ..synthetic.throws import grip_of
from .correction import Freedom
from .letting_go import AtFoot, InHand, grip_point
from .networks.chains import EFFECTORS

KINDS: dict[str, Ball] = {**BALLS, **THROWN}
"""Balls by name."""
RATES = (10.0, 480.0)
"""Frames per second in which a throw can be shown: the ball's velocity is that of the hand between them."""


@dataclass(frozen=True)
class Order:
    """What is asked for.

    target: (3,) m, world, that the ball's centre is to go through. limb: of EFFECTORS, None: what the examples use.
    speed: m/s wished for as the ball leaves, None: what suits. ball: a kind's name or a `Ball`, None: baseball in a
    hand, football at a foot. One of start, over, ball_place (each (2,) or (3,) m over the ground) says where: where
    the hips are in the first frame; where they are at the release; where the ball is that is kicked, on the ground or
    as far above it as a foot gets. None: start at the origin. The body faces as the examples do, against the target.
    release_time: s on the caller's clock at which the ball leaves, None: the motion begins at 0. fps: of the result,
    None: the model's. seed: another motion with the same aim. freedom: what the correction may change beside wrist or
    ankle."""

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
            raise InputError("ball", self.ball[:40], ", ".join(KINDS))
        if self.speed is not None and not 0.0 < self.speed < np.inf:
            raise InputError("speed", f"{self.speed:g} m/s", "more than 0")
        if self.seed < 0:
            raise InputError("seed", str(self.seed)[:40], "0 or more")
        given = [value for value in (self.start, self.over, self.ball_place) if value is not None]
        if len(given) > 1:
            raise InputError("throw", "several places", "one of start, over and ball_place")
        if any(len(value) not in (2, 3) or not np.all(np.isfinite(value)) for value in given):
            raise InputError("throw", f"a place {given[0]}"[:60], "x, y or x, y, z in metres")
        if self.ball_place is not None and self.limb is not None and self.limb.endswith("hand"):
            raise InputError("throw", "a place where the ball lies", "a foot that kicks it")
        if self.fps is not None and not RATES[0] <= self.fps <= RATES[1]:
            raise InputError("fps", f"{self.fps:g}", f"{RATES[0]:g} to {RATES[1]:g} frames a second")


@dataclass(frozen=True, eq=False, kw_only=True)
class Thrown:
    """A throw or kick that hits as well as physics lets it.

    motion; start_time: s of its first frame on the caller's clock; release: s from its first frame at which the ball
    leaves. limb: of EFFECTORS. ball: its kind. grip: (3,) m, the ball in the hand joint's axes, None for kicks. path:
    the ball at the motion's rate, carried or lying, then in flight, beyond the motion's end until it is past its
    target. launch, flight. target, impact: (3,) m. moved: m that the wrist or ankle was moved at most, by shift (T,
    3) m. turned rad, pace, later s, elsewhere m: how else the motion was changed (see `Corrected`). slowest: m/s
    below which no ball gets there. asked_speed: m/s wished for, without a wish what came. raw_deviation: m that hands
    and feet were off their wanted ways before any inverse kinematics, on average.
    beyond: rad that a joint of the corrected limb is beyond the model's limits at most, which is nothing but what other
    bones or another rate have made of it before anything was corrected. examples: names and weights of what it was
    planned from. warnings: lines for people."""

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
    moved: float
    shift: np.ndarray
    turned: float
    pace: float
    later: float
    elsewhere: float
    slowest: float
    asked_speed: float
    raw_deviation: float
    beyond: float
    examples: tuple[tuple[str, float], ...]
    warnings: tuple[str, ...] = ()

    @property
    def impact_error(self) -> float:
        """m between target and impact, infinite where the ball does not get there."""
        error = float(np.linalg.norm(self.impact - self.target))
        return error if np.isfinite(error) else np.inf

    @property
    def speed(self) -> float:
        """m/s of the ball as it leaves."""
        return float(np.linalg.norm(self.launch.velocity))

    @property
    def release_time(self) -> float:
        """s on the caller's clock at which the ball leaves."""
        return self.start_time + self.release

    def report(self) -> dict:
        """All figures, for a JSON report."""
        frames = np.flatnonzero(np.any(self.shift != 0.0, axis=1))
        return {
            "limb": self.limb, "ball": self.ball.name, "fps": self.motion.fps, "frames": len(self.motion),
            "duration_s": self.motion.duration, "release_time_s": self.release_time,
            "release_frame": self.release * self.motion.fps, "release_position_m": self.launch.position,
            "velocity_m_s": self.launch.velocity, "spin_rad_s": self.launch.spin, "speed_m_s": self.speed,
            "asked_speed_m_s": self.asked_speed, "slowest_m_s": self.slowest, "target_m": self.target,
            "impact_m": self.impact, "impact_error_m": self.impact_error, "moved_m": self.moved,
            "corrected_frames": [int(frames[0]), int(frames[-1])] if len(frames) else [],
            "turned_deg": np.degrees(self.turned), "pace": self.pace, "release_later_s": self.later,
            "begins_elsewhere_m": self.elsewhere,
            "raw_deviation_m": self.raw_deviation, "joint_beyond_deg": np.degrees(self.beyond),
            "examples": {name: weight for name, weight in self.examples}, "warnings": list(self.warnings),
        }  # fmt: skip


def part_of(skeleton: Skeleton, limb: int, ball: Ball, lies: np.ndarray | None = None) -> InHand | AtFoot:
    """What lets the ball go. lies (3,) m: where a ball lies that is kicked, None: where it suits."""
    side, what = EFFECTORS[limb].split("_")
    return AtFoot(side, lies) if what == "foot" else InHand(side, grip_of(skeleton, side, ball.radius))


def within(thrown: Thrown, motion: Motion, start: float, release: float, first: int) -> Thrown:
    """The throw as part of a longer motion that begins at `start` s and shows the throw from its frame `first` on,
    which the ball leaves at `release` s: as `throws.join_throw` says. The ball is held, or lies, all the time
    before."""
    launch = replace(thrown.launch, time=release)
    flight = fly(launch, thrown.ball, thrown.flight.end - thrown.launch.time + motion.duration)
    shift = np.zeros((len(motion), 3))
    shift[first : first + len(thrown.shift)] = thrown.shift[: len(motion) - first]
    part = part_of(motion.skeleton, EFFECTORS.index(thrown.limb), thrown.ball)
    seconds = thrown.path.times[-1] - thrown.launch.time
    return replace(
        thrown, motion=motion, start_time=start, release=release - start, shift=shift, launch=launch, flight=flight,
        path=ball_path(motion, part, flight, start, seconds),
    )


def ball_path(motion: Motion, part: InHand | AtFoot, flight: Flight, start: float, seconds: float) -> BallPath:
    """The ball at the motion's rate, from `start` s on the caller's clock until the motion ends and it has flown
    `seconds`."""
    fps = motion.fps
    left = flight.launch.time
    last = max(len(motion) - 1, int(np.ceil((left - start + seconds) * fps)))
    frames = np.arange(last + 1)
    times = start + frames / fps
    flies = times > left
    positions = flight.at(np.maximum(times, left))
    if isinstance(part, InHand):
        held = frames[~flies]
        positions[held] = grip_point(motion, part, held.astype(float))[:, 0]
    rotations = quaternion.identity(len(times)) if not np.any(flight.launch.spin) else flight.rotations(times)
    return BallPath(times, positions, np.zeros(len(times), bool), rotations)
