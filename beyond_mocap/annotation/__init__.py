"""Labels with a time: vocabulary, timeline, text form, gaits by speed.

- `labels`        what each label means, from one table (`vocabulary.csv`)
- `ball_contact`  what labels say about the ball: which body part meets it, and when
- `vocabulary`    the decision tree of labels (Faustino, Appendix A), nearest labels, left and right
- `timeline`      spans and key moments, validation, automatic locomotion where nothing is annotated
- `text`          the text form of timelines (Faustino §4.2.2)
- `clips`         the annotations of library clips
- `gaits`         the gait for a speed (Faustino §3.1.1), and the heading of a body while it moves
- `decision`      the vocabulary as a tree of choices on number keys, with what the library has for each
- `key_commands`  annotating by keys: what each key does, without any window

    timeline = read_timeline("player.txt", fps=30)
    check_timeline(timeline, known_labels=library_labels, start=track.times[0], end=track.times[-1], where="player.txt")
    speeds = [0.1, 1.3, 2.9]
    gaits = choose_gaits(sampled.speed, sampled.fps, speeds, compute_gait_thresholds(speeds))
    filled = fill_timeline(timeline, sampled.times, [(LOCOMOTION[g],) for g in gaits])
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
