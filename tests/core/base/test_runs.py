"""Runs of True, found where they begin and end."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from beyond_mocap.base.time_series import drop_short_runs, find_equal_runs, find_runs, number_runs


def test_runs_at_both_ends_and_between():
    assert find_runs(np.array([True, True, False, True, False, False, True])) == [(0, 2), (3, 4), (6, 7)]
    assert find_runs(np.zeros(4, bool)) == [] and find_runs(np.zeros(0, bool)) == [] and find_runs(np.ones(3,
            bool)) == [(0, 3)]
    assert drop_short_runs(np.array([True, True, False, True, False, True]), 2).tolist() == [True] * 2 + [False] * 4


@given(st.lists(st.booleans(), max_size=40))
def test_runs_make_up_the_flags_and_never_touch(flags):
    found, made = find_runs(np.array(flags, bool)), np.zeros(len(flags), bool)
    for first, end in found:
        made[first:end] = True
    assert made.tolist() == flags
    assert all(a[1] < b[0] for a, b in zip(found, found[1:]))


@given(st.lists(st.integers(0, 2), min_size=1, max_size=40))
def test_equal_runs_cover_all_values_and_numbers_tell_runs_apart(values):
    found = find_equal_runs(np.array(values))
    assert [values[first] for first, end in found for _ in range(first, end)] == values
    assert all(values[a[0]] != values[b[0]] for a, b in zip(found, found[1:]))
    numbers = number_runs(np.array(values) > 0)
    of_runs = [set(numbers[first:end].tolist()) for first, end in find_runs(np.array(values) > 0)]
    assert (numbers > 0).tolist() == [value > 0 for value in values]
    assert all(len(own) == 1 for own in of_runs) and len(set().union(*of_runs)) == len(of_runs)
