"""A body that obeys momentum: the last polish of a construction, after its feet are planted.

Stances are found again (`supports`), bends, starts and stops get their lean (`lean`), a centre of mass is planned that
flies on parabolas and is pushed only by feet on the ground (`momentum`), and the body follows it: its root moves,
standing feet stay, swinging feet go with the pelvis, heels rise where a leg does not reach. Where that is not enough
the plan is made again with a lower body.

The root takes the whole correction. With a third of it in the trunk the head accelerates 9 % more, with two thirds 25 %
(docs/explanation/momentum.md); a metric over the skeleton's graph, as ProjFlow has it for corrections of single
joints, spreads a level shift evenly over the body, which is a shift of the root.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..base.vectors import measure_lengths
from . import quaternion
from .foot_plant import AIR_RESERVE, Foot, build_foot, solve_heel_rise, spread_peaks
from .humanoid import Humanoid, identify_joints
from .lean import (
    choose_angles,
    choose_crouch,
    choose_shifts,
    compute_footprint_shifts,
    lower_root,
    measure_lean,
    tilt_body,
)
from .limb import place_limb, solve_posed_limb
from .mass import SEGMENT_MASSES, SegmentMasses, compute_centre_of_mass
from .momentum import STRENGTH, MomentumPlanner
from .motion import compute_pose
from .skeleton import Skeleton
from .supports import Stances, find_lying_stretches, find_stances, find_support_phases

_FADE_FRAMES = 3.0  # frames at 30 fps outside of a stance over which a foot comes to go with the pelvis
_PELVIS_GAIN = 1.12  # m that the root moves per metre of the centre of mass: standing legs and feet stay behind
_REACH_ROUNDS, _REACH_TOLERANCE = 3, 0.004  # plans, and metres that a leg may lack
_HEEL_REACH = 0.02  # m of reach that a rising heel gives; for more the body is lowered: heels that rise skate
_MOST_MOVE, _MOST_LOWERED = 0.25, 0.12
"""m that the centre of mass is moved, and lowered for its legs, at most: tracks that leap ask for more."""
_FIRMNESS = 9.0  # by which a lowered height weighs more than others
_SPREAD_FRAMES, _SINK_FRAMES = 2, 10  # frames at 30 fps over which peaks of a rising heel, and of a drop, are spread


def obey_momentum(
    skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, fps: float, share: np.ndarray,
    strength: float = STRENGTH, masses: SegmentMasses = SEGMENT_MASSES["men"],
) -> tuple[np.ndarray, np.ndarray]:
    """Correct a body so that its centre of mass obeys momentum and leans as it is accelerated.

    A body that never leaves the ground (walking, standing) is returned as it is.

    Args:
        skeleton: J joints.
        root: (T, 3) m, world.
        rotations: (T, J, 4) local rotations, feet planted.
        fps: frames per second.
        share: (T,) from 0, where the body stays as it is, to 1.
        strength: greatest vertical force of the legs in body weights.
        masses: of the body's segments.
    Returns:
        Root (T, 3) m and local rotations (T, J, 4).
    Raises:
        InputError: if the skeleton has no legs.
    """
    body = identify_joints(skeleton)
    places, world = compute_pose(skeleton, root, rotations)
    stances = find_stances(skeleton, places, fps)
    centre = compute_centre_of_mass(body, places, masses)
    phases = find_support_phases(stances, centre, fps, find_lying_stretches(skeleton, places))
    if not len(stances) or (len(phases) == 1 and phases[0, 0] <= 0.0 and phases[0, 1] >= len(root) - 1):
        return root, rotations
    legs = _build_legs(skeleton, body, masses, (places, world), stances=stances, fps=fps)
    shifts, lowered, tilted = _lean_into_pushes(body, places, centre, (root, rotations), stances, share=share, fps=fps)
    planner = MomentumPlanner(phases, len(root), fps, share, strength)
    new_root, new_rotations = legs.move(shifts).follow(planner, lowered, tilted)
    stays = share <= 0.0
    new_rotations = quaternion.match_signs(new_rotations, rotations)
    return np.where(stays[:, None], root, new_root), np.where(stays[:, None, None], rotations, new_rotations)


def keep_above_ground(move: np.ndarray, height: np.ndarray) -> np.ndarray:
    """Limit how far a foot sinks that goes with its pelvis: the second half of the way down it only nears the ground.

    Args:
        move: (T,) m upward.
        height: (T,) m of the foot above the ground.
    Returns:
        (T,) m upward.
    """
    half = 0.5 * np.maximum(height, 1e-6)
    return np.maximum(move, -half) + half * np.tanh(np.minimum(move + half, 0.0) / half)


def _lean_into_pushes(body: Humanoid, places: np.ndarray, centre: np.ndarray, pose: tuple[np.ndarray, np.ndarray],
                      stances: Stances, share: np.ndarray, fps: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute how both feet move (T, 2, 2) m, and root and rotations of a body that tilts and sinks: what it lacks."""
    root, rotations = pose
    lean = measure_lean(body, places, centre, stances, fps)
    least = [share[int(start) : int(np.ceil(stop)) + 1].min() for start, stop in zip(stances.start, stances.stop)]
    shifts = choose_shifts(lean, np.array(least))
    tilted = tilt_body(rotations, stances, choose_angles(lean, shifts), share=share, fps=fps)
    lowered = lower_root(root, stances, choose_crouch(lean, shifts), share=share, fps=fps)
    return compute_footprint_shifts(stances, shifts, share), lowered, tilted


def _build_legs(skeleton: Skeleton, body: Humanoid, masses: SegmentMasses, pose: tuple[np.ndarray, np.ndarray],
                stances: Stances, fps: float) -> _Legs:
    """Build the legs of a body with a pose: positions (T, J, 3) m and rotations (T, J, 4), world."""
    places, world = pose
    limbs, scale = (body.left, body.right), fps / 30.0
    standing = tuple(stances.compute_share(side, len(places), _FADE_FRAMES * scale) for side in (0, 1))
    feet = tuple(build_foot(places, world, limb, np.repeat(stands[:, None] > 0.0, 2, axis=1))
                 for limb, stands in zip(limbs, standing))
    spread, sink = (max(int(round(frames * scale)), 1) for frames in (_SPREAD_FRAMES, _SINK_FRAMES))
    return _Legs(skeleton, body, masses, feet, standing, spread=spread, sink=sink)


@dataclass(frozen=True, eq=False)
class _Legs:
    """Where the feet of a body stand, and how its legs follow a root that moves.

    Attributes:
        skeleton: J joints.
        body: which joint is what.
        masses: of its segments.
        feet: left and right, before the root moves.
        standing: (T,) of each foot, from 0, where it goes with the pelvis, to 1.
        spread: frames over which peaks of a rising heel are spread.
        sink: the same of a drop.
    """

    skeleton: Skeleton
    body: Humanoid
    masses: SegmentMasses
    feet: tuple[Foot, ...]
    standing: tuple[np.ndarray, ...]
    spread: int
    sink: int

    def move(self, shifts: np.ndarray) -> _Legs:
        """Move the feet over the ground, by shifts (T, 2, 2) m of the left and the right one."""
        level = np.zeros(len(shifts))
        return replace(self, feet=tuple(foot.move(np.column_stack([shifts[:, side], level]))
                                        for side, foot in enumerate(self.feet)))

    def follow(self, planner: MomentumPlanner, root, rotations) -> tuple[np.ndarray, np.ndarray]:
        """Move the root so that the centre of mass follows its plan; feet stay where they stand."""
        places, world = compute_pose(self.skeleton, root, rotations)
        centre = self._measure_centre(places, world, np.zeros_like(root))
        goal, firmness = centre[:, 2].copy(), np.ones(len(root))
        for _ in range(_REACH_ROUNDS):
            height, force = planner.plan_height(goal, firmness)
            plan = centre + _limit_moves(np.column_stack([planner.plan_ground(centre[:, :2], force), height]) - centre)
            move = _PELVIS_GAIN * (plan - centre)
            lacks = self._measure_shortfall(places, move)
            if lacks.max() < _REACH_TOLERANCE:
                break
            lacks = spread_peaks(lacks, self.sink)
            goal = np.maximum(goal - planner.share * lacks, centre[:, 2] - _MOST_LOWERED)
            firmness = np.where(lacks > 0.0, _FIRMNESS, firmness)
        move = move + plan - self._measure_centre(places, world, move)
        return root + move, self._solve_legs(places, world, rotations, move)

    def _measure_centre(self, places, world, move) -> np.ndarray:
        """Measure the centre of mass (T, 3) m with the root moved by (T, 3) m and both legs reaching their feet."""
        moved = _move_places(places, move)
        for foot, goal, _ in self._aim_legs(places, move):
            knee, ankle = place_limb(moved, world, foot.limb.leg, goal, soft=foot.ease_distance)
            moved[:, foot.limb.lower_leg], moved[:, foot.limb.foot] = knee, ankle
        return compute_centre_of_mass(self.body, moved, self.masses)

    def _aim_legs(self, places, move):
        """Yield each foot, its ankle's goal (T, 3) m and its rotation (T, 4), the root moved by (T, 3) m."""
        for foot, standing in zip(self.feet, self.standing):
            hip = places[:, foot.limb.upper_leg] + move
            carried = (1.0 - standing)[:, None] * move
            carried[:, 2] = keep_above_ground(carried[:, 2], np.minimum(foot.toe[:, 2], foot.heel[:, 2]))
            rise = spread_peaks(solve_heel_rise(replace(foot, hip=hip), carried) * standing, self.spread)
            roll = quaternion.from_axis_angle(foot.left, rise)
            ankle = foot.toe + carried + quaternion.rotate(roll, foot.heel - foot.toe)
            goal = ankle - _measure_excess(foot, ankle - hip, standing)[:, None] * (ankle - hip)
            yield foot, goal, quaternion.multiply(roll, foot.rotation)

    def _measure_shortfall(self, places, move) -> np.ndarray:
        """Measure the metres (T,) that standing legs lack for a root moved by (T, 3) m, beyond what a heel may rise."""
        lacks = np.zeros(len(move))
        for foot, standing in zip(self.feet, self.standing):
            far = measure_lengths(foot.heel - places[:, foot.limb.upper_leg] - move)
            lacks = np.maximum(lacks, np.where(standing >= 1.0, far - foot.max_reach - _HEEL_REACH, 0.0))
        return lacks

    def _solve_legs(self, places, world, rotations, move) -> np.ndarray:
        """Solve the rotations (T, J, 4) with which both legs reach their feet from a root moved by (T, 3) m."""
        out, moved = rotations.copy(), _move_places(places, move)
        for foot, goal, turned in self._aim_legs(places, move):
            local, _ = solve_posed_limb(self.skeleton, moved, world, foot.limb.leg, goal, end_rotation=turned,
                                        soft=foot.ease_distance)
            for joint, rotation in local.items():
                out[:, joint] = rotation
        return out


def _measure_excess(foot: Foot, reach: np.ndarray, standing: np.ndarray) -> np.ndarray:
    """Measure the share (T,) of its reach (T, 3) m by which a swinging leg would be too long: it keeps a reserve."""
    far = measure_lengths(reach)
    longest = foot.length - np.minimum(AIR_RESERVE, foot.recorded_slack)
    return np.maximum(far - longest, 0.0) / far * (1.0 - standing)


def _move_places(places: np.ndarray, move: np.ndarray) -> np.ndarray:
    """Move joint positions (T, J, 3) m by (T, 3) m; they stay by component in memory."""
    return np.add(places, move[:, None], out=np.empty_like(places))


def _limit_moves(moves: np.ndarray) -> np.ndarray:
    """Limit moves (T, 3) m to _MOST_MOVE."""
    return moves * np.minimum(1.0, _MOST_MOVE / np.maximum(measure_lengths(moves)[..., None], 1e-9))
