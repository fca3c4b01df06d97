"""The baseline: one recording for each gait, nearest in speed, looped without a jump."""

import numpy as np

from beyond_mocap.library.build import build_library
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.resolve_plan import resolve_plan
from beyond_mocap.synthesis.search.gait_loops import LEAST_SECONDS, build_gait_loops, find_gait_loop
from beyond_mocap.synthesis.search.request import build_request


def test_each_gait_is_one_recording_that_loops(library, order, track_of):
    asked = order(track=track_of(lambda t: np.where(t < 6.0, 1.4, 2.9), 12.0), method="baseline")
    edit = build_gait_loops(library, asked)
    for gait in sorted(set(asked.gait)):
        first, end = find_gait_loop(library, asked, gait)
        shown = edit.frame[asked.gait == gait]
        assert set(edit.clip[asked.gait == gait]) == {library.frames.clip[first]} == {library.frames.clip[end]}
        assert first <= shown.min() and shown.max() < end and end - first >= LEAST_SECONDS * library.fps
        features = library.frames.features
        step = np.linalg.norm(np.diff(features[first : end + 1], axis=0), axis=1)
        assert np.linalg.norm(features[end] - features[first]) < np.median(step)  # it ends as it began
        assert library.gaits[gait].label in library.clips[library.frames.clip[first]].labels_at(0.0)


def list_looped(library, track) -> set[str]:
    request = build_request(library, resolve_plan(Plan(track=track, method="baseline"), library))
    return {library.clips[clip].path for clip in build_gait_loops(library, request).clip}


def test_of_several_recordings_the_nearest_in_speed_is_looped_that_belongs(clip_file, track_of, tmp_path):
    for speed in (1.1, 1.6):
        clip_file(tmp_path / f"walk_{speed:g}.bvh", speed, 4.0)
    library = build_library(tmp_path)
    for speed in (1.1, 1.6):
        assert list_looped(library, track_of(speed, 3.0)) == {f"walk_{speed:g}.bvh"}
    slow = np.array([clip.path == "walk_1.1.bvh" for clip in library.clips])[library.frames.clip]
    vars(library)["strangeness"] = np.where(slow, np.float32(2.0), library.strangeness)  # as of a crouch
    assert list_looped(library, track_of(1.1, 3.0)) == {"walk_1.6.bvh"}
    vars(library)["strangeness"] = np.full(len(library.frames), np.float32(2.0))  # a gait of crouches alone
    assert list_looped(library, track_of(1.1, 3.0)) == {"walk_1.1.bvh"}
