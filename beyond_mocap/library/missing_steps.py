"""Side steps, calm backward walks and turns on the spot, where a library's recordings lack them.

Folders of motion capture walk forward; players who watch the ball go sideways and backward, and turn where they stand.
Where too little of that is recorded (`coverage`), the library's own people do it: a recorded walk played backward in
time is a backward walk (Winter, Pluck and Yang 1989: joint angles in backward walking are nearly those of forward
walking in reverse), and side steps and turns have synthetic legs (`synthetic.steps`) below the trunk and arms of
recorded frames: those of a calm stand, and of a walk at the same phase of the stride.

Only frames that belong (`posture`) are used. Mirrored twins give the other side.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..base.easing import smoothstep
from ..motion import quaternion
from ..motion.foot_plant import plant_feet
from ..motion.humanoid import compute_heading_from_positions, identify_joints
from ..motion.motion import Motion, compute_local_rotations, forward_kinematics
from ..motion.phase_blend import Strides, repeat_strides
from ..motion.retargeting.neutral import NeutralStance, build_neutral_stance
from ..motion.retargeting.posture import to_motion
from ..motion.retargeting.structure import list_descendants
from ..motion.skeleton import Skeleton
from ..motion.track import smooth_zero_phase_hann
from ..synthetic.steps import StepSequence, build_side_walk, build_steps_in_place
from .clip import BACK_PREFIX, SIDE_PREFIX, STEP_PREFIX, TURN_PREFIX
from .coverage import Coverage, find_calm_walks, select_calm_frames
from .features import Frames
from .loops.standing_loops import iter_standing_loops

"""How the names of the clips begin."""

_LOOP_SECONDS = 4.5  # of a walk
_WALKS_OF_SPEED = 2
_STEP_SHARE = 0.6  # exponent: how much of a change of speed is longer steps; the rest is tempo
_BACK_STEP = 0.92  # a backward step against a forward one at the same speed
_FACING_SECONDS = 0.7  # window that removes the shoulders' swing from the heading
_PHASES = 32  # of an averaged stride
_TRUNK_LEAD = 0.12  # s by which trunk and head turn before the legs
_ARM_SPEEDS = (0.2, 1.4)  # m/s from which on arms begin to swing, and swing as in the walk
_SYNTHETIC_DROP, _MOST_LOWERED = 0.012, 0.04  # m that synthetic hips are below straight legs, and are lowered


@dataclass(frozen=True, eq=False)
class Carriage:
    """How a library's people hold trunk and arms, as world rotations of all J joints relative to the heading.

    Attributes:
        stand: (T, J, 4) of a calm stand; None where no recording stands.
        stride: (N, J, 4) of a calm walk at even phases of one stride, from the left foot's landing on; None where no
            recording walks.
        drops: m by which hips are lower than above straight legs, in that stand and in mid-stance of that walk.
    """

    stand: np.ndarray | None
    stride: np.ndarray | None
    drops: tuple[float, float]

    def sample(self, phase: np.ndarray, speed: float) -> np.ndarray | None:
        """Sample trunk and arms (T, J, 4) at strides `phase` (T,), walking at a speed in m/s; None without any."""
        if self.stand is None or self.stride is None:
            return self._sample_stand(len(phase)) if self.stride is None else self._sample_stride(phase)
        share = compute_walk_share(speed)
        stand = self._sample_stand(len(phase))
        return quaternion.slerp(stand, self._sample_stride(phase), share) if share > 0.0 else stand

    def compute_drop(self, speed: float) -> float:
        """Compute how far, m, hips are below straight legs at a speed in m/s."""
        share = compute_walk_share(speed)
        return (1.0 - share) * self.drops[0] + share * self.drops[1]

    def _sample_stand(self, count: int) -> np.ndarray | None:
        return None if self.stand is None else self.stand[np.arange(count) % len(self.stand)]

    def _sample_stride(self, phase: np.ndarray) -> np.ndarray:
        from scipy.interpolate import CubicSpline

        grid = np.linspace(0.0, 1.0, len(self.stride) + 1)
        closed = quaternion.unify_signs(np.concatenate([self.stride, self.stride[:1]]))
        closed[-1] = self.stride[0]
        return quaternion.normalize(CubicSpline(grid, closed, bc_type="periodic")(phase % 1.0))


def compute_walk_share(speed: float) -> float:
    """Compute the share (0 to 1) of a walk, against a stand, in how a body holds itself at a speed in m/s."""
    return float(smoothstep(np.array(speed), *_ARM_SPEEDS))


def iter_missing_steps(
    clips: Sequence, frames: Frames, fps: float, strangeness: np.ndarray, coverage: Coverage, example: Motion,
    rate: float,
) -> Iterator[tuple[str, Motion, np.ndarray | None, float]]:
    """Iterate over the steps that a library lacks.

    Args:
        clips: of the library.
        frames: their description, N frames.
        fps: of the frames.
        strangeness: (N,) how far each frame lies from normal locomotion (`posture`).
        coverage: what the library lacks.
        example: a recording on the library's skeleton, for its neutral stance.
        rate: frames per second of the clips.
    Yields:
        Name, which begins with one of the prefixes; the motion; its contacts (T, 2, 2) bool of heels and toes,
        None where they have to be detected; and its speed, m/s, 0 from a stand to a stand.
    """
    walks = find_calm_walks(clips, frames, fps, select_calm_frames(clips, frames, fps, strangeness))
    for speed in coverage.back_speeds if walks else ():
        nearest = sorted(walks, key=lambda walk: abs(np.log(walk.speed / speed)))[:_WALKS_OF_SPEED]
        for number, walk in enumerate(nearest):
            yield f"{BACK_PREFIX}{speed:.1f}_{number + 1}", *reverse_walk(walk, speed, rate), speed
    neutral = build_neutral_stance(example.skeleton, example)
    carriage = measure_carriage(clips, frames, fps, strangeness, walks=walks, rate=rate)
    for speed, degrees, crosses in coverage.side_walks if walks else ():
        sequence = build_side_walk(speed, np.radians(degrees), _LOOP_SECONDS, rate, neutral, crosses=crosses)
        name = f"{SIDE_PREFIX}{degrees}_{speed:.1f}"
        yield name, lend_upper_body(sequence, neutral, carriage, speed), None, speed
    steps = [(f"{TURN_PREFIX}{np.degrees(turn):.0f}", (0.0, 0.0), turn) for turn in coverage.turns]
    steps += [(f"{STEP_PREFIX}{move[0]:.1f}_{move[1]:.1f}", move, 0.0) for move in coverage.moves]
    for name, move, turn in steps if coverage.has_stand else ():
        sequence = build_steps_in_place(move, turn, rate, neutral)
        yield name, lend_upper_body(sequence, neutral, carriage, 0.0), None, 0.0


def measure_carriage(clips: Sequence, frames: Frames, fps: float, strangeness: np.ndarray, walks: list[Strides],
                     rate: float) -> Carriage:
    """Measure how the longest calm stand and the first of `walks` hold trunk and arms; `rate` of the stand's frames."""
    loop = next((motion for _, motion in iter_standing_loops(clips, frames, fps, strangeness, rate)), None)
    bodies = [loop, walks[0].motion if walks else None]
    drops = [_SYNTHETIC_DROP if motion is None else _measure_hip_drop(motion) for motion in bodies]
    return Carriage(None if loop is None else _turn_ahead(loop), _average_stride(walks[0]) if walks else None,
                    (drops[0], drops[1]))


def _measure_hip_drop(motion: Motion) -> float:
    """Measure how far, m, hips are below straight legs where they are high above the standing foot."""
    body = identify_joints(motion.skeleton)
    positions, _ = forward_kinematics(motion)
    legs = [positions[:, [limb.upper_leg, limb.lower_leg, limb.foot]] for limb in (body.left, body.right)]
    length = np.mean([np.linalg.norm(np.diff(leg[0], axis=0), axis=-1).sum() for leg in legs])
    height = np.mean([leg[:, 0, 2] for leg in legs], axis=0) - np.min([leg[:, 2, 2] for leg in legs], axis=0)
    return float(length - np.percentile(height, 95))


def _turn_ahead(motion: Motion) -> np.ndarray:
    """Compute world rotations (T, J, 4) relative to the smoothed heading."""
    positions, world = forward_kinematics(motion)
    facing = np.unwrap(compute_heading_from_positions(motion.skeleton, positions))
    facing = smooth_zero_phase_hann(facing[:, None], motion.fps, _FACING_SECONDS)[:, 0]
    return quaternion.multiply(quaternion.from_up_angle(-facing)[:, None], world)


def _average_stride(walk: Strides) -> np.ndarray:
    """Average the strides of a walk: (N, J, 4) world rotations relative to the heading at even phases."""
    from scipy.interpolate import PchipInterpolator

    landings = walk.landings[walk.first_side :]
    phase = np.arange(0, len(landings) - 2, 2)[:, None] + 2.0 * np.arange(_PHASES) / _PHASES
    turned = _turn_ahead(walk.motion)
    at = np.round(PchipInterpolator(np.arange(len(landings)), landings)(phase)).astype(int)
    samples = turned[np.minimum(at, len(turned) - 1)]
    samples = samples * np.where(np.sum(samples * samples[:1], axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    return quaternion.unify_signs(quaternion.normalize(samples.sum(axis=0)))


def reverse_walk(walk: Strides, speed: float, rate: float) -> tuple[Motion, np.ndarray]:
    """Play a walk backward in time at another speed: steps become shorter or longer and the tempo changes.

    Args:
        walk: the recorded walk.
        speed: m/s, wanted.
        rate: frames per second of the result.
    Returns:
        The motion with planted feet, and its contacts (T, 2, 2) bool.
    Source: Winter, Pluck and Yang 1989, "Backward walking: a simple reversal of forward walking?"
    """
    ratio = speed / walk.speed
    length = _BACK_STEP * ratio**_STEP_SHARE
    motion, contacts = repeat_strides(walk, _LOOP_SECONDS, rate, tempo=-ratio / length, length=length)
    planted = plant_feet(motion.skeleton, motion.root_positions, motion.rotations, contacts, rate)
    return Motion(motion.skeleton, planted.root, planted.rotations, rate), contacts


def lend_upper_body(sequence: StepSequence, neutral: NeutralStance, carriage: Carriage, speed: float) -> Motion:
    """Put trunk and arms of recorded frames on synthetic legs, at the height at which the recorded body stands.

    Args:
        sequence: the legs, T frames.
        neutral: neutral stance of the skeleton.
        carriage: how the library's people hold themselves.
        speed: m/s, by which arms swing.
    Returns:
        The motion.
    """
    drop = np.clip(carriage.compute_drop(speed) - _SYNTHETIC_DROP, 0.0, _MOST_LOWERED)
    motion = to_motion(sequence.posture.replace_arrays(hips=sequence.posture.hips - [0.0, 0.0, drop]), neutral)
    lent = carriage.sample(sequence.phase, speed)
    if lent is None:
        return motion
    _, world = forward_kinematics(motion)
    heading = sequence.posture.heading
    lead = np.minimum(np.arange(len(heading)) + int(_TRUNK_LEAD * motion.fps), len(heading) - 1)
    upper = _list_upper_joints(motion.skeleton)
    world[:, upper] = quaternion.multiply(quaternion.from_up_angle(heading[lead])[:, None], lent[:, upper])
    rotations = motion.rotations.copy()
    rotations[:, upper] = compute_local_rotations(motion.skeleton, world)[:, upper]
    return Motion(motion.skeleton, motion.root_positions, rotations, motion.fps)


def _list_upper_joints(skeleton: Skeleton) -> list[int]:
    """List the joints of trunk, head and arms."""
    body = identify_joints(skeleton)
    legs = [j for j in skeleton.children(body.hips)
            if {body.left.upper_leg, body.right.upper_leg} & set(list_descendants(skeleton.parents, j))]
    lower = {0, body.hips}.union(*(list_descendants(skeleton.parents, j) for j in legs))
    return [j for j in range(len(skeleton)) if j not in lower]
