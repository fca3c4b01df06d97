"""The end of a path: stop, begin again, go round; lengths that are none."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.path_editing.path_time import find_ending

FPS = 30.0
ARC = 0.05 * np.arange(100)  # 4.95 m


def test_a_longer_path_changes_nothing():
    for length in (4.95, 4.9495, 8.0):
        out = find_ending(ARC, length, FPS, "repeat")
        assert out.count == 100 and np.array_equal(out.displayed,
                                                   np.arange(100)) and not len(out.restarts) and not out.messages


def test_stopping_cuts_at_the_path_s_end():
    out = find_ending(ARC, 2.01, FPS)
    assert out.count == 41 and np.array_equal(out.displayed, np.arange(41)) and ARC[out.displayed[-1]] <= 2.01
    assert "ends after 1.4 s" in out.messages[0] and out.messages[0].spans


def test_a_frame_or_two_that_are_missing_are_not_told():
    out = find_ending(ARC, 4.86, FPS)
    assert out.count == 98 and not out.messages


def test_repeating_begins_again_with_motion_and_path():
    out = find_ending(ARC, 2.01, FPS, "repeat")
    assert out.count == 41 and len(out.displayed) == 100
    assert out.restarts.tolist() == [41, 82] and np.array_equal(out.displayed[41:82], np.arange(41))
    assert np.array_equal(out.displayed[82:], np.arange(18))
    assert "restarts 2 times" in out.messages[0] and "restarts once" in find_ending(ARC, 3.0, FPS, "repeat").messages[0]


def test_a_rider_waits_once_only():
    waits = np.concatenate([np.zeros(30), ARC])
    out = find_ending(waits, 2.01, FPS, "repeat")
    assert out.count == 71 and out.restarts[0] == 71
    assert np.array_equal(out.displayed[71:112], np.arange(30, 71))


def test_a_closed_path_has_no_end():
    for end in ("stop", "repeat"):
        out = find_ending(ARC, 2.0, FPS, end, closed=True)
        assert out.count == 100 and not len(out.restarts) and not out.messages


def test_a_path_shorter_than_a_step_is_told_and_never_repeated():
    for end in ("stop", "repeat"):
        out = find_ending(ARC, 0.12, FPS, end)
        assert out.count == 3 and len(out.displayed) == 3 and any("less than a step" in line for line in out.messages)
    assert "less than a step" in find_ending(ARC, 0.3, FPS, closed=True).messages[0]


def test_standing_still_reaches_no_end():
    assert find_ending(np.zeros(50), 1.0, FPS, "repeat").count == 50


@pytest.mark.parametrize("length", [0.0, -2.0, np.nan])
def test_a_path_without_length_is_refused(length):
    with pytest.raises(InputError, match="no length"):
        find_ending(ARC, length, FPS)
