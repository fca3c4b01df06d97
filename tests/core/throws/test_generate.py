"""Networks that know the truth by heart give the motion back; a wrong start is found out of; what is asked wrongly is
told."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.synthetic.throws import build_throw
from beyond_mocap.throws.evaluate_throws import RAW_OPTIONS
from beyond_mocap.throws.networks.chains import find_chains
from beyond_mocap.throws.networks.description import build_windows
from beyond_mocap.throws.networks.example import build_description, build_example, compute_poses
from beyond_mocap.throws.networks.frame_step import blend_window, prepare_stepper
from beyond_mocap.throws.networks.generate import Options, generate_motion
from beyond_mocap.throws.networks.kinematics import Pose, to_matrices
from beyond_mocap.throws.networks.limb_reach import LimbReach, find_hinge_axes, reach_limb
from beyond_mocap.throws.networks.limits import estimate_joint_limits
from beyond_mocap.throws.networks.model import ModelSettings, ThrowModel
from beyond_mocap.throws.networks.network import PhaseNetwork
from beyond_mocap.throws.networks.training_set import measure_leg_reach
from tests.core.linear_throws import build_training_set


class ByHeart(PhaseNetwork):
    """A network that answers with what belongs to the input most like the one that it is asked."""

    def frame_of(self, x, theta):
        if self.asked is not None:
            self.asked.append(np.abs(self.known - x).max(axis=1).min())
        return self.said[np.argmin(((self.known - x) ** 2).sum(axis=1))]

    @property
    def frame_network(self):
        return self.frame_of


def by_heart(rows, units=2):
    inputs, answers = rows.inputs.shape[1], rows.outputs.shape[1]
    network = ByHeart(
        (np.zeros((1, units, inputs)), np.zeros((1, answers, units))), (np.zeros((1, units)), np.zeros((1, answers))),
        np.zeros(inputs), np.full(inputs, 1e3), np.zeros(answers), np.ones(answers),
    )  # fmt: skip
    for name, value in (("known", rows.inputs), ("said", rows.outputs), ("asked", [])):
        object.__setattr__(network, name, value)
    return network


def thrown(y=0.0, stature=1.8, arm="right", fps=30.0):
    made = build_throw((18.0, y, 1.0), 20.0, arm, skeleton=build_adult_skeleton(stature), fps=120.0)
    return build_example(f"y{y}", "one", made.motion, f"{arm}_hand", made.release, (18.0, y, 1.0), made.velocity, fps,
                         span=(0.4, made.motion.duration - 0.5))


def knowing(examples, **settings):
    settings = ModelSettings(points=1, layers=1, units=2, **settings)
    rows = build_training_set(examples, settings)
    return ThrowModel(settings=settings, skeleton=examples[0].motion.skeleton,
                      networks={name: by_heart(rows[name]) for name in settings.networks},
                      leg_reach=measure_leg_reach(examples), examples=tuple(examples),
                      joint_limits=estimate_joint_limits(np.concatenate([e.motion.rotations
                                                                         for e in examples])))  # fmt: skip


@pytest.fixture(scope="module")
def example():
    return thrown()


@pytest.fixture(scope="module")
def model(example):
    return knowing([example])


@pytest.mark.parametrize("settings", [
    {}, {"wrist": "inferred"}, {"frame": "static"}, {"kind": "single"}, {"kind": "single", "frame": "static"},
])
@pytest.mark.parametrize("options", [RAW_OPTIONS, Options()])
def test_networks_that_know_the_truth_give_the_motion_back(example, settings, options):
    model = knowing([example], **settings)
    made = generate_motion(model, build_description(example), options=options)
    truth, _ = forward_kinematics(example.motion)
    assert np.abs(forward_kinematics(made.motion)[0] - truth).max() < 1e-6
    assert made.deviation.max() < 1e-6 and made.network_deviation.max() < 1e-6
    # the first frame is an example's own, and everything that was asked had been seen
    assert made.iterations == 0 and made.over.max() < 1e-9
    assert all(max(network.asked) < 1e-6 for network in model.networks.values())


def test_the_start_is_the_frame_that_fits_wherever_and_whichever_way_it_stands(example):
    others = [replace(thrown(2.0), name="other"), example, thrown(-3.0, arm="left")]
    model = knowing(others)
    for one in others:
        made = generate_motion(model, build_description(one), options=RAW_OPTIONS)
        assert np.allclose(made.motion.root_positions[0], one.motion.root_positions[0], atol=1e-6), one.name


def test_a_start_that_is_off_comes_to_the_trajectory(example):
    model = knowing([example], frame="static")
    at = compute_poses(example)
    first = Pose(*(part[0] for part in at))
    away = first._replace(root=first.root + [0.04, 0.0, 0.0], positions=first.positions + [0.04, 0.0, 0.0])
    bare = generate_motion(model, build_description(example), start=away, options=replace(Options(), pose_iterations=0))
    assert 0.03 < bare.deviation[0].max() < 0.05 and bare.deviation[10:].max() < 0.01
    fitted = generate_motion(model, build_description(example), start=away)
    assert fitted.iterations > 0 and fitted.deviation[0].max() < 0.01


def test_inverse_kinematics_takes_its_share_of_the_way(example):
    model = knowing([example], frame="static")
    told = build_description(example)
    moved = replace(told, effectors=told.effectors + np.array([0.0, 0.02, 0.0]))
    made = generate_motion(model, moved, start=Pose(*(part[0] for part in compute_poses(example))), options=Options(
        pose_iterations=0, share=0.5, blend=False, limits=False, gaze=0.0))
    assert np.allclose(np.median(made.network_deviation[1:], axis=0), 0.02, atol=1e-4)
    hands, toes = made.deviation[1:, :2], made.deviation[1:, 2:]
    assert np.allclose(np.median(hands, axis=0), 0.01, atol=1e-4) and made.deviation.max() < 0.021
    standing = np.linalg.norm(np.diff(told.effectors[:, 2:], axis=0), axis=-1) < 1e-3
    assert standing.sum() > 40 and toes[standing].max() < 1e-3
    bones = [np.linalg.norm(np.diff(forward_kinematics(m)[0][:, [5, 4]], axis=1), axis=-1) for m in
             (made.motion, example.motion)]
    assert np.allclose(bones[0], bones[1][0], atol=1e-9)


def test_one_limb_after_the_other_and_all_at_once_are_the_same(example, model):
    chains, limits = find_chains(model.skeleton), prepare_stepper(model).limits
    pose = Pose(*(part[30] for part in compute_poses(example)))
    wanted = pose.positions[list(chains.effectors)] + np.random.default_rng(3).normal(0.0, 0.03, (4, 3))
    for given in (True, False):
        together = LimbReach(chains, limits, given)(pose, wanted, np.full(4, 0.7))
        after = pose
        for number in range(4):
            kept = given or number >= 2
            after = reach_limb(number, chains, after, wanted[number], 0.7, find_hinge_axes(chains, limits), kept, np)
        assert np.allclose(after.positions, together.positions, atol=1e-9)
        assert np.allclose(after.local, together.local, atol=1e-9)


def test_a_blended_window_begins_where_the_hand_is_and_ends_where_it_is_wanted(example):
    seen = build_windows(build_description(example))
    window = type(seen)(*(None if part is None else part[20] for part in seen))
    offset = np.full((4, 3), 0.05)
    led = blend_window(window, offset, 30.0)
    assert np.allclose(led.points[:, :3] - window.points[:, :3], 0.05)
    assert np.abs(led.points[:, -1] - window.points[:, -1]).max() < 1e-4
    left = (led.points - window.points)[0, :, 0]
    assert np.all(np.diff(left) <= 0.0) and 0.0 < (led.next - window.next).max() < 0.05


def test_limits_hold_where_networks_go_astray(example, model):
    wild = {name: by_heart(rows) for name, rows in build_training_set([example], model.settings).items()}
    rng = np.random.default_rng(4)
    for network in wild.values():
        object.__setattr__(network, "said", network.said + rng.normal(0.0, 0.6, network.said.shape))
    made = generate_motion(replace(model, networks=wild), build_description(example))
    limits = prepare_stepper(model).limits
    assert made.over.max() > 0.1 and limits.measure_excess(to_matrices(made.motion)).max() < 1e-6


def test_networks_are_asked_only_for_what_is_near_what_they_know(example, model):
    told = build_description(example)
    moved = replace(told, impact=told.impact + np.array([5000.0, 0.0, 0.0]))
    near = {name: by_heart(rows) for name, rows in build_training_set([example], model.settings).items()}
    for network in near.values():
        object.__setattr__(network, "input_scale", np.full_like(network.input_scale, 20.0))
    for limits, most in ((True, 160.0), (False, 5000.0)):
        for network in near.values():
            network.asked.clear()
        generate_motion(replace(model, networks=near), moved, options=replace(RAW_OPTIONS, limits=limits))
        assert most - 20.0 < max(near["hip"].asked) <= most + 1e-3


@pytest.mark.parametrize("answer", [np.nan, 1e30])
def test_networks_that_lose_the_body_are_told_in_a_line(example, model, answer):
    lost = {name: by_heart(rows) for name, rows in build_training_set([example], model.settings).items()}
    object.__setattr__(lost["hip"], "said", np.full_like(lost["hip"].said, answer))
    with pytest.raises(InputError, match="an invalid pose in frame 1"):
        generate_motion(replace(model, networks=lost), build_description(example), options=RAW_OPTIONS)


def test_what_does_not_fit_the_model_is_told(example, model):
    told = build_description(example)
    with pytest.raises(InputError, match="60 frames per second"):
        generate_motion(model, replace(told, fps=60.0))
    with pytest.raises(InputError, match="hand rotations"):
        generate_motion(model, replace(told, hands=None))
    with pytest.raises(InputError, match="share"):
        Options(share=1.5)
