"""What the library has for labels: how many of its recordings show them, or what comes nearest."""

from __future__ import annotations

import weakref
from typing import NamedTuple

import bpy
import numpy as np

from ...beyond_mocap.annotation.vocabulary import find_nearest_labels, sort_labels
from ...beyond_mocap.base.errors import format_count
from .label_checks import find_built_library

_cache: weakref.WeakKeyDictionary = weakref.WeakKeyDictionary()  # library -> (labels, ...) -> Offer


class Offer(NamedTuple):
    """What a library has for labels.

    Attributes:
        clips: how many recordings show all of them, mirrored ones as their own where those are allowed.
        nearest: the labels that come nearest, where none does.
    """

    clips: int
    nearest: tuple[str, ...] = ()


def find_offer(scene: bpy.types.Scene, words: tuple[str, ...], is_span: bool) -> Offer | None:
    """Find what the library of the scene's folder has for labels; None where none is built in this session.

    Args:
        scene: for the library, and whether mirrored clips are allowed.
        words: labels.
        is_span: of a span, else of a key moment.
    Returns:
        The offer.
    """
    library = find_built_library(scene)
    if library is None or not words:
        return None
    offers, key = _cache.setdefault(library, {}), (words, is_span, scene.beyond_mocap.mirror)
    if key not in offers:
        offers[key] = _compute_offer(library, *key)
    return offers[key]


def describe_offer(scene: bpy.types.Scene, words: tuple[str, ...], is_span: bool) -> str:
    """Describe what the library has in one line; "" where no library is built or nothing is asked for."""
    offer = find_offer(scene, words, is_span)
    if offer is None:
        return ""
    if offer.clips:
        has = "clip has" if offer.clips == 1 else "clips have"
        return f"{offer.clips} {has} {' '.join(words)}"
    return f"{format_count(0, 'clip')}; nearest: {' '.join(offer.nearest) or 'nothing'}"


def _compute_offer(library, words: tuple[str, ...], is_span: bool, mirror: bool) -> Offer:
    wanted, allowed = frozenset(words), [mirror or not clip.mirrored for clip in library.clips]
    shown = _list_spans(library) if is_span else [(key.clip, frozenset(key.labels)) for key in library.keys
                                                  if not library.clips[key.clip].is_synthetic]
    shown = [(clip, labels) for clip, labels in shown if allowed[clip]]
    clips = {clip for clip, labels in shown if wanted <= labels}
    nearest = () if clips else find_nearest_labels(words, (sort_labels(labels) for _, labels in shown), 1)
    return Offer(len(clips), nearest[0] if nearest else ())


def _list_spans(library) -> list[tuple[int, frozenset[str]]]:
    """List (clip, labels) of all stretches of the library's frames, each combination of a clip once."""
    frames = library.frames
    rows = np.unique(np.column_stack([frames.clip, frames.words]), axis=0)
    return [(int(clip), frozenset(word for word, has in zip(frames.vocabulary, row) if has)) for clip, *row in rows]
