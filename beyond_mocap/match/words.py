"""Label what each player does with the ball and when, from solved touches and from a provider's events.

    labels = label_match(match, solve_ball(match), read_events("events.xml", match=match))
    timeline = build_timeline(labels.players["home_7"], 0.0, 60.0)

A player's labels are stored as a text file that people may edit: the contract's form, with the source of each line
after it.

    # labels of home_7: edit freely. An edited file is kept and used, any other is regenerated [5d0c3f2a]
    12.31 kick running low  # touches 0.93
    20.5 23.2 dribble  # touches 0.97
"""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..annotation import KeyMoment, Span, Timeline, format_timeline, parse_timeline, read_text, validate
from ..annotation.ball_contact import takes_with_foot
from ..annotation.event_words import EventWords, read_event_words
from ..ball.tracked import kinds
from ..ball.tracked.solve import SolvedBall, SolvedTouch
from ..base.digest import hex_digest
from ..files.event_data import CERTAIN, MatchEvent, MatchEvents
from ..files.whole import atomic_write
from ..motion.track.match_data import Match
from .event_clock import AlignedEvents, aligned

LEAST_CONFIDENCE = 0.3
"""Touches with less confidence give no key moment."""

NEAREST = 0.5
"""s: of two touches of a player that are closer, one becomes a key moment."""

TOUCHES, EVENTS, BOTH, USER = "touches", "events", "touches and events", "user"
"""Sources of a moment."""

_RUNNING = 2.0  # m/s, from which the player is running at a touch
_HIGH_FOOT, _HIGH_HAND, _LOW_HAND = 0.45, 1.5, 0.7  # m of the ball's centre
_JUMP = 2.05  # m of the ball's centre, too high for a header without a jump
_CAUGHT = 3.0  # m/s of the ball after a save: a slower ball was caught
_CHAIN = 3.0  # s between touches of one dribble
_SHORTEST = 0.8  # s of a dribble
_FORGETS = 0.2  # share of a touch's doubt that remains if an event confirms it
_TOLD = 0.4  # confidence of an event without a touch
_SHOWN_BY = 0.5  # s around an event without a touch in which another moment of the player stands for it
_LIKE_EVENT = {kind.name: (kind.event, kind.details) for kind in kinds.TOUCH_KINDS}
_DRIBBLE = next(kind for kind in kinds.TOUCH_KINDS if kind.name == kinds.DRIBBLE)
_HEAD = re.compile(r"#.*\[([0-9a-f]{8})\]\s*")


@dataclass(frozen=True, kw_only=True)
class Moment:
    """What a player does.

    Attributes:
        time: s on the match's clock.
        labels: the labels.
        source: TOUCHES, EVENTS, BOTH or USER.
        confidence: 0 to 1.
        end: s, the end of a stretch that starts at `time`; None for a key moment.
    """

    time: float
    words: tuple[str, ...]
    source: str
    confidence: float
    end: float | None = None


@dataclass(frozen=True)
class MatchWords:
    """The labels of a match.

    Attributes:
        players: moments in order of time by id, for all players; () for a player who never touches the ball.
        notes: messages for people.
        figures: of the events' clock and how the events fit, {} without events.
    """

    players: Mapping[str, tuple[Moment, ...]]
    notes: tuple[str, ...] = ()
    figures: Mapping[str, object] = field(default_factory=dict)


def timeline_of(moments: Iterable[Moment], start: float = -np.inf, end: float = np.inf) -> Timeline:
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
            keys += [KeyMoment(moment.time, moment.words)] * (start <= moment.time <= end)
        elif min(moment.end, end) > max(moment.time, start):
            spans.append(Span(max(moment.time, start), min(moment.end, end), moment.words))
    return Timeline(tuple(spans), tuple(keys))


def words_of(
    match: Match, solved: SolvedBall | None, events: MatchEvents | None = None, table: EventWords | None = None
) -> MatchWords:
    """Label all players of a match.

    A touch becomes a key moment with the labels that the table has for it, or for the event paired with it; its time is
    the touch's. Consecutive touches of one player are a stretch of dribble. A pass, shot or save without a touch
    becomes a key moment at its time on the corrected clock. Of two within MIN_DISTANCE_SECONDS the more certain one
    stays. Unknown details (the foot, a height without heights in the feed) are left out of the labels.

    Args:
        match: the match.
        solved: the ball, on the match's clock; None if it cannot be solved.
        events: the provider's events; None: no events.
        table: labels by event; None: the built-in table.
    Returns:
        The labels.
    Raises:
        InputError: if events fit no better than by chance.
    """
    table = table or read_event_words()
    touches = solved.touches if solved else ()
    span = (float(solved.times[0]), float(solved.times[-1])) if solved else None
    onto = aligned(events, touches, match.halves, span) if events and solved else None
    told = {touch: event for event, touch in enumerate(onto.touches) if touch >= 0} if onto else {}
    heights, left_out, players = has_heights(match), Counter(), {}
    for player, path in zip(match.players, match.positions):
        own = [(i, touch) for i, touch in enumerate(touches) if touch.player == player.id]
        found = [moment for i, touch in own if (moment := moment_of(
            touch, match.times, path, heights, table, event=onto.events[told[i]] if i in told else None,
        ))]  # fmt: skip
        sure = [moment for moment in found if moment.confidence >= LEAST_CONFIDENCE]
        if onto:
            sure += _untouched(player.id, onto, span, times=match.times, path=path, table=table, beside=found)
        kept = apart(sure)
        left_out["doubtful"] += sum(moment.confidence < LEAST_CONFIDENCE for moment in found)
        left_out["close"] += len(sure) - len(kept)
        players[player.id] = ordered([*kept, *dribbles([touch for _, touch in own])])
    notes = (*(events.notes if events else ()), *(onto.notes if onto else ()), *_notes(touches, left_out))
    return MatchWords(players, notes, _figures(onto, touches, span) if onto else {})


def write_words(path: str | os.PathLike, player: str, moments: Iterable[Moment]) -> None:
    """Write one player's moments.

    Args:
        path: the text file.
        player: id.
        moments: in any order.
    Raises:
        InputError: if the file cannot be written.
    """
    lines = [f"{_line(moment)}  # {moment.source} {moment.confidence:.2f}\n" for moment in ordered(moments)]
    told = "edit freely. An edited file is kept and used, any other is regenerated"
    atomic_write(path, f"# labels of {' '.join(player.split())}: {told} [{_digest(lines)}]\n{''.join(lines)}")


def edited(path: str | os.PathLike) -> bool:
    """Say whether the file exists and a person wrote it or has changed it since it was written."""
    if not Path(path).is_file():
        return False
    lines = read_text(path).splitlines(keepends=True)
    head = _HEAD.fullmatch(lines[0]) if lines else None
    return head is None or head[1] != _digest(lines[1:])


def read_words(
    path: str | os.PathLike, automatic: Sequence[Moment] = (), known_words: Iterable[str] = ()
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
    validate(timeline, known_words, where=str(path))
    known = {_line(moment): moment for moment in automatic}
    found = [Moment(time=key.time, words=key.words, source=USER, confidence=1.0) for key in timeline.keys]
    found += [Moment(time=span.start, words=span.words, source=USER, confidence=1.0, end=span.end)
              for span in timeline.spans]  # fmt: skip
    return ordered(known.get(_line(moment), moment) for moment in found)


def _untouched(player: str, onto: AlignedEvents, span, times, path, table, beside) -> list[Moment]:
    """Label one player's certain events without a touch, unless another of their moments stands for the event."""
    out = []
    for index, event in enumerate(onto.events):
        time = float(onto.times[index])
        if event.player != player or event.kind not in CERTAIN or onto.touches[index] >= 0:
            continue
        if not span[0] <= time <= span[1] or any(abs(one.time - time) < _SHOWN_BY for one in beside):
            continue
        filled_in = {**seen_words(time, times, path), "side": event.side}
        words = table.words(event.kind, event.part or "foot", event.details, filled_in)
        out += [Moment(time=round(time, 3), words=words, source=EVENTS, confidence=_TOLD)] * bool(words)
    return out


def _figures(onto: AlignedEvents, touches, span) -> dict[str, object]:
    """Measure how the events fit: counts, and each period's clock."""
    inside = [i for i, time in enumerate(onto.times) if span[0] <= time <= span[1] and onto.events[i].played]
    certain = [i for i in inside if onto.events[i].kind in CERTAIN]
    off = [touches[onto.touches[i]].time - onto.times[i] for i in inside if onto.touches[i] >= 0]
    return {
        "events": len(inside), "with_touch": len(off), "certain": len(certain),
        "certain_with_touch": sum(onto.touches[i] >= 0 for i in certain),
        "residual_s": {"median": float(np.median(off)), "sd": float(np.std(off))} if off else None,
        "clocks": {str(number): vars(clock) for number, clock in onto.clocks.items()},
    }  # fmt: skip


def has_heights(match: Match) -> bool:
    """Say whether the feed has heights of the ball."""
    seen = np.isfinite(match.ball[:, :2]).all(axis=1)
    return bool(seen.any() and np.isfinite(match.ball[seen, 2]).mean() > 0.8)


def moment_of(
    touch: SolvedTouch, times: np.ndarray, path: np.ndarray, heights: bool, table: EventWords,
    event: MatchEvent | None = None,
) -> Moment | None:  # fmt: skip
    """Build the key moment of a touch.

    Args:
        touch: the solved touch.
        times: (N,) s of the player's path.
        path: (N, 2) m of the player.
        heights: whether the touch's height is known.
        table: labels by event.
        event: the event paired with the touch; its labels take precedence.
    Returns:
        The key moment, None if the table has no labels for it.
    """
    kind, details = _LIKE_EVENT[touch.kind]
    if touch.kind == kinds.SAVE and np.linalg.norm(touch.after) > _CAUGHT:
        details = (*details, "parried")
    filled_in = {**seen_words(touch.time, times, path), **height_words(touch.part, touch.position[2], heights)}
    if event is None:
        words = table.words(kind, touch.part, details, filled_in)
        return _moment(touch, words, TOUCHES, touch.confidence)
    part, filled_in = event.part or touch.part, {**filled_in, "side": event.side}
    if part != touch.part:
        filled_in.update(height_words(part, touch.position[2], heights))
    words = table.words(event.kind, part, event.details, filled_in) or table.words(kind, part, details, filled_in)
    return _moment(touch, words, BOTH, 1.0 - _FORGETS * (1.0 - touch.confidence))


def _moment(touch: SolvedTouch, words: tuple[str, ...], source: str, sure: float) -> Moment | None:
    if not words:
        return None
    return Moment(time=round(touch.time, 3), words=words, source=source, confidence=round(sure, 3))


def seen_words(time: float, times: np.ndarray, path: np.ndarray) -> dict[str, str]:
    """Find the gait label at a moment, from a player's path (N, 2) m at `times` (N,) s."""
    near = slice(*np.searchsorted(times, [time - 0.3, time + 0.3]))
    there = np.isfinite(path[near]).all(axis=1)
    seen, when = path[near][there], times[near][there]
    if len(seen) < 2:
        return {}
    away = np.linalg.norm(seen[-1] - seen[0]) / (when[-1] - when[0])
    return {"gait": "running" if away > _RUNNING else "standing"}


def height_words(part: str, height: float, known: bool) -> dict[str, str]:
    """Find the height and jump labels of a touch with the ball's centre at `height` m."""
    if not known:
        return {}
    if part == "hand":
        return {"height": "high" if height > _HIGH_HAND else "low" if height < _LOW_HAND else "middle"}
    return {"height": "high" if height > _HIGH_FOOT else "low", "jump": "jump" if height > _JUMP else ""}


def apart(moments: Iterable[Moment]) -> list[Moment]:
    """Select moments of one player at least MIN_DISTANCE_SECONDS apart, the most certain first: events before
    touches, sent before received balls.
    """
    kept: list[Moment] = []
    for moment in sorted(moments, key=_weight, reverse=True):
        if all(abs(moment.time - other.time) >= NEAREST for other in kept):
            kept.append(moment)
    return kept


def _weight(moment: Moment) -> tuple[float, float]:
    told = 0.5 * (moment.source in (EVENTS, BOTH)) + 0.3 * (not takes_with_foot(moment.words))
    return moment.confidence + told, -moment.time


def dribbles(touches: list[SolvedTouch]) -> list[Moment]:
    """Find the stretches in which one player dribbles: consecutive touches, at least one of them a dribble's."""
    out, first = [], 0
    for index in range(1, len(touches) + 1):
        if index < len(touches) and touches[index].time - touches[index - 1].time < _CHAIN:
            if touches[index - 1].kind in (kinds.DRIBBLE, kinds.RECEIVE):
                continue
        chain, first = touches[first:index], index
        lasts = chain[-1].time - chain[0].time
        if lasts >= _SHORTEST and any(touch.kind == kinds.DRIBBLE for touch in chain):
            sure = float(np.mean([touch.confidence for touch in chain]))
            out.append(Moment(time=round(chain[0].time, 3), words=_DRIBBLE.labels, source=TOUCHES,
                              confidence=round(sure, 3), end=round(chain[-1].time, 3)))
    return out


def ordered(moments: Iterable[Moment]) -> tuple[Moment, ...]:
    """Sort moments by time, stretches before key moments."""
    return tuple(sorted(moments, key=lambda moment: (moment.time, moment.end is None)))


def _notes(touches, left_out: Counter) -> list[str]:
    """Describe how many touches are left out, and why."""
    strangers = sum(not touch.player for touch in touches)
    told = [
        (strangers, "touches of the ball by untracked players"),
        (left_out["doubtful"], f"touches are ignored, with confidence below {LEAST_CONFIDENCE:g}"),
        (left_out["close"], f"touches are ignored, within {NEAREST:g} s of a more certain one of the same player"),
    ]
    return [f"{count} {what}" for count, what in told if count]


def _line(moment: Moment) -> str:
    """Format a moment as the contract's line."""
    return format_timeline(timeline_of([moment])).rstrip("\n")


def _digest(lines: Iterable[str]) -> str:
    """Compute the digest of lines, without their ends."""
    said = "\n".join(line.rstrip() for line in lines if line.strip())
    return hex_digest(said, digits=8)
