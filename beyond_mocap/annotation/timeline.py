"""A player's timeline: spans and key moments with labels, and automatic locomotion where nothing is annotated."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..base.errors import InputError, format_seconds
from ..base.fixes import Fix
from .labels import avoids_ball, read_labels
from .vocabulary import (
    CONTINUOUS,
    DISCRETE,
    TRANSITION,
    find_labels_of_part,
    find_nearest_labels,
    find_similar_labels,
    list_labels_below,
    list_vocabulary,
    sort_labels,
)

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?f?", re.IGNORECASE)
"""What the text form reads as a time; no label may look like one."""

OTHER_TIME = re.compile(r"[+-]?(\d+,\d+|(\d+:){1,2}\d\d([.,]\d+)?)")
"""Times that the text form refuses: with a decimal comma, or as minutes and seconds; no label may look like one."""

EDGE_TOLERANCE = 0.1
"""Seconds by which a time may be outside the track: one sample of a 10 Hz feed."""

LONGEST_TIME = 1e11
"""Largest time in seconds: feeds count from kick-off, some from 1970."""

_SAME_TIME = 1e-6  # seconds up to which two times count as equal


AVOID_PREFIX = "-"
"""Prefix of a label in the text form that the motion must not have."""

TOUCH = "touch"
"""Label of the ball being touched: a key moment that excludes it reaches for the ball and misses it by design."""


def check_labels(labels: Iterable[str], where: str) -> tuple[str, ...]:
    """Check labels and normalize them: lower case, each once.

    Args:
        labels: the labels.
        where: their place, for errors.
    Returns:
        The labels in their order.
    Raises:
        InputError: for a text that cannot be written as a label.
    """
    out = tuple(dict.fromkeys(str(label).lower() for label in labels))
    for label in out:
        is_time = NUMBER.fullmatch(label) or OTHER_TIME.fullmatch(label)
        if not label or "#" in label or label.startswith(AVOID_PREFIX) or label.split() != [label] or is_time:
            expected = f"a label without spaces and '#', no number or time, that does not begin with '{AVOID_PREFIX}'"
            raise InputError(where, f"{label!r} is not a label", expected)
    return out


def _check_time(value: float, where: str) -> float:
    time = float(value)
    if not abs(time) <= LONGEST_TIME:
        raise InputError(where, f"the time {format_seconds(time)}", "a time within the track, in seconds")
    return time


@dataclass(frozen=True)
class Span:
    """A stretch of time with labels.

    Without labels it means automatic locomotion; `TRANSITION` alone leaves it to continuity.

    Attributes:
        start, end: seconds on the track's clock.
        words: labels of the motion, lower case, each once.
        line: line of the file it was read from, for messages only.
        avoid: labels that no motion in it may have.
    """

    start: float
    end: float
    words: tuple[str, ...] = ()
    line: int | None = field(default=None, compare=False, repr=False)
    avoid: tuple[str, ...] = ()

    def __post_init__(self):
        object.__setattr__(self, "start", _check_time(self.start, "span"))
        object.__setattr__(self, "end", _check_time(self.end, "span"))
        object.__setattr__(self, "words", check_labels(self.words, "span"))
        object.__setattr__(self, "avoid", check_labels(self.avoid, "span"))


@dataclass(frozen=True)
class KeyMoment:
    """A moment at which a clip's own key moment must be played (Faustino §4.2.2).

    Attributes:
        time: seconds on the track's clock.
        words: labels of the clip's key moment, lower case, each once.
        line: line of the file it was read from, for messages only.
        avoid: labels that the clip's key moment may not have.
        solved: second of the ball touch that it means, if known better, else None.
    """

    time: float
    words: tuple[str, ...]
    line: int | None = field(default=None, compare=False, repr=False)
    avoid: tuple[str, ...] = ()
    solved: float | None = field(default=None, metadata={"later": True})

    def __post_init__(self):
        object.__setattr__(self, "time", _check_time(self.time, "key moment"))
        object.__setattr__(self, "words", check_labels(self.words, "key moment"))
        object.__setattr__(self, "avoid", check_labels(self.avoid, "key moment"))

    @property
    def resolved_time(self) -> float:
        """The second at which it is played: the solved one if there is one, else the requested one."""
        return self.time if self.solved is None else self.solved

    @property
    def misses_ball(self) -> bool:
        """Whether the body leaves the ball untouched by design: it reaches and misses, as the loser of a duel does, or
        lets the ball pass.
        """
        return TOUCH in self.avoid or avoids_ball(self.words)


@dataclass(frozen=True)
class Timeline:
    """A player's actions and their times. An empty timeline means automatic locomotion.

    Attributes:
        spans: ordered by start, then end.
        keys: key moments, ordered by time.
    """

    spans: tuple[Span, ...] = ()
    keys: tuple[KeyMoment, ...] = ()

    def __post_init__(self):
        object.__setattr__(self, "spans", tuple(sorted(self.spans, key=lambda span: (span.start, span.end))))
        object.__setattr__(self, "keys", tuple(sorted(self.keys, key=lambda key: key.time)))


def labels_per_frame(timeline: Timeline, times: np.ndarray) -> list[frozenset[str] | None]:
    """List the labels that apply at each time.

    A span applies from its start up to, not including, its end; one that ends with the last time includes it.

    Args:
        timeline: the timeline.
        times: (T,) seconds on the track's clock, ascending.
    Returns:
        For each time the labels, None in a transition, empty where locomotion is automatic.
    """
    times = np.asarray(times, dtype=float)
    out: list[frozenset[str] | None] = [frozenset()] * len(times)
    for span in timeline.spans:
        if span.words:
            frames = _find_frames(span, times)
            labels = None if span.words == (TRANSITION,) else frozenset(span.words)
            out[frames] = [labels] * (frames.stop - frames.start)
    return out


def avoided_labels_per_frame(timeline: Timeline, times: np.ndarray) -> list[frozenset[str]]:
    """List the labels that no motion may have at each time.

    Spans with only avoided labels may overlap others; a label that one span requests is not avoided because of another.

    Args:
        timeline: the timeline.
        times: (T,) seconds on the track's clock, ascending.
    Returns:
        For each time the avoided labels.
    """
    times = np.asarray(times, dtype=float)
    out: list[frozenset[str]] = [frozenset()] * len(times)
    for span in timeline.spans:
        for frame in range(*_find_frames(span, times).indices(len(times))) if span.avoid else ():
            out[frame] |= frozenset(span.avoid)
    if any(out):
        out = [avoid - (requested or frozenset()) for avoid, requested in zip(out, labels_per_frame(timeline, times))]
    return out


def _find_frames(span: Span, times: np.ndarray) -> slice:
    """Find the frames in which a span applies, see `labels_per_frame`."""
    first, last = np.searchsorted(times, [span.start - _SAME_TIME, span.end - _SAME_TIME])
    if len(times) and abs(times[-1] - span.end) <= _SAME_TIME:
        last = len(times)
    return slice(int(first), int(last))


def fill_timeline(timeline: Timeline, times: np.ndarray, labels: Sequence[tuple[str, ...]]) -> Timeline:
    """Fill the timeline with automatic locomotion wherever no span with labels applies.

    Spans with labels and key moments stay as they are. All others are replaced by one span per run of equal automatic
    labels, from the run's first frame to the next run's; the last one ends at the last frame.

    Args:
        timeline: the timeline.
        times: (T,) seconds of the output frames, ascending.
        labels: T tuples, the automatic gait of each frame.
    Returns:
        The filled timeline.
    Source: Faustino 2016, section 3.1.1.
    """
    times = np.asarray(times, dtype=float)
    if not len(times):
        return timeline
    labelled = [span for span in timeline.spans if span.words]
    automatic = [piece for start, end in _find_unlabelled_spans(labelled, times) for piece in _build_spans(start, end,
            times, labels)]
    return Timeline((*labelled, *automatic), timeline.keys)


def _find_unlabelled_spans(labelled: list[Span], times: np.ndarray) -> list[tuple[float, float]]:
    """Find the (start, end) seconds between the first and the last time that no labelled span covers."""
    out, covered_until = [], times[0]
    for start, end in [*((span.start, span.end) for span in labelled), (times[-1], times[-1])]:
        if min(start, times[-1]) > covered_until + _SAME_TIME:
            out.append((covered_until, min(start, times[-1])))
        covered_until = max(covered_until, end)
    return out


def _build_spans(start: float, end: float, times: np.ndarray, labels: Sequence[tuple[str, ...]]) -> list[Span]:
    """Build spans of equal automatic labels that together cover start to end."""
    first = max(int(np.searchsorted(times, start + _SAME_TIME)) - 1, 0)
    last = int(np.searchsorted(times, end - _SAME_TIME))
    edges = [i for i in range(first + 1, last) if tuple(labels[i]) != tuple(labels[i - 1])]
    starts = [start, *(float(times[i]) for i in edges)]
    return [Span(a, b, labels[i]) for a, b, i in zip(starts, [*starts[1:], end], [first, *edges])]


def find_problems(
    timeline: Timeline, known_labels: Iterable[str] = (), start: float | None = None, end: float | None = None,
    where: str = "annotations",
) -> list[InputError]:
    """Find everything that is wrong with a timeline.

    Args:
        timeline: the timeline.
        known_labels: labels in addition to the vocabulary (the library's and the user's).
        start, end: the track's first and last time in seconds; None without a track to compare with.
        where: the file, for messages.
    Returns:
        The errors, in time order, then overlaps.
    """
    known = list_vocabulary(known_labels)
    found: list[InputError] = []
    items: list[Span | KeyMoment] = [*timeline.spans, *timeline.keys]
    for item in sorted(items, key=lambda item: item.start if isinstance(item, Span) else item.time):
        place = where if item.line is None else f"{where}:{item.line}"
        at = Fix("show_label", repr(item.start if isinstance(item, Span) else item.time))
        problems = [*_find_label_problems(item, known, place), *_find_time_problems(item, start, end, place)]
        found += [problem.offer(at) for problem in problems]
    return found + _find_overlaps(timeline, where)


def check_timeline(
    timeline: Timeline, known_labels: Iterable[str] = (), start: float | None = None, end: float | None = None,
    where: str = "annotations",
) -> None:
    """Check a timeline and raise the first of `find_problems(...)`.

    Args:
        timeline, known_labels, start, end, where: see `find_problems`.
    Raises:
        InputError: if there is a problem.
    """
    found = find_problems(timeline, known_labels, start, end, where)
    if found:
        raise found[0]


def find_missing_keys(
    timeline: Timeline, choices: Iterable[Iterable[str]], count: int = 3
) -> list[tuple[KeyMoment, tuple[tuple[str, ...], ...]]]:
    """Find the key moments that no clip of a library serves.

    A combination serves a key moment if it has all of its labels; further labels do not matter.

    Args:
        timeline: the timeline.
        choices: the labels of every clip's key moment, mirrored clips included.
        count: number of nearest combinations to return.
    Returns:
        Each such key moment with the `count` nearest combinations, sorted by `sort_labels`.
    """
    combinations = [sort_labels(choice) for choice in choices]
    missing = [key for key in timeline.keys if not any(set(key.words) <= set(choice) for choice in combinations)]
    return [(key, find_nearest_labels(key.words, combinations, count)) for key in missing]


def _find_label_problems(item: Span | KeyMoment, known: frozenset[str], place: str) -> list[InputError]:
    """Find what is wrong with the labels of a span or key moment."""
    if TRANSITION in (*item.words, *item.avoid):
        return _find_transition_problems(item, place)
    may_miss = {TOUCH} if isinstance(item, KeyMoment) else set()
    out = [_build_unknown_label_error(word, item, known, place)
           for words, others in ((item.words, set()), (item.avoid, may_miss)) for word in words
           if word not in known and word not in others]
    out += [_build_contradiction_error(word, place) for word in item.words if word in item.avoid]
    if isinstance(item, KeyMoment) and not item.words:
        out.append(InputError(place, "a key moment without labels", "TIME labels...", "add labels"))
    return out


def _find_transition_problems(item: Span | KeyMoment, place: str) -> list[InputError]:
    if isinstance(item, Span) and item.words == (TRANSITION,) and TRANSITION not in item.avoid:
        return []
    found = f"{TRANSITION!r} in {' '.join(format_labels(item))!r}"
    return [InputError(place, found, f"'START END {TRANSITION}'", "write it alone, on a line with two times")]


def _build_contradiction_error(label: str, place: str) -> InputError:
    found = f"{label!r} is both requested and avoided"
    return InputError(place, found, f"'{label}' or '{AVOID_PREFIX}{label}'", "remove one of them")


def _build_unknown_label_error(label: str, item: Span | KeyMoment, known: frozenset[str], place: str) -> InputError:
    """Build the error of an unknown label; suggest similar labels and those that the tree has below the line's others.
    """
    others = [other for other in item.words if other in known]
    is_of_recordings = label in read_labels()
    similar = (find_labels_of_part(label, known) if is_of_recordings else ()) or find_similar_labels(label, known)
    roots = sorted(DISCRETE if isinstance(item, KeyMoment) else CONTINUOUS)
    offers = dict.fromkeys((*similar, *(list_labels_below(others)[:5] if others else roots * (not similar))))
    return InputError(
        place,
        f"the label {label!r} is " + ("of recordings only, and no clip of the library has it" if is_of_recordings
                                      else "not in the vocabulary"),
        f"one like {', '.join(offers)}" if offers else "a label of the vocabulary",
        "correct it, or use it in an annotation of the library",
    )


def _find_time_problems(item: Span | KeyMoment, start: float | None, end: float | None, place: str) -> list[InputError]:
    times = (item.start, item.end) if isinstance(item, Span) else (item.time,)
    if len(times) == 2 and times[1] <= times[0]:
        found = f"the end {format_seconds(times[1])} is not after the start {format_seconds(times[0])}"
        return [InputError(place, found, "START < END")]
    low = -math.inf if start is None else start - EDGE_TOLERANCE
    high = math.inf if end is None else end + EDGE_TOLERANCE
    if low <= times[0] and times[-1] <= high:
        return []
    outside = times[0] if times[0] < low else times[-1]
    found = f"the time {format_seconds(outside)} s is outside the track"
    return [InputError(place, found, _describe_range(start, end), "correct the time")]


def _describe_range(start: float | None, end: float | None) -> str:
    parts = [f"{word} {format_seconds(value)} s" for word, value in (("from", start), ("to", end)) if value is not None]
    return "times " + " ".join(parts)


def _find_overlaps(timeline: Timeline, where: str) -> list[InputError]:
    """Find labelled spans that overlap, and key moments at the same time: a player cannot do both."""
    labelled = [span for span in timeline.spans if span.words]
    pairs: list[tuple] = [(a, b, "overlap") for a, b in zip(labelled, labelled[1:]) if b.start < a.end - _SAME_TIME]
    keys = timeline.keys
    pairs += [(a, b, "are at the same time") for a, b in zip(keys, keys[1:]) if b.time - a.time <= _SAME_TIME]
    return [
        InputError(
            where if b.line is None else f"{where}:{b.line}", f"{_describe_item(a)} and {_describe_item(b)} {relation}",
            "one action at a time", "shorten one of them, or put all labels on one line",
            fixes=(Fix("show_label", repr(b.start if isinstance(b, Span) else b.time)),),
        )
        for a, b, relation in pairs
    ]


def _describe_item(item: Span | KeyMoment) -> str:
    times = f"{format_seconds(item.start)} {format_seconds(item.end)}" if isinstance(item,
            Span) else f"{format_seconds(item.time)}"
    return f"'{' '.join((times, *format_labels(item)))}'" + ("" if item.line is None else f" (line {item.line})")


def format_labels(item: Span | KeyMoment) -> tuple[str, ...]:
    """List the labels of a span or key moment as the text form writes them.

    Args:
        item: a span or key moment.
    Returns:
        The requested labels, then the avoided ones, each after `AVOID_PREFIX`.
    """
    return (*item.words, *(AVOID_PREFIX + word for word in item.avoid))
