"""The ball of a marker recording becomes the ball of its clip, with its release as the key moment."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from beyond_mocap.library.build import build_library
from beyond_mocap.library.folder.label_files import add_clip
from beyond_mocap.markers.files.marker_files import read_markers
from beyond_mocap.markers.reconstruct import ReconstructSettings, reconstruct
from beyond_mocap.markers.recorded_ball import trace_recorded_ball

pytest.importorskip("c3d")
SAMPLE = Path(__file__).resolve().parents[3] / "sample_blend"
RELEASE = 230.9  # frame in which `sample_blend/make_markers.py` lets the ball go


@pytest.fixture(scope="module")
def thrown():
    trial, static = (read_markers(SAMPLE / "markers" / name) for name in ("throw.c3d", "static.trc"))
    return reconstruct(trial, static, settings=ReconstructSettings(release="no"))


def test_the_marker_is_the_clips_ball_and_its_release_the_key_moment(thrown, tmp_path):
    ball, notes = trace_recorded_ball(thrown, on_floor=True)
    marker = thrown.raw.positions[:, thrown.raw.labels.index("BALL")]
    assert notes == () and np.allclose(ball.positions + [0.0, 0.0, thrown.floor], marker, equal_nan=True)
    early = (RELEASE - 24.0) / thrown.motion.fps
    add_clip(tmp_path, "throw", thrown.place_on_floor(), ("throwb",), early, ball)
    library = build_library(tmp_path, skeleton=tmp_path / "throw.bvh")
    clip, key = library.clips[0], library.keys[0]
    assert key.frame == pytest.approx(RELEASE, abs=0.02 * 240.0)
    away = (clip.ball - clip.motion.root_positions) - (ball.positions - thrown.place_on_floor().root_positions)
    assert np.nanmax(np.abs(away)) < 0.03 and np.isnan(clip.ball[-1]).all()


def test_markers_on_one_ball_are_one_and_the_nearer_of_two_balls_counts(thrown):
    raw, number = thrown.raw, thrown.raw.labels.index("BALL")
    others = raw.positions[:, [number]] + np.array([[0.2, 0.0, 0.0], [9.0, 0.0, 0.0]])
    several = replace(raw, labels=(*raw.labels, "BALL2", "BALL3"), residuals=None,
                      positions=np.concatenate([raw.positions, others], axis=1))
    ball, notes = trace_recorded_ball(replace(thrown, raw=several), on_floor=False)
    middle = raw.positions[:, number] + [0.1, 0.0, -thrown.lowered_by]
    assert np.allclose(ball.positions, middle, equal_nan=True)
    assert np.array_equal(ball.measured, ~np.isnan(middle[:, 0]))
    assert "2 balls (BALL+BALL2, BALL3): BALL+BALL2 is used" in notes[0]
    bare = replace(raw, labels=tuple("WAND" if one == "BALL" else one for one in raw.labels))
    assert trace_recorded_ball(replace(thrown, raw=bare), on_floor=False) == (None, ())
