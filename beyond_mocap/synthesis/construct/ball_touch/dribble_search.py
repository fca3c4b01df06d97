"""Search for the touches of a dribbled ball: which strides touch it, and how, by dynamic programming.

`Legs` holds the parts of the body that the ball stays out of.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....annotation.body_solid import BodySolid, build_leg_surfaces
from ....annotation.striking import Surface, build_part_surfaces, find_nearest_point
from ....ball.roll import compute_roll_speeds, simulate_rolls
from ....base.time_series import find_runs
from ....motion.humanoid import compute_heading_from_positions, identify_joints
from ....motion.motion import compute_pose
from ....motion.skeleton import Skeleton
from ....motion.track import BALL_RADIUS, smooth_zero_phase_hann
from ...take import DribbleTouch
from ..contact_geometry import find_touching_places

SOONEST, _LATEST = 0.2, 0.6  # s, shortest roll from one touch to the next, and longest beyond the `_LONG` below
_ANGLES = np.radians([0.0, 35.0, -35.0, 65.0, -65.0])  # sides of the ball that are tried, from straight ahead
_ALONG = 0.7  # share of the line from ankle to toes at which the ball is touched
_RETURNING, _BEHIND = -0.5, 0.0  # least m/s of a touching foot relative to the body, and least m ahead of the pelvis
_DEEPEST = 0.008  # m that a touched ball may be inside another part of the legs
_LEVEL = 0.08  # m that the foot may be above or below the middle of the ball
_PUSH_SECONDS = 0.11  # s, longest push
_FROM_END = 0.9  # s from an open end within which the first or last touch lies
_RATE = 30.0  # frames per second that the cost of a ball inside the body refers to
_AT_ONCE = 8  # rolls evaluated together for each end, cheapest bound first
_STANDING_STEP = 0.3  # s between two touches by a planted foot

# costs, in one common unit
_INSIDE_COST = 60.0  # per metre of ball inside the body, for 1/30 s
_NEAR, _FIT_COST = 0.25, 3.0  # per metre beyond this distance from its sample, for 1 s
_ASIDE = 0.5  # m from the line of travel up to which a ball without a sample rolls free of that cost
_BESIDE, _AHEAD_COST = 0.3, 4.0  # per metre less than this ahead of the pelvis, for 1 s
_TOUCH_COST, _LONG, _LONG_COST = 0.04, 0.7, 4.0  # per touch, and per second beyond this to the next touch
# A faster player knocks the ball farther ahead and reaches it after more steps, with a foot that is on its way back to
# the ground but still moves forward over it: from _FAST on, for each m/s more, this is added to the values above.
_FAST, _MORE_BESIDE, _MORE_TOUCH_COST, _MORE_LONG, _MORE_RETURNING = 3.0, 0.1, 0.06, 0.12, -0.8
_ACROSS_COST, _BACK_COST, _SPEED_COST, _BRAKE_COST = 0.05, 0.3, 0.05, 0.6  # per m/s that such a foot cannot give
_ANGLE_COST = 0.3  # per radian off straight ahead
_PLANTED_COST = 0.3  # per touch by a planted foot
_HEIGHT_COST = 20.0  # per metre of ball above the foot
_WAIT_COST = 2.5  # per second at an open end without a touch
_MOST_EXTRA = 2.0  # m/s by which a ball may leave faster than its foot, free of cost
_LEAST_EXTRA = 0.5  # m/s by which it may leave slower, free of cost: a foot slows within a frame
_KEPT = 6  # pushes of one swing from which the ball may roll on
_START = -1  # node number of the part's beginning

SLOW = 0.6  # m/s below which the facing counts as the body's direction, not the velocity


@dataclass(frozen=True)
class DribblePart:
    """A part of a dribble without a key moment inside.

    Attributes:
        low: first frame.
        high: last frame.
        is_met_at_start: whether the ball is met at the first frame.
        is_met_at_end: whether the ball is met at the last frame.
    """

    low: int
    high: int
    is_met_at_start: bool
    is_met_at_end: bool


class Legs:
    """The legs of a body over W frames, as obstacles and as feet that touch a ball.

    Attributes:
        pelvis: (W, 2) m, world.
        feet: striking surfaces of the left and right foot.
        lines: per foot both ends (W, 3) m of its surface's line.
        solid: feet, shins and toes' tips, which the ball stays out of.
        velocity: (W, 2) m/s of the pelvis without the sway of steps.
        speed: (W,) m/s of it.
        ahead: (W, 2) unit, direction of travel; the facing where the body is slower than SLOW.
    """

    def __init__(self, skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, fps: float):
        """Compute everything from a motion.

        Args:
            skeleton: the skeleton.
            root: (W, 3) m, world.
            rotations: (W, J, 4) local.
            fps: frames per second.
        """
        places, world = compute_pose(skeleton, root, rotations)
        body, self.fps = identify_joints(skeleton), fps
        self.pelvis = places[:, body.hips, :2]
        self.feet: tuple[Surface, ...] = build_part_surfaces(skeleton, "foot")
        self.lines = [foot.compute_line(places, world) for foot in self.feet]
        self.solid = BodySolid.from_pose(build_leg_surfaces(skeleton), places, world)
        self.velocity = _smooth_velocity(self.pelvis, fps)
        self.speed = np.linalg.norm(self.velocity, axis=1)
        angle = compute_heading_from_positions(skeleton, places)
        facing = np.column_stack([np.cos(angle), np.sin(angle)])
        going = self.velocity / np.maximum(self.speed, 1e-9)[:, None]
        self.ahead = np.where((self.speed > SLOW)[:, None], going, facing)

    def foot_velocity(self, side: int) -> np.ndarray:
        """Compute the velocity (W, 2) m/s of the middle of a foot; side: 0 left, 1 right."""
        middle = np.mean(self.lines[side], axis=0)[:, :2]
        return np.gradient(middle, axis=0) * self.fps


def _smooth_velocity(places: np.ndarray, fps: float) -> np.ndarray:
    """Compute the velocity (W, 2) m/s without the sway of steps (0.6 s Hann window)."""
    return np.gradient(smooth_zero_phase_hann(places, fps, 0.6),
                       axis=0) * fps if len(places) > 2 else np.zeros_like(places)


class DribbleSearch:
    """Search for the touches of one part by dynamic programming.

    A node is a foot, a frame and a side of the ball on which the foot may touch it. A push leads from node to node
    within one swing, a roll from the end of a push to the beginning of another.
    """

    def __init__(self, skeleton, root, rotations, foot_contacts, path, measured, part: DribblePart, fps: float):
        """Take the frames of the part and build the nodes.

        Args:
            skeleton: the skeleton.
            root: (T, 3) m, world.
            rotations: (T, J, 4) local.
            foot_contacts: (T, 2) bool, left and right foot in contact.
            path: (T, 3) m, the ball's centre.
            measured: (T,) bool, False where a sample has no weight.
            part: the frames to search.
            fps: frames per second.
        """
        span = slice(part.low, part.high + 1)
        self.part, self.fps, self.count = part, fps, part.high - part.low + 1
        self.body = Legs(skeleton, root[span], rotations[span], fps)
        self.foot_contacts, self.feed, self.measured = foot_contacts[span], path[span], measured[span]
        self.pushes: list[DribbleTouch] = []
        self.haste = np.maximum(self.body.speed - _FAST, 0.0)  # (W,) m/s
        self._build_nodes()

    def _build_nodes(self) -> None:
        """Build the N nodes, in order of time.

        frame, side, angle, swing, stood: (N,); place (N, 3) m of the ball; normal (N, 2) from foot to ball; velocity
        (N, 2) m/s of the foot; held, touch (N,): cost of the ball there for a frame, and of beginning a touch.
        """
        # one row per frame of each swing and each angle: (frame, side, angle, swing, stood)
        rows = []
        for side, swing in ((side, swing) for side in (0, 1) for swing in self._list_swings(side)):
            rows += [(frame, side, angle, *swing[2:]) for frame in range(*swing[:2]) for angle in range(len(_ANGLES))]
        table = np.array(rows, dtype=int).reshape(-1, 5)
        self.frame, self.side, self.angle, self.swing, self.stood = table.T
        ahead = self.body.ahead[self.frame]
        c, s = np.cos(_ANGLES[self.angle]), np.sin(_ANGLES[self.angle])
        self.normal = np.column_stack([c * ahead[:, 0] - s * ahead[:, 1], s * ahead[:, 0] + c * ahead[:, 1]])
        is_left, ends = self.side[:, None] == 0, zip(*self.body.lines)
        line = [np.where(is_left, left[self.frame], right[self.frame]) for left, right in ends]
        # the ball touches the foot on the ray from `start` along the node's normal, at the height of a ball on the
        # ground
        start = line[0] + _ALONG * (line[1] - line[0])
        start[:, 2] = BALL_RADIUS
        radius = self.body.feet[0].radius
        level = np.column_stack([self.normal, np.zeros(len(table))])
        self.place = find_touching_places((line[0][:, None], line[1][:, None]), radius, start, level)
        usable = np.abs(find_nearest_point(line, self.place)[:, 2] - BALL_RADIUS) <= _LEVEL
        velocity = np.stack([self.body.foot_velocity(0), self.body.foot_velocity(1)])
        self.velocity = velocity[self.side, self.frame]
        forward = np.sum((self.velocity - self.body.velocity[self.frame]) * ahead, axis=1)
        # a foot in the air has to swing forward; a planted foot always counts
        returning = _RETURNING + _MORE_RETURNING * self.haste[self.frame]
        usable &= (forward > returning) | (self.stood > 0)
        usable &= self.body.solid.measure_gaps(self.place, self.frame) > -_DEEPEST
        self._keep_nodes(usable)
        self.held = self._evaluate_places(self.place, self.frame)
        self.touch = _TOUCH_COST + _ANGLE_COST * np.abs(_ANGLES[self.angle]) + _PLANTED_COST * self.stood
        self.touch += _MORE_TOUCH_COST * self.haste[self.frame]

    def _keep_nodes(self, usable: np.ndarray) -> None:
        """Keep the usable nodes, sorted by frame (ties in the order they were built)."""
        order = np.flatnonzero(usable)
        order = order[np.argsort(self.frame[order], kind="stable")]
        for name in ("frame", "side", "angle", "swing", "stood", "normal", "place", "velocity"):
            setattr(self, name, getattr(self, name)[order])

    def _list_swings(self, side: int) -> list[tuple[int, int, int, int]]:
        """List the swings of a foot as (first, end, number, 0), while it is ahead of the pelvis and not in contact.

        Where the player hardly moves, frames in contact are added as (frame, frame + 1, number, 1): there the foot may
        touch the ball without a swing. Numbers are unique over both feet.
        """
        middle = np.mean(self.body.lines[side], axis=0)[:, :2]
        is_ahead = np.einsum("wk,wk->w", middle - self.body.pelvis, self.body.ahead) > _BEHIND
        air = [(first, end, 2 * number + side, 0) for number,
               (first, end) in enumerate(find_runs(is_ahead & ~self.foot_contacts[:, side]))]
        step = max(int(_STANDING_STEP * self.fps), 1)
        still = [f for f in range(0, self.count, step) if self.foot_contacts[f, side] and self.body.speed[f] < SLOW]
        return [*air, *((frame, frame + 1, 2 * (self.count + frame) + side, 1) for frame in still)]

    def _evaluate_places(self, balls: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """Compute what it costs that balls are at places.

        Args:
            balls: (N, 3) m, centres.
            frames: (N,) frame of each.
        Returns:
            (N,) cost for one frame each: distance from the sample or, without one, from the line of travel; too little
            lead on the pelvis, depth inside the body.
        """
        off = balls[:, :2] - self.feed[frames, :2]
        away, travel = balls[:, :2] - self.body.pelvis[frames], self.body.ahead[frames]
        ahead, aside = np.einsum("nk,nk->n", away, travel), away[:, 1] * travel[:, 0] - away[:, 0] * travel[:, 1]
        fit = _FIT_COST * np.where(self.measured[frames], np.maximum(np.hypot(off[:, 0], off[:, 1]) - _NEAR, 0.0),
                                   np.maximum(np.abs(aside) - _ASIDE, 0.0))
        least = _BESIDE + _MORE_BESIDE * self.haste[frames]
        beside = _AHEAD_COST * np.maximum(least - ahead, 0.0)
        inside = _INSIDE_COST * _RATE * np.maximum(-self.body.solid.measure_gaps(balls, frames), 0.0)
        return (fit + beside + inside) / self.fps

    def run(self) -> tuple[int, int, np.ndarray] | None:
        """Run the search; afterwards `pushes` holds the touches.

        Returns:
            First and last frame, counted from the part's, and the path (last - first + 1, 3) m between them; None where
            no foot comes near the ball.
        """
        count = len(self.frame)
        # per node: lowest cost of a roll that ends here, and the node where that roll began
        self.roll_cost, self.roll_source = np.full(count, np.inf), np.full(count, _START)
        # per node: lowest cost of a push that ends here, and the node where that push began
        self.push_cost, self.push_source = np.full(count, np.inf), np.full(count, _START)
        self.arrival_velocity = np.zeros((count, 2))  # m/s of the ball at the end of the cheapest roll
        self.best_cost, self.last_node = np.inf, _START
        self.sources = [_START] if self.part.is_met_at_start else []
        if not count:  # no foot comes near: the ball rolls from end to end, if it is met at both
            return self._trace_path() if self.part.is_met_at_start and self.part.is_met_at_end else None
        if not self.part.is_met_at_start:
            # an open beginning: any touch soon after it may be the first; before that the ball follows the samples
            soon = np.flatnonzero(self.frame <= max(_FROM_END * self.fps, self.frame[0]))
            self.roll_cost[soon] = _WAIT_COST * self.frame[soon] / self.fps + _FIT_COST * self._sample_distance(soon)
            self.roll_cost[soon] += np.append(0.0, np.cumsum(self._evaluate_samples()))[self.frame[soon]]
        # nodes are sorted by frame, so all rolls and pushes into a node come from nodes that are complete
        for frame in sorted(set(self.frame.tolist())):
            here = np.flatnonzero(self.frame == frame)
            self._find_rolls(here, frame)
            for node in here.tolist():
                self._find_push(node)
                self._keep_source(node)
        self._find_end()
        return self._trace_path() if np.isfinite(self.best_cost) else None

    def _keep_source(self, node: int) -> None:
        """Keep a node as a source of rolls if its push is among the best _KEPT of its swing so far."""
        swing = [other for other in self.sources if other != _START and self.swing[other] == self.swing[node]]
        if len(swing) == _KEPT:
            worst = max(swing, key=lambda other: self.push_cost[other])
            if self.push_cost[node] >= self.push_cost[worst]:
                return
            self.sources.remove(worst)
        if np.isfinite(self.push_cost[node]):
            self.sources.append(node)

    def _sample_distance(self, nodes) -> np.ndarray:
        """Measure the distance (N,) m from the ball's sample to where a foot has the ball."""
        return np.linalg.norm(self.place[nodes, :2] - self.feed[self.frame[nodes], :2], axis=-1)

    def _evaluate_samples(self) -> np.ndarray:
        """Compute the cost (W,) of a ball that follows its samples."""
        return self._evaluate_places(self.feed, np.arange(self.count))

    def _find_end(self) -> None:
        """Find the cheapest end: a roll to where the ball is met, or, at an open end, any touch near it."""
        if self.part.is_met_at_end:
            sources = self._list_sources(self.count - 1)
            if len(sources):
                costs, origins, _ = self._find_cheapest_rolls(sources, self.feed[-1:], self.count - 1)
                self.best_cost, self.last_node = costs[0], origins[0]
            return
        left = (self.count - 1 - self.frame) / self.fps
        # after[n]: cost of following the samples from the frame behind node n to the end
        after = np.append(np.cumsum(self._evaluate_samples()[::-1])[::-1], 0.0)[self.frame + 1]
        whole = self.push_cost + after + _WAIT_COST * left + _FIT_COST * self._sample_distance(slice(None))
        whole = np.where(left <= max(_FROM_END, left[-1]), whole, np.inf)
        if len(whole):
            self.best_cost, self.last_node = whole.min(), int(np.argmin(whole))

    def _find_push(self, node: int) -> None:
        """Find the cheapest push that ends here: the ball has just rolled here, or has been pushed for a few frames."""
        longest = int(_PUSH_SECONDS * self.fps)
        ago = self.frame[node] - self.frame
        since = np.flatnonzero(self._is_same_touch(node) & (ago >= 0) & (ago <= longest))[::-1]
        since = since[ago[since] == np.arange(len(since))]  # same foot, side and swing, no frame missing, newest first
        # a push that began `k` frames ago costs the roll into it, k + 1 held frames, and one touch
        costs = self.roll_cost[since] + np.cumsum(self.held[since]) + self.touch[node]
        best = int(np.argmin(costs))
        self.push_cost[node], self.push_source[node] = costs[best], since[best]

    def _is_same_touch(self, node: int) -> np.ndarray:
        """Return (N,) bool: nodes with the same foot, swing and side of the ball as this one."""
        return (self.side == self.side[node]) & (self.angle == self.angle[node]) & (self.swing == self.swing[node])

    def _choose_longest(self, frame: int) -> float:
        """Choose how long a roll that ends at a frame may take, in seconds, free of cost."""
        return _LONG + _MORE_LONG * self.haste[frame]

    def _list_sources(self, frame: int) -> np.ndarray:
        """List the nodes from which the ball may roll to a frame: those within _LATEST, or else the latest ones."""
        found = np.array(self.sources, dtype=int)
        since = frame - np.where(found == _START, 0, self.frame[found])
        enough = since >= SOONEST * self.fps
        soon = enough & (since <= (_LATEST + self._choose_longest(frame)) * self.fps)
        return found[soon if soon.any() else enough & (since == since[enough].min(initial=frame + 1))]

    def _find_rolls(self, nodes: np.ndarray, frame: int) -> None:
        """Find the cheapest rolls that end in `nodes`, all of one frame."""
        sources = self._list_sources(frame)
        if not len(sources):
            return
        costs, origins, arrives = self._find_cheapest_rolls(sources, self.place[nodes], frame, self.swing[nodes])
        better = costs < self.roll_cost[nodes]
        self.roll_cost[nodes[better]], self.roll_source[nodes[better]] = costs[better], origins[better]
        self.arrival_velocity[nodes[better]] = arrives[better]

    def _find_cheapest_rolls(self, sources: np.ndarray, ends: np.ndarray, frame: int, swing: np.ndarray | None = None):
        """Find the cheapest roll to each of several ends.

        The cost beside the trajectory is computed for all rolls; it is a lower bound. The trajectory only adds to it,
        and is evaluated for the cheapest bounds, _AT_ONCE at a time, until no other roll can be cheaper.

        Args:
            sources: (S,) nodes where a roll may begin.
            ends: (N, 3) m.
            frame: the frame of all ends.
            swing: (N,) swing of each end; a roll never ends in the swing it began in.
        Returns:
            (N,) cost, (N,) source and (N, 2) m/s of the ball at the end.
        """
        starts = np.where((sources == _START)[:, None], self.feed[0], self.place[sources])
        frames = frame - np.where(sources == _START, 0, self.frame[sources])
        speeds = compute_roll_speeds(starts[:, None], ends, frames[:, None] / self.fps)
        least = np.where(sources == _START, 0.0, self.push_cost[sources])[:, None] + self._evaluate_launch(sources,
                speeds.start_velocity)
        least += _LONG_COST * np.maximum(frames / self.fps - self._choose_longest(frame), 0.0)[:, None]
        if swing is not None:
            least[(self.swing[sources][:, None] == swing) & (sources != _START)[:, None]] = np.inf
        order = np.argsort(least, axis=0, kind="stable")
        every = np.arange(len(ends))
        costs, origins = np.full(len(ends), np.inf), np.full(len(ends), _START)
        arrives = np.zeros((len(ends), 2))
        for first in range(0, len(sources), _AT_ONCE):
            # tried (_AT_ONCE, N): row r holds for each end the source with its next lowest bound
            tried = order[first : first + _AT_ONCE]
            target, row = np.tile(every, len(tried)), tried.ravel()
            hopeful = least[row, target] < costs[target]
            target, row = target[hopeful], row[hopeful]
            if not len(row):
                break
            whole = least[row, target] + self._evaluate_rolls(starts[row], ends[target], frame - frames[row],
                                                              frames[row])
            # from the most expensive to the cheapest, so that the cheapest is written last
            for one in np.argsort(whole, kind="stable")[::-1]:
                if whole[one] < costs[target[one]]:
                    costs[target[one]], origins[target[one]] = whole[one], sources[row[one]]
                    arrives[target[one]] = speeds.end_velocity[row[one], target[one]]
        return costs, origins, arrives

    def _evaluate_rolls(self, starts: np.ndarray, ends: np.ndarray, since: np.ndarray,
                        frames: np.ndarray) -> np.ndarray:
        """Compute the cost (P,) of the trajectories of P rolls.

        Args:
            starts: (P, 3) m.
            ends: (P, 3) m.
            since: (P,) frame where each begins.
            frames: (P,) number of frames that each takes.
        """
        rolled = simulate_rolls(starts, ends, frames, self.fps)
        # all frames strictly between the ends, as (roll, step) pairs; `bincount` adds their costs up per roll
        pair, step = np.nonzero(np.arange(1, frames.max() + 1) < frames[:, None])
        passed = self._evaluate_places(rolled.balls[pair, step], since[pair] + 1 + step)
        return np.bincount(pair, passed, len(frames)) + _HEIGHT_COST * rolled.height_error

    def _evaluate_launch(self, sources: np.ndarray, leaves: np.ndarray) -> np.ndarray:
        """Compute what it costs that feet, as they move, send the ball off with the velocities `leaves`.

        Args:
            sources: (S,) nodes; no cost where the ball was met (_START).
            leaves: (S, N, 2) m/s.
        Returns:
            (S, N) cost.
        """
        normal = self.normal[sources][:, None]
        change = leaves - self.arrival_velocity[self.push_source[sources]][:, None]
        # split the change of velocity into the part along the foot's normal and the part across it
        pushed = np.sum(change * normal, axis=-1)
        across = np.linalg.norm(change - pushed[..., None] * normal, axis=-1)
        extra = np.sum(leaves * normal, axis=-1) - self._push_speed(sources)[:, None]
        costs = (
            _ACROSS_COST * across + _BACK_COST * np.maximum(-pushed, 0.0)
            + _SPEED_COST * np.maximum(extra - _MOST_EXTRA, 0.0) + _BRAKE_COST * np.maximum(-extra - _LEAST_EXTRA, 0.0)
        )  # fmt: skip
        return np.where((sources == _START)[:, None], 0.0, costs)

    def _push_speed(self, nodes: np.ndarray) -> np.ndarray:
        """Compute the speed (S,) m/s at which feet push the ball away: the foot's, or the ball's over the push."""
        speed = np.sum(self.velocity[nodes] * self.normal[nodes], axis=-1)
        push_start = self.push_source[nodes]
        frames = np.maximum(self.frame[nodes] - self.frame[push_start], 1)
        distance = np.sum((self.place[nodes] - self.place[push_start])[:, :2] * self.normal[nodes], axis=-1)
        return np.where(push_start == nodes, speed, np.maximum(speed, distance * self.fps / frames))

    def _trace_path(self) -> tuple[int, int, np.ndarray]:
        """Trace the cheapest path back from its end and collect the pushes."""
        path = np.array(self.feed)
        last = self.count - 1 if self.part.is_met_at_end else int(self.frame[self.last_node])
        node, (to, there) = self.last_node, (last, self.feed[-1]) if self.part.is_met_at_end else (None, None)
        while True:
            frame = 0 if node == _START else int(self.frame[node])
            place = self.feed[0] if node == _START else self.place[node]
            # the roll from this push to the one behind it fills the frames between
            if to is not None:
                rolled = simulate_rolls(place[None], there[None], np.array([to - frame]), self.fps).balls[0]
                path[frame + 1 : to] = rolled[: to - frame - 1]
            if node == _START:
                return 0, last, path[: last + 1]
            # go back to the start of this push, then to the node from which the ball rolled here
            entered = int(self.push_source[node])
            first = int(self.frame[entered])
            held = np.flatnonzero(self._is_same_touch(node) & (self.frame >= first) & (self.frame <= frame))
            path[self.frame[held]] = self.place[held]
            self.pushes.insert(0, DribbleTouch(first, frame, ("left", "right")[self.side[node]]))
            to, there = first, self.place[entered]
            node = int(self.roll_source[entered])
            if node == _START and not self.part.is_met_at_start:
                return first, last, path[first : last + 1]
