"""Orders to one player of a passing scene (where they begin; when, where and how they strike), and the player's path.

A hit motion is placed so that its strike is at the ordered place and facing. Its recorded run-up and run-out belong to
it where there is time. The distance between two hit motions is walked as soon as the first one is over; then the player
stands still.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..ball.contact import Tool
from ..base.easing import State, interpolate_quintic
from ..base.time_series import interpolate_columns
from ..library.library import Library
from ..motion import quaternion
from ..motion.humanoid import compute_heading_from_positions
from ..motion.motion import compute_pose, sample_frames

LONGEST_LEAD, LEAD_WORTH = 1.6, 0.4
"""Most seconds of run-up or run-out that are taken from the recording, and m/s that one of these seconds is worth."""
REST_SPEED = 0.3
"""m/s below which a run-up has not begun, and a run-out is over."""
HEIGHT_UNREST, AIR_UNREST = 3.0, 0.25
"""m/s of unrest for each metre of the hips below or above their typical height, and for each foot in the air."""
WALK_SPEED, HURRY_SPEED = 1.1, 2.2
"""m/s from one place to the next: where time allows, and where it does not."""
START_ACCELERATION = 1.6
"""m/s^2 with which the player stops and sets out."""
_SETTLE_SECONDS = 0.4  # s that setting out and stopping add to the time for the distance
_STANDING_MARGIN = 1.25  # times the needed time, from which on the player stands still between two hits
_LEAD_SHARE = 0.7  # of the time between two hits: most that run-out and run-up take


if TYPE_CHECKING:
    from .hits import HitMotion


@dataclass(frozen=True)
class Stance:
    """Where a player stands.

    Attributes:
        place: (2,) m, root on the ground, world frame.
        facing: heading, rad from +x.
    """

    place: tuple[float, ...]
    facing: float


@dataclass(frozen=True, eq=False)
class HitOrder:
    """Order for one strike.

    Attributes:
        time: s.
        clip: index into the library's clips.
        hit: the hit motion, frames in the clip's own rate.
        strike_frame: fractional frame of the strike, in that rate.
        place: (2,) m, root on the ground at the strike, world frame.
        facing: heading at the strike, rad from +x.
        ball: (3,) m, centre of the ball at the strike, world frame.
        normal: (3,) unit vector from the part to the ball, world frame.
        part: one of `contact.PARTS` or a joint's name.
        side: "left", "right", or "".
        tool: what is in the hand.
        kind: "toss", "pass", "attack" or "receive".
        touches: whether the player meets the ball; a player who misses it plays on as recorded.
    """

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
class PlacedHit:
    """A hit motion placed on the pitch: its clip turned about the vertical so that its root is at the ordered place.

    One second of the scene is one second of the clip.

    Attributes:
        library: the library of the clip.
        order: the order that it carries out.
        turn: rad about the vertical, from clip to world.
        clip_place: (2,) m, the clip's root at the strike, clip frame.
        first: first frame that is played, in the clip's own rate: the hit motion with its run-up.
        last: last frame that is played: the hit motion with its run-out.
    """

    library: Library
    order: HitOrder
    turn: float
    clip_place: np.ndarray
    first: float
    last: float

    @classmethod
    def from_order(cls, library: Library, order: HitOrder) -> PlacedHit:
        """Place the hit motion of an order, without run-up and run-out."""
        motion = library.clips[order.clip].motion
        root, local = sample_frames(motion, np.array([order.strike_frame]))
        places, _ = compute_pose(motion.skeleton, root, local)
        heading = compute_heading_from_positions(motion.skeleton, places)[0]
        turn = float(quaternion.wrap_angle(order.facing - heading))
        return cls(library=library, order=order, turn=turn, clip_place=root[0, :2], first=float(order.hit.first),
                   last=float(order.hit.last))

    def with_leads(self, into: float, out: float) -> PlacedHit:
        """Copy it with `into` seconds of run-up and `out` seconds of run-out."""
        return replace(self, first=self.first - into * self._fps, last=self.last + out * self._fps)

    @property
    def start(self) -> float:
        """Second of the scene at which it begins."""
        return self.order.time + (self.first - self.order.strike_frame) / self._fps

    @property
    def end(self) -> float:
        """Second of the scene at which it ends."""
        return self.order.time + (self.last - self.order.strike_frame) / self._fps

    @property
    def _fps(self) -> float:
        return self.library.clips[self.order.clip].motion.fps

    def compute_path(self, times: np.ndarray) -> np.ndarray:
        """Compute the path without sway.

        Args:
            times: (N,) s of the scene.
        Returns:
            (N, 2) m, world frame.
        """
        values = self._interpolate_frames(times, self.library.frames.path)
        return self.order.place + quaternion.rotate_level(values - self.clip_place, np.full(len(values), self.turn))

    def compute_heading(self, times: np.ndarray) -> np.ndarray:
        """Compute the heading.

        Args:
            times: (N,) s of the scene.
        Returns:
            (N,) rad, world frame.
        """
        return self._interpolate_frames(times, self.library.frames.heading[:, None])[:, 0] + self.turn

    def compute_velocity(self, time: float) -> np.ndarray:
        """Compute the path's velocity (2,) m/s, world frame, at `time` s of the scene."""
        step = 1.0 / self.library.fps
        ends = self.compute_path(np.array([time - step, time + step]))
        return (ends[1] - ends[0]) / (2.0 * step)

    def find_lead(self, direction: int) -> float:
        """Measure the recorded run-up or run-out, at most LONGEST_LEAD seconds.

        It reaches to where the body is at rest, or nearest to rest; each second of it is worth LEAD_WORTH m/s.

        Args:
            direction: -1 for the run-up, 1 for the run-out.
        Returns:
            Seconds.
        """
        frames, order, fps = self.library.frames, self.order, self.library.fps
        count = frames.count[order.clip]
        # edge of the hit motion, converted from the clip's rate to the library's
        edge = (self.first if direction < 0 else self.last) * fps / self._fps
        at = np.arange(int(round(edge)), -1 if direction < 0 else count, direction)[: int(LONGEST_LEAD * fps) + 1]
        at = at[(at >= 0) & (at < count)]
        if not len(at):
            return 0.0
        unrest = np.maximum(self._measure_unrest()[at], REST_SPEED)
        return int(np.argmin(unrest + LEAD_WORTH * np.arange(len(at)) / fps)) / fps

    def _measure_unrest(self) -> np.ndarray:
        """Measure how far the clip's body is from standing still at each of the library's frames, (L,) m/s.

        The sum of its speed over the ground, its speed up or down, its height below or above the usual, and feet in the
        air.
        """
        frames, clip = self.library.frames, self.order.clip
        own = slice(frames.first[clip], frames.first[clip] + frames.count[clip])
        height = frames.root[own, 2]
        rising = np.gradient(height) * self.library.fps if len(height) > 1 else np.zeros(len(height))
        lifted = AIR_UNREST * np.sum(~self.library.feet_in_contact[own], axis=1)
        return frames.speed[own] + np.abs(rising) + HEIGHT_UNREST * np.abs(height - np.median(height)) + lifted

    def _interpolate_frames(self, times: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Interpolate values (L, K) of the library's frames at seconds (N,) of the scene; constant beyond the clip's
        ends.
        """
        frames, clip = self.library.frames, self.order.clip
        own = self.order.strike_frame + (np.asarray(times) - self.order.time) * self._fps
        own = own * self.library.fps / self._fps
        own = np.clip(own, 0.0, frames.count[clip] - 1.0)
        inside = values[frames.first[clip] : frames.first[clip] + frames.count[clip]]
        return interpolate_columns(own, np.arange(len(inside)), inside)


def place_hits(library: Library, orders: Sequence[HitOrder], start: float) -> list[PlacedHit]:
    """Place the hit motions of one player with run-up and run-out.

    Neighbours do not overlap: run-out and run-up take at most _LEAD_SHARE of the time between two hit motions.

    Args:
        library: the library.
        orders: orders of one player in order of time.
        start: second of the scene at which the player begins.
    Returns:
        The placed hit motions, in the same order.
    """
    hits = [PlacedHit.from_order(library, order) for order in orders]
    leads = [[hit.find_lead(-1), hit.find_lead(1)] for hit in hits]
    ends, starts = [start, *(hit.end for hit in hits)], [*(hit.start for hit in hits), np.inf]
    # gap `number` lies before hit `number`: the run-out of the hit before and the run-up of this one share it
    for number, (end, begin) in enumerate(zip(ends, starts)):
        out = leads[number - 1][1] if number else 0.0
        into = leads[number][0] if number < len(hits) else 0.0
        share = min(1.0, _LEAD_SHARE * max(begin - end, 0.0) / max(out + into, 1e-9))
        if number:
            leads[number - 1][1] = share * out
        if number < len(hits):
            leads[number][0] = share * into
    return [hit.with_leads(into, out) for hit, (into, out) in zip(hits, leads)]


@dataclass(frozen=True, eq=False)
class PlayerPath:
    """Path of a player over a scene.

    Attributes:
        positions: (T, 2) m, path without sway, world frame.
        facing: (T,) rad within the hit motions, unwrapped the short way from each to the next; NaN between them.
    """

    positions: np.ndarray
    facing: np.ndarray


def build_player_path(stance: Stance, hits: Sequence[PlacedHit], times: np.ndarray) -> PlayerPath:
    """Build a player's path.

    Args:
        stance: where the player begins.
        hits: placed hit motions in order of time.
        times: (T,) s of the scene.
    Returns:
        The path at these times.
    """
    positions, facing = np.tile(np.array(stance.place, float), (len(times), 1)), np.full(len(times), np.nan)
    facing[0] = stance.facing
    last_state, last_facing = (float(times[0]), np.array(stance.place, float), np.zeros(2)), stance.facing
    for hit in hits:
        low, high = hit.start, hit.end
        between = (times > last_state[0]) & (times < low)
        ahead = hit.compute_path(np.array([low]))[0], hit.compute_velocity(low)
        positions[between] = compute_walk(times[between], last_state, (low, *ahead))
        inside = (times >= low) & (times <= high)
        positions[inside] = hit.compute_path(times[inside])
        angle = hit.compute_heading(np.concatenate([[low], times[inside], [high]]))
        angle += quaternion.wrap_angle(angle[0] - last_facing) + last_facing - angle[0]
        facing[inside], last_facing = angle[1:-1], angle[-1]
        last_state = high, hit.compute_path(np.array([high]))[0], hit.compute_velocity(high)
    after = times > last_state[0]
    rest = last_state[0] + compute_stopping_time(last_state[2])
    goal = (rest, last_state[1] + 0.5 * last_state[2] * (rest - last_state[0]), np.zeros(2))
    slowing = after & (times < rest)
    positions[after] = goal[1]
    positions[slowing] = interpolate_quintic(times[slowing], last_state, goal)
    return PlayerPath(positions, facing)


def compute_walk(times: np.ndarray, before: State, after: State) -> np.ndarray:
    """Compute the path between two states.

    The player stops, walks to where they set out again, and waits there; or goes straight over if there is no time for
    that.

    Args:
        times: (N,) s between the two states.
        before: (s, place (2,) m, velocity (2,) m/s).
        after: (s, place (2,) m, velocity (2,) m/s).
    Returns:
        (N, 2) m.
    """
    (start, place, leaving_velocity), (end, goal, arriving_velocity) = before, after
    stop, go = compute_stopping_time(leaving_velocity), compute_stopping_time(arriving_velocity)
    rest, ready = place + 0.5 * leaving_velocity * stop, goal - 0.5 * arriving_velocity * go
    walk = np.linalg.norm(ready - rest) / WALK_SPEED + _SETTLE_SECONDS
    if end - start < _STANDING_MARGIN * (stop + walk + go):
        return interpolate_quintic(times, before, after)
    still = np.zeros(2)
    edges = [start, start + stop, start + stop + walk, end - go, end]
    states = [place, rest, ready, ready, goal]
    speeds = [leaving_velocity, still, still, still, arriving_velocity]
    out = np.empty((len(times), 2))
    for number in range(4):
        inside = (times >= edges[number]) & (times <= edges[number + 1])
        begin, finish = ((edges[n], states[n], speeds[n]) for n in (number, number + 1))
        out[inside] = interpolate_quintic(times[inside], begin, finish)
    return out


def compute_stopping_time(velocity: np.ndarray) -> float:
    """Compute the seconds in which the player stops from a velocity (2,) m/s, or reaches it."""
    return max(float(np.linalg.norm(velocity)) / START_ACCELERATION, 0.05)


def compute_travel_time(before: State, after: State) -> float:
    """Compute the seconds that the path between two states takes in a hurry."""
    stop, go = compute_stopping_time(before[2]), compute_stopping_time(after[2])
    distance = np.linalg.norm(after[1] - 0.5 * after[2] * go - before[1] - 0.5 * before[2] * stop)
    return stop + go + float(distance) / HURRY_SPEED + _SETTLE_SECONDS
