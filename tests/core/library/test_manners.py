"""A player keeps one manner: clips that move like the chosen recording cost less, whoever shows them."""

import numpy as np
import pytest

from beyond_mocap.files.bvh import bvh
from beyond_mocap.library.build import build_library
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import Motion
from beyond_mocap.synthesis.search.preferences import MANNER_COST, compute_manner_cost
from beyond_mocap.synthetic.gait import build_gait


def with_arms_out(motion: Motion, angle: float) -> Motion:
    """The same walk with both upper arms `angle` rad further from the body."""
    body, rotations = identify_joints(motion.skeleton), motion.rotations.copy()
    for limb, sign in ((body.left, 1.0), (body.right, -1.0)):
        axis = np.tile([1.0, 0.0, 0.0], (len(motion), 1))
        away = quaternion.from_axis_angle(axis, np.full(len(motion), sign * angle))
        rotations[:, limb.upper_arm] = quaternion.multiply(rotations[:, limb.upper_arm], away)
    return Motion(motion.skeleton, motion.root_positions, rotations, motion.fps)


@pytest.fixture(scope="module")
def two_people(tmp_path_factory):
    """Two walkers with three walks each: arms close, and arms out."""
    folder = tmp_path_factory.mktemp("two_people")
    for person, angle in (("close", 0.0), ("out", 0.3)):
        for number, speed in enumerate((0.9, 1.1, 1.3)):
            path = folder / f"{person}{number}.bvh"
            bvh.write_bvh(path, with_arms_out(build_gait(speed, 6.0, 30.0, seed=number), angle))
            path.with_suffix(".txt").write_text("0 6 walking\n")
    return build_library(folder)


def test_every_recording_has_one_manner_with_its_mirror_image(two_people):
    manners = two_people.manners
    assert sorted(set(manners.of_clip)) == list(range(6)) and len(manners.models) == 6
    by_path: dict[str, set] = {}
    for clip, manner in zip(two_people.clips, manners.of_clip):
        by_path.setdefault(clip.path, set()).add(int(manner))
    assert all(len(found) == 1 for found in by_path.values())


def test_the_own_walks_cost_less_than_the_other_persons(two_people):
    frames, paths = two_people.frames, np.array([clip.path[:3] for clip in two_people.clips])[two_people.frames.clip]
    for number in range(6):
        model = two_people.manners.models[number]
        own = two_people.clips[int(np.flatnonzero(two_people.manners.of_clip == model)[0])].path[:3]
        cost = compute_manner_cost(two_people, number)
        assert cost.shape == (len(frames),) and cost.max() <= np.float32(MANNER_COST)
        assert cost[paths == own].mean() < 0.5 * cost[paths != own].mean()


def test_players_take_turns_and_no_manner_costs_nothing(two_people):
    assert compute_manner_cost(two_people, -1) is None
    assert np.array_equal(compute_manner_cost(two_people, 1), compute_manner_cost(two_people, 7))
    assert not np.array_equal(compute_manner_cost(two_people, 0), compute_manner_cost(two_people, 5))
