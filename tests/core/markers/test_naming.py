"""A trial under its set's names: aliases, and unlabeled markers that are numbered anew in every trial."""

import numpy as np
import pytest

from beyond_mocap.markers.model.marker_set import MarkerSet, convert_labels
from beyond_mocap.markers.trial import MarkerTrial

SET = MarkerSet(
    "mine", {"LeftForeArm": ("LWR",), "RightForeArm": ("RWR",), "LeftHand": ("LHAND",), "RightHand": ("RHAND",)},
    aliases={"x52": "LHAND", "x53": "RHAND", "LWRIST": "LWR"}, optional=frozenset({"LHAND", "RHAND"}),
)


def trial_of(labels):
    """Wrists half a metre to the left and right, x52 beside the left one."""
    there = {"LWRIST": 0.5, "LWR": 0.5, "RWR": -0.5, "x52": 0.56, "x53": -0.56, "LHAND": 0.56, "RHAND": -0.56}
    positions = np.zeros((20, len(labels), 3))
    positions[:, :, 1] = [there[label] for label in labels]
    positions[:, :, 0] = np.arange(20)[:, None] * 0.01
    return MarkerTrial(labels=tuple(labels), positions=positions, fps=100.0)


def test_other_names_become_the_sets_own():
    assert convert_labels(trial_of(("LWRIST", "RWR")), SET).labels == ("LWR", "RWR")


@pytest.mark.parametrize("exchanged", [False, True])
def test_unlabeled_markers_go_to_the_side_they_move_with(exchanged):
    trial = trial_of(("LWR", "RWR", "x52", "x53"))
    if exchanged:
        trial = trial.rename_labels({"x52": "x53", "x53": "x52"})
    out = convert_labels(trial, SET)
    assert out.positions[0, out.index_of("LHAND"), 1] > 0 > out.positions[0, out.index_of("RHAND"), 1]


def test_what_has_a_name_keeps_it():
    trial = trial_of(("LWR", "RWR", "RHAND", "LHAND")).rename_labels({"LHAND": "RHAND", "RHAND": "LHAND"})
    assert convert_labels(trial, SET).labels == trial.labels
