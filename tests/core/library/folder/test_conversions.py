"""Recordings that only Blender reads: their conversions are read in their place, as long as they stand."""

import os
import shutil

import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.library.build import build_library
from beyond_mocap.library.cache import find_cache_folder
from beyond_mocap.library.folder.conversions import Conversions, read_stamp
from beyond_mocap.library.folder.recordings import list_own_recordings
from beyond_mocap.library.listing import scan_clips


@pytest.fixture
def foreign(clips_folder, tmp_path):
    """A library of which one clip is an FBX file, with its words beside it; and the BVH that it would be."""
    folder = tmp_path / "library"
    shutil.copytree(clips_folder, folder, ignore=shutil.ignore_patterns(".beyond_mocap"))
    source = next(path for path in sorted(folder.rglob("*.bvh")) if path.with_suffix(".txt").is_file())
    bvh = source.read_bytes()
    source.unlink()
    fbx = source.with_suffix(".fbx")
    fbx.write_bytes(b"anything")
    return folder, fbx, bvh


def convert(folder, fbx, bvh):
    conversions = Conversions(folder, find_cache_folder(folder, None)[0])
    conversions.prepare_file(fbx).write_bytes(bvh)
    conversions.record_conversion(fbx, read_stamp(fbx))


def test_what_nobody_has_converted_is_left_out_and_told(foreign):
    folder, fbx, _ = foreign
    library = build_library(folder)
    assert all(not clip.path.endswith(".fbx") for clip in library.clips)
    assert any("skipped" in note and fbx.name in note for note in library.notes)


def test_a_conversion_is_the_clip_with_the_words_beside_the_source(foreign):
    folder, fbx, bvh = foreign
    convert(folder, fbx, bvh)
    for library in (build_library(folder), build_library(folder)):
        clip = next(clip for clip in library.clips if clip.path == fbx.relative_to(folder).as_posix())
        assert clip.annotations and not any("skipped" in note for note in library.notes)


def test_a_changed_source_is_not_answered_by_its_old_conversion(foreign):
    folder, fbx, bvh = foreign
    convert(folder, fbx, bvh)
    build_library(folder)
    fbx.write_bytes(b"changed")
    library = build_library(folder)
    assert all(not clip.path.endswith(".fbx") for clip in library.clips)
    assert any("skipped" in note for note in library.notes)


def test_a_bvh_of_the_same_name_goes_first(foreign):
    folder, fbx, bvh = foreign
    fbx.with_suffix(".bvh").write_bytes(bvh)
    convert(folder, fbx, bvh)
    assert all(not clip.path.endswith(".fbx") for clip in build_library(folder).clips)
    for found in (list_own_recordings(folder), [folder / clip.path for clip in scan_clips(folder)]):
        assert fbx.with_suffix(".bvh") in found and fbx not in found


def test_only_foreign_clips_and_none_converted(tmp_path):
    (tmp_path / "a.glb").write_bytes(b"anything")
    with pytest.raises(InputError, match="only Blender reads"):
        build_library(tmp_path)


def test_a_damaged_table_counts_as_nothing_converted(foreign):
    folder, fbx, bvh = foreign
    convert(folder, fbx, bvh)
    table = find_cache_folder(folder, None)[0] / "converted" / "converted.json"
    table.write_text("[1, 2")
    assert not Conversions(folder, find_cache_folder(folder, None)[0]).is_current(fbx)
    table.write_text("[]")
    assert not Conversions(folder, find_cache_folder(folder, None)[0]).is_current(fbx)


def test_a_place_that_cannot_be_written_is_told(foreign, tmp_path):
    folder, fbx, _ = foreign
    blocked = tmp_path / "blocked"
    blocked.write_text("a file")
    with pytest.raises(InputError, match="converted"):
        Conversions(folder, blocked).prepare_file(fbx)
    assert os.path.isfile(blocked)
