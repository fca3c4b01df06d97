"""The folder of a match: one run at a time, one order, names that every system takes; and the digests behind it."""

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.files.file_names import build_file_names
from beyond_mocap.match.folder import open_folder, read_state
from beyond_mocap.match.request import MatchRequest, build_identity, compute_digest

TOP = Path(__file__).resolve().parents[3]


@dataclass(frozen=True, eq=False)
class Planted:
    name: str
    values: np.ndarray


def test_the_same_content_has_the_same_digest_and_no_other_has():
    one = Planted("a", np.arange(6.0))
    assert compute_digest(one) == compute_digest(Planted("a", np.arange(6.0)[::1]))
    others = [Planted("b", np.arange(6.0)), Planted("a", np.arange(6)), Planted("a", np.arange(6.0).reshape(2, 3)),
              Planted("a", np.arange(5.0)), (1, 2), (1, (2,)), ((1,), 2), (12,), ("1", 2), (1.0, 2), (True, 2), None,
              {"a": 1}, {"a": 2}, frozenset("ab"), ("a", "b"), ("ab",), b"ab", Path("ab")]  # fmt: skip
    assert len({compute_digest(value) for value in [one, *others]}) == len(others) + 1
    with pytest.raises(TypeError, match="function"):
        compute_digest(test_the_same_content_has_the_same_digest_and_no_other_has)


@pytest.fixture
def order(tmp_path):
    (tmp_path / "t.dat").write_text("tracking")
    return MatchRequest(tmp_path / "t.dat", tmp_path / "clips", tmp_path / "out", players=("a", "b"))


def changed(order, **more):
    return MatchRequest(**{**vars(order), **more})


def test_what_decides_the_results_is_in_the_identity_and_nothing_else(order, tmp_path):
    own = compute_digest(build_identity(order, "key"))
    (tmp_path / "same.dat").write_text("tracking")
    same = [{"workers": 7}, {"scheduler": "tcp://x"}, {"bvh": True}, {"figures": False}, {"out": tmp_path / "o"},
            {"tracking": tmp_path / "same.dat"}, {"annotations": tmp_path}]  # fmt: skip
    assert {compute_digest(build_identity(changed(order, **more), "key")) for more in same} == {own}
    other = [{"seed": 1}, {"start": 0.0}, {"end": 9.0}, {"fps": 25.0}, {"players": ("a",)}, {"nearest": False},
             {"solve_touches": False}, {"strength": 4.0}, {"masses": "women"}, {"fatigue": 0.5}, {"window": 30.0},
             {"events": tmp_path / "same.dat"}]  # fmt: skip
    found = [compute_digest(build_identity(changed(order, **more), "key")) for more in other]
    (tmp_path / "t.dat").write_text("other tracking")
    found += [compute_digest(build_identity(order, name)) for name in ("other", "key")]
    assert len({own, *found}) == len(other) + 3


@pytest.mark.parametrize("more, told", [
    ({"start": 5.0, "end": 5.0}, "end time: 5 s; expected later than the start, 5 s"),
    ({"start": 1234.5674, "end": 1234.567}, "end time: 1234.567 s; expected later than the start, 1234.5674 s"),
    ({"window": 1.0}, "window: 1 s"),
    ({"overlap": 200.0}, "overlap: 200 s"), ({"start": np.nan}, "start time: not a number"),
    ({"end": np.nan}, "end time: not a number"),
])  # fmt: skip
def test_an_order_without_sense_is_told(order, more, told):
    with pytest.raises(InputError, match=told):
        changed(order, **more)


def test_a_file_that_is_not_there_is_told(order):
    with pytest.raises(InputError, match="nothing.dat: no such file"):
        build_identity(changed(order, tracking=Path("nothing.dat")), "key")


STATE = {"state": "running", "players": [{"id": "a"}], "figure": np.float64("nan")}


def test_a_folder_is_gone_on_with_by_the_same_order_only(order, tmp_path):
    known = build_identity(order, "key")
    with open_folder(order.out, known) as folder:
        assert folder.previous_state == {}
        folder.write_state({"identity": known, **STATE})
    with open_folder(order.out, known) as folder:
        assert folder.previous_state["players"] == [{"id": "a"}] and folder.previous_state["figure"] is None
    for more, key, told in (
        ({"start": 1.0}, "key", "start time"), ({"seed": 1}, "other", "seed"), ({}, "other", "library"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=rf"out: holds the results of another request \(its {told} differs\)"):
            with open_folder(order.out, build_identity(changed(order, **more), key)):
                pass


def test_pieces_are_kept_till_they_are_forgotten(order):
    with open_folder(order.out, build_identity(order, "key")) as folder:
        for name in "abc":
            folder.piece_path("search", name).write_text(name)
        folder.remove_pieces("search", ["b"])
        assert [path.name for path in folder.piece_path("search", "b").parent.iterdir()] == ["b.npz"]


def test_what_a_killed_run_was_about_to_rename_is_swept_and_nothing_else(order):
    known = build_identity(order, "key")
    with open_folder(order.out, known) as folder:
        folder.write_state({"players": []})
        folder.piece_path("search", "a").write_bytes(b"piece")
    left = [order.out / ".match.json.28075.140397754297216.part", order.out / ".work" / "search" / ".b.npz.7.8.part"]
    mine = [order.out / ".notes.part", order.out / "home.1.2.part"]
    for path in (*left, *mine):
        path.write_bytes(b"half of it")
    with open_folder(order.out, known) as folder:
        assert folder.piece_path("search", "a").read_bytes() == b"piece"
    assert not any(path.exists() for path in left) and all(path.exists() for path in mine)


def test_two_runs_at_once_are_told_and_a_dead_one_holds_nothing(order):
    known = build_identity(order, "key")
    text = f"""
import sys, os; sys.path.insert(0, {str(TOP)!r})
from pathlib import Path
from beyond_mocap.match.folder import open_folder
with open_folder(Path({str(order.out)!r}), {known!r}):
    print("in", flush=True)
    sys.stdin.read()
"""
    other = subprocess.Popen([sys.executable, "-c", text], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert other.stdout.readline() == b"in\n"
    with pytest.raises(InputError, match=rf"another run \(process {other.pid}\) uses it"):
        with open_folder(order.out, known):
            pass
    other.kill()
    other.wait()
    with open_folder(order.out, known) as folder:
        assert folder.previous_state == {}


def test_a_full_disk_is_told_with_the_folder_and_leaves_nothing(order):
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, before[1]))  # no file has room for a byte
    try:
        with pytest.raises(InputError, match="out: cannot be written"):
            with open_folder(order.out, build_identity(order, "key")):
                pass
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert not order.out.exists()


def test_folders_that_are_none_of_a_match_are_told(order, tmp_path):
    known = build_identity(order, "key")
    (tmp_path / "file").write_text("x")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.txt").write_text("x")
    (tmp_path / "state" / "match.json").mkdir(parents=True)
    (tmp_path / "work").mkdir()
    (tmp_path / "work" / ".work").write_text("x")
    for path, told in ((tmp_path / "file", "is a file"), (tmp_path / "full", r"holds other files \(thesis.txt\)"),
                       (tmp_path / "state", r"match\.json: is a folder.*remove it"),
                       (tmp_path / "work", r"\.work: is a file.*remove it"),
                       (tmp_path / "no" / "where", "the folder above it does not exist")):  # fmt: skip
        with pytest.raises(InputError, match=told):
            with open_folder(path, known):
                pass
    assert not (tmp_path / "no").exists() and [p.name for p in (tmp_path / "full").iterdir()] == ["thesis.txt"]


@pytest.mark.parametrize("text, told", [
    ("{", "not valid JSON"), ("[]", "no list of players"), ('{"players": [3]}', "no list of players"),
    ('{"players": [], "version": 99}', "version 99"), ('{"players": []}', "no version"),
    ("[" * 100000, "not valid JSON"),
    ("\0\0", "not valid JSON"), ('{"version": 1, "players": [{"id": ["a"]}]}', "no list of players"),
    ('{"version": 1, "players": [{"id": ""}]}', "no list of players"),
])  # fmt: skip
def test_a_state_that_cannot_be_read_is_told(tmp_path, text, told):
    (tmp_path / "match.json").write_text(text)
    with pytest.raises(InputError, match=f"match.json: {told}"):
        read_state(tmp_path)


@pytest.fixture
def begun(order):
    """What decides the results of an order, whose folder has one piece of work and its state."""
    known = build_identity(order, "key")
    with open_folder(order.out, known) as folder:
        folder.write_state({"identity": known, "players": [{"id": "a"}]})
        folder.piece_path("search", "a").write_bytes(b"piece")
    return known


def cut(state: Path, drop: str = "") -> None:
    """Half of a state; or the whole without one of its keys."""
    told = json.loads(state.read_text())
    text = json.dumps({key: value for key, value in told.items() if key != drop}, indent=1)
    state.write_text(text if drop else text[: len(text) // 2])


@pytest.mark.parametrize("drop, told", [
    ("", "not valid JSON"), ("players", "no list of players"), ("digest", "no digest"),
    ("version", "no version"),
])  # fmt: skip
def test_a_damaged_state_is_set_aside_and_the_work_goes_on(order, begun, drop, told):
    cut(order.out / "match.json", drop)
    damaged = (order.out / "match.json").read_bytes()
    with open_folder(order.out, begun) as folder:
        assert folder.piece_path("search", "a").read_bytes() == b"piece" and folder.previous_state == {}
        assert told in folder.notes[0] and "match.json.damaged" in folder.notes[0] and len(folder.notes) == 1
        assert (order.out / "match.json.damaged").read_bytes() == damaged
    with open_folder(order.out, begun) as folder:  # the run before ended before it told anything
        assert folder.piece_path("search", "a").read_bytes() == b"piece" and folder.notes == ()


def test_an_empty_state_of_another_order_is_refused(order, begun):
    (order.out / "match.json").write_text("")
    with pytest.raises(InputError, match="holds the results of another request"):
        with open_folder(order.out, build_identity(changed(order, seed=1), "key")):
            pass
    assert (order.out / "match.json").read_text() == ""
    with open_folder(order.out, begun) as folder:
        assert "renamed to match.json.damaged" in folder.notes[0]


def test_a_state_without_a_digest_and_without_pieces_is_refused(tmp_path):
    text = '{"version": 1, "players": [], "of": "somebody else"}'
    (tmp_path / "match.json").write_text(text)
    with pytest.raises(InputError, match="match.json: no digest"):
        with open_folder(tmp_path, {"seed": 1}):
            pass
    assert [path.name for path in tmp_path.iterdir()] == ["match.json"]
    assert (tmp_path / "match.json").read_text() == text


def test_a_damaged_state_of_another_order_or_version_is_refused(order, begun):
    other = build_identity(changed(order, seed=1), "key")
    cut(order.out / "match.json")
    with pytest.raises(InputError, match="holds the results of another request; expected"):  # which, it does not say
        with open_folder(order.out, other):
            pass
    (order.out / "match.json").write_text('{"players": [], "version": 99}')
    with pytest.raises(InputError, match="version 99"):
        with open_folder(order.out, begun):
            pass
    assert not (order.out / "match.json.damaged").exists() and (order.out / ".work" / "search" / "a.npz").exists()


def test_a_state_that_somebody_else_wrote_is_refused_and_left(order, tmp_path):
    folder = tmp_path / "theirs"
    folder.mkdir()
    (folder / "match.json").write_text('{"matchInfo": {}}')
    for _ in range(2):
        with pytest.raises(InputError, match="no list of players"):
            with open_folder(folder, build_identity(order, "key")):
                pass
    assert [path.name for path in folder.iterdir()] == ["match.json"]


def test_files_of_players_have_names_that_every_system_takes():
    ids = ["home_1", "DFL-OBJ-0001", "a/b", "a_b", "A_B", "../..", "", "con", "COM1.x", "é", "x" * 300, "a b"]
    names = build_file_names(ids)
    assert set(names) == set(ids) and names["home_1"] == "home_1"
    assert len({name.lower() for name in names.values()}) == len(ids)
    for name in names.values():
        assert name and not set(name) - set("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.-")
        assert len(name) < 120 and not name.startswith(".") and name.lower() not in ("con", "com1.x")
    assert json.dumps(names)
