"""Where a player goes between his hit motions, with planted hits of the made kick."""

from types import SimpleNamespace

import numpy as np
import pytest

from beyond_mocap.base.easing import interpolate_quintic
from beyond_mocap.motion import quaternion
from beyond_mocap.passes.player_path import (
    START_ACCELERATION,
    HitOrder,
    Stance,
    build_player_path,
    compute_travel_time,
    compute_walk,
    place_hits,
)

STILL = np.zeros(2)


def order(library, time, place, facing):
    clip = next(i for i, clip in enumerate(library.clips) if clip.path == "kick.bvh" and not clip.mirrored)
    key = next(row.key for row in library.clips[clip].annotations if row.key is not None)
    hit = SimpleNamespace(first=key - 24.0, last=key + 24.0)
    return HitOrder(time, clip, hit, float(key), place, facing, (0.0, 0.0, 0.2), (1.0, 0.0, 0.0), "foot", "right")


@pytest.fixture(scope="module")
def orders(library):
    return [order(library, 3.0, (1.0, 2.0), 0.4), order(library, 7.0, (-1.0, 0.0), 3.0)]


def test_at_each_strike_he_is_where_and_faces_as_ordered(library, orders):
    hits = place_hits(library, orders, 0.0)
    times = np.arange(0.0, 10.0, 0.01)
    found = build_player_path(Stance((0.0, 0.0), 0.0), hits, times)
    for one, hit in zip(orders, hits):
        at = int(round(one.time / 0.01))
        assert abs(quaternion.wrap_angle(found.facing[at] - one.facing)) < 0.02
        own = library.frames.path[library.frames.first[one.clip] + int(round(one.strike_frame / 2))] - hit.clip_place
        np.testing.assert_allclose(
            found.positions[at] - one.place, quaternion.rotate_level(own, np.array(hit.turn)), atol=0.03
        )


def test_the_way_has_no_jump_and_begins_at_the_stance(library, orders):
    times = np.arange(0.0, 10.0, 0.01)
    found = build_player_path(Stance((0.0, 0.0), 0.0), place_hits(library, orders, 0.0), times)
    steps = np.linalg.norm(np.diff(found.positions, axis=0), axis=1) / 0.01
    assert np.abs(found.positions[0]).max() < 1e-9 and steps.max() < 4.5
    np.testing.assert_allclose(np.diff(steps) / 0.01, 0.0, atol=25.0)


def test_he_turns_the_short_way_round(library):
    orders = [order(library, t, (0.0, 0.0), f) for t, f in ((3.0, 3.0), (6.0, -3.0), (9.0, 3.0))]
    hits = place_hits(library, orders, 0.0)
    facing = build_player_path(Stance((0.0, 0.0), 3.0), hits, np.arange(0.0, 12.0, 0.05)).facing
    known = facing[np.isfinite(facing)]
    assert np.ptp(known) < 1.5


def test_who_has_time_stands_where_he_sets_out():
    before, after = (0.0, np.zeros(2), np.array([1.6, 0.0])), (8.0, np.array([3.0, 2.0]), np.array([0.0, 1.6]))
    times = np.linspace(0.0, 8.0, 801)
    found = compute_walk(times, before, after)
    speed = np.linalg.norm(np.diff(found, axis=0), axis=1) / 0.01
    assert np.mean(speed < 0.01) > 0.3 and compute_travel_time(before, after) < 6.0
    np.testing.assert_allclose(found[times == 6.0][0], [3.0, 2.0 - 0.5 * 1.6 * 1.6 / START_ACCELERATION], atol=1e-6)


def test_who_has_none_goes_straight_over():
    before, after = (0.0, np.zeros(2), STILL), (0.5, np.array([0.4, 0.0]), STILL)
    times = np.linspace(0.0, 0.5, 11)
    np.testing.assert_allclose(compute_walk(times, before, after), interpolate_quintic(times, before, after))


def test_hermite_meets_places_and_velocities():
    ends = (1.0, np.array([0.0, 1.0]), np.array([1.0, 0.0])), (2.5, np.array([2.0, -1.0]), np.array([0.0, -2.0]))
    step = 1e-5
    for time, place, velocity in ends:
        near = interpolate_quintic(np.array([time - step, time, time + step]), *ends)
        np.testing.assert_allclose(near[1], place, atol=1e-12)
        np.testing.assert_allclose((near[2] - near[0]) / (2 * step), velocity, atol=1e-6)
