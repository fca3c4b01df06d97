"""One player of a passing scene: his strikes are met at their time and place, feet stand, bits are the same."""

from types import SimpleNamespace

import numpy as np
import pytest

from beyond_mocap.annotation.striking import measure_ball_gap
from beyond_mocap.ball.contact import (
    compute_ball_centre,
    convert_to_world,
    find_striking_surface,
    sample_strike_surface,
)
from beyond_mocap.base.errors import InputError
from beyond_mocap.motion.humanoid import compute_heading_from_positions
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.track.ball_path import BallPath
from beyond_mocap.passes.player_motion import build_player_motion, estimate_least_seconds
from beyond_mocap.passes.player_path import HitOrder, Stance

FPS, RADIUS = 30.0, 0.105


def kick(library, time, place, facing, mirrored=False, off=(0.0, 0.0, 0.0), **more):
    """The made kick ordered; its ball lies where the clip's own foot strikes, `off` m from there."""
    number = next(i for i, clip in enumerate(library.clips) if clip.path == "kick.bvh" and clip.mirrored == mirrored)
    clip = library.clips[number]
    key = next(row.key for row in clip.annotations if row.key is not None)
    side = "left" if mirrored else "right"
    surface = find_striking_surface(library.skeleton, "foot", side)
    struck = sample_strike_surface(clip.motion, np.array([key]), surface)
    ball = convert_to_world(compute_ball_centre(struck, struck.velocity, RADIUS), np.array(place), facing)[0] + off
    hit = SimpleNamespace(first=key - 24.0, last=key + 24.0)
    return HitOrder(time, number, hit, float(key), place, facing, tuple(ball), (1.0, 0.0, 0.0), "foot", side, **more)


def straight(orders, seconds):
    """A ball that goes straight from strike to strike, over a place 8 m away."""
    rows = [(0.0, (8.0, 0.0, 1.0))]
    for before, one in zip([None, *orders], orders):
        start = before.time if before else 0.0
        rows += [(0.5 * (start + one.time), (8.0, 0.0, 1.0)), (one.time, one.ball)]
    rows.append((seconds, (8.0, 0.0, 1.0)))
    times = np.arange(int(round(seconds * FPS)) + 1) / FPS
    at, places = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
    path = np.stack([np.interp(times, at, places[:, axis]) for axis in range(3)], axis=1)
    return BallPath(times, path, np.ones(len(times), bool))


@pytest.fixture(scope="module")
def orders(library):
    return [
        kick(library, 3.0, (0.5, 0.2), 0.3, off=(0.02, 0.03, 0.0)),
        kick(library, 8.0, (1.0, -0.5), -1.0, mirrored=True),
        kick(library, 13.0, (0.0, 0.0), 0.0, off=(0.3, 0.1, 0.0), touches=False),
    ]


@pytest.fixture(scope="module")
def made(library, orders):
    return build_player_motion(library, Stance((0.0, 0.0), 0.3), orders, straight(orders, 15.0), RADIUS)


def test_the_ball_is_met(library, orders, made):
    """The gap that is told is that of the motion at the strike's own frame; who misses is nowhere near."""
    places, world = forward_kinematics(made.take.motion)
    for number, one in enumerate(orders):
        at, surface = int(round(one.time * FPS)), find_striking_surface(library.skeleton, "foot", one.side)
        gap = measure_ball_gap(surface.compute_line(places[at], world[at]), surface.radius, np.array(one.ball), RADIUS)
        if one.touches:
            assert abs(gap) < 0.005 and abs(made.gaps[number] - abs(gap)) < 1e-9
        else:
            assert gap > 0.1 and np.isnan(made.gaps[number])
    assert not made.warnings and np.nanmax(made.part_shifts) < 0.15


def test_he_is_where_he_was_ordered(library, orders, made):
    places, _ = forward_kinematics(made.take.motion)
    heading = compute_heading_from_positions(library.skeleton, places)
    for one in orders:
        at = int(round(one.time * FPS))
        assert np.linalg.norm(places[at, 0, :2] - one.place) < 0.08
        assert abs(np.angle(np.exp(1j * (heading[at] - one.facing)))) < 0.15


def test_hit_motions_play_as_recorded(library, orders, made):
    take = made.take
    for one in orders:
        at = int(round(one.time * FPS)) + np.arange(-8, 9)
        assert {take.clips[n] for n in take.clip[at]} == {"kick.bvh"}
        np.testing.assert_allclose(take.clip_frame[at], one.strike_frame + 2.0 * np.arange(-8, 9), atol=1e-6)
        assert np.all(take.mirrored[at] == library.clips[one.clip].mirrored)


def test_the_same_bits(library, orders, made):
    again = build_player_motion(library, Stance((0.0, 0.0), 0.3), orders, straight(orders, 15.0), RADIUS)
    assert again.take.motion.rotations.tobytes() == made.take.motion.rotations.tobytes()
    assert again.take.motion.root_positions.tobytes() == made.take.motion.root_positions.tobytes()


def test_a_place_too_far_off_is_told_and_a_crowd_of_strikes_is_played(library):
    far = [kick(library, 2.0, (25.0, 0.0), 0.0)]
    made = build_player_motion(library, Stance((0.0, 0.0), 0.0), far, straight(far, 4.0), RADIUS)
    assert made.gaps[0] < 0.005 and len(made.warnings) == 1 and "m/s" in made.warnings[0]
    crowd = [kick(library, time, (0.0, 0.0), 0.0) for time in (0.0, 2.0, 2.5, 3.0)]
    made = build_player_motion(library, Stance((0.0, 0.0), 0.0), crowd, straight(crowd, 3.0), RADIUS)
    assert np.all(made.gaps < 0.005) and np.all(np.isfinite(made.take.motion.rotations))


def test_who_has_nothing_to_do_stands(library):
    orders = []
    made = build_player_motion(library, Stance((2.0, 1.0), 1.0), orders, straight(orders, 6.0), RADIUS)
    places, _ = forward_kinematics(made.take.motion)
    assert np.ptp(places[:, 0, :2], axis=0).max() < 0.1 and len(made.gaps) == 0


def test_more_way_and_more_turn_need_more_time(library, orders):
    near, far = kick(library, 9.0, (1.0, 0.5), 0.3), kick(library, 9.0, (16.0, 4.0), 0.3)
    assert estimate_least_seconds(library, orders[0], far) > estimate_least_seconds(library, orders[0], near) + 2.0


def test_orders_that_cannot_be_are_told(library, orders):
    ball = straight(orders, 15.0)
    with pytest.raises(InputError, match="strike"):
        build_player_motion(library, Stance((0.0, 0.0), 0.0), [orders[0], orders[0]], ball, RADIUS)
    with pytest.raises(InputError, match="within the scene"):
        build_player_motion(library, Stance((0.0, 0.0), 0.0), [kick(library, 99.0, (0.0, 0.0), 0.0)], ball, RADIUS)
