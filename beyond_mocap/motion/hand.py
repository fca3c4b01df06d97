"""The position and orientation of a hand, frame by frame, from the joints of a motion."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..base.errors import InputError
from . import quaternion
from .humanoid import identify
from .motion import Motion, forward_kinematics

USUAL_ALONG, USUAL_OFF = 0.62, 0.035
"""The centre of a ball that is held ready to be thrown: as a share of the distance from wrist to fingertip, and metres
out of the palm; it lies on the fingers' middle parts."""
_HAND_OF_ARM = 0.72  # wrist to fingertip against elbow to wrist: 0.108 and 0.146 of the height, Drillis & Contini 1966


@dataclass(frozen=True, eq=False, kw_only=True)
class Hand:
    """One hand over T frames.

    Attributes:
        side: "left" or "right".
        fps: frames per second.
        origin: (T, 3) metres, the wrist, world.
        rotation: (T, 3, 3) from the hand's frame to the world.
        finger: (3,) unit vector along the stretched fingers, hand frame.
        reach: metres from the wrist to the fingertips.
        elbow: (T, 3) metres, world.
        markers: labels of the markers that refine it.
        shift: (3,) metres from the motion to where its markers are; the origin contains it.
    """

    side: str
    fps: float
    origin: np.ndarray
    rotation: np.ndarray
    finger: np.ndarray
    reach: float
    elbow: np.ndarray
    markers: tuple[str, ...] = ()
    shift: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def __len__(self) -> int:
        return len(self.origin)

    @property
    def times(self) -> np.ndarray:
        """(T,) seconds from frame 0."""
        return np.arange(len(self)) / self.fps

    def carried(self, place: np.ndarray) -> np.ndarray:
        """Return the world positions (T, 3), metres, of a point (3,) of the hand's frame."""
        return self.origin + np.einsum("tij,j->ti", self.rotation, np.asarray(place, float))

    def taken_back(self, points: np.ndarray) -> np.ndarray:
        """Return points (T, 3) m of the world, one a frame, in the hand's frame: (T, 3) metres."""
        return np.einsum("tji,tj->ti", self.rotation, points - self.origin)


def hand_of(motion: Motion, side: str) -> Hand:
    """Build the hand of a solved motion.

    Args:
        motion: T frames.
        side: "left" or "right".
    Returns:
        The hand over all frames.
    Raises:
        InputError: if the skeleton has no such hand or forearm.
    """
    limb = getattr(identify(motion.skeleton), side)
    if limb.hand is None or limb.lower_arm is None:
        raise InputError("release", f"a skeleton without a {side} hand", "joints for the hand and the forearm")
    places, rotations = forward_kinematics(motion)
    finger, reach = _finger(motion, limb)
    return Hand(side=side, fps=motion.fps, origin=places[:, limb.hand],
                rotation=quaternion.to_matrix(rotations[:, limb.hand]), finger=finger, reach=reach,
                elbow=places[:, limb.lower_arm])  # fmt: skip


def _finger(motion: Motion, limb) -> tuple[np.ndarray, float]:
    """Measure the unit direction (3,) of the fingers in the hand's frame, and metres from the wrist to their tips.

    Uses the skeleton's own tip where it has a plausible one, else continues the forearm.
    """
    skeleton, hand = motion.skeleton, limb.hand
    forearm = float(np.linalg.norm(skeleton.offsets[hand]))
    usual = _HAND_OF_ARM * forearm
    tips = _tips(skeleton, hand)
    lengths = np.linalg.norm(tips, axis=-1)
    longest = float(lengths.max(initial=0.0))
    if longest > 0.1 * usual:
        return tips[int(np.argmax(lengths))] / longest, longest if 0.6 * usual < longest < 1.5 * usual else usual
    return skeleton.offsets[hand] / max(forearm, 1e-9), usual


def _tips(skeleton, hand: int) -> np.ndarray:
    """Collect the positions (N, 3) m of the joints and end sites below the hand, at rest, in the hand's frame."""
    at = {hand: np.zeros(3)}
    for joint in range(hand + 1, len(skeleton)):
        if skeleton.parents[joint] in at:
            at[joint] = at[skeleton.parents[joint]] + skeleton.offsets[joint]
    ends = [at[parent] + offset for parent, offset in zip(skeleton.end_parents, skeleton.end_offsets) if parent in at]
    return np.array([place for joint, place in at.items() if joint != hand] + ends).reshape(-1, 3)


def usual_centre(finger: np.ndarray, reach: float, palm: np.ndarray | None = None) -> np.ndarray:
    """Estimate where the centre of a ball lies in a hand.

    Args:
        finger: (3,) as of `Hand`.
        reach: metres, as of `Hand`.
        palm: (3,) unit vector out of the palm, hand frame; None leaves the offset from the palm out.
    Returns:
        (3,) metres, hand frame.
    """
    return USUAL_ALONG * reach * finger + (0.0 if palm is None else USUAL_OFF * np.asarray(palm, float))
