"""The joints of several people over time, and what is repaired in all feeds: unit, up axis, and wild points."""

from __future__ import annotations

import math
from array import array
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ...base.errors import InputError, format_count, format_some
from .landmarks import LANDMARKS

_FAR = 1e9  # farther than any stadium in any unit: damaged numbers stay outliers, and their squares are finite
_MOST_POINTS = 60_000_000
_LEGS = tuple(tuple(f"{side}_{part}" for part in ("hip", "knee", "ankle")) for side in ("left", "right"))
_MOST_NAMES = 30  # that are listed in one line
_UNITS = {"metres": 1.0, "centimetres": 0.01, "millimetres": 0.001, "feet": 0.3048, "decimetres": 0.1}
_LEG = 0.87  # metres, thigh and shank of an adult
_LEG_RANGE = (0.55, 1.25)  # metres, of children of school age to the tallest, with noise
_MOST_METRES = 2000.0  # from the origin
_FARTHEST_POINT = 2.5  # metres from the middle of a body; an arm and a racquet reach less
_MIN_SEEN = 4  # landmarks of a frame that show a body
_RATES = (5.0, 400.0)
_SAMPLES = 2000  # frames of which unit and axes are estimated


@dataclass(frozen=True, eq=False, kw_only=True)
class PlayerJoints:
    """The joints of one person.

    Attributes:
        id: as the feed spells it.
        team: "home", "away" or "".
        landmarks: L of `landmarks.LANDMARKS`.
        times: (T,) seconds, ascending; a person who leaves has a gap.
        positions: (T, L, 3) metres, Z up, the origin at the pitch's centre; NaN where not seen.
    """

    id: str
    team: str
    landmarks: tuple[str, ...]
    times: np.ndarray
    positions: np.ndarray

    def cut_span(self, start: float, end: float) -> PlayerJoints:
        """Cut the joints to a time, s."""
        inside = (self.times >= start) & (self.times <= end)
        return replace(self, times=self.times[inside], positions=self.positions[inside])


@dataclass(frozen=True, eq=False)
class JointFeed:
    """All people of a file.

    Attributes:
        people: in the order of the file.
        fps: frames per second.
        notes: what was assumed or repaired, one line each.
        ball: (N, 4) seconds, ascending, and the ball's centre in m, as tracked; (0, 4) where none is read.
    """

    people: tuple[PlayerJoints, ...]
    fps: float
    notes: tuple[str, ...]
    ball: np.ndarray = field(default_factory=lambda: np.zeros((0, 4)))


class JointCollector:
    """Collects points of people in any order.

    Attributes:
        notes: lines about the file.
        unknown: names that are no landmark.
    """

    def __init__(self, path: Path):
        """Collect the points of a file, whose path errors name."""
        self.notes: list[str] = []
        self.unknown: set[str] = set()
        self._path = path
        self._points: dict[str, array] = {}
        self._teams: dict[str, str] = {}
        self._ball = array("d")

    def add_point(self, person: str, seconds: float, landmark: str, place) -> None:
        """Add where a landmark of a person is at a time; a place that is no three finite numbers is not seen."""
        points = self._points.setdefault(person, array("d"))
        if _is_place(place):
            points.extend((seconds, LANDMARKS.index(landmark), *place))
        if len(points) > 5 * _MOST_POINTS:
            raise InputError(self._path, f"more than {_MOST_POINTS:,} points", "a part of a match",
                             "divide the file, or move later ones out of its folder")

    def add_ball(self, seconds: float, place) -> None:
        """Add where the ball is at a time."""
        if _is_place(place):
            self._ball.extend((seconds, *place))

    def set_team(self, person: str, team: str) -> None:
        """Set a person's team: "home", "away" or ""."""
        self._teams[person] = team

    def build(self, fps: float | None = None) -> JointFeed:
        """Build the feed, in metres with Z up.

        Args:
            fps: frames per second; None: from the times.
        Returns:
            The feed.
        Raises:
            InputError: if no person is seen, or without legs, or in a unit that no body fits.
        """
        people = [self._build_person(person, points) for person, points in self._points.items()]
        self._check_people(people)
        people = [person for person in people if len(person.times) >= 2]
        rate = fps or _find_rate(np.concatenate([np.diff(person.times) for person in people]))
        if not _RATES[0] <= rate <= _RATES[1]:
            raise InputError(self._path, f"{rate:g} frames per second", f"{_RATES[0]:g} to {_RATES[1]:g}",
                             _explain_rate(rate))
        if self.unknown:
            self.notes.append(f"{format_count(len(self.unknown), 'point')} not used: {self._list_unknown()}")
        return normalize_feed(JointFeed(tuple(people), rate, tuple(self.notes), self._build_ball()), self._path)

    def _check_people(self, people: list[PlayerJoints]) -> None:
        """Check that some person is seen in two frames, and that there are legs, which unit and axes are found by."""
        seen = {name for person in people for name in person.landmarks}
        others = f", but {self._list_unknown()}" * bool(self.unknown)
        if not seen and self.unknown:
            raise InputError(self._path, f"no known joint{others}",
                             "names such as left_hip, left_knee, left_ankle and nose", "rename the joints")
        if not any(len(person.times) >= 2 for person in people):
            moments = {time for person in people for time in person.times.tolist()}
            frames = f"joints in {format_count(len(moments), 'frame')}, no person in two"
            raise InputError(self._path, frames if moments else "no person is seen", "people over time",
                             "export a longer part of the match")
        missing = sorted(([name for name in leg if name not in seen] for leg in _LEGS), key=len)
        if missing[0]:
            raise InputError(self._path, f"no {' and no '.join(missing[0])}{others}",
                             "hip, knee and ankle of a leg", "export these joints, or rename them")

    def _build_ball(self) -> np.ndarray:
        rows = np.frombuffer(self._ball).reshape(-1, 4) if self._ball else np.zeros((0, 4))
        _, first = np.unique(rows[:, 0], return_index=True)
        return np.clip(rows[first], -_FAR, _FAR)

    def _list_unknown(self) -> str:
        return format_some(sorted(self.unknown), _MOST_NAMES)

    def _build_person(self, person: str, points: array) -> PlayerJoints:
        rows = np.frombuffer(points).reshape(-1, 5) if points else np.zeros((0, 5))
        times, at = np.unique(rows[:, 0], return_inverse=True)
        used = np.unique(rows[:, 1]).astype(int)
        positions = np.full((len(times), len(used), 3), np.nan)
        positions[at.reshape(-1), np.searchsorted(used, rows[:, 1].astype(int))] = np.clip(rows[:, 2:], -_FAR, _FAR)
        return PlayerJoints(id=person, team=self._teams.get(person, ""),
                            landmarks=tuple(LANDMARKS[number] for number in used), times=times, positions=positions)


def _is_place(place) -> bool:
    """Say whether a place is three finite numbers."""
    return len(place) == 3 and all(isinstance(value, (int, float)) and math.isfinite(value) for value in place)


def _find_rate(steps: np.ndarray) -> float:
    """Find the frames per second of steps in seconds; a rate within 1 % of a whole number is that number: times are
    often rounded to milliseconds.
    """
    usual = float(np.median(steps))
    rate = 1.0 / float(np.mean(steps[steps < 1.5 * usual]))
    return float(round(rate)) if abs(rate - round(rate)) < 0.01 * rate else round(rate, 3)


def _explain_rate(rate: float) -> str:
    """Return what to do about times at a rate that no camera has."""
    if _RATES[0] <= 1000.0 * rate <= _RATES[1]:
        return "the times look like milliseconds: divide them by 1000"
    if rate == 1.0:
        return "the times look like frame numbers: divide them by the frames per second"
    return "check that times are seconds"


def normalize_feed(feed: JointFeed, path: Path) -> JointFeed:
    """Bring a feed to metres with Z up, and take out points that are far from their body.

    Args:
        feed: the feed in its own unit and axes.
        path: its file, for errors.
    Returns:
        The feed.
    Raises:
        InputError: if legs of no person are seen, or they fit no unit.
    """
    leg, up = _measure_bodies(feed, path)
    name, unit = min(_UNITS.items(), key=lambda one: abs(math.log(leg * one[1] / _LEG)))
    if not _LEG_RANGE[0] <= leg * unit <= _LEG_RANGE[1]:
        raise InputError(path, f"legs of {leg:.3g} units", "metres", "export metres")
    axis = int(np.argmax(np.abs(up)))
    notes = list(feed.notes)
    if unit != 1.0:
        notes.append(f"{name} taken as the unit: legs are {leg:.3g} of it long")
    if axis != 2 or up[2] < 0.0:
        notes.append(f"{'-' if up[axis] < 0.0 else ''}{'xyz'[axis]} taken as the axis that points up")
    turn = _turn_up(axis, up[axis] < 0.0)
    people = [replace(person, positions=person.positions @ turn.T * unit) for person in feed.people]
    cleaned = [_remove_wild_points(person) for person in people]
    wild = sum(int(np.isfinite(one.positions).sum() - np.isfinite(other.positions).sum()) // 3
               for one, other in zip(people, cleaned))
    if wild:
        notes.append(f"{format_count(wild, 'point')} farther than {_FARTHEST_POINT:g} m from their body left out")
    ball = np.column_stack([feed.ball[:, 0], feed.ball[:, 1:] @ turn.T * unit])
    return JointFeed(tuple(cleaned), feed.fps, tuple(notes), ball)


def _measure_bodies(feed: JointFeed, path: Path) -> tuple[float, np.ndarray]:
    """Measure the length of legs in the feed's unit, and the mean unit direction (3,) from ankles to hips."""
    lengths, ups = [], []
    for person in feed.people:
        step = max(1, len(person.times) // _SAMPLES)
        for leg in _LEGS:
            if all(name in person.landmarks for name in leg):
                hip, knee, ankle = (person.positions[::step, person.landmarks.index(name)] for name in leg)
                lengths.append(np.linalg.norm(hip - knee, axis=1) + np.linalg.norm(knee - ankle, axis=1))
                ups.append(hip - ankle)
    found = np.concatenate(lengths) if lengths else np.zeros(0)
    if not np.isfinite(found).any():
        raise InputError(path, "no person whose hip, knee and ankle of a leg are seen in one frame",
                         "joints of bodies", "export all joints")
    if not np.nanmedian(found) > 0.0:
        is_far = any((np.abs(person.positions) >= _FAR).any() for person in feed.people)
        where = f"numbers of {_FAR:g} and more" if is_far else "hip, knee and ankle at one place"
        raise InputError(path, where, "joints of bodies in metres", "export them again")
    directions = np.concatenate(ups)
    directions = directions[np.isfinite(directions).all(axis=1)]
    return float(np.nanmedian(found)), np.median(directions / np.linalg.norm(directions, axis=1)[:, None], axis=0)


def _turn_up(axis: int, is_down: bool) -> np.ndarray:
    """Return the rotation (3, 3) that brings an axis, or its opposite, to Z."""
    turn = {0: np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0]]), 1: np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]),
            2: np.eye(3)}[axis].astype(float)
    return np.diag([1.0, -1.0, -1.0]) @ turn if is_down else turn


def _remove_wild_points(person: PlayerJoints) -> PlayerJoints:
    """Take out points far from the middle of their body or of the field, and frames that show hardly a body."""
    positions = person.positions.copy()
    with np.errstate(invalid="ignore"):
        positions[~(np.abs(positions) <= _MOST_METRES).all(axis=2)] = np.nan
        seen = np.isfinite(positions).all(axis=2)
        shown = seen.sum(axis=1) >= _MIN_SEEN
        positions[~shown] = np.nan
        middle = np.full((len(positions), 3), np.nan)
        middle[shown] = np.nanmedian(positions[shown], axis=1)
        positions[np.linalg.norm(positions - middle[:, None], axis=2) > _FARTHEST_POINT] = np.nan
    return replace(person, positions=positions)
