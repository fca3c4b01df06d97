"""Looks from time to time whether a library's folder has changed, in a thread, and says so; it never builds by itself.

The folder is only listed (names, sizes, times). Where it is gone, it is looked for beside the file: a project that was
copied elsewhere as a whole still finds its library.
"""

from __future__ import annotations

import os
import threading
from pathlib import Path

import bpy

from ..core import window
from ..core.live import Watcher
from ..core.settings import absolute
from . import clips

SECONDS = 4.0  # between two looks

_look: dict = {}  # the thread that is looking, and what it saw


def look(folder: str) -> dict[str, tuple[int, int]] | None:
    """All recordings and words below a folder: path -> (size, time of change in ns); None where there is no folder.

    Plain strings and as few calls as can be, since it shares the interpreter with the window.
    """
    if not os.path.isdir(folder):
        return None
    found = {}
    for path in _below(folder):
        try:
            status = os.stat(path)
        except OSError:
            continue
        found[os.path.relpath(path, folder)] = (status.st_size, status.st_mtime_ns)
    return found


def holds_recordings(folder: str) -> bool:
    """Whether there is any recording below a folder; looks no farther than the first."""
    return any(not _is_words(path) for path in _below(folder))


def _is_words(name: str) -> bool:
    return name.lower().endswith((".txt", ".csv"))


def _below(folder: str):
    """The paths of all recordings and words below a folder; links are followed, each folder is looked into once."""
    from ...beyond_mocap.library.scan import CACHE_FOLDER, FOREIGN, TABLE_NAME

    wanted, seen = (".bvh", ".txt", TABLE_NAME, *FOREIGN), set()
    for here, folders, files in os.walk(folder, followlinks=True):
        try:
            status = os.stat(here)
        except OSError:
            continue
        if (status.st_dev, status.st_ino) in seen:
            folders.clear()
            continue
        seen.add((status.st_dev, status.st_ino))
        folders[:] = [name for name in folders if name != CACHE_FOLDER]
        yield from (os.path.join(here, name) for name in files if name.lower().endswith(wanted))


def news(before: dict, now: dict) -> str:
    """What is new, changed or gone between two looks, in a line; empty where all is as it was."""
    kinds = {"clip": lambda name: not _is_words(name), "words file": _is_words}
    told = []
    for kind, is_kind in kinds.items():
        new = [name for name in now if name not in before and is_kind(name)]
        gone = [name for name in before if name not in now and is_kind(name)]
        changed = [name for name in now if name in before and now[name] != before[name] and is_kind(name)]
        for names, what in ((new, "new"), (changed, "changed"), (gone, "gone")):
            if names:
                told.append(f"{len(names)} {what} {kind}{'' if len(names) == 1 else 's'}")
    return ", ".join(told)


def found_again(folder: str, blend: str) -> str:
    """Where a missing folder may be now: its own last parts, as many as fit, beside the file or above it; empty where
    there is no such folder with recordings. folder, blend: absolute paths."""
    parts = Path(folder).parts[1:]
    for count in range(len(parts), 0, -1):
        for place in list(Path(blend).parents)[:4]:
            tried = place.joinpath(*parts[-count:])
            if tried.is_dir() and holds_recordings(str(tried)):
                return str(tried)
    return ""


def check(scene: bpy.types.Scene) -> None:
    """Notes whether the scene's library folder is there."""
    folder = absolute(scene.beyond_mocap.library_folder)
    listing = bpy.context.window_manager.beyond_mocap_clips
    listing.missing = bool(folder) and not os.path.isdir(folder)


def relink(scene: bpy.types.Scene) -> str:
    """Where the scene's library folder is missing and lies beside the file, set it so; returns the new place or ""."""
    settings = scene.beyond_mocap
    folder = absolute(settings.library_folder)
    if not folder or os.path.isdir(folder) or not bpy.data.filepath:
        return ""
    found = found_again(folder, bpy.data.filepath)
    if found:
        settings.library_folder = bpy.path.relpath(found)
    return found


def _after_load() -> None:
    manager = bpy.context.window_manager
    clips.clear(manager)
    for scene in [scene for scene in bpy.data.scenes if scene.library is None]:
        found = relink(scene)
        if found:
            print(f"Beyond Mocap: the library of {scene.name} was moved and found again in {found}")
    check(bpy.context.scene)


def _tick() -> float:
    """Start a look where one is asked for and none runs; take in what it saw."""
    scene, manager = bpy.context.scene, bpy.context.window_manager
    if scene is None or not scene.beyond_mocap.library_watch:
        _look.clear()
        return SECONDS
    thread = _look.get("thread")
    if thread is None:
        _begin(absolute(scene.beyond_mocap.library_folder))
        return 0.5
    if thread.is_alive():
        return 0.5
    _take_in(manager, scene.beyond_mocap.library_folder)
    _look.clear()
    return SECONDS


def _begin(folder: str) -> None:
    def work():
        saw["files"] = look(folder) if folder else {}

    saw: dict = {}
    _look.update(saw=saw, folder=folder, thread=threading.Thread(target=work, name="beyond-mocap watch", daemon=True))
    _look["thread"].start()


def _take_in(manager: bpy.types.WindowManager, setting: str) -> None:
    """Writes what was seen, where it is news, and has it drawn."""
    listing = manager.beyond_mocap_clips
    if _look["folder"] != absolute(setting) or "files" not in _look["saw"]:  # moved on, or the look failed
        return
    saw = _look["saw"]["files"]
    missing = saw is None
    told = news(clips.files(), saw) if not missing and listing.folder == setting else ""
    if (listing.missing, listing.news) != (missing, told):
        listing.missing, listing.news = missing, told
        window.redraw()


def _end() -> None:
    _look.clear()
    clips.clear()


WATCHER = Watcher(name="Watching the library", loaded=_after_load, look=_tick, ends=_end)
