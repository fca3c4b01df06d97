"""Strength and segment masses of a player: they decide the momentum of their take."""

import numpy as np
import pytest

from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.mass import SEGMENT_MASSES, compute_centre_of_mass
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.supports import GRAVITY
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.synthesize import synthesize


@pytest.fixture(scope="module")
def run(library, track_of):
    """run(**settings) -> the motion of a player who runs at 5 m/s."""
    return lambda **settings: synthesize(library, Plan(track=track_of(5.0), **settings)).motion


@pytest.fixture(scope="module")
def usual(run):
    return run()


def measure_forces(motion, masses):
    """(T - 2,) body weights with which the ground pushes up."""
    centre = compute_centre_of_mass(identify_joints(motion.skeleton), forward_kinematics(motion)[0], masses)[:, 2]
    return np.diff(centre, 2) * motion.fps**2 / GRAVITY + 1.0


def test_weak_legs_push_less(run, usual):
    men = SEGMENT_MASSES["men"]
    strong, weak = (np.percentile(measure_forces(motion, men), 98) for motion in (usual, run(strength=2.0)))
    assert weak < 2.2 < strong


def test_a_woman_flies_by_her_own_masses(run, usual):
    """In flight no force acts on her centre of mass; on that of a man in her motion it would."""
    woman = run(masses="women")
    own, other = (measure_forces(woman, SEGMENT_MASSES[who]) for who in ("women", "men"))
    flying = np.minimum(own, other) < 0.1
    assert flying.sum() > 20 and np.abs(own[flying]).mean() < 0.8 * np.abs(other[flying]).mean()
    assert np.any(woman.root_positions != usual.root_positions)
