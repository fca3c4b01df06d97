"""The fast road through one frame says what the plain functions say, frame for frame, on any body."""

import numpy as np
import pytest

from beyond_mocap.motion import quaternion
from beyond_mocap.motion.motion import Motion
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.motion.skeleton import Skeleton
from beyond_mocap.synthetic.throws import build_throw
from beyond_mocap.throws.networks.chains import HIERARCHY, find_chains
from beyond_mocap.throws.networks.description import Windows, build_windows
from beyond_mocap.throws.networks.example import build_description, build_example, compute_poses
from beyond_mocap.throws.networks.features import build_input, compute_phase, count_widths
from beyond_mocap.throws.networks.frame_step import HierarchyPredictor
from beyond_mocap.throws.networks.kinematics import Pose, compute_pose_transforms, compute_world_transforms, to_matrices
from beyond_mocap.throws.networks.model import ModelSettings, ThrowModel
from beyond_mocap.throws.networks.network import PhaseNetwork
from beyond_mocap.throws.networks.network_output import apply_output
from beyond_mocap.throws.networks.training_set import measure_leg_reach
from tests.core.linear_throws import build_training_set


def thrown():
    made = build_throw((15.0, 2.0, 1.2), 20.0, "right", skeleton=build_adult_skeleton(1.8), fps=120.0)
    return made, build_example("t", "s", made.motion, "right_hand", made.release, (15.0, 2.0, 1.2))


def dressed(motion):
    """The movement of a body with a still joint above turned hips, and a finger on each hand."""
    skeleton = motion.skeleton
    hands = [i for i, name in enumerate(skeleton.names) if name.endswith("Hand")]
    names = ["Root", *skeleton.names, "Finger1", "Finger2"]
    parents = [-1, 0, *(parent + 1 for parent in skeleton.parents[1:]), *(hand + 1 for hand in hands)]
    lifted = np.array([[0.0, 0.0, 0.0], [0.1, 0.2, 0.3]])
    offsets = np.concatenate([lifted, skeleton.offsets[1:], np.full((2, 3), 0.03)])
    turn = quaternion.from_up_angle(np.array(0.4))
    rotations = quaternion.identity(len(motion), len(names))
    rotations[:, 0] = turn
    rotations[:, 1:-2] = motion.rotations
    rotations[:, 1] = quaternion.multiply(quaternion.inverse(turn), motion.rotations[:, 0])
    root = motion.root_positions - quaternion.rotate(turn, lifted[1])
    return Motion(Skeleton(names, parents, offsets), root, rotations, motion.fps)


@pytest.fixture(scope="module")
def plain_and_dressed():
    made, plain = thrown()
    other = build_example("d", "s", dressed(made.motion), "right_hand", made.release, (15.0, 2.0, 1.2))
    return plain, other


def random_model(example, settings, seed=0):
    """Networks of random weights that answer near the example's mean pose."""
    random, rows = np.random.default_rng(seed), build_training_set([example], settings)
    networks, chains = {}, find_chains(example.motion.skeleton, settings.shoulder)
    for name, (inputs, outputs) in count_widths(chains, settings).items():
        sizes = [inputs, *[settings.units] * settings.layers, outputs]
        pairs = list(zip(sizes, sizes[1:]))
        networks[name] = PhaseNetwork(
            tuple(random.normal(size=(settings.points, b, a)) / np.sqrt(a) for a, b in pairs),
            tuple(random.normal(size=(settings.points, b)) for _, b in pairs),
            rows[name].inputs.mean(0), rows[name].inputs.std(0) + 0.1,
            rows[name].outputs.mean(0), rows[name].outputs.std(0) + 0.02,
        )  # fmt: skip
    return ThrowModel(settings=settings, skeleton=example.motion.skeleton, networks=networks,
                      leg_reach=measure_leg_reach([example]), examples=(example,))


def plainly(model, chains, pose, window):
    """The loop that the docstring of `features` shows, in float64."""
    after = pose
    for name in HIERARCHY:
        phase = compute_phase(name, chains, after, window, model.leg_reach)
        x = build_input(name, chains, model.settings, pose, after, window)
        after = apply_output(name, chains, model.settings, model.networks[name].predict(x, phase), pose, after, window)
    return after


def row(arrays, frame):
    return type(arrays)(*(None if array is None else array[frame] for array in arrays))


@pytest.mark.parametrize("which", [0, 1])
def test_one_pose_at_once_is_the_same_kinematics(plain_and_dressed, which):
    motion = plain_and_dressed[which].motion
    skeleton, local = motion.skeleton, to_matrices(motion)[40]
    expected = compute_world_transforms(skeleton.offsets, skeleton.parents, motion.root_positions[40], local)
    got = compute_pose_transforms(skeleton.offsets, skeleton.parents, motion.root_positions[40], local)
    for one, other in zip(got, expected):
        np.testing.assert_allclose(one, other, atol=1e-12)


@pytest.mark.parametrize("which", [0, 1])
@pytest.mark.parametrize("settings", [
    {}, {"wrist": "inferred"}, {"frame": "static"}, {"points": 1},
    {"wrist": "inferred", "frame": "static", "points": 5},
    {"guided": True}, {"guided": True, "wrist": "inferred"},
    {"carried": True}, {"carried": True, "frame": "static"}, {"shoulder": "arm", "guided": True},
])
def test_it_says_what_the_plain_functions_say(plain_and_dressed, which, settings):
    example = plain_and_dressed[which]
    model = random_model(example, ModelSettings(layers=2, units=8, **settings))
    chains = find_chains(example.motion.skeleton, model.settings.shoulder)
    fast, states, seen = HierarchyPredictor(model,
                                            chains), compute_poses(example), build_windows(build_description(example))
    for frame in (0, 20, len(example.motion) - 2):
        pose, window = Pose(*row(states, frame)), Windows(*row(seen, frame))
        before = [array.copy() for array in pose]
        for _ in range(3):
            got, expected = fast(pose, window), plainly(model, chains, pose, window)
            for name in ("root", "local", "positions", "turns"):
                np.testing.assert_allclose(getattr(got, name), getattr(expected, name), atol=2e-4, err_msg=name)
            assert all(np.array_equal(one, other) for one, other in zip(pose, before))
            pose, before = got, [array.copy() for array in got]
