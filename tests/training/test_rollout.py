"""The hierarchy in order with its frames fed back, and inverse kinematics as a layer of it."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from beyond_mocap.synthetic.throws import build_throw
from beyond_mocap.throws.networks.chains import HIERARCHY, LIMB_OF
from beyond_mocap.throws.networks.example import build_example
from beyond_mocap.throws.networks.limits import JointLimits, estimate_joint_limits
from beyond_mocap.throws.networks.training_set import find_shared_chains, measure_leg_reach
from training.config import build_config
from training.hierarchy import IK_SHARE, TrainingProblem
from training.recordings import build_recordings

SMALL = {"units": 8, "layers": 1, "points": 1, "fps": 15.0, "noise": 0.0, "rollout": 2, "linear_start": False,
         "guided": False, "carried": False}  # fmt: skip
ROWS = jnp.array([[0, 6]])


@pytest.fixture(scope="module")
def example():
    thrown = build_throw((12.0, 2.0, 1.0), 22.0, fps=60.0)
    return build_example("t", "s", thrown.motion, "right_hand", thrown.release, (12.0, 2.0, 1.0), fps=15.0)


def problem(example, **told):
    limits = JointLimits(example.motion.skeleton, estimate_joint_limits(example.motion.rotations))
    return TrainingProblem(
        build_recordings([example]), find_shared_chains([example]), build_config({**SMALL, **told}),
        measure_leg_reach([example]), limits
    )


def one_frame(trained, params):
    """What networks make of the first frame of ROWS."""
    recorded, _, _ = trained.data
    example, at = ROWS[:, 0], ROWS[:, 1]
    (pose, window), (truth, _) = recorded.select_frames(example, at), recorded.select_frames(example, at + 1)
    return trained._predict_frame(params, pose, truth, window, jax.random.key(0))


def test_each_frame_is_predicted_from_the_one_predicted_before(example, monkeypatch):
    """Networks that put the root 1 m further than they are told it is, and miss the truth by how far that is off."""
    trained = problem(example)
    root = np.asarray(trained.data[0].pose.root)[0, :, 2]

    def frame(params, pose, truth, window, key):
        after = pose._replace(root=pose.root + 1.0)
        return after, {"hip": jnp.mean(after.root[:, 2] - truth.root[:, 2]), "seen": jnp.mean(window.next[..., 0])}

    monkeypatch.setattr(trained, "_predict_frame", frame)
    _, parts = trained.compute_loss(trained.build_parameters(jax.random.key(3)), trained.data, ROWS, jax.random.key(1),
                                    3)
    first = int(ROWS[0, 1])
    off = [root[first] + step - root[first + step] for step in (1, 2, 3)]
    assert float(parts["hip"]) == pytest.approx(np.mean(off), abs=1e-5) and set(parts) == {"hip", "seen", "sizes"}
    seen = np.asarray(trained.data[0].window.next)[0, first : first + 3, :, 0]
    assert float(parts["seen"]) == pytest.approx(seen.mean(), abs=1e-5)


def test_children_see_what_their_parents_predict(example):
    """Each network's loss counts, and a worse hip moves what all others reach."""
    trained = problem(example)
    params = trained.build_parameters(jax.random.key(3))
    worse = {**params, "hip": jax.tree.map(lambda one: one + 0.3, params["hip"])}
    predict = jax.jit(partial(one_frame, trained))
    (_, parts), (_, other) = predict(params), predict(worse)
    assert set(parts) == {*HIERARCHY, *(f"{name} ends" for name in HIERARCHY)}
    assert all(
        float(other[f"{name} ends"]) != pytest.approx(float(parts[f"{name} ends"]), rel=1e-3) for name in LIMB_OF
    )


def test_inverse_kinematics_as_a_layer_brings_limbs_its_share_of_the_way(example):
    """Of hands and feet within reach what is left to go is less by IK_SHARE, and bones keep their lengths."""
    plain, bent = problem(example), problem(example, ik_layer=True)
    params = plain.build_parameters(jax.random.key(3))
    wanted = np.asarray(plain.data[0].select_frames(ROWS[:, 0], ROWS[:, 1])[1].next[0])
    effectors, left = list(plain.chains.effectors), []
    for trained in (plain, bent):
        places = np.asarray(jax.jit(partial(one_frame, trained))(params)[0].positions[0])
        left.append(np.linalg.norm(places[effectors] - wanted, axis=-1))
    skeleton = plain.chains.skeleton
    bones = np.linalg.norm(places[1:] - places[list(skeleton.parents[1:])], axis=-1)
    np.testing.assert_allclose(bones, np.linalg.norm(skeleton.offsets[1:], axis=-1), atol=1e-4)
    assert left[0].min() > 0.005
    np.testing.assert_allclose(left[1], (1.0 - IK_SHARE) * left[0], rtol=0.1, atol=0.004)
