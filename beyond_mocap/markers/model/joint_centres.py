"""The joint centres and segment axes of one frame, with their uncertainties."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial

import numpy as np

from ...base.vectors import unit_vector

MARKER_RADIUS = 0.007  # metres
SIGMAS = {"both": 0.006, "one side": 0.012, "hip": 0.007, "shoulder": 0.015, "alone": 0.02, "trunk": 0.02}
"""Uncertainty of a predicted centre in metres: the errors that the sources give, rounded."""
normalize = partial(unit_vector, min_length=1e-12)
"""Normalize a vector (3,) in metres; shorter ones than 1e-12 have no direction."""


@dataclass(kw_only=True)
class JointCentres:
    """The joint centres of one frame.

    Attributes:
        size: body size relative to the typical body.
        places: joint -> centre (3,) metres, world.
        axes: joint -> (3, 3), the columns are the joint's X, Y and Z axes in the world.
        sigma: joint -> uncertainty of the centre in metres.
        tips: joint -> place (3,) metres of its tip, world.
        notes: messages for people.
    """

    size: float
    places: dict[str, np.ndarray] = field(default_factory=dict)
    axes: dict[str, np.ndarray] = field(default_factory=dict)
    sigma: dict[str, float] = field(default_factory=dict)
    tips: dict[str, np.ndarray] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def add_joint(self, joint: str, place: np.ndarray, axes: np.ndarray, sigma: float) -> None:
        """Add a joint.

        Args:
            joint: its name.
            place: (3,) metres, world.
            axes: (3, 3) columns in the world.
            sigma: uncertainty in metres.
        """
        self.places[joint], self.axes[joint], self.sigma[joint] = place, axes, sigma


def build_axes(axis: str, along: np.ndarray, second: str, towards: np.ndarray) -> np.ndarray:
    """Build right-handed axes from two directions.

    Args:
        axis: "X", "Y" or "Z", the axis that is exactly `along`.
        along: (3,) direction.
        second: the axis that lies nearest to `towards`.
        towards: (3,) direction.
    Returns:
        (3, 3), the columns are the X, Y and Z axes.
    """
    columns = {axis: normalize(along)}
    columns[second] = normalize(towards - (towards @ columns[axis]) * columns[axis])
    third = next(letter for letter in "XYZ" if letter not in columns)
    cyclic_order = {"X": ("Y", "Z"), "Y": ("Z", "X"), "Z": ("X", "Y")}[third]
    columns[third] = np.cross(columns[cyclic_order[0]], columns[cyclic_order[1]])
    return np.stack([columns[letter] for letter in "XYZ"], axis=-1)
