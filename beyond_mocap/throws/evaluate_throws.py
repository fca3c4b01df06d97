"""The recipe: how good a trained model of throws or kicks is on motions that it never saw (Fredriksson §4.5, §8.3).

`evaluate_throws(model, examples)` takes what was known of each example beforehand, scaled by height to the model's body
as §4.5 has it, generates the motion again, and compares: hands and feet with where they were wanted (eq. 4.1), where
the ball goes with where it was to go, the head, the smoothness, the bones, joints' limits, seconds. The ball is held
until the release and leaves with the place and velocity that it has then between two frames, read off a spline of the
body's rotations: by places alone a hand that throws, seen 30 times a second, is a tenth too slow.
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
"""As tables 8.1 to 8.4 were measured: what networks say is fed back, nothing corrects it."""
FULL = Options()
"""As tables 8.5 to 8.8: pose iterations, inverse kinematics, the blend of §7.7.3."""
_OTHERS = ("far_impact", "own_impact", "head", "head_share", "jerk", "bones", "beyond", "seconds", "duration")
_WITHIN = 1e-3  # radians beyond a limit that are none
LOST = 0.5
"""m: a motion with a hand or foot farther off than that, on average, has lost its body; no mean says anything of it."""
WALL = 4.0
"""m from the thrower to the target that all of his threw at, a square of 3 m (Fredriksson §8.2)."""
_HALF = 0.02  # frames before and after the release between which the ball's velocity is read
_LONGEST = 8.0  # s


@dataclass(frozen=True, eq=False, kw_only=True)
class ThrowFigures:
    """One motion generated anew.

    name, subject: the example's. deviation (4,) m: mean distance of wrists and toes from where they were wanted, of the
    motion as it comes out. network (4,) m: the same of what the networks said in each frame, before anything corrected
    it. body (4,) m: as deviation, but of a body with bones of constant length also where the joints of a single network
    float, which `deviation` follows as his tables do. impact m: from where the ball of the generated motion crosses a
    wall 4 m from the thrower (§8.2), or meets the ground before, to where the ball of the wanted one does; NaN without
    a hand that throws. far_impact m: the same where its target is. own_impact m: there, from the wanted ball to the
    target, which tells what scaling does to a flight. head: degrees between the heads' rotations. head_share: how much
    the head turns against the chest, over how much the example's does. jerk: the 99th percentile of it over the
    example's. bones m: by how much the bone that changes most changes. beyond: share of rotations beyond the joints'
    limits, NaN where the model knows none. seconds: that it took, of `duration` s."""

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
    """motions: one entry each. options: with which they were generated. left_out: lines, one each."""

    motions: tuple[ThrowFigures, ...]
    options: Options
    left_out: tuple[str, ...] = field(default=())

    @property
    def deviation(self) -> np.ndarray:
        """(N, 4) m."""
        return np.array([one.deviation for one in self.motions]).reshape(-1, 4)

    @property
    def network(self) -> np.ndarray:
        """(N, 4) m, before anything corrected it."""
        return np.array([one.network for one in self.motions]).reshape(-1, 4)

    @property
    def impact(self) -> np.ndarray:
        """(N,) m."""
        return np.array([one.impact for one in self.motions])

    def report(self) -> dict:
        """All of it, as `files.tables` writes it; means are over what are numbers, of motions that kept their body."""
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
    """At most so many examples of each subject, evenly taken from all of his; None for all."""
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
    """The figures of a model on examples at its rate, on any skeletons. by_height: scale what is asked for by the ratio
    of the model's stature to the example's (§4.5). A motion that cannot be generated is left out and told."""
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
    """One example generated anew and compared."""
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
    """m between the impacts of the generated and the wanted ball on a wall at his 4 m and at the target, and of the
    wanted one from the target; NaN for kicks.

    The wanted ball is the example's, scaled, in a hand as large as the model's. shift (T, 4, 3) m: how far from the
    motion's the effectors are."""
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
    """Mean angle between the heads' rotations in degrees, and how much the head turns against the chest over how much
    the true one does; NaN for bodies without a head."""
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
    """Angles (N,) in radians between rotations (N, 4)."""
    return np.linalg.norm(quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(a), b)), axis=-1)


def _jerk(motion: Motion) -> float:
    """m/s^3: the 99th percentile of the largest jerk of any joint."""
    return float(np.percentile(jerk(forward_kinematics(motion)[0], motion.fps), 99)) if len(motion) > 3 else np.nan


def _bones(model: ThrowModel, made: Generated) -> float:
    """m by which a bone changes at most: nothing but in a single network, whose joints float."""
    if made.floating is None:
        return 0.0
    joints, parents = chains_of(model.skeleton).joints, model.skeleton.parents
    pairs = [(row, joints.index(parents[joint]), joint) for row, joint in enumerate(joints) if parents[joint] in joints]
    own, above, joint = (list(column) for column in zip(*pairs, strict=True))
    lengths = np.linalg.norm(made.floating[:, own] - made.floating[:, above], axis=-1)
    return float(np.abs(lengths - np.linalg.norm(model.skeleton.offsets[joint], axis=-1)).max())


def _beyond(model: ThrowModel, motion: Motion) -> float:
    """Share of all rotations that lie beyond the joints' limits."""
    if model.joint_limits is None:
        return np.nan
    beyond = JointLimits(model.skeleton, model.joint_limits).beyond(matrices(motion))
    return float(np.mean(beyond > _WITHIN))


def _mean(values) -> float:
    """The mean of what are numbers; NaN where there are none."""
    values = np.asarray(values, float)
    values = values[np.isfinite(values)]
    return float(values.mean()) if len(values) else np.nan


def deviations(generated: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """(4,) m of one motion: mean distance over its frames; both (T, 4, 3) m in one frame of reference, the effectors
    in the order left hand, right hand, left foot, right foot."""
    return np.linalg.norm(np.asarray(generated, float) - np.asarray(wanted, float), axis=-1).mean(axis=0)


def find_lost(deviations: np.ndarray) -> np.ndarray:
    """(N,) bool: which motions of deviations (N, 4) m lost their body."""
    deviations = np.asarray(deviations, float).reshape(-1, 4)
    return ~np.all(deviations < LOST, axis=-1)


def let_go(
    motion: Motion, joint: int, grip: np.ndarray, release: float, shift: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Place (3,) m and velocity (3,) m/s at the fractional frame `release` of a ball that a hand joint holds.

    grip: (3,) m, the ball's centre in the joint's own axes. shift: (T, 3) m, how far from the motion's the hand is in
    each frame, for networks whose joints float."""
    from scipy.interpolate import CubicSpline

    frames = np.clip(release + np.array([-_HALF, 0.0, _HALF]), 0.0, len(motion) - 1)
    places, turns = pose_kinematics(motion.skeleton, *cubic_at(motion, frames))
    ball = places[:, joint] + quaternion.rotate(turns[:, joint], np.asarray(grip, float))
    if shift is not None:
        ball = ball + CubicSpline(np.arange(len(motion)), shift)(frames)
    return ball[1], (ball[2] - ball[0]) * motion.fps / (frames[2] - frames[0])


def find_impact(place: np.ndarray, velocity: np.ndarray, target: np.ndarray, ball: Ball = BASEBALL) -> np.ndarray:
    """(3,) m: where a ball without spin, let go at `place` (3,) m with velocity (3,) m/s, first crosses the upright
    plane through the target square to the level line to it, or meets the ground before; NaN where it does neither."""
    return find_crossing(fly(Launch(0.0, place, velocity), ball, _LONGEST), target)
