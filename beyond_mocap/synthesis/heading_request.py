"""What is asked of the planned heading of a player: headings that are given, and what a player of a match faces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..annotation import Span
from ..base.errors import InputError
from ..base.vectors import arctan2
from ..motion.skeleton import freeze_array


@dataclass(frozen=True)
class HeadingKey:
    """A heading that is given for some time, at most until the next one.

    Attributes:
        time: s on the track's clock from which on it holds.
        heading: rad from +x, world; None: towards `target`.
        target: (x, y) m, world, that the body faces; None: `heading` holds.
        hold: s for which it holds.
    Raises:
        InputError: for neither or both, and for values that are not finite.
    """

    time: float
    heading: float | None = None
    target: tuple[float, float] | None = None
    hold: float = 0.0

    def __post_init__(self):
        values = [self.time, self.hold, *(() if self.heading is None else (self.heading,)), *(self.target or ())]
        if (self.heading is None) == (self.target is None):
            raise InputError("heading key", f"{self.time:g} s: heading {self.heading}, target {self.target}",
                             "a heading or a target", "give one of the two")
        if not np.isfinite(values).all():
            raise InputError("heading key", "a value that is not finite", "finite numbers", "correct the key")
        if self.hold < 0.0:
            raise InputError("heading key", f"a hold of {self.hold:g} s", "0 s or more", "correct the key")

    @property
    def end(self) -> float:
        """Seconds until which it holds."""
        return self.time + self.hold

    def is_within(self, start: float, end: float) -> bool:
        """Whether it holds at any time from `start` to `end` s."""
        return self.time <= end and self.end >= start


@dataclass(frozen=True, eq=False)
class Play:
    """What a player of a match faces beside the ball.

    Attributes:
        times: (M,) s on the track's clock, ascending.
        places: (M, 2) m that the body faces while the ball is not known, NaN where there is nothing to face.
        is_keeper: whether this is a goalkeeper, who faces the ball also when moving.
        keys: headings that the feed has measured, in order of time.
    """

    times: np.ndarray
    places: np.ndarray
    is_keeper: bool = False
    keys: tuple[HeadingKey, ...] = ()

    def __post_init__(self):
        object.__setattr__(self, "times", freeze_array(self.times))
        object.__setattr__(self, "places", freeze_array(self.places))


@dataclass(frozen=True, kw_only=True)
class HeadingRequest:
    """What is asked of the heading of a player.

    Attributes:
        keys: headings that are given; each ends where the next one begins.
        gazes: pins of the gaze: objects with `time`, `hold` and `end` s and `position` m (`plan.Pin`).
        spans: labels that the user asks for; a gait with a direction and turning with a side count.
        play: what a player of a match faces beside the ball, None where that is not known.
    """

    keys: tuple[HeadingKey, ...] = ()
    gazes: tuple[Any, ...] = ()
    spans: tuple[Span, ...] = ()
    play: Play | None = None

    @property
    def is_keeper(self) -> bool:
        """Whether it is a goalkeeper's."""
        return self.play is not None and self.play.is_keeper

    @property
    def measured_keys(self) -> tuple[HeadingKey, ...]:
        """Headings that the feed has measured, which the body turns to as fast as bodies do."""
        return () if self.play is None else self.play.keys


class GivenHeadings:
    """The headings that K keys give, in order of time; each key ends where the next one begins.

    Attributes:
        starts, ends: (K,) s.
        gaps: (K + 1,) s before each key and after the last one in which none holds; inf at both ends.
    """

    def __init__(self, keys: Sequence[HeadingKey]):
        keys = sorted(keys, key=lambda key: key.time)
        self.starts = np.array([key.time for key in keys])
        self.ends = np.minimum([key.end for key in keys], np.append(self.starts[1:], np.inf))
        self.gaps = np.concatenate([[np.inf], self.starts[1:] - self.ends[:-1], [np.inf]])
        self._headings = np.array([np.nan if key.heading is None else key.heading for key in keys])
        self._targets = np.array([key.target or (0.0, 0.0) for key in keys])

    def find_keys(self, times: np.ndarray) -> np.ndarray:
        """Find the last key (T,) that has begun at `times` (T,) s, before the first one that one."""
        return np.maximum(np.searchsorted(self.starts, times, side="right") - 1, 0)

    def compute_heading(self, rows: np.ndarray, positions: np.ndarray) -> np.ndarray:
        """Compute the heading (T,) rad that the keys `rows` (T,) give at positions (T, 2) m."""
        offset, headings = self._targets[rows] - positions, self._headings[rows]
        return np.where(np.isnan(headings), arctan2(offset[:, 1], offset[:, 0]), headings)
