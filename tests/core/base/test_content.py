"""Files that cannot be opened are told in one line, whoever reads them."""

import os
import threading

import pytest

from beyond_mocap.annotation import read_annotation_csv, read_text
from beyond_mocap.base import content
from beyond_mocap.base.content import read_bytes, read_utf8
from beyond_mocap.base.errors import InputError
from beyond_mocap.files.bvh import bvh
from beyond_mocap.files.obj import read_mesh
from beyond_mocap.files.tables import read_ball
from beyond_mocap.files.tracking.tracking import read_match, read_track_csv
from beyond_mocap.markers.files.c3d import read_c3d
from beyond_mocap.markers.files.marker_set_text import read_marker_set
from beyond_mocap.markers.files.model_json import read_model
from beyond_mocap.markers.files.trc import read_trc
from beyond_mocap.passes.scene_json import read_scene
from beyond_mocap.synthesis.pin_table import read_pins

READERS = (bvh.read_bvh, read_annotation_csv, read_ball, read_c3d, read_marker_set, read_match, read_model,
           read_mesh, read_pins, read_scene, read_text, read_track_csv, read_trc)


@pytest.mark.parametrize("read", READERS)
def test_each_reader_tells_what_it_is_given_instead_of_a_file(tmp_path, read):
    (tmp_path / "folder").mkdir()
    given = {"gone": "no such file; expected an? .+; check the path",
             "folder": "is a folder; expected an? .+; choose a file",
             "nul\0": "cannot be read .+; expected an? .+ that is readable|no such file"}  # fmt: skip
    for name, said in given.items():
        with pytest.raises(InputError, match=said) as told:
            read(tmp_path / name)
        assert "\n" not in str(told.value)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="nothing is forbidden to root")
def test_a_file_that_may_not_be_read(tmp_path):
    (tmp_path / "a").write_text("a")
    (tmp_path / "a").chmod(0)
    with pytest.raises(InputError, match=r"cannot be read \(Permission denied\); expected a thing that is readable"):
        read_bytes(tmp_path / "a", "a thing")


def test_what_is_too_large_is_not_read(tmp_path):
    (tmp_path / "a").write_bytes(b"12345")
    assert read_bytes(tmp_path / "a", "a thing", 5) == b"12345"
    with pytest.raises(InputError, match="has 5 bytes; expected a thing of at most 4; choose another file"):
        read_bytes(tmp_path / "a", "a thing", 4)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16-le", "utf-16-be"])
def test_text_is_unicode_and_loses_the_mark_at_its_start(encoding, tmp_path):
    (tmp_path / "a").write_bytes("\ufeffJörg\r\n".encode(encoding))
    assert read_utf8(tmp_path / "a", "a thing") == "Jörg\r\n"
    (tmp_path / "b").write_bytes("Jörg".encode("cp1252"))
    with pytest.raises(
        InputError, match="is not UTF-8 text; expected a thing; choose another file, or save it as UTF-8"
    ):
        read_utf8(tmp_path / "b", "a thing")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="Windows has no named pipes")
def test_a_pipe_is_read_and_refused_without_a_writer(tmp_path, monkeypatch):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    writer = threading.Thread(target=pipe.write_bytes, args=(b"12345",), daemon=True)
    writer.start()
    assert read_bytes(pipe, "a thing") == b"12345"
    writer.join(10)
    monkeypatch.setattr(content, "PIPE_SECONDS", 0.1)
    with pytest.raises(InputError, match="a pipe, into which no program writes; expected a thing"):
        read_bytes(pipe, "a thing")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="Windows has no named pipes")
@pytest.mark.parametrize("begin", [b"", b"12345"])
def test_a_pipe_whose_writer_is_silent_is_refused(begin, tmp_path, monkeypatch):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for name in ("PIPE_SECONDS", "SILENT_SECONDS"):
        monkeypatch.setattr(content, name, 0.1)
    writer = os.open(pipe, os.O_RDWR)
    os.write(writer, begin)
    with pytest.raises(InputError, match="gave nothing for 0.1 s; expected a thing; write its content into a file"):
        read_bytes(pipe, "a thing")
    os.close(writer)
