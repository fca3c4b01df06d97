"""What is kept of a library: the same bits back, never anything old, damaged or foreign, and no harm from others."""

import gc
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.library import cache
from beyond_mocap.library.build import build_library
from beyond_mocap.library.library import Library
from beyond_mocap.library.scan import CACHE_FOLDER

TOP = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def small(tmp_path_factory, clip_file):
    """Two short clips and their cache, to be copied by tests that change them."""
    folder = tmp_path_factory.mktemp("small")
    clip_file(folder / "stand.bvh", 0.0, 1.5, "standing")
    clip_file(folder / "walk.bvh", 1.4, 1.5, "walking")
    build_library(folder)
    return folder


@pytest.fixture
def folder(small, tmp_path):
    return Path(shutil.copytree(small, tmp_path / "library"))


def built(folder, **options):
    """The library, and whether it was worked out anew."""
    told = []
    library = build_library(folder, progress=lambda fraction, text: told.append(text), **options)
    return library, "Library ready" in told


def arrays_of(library: Library) -> dict[str, np.ndarray]:
    """Every array of a library by name."""
    found = {"offsets": library.skeleton.offsets, "end_offsets": library.skeleton.end_offsets}
    for name in cache._FRAME_ARRAYS:
        found[f"frames.{name}"] = getattr(library.frames, name)
    for number, clip in enumerate(library.clips):
        found[f"{number}.root"], found[f"{number}.rotations"] = clip.motion.root_positions, clip.motion.rotations
        found[f"{number}.standing"] = clip.heel_toe_contacts
    return found


def the_rest(library: Library):
    clips = [(c.path, c.mirrored, c.motion.fps, c.annotations) for c in library.clips]
    skeleton = (library.skeleton.names, library.skeleton.parents, library.skeleton.end_parents)
    words = (library.frames.vocabulary, library.labels, library.keys)
    return (clips, skeleton, words, library.fps, library.notes, library.folder,
            library.gaits, library.minutes)  # fmt: skip


def assert_same(a: Library, b: Library):
    left, right = arrays_of(a), arrays_of(b)
    assert left.keys() == right.keys()
    for name in left:
        assert left[name].dtype == right[name].dtype and left[name].tobytes() == right[name].tobytes(), name
    assert the_rest(a) == the_rest(b)


def test_from_the_cache_come_the_same_bits(clips_folder, library):
    again, worked = built(clips_folder)
    assert not worked
    assert_same(library, again)


def test_built_twice_gives_the_same_bits(clips_folder, library, tmp_path):
    again, worked = built(clips_folder, rebuild=True, cache_dir=tmp_path)
    assert worked
    assert_same(library, again)


def test_the_folder_may_move(folder, tmp_path):
    moved = shutil.move(folder, tmp_path / "elsewhere")
    library, worked = built(moved)
    assert not worked and library.folder == str(moved)


@pytest.mark.parametrize(
    "change",
    [
        lambda folder, clip: (folder / "walk.txt").write_text("0 1 jogging\n"),
        lambda folder, clip: (folder / "stand.txt").unlink(),
        lambda folder, clip: clip(folder / "walk.bvh", 1.6, 1.5, "walking"),
        lambda folder, clip: clip(folder / "more.bvh", 2.0, 1.0, "walking"),
        lambda folder, clip: (folder / "stand.bvh").unlink(),
        lambda folder, clip: (folder / "stand.bvh").rename(folder / "rest.bvh"),
        lambda folder, clip: (folder / "annotations.csv").write_text(
            "file,start_frame,end_frame,key_frame,labels\nwalk.bvh,0,9,,walking\n"
        ),
    ],
    ids=["words", "words gone", "movement", "a clip more", "a clip less", "another name", "a table"],
)
def test_what_changes_a_file_makes_the_cache_stale(folder, clip_file, change):
    change(folder, clip_file)
    fresh, worked = built(folder)
    assert worked
    kept, worked = built(folder)
    assert not worked
    assert_same(fresh, kept)


def test_options_that_change_the_library_make_the_cache_stale(folder):
    assert built(folder, unit=0.02)[1] and not built(folder, unit=0.02)[1]
    assert built(folder, seed=1)[1]
    assert built(folder, skeleton=folder / "walk.bvh")[1]


DAMAGE = {
    "empty": lambda content: b"",
    "half": lambda content: content[: len(content) // 2],
    "without its end": lambda content: content[:-30],
    "text": lambda content: b"a library, once",
    "a changed number": lambda content: content[:5000] + bytes([content[5000] ^ 255]) + content[5001:],
    "zeros": lambda content: bytes(len(content)),
    "a pickle": lambda content: b"\x80\x04\x95\x05\x00\x00\x00\x00\x00\x00\x00]\x94.",
}


@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE)
def test_a_damaged_cache_is_written_anew(folder, damage):
    library, worked = built(folder)
    assert not worked
    file = folder / ".beyond_mocap" / "library.npz"
    file.write_bytes(damage(file.read_bytes()))
    again, worked = built(folder)
    assert worked
    assert_same(library, again)
    assert not built(folder)[1]


def test_no_single_wrong_byte_does_harm(small, tmp_path):
    """Flipped bytes all over the file, its directory above all: the cache is not used, or says the same."""
    content = (small / ".beyond_mocap" / "library.npz").read_bytes()
    library = build_library(small)
    key = _header(small)["key"]
    random = np.random.default_rng(3)
    places = [*random.integers(0, len(content), 40), *range(len(content) - 2500, len(content), 7)]
    for place in places:
        (tmp_path / "library.npz").write_bytes(
            content[:place] + bytes([content[place] ^ (1 << place % 8)]) + content[place + 1 :]
        )
        found = cache.load_library(tmp_path, key)
        if found is not None:
            left, right = arrays_of(library), arrays_of(Library(folder=str(small), **found))
            assert all(np.array_equal(left[name], right[name]) for name in left), place


def _header(folder):
    import json

    with np.load(folder / ".beyond_mocap" / "library.npz") as arrays:
        return json.loads(arrays["header"].tobytes())


@pytest.mark.parametrize("change", ["nothing", "a list", "no clips", "another skeleton", "short arrays", "objects"])
def test_a_cache_of_another_form_is_not_used(folder, change):
    import json

    file = folder / ".beyond_mocap" / "library.npz"
    header = _header(folder)
    with np.load(file) as arrays:
        content = {name: arrays[name] for name in arrays.files}
    if change == "nothing":
        content = {"something": np.zeros(3)}
    elif change == "a list":
        header = [header["key"]]
    elif change == "no clips":
        header["clips"] = None
    elif change == "another skeleton":
        header["parents"] = header["parents"][::-1]
    elif change == "short arrays":
        content["rotations"] = content["rotations"][:-1]
    elif change == "objects":
        content["root"] = np.array([{"a": 1}], dtype=object)
    if change != "nothing":
        content["header"] = np.frombuffer(json.dumps(header).encode(), np.uint8)
    np.savez(file, **content)
    library, worked = built(folder)
    assert worked and len(library.clips) == 4
    assert not built(folder)[1]


def test_the_cache_may_lie_elsewhere(folder, tmp_path):
    shutil.rmtree(folder / ".beyond_mocap")
    assert built(folder, cache_dir=tmp_path / "deep" / "cache")[1]
    assert not (folder / ".beyond_mocap").exists()
    assert not built(folder, cache_dir=tmp_path / "deep" / "cache")[1]


@pytest.fixture
def read_only(folder, monkeypatch):
    """The library's folder as one that cannot be written (root may write anywhere, so the answer is planted)."""
    shutil.rmtree(folder / ".beyond_mocap")
    real = os.access
    monkeypatch.setattr(
        os, "access", lambda path, mode, **more: not str(path).startswith(str(folder)) and real(path, mode, **more)
    )
    return folder


def test_a_folder_that_cannot_be_written_keeps_its_cache_with_the_user(read_only, tmp_path, monkeypatch):
    monkeypatch.delenv("LOCALAPPDATA", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "user"))
    library, worked = built(read_only)
    assert worked and any("cannot be written" in note and str(tmp_path / "user") in note for note in library.notes)
    again, worked = built(read_only)
    assert not worked and again.notes == library.notes
    assert not (read_only / ".beyond_mocap").exists()


def test_without_any_place_for_a_cache_the_library_is_built_all_the_same(read_only, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.delenv("LOCALAPPDATA", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert built(read_only)[1] and built(read_only)[1]


def test_a_file_in_the_cache_s_place_does_no_harm(folder):
    shutil.rmtree(folder / ".beyond_mocap")
    (folder / ".beyond_mocap").write_text("mine")
    library, worked = built(folder)
    assert worked and len(library.clips) == 4
    assert (folder / ".beyond_mocap").read_text() == "mine"


def test_a_folder_in_the_cache_file_s_place_does_no_harm(folder):
    (folder / ".beyond_mocap" / "library.npz").unlink()
    (folder / ".beyond_mocap" / "library.npz").mkdir()
    assert built(folder)[1]
    assert not list((folder / ".beyond_mocap").rglob("*.part"))


def test_two_processes_that_build_at_once_both_succeed(folder):
    shutil.rmtree(folder / ".beyond_mocap")
    code = (
        "import sys; from beyond_mocap.library.build import build_library; "
        "print(len(build_library(sys.argv[1], rebuild=True).clips))"
    )
    environment = {**os.environ, "PYTHONPATH": str(TOP), "OMP_NUM_THREADS": "1"}
    running = [
        subprocess.Popen([sys.executable, "-c", code, str(folder)], env=environment, stdout=-1, stderr=-1, text=True)
        for _ in range(2)
    ]
    for process in running:
        out, error = process.communicate(timeout=120)
        assert (process.returncode, out.strip(), error) == (0, "4", "")
    assert not list((folder / ".beyond_mocap").rglob("*.part"))
    assert not built(folder)[1]


def test_a_failed_build_leaves_no_cache(folder):
    shutil.rmtree(folder / ".beyond_mocap")
    (folder / "walk.bvh").write_bytes((folder / "walk.bvh").read_bytes()[:9000])
    with pytest.raises(InputError):
        build_library(folder)
    assert not (folder / ".beyond_mocap").exists()


def test_a_cache_that_cannot_be_written_is_told(folder, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    library = build_library(folder, cache_dir=blocked / "below", rebuild=True)
    assert any("cannot be written" in note for note in library.notes)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a disk that is always full")
def test_a_full_disk_is_told_once_and_leaves_no_half_of_a_cache(folder, monkeypatch):
    write_bytes = Path.write_bytes
    monkeypatch.setattr(
        Path, "write_bytes",
        lambda path, content: write_bytes(Path("/dev/full") if path.suffix == ".part" else path, content),
    )  # fmt: skip
    ignored = []
    monkeypatch.setattr(sys, "unraisablehook", ignored.append)
    library = build_library(folder, rebuild=True)
    gc.collect()
    assert ignored == [] and sum("cannot be written" in note for note in library.notes) == 1
    assert not list((folder / ".beyond_mocap").rglob("*.part"))


def test_a_synthetic_clip_that_cannot_be_written_does_no_harm(small, tmp_path):
    motion = build_library(small).clips[0].motion
    clip = SimpleNamespace(source_at=lambda frame: f"{CACHE_FOLDER}/made/run.bvh", motion=motion, mirrored=False)
    (tmp_path / "made" / "run.bvh").mkdir(parents=True)
    cache.write_synthetic_clips(tmp_path, [clip])
    assert [path.name for path in tmp_path.rglob("*")] == ["made", "run.bvh"]
