"""The text form of timelines (Faustino §4.2.2): `START END words...` or `TIME words...`, read and written.

A word behind `-` is one that must not be: `3.2 6.0 running -dribble` asks for running without the ball at the feet.

`#` starts a comment. Times are seconds; a number that ends in `f`, or every number after a line `unit frames`, counts
frames from the track's first time. Faustino leaves words out where a transition is wanted; here a line without words
means automatic locomotion (his line 1), and the word `transition` alone says transition.
"""

from __future__ import annotations

import os
from pathlib import Path

from ..base.errors import InputError, told_time
from .timeline import LONGEST_TIME, MUST_NOT, NUMBER, KeyMoment, Span, Timeline, spelled

_FORM = "'START END words...' or 'TIME words...'"
_LARGEST_FILE = 16 * 1024 * 1024


def read_timeline(path: str | os.PathLike, fps: float | None = None, start: float = 0.0) -> Timeline:
    """The timeline in a text file; arguments and errors as `parse_timeline`, and InputError where it cannot be read."""
    return parse_timeline(read_text(path), str(path), fps, start)


def parse_timeline(text: str, where: str = "annotations", fps: float | None = None, start: float = 0.0) -> Timeline:
    """The timeline that `text` spells.

    where: named in errors, as `where:line`. fps: rate of times given in frames, None where frames are not allowed.
    start: seconds of the track's first time, where frame 0 is. InputError on a line that is not of the form."""
    unit, spans, keys = "seconds", [], []
    for number, line in enumerate(text.lstrip("\ufeff").splitlines(), start=1):
        tokens = line.split("#", 1)[0].split()
        place = f"{where}:{number}"
        if not tokens:
            continue
        if tokens[0].lower() == "unit":
            unit = _unit(tokens, place)
            continue
        times = [_seconds(token, unit, fps, start, place) for token in _leading_numbers(tokens, place)]
        words = tokens[len(times) :]
        if len(times) == 2:
            spans.append(_span(times, words, number, place))
        else:
            keys.append(_key(times[0], words, number, place))
    return Timeline(tuple(spans), tuple(keys))


def format_timeline(timeline: Timeline) -> str:
    """The text that `parse_timeline` reads back to an equal timeline: one line each in time order, seconds."""
    lines = [(span.start, f"{_spell(span.start)} {_spell(span.end)}", spelled(span)) for span in timeline.spans]
    lines += [(key.time, _spell(key.time), spelled(key)) for key in timeline.keys]
    lines.sort(key=lambda line: line[0])
    return "".join(" ".join((times, *words)) + "\n" for _, times, words in lines)


def read_text(path: str | os.PathLike) -> str:
    """A text file's content, UTF-8 with or without BOM; InputError where it is missing, binary or not UTF-8."""
    try:
        if Path(path).stat().st_size > _LARGEST_FILE:
            raise InputError(path, "a file of more than 16 MiB", "a text file")
        data = Path(path).read_bytes()
    except OSError as error:
        raise InputError(path, error.strerror or "cannot be read", "a text file", "check the path") from None
    if b"\0" in data:
        raise InputError(path, "binary content", "a text file", "save it as plain UTF-8 text")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise InputError(f"{path}:{line}", "a byte that is not UTF-8", "UTF-8 text", "save it as UTF-8") from None


def _unit(tokens: list[str], place: str) -> str:
    unit = " ".join(tokens[1:]).lower()
    if unit not in ("seconds", "frames"):
        raise InputError(place, f"unit {unit!r}", "'unit seconds' or 'unit frames'")
    return unit


def _leading_numbers(tokens: list[str], place: str) -> list[str]:
    """The one or two numbers that a line starts with."""
    if not NUMBER.fullmatch(tokens[0]):
        raise InputError(place, f"{tokens[0]!r} is not a time", _FORM, "put the time first")
    numbers = [token for token in tokens[:3] if NUMBER.fullmatch(token)]
    if len(numbers) == 3:
        raise InputError(place, "three numbers", _FORM, "put the words after the times")
    return numbers if NUMBER.fullmatch(tokens[1] if len(tokens) > 1 else "") else numbers[:1]


def _seconds(token: str, unit: str, fps: float | None, start: float, place: str) -> float:
    in_frames = token[-1] in "fF"
    value = float(token[:-1] if in_frames else token)
    if not abs(value) <= LONGEST_TIME:
        raise InputError(place, f"the time {token}", "a time within the track")
    if not in_frames and unit == "seconds":
        return value
    if not fps:
        raise InputError(place, f"the time {token} in frames, but no frame rate is known", "seconds")
    return start + value / fps


def _span(times: list[float], words: list[str], number: int, place: str) -> Span:
    if times[1] <= times[0]:
        found = f"the end {told_time(times[1])} is not after the start {told_time(times[0])}"
        raise InputError(place, found, "START < END", "for a key moment write one time")
    return _placed(Span, place, *times, words, number)


def _key(time: float, words: list[str], number: int, place: str) -> KeyMoment:
    if all(word.startswith(MUST_NOT) for word in words):
        raise InputError(place, "one time and no words", _FORM, "give a second time, or say what happens")
    return _placed(KeyMoment, place, time, words, number)


def _placed(kind, place: str, *values):
    """A span or key moment of times, words and line; what its words lack is told with the line it stands on."""
    *times, words, line = values
    asked = [word for word in words if not word.startswith(MUST_NOT)]
    avoid = [word.removeprefix(MUST_NOT) for word in words if word.startswith(MUST_NOT)]
    try:
        return kind(*times, asked, line, avoid)
    except InputError as error:
        raise InputError(place, str(error), _FORM) from None


def _spell(seconds: float) -> str:
    """The shortest decimal text that reads back to the same number."""
    return repr(seconds).removesuffix(".0")
