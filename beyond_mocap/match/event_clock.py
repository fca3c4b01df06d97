"""Align events with the tracking's clock: events are noted by people and software seconds late, and their clock may
drift against the cameras'.

Touches are solved from tracking (`solve_ball`); an event of a player belongs to one of their touches. Over all pairs of
an event and a touch of the same player, the most frequent time difference is the lag of a period; a line through the
pairs near it gives the drift. Events are seconds late, not minutes, so a large lag counts for less than a small one, by
a Cauchy distribution around zero: among few pairs a small lag wins, and a clock that is minutes off needs about three
agreeing pairs more than one that is seconds off. A period's events are used if so many fit that chance does not explain
it, at any lag as likely as theirs. Then each player's events and touches are paired in order, like two lines of text.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..annotation.event_labels import EVENT_KINDS
from ..ball.tracked.kinds import TOUCH_KINDS
from ..ball.tracked.solve import SolvedTouch
from ..base.errors import InputError
from ..files.event_data import CERTAIN_TOUCHES, MatchEvent, MatchEvents
from ..motion.track.match_data import Half

MAX_LAG = 300.0
"""s by which clocks may differ, for a feed whose clock starts elsewhere, if enough of its events agree."""

PAIR_WINDOW = 2.0
"""s around an event's time on the corrected clock within which its touch may be."""

_LAG_BIN = 0.1  # s, width of a bin of lags
_LAG_SPREAD = 0.5  # s, scatter of the lags of one period
_MAX_DRIFT = 0.002  # s per second
_MIN_EVENTS = 8  # events of players who touch the ball: with fewer the lag is unknown
_MIN_INSIDE = 4  # passes and shots in the solved time: with fewer a lag may be chance
_MIN_DRIFT_PAIRS = 30  # pairs: with fewer, drift cannot be separated from scatter
_MIN_CERTAIN = 15  # certain events: with fewer, a bad fit does not prove another match
_MIN_MATCHED, _MIN_CHANCE_RATIO = 0.3, 1.6  # least share of certain events that fit, and least ratio to chance
_USUAL_LAG = 5.0  # s, scale of the Cauchy distribution of lags
_MIN_CHANCE = 0.04  # least probability to fit with a wrong lag: few events estimate it badly
_MIN_CONFIDENCE = 4.0  # nats that make a clock certain
_PAIR_NATS = 2.7  # nats that one pair is worth
_DOUBTFUL_WEIGHT = 0.3  # weight of an event that may be no touch, relative to a certain one
_SENDING = {kind.name for kind in EVENT_KINDS if kind.ball == "sends"}
_TAKING = {kind.name for kind in EVENT_KINDS if kind.ball == "takes"}
_SENDING_TOUCHES = {kind.name for kind in TOUCH_KINDS if kind.ball == "sends"}
_TAKING_TOUCHES = {kind.name for kind in TOUCH_KINDS if kind.ball == "takes"}
_WRONG_LAGS = (-97.0, -71.0, -53.0, -37.0, 37.0, 53.0, 71.0, 97.0)  # s added to a lag to measure fits by chance
_FIT_SECONDS = 1.0  # s between event and touch within which they fit
_MISMATCH_COST = 0.6  # s, cost of another kind or body part
_NO_TOUCH_COST = 1.4  # s, cost of an event without a touch


@dataclass(frozen=True, kw_only=True)
class PeriodClock:
    """The clock of one period's events.

    Attributes:
        lag: s that events are later than their touches, at the start of the period.
        drift: s per second by which the lag grows.
        spread: s, the usual distance from the lag (median absolute deviation times 1.48).
        matched: share of the certain events that have a touch.
        by_chance: the same with wrong lags.
        event_count: number of certain events.
        confidence_nats: nats, how unlikely it is that so many fit by chance at a lag as large (`_compute_confidence`).
    """

    lag: float
    drift: float
    spread: float
    matched: float
    by_chance: float
    event_count: int
    confidence_nats: float

    @property
    def fits(self) -> bool:
        """True if its events fit touches better than by chance."""
        least = max(_MIN_MATCHED, _MIN_CHANCE_RATIO * self.by_chance)
        return self.confidence_nats >= _MIN_CONFIDENCE and self.matched >= least


@dataclass(frozen=True, kw_only=True)
class AlignedEvents:
    """The events of a match on the tracking's clock.

    Attributes:
        events: as given.
        times: (E,) s on the match's clock, lag removed; NaN in halves whose clock is unknown.
        touches: (E,) index of each event's touch, -1 if it has none.
        clocks: clock by period.
        notes: messages for people.
    """

    events: tuple[MatchEvent, ...]
    times: np.ndarray
    touches: np.ndarray
    clocks: Mapping[int, PeriodClock]
    notes: tuple[str, ...] = ()


def align_events(
    events: MatchEvents, touches: Sequence[SolvedTouch], halves: Sequence[Half],
    span: tuple[float, float] | None = None,
) -> AlignedEvents:
    """Align events with the tracking's clock and pair them with touches.

    A period whose events fit no better than by chance is left out.

    Args:
        events: the provider's events.
        touches: solved, on the match's clock, in order.
        halves: of the match.
        span: (start, end) s in which touches were solved, by default all; events outside keep their time and have no
            touch.
    Returns:
        The events with times and touches.
    Raises:
        InputError: if no period fits and there are many events: they belong to another match.
    """
    span = span or (-np.inf, np.inf)
    times, clocks, notes = np.full(len(events.events), np.nan), {}, []
    for half in halves:
        members = [i for i, event in enumerate(events.events) if event.period == half.number]
        half_touches = [touch for touch in touches if half.start <= touch.time <= half.end]
        found = _fit_half_clock([events.events[i] for i in members], half_touches, half, span)
        if found is None:
            if members and half_touches:
                why = _explain_few([events.events[i] for i in members], half)
                notes.append(f"period {half.number}: too few events of players who touch the ball to align its clock"
                             f"{why}; its events are ignored")
            continue
        clocks[half.number], times[members] = found
    _check_clocks(events, clocks)
    for number in [number for number, clock in clocks.items() if not clock.fits]:
        notes.append(f"{_describe_clock(number, clocks.pop(number))}, which may be chance; its events are ignored")
        times[[i for i, event in enumerate(events.events) if event.period == number]] = np.nan
    pairs = _pair_touches(events.events, times, touches)
    notes += [_describe_clock(number, clock) for number, clock in clocks.items()]
    return AlignedEvents(events=events.events, times=times, touches=pairs, clocks=clocks, notes=tuple(notes))


def _explain_few(events: Sequence[MatchEvent], half: Half) -> str:
    """Tell times beyond the period, such as milliseconds, or types without touch, where these leave too few."""
    latest, end = max(event.time for event in events), half.end - half.clock_zero
    if sum(event.time <= end + MAX_LAG for event in events) < min(_MIN_EVENTS, len(events)):
        return f" (the latest is at {latest:.0f} s, the period ends at {end:.0f} s)"
    others = dict.fromkeys(event.original_text for event in events if event.kind == "other" and event.original_text)
    if others and sum(event.may_be_touch for event in events) < _MIN_EVENTS:
        return f" (types not taken for ball touches: {', '.join(others)[:80]})"
    return ""


def _fit_half_clock(events, touches, half: Half, span) -> tuple[PeriodClock, np.ndarray] | None:
    """Fit a half's clock; return it and its events' times (E,) s on the match's clock, None if it is unknown.

    A clock that does not count from the start of the half is tried from its first frame too.
    """
    since = np.array([event.time for event in events])
    candidates = []
    for zero in dict.fromkeys((half.clock_zero, half.start)):
        clock = _fit_clock(events, since, touches, zero, span)
        if clock is not None:
            candidates.append((clock, zero + (since - clock.lag) / (1.0 + clock.drift)))
    return max(candidates, key=lambda one: one[0].confidence_nats, default=None)


def _describe_clock(number: int, clock: PeriodClock) -> str:
    drift = f", drifting {1000.0 * clock.drift:+.2f} s in 1000 s" if clock.drift else ""
    return (
        f"period {number}: events come {clock.lag:.2f} s after their touches{drift}, "
        f"± {clock.spread:.2f} s; "
        f"{clock.matched:.0%} of passes and shots fit (by chance {clock.by_chance:.0%})"
    )


def _fit_clock(events, since, touches, start: float, span) -> PeriodClock | None:
    """Fit the clock of one period, which is 0 at `start` s; since: (E,) s, its events' times on it."""
    touch_times = np.array([touch.time - start for touch in touches])
    players = np.array([touch.player for touch in touches])
    is_sending = np.array([touch.kind in _SENDING_TOUCHES for touch in touches], bool)
    early, late, origin = [], [], []
    for event, time in zip(events, since):
        if event.may_be_touch and event.player and np.isfinite(time):
            own = touch_times[(players == event.player) & (is_sending if event.kind in _SENDING else True)]
            near = own[np.abs(time - own) <= MAX_LAG]
            early += [time] * len(near)
            late += near.tolist()
            origin += [event.kind in CERTAIN_TOUCHES] * len(near)
    if len(set(early)) < _MIN_EVENTS:
        return None
    early, late, certain = np.array(early), np.array(late), np.array(origin)
    lag = _find_commonest_lag(early - late, np.where(certain, 1.0, _DOUBTFUL_WEIGHT))
    lag, drift = _fit_line(early, late, lag)
    fit = _EventFit(events, since, touch_times, who=players, span=(span[0] - start, span[1] - start), drift=drift)
    right, wrong = fit.count_fitting([lag]), fit.count_fitting([lag + by for by in _WRONG_LAGS])
    if right[0, 1] < _MIN_INSIDE:
        return None
    # 1.48 turns the median absolute deviation of a normal distribution into its standard deviation.
    rest = early - late * (1.0 + drift) - lag
    near = rest[np.abs(rest) < 3.0 * _LAG_SPREAD]
    spread = 1.48 * float(np.median(np.abs(near - np.median(near)))) if len(near) else np.nan
    matched, chance = right[0, 0] / right[0, 1], wrong[0, 0] / max(wrong[0, 1], 1)
    doubtful = _compute_confidence(right[1, 0], right[1, 1], wrong[1, 0] / max(wrong[1, 1], 1))
    confidence = _compute_confidence(right[0, 0], right[0, 1],
                                     chance) + _DOUBTFUL_WEIGHT * doubtful - _compute_lag_cost(lag)
    return PeriodClock(lag=float(lag), drift=float(drift), spread=spread, matched=float(matched),
                       by_chance=float(chance), event_count=int(right[0, 1]), confidence_nats=float(confidence))


def _find_commonest_lag(lags: np.ndarray, weights: np.ndarray) -> float:
    """Find the lag (s) with most weight within _LAG_SPREAD, minus the cost of a large lag; of equal ones the
    smallest.
    """
    edges = np.arange(-MAX_LAG - 1.0, MAX_LAG + 1.0 + _LAG_BIN, _LAG_BIN)
    counts, _ = np.histogram(lags, edges, weights=weights)
    reach = np.arange(-15, 16) * _LAG_BIN
    middles = 0.5 * (edges[1:] + edges[:-1])
    smooth = np.convolve(counts, np.exp(-0.5 * (reach / _LAG_SPREAD) ** 2),
                         "same") - _compute_lag_cost(middles) / _PAIR_NATS
    smooth -= smooth.min()
    best = np.flatnonzero(smooth >= smooth.max() * (1.0 - 1e-9))
    return float(middles[best[np.abs(middles[best]).argmin()]])


def _compute_lag_cost(lag):
    """Compute the nats by which a lag (s) is less likely than none: a Cauchy distribution around the usual lags."""
    return np.log1p((lag / _USUAL_LAG) ** 2)


def _fit_line(early: np.ndarray, late: np.ndarray, lag: float) -> tuple[float, float]:
    """Fit lag and drift through the pairs near `lag`; distant pairs count less and less.

    A drift is accepted only if many pairs over a long time show it.
    """
    found, drift = lag, 0.0
    for reach in (6.0 * _LAG_SPREAD, 4.0 * _LAG_SPREAD, 3.0 * _LAG_SPREAD, 2.0 * _LAG_SPREAD, 2.0 * _LAG_SPREAD):
        off = early - late * (1.0 + drift) - found
        near = np.abs(off) < reach
        if np.count_nonzero(near) < _MIN_EVENTS:
            break
        x, y = late[near], (early - late)[near]
        # Tukey's biweight; the reach shrinks from round to round.
        weights = (1.0 - (off[near] / reach) ** 2) ** 2
        middle = np.average(x, weights=weights)
        around = np.average((x - middle) ** 2, weights=weights)
        mean = np.average(y, weights=weights)
        slope = np.average((x - middle) * (y - mean), weights=weights) / max(around, 1e-9)
        error = np.sqrt(np.average((y - mean) ** 2, weights=weights) / max(around, 1e-9) / np.count_nonzero(near))
        has_drift = np.count_nonzero(near) >= _MIN_DRIFT_PAIRS and abs(slope) > 4.0 * error and abs(slope) < _MAX_DRIFT
        drift = float(slope) if has_drift else 0.0
        found = float(mean - drift * middle)
    return found, drift


class _EventFit:
    """Count events that have a touch of their player within _FIT_SECONDS, at any lag.

    Args:
        events: E events.
        since: (E,) s of events on the period's clock.
        when: (T,) s of touches on the period's clock.
        who: (T,) players of the touches.
        span: (start, end) s on the period's clock.
        drift: s per second.
    """

    def __init__(self, events, since: np.ndarray, when: np.ndarray, who: np.ndarray, span, drift: float):
        self._span, self._drift, self._rows = span, drift, []
        known = np.isfinite(since)
        named = np.array([event.player for event in events])
        certain = np.array([event.kind in CERTAIN_TOUCHES for event in events], bool)
        played = known & np.array([event.may_be_touch for event in events], bool) & (named != "")
        for player in np.unique(named[played]):
            own = played & (named == player)
            edges = np.concatenate([[-np.inf], np.sort(when[who == player]), [np.inf]])
            self._rows.append((since[own], certain[own], edges))

    def count_fitting(self, lags) -> np.ndarray:
        """Count [fitting, all] within the span over all `lags`: row 0 certain events, row 1 the others."""
        out = np.zeros((2, 2), int)
        for since, certain, edges in self._rows:
            there = (since - np.reshape(lags, (-1, 1))) / (1.0 + self._drift)
            after = np.searchsorted(edges, there)
            near = np.minimum(edges[after] - there, there - edges[after - 1]) <= _FIT_SECONDS
            inside = (there >= self._span[0]) & (there <= self._span[1])
            for row, which in enumerate((certain, ~certain)):
                out[row] += np.count_nonzero(inside & near & which), np.count_nonzero(inside & which)
        return out


def _compute_confidence(fitting: int, count: int, chance: float) -> float:
    """Compute the nats: how unlikely it is that as many of `count` fit by `chance` (Chernoff's bound of a binomial
    tail).
    """
    chance = min(max(chance, _MIN_CHANCE), 0.99)
    share = fitting / max(count, 1)
    if share <= chance:
        return 0.0
    rest = (1.0 - share) * np.log((1.0 - share) / (1.0 - chance)) if share < 1.0 else 0.0
    return float(count * (share * np.log(share / chance) + rest))


def _check_clocks(events: MatchEvents, clocks: Mapping[int, PeriodClock]) -> None:
    """Check that a period fits better than by chance, if there are enough events; InputError otherwise."""
    many = sum(clock.event_count for clock in clocks.values()) >= _MIN_CERTAIN
    if many and not any(clock.fits for clock in clocks.values()):
        best = max(clocks.values(), key=lambda clock: clock.matched)
        found = f"{best.matched:.0%} of passes and shots fit a touch of their player (by chance {best.by_chance:.0%})"
        raise InputError(events.where, found, "events of the same match", "check both files")


def _pair_touches(events: Sequence[MatchEvent], times: np.ndarray, touches: Sequence[SolvedTouch]) -> np.ndarray:
    """Pair each player's events with touches at the lowest cost, in order; (E,) touch indices, -1 for none."""
    out = np.full(len(events), -1)
    for player in sorted({event.player for event in events if event.player}):
        player_events = [i for i, event in enumerate(events) if event.player == player and event.may_be_touch
                         and np.isfinite(times[i])]
        player_events.sort(key=lambda i: times[i])
        player_touches = [i for i, touch in enumerate(touches) if touch.player == player]
        for event, touch in _pair_in_order(player_events, player_touches, events, times, touches):
            out[event] = touch
    return out


def _pair_in_order(player_events, player_touches, events, times, touches) -> list[tuple[int, int]]:
    """Pair events and touches (event, touch) in the order of both, by dynamic programming."""
    best = np.full((len(player_events) + 1, len(player_touches) + 1), np.inf)
    best[0], steps = 0.0, np.zeros(best.shape, int)
    # best[r, c]: lowest cost of the first r events and c touches. Steps: 0 the event has no touch,
    # 1 the touch has no event, 2 they are a pair.
    for row, event in enumerate(player_events, 1):
        best[row, 0] = best[row - 1, 0] + _NO_TOUCH_COST
        for column, touch in enumerate(player_touches, 1):
            cost = _compute_difference(events[event], touches[touch], times[event])
            costs = (best[row - 1, column] + _NO_TOUCH_COST, best[row, column - 1], best[row - 1, column - 1] + cost)
            steps[row, column] = int(np.argmin(costs))
            best[row, column] = costs[steps[row, column]]
    row, column, found = len(player_events), len(player_touches), []
    while row and column:
        step = steps[row, column]
        if step == 2:
            found.append((player_events[row - 1], player_touches[column - 1]))
        row, column = row - (step != 1), column - (step > 0)
    return found[::-1]


def _compute_difference(event: MatchEvent, touch: SolvedTouch, time: float) -> float:
    """Compute how much a touch differs from an event, in s; inf beyond PAIR_WINDOW."""
    distance = abs(touch.time - time)
    if distance > PAIR_WINDOW:
        return np.inf
    expected = _SENDING_TOUCHES if event.kind in _SENDING else _TAKING_TOUCHES if event.kind in _TAKING else {
        touch.kind}
    unlike = touch.kind not in expected
    other_part = event.part in ("head", "hand") and touch.part != event.part
    return distance + _MISMATCH_COST * unlike + 0.5 * _MISMATCH_COST * other_part
