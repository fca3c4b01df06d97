"""Labels with a time: vocabulary, timeline, text form, gaits by speed.

- `labels`        what each label means, from one table (`vocabulary.csv`)
- `ball_contact`  what labels say about the ball: which body part meets it, and when
- `striking`      the surfaces that strike a ball; `body_surfaces` and `body_solid` the whole body
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

from .clips import ClipAnnotation, build_clip_annotations, read_annotation_csv, read_clip_annotations
from .gaits import (
    LOCOMOTION,
    LOCOMOTION_LABELS,
    STANDING_SPEED,
    choose_gaits,
    compute_gait_thresholds,
    estimate_gait_thresholds,
)
from .text import format_timeline, parse_timeline, read_text, read_timeline
from .timeline import (
    AVOID_PREFIX,
    KeyMoment,
    Span,
    Timeline,
    avoided_labels_per_frame,
    check_timeline,
    fill_timeline,
    find_missing_keys,
    find_problems,
    format_labels,
    labels_per_frame,
)
from .vocabulary import (
    CONTINUOUS,
    DISCRETE,
    TRANSITION,
    VOCABULARY,
    find_nearest_labels,
    find_relatives,
    find_similar_labels,
    list_labels_below,
    list_vocabulary,
    sort_labels,
    swap_sides,
)

__all__ = [
    "CONTINUOUS", "DISCRETE", "LOCOMOTION", "LOCOMOTION_LABELS", "AVOID_PREFIX", "STANDING_SPEED", "TRANSITION",
    "VOCABULARY", "ClipAnnotation", "KeyMoment", "Span", "Timeline", "choose_gaits", "avoided_labels_per_frame",
    "build_clip_annotations", "fill_timeline", "format_timeline", "compute_gait_thresholds", "find_missing_keys",
    "find_nearest_labels", "parse_timeline", "find_problems", "estimate_gait_thresholds", "read_annotation_csv",
    "read_clip_annotations", "read_text", "read_timeline", "find_relatives", "find_similar_labels", "format_labels",
    "sort_labels", "swap_sides", "check_timeline", "list_vocabulary", "list_labels_below", "labels_per_frame",
]
