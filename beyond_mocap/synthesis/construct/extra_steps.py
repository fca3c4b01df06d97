"""Small extra steps: a foot that would be dragged along in contact is lifted and set down elsewhere instead.

No player stays as still as a recording of standing: tracked players creep at 0.1 to 0.5 m/s and turn after the ball. On
such a track, feet in contact would slide or turn on the spot, or the legs would lean further and further after the
body. Where that is more than STRIDE or TURN allow, the stance is broken: the foot is lifted for some tenths of a second
while the other one is in contact, and `foot_plant` sets it down where the body is in the middle of the stance that
follows. Left and right take turns, since each step resets the lag of its foot. Where the other foot is in the air for
too long to step, and only gently so, its own lift is left out: it stays down, and steps when it is due.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass

import numpy as np

from ...base.easing import smoothstep
from ...base.time_series import find_runs
from ...base.vectors import arctan2, measure_lengths
from ...motion import quaternion
from ...motion.humanoid import Limb, identify_joints, pose_legs
from ...motion.limb import solve_two_bone
from ...motion.skeleton import Skeleton
from ...motion.track import smooth_zero_phase_hann

SPEED = np.array([0.05, 0.3, 0.8, 1.5])
STRIDE = np.array([0.12, 0.25, 0.30, 0.34])
TURN = np.array([0.28, 0.35, 0.45, 0.60])
SWING = np.array([0.45, 0.38, 0.32, 0.30])
"""By the body's speed (SPEED, m/s): metres that a foot is dragged (STRIDE) and radians that it is turned (TURN) from
the beginning of a stance to its end before a step is taken, and the step's seconds (SWING). At 0.3 m/s this gives 1.5
steps a second."""

DRAG_TOLERANCE = 1.15  # times STRIDE and TURN that a stance may drag before it is broken
LATE_LAG = 1.3  # times them that a foot may lag before a lift of the other one is left out so that it can step sooner
LAG_DIFFERENCE = 0.3  # difference of lag from which on the foot that lags more goes first
MIN_SWING = 0.26  # s of the quickest step
HEEL_OFF, TOE_ON = 0.06, 0.03  # s that the heel is up before the toe, and that the toe is down before the step ends
SETTLE_SECONDS = 0.04  # s of contact that a foot needs before the other one is lifted, and after it is down again
UNWIND_SECONDS = 0.17  # s before a lift in which a foot may lag
SHORTEST = 0.2  # s of a stance that are left on either side of a step
FOOT_SEPARATION = 0.11  # m between the ankles of feet that pass each other
CROSSING_ROOM = (0.15, 0.30)
"""Metres that feet are one before the other from which on they need not be side by side, and from which on they may
cross."""
MAX_SEPARATING = 0.15  # m that a foot is set down further apart at most
LIFT_HEIGHT = 0.045  # m that a foot is lifted
HEEL_UP, TOE_UP = 0.22, 0.06  # rad: heel over toe after lifting, toe over heel before landing
SWAY = 0.012  # m that the pelvis moves over the planted foot
GENTLE_SPEED, GENTLE_HEIGHT, GENTLE_SECONDS = 0.6, 0.20, 1.5
"""Limits of a lift that may be left out: m/s of the body, metres that the ankle rises, and seconds."""

UPRIGHT_SHARE = 0.75  # share of the usual root height below which a body crouches, kneels or lies, and takes no steps
_LEFT, _RIGHT, _ROUNDS = 0, 1, 6


@dataclass(frozen=True, eq=False, kw_only=True)
class Steps:
    """Extra steps, and what plants and labels the feet.

    Attributes:
        rotations: (T, J, 4) local, with lifts left out.
        heel_toe_contacts: (T, 2, 2) bool, heel and toe of each foot that are in contact now.
        contacts: (T, 2) bool, feet flat on the ground, as in the source.
        stepped: (T, 2) bool, feet in an extra step, from heel off to heel down.
        moves: (T, 2, 4), m by which each foot is moved, and rad of heel over toe.
        sway: (T, 2) m by which the pelvis moves on the ground.
    """

    rotations: np.ndarray
    heel_toe_contacts: np.ndarray
    contacts: np.ndarray
    stepped: np.ndarray
    moves: np.ndarray
    sway: np.ndarray

    @staticmethod
    def empty(rotations: np.ndarray, heel_toe_contacts: np.ndarray) -> Steps:
        """Return a motion without extra steps.

        Args:
            rotations: (T, J, 4) local.
            heel_toe_contacts: (T, 2, 2) bool, heel and toe contacts.
        """
        zeros = np.zeros((len(heel_toe_contacts), 2))
        return Steps(rotations=rotations, heel_toe_contacts=heel_toe_contacts, contacts=heel_toe_contacts.all(axis=2),
                     sway=zeros, stepped=zeros.astype(bool), moves=np.zeros((len(heel_toe_contacts), 2, 4)))


def add_steps(
    skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, heel_toe_contacts: np.ndarray, fps: float,
    steps_taken: np.ndarray | None = None, free: np.ndarray | None = None,
) -> Steps:
    """Add the extra steps that a motion on the ground needs.

    Args:
        skeleton: the skeleton.
        root: (T, 3) m, world.
        rotations: (T, J, 4) local.
        heel_toe_contacts: (T, 2, 2) bool, heel and toe contacts, left and right.
        fps: frames per second.
        steps_taken: (T, 2) bool, steps that are taken already.
        free: (T,) bool, where others may be added; None: everywhere.
    """
    empty = Steps.empty(rotations, heel_toe_contacts)
    if len(root) < 2:
        return empty
    body = identify_joints(skeleton)
    places, world = pose_legs(skeleton, root, rotations)
    heading = np.unwrap(quaternion.to_yaw(rotations[:, 0]))
    feet = [_Foot(limb, places, world, root=root, heading=heading, heel_toe_contacts=heel_toe_contacts[:, side])
            for side, limb in enumerate((body.left, body.right))]
    upright = root[:, 2] > UPRIGHT_SHARE * np.median(root[:, 2])
    speed = measure_lengths(np.gradient(smooth_zero_phase_hann(root[:, :2], fps, 1.0), axis=0)) * fps
    stepped = empty.stepped if steps_taken is None else steps_taken
    plan = _StepPlan(feet, stepped, speed, fps, upright if free is None else free & upright)
    plan.run()
    for foot in (feet := plan.feet):
        rotations = foot.bend_leg_down(skeleton, root, rotations)
    is_in_contact = np.stack([heel_toe_contacts[:, side] | foot.held[:, None] for side, foot in enumerate(feet)],
                             axis=1)
    stepped = stepped | plan.stepped
    swings = _toe_swings(stepped, fps)
    moves, sway = _shape_steps(stepped, swings, feet[_LEFT].root, [foot.middle for foot in feet], fps)
    if stepped.any():
        hips = places[:, body.left.upper_leg] - places[:, body.right.upper_leg]
        left = hips[:, 0] + 1j * hips[:, 1]
        moves[..., :2] = _separate_feet(plan, stepped, left / np.maximum(np.abs(left), 1e-9))
    return Steps(rotations=rotations, heel_toe_contacts=is_in_contact & ~swings[:, :, None], contacts=empty.contacts
                 & ~stepped, stepped=stepped, moves=moves, sway=sway)


class _Foot:
    """One foot where the motion has it; places on the ground are complex numbers x + iy.

    Attributes:
        points: (T, 2) m, ankle and toe.
        middle: (T,) m between them.
        yaw: (T,) rad, direction of the foot, unwrapped.
        is_in_contact: (T,) bool, in contact.
        is_flat: (T,) bool, in contact with heel and toe.
        held: (T,) bool, kept down although the source lifts it.
        before, behind: (T,) frames between whose places a held foot is.
        through: (T,) how far it is from the one to the other, 0 to 1.
    """

    def __init__(self, limb: Limb, places, world, root, heading, heel_toe_contacts: np.ndarray):
        self.limb, self.places, self.world = limb, places[:, limb.foot], world[:, limb.foot]
        toe = places[:, limb.toe_or_foot]
        along = toe - self.places if limb.toe is not None else quaternion.rotate(self.world, np.array([1.0, 0.0, 0.0]))
        self.yaw = np.unwrap(arctan2(along[:, 1], along[:, 0]))
        self.is_in_contact, self.is_flat = heel_toe_contacts.any(axis=1), heel_toe_contacts.all(axis=1)
        self.held, self.through = np.zeros(len(root), bool), np.zeros(len(root))
        self.before, self.behind = np.zeros(len(root), int), np.zeros(len(root), int)
        self.heading, self.root = heading, root[:, 0] + 1j * root[:, 1]
        self.points = np.stack([self.places[:, 0] + 1j * self.places[:, 1], toe[:, 0] + 1j * toe[:, 1]], axis=1)
        self.middle = self.points.mean(axis=1)

    def with_lift_left_out(self, first: int, end: int, reach: int) -> _Foot:
        """Keep the foot on the ground in frames first .. end too.

        The body carries it along from where it was in contact to where it will be next, if it will.

        Args:
            first: first frame of the lift.
            end: frame after its last one.
            reach: frames by which the hold may begin sooner and end later, so that the foot is flat there.
        Returns:
            A changed copy.
        """
        new = copy.copy(self)
        for name in ("held", "before", "behind", "through", "points", "middle", "yaw"):
            setattr(new, name, getattr(self, name).copy())
        first, end = self._find_flat_before(first, reach), self._find_flat_behind(end, reach)
        at, before = slice(first, end), first - 1
        behind = end if end < len(self.yaw) else before
        through = smoothstep(_progress(first, end))
        new.held[at], new.before[at], new.behind[at], new.through[at] = True, before, behind, through
        new.points[at] = new._interpolate_held(self.points, at)
        new.middle[at] = new.points[at].mean(axis=1)
        # yaw relative to the body before and behind, so that the foot turns with the body in between
        own = self.yaw[[before, behind]] - self.heading[[before, behind]]
        change = quaternion.wrap_angle(own[1] - own[0])
        new.yaw[end:] += own[0] + change - own[1]
        new.yaw[at] = self.heading[at] + own[0] + through * change
        return new

    def _interpolate_held(self, points: np.ndarray, at) -> np.ndarray:
        """Interpolate held places (N, K) at frames `at`, on a straight line as the body sees it."""
        own = [(points[edge[at]] - self.root[edge[at], None]) * np.exp(-1j * self.heading[edge[at], None])
               for edge in (self.before, self.behind)]
        blended = own[0] + self.through[at, None] * (own[1] - own[0])
        return blended * np.exp(1j * self.heading[at, None]) + self.root[at, None]

    def _find_flat_before(self, first: int, reach: int) -> int:
        """Return the frame after the last flat one of the stance before `first`, at most `reach` frames earlier."""
        low = max(first - reach, 0)
        in_contact = self.is_in_contact[low:first] & ~self.held[low:first]
        low += max(np.flatnonzero(~in_contact).tolist(), default=-1) + 1
        flat = np.flatnonzero(self.is_flat[low:first])
        return low + int(flat[-1]) + 1 if len(flat) else first

    def _find_flat_behind(self, end: int, reach: int) -> int:
        """Return the first flat frame of the stance from `end` on, at most `reach` frames later."""
        in_contact = self.is_in_contact[end : end + reach] & ~self.held[end : end + reach]
        high = end + (len(in_contact) if in_contact.all() else int(np.argmin(in_contact)))
        flat = np.flatnonzero(self.is_flat[end:high])
        return end + int(flat[0]) if len(flat) else end

    def bend_leg_down(self, skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray) -> np.ndarray:
        """Bend the leg so that the foot is down where it is held.

        Args:
            skeleton: the skeleton.
            root: (T, 3) m, world.
            rotations: (T, J, 4) local.
        Returns:
            (T, J, 4) local.
        """
        at = np.flatnonzero(self.held)
        if not len(at):
            return rotations
        height = [self.places[edge, 2] for edge in (self.before[at], self.behind[at])]
        level = self.points[at, 0]
        target = np.stack([level.real, level.imag, height[0] + self.through[at] * (height[1] - height[0])], axis=1)
        turn = [quaternion.multiply(quaternion.from_up_angle(self.heading[at] - self.heading[edge]), self.world[edge])
                for edge in (self.before[at], self.behind[at])]
        turned = quaternion.slerp(turn[0], turn[1], self.through[at])
        out = rotations.copy()
        out[at] = solve_two_bone(skeleton, root[at], rotations[at], self.limb.leg, target,
                                 end_rotation=turned).rotations
        return quaternion.unify_signs(out)


class _StepPlan:
    """Plan of the steps, chosen one after the other, always the earliest.

    Attributes:
        feet: left and right foot, with lifts left out.
        contacts: (T, 2) bool, in contact after the steps.
        stepped: (T, 2) bool, in a step.
        lag: (T, 2), how far each foot lags; 1 where a step is due.
        dragged_stances: per foot the stances (first, end) that still drag too far.
    """

    def __init__(self, feet: list[_Foot], steps_taken: np.ndarray, speed: np.ndarray, fps: float, free: np.ndarray):
        self.feet, self.speed, self.fps = feet, speed, fps
        self.contacts = np.stack([foot.is_in_contact for foot in feet], axis=1) & ~steps_taken
        self.stepped, self.lag = np.zeros_like(self.contacts), np.zeros(self.contacts.shape)
        self.free_until = _next_unset(free)
        self.swing = np.maximum(np.rint(np.interp(speed, SPEED, SWING) * fps).astype(int), 3)
        least = (max(1, int(round(seconds * fps))) for seconds in (SETTLE_SECONDS, SHORTEST, MIN_SWING))
        self.settled, self.shortest, self.least = least
        self.unwinding = int(round(UNWIND_SECONDS * fps))
        self.turn = np.interp(speed, SPEED, TURN)
        self.stride = np.minimum(np.interp(speed, SPEED, STRIDE), self._limit_stride())
        self.last_side: int | None = None
        self.dragged_stances = [self._list_dragged_stances(side, 0) for side in (_LEFT, _RIGHT)]

    def _limit_stride(self) -> np.ndarray:
        """Compute how long (T,) m a stride may be without the feet coming closer than FOOT_SEPARATION.

        As the body drifts, the foot moves from half a stride ahead of the other one to half a stride behind it.
        """
        left, right = (foot.middle for foot in self.feet)
        centre = 0.5 * (left + right)
        drift = np.gradient(smooth_zero_phase_hann(np.stack([centre.real, centre.imag], axis=1), self.fps, 1.0), axis=0)
        # vector between the feet in the frame of the drift: real part along it, imaginary part across
        width = (left - right) * (drift[:, 0] - 1j * drift[:, 1]) / np.maximum(measure_lengths(drift), 1e-9)
        along, across = np.abs(width.real), np.abs(width.imag)
        room = 2.0 * (along - np.sqrt(np.maximum(FOOT_SEPARATION**2 - across**2, 0.0)))
        return np.where(across > FOOT_SEPARATION, np.inf, np.maximum(room, STRIDE[0]))

    def _list_dragged_stances(self, side: int, now: int) -> list[tuple[int, int]]:
        """List the stances (first, end) from `now` on that drag too far, in order; stores the lag of each frame."""
        return [run for run in find_runs(self.contacts[:, side]) if run[1] > now and self._measure_lag(side, *run)
                > DRAG_TOLERANCE]

    def _measure_lag(self, side: int, first: int, end: int) -> float:
        """Compute the largest lag in frames first .. end; 1 where a step is due."""
        at, foot = slice(first, end), self.feet[side]
        # distance in strides and turn in turns, as one length
        away = np.abs(foot.middle[at] - foot.middle[first]) / self.stride[at]
        self.lag[at, side] = np.hypot(away, (foot.yaw[at] - foot.yaw[first]) / self.turn[at])
        # a foot that lifts soon anyway may lag until then
        counted = slice(first, end if end == len(self.speed) else max(end - self.unwinding, first + 1))
        return float(self.lag[counted, side].max(initial=0.0))

    def run(self) -> None:
        """Break stances until none drags any more, or none can be broken."""
        now = 0
        while any(self.dragged_stances):
            next_steps = [self._choose_step(side, now) for side in (_LEFT, _RIGHT)]
            side = self._choose_foot(next_steps)
            # a stance that cannot be broken: hold the other foot down, or leave the stance as it is
            stuck = [(self.dragged_stances[side][0][1], side) for side in (_LEFT, _RIGHT) if self.dragged_stances[side]
                     and not next_steps[side]]
            if stuck and (side is None or min(stuck)[0] <= next_steps[side][0]):
                side = min(stuck)[1]
                if not self._hold_other(side, now):
                    self.dragged_stances[side].pop(0)
            # take the step, unless it comes so late that holding the other foot down helps
            elif self.lag[next_steps[side][0], side] <= LATE_LAG or not self._hold_other(side, now):
                now = next_steps[side][0]
                self._take_step(side, *next_steps[side])

    def _choose_foot(self, next_steps: list[tuple[int, int] | None]) -> int | None:
        """Choose the foot that steps first, None where none does.

        It is the one that is due sooner. Where there is no time for both before, it is the one that lags clearly more
        by then, unless it stepped last; otherwise the one that is behind in the body's direction of movement.
        """
        due = [side for side in (_LEFT, _RIGHT) if next_steps[side]]
        if len(due) < 2:
            return due[0] if due else None
        left, right = (found[0] for found in next_steps)
        first = min(left, right)
        soon = min(first + int(self.swing[first]), len(self.speed) - 1)
        more = self.lag[soon, _LEFT] - self.lag[soon, _RIGHT]
        needier = _LEFT if more > 0.0 else _RIGHT
        if abs(left - right) < self.swing[first] and abs(more) > LAG_DIFFERENCE and needier != self.last_side:
            return needier
        if left == right:
            return _LEFT if self._measure_behind(_LEFT, left) >= 0.0 else _RIGHT
        return _LEFT if left < right else _RIGHT

    def _take_step(self, side: int, at: int, down: int) -> None:
        """Take a step of one foot from frame `at` to `down`, and queue the rest of its stance if that drags too."""
        self.last_side, (_, end) = side, self.dragged_stances[side].pop(0)
        self.contacts[at:down, side], self.stepped[at:down, side], self.lag[at:down, side] = False, True, 0.0
        if down < end and self._measure_lag(side, down, end) > DRAG_TOLERANCE:
            self.dragged_stances[side].insert(0, (down, end))

    def _hold_other(self, side: int, now: int) -> bool:
        """Leave out a gentle lift of the other foot during this foot's dragged stance, so that this foot can step.

        Returns:
            Whether there is such a lift; the first one that helps is left out.
        """
        other, (first, end) = 1 - side, self.dragged_stances[side][0]
        foot, reach = self.feet[other], int(round(0.3 * self.fps))
        for up, down in find_runs(~self.contacts[:, other] & ~self.stepped[:, other]):
            inside = max(now, 1) <= up < end and down > first
            if inside and self._is_gentle_lift(foot, up, down) and self.free_until[up] >= down:
                # try it, and restore everything if this foot still cannot step
                saved = foot, self.contacts.copy(), self.lag.copy(), self.dragged_stances[other]
                self.feet[other] = foot.with_lift_left_out(up, down, min(reach, up - now))
                self.contacts[up:down, other] = True
                self._update_stance(other, up)
                if self._choose_step(side, now):
                    return True
                self.feet[other], self.contacts, self.lag, self.dragged_stances[other] = saved
        return False

    def _update_stance(self, side: int, at: int) -> None:
        """Update the list of dragged stances for the stance around frame `at`."""
        first = max(np.flatnonzero(~self.contacts[:at, side]).tolist(), default=-1) + 1
        end = int(_next_unset(self.contacts[:, side])[at])
        left = [run for run in self.dragged_stances[side] if run[1] <= first or run[0] >= end]
        self.dragged_stances[side] = sorted([*left, (first, end)] if self._measure_lag(side, first, end)
                                            > DRAG_TOLERANCE else left)

    def _is_gentle_lift(self, foot: _Foot, up: int, down: int) -> bool:
        """Return whether a lift up .. down is slow, low and short enough to be left out."""
        height, ends = foot.places[up:down, 2], foot.places[[up - 1, min(down, len(self.speed) - 1)], 2]
        slow = down - up <= GENTLE_SECONDS * self.fps and self.speed[up:down].max() < GENTLE_SPEED
        return bool(slow and height.max() - ends.min() < GENTLE_HEIGHT)

    def _measure_behind(self, side: int, at: int) -> float:
        """Measure how far the foot is behind the other one in the body's direction of movement."""
        before, after = max(at - 8, 0), min(at + 8, len(self.speed) - 1)
        here, there = self.feet[side].middle, self.feet[1 - side].middle
        return float(((there[at] - here[at]) * np.conj(here[after] + there[after] - here[before] - there[before])).real)

    def _choose_step(self, side: int, now: int) -> tuple[int, int] | None:
        """Choose the frames in which the foot's next dragged stance is broken and regained; None if there are none."""
        if not self.dragged_stances[side]:
            return None
        first, end = self.dragged_stances[side][0]
        down = self._compute_landing(side, first, end, now)
        places = np.flatnonzero(down - np.arange(first, end) >= self.least)
        if not len(places):
            return None
        lag = self.lag[first:end, side]
        # break a stance of lag n into equal parts, each with at most DRAG_TOLERANCE
        share = lag.max() / np.ceil(lag.max() / DRAG_TOLERANCE)
        resting = np.interp(self.speed[first:end], SPEED[:2], (1.0, 0.0))
        due = np.maximum(share, resting)
        if any(a < end and first < b for a, b in self.dragged_stances[1 - side][:1]):
            # where both lag the same, one steps at half the lag, so that they take turns
            due *= 0.5 + 0.5 * np.clip(np.abs(lag - self.lag[first:end, 1 - side]) / (0.5 * due), 0.0, 1.0)
        at = int(places[np.argmin(np.abs(places - np.argmax(lag >= due)))])
        return first + at, int(down[at])

    def _compute_landing(self, side: int, first: int, end: int, now: int) -> np.ndarray:
        """Compute the frame by which a step has to be over, for each frame at which it may begin.

        The other foot has to be in firm contact throughout. A value equal to its frame forbids a step there.

        Args:
            side: the foot.
            first, end: the stance.
            now: frame up to which all is decided.
        Returns:
            (end - first,) frames.
        """
        at = np.arange(first, end)
        other = self.contacts[:, 1 - side]
        until = _next_unset(other)[at]
        until = np.where(until >= len(other), until, until - self.settled)
        last = end - self.shortest if end < len(other) else end
        down = np.minimum.reduce([at + self.swing[first:end], until, self.free_until[at], np.full(len(at), last)])
        early = at < max(now, first + self.shortest if first else 0)
        return np.where(early | ~other[np.maximum(at - self.settled, 0)], at, down)


def _next_unset(flags: np.ndarray) -> np.ndarray:
    """Compute (T + 1,) the first frame from each on in which `flags` (T,) is not set."""
    # a running minimum from the end: unset frames keep their number, set ones take the next
    unset = np.where(flags, len(flags), np.arange(len(flags)))
    return np.append(np.minimum.accumulate(unset[::-1])[::-1], len(flags))


def _separate_feet(plan: _StepPlan, stepped: np.ndarray, left: np.ndarray) -> np.ndarray:
    """Compute how far stepping feet are set down further apart, so that the left one stays to the left of the right
    one.

    The foot of a stance lies at the mean of where the body takes it (`foot_plant.solve_shift`).

    Args:
        plan: the steps.
        stepped: (T, 2) bool.
        left: (T,) complex unit, the body's left.
    Returns:
        (T, 2, 2) m.
    """
    stances = [find_runs(plan.contacts[:, side]) for side in (_LEFT, _RIGHT)]
    near = np.pad(stepped, ((1, 1), (0, 0)))
    # a stance is loose, and may be moved, if a step begins or ends it
    loose = [[bool(near[a, side] or near[b + 1, side]) for a, b in stances[side]] for side in (_LEFT, _RIGHT)]
    # the shorter one of two is moved more: a long stand does not shift for one step beside it
    yields = [[free / (b - a) for free, (a, b) in zip(*both)] for both in zip(loose, stances)]
    place = [[foot.points[a:b].mean(axis=0) for a, b in stances[side]] for side, foot in enumerate(plan.feet)]
    pushed = [[0.0j] * len(side) for side in place]
    # pairs of overlapping stances with the body's left in the middle of the overlap; one of them at least is loose
    (a, b), (c, d) = (np.reshape(runs, (-1, 2)).T for runs in stances)
    begins, ends = np.maximum.outer(a, c), np.minimum.outer(b, d)
    may_move = (begins <= ends) & np.logical_or.outer(*(np.array(side, bool) for side in loose))
    middle = (begins + ends) // 2
    pairs = [(i, j, complex(left[middle[i, j]])) for i, j in np.argwhere(may_move).tolist()]
    for _ in range(_ROUNDS):
        for i, j, left_direction in pairs:
            between = place[_LEFT][i] - place[_RIGHT][j] + pushed[_LEFT][i] - pushed[_RIGHT][j]
            # real part to the left, imaginary part backward; feet one well before the other may cross
            apart = between * left_direction.conjugate()
            needed = np.interp(np.abs(apart.imag), CROSSING_ROOM, (FOOT_SEPARATION, -FOOT_SEPARATION))
            missing = min(float((needed - apart.real).max()), MAX_SEPARATING - max(abs(pushed[_LEFT][i]),
                                                                                    abs(pushed[_RIGHT][j])))
            if missing > 0.0:
                # split what lacks between the loose ones of the two
                share = missing / (yields[_LEFT][i] + yields[_RIGHT][j])
                pushed[_LEFT][i] += share * yields[_LEFT][i] * left_direction
                pushed[_RIGHT][j] -= share * yields[_RIGHT][j] * left_direction
    out = np.zeros((len(stepped), 2, 2))
    for side in (_LEFT, _RIGHT):
        if any(pushed[side]):
            ends = np.ravel(stances[side]) - [0, 1] * len(stances[side])
            # constant within each stance, linear over the steps between
            by = np.interp(np.arange(len(out)), ends, np.repeat(pushed[side], 2))
            out[:, side] = np.stack([by.real, by.imag], axis=1)
    return out


def _toe_swings(stepped: np.ndarray, fps: float) -> np.ndarray:
    """Return (T, 2) bool: where the toes are off the ground in the steps `stepped` (T, 2)."""
    off, on = int(round(HEEL_OFF * fps)), int(round(TOE_ON * fps))
    out = np.zeros_like(stepped)
    for side in (_LEFT, _RIGHT):
        for first, end in find_runs(stepped[:, side]):
            out[first + off : end - on, side] = True
    return out


def _shape_steps(stepped: np.ndarray, swings: np.ndarray, root: np.ndarray, feet: list[np.ndarray], fps: float):
    """Compute `moves` and `sway` of steps.

    Args:
        stepped: (T, 2) bool.
        swings: (T, 2) bool, toes off the ground.
        root: (T,) m, complex.
        feet: (T,) m of each foot, complex.
        fps: frames per second.
    """
    moves, sway = np.zeros((len(stepped), 2, 4)), np.zeros((len(stepped), 2))
    early = int(0.2 * fps)
    for side in (_LEFT, _RIGHT):
        for first, end in find_runs(stepped[:, side]):
            moves[first:end, side, 3] = _heel_tilt(_progress(first, end))
            low, high, middle = max(first - early, 0), min(end + early, len(root)), (first + end) // 2
            over = feet[1 - side][middle] - root[middle]
            over = SWAY * np.array([over.real, over.imag]) / max(abs(over), 1e-9)
            sway[low:high] += np.sin(np.pi * _progress(low, high))[:, None] ** 2 * over
        for first, end in find_runs(swings[:, side]):
            rising = np.clip(np.minimum(_progress(first, end), 1.0 - _progress(first, end)) / 0.45, 0.0, 1.0)
            moves[first:end, side, 2] = LIFT_HEIGHT * smoothstep(rising)
    return moves, sway


def _progress(first: int, end: int) -> np.ndarray:
    """Compute how far each of the frames first .. end is through them, between 0 and 1."""
    return (np.arange(first, end) - first + 1.0) / (end - first + 1.0)


def _heel_tilt(through: np.ndarray) -> np.ndarray:
    """Compute the tilt (N,) rad of heel over toe for progress `through` (N,): the heel leaves first and lands first."""
    return 6.75 * through * (1.0 - through) * (HEEL_UP * (1.0 - through) - TOE_UP * through)
