"""Model and poses adjusted together: what the motion tells is found, what it does not tell stays as predicted."""

import numpy as np
import pytest

from beyond_mocap.markers.model.adjustment import Adjustment, Body, Prior, Pull
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.motion import Motion, forward_kinematics
from beyond_mocap.motion.skeleton import Skeleton

NAMES, PARENTS = ("Hips", "LeftUpLeg", "LeftLeg"), (-1, 0, 1)
OFFSETS = np.array([[0.0, 0.0, 0.0], [0.0, 0.09, 0.0], [0.0, 0.0, -0.43]])
JOINT = np.repeat([0, 1, 2], 4)
FRAMES = 40


def leg(seed, hip=0.8, knee=1.0):
    """A leg that swings by `hip` and bends by up to `knee` radians, with four markers a segment."""
    rng = np.random.default_rng(seed)
    places = rng.normal(0.0, 0.07, (len(JOINT), 3))
    turns = np.zeros((FRAMES, 3, 3))
    turns[:, 0] = 0.3 * rng.normal(size=(FRAMES, 3))
    turns[:, 1] = hip * rng.uniform(-1.0, 1.0, (FRAMES, 3))
    turns[:, 2, 1] = knee * rng.uniform(0.0, 1.0, FRAMES)
    skeleton = Skeleton(NAMES, PARENTS, OFFSETS)
    motion = Motion(skeleton, rng.normal(size=(FRAMES, 3)), quaternion.from_rotation_vector(turns), 60.0)
    joints, rotations = forward_kinematics(motion)
    seen = joints[:, JOINT] + quaternion.rotate(rotations[:, JOINT], places)
    return motion, places, seen


def adjusted(motion, places, seen, shift):
    """The leg after a start whose hip is off by `shift`, and the markers below it as they lie from there; what was
    known before is as wrong."""
    offsets, places = OFFSETS.copy(), places - (JOINT >= 1)[:, None] * shift
    offsets[1] += shift
    body = Body(names=NAMES, parents=PARENTS, offsets=offsets, joint=JOINT, places=places.copy(),
                is_fixed=np.zeros(3, bool), limb=np.array([-1, -1, 2]))
    prior = Prior(offsets=offsets.copy(), offset_sigma=np.array([0.01, 0.02, 0.02]), places=places.copy(),
                  place_sigma=np.full(len(JOINT), 0.008))
    task = Adjustment(body, prior, Pull({}), seen, np.full(len(JOINT), 0.001), effective_frames=FRAMES)
    task.start_from(motion)
    before = task.compute_cost()
    task.run_steps(30)
    return task, before


def test_a_wrong_hip_is_found_by_the_motion():
    motion, places, seen = leg(1)
    shift = np.array([0.02, -0.015, 0.01])
    task, before = adjusted(motion, places, seen, shift)
    assert task.compute_cost() < 0.1 * before
    assert np.linalg.norm(task.body.offsets[1] - OFFSETS[1]) < 0.2 * np.linalg.norm(shift)


def test_a_hip_that_does_not_move_stays_where_it_was_predicted():
    motion, places, seen = leg(2, hip=0.0)
    shift = np.array([0.02, -0.015, 0.01])
    task, _ = adjusted(motion, places, seen, shift)
    assert np.linalg.norm(task.body.offsets[1] - OFFSETS[1] - shift) < 0.1 * np.linalg.norm(shift)


def test_a_limbs_bone_stays_along_its_axis():
    motion, places, seen = leg(3)
    task, _ = adjusted(motion, places, seen, np.array([0.01, 0.0, 0.0]))
    assert task.body.offsets[2, :2] == pytest.approx([0.0, 0.0], abs=1e-12)


def test_a_marker_that_is_far_off_in_some_frames_hardly_counts():
    motion, places, seen = leg(4)
    seen[::7, 5] += 0.3
    task, _ = adjusted(motion, places, seen, np.array([0.02, 0.0, 0.0]))
    assert np.linalg.norm(task.body.offsets[1] - OFFSETS[1]) < 0.008


def test_the_step_is_downhill_of_the_exact_slope():
    """The slope of the cost by each bone and place, from the equations, against differences."""
    motion, places, seen = leg(5)
    task, _ = adjusted(motion, places, seen, np.zeros(3))
    task.body.offsets[1] += [0.004, -0.002, 0.003]
    task.sigma = np.full(len(JOINT), 1.0)  # nothing is far off, so that the cost is plain squares
    before, step = task.compute_cost(), 1e-5
    error, rows = task._build_prior_errors()
    world, _, markers = task.compute_places()
    away = (markers - task.seen) * task.share
    slope = 2.0 * rows.T @ error
    for axis in range(3):
        column = task.columns.offset[1, axis]
        moved = np.broadcast_to(world[:, :1, :, axis], away.shape) * (JOINT >= 1)[:, None]
        slope[column] += 2.0 * np.sum(away * moved)
        task.body.offsets[1, axis] += step
        assert (task.compute_cost() - before) / step == pytest.approx(slope[column], rel=1e-2, abs=1e-2)
        task.body.offsets[1, axis] -= step
