"""Pieces of work in files: read as they were written, and never trusted where they are damaged or say what cannot
be."""

import io
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import TimedMessage, line_spans
from beyond_mocap.files.piece_file import read_piece_file, write_piece_file
from beyond_mocap.match.crowd.correction import Correction
from beyond_mocap.match.crowd.window import PlayerCorrection, load_parts, save_parts
from beyond_mocap.match.pieces.stored_piece import fits_window, list_library_clips, load_piece, save_piece
from beyond_mocap.match.pieces.units import build_units
from beyond_mocap.match.request import compute_digest

WINDOW = 0.0, 1.0, 30.0
"""The window of the parts of a crowd: start and end in s, frames per second."""

ACTION = ".beyond_mocap/made-gait/action_"


def load_crowd(path):
    return load_parts(path, *WINDOW)


def altered(name, place, value):
    """A change of one number of an array."""

    def alter(_, arrays):
        arrays[name] = arrays[name].copy()
        arrays[name][place] = value

    return alter


def reworded(*places_and_value):
    """A change of one value of the header."""
    *places, last, value = places_and_value

    def alter(header, _):
        for place in places:
            header = header[place]
        header[last] = value

    return alter


def alter_file(path, alter):
    """Rewrite a piece with a valid checksum; `alter` may return another header."""
    header, arrays = read_piece_file(path)
    write_piece_file(path, alter(header, arrays) or header, arrays)


@pytest.fixture
def parts():
    values = np.arange(36, dtype=np.int16).reshape(3, 12)
    one = PlayerCorrection(
        correction=Correction(np.array([3, 6, 9]), values, 30.0, 3), frames=np.array([4, 5]),
        depth=np.array([0.01, 0.02]), before=0.1, led_frames=np.array([7, 8, 7]), led=np.ones((3, 3)),
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
    assert compute_digest(load_crowd(tmp_path / "a.npz")) == compute_digest(parts)


@pytest.fixture(scope="module")
def kicked(weaving_plan, weaving_pieces):
    """The window with the kick, and its piece."""
    units = build_units(weaving_plan, window=8.0, overlap=3.0)
    return next((unit, piece) for unit, piece in zip(units, weaving_pieces, strict=True) if piece.edit.keys)


@pytest.mark.parametrize("alter", [
    altered("clip", 0, 9999), altered("clip", 0, -3), altered("first", 0, np.nan), altered("first", 0, 1e6),
    altered("rate", 0, 1e9), altered("length", 0, 10**9), altered("length", 0, -5), altered("length", 0, 2**62),
    lambda _, arrays: arrays.update(rate=arrays["rate"][:-1]), lambda _, arrays: arrays.update(clip=arrays["first"]),
    lambda _, arrays: arrays.update({name: values[1:] for name, values in arrays.items()}),
    lambda _, arrays: arrays.update({name: values[:0] for name, values in arrays.items()}),
    lambda _, arrays: arrays.update(cut=arrays["cut"][:, None]), lambda _, arrays: arrays.pop("cut") is None,
    lambda header, _: header["clips"].clear(), lambda header, _: header.pop("hurried") and None,
    lambda header, _: [header],
    reworded("clips", 0, 0, 5), reworded("clips", 0, ["none.bvh", False]), reworded("clips", 0, ["walk.bvh"]),
    reworded("clips", 0, [ACTION + "throw_in_v9999.0.bvh", False]), reworded("clips", 0, [ACTION + "x.bvh", False]),
    reworded("clips", 0, [ACTION + "diving_header_v1.2.3_z0.8.bvh", False]),
    reworded("keys", 0, "clip", 99), reworded("keys", 0, "words", 5), reworded("keys", 0, "time", 77.0),
    reworded("keys", 0, "frame", 1e6), reworded("keys", 0, None), reworded("own", None), reworded("own", [0, 1]),
    reworded("first", 3), reworded("player", "other"), reworded("stretch", 0.5), reworded("seconds", "long"),
    reworded("hurried", 10**9), reworded("hurried", -1), reworded("warnings", [["text", 5]]),
])  # fmt: skip
def test_a_piece_that_cannot_be_is_missing(library, kicked, tmp_path, alter):
    unit, piece = kicked
    clips, path = list_library_clips(library), tmp_path / "piece.npz"
    save_piece(path, piece)
    assert fits_window(load_piece(path), unit, clips, library)
    alter_file(path, alter)
    found = load_piece(path)
    assert found is None or not fits_window(found, unit, clips, library)


@pytest.mark.parametrize("alter", [
    lambda _, arrays: arrays.pop("1.led") is None, lambda _, arrays: arrays.update({"0.led": np.ones((1, 3))}),
    altered("0.frames", 1, 30), altered("0.led_frames", 0, -1), altered("0.depth", 0, -0.1),
    altered("0.depth", 0, np.inf), altered("0.knots", 0, -(10**15)), altered("0.knots", 1, 4),
    lambda _, arrays: arrays.update({"0.values": arrays["0.values"].astype(int)}),
    lambda _, arrays: arrays.update({"0.values": arrays["0.values"][:-1]}), lambda header, _: {"rows": header},
    reworded(0, None), reworded(0, 0, 25.0), reworded(0, 1, 1), reworded(0, 1, "3"), reworded(0, 2, -1.0),
    lambda header, _: header[0].pop() is None,
])  # fmt: skip
def test_parts_of_a_crowd_that_cannot_be_are_missing(parts, tmp_path, alter):
    path = tmp_path / "parts.npz"
    save_parts(path, parts)
    assert load_crowd(path) is not None
    alter_file(path, alter)
    assert load_crowd(path) is None


@pytest.mark.parametrize("read", [load_piece, load_crowd])
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
