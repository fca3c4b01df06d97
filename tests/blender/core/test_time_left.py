"""The time left of work: none is told before there is enough to tell from, it falls steadily, and it does not jump."""

import importlib

import pytest


@pytest.fixture
def time_left(extension):
    return importlib.import_module(f"{extension.__name__}.scene.core.time_left")


def list_seconds(time_left, shares, step=0.1):
    """Add a share every `step` seconds; list the seconds told."""
    left, told = time_left.TimeLeft(0.0), []
    for number, share in enumerate(shares, 1):
        left.add_share(share, number * step)
        told.append(left.compute_seconds(number * step))
    return told


def test_nothing_is_told_too_early(time_left):
    told = list_seconds(time_left, [n / 100 for n in range(1, 100)])
    assert told[:9] == [None] * 9 and told[9] == pytest.approx(9.0, abs=0.2)
    slow = list_seconds(time_left, [n / 1000 for n in range(1, 100)])
    assert all(value is None for value in slow[:49]) and slow[60] is not None


def test_steady_work_is_told_rightly_and_never_grows(time_left):
    told = [value for value in list_seconds(time_left, [n / 200 for n in range(1, 200)]) if value is not None]
    assert all(after <= before for before, after in zip(told, told[1:]))
    assert told[-1] == pytest.approx(1.0, abs=0.2)


def test_a_slow_stretch_makes_no_jump(time_left):
    shares = [n / 100 for n in range(1, 50)] + [0.49 + n / 1000 for n in range(1, 100)]
    told = [value for value in list_seconds(time_left, shares) if value is not None]
    assert max(after / before for before, after in zip(told, told[1:])) < 1.6


def test_work_in_parts_begins_again(time_left):
    left = time_left.TimeLeft(0.0)
    left.add_share(0.9, 9.0)
    assert left.describe(9.0) == "about 1 s left"
    left.add_share(0.01, 9.5)
    assert left.describe(9.5) == ""


def test_words(time_left):
    for share, text in ((0.5, "about 8 s left"), (0.2, "about 30 s left"), (0.05, "about 3 min left")):
        left = time_left.TimeLeft(0.0)
        left.add_share(share, 8.0 if share > 0.1 else 10.0)
        assert left.describe(8.0 if share > 0.1 else 10.0) == text
