"""A throw or kick made to hit: the smallest change of a motion with which the ball, as it leaves, flies to its target.

A ball in the hand has the hand's velocity when it leaves; a ball that lies gets its own from the foot that meets it
(`struck`). Both follow from the motion alone, between frames too (`motion.between_frames`), so a ball that is to fly
elsewhere asks for another motion. What people change when they aim comes first and costs little: the body turns, the
ball leaves a few milliseconds earlier or later, the whole movement is a little slower or faster. What is left is a
small smooth shift of the wrist or ankle about that instant (`shift`), which the arm or leg follows by inverse
kinematics. Among all changes with which the ball hits, with drag, lift and gravity as in `ball.physics`, the one that
costs least is found by Newton's method with Lagrange's multipliers; the release is looked for on a grid.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ...errors import InputError
from ...motion import quaternion
from ...motion.between_frames import cubic_at
from ...motion.humanoid import identify
from ...motion.motion import Motion, forward_kinematics, place, pose_kinematics
from ...polish.carry import Body, Resting, arm, leg, limb_carried
from .. import batch
from ..contact import striking_surface
from ..physics import Ball
from .shift import Shifts, shifts_about
from .struck import struck

BEFORE, AFTER = 0.4, 0.4
"""Seconds before and after the release within which a wrist is moved."""
FINE, LITTLE = 0.02, 0.05
"""m of miss and of moved wrist up to which the pace is left as it is."""
CLOSE = 1e-3
"""m from the target at which nothing more is changed."""
# What costs as much as a metre of moved wrist: radians of turning, share of pace, seconds of release, m/s of speed
# that is asked for and of speed that is not, metres of ball.
_TURN, _PACE, _LATER, _SPEED, _OWN_SPEED, _REST = 8.0, 1.5, 1.5, 30.0, 300.0, 10.0
_ROUNDS, _FREE_ROUNDS, _GRID = 12, 2, 41
_STEP = 1e-3  # of frames, metres, m/s and radians, in differences
_NUDGE = np.array([0.005, 0.005, 0.005, 0.2, 0.2, 0.2])  # m, m/s, by which a limb is tried
_ASHORE = 0.8  # m/s, a foot that is slower stands
_LEAST = 3  # frames that a motion needs before and after the release


@dataclass(frozen=True)
class Freedom:
    """What may be changed beside wrist or ankle: turn rad about the start, pace as a share, release s, each to either
    side; `rest`: whether the place of a ball that lies may be chosen. `anchored` leaves all but wrist and release."""

    turn: float = np.radians(15.0)
    pace: float = 0.15
    release: float = 0.02

    @classmethod
    def anchored(cls) -> Freedom:
        """For a motion that is joined to others before and behind: it keeps its place, its facing and its frames."""
        return cls(0.0, 0.0, 0.02)


@dataclass(frozen=True, eq=False)
class Corrected:
    """A motion whose ball hits.

    frame: fractional, at which the ball leaves. position (3,) m, velocity (3,) m/s, spin (3,) rad/s of the ball then.
    seconds: until it is at the target, and miss: m that it passes by. moved: m that the wrist or ankle was moved at
    most, by `shift` (T, 3) m at each frame; turned: rad that the body was turned about its start; pace: the factor on
    its speed; later: s that the ball leaves after it would have at that pace. gap: m between foot and ball, 0 for
    throws.
    """

    motion: Motion
    frame: float
    position: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    seconds: float
    miss: float
    moved: float
    shift: np.ndarray
    turned: float
    pace: float
    later: float
    gap: float = 0.0

    @property
    def missed(self) -> float:
        """m in all, past the target and between foot and ball."""
        return self.miss + self.gap


@dataclass(frozen=True, eq=False)
class InHand:
    """A ball that a hand throws. side: "left" or "right"; grip (3,) m: its centre in the hand joint's own axes;
    spin (3,) rad/s that it leaves with."""

    side: str
    grip: np.ndarray
    spin: np.ndarray = field(default_factory=lambda: np.zeros(3))
    free: int = 0
    gaps: int = 0

    def chain(self, motion: Motion) -> tuple[int, int, int]:
        """Shoulder, elbow, wrist; InputError for a body without them."""
        joints = arm(getattr(identify(motion.skeleton), self.side))
        if None in joints:
            raise InputError("throw", f"a body without a {self.side} arm and hand", "a skeleton with arms and hands")
        return joints

    def points(self, motion: Motion, places: np.ndarray, turns: np.ndarray) -> np.ndarray:
        """(N, 1, 3) m: the ball."""
        hand = self.chain(motion)[2]
        return (places[:, hand] + quaternion.rotate(turns[:, hand], self.grip))[:, None]

    def leaves(self, points, velocities, rest, ball: Ball):
        """Position, velocity and spin (N, 3), and gap (N, 0)."""
        return points[:, 0], velocities[:, 0], np.broadcast_to(self.spin, points[:, 0].shape), points[:, 0, :0]

    def span(self, motion: Motion, frame: float) -> tuple[int, int]:
        """First and last frame at which the wrist may be moved."""
        return int(np.ceil(frame - BEFORE * motion.fps)), int(np.floor(frame + AFTER * motion.fps))

    def rest(self, motion: Motion, frame: float, target: np.ndarray, ball: Ball) -> np.ndarray:
        """A held ball lies nowhere."""
        return np.zeros(3)


@dataclass(frozen=True, eq=False)
class AtFoot:
    """A ball that lies and is kicked. side: "left" or "right"; place (3,) m of its centre, None: where it suits."""

    side: str
    place: np.ndarray | None = None

    @property
    def free(self) -> int:
        """Coordinates of the ball's place that may be chosen."""
        return 2 if self.place is None else 0

    gaps: int = 1

    def chain(self, motion: Motion) -> tuple[int, int, int]:
        """Hip, knee, ankle."""
        return leg(getattr(identify(motion.skeleton), self.side))

    def surface(self, motion: Motion):
        """What strikes."""
        return striking_surface(motion.skeleton, "foot", self.side)

    def points(self, motion: Motion, places: np.ndarray, turns: np.ndarray) -> np.ndarray:
        """(N, 2, 3) m: both ends of the foot's line."""
        return np.stack(self.surface(motion).line(places, turns), axis=1)

    def leaves(self, points, velocities, rest, ball: Ball):
        """Position, velocity and spin (N, 3), and gap (N, 1) m."""
        found = struck(points, velocities, self.radius, rest, ball)
        return rest, found.velocity, found.spin, found.gap[:, None]

    radius: float = 0.05

    def span(self, motion: Motion, frame: float) -> tuple[int, int]:
        """First and last frame of the foot's swing, at most BEFORE and AFTER."""
        first, last = InHand.span(self, motion, frame)
        first, last = max(first, 0), min(last, len(motion) - 1)
        near = replace(motion, root_positions=motion.root_positions[first : last + 1],
                       rotations=motion.rotations[first : last + 1])  # fmt: skip
        middle = self.points(near, *forward_kinematics(near)).mean(axis=1)
        slow = np.linalg.norm(np.gradient(middle, 1.0 / motion.fps, axis=0), axis=-1) < _ASHORE
        before, after = np.flatnonzero(slow[: int(frame) - first]), np.flatnonzero(slow[int(frame) + 2 - first :])
        return (first + int(before[-1]) + 1 if len(before) else first,
                int(frame) + 1 + int(after[0]) if len(after) else last)  # fmt: skip

    def rest(self, motion: Motion, frame: float, target: np.ndarray, ball: Ball) -> np.ndarray:
        """(3,) m: where the ball lies, to begin with."""
        if self.place is not None:
            return np.asarray(self.place, float)
        points, velocities = _carried(self, motion, np.array([frame]))
        middle = points[0].mean(axis=0)
        ahead = (target - middle) * [1.0, 1.0, 0.0]
        ahead /= max(np.linalg.norm(ahead), 1e-9)
        apart, up = self.radius + ball.radius, ball.radius - middle[2]
        level = middle + np.sqrt(max(apart**2 - up**2, 0.25 * apart**2)) * ahead
        return np.array([level[0], level[1], ball.radius])


def corrected(
    motion: Motion, part: InHand | AtFoot, frame: float, target: np.ndarray, ball: Ball,
    freedom: Freedom | None = None, speed: float | None = None,
) -> Corrected:
    """The motion changed so that the ball leaves it about the fractional `frame` and flies through `target` (3,) m.

    speed: m/s wished for as it leaves; it gives way where the body's own is far from it. InputError: a body without
    that limb, a release at the motion's very ends, a target where the ball is.
    """
    freedom = freedom or Freedom()
    target = np.maximum(np.asarray(target, float), [-np.inf, -np.inf, ball.radius])
    part.chain(motion)
    if not _LEAST <= frame <= len(motion) - 1 - _LEAST:
        raise InputError("release", f"frame {frame:.1f} of {len(motion)}", f"at least {_LEAST} frames before and after")
    return _Search(motion, part, float(frame), target, ball, freedom, speed).whole()


def leaving(
    motion: Motion, part: InHand | AtFoot, frame: float, target: np.ndarray, ball: Ball
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position (3,) m, velocity (3,) m/s and spin (3,) rad/s with which the ball leaves the motion as it is, at the
    fractional `frame`; target (3,) m: on which side of the foot a ball lies whose place is free."""
    points, velocities = _carried(part, motion, np.array([frame]))
    rest = part.rest(motion, frame, np.asarray(target, float), ball)
    return tuple(value[0] for value in part.leaves(points, velocities, rest[None], ball)[:3])


def grip_point(motion: Motion, part: InHand | AtFoot, frames: np.ndarray) -> np.ndarray:
    """(N, K, 3) m: the ball in the hand, or the ends of the foot's line, at fractional frames (N,)."""
    root, local = cubic_at(motion, frames)
    return part.points(motion, *pose_kinematics(motion.skeleton, root, local))


def _carried(part, motion: Motion, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, K, 3) m of the part and their velocities (N, K, 3) m/s at fractional frames (N,)."""
    count = len(frames)
    found = grip_point(motion, part, np.concatenate([frames, frames - _STEP, frames + _STEP]))
    return found[:count], (found[2 * count :] - found[count : 2 * count]) * (0.5 * motion.fps / _STEP)


@dataclass(frozen=True, eq=False)
class _Change:
    """What is changed in all: place (3,) m and velocity (3,) m/s of the part at the release, turn rad, pace as a share,
    rest (F,) m of the ball; seconds: until it arrives. As one row (9 + F,)."""

    row: np.ndarray

    @classmethod
    def none(cls, free: int, seconds: float) -> _Change:
        row = np.zeros(9 + free)
        row[-1] = seconds
        return cls(row)

    place = property(lambda self: self.row[0:3])
    velocity = property(lambda self: self.row[3:6])
    turn = property(lambda self: float(self.row[6]))
    pace = property(lambda self: float(self.row[7]))
    rest = property(lambda self: np.append(self.row[8:-1], np.zeros(3 - (len(self.row) - 9))))
    seconds = property(lambda self: float(self.row[-1]))


@dataclass(frozen=True, eq=False)
class _Led:
    """A motion whose limb is led along shifted paths: `window`, the body at the frames of the shifts, and its limb as
    it rests."""

    motion: Motion
    part: InHand | AtFoot
    shifts: Shifts
    window: Body
    limb: Resting

    @classmethod
    def of(cls, motion: Motion, part: InHand | AtFoot, shifts: Shifts) -> _Led:
        first, last = shifts.frames[0], shifts.frames[-1] + 1
        body = Body.posed(motion.skeleton, motion.root_positions[first:last], motion.rotations[first:last])
        return cls(motion, part, shifts, body, Resting.of(body, part.chain(motion)))

    def shifted(self, change: np.ndarray) -> Motion:
        """The motion with another place and velocity (6,) of the part at the release."""
        if not np.any(change):
            return self.motion
        rotations = self.motion.rotations.copy()
        moves = self.shifts.of(change[:3], change[3:])
        rotations[self.shifts.frames] = limb_carried(self.window, self.limb, moves)
        return replace(self.motion, rotations=rotations)

    def follows(self, change: np.ndarray, frame: float, points, velocities) -> tuple[np.ndarray, np.ndarray]:
        """(6, K, 3) each: by how much the part's points and their velocities really move for each m and m/s that is
        asked of them, beside a change (6,) that brings them to `points` and `velocities` (1, K, 3)."""
        found = []
        for number, nudge in enumerate(np.diag(_NUDGE)):
            near = _carried(self.part, self.shifted(change + nudge), np.array([frame]))
            found.append([(new - old)[0] / _NUDGE[number] for new, old in zip(near, (points, velocities))])
        return tuple(np.swapaxes(np.array(found), 0, 1))


def _at_once(count: int) -> tuple[np.ndarray, np.ndarray]:
    """`_Led.follows` of K points that do just what is asked."""
    both = np.repeat(np.eye(6)[:, None, :], count, axis=1)
    return both[..., :3], both[..., 3:]


class _Search:
    """One correction. `frame`: of the motion as it was given."""

    def __init__(self, motion, part, frame, target, ball, freedom: Freedom, speed):
        self.given, self.part, self.asked = motion, part, frame
        self.target, self.ball, self.freedom, self.speed = target, ball, freedom, speed
        self.pivot = motion.root_positions[0] * [1.0, 1.0, 0.0]
        self.bounds = np.zeros(2)

    def whole(self) -> Corrected:
        """First what costs little, then what is left; the pace is changed only where it has to be."""
        tried = []
        for pace in (0.0, self.freedom.pace):
            self.bounds = np.array([self.freedom.turn, pace])
            start = self._start(self.asked)
            change, source = _Change.none(self.part.free, self._seconds(self.given, self.asked, start)), self.asked
            for _ in range(2):
                change, source = self._looked(change, source, start)
            tried.append(self._hit(change, source, start))
            if not self.freedom.pace or (tried[-1].missed < FINE and tried[-1].moved < LITTLE):
                break
        return min(tried, key=lambda found: found.missed + 0.2 * found.moved)

    def _start(self, frame: float) -> np.ndarray:
        return self.part.rest(self.given, frame, self.target, self.ball)

    def _seconds(self, motion: Motion, frame: float, rest) -> float:
        """s until a ball that is not slowed is as far as the target."""
        points, velocities = _carried(self.part, motion, np.array([frame]))
        position, velocity, _, _ = self.part.leaves(points, velocities, rest[None], self.ball)
        way = (self.target - position[0]) * [1.0, 1.0, 0.0]
        far = float(np.linalg.norm(self.target - position[0]))
        if far < 4.0 * self.ball.radius:
            raise InputError("target", f"{far:.2f} m from where the ball leaves", "a target some way off", "move it away")
        along = max(float(velocity[0] @ way) / max(np.linalg.norm(way), 1e-9), 0.3 * np.linalg.norm(velocity[0]), 1.0)
        return float(np.clip(1.05 * far / along, 0.05, 4.0))

    def _moved(self, change: _Change) -> Motion:
        """The motion turned and at its pace."""
        motion = self.given
        if change.pace:
            frames = np.arange(int(np.floor((len(motion) - 1) / (1.0 + change.pace))) + 1) * (1.0 + change.pace)
            root, rotations = cubic_at(motion, frames)
            motion = Motion(motion.skeleton, root, rotations, motion.fps)
        if change.turn:
            turned = self.pivot - quaternion.rotate(quaternion.about_up(np.array(change.turn)), self.pivot)
            motion = place(motion, change.turn, turned)
        return motion

    def _looked(self, change: _Change, source: float, start) -> tuple[_Change, float]:
        """Turn, pace and release that leave least to be moved: all releases on a grid, each with the change that is
        best by the slopes there."""
        motion = self._moved(change)
        within = self.freedom.release * self.given.fps
        sources = np.clip(self.asked + np.linspace(-within, within, _GRID), _LEAST, len(self.given) - 1 - _LEAST)
        points, velocities = _carried(self.part, motion, sources / (1.0 + change.pace))
        now = _Change(np.concatenate([np.zeros(6), change.row[6:]]))
        cost = self._cost(motion, source / (1.0 + change.pace))
        rows, cost = self._best(points, velocities, now, start, cost, _at_once(points.shape[1]))
        cost = cost + ((sources - self.asked) / self.given.fps * _LATER) ** 2
        best = int(np.argmin(cost))
        return _Change(rows[best]), float(sources[best])

    def _hit(self, change: _Change, source: float, start) -> Corrected:
        """Newton's steps with the arm or leg as it follows; the best of them."""
        motion = self._moved(change)
        frame = source / (1.0 + change.pace)
        limb = _Led.of(motion, self.part, shifts_about(frame, *self._span(motion, frame), motion.fps))
        best, base, step = None, change, 1.0
        follows, known = _at_once(grip_point(motion, self.part, np.array([frame])).shape[1]), False
        for number in range(_ROUNDS):
            now = limb.shifted(change.row[:6])
            points, velocities = _carried(self.part, now, np.array([frame]))
            found = self._judged(motion, now, frame, source, change, start, points, velocities)
            better = best is None or found.missed < best.missed
            slow = best is not None and found.missed > 0.1 * best.missed
            if better:
                best, base, step, there = found, change, 1.0, (points, velocities)
            if best.missed < CLOSE:
                break
            if slow and (better or not known):
                follows, known = limb.follows(base.row[:6], frame, *there), True
            if better or slow:
                costs = limb.shifts.cost, follows
                rows, _ = self._best(*there, base, start, *costs, fixed=(6, 7), near=number >= _FREE_ROUNDS)
            step = 1.0 if better else 0.4 * step
            change = _Change(base.row + step * (rows[0] - base.row))
        return best

    def _span(self, motion: Motion, frame: float) -> tuple[int, int]:
        first, last = self.part.span(motion, frame)
        return max(first, 1), min(last, len(motion) - 2)

    def _cost(self, motion: Motion, frame: float) -> np.ndarray:
        return shifts_about(frame, *self._span(motion, frame), motion.fps).cost

    def _arrives(self, points, velocities, turn, pace, rest, seconds):
        """Where the balls (B) are (B, 3) m, their gaps (B, G) and their speeds (B,), for parts turned by `turn` (B,)
        rad and faster by the share `pace` (B,)."""
        about = quaternion.about_up(turn)[:, None]
        points = quaternion.rotate(about, points - self.pivot) + self.pivot
        velocities = quaternion.rotate(about, velocities) * (1.0 + pace)[:, None, None]
        position, velocity, spin, gap = self.part.leaves(points, velocities, rest, self.ball)
        balls = batch.launched(position, velocity, spin, self.ball)
        there = batch.after(balls, self.ball, np.maximum(seconds, 1e-3), most_bounces=0).position
        return there, gap, np.linalg.norm(velocity, axis=-1)

    def _best(
        self, points, velocities, now: _Change, start, cost, follows, fixed=(), near=False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Changes (N, 9 + F) in all, and what they cost (N,), of parts at N releases, of which `now` is changed
        already: the least with which the ball would hit if all went on along its slopes. near: the least away from `now`
        instead, which comes to the target where the slopes do not hold for long."""
        short, slopes, speed, faster = self._slopes(points, velocities, now, start, follows)
        count, size = len(points), len(now.row)
        weight = np.zeros((size, size))
        for axis in range(3):
            weight[np.ix_([axis, 3 + axis], [axis, 3 + axis])] = cost
        weight[6, 6], weight[7, 7] = 1.0 / _TURN**2, 1.0 / _PACE**2
        weight[range(8, size - 1), range(8, size - 1)] = 1.0 / _REST**2
        weight[-1, -1] = 1e-2 if near else 1e-9
        wish, worth = (self.speed, 1.0 / _SPEED**2) if self.speed else (speed, 1.0 / _OWN_SPEED**2)
        hessian = weight + worth * faster[:, :, None] * faster[:, None, :]
        pull = worth * faster * (wish - speed + faster @ now.row)[:, None]
        if near:
            hessian, pull = np.tile(weight, (count, 1, 1)), np.tile(weight @ now.row, (count, 1))
        level = slopes @ now.row - short
        free = [i for i in range(size) if i not in set(fixed) and not (i in (6, 7) and not self.bounds[i - 6])]
        rows = self._least(hessian, pull, slopes, level, np.tile(now.row, (count, 1)), free)
        over = np.abs(rows[:, 6:8]) > self.bounds + 1e-12
        if over.any() and not len(fixed):
            rows[:, 6:8] = np.clip(rows[:, 6:8], -self.bounds, self.bounds)
            again = self._least(hessian, pull, slopes, level, rows, [i for i in free if i not in (6, 7)])
            rows = np.where(over.any(axis=1)[:, None], again, rows)
        gone = np.einsum("ni,ij,nj->n", rows, weight, rows)
        return rows, gone + worth * (speed + np.einsum("ni,ni->n", faster, rows - now.row) - wish) ** 2

    @staticmethod
    def _least(hessian, pull, slopes, level, rows, free) -> np.ndarray:
        """Rows (N, S) with the entries `free` chosen: least u H u / 2 - pull u with slopes u = level."""
        count, size, held = len(rows), len(free), slopes.shape[1]
        rest = rows.copy()
        rest[:, free] = 0.0
        matrix = np.zeros((count, size + held, size + held))
        matrix[:, :size, :size] = hessian[:, free][:, :, free]
        matrix[:, size:, :size] = slopes[:, :, free]
        matrix[:, :size, size:] = np.swapaxes(slopes[:, :, free], 1, 2)
        matrix[:, range(size, size + held), range(size, size + held)] = -1e-12
        right = np.concatenate([
            (pull - np.einsum("nij,nj->ni", hessian, rest))[:, free],
            level - np.einsum("nij,nj->ni", slopes, rest),
        ], axis=1)  # fmt: skip
        out = rest
        out[:, free] = np.linalg.solve(matrix, right[:, :, None])[:, :size, 0]
        return out

    def _slopes(self, points, velocities, now: _Change, start, follows):
        """What is missing (N, 3 + G) to target and contact, how it changes (N, 3 + G, S) with the change, the ball's
        speed (N,) and how that changes (N, S). `points`, `velocities`: as `now` has made them; follows: see `_Led`."""
        count, size = len(points), len(now.row)
        each = size + 1
        nudge = _STEP * np.vstack([np.zeros(size), np.eye(size)])
        nudge = np.tile(nudge, (count, 1))
        spread = [np.repeat(value, each, axis=0) for value in (points, velocities)]
        rest = start + now.rest + np.column_stack([nudge[:, 8:-1], np.zeros((len(nudge), 3 - (size - 9)))])
        there, gap, speed = self._arrives(
            spread[0] + np.tensordot(nudge[:, :6], follows[0], 1), spread[1] + np.tensordot(nudge[:, :6], follows[1], 1),
            nudge[:, 6],
            nudge[:, 7] / (1.0 + now.pace), rest, now.seconds + nudge[:, -1],
        )  # fmt: skip
        missing = np.concatenate([there - self.target, gap], axis=1).reshape(count, each, -1)
        speed = speed.reshape(count, each)
        slopes = np.swapaxes(missing[:, 1:] - missing[:, :1], 1, 2) / _STEP
        return missing[:, 0], slopes, speed[:, 0], (speed[:, 1:] - speed[:, :1]) / _STEP

    def _judged(self, before, now, frame, source, change, start, points, velocities) -> Corrected:
        """What has come of it."""
        rest = (start + change.rest)[None]
        position, velocity, spin, gap = self.part.leaves(points, velocities, rest, self.ball)
        none = np.zeros(1)
        there, _, _ = self._arrives(points, velocities, none, none, rest, np.array([change.seconds]))
        end = self.part.chain(now)[2]
        shift = forward_kinematics(now)[0][:, end] - forward_kinematics(before)[0][:, end]
        return Corrected(
            now, frame, position[0], velocity[0], spin[0], change.seconds,
            float(np.linalg.norm(there[0] - self.target)), float(np.linalg.norm(shift, axis=-1).max()), shift,
            change.turn, 1.0 + change.pace, (source - self.asked) / self.given.fps / (1.0 + change.pace),
            float(np.abs(gap).max(initial=0.0)),
        )  # fmt: skip
