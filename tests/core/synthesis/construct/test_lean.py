"""Bodies lean into curves, by what their recordings lack of it."""

import numpy as np
import pytest

from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import compute_pose, place_motion
from beyond_mocap.synthesis.construct.track_following import (
    LEGS_LEAN,
    MAX_LEAN,
    TRUNK_LEAN,
    compute_missing_lean,
    lean_into_curves,
)
from beyond_mocap.synthetic.gait import build_gait

FPS, COUNT = 30.0, 90
NO_SEAM = np.zeros(0, int)


def curve(speed, radius):
    """A track's speed and direction on a circle to the left; a radius of inf is a straight line."""
    return np.full(COUNT, float(speed)), np.arange(COUNT) / FPS * speed / radius


def footage(speed, radius):
    """A recording that faces where it goes, on a circle."""
    return np.tile([float(speed), 0.0], (COUNT, 1)), np.full(COUNT, speed / radius / FPS)


@pytest.mark.parametrize("radius", [12.0, -12.0])
def test_a_straight_recording_on_a_curve_lacks_all_of_it(radius):
    lean = compute_missing_lean(*curve(5.0, radius), *footage(5.0, np.inf), NO_SEAM, FPS)
    asked = 5.0**2 / radius / 9.81
    limit = MAX_LEAN / LEGS_LEAN
    assert np.allclose(lean[15:-15], limit * np.tanh(asked / limit), rtol=0.02)
    assert np.abs(lean).max() < 1.05 * abs(asked)


def test_a_recording_of_the_same_curve_lacks_nothing():
    lean = compute_missing_lean(*curve(5.0, 12.0), *footage(5.0, 12.0), NO_SEAM, FPS)
    assert np.abs(lean[15:-15]).max() < 1e-6


def test_no_lean_when_slow_and_never_too_much():
    assert np.abs(compute_missing_lean(*curve(1.4, 0.5), *footage(1.4, np.inf), NO_SEAM, FPS)).max() < 1e-9
    assert LEGS_LEAN * np.abs(compute_missing_lean(*curve(8.0, 3.0), *footage(8.0, np.inf), NO_SEAM,
                                                   FPS)).max() <= MAX_LEAN


def test_a_seam_is_no_turn():
    velocity, turn = footage(4.0, np.inf)
    velocity[40:] = [0.0, 4.0]
    lean = compute_missing_lean(*curve(4.0, np.inf), velocity, turn, np.array([40]), FPS)
    assert np.abs(lean).max() < 1e-9


@pytest.mark.parametrize("heading", [0.0, 2.0])
def test_legs_lean_by_their_share_and_the_trunk_by_less(heading):
    motion = place_motion(build_gait(4.0, 3.0, FPS), heading)
    lean = np.full(len(motion), 0.3)
    out = lean_into_curves(motion.skeleton, motion.rotations, np.full(len(motion), heading), lean)
    body, across = identify_joints(motion.skeleton), np.array([-np.sin(heading), np.cos(heading), 0.0])
    places, _ = compute_pose(motion.skeleton, motion.root_positions, motion.rotations)
    after, _ = compute_pose(motion.skeleton, motion.root_positions, out)

    def tilt(p, low, high):
        up = (p[:, high] - p[:, low]).mean(axis=0)
        return np.arctan2(up @ across, up[2])

    for side in (body.left, body.right):
        leg = side.foot, side.upper_leg
        assert tilt(after, *leg) - tilt(places, *leg) == pytest.approx(LEGS_LEAN * 0.3, abs=0.01)
    low = body.spine[0]
    assert tilt(after, low, body.neck) - tilt(places, low, body.neck) == pytest.approx(TRUNK_LEAN * 0.3, abs=0.01)


def test_who_does_not_lean_stays_as_he_is():
    motion = build_gait(4.0, 1.0, FPS)
    still = lean_into_curves(motion.skeleton, motion.rotations, np.zeros(len(motion)), np.zeros(len(motion)))
    assert np.allclose(still, motion.rotations, atol=1e-12)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_few_frames(count):
    speed, direction = curve(5.0, 12.0)
    velocity, turn = footage(5.0, np.inf)
    lean = compute_missing_lean(speed[:count], direction[:count], velocity[:count], turn[:count], NO_SEAM, FPS)
    assert lean.shape == (count,) and np.isfinite(lean).all()
