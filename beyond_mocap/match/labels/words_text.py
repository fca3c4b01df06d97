"""A player's words as a text file that people may edit: the contract's form, with where each line comes from behind it.

    # words of home_7: edit freely. A file that was edited is kept and used, another made anew [5d0c3f2a]
    12.31 kick running low  # touches 0.93
    20.5 23.2 dribble  # touches 0.97
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from ...annotation import format_timeline, parse_timeline, read_text, validate
from ...base.digest import hex_digest
from ...files.whole import atomic_write
from .words import USER, Moment, ordered, timeline_of

_HEAD = re.compile(r"#.*\[([0-9a-f]{8})\]\s*")


def write_words(path: str | os.PathLike, player: str, moments: Iterable[Moment]) -> None:
    """Writes one player's moments; InputError where that cannot be done."""
    lines = [f"{_line(moment)}  # {moment.source} {moment.confidence:.2f}\n" for moment in ordered(moments)]
    told = "edit freely. A file that was edited is kept and used, another made anew"
    atomic_write(path, f"# words of {' '.join(player.split())}: {told} [{_digest(lines)}]\n{''.join(lines)}")


def edited(path: str | os.PathLike) -> bool:
    """Whether there is such a file and somebody has changed it since it was written, or wrote it himself."""
    if not Path(path).is_file():
        return False
    lines = read_text(path).splitlines(keepends=True)
    head = _HEAD.fullmatch(lines[0]) if lines else None
    return head is None or head[1] != _digest(lines[1:])


def read_words(
    path: str | os.PathLike, automatic: Sequence[Moment] = (), known_words: Iterable[str] = ()
) -> tuple[Moment, ...]:
    """The moments in a file. automatic: lines that say what one of these says are that one; the others are the user's.

    known_words: beyond the vocabulary. InputError, with the line, for what is no timeline or has unknown words.
    """
    timeline = parse_timeline(read_text(path), str(path))
    validate(timeline, known_words, where=str(path))
    known = {_line(moment): moment for moment in automatic}
    found = [Moment(time=key.time, words=key.words, source=USER, confidence=1.0) for key in timeline.keys]
    found += [Moment(
        time=span.start, words=span.words, source=USER, confidence=1.0, end=span.end,
    ) for span in timeline.spans]
    return ordered(known.get(_line(moment), moment) for moment in found)


def _line(moment: Moment) -> str:
    """The contract's line for a moment."""
    return format_timeline(timeline_of([moment])).rstrip("\n")


def _digest(lines: Iterable[str]) -> str:
    """Of what lines say, however they end."""
    said = "\n".join(line.rstrip() for line in lines if line.strip())
    return hex_digest(said, digits=8)
