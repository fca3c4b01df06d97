"""Evaluate a trained model of throws or kicks on motions that it was not trained on.

`evaluate_throws(model, examples)` takes the description of each example, scaled by height to the model's body
(section 4.5), generates the motion and compares: hands and feet with their targets (eq. 4.1), the ball's impact with
its target, the head, smoothness, bone lengths, joint limits, computing time. The ball is held until the release and
leaves with its position and velocity then, between two frames, computed from a spline of the body's rotations: from
positions alone the velocity of a throwing hand, sampled 30 times per second, is a tenth too low.
Source: Fredriksson sections 4.5 and 8.3.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from functools import lru_cache

import numpy as np

from ..ball.flight import Launch, find_crossing, simulate_flight
from ..ball.physics import BASEBALL, Ball
from ..base.errors import InputError, UserCancelledError
from ..evaluation.paired_tests import find_inliers
from ..files.tables import to_plain
from ..motion import quaternion
from ..motion.humanoid import compute_heading, identify_joints
from ..motion.motion import Motion, compute_pose, forward_kinematics, sample_frames_cubic
from ..synthesis.quality.movement import compute_jerk
from ..synthetic.throws import find_grip
from .networks.chains import EFFECTORS, find_chains
from .networks.description import scale_description
from .networks.example import Example, build_description, orient_example
from .networks.generate import GeneratedMotion, Options, generate_motion
from .networks.kinematics import to_matrices
from .networks.limits import JointLimits
from .networks.model import ThrowModel

RAW_OPTIONS = Options(pose_iterations=0, ik=False, blend=False, limits=False, gaze=0.0)
"""Options of tables 8.1 to 8.4: the networks' output is fed back without corrections."""
FULL_OPTIONS = Options()
"""Options of tables 8.5 to 8.8: pose iterations, inverse kinematics, the blend of section 7.7.3."""
_OTHERS = ("far_impact", "own_impact", "facing", "head", "head_mean", "head_share", "jerk", "bones", "beyond",
           "seconds", "duration")
_LIMIT_TOLERANCE = 1e-3  # radians, tolerance of the joint limits
MAX_VALID_DEVIATION = 0.5
"""m: a motion with a hand or foot further off on average has failed and is excluded from all means."""
WALL_DISTANCE = 4.0
"""m from the thrower to the target of all of Fredriksson's throws, a square of 3 m (section 8.2)."""
_HALF_STEP = 0.02  # frames before and after the release between which the ball's velocity is measured
_MAX_FLIGHT = 8.0  # s, longest flight


@dataclass(frozen=True, eq=False, kw_only=True)
class ThrowFigures:
    """Figures of one generated motion.

    Attributes:
        name: the example's name.
        subject: the example's subject.
        deviation: (4,) m, mean distance of wrists and toes from their targets in the final motion.
        network: (4,) m, the same for the networks' prediction of each frame, before any correction.
        body: (4,) m, as deviation, but of a body with bones of constant length also where the joints of a single
            network are inconsistent, which `deviation` follows as the thesis' tables do.
        impact: m between the impacts of the generated and the requested ball on a wall 4 m from the thrower (section
            8.2), or on the ground before; NaN without a hand that throws.
        far_impact: m, the same at the distance of the target.
        own_impact: m there, from the requested ball to the target: the effect of scaling on the flight.
        facing: degrees between the headings of the bodies.
        head: degrees between the heads' rotations.
        head_mean: degrees, as head, if the generated body held its head as the examples do on average; a head that is
            further off says less than the trunk alone.
        head_share: rotation of the head relative to the chest, divided by the example's.
        jerk: its 99th percentile, divided by the example's.
        bones: m, largest change of a bone's length.
        beyond: share of rotations outside the joint limits, NaN if the model has no limits.
        seconds: computing time.
        duration: s of the motion.
    """

    name: str
    subject: str
    deviation: np.ndarray
    network: np.ndarray
    body: np.ndarray
    impact: float
    far_impact: float
    own_impact: float
    facing: float
    head: float
    head_mean: float
    head_share: float
    jerk: float
    bones: float
    beyond: float
    seconds: float
    duration: float


@dataclass(frozen=True, eq=False)
class ThrowEvaluation:
    """Evaluation of a model.

    Attributes:
        motions: figures of each motion.
        options: options with which they were generated.
        left_out: one line for each motion that was left out.
    """

    motions: tuple[ThrowFigures, ...]
    options: Options
    left_out: tuple[str, ...] = field(default=())

    @property
    def deviations(self) -> np.ndarray:
        """Deviations (N, 4) m of the final motions."""
        return np.array([one.deviation for one in self.motions]).reshape(-1, 4)

    @property
    def impacts(self) -> np.ndarray:
        """Impact errors (N,) m."""
        return np.array([one.impact for one in self.motions])

    def build_report(self) -> dict:
        """Collect all figures, as `files.tables` writes them; means are over finite values of valid motions."""
        has_failed = find_failed(self.deviations)
        valid = [one for one, gone in zip(self.motions, has_failed, strict=True) if not gone]
        impact = self.impacts[~has_failed]
        inside = find_inliers(impact)

        def compute_means(name: str) -> dict[str, float]:
            columns = np.array([getattr(one, name) for one in valid]).reshape(-1, 4).T
            return dict(zip(EFFECTORS, map(_compute_mean, columns), strict=True))

        return {
            "options": asdict(self.options), "left_out": list(self.left_out), "motions": len(self.motions),
            "lost": int(has_failed.sum()), "subjects": sorted({one.subject for one in self.motions}),
            "deviation_m": compute_means("deviation"), "network_deviation_m": compute_means("network"),
            "body_deviation_m": compute_means("body"), "impact_m": _compute_mean(impact[inside]),
            "impacts_culled": int(np.isfinite(impact).sum() - inside.sum()),
            **{name: _compute_mean([getattr(one, name) for one in valid]) for name in _OTHERS},
            "each": [to_plain(vars(one)) for one in self.motions],
        }  # fmt: skip


def select_of_each(examples: Sequence[Example], motions: int | None) -> list[Example]:
    """Select at most `motions` examples of each subject, evenly spaced; None for all."""
    if motions is None:
        return list(examples)
    out = []
    for subject in dict.fromkeys(example.subject for example in examples):
        own = [example for example in examples if example.subject == subject]
        out += [own[i] for i in np.unique(np.linspace(0, len(own) - 1, min(motions, len(own))).round().astype(int))]
    return out


def evaluate_throws(
    model: ThrowModel, examples: Sequence[Example], options: Options = FULL_OPTIONS, *, by_height: bool = True,
    progress: Callable[[float, str], None] = lambda fraction, text: None, cancelled: Callable[[], bool] = lambda: False,
) -> ThrowEvaluation:
    """Evaluate a model on examples at its frame rate, on any skeletons.

    Args:
        model: the model.
        examples: the examples.
        options: options of generation.
        by_height: scale the description by the ratio of the model's stature to the example's (section 4.5).
        progress: receives a share of 0 .. 1 and a text.
        cancelled: returns True to stop.
    Returns:
        The figures; a motion that cannot be generated is left out and listed.
    """
    found, left_out = [], []
    for order, example in enumerate(examples):
        if cancelled():
            raise UserCancelledError("cancelled")
        progress(order / len(examples), example.name)
        try:
            found.append(_measure_example(model, example, options, model.stature / example.stature if by_height
                                          else 1.0))
        except (ArithmeticError, np.linalg.LinAlgError, InputError) as error:
            left_out.append(f"{example.name}: {error}")
    return ThrowEvaluation(tuple(found), options, tuple(left_out))


def _measure_example(model: ThrowModel, example: Example, options: Options, ratio: float) -> ThrowFigures:
    """Generate one example and measure its figures."""
    description = scale_description(build_description(example), ratio)
    generated = generate_motion(model, description, options=options)
    effectors = generated.predicted if generated.floating is not None and not options.ik else generated.effectors
    near, far, own = _measure_impacts(generated.motion, effectors - generated.effectors, example, ratio,
                                      description.impact)
    head, share = _measure_head(generated.motion, example.motion)
    return ThrowFigures(
        name=example.name, subject=example.subject, deviation=measure_deviations(effectors, description.effectors),
        network=measure_deviations(generated.predicted, description.effectors),
        body=measure_deviations(generated.effectors, description.effectors), impact=near, far_impact=far,
        own_impact=own, facing=_measure_facing(generated.motion, example.motion), head=head,
        head_mean=_measure_mean_head(model, generated.motion, example), head_share=share,
        jerk=_measure_jerk(generated.motion) / max(ratio * _measure_jerk(example.motion), 1e-9),
        bones=_measure_bones(model, generated), beyond=_measure_limit_excess(model, generated.motion),
        seconds=generated.seconds, duration=example.motion.duration,
    )  # fmt: skip


def _measure_impacts(motion: Motion, shift: np.ndarray, example: Example, ratio: float, target) -> tuple[float, float,
        float]:
    """Measure the impact errors; NaN for kicks.

    The requested ball is the example's, scaled, in a hand as large as the model's.

    Args:
        motion: the generated motion.
        shift: (T, 4, 3) m, offset of the effectors from the motion's.
        example: the example.
        ratio: scale of the body.
        target: (3,) m.
    Returns:
        m between generated and requested impact at 4 m and at the target, and from the requested impact to the
        target.
    """
    if example.limb not in (0, 1):
        return np.nan, np.nan, np.nan
    grip = find_grip(motion.skeleton, ("left", "right")[example.limb], BASEBALL.radius)
    own_hand, example_hand = (find_chains(of.skeleton).effectors[example.limb] for of in (motion, example.motion))
    generated_ball = release_ball(motion, own_hand, grip, example.release, shift[:, example.limb])
    place, speed = release_ball(example.motion, example_hand, grip / ratio, example.release)
    requested_ball = ratio * place, ratio * speed
    near, far = np.array([WALL_DISTANCE, 0.0, target[2]]), np.asarray(target)
    errors = [np.linalg.norm(find_impact(*generated_ball, there) - find_impact(*requested_ball, there))
              for there in (near, far)]
    return float(errors[0]), float(errors[1]), float(np.linalg.norm(find_impact(*requested_ball, far) - far))


def _measure_head(motion: Motion, truth: Motion) -> tuple[float, float]:
    """Measure how the head's rotation differs from the true one; NaN for bodies without a head.

    Returns:
        Mean angle in degrees, and the head's total rotation relative to the chest divided by the true one.
    """
    head_rotations, relative_rotations = [], []
    for one in (motion, truth):
        body = identify_joints(one.skeleton)
        if body.head is None:
            return np.nan, np.nan
        rotations = forward_kinematics(one)[1]
        head_rotations.append(rotations[:, body.head])
        own = quaternion.multiply(quaternion.inverse(rotations[:, body.chest]), head_rotations[-1])
        relative_rotations.append(_compute_angles(own[:-1], own[1:]).sum())
    return float(np.degrees(_compute_angles(*head_rotations).mean())), float(relative_rotations[0]
                                                                             / max(relative_rotations[1], 1e-9))


def _measure_facing(motion: Motion, truth: Motion) -> float:
    """Measure the mean angle in degrees between the headings of two motions."""
    return float(np.degrees(np.abs(quaternion.wrap_angle(compute_heading(motion) - compute_heading(truth))).mean()))


def _measure_mean_head(model: ThrowModel, motion: Motion, example: Example) -> float:
    """Measure how far (degrees) the true head is from the examples' mean head on a body; NaN without a head."""
    truth = example.motion
    head = identify_joints(truth.skeleton).head
    if head is None or not model.examples or identify_joints(model.skeleton).head is None:
        return np.nan
    held = quaternion.multiply(quaternion.from_up_angle(compute_heading(motion)),
                               _average_head(model, example.limb))
    return float(np.degrees(_compute_angles(held, forward_kinematics(truth)[1][:, head]).mean()))


@lru_cache(maxsize=8)
def _average_head(model: ThrowModel, limb: int) -> np.ndarray:
    """Average the heads of a model's examples relative to their headings, a quaternion (1, 4); those of the other limb
    are mirrored.
    """
    head = identify_joints(model.skeleton).head
    motions = [orient_example(example, limb).motion for example in model.examples]
    relative = np.concatenate([quaternion.multiply(
        quaternion.from_up_angle(-compute_heading(motion)), forward_kinematics(motion)[1][:, head])
        for motion in motions])
    return quaternion.average(relative, np.ones((1, len(relative))))


def _compute_angles(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Compute the angles (N,) in radians between rotations (N, 4)."""
    return np.linalg.norm(quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(a), b)), axis=-1)


def _measure_jerk(motion: Motion) -> float:
    """Measure the 99th percentile of the largest jerk (m/s^3) of any joint."""
    return float(np.percentile(compute_jerk(forward_kinematics(motion)[0], motion.fps),
                               99)) if len(motion) > 3 else np.nan


def _measure_bones(model: ThrowModel, generated: GeneratedMotion) -> float:
    """Measure the largest change (m) of a bone's length: zero unless a single network's joints are inconsistent."""
    if generated.floating is None:
        return 0.0
    joints, parents = find_chains(model.skeleton).joints, model.skeleton.parents
    pairs = [(row, joints.index(parents[joint]), joint) for row, joint in enumerate(joints) if parents[joint] in joints]
    own, above, joint = (list(column) for column in zip(*pairs, strict=True))
    lengths = np.linalg.norm(generated.floating[:, own] - generated.floating[:, above], axis=-1)
    return float(np.abs(lengths - np.linalg.norm(model.skeleton.offsets[joint], axis=-1)).max())


def _measure_limit_excess(model: ThrowModel, motion: Motion) -> float:
    """Measure the share of all rotations outside the joint limits."""
    if model.joint_limits is None:
        return np.nan
    beyond = JointLimits(model.skeleton, model.joint_limits).measure_excess(to_matrices(motion))
    return float(np.mean(beyond > _LIMIT_TOLERANCE))


def _compute_mean(values) -> float:
    """Compute the mean of the finite values; NaN if there are none."""
    values = np.asarray(values, float)
    values = values[np.isfinite(values)]
    return float(values.mean()) if len(values) else np.nan


def measure_deviations(generated: np.ndarray, requested: np.ndarray) -> np.ndarray:
    """Measure the mean distance (4,) m over the frames of one motion.

    Args:
        generated: (T, 4, 3) m, left hand, right hand, left foot, right foot.
        requested: (T, 4, 3) m, in the same frame of reference.
    """
    return np.linalg.norm(np.asarray(generated, float) - np.asarray(requested, float), axis=-1).mean(axis=0)


def find_failed(deviations: np.ndarray) -> np.ndarray:
    """Find the motions (N,) bool of deviations (N, 4) m that failed."""
    deviations = np.asarray(deviations, float).reshape(-1, 4)
    return ~np.all(deviations < MAX_VALID_DEVIATION, axis=-1)


def release_ball(
    motion: Motion, joint: int, grip: np.ndarray, release: float, shift: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Compute how a held ball leaves a hand at a fractional frame.

    Args:
        motion: the motion.
        joint: hand joint.
        grip: (3,) m, centre of the ball in the joint's own axes.
        release: fractional frame.
        shift: (T, 3) m, offset of the hand from the motion's in each frame, for networks with inconsistent joints.
    Returns:
        Position (3,) m and velocity (3,) m/s.
    """
    from scipy.interpolate import CubicSpline

    frames = np.clip(release + np.array([-_HALF_STEP, 0.0, _HALF_STEP]), 0.0, len(motion) - 1)
    places, turns = compute_pose(motion.skeleton, *sample_frames_cubic(motion, frames))
    ball = places[:, joint] + quaternion.rotate(turns[:, joint], np.asarray(grip, float))
    if shift is not None:
        ball = ball + CubicSpline(np.arange(len(motion)), shift)(frames)
    return ball[1], (ball[2] - ball[0]) * motion.fps / (frames[2] - frames[0])


def find_impact(place: np.ndarray, velocity: np.ndarray, target: np.ndarray, ball: Ball = BASEBALL) -> np.ndarray:
    """Find where a ball without spin first crosses the vertical plane through the target or the ground.

    Args:
        place: (3,) m, start of the ball.
        velocity: (3,) m/s.
        target: (3,) m; the plane is perpendicular to the horizontal line to it.
        ball: kind of ball.
    Returns:
        (3,) m; NaN if the ball reaches neither.
    """
    return find_crossing(simulate_flight(Launch(0.0, place, velocity), ball, _MAX_FLIGHT), target)
