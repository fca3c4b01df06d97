"""Files are written whole or not at all: through links, never over devices and pipes."""

import errno
import os
import stat
from pathlib import Path

import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.cli.main import main
from beyond_mocap.files.atomic import atomic_folder, atomic_path, atomic_write


def test_a_link_stays_one_and_its_file_is_written(tmp_path):
    (tmp_path / "file").write_text("before")
    (tmp_path / "link").symlink_to("file")
    atomic_write(tmp_path / "link", "after")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "file").read_text() == "after"
    assert sorted(one.name for one in tmp_path.iterdir()) == ["file", "link"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
def test_a_pipe_is_left_as_it_is(tmp_path, clip_file, capsys):
    os.mkfifo(tmp_path / "pipe.bvh")
    with pytest.raises(InputError, match="a device or a pipe; expected a regular file"):
        atomic_write(tmp_path / "pipe.bvh", "text")
    clip = clip_file(tmp_path / "clip.bvh")
    assert main(["mirror", str(clip), str(tmp_path / "pipe.bvh")]) == 2
    assert "a device or a pipe" in capsys.readouterr().err
    assert stat.S_ISFIFO((tmp_path / "pipe.bvh").stat().st_mode)
    assert sorted(one.name for one in tmp_path.iterdir()) == ["clip.bvh", "clip.txt", "pipe.bvh"]


def test_a_name_may_be_as_long_as_the_disk_allows(tmp_path):
    name = "ä" * 127 + "b"
    atomic_write(tmp_path / name, "text")
    assert [one.name for one in tmp_path.iterdir()] == [name]
    with pytest.raises(InputError, match="too long.; expected a name that the disk allows; choose a shorter"):
        atomic_write(tmp_path / (name + "c"), "text")
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize("number, end", [
    (errno.ENOSPC, "expected free space on its disk; make room, or choose another folder"),
    (errno.EACCES, "expected a writable folder; choose another place"),
])
def test_why_a_file_cannot_be_written_decides_what_to_do(tmp_path, number, end):
    for write in (atomic_path, atomic_folder):
        with pytest.raises(InputError) as told, write(tmp_path / "out"):
            raise OSError(number, os.strerror(number))
        assert str(told.value) == f"{tmp_path / 'out'}: cannot be written ({os.strerror(number)}); {end}"
        assert not list(tmp_path.iterdir())


def test_what_a_killed_process_left_in_a_folder_is_in_nobodys_way(tmp_path):
    out = tmp_path / "out"
    (out / ".1.2.part").mkdir(parents=True)
    with atomic_folder(out) as inside:
        (inside / "a").write_text("1")
    assert [(one.name, one.read_text()) for one in out.iterdir()] == [("a", "1")]


def test_of_two_that_write_to_one_folder_the_first_to_end_does(tmp_path):
    out = tmp_path / "out"
    with pytest.raises(InputError, match="not empty .a."), atomic_folder(out) as inside:
        (inside / "a").write_text("2")
        (out / "a").write_text("1")  # by the other process
    assert [(one.name, one.read_text()) for one in out.iterdir()] == [("a", "1")]


@pytest.mark.parametrize("write", [Path.write_text, atomic_write])
def test_the_other_one_is_told_why_it_cannot_write(tmp_path, write):
    """The first to end removes what the other has begun."""
    out = tmp_path / "out"
    with pytest.raises(InputError, match="another command has written to this folder"), atomic_folder(out) as inside:
        (out / "a").write_text("1")
        inside.rmdir()
        write(inside / "b", "2")
    assert [one.name for one in out.iterdir()] == ["a"]


def test_mirror_and_retarget_write_bvh_only(tmp_path, clip_file, capsys):
    clip = str(clip_file(tmp_path / "clip.bvh"))
    for verb in (["mirror", clip, "{}"], ["retarget", clip, "--to", clip, "--out", "{}"]):
        assert main([word.format(tmp_path / "out.fbx") for word in verb]) == 2
        assert "file type .fbx cannot be written" in capsys.readouterr().err and not (tmp_path / "out.fbx").exists()
