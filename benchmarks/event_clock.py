"""How often events of a match, and of another one, are taken for its own in a short span:
`python -m benchmarks.event_clock`.

Spans of a recorded match with its provider's raw times, and of the touches of a recorded half with events made from
them, late by known seconds. Events of another match are these with players changed among each other, at shuffled times,
backwards, or of another part of the half. A span counts as right where the lag is found within 1.2 s.
"""

from __future__ import annotations

import csv
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from beyond_mocap.errors import InputError  # noqa: E402
from beyond_mocap.files.event_data import MatchEvent, MatchEvents  # noqa: E402
from beyond_mocap.files.match_data import Half  # noqa: E402
from beyond_mocap.match.event_clock import aligned  # noqa: E402
from beyond_mocap.solve_ball import solve_ball  # noqa: E402

from benchmarks.markdown import head, row  # noqa: E402
from benchmarks.match_words import raw_events  # noqa: E402
from benchmarks.places import DATA  # noqa: E402
from benchmarks.touch_reading import match_of  # noqa: E402

TOUCHES = DATA / "tracking" / "match" / "nl2019_half1_touches_derived.csv"
KINDS = {"kick": "pass", "header": "pass", "throw-in": "pass"}
SPANS = (30.0, 60.0, 90.0, 180.0)  # s
OFF = 1.2  # s of a lag
FAR = 200.0  # s by which a whole clock is shifted
COLUMNS = ("events", *(f"{span:g} s" for span in SPANS))


def moved(events: MatchEvents, **changes: Sequence) -> MatchEvents:
    """Events with other values of some fields, in order of time."""
    rows = [replace(event, **dict(zip(changes, values))) for event, *values in zip(events.events, *changes.values())]
    return replace(events, events=tuple(sorted(rows, key=lambda event: event.time)))


def strangers(events: MatchEvents, seed: int) -> MatchEvents:
    """Every player in another one's place, nobody in his own."""
    players = np.random.default_rng(seed).permutation(sorted({event.player for event in events.events if event.player}))
    other = {"": "", **dict(zip(players.tolist(), np.roll(players, 1).tolist()))}
    return moved(events, player=[other[event.player] for event in events.events])


def shuffled(events: MatchEvents, seed: int) -> MatchEvents:
    """Everybody's events at somebody's times."""
    return moved(events, time=np.random.default_rng(seed).permutation([event.time for event in events.events]).tolist())


def made(touches: Sequence, lag: float, seed: int, share: float = 0.9, scatter: float = 0.6) -> MatchEvents:
    """Passes for a share of the kicks, late by `lag` s and scattered."""
    rng = np.random.default_rng(seed)
    rows = [
        MatchEvent(touch.time + lag + rng.normal(0.0, scatter), 1, touch.player, "", KINDS[touch.kind])
        for touch in touches if touch.kind in KINDS and rng.random() < share
    ]  # fmt: skip
    return MatchEvents(tuple(sorted(rows, key=lambda event: event.time)), "made")


def verdicts(
    events: MatchEvents, touches, halves, starts: Iterable[float], length: float, lag: float | None
) -> Counter:
    """What becomes of the events in spans from `starts` on: right, wrong lag, or for another match's (no lag) accepted;
    told; refused."""
    out = Counter()
    for start in starts:
        own = [touch for touch in touches if start <= touch.time <= start + length]
        try:
            clocks = aligned(events, own, halves, (start, start + length)).clocks
        except InputError:
            out["refused"] += 1
            continue
        found = next(iter(clocks.values()), None)
        close = found is not None and lag is not None and abs(found.lag - lag) < OFF
        out["left out" if found is None else "accepted" if lag is None else "right" if close else "wrong lag"] += 1
    return out


def line(name: str, given: Sequence[MatchEvents], touches, halves, lasts: float, step: float, lag=None) -> str:
    """A row of the table: all spans of all these events."""
    cells = []
    for length in SPANS:
        counted = Counter()
        for events in given:
            counted += verdicts(events, touches, halves, np.arange(0.0, lasts - length + 1.0, step), length, lag)
        shares = {what: count / counted.total() for what, count in counted.items()}
        good = ("right", "wrong lag") if lag is not None else ("accepted", "refused")
        cells.append(", ".join(f"{what} {shares.get(what, 0.0):.0%}" for what in good))
    return row([name, *cells])


def main() -> None:
    """Prints the table."""
    match = match_of("dutch")
    solved = solve_ball(match)
    events, true = raw_events(match)
    late = float(np.nanmedian([event.time for event in events.events] - true))
    given = (solved.touches, match.halves, 350.0, 5.0)
    times = [event.time for event in events.events]
    lines = [
        line("recorded, raw times", [events], *given, late),
        line(f"recorded, {FAR:g} s later", [moved(events, time=[time + FAR for time in times])], *given, late + FAR),
        line("recorded, players changed", [strangers(events, seed) for seed in range(3)], *given),
        line("recorded, times shuffled", [shuffled(events, seed) for seed in range(3)], *given),
        line("recorded, backwards", [moved(events, time=[350.0 - time for time in times])], *given),
    ]
    touches = [
        SimpleNamespace(time=float(one["time_s"]), player=one["player"], kind=one["label"].split()[0], part="foot")
        for one in csv.DictReader(TOUCHES.open(encoding="utf-8"))
    ]  # fmt: skip
    given = (touches, (Half(1, 0.0, 0.0, 2760.0),), 2700.0, 40.0)
    for lag, share in ((2.9, 0.9), (2.9, 0.5), (-8.0, 0.9), (40.0, 0.9)):
        name = f"made, lag {lag:g} s, {share:.0%} of the passes"
        lines.append(line(name, [made(touches, lag, 1, share)], *given, lag))
    usual = made(touches, 2.9, 1)
    lines.append(line("made, players changed", [strangers(usual, seed) for seed in range(2)], *given))
    for by in (900.0, 1300.0):  # the half goes on where it began
        other = moved(usual, time=[(event.time + by) % 2700.0 for event in usual.events])
        lines.append(line(f"made, of another part ({by:g} s)", [other], *given))
    print("\n".join([*head(COLUMNS), *lines]))


if __name__ == "__main__":
    main()
