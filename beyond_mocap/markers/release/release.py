"""Estimate when and how a ball left the hand in a recorded throw (Fredriksson chapter 6).

`estimate_release(trial, motion)` takes the markers and the motion that was solved from them. Where a marker on the ball
is visible in flight, release time, trajectory and spin are fitted to it; else the hand is the evidence, with more
uncertainty. Neither uses the speed that the file name may give: that is reported beside the result, for comparison.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ...ball.flight import Launch, simulate_flight
from ...ball.physics import THROWN_BALLS, Ball
from ...base.errors import InputError
from ...base.settings import find_setting
from ...motion.contacts import measure_ground_height
from ...motion.hand import Hand, build_hand
from ...motion.humanoid import identify_joints
from ...motion.motion import Motion, forward_kinematics, resample
from ...motion.track.ball_path import BallPath
from ..trial import MarkerTrial, resample_evenly
from .held_ball import (
    MAX_BALL_DISTANCE,
    choose_hand,
    estimate_usual_place,
    find_ball_label,
    find_held_frames,
    guess_release,
    list_ball_labels,
)
from .launch_fit import HeldMarker, fit_launch
from .radar_speed import parse_radar_speed
from .throw_check import check_throw
from .throwing_hand import HandBall, fit_hand_ball, place_ball, refine_hand
from .without_ball import HOLD, estimate_hand_release, measure_roll_time

MIN_FRAMES = 12  # frames that a trial with a throw must have
# Frames of flight that determine the marker's circle, and radii from which on it is another ball's.
_MIN_CIRCLE_FRAMES, _MAX_CIRCLE_RATIO = 10, 1.25
_AIR_UNCERTAINTY = 0.25  # uncertainty of the effect of air, as a share of it
_MAX_OFFSET = 1.5  # metres between the middle of the markers and that of the joints, at most
_MAX_FLIGHT = 8.0  # s of flight until the ground
# Uncertainty in metres of where the marker leaves: visible in the hand, or never visible there.
_HELD_SIGMA, _HIDDEN_SIGMA = 0.006, 0.05

# Standard deviations that hold 90 % of normal errors: of a number, and of an angle in two directions.
_INTERVAL_90, _CONE_90 = 1.645, 2.146
_ROLL_SHARE = 0.5  # share of the roll along the fingers by which 90 % of balls leave later than their markers show


@dataclass(frozen=True)
class ReleaseSettings:
    """What is known beforehand.

    Attributes:
        ball_marker: label; None to find one named as a ball, "" for none.
        radius: metres; None for that of the ball's kind, or fitted where the markers determine it.
        hand: "left" or "right"; None for the one that throws.
        ball: one of `THROWN_BALLS`.
        window: s before and after the first guess that are searched.
        centre: (3,) metres, the ball's centre in the hand's frame, where known from other throws.
    """

    ball_marker: str | None = None
    radius: float | None = None
    hand: str | None = None
    ball: str = find_setting("release", "ball").default
    window: float = 0.12
    centre: tuple[float, float, float] | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class Release:
    """How the ball left the hand.

    All places are in the motion's space, above its own floor; markers may be shifted from it.

    Attributes:
        time: s from the trial's first frame.
        frame: the nearest frame.
        position: (3,) metres, the ball's centre at the release.
        velocity: (3,) m/s.
        spin: (3,) rad/s, zero where unknown.
        time_margin: s, half the interval that holds 90 % of the cases.
        speed_margin: m/s, likewise.
        direction_margin: rad, half the angle of the cone that holds 90 %.
        side: of the hand, "left" or "right".
        method: "ball" if estimated from the ball's marker, "hand" if from the hand alone.
        residual: metres of the ball's marker in flight, NaN without.
        flight_frames: frames in which the marker is visible in flight.
        radar: m/s from the file name, or None.
        centre: (3,) metres, the ball's centre in the hand's frame.
        radius: metres.
        path: the ball in all frames.
        impact: (3,) metres, where it first meets the ground, or None.
        hips: (3,) metres in the first frame.
        ball_label: the ball's marker, "" without.
        held: (N, 3) metres, that marker in the hand's frame while the ball is held; N is 0 where it is not visible.
        notes: messages for people.
    """

    time: float
    frame: int
    position: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    time_margin: float
    speed_margin: float
    direction_margin: float
    side: str
    method: str
    residual: float
    flight_frames: int
    radar: float | None
    centre: np.ndarray
    radius: float
    path: BallPath
    impact: np.ndarray | None
    hips: np.ndarray
    ball_label: str = ""
    held: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    notes: tuple[str, ...] = ()

    @property
    def speed(self) -> float:
        """Speed at the release, m/s."""
        return float(np.linalg.norm(self.velocity))

    @property
    def direction(self) -> np.ndarray:
        """Direction of the release, unit (3,)."""
        return self.velocity / max(self.speed, 1e-9)

    def report(self) -> dict:
        """Return the figures of the release, as values for JSON."""
        return {"release_time_s": self.time, "release_frame": self.frame, "speed_m_s": self.speed,
                "direction": self.direction.tolist(), "uncertainty_s": self.time_margin,
                "uncertainty_m_s": self.speed_margin, "uncertainty_deg": float(np.degrees(self.direction_margin)),
                "radar_speed_m_s": self.radar,
                "against_radar": None if self.radar is None else self.speed / self.radar - 1.0,
                "position_m": self.position.tolist(), "spin_rad_s": self.spin.tolist(), "hand": self.side,
                "how": self.method, "residual_m": None if np.isnan(self.residual) else self.residual,
                "flight_frames": self.flight_frames, "impact_m": None if self.impact is None else self.impact.tolist(),
                "hips_m": self.hips.tolist(), "ball_radius_m": self.radius,
                "ball_centre_in_hand_m": self.centre.tolist(), "warnings": list(self.notes)}


def estimate_release(trial: MarkerTrial, motion: Motion, settings: ReleaseSettings = ReleaseSettings()) -> Release:
    """Estimate when and how the ball left the hand.

    Args:
        trial: the recorded markers.
        motion: solved from the trial, frame by frame, or at another rate over the same time.
        settings: what is known beforehand.
    Returns:
        The release.
    Raises:
        InputError: if the motion has another length, the skeleton has no hands, the ball's marker does not exist, the
            kind of ball is unknown, or no throw is found.
    """
    ball = THROWN_BALLS.get(settings.ball)
    if ball is None:
        raise InputError("release", f"ball {settings.ball!r}", f"one of {', '.join(THROWN_BALLS)}")
    motion = _match_frames(trial, motion)
    if len(trial) < MIN_FRAMES:
        raise InputError(trial.name, f"{len(trial)} frames", f"at least {MIN_FRAMES}", "take a longer stretch")
    even_trial = resample_evenly(trial)
    _check_same_place(even_trial, motion)
    label = find_ball_label(even_trial, settings.ball_marker)
    marker = None if label is None else even_trial.positions[:, even_trial.index_of(label)]
    sides = (settings.hand,) if settings.hand else ("left", "right")
    named = {label, *list_ball_labels(even_trial)}
    balls = tuple(name for name in even_trial.labels if name in named)
    hands = [refine_hand(build_hand(motion, side), even_trial, balls) for side in sides]
    hand = choose_hand(hands, marker)
    hand_ball, notes = _locate_ball(hand, marker, settings, ball)
    notes += even_trial.notes[len(trial.notes) :]
    launch = None
    if marker is not None:
        launch = _fit_ball_launch(hand, marker, hand_ball, ball=ball, settings=settings, notes=notes)
        launch = _check_launch(launch, hand, marker, label=label, radius=hand_ball.radius, settings=settings,
                               name=even_trial.name, notes=notes)
    if launch is None:
        check_throw(hand, [other for other in hands if other is not hand], _find_hips(motion), even_trial.name)
        launch = _estimate_hand_launch(hand, motion, hand_ball, ball, notes)
    seen = np.zeros(len(hand), bool) if marker is None else np.isfinite(marker).all(axis=-1)
    release = _build_release(launch, hand, motion, hand_ball=hand_ball, seen=seen, name=even_trial.name, notes=notes)
    if label is None or launch.method != "ball":
        return release
    return replace(release, ball_label=label, held=hand.to_hand(marker)[find_held_frames(hand, marker)])


def _check_launch(launch: _FittedLaunch | None, hand: Hand, marker, label, radius, settings: ReleaseSettings, name: str,
                  notes):
    """Return the launch fitted to the marker; None where the marker was on no ball in this hand.

    Raises InputError where the user chose that marker or hand.
    """
    away = _measure_ball_distance(hand, marker, launch)
    if away <= MAX_BALL_DISTANCE:
        if launch is None:
            notes.append(f"{label} is not visible in flight: the release is estimated from the hand alone")
        elif launch.frames >= _MIN_CIRCLE_FRAMES and launch.circle > _MAX_CIRCLE_RATIO * radius:
            notes.append(
                f"{label} circles {1000.0 * launch.circle:.0f} mm from the ball's centre, but a {settings.ball} is "
                "smaller: set its radius or kind"
            )
        return launch
    finding = f"{label} is {away:.2f} m from the {hand.side} hand"
    if settings.ball_marker or settings.hand:
        raise InputError(name, finding, "a marker on the ball in that hand", "check the marker and the hand")
    notes.append(f"{finding}: the release is estimated from the hand alone")
    return None


def _check_same_place(trial: MarkerTrial, motion: Motion) -> None:
    """Raise InputError if the markers are elsewhere than the motion's body."""
    places, _ = forward_kinematics(motion)
    often = trial.visibility.mean(axis=0) > 0.5
    markers = trial.positions[:, often]
    if not often.any():
        return
    away = np.linalg.norm(np.nanmedian(markers, axis=(0, 1)) - np.median(places, axis=(0, 1)))
    if away > _MAX_OFFSET:
        raise InputError(trial.name, f"markers {away:.1f} m away from the motion",
                         "the motion of this trial", "reconstruct the trial first")


def _measure_ball_distance(hand: Hand, marker: np.ndarray, launch: _FittedLaunch | None) -> float:
    """Measure the distance in metres from hand to ball marker: while held if visible then, else at the start of the
    flight.
    """
    held = find_held_frames(hand, marker)
    palm = hand.to_world(HOLD * hand.reach * hand.finger)
    if held.sum() >= 3:
        return float(np.median(np.linalg.norm(marker[held] - palm[held], axis=-1)))
    if launch is None:
        return 0.0
    k = int(np.clip(round(launch.launch.time * hand.fps), 0, len(hand) - 1))
    return float(np.linalg.norm(launch.launch.position - palm[k]))


@dataclass(frozen=True, eq=False, kw_only=True)
class _FittedLaunch:
    """A launch in the markers' space, with its uncertainties."""

    launch: Launch
    ball: Ball
    method: str
    time_margin: float
    speed_margin: float
    direction_margin: float
    residual: float = float("nan")
    frames: int = 0
    circle: float = 0.0


def _build_release(fitted: _FittedLaunch, hand: Hand, motion: Motion, hand_ball: HandBall, seen, name: str,
                   notes) -> Release:
    """Build the release: the launch in the motion's space, with ball path and impact."""
    launch = replace(fitted.launch, position=fitted.launch.position - hand.shift)
    shifted_hand = replace(hand, origin=hand.origin - hand.shift)
    ground = measure_ground_height(motion)
    places = place_ball(shifted_hand, hand_ball.centre, launch, fitted.ball, ground)
    flight = simulate_flight(launch, fitted.ball, _MAX_FLIGHT, ground)
    impact = flight.at(flight.bounces[:1])[0] - [0.0, 0.0, fitted.ball.radius] if len(flight.bounces) else None
    hips = _find_hips(motion.frames(0, 1))[0]
    return Release(time=launch.time, frame=int(np.clip(round(launch.time * hand.fps), 0, len(hand) - 1)),
                   position=launch.position, velocity=launch.velocity, spin=np.asarray(launch.spin, float),
                   time_margin=fitted.time_margin, speed_margin=fitted.speed_margin,
                   direction_margin=fitted.direction_margin, side=hand.side, method=fitted.method,
                   residual=fitted.residual, flight_frames=fitted.frames,
                   radar=parse_radar_speed(name), centre=hand_ball.centre, radius=hand_ball.radius,
                   path=BallPath(hand.times, places, seen), impact=impact, hips=hips, notes=tuple(notes))  # fmt: skip


def _find_hips(motion: Motion) -> np.ndarray:
    """Find the hips in all frames, (T, 3) metres."""
    return forward_kinematics(motion)[0][:, identify_joints(motion.skeleton).hips]


def _match_frames(trial: MarkerTrial, motion: Motion) -> Motion:
    """Return the motion with one frame for each frame of the trial; raise InputError where the lengths do not match."""
    if len(motion) == len(trial):
        return Motion(motion.skeleton, motion.root_positions, motion.rotations, trial.fps)
    if abs(motion.fps - trial.fps) > 0.01 * trial.fps:
        other = resample(motion, trial.fps)
        if abs(len(other) - len(trial)) <= max(2.0 * trial.fps / motion.fps, 2.0):
            at = np.minimum(np.arange(len(trial)), len(other) - 1)
            return Motion(other.skeleton, other.root_positions[at], other.rotations[at], other.fps)
    raise InputError(
        trial.name, f"{len(trial)} frames at {trial.fps:g} per second, and a motion of {len(motion)} at {motion.fps:g}",
        "the motion of this trial", "reconstruct the trial first",
    )  # fmt: skip


def _locate_ball(hand: Hand, marker, settings: ReleaseSettings, ball: Ball) -> tuple[HandBall, list[str]]:
    """Estimate where the ball lies in the hand; return it with messages."""
    usual_place = estimate_usual_place(hand)
    radius = settings.radius or ball.radius
    if settings.centre is not None:
        return HandBall(np.array(settings.centre, float), radius, 0.005), []
    if marker is None:
        return HandBall(usual_place, radius, 0.03), []
    held = find_held_frames(hand, marker)
    hand_ball = fit_hand_ball(hand.to_hand(marker)[held], radius, usual_place, fit_radius=settings.radius is None)
    if not hand_ball.is_radius_fitted:
        return hand_ball, []
    return hand_ball, [f"the ball's radius is {1000.0 * hand_ball.radius:.0f} mm, fitted to its marker"]


def _fit_ball_launch(hand: Hand, marker, hand_ball: HandBall, ball: Ball, settings: ReleaseSettings,
                     notes) -> _FittedLaunch | None:
    """Fit the launch to the marker on the ball; None where it is not visible in flight."""
    held = find_held_frames(hand, marker)
    is_held_visible = bool(held.sum() >= 3)
    place = np.nanmedian(hand.to_hand(marker)[held], axis=0) if is_held_visible else hand_ball.centre
    centre = hand.to_world(hand_ball.centre)
    velocity = np.gradient(centre, 1.0 / hand.fps, axis=0)
    hand_evidence = HeldMarker(hand.to_world(place), centre, velocity, _HELD_SIGMA if is_held_visible
                               else _HIDDEN_SIGMA)
    guess = guess_release(hand, marker)
    # also without air, as in eq. 6.2; the fit with the smaller residual is taken
    without_air = replace(ball, drag=0.0, lift=(0.0, *ball.lift[1:]))
    fits = [(fit_launch(marker, hand_evidence, hand.fps, guess=guess, ball=air, radius=hand_ball.radius,
                        window=settings.window), air)
            for air in (ball, without_air)]
    if fits[0][0] is None or fits[1][0] is None:
        return None
    fit, ball = min(fits, key=lambda found: (-round(found[0].seconds, 3), found[0].residual))
    if not is_held_visible:
        notes.append("the ball's marker is not visible in the hand: the release is where the flight meets the hand")
    launch = Launch(fit.time, fit.position, fit.velocity, fit.spin)
    air = float(np.linalg.norm(fits[0][0].velocity - fits[1][0].velocity))
    speed_sigma = float(np.hypot(fit.speed_sigma, _AIR_UNCERTAINTY * air))
    angle_sigma = speed_sigma / max(float(np.linalg.norm(fit.velocity)), 1e-9)
    # the marker shows when the ball begins to move against the hand; it rolls along the fingers before it leaves
    time_margin = float(np.hypot(_INTERVAL_90 * fit.time_sigma, _ROLL_SHARE * measure_roll_time(hand, fit.time)))
    return _FittedLaunch(launch=launch, ball=ball, method="ball", time_margin=time_margin,
                         speed_margin=_INTERVAL_90 * speed_sigma, direction_margin=_CONE_90 * angle_sigma,
                         residual=fit.residual, frames=fit.frames, circle=fit.circle)


def _estimate_hand_launch(hand: Hand, motion: Motion, hand_ball: HandBall, ball: Ball, notes) -> _FittedLaunch:
    """Estimate the launch from the hand alone."""
    hand_release = estimate_hand_release(hand, hand_ball.radius, _compute_stride(motion))
    if not hand.markers:
        notes.append("no markers near the hand: only the filtered motion is used, so the speed comes out too low")
    launch = Launch(hand_release.time, hand_release.position, hand_release.velocity)
    return _FittedLaunch(launch=launch, ball=ball, method="hand", time_margin=hand_release.time_margin,
                         speed_margin=hand_release.speed_margin, direction_margin=hand_release.direction_margin)


def _compute_stride(motion: Motion) -> np.ndarray:
    """Compute the level vector from the right foot to the left, (T, 2) metres."""
    body = identify_joints(motion.skeleton)
    places, _ = forward_kinematics(motion)
    return places[:, body.left.foot, :2] - places[:, body.right.foot, :2]
