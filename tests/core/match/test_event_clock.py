"""Events on the tracking's clock: planted lags, drifts, scatter, missing and strange events."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.files.event_data import MatchEvent, MatchEvents
from beyond_mocap.match.event_clock import align_events
from beyond_mocap.motion.track.match_data import Half

HALVES = (Half(1, 0.0, 0.0, 900.0), Half(2, 910.0, 910.0, 1810.0))
KINDS = {"kick": "pass", "receive": "receive", "header": "pass"}


def planted(seed=0, count=300, lag=(2.9, 2.9), drift=(0.0, 0.0), scatter=0.4, seen=0.6, stray=0.1):
    """Touches of 22 players in two halves, events of `seen` of them late by lag + drift x time + scatter, `stray` of
    them of nothing; and (event's index -> touch's index)."""
    rng = np.random.default_rng(seed)
    touches, rows = [], []
    for number, start, end in ((half.number, half.start, half.end) for half in HALVES):
        times = np.sort(rng.uniform(start + 2.0, end - 10.0, count))
        for time in times:
            kind = ("kick", "receive", "header")[int(rng.integers(3))]
            player = f"p{rng.integers(22)}"
            touches.append(SimpleNamespace(time=time, player=player, kind=kind, part="foot", confidence=0.9))
            since = time - start
            late = lag[number - 1] + drift[number - 1] * since + rng.normal(0.0, scatter)
            if rng.random() < seen:
                event = MatchEvent(time=since + late, period=number, player=player, team="home", kind=KINDS[kind])
                rows.append((event, len(touches) - 1))
            if rng.random() < stray * seen:
                rows.append((MatchEvent(time=rng.uniform(0, 900), period=number, player=f"p{rng.integers(22)}",
                                        team="home", kind="pass"), -1))
    rows.sort(key=lambda row: (row[0].period, row[0].time))
    events = MatchEvents(tuple(event for event, _ in rows), "made", "events.xml")
    return touches, events, np.array([touch for _, touch in rows])


def right(found, truth):
    """Share of the events with a touch that found theirs."""
    own = truth >= 0
    return float((found.touches[own] == truth[own]).mean())


def test_few_events_that_do_not_fit_are_left_out_and_told():
    """They may be of this match: so few fit by chance, or not."""
    touches, events, _ = planted(seed=3)
    sent = [event for event in events.events if event.period == 1 and event.kind == "pass"]
    inside = [event for event in sent if 100.0 < event.time < 128.0]
    rng = np.random.default_rng(4)
    moved = [MatchEvent(
        time=100.0 + 28.0 * share, period=1, player=event.player, team="home", kind="pass",
    ) for event, share in
             zip(inside * 2, rng.random(8))]  # fmt: skip
    others = [event for event in sent if not 90.0 < event.time < 140.0][:20]
    found = align_events(MatchEvents((*moved, *others), "made"), touches, HALVES, (100.0, 128.0))
    assert not found.clocks and np.isnan(found.times).all() and (found.touches < 0).all()
    assert len(found.notes) == 1 and "its events are ignored" in found.notes[0] and "fit (by chance" in found.notes[0]


@pytest.mark.parametrize("lag, drift", [
    ((2.9, 2.9), (0.0, 0.0)), ((-1.4, 6.2), (0.0, 0.0)), ((0.0, 0.0), (0.0, 0.0)), ((180.0, -40.0), (0.0, 0.0)),
    ((2.0, 2.0), (8e-4, -1e-3)),
])
def test_each_period_gets_its_own_clock(lag, drift):
    touches, events, truth = planted(lag=lag, drift=drift)
    found = align_events(events, touches, HALVES)
    for number, clock in found.clocks.items():
        for since in (100.0, 800.0):
            late = clock.lag + clock.drift * since
            assert late == pytest.approx(lag[number - 1] + drift[number - 1] * since, abs=0.25)
        assert 0.2 < clock.spread < 0.9 and clock.matched > 0.8 > 3.0 * clock.by_chance
    assert right(found, truth) > 0.85
    strays = found.touches[truth < 0]
    assert np.mean(strays >= 0) < 0.35  # whom no touch is near


def test_exact_events_find_every_touch():
    touches, events, truth = planted(scatter=0.0, stray=0.0)
    found = align_events(events, touches, HALVES)
    assert right(found, truth) == 1.0
    own = np.array([touches[i].time for i in found.touches])
    np.testing.assert_allclose(found.times, own, atol=0.05)
    assert any("2.90 s after" in note for note in found.notes)


def test_events_of_another_match_are_refused():
    touches, _, _ = planted(seed=1)
    _, others, _ = planted(seed=2)
    with pytest.raises(InputError, match=r"events.xml: .*by chance.*of the same match"):
        align_events(others, touches, HALVES)


def test_a_span_of_the_match_is_enough():
    touches, events, truth = planted()
    inside = [touch for touch in touches if 200.0 <= touch.time <= 320.0]
    found = align_events(events, inside, HALVES, (200.0, 320.0))
    assert found.clocks[1].lag == pytest.approx(2.9, abs=0.3)
    there = [i for i, touch in enumerate(truth) if touch >= 0 and 205.0 < touches[touch].time < 315.0]
    good = [found.touches[i] >= 0 and inside[found.touches[i]] is touches[truth[i]] for i in there]
    assert len(good) > 15 and np.mean(good) > 0.85
    assert (found.touches[found.times > 330.0] == -1).all()


@pytest.mark.parametrize("late, believed", [(2.9, 0.8), (-6.0, 0.7), (250.0, 0.0)])
def test_in_a_short_span_events_of_the_match_are_believed_where_their_lag_is_usual(late, believed):
    found = []
    for seed in range(3):
        touches, events, _ = planted(seed=seed, lag=(late, late), count=450)
        for start in np.arange(100.0, 800.0, 45.0):
            own = [touch for touch in touches if start <= touch.time <= start + 45.0]
            clocks = clocks_or_none(events, own, (start, start + 45.0))
            assert all(abs(clock.lag - late) < 1.0 for clock in clocks), start
            found.append(bool(clocks))
    assert np.mean(found) >= believed


def test_in_a_short_span_events_of_another_match_are_not_believed():
    found = []
    for seed in range(6):
        touches, _, _ = planted(seed=seed, count=450)
        _, others, _ = planted(seed=seed + 50, count=450)
        for start in np.arange(100.0, 800.0, 45.0):
            own = [touch for touch in touches if start <= touch.time <= start + 45.0]
            found.append(bool(clocks_or_none(others, own, (start, start + 45.0))))
    assert np.mean(found) < 0.03


def clocks_or_none(events, touches, span):
    try:
        return list(align_events(events, touches, HALVES[:1], span).clocks.values())
    except InputError:
        return []


def test_too_few_events_are_told_and_left():
    touches, events, _ = planted()
    few = MatchEvents(events.events[:4], "made")
    found = align_events(few, touches, HALVES)
    assert not found.clocks and "too few" in found.notes[0] and (found.touches == -1).all()
    assert "(" not in found.notes[0]
    short = align_events(events, [touch for touch in touches if 300.0 < touch.time < 305.0], HALVES, (300.0, 305.0))
    assert not short.clocks and (short.touches == -1).all()
    assert align_events(MatchEvents((), "made"), touches, HALVES).touches.size == 0


@pytest.mark.parametrize("change, why", [
    (lambda event: {"time": 1000.0 * event.time}, r" \(the latest is at \d+ s, the period ends at 900 s\); its "),
    (lambda event: {"kind": "other", "original_text": "zzz"}, r" \(types not taken for ball touches: zzz\); its "),
])
def test_why_there_are_too_few_events_is_told(change, why):
    touches, events, _ = planted()
    changed = tuple(replace(event, **change(event)) for event in events.events if event.period == 1)
    assert re.search(why, align_events(MatchEvents(changed, "made"), touches, HALVES).notes[0])


def test_events_of_nobody_and_of_periods_that_are_missing_keep_no_touch():
    touches, events, _ = planted()
    extra = (MatchEvent(
        time=5.0, period=1, player="", team="home", kind="pass",
    ), MatchEvent(time=5.0, period=3, player="p1", team="home", kind="pass"))
    found = align_events(MatchEvents((*events.events, *extra), "made"), touches, HALVES)
    assert found.touches[-2:].tolist() == [-1, -1] and np.isnan(found.times[-1])


def test_a_file_that_begins_within_the_second_half_is_no_trouble():
    touches, events, truth = planted()
    half = Half(2, -490.0, 10.0, 400.0)  # its first frame is 500 s into the half
    moved = [SimpleNamespace(**{**vars(touch), "time": touch.time - 910.0 - 490.0}) for touch in touches]
    inside = [touch for touch in moved if half.start <= touch.time <= half.end]
    found = align_events(events, inside, [half])
    assert found.clocks[2].lag == pytest.approx(2.9, abs=0.2) and list(found.clocks) == [2]
    pairs = [(event, touch) for event, touch in enumerate(truth) if touch >= 0 and moved[touch] in inside]
    assert len(pairs) > 50
    assert np.mean([found.touches[e] >= 0 and inside[found.touches[e]] is moved[t] for e, t in pairs]) > 0.85
    with pytest.raises(InputError, match="by chance"):  # events count from the half's begin, further off than MOST_LAG
        align_events(events, inside, [Half(2, 10.0, 10.0, 400.0)])
