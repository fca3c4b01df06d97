"""Locomotion between two recorded speeds, blended from both in phase (Faustino §6.2).

Two recordings of steady locomotion are laid side by side step by step: every landing of a foot is a whole (left) or
half (right) stride, so that at the same phase both bodies do the same thing. Joint rotations, the pelvis's height and
sway are then mixed; so is the way travelled *per stride*, while a stride's duration is mixed in the logarithm: a foot
that stands still in both recordings then hardly slides in the mixture. (Park, Shin and Shin 2002, "On-line locomotion
generation based on motion blending", mix parameterized recordings in this manner.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from ..base.vectors import distance_along
from . import quaternion
from .humanoid import heading_from_positions
from .motion import Motion, at_frames, forward_kinematics
from .track import zero_phase_hann

_SWAY_SECONDS = 0.7
# two landings of one foot are at least this far apart, seconds: nearer ones are one landing that flickers
_NEAREST = 0.25
_LEFT, _RIGHT = 0, 1


@dataclass(frozen=True, eq=False, kw_only=True)
class Strides:
    """A stretch of steady locomotion that begins and ends with a landing.

    motion: T frames. landings (K,): fractional frames at which feet land in turn, the first one's side in `first` (0
    left, 1 right). standing (T, 2, 2) bool: left and right, heel and toe on the ground. facing (T,) radians; path (T,
    2) m: the pelvis's way without its sway."""

    motion: Motion
    landings: np.ndarray
    first: int
    standing: np.ndarray
    facing: np.ndarray
    path: np.ndarray

    @property
    def steps(self) -> int:
        """Steps from the first landing to the last."""
        return len(self.landings) - 1

    @property
    def seconds(self) -> np.ndarray:
        """(K - 1,) how long each step lasts."""
        return np.diff(self.landings) / self.motion.fps

    @property
    def metres(self) -> np.ndarray:
        """(K - 1,) how far the body goes with each step."""
        return np.diff(_at(distance_along(self.path), self.landings))

    @property
    def speed(self) -> float:
        """Metres per second over all steps."""
        return float(self.metres.sum() / self.seconds.sum())

    def later(self) -> "Strides":
        """The same without the first step."""
        return Strides(motion=self.motion, landings=self.landings[1:], first=1 - self.first, standing=self.standing,
                       facing=self.facing, path=self.path)


def strides(motion: Motion, standing: np.ndarray) -> Strides | None:
    """The longest stretch of `motion` in which feet land in turn, by `standing` (T, 2, 2); None below two steps."""
    sides, frames = _landings(standing, motion.fps)
    edges = np.flatnonzero(np.diff(sides) == 0) + 1
    first, last = max(zip([0, *edges], [*edges, len(sides)]), key=lambda run: run[1] - run[0])
    if last - first < 3:
        return None
    positions, _ = forward_kinematics(motion)
    facing = np.unwrap(heading_from_positions(motion.skeleton, positions))
    path = zero_phase_hann(positions[:, 0, :2], motion.fps, _SWAY_SECONDS)
    return Strides(motion=motion, landings=frames[first:last], first=int(sides[first]), standing=standing,
                   facing=facing, path=path)


def _landings(standing: np.ndarray, fps: float) -> tuple[np.ndarray, np.ndarray]:
    """Sides (K,) and frames (K,) of all landings in order of time: heel or toe comes down after none of them stood."""
    sides, frames = [], []
    for side in (_LEFT, _RIGHT):
        down = np.flatnonzero(np.diff(standing[:, side].any(axis=1).astype(np.int8)) == 1) + 0.5
        kept = down[np.diff(down, prepend=-np.inf) > _NEAREST * fps]
        sides += [side] * len(kept)
        frames += kept.tolist()
    order = np.argsort(frames, kind="stable")
    return np.array(sides, int)[order], np.array(frames, float)[order]


def blend(slow: Strides, fast: Strides, speed: float, fps: float) -> tuple[Motion, np.ndarray]:
    """Locomotion at `speed` m/s, in the mean, mixed from two recordings on one skeleton; from the origin along +X.

    Gives the motion at `fps` and standing (T, 2, 2) bool. As many steps as the shorter recording has, each mixed from
    another one of both. A speed outside the two recordings' is brought to the nearer one."""
    slow, fast = _in_step(slow, fast)
    steps = min(slow.steps, fast.steps)
    weight = _weight(slow, fast, steps, speed)
    seconds = np.exp((1.0 - weight) * np.log(slow.seconds[:steps]) + weight * np.log(fast.seconds[:steps]))
    ends = np.concatenate([[0.0], np.cumsum(seconds)])
    times = np.arange(int(ends[-1] * fps + 1e-6) + 1) / fps
    phase = PchipInterpolator(ends, np.arange(steps + 1.0))(times)
    rate = PchipInterpolator(ends, np.arange(steps + 1.0)).derivative()(times)
    a, b = (_sampled(one, phase, steps) for one in (slow, fast))
    mixed = {name: (1.0 - weight) * a[name] + weight * b[name] for name in ("height", "sway", "turn", "way", "inside")}
    facing = _integral(mixed["turn"] * rate, fps)
    path = _integral(quaternion.turned_level(mixed["way"], facing) * rate[:, None], fps)
    rotations = quaternion.slerp(a["pose"], b["pose"], np.full((len(times), 1), weight))
    rotations[:, 0] = quaternion.multiply(quaternion.about_up(facing), rotations[:, 0])
    ground = path + quaternion.turned_level(mixed["sway"], facing)
    root = np.concatenate([ground, mixed["height"][:, None]], axis=1)
    return Motion(slow.motion.skeleton, root, quaternion.continuous(rotations), fps), mixed["inside"] > 0.0


def _in_step(a: Strides, b: Strides) -> tuple[Strides, Strides]:
    """Both beginning with the same foot: the longer one loses its first step where they do not."""
    if a.first == b.first:
        return a, b
    return (a.later(), b) if a.steps > b.steps else (a, b.later())


def _weight(slow: Strides, fast: Strides, steps: int, speed: float) -> float:
    """The share of `fast` with which the mixture goes at `speed` m/s in the mean."""
    share = np.linspace(0.0, 1.0, 65)
    metres = (1.0 - share) * slow.metres[:steps].sum() + share * fast.metres[:steps].sum()
    logs = (1.0 - share)[:, None] * np.log(slow.seconds[:steps]) + share[:, None] * np.log(fast.seconds[:steps])
    return float(np.interp(speed, metres / np.exp(logs).sum(axis=1), share))


def _sampled(one: Strides, phase: np.ndarray, steps: int) -> dict[str, np.ndarray]:
    """A recording at `phase` (T,) steps: pose (T, J, 4) relative to facing, height (T,), sway (T, 2) in the facing
    frame, turn (T,) radians and way (T, 2) metres per step, and how far inside a stance each point is (T, 2, 2)."""
    curve = PchipInterpolator(np.arange(steps + 1.0), one.landings[: steps + 1])
    frames, pace = curve(phase), curve.derivative()(phase)
    root, pose = at_frames(one.motion, frames)
    facing, path = _at(one.facing, frames), _at(one.path, frames)
    pose[:, 0] = quaternion.multiply(quaternion.about_up(-facing), pose[:, 0])
    return {
        "pose": pose, "height": root[:, 2], "sway": quaternion.turned_level(root[:, :2] - path, -facing),
        "turn": _at(np.gradient(one.facing), frames) * pace,
        "way": quaternion.turned_level(_at(np.gradient(one.path, axis=0), frames), -facing) * pace[:, None],
        "inside": _inside(one.standing, frames) / pace[:, None, None],
    }


def _inside(standing: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """How many frames (T, 2, 2) away the nearest begin or end of a stance is, negative outside of stances.

    Mixing these distances moves begin and end of a stance from one recording's to the other's; mixing the labels would
    let it jump halfway."""
    out = np.empty((len(frames), 2, 2))
    for side in (_LEFT, _RIGHT):
        for point in (0, 1):
            on = standing[:, side, point]
            edges = np.flatnonzero(np.diff(on.astype(np.int8))) + 0.5
            away = np.abs(frames[:, None] - edges).min(axis=1) if len(edges) else np.full(len(frames), float(len(on)))
            out[:, side, point] = np.where(on[np.round(frames).astype(int)], away, -away)
    return out


def _at(values: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Values (T, ...) at fractional frames (N,), linear: (N, ...)."""
    low = np.clip(np.floor(frames).astype(int), 0, max(len(values) - 2, 0))
    share = (frames - low).reshape(-1, *[1] * (values.ndim - 1))
    return values[low] * (1.0 - share) + values[np.minimum(low + 1, len(values) - 1)] * share


def _integral(values: np.ndarray, fps: float) -> np.ndarray:
    """The running integral (T, ...) of values (T, ...) per second, 0 at the first frame."""
    total = np.cumsum(0.5 * (values[1:] + values[:-1]), axis=0) / fps
    return np.concatenate([np.zeros_like(values[:1]), total])
