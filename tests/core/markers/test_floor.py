"""The floor is at height 0 unless markers of the feet say otherwise."""

import numpy as np
import pytest

from beyond_mocap.markers.files.marker_set_text import choose_set
from beyond_mocap.markers.model.assemble import build_model_from_frame
from beyond_mocap.markers.pose.residuals import OVER_SOLE, measure_floor
from beyond_mocap.synthetic.gait import build_gait
from beyond_mocap.synthetic.ground_truth.synthetic_markers import build_trial


@pytest.fixture(scope="module")
def known():
    return build_trial(build_gait(1.3, 1.0, 50.0), "plug_in_gait", seed=1)


@pytest.fixture(scope="module")
def model(known):
    frame = dict(zip(known.static.labels, known.static.positions.mean(axis=0)))
    return build_model_from_frame(frame, choose_set("plug_in_gait"))


def at_height(trial, height):
    """The trial with its lowest foot marker at this height, by the 2nd percentile."""
    feet = [trial.index_of(label) for label in ("LHEE", "RHEE", "LTOE", "RTOE")]
    now = np.percentile(np.nanmin(trial.positions[:, feet, 2], axis=1), 2)
    return trial.with_positions(trial.positions + [0.0, 0.0, height - now])


@pytest.mark.parametrize("height, floor", [
    (0.03, 0.0), (0.012, 0.0), (0.085, 0.0), (0.0, -OVER_SOLE), (-0.04, -0.04 - OVER_SOLE), (0.4, 0.4 - OVER_SOLE),
])
def test_the_floor_is_measured_by_the_lowest_foot_marker(known, model, height, floor):
    assert measure_floor(model, at_height(known.trial, height)) == pytest.approx(floor, abs=1e-6)


def test_without_markers_on_feet_it_is_at_zero(known, model):
    none = known.trial.select_markers(["C7", "CLAV", "LASI"])
    assert measure_floor(model, none) == 0.0
