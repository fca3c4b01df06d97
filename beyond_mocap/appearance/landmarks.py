"""Where the joints of the sculpted athlete of 1.80 m are: in metres, arms lifted by `stance.ARM_TILT`."""

from __future__ import annotations

import numpy as np

HIPS, SHOULDERS = np.array([0.0, 0.0, 0.946]), np.array([-0.025, 0.0, 1.470])
"""Middle between both hip joints, and between both shoulder joints."""

HEAD = np.array([0.002, 0.0, 1.643])
"""The joint of the head."""

SHOULDER, ELBOW, WRIST = np.array([-0.025, 0.189, 1.470]), 0.306, 0.569
"""The joint of the left upper arm; metres down the arm to elbow and wrist."""

HIP, KNEE, ANKLE, BALL = np.array([0.0, 0.090, 0.946]), 0.510, 0.073, 0.133
"""The joint of the left thigh; heights of knee and ankle; metres ahead of the ankle of the ball of the foot."""

SEGMENTS = ("trunk", "neck", "head", *(f"{part}_{side}" for side in ("left", "right") for part in (
    "shoulder", "upper_arm", "lower_arm", "hand", "upper_leg", "lower_leg", "foot", "toe")))
"""What a point of the athlete can follow; "trunk" is divided among the joints of a spine."""
