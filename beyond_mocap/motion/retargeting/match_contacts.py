"""A retargeted motion whose feet stand where the source's stood, and whose striking parts are at the ball.

Retargeting keeps directions, so a body of another size comes near the source's footprints and the ball, but not onto
them. Here the ends of the limbs are moved onto them, and the legs and arms follow by two-bone inverse kinematics:

- The toe joint of a foot in contact is over the source's own spot. A heel that lands before its toe lands where it will
  be when the foot is flat, so a foot of another length does not slide. Between stances the offset fades smoothly.
- The lowest point of the sole is at the ground while the source's is, and as high above it otherwise.
- A pelvis is lowered and a heel raised where legs are too short.
- At a touch of the ball the gap between skin and ball is the source's own.

Source: two-bone inverse kinematics as in `limb`; the lowering of the pelvis and the rise of heels as in `foot_plant`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...base.easing import quintic_step
from ...base.time_series import find_runs, number_runs
from ...base.vectors import unit_vectors
from .. import limb, quaternion
from ..foot_plant import Foot, build_foot, compute_pelvis_drop, limit_to_reach, solve_heel_rise, spread_peaks
from ..humanoid import Humanoid, Limb
from ..motion import Motion, compute_pose
from .body_points import Points, measure_sole_heights, place_points

MAX_DROP = 0.08
"""Share of the leg by which the pelvis is lowered at most, before and again after the heels are raised."""

TOUCH_SECONDS = 0.25
"""s before and after a touch over which a part moves to the ball and back."""

MAX_TOUCH_SHIFT = 0.4
"""m that a part is moved to the ball at most; farther away the touch is not this part's."""

_SPREAD_SECONDS = 0.1
_SOFT = 0.002  # m below full length from which a leg eases: less than the reserve, so a reachable spot is met exactly
_LEVEL = 0.6  # cosine of the ball's elevation from the skin above which a part is moved level
_ROUNDS = 8  # of moving a part along the line to the ball


@dataclass(frozen=True, eq=False, kw_only=True)
class PartTouch:
    """A part of the body that is at the ball.

    Attributes:
        joint: of the target that is moved: a foot, a hand, or another joint, which moves the whole body.
        points: the target's skin there.
        frames: (N,) consecutive frames.
        ball: (N, 3) m, the ball's centre, world.
        distance: (N,) m from that centre to the skin, as the source has it.
    """

    joint: int
    points: Points
    frames: np.ndarray
    ball: np.ndarray
    distance: np.ndarray


@dataclass(frozen=True, eq=False, kw_only=True)
class MatchedMotion:
    """The result of `match_contacts`.

    Attributes:
        motion: on the target's skeleton.
        miss: (T, 2) m between each ankle and where it should be, left and right.
        drop: (T,) m by which the pelvis was lowered.
    """

    motion: Motion
    miss: np.ndarray
    drop: np.ndarray


@dataclass(frozen=True, eq=False, kw_only=True)
class SourceFeet:
    """What the source's feet do.

    Attributes:
        toes, ankles: (T, 2, 3) m, world, left and right.
        heights: (T, 2) m of the lowest point of each sole above the ground.
        contacts: (T, 2, 2) bool, left and right, heel and toe on the ground.
    """

    toes: np.ndarray
    ankles: np.ndarray
    heights: np.ndarray
    contacts: np.ndarray = field(repr=False)


def read_source_feet(motion: Motion, body: Humanoid, soles: Sequence[Points], contacts: np.ndarray) -> SourceFeet:
    """Read what the feet of a source motion do.

    Args:
        motion: T frames, the ground at height 0.
        body: its joints by meaning.
        soles: left and right, points of its soles.
        contacts: (T, 2, 2) bool, left and right, heel and toe on the ground.
    Returns:
        The feet.
    """
    places, world = compute_pose(motion.skeleton, motion.root_positions, motion.rotations)
    sides = (body.left, body.right)
    heights = [_lower_stances(measure_sole_heights(points, places, world), contacts[:, side].any(axis=1))
               for side, points in enumerate(soles)]
    return SourceFeet(toes=places[:, [side.toe_or_foot for side in sides]], heights=np.stack(heights, axis=1),
                      ankles=places[:, [side.foot for side in sides]], contacts=contacts)


def _lower_stances(heights: np.ndarray, is_stance: np.ndarray) -> np.ndarray:
    """Lower each stance so that its lowest moment is on the ground; (T,) m."""
    out, low = np.array(heights), [(0.5 * (first + end - 1), heights[first:end].min())
                                   for first, end in find_runs(is_stance)]
    if low:
        out -= np.interp(np.arange(len(out)), *np.array(low).T)
    return np.maximum(out, 0.0)


def match_contacts(
    motion: Motion, body: Humanoid, soles: Sequence[Points], source: SourceFeet, touches: Sequence[PartTouch] = ()
) -> MatchedMotion:
    """Move the feet of a retargeted motion onto the source's spots, and striking parts to the ball.

    Args:
        motion: T frames, retargeted with the source's travel, the ground at height 0.
        body: its joints by meaning.
        soles: left and right, points of its soles.
        source: what the source's feet do.
        touches: parts at the ball.
    Returns:
        The motion, and how far legs were short.
    """
    return _ContactMatcher(motion, body, soles, source, touches).build_result()


class _ContactMatcher:
    """Ankle goals of both feet, and the limbs that reach them."""

    def __init__(self, motion: Motion, body: Humanoid, soles, source: SourceFeet, touches: Sequence[PartTouch]):
        self.skeleton, self.fps, self.body, self.source = motion.skeleton, motion.fps, body, source
        self.root, self.rotations = np.array(motion.root_positions), np.array(motion.rotations)
        self.limbs: tuple[Limb, Limb] = (body.left, body.right)
        self.touches, self.soles = touches, soles
        self.spread = max(1, round(_SPREAD_SECONDS * motion.fps))
        self._raise_body()
        self._move_body_to_ball()
        self.places, self.world = compute_pose(self.skeleton, self.root, self.rotations)
        self.rotations_out, self.drop = self.rotations, np.zeros(len(self.root))

    def build_result(self) -> MatchedMotion:
        """Build the motion: goals, pelvis, heels, legs, arms."""
        feet = [self._build_goal(side) for side in (0, 1)]
        feet = self._lower_pelvis(feet)
        feet = [self._raise_heel(foot, side) for side, foot in enumerate(feet)]
        feet = self._lower_pelvis(feet)
        miss = np.stack([self._solve_leg(foot) for foot in feet], axis=1)
        for touch in self.touches:
            self._solve_arm(touch)
        motion = Motion(self.skeleton, self.root, quaternion.unify_signs(self.rotations_out), self.fps)
        return MatchedMotion(motion=motion, miss=miss, drop=self.drop)

    def _build_goal(self, side: int) -> Foot:
        """Build a foot at its goal: over the source's spots, its sole at the source's height, at the ball."""
        foot = build_foot(self.places, self.world, self.limbs[side], self.source.contacts[:, side])
        shift = np.zeros((len(self.root), 3))
        shift[:, :2] = self._compute_level_shift(foot, side)
        heights = measure_sole_heights(self.soles[side], self.places, self.world)
        shift[:, 2] = self._compute_lift(heights, side)
        touches, weight = [touch for touch in self.touches if touch.joint == foot.limb.foot], np.array(foot.weight)
        shift += self._compute_foot_touch_shift(touches, shift, heights + shift[:, 2], side)
        for touch in touches:
            weight[touch.frames, 1] = 1.0
        return replace(foot.move(shift), weight=weight)

    def _compute_level_shift(self, foot: Foot, side: int) -> np.ndarray:
        """Compute the shift (T, 2) m over the ground: what brings the toe, or the heel of a foot that is landing, to
        its spot.
        """
        toe_shift = (self.source.toes[:, side] - foot.toe)[:, :2]
        ankle_offset = toe_shift + (foot.heel - self.source.ankles[:, side])[:, :2]
        contacts = self.source.contacts[:, side]
        known = _hold_over_stances(ankle_offset, contacts[:, 1], contacts.any(axis=1))
        offset = _interpolate_smoothly(known)
        return offset + (self.source.ankles[:, side] - foot.heel)[:, :2]

    def _compute_lift(self, heights: np.ndarray, side: int) -> np.ndarray:
        """Compute the lift (T,) m: in stances to the source's height, in between faded, never below the ground."""
        wanted = self.source.heights[:, side] - heights
        is_stance = self.source.contacts[:, side].any(axis=1)
        lift = _interpolate_smoothly(np.where(is_stance, wanted, np.nan)[:, None])[:, 0]
        below = np.where(is_stance, 0.0, np.maximum(-(heights + lift), 0.0))
        return lift + np.where(is_stance, 0.0, spread_peaks(below, 1))

    def _compute_foot_touch_shift(self, touches: Sequence[PartTouch], shift: np.ndarray, heights: np.ndarray,
                                  side: int) -> np.ndarray:
        """Compute the further shift (T, 3) m of a foot that brings it to the ball.

        It grows and fades in the air: a stance with a touch is shifted as a whole, over the ground, all others stay.
        """
        is_stance = self.source.contacts[:, side].any(axis=1)
        known = np.where(is_stance[:, None], 0.0, np.full(shift.shape, np.nan))
        reach, frames, label = TOUCH_SECONDS * self.fps, np.arange(len(shift)), number_runs(is_stance)
        is_near = np.zeros(len(shift), bool)
        for touch in touches:
            needed = self._solve_shift(touch, shift)
            needed[:, 2] = np.maximum(needed[:, 2], -np.maximum(heights[touch.frames], 0.0))
            standing = is_stance[touch.frames]
            if standing.any():
                needed[:] = needed[standing].mean(axis=0) * [1.0, 1.0, 0.0]
                known[is_stance & np.isin(label, label[touch.frames[standing]])] = needed[0]
            known[touch.frames] = needed
            is_near |= (frames >= touch.frames[0] - reach) & (frames <= touch.frames[-1] + reach)
        known[~is_near & ~is_stance] = 0.0
        return _interpolate_smoothly(known)

    def _solve_shift(self, touch: PartTouch, shift: np.ndarray) -> np.ndarray:
        """Solve the shift (N, 3) m at a touch's frames, beyond `shift` (T, 3); 0 where it is too far."""
        points = place_points(touch.points, self.places[touch.frames], self.world[touch.frames])
        needed = solve_touch_shift(points + shift[touch.frames, None], touch.ball, touch.distance)
        is_far = np.linalg.norm(needed, axis=1).max(initial=0.0) > MAX_TOUCH_SHIFT
        return np.zeros_like(needed) if is_far else needed

    def _compute_touch_shift(self, touch: PartTouch, shift: np.ndarray) -> np.ndarray:
        """Compute the further shift (T, 3) m of a part that brings its skin to the ball at the touch's frames."""
        return _fade_around(touch.frames, self._solve_shift(touch, shift), len(shift), TOUCH_SECONDS * self.fps)

    def _raise_body(self) -> None:
        """Raise the whole body by what its soles need in the median, so that knees are bent as the source's."""
        places, world = compute_pose(self.skeleton, self.root, self.rotations)
        needed = self.source.heights - np.stack([measure_sole_heights(sole, places, world) for sole in self.soles],
                                                axis=1)
        is_stance = self.source.contacts.any(axis=2)
        if is_stance.any():
            self.root = self.root + [0.0, 0.0, float(np.median(needed[is_stance]))]

    def _move_body_to_ball(self) -> None:
        """Move the whole body at touches of parts that no limb moves, such as the head."""
        ends = {joint for one in self.limbs for joint in (one.foot, one.hand)}
        for touch in self.touches:
            if touch.joint not in ends:
                self.places, self.world = compute_pose(self.skeleton, self.root, self.rotations)
                self.root = self.root + self._compute_touch_shift(touch, np.zeros_like(self.root))

    def _lower_pelvis(self, feet: list[Foot]) -> list[Foot]:
        """Lower the pelvis where legs do not reach their goals; returns the feet with lowered hips."""
        most = MAX_DROP * float(np.median(feet[0].length))
        drop = compute_pelvis_drop(feet, [foot.heel for foot in feet], self.spread, most)
        self.drop = self.drop + drop
        down = drop[:, None] * [0.0, 0.0, 1.0]
        self.root = self.root - down
        return [replace(foot, hip=foot.hip - down) for foot in feet]

    def _raise_heel(self, foot: Foot, side: int) -> Foot:
        """Raise a heel about its toe where the leg does not reach its ankle, in frames with the toe on the ground."""
        weight = self.source.contacts[:, side, 1].astype(float)
        rise = solve_heel_rise(foot, np.zeros_like(foot.heel)) * weight
        roll = quaternion.from_axis_angle(foot.left, spread_peaks(rise, self.spread) * weight)
        heel = foot.toe + quaternion.rotate(roll, foot.heel - foot.toe)
        return replace(foot, heel=heel, rotation=quaternion.multiply(roll, foot.rotation))

    def _solve_leg(self, foot: Foot) -> np.ndarray:
        """Let a leg reach its ankle goal, the toes keeping their direction; returns the miss (T,) m."""
        goal = limit_to_reach(foot, foot.heel, np.zeros(len(self.root)))
        chain = (foot.limb.upper_leg, foot.limb.lower_leg, foot.limb.foot)
        reached = limb.solve_two_bone(self.skeleton, self.root, self.rotations_out, chain, goal,
                                      end_rotation=foot.rotation, soft=_SOFT)
        self.rotations_out = reached.rotations
        if foot.limb.toe is not None:
            toe = quaternion.multiply(quaternion.inverse(foot.rotation), self.world[:, foot.limb.toe])
            self.rotations_out[:, foot.limb.toe] = toe
        return reached.miss

    def _solve_arm(self, touch: PartTouch) -> None:
        """Let an arm bring its hand to the ball."""
        side = next((one for one in self.limbs if one.hand == touch.joint), None)
        if side is None or None in (side.upper_arm, side.lower_arm):
            return
        self.places, self.world = compute_pose(self.skeleton, self.root, self.rotations_out)
        shift = self._compute_touch_shift(touch, np.zeros_like(self.root))
        goal = self.places[:, side.hand] + shift
        reached = limb.solve_two_bone(self.skeleton, self.root, self.rotations_out,
                                      (side.upper_arm, side.lower_arm, side.hand), goal, soft=_SOFT)
        is_moved = np.linalg.norm(shift, axis=1) > 0.0
        self.rotations_out = np.where(is_moved[:, None, None], reached.rotations, self.rotations_out)


def solve_touch_shift(points: np.ndarray, ball: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """Solve how skin moves so that its nearest point is at a distance from the ball's centre.

    Args:
        points: (N, P, 3) m, the skin.
        ball: (N, 3) m, the ball's centre.
        distance: (N,) m, wanted.
    Returns:
        (N, 3) m.
    """
    shift = np.zeros_like(ball)
    for _ in range(_ROUNDS):
        away = ball[:, None] - points - shift[:, None]
        lengths = np.linalg.norm(away, axis=2)
        nearest = np.argmin(lengths, axis=1)
        rows = np.arange(len(ball))
        towards = unit_vectors(away[rows, nearest], np.array([0.0, 0.0, 1.0]))
        across = np.linalg.norm(towards[:, :2], axis=1, keepdims=True)
        # beside the ball a part moves over the ground, so that it keeps its height; above it towards the ball
        level = towards * [1.0, 1.0, 0.0] / np.maximum(across, 1e-9) ** 2
        towards = np.where(across > _LEVEL, level, towards)
        shift = shift + (lengths[rows, nearest] - distance)[:, None] * towards
    return shift


def _hold_over_stances(values: np.ndarray, is_known: np.ndarray, is_stance: np.ndarray) -> np.ndarray:
    """Hold known values (T, K) over the rest of their stance, as the nearest known one; NaN outside of stances."""
    out = np.full(values.shape, np.nan)
    label = number_runs(is_stance)
    for first, end in find_runs(is_stance):
        own = np.flatnonzero(is_known & (label == label[first]))
        frames = np.arange(first, end)
        # a stance on the heel alone: its middle, where the foot is most nearly flat
        own = own if len(own) else frames[[len(frames) // 2]]
        out[frames] = values[own[np.abs(frames[:, None] - own[None]).argmin(axis=1)]]
    return out


def _interpolate_smoothly(values: np.ndarray) -> np.ndarray:
    """Interpolate rows of NaN between known rows (T, K), starting and ending level; 0 where nothing is known."""
    known = np.flatnonzero(~np.isnan(values[:, 0]))
    if not len(known):
        return np.zeros_like(values)
    frames = np.arange(len(values))
    after = np.clip(np.searchsorted(known, frames), 0, len(known) - 1)
    before = np.clip(np.searchsorted(known, frames, side="right") - 1, 0, len(known) - 1)
    low, high = known[before], known[after]
    share = quintic_step((frames - low) / np.maximum(high - low, 1))[:, None]
    return (1.0 - share) * values[low] + share * values[high]


def _fade_around(frames: np.ndarray, values: np.ndarray, count: int, reach: float) -> np.ndarray:
    """Fade values (N, 3) at consecutive frames in and out over `reach` frames: (count, 3)."""
    every = np.arange(count)
    away = np.maximum(np.maximum(frames[0] - every, every - frames[-1]), 0)
    share = quintic_step(np.clip(1.0 - away / reach, 0.0, 1.0))
    return share[:, None] * values[np.clip(every - frames[0], 0, len(frames) - 1)]
