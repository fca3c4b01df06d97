"""Dribbling: the ball is touched step by step in front of the striding feet, and rolls ahead and slows in between.

What a feed has of a dribble is the ball somewhere near the player, often within him. Here the feet are left as they are
and the ball is fitted to them: at which strides a foot touches it, from which side, and for how long it pushes it, is
chosen by dynamic programming so that the ball is in no foot on its way, lies near its samples, and goes where the foot
sends it. Between two touches it rolls (`roll`); at key moments it is where it was met.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..motion import quaternion
from ..motion.humanoid import heading_from_positions, identify
from ..motion.motion import pose_kinematics
from ..motion.runs import runs
from ..motion.skeleton import Skeleton
from ..motion.striking import Surface, nearest_on, surfaces
from ..motion.track import BALL_RADIUS, zero_phase_hann
from .meeting import lead, touching_places
from .roll import rolls

KEY_SECONDS = 0.5
"""Seconds from either end of a stretch within which a key moment begins or ends the dribble."""

SHIN_RADIUS, TIP_RADIUS = 0.05, 0.0
"""Metres about the line of a shin, and about that of the toes beyond their joint, which the ball keeps out of."""

_ANGLES = np.radians([0.0, 35.0, -35.0, 65.0, -65.0])
_ALONG = 0.7  # share of the way from ankle to toes from which the ball is touched
_LEVEL = 0.08  # metres that the foot may be above or below the middle of the ball
_PUSH_SECONDS = 0.11  # longest time that a foot is at the ball
_SOONEST, _LATEST = 0.2, 1.3  # seconds from one touch to the next
_FROM_END = 0.9  # seconds at an open end within which the first or last touch lies
_RATE = 30.0
_SLOW = 0.6  # m/s below which a standing foot may touch the ball
_STANDING_STEP = 0.3  # seconds between two such touches

_INSIDE_COST = 60.0  # a metre of ball within the body for a 30th of a second,
_NEAR, _FIT_COST = 0.25, 1.5  # a metre further than this from its sample for a second,
_BESIDE, _AHEAD_COST = 0.3, 4.0  # a metre less than this ahead of the pelvis for a second,
_TOUCH_COST, _LONG, _LONG_COST = 0.04, 0.75, 2.0  # a touch, and a second more than this to the next,
_ACROSS_COST, _BACK_COST, _SPEED_COST, _BRAKE_COST = 0.05, 0.3, 0.05, 0.6  # m/s that no foot so moved gives the ball,
_ANGLE_COST = 0.3  # a radian off straight ahead,
_STOOD_COST = 0.3  # and a touch by a foot that stands
_HEIGHT_COST = 20.0  # a metre of ball above the foot
_MOST_EXTRA = 2.0  # m/s that a ball leaves faster than its foot
_LEAST_EXTRA = 0.5  # m/s that it may leave slower, since a foot slows within a frame
_KEPT = 3  # nodes of a frame from which the ball may roll on
_ROUNDS, _CLOSE = 6, 5e-4
_START = -1


@dataclass(frozen=True)
class Push:
    """One touch: output frames first .. last in which the ball is at the foot of that side."""

    first: int
    last: int
    side: str


@dataclass(frozen=True, eq=False)
class Dribbled:
    """ball (T, 3) m: its centre; pushes: in the order of time."""

    ball: np.ndarray
    pushes: tuple[Push, ...]


@dataclass(frozen=True)
class _Between:
    """A part of a stretch without a key moment inside: frames low .. high; starts, ends: whether the ball is met at that
    end."""

    low: int
    high: int
    starts: bool
    ends: bool


def dribble(
    skeleton: Skeleton,
    root: np.ndarray,
    rotations: np.ndarray,
    standing: np.ndarray,
    ball: np.ndarray,
    stretches: Sequence[tuple[float, float]],
    held: Sequence[tuple[int, int]],
    fps: float,
    *,
    measured: np.ndarray | None = None,
    turns: Sequence[float] = (),
) -> Dribbled:
    """The ball's path with every stretch of dribbling touched step by step.

    root (T, 3) m and rotations (T, J, 4) local: the motion on the pitch, which stays as it is. standing (T, 2) bool: left
    and right foot on the ground. ball (T, 3) m: its centre, NaN where there is none. stretches: first and last frame of
    each, fractional. held: the frames, first and last, in which the ball is met at key moments. measured (T,) bool: False
    where a sample counts for nothing. turns: frames at which the ball is known to change its course outside of the
    stretches. Frames before and behind the stretches change only where the ball has to come to its first touch or go from
    its last.
    """
    path, pushes = np.array(ball, dtype=float), []
    measured = np.isfinite(path).all(axis=1) if measured is None else np.asarray(measured, bool)
    for low, high in stretches:
        for part in _parts(low, high, held, len(path), fps):
            if not np.isfinite(path[part.low : part.high + 1]).all():
                continue
            search = _Search(skeleton, root, rotations, standing, path, measured, part, fps)
            found = search.run()
            if found is None:
                continue
            before, after, made = found
            path[part.low + before : part.low + after + 1] = made
            pushes += [Push(p.first + part.low, p.last + part.low, p.side) for p in search.pushes]
            others = [*(edge for pair in held for edge in pair), *turns, *(p.first for p in pushes), *(p.last for p in pushes)]
            path = _joined(path, ball, part, before, after, others, fps)
    return Dribbled(path, tuple(sorted(pushes, key=lambda push: push.first)))


def _parts(low: float, high: float, held, count: int, fps: float) -> list[_Between]:
    """The parts of a stretch, cut where the ball is met; key moments close to its ends are its ends."""
    reach = KEY_SECONDS * fps
    inside = sorted(pair for pair in held if low - reach <= pair[1] and pair[0] <= high + reach)
    low, high = max(int(np.ceil(low)), 0), min(int(np.floor(high)), count - 1)
    edges = [(None, low), *((pair, None) for pair in inside), (None, high)]
    out = []
    for (before, open_low), (after, open_high) in zip(edges, edges[1:]):
        first = open_low if before is None else before[1]
        last = open_high if after is None else after[0]
        if last - first >= _SOONEST * fps:
            out.append(_Between(first, last, before is not None, after is not None))
    return out


def _joined(path, feed, part: _Between, first: int, last: int, others: Sequence[int], fps: float) -> np.ndarray:
    """The path led to the first touch and away from the last where nothing is met at the part's ends; first and last are
    counted from its beginning."""
    first, last = part.low + first, part.low + last
    if not part.starts:
        anchor = max((frame for frame in others if frame < first), default=first - int(fps))
        path = _led_to(path, first, int(anchor), feed)
    if not part.ends:
        anchor = min((frame for frame in others if frame > last), default=last + int(fps))
        path = _led_to(path, last, int(anchor), feed)
    return path


def _led_to(path: np.ndarray, frame: int, anchor: int, feed: np.ndarray) -> np.ndarray:
    """The path as it is led from or to a touch at `frame`; the touch stays where it is."""
    out = lead(path, frame, anchor, path[frame] - feed[frame])
    out[frame] = path[frame]
    return out


class _Body:
    """The body over the W frames of a part: what the ball keeps out of, and its feet."""

    def __init__(self, skeleton: Skeleton, root, rotations, fps: float):
        places, world = pose_kinematics(skeleton, root, rotations)
        body = identify(skeleton)
        self.fps = fps
        self.pelvis = places[:, body.hips, :2]
        self.feet: tuple[Surface, ...] = surfaces(skeleton, {"dribble"})
        self.lines = [foot.line(places, world) for foot in self.feet]
        solid = [(line, foot.radius) for line, foot in zip(self.lines, self.feet)]
        for limb in (body.left, body.right):
            solid.append(((places[:, limb.lower_leg], places[:, limb.foot]), SHIN_RADIUS))
            solid.append((_toes(skeleton, limb, places, world), TIP_RADIUS))
        self.start = np.stack([line[0] for line, _ in solid], axis=1)  # (W, 6, 3)
        self.along = np.stack([line[1] for line, _ in solid], axis=1) - self.start
        self.squared = np.maximum(np.sum(self.along**2, axis=-1), 1e-12)
        self.least = np.array([radius for _, radius in solid]) + BALL_RADIUS
        self.velocity = _smooth_velocity(self.pelvis, fps)
        self.speed = np.linalg.norm(self.velocity, axis=1)
        angle = heading_from_positions(skeleton, places)
        facing = np.column_stack([np.cos(angle), np.sin(angle)])
        going = self.velocity / np.maximum(self.speed, 1e-9)[:, None]
        self.ahead = np.where((self.speed > _SLOW)[:, None], going, facing)

    def foot_velocity(self, side: int) -> np.ndarray:
        """(W, 2) m/s of the foot's middle."""
        middle = np.mean(self.lines[side], axis=0)[:, :2]
        return np.gradient(middle, axis=0) * self.fps

    def gaps(self, balls: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """(N,) m between balls (N, 3) m at frames (N,) and the nearest part of the body, negative within it."""
        return np.min(self._away(balls, frames)[1], axis=1)

    def way_out(self, balls: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """(N, 2) m over the ground by which balls (N, 3) m come out of that part of the body which they are deepest in."""
        away, gaps = self._away(balls, frames)
        rows, part = np.arange(len(balls)), np.argmin(gaps, axis=1)
        way, level = away[rows, part], np.linalg.norm(away[rows, part, :2], axis=1)
        wanted = np.sqrt(np.maximum(self.least[part] ** 2 - way[:, 2] ** 2, 0.0))
        return way[:, :2] * (np.maximum(wanted - level, 0.0) / np.maximum(level, 1e-6))[:, None]

    def _away(self, balls: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """From the nearest points of all parts to the balls (N, 6, 3) m, and the gaps (N, 6) m."""
        start, along = self.start[frames], self.along[frames]
        to = balls[:, None] - start
        share = np.clip(np.einsum("npk,npk->np", to, along) / self.squared[frames], 0.0, 1.0)
        to -= share[..., None] * along
        return to, np.sqrt(np.einsum("npk,npk->np", to, to)) - self.least


def _toes(skeleton: Skeleton, limb, places, world):
    """Both ends (W, 3) m of what is beyond the toe joint; twice the joint where nothing is."""
    joint = limb.toe if limb.toe is not None else limb.foot
    offset = next((o for p, o in zip(skeleton.end_parents, skeleton.end_offsets) if p == joint), np.zeros(3))
    return places[:, joint], places[:, joint] + quaternion.rotate(world[:, joint], offset)


def _smooth_velocity(places: np.ndarray, fps: float) -> np.ndarray:
    """(W, 2) m/s without the sway of steps."""
    return np.gradient(zero_phase_hann(places, fps, 0.6), axis=0) * fps if len(places) > 2 else np.zeros_like(places)


class _Search:
    """The touches of one part: nodes are a foot, a frame and a side of the ball on which it may touch it; a push goes
    from node to node of one swing, a roll from the end of a push to the beginning of another."""

    def __init__(self, skeleton, root, rotations, standing, path, measured, part: _Between, fps: float):
        span = slice(part.low, part.high + 1)
        self.part, self.fps, self.count = part, fps, part.high - part.low + 1
        self.body = _Body(skeleton, root[span], rotations[span], fps)
        self.standing, self.feed, self.measured = standing[span], path[span], measured[span]
        self.pushes: list[Push] = []
        self._nodes()

    def _nodes(self) -> None:
        """frame, side, angle, swing (N,), place (N, 3) m of the ball, normal (N, 2) from foot to ball, cost (N,)."""
        rows = []
        for side, swing in ((side, swing) for side in (0, 1) for swing in self._swings(side)):
            rows += [(frame, side, angle, *swing[2:]) for frame in range(*swing[:2]) for angle in range(len(_ANGLES))]
        table = np.array(rows, dtype=int).reshape(-1, 5)
        self.frame, self.side, self.angle, self.swing, self.stood = table.T
        ahead = self.body.ahead[self.frame]
        c, s = np.cos(_ANGLES[self.angle]), np.sin(_ANGLES[self.angle])
        self.normal = np.column_stack([c * ahead[:, 0] - s * ahead[:, 1], s * ahead[:, 0] + c * ahead[:, 1]])
        line = [np.where(self.side[:, None] == 0, left[self.frame], right[self.frame]) for left, right in zip(*self.body.lines)]
        start = line[0] + _ALONG * (line[1] - line[0])
        start[:, 2] = BALL_RADIUS
        radius = self.body.feet[0].radius
        level = np.column_stack([self.normal, np.zeros(len(table))])
        self.place = touching_places(tuple(end[:, None] for end in line), radius, start, level)
        usable = np.abs(nearest_on(line, self.place)[:, 2] - BALL_RADIUS) <= _LEVEL
        velocity = np.stack([self.body.foot_velocity(0), self.body.foot_velocity(1)])
        self.velocity = velocity[self.side, self.frame]
        forward = np.sum((self.velocity - self.body.velocity[self.frame]) * ahead, axis=1)
        usable &= (forward > -0.5) | (self.stood > 0)
        self._keep(usable)
        self.held = self._at(self.place, self.frame)
        self.touch = _TOUCH_COST + _ANGLE_COST * np.abs(_ANGLES[self.angle]) + _STOOD_COST * self.stood

    def _keep(self, usable: np.ndarray) -> None:
        order = np.flatnonzero(usable)
        order = order[np.argsort(self.frame[order], kind="stable")]
        for name in ("frame", "side", "angle", "swing", "stood", "normal", "place", "velocity"):
            setattr(self, name, getattr(self, name)[order])

    def _swings(self, side: int) -> list[tuple[int, int, int, int]]:
        """(first, end, number, 0) of every swing of a foot, and (frame, frame + 1, number, 1) of the moments in which a
        foot of somebody who hardly moves may touch the ball as it stands."""
        air = [(first, end, 2 * number + side, 0) for number, (first, end) in enumerate(runs(~self.standing[:, side]))]
        step = max(int(_STANDING_STEP * self.fps), 1)
        still = [f for f in range(0, self.count, step) if self.standing[f, side] and self.body.speed[f] < _SLOW]
        return [*air, *((frame, frame + 1, 2 * (self.count + frame) + side, 1) for frame in still)]

    def _at(self, balls: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """(N,) what it costs that balls (N, 3) m are there at frames (N,)."""
        off = balls[:, :2] - self.feed[frames, :2]
        fit = _FIT_COST * np.maximum(np.hypot(off[:, 0], off[:, 1]) - _NEAR, 0.0) * self.measured[frames]
        ahead = np.einsum("nk,nk->n", balls[:, :2] - self.body.pelvis[frames], self.body.ahead[frames])
        beside = _AHEAD_COST * np.maximum(_BESIDE - ahead, 0.0)
        inside = _INSIDE_COST * _RATE * np.maximum(-self.body.gaps(balls, frames), 0.0)
        return (fit + beside + inside) / self.fps

    def run(self) -> tuple[int, int, np.ndarray] | None:
        """First and last frame, counted from the part's, and the path (last - first + 1, 3) m in between; None where no
        foot comes near the ball."""
        count = len(self.frame)
        self.into, self.came = np.full(count, np.inf), np.full(count, _START)  # a roll that ends here, and whence
        self.out, self.pushed = np.full(count, np.inf), np.full(count, _START)  # a push that ends here, and whence
        self.arrives = np.zeros((count, 2))
        self.best, self.last = np.inf, _START
        if self.part.starts:
            self._roll(_START, 0, self.feed[0], 0.0)
        else:
            soon = np.flatnonzero(self.frame <= _FROM_END * self.fps)
            self.into[soon] = self.frame[soon] / self.fps + _FIT_COST * self._off(soon)
        for frame in sorted(set(self.frame.tolist())):
            for node in np.flatnonzero(self.frame == frame):
                self._push(int(node))
            here = np.flatnonzero((self.frame == frame) & np.isfinite(self.out))
            for node in here[np.argsort(self.out[here], kind="stable")][:_KEPT].tolist():
                if not self.part.ends:
                    self._ends_with(node)
                self._roll(node, frame, self.place[node], self.out[node])
        return self._path() if np.isfinite(self.best) else None

    def _off(self, nodes) -> np.ndarray:
        """(N,) m from the ball's sample to where a foot has it."""
        return np.linalg.norm(self.place[nodes, :2] - self.feed[self.frame[nodes], :2], axis=-1)

    def _ends_with(self, node: int) -> None:
        """An open part ends with this touch, if that is the best so far."""
        left = (self.count - 1 - self.frame[node]) / self.fps
        whole = self.out[node] + left + _FIT_COST * float(self._off(node))
        if left <= _FROM_END and whole < self.best:
            self.best, self.last = whole, node

    def _push(self, node: int) -> None:
        """The cheapest way for the ball to be at this foot: rolled here, or pushed here since a few frames."""
        longest = int(_PUSH_SECONDS * self.fps)
        same = (self.side == self.side[node]) & (self.angle == self.angle[node]) & (self.swing == self.swing[node])
        since = np.flatnonzero(same & (self.frame <= self.frame[node]) & (self.frame >= self.frame[node] - longest))[::-1]
        since = since[self.frame[node] - self.frame[since] == np.arange(len(since))]  # without a frame between
        costs = self.into[since] + np.cumsum(self.held[since]) + self.touch[node]
        best = int(np.argmin(costs))
        self.out[node], self.pushed[node] = costs[best], since[best]

    def _roll(self, node: int, frame: int, place: np.ndarray, cost: float) -> None:
        """The ball rolls from a foot, or from where it was met, to all that it may reach."""
        nodes = self._next(node, frame)
        targets, ends = [*self.frame[nodes]], [*self.place[nodes]]
        if self.part.ends and self.count - 1 - frame >= _SOONEST * self.fps:
            targets, ends = [*targets, self.count - 1], [*ends, self.feed[-1]]
        if not targets:
            return
        frames = np.array(targets) - frame
        rolled = rolls(place, np.array(ends), frames, self.fps)
        costs = cost + _HEIGHT_COST * rolled.missed + _LONG_COST * np.maximum(frames / self.fps - _LONG, 0.0)
        costs += self._sent(node, rolled.leaves) if node != _START else 0.0
        known = np.append(self.into[nodes], self.best)[: len(frames)]
        hopeful = np.flatnonzero(costs < np.minimum(known, self.best))  # the way itself only adds to it
        if not len(hopeful):
            return
        way, step = np.nonzero(np.arange(1, frames.max() + 1) < frames[hopeful, None])
        passed = self._at(rolled.balls[hopeful[way], step], frame + 1 + step)
        costs[hopeful] += np.bincount(way, passed, len(hopeful))
        better = hopeful[costs[hopeful] < known[hopeful]]
        if len(better) and better[-1] == len(nodes):
            self.best, self.last, better = costs[-1], node, better[:-1]
        self.into[nodes[better]], self.came[nodes[better]] = costs[better], node
        self.arrives[nodes[better]] = rolled.arrives[better]

    def _next(self, node: int, frame: int) -> np.ndarray:
        """The nodes to which the ball may roll from a frame: within _LATEST, or the first after that."""
        later = np.flatnonzero(self.frame >= frame + _SOONEST * self.fps)
        later = later if node == _START else later[self.swing[later] != self.swing[node]]
        soon = later[self.frame[later] <= frame + _LATEST * self.fps]
        return soon if len(soon) else later[self.frame[later] == self.frame[later].min(initial=self.count)]

    def _sent(self, node: int, leaves: np.ndarray) -> np.ndarray:
        """(K,) what it costs that this foot, as it moves, sends the ball off with `leaves` (K, 2) m/s."""
        normal = self.normal[node]
        change = leaves - self.arrives[self.pushed[node]]
        pushed = change @ normal
        across = np.linalg.norm(change - pushed[:, None] * normal, axis=1)
        extra = leaves @ normal - self.velocity[node] @ normal
        return (
            _ACROSS_COST * across + _BACK_COST * np.maximum(-pushed, 0.0)
            + _SPEED_COST * np.maximum(extra - _MOST_EXTRA, 0.0) + _BRAKE_COST * np.maximum(-extra - _LEAST_EXTRA, 0.0)
        )  # fmt: skip

    def _path(self) -> tuple[int, int, np.ndarray]:
        """The cheapest way, back from its end."""
        path = np.array(self.feed)
        last = self.count - 1 if self.part.ends else int(self.frame[self.last])
        to, there, node, first = last, self.feed[-1], self.last, 0
        if not self.part.ends:
            to, there = None, None
        while True:
            frame = 0 if node == _START else int(self.frame[node])
            place = self.feed[0] if node == _START else self.place[node]
            if to is not None:
                path[frame + 1 : to] = rolls(place, there[None], np.array([to - frame]), self.fps).balls[0][: to - frame - 1]
            if node == _START:
                return 0, last, self._kept_out(path)
            entered = int(self.pushed[node])
            swing = (self.side == self.side[node]) & (self.angle == self.angle[node]) & (self.swing == self.swing[node])
            held = np.flatnonzero(swing & (self.frame >= self.frame[entered]) & (self.frame <= frame))
            path[self.frame[held]] = self.place[held]
            first = int(self.frame[entered])
            self.pushes.insert(0, Push(first, frame, ("left", "right")[self.side[node]]))
            to, there = first, self.place[entered]
            node = int(self.came[entered])
            if node == _START and not self.part.starts:
                return first, last, self._kept_out(path)[first : last + 1]

    def _kept_out(self, path: np.ndarray) -> np.ndarray:
        """The path led around what is left of the body on its way; where it is met or touched it stays."""
        free = np.ones((self.count, 1), bool)
        free[0], free[-1] = not self.part.starts, not self.part.ends
        for push in self.pushes:
            free[push.first : push.last + 1] = False
        every, aside = np.arange(self.count), np.zeros((self.count, 2))
        for left in reversed(range(_ROUNDS)):
            out = self.body.way_out(path + np.pad(aside, ((0, 0), (0, 1))), every) * free
            if np.abs(out).max() < _CLOSE:
                break
            aside += out
            if left:
                padded = np.pad(aside, ((1, 1), (0, 0)), mode="edge")
                aside = free * (0.25 * padded[:-2] + 0.5 * aside + 0.25 * padded[2:])
        return path + np.pad(aside, ((0, 0), (0, 1)))
