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

import numpy as np

from ..ball.flight import Launch, find_crossing, fly
from ..ball.physics import BASEBALL, Ball
from ..base.errors import Cancelled, InputError
from ..evaluation.paired_tests import kept
from ..files.tables import plain
from ..motion import quaternion
from ..motion.hand import hand_of, usual_centre
from ..motion.humanoid import identify
from ..motion.motion import Motion, cubic_at, forward_kinematics, pose_kinematics
from ..synthesis.quality.movement import jerk
from .networks.chains import EFFECTORS, chains_of
from .networks.description import scaled
from .networks.example import Example, describe
from .networks.generate import Generated, Options, generate
from .networks.kinematics import matrices
from .networks.limits import JointLimits
from .networks.model import ThrowModel

RAW = Options(pose_iterations=0, ik=False, blend=False, limits=False)
"""Options of tables 8.1 to 8.4: the networks' output is fed back without corrections."""
FULL = Options()
"""Options of tables 8.5 to 8.8: pose iterations, inverse kinematics, the blend of section 7.7.3."""
_OTHERS = ("far_impact", "own_impact", "head", "head_share", "jerk", "bones", "beyond", "seconds", "duration")
_WITHIN = 1e-3  # radians, tolerance of the joint limits
LOST = 0.5
"""m: a motion with a hand or foot further off on average has failed and is excluded from all means."""
WALL = 4.0
"""m from the thrower to the target of all of Fredriksson's throws, a square of 3 m (section 8.2)."""
_HALF = 0.02  # frames before and after the release between which the ball's velocity is measured
_LONGEST = 8.0  # s, longest flight


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
        head: degrees between the heads' rotations.
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
    head: float
    head_share: float
    jerk: float
    bones: float
    beyond: float
    seconds: float
    duration: float


@dataclass(frozen=True, eq=False)
class Evaluated:
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
    def deviation(self) -> np.ndarray:
        """Deviations (N, 4) m of the final motions."""
        return np.array([one.deviation for one in self.motions]).reshape(-1, 4)

    @property
    def network(self) -> np.ndarray:
        """Deviations (N, 4) m before any correction."""
        return np.array([one.network for one in self.motions]).reshape(-1, 4)

    @property
    def impact(self) -> np.ndarray:
        """Impact errors (N,) m."""
        return np.array([one.impact for one in self.motions])

    def report(self) -> dict:
        """Collect all figures, as `files.tables` writes them; means are over finite values of valid motions."""
        lost = find_lost(self.deviation)
        whole = [one for one, gone in zip(self.motions, lost, strict=True) if not gone]
        impact = self.impact[~lost]
        inside = kept(impact)

        def means_of(name: str) -> dict[str, float]:
            columns = np.array([getattr(one, name) for one in whole]).reshape(-1, 4).T
            return dict(zip(EFFECTORS, map(_mean, columns), strict=True))

        return {
            "options": asdict(self.options), "left_out": list(self.left_out), "motions": len(self.motions),
            "lost": int(lost.sum()), "subjects": sorted({one.subject for one in self.motions}),
            "deviation_m": means_of("deviation"), "network_deviation_m": means_of("network"),
            "body_deviation_m": means_of("body"), "impact_m": _mean(impact[inside]),
            "impacts_culled": int(np.isfinite(impact).sum() - inside.sum()),
            **{name: _mean([getattr(one, name) for one in whole]) for name in _OTHERS},
            "each": [plain(vars(one)) for one in self.motions],
        }  # fmt: skip


def some_of_each(examples: Sequence[Example], motions: int | None) -> list[Example]:
    """Select at most `motions` examples of each subject, evenly spaced; None for all."""
    if motions is None:
        return list(examples)
    out = []
    for subject in dict.fromkeys(example.subject for example in examples):
        own = [example for example in examples if example.subject == subject]
        out += [own[i] for i in np.unique(np.linspace(0, len(own) - 1, min(motions, len(own))).round().astype(int))]
    return out


def evaluate_throws(
    model: ThrowModel, examples: Sequence[Example], options: Options = FULL, *, by_height: bool = True,
    progress: Callable[[float, str], None] = lambda fraction, text: None, cancelled: Callable[[], bool] = lambda: False,
) -> Evaluated:
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
            raise Cancelled("cancelled")
        progress(order / len(examples), example.name)
        try:
            found.append(_measured(model, example, options, model.stature / example.stature if by_height else 1.0))
        except (ArithmeticError, np.linalg.LinAlgError, InputError) as error:
            left_out.append(f"{example.name}: {error}")
    return Evaluated(tuple(found), options, tuple(left_out))


def _measured(model: ThrowModel, example: Example, options: Options, ratio: float) -> ThrowFigures:
    """Generate one example and measure its figures."""
    description = scaled(describe(example), ratio)
    made = generate(model, description, options=options)
    came = made.predicted if made.floating is not None and not options.ik else made.effectors
    near, far, own = _impacts(made.motion, came - made.effectors, example, ratio, description.impact)
    head, share = _head(made.motion, example.motion)
    return ThrowFigures(
        name=example.name, subject=example.subject, deviation=deviations(came, description.effectors),
        network=deviations(made.predicted, description.effectors),
        body=deviations(made.effectors, description.effectors), impact=near, far_impact=far, own_impact=own, head=head,
        head_share=share, jerk=_jerk(made.motion) / max(ratio * _jerk(example.motion), 1e-9), bones=_bones(model, made),
        beyond=_beyond(model, made.motion), seconds=made.seconds, duration=example.motion.duration,
    )  # fmt: skip


def _impacts(motion: Motion, shift: np.ndarray, example: Example, ratio: float, target) -> tuple[float, float, float]:
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
    hand = hand_of(motion, ("left", "right")[example.limb])
    grip = usual_centre(hand.finger, hand.reach)
    mine, its = (chains_of(of.skeleton).effectors[example.limb] for of in (motion, example.motion))
    came = let_go(motion, mine, grip, example.release, shift[:, example.limb])
    place, speed = let_go(example.motion, its, grip / ratio, example.release)
    wanted = ratio * place, ratio * speed
    near, far = np.array([WALL, 0.0, target[2]]), np.asarray(target)
    off = [np.linalg.norm(find_impact(*came, there) - find_impact(*wanted, there)) for there in (near, far)]
    return float(off[0]), float(off[1]), float(np.linalg.norm(find_impact(*wanted, far) - far))


def _head(motion: Motion, truth: Motion) -> tuple[float, float]:
    """Measure how the head's rotation differs from the true one; NaN for bodies without a head.

    Returns:
        Mean angle in degrees, and the head's total rotation relative to the chest divided by the true one.
    """
    turns, against = [], []
    for one in (motion, truth):
        body = identify(one.skeleton)
        if body.head is None:
            return np.nan, np.nan
        rotations = forward_kinematics(one)[1]
        turns.append(rotations[:, body.head])
        own = quaternion.multiply(quaternion.inverse(rotations[:, body.chest]), turns[-1])
        against.append(_angles(own[:-1], own[1:]).sum())
    return float(np.degrees(_angles(*turns).mean())), float(against[0] / max(against[1], 1e-9))


def _angles(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Compute the angles (N,) in radians between rotations (N, 4)."""
    return np.linalg.norm(quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(a), b)), axis=-1)


def _jerk(motion: Motion) -> float:
    """Measure the 99th percentile of the largest jerk (m/s^3) of any joint."""
    return float(np.percentile(jerk(forward_kinematics(motion)[0], motion.fps), 99)) if len(motion) > 3 else np.nan


def _bones(model: ThrowModel, made: Generated) -> float:
    """Measure the largest change (m) of a bone's length: zero unless a single network's joints are inconsistent."""
    if made.floating is None:
        return 0.0
    joints, parents = chains_of(model.skeleton).joints, model.skeleton.parents
    pairs = [(row, joints.index(parents[joint]), joint) for row, joint in enumerate(joints) if parents[joint] in joints]
    own, above, joint = (list(column) for column in zip(*pairs, strict=True))
    lengths = np.linalg.norm(made.floating[:, own] - made.floating[:, above], axis=-1)
    return float(np.abs(lengths - np.linalg.norm(model.skeleton.offsets[joint], axis=-1)).max())


def _beyond(model: ThrowModel, motion: Motion) -> float:
    """Measure the share of all rotations outside the joint limits."""
    if model.joint_limits is None:
        return np.nan
    beyond = JointLimits(model.skeleton, model.joint_limits).beyond(matrices(motion))
    return float(np.mean(beyond > _WITHIN))


def _mean(values) -> float:
    """Compute the mean of the finite values; NaN if there are none."""
    values = np.asarray(values, float)
    values = values[np.isfinite(values)]
    return float(values.mean()) if len(values) else np.nan


def deviations(generated: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Measure the mean distance (4,) m over the frames of one motion.

    Args:
        generated: (T, 4, 3) m, left hand, right hand, left foot, right foot.
        requested: (T, 4, 3) m, in the same frame of reference.
    """
    return np.linalg.norm(np.asarray(generated, float) - np.asarray(wanted, float), axis=-1).mean(axis=0)


def find_lost(deviations: np.ndarray) -> np.ndarray:
    """Find the motions (N,) bool of deviations (N, 4) m that failed."""
    deviations = np.asarray(deviations, float).reshape(-1, 4)
    return ~np.all(deviations < LOST, axis=-1)


def let_go(
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

    frames = np.clip(release + np.array([-_HALF, 0.0, _HALF]), 0.0, len(motion) - 1)
    places, turns = pose_kinematics(motion.skeleton, *cubic_at(motion, frames))
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
    return find_crossing(fly(Launch(0.0, place, velocity), ball, _LONGEST), target)
