"""The words of automatic locomotion: what a library's gaits are called, in the direction in which a body goes."""

from __future__ import annotations

import numpy as np

from ..annotation.gaze import direction_words, wanted_offset
from ..annotation.vocabulary import DIRECTIONS
from ..motion.track import SampledTrack
from .library import Library


def automatic_words(library: Library, gait: np.ndarray, track: SampledTrack) -> list[tuple[str, ...]]:
    """(T,) the words of each frame's gait, index (T,) into the library's; where the library also has it in the
    direction in which a body that faces the ball would go (`annotation.gaze`), in that direction."""
    recorded = {row.words for clip in library.clips for row in clip.annotations}
    words: list[tuple[str, ...]] = []
    for number, direction in zip(gait, direction_words(wanted_offset(track), track.fps)):
        own = library.gaits[number].words
        turned = tuple(direction if word == DIRECTIONS[0] else word for word in own)
        words.append(turned if turned in recorded else own)
    return words
