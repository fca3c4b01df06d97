"""A trial keeps what it is given, says what is wrong with it, and its parts are what they are called."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.markers.trial import MarkerEvent, MarkerTrial


def trial(**changes):
    """Five frames of three markers; marker 1 is not seen in frame 2."""
    positions = np.arange(45, dtype=float).reshape(5, 3, 3)
    positions[2, 1] = np.nan
    events = (MarkerEvent(2.3, "late"), MarkerEvent(2.1, "early", "left"))
    given = {"labels": ("A", "B", "C"), "positions": positions, "fps": 10, "start": 2.0, "events": events,
             "residuals": np.ones((5, 3)), **changes}  # fmt: skip
    return MarkerTrial(**given)


def test_a_trial_keeps_copies_that_cannot_be_changed():
    given = np.zeros((2, 1, 3))
    one = MarkerTrial(labels=("A",), positions=given, fps=50)
    given[:] = 1
    assert (one.positions == 0).all()
    with pytest.raises(ValueError):
        one.positions[0] = 1


def test_what_is_seen_and_when():
    one = trial()
    assert one.visibility.sum() == 14 and not one.visibility[2, 1]
    np.testing.assert_allclose(one.seconds, [2, 2.1, 2.2, 2.3, 2.4])
    assert one.duration == pytest.approx(0.4)
    assert [event.label for event in one.events] == ["early", "late"]


def test_parts_of_a_trial():
    one = trial()
    part = one.select_frames(1, 3)
    assert (len(part), part.start) == (2, pytest.approx(2.1))
    assert [event.label for event in part.events] == ["early"]
    two = one.select_markers(["C", "A"])
    assert two.labels == ("C", "A")
    np.testing.assert_array_equal(two.positions[:, 0], one.positions[:, 2])
    assert two.residuals.shape == (5, 2)
    assert one.rename_labels({"A": "LASI"}).labels == ("LASI", "B", "C")
    assert one.with_positions(one.positions + 1).residuals is not None
    assert one.with_positions(one.positions[:2]).residuals is None


@pytest.mark.parametrize("changes, said", [
    ({"labels": ("A", "B")}, "positions of shape"),
    ({"labels": ("A", "B", "A")}, "duplicate label 'A'"),
    ({"labels": ("A", "B", " ")}, "without a label"),
    ({"fps": 0}, "0 frames per second"),
    ({"fps": float("nan")}, "nan frames per second"),
    ({"start": float("inf")}, "starts at inf"),
    ({"residuals": np.ones((5, 2))}, "residuals of shape"),
    ({"positions": np.full((5, 3, 3), np.inf)}, "infinite"),
    ({"positions": [["a"]]}, "not numbers"),
])  # fmt: skip
def test_what_is_wrong_is_said(changes, said):
    with pytest.raises(InputError, match=said):
        trial(**changes)


def test_a_label_that_is_not_there_is_reported_with_what_is():
    with pytest.raises(InputError, match="no marker 'D'.*one of A, B, C"):
        trial().index_of("D")
    with pytest.raises(InputError, match="duplicate label 'B'"):
        trial().rename_labels({"A": "B"})
