"""A motion put into a library: the library reads it with its words, and nothing is replaced."""

import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.library.build import build_library
from beyond_mocap.library.folder.label_files import add_clip
from beyond_mocap.synthetic.gait import build_gait


@pytest.fixture
def walk():
    return build_gait(1.4, 2.0, 60.0)


def test_the_library_reads_what_was_added(tmp_path, walk):
    add_clip(tmp_path, "walk", walk, ["walking"])
    lines = add_clip(tmp_path, "throw", walk, ["throwb", "high"], key_seconds=1.2)
    library = build_library(tmp_path)
    assert {clip.path for clip in library.clips} == {"walk.bvh", "throw.bvh"} and len(lines) == 1
    key = next(key for key in library.keys if not library.clips[key.clip].mirrored)
    assert set(key.labels) >= {"throwb", "high"} and (tmp_path / "throw.txt").read_text() == "72f throwb high\n"


def test_words_of_its_own_are_told(tmp_path, walk):
    assert any("juggle" in line for line in add_clip(tmp_path, "walk", walk, ["juggle"])[1:])


def test_nothing_is_replaced(tmp_path, walk):
    add_clip(tmp_path, "walk", walk)
    with pytest.raises(InputError, match="already"):
        add_clip(tmp_path, "walk", walk)
    (tmp_path / "run.txt").write_text("0 1 running\n")
    with pytest.raises(InputError, match="already has labels"):
        add_clip(tmp_path, "run", walk, ["walking"])
    assert not (tmp_path / "run.bvh").exists()


def test_words_are_written_as_they_are_read(tmp_path, walk):
    add_clip(tmp_path, "throw", walk, ["Throwb high", "throwb"], key_seconds=1.2)
    assert (tmp_path / "throw.txt").read_text() == "72f throwb high\n"
    for word in ("#top", "3", "-low"):
        with pytest.raises(InputError, match="words: .+ is not a label"):
            add_clip(tmp_path, "other", walk, ["throwb", word])
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize("name, key", [("", None), ("a/b", None), ("late", 9.0), ("early", -0.5)])
def test_what_cannot_be_is_refused(tmp_path, walk, name, key):
    with pytest.raises(InputError):
        add_clip(tmp_path, name, walk, ["throwb"], key)
    assert not list(tmp_path.glob("*.bvh"))
