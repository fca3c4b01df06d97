"""A fresh Blender profile with the extension switched on, for every test in this folder.

The extension is loaded the way Blender loads it: from a profile's repository, under the
name in EXTENSION. Tests reach the core only through it (the `core` fixture); the plain
name `beyond_mocap` is blocked, because the same class under two names fails `isinstance`.
"""

import atexit
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
from importlib import import_module

import pytest

EXTENSION = "bl_ext.user_default.beyond_mocap"
HERE = pathlib.Path(__file__).resolve().parent
SOURCE = HERE.parents[1]
COLLECTED = pytest.StashKey()
"""Names of all tests of the files that this run was given."""

signal.signal(signal.SIGTERM, signal.default_int_handler)  # else temporary folders would stay behind
_profile = tempfile.TemporaryDirectory(prefix="beyond-mocap-profile-")
os.environ["BLENDER_USER_RESOURCES"] = _profile.name  # read once, when bpy is imported
_repository = pathlib.Path(_profile.name, "extensions", "user_default")
_repository.mkdir(parents=True)
(_repository / "beyond_mocap").symlink_to(SOURCE, target_is_directory=True)
sys.modules["beyond_mocap"] = None

import bpy  # noqa: E402

# isort: split
import addon_utils  # noqa: E402  (bpy brings it)


@atexit.register
def without_blenders_own_leak():
    """Blender never frees the properties of pose markers (our words' markers have some) and counts them as an error
    when it ends; that line alone is left out of what is printed from here on."""
    left_out = subprocess.Popen(["sed", "/^Error: Not freed memory blocks/d"], stdin=subprocess.PIPE)
    os.dup2(left_out.stdin.fileno(), 1)


def find_free_port():
    """Find a port that no other run of the tests on this machine listens to: two Blenders are tested side by side."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def pytest_collection_modifyitems(config, items):
    """Where `make test` runs two Blenders, the older one leaves out slow tests that reach nothing which others do not
    reach too (choose_left_out.py): the newer one has all of them."""
    config.stash[COLLECTED] = {item.nodeid for item in items}
    is_choosing = config.pluginmanager.has_plugin("choose_left_out")
    if not os.environ.get("BLENDERS_IN_TURN") or bpy.app.version >= (5, 0) or is_choosing:
        return
    left_out = read_left_out()
    config.hook.pytest_deselected(items=[item for item in items if item.nodeid in left_out])
    items[:] = [item for item in items if item.nodeid not in left_out]


def read_left_out():
    """Names of the tests that the older Blender leaves out."""
    return {*HERE.joinpath("left_out.txt").read_text("utf-8").splitlines()}


@pytest.fixture(scope="session", autouse=True)
def extension():
    """The loaded extension module; on for the whole session, off at its end."""
    module = addon_utils.enable(EXTENSION, default_set=True)
    assert module is not None, "the extension could not be enabled; see the traceback above"
    yield module
    addon_utils.disable(EXTENSION, default_set=True)


@pytest.fixture(scope="session", autouse=True)
def work_cache(extension, tmp_path_factory):
    """What the core works out again and again is worked out once for the same order; in `make test` for all runs."""
    import cached_work

    shared = os.environ.get("TESTS_CACHE")
    folder = pathlib.Path(shared, "work") if shared else None
    with pytest.MonkeyPatch.context() as monkeypatch:
        yield cached_work.cache_functions(monkeypatch, f"{EXTENSION}.beyond_mocap", tmp_path_factory.getbasetemp(),
                                          folder)


@pytest.fixture(scope="session", autouse=True)
def light_bodies(core):
    """Players have the light body, whose 2,000 faces are made, saved and undone sooner than 14,000; the module that
    looks at the full one takes it back (`full_bodies`)."""
    read = core("appearance.template").read_template
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(core("appearance.body"), "read_template", lambda light: read(True))
        yield


@pytest.fixture(scope="module")
def full_bodies(core):
    """Players have the body that users see."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(core("appearance.body"), "read_template", core("appearance.template").read_template)
        yield


@pytest.fixture(autouse=True)
def empty_scene(extension):
    """An empty file before each test; keeps the extension on (a factory reset would not)."""
    bpy.ops.wm.read_homefile(use_empty=True)


@pytest.fixture(scope="session")
def library_folder(core, tmp_path_factory):
    """A few clips of the sample, their library built and its synthetic clips made: seconds of work, done once, in
    `make test` for all its runs.

    Here, because a fixture that test files import from each other is set up again in each of them."""
    import worlds

    folder, cache = tmp_path_factory.mktemp("library"), find_shared_folder(tmp_path_factory) / "few_clips"
    for name in worlds.CLIPS:
        for suffix in (".bvh", ".txt"):
            (folder / f"{name}{suffix}").symlink_to(worlds.SAMPLE / f"{name}{suffix}")
    assert core("library.build").build_library(folder, cache_dir=cache).with_synthetic_clips.clips
    shutil.copytree(cache, folder / ".beyond_mocap")
    return folder


def find_shared_folder(tmp_path_factory):
    """Find the folder that all runs of `make test` share, or one of this run."""
    return pathlib.Path(os.environ.get("TESTS_CACHE") or tmp_path_factory.mktemp("caches"))


@pytest.fixture(scope="session")
def sample_cache(core, tmp_path_factory):
    """The cache of the sample's whole library, with its synthetic clips; in `make test` the core's tests make it."""
    folder = find_shared_folder(tmp_path_factory) / "sample_cache"
    assert core("library.build").build_library(SOURCE / "sample_blend" / "library",
                                               cache_dir=folder).with_synthetic_clips.clips
    return folder


@pytest.fixture(scope="session")
def core(extension):
    """Import a core module by its dotted name below the core: `core("motion.quaternion")`; `core()` is the core."""
    def module(name=""):
        return import_module(f"{EXTENSION}.beyond_mocap" + (f".{name}" if name else ""))
    return module
