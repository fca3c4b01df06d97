"""Small extra steps: a foot that would be dragged along while it stands is lifted and set down anew instead.

No player stands as still as a recording of standing: tracked ones creep at 0.1 to 0.5 m/s and turn after the ball. Laid on
such a track, feet that stand would slide or turn on the spot, or the legs would lean further and further after a body on
rails. Where that is more than STRIDE or TURN allow, the stance is broken: the foot is lifted for some tenths of a second
while the other one stands, and `foot_plant` sets it down where the body will be in the middle of the stance that follows.
Left and right take turns, since each step resets what its foot lags behind. Where nothing drags nothing is done. Where the
other foot is in the air for too long to step, and only gently so, its own lift is left out: it stays down, and steps when
it is due.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..motion import quaternion
from ..motion.humanoid import Limb, identify
from ..motion.motion import pose_kinematics
from ..motion.skeleton import Skeleton
from ..motion.track import zero_phase_hann
from .reach import two_bone

SPEED = np.array([0.05, 0.3, 0.8, 1.5])
STRIDE = np.array([0.12, 0.25, 0.40, 0.45])
TURN = np.array([0.28, 0.35, 0.45, 0.60])
SWING = np.array([0.45, 0.38, 0.32, 0.30])
"""By the body's speed in m/s: metres that a foot is dragged, and radians that it is turned, from the beginning of a stance
to its end before a step is taken, and the step's seconds. At 0.3 m/s that makes 1.5 steps a second."""

SPARED = 1.15
"""Times STRIDE and TURN that a stance is let drag before it is broken."""

LEAST_SWING = 0.26
"""Seconds of the quickest step, where there is no time for more."""

HEEL_OFF, TOE_ON = 0.06, 0.03
"""Seconds of a step in which the heel leaves the ground before the toe, and in which the toe is down again."""

LATE = 1.3
"""Times STRIDE and TURN that a foot may lag before a lift of the other one is left out so that it can step sooner."""

CLEARLY = 0.3
"""By how much one of two feet has to lag more to go first."""

SETTLED = 0.04
"""Seconds that a foot stands at least before the other one is lifted, and after it is down again."""

SHORTEST = 0.2
"""Seconds that are left of a stance at least on either side of a step."""

APART = 0.11
"""Metres between the ankles that feet on their way past each other keep."""

LIFT = 0.045
"""Metres that a foot is lifted."""

HEEL_UP, TOE_UP = 0.22, 0.06
"""Radians: heel over toe after lifting, toe over heel before landing."""

SWAY = 0.012
"""Metres that the pelvis goes over to the foot that stands."""

GENTLE_SPEED, GENTLE_HEIGHT, GENTLE_SECONDS = 0.6, 0.16, 1.5
"""m/s of the body up to which a lift may be left out, metres that the ankle rises in it, and its seconds."""

UPRIGHT = 0.75
"""Of the usual height of the root: who is lower crouches, kneels or lies, and takes no steps."""

_LEFT, _RIGHT, _ROUNDS = 0, 1, 6


@dataclass(frozen=True, eq=False)
class Steps:
    """What plants and labels feet. rotations (T, J, 4) local, with lifts left out; standing (T, 2, 2) bool: heels and toes
    that stand now; contacts (T, 2) bool: feet that stand flat, as they did in the source; stepped (T, 2) bool: feet in an
    extra step, from heel to heel; moves (T, 2, 4): metres by which each foot is moved, and radians that its heel is up about its toe; sway
    (T, 2) m of the pelvis."""

    rotations: np.ndarray
    standing: np.ndarray
    contacts: np.ndarray
    stepped: np.ndarray
    moves: np.ndarray
    sway: np.ndarray

    @staticmethod
    def none(rotations: np.ndarray, standing: np.ndarray) -> Steps:
        """No steps at all; rotations (T, J, 4), standing (T, 2, 2) bool."""
        count = len(standing)
        nothing = np.zeros((count, 2))
        return Steps(
            rotations, standing, standing.all(axis=2), nothing.astype(bool), np.zeros((count, 2, 4)), nothing
        )


def steps(
    skeleton: Skeleton,
    root: np.ndarray,
    rotations: np.ndarray,
    standing: np.ndarray,
    fps: float,
    given: np.ndarray | None = None,
    free: np.ndarray | None = None,
) -> Steps:
    """The extra steps of a motion laid out on the ground.

    root (T, 3) m and rotations (T, J, 4) local; standing (T, 2, 2) bool of heels and toes, left and right. given (T, 2) bool:
    steps that are taken already, `free` (T,) bool: where others may be added (everywhere).
    """
    none = Steps.none(rotations, standing)
    if len(root) < 2:
        return none
    body = identify(skeleton)
    places, world = pose_kinematics(skeleton, root, rotations)
    heading = np.unwrap(quaternion.yaw(rotations[:, 0]))
    feet = [_Foot.laid(places, world, limb, root, heading, standing[:, side]) for side, limb in enumerate((body.left, body.right))]
    upright = root[:, 2] > UPRIGHT * np.median(root[:, 2])
    speed = np.linalg.norm(np.gradient(zero_phase_hann(root[:, :2], fps, 1.0), axis=0), axis=1) * fps
    stepped = none.stepped if given is None else given
    plan = _Plan(feet, stepped, speed, fps, upright if free is None else free & upright)
    plan.run()
    for foot in plan.feet:
        rotations = foot.held_down(skeleton, root, rotations)
    stands = np.stack([standing[:, side] | foot.held[:, None] for side, foot in enumerate(plan.feet)], axis=1)
    stepped = stepped | plan.stepped
    swings = _swings(stepped, fps)
    moves, sway = _shape(stepped, swings, root[:, :2], np.stack([foot.middle for foot in plan.feet], axis=1), fps)
    across = (places[:, body.left.upper_leg] - places[:, body.right.upper_leg])[:, :2]
    moves[..., :2] = _apart(plan, stepped, across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-9))
    return Steps(rotations, stands & ~swings[:, :, None], none.contacts & ~stepped, stepped, moves, sway)


@dataclass(frozen=True, eq=False)
class _Foot:
    """One foot where the motion has it. ankle (T, 3) m and toe (T, 3) m; world (T, 4) its rotation; yaw (T,) its direction,
    radians, unwrapped; root (T, 3) m and heading (T,) of the body; stands, flat and held (T,) bool: on the ground, with heel
    and toe, and kept there through a lift that is left out."""

    limb: Limb
    ankle: np.ndarray
    toe: np.ndarray
    world: np.ndarray
    yaw: np.ndarray
    root: np.ndarray
    heading: np.ndarray
    stands: np.ndarray
    flat: np.ndarray
    held: np.ndarray

    @classmethod
    def laid(cls, places, world, limb: Limb, root, heading, standing) -> _Foot:
        ankle, toe, turn = places[:, limb.foot], places[:, limb.toe_or_foot], world[:, limb.foot]
        along = toe - ankle if limb.toe is not None else quaternion.rotate(turn, np.array([1.0, 0.0, 0.0]))
        yaw = np.unwrap(np.arctan2(along[:, 1], along[:, 0]))
        stands = standing.any(axis=1)
        return cls(limb, ankle, toe, turn, yaw, root, heading, stands, standing.all(axis=1), np.zeros(len(stands), bool))

    @property
    def middle(self) -> np.ndarray:
        """(T, 2) m on the ground."""
        return 0.5 * (self.ankle + self.toe)[:, :2]

    @property
    def points(self) -> np.ndarray:
        """(T, 2, 2) m of ankle and toe on the ground."""
        return np.stack([self.ankle, self.toe], axis=1)[..., :2]

    def with_lift_left_out(self, first: int, end: int, reach: int) -> _Foot:
        """The foot on the ground in frames first .. end too, carried along by the body from where it stood to where it will
        stand, if it does; `reach`: frames by which that may begin sooner and end later, so that it stands flat there."""
        first, end = self._flat_before(first, reach), self._flat_behind(end, reach)
        at, through = np.arange(first, end), _through(first, end)
        through = (through * through * (3.0 - 2.0 * through))[:, None]
        edges = (first - 1, end if end < len(self.yaw) else first - 1)
        new = {}
        for name in ("ankle", "toe"):
            a, b = (self._in_body(getattr(self, name), edge) for edge in edges)
            way = a + through * (b - a)
            new[name] = getattr(self, name).copy()
            new[name][at] = quaternion.rotate(quaternion.about_up(self.heading[at]), way) + self.root[at] * [1.0, 1.0, 0.0]
        a, b = (quaternion.multiply(quaternion.about_up(-self.heading[edge]), self.world[edge]) for edge in edges)
        count = len(at)
        between = quaternion.slerp(np.tile(a, (count, 1)), np.tile(b, (count, 1)), through[:, 0])
        new["world"] = self.world.copy()
        new["world"][at] = quaternion.multiply(quaternion.about_up(self.heading[at]), between)
        own = (self.yaw - self.heading)[list(edges)]
        change = (own[1] - own[0] + np.pi) % (2.0 * np.pi) - np.pi
        new["yaw"] = self.yaw.copy()
        new["yaw"][at] = self.heading[at] + own[0] + through[:, 0] * change
        new["yaw"][end:] += own[0] + change - own[1]
        for name in ("stands", "flat", "held"):
            new[name] = getattr(self, name).copy()
            new[name][at] = True
        return replace(self, **new)

    def _in_body(self, places: np.ndarray, frame: int) -> np.ndarray:
        away = places[frame] - self.root[frame] * [1.0, 1.0, 0.0]
        return quaternion.rotate(quaternion.about_up(-self.heading[frame]), away)

    def _flat_before(self, first: int, reach: int) -> int:
        low = max(first - reach, 0)
        flat = np.flatnonzero(self.flat[low:first] & self.stands[low:first])
        return low + int(flat[-1]) + 1 if len(flat) else first

    def _flat_behind(self, end: int, reach: int) -> int:
        flat = np.flatnonzero(self.flat[end : end + reach])
        return end + int(flat[0]) if len(flat) else end

    def held_down(self, skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray) -> np.ndarray:
        """Local rotations (T, J, 4) with the leg bent so that the foot is here where it is held."""
        at = np.flatnonzero(self.held)
        if not len(at):
            return rotations
        chain = (self.limb.upper_leg, self.limb.lower_leg, self.limb.foot)
        reached = two_bone(skeleton, root[at], rotations[at], chain, self.ankle[at], end_rotation=self.world[at])
        out = rotations.copy()
        out[at] = reached.rotations
        return quaternion.continuous(out)


class _Plan:
    """Steps chosen one after the other, always the earliest: `feet`, `stands` and `stepped` (T, 2) are what has come of it."""

    def __init__(self, feet: list[_Foot], given: np.ndarray, speed: np.ndarray, fps: float, free: np.ndarray):
        self.feet, self.speed, self.fps = feet, speed, fps
        self.stands = np.stack([foot.stands for foot in feet], axis=1) & ~given
        self.stepped, self.lag = np.zeros_like(self.stands), np.zeros(self.stands.shape)
        self.free_until = _until(free)
        self.swing = np.maximum(np.rint(np.interp(speed, SPEED, SWING) * fps).astype(int), 3)
        self.settled, self.shortest, self.least = (
            max(1, int(round(seconds * fps))) for seconds in (SETTLED, SHORTEST, LEAST_SWING)
        )
        self.turn = np.interp(speed, SPEED, TURN)
        self.stride = np.minimum(np.interp(speed, SPEED, STRIDE), self._room())
        self.left = [self._dragged(side, 0) for side in (_LEFT, _RIGHT)]

    def _room(self) -> np.ndarray:
        """(T,) m that a stride may be long without one foot coming nearer than APART to the other, to either side of which
        it is half a stride away as the body drifts."""
        left, right = (foot.middle for foot in self.feet)
        width, drift = left - right, np.gradient(zero_phase_hann(0.5 * (left + right), self.fps, 1.0), axis=0)
        drift /= np.maximum(np.linalg.norm(drift, axis=1, keepdims=True), 1e-9)
        along = np.abs(np.sum(width * drift, axis=1))
        across = np.abs(width[:, 0] * drift[:, 1] - width[:, 1] * drift[:, 0])
        room = 2.0 * (along - np.sqrt(np.maximum(APART**2 - across**2, 0.0)))
        return np.where(across > APART, np.inf, np.maximum(room, STRIDE[0]))

    def _dragged(self, side: int, now: int) -> list[tuple[int, int]]:
        """Stances (first, end) from `now` on that drag too far, the first one first; notes how far each frame's foot lags."""
        return [
            (first, end)
            for first, end in _runs(self.stands[:, side])
            if self._drag(side, first, end) > SPARED and end > now
        ]

    def _drag(self, side: int, first: int, end: int) -> float:
        """How far the foot would lag at most in frames first .. end, 1 where a step is due."""
        at, foot = slice(first, end), self.feet[side]
        away = np.hypot(*(foot.middle[at] - foot.middle[first]).T) / self.stride[at]
        self.lag[at, side] = np.hypot(away, (foot.yaw[at] - foot.yaw[first]) / self.turn[at])
        return float(self.lag[at, side].max(initial=0.0))

    def run(self) -> None:
        """Breaks stances until none drags any more, or none can be broken."""
        now = 0
        while any(self.left):
            chosen = [self._next(side, now) for side in (_LEFT, _RIGHT)]
            side = self._first(chosen)
            stuck = [(self.left[side][0][1], side) for side in (_LEFT, _RIGHT) if self.left[side] and not chosen[side]]
            if stuck and (side is None or min(stuck)[0] <= chosen[side][0]):
                side = min(stuck)[1]
                if not self._hold_other(side, now):
                    self.left[side].pop(0)
            elif self.lag[chosen[side][0], side] <= LATE or not self._hold_other(side, now):
                now = chosen[side][0]
                self._take(side, *chosen[side])

    def _first(self, chosen: list[tuple[int, int] | None]) -> int | None:
        """The foot that steps first, None where none does: the one that is due sooner; but where there is no time for both
        before, the one that lags clearly more by then, or else the one that is behind as the body goes."""
        due = [side for side in (_LEFT, _RIGHT) if chosen[side]]
        if len(due) < 2:
            return due[0] if due else None
        left, right = (found[0] for found in chosen)
        first = min(left, right)
        soon = min(first + int(self.swing[first]), len(self.speed) - 1)
        more = self.lag[soon, _LEFT] - self.lag[soon, _RIGHT]
        if abs(left - right) < self.swing[first] and abs(more) > CLEARLY:
            return _LEFT if more > 0.0 else _RIGHT
        if left == right:
            return _LEFT if self._behind(_LEFT, left) >= 0.0 else _RIGHT
        return _LEFT if left < right else _RIGHT

    def _take(self, side: int, at: int, down: int) -> None:
        _, end = self.left[side].pop(0)
        self.stands[at:down, side], self.stepped[at:down, side], self.lag[at:down, side] = False, True, 0.0
        if down < end and self._drag(side, down, end) > SPARED:
            self.left[side].insert(0, (down, end))

    def _hold_other(self, side: int, now: int) -> bool:
        """Leaves out the first gentle lift of the other foot during this foot's dragged stance; whether there is one."""
        other, (first, end) = 1 - side, self.left[side][0]
        foot, reach = self.feet[other], int(round(0.3 * self.fps))
        for up, down in _runs(~self.stands[:, other] & ~self.stepped[:, other]):
            inside = max(now, 1) <= up < end and down > first
            if inside and self._gentle(foot, up, down) and self.free_until[up] >= down:
                self.feet[other] = foot.with_lift_left_out(up, down, min(reach, up - now))
                self.stands[up:down, other] = True
                self.left[other] = self._dragged(other, now)
                return True
        return False

    def _gentle(self, foot: _Foot, up: int, down: int) -> bool:
        height, ends = foot.ankle[up:down, 2], foot.ankle[[up - 1, min(down, len(self.speed) - 1)], 2]
        return bool(
            down - up <= GENTLE_SECONDS * self.fps
            and self.speed[up:down].max() < GENTLE_SPEED
            and height.max() - ends.min() < GENTLE_HEIGHT
        )

    def _behind(self, side: int, at: int) -> float:
        """How far the foot is behind the other as the body goes."""
        before, after = max(at - 8, 0), min(at + 8, len(self.speed) - 1)
        here, there = self.feet[side].middle, self.feet[1 - side].middle
        return float((there[at] - here[at]) @ (here[after] + there[after] - here[before] - there[before]))

    def _next(self, side: int, now: int) -> tuple[int, int] | None:
        """Frames in which the foot's next dragged stance is to be broken, and in which it stands again; None where there is
        none or it cannot be."""
        if not self.left[side]:
            return None
        first, end = self.left[side][0]
        down = self._down(side, first, end, now)
        places = np.flatnonzero(down - np.arange(first, end) >= self.least)
        if not len(places):
            return None
        lag = self.lag[first:end, side]
        share = lag.max() / np.ceil(lag.max() / SPARED)
        due = np.full(len(lag), share)
        if any(a < end and first < b for a, b in self.left[1 - side][:1]):
            # both lag alike: one goes at half time, so that they take turns
            due *= 0.5 + 0.5 * np.clip(np.abs(lag - self.lag[first:end, 1 - side]) / (0.5 * share), 0.0, 1.0)
        at = int(places[np.argmin(np.abs(places - np.argmax(lag >= due)))])
        return first + at, int(down[at])

    def _down(self, side: int, first: int, end: int, now: int) -> np.ndarray:
        """(end - first,) frame in which a step that begins there would have to be over: the other foot stands firmly as long."""
        at = np.arange(first, end)
        other = self.stands[:, 1 - side]
        until = _until(other)[at]
        until = np.where(until >= len(other), until, until - self.settled)
        last = end - self.shortest if end < len(other) else end
        down = np.minimum.reduce([at + self.swing[first:end], until, self.free_until[at], np.full(len(at), last)])
        early = at < max(now, first + self.shortest if first else 0)
        return np.where(early | ~other[np.maximum(at - self.settled, 0)], at, down)


def _until(flags: np.ndarray) -> np.ndarray:
    """(T + 1,) the first frame from each on in which `flags` (T,) is not set."""
    count = len(flags)
    unset = np.where(flags, count, np.arange(count))
    return np.append(np.minimum.accumulate(unset[::-1])[::-1], count)


def _runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """First frames and ends of the runs in which `flags` (T,) is set."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [tuple(run) for run in edges.reshape(-1, 2).tolist()]


def _apart(plan: _Plan, stepped: np.ndarray, left: np.ndarray) -> np.ndarray:
    """(T, 2, 2) m by which feet that step are set down further apart, so that the left one stays to the left of the right
    one; left (T, 2): that way. A stance's foot stands at the mean of where the body takes it (`foot_plant.shift`)."""
    runs = [_runs(plan.stands[:, side]) for side in (_LEFT, _RIGHT)]
    near = np.pad(stepped, ((1, 1), (0, 0)))
    loose = [[bool(near[a, side] or near[b + 1, side]) for a, b in runs[side]] for side in (_LEFT, _RIGHT)]
    place = [[foot.points[a:b].mean(axis=0) for a, b in runs[side]] for side, foot in enumerate(plan.feet)]
    start = [[p.copy() for p in side] for side in place]
    pairs = [
        (i, j, left[(max(a, c) + min(b, d)) // 2])
        for i, (a, b) in enumerate(runs[_LEFT])
        for j, (c, d) in enumerate(runs[_RIGHT])
        if max(a, c) <= min(b, d) and (loose[_LEFT][i] or loose[_RIGHT][j])
    ]
    for _ in range(_ROUNDS):
        for i, j, way in pairs:
            lacks = APART - float(((place[_LEFT][i] - place[_RIGHT][j]) @ way).min())
            if lacks > 0.0:
                share = lacks / (loose[_LEFT][i] + loose[_RIGHT][j])
                place[_LEFT][i] += share * loose[_LEFT][i] * way
                place[_RIGHT][j] -= share * loose[_RIGHT][j] * way
    out = np.zeros((len(stepped), 2, 2))
    for side in (_LEFT, _RIGHT):
        at = [frame for a, b in runs[side] for frame in (a, b - 1)]
        by = [p - q for p, q in zip(place[side], start[side]) for _ in range(2)]
        for axis in (0, 1) if at else ():
            out[:, side, axis] = np.interp(np.arange(len(out)), at, [value[0, axis] for value in by])
    return out


def _swings(stepped: np.ndarray, fps: float) -> np.ndarray:
    """(T, 2) bool: where the toes are off the ground in steps taken while `stepped` (T, 2)."""
    off, on = int(round(HEEL_OFF * fps)), int(round(TOE_ON * fps))
    out = np.zeros_like(stepped)
    for side in (_LEFT, _RIGHT):
        for first, end in _runs(stepped[:, side]):
            out[first + off : end - on, side] = True
    return out


def _shape(stepped: np.ndarray, swings: np.ndarray, root: np.ndarray, feet: np.ndarray, fps: float):
    """How steps taken while `stepped` (T, 2) look, whose toes are up in `swings` (T, 2): `moves` and `sway` of Steps; root
    (T, 2) m, feet (T, 2, 2) m."""
    moves, sway = np.zeros((len(stepped), 2, 4)), np.zeros((len(stepped), 2))
    early = int(0.2 * fps)
    for side in (_LEFT, _RIGHT):
        for first, end in _runs(stepped[:, side]):
            moves[first:end, side, 3] = _tilt(_through(first, end))
            low, high, middle = max(first - early, 0), min(end + early, len(root)), (first + end) // 2
            over = feet[middle, 1 - side] - root[middle]
            sway[low:high] += SWAY * np.sin(np.pi * _through(low, high))[:, None] ** 2 * over / max(np.linalg.norm(over), 1e-9)
        for first, end in _runs(swings[:, side]):
            rising = np.clip(np.minimum(_through(first, end), 1.0 - _through(first, end)) / 0.45, 0.0, 1.0)
            moves[first:end, side, 2] = LIFT * rising**2 * (3.0 - 2.0 * rising)
    return moves, sway


def _through(first: int, end: int) -> np.ndarray:
    """How far each of frames first .. end is through them, between 0 and 1."""
    return (np.arange(first, end) - first + 1.0) / (end - first + 1.0)


def _tilt(through: np.ndarray) -> np.ndarray:
    """Radians (N,) of heel over toe in a step that has come `through` (N,): the heel leaves first and lands first."""
    return 6.75 * through * (1.0 - through) * (HEEL_UP * (1.0 - through) - TOE_UP * through)
