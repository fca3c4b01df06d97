"""What a passing scene asks of one body (where it stands; when, where and how it strikes), and where the player goes:
as recorded around each hit motion, and between them quietly to where the next one begins.

A hit motion is laid so that its strike is at the ordered place and facing; its recorded run-up and run-out belong to it
as far as there is time. What is left between two of them is walked as soon as the first one is over, and then the
player stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..ball.contact import Tool
from ..base.easing import State, quintic_between
from ..base.time_series import interpolate
from ..library.library import Library
from ..motion import quaternion
from ..motion.humanoid import heading_from_positions
from ..motion.motion import at_frames, pose_kinematics

LEAD, TIMELY = 1.6, 0.4
"""Seconds of run-up and run-out that are taken from the recording at most, and m/s that one of them is worth."""
SLOW = 0.3
"""m/s below which a run-up has not begun, and a run-out is over."""
CROUCHED, LIFTED = 3.0, 0.25
"""m/s of unrest that a metre below or above the usual height of the hips is, and that a foot in the air is."""
WALK, HASTE = 1.1, 2.2
"""m/s at which he goes from one place to the next where time allows, and where it does not."""
SPEEDING = 1.6
"""m/s^2 at which he comes to rest and sets out."""
_SETTLE = 0.4  # s that setting out and stopping take beside the way itself
_ROOM = 1.25  # times what he needs, from which on he stands between two hits
_SHARE = 0.7  # of the time between two hits that run-out and run-up may take


if TYPE_CHECKING:
    from .hits import HitMotion


@dataclass(frozen=True)
class Stance:
    """Where a player stands and which way he faces: place (2,) m on the ground of his root, facing rad from +x."""

    place: tuple[float, ...]
    facing: float


@dataclass(frozen=True, eq=False)
class HitOrder:
    """One strike.

    time: s. clip: index into the library's clips; hit: the hit motion, frames in the clip's own rate; strike_frame: the
    one that strikes, in that rate. place (2,) m and facing rad: of the root on the ground and of the heading at the
    strike. ball (3,) m: the ball's centre then; normal (3,): unit, the way from the part to the ball. part, side: of
    `contact.PARTS` or a joint's name. tool: what is in the hand. kind: toss, pass, attack or receive. touches: whether
    he meets the ball; who misses it plays on as recorded."""

    time: float
    clip: int
    hit: HitMotion
    strike_frame: float
    place: tuple[float, ...]
    facing: float
    ball: tuple[float, ...]
    normal: tuple[float, ...]
    part: str
    side: str
    tool: Tool | None = None
    kind: str = "pass"
    touches: bool = True


@dataclass(frozen=True, eq=False, kw_only=True)
class Placed:
    """A hit motion laid on the pitch: its clip turned by `turn` rad about the vertical, so that at the strike its root
    is at the ordered place; one second of the scene is one of the clip. first, last: frames of the clip, in its own
    rate, between which it is played: the hit motion, and as much of its run-up and run-out as there is time for."""

    library: Library
    order: HitOrder
    turn: float
    own_place: np.ndarray
    first: float
    last: float

    @classmethod
    def of(cls, library: Library, order: HitOrder) -> Placed:
        """The hit motion as ordered, alone."""
        motion = library.clips[order.clip].motion
        root, local = at_frames(motion, np.array([order.strike_frame]))
        places, _ = pose_kinematics(motion.skeleton, root, local)
        heading = heading_from_positions(motion.skeleton, places)[0]
        turn = float(quaternion.wrapped(order.facing - heading))
        return cls(library=library, order=order, turn=turn, own_place=root[0, :2], first=float(order.hit.first),
                   last=float(order.hit.last))

    def with_leads(self, into: float, out: float) -> Placed:
        """The same with so many seconds of run-up and run-out."""
        return replace(self, first=self.first - into * self._fps, last=self.last + out * self._fps)

    @property
    def start(self) -> float:
        """Second in which the hit motion begins."""
        return self.order.time + (self.first - self.order.strike_frame) / self._fps

    @property
    def end(self) -> float:
        """Second in which it ends."""
        return self.order.time + (self.last - self.order.strike_frame) / self._fps

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
        body is at rest, or nearest to it, where a second is worth TIMELY m/s."""
        frames, order, fps = self.library.frames, self.order, self.library.fps
        count = frames.count[order.clip]
        edge = (self.first if way < 0 else self.last) * fps / self._fps
        at = np.arange(int(round(edge)), -1 if way < 0 else count, way)[: int(LEAD * fps) + 1]
        at = at[(at >= 0) & (at < count)]
        if not len(at):
            return 0.0
        unrest = np.maximum(self._unrest()[at], SLOW)
        return int(np.argmin(unrest + TIMELY * np.arange(len(at)) / fps)) / fps

    def _unrest(self) -> np.ndarray:
        """(L,) m/s: how far the clip's body is from standing at each of the library's frames: as fast as it goes, over
        the ground and up or down, as low or high, and with a foot in the air."""
        frames, clip = self.library.frames, self.order.clip
        own = slice(frames.first[clip], frames.first[clip] + frames.count[clip])
        height = frames.root[own, 2]
        rising = np.gradient(height) * self.library.fps if len(height) > 1 else np.zeros(len(height))
        lifted = LIFTED * np.sum(~self.library.feet_standing[own], axis=1)
        return frames.speed[own] + np.abs(rising) + CROUCHED * np.abs(height - np.median(height)) + lifted

    def _at(self, times: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Values (L, K) of the library's frames at seconds (N,): linear, held at the clip's ends."""
        frames, clip = self.library.frames, self.order.clip
        own = self.order.strike_frame + (np.asarray(times) - self.order.time) * self._fps
        own = own * self.library.fps / self._fps
        own = np.clip(own, 0.0, frames.count[clip] - 1.0)
        inside = values[frames.first[clip] : frames.first[clip] + frames.count[clip]]
        return interpolate(own, np.arange(len(inside)), inside)


def placed(library: Library, orders: Sequence[HitOrder], start: float) -> list[Placed]:
    """The hit motions of one player as ordered, in the order of time, with run-up and run-out; start: second in which
    he begins. None is in the other's way: of the time between two they take _SHARE at most."""
    hits = [Placed.of(library, order) for order in orders]
    leads = [[hit.lead(-1), hit.lead(1)] for hit in hits]
    ends, starts = [start, *(hit.end for hit in hits)], [*(hit.start for hit in hits), np.inf]
    for number, (end, begin) in enumerate(zip(ends, starts)):
        out = leads[number - 1][1] if number else 0.0
        into = leads[number][0] if number < len(hits) else 0.0
        share = min(1.0, _SHARE * max(begin - end, 0.0) / max(out + into, 1e-9))
        if number:
            leads[number - 1][1] = share * out
        if number < len(hits):
            leads[number][0] = share * into
    return [hit.with_leads(into, out) for hit, (into, out) in zip(hits, leads)]


@dataclass(frozen=True, eq=False)
class Way:
    """positions (T, 2) m of the path without sway; facing (T,) rad within the hit motions, unwrapped the short way
    round from each to the next, NaN between them."""

    positions: np.ndarray
    facing: np.ndarray


def way(stance: Stance, hits: Sequence[Placed], times: np.ndarray) -> Way:
    """A player's way at seconds `times` (T,); hits in the order of time. He begins at his stance."""
    positions, facing = np.tile(np.array(stance.place, float), (len(times), 1)), np.full(len(times), np.nan)
    facing[0] = stance.facing
    before, turned = (float(times[0]), np.array(stance.place, float), np.zeros(2)), stance.facing
    for hit in hits:
        low, high = hit.start, hit.end
        between = (times > before[0]) & (times < low)
        ahead = hit.path(np.array([low]))[0], hit.velocity(low)
        positions[between] = walked(times[between], before, (low, *ahead))
        inside = (times >= low) & (times <= high)
        positions[inside] = hit.path(times[inside])
        angle = hit.heading(np.concatenate([[low], times[inside], [high]]))
        angle += quaternion.wrapped(angle[0] - turned) + turned - angle[0]
        facing[inside], turned = angle[1:-1], angle[-1]
        before = high, hit.path(np.array([high]))[0], hit.velocity(high)
    after = times > before[0]
    rest = before[0] + stopping(before[2])
    goal = (rest, before[1] + 0.5 * before[2] * (rest - before[0]), np.zeros(2))
    slowing = after & (times < rest)
    positions[after] = goal[1]
    positions[slowing] = quintic_between(times[slowing], before, goal)
    return Way(positions, facing)


def walked(times: np.ndarray, before: State, after: State) -> np.ndarray:
    """(N, 2) m at seconds (N,) between two states: to rest, over to where he sets out, and there he waits; or straight
    over where there is no time for that."""
    (start, place, leaves), (end, goal, comes) = before, after
    stop, go = stopping(leaves), stopping(comes)
    rest, ready = place + 0.5 * leaves * stop, goal - 0.5 * comes * go
    walk = np.linalg.norm(ready - rest) / WALK + _SETTLE
    if end - start < _ROOM * (stop + walk + go):
        return quintic_between(times, before, after)
    still = np.zeros(2)
    edges = [start, start + stop, start + stop + walk, end - go, end]
    states = [place, rest, ready, ready, goal]
    speeds = [leaves, still, still, still, comes]
    out = np.empty((len(times), 2))
    for number in range(4):
        inside = (times >= edges[number]) & (times <= edges[number + 1])
        begin, finish = ((edges[n], states[n], speeds[n]) for n in (number, number + 1))
        out[inside] = quintic_between(times[inside], begin, finish)
    return out


def stopping(velocity: np.ndarray) -> float:
    """Seconds in which he comes to rest from a velocity (2,) m/s, or takes it up."""
    return max(float(np.linalg.norm(velocity)) / SPEEDING, 0.05)


def needed(before: State, after: State) -> float:
    """Seconds that the way between two states asks for in haste."""
    stop, go = stopping(before[2]), stopping(after[2])
    apart = np.linalg.norm(after[1] - 0.5 * after[2] * go - before[1] - 0.5 * before[2] * stop)
    return stop + go + float(apart) / HASTE + _SETTLE
