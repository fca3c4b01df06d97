"""A point mass under the forces that a body's feet give, beside the body's own centre of mass.

The force is what accelerates the centre of mass while a foot is on the ground, and nothing but gravity in between. A
body that obeys momentum comes back to itself; one that turns, pushes or falls in flight leaves the point mass.
"""

import numpy as np
import pytest

from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.mass import compute_centre_of_mass
from beyond_mocap.motion.momentum_polish import obey_momentum
from beyond_mocap.motion.motion import compute_pose
from beyond_mocap.motion.supports import GRAVITY, find_stances, find_support_phases
from beyond_mocap.motion.track import Track
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.synthesize import synthesize
from beyond_mocap.synthetic.gait import build_gait

FPS = 30.0
SWAY = 0.015  # m


def measure_drift(skeleton, root, rotations):
    """Drift (W, 3) m of a point mass after a second in which contact forces and gravity alone move it.

    It starts every 5 frames, with the place and speed of the centre of mass. Frames whose second difference sees a
    contact have a force.
    """
    positions, _ = compute_pose(skeleton, root, rotations)
    centre = compute_centre_of_mass(identify_joints(skeleton), positions)
    phases = find_support_phases(find_stances(skeleton, positions, FPS), centre, FPS)
    at, gravity = np.arange(1, len(centre) - 1), np.array([0.0, 0.0, -GRAVITY])
    force = (centre[2:] - 2.0 * centre[1:-1] + centre[:-2]) * FPS**2 - gravity
    force[~((at[:, None] + 1 > phases[:, 0]) & (at[:, None] - 1 < phases[:, 1])).any(axis=1)] = 0.0
    second = int(FPS)
    drifts = []
    for first in range(0, len(centre) - second, 5):
        before, place = centre[first], centre[first + 1]
        for frame in range(first, first + second - 1):
            before, place = place, 2.0 * place - before + (force[frame] + gravity) / FPS**2
        drifts.append(place - centre[first + second])
    return np.array(drifts)


def accelerate():
    """Speeds (T,) m/s of a run that accelerates to 7 m/s and slows down."""
    return np.concatenate([np.linspace(3.0, 7.0, 100), np.full(50, 7.0), np.linspace(7.0, 4.0, 60)])


@pytest.mark.parametrize("speed, seconds, turn", [
    (3.5, 6.0, 0.0), (5.0, 6.0, 0.0), (5.0, 6.0, 0.5), (7.0, 6.0, 0.0), (accelerate(), None, 0.0),
], ids=["jog", "run", "bend", "sprint", "start and stop"])
def test_a_run_that_obeys_momentum_comes_back_within_a_centimetre_a_second(speed, seconds, turn):
    motion = build_gait(speed, seconds, FPS, turn_rate=turn)
    swaying = motion.root_positions + SWAY * np.sin(20.0 * np.arange(len(motion)) / FPS)[:, None] * [1.0, 1.0, 0.0]
    off = np.abs(measure_drift(motion.skeleton, swaying, motion.rotations))
    assert np.median(np.linalg.norm(off[:, :2], axis=1)) > 0.05  # no body is pushed so in the air
    obeying = obey_momentum(motion.skeleton, swaying, motion.rotations, FPS, np.ones(len(motion)))
    drift = measure_drift(motion.skeleton, *obeying)
    assert np.linalg.norm(drift[:, :2], axis=1).max() < 0.01
    assert np.percentile(np.abs(drift[:, 2]), 90) < 0.01


def test_a_take_comes_back_within_a_centimetre_a_second(library):
    """A jog that becomes a run and turns, through search and construction."""
    times = np.arange(0.0, 8.01, 0.1)
    heading = 0.12 * np.clip(times - 3.0, 0.0, 3.0) ** 2
    path = np.cumsum(0.1 * np.interp(times, [0.0, 3.0], [2.8, 4.2])[:, None]
                     * np.stack([np.cos(heading), np.sin(heading)], axis=1), axis=0)
    take = synthesize(library, Plan(track=Track(times, path), nearest=True, made=False))
    drift = measure_drift(take.motion.skeleton, take.motion.root_positions, take.motion.rotations)
    drift = np.linalg.norm(drift, axis=1)
    assert take.motion.fps == FPS and drift.max() < 0.01
