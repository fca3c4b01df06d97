"""A planted ball's launch comes back from its marker: when, how fast, how it spins; from both sides of the guess."""

import numpy as np
import pytest

from beyond_mocap.ball.physics import BASEBALL
from beyond_mocap.markers.release.launch_fit import HeldMarker, fit_launch
from beyond_mocap.markers.release.throwing_hand import find_fastest_frame, find_release_by_distance, fit_hand_ball
from beyond_mocap.motion import quaternion

RADIUS, RELEASE = 0.0366, 0.5037
GRAVITY = np.array([0.0, 0.0, -9.81])


def planted(fps, speed, spin, seen=0.3, noise=0.0007, seed=0):
    """(marker (T, 3), Held, velocity (3,), centre (T, 3)) of a hand that swings, and a ball without air."""
    from scipy.interpolate import CubicSpline

    rng = np.random.default_rng(seed)
    fine, times = np.arange(0.0, 1.0, 0.0005), np.arange(0.0, 1.0, 1.0 / fps)
    pace = speed * np.exp(-(((fine - RELEASE - 0.002) / 0.06) ** 2))
    angle = 12.0 * (fine - RELEASE) * np.exp(-(((fine - RELEASE) / 0.3) ** 2))
    way = np.stack([np.cos(angle), np.sin(angle), np.full(len(fine), 0.1)], axis=-1) * pace[:, None]
    centre = CubicSpline(fine, np.cumsum(way, axis=0) * 0.0005 + [0.0, 0.0, 1.5])
    turn = CubicSpline(fine, 3.0 * angle)
    offset = rng.normal(size=3)
    offset *= RADIUS / np.linalg.norm(offset)
    held = centre(times) + quaternion.rotate(quaternion.from_up_angle(turn(times)),
                                             np.broadcast_to(offset, (len(times), 3)))
    start, velocity = centre(RELEASE), centre(RELEASE, 1)
    first = quaternion.rotate(quaternion.from_up_angle(turn(RELEASE)), offset)
    since = np.maximum(times - RELEASE, 0.0)[:, None]
    turned = quaternion.rotate(quaternion.from_rotation_vector(np.asarray(spin, float) * since), first)
    flying = start + velocity * since + 0.5 * GRAVITY * since**2 + turned
    marker = np.where(times[:, None] > RELEASE, flying, held) + rng.normal(0.0, noise, held.shape)
    marker[times > RELEASE + seen] = np.nan
    return marker, HeldMarker(held, centre(times), centre(times, 1)), velocity, centre(times)


@pytest.mark.parametrize("guess", [-0.06, 0.05])
@pytest.mark.parametrize("fps, speed, spin, seen", [
    (200.0, 25.0, (0.0, -120.0, 30.0), 0.3),
    (360.0, 36.0, (0.0, -200.0, 50.0), 0.3),
    (200.0, 20.0, (10.0, -60.0, 0.0), 0.06),
    (120.0, 15.0, (0.0, -80.0, 0.0), 0.2),
    (50.0, 12.0, (0.0, -20.0, 0.0), 0.3),
])
def test_planted_launches_come_back(fps, speed, spin, seen, guess):
    marker, held, velocity, _ = planted(fps, speed, spin, seen)
    air = BASEBALL.__class__("none", RADIUS, 0.145, 9.81)
    found = fit_launch(marker, held, fps, RELEASE + guess, air, RADIUS)
    assert abs(found.time - RELEASE) < 1.0 / fps
    assert abs(np.linalg.norm(found.velocity) / np.linalg.norm(velocity) - 1.0) < 0.02
    if seen >= 0.2:  # less than half a turn tells less
        assert np.linalg.norm(found.spin - spin) < 0.1 * np.linalg.norm(spin)
    assert found.residual < 0.002
    assert abs(np.linalg.norm(found.offset) - RADIUS) < 1e-6
    assert 0.0 < found.time_sigma < 2.0 / fps


def test_a_ball_that_is_never_seen_to_fly_is_none():
    marker, held, _, _ = planted(200.0, 20.0, (0.0, -50.0, 0.0), seen=0.0)
    assert fit_launch(marker, held, 200.0, RELEASE, BASEBALL, RADIUS) is None


def test_the_first_guess_is_near():
    marker, _, _, centre = planted(200.0, 25.0, (0.0, -50.0, 0.0))
    assert abs(find_release_by_distance(centre, marker, 200.0) / 200.0 - RELEASE) < 0.03
    assert abs(find_fastest_frame(centre, 200.0) / 200.0 - RELEASE) < 0.02
    assert find_release_by_distance(centre, np.full_like(marker, np.nan), 200.0) is None


def test_the_centre_and_the_radius_come_back_from_several_throws():
    rng = np.random.default_rng(4)
    centre = np.array([0.02, -0.12, -0.035])
    around = rng.normal(size=(40, 3))
    points = centre + 0.047 * around / np.linalg.norm(around, axis=-1)[:, None] + rng.normal(0.0, 0.0005, (40, 3))
    found = fit_hand_ball(points, 0.0366, centre + 0.02, fit_radius=True)
    assert found.is_radius_fitted and abs(found.radius - 0.047) < 0.001
    assert np.linalg.norm(found.centre - centre) < 0.001


def test_one_place_of_the_marker_leaves_the_centre_to_what_is_usual():
    usual = np.array([0.0, -0.12, -0.03])
    marker = usual + [0.0, 0.0, -0.05]
    found = fit_hand_ball(np.repeat(marker[None], 30, axis=0), 0.0366, usual, fit_radius=True)
    assert not found.is_radius_fitted and found.radius == 0.0366
    assert abs(np.linalg.norm(found.centre - marker) - 0.0366) < 0.002
    assert found.sigma > 0.01
    assert np.array_equal(fit_hand_ball(np.full((3, 3), np.nan), 0.0366, usual).centre, usual)
