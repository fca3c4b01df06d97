"""A small model of markers, for tests of its file."""

import numpy as np

from beyond_mocap.markers.model.model import BallMarker, Freedom, MarkerModel
from beyond_mocap.motion.skeleton import Skeleton


def small_model(ball=True):
    """Three joints and four markers, with everything that a model can have."""
    rng = np.random.default_rng(3)
    offsets = [[0, 0, 0], [0, 0.2, 0.4], [0, 0.3, 0]]
    skeleton = Skeleton(("Hips", "Arm", "Hand"), (-1, 0, 1), offsets, (2,), [[0, 0.1, 0]])
    low, high = np.full((3, 3), -np.inf), np.full((3, 3), np.inf)
    low[1], high[1] = -rng.random(3), rng.random(3)
    return MarkerModel(skeleton=skeleton, markers=("A", "B b", "Ç", "*1"), joint=[0, 1, 1, 2],
                       places=rng.normal(size=(4, 3)) / 3, sigma=rng.random(4) / 100,
                       edge_sigma=[np.nan, 0.01, 0.01, np.nan],
                       freedom=Freedom(("ZXY", "XYZ", "YXZ"), [[1, 1, 1], [1, 0, 1], [1, 1, 0]], low, high),
                       stiffness=[0, 0.001, 0.1 / 3], centre_sigma=[0.003, np.nan, 0.01],
                       ball=BallMarker("BALL", 2, (0.1, 1 / 3, 0.0), 0.037) if ball else None, subject="Jane",
                       sessions=("one", "two"), set_name="mine", notes=("found somehow",))  # fmt: skip
