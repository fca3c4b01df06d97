"""The frames beside a body that is known lead into it."""

import numpy as np

from beyond_mocap.motion import quaternion
from beyond_mocap.motion.foot_plant import PlantResult
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.synthesis.construct.extra_steps import Steps
from beyond_mocap.synthesis.known_body import build_known_body, show_bodies

FPS, EDGE, COUNT = 30.0, 45, 60


def test_a_folded_leg_does_not_add_up_with_the_swing_before_it():
    """In the air: a knee that bends a quarter second before the edge, behind which the body has it folded."""
    skeleton = build_adult_skeleton()
    knee, frames = skeleton.names.index("LeftLeg"), np.arange(COUNT)
    swing = 1.2 * np.exp(-0.5 * ((frames - EDGE + 7.0) / 3.0) ** 2)
    turns = quaternion.identity(COUNT, len(skeleton))
    turns[:, knee] = quaternion.from_axis_angle(np.array([0.0, 1.0, 0.0]), swing)
    root, none = np.tile([0.0, 0.0, 2.0], (COUNT, 1)), np.zeros((COUNT, 2, 2), bool)
    folded = quaternion.identity(COUNT - EDGE, len(skeleton))
    folded[:, knee] = quaternion.from_axis_angle(np.array([0.0, 1.0, 0.0]), np.full(COUNT - EDGE, 1.6))
    body = build_known_body(EDGE, FPS, (root[EDGE:], folded), none[EDGE:])
    planted = PlantResult(root=root, rotations=turns, correction=np.zeros((COUNT, 2)), miss=np.zeros((COUNT, 2)))
    shown, _ = show_bodies(skeleton, planted, Steps.empty(turns, none), [body], 0, fps=FPS)
    bend = np.linalg.norm(quaternion.to_rotation_vector(shown.rotations[:, knee]), axis=1)
    assert bend.max() < 1.75 and np.abs(np.diff(bend)).max() < 0.35 and np.allclose(bend[EDGE:], 1.6, atol=1e-3)
    assert np.array_equal(shown.rotations[: EDGE - 20], turns[: EDGE - 20])
