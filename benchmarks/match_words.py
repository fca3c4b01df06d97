"""Events on the tracking's clock, and the words that everybody gets: `python -m benchmarks.match_words`.

Made matches with events that come late, scatter, and are partly missing; and six recorded minutes whose events have the
provider's raw times, late by some three seconds, beside times that were tied to touches by hand.
"""

from __future__ import annotations

import csv
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from beyond_mocap.ball.tracked.planted import planted_match  # noqa: E402
from beyond_mocap.ball.tracked.planted_feed import sampled  # noqa: E402
from beyond_mocap.errors import InputError  # noqa: E402
from beyond_mocap.files.event_data import CERTAIN, MatchEvent, MatchEvents  # noqa: E402
from beyond_mocap.files.events import read_events  # noqa: E402
from beyond_mocap.match.event_clock import aligned  # noqa: E402
from beyond_mocap.match.words import words_of  # noqa: E402
from beyond_mocap.solve_ball import solve_ball  # noqa: E402

from benchmarks.ball_touches import EVENTS, of_feed  # noqa: E402
from benchmarks.markdown import head, row  # noqa: E402
from benchmarks.touch_reading import match_of  # noqa: E402

KINDS = {"kick": "pass", "header": "pass", "receive": "receive", "throw-in": "pass"}
ACTIONS = {"kick": "kick", "header": "header", "receive": "receive", "throw-in": "throwb"}
COLUMNS = (
    "match", "events", "lag s (true)", "lag s (found)", "spread s", "passes and shots that fit (by chance)",
    "events at their touch within 0.1 s: precision", "recall", "F1",
)  # fmt: skip
TOLERANCE = 0.1  # s


def made_events(truth, lag: float, scatter: float, share: float, seed: int) -> tuple[MatchEvents, np.ndarray]:
    """Events of some of a made match's touches, and the true second of each."""
    rng = np.random.default_rng(seed)
    rows = [
        (MatchEvent(touch.time + lag + rng.normal(0.0, scatter), 1, touch.player, "", KINDS[touch.word]), touch.time)
        for touch in truth.touches if touch.word in KINDS and rng.random() < share
    ]  # fmt: skip
    rows.sort(key=lambda one: one[0].time)
    return MatchEvents(tuple(event for event, _ in rows), "made"), np.array([time for _, time in rows])


def raw_events(match) -> tuple[MatchEvents, np.ndarray]:
    """The recorded events with their provider's times; and the true second of those that were tied to a touch, NaN of
    the others."""
    events = read_events(EVENTS, match=match)
    with open(EVENTS, newline="", encoding="utf-8") as file:
        rows = sorted(csv.DictReader(file), key=lambda event: float(event["time_s"]))
    raw = tuple(replace(event, time=float(one["opta_t"])) for event, one in zip(events.events, rows))
    true = [float(one["time_s"]) if one["sync"] == "touch" else np.nan for one in rows]
    return replace(events, events=raw), np.array(true)


def figures(name: str, events: MatchEvents, true: np.ndarray, solved, halves, span=None) -> list[str]:
    """A row of the table. true: (E,) s, NaN where nobody knows; span: s, of a part of the match."""
    late = np.array([event.time for event in events.events]) - true
    try:
        found = aligned(events, solved.touches, halves, span)
    except InputError as error:
        return [name, str(len(true)), f"{np.nanmean(late):.2f}", str(error)[:60], *["-"] * 5]
    clock = next(iter(found.clocks.values()))
    times = np.where(found.touches >= 0, [solved.touches[i].time for i in found.touches], np.nan)
    sure = [i for i, event in enumerate(found.events) if event.kind in CERTAIN and np.isfinite(true[i])]
    low, high = span or (-np.inf, np.inf)
    sure = [i for i in sure if low + 1.0 < true[i] < high - 1.0]
    right = sum(abs(times[i] - true[i]) <= TOLERANCE for i in sure)
    tied = sum(np.isfinite(times[i]) for i in sure)
    precision, recall = right / max(tied, 1), right / max(len(sure), 1)
    return [
        name, str(len(sure)), f"{np.nanmean(late[sure]):.2f}", f"{clock.lag:.2f}", f"{clock.spread:.2f}",
        f"{clock.matched:.0%} ({clock.by_chance:.0%})", f"{precision:.3f}", f"{recall:.3f}",
        f"{2.0 * precision * recall / max(precision + recall, 1e-9):.3f}",
    ]  # fmt: skip


def told(truth, words) -> str:
    """How many of a made match's touches have a moment of their player and word within 0.15 s."""
    wanted = [touch for touch in truth.touches if touch.word in ACTIONS]
    found = sum(
        any(ACTIONS[one.word] in moment.words and abs(moment.time - one.time) <= 0.15
            for moment in words.players[one.player])
        for one in wanted
    )  # fmt: skip
    moments = sum(moment.end is None for own in words.players.values() for moment in own)
    return f"{found} of {len(wanted)} touches by their word; {moments} key moments"


def main() -> None:
    """Prints the table, and what words made matches get."""
    lines, notes = [], []
    for seed, lag, scatter in ((11, 0.0, 0.3), (11, 2.9, 0.6), (12, 2.9, 0.6), (12, -4.0, 0.2)):
        truth = planted_match(180.0, seed)
        match = of_feed(sampled(truth))
        solved = solve_ball(match)
        events, true = made_events(truth, lag, scatter, 0.6, seed)
        lines.append(figures(f"made {seed}, scatter {scatter:g} s", events, true, solved, match.halves))
        for what, given in (("touches alone", None), ("with events", events)):
            notes.append(f"- made {seed}, lag {lag:g} s, {what}: {told(truth, words_of(match, solved, given))}")
    match = match_of("dutch")
    solved = solve_ball(match)
    events, true = raw_events(match)
    lines.append(figures("dutch, raw times", events, true, solved, match.halves))
    for start in (0.0, 120.0, 240.0):
        part = solve_ball(match, start=start, end=start + 60.0)
        name = f"dutch, raw times, {start:g}-{start + 60.0:g} s"
        lines.append(figures(name, events, true, part, match.halves, (start, start + 60.0)))
    strange = MatchEvents(tuple(replace(event, time=350.0 - event.time) for event in events.events), "dutch backwards")
    lines.append(figures("dutch, events backwards", strange, 350.0 - true, solved, match.halves))
    print("\n".join([*head(COLUMNS), *map(row, lines), "", *dict.fromkeys(notes)]))


if __name__ == "__main__":
    main()
