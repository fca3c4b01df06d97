"""Archives come back as written; one that states false sizes or unpacks to more than it may is refused before that."""

import io
import struct
import tracemalloc
import warnings
import zipfile

import numpy as np
import pytest

from beyond_mocap.base import memory
from beyond_mocap.base.errors import InputError
from beyond_mocap.files import piece_file, plain_npz
from beyond_mocap.files.piece_file import read_piece_file
from beyond_mocap.files.plain_npz import read_named_arrays, read_own_arrays, read_plain_arrays
from beyond_mocap.files.tracking import tracking
from beyond_mocap.library.classify import classifier
from beyond_mocap.passes import analysis_cache

LIMIT = 250_000
FLOATS = (np.dtype(float),)
UNPACKED = 8 * 2**20
READERS = {
    "own": lambda path: read_own_arrays(path, "a file"),
    "bytes": lambda path: read_own_arrays(path.read_bytes(), "a file"),
    "named": lambda path: read_named_arrays(path, "a file", FLOATS, LIMIT, ["poses"]),
    "plain": lambda path: read_plain_arrays(path.read_bytes(), "a file", FLOATS, LIMIT),
    "classifier": classifier.read_classifier,
    "piece": read_piece_file,
    "tracking": tracking._load_cache,
}


def write_bomb(path, method, stated=None):
    """Write an .npz whose two arrays of zeros unpack to UNPACKED bytes; the directory states another size if given."""
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": "<f8", "fortran_order": False, "shape": (UNPACKED // 16,)})
    with zipfile.ZipFile(path, "w", method) as archive:
        for name in ("poses", "header"):
            archive.writestr(f"{name}.npy", head.getvalue() + bytes(UNPACKED // 2))
    data = bytearray(path.read_bytes())
    place = data.find(b"PK\x01\x02")
    while stated is not None and place >= 0:
        data[place + 24 : place + 28] = struct.pack("<I", stated)
        place = data.find(b"PK\x01\x02", place + 1)
    path.write_bytes(data)
    return path


@pytest.fixture(scope="module")
def bombs(tmp_path_factory):
    """Bombs by name."""
    folder = tmp_path_factory.mktemp("bombs")
    methods = {"deflate": zipfile.ZIP_DEFLATED, "bzip2": zipfile.ZIP_BZIP2, "lzma": zipfile.ZIP_LZMA}
    return {f"{name}{lie}": write_bomb(folder / f"{name}{lie}.npz", method, stated)
            for name, method in methods.items() for lie, stated in (("", None), (" that lies", 1000))}


@pytest.mark.parametrize("bomb", ["deflate", "deflate that lies", "bzip2", "bzip2 that lies", "lzma",
                                  "lzma that lies"])
@pytest.mark.parametrize("reader", READERS)
def test_an_archive_is_never_unpacked_beyond_its_limit(bombs, bomb, reader, monkeypatch):
    for module in (piece_file, classifier):
        monkeypatch.setattr(module, "_MAX_BYTES", LIMIT)
    tracemalloc.start()
    try:
        found = READERS[reader](bombs[bomb])
    except InputError as error:
        found = None
        assert "\n" not in str(error)
    finally:
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert found is None and most < 4 * LIMIT


@pytest.mark.parametrize("reader", ["own", "named", "plain"])
def test_an_archive_that_needs_more_memory_than_is_free_is_refused_before_it_is_unpacked(reader, bombs, monkeypatch):
    monkeypatch.setattr(plain_npz, "_LARGE", UNPACKED - 1)
    monkeypatch.setattr(memory, "read_free_bytes", lambda: 1.9 * UNPACKED)
    monkeypatch.setitem(globals(), "LIMIT", 2 * UNPACKED)
    monkeypatch.setitem(READERS, "own", lambda path: read_own_arrays(path, "a file", LIMIT))
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match=r"this needs about \S+ GB, \S+ are free; cut it"):
            READERS[reader](bombs["deflate"])
        assert tracemalloc.get_traced_memory()[1] < 1e6
    finally:
        tracemalloc.stop()


def test_arrays_come_back_as_they_were_written(tmp_path):
    arrays = {"numbers": np.array([[1.5, np.nan], [-0.0, np.inf]]), "columns": np.asfortranarray(np.eye(3, 4)),
              "truth": np.array([True, False]), "none": np.zeros((0, 2)), "one": np.array("a text"),
              "texts": np.array([["Jané", "b"]]), "large": np.arange(20_000)}
    for save in (np.savez, np.savez_compressed):
        save(tmp_path / "x.npz", **arrays)
        for source in (tmp_path / "x.npz", (tmp_path / "x.npz").read_bytes()):
            found = read_own_arrays(source, "a file", LIMIT)
            assert found.keys() == arrays.keys()
            for name, array in arrays.items():
                assert (found[name].dtype, found[name].shape) == (array.dtype, array.shape)
                assert found[name].tobytes() == array.tobytes() and not found[name].flags.writeable


@pytest.mark.parametrize("values", [np.array([{"a": 1}], dtype=object), np.array([1j]), np.array([1.0], ">f8"),
                                    np.array([(1, 2)], [("a", int), ("b", int)])])
def test_other_types_are_refused(tmp_path, values):
    np.savez(tmp_path / "x.npz", values=values)
    with pytest.raises(InputError, match="numbers or text"):
        read_own_arrays(tmp_path / "x.npz", "a file")


def test_a_shape_that_is_beyond_all_numbers_is_refused_without_a_warning(tmp_path):
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": "<f8", "fortran_order": False, "shape": (10**12, 10**12)})
    with zipfile.ZipFile(tmp_path / "x.npz", "w") as archive:
        archive.writestr("header.npy", head.getvalue())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(InputError, match="cannot be read"):
            classifier.read_classifier(tmp_path / "x.npz")


def test_a_cache_of_hits_that_is_damaged_is_not_used(tmp_path, bombs):
    class Kept:
        cache_location = (tmp_path, "key")

    analysis_cache.save_arrays(Kept, "hits", {"times": np.arange(3.0)})
    assert analysis_cache.load_arrays(Kept, "hits")["times"].tolist() == [0.0, 1.0, 2.0]
    (tmp_path / "hits.npz").write_bytes(bombs["bzip2"].read_bytes())
    assert analysis_cache.load_arrays(Kept, "hits") is None
