"""Locomotion between two recorded speeds, blended in phase from both recordings (Faustino §6.2).

Two recordings of steady locomotion are aligned step by step: every landing of a foot is a whole (left) or half (right)
stride, so that at the same phase both bodies do the same thing. Joint rotations, the pelvis's height and its sway are
then mixed. So is the distance travelled *per stride*, while a stride's duration is mixed in the logarithm: a foot that
is still in both recordings then hardly slides in the mixture. Park, Shin and Shin 2002, "On-line locomotion generation
based on motion blending", mix parameterized recordings in this manner.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..base.easing import smoothstep
from ..base.vectors import arctan2, distances_along
from . import quaternion
from .humanoid import compute_heading_from_positions
from .motion import Motion, compute_pose, forward_kinematics, sample_frames
from .track import smooth_zero_phase_hann

if TYPE_CHECKING:
    from scipy.interpolate import PchipInterpolator

_SWAY_SECONDS = 0.7
# two landings of one foot are at least this far apart, seconds: nearer ones are one landing whose label flickers
_MIN_LANDING_SECONDS = 0.25
_LEFT, _RIGHT = 0, 1


@dataclass(frozen=True, eq=False, kw_only=True)
class Strides:
    """A stretch of steady locomotion that begins and ends with a landing.

    Attributes:
        motion: T frames.
        landings: (K,) fractional frames at which the feet land in turn.
        first_side: side of the first landing, 0 left, 1 right.
        heel_toe_contacts: (T, 2, 2) bool, left and right, heel and toe on the ground.
        facing: (T,) heading, radians, unwrapped.
        path: (T, 2) metres, the pelvis's path over the ground without its sway.
    """

    motion: Motion
    landings: np.ndarray
    first_side: int
    heel_toe_contacts: np.ndarray
    facing: np.ndarray
    path: np.ndarray

    @property
    def steps(self) -> int:
        """Number of steps from the first landing to the last."""
        return len(self.landings) - 1

    @property
    def seconds(self) -> np.ndarray:
        """(K - 1,) duration of each step, seconds."""
        return np.diff(self.landings) / self.motion.fps

    @property
    def metres(self) -> np.ndarray:
        """(K - 1,) distance that the body travels with each step, metres."""
        return np.diff(_interpolate_frames(distances_along(self.path), self.landings))

    @property
    def speed(self) -> float:
        """Mean speed over all steps, m/s."""
        return float(self.metres.sum() / self.seconds.sum())

    def select_steps(self, first: int, end: int) -> Strides:
        """Return the same strides with only the steps first .. end."""
        return replace(self, landings=self.landings[first : end + 1], first_side=(self.first_side + first) % 2)

    def measure_poses(self, phase: np.ndarray) -> np.ndarray:
        """Measure where the joints are relative to the hips and the heading, (T, J, 3) m, at phases (T,) in steps."""
        sample = _sample_pose(self, _build_frame_curve(self, self.steps)(phase))
        root = np.column_stack([sample["sway"], sample["height"]])
        places, _ = compute_pose(self.motion.skeleton, root, sample["pose"])
        return places


def find_strides(motion: Motion, heel_toe_contacts: np.ndarray) -> Strides | None:
    """Find the longest stretch of a motion in which the feet land in turn.

    Args:
        motion: T frames of locomotion.
        heel_toe_contacts: (T, 2, 2) bool, left and right, heel and toe on the ground.
    Returns:
        The stretch, or None if it has fewer than two steps.
    """
    sides, frames = _detect_landings(heel_toe_contacts, motion.fps)
    # runs of landings whose sides alternate; the longest one wins
    edges = np.flatnonzero(np.diff(sides) == 0) + 1
    first, last = max(zip([0, *edges], [*edges, len(sides)]), key=lambda run: run[1] - run[0])
    if last - first < 3:
        return None
    positions, _ = forward_kinematics(motion)
    facing = np.unwrap(compute_heading_from_positions(motion.skeleton, positions))
    path = smooth_zero_phase_hann(positions[:, 0, :2], motion.fps, _SWAY_SECONDS)
    return Strides(motion=motion, landings=frames[first:last], first_side=int(sides[first]),
                   heel_toe_contacts=heel_toe_contacts, facing=facing, path=path)


def _detect_landings(heel_toe_contacts: np.ndarray, fps: float) -> tuple[np.ndarray, np.ndarray]:
    """Detect all landings in order of time: sides (K,) and frames (K,); heel or toe touches down after both were up."""
    sides, frames = [], []
    for side in (_LEFT, _RIGHT):
        down = np.flatnonzero(np.diff(heel_toe_contacts[:, side].any(axis=1).astype(np.int8)) == 1) + 0.5
        kept = down[np.diff(down, prepend=-np.inf) > _MIN_LANDING_SECONDS * fps]
        sides += [side] * len(kept)
        frames += kept.tolist()
    order = np.argsort(frames, kind="stable")
    return np.array(sides, int)[order], np.array(frames, float)[order]


def blend_strides(slow: Strides, fast: Strides, speed: float, fps: float) -> tuple[Motion, np.ndarray]:
    """Blend two recordings of locomotion to a mean speed, from the origin along +X.

    The result has as many steps as the shorter recording, each mixed from another step of both.

    Args:
        slow, fast: recordings on one skeleton.
        speed: wanted mean speed, m/s; limited to the range between the two recordings.
        fps: frames per second of the result.
    Returns:
        The motion, and the contacts (T, 2, 2) bool of left and right, heel and toe.
    Source: Faustino 2016, section 6.2; Park, Shin and Shin 2002.
    """
    from scipy.interpolate import PchipInterpolator

    slow, fast = _align_first_foot(slow, fast)
    steps = min(slow.steps, fast.steps)
    weight = _solve_blend_weight(slow, fast, steps, speed)
    # durations are mixed in the logarithm, so that a step of half and one of double duration average to the same one
    seconds = np.exp((1.0 - weight) * np.log(slow.seconds[:steps]) + weight * np.log(fast.seconds[:steps]))
    ends = np.concatenate([[0.0], np.cumsum(seconds)])
    times = np.arange(int(ends[-1] * fps + 1e-6) + 1) / fps
    # phase counts steps: 0 at the first landing, 1 at the second, ...; `rate` is its derivative, steps per second
    phase = PchipInterpolator(ends, np.arange(steps + 1.0))(times)
    rate = PchipInterpolator(ends, np.arange(steps + 1.0)).derivative()(times)
    slow_samples, fast_samples = (_sample_at_phase(one, phase, steps) for one in (slow, fast))
    mixed = {name: (1.0 - weight) * slow_samples[name] + weight * fast_samples[name]
             for name in ("height", "sway", "turn", "way", "inside")}
    facing = _integrate(mixed["turn"] * rate, fps)
    path = _integrate(quaternion.rotate_level(mixed["way"], facing) * rate[:, None], fps)
    rotations = quaternion.slerp(slow_samples["pose"], fast_samples["pose"], np.full((len(times), 1), weight))
    rotations[:, 0] = quaternion.multiply(quaternion.from_up_angle(facing), rotations[:, 0])
    ground = path + quaternion.rotate_level(mixed["sway"], facing)
    root = np.concatenate([ground, mixed["height"][:, None]], axis=1)
    return Motion(slow.motion.skeleton, root, quaternion.unify_signs(rotations), fps), mixed["inside"] > 0.0


def repeat_strides(strides: Strides, seconds: float, fps: float, tempo: float = 1.0,
                   length: float = 1.0) -> tuple[Motion, np.ndarray]:
    """Repeat steady locomotion at an even tempo, from the origin along +X, or backward in time along -X.

    The first step comes before the part that is repeated: the last one passes into it, so that the end fits the start.
    Every step lasts as long as the mean step, and the body does not turn from one stride to the next.

    Args:
        strides: an odd number of steps, three or more.
        seconds: duration of the result.
        fps: frames per second of the result.
        tempo: factor on steps per second; below 0 time runs backward.
        length: factor on the distance travelled with each step.
    Returns:
        The motion, and the contacts (T, 2, 2) bool of left and right, heel and toe.
    """
    repeated = strides.steps - 1
    times = np.arange(int(seconds * fps)) / fps
    rate = tempo * repeated / strides.seconds[1:].sum()
    phase = 1.0 + times * rate % repeated
    share = smoothstep(np.maximum(phase - repeated, 0.0))
    later, earlier = (_sample_at_phase(strides, at, strides.steps)
                      for at in (phase, np.where(share > 0.0, phase - repeated, phase)))
    weight = {name: share.reshape(-1, *[1] * (values.ndim - 1)) for name, values in later.items()}
    mixed = {name: (1.0 - weight[name]) * later[name] + weight[name] * earlier[name]
             for name in ("height", "sway", "turn", "way", "inside")}
    # frames of whole repetitions, or all where not even one fits
    whole = int(times[-1] * abs(rate) // repeated * repeated / abs(rate) * fps) or len(times)
    facing = _integrate((mixed["turn"] - mixed["turn"][:whole].mean()) * rate, fps)
    travel = quaternion.rotate_level(mixed["way"], facing)
    facing = facing - arctan2(*travel[:whole].mean(axis=0)[::-1])
    path = _integrate(quaternion.rotate_level(mixed["way"], facing) * (rate * length), fps)
    rotations = quaternion.slerp(later["pose"], earlier["pose"], share[:, None])
    rotations[:, 0] = quaternion.multiply(quaternion.from_up_angle(facing), rotations[:, 0])
    root = np.column_stack([path + quaternion.rotate_level(mixed["sway"], facing), mixed["height"]])
    return Motion(strides.motion.skeleton, root, quaternion.unify_signs(rotations), fps), mixed["inside"] > 0.0


def _align_first_foot(a: Strides, b: Strides) -> tuple[Strides, Strides]:
    """Make both begin with the same foot: the longer one loses its first step where they do not."""
    if a.first_side == b.first_side:
        return a, b
    return (a.select_steps(1, a.steps), b) if a.steps > b.steps else (a, b.select_steps(1, b.steps))


def _solve_blend_weight(slow: Strides, fast: Strides, steps: int, speed: float) -> float:
    """Solve the share of `fast` with which the mixture has a mean speed of `speed` m/s."""
    share = np.linspace(0.0, 1.0, 65)
    metres = (1.0 - share) * slow.metres[:steps].sum() + share * fast.metres[:steps].sum()
    logs = (1.0 - share)[:, None] * np.log(slow.seconds[:steps]) + share[:, None] * np.log(fast.seconds[:steps])
    return float(np.interp(speed, metres / np.exp(logs).sum(axis=1), share))


def _sample_at_phase(strides: Strides, phase: np.ndarray, steps: int) -> dict[str, np.ndarray]:
    """Sample a recording at phases (T,), counted in steps.

    Returns:
        pose (T, J, 4) relative to the heading, height (T,) metres, sway (T, 2) metres in the heading frame, turn (T,)
        radians and way (T, 2) metres per step, and inside (T, 2, 2): steps from each point's nearest stance boundary.
    """
    curve = _build_frame_curve(strides, steps)
    frames, pace = curve(phase), curve.derivative()(phase)
    facing = _interpolate_frames(strides.facing, frames)
    return {
        **_sample_pose(strides, frames), "turn": _interpolate_frames(np.gradient(strides.facing), frames) * pace,
        "way": quaternion.rotate_level(_interpolate_frames(np.gradient(strides.path, axis=0), frames), -facing)
        * pace[:, None], "inside": _measure_stance_distance(strides.heel_toe_contacts, frames) / pace[:, None, None],
    }


def _build_frame_curve(strides: Strides, steps: int) -> PchipInterpolator:
    """Build the curve that gives a recording's fractional frame at a phase, counted in steps."""
    from scipy.interpolate import PchipInterpolator

    return PchipInterpolator(np.arange(steps + 1.0), strides.landings[: steps + 1])


def _sample_pose(strides: Strides, frames: np.ndarray) -> dict[str, np.ndarray]:
    """Sample pose, height and sway of `_sample_at_phase` at fractional frames (T,)."""
    root, pose = sample_frames(strides.motion, frames)
    facing, path = _interpolate_frames(strides.facing, frames), _interpolate_frames(strides.path, frames)
    pose[:, 0] = quaternion.multiply(quaternion.from_up_angle(-facing), pose[:, 0])
    return {"pose": pose, "height": root[:, 2], "sway": quaternion.rotate_level(root[:, :2] - path, -facing)}


def _measure_stance_distance(heel_toe_contacts: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Measure how many frames (T, 2, 2) away the nearest start or end of a stance is, negative outside of stances.

    Mixing these distances moves a stance's start and end from one recording's to the other's; mixing the labels would
    make them jump halfway.
    """
    out = np.empty((len(frames), 2, 2))
    for side in (_LEFT, _RIGHT):
        for point in (0, 1):
            on = heel_toe_contacts[:, side, point]
            edges = np.flatnonzero(np.diff(on.astype(np.int8))) + 0.5
            away = np.abs(frames[:, None] - edges).min(axis=1) if len(edges) else np.full(len(frames), float(len(on)))
            out[:, side, point] = np.where(on[np.round(frames).astype(int)], away, -away)
    return out


def _interpolate_frames(values: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Interpolate values (T, ...) linearly at fractional frames (N,): (N, ...)."""
    low = np.clip(np.floor(frames).astype(int), 0, max(len(values) - 2, 0))
    share = (frames - low).reshape(-1, *[1] * (values.ndim - 1))
    return values[low] * (1.0 - share) + values[np.minimum(low + 1, len(values) - 1)] * share


def _integrate(values: np.ndarray, fps: float) -> np.ndarray:
    """Integrate values (T, ...) per second over time, 0 at the first frame: (T, ...)."""
    total = np.cumsum(0.5 * (values[1:] + values[:-1]), axis=0) / fps
    return np.concatenate([np.zeros_like(values[:1]), total])
