"""How far a reconstructed motion is from the truth that its markers were planted on.

Centres: the distance of the joints that anatomy defines (hips, knees, ankles, shoulders, elbows, wrists), frame by
frame, as they lie in the world. Angles: of each segment against the one above it, two ways. `raw` compares the
segments' axes as they are. `angles` first takes off, from each segment, the one constant turn between found and true
axes that fits the whole clip best: where a model draws a segment's axes is its convention, how the segment moves is
not. Errors are the whole angle between found and true joint rotation, all three axes at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...markers.frames import mean_rotation
from ...motion import quaternion
from ...motion.motion import Motion, forward_kinematics
from .planted_markers import Planted

_PARTS = ("UpLeg", "Leg", "Foot", "Arm", "ForeArm", "Hand")
CENTRES = tuple(side + part for side in ("Left", "Right") for part in _PARTS)
ABOVE = {
    "Chest": "Hips", "Head": "Chest",
    **{side + part: above if above in ("Hips", "Chest") else side + above
       for side in ("Left", "Right")
       for part, above in (("UpLeg", "Hips"), ("Leg", "UpLeg"), ("Foot", "Leg"), ("Arm", "Chest"), ("ForeArm", "Arm"),
                           ("Hand", "ForeArm"))},
}  # fmt: skip
"""Joint -> the segment against which its angle counts: the trunk as one, from pelvis to chest."""


@dataclass(frozen=True)
class PlantedError:
    """centres: joint -> root mean square distance, metres. angles, raw: joint -> root mean square angle, radians, with
    and without each segment's constant offset taken off. worst_centre: metres, 95th percentile over joints and frames.
    """

    centres: dict[str, float]
    angles: dict[str, float]
    raw: dict[str, float]
    worst_centre: float

    @property
    def centre(self) -> float:
        """Root mean square over all joints, metres."""
        return _rms(self.centres.values())

    @property
    def angle(self) -> float:
        """Root mean square over all joints, radians, offsets taken off."""
        return _rms(self.angles.values())

    @property
    def raw_angle(self) -> float:
        """Root mean square over all joints, radians, offsets left in."""
        return _rms(self.raw.values())


def planted_error(known: Planted, found: Motion) -> PlantedError:
    """How far `found`, on any skeleton whose joints have the template's names, is from the truth, frame by frame."""
    true_places, true_turns = _by_name(known.motion)
    places, turns = _by_name(found)
    count = min(len(known.motion), len(found))
    apart = {
        joint: np.linalg.norm(places[joint][:count] - true_places[joint][:count], axis=1)
        for joint in CENTRES
        if joint in places and joint in true_places
    }
    there = [joint for joint in ("Hips", *ABOVE) if joint in turns and joint in true_turns]
    aligned = {joint: _aligned(turns[joint][:count], true_turns[joint][:count]) for joint in there}
    pairs = [(joint, above) for joint, above in ABOVE.items() if joint in there and above in there]
    return PlantedError(
        {joint: _rms(distance) for joint, distance in apart.items()},
        {joint: _off(aligned[joint], aligned[above], true_turns[joint][:count], true_turns[above][:count])
         for joint, above in pairs},
        {joint: _off(turns[joint][:count], turns[above][:count], true_turns[joint][:count], true_turns[above][:count])
         for joint, above in pairs},
        float(np.percentile(np.stack(list(apart.values())), 95)) if apart else float("nan"),
    )


def _by_name(motion: Motion) -> tuple[dict, dict]:
    """Joint -> places (T, 3) and turns (T, 4) in the world."""
    places, turns = forward_kinematics(motion)
    names = motion.skeleton.names
    return {n: places[:, i] for i, n in enumerate(names)}, {n: turns[:, i] for i, n in enumerate(names)}


def _aligned(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Turns (T, 4) of a segment in the axes in which they come nearest to the true ones."""
    offset = mean_rotation(quaternion.to_matrix(quaternion.multiply(quaternion.inverse(true), found)))
    return quaternion.multiply(found, quaternion.inverse(quaternion.from_matrix(offset)))


def _off(found, found_above, true, true_above) -> float:
    bend = quaternion.multiply(quaternion.inverse(found_above), found)
    wanted = quaternion.multiply(quaternion.inverse(true_above), true)
    angle = quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(wanted), bend))
    return _rms(np.linalg.norm(angle, axis=1))


def _rms(values) -> float:
    values = np.asarray(list(values), dtype=float)
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")
