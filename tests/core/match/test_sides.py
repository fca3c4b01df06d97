"""Capsules that go through each other part to one side, and their contacts press until nothing comes back at them."""

import numpy as np
import pytest

from beyond_mocap.match.crowd.capsules import Capsule, find_capsule_contacts
from beyond_mocap.match.crowd.correction import CURVES, ROOT
from beyond_mocap.match.crowd.crowd_body import CrowdBody, move_capsules
from beyond_mocap.match.crowd.separation import (
    MAX_PRESSURE,
    PRESSURE_STEP,
    Pressure,
    compute_separation,
    compute_sides,
    solve_separation,
    update_pressure,
)

FPS, RADIUS = 30.0, 0.1


def posts(places):
    """Upright lines of 1 m (T, 1, 2, 3) at places (T, 2) m."""
    foot = np.column_stack([places, np.zeros(len(places))])
    return np.stack([foot, foot + [0.0, 0.0, 1.0]], axis=1)[:, None]


def passing(miss, speed=2.4, count=41):
    """Two posts of which the one goes by the other `miss` metres beside it; and where the one is, (T, 2) m."""
    way = np.column_stack([speed * (np.arange(count) - count // 2) / FPS, np.full(count, miss)])
    return posts(way), posts(np.zeros((count, 2))), way


def contacts(miss):
    one, other, way = passing(miss)
    return find_capsule_contacts(one, other, (np.array([RADIUS]),) * 2), way


def test_who_goes_through_another_leaves_on_the_side_on_which_it_misses():
    """The shortest way is backwards before and forwards after the lines cross; both frames are to be left sideways."""
    found, _ = contacts(0.02)
    assert found.direction[0, 0] < -0.9 and found.direction[-1, 0] > 0.9
    side = compute_sides(found, np.zeros((len(found.frame), 3)), FPS)
    assert np.all(side[:, 1] > 0.0) and np.all(side[np.abs(found.frame - 20) <= 1, 1] > 0.6)


def test_sides_are_those_of_the_same_two_capsules_only():
    """A third capsule that passes on the other side at the same time keeps its own side."""
    one, other, way = passing(0.02)
    two = np.concatenate([one, posts(way - [0.0, 0.04])], axis=1)
    found = find_capsule_contacts(two, other, (np.full(2, RADIUS), np.array([RADIUS])))
    side = compute_sides(found, np.zeros((len(found.frame), 3)), FPS)
    at = found.frame == 20
    assert side[at & (found.one == 0), 1] > 0.9 and side[at & (found.one == 1), 1] < -0.9


def test_a_side_that_has_been_pressed_to_is_kept():
    found, _ = contacts(0.005)
    before = np.tile([0.0, -0.1, 0.0], (len(found.frame), 1))
    assert np.all(compute_sides(found, before, FPS)[:, 1] < 0.0)


def test_the_way_out_is_as_long_as_told():
    """Moved by it, the lines are as far from each other as they have to be, wherever the side is."""
    found, way = contacts(0.03)
    side = compute_sides(found, np.zeros((len(found.frame), 3)), FPS)
    trunks = np.tile([0.0, 1.0, 0.0], (len(way), 1))
    out, deep = compute_separation(found, side, trunks, 0.005)
    moved_to = np.column_stack([way, np.zeros(len(way))])[found.frame] + deep[:, None] * out
    assert np.linalg.norm(moved_to, axis=1) == pytest.approx(2 * RADIUS - 0.005)
    assert np.linalg.norm(out, axis=1) == pytest.approx(1.0)


def test_pressure_grows_while_distance_lacks_and_falls_where_there_is_room():
    pressure, keys, side = Pressure(), np.array([7, 3]), np.tile([0.0, 0.0, 1.0], (2, 1))
    before, _ = pressure.find_pressures(keys)
    now = update_pressure(before, np.array([0.1, -0.1]))
    assert now == pytest.approx([0.1 * PRESSURE_STEP, 0.0])
    pressure.update_pressures(keys, now, side, (0, 10))
    before, towards = pressure.find_pressures(np.array([3, 5, 7]))
    assert before == pytest.approx([0.0, 0.0, 0.1 * PRESSURE_STEP]) and towards[2, 2] == 1.0
    assert update_pressure(before[2:], np.array([-0.05])) == pytest.approx([0.05 * PRESSURE_STEP])
    assert update_pressure(before[2:], np.array([1e3])) == [MAX_PRESSURE]


def test_contacts_outside_a_span_keep_their_pressure():
    pressure, side = Pressure(), np.eye(3)
    pressure.update_pressures(np.array([2, 12, 22]), np.array([0.1, 0.2, 0.3]), side, (0, 30))
    pressure.update_pressures(np.array([14]), np.array([0.4]), side[:1], (10, 20))
    assert pressure.find_pressures(np.array([2, 12, 14, 22]))[0].tolist() == [0.1, 0.0, 0.4, 0.3]


def body(lines, firm=1.0):
    count, nothing = len(lines), np.zeros(lines.shape)
    return CrowdBody((Capsule(0, 1, RADIUS),), lines, nothing, np.zeros((count, 2), bool), np.full(count, firm))


def deepest(bodies, curves):
    placed = [move_capsules(*each) for each in zip(bodies, curves)]
    return find_capsule_contacts(*placed, (bodies[0].radii, bodies[1].radii)).depth.max(initial=0.0)


def still(bodies):
    return [np.zeros((len(own.lines), CURVES)) for own in bodies]


@pytest.mark.parametrize("speed", [2.4, 8.0])
def test_posts_that_run_through_each_other_come_apart(speed):
    """At 8 m/s they are in each other for a frame."""
    one, other, _ = passing(0.02, speed, 91)
    bodies = [body(one), body(other)]
    assert deepest(bodies, still(bodies)) > 0.15
    curves = solve_separation(bodies, [(0, 1)], still(bodies), [Pressure()], [(True, True)] * 2, FPS)
    assert deepest(bodies, curves) < 0.01
    assert all(np.abs(np.diff(own[:, ROOT], 2, axis=0)).max() * FPS**2 < 20.0 for own in curves)


def test_two_who_both_keep_their_way_come_apart_all_the_same():
    """However stiff both are, what is left is pressed for until it is gone."""
    one, other, _ = passing(0.02, 2.4, 91)
    bodies, pressure, held = [body(one, 25.0), body(other, 25.0)], [Pressure()], [(True, True)] * 2
    curves = still(bodies)
    for _ in range(5):
        curves = solve_separation(bodies, [(0, 1)], curves, pressure, held, FPS)
    assert deepest(bodies, curves) < 0.02


def test_a_second_pass_goes_on_from_the_first():
    """It begins where the first ended: nobody falls back into the other in between."""
    one, other, _ = passing(0.02, 2.4, 91)
    bodies, pressure, held = [body(one), body(other)], [Pressure()], [(True, True)] * 2
    first = solve_separation(bodies, [(0, 1)], still(bodies), pressure, held, FPS)
    again = solve_separation(bodies, [(0, 1)], first, pressure, held, FPS)
    assert deepest(bodies, again) < 0.008
    assert np.abs(again[0] - first[0]).max() < 0.02
