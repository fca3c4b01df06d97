"""Words written back beside the clip or into the table: as they were said, and nothing else touched."""

import os

import pytest

from beyond_mocap.annotation import ClipAnnotation
from beyond_mocap.base.errors import InputError
from beyond_mocap.library.folder import label_files
from beyond_mocap.library.folder.annotations import Annotations

ROWS = (
    ClipAnnotation(0, 195, None, ("walking", "front")),
    ClipAnnotation(96, 167, 135, ("kick", "right", "low")),
    ClipAnnotation(300, 300, 300, ("jump",)),
)
HEADER = "file,fps,start_frame,end_frame,key_frame,labels,comment\n"


@pytest.fixture
def clip(tmp_path):
    path = tmp_path / "library" / "kicks" / "low.bvh"
    path.parent.mkdir(parents=True)
    path.write_text("never read here")
    return path


def keep(clip, rows=ROWS, **how):
    return label_files.write_labels(clip, clip.parents[1], rows, 120.0, **how)


def read(clip):
    return Annotations(clip.parents[1], [clip]).read_rows(clip, 120.0)


def test_beside_the_clip(clip):
    assert keep(clip) == clip.with_suffix(".txt")
    assert read(clip) == ROWS
    assert sorted(path.name for path in clip.parent.iterdir()) == ["low.bvh", "low.txt"]


def test_words_that_are_there_are_replaced_only_when_told(clip):
    clip.with_suffix(".txt").write_text("0 1 jogging   # by hand\n")
    with pytest.raises(InputError, match="other labels for this clip"):
        keep(clip)
    assert "by hand" in clip.with_suffix(".txt").read_text()
    keep(clip, overwrite=True)
    assert read(clip) == ROWS


def test_into_the_table_that_speaks_of_the_clip(clip):
    table = clip.parents[1] / "annotations.csv"
    table.write_text(HEADER + "kicks/a.bvh,120,0,9,,jogging,first\nkicks/low.bvh,120,0,9,,running,old\n"
                     "kicks/z.bvh,60,0,9,4,kick,\"last, one\"\n")  # fmt: skip
    with pytest.raises(InputError, match="annotations.csv"):
        keep(clip)
    assert keep(clip, overwrite=True) == table and read(clip) == ROWS
    lines = table.read_text().splitlines()
    assert lines[0] + "\n" == HEADER and lines[1] == "kicks/a.bvh,120,0,9,,jogging,first"
    assert lines[2] == "kicks/low.bvh,120,0,195,,walking front," and lines[5] == 'kicks/z.bvh,60,0,9,4,kick,"last, one"'
    assert not clip.with_suffix(".txt").exists()


def test_a_table_in_the_clips_folder_takes_new_clips_too(clip):
    table = clip.parent / "annotations.csv"
    table.write_text(HEADER.replace("\n", "\r\n") + "a.bvh,120,0,9,,jogging,first\r\n")
    assert keep(clip) == table and read(clip) == ROWS
    assert table.read_bytes().count(b"\r\n") == 5


def test_a_table_elsewhere_that_says_nothing_of_the_clip_is_left_alone(clip):
    table = clip.parents[1] / "annotations.csv"
    table.write_text(HEADER + "a.bvh,120,0,9,,jogging,first\n")
    assert keep(clip) == clip.with_suffix(".txt")


def test_there_and_back_through_seconds():
    from beyond_mocap.annotation import build_clip_annotations

    for fps in (120.0, 59.94, 30.0):
        assert build_clip_annotations(label_files.to_timeline(ROWS, fps), fps) == ROWS


def test_rows_are_cut_to_the_clip():
    rows = (ClipAnnotation(-5, 40, None, ("walking",)), ClipAnnotation(90, 140, 135, ("kick",)),
            ClipAnnotation(80, 140, None, ("jogging",)))
    assert label_files.limit_rows(rows, 100) == (ClipAnnotation(0, 40, None, ("walking",)),
                                                ClipAnnotation(80, 99, None, ("jogging",)))


def test_a_place_that_cannot_be_written(clip, monkeypatch):
    if os.geteuid():
        clip.parent.chmod(0o500)
    else:
        def refuse(*_):
            raise PermissionError(13, "Permission denied")
        monkeypatch.setattr(os, "replace", refuse)
    with pytest.raises(InputError, match="low.txt: cannot be written"):
        keep(clip)
    clip.parent.chmod(0o700)
    assert sorted(path.name for path in clip.parent.iterdir()) == ["low.bvh"]


def test_a_broken_table_is_not_made_worse(clip):
    table = clip.parent / "annotations.csv"
    table.write_text("file,start_frame\nlow.bvh,0\n")
    with pytest.raises(InputError, match="no column"):
        keep(clip)
    assert table.read_text() == "file,start_frame\nlow.bvh,0\n"
