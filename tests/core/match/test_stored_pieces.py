"""Pieces of work in files: read as they were written, and never trusted where they are damaged."""

import io
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import TimedMessage, line_spans
from beyond_mocap.match.crowd.correction import Correction
from beyond_mocap.match.crowd.window import PlayerCorrection, load_parts, save_parts
from beyond_mocap.match.pieces.windows import load_piece, save_piece
from beyond_mocap.match.request import compute_digest


@pytest.fixture
def parts():
    values = np.arange(36, dtype=np.int16).reshape(3, 12)
    one = PlayerCorrection(
        correction=Correction(np.array([3, 6, 9]), values, 30.0, 3), frames=np.array([4, 5]),
        depth=np.array([0.01, 0.02]), before=0.1, led_frames=np.array([7]), led=np.ones((1, 3)),
    )  # fmt: skip
    none = PlayerCorrection(correction=Correction.build_empty(30.0), frames=np.zeros(0, int), depth=np.zeros(0),
                            before=0.0, led_frames=np.zeros(0, int), led=np.zeros((0, 3)))
    return one, none


def test_a_piece_comes_back_as_it_was(weaving_pieces, tmp_path):
    told = (TimedMessage("1.0 s: something", (1.0, 2.5)), TimedMessage("plain"))
    piece = replace(weaving_pieces[0], warnings=told, hurried_from=7)
    save_piece(tmp_path / "a.npz", piece)
    back = load_piece(tmp_path / "a.npz")
    assert compute_digest(back) == compute_digest(piece) and [line_spans(line)
                                                              for line in back.warnings] == [((1.0, 2.5),), ()]
    save_piece(tmp_path / "b.npz", back)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_parts_of_a_crowd_come_back_as_they_were(parts, tmp_path):
    save_parts(tmp_path / "a.npz", parts)
    assert compute_digest(load_parts(tmp_path / "a.npz")) == compute_digest(parts)


@pytest.mark.parametrize("read", [load_piece, load_parts])
def test_what_is_damaged_is_not_used(weaving_pieces, parts, tmp_path, read):
    path = tmp_path / "piece.npz"
    save_piece(path, weaving_pieces[0]) if read is load_piece else save_parts(path, parts)
    whole = path.read_bytes()
    assert read(path) is not None and read(tmp_path / "none.npz") is None
    for content in (b"", whole[: len(whole) // 2], b"no zip at all", whole[:200] + b"\xff" * 40 + whole[240:]):
        path.write_bytes(content)
        assert read(path) is None
    with np.load(io.BytesIO(whole)) as stored:
        arrays = {name: stored[name] for name in stored.files}
    for name, values in arrays.items():  # a valid archive, with one number altered
        if values.size:
            altered = values.copy()
            altered.flat[0] = not values.flat[0] if values.dtype == bool else values.flat[0] + 1
            np.savez(path, **{**arrays, name: altered})
            assert read(path) is None, name
    np.savez(path, header=np.frombuffer(b"[[1, 2, 3]]", np.uint8))
    assert read(path) is None
