"""Automatic locomotion: which clip stands for which gait, where the user has chosen (Faustino §3.1.1), and what a
library's gaits are called in the direction in which a body goes.

Faustino's automatic locomotion begins with "specifying which mocap to use for which locomotion"; all other clips must
not carry that word, so that one word has one speed. Without a choice every annotated clip counts
(`library.measure_gaits`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from difflib import get_close_matches

import numpy as np

from ..annotation import DISCRETE, LOCOMOTION
from ..annotation.gaits import direction_words, wanted_offset
from ..annotation.vocabulary import DIRECTIONS
from ..base.errors import InputError
from ..motion.track import SampledTrack
from .clip import Clip
from .library import Library, gait_word

_WHERE = "--gait"


def automatic_words(library: Library, gait: np.ndarray, track: SampledTrack) -> list[tuple[str, ...]]:
    """(T,) the words of each frame's gait, index (T,) into the library's; where the library also has it in the
    direction in which a body that faces the ball would go (`annotation.gaits`), in that direction."""
    recorded = {row.words for clip in library.clips for row in clip.annotations}
    words: list[tuple[str, ...]] = []
    for number, direction in zip(gait, direction_words(wanted_offset(track), track.fps)):
        own = library.gaits[number].words
        turned = tuple(direction if word == DIRECTIONS[0] else word for word in own)
        words.append(turned if turned in recorded else own)
    return words


def with_chosen_gaits(library: Library, chosen: Mapping[str, str]) -> Library:
    """The library with `chosen` (gait word -> clip's path below the folder): its rows of that word
    alone say how fast the gait is, and no other clip's locomotion carries it. Actions of other clips keep their words.

    InputError for a word that is no gait, a clip that the library has not, one whose rows do not carry the word, and
    for clips that are not slower than the next faster gait's."""
    if not chosen:
        return library
    for word, path in chosen.items():
        _check(library, word, path)
    frames = library.frames
    actions = [i for i, word in enumerate(frames.vocabulary) if word in DISCRETE]
    locomotion = ~frames.words[:, actions].any(axis=1)
    words = frames.words.copy()
    for word, path in chosen.items():
        others = np.array([clip.path != path for clip in library.clips])[frames.clip]
        words[others & locomotion, frames.vocabulary.index(word)] = False
    out = replace(library, frames=replace(frames, words=words), chosen=tuple(chosen.items()))
    _check_order(out)
    return out


def _check(library: Library, word: str, path: str) -> None:
    if word not in LOCOMOTION:
        raise InputError(_WHERE, f"{word!r} as a gait", f"one of {', '.join(LOCOMOTION)}")
    clips = {clip.path: clip for clip in library.clips if not clip.made}
    if path not in clips:
        near = get_close_matches(path, clips, 3, 0.3) or sorted(clips)[:3]
        raise InputError(_WHERE, f"no clip {path!r} in {library.folder}", f"a path below it, such as {', '.join(near)}")
    if not _shows(clips[path], word):
        others = [other for other, clip in clips.items() if _shows(clip, word)][:3]
        raise InputError(
            _WHERE, f"{path} has no row of {word!r} alone",
            f"a clip that has, such as {', '.join(others)}" if others else "a clip that has",
            "or write the word into its annotations",
        )


def _shows(clip: Clip, word: str) -> bool:
    return any(gait_word(row) == word for row in clip.annotations)


def _check_order(library: Library) -> None:
    """Thresholds between gaits need speeds in the gaits' own order."""
    speeds = {gait.word: gait.speed for gait in library.gaits}
    lost = [word for word, _ in library.chosen if word not in speeds]
    if lost:
        told = ", ".join(f"{word} {speed:.1f} m/s" for word, speed in speeds.items())
        what = f"the clip for {lost[0]} is not faster than a slower gait ({told})"
        raise InputError(_WHERE, what, "another clip for one")
