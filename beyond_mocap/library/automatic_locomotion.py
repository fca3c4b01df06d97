"""Automatic locomotion: which clip defines which gait, if the user has chosen, and a gait's labels in a direction.

Faustino's automatic locomotion begins with "specifying which mocap to use for which locomotion" (§3.1.1); no other clip
may carry that label, so that one label has one speed. Without a choice every annotated clip counts
(`library.measure_gaits`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from difflib import get_close_matches

import numpy as np

from ..annotation import DISCRETE, LOCOMOTION
from ..annotation.gaits import choose_directions, compute_heading_offset
from ..annotation.vocabulary import DIRECTIONS
from ..base.errors import InputError
from ..motion.track import SampledTrack
from .clip import Clip
from .library import Library, find_gait_label

_WHERE = "chosen gaits"


def build_automatic_labels(library: Library, gait: np.ndarray, track: SampledTrack) -> list[tuple[str, ...]]:
    """Build the labels of each frame's gait.

    Where the library has the gait in the direction in which a body that faces the ball would move (`annotation.gaits`),
    the labels have that direction.

    Args:
        library: the library.
        gait: (T,) index into the library's gaits.
        track: T frames.
    Returns:
        T tuples of labels.
    """
    recorded = {row.words for clip in library.clips for row in clip.annotations}
    pairs = list(zip(gait, choose_directions(compute_heading_offset(track), track.fps)))
    words: dict[tuple[int, str], tuple[str, ...]] = {}
    for number, direction in set(pairs):
        own = library.gaits[number].labels
        in_direction = tuple(direction if word == DIRECTIONS[0] else word for word in own)
        words[number, direction] = in_direction if in_direction in recorded else own
    return [words[pair] for pair in pairs]


def apply_chosen_gaits(library: Library, chosen: Mapping[str, str]) -> Library:
    """Apply the user's choice of clips for gaits.

    The rows of that label in the chosen clip alone define the gait's speed, and no other clip's locomotion carries the
    label. Actions of other clips keep their labels.

    Args:
        library: the library.
        chosen: gait label -> clip's path below the folder.
    Returns:
        The library with that choice.
    Raises:
        InputError: for a label that is no gait, a clip that the library does not have, one whose rows do not carry the
            label, and for clips that are not slower than the next faster gait's.
    """
    if not chosen:
        return library
    for word, path in chosen.items():
        _check_choice(library, word, path)
    frames = library.frames
    actions = [i for i, word in enumerate(frames.vocabulary) if word in DISCRETE]
    locomotion = ~frames.words[:, actions].any(axis=1)
    words = frames.words.copy()
    for word, path in chosen.items():
        others = np.array([clip.path != path for clip in library.clips])[frames.clip]
        words[others & locomotion, frames.vocabulary.index(word)] = False
    out = replace(library, frames=replace(frames, words=words), chosen_gaits=tuple(chosen.items()))
    _check_order(out)
    return out


def _check_choice(library: Library, word: str, path: str) -> None:
    """Check one choice: a gait, a clip of the library, and a row of that gait alone."""
    if word not in LOCOMOTION:
        raise InputError(_WHERE, f"{word!r} as a gait", f"one of {', '.join(LOCOMOTION)}")
    clips = {clip.path: clip for clip in library.clips if not clip.is_synthetic}
    if path not in clips:
        near = get_close_matches(path, clips, 3, 0.3) or sorted(clips)[:3]
        raise InputError(_WHERE, f"no clip {path!r} in {library.folder}", f"a path below it, such as {', '.join(near)}")
    if not _has_gait(clips[path], word):
        others = [other for other, clip in clips.items() if _has_gait(clip, word)][:3]
        raise InputError(
            _WHERE, f"{path} has no row with only the label {word!r}",
            f"a clip that has one, such as {', '.join(others)}" if others else "a clip that has one",
            "or add the label to its annotations",
        )


def _has_gait(clip: Clip, word: str) -> bool:
    return any(find_gait_label(row) == word for row in clip.annotations)


def _check_order(library: Library) -> None:
    """Check that the chosen clips' speeds are in the gaits' own order, which thresholds need."""
    speeds = {gait.label: gait.speed for gait in library.gaits}
    dropped = [word for word, _ in library.chosen_gaits if word not in speeds]
    if dropped:
        speeds_text = ", ".join(f"{word} {speed:.1f} m/s" for word, speed in speeds.items())
        what = f"the clip for {dropped[0]} is not faster than a slower gait ({speeds_text})"
        raise InputError(_WHERE, what, "another clip for one of them")
