"""Label what each player does with the ball and when, from solved touches and from a provider's events.

    labels = label_match(match, solve_ball(match), read_events("events.xml", match=match))
    timeline = build_timeline(labels.players["home_7"], 0.0, 60.0)  # `moments`
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from ..annotation.event_labels import EventLabelTable, read_event_labels
from ..ball.tracked import kinds
from ..ball.tracked.solve import SolvedBall, SolvedTouch
from ..base.errors import format_count
from ..files.event_data import CERTAIN_TOUCHES, MatchEvent, MatchEvents
from ..motion.track.match_data import Match
from .duels import RUNNING, Duel, find_blocks, find_duels, label_lost_duels
from .event_clock import AlignedEvents, align_events
from .goalkeeping.saves import find_save_event, find_save_values, label_missed_saves, label_set_positions
from .goalkeeping.shots import GOAL, SAVED, Shot, find_shots, list_shots_at
from .moments import (
    BOTH,
    EVENTS,
    MIN_DISTANCE_SECONDS,
    SHOTS,
    TOUCHES,
    Moment,
    build_moment,
    select_separate_moments,
    sort_moments,
)
from .play import find_kept_lines

MIN_CONFIDENCE = 0.3
"""Touches with less confidence give no key moment."""

_RUNNING_SPEED = 2.0  # m/s, from which the player is running at a touch
_HIGH_FOOT, _HIGH_HAND, _LOW_HAND = 0.45, 1.5, 0.7  # m of the ball's centre
_JUMP_HEIGHT = 2.05  # m of the ball's centre, too high for a header without a jump
_CAUGHT_SPEED = 3.0  # m/s of the ball after a save: a slower ball was caught
_CHAIN_SECONDS = 3.0  # s between touches of one dribble
_MIN_DRIBBLE = 0.8  # s of a dribble
_DOUBT_WITH_EVENT = 0.2  # share of a touch's doubt that remains if an event confirms it
_EVENT_CONFIDENCE = 0.4  # confidence of an event without a touch
_SAME_MOMENT_SECONDS = 0.5  # s around an event without a touch in which another moment of the player stands for it
_BLOCK, _BLOCK_IN_RUN = ("deflection", ("blocked",)), ("receive", ())  # kind and details: no lunge out of a run
_TOUCH_EVENTS = {kind.name: (kind.event, kind.details) for kind in kinds.TOUCH_KINDS}
_DRIBBLE = next(kind for kind in kinds.TOUCH_KINDS if kind.name == kinds.DRIBBLE)


@dataclass(frozen=True)
class MatchLabels:
    """The labels of a match.

    Attributes:
        players: moments in order of time by id, for all players; () for a player who never touches the ball.
        notes: messages for people.
        figures: of the events' clock and how the events fit, {} without events.
    """

    players: Mapping[str, tuple[Moment, ...]]
    notes: tuple[str, ...] = ()
    figures: Mapping[str, object] = field(default_factory=dict)


def label_match(
    match: Match, solved: SolvedBall | None, events: MatchEvents | None = None, table: EventLabelTable | None = None,
    sides: Mapping[int, str] = MappingProxyType({}),
) -> MatchLabels:
    """Label all players of a match.

    A touch becomes a key moment with the labels that the table has for it, or for the event paired with it; its time is
    the touch's. Consecutive touches of one player are a stretch of dribble. A pass, shot or save without a touch
    becomes a key moment at its time on the corrected clock. Of two within MIN_DISTANCE_SECONDS the more certain one
    stays. Who loses a duel reaches and misses, who is hit by a kick blocks it (`duels`); goalkeepers wait for shots and
    save them as the ball comes (`goalkeeping`). Unknown details (the foot, a height without heights in the feed) are
    left out of the labels.

    Args:
        match: the match.
        solved: the ball, on the match's clock; None if it cannot be solved.
        events: the provider's events; None: no events.
        table: labels by event; None: the built-in table.
        sides: "left" or "right" by the touch's number, where that was seen.
    Returns:
        The labels.
    Raises:
        InputError: if events fit no better than by chance.
    """
    table = table or read_event_labels()
    touches = solved.touches if solved else ()
    span = (float(solved.times[0]), float(solved.times[-1])) if solved else None
    aligned = align_events(events, touches, match.halves, span) if events and solved else None
    event_by_touch = {touch: event for event, touch in enumerate(aligned.touches) if touch >= 0} if aligned else {}
    heights, left_out, players = has_heights(match), Counter(), {}
    goal_lines = find_kept_lines(match) if solved else {}
    shots = find_shots(match, solved, goal_lines) if solved else ()
    saves = {shot.save: shot for shot in shots if shot.save >= 0}
    duels, blocks = find_duels(match, touches, goal_lines, aligned), find_blocks(match, touches)
    for player, path in zip(match.players, match.positions):
        player_touches = [(i, touch) for i, touch in enumerate(touches) if touch.player == player.id]
        found = [moment for i, touch in player_touches if (moment := build_touch_moment(
            touch, match.times, path, heights, table, event=aligned.events[event_by_touch[i]] if i in event_by_touch
            else None, shot=saves.get(i), is_block=i in blocks, side=sides.get(i, ""),
        ))]  # fmt: skip
        confident = [moment for moment in found if moment.confidence >= MIN_CONFIDENCE]
        if aligned:
            confident += _label_untouched_events(player.id, aligned, span, times=match.times, path=path, table=table,
                                                 others=found)
        shots_at = list_shots_at(shots, player.id)
        confident += [*label_lost_duels(duels, player.id, table, _find_lost_values(duels, match.times, path, heights)),
                      *label_missed_saves(shots_at, table, heights)]
        selected = select_separate_moments(confident)
        left_out["doubtful"] += sum(moment.confidence < MIN_CONFIDENCE for moment in found)
        left_out["close"] += len(confident) - len(selected)
        selected += find_dribbles([touch for _, touch in player_touches])
        players[player.id] = sort_moments([*selected, *label_set_positions(shots_at, selected, match.times, path)])
    notes = (*(events.notes if events else ()), *(aligned.notes if aligned else ()),
             *_describe_left_out(touches, left_out), *_describe_contests(duels, shots))
    return MatchLabels(players, notes, _measure_event_fit(aligned, touches, span) if aligned else {})


def _find_lost_values(duels: Sequence[Duel], times: np.ndarray, path: np.ndarray,
                      heights: bool) -> dict[float, dict[str, str]]:
    """Find, by a duel's time, the labels that replace placeholders for a player on a path (N, 2) m."""
    return {duel.time: {**find_gait_label(duel.time, times, path), **find_height_labels("foot", duel.height, heights)}
            for duel in duels}


def _label_untouched_events(player: str, aligned: AlignedEvents, span, times, path, table, others) -> list[Moment]:
    """Label one player's certain events without a touch, unless another of their moments stands for the event."""
    out = []
    for index, event in enumerate(aligned.events):
        time = float(aligned.times[index])
        if event.player != player or event.kind not in CERTAIN_TOUCHES or aligned.touches[index] >= 0:
            continue
        if not span[0] <= time <= span[1] or any(abs(one.time - time) < _SAME_MOMENT_SECONDS for one in others):
            continue
        values = {**find_gait_label(time, times, path), "side": event.side}
        labels = table.find_labels(event.kind, event.part or "foot", event.details, values)
        out += filter(None, [build_moment(time, labels, EVENTS, _EVENT_CONFIDENCE)])
    return out


def _measure_event_fit(aligned: AlignedEvents, touches, span) -> dict[str, object]:
    """Measure how the events fit: counts, and each period's clock."""
    inside = [i for i, time in enumerate(aligned.times) if span[0] <= time <= span[1]
              and aligned.events[i].may_be_touch]
    certain = [i for i in inside if aligned.events[i].kind in CERTAIN_TOUCHES]
    off = [touches[aligned.touches[i]].time - aligned.times[i] for i in inside if aligned.touches[i] >= 0]
    return {
        "events": len(inside), "with_touch": len(off), "certain": len(certain),
        "certain_with_touch": sum(aligned.touches[i] >= 0 for i in certain),
        "residual_s": {"median": float(np.median(off)), "sd": float(np.std(off))} if off else None,
        "clocks": {str(number): vars(clock) for number, clock in aligned.clocks.items()},
    }  # fmt: skip


def has_heights(match: Match) -> bool:
    """Say whether the feed has heights of the ball."""
    seen = np.isfinite(match.ball[:, :2]).all(axis=1)
    return bool(seen.any() and np.isfinite(match.ball[seen, 2]).mean() > 0.8)


def build_touch_moment(
    touch: SolvedTouch, times: np.ndarray, path: np.ndarray, heights: bool, table: EventLabelTable,
    event: MatchEvent | None = None, shot: Shot | None = None, is_block: bool = False, side: str = "",
) -> Moment | None:  # fmt: skip
    """Build the key moment of a touch.

    Args:
        touch: the solved touch.
        times: (N,) s of the player's path.
        path: (N, 2) m of the player.
        heights: whether the touch's height is known.
        table: labels by event.
        event: the event paired with the touch; its labels take precedence.
        shot: the shot that the touch saves, None for another touch.
        is_block: whether the touch blocks a kick.
        side: "left" or "right" where that was seen, else "".
    Returns:
        The key moment, None if the table has no labels for it.
    """
    kind, details = _TOUCH_EVENTS[touch.kind]
    own_part = touch.part
    if shot is not None:
        own_part = "hand"
        kind, details = find_save_event(shot, float(np.linalg.norm(touch.after)), heights)
    elif touch.kind == kinds.SAVE and np.linalg.norm(touch.after) > _CAUGHT_SPEED:
        details = (*details, "parried")
    values = {**find_gait_label(touch.time, times, path), **find_height_labels(own_part, touch.position[2], heights),
              **({} if shot is None else find_save_values(shot, heights)), **({"side": side} if side else {})}
    if is_block and shot is None:
        kind, details = _BLOCK_IN_RUN if values.get("gait") == RUNNING else _BLOCK
    if event is None:
        labels = table.find_labels(kind, own_part, details, values)
        return build_moment(touch.time, labels, TOUCHES if shot is None else SHOTS, touch.confidence)
    part = event.part or own_part
    values = values if shot is not None else {**values, "side": side or event.side}
    if part != own_part:
        values.update(find_height_labels(part, touch.position[2], heights))
    labels = table.find_labels(event.kind, part, event.details, values) or table.find_labels(kind, part, details,
            values)
    return build_moment(touch.time, labels, BOTH, 1.0 - _DOUBT_WITH_EVENT * (1.0 - touch.confidence))


def find_gait_label(time: float, times: np.ndarray, path: np.ndarray) -> dict[str, str]:
    """Find the gait label at a moment, from a player's path (N, 2) m at `times` (N,) s."""
    near = slice(*np.searchsorted(times, [time - 0.3, time + 0.3]))
    is_known = np.isfinite(path[near]).all(axis=1)
    seen, when = path[near][is_known], times[near][is_known]
    if len(seen) < 2:
        return {}
    speed = np.linalg.norm(seen[-1] - seen[0]) / (when[-1] - when[0])
    return {"gait": "running" if speed > _RUNNING_SPEED else "standing"}


def find_height_labels(part: str, height: float, known: bool) -> dict[str, str]:
    """Find the height and jump labels of a touch with the ball's centre at `height` m."""
    if not known:
        return {}
    if part == "hand":
        return {"height": "high" if height > _HIGH_HAND else "low" if height < _LOW_HAND else "middle"}
    return {"height": "high" if height > _HIGH_FOOT else "low", "jump": "jump" if height > _JUMP_HEIGHT else ""}


def find_dribbles(touches: list[SolvedTouch]) -> list[Moment]:
    """Find the stretches in which one player dribbles: consecutive touches, at least one of them a dribble's."""
    out, first = [], 0
    for index in range(1, len(touches) + 1):
        if index < len(touches) and touches[index].time - touches[index - 1].time < _CHAIN_SECONDS:
            if touches[index - 1].kind in (kinds.DRIBBLE, kinds.RECEIVE):
                continue
        chain, first = touches[first:index], index
        duration = chain[-1].time - chain[0].time
        if duration >= _MIN_DRIBBLE and any(touch.kind == kinds.DRIBBLE for touch in chain):
            confidence = float(np.mean([touch.confidence for touch in chain]))
            out.append(Moment(time=round(chain[0].time, 3), labels=_DRIBBLE.labels, source=TOUCHES,
                              confidence=round(confidence, 3), end=round(chain[-1].time, 3)))
    return out


def _describe_contests(duels: Sequence[Duel], shots: Sequence[Shot]) -> list[str]:
    """Describe how many duels and shots there are."""
    lines = [f"{format_count(len(duels), 'duel', 'duels')}: the player who loses one reaches and misses"]
    counts = [(sum(shot.end == end for shot in shots), text) for end, text in ((SAVED, "saved"), (GOAL, "in the goal"))]
    ends = ", ".join(f"{count} {text}" for count, text in counts)
    lines_of_shots = [f"{format_count(len(shots), 'shot at a goal', 'shots at a goal')}: {ends}"]
    return lines * bool(duels) + lines_of_shots * bool(shots)


def _describe_left_out(touches, left_out: Counter) -> list[str]:
    """Describe how many touches are left out, and why."""
    untracked = sum(not touch.player for touch in touches)
    counts = [
        (untracked, "of the ball by untracked players"),
        (left_out["doubtful"], f"ignored, with confidence below {MIN_CONFIDENCE:g}"),
        (left_out["close"], f"ignored, within {MIN_DISTANCE_SECONDS:g} s of a more certain one of the same player"),
    ]
    return [f"{format_count(count, 'touch', 'touches')} {what}" for count, what in counts if count]
