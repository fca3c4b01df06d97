"""Runs of True, found where they begin and end."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from beyond_mocap.motion.runs import runs


def test_runs_at_both_ends_and_between():
    assert runs(np.array([True, True, False, True, False, False, True])) == [(0, 2), (3, 4), (6, 7)]
    assert runs(np.zeros(4, bool)) == [] and runs(np.zeros(0, bool)) == [] and runs(np.ones(3, bool)) == [(0, 3)]


@given(st.lists(st.booleans(), max_size=40))
def test_runs_make_up_the_flags_and_never_touch(flags):
    found, made = runs(np.array(flags, bool)), np.zeros(len(flags), bool)
    for first, end in found:
        made[first:end] = True
    assert made.tolist() == flags
    assert all(a[1] < b[0] for a, b in zip(found, found[1:]))
