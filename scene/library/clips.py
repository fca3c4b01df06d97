"""The library's clips as a list to look through, on the window manager: it is not saved with a file, nor undone.

What was listed is kept here in full; the list shows what fits the words that are looked for, in the chosen order. Both
change it when they are set, so that drawing it costs nothing.

From time to time a thread looks whether the library's folder has changed, and says so; it never builds by itself. The
folder is only listed (names, sizes, times). Where it is gone, it is looked for beside the file: a project that was
copied elsewhere as a whole still finds its library.
"""

from __future__ import annotations

import math
import os
import threading
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ...beyond_mocap.annotation.labels import find_label
from ..core import window
from ..core.live import Watcher
from ..core.settings import absolute

if TYPE_CHECKING:
    from ...beyond_mocap.library.listing import Listed

ORDERS = (("NAME", "Name", "By folder and name"),
          ("WORDS", "Words", "By key moment or gait"),
          ("SECONDS", "Length", "Longest first"),
          ("SPEED", "Speed", "Fastest first"),
          ("QUALITY", "Quality", "Best first"))

SECONDS = 4.0  # between two looks

_looking: dict = {}  # the thread that is looking, and what it saw


@dataclass
class _Kept:
    """What was listed last: the clips, and the files as they were then (`list_files`)."""

    clips: tuple["Listed", ...] = ()
    files: dict[str, tuple[int, int]] = field(default_factory=dict)


class BeyondMocapClip(bpy.types.PropertyGroup):
    """One clip of the list; `name` is its file's name without ending."""

    path: StringProperty(name="File", description="Below the library's folder")
    words: StringProperty(name="Words", description="All words that it carries")
    brief: StringProperty(name="Shows", description="The first of its words")
    seconds: FloatProperty(name="Length", unit="TIME_ABSOLUTE", description="Seconds")
    figures: StringProperty(name="Figures", description="Length and speeds")
    mark: IntProperty(name="Quality", description="0 good, 1 fair, 2 poor, 3 not measured")
    told: StringProperty(name="Quality", description="Lines 'name: value'")


class BeyondMocapClips(bpy.types.PropertyGroup):
    """The list of clips, and how it is looked through."""

    attached_to = ("WindowManager.beyond_mocap_clips",)
    folder: StringProperty(description="The setting of the library's folder when the list was filled")
    shown: CollectionProperty(type=BeyondMocapClip, description="The clips that fit what is looked for")
    active: IntProperty(name="Clip", min=0, description="The clip that is described below the list")
    total: IntProperty(description="Number of clips, shown or not")
    find: StringProperty(
        name="Find", options={"TEXTEDIT_UPDATE"}, update=_refill,
        description="Show only clips with this in their name or words; of several words each has to be there",
    )
    order: EnumProperty(name="Order", items=ORDERS, update=_refill, description="Order of the clips")
    missing: BoolProperty(description="Whether the library's folder was not there when it was last looked for")
    news: StringProperty(description="What has changed in the folder since the list was filled; empty: nothing")


def keep(manager: bpy.types.WindowManager, folder: str, clips, files) -> None:
    """List the clips of a library. folder: as the setting spells it; files: what `list_files` saw."""
    _kept.clips, _kept.files = tuple(clips), dict(files)
    manager.beyond_mocap_clips.folder = folder
    manager.beyond_mocap_clips.news = ""
    manager.beyond_mocap_clips.missing = False
    fill(manager)


def say(manager: bpy.types.WindowManager, path: str, rows) -> None:
    """Show the words of a clip as they were just written: `ClipAnnotation`s."""
    from ...beyond_mocap.library.listing import words_of

    words, moments = words_of(rows)
    _kept.clips = tuple(
        replace(clip, words=words, moments=moments) if clip.path == path else clip for clip in _kept.clips
    )
    fill(manager)


def clear(manager: bpy.types.WindowManager | None = None) -> None:
    """Forget the list."""
    _kept.clips, _kept.files = (), {}
    if manager is not None:
        manager.beyond_mocap_clips.folder = manager.beyond_mocap_clips.news = ""
        fill(manager)


def files() -> dict[str, tuple[int, int]]:
    """The library's files when the list was filled: path -> size and time of change."""
    return _kept.files


def fill(manager: bpy.types.WindowManager) -> None:
    """Show the clips that fit, in order; the active one stays active where it is still shown."""
    listing = manager.beyond_mocap_clips
    before = active(manager)
    path = before.path if before is not None else ""
    listing.shown.clear()
    listing.total = len(_kept.clips)
    asked = listing.find.lower().split()
    chosen = [clip for clip in _kept.clips if all(_fits(clip, word) for word in asked)]
    for clip in sorted(chosen, key=_KEYS[listing.order]):
        row = listing.shown.add()
        row.name, row.path, row.words = Path(clip.path).stem, clip.path, " ".join(clip.words)
        row.brief = find_label(clip.words[0]).title if clip.words else "no words"
        row.seconds, row.mark = clip.seconds, clip.mark
        row.figures, row.told = _figures(clip), "\n".join(clip.told)
    paths = [row.path for row in listing.shown]
    listing.active = paths.index(path) if path in paths else 0


def active(manager: bpy.types.WindowManager) -> BeyondMocapClip | None:
    """The clip chosen in the list; None while it is empty."""
    listing = manager.beyond_mocap_clips
    return listing.shown[listing.active] if 0 <= listing.active < len(listing.shown) else None


def list_files(folder: str) -> dict[str, tuple[int, int]] | None:
    """All recordings and words below a folder: path -> (size, time of change in ns); None where there is no folder.

    Plain strings and as few calls as can be, since it shares the interpreter with the window."""
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


def tell_news(before: dict, now: dict) -> str:
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


def check_folder(scene: bpy.types.Scene) -> None:
    """Notes whether the scene's library folder is there."""
    folder = absolute(scene.beyond_mocap.library_folder)
    listing = bpy.context.window_manager.beyond_mocap_clips
    listing.missing = bool(folder) and not os.path.isdir(folder)


def relink_library(scene: bpy.types.Scene) -> str:
    """Where the scene's library folder is missing and lies beside the file, set it so; returns the new place or ""."""
    settings = scene.beyond_mocap
    folder = absolute(settings.library_folder)
    if not folder or os.path.isdir(folder) or not bpy.data.filepath:
        return ""
    found = found_again(folder, bpy.data.filepath)
    if found:
        settings.library_folder = bpy.path.relpath(found)
    return found


def _refill(_self, context):
    fill(context.window_manager)


def _fits(clip: "Listed", asked: str) -> bool:
    return asked in clip.path.lower() or any(word.startswith(asked) for word in clip.words)


def _figures(clip: "Listed") -> str:
    text = f"{clip.seconds:.1f} s" if clip.seconds else "length not known"
    if not math.isnan(clip.speed):
        text += f", {clip.speed:.1f} m/s (to {clip.fastest:.1f})"
    if clip.moments:
        text += f", {clip.moments} {'moment' if clip.moments == 1 else 'moments'}"
    return text


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


def _after_load() -> None:
    manager = bpy.context.window_manager
    clear(manager)
    for scene in [scene for scene in bpy.data.scenes if scene.library is None]:
        found = relink_library(scene)
        if found:
            print(f"Beyond Mocap: the library of {scene.name} was moved and found again in {found}")
    check_folder(bpy.context.scene)


def _look_again() -> float:
    """Start a look where one is asked for and none runs; take in what it saw."""
    scene, manager = bpy.context.scene, bpy.context.window_manager
    if scene is None or not scene.beyond_mocap.library_watch:
        _looking.clear()
        return SECONDS
    thread = _looking.get("thread")
    if thread is None:
        _begin(absolute(scene.beyond_mocap.library_folder))
        return 0.5
    if thread.is_alive():
        return 0.5
    _take_in(manager, scene.beyond_mocap.library_folder)
    _looking.clear()
    return SECONDS


def _begin(folder: str) -> None:
    def work():
        saw["files"] = list_files(folder) if folder else {}

    saw: dict = {}
    thread = threading.Thread(target=work, name="beyond-mocap watch", daemon=True)
    _looking.update(saw=saw, folder=folder, thread=thread)
    thread.start()


def _take_in(manager: bpy.types.WindowManager, setting: str) -> None:
    """Writes what was seen, where it is news, and has it drawn."""
    listing = manager.beyond_mocap_clips
    if _looking["folder"] != absolute(setting) or "files" not in _looking["saw"]:  # moved on, or the look failed
        return
    saw = _looking["saw"]["files"]
    missing = saw is None
    told = tell_news(files(), saw) if not missing and listing.folder == setting else ""
    if (listing.missing, listing.news) != (missing, told):
        listing.missing, listing.news = missing, told
        window.redraw()


def _end() -> None:
    _looking.clear()
    clear()


_kept = _Kept()
_KEYS = {"NAME": lambda clip: clip.path.lower(),
         "WORDS": lambda clip: (not clip.words, clip.words, clip.path),
         "SECONDS": lambda clip: (-clip.seconds, clip.path),
         "SPEED": lambda clip: (1.0 if math.isnan(clip.speed) else -clip.speed, clip.path),
         "QUALITY": lambda clip: (clip.mark, clip.path)}
WATCHER = Watcher(name="Watching the library", loaded=_after_load, look=_look_again, ends=_end)
