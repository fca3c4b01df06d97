"""Where hands and feet carry the hips: exactly there where a body goes as one, and where feet stand, not where hands
swing."""

import numpy as np
import pytest

from beyond_mocap.motion import quaternion
from beyond_mocap.synthetic.throws import build_throw
from beyond_mocap.throws.networks.chains import find_chains
from beyond_mocap.throws.networks.example import build_example
from beyond_mocap.throws.networks.features import HIP_GUIDES, build_input, carry_hips, count_guides, count_widths
from beyond_mocap.throws.networks.kinematics import to_six
from beyond_mocap.throws.networks.model import ModelSettings
from beyond_mocap.throws.networks.training_set import build_steps

TARGET = (12.0, 3.0, 1.2)


@pytest.fixture(scope="module")
def told():
    made = build_throw(TARGET, 22.0, fps=60.0)
    example = build_example("t", "s", made.motion, "right_hand", made.release, TARGET)
    return find_chains(example.motion.skeleton), *build_steps(example)


@pytest.mark.parametrize("angle", [-2.5, 0.0, 0.3, 3.0])
def test_a_body_that_turns_and_goes_as_one_takes_its_hips_along(told, angle):
    chains, pose, _, window = told
    turn, shift = quaternion.to_matrix(quaternion.from_up_angle(np.array(angle))), np.array([0.4, -0.2, 0.05])
    there = window._replace(next=pose.positions[:, list(chains.effectors)] @ turn.T + shift)
    origin = pose.positions[:, chains.hips] * (1.0, 1.0, 0.0)
    found = carry_hips(chains, pose, there, origin)
    assert np.abs(found[:, :3] + origin - (pose.positions[:, chains.hips] @ turn.T + shift)).max() < 1e-9
    assert np.abs(found[:, 3:] - to_six(turn @ pose.turns[:, chains.hips])).max() < 1e-6


def test_feet_count_more_than_hands(told):
    chains, pose, _, window = told
    still = pose.positions[:, list(chains.effectors)]
    moved = [np.linalg.norm((carry_hips(chains, pose, window._replace(next=still + push), 0.0)
                             - carry_hips(chains, pose, window._replace(next=still), 0.0))[:, :3], axis=-1).mean()
             for push in np.eye(4)[[0, 2]][:, :, None] * (0.0, 0.0, 0.1)]  # fmt: skip
    assert moved[1] == pytest.approx(3.0 * moved[0]) and moved[0] > 0.01


def test_the_hip_network_is_told_it_last(told):
    chains, pose, after, window = told
    plain, more = ModelSettings(), ModelSettings(carried=True)
    short, long = (build_input("hip", chains, one, pose, after, window) for one in (plain, more))
    assert count_widths(chains, more)["hip"][0] == count_widths(chains, plain)["hip"][0] + HIP_GUIDES
    assert np.array_equal(long[:, :-HIP_GUIDES], short) and count_guides("hip", chains, more) == HIP_GUIDES
    assert count_guides("hip", chains, plain) == 0 and count_guides("body", chains, more) == 0
    level = pose.positions[:, chains.hips] * (1.0, 1.0, 0.0)
    assert np.array_equal(long[:, -HIP_GUIDES:], carry_hips(chains, pose, window, level))
