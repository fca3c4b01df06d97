"""Bring skeletal tracking to the clock and pitch of a match's dots, and tell who is whom, by where people are.

Feeds count from kick-off, from the first frame of a file, or from midnight. The own clock holds where it fits about
as well as any other; otherwise one that fits clearly better than all others is taken, and reported. The mean square
distance of two paths at all offsets in time is a correlation, which fast Fourier transforms compute at once.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ..base.errors import InputError, format_seconds
from ..files.joints.joint_feed import JointFeed, PlayerJoints
from ..motion.track.match_data import Match

MOST_APART = 2.0
"""Metres between a player's dot and a body that may be theirs, on average."""

_RATE = 5.0  # Hz at which paths are compared
_CAP = 10.0  # m; a person farther from all dots counts as this far
_FEWEST, _ENOUGH = 10, 50  # samples that two paths share, at least; below the second, half of a person's do
_SAME, _SAME_SHARE = 0.15, 1.5  # m, and times the best cost, up to which another clock fits about as well
_NEAR = 1.0  # s: offsets so near the best are the same one
_WELL = 0.5  # m; joints that are nearer have the right frame rate
_USUAL_RATES = (25.0, 50.0, 30.0, 60.0)  # frames per second
_OTHER_RATE = 0.5  # share of the distance that another frame rate has to leave
_PAUSE = 30.0  # s without people, such as half-time: the clock may differ after it
_STEP, _REACH = 0.02, 0.3  # s between offsets, and on either side of the coarse one, when it is refined
_BETTER = 0.8  # share of the distance that a refined clock leaves; otherwise the expected one stays
_STEADY = 0.2  # share by which a steady distance counts there: trackers measure another point of the body
_SAME_ID = 0.5  # m by which a dot of the same id counts as nearer


def align_joints(feed: JointFeed, match: Match, path: Path | str = "joints") -> JointFeed:
    """Bring the joints to a match's clock and pitch.

    Args:
        feed: the joints on their own clock, s.
        match: the match.
        path: of the joints, for errors.
    Returns:
        The joints on the match's clock; its notes name what was changed.
    Raises:
        InputError: if they fit at no time, at several, or at another frame rate.
    """
    aligned: dict[int, list[PlayerJoints]] = {number: [] for number in range(len(feed.people))}
    notes: list[str] = []
    expected, problem = 0.0, None
    for start, end in _find_blocks(feed):
        try:
            part = _cut_people(feed, start, end)
            expected, is_turned = _find_clock(list(part.values()), match, expected, feed.fps, path)
        except InputError as error:
            problem = error
            notes.append(f"joints from {format_seconds(start)} to {format_seconds(end)} s left out: {error}")
            continue
        notes += _describe_clock(expected, is_turned)
        for number, person in part.items():
            aligned[number].append(_move_person(person, expected, is_turned))
    if problem is not None and not any(aligned.values()):
        raise problem
    people = [_join_person(parts) for parts in aligned.values() if parts]
    return replace(feed, people=tuple(people), notes=(*feed.notes, *dict.fromkeys(notes)))


def name_people(feed: JointFeed, match: Match) -> dict[str, str]:
    """Name the player whom each person of the joints is: the nearest on average; two people at a time are never one.

    Args:
        feed: the joints, on the match's clock.
        match: the match.
    Returns:
        The player's id by the person's, without people who are no player.
    """
    grid = _build_grid(match.times[0], match.times[-1])
    dots = [sample_path(match.times, path, grid) for path in match.positions]
    paths = [_sample_person(person, grid) for person in feed.people]
    found: dict[int, str] = {}
    for apart, number, place in sorted(_iter_pairs(feed, match, paths, dots)):
        player = match.players[place].id
        seen = np.isfinite(paths[number][:, 0])
        others = [other for other, name in found.items() if name == player]
        if apart <= MOST_APART and number not in found and not any(
                (seen & np.isfinite(paths[other][:, 0])).any() for other in others):
            found[number] = player
    return {feed.people[number].id: player for number, player in found.items()}


def _iter_pairs(feed: JointFeed, match: Match, paths, dots):
    """Iterate over (median distance in m, person, player) of all pairs that are there at one time."""
    for number, (person, path) in enumerate(zip(feed.people, paths)):
        for place, (player, dot) in enumerate(zip(match.players, dots)):
            apart = np.linalg.norm(path - dot, axis=1)
            apart = apart[np.isfinite(apart)]
            if len(apart):
                yield float(np.median(apart)) - _SAME_ID * (person.id == player.id), number, place


def find_pelvis(person: PlayerJoints) -> np.ndarray:
    """Find the middle (T, 3) m between the hips, NaN where one is not seen for longer than moments."""
    hips = [_bridge_moments(person.times, person.positions[:, person.landmarks.index(name)])
            for name in ("left_hip", "right_hip") if name in person.landmarks]
    return np.mean(hips, axis=0) if hips else np.full((len(person.times), 3), np.nan)


def _bridge_moments(times: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Let a point (T, 3) m that is not seen for a moment be between the places before and after it."""
    seen = np.isfinite(path[:, 0])
    if seen.all() or seen.sum() < 2:
        return path
    return np.where(seen[:, None], path, sample_path(times[seen], path[seen], times))


def _find_blocks(feed: JointFeed) -> list[tuple[float, float]]:
    """Find the (start, end) s between pauses in which no person is seen."""
    times = np.unique(np.concatenate([person.times for person in feed.people]))
    edges = np.flatnonzero(np.diff(times) > _PAUSE)
    return [(float(part[0]), float(part[-1])) for part in np.split(times, edges + 1)]


def _cut_people(feed: JointFeed, start: float, end: float) -> dict[int, PlayerJoints]:
    """Cut people to a time, s, by their place in the feed."""
    parts = {number: person.cut_span(start, end) for number, person in enumerate(feed.people)}
    return {number: part for number, part in parts.items() if len(part.times)}


def _move_person(person: PlayerJoints, offset: float, is_turned: bool) -> PlayerJoints:
    """Move a person in time, s, and turn them by half a turn about the pitch's centre."""
    sides = np.array([-1.0, -1.0, 1.0]) if is_turned else np.ones(3)
    return replace(person, times=person.times + offset, positions=person.positions * sides)


def _join_person(parts: list[PlayerJoints]) -> PlayerJoints:
    """Join the parts of a person."""
    times = np.concatenate([part.times for part in parts])
    order = np.argsort(times, kind="stable")
    return replace(parts[0], times=times[order], positions=np.concatenate([part.positions for part in parts])[order])


def _describe_clock(offset: float, is_turned: bool) -> list[str]:
    """Describe how joints differ from the match."""
    moved = f"the joints' clock is {abs(offset):.2f} s {'behind' if offset > 0.0 else 'ahead of'} the tracking's"
    lines = [f"{moved}, by where people are: moved"] if offset else []
    return lines + ["the joints' pitch is turned by half a turn against the tracking's: turned"] * is_turned


def _build_grid(start: float, end: float) -> np.ndarray:
    """Build the times, s, of both ends and between at which paths are compared."""
    return start + np.arange(int(np.floor((end - start) * _RATE + 1e-6)) + 1) / _RATE


def sample_path(times: np.ndarray, path: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Sample a path (N, D) m at times (T,) s: linear between two samples, NaN beside any that is unknown or far."""
    after = np.clip(np.searchsorted(times, at), 1, len(times) - 1)
    step = times[after] - times[after - 1]
    share = (at - times[after - 1]) / step
    out = path[after - 1] + share[:, None] * (path[after] - path[after - 1])
    out[(share < -1e-6) | (share > 1.0 + 1e-6) | (step > 2.0 / _RATE)] = np.nan
    return out


def _sample_person(person: PlayerJoints, at: np.ndarray) -> np.ndarray:
    """Sample a person's place (T, 2) m at times (T,) s."""
    return (sample_path(person.times, find_pelvis(person)[:, :2], at) if len(person.times) > 1
            else np.full((len(at), 2), np.nan))


def _find_clock(people: list[PlayerJoints], match: Match, expected: float, rate: float,
                where: Path | str) -> tuple[float, bool]:
    """Find what has to be added to the people's clock, s, and whether they are turned by half a turn.

    Args:
        people: who is seen.
        match: the match.
        expected: s, the offset that holds where it fits.
        rate: frames per second of the joints.
        where: for errors.
    """
    offsets, costs = _measure_clocks(people, match, expected)
    best = float(costs.min())
    if best > _WELL:
        _check_rate(people, match, rate, best, where)
    if best > MOST_APART:
        raise InputError(where, f"the nearest body is {_describe_distance(best)} from any player",
                         f"{MOST_APART:g} m or less, for {_FEWEST / _RATE:g} s or longer",
                         "give joints of this match, with the pitch's centre as the origin")
    fits = costs <= max(best + _SAME, best * _SAME_SHARE)
    if fits[0, np.abs(offsets - expected) < 1e-6].any():
        return _refine_clock(people, match, expected, 1.0, is_expected=True), False
    turned, place = np.unravel_index(int(costs.argmin()), costs.shape)
    if fits[1 - turned].any() or (np.abs(offsets[fits[turned]] - offsets[place]) > _NEAR).any():
        raise InputError(where, "the joints fit the tracking at several times, and not as they are",
                         "joints on the tracking's clock", "give joints of more players or of a longer time")
    return _refine_clock(people, match, float(offsets[place]), -1.0 if turned else 1.0), bool(turned)


def _describe_distance(apart: float) -> str:
    """Describe a mean distance, m, which counts up to _CAP."""
    return f"{apart:.1f} m" if apart < _CAP else f"{_CAP:g} m or more"


def _measure_clocks(people: list[PlayerJoints], match: Match, expected: float) -> tuple[np.ndarray, np.ndarray]:
    """Measure how far people are from the match at all offsets, one of which is `expected`.

    Returns:
        Offsets (N,) s, and the mean distance (2, N) m at each, as people are and turned by half a turn.
    """
    begin, end = min(one.times[0] for one in people), max(one.times[-1] for one in people)
    grid = _build_grid(match.times[0], match.times[-1])
    # begin where the expected offset is one of those that are measured
    begin = grid[0] - expected + np.floor((begin + expected - grid[0]) * _RATE + 1e-6) / _RATE
    paths = np.stack([_sample_person(one, _build_grid(begin, end)) for one in people])
    dots = np.stack([sample_path(match.times, path, grid) for path in match.positions])
    costs = np.stack([_measure_all_offsets(sign * paths, dots) for sign in (1.0, -1.0)])
    return grid[0] - begin + (np.arange(costs.shape[1]) - paths.shape[1] + 1) / _RATE, costs


def _check_rate(people: list[PlayerJoints], match: Match, rate: float, best: float, where: Path | str) -> None:
    """Refuse joints that are `best` m from the match, and clearly nearer at another usual frame rate than theirs."""
    begin = min(one.times[0] for one in people)
    for other in _USUAL_RATES:
        if abs(rate - other) > 0.01 * other:
            timed = [replace(one, times=begin + (one.times - begin) * rate / other) for one in people]
            if _measure_clocks(timed, match, 0.0)[1].min() < _OTHER_RATE * best:
                raise InputError(where, f"{rate:g} frames per second, at which they are {_describe_distance(best)} "
                                 "from the players",
                                 f"{other:g}, at which they fit", "correct the frame rate or the times")


def _measure_all_offsets(paths: np.ndarray, dots: np.ndarray) -> np.ndarray:
    """Measure how far, m, people (K, T, 2) are from their nearest players (M, N, 2), by offset (N + T - 1,), the first
    of which lays the last frame of the people on the first of the dots: mean of the nearer half of the people.
    """
    own, others = np.isfinite(paths[..., 0]), np.isfinite(dots[..., 0])
    size = 1 << int(np.ceil(np.log2(paths.shape[1] + dots.shape[1])))
    known = np.where(others[..., None], dots, 0.0)
    spectra = [np.fft.rfft(values, size) for values in (others.astype(float), (known**2).sum(axis=2), known[..., 0],
                                                        known[..., 1])]
    nearest = [_measure_person(path, seen, spectra, size) for path, seen in zip(paths, own)]
    count = paths.shape[1] + dots.shape[1] - 1
    at = (np.arange(count) - paths.shape[1] + 1) % size
    return np.sort(np.stack(nearest)[:, at], axis=0)[: (len(paths) + 1) // 2].mean(axis=0)


def _measure_person(path: np.ndarray, seen: np.ndarray, spectra: list[np.ndarray], size: int) -> np.ndarray:
    """Measure how far, m, a person (T, 2) is from the nearest player, by offset, cyclic (`_measure_all_offsets`)."""
    known = np.where(seen[:, None], path, 0.0)
    there, square, x, y = (np.conj(np.fft.rfft(values, size)) for values in (seen.astype(float), (known**2).sum(axis=1),
                                                                            known[:, 0], known[:, 1]))
    shared = np.fft.irfft(spectra[0] * there, size)
    total = np.fft.irfft(spectra[1] * there + spectra[0] * square - 2.0 * (spectra[2] * x + spectra[3] * y), size)
    needed = max(_FEWEST, min(_ENOUGH, 0.5 * seen.sum()))
    apart = np.sqrt(np.maximum(total, 0.0) / np.maximum(shared, 1.0))
    return np.where(shared >= needed - 0.5, np.minimum(apart, _CAP), _CAP).min(axis=0)


def _refine_clock(people: list[PlayerJoints], match: Match, offset: float, side: float,
                  is_expected: bool = False) -> float:
    """Refine an offset, s, to the smallest distance; the expected one stays unless another is clearly better."""
    near = offset + np.arange(-round(_REACH / _STEP), round(_REACH / _STEP) + 1) * _STEP
    pairs = [(person, side * find_pelvis(person)[:, :2]) for person in people if len(person.times) > 1]
    apart = np.array([[_measure_nearest(person.times + one, path, match) for person, path in pairs] for one in near])
    costs = np.sort(np.where(np.isfinite(apart), apart, _CAP), axis=1)[:, : (len(pairs) + 1) // 2].mean(axis=1)
    best = int(costs.argmin())
    if is_expected and costs[best] > _BETTER * costs[len(near) // 2]:
        return offset
    return round(float(near[best]), 2)


def _measure_nearest(times: np.ndarray, path: np.ndarray, match: Match) -> float:
    """Measure how far, m, a path (T, 2) is from the nearest player, a steady distance between the two counting little;
    NaN where none is there.
    """
    at = slice(None, None, max(1, len(times) // 500))
    apart = [sample_path(match.times, dots, times[at]) - path[at] for dots in match.positions]
    known = [one[np.isfinite(one[:, 0])] for one in apart]
    return min((_measure_spread(one) for one in known if len(one)), default=np.nan)


def _measure_spread(apart: np.ndarray) -> float:
    """Measure the usual length, m, of differences (T, 2) m, their steady part by the share _STEADY."""
    steady = np.median(apart, axis=0)
    return float(np.median(np.linalg.norm(apart - steady, axis=1)) + _STEADY * np.linalg.norm(steady))
