"""Where a player of a passing scene goes: as recorded around each of his hit motions, and between them quietly to where the
next one begins.

A hit motion is laid so that its strike is at the ordered place and facing; its recorded run-up and run-out belong to it as
far as there is time. What is left between two of them is walked as soon as the first one is over, and then he stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..library.library import Library
from ..motion import quaternion
from ..motion.humanoid import heading_from_positions
from ..motion.motion import at_frames, pose_kinematics
from .orders import HitOrder, Stance

LEAD, UNENDED = 1.6, 0.3
"""Seconds of run-up and run-out that are taken from the recording at most, and of one that neither begins nor ends at
rest."""

SLOW = 0.3
"""m/s below which a run-up has not begun, and a run-out is over."""

WALK, HASTE = 1.1, 2.2
"""m/s at which he goes from one place to the next where time allows, and where it does not."""

SPEEDING = 1.6
"""m/s^2 at which he comes to rest and sets out."""

_SETTLE = 0.4  # s that setting out and stopping take beside the way itself
_ROOM = 1.25  # times what he needs, from which on he stands between two hits
_SHARE = 0.7  # of the time between two hits that run-out and run-up may take


@dataclass(frozen=True, eq=False)
class Placed:
    """A hit motion laid on the pitch: its clip turned by `turn` rad about the vertical, so that at `time` s its root is at
    `place` (2,) m; one second of the scene is one of the clip."""

    library: Library
    order: HitOrder
    turn: float
    own_place: np.ndarray

    @classmethod
    def of(cls, library: Library, order: HitOrder) -> Placed:
        """The hit motion as ordered."""
        motion = library.clips[order.clip].motion
        root, local = at_frames(motion, np.array([order.strike_frame]))
        places, _ = pose_kinematics(motion.skeleton, root, local)
        heading = heading_from_positions(motion.skeleton, places)[0]
        return cls(library, order, float(quaternion.wrapped(order.facing - heading)), root[0, :2])

    @property
    def start(self) -> float:
        """Second in which the hit motion begins."""
        return self.order.time + (self.order.hit.first - self.order.strike_frame) / self._fps

    @property
    def end(self) -> float:
        """Second in which it ends."""
        return self.order.time + (self.order.hit.last - self.order.strike_frame) / self._fps

    @property
    def _fps(self) -> float:
        return self.library.clips[self.order.clip].motion.fps

    def path(self, times: np.ndarray) -> np.ndarray:
        """(N, 2) m: the clip's path without sway at seconds (N,)."""
        values = self._at(times, self.library.frames.path)
        return self.order.place + quaternion.turned_level(values - self.own_place, np.full(len(values), self.turn))

    def heading(self, times: np.ndarray) -> np.ndarray:
        """(N,) rad: where the body faces at seconds (N,)."""
        return self._at(times, self.library.frames.heading[:, None])[:, 0] + self.turn

    def velocity(self, time: float) -> np.ndarray:
        """(2,) m/s of the path at a second."""
        step = 1.0 / self.library.fps
        ends = self.path(np.array([time - step, time + step]))
        return (ends[1] - ends[0]) / (2.0 * step)

    def lead(self, way: int) -> float:
        """Seconds, at most LEAD, of the recorded run-up (way -1) or run-out (1) beside the hit motion: up to where the
        body is slow; where it never is, UNENDED of it."""
        frames, order, fps = self.library.frames, self.order, self.library.fps
        first, count = frames.first[order.clip], frames.count[order.clip]
        edge = (order.hit.first if way < 0 else order.hit.last) * fps / self._fps
        at = np.arange(int(round(edge)), -1 if way < 0 else count, way)[: int(LEAD * fps) + 1]
        at = at[(at >= 0) & (at < count)]
        slow = np.flatnonzero(frames.speed[first + at] < SLOW)
        return int(slow[0]) / fps if len(slow) else min(max(len(at) - 1, 0) / fps, UNENDED)

    def _at(self, times: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Values (L, K) of the library's frames at seconds (N,): linear, held at the clip's ends."""
        frames, clip = self.library.frames, self.order.clip
        own = (self.order.strike_frame + (np.asarray(times) - self.order.time) * self._fps) * self.library.fps / self._fps
        own = np.clip(own, 0.0, frames.count[clip] - 1.0)
        inside = values[frames.first[clip] : frames.first[clip] + frames.count[clip]]
        return np.stack([np.interp(own, np.arange(len(inside)), column) for column in inside.T], axis=1)


@dataclass(frozen=True, eq=False)
class Way:
    """positions (T, 2) m of the path without sway; facing (T,) rad within the hit motions, unwrapped the short way round
    from each to the next, NaN between them; first, last: facing before and after all of them."""

    positions: np.ndarray
    facing: np.ndarray


def way(stance: Stance, hits: Sequence[Placed], times: np.ndarray) -> Way:
    """A player's way at seconds `times` (T,); hits in the order of time. He begins at his stance."""
    positions, facing = np.tile(np.array(stance.place, float), (len(times), 1)), np.full(len(times), np.nan)
    facing[0] = stance.facing
    spans = _spans(hits, times)
    before, turned = (float(times[0]), np.array(stance.place, float), np.zeros(2)), stance.facing
    for hit, (low, high) in zip(hits, spans):
        between = (times > before[0]) & (times < low)
        ahead = hit.path(np.array([low]))[0], hit.velocity(low)
        positions[between] = walked(times[between], before, (low, *ahead))
        inside = (times >= low) & (times <= high)
        positions[inside] = hit.path(times[inside])
        own = (times >= hit.start) & (times <= hit.end)
        angle = hit.heading(np.concatenate([[hit.start], times[own], [hit.end]]))
        angle += quaternion.wrapped(angle[0] - turned) + turned - angle[0]
        facing[own], turned = angle[1:-1], angle[-1]
        before = high, hit.path(np.array([high]))[0], hit.velocity(high)
    after = times > before[0]
    rest = before[0] + stopping(before[2])
    goal = (rest, before[1] + 0.5 * before[2] * (rest - before[0]), np.zeros(2))
    slowing = after & (times < rest)
    positions[after] = goal[1]
    positions[slowing] = hermite(times[slowing], before, goal)
    return Way(positions, facing)


def _spans(hits: Sequence[Placed], times: np.ndarray) -> list[tuple[float, float]]:
    """The seconds (from, to) of each hit with as much of its run-up and run-out as there is time for."""
    leads = [[hit.lead(-1), hit.lead(1)] for hit in hits]
    ends = [float(times[0]), *(hit.end for hit in hits)]
    starts = [*(hit.start for hit in hits), np.inf]
    for number, (end, start) in enumerate(zip(ends, starts)):
        out = leads[number - 1][1] if number else 0.0
        into = leads[number][0] if number < len(hits) else 0.0
        share = min(1.0, _SHARE * max(start - end, 0.0) / max(out + into, 1e-9))
        if number:
            leads[number - 1][1] = share * out
        if number < len(hits):
            leads[number][0] = share * into
    return [(hit.start - into, hit.end + out) for hit, (into, out) in zip(hits, leads)]


State = tuple[float, np.ndarray, np.ndarray]
"""A second, a place (2,) m and a velocity (2,) m/s."""


def walked(times: np.ndarray, before: State, after: State) -> np.ndarray:
    """(N, 2) m at seconds (N,) between two states: to rest, over to where he sets out, and there he waits; or straight
    over where there is no time for that."""
    (start, place, leaves), (end, goal, comes) = before, after
    stop, go = stopping(leaves), stopping(comes)
    rest, ready = place + 0.5 * leaves * stop, goal - 0.5 * comes * go
    walk = np.linalg.norm(ready - rest) / WALK + _SETTLE
    if end - start < _ROOM * (stop + walk + go):
        return hermite(times, before, after)
    still = np.zeros(2)
    edges = [start, start + stop, start + stop + walk, end - go, end]
    states = [place, rest, ready, ready, goal]
    speeds = [leaves, still, still, still, comes]
    out = np.empty((len(times), 2))
    for number in range(4):
        inside = (times >= edges[number]) & (times <= edges[number + 1])
        ends = [(edges[n], states[n], speeds[n]) for n in (number, number + 1)]
        out[inside] = hermite(times[inside], *ends)
    return out


def stopping(velocity: np.ndarray) -> float:
    """Seconds in which he comes to rest from a velocity (2,) m/s, or takes it up."""
    return max(float(np.linalg.norm(velocity)) / SPEEDING, 0.05)


def needed(before: State, after: State) -> float:
    """Seconds that the way between two states asks for in haste."""
    stop, go = stopping(before[2]), stopping(after[2])
    apart = np.linalg.norm(after[1] - 0.5 * after[2] * go - before[1] - 0.5 * before[2] * stop)
    return stop + go + float(apart) / HASTE + _SETTLE


def hermite(times: np.ndarray, before: State, after: State) -> np.ndarray:
    """(N, 2) m: the quintic from one state to the other without acceleration at either end."""
    (start, place, leaves), (end, goal, comes) = before, after
    length = max(end - start, 1e-9)
    x = ((np.asarray(times) - start) / length)[:, None]
    h = goal - place
    a, b = length * leaves, length * comes
    return place + a * x + (10 * h - 6 * a - 4 * b) * x**3 + (-15 * h + 8 * a + 7 * b) * x**4 + (6 * h - 3 * a - 3 * b) * x**5
