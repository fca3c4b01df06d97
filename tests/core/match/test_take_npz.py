"""A file of a player comes back number for number; whatever is wrong in one is one line of InputError."""

import io
import json
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.base.errors import InputError
from beyond_mocap.match.player_file import read_player, write_player
from tests.core.match.made_player import made_player

RUNS = ("clip", "first", "rate", "length", "cut")
ARRAYS = ("positions", "ball", "times", "filled", "outlier", "ball_height_known")


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> bytes:
    path = tmp_path_factory.mktemp("player") / "x.take.npz"
    write_player(path, made_player())
    return path.read_bytes()


def test_a_player_comes_back_number_for_number(tmp_path):
    player, path = made_player(), tmp_path / "home_7.take.npz"
    write_player(path, player)
    again = read_player(path)
    assert (again.player, again.window) == (player.player, player.window)
    assert np.array_equal(again.correction.knots, player.correction.knots) and len(again.correction.knots)
    assert np.array_equal(again.correction.values, player.correction.values)
    for one, other in zip(again.stretches, player.stretches, strict=True):
        assert all(np.array_equal(getattr(one.edit, n), getattr(other.edit, n)) for n in RUNS)
        assert (one.edit.clips, one.edit.keys) == (other.edit.clips, other.edit.keys)
        track, same = one.plan.track, other.plan.track
        assert all(np.array_equal(getattr(track, n), getattr(same, n), equal_nan=n == "ball") for n in ARRAYS)
        assert all(
            np.array_equal(getattr(one.plan.solved, n), getattr(other.plan.solved, n), equal_nan=True)
            for n in ("times", "ball", "filled")
        )
        assert one.plan.solved.touches == other.plan.solved.touches
        assert vars(one.plan).keys() == vars(other.plan).keys()
        assert np.array_equal(one.plan.heading_path.times, other.plan.heading_path.times)
        assert np.array_equal(one.plan.heading_path.bins, other.plan.heading_path.bins)
        plain = set(vars(one.plan)) - {"track", "solved", "heading_path"}
        assert all(getattr(one.plan, name) == getattr(other.plan, name) for name in plain)
        assert (one.warnings, one.short) == (other.warnings, other.short)


def test_a_file_without_headings_is_read(tmp_path, whole):
    with_arrays(whole, tmp_path / "arrays.npz", heading_path=None)
    with_header((tmp_path / "arrays.npz").read_bytes(), tmp_path / "old.npz", lambda h: first(h).pop("headings"))
    plan = read_player(tmp_path / "old.npz").stretches[0].plan
    assert plan.heading_keys == () and plan.heading_path is None


def test_the_same_player_gives_the_same_bytes(tmp_path, whole):
    (tmp_path / "read.npz").write_bytes(whole)
    write_player(tmp_path / "again.npz", read_player(tmp_path / "read.npz"))
    assert (tmp_path / "again.npz").read_bytes() == whole


def with_header(whole: bytes, path, change) -> None:
    """Writes the file with its text changed by change(header)."""
    with zipfile.ZipFile(io.BytesIO(whole)) as archive, zipfile.ZipFile(path, "w") as out:
        for member in archive.namelist():
            data = archive.read(member)
            if member == "header.npy":
                header = json.loads(np.load(io.BytesIO(data)).tobytes())
                change(header)
                text = io.BytesIO()
                np.save(text, np.frombuffer(json.dumps(header).encode(), np.uint8))
                data = text.getvalue()
            out.writestr(member, data)


def with_arrays(whole: bytes, path, **changed) -> None:
    """Writes the file with arrays of the first stretch in the place of its own; None leaves one out."""
    with np.load(io.BytesIO(whole)) as kept_arrays:
        arrays = dict(kept_arrays)
    arrays |= {f"0/{name}": values for name, values in changed.items()}
    np.savez(path, **{name: values for name, values in arrays.items() if values is not None})


def first(header) -> dict:
    return header["stretches"][0]


@pytest.mark.parametrize("change, told", [
    (lambda h: h.update(format="a cake"), "not a player of a match"),
    (lambda h: h.update(version=99), "run the match again"),
    (lambda h: h.pop("player"), "player"),
    (lambda h: h.update(window=0.0), "window: 0 s; expected 1 s or more"),
    (lambda h: h.update(correction=[25.0]), "2 values"),
    (lambda h: h.update(correction=[-1.0, 2]), "above 0"),
    (lambda h: h.update(correction=[25.0, 99]), "rising"),
    (lambda h: h["stretches"].append(first(h)), "no such array"),
    (lambda h: h["stretches"].pop(), "which is not used"),
    (lambda h: first(h)["settings"].update(fps="fast"), "a number"),
    (lambda h: first(h)["settings"].update(method="blocks"), "path"),
    (lambda h: first(h)["settings"].update(alpha=7.0), "alpha"),
    (lambda h: first(h)["settings"].update(colour="red"), "colour"),
    (lambda h: first(h)["clips"].pop(), "clip"),
    (lambda h: first(h)["clips"].__setitem__(0, ["a.bvh"]), "2 values"),
    (lambda h: first(h)["placed"][0].__setitem__(1, 9), "clip 9"),
    (lambda h: first(h)["touches"].pop(0), "rows"),
    (lambda h: first(h)["touches"][0].__setitem__(1, "yes"), "true or false"),
    (lambda h: first(h)["keys"][0].__setitem__(1, ["a b"]), "is not a label"),
    (lambda h: first(h)["pins"][0].update(part="nose"), "nose"),
])
def test_a_wrong_text_is_told(tmp_path, whole, change, told):
    with_header(whole, tmp_path / "x.npz", change)
    with pytest.raises(InputError, match=told) as caught:
        read_player(tmp_path / "x.npz")
    assert str(caught.value).startswith(str(tmp_path / "x.npz")) and "\n" not in str(caught.value)


@pytest.mark.parametrize("changed, told", [
    ({"times": np.zeros((200, 1), np.int32)}, "two or more, ascending"),
    ({"times": np.ones((1, 1), np.int32)}, "two or more, ascending"),
    ({"positions": np.zeros((3, 2), np.int32)}, "200"),
    ({"positions": np.zeros((200, 3), np.int32)}, "shape"),
    ({"positions": np.zeros((200, 2))}, "whole numbers"),
    ({"clip": np.array([0, 5, 0], np.int16)}, "0 to 1"),
    ({"clip": np.array([0, -1, 0], np.int16)}, "0 to 1"),
    ({"length": np.array([5, 0, 5], np.int32)}, "a frame or more"),
    ({"length": np.array([2**31 - 1] * 3, np.int32)}, "a frame or more"),
    ({"first": np.array([0.0, 1e300, 0.0])}, "too large for a clip"),
    ({"first": np.array([0.0, np.nan, 0.0])}, "NaN or infinite"),
    ({"rate": None}, "no such array"),
    ({"more": np.zeros(3)}, "which is not used"),
    ({"rate": np.array(["a", "b", "c"])}, "values of type"),
])
def test_a_wrong_array_is_told(tmp_path, whole, changed, told):
    with_arrays(whole, tmp_path / "x.npz", **changed)
    with pytest.raises(InputError, match=told) as caught:
        read_player(tmp_path / "x.npz")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("data, told", [(b"", "damaged"), (b"PK\x03\x04 no", "damaged"), (b"{}" * 50, "damaged")])
def test_what_is_no_such_file_is_told(tmp_path, data, told):
    (tmp_path / "x.npz").write_bytes(data)
    with pytest.raises(InputError, match=told):
        read_player(tmp_path / "x.npz")


def test_a_file_cut_short_is_told(tmp_path, whole):
    (tmp_path / "x.npz").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match="damaged, truncated"):
        read_player(tmp_path / "x.npz")


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_a_damaged_array_with_a_right_checksum_is_told_or_read(tmp_path_factory, whole, data):
    path = tmp_path_factory.mktemp("fuzz") / "x.npz"
    with zipfile.ZipFile(io.BytesIO(whole)) as archive, zipfile.ZipFile(path, "w") as out:
        hurt = data.draw(st.sampled_from(archive.namelist()))
        for member in archive.namelist():
            content = archive.read(member)
            if member == hurt:
                at = data.draw(st.integers(0, len(content) - 1))
                junk = data.draw(st.binary(min_size=1, max_size=40))
                content = content[:at] + junk + content[at + len(junk) :]
            out.writestr(member, content)
    try:
        read_player(path)
    except InputError as error:
        assert "\n" not in str(error)
