"""What a library's clips are, one by one: words, length, speed, quality."""

import numpy as np
import pytest

from beyond_mocap.library import listing
from beyond_mocap.library.build import build_library


def test_recordings_are_listed_with_words_length_and_speed(clips_folder, tmp_path):
    library = build_library(clips_folder, cache_dir=tmp_path)
    found = listing.list_clips(library)
    originals = [clip for clip in library.clips if not clip.mirrored]
    assert [one.path for one in found] == [clip.path for clip in originals]
    for one, clip in zip(found, originals):
        assert set(one.labels) == {word for row in clip.annotations for word in row.words}
        assert one.seconds == pytest.approx(clip.recording.duration)
        assert 0.0 <= one.speed <= one.max_speed < 10.0
        assert one.grade in (listing.GOOD, listing.FAIR, listing.POOR)
        assert one.details[0].startswith("foot slide: ")


def test_the_same_from_the_cache(clips_folder, tmp_path):
    first = listing.list_clips(build_library(clips_folder, cache_dir=tmp_path))
    assert listing.list_clips(build_library(clips_folder, cache_dir=tmp_path)) == first


def test_a_folder_is_listed_without_reading_motions(clips_folder, tmp_path):
    built = {one.path: one for one in listing.list_clips(build_library(clips_folder, cache_dir=tmp_path))}
    for one in listing.scan_clips(clips_folder):
        assert one.labels == built[one.path].labels and one.key_moments == built[one.path].key_moments
        assert one.seconds == pytest.approx(built[one.path].seconds, abs=0.02)
        assert np.isnan(one.speed) and one.grade == listing.UNKNOWN


def test_sliding_feet_and_a_drifting_floor_are_marked(clips_folder, tmp_path):
    from dataclasses import replace

    library = build_library(clips_folder, cache_dir=tmp_path)
    clip = library.clips[0]
    assert listing._grade_clip(clip, 1.0, 1.0)[0] == listing.GOOD
    for change, mark, line in (({"slides": 0.15, "slid": 0.4}, listing.FAIR, "foot slide: 15 cm/s (file: 40)"),
                               ({"slides": 0.5}, listing.POOR, "foot slide: 50 cm/s"),
                               ({"drift": 0.5}, listing.POOR, "floor levelled: 50 cm"),
                               ({"pops": 3}, listing.GOOD, "jumps removed: 3")):
        mended = replace(clip.repair_figures, **{"slid": 0.0, "slides": 0.0, "drift": 0.0, "pops": 0, **change})
        found = listing._grade_clip(replace(clip, repair_figures=mended), 1.0, 1.0)
        assert found[0] == mark and line in found[1]
    assert listing._grade_clip(clip, 1.0, 9.0)[0] == listing.POOR
