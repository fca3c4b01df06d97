"""What a library's clips are, one by one: words, length, speed, quality."""

import numpy as np
import pytest

from beyond_mocap.library import listing
from beyond_mocap.library.build import build


def test_recordings_are_listed_with_words_length_and_speed(clips_folder, tmp_path):
    library = build(clips_folder, cache_dir=tmp_path)
    found = listing.listed(library)
    originals = [clip for clip in library.clips if not clip.mirrored]
    assert [one.path for one in found] == [clip.path for clip in originals]
    for one, clip in zip(found, originals):
        assert set(one.words) == {word for row in clip.annotations for word in row.words}
        assert one.seconds == pytest.approx(clip.recording.duration)
        assert 0.0 <= one.speed <= one.fastest < 10.0
        assert one.mark in (listing.GOOD, listing.FAIR, listing.POOR)
        assert one.told[0].startswith("feet slide: ")


def test_the_same_from_the_cache(clips_folder, tmp_path):
    first = listing.listed(build(clips_folder, cache_dir=tmp_path))
    assert listing.listed(build(clips_folder, cache_dir=tmp_path)) == first


def test_a_folder_is_listed_without_reading_motions(clips_folder, tmp_path):
    built = {one.path: one for one in listing.listed(build(clips_folder, cache_dir=tmp_path))}
    for one in listing.scanned(clips_folder):
        assert one.words == built[one.path].words and one.moments == built[one.path].moments
        assert one.seconds == pytest.approx(built[one.path].seconds, abs=0.02)
        assert np.isnan(one.speed) and one.mark == listing.UNKNOWN


def test_sliding_feet_and_a_drifting_floor_are_marked(clips_folder, tmp_path):
    from dataclasses import replace

    library = build(clips_folder, cache_dir=tmp_path)
    clip = library.clips[0]
    assert listing._quality(clip, 1.0, 1.0)[0] == listing.GOOD
    for change, mark, line in (({"slides": 0.15, "slid": 0.4}, listing.FAIR, "feet slide: 15 cm/s (file: 40)"),
                               ({"slides": 0.5}, listing.POOR, "feet slide: 50 cm/s"),
                               ({"drift": 0.5}, listing.POOR, "floor levelled: 50 cm"),
                               ({"pops": 3}, listing.GOOD, "jumps removed: 3")):
        mended = replace(clip.mended, **{"slid": 0.0, "slides": 0.0, "drift": 0.0, "pops": 0, **change})
        found = listing._quality(replace(clip, mended=mended), 1.0, 1.0)
        assert found[0] == mark and line in found[1]
    assert listing._quality(clip, 1.0, 9.0)[0] == listing.POOR
