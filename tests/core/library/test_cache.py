"""What is kept of a library: the same bits back, never anything old, damaged or foreign, and no harm from others."""

import errno
import gc
import os
import shutil
import subprocess
import sys
import tracemalloc
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.files import motion_file
from beyond_mocap.files.bvh.bvh_text import MAX_BYTES
from beyond_mocap.library import build, cache, read_clips, synthetic_clips
from beyond_mocap.library import library as library_module
from beyond_mocap.library.build import build_library
from beyond_mocap.library.features import list_frame_arrays
from beyond_mocap.library.folder import label_notes
from beyond_mocap.library.folder.recordings import CACHE_FOLDER
from beyond_mocap.library.library import Library

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
    found |= {f"frames.{name}": values for name, values in list_frame_arrays(library.frames).items()}
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


def test_stance_postures_and_clusters_are_computed_once(clips_folder, library, monkeypatch):
    stance, postures = library.neutral_stance, library.normal_postures.to_arrays()
    completed = library.with_synthetic_clips
    clusters = [one.clusters[8].to_arrays() for one in (library, completed)]
    monkeypatch.setattr(synthetic_clips, "sample_upright_example", None)
    monkeypatch.setattr(library_module, "fit_normal_postures", None)
    monkeypatch.setattr(library_module, "cluster_blocks", None)
    again = build_library(clips_folder)
    assert all(np.array_equal(getattr(stance, name), getattr(again.neutral_stance, name))
               for name in library_module._STANCE_NUMBERS)
    assert len(postures["kinds"]) and np.array_equal(library.strangeness, again.strangeness)
    assert all(np.array_equal(values, again.normal_postures.to_arrays()[name]) for name, values in postures.items())
    for arrays, one in zip(clusters, (again, again.with_synthetic_clips)):
        assert all(np.array_equal(values, one.clusters[8].to_arrays()[name]) for name, values in arrays.items())
    assert len(clusters[0]["start_8"]) < len(clusters[1]["start_8"])


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
    "a changed number": lambda content: content[:300] + bytes([content[300] ^ 255]) + content[301:],
    "zeros": lambda content: bytes(len(content)),
    "a pickle": lambda content: b"\x80\x04\x95\x05\x00\x00\x00\x00\x00\x00\x00]\x94.",
}


def cache_files(folder: Path) -> dict[str, Path]:
    """The header and the motions of a library's cache."""
    place = folder / CACHE_FOLDER
    (motions,) = place.glob("library-*/motions.npy")
    return {"header": place / "library.json", "motions": motions}


@pytest.mark.parametrize("name", ["header", "motions"])
@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE)
def test_a_damaged_cache_is_written_anew(folder, small, name, damage):
    library = replace(build_library(small), folder=str(folder))
    assert not built(folder)[1]
    file = cache_files(folder)[name]
    file.write_bytes(damage(file.read_bytes()))
    again, worked = built(folder)
    assert worked
    assert_same(library, again)
    assert not built(folder)[1]


def test_no_single_wrong_byte_does_harm(folder, small):
    """A flipped byte anywhere in the files: the cache is not used."""
    library, place = build_library(small), folder / CACHE_FOLDER
    key = library.cache_location[1]
    random = np.random.default_rng(3)
    files = [*(place / "library.json",) * 60, *sorted(place.glob("library-*/*.npy"))]
    for file in files:
        content = file.read_bytes()
        at = int(random.integers(len(content)))
        file.write_bytes(content[:at] + bytes([content[at] ^ (1 << at % 8)]) + content[at + 1 :])
        assert cache.load_library(place, key) is None, (file, at)
        file.write_bytes(content)
    left, right = arrays_of(library), arrays_of(Library(folder=str(folder), **cache.load_library(place, key)))
    assert all(np.array_equal(left[name], right[name]) for name in left)


def test_a_copied_cache_is_checked_once_and_used(folder):
    for file in (folder / CACHE_FOLDER).rglob("*.npy"):
        os.utime(file, (1e9, 1e9))
    before = cache_files(folder)["header"].read_bytes()
    assert not built(folder)[1]
    assert cache_files(folder)["header"].read_bytes() != before  # now with the files' new times
    assert not built(folder)[1]


@pytest.mark.parametrize("change", ["nothing", "a list", "no clips", "another skeleton", "a file less", "elsewhere"])
def test_a_cache_of_another_form_is_not_used(folder, change):
    place = folder / CACHE_FOLDER
    header = cache._read_header(place, "library")
    key = header["key"]
    if change == "nothing":
        header = {"key": key}
    elif change == "a list":
        header = [key]
    elif change == "no clips":
        header["clips"] = None
    elif change == "another skeleton":
        header["parents"] = header["parents"][::-1]
    elif change == "a file less":
        header["files"].pop("contacts.npy")
    elif change == "elsewhere":
        header["folder"] = "../" + header["folder"] + "/.."
    cache._write_header(place, "library", header)
    library, worked = built(folder)
    assert worked and len(library.clips) == 4
    assert not built(folder)[1]


def test_files_of_a_build_give_up_their_place_when_they_are_read(folder, tmp_path, monkeypatch):
    """A file that is mapped keeps its place on the disk although it is removed."""
    counts, write = [], read_clips._write_clips

    def count_mapped():
        gc.collect()
        return sum(isinstance(one, motion_file.MappedMotions) for one in gc.get_objects())

    def write_clips(*arguments):
        counts.append(count_mapped())
        return write(*arguments)

    monkeypatch.setattr(read_clips, "_write_clips", write_clips)
    before = count_mapped()
    build_library(folder, cache_dir=tmp_path / "cache")
    assert counts == [before + 1]  # the repaired motions


def test_a_cache_of_an_earlier_version_is_told_and_replaced(folder):
    shutil.rmtree(folder / CACHE_FOLDER)
    (folder / CACHE_FOLDER).mkdir()
    (folder / CACHE_FOLDER / "library.npz").write_bytes(b"of version 0.1")
    first, worked = built(folder)
    assert worked and any("another version" in note for note in first.notes)
    again, worked = built(folder)
    assert not worked and not any("another version" in note for note in again.notes)
    assert not list((folder / CACHE_FOLDER).glob("*.npz"))


def test_a_cache_of_a_program_that_knew_a_label_names_it_as_misspelled_when_it_is_opened(folder, monkeypatch):
    (folder / "walk.txt").write_text("0 1.4 waking\n")
    with monkeypatch.context() as earlier:
        earlier.setattr(label_notes, "find_meant_label", lambda *_: "")
        assert not any("waking" in note for note in built(folder)[0].notes)
    for _ in range(2):
        library, worked = built(folder)
        assert not worked and [note.split(";")[0] for note in library.notes if "waking" in note] == [
            "walk.bvh: the label 'waking' is not in the vocabulary"]


def test_what_a_build_replaces_or_a_killed_one_left_stays_for_an_hour_and_others_may_read_all(folder):
    place = folder / CACHE_FOLDER
    build_library(folder, rebuild=True)
    assert len(list(place.glob("library-*"))) == 2  # another machine may have the old one open
    for path in place.glob("library-*"):
        os.utime(path, (1e9, 1e9))
    killed = [place / ".library.json.7.8.part", place / "made-gait" / ".walk_1.bvh.7.8.part"]
    killed[1].parent.mkdir(exist_ok=True)
    for path in killed:
        path.write_text("half")
    build_library(folder, rebuild=True)
    assert all(path.exists() for path in killed)  # they may still be written
    for path in killed:
        os.utime(path, (1e9, 1e9))
    (place / "library-gait").mkdir()
    os.utime(place / "library-gait", (1e9, 1e9))
    build_library(folder, rebuild=True)
    assert len(list(place.glob("library-*"))) == 4  # and what only looks alike
    assert not any(path.exists() for path in killed)
    mask = os.umask(0)
    os.umask(mask)
    for path in (place, *place.rglob("*")):
        wanted = (0o777 if path.is_dir() else 0o666) & ~mask
        assert path.stat().st_mode & 0o777 == wanted, path


def test_a_file_that_changes_within_its_clock_tick_is_read_again(folder):
    """Only the digest of a file that has been quiet for a while is taken from the last time."""
    os.utime(folder / "walk.bvh", (1e9, 1e9))
    digests = cache.SourceDigests(folder / CACHE_FOLDER)
    fresh = digests.digest("walk.bvh", folder / "walk.bvh")
    digests.save()
    (folder / "walk.bvh").write_bytes((folder / "walk.bvh").read_bytes().replace(b"0", b"1", 1))
    os.utime(folder / "walk.bvh", (1e9, 1e9))  # size and time of content are as before
    assert cache.SourceDigests(folder / CACHE_FOLDER).digest("walk.bvh", folder / "walk.bvh") != fresh


def test_a_file_that_no_recording_can_be_is_not_read_for_its_digest(folder):
    """A file of 20 GB was read for two minutes before the build said what it needs."""
    place = folder / "huge.bvh"
    with open(place, "wb") as file:
        file.truncate(MAX_BYTES + 1)
    tracemalloc.start()
    try:
        assert cache.SourceDigests(folder / CACHE_FOLDER).digest(place.name, place) == "unreadable"
        assert tracemalloc.get_traced_memory()[1] < 1e6
    finally:
        tracemalloc.stop()


def test_built_in_files_or_in_memory_gives_the_same_bits(folder, monkeypatch):
    def refuse(place, name="library"):
        raise OSError("no place")

    library, _ = built(folder)
    monkeypatch.setattr(cache, "create_arrays_folder", refuse)
    again, worked = built(folder, rebuild=True)
    assert worked and any("cannot be written" in note for note in again.notes)
    assert_same(library, replace(again, notes=library.notes))


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
    (folder / CACHE_FOLDER / "library.json").unlink()
    (folder / CACHE_FOLDER / "library.json").mkdir()
    assert built(folder)[1]
    assert not list((folder / CACHE_FOLDER).rglob("*.part"))


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


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="Windows has no folders with the sticky bit")
def test_what_only_another_user_may_replace_is_left_and_the_library_built_each_time(folder, monkeypatch):
    """As in /tmp: all may write into the folder, but only its owner replaces a file."""
    place = folder / CACHE_FOLDER
    place.chmod(0o1777)
    before = {path.name: path.stat().st_mtime_ns for path in place.iterdir()}
    monkeypatch.setattr(os, "geteuid", lambda: os.stat(place).st_uid + 1)
    (folder / "walk.txt").write_text("0 1 walking\n")
    for _ in range(2):
        library, worked = built(folder)
        assert worked and [note for note in library.notes if "cannot be written: the library is rebuilt each" in note]
    assert {path.name: path.stat().st_mtime_ns for path in place.glob("library*")} == {
        name: time for name, time in before.items() if name.startswith("library")}
    place.chmod(0o777)
    assert built(folder)[1] and not built(folder)[1]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a disk that is always full")
def test_a_full_disk_is_told_in_one_line_and_leaves_no_half_of_a_cache(folder, monkeypatch):
    def open_full(path, mode="r", *more):
        return open("/dev/full" if mode == "wb" else path, mode, *more)

    monkeypatch.setattr(motion_file, "open", open_full, raising=False)
    ignored = []
    monkeypatch.setattr(sys, "unraisablehook", ignored.append)
    before = {path.name for path in (folder / CACHE_FOLDER).iterdir()}
    with pytest.raises(InputError, match="cache cannot be written .No space left on device.; free space"):
        build_library(folder, rebuild=True)
    gc.collect()
    assert ignored == []
    assert {path.name for path in (folder / CACHE_FOLDER).iterdir()} == before


def test_another_fault_in_the_middle_of_a_build_is_not_told_as_a_full_disk(folder, monkeypatch):
    def fail(place, clips):
        raise OSError(errno.EIO, os.strerror(errno.EIO), str(place / "walk_1.bvh"))

    monkeypatch.setattr(build, "write_synthetic_clips", fail)
    before = {path.name for path in (folder / CACHE_FOLDER).iterdir()}
    with pytest.raises(InputError, match="walk_1.bvh: failed .* .Input/output error.") as told:
        build_library(folder, rebuild=True)
    assert "space" not in str(told.value)
    assert {path.name for path in (folder / CACHE_FOLDER).iterdir()} == before


def test_a_synthetic_clip_that_cannot_be_written_does_no_harm(small, tmp_path):
    motion = build_library(small).clips[0].motion
    clip = SimpleNamespace(source_at=lambda frame: f"{CACHE_FOLDER}/made/run.bvh", motion=motion, mirrored=False)
    (tmp_path / "made" / "run.bvh").mkdir(parents=True)
    cache.write_synthetic_clips(tmp_path, [clip])
    assert [path.name for path in tmp_path.rglob("*")] == ["made", "run.bvh"]
