"""Bodies kept apart, against what has to be done at least, worked out by hand; to a centimetre or so."""

import numpy as np
import pytest

from beyond_mocap.motion.path.arc_length import ArcLength
from beyond_mocap.path_editing.collision_avoidance import resolve_collisions
from beyond_mocap.path_editing.collisions import find_collisions
from beyond_mocap.path_editing.detour import Follower, PathChange, add_detours
from beyond_mocap.path_editing.path_line import fit_line
from beyond_mocap.path_editing.remedies import Limits

FPS = 30.0


def line(start, end):
    return fit_line(np.linspace((*start, 0.0), (*end, 0.0), 11), "line")


def walker(path, speed=1.5, seconds=13.0, ahead=0.0, name="walker"):
    """Someone who walks along a path at a constant speed, from `ahead` metres on."""
    times, length = np.arange(int(seconds * FPS) + 1) / FPS, ArcLength(path)
    arc = np.minimum(ahead + speed * times, length.length)
    return Follower(name=name, times=times, places=path.at(length.parameter_at(arc)), path=path, arc=arc)


def ridden(follower, change):
    """The same walk on the path with its detours, as `ride` lays it: by arc length, later by the wait."""
    path = add_detours(follower.path, change.detours)
    length = ArcLength(path)
    times = np.arange(int((follower.times[-1] + 2.0) * FPS) + 1) / FPS
    arc = np.interp(times - change.delay, follower.times, follower.arc)
    return path.at(length.parameter_at(arc))


def assert_apart(followers, resolution, distance=0.6):
    """The real paths with detours keep them apart, not only the search's own reckoning."""
    assert resolution.unresolved == ()
    places = np.stack([ridden(*both) for both in zip(followers, resolution.changes)])
    assert find_collisions(np.arange(places.shape[1]) / FPS, places, distance - 0.005) == []


EAST, WEST, NORTH = line((-10, 0), (10, 0)), line((10, 0), (-10, 0)), line((0, -10), (0, 10))


def test_nothing_happens_to_those_who_do_not_meet():
    followers = [walker(EAST), walker(line((-10, 3), (10, 3)))]
    assert resolve_collisions(followers).changes == (PathChange(), PathChange())


def test_head_on_each_goes_to_the_own_right_by_half():
    followers = [walker(EAST), walker(WEST)]
    found = resolve_collisions(followers)
    assert_apart(followers, found)
    for change in found.changes:
        assert change.delay == 0.0
        [(arc, _, offset)] = change.detours
        assert arc == pytest.approx(10.0, abs=0.05)
        assert -0.32 < offset < -0.3


def test_head_on_but_already_to_the_left_they_pass_on_the_left():
    followers = [walker(line((-10, 0.15), (10, 0.15))), walker(line((10, -0.15), (-10, -0.15)))]
    found = resolve_collisions(followers)
    assert_apart(followers, found)
    assert [change.detours[0][2] for change in found.changes] == pytest.approx([0.155, 0.155], abs=0.01)


def test_crossing_at_a_right_angle_one_waits_for_as_long_as_it_takes():
    followers = [walker(EAST), walker(NORTH)]
    found = resolve_collisions(followers)
    assert_apart(followers, found)
    assert sorted(change.delay for change in found.changes) == pytest.approx([0.0, 0.6 * np.sqrt(2) / 1.5], abs=0.02)
    assert not any(change.detours for change in found.changes)


def test_where_waiting_is_dear_they_go_round_each_other():
    followers = [walker(EAST), walker(NORTH)]
    found = resolve_collisions(followers, Limits(delay_cost=10.0))
    assert_apart(followers, found)
    assert not any(change.delay for change in found.changes)
    assert all(change.detours for change in found.changes)


def test_three_at_one_crossing_pass_one_after_the_other():
    half = 10.0 / np.sqrt(2)
    followers = [walker(EAST), walker(NORTH), walker(line((-half, -half), (half, half)))]
    found = resolve_collisions(followers)
    assert len(found.before) == 3
    assert_apart(followers, found)
    assert sum(change.delay for change in found.changes) < 1.4


def test_those_who_start_on_one_spot_and_part_only_step_aside_there():
    followers = [walker(line((0, 0), (10, 0)), seconds=6.0), walker(line((0, 0), (0, 10)), seconds=6.0)]
    found = resolve_collisions(followers)
    assert_apart(followers, found)
    aside = [abs(offset) for change in found.changes for _, _, offset in change.detours]
    assert 0.6 <= sum(aside) < 0.65


@pytest.mark.parametrize("ahead, aside", [(0.0, 0.3), (0.3, np.sqrt(0.27) / 2)])
def test_those_who_walk_the_same_path_together_walk_side_by_side(ahead, aside):
    followers = [walker(EAST, seconds=12.0), walker(EAST, ahead=ahead, seconds=12.0)]
    found = resolve_collisions(followers)
    assert_apart(followers, found)
    sides = [{offset for _, _, offset in change.detours} for change in found.changes]
    assert all(len(side) == 1 for side in sides)
    assert sorted(side.pop() for side in sides) == pytest.approx([-aside, aside], abs=0.02)


def test_who_follows_too_closely_further_on_waits():
    """A bend in the way of the second lets both walk one line from there on, 0.3 m apart."""
    first = walker(line((0, 0), (12, 0)), seconds=8.0, ahead=3.3)
    second = walker(fit_line(np.array([[3.0, -3, 0], [3.0, -0.5, 0], [3.5, 0, 0], [15.0, 0, 0]]), "bend"), seconds=8.0)
    first = Follower(name="first", times=first.times, places=first.places, path=first.path, arc=first.arc)
    found = resolve_collisions([first, second])
    assert_apart([first, second], found)


def test_a_post_in_the_way_is_gone_round():
    post = Follower(name="post", times=np.array([0.0, 1.0]), places=np.zeros((2, 3)))
    found = resolve_collisions([walker(EAST), post])
    assert found.unresolved == () and found.changes[1] == PathChange()
    [(arc, _, offset)] = found.changes[0].detours
    assert arc == pytest.approx(10.0, abs=0.1)
    assert -0.63 < offset <= -0.6


def test_posts_that_touch_are_nobodys_concern():
    posts = [Follower(name=name, times=np.array([0.0, 1.0]), places=np.zeros((2, 3))) for name in "ab"]
    found = resolve_collisions([*posts, walker(line((-10, 5), (10, 5)))])
    assert found.before == found.unresolved == ()


def test_what_cannot_be_mended_is_told_and_the_rest_is_mended():
    stand = {f"post {y}": np.tile([0.0, y, 0.0], (2, 1)) for y in np.arange(-2, 2.1, 0.5)}
    wall = [Follower(name=name, times=np.array([0.0, 1.0]), places=places) for name, places in stand.items()]
    away = [walker(line((-10, 20), (10, 20))), walker(line((10, 20), (-10, 20)))]
    found = resolve_collisions([walker(EAST), *away, *wall])
    assert {collision.first for collision in found.unresolved} == {0}
    assert min(collision.gap for collision in found.unresolved) <= 0.25 + 1e-6  # between two posts at best
    assert found.changes[1].detours and found.changes[2].detours


def test_limits_are_kept():
    followers = [walker(EAST), walker(WEST)]
    found = resolve_collisions(followers, Limits(detour=0.2, delay=0.5))
    assert len(found.unresolved) == 1
    for change in found.changes:
        assert change.delay <= 0.5 and all(abs(offset) <= 0.2 for _, _, offset in change.detours)


def test_mending_one_collision_makes_no_other():
    """To the right of each there is someone who comes along as well."""
    followers = [walker(EAST), walker(WEST), walker(line((-10, -0.7), (10, -0.7)))]
    found = resolve_collisions(followers)
    assert_apart(followers, found)


def test_round_and_round_a_closed_path_and_through_it():
    angle = np.linspace(0, 2 * np.pi, 181)
    ring = fit_line(3.0 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1), "ring", closed=True)
    length, times = ArcLength(ring), np.arange(901) / FPS
    arc = 1.5 * times
    around = Follower(name="around", times=times, places=ring.at(length.parameter_at(arc % length.length)), path=ring,
                      arc=arc)
    post = Follower(name="post", times=np.array([0.0, 1.0]), places=np.tile([-3.0, 0.1, 0.0], (2, 1)))
    found = resolve_collisions([around, post])
    assert len(found.before) == 2 and found.unresolved == ()
    assert len(found.changes[0].detours) == 1


def test_the_same_bodies_get_the_same_changes():
    def crowd():
        rng = np.random.default_rng(5)
        return [walker(line(rng.uniform(-9, 9, 2), rng.uniform(-9, 9, 2)), rng.uniform(1, 2), 8.0) for _ in range(14)]

    first, again = resolve_collisions(crowd()), resolve_collisions(crowd())
    assert first.before and first == again


def test_a_mended_set_needs_no_more():
    followers = [walker(EAST), walker(NORTH), walker(WEST)]
    found = resolve_collisions(followers)
    assert resolve_collisions(followers, changes=found.changes).changes == found.changes
