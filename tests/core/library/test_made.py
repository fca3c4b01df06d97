"""Made running above the recordings' speed: offered only where the track asks for it, and told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.library.library import build
from beyond_mocap.library.made import MADE_FOLDER, made_clips
from beyond_mocap.motion.gait import gait
from beyond_mocap.motion.track import Track
from beyond_mocap.plan import Plan
from beyond_mocap.synthesize import synthesize


def straight(speed: float, seconds: float = 6.0) -> Track:
    times = np.arange(0.0, seconds, 0.1)
    return Track(times, np.stack([speed * times, 0.0 * times], axis=1))


@pytest.fixture(scope="module")
def fast(library):
    return library.extended


def test_made_clips_reach_from_the_fastest_recording_to_a_sprint(library):
    clips = made_clips(library.skeleton, gait(4.0, 2.0, 60.0, library.skeleton), 4.0)
    speeds = [np.linalg.norm(np.diff(m.root_positions[:, :2], axis=0), axis=1).mean() * m.fps for _, m, _ in clips]
    assert min(speeds) == pytest.approx(3.8, abs=0.3) and max(speeds) > 8.0
    assert all(name.startswith(MADE_FOLDER) for name, _, _ in clips)


def test_no_made_clips_where_recordings_are_as_fast(library):
    assert made_clips(library.skeleton, gait(4.0, 2.0, 60.0, library.skeleton), 10.0) == []


def test_the_recordings_come_first_and_unchanged(library, fast):
    count = len(library.frames)
    assert fast.clips[: len(library.clips)] == library.clips
    assert np.array_equal(fast.frames.features[:count], library.frames.features)
    for column, word in enumerate(library.frames.vocabulary):
        there = fast.frames.vocabulary.index(word)
        assert np.array_equal(fast.frames.words[:count, there], library.frames.words[:, column])


def test_kept_beside_the_cache_and_read_back_the_same(library, fast):
    place = library.kept[0]
    assert (place / "made.npz").is_file() and list((place / "made-gait").glob("*.bvh"))
    again = build(library.folder, cache_dir=place).extended
    assert np.array_equal(again.frames.features, fast.frames.features)


def test_a_slow_track_uses_recordings_only(library):
    take = synthesize(library, Plan(track=straight(2.0)))
    assert not any(name.startswith(MADE_FOLDER) for name in take.clips)


def test_a_track_beyond_the_recordings_is_played_by_made_running_and_told(library):
    plan = Plan(track=straight(min(1.5 * library.fastest, 9.0)))
    take = synthesize(library, plan)
    assert any(name.startswith(MADE_FOLDER) for name in take.clips)
    assert any("made running" in warning for warning in take.warnings)
    without = synthesize(library, replace(plan, made=False))
    assert not any(name.startswith(MADE_FOLDER) for name in without.clips)
