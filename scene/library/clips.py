"""The library's clips as a list for browsing, stored on the window manager: neither saved with a file nor undone.

The complete list is kept in this module; the panel's list shows the clips that match the search, in the chosen order.
Both properties update the list when they are set, so that drawing costs nothing.

A thread checks from time to time whether the library's folder has changed and shows a message; it never builds. The
folder is only listed (names, sizes, times). A missing folder is searched beside the .blend: a project that was copied
as a whole still finds its library.
"""

import math
import os
import threading
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ...beyond_mocap.base.errors import format_count
from ..core import window
from ..core.live import Watcher
from ..core.settings import to_absolute_path

if TYPE_CHECKING:
    from ...beyond_mocap.library.listing import ListedClip

ORDERS = (("NAME", "Name", "By folder and name"),
          ("WORDS", "Labels", "By key moment or gait"),
          ("SECONDS", "Length", "Longest first"),
          ("SPEED", "Speed", "Fastest first"),
          ("QUALITY", "Quality", "Best first"))

SCAN_INTERVAL = 4.0  # seconds between two scans of the folder

_scan_state: dict = {}  # the scanning thread and its result


class _Listing:
    """The last listing: the clips, and the files at that time (`list_files`)."""

    def __init__(self):
        self.clips: tuple[ListedClip, ...] = ()
        self.files: dict[str, tuple[int, int]] = {}


def _on_filter_change(_self, context):
    update_list(context.window_manager)


class BeyondMocapClip(bpy.types.PropertyGroup):
    """One clip of the list; `name` is its file's name without ending"""

    path: StringProperty(name="File", description="Below the library's folder")
    words: StringProperty(name="Labels", description="All labels of the clip")
    brief: StringProperty(name="Shows", description="The clip's first label")
    seconds: FloatProperty(name="Length", unit="TIME_ABSOLUTE", description="Seconds")
    figures: StringProperty(name="Figures", description="Length and speeds")
    mark: IntProperty(name="Quality", description="0 good, 1 fair, 2 poor, 3 not measured")
    messages: StringProperty(name="Quality", description="Lines with a name and a value")


class BeyondMocapClips(bpy.types.PropertyGroup):
    """The list of clips, its search and its order"""

    attached_to = ("WindowManager.beyond_mocap_clips",)
    folder: StringProperty(description="The library folder of the list")
    shown: CollectionProperty(type=BeyondMocapClip, description="The clips that match the search")
    active: IntProperty(name="Clip", min=0, description="The clip described below the list")
    total: IntProperty(description="Number of clips in the library")
    find: StringProperty(
        name="Find", options={"TEXTEDIT_UPDATE"}, update=_on_filter_change,
        description="Show only clips whose name or labels contain all of these words",
    )
    order: EnumProperty(name="Order", items=ORDERS, update=_on_filter_change, description="Order of the clips")
    missing: BoolProperty(description="Whether the library folder was missing at the last check")
    news: StringProperty(description="Changes in the folder since the list was filled; empty for none")


def store_clips(manager: bpy.types.WindowManager, folder: str, clips, files) -> None:
    """Store the clips of a library in the list.

    Args:
        manager: the window manager.
        folder: as the setting spells it.
        clips: all of them.
        files: as `list_files` returned them.
    """
    _listing.clips, _listing.files = tuple(clips), dict(files)
    manager.beyond_mocap_clips.folder = folder
    manager.beyond_mocap_clips.news = ""
    manager.beyond_mocap_clips.missing = False
    update_list(manager)


def update_labels(manager: bpy.types.WindowManager, path: str, rows) -> None:
    """Update the labels of a clip that were just written, from its annotation rows."""
    from ...beyond_mocap.library.listing import collect_labels

    words, moments = collect_labels(rows)
    _listing.clips = tuple(
        replace(clip, labels=words, key_moments=moments) if clip.path == path else clip for clip in _listing.clips
    )
    update_list(manager)


def clear_clips(manager: bpy.types.WindowManager | None = None) -> None:
    """Clear the list."""
    _listing.clips, _listing.files = (), {}
    if manager is not None:
        manager.beyond_mocap_clips.folder = manager.beyond_mocap_clips.news = ""
        update_list(manager)


def find_listed_files() -> dict[str, tuple[int, int]]:
    """Return the library's files when the list was filled: path -> size and modification time."""
    return _listing.files


def update_list(manager: bpy.types.WindowManager) -> None:
    """Show the clips that match, in order; the active one stays active if it is still shown."""
    listing = manager.beyond_mocap_clips
    before = find_active_clip(manager)
    path = before.path if before is not None else ""
    listing.shown.clear()
    from ...beyond_mocap.annotation.labels import find_label

    listing.total = len(_listing.clips)
    search_terms = listing.find.lower().split()
    chosen = [clip for clip in _listing.clips if all(_matches(clip, word) for word in search_terms)]
    for clip in sorted(chosen, key=_KEYS[listing.order]):
        row = listing.shown.add()
        row.name, row.path, row.words = Path(clip.path).stem, clip.path, " ".join(clip.labels)
        row.brief = find_label(clip.labels[0]).title if clip.labels else "no labels"
        row.seconds, row.mark = clip.seconds, clip.grade
        row.figures, row.messages = _describe_figures(clip), "\n".join(clip.details)
    paths = [row.path for row in listing.shown]
    listing.active = paths.index(path) if path in paths else 0


def find_active_clip(manager: bpy.types.WindowManager) -> BeyondMocapClip | None:
    """Return the clip chosen in the list; None while it is empty."""
    listing = manager.beyond_mocap_clips
    return listing.shown[listing.active] if 0 <= listing.active < len(listing.shown) else None


def list_files(folder: str) -> dict[str, tuple[int, int]] | None:
    """List all recordings and label files below a folder: path -> (size, modification time in ns); None without the
    folder.

    Uses plain strings and few calls, since it shares the interpreter with the window.
    """
    if not os.path.isdir(folder):
        return None
    sizes = {}
    for path in _iter_files(folder):
        try:
            status = os.stat(path)
        except OSError:
            continue
        sizes[os.path.relpath(path, folder)] = (status.st_size, status.st_mtime_ns)
    return sizes


def holds_recordings(folder: str) -> bool:
    """Whether there is any recording below a folder; stops at the first."""
    return any(not _is_label_file(path) for path in _iter_files(folder))


def describe_changes(before: dict, now: dict) -> str:
    """Describe in one line what is new, changed or removed between two scans; empty for no change."""
    kinds = {"clip": lambda name: not _is_label_file(name), "label file": _is_label_file}
    parts = []
    for kind, is_kind in kinds.items():
        new = [name for name in now if name not in before and is_kind(name)]
        removed = [name for name in before if name not in now and is_kind(name)]
        changed = [name for name in now if name in before and now[name] != before[name] and is_kind(name)]
        for names, what in ((new, "new"), (changed, "changed"), (removed, "removed")):
            if names:
                parts.append(format_count(len(names), f"{what} {kind}"))
    return ", ".join(parts)


def find_moved_folder(folder: str, blend: str) -> str:
    """Find the new place of a missing folder: its own last parts, as many as match, beside the .blend or above it.

    Args:
        folder, blend: absolute paths.
    Returns:
        The folder; empty where no such folder with recordings exists.
    """
    parts = Path(folder).parts[1:]
    for count in range(len(parts), 0, -1):
        for place in list(Path(blend).parents)[:4]:
            tried = place.joinpath(*parts[-count:])
            if tried.is_dir() and holds_recordings(str(tried)):
                return str(tried)
    return ""


def check_folder(scene: bpy.types.Scene) -> None:
    """Update whether the scene's library folder is missing."""
    folder = to_absolute_path(scene.beyond_mocap.library_folder)
    listing = bpy.context.window_manager.beyond_mocap_clips
    listing.missing = bool(folder) and not os.path.isdir(folder)


def relink_library(scene: bpy.types.Scene) -> str:
    """Relink the scene's missing library folder to one beside the .blend; returns the new folder or ""."""
    settings = scene.beyond_mocap
    folder = to_absolute_path(settings.library_folder)
    if not folder or os.path.isdir(folder) or not bpy.data.filepath:
        return ""
    found = find_moved_folder(folder, bpy.data.filepath)
    if found:
        settings.library_folder = bpy.path.relpath(found)
    return found


def _matches(clip: "ListedClip", term: str) -> bool:
    return term in clip.path.lower() or any(word.startswith(term) for word in clip.labels)


def _describe_figures(clip: "ListedClip") -> str:
    """Describe length, speeds and key moments of a clip."""
    text = f"{clip.seconds:.1f} s" if clip.seconds else "unknown length"
    if not math.isnan(clip.speed):
        text += f", {clip.speed:.1f} m/s (to {clip.max_speed:.1f})"
    if clip.key_moments:
        text += f", {format_count(clip.key_moments, 'key moment')}"
    return text


def _is_label_file(name: str) -> bool:
    return name.lower().endswith((".txt", ".csv"))


def _iter_files(folder: str):
    """Iterate over the paths of all recordings and label files below a folder; links are followed, each folder once."""
    from ...beyond_mocap.files.clip_file import CLIP_ENDINGS, FOREIGN, is_clip_file
    from ...beyond_mocap.files.file_names import identify_file
    from ...beyond_mocap.library.folder.annotations import TABLE_NAME
    from ...beyond_mocap.library.folder.recordings import CACHE_FOLDER
    from ...beyond_mocap.library.recorded_ball.ball_table import ENDING

    wanted, seen = (*CLIP_ENDINGS, ".txt", TABLE_NAME, ENDING, *FOREIGN), set()
    for here, folders, files in os.walk(folder, followlinks=True):
        try:
            identity = identify_file(here)
        except OSError:
            continue
        if identity in seen:
            folders.clear()
            continue
        seen.add(identity)
        folders[:] = [name for name in folders if name != CACHE_FOLDER]
        paths = (os.path.join(here, name) for name in files if name.lower().endswith(wanted))
        yield from (path for path in paths if is_clip_file(Path(path)))


def _after_load() -> None:
    manager = bpy.context.window_manager
    clear_clips(manager)
    for scene in [scene for scene in bpy.data.scenes if scene.library is None]:
        found = relink_library(scene)
        if found:
            print(f"Beyond Mocap: the library folder of {scene.name} was moved and is now {found}")
    check_folder(bpy.context.scene)


def _scan_folder() -> float:
    """Start a scan when due; apply the result of a finished one. Returns seconds until the next call."""
    scene, manager = bpy.context.scene, bpy.context.window_manager
    if scene is None or not scene.beyond_mocap.library_watch:
        _scan_state.clear()
        return SCAN_INTERVAL
    thread = _scan_state.get("thread")
    if thread is None:
        _start_scan(to_absolute_path(scene.beyond_mocap.library_folder))
        return 0.5
    if thread.is_alive():
        return 0.5
    _apply_scan(manager, scene.beyond_mocap.library_folder)
    _scan_state.clear()
    return SCAN_INTERVAL


def _start_scan(folder: str) -> None:
    def run_scan():
        result["files"] = list_files(folder) if folder else {}

    result: dict = {}
    thread = threading.Thread(target=run_scan, name="beyond-mocap watch", daemon=True)
    _scan_state.update(saw=result, folder=folder, thread=thread)
    thread.start()


def _apply_scan(manager: bpy.types.WindowManager, setting: str) -> None:
    """Write the scan's result if it is new, and redraw."""
    listing = manager.beyond_mocap_clips
    if _scan_state["folder"] != to_absolute_path(setting) or "files" not in _scan_state[
            "saw"]:  # stale, or the scan failed
        return
    files_now = _scan_state["saw"]["files"]
    missing = files_now is None
    news = describe_changes(find_listed_files(), files_now) if not missing and listing.folder == setting else ""
    if (listing.missing, listing.news) != (missing, news):
        listing.missing, listing.news = missing, news
        window.redraw_editors()


def _stop_scan() -> None:
    _scan_state.clear()
    clear_clips()


_listing = _Listing()
_KEYS = {"NAME": lambda clip: clip.path.lower(),
         "WORDS": lambda clip: (not clip.labels, clip.labels, clip.path),
         "SECONDS": lambda clip: (-clip.seconds, clip.path),
         "SPEED": lambda clip: (1.0 if math.isnan(clip.speed) else -clip.speed, clip.path),
         "QUALITY": lambda clip: (clip.grade, clip.path)}
WATCHER = Watcher(name="Watching the library", loaded=_after_load, look=_scan_folder, ends=_stop_scan)
