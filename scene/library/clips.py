"""The library's clips as a list to look through, on the window manager: it is not saved with a file, nor undone.

What was listed is kept here in full; the list shows what fits the words that are looked for, in the chosen order. Both
change it when they are set, so that drawing it costs nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ...beyond_mocap.annotation.labels import find_label

if TYPE_CHECKING:
    from ...beyond_mocap.library.listing import Listed

ORDERS = (
    ("NAME", "Name", "By folder and name"),
    ("WORDS", "Words", "By key moment or gait"),
    ("SECONDS", "Length", "Longest first"),
    ("SPEED", "Speed", "Fastest first"),
    ("QUALITY", "Quality", "Best first"),
)


@dataclass
class _Kept:
    """What was listed last: the clips, and the files as they were then (`watch`)."""

    clips: tuple["Listed", ...] = ()
    files: dict[str, tuple[int, int]] = field(default_factory=dict)


_kept = _Kept()


def _refill(_self, context):
    fill(context.window_manager)


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
    """List the clips of a library. folder: as the setting spells it; files: what `watch.look` saw."""
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


def _fits(clip: "Listed", asked: str) -> bool:
    return asked in clip.path.lower() or any(word.startswith(asked) for word in clip.words)


def _figures(clip: "Listed") -> str:
    text = f"{clip.seconds:.1f} s" if clip.seconds else "length not known"
    if not math.isnan(clip.speed):
        text += f", {clip.speed:.1f} m/s (to {clip.fastest:.1f})"
    if clip.moments:
        text += f", {clip.moments} {'moment' if clip.moments == 1 else 'moments'}"
    return text


def _fast(clip: "Listed") -> float:
    return -1.0 if math.isnan(clip.speed) else clip.speed


_KEYS = {
    "NAME": lambda clip: clip.path.lower(),
    "WORDS": lambda clip: (not clip.words, clip.words, clip.path),
    "SECONDS": lambda clip: (-clip.seconds, clip.path),
    "SPEED": lambda clip: (-_fast(clip), clip.path),
    "QUALITY": lambda clip: (clip.mark, clip.path),
}
