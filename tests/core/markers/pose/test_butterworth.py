"""The low-pass filter of a solved motion: what is slow stays, what is fast goes, nothing is late."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.markers.pose.low_pass import filter_butterworth, filter_values
from beyond_mocap.motion import quaternion
from beyond_mocap.synthetic.gait import build_gait


@pytest.fixture(scope="module")
def walk():
    return build_gait(1.4, 2.0, 200.0)


def angles(a, b):
    """Radians (T, J) between local rotations."""
    return np.linalg.norm(quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(a), b)), axis=-1)


@pytest.mark.parametrize("cutoff, passes", [(13.4, 1.0 / np.sqrt(2.0)), (26.8, 1.0 / (1.0 + (np.sqrt(2.0) - 1) / 16))])
def test_half_of_the_power_passes_at_the_cutoff_and_nothing_is_late(cutoff, passes):
    time = np.arange(4000) / 1000.0
    wave = np.sin(2.0 * np.pi * 13.4 * time)
    out = filter_values(wave, 1000.0, cutoff)[500:-500]
    assert np.allclose(out, passes * wave[500:-500], atol=2e-3)


def test_noise_goes_and_the_movement_stays(walk):
    rng = np.random.default_rng(1)
    shaken = quaternion.from_rotation_vector(rng.normal(0.0, np.radians(1.0), (*walk.rotations.shape[:2], 3)))
    root = walk.root_positions + rng.normal(0.0, 0.002, walk.root_positions.shape)
    noisy = replace(walk, root_positions=root, rotations=quaternion.multiply(walk.rotations, shaken))
    out = filter_butterworth(noisy).motion
    assert np.sqrt(np.mean(angles(noisy.rotations, walk.rotations) ** 2)) > np.radians(1.5)
    assert np.sqrt(np.mean(angles(out.rotations, walk.rotations) ** 2)) < np.radians(0.75)
    assert np.abs(out.root_positions - walk.root_positions).std() < 0.001
    assert np.sqrt(np.mean(angles(filter_butterworth(walk).motion.rotations, walk.rotations) ** 2)) < np.radians(0.1)


def test_a_joint_that_turns_through_every_angle_is_not_torn(walk):
    spin = quaternion.from_up_angle(np.linspace(0.0, 12.0 * np.pi, len(walk)))
    rotations = np.array(walk.rotations)
    rotations[:, 0] = np.where((np.arange(len(walk)) % 7 == 0)[:, None], -spin, spin)
    out = filter_butterworth(replace(walk, rotations=rotations)).motion
    assert angles(out.rotations[:, 0], spin)[5:-5].max() < np.radians(0.5)


def test_the_ends_are_kept(walk):
    out = filter_butterworth(walk).motion
    assert np.allclose(out.root_positions[[0, -1]], walk.root_positions[[0, -1]], atol=1e-6)


@pytest.mark.parametrize("frames, fps", [(3, 200.0), (200, 25.0)])
def test_what_cannot_be_filtered_is_reported_and_stays(walk, frames, fps):
    motion = replace(walk.frames(0, frames), fps=fps)
    out = filter_butterworth(motion)
    assert len(out.notes) == 1 and out.motion is motion


@pytest.mark.parametrize("frames", [4, 5, 12])
def test_short_motions_are_filtered(walk, frames):
    out = filter_butterworth(walk.frames(0, frames))
    assert not out.notes and np.isfinite(out.motion.rotations).all() and len(out.motion) == frames


@pytest.mark.parametrize("cutoff", [0.0, -3.0, np.nan, np.inf])
def test_a_cutoff_that_is_none_is_refused(walk, cutoff):
    with pytest.raises(InputError, match="cutoff"):
        filter_butterworth(walk, cutoff)


def test_numbers_that_are_none_are_refused(walk):
    root = np.array(walk.root_positions)
    root[3] = np.nan
    with pytest.raises(InputError, match="motion"):
        filter_butterworth(replace(walk, root_positions=root))
