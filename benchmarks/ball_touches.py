"""Touches solved from tracking, compared with what a person annotated, with events, and with synthetic matches.

A found touch is right if an annotated one of the same player is within a tolerance in time; each is matched once. What
the annotator was unsure of has no effect. Event files have a clock of their own: one offset for the whole file is
removed first, the one that gives the most matches.
"""

from __future__ import annotations

import csv
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks import effort
from benchmarks.effort import format_head, format_row
from benchmarks.places import DATA, ROOT
from beyond_mocap.ball.tracked.solve import SolvedBall, solve_ball
from beyond_mocap.base.errors import InputError
from beyond_mocap.files.tracking.tracking import Match, MatchPlayer, read_match
from beyond_mocap.synthetic.ground_truth.synthetic_match import Feed, build_match, sample_feed

MATCHES = {"nl2019": "nl2019_half1.dat", "dutch": "dutch_6min.dat"}
BY_HAND = ROOT / "benchmarks" / "touches_by_hand.csv"
# Annotated after the solver was finished; it was never tuned on these.
LATER = ROOT / "benchmarks" / "touches_by_hand_later.csv"
EVENTS = DATA / "tracking" / "match" / "dutch_6min_events.csv"
MARGIN = 20.0  # s that are solved before and after what was annotated
PLAYED = ("pass", "miss", "clearance")  # events that are certainly a touch
_NO_TOUCH = ("out", "foul", "card", "offside")
EVENT_SPREAD = 1.8  # s: three standard deviations of the time error of events that are not tied to a touch

TOLERANCE = 0.1
"""Seconds; a sample of a 10 Hz feed may be this far from the true kick."""
_COLUMNS = ("match", "row", "time_s", "until_s", "player", "part", "word", "note")


def read_recorded_match(name: str) -> Match:
    """Read one of the recorded matches."""
    return read_match(DATA / "tracking" / "match" / MATCHES[name])


@dataclass(frozen=True)
class FeedResult:
    """One match or feed with its score.

    Attributes:
        name: name in the table.
        score: the comparison.
        solved: the solved ball.
        reading: the annotation.
    """

    name: str
    score: Score
    solved: SolvedBall
    reading: TouchAnnotation


def thin_match(match: Match, every: int = 1, heights: bool = True) -> Match:
    """Keep every so many samples of a match, with or without heights."""
    part = slice(None, None, every)
    ball = match.ball[part].copy()
    if not heights:
        ball[:, 2] = np.nan
    return Match(times=match.times[part], players=match.players, positions=match.positions[:, part], ball=ball,
                 length=match.length, width=match.width, fps=match.fps / every, provider=match.provider,
                 periods=match.periods, notes=match.notes)  # fmt: skip


def convert_feed(feed: Feed) -> Match:
    """Convert a synthetic feed to a match as it would be read."""
    players = tuple(MatchPlayer(name, team, name, i) for i, (name, team) in enumerate(zip(feed.ids, feed.teams)))
    end = float(feed.times[-1])
    return Match(times=feed.times, players=players, positions=feed.positions, ball=feed.ball, length=feed.length,
                 width=feed.width, fps=feed.fps, provider="made", periods=((0.0, end),))


def compare_annotation(name: str, match: Match, path: Path = BY_HAND, solved: SolvedBall | None = None) -> FeedResult:
    """Compare one recorded match with an annotation.

    Args:
        name: name in the table; its first word names the match in the file.
        match: the match.
        path: the annotation.
        solved: the solved ball; None: solve the annotated stretches and MARGIN around them.
    """
    reading = read_touches(path, name.replace(",", " ").split()[0])
    start, end = reading.stretches[0][0] - MARGIN, reading.stretches[-1][1] + MARGIN
    solved = solved or solve_ball(match, start=start, end=end)
    return FeedResult(name, _compute_score(solved, reading), solved, reading)


def _compute_score(solved: SolvedBall, reading: TouchAnnotation) -> Score:
    return score_touches([touch.time for touch in solved.touches], [touch.player for touch in solved.touches], reading)


def compare_synthetic(name: str, seconds: float = 180.0, seed: int = 11, **feed) -> FeedResult:
    """Compare a synthetic match, sampled like a feed, with its ground truth."""
    match = build_match(seconds, seed)
    touches = tuple(
        AnnotatedTouch(t.time, (t.player,), None, t.part, t.label) for t in match.touches if 1.2 < t.time < seconds - 1
    )
    solved = solve_ball(convert_feed(sample_feed(match, **feed)))
    reading = TouchAnnotation(((1.2, seconds - 1.0),), touches, (AnnotatedTouch(1.0),))
    return FeedResult(name, _compute_score(solved, reading), solved, reading)


def convert_events(path: Path = EVENTS) -> TouchAnnotation:
    """Convert events to an annotation.

    It holds what was certainly played; the others count neither way within the time by which an event may be off, nor
    do the times in which the ball is out of play.
    """
    with open(path, newline="", encoding="utf-8") as file:
        rows = sorted(csv.DictReader(file), key=lambda event: float(event["time_s"]))
    touches, doubts = [], []
    for number, event in enumerate(rows):
        time, player = float(event["time_s"]), (event["player"],) if event["player"] else ()
        if event["type"] in _NO_TOUCH:
            again = [float(other["time_s"]) for other in rows[number:] if other["type"] in PLAYED]
            doubts.append(AnnotatedTouch(time - EVENT_SPREAD, (), again[0] - 0.5 if again else np.inf))
        elif event["sync"] == "touch" and event["type"] in PLAYED and player:
            touches.append(AnnotatedTouch(time, player))
        else:
            doubts.append(AnnotatedTouch(time - EVENT_SPREAD, player, time + EVENT_SPREAD))
    return TouchAnnotation(((0.0, max(touch.time for touch in touches) + 0.5),), tuple(touches), tuple(doubts))


def compare_events(match: Match) -> FeedResult:
    """Compare all touches with the passes among the events.

    Events name the player who plays the ball away, so that earlier touches of the same player count neither way.
    """
    solved, reading = solve_ball(match), convert_events()
    earlier_touches = [AnnotatedTouch(a.time, (a.player,)) for a, b in zip(solved.touches, solved.touches[1:])
                       if a.player == b.player]
    reading = replace(reading, doubts=(*reading.doubts, *earlier_touches))
    times, players = [touch.time for touch in solved.touches], [touch.player for touch in solved.touches]
    return FeedResult("dutch, passes among its events", score_with_offset(times, players, reading), solved, reading)


def measure_residuals(solved: SolvedBall) -> tuple[float, float, float]:
    """Measure the trajectory's distance over the ground from measured samples.

    Returns:
        Median and 95th percentile, m, and the share of measured samples.
    """
    away = solved.residuals[solved.measured]
    away = away[np.isfinite(away)]
    return float(np.median(away)), float(np.percentile(away, 95)), float(solved.measured.mean())


def count_right_parts(measured: FeedResult) -> str:
    """Count how many of the right touches with an annotated part have that part."""
    pairs = [(measured.reading.touches[read].part, measured.solved.touches[i].part) for read, i in measured.score.right]
    known = [(read, found) for read, found in pairs if read]
    return f"{sum(read == found for read, found in known)} of {len(known)}"


def build_row(measured: FeedResult) -> list[str]:
    """Build a row of the table."""
    score = measured.score
    late = np.abs(score.errors)
    median, p95, share = measure_residuals(measured.solved)
    return [measured.name, str(len(measured.reading.touches)), f"{score.precision:.3f}", f"{score.recall:.3f}",
            f"{score.f1:.3f}", str(len(score.doubtful)),
            f"{1000 * np.median(late):.0f} / {1000 * np.percentile(late, 95):.0f}" if len(late) else "-",
            count_right_parts(measured), f"{score.offset:.2f}", f"{100 * median:.1f} / {100 * p95:.0f}",
            f"{100 * share:.0f} %"]


COLUMNS = ("feed", "touches", "precision", "recall", "F1 at 0.1 s, right player", "doubtful",
           "time error, ms (median / p95)", "part right", "offset s", "path to measured samples, cm (median / p95)",
           "measured")


def compare_all(dutch: Match, half: Match, solved: SolvedBall) -> list[FeedResult]:
    """Compare every feed. solved: the whole half."""
    return [compare_annotation("dutch", dutch), compare_annotation("nl2019", half, solved=solved),
            compare_annotation("dutch, read later", dutch, LATER), compare_annotation("nl2019, read later", half, LATER,
            solved), compare_annotation("dutch, no heights", thin_match(dutch, 1, False)),
            compare_annotation("nl2019, no heights", thin_match(half, 1, False)),
            compare_annotation("dutch, 12.5 Hz", thin_match(dutch, 2)),
            compare_annotation("nl2019, 12.5 Hz", thin_match(half, 2)), compare_annotation("dutch, 8.3 Hz, no heights",
            thin_match(dutch, 3, False)), compare_events(dutch), compare_synthetic("synthetic, 25 Hz, 8 cm"),
            compare_synthetic("synthetic, 25 Hz, 8 cm, half filled", filled=0.5),
            compare_synthetic("synthetic, 25 Hz, 8 cm, no heights", heights=False),
            compare_synthetic("synthetic, 10 Hz, 8 cm", fps=10.0),
            compare_synthetic("synthetic, 10 Hz, 8 cm, no heights", fps=10.0, heights=False)]


def section() -> list[str]:
    """Build the lines for results.md."""
    dutch, half = read_recorded_match("dutch"), read_recorded_match("nl2019")
    took, solved = effort.measure_seconds(lambda: solve_ball(half), 1)
    lines = [f"- the whole half (46 min) is solved in {took:.1f} s (target 60)", ""]
    return [*lines, *format_head(COLUMNS), *(format_row(build_row(one)) for one in compare_all(dutch, half, solved))]


@dataclass(frozen=True)
class AnnotatedTouch:
    """An annotated touch.

    Attributes:
        time: s.
        players: players who may have touched the ball; any player where empty.
        until: s: one or several moments up to then; it is a doubt, not a touch.
        part: part of the body, where it was annotated.
        word: label, where it was annotated.
    """

    time: float
    players: tuple[str, ...] = ()
    until: float | None = None
    part: str = ""
    word: str = ""


@dataclass(frozen=True)
class TouchAnnotation:
    """The annotation of a match.

    Attributes:
        stretches: (start, end) s of what was annotated.
        touches: the touches in them.
        doubts: spans in which touches of these players count neither way.
    """

    stretches: tuple[tuple[float, float], ...]
    touches: tuple[AnnotatedTouch, ...]
    doubts: tuple[AnnotatedTouch, ...] = ()

    @property
    def seconds(self) -> float:
        """Seconds of all stretches."""
        return sum(end - start for start, end in self.stretches)


@dataclass(frozen=True)
class Score:
    """Comparison of found touches with annotated ones.

    Attributes:
        right: pairs (index of the annotated touch, of the found one).
        missed: annotated ones that were not found.
        false: found ones that are no touch.
        doubtful: found ones that cannot be judged.
        errors: (len(right),) s, found minus annotated.
        offset: s taken from the found times before.
    """

    right: tuple[tuple[int, int], ...]
    missed: tuple[int, ...]
    false: tuple[int, ...]
    doubtful: tuple[int, ...]
    errors: np.ndarray
    offset: float = 0.0

    @property
    def precision(self) -> float:
        """Share of the found touches that are right."""
        return len(self.right) / max(len(self.right) + len(self.false), 1)

    @property
    def recall(self) -> float:
        """Share of the annotated touches that were found."""
        return len(self.right) / max(len(self.right) + len(self.missed), 1)

    @property
    def f1(self) -> float:
        """Their harmonic mean."""
        both = self.precision + self.recall
        return 2.0 * self.precision * self.recall / both if both else 0.0


def score_touches(times: Sequence[float], players: Sequence[str], reading: TouchAnnotation,
                  tolerance: float = TOLERANCE, offset: float = 0.0) -> Score:
    """Compare found touches with an annotation; those outside its stretches are left out.

    Args:
        times: s of the found touches.
        players: player of each.
        reading: the annotation.
        tolerance: s.
        offset: s taken from the found times first.
    """
    times = np.asarray(times, float) - offset
    inside = [i for i in np.argsort(times, kind="stable") if _is_within(times[i], reading.stretches)]
    right = _match_touches(times, players, inside, reading.touches, tolerance)
    found = {i for _, i in right}
    rest = [i for i in inside if i not in found]
    doubtful = [i for i in rest if any(_covers(doubt, times[i], players[i], tolerance) for doubt in reading.doubts)]
    read = {i for i, _ in right}
    return Score(tuple(right), tuple(i for i in range(len(reading.touches)) if i not in read),
                 tuple(int(i) for i in rest if i not in doubtful), tuple(int(i) for i in doubtful),
                 np.array([times[found] - reading.touches[read].time for read, found in right]), offset)


def score_with_offset(times: Sequence[float], players: Sequence[str], reading: TouchAnnotation,
                      tolerance: float = TOLERANCE, max_offset: float = 4.0) -> Score:
    """Compare with the one offset, up to `max_offset` seconds either way, that gives the highest F1."""
    coarse = np.arange(-max_offset, max_offset + 1e-9, tolerance / 2.0)
    best = max(coarse, key=lambda offset: _count_matches(times, players, reading, tolerance, offset))
    fine = best + np.arange(-tolerance / 2.0, tolerance / 2.0 + 1e-9, 0.01)
    scores = [score_touches(times, players, reading, tolerance, float(offset)) for offset in fine]
    most_right = max(score.f1 for score in scores)
    best = [score for score in scores if score.f1 == most_right]
    return best[len(best) // 2]


def read_touches(path: str | os.PathLike, match: str) -> TouchAnnotation:
    """Read the annotation of one match.

    Args:
        path: CSV of match,row,time_s,until_s,player,part,word,note. row: "stretch", "touch" or "unsure" (a doubt).
            player: one id, or several with | between where it was one of them.
        match: name in the first column.
    Raises:
        InputError: for other columns or rows, and for a match that is not in it.
    """
    with open(path, newline="", encoding="utf-8") as file:
        rows = csv.DictReader(file)
        if tuple(rows.fieldnames or ()) != _COLUMNS:
            raise InputError(path, f"columns {rows.fieldnames}", ",".join(_COLUMNS))
        kinds: dict[str, list[AnnotatedTouch]] = {"stretch": [], "touch": [], "unsure": []}
        for row in rows:
            if row["match"] != match:
                continue
            if row["row"] not in kinds:
                raise InputError(path, f"row {row['row']!r} at {row['time_s']}", f"one of {', '.join(kinds)}")
            kinds[row["row"]].append(_build_touch(row))
    if not kinds["stretch"]:
        raise InputError(path, f"no stretch of {match!r}", "a match with a stretch")
    stretches = tuple((row.time, row.until) for row in kinds["stretch"])
    return TouchAnnotation(stretches, tuple(kinds["touch"]), tuple(kinds["unsure"]))


def _build_touch(row: dict[str, str]) -> AnnotatedTouch:
    """Convert a row to a touch."""
    players = tuple(name for name in row["player"].split("|") if name)
    until = float(row["until_s"]) if row["until_s"] else None
    return AnnotatedTouch(float(row["time_s"]), players, until, row["part"], row["word"])


def _is_within(time: float, stretches) -> bool:
    """Return whether a time lies in a stretch."""
    return any(start <= time <= end for start, end in stretches)


def _covers(doubt: AnnotatedTouch, time: float, player: str, tolerance: float) -> bool:
    """Return whether a doubt covers a touch."""
    end = doubt.time if doubt.until is None else doubt.until
    return doubt.time - tolerance <= time <= end + tolerance and (not doubt.players or player in doubt.players)


def _match_touches(times, players, inside, touches, tolerance: float) -> list[tuple[int, int]]:
    """Find the largest possible set of pairs (annotated, found); among those sets the nearest in time."""
    from scipy.optimize import linear_sum_assignment

    if not inside or not touches:
        return []
    away = np.abs(times[inside] - np.array([[touch.time] for touch in touches]))
    fits = away <= tolerance + 1e-9
    for row, column in np.argwhere(fits):
        fits[row, column] = not touches[row].players or players[inside[column]] in touches[row].players
    # each allowed pair gains 1000, so the assignment first maximizes their number, then minimizes the times
    rows, columns = linear_sum_assignment(np.where(fits, away - 1e3, 0.0))
    return [(int(row), int(inside[column])) for row, column in zip(rows, columns) if fits[row, column]]


def _count_matches(times, players, reading: TouchAnnotation, tolerance: float, offset: float) -> float:
    """Count the right ones at an offset, without matching each once: a fast upper bound."""
    times = np.asarray(times, float) - offset
    near = [np.flatnonzero(np.abs(times - touch.time) <= tolerance) for touch in reading.touches]
    return sum(
        any(not touch.players or players[i] in touch.players for i in found)
        for touch, found in zip(reading.touches, near)
    )
