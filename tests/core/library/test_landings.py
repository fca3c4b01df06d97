"""Recordings that end in flight: completed on entry, told, kept apart from what was recorded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.evaluation.reference.reference_cache import load_reference
from beyond_mocap.files.bvh import bvh
from beyond_mocap.library.build import build_library
from beyond_mocap.library.clip import LANDING_FOLDER
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.resynthesize import resynthesize
from beyond_mocap.synthesis.synthesize import synthesize
from beyond_mocap.synthetic.moves import build_get_up


@pytest.fixture(scope="module")
def folder(tmp_path_factory, clip_file, dive_file):
    place = tmp_path_factory.mktemp("keeper")
    clip_file(place / "stand.bvh", 0.0, 5.0, "standing")
    clip_file(place / "walk.bvh", 1.4, 5.0, "walking")
    dive_file(place / "saves" / "dive.bvh")
    return place


@pytest.fixture(scope="module")
def keeper(folder):
    return build_library(folder)


def the_dive(library, mirrored=False):
    return next(clip for clip in library.clips if clip.path == "saves/dive.bvh" and clip.mirrored == mirrored)


def test_the_recording_is_kept_and_its_end_made_and_told(folder, keeper):
    clip, source = the_dive(keeper), bvh.read_bvh(folder / "saves" / "dive.bvh").motion
    assert clip.recorded_count == len(source) and len(clip.motion) > len(source) + 2.0 * clip.motion.fps
    assert np.allclose(clip.recording.rotations, source.rotations, atol=1e-5)
    assert any("1 clip ending in flight" in note and "no clip shows" in note for note in keeper.notes)
    others = [other for other in keeper.clips if other.path != clip.path]
    assert all(other.recorded_count is None and other.recording is other.motion for other in others)


def test_its_words_reach_to_the_end_and_say_what_is_made(keeper):
    clip = the_dive(keeper)
    key = next(row for row in clip.annotations if row.key is not None)
    assert set(key.words) == {"dive", "left", "high"} and key.end == len(clip.motion) - 1
    assert "getting_up" in clip.labels_at(len(clip.motion) - 1)
    assert "ground" in clip.labels_at(clip.recorded_count + 0.6 * clip.motion.fps)
    assert not clip.heel_toe_contacts[clip.recorded_count : clip.recorded_count + int(clip.motion.fps)].any()


def test_the_twin_is_completed_too(keeper):
    clip, twin = the_dive(keeper), the_dive(keeper, mirrored=True)
    assert twin.recorded_count == clip.recorded_count and len(twin.motion) == len(clip.motion)
    assert "right" in next(row for row in twin.annotations if row.key is not None).words


def test_what_is_made_is_a_file_of_its_own_with_the_same_frames(keeper):
    clip = the_dive(keeper)
    assert clip.source_at(clip.recorded_count - 1) == clip.path
    assert clip.source_at(clip.recorded_count - 0.5) == LANDING_FOLDER + clip.path
    kept = bvh.read_bvh(keeper.cache_location[0] / "made-landing" / clip.path).motion
    assert len(kept) == len(clip.motion)
    assert np.allclose(kept.root_positions, clip.motion.root_positions, atol=1e-4)


def test_the_cache_gives_the_same(folder, keeper):
    again = build_library(folder)
    assert [clip.recorded_count for clip in again.clips] == [clip.recorded_count for clip in keeper.clips]
    assert np.array_equal(again.frames.features, keeper.frames.features)


def test_a_library_that_gets_up_lends_its_way(folder, tmp_path, clip_file, dive_file, flight):
    clip_file(tmp_path / "walk.bvh", 1.4, 5.0, "walking")
    dive_file(tmp_path / "dive.bvh")
    up = build_get_up(flight.motion.skeleton, 50.0).motion
    bvh.write_bvh(tmp_path / "up.bvh", up)
    (tmp_path / "up.txt").write_text(f"0f {len(up) - 1}f getting_up back\n")
    library = build_library(tmp_path)
    assert any("the library's own clips" in note for note in library.notes)
    clip = next(clip for clip in library.clips if clip.path == "dive.bvh")
    assert {"getting_up", "back"} <= clip.labels_at(len(clip.motion) - 1)
    assert clip.motion.root_positions[-1, 2] == pytest.approx(up.root_positions[-1, 2], abs=0.03)
    assert clip.heel_toe_contacts[-1].all()


def test_own_scores_are_those_of_what_was_recorded(keeper):
    reference = load_reference(keeper, 30.0)
    clip = the_dive(keeper)
    row = reference.index[clip.path]
    assert (
        reference.first[row + 1] - reference.first[row] == int((clip.recorded_count - 1) / clip.motion.fps * 30.0
                                                               + 1e-6) + 1
    )
    assert LANDING_FOLDER + clip.path not in reference.index


def test_a_dive_is_played_to_its_feet_on_the_track(keeper, track_of, timeline_of):
    track = track_of(
        speed=lambda t: 2.2 * np.exp(-(((t - 5.0) / 0.4) ** 2)), seconds=11.0, turn=lambda t: 0.0 * t + 1.0
    )
    take = synthesize(keeper, Plan(track=track, timeline=timeline_of((5.0, "dive left")), made=False))
    sources = np.array(take.clips)[take.clip]
    played = np.flatnonzero(sources == LANDING_FOLDER + "saves/dive.bvh")
    assert (sources == "saves/dive.bvh").any() and len(played) > 60 and np.all(np.diff(played) == 1)
    assert take.clip_frame[played].min() > the_dive(keeper).recorded_count - 1
    assert any("synthetic landing" in warning for warning in take.warnings)
    heights = take.motion.root_positions[played, 2]
    assert heights.min() < 0.3 and heights[-1] > 0.8
    assert take.keys[0].clip == "saves/dive.bvh" and take.keys[0].frame == pytest.approx(150.0, abs=0.5)


def test_an_edit_far_from_a_dive_leaves_what_is_made_as_it_was(keeper, track_of, timeline_of):
    track = track_of(
        speed=lambda t: 2.2 * np.exp(-(((t - 5.0) / 0.4) ** 2)), seconds=24.0, turn=lambda t: 0.0 * t + 1.0
    )
    plan = Plan(track=track, timeline=timeline_of((5.0, "dive left")), made=False)
    before = synthesize(keeper, plan)
    after = resynthesize(keeper, replace(plan, timeline=timeline_of((5.0, "dive left"), (18.0, "dive right"))), before)
    sources = np.array(after.clips)[after.clip]
    at = sources == LANDING_FOLDER + "saves/dive.bvh"
    assert at[:300].sum() > 60 and at[500:].sum() > 60
    assert np.array_equal(before.motion.rotations[:400], after.motion.rotations[:400])
    assert np.array_equal(np.array(before.clips)[before.clip][:400], sources[:400])
