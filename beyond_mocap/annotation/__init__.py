"""Labels with a time: vocabulary, timeline, text form, gaits by speed.

- `labels`      what each label means, from one table (`vocabulary.csv`); `ball_contact` what that says of a ball met
- `vocabulary`  the decision tree of words (Faustino, Appendix A), nearest words, left and right
- `timeline`    stretches and key moments, validation, filling with automatic locomotion
- `text`        the text form of timelines (§4.2.2)
- `clips`       what the library's clips are annotated with
- `gaits`       which gait a speed asks for (§3.1.1), and which way a body faces while it goes
- `decision`    the vocabulary as a tree of choices on number keys, with what the library has of them
- `annotating`  annotating by keys: what each does, without any window

    timeline = read_timeline("player.txt", fps=30)
    validate(timeline, known_words=library_words, start=track.times[0], end=track.times[-1], where="player.txt")
    speeds = [0.1, 1.3, 2.9]
    gaits = automatic_gaits(sampled.speed, sampled.fps, speeds, gait_thresholds(speeds))
    filled = fill(timeline, sampled.times, [(LOCOMOTION[g],) for g in gaits])
"""

from .clips import ClipAnnotation, clip_annotations, read_annotation_csv, read_clip_annotations
from .gaits import LOCOMOTION, LOCOMOTION_WORDS, STANDING_SPEED, automatic_gaits, gait_thresholds, recorded_thresholds
from .text import format_timeline, parse_timeline, read_text, read_timeline
from .timeline import (
    MUST_NOT,
    KeyMoment,
    Span,
    Timeline,
    avoided_per_frame,
    fill,
    missing_keys,
    problems,
    spelled,
    validate,
    words_per_frame,
)
from .vocabulary import (
    CONTINUOUS,
    DISCRETE,
    TRANSITION,
    VOCABULARY,
    nearest,
    relatives,
    similar_words,
    spoken,
    swap_sides,
    vocabulary_words,
    words_below,
)

__all__ = [
    "CONTINUOUS", "DISCRETE", "LOCOMOTION", "LOCOMOTION_WORDS", "MUST_NOT", "STANDING_SPEED", "TRANSITION",
    "VOCABULARY", "ClipAnnotation", "KeyMoment", "Span", "Timeline", "automatic_gaits", "avoided_per_frame",
    "clip_annotations", "fill", "format_timeline", "gait_thresholds", "missing_keys", "nearest", "parse_timeline",
    "problems", "recorded_thresholds", "read_annotation_csv", "read_clip_annotations", "read_text", "read_timeline",
    "relatives", "similar_words", "spelled", "spoken", "swap_sides", "validate", "vocabulary_words", "words_below",
    "words_per_frame",
]
