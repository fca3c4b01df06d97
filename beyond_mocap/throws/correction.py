"""Correct a throw or kick so that it hits: the smallest change of a motion with which the ball flies to its target.

A held ball has the velocity of the hand when it leaves; a ball at rest gets its velocity from the foot that strikes
it (`ball_release`). Both follow from the motion alone, between frames too (`sample_frames_cubic`), so another
flight needs another motion. Changes that people make when they aim come first and cost little: the body rotates, the
ball leaves a few milliseconds earlier or later, the whole movement is a little slower or faster. The rest is a small
smooth shift of the wrist or ankle about that instant (`limb_shift`), which the arm or leg follows by inverse
kinematics. Where an ankle would move far, the foot is pointed first (`foot_tilt`). Among all changes with which the
ball hits, with drag, lift and gravity as in `ball.physics`, the one of lowest cost is found by Newton's method with
Lagrange multipliers; the release is searched on a grid.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..ball import batch
from ..ball.physics import Ball
from ..base.errors import InputError
from ..motion import quaternion
from ..motion.motion import Motion, forward_kinematics, place_motion, sample_frames_cubic
from .ball_release import AtFoot, InHand, sample_points, sample_points_and_velocities
from .corrected_motion import CorrectedMotion, Freedom
from .foot_tilt import TILTS, is_above_ground, lift_toe_tip, point_foot
from .limb_shift import LimitRotations, ShiftedLimb, build_exact_response, solve_shifts

HIT_TOLERANCE = 1e-3
"""m from the target at which the correction ends."""
# Changes that cost as much as a metre of wrist displacement: radians of rotation, share of pace, seconds of release,
# m/s of requested speed and of unrequested speed, metres of ball position.
_TURN, _PACE, _DELAY, _SPEED, _OWN_SPEED, _REST = 8.0, 1.5, 1.5, 30.0, 300.0, 10.0
_ROUNDS, _FREE_ROUNDS, _GRID = 12, 2, 41  # Newton steps, those of lowest total cost, releases on the grid
_LINEAR_SEARCHES, _MAX_TRIED = 4, 2  # linear searches for a foot, and candidates that are then solved exactly
_MIN_STEP = 0.05  # share of a Newton step below which the search ends
# m of miss and steps after which the search ends, because only implausible poses are left
_LARGE_MISS, _LARGE_MISS_ROUNDS = 1.0, 4
_STEP = 1e-3  # frames, metres, m/s and radians, steps of numerical derivatives
_MIN_FRAMES = 3  # frames that a motion needs before and after the release


def correct_motion(
    motion: Motion, part: InHand | AtFoot, frame: float, target: np.ndarray, ball: Ball,
    freedom: Freedom | None = None, speed: float | None = None, limit_rotations: LimitRotations | None = None,
) -> CorrectedMotion:
    """Correct a motion so that the ball leaves at about `frame` and flies through the target.

    Args:
        motion: the motion.
        part: hand or foot that releases the ball.
        frame: fractional frame of the release.
        target: (3,) m, world.
        ball: kind of ball.
        freedom: what may be changed; None for the default.
        speed: m/s requested at the release; a soft request if the body's own speed is far from it.
        limit_rotations: limits the rotations of the limb; the ball misses if no motion within the limits hits.
    Raises:
        InputError: if the body lacks the limb, the release is at the motion's very ends, or the target is at the
            ball.
    """
    freedom = freedom or Freedom()
    target = np.maximum(np.asarray(target, float), [-np.inf, -np.inf, ball.radius])
    part.list_joints(motion)
    if not _MIN_FRAMES <= frame <= len(motion) - 1 - _MIN_FRAMES:
        raise InputError("release", f"frame {frame:.1f} of {len(motion)}",
                         f"at least {_MIN_FRAMES} frames before and after")

    def correct(motion: Motion) -> CorrectedMotion:
        return _Search(motion, part, float(frame), target=target, ball=ball, freedom=freedom, speed=speed,
                       limit_rotations=limit_rotations).run()

    if not isinstance(part, AtFoot):
        return correct(motion)
    tried = [correct(motion)]
    for tilt in TILTS:
        if tried[-1].is_small:
            break
        pointed = correct(point_foot(motion, part, frame, tilt, limit_rotations))
        if is_above_ground(pointed.motion, part, pointed.frame):
            tried.append(replace(pointed, tilt=float(tilt)))
    best = min(tried, key=lambda found: found.cost)
    return replace(best, motion=lift_toe_tip(best.motion, part, best.frame))


@dataclass(frozen=True, eq=False)
class _Change:
    """All changes in one row (9 + F,).

    The row contains position (3,) m and velocity (3,) m/s of the part at the release, rotation (rad), pace (share),
    F free coordinates (m) of the ball relative to the body, one of which stays at its place, and the s until the
    ball arrives.
    """

    row: np.ndarray

    @classmethod
    def build_empty(cls, free: int, seconds: float) -> _Change:
        """Build a row without changes."""
        row = np.zeros(9 + free)
        row[-1] = seconds
        return cls(row)

    place = property(lambda self: self.row[0:3])
    velocity = property(lambda self: self.row[3:6])
    rotation = property(lambda self: float(self.row[6]))
    pace = property(lambda self: float(self.row[7]))
    rest = property(lambda self: np.append(self.row[8:-1], np.zeros(3 - (len(self.row) - 9))))
    seconds = property(lambda self: float(self.row[-1]))


class _Search:
    """One correction; `frame` refers to the motion as given."""

    def __init__(self, motion, part, frame, target, ball, freedom: Freedom, speed, limit_rotations):
        self.motion, self.part, self.frame = motion, part, frame
        self.target, self.ball, self.freedom = target, ball, freedom
        self.speed, self.limit_rotations = speed, limit_rotations
        self.pivot = motion.root_positions[0] * [1.0, 1.0, 0.0]
        self.bounds = np.zeros(2)
        self.moves_start = freedom.start_position and not part.free_coordinates and isinstance(part, AtFoot)
        self.free = 2 if self.moves_start else part.free_coordinates
        self._rigid = (6, 7, 8, 9) if self.moves_start else (6, 7)

    def run(self) -> CorrectedMotion:
        """Run the search: first changes of low cost, then the rest; the pace is changed only if necessary."""
        tried = []
        for pace in (0.0, self.freedom.pace):
            self.bounds = np.array([self.freedom.rotation, pace])
            start = self.part.find_rest_position(self.motion, self.frame, self.target, self.ball)
            for change, source in self._list_candidates(start)[:_MAX_TRIED]:
                tried.append(self._solve_hit(change, source, start))
                if tried[-1].is_small:
                    return tried[-1]
            if not self.freedom.pace:
                break
        return min(tried, key=lambda found: found.cost)

    def _list_candidates(self, start) -> list[tuple[_Change, float]]:
        """List changes of low cost with their releases, the one with the smallest remaining displacement first.

        Derivatives are misleading where a foot strikes a ball, so each candidate is evaluated exactly.
        """
        current = _Change.build_empty(self.free, self._estimate_seconds(self.motion, self.frame, start)), self.frame
        found = []
        for _ in range(_LINEAR_SEARCHES if isinstance(self.part, AtFoot) else 2):
            current = self._search_releases(current[0], current[1], start)
            found.append((self._compute_remaining_cost(*current, start), len(found), current))
        return [each for _, _, each in sorted(found, key=lambda one: one[:2])]

    def _compute_remaining_cost(self, change: _Change, source: float, start) -> float:
        """Compute the remaining cost of displacing the limb."""
        motion, frame = self._apply_change(change), source / (1.0 + change.pace)
        points, velocities = sample_points_and_velocities(self.part, motion, np.array([frame]))
        costs = self._compute_cost(motion, frame), build_exact_response(points.shape[1])
        rest = _Change(np.concatenate([np.zeros(6), change.row[6:]]))
        rows, _ = self._find_best_changes(points, velocities, rest, start, *costs, fixed=self._rigid)
        return sum(float(pair @ costs[0] @ pair) for pair in rows[0, :6].reshape(2, 3).T)

    def _estimate_seconds(self, motion: Motion, frame: float, rest) -> float:
        """Estimate the s until a ball without drag is as far away as the target."""
        points, velocities = sample_points_and_velocities(self.part, motion, np.array([frame]))
        position, velocity, _, _ = self.part.compute_launch(points, velocities, rest[None], self.ball)
        direction = (self.target - position[0]) * [1.0, 1.0, 0.0]
        far = float(np.linalg.norm(self.target - position[0]))
        if far < 4.0 * self.ball.radius:
            found = f"{far:.2f} m from where the ball leaves"
            raise InputError("target", found, "a target some distance away", "move it away")
        along = max(float(velocity[0] @ direction) / max(np.linalg.norm(direction), 1e-9),
                    0.3 * np.linalg.norm(velocity[0]), 1.0)
        return float(np.clip(1.05 * far / along, 0.05, 4.0))

    def _apply_change(self, change: _Change) -> Motion:
        """Build the rotated motion at its changed pace."""
        motion = self.motion
        if change.pace:
            frames = np.arange(int(np.floor((len(motion) - 1) / (1.0 + change.pace))) + 1) * (1.0 + change.pace)
            root, rotations = sample_frames_cubic(motion, frames)
            motion = Motion(motion.skeleton, root, rotations, motion.fps)
        if change.rotation:
            turned = self.pivot - quaternion.rotate(quaternion.from_up_angle(np.array(change.rotation)), self.pivot)
            motion = place_motion(motion, change.rotation, turned)
        return place_motion(motion, 0.0, -change.rest) if self.moves_start else motion

    def _search_releases(self, change: _Change, source: float, start) -> tuple[_Change, float]:
        """Find rotation, pace and release with the smallest remaining displacement.

        All releases on a grid are compared, each with the best change according to the derivatives there.
        """
        motion = self._apply_change(change)
        range_frames = self.freedom.release * self.motion.fps
        sources = np.clip(self.frame + np.linspace(-range_frames, range_frames, _GRID), _MIN_FRAMES, len(self.motion)
                          - 1 - _MIN_FRAMES)
        points, velocities = sample_points_and_velocities(self.part, motion, sources / (1.0 + change.pace))
        now = _Change(np.concatenate([np.zeros(6), change.row[6:]]))
        cost = self._compute_cost(motion, source / (1.0 + change.pace))
        rows, cost = self._find_best_changes(points, velocities, now, start=start, cost=cost,
                                             response=build_exact_response(points.shape[1]))
        cost = cost + ((sources - self.frame) / self.motion.fps * _DELAY) ** 2
        best = int(np.argmin(cost))
        return _Change(rows[best]), float(sources[best])

    def _solve_hit(self, change: _Change, source: float, start) -> CorrectedMotion:
        """Take Newton steps with the arm or leg as it really follows; return the best of them."""
        motion = self._apply_change(change)
        frame = source / (1.0 + change.pace)
        limb = ShiftedLimb.from_motion(motion, self.part, solve_shifts(frame, *self._find_frame_range(motion, frame),
                                                                       motion.fps), self.limit_rotations)
        best, base, step = None, change, 1.0
        follows, known = build_exact_response(sample_points(motion, self.part, np.array([frame])).shape[1]), False
        for number in range(_ROUNDS):
            now = limb.shift_motion(change.row[:6])
            points, velocities = sample_points_and_velocities(self.part, now, np.array([frame]))
            found = self._build_result(motion, now, frame, source=source, change=change, start=start, points=points,
                                       velocities=velocities)
            better = best is None or found.total_miss < best.total_miss
            slow = best is not None and found.total_miss > 0.1 * best.total_miss
            if better:
                best, base, best_points = found, change, (points, velocities)
            step = 1.0 if better else 0.4 * step
            is_far = number >= _LARGE_MISS_ROUNDS and best.total_miss > _LARGE_MISS
            if best.total_miss < HIT_TOLERANCE or step < _MIN_STEP or is_far:
                break
            if slow and (better or not known):
                follows, known = limb.measure_response(base.row[:6], frame, *best_points), True
            if better or slow:
                costs = limb.shifts.cost, follows
                rows, _ = self._find_best_changes(*best_points, base, start, *costs, fixed=self._rigid,
                                                  stays_near=number >= _FREE_ROUNDS)
            change = _Change(base.row + step * (rows[0] - base.row))
        return best

    def _find_frame_range(self, motion: Motion, frame: float) -> tuple[int, int]:
        """Return the first and last frame that may be changed, never the ends of the motion."""
        first, last = self.part.find_frame_range(motion, frame)
        return max(first, 1), min(last, len(motion) - 2)

    def _compute_cost(self, motion: Motion, frame: float) -> np.ndarray:
        """Compute the cost (2, 2) of a shift in position and velocity at a frame."""
        return solve_shifts(frame, *self._find_frame_range(motion, frame), motion.fps).cost

    def _predict_arrival(self, points, velocities, turn, pace, rest, seconds):
        """Compute where balls (B) are after `seconds`.

        Args:
            points: (B, K, 3) m of hand or foot.
            velocities: (B, K, 3) m/s.
            turn: (B,) rad by which the parts are rotated.
            pace: (B,) share by which they are faster.
            rest: (B, 3) m, positions of balls at rest.
            seconds: (B,) s.
        Returns:
            Positions (B, 3) m, gaps (B, G) m and initial speeds (B,) m/s.
        """
        about = quaternion.from_up_angle(turn)[:, None]
        points = quaternion.rotate(about, points - self.pivot) + self.pivot
        velocities = quaternion.rotate(about, velocities) * (1.0 + pace)[:, None, None]
        position, velocity, spin, gap = self.part.compute_launch(points, velocities, rest, self.ball)
        count = np.zeros(len(position), int)  # in flight, even below the ground, so that derivatives continue there
        balls = batch.Balls(position.copy(), velocity, np.array(spin), count, count)
        arrival = batch.simulate_balls(balls, self.ball, np.maximum(seconds, 1e-3), most_bounces=0).position
        return arrival, gap, np.linalg.norm(velocity, axis=-1)

    def _find_best_changes(
        self, points, velocities, current: _Change, start, cost, response, fixed=(), stays_near=False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Compute the change of lowest cost with which the ball hits, according to the derivatives, for N releases.

        Args:
            points: (N, K, 3) m of hand or foot, changed by `current`.
            velocities: (N, K, 3) m/s.
            current: present change.
            start: (3,) m of the ball.
            cost: (2, 2) cost of a shift.
            response: response of the limb, see `ShiftedLimb`.
            fixed: indices of the change that stay.
            stays_near: minimise the distance to `current` instead, which converges where the derivatives hold only
                nearby.
        Returns:
            Changes (N, 9 + F), and their costs (N,).
        """
        short, slopes, speed, faster = self._compute_derivatives(points, velocities, current, start, response)
        count, size = len(points), len(current.row)
        # row: 0-2 position, 3-5 velocity, 6 rotation, 7 pace, 8 .. size - 2 ball, size - 1 seconds until arrival
        weight = np.zeros((size, size))
        for axis in range(3):
            weight[np.ix_([axis, 3 + axis], [axis, 3 + axis])] = cost
        weight[6, 6], weight[7, 7] = 1.0 / _TURN**2, 1.0 / _PACE**2
        weight[range(8, size - 1), range(8, size - 1)] = 1.0 / _REST**2
        weight[-1, -1] = 1e-2 if stays_near else 1e-9
        requested_speed, speed_weight = (self.speed, 1.0 / _SPEED**2) if self.speed else (speed, 1.0 / _OWN_SPEED**2)
        hessian = weight + speed_weight * faster[:, :, None] * faster[:, None, :]
        pull = speed_weight * faster * (requested_speed - speed + faster @ current.row)[:, None]
        if stays_near:
            hessian, pull = np.tile(weight, (count, 1, 1)), np.tile(weight @ current.row, (count, 1))
        level = slopes @ current.row - short
        free = [i for i in range(size) if i not in set(fixed) and not (i in (6, 7) and not self.bounds[i - 6])]
        rows = self._solve_least_cost(hessian, pull, slopes, level=level, rows=np.tile(current.row, (count, 1)),
                                      free=free)
        over = np.abs(rows[:, 6:8]) > self.bounds + 1e-12
        if over.any() and not len(fixed):
            rows[:, 6:8] = np.clip(rows[:, 6:8], -self.bounds, self.bounds)
            again = self._solve_least_cost(
                hessian, pull, slopes, level=level, rows=rows, free=[i for i in free if i not in (6, 7)],
            )
            rows = np.where(over.any(axis=1)[:, None], again, rows)
        displacement_cost = np.einsum("ni,ij,nj->n", rows, weight, rows)
        return rows, displacement_cost + speed_weight * (speed + np.einsum("ni,ni->n", faster, rows - current.row)
                                                         - requested_speed) ** 2

    @staticmethod
    def _solve_least_cost(hessian, pull, slopes, level, rows, free) -> np.ndarray:
        """Solve rows (N, S) that minimise u H u / 2 - pull u under slopes u = level; only the entries `free` vary."""
        count, size, constraint_count = len(rows), len(free), slopes.shape[1]
        rest = rows.copy()
        rest[:, free] = 0.0
        # Karush-Kuhn-Tucker system: Hessian, constraints and their transpose, tiny negative diagonal of the multipliers
        matrix = np.zeros((count, size + constraint_count, size + constraint_count))
        matrix[:, :size, :size] = hessian[:, free][:, :, free]
        matrix[:, size:, :size] = slopes[:, :, free]
        matrix[:, :size, size:] = np.swapaxes(slopes[:, :, free], 1, 2)
        matrix[:, range(size, size + constraint_count), range(size, size + constraint_count)] = -1e-12
        right = np.concatenate([
            (pull - np.einsum("nij,nj->ni", hessian, rest))[:, free],
            level - np.einsum("nij,nj->ni", slopes, rest),
        ], axis=1)  # fmt: skip
        out = rest
        out[:, free] = np.linalg.solve(matrix, right[:, :, None])[:, :size, 0]
        return out

    def _compute_derivatives(self, points, velocities, current: _Change, start, response):
        """Compute the errors and their derivatives with respect to the change.

        Args:
            points: (N, K, 3) m, changed by `current`.
            velocities: (N, K, 3) m/s.
            current: present change.
            start: (3,) m of the ball.
            response: response of the limb, see `ShiftedLimb`.
        Returns:
            Errors (N, 3 + G) at target and contact, their derivatives (N, 3 + G, S), the ball's speed (N,) and its
            derivatives (N, S).
        """
        count, size = len(points), len(current.row)
        each = size + 1
        # each release is evaluated size + 1 times: unchanged, then with a step in every entry of the change
        nudge = _STEP * np.vstack([np.zeros(size), np.eye(size)])
        nudge = np.tile(nudge, (count, 1))
        spread = [np.repeat(value, each, axis=0) for value in (points, velocities)]
        away = np.column_stack([nudge[:, 8:-1], np.zeros((len(nudge), 3 - (size - 9)))])
        rest = start + (0.0 * away if self.moves_start else current.rest + away)
        if self.moves_start:
            spread[0] = spread[0] - away[:, None]
        places, speeds = (value + np.tensordot(nudge[:, :6], part, 1) for value, part in zip(spread, response))
        pace, seconds = nudge[:, 7] / (1.0 + current.pace), current.seconds + nudge[:, -1]
        there, gap, speed = self._predict_arrival(places, speeds, nudge[:, 6], pace=pace, rest=rest, seconds=seconds)
        missing = np.concatenate([there - self.target, gap], axis=1).reshape(count, each, -1)
        speed = speed.reshape(count, each)
        slopes = np.swapaxes(missing[:, 1:] - missing[:, :1], 1, 2) / _STEP
        return missing[:, 0], slopes, speed[:, 0], (speed[:, 1:] - speed[:, :1]) / _STEP

    def _build_result(self, before, now, frame, source, change, start, points, velocities) -> CorrectedMotion:
        """Build the result of a change."""
        rest = (start if self.moves_start else start + change.rest)[None]
        position, velocity, spin, gap = self.part.compute_launch(points, velocities, rest, self.ball)
        none = np.zeros(1)
        there, _, _ = self._predict_arrival(points, velocities, none, pace=none, rest=rest,
                                            seconds=np.array([change.seconds]))
        end = self.part.list_joints(now)[2]
        shift = forward_kinematics(now)[0][:, end] - forward_kinematics(before)[0][:, end]
        return CorrectedMotion(motion=now, frame=frame, position=position[0], velocity=velocity[0], spin=spin[0],
                               seconds=change.seconds, miss=float(np.linalg.norm(there[0] - self.target)),
                               displacement=float(np.linalg.norm(shift, axis=-1).max()), shift=shift,
                               rotation=change.rotation, pace=1.0 + change.pace, release_delay=(source - self.frame)
                               / self.motion.fps / (1.0 + change.pace), start_offset=float(np.linalg.norm(change.rest))
                               if self.moves_start else 0.0, gap=float(np.abs(gap).max(initial=0.0)))  # fmt: skip
