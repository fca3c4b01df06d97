"""Which clip stands for which gait, as a user writes it."""

from __future__ import annotations

from collections.abc import Iterable

from ...errors import InputError


def gait_choices(texts: Iterable[str]) -> tuple[tuple[str, str], ...]:
    """(gait word, clip) of each text "WORD=CLIP", blanks around either left out; InputError for any other text and for
    a word that comes twice."""
    pairs = []
    for text in texts:
        word, _, clip = (part.strip() for part in text.partition("="))
        if not word or not clip:
            raise InputError("--gait", f"{text!r}", "WORD=CLIP, such as walking=folder/walk.bvh")
        if word.lower() in dict(pairs):
            raise InputError("--gait", f"{word!r} twice", "one clip for each gait")
        pairs.append((word.lower(), clip.replace("\\", "/")))
    return tuple(pairs)
