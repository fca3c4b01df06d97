"""What is said of standing toes that slide fits the figures beside it."""

import re
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.markers.reconstruction_figures import describe_foot_slide
from beyond_mocap.synthetic.gait import build_gait


@pytest.mark.parametrize("speed, drift, is_planted, said", [
    (1.3, 0.0, True, None), (1.3, 0.2, True, "96 mm.*4 of 5 stances move further than the 25 mm.*check their markers"),
    (7.0, 0.2, True, "14 mm.* 27 cm/s.*no stance moves further than the 25 mm.*as in a sprint"),
    (7.0, 0.2, False, "14 mm.*: use Plant Feet"),
])
def test_the_reason_fits_the_figures(speed, drift, is_planted, said):
    gait = build_gait(speed, 2.0, 100.0)
    move = np.arange(len(gait))[:, None] * np.array([drift / gait.fps, 0.0, 0.0])
    lines = describe_foot_slide(replace(gait, root_positions=gait.root_positions + move), is_planted)
    assert len(lines) == (said is not None)
    assert all(re.search(said, line) for line in lines)
