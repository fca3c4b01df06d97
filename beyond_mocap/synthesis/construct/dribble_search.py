"""Which strides touch a dribbled ball, and how: the cheapest way from touch to touch, by dynamic programming, and the
legs as a ball meets them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...annotation.striking import Surface, nearest_on, part_surfaces
from ...ball.roll import rolls, speeds_of
from ...base.time_series import runs
from ...motion.humanoid import heading_from_positions, identify
from ...motion.motion import pose_kinematics
from ...motion.skeleton import Skeleton
from ...motion.track import BALL_RADIUS, zero_phase_hann
from .carry import foot_tip
from .meeting import touching_places

SOONEST, _LATEST = 0.2, 1.3  # s from one touch to the next
_ANGLES = np.radians([0.0, 35.0, -35.0, 65.0, -65.0])
_ALONG = 0.7  # share of the way from ankle to toes from which the ball is touched
_RETURNING, _BEHIND = -0.5, 0.0  # m/s against the body, and metres ahead of it, that a foot needs at least to touch it
_LEVEL = 0.08  # metres that the foot may be above or below the middle of the ball
_PUSH_SECONDS = 0.11  # longest time that a foot is at the ball
_FROM_END = 0.9  # seconds at an open end within which the first or last touch lies
_RATE = 30.0
_AT_ONCE = 8
_STANDING_STEP = 0.3  # seconds between two touches by a standing foot

_INSIDE_COST = 60.0  # a metre of ball within the body for a 30th of a second,
_NEAR, _FIT_COST = 0.25, 3.0  # a metre further than this from its sample for a second,
_BESIDE, _AHEAD_COST = 0.3, 4.0  # a metre less than this ahead of the pelvis for a second,
_TOUCH_COST, _LONG, _LONG_COST = 0.04, 0.7, 4.0  # a touch, and a second more than this to the next,
_ACROSS_COST, _BACK_COST, _SPEED_COST, _BRAKE_COST = 0.05, 0.3, 0.05, 0.6  # m/s that no foot so moved gives the ball,
_ANGLE_COST = 0.3  # a radian off straight ahead,
_STOOD_COST = 0.3  # and a touch by a foot that stands
_HEIGHT_COST = 20.0  # a metre of ball above the foot,
_WAIT_COST = 2.5  # and a second at an open end without a touch
_MOST_EXTRA = 2.0  # m/s that a ball leaves faster than its foot
_LEAST_EXTRA = 0.5  # m/s that it may leave slower, since a foot slows within a frame
_KEPT = 6  # pushes of a swing from which the ball may roll on
_START = -1

SHIN_RADIUS, TIP_RADIUS = 0.05, 0.0  # m about the lines of a shin and of the toes' tip, which the ball keeps out of
SLOW = 0.6  # m/s below which a body hardly goes anywhere
_ROUNDS, _CLOSE = 6, 5e-4


@dataclass(frozen=True)
class Push:
    """One touch: output frames first .. last in which the ball is at the foot of that side."""

    first: int
    last: int
    side: str


@dataclass(frozen=True)
class Between:
    """A part of a stretch without a key moment inside: frames low .. high; starts, ends: whether the ball is met at
    that end."""

    low: int
    high: int
    starts: bool
    ends: bool


class Legs:
    """A body over W frames, from its root (W, 3) m and local rotations (W, J, 4).

    feet: their striking surfaces, left and right; lines: both ends (W, 3) m of each. pelvis (W, 2) m; velocity (W, 2)
    m/s and speed (W,) of it without the sway of steps; ahead (W, 2): unit, where it goes, or faces where it hardly
    goes."""

    def __init__(self, skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, fps: float):
        places, world = pose_kinematics(skeleton, root, rotations)
        body, self.fps = identify(skeleton), fps
        self.pelvis = places[:, body.hips, :2]
        self.feet: tuple[Surface, ...] = part_surfaces(skeleton, "foot")
        self.lines = [foot.line(places, world) for foot in self.feet]
        solid = [(line, foot.radius) for line, foot in zip(self.lines, self.feet)]
        for limb in (body.left, body.right):
            solid.append(((places[:, limb.lower_leg], places[:, limb.foot]), SHIN_RADIUS))
            solid.append((foot_tip(skeleton, limb, places, world), TIP_RADIUS))
        self.start = np.stack([line[0] for line, _ in solid], axis=1)  # (W, 6, 3)
        self.along = np.stack([line[1] for line, _ in solid], axis=1) - self.start
        self.squared = np.maximum(np.sum(self.along**2, axis=-1), 1e-12)
        self.least = np.array([radius for _, radius in solid]) + BALL_RADIUS
        self.velocity = _smooth_velocity(self.pelvis, fps)
        self.speed = np.linalg.norm(self.velocity, axis=1)
        angle = heading_from_positions(skeleton, places)
        facing = np.column_stack([np.cos(angle), np.sin(angle)])
        going = self.velocity / np.maximum(self.speed, 1e-9)[:, None]
        self.ahead = np.where((self.speed > SLOW)[:, None], going, facing)

    def foot_velocity(self, side: int) -> np.ndarray:
        """(W, 2) m/s of the foot's middle."""
        middle = np.mean(self.lines[side], axis=0)[:, :2]
        return np.gradient(middle, axis=0) * self.fps

    def gaps(self, balls: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """(N,) m between balls (N, 3) m at frames (N,) and the nearest part of the body, negative within it."""
        return np.min(self._away(balls, frames)[1], axis=1)

    def kept_out(self, path: np.ndarray, free: np.ndarray) -> np.ndarray:
        """A ball's path (W, 3) m led around the body where it is `free` (W,) bool to go elsewhere."""
        every, aside, free = np.arange(len(path)), np.zeros((len(path), 2)), free[:, None]
        for left in reversed(range(_ROUNDS)):
            out = self.way_out(path + np.pad(aside, ((0, 0), (0, 1))), every) * free
            if np.abs(out).max(initial=0.0) < _CLOSE:
                break
            aside += out
            if left:
                padded = np.pad(aside, ((1, 1), (0, 0)), mode="edge")
                aside = free * (0.25 * padded[:-2] + 0.5 * aside + 0.25 * padded[2:])
        return path + np.pad(aside, ((0, 0), (0, 1)))

    def way_out(self, balls: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """(N, 2) m along the ground by which balls (N, 3) m come out of the part of the body that they are deepest
        in."""
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


def _smooth_velocity(places: np.ndarray, fps: float) -> np.ndarray:
    """(W, 2) m/s without the sway of steps."""
    return np.gradient(zero_phase_hann(places, fps, 0.6), axis=0) * fps if len(places) > 2 else np.zeros_like(places)


class Search:
    """The touches of one part: nodes are a foot, a frame and a side of the ball on which it may touch it; a push goes
    from node to node of one swing, a roll from the end of a push to the beginning of another."""

    def __init__(self, skeleton, root, rotations, standing, path, measured, part: Between, fps: float):
        span = slice(part.low, part.high + 1)
        self.part, self.fps, self.count = part, fps, part.high - part.low + 1
        self.body = Legs(skeleton, root[span], rotations[span], fps)
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
        is_left, ends = self.side[:, None] == 0, zip(*self.body.lines)
        line = [np.where(is_left, left[self.frame], right[self.frame]) for left, right in ends]
        start = line[0] + _ALONG * (line[1] - line[0])
        start[:, 2] = BALL_RADIUS
        radius = self.body.feet[0].radius
        level = np.column_stack([self.normal, np.zeros(len(table))])
        self.place = touching_places((line[0][:, None], line[1][:, None]), radius, start, level)
        usable = np.abs(nearest_on(line, self.place)[:, 2] - BALL_RADIUS) <= _LEVEL
        velocity = np.stack([self.body.foot_velocity(0), self.body.foot_velocity(1)])
        self.velocity = velocity[self.side, self.frame]
        forward = np.sum((self.velocity - self.body.velocity[self.frame]) * ahead, axis=1)
        before = np.sum((np.mean(line, axis=0)[:, :2] - self.body.pelvis[self.frame]) * ahead, axis=1)
        usable &= (forward > _RETURNING) & (before > _BEHIND) | (self.stood > 0)
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
        foot of a player who hardly moves may touch the ball as it stands."""
        air = [(first, end, 2 * number + side, 0) for number, (first, end) in enumerate(runs(~self.standing[:, side]))]
        step = max(int(_STANDING_STEP * self.fps), 1)
        still = [f for f in range(0, self.count, step) if self.standing[f, side] and self.body.speed[f] < SLOW]
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
        foot comes near the ball. Afterwards `pushes` has the touches."""
        count = len(self.frame)
        self.into, self.came = np.full(count, np.inf), np.full(count, _START)  # a roll that ends here, and whence
        self.out, self.pushed = np.full(count, np.inf), np.full(count, _START)  # a push that ends here, and whence
        self.arrives = np.zeros((count, 2))
        self.best, self.last = np.inf, _START
        self.sources = [_START] if self.part.starts else []
        if not count:  # no foot comes near: it rolls all the way, where it is met at both ends
            return self._path() if self.part.starts and self.part.ends else None
        if not self.part.starts:
            soon = np.flatnonzero(self.frame <= _FROM_END * self.fps)
            self.into[soon] = _WAIT_COST * self.frame[soon] / self.fps + _FIT_COST * self._off(soon)
            self.into[soon] += np.append(0.0, np.cumsum(self._untouched()))[self.frame[soon]]
        for frame in sorted(set(self.frame.tolist())):
            here = np.flatnonzero(self.frame == frame)
            self._rolled_to(here, frame)
            for node in here.tolist():
                self._push(node)
                self._keep_source(node)
        self._end()
        return self._path() if np.isfinite(self.best) else None

    def _keep_source(self, node: int) -> None:
        """The ball may roll on from this push, if it is among the best of its swing so far."""
        swing = [other for other in self.sources if other != _START and self.swing[other] == self.swing[node]]
        if len(swing) == _KEPT:
            worst = max(swing, key=lambda other: self.out[other])
            if self.out[node] >= self.out[worst]:
                return
            self.sources.remove(worst)
        if np.isfinite(self.out[node]):
            self.sources.append(node)

    def _off(self, nodes) -> np.ndarray:
        """(N,) m from the ball's sample to where a foot has it."""
        return np.linalg.norm(self.place[nodes, :2] - self.feed[self.frame[nodes], :2], axis=-1)

    def _untouched(self) -> np.ndarray:
        """(W,) what it costs that the ball goes as its samples have it."""
        return self._at(self.feed, np.arange(self.count))

    def _end(self) -> None:
        """The cheapest end: a roll to where the ball is met, or, where nothing is, any touch near it."""
        if self.part.ends:
            sources = self._sources(self.count - 1)
            if len(sources):
                costs, whence, _ = self._cheapest(sources, self.feed[-1:], self.count - 1)
                self.best, self.last = costs[0], whence[0]
            return
        left = (self.count - 1 - self.frame) / self.fps
        after = np.append(np.cumsum(self._untouched()[::-1])[::-1], 0.0)[self.frame + 1]
        whole = self.out + after + _WAIT_COST * left + _FIT_COST * self._off(slice(None))
        whole = np.where(left <= _FROM_END, whole, np.inf)
        if len(whole):
            self.best, self.last = whole.min(), int(np.argmin(whole))

    def _push(self, node: int) -> None:
        """The cheapest way for the ball to be at this foot: rolled here, or pushed here since a few frames."""
        longest = int(_PUSH_SECONDS * self.fps)
        ago = self.frame[node] - self.frame
        since = np.flatnonzero(self._alike(node) & (ago >= 0) & (ago <= longest))[::-1]
        since = since[ago[since] == np.arange(len(since))]  # without a frame between
        costs = self.into[since] + np.cumsum(self.held[since]) + self.touch[node]
        best = int(np.argmin(costs))
        self.out[node], self.pushed[node] = costs[best], since[best]

    def _alike(self, node: int) -> np.ndarray:
        """(N,) bool: nodes with the foot, the swing and the side of the ball of this one."""
        return (self.side == self.side[node]) & (self.angle == self.angle[node]) & (self.swing == self.swing[node])

    def _sources(self, frame: int) -> np.ndarray:
        """The nodes from which the ball may roll so as to be somewhere at a frame: within _LATEST, or the last ones."""
        found = np.array(self.sources, dtype=int)
        since = frame - np.where(found == _START, 0, self.frame[found])
        enough = since >= SOONEST * self.fps
        soon = enough & (since <= _LATEST * self.fps)
        return found[soon if soon.any() else enough & (since == since[enough].min(initial=frame + 1))]

    def _rolled_to(self, nodes: np.ndarray, frame: int) -> None:
        """The cheapest rolls that end in nodes, all of one frame."""
        sources = self._sources(frame)
        if not len(sources):
            return
        costs, whence, arrives = self._cheapest(sources, self.place[nodes], frame, self.swing[nodes])
        better = costs < self.into[nodes]
        self.into[nodes[better]], self.came[nodes[better]] = costs[better], whence[better]
        self.arrives[nodes[better]] = arrives[better]

    def _cheapest(self, sources: np.ndarray, ends: np.ndarray, frame: int, swing: np.ndarray | None = None):
        """For each of `ends` (N, 3) m the cost of the cheapest roll there, its source, and its velocity (N, 2) m/s.

        What a roll costs beside its way is worked out for all; the way, which only adds to it, for the cheapest, a few
        at a time, until no other can be cheaper."""
        starts = np.where((sources == _START)[:, None], self.feed[0], self.place[sources])
        frames = frame - np.where(sources == _START, 0, self.frame[sources])
        speeds = speeds_of(starts[:, None], ends, frames[:, None] / self.fps)
        least = np.where(sources == _START, 0.0, self.out[sources])[:, None] + self._sent(sources, speeds.leaves)
        least += _LONG_COST * np.maximum(frames / self.fps - _LONG, 0.0)[:, None]
        if swing is not None:
            least[(self.swing[sources][:, None] == swing) & (sources != _START)[:, None]] = np.inf
        order = np.argsort(least, axis=0, kind="stable")
        every = np.arange(len(ends))
        costs, whence = np.full(len(ends), np.inf), np.full(len(ends), _START)
        arrives = np.zeros((len(ends), 2))
        for first in range(0, len(sources), _AT_ONCE):
            tried = order[first : first + _AT_ONCE]
            target, row = np.tile(every, len(tried)), tried.ravel()
            hopeful = least[row, target] < costs[target]
            target, row = target[hopeful], row[hopeful]
            if not len(row):
                break
            whole = least[row, target] + self._way(starts[row], ends[target], frame - frames[row], frames[row])
            for one in np.argsort(whole, kind="stable")[::-1]:
                if whole[one] < costs[target[one]]:
                    costs[target[one]], whence[target[one]] = whole[one], sources[row[one]]
                    arrives[target[one]] = speeds.arrives[row[one], target[one]]
        return costs, whence, arrives

    def _way(self, starts: np.ndarray, ends: np.ndarray, since: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """(P,) what the ways from `starts` to `ends` (P, 3) m in `frames` (P,) from the frames `since` (P,) on cost."""
        rolled = rolls(starts, ends, frames, self.fps)
        pair, step = np.nonzero(np.arange(1, frames.max() + 1) < frames[:, None])
        passed = self._at(rolled.balls[pair, step], since[pair] + 1 + step)
        return np.bincount(pair, passed, len(frames)) + _HEIGHT_COST * rolled.missed

    def _sent(self, sources: np.ndarray, leaves: np.ndarray) -> np.ndarray:
        """(S, N) what it costs that feet, as they move, send the ball off with `leaves` (S, N, 2) m/s; nothing where
        the ball was met."""
        normal = self.normal[sources][:, None]
        change = leaves - self.arrives[self.pushed[sources]][:, None]
        pushed = np.sum(change * normal, axis=-1)
        across = np.linalg.norm(change - pushed[..., None] * normal, axis=-1)
        extra = np.sum(leaves * normal, axis=-1) - self._pushing(sources)[:, None]
        costs = (
            _ACROSS_COST * across + _BACK_COST * np.maximum(-pushed, 0.0)
            + _SPEED_COST * np.maximum(extra - _MOST_EXTRA, 0.0) + _BRAKE_COST * np.maximum(-extra - _LEAST_EXTRA, 0.0)
        )  # fmt: skip
        return np.where((sources == _START)[:, None], 0.0, costs)

    def _pushing(self, nodes: np.ndarray) -> np.ndarray:
        """(S,) m/s at which feet push the ball when it leaves them: the foot's speed, or the ball's own so far."""
        speed = np.sum(self.velocity[nodes] * self.normal[nodes], axis=-1)
        begun = self.pushed[nodes]
        frames = np.maximum(self.frame[nodes] - self.frame[begun], 1)
        way = np.sum((self.place[nodes] - self.place[begun])[:, :2] * self.normal[nodes], axis=-1)
        return np.where(begun == nodes, speed, np.maximum(speed, way * self.fps / frames))

    def _path(self) -> tuple[int, int, np.ndarray]:
        """The cheapest way, back from its end."""
        path = np.array(self.feed)
        last = self.count - 1 if self.part.ends else int(self.frame[self.last])
        node, (to, there) = self.last, (last, self.feed[-1]) if self.part.ends else (None, None)
        while True:
            frame = 0 if node == _START else int(self.frame[node])
            place = self.feed[0] if node == _START else self.place[node]
            if to is not None:
                rolled = rolls(place[None], there[None], np.array([to - frame]), self.fps).balls[0]
                path[frame + 1 : to] = rolled[: to - frame - 1]
            if node == _START:
                return 0, last, path[: last + 1]
            entered = int(self.pushed[node])
            first = int(self.frame[entered])
            held = np.flatnonzero(self._alike(node) & (self.frame >= first) & (self.frame <= frame))
            path[self.frame[held]] = self.place[held]
            self.pushes.insert(0, Push(first, frame, ("left", "right")[self.side[node]]))
            to, there = first, self.place[entered]
            node = int(self.came[entered])
            if node == _START and not self.part.starts:
                return first, last, path[first : last + 1]
