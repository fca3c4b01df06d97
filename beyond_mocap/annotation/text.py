"""Read and write the text form of timelines (Faustino §4.2.2): `START END labels...` or `TIME labels...`.

A label after `-` is excluded: `3.2 6.0 running -dribble` requests running without the ball at the feet.

`#` starts a comment. Times are seconds; a number that ends in `f`, or every number after a line `unit frames`, counts
frames from the track's first time. Faustino leaves labels out where a transition is wanted; here a line without labels
means automatic locomotion, and the label `transition` alone means a transition.
"""

from __future__ import annotations

import os

from ..base.content import decode_text, is_utf16, read_bytes
from ..base.errors import InputError, format_seconds
from .timeline import AVOID_PREFIX, LONGEST_TIME, NUMBER, OTHER_TIME, KeyMoment, Span, Timeline, format_labels

_EXPECTED_FORM = "'START END labels...' or 'TIME labels...'"
_LARGEST_FILE = 16 * 1024 * 1024


def read_timeline(path: str | os.PathLike, fps: float | None = None, start: float = 0.0) -> Timeline:
    """Read the timeline in a text file.

    Args:
        path: the file.
        fps, start: see `parse_timeline`.
    Returns:
        The timeline.
    Raises:
        InputError: if the file cannot be read or a line is invalid.
    """
    return parse_timeline(read_text(path), str(path), fps, start)


def parse_timeline(text: str, where: str = "annotations", fps: float | None = None, start: float = 0.0) -> Timeline:
    """Parse the text form of a timeline.

    Args:
        text: the file's content.
        where: the file's name for errors, as in `where:line`.
        fps: frame rate of times in frames; None if frames are not allowed.
        start: seconds of the track's first time, which is frame 0.
    Returns:
        The timeline, in seconds on the track's clock.
    Raises:
        InputError: with the line, if it is invalid.
    """
    unit, spans, keys = "seconds", [], []
    for number, line in enumerate(text.lstrip("\ufeff").splitlines(), start=1):
        tokens = line.split("#", 1)[0].split()
        place = f"{where}:{number}"
        if not tokens:
            continue
        if tokens[0].lower() == "unit":
            unit = _parse_unit(tokens, place)
            continue
        times = [_parse_seconds(token, unit, fps, start, place) for token in _list_leading_numbers(tokens, unit, place)]
        labels = tokens[len(times) :]
        if len(times) == 2:
            spans.append(_parse_span(times, labels, number, place))
        else:
            keys.append(_parse_key(times[0], labels, number, place))
    return Timeline(tuple(spans), tuple(keys))


def format_timeline(timeline: Timeline) -> str:
    """Format a timeline so that `parse_timeline` reads an equal one.

    Args:
        timeline: the timeline.
    Returns:
        One line per span and key moment, in seconds, by time.
    """
    lines = [(span.start, f"{_format_exact(span.start)} {_format_exact(span.end)}", format_labels(span))
             for span in timeline.spans]
    lines += [(key.time, _format_exact(key.time), format_labels(key)) for key in timeline.keys]
    lines.sort(key=lambda line: line[0])
    return "".join(" ".join((times, *words)) + "\n" for _, times, words in lines)


def read_text(path: str | os.PathLike) -> str:
    """Read a text file, UTF-8 with or without BOM, or UTF-16 with one.

    Args:
        path: the file.
    Returns:
        Its content.
    Raises:
        InputError: if it is missing, too large, binary or not UTF-8.
    """
    data = read_bytes(path, "a text file", _LARGEST_FILE)
    if b"\0" in data and not is_utf16(data):
        raise InputError(path, "binary content", "a text file", "save it as plain UTF-8 text")
    try:
        return decode_text(data)
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise InputError(f"{path}:{line}", "a byte that is not UTF-8", "UTF-8 text", "save it as UTF-8") from None


def _parse_unit(tokens: list[str], place: str) -> str:
    unit = " ".join(tokens[1:]).lower()
    if unit not in ("seconds", "frames"):
        raise InputError(place, f"unit {unit!r}", "'unit seconds' or 'unit frames'")
    return unit


def _list_leading_numbers(tokens: list[str], unit: str, place: str) -> list[str]:
    """List the one or two numbers at the start of a line."""
    for token in tokens[:2]:
        if (seconds := _read_other_time(token)) is not None:
            step = f"write seconds with a point: {_format_exact(seconds)}"
            raise InputError(place, f"{token!r} is not a time", _EXPECTED_FORM,
                             step if unit == "seconds" else "write the number of frames, or leave out 'unit frames'")
    if not NUMBER.fullmatch(tokens[0]):
        raise InputError(place, f"{tokens[0]!r} is not a time", _EXPECTED_FORM, "put the time first")
    numbers = [token for token in tokens[:3] if NUMBER.fullmatch(token)]
    if len(numbers) == 3:
        raise InputError(place, "three numbers", _EXPECTED_FORM, "put the labels after the times")
    return numbers if NUMBER.fullmatch(tokens[1] if len(tokens) > 1 else "") else numbers[:1]


def _read_other_time(token: str) -> float | None:
    """Read the seconds of a time with a decimal comma, or of minutes and seconds such as 1:05; None for others."""
    if not OTHER_TIME.fullmatch(token):
        return None
    seconds = 0.0
    for part in token.lstrip("+-").replace(",", ".").split(":"):
        seconds = 60.0 * seconds + float(part)
    return -seconds if token.startswith("-") else seconds


def _parse_seconds(token: str, unit: str, fps: float | None, start: float, place: str) -> float:
    in_frames = token[-1] in "fF"
    value = float(token[:-1] if in_frames else token)
    if not abs(value) <= LONGEST_TIME:
        raise InputError(place, f"the time {token}", "a time within the track")
    if not in_frames and unit == "seconds":
        return value
    if not fps:
        raise InputError(place, f"the time {token} is in frames, but the frame rate is unknown", "seconds")
    return start + value / fps


def _parse_span(times: list[float], labels: list[str], number: int, place: str) -> Span:
    if times[1] <= times[0]:
        found = f"the end {format_seconds(times[1])} is not after the start {format_seconds(times[0])}"
        raise InputError(place, found, "START < END", "write one time for a key moment")
    return _build_item(Span, place, *times, labels, number)


def _parse_key(time: float, labels: list[str], number: int, place: str) -> KeyMoment:
    if all(word.startswith(AVOID_PREFIX) for word in labels):
        raise InputError(place, "one time and no labels", _EXPECTED_FORM, "add a second time, or labels")
    return _build_item(KeyMoment, place, time, labels, number)


def _build_item(kind, place: str, *values):
    """Build a span or key moment from times, labels and line; errors name the line."""
    *times, labels, line = values
    requested = [word for word in labels if not word.startswith(AVOID_PREFIX)]
    avoided = [word.removeprefix(AVOID_PREFIX) for word in labels if word.startswith(AVOID_PREFIX)]
    try:
        return kind(*times, requested, line, avoided)
    except InputError as error:
        raise InputError(place, str(error), _EXPECTED_FORM) from None


def _format_exact(seconds: float) -> str:
    """Format seconds as the shortest decimal text that reads back to the same number."""
    return repr(seconds).removesuffix(".0")
