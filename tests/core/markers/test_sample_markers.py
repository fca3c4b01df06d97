"""The sample's optical recordings say what was made."""

import sys
from pathlib import Path

import numpy as np
import pytest

from beyond_mocap.markers.files.marker_files import read_markers

SAMPLE = Path(__file__).resolve().parents[3] / "sample_blend"
sys.path.insert(0, str(SAMPLE))
make_markers = pytest.importorskip("make_markers")
pytest.importorskip("c3d")


@pytest.mark.filterwarnings("ignore:No analog data")
def test_sample_is_what_its_script_makes(tmp_path):
    make_markers.write_recordings(tmp_path)
    for name in ("static.trc", "throw.c3d", "walk.trc"):
        kept, made = read_markers(SAMPLE / "markers" / name), read_markers(tmp_path / name)
        assert kept.labels == made.labels and kept.fps == made.fps
        np.testing.assert_allclose(kept.positions, made.positions, atol=1e-5)


def test_throw_is_read_as_it_was_planted():
    known = make_markers.generate_throw()
    trial = read_markers(SAMPLE / "markers" / "throw.c3d")
    first = int(known.ball.request.release * known.trial.fps) - 230
    truth = known.trial.select_frames(first, first + len(trial))
    assert trial.labels == truth.labels
    np.testing.assert_array_equal(trial.visibility, truth.visibility)
    np.testing.assert_allclose(trial.positions, truth.positions, atol=1e-6)
