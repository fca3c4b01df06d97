"""A motion put into a library's folder, with its words beside it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..annotation import ClipAnnotation
from ..annotation.timeline import checked_words
from ..annotation.vocabulary import vocabulary_words
from ..base.errors import InputError
from ..files.bvh import bvh
from ..motion.motion import Motion
from .keep_words import has_words, keep


def plain_words(words: Sequence[str]) -> tuple[str, ...]:
    """The words of an annotation as they are written, also of several in one text. InputError for one that is none."""
    return checked_words(" ".join(words).split(), "words")


def free_place(folder: Path, name: str) -> Path:
    """Where a clip of that name goes. InputError where the folder is none, the name is none, or it is taken."""
    if not folder.is_dir():
        raise InputError(folder, "is not a folder", "a library's folder", "make the folder first")
    if not name.strip() or Path(name).name != name:
        raise InputError(repr(name), "is no name for a clip", "a file name without a folder", "choose another name")
    clip = folder / f"{name}.bvh"
    if clip.exists():
        raise InputError(clip, "is there already", "a name that is free", "rename the trial or the clip")
    return clip


def add_clip(
    folder: Path, name: str, motion: Motion, words: Sequence[str] = (), key_seconds: float | None = None
) -> list[str]:
    """Writes NAME.bvh into a library's folder and, where there are words, NAME.txt; returns lines for people.

    words: of the annotation; with key_seconds, from the motion's first frame, they name that moment, else the whole
    motion. Nothing that is there is replaced. InputError where it cannot be written, a word is none, or the key lies
    outside.
    """
    clip, words = free_place(folder, name), plain_words(words)
    key = None if key_seconds is None else round(key_seconds * motion.fps)
    if key is not None and not 0 <= key < len(motion):
        raise InputError(clip, f"its key lies at {key_seconds:.3f} s", f"0 to {motion.duration:.3f} s")
    rows = [ClipAnnotation(key, key, key, words)] if key is not None else []
    if words and key is None:
        rows = [ClipAnnotation(0, len(motion) - 1, None, words)]
    if words and has_words(clip, folder, motion.fps):
        raise InputError(clip.with_suffix(".txt"), "has words already", "a name that is free", "rename the clip")
    bvh.write(clip, motion)
    if words:
        keep(clip, folder, rows, motion.fps)
    strangers = sorted(set(words) - vocabulary_words())
    told = [f"{clip}: {' '.join(words) or 'without words'}"]
    return [*told, *(f"{word}: a word of this library's own" for word in strangers)]
