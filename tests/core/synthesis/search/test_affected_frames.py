"""What an edit touches, in frames: no more than it has to, and never half a key moment."""

import numpy as np
import pytest

from beyond_mocap.synthesis.search.affected_frames import (
    RUN_UP,
    find_changed_frames,
    find_moved_frames,
    find_stretches_to_search,
    list_stretches,
    list_unchanged_keys,
)
from beyond_mocap.synthesis.search.candidate_index import SLOT
from beyond_mocap.synthesis.search.path_search import PathSearch


@pytest.fixture(scope="module")
def long(track_of):
    return track_of(1.4, seconds=20.0)


@pytest.fixture(scope="module")
def searched(library, order, long):
    """searched(*lines, track) -> (order, edit list)."""

    def make(*lines, track=long):
        asked = order(*lines, track=track)
        return asked, PathSearch(library, asked).run()

    return make


def test_nothing_changed_nothing_touched(library, searched):
    asked, edit = searched((10.0, "kick"))
    assert not find_moved_frames(asked, asked).any() and not find_changed_frames(asked, asked, SLOT).any()
    assert find_stretches_to_search(library, edit, asked, asked, SLOT) == []
    assert list_unchanged_keys(edit, asked, asked) == edit.keys


def test_a_moved_key_moment_touches_both_places_and_a_run_up(library, order, searched, long):
    before, edit = searched((10.0, "kick right"))
    after = order((10.4, "kick right"), track=long)
    (first, end), = find_stretches_to_search(library, edit, before, after, SLOT)
    assert 7.0 * 30 < first < (10.0 - RUN_UP) * 30 and (10.4 + RUN_UP) * 30 < end < 13.5 * 30
    assert list_unchanged_keys(edit, before, after) == ()


def test_a_key_moment_that_stays_is_gone_round(library, order, searched, long):
    """Its clip begins within the run-up of the change, so the stretch ends before it."""
    before, edit = searched((4.0, 7.0, "walking"), (9.0, "kick right"))
    after = order((4.0, 7.0, "jogging"), (9.0, "kick right"), track=long)
    (first, end), = find_stretches_to_search(library, edit, before, after, SLOT)
    kick, = list_unchanged_keys(edit, before, after)
    rate = 30.0 / library.clips[kick.key.clip].motion.fps
    assert first < 4.0 * 30 and 7.0 * 30 <= end <= 270 - np.floor((kick.key.frame - kick.key.start) * rate) + 1


def test_the_kept_keys_have_their_new_numbers(order, searched, long):
    before, edit = searched((5.0, "kick right"), (15.0, "kick left"))
    after = order((15.0, "kick left"), track=long)
    kept, = list_unchanged_keys(edit, before, after)
    assert kept.number == 0 and kept.key == edit.keys[1].key


def test_a_key_moment_asked_twice_is_as_it_was(library, searched):
    asked, edit = searched((10.0, "kick right"), (10.0, "kick right"))
    assert len(edit.keys) == 1
    assert find_stretches_to_search(library, edit, asked, asked, SLOT) == [] and list_unchanged_keys(edit, asked,
            asked) == edit.keys


def test_faster_is_another_thing_to_ask_for_and_elsewhere_is_not(order, long, track_of):
    before = order(track=long)
    aside = type(long)(long.times, long.positions + [0.0, 0.5])
    faster = track_of(lambda t: 1.4 + 0.3 * (t > 10.0), seconds=20.0)
    assert find_moved_frames(before, order(track=aside)).all()
    assert not find_changed_frames(before, order(track=aside), SLOT).any()
    off = np.flatnonzero(find_changed_frames(before, order(track=faster), SLOT))
    assert 270 < off[0] < 300 and off[-1] == 600


def test_a_key_moment_is_touched_where_its_ball_lies_elsewhere(library, order, track_of):
    track = track_of(1.4, seconds=20.0, ball=True)
    before = order((10.0, "kick right"), track=track)
    edit = PathSearch(library, before).run()
    for moved, touched in ((0.05, False), (0.4, True)):
        ball = track.ball + np.where(np.abs(track.times - 10.0) < 0.3, moved, 0.0)[:, None] * [0.0, 1.0, 0.0]
        after = order((10.0, "kick right"), track=type(track)(track.times, track.positions, ball))
        assert bool(find_stretches_to_search(library, edit, before, after,
                                             SLOT)) == touched == (not list_unchanged_keys(edit, before, after))


def test_stretches_near_each_other_are_one():
    touched = np.zeros(50, bool)
    touched[[3, 4, 8, 30]] = True
    assert list_stretches(touched, 5) == [(3, 9), (30, 31)] and list_stretches(touched, 2) == [(3, 5), (8, 9), (30, 31)]
    assert list_stretches(np.zeros(4, bool), 3) == []
