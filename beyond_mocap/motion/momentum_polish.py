"""A body that obeys momentum: the last polish of a construction, after its feet are planted.

Stances are found anew (`supports`), bends, starts and stops get their lean (`lean`), a centre of mass is planned that
flies on parabolas and is pushed only by feet on the ground (`momentum`), and the body follows it: its root moves,
standing feet stay, swinging feet go with the pelvis, heels rise where a leg does not reach. Where that is not enough
the plan is made anew with a lower body.

The root takes the whole correction. With a third of it in the trunk the head accelerates 9 % more, with two thirds 25 %
(../shared/prototype-momentum.md); a metric over the skeleton's graph, as ProjFlow has it for corrections of single
joints, spreads a level shift evenly over the body, which is a shift of the root.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from . import quaternion
from .foot_plant import AIR_RESERVE, Foot, build_foot, solve_heel_rise, spread_peaks
from .humanoid import Humanoid, identify_joints
from .lean import choose_angles, choose_shifts, compute_footprint_shifts, measure_lean, tilt_body
from .limb import solve_posed_limb
from .mass import SEGMENT_MASSES, SegmentMasses, compute_centre_of_mass
from .momentum import STRENGTH, MomentumPlanner
from .motion import compute_pose
from .skeleton import Skeleton
from .supports import Stances, find_stances, find_support_phases

_FADE_FRAMES = 3.0  # frames at 30 fps outside of a stance over which a foot comes to go with the pelvis
_PELVIS_GAIN = 1.12  # m that the root moves per metre of the centre of mass: standing legs and feet stay behind
_REACH_ROUNDS, _REACH_TOLERANCE = 3, 0.004  # plans, and metres that a leg may lack
_FIRMNESS = 9.0  # by which a lowered height weighs more than others
_SPREAD_FRAMES = 2  # frames at 30 fps over which it is spread


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
    phases = find_support_phases(stances, compute_centre_of_mass(body, places, masses), fps)
    if not len(stances) or (len(phases) == 1 and phases[0, 0] <= 0.0 and phases[0, 1] >= len(root) - 1):
        return root, rotations
    legs = _Legs(skeleton, body, masses, places, world, stances=stances, fps=fps)
    root, rotations = legs.lean(root, rotations, share)
    planner = MomentumPlanner(phases, len(root), fps, share, strength)
    return legs.follow(planner, root, rotations)


class _Legs:
    """The feet of a body before its correction, and how legs follow a root that moves."""

    def __init__(self, skeleton: Skeleton, body: Humanoid, masses: SegmentMasses, places, world, stances: Stances,
                 fps: float):
        self.skeleton, self.body, self.masses, self.stances, self.fps = skeleton, body, masses, stances, fps
        self._places, count = places, len(places)
        self._standing = [stances.compute_share(side, count, _FADE_FRAMES * fps / 30.0) for side in (0, 1)]
        self._feet = [build_foot(places, world, limb, np.repeat(standing[:, None] > 0.0, 2, axis=1))
                      for limb, standing in zip((body.left, body.right), self._standing)]
        self._spread = max(int(round(_SPREAD_FRAMES * fps / 30.0)), 1)

    def lean(self, root, rotations, share) -> tuple[np.ndarray, np.ndarray]:
        """Move the footprints and turn the body about its centre of mass, by what its stances lack."""
        centre = compute_centre_of_mass(self.body, self._places, self.masses)
        lean = measure_lean(self.body, self._places, centre, self.stances, self.fps)
        shifts = choose_shifts(lean, np.interp(self.stances.middle, np.arange(len(share)), share))
        moves = compute_footprint_shifts(self.stances, shifts, len(root))
        self._feet = [foot.move(np.column_stack([moves[:, side], np.zeros(len(root))]))
                      for side, foot in enumerate(self._feet)]
        return tilt_body(root, rotations, centre, self.stances, choose_angles(lean, shifts), self.fps)

    def follow(self, planner: MomentumPlanner, root, rotations) -> tuple[np.ndarray, np.ndarray]:
        """Move the root so that the centre of mass follows its plan; feet stay where they stand."""
        places, world = compute_pose(self.skeleton, root, rotations)
        still = np.zeros_like(root)
        posed = self._solve_legs(places, world, rotations, still)
        centre = self._measure_centre(root, posed)
        goal, firmness = centre[:, 2].copy(), np.ones(len(root))
        for _ in range(_REACH_ROUNDS):
            height, force = planner.plan_height(goal, firmness)
            plan = np.column_stack([planner.plan_ground(centre[:, :2], force), height])
            move = _PELVIS_GAIN * (plan - centre)
            lacks = self._measure_shortfall(places, move)
            if lacks.max() < _REACH_TOLERANCE:
                break
            lacks = spread_peaks(lacks, self._spread)
            goal, firmness = goal - planner.share * lacks, np.where(lacks > 0.0, _FIRMNESS, firmness)
        posed = self._solve_legs(places, world, rotations, move)
        move = move + plan - self._measure_centre(root + move, posed)
        return root + move, quaternion.unify_signs(self._solve_legs(places, world, rotations, move))

    def _measure_centre(self, root, rotations) -> np.ndarray:
        """Measure the centre of mass (T, 3) m of a pose."""
        return compute_centre_of_mass(self.body, compute_pose(self.skeleton, root, rotations)[0], self.masses)

    def _aim_feet(self, places, move):
        """Yield (foot, hip (T, 3), ankle goal (T, 3), foot's rotation (T, 4), standing (T,)) for a root moved (T, 3)."""
        for foot, standing in zip(self._feet, self._standing):
            hip = places[:, foot.limb.upper_leg] + move
            carried = (1.0 - standing)[:, None] * move
            rise = spread_peaks(solve_heel_rise(replace(foot, hip=hip), carried) * standing, self._spread)
            roll = quaternion.from_axis_angle(foot.left, rise)
            ankle = foot.toe + carried + quaternion.rotate(roll, foot.heel - foot.toe)
            yield foot, hip, ankle, quaternion.multiply(roll, foot.rotation), standing

    def _measure_shortfall(self, places, move) -> np.ndarray:
        """Measure the metres (T,) that standing legs lack for a root moved by (T, 3) m."""
        return np.max([np.where(standing >= 1.0, np.linalg.norm(ankle - hip, axis=1) - foot.max_reach, 0.0).clip(0.0)
                       for foot, hip, ankle, _, standing in self._aim_feet(places, move)], axis=0)

    def _solve_legs(self, places, world, rotations, move) -> np.ndarray:
        """Solve the rotations (T, J, 4) with which both legs reach their feet from a root moved by (T, 3) m."""
        out, moved = rotations.copy(), places + move[:, None]
        for foot, hip, ankle, turned, standing in self._aim_feet(places, move):
            goal = ankle - _measure_excess(foot, ankle - hip, standing)[:, None] * (ankle - hip)
            chain = (foot.limb.upper_leg, foot.limb.lower_leg, foot.limb.foot)
            local, _ = solve_posed_limb(self.skeleton, moved, world, chain, goal, end_rotation=turned,
                                        soft=foot.ease_distance)
            for joint, rotation in local.items():
                out[:, joint] = rotation
        return out


def _measure_excess(foot: Foot, reach: np.ndarray, standing: np.ndarray) -> np.ndarray:
    """Measure the share (T,) of its reach (T, 3) m by which a swinging leg would be too long: it keeps a reserve."""
    far = np.linalg.norm(reach, axis=1)
    longest = foot.length - np.minimum(AIR_RESERVE, foot.recorded_slack)
    return np.maximum(far - longest, 0.0) / far * (1.0 - standing)
