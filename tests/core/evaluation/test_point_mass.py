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
from beyond_mocap.synthetic.gait import build_gait

FPS = 30.0


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
