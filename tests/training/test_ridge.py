"""Which examples are left out while the ridge is chosen, and which ridge is taken."""

from types import SimpleNamespace

import numpy as np
import pytest

from beyond_mocap.base.errors import UserCancelledError
from training import train
from training.networks import RIDGES


def examples(*subjects):
    """Stand-ins, each with its mirror image, by subject."""
    return [SimpleNamespace(name=f"clip {i}", subject=subject, release=3.0 + i)
            for i, subject in enumerate(subjects) for _ in range(2)]  # fmt: skip


def test_the_last_subject_is_left_out_whole():
    assert train.select_held_out(examples("a", "b", "a", "c")).tolist() == [False] * 6 + [True] * 2


def test_of_one_subject_a_fourth_is_left_out_with_its_mirror_images():
    assert np.flatnonzero(train.select_held_out(examples(*"aaaaaaaaa"))).tolist() == [6, 7, 14, 15]
    assert not train.select_held_out(examples(*"aaa")).any()


class Straying:
    """A problem whose networks stray as told by ridge."""

    def __init__(self, off):
        self.off = dict(zip(RIDGES, off))

    def fit_linear(self, ridge, use_held_out=True):
        assert not use_held_out
        return self.off[ridge]

    def build_weights(self, key, linear):
        return linear


@pytest.mark.parametrize("off, expected", [
    ([9, 5, 1, 3, 4, 5], RIDGES[2]),
    ([9, 5, 1, 1.03, 1.2, 5], RIDGES[3]),
    ([np.inf] * 6, RIDGES[-1]),
    ([1, 1, 1, 1, 1, 1], RIDGES[-1]),
])
def test_the_largest_ridge_of_the_best_is_taken(monkeypatch, off, expected):
    monkeypatch.setattr(train, "_measure_error", lambda model, example: model)
    held = examples("a")
    assert train.choose_ridge(Straying(off), held, lambda params, line: params) == expected


def test_nothing_left_out_and_cancelled():
    assert train.choose_ridge(None, [], None) == RIDGES[-1]
    with pytest.raises(UserCancelledError):
        train.choose_ridge(Straying([1] * 6), examples("a"), lambda params, line: params, lambda: True)
