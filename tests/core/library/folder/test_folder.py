"""Which files below a folder are clips, and which words belong to each."""

import os

import numpy as np
import pytest

from beyond_mocap.annotation import ClipAnnotation
from beyond_mocap.base.errors import InputError
from beyond_mocap.library.build import build_library
from beyond_mocap.library.folder.annotations import Annotations
from beyond_mocap.library.folder.conversions import find_readable_clips
from beyond_mocap.library.folder.label_notes import describe_misspelled_labels, describe_unused_labels
from beyond_mocap.library.folder.recordings import find_clips, find_recordings_and_labels, list_own_recordings
from beyond_mocap.library.listing import scan_clips

HEADER = "file,fps,start_frame,end_frame,key_frame,labels,comment\n"


def row(file, words, start=0, end=9, key=""):
    return f"{file},30,{start},{end},{key},{words},\n"


@pytest.fixture
def folder(tmp_path):
    """collection/library with a clip at the top and one in a folder; only names matter here."""
    library = tmp_path / "collection" / "library"
    (library / "deep").mkdir(parents=True)
    for name in ("b.bvh", "deep/a.BVH"):
        (library / name).write_text("HIERARCHY")
    return library


def names(folder):
    return [path.relative_to(folder).as_posix() for path in find_clips(folder)]


def words(folder, name, fps=30.0):
    rows = Annotations(folder, find_clips(folder)).read_rows(folder / name, fps)
    return [" ".join(row.words) for row in rows]


def test_motion_of_smpl_is_a_clip_and_of_one_name_the_first_form_counts(folder):
    """An .npz may hold anything; its arrays tell."""
    for name, arrays in {"b": ("poses", "trans"), "deep/c": ("poses", "trans"), "weights": ("header",)}.items():
        np.savez(folder / f"{name}.npz", **dict.fromkeys(arrays, np.zeros(3)))
    for name in ("b.fbx", "deep/c.fbx", "d.fbx", "d.glb"):
        (folder / name).write_text("")
    found = [path.relative_to(folder).as_posix() for path in list_own_recordings(folder)]
    assert found == ["b.bvh", "d.fbx", "d.glb", "deep/a.BVH", "deep/c.npz"]


def test_clips_are_found_in_order_whatever_the_case_of_their_suffix(folder):
    (folder / "Z.bvh").write_text("")
    (folder / "notes.txt").write_text("")
    assert names(folder) == ["Z.bvh", "b.bvh", "deep/a.BVH"]


def test_linked_folders_and_files_are_followed(folder, tmp_path):
    (tmp_path / "far").mkdir()
    (tmp_path / "far" / "c.bvh").write_text("")
    (tmp_path / "single.bvh").write_text("")
    (folder / "linked").symlink_to(tmp_path / "far")
    (folder / "d.bvh").symlink_to(tmp_path / "single.bvh")
    assert names(folder) == ["b.bvh", "d.bvh", "deep/a.BVH", "linked/c.bvh"]


def test_a_loop_of_links_ends(folder):
    (folder / "deep" / "up").symlink_to(folder)
    (folder / "self").symlink_to(folder, target_is_directory=True)
    assert names(folder) == ["b.bvh", "deep/a.BVH"]


def test_a_folder_that_can_be_reached_twice_is_read_once(folder):
    (folder / "again").symlink_to(folder / "deep")
    assert len(names(folder)) == 2


def test_the_library_itself_may_be_a_link(folder, tmp_path):
    (tmp_path / "link").symlink_to(folder)
    assert names(tmp_path / "link") == ["b.bvh", "deep/a.BVH"]


def test_the_cache_is_not_searched(folder):
    (folder / ".beyond_mocap").mkdir()
    (folder / ".beyond_mocap" / "old.bvh").write_text("")
    assert names(folder) == ["b.bvh", "deep/a.BVH"]


@pytest.mark.parametrize("make", [lambda p: None, lambda p: p.mkdir(), lambda p: p.write_text("a file")])
def test_a_missing_or_empty_folder_is_told(tmp_path, make):
    make(tmp_path / "nothing")
    with pytest.raises(InputError, match="nothing: (no |is a file).*; expected .*; .") as told:
        find_clips(tmp_path / "nothing")
    assert "\n" not in str(told.value)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="Windows has no named pipes")
def test_a_pipe_among_the_clips_is_refused_before_it_is_opened(folder):
    os.mkfifo(folder / "pipe.bvh")
    for find in (find_clips, lambda folder: find_readable_clips(folder, folder / "cache"), build_library):
        with pytest.raises(InputError, match="pipe.bvh: is a device or a pipe; expected a recording; write its"):
            find(folder)
    assert [clip.seconds for clip in scan_clips(folder) if clip.path == "pipe.bvh"] == [0.0]


def test_names_of_any_script_will_do_but_bytes_that_are_none_are_told(folder):
    (folder / "frei stoß 蹴る.bvh").write_text("")
    assert "frei stoß 蹴る.bvh" in names(folder)
    try:
        with open(os.fsencode(folder) + b"/w\xffalk.bvh", "w"):
            pass
    except OSError:
        pytest.skip("this file system takes no such names")
    with pytest.raises(InputError, match="not UTF-8") as told:
        find_clips(folder)
    assert str(told.value).isascii()


def test_the_text_beside_a_clip_wins_over_tables(folder):
    (folder / "annotations.csv").write_text(HEADER + row("b.bvh", "walking"))
    assert words(folder, "b.bvh") == ["walking"]
    (folder / "b.txt").write_text("0 1 jogging\n")
    assert words(folder, "b.bvh") == ["jogging"]


def test_the_nearest_table_that_speaks_of_a_clip_wins(folder):
    (folder.parent / "annotations.csv").write_text(
        HEADER + row("library/deep/a.BVH", "far") + row("library/b.bvh", "far")
    )
    assert words(folder, "deep/a.BVH") == words(folder, "b.bvh") == ["far"]
    (folder / "annotations.csv").write_text(HEADER + row("deep/a.BVH", "top"))
    assert (words(folder, "deep/a.BVH"), words(folder, "b.bvh")) == (["top"], ["far"])
    (folder / "deep" / "annotations.csv").write_text(HEADER + row("other.bvh", "beside"))
    assert words(folder, "deep/a.BVH") == ["top"]
    (folder / "deep" / "annotations.csv").write_text(HEADER + row("a.BVH", "beside"))
    assert words(folder, "deep/a.BVH") == ["beside"]


def describe_unused(folder):
    recordings, labels = find_recordings_and_labels(folder)
    annotations = Annotations(folder, recordings)
    return describe_unused_labels(folder, recordings, labels, tables=annotations.tables,
                                  used=annotations.list_sources(recordings))


def test_rows_that_name_no_clip_are_told(folder):
    def told():
        return describe_unused(folder)

    (folder.parent / "annotations.csv").write_text(HEADER + row("other/a.bvh", "x") + row("library/b.bvh", "walking"))
    assert told() == []
    (folder / "annotations.csv").write_text(HEADER + row("gone.bvh", "x") * 2 + row("b.bvh", "walking"))
    (folder.parent / "annotations.csv").write_text(HEADER + row("library/gone.bvh", "x"))
    assert told() == ["annotations.csv: 3 rows name files that are not in the library, such as library/gone.bvh"]
    (folder / "empty").mkdir()
    (folder / "annotations.csv").unlink()
    (folder.parent / "annotations.csv").unlink()
    for names in (("a.bvh",), ("../b.bvh", "./c.bvh")):  # a table names what is below it
        (folder / "empty" / "annotations.csv").write_text(HEADER + "".join(row(name, "x") for name in names))
        (line,) = told()
        assert line.endswith(f"not in the library, such as {names[0]} in empty/annotations.csv")
    (folder / "empty" / "annotations.csv").write_text("a table of another kind")
    (line,) = told()
    assert "empty/annotations.csv:1: no column file" in line and line.endswith("below, so it is not used")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="Windows has no named pipes")
def test_what_has_the_name_of_labels_and_is_no_file_is_told_and_not_opened(folder):
    (folder / "more.txt").mkdir()  # of no clip
    os.mkfifo(folder / "lone.txt")
    assert describe_unused(folder) == []
    (folder / "b.txt").mkdir()
    end = "so no labels are read from it; replace it by a file"
    assert describe_unused(folder) == [f"b.txt: is a folder, {end}"]
    (folder / "b.txt").rmdir()
    (folder / "b.txt").symlink_to("nothing")
    assert describe_unused(folder) == [f"b.txt: is a link to no file, {end}"]
    os.mkfifo(folder.parent / "annotations.csv")
    os.mkfifo(folder / "deep" / "annotations.csv")
    (folder / "b.txt").unlink()
    assert describe_unused(folder) == [
        "deep/annotations.csv: is a device or a pipe, so no labels are read from it (similar in 2 places); "
        "replace it by a file"]


def test_rows_are_cut_to_their_clip_and_what_is_lost_is_told(tmp_path, clip_file):
    clip_file(tmp_path / "walk.bvh", seconds=1.0, words="")
    (tmp_path / "walk.txt").write_text("# labels\n0 1.1 walking\n")
    library = build_library(tmp_path)
    assert not [note for note in library.notes if "cut to" in note]
    (tmp_path / "walk.txt").write_text("# labels\n0 100000 walking\n0 1.2 front\n")
    lines = [note for note in build_library(tmp_path).notes if "cut to" in note]
    assert lines == ["walk.txt:2: the row ends at frame 3000000, cut to the clip's last, 30 (similar in 2 rows)"]
    (tmp_path / "walk.txt").write_text("# labels\n3 4 walking\n")
    with pytest.raises(InputError, match=r"walk\.txt:2: a row that starts at frame 90; expected frames 0 to 30"):
        build_library(tmp_path)


def test_labels_that_are_probably_misspelled_are_named(folder):
    def describe(*labels):
        rows = [(ClipAnnotation(0, 9, None, labels),), (ClipAnnotation(0, 5, None, ("jogging", *labels)),)]
        return describe_misspelled_labels(dict(zip(names(folder), rows)))

    assert describe("waking", "front") == [
        "b.bvh and 1 more clip: the label 'waking' is not in the vocabulary; if 'walking' is meant, correct it"]
    assert [line.split("'")[1:4:2] for line in describe("rihgt", "joging")] == [["joging", "jogging"],
                                                                               ["rihgt", "right"]]
    assert describe("kick", "juggling", "toss", "lob", "stroke", "pass") == []


def test_a_table_two_folders_above_says_nothing(folder):
    (folder.parent.parent / "annotations.csv").write_text(HEADER + row("collection/library/b.bvh", "too far"))
    assert words(folder, "b.bvh") == []


def test_tables_are_found_from_wherever_one_stands(folder, monkeypatch):
    (folder.parent / "annotations.csv").write_text(HEADER + row("library/b.bvh", "above"))
    for here, given in (
        (folder, "."),
        (folder.parent, "library"),
        (folder / "deep", ".."),
        (folder / "deep", "../../library"),
    ):
        monkeypatch.chdir(here)
        paths = find_clips(given)
        clip = next(path for path in paths if path.name == "b.bvh")
        assert [row.words for row in Annotations(given, paths).read_rows(clip, 30.0)] == [("above",)], (here, given)


def test_clips_in_linked_folders_are_named_by_where_they_are_linked(folder, tmp_path):
    (tmp_path / "far").mkdir()
    (tmp_path / "far" / "c.bvh").write_text("")
    (tmp_path / "far" / "c.txt").write_text("0 1 running\n")
    (tmp_path / "far" / "d.bvh").write_text("")
    (folder / "linked").symlink_to(tmp_path / "far")
    (folder / "annotations.csv").write_text(HEADER + row("linked/d.bvh", "jogging"))
    assert (words(folder, "linked/c.bvh"), words(folder, "linked/d.bvh")) == (["running"], ["jogging"])


def test_a_broken_table_is_told_with_its_line(folder):
    (folder / "annotations.csv").write_text(HEADER + row("b.bvh", "walking") + row("b.bvh", "walking", start="x"))
    with pytest.raises(InputError, match=r"annotations\.csv:3"):
        words(folder, "b.bvh")
    (folder / "annotations.csv").write_text("file,start_frame\n")
    with pytest.raises(InputError, match=r"annotations\.csv:1.*labels"):
        words(folder, "b.bvh")


def test_all_that_was_read_for_words_is_known_to_the_cache(folder):
    (folder.parent / "annotations.csv").write_text(HEADER + row("library/b.bvh", "walking"))
    (folder / "deep" / "a.txt").write_text("0 1 jogging\n")
    paths = find_clips(folder)
    sources = {path.resolve() for path in Annotations(folder, paths).list_sources(paths)}
    assert sources == {(folder.parent / "annotations.csv").resolve(), (folder / "deep" / "a.txt").resolve()}
