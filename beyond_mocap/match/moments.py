"""What a player of a match does and when, and its text form, which people may edit: the contract's form, with the
source of each line after it.

    # labels of home_7: edit freely. An edited file is kept and used, any other is regenerated [5d0c3f2a]
    12.31 kick running low  # touches 0.93
    20.5 23.2 dribble  # touches 0.97
    31.06 tackle -slide -touch  # duels 0.71
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..annotation import KeyMoment, Span, Timeline, check_timeline, format_timeline, parse_timeline, read_text
from ..annotation.ball_contact import takes_with_foot
from ..annotation.labels import avoids_ball
from ..annotation.timeline import AVOID_PREFIX, TOUCH
from ..base.digest import hex_digest
from ..files.atomic import atomic_write

MIN_DISTANCE_SECONDS = 0.5
"""s: of two touches of a player that are closer, one becomes a key moment."""

TOUCHES, EVENTS, BOTH, DUELS, SHOTS, USER = "touches", "events", "touches and events", "duels", "shots", "user"
"""Sources of a moment."""

_HEADER = re.compile(r"#.*\[([0-9a-f]{8})\]\s*")


@dataclass(frozen=True, kw_only=True)
class Moment:
    """What a player does.

    Attributes:
        time: s on the match's clock.
        labels: the labels.
        source: TOUCHES, EVENTS, BOTH, DUELS, SHOTS or USER.
        confidence: 0 to 1.
        end: s, the end of a stretch that starts at `time`; None for a key moment.
        avoid: labels that it must not show.
    """

    time: float
    labels: tuple[str, ...]
    source: str
    confidence: float
    end: float | None = None
    avoid: tuple[str, ...] = ()

    @property
    def misses_ball(self) -> bool:
        """Whether the player leaves the ball untouched by design."""
        return TOUCH in self.avoid or avoids_ball(self.labels)


def build_moment(
    time: float, labels: Iterable[str], source: str, confidence: float, end: float | None = None
) -> Moment | None:
    """Build a moment from labels as texts write them: one after `-` is excluded.

    Args:
        time: s.
        labels: the labels.
        source: as in `Moment`.
        confidence: 0 to 1.
        end: s of a stretch, None for a key moment.
    Returns:
        The moment; None without a label.
    """
    labels = tuple(labels)
    wanted = tuple(word for word in labels if not word.startswith(AVOID_PREFIX))
    avoid = tuple(word.removeprefix(AVOID_PREFIX) for word in labels if word.startswith(AVOID_PREFIX))
    if not wanted:
        return None
    return Moment(time=round(time, 3), labels=wanted, source=source, confidence=round(confidence, 3), end=end,
                  avoid=avoid)


def build_timeline(moments: Iterable[Moment], start: float = -np.inf, end: float = np.inf) -> Timeline:
    """Build a timeline from moments, cut to a span.

    Args:
        moments: the moments.
        start: s.
        end: s.
    Returns:
        The timeline.
    """
    spans, keys = [], []
    for moment in moments:
        if moment.end is None:
            keys += [KeyMoment(moment.time, moment.labels, avoid=moment.avoid)] * (start <= moment.time <= end)
        elif min(moment.end, end) > max(moment.time, start):
            spans.append(Span(max(moment.time, start), min(moment.end, end), moment.labels,
                              avoid=moment.avoid))
    return Timeline(tuple(spans), tuple(keys))


def write_labels(path: str | os.PathLike, player: str, moments: Iterable[Moment]) -> None:
    """Write one player's moments.

    Args:
        path: the text file.
        player: id.
        moments: in any order.
    Raises:
        InputError: if the file cannot be written.
    """
    lines = [f"{_format_moment(moment)}  # {moment.source} {moment.confidence:.2f}\n"
             for moment in sort_moments(moments)]
    text = "edit freely. An edited file is kept and used, any other is regenerated"
    atomic_write(path, f"# labels of {' '.join(player.split())}: {text} [{_compute_digest(lines)}]\n{''.join(lines)}")


def is_edited(path: str | os.PathLike) -> bool:
    """Say whether the file exists and a person wrote it or has changed it since it was written."""
    if not Path(path).is_file():
        return False
    lines = read_text(path).splitlines(keepends=True)
    head = _HEADER.fullmatch(lines[0]) if lines else None
    return head is None or head[1] != _compute_digest(lines[1:])


def read_labels(
    path: str | os.PathLike, automatic: Sequence[Moment] = (), known_labels: Iterable[str] = ()
) -> tuple[Moment, ...]:
    """Read the moments in a file.

    Args:
        path: the text file.
        automatic: moments; a line equal to one of them is that moment, the others are the user's.
        known_labels: labels beyond the vocabulary.
    Returns:
        The moments in order.
    Raises:
        InputError: with the line, if it is not a timeline or has unknown labels.
    """
    timeline = parse_timeline(read_text(path), str(path))
    check_timeline(timeline, known_labels, where=str(path))
    known = {_format_moment(moment): moment for moment in automatic}
    found = [Moment(time=key.time, labels=key.words, avoid=key.avoid, source=USER, confidence=1.0)
             for key in timeline.keys]
    found += [Moment(time=span.start, labels=span.words, avoid=span.avoid, source=USER, confidence=1.0,
                     end=span.end)
              for span in timeline.spans]  # fmt: skip
    return sort_moments(known.get(_format_moment(moment), moment) for moment in found)


def select_separate_moments(moments: Iterable[Moment]) -> list[Moment]:
    """Select moments of one player at least MIN_DISTANCE_SECONDS apart, the most certain first: events before
    touches, sent before received balls.
    """
    selected: list[Moment] = []
    for moment in sorted(moments, key=_compute_weight, reverse=True):
        if all(abs(moment.time - other.time) >= MIN_DISTANCE_SECONDS for other in selected):
            selected.append(moment)
    return selected


def _compute_weight(moment: Moment) -> tuple[float, float]:
    bonus = 0.5 * (moment.source in (EVENTS, BOTH)) + 0.3 * (not takes_with_foot(moment.labels))
    return moment.confidence + bonus, -moment.time


def sort_moments(moments: Iterable[Moment]) -> tuple[Moment, ...]:
    """Sort moments by time, stretches before key moments."""
    return tuple(sorted(moments, key=lambda moment: (moment.time, moment.end is None)))


def _format_moment(moment: Moment) -> str:
    """Format a moment as the contract's line."""
    return format_timeline(build_timeline([moment])).rstrip("\n")


def _compute_digest(lines: Iterable[str]) -> str:
    """Compute the digest of lines, without their ends."""
    content = "\n".join(line.rstrip() for line in lines if line.strip())
    return hex_digest(content, digits=8)
