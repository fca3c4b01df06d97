"""Preferences of a player that are no order: clips of a style rather than others, and the strong foot."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fnmatch import fnmatchcase
from pathlib import PurePosixPath

import numpy as np

from ...annotation.ball_contact import may_use_foot
from ...annotation.vocabulary import SIDES
from ...library.keys import Key
from ...library.library import Library

WEAK_FOOT_COST = 1.5
"""What serving a key moment by the weak foot costs, in metres per second of missed speed."""

_SIDES = frozenset(SIDES)


def off_style_cost(library: Library, style: Sequence[str], weight: float, warnings: list[str]) -> np.ndarray | None:
    """(N,) float32: `weight` for library frames that neither carry a word of `style` nor belong to a clip that one of
    its patterns names; None where there is no style. A pattern that names nothing is told in `warnings`."""
    if not style or not weight:
        return None
    frames = library.frames
    matches = np.zeros(len(frames), bool)
    for entry in style:
        word, clips = entry.lower(), np.array([named_by(clip.path, entry) for clip in library.clips])
        carries = frames.words[:, [i for i, known in enumerate(frames.vocabulary) if known == word]].any(axis=1)
        if not carries.any() and not clips.any():
            warnings.append(f"style '{entry}': the library has no such word, folder or clip")
        matches |= carries | clips[frames.clip]
    return np.where(matches, 0.0, weight).astype(np.float32)


def named_by(path: str, pattern: str) -> bool:
    """Whether a clip's path below the library is meant by a pattern: the path itself with * and ?, one of its folders,
    or its file's name with or without ending; letter case does not count."""
    path, pattern = path.lower(), pattern.lower().replace("\\", "/").rstrip("/")
    whole = PurePosixPath(path)
    names = (path, whole.name, whole.stem, *map(str, whole.parents), *whole.parts[:-1])
    return any(fnmatchcase(name, pattern) for name in names if name != ".")


def weak_foot_cost(asked: Iterable[str], choices: Sequence[Key], weak_foot: str) -> np.ndarray:
    """(K,) what it costs to serve a key moment of the `asked` words by each of the choices: nothing where a side is
    asked for, where no foot meets the ball, or where nobody minds."""
    if not weak_foot or _SIDES.intersection(asked):
        return np.zeros(len(choices))
    weak = [weak_foot in key.words and may_use_foot(key.words) for key in choices]
    return WEAK_FOOT_COST * np.array(weak, float)
